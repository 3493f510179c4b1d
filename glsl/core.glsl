// The ground that every lobe stands on: constants, the roughness convention, half-vector helpers, and one policy.
// needs  nothing
//
// CONVENTION. A lobe returns f in 1/sr: 1/pi is in, the cosine is out. N V L H point away from the surface and are
// unit vectors, but for an H that a header allows any length. Colours are linear RGB.
//     color += lobe_GGX(N, V, L, f0, alpha) * light * max(dot(N, L), 0.0);
// ESSL has no default float precision in fragment shaders: write `precision highp float;` before this file. mediump
// does not do for directions, whatever the formula.
//
// POLICY. One for all files.
// * Domain: the ranges of the param lines, unit directions, cosines in 0..1. There each function keeps its tolerance
//   |got - exact| <= units 2^-24 (1 + kappa) |exact|, with kappa the condition number of the function at its inputs.
//   The exact value is that of the directions brought to unit length, which float32 can only nearly give them.
// * Finite everywhere: every finite input, in the domain or not, gives a finite result that is not negative. Vectors
//   may be up to 1e8 long, so that their powers stay finite. NaN and Inf carry no promise. The guards are on inputs,
//   since a compiler may assume that NaN does not exist and delete a repair that comes after it.
// * alpha is floored at 1e-4 in D and in whole lobes, not in G and V, which have a limit at 0. Above 1000 it is cut.
// * Horizon: a reflection lobe is 0 unless NdotV > 0 and NdotL > 0; some count a cosine below 1e-15 as 0. Terms
//   (D G V F) have no horizon rule: G, V and F take a negative cosine for 0; D below the horizon is finite, and no more
//   is said of it.
// * Colours: whole lobes clamp f0 and albedo to 0..1. Terms take a negative f0 for 0 and leave one above 1 alone:
//   gold's red is 1.038.
// * Built-in sin, cos, tan and their inverses are not called: Vulkan lets them be 2^-11 off. lobe_circle and lobe_angle_of_half are.
// * V = -L: no half vector exists. A lobe is 0, since one of the two is not above the horizon; so are LdotH and
//   |N x H|^2, and D of a null H.
// * V = N, L = N: ordinary inputs, since nothing is divided by a sine. A cosine above 1, such as N.H = 1 + 1 ulp, is 1.
// * eta = 1: F = 0 and T = 1 at every angle, grazing included, since there is no interface.
// * k = 0: a conductor is a dielectric.
// * Directions off unit length are taken as they come: nothing here normalises again. 1e-4 too long or too short costs
//   less than 1 % for 99 of 100 directions, more where V and L are nearly opposite (docs/stability.md has each function).
// * f0 >= 1 belongs to no eta: lobe_eta takes it for 1 - 2^-24.
#ifndef LOBE_CORE_GLSL
#define LOBE_CORE_GLSL

#define LOBE_VERSION 100

const float LOBE_INV_PI = 0.318309886;  // 1/pi
const float LOBE_ALPHA_MIN = 1e-4;  // floor of alpha: below it float32 directions do not resolve the highlight
const float LOBE_ALPHA_MAX = 1e3;  // ceiling of alpha: alpha^2 times a rounding stays below 1
const float LOBE_SMALLEST_DIVISOR = 1e-30;  // leaves room for D below the largest float32, 3.4e38
const float LOBE_SMALLEST_COSINE = 1e-15;  // where a cosine, or the product of two, divides

// Microfacet width from the artist's roughness.
//   alpha = roughness^2
// param  roughness  float  0..1  0.5  perceptual roughness
// units   8
// source  Burley 2012, section 5.4
float lobe_alpha(float roughness) {
    float r = clamp(roughness, 0.0, 1.0);
    return r * r;
}

// Half vector of two directions, V + L, freed of what their unequal lengths put into it. Not normalised.
//   H = V + L
// units   8
// source  Torrance, Sparrow 1967
// Why this form: float32 directions are up to 1e-7 too long or too short. Near grazing, where V + L is short, that
// turns the half vector by more than a narrow lobe is wide. Unit V and L have (V + L).(V - L) = 0; what the sum has
// along V - L comes from unequal lengths and is taken out.
vec3 lobe_H(vec3 V, vec3 L) {
    vec3 H = V + L, across = V - L;
    return H - 0.25 * dot(H, across) * across;
}

