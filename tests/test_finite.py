"""Every finite input, in the domain or not, gives a finite result that is not negative."""

import numpy as np
import pytest

from lobe.lab import catalogue, gl, policy

LIBRARY = catalogue.load()


@pytest.mark.parametrize("function", [f for f in LIBRARY.functions if f.name.startswith("lobe_D_") and f.parameter("H")],
                         ids=lambda f: f.key)
def test_no_facet_lies_along_a_null_half_vector(function):
    inputs = {p.name: np.array(p.default if p.name != "H" else (0, 0, 0), np.float32)[None, None] for p in function.parameters}
    with gl.create_context("egl") as current:
        assert gl.evaluate(current, LIBRARY.text, function.call, function.result, inputs)[0, 0] == 0.0


@pytest.mark.parametrize("context", gl.CONTEXTS)
@pytest.mark.parametrize("function", LIBRARY.functions, ids=lambda f: f.key)
def test_finite_and_not_negative(function, context):
    bad = policy.unkept(function, gl.create_context(context), LIBRARY.text)
    assert not bad.any(), f"{int(bad.sum())} of {len(bad)}, first: " + str(
        {name: values[int(bad.argmax())].tolist() for name, values in policy.hostile(function).items()})
