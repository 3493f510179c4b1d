"""What a scene file may hold: one table of keys, from which files are checked and docs/scenes.md is written."""

from __future__ import annotations

import difflib
import math
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from . import catalogue
from .catalogue import Function, Parameter
from .errors import InputError
from .toml_lines import KeyPath

LARGEST = 1e6  # of coordinates, so that float32 still resolves a millimetre in a metre-sized part of the scene
BRIGHTEST = 1e9
PICTURES = (".exr",)
STRATEGIES = ("mis", "light", "lobe")
MESHES = (".glb", ".gltf", ".obj", ".ply", ".stl")


@dataclass(frozen=True)
class Place:
    """A key of a scene file, for messages."""

    file: Path
    lines: dict[KeyPath, int]
    path: KeyPath = ()

    def __truediv__(self, key: str | int) -> Place:
        return Place(self.file, self.lines, (*self.path, key))

    @property
    def name(self) -> str:
        """lights[1].radiance, counted from 1 as people count."""
        text = "".join(f"[{key + 1}]" if isinstance(key, int) else f".{key}" for key in self.path)
        return text.removeprefix(".")

    @property
    def line(self) -> int:
        """Of the key, or of the nearest table around it that is written down."""
        path = self.path
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path, 1)

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.name}" if self.path else f"{self.file}:{self.line}"

    def fail(self, message: str):
        raise InputError(f"{self}: {message}")

    def reading(self, read: Callable, file: Path):
        """What `read` makes of a file that this key names; its complaints come with the key's place."""
        try:
            return read(file)
        except InputError as error:
            self.fail(str(error))


# Kinds of values. Each has `read(value, place)`, which returns the value as the program uses it or raises InputError,
# and says in `expected` what it takes.


@dataclass(frozen=True)
class Number:
    low: float = -math.inf
    high: float = math.inf
    above: bool = False  # low itself is not allowed
    whole: bool = False
    width: int = 1
    spread: bool = False  # one number stands for all `width`

    @property
    def expected(self) -> str:
        noun = "whole number" if self.whole else "number"
        if self.width > 1:
            noun = f"{'a number or ' if self.spread else ''}[{self.width} {noun}s]"
        else:
            noun = f"a {noun}"
        return noun + self.range

    @property
    def range(self) -> str:
        if self.low == -math.inf:
            return ""
        if self.above:
            return f" above {_short(self.low)}" + ("" if self.high == math.inf else f", up to {_short(self.high)}")
        return f" in {_short(self.low)}..{_short(self.high)}"

    def read(self, value, place: Place):
        values = value if isinstance(value, list) else [value] * (self.width if self.spread else 1)
        if isinstance(value, list) != (self.width > 1) and not self.spread or len(values) != self.width:
            self._fail(value, place)
        read = tuple(self._one(x, value, place) for x in values)
        return read if self.width > 1 else read[0]

    def _one(self, x, value, place: Place):
        if isinstance(x, bool) or not isinstance(x, int if self.whole else (int, float)):
            self._fail(value, place)
        if not (self.low < x if self.above else self.low <= x) or not x <= self.high or not math.isfinite(x):
            place.fail(f"{_written(value)} is out of range, expected {self.expected}")
        return x if self.whole else float(x)

    def _fail(self, value, place: Place):
        place.fail(f"{_written(value)}, expected {self.expected}")


def vector() -> Number:
    return Number(-LARGEST, LARGEST, width=3)


def colour(high: float = BRIGHTEST) -> Number:
    return Number(0.0, high, width=3, spread=True)


@dataclass(frozen=True)
class Flag:
    expected: str = "true or false"

    def read(self, value, place: Place) -> bool:
        return value if isinstance(value, bool) else place.fail(f"{_written(value)}, expected {self.expected}")


@dataclass(frozen=True)
class Choice:
    names: tuple[str, ...]

    @property
    def expected(self) -> str:
        return "one of " + ", ".join(f'"{name}"' for name in self.names)

    def read(self, value, place: Place) -> str:
        if value not in self.names:
            place.fail(f"{_written(value)}{nearest(value, self.names)}, expected {self.expected}")
        return value


@dataclass(frozen=True)
class Text:
    expected: str = "a name, of letters, digits, - and _"

    def read(self, value, place: Place) -> str:
        if not isinstance(value, str) or not re.fullmatch(r"[\w-]{1,64}", value):
            place.fail(f"{_written(value)}, expected {self.expected}")
        return value


