"""The report of a comparison: one self-contained page, a summary for the terminal, and images of failures."""

from __future__ import annotations

import datetime
import importlib.metadata
import json
import os
import platform
import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import jinja2
import numpy as np

from . import catalogue, compare, files, geometry, ibl, pictures
from .catalogue import Function
from .compare import Result, ratio
from .errors import InputError
from .matrix import Outcome, Plan
from .paths import ROOT

LONGEST, THUMBNAIL = 320, 112  # pixels that a side of a picture may have in the page
MOST_LIGHTS = 8  # of a probe, that the page lists at a pixel
LIST = "lobe-images.txt"  # names the images of a run, in their folder
PARTS = ("shader", "reference", "difference")
CHANNELS = {1: ("",), 2: ("x", "y"), 3: ("R", "G", "B")}


def write(outcome: Outcome, plan: Plan, out: Path) -> Path:
    """Writes index.html, which needs no other file, into the folder `out` and returns its path."""
    template = environment().get_template("report.html.j2")
    entries = [_entry(outcome, plan, function) for function in plan.functions]
    entries = [entry for entry in entries if entry.rows]
    page = Path(out) / "index.html"
    files.write_text(page, template.render(
        outcome=outcome, plan=plan, entries=entries, groups=_groups(entries), totals=_totals(outcome, entries),
        failures=_failures(outcome), versions=_versions(), machine=_machine(), ibl=_ibl(plan),
        date=datetime.datetime.now().astimezone(), compare=compare, pictures=pictures,
        stability=(Path(out) / "stability.html").is_file(), mutants=mutants_line(), fuzzed=fuzz_line()))
    return page


def summary(outcome: Outcome) -> str:
    """A table for the terminal: one line per function, then the totals, the renderers and the time."""
    by_function = {}
    for row in outcome.rows:
        by_function.setdefault(row["function"], []).append(row)
    header = ("function", "kind", "comparisons", "pixels", "worst/allowed", "where", "result")
    table = aligned([header, *(_summary_line(name, rows) for name, rows in by_function.items())], right=(2, 3, 4))
    failing = sum(any(not r["pass"] for r in rows) for rows in by_function.values())
    functions = f"{len(by_function)} function{'s' if len(by_function) > 1 else ''}"
    verdict = (f"{failing} of {functions} OUT OF TOLERANCE" if failing
               else f"{'all ' if len(by_function) > 1 else ''}{functions} within tolerance")
    nonzero = sum(r["nonzero"] for r in outcome.rows)
    zeros = sum(r["pixels"] for r in outcome.rows) - nonzero
    totals = (f"{verdict}: {len(outcome.rows):,} comparisons, {nonzero:,} pixels and points that are not 0, and "
              f"{zeros:,} that are, {outcome.seconds:.1f} s")
    renderers = (f"{name}: {renderer}" for name, renderer in outcome.renderers.items())
    return "\n".join((*table, "", totals, *renderers)).replace("∞", "inf")  # a terminal may know ASCII only


def _summary_line(name: str, rows: list[dict]) -> tuple[str, ...]:
    worst = _worst_row(rows)
    return (name, worst["kind"], str(len(rows)), f"{sum(r['pixels'] for r in rows):,}",
            f"{number(worst['max_units'])}/{worst['units_allowed']}", _where(worst),
            "pass" if worst["pass"] else f"FAIL: {reason(worst)}")


class Images:
    """Writes a run's images into a folder: shader, reference and difference of each failing result, or of every one.

    The images of the run before are removed at the first result, which bad arguments never reach. A list in the folder
    tells them from files that the user put there. It names an image before there is one, so that an interrupted run
    leaves none unlisted.
    """

    def __init__(self, folder: Path, every: bool):
        self._folder, self._every = Path(folder), every
        self._names: list[str] | None = None  # of this run; None before its first result

    def add(self, result: Result) -> None:
        """Writes the images of a result as OpenEXR, if it has a picture."""
        if self._names is None:
            self._remove_listed()
            self._names = []
        seen = result.case.picture
        if seen is None or (result.row["pass"] and not self._every):
            return
        expected, names = result.case.reference.value, image_names(result.row)
        with np.errstate(invalid="ignore"):
            values = (result.got, expected, result.got - expected)
        self._names += names
        files.write_text(self._folder / LIST, "\n".join(self._names))
        for name, part in zip(names, values):
            files.write_exr(self._folder / name, {"RGB": pictures.rgb(seen.picture(part.astype(np.float32)))})

    def _remove_listed(self) -> None:
        images = self._folder / LIST
        if not images.is_file():
            return
        try:
            for name in images.read_text(encoding="utf-8", errors="replace").splitlines():
                if re.fullmatch(rf"[\w.-]+-({'|'.join(PARTS)})\.exr", name):  # no path out of the folder
                    (self._folder / name).unlink(missing_ok=True)
            images.unlink()
        except OSError as error:
            raise InputError(f"{self._folder}: images of an earlier run cannot be removed ({error.strerror}); "
                             "choose another folder, or change its permissions") from None


