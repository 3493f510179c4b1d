"""The reference against its three witnesses: 50 digits, published numbers, and integrals that physics fixes.

A new function needs no line here. It is compared as soon as oracle.py has an entry for it.
"""
import math

import numpy as np
import pytest
from lobe import reference

from oracle import ORACLE, Lambda_GGX, mp, mpf
from sampling import DIRECTIONS, adversarial_rows

SEED = 20260
ROWS = 500
REFERENCE_ROUNDOFF = 2.0**-40  # the reference is held to it times 1 + kappa
ABSOLUTE_FLOOR = 1e-30
LARGEST_BINARY32 = 3.4e38

FUNCTIONS = {f.key: f for f in reference.functions()}


def evaluate(key, rows):
    return reference.evaluate(key, np.ascontiguousarray(rows, dtype=np.float64))


def value(key, *arguments):
    """The function at one input: a float, or an array where it returns a vector."""
    result = evaluate(key, [np.concatenate([np.atleast_1d(a) for a in arguments])])[0]
    return result[0] if len(result) == 1 else result


def slices(function):
    """Each parameter's name with its place in a packed row."""
    i = 0
    for p in function.parameters:
        width = 1 if p.type == "float" else int(p.type[3])
        yield p.name, slice(i, i + width)
        i += width


def unpack(function, row):
    """The row's arguments as the signature has them: floats, and lists for vectors."""
    arguments = [list(row[place]) for _, place in slices(function)]
    return [a if len(a) > 1 else a[0] for a in arguments]


def exact(key, row):
    """The oracle's answer as a list, for a row of mpf."""
    result = ORACLE[key](*unpack(FUNCTIONS[key], row))
    return result if isinstance(result, list) else [result]


# 50 digits

@pytest.mark.parametrize("key", [key for key in FUNCTIONS if key in ORACLE])
def test_reference_agrees_with_50_digits(key):
    rows = adversarial_rows(FUNCTIONS[key], ROWS, SEED)
    got, kappa = evaluate(key, rows), reference.condition(key, rows)
    assert np.isfinite(got).all(), f"{key}: not finite, seed {SEED}"
    assert (got >= 0).all() or key.startswith(DIRECTIONS), f"{key}: negative, seed {SEED}"
    worst, where = 0.0, None
    for row, values, kappas in zip(rows, got.tolist(), kappa.tolist()):
        for have, want, k in zip(values, exact(key, [mpf(x) for x in row.tolist()]), kappas):
            if not abs(want) < LARGEST_BINARY32:  # infinite or undefined: only finiteness is promised
                continue
            allowed = max(REFERENCE_ROUNDOFF * (1 + mpf(k)) * abs(want), mpf(ABSOLUTE_FLOOR))
            ratio = float(abs(mpf(have) - want) / allowed)
            if not ratio <= worst:
                worst, where = ratio, f"reference {have!r}, exact {mp.nstr(want, 20)}, kappa {k:.3g}, at {row.tolist()}"
    print(f"{key}: worst measured/allowed {worst:.3g} over {ROWS} rows, seed {SEED}: {where}")
    assert worst <= 1, f"{key}: {worst:.3g} times the allowed error, seed {SEED}: {where}"


def test_functions_without_an_oracle_are_named(capsys):
    missing = [key for key in FUNCTIONS if key not in ORACLE]
    with capsys.disabled():
        if missing:
            print("\nreference functions without an mpmath oracle:", ", ".join(missing))


def test_every_oracle_has_its_function():
    unknown = sorted(set(ORACLE) - set(FUNCTIONS))
    assert not unknown, f"tests/oracle.py names functions that the reference does not have: {', '.join(unknown)}"


