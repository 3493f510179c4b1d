"""What physics and the models demand of the shaders' own values, whatever the formula. No reference value enters, only
the reference's condition numbers, which say how exact float32 can be.

Names and headers of the catalogue choose the tests, so that a new function gets them by being there; identities.py
lists what holds between functions. `pytest -rP` shows each error beside what is allowed.
"""

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import quadrature
from identities import ALBEDOS, LIMITS
from sampling import DIRECTIONS as RETURN_DIRECTIONS

from lobe.lab import catalogue, compare, domain, geometry, gl

LIBRARY = catalogue.load()
NAMES = {f.name for f in LIBRARY.functions}
POINTS = 1 << 13
SEED = 7
ALBEDO_ERROR = 1e-4  # of the quadrature over lights
NORM_ERROR = 1e-5  # of the quadrature over half vectors
VIEWS = np.radians([0.0, 20.0, 45.0, 60.0, 75.0, 85.0, 89.0, 89.9])
RESOLVED = {"alpha": (0.05, 1e9), "alphaX": (0.1, 1.0), "alphaY": (0.1, 1.0), "exponent": (0.0, 800.0)}  # by the nodes
WHITE = ("f0", "f90", "albedo", "rs", "rd")
NEUTRAL = {"f90": 1.0, "k": 0.0}  # what a parameter is where an overload has none


def called(expression):
    """The functions that an expression names, one overload each."""
    return [LIBRARY.find(name)[0] for name in re.findall(r"lobe_\w+", expression)]


def existing(identities):
    lines = [line.strip() for line in identities.strip().splitlines()]
    return [line for line in lines if set(re.findall(r"lobe_\w+", line)) <= NAMES]


def over(functions):
    return pytest.mark.parametrize("function", list(functions), ids=lambda f: f.key)


class Shades:
    """Evaluates GLSL expressions over float32 inputs [n, width]; values are float64 [n, width]."""

    def __init__(self):
        self.context = gl.create_context("egl")
        self.factor = compare.HARDWARE_FACTOR if self.context.is_hardware else 1

    def __call__(self, expression, result, inputs):
        with self.context:
            return gl.evaluate(self.context, LIBRARY.text, f"{result}({expression})", result,
                               {name: x[None] for name, x in inputs.items()}).astype(float)


@pytest.fixture(scope="module")
def shade():
    return Shades()


def check(error, allowed):
    error, allowed = np.broadcast_arrays(error, allowed)
    ratio = np.divide(error, allowed, out=np.where(error == 0, 0.0, np.inf), where=allowed > 0)
    worst = np.unravel_index(np.argmax(ratio), ratio.shape)
    print(f"error {error[worst]:.3g} of {allowed[worst]:.3g} allowed, ratio {ratio[worst]:.2g}, seed {SEED}")
    assert (error <= allowed).all(), f"row {worst}: {error[worst]:.6g} > {allowed[worst]:.6g}"


FRAME = replace(LIBRARY.functions[0], parameters=tuple(
    catalogue.Parameter(name, "vec3", "direction", -1.0, 1.0, geometry.default(name)) for name in geometry.DIRECTIONS))


def formed(function, *frame):
    """A function's geometric parameters from N, T, V, L."""
    return {p.name: geometry.FORM[p.name](*frame).astype(np.float32) for p in function.parameters if p.is_geometry}


def sample(*functions, count=POINTS):
    """Stratified inputs in the domains of all functions; their geometry belongs to one frame."""
    N, T, V, L = (geometry.normalize(x.astype(float)) for x in domain.sample(FRAME, count, SEED).values())
    inputs, inside = {}, (V + L).any(-1)  # L = -V has no half vector
    for f in functions:
        inputs |= domain.sample(f, count, SEED) | formed(f, N, geometry.normalize(T - N * geometry.dot(N, T)), V, L)
        for p in f.parameters:
            if p.is_geometry and p.type == "float":
                inside &= ((inputs[p.name] >= np.float32(p.low)) & (inputs[p.name] <= np.float32(p.high)))[:, 0]
    return {name: x[inside] for name, x in inputs.items()}


def reference(function, inputs):
    return compare.reference_values(function, {name: x[None] for name, x in inputs.items()}, None)


