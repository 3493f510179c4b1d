"""The scenes of the comparison: an object in a light rig, seen by one fixed camera."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from . import meshes, probes, spectra
from .catalogue import Function, Parameter
from .errors import InputError
from .paths import DATA

EYE, TARGET, UP, FOV_Y = (1.7, 1.5, 4.3), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 30.0  # degrees


@dataclass(frozen=True)
class Light:
    """`vector` points towards a directional light, or is a point light's position; `color` is its irradiance facing
    it, or its intensity."""

    kind: str  # directional or point
    vector: tuple[float, float, float]
    color: tuple[float, float, float]


@dataclass(frozen=True)
class Rig:
    """Lights, and where in its range a scalar shape parameter lies in scenes of this rig (None: at its default), so
    that the scenes also see narrow and wide lobes. A probe takes the place of lights: both sides of the comparison see
    it through the same few directions with the same weights, so that no noise hides how their lobes differ."""

    lights: tuple[Light, ...] = ()
    shape: float | None = None
    probe: Path | None = None


RIGS = {
    "directional": Rig((Light("directional", (0.5, 0.8, 0.9), (3.0, 3.0, 3.0)),)),
    "point": Rig((Light("point", (1.2, 2.2, 2.0), (24.0, 22.0, 20.0)),), shape=0.35),
    "four": Rig(
        (
            Light("directional", (0.5, 0.8, 0.9), (2.0, 1.9, 1.8)),
            Light("directional", (-0.9, 0.5, 0.3), (0.5, 0.6, 0.9)),
            Light("point", (2.5, 0.3, 1.5), (2.4, 1.8, 1.2)),
            Light("point", (-1.0, 2.5, -1.5), (9.0, 9.0, 9.0)),
        )
    ),
    "grazing": Rig((Light("directional", (-1.0, 0.12, -0.35), (4.0, 4.0, 4.0)),), shape=0.85),
    "lobby": Rig(probe=DATA / "hdri" / "lobby.exr"),
}
DIRECTIONS = 64  # that stand for a probe

MESHES, METALS = DATA / "mesh", DATA / "ior"
SHAPES = {"sphere": None, "teapot": MESHES / "teapot.obj", "bunny": MESHES / "bunny.obj", "suzanne": MESHES / "suzanne.obj"}


@dataclass(frozen=True)
class Scene:
    """An object, and the rig that lights it.

    mesh    its file; None for the analytic sphere
    metal   measured n,k whose reflectance at normal incidence is f0 here, or None
    """

    object: str
    rig: str
    mesh: Path | None = None
    metal: Path | None = None

    @property
    def name(self) -> str:
        return f"{self.object}-{self.rig}"

    @property
    def lights(self) -> tuple[Light, ...]:
        return probe_lights(self.probe) if self.probe else RIGS[self.rig].lights

    @property
    def probe(self) -> Path | None:
        return RIGS[self.rig].probe

    @property
    def overrides(self) -> dict[str, tuple[float, ...]]:
        """Parameters that the object's material fixes."""
        return {"f0": metal_f0(self.metal)} if self.metal else {}

    def suits(self, function: Function) -> bool:
        """Whether the function is drawn here: it has geometry, and the parameters that the object's material fixes;
        under a probe, whose light is weighted, it is a lobe."""
        fixed = all((p := function.parameter(name)) and p.width == len(value) for name, value in self.overrides.items())
        return fixed and (function.kind == "lobe" if self.probe else function.is_shown)

    def is_in_domain(self, function: Function) -> bool:
        """Whether what the object's material fixes lies in the ranges that the function states."""
        return all(p.admits(self.overrides[p.name]) for p in function.parameters if p.name in self.overrides)

    def value(self, parameter: Parameter) -> tuple[float, ...]:
        """What a parameter is in this scene, unless the user sets it."""
        shape = RIGS[self.rig].shape
        if parameter.name in self.overrides:
            return self.overrides[parameter.name]
        if parameter.kind != "float" or shape is None:
            return parameter.default
        low, high = parameter.low, parameter.high
        return (low * (high / low) ** shape if low > 0 else low + (high - low) * shape,)


