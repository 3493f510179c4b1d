"""Scenes from TOML files: docs/scenes.md describes them, scene_schema.py says what they may hold."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from . import files, gltf_materials, meshes, scene_schema, toml_lines
from .errors import InputError
from .scene_schema import BRIGHTEST, LARGEST, Place, measured

DISC_SECTORS = 512
LOSSY = {"DWAA", "DWAB", "B44", "B44A", "PXR24"}
UNDERSHOOT = 0.02  # of a lossy picture's energy: how much the values below 0 may be that its compression left
MAX_ENVIRONMENT = 16384  # pixels, its width
RESOLVED = 1e-5  # a size as part of the distance from the origin, so that float32 has some hundred steps for it
TOUCHING = 1e-6  # a distance as part of the object's size, below which float32 tells nothing
INSIDE = 0.5  # winding number, which is 1 inside of a closed surface, -1 inside of one turned inwards, and 0 outside


@dataclass
class SceneFile:
    """A scene file, read and built.

    scene    lobe.reference.Scene
    camera   lobe.reference.Camera
    film, render   what the file says of them, by key
    objects, lights   names by id
    notes    one line for each thing that is probably not meant
    identity   hash of everything that a pixel depends on, except for size, samples and seed
    """

    path: Path
    scene: object
    camera: object
    film: dict
    render: dict
    objects: list[str]
    lights: list[str]
    notes: list[str]
    identity: str
    place: Place = field(repr=False, default=None)

    @property
    def name(self) -> str:
        return self.path.stem


def load(path: Path) -> SceneFile:
    """Reads a scene file and builds what it describes. InputError with file, line and key."""
    path = Path(path)
    tables, lines = toml_lines.load(path)
    place = Place(path, lines)
    described = scene_schema.read(tables, place)
    return _Builder(place, described).built()


class _Builder:
    def __init__(self, place: Place, described: dict):
        from lobe import reference

        self.reference = reference
        self.place, self.described = place, described
        self.scene = reference.Scene()
        self.notes: list[str] = []
        self.objects: list[str] = []
        self.solids: list[_Solid] = []
        self.lights: list[str] = []
        self.used: set[str] = set()  # names of materials
        self.digest = hashlib.sha256()

    def built(self) -> SceneFile:
        eye = np.array(self.described["camera"]["eye"])
        self._names("objects"), self._names("lights")
        for i, thing in enumerate(self.described["objects"]):
            self._object(thing, self.place / "objects" / i)
        for i, light in enumerate(self.described["lights"]):
            self._light(light, self.place / "lights" / i)
        self._environment()
        camera = self._camera(eye)
        self._note_enclosed_lights()
        self._note_flush_lights()
        if not self.lights:
            self.place.fail("has no light, expected [[lights]] or [environment]")
        self._note_unused()
        told = {k: v for k, v in self.described.items() if k in ("camera", "lights")}
        self._remember(json.dumps(told, sort_keys=True).encode())
        return SceneFile(self.place.file, self.scene, camera, self.described["film"], self.described["render"],
                         self.objects, self.lights, self.notes, self.digest.hexdigest()[:32], self.place)

    def _note(self, place: Place, text: str) -> None:
        self.notes.append(f"{place}: {text}")

    def _remember(self, *parts) -> None:
        """Takes arrays, bytes and numbers into the hash."""
        for part in parts:
            array = part if isinstance(part, bytes) else np.ascontiguousarray(part).tobytes()
            self.digest.update(len(array).to_bytes(8, "little") + array)

    def _names(self, kind: str) -> None:
        """Gives names to what has none, and refuses a name that is taken twice."""
        taken = {"environment"}
        for i, thing in enumerate(self.described[kind]):
            if thing["name"] in taken:
                (self.place / kind / i / "name").fail(f'"{thing["name"]}" is taken, expected a name of its own')
            if thing["name"]:
                taken.add(thing["name"])
        for i, thing in enumerate(self.described[kind]):
            word = thing["file"].stem if "file" in thing else thing.get("shape") or thing["type"]
            names = (word, *(f"{word}-{number}" for number in range(i + 1, i + 2 + len(taken))))
            thing["name"] = thing["name"] or next(name for name in names if name not in taken)
            taken.add(thing["name"])

    # Objects.

    def _object(self, thing: dict, place: Place) -> None:
        for shape, material, suffix in self._parts(thing, place):
            added = shape.add_to(self.scene)
            assert added == len(self.objects)
            self.objects.append(thing["name"] + suffix)
            self.solids.append(_Solid(self.objects[-1], shape))
            self._apply(material, added, place)
            self._remember(*shape.arrays)

    def _parts(self, thing: dict, place: Place):
        """(shape, material, suffix of the name) of what an object is: one, or the primitives of a glTF file."""
        if thing["shape"] != "mesh":
            return [(_placed_shape(thing, place), self._material(thing, place), "")]
        if thing["file"].suffix.lower() in (".gltf", ".glb") and thing["material"] is None:
            parts = (place / "file").reading(meshes.load_parts, thing["file"])
            materials = [self._gltf_material(material, place) for _, material in parts]
        else:
            parts = [((place / "file").reading(meshes.load, thing["file"]), None)]
            materials = [self._material(thing, place)]
        if skipped := sum(mesh.skipped for mesh, _ in parts):
            self._note(place / "file", f"{skipped} degenerate triangle{'s' * (skipped > 1)} skipped")
        placed = _placed_meshes([mesh for mesh, _ in parts], thing, place)
        suffixes = [f".{i + 1}" if len(parts) > 1 else "" for i in range(len(parts))]
        return list(zip(placed, materials, suffixes))

    def _material(self, thing: dict, place: Place) -> dict:
        known = self.described["materials"]
        choices = f"one of {', '.join(known)}" if known else "the name of a table [materials.NAME]"
        if thing["material"] is None:
            place.fail(f"has no material, expected material = {choices}")
        if thing["material"] not in known:
            near = scene_schema.nearest(thing["material"], known)
            (place / "material").fail(f'"{thing["material"]}" is no material{near}, expected {choices}')
        self.used.add(thing["material"])
        material = known[thing["material"]]
        where = self.place / "materials" / thing["material"]
        return {"lobes": [(lobe["key"], _numbers(lobe["parameters"])) for lobe in material["lobes"]],
                "mirror": _mirror(material["mirror"], where / "mirror"), "glass": material["glass"]}

    def _gltf_material(self, material: dict, place: Place) -> dict:
        name = material.get("name", "without a name") if isinstance(material, dict) else material
        label = f'material "{name}": '

        def warn(what: str) -> None:
            note = f"{place / 'file'}: {label}{what}"
            if note not in self.notes:
                self.notes.append(note)

        try:
            return gltf_materials.translated(material, warn)
        except (TypeError, ValueError, AttributeError, OverflowError):
            (place / "file").fail(f"{label}is no glTF 2 material; export the file again")

    def _apply(self, material: dict, added: int, place: Place) -> None:
        self._remember(json.dumps(material, sort_keys=True).encode())
        given = {name: material[name] for name in ("mirror", "glass") if material[name]}
        try:
            self.scene.set_material(added, material["lobes"], **given)
        except ValueError as error:
            (place / "material").fail(str(error))

    def _note_unused(self) -> None:
        if self.described["view"]:  # a session of the viewer, whose other materials are held against the first
            return
        for name in sorted(set(self.described["materials"]) - self.used):
            self._note(self.place / "materials" / name, "is used by no object")

    # Lights.

    def _light(self, light: dict, place: Place) -> None:
        if not any(light[key] for key in ("radiance", "intensity", "irradiance") if key in light and any(light[key])):
            place.fail("shines not at all, expected some channel above 0")
        try:
            _LIGHTS[light["type"]](self.scene, light, place)
        except ValueError as error:
            place.fail(str(error))
        self.lights.append(light["name"])

    def _note_enclosed_lights(self) -> None:
        for light, thing in self.scene.enclosed_lights():
            self._note(self.place / "lights" / light,
                       f"lies inside of the closed object {self.objects[thing]}, out of which it lights nothing")

    def _note_flush_lights(self) -> None:
        for i, light in enumerate(self.described["lights"]):
            if light["type"] != "rectangle":
                continue
            center, u, v = _rectangle(light, self.place / "lights" / i)
            points = [center + (a * u + b * v) / 2 for a in (-1, 0, 1) for b in (-1, 0, 1)]
            for solid in self.solids:
                if all(solid.shape.touches(point) for point in points):
                    self._note(self.place / "lights" / i, f"lies in the surface of {solid.name}, so that a ray may meet "
                               "either; move it towards its target by a thousandth of its size")

    def _environment(self) -> None:
        given, place = self.described["environment"], self.place / "environment"
        if given is None:
            return
        if (given["file"] is None) == (given["color"] is None):
            place.fail("expected either file or color, one of them")
        if given["file"]:
            with np.errstate(over="ignore"):  # told below
                pixels = (place / "file").reading(read_environment, given["file"]) * np.array(given["scale"], np.float32)
        else:
            pixels = np.tile(np.array(given["color"], np.float32), (8, 16, 1))
        if not pixels.any():
            place.fail("has no energy, all of it is 0; leave out [environment] for darkness")
        if not pixels.max() <= BRIGHTEST:
            (place / "scale").fail(f"makes radiance up to {pixels.max():.3g}, expected up to {BRIGHTEST:g}; choose a "
                                   "smaller one")
        self.scene.set_environment(pixels, given["rotation"])
        self.lights.append("environment")
        self._remember(pixels, given["rotation"])

    # The camera.

    def _camera(self, eye: np.ndarray):
        given, place = self.described["camera"], self.place / "camera"
        for solid in self.solids:
            if solid.shape.touches(eye):
                (place / "eye").fail(f"lies on the surface of {solid.name}, expected it outside of all objects")
            if solid.holds(eye):
                (place / "eye").fail(f"lies inside of {solid.name}, expected it outside of all objects")
        for i, light in enumerate(self.described["lights"]):
            if light["type"] == "sphere" and np.linalg.norm(eye - light["center"]) <= light["radius"]:
                (place / "eye").fail(f"lies inside of the light {self.lights[i]}, expected it outside")
        try:
            return self.reference.Camera(given["eye"], given["target"], given["up"], given["fov"])
        except ValueError as error:
            place.fail(str(error))


def _numbers(parameters: dict) -> dict[str, tuple[float, ...]]:
    return {name: value if isinstance(value, tuple) else (value,) for name, value in parameters.items()}


def _mirror(given: dict | None, place: Place) -> dict | None:
    if given is None:
        return None
    forms = [keys for keys in (("metal",), ("f0",), ("eta", "k")) if any(given[key] is not None for key in keys)]
    if len(forms) != 1 or any(given[key] is None for key in forms[0]):
        place.fail("expected one of metal, f0, or eta and k together")
    if given["metal"]:
        from_metal = (place / "metal").reading(measured, given["metal"])
        return {key: from_metal[key] for key in ("eta", "k")}
    return {key: given[key] for key in forms[0]}


# Lights: each adds one to a scene.


def _rectangle(light: dict, place: Place) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Its centre, and from there half of its width and half of its height."""
    center, target = np.array(light["center"]), np.array(light["target"])
    if not (facing := target - center).any():
        (place / "target").fail("is the center, expected another point, which the light faces")
    facing /= np.linalg.norm(facing)
    level = np.cross((0.0, 1.0, 0.0), facing)
    level = level / np.linalg.norm(level) if np.linalg.norm(level) > 1e-6 else np.array((1.0, 0.0, 0.0))
    width, height = light["size"]
    return center, level * (width / 2), np.cross(facing, level) * (height / 2)


