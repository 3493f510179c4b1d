"""The metals: the generated files are up to date, and their numbers hold by other formulas and other data."""

import re

import numpy as np
import pytest

from lobe.lab import catalogue, metals, plots, spectra
from test_spectra import coarse_f0

CONSTANTS = catalogue.load().constants
ROUNDING = 6e-5  # half of F0's last digit, and what the five digits of n and k may move F by
BY_NAME = {metal.name: metal for metal in metals.METALS}
REPAIR = "repair: .venv/bin/python -m lobe.lab.metals"


def constant(kind, metal):
    """A constant as GLSL reads it."""
    vector = re.search(r"vec3\((.*?)\)", CONSTANTS[f"LOBE_{kind}_{metal.name.upper()}"])[1]
    return np.array([float(x) for x in vector.split(", ")])


def conductor(cosI, n, k):
    """Fresnel reflectance in real numbers, with a + ib = sqrt((n + ik)^2 - sin^2) (Born and Wolf, section 14.2)."""
    sin2 = 1 - cosI**2
    p, q = n**2 - k**2 - sin2, 2 * n * k
    a2 = (np.hypot(p, q) + p) / 2
    b2 = (np.hypot(p, q) - p) / 2
    a, s = np.sqrt(a2), sin2 / cosI  # sin tan
    perpendicular = ((a - cosI) ** 2 + b2) / ((a + cosI) ** 2 + b2)
    parallel = perpendicular * ((a - s) ** 2 + b2) / ((a + s) ** 2 + b2)
    return (perpendicular + parallel) / 2


def test_generated_text_is_up_to_date():
    assert metals.SHADER.read_text(encoding="utf-8") == metals.shader(), REPAIR
    page = metals.PAGE.read_text(encoding="utf-8")
    assert page == metals.page(page), REPAIR
    assert all(table in page for table in metals.tables().values())


@pytest.mark.parametrize("name", metals.DRAWINGS)
def test_figures_are_of_these_numbers(name):
    assert metals.stamp() in (metals.FIGURES / name).read_text(encoding="utf-8"), REPAIR
    assert f"figures/{name}" in metals.PAGE.read_text(encoding="utf-8")


def test_figures_are_reproducible(tmp_path):
    draw, size = metals.DRAWINGS["metals-swatches.svg"]
    (tmp_path / "other").mkdir()
    for path in (tmp_path / "a.svg", tmp_path / "other" / "a.svg"):
        plots.write_svg(path, draw, size, metals.stamp())
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "other" / "a.svg").read_bytes()


