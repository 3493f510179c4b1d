"""The error of image-based light in real time: where it must be none, and that what was measured still holds."""

import numpy as np
import pytest

from lobe.lab import catalogue, examples, gl, ibl, matrix, report, scenes


@pytest.fixture(scope="module")
def context():
    created = gl.create_context("egl")
    with created:
        yield created


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Small pictures of few samples, in caches of their own."""
    monkeypatch.setattr(ibl, "SIZE", 48)
    monkeypatch.setattr(ibl, "MOST", 512)
    yield
    for cached in (ibl.shown, ibl._direct, ibl.openness):
        cached.cache_clear()


@pytest.mark.parametrize("alpha", [0.1, 0.5])
@pytest.mark.parametrize("material", ibl.MATERIALS)
def test_in_a_white_room_there_is_none(context, material, alpha):
    room = examples.prefiltered(context, ibl.PROBES["white"](), samples=64)
    got = ibl.realtime(context, room, "sphere", material, alpha)
    expected, variance = ibl.converged("sphere", material, alpha, "white")
    inside = ibl.shown("sphere").inside
    found = (got - expected)[inside].mean() / expected[inside].mean()
    noise = np.sqrt(variance[inside].sum()) / expected[inside].sum()
    assert abs(found) < 3e-3 + 4 * noise  # lobe_DFG_GGX states 1.5e-3 of a white f0
    assert ibl.measured(got, expected, variance, "sphere")["rms"] < 2e-2


@pytest.fixture(scope="module")
def lobby(context):
    return examples.prefiltered(context, examples.lobby())


def errors(context, lobby, name, alpha, drawn_alpha):
    material, thing = name.split()
    got = ibl.realtime(context, lobby, thing, material, drawn_alpha)
    return ibl.measured(got, *ibl.converged(thing, material, alpha), thing)


@pytest.mark.parametrize("name, alpha", [("gold sphere", 0.5), ("plastic teapot", 0.35)])
def test_what_was_measured_still_holds(context, lobby, name, alpha):
    (stored,) = (row for row in ibl.load()["errors"][name] if row["alpha"] == alpha)
    found = errors(context, lobby, name, alpha, alpha)
    assert found["rms"] == pytest.approx(stored["rms"], rel=0.25)  # of a picture with fewer pixels
    assert found["bias"] == pytest.approx(stored["bias"], abs=0.02)


def test_a_wrong_width_is_seen(context, lobby):
    right, wrong = (errors(context, lobby, "gold sphere", 0.5, drawn)["rms"] for drawn in (0.5, 0.25))
    assert wrong > 1.5 * right


def test_every_picture_is_there_and_every_width_measured():
    found = ibl.load()["errors"]
    assert set(found) == {f"{m} {t}" for m in ibl.MATERIALS for t in ibl.OBJECTS}
    for name, rows in found.items():
        assert [row["alpha"] for row in rows] == list(ibl.ALPHAS)
        assert all(0 < row["noise"] < 1.5 * row["rms"] for row in rows), name  # so that little of it is left in rms
        assert 1000 < ibl.figure(name).stat().st_size <= 300_000


@pytest.mark.parametrize("function, shown", [("lobe_DFG_GGX", True), ("lobe_Lambert", False)])
def test_the_page_of_DFG_shows_it(tmp_path, function, shown):
    library = catalogue.load()
    plan = matrix.library_plan(library, library.find(function), scenes=(scenes.find("sphere-directional"),),
                               modes=("points",), points=64)
    page = report.write(matrix.run(plan), plan, tmp_path).read_text()
    assert ("Image-based light in real time" in page) == shown