def _rectangle_light(scene, light: dict, place: Place) -> None:
    scene.add_rectangle_light(*_rectangle(light, place), light["radiance"])


def _sphere_light(scene, light: dict, place: Place) -> None:
    scene.add_sphere_light(light["center"], light["radius"], light["radiance"])


def _point(scene, light: dict, place: Place) -> None:
    scene.add_point_light(light["position"], light["intensity"])


def _directional(scene, light: dict, place: Place) -> None:
    scene.add_directional_light(light["direction"], light["irradiance"])


_LIGHTS = {"rectangle": _rectangle_light, "sphere": _sphere_light, "point": _point, "directional": _directional}


# Shapes where they stand in the scene.


@dataclass(frozen=True)
class _Ball:
    center: np.ndarray
    radius: float

    @property
    def arrays(self):
        return self.center, self.radius

    def add_to(self, scene) -> int:
        return scene.add_sphere(self.center, self.radius)

    def winding(self, point: np.ndarray) -> float:
        return float(np.linalg.norm(point - self.center) < self.radius)

    def touches(self, point: np.ndarray) -> bool:
        return abs(np.linalg.norm(point - self.center) - self.radius) <= TOUCHING * self.radius


@dataclass(frozen=True)
class _Square:
    center: np.ndarray
    normal: np.ndarray
    tangent: np.ndarray
    half_size: float

    @property
    def arrays(self):
        return self.center, self.normal, self.tangent, self.half_size

    def add_to(self, scene) -> int:
        return scene.add_plane(self.center, self.normal, self.half_size, self.tangent)

    def winding(self, point: np.ndarray) -> float:
        return 0.0

    def touches(self, point: np.ndarray) -> bool:
        axes = np.stack([self.tangent, np.cross(self.normal, self.tangent), self.normal])
        reach = np.array((1 + TOUCHING, 1 + TOUCHING, TOUCHING)) * self.half_size
        return bool((np.abs(axes @ (point - self.center)) <= reach).all())