SCENES = {
    scene.name: scene
    for scene in (
        # The bunny's licence keeps it out of the installed package.
        *(Scene(shape, rig, mesh) for shape, mesh in SHAPES.items() if mesh is None or mesh.exists()
          for rig in RIGS if not RIGS[rig].probe),
        Scene("sphere", "lobby"),
        Scene("teapot", "lobby", SHAPES["teapot"]),
        Scene("gold-teapot", "four", SHAPES["teapot"], METALS / "Au_Johnson.csv"),
        Scene("aluminium-teapot", "four", SHAPES["teapot"], METALS / "Al_McPeak.csv"),
    )
}
QUICK = ("sphere-directional", "sphere-point", "teapot-directional", "teapot-point")
SHOWN = "teapot-directional"  # the scene that the report shows of each lobe, and that FLIP looks at


def find(name: str) -> Scene:
    if name not in SCENES:
        raise InputError(f"unknown scene '{name}': expected one of {', '.join(SCENES)}")
    return SCENES[name]


@cache
def metal_f0(file: Path) -> tuple[float, ...]:
    """Linear sRGB reflectance at normal incidence, from a file of measured n,k."""
    return tuple(float(x) for x in spectra.f0_linear_srgb(file))


@cache
def probe_lights(file: Path) -> tuple[Light, ...]:
    """Directional lights that stand for a probe."""
    towards, irradiance = probes.lights(probes.load(file), DIRECTIONS)
    return tuple(Light("directional", tuple(d), tuple(e)) for d, e in zip(towards.tolist(), irradiance.tolist()))


@cache
def load_mesh(file: Path) -> meshes.Mesh:
    """The mesh of a file, centred, its longest side 2."""
    return meshes.normalized(meshes.load(file))


GROUND_MATERIAL = [("lobe_Lambert(vec3,vec3,vec3,vec3)", {"albedo": (0.5, 0.5, 0.5)})]


def bare(mesh: Path | None):
    """The reference's scene with the object alone, id 0, and no light."""
    from lobe import reference

    built = reference.Scene()
    if mesh:
        m = load_mesh(mesh)
        built.add_mesh(m.vertices, m.faces, normals=m.normals, uv=m.uv)
    else:
        built.add_sphere((0.0, 0.0, 0.0), 1.0)
    return built


def camera():
    """The reference's camera of all scenes."""
    from lobe import reference

    return reference.Camera(EYE, TARGET, UP, FOV_Y)


def build(scene: Scene, ground: bool = False):
    """The reference's scene, its object having id 0 and the plane under it, if any, id 1; and its camera."""
    built = bare(scene.mesh)
    if ground:
        lowest = load_mesh(scene.mesh).vertices[:, 1].min() if scene.mesh else -1.0
        built.add_plane((0.0, lowest, 0.0), (0.0, 1.0, 0.0), 200.0)
    for light in scene.lights:
        add = built.add_directional_light if light.kind == "directional" else built.add_point_light
        add(light.vector, light.color)
    return built, camera()


@dataclass(frozen=True)
class Pixels:
    """What the reference sees at the centres of the pixels that show the object, in double.

    mask [h, w]; N, T, V [n, 3]; L, E [lights, n, 3], E being each light's irradiance on the surface, shadows included;
    primitive [n].
    """

    mask: np.ndarray
    N: np.ndarray
    T: np.ndarray
    V: np.ndarray
    L: np.ndarray
    E: np.ndarray
    primitive: np.ndarray

    def picture(self, values: np.ndarray) -> np.ndarray:
        """Values [n, k] at their places in an image [h, w, k]; 0 elsewhere."""
        image = np.zeros((*self.mask.shape, values.shape[-1]), values.dtype)
        image[self.mask] = values
        return image


@cache
def pixels(scene: Scene, size: int, shadows: bool = True) -> Pixels:
    built, camera = build(scene)
    return seen(built.trace(camera, size, size, shadows=shadows))


def seen(traced: dict[str, np.ndarray]) -> Pixels:
    """What the reference traced."""
    mask = traced["object"] >= 0
    return Pixels(mask, *(traced[k][mask] for k in ("N", "T", "V")), *(traced[k][:, mask] for k in ("L", "E")),
                  traced["primitive"][mask])
