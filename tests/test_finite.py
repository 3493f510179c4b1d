"""Every finite input, in the domain or not, gives a finite result that is not negative."""

import itertools

import numpy as np
import pytest

from lobe.lab import catalogue, gl

LIBRARY = catalogue.load()
SCALARS = [0.0, -0.0, 1e-45, -1e-45, 1e-38, 1e-20, 1e-8, 1e-4, 0.5, 1 - 2**-24, 1.0, 1 + 2**-23, 1.022, 1.5, 4.0, 1e4,
           1e9, 1e20, 1e30, 3.4e38, -1e-20, -1e-6, -0.5, -1.0, -1.5, -1e9, -3.4e38]
DIRECTIONS = [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, 0, 0.8), (-0.6, 0, 0.8), (0.6, 0, -0.8), (0, 0, 0), (1e-20, 0, 1),
              (1e-4, 0, 1), (0, 0, 1 + 1e-4), (0.70710677, 0.70710677, 0), (1e-30, 1e-30, 1e-30), (3e4, -2e4, 1e4)]
VECTORS = [(x,) * 3 for x in SCALARS[::2]] + [(0.04, 1.022, 0.0), (-1.0, 0.5, 3.4e38)]
COUNT = 1 << 15


def hostile(function, seed=5):
    """Rows of hostile values: all combinations where they are few, random ones where they are many."""
    choices = [np.array(DIRECTIONS if p.kind in ("direction", "half") else SCALARS if p.width == 1 else VECTORS,
                        np.float32).reshape(-1, p.width) for p in function.parameters]
    if np.prod([float(len(c)) for c in choices]) <= COUNT:
        index = np.array(list(itertools.product(*(range(len(c)) for c in choices)))).T
    else:
        index = [np.random.default_rng(seed).integers(0, len(c), COUNT) for c in choices]
    return {p.name: c[i][None] for p, c, i in zip(function.parameters, choices, index)}


@pytest.mark.parametrize("function", [f for f in LIBRARY.functions if f.name.startswith("lobe_D_") and f.parameter("H")],
                         ids=lambda f: f.key)
def test_no_facet_lies_along_a_null_half_vector(function):
    inputs = {p.name: np.array(p.default if p.name != "H" else (0, 0, 0), np.float32)[None, None] for p in function.parameters}
    with gl.create_context("egl") as current:
        assert gl.evaluate(current, LIBRARY.text, function.call, function.result, inputs)[0, 0] == 0.0


@pytest.mark.parametrize("context", gl.CONTEXTS)
@pytest.mark.parametrize("function", LIBRARY.functions, ids=lambda f: f.key)
def test_finite_and_not_negative(function, context):
    inputs = hostile(function)
    with gl.create_context(context) as current:
        got = gl.evaluate(current, LIBRARY.text, function.call, function.result, inputs)
    bad = ~np.isfinite(got) if function.returns_directions else ~(np.isfinite(got) & (got >= 0))
    row = int(bad.any(-1).argmax())
    assert not bad.any(), f"{int(bad.any(-1).sum())} of {len(got)}, first: " + str(
        {name: values[0, row].tolist() for name, values in inputs.items()} | {"result": got[row].tolist()})
