"""The mutator edits what it says, its mutants are drawn as they would be alone, and verdicts are right."""

import json
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from lobe.lab import bundle, catalogue, compare, gl, judge, mutation, mutation_report
from lobe.lab.errors import InputError
from lobe.lab.together import Together

LIBRARY = catalogue.load()
ONE = "lobe_V_Kelemen(float)"


def find(key):
    (function,) = LIBRARY.find(key)
    return function


@pytest.fixture(scope="module")
def egl():
    return gl.create_context("egl")


def named(key, name):
    return next(m for m in mutation.mutants(LIBRARY, find(key)) if m.name == name)


# --- edits


def test_every_function_has_mutants_and_each_is_one_edit():
    kinds = set()
    for function in LIBRARY.functions:
        every = mutation.mutants(LIBRARY, function)
        assert every, function.key
        assert len({m.name for m in every}) == len({m.definition for m in every}) == len(every)
        assert all(m.definition != function.definition and m.applied(LIBRARY.text) != LIBRARY.text for m in every)
        kinds |= {m.kind for m in every}
    assert kinds == {"operator", "constant", "arguments", "component", "guard", "factor", "call", "sign", "comparison", "statement"}


def test_edits():
    """Of every kind, in a function whose text does not change with the library's."""
    text = """vec2 lobe_cosines(vec3 N, vec3 V, vec3 L, vec3 H) {
    vec2 c = vec2(dot(N, V), dot(N, L));
    if (dot(H, H) > 0.25) return c;  // no comment is edited: 1.0 + 2.0
    float s = clamp(abs(c.x), 0.0, 1.0) * LOBE_INV_PI;
    s *= -c.y;
    return s < 0.0 ? lobe_cosines(N, L, V, H) : c - s;
}"""
    names = {m.name for m in mutation.mutants(LIBRARY, replace(find("lobe_cosines(vec3,vec3,vec3,vec3)"), definition=text))}
    assert names >= {
        "(vec3 N, vec3 V, vec3 L, vec3 H) -> (vec3 N, vec3 L, vec3 V, vec3 H)",
        "vec2(dot(N, V), dot(N, L)) -> vec2(dot(N, L), dot(N, V))",
        "if (dot(H, H) > 0.25) return c; -> nothing",
        "dot(H, H) > 0.25 -> dot(H, H) >= 0.25", "dot(H, H) > 0.25 -> dot(H, H) < 0.25",
        "dot(H, H) > 0.25 -> dot(H, H) > 0.25025", "dot(H, H) > 0.25 -> dot(H, H) > 0.5",
        "clamp(abs(c.x), 0.0, 1.0) -> (abs(c.x))", "clamp(abs(c.x), 0.0, 1.0) -> max(abs(c.x), 0.0)",
        "abs(c.x) -> (c.x)", "abs(c.x) -> abs(c.y)",
        "clamp(abs(c.x), 0.0, 1.0) * LOBE_INV_PI -> clamp(abs(c.x), 0.0, 1.0) / LOBE_INV_PI",
        "clamp(abs(c.x), 0.0, 1.0) * LOBE_INV_PI -> clamp(abs(c.x), 0.0, 1.0)",
        "clamp(abs(c.x), 0.0, 1.0) * LOBE_INV_PI -> clamp(abs(c.x), 0.0, 1.0) * (LOBE_INV_PI * 2.0)",
        "s *= -c.y; -> nothing", "s *= -c.y -> s /= -c.y", "-c.y -> c.y",
        "s < 0.0 ? lobe_cosines(N, L, V, H) : c - s -> (c - s)",
        "lobe_cosines(N, L, V, H) -> lobe_cosines(N, V, L, H)",
        "c - s -> c + s", "c - s -> c", "c - s -> (s - (c))"}
    assert not any("comment" in name for name in names)


# --- many at once


