// Cosine lobes: Phong's about the mirror direction, Blinn's about the normal, and what their exponents mean.
// needs  core
#ifndef LOBE_CORE_GLSL
#error "blinn_phong.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_BLINN_PHONG_GLSL
#define LOBE_BLINN_PHONG_GLSL

const float LOBE_EXPONENT_MAX = 1e9;  // ceiling of exponents: alpha = 4e-5

// Exponent of the Blinn-Phong distribution as wide as a Beckmann or GGX one, at its peak. 0 from alpha = 1 on.
//   exponent = 2 / alpha^2 - 2
// param  alpha  float  1e-4..1  0.25  microfacet width
// units   8
// source  Walter et al. 2007, section 5.2
// Why this form: (1 - alpha)(1 + alpha) keeps its digits as alpha nears 1.
float lobe_exponent(float alpha) {
    float a = clamp(alpha, LOBE_ALPHA_MIN, 1.0);
    return 2.0 * (1.0 - a) * (1.0 + a) / (a * a);
}

// Microfacet width of a Blinn-Phong distribution. The inverse of lobe_exponent.
//   alpha = sqrt(2 / (exponent + 2))
// param  exponent  float  0..1e6  50.0  exponent of the cosine between N and H
// units   8
// source  Walter et al. 2007, section 5.2
float lobe_alpha_Phong(float exponent) {
    return sqrt(2.0 / (clamp(exponent, 0.0, LOBE_EXPONENT_MAX) + 2.0));
}

// Blinn's exponent that gives a highlight as wide as Phong's. In the plane of incidence only.
//   exponent of NdotH = 4 exponent of RdotV
// param  exponent  float  0..1e6  50.0  Phong's exponent, of the cosine about the mirror direction
// units   8
// source  Blinn 1977
// Why 4: there the half vector turns by half the angle, and cos(x / 2)^(4 e) is cos(x)^e to second order in x.
float lobe_exponent_Blinn(float exponent) {
    return 4.0 * clamp(exponent, 0.0, LOBE_EXPONENT_MAX);
}

// Power of a cosine c that is told by x = 1 / c - 1, or c^2 by 1 / c^2 - 1: digits of c near 1 are not lost.
//   c^exponent = (1 + x)^-exponent
// param  x         float  0..1e6   0.1   1 / c - 1
// param  exponent  float  0..1e6  50.0   exponent of c
// units   16, exp and log
// source  log(1 + x) = 2 artanh(x / (2 + x))
// Why this form: pow(c, exponent) has an error of exponent roundings of c, or on Vulkan of exponent / 2^21. Only where
// c < 3/4 is log safe. exp2(-exponent log2(1 + x)) costs 10 cycles in place of 34 (NAVI21), 118 units off.
float lobe_inv_pow1p(float x, float exponent) {
    float y = clamp(x, 0.0, 1e30);
    float z = y / (2.0 + y), z2 = z * z;
    float series = z * (2.0 + z2 * (0.666666667 + z2 * (0.4 + z2 * 0.285714286)));
    return exp(-clamp(exponent, 0.0, LOBE_EXPONENT_MAX) * (y < 0.333333333 ? series : log(1.0 + y)));
}

// Gaussian in the place of the power of a cosine: s^exponent where s is near 1, more than it in the tail.
//   exp(-exponent (1 - s))
// param  s         float  0..1    0.9   cosine
// param  exponent  float  0..1e6  50.0  exponent of the cosine
// family  power
// units   16, exp
// source  log(s) = s - 1 to first order
float lobe_pow_Gaussian(float s, float exponent) {
    return exp(clamp(exponent, 0.0, LOBE_EXPONENT_MAX) * (clamp(s, 0.0, 1.0) - 1.0));
}

// Blinn-Phong distribution of facet normals from a cosine, for those who have no vectors.
//   D = (exponent + 2) / (2 pi) NdotH^exponent                                     [1/sr]
// param  exponent  float  1..1e6  50.0  exponent of the cosine
// normalised  yes
// family      gaussian
// units       16, exp and log
// source      Blinn 1977; Walter et al. 2007, eq. 30
// Why this form: NdotH^exponent as exp2 and log2 costs 14 cycles in place of 48 (NAVI21), but is 1e-4 off (rms, to
// exponents of 1e4) where this is 1e-6.
// Take the vector form where the exponent is large: the rounding of NdotH alone costs 0.3 % at 2e4, 10 % at 5e5.
float lobe_D_BlinnPhong(float NdotH, float exponent) {
    float c = clamp(NdotH, 1e-30, 1.0);
    float e = clamp(exponent, 0.0, LOBE_EXPONENT_MAX);
    return 0.5 * LOBE_INV_PI * (e + 2.0) * lobe_inv_pow1p((1.0 - c) / c, e);
}

