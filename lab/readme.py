"""The generated part of README.md, from the headers and the measured results: python -m lobe.lab.readme."""

from __future__ import annotations

import json
import re

from . import catalogue, files, report
from .catalogue import Function
from .paths import ROOT

README = ROOT / "README.md"
RESULTS = ROOT / "benchmarks" / "results" / "compare.json"
COSTS = ROOT / "benchmarks" / "results" / "chart.json"
_FUZZ = re.compile(r"(<!-- fuzz -->).*?(<!-- /fuzz -->)", re.S)
_BLOCK = re.compile(r"(<!-- functions -->\n).*(<!-- /functions -->)", re.S)


def generated(text: str) -> str:
    """README's text with its table of functions, and the counts of damaged files, up to date."""
    return _FUZZ.sub(lambda m: m[1] + report.fuzz_line() + m[2], _BLOCK.sub(lambda m: m[1] + table() + m[2], text))


def table() -> str:
    library = catalogue.load()
    measured = json.loads(RESULTS.read_text())["functions"]
    costs = json.loads(COSTS.read_text())["functions"]
    lines = ["| function | what it is | worst error measured / allowed, units | cost, cycles |", "|---|---|---|---:|"]
    for file in library.files:
        for f in file.functions:
            lines.append(f"| {_call(f)} | {f.description} | {_error(measured.get(library.label(f)))} "
                         f"| {_cost(costs.get(f.key))} |")
    return "\n".join(lines) + "\n"


def _call(f: Function) -> str:
    return f"[`{f.name}({', '.join(p.name for p in f.parameters)})`](glsl/{f.stem}.glsl#L{f.line})"


def _error(row: dict | None) -> str:
    return f"{row['max_units']:.1f} / {row['units_allowed']}" if row else "not measured"


def _cost(row: dict | None) -> str:
    return f"{row['NAVI21']['inverse_throughput']}" if row else "not measured"


def main() -> None:
    files.write_text(README, generated(README.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main()
