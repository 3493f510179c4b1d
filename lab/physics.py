"""What physics and the models demand of a shader's own values, whatever the formula. No reference value enters, only the
reference's condition numbers, which say how exact float32 can be.

Each demand is a function that measures a GLSL function (or an identity between some) and returns its errors and what is
allowed of each. Names and headers of the catalogue choose them, so that a new function meets them by being there;
identities.py lists what holds between functions.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from itertools import product

import numpy as np

from . import catalogue, compare, domain, geometry, gl, identities, quadrature, singular
from .catalogue import Catalogue, Function

POINTS = 1 << 13
SEED = 7
ALBEDO_ERROR = 1e-4  # of the quadrature over lights
NORM_ERROR = 1e-5  # of the quadrature over half vectors
SMALLEST = 2 * compare.SMALLEST_REFERENCE
VIEWS = np.radians([0.0, 20.0, 45.0, 60.0, 75.0, 85.0, 89.0, 89.9])
RESOLVED = {"alpha": (0.05, 1e9), "alphas": (0.05, 1e9), "alphaX": (0.1, 1.0), "alphaY": (0.1, 1.0), "r": (0.01, 1.0),
            "rb": (0.01, 1.0), "exponent": (0.0, 800.0), "nu": (0.0, 200.0), "nv": (0.0, 200.0), "h": (0.0, 1e3),
            "weights": (0.1, 1.0)}  # by the nodes
RESOLVED |= {f"C{axis}{i}": (-1.0, 1.0) for axis in "xyz" for i in ("", 1, 2, 3)}  # beyond, Lafortune's grow without bound
KINKED = ("lobe_D_Schlick",)  # cut off at an angle, which takes more nodes
WHITE = ("f0", "f0b", "f90", "albedo", "rs", "rd", "diffuse")
NEUTRAL = {"f90": 1.0, "k": 0.0}  # what a parameter is where an overload has none


@dataclass(frozen=True)
class Measure:
    """Errors, and what is allowed of each: arrays of one shape."""

    error: np.ndarray
    allowed: np.ndarray

    @staticmethod
    def of(error, allowed) -> Measure:
        return Measure(*np.broadcast_arrays(error, allowed))

    @property
    def ratio(self) -> np.ndarray:
        """Error over allowed; infinite where the error is not a number, or where none is allowed."""
        ratio = np.divide(self.error, self.allowed, out=np.full(self.error.shape, np.inf), where=self.allowed > 0)
        return np.where(self.error == 0, 0.0, np.nan_to_num(ratio, nan=np.inf, posinf=np.inf))

    @property
    def worst(self) -> tuple:
        return np.unravel_index(np.argmax(self.ratio), self.ratio.shape)

    @property
    def passed(self) -> bool:
        return bool((self.ratio <= 1).all())


@dataclass(frozen=True)
class Demand:
    """One demand on a function: `measure(shade)` gives its Measure."""

    kind: str  # symmetry, limit or integral
    name: str  # of what is demanded, or the identity
    function: Function
    measure: Callable[[Shades], Measure]


class Shades:
    """Evaluates GLSL expressions over float32 inputs [n, width]; values are float64 [n, width]."""

    def __init__(self, context: gl.Context, source: str):
        self.context, self.source = context, source
        self.factor = compare.HARDWARE_FACTOR if context.is_hardware else 1

    def __call__(self, expression: str, result: str, inputs: dict[str, np.ndarray]) -> np.ndarray:
        with self.context:
            return gl.evaluate(self.context, self.source, f"{result}({expression})", result,
                               {name: x[None] for name, x in inputs.items()}).astype(float)


# --- inputs ----------------------------------------------------------------------------------------------------------


@cache
def _frame() -> Function:
    """A function of N, T, V, L alone, to draw frames for."""
    return replace(catalogue.load().functions[0], parameters=tuple(
        catalogue.Parameter(name, "vec3", "direction", -1.0, 1.0, geometry.default(name)) for name in geometry.DIRECTIONS))


def formed(function: Function, *frame: np.ndarray) -> dict[str, np.ndarray]:
    """A function's geometric parameters from N, T, V, L."""
    return {p.name: geometry.FORM[p.name](*frame).astype(np.float32) for p in function.parameters if p.is_geometry}