// Cosines of two directions, (NdotV, NdotL), whose sum is N.H to its last digits.
//   NdotV = N.V, NdotL = N.L;   H = lobe_H(V, L)
// units   8
// source  N.H = N.V + N.L
// Why this form: where V and L are grazing and nearly opposite, each product is rounding noise beside the sum, which rules
// masking as it rules the distribution. There the larger one is what the smaller leaves of N.H. Where H is longer than
// 1/8, N.H rounds no better than a product whose own terms are small.
vec2 lobe_cosines(vec3 N, vec3 V, vec3 L, vec3 H) {
    vec2 c = vec2(dot(N, V), dot(N, L));
    if (dot(H, H) > 0.015625) return c;
    float NdotH = dot(N, H);
    return abs(c.x) < abs(c.y) ? vec2(c.x, NdotH - c.x) : vec2(NdotH - c.y, c.y);
}

// Cosine between either direction and the half vector between them.
//   L.H = V.H = |V + L| / 2
// units   8
// source  Kelemen, Szirmay-Kalos 2001, section 2
// Why this form: dot(L, normalize(V + L)) is wrong by 14 % where L is 0.06 degrees from -V, and NaN at L = -V.
float lobe_LdotH(vec3 V, vec3 L) {
    return 0.5 * length(lobe_H(V, L));
}

// Squared sine between the normal and a half vector of any length; 0 for a null one.
//   sin^2 = |N x H|^2 / |H|^2
// units   8
// source  Lagrange's identity
// Why this form: 1 - NdotH^2 has lost all digits where a narrow highlight lives, the cross product has not.
float lobe_sin2_NH(vec3 N, vec3 H) {
    vec3 X = cross(N, H);
    return min(dot(X, X) / max(dot(H, H), LOBE_SMALLEST_DIVISOR), 1.0);
}

// Point of the unit circle at a share of a full turn, counterclockwise from (1, 0).
//   (cos(2 pi u), sin(2 pi u))
// param  u  float  0..1  0.125  share of a full turn
// units   8
// source  lab/fits.py
// Why this form: a driver's sin and cos may be 2^-11 off, and SwiftShader's are 2e-4. Folded into a quarter turn, which rounds
// nothing near their zeros, both are sin(2 pi x) = x (4 + y q(y)) with y = 1/16 - x^2, within 1e-8: exact at all quarters.
vec2 lobe_circle(float u) {
    float t = clamp(u, 0.0, 1.0);
    float h = min(t, 1.0 - t);
    vec2 x = vec2(0.25 - h, min(h, 0.5 - h)), y = 0.0625 - x * x;
    vec2 c = x * (4.0 + y * (31.9999866 + y * (68.1748199 + y * (66.654541 + y * 39.6573563))));
    return vec2(c.x, t > 0.5 ? -c.y : c.y);
}

// Angle from the tangent of its half, up to a right angle.
//   2 atan(tanHalf)    [rad]
// param  tanHalf  float  0..1  0.1  tangent of half the angle
// units   8
// source  lab/fits.py
// Why this form: a driver's acos and atan are too coarse. Of |V x W| / (|V| |W| + V.W) it is the angle between V and W, which
// keeps its digits at 0. The polynomial is within 6e-9.
float lobe_angle_of_half(float tanHalf) {
    float t = clamp(tanHalf, 0.0, 1.0), x = t * t;
    return t * (2.0 + x * (-0.666665673 + x * (0.399965321 + x * (-0.285238661 + x * (0.21884061 + x * (-0.167546299
           + x * (0.115104186 + x * (-0.061609176 + x * (0.021453878 - x * 0.003507858)))))))));
}

// Quantile of the exponential distribution: how far until a share u of all has stopped.
//   -ln(1 - u)
// param  u  float  0..0.9999999  0.5  uniform random number
// units   8
// source  -ln(1 - u) = 2 artanh(u / (2 - u))
// Why this form: log(1 - u) has no digits where u is small.
float lobe_quantile_exponential(float u) {
    float t = clamp(u, 0.0, 0.9999999);
    float z = t / (2.0 - t), z2 = z * z;
    return t < 0.25 ? z * (2.0 + z2 * (0.666666667 + z2 * (0.4 + z2 * 0.285714286))) : -log(1.0 - t);
}

#endif