// Blinn-Phong distribution of facet normals; H may have any length.
//   D = (exponent + 2) / (2 pi) (1 + tan^2)^(-exponent / 2),   tan = |N x H| / (N.H)          [1/sr]
// param  exponent  float  1..1e6  50.0  exponent of the cosine between N and H
// normalised  yes
// family      gaussian
// units       16, exp and log
// source      Blinn 1977; Walter et al. 2007, eq. 30
float lobe_D_BlinnPhong(vec3 N, vec3 H, float exponent) {
    float e = clamp(exponent, 0.0, LOBE_EXPONENT_MAX);
    vec3 X = cross(N, H);
    float NH = dot(N, H);
    if (dot(H, H) == 0.0) return 0.0;
    float tan2 = dot(X, X) / max(NH * NH, LOBE_SMALLEST_DIVISOR);
    return 0.5 * LOBE_INV_PI * (e + 2.0) * lobe_inv_pow1p(tan2, 0.5 * e);
}

// Phong's highlight as a reflectance: normalised, reciprocal, without the 1 / NdotL that the published form implies.
//   f = rs (exponent + 2) / (2 pi) max(0, R.V)^exponent,   R the mirror direction of L       [1/sr]
// param  rs        color  0..1    0.5   albedo at normal incidence, linear RGB
// param  exponent  float  1..1e6  50.0  exponent of the cosine about the mirror direction
// reciprocal  yes
// energy      <= 1
// family      specular
// units       16, exp and log
// source      Phong 1975; Lewis 1994
// Why this form: 1 - R.V = |R - V|^2 / 2 keeps its digits in the highlight, R.V itself where it is small.
vec3 lobe_Phong(vec3 N, vec3 V, vec3 L, vec3 rs, float exponent) {
    float NdotL = dot(N, L);
    vec3 R = 2.0 * NdotL * N - L, miss = R - V;
    float versine = 0.5 * dot(miss, miss);
    float c = versine < 0.5 ? 1.0 - versine : dot(R, V);
    if (min(min(dot(N, V), NdotL), c) <= 0.0) return vec3(0.0);
    float e = clamp(exponent, 0.0, LOBE_EXPONENT_MAX);
    float x = versine / max(c, LOBE_SMALLEST_DIVISOR);
    return clamp(rs, 0.0, 1.0) * (0.5 * LOBE_INV_PI * (e + 2.0) * lobe_inv_pow1p(x, e));
}

// Phong's highlight as published in 1975: his intensity rs cos^exponent has no cosine of the light to multiply it.
//   f = rs max(0, R.V)^exponent / NdotL,   R the mirror direction of L                       [1/sr]
// param  rs        color  0..1    0.5   intensity of the highlight, linear RGB
// param  exponent  float  1..1e6  50.0  exponent of the cosine about the mirror direction
// reciprocal  no, NdotL divides and NdotV does not
// energy      no, 3.1416 at exponent = 1, at 0 degrees: 2 pi / (exponent + 1) there
// family      specular
// units       16, exp and log
// source      Phong 1975
vec3 lobe_Phong_1975(vec3 N, vec3 V, vec3 L, vec3 rs, float exponent) {
    float NdotL = dot(N, L);
    vec3 R = 2.0 * NdotL * N - L, miss = R - V;
    float versine = 0.5 * dot(miss, miss);
    float c = versine < 0.5 ? 1.0 - versine : dot(R, V);
    if (min(min(dot(N, V), NdotL), c) <= 0.0) return vec3(0.0);
    float x = versine / max(c, LOBE_SMALLEST_DIVISOR);
    return clamp(rs, 0.0, 1.0) * (lobe_inv_pow1p(x, exponent) / max(NdotL, LOBE_SMALLEST_DIVISOR));
}

// Blinn-Phong highlight without masking, normalised so that the albedo at normal incidence is rs; less at every other.
//   f = rs (e + 2)(e + 4) / (8 pi (2^(-e/2) + e)) NdotH^e,   e = exponent                    [1/sr]
// param  rs        color  0..1    0.5   albedo at normal incidence, linear RGB
// param  exponent  float  1..1e6  50.0  exponent of the cosine between N and H
// reciprocal  yes
// energy      <= 1
// family      specular
// units       16, exp and log
// source      Blinn 1977; Giesen 2009 for the normalisation
vec3 lobe_BlinnPhong(vec3 N, vec3 V, vec3 L, vec3 rs, float exponent) {
    if (min(dot(N, V), dot(N, L)) <= 0.0) return vec3(0.0);
    float e = clamp(exponent, 0.0, LOBE_EXPONENT_MAX);
    float D = lobe_D_BlinnPhong(N, lobe_H(V, L), e);
    return clamp(rs, 0.0, 1.0) * (D * 0.25 * (e + 4.0) / (exp2(-0.5 * e) + e));
}

