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
    return complaints(tmp_path, {"shader": text}, target).get("shader", "")


def complaints(tmp_path, texts, target):
    """glslang's complaints about fragment shaders, by name; one process for all, since its start costs most."""
    compiler = shutil.which("glslangValidator")
    assert compiler, "glslangValidator is missing: install the package glslang-tools"
    for name, text in texts.items():
        (tmp_path / f"{name}.frag").write_text(text + "\nvoid main() {}\n")
    # For Vulkan it would link all the shaders of one call.
    calls = [[name] for name in texts] if target == "vulkan" else [list(texts)]
    options = ["-V", "--target-env", "vulkan1.0"] if target == "vulkan" else []
    found = {}
    for names in calls:
        run = subprocess.run([compiler, *options, *(f"{name}.frag" for name in names)], capture_output=True, text=True,
                             cwd=tmp_path)
        said = re.split(r"^(\S+)\.frag\n", run.stdout, flags=re.M)
        said = dict(zip(said[1::2], said[2::2])) if len(names) > 1 else {names[0]: run.stdout}
        assert list(said) == names, f"glslang did not go through all the shaders: {run.stdout}"
        bad = {name: text for name, text in said.items() if "ERROR" in text}
        assert bool(run.returncode) == bool(bad), run.stdout
        found |= bad
    return found


@pytest.mark.parametrize("target", bundle.TARGETS)
def test_every_file_compiles_after_those_it_needs(tmp_path, target):
    def with_needed(stem):
        file = LIBRARY.file(stem)
        return [s for needed in file.needs for s in with_needed(needed)] + [stem]

    texts = {file.stem: bundle.TARGETS[target] + "".join(LIBRARY.file(stem).text for stem in with_needed(file.stem))
             for file in LIBRARY.files}  # repeated files test the guards too
    assert complaints(tmp_path, texts, target) == {}


@pytest.mark.parametrize("target", bundle.TARGETS)
def test_every_bundle_compiles(tmp_path, target):
    one_by_one = {name: [name] for name in NAMES}
    by_file = {file.stem: sorted({f.name for f in file.functions}) for file in LIBRARY.files if file.functions}
    groups = by_file if target == "vulkan" else one_by_one  # in Vulkan's GLSL they are the same but for the first line
    texts = {name: bundle.bundle(LIBRARY, names, target) for name, names in groups.items()}
    assert complaints(tmp_path, texts, target) == {}


def test_bundle_holds_nothing_that_is_not_needed(tmp_path):
    texts = {}
    for name in NAMES:
        text = bundle.bundle(LIBRARY, [name], "450")
        wanted = LIBRARY.find(name)
        for f in bundle.closure(LIBRARY, list(wanted)):
            if f not in wanted:
                texts[f"{name}-{len(texts)}-without-{f.name}"] = without = text.replace(f.definition, "")
                assert without != text
        for constant in re.findall(r"^const \w+ (\w+)", text, re.M):
            assert len(re.findall(rf"\b{constant}\b", text)) > 1, f"{constant} in the bundle of {name} is not used"
    assert texts.keys() - complaints(tmp_path, texts, "450").keys() == set(), "compiles all the same"


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
    with pytest.raises(InputError, match="unknown constant 'LOBE_F0_MITHRIL', did you mean LOBE_F0_[^ ]*\\?.*lobe list"):
        bundle.bundle(LIBRARY, ["LOBE_F0_MITHRIL"])
