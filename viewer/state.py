"""All that a user of the viewer can choose, and the scene file that holds it: the reference's, with a table [view]."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from pathlib import Path

from ..lab import catalogue, files, scene_schema, scenes, toml_lines
from ..lab.catalogue import Function
from ..lab.paths import DATA
from ..lab.scene_schema import Choice, Flag, Key, List, Number, Place, Text

MODES = ("shader", "reference", "split", "difference", "flicker")  # keys 1 to 5
TONES = ("sRGB", "filmic", "Reinhard")
AGAINST = ("reference", "B")  # what lobe A is held against
REFERENCES = ("direct", "traced")
SIDES = ("A", "B")
PLOTS = ("lobe", "angle", "solid", "F", "D", "G", "albedo")  # what plots.KINDS calls them
CHANNELS = {"luminance": (0.2126, 0.7152, 0.0722), "red": (1.0, 0.0, 0.0), "green": (0.0, 1.0, 0.0),
            "blue": (0.0, 0.0, 1.0)}  # of linear sRGB, as the plots can show them
MOST_INCIDENCES = 5
OBJECTS = ("sphere", "teapot", "bunny", "suzanne", "plane")
PLACEMENT = {"fit": None, "scale": (1.0, 1.0, 1.0), "rotate": (0.0, 0.0, 0.0), "translate": (0.0, 0.0, 0.0),
             "rest_on": None, "flat": False}
START = "lobe_GGX", "lobe_GGX_fast"  # A, and a cheaper B
MOST_LIGHTS = 8
GOLD = (1.0, 0.78, 0.34)  # the f0 that the viewer starts with
NEAREST = 1e-4  # of eye and target, and of their direction to up


@dataclass
class Lobe:
    """A lobe of the library, by the key of its overload, and its parameters' values by name."""

    key: str
    values: dict[str, tuple[float, ...]]

    @property
    def function(self) -> Function:
        return catalogue.load().find(self.key)[0]


@dataclass
class Light:
    """`vector` points towards a directional light, or is a point light's position; `color` is its irradiance facing
    it, or its intensity."""

    kind: str = "directional"
    vector: tuple[float, float, float] = (0.5, 0.8, 0.9)
    color: tuple[float, float, float] = (3.0, 3.0, 3.0)


@dataclass
class Environment:
    file: Path
    rotation: float = 0.0  # degrees about +y
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass
class Plots:
    """What the plots show: the side that is edited; where `both`, the other one, too; and the materials in `pins`."""

    kind: str = "lobe"
    logarithmic: bool = True
    reference: bool = True
    incidences: tuple[float, ...] = (0.0, 30.0, 60.0)  # degrees
    azimuth: float = 0.0  # degrees from T of the plane of incidence
    channel: str = "luminance"
    both: bool = False
    pins: list[list[Lobe]] = field(default_factory=list)


@dataclass
class State:
    """Plain data: copies and compares with ==.

    object   one of OBJECTS, or the file of a mesh
    placement   how the object stands in its scene, keys of scene_schema; empty for a box of 2 around the origin
    sides    "A" and "B": the lobes that each of the two materials sums
    side     the one that the lobe panel edits
    against  whether A is held against its own reference, or against B
    reference   direct: no shadows, the lights of the shader, at pixel centres, so that what differs is the lobe alone;
                traced: paths with shadows and interreflection
    """

    object: str = "teapot"
    placement: dict = field(default_factory=dict)
    eye: tuple[float, float, float] = scenes.EYE
    target: tuple[float, float, float] = scenes.TARGET
    fov: float = 20.0  # degrees, from the lower edge of the picture to the upper
    lights: list[Light] = field(default_factory=list)
    environment: Environment | None = None
    sides: dict[str, list[Lobe]] = field(default_factory=dict)
    side: str = "A"
    against: str = "reference"
    mode: str = "split"
    divider: float = 0.5  # of the picture's width
    reference: str = "direct"
    depth: int = 4  # of traced paths
    exposure: float = 0.0  # stops
    tone: str = "sRGB"
    scale: float = 1e-6  # the difference that has full colour
    backdrop: bool = True  # whether the environment is seen behind the object
    plots: Plots = field(default_factory=Plots)

    @property
    def lobe(self) -> Lobe:
        """The first lobe of the side that is edited."""
        return self.sides[self.side][0]