@pytest.mark.parametrize("key", ["lobe_GGX(vec3,vec3,vec3,vec3,float)", "lobe_D_GGX(float,float)", "lobe_cosines(vec3,vec3,vec3,vec3)"])
def test_values_drawn_together_are_those_drawn_alone(key, egl):
    """Bit for bit, also of a call of an overloaded function that is itself mutated."""
    function = find(key)
    source = bundle.bundle(LIBRARY, [key])
    case = compare.points_case(function, 512, {}, seed=3)
    some = [m for m in mutation.mutants(LIBRARY, function) if Together(LIBRARY, function, egl).compiles(source, m.definition)][::9]

    def work(context):
        with context:
            return gl.evaluate(context, source, function.call, function.result, case.inputs)

    drawn = Together(LIBRARY, function, egl).run([m.definition for m in some], work)
    own = work(egl)
    different = 0
    for mutant, values in zip(some, drawn):
        with egl:
            alone = gl.evaluate(egl, mutant.applied(source), function.call, function.result, case.inputs)
        np.testing.assert_array_equal(values, alone, mutant.name)
        different += not np.array_equal(values, own)
    assert different > len(some) // 2


def test_who_is_found_wanting_leaves_the_others_in_step(egl):
    """Measurements of different lengths; an error in one is raised."""
    function = find(ONE)
    source, inputs = bundle.bundle(LIBRARY, [ONE]), {"LdotH": np.linspace(0.1, 1, 8, dtype=np.float32)[None, :, None]}
    definitions = [f"{function.signature} {{ return {x}.0; }}" for x in range(5)]

    def work(context):
        values = []
        for factor in (1, 2, 3):
            values += [float(gl.evaluate(context, source, f"{factor}.0 * {function.call}", "float", inputs)[0, 0])]
            if values[0] >= 3:
                break
        return values

    assert Together(LIBRARY, function, egl).run(definitions, work) == [[0, 0, 0], [1, 2, 3], [2, 4, 6], [3], [4]]
    with pytest.raises(ZeroDivisionError):
        Together(LIBRARY, function, egl).run(definitions, lambda context: 1 / 0)


# --- verdicts


@pytest.fixture(scope="module")
def measured(egl):
    return mutation.measure(LIBRARY, find(ONE), egl, points=1 << 12)


def test_verdicts(measured):
    """Of 1 / (4 max(LdotH^2, least)): wrong values are killed, a guard that no input needs is equivalent."""
    names = {m.name for m in mutation.mutants(LIBRARY, find(ONE))}
    alive = {*measured["equivalent"], *(s["mutant"] for s in measured["survivors"])}
    assert alive < names and measured["mutants"] == len(names)
    assert measured["stillborn"] + sum(measured["killed"].values()) + len(alive) == len(names)
    assert sum(measured["killed"].values()) > 3 and len(measured["equivalent"]) > 0
    assert not any("0.25" in name for name in alive), "the factor may not be anything"


def test_judge_acquits_the_library_and_finds_a_fault(egl):
    function = find("lobe_V_Kelemen(vec3,vec3)")
    own = judge.Judge(LIBRARY, function)
    checks = dict(own.checks(egl))
    assert all(checks.values()) and {"points", "near singular sets", "finite and not negative", "overloads agree"} <= set(checks)
    assert "cases kelemen" in checks
    wrong = [f"{function.signature} {{ return 0.5 / max(1.0 + dot(V, L), 1e-30); }}"]
    assert Together(LIBRARY, function, egl).run(wrong, own.fault) == ["points"]


def test_what_does_not_compile_is_stillborn(egl):
    together = Together(LIBRARY, find(ONE), egl)
    source = bundle.bundle(LIBRARY, [ONE])
    assert together.compiles(source, find(ONE).definition)
    assert not together.compiles(source, find(ONE).definition.replace("return", "return vec2(1.0) +"))


def test_a_caller_of_the_function_is_its_judge_too():
    assert {f.name for f in mutation.callers(LIBRARY, find(ONE))} == set()
    assert "lobe_Beckmann" in {f.name for f in mutation.callers(LIBRARY, LIBRARY.find("lobe_H")[0])}


