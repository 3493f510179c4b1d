"""The stability suite: every function where formulas fail. Point cases, random inputs near singular sets, the policy for
degenerate inputs, symmetries, limits, integrals; and vectors off unit length, whose cost is stated.

Every check yields rows for the JSON; random inputs yield a Map of the error, too. A Driver is where and how the shaders
run: another context, or another treatment of their text, is one more Driver.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from . import bundle, cases, compare, gl, physics, policy, singular
from .catalogue import EXACT, Catalogue, Function
from .report import number

POINTS = 1 << 20  # random inputs a function
SLOW_POINTS = 1 << 12  # where the reference is a quadrature
CHUNK = 1 << 16
SEED = 20261
SAFE = 1e-3  # a relative error that nobody sees
BINS = 28  # of each axis of a map
ORDINARY = 1e-2  # a direction's distance from a singular set at which formulas have no trouble
SUITES = ("cases", "random", "policy", "symmetry", "limit", "integral", "off unit")


@dataclass(frozen=True)
class Driver:
    """Where shaders run, and what is done to their text first: `precise`, an optimiser, another precision."""

    name: str
    context: gl.Context
    prepared: Callable[[str], str] = lambda source: source


@dataclass
class Outcome:
    rows: list[dict] = field(default_factory=list)
    maps: dict[tuple[str, str], Map] = field(default_factory=dict)  # by function's label and driver
    unanswered: list[str] = field(default_factory=list)  # families of cases that no function answers yet

    @property
    def passed(self) -> bool:
        return all(row["pass"] for row in self.rows)


# --- maps of the error -----------------------------------------------------------------------------------------------


class Map:
    """Errors over the distances to each pair of singular sets, binned in equal ratios: the largest relative error of each
    bin, where the directions are far from all other sets, and the largest error over the allowed one, wherever they are.
    The two most critical axes are those over which the relative error varies most."""

    def __init__(self, function: Function):
        self.sets = singular.sets(function)
        self.pairs = [(i, j) for i, j in combinations(range(len(self.sets)), 2)
                      if self.sets[i].moves != self.sets[j].moves] or [(i, i) for i in range(len(self.sets))]
        shape = (len(self.pairs), BINS * BINS)
        self.relative, self.ratio = np.zeros(shape), np.zeros(shape)  # the largest of each bin
        self.count, self.sum, self.squares = np.zeros(shape), np.zeros(shape), 0.0  # of log10 of the relative error

    def add(self, inputs: dict[str, np.ndarray], relative: np.ndarray, ratio: np.ndarray) -> None:
        """Inputs with the relative error and the error over the allowed one of each, [n]."""
        inputs = {name: x.astype(float) for name, x in inputs.items()}
        distances = [s.distance(inputs) for s in self.sets]
        bins = [self._bins(s, d) for s, d in zip(self.sets, distances)]
        near = np.array([(d < ORDINARY) & (s.order > 0) for s, d in zip(self.sets, distances)])
        digits = np.log10(np.clip(relative, compare.FLOAT32_ROUNDOFF, 1e6))
        for k, (i, j) in enumerate(self.pairs):
            inside = (bins[i] >= 0) & (bins[j] >= 0)
            cell = bins[i][inside] * BINS + bins[j][inside]
            np.maximum.at(self.ratio[k], cell, ratio[inside])
            inside &= near.sum(0) == near[list({i, j})].sum(0)
            cell = bins[i][inside] * BINS + bins[j][inside]
            np.maximum.at(self.relative[k], cell, relative[inside])
            self.count[k] += np.bincount(cell, minlength=BINS * BINS)
            self.sum[k] += np.bincount(cell, digits[inside], minlength=BINS * BINS)

    @staticmethod
    def _bins(s: singular.Set, distance: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.log(distance / s.nearest) / np.log(s.farthest / s.nearest)
        t = np.where(np.isfinite(t) & (t >= -1e-6), np.clip(t, 0, 1 - 1e-9), -1 / BINS)
        return np.floor(t * BINS).astype(int)

    @property
    def critical(self) -> int | None:
        """Index of the pair over which the error varies most; None where there is nothing to map."""
        if not self.pairs:
            return None
        mean = np.divide(self.sum, self.count, out=np.zeros_like(self.sum), where=self.count > 0)
        total = self.count.sum(1, keepdims=True)
        centre = self.sum.sum(1, keepdims=True) / np.maximum(total, 1)
        return int(np.argmax((self.count * (mean - centre) ** 2).sum(1) / np.maximum(total[:, 0], 1)))

    def edges(self, s: singular.Set) -> np.ndarray:
        return s.drawn(np.linspace(0, 1, BINS + 1))

    def drawn(self) -> tuple[singular.Set, singular.Set, np.ndarray, np.ndarray]:
        """The two critical axes, and over them the largest relative error and error over the allowed one, [BINS, BINS],
        NaN where no input fell."""
        k = self.critical
        i, j = self.pairs[k]
        empty = self.count[k] == 0
        return (self.sets[i], self.sets[j],
                *(np.where(empty, np.nan, x[k]).reshape(BINS, BINS) for x in (self.relative, self.ratio)))

    def safe(self) -> str:
        """The range of the two critical inputs in which the relative error stays below SAFE, in words."""
        a, b, relative, _ = self.drawn()
        good = np.nan_to_num(relative) <= SAFE
        if good.all():
            return "everywhere"
        if a is b:
            first = int(np.argmax(np.logical_and.accumulate(np.diag(good)[::-1])[::-1]))
            return f"{a.axis} >= {number(self.edges(a)[first], 2)}" if good[-1, -1] else "nowhere"
        # the largest rectangle that reaches the far end of both axes
        whole = np.logical_and.accumulate(np.logical_and.accumulate(good[::-1, ::-1], 0), 1)[::-1, ::-1]
        if not whole.any():
            return "no simple range"
        i, j = max(np.argwhere(whole), key=lambda ij: (BINS - ij[0]) * (BINS - ij[1]))
        limits = [f"{s.axis} >= {number(self.edges(s)[k], 2)}" for s, k in ((a, i), (b, j)) if k]
        return " and ".join(limits)


# --- checks ----------------------------------------------------------------------------------------------------------


def run(library: Catalogue, functions: tuple[Function, ...], drivers: tuple[Driver, ...], points: int = POINTS,
        suites: tuple[str, ...] = SUITES,
        on_step: Callable[[str, int, int], None] = lambda name, done, of: None) -> Outcome:
    """Runs the suites over functions on drivers."""
    outcome = Outcome(unanswered=cases.unanswered(library))
    shared = [d for d in physics.demands(library, functions) if d.kind in suites]
    families = [f for f in cases.answered(library) if set(cases.load(library, f).functions) & set(functions)]
    steps = len(functions) + len(drivers)
    for done, function in enumerate(functions):
        on_step(library.label(function), done, steps)
        for row in _function_rows(library, function, drivers, points, suites, outcome):
            outcome.rows.append(row)
    for done, driver in enumerate(drivers, len(functions)):
        on_step(f"symmetries, limits, integrals: {driver.name}", done, steps)
        if "cases" in suites:
            outcome.rows += [_case_row(library, family, driver) for family in families]
        shade = _Shades(library, driver)
        outcome.rows += [_demand_row(library, demand, driver, shade) for demand in shared]
    return outcome


def _function_rows(library: Catalogue, function: Function, drivers, points: int, suites,
                   outcome: Outcome) -> Iterator[dict]:
    source = bundle.bundle(library, [function.key])
    shaders = {d.name: compare.library_shader(function, d.prepared(source), library.label(function)) for d in drivers}
    if "random" in suites:
        yield from _random_rows(function, shaders, drivers, points, outcome)
    rules = list(policy.rules(function)) if "policy" in suites else []  # their references serve all drivers
    for driver in drivers:
        shader = shaders[driver.name]
        if "policy" in suites:
            yield from _policy_rows(function, rules, shader, driver)
        if "off unit" in suites and len(loss := policy.off_unit(function, shader, driver.context)):
            quantiles = {f"loss_{name}": float(loss[int(q * (len(loss) - 1))])
                         for name, q in (("median", 0.5), ("p99", 0.99), ("max", 1.0))}
            yield _row("off unit", shader.label, f"vectors {policy.OFF_UNIT:g} off unit length", driver, len(loss),
                       np.zeros(1) if np.isfinite(loss).all() else np.full(1, np.inf)) | quantiles


def _row(suite: str, function: str, check: str, driver: Driver, count: int, ratio: np.ndarray) -> dict:
    """The JSON row that all checks share; `ratio` holds errors over what is allowed."""
    worst = float(np.max(ratio, initial=0.0))
    return {"suite": suite, "function": function, "check": check, "context": driver.name,
            "renderer": driver.context.renderer, "count": int(count), "worst": worst, "pass": worst <= 1}


class _Shades(physics.Shades):
    """Compiles only what an expression needs: some drivers take a second for the whole library."""

    def __init__(self, library: Catalogue, driver: Driver):
        super().__init__(driver.context, "")
        self.library, self.driver = library, driver

    def __call__(self, expression: str, result: str, inputs: dict[str, np.ndarray]) -> np.ndarray:
        self.source = self.driver.prepared(_needed(self.library, expression))
        return super().__call__(expression, result, inputs)


def _needed(library: Catalogue, expression: str) -> str:
    return bundle.bundle(library, sorted(set(re.findall(r"\b(?:lobe|LOBE)_\w+", expression))))


def _case_row(library: Catalogue, family: cases.Family, driver: Driver) -> dict:
    known = cases.load(library, family)
    source = driver.prepared(_needed(library, family.call))
    with driver.context:
        got = gl.evaluate(driver.context, source, family.call, "float", known.inputs)[:, 0].astype(float)
    factor = compare.HARDWARE_FACTOR if driver.context.is_hardware else 1
    ratio = known.errors(got) / factor
    return _row("cases", library.label(known.functions[0]), family.name, driver, len(got), ratio) | {
        "call": family.call, "units_allowed": cases.units(known.functions) * factor,
        "at": {name: x[0, int(ratio.argmax())] for name, x in known.inputs.items()}}


def _demand_row(library: Catalogue, demand: physics.Demand, driver: Driver, shade: physics.Shades) -> dict:
    measure = demand.measure(shade)
    worst = measure.worst
    return _row(demand.kind, library.label(demand.function), demand.name, driver, measure.error.size, measure.ratio) | {
        "error": float(measure.error[worst]), "allowed": float(measure.allowed[worst])}


def _policy_rows(function: Function, rules: list, shader: compare.Shader, driver: Driver) -> Iterator[dict]:
    bad = policy.unkept(function, driver.context, shader.source)
    yield _row("policy", shader.label, "finite and not negative", driver, len(bad), np.where(bad, np.inf, 0.0)) | {
        "at": {name: x[int(bad.argmax())] for name, x in policy.hostile(function).items()}}
    for rule in rules:
        ratio = policy.errors(rule, shader, driver.context)
        yield _row("policy", shader.label, rule.name, driver, len(ratio), ratio) | {
            "at": {name: x[int(ratio.argmax())] for name, x in rule.asked.items()}}


def random_case(function: Function, count: int, seed: int) -> compare.Case:
    """Random inputs of a function near its singular sets, with the reference's values."""
    inputs = {name: x[None] for name, x in singular.sample(function, count, seed).items()}
    return compare.Case(function, "stability", "points", inputs, None, compare.reference_values(function, inputs, None))


