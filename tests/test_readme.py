"""README: its table is up to date, its code compiles, its commands are those of the command line."""

import json
import re
import shlex
import subprocess
import sys

import pytest

from lobe.lab import bundle, catalogue, readme
from lobe.lab.paths import ROOT

TEXT = readme.README.read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", TEXT, re.S)


def test_table_is_up_to_date():
    assert readme.generated(TEXT) == TEXT, "repair: .venv/bin/python -m lobe.lab.readme"


def test_every_function_was_measured_and_within_its_bound():
    measured = json.loads(readme.RESULTS.read_text())["functions"]
    library = catalogue.load()
    for f in library.functions:
        row = measured.get(library.label(f))
        assert row, f"{f.key} is not measured; repair: .venv/bin/python benchmarks/compare_time.py"
        assert row["units_allowed"] == f.units and row["max_units"] <= f.units, f.key


@pytest.mark.parametrize("code", [code for kind, code in BLOCKS if kind == "glsl"])
def test_code_compiles(tmp_path, code):
    used = sorted(set(re.findall(r"\b(lobe_\w+)\(", code)))
    shader = tmp_path / "readme.frag"
    shader.write_text(bundle.bundle(catalogue.load(), used, "300es") + code + "\nvoid main() {}\n")
    run = subprocess.run(["glslangValidator", str(shader)], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout


def test_commands_exist():
    lines = [line for kind, code in BLOCKS for line in code.splitlines() if "./lobe" in line]
    lines += [f"./lobe {c}" for c in re.findall(r"`\./lobe ([^`]*)`", TEXT)]
    for line in lines:
        words = shlex.split(line[line.index("./lobe"):], comments=True)[1:]
        help_text = subprocess.run([sys.executable, "-m", "lobe.lab", words[0], "--help"], capture_output=True, text=True).stdout
        assert "Usage" in help_text, line
        for option in (w for w in words if w.startswith("--")):
            assert option in help_text, line


def test_links_lead_somewhere():
    for name in ("README.md", "CONTRIBUTING.md"):
        for link in re.findall(r"\]\(([^)#]+)", (ROOT / name).read_text(encoding="utf-8")):
            assert (ROOT / link).exists(), f"{name}: {link}"
