"""Charts of speed against accuracy: an SVG file for each family and device, and one page that answers to the mouse."""

from __future__ import annotations

import json
import re
from pathlib import Path

import jinja2
import numpy as np
from matplotlib.patheffects import withStroke

from . import cost, families, files, isa, plots
from .peers_measured import TIE

ORIGINS = {"lobe": ("o", "circle", plots.BLUE), "textbook": ("D", "diamond-open", plots.GREY),
           "LYGIA": ("^", "triangle-up", plots.ORANGE), "three.js": ("s", "square", plots.GREEN),
           "MaterialX": ("P", "cross", plots.PURPLE)}
SMALLEST = 2.0**-26  # errors below it are drawn on it: float32 has no digit there
LARGEST = 100.0  # errors above it, not finite ones among them, are drawn on it
VISIBLE = 1e-2  # FLIP above which most people see a difference side by side
EXACT = 1e-5  # rms error below which a function counts as exact
WORTH = 0.8  # of the exact function's cost, which an approximation must not exceed to pay
RESOLVED = 2  # spreads that a time must be from 0 to stand on a front
METHOD = (
    "Cost, ISA: Mesa's RADV compiles a fragment shader with the call, and the same shader returning the sum of the "
    "call's inputs, for an AMD GPU that need not be there; cost is the difference. Cycles are the driver's inverse "
    "throughput: for how long 64 invocations keep one SIMD unit busy.",
    "All inputs vary from pixel to pixel, f0 is a colour, three channels are stored, early returns are compiled as "
    "selects and loops are unrolled, since what the compiler says of a branch is a guess. Other libraries' functions "
    "have our guards on their inputs.",
    "Cost, time: nanoseconds for one evaluation on the OpenGL device named, many evaluations an invocation, all inputs "
    "changing; call and baseline timed in turn, median of the differences; by timer queries, on software drivers by "
    "the wall clock.",
    "Error at points: against the exact term in double precision, over the domain that is named; rms, 99th percentile "
    "and maximum. Units: rounding alone, as lobe compare counts it. What rounds below 2^-26 is drawn there.",
    "Error in the picture: the function in the family's whole lobe, two scenes, three widths, the worst of the six; "
    "FLIP as a display shows it, and the rms difference over the rms of the exact picture.",
    "Inverse throughput is a maximum over the GPU's units: a few transcendental operations hide behind the "
    "interpolation of the inputs (a pow alone costs 4 cycles, beside a chain of square roots 16). Hence nothing is "
    "said never to pay by cycles alone: instructions or latency must agree.",
    f"Words: exact but for rounding is an rms error below {EXACT:g}, below which errors count alike; an approximation "
    f"pays where it costs at most {100 * WORTH:g} % of the exact function and FLIP is at most {VISIBLE:g}, above which "
    f"most people see a difference side by side; costs or errors within {100 * (TIE - 1):.2g} % are a tie. Ours are "
    "held against other libraries' with the same guards on inputs and none on divisors, as in docs/peers.md; what that "
    f"page calls wrong is not ahead. A time within {RESOLVED} spreads of 0 is not resolved, and stands on no front.",
)


def write(found: dict, out: Path) -> list[Path]:
    """Writes every chart and the page; returns their paths."""
    written = []
    for chart in families.CHARTS:
        for device in dict.fromkeys(row["device"] for row in found["results"]):
            rows = [r for r in found["results"] if r["chart"] == chart.name and r["device"] == device]
            if rows:
                written.append(out / f"{chart.name}-{file_name(device)}.svg")
                write_svg(written[-1], chart, rows)
    written.append(out / "index.html")
    write_page(found, written[-1])
    return written


def file_name(device: str) -> str:
    kind, _, name = device.partition(":")
    return name if kind == "isa" else "gl"


def device_name(device: str) -> str:
    kind, _, name = device.partition(":")
    return f"{isa.GPUS[name]} ({name}), compiled by Mesa's RADV" if kind == "isa" else name.partition(" (")[0]


def cost_of(row: dict) -> float:
    return row["cost"]["inverse_throughput"] if row["device"].startswith("isa:") else row["cost"]["ns"]


def error_of(row: dict, kind: str) -> float:
    value = row["error"][kind]
    return LARGEST if value is None else float(np.clip(value, SMALLEST, LARGEST))


def is_resolved(row: dict) -> bool:
    """Whether a time stands out of its own spread; cycles have none."""
    return row["device"].startswith("isa:") or row["cost"]["ns"] >= RESOLVED * row["cost"]["ns_spread"]


