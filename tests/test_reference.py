"""The reference against its three witnesses: 50 digits, published numbers, and integrals that physics fixes.

A new function needs no line here. It is compared as soon as oracle.py has an entry for it.
"""
import math

import numpy as np
import pytest
from lobe import reference
from lobe.lab import catalogue

from oracle import ALPHA_FLOOR, ORACLE, F82_unclamped, Lambda_Beckmann, Lambda_GGX, albedo_GGX, mp, mpf
from oracle_classic import CLASSIC, gaussian_norm
from sampling import DIRECTIONS, adversarial_rows

SEED = 20260
ROWS = 500
REFERENCE_ROUNDOFF = 2.0**-40  # the reference is held to it times 1 + kappa
ABSOLUTE_FLOOR = 1e-30
LARGEST_BINARY32 = 3.4e38

FUNCTIONS = {f.key: f for f in reference.functions()}
ORACLE = ORACLE | {key: f for key, f in CLASSIC.items() if key in FUNCTIONS}  # the rest await their references


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


def pack(key, **values):
    """Rows for a function from its parameters by name; what is given once is repeated. Other names are ignored."""
    columns = [np.asarray(values[name], float).reshape(-1, place.stop - place.start)
               for name, place in slices(FUNCTIONS[key])]
    count = max(map(len, columns))
    return np.hstack([np.broadcast_to(c, (count, c.shape[1])) for c in columns])


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


@pytest.mark.parametrize("Lambda, slope_density", [
    (Lambda_GGX, lambda q, alpha: alpha**2 / (2 * (alpha**2 + q**2) ** mpf(1.5))),
    (Lambda_Beckmann, lambda q, alpha: mp.exp(-((q / alpha) ** 2)) / (alpha * mp.sqrt(mp.pi))),
])
@pytest.mark.parametrize("alpha", [0.1, 0.5, 2.0])
@pytest.mark.parametrize("cosine", [0.05, 0.5, 0.95])
def test_oracle_lambda_is_smiths_integral(Lambda, slope_density, cosine, alpha):
    """Smith 1967: Lambda = 1/mu int_mu^inf (q - mu) P2(q) dq, P2 the density of slopes in the plane of incidence."""
    mu = mpf(cosine) / mp.sqrt(1 - mpf(cosine) ** 2)
    # With q = mu/u the interval is finite and the integrand smooth.
    smith = mp.quad(lambda u: (mu / u - mu) * slope_density(mu / u, alpha) * mu / u**2, mp.linspace(0, 1, 9)) / mu
    assert abs(smith - Lambda(cosine, alpha)) < mpf(10) ** -12 * Lambda(cosine, alpha) + mpf(10) ** -20


@pytest.mark.parametrize("alpha", [ALPHA_FLOOR, 0.05, 0.5, 4, 1000])
def test_oracle_gaussian_norm_is_the_projected_area(alpha):
    """The facets' area seen along the normal, pi int exp(-(x/alpha)^2) sin 2x dx over 0..pi/2."""
    alpha = mpf(alpha)
    end = min(mp.pi / 2, 12 * alpha)  # the rest is below exp(-144)
    area = mp.pi * mp.quad(lambda x: mp.exp(-((x / alpha) ** 2)) * mp.sin(2 * x), mp.linspace(0, end, 9))
    assert abs(area / gaussian_norm(alpha) - 1) < mpf(10) ** -40


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
    "lobe_F_conductor(float,float,float)": (0.4, 0.2, 3.6),
    "lobe_F_F82(float,vec3,vec3)": (0.3, 0.9, 0.5, 0.4, 0.9, 0.6, 0.3),
    "lobe_refract(vec3,vec3,float)": (*NORMAL, *VIEW, 1.5),
    "lobe_sample_GGX(vec3,vec3,vec3,float,vec2)": (*NORMAL, 0.9, 0.2, 0.1, *VIEW, 0.3, 0.2, 0.6),
    "lobe_G1_Beckmann(float,float)": (0.3, 0.7),
    "lobe_OrenNayar(vec3,vec3,vec3,vec3,float)": (*NORMAL, *VIEW, *LIGHT, 0.8, 0.5, 0.2, 0.4),
    "lobe_circle(float)": (0.3,),
    "lobe_quantile_exponential(float)": (0.3,),
    "lobe_angle_of_half(float)": (0.3,),
    "lobe_peak_Gaussian(float)": (0.3,),
}


