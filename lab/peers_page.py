"""The generated part of docs/peers.md, from benchmarks/results/peers.json: python -m lobe.lab.peers_page."""

from __future__ import annotations

import json
import re

import numpy as np

from . import files, peers_measured
from .paths import ROOT
from .peers import GIVEN, OURS
from .peers_measured import cycles

PAGE = ROOT / "docs" / "peers.md"
RESULTS = ROOT / "benchmarks" / "results" / "peers.json"
FAMILIES = ("fresnel", "distribution", "masking", "diffuse", "power", "specular", "albedo")
_BLOCK = re.compile(r"(<!-- (\w+) -->\n).*?(<!-- /\2 -->)", re.S)


def generated(text: str) -> str:
    """The page's text with its tables up to date."""
    result = json.loads(RESULTS.read_text())
    tables = {"packages": _packages, "wrong": _wrong, "units": _units, "grey": _grey, "families": _families,
              "ahead": _ahead}
    return _BLOCK.sub(lambda m: m[1] + tables[m[2]](result) + m[3], text)


def _table(header: str, rows) -> str:
    rule = "|" + "---|" * header.count("|")
    return "\n".join((f"| {header} |", rule + "---|", *(f"| {' | '.join(row)} |" for row in rows))) + "\n"


def _name(row: dict) -> str:
    return f"**Lobe** `{row['function']}`" if row["origin"] == OURS else f"{row['origin']} `{row['function']}`"


def _number(x: float) -> str:
    return f"{x:.1e}" if 0 < abs(x) < 1e-2 or abs(x) >= 1e4 else f"{x:.3g}"


def _packages(result: dict) -> str:
    found = ((f"[{name}]({p['home']})", p["version"], p["licence"]) for name, p in result["packages"].items())
    return _table("library | version | licence", found) + (
        f"\nMeasured on {result['date']}: errors on {result['renderer']}, costs by {result['compiler']}.\n")


def _wrong(result: dict) -> str:
    found = []
    for row in result["results"]:
        judged = row["highlights"] or row["error"]
        if row["origin"] == OURS or row["right"] and not row["note"].startswith("f90") and not judged["nonfinite"]:
            continue
        found.append((_name(row), f"{100 * judged['off']:.2g} %", str(judged["nonfinite"] or ""),
                      _worst(judged["worst"]), row["note"]))
    return _table("function | off at | not finite at | worst input | what it is", found)


def _worst(worst: dict) -> str:
    """The input with cosines in place of vectors, and the values there."""
    x = dict(worst["inputs"])
    vectors = {n: np.array(x.pop(n)) for n in ("N", "H", "V", "L") if n in x}
    cosines = {f"{a}dot{b}": [vectors[a] @ vectors[b] / np.linalg.norm(vectors[a]) / np.linalg.norm(vectors[b])]
               for a, b in ("NV", "NL", "LV", "NH") if a in vectors and b in vectors}
    numbers = cosines | {n: value for n, value in x.items() if n not in (*GIVEN, *cosines) or n == "NdotH"}
    inputs = ", ".join(f"{n} {', '.join(f'{v:.5g}' for v in value)}" for n, value in numbers.items())
    got = "not finite" if worst["got"] is None else f"{worst['got']:.4g}"
    return f"{inputs}: {got}, exact {worst['exact']:.4g}"


def _units(result: dict) -> str:
    found = ((_name(row), row["units"] or "f", f"{row['white']:.3f}") for row in result["results"] if row["white"])
    return _table("function | its value, f in 1/sr | most that a white surface gives back", found)


def _grey(result: dict) -> str:
    found = [(_name(r), *(str(cycles(r, gpu, "grey")) for gpu in r["cost"]), *(
        _number(peers_measured.accuracy(r, k)) for k in ("rms", "p99")), r["formula"])
        for r in result["results"] if r["highlights"]]
    gpus = " | ".join(f"{gpu}, cycles" for gpu in result["results"][0]["cost"])
    return _table(f"lobe | {gpus} | rms error | 99 % within | ", found)


def _families(result: dict) -> str:
    text = ""
    for family in FAMILIES:
        rows = sorted((r for r in result["results"] if r["family"] == family),
                      key=lambda r: (r["like"], r["origin"] != OURS, cycles(r)))
        found = [(_name(r), f"{cycles(r, setting='shipped')}", f"{cycles(r)}",
                  _number(peers_measured.accuracy(r)), _number(peers_measured.accuracy(r, "max")),
                  "right" if r["right"] else "**wrong**") for r in rows]
        text += f"\n### {family}\n\n" + _table("function | shipped | same guards | rms | max | ", found)
    return text


def _ahead(result: dict) -> str:
    found = [(_name(peer), str(cycles(peer)), _number(peers_measured.accuracy(peer)), _name(mine), str(cycles(mine)),
              _number(rms)) for peer, mine, rms in peers_measured.ahead(result["results"])]
    return _table("peer | cycles | rms | ours | cycles | rms", found) if found else "None.\n"


def main() -> None:
    files.write_text(PAGE, generated(PAGE.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main()