def front(rows: list[dict], kind: str, floor: float = 0.0) -> list[dict]:
    """Those that no other beats in cost and error both, from the cheapest on. A smaller error is so by 2 %; errors
    below `floor` count as it."""
    best, kept = np.inf, []
    for row in sorted(filter(is_resolved, rows), key=lambda r: (cost_of(r), error_of(r, kind))):
        error = max(error_of(row, kind), floor)
        if error < 0.98 * best:
            best = error
            kept.append(row)
    return kept


def fronts(rows: list[dict], kind: str) -> list[list[dict]]:
    """A front for each exact term that more than one of the rows stands for: other models are no alternatives."""
    terms = dict.fromkeys(row["stands_for"] for row in rows)
    alike = ([row for row in rows if row["stands_for"] == term] for term in terms)
    return [front(group, kind) for group in alike if len(group) > 1]


def label(row: dict) -> str:
    """The name, short. Only of a distribution do overloads stand on one chart."""
    types = re.search(r"\((vec3|float)[a-z0-9,]*\)", row["function"])
    short = row["function"].removeprefix("lobe_")
    if not types:
        return short
    told = {"vec3": " (vectors)", "float": " (cosine)"}[types[1]] if row["family"] in ("distribution", "gaussian") else ""
    return short.replace(types[0], told)


# SVG

THRESHOLD = {"color": "#cc9999", "linewidth": 1.2, "linestyle": ":"}
PANELS = (("rms", "rms error at points, {}"), ("image_flip", "FLIP in the picture"))


def write_svg(path: Path, chart: families.Chart, rows: list[dict]) -> None:
    plots.write_svg(path, lambda figure: draw(figure, chart, rows), (11, 2.6 + 0.14 * max(14, len(rows))))


def draw(figure, chart: families.Chart, rows: list[dict], title: str = "") -> None:
    figure.suptitle(f"{title or chart.title}: {device_name(rows[0]['device'])}", fontsize=11, x=0.01, ha="left")
    panels = figure.subplots(1, 2)
    for axes, (kind, text) in zip(panels, PANELS):
        _panel(axes, rows, kind, text.format("absolute" if chart.name in cost.ABSOLUTE else "relative"))
    shown = dict.fromkeys(row["origin"] for row in rows)
    handles = [panels[0].plot([], [], ORIGINS[o][0], color=ORIGINS[o][2], label=o)[0] for o in shown]
    handles += panels[0].plot([], [], color="#bbbbbb", drawstyle="steps-post", label="Pareto front")
    if any(error_of(r, "image_flip") > VISIBLE for r in rows):
        handles += panels[0].plot([], [], **THRESHOLD, label=f"FLIP {VISIBLE:g}: seen above")
    figure.legend(handles=handles, loc="outside lower left", ncols=len(handles), frameon=False, fontsize=8)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # labels keep off each other where things lie now
    for axes, (kind, _) in zip(panels, PANELS):
        place_labels(axes, [(cost_of(r), error_of(r, kind)) for r in rows], [label(r) for r in rows],
                     [ORIGINS[r["origin"]][2] for r in rows])


def _panel(axes, rows: list[dict], kind: str, text: str) -> None:
    points = [(cost_of(r), error_of(r, kind)) for r in rows]
    unit = "cycles per 64 invocations" if rows[0]["device"].startswith("isa:") else "ns per evaluation"
    plots.style(axes, ylabel=text, xlabel=f"cost, {unit}")
    axes.set_yscale("log")
    _scale_x(axes, [x for x, _ in points])
    axes.margins(x=0.12, y=0.12)
    for stairs in fronts(rows, kind):
        axes.plot([cost_of(r) for r in stairs], [error_of(r, kind) for r in stairs], color="#bbbbbb", linewidth=1.2,
                  drawstyle="steps-post", zorder=1)
    for row, point in zip(rows, points):
        marker, _, colour = ORIGINS[row["origin"]]
        if spread := row["cost"].get("ns_spread"):
            axes.errorbar(*point, xerr=spread, color=colour, elinewidth=0.8, zorder=2)
        axes.plot(*point, marker, color=colour, markersize=6, markeredgecolor="white", markeredgewidth=0.5, zorder=3)
    if kind == "image_flip" and any(y > VISIBLE for _, y in points):
        axes.axhline(VISIBLE, **THRESHOLD, zorder=0)