@pytest.mark.parametrize("key", WELL_BEHAVED)
def test_condition_number_is_the_derivative(key):
    """kappa = sum |x df/dx| / |f|, with the derivatives of the oracle."""
    function = FUNCTIONS[key]
    row = np.array(WELL_BEHAVED[key])
    places = dict(slices(function))  # the step is relative to the components of unit vectors, T orthogonal to N
    for name in ("N", "V", "L", "T"):
        if name in places:
            if name == "T":
                row[places[name]] -= row[places["N"]] * row[places["N"]].dot(row[places[name]])
            row[places[name]] /= np.linalg.norm(row[places[name]])
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


def test_golds_index_from_its_f0_is_wrong_at_grazing_angles():
    """At 650 nm gold has 0.156 + 3.60i; the dielectric of the same f0 has an index of 90."""
    c, f0 = math.cos(math.radians(78)), value("lobe_f0(float,float)", 0.156, 3.60)
    assert value(CONDUCTOR, c, 0.156, 3.60) == pytest.approx(0.954, abs=1e-3)
    assert value(F, c, value("lobe_eta(float)", f0)) == pytest.approx(0.90, abs=5e-3)


@pytest.mark.parametrize("tint, safe", [(0.1, 0.26), (0.3, 0.055)])
def test_F82_needs_its_clamp(tint, safe):
    """The formula reaches -0.127 for a black f0 and tint, and stays positive only above some f0."""
    lowest = lambda f0, tint: min(F82_unclamped(c, f0, tint * F82_unclamped(mpf(1) / 7, f0, schlick_at_82(f0)))
                                  for c in COSINES[::20].tolist())
    assert lowest(0, 0) == pytest.approx(-0.127, abs=5e-4)
    assert lowest(safe * 0.9, tint) < 0 < lowest(safe * 1.1, tint)
    black = evaluate("lobe_F_F82_tint(float,vec3,vec3)", pack("lobe_F_F82_tint(float,vec3,vec3)", cosI=COSINES,
                                                              f0=(0, 0, 0), tint=(0, 0, 0)))
    assert black.min() == 0


def schlick_at_82(f0):
    return f0 + (1 - f0) * (6 / mpf(7)) ** 5


def test_walters_fit_of_G1_is_off_by_at_most_0_313_percent():
    exact_G1, fit = "lobe_G1_Beckmann(float,float)", "lobe_G1_Beckmann_fast(float,float)"
    a = np.linspace(0.001, 3, 3000)  # at alpha 1 it is the cotangent
    rows = np.column_stack([a / np.sqrt(1 + a**2), np.ones_like(a)])
    error = abs(evaluate(fit, rows) / evaluate(exact_G1, rows) - 1)[:, 0]
    assert error.max() == pytest.approx(0.00313, abs=1e-5)
    assert a[error.argmax()] == pytest.approx(1.336, abs=0.01)
    assert evaluate(fit, rows).max() == 1


def test_beckmann_masks_less_than_he_torrance():
    assert value("lobe_G1_Beckmann(float,float)", math.cos(math.radians(75)), 0.3) == pytest.approx(0.962, abs=5e-4)


def test_exponents():
    assert value("lobe_exponent(float)", 0.1) == pytest.approx(198, rel=1e-13)
    assert value("lobe_alpha_Phong(float)", 198) == pytest.approx(0.1, rel=1e-14)
    assert value("lobe_exponent_Blinn(float)", 50) == 200


