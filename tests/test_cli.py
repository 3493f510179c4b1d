"""The command line: results on stdout, one clear line and exit status 2 for bad usage or input, nothing overwritten."""

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from lobe import reference
from lobe.lab import catalogue, cli, commands, compare, files
from lobe.lab.paths import DATA, GLSL, ROOT

MY_GGX = """#version 330
const float MY_PI = 3.14159265;
vec3 myGGX(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    float c = dot(N, V), d = dot(N, L);
    if (c <= 0.0 || d <= 0.0) return vec3(0.0);
    vec3 H = normalize(V + L);
    float nh = clamp(dot(N, H), 0.0, 1.0), t = nh * nh * (alpha * alpha - 1.0) + 1.0;
    float D = alpha * alpha / (MY_PI * t * t);
    float G = 0.5 / (d * sqrt(alpha * alpha + (1.0 - alpha * alpha) * c * c) + c * sqrt(alpha * alpha + (1.0 - alpha * alpha) * d * d));
    return D * G * (f0 + (1.0 - f0) * pow(clamp(1.0 - dot(V, H), 0.0, 1.0), 5.0));
}
"""
CALL = "myGGX(N, V, L, f0, alpha)"


@pytest.fixture
def lobe(monkeypatch, capsys, tmp_path):
    """Runs the command line in this process: (exit status, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["lobe", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capsys.readouterr()
        return ended.value.code or 0, out, err

    return run


def one_line(err, *parts):
    assert err.count("\n") == 1 and err.startswith("lobe: "), err
    for part in parts:
        assert part in err


def test_compare_writes_a_report_and_json(lobe, tmp_path):
    status, out, err = lobe("compare", "lobe_GGX", "lobe_F_Schlick", "--scene", "sphere-point", "--scene", "teapot-directional",
                            "--size", 64, "--points", 256, "--context", "all", "--json", "r.json")
    assert status == 0 and err == "" and "lobe_GGX" in out and "llvmpipe" in out
    assert (tmp_path / "out" / "index.html").stat().st_size < 30e6
    rows = json.loads((tmp_path / "r.json").read_text())
    assert rows["schema"] == 1
    assert {r["mode"] for r in rows["results"]} == {"points", "shading", "frame"}
    assert {r["context"] for r in rows["results"]} == {"egl", "osmesa"}
    assert [r["flip"] for r in rows["results"] if r["mode"] == "frame"] and all(
        r["flip"] < 0.01 for r in rows["results"] if r["mode"] == "frame")


def test_json_alone_on_stdout(lobe):
    status, out, _ = lobe("compare", "lobe_alpha", "--points", 64, "--json", "-")
    assert status == 0 and json.loads(out)["results"][0]["function"] == "lobe_alpha"


def test_keep_writes_triples(lobe, tmp_path):
    lobe("compare", "lobe_Lambert", "--scene", "sphere-point", "--mode", "shading", "--size", 32, "--keep")
    pictures = sorted(p.name.rsplit("-", 1)[1] for p in (tmp_path / "out" / "exr").glob("*.exr"))
    assert pictures == ["difference.exr", "reference.exr", "shader.exr"]


class TestForeign:
    """A studio's own function through the same comparison."""

    def test_textbook_form_fails_on_narrow_lobes(self, lobe, tmp_path):
        (tmp_path / "my.glsl").write_text(MY_GGX)
        status, out, _ = lobe("compare", "--glsl", "my.glsl", "--call", CALL, "--against", "lobe_GGX", "--size", 64,
                              "--scene", "sphere-point", "--points", 4096)
        assert status == 1 and "myGGX" in out

    def test_passes_where_it_is_right(self, lobe, tmp_path):
        (tmp_path / "my.glsl").write_text(MY_GGX)
        status, _, err = lobe("compare", "--glsl", "my.glsl", "--call", CALL, "--against", "lobe_GGX", "--size", 64,
                              "--scene", "sphere-directional", "--set", "alpha=0.5", "--units", 64, "--mode", "shading")
        assert (status, err) == (0, "")

    @pytest.mark.full
    @pytest.mark.parametrize("alpha, units", [(0.2, 41), (0.05, 376)])
    def test_units_of_the_usual_form_are_those_of_the_readme(self, lobe, tmp_path, alpha, units):
        text = (ROOT / "README.md").read_text(encoding="utf-8")
        assert f"{units} units at alpha = {alpha}" in text or f"{units} at {alpha}" in text
        (tmp_path / "my.glsl").write_text(MY_GGX)
        lobe("compare", "--glsl", "my.glsl", "--call", CALL, "--against", "lobe_GGX", "--mode", "shading",
             "--set", f"alpha={alpha}", "--units", 64, "--json", "found.json")
        worst = max(row["max_units"] for row in json.loads((tmp_path / "found.json").read_text())["results"])
        assert worst == pytest.approx(units, rel=0.05)

    def test_wrong_function_fails(self, lobe, tmp_path):
        (tmp_path / "my.glsl").write_text(MY_GGX.replace("D * G", "D * G * 1.001"))
        assert lobe("compare", "--glsl", "my.glsl", "--call", CALL, "--against", "lobe_GGX", "--size", 64,
                    "--scene", "sphere-directional", "--set", "alpha=0.5", "--units", 64, "--mode", "shading")[0] == 1

    def test_overload_is_chosen_by_the_call(self, lobe, tmp_path):
        (tmp_path / "my.glsl").write_text("float d(float c, float a) { return a * a / (3.14159265 * pow((1.0 - c) * (1.0 + c) + a * a * c * c, 2.0)); }")
        assert lobe("compare", "--glsl", "my.glsl", "--call", "d(NdotH, alpha)", "--against", "lobe_D_GGX", "--mode", "points",
                    "--set", "alpha=0.5", "--units", 16)[0] == 0

    def test_compile_error_names_file_and_line(self, lobe, tmp_path):
        (tmp_path / "ok.glsl").write_text("float twice(float x) { return 2.0 * x; }\n")
        (tmp_path / "my.glsl").write_text("#version 330\n\nfloat broken(float x) {\n    return y;\n}\n")
        status, _, err = lobe("compare", "--glsl", "ok.glsl", "--glsl", "my.glsl", "--call", "broken(alpha)", "--against",
                              "lobe_GGX")
        assert status == 2
        one_line(err, "my.glsl:4: ", "y")

    def test_call_that_does_not_compile(self, lobe, tmp_path):
        (tmp_path / "my.glsl").write_text(MY_GGX)
        status, _, err = lobe("compare", "--glsl", "my.glsl", "--call", "yourGGX(N)", "--against", "lobe_GGX")
        assert status == 2
        one_line(err, "--call", "yourGGX")

    def test_unknown_variable_lists_the_known(self, lobe, tmp_path):
        (tmp_path / "my.glsl").write_text(MY_GGX)
        status, _, err = lobe("compare", "--glsl", "my.glsl", "--call", "myGGX(N, V, L, f0, gloss)",
                              "--against", "lobe_GGX")
        assert status == 2
        one_line(err, "--call", "gloss", "N, V, L, f0, alpha")

    @pytest.mark.parametrize("content, place", [
        (b"float f(float x) { return x; }\n// void main() is mine\nvoid main( ) {}\n", "my.glsl:3: main()"),
        (b"/*\n#include */\n  # include <common>\n", "my.glsl:3: #include"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "my.glsl: is no text"),
    ])
    def test_file_of_more_than_functions_is_named(self, lobe, tmp_path, content, place):
        (tmp_path / "my.glsl").write_bytes(content)
        status, _, err = lobe("compare", "--glsl", "my.glsl", "--call", "f(alpha)", "--against", "lobe_GGX")
        assert status == 2
        one_line(err, place, "expected")

    def test_call_that_fits_two_overloads_asks_for_one(self, lobe, tmp_path):
        (tmp_path / "my.glsl").write_text("vec3 my(float c, vec3 f0) { return f0 + (1.0 - f0) * pow(1.0 - c, 5.0); }")
        command = ("compare", "--glsl", "my.glsl", "--call", "my(cosI, f0)", "--units", 64, "--mode", "points",
                   "--against")
        status, _, err = lobe(*command, "lobe_F_Schlick")
        assert status == 2
        one_line(err, '--against "lobe_F_Schlick(float,float)"', '--against "lobe_F_Schlick(float,vec3)"')
        assert lobe(*command, "lobe_F_Schlick(float,vec3)")[0] == 0

    def test_is_judged_inside_the_domain_unless_asked(self, lobe, tmp_path):
        (tmp_path / "my.glsl").write_text(MY_GGX)
        command = ("compare", "--glsl", "my.glsl", "--call", CALL, "--against", "lobe_GGX", "--size", 16,
                   "--mode", "shading", "--json", "-")
        shown = {row["scene"] for row in json.loads(lobe(*command)[1])["results"]}
        assert "aluminium-teapot-four" in shown and "gold-teapot-four" not in shown
        asked = json.loads(lobe(*command, "--scene", "gold-teapot-four")[1])["results"]
        assert [row["scene"] for row in asked] == ["gold-teapot-four"]

    @pytest.mark.parametrize("arguments", [("--glsl", "my.glsl"), ("--call", "f(N)"), ("--against", "lobe_GGX"),
                                           ("lobe_GGX", "--glsl", "my.glsl", "--call", "f(N)", "--against", "lobe_GGX")])
    def test_incomplete(self, lobe, arguments):
        status, _, err = lobe("compare", *arguments)
        assert status == 2
        one_line(err, "--glsl", "--call", "--against")


