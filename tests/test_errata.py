"""The lecture's errata: the page and its figures are up to date; their numbers hold by other mathematics."""

import re

import numpy as np
import pytest
from scipy import integrate, optimize, special

from lobe.lab import errata, figures_curves, plots, quadrature, scene_page, spectra
from lobe.lab.paths import ROOT
from test_metals import conductor

SHOWN = 5e-4  # half of the last digit of most tables
REPAIR = "repair: .venv/bin/python -m lobe.lab."
DRAWINGS = [(module, name) for module in (errata, figures_curves) for name in module.DRAWINGS]
PAGES = ("lecture-errata.md", "pictures.md")


def numbers(table):
    """The numbers of a table, {row's name: [values]}; rows of one name follow one another."""
    found = {}
    for name, *values in table.rows:
        found.setdefault(name, []).extend(v for v in values if not isinstance(v, str))
    return found


def read(page):
    return (ROOT / "docs" / page).read_text(encoding="utf-8")


def anchors(text):
    """Of a page's headings, as GitHub makes them."""
    return {re.sub(r"[^\w -]", "", h.lower()).replace(" ", "-") for h in re.findall(r"^#+ (.*)", text, re.M)}


def cos(degrees):
    return np.cos(np.radians(degrees))


class TestPages:
    def test_tables_are_up_to_date(self):
        page = errata.PAGE.read_text(encoding="utf-8")
        assert page == errata.page(page), REPAIR + "errata"
        assert all(f"<!-- {name} -->\n|" in page for name in errata.TABLES)

    @pytest.mark.parametrize("module, name", DRAWINGS, ids=lambda x: x if isinstance(x, str) else "")
    def test_figures_are_up_to_date(self, module, name):
        now = plots.stamp(plots.drawn(*module.DRAWINGS[name]))
        assert now in (module.FIGURES / name).read_text(encoding="utf-8"), REPAIR + module.__name__.rpartition(".")[2]

    def test_every_figure_is_shown_and_small(self):
        text = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "README.md", ROOT / "examples" / "README.md",
                                                                     *(ROOT / "docs").glob("*.md")))
        for path in (ROOT / "docs" / "figures").iterdir():
            assert f"figures/{path.name}" in text and path.stat().st_size <= scene_page.LARGE, path.name

    @pytest.mark.parametrize("page", PAGES)
    def test_links_lead_somewhere(self, page):
        for link, anchor in re.findall(r"\]\(([^)#]*)#?([^)]*)\)", read(page)):
            assert (ROOT / "docs" / link).exists(), link
            assert not anchor or anchor in anchors(read(link or page)), anchor

    def test_there_are_fourteen(self):
        text = read("lecture-errata.md")
        sections = re.split(r"^## (?=\d)", text, flags=re.M)[1:]
        assert [int(s.split(".")[0]) for s in sections] == list(range(1, 15))
        assert all("    printed  " in s and ("    right  " in s or "one function" in s) for s in sections)


class TestFresnel:
    def test_numbers(self):
        table = numbers(errata.fresnel())
        assert table["n = 1.5, 0°"] == pytest.approx([0.20, 0.04], abs=1e-12)
        for (n, angle) in ((1.5, 45), (1.5, 60), (1.5, 80), (1.33, 0), (1.9, 0)):
            printed, right = table[f"n = {n}, {angle}°"]
            assert right == pytest.approx(conductor(cos(angle), n, 0.0), abs=1e-12)
            assert printed > right + 0.002

    def test_printed_has_a_pole_from_index_2_on(self):
        for n in (2.0, 2.4, 4.0):
            assert errata.printed_fresnel(1 / np.sqrt(n * n - 3) - 1e-9, n) > 1e9
        assert errata.printed_fresnel(cos(np.linspace(0, 90, 901)), 1.9).max() < 18


