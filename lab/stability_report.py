"""What `lobe stability` shows: a page that needs no other file, a table for the terminal, and docs/stability.md.

    python -m lobe.lab.stability_report [--points N] [FILE ...]

measures the functions of some files of glsl/, or all, and writes docs/stability.md, its figures and
benchmarks/results/stability.json; functions that are not measured keep their figures.
"""

from __future__ import annotations

import argparse
import base64
import datetime
import io
import json
import os
from pathlib import Path

import numpy as np

from . import catalogue, files, gl, half, plots, precision, stability, stability_chart
from .paths import ROOT
from .report import aligned, environment, number
from .stability import Map, Outcome

PAGE = ROOT / "docs" / "stability.md"
FIGURES = ROOT / "docs" / "figures"
RESULTS = ROOT / "benchmarks" / "results" / "stability.json"
FRACTIONS = ("cases", "random", "symmetry", "limit", "integral")  # suites whose error is a fraction of the allowed one
LEAST, MOST = 1e-8, 1.0  # of the maps' relative error


# --- summaries -------------------------------------------------------------------------------------------------------


def verdicts(rows: list[dict]) -> dict[str, dict]:
    """By function, over all drivers: the worst error over the allowed one of each suite, how many inputs were random,
    how many of the policy's rules are kept, the safe range, and what vectors off unit length cost."""
    found = {}
    for row in rows:
        entry = found.setdefault(row["function"], {"checks": 0, "values": 0, "worst": {}, "inputs": 0, "rules": 0,
                                                   "kept": 0, "safe": "", "loss": [], "pass": True})
        entry["checks"] += 1
        entry["values"] += row["count"]
        entry["pass"] &= row["pass"]
        suite = row["suite"]
        if suite in FRACTIONS:
            entry["worst"][suite] = max(entry["worst"].get(suite, 0.0), row["worst"])
        if suite == "random":
            entry["inputs"] += row["count"]
            entry["safe"] = row.get("safe", entry["safe"])
        if suite == "policy":
            entry["rules"] += 1
            entry["kept"] += row["pass"]
        if suite == "off unit":
            entry["loss"] = [row["loss_median"], row["loss_p99"], row["loss_max"]]
    return found


def summary(outcome: Outcome) -> str:
    """A table for the terminal: one line per function, then the failures."""
    header = ("function", "inputs", *FRACTIONS, "policy", "result")
    lines = [(name, f"{v['inputs']:,}", *(_fraction(v["worst"].get(s)) for s in FRACTIONS),
              f"{v['kept']}/{v['rules']}" if v["rules"] else "", "pass" if v["pass"] else "FAIL")
             for name, v in verdicts(outcome.rows).items()]
    failures = [f"FAIL {r['function']}: {r['suite']}, {r['check']}: {number(r['worst'])} of what is allowed, {r['context']}"
                for r in outcome.rows if not r["pass"]]
    checks = f"{len(outcome.rows):,} checks, {sum(r['count'] for r in outcome.rows):,} values"
    verdict = f"{len(failures)} of {checks} FAIL" if failures else f"all of {checks} pass; 1.00 is all of what is allowed"
    return "\n".join((*aligned([header, *lines], right=range(1, 8)), "", *failures, verdict)).replace("∞", "inf")


def _fraction(x: float | None) -> str:
    return "" if x is None else f"{x:.2f}" if np.isfinite(x) else "inf"


# --- pictures --------------------------------------------------------------------------------------------------------


def draw_map(axes, error_map: Map, title: str, labels: bool = True):
    """The largest relative error over the two most critical inputs; the line bounds what is below SAFE."""
    from matplotlib.colors import LogNorm

    a, b, relative, _ = error_map.drawn()
    if a is b:
        return _draw_profile(axes, error_map, title)
    x, y = error_map.edges(a), error_map.edges(b)
    axes.set_facecolor("#dddddd")
    shown = np.clip(relative, LEAST, MOST)
    mesh = axes.pcolormesh(x, y, shown.T, norm=LogNorm(LEAST, MOST), cmap="viridis", rasterized=True)
    unsafe = np.nan_to_num(relative) > stability.SAFE
    if unsafe.any():
        centres = [np.sqrt(e[:-1] * e[1:]) for e in (x, y)]
        axes.contour(*centres, unsafe.T.astype(float), levels=[0.5], colors="#d55e00", linewidths=1.2)
    axes.set(xscale="log", yscale="log")
    _named(axes, title, a.axis, b.axis)
    return mesh


