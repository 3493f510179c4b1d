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
GPU = "NAVI21"
WHOLE = "lobe_GGX", "BRDF_GGX", "specularCookTorrance", "NDF, Schlick, G2"  # GGX, ours and as others ship it


def generated(text: str) -> str:
    """README's text with what stands between <!-- name --> and <!-- /name --> up to date."""
    for name, make in (("whole", whole), ("index", index), ("functions", table), ("fuzz", report.fuzz_line)):
        text = re.sub(rf"(<!-- {name} -->).*(<!-- /{name} -->)", lambda m: m[1] + make() + m[2], text, flags=re.S)
    return text


def whole() -> str:
    """Ours beside others' whole GGX: what it costs, and how wrong it is."""
    rows = [r for r in json.loads(COSTS.read_text())["results"]
            if r["chart"] == "specular" and r["device"] == f"isa:{GPU}"]
    lines = ["", "| GGX with masking and Fresnel | cycles for 64 pixels, RDNA2 | rms error | largest error | FLIP |",
             "|---|---:|---:|---:|---:|"]
    for row in (next(r for r in rows if r["function"] == name) for name in WHOLE):
        name = f"`{row['function']}`" if row["key"] else f"{row['source']}, `{row['function']}`"
        error = row["error"]
        lines.append(f"| {name} | {row['cost']['alike']} | {_percent(error['rms'])} | {_percent(error['max'])} "
                     f"| {error['image_flip']:.0e} |")
    return "\n".join(lines) + "\n"


def _percent(x: float) -> str:
    return f"{100 * x:.1g} %" if x < 0.001 else f"{100 * x:.2g} %"


def index() -> str:
    """A row for each file, with its whole lobes."""
    costs = json.loads(COSTS.read_text())["functions"]
    lines = ["", "| file | what it is | lobes, cycles | functions |", "|---|---|---|---:|"]
    for file in sorted(catalogue.load().files, key=lambda file: file.stem):
        lobes = ", ".join(f"`{f.name}` {_cost(costs.get(f.key))}" for f in file.functions if f.kind == "lobe")
        lines.append(f"| [{file.stem}](glsl/{file.stem}.glsl) | {file.description} | {lobes} "
                     f"| {len(file.functions) or 'constants'} |")
    return "\n".join(lines) + "\n"


def table() -> str:
    library = catalogue.load()
    measured = json.loads(RESULTS.read_text())["functions"]
    costs = json.loads(COSTS.read_text())["functions"]
    title = f"All {len(library.functions)} functions, with worst error and cost"
    lines = ["", "<details>", f"<summary>{title}</summary>", "",
             "| function | what it is | worst error measured / allowed, units | cost, cycles |", "|---|---|---|---:|"]
    for file in library.files:
        for f in file.functions:
            lines.append(f"| {_call(f)} | {f.description} | {_error(measured.get(library.label(f)))} "
                         f"| {_cost(costs.get(f.key))} |")
    return "\n".join([*lines, "", "</details>"]) + "\n"


def _call(f: Function) -> str:
    return f"[`{f.name}({', '.join(p.name for p in f.parameters)})`](glsl/{f.stem}.glsl#L{f.line})"


def _error(row: dict | None) -> str:
    return f"{row['max_units']:.1f} / {row['units_allowed']}" if row else "not measured"


def _cost(row: dict | None) -> str:
    return f"{row[GPU]['inverse_throughput']}" if row else "not measured"


def main() -> None:
    files.write_text(README, generated(README.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main()
