"""The gallery shows every lobe as its shader draws it, and says of highlights what is measured."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from lobe.lab import catalogue, gallery, gallery_draw, gallery_page, gl, highlights

LIBRARY = catalogue.load()
LOBES = gallery.lobes(LIBRARY)
ANISOTROPIC = [f for f in LOBES if highlights.is_anisotropic(f)]
RESULTS = json.loads(gallery_page.RESULTS.read_text())
REPAIR = f"repair: .venv/bin/{gallery_page.COMMAND}"
MOST_BYTES = 1_500_000  # of the document's pictures


@pytest.fixture(scope="module")
def shade():
    return gallery.Shades(LIBRARY, gl.create_context("egl"))


# The document

def test_document_is_up_to_date():
    assert list(RESULTS["lobes"]) == [f.name for f in LOBES], REPAIR
    assert gallery_page.markdown(RESULTS) == gallery_page.PAGE.read_text(encoding="utf-8"), REPAIR


def test_document_has_its_pictures():
    shown = re.findall(r"\]\((figures/[^)]+)\)", gallery_page.PAGE.read_text(encoding="utf-8"))
    paths = [gallery_page.PAGE.parent / name for name in shown]
    assert {p.name for p in gallery_page.FIGURES.iterdir()} == {p.name for p in paths}
    assert sum(p.stat().st_size for p in paths) <= MOST_BYTES


@pytest.mark.parametrize("function", LOBES, ids=lambda f: f.name)
def test_document_says_what_the_shader_draws(function, shade):
    facts = RESULTS["lobes"][function.name]
    (e,) = gallery.exhibits(LIBRARY, (function,), shade)
    assert e.settings == facts["settings"], REPAIR
    assert e.facts["peaks"] == pytest.approx(facts["peaks"], rel=2e-3), REPAIR
    if e.elongation:
        assert e.elongation.axis == facts["elongation"]["axis"], REPAIR
        assert e.elongation.ratio == pytest.approx(facts["elongation"]["ratio"], rel=2e-2), REPAIR


def test_settings_are_within_the_headers_ranges():
    for f in LOBES:
        for p in f.parameters:
            assert p.is_geometry or p.admits(gallery.look(f)[p.name]), f"{f.name}: {p.name}"


# Pictures

def test_polar_curves_are_f(shade):
    (lambert,), (phong,) = LIBRARY.find("lobe_Lambert"), LIBRARY.find("lobe_Phong")
    inside = np.abs(gallery.SWEEP) < 89.9
    curves = gallery.curves(lambert, shade)[:, inside]
    assert curves == pytest.approx(gallery.look(lambert)["albedo"][gallery.CHANNEL] / np.pi, rel=1e-6)
    n, rs = gallery.look(phong)["exponent"][0], gallery.look(phong)["rs"][gallery.CHANNEL]
    for angle, curve in zip(gallery.ANGLES, gallery.curves(phong, shade)):  # V on the left: the mirror on the right
        cosine = np.maximum(np.cos(np.radians(gallery.SWEEP - angle)), 0)
        assert curve[inside] == pytest.approx(rs * (n + 2) / (2 * np.pi) * cosine[inside] ** n, rel=1e-3, abs=1e-6)


def test_teapot_shows_tangents_of_anisotropic_lobes_alone(shade):
    ggx, brushed = gallery.exhibits(LIBRARY, (*LIBRARY.find("lobe_GGX"), *LIBRARY.find("lobe_GGX_aniso")), shade)
    plain = gallery_draw.teapot(ggx, shade, 80)
    assert plain.shape == (58, 80, 3) and (plain[0, 0] == gallery_draw.PAPER).all()
    seen = gallery_draw.pixels(80)
    assert not np.array_equal(gallery_draw.tangents(plain, seen, apart=9), plain)
    bare = gallery.Exhibit(brushed.function, brushed.curves, None)
    assert not np.array_equal(gallery_draw.teapot(bare, shade, 200), gallery_draw.teapot(brushed, shade, 200))


def test_years_and_authors_come_from_the_headers():
    found = {f.name: (gallery.year(f), gallery.authors(f)) for f in LOBES}
    assert all(year > 1700 and authors for year, authors in found.values()), found
    assert found["lobe_Lambert"] == (1760, "Lambert") and found["lobe_Ward"] == (1992, "Ward")
    assert found["lobe_CookTorrance"] == (1982, "Cook and Torrance") and found["lobe_Lafortune"][1] == "Lafortune et al."


def test_history_keeps_the_order_of_years_and_captions_apart():
    captions = [("a name of some length", "1994, Somebody")] * 4 + [("x", "2007, y")]
    spots = gallery_draw._packed(captions, [1994, 1994, 1995, 2020, 2007], 1200)
    assert [row for _, row in spots[:4]] == [0, 1, 2, 0] and spots[0][0] < spots[2][0] < spots[4][0] < spots[3][0]
    assert [v[0].name for v in gallery.models(LOBES)].count("lobe_GGX") == 1


# The direction of highlights

def test_elongation_of_a_known_ellipse():
    y, x = np.mgrid[60:-61:-1, -60:61]
    turn = np.radians(30)
    along, across = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    found = highlights.elongation(np.exp(-(along / 30) ** 2 - (across / 10) ** 2))
    assert found.ratio == pytest.approx(3, rel=0.02) and found.angle == pytest.approx(30, abs=1) and found.axis == "T"


def test_grooves_along_B_make_a_highlight_along_T():
    found = highlights.elongation(highlights.grooves())
    assert found.axis == "T" and found.ratio > 3


def other_way(values):
    """The parameters with the roles of T and B exchanged; None where no parameter can say that."""
    pairs = [("alphaX", "alphaY"), ("nu", "nv"), *((f"Cx{i}", f"Cy{i}") for i in ("", 1, 2, 3))]
    swapped = {b: values[a] for pair in pairs for a, b in (pair, pair[::-1]) if a in values}
    return values | swapped if swapped else None


@pytest.mark.parametrize("function", ANISOTROPIC, ids=lambda f: f.name)
def test_highlight_turns_with_its_widths(function, shade):
    values = gallery.look(function)
    found = highlights.measured(function, values, shade)
    assert found.ratio > 1.25 and found.axis == ("B" if "p" in values else "T")
    assert ("across the grooves" in found.grooves) == (found.axis == "T")
    if swapped := other_way(values):
        turned = highlights.measured(function, swapped, shade)
        assert turned.axis == "B" and turned.ratio == pytest.approx(found.ratio, rel=0.02)
        equal = swapped | {n: values[n] for n in ("alphaX", "nu", "Cx", "Cx1", "Cx2", "Cx3") if n in values}
    else:
        equal = values | {"p": (1.0,), "pb": (1.0,)}
    assert highlights.measured(function, equal, shade).axis == ""


def test_a_shader_that_takes_B_for_T_is_noticed(shade):
    def wrong(function, values, N, T, V, L):
        return shade(function, values, N, np.cross(N, T), V, L)

    for f in ANISOTROPIC:
        found = highlights.measured(f, gallery.look(f), wrong)
        assert found.axis != RESULTS["lobes"][f.name]["elongation"]["axis"], f.name


# The command

def run(*arguments):
    return subprocess.run([sys.executable, "-m", "lobe.lab", "gallery", *map(str, arguments)], capture_output=True, text=True)


def test_command_writes_a_page_that_needs_no_other_file(tmp_path):
    done = run("lobe_Lambert", "lobe_Ward", "--size", "48", "--out", tmp_path, "--json", tmp_path / "found.json")
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert not re.search(r'(src|href)="(?!data:|#)', page) and page.count("<svg") == 3
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids)) and set(re.findall(r"url\(#([^)]+)\)", page)) <= set(ids)
    for name in ("lobe_Lambert.png", "lobe_Ward.png", "history.png"):
        assert Image.open(tmp_path / name).width >= 48
    assert json.loads((tmp_path / "found.json").read_text())["results"]["lobes"]["lobe_Ward"]["elongation"]["axis"] == "T"


@pytest.mark.parametrize("arguments, said", [
    (["lobe_Nothing"], "unknown function"), (["lobe_D_GGX"], "no lobe of N, V, L"), (["lobe_Ward", "--size", "2"], "--size"),
    (["lobe_Ward", "--context", "metal"], "egl, osmesa")])
def test_bad_usage_is_one_line(tmp_path, arguments, said):
    done = run(*arguments, "--out", tmp_path / "new")
    assert done.returncode == 2 and said in done.stderr and done.stderr.count("\n") == 1