@dataclass(frozen=True)
class _Triangles:
    mesh: meshes.Mesh
    tangents: np.ndarray | None = None

    @property
    def arrays(self):
        m = self.mesh
        return [np.zeros(0) if x is None else x for x in (m.vertices, m.faces, m.normals, m.uv, self.tangents)]

    def add_to(self, scene) -> int:
        m = self.mesh
        return scene.add_mesh(m.vertices, m.faces, normals=m.normals, uv=m.uv, tangents=self.tangents)

    def winding(self, point: np.ndarray) -> float:
        """Solid angle of all triangles, with their sign, over 4 pi (van Oosterom and Strackee 1983, eq. 8)."""
        if (point < self.mesh.vertices.min(axis=0)).any() or (point > self.mesh.vertices.max(axis=0)).any():
            return 0.0
        a, b, c = (self.mesh.vertices[corner] - point for corner in self.mesh.faces.T)
        la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
        volume = _dot(a, np.cross(b, c))
        angle = 2 * np.arctan2(volume, la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb)
        return float(angle.sum() / (4 * np.pi))

    def touches(self, point: np.ndarray) -> bool:
        low, high = self.mesh.vertices.min(axis=0), self.mesh.vertices.max(axis=0)
        near = TOUCHING * (high - low).max()
        if (point < low - near).any() or (point > high + near).any():
            return False
        a, b, c = (self.mesh.vertices[corner] - point for corner in self.mesh.faces.T)
        areas = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])  # twice, seen from the point
        whole = areas.sum(axis=0)
        size = np.linalg.norm(whole, axis=1)
        shares = np.einsum("kfi,fi->kf", areas, whole) / size**2  # of its foot on the triangle's plane
        return bool(((np.abs(_dot(a, whole)) <= near * size) & (shares >= -TOUCHING).all(axis=0)).any())