GOLD = DATA / "ior" / "Au_Johnson.csv"
BAD = {
    "unknown lobe": (("compare", "lobe_GXX"), ("lobe_GXX", "lobe_GGX?", "lobe list")),
    "unknown scene": (("compare", "--scene", "teacup"), ("teacup", "teapot-point", "sphere-four")),
    "unknown mode": (("compare", "--mode", "pixel"), ("pixel", "points", "shading", "frame")),
    "unknown context": (("compare", "--context", "metal"), ("metal", "egl", "osmesa")),
    "unknown parameter": (("compare", "lobe_GGX", "--set", "gloss=1"), ("gloss", "alpha", "f0")),
    "geometry": (("compare", "lobe_GGX", "--set", "N=0,0,1"), ("N=0,0,1", "scene", "lobe eval")),
    "geometry in a picture": (("reference", "lobe_GGX", "--set", "V=0,0,1"), ("V=0,0,1", "scene", "lobe eval")),
    "scene that does not suit": (("compare", "lobe_Lambert", "--scene", "sphere-four", "--scene", "gold-teapot-four"),
                                 ("gold-teapot-four", "f0", "lobe_Lambert")),
    "metal that does not suit": (("compare", "lobe_Lambert", "--metal", GOLD), ("Au_Johnson.csv", "f0", "lobe_Lambert")),
    "metal that no lobe shows": (("reference", "lobe_Lambert", "--metal", GOLD), ("Au_Johnson.csv", "f0", "lobe_Lambert")),
    "scene of a helper": (("compare", "lobe_alpha", "--scene", "sphere-four"), ("sphere-four", "lobe_alpha", "points")),
    "constants only": (("compare", "metals"), ("metals", "constants")),
    "out of range": (("compare", "lobe_GGX", "--set", "alpha=5"), ("alpha=5", "0.0001..4")),
    "no number": (("compare", "lobe_GGX", "--set", "alpha=x"), ("alpha=x", "1 finite number")),
    "two of three": (("compare", "lobe_GGX", "--set", "f0=1,0.5"), ("f0=1,0.5", "3 finite number")),
    "too large": (("eval", "lobe_GGX", "alpha=1e99"), ("alpha=1e99", "finite")),
    "nan": (("eval", "lobe_GGX", "alpha=nan"), ("alpha=nan", "finite")),
    "nothing suits": (("compare", "lobe_alpha", "--mode", "frame"), ("nothing to compare",)),
    "no such mesh": (("compare", "--mesh", "absent.obj"), ("absent.obj",)),
    "no mesh": (("reference", "--mesh", DATA / "README.md"), ("README.md",)),
    "no such table": (("compare", "--metal", "absent.csv"), ("absent.csv",)),
    "unwritable": (("compare", "lobe_alpha", "--out", DATA / "README.md" / "out"), ("README.md",)),
    "unwritable json": (("compare", "lobe_alpha", "--points", "64", "--json", DATA / "README.md" / "r.json"), ("README.md",)),
    "no direction": (("eval", "lobe_GGX", "V=0,0,0"), ("V=0,0,0", "no direction")),
    "given twice": (("eval", "lobe_GGX", "alpha=0.1", "alpha=0.2"), ("alpha=0.2", "twice")),
    "set twice": (("compare", "lobe_GGX", "--set", "alpha=0.1", "--set", "alpha=0.2"), ("alpha=0.2", "twice")),
    "eval unknown": (("eval", "lobe_D_GGX", "NdotX=1"), ("NdotX", "NdotH")),
    "bundle unknown": (("bundle", "GGX"), ("GGX", "lobe_GGX")),
    "bundle target": (("bundle", "lobe_GGX", "--target", "hlsl"), ("hlsl", "300es")),
    "reference of a term": (("reference", "lobe_D_GGX"), ("lobe_D_GGX", "lobe_Lambert")),
    "no command": (("paint",), ("paint",)),
    "option": (("compare", "--sise", "3"), ("--sise", "lobe compare --help")),
    "nothing checked": (("stability", "--function", "lobe_alpha", "--only", "cases"), ("--only cases", "lobe_alpha")),
    "size": (("compare", "--size", "0"), ("--size",)),
    "list unknown": (("list", "lobe_GXX"), ("lobe_GXX",)),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_and_status_2(lobe, case):
    arguments, parts = BAD[case]
    status, out, err = lobe(*arguments)
    assert (status, out) == (2, "")
    one_line(err, *parts)


def test_bad_input_overwrites_nothing(lobe, tmp_path):
    (tmp_path / "out").mkdir()
    page = tmp_path / "out" / "index.html"
    page.write_text("precious")
    (tmp_path / "my.glsl").write_text("float broken(")
    assert lobe("compare", "--glsl", "my.glsl", "--call", "broken(alpha)", "--against", "lobe_GGX")[0] == 2
    assert page.read_text() == "precious" and len(list((tmp_path / "out").iterdir())) == 1


@pytest.mark.parametrize("command", [("compare", "lobe_alpha", "--points", "64"), ("reference", "--size", "8")])
def test_unwritable_json_is_found_before_anything_is_written(lobe, tmp_path, command):
    (tmp_path / "out").mkdir()
    page = tmp_path / "out" / "index.html"
    page.write_text("precious")
    status, _, err = lobe(*command, "--json", DATA / "README.md" / "r.json")
    assert status == 2
    one_line(err, "README.md")
    assert page.read_text() == "precious" and len(list((tmp_path / "out").iterdir())) == 1


FORGOTTEN = """// A file without a reference.
// needs  nothing
#ifndef LOBE_FORGOTTEN_GLSL
#define LOBE_FORGOTTEN_GLSL

// {what}
// {energy}
// units       8
// source      Nobody 2000
{signature} {{
    return {value};
}}

#endif
"""


def with_file(monkeypatch, folder, text):
    """The library with one file more."""
    shutil.copytree(GLSL, folder)
    (folder / "forgotten.glsl").write_text(text)
    extended = catalogue.load.__wrapped__(folder)
    monkeypatch.setattr(catalogue, "load", lambda folder=None: extended)


@pytest.mark.parametrize("command", ["compare lobe_forgotten", "compare forgotten", "eval lobe_forgotten"])
def test_function_without_a_reference_is_named(lobe, monkeypatch, tmp_path, command):
    with_file(monkeypatch, tmp_path / "glsl", FORGOTTEN.format(
        what="A helper.", energy="Why not.", signature="float lobe_forgotten(float NdotV)", value="NdotV"))
    status, out, err = lobe(*command.split())
    assert (status, out) == (2, "")
    one_line(err, "forgotten.glsl:10: lobe_forgotten(float)", "reference/models/forgotten.h", "reference/models.h")


COSINES = """// A lobe of cosines.
// param  albedo  color  0..1  0.5  reflected part
// reciprocal  yes
// energy      <= 1
// units       8
// source      Nobody 2000
vec3 lobe_Cosines(float NdotV, float NdotL, vec3 albedo) {
    return albedo;
}
"""


def test_lobe_of_cosines_is_compared_without_frames_and_is_no_material(lobe, monkeypatch, tmp_path):
    header = "\n".join(FORGOTTEN.splitlines()[:5])
    with_file(monkeypatch, tmp_path / "glsl", f"{header}\n{COSINES}\n#endif\n")
    monkeypatch.setattr(compare, "require_reference", lambda functions: None)
    monkeypatch.setattr(reference, "evaluate", lambda key, x: x[:, 2:])
    monkeypatch.setattr(compare, "_condition", lambda function, x: np.zeros((len(x), 3)))
    status, out, err = lobe("compare", "lobe_Cosines", "--scene", "teapot-point", "--size", 16, "--points", 64,
                            "--json", "-")
    assert (status, err) == (0, "") and [r["mode"] for r in json.loads(out)["results"]] == ["points", "shading"]
    status, _, err = lobe("reference", "lobe_Cosines")
    assert status == 2
    one_line(err, "lobe_Cosines", "N, V, L", "lobe_Lambert")


def test_internal_error_is_one_line_and_status_3(lobe, monkeypatch):
    def broken(*arguments):
        raise ZeroDivisionError("of mine")

    monkeypatch.setattr(commands, "list_functions", broken)
    status, out, err = lobe("list")
    assert (status, out) == (3, "")
    one_line(err, "internal error: ZeroDivisionError: of mine", "LOBE_TRACEBACK=1")
    monkeypatch.setenv("LOBE_TRACEBACK", "1")
    status, _, err = lobe("list")
    assert status == 3 and "Traceback" in err and 'in broken' in err


def test_without_arguments_it_prints_its_help(lobe):
    status, out, err = lobe()
    assert (status, err) == (0, "") and out == lobe("--help")[1] and out.count("\n") > 10
    assert "..." not in out.partition("Commands:")[2], "a command's first sentence is too long for its line"


def test_version_is_that_of_what_the_bundle_prints(lobe):
    status, out, err = lobe("--version")
    assert (status, err) == (0, "") and f"// L{out[1:].strip()}: " in lobe("bundle", "lobe_alpha")[1]


@pytest.mark.parametrize("name", ["metals", "metals.glsl", "glsl/metals.glsl"])
def test_a_file_may_be_named_as_it_lies_there(lobe, name):
    status, out, _ = lobe("list", name)
    assert status == 0 and "LOBE_F0_GOLD" in out and "lobe_GGX" not in out


def test_skipped_triangles_are_told_once(lobe, tmp_path):
    (tmp_path / "degen.obj").write_text("v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 1\nf 1 2 3\nf 1 3 4\nf 1 2 2\nf 3 3 3\n")
    command = ("compare", "lobe_Lambert", "--mesh", "degen.obj", "--mode", "shading", "--size", 16)
    assert lobe(*command)[2] == "lobe: degen.obj: 2 degenerate triangles skipped\n"
    (tmp_path / "one.obj").write_text("v 0 0 0\nv 2 0 0\nv 2 2 0\nf 1 2 3\nf 1 2 2\n")
    assert lobe("reference", "--mesh", "one.obj", "--size", 8)[2] == "lobe: one.obj: 1 degenerate triangle skipped\n"


def test_list_shows_constants(lobe):
    for names in ((), ("metals",)):
        (gold,) = (line.split(maxsplit=1)[1] for line in lobe("list", *names)[1].splitlines() if "LOBE_F0_GOLD" in line)
        assert gold.startswith("vec3(") and gold.rstrip().endswith("metals.glsl")
    assert "LOBE_F0_GOLD" not in lobe("list", "ggx")[1]
    listed = json.loads(lobe("list", "metals", "--json", "-")[1])
    assert listed["results"] == [] and {c["constant"] for c in listed["constants"]} == set(
        catalogue.load().file("metals").constants)


def test_list_shows_every_function(lobe):
    status, out, _ = lobe("list")
    assert status == 0 and all(f.name in out for f in catalogue.load().functions)
    facts = json.loads(lobe("list", "ggx", "--json", "-")[1])["results"]
    assert {f["file"] for f in facts} == {"ggx.glsl"}
    assert all(f["source"] and f["parameters"] for f in facts)


def test_eval_shows_both_sides(lobe):
    status, out, _ = lobe("eval", "lobe_F_Schlick", "cosI=0.5", "f0=0.04", "--context", "all")
    assert status == 0 and "GLSL" in out and "0.07" in out and "reference" in out and "osmesa" in out
    row = json.loads(lobe("eval", "lobe_Lambert", "albedo=1,0.5,0", "--json", "-")[1])["results"][0]
    assert np.allclose(row["reference"], [1 / np.pi, 0.5 / np.pi, 0])


def test_eval_beyond_the_range_says_so(lobe):
    gold = ("eval", "lobe_GGX", "f0=1.04,0.7,0.3")
    assert lobe(*gold)[0] == 2
    status, out, _ = lobe(*gold, "--any")
    assert status == 0 and "no tolerance is promised" in out and "f0 (" in out
    assert not json.loads(lobe(*gold, "--any", "--json", "-")[1])["results"][0]["in_range"]
    assert "promised" not in lobe("eval", "lobe_GGX", "f0=1", "--any")[1]
    assert lobe("eval", "lobe_GGX", "f0=nan", "--any")[0] == 2


def test_eval_takes_directions_of_any_length(lobe):
    """Lobes take them for unit, so that others would be called out of tolerance."""
    def values(*arguments):
        row = json.loads(lobe("eval", "lobe_GGX", *arguments, "--json", "-")[1])["results"][0]
        return row["reference"], row["glsl"]

    unit = values("N=0,0,1", "V=0.6,0,0.8")
    assert np.allclose(values("N=0,0,7", "V=3,0,4"), unit, rtol=1e-6)
    assert not np.allclose(values("N=0,0,7", "V=3,0,4", "--any")[1], unit[1], rtol=1e-2)


def test_bundle_goes_to_a_file(lobe, tmp_path):
    assert lobe("bundle", "lobe_GGX", "--target", "300es", "-o", "b.glsl")[0] == 0
    assert (tmp_path / "b.glsl").read_text().startswith("#version 300 es\nprecision highp float;\n")


def test_reference_writes_every_layer(lobe, tmp_path):
    status, out, _ = lobe("reference", "lobe_Lambert", "lobe_GGX", "--scene", "gold-teapot-four", "--size", 32, "--samples", 2,
                          "--ground")
    layers = files.read_exr(tmp_path / "out" / "gold-teapot-four.exr")
    assert status == 0 and {"RGB", "N", "T", "V", "L0", "L3", "E0", "position", "uv", "depth", "object", "primitive"} <= set(layers)
    assert (tmp_path / "out" / "gold-teapot-four.png").exists() and layers["RGB"].max() > 0


@pytest.mark.parametrize("command", ["compare", "test", "list", "bundle", "eval", "reference", "fit"])
def test_every_command_has_help(lobe, command):
    status, out, _ = lobe(command, "--help")
    assert status == 0 and "Usage" in out


def test_installed_command_starts():
    assert subprocess.run([sys.executable, "-m", "lobe.lab", "list", "lambert"], capture_output=True).returncode == 0


def test_messages_are_a_line_that_terminals_show_as_it_is():
    """Whatever bytes of a user's file they quote."""
    assert cli.line("a\x1b[31m b\r\n c\u2028d\udcff\ufeff é") == "a\\x1b[31m b c d\\udcff\\ufeff é"
    for message in ("x: " + "9" * 5000 + ": expected less", "x: " + "a " * 9000 + ": expected less"):
        assert len(cli.line(message)) <= cli.LONGEST_LINE and cli.line(message).startswith("x: ")
        assert cli.line(message).endswith(": expected less") and "..." in cli.line(message)


LOBE = f"{shlex.quote(sys.executable)} -m lobe.lab"


@pytest.mark.parametrize("command, words", [
    ("bundle lobe_Lambert >/dev/full", "stdout: cannot be written (No space left on device)"),
    ("list >/dev/full", "stdout: cannot be written (No space left on device)"),
    ("list --json - >/dev/full", "stdout: cannot be written (No space left on device)"),
    ("bundle lobe_Lambert >&-", "stdout is closed"),
    ("bundle lobe_nothing 2>&-", ""),
    ("bundle lobe_nothing 2>/dev/full", ""),
])
def test_streams_that_take_nothing(command, words):
    done = subprocess.run(["sh", "-c", f"{LOBE} {command}"], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", bool(words)) and words in done.stderr


@pytest.mark.parametrize("command", ["list", "list --json -", "bundle lobe_Lambert"])
def test_a_reader_that_has_gone_is_no_fault(command):
    """`lobe list | head`: neither a word, nor the status of a comparison out of tolerance."""
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(["sh", "-c", f"{LOBE} {command}"], stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")


def test_too_little_memory_is_told(lobe, monkeypatch):
    def exhausted(*_):
        raise MemoryError("std::bad_alloc")

    monkeypatch.setattr(commands, "reference", exhausted)
    status, out, err = lobe("reference", "lobe_Lambert", "--size", 65536)
    assert (status, out, err.count("\n")) == (2, "", 1) and "memory" in err and "internal" not in err


@pytest.mark.parametrize("milliseconds", range(0, 1600, 200))
def test_interrupt_ends_without_a_word(milliseconds, tmp_path):
    """From when Python has started: that takes some 50 ms by itself, during which a module of ours is not there yet."""
    code = "import os, sys; os.write(1, b'x'); sys.argv = ['lobe', 'compare']; from lobe.lab.__main__ import main; main()"
    heard = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731; the background of a shell ignores it
    with subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          preexec_fn=heard) as process:
        process.stdout.read(1)
        time.sleep(milliseconds / 1000 + 0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode in (130, -signal.SIGINT) and (out, err) == (b"", b"")