def initial() -> State:
    """What the viewer starts with."""
    lights = [Light(light.kind, light.vector, light.color) for light in scenes.RIGS["point"].lights]
    lights.append(Light("directional", (-0.9, 0.4, 0.6), (0.8, 0.9, 1.1)))
    gold = {"f0": GOLD, "alpha": (0.3,)}
    sides = {side: [Lobe(lobe.key, lobe.values | gold)] for side, lobe in zip(SIDES, map(default_lobe, START))}
    return State(lights=lights, sides=sides, exposure=0.7)


def lobes() -> dict[str, Function]:
    """key -> every lobe that can be shown, in the library's order."""
    return {f.key: f for overloads in scene_schema.lobes().values() for f in overloads}


def default_lobe(name: str) -> Lobe:
    """A lobe by name or key, with the values that its header suggests."""
    function = catalogue.load().find(name)[0]
    return Lobe(function.key, {p.name: p.default for p in function.parameters if not p.is_geometry})


def matched(lobe: Lobe, known: dict[str, Function]) -> Lobe:
    """The lobe with the parameters that a library read again has for it; another one where it is gone."""
    if lobe.key not in known:
        return default_lobe(START[0])
    function = known[lobe.key]
    return Lobe(lobe.key, {p.name: lobe.values[p.name] if len(lobe.values.get(p.name, ())) == p.width else p.default
                           for p in function.parameters if not p.is_geometry})


def available() -> tuple[str, ...]:
    """The built-in objects that are there: the bunny is not in the installed package."""
    return tuple(name for name in OBJECTS if name == "plane" or name in scenes.SHAPES)


def probes() -> dict[str, Path]:
    """name -> the environments that come with Lobe."""
    return {file.stem: file for file in sorted((DATA / "hdri").glob("*.exr"))}


# Files.

_VIEW = (
    Key("b", Text(), "the material that is B", ""),
    Key("side", Choice(SIDES), "the material that is edited", "A"),
    Key("against", Choice(AGAINST), "what A is held against", "reference"),
    Key("mode", Choice(MODES), "what the picture shows", "split"),
    Key("divider", Number(0.0, 1.0), "where mode split divides the picture", 0.5),
    Key("reference", Choice(REFERENCES), "what the reference renders", "direct"),
    Key("tone", Choice(TONES), "tone curve of the display", "sRGB"),
    Key("scale", Number(1e-12, 1e6), "the difference that has full colour", 1e-6),
    Key("backdrop", Flag(), "whether the environment is seen behind the object", True),
    Key("plot", Choice(PLOTS), "what is plotted", "lobe"),
    Key("logarithmic", Flag(), "whether the plot is logarithmic", True),
    Key("curves", Flag(), "whether the reference is plotted", True),
    Key("incidences", List(Number(0.0, 89.9)), "angles of the light in the plots", [0.0, 30.0, 60.0], "degrees"),
    Key("azimuth", Number(0.0, 180.0), "of the plots' plane of incidence, from T", 0.0, "degrees"),
    Key("channel", Choice(tuple(CHANNELS)), "what of a colour is plotted", "luminance"),
    Key("both", Flag(), "whether the side that is not edited is plotted, too", False),
    Key("pins", List(Text()), "materials whose curves stay", []),
)
_SHOWN = ("side", "against", "mode", "divider", "reference", "tone", "scale", "backdrop")  # keys that State has by the same name


def load(path: Path) -> tuple[State, list[str]]:
    """The state that a scene file describes, and one line for each thing in it that the viewer leaves out. InputError
    with file, line and key."""
    tables, lines = toml_lines.load(path)
    place = Place(Path(path), lines)
    described = scene_schema.read(tables, place)
    view = scene_schema.read_table(described["view"] or {}, _VIEW, place / "view")
    return _Reader(place, described, view).state()