@pytest.mark.parametrize("u, point", [
    (-0.1, (1, 0)), (0, (1, 0)), (0.25, (0, 1)), (0.5, (-1, 0)), (0.75, (0, -1)), (1, (1, 0)), (1.1, (1, 0))])
def test_quarters_of_a_turn_are_exact(u, point):
    assert tuple(value("lobe_circle(float)", u)) == point


@pytest.mark.parametrize("u, halvings", [(-0.1, 0), (0, 0), (0.5, 1), (1 - 2**-23, 23), (1, 23), (1.1, 23)])
def test_tail_halves_with_each_ln_2(u, halvings):
    """Up to 0.9999999, which is 1 - 2^-23 as binary32 holds it."""
    assert value("lobe_quantile_exponential(float)", u) == pytest.approx(halvings * math.log(2), rel=1e-14, abs=0)


@pytest.mark.parametrize("tangent, degrees", [
    (-0.1, 0), (0, 0), (math.sqrt(2) - 1, 45), (1 / math.sqrt(3), 60), (1, 90), (1.1, 90)])
def test_angles_of_known_half_tangents(tangent, degrees):
    assert value("lobe_angle_of_half(float)", tangent) == pytest.approx(math.radians(degrees), rel=1e-14, abs=0)


def test_peak_of_the_narrowest_and_the_widest_gaussian():
    """1/(pi alpha^2) times 1 + 2 alpha^2/3 where it is narrow, 1/pi where it is flat; alpha is clamped to 1e-4..1e3."""
    peak, floor = "lobe_peak_Gaussian(float)", np.float32(1e-4)
    assert value(peak, 1e-3) == pytest.approx((1 + 2e-6 / 3) * 1e6 / math.pi, rel=1e-11)
    assert value(peak, 1e3) == pytest.approx(1 / math.pi, rel=1e-6)
    assert value(peak, -1) == value(peak, 0) == value(peak, floor)
    assert value(peak, 1e6) == value(peak, 1e3)


def test_filtered_alpha():
    filtered = "lobe_alpha_filtered(float,vec3,vec3)"
    assert value(filtered, 0.002025, 0, 0, 0, 0, 0, 0) == pytest.approx(0.002025, rel=1e-14)
    assert value(filtered, 0, 0.1, 0, 0, 0, 0, 0.1) == pytest.approx(math.sqrt(0.02 / math.pi), rel=1e-7)
    assert value(filtered, 0, 9, 0, 0, 0, 0, 0) == pytest.approx(math.sqrt(0.18), rel=1e-14)
    assert value(filtered, 0.99, 9, 0, 0, 0, 0, 0) == 1


# Identities

CONDUCTOR, LAMBERT = "lobe_F_conductor(float,float,float)", "lobe_Lambert(vec3,vec3,vec3,vec3)"
POLE = {"N": (0, 0, 1)}


def of_unit_length(c, X):
    """The three cosines of a direction, to the last digit of a double."""
    v = np.column_stack([c[f"{axis}dot{X}"] for axis in "TBN"])
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    return {f"Tdot{X}": v[:, 0], f"Bdot{X}": v[:, 1], f"Ndot{X}": v[:, 2]}


def isotropic(c):
    return {"alphaY": c["alphaX"], "alpha": c["alphaX"]}


def isotropic_half(c):
    unit = of_unit_length(c, "H")
    return isotropic(c) | POLE | unit | {"H": np.column_stack([unit["TdotH"], unit["BdotH"], unit["NdotH"]])}


def vector_of_cosine(c):
    NdotH = np.maximum(c["NdotH"], 1e-2)  # nearer to 0 a cosine from an angle is not accurate
    H = np.column_stack([np.sqrt((1 - NdotH) * (1 + NdotH)), np.zeros_like(NdotH), NdotH])
    return POLE | {"NdotH": NdotH, "H": 2 * H}