@dataclass(frozen=True)
class File:
    """A file, relative to the scene's own folder."""

    suffixes: tuple[str, ...]

    @property
    def expected(self) -> str:
        return f"a file, {' '.join(self.suffixes)}"

    def read(self, value, place: Place) -> Path:
        if not isinstance(value, str) or not value or "\0" in value:
            place.fail(f"{_written(value)}, expected {self.expected}")
        path = place.file.parent / value
        if path.suffix.lower() not in self.suffixes:
            place.fail(f"{_written(value)} ends with '{path.suffix}', expected {self.expected}")
        if not os.path.isfile(path):
            place.fail(f"{_written(value)}: no such file; paths start at the scene's folder, {place.file.parent}")
        return path


@dataclass(frozen=True)
class Metal:
    """A metal that data/ior knows, or a table of measured n,k."""

    @property
    def expected(self) -> str:
        return f"a metal ({', '.join(metals())}) or a file .csv of wavelength_um,n,k"

    def read(self, value, place: Place) -> Path:
        if isinstance(value, str) and value.lower() in metals():
            return metals()[value.lower()]
        if not isinstance(value, str) or not value.lower().endswith(".csv"):
            place.fail(f"{_written(value)}{nearest(value, metals())}, expected {self.expected}")
        return File((".csv",)).read(value, place)


@cache
def metals() -> dict[str, Path]:
    """name -> its measured n,k."""
    from .metals import METALS

    return {metal.name: metal.path for metal in METALS}


@dataclass(frozen=True)
class Table:
    """A table with keys of its own, told apart by one of them where there are several forms."""

    keys: tuple[Key, ...]
    forms: dict[str, tuple[Key, ...]] = field(default_factory=dict)
    selector: str = ""
    expected: str = "a table"

    def read(self, value, place: Place) -> dict:
        if not isinstance(value, dict):
            place.fail(f"{_written(value)}, expected {self.expected}")
        if not self.forms:
            return read_table(value, self.keys, place)
        names = Choice(tuple(self.forms))
        if self.selector not in value:
            place.fail(f"has no {self.selector}, expected {self.selector} = {names.expected}")
        chosen = names.read(value[self.selector], place / self.selector)
        rest = {key: x for key, x in value.items() if key != self.selector}
        return {self.selector: chosen} | read_table(rest, (*self.forms[chosen], *self.keys), place)


@dataclass(frozen=True)
class List:
    """An array of one kind of thing."""

    kind: object

    @property
    def expected(self) -> str:
        return f"an array, each {self.kind.expected}"

    def read(self, value, place: Place) -> list:
        if not isinstance(value, list):
            place.fail(f"{_written(value)}, expected {self.expected}; an array of tables is written [[{place.name}]]")
        return [self.kind.read(x, place / i) for i, x in enumerate(value)]


@dataclass(frozen=True)
class Named:
    """Tables of one kind, by names that the user gives."""

    kind: object
    expected: str = "tables by name"

    def read(self, value, place: Place) -> dict:
        if not isinstance(value, dict):
            place.fail(f"{_written(value)}, expected {self.expected}: [{place.name}.NAME]")
        return {Text().read(name, place / name): self.kind.read(x, place / name) for name, x in value.items()}


@dataclass(frozen=True)
class Unread:
    """A table that somebody else reads."""

    expected: str = "a table"

    def read(self, value, place: Place) -> dict:
        return value if isinstance(value, dict) else place.fail(f"{_written(value)}, expected {self.expected}")


@dataclass(frozen=True)
class LobeTable:
    """A lobe of the library with its parameters; their ranges are those of the GLSL headers."""

    expected: str = "a table such as { lobe = \"lobe_GGX\", f0 = 0.04, alpha = 0.1 }"

    def read(self, value, place: Place) -> dict:
        if not isinstance(value, dict) or not isinstance(value.get("lobe"), str):
            place.fail(f"{_written(value)}, expected {self.expected}")
        given = set(value) - {"lobe", "metal"}
        function = self._function(value["lobe"], given, place / "lobe")
        metal = Metal().read(value["metal"], place / "metal") if "metal" in value else None
        parameters = [p for p in function.parameters if not p.is_geometry]
        from_metal = (place / "metal").reading(measured, metal) if metal else {}
        filled = [p.name for p in parameters if p.name in from_metal and p.width == 3]
        if metal and not filled:
            (place / "metal").fail(f"{function.name} has no f0, eta or k of three channels that a metal could fill")
        if doubly := given & set(filled):
            (place / min(doubly)).fail("is also what metal says; give one of them")
        keys = tuple(parameter_key(p) for p in parameters if p.name not in filled)
        rest = {k: x for k, x in value.items() if k not in ("lobe", "metal")}
        parameters = read_table(rest, keys, place) | {name: from_metal[name] for name in filled}
        return {"key": function.key, "parameters": parameters}

    def _function(self, name: str, given: set[str], place: Place) -> Function:
        known = lobes()
        if name not in known:
            place.fail(f'"{name}", expected a lobe of N, V, L{catalogue.like(name, known)}')
        return next((f for f in known[name] if given <= {p.name for p in f.parameters}), known[name][0])


