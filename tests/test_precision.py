"""The precision matrix: treatments do to a shader what they say, drivers of other processes draw, every failure is
explained by a built-in function that was measured alone, and half precision costs what the document says."""

import json
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

from lobe.lab import catalogue, drivers, gl, half, precision, radv, stability, treatments
from lobe.lab.errors import InputError

LIBRARY = catalogue.load()
REPAIR = "repair: .venv/bin/python -m lobe.lab.precision"


@pytest.fixture(scope="module")
def egl():
    return gl.create_context("egl")


def values(context, source, call, **inputs):
    with context:
        return gl.evaluate(context, source, call, "float",
                           {name: np.asarray(x, np.float32).reshape(1, -1, 1) for name, x in inputs.items()})[:, 0]


# --- precise


def test_precise_marks_all_variables_and_results():
    text = treatments.precise("float f(float x) {\n    float a = x * x, b = a;\n    if (x > 1.0) return a;\n"
                              "    return a + b;\n}\n")
    assert "precise float a = x * x, b = a;" in text
    assert text.count("precise float lobe_returned = ") == 2 and text.count("return lobe_returned;") == 2


def test_precise_reaches_the_compiler(egl):
    """A sum that the compiler rewrites into a better one: with `precise` it must not."""
    source = "float f(float c, float a) { return c * c * (a * a - 1.0) + 1.0; }"
    plain, exact = (values(egl, text, "f(c, a)", c=[1.0], a=[1e-4])[0] for text in (source, treatments.precise(source)))
    assert exact == 0.0
    assert plain == pytest.approx(1e-8, rel=1e-3) or plain == 0.0  # other compilers need not rewrite


@pytest.mark.parametrize("function", LIBRARY.functions, ids=lambda f: f.key)
def test_precise_holds(function, egl):
    driver = stability.Driver("egl, precise", egl, treatments.precise)
    outcome = stability.run(LIBRARY, (function,), (driver,), 256, ("cases", "random"))
    assert outcome.passed, [row for row in outcome.rows if not row["pass"]]


# --- through an optimiser


def test_optimised_is_the_same_function_and_no_more(egl):
    if missing := [package for program, package in treatments.TOOLS.items() if not shutil.which(program)]:
        pytest.skip(f"install the package {missing[0]}")
    seen = []

    def spied(text):
        seen.append(treatments.optimised(text))
        return seen[-1]

    x = np.linspace(0, 1, 9)
    got = values(drivers.Treated.of(egl, spied), LIBRARY.text, "lobe_D_GGX(x, 0.3)", x=x)
    assert got == pytest.approx(values(egl, LIBRARY.text, "lobe_D_GGX(x, 0.3)", x=x), rel=1e-6)
    assert len(seen) == 1 and "lobe_D_GGX" not in seen[0].replace("lobe_D_GGX_", "") and len(seen[0]) < 3000


# --- half precision


def test_half_rounds_as_numpy_does(egl):
    rng = np.random.default_rng(3)
    edges = [65504.0, 65519.0, 65520.0, 1e30, 2.0**-14, 2.0**-24, 2.0**-25, 2.0**-25 * 1.001, 0.0, 2049.0, 2051.0]
    ordinary = rng.normal(size=4000) * 10.0 ** rng.uniform(-9, 6, 4000)
    x = np.concatenate([ordinary, edges, np.negative(edges)]).astype(np.float32)
    for flush in (False, True):
        got = values(egl, treatments.half("", flush), "lobe_half(x)", x=x)
        with np.errstate(over="ignore"):
            want = x.astype(np.float16).astype(np.float32)
        want[(np.abs(want) < 2.0**-14) & flush] = 0
        assert (got == want).all()


