"""The policy of core.glsl's header for inputs out of the ordinary, and how a function keeps it.

Which rule holds for a function follows from its kind and its parameters' names, as the policy is written: for D, for
lobes, for cosines. No model is named here.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from . import compare, domain, geometry, gl
from .catalogue import Function

POINTS = 1 << 10
SEED = 5
ONE_AND_ULP = np.float32(1 + 2**-23)
OFF_UNIT = 1e-4  # what interpolated normals and half-float directions are off unit length
OFF_UNIT_POINTS = 1 << 14

# Finite numbers that shaders meet when something before them went wrong.
SCALARS = (0.0, -0.0, 1e-45, -1e-45, 1e-38, 1e-20, 1e-8, 1e-4, 0.5, 1 - 2**-24, 1.0, 1 + 2**-23, 1.022, 1.5, 4.0, 1e4,
           1e9, 1e20, 1e30, 3.4e38, -1e-20, -1e-6, -0.5, -1.0, -1.5, -1e9, -3.4e38)
DIRECTIONS = ((0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, 0, 0.8), (-0.6, 0, 0.8), (0.6, 0, -0.8), (0, 0, 0), (1e-20, 0, 1),
              (1e-4, 0, 1), (0, 0, 1 + 1e-4), (0.70710677, 0.70710677, 0), (1e-30, 1e-30, 1e-30), (3e4, -2e4, 1e4))
VECTORS = (*((x,) * 3 for x in SCALARS[::2]), (0.04, 1.022, 0.0), (-1.0, 0.5, 3.4e38))
HOSTILE = 1 << 15


@dataclass(frozen=True)
class Rule:
    """Inputs out of the ordinary, and what the policy says of them.

    asked   what the shader is given, float32 [n, width]
    meant   the ordinary inputs that it should take them for; None for 'the value is 0'
    same    whether it is the shader's own value there that counts, since the header promises no exact one; else it is
            the reference's
    slack   units besides the function's own: what is asked may differ from what is meant by a rounding
    """

    function: Function
    name: str
    asked: dict[str, np.ndarray]
    meant: dict[str, np.ndarray] | None
    same: bool = False
    slack: int = 0

    @cached_property
    def case(self) -> compare.Case:
        """What is asked, with the reference's values at what is meant."""
        asked, meant = ({name: x[None] for name, x in inputs.items()} for inputs in (self.asked, self.meant))
        return compare.Case(self.function, "policy", "points", asked, None,
                            compare.reference_values(self.function, meant, None))


@lru_cache(maxsize=16)
def hostile(function: Function, seed: int = SEED) -> dict[str, np.ndarray]:
    """Rows of hostile values: all combinations where they are few, random ones where they are many."""
    choices = [np.array([(x,) for x in SCALARS] if p.width == 1 else DIRECTIONS if p.kind in ("direction", "half") else VECTORS,
                        np.float32)[:, : p.width] for p in function.parameters]
    if np.prod([float(len(c)) for c in choices]) <= HOSTILE:
        index = np.array(list(itertools.product(*(range(len(c)) for c in choices)))).T
    else:
        index = [np.random.default_rng(seed).integers(0, len(c), HOSTILE) for c in choices]
    return {p.name: c[i] for p, c, i in zip(function.parameters, choices, index)}