@cache
def lobes() -> dict[str, tuple[Function, ...]]:
    """The lobes that a material can sum, and their overloads."""
    library = catalogue.load()
    names = dict.fromkeys(f.name for f in library.functions if f.takes_vectors)
    return {name: tuple(f for f in library.find(name) if f.takes_vectors) for name in names}


def header_range(function: str, parameter: str, width: int = 1) -> Number:
    """The range that a header of glsl/ states, for what is no lobe's parameter."""
    known = {q for f in catalogue.load().find(function) for q in f.parameters}
    return next(_range(q) for q in known if q.name == parameter and q.width == width)


def _range(p: Parameter) -> Number:
    return Number(p.low, p.high, width=p.width, spread=p.width > 1)


def parameter_key(p: Parameter) -> Key:
    return Key(p.name, _range(p), p.meaning, p.default if p.width > 1 else p.default[0], p.unit)


@cache
def measured(metal: Path) -> dict[str, tuple[float, ...]]:
    """f0, eta and k, linear sRGB, of a file of measured n,k: as glsl/metals.glsl has them."""
    from .metals import Metal as Measured, fitted

    fit = fitted(Measured("", "", str(metal), "", ()))
    return {name: tuple(float(x) for x in getattr(fit, name)) for name in ("f0", "eta", "k")}


REQUIRED = object()


@dataclass(frozen=True)
class Key:
    name: str
    kind: object
    meaning: str
    default: object = REQUIRED
    unit: str = ""


def read_table(value: dict, keys: tuple[Key, ...], place: Place) -> dict:
    """The values of a table by key, with what is not given at its default."""
    known = [key.name for key in keys]
    for name in value:
        if name not in known:
            (place / name).fail(f"unknown key{nearest(name, known)}, expected one of {', '.join(known)}")
    for key in keys:
        if key.name not in value and key.default is REQUIRED:
            place.fail(f"has no {key.name}, expected {key.name} = {key.kind.expected}")
    return {key.name: key.kind.read(value[key.name], place / key.name) if key.name in value else key.default
            for key in keys}


def nearest(name, known) -> str:
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5) if isinstance(name, str) else []
    return f", did you mean {near[0]}?" if near else ""


def _written(value) -> str:
    """A value as TOML, short."""
    if isinstance(value, bool):
        return str(value).lower()
    text = f'"{value}"' if isinstance(value, str) else "a table" if isinstance(value, dict) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _short(number: float) -> str:
    return str(number) if isinstance(number, int) else f"{number:g}".replace("e+0", "e").replace("e-0", "e-")


