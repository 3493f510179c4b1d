"""Speed against accuracy: what each alternative costs, how wrong it is at points and in pictures, in one table.

The charts (chart.py), README's column of costs, docs/findings.md and the tests live on what `measure` returns.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import cache

import numpy as np

from . import bundle, catalogue, compare, families, gl, gltime, isa, scenes
from .catalogue import Catalogue, Function
from .families import Chart, Inputs, Member
from .paths import ROOT

SCHEMA = 1
RESULTS = ROOT / "benchmarks" / "results" / "chart.json"
PICTURES = ("teapot-four", "sphere-grazing")
PICTURE_SIZE = 128
UNIT_POINTS = 1 << 12
ABSOLUTE = ("albedo", "albedo-diffuse")  # charts whose values come near 0 and whose errors are therefore not relative
DEVICES = ("isa", "gl")
UNGUARDED = "lobe_GGX, without guards"

Step = Callable[[str, int, int], None]


def measure(charts: tuple[Chart, ...], devices: tuple[str, ...], with_peers: bool = False,
            step: Step = lambda name, done, of: None) -> dict:
    """Everything that chart.json holds."""
    library = catalogue.load()
    entries = [(chart, member) for chart in charts for member in families.members(chart, with_peers, library)]
    context = gl.create_context("egl")
    errors = _errors(entries, context, step)
    rows = []
    if "isa" in devices:
        step("compiling", 0, 1)
        rows += _isa_rows(entries, errors)
    if "gl" in devices:
        step(f"timing on {context.renderer}", 0, 1)
        rows += _gl_rows(entries, errors, context)
    found = {"schema": SCHEMA, "date": datetime.date.today().isoformat(), "renderer": context.renderer,
             "gpu": context.renderer if context.is_hardware else "not measured",
             "devices": list(devices), "results": rows}
    if "isa" in devices:
        found |= {"isa": {"mesa": isa.driver(), "toolchain": isa.toolchain()}, "functions": functions(library),
                  "calibration": calibration(with_peers)}
    return found


# Costs

def functions(library: Catalogue) -> dict[str, dict]:
    """The cost of each function of the library, called with its parameters, and the stamp of what was measured."""
    calls = [isa.of(library, f) for f in library.functions]
    costs = {gpu: isa.costs(calls, gpu) for gpu in isa.GPUS}
    return {f.key: {"stamp": stamp(library, f), **{gpu: asdict(costs[gpu][i]) for gpu in isa.GPUS}}
            for i, f in enumerate(library.functions)}


def stamp(library: Catalogue, function: Function, beside: str = "") -> str:
    """A hash of a function's code with all that it calls, without comments, and of what else was measured with it."""
    text = bundle.bundle(library, [function.key])
    code = " ".join(re.sub(r"//.*", "", text).split())
    return hashlib.sha256((code + beside).encode()).hexdigest()[:16]


def _isa_rows(entries, errors) -> list[dict]:
    calls = [chart.weighed(member) for chart, member in entries]
    alike = [_weighed_alike(member, call) for (_, member), call in zip(entries, calls)]
    rows = []
    for gpu in isa.GPUS:
        for (chart, member), cost, same, error in zip(entries, isa.costs(calls, gpu), isa.costs(alike, gpu), errors):
            figures = asdict(cost) | {"alike": same.inverse_throughput, "ns": None}
            rows.append(_row(chart, member, f"isa:{gpu}", figures, error))
    return rows


def _weighed_alike(member: Member, call: isa.Call) -> isa.Call:
    """What is weighed against other libraries' functions, as docs/peers.md does: ours without guards on divisors."""
    from . import peers_measured

    return replace(call, source=peers_measured.without_divisor_guards(call.source)) if member.key else call


def _gl_rows(entries, errors, context: gl.Context) -> list[dict]:
    samples = {chart.name: chart.sample(families.POINTS) for chart, _ in entries}
    took = gltime.times(context, [c.weighed(m) for c, m in entries], [samples[c.name] for c, _ in entries])
    nothing = dict.fromkeys((*isa.Cost.__dataclass_fields__, "alike"))
    return [_row(chart, member, f"gl:{context.renderer}", nothing | {"ns": t.ns, "ns_spread": t.spread}, error)
            for (chart, member), t, error in zip(entries, took, errors)]


def _row(chart: Chart, member: Member, device: str, cost: dict, error: dict) -> dict:
    return {"function": member.name, "family": chart.family, "chart": chart.name, "origin": member.origin,
            "device": device, "cost": cost, "error": error, "domain": chart.domain, "stands_for": member.stands_for,
            "call": member.call, "formula": member.formula, "source": member.cited, "key": member.key}


def calibration(with_peers: bool) -> list[dict]:
    """Whole GGX lobes as others have measured them: one grey f0, no horizon rule, inputs from a buffer. There the
    driver's model hides part of the work behind the memory; the same lobes with interpolated inputs stand beside.
    What guards cost ours is told by a row of lobe_GGX without any clamp."""
    from . import peers_measured

    chart = families.NAMES["specular"]
    rows = [m for m in families.members(chart, with_peers, guards=False) if m.stands_for == families.GGX]
    ours = next(m for m in rows if m.key == families.GGX)
    rows.append(replace(ours, name=UNGUARDED, source=peers_measured.without_clamps(ours.source)))
    calls = [isa.Call(peers_measured.without_horizon(m.source), re.sub(r"\bf0\b", "vec3(f0)", f"({m.call}).x"), "float",
                      tuple((n, "float" if n == "f0" else t) for n, t in chart.weighed(m).inputs)) for m in rows]
    buffered, interpolated = (isa.costs(calls, "NAVI21", stage) for stage in ("compute", "fragment"))
    return [{"function": m.name, "origin": m.origin, "buffered": asdict(b), "interpolated": asdict(i)}
            for m, b, i in zip(rows, buffered, interpolated)]