// Light direction of Phong's highlight at random: a unit L.
//   L = l turned so that N comes to R, by half a turn about N + R;   R the mirror direction of V
//   l = sin(t) (cos(phi) T + sin(phi) B) + cos(t) N,   cos(t) = (1 - u.y)^(1 / (exponent + 1)), phi = 2 pi u.x
// param  exponent  float  1..1e6  50.0  exponent of the cosine about the mirror direction
// param  u         vec2   0..0.9999999  0.5  uniform random numbers
// units   16, exp and log
// source  Lafortune, Willems 1994
// Why this form: with y = -ln(1 - u.y) / (exponent + 1) it is cos(t) = exp(-y) and sin(t)^2 = 1 - exp(-2 y), from its series
// where y is small, since 1 - cos(t)^2 has no digits there. With M = N + R, L = 2 M.l / |M|^2 M - l has N.L = R.l.
vec3 lobe_sample_Phong(vec3 N, vec3 T, vec3 V, float exponent, vec2 u) {
    float y = lobe_quantile_exponential(u.y) / (clamp(exponent, 0.0, LOBE_EXPONENT_MAX) + 1.0), x = 2.0 * y;
    float c = exp(-y);
    float s2 = x < 0.25 ? x * (1.0 - x * (0.5 - x * (0.166666667 - x * (0.0416666667 - x * (0.00833333333
               - x * 0.00138888889))))) : (1.0 - c) * (1.0 + c);
    vec2 l = sqrt(s2) * lobe_circle(u.x);
    vec3 B = cross(N, T), X = cross(N, V);
    float NdotV = dot(N, V), side = dot(T, X) * l.y - dot(B, X) * l.x;
    float k = c + side / max(1.0 + NdotV, 1e-15);
    return k * (NdotV * N - V) - l.x * T - l.y * B + (NdotV * c + side) * N;
}

// Density of lobe_sample_Phong, over the solid angle of L, which may be anywhere on the sphere.
//   pdf = (exponent + 1) / (2 pi) max(0, R.L)^exponent,   R the mirror direction of V        [1/sr]
// param  exponent  float  1..1e6  50.0  exponent of the cosine about the mirror direction
// units   16, exp and log
// source  Lafortune, Willems 1994
// 0 where V is below the horizon.
// Why this form: the tangent between R and L has digits in the highlight and knows no lengths.
float lobe_pdf_Phong(vec3 N, vec3 V, vec3 L, float exponent) {
    float NdotV = dot(N, V);
    vec3 R = 2.0 * NdotV * N - V, X = cross(R, L);
    float RL = dot(R, L);
    if (min(NdotV, RL) <= 0.0) return 0.0;
    float e = clamp(exponent, 0.0, LOBE_EXPONENT_MAX), tan2 = dot(X, X) / max(RL * RL, LOBE_SMALLEST_DIVISOR);
    return 0.5 * LOBE_INV_PI * (e + 1.0) * lobe_inv_pow1p(tan2, 0.5 * e);
}

// Half vector of Blinn-Phong facets at random: a unit H. The light comes from lobe_reflect(H, V).
//   H = sin(t) (cos(phi) T + sin(phi) B) + cos(t) N,   cos(t) = (1 - u.y)^(1 / (exponent + 2)), phi = 2 pi u.x
// param  exponent  float  1..1e6  50.0  exponent of the cosine between N and H
// param  u         vec2   0..0.9999999  0.5  uniform random numbers
// units   16, exp and log
// source  Walter et al. 2007, eq. 31
// Why this form: it is Phong's lobe of one more exponent, seen along N, whose azimuth 0 lies at -T.
vec3 lobe_sample_BlinnPhong(vec3 N, vec3 T, float exponent, vec2 u) {
    return lobe_sample_Phong(N, -T, N, max(exponent, 0.0) + 1.0, u);
}

// Density of lobe_reflect(H, V) for H = lobe_sample_BlinnPhong(...), over the solid angle of L.
//   pdf = D N.H / (4 V.H),   H of unit length                                      [1/sr]
// param  exponent  float  1..1e6  50.0  exponent of the cosine between N and H
// units   16, exp and log, and the lengths of N, V and L as in lobe_GGX
// source  Walter et al. 2007, eq. 14, 24
// 0 where V or the half vector is below the horizon. L may be below it: such a sample is drawn and has f = 0.
float lobe_pdf_BlinnPhong(vec3 N, vec3 V, vec3 L, float exponent) {
    vec3 H = lobe_H(V, L);
    float NdotV = dot(N, V), NH = dot(N, H);
    if (min(NdotV, NH) <= 0.0) return 0.0;
    return 0.5 * lobe_D_BlinnPhong(N, H, exponent) * (NH / max(dot(H, H), 1e-26));
}

#endif
