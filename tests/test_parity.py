"""Every GLSL function equals the reference within the tolerance of its header, in every context. A function that is
added to the library is tested here without a line of test code."""

import numpy as np
import pytest

from lobe import reference
from lobe.lab import catalogue, compare, documented, gl, judge, matrix, scenes

LIBRARY = catalogue.load()
SIZE = 96


@pytest.fixture(scope="module")
def contexts():
    return [gl.create_context(name) for name in gl.CONTEXTS]


def check(case, contexts):
    """In every context, by one evaluation of the reference, which costs most; returns the rows."""
    rows = [compare.compare(case, shader(case.function), context).row for context in contexts]
    for row in rows:
        assert row["nonfinite"] == 0, row
        assert row["max_units"] <= row["units_allowed"], row
        assert row["undecided"] <= compare.MAX_UNDECIDED * row["pixels"], row
        assert row["pass"], row
    return rows


def shader(function):
    return compare.library_shader(function, LIBRARY.text, LIBRARY.label(function))


@pytest.mark.parametrize("function", LIBRARY.functions, ids=lambda f: f.key)
def test_points(function, contexts):
    rows = check(compare.points_case(function, judge.PARITY_POINTS, {}, judge.PARITY_SEED), contexts)
    for row, context in zip(rows, contexts):
        stated = documented.at_points(LIBRARY.label(function), context)
        assert compare.ratio(row) <= stated, f"{row['max_units']:.3g} units: repair: .venv/bin/python benchmarks/compare_time.py"


@pytest.mark.full
@pytest.mark.parametrize("function", LIBRARY.functions, ids=lambda f: f.key)
def test_a_million_points(function, contexts):
    slow = next(f for f in reference.functions() if f.key == function.key).is_quadrature
    points = 1 << (14 if slow else 20)
    check(compare.points_case(function, points, {}, seed=2), contexts)


# Inputs at which a lobe was once out of tolerance: N, V, L, f0, alpha.
FOUND = [
    [0.460487545, 0.368411511, -0.807603955, 0.868731618, 1.05500912e-05, 0.495283097, -0.868681669, -6.56457632e-05,
     -0.495370686, 0.530471325, 0.381094158, 0.084994629, 0.231405988],
    [0.98989445, -0.117703326, 0.0790881813, 0.0799856558, 0.00272007892, -0.996792316, -0.0797430947, -0.0024185353,
     0.996812522, 0.0586375631, 0.998621821, 0.152563661, 0.195034757],
]


@pytest.mark.parametrize("row", FOUND, ids=["both_grazing_and_opposite", "grazing_with_cancelling_sensitivities"])
@pytest.mark.parametrize("name", ["lobe_GGX", "lobe_GGX_Kelemen", "lobe_Beckmann", "lobe_CookTorrance"])
def test_found_inputs(name, row, contexts):
    (function,) = LIBRARY.find(name)
    values = np.split(np.array(row, np.float32), np.cumsum([p.width for p in function.parameters])[:-1])
    inputs = {p.name: value[None, None] for p, value in zip(function.parameters, values)}
    case = compare.Case(function, "found", "points", inputs, None, compare.reference_values(function, inputs, None))
    check(case, contexts)


SHADED = [f for f in LIBRARY.functions if f.kind != "helper" and any(p.is_geometry for p in f.parameters)]


@pytest.mark.parametrize("scene", ["sphere-four", "suzanne-point", "teapot-grazing"])
@pytest.mark.parametrize("function", SHADED, ids=lambda f: f.key)
def test_shading(function, scene, contexts):
    check(compare.shading_case(function, scenes.find(scene), SIZE, {}), contexts)


@pytest.mark.parametrize("scene", ["teapot-four", "bunny-grazing"])
@pytest.mark.parametrize("function", [f for f in SHADED if f.kind == "lobe"], ids=lambda f: f.key)
def test_frame(function, scene, contexts):
    place = scenes.find(scene)
    case = compare.frame_case(function, place, 256, {})
    for context in contexts:
        row = compare.compare_frame(case, place, shader(function), context).row
        assert row["pass"], row


def test_reference_has_the_same_functions_and_parameter_names():
    ours = {f.key: (f.stem, f.result, [p.name for p in f.parameters]) for f in LIBRARY.functions}
    theirs = {f.key: (f.model, f.result, [p.name for p in f.parameters]) for f in reference.functions()}
    assert theirs == ours


def test_contexts_agree_on_what_they_ran_on():
    plan = matrix.library_plan(LIBRARY, LIBRARY.find("lobe_alpha"), scenes=(), modes=("points",), contexts=gl.CONTEXTS, points=64)
    outcome = matrix.run(plan)
    assert outcome.passed and set(outcome.renderers) == set(gl.CONTEXTS)
    assert all(row["renderer"] and row["renderer"] in outcome.renderers[row["context"]] for row in outcome.rows)