@pytest.mark.parametrize("alpha", [0.01, 0.5, 2.0])
@pytest.mark.parametrize("cosine", [0.05, 0.5, 0.95])
def test_oracle_lambda_is_smiths_integral(cosine, alpha):
    """Smith 1967: Lambda = 1/mu int_mu^inf (q - mu) P2(q) dq, P2 the density of slopes in the plane of incidence."""
    mu = mpf(cosine) / mp.sqrt(1 - mpf(cosine) ** 2)
    slope_density = lambda q: alpha**2 / (2 * (alpha**2 + q**2) ** mpf(1.5))
    # With q = mu/u the interval is finite and the integrand smooth.
    smith = mp.quad(lambda u: (mu / u - mu) * slope_density(mu / u) * mu / u**2, [0, 0.1, 1]) / mu
    assert abs(smith / Lambda_GGX(cosine, alpha) - 1) < mpf(10) ** -12


# The condition number

NORMAL, VIEW, LIGHT = (0.1, -0.2, 0.9), (0.5, 0.3, 0.7), (-0.4, 0.1, 0.8)
WELL_BEHAVED = {
    "lobe_alpha(float)": (0.3,),
    "lobe_f0(float)": (1.5,),
    "lobe_eta(float)": (0.2,),
    "lobe_F_dielectric(float,float)": (0.4, 1.5),
    "lobe_T_dielectric(float,float)": (0.9, 0.5),
    "lobe_D_GGX(float,float)": (0.9, 0.3),
    "lobe_D_GGX(vec3,vec3,float)": (*NORMAL, 0.2, 0.1, 1.3, 0.3),
    "lobe_G2_GGX(float,float,float)": (0.3, 0.6, 0.7),
    "lobe_V_Kelemen(vec3,vec3)": (*VIEW, *LIGHT),
    "lobe_OrenNayar_qualitative(vec3,vec3,vec3,vec3,float)": (*NORMAL, *VIEW, *LIGHT, 0.8, 0.5, 0.2, 0.4),
    "lobe_GGX(vec3,vec3,vec3,vec3,float)": (*NORMAL, *VIEW, *LIGHT, 0.9, 0.5, 0.04, 0.3),
}


@pytest.mark.parametrize("key", WELL_BEHAVED)
def test_condition_number_is_the_derivative(key):
    """kappa = sum |x df/dx| / |f|, with the derivatives of the oracle."""
    function = FUNCTIONS[key]
    row = np.array(WELL_BEHAVED[key])
    for name, place in slices(function):  # the step is relative to the components of unit vectors
        if name in ("N", "V", "L"):
            row[place] /= np.linalg.norm(row[place])
    x = [mpf(float(c)) for c in row]
    kappa = reference.condition(key, row[None])[0]
    for channel, f in enumerate(exact(key, x)):
        along = lambda i: mp.diff(lambda t: exact(key, x[:i] + [t] + x[i + 1:])[channel], x[i])
        want = mp.fsum(abs(x[i] * along(i)) for i in range(len(x))) / abs(f)
        assert kappa[channel] == pytest.approx(float(want), rel=1e-4)


# Published numbers

F, T = "lobe_F_dielectric(float,float)", "lobe_T_dielectric(float,float)"
SCHLICK = "lobe_F_Schlick(float,float)"
G1 = "lobe_G1_GGX(float,float)"
COSINES = np.linspace(0, 1, 4001)


def fresnel(cosines, eta):
    return evaluate(F, np.column_stack([cosines, np.full_like(cosines, eta)]))[:, 0]


def test_glass_reflects_four_percent():
    assert value(F, 1, 1.5) == pytest.approx(0.04, rel=1e-14)
    assert value(F, 1, 1 / 1.5) == pytest.approx(0.04, rel=1e-14)
    assert value("lobe_f0(float)", 1.5) == pytest.approx(0.04, rel=1e-14)
    assert value("lobe_eta(float)", 0.04) == pytest.approx(1.5, rel=1e-14)


def test_fresnel_near_index_match():
    assert value(F, np.float32(0.7), np.float32(1.0003)) == pytest.approx(4.685e-8, rel=2e-4)
    assert [value(F, c, 1) for c in (0, 0.5, 1)] == [0, 0, 0]
    assert [value(T, c, 1) for c in (0, 0.5, 1)] == [1, 1, 1]