class _Reader:
    def __init__(self, place: Place, described: dict, view: dict):
        self.place, self.described, self.view = place, described, view
        self.notes: list[str] = []

    def state(self) -> tuple[State, list[str]]:
        view, camera, render = self.view, self._camera(), self.described["render"]
        shown = self._shown()
        state = State(*self._object(shown), camera["eye"], camera["target"], camera["fov"], self._lights(),
                      self._environment(), self._sides(shown), depth=max(render["depth"], 1),
                      exposure=self.described["film"]["exposure"],
                      plots=self._plots(),
                      **{key: view[key] for key in _SHOWN})
        if not state.lights and state.environment is None:
            self._leave_out(self.place, "has no light that the viewer knows; one direction stands for it")
            state.lights.append(Light())
        return state, self.notes

    def _camera(self) -> dict:
        """What the file says of it, where the viewer's camera, whose up is +y, can look like that."""
        camera, place = self.described["camera"], self.place / "camera"
        away = [e - t for e, t in zip(camera["eye"], camera["target"])]
        distance = math.hypot(*away)
        if distance < NEAREST:
            place.fail(f"eye and target are {distance:g} apart, expected {NEAREST:g} at least; move one of them")
        if math.hypot(away[0], away[2]) < NEAREST * distance:
            place.fail("looks along y, which is up in the viewer, expected another direction; move eye aside a little")
        if camera["up"] != scenes.UP:
            self._leave_out(place / "up", "up is +y here")
        return camera

    def _leave_out(self, place: Place, what: str) -> None:
        self.notes.append(f"{place}: {what}")

    def _shown(self) -> int:
        """The first object that the viewer can show: no disc, with lobes on it."""
        things, materials = self.described["objects"], self.described["materials"]
        if not things:
            self.place.fail("has no object, expected [[objects]]")
        for i, thing in enumerate(things):
            if thing["shape"] != "disc" and materials.get(thing["material"], {}).get("lobes"):
                if len(things) > 1:
                    self._leave_out(self.place / "objects" / i, "is the one object of the scene that the viewer shows")
                return i
        self.place.fail("has no object that the viewer shows, expected a mesh, sphere or plane whose material has lobes")

    def _object(self, shown: int) -> tuple[str, dict]:
        thing = self.described["objects"][shown]
        given = {key: thing[key] for key, default in PLACEMENT.items() if thing.get(key, default) != default}
        if thing["shape"] == "mesh":
            file = thing["file"].resolve()
            known = {path.resolve(): name for name, path in scenes.SHAPES.items() if path}
            return known.get(file, str(file)), {} if given == {"fit": 2.0} else given
        return thing["shape"], given

    def _lights(self) -> list[Light]:
        kept = []
        for i, light in enumerate(self.described["lights"]):
            if light["type"] == "directional":
                kept.append(Light("directional", light["direction"], light["irradiance"]))
            elif light["type"] == "point":
                kept.append(Light("point", light["position"], light["intensity"]))
            else:
                area = math.pi * light["radius"] ** 2 if light["type"] == "sphere" else math.prod(light["size"])
                kept.append(Light("point", light["center"], tuple(area * x for x in light["radiance"])))
                self._leave_out(self.place / "lights" / i, "is a point light here")
        if len(kept) > MOST_LIGHTS:
            self._leave_out(self.place / "lights" / MOST_LIGHTS, f"the viewer has {MOST_LIGHTS} lights at most")
        return kept[:MOST_LIGHTS]

    def _environment(self) -> Environment | None:
        given = self.described["environment"]
        if given is None or given["file"] is None:
            if given:
                self._leave_out(self.place / "environment", "the viewer shows environments of a file only")
            return None
        return Environment(given["file"].resolve(), given["rotation"], given["scale"])

    def _sides(self, shown: int) -> dict[str, list[Lobe]]:
        known = self.described["materials"]
        a, b = self._material(self.described["objects"][shown]["material"]), self.view["b"]
        if b and b not in known:
            (self.place / "view" / "b").fail(f"{b}: expected one of {', '.join(known)}")
        return {"A": a, "B": self._material(b) if b else [default_lobe(START[1])]}

    def _plots(self) -> Plots:
        view, place = self.view, self.place / "view"
        if not view["incidences"]:
            (place / "incidences").fail("is empty, expected at least one angle")
        for i, name in enumerate(view["pins"]):
            if name not in self.described["materials"]:
                (place / "pins" / i).fail(f"{name}: expected one of {', '.join(self.described['materials'])}")
        return Plots(view["plot"], view["logarithmic"], view["curves"], tuple(view["incidences"][:MOST_INCIDENCES]),
                     view["azimuth"], view["channel"], view["both"], [self._material(pin) for pin in view["pins"]])

    def _material(self, name: str) -> list[Lobe]:
        material, place = self.described["materials"][name], self.place / "materials" / name
        for key in ("mirror", "glass"):
            if material[key]:
                self._leave_out(place / key, f"the viewer has no {key}")
        if not material["lobes"]:
            place.fail("has no lobe, expected lobes = [{ lobe = ... }]")
        return [Lobe(lobe["key"], {k: v if isinstance(v, tuple) else (v,) for k, v in lobe["parameters"].items()})
                for lobe in material["lobes"]]