class TestOrenNayar:
    def test_printed_is_not_lambert(self):
        table = numbers(errata.oren_nayar())
        for view in (0, 45, 80):
            printed, right = table[f"σ = 0.0, seen at {view}°"]
            t, s = np.radians(view), np.sin(np.radians(view))
            assert printed == pytest.approx(s * (t - np.sin(2 * t) / 2) + 2 / 3 * np.tan(t) * (1 - s**3), abs=1e-6)
            assert right == pytest.approx(1, abs=1e-12)

    @pytest.mark.parametrize("view", [45, 80])
    def test_albedo(self, view):
        A, B = 1 - 0.5 * 0.25 / (0.25 + 0.33), 0.45 * 0.25 / (0.25 + 0.09)
        v = np.radians(view)
        # Over the azimuth, max(0, cos) has the integral 2, and 1 the integral 2 pi.
        whole, lit = (integrate.quad(f, 0, np.pi / 2, points=[v])[0] for f in (
            lambda t: np.sin(max(t, v)) * np.tan(min(t, v)) * np.sin(t) * np.cos(t), lambda t: np.sin(t) * np.cos(t)))
        expected = [2 * A * whole + 2 / np.pi * B * whole, 2 * A * lit + 2 / np.pi * B * whole]
        assert numbers(errata.oren_nayar())[f"σ = 0.5, seen at {view}°"] == pytest.approx(expected, abs=1e-5)

    def test_printed_is_black_along_the_normal(self):
        assert numbers(errata.oren_nayar())["σ = 0.5, seen at 0°"][0] == 0

    def test_sigma(self):
        table = numbers(errata.sigma())
        right, mean = (table[f"{name}, radians"] for name in ("standard deviation", "mean tilt"))
        spread = np.radians(20)
        size, _ = integrate.quad(lambda t: t * np.exp(-(t / spread) ** 2 / 2), 0, np.inf)
        assert mean[0] == pytest.approx(size * np.sqrt(2 / np.pi) / spread, rel=1e-9)
        for sigma, A, B, brightness in (right, mean, table["standard deviation, degrees"]):
            assert brightness == pytest.approx(A + B * np.sin(np.radians(75)) * np.tan(np.radians(75)), rel=1e-12)
        assert right[3] - mean[3] > 0.1


class TestOneSidedG:
    def test_not_reciprocal(self):
        angles = (60, 80, 89, 89.9)
        for alpha, ratios in numbers(errata.one_sided()).items():
            tan = np.tan(np.radians(angles))
            assert ratios == pytest.approx((1 + np.sqrt(1 + (float(alpha) * tan) ** 2)) / 2, rel=1e-9)
        assert numbers(errata.one_sided())["0.5"][1] == pytest.approx(2.0, abs=0.005)

    def test_the_right_one_is(self):
        G2, a, b = "lobe_G2_GGX(float,float,float)", cos(10), cos(80)
        assert plots.evaluated(G2, a, b, 0.5) == pytest.approx(plots.evaluated(G2, b, a, 0.5), rel=1e-14)


class TestDistributions:
    def test_gaussian(self):
        for m in (0.05, 0.2, 0.5, 0.8):
            printed, right = numbers(errata.distributions())[f"Gaussian, m = {m}"]
            whole, _ = integrate.quad(lambda d: np.exp(-(d / m) ** 2) * np.cos(d) ** 2 * np.sin(d), 0, np.pi / 2)
            assert printed == pytest.approx(2 * np.pi * whole, rel=1e-9)
            assert right == pytest.approx(1, abs=2e-3 if m == 0.8 else 1e-5)
        assert printed / (np.pi * m * m) == pytest.approx(0.54, abs=0.005)

    def test_ward(self):
        table = numbers(errata.distributions())
        for m in (0.1, 0.5, 1.0):
            a = 1 / m**2  # over tan^2
            assert table[f"Ward, m = {m}"] == pytest.approx([a - a * a * special.exp1(a) * np.exp(a), 1], abs=1e-8)

    def test_ward_of_two_widths(self):
        (x, w), (a, b) = np.polynomial.hermite.hermgauss(100), (0.2, 0.8)  # over slopes, in units of the widths
        expected = w @ (1 + (a * x[:, None]) ** 2 + (b * x) ** 2) ** -2.0 @ w / np.pi
        assert numbers(errata.distributions())["Ward, 0.2 by 0.8"] == pytest.approx([expected, 1], abs=1e-5)

    def test_width_is_the_rms_slope(self):
        for m, (both, one, expected) in numbers(errata.slopes()).items():
            assert (both, one) == pytest.approx((float(m), expected), rel=1e-6)

    def test_ashikhmin_shirley(self):
        for (exponents, row) in numbers(errata.ashikhmin_shirley()).items():
            x, y = map(int, exponents.split(", "))
            projected = np.sqrt((x + 1) * (y + 1) / ((x + 2) * (y + 2)))  # over the azimuth, in closed form
            assert row == pytest.approx([2 * np.pi, 1, 2 * np.pi * projected, projected, 1], rel=1e-5)


