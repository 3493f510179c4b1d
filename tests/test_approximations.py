"""An approximation stays within the error that its header states, and reaches at least a third of it: no bound is a guess."""

import numpy as np
import pytest

from lobe import reference
from lobe.lab import catalogue, compare, domain, gl

LIBRARY = catalogue.load()
APPROXIMATIONS = [f for f in LIBRARY.functions if f.approximation]
RESOLVED = {"alpha": (0.01, 4.0)}  # below, what the approximation leaves out is a spike that no grid finds


def exact_function(function):
    """The key whose reference an approximation stands for."""
    name = function.approximation.name
    return function.key if name == catalogue.EXACT else next(
        f.key for f in LIBRARY.find(name) if [p.type for p in f.parameters] == [p.type for p in function.parameters])


@pytest.mark.parametrize("function", APPROXIMATIONS, ids=lambda f: f.key)
def test_error_is_the_stated_one(function, capsys):
    stated = function.approximation
    key = exact_function(function)
    slow = next(f for f in reference.functions() if f.key == key).is_quadrature
    inputs = domain.sample(function, 1 << (12 if slow else 17), seed=11)
    for name, (low, high) in RESOLVED.items():
        if name in inputs:
            inputs[name] = np.clip(inputs[name], low, high)
    inputs = {name: x[None] for name, x in inputs.items()}
    with gl.create_context("egl") as context:
        got = gl.evaluate(context, LIBRARY.text, function.call, function.result, inputs)
    want = reference.evaluate(key, compare.rows(function, inputs))
    kappa = 0.0 if slow else reference.condition(key, compare.rows(function, inputs))
    rounding = function.units * compare.FLOAT32_ROUNDOFF * (1 + kappa) * np.abs(want)
    scale = np.maximum(np.abs(want), 1e-30) if stated.is_relative else 1.0
    worst = float(((np.abs(got - want) - rounding) / scale).max())
    with capsys.disabled():
        print(f"\n{function.key}: error {worst:.3g} of {stated.bound:.3g} stated", end="")
    assert stated.bound / 3 <= worst <= stated.bound
