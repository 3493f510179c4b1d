"""The object that is seen: its triangles for OpenGL, and the reference's scene with the same ones."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..lab import meshes, probes, scene_files, scenes
from ..lab.errors import InputError
from ..lab.scene_schema import MESHES, PICTURES, Place
from . import state as states
from .state import PLACEMENT, Environment, Lobe, State

SESSIONS = (".toml",)
SUFFIXES = (*MESHES, *PICTURES, *SESSIONS)  # of what can be opened
SPHERE = (96, 192)  # bands and sectors: the outline is off by 1.3e-4 of the radius


@dataclass(frozen=True)
class Thing:
    """Triangles with unit normals and tangents, as both sides use them."""

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    tangents: np.ndarray


def thing(state: State) -> Thing:
    """The object of a state. InputError where its file is none of a mesh."""
    file = scenes.SHAPES.get(state.object) or (None if state.object in ("sphere", "plane") else Path(state.object))
    stamp = _stamp(file) if file else 0
    placement = tuple(sorted((PLACEMENT | state.placement).items())) if state.placement else ()
    return _thing(state.object, file, stamp, placement)


@lru_cache(maxsize=4)
def _thing(name: str, file: Path | None, stamp: int, placement: tuple) -> Thing:
    from lobe import reference

    mesh = _mesh(name, file)
    if placement:
        where = Place(file or Path(name), {})
        mesh = scene_files._placed_meshes([mesh], dict(placement), where)[0].mesh
    elif file:
        mesh = meshes.normalized(mesh)
    built = reference.Scene()
    built.add_mesh(mesh.vertices, mesh.faces, normals=mesh.normals, uv=mesh.uv)
    return Thing(mesh.vertices, mesh.faces, built.normals(0), built.tangents(0))


def _mesh(name: str, file: Path | None) -> meshes.Mesh:
    if name == "sphere":
        return meshes.uv_sphere(*SPHERE)
    return scene_files._rectangle_mesh()[0] if name == "plane" else meshes.load(file)


@dataclass(frozen=True)
class Rays:
    """Directional and point lights: `vectors` [n, 4] as homogeneous positions, `colors` [n, 3]."""

    vectors: np.ndarray
    colors: np.ndarray


def rays(state: State) -> Rays:
    """The lights that shader and direct reference share: an environment stands for itself by scenes.DIRECTIONS."""
    vectors = [(*light.vector, 0.0 if light.kind == "directional" else 1.0) for light in state.lights]
    colors = [light.color for light in state.lights]
    if state.environment:
        towards, irradiance = environment_lights(state.environment)
        vectors += [(*d, 0.0) for d in towards.tolist()]
        colors += irradiance.tolist()
    return Rays(np.array(vectors, float).reshape(-1, 4), np.array(colors, float).reshape(-1, 3))


def environment_lights(environment: Environment) -> tuple[np.ndarray, np.ndarray]:
    """Directions towards a probe's light, turned as it is, and the irradiance facing each."""
    towards, irradiance = _environment_lights(environment.file, _stamp(environment.file))
    return towards @ turn(environment).T, irradiance * environment.scale


def turn(environment: Environment) -> np.ndarray:
    """The matrix that turns directions of the probe into those of the scene."""
    angle = np.radians(environment.rotation)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([(c, 0, s), (0, 1, 0), (-s, 0, c)])


@lru_cache(maxsize=2)
def _environment_lights(file: Path, stamp: int) -> tuple[np.ndarray, np.ndarray]:
    return probes.lights(_environment_pixels(file, stamp), scenes.DIRECTIONS)


def environment_pixels(file: Path) -> np.ndarray:
    """Radiance [h, w, 3]. InputError for what is no latitude-longitude picture."""
    return _environment_pixels(file, _stamp(file))


_stamps: dict[Path, int] = {}


def _stamp(file: Path) -> int:
    """When a file was written last; once it has been removed, as it was: what was read of it stays."""
    try:
        _stamps[file] = file.stat().st_mtime_ns
    except OSError:
        pass
    return _stamps.get(file, 0)


def opened(state: State, path: Path) -> tuple[State, list[str]]:
    """The state with a mesh or an environment, or the one that a session describes; and what of that is left out.
    InputError where it cannot be shown."""
    path, suffix = Path(path), Path(path).suffix.lower()
    if suffix in SESSIONS:
        new, notes = states.load(path)
    elif suffix in MESHES:
        new, notes = replace(state, object=str(path.resolve()), placement={}), []
    elif suffix in PICTURES:
        new, notes = replace(state, environment=Environment(path.resolve())), []
    else:
        raise InputError(f"{path}: is of an unknown kind, expected {' '.join(SUFFIXES)}")
    thing(new)
    if new.environment:
        environment_pixels(new.environment.file)
    return new, notes


@lru_cache(maxsize=2)
def _environment_pixels(file: Path, stamp: int) -> np.ndarray:
    pixels = scene_files.read_environment(file)
    if not pixels.any():
        raise InputError(f"{file}: has no light, expected a number above 0; all of it is black")
    return pixels


def direct_scene(state: State):
    """The reference's scene with the object and the lights of `rays`."""
    built = _bare(state)
    for vector, color in zip(*(x.tolist() for x in (rays(state).vectors, rays(state).colors))):
        (built.add_point_light if vector[3] else built.add_directional_light)(vector[:3], color)
    return built


def traced_scene(state: State):
    """The reference's scene with the object, its material, its lights and the whole environment."""
    built = _bare(state)
    built.set_material(0, [(lobe.key, dict(lobe.values)) for lobe in state.sides["A"]])
    for light in state.lights:
        (built.add_point_light if light.kind == "point" else built.add_directional_light)(light.vector, light.color)
    if state.environment:
        e = state.environment
        built.set_environment(environment_pixels(e.file) * np.array(e.scale, np.float32), e.rotation)
    return built


def _bare(state: State):
    from lobe import reference

    built, t = reference.Scene(), thing(state)
    built.add_mesh(t.vertices, t.faces, normals=t.normals, tangents=t.tangents)
    return built


def camera(state: State):
    """The reference's camera."""
    from lobe import reference

    return reference.Camera(state.eye, state.target, scenes.UP, state.fov)


def lobe_rows(lobe: Lobe, N, T, V, L) -> np.ndarray:
    """Arguments of a lobe as the reference takes them, float64 [n, width], from directions [n, 3]."""
    given = {"N": N, "T": T, "V": V, "L": L}
    columns = [given[p.name] if p.is_geometry else np.broadcast_to(np.float32(lobe.values[p.name]), (len(N), p.width))
               for p in lobe.function.parameters]
    return np.ascontiguousarray(np.concatenate(columns, axis=1), dtype=np.float64)


def reference_value(lobes: list[Lobe], N, T, V, L) -> np.ndarray:
    """The sum of the lobes in double, [n, 3]."""
    from lobe import reference

    total = np.zeros((len(N), 3))
    for lobe in lobes:
        total += reference.evaluate(lobe.key, lobe_rows(lobe, N, T, V, L))
    return total
