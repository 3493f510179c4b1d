"""docs/findings.md, README's chart of whole GGX lobes, both from the measured results: python -m lobe.lab.findings."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from . import chart as charts
from . import cost, families, files, isa, plots
from .families import OURS, TEXTBOOK, Chart
from .paths import ROOT

PAGE = ROOT / "docs" / "findings.md"
FIGURE = ROOT / "docs" / "figures" / "cost-ggx.svg"
FIRST = "isa:NAVI21"  # the device of which sentences speak where they name none
NOT_MEASURED = "not measured"
EXACT = 1e-5  # rms error below which a function counts as exact
SAME = 1.1  # ratio of rms errors within which two functions count as equally accurate
WORTH = 0.8  # of the exact function's cost, which an approximation must not exceed to pay
GOAL, GOAL_RMS = 52, 6.2e-5  # cycles and rms error that were asked of lobe_GGX, grey and without horizon rule


def page(found: dict, gpu: dict | None = None) -> str:
    """The text of the page; `gpu` is what a machine with one measured."""
    lines = ["# What the charts say", "",
             "Generated from [chart.json](../benchmarks/results/chart.json) by `python -m lobe.lab.findings`: no "
             "sentence is typed, and each gives the two numbers that it rests on. `./lobe chart` draws the charts, with "
             "every point's formula, source and figures under the mouse.", "",
             f"Measured on {found['date']} with {found['isa']['toolchain']}; errors on {found['renderer']}. Cycles are "
             "RDNA2's (NAVI21), inverse throughput for 64 invocations, unless another is named. Time on a hardware "
             f"GPU: {gpu['gpu'] if gpu else NOT_MEASURED}.", "", "The method, in five lines:", ""]
    lines += [f"{i}. {text}" for i, text in enumerate(charts.METHOD, 1)]
    for chart in families.CHARTS:
        rows = [r for r in found["results"] if r["chart"] == chart.name and r["device"] == FIRST]
        if rows:
            lines += ["", f"## {chart.title}", "", *(f"* {s}" for s in _chart(chart, rows, found))]
    lines += ["", "## Whole GGX against the figures that were asked for", "", *(f"* {s}" for s in _goal(found))]
    lines += ["", "## Cycles and time", "", *(f"* {s}" for s in _time(found, gpu))]
    return "\n".join(lines) + "\n"


def _chart(chart: Chart, rows: list[dict], found: dict) -> list[str]:
    own = [r for r in rows if r["origin"] in (OURS, TEXTBOOK)]
    sentences = []
    for term in dict.fromkeys(r["stands_for"] for r in own):
        group = [r for r in own if r["stands_for"] == term]
        exact = [r for r in group if charts.error_of(r, "rms") < EXACT]
        best = min(exact, key=charts.cost_of) if exact else min(group, key=lambda r: charts.error_of(r, "rms"))
        what = "is exact but for rounding" if exact else "is the most accurate of ours"
        sentences.append(f"{_name(best)} {what}: {_cost(best)}, rms error {_error(best)}.")
        sentences += [_verdict(r, best, group, found) for r in group if r is not best]
        sentences += _knee([r for r in rows if r["stands_for"] == term])
    return sentences + _others(rows)


def _verdict(row: dict, best: dict, group: list[dict], found: dict) -> str:
    """Whether an alternative pays, and against what."""
    if better := next((other for other in group if other is not row and _beats_everywhere(other, row, found)), None):
        return (f"{_name(row)} never pays: on all three GPUs {_name(better)} costs no more and is no less accurate, "
                f"{_cost(better)} against {_cost(row)} and rms {_error(better)} against {_error(row)}.")
    if (_cost(row), _error(row)) == (_cost(best), _error(best)):
        return f"{_name(row)} is {_name(best)} by another name: {_cost(row)} and {_cost(best)}."
    if charts.cost_of(row) > WORTH * charts.cost_of(best):
        return (f"{_name(row)} does not pay: {_cost(row)} against {_cost(best)} of {_name(best)}, for an rms error of "
                f"{_error(row)} in place of {_error(best)}.")
    seen = row["error"]["image_flip"]
    how = "pays" if seen <= charts.VISIBLE else "is cheaper, and is seen"
    return (f"{_name(row)} {how}: {_cost(row)} against {_cost(best)} of {_name(best)}, for FLIP {seen:.2g} in the "
            f"picture (rms {_error(row)} at points).")


def _beats_everywhere(better: dict, row: dict, found: dict) -> bool:
    """No worse in any GPU's cycles, in rms or in FLIP, and better in one of them."""
    def figures(r):
        costs = [charts.cost_of(_same(r, f"isa:{gpu}", found)) for gpu in isa.GPUS]
        return np.array([*costs, charts.error_of(r, "rms"), charts.error_of(r, "image_flip")])

    a, b = figures(better), figures(row)
    return bool((a <= b).all() and (a < b).any())


def _same(row: dict, device: str, found: dict) -> dict:
    return next(r for r in found["results"] if r["device"] == device
                and (r["chart"], r["origin"], r["function"]) == (row["chart"], row["origin"], row["function"]))


