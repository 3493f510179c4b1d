"""The errors that the documents state of each function, as bounds: whoever makes a function worse must measure again.

README's table states the largest error at points of the domain, docs/stability.md that near singular sets, each measured at
far more inputs than a test has time for, on one driver; others are held to the header's tolerance alone.
"""

from __future__ import annotations

import json
from functools import cache

from . import gl
from .paths import ROOT

RESULTS = ROOT / "benchmarks" / "results"
WORSE = 2.0  # times the documented error, and it has to be measured again: the largest of a few inputs is a matter of luck


def at_points(label: str, context: gl.Context) -> float:
    """The largest error over the allowed one at points of the domain; no more than 1."""
    row = _read("compare.json", context).get(label)
    return min(WORSE * row["max_units"] / row["units_allowed"], 1.0) if row else 1.0


def near_singular_sets(label: str, context: gl.Context) -> float:
    """The same near singular sets."""
    row = _read("stability.json", context).get(label)
    return min(WORSE * row["worst"]["random"], 1.0) if row else 1.0


def _read(name: str, context: gl.Context) -> dict[str, dict]:
    """Functions' rows of a file of results; none if they were measured elsewhere."""
    measured = _content(name)
    here = any(context.renderer in renderer and renderer.startswith(context.name) for renderer in measured["renderers"])
    return measured["functions"] if here else {}


@cache
def _content(name: str) -> dict:
    path = RESULTS / name
    return json.loads(path.read_text()) if path.exists() else {"renderers": [], "functions": {}}