def _schema() -> dict[str, Key]:
    any_size, index = Number(0.0, LARGEST, above=True), header_range("lobe_F_conductor", "eta", 3)
    name = Key("name", Text(), "what messages, and the parts of the picture, call it", "")
    place = (
        Key("fit", any_size, "centre the mesh's box at the origin and scale its longest side to this", None),
        Key("scale", Number(1e-6, 1e6, width=3, spread=True), "then scale", (1.0, 1.0, 1.0)),
        Key("rotate", Number(-3600.0, 3600.0, width=3), "then turn around x, then y, then z", (0.0, 0.0, 0.0),
            "degrees"),
        Key("translate", vector(), "then move", (0.0, 0.0, 0.0)),
        Key("rest_on", Number(-LARGEST, LARGEST), "then move up or down until the lowest point has this y", None),
    )
    material = Key("material", Text(), "name of a material; a glTF mesh has its own where this is missing", None)
    return {key.name: key for key in (
        Key("film", Table((
            Key("width", Number(1, 1 << 16, whole=True), "of the picture; --size replaces it", 1280, "pixels"),
            Key("height", Number(1, 1 << 16, whole=True), "of the picture; pixels are square", 720, "pixels"),
            Key("exposure", Number(-20.0, 20.0), "of the PNG alone: its values are multiplied by 2 to this", 0.0,
                "stops"),
            Key("layers", Flag(), "where there are several lights, write a part for each", True),
        )), "the picture", {}),
        Key("camera", Table((
            Key("eye", vector(), "where it stands"),
            Key("target", vector(), "what it looks at"),
            Key("up", vector(), "what is up in the picture", (0.0, 1.0, 0.0)),
            Key("fov", Number(0.01, 179.0), "from the bottom edge to the top edge", 30.0, "degrees"),
        )), "a pinhole camera"),
        Key("render", Table((
            Key("spp", Number(1, 1 << 24, whole=True), "samples a pixel", 256),
            Key("error", Number(0.0, 1.0), "stop where the standard error, of the mean, is less; 0: never", 0.0),
            Key("depth", Number(0, 1 << 10, whole=True), "surface interactions of the longest path: 1 is direct light "
                "alone, 0 shows only what shines by itself", 8),
            Key("roulette", Number(0, 1 << 10, whole=True), "interactions after which Russian roulette begins", 4),
            Key("seed", Number(0, (1 << 53) - 1, whole=True), "of the random numbers", 0),
            Key("strategy", Choice(STRATEGIES), "how light is found: both ways combined, by the lights, "
                "or by the lobes", "mis"),
            Key("adaptive", Flag(), "noisier parts get more samples, spp on an average; without bias", False),
            Key("guided", Flag(), "photons tell paths where light comes through glass or off mirrors; without bias", True),
            Key("share", Flag(), "near pixels share light that their paths find on Lambertian surfaces; without bias, but "
                "their noise is then alike", True),
        )), "how it is rendered", {}),
        Key("environment", Table((
            Key("file", File(PICTURES), "a latitude-longitude OpenEXR picture, linear, its first row up", None),
            Key("color", colour(), "radiance from everywhere, where there is no file", None, "W/(m² sr)"),
            Key("scale", colour(), "factor on the file's radiance", (1.0, 1.0, 1.0)),
            Key("rotation", Number(-3600.0, 3600.0), "around the y axis", 0.0, "degrees"),
        )), "light from infinitely far away, on all sides", None),
        Key("materials", Named(Table((
            Key("lobes", List(LobeTable()), "lobes of the library, which are summed", ()),
            Key("mirror", Table((
                Key("metal", Metal(), "fills eta and k", None),
                Key("f0", colour(1.0), "reflectance along the normal, Schlick's approximation from there", None),
                Key("eta", index, "index of refraction", None),
                Key("k", header_range("lobe_F_conductor", "k", 3), "extinction", None),
            )), "an ideal mirror, added to the lobes", None),
            Key("glass", Table((
                Key("eta", header_range("lobe_F_dielectric", "eta"), "index of refraction of what is inside", 1.5),
            )), "an ideal dielectric, added to the lobes", None),
        ))), "what surfaces are made of, by name", {}),
        Key("objects", List(Table((name, material, *place), {
            "mesh": (Key("file", File(MESHES), "triangles"),
                     Key("flat", Flag(), "show facets, without the file's normals or smooth ones", False)),
            "sphere": (), "plane": (), "disc": (),
        }, "shape", 'a table with shape = "mesh", "sphere", "plane" or "disc"')),
            "what is seen, on the side of its normals: from behind, all but glass is black", ()),
        Key("lights", List(Table((name,), {
            "rectangle": (Key("center", vector(), "of the rectangle"),
                          Key("target", vector(), "the point that it faces; it shines to that side only"),
                          Key("size", Number(0.0, LARGEST, above=True, width=2), "width, level unless it faces "
                              "straight up or down, when it is along x; and height"),
                          Key("radiance", colour(), "of each point, in every direction", unit="W/(m² sr)")),
            "sphere": (Key("center", vector(), "of the sphere"),
                       Key("radius", any_size, "of the sphere"),
                       Key("radiance", colour(), "of each point, in every direction", unit="W/(m² sr)")),
            "point": (Key("position", vector(), "where it is; it cannot be seen"),
                      Key("intensity", colour(), "irradiance at distance 1, facing it", unit="W/sr")),
            "directional": (Key("direction", vector(), "towards the light"),
                            Key("irradiance", colour(), "of a surface that faces it", unit="W/m²")),
        }, "type", 'a table with type = "rectangle", "sphere", "point" or "directional"')), "what shines", ()),
        Key("view", Unread(), "what the viewer shows of it", None),
    )}


@cache
def schema() -> dict[str, Key]:
    """The top of a scene file."""
    return _schema()


def read(tables: dict, place: Place) -> dict:
    """A scene file's tables, checked, with every default filled in."""
    value = read_table(tables, tuple(schema().values()), place)
    for name, key in schema().items():
        if name not in tables and key.default == {} and isinstance(key.kind, Table):
            value[name] = read_table({}, key.kind.keys, place / name)
    return value
