"""Every finite input, in the domain or not, gives a finite result that is not negative."""

import numpy as np
import pytest

from lobe.lab import bundle, catalogue, compare, gl, policy, stability

LIBRARY = catalogue.load()
POINTS = 1 << 12


@pytest.fixture(scope="module")
def egl():
    return gl.create_context("egl")


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


def test_every_value_of_the_lists_is_tried():
    (D,), (circle,) = LIBRARY.find("lobe_D_GGX(float,float)"), LIBRARY.find("lobe_circle(float)")
    values = set(np.float32(policy.SCALARS))
    assert set(policy.hostile(D)["alpha"][:, 0]) == set(policy.hostile(circle)["u"][:, 0]) == values


# Found, each with what had divided by next to nothing
NOT_FINITE = {
    "lobe_sample_Phong": {"N": (0, 0, -1), "T": (0.6, 0, 0.8), "V": (3e4, -2e4, 1e4), "exponent": (1.022,), "u": (0.5, 0.5)},
    "lobe_sample_GGX_aniso": {"N": (0, 0, 1), "T": (1e-20, 0, 1), "V": (1, 0, 0), "alphaX": (1 - 2**-24,), "alphaY": (1e-8,),
                              "u": (-1, 0.5)},
}


@pytest.mark.parametrize("name", NOT_FINITE)
def test_what_was_not_finite_is(name, egl):
    (function,) = LIBRARY.find(name)
    with egl:
        got = gl.evaluate(egl, LIBRARY.text, function.call, function.result,
                          {n: np.float32(x)[None, None] for n, x in NOT_FINITE[name].items()})
    assert np.isfinite(got).all()


@pytest.mark.parametrize("function", LIBRARY.functions, ids=lambda f: f.key)
def test_no_guard_repairs_a_nan(function, egl):
    """A compiler may assume that there is none, and delete the guard."""
    text = bundle.bundle(LIBRARY, [function.key])
    near = stability.random_case(function, 256 if compare.is_quadrature(function) else POINTS, stability.SEED).inputs
    hostile = {name: x[None] for name, x in policy.hostile(function).items()}
    for inputs in (near, hostile):
        bad = policy.repaired(function, egl, text, inputs)
        assert not bad.any(), {name: x[0, int(bad.argmax())].tolist() for name, x in inputs.items()}


def test_a_repaired_nan_is_found(egl):
    (function,) = LIBRARY.find("lobe_F_dielectric(float,float)")
    text = LIBRARY.text.replace("sqrt(max(m + c * c, 0.0))", "sqrt(m + c * c)")
    inputs = {name: np.float32(x).reshape(1, 1, 1) for name, x in (("cosI", 0.1), ("eta", 0.5))}
    assert text != LIBRARY.text and policy.repaired(function, egl, text, inputs).all()
    assert not policy.repaired(function, egl, LIBRARY.text, inputs).any()
