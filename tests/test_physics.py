"""What physics and the models demand of the shaders' own values, whatever the formula: lab/physics.py measures it.
`pytest -rP` shows each error beside what is allowed."""


import pytest

from lobe.lab import catalogue, gl, identities, physics

LIBRARY = catalogue.load()


def over(functions):
    return pytest.mark.parametrize("function", list(functions), ids=lambda f: f.key)


@pytest.fixture(scope="module")
def shade():
    return physics.Shades(gl.create_context("egl"), LIBRARY.text)


def check(measure):
    worst = measure.worst
    error, allowed = measure.error[worst], measure.allowed[worst]
    print(f"error {error:.3g} of {allowed:.3g} allowed, ratio {measure.ratio[worst]:.2g}, seed {physics.SEED}")
    assert measure.passed, f"row {worst}: {error:.6g} > {allowed:.6g}"


@over(f for f in LIBRARY.functions if f.reciprocal)
def test_reciprocal(function, shade):
    if function.reciprocal == "yes":
        check(physics.reciprocity(function, shade))
    else:
        lack = physics.lack_of_reciprocity(function, shade)
        assert lack > 0.01, "the header says that it is not reciprocal, and it is"


@over(f for f in LIBRARY.functions if not f.returns_directions)
def test_not_negative_and_a_fraction_not_above_one(function, shade):
    assert (shade(function.call, function.result, physics.sample(function)) >= 0).all()
    if physics.is_fraction(function):
        check(physics.fraction(function, shade))
    if physics.is_cut_at_one(function):
        assert physics.excess(function, shade) == 0


@over(f for f in LIBRARY.functions if {"N", "V", "L"} <= {p.name for p in f.parameters})
def test_rotation_changes_nothing(function, shade):
    check(physics.rotation(function, shade))


@over(f for f in LIBRARY.functions if physics.is_monotone(f))
def test_schlick_does_not_grow_with_the_cosine(function, shade):
    check(physics.monotone(function, shade))


@pytest.mark.parametrize("first, other", physics.overload_pairs(LIBRARY), ids=lambda f: f.key)
def test_overloads_agree(first, other, shade):
    check(physics.overloads(first, other, shade))


@pytest.mark.parametrize("identity", physics.existing(LIBRARY, identities.LIMITS), ids=str)
def test_limit(identity, shade):
    check(physics.limit(LIBRARY, identity, shade))


@over(f for f in LIBRARY.functions if f.energy)
def test_energy(function, shade):
    if function.energy_bound is None:
        largest = physics.largest_albedo(function, shade)
        assert largest > 1 + physics.ALBEDO_ERROR, "the header says that it gains energy, and it does not"
    check(physics.energy(function, shade))


@pytest.mark.parametrize("identity", physics.existing(LIBRARY, identities.ALBEDOS), ids=str)
def test_albedo(identity, shade):
    check(physics.equal_albedo(LIBRARY, identity, shade))


@over(f for f in LIBRARY.functions if f.normalised)
def test_projected_area(function, shade):
    area = physics.projected_area(function, shade)
    if function.normalised == "yes":
        check(area)
    else:
        assert area.error.max() > 1e-3, "the header says that it is not normalised, and it is"


@over(f for f in LIBRARY.functions if physics.sees_visible_facets(LIBRARY, f))
def test_weak_white_furnace(function, shade):
    check(physics.weak_furnace(LIBRARY, function, shade))