def swapped(call):
    """A call with the roles of V and L exchanged."""
    other = {"V": "L", "L": "V"}
    return re.sub(r"\b(|[NTB]dot)([VL])\b", lambda m: m[1] + other[m[2]], call)


@over(f for f in LIBRARY.functions if f.reciprocal)
def test_reciprocal(function, shade):
    inputs = sample(function)
    error = abs(shade(function.call, function.result, inputs) - shade(swapped(function.call), function.result, inputs))
    if function.reciprocal == "yes":
        check(error, 2 * function.units * shade.factor * reference(function, inputs).unit + 2e-30)
    else:
        scale = abs(shade(function.call, function.result, inputs)) + 1e-30
        assert (error / scale).max() > 0.01, "the header says that it is not reciprocal, and it is"


@over(f for f in LIBRARY.functions if f.name not in RETURN_DIRECTIONS)
def test_not_negative_and_a_fraction_not_above_one(function, shade):
    got = shade(function.call, function.result, sample(function))
    assert (got >= 0).all()
    if re.match(r"lobe_([FT]|G\d?|albedo|DFG)_(?!F82)", function.name):  # F82 takes any value at 82 degrees
        check(got.max(), 1 + function.units * shade.factor * compare.FLOAT32_ROUNDOFF)


@over(f for f in LIBRARY.functions if {"N", "V", "L"} <= {p.name for p in f.parameters})
def test_rotation_changes_nothing(function, shade, rotations=100):
    base = sample(function, count=64)
    turn, _ = np.linalg.qr(np.random.default_rng(SEED).normal(size=(rotations, 3, 3)))
    turn *= np.linalg.det(turn)[:, None, None]
    turned = {}
    for p in function.parameters:
        x = np.broadcast_to(base[p.name].astype(float), (rotations, *base[p.name].shape))
        x = np.einsum("rij,rnj->rni", turn, x) if p.type == "vec3" and p.is_geometry else x
        turned[p.name] = x.reshape(-1, p.width).astype(np.float32)
    got = shade(function.call, function.result, turned).reshape(rotations, 64, -1)
    still = shade(function.call, function.result, base)
    both = reference(function, base).unit + reference(function, turned).unit.reshape(got.shape)
    check(abs(got - still), function.units * shade.factor * both + 2e-30)


@pytest.mark.parametrize("first, other", [(f, g) for f in LIBRARY.functions for g in LIBRARY.find(f.name)[1:]
                                          if f is LIBRARY.find(f.name)[0]], ids=lambda f: f.key)
def test_overloads_agree(first, other, shade):
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
        allowed = allowed + f.units * shade.factor * reference(f, mine).unit
    check(abs(values[0] - values[1]), allowed + 2e-30)


@pytest.mark.parametrize("identity", existing(LIMITS), ids=str)
def test_limit(identity, shade):
    left, right, where = re.fullmatch(r"(.*) == (.*?)(?: where (.*))?", identity).groups()
    call, name, arguments = re.search(r"((lobe_\w+)\(([^()]*)\))", left).groups()
    arguments = arguments.split(", ")
    function = min((f for f in LIBRARY.find(name) if len(f.parameters) == len(arguments)), key=lambda f: f.result)
    left = left.replace(call, f"{name}({', '.join(f'{p.type}({a})' for p, a in zip(function.parameters, arguments))})")
    inputs = sample(function)
    at = {p.name: inputs[a] if a in inputs else np.full_like(inputs[p.name], float(a))
          for p, a in zip(function.parameters, arguments)}
    right = f"{where} ? {function.result}({right}) : {function.result}({left})" if where else right
    expected = shade(right, function.result, inputs)
    ideal = reference(function, at)
    sensitivity = np.nan_to_num(ideal.kappa * abs(ideal.value), posinf=0.0)
    units = sum(f.units for f in called(identity)) * shade.factor
    check(abs(shade(left, function.result, inputs) - expected),
          units * compare.FLOAT32_ROUNDOFF * (abs(expected) + sensitivity))


