"""Bundles hold exactly what is needed, and with every file of the library compile strictly for every target."""

import re
import shutil
import subprocess

import pytest

from lobe.lab import bundle, catalogue
from lobe.lab.errors import InputError

LIBRARY = catalogue.load()
NAMES = sorted({f.name for f in LIBRARY.functions})


def compiles(tmp_path, text, target):
    """glslang's complaint about a fragment shader of this text, '' where there is none."""
    compiler = shutil.which("glslangValidator")
    assert compiler, "glslangValidator is missing: install the package glslang-tools"
    shader = tmp_path / "shader.frag"
    shader.write_text(text + "\nvoid main() {}\n")
    options = ["-V", "--target-env", "vulkan1.0"] if target == "vulkan" else []
    run = subprocess.run([compiler, *options, str(shader)], capture_output=True, text=True, cwd=tmp_path)
    return run.stdout if run.returncode else ""


@pytest.mark.parametrize("target", bundle.TARGETS)
def test_every_file_compiles_after_those_it_needs(tmp_path, target):
    def with_needed(stem):
        file = LIBRARY.file(stem)
        return [s for needed in file.needs for s in with_needed(needed)] + [stem]

    for file in LIBRARY.files:
        text = "".join(LIBRARY.file(stem).text for stem in with_needed(file.stem))  # repeated files test the guards too
        assert compiles(tmp_path, bundle.TARGETS[target] + text, target) == "", file.stem


@pytest.mark.parametrize("target", bundle.TARGETS)
def test_every_bundle_compiles(tmp_path, target):
    for name in NAMES:
        assert compiles(tmp_path, bundle.bundle(LIBRARY, [name], target), target) == "", name


@pytest.mark.parametrize("name", NAMES)
def test_bundle_holds_nothing_that_is_not_needed(tmp_path, name):
    text = bundle.bundle(LIBRARY, [name], "450")
    wanted = LIBRARY.find(name)
    for f in bundle.closure(LIBRARY, list(wanted)):
        if f not in wanted:
            without = text.replace(f.definition, "")
            assert without != text and compiles(tmp_path, without, "450"), f"{f.key} is not needed by {name}"
    for constant in re.findall(r"^const \w+ (\w+)", text, re.M):
        assert len(re.findall(rf"\b{constant}\b", text)) > 1, f"{constant} is not used"


def test_constants_are_bundled_by_name(tmp_path):
    for target in bundle.TARGETS:
        text = bundle.bundle(LIBRARY, ["LOBE_F0_GOLD", "LOBE_K_GOLD"], target)
        assert compiles(tmp_path, text, target) == ""
        assert re.findall(r"^const \w+ (\w+)", text, re.M) == ["LOBE_F0_GOLD", "LOBE_K_GOLD"] and "lobe_" not in text
    mixed = bundle.bundle(LIBRARY, ["lobe_F_Schlick", "LOBE_F0_GOLD"])
    assert LIBRARY.constants["LOBE_F0_GOLD"] in mixed
    assert mixed.endswith(bundle.bundle(LIBRARY, ["lobe_F_Schlick"]).partition("\n")[2])


def test_bundle_in_other_stages(tmp_path):
    text = bundle.bundle(LIBRARY, ["lobe_GGX"], "450") + "\nvoid main() {}\n"
    for stage in ("vert", "frag", "comp"):
        (tmp_path / f"s.{stage}").write_text(text)
        assert not subprocess.run(["glslangValidator", str(tmp_path / f"s.{stage}")], capture_output=True).returncode


def test_missing_file_is_named_by_the_shader(tmp_path):
    for file in LIBRARY.files:
        if file.needs:
            complaint = compiles(tmp_path, "#version 450\n" + file.text, "450")
            assert f"{file.stem}.glsl needs {file.needs[0]}.glsl: put {file.needs[0]}.glsl before it" in complaint


def test_no_forbidden_constructs():
    for file in LIBRARY.files:
        code = re.sub(r"//.*", "", file.text)
        for word in (r"#include", r"\buniform\b", r"\bmain\b", r"\bprecision\b", r"\bdouble\b", r"\bisnan\b", r"\bisinf\b", "__"):
            assert not re.search(word, code), f"{file.stem}.glsl has {word}"
        integers = re.findall(r"(?<![eE.\w])[=*+/(,<>-] *(\d+)(?![\w.])", re.sub(r"\[\d+\]|#define LOBE_VERSION|\bint \w+ = \d+", "", code))
        assert not integers, f"{file.stem}.glsl has literals without a dot: {integers}"


def test_unknown_target_function_and_constant():
    with pytest.raises(InputError, match="--target 440: expected one of 330, 410"):
        bundle.bundle(LIBRARY, ["lobe_GGX"], "440")
    with pytest.raises(InputError, match="unknown function"):
        bundle.bundle(LIBRARY, ["lobe_Nothing"])
    with pytest.raises(InputError, match="unknown constant 'LOBE_F0_MITHRIL': expected one of .*LOBE_F0_GOLD"):
        bundle.bundle(LIBRARY, ["LOBE_F0_MITHRIL"])
