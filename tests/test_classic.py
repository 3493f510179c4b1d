"""The classic comparison: models are evaluated and fitted as they are written, and the page says what was measured."""

import json

import numpy as np
import pytest

from lobe import reference
from lobe.lab import catalogue, classic, classic_page, cost, isa, quadrature, simulated
from lobe.lab.errors import InputError

LIBRARY = catalogue.load()
FOUND = json.loads(classic_page.RESULTS.read_text())
MODELS, TARGETS = {m.name: m for m in classic.models()}, {t.name: t for t in classic.targets()}
REPAIR = "repair: .venv/bin/python benchmarks/classic.py"


def known(name, values):
    """A material that is a model with these values."""
    return classic.Target(name, "known", lambda V, L: classic.called(MODELS[name].call, values, V, L), "")


# What is simulated

@pytest.mark.parametrize("alpha", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("degrees", [0, 30, 60, 80])
def test_students_facets_cover_the_surface(alpha, degrees):
    """int G1 D max(V.H, 0) dH = NdotV: holds for this D and this G1 together, and for no others of theirs."""
    (_, _, V, L), weight = quadrature.visible_facets(np.radians(degrees))
    H = V + L
    NdotH = H[:, 2] / np.maximum(np.linalg.norm(H, axis=1), 1e-300)
    G1 = 1 / (1 + simulated.student_lambda(V[:1, 2], alpha)[0])
    assert weight @ simulated.student_D(NdotH, alpha) * G1 == pytest.approx(np.cos(np.radians(degrees)), rel=1e-5)


def test_students_tail_lies_between_ggx_and_beckmann():
    cosine = np.cos(np.arctan([5 * 0.3]))  # slopes of five widths
    at = np.array([[cosine[0], 0.3]])
    ggx, beckmann = (reference.evaluate(f"lobe_D_{name}(float,float)", at)[0, 0] for name in ("GGX", "Beckmann"))
    assert 2 * beckmann < simulated.student_D(cosine, 0.3)[0] < ggx / 2


# Models

def test_a_call_is_evaluated_as_glsl_means_it():
    """Terms are added, vectors made of numbers, T lies along x."""
    V, L = quadrature.spherical(0.5, 0.2)[[0, 0]], quadrature.spherical(np.array([0.3, 0.9]), 2.0)
    frame = np.hstack(quadrature.framed(V, L))
    N, T, V_, L_ = (frame[:, 3 * i : 3 * i + 3] for i in range(4))
    assert np.allclose(T, (1, 0, 0))
    values = {"albedo": (0.1, 0.2, 0.3), "f0": (0.5,) * 3, "alpha": 0.2, "wide": 0.6, "weight": 0.25}
    got = classic.called(MODELS["GGX, 2 widths"].call, values, V, L)
    one = np.hstack([N, V_, L_, np.full((2, 3), 0.5)])
    ggx = [reference.evaluate("lobe_GGX(vec3,vec3,vec3,vec3,float)", np.hstack([one, np.full((2, 1), a)]))
           for a in (0.2, 0.6)]
    assert np.allclose(got, np.array([0.1, 0.2, 0.3]) / np.pi + 0.75 * ggx[0] + 0.25 * ggx[1], rtol=1e-12)
    assert list(MODELS["GGX, 2 widths"].unknowns) == ["albedo", "f0", "alpha", "wide", "weight"]


def test_light_and_view_are_not_confused():
    """Phong's model of 1975 is the one that tells them apart: it divides by NdotL."""
    V, L = quadrature.spherical(0.2, 0.0), quadrature.spherical(1.2, np.pi)
    values = {"albedo": (0.0,) * 3, "rs": (1.0,) * 3, "exponent": 5.0}
    R_V = np.cos(1.2 - 0.2)  # the mirror direction of L lies 1.2 off the normal, on V's side
    assert np.allclose(classic.called(MODELS["Phong 1975"].call, values, V, L), R_V**5 / np.cos(1.2), rtol=1e-12)


@pytest.mark.parametrize("name, values", [
    ("Ward 1992", {"albedo": (0.1, 0.3, 0.2), "rs": (0.5, 0.4, 0.3), "alpha": 0.15}),
    ("Cook-Torrance", {"albedo": (0.2, 0.1, 0.05), "f0": (0.05, 0.3, 0.9), "alpha": 0.3}),
    ("Ashikhmin-Shirley", {"rd": (0.5, 0.3, 0.1), "rs": (0.05, 0.1, 0.3), "nu": 150.0}),
    ("Oren-Nayar, EON", {"albedo": (0.9, 0.5, 0.2), "roughness": 0.7}),
    pytest.param("GGX, 2 widths", {"albedo": (0.2, 0.1, 0.3), "f0": (0.1, 0.2, 0.5), "alpha": 0.1, "wide": 0.5,
                                   "weight": 0.4}, marks=pytest.mark.full),
    ("Ashikhmin-Shirley", {"rd": (0.5, 0.3, 0.1), "rs": (0.4, 0.5, 0.6), "nu": 0.3}),
    ("Schlick, single layer", {"f0": (0.05, 0.1, 0.2), "r": 0.9}),
    ("Schlick, double layer", {"f0": (0.05, 0.1, 0.2), "f0b": (0.8, 0.5, 0.3), "r": 0.1, "rb": 0.6}),
    ("Schlick, double layer", {"f0": (0.12, 0.12, 0.12), "f0b": (0.43, 0.29, 0.3), "r": 0.067, "rb": 1.0}),
])
def test_a_model_finds_itself(name, values):
    found, ends = classic.fitted(MODELS[name], known(name, values))
    assert min(ends) < 2e-4, ends
    if name == "GGX, 2 widths" and found["alpha"] > found["wide"]:
        found |= {"alpha": found["wide"], "wide": found["alpha"], "weight": 1 - found["weight"]}
    for key, value in values.items():
        assert np.allclose(found[key], value, rtol=0.02, atol=2e-3), key


@pytest.mark.parametrize("name, colours", [
    ("Schlick, double layer", {"f0": (0.02, 0.1, 0.7), "f0b": (0.9, 0.3, 0.05)}),
    ("Ashikhmin-Shirley", {"rd": (0.9, 0.3, 0.05), "rs": (0.02, 0.1, 0.7)}),
    ("GGX", {"albedo": (0.9, 0.3, 0.05), "f0": (0.02, 0.1, 0.7)}),
])
def test_colours_that_multiply_are_found_where_shapes_are_known(name, colours):
    search = classic.Search(MODELS[name])
    _, place, parts = search.tried[-3]
    shapes = {n: search.shape(n, t) for n, t in zip(search.shapes, place)}
    wanted = known(name, colours | shapes).samples.f
    _, found = search.coloured(parts, wanted)
    assert np.allclose(parts @ classic.products(found), wanted, rtol=1e-2, atol=1e-3 * wanted.max())


def test_ends_of_ranges_are_tried():
    """Schlick's layer is diffuse at rb = 1 alone; the widest of Ashikhmin and Shirley's highlights has nu = 0."""
    tried = {(m.name, n): search.shape(n, search.places(n)) for m in MODELS.values() if m.name not in classic.LAFORTUNE
             for search in [classic.Search(m)] for n in search.shapes}
    for (name, shape), at in tried.items():
        parameter, narrowest = MODELS[name].unknowns[shape], classic.NARROWEST.get(shape, np.inf)
        ends = (narrowest, parameter.high) if narrowest < 1 else (parameter.low, min(parameter.high, narrowest))
        assert (at[0], at[-1]) == pytest.approx(ends), (name, shape)
    rb = tried["Schlick, double layer", "rb"]
    assert np.diff(rb[rb > 0.5]).max() < 0.25, rb


@pytest.mark.parametrize("name", ["GGX", "Oren-Nayar, EON", "Ashikhmin-Shirley"])
def test_slopes_of_the_search_lead_down(name):
    """From a start that is off, the search ends where another one, far away, does."""
    search, given = classic.Search(MODELS[name]), TARGETS["plastic"].samples
    starts = search.starts(given)
    assert len(starts) >= 2
    ends = search.fit(given)[1]
    assert max(ends) / min(ends) < 1.001


# What was measured

def test_every_model_was_measured_as_it_is():
    assert {r["name"]: r["call"] for r in FOUND["models"]} == {n: m.call for n, m in MODELS.items()}, REPAIR
    assert {t["name"]: t["source"] for t in FOUND["targets"]} == {n: t.source for n, t in TARGETS.items()}, REPAIR
    stale = [key for row in FOUND["models"] for key, stamp in row["stamps"].items()
             if stamp != cost.stamp(LIBRARY, LIBRARY.find(key)[0])]
    assert not stale, f"their code is not the one that was measured; {REPAIR}"


@pytest.mark.parametrize("model, target", [("Phong", "clay"), ("GGX", "copper"), ("Cook-Torrance", "primer")])
def test_stored_fits_are_found_again(model, target):
    stored = next(r for r in FOUND["models"] if r["name"] == model)["fits"][target]
    values, ends = classic.fitted(MODELS[model], TARGETS[target])
    assert min(ends) == pytest.approx(stored["residual"], rel=1e-3), REPAIR
    found = classic.judged(MODELS[model], values, TARGETS[target])
    assert found["cube_root"] == pytest.approx(stored["cube_root"], rel=1e-2)
    assert found["albedo"] == pytest.approx(stored["albedo"], rel=1e-2)


def test_lafortune_finds_the_published_fits_again():
    """They are its own kind: what is told of them is no result."""
    row = next(r for r in FOUND["models"] if r["name"] == "Lafortune, 3 lobes")
    assert all(row["fits"][t]["residual"] < 0.01 for t in classic_page.names(FOUND, "fit"))


def test_more_freedom_is_not_worse():
    """A model that holds another as a limit cannot have the larger residual."""
    rows = {r["name"]: r["fits"] for r in FOUND["models"]}
    for less, more in (("GGX", "GGX, 2 widths"), ("GGX", "EON + GGX"), ("Oren-Nayar, EON", "EON + GGX"),
                       ("Phong", "Lafortune, 1 lobe"), ("Cook-Torrance", "Cook-Torrance, 2 widths"),
                       ("Schlick, single layer", "Schlick, double layer"), ("Lafortune, 1 lobe", "Lafortune, 2 lobes"),
                       ("Lafortune, 1 lobe", "Lafortune, 3 lobes"), ("Lafortune, 2 lobes", "Lafortune, 3 lobes"),
                       *(("Lambert", m.name) for m in MODELS.values() if m.plain == classic.LAMBERT),
                       *(("Lambert", name) for name in MODELS if name.startswith("Oren-Nayar"))):
        for target in TARGETS:
            assert rows[more][target]["residual"] <= rows[less][target]["residual"] * 1.002 + 2e-4, (less, more, target)


@pytest.mark.parametrize("target, values", [
    ("clay", {"f0": (0.12,) * 3, "f0b": (0.43, 0.29, 0.3), "r": 0.067, "rb": 1.0}),
    ("skin", {"f0": (0.17,) * 3, "f0b": (0.48, 0.32, 0.36), "r": 0.14, "rb": 1.0}),
    ("felt", {"f0": (0.026,) * 3, "f0b": (0.1,) * 3, "r": 1.0, "rb": 1e-8}),
])
def test_no_better_place_is_known(target, values):
    """Found by hand where a search had missed them."""
    row = next(r for r in FOUND["models"] if r["name"] == "Schlick, double layer")
    by_hand = classic.judged(MODELS[row["name"]], values, TARGETS[target])["residual"]
    assert row["fits"][target]["residual"] <= by_hand < 0.15


def test_costs_are_the_stored_ones():
    try:
        isa.require_tools()
    except InputError as error:
        pytest.skip(str(error))
    if FOUND["toolchain"] != isa.toolchain():
        pytest.skip("the stored figures are another compiler's")
    rows = [r for r in FOUND["models"] if r["name"] in ("GGX", "Ward 1992", "Phong")]
    now = isa.costs([classic.weighed(MODELS[r["name"]]) for r in rows], "NAVI21")
    assert [vars(c) for c in now] == [r["cost"]["NAVI21"] for r in rows], REPAIR


# What is told

def test_page_and_plot_are_up_to_date():
    repair = "repair: .venv/bin/python benchmarks/classic.py page"
    assert classic_page.PAGE.read_text(encoding="utf-8") == classic_page.page(FOUND), repair
    assert classic_page.stamp(FOUND) in classic_page.PLOT.read_text(encoding="utf-8"), repair


def doctored(name, **figures):
    """The results with one model's cycles, or all its errors of a kind, replaced."""
    found = json.loads(json.dumps(FOUND))
    row = next(r for r in found["models"] if r["name"] == name)
    for gpu in row["cost"]:
        row["cost"][gpu]["inverse_throughput"] = figures.get("cycles", row["cost"][gpu]["inverse_throughput"])
    for fit in row["fits"].values():
        fit |= {error: figures[error] for error in classic_page.ERRORS if error in figures}
    return found, row


def test_what_is_beaten_follows_from_the_figures():
    found, row = doctored("Ward 1992", cycles=1)
    assert classic_page.beaten(row, found) is None and row in classic_page.front(found, "fit")
    found, row = doctored("GGX", cycles=5000, residual=0.99, cube_root=0.99)
    assert classic_page.beaten(row, found) and row not in classic_page.front(found, "simulation")
    found, row = doctored("Lafortune, 1 lobe", cycles=1, residual=1e-6, cube_root=1e-6)
    assert row not in classic_page.front(found, "fit") and row in classic_page.front(found, "simulation")
    others = [r for r in found["models"] if r is not row]
    assert all(classic_page.beaten(r, found) is not row for r in others), "at home it beats nobody"