def sample(*functions: Function, count: int = POINTS) -> dict[str, np.ndarray]:
    """Stratified inputs in the domains of all functions; their geometry belongs to one frame."""
    drawn = domain.sample(_frame(), count, SEED)
    N, T, V, L = (geometry.normalize(x.astype(float)) for x in drawn.values())
    inputs, inside = {}, (V + L).any(-1)  # L = -V has no half vector
    for f in functions:
        inputs |= domain.sample(f, count, SEED) | formed(f, N, geometry.normalize(T - N * geometry.dot(N, T)), V, L)
        for p in f.parameters:
            if p.is_geometry and p.type == "float":
                inside &= ((inputs[p.name] >= np.float32(p.low)) & (inputs[p.name] <= np.float32(p.high)))[:, 0]
    return {name: x[inside] for name, x in inputs.items()}


def settings(*functions: Function, **given: float) -> list[dict[str, float]]:
    """Values of the parameters that are no geometry: white, and a grid of shapes within all ranges and RESOLVED."""
    axes = {}
    for name in dict.fromkeys(p.name for f in functions for p in f.parameters if not p.is_geometry):
        stated = [f.parameter(name) for f in functions if f.parameter(name)]
        low, high = np.clip((max(p.low for p in stated), min(p.high for p in stated)), *RESOLVED.get(name, (-1e9, 1e9)))
        steps = np.geomspace if low > 0 and high / low > 20 else np.linspace
        axes[name] = [1.0] if name in WHITE else [given[name]] if name in given else steps(low, high, 6)
    rng = np.random.default_rng(SEED)
    if len(axes) > 6:  # too many to list
        return [{name: float(rng.choice(values)) for name, values in axes.items()} for _ in range(12)]
    sets = [dict(zip(axes, values)) for values in product(*axes.values())]
    return sets if len(sets) <= 12 else list(rng.choice(sets, 12, replace=False))


def _reference(function: Function, inputs: dict[str, np.ndarray]) -> compare.Values:
    columns = {p.name: np.asarray(inputs[p.name], np.float32) for p in function.parameters}
    return _reference_at(function, *((name, x.shape, x.tobytes()) for name, x in columns.items()))


@lru_cache(maxsize=32)  # who measures a function again, in another context or edited, finds the values here
def _reference_at(function: Function, *columns: tuple[str, tuple[int, int], bytes]) -> compare.Values:
    inputs = {name: np.frombuffer(data, np.float32).reshape(1, *shape) for name, shape, data in columns}
    return compare.reference_values(function, inputs, None)


# --- symmetries ------------------------------------------------------------------------------------------------------


def swapped(call: str) -> str:
    """A call with the roles of V and L exchanged."""
    other = {"V": "L", "L": "V"}
    return re.sub(r"\b(|[NTB]dot)([VL])\b", lambda m: m[1] + other[m[2]], call)


def reciprocity(function: Function, shade: Shades) -> Measure:
    """Of f(V, L) - f(L, V)."""
    inputs = sample(function)
    error = abs(shade(function.call, function.result, inputs) - shade(swapped(function.call), function.result, inputs))
    return Measure.of(error, 2 * function.units * shade.factor * _reference(function, inputs).unit + SMALLEST)


def lack_of_reciprocity(function: Function, shade: Shades) -> float:
    """The largest relative difference of f(V, L) and f(L, V)."""
    inputs = sample(function)
    value, other = (shade(call, function.result, inputs) for call in (function.call, swapped(function.call)))
    return float((abs(value - other) / (abs(value) + 1e-30)).max())


