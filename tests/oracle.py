"""The third voice: every function of the reference once more, at 50 digits, in textbook form.

ORACLE maps a function's key, `name(type,...)` as GLSL spells it, to a callable that takes the arguments in the order of
the signature (numbers, and sequences of three for vec3) and returns an mpf or a list of three. Forms that a float
could not survive, angles and tangents among them, are welcome here: with 50 digits they cost nothing, and an error
cannot be shared with code that had to avoid them. Where the exact value is infinite or not defined, the answer is nan
or beyond the range of binary32; the policy for those inputs is not the oracle's to state.
"""
import mpmath

mp = mpmath.mp.clone()
mp.dps = 50
mpf = mp.mpf

ALPHA_FLOOR = mpf(13743895) / mpf(2) ** 37  # of D and of whole lobes: 1e-4 as binary32 holds it
F0_LIMIT = 1 - mpf(2) ** -24  # where lobe_eta() stops growing
GRAZING = mpf(10) ** -45  # a cosine that stands for 0 where only the limit exists


# Vectors

def dot(a, b):
    return mp.fsum(x * y for x, y in zip(a, b))


def cosine(a, b):
    """Of two unit vectors; not above 1, whatever the 51st digit says."""
    return min(dot(a, b), mpf(1))


def length(a):
    return mp.sqrt(dot(a, a))


def scale(a, s):
    return [x * s for x in a]


def add(a, b):
    return [x + y for x, y in zip(a, b)]


def unit(a):
    """`a` at length 1; a null vector stays as it is."""
    a = [mpf(x) for x in a]
    return scale(a, 1 / length(a)) if any(a) else a


def angle(a, b):
    """Angle between two unit vectors (Kahan: the half angle's tangent)."""
    return 2 * mp.atan2(length(add(a, scale(b, -1))), length(add(a, b)))


def above_horizon(N, V, L):
    return dot(N, V) > 0 and dot(N, L) > 0


def lobe(f):
    """A whole lobe from f(N, V, L, ...) -> list of three: directions of unit length, 0 below the horizon."""
    def whole(N, V, L, *parameters):
        N, V, L = unit(N), unit(V), unit(L)
        return f(N, V, L, *parameters) if above_horizon(N, V, L) else [mpf(0)] * 3
    return whole


# Helpers of core.glsl

def alpha_of_roughness(roughness):
    return mpf(roughness) ** 2


def LdotH(V, L):
    """Cosine of half the angle between V and L; the limit 0 for L = -V."""
    return mp.cos(angle(unit(V), unit(L)) / 2)


def sin2_NH(N, H):
    if not any(H):
        return mpf(0)
    return mp.sin(angle(unit(N), unit(H))) ** 2


# Fresnel: Snell's law with angles

def refracted_angle(cosI, eta):
    """None under total internal reflection."""
    sinT = mp.sin(mp.acos(cosI)) / eta
    return mp.asin(sinT) if sinT <= 1 else None


def f0_of_eta(eta):
    """Hecht, Optics, eq. 4.47: both amplitudes are (eta - 1)/(eta + 1) at normal incidence."""
    return ((mpf(eta) - 1) / (mpf(eta) + 1)) ** 2


def eta_of_f0(f0):
    r = mp.sqrt(min(mpf(f0), F0_LIMIT))
    return (1 + r) / (1 - r)


def F_dielectric(cosI, eta):
    """Fresnel's sine and tangent laws (Hecht, Optics, eqs. 4.42, 4.43), mean of the two polarisations."""
    if eta == 1:
        return mpf(0)
    if cosI == 1:
        return f0_of_eta(eta)
    i, t = mp.acos(cosI), refracted_angle(cosI, eta)
    if t is None:
        return mpf(1)
    r_s = mp.sin(i - t) / mp.sin(i + t)
    r_p = mp.tan(i - t) / mp.tan(i + t)
    return (r_s**2 + r_p**2) / 2