def _draw_profile(axes, error_map: Map, title: str) -> None:
    """The same over one input."""
    a, _, relative, _ = error_map.drawn()
    edges, error = error_map.edges(a), np.diag(relative)
    axes.stairs(np.clip(np.nan_to_num(error), LEAST, MOST), edges, color=plots.BLUE, linewidth=1.5)
    axes.axhline(stability.SAFE, color=plots.ORANGE, linewidth=1)
    axes.set(xscale="log", yscale="log", ylim=(LEAST, MOST), xlim=(edges[0], edges[-1]))
    _named(axes, title, a.axis, "relative error")


def _named(axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, fontsize=8, loc="left")
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.xaxis.set_minor_formatter("")  # which names 2, 3 and 4 where an axis has one decade, over each other


def _draw_allowed(axes, error_map: Map) -> None:
    """The largest error over the allowed one, over the same inputs; more than 1 is out of tolerance."""
    a, b, _, ratio = error_map.drawn()
    x, y = error_map.edges(a), error_map.edges(b)
    if a is b:
        axes.stairs(np.nan_to_num(np.diag(ratio)), x, color=plots.BLUE, linewidth=1.5)
        axes.axhline(1, color=plots.ORANGE, linewidth=1)
        axes.set(xscale="log", ylim=(0, 1.3), xlim=(x[0], x[-1]))
        return _named(axes, "error / allowed", a.axis, "error / allowed")
    from matplotlib import colormaps

    cmap = colormaps["Blues"].copy()
    cmap.set_over("#c00000")
    axes.set_facecolor("#dddddd")
    mesh = axes.pcolormesh(x, y, ratio.T, vmin=0, vmax=1, cmap=cmap, rasterized=True)
    axes.set(xscale="log", yscale="log")
    _named(axes, "error / allowed, red where out of tolerance", a.axis, b.axis)
    axes.figure.colorbar(mesh, ax=axes, extend="max").ax.tick_params(labelsize=7)


def _figure_of(error_map: Map):
    def draw(figure):
        left, right = figure.subplots(1, 2)
        mesh = draw_map(left, error_map, "relative error")
        if mesh is not None:
            figure.colorbar(mesh, ax=left).ax.tick_params(labelsize=7)
        _draw_allowed(right, error_map)
    return plots.drawn(draw, (8.2, 2.9))


