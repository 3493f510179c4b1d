"""The report of a comparison, written from real comparisons of right and of wrong shaders."""

import re
from dataclasses import replace

import numpy as np
import pytest

from lobe.lab import catalogue, compare, files, gl, matrix, pictures, report, scenes
from lobe.lab.errors import InputError

MOST_BYTES = 30_000_000
NAMES = ("lobe_Lambert", "lobe_F_Schlick", "lobe_alpha")


def run(shader_of=None, names=NAMES, folder=None, every=False, **options):
    """The plan and the outcome of a small comparison."""
    library = catalogue.load()
    functions = tuple(f for name in names for f in library.find(name))
    places = scenes.find("sphere-directional"), scenes.find("sphere-four")
    options = {"scenes": places, "size": 32, "points": 64} | options
    plan = matrix.library_plan(library, functions, **options)
    plan = replace(plan, shader_of=shader_of) if shader_of else plan
    on_result = report.Images(folder, every).add if folder else lambda result: None
    return plan, matrix.run(plan, on_result=on_result)


def wrong(call):
    """Every function's GLSL replaced by an expression."""
    return lambda f: compare.Shader(catalogue.load().text, call, f.result, f.stem, catalogue.load().label(f), f.units)


@pytest.fixture(scope="module")
def right():
    return run()


@pytest.fixture(scope="module")
def failed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("failed")
    plan, outcome = run(wrong("lobe_Lambert(N, V, L, albedo) * 1.001"), names=("lobe_Lambert",), folder=folder / "exr")
    return folder, outcome, report.write(outcome, plan, folder).read_text()


def test_page_is_self_contained_and_small(right, tmp_path):
    plan, outcome = right
    page = report.write(outcome, plan, tmp_path)
    text = page.read_text()
    assert [p.name for p in tmp_path.iterdir()] == ["index.html"]
    assert page.stat().st_size < MOST_BYTES
    assert all(source.startswith("data:") for source in re.findall(r'\bsrc="([^"]*)"', text))
    assert all(target.startswith("#") for target in re.findall(r'\bhref="([^"]*)"', text))
    assert not re.search(r"@import|url\(|<link|<script src", text)


def test_page_names_every_function_and_renderer(right, tmp_path):
    plan, outcome = right
    text = report.write(outcome, plan, tmp_path).read_text()
    for function in plan.functions:
        label = catalogue.load().label(function)
        assert f'href="#{report.safe(label)}">{label}</a>' in text
        assert f'<article id="{report.safe(label)}"' in text
    assert all(renderer in text for renderer in outcome.renderers.values())
    assert "Out of tolerance" not in text and ", frames " not in text


def test_page_states_the_numbers_of_the_rows(right, tmp_path):
    plan, outcome = right
    text = report.write(outcome, plan, tmp_path).read_text()
    for row in outcome.rows:
        assert f"<td>{report.number(row['max_units'])}</td><td>{row['units_allowed']}</td>" in text


def test_worst_pixel_is_the_one_of_the_row(right):
    _, outcome = right
    for result in outcome.worst.values():
        worst = report.Worst.of(result)
        assert report.number(result.row["max_units"]) in [c.units for c in worst.channels]
        assert len(worst.lights) == result.case.weights.shape[0]
        view = report.View.of(result, "", report.LONGEST)
        x, y = view.pixel
        assert result.case.picture.mask[y, x]
        assert dict(view.worst.shared)["N"] == report.exact(scene_value(result.case.picture, "N", x, y))


def scene_value(seen, name, x, y):
    return seen.picture(getattr(seen, name))[y, x].astype(np.float32)


def test_a_worst_point_can_be_computed_again(right):
    _, outcome = right
    for result in outcome.worst_point.values():
        worst = report.Worst.of(result)
        given = dict(re.findall(r"(\w+)=(\S+)", worst.commands[0]))
        for p in result.case.function.parameters:
            read = np.array(given[p.name].split(","), np.float32)
            np.testing.assert_array_equal(read, result.case.inputs[p.name][0, worst.place])


