"""The precision matrix: what holds on which driver, through which compiler, and in half precision.

One axis at a time: each driver with the text as it is; then, on the first, each treatment of the text; then the two
drivers that do worst, with the treatment that does worst. Half precision is measured apart, since it has no tolerance:
what it costs beside float32.

    python -m lobe.lab.precision [--points N] [--page-only]

measures all, and writes benchmarks/results/precision.json and docs/precision.md.
"""

from __future__ import annotations

import argparse
import datetime
import json
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import bundle, catalogue, compare, drivers, files, gl, half, plots, stability, treatments
from .catalogue import Catalogue, Function
from .errors import InputError
from .paths import ROOT
from .report import aligned, environment, number
from .stability import Driver, Outcome

POINTS = 1 << 14  # random inputs a function and column
SEED = 11


@dataclass(frozen=True)
class Column:
    """A driver, and what is done to the shaders before: nothing, `precise` or `spirv-opt`."""

    driver: str
    treatment: str = ""

    @property
    def name(self) -> str:
        return f"{self.driver}, {self.treatment}" if self.treatment else self.driver


COLUMNS = (*map(Column, drivers.NAMES), Column("egl", "precise"), Column("egl", "spirv-opt"),
           Column("softpipe", "spirv-opt"), Column("swiftshader", "spirv-opt"))


def matrix() -> tuple[tuple[Driver, ...], dict[str, str]]:
    """The columns that this machine can draw, and by name what the others miss. InputError where EGL is missing."""
    contexts, found, missing = {}, [], {}
    for column in COLUMNS:
        try:
            if column.driver not in contexts:
                contexts[column.driver] = drivers.create(column.driver)
            found.append(treated(column, contexts[column.driver]))
        except InputError as error:
            if column.name == "egl":
                raise
            missing[column.name] = str(error)
    return tuple(found), missing


def treated(column: Column, context: gl.Context) -> Driver:
    """The stability suite's driver of a column. InputError names the package that is missing."""
    if column.treatment == "precise":
        return Driver(column.name, context, treatments.precise)
    if column.treatment == "spirv-opt":
        treatments.require_tools()
        return Driver(column.name, drivers.Treated.of(context, treatments.optimised))
    return Driver(column.name, context)


# --- built-in functions ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Builtin:
    """A built-in function over inputs where it is asked for, its exact value and condition number.

    inputs   draws float64 columns
    exact    (value, condition number) of the columns
    """

    name: str
    call: str
    inputs: Callable[[np.random.Generator, int], dict[str, np.ndarray]]
    exact: Callable[..., tuple[np.ndarray, np.ndarray]]


def _log(low: float, high: float, sign: float = 1.0) -> Callable:
    return lambda rng, n: {"x": sign * np.exp(rng.uniform(np.log(low), np.log(high), n))}


def _turn(rng, n):
    return {"x": rng.uniform(-np.pi, np.pi, n)}


def _power(rng, n):
    """Bases near 1 for large exponents, and the base 0."""
    y = np.exp(rng.uniform(np.log(0.1), np.log(1e6), n))
    x = np.exp(-np.exp(rng.uniform(np.log(1e-3), np.log(20.0), n)) / y)
    return {"x": np.where(np.arange(n) % 64 == 0, 0.0, x), "y": y}


def _of_power(x, y):
    with np.errstate(divide="ignore"):
        return x**y, np.where(x > 0, y * (1 + np.abs(np.log(np.maximum(x, 1e-300)))), 0.0)


BUILTINS = (
    Builtin("1 / x", "1.0 / x", _log(1e-37, 1e37), lambda x: (1 / x, 1.0 + 0 * x)),
    Builtin("sqrt", "sqrt(x)", _log(1e-37, 1e37), lambda x: (np.sqrt(x), 0.5 + 0 * x)),
    Builtin("exp", "exp(x)", _log(1e-8, 86, -1.0), lambda x: (np.exp(x), abs(x))),
    Builtin("exp2", "exp2(x)", _log(1e-8, 125, -1.0), lambda x: (np.exp2(x), abs(x) * np.log(2))),
    Builtin("log", "log(x)", _log(1e-30, 1e30), lambda x: (np.log(x), 1 / abs(np.log(x)))),
    Builtin("log2", "log2(x)", _log(1e-30, 1e30), lambda x: (np.log2(x), 1 / abs(np.log(x)))),
    Builtin("pow", "pow(x, y)", _power, _of_power),
    Builtin("sin", "sin(x)", _turn, lambda x: (np.sin(x), abs(x / np.tan(x)))),
    Builtin("cos", "cos(x)", _turn, lambda x: (np.cos(x), abs(x * np.tan(x)))),
    Builtin("tan", "tan(x)", _log(1e-6, 1.5), lambda x: (np.tan(x), 2 * x / np.sin(2 * x))),
    Builtin("asin", "asin(x)", _log(1e-6, 0.999), lambda x: (np.arcsin(x), x / np.sqrt(1 - x * x) / np.arcsin(x))),
)
BUILTIN_POINTS = 1 << 16
SUSPECT = 8  # units of a built-in function that spoil those that call it