IDENTITIES = {  # name: a function, what its arguments are changed to, and the function that then is the same
    "a conductor without absorption is a dielectric": (CONDUCTOR, lambda c: {"k": 0}, F),
    "and in each polarisation": ("lobe_F_conductor_sp(float,float,float)", lambda c: {"k": 0},
                                 "lobe_F_dielectric_sp(float,float)"),
    "f0 without absorption": ("lobe_f0(float,float)", lambda c: {"k": 0}, "lobe_f0(float)"),
    "F82 with Schlick's own value": (
        "lobe_F_F82(float,vec3,vec3)", lambda c: {"f82": c["f0"] + (1 - c["f0"]) * (6 / 7) ** 5},
        "lobe_F_Schlick(float,vec3)"),
    "F82 with a white tint": ("lobe_F_F82_tint(float,vec3,vec3)", lambda c: {"tint": (1, 1, 1)},
                              "lobe_F_Schlick(float,vec3)"),
    "alphaX = alphaY in D of GGX": ("lobe_D_GGX_aniso(float,float,float,float,float)", isotropic_half,
                                    "lobe_D_GGX(vec3,vec3,float)"),
    "alphaX = alphaY in D of Beckmann": ("lobe_D_Beckmann_aniso(float,float,float,float,float)", isotropic_half,
                                         "lobe_D_Beckmann(vec3,vec3,float)"),
    "alphaX = alphaY in V": ("lobe_V_GGX_aniso(float,float,float,float,float,float,float,float)",
                             lambda c: isotropic(c) | of_unit_length(c, "V") | of_unit_length(c, "L"),
                             "lobe_V_GGX(float,float,float)"),
    "alphaX = alphaY in the lobe": ("lobe_GGX_aniso(vec3,vec3,vec3,vec3,vec3,float,float)", isotropic,
                                    "lobe_GGX(vec3,vec3,vec3,vec3,float)"),
    "both forms of D of GGX": ("lobe_D_GGX(float,float)", vector_of_cosine, "lobe_D_GGX(vec3,vec3,float)"),
    "both forms of D of Beckmann": ("lobe_D_Beckmann(float,float)", vector_of_cosine,
                                    "lobe_D_Beckmann(vec3,vec3,float)"),
    "both forms of D of Blinn-Phong": ("lobe_D_BlinnPhong(float,float)", vector_of_cosine,
                                       "lobe_D_BlinnPhong(vec3,vec3,float)"),
    "Oren-Nayar at sigma 0": ("lobe_OrenNayar(vec3,vec3,vec3,vec3,float)", lambda c: {"sigma": 0}, LAMBERT),
    "qualitative Oren-Nayar at sigma 0": ("lobe_OrenNayar_qualitative(vec3,vec3,vec3,vec3,float)",
                                          lambda c: {"sigma": 0}, LAMBERT),
    "EON at roughness 0": ("lobe_OrenNayar_EON(vec3,vec3,vec3,vec3,float)", lambda c: {"roughness": 0}, LAMBERT),
    "fast EON at roughness 0": ("lobe_OrenNayar_EON_fast(vec3,vec3,vec3,vec3,float)",
                                lambda c: {"roughness": 0}, LAMBERT),
}


@pytest.mark.parametrize("name", IDENTITIES)
def test_identity(name):
    key, changes, other = IDENTITIES[name]
    rows = adversarial_rows(FUNCTIONS[key], ROWS, SEED)
    inputs = {parameter: rows[:, place] for parameter, place in slices(FUNCTIONS[key])}
    inputs.update(changes(inputs))
    rows = pack(key, **inputs)
    got, want = evaluate(key, rows), evaluate(other, pack(other, **inputs))
    kappa = reference.condition(key, rows) + reference.condition(other, pack(other, **inputs))
    allowed = np.maximum(REFERENCE_ROUNDOFF * (2 + kappa) * want, ABSOLUTE_FLOOR)
    worst = np.unravel_index((abs(got - want) / allowed).argmax(), got.shape)
    assert (abs(got - want) <= allowed).all(), f"{got[worst]} and {want[worst]} at {rows[worst[0]].tolist()}"


