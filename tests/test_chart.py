"""Speed against accuracy: stored costs are those that the compiler still counts, and what is drawn can be read."""

import itertools
import json
import os
import re
import subprocess
import sys
from dataclasses import asdict

import numpy as np
import pytest
from matplotlib.text import Annotation, Text

from lobe.lab import catalogue, chart, cost, families, findings, gl, gltime, isa, packages, peers, plots, radv
from lobe.lab.errors import InputError

LIBRARY = catalogue.load()
FOUND = cost.stored()
REPAIR = "repair: .venv/bin/python benchmarks/chart.py"
SLACK = 0.25  # of a cost over the library's median cost, between two versions of the driver


@pytest.fixture(scope="module")
def tools():
    try:
        isa.require_tools()
    except InputError as error:
        pytest.skip(str(error))


# Stored figures

def test_every_function_was_measured_as_it_is():
    stale = [f.key for f in LIBRARY.functions
             if FOUND["functions"].get(f.key, {}).get("stamp") != cost.stamp(LIBRARY, f)]
    assert not stale, f"their code is not the one that was measured; {REPAIR}"
    assert set(FOUND["functions"]) == {f.key for f in LIBRARY.functions}


def test_headers_say_what_was_measured_of_costs():
    def cycles(name):
        return FOUND["functions"][LIBRARY.find(name)[0].key]["NAVI21"]["inverse_throughput"]

    told = 0
    for f in LIBRARY.functions:
        for no, other in re.findall(r"([Nn]o )?cheaper than (lobe_\w+)", f.header):
            assert (cycles(f.name) < cycles(other)) != bool(no), f.key
            told += 1
        for other, share in re.findall(r"as (lobe_\w+), at (\d+) % of its cost", f.header):
            assert abs(100 * cycles(f.name) / cycles(other) - int(share)) < 2, f.key
            told += 1
    assert told >= 2


def test_stamp_sees_code_and_what_it_calls_and_no_comment(tmp_path):
    def stamp(change):
        for file in LIBRARY.files:
            (tmp_path / file.path.name).write_text(change(file.text))
        catalogue.load.cache_clear()
        library = catalogue.load(tmp_path)
        return cost.stamp(library, library.find("lobe_GGX")[0])

    now = cost.stamp(LIBRARY, LIBRARY.find("lobe_GGX")[0])
    assert stamp(lambda text: text) == now
    assert stamp(lambda text: text.replace("// Why this form:", "// Why this shape:")) == now
    assert stamp(lambda text: text.replace("0.318309886", "0.318309887")) != now


@pytest.mark.parametrize("gpu", [pytest.param(gpu, marks=[] if gpu == "NAVI21" else [pytest.mark.full])
                                 for gpu in isa.GPUS])
def test_costs_are_the_stored_ones(tools, gpu, tmp_path, monkeypatch, capsys):
    """On another driver's version its ratios are held: figures are bound to the compiler that gave them."""
    monkeypatch.setenv("LOBE_CACHE", str(tmp_path))  # so that the compiler is asked, and not an older answer
    functions = [f for f in LIBRARY.functions if f.key in FOUND["functions"]]
    now = dict(zip((f.key for f in functions), isa.costs([isa.of(LIBRARY, f) for f in functions], gpu)))
    then = {key: FOUND["functions"][key][gpu] for key in now}
    if FOUND["isa"]["toolchain"] == isa.toolchain():
        changed = {key: (then[key], asdict(c)) for key, c in now.items() if asdict(c) != then[key]}
        assert not changed, "\n" + "\n".join(_both(key, *figures) for key, figures in changed.items()) + f"\n{REPAIR}"
        return
    with capsys.disabled():
        print(f"\n{FOUND['isa']['toolchain']} gave the stored figures, here is {isa.toolchain()}: only ratios are held")
    scale = {key: (then[key]["inverse_throughput"], c.inverse_throughput) for key, c in now.items()}
    middle = [np.median([pair[i] for pair in scale.values()]) for i in (0, 1)]
    off = {key: pair for key, pair in scale.items() if pair[0] >= middle[0]
           and abs(pair[1] / middle[1] / (pair[0] / middle[0]) - 1) > SLACK}
    assert not off, f"stored and counted now, cycles: {off}; medians {middle}"