def _knee(rows: list[dict]) -> list[str]:
    """The point of the front that lies farthest below the line from end to end, cost against log error."""
    front = charts.front(rows, "rms")
    if len(front) < 3:
        return []
    x = np.array([charts.cost_of(r) for r in front])
    y = np.log([charts.error_of(r, "rms") for r in front])
    x, y = (x - x[0]) / (x[-1] - x[0]), (y - y[-1]) / (y[0] - y[-1])
    knee = int(np.argmax(1 - x - y))
    after = knee + 1
    last, before = front[-1], front[-2]
    if not 0 < knee < len(front) - 1:
        saved = charts.cost_of(last) - charts.cost_of(before)
        return [f"The front has no knee short of its end, {_name(last)} ({_cost(last)}, rms {_error(last)}): the last "
                f"step below it, {_name(before)}, saves {saved:g} cycles for rms {_error(before)}."]
    return [f"The knee is at {_name(front[knee])}: {_cost(front[knee])}, rms {_error(front[knee])}; the next step, "
            f"{_name(front[after])}, costs {_cost(front[after])} for {_error(front[after])}."]


def _others(rows: list[dict]) -> list[str]:
    """Other libraries' functions that are cheaper than each of ours that is as accurate."""
    sentences = []
    for row in (r for r in rows if r["origin"] not in (OURS, TEXTBOOK) and charts.error_of(r, "rms") < charts.LARGEST):
        theirs = charts.error_of(row, "rms")
        ours = [r for r in rows if r["origin"] in (OURS, TEXTBOOK) and r["stands_for"] == row["stands_for"]
                and charts.error_of(r, "rms") <= max(SAME * theirs, EXACT * (theirs < EXACT))]
        best = min(ours, key=charts.cost_of, default=None)
        if not best or charts.cost_of(best) <= charts.cost_of(row):
            continue
        alike = theirs <= max(SAME * charts.error_of(best, "rms"), EXACT)
        what = "Ahead of ours, as accurate and cheaper" if alike else "Cheaper and less accurate than ours"
        sentences.append(f"{what}: {row['origin']}'s {_name(row)} costs {_cost(row)} at rms {_error(row)}, "
                         f"{_name(best)} {_cost(best)} at {_error(best)}.")
    return sentences


def _goal(found: dict) -> list[str]:
    rows = found["calibration"]
    ours = next(r for r in rows if r["function"] == "lobe_GGX")
    error = next(r for r in found["results"] if r["function"] == "lobe_GGX")["error"]["rms"]
    cycles = ours["buffered"]["inverse_throughput"]
    verdict = "reached" if cycles <= GOAL and error <= GOAL_RMS else "missed"
    return [f"`lobe_GGX`, grey, without horizon rule, inputs from a buffer: {cycles} cycles at rms {error:.2g}; asked "
            f"were {GOAL} at {GOAL_RMS:.2g}: {verdict}.",
            *(f"{r['origin']}'s `{r['function']}` in the same setting: {r['buffered']['inverse_throughput']} cycles; "
              "with interpolated inputs, where nothing hides behind the memory, "
              f"{r['interpolated']['inverse_throughput']}." for r in rows if r is not ours)]


def measured_on_gpu(path: Path = cost.RESULTS.with_name("chart-gpu.json")) -> dict | None:
    """What a machine with a GPU measured, if the repository holds it."""
    other = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {"gpu": NOT_MEASURED}
    return None if other["gpu"] == NOT_MEASURED else other


def _time(found: dict, gpu: dict | None) -> list[str]:
    """How far the compiler's cycles tell the time of the OpenGL devices."""
    sentences = [s for measured in (found, gpu) if measured for s in _agreement(found, measured)]
    return sentences + ([] if gpu else [f"Time on a hardware GPU: {NOT_MEASURED}."])


def _agreement(found: dict, measured: dict) -> list[str]:
    timed = [r for r in measured["results"] if r["device"].startswith("gl:")]
    if not timed:
        return []
    pairs = [(charts.cost_of(_same(r, FIRST, found)), r["cost"]["ns"]) for r in timed]
    cycles, ns = (np.argsort(np.argsort(v)) for v in zip(*pairs))
    agreement = float(np.corrcoef(cycles, ns)[0, 1])
    slowest = max(timed, key=lambda r: r["cost"]["ns"])
    ns, spread = slowest["cost"]["ns"], slowest["cost"]["ns_spread"]
    return [f"On {measured['renderer']}, {measured['date']}, the order of times and that of NAVI21's cycles "
            f"have a rank correlation of {agreement:.2f} over {len(pairs)} functions.",
            f"The slowest there is {_name(slowest)}, {ns:.3g} ns, ± {spread:.2g}, for one evaluation by all of its "
            "threads."]


def _name(row: dict) -> str:
    return f"`{row['function']}`"


def _cost(row: dict) -> str:
    return f"{charts.cost_of(row):g} cycles"


def _error(row: dict) -> str:
    return f"{charts.error_of(row, 'rms'):.2g}"


# README's chart

def whole_ggx(found: dict) -> list[dict]:
    """The rows of README's chart: whole lobes that stand for GGX."""
    return [r for r in found["results"] if r["device"] == FIRST and r["chart"] == "specular"
            and r["stands_for"] == families.GGX]


def stamp(found: dict) -> str:
    """What README's chart shows, as a short hash."""
    shown = [(r["origin"], r["function"], charts.cost_of(r), f"{charts.error_of(r, 'rms'):.3g}",
              f"{charts.error_of(r, 'image_flip'):.3g}") for r in whole_ggx(found)]
    return "chart " + hashlib.sha256(json.dumps(shown).encode()).hexdigest()[:16]


def draw(figure, found: dict) -> None:
    charts.draw(figure, families.NAMES["specular"], whole_ggx(found), "Whole GGX lobes")


def main(results: Path = cost.RESULTS) -> None:
    found = json.loads(Path(results).read_text(encoding="utf-8"))
    files.write_text(PAGE, page(found, measured_on_gpu()))
    plots.write_svg(FIGURE, lambda figure: draw(figure, found), (11, 4.4), stamp(found))


if __name__ == "__main__":
    main()