def rules(function: Function, count: int = POINTS, seed: int = SEED) -> Iterator[Rule]:
    """Every rule of the policy that concerns a function."""
    base = domain.sample(function, count, seed)
    names = set(base)
    lobe, distribution = function.kind == "lobe", function.name.startswith(("lobe_D_", "lobe_peak_"))
    half = {"V", "L", "H"} <= names

    def rule(name: str, asked: dict, meant: dict | None, **options) -> Rule:
        def filled(changed):
            whole = base | {n: np.broadcast_to(np.asarray(x, np.float32), base[n].shape) for n, x in changed.items()}
            return whole | ({"H": whole["V"] + whole["L"]} if half else {})
        return Rule(function, name, filled(asked), None if meant is None else filled(meant), **options)

    widths = [n for n in names if n.startswith("alpha") and (lobe or distribution)]
    if widths and all(function.parameter(n).low <= 1e-4 for n in widths):
        yield rule("alpha = 0 is 1e-4", dict.fromkeys(widths, 0.0), dict.fromkeys(widths, 1e-4))
        if all(function.parameter(n).high >= 4 for n in widths):
            yield rule("alpha = 4", dict.fromkeys(widths, 4.0), dict.fromkeys(widths, 4.0))
    yield from _cosine_rules(function, rule)
    yield from _direction_rules(function, base, rule)
    for name in sorted(names & {"f0", "albedo", "rs", "rd"}):
        if lobe:
            yield rule(f"{name} > 1 is 1", {name: 1.022}, {name: 1.0})
            yield rule(f"{name} < 0 is 0", {name: -0.5}, {name: 0.0}, same=True)
        elif function.name.startswith("lobe_F_"):
            yield rule(f"{name} > 1 stays", {name: 1.022}, {name: 1.022})
            yield rule(f"{name} < 0 is 0", {name: -0.5}, {name: 0.0})
    if "eta" in names and function.name.startswith(("lobe_F_", "lobe_T_")):
        matched = {"eta": 1.0} | ({"k": 0.0} if "k" in names else {})
        yield rule("eta = 1", matched, matched)
        if "cosI" in names:
            yield rule("eta = 1 at grazing", matched | {"cosI": 0.0}, matched | {"cosI": 0.0})
    for name in sorted(names & {"u", "tanHalf"}):
        if function.parameter(name).width == 1:
            yield rule(f"{name} < 0 is 0", {name: -0.1}, {name: 0.0})
            yield rule(f"{name} > 1 is 1", {name: 1.1}, {name: 1.0})
    if "k" in names:
        yield rule("k = 0", {"k": 0.0}, {"k": 0.0})


def _cosine_rules(function: Function, rule) -> Iterator[Rule]:
    for p in function.parameters:
        if p.kind != "cosine" or p.name in geometry.SIGNED:
            continue
        yield rule(f"{p.name} = 1 + 1 ulp is 1", {p.name: ONE_AND_ULP}, {p.name: 1.0}, slack=2)
        if function.kind == "term" and not function.name.startswith("lobe_D_") and p.low == 0:
            yield rule(f"{p.name} < 0 is 0", {p.name: -0.1}, {p.name: 0.0})


def _direction_rules(function: Function, base: dict, rule) -> Iterator[Rule]:
    names = set(base)
    if {"N", "V"} <= names:
        yield rule("V = N", {"V": base["N"]}, {"V": base["N"]})
    if {"N", "V", "L"} <= names:
        yield rule("L = N", {"L": base["N"]}, {"L": base["N"]})
        yield rule("V = L = N", {"V": base["N"], "L": base["N"]}, {"V": base["N"], "L": base["N"]})
    if {"N", "V", "L"} <= names and function.kind == "lobe":
        yield rule("V = -L is 0", {"V": -base["L"]}, None)
    if {"N", "V", "L"} <= names:
        for X in "VL" if function.kind == "lobe" else "V" if function.name.startswith("lobe_pdf_") else "":
            below = np.where(geometry.dot(base["N"], base[X]) > 0, -base[X], base[X])
            yield rule(f"{X} below the horizon is 0", {X: below}, None)
            yield rule(f"{X} on the horizon is 0", _on_horizon(base, X), None)
    if function.name == "lobe_LdotH" and {"V", "L"} <= names:
        yield rule("V = -L is 0", {"V": -base["L"]}, None)
    if {"N", "H"} <= names and not {"V", "L"} <= names and function.kind != "helper":
        yield rule("a null H is 0", {"H": 0.0}, None)


def _on_horizon(base: dict, X: str) -> dict:
    """Frames whose N and T are axes, so that the product of N and a direction on the horizon is 0 without a rounding."""
    along = {name: geometry.normalize(base[name] * (1, 1, 0)) if name == X else np.abs(base[name]) for name in "VL"}
    return {"N": (0.0, 0.0, 1.0), **({"T": (1.0, 0.0, 0.0)} if "T" in base else {}), **along}