def test_score():
    row = {"function": "f", "units": 8, "inputs": 1, "mutants": 10, "stillborn": 1, "killed": {"points": 6}, "equivalent": ["a"],
           "survivors": [{"mutant": "b", "change": 2.0, "error": 3.0}, {"mutant": "c", "change": 2.0, "error": 3.0}]}
    total = mutation.totals([row])
    assert total["score"] == 0.75 and total["argued"] == 0 and not mutation.passed([row], whole=False)
    argued = mutation.argued([row], {("f", "b"): "x", ("f", "c"): "y"})
    assert mutation.passed(argued, whole=False) and not mutation.passed(argued, whole=True)


# --- arguments


def test_arguments_are_of_mutants_that_exist():
    assert all(text for text in mutation.arguments(LIBRARY).values())


@pytest.mark.parametrize("line, message", [
    ("lobe_alpha(float): r * r -> r + r | because", "has no mutant 'r * r -> r + r'"),
    ("lobe_none(float): r * r -> r | because", "has no mutant"),
    ("lobe_alpha(float): r * r -> r", "expected 'lobe_name(type,...): mutant | argument'"),
])
def test_an_argument_for_nothing_is_an_error(line, message, tmp_path):
    path = tmp_path / "survivors.txt"
    path.write_text(f"# comment\n\n{line}\n")
    with pytest.raises(InputError, match=re.escape(f"{path}:3: ") + ".*" + re.escape(message)):
        mutation.arguments(LIBRARY, path)


# --- the command, the document


def lobe(*arguments):
    return subprocess.run([sys.executable, "-m", "lobe.lab", *map(str, arguments)], capture_output=True, text=True)


def test_command_goes_on_where_it_was(tmp_path):
    asked = ("mutate", "--function", ONE, "--points", 4096, "--out", tmp_path, "--json", tmp_path / "m.json")
    done = lobe(*asked)
    assert done.returncode in (0, 1) and ONE in done.stdout, done.stderr
    (row,) = json.loads((tmp_path / "m.json").read_text())["results"]
    kept = tmp_path / "mutation" / "lobe-V-Kelemen-float.json"
    changed = json.loads(kept.read_text())
    assert changed["result"]["killed"] == row["killed"]
    changed["result"]["killed"] = {"points": 12345}
    kept.write_text(json.dumps(changed))
    assert "12345" in lobe(*asked).stdout
    for other in ("text", "suite"):
        kept.write_text(json.dumps(changed | {other: "another"}))
        assert "12345" not in lobe(*asked).stdout
    changed["result"]["equivalent"] = changed["result"]["equivalent"][1:]
    changed["result"]["survivors"] = [{"mutant": row["equivalent"][0], "change": 12345.0, "error": None}]
    kept.write_text(json.dumps(changed | {"suite": "another"}))
    assert "changes 1.2e4 units" in lobe(*asked).stdout, "what a mutant changes does not depend on the suite"
    kept.write_text(json.dumps(changed | {"text": "another"}))
    assert "changes 1.2e4 units" not in lobe(*asked).stdout


@pytest.mark.parametrize("function, message", [("lobe_nothing", "unknown function 'lobe_nothing'"), ("metals", "holds constants only")])
def test_command_refuses_what_has_no_mutants(function, message, tmp_path):
    done = lobe("mutate", "--function", function, "--out", tmp_path)
    assert done.returncode == 2 and message in done.stderr and done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


REPAIR = "repair: .venv/bin/python -m lobe.lab.mutation_report"


def test_document_is_up_to_date():
    found = json.loads(mutation_report.RESULTS.read_text())
    text = mutation_report.PAGE.read_text(encoding="utf-8")
    assert text == mutation_report.markdown(found), REPAIR
    assert found["total"] == mutation.totals(found["results"])


@pytest.mark.full
def test_document_has_every_function_and_the_suite_is_strong_enough():
    found = json.loads(mutation_report.RESULTS.read_text())
    assert [r["function"] for r in found["results"]] == [f.key for f in LIBRARY.functions]
    assert found["inputs"] == judge.WHOLE_POINTS and mutation.passed(found["results"], whole=True)