class TestPowers:
    def test_blinn_s_angle(self):
        in_plane, *others = errata.blinn().rows
        assert in_plane[3:] == pytest.approx([20, 20])
        for light, _, _, beta, twice_delta in others:
            t, half = np.radians(float(light[:-1])), np.radians(10)
            assert beta == pytest.approx(2 * np.degrees(np.arcsin(np.sin(t) * np.sin(half))), rel=1e-9)
            assert twice_delta == pytest.approx(2 * np.degrees(np.arctan(np.tan(t) * np.sin(half))), rel=1e-9)
        assert (beta, twice_delta) == pytest.approx((19.7, 89.1), abs=0.05)

    def test_the_half_is_inside_the_cosine(self):
        for _, _, phong, inside, outside in errata.blinn_power().rows:
            assert inside == pytest.approx(phong, rel=0.01) and outside <= phong / 2

    def test_blinn_s_exponent_in_the_library(self):
        for h in (10, 50):
            assert plots.evaluated("lobe_exponent_Blinn(float)", h) == 4 * h

    def test_schlick_s_power(self):
        for h, (difference, angle, ratio) in numbers(errata.power()).items():
            h = int(h)
            worst = optimize.minimize_scalar(lambda x: x**h - errata.printed_power(x, h), bounds=(0, 1),
                                             method="bounded", options={"xatol": 1e-12})
            assert (difference, angle) == pytest.approx((-worst.fun, np.degrees(np.arccos(worst.x))), abs=2e-3)
            a = h / (h - 1)  # x^2 / (h - (h - 1) x), divided out
            closed = (a * a * np.log(h) - a - 0.5) / (h - 1)
            assert ratio == pytest.approx(closed * (h + 2), rel=1e-6)
        assert 0.18 <= difference <= 0.205

    def test_lafortune(self):
        rows = errata.lafortune().rows
        assert rows[0][1:] == ("1 1 1", "-1 -1 1")
        scale = 22 / (2 * np.pi)
        assert rows[1][1:] == pytest.approx((scale**10, scale))
        assert rows[2][1:] == pytest.approx((10 * 3**0.5, 0.75**10))
        L, V = errata.direction(0.5), errata.direction(0.3, np.pi)
        bracket = (scale ** (1 / 20) * np.array([-1, -1, 1]) * L * V).sum()
        assert bracket**20 == pytest.approx(scale * np.cos(0.2) ** 20)  # 0.2 off the mirror direction


class TestMetals:
    def test_index_of_gold(self):
        fake, measured = errata.index_of_metal().rows
        n, k = (float(x) for x in re.findall(r"[\d.]+", measured[1]))
        assert float(fake[1]) == pytest.approx(90, abs=0.5)
        for index, row in (((float(fake[1]), 0.0), fake), ((n, k), measured)):
            assert row[2:] == pytest.approx([float(conductor(cos(a), *index)) for a in (0, 60, 78, 85)], abs=SHOWN)
        assert (fake[4], measured[4]) == pytest.approx((0.90, 0.954), abs=0.002)

    def test_gold_gains(self):
        cut, c = "Schlick of min(F0, 1), as in whole lobes", cos([0, 30, 60, 75, 90])
        table = numbers(errata.gold())
        assert table["Schlick"] == pytest.approx(1.022 - 0.022 * (1 - c) ** 5, abs=1e-12)
        assert np.diff(table["Schlick"]).max() < 0 and table[cut] == pytest.approx([1] * 5, abs=1e-12)


class TestTanForm:
    def test_is_the_same_function(self):
        c = np.linspace(0.01, 1, 100)
        for alpha in (0.1, 0.5, 1.0):
            expected = alpha**2 / (np.pi * (c * c * (alpha**2 - 1) + 1) ** 2)
            assert errata.printed_ggx(c, alpha) == pytest.approx(expected, rel=1e-9)
            assert plots.evaluated(errata.D_GGX, c, alpha) == pytest.approx(expected, rel=1e-9)

    def test_breaks_at_grazing(self):
        *_, tiny, zero = errata.tan_form().rows
        assert not tiny[1] == pytest.approx(tiny[2], rel=0.5) and zero[1] == "NaN"
        assert zero[2] == pytest.approx(0.25 / np.pi, rel=1e-12)