def test_whole_ggx_costs_what_is_stored(tools):
    """Of the setting in which figures were asked for; other libraries' where their packages are at hand."""
    if FOUND["isa"]["toolchain"] != isa.toolchain():
        pytest.skip("the stored figures are another compiler's")
    with_peers = all(packages.is_cached(p) for p in peers.PACKAGES.values())
    then = [r for r in FOUND["calibration"] if with_peers or r["origin"] == "lobe"]
    now = cost.calibration(with_peers)
    assert [r for r in now if r not in then] == [] and len(now) == len(then), REPAIR


def _both(key: str, then: dict, now: dict) -> str:
    return f"{key}: " + ", ".join(f"{n} {then[n]} stored, {now[n]} now" for n in now if then[n] != now[n])


def test_whoever_has_no_branch_is_charted_without_one():
    assert {r["function"] for r in FOUND["results"] if r["cost"]["branches"]} <= set(), REPAIR


def test_results_keep_to_the_schema():
    assert FOUND["schema"] == 1
    for row in FOUND["results"]:
        assert {"function", "family", "origin", "device", "cost", "error", "domain"} <= set(row)
        assert {"instructions", "inverse_throughput", "latency", "vgprs", "ns"} <= set(row["cost"])
        assert {"max", "p99", "rms", "units", "approximation_max", "image_flip"} <= set(row["error"])
        assert row["family"] in catalogue.FAMILIES and row["device"].partition(":")[0] in cost.DEVICES
        assert (row["cost"]["ns"] is None) == row["device"].startswith("isa:")


def test_stated_bounds_hold_in_the_stored_results():
    """Where a header's bound is of the error that its chart measures, and of the same exact term."""
    checked = 0
    for row in (r for r in FOUND["results"] if r["key"] and r["device"] == "isa:NAVI21"):
        (function,) = LIBRARY.find(row["key"])
        stated = function.approximation
        named = stated and (stated.name == catalogue.EXACT or row["stands_for"].startswith(f"{stated.name}("))
        if not named or stated.is_relative == (row["chart"] in cost.ABSOLUTE):
            continue
        checked += 1
        assert row["error"]["max"] <= stated.bound * 1.001 + 1e-5, (row["function"], row["error"]["max"], stated.bound)
    assert checked >= 3


def test_functions_join_their_chart_by_their_header():
    shown = {row["key"] for row in FOUND["results"]}
    joined = {m.key for c in families.CHARTS for m in families.members(c, library=LIBRARY) if m.key}
    assert joined == shown - {""}, REPAIR
    assert {f.key for f in LIBRARY.functions if f.name in ("lobe_GGX", "lobe_V_GGX", "lobe_F_Hall")} <= joined


def test_pages_are_up_to_date():
    repair = "repair: .venv/bin/python -m lobe.lab.findings"
    assert findings.PAGE.read_text(encoding="utf-8") == findings.page(FOUND, findings.measured_on_gpu()), repair
    assert findings.stamp(FOUND) in findings.FIGURE.read_text(encoding="utf-8"), repair


def test_time_of_a_gpu_is_told_once_one_was_at_hand(tmp_path):
    path = tmp_path / "chart-gpu.json"
    assert findings.measured_on_gpu(path) is None and "Time on a hardware GPU: not measured." in findings.page(FOUND)
    path.write_text(json.dumps(FOUND))
    assert findings.measured_on_gpu(path) is None, "llvmpipe is no GPU"
    other = FOUND | {"gpu": "Some GPU", "renderer": "Some GPU", "date": "2000-01-01"}
    path.write_text(json.dumps(other))
    page = findings.page(FOUND, findings.measured_on_gpu(path))
    assert "GPU: Some GPU." in page and "On Some GPU, 2000-01-01, the order of times" in page and "not measured" not in page