def T_dielectric(cosI, eta):
    """Transmitted power from Fresnel's sine laws for the transmitted amplitudes, not from 1 - F."""
    if eta == 1:
        return mpf(1)
    if cosI == 1:
        return 4 * mpf(eta) / (1 + mpf(eta)) ** 2
    i, t = mp.acos(cosI), refracted_angle(cosI, eta)
    if t is None:
        return mpf(0)
    t_s = 2 * mp.cos(i) * mp.sin(t) / mp.sin(i + t)
    t_p = t_s / mp.cos(i - t)
    return eta * mp.cos(t) / mp.cos(i) * (t_s**2 + t_p**2) / 2 if cosI else mpf(0)


def cosT(cosI, eta):
    t = refracted_angle(cosI, eta)
    return mpf(0) if t is None else mp.cos(t)


def cos_critical(eta):
    return mp.cos(mp.asin(eta)) if eta < 1 else mpf(0)


def F_Schlick(cosI, f0, f90=1):
    """Schlick 1994, eq. 15, with a free value at grazing incidence; cosines beyond 0..1 count as its ends."""
    cosI = min(max(mpf(cosI), mpf(0)), mpf(1))
    return mpf(f0) + (mpf(f90) - mpf(f0)) * (1 - cosI) ** 5


def F_Schlick_rgb(cosI, f0, f90=(1, 1, 1)):
    return [F_Schlick(cosI, a, b) for a, b in zip(f0, f90)]


# GGX by its slopes

def D_of_angle(theta, alpha):
    """Walter et al. 2007, eq. 33: the density of slopes over cos^4, written with sine and cosine."""
    alpha = max(mpf(alpha), ALPHA_FLOOR)
    return alpha**2 / (mp.pi * (alpha**2 * mp.cos(theta) ** 2 + mp.sin(theta) ** 2) ** 2)


def D_GGX(NdotH, alpha):
    return D_of_angle(mp.acos(NdotH), alpha)


def D_GGX_vectors(N, H, alpha):
    return D_of_angle(angle(unit(N), unit(H)), alpha) if any(H) else mp.nan


def Lambda_GGX(c, alpha):
    """Heitz 2014, eq. 72. test_reference.py holds it to Smith's integral over the slopes."""
    tangent = mp.sqrt(1 - mpf(c) ** 2) / c
    return (mp.sqrt(1 + (alpha * tangent) ** 2) - 1) / 2


def G1_GGX(NdotX, alpha):
    return 1 / (1 + Lambda_GGX(NdotX, alpha)) if NdotX else mpf(0)


def G2_GGX(NdotV, NdotL, alpha):
    """Heitz 2014, eq. 99: masking and shadowing correlated by height."""
    if NdotV == 0 or NdotL == 0:
        return mpf(0)
    return 1 / (1 + Lambda_GGX(NdotV, alpha) + Lambda_GGX(NdotL, alpha))


def V_GGX(NdotV, NdotL, alpha):
    NdotV, NdotL = mpf(NdotV) or GRAZING, mpf(NdotL) or GRAZING
    return G2_GGX(NdotV, NdotL, alpha) / (4 * NdotV * NdotL)


def microfacet(visibility):
    """The lobe F D V with Schlick's F at L.H; `visibility` takes N, V, L, alpha."""
    def f(N, V, L, f0, alpha):
        alpha = max(mpf(alpha), ALPHA_FLOOR)
        DV = D_GGX_vectors(N, add(V, L), alpha) * visibility(N, V, L, alpha)
        return scale(F_Schlick_rgb(LdotH(V, L), [min(mpf(c), mpf(1)) for c in f0]), DV)
    return lobe(f)


def V_GGX_vectors(N, V, L, alpha):
    return V_GGX(cosine(N, V), cosine(N, L), alpha)


# Masking without a distribution

