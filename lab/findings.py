"""docs/findings.md, README's chart of whole GGX lobes, both from the measured results: python -m lobe.lab.findings."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from . import catalogue
from . import chart as charts
from . import cost, families, files, isa, peers_measured, plots
from .families import OURS, TEXTBOOK, Chart
from .paths import ROOT
from .peers_measured import TIE

PAGE = ROOT / "docs" / "findings.md"
FIGURE = ROOT / "docs" / "figures" / "cost-ggx.svg"
FIRST = "isa:NAVI21"  # the device of which sentences speak where they name none
PEERS, ROUNDING = (cost.RESULTS.with_name(name) for name in ("peers.json", "compare.json"))
Judged = dict[tuple[str, str], dict]
NOT_MEASURED = "not measured"
GOAL, GOAL_RMS = 52, 6.2e-5  # cycles and rms error that lobe_GGX should have, grey and without horizon rule


def page(found: dict, gpu: dict | None = None) -> str:
    """The text of the page; `gpu` is what a machine with one measured."""
    lines = ["# What the charts say", "",
             "Generated from [chart.json](../benchmarks/results/chart.json) by `python -m lobe.lab.findings`: no "
             "sentence is typed, and each gives the two numbers that it rests on. `./lobe chart` draws the charts, "
             "with every point's formula, source and figures under the mouse.", "",
             f"Measured on {found['date']} with {found['isa']['toolchain']}; errors on {found['renderer']}. Cycles are "
             "RDNA2's (NAVI21), inverse throughput for 64 invocations, unless another is named. Time on a hardware "
             f"GPU: {gpu['gpu'] if gpu else NOT_MEASURED}.", "", "The method:", ""]
    lines += [f"{i}. {text}" for i, text in enumerate(charts.METHOD, 1)]
    judged = judged_peers()
    for chart in families.CHARTS:
        rows = [r for r in found["results"] if r["chart"] == chart.name and r["device"] == FIRST]
        if rows:
            lines += ["", f"## {chart.title}", "", *(f"* {s}" for s in _chart(chart, rows, found, judged))]
    goal = _goal(found, judged)
    lines += ["", "## Whole GGX against its goal", "", *(f"* {s}" for s in goal)]
    lines += ["", "## On no chart", "", "Lobes and terms that stand for nothing else here: their cost, and their worst rounding error in the units "
              "of [compare.json](../benchmarks/results/compare.json).", "", *_uncharted(found)]
    lines += ["", "## Cycles and time", "", *(f"* {s}" for s in _time(found, gpu))]
    return "\n".join(lines) + "\n"


def _uncharted(found: dict) -> list[str]:
    library, charted = catalogue.load(), {r["key"] for r in found["results"]}
    worst = json.loads(ROUNDING.read_text())["functions"]
    lines = ["| function | cycles | worst error / allowed, units |", "|---|---:|---:|"]
    for f in library.functions:
        if f.kind in ("lobe", "term") and f.key not in charted and f.key in found["functions"]:
            row, name = worst.get(library.label(f)), library.label(f)
            error = f"{row['max_units']:.1f} / {row['units_allowed']}" if row else NOT_MEASURED
            lines.append(f"| `{name}` | {found['functions'][f.key][FIRST.partition(':')[2]]['inverse_throughput']} | {error} |")
    return lines


def _chart(chart: Chart, rows: list[dict], found: dict, judged: Judged) -> list[str]:
    own = [r for r in rows if r["origin"] in (OURS, TEXTBOOK)]
    sentences = []
    for term in dict.fromkeys(r["stands_for"] for r in own):
        group = [r for r in own if r["stands_for"] == term]
        exact = [r for r in group if charts.error_of(r, "rms") < charts.EXACT]
        best = min(exact, key=charts.cost_of) if exact else min(group, key=lambda r: charts.error_of(r, "rms"))
        what = "is exact but for rounding" if exact else "is the most accurate of ours"
        sentences.append(f"{_name(best)} {what}: {_cost(best)}, rms error {_error(best)}.")
        sentences += [_verdict(r, best, group, found) for r in group if r is not best]
        sentences += _knee([r for r in rows if r["stands_for"] == term])
    return sentences + _others(rows, judged)


def _verdict(row: dict, best: dict, group: list[dict], found: dict) -> str:
    """Whether an alternative pays, and against what."""
    if better := next((other for other in group if other is not row and _beats_everywhere(other, row, found)), None):
        return (f"{_name(row)} never pays: on all three GPUs {_name(better)} costs no more and is no less accurate, "
                f"{_cost(better)} against {_cost(row)} and rms {_error(better)} against {_error(row)}.")
    if (_cost(row), _error(row)) == (_cost(best), _error(best)):
        return f"{_name(row)} is {_name(best)} by another name: {_cost(row)} and {_cost(best)}."
    ratio = charts.cost_of(row) / max(charts.cost_of(best), 1)
    if max(ratio, 1 / max(ratio, 1e-9)) <= TIE and charts.error_of(row, "rms") <= TIE * charts.error_of(best, "rms"):
        return (f"{_name(row)} ties with {_name(best)}: {_cost(row)} and {_cost(best)}, rms {_error(row)} and "
                f"{_error(best)}.")
    if charts.cost_of(row) > charts.WORTH * charts.cost_of(best):
        return (f"{_name(row)} does not pay: {_cost(row)} against {_cost(best)} of {_name(best)}, for an rms error of "
                f"{_error(row)} in place of {_error(best)}.")
    seen = row["error"]["image_flip"]
    how = "pays" if seen <= charts.VISIBLE else "is cheaper, and is seen"
    return (f"{_name(row)} {how}: {_cost(row)} against {_cost(best)} of {_name(best)}, for FLIP {seen:.2g} in the "
            f"picture (rms {_error(row)} at points).")


def _beats_everywhere(better: dict, row: dict, found: dict) -> bool:
    """No worse in any GPU's cycles, in rms or in FLIP, and better in one of them; and since cycles can hide work, no
    worse in instructions either, or in latency."""
    def figures(r):
        costs = [charts.cost_of(_same(r, f"isa:{gpu}", found)) for gpu in isa.GPUS]
        return np.array([*costs, charts.error_of(r, "rms"), charts.error_of(r, "image_flip")])

    a, b = figures(better), figures(row)
    work = [[_same(r, f"isa:{gpu}", found)["cost"] for gpu in isa.GPUS] for r in (better, row)]
    agree = any(all(x[kind] <= y[kind] for x, y in zip(*work)) for kind in ("instructions", "latency"))
    return bool((a <= b).all() and (a < b).any() and agree)


def _same(row: dict, device: str, found: dict) -> dict:
    return next(r for r in found["results"] if r["device"] == device
                and (r["chart"], r["origin"], r["function"]) == (row["chart"], row["origin"], row["function"]))


def _knee(rows: list[dict]) -> list[str]:
    """The point of the front that lies farthest below the line from end to end, cost against log error. Errors below
    EXACT count as it, so that no digits of rounding make a knee."""
    if len(rows) < 2:
        return []
    front = charts.front(rows, "rms", charts.EXACT)
    last = front[-1]
    if len(front) == 1:
        return [f"One member leads: none of the {len(rows)} is cheaper than {_name(last)}, {_cost(last)}, nor more "
                f"accurate than its rms {_error(last)} but for rounding."]
    x = np.array([charts.cost_of(r) for r in front])
    y = np.log([max(charts.error_of(r, "rms"), charts.EXACT) for r in front])
    x, y = (x - x[0]) / (x[-1] - x[0]), (y - y[-1]) / (y[0] - y[-1])
    knee = int(np.argmax(1 - x - y))
    if not 0 < knee < len(front) - 1:
        before = front[-2]
        saved = charts.cost_of(last) - charts.cost_of(before)
        return [f"The front has no knee short of its end, {_name(last)} ({_cost(last)}, rms {_error(last)}): the last "
                f"step below it, {_name(before)}, saves {saved:g} cycles for rms {_error(before)}."]
    after = front[knee + 1]
    return [f"The knee is at {_name(front[knee])}: {_cost(front[knee])}, rms {_error(front[knee])}; the next step, "
            f"{_name(after)}, costs {_cost(after)} for {_error(after)}."]


def _others(rows: list[dict], judged: Judged) -> list[str]:
    """Other libraries' functions that are cheaper than each of ours that is as accurate, weighed with the same guards
    as docs/peers.md weighs them."""
    sentences = []
    for row in (r for r in rows if r["origin"] not in (OURS, TEXTBOOK) and charts.error_of(r, "rms") < charts.LARGEST):
        theirs = charts.error_of(row, "rms")
        ours = [r for r in rows if r["origin"] in (OURS, TEXTBOOK) and r["stands_for"] == row["stands_for"]
                and charts.error_of(r, "rms") <= max(TIE * theirs, charts.EXACT * (theirs < charts.EXACT))]
        best = min(ours, key=_alike, default=None)
        if not best or _alike(best) <= _alike(row):
            continue
        verdict = judged.get((row["origin"], row["function"]))
        alike = theirs <= max(TIE * charts.error_of(best, "rms"), charts.EXACT)
        if verdict and not verdict["right"]:
            off = (verdict["highlights"] or verdict["error"])["off"]
            what = f"Cheaper than ours and wrong, off at {100 * off:.2g} % of [peers.md](peers.md)'s inputs"
        elif _alike(best) <= TIE * _alike(row):
            what = "A tie in cost, as accurate" if alike else "A tie in cost, less accurate than ours"
        else:
            what = "Ahead of ours, as accurate and cheaper" if alike else "Cheaper and less accurate than ours"
        sentences.append(f"{what}: {row['origin']}'s {_name(row)} costs {_alike(row):g} cycles at rms {_error(row)}, "
                         f"{_name(best)} {_alike(best):g} cycles without guards on divisors ({_cost(best)} with them) "
                         f"at {_error(best)}.{_why(best, verdict)}")
    return sentences


WHY = {
    "lobe_F_dielectric": "replaces g - cosI near eta = 1, where its digits end, and holds total internal reflection "
                         "without a branch",
    "lobe_F_conductor": "takes each difference in whichever form subtracts the smaller, and so keeps its digits where "
                        "the indices match",
    "lobe_OrenNayar_EON": "keeps its digits near grazing, V and L at right angles among that",
    "lobe_DFG_GGX": "spends more terms on its fit",
}
"""What ours does in the cycles that a cheaper peer saves, as its header says."""


def _why(ours: dict, verdict: dict | None) -> str:
    """What the cycles buy over the whole domain, in rms errors of both."""
    if not verdict or not verdict["right"] or ours["function"] not in verdict["beside"]:
        return ""
    reason = WHY.get(ours["function"].partition("(")[0])
    return ((f" Why: ours {reason}." if reason else "") + " Over the peer's whole domain its rms error is "
            f"{peers_measured.accuracy(verdict):.2g}, that of ours {verdict['beside'][ours['function']]:.2g}.")


def _alike(row: dict) -> float:
    """Cycles with the same guards for everybody."""
    return row["cost"]["alike"]


def _goal(found: dict, judged: Judged) -> list[str]:
    rows = found["calibration"]
    ours, bare = (next(r for r in rows if r["function"] == name) for name in ("lobe_GGX", cost.UNGUARDED))
    errors = {(r["origin"], r["function"]): charts.error_of(r, "rms") for r in whole_ggx(found)}
    error = errors[OURS, "lobe_GGX"]
    cycles, freed = (r["buffered"]["inverse_throughput"] for r in (ours, bare))
    verdict = "reached" if cycles <= GOAL and error <= GOAL_RMS else "missed"
    sentences = [f"`lobe_GGX`, grey, without horizon rule, inputs from a buffer: {cycles} cycles at rms {error:.2g}; "
                 f"the goal was {GOAL} at {GOAL_RMS:.2g}: {verdict}.",
                 f"`lobe_GGX` in the same setting without any clamp: {freed} cycles; what holds bad inputs and "
                 f"rounding is {cycles - freed} of its {cycles} cycles, the form itself the rest."]
    for row in (r for r in rows if r not in (ours, bare)):
        key = row["origin"], row["function"]
        wrong = key in judged and not judged[key]["right"]
        sentences.append(
            f"{row['origin']}'s `{row['function']}` in the same setting: {row['buffered']['inverse_throughput']} "
            f"cycles at rms {errors[key]:.2g}{', wrong by [peers.md](peers.md)' if wrong else ''}; with interpolated "
            "inputs, where nothing hides behind the memory, "
            f"{row['interpolated']['inverse_throughput']}.")
    others = [r for r in rows if r["origin"] != OURS]
    able = [r for r in others if errors[r["origin"], r["function"]] <= GOAL_RMS]
    cheaper = [r for r in able if r["buffered"]["inverse_throughput"] < cycles]
    names = ", ".join(f"{r['origin']}'s `{r['function']}`" for r in cheaper)
    return [*sentences, f"Of the {len(others)} of other libraries {len(able)} keep within rms {GOAL_RMS:.2g}; cheaper than "
            f"`lobe_GGX` among these: {names or 'none'}."]


def judged_peers() -> Judged:
    """What docs/peers.md says of each peer: (origin, function) -> row of peers.json."""
    return {(r["origin"], r["function"]): r for r in json.loads(PEERS.read_text(encoding="utf-8"))["results"]}


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