def settings(*functions, **given):
    """Values of the parameters that are no geometry: white, and a grid of shapes within all ranges and RESOLVED."""
    axes = {}
    for name in dict.fromkeys(p.name for f in functions for p in f.parameters if not p.is_geometry):
        stated = [f.parameter(name) for f in functions if f.parameter(name)]
        low, high = np.clip((max(p.low for p in stated), min(p.high for p in stated)), *RESOLVED.get(name, (-1e9, 1e9)))
        steps = np.geomspace if low > 0 and high / low > 20 else np.linspace
        axes[name] = [1.0] if name in WHITE else [given[name]] if name in given else steps(low, high, 6)
    sets = [dict(zip(axes, values)) for values in product(*axes.values())]
    return sets if len(sets) <= 12 else list(np.random.default_rng(SEED).choice(sets, 12, replace=False))


def albedo(shade, expression, result, functions, sets, views=VIEWS):
    return quadrature.integral(shade, expression, result, functions, sets, [quadrature.lights(view) for view in views])


@over(f for f in LIBRARY.functions if f.energy)
def test_energy(function, shade):
    """`energy  no, 1.0152 at sigma = 0.2, at grazing`: the largest albedo, and where, also as `at 85 degrees`."""
    sets, views = settings(function), VIEWS
    if function.energy_bound is None:
        hints = re.findall(r"(\w+) = (\d+\.?\d*)", function.energy)
        sets += settings(function, **{name: float(value) for name, value in hints})
        angle = re.search(r"at (\d+\.?\d*) deg", function.energy)
        views = np.radians([float(angle[1])]) if angle else VIEWS
    largest = albedo(shade, function.call, function.result, [function], sets, views).max()
    if function.energy_bound is not None:
        check(largest, function.energy_bound + ALBEDO_ERROR)
    else:
        assert largest > 1 + ALBEDO_ERROR, "the header says that it gains energy, and it does not"
        figure = float(re.match(r"no, \D*(\d+\.?\d*)", function.energy)[1])
        check(abs(largest - figure), 2e-3 * figure)


@pytest.mark.parametrize("identity", existing(ALBEDOS), ids=str)
def test_albedo(identity, shade):
    """The right is subtracted as the Lambertian lobe of that albedo."""
    left, right, above = re.fullmatch(r"(.*) == (.*?)( from above)?", identity).groups()
    functions = called(identity)
    difference = albedo(shade, f"{left} - LOBE_INV_PI * ({right})", "vec3", functions, settings(*functions),
                        VIEWS[:1] if above else VIEWS)
    fits = [g.approximation.bound for f in functions for g in called(f.definition) if g.approximation]
    check(abs(difference), ALBEDO_ERROR + 4 * max(fits, default=0.0))  # 4: compensations divide by an albedo of >= 0.25


@over(f for f in LIBRARY.functions if f.normalised)
def test_projected_area(function, shade):
    area = quadrature.integral(shade, function.call, function.result, [function], settings(function),
                               [quadrature.facets()])
    if function.normalised == "yes":
        check(abs(area - 1), NORM_ERROR)
    else:
        assert abs(area - 1).max() > 1e-3, "the header says that it is not normalised, and it is"


VISIBLE = [quadrature.visible_facets(view) for view in VIEWS]


@over(f for f in LIBRARY.functions if re.match("lobe_(G1|pdf)_", f.name))
def test_weak_white_furnace(function, shade):
    """The visible facets cover the surface: int G1 D max(V.H, 0) dH = NdotV. Their pdf over lights integrates to 1."""
    if "_pdf_" in function.name:
        facets = quadrature.integral(shade, function.call, "float", [function], settings(function), VISIBLE)
        check(abs(4 * facets - 1), NORM_ERROR)  # dL = 4 V.H dH
        return
    D = next(f for f in LIBRARY.find(function.name.replace("_G1_", "_D_").removesuffix("_fast")) if f.parameter("H"))
    both = quadrature.integral(shade, f"vec2(1.0, {function.call}) * {D.call}", "vec2", [function, D],
                               settings(function, D), VISIBLE)
    exact = np.cos(VIEWS) / both[..., 0]
    stated = function.approximation.error(exact) if function.approximation else 0.0
    check(abs(both[..., 1] / both[..., 0] - exact), NORM_ERROR * exact + stated)