def image_names(row: dict) -> list[str]:
    """File names of a row's three images; none for rows without a picture."""
    if row["mode"] == "points":
        return []
    stem = "-".join(safe(row[k]) for k in ("function", "scene", "mode", "context"))
    return [f"{stem}-{part}.exr" for part in PARTS]


def safe(name: str) -> str:
    """A name as part of a file name or an anchor: lobe_F(float,vec3) becomes lobe_F_float_vec3."""
    return re.sub(r"[^\w.-]+", "_", name).strip("_")


# --- numbers as text -------------------------------------------------------------------------------------------------


def number(x: float, digits: int = 3) -> str:
    """A number to so many significant digits; 3.1e-8, not 3.1e-08."""
    if not np.isfinite(x):
        return "NaN" if np.isnan(x) else "-∞" if x < 0 else "∞"
    text = f"{x:.{digits}g}"
    return re.sub(r"e([+-])0*(\d+)$", lambda m: f"e{'-' if m[1] == '-' else ''}{m[2]}", text)


def exact(values) -> str:
    """Float32 numbers with the digits that tell each from its neighbours."""
    return ", ".join(number(x, 9) for x in np.atleast_1d(values))


def aligned(lines: list[tuple[str, ...]], right: Collection[int]) -> list[str]:
    """Lines of a table for the terminal, the columns in `right` aligned to the right."""
    widths = [max(map(len, column)) for column in zip(*lines)]
    return ["  ".join(text.rjust(w) if i in right else text.ljust(w) for i, (text, w) in enumerate(zip(line, widths)))
            .rstrip() for line in lines]


# --- rows ------------------------------------------------------------------------------------------------------------


def reason(row: dict) -> str:
    """Why a row fails, in words."""
    reasons = []
    if row["nonfinite"]:
        reasons.append(f"{row['nonfinite']:,} not finite")
    if row["max_units"] > row["units_allowed"]:
        reasons.append(f"{number(row['max_units'])} units, {row['units_allowed']} allowed")
    if row["undecided"] > compare.MAX_UNDECIDED * row["pixels"]:
        reasons.append(f"{row['undecided']:,} undecided, {compare.MAX_UNDECIDED:.2%} allowed")
    if row["edge_pixels"] > compare.MAX_EDGE * row["pixels"]:
        reasons.append(f"{row['edge_pixels']:,} edge pixels, {compare.MAX_EDGE:.1%} allowed")
    return "; ".join(reasons)


def _worst_row(rows: list[dict]) -> dict:
    """The worst failing row; else the one nearest to its tolerance, frames aside, which measure interpolation too."""
    candidates = ([r for r in rows if not r["pass"]] or [r for r in rows if r["mode"] != "frame"] or rows)
    return max(candidates, key=ratio)


def _where(row: dict) -> str:
    place = "points" if row["mode"] == "points" else f"{row['scene']} {row['mode']}"
    return f"{place}, {row['context']}"


@dataclass
class Entry:
    """One function's line and section in the page."""

    function: Function
    label: str
    shader: compare.Shader
    rows: list[dict]
    views: list[View]  # of its shown and its worst scene
    frame: View | None  # of a lobe, rasterised by OpenGL
    point: Worst | None  # the worst of mode points
    same_bits: bool  # whether all contexts drew the same numbers in the shown scene

    @property
    def foreign(self) -> bool:
        return self.shader.model == "foreign"

    @property
    def anchor(self) -> str:
        return safe(self.label)

    @property
    def passed(self) -> bool:
        return all(r["pass"] for r in self.rows)

    @property
    def worst(self) -> dict:
        return _worst_row(self.rows)

    @property
    def where(self) -> str:
        return _where(self.worst)

    def of(self, mode: str) -> list[dict]:
        return [r for r in self.rows if r["mode"] == mode]

    def scenes(self) -> int:
        return len({r["scene"] for r in self.of("shading")})

    def total(self, key: str, mode: str | None = None) -> int:
        return sum(r[key] for r in (self.of(mode) if mode else self.rows))

    def largest(self, key: str, mode: str) -> float | None:
        """The largest value of a column over the rows of a mode; None where there is none."""
        return max((r[key] for r in self.of(mode) if r[key] is not None), default=None)

    def relative(self, key: str) -> float | None:
        """p99_rel or rms_rel over the shading scenes; over the points of a function that has none."""
        shading = self.largest(key, "shading")
        return self.largest(key, "points") if shading is None else shading

    def edge(self) -> float | None:
        """The largest share of edge pixels."""
        return max((r["edge_pixels"] / r["pixels"] for r in self.of("frame")), default=None)