@dataclass(frozen=True)
class _Solid:
    """An object that can hold something."""

    name: str
    shape: object

    def holds(self, point: np.ndarray) -> bool:
        return self.shape.winding(np.asarray(point, float)) > INSIDE


def _rotation(degrees) -> np.ndarray:
    """The matrix that turns around x, then y, then z."""
    matrix = np.eye(3)
    for axis, angle in enumerate(np.radians(degrees)):
        turn, (i, j) = np.eye(3), [(1, 2), (2, 0), (0, 1)][axis]
        turn[i, i] = turn[j, j] = np.cos(angle)
        turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
        matrix = turn @ matrix
    return matrix


def _placed_shape(thing: dict, place: Place):
    """The unit sphere, or the square or disc of half size 1 that faces +y, where its object has it."""
    if thing["shape"] == "sphere":
        scale = _uniform(thing, place, "sphere")
        if any(thing["rotate"]):
            (place / "rotate").fail("a sphere stays as it is, expected no rotation; T runs around the y axis")
        center = np.array(thing["translate"])
        if thing["rest_on"] is not None:
            center[1] = thing["rest_on"] + scale
        _require_resolved(2 * scale, abs(center).max(), place)
        return _Ball(center, scale)
    scale = np.array(thing["scale"]) * ((thing["fit"] or 2.0) / 2)
    if thing["shape"] == "plane" and scale[0] == scale[2]:
        turn = _rotation(thing["rotate"])
        square = _Square(np.array(thing["translate"]), turn[:, 1], turn[:, 0], scale[0])
        if thing["rest_on"] is not None:
            reach = scale[0] * (abs(turn[1, 0]) + abs(turn[1, 2]))
            square = replace(square, center=square.center * (1, 0, 1) + (0, thing["rest_on"] + reach, 0))
        _require_resolved(2 * scale[0], abs(square.center).max(), place)
        return square
    mesh, tangents = _disc() if thing["shape"] == "disc" else _rectangle_mesh()
    (placed,) = _placed_meshes([mesh], thing | {"flat": False}, place, [tangents])
    return placed