def is_fraction(function: Function) -> bool:
    """Whether its value is a part of something; F82 takes any value at 82 degrees."""
    return bool(re.match(r"lobe_([FT]|G\d?|albedo|DFG)_(?!F82)", function.name))


def fraction(function: Function, shade: Shades) -> Measure:
    """Of values above 1."""
    got = shade(function.call, function.result, sample(function))
    return Measure.of(np.maximum(got - 1, 0), function.units * shade.factor * compare.FLOAT32_ROUNDOFF)


def is_cut_at_one(function: Function) -> bool:
    """Whether it is a fraction that no rounding brings above 1, so that 1 - F has a root: all but those that add up to
    whatever they have at grazing."""
    return is_fraction(function) and function.parameter("f90") is None


def excess(function: Function, shade: Shades) -> float:
    """The largest value above 1, exactly, near singular sets."""
    inputs = singular.sample(function, 4 * POINTS, SEED)
    return float(np.maximum(shade(function.call, function.result, inputs) - 1, 0).max())


def is_monotone(function: Function) -> bool:
    """Whether it must not grow with the cosine: Schlick's term with 1 at grazing."""
    return function.name.startswith("lobe_F_Schlick") and function.parameter("f90") is None


def monotone(function: Function, shade: Shades) -> Measure:
    """Of what a larger cosine adds."""
    inputs = sample(function)
    larger = inputs | {"cosI": inputs["cosI"] + (1 - inputs["cosI"]) * np.geomspace(
        1e-6, 1, len(inputs["cosI"]), dtype=np.float32)[:, None]}
    values = [shade(function.call, function.result, x) for x in (inputs, larger)]
    units = [_reference(function, x).unit for x in (inputs, larger)]
    return Measure.of(np.maximum(values[1] - values[0], 0), function.units * shade.factor * sum(units) + SMALLEST)


def rotation(function: Function, shade: Shades, rotations: int = 100) -> Measure:
    """Of what a rotation of all vectors changes."""
    base = sample(function, count=64)
    turn, _ = np.linalg.qr(np.random.default_rng(SEED).normal(size=(rotations, 3, 3)))
    turn *= np.linalg.det(turn)[:, None, None]
    turned = {}
    for p in function.parameters:
        x = np.broadcast_to(base[p.name].astype(float), (rotations, *base[p.name].shape))
        x = np.einsum("rij,rnj->rni", turn, x) if p.type == "vec3" and p.is_geometry else x
        turned[p.name] = x.reshape(-1, p.width).astype(np.float32)
    got = shade(function.call, function.result, turned).reshape(rotations, len(next(iter(base.values()))), -1)
    still = shade(function.call, function.result, base)
    both = _reference(function, base).unit + _reference(function, turned).unit.reshape(got.shape)
    return Measure.of(abs(got - still), function.units * shade.factor * both + SMALLEST)


def overloads(first: Function, other: Function, shade: Shades) -> Measure:
    """Of the difference of two overloads, where one is given in what the other takes."""
    own = {first: {p.name for p in first.parameters}, other: {p.name for p in other.parameters}}
    shape = {p.name for f in own for p in f.parameters if not p.is_geometry}
    inputs = sample(first, other)
    shared = set.intersection(*own.values())
    inputs |= {name: inputs[name][:, :1] if name in shared else np.full_like(inputs[name][:, :1], NEUTRAL[name])
               for name in shape}
    values, allowed = [], 0.0
    for f in own:
        mine = {p.name: inputs[p.name] if p.is_geometry else inputs[p.name].repeat(p.width, 1) for p in f.parameters}
        values.append(shade(f.call, f.result, mine))
        allowed = allowed + f.units * shade.factor * _reference(f, mine).unit
    return Measure.of(abs(values[0] - values[1]), allowed + SMALLEST)


