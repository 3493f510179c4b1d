"""What the comparison accepts beside the reference's own value: the far side of a jump, near to it."""

import numpy as np
import pytest

from lobe.lab import catalogue, compare, domain, geometry

COUNT = 1 << 14
NEAR = 2.0**-24  # a cosine so small is a matter of rounding


def below_the_horizon(function):
    """Inputs whose NdotL is a rounding below 0, and what the function is where it is a rounding above."""
    rng = np.random.default_rng(1)
    inputs = domain.sample(function, COUNT, seed=5)
    N = geometry.normalize(inputs["N"].astype(float))
    t = rng.normal(size=N.shape)
    inputs["L"] = geometry.normalize(t - N * geometry.dot(N, t)).astype(np.float32)
    cosine = geometry.dot(N, inputs["L"].astype(float))
    kept = np.flatnonzero((cosine < 0) & (cosine > -NEAR) & (geometry.dot(N, inputs["V"].astype(float)) > 0))[:100]
    inputs = {name: x[kept][None] for name, x in inputs.items()}
    risen = inputs | {"L": inputs["L"] + N[kept] * (rng.uniform(0, NEAR, (len(kept), 1)) - cosine[kept])}
    return inputs, compare.reference_values(function, risen, None).value


@pytest.mark.parametrize("name", ["lobe_Lambert", "lobe_GGX", "lobe_GGX_Kelemen"])
def test_the_other_side_of_the_horizon_is_undecided_and_no_other_value(name):
    (function,) = catalogue.load().find(name)
    inputs, above = below_the_horizon(function)
    case = compare.Case(function, "", "points", inputs, None, compare.reference_values(function, inputs, None))
    assert len(above) == 100 and not case.reference.value.any() and above.any(-1).all()

    def excused(got):
        failed = compare.units_of(got, case.reference) > function.units
        return compare._undecided(case, got, failed, function.units)[failed].mean()

    assert excused(above.astype(np.float32)) == 1
    assert excused((1.5 * above).astype(np.float32)) < 0.1


def test_tiny_references_need_no_digits_but_zero_needs_zero():
    value = np.array([0.0, 0.0, 0.0, 4e-31, 4e-31, 4e-31, 1.0])
    unit = np.array([0.0, 0.0, 0.0, 4e-38, 4e-38, 4e-30, 1e-7])
    got = np.array([2e-30, 1e-29, -1e-40, 1.9e-30, 2.1e-30, 2.1e-30, np.nan])
    units = compare.units_of(got, compare.Values(value, unit, unit))
    assert units[[0, 3]].max() == 0 and np.isinf(units[[1, 2, 6]]).all() and units[4] > 1e6 and units[5] < 1


@pytest.mark.parametrize("distance, near", [(2.0**-23, True), (2.0**-19, False)])
def test_near_a_pole_every_azimuth_is_undecided_and_no_other_value(distance, near):
    """A grows from sqrt(p), where H lies along T as here, to 1 / sqrt(p), a hundred times as much."""
    (function,) = catalogue.load().find("lobe_Schlick_directional")
    given = {"N": (0, 0, 1), "T": (1, 0, 0), "V": (0.6, 0, 0.8), "L": (2 * distance - 0.6, 0, 0.8), "f0": (0.5,) * 3,
             "r": 0.1, "p": 0.01}
    inputs = {name: np.float32(x).reshape(1, 1, -1) for name, x in given.items()}
    case = compare.Case(function, "", "points", inputs, None, compare.reference_values(function, inputs, None))
    for part, excused in ((20, near), (90, near), (110, False)):
        got = (part * case.reference.value).astype(np.float32)
        failed = compare.units_of(got, case.reference) > function.units
        assert failed.all() and compare._undecided(case, got, failed, function.units).all() == excused, part