def test_brewsters_angle_reflects_only_one_polarisation():
    """At tan(theta) = eta the reflectance is half of R_s, and R_s = ((eta^2 - 1)/(eta^2 + 1))^2."""
    assert value(F, math.cos(math.atan(1.5)), 1.5) == pytest.approx((1.25 / 3.25) ** 2 / 2, rel=1e-13)


def test_total_internal_reflection():
    inside = value("lobe_cos_critical(float)", 1 / 1.5)
    assert inside == pytest.approx(math.cos(math.asin(1 / 1.5)), rel=1e-14)
    assert value("lobe_cos_critical(float)", 1.5) == 0
    assert value(F, inside * 0.999, 1 / 1.5) == 1 and value(T, inside * 0.999, 1 / 1.5) == 0
    assert value("lobe_cosT(float,float)", inside * 0.999, 1 / 1.5) == 0


@pytest.mark.parametrize("eta, internal", [(1.3, 0.44446), (1.5, 0.59635)])
def test_diffuse_fresnel_reflectance(eta, internal):
    """2 int F c dc from inside; from outside it obeys F_in = 1 - (1 - F_out)/eta^2."""
    critical = math.sqrt(1 - 1 / eta**2)
    inner = 2 * integral(lambda c: fresnel(c, 1 / eta) * c, 0, critical) + 2 * integral(
        lambda t: fresnel(critical + t**2, 1 / eta) * (critical + t**2) * 2 * t, 0, math.sqrt(1 - critical))
    outer = 2 * integral(lambda c: fresnel(c, eta) * c, 0, 1)
    assert inner == pytest.approx(internal, abs=1e-5)
    assert inner == pytest.approx(1 - (1 - outer) / eta**2, rel=1e-6)


@pytest.mark.parametrize("eta, error", [(1.65, 0.0315), (1.5, 0.036), (1.33, 0.060), (1.1, 0.21), (4, 0.20)])
def test_schlicks_largest_error(eta, error):
    f0 = value("lobe_f0(float)", eta)
    schlick = evaluate(SCHLICK, np.column_stack([COSINES, np.full_like(COSINES, f0)]))[:, 0]
    assert abs(schlick - fresnel(COSINES, eta)).max() == pytest.approx(error, rel=0.03)


def test_schlick_with_golds_red_is_not_clamped():
    assert value(SCHLICK, 1, 1.022) == 1.022
    assert value(SCHLICK, 0.5, 1.022) == pytest.approx(1.0213, abs=5e-5)
    assert value(SCHLICK, 0, 1.022) == pytest.approx(1, rel=1e-15)


def test_G1_alone_is_not_reciprocal():
    """Between 0 and 80 degrees at alpha 0.5 the one-sided term differs by a factor of two."""
    assert value(G1, 1, 0.5) / value(G1, math.cos(math.radians(80)), 0.5) == pytest.approx(2, rel=0.01)


# Integrals

def gauss(low, high, nodes=256):
    x, w = np.polynomial.legendre.leggauss(nodes)
    return (high + low) / 2 + (high - low) / 2 * x, (high - low) / 2 * w


def integral(f, low, high):
    x, w = gauss(low, high)
    return f(x) @ w


def graded(low, high):
    """Nodes for the tilt of H that crowd at 0, where a narrow lobe lives."""
    t, w = gauss(low ** (1 / 3), high ** (1 / 3))
    return t**3, 3 * t**2 * w


def D_scalar(theta, alpha):
    return evaluate("lobe_D_GGX(float,float)", np.column_stack([np.cos(theta), np.full_like(theta, alpha)]))[:, 0]


def D_vector(theta, alpha):
    zero, one = np.zeros_like(theta), np.ones_like(theta)
    H = 3 * np.column_stack([np.sin(theta), zero, np.cos(theta)])
    return evaluate("lobe_D_GGX(vec3,vec3,float)", np.column_stack([zero, zero, one, H, alpha * one]))[:, 0]


ALPHAS = [0.01, 0.05, 0.2, 0.5, 1, 4]