def overload_pairs(library: Catalogue) -> list[tuple[Function, Function]]:
    """(first, another) of each overloaded name."""
    return [(f, g) for f in library.functions for g in library.find(f.name)[1:] if f is library.find(f.name)[0]]


# --- identities ------------------------------------------------------------------------------------------------------


def named(library: Catalogue, expression: str) -> list[Function]:
    """The functions that an expression names, one overload each."""
    return [library.find(name)[0] for name in re.findall(r"lobe_\w+", expression)]


def existing(library: Catalogue, lines: str) -> list[str]:
    """Those identities of which all functions exist."""
    names = {f.name for f in library.functions}
    return [line.strip() for line in lines.strip().splitlines() if set(re.findall(r"lobe_\w+", line)) <= names]


def limit(library: Catalogue, identity: str, shade: Shades) -> Measure:
    """Of a line of identities.LIMITS."""
    left, right, where = re.fullmatch(r"(.*) == (.*?)(?: where (.*))?", identity).groups()
    call, name, arguments = re.search(r"((lobe_\w+)\(([^()]*)\))", left).groups()
    arguments = arguments.split(", ")
    function = min((f for f in library.find(name) if len(f.parameters) == len(arguments)), key=lambda f: f.result)
    left = left.replace(call, f"{name}({', '.join(f'{p.type}({a})' for p, a in zip(function.parameters, arguments))})")
    inputs = sample(function)
    at = {p.name: inputs[a] if a in inputs else np.full_like(inputs[p.name], float(a))
          for p, a in zip(function.parameters, arguments)}
    right = f"{where} ? {function.result}({right}) : {function.result}({left})" if where else right
    expected = shade(right, function.result, inputs)
    ideal = _reference(function, at)
    sensitivity = np.nan_to_num(ideal.kappa * abs(ideal.value), posinf=0.0)
    units = sum(f.units for f in named(library, identity)) * shade.factor
    return Measure.of(abs(shade(left, function.result, inputs) - expected),
                      units * compare.FLOAT32_ROUNDOFF * (abs(expected) + sensitivity) + SMALLEST)


# --- integrals -------------------------------------------------------------------------------------------------------


def albedo(shade: Shades, expression: str, result: str, functions, sets, views=VIEWS) -> np.ndarray:
    return quadrature.integral(shade, expression, result, functions, sets, [quadrature.lights(view) for view in views])


def largest_albedo(function: Function, shade: Shades) -> float:
    """Over a grid of views and shapes, and at the place that the header names, as in
    `energy  no, 1.0152 at sigma = 0.2, at 85 degrees`."""
    sets, views = settings(function), VIEWS
    if function.energy_bound is None:
        hints = re.findall(r"(\w+) = (\d+\.?\d*)", function.energy)
        sets += settings(function, **{name: float(value) for name, value in hints})
        angle = re.search(r"at (\d+\.?\d*) deg", function.energy)
        views = np.radians([float(angle[1])]) if angle else VIEWS
    return float(albedo(shade, function.call, function.result, [function], sets, views).max())


def energy(function: Function, shade: Shades) -> Measure:
    """Of the largest albedo beyond the bound that the header states; or its distance from the figure of a gain, which over
    shapes, of which these are some, is a bound."""
    largest = largest_albedo(function, shade)
    if function.energy_bound is not None:
        return Measure.of(max(largest - function.energy_bound, 0.0), ALBEDO_ERROR)
    figure = float(re.match(r"no, \D*(\d+\.?\d*)", function.energy)[1])
    off = max(largest - figure, 0.0) if "over shapes" in function.energy else abs(largest - figure)
    return Measure.of(off, 2e-3 * figure)