def _require_resolved(extent: float, reach: float, place: Place) -> None:
    if not extent > RESOLVED * reach:
        place.fail(f"is {extent:.3g} large and {reach:.3g} away, which float32 does not resolve; scale it up")


def _uniform(thing: dict, place: Place, shape: str) -> float:
    if len(set(thing["scale"])) > 1:
        (place / "scale").fail(f"a {shape} stays round, expected one number for all axes; a mesh can be stretched")
    return thing["scale"][0] * ((thing["fit"] or 2.0) / 2)


def _disc() -> tuple[meshes.Mesh, np.ndarray]:
    """A disc of radius 1 that faces +y, and tangents around its middle; every sector has a middle of its own."""
    angle = 2 * np.pi * np.arange(DISC_SECTORS + 1) / DISC_SECTORS
    middle = (angle[:-1] + angle[1:]) / 2
    rim = np.stack([np.cos(angle), np.zeros_like(angle), -np.sin(angle)], axis=1)
    vertices = np.concatenate([rim, np.zeros((DISC_SECTORS, 3))])
    around = np.concatenate([angle, middle])
    first = np.arange(DISC_SECTORS, dtype=np.uint32)
    faces = np.stack([first + DISC_SECTORS + 1, first, first + 1], axis=1)
    uv = np.stack([around / (2 * np.pi), np.repeat((1.0, 0.0), (DISC_SECTORS + 1, DISC_SECTORS))], axis=1)
    tangents = np.stack([-np.sin(around), np.zeros_like(around), -np.cos(around)], axis=1)
    return meshes.Mesh(vertices, faces, np.tile((0.0, 1.0, 0.0), (len(vertices), 1)), uv), tangents


def _rectangle_mesh() -> tuple[meshes.Mesh, None]:
    vertices = np.array([(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)], float)
    return meshes.Mesh(vertices, np.array([(0, 1, 2), (0, 2, 3)], np.uint32), np.tile((0.0, 1.0, 0.0), (4, 1)),
                       (vertices[:, [0, 2]] * (1, -1) + 1) / 2), None