# What is measured

def test_exact_terms_are_evaluated_at_the_inputs_of_the_call():
    """The exact function of a chart, called in GLSL with the chart's inputs, agrees with the exact values."""
    context = gl.create_context("egl")
    for family in families.CHARTS:
        inputs = family.sample(512)
        same = [m for m in families.members(family, library=LIBRARY) if m.key == m.stands_for]
        for member in same:
            lit = {n: x[None] for n, x in inputs.items()}
            got = cost.drawn(context, member.source, member.call, member.result, lit)
            exact = families.exact_values(member.stands_for, inputs)
            far = np.abs(got - exact) / np.where(np.abs(exact) > 1e-30, np.abs(exact), 1)
            assert np.median(far) < (2e-2 if family.name == "albedo" else 1e-5), (family.name, member.name)


def test_measuring_twice_gives_the_same_cost(tools, tmp_path):
    """Of a whole run, all the way to the files."""
    runs = []
    for name in "ab":
        command = [sys.executable, "-m", "lobe.lab", "chart", "--family", "power", "--out", tmp_path / name]
        compiled_anew = os.environ | {"LOBE_CACHE": str(tmp_path / f"cache-{name}")}
        done = subprocess.run([*command, "--json", "-"], capture_output=True, text=True, env=compiled_anew)
        assert done.returncode == 0, done.stderr
        runs.append(json.loads(done.stdout))
        assert (tmp_path / name / "power-NAVI21.svg").stat().st_size > 5000
    assert runs[0] == runs[1]
    page = (tmp_path / "a" / "index.html").read_text(encoding="utf-8")
    assert "Plotly.react" in page and "pow(s, exponent)" in page and "src=\"http" not in page


def test_time_is_that_of_varying_inputs():
    """No evaluation of the loop has the inputs of the one before: else it could be hoisted out."""
    text = gltime._fragment("", "vec3(x) + v", (("x", "float"), ("v", "vec3")))
    assert "float x = lobe_0x + lobe_step" in text and "vec3 v = lobe_0v + lobe_step" in text
    context = gl.create_context("egl")
    call = isa.Call("", "sin(x)", "float", (("x", "float"),))
    (took,) = gltime.times(context, [call], [{"x": np.linspace(0, 1, 64, dtype=np.float32)[:, None]}], rounds=3)
    assert np.isfinite(took.ns) and took.spread >= 0


# What is drawn

def row(cycles, rms, term="t", **more):
    return {"device": "isa:NAVI21", "cost": {"inverse_throughput": cycles, "alike": cycles}, "error": {"rms": rms},
            "stands_for": term, "origin": "lobe", "function": f"f{cycles}"} | more


def test_front_holds_what_nothing_beats():
    a, b, worse, tie = row(10, 1e-2), row(20, 1e-5), row(15, 1e-1), row(30, 0.99e-5)
    assert chart.front([worse, b, tie, a], "rms") == [a, b]
    assert chart.fronts([a, b, row(1, 1e-9, "other model")], "rms") == [[a, b]]


def test_a_time_that_is_not_resolved_stands_on_no_front():
    noise, slow = (row(0, rms, device="gl:x", cost={"ns": ns, "ns_spread": 1.0})
                   for rms, ns in ((1e-2, 1.9), (1e-5, 9)))
    assert chart.front([noise, slow], "rms") == [slow]


def test_digits_of_rounding_make_no_knee():
    ends = [row(10, 1e-1), row(20, 0.9e-5)]
    assert findings._knee(ends) == findings._knee([*ends, row(90, 1e-8)]), "20 is exact already"
    assert "One member leads" in findings._knee([row(10, 1e-6), row(20, 1e-8)])[0]
    assert findings._knee([row(10, 1e-6)]) == []


@pytest.mark.parametrize("right, cycles, said", [
    (True, 10, "Ahead of ours"), (False, 10, "Cheaper than ours and wrong"), (True, 20, "A tie in cost")])
