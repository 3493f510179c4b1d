"""What `lobe mutate` shows: a table for the terminal, and docs/mutation.md.

    ./lobe mutate --jobs 2 --json benchmarks/results/mutation.json && .venv/bin/python -m lobe.lab.mutation_report

measures all functions and writes docs/mutation.md from the measured file.
"""

from __future__ import annotations

import datetime
import json
from collections import Counter

from . import catalogue, files, mutation
from .paths import ROOT
from .report import aligned, environment, number

PAGE = ROOT / "docs" / "mutation.md"
RESULTS = ROOT / "benchmarks" / "results" / "mutation.json"


def measured(results: list[dict], renderer: str, points: int) -> dict:
    """What --json holds."""
    return {"schema": 1, "date": datetime.date.today().isoformat(), "renderer": renderer, "inputs": points,
            "total": mutation.totals(results), "results": results}


def killed(row: dict) -> int:
    return sum(row["killed"].values())


def score(row: dict) -> str:
    """Of one function or of all; a dash where no mutant could be killed."""
    kills = row["killed"] if isinstance(row["killed"], int) else killed(row)
    living = row["survivors"] if isinstance(row["survivors"], int) else len(row["survivors"])
    return f"{100 * kills / (kills + living):.1f} %" if kills + living else "-"


def _units(x: float | None) -> str:
    """A figure of units; JSON has no infinity, and says None."""
    return "∞" if x is None or x == float("inf") else number(x, 2)


def summary(results: list[dict]) -> str:
    """A table for the terminal: one line per function, then the survivors without an argument."""
    header = ("function", "mutants", "stillborn", "equivalent", "killed", "survivors", "score")
    lines = [(r["function"], *map(str, (r["mutants"], r["stillborn"], len(r["equivalent"]), killed(r), len(r["survivors"]))), score(r))
             for r in results]
    total = mutation.totals(results)
    lines.append((f"{total['functions']} in all", *(str(total[name]) for name in header[1:-1]), score(total)))
    open_ones = [f"{r['function']}: {s['mutant']} | changes {_units(s['change'])} units, error {_units(s['error'])} of {r['units']}"
                 for r in results for s in r["survivors"] if not s["argument"]]
    verdict = f"{len(open_ones)} survivors without an argument in {mutation.ARGUMENTS.name}" if open_ones else "every survivor is argued"
    return "\n".join((*aligned([header, *lines], right=range(1, 7)), "", *open_ones, verdict))


def _kind(check: str) -> str:
    """What a check that kills is one of."""
    if check in ("points", "near singular sets", "finite and not negative", "no NaN on the way", "documented error"):
        return {"points": "points over the domain", "documented error": "the error that the documents state"}.get(check, check)
    if check.startswith(("points of ", "near singular sets of ", "documented error of ")):
        return "values of a caller"
    if check.startswith("cases "):
        return "exact cases"
    demanded = " == " in check or check in ("reciprocity", "rotation", "overloads agree", "not above 1", "1 at most", "no growth with the cosine")
    return "symmetries, limits and identities" if demanded else "the policy for degenerate inputs"


def markdown(found: dict) -> str:
    """docs/mutation.md, from benchmarks/results/mutation.json."""
    stems = {f.key: f.stem for f in catalogue.load().functions}
    checks = Counter()
    for row in found["results"]:
        for check, count in row["killed"].items():
            checks[_kind(check)] += count
    by_stem = {stem: [r for r in found["results"] if stems.get(r["function"]) == stem] for stem in dict.fromkeys(stems.values())}
    return environment().overlay(autoescape=False).get_template("mutation.md.j2").render(
        m=found, killed=killed, score=score, units=_units, checks=checks.most_common(), typo=mutation.TYPO, required=mutation.REQUIRED, of=len(stems),
        stems={stem: rows for stem, rows in by_stem.items() if rows})


def main() -> None:
    files.write_text(PAGE, markdown(json.loads(RESULTS.read_text())))


if __name__ == "__main__":
    main()