def equal_albedo(library: Catalogue, identity: str, shade: Shades) -> Measure:
    """Of a line of identities.ALBEDOS. The right is subtracted as the Lambertian lobe of that albedo."""
    left, right, above = re.fullmatch(r"(.*) == (.*?)( from above)?", identity).groups()
    functions = named(library, identity)
    difference = albedo(shade, f"{left} - LOBE_INV_PI * ({right})", "vec3", functions, settings(*functions),
                        VIEWS[:1] if above else VIEWS)
    fits = [g.approximation.bound for f in functions for g in named(library, f.definition) if g.approximation]
    # 4: compensations divide by an albedo of >= 0.25
    return Measure.of(abs(difference), ALBEDO_ERROR + 4 * max(fits, default=0.0))


def projected_area(function: Function, shade: Shades) -> Measure:
    """Of the facets' area, seen along the normal, from 1."""
    area = quadrature.integral(shade, function.call, function.result, [function], settings(function),
                               [quadrature.facets(1024 if function.name in KINKED else 128)])
    return Measure.of(abs(area - 1), NORM_ERROR)


@cache
def _visible() -> list:
    return [quadrature.visible_facets(view) for view in VIEWS]


def sees_visible_facets(library: Catalogue, function: Function) -> bool:
    """Whether it is of the facets that a direction sees: Smith's masking of a distribution that the library has, or the
    density of its visible normals. tests/test_sampling.py sums up the other densities."""
    D = re.sub("^lobe_(G1|pdf)_", "lobe_D_", function.name).removesuffix("_fast")
    if function.name.startswith("lobe_G1_"):
        return any(f.name == D and f.parameter("H") for f in library.functions)
    return function.name == "lobe_pdf_GGX"


def weak_furnace(library: Catalogue, function: Function, shade: Shades) -> Measure:
    """The visible facets cover the surface: int G1 D max(V.H, 0) dH = NdotV. Their pdf over lights integrates to 1."""
    if "_pdf_" in function.name:
        facets = quadrature.integral(shade, function.call, "float", [function], settings(function), _visible())
        return Measure.of(abs(4 * facets - 1), NORM_ERROR)  # dL = 4 V.H dH
    D = next(f for f in library.find(function.name.replace("_G1_", "_D_").removesuffix("_fast")) if f.parameter("H"))
    both = quadrature.integral(shade, f"vec2(1.0, {function.call}) * {D.call}", "vec2", [function, D],
                               settings(function, D), _visible())
    exact = np.cos(VIEWS) / both[..., 0]
    stated = function.approximation.error(exact) if function.approximation else 0.0
    return Measure.of(abs(both[..., 1] / both[..., 0] - exact), NORM_ERROR * exact + stated)


# --- all of them -----------------------------------------------------------------------------------------------------


def demands(library: Catalogue, functions: tuple[Function, ...]) -> Iterator[Demand]:
    """Whatever is demanded of some functions."""
    for f in functions:
        names = {p.name for p in f.parameters}
        if f.reciprocal == "yes":
            yield Demand("symmetry", "reciprocity", f, partial(reciprocity, f))
        if {"N", "V", "L"} <= names:
            yield Demand("symmetry", "rotation", f, partial(rotation, f))
        if is_monotone(f):
            yield Demand("symmetry", "no growth with the cosine", f, partial(monotone, f))
        if is_fraction(f):
            yield Demand("limit", "not above 1", f, partial(fraction, f))
        if f.energy:
            yield Demand("integral", "energy", f, partial(energy, f))
        if f.normalised == "yes":
            yield Demand("integral", "projected area", f, partial(projected_area, f))
        if sees_visible_facets(library, f):
            yield Demand("integral", "weak white furnace", f, partial(weak_furnace, library, f))
    for first, other in overload_pairs(library):
        if owner := next((f for f in (first, other) if f in functions), None):
            yield Demand("symmetry", "overloads agree", owner, partial(overloads, first, other))
    for kind, lines, measure in (("limit", identities.LIMITS, limit), ("integral", identities.ALBEDOS, equal_albedo)):
        for line in existing(library, lines):
            owner = next((f for f in named(library, line) if f in functions), None)
            if owner:
                yield Demand(kind, line, owner, partial(measure, library, line))