def _entry(outcome: Outcome, plan: Plan, function: Function) -> Entry:
    shader = plan.shader_of(function)
    rows = [r for r in outcome.rows if r["function"] == shader.label]
    drawn = [r for (name, _), r in outcome.shown.items() if name == shader.label]
    chosen = {}
    for kept, caption in ((outcome.shown, "Scene:"), (outcome.worst, "Worst scene:")):
        result = _of_worst_context(kept, shader.label)
        if result and result.case.scene not in chosen:
            chosen[result.case.scene] = (result, caption)
    longest = LONGEST if function.kind == "lobe" else THUMBNAIL
    frame = _of_worst_context(outcome.frame, shader.label)
    point = _of_worst_context(outcome.worst_point, shader.label)
    return Entry(function, shader.label, shader, rows,
                 [View.of(result, caption, longest) for result, caption in chosen.values()],
                 View.of(frame, "Frame:", longest) if frame else None,
                 Worst.of(point) if point else None,
                 len(drawn) > 1 and all(np.array_equal(drawn[0].got, r.got) for r in drawn))


def _ibl(plan: Plan) -> dict | None:
    """What lab/ibl.py measured last and its pictures, where the page is about the function that it concerns."""
    shaded = any(f.name == "lobe_DFG_GGX" and plan.shader_of(f).model != "foreign" for f in plan.functions)
    if not shaded or (found := ibl.load()) is None:
        return None
    noise = max(row["noise"] for rows in found["errors"].values() for row in rows)
    images = {name: pictures.data_uri(files.read_png(ibl.figure(name))) for name in found["errors"]}
    return found | {"noise": noise, "pictures": images}


def _of_worst_context(kept: dict[tuple[str, str], Result], label: str) -> Result | None:
    results = [r for (name, _), r in kept.items() if name == label]
    return max(results, key=lambda r: ratio(r.row), default=None)


def _groups(entries: list[Entry]) -> list[tuple[str, str, list[Entry]]]:
    """(file name, its description, entries) of each file, in the order of the plan; a user's shader is one group."""
    if entries[0].foreign:
        return [("your shader", f"held against {_library_label(entries[0].function)}", entries)]
    groups: dict[Path, list[Entry]] = {}
    for entry in entries:
        groups.setdefault(entry.function.path, []).append(entry)
    return [(path.name, catalogue.load(path.parent).file(path.stem).description, of) for path, of in groups.items()]


def _library_label(function: Function) -> str:
    return catalogue.load(function.path.parent).label(function)


def _totals(outcome: Outcome, entries: list[Entry]) -> dict:
    rows = outcome.rows
    return {
        "pixels": sum(r["nonzero"] for r in rows if r["mode"] != "points"),
        "points": sum(r["nonzero"] for r in rows if r["mode"] == "points"),
        "zeros": sum(r["pixels"] - r["nonzero"] for r in rows),
        "nonfinite": sum(r["nonfinite"] for r in rows),
        "undecided": sum(r["undecided"] for r in rows),
        "failing": [e for e in entries if not e.passed],
        "worst": max(entries, key=lambda e: ratio(e.worst)),
    }


def _failures(outcome: Outcome) -> list[dict]:
    """Each failing row, worst first, with its reason and images; those that the outcome kept are drawn."""
    kept = {id(r.row): r for r in outcome.failures.values()}
    failing = sorted((row for row in outcome.rows if not row["pass"]), key=ratio, reverse=True)
    return [{"row": row, "reason": reason(row), "images": image_names(row),
             "shown": _failure_view(kept[id(row)]) if id(row) in kept else None} for row in failing]


def _failure_view(result: Result) -> View | Worst:
    return View.of(result, "Out of tolerance:", LONGEST) if result.case.picture else Worst.of(result)