def sheet(maps: list[tuple[str, Map]]):
    """The maps of some functions on one sheet."""
    columns = 4
    rows = -(-len(maps) // columns)

    def draw(figure):
        panels = figure.subplots(rows, columns, squeeze=False)
        for axes in panels.flat[len(maps):]:
            axes.axis("off")
        meshes = [draw_map(axes, m, title) for axes, (title, m) in zip(panels.flat, maps)]
        if mesh := next((m for m in meshes if m is not None), None):
            bar = figure.colorbar(mesh, ax=panels, shrink=min(1.0, 1.5 / rows), aspect=30, pad=0.01)
            bar.set_label("relative error", fontsize=8)
            bar.ax.tick_params(labelsize=7)
    return plots.drawn(draw, (12.6, 2.4 * rows))


def _uri(figure) -> str:
    memory = io.BytesIO()
    figure.savefig(memory, format="png", dpi=80)
    return "data:image/png;base64," + base64.b64encode(memory.getvalue()).decode()


# --- the page --------------------------------------------------------------------------------------------------------


def write(outcome: Outcome, curves: list, out: Path, points: int, matrix: dict | None = None) -> Path:
    """Writes stability.html into the folder `out`; `matrix` is what precision.json would hold."""
    maps = {}
    for (label, driver), error_map in outcome.maps.items():
        if error_map.critical is not None:
            maps.setdefault(label, []).append((driver, _uri(_figure_of(error_map)), error_map.safe()))
    worst = {row["function"]: row for row in outcome.rows if row["suite"] == "random"}
    excused = {(f["function"], f["context"]) for f in (matrix or {}).get("failures", []) if f["builtins"]}
    out_of_tolerance = [row for row in outcome.rows if not row["pass"]]
    failing = [row for row in out_of_tolerance if (row["function"], row["context"]) not in excused]
    page = Path(out) / "stability.html"
    files.write_text(page, environment().get_template("stability.html.j2").render(
        **_matrix(matrix) if matrix else {"p": None},
        failing=failing, excused=len(out_of_tolerance) - len(failing), outcome=outcome,
        verdicts=verdicts(outcome.rows), maps=maps, worst=worst, curves=curves, points=points,
        chart=_uri(plots.drawn(lambda f: stability_chart.draw(f, curves), stability_chart.SIZE)) if curves else "",
        losses=losses(outcome.rows), fractions=FRACTIONS, fraction=_fraction, safe_error=stability.SAFE,
        families=[r for r in outcome.rows if r["suite"] == "cases"], date=datetime.datetime.now().astimezone()))
    return page


def _matrix(found: dict) -> dict:
    """What the page shows of the precision matrix."""
    found = files.plain(found)
    curves = any("curves" in row for row in found["half"].values())
    picture = _uri(plots.drawn(lambda figure: half.draw(figure, found["half"]), half.SIZE)) if curves else ""
    return precision.shown(found) | {"half_picture": picture}


def losses(rows: list[dict]) -> list[dict]:
    return sorted((r for r in rows if r["suite"] == "off unit"), key=lambda r: -r["loss_p99"])


# --- the document ----------------------------------------------------------------------------------------------------


def results(outcome: Outcome, curves: list, points: int, known: dict | None = None) -> dict:
    """What benchmarks/results/stability.json holds, from which docs/stability.md is written. Functions that were not
    measured keep what is `known` of them."""
    known = known or {"functions": {}, "cases": {}, "sheets": {}}
    library = catalogue.load()
    names = [library.label(f) for f in library.functions]
    measured = {label for label, _ in outcome.maps}
    functions = known["functions"] | {name: v for name, v in verdicts(outcome.rows).items() if name in measured}
    return {
        "date": datetime.date.today().isoformat(), "points": points, "cores": os.cpu_count(),
        "renderers": sorted({f"{row['context']}: {row['renderer']}" for row in outcome.rows}),
        "functions": {name: functions[name] for name in names if name in functions},
        "sheets": {file.stem: f"stability-{file.stem}.png" for file in library.files
                   if file.stem in known["sheets"] or any(library.label(f) in measured for f in file.functions)},
        "cases": known["cases"] | {r["check"]: {"call": r["call"], "count": r["count"], "worst": r["worst"]}
                                   for r in outcome.rows if r["suite"] == "cases"},
        "unanswered": outcome.unanswered,
        "forms": [{"family": c.panel.title, "input": c.panel.axis, "form": form, "largest": float(error.max()),
                   "verdict": c.verdict(form)} for c in curves for form, error in c.errors.items()],
    }


def markdown(measured: dict) -> str:
    """docs/stability.md, from benchmarks/results/stability.json."""
    functions = measured["functions"]
    return environment().overlay(autoescape=False).get_template("stability.md.j2").render(
        m=measured, fractions=FRACTIONS, fraction=_fraction, safe_error=stability.SAFE, slow=stability.SLOW_POINTS,
        failing=[f"`{name}`" for name, v in functions.items() if not v["pass"]], checks=sum(v["checks"] for v in functions.values()),
        values=sum(v["values"] for v in functions.values()),
        losses=sorted(((n, v["loss"]) for n, v in functions.items() if v["loss"]), key=lambda x: -x[1][1]))


def write_document(outcome: Outcome, curves: list, points: int, known: dict | None) -> None:
    library = catalogue.load()
    measured = results(outcome, curves, points, known)
    files.write_json(RESULTS, measured)
    plots.write_svg(FIGURES / "stability.svg", lambda figure: stability_chart.draw(figure, curves), stability_chart.SIZE)
    for stem, figure in measured["sheets"].items():
        drawn = [(library.label(f), outcome.maps.get((library.label(f), "egl"))) for f in library.file(stem).functions]
        maps = [(label.removeprefix("lobe_"), m) for label, m in drawn if m is not None and m.critical is not None]
        if maps:
            with files.written_beside(FIGURES / figure) as temporary:
                sheet(maps).savefig(temporary, dpi=80)
    files.write_text(PAGE, markdown(json.loads(RESULTS.read_text())))


def main() -> None:
    from .progress import progress

    parser = argparse.ArgumentParser(description="Measures the stability suite and writes docs/stability.md.")
    parser.add_argument("--points", type=int, default=stability.POINTS, help="random inputs a function")
    parser.add_argument("file", nargs="*", help="only the functions of these files of glsl/, e.g. ggx")
    asked = parser.parse_args()
    library = catalogue.load()
    functions = tuple(f for f in library.functions if not asked.file or f.stem in asked.file)
    known = json.loads(RESULTS.read_text()) if asked.file and RESULTS.exists() else None
    context = gl.create_context("egl")
    with progress() as step:
        outcome = stability.run(library, functions, (stability.Driver("egl", context),), asked.points, on_step=step)
    write_document(outcome, stability_chart.measured(library, context), asked.points, known)
    print(summary(outcome))


if __name__ == "__main__":
    main()