@pytest.mark.parametrize("body, exact", [
    ("return x * x + 1.1 / y;", lambda x, y: x * x + np.float16(1.1) / y),
    ("float a = x; a *= y - 0.3; a += x; return -a;", lambda x, y: -(x * (y - np.float16(0.3)) + x)),
    ("return x > y ? exp(x) : sqrt(y + 1.0);", lambda x, y: np.where(x > y, np.exp(x), np.sqrt(y + np.float16(1)))),
    ("return dot(vec3(x, y, 0.7), vec3(y, y, x));", lambda x, y: (x * y + y * y) + np.float16(0.7) * x),
    ("return length(vec2(x, y));", lambda x, y: np.sqrt(x * x + y * y)),
    ("return mix(x, y, 0.25);", lambda x, y: x * np.float16(0.75) + y * np.float16(0.25)),
    ("return cross(vec3(x, y, 0.5), vec3(y, 0.5, x)).x;", lambda x, y: y * x - np.float16(0.25)),
    ("return normalize(vec2(x, y)).x;",
     lambda x, y: x * (1 / np.sqrt((x * x + y * y).astype(float))).astype(np.float16)),
])
def test_half_rounds_every_step(egl, body, exact):
    """Held to NumPy's binary16, step by step."""
    rng = np.random.default_rng(5)
    x, y = rng.uniform(0.1, 3, (2, 2000)).astype(np.float16)
    source = "float f(float x, float y) { " + body + " }"
    got, want = values(egl, treatments.half(source), "f(x, y)", x=x, y=y), exact(x, y).astype(np.float32)
    wrong = got != want
    print(f"{wrong.mean():.2%} differ")
    assert wrong.mean() < 2e-3  # of exp's last digit, where the driver's rounds to the other side
    assert np.abs(got - want).max() <= 2.0**-10 * np.abs(want).max()
    assert (values(egl, source, "f(x, y)", x=x, y=y) != want).mean() > 0.2  # float32 is another matter


def test_half_refuses_what_it_does_not_know():
    with pytest.raises(NotImplementedError, match="smoothstep"):
        treatments.half("float f(float x) { return smoothstep(0.0, 1.0, x); }")


def test_half_costs_what_theory_says(egl):
    """The width at which GGX's peak leaves the range of a half is known: 1 / (pi alpha^2) = 65504."""
    (function,) = LIBRARY.find("lobe_D_GGX(vec3,vec3,float)")
    found = half.costs(LIBRARY, function, egl)
    limit = (np.pi * 65504) ** -0.5
    least = half.least(found["stored"].finite)
    assert half.WIDTHS[half.WIDTHS < least][-1] < limit <= least * 1.001
    assert found["stored"].error < 2.0**-11 < found["inputs"].error < found["flushed"].error
    assert "N" in half.row(LIBRARY, function, egl)["highp"]


def test_half_inputs_lie_where_lobes_are_seen():
    (function,) = LIBRARY.find("lobe_GGX")
    inputs = {name: x.astype(float) for name, x in half.usual(function).items()}
    for X in "VL":
        assert (np.sum(inputs["N"] * inputs[X], 1) > 0).all()
    H = inputs["V"] + inputs["L"]
    sine = np.linalg.norm(np.cross(inputs["N"], H), axis=1) / np.linalg.norm(H, axis=1)
    assert 0.15 < (sine < inputs["alpha"][:, 0]).mean() < 0.5


# --- drivers


def test_missing_packages_are_named(monkeypatch):
    monkeypatch.setattr(radv, "ICDS", ())
    monkeypatch.setattr(shutil, "which", lambda name: None)
    for name, package in (("lavapipe", "mesa-vulkan-drivers"), ("swiftshader", "chromium")):
        with pytest.raises(InputError, match=f"install the package {package}"):
            drivers.create(name)
    with pytest.raises(InputError, match="install the package glslang-tools"):
        precision.treated(precision.Column("egl", "spirv-opt"), None)
    with pytest.raises(InputError, match="expected one of egl, osmesa, softpipe"):
        drivers.create("radeon")


def test_essl_is_the_same_shader():
    text = drivers.essl("#version 330\n#extension GL_ARB_gpu_shader5 : require\nuniform sampler2D a;\n")
    assert text.startswith("#version 300 es\nprecision highp float;") and text.endswith("\nuniform sampler2D a;\n")
    assert "extension" not in text


def created(column):
    try:
        return precision.treated(column, drivers.create(column.driver))
    except InputError as error:
        pytest.skip(str(error))


@pytest.mark.full
@pytest.mark.parametrize("column", precision.COLUMNS, ids=lambda column: column.name)
def test_all_hold(column):
    outcome = stability.run(LIBRARY, LIBRARY.functions, (created(column),), 1 << 12, precision.SUITES)
    assert len(outcome.rows) > 900 and outcome.passed, [row for row in outcome.rows if not row["pass"]]