def gold(alpha):
    """A comparison of lobe_GGX where f0's red is above the header's range."""
    return run(names=("lobe_GGX",), scenes=(scenes.find("gold-teapot-four"),), modes=("shading",),
               settings={"alpha": (alpha,)})


def test_a_command_beyond_the_range_says_any(right):
    _, outcome = gold(0.25)
    for worst in map(report.Worst.of, outcome.worst.values()):
        assert worst.commands and all(c.startswith("./lobe eval --any 'lobe_GGX") for c in worst.commands)
    assert all("--any" not in c for r in right[1].worst_point.values() for c in report.Worst.of(r).commands)


def test_zeros_are_counted_apart(right, tmp_path):
    plan, outcome = right
    for result in (*outcome.shown.values(), *outcome.worst_point.values()):
        assert result.row["nonzero"] == np.count_nonzero(result.case.reference.value.any(-1))
    unlit = next(r for (name, _), r in outcome.shown.items() if name == "lobe_Lambert")
    assert 0 < unlit.row["nonzero"] < unlit.row["pixels"]
    nonzero, all_ = (sum(row[k] for row in outcome.rows) for k in ("nonzero", "pixels"))
    assert f"{nonzero:,} pixels and points that are not 0, and {all_ - nonzero:,} that are" in report.summary(outcome)
    assert f"other than 0, and {all_ - nonzero:,} that are 0" in report.write(outcome, plan, tmp_path).read_text()


def test_a_user_s_shader_is_not_taken_for_ours(tmp_path):
    (ours,) = catalogue.load().find("lobe_GGX")
    mine = compare.Shader(catalogue.load().text, "lobe_GGX(N, V, L, f0 * 1.0, alpha)", "vec3", "foreign", "myGGX", 64)
    plan, outcome = run(lambda f: mine, names=("lobe_GGX",))
    text = report.write(outcome, plan, tmp_path).read_text()
    assert "held against <span class=\"name\">lobe_GGX</span>; K = 64" in text and mine.call in text
    assert "myGGX</span>: K = 64, held against lobe_GGX" in text
    assert all(fact not in text for fact in (ours.source, ours.units_why, ours.description, f"energy {ours.energy}"))


def test_failures_come_first_with_their_images(failed):
    folder, outcome, text = failed
    assert not outcome.passed
    assert 0 < text.index("✗ Out of tolerance") < text.index("How to read")
    named = {name for row in outcome.rows if not row["pass"] for name in report.image_names(row)}
    assert len(named) == 6
    assert all(f'href="exr/{name}"' in text for name in named)
    assert {p.name for p in (folder / "exr").glob("*.exr")} == named


def test_images_hold_shader_reference_and_difference(failed):
    folder, outcome, _ = failed
    row = next(r for r in outcome.rows if r["mode"] == "shading")
    got, expected, difference = (files.read_exr(folder / "exr" / name)["RGB"] for name in report.image_names(row))
    assert got.shape == (32, 32, 3) and expected.max() > 0
    np.testing.assert_allclose(difference, got - expected, atol=2e-7)
    np.testing.assert_allclose(np.abs(difference).max(), row["max_abs"], rtol=1e-6)


def test_images_of_passing_results_are_kept_on_request(tmp_path):
    options = dict(names=("lobe_Lambert",), scenes=(scenes.find("sphere-directional"),), modes=("shading",))
    run(folder=tmp_path / "failures", **options)
    assert not (tmp_path / "failures").exists()
    run(folder=tmp_path / "all", every=True, **options)
    assert len(list((tmp_path / "all").glob("*.exr"))) == 3