def test_who_is_ahead_must_be_right(right, cycles, said):
    ours, theirs = row(21, 1e-6), row(cycles, 1e-6, origin="LYGIA", function="g")
    judged = {("LYGIA", "g"): {"right": right, "highlights": None, "error": {"off": 0.5, "rms": 1e-6}, "beside": {}}}
    (sentence,) = findings._others([ours, theirs], judged)
    assert sentence.startswith(said)
    ours["cost"]["alike"] = cycles  # the same once divisors are unguarded
    assert findings._others([ours, theirs], judged) == []


def test_nothing_never_pays_by_cycles_alone():
    """Cycles hide what runs beside the interpolation; then instructions or latency must agree."""
    def measured(name, cycles, instructions):
        costs = {"inverse_throughput": cycles, "instructions": instructions, "latency": instructions}
        return [row(cycles, 1e-3, device=f"isa:{gpu}", function=name, chart="c", cost=costs,
                    error={"rms": 1e-3, "image_flip": 0.0}) for gpu in isa.GPUS]

    hidden, cheap, other = measured("hidden", 4, 30), measured("cheap", 4, 5), measured("other", 10, 10)
    found = {"results": hidden + cheap + other}
    assert findings._beats_everywhere(cheap[0], other[0], found)
    assert not findings._beats_everywhere(hidden[0], other[0], found)


def test_thresholds_stand_on_the_page():
    text = " ".join(chart.METHOD)
    assert all(said in text for said in ("1e-05", "80 %", "0.01", "5 % are a tie", "maximum over the GPU's units"))


def test_flip_threshold_is_explained_where_it_is_drawn():
    rows = [r for r in FOUND["results"] if r["chart"] == "masking" and r["device"] == "isa:NAVI21"]
    figure = plots.drawn(lambda f: chart.draw(f, families.NAMES["masking"], rows), (11, 5))
    assert "FLIP 0.01: seen above" in [t.get_text() for legend in figure.legends for t in legend.get_texts()]


@pytest.mark.parametrize("name", families.NAMES)
def test_no_label_covers_another_or_a_point(name):
    rows = [r for r in FOUND["results"] if r["chart"] == name and r["device"] == "isa:NAVI21"]
    figure = plots.drawn(lambda f: chart.draw(f, families.NAMES[name], rows), (11, 2.6 + 0.14 * max(14, len(rows))))
    figure.draw_without_rendering()  # which puts annotations in their places
    for axes in figure.axes:
        boxes = [Text.get_window_extent(t) for t in axes.get_children() if isinstance(t, Annotation)]  # without leader
        assert len(boxes) == len(rows)
        assert not [1 for a, b in itertools.combinations(boxes, 2) if a.overlaps(b) and _area(a, b) > 4]
        area = axes.get_window_extent()
        assert all(b.x0 > area.x0 - 3 and b.x1 < area.x1 + 3 for b in boxes)


def _area(a, b) -> float:
    """Square pixels that two boxes share."""
    return max(min(a.x1, b.x1) - max(a.x0, b.x0), 0) * max(min(a.y1, b.y1) - max(a.y0, b.y0), 0)


def test_origins_differ_in_shape_and_not_in_colour_alone():
    shapes = [marker for marker, _, _ in chart.ORIGINS.values()]
    assert len(set(shapes)) == len(shapes)
    assert {r["origin"] for r in FOUND["results"]} <= set(chart.ORIGINS)


# Bad usage

@pytest.mark.parametrize("arguments, said", [
    (["--family", "nonsense"], "--family nonsense: expected one of fresnel"),
    (["--device", "nonsense"], "--device nonsense: expected one of isa, gl, all"),
])
def test_bad_usage_is_one_line(arguments, said, tmp_path):
    command = [sys.executable, "-m", "lobe.lab", "chart", *arguments, "--out", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1) and said in done.stderr


def test_a_missing_driver_is_named(monkeypatch):
    monkeypatch.setattr(radv, "ICDS", ("/nowhere",))
    with pytest.raises(InputError, match="install mesa-vulkan-drivers libvulkan1"):
        isa.require_tools()