def G_Vgroove(NdotV, NdotL, NdotH, VdotH):
    """Torrance, Sparrow 1967; in this form Cook, Torrance 1982, eq. 15."""
    if VdotH == 0:
        return mp.nan
    return min(mpf(1), *(2 * mpf(NdotH) * mpf(c) / mpf(VdotH) for c in (NdotV, NdotL)))


def V_Vgroove(NdotV, NdotL, NdotH, VdotH):
    NdotV, NdotL = mpf(NdotV) or GRAZING, mpf(NdotL) or GRAZING
    return G_Vgroove(NdotV, NdotL, NdotH, VdotH) / (4 * NdotV * NdotL)


def V_Kelemen(LdotH):
    """Kelemen, Szirmay-Kalos 2001: G/(NdotV NdotL) is 1/LdotH^2."""
    return 1 / (4 * mpf(LdotH) ** 2) if LdotH else mp.inf


def V_Kelemen_vectors(V, L):
    return V_Kelemen(LdotH(V, L))


# Diffuse

@lobe
def Lambert(N, V, L, albedo):
    return [mpf(c) / mp.pi for c in albedo]


@lobe
def OrenNayar_qualitative(N, V, L, albedo, sigma):
    """Oren, Nayar 1994, eq. 30, by the angles themselves."""
    s2 = mpf(sigma) ** 2
    A = 1 - s2 / (2 * (s2 + mpf("0.33")))
    B = mpf("0.45") * s2 / (s2 + mpf("0.09"))
    theta_V, theta_L = angle(N, V), angle(N, L)
    v, l = (unit(add(X, scale(N, -dot(N, X)))) for X in (V, L))  # along the surface; their cosine is cos(dphi)
    bracket = A + B * max(mpf(0), dot(v, l)) * mp.sin(max(theta_V, theta_L)) * mp.tan(min(theta_V, theta_L))
    return [mpf(c) / mp.pi * bracket for c in albedo]


ORACLE = {
    "lobe_alpha(float)": alpha_of_roughness,
    "lobe_LdotH(vec3,vec3)": LdotH,
    "lobe_sin2_NH(vec3,vec3)": sin2_NH,
    "lobe_Lambert(vec3,vec3,vec3,vec3)": Lambert,
    "lobe_OrenNayar_qualitative(vec3,vec3,vec3,vec3,float)": OrenNayar_qualitative,
    "lobe_F_dielectric(float,float)": F_dielectric,
    "lobe_T_dielectric(float,float)": T_dielectric,
    "lobe_F_Schlick(float,float)": F_Schlick,
    "lobe_F_Schlick(float,float,float)": F_Schlick,
    "lobe_F_Schlick(float,vec3)": F_Schlick_rgb,
    "lobe_F_Schlick(float,vec3,vec3)": F_Schlick_rgb,
    "lobe_f0(float)": f0_of_eta,
    "lobe_eta(float)": eta_of_f0,
    "lobe_cosT(float,float)": cosT,
    "lobe_cos_critical(float)": cos_critical,
    "lobe_D_GGX(float,float)": D_GGX,
    "lobe_D_GGX(vec3,vec3,float)": D_GGX_vectors,
    "lobe_G1_GGX(float,float)": G1_GGX,
    "lobe_G2_GGX(float,float,float)": G2_GGX,
    "lobe_V_GGX(float,float,float)": V_GGX,
    "lobe_GGX(vec3,vec3,vec3,vec3,float)": microfacet(V_GGX_vectors),
    "lobe_GGX_Kelemen(vec3,vec3,vec3,vec3,float)": microfacet(lambda N, V, L, alpha: V_Kelemen_vectors(V, L)),
    "lobe_G_Vgroove(float,float,float,float)": G_Vgroove,
    "lobe_V_Vgroove(float,float,float,float)": V_Vgroove,
    "lobe_V_Kelemen(float)": V_Kelemen,
    "lobe_V_Kelemen(vec3,vec3)": V_Kelemen_vectors,
}