def test_images_of_the_run_before_are_removed_and_no_other_file(tmp_path):
    lambertian = dict(names=("lobe_Lambert",), folder=tmp_path / "exr", modes=("shading",))
    run(every=True, **lambertian)
    first = set(tmp_path.rglob("*-shader.exr"))
    mine = {tmp_path / "exr" / name for name in ("mine.exr", "my-lobe_Lambert-shader.exr", "notes.txt")}
    outside = tmp_path / "outside-shader.exr"
    for path in (*mine, outside):
        path.touch()
    with (tmp_path / "exr" / report.LIST).open("a") as listed:
        listed.write("\n../outside-shader.exr\nnotes.txt\n")
    run(every=True, scenes=(scenes.find("sphere-point"),), **lambertian)
    second = set(tmp_path.rglob("*-sphere-point-*.exr"))
    assert len(first) == 2 and len(second) == 3 and outside.exists()
    assert set((tmp_path / "exr").iterdir()) == second | mine | {tmp_path / "exr" / report.LIST}
    run(**lambertian)
    assert set((tmp_path / "exr").iterdir()) == mine


def test_bad_arguments_remove_no_image(tmp_path):
    lambertian = dict(names=("lobe_Lambert",), folder=tmp_path, modes=("shading",))
    run(every=True, **lambertian)
    before = set(tmp_path.iterdir())
    with pytest.raises(InputError):
        run(**lambertian | {"modes": ("frame",)})  # no scene has a mesh
    with pytest.raises(gl.CompileError):
        run(wrong("unknown(N)"), **lambertian)
    assert set(tmp_path.iterdir()) == before


def test_the_worst_failures_are_kept(monkeypatch):
    monkeypatch.setattr(matrix.Outcome, "MOST_FAILURES", 3)
    outcome = matrix.Outcome()
    units = {"a": (9, 70), "b": (80, 20), "c": (10,), "d": (60,), "e": (12, 11, 50)}
    for turn in range(3):
        for function, worst in units.items():
            if turn < len(worst):
                row = {"function": function, "context": "egl", "mode": "points", "pass": False, "units_allowed": 8,
                       "max_units": worst[turn]}
                outcome.add(compare.Result(row, None, None, None))
    kept = {function: result.row["max_units"] for (function, _), result in outcome.failures.items()}
    assert kept == {"a": 70, "b": 80, "d": 60}


@pytest.fixture(scope="module")
def frames():
    places = tuple(scenes.find(name) for name in ("bunny-point", scenes.SHOWN, "bunny-four"))
    return run(names=("lobe_Lambert",), scenes=places, size=64, modes=("frame",))


def test_edge_pixels_are_those_counted(frames):
    _, outcome = frames
    (result,) = outcome.frame.values()
    seen = result.case.picture
    assert result.row["scene"] == scenes.SHOWN and result.row["flip"] is not None
    assert result.edge.shape == seen.mask.shape and result.edge.sum() == result.row["edge_pixels"]
    assert not result.units[result.edge[seen.mask]].any()
    np.testing.assert_array_equal(result.image[seen.mask], result.got)
    assert not result.image[~seen.mask & ~result.edge].any()


def test_page_shows_the_frame_and_squares_its_edge_pixels(frames, tmp_path):
    plan, outcome = frames
    ((key, result),) = outcome.frame.items()
    edge = np.zeros_like(result.edge)
    edge[0, :3] = edge[63, 63] = True  # outside the reference's mask, too
    row = result.row | {"edge_pixels": 4}
    shown = replace(outcome, frame={key: replace(result, edge=edge, row=row)})
    text = report.write(shown, plan, tmp_path).read_text()
    assert f"Frame: {scenes.SHOWN}" in text
    assert "pictures 64 × 64, frames 256 × 256" in text
    assert f"4 of {row['pixels']:,}, {4 / row['pixels']:.3%}" in text
    assert f"<dd>{report.number(row['flip'])}</dd>" in text
    squares = re.search(r'class="ring edge" d="([^"]*)"', text)[1]
    assert squares.startswith("M-1.00 -1.00h5.00v3.00H-1.00z") and squares.count("z") == 2