# --- pictures and worst places ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Channel:
    """Both sides of one number."""

    name: str
    got: str
    reference: str
    kappa: str
    units: str


@dataclass(frozen=True)
class Worst:
    """The place of the largest error in units of a result, and all that is needed to compute it again.

    place     index of the pixel or point
    shared    (name, value) of what all lights have in common
    lights    the same for each light; of many, for the strongest
    commands  which evaluate it, per light
    """

    row: dict
    place: int
    channels: list[Channel]
    shared: list[tuple[str, str]]
    lights: list[list[tuple[str, str]]]
    commands: list[str]

    @property
    def is_cut(self) -> bool:
        """Whether there may be more lights than those listed."""
        return len(self.lights) == MOST_LIGHTS

    @staticmethod
    def of(result: Result) -> Worst:
        case, expected = result.case, result.case.reference
        n = int(np.argmax(result.units.max(-1)))
        names = CHANNELS[result.units.shape[1]]
        channels = [Channel(name, number(result.got[n, c], 9), number(expected.value[n, c], 12),
                            number(expected.kappa[n, c]), number(result.units[n, c])) for c, name in enumerate(names)]
        shared, lights = _inputs(case, n)
        commands = [] if result.row["model"] == "foreign" else _commands(case, n)
        return Worst(result.row, n, channels, shared, lights, commands)


def _inputs(case: compare.Case, n: int) -> tuple[list, list]:
    """The inputs of one pixel or point: those that lights share, and those of each of the strongest lights."""
    constants = [(name, exact(value)) for name, value in case.parameters.items() if case.function.parameter(name)]
    varying = {name: x[:, n] for name, x in case.inputs.items() if name not in case.parameters}
    if case.picture is None:
        return [(name, exact(x[0])) for name, x in varying.items()] + constants, []
    seen = case.picture
    frame = [(name, exact(getattr(seen, name)[n].astype(np.float32))) for name in ("N", "T", "V")
             if name != "T" or case.function.parameter("T")]
    own = {name: x for name, x in varying.items() if name not in geometry.DIRECTIONS}
    lights = [[("light", str(i + 1)), ("L", exact(seen.L[i, n].astype(np.float32))),
               *((name, exact(x[i])) for name, x in own.items()), ("weight", exact(case.weights[i, n]))]
              for i in _strongest(case, n)]
    return frame + constants, lights


def _strongest(case: compare.Case, n: int) -> np.ndarray:
    """The lights of the largest weights at a pixel or point, in their order."""
    weights = np.ones(1) if case.weights is None else case.weights[:, n].max(-1)
    return np.sort(np.argsort(-weights, kind="stable")[:MOST_LIGHTS])


def _commands(case: compare.Case, n: int) -> list[str]:
    """Shell commands that show GLSL and reference at one pixel or point, for each light that counts."""
    weights = np.ones(1) if case.weights is None else case.weights[:, n].max(-1)
    commands = []
    for light in (i for i in _strongest(case, n) if weights[i]):
        arguments = " ".join(f"{p.name}={exact(case.inputs[p.name][light, n]).replace(' ', '')}"
                             for p in case.function.parameters)
        inside = all(p.admits(case.inputs[p.name][light, n]) for p in case.function.parameters)
        commands.append(f"./lobe eval{'' if inside else ' --any'} '{case.function.key}' {arguments}")
    return commands