def test_samplers_hold_where_sines_are_coarse():
    """SwiftShader's sin and cos are 2e-4 off, and its pow(0, 0.1) is 1.5e-4; Vulkan allows as much."""
    driver = created(precision.Column("swiftshader"))
    coarse = values(driver.context, "", "sin(x)", x=np.linspace(-3, 3, 100))
    assert np.abs(coarse - np.sin(np.linspace(-3, 3, 100))).max() > 1e-5
    functions = tuple(f for f in LIBRARY.functions if f.name.startswith("lobe_sample_"))
    outcome = stability.run(LIBRARY, (*functions, *LIBRARY.find("lobe_pdf_EON")), (driver,), 256, ("random", "policy"))
    assert outcome.passed, [row for row in outcome.rows if not row["pass"]]


def test_nothing_rests_on_built_in_trigonometry():
    loose = {"sin", "cos", "tan", "asin", "acos", "atan"}
    assert not {f.key for f in LIBRARY.functions if loose & set(re.findall(r"\w+(?=\s*\()", f.definition))}


@pytest.mark.full
@pytest.mark.parametrize("name", drivers.NAMES)
def test_a_driver_tells_a_shader_that_does_not_compile(name):
    driver = created(precision.Column(name))
    with pytest.raises(Exception, match="missing"):
        values(driver.context, "", "missing(x)", x=[1.0])
    assert values(driver.context, "", "2.0 * x", x=np.arange(3000)).tolist() == np.arange(0, 6000, 2).tolist()


def test_a_fault_is_not_explained_away(egl):
    (function,) = LIBRARY.find("lobe_sample_Beckmann")

    def wrong(source):
        return source.replace(function.definition, f"{function.signature} {{ return N; }}")

    def summary(name, log):
        driver = stability.Driver(name, egl, wrong)
        outcome = stability.run(LIBRARY, (function,), (driver,), 256, ("random",))
        builtins = {b.name: {name: log if b.name == "log" else 1.0} for b in precision.BUILTINS}
        return precision.summary(LIBRARY, (function,), outcome, (driver,), {}, builtins, 256)

    for name, log in (("softpipe", 1.0), ("egl", 1e3)):  # with a right logarithm; where all must hold
        assert precision.unexplained(summary(name, log)) and "FAIL" in precision.report(summary(name, log))
    spoilt = summary("softpipe", 1e3)
    assert not precision.unexplained(spoilt) and "the driver's own log" in precision.report(spoilt)


def test_built_in_functions_are_measured(egl):
    """Right to the last digits where the driver is, and far off where it is known to be."""
    units = {b.name: precision.builtin_units(egl, b) for b in precision.BUILTINS}
    print({name: f"{x:.3g}" for name, x in units.items()})
    assert units["1 / x"] < 3 and units["sqrt"] < 3
    assert {"log", "sqrt"} == precision.used_builtins(LIBRARY, LIBRARY.find("lobe_sample_Beckmann")[0])


@pytest.mark.full
def test_command_draws_the_matrix(tmp_path):
    done = subprocess.run([sys.executable, "-m", "lobe.lab", "stability", "--function", "lobe_sample_Lambert", "--context",
                           "all", "--points", "256", "--out", tmp_path, "--json", tmp_path / "r.json"],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "r.json").read_text())["precision"]
    assert set(found["columns"]) | set(found["missing"]) == {column.name for column in precision.COLUMNS}
    for name, why in found["missing"].items():
        assert f"not run: {name}: " in done.stdout and "install the package" in why
    page = (tmp_path / "stability.html").read_text()
    assert "What holds where" in page and "lobe_sample_Lambert" in page and "Half precision" in page


# --- the document


@pytest.mark.skipif(not precision.RESULTS.exists(), reason="not measured yet")
def test_document_is_up_to_date():
    text = precision.PAGE.read_text(encoding="utf-8")
    assert text == precision.markdown(json.loads(precision.RESULTS.read_text())), f"{REPAIR} --page-only"
    for link in re.findall(r"\]\(([^)#]+)", text):
        assert (precision.PAGE.parent / link).exists(), link


@pytest.mark.full
def test_document_has_every_function_and_column():
    found = json.loads(precision.RESULTS.read_text())
    labels = {LIBRARY.label(f) for f in LIBRARY.functions}
    assert set(found["functions"]) == set(found["half"]) == labels, REPAIR
    assert set(found["columns"]) == {column.name for column in precision.COLUMNS} and not found["missing"], REPAIR