def _scale_x(axes, costs: list[float]) -> None:
    """Logarithmic where costs differ much; linear below the smallest where one of them is 0, and everywhere where the
    noise of times is below 0."""
    least = min((c for c in costs if c > 0), default=1)
    if max(costs) <= 6 * least or min(costs) < 0:
        return
    if min(costs) > 0:
        axes.set_xscale("log")
    else:
        axes.set_xscale("symlog", linthresh=least, subs=(2, 5))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(lambda x, _: f"{x:g}" if f"{x:g}"[0] in "25" else "")
    axes.tick_params(axis="x", which="minor", labelsize=7)


LEADER = {"arrowstyle": "-", "color": "#666666", "linewidth": 0.5, "shrinkB": 3}


def place_labels(axes, points, texts, colours) -> None:
    """Writes each text near its point, where it meets no other text, no point and no edge; a line leads to one afar."""
    spots = axes.transData.transform(points)
    area = axes.get_window_extent()
    taken = [(x - 5, y - 5, x + 5, y + 5) for x, y in spots]
    scale = axes.figure.dpi / 72
    for i in sorted(range(len(points)), key=lambda i: -spots[i][1]):
        note = axes.annotate(texts[i], points[i], fontsize=7, color=colours[i], ha="center", va="center", zorder=4)
        size = note.get_window_extent()
        width, height = size.width + 2, size.height + 1
        note.remove()
        x, y, box = _free(spots[i], width, height, area, taken)
        taken.append(box)
        gaps = np.maximum(abs(np.array([x, y]) - spots[i]) - (width / 2, height / 2), 0)
        far = np.hypot(*gaps) > 1.2 * height
        note = axes.annotate(texts[i], points[i], xytext=((x - spots[i][0]) / scale, (y - spots[i][1]) / scale),
                      textcoords="offset points", fontsize=7, color=colours[i], ha="center", va="center", zorder=4,
                      arrowprops=LEADER if far else None)
        note.set_path_effects([withStroke(linewidth=2, foreground="white")])


def _free(spot, width, height, area, taken):
    """The nearest place (x, y) of a box's centre about a spot, and the box."""
    best = None
    for radius in np.arange(0, 40) * 0.5 * height:
        for angle in np.radians((30, 330, 150, 210, 90, 270, 0, 180, 60, 120, 240, 300)):
            x = spot[0] + (width / 2 + 6 + radius) * np.cos(angle)
            y = spot[1] + (height / 2 + 5 + radius) * np.sin(angle)
            box = (x - width / 2, y - height / 2, x + width / 2, y + height / 2)
            inside = box[0] > area.x0 and box[2] < area.x1 and box[1] > area.y0 and box[3] < area.y1
            best = best or (x, y, box)
            if inside and not any(a[0] < box[2] and box[0] < a[2] and a[1] < box[3] and box[1] < a[3] for a in taken):
                return x, y, box
    return best


# The page

def write_page(found: dict, path: Path) -> None:
    import plotly.offline

    charts = [{"name": c.name, "title": c.title, "domain": c.domain, "absolute": c.name in cost.ABSOLUTE}
              for c in families.CHARTS if any(r["chart"] == c.name for r in found["results"])]
    devices = {d: device_name(d) for d in dict.fromkeys(r["device"] for r in found["results"])}
    data = {"rows": [row | {"label": label(row)} for row in found["results"]], "charts": charts, "devices": devices,
            "origins": {o: {"symbol": s, "colour": c} for o, (_, s, c) in ORIGINS.items()},
            "limits": [SMALLEST, LARGEST], "resolved": RESOLVED}
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(Path(__file__).parent), autoescape=True,
                                     trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    page = environment.get_template("chart.html.j2").render(
        found=found, method=METHOD, plotly=plotly.offline.get_plotlyjs(), data=script_text(data))
    files.write_text(path, page)


def script_text(value) -> str:
    """JSON that may stand inside a script element."""
    return json.dumps(files.plain(value), allow_nan=False).replace("<", "\\u003c")


def summary(found: dict) -> str:
    """For the terminal: the front of each chart on the first device."""
    device = found["results"][0]["device"]
    lines = [f"{device_name(device)}: what nothing beats in cost and error both"]
    for chart in families.CHARTS:
        rows = [r for r in found["results"] if r["chart"] == chart.name and r["device"] == device]
        for row in (row for stairs in fronts(rows, "rms") for row in stairs):
            lines.append(f"  {chart.name:19s} {row['origin']:10s} {row['function']:42s} {cost_of(row):7.4g} "
                         f"rms {error_of(row, 'rms'):.2g}  FLIP {error_of(row, 'image_flip'):.2g}")
    return "\n".join(lines)