class TestSchlick:
    ANGLES = np.linspace(0, 89.999, 20001)

    @pytest.mark.parametrize("n, error, relative", [(1.1, 0.21, 187), (1.33, 0.060, 23), (1.5, 0.036, 23),
                                                    (1.65, 0.032, 21), (4.0, 0.20, 41)])
    def test_errors_of_dielectrics(self, n, error, relative):
        c = cos(self.ANGLES)
        exact, f0 = conductor(c, n, 0.0), ((n - 1) / (n + 1)) ** 2
        difference = abs(f0 + (1 - f0) * (1 - c) ** 5 - exact)
        assert difference.max() == pytest.approx(error, abs=1.5e-3)
        row = next(r for r in errata.schlick().rows if r[0] == f"n = {n}")
        assert row[1] == pytest.approx(difference.max(), abs=1e-6)
        assert row[3] == f"{100 * (difference / exact).max():.0f} %" == f"{relative} %"
        assert float(row[5]) == pytest.approx(integrate.trapezoid(-2 * c * difference, c), abs=1e-4)

    def test_no_index_keeps_1_percent(self):
        largest = [abs(errata.schlick_error(n)[0]).max() for n in np.linspace(1.05, 5, 80)]
        assert 0.031 < min(largest) < 0.033
        assert all(errata.schlick_mean_error(n) < 0.0115 for n in np.linspace(1.25, 2.8, 30))

    def test_iron(self):
        n, k = spectra.sampled(ROOT / "data" / "ior" / "Fe_Johnson.csv")
        c = cos(self.ANGLES)
        for nm in (450, 550, 650):
            index = n[nm - 380], k[nm - 380]
            f0 = conductor(1.0, *index)
            difference = abs(f0 + (1 - f0) * (1 - c) ** 5 - conductor(c, *index)).max()
            assert numbers(errata.schlick())[f"iron at {nm} nm"][0] == pytest.approx(difference, abs=1e-6)
            assert 0.145 < difference < 0.18

    def test_the_cosine_of_a_rough_lobe(self):
        for angle, (of_light, of_view, of_half) in zip((45, 45, 42.5), numbers(errata.schlick_cosine()).values()):
            assert of_half == pytest.approx(0.04 + 0.96 * (1 - cos(angle)) ** 5, rel=1e-12)
        assert of_light / of_view > 10


class TestKelemen:
    @pytest.mark.parametrize("view", [17, 75])
    def test_albedo(self, view):
        (N, _, V, L), weight = quadrature.lights(np.radians(view))
        rows = {(row[0], row[1]): row[2:4] for row in errata.kelemen().rows}
        for alpha in (0.1, 0.2, 0.5, 1.0):
            expected = [weight @ plots.evaluated(key, N, V, L, errata.WHITE, alpha)[:, 0]
                        for key in (errata.GGX_KELEMEN, errata.GGX)]
            assert rows[f"{alpha}", f"{view}°"] == pytest.approx(expected, abs=1e-5)
        assert rows["1.0", f"{view}°"][0] == pytest.approx(rows["1.0", f"{view}°"][1], abs=1e-4)

    def test_albedo_of_the_lecture_s_remark(self):
        row = next(r for r in errata.kelemen().rows if r[:2] == ("0.2", "17°"))
        assert row[2:4] == pytest.approx((0.867, 0.945), abs=SHOWN)

    def test_has_no_bound(self):
        tan = np.tan(np.radians((45, 80, 89, 89.9)))
        for alpha, ratios in numbers(errata.kelemen_pointwise()).items():
            assert ratios == pytest.approx(np.sqrt(1 + (float(alpha) * tan) ** 2), rel=1e-9)  # 1 / G2


def test_every_erratum_names_what_does_it_right():
    from lobe.lab import catalogue

    library, text = catalogue.load(), read("lecture-errata.md")
    known = {f.name for f in library.functions} | set(library.constants)
    rows = re.findall(r"^\| \[(\d+)\]\(#[^)]*\) \|[^|]*\| (.*) \|$", text, re.M)
    assert [int(n) for n, _ in rows] == list(range(1, 15))
    assert all(re.findall(r"`(\w+)`", named) for _, named in rows)
    assert set(re.findall(r"`((?:lobe|LOBE)_\w+)`", text)) <= known