def builtin_units(context: gl.Context, builtin: Builtin) -> float:
    """The largest error of a driver's built-in function, in the units that functions of the library are held to;
    infinite where 0 is due and something else comes."""
    drawn = builtin.inputs(np.random.default_rng(SEED), BUILTIN_POINTS)
    inputs = {name: x.astype(np.float32)[None, :, None] for name, x in drawn.items()}
    with context:
        got = gl.evaluate(context, "", builtin.call, "float", inputs)[:, 0]
    value, kappa = builtin.exact(*(x[0, :, 0].astype(float) for x in inputs.values()))
    expected = compare.Values(value, compare.FLOAT32_ROUNDOFF * (1 + kappa) * abs(value), kappa)
    return float(compare.units_of(got.astype(float), expected).max())


def used_builtins(library: Catalogue, function: Function) -> set[str]:
    """Names in BUILTINS that a function calls, itself or through others."""
    text = "".join(re.sub(r"//.*", "", f.definition) for f in bundle.closure(library, [function]))
    return {b.name for b in BUILTINS if re.search(rf"\b{re.escape(b.name)}\(", text)}


# --- results ---------------------------------------------------------------------------------------------------------

SUITES = ("cases", "random", "policy", "symmetry", "limit")  # integrals tell of formulas, not of arithmetic


def measured(library: Catalogue, functions: tuple[Function, ...], points: int, suites: tuple[str, ...] = SUITES,
             on_step: Callable[[str, int, int], None] = lambda name, done, of: None) -> tuple[Outcome, dict]:
    """Runs the stability suite on all columns, and measures built-in functions and half precision: what the suite
    found, and what precision.json holds."""
    columns, missing = matrix()
    suites = tuple(suite for suite in suites if suite in SUITES)
    outcome = stability.run(library, functions, columns, points, suites, on_step)
    plain = {d.name: d.context for d in columns if d.name in drivers.NAMES}
    builtins = {b.name: {name: builtin_units(context, b) for name, context in plain.items()} for b in BUILTINS}
    halves = {}
    for done, function in enumerate(functions):
        on_step(f"half precision: {library.label(function)}", done, len(functions))
        halves[library.label(function)] = half.row(library, function, columns[0].context)
    found = summary(library, functions, outcome, columns, missing, builtins, points)
    return outcome, found | {"suites": suites, "half": halves}


def summary(library: Catalogue, functions: tuple[Function, ...], outcome: Outcome, columns: tuple[Driver, ...],
            missing: dict[str, str], builtins: dict, points: int) -> dict:
    """What precision.json holds of the matrix. Errors are over the allowed ones, the largest of all suites."""
    rows: dict[str, list[dict]] = {d.name: [] for d in columns}
    for row in outcome.rows:
        rows[row["context"]].append(row)
    worst: dict[str, dict[str, float]] = {library.label(f): {} for f in functions}
    for name, found in rows.items():
        for row in found:
            function = worst.setdefault(row["function"], {})
            function[name] = max(function.get(name, 0.0), row["worst"])
    known = {library.label(f): f for f in library.functions}
    failures = [{key: row[key] for key in ("function", "context", "suite", "check", "worst")}
                | {"builtins": _guilty(library, known[row["function"]], row["context"].partition(",")[0], builtins)}
                for row in outcome.rows if not row["pass"]]
    return {"date": datetime.date.today().isoformat(), "points": points,
            "columns": {d.name: _column(d, rows[d.name]) for d in columns},
            "missing": missing, "functions": worst, "failures": failures, "builtins": builtins}


def _guilty(library: Catalogue, function: Function, driver: str, builtins: dict) -> list[str]:
    """The driver's built-in functions that a function calls and that are out of tolerance themselves; none on those
    drivers on which all must hold."""
    if driver in gl.CONTEXTS:
        return []
    return sorted(b for b in used_builtins(library, function) if builtins[b].get(driver, 0.0) > SUSPECT)


def _column(driver: Driver, rows: list[dict]) -> dict:
    return {"renderer": driver.context.renderer, "version": driver.context.version, "checks": len(rows),
            "values": sum(r["count"] for r in rows), "functions": len({r["function"] for r in rows}),
            "failing": sorted({r["function"] for r in rows if not r["pass"]}),
            "worst": max((r["worst"] for r in rows if r["pass"]), default=0.0)}


def unexplained(found: dict) -> list[dict]:
    """Failures that no built-in function of the driver explains, measured alone."""
    return [failure for failure in found["failures"] if not failure["builtins"]]


# --- what it shows ---------------------------------------------------------------------------------------------------