def _random_rows(function: Function, shaders: dict, drivers, points: int, outcome: Outcome) -> list[dict]:
    """Random inputs near singular sets; the reference's values of a chunk serve all drivers."""
    count = min(points, SLOW_POINTS) if compare.is_quadrature(function) else points
    first, rows = Map(function), {}  # one driver's map does: the errors are the formula's
    for k, start in enumerate(range(0, count, CHUNK)):
        case = random_case(function, min(CHUNK, count - start), SEED + 2 * k)
        inputs = {name: x[0] for name, x in case.inputs.items()}
        for driver in drivers:
            result = compare.compare(case, shaders[driver.name], driver.context)
            worst = result.units.max(-1) / result.row["units_allowed"]
            if driver is drivers[0]:
                first.add(inputs, _relative(result), worst)
            rows[driver.name] = _merged(rows.get(driver.name), _random_row(result, driver, worst))
    outcome.maps[shaders[drivers[0].name].label, drivers[0].name] = first
    rows[drivers[0].name] |= {"safe": first.safe() if first.pairs else "everywhere"}
    return list(rows.values())


def _relative(result: compare.Result) -> np.ndarray:
    """Relative errors, the largest of the channels, [n]; 0 where the reference is 0 or the value is excused. Of a vector,
    its error's length over its own; of a fit to the exact value, what exceeds the error that its header states."""
    expected, function = result.case.reference.value, result.case.function
    counted = (np.abs(expected) >= compare.SMALLEST_REFERENCE) & (result.units > 0)
    with np.errstate(invalid="ignore"):
        error = np.abs(result.got - expected)
        if function.returns_directions:
            return np.linalg.norm(error, axis=-1) / np.maximum(np.linalg.norm(expected, axis=-1), SAFE)
    if function.approximation and function.approximation.name == EXACT:
        error = np.maximum(error - function.approximation.error(expected), 0.0)
    relative = np.divide(error, np.abs(expected), out=np.zeros_like(expected), where=counted)
    return np.where(np.isfinite(result.got), relative, np.inf).max(-1)


def _random_row(result: compare.Result, driver: Driver, ratio: np.ndarray) -> dict:
    n = int(ratio.argmax())
    return _row("random", result.row["function"], "near singular sets", driver, len(ratio), ratio) | {
        "units": result.row["max_units"], "units_allowed": result.row["units_allowed"],
        "nonfinite": result.row["nonfinite"], "undecided": result.row["undecided"],
        "at": {name: x[0, n] for name, x in result.case.inputs.items()},
        "got": result.got[n], "reference": result.case.reference.value[n], "kappa": result.case.reference.kappa[n]}


def _merged(known: dict | None, row: dict) -> dict:
    """One row of two: the worse one, with the sums of both."""
    if known is None:
        return row
    worse = max(known, row, key=lambda r: r["worst"])
    return worse | {key: known[key] + row[key] for key in ("count", "nonfinite", "undecided")}