@dataclass(frozen=True)
class View:
    """The pictures of a result.

    images     data URIs of shader, reference, difference and, where the result fails, relative difference
    width, height  of each, in their own pixels; factor pixels of the comparison became one
    mark       x, y of the worst pixel in the pictures; pixel (column, row) in the comparison
    edges      x, y, width, height in the pictures of each run of edge pixels
    limit      units at the ends of the difference's scale; relative_limit likewise, None without that picture
    exposure   by which the values are divided before they are shown
    """

    caption: str
    row: dict
    images: dict[str, str]
    width: int
    height: int
    factor: int
    mark: tuple[float, float]
    pixel: tuple[int, int]
    edges: list[tuple[float, float, float, float]]
    limit: float
    relative_limit: float | None
    exposure: float
    histogram: pictures.Histogram
    worst: Worst

    @staticmethod
    def of(result: Result, caption: str, longest: int) -> View:
        case, seen, row = result.case, result.case.picture, result.row
        edge = np.zeros_like(seen.mask) if result.edge is None else result.edge
        drawn = seen.picture(result.got) if result.image is None else result.image
        window = pictures.Window(seen.mask | edge, longest)
        exposure = _exposure(case)
        limit = pictures.difference_limit(result.units, row["units_allowed"])
        signed = window.extreme(seen.picture(_signed_units(result))[..., 0])
        images = {"shader": pictures.shown(window.mean(drawn) / exposure, window.mask),
                  "reference": pictures.shown(window.mean(seen.picture(case.reference.value)) / exposure, window.mask),
                  "difference": pictures.diverging(signed, window.mask, limit, row["units_allowed"])}
        relative_limit = None
        if not row["pass"]:  # where all is out of tolerance, the picture above is black: show by how much
            relative = window.extreme(seen.picture(_signed_relative(result))[..., 0])
            relative_limit = _two_digits(np.quantile(np.abs(relative[np.isfinite(relative)]), 0.99)) or 1.0
            images["relative"] = pictures.diverging(relative, window.mask, relative_limit, np.finfo(float).max)
        worst = Worst.of(result)
        y, x = (int(i) for i in np.argwhere(seen.mask)[worst.place])
        height, width = window.mask.shape
        return View(caption, row, {part: pictures.data_uri(image) for part, image in images.items()}, width, height,
                    window.factor, window.place(y, x), (x, y), window.runs(edge), limit, relative_limit, exposure,
                    pictures.histogram(result.units, row["units_allowed"]), worst)


def _exposure(case: compare.Case) -> float:
    """What values are divided by to be shown: their 99th percentile; for lobes, which a display can show, at most 1."""
    percentile = _two_digits(np.quantile(case.reference.value, 0.99)) or 1.0
    return min(percentile, 1.0) if case.function.kind == "lobe" else percentile


def _two_digits(x: float) -> float:
    return float(f"{x:.2g}")


def _signed_units(result: Result) -> np.ndarray:
    """[n, 1]: the error in units of the channel that has the largest one; positive where the shader is brighter."""
    signed = np.where(result.got < result.case.reference.value, -result.units, result.units)
    return np.take_along_axis(signed, result.units.argmax(-1)[:, None], 1)


def _signed_relative(result: Result) -> np.ndarray:
    """[n, 1]: the relative error of the same channel; infinite where the shader is not finite, 0 where excused."""
    expected = result.case.reference.value
    with np.errstate(invalid="ignore"):
        relative = (result.got - expected) / np.maximum(np.abs(expected), compare.SMALLEST_REFERENCE)
    relative = np.where(np.isfinite(result.got), relative, np.inf) * (result.units > 0)
    return np.take_along_axis(relative, result.units.argmax(-1)[:, None], 1)


# --- where it ran ----------------------------------------------------------------------------------------------------


def _versions() -> dict[str, str]:
    from lobe import reference

    packages = {name: importlib.metadata.version(name) for name in ("lobe", "numpy", "moderngl")}
    return {"Lobe": packages["lobe"], "Embree": reference.embree_version, "Python": platform.python_version(),
            "NumPy": packages["numpy"], "moderngl": packages["moderngl"]}


def _machine() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    model = re.search(r"model name\s*: (.+)", cpuinfo.read_text()) if cpuinfo.exists() else None
    return f"{model[1] if model else platform.machine()}, {os.cpu_count()} threads, {platform.platform(terse=True)}"


def _measured(name: str) -> dict | None:
    """What was measured last; None where there is no such file, as in the installed package."""
    path = ROOT / "benchmarks" / "results" / name
    return json.loads(path.read_text()) if path.is_file() else None


def mutants_line() -> str:
    """Of the suite itself; "" where nothing is known."""
    if (told := _measured("mutation.json")) is None:
        return ""
    total = told["total"]
    of = total["killed"] + total["survivors"]
    return (f"of {of:,} small edits of {total['functions']} functions that change a value, the fast tests find {total['killed']:,}, "
            f"{100 * total['score']:.1f} %")


def fuzz_line() -> str:
    """Of the readers; "" where nothing is known."""
    if (told := _measured("fuzz.json")) is None:
        return ""
    return (f"{told['executions']:,} damaged files of {len(told['targets'])} kinds in {told['seconds'] / 60:.0f} minutes, "
            f"{told['faults']} faults left")


def environment() -> jinja2.Environment:
    """Of the templates beside this file."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    found = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True,
                               undefined=jinja2.StrictUndefined)
    found.filters |= {"number": number, "reason": reason, "ratio": ratio, "where": _where, "safe": safe,
                      "library_label": _library_label}
    return found
