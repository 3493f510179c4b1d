"""The third voice: every function of the reference once more, at 50 digits, in textbook form.

ORACLE maps a function's key, `name(type,...)` as GLSL spells it, to a callable that takes the arguments in the order of
the signature (numbers, and sequences of numbers for vectors) and returns an mpf or a list of them. Forms that a float
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
U_LIMIT = 1 - mpf(2) ** -23  # where lobe_quantile_exponential() stops growing: 0.9999999 as binary32 holds it
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


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    """`a` at length 1; a null vector stays as it is."""
    a = [mpf(x) for x in a]
    return scale(a, 1 / length(a)) if any(a) else a


def angle(a, b):
    """Angle between two unit vectors (Kahan: the half angle's tangent)."""
    return 2 * mp.atan2(length(add(a, scale(b, -1))), length(add(a, b)))


def above_horizon(N, V, L):
    return dot(N, V) > 0 and dot(N, L) > 0


def frame(N, T):
    """T made orthogonal to N, B = N x T, and N: the rows of the rotation into the local frame."""
    N, T = unit(N), [mpf(x) for x in T]
    T = unit(add(T, scale(N, -dot(N, T))))
    return T, cross(N, T), N


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


def circle(u):
    """By the half turns from the positive x axis: exact at each quarter, where 2 pi would be rounded."""
    half_turns = 2 * min(max(mpf(u), mpf(0)), mpf(1))
    return [mp.cospi(half_turns), mp.sinpi(half_turns)]


def exponential(u):
    """The quantile -ln(1 - u); of any binary32 u, 50 digits hold 1 - u exactly."""
    return -mp.log(1 - min(max(mpf(u), mpf(0)), U_LIMIT))


def angle_of_half(tangent):
    """The angle by its own sine and cosine, 2 t / (1 + t^2) and (1 - t^2) / (1 + t^2), without their divisor."""
    t = min(max(mpf(tangent), mpf(0)), mpf(1))
    return mp.atan2(2 * t, 1 - t**2)


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


def mean(pair):
    return mp.fsum(pair) / 2


def F_dielectric_sp(cosI, eta):
    """Fresnel's sine and tangent laws (Hecht, Optics, eqs. 4.42, 4.43)."""
    if eta == 1:
        return [mpf(0)] * 2
    if cosI == 1:
        return [f0_of_eta(eta)] * 2
    i, t = mp.acos(cosI), refracted_angle(cosI, eta)
    if t is None:
        return [mpf(1)] * 2
    r_s = mp.sin(i - t) / mp.sin(i + t)
    r_p = mp.tan(i - t) / mp.tan(i + t)
    return [r_s**2, r_p**2]


def T_dielectric_sp(cosI, eta):
    """Transmitted power from Fresnel's sine laws for the transmitted amplitudes, not from 1 - F."""
    if eta == 1:
        return [mpf(1)] * 2
    if cosI == 1:
        return [4 * mpf(eta) / (1 + mpf(eta)) ** 2] * 2
    i, t = mp.acos(cosI), refracted_angle(cosI, eta)
    if t is None or cosI == 0:
        return [mpf(0)] * 2
    t_s = 2 * mp.cos(i) * mp.sin(t) / mp.sin(i + t)
    t_p = t_s / mp.cos(i - t)
    beam = eta * mp.cos(t) / mp.cos(i)
    return [beam * t_s**2, beam * t_p**2]


def F_dielectric(cosI, eta):
    return mean(F_dielectric_sp(cosI, eta))


def T_dielectric(cosI, eta):
    return mean(T_dielectric_sp(cosI, eta))


def F_conductor_sp(cosI, eta, k):
    """Fresnel's amplitudes with the complex index n = eta + ik (Born, Wolf, Principles of Optics, 14.2)."""
    if eta == 1 and k == 0:
        return [mpf(0)] * 2
    n, cosI = mp.mpc(eta, k), mpf(cosI)
    q = mp.sqrt(n**2 - (1 - cosI**2))  # n cosT, of the branch that decays
    r_s = (cosI - q) / (cosI + q)
    r_p = (n**2 * cosI - q) / (n**2 * cosI + q)
    return [abs(r_s) ** 2, abs(r_p) ** 2]


def F_conductor(cosI, eta, k):
    return mean(F_conductor_sp(cosI, eta, k))


def F_conductor_rgb(cosI, eta, k):
    return [F_conductor(cosI, a, b) for a, b in zip(eta, k)]


def f0_of_index(eta, k):
    """|(n - 1)/(n + 1)|^2 with n = eta + ik."""
    n = mp.mpc(eta, k)
    return abs((n - 1) / (n + 1)) ** 2


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


def F82_unclamped(cosI, f0, f82):
    """Lazanyi, Szirmay-Kalos 2005 with Hoffman's parameter (2019): Schlick less what brings it to f82 at cosI = 1/7."""
    bump = lambda c: c * (1 - c) ** 6
    c, c82 = min(max(mpf(cosI), mpf(0)), mpf(1)), mpf(1) / 7
    return F_Schlick(c, f0) - (F_Schlick(c82, f0) - f82) * bump(c) / bump(c82)


def F_F82(cosI, f0, f82):
    return [max(F82_unclamped(cosI, a, mpf(b)), mpf(0)) for a, b in zip(f0, f82)]


def F_F82_tint(cosI, f0, tint):
    """Kutz, Hasan, Edmondson 2021: f82 as a fraction of what Schlick has there."""
    return F_F82(cosI, f0, [t * F_Schlick(mpf(1) / 7, f) for f, t in zip(f0, tint)])


def F_Hall(cosI, f0, eta0):
    """Hall's colour shift (Cook, Torrance 1982): from f0 to white, as far as a dielectric of eta0 has come to 1."""
    base = f0_of_eta(eta0)
    shift = max(F_dielectric(cosI, eta0) - base, mpf(0)) / (1 - base)
    return [mpf(f) + (1 - mpf(f)) * shift for f in f0]


def F_Schlick_fast(cosI, f0):
    """Lagarde 2012: the fifth power of Schlick's 1 - cosI as a power of two."""
    c = min(max(mpf(cosI), mpf(0)), mpf(1))
    return [mpf(f) + (1 - mpf(f)) * mp.power(2, (mpf("-5.55473") * c - mpf("6.98316")) * c) for f in f0]


def F_conductor_fast(cosI, eta, k):
    """Lazanyi, Szirmay-Kalos 2005, eq. 4: the exact values at both ends, Schlick's fifth power between."""
    c = min(max(mpf(cosI), mpf(0)), mpf(1))
    between = lambda n, x: ((n - 1) ** 2 + 4 * n * (1 - c) ** 5 + x**2) / ((n + 1) ** 2 + x**2)
    return [between(mpf(n), mpf(x)) for n, x in zip(eta, k)]


# Directions

def mirrored(N, V):
    """V turned by 180 degrees about N."""
    return add(scale(N, 2 * dot(N, V)), scale(V, -1))


def reflect(N, V):
    return mirrored(unit(N), unit(V))


def refract(N, V, eta):
    """Snell's law for the part along the surface; the rest of the unit length points into it."""
    N, V = unit(N), unit(V)
    along = scale(add(V, scale(N, -dot(N, V))), -1 / mpf(eta))
    sin2T = dot(along, along)
    return add(along, scale(N, -mp.sqrt(1 - sin2T))) if sin2T <= 1 else [mpf(0)] * 3


# Microfacets: parts that every distribution shares

def correlated(Lambda):
    """G2(NdotV, NdotL, alpha) of Smith's Lambda: masking and shadowing correlated by height (Heitz 2014, eq. 99)."""
    def G2(NdotV, NdotL, alpha):
        if NdotV == 0 or NdotL == 0:
            return mpf(0)
        return 1 / (1 + Lambda(NdotV, alpha) + Lambda(NdotL, alpha))
    return G2


def visibility(G2):
    """V(NdotV, NdotL, ...) = G2/(4 NdotV NdotL), with its limit where a cosine is 0."""
    def V(NdotV, NdotL, *parameters):
        NdotV, NdotL = mpf(NdotV) or GRAZING, mpf(NdotL) or GRAZING
        return G2(NdotV, NdotL, *parameters) / (4 * NdotV * NdotL)
    return V


def F_Schlick_of_lobe(cosI, f0):
    return F_Schlick_rgb(cosI, [min(mpf(c), mpf(1)) for c in f0])


def microfacet(D, visibility, F=F_Schlick_of_lobe):
    """The lobe F D V with F at L.H; D takes N, H, alpha, `visibility` N, V, L, alpha, and F what lies between."""
    def f(N, V, L, *parameters):
        *colours, alpha = parameters
        alpha = max(mpf(alpha), ALPHA_FLOOR)
        DV = D(N, add(V, L), alpha) * visibility(N, V, L, alpha)
        return scale(F(LdotH(V, L), *colours), DV)
    return lobe(f)


def of_cosines(visibility):
    """visibility(NdotV, NdotL, alpha) as a function of the vectors."""
    return lambda N, V, L, alpha: visibility(cosine(N, V), cosine(N, L), alpha)


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


G2_GGX = correlated(Lambda_GGX)
V_GGX = visibility(G2_GGX)


def G2_GGX_separable(NdotV, NdotL, alpha):
    return G1_GGX(NdotV, alpha) * G1_GGX(NdotL, alpha)


V_GGX_separable = visibility(G2_GGX_separable)


def V_GGX_fast(NdotV, NdotL, alpha):
    """Hammon 2017: the correlated denominator 2 NdotL NdotV at alpha 0 and NdotL + NdotV at alpha 1, mixed."""
    NdotV, NdotL, alpha = mpf(NdotV), mpf(NdotL), mpf(alpha)
    mixed = (1 - alpha) * 2 * NdotL * NdotV + alpha * (NdotL + NdotV)
    return 1 / (2 * mixed) if mixed else mp.inf


def D_GGX_half(N, H, alpha):
    """No more than half precision holds; of a null half vector nothing."""
    return min(D_GGX_vectors(N, H, alpha), mpf(65504)) if any(H) else mpf(0)


def slopes(x, y, z):
    """The slopes of the facet whose normal is (x, y, z)."""
    return x / z, y / z


def D_GGX_aniso(NdotH, TdotH, BdotH, alphaX, alphaY):
    """The density of slopes over cos^4, the slopes stretched by alphaX and alphaY."""
    ax, ay = (max(mpf(a), ALPHA_FLOOR) for a in (alphaX, alphaY))
    z = mpf(NdotH) or GRAZING
    x, y = slopes(TdotH, BdotH, z)
    return 1 / (mp.pi * ax * ay * (1 + (x / ax) ** 2 + (y / ay) ** 2) ** 2 * z**4)


def Lambda_GGX_aniso(c, t, b, alphaX, alphaY):
    """Heitz 2014: only the roughness along the direction's own azimuth counts; a^2 is its square by tan^2."""
    x, y = slopes(t, b, c)
    return (mp.sqrt(1 + (alphaX * x) ** 2 + (alphaY * y) ** 2) - 1) / 2


def V_GGX_aniso(NdotV, NdotL, TdotV, BdotV, TdotL, BdotL, alphaX, alphaY):
    NdotV, NdotL = mpf(NdotV) or GRAZING, mpf(NdotL) or GRAZING
    masked = Lambda_GGX_aniso(NdotV, TdotV, BdotV, alphaX, alphaY)
    shadowed = Lambda_GGX_aniso(NdotL, TdotL, BdotL, alphaX, alphaY)
    return 1 / ((1 + masked + shadowed) * 4 * NdotV * NdotL)


def GGX_aniso(N, T, V, L, f0, alphaX, alphaY):
    axes = frame(N, T)
    alphas = [max(mpf(a), ALPHA_FLOOR) for a in (alphaX, alphaY)]

    @lobe
    def local(N, V, L):
        if not any(add(V, L)):
            return [mp.nan] * 3
        (vx, vy, vz), (lx, ly, lz), (hx, hy, hz) = (
            [dot(axis, X) for axis in axes] for X in (V, L, unit(add(V, L))))
        DV = D_GGX_aniso(hz, hx, hy, *alphas) * V_GGX_aniso(vz, lz, vx, vy, lx, ly, *alphas)
        return scale(F_Schlick_of_lobe(LdotH(V, L), f0), DV)
    return local(N, V, L)


def pdf_GGX(N, V, L, alpha):
    """The density D_V of visible normals (Heitz 2014, eq. 16), by dH/dL = 1/(4 V.H) (Walter et al. 2007, eq. 14)."""
    N, V, L = unit(N), unit(V), unit(L)
    H, alpha = add(V, L), max(mpf(alpha), ALPHA_FLOOR)
    if dot(N, V) <= 0 or dot(N, H) <= 0:
        return mpf(0)
    return D_GGX_vectors(N, H, alpha) * G1_GGX(cosine(N, V), alpha) / (4 * cosine(N, V))


def sample_GGX(N, T, V, alpha, u):
    """Dupuy, Benyoub 2023: seen along V, the unit hemisphere's visible part mirrors V to a spherical cap.

    alpha stretches the surface to that hemisphere, and back.
    """
    axes, alpha = frame(N, T), max(mpf(alpha), ALPHA_FLOOR)
    x, y, z = (dot(axis, unit(V)) for axis in axes)
    stretched = unit([alpha * x, alpha * y, z])
    cos_cap = (1 - mpf(u[1])) * (1 + stretched[2]) - stretched[2]
    sin_cap = mp.sqrt(max(1 - cos_cap**2, mpf(0)))
    phi = 2 * mp.pi * u[0]
    h = add([sin_cap * mp.cos(phi), sin_cap * mp.sin(phi), cos_cap], stretched)
    if not any(h):
        return [mp.nan] * 3
    H = unit([alpha * h[0], alpha * h[1], max(h[2], mpf(0))])
    return [dot(H, column) for column in zip(*axes)]


# Beckmann: normally distributed slopes

def D_Beckmann_of_angle(theta, alpha):
    """Walter et al. 2007, eq. 25."""
    alpha, c = max(mpf(alpha), ALPHA_FLOOR), mp.cos(theta)
    return mp.exp(-((mp.tan(theta) / alpha) ** 2)) / (mp.pi * alpha**2 * c**4) if c > GRAZING else mpf(0)


def D_Beckmann(NdotH, alpha):
    return D_Beckmann_of_angle(mp.acos(NdotH), alpha)


def D_Beckmann_vectors(N, H, alpha):
    return D_Beckmann_of_angle(angle(unit(N), unit(H)), alpha) if any(H) else mp.nan


def D_Beckmann_aniso(NdotH, TdotH, BdotH, alphaX, alphaY):
    """Two normal densities of standard deviation alpha/sqrt(2), one for each slope, over cos^4."""
    if NdotH == 0:
        return mpf(0)
    density = lambda slope, alpha: mp.exp(-((slope / alpha) ** 2)) / (mp.sqrt(mp.pi) * alpha)
    x, y = slopes(TdotH, BdotH, mpf(NdotH))
    ax, ay = (max(mpf(a), ALPHA_FLOOR) for a in (alphaX, alphaY))
    return density(x, ax) * density(y, ay) / mpf(NdotH) ** 4


def cotangent_over_alpha(c, alpha):
    """Walter's a, infinite where nothing is masked."""
    width = alpha * mp.sqrt(1 - mpf(c) ** 2)
    return c / width if width else mp.inf


def Lambda_Beckmann(c, alpha):
    """From Walter et al. 2007, eq. 26. test_reference.py holds it to Smith's integral over the slopes."""
    a = cotangent_over_alpha(c, alpha)
    if a > 100:  # below 10^-4000
        return mpf(0)
    return mp.exp(-(a**2)) / (2 * a * mp.sqrt(mp.pi)) - mp.erfc(a) / 2


def G1_Beckmann(NdotX, alpha):
    return 1 / (1 + Lambda_Beckmann(NdotX, alpha)) if NdotX else mpf(0)


def G1_Beckmann_fast(NdotX, alpha):
    """Walter et al. 2007, eq. 27, which passes 1 by 6e-5 just below a = 1.6."""
    a = cotangent_over_alpha(NdotX, alpha) if NdotX else mpf(0)
    if a >= mpf("1.6"):
        return mpf(1)
    fit = (mpf("3.535") * a + mpf("2.181") * a**2) / (1 + mpf("2.276") * a + mpf("2.577") * a**2)
    return min(fit, mpf(1))


G2_Beckmann = correlated(Lambda_Beckmann)
V_Beckmann = visibility(G2_Beckmann)


# Masking without a distribution

def G_Vgroove(NdotV, NdotL, NdotH, VdotH):
    """Torrance, Sparrow 1967; in this form Cook, Torrance 1982, eq. 15."""
    if VdotH == 0:
        return mp.nan
    return min(mpf(1), *(2 * mpf(NdotH) * mpf(c) / mpf(VdotH) for c in (NdotV, NdotL)))


V_Vgroove = visibility(G_Vgroove)


def V_Vgroove_of_lobe(N, V, L, alpha):
    H = unit(add(V, L))
    return V_Vgroove(cosine(N, V), cosine(N, L), cosine(N, H), LdotH(V, L))


def V_Kelemen(LdotH):
    """Kelemen, Szirmay-Kalos 2001: G/(NdotV NdotL) is 1/LdotH^2."""
    return 1 / (4 * mpf(LdotH) ** 2) if LdotH else mp.inf


def V_Kelemen_vectors(V, L):
    return V_Kelemen(LdotH(V, L))


def V_Kelemen_of_lobe(N, V, L, alpha):
    return V_Kelemen_vectors(V, L)


def V_Neumann(NdotV, NdotL):
    """Neumann et al. 1999: over the larger cosine alone."""
    larger = max(mpf(NdotV), mpf(NdotL))
    return 1 / (4 * larger) if larger > 0 else mp.inf


# Powers of a cosine

def pow_Gaussian(s, exponent):
    """e^-x for (1 - x/n)^n, x = n (1 - s)."""
    return mp.exp(-max(mpf(exponent), mpf(0)) * (1 - min(max(mpf(s), mpf(0)), mpf(1))))


def pow_Schlick(s, h):
    """Schlick 1994, section 2; 0 at s = 0."""
    s, h = min(max(mpf(s), mpf(0)), mpf(1)), max(mpf(h), mpf(0))
    return s / (h - h * s + s) if s else mpf(0)


def D_BlinnPhong(NdotH, exponent):
    """Blinn 1977, scaled to the projected area of the surface."""
    return (mpf(exponent) + 2) / (2 * mp.pi) * mpf(NdotH) ** mpf(exponent)


def D_BlinnPhong_vectors(N, H, exponent):
    return D_BlinnPhong(max(mp.cos(angle(unit(N), unit(H))), mpf(0)), exponent) if any(H) else mp.nan


def phong_cosine(N, V, L):
    """Of the angle between V and the mirrored L, 0 where it is obtuse."""
    return max(mp.cos(angle(mirrored(N, L), V)), mpf(0))


@lobe
def Phong(N, V, L, rs, exponent):
    lobe_of_one = (mpf(exponent) + 2) / (2 * mp.pi) * phong_cosine(N, V, L) ** mpf(exponent)
    return [mpf(c) * lobe_of_one for c in rs]


@lobe
def Phong_1975(N, V, L, rs, exponent):
    """Phong 1975 adds W cos^n to what leaves the surface; the cosine of the incidence must not weaken it."""
    return [mpf(c) * phong_cosine(N, V, L) ** mpf(exponent) / cosine(N, L) for c in rs]


@lobe
def BlinnPhong(N, V, L, rs, exponent):
    """The factor makes the albedo rs at normal incidence, where theta_H is half of theta_L."""
    if not any(add(V, L)):
        return [mp.nan] * 3
    e = mpf(exponent)
    factor = (e + 2) * (e + 4) / (8 * mp.pi * (mp.power(2, -e / 2) + e))
    return [mpf(c) * factor * mp.cos(angle(N, unit(add(V, L)))) ** e for c in rs]


def exponent_of_alpha(alpha):
    """Equal curvature at the peak of D_BlinnPhong and D_Beckmann, above 1 the flattest lobe."""
    return max(2 / max(mpf(alpha), ALPHA_FLOOR) ** 2 - 2, mpf(0))


def alpha_of_exponent(exponent):
    return mp.sqrt(2 / (mpf(exponent) + 2))


def exponent_Blinn(exponent):
    """In the plane of incidence H turns half as far as R: cos^(4e)(x/2) and cos^e(x) have equal curvature at 0."""
    return 4 * mpf(exponent)


# Diffuse

@lobe
def Lambert(N, V, L, albedo):
    return [mpf(c) / mp.pi for c in albedo]


def cosine_of_azimuths(N, V, L):
    """cos(phi_V - phi_L) by the parts along the surface; 0 where one is null and it cannot matter."""
    v, l = (unit(add(X, scale(N, -dot(N, X)))) for X in (V, L))
    return dot(v, l)


@lobe
def OrenNayar(N, V, L, albedo, sigma):
    """Oren, Nayar 1994, the full model, before eq. 30 simplifies it: direct reflection and one interreflection.

    Where both angles graze, on opposite sides of N, a dark and rough surface would get less than 0: it is black there.
    """
    s2 = mpf(sigma) ** 2
    theta = angle(N, V), angle(N, L)
    a, b, c = max(theta), min(theta), cosine_of_azimuths(N, V, L)
    C1 = 1 - s2 / (2 * (s2 + mpf("0.33")))
    C2 = mpf("0.45") * s2 / (s2 + mpf("0.09")) * (mp.sin(a) - (0 if c >= 0 else (2 * b / mp.pi) ** 3))
    C3 = mpf("0.125") * s2 / (s2 + mpf("0.09")) * (4 * a * b / mp.pi**2) ** 2
    direct = C1 + c * C2 * mp.tan(b) + (1 - abs(c)) * C3 * mp.tan((a + b) / 2)
    again = mpf("0.17") * s2 / (s2 + mpf("0.13")) * (1 - c * (2 * b / mp.pi) ** 2)
    return [max(mpf(rho) * direct + mpf(rho) ** 2 * again, mpf(0)) / mp.pi for rho in albedo]


@lobe
def OrenNayar_qualitative(N, V, L, albedo, sigma):
    """Oren, Nayar 1994, eq. 30, by the angles themselves."""
    s2 = mpf(sigma) ** 2
    A = 1 - s2 / (2 * (s2 + mpf("0.33")))
    B = mpf("0.45") * s2 / (s2 + mpf("0.09"))
    theta = angle(N, V), angle(N, L)
    bracket = A + B * max(mpf(0), cosine_of_azimuths(N, V, L)) * mp.sin(max(theta)) * mp.tan(min(theta))
    return [mpf(c) / mp.pi * bracket for c in albedo]


# EON: Portsmouth, Kutz, Hill 2025. Fujii's Oren-Nayar (FON) and a lobe for the light that it loses.

def A_FON(roughness):
    return 1 / (1 + (mpf(1) / 2 - 2 / (3 * mp.pi)) * roughness)


def E_FON(mu, roughness):
    """Albedo of white FON, by the angle."""
    theta = mp.acos(mpf(mu) or GRAZING)
    s, c, t = mp.sin(theta), mp.cos(theta), mp.tan(theta)
    G = s * (theta - s * c) + mpf(2) / 3 * (t * (1 - s**3) - s)
    return A_FON(roughness) * (1 + roughness * G / mp.pi)


def loss_EON(mu):
    """What white FON of roughness 1 loses, over A."""
    return (1 - E_FON(mu, 1)) / A_FON(1)


def E_average_FON(roughness):
    return A_FON(roughness) * (1 + (mpf(2) / 3 - 28 / (15 * mp.pi)) * roughness)


def rho_multiple(rho, roughness):
    """What comes back after two and more bounces: the geometric series."""
    E = E_average_FON(roughness)
    return rho**2 * E / (1 - rho * (1 - E))


def EON(E):
    @lobe
    def f(N, V, L, albedo, roughness):
        NV, NL, r = cosine(N, V), cosine(N, L), min(mpf(roughness), 1)
        if r == 0:
            return [mpf(rho) / mp.pi for rho in albedo]
        s = cosine_of_azimuths(N, V, L) * mp.sin(angle(N, V)) * mp.sin(angle(N, L))
        single = A_FON(r) * (1 + r * s / (max(NV, NL) if s > 0 else 1))
        lost = (1 - E(NV, r)) * (1 - E(NL, r)) / (1 - E_average_FON(r))
        return [(mpf(rho) * single + rho_multiple(mpf(rho), r) * lost) / mp.pi for rho in albedo]
    return f


def albedo_EON(E):
    def albedo_of(NdotV, albedo, roughness):
        r = min(mpf(roughness), 1)
        e = E(mpf(NdotV), r)
        return [mpf(rho) * e + rho_multiple(mpf(rho), r) * (1 - e) for rho in albedo]
    return albedo_of


# Energy

def alpha_filtered(alpha, dNdx, dNdy):
    """Tokuyoshi, Kaplanyan 2019, 2021: slopes vary within a pixel; their variance adds to alpha^2, within limits."""
    variance = mpf("0.15915494") * (dot(dNdx, dNdx) + dot(dNdy, dNdy))
    return mp.sqrt(min(mpf(alpha) ** 2 + min(2 * variance, mpf("0.18")), mpf(1)))


def albedo_GGX(NdotV, alpha, weight=lambda VdotH: 1):
    """int weight(V.H) D V N.L dL of the correlated lobe, to 9 digits and more; far too slow for the table below.

    In facets, D N.H dH is sin(2x) dx dphi/(2 pi) with alpha tan(x) the slope, and the bounds are where L meets the
    horizon: at all azimuths when H tilts less than 45 degrees - theta_V/2, at none beyond 45 degrees + theta_V/2.
    """
    mu, theta_V = mpf(NdotV), mp.acos(NdotV)

    def ring(x):
        slope = alpha * mp.tan(x)
        cosH = 1 / mp.sqrt(1 + slope**2)

        def facet(phi):
            VdotH = (mu + mp.sin(theta_V) * slope * mp.cos(phi)) * cosH
            NdotL = max(2 * VdotH * cosH - mu, GRAZING)
            return weight(VdotH) * VdotH / (mu * cosH) * G2_GGX(mu, min(NdotL, 1), alpha)

        rim = mu * (slope**2 - 1) / (2 * mp.sin(theta_V) * slope) if theta_V else mpf(-1)
        return mp.sin(2 * x) / mp.pi * mp.quad(facet, [0, mp.acos(min(max(rim, -1), 1))])

    tilts = [0, mp.pi / 4 - theta_V / 2, mp.pi / 4 + theta_V / 2] if theta_V else [0, mp.pi / 4]
    with mp.workdps(15):
        return mp.quad(ring, [mp.atan(mp.tan(tilt) / alpha) for tilt in tilts])


ORACLE = {
    "lobe_alpha(float)": alpha_of_roughness,
    "lobe_H(vec3,vec3)": lambda V, L: [v + l for v, l in zip(unit(V), unit(L))],
    "lobe_cosines(vec3,vec3,vec3,vec3)": lambda N, V, L, H: [cosine(unit(N), unit(V)), cosine(unit(N), unit(L))],
    "lobe_LdotH(vec3,vec3)": LdotH,
    "lobe_sin2_NH(vec3,vec3)": sin2_NH,
    "lobe_circle(float)": circle,
    "lobe_quantile_exponential(float)": exponential,
    "lobe_angle_of_half(float)": angle_of_half,
    "lobe_reflect(vec3,vec3)": reflect,
    "lobe_refract(vec3,vec3,float)": refract,
    "lobe_F_dielectric(float,float)": F_dielectric,
    "lobe_T_dielectric(float,float)": T_dielectric,
    "lobe_F_dielectric_sp(float,float)": F_dielectric_sp,
    "lobe_T_dielectric_sp(float,float)": T_dielectric_sp,
    "lobe_F_conductor(float,float,float)": F_conductor,
    "lobe_F_conductor(float,vec3,vec3)": F_conductor_rgb,
    "lobe_F_conductor_sp(float,float,float)": F_conductor_sp,
    "lobe_F_Schlick(float,float)": F_Schlick,
    "lobe_F_Schlick(float,float,float)": F_Schlick,
    "lobe_F_Schlick(float,vec3)": F_Schlick_rgb,
    "lobe_F_Schlick(float,vec3,vec3)": F_Schlick_rgb,
    "lobe_F_F82(float,vec3,vec3)": F_F82,
    "lobe_F_F82_tint(float,vec3,vec3)": F_F82_tint,
    "lobe_F_Hall(float,vec3,float)": F_Hall,
    "lobe_F_Schlick_fast(float,vec3)": F_Schlick_fast,
    "lobe_F_conductor_fast(float,vec3,vec3)": F_conductor_fast,
    "lobe_f0(float)": f0_of_eta,
    "lobe_f0(float,float)": f0_of_index,
    "lobe_f0(vec3,vec3)": lambda eta, k: [f0_of_index(*index) for index in zip(eta, k)],
    "lobe_eta(float)": eta_of_f0,
    "lobe_cosT(float,float)": cosT,
    "lobe_cos_critical(float)": cos_critical,
    "lobe_D_GGX(float,float)": D_GGX,
    "lobe_D_GGX(vec3,vec3,float)": D_GGX_vectors,
    "lobe_D_GGX_half(vec3,vec3,float)": D_GGX_half,
    "lobe_D_GGX_aniso(float,float,float,float,float)": D_GGX_aniso,
    "lobe_G1_GGX(float,float)": G1_GGX,
    "lobe_G2_GGX(float,float,float)": G2_GGX,
    "lobe_G2_GGX_separable(float,float,float)": G2_GGX_separable,
    "lobe_V_GGX(float,float,float)": V_GGX,
    "lobe_V_GGX_separable(float,float,float)": V_GGX_separable,
    "lobe_V_GGX_fast(float,float,float)": V_GGX_fast,
    "lobe_V_GGX_aniso(float,float,float,float,float,float,float,float)": V_GGX_aniso,
    "lobe_GGX(vec3,vec3,vec3,vec3,float)": microfacet(D_GGX_vectors, of_cosines(V_GGX)),
    "lobe_GGX_Kelemen(vec3,vec3,vec3,vec3,float)": microfacet(D_GGX_vectors, V_Kelemen_of_lobe),
    "lobe_GGX_aniso(vec3,vec3,vec3,vec3,vec3,float,float)": GGX_aniso,
    "lobe_GGX_conductor(vec3,vec3,vec3,vec3,vec3,float)": microfacet(D_GGX_vectors, of_cosines(V_GGX), F_conductor_rgb),
    "lobe_GGX_fast(vec3,vec3,vec3,vec3,float)": microfacet(D_GGX_vectors, of_cosines(V_GGX_fast)),
    "lobe_pdf_GGX(vec3,vec3,vec3,float)": pdf_GGX,
    "lobe_sample_GGX(vec3,vec3,vec3,float,vec2)": sample_GGX,
    "lobe_D_Beckmann(float,float)": D_Beckmann,
    "lobe_D_Beckmann(vec3,vec3,float)": D_Beckmann_vectors,
    "lobe_D_Beckmann_aniso(float,float,float,float,float)": D_Beckmann_aniso,
    "lobe_G1_Beckmann(float,float)": G1_Beckmann,
    "lobe_G1_Beckmann_fast(float,float)": G1_Beckmann_fast,
    "lobe_G2_Beckmann(float,float,float)": G2_Beckmann,
    "lobe_V_Beckmann(float,float,float)": V_Beckmann,
    "lobe_Beckmann(vec3,vec3,vec3,vec3,float)": microfacet(D_Beckmann_vectors, of_cosines(V_Beckmann)),
    "lobe_CookTorrance(vec3,vec3,vec3,vec3,float)": microfacet(D_Beckmann_vectors, V_Vgroove_of_lobe),
    "lobe_G_Vgroove(float,float,float,float)": G_Vgroove,
    "lobe_V_Vgroove(float,float,float,float)": V_Vgroove,
    "lobe_V_Kelemen(float)": V_Kelemen,
    "lobe_V_Kelemen(vec3,vec3)": V_Kelemen_vectors,
    "lobe_V_Neumann(float,float)": V_Neumann,
    "lobe_pow_Gaussian(float,float)": pow_Gaussian,
    "lobe_pow_Schlick(float,float)": pow_Schlick,
    "lobe_D_BlinnPhong(float,float)": D_BlinnPhong,
    "lobe_D_BlinnPhong(vec3,vec3,float)": D_BlinnPhong_vectors,
    "lobe_Phong(vec3,vec3,vec3,vec3,float)": Phong,
    "lobe_Phong_1975(vec3,vec3,vec3,vec3,float)": Phong_1975,
    "lobe_BlinnPhong(vec3,vec3,vec3,vec3,float)": BlinnPhong,
    "lobe_exponent(float)": exponent_of_alpha,
    "lobe_alpha_Phong(float)": alpha_of_exponent,
    "lobe_exponent_Blinn(float)": exponent_Blinn,
    "lobe_Lambert(vec3,vec3,vec3,vec3)": Lambert,
    "lobe_OrenNayar(vec3,vec3,vec3,vec3,float)": OrenNayar,
    "lobe_OrenNayar_qualitative(vec3,vec3,vec3,vec3,float)": OrenNayar_qualitative,
    "lobe_OrenNayar_EON(vec3,vec3,vec3,vec3,float)": EON(E_FON),
    "lobe_OrenNayar_EON_fast(vec3,vec3,vec3,vec3,float)": EON(E_FON),
    "lobe_loss_EON(float)": loss_EON,
    "lobe_loss_EON_fast(float)": loss_EON,
    "lobe_inv_pow1p(float,float)": lambda x, exponent: (1 + mpf(x)) ** -mpf(exponent),
    "lobe_albedo_EON(float,vec3,float)": albedo_EON(E_FON),
    "lobe_albedo_EON_fast(float,vec3,float)": albedo_EON(E_FON),
    "lobe_alpha_filtered(float,vec3,vec3)": alpha_filtered,
}