def _placed_meshes(parts: list[meshes.Mesh], thing: dict, place: Place, tangents=None) -> list[_Triangles]:
    """Meshes that belong together, fitted, scaled, turned and moved as one."""
    low = np.min([m.vertices.min(axis=0) for m in parts], axis=0)
    high = np.max([m.vertices.max(axis=0) for m in parts], axis=0)
    center, factor = np.zeros(3), 1.0
    if thing["fit"] is not None:
        center, factor = (low + high) / 2, thing["fit"] / (high - low).max()
    linear = _rotation(thing["rotate"]) @ np.diag(np.array(thing["scale"]) * factor)
    moved = [(m.vertices - center) @ linear.T + thing["translate"] for m in parts]
    if thing["rest_on"] is not None:
        lift = thing["rest_on"] - min(v[:, 1].min() for v in moved)
        moved = [v + (0.0, lift, 0.0) for v in moved]
    reach = max(np.abs(v).max() for v in moved)
    extent = (np.max([v.max(axis=0) for v in moved], axis=0) - np.min([v.min(axis=0) for v in moved], axis=0)).max()
    if not reach <= LARGEST:
        place.fail(f"reaches to {reach:.3g}, expected coordinates up to {LARGEST:g}; fit = 2 makes its longest side 2")
    _require_resolved(extent, reach, place)
    inverse = np.linalg.inv(linear)
    turned = []
    for m, v, t in zip(parts, moved, tangents or [None] * len(parts)):
        normals = None if m.normals is None else _unit(m.normals @ inverse)
        mesh = replace(m, vertices=v, normals=normals)
        turned.append(_Triangles(_flat(mesh) if thing["flat"] else mesh, None if t is None else _unit(t @ linear.T)))
    return turned


def _flat(mesh: meshes.Mesh) -> meshes.Mesh:
    """Every triangle with vertices of its own, and its normal on them."""
    corners = mesh.faces.reshape(-1)
    vertices = mesh.vertices[corners]
    a, b, c = vertices.reshape(-1, 3, 3).transpose(1, 0, 2)
    normals = np.repeat(_unit(np.cross(b - a, c - a)), 3, axis=0)
    faces = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
    uv = None if mesh.uv is None else mesh.uv[corners]
    return replace(mesh, vertices=vertices, faces=faces, normals=normals, uv=uv)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("fi,fi->f", a, b)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


# Environments.


def read_environment(file: Path) -> np.ndarray:
    """A light probe, float32 [h, w, 3], latitude-longitude, not negative. InputError for what is none. Lossy
    compression leaves some values below 0 beside bright lights: these become 0."""
    header = files.exr_header(file)
    width, height = header["width"], header["height"]
    if width != 2 * height:
        raise InputError(f"{file}: is {width} x {height}, expected a latitude-longitude picture, twice as wide as high")
    if width > MAX_ENVIRONMENT:
        raise InputError(f"{file}: is {width} x {height}, expected at most {MAX_ENVIRONMENT} wide; scale it down")
    if not {"R", "G", "B"} <= set(header["channels"]):
        raise InputError(f"{file}: has the channels {', '.join(header['channels'])}, expected R, G, B")
    channels = files.read_exr_channels(file)
    planes = [channels[name] for name in "RGB" if name in channels]
    if any(plane.dtype.kind != "f" for plane in planes):
        raise InputError(f"{file}: has whole numbers in R, G, B, expected radiance as half or float; convert it")
    if [plane.shape for plane in planes] != 3 * [(height, width)]:
        raise InputError(f"{file}: has fewer rows or columns of R, G or B than pixels, expected all; export it again "
                         "without subsampling")
    pixels = np.stack(planes, axis=-1, dtype=np.float32)
    _require(file, ~np.isfinite(pixels), pixels, "finite numbers")
    negative = pixels < 0
    if header["compression"] in LOSSY and _sum(-pixels[negative]) <= UNDERSHOOT * _sum(pixels):
        pixels[negative] = 0
    else:
        _require(file, negative, pixels, "no number below 0")
    return pixels


def _sum(values: np.ndarray) -> float:
    return float(values.sum(dtype=float))  # of float32 it might be infinite


def _require(file: Path, bad: np.ndarray, pixels: np.ndarray, expected: str) -> None:
    if bad.any():
        row, column = np.argwhere(bad.any(axis=-1))[0]
        found = ", ".join(f"{x:g}" for x in pixels[row, column])
        raise InputError(f"{file}: row {row}, column {column} is ({found}), expected {expected}; repair the picture")