def unkept(function: Function, context: gl.Context, source: str) -> np.ndarray:
    """Which rows of hostile() give a value that is not finite, or is negative, [n]."""
    with context:
        got = gl.evaluate(context, source, function.call, function.result,
                          {name: x[None] for name, x in hostile(function).items()})
    return ~(np.isfinite(got) & ((got >= 0) | function.returns_directions)).all(-1)


def propagating(source: str) -> str:
    """A text of functions with min, max and clamp that hand a NaN on. Those of GLSL may turn it into a number, and do on most
    drivers, so that a NaN that such a guard repairs shows only where a compiler has deleted the guard."""
    vectors = ("vec2", "vec3", "vec4")
    pairs = [("float", "float"), *((v, t) for v in vectors for t in (v, "float"))]
    isnan = [f"bool lobe_isnan({t} x) {{ return {'isnan(x)' if t == 'float' else 'any(isnan(x))'}; }}" for t in ("float", *vectors)]
    extrema = [f"{t} lobe_{f}({t} a, {u} b) {{ return lobe_isnan(a) || lobe_isnan(b) ? a + b : {f}(a, b); }}"
               for f in ("min", "max") for t, u in pairs]
    clamps = [f"{t} lobe_clamp({t} x, {u} a, {u} b) {{ return lobe_isnan(x) ? x : clamp(x, a, b); }}" for t, u in pairs]
    whole = "int lobe_min(int a, int b) { return min(a, b); }"  # of the loop over lights
    return "\n".join((*isnan, *extrema, *clamps, whole, *(f"#define {f} lobe_{f}" for f in ("min", "max", "clamp")), source))


def repaired(function: Function, context: gl.Context, source: str, inputs: dict[str, np.ndarray]) -> np.ndarray:
    """Which rows of inputs [1, n, width] form a NaN on the way that min, max or clamp repairs, or are not finite, [n]."""
    with context:
        return ~np.isfinite(gl.evaluate(context, propagating(source), function.call, function.result, inputs)).all(-1)


def errors(rule: Rule, shader: compare.Shader, context: gl.Context) -> np.ndarray:
    """Error over what is allowed, [n]; infinite where 0 is due and something else comes."""
    asked = {name: x[None] for name, x in rule.asked.items()}
    if rule.meant is None:
        with context:
            got = gl.evaluate(context, shader.source, shader.call, shader.result, asked)
        return np.where((got == 0).all(-1), 0.0, np.inf)
    if rule.same:
        meant = {name: x[None] for name, x in rule.meant.items()}
        with context:
            got, own = (gl.evaluate(context, shader.source, shader.call, shader.result, x) for x in (asked, meant))
        return np.where((got == own).all(-1), 0.0, np.inf)
    result = compare.compare(rule.case, shader, context)
    return result.units.max(-1) / (result.row["units_allowed"] + rule.slack)


def off_unit(function: Function, shader: compare.Shader, context: gl.Context) -> np.ndarray:
    """What vectors 1e-4 too long or too short cost, sorted relative errors [n], at the header's default shapes and
    random directions above the horizon; empty for a function of no directions."""
    vectors = [p.name for p in function.parameters if p.kind == "direction"]
    if not vectors or function.returns_directions:
        return np.zeros(0)
    inputs = domain.sample(function, OFF_UNIT_POINTS, SEED)
    inputs |= {p.name: np.broadcast_to(np.float32(p.default), inputs[p.name].shape)
               for p in function.parameters if not p.is_geometry}
    rng = np.random.default_rng(SEED)
    stretched = {name: (inputs[name] * (1 + OFF_UNIT * rng.choice([-1.0, 1.0], (len(inputs[name]), 1)))).astype(np.float32)
                 for name in vectors}
    if {"V", "L", "H"} <= set(inputs):
        stretched["H"] = stretched["V"] + stretched["L"]
    with context:
        value, got = (gl.evaluate(context, shader.source, shader.call, shader.result,
                                  {name: x[None] for name, x in chosen.items()}).astype(float)
                      for chosen in (inputs, inputs | stretched))
    shown = (value > 1e-3 * np.median(value[value > 0])).all(-1)  # where there is something to be seen
    return np.sort((np.abs(got - value)[shown] / value[shown]).max(-1))