@pytest.mark.parametrize("fresnel, unpolarised", [
    ("lobe_F_dielectric_sp(float,float)", F), ("lobe_T_dielectric_sp(float,float)", T),
    ("lobe_F_conductor_sp(float,float,float)", CONDUCTOR)])
def test_unpolarised_is_the_mean_of_both_polarisations(fresnel, unpolarised):
    rows = adversarial_rows(FUNCTIONS[fresnel], ROWS, SEED)
    assert evaluate(fresnel, rows).mean(1) == pytest.approx(evaluate(unpolarised, rows)[:, 0], rel=1e-12, abs=1e-30)


def test_nothing_is_absorbed_between_dielectrics():
    F_sp, T_sp = "lobe_F_dielectric_sp(float,float)", "lobe_T_dielectric_sp(float,float)"
    rows = adversarial_rows(FUNCTIONS[F_sp], ROWS, SEED)
    assert evaluate(F_sp, rows) + evaluate(T_sp, rows) == pytest.approx(1, rel=1e-12)


def test_colours_are_independent_channels():
    eta, k, f0 = (0.2, 0.9, 1.5), (3.9, 2.4, 0.0), (0.9, 0.5, 0.04)
    assert value("lobe_F_conductor(float,vec3,vec3)", 0.3, eta, k) == pytest.approx(
        [value(CONDUCTOR, 0.3, *index) for index in zip(eta, k)], rel=1e-15)
    assert value("lobe_f0(vec3,vec3)", eta, k) == pytest.approx(
        [value("lobe_f0(float,float)", *index) for index in zip(eta, k)], rel=1e-15)
    for key, last in (("lobe_F_F82(float,vec3,vec3)", eta), ("lobe_F_Hall(float,vec3,float)", (1.5,))):
        together = value(key, 0.3, f0, last)
        apart = [value(key, 0.3, [f] * 3, [x] * len(last))[0] for f, x in zip(f0, last * (3 // len(last)))]
        assert together == pytest.approx(apart, rel=1e-15)


F0 = (0.9, 0.5, 0.04)


@pytest.mark.parametrize("key, f0, parameters", [
    ("lobe_F_Schlick(float,vec3)", F0, (F0,)),
    ("lobe_F_F82(float,vec3,vec3)", F0, (F0, (0.8, 0.6, 0.4))),
    ("lobe_F_F82_tint(float,vec3,vec3)", F0, (F0, (0.8, 0.6, 0.4))),
    ("lobe_F_Hall(float,vec3,float)", F0, (F0, 1.5)),
    (CONDUCTOR, (0.2**2 + 3.9**2 - 0.4 + 1) / (0.2**2 + 3.9**2 + 0.4 + 1), (0.2, 3.9)),
    ("lobe_F_dielectric_sp(float,float)", (0.04, 0.04), (1.5,)),
])
def test_fresnel_begins_at_f0_and_ends_at_1(key, f0, parameters):
    assert value(key, 1, *parameters) == pytest.approx(f0, rel=1e-13)
    assert value(key, 0, *parameters) == pytest.approx(np.ones_like(f0), rel=1e-13)


def test_F82_has_its_value_at_82_degrees():
    f82 = (0.8, 0.6, 0.4)
    assert value("lobe_F_F82(float,vec3,vec3)", 1 / 7, F0, f82) == pytest.approx(f82, rel=1e-13)
    tinted = np.multiply(f82, value("lobe_F_Schlick(float,vec3)", 1 / 7, F0))
    assert value("lobe_F_F82_tint(float,vec3,vec3)", 1 / 7, F0, f82) == pytest.approx(tinted, rel=1e-13)


def test_mirror_and_snell():
    key = "lobe_refract(vec3,vec3,float)"
    rows = adversarial_rows(FUNCTIONS[key], ROWS, SEED)
    N, V = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (rows[:, :3], rows[:, 3:6]))
    eta, NdotV = rows[:, 6], (N * V).sum(1)
    R, refracted = evaluate("lobe_reflect(vec3,vec3)", rows[:, :6]), evaluate(key, rows)
    assert R + V == pytest.approx(2 * NdotV[:, None] * N, abs=1e-14)
    through = refracted.any(1)
    assert 10 < through.sum() < ROWS
    assert np.linalg.norm(refracted[through], axis=1) == pytest.approx(1, rel=1e-13)
    assert (np.cross(N, refracted) * eta[:, None])[through] == pytest.approx(-np.cross(N, V)[through], abs=1e-13)
    cosT = evaluate("lobe_cosT(float,float)", np.column_stack([np.clip(NdotV, 0, 1), eta]))[:, 0]
    assert -(N * refracted).sum(1) == pytest.approx(cosT, abs=1e-6)  # 1e-6: near the critical angle a root begins


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


def facets(x, phi, alphaX, alphaY):
    """Facets by stretched slopes, x in 0..pi/2 for tan(x) = 0..inf: unit H, and the solid angle per dx dphi.

    A distribution of the widths alphaX, alphaY is smooth in x, however narrow it is.
    """
    H = np.column_stack([alphaX * np.tan(x) * np.cos(phi), alphaY * np.tan(x) * np.sin(phi), np.ones_like(x)])
    H /= np.linalg.norm(H, axis=1, keepdims=True)
    return H, alphaX * alphaY * np.tan(x) / np.cos(x) ** 2 * H[:, 2] ** 3


def shape(key, alphaX, alphaY):
    """A distribution's parameters, by whichever name it has them."""
    exponents = [max(2 / alpha**2 - 2, 0) for alpha in (alphaX, alphaY)]
    of_lists = {p: np.linspace(1, 2, place.stop - place.start) for p, place in slices(FUNCTIONS[key])}
    return {"alpha": alphaX, "alphaX": alphaX, "alphaY": alphaY, "alphas": alphaX * of_lists.get("alphas", 1),
            "exponent": exponents[0], "h": exponents[0] + 1, "nu": exponents[0], "nv": exponents[1],
            "weight": 0.3, "weights": of_lists.get("weights")}


# A kink or a long tail, which these nodes do not resolve: the C++ tests integrate them.
UNRESOLVED = ("lobe_D_Schlick", "lobe_D_SchlickPower")
NORMALISED = {f.name for f in catalogue.load().functions if f.normalised == "yes"}.difference(UNRESOLVED)


ALPHAS = [0.01, 0.05, 0.2, 0.5, 1, 4]


@pytest.mark.parametrize("key, alphaX, alphaY", [
    (key, *alphas) for key, f in FUNCTIONS.items() if f.name in NORMALISED
    for alphas in [(a, a) for a in ALPHAS] + ([(0.05, 0.5), (1, 0.02), (0.5, 4)] if "aniso" in f.name else [])])
def test_D_has_the_projected_area_of_the_surface(key, alphaX, alphaY):
    x, w_x = gauss(0, math.pi / 2)
    phi = np.arange(16) * math.pi / 8
    x, phi = (a.ravel() for a in np.meshgrid(x, phi, indexing="ij"))
    H, solid_angle = facets(x, phi, alphaX, alphaY)
    cosines = dict(zip(("TdotH", "BdotH", "NdotH"), H.T))
    D = evaluate(key, pack(key, N=(0, 0, 1), H=3 * H, **cosines, **shape(key, alphaX, alphaY)))[:, 0]
    area = (D * H[:, 2] * solid_angle) @ np.repeat(w_x, 16) * math.pi / 8
    assert area == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize("degrees", [0, 30, 60, 85])
@pytest.mark.parametrize("alpha", ALPHAS)
@pytest.mark.parametrize("key", [key for key, f in FUNCTIONS.items() if f.name.startswith("lobe_G1_")
                                 and "alpha" in dict(slices(f))])
def test_weak_white_furnace(key, alpha, degrees):
    """G1 lets the visible facets fill the projected area: G1 int D max(V.H, 0) dH = N.V (Heitz 2014)."""
    D = f"lobe_D_{FUNCTIONS[key].name.split('_')[2]}(float,float)"
    tilt = math.radians(degrees)
    c, s = math.cos(tilt), math.sin(tilt)
    visible = 0
    turning = math.pi / 2 - tilt  # beyond it a facet can face away
    for low, high in ((0, turning), (turning, math.pi / 2)):
        theta, weight = graded(low, high)
        a, b = c * np.cos(theta), s * np.sin(theta)
        facing = np.arccos(np.clip(-a / np.maximum(b, 1e-300), -1, 1))  # the azimuth at which V.H = a + b cos(phi) ends
        densities = evaluate(D, pack(D, NdotH=np.cos(theta), **shape(D, alpha, alpha)))[:, 0]
        visible += (densities * 2 * (a * facing + b * np.sin(facing)) * np.sin(theta)) @ weight
    G1 = evaluate(key, pack(key, NdotX=c, **shape(key, alpha, alpha)))[0, 0]
    assert G1 * visible / c == pytest.approx(1, rel=3.2e-3 if "fast" in key else 1e-5)


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


def test_full_OrenNayar_is_published_with_its_gain():
    """The model gains energy near grazing incidence and has no bound there; opposite to V it would fall below 0."""
    key = "lobe_OrenNayar(vec3,vec3,vec3,vec3,float)"
    gains = [albedo(key, 89.5, 1, 1, 1, sigma) for sigma in (0.1, 0.2, 0.3, 0.5, 1)]
    assert gains == pytest.approx([1.014, 1.038, 1.047, 1.021, 0.930], abs=1.5e-3)
    grazing = (math.sin(math.radians(89.9)), 0, math.cos(math.radians(89.9)))
    assert value(key, (0, 0, 1), grazing, grazing, (1, 1, 1), 0.5)[0] > 50
    opposite = (-grazing[0], 0, grazing[2])
    assert (value(key, (0, 0, 1), grazing, opposite, (0.1, 0.1, 0.1), 1) == 0).all()


EON, EON_ALBEDO = "lobe_OrenNayar_EON(vec3,vec3,vec3,vec3,float)", "lobe_albedo_EON(float,vec3,float)"


@pytest.mark.parametrize("roughness", [0.1, 0.5, 1])
@pytest.mark.parametrize("degrees", [0, 45, 80, 89])
def test_EON_keeps_energy(degrees, roughness):
    """1e-4: the quadrature meets the kink where V and L pass to opposite sides of N."""
    c = math.cos(math.radians(degrees))
    assert value(EON_ALBEDO, c, (1, 1, 1), roughness) == pytest.approx([1] * 3, rel=1e-13)
    assert albedo(EON, degrees, 1, 1, 1, roughness) == pytest.approx(1, abs=1e-4)
    assert albedo(EON, degrees, 0.5, 0.5, 0.5, roughness) == pytest.approx(
        value(EON_ALBEDO, c, (0.5, 0.5, 0.5), roughness)[0], abs=1e-4)


@pytest.mark.parametrize("exponent", [0, 1, 10, 200])
def test_power_lobes_reflect_rs_at_normal_incidence(exponent):
    for name in ("lobe_Phong", "lobe_BlinnPhong"):
        assert albedo(f"{name}(vec3,vec3,vec3,vec3,float)", 0, 0.7, 0.7, 0.7, exponent) == pytest.approx(0.7, rel=1e-6)


def test_phong_of_1975_has_the_intensity_cos_n():
    N, V, L = (0, 0, 1), (0.6, 0, 0.8), (0, 0.6, 0.8)
    assert value("lobe_Phong_1975(vec3,vec3,vec3,vec3,float)", N, V, L, (1, 1, 1), 5)[0] * 0.8 == pytest.approx(
        0.64**5, rel=1e-13)


@pytest.mark.parametrize("degrees", [0, 30, 60, 80])
def test_kelemen_has_smiths_albedo_at_alpha_1(degrees):
    assert albedo(KELEMEN, degrees, 1, 1, 1, 1) == pytest.approx(albedo(GGX, degrees, 1, 1, 1, 1), abs=1e-4)


def test_masking_that_is_correlated_darkens_less():
    separable = "lobe_G2_GGX_separable(float,float,float)"
    rows = adversarial_rows(FUNCTIONS[separable], ROWS, SEED)
    assert (evaluate(separable, rows) <= evaluate("lobe_G2_GGX(float,float,float)", rows) * (1 + 1e-15)).all()


# Energy

E, E_AVERAGE, DFG = "lobe_albedo_GGX(float,float)", "lobe_albedo_avg_GGX(float)", "lobe_DFG_GGX(float,float)"
MULTIPLE, TURQUIN = "lobe_GGX_multiple(vec3,vec3,vec3,vec3,float)", "lobe_energy_Turquin(float,vec3,float)"


@pytest.mark.parametrize("NdotV, alpha", [(1, 0.5), (0.5, 0.5), (0.1, 0.2), (0.3, 1)])
def test_albedo_agrees_with_slow_quadrature(NdotV, alpha):
    """Lazarov 2013, Karis 2013: with Schlick's F the albedo is f0 times the scale, plus the bias."""
    schlick = lambda VdotH: (1 - VdotH) ** 5
    albedo, bias = float(albedo_GGX(NdotV, alpha)), float(albedo_GGX(NdotV, alpha, schlick))
    assert value(E, NdotV, alpha) == pytest.approx(albedo, rel=1e-9)
    assert value(DFG, NdotV, alpha) == pytest.approx([albedo - bias, bias], rel=1e-8)


@pytest.mark.parametrize("alpha", [0.2, 0.5, 1])
def test_average_albedo(alpha):
    average = integral(lambda c: 2 * c * evaluate(E, pack(E, NdotV=c, alpha=alpha))[:, 0], 0, 1)
    assert value(E_AVERAGE, alpha) == pytest.approx(average, rel=1e-5)


@pytest.mark.parametrize("alpha", [0.2, 0.5, 1])
@pytest.mark.parametrize("degrees", [0, 45, 80])
def test_later_bounces_fill_the_white_furnace(degrees, alpha):
    tilt = math.radians(degrees)
    V = (math.sin(tilt), 0, math.cos(tilt))
    c, weight = gauss(0, 1, 64)  # the lobe does not depend on the azimuth
    L = np.column_stack([np.sqrt(1 - c**2), np.zeros_like(c), c])
    later = lambda f0: 2 * math.pi * (
        evaluate(MULTIPLE, pack(MULTIPLE, N=(0, 0, 1), V=V, L=L, f0=[f0] * 3, alpha=alpha))[:, 0] * c) @ weight
    single = value(E, V[2], alpha)
    assert single + later(1) == pytest.approx(1, abs=1e-5)
    assert single * value(TURQUIN, V[2], (1, 1, 1), alpha)[0] == pytest.approx(1, rel=1e-9)
    F_average, E_average = 0.5 + 0.5 / 21, value(E_AVERAGE, alpha)
    assert later(0.5) / later(1) == pytest.approx(
        F_average**2 * E_average / (1 - F_average * (1 - E_average)), rel=1e-9)