PAGE = ROOT / "docs" / "precision.md"
FIGURE = ROOT / "docs" / "figures" / "half-precision.svg"
RESULTS = ROOT / "benchmarks" / "results" / "precision.json"


def report(found: dict) -> str:
    """For the terminal: a line for each column, then the failures, and what is missing."""
    header = ("column", "renderer", "functions", "checks", "values", "out of tolerance")
    lines = [(name, c["renderer"][:48], str(c["functions"]), f"{c['checks']:,}", f"{c['values']:,}",
              str(len(c["failing"]))) for name, c in found["columns"].items()]
    failures = [f"{f['function']} on {f['context']}: {f['suite']}, {f['check']}: {number(f['worst'])} of what is "
                "allowed; " + (f"the driver's own {', '.join(f['builtins'])}" if f["builtins"] else "FAIL")
                for f in found["failures"]]
    left = [f"not run: {name}: {why}" for name, why in found["missing"].items()]
    count, spoilt = len(unexplained(found)), ", but for what the drivers' own built-in functions spoil"
    verdict = f"{count} FAIL" if count else "all within tolerance" + (spoilt if failures else "")
    table = aligned([header, *lines], right=range(2, 6))
    return "\n".join((*table, "", *failures, *left, verdict)).replace("∞", "inf")


def explained(found: dict) -> list[tuple[str, str, list[str], float]]:
    """What fails: (column, built-in functions that do it, functions, the largest error over the allowed)."""
    groups: dict[tuple, list[dict]] = {}
    for failure in found["failures"]:
        groups.setdefault((failure["context"], ", ".join(failure["builtins"])), []).append(failure)
    return [(*group, sorted({r["function"] for r in rows}),
             max(np.inf if r["worst"] is None else r["worst"] for r in rows)) for group, rows in groups.items()]


def width(x: float | None) -> str:
    """A least alpha in words; JSON has no infinity."""
    return "never" if x is None or not np.isfinite(x) else "any" if x <= half.WIDTHS[0] else number(x, 2)


def needed(row: dict) -> str:
    """The inputs that must be highp, with the alpha below which."""
    def word(name, x):
        always = x is None or not np.isfinite(x)
        return name if always else f"{name} below {number(x, 2)}"
    return ", ".join(word(name, x) for name, x in row["highp"].items()) or "none"


def halves(found: dict) -> dict[str, int]:
    """How many functions half precision suits, at alpha from 0.1: below UNSEEN in each treatment, and of those that
    take directions with the arithmetic in half."""
    rows = found["half"]
    counts = {t: sum(r["error"][t] is not None and r["error"][t] <= half.UNSEEN for r in rows.values())
              for t in half.TREATMENTS}
    directions = {name: r for name, r in rows.items() if {"N", "V", "L", "H", "T"} & set(r["inputs"])}
    suited = sum(r["error"]["arithmetic"] is not None and r["error"]["arithmetic"] <= half.UNSEEN
                 for r in directions.values())
    return counts | {"all": len(rows), "directions": len(directions), "directions suited": suited}


def ratio(x: float | None) -> str:
    return "" if x is None else f"{x:.2f}" if np.isfinite(x) else "∞"


def shown(found: dict) -> dict:
    """What the templates need, of what precision.json holds."""
    cells = {name: [row[c] if c in row else 0.0 for c in found["columns"]] for name, row in found["functions"].items()}
    cells = {name: ["∞" if x is None else ratio(x) for x in row] for name, row in cells.items()}
    return {"p": found, "cells": cells, "explained": explained(found), "width": width, "needed": needed, "ratio": ratio,
            "halves": halves(found),
            "suspect": SUSPECT, "usable": half.USABLE, "unseen": half.UNSEEN, "treatments": half.TREATMENTS,
            "drivers": [name for name in found["columns"] if name in drivers.NAMES]}


def markdown(found: dict) -> str:
    """docs/precision.md, from benchmarks/results/precision.json."""
    return environment().overlay(autoescape=False).get_template("precision.md.j2").render(**shown(found))


def main() -> None:
    from .progress import progress

    parser = argparse.ArgumentParser(description="Measures the precision matrix and writes docs/precision.md.")
    parser.add_argument("--points", type=int, default=POINTS, help="random inputs a function and column")
    parser.add_argument("--only", action="append", choices=SUITES, help="only this suite (repeatable)")
    parser.add_argument("--page-only", action="store_true", help="write the page of what was measured before")
    asked = parser.parse_args()
    if not asked.page_only:
        library = catalogue.load()
        with progress() as step:
            _, found = measured(library, library.functions, asked.points, tuple(asked.only or SUITES), step)
        files.write_json(RESULTS, found)
        print(report(found))
    found = json.loads(RESULTS.read_text())
    plots.write_svg(FIGURE, lambda figure: half.draw(figure, found["half"]), half.SIZE)
    files.write_text(PAGE, markdown(found))


if __name__ == "__main__":
    main()