def test_runs_of_edge_pixels_lie_on_them():
    mask = np.zeros((64, 64), bool)
    mask[8:56, 8:56] = True
    marked = np.zeros_like(mask)
    marked[20, 10:13] = marked[20, 40] = marked[63, 63] = True
    window = pictures.Window(mask, 26)
    assert window.factor == 2
    x, y = window.place(20, 10)
    assert window.runs(marked)[:2] == [(x - 0.25, y - 0.25, 1.5, 0.5), (x + 14.75, y - 0.25, 0.5, 0.5)]


def test_nan_does_not_break_the_page(tmp_path):
    nan = "lobe_Lambert(N, V, L, albedo) * sqrt(dot(N, L) - 0.5)"
    plan, outcome = run(wrong(nan), names=("lobe_Lambert",), folder=tmp_path / "exr")
    text = report.write(outcome, plan, tmp_path).read_text()
    assert "not finite" in text and "<td>NaN</td>" in text
    assert "NaN" not in "".join(re.findall(r'(?: d| x\d?| y\d?|cx|cy|r|viewBox|style)="([^"]*)"', text))


def test_summary_has_a_line_for_each_function_and_says_where(right, failed):
    plan, outcome = right
    text = report.summary(outcome)
    assert all(text.count(f"{catalogue.load().label(f)} ") >= 1 for f in plan.functions)
    assert f"all {len(plan.functions)} functions within tolerance" in text
    assert "1 of 1 function OUT OF TOLERANCE" in report.summary(failed[1])


def test_a_failing_edge_count_is_the_reason():
    row = dict(nonfinite=0, max_units=1.0, units_allowed=2048, undecided=0, pixels=1000, edge_pixels=4)
    assert report.reason(row) == "4 edge pixels, 0.3% allowed"


def test_file_names_are_safe():
    row = dict(function="lobe_F_Schlick(float,vec3)", scene="my mesh/4", mode="frame", context="egl")
    assert report.image_names(row)[0] == "lobe_F_Schlick_float_vec3-my_mesh_4-frame-egl-shader.exr"


def test_difference_colors_tell_sign_and_tolerance_by_brightness_too():
    signed = np.array([[-8.0, -1.0, 0.0, 1.0, 8.0, 8.1, -np.inf]])
    colors = pictures.diverging(signed, np.ones_like(signed, bool), limit=8.0, allowed=8.0)[0]
    assert [tuple(c) for c in colors[[0, 2, 4, 5, 6]]] == [pictures.NEGATIVE, pictures.ZERO, pictures.POSITIVE,
                                                           pictures.BEYOND, pictures.BEYOND]
    assert colors[1, 2] > colors[1, 0] and colors[3, 0] > colors[3, 2]  # bluish, orange
    brightness = colors.astype(int).sum(-1)
    assert brightness[0] < brightness[1] < brightness[2] > brightness[3] > brightness[4] > brightness[5]


def test_a_reduced_picture_keeps_its_outlier():
    mask = np.zeros((64, 64), bool)
    mask[8:56, 10:50] = True
    error = np.where(mask, 0.25, 0.0)
    error[33, 41] = -7.0
    window = pictures.Window(mask, 16)
    x, y = window.place(33, 41)
    assert window.factor == 4 and max(window.mask.shape) <= 16
    assert window.extreme(error)[int(y), int(x)] == -7.0
    assert np.count_nonzero(window.extreme(error) == -7.0) == 1
    np.testing.assert_allclose(window.mean(mask[..., None].astype(float))[window.mask], 1.0)


@pytest.mark.parametrize("largest", [0.0, 3.0, 8.0, 1e7])
def test_histogram_holds_every_error(largest):
    units = np.append(np.linspace(0, largest, 1000), np.inf)
    h = pictures.histogram(units, allowed=8)
    assert h.unbounded == 1 and 0 < h.allowed <= 1
    assert all(0 <= left < 1 and 0 < height <= 1 for left, _, height in h.bars)
    assert h.logarithmic == (largest > 16)
    assert (max(left for left, _, _ in h.bars) > h.allowed) == (largest > 8)