# Errors

def _errors(entries, context: gl.Context, step: Step) -> list[dict]:
    found = []
    for done, (chart, member) in enumerate(entries):
        step(f"{chart.name}: {member.name}", done, len(entries))
        found.append(_at_points(chart, member, context) | _in_units(member, context)
                     | _in_pictures(chart, member, context))
    return found


@cache
def _sampled(chart_name: str, stands_for: str) -> tuple[Inputs, np.ndarray]:
    inputs = families.NAMES[chart_name].sample(families.POINTS)
    return inputs, families.exact_values(stands_for, inputs)


def _at_points(chart: Chart, member: Member, context: gl.Context) -> dict:
    inputs, exact = _sampled(chart.name, member.stands_for)
    got = drawn(context, member.source, chart.valued(member), member.result, {n: x[None] for n, x in inputs.items()})
    far = _distance(chart, got, exact)
    return {"max": far.max(), "p99": np.quantile(far, 0.99), "rms": np.sqrt(np.mean(far**2)),
            "approximation_max": _approximation(chart, member, inputs, exact)}


def drawn(context: gl.Context, source: str, call: str, result: str, inputs: dict, weights=None) -> np.ndarray:
    """The call's values in double, [n, width]; an input that it does not use would be an error to the driver."""
    used = {n: x for n, x in inputs.items() if re.search(rf"\b{n}\b", call)} or dict(list(inputs.items())[:1])
    with context:
        return gl.evaluate(context, gl.version_stripped(source), call, result, used, weights).astype(np.float64)


def _distance(chart: Chart, got: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Errors where the exact value is not 0; what is not finite is infinitely wrong."""
    exact = np.broadcast_to(exact, np.broadcast_shapes(got.shape, exact.shape))
    counted = np.abs(exact) > compare.SMALLEST_REFERENCE
    with np.errstate(all="ignore"):
        far = np.abs(got - exact) / (1.0 if chart.name in ABSOLUTE else np.abs(exact))
    return np.where(np.isfinite(far), far, np.inf)[counted]


def _approximation(chart: Chart, member: Member, inputs: Inputs, exact: np.ndarray) -> float | None:
    """How far the formula itself is from the exact term, without rounding; None where no reference has the formula."""
    if not member.key:
        return None
    (function,) = catalogue.load().find(member.key)
    if function.approximation and function.approximation.name == catalogue.EXACT:
        return None  # the reference has the exact term: `max` is the fit's error, and rounding
    if member.key == member.stands_for:
        return 0.0
    known = inputs | families.aliases(inputs)
    if not all(p.name in known for p in function.parameters):
        return None
    return float(_distance(chart, families.exact_values(member.key, known), exact).max())


def _in_units(member: Member, context: gl.Context) -> dict:
    """Rounding alone, against the member's own formula, in the units of `lobe compare`."""
    none = {"units": None, "units_p99": None, "units_rms": None}
    if not member.key:
        return none
    (function,) = catalogue.load().find(member.key)
    if compare.is_quadrature(function):
        return none
    case = compare.points_case(function, UNIT_POINTS, {}, families.SEED)
    got = drawn(context, member.source, function.call, function.result, case.inputs)
    units = compare.units_of(got, case.reference)
    units = units[np.isfinite(units)]
    return {"units": units.max(), "units_p99": np.quantile(units, 0.99), "units_rms": np.sqrt(np.mean(units**2))}


@cache
def _picture(chart_name: str, stands_for: str, scene: str, alpha: float):
    chart = families.NAMES[chart_name]
    seen = scenes.pixels(scenes.find(scene), PICTURE_SIZE)
    inputs, weights = chart.template(seen, alpha)
    weights = np.ascontiguousarray(np.broadcast_to(weights, (*next(iter(inputs.values())).shape[:2], 3)), np.float32)
    exact = families.exact_values(stands_for, inputs)
    exact = exact @ [[0.5], [1.0]] if exact.shape[-1] == 2 else exact
    return seen, inputs, weights, (exact * weights.astype(float)).sum(0)


def _in_pictures(chart: Chart, member: Member, context: gl.Context) -> dict:
    """The worst over the scenes and widths: FLIP, and the rms difference relative to the rms of the exact picture."""
    value = chart.valued(member)
    call = f"vec3(dot({value}, vec2(0.5, 1.0)))" if member.result == "vec2" else gl.widened(value, member.result)
    flips, relative = [], []
    for scene in PICTURES:
        for alpha in chart.alphas:
            seen, inputs, weights, exact = _picture(chart.name, member.stands_for, scene, alpha)
            got = drawn(context, member.source, call, "vec3", inputs, weights)
            flips.append(compare.flip(seen.picture(exact), seen.picture(got)))
            relative.append(np.sqrt(np.mean((got - exact) ** 2) / np.mean(exact**2)))
    return {"image_flip": max(flips), "image_rms": max(relative)}


def stored() -> dict:
    """The results that the repository holds."""
    return json.loads(RESULTS.read_text(encoding="utf-8"))