@pytest.mark.parametrize("metal", metals.METALS, ids=lambda metal: metal.name)
class TestEveryMetal:
    def test_f0_agrees_with_a_second_observer(self, metal):
        cost_of_the_observer = 0.005 if metal.symbol in ("Cu", "Au") else 0.001  # more where the spectrum is steep
        assert np.abs(constant("F0", metal) - coarse_f0(metal.file)).max() <= cost_of_the_observer

    def test_another_light_changes_little(self, metal):
        allowed = {"Au": 0.03, "Cu": 0.02}.get(metal.symbol, 0.01)  # docs/metals.md says so
        assert np.abs(coarse_f0(metal.file, np.ones_like) - coarse_f0(metal.file)).max() <= allowed

    def test_fitted_index_has_f0_at_normal_incidence(self, metal):
        f0, n, k = (constant(kind, metal) for kind in ("F0", "ETA", "K"))
        reflected = np.where(f0 > metals.F0_LIMIT, metals.F0_LIMIT, f0)
        assert np.abs(((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2) - reflected).max() <= ROUNDING

    def test_fitted_index_follows_the_spectral_colour(self, metal):
        cosI = np.cos(np.radians(np.arange(0, 89.9, 0.7)))
        n, k = (v[:, None] for v in spectra.sampled(metal.path))
        exact = spectra.linear_srgb(conductor(cosI, n, k))
        n, k = (constant(kind, metal)[:, None] for kind in ("ETA", "K"))
        error = np.abs(conductor(cosI, n, k) - exact).max(axis=1)
        allowed = np.full(3, 0.006)
        if metal.name == "gold":
            allowed[0] = 0.05  # cut at F0_LIMIT
        assert (error <= allowed).all(), error
        stated = metals.errors(metal)[0]
        assert (error <= stated + 1e-6).all() and (error >= 0.95 * stated - 1e-5).all()

    def test_no_other_index_of_that_f0_is_nearer(self, metal):
        """Against a search over n, with k from F(0)."""
        angles = metals.FIT_ANGLES[:-1]
        cosI, weight = np.cos(angles), np.sin(angles) * np.cos(angles)
        curves = metals.spectral_colour(metal, angles)
        for curve, best_n, best_k in zip(curves, constant("ETA", metal), constant("K", metal)):
            if curve[0] > metals.F0_LIMIT:
                curve = np.minimum(curve, metals.F0_LIMIT)
            root = np.sqrt(curve[0])
            n = np.geomspace((1 - root) / (1 + root), (1 + root) / (1 - root), 400)[1:-1, None]
            k = np.sqrt((curve[0] * (n + 1) ** 2 - (n - 1) ** 2) / (1 - curve[0]))
            others = ((conductor(cosI, n, k) - curve) ** 2) @ weight
            best = ((conductor(cosI, best_n, best_k) - curve) ** 2) @ weight
            assert best <= others.min() + 1e-8


def test_the_lecture_agrees_where_the_samples_do():
    for name, digits in (("chromium", 0.001), ("palladium", 0.001), ("platinum", 0.007)):
        assert np.abs(constant("F0", BY_NAME[name]) - BY_NAME[name].lecture).max() <= digits


def test_there_are_eleven_metals_with_three_constants_each():
    assert len(BY_NAME) == 11 and sum(name.rpartition("_")[0] in ("LOBE_F0", "LOBE_ETA", "LOBE_K")
                                      for name in CONSTANTS) == 33


def test_gold_is_redder_than_the_gamut_and_silver_below_the_limit():
    assert constant("F0", BY_NAME["gold"])[0] > 1
    assert all((constant("F0", metal) < metals.F0_LIMIT).all() for metal in metals.METALS if metal.name != "gold")


class TestFresnel:
    ANGLES = np.radians(np.arange(0, 90, 0.5))

    @pytest.mark.parametrize("n, k", [(0.05, 4.5), (0.2, 3.4), (2.9, 3.1), (3.4, 7.2), (1.5, 0.0)])
    def test_agrees_with_the_real_form(self, n, k):
        cosI = np.cos(self.ANGLES)
        assert np.allclose(metals.fresnel(cosI, complex(n, k)), conductor(cosI, n, k), rtol=1e-12, atol=1e-14)

    def test_limits(self):
        cosI = np.cos(self.ANGLES)
        assert np.abs(metals.fresnel(cosI, 1 + 0j)).max() <= 1e-25  # nothing to reflect from
        assert np.abs(metals.fresnel(cosI, 1 + 1e9j) - 1).max() <= 1e-6  # a perfect mirror
        assert metals.fresnel(0.0, 0.2 + 3.4j) == 1  # grazing
        brewster = np.cos(np.arctan(1.5))
        assert metals.fresnel(brewster, 1.5 + 0j) == pytest.approx(((1.5**2 - 1) / (1.5**2 + 1)) ** 2 / 2, rel=1e-14)

    @pytest.mark.parametrize("index", [0.16 + 3.6j, 2.9 + 3.1j, 0.05 + 2.5j, 3.4 + 7.2j])
    def test_fit_finds_the_index_of_a_grey_metal(self, index):
        angles = metals.FIT_ANGLES
        assert metals.fit_index(metals.fresnel(np.cos(angles), index), angles) == pytest.approx(index, rel=1e-7)