@pytest.mark.parametrize("D", [D_scalar, D_vector])
@pytest.mark.parametrize("alpha", ALPHAS)
def test_D_GGX_has_the_projected_area_of_the_surface(D, alpha):
    theta, weight = graded(0, math.pi / 2)
    area = 2 * math.pi * (D(theta, alpha) * np.cos(theta) * np.sin(theta)) @ weight
    assert area == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize("degrees", [0, 30, 60, 85])
@pytest.mark.parametrize("alpha", ALPHAS)
def test_weak_white_furnace(alpha, degrees):
    """G1 lets the visible facets fill the projected area: G1 int D max(V.H, 0) dH = N.V (Heitz 2014)."""
    tilt = math.radians(degrees)
    c, s = math.cos(tilt), math.sin(tilt)
    visible = 0
    turning = math.pi / 2 - tilt  # beyond it a facet can face away
    for low, high in ((0, turning), (turning, math.pi / 2)):
        theta, weight = graded(low, high)
        a, b = c * np.cos(theta), s * np.sin(theta)
        facing = np.arccos(np.clip(-a / np.maximum(b, 1e-300), -1, 1))  # the azimuth at which V.H = a + b cos(phi) ends
        visible += (D_scalar(theta, alpha) * 2 * (a * facing + b * np.sin(facing)) * np.sin(theta)) @ weight
    assert value(G1, c, alpha) * visible / c == pytest.approx(1, rel=1e-5)


def albedo(key, degrees, *parameters, nodes=160):
    """int f N.L dL over the hemisphere, the first channel."""
    theta, w_theta = gauss(0, math.pi / 2, nodes)
    phi, w_phi = gauss(0, math.pi, nodes)  # the other half is its mirror image
    theta, phi = (x.ravel() for x in np.meshgrid(theta, phi, indexing="ij"))
    weight = 2 * np.outer(w_theta, w_phi).ravel() * np.sin(theta) * np.cos(theta)
    L = np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    tilt = math.radians(degrees)
    fixed = lambda *x: np.broadcast_to(x, (len(L), len(x)))
    rows = np.column_stack([fixed(0, 0, 1), fixed(math.sin(tilt), 0, math.cos(tilt)), L, fixed(*parameters)])
    return evaluate(key, rows)[:, 0] @ weight


GGX, KELEMEN = (f"{name}(vec3,vec3,vec3,vec3,float)" for name in ("lobe_GGX", "lobe_GGX_Kelemen"))
OREN_NAYAR = "lobe_OrenNayar_qualitative(vec3,vec3,vec3,vec3,float)"


@pytest.mark.parametrize("key, alpha, degrees, published", [
    *((GGX, 0.2, *x) for x in ((0, 0.9477), (17, 0.9452), (45, 0.9244), (75, 0.8578), (85, 0.8999))),
    *((GGX, 1.0, *x) for x in ((0, 0.3069), (17, 0.3155), (45, 0.3768), (75, 0.5906), (85, 0.7801))),
    (KELEMEN, 0.2, 17, 0.8674),
    *((KELEMEN, 1.0, *x) for x in ((0, 0.3069), (45, 0.3768), (75, 0.5906))),
])
def test_white_albedo(key, alpha, degrees, published):
    assert albedo(key, degrees, 1, 1, 1, alpha) == pytest.approx(published, abs=1e-4)


@pytest.mark.parametrize("degrees", [0, 60, 89])
def test_lamberts_albedo_is_its_parameter(degrees):
    assert albedo("lobe_Lambert(vec3,vec3,vec3,vec3)", degrees, 0.7, 0.7, 0.7) == pytest.approx(0.7, rel=1e-9)
    assert albedo(OREN_NAYAR, degrees, 0.7, 0.7, 0.7, 0) == pytest.approx(0.7, rel=1e-9)


def test_qualitative_OrenNayar_gains_at_most_1_52_percent():
    """Its known excess over a white Lambert: 1.0152 at grazing incidence and sigma 0.2."""
    assert albedo(OREN_NAYAR, 89.99, 1, 1, 1, 0.2) == pytest.approx(1.0152, abs=3e-4)