def save(state: State, path: Path, size: tuple[int, int] = (960, 540)) -> None:
    """Writes the state as a scene file, which the reference renders, too, at that size."""
    files.write_text(path, to_toml(state, Path(path).resolve().parent, size))


def to_toml(state: State, folder: Path, size: tuple[int, int]) -> str:
    """The scene file's text; paths in it start at its folder."""
    tables = [
        _table("film", {"width": size[0], "height": size[1], "exposure": state.exposure}),
        _table("camera", {"eye": state.eye, "target": state.target, "fov": state.fov}),
        _table("render", {"depth": state.depth}),
    ]
    if state.environment:
        e = state.environment
        file = _relative(e.file, folder)
        tables.append(_table("environment", {"file": file, "rotation": e.rotation, "scale": e.scale}))
    tables += [_table(f"materials.{side}", {"lobes": [_lobe(lobe) for lobe in state.sides[side]]}) for side in SIDES]
    tables.append(_table("objects", _object(state, folder), array=True))
    tables += [_table("lights", _light(light), array=True) for light in state.lights]
    shown = {key: getattr(state, key) for key in _SHOWN}
    tables += [_table(f"materials.pin{i}", {"lobes": [_lobe(lobe) for lobe in pin]})
               for i, pin in enumerate(state.plots.pins)]
    tables.append(_table("view", {"b": "B"} | shown | _plots(state.plots)))
    return "\n".join(tables)


def _plots(plots: Plots) -> dict:
    return {"plot": plots.kind, "logarithmic": plots.logarithmic, "curves": plots.reference, "azimuth": plots.azimuth,
            "incidences": plots.incidences, "channel": plots.channel, "both": plots.both,
            "pins": [f"pin{i}" for i in range(len(plots.pins))]}


def _object(state: State, folder: Path) -> dict:
    if state.object in ("sphere", "plane"):
        return {"shape": state.object, "material": "A"} | state.placement
    file = scenes.SHAPES.get(state.object) or Path(state.object)
    return {"shape": "mesh", "file": _relative(file, folder), "material": "A"} | (state.placement or {"fit": 2.0})


def _light(light: Light) -> dict:
    names = ("direction", "irradiance") if light.kind == "directional" else ("position", "intensity")
    return {"type": light.kind} | dict(zip(names, (light.vector, light.color)))


def _lobe(lobe: Lobe) -> dict:
    return {"lobe": lobe.function.name} | {k: v[0] if len(v) == 1 else v for k, v in lobe.values.items()}


def _relative(file: Path, folder: Path) -> str:
    return os.path.relpath(Path(file).resolve(), folder)


def _table(name: str, values: dict, array: bool = False) -> str:
    head = f"[[{name}]]" if array else f"[{name}]"
    return head + "\n" + "".join(f"{key} = {_toml(value)}\n" for key, value in values.items())


def _toml(value) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return str(value) if isinstance(value, int) else repr(float(value))
