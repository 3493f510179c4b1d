// Beckmann microfacets, whose slopes are Gaussian: distribution, Smith masking, and the lobes made of them.
// needs  core, fresnel, masking
#ifndef LOBE_CORE_GLSL
#error "beckmann.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_FRESNEL_GLSL
#error "beckmann.glsl needs fresnel.glsl: put fresnel.glsl before it"
#endif
#ifndef LOBE_MASKING_GLSL
#error "beckmann.glsl needs masking.glsl: put masking.glsl before it"
#endif
#ifndef LOBE_BECKMANN_GLSL
#define LOBE_BECKMANN_GLSL

// Beckmann distribution of facet normals from a cosine, for those who have no vectors.
//   D = exp(-tan^2 / alpha^2) / (pi alpha^2 NdotH^4),   tan^2 = (1 - NdotH^2) / NdotH^2      [1/sr]
// param  alpha  float  1e-4..4  0.25  microfacet width
// normalised  yes
// family      gaussian
// units       16, exp
// source      Beckmann, Spizzichino 1963; Walter et al. 2007, eq. 25
// Take the vector form where alpha is small: the rounding of NdotH alone costs 0.4 % at alpha = 0.01, 8 % at 0.002.
float lobe_D_Beckmann(float NdotH, float alpha) {
    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    float c2 = clamp(NdotH * NdotH, 1e-14, 1.0);
    return exp((c2 - 1.0) / (a * a * c2)) * LOBE_INV_PI / (a * a * c2 * c2);
}

// Beckmann distribution of facet normals; H may have any length.
//   D = exp(-tan^2 / alpha^2) (1 + tan^2)^2 / (pi alpha^2),   tan = |N x H| / (N.H)           [1/sr]
// param  alpha  float  1e-4..4  0.25  microfacet width
// normalised  yes
// family      gaussian
// units       16, exp
// source      Beckmann, Spizzichino 1963; Walter et al. 2007, eq. 25
// Why this form: |N x H| keeps its digits at the peak, where 1 - NdotH^2 has none, and the tangent knows no lengths.
// Half the exponent twice, since exp ends at -87 and V can be large where D is small.
float lobe_D_Beckmann(vec3 N, vec3 H, float alpha) {
    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    vec3 X = cross(N, H);
    float NH = dot(N, H);
    if (dot(H, H) == 0.0) return 0.0;
    float tan2 = min(dot(X, X) / max(NH * NH, LOBE_SMALLEST_DIVISOR), 1e15);
    float k = exp(-0.5 * tan2 / (a * a)) * (1.0 + tan2) / a;
    return k * k * LOBE_INV_PI;
}

// Beckmann distribution of facet normals with a width along each tangent.
//   D = exp(-(TdotH^2 / alphaX^2 + BdotH^2 / alphaY^2) / NdotH^2) / (pi alphaX alphaY NdotH^4)  [1/sr]
// param  NdotH   cosine  1e-6..1  0.9   cosine between the normal and the half vector
// param  alphaX  float   1e-4..4  0.25  microfacet width along T
// param  alphaY  float   1e-4..4  0.25  microfacet width along B
// normalised  yes
// units       16, exp
// source      Beckmann, Spizzichino 1963; Heitz 2014, eq. 81
// Why this form: half the exponent twice, since exp ends at -87 and D, divided by NdotH^4, does not.
float lobe_D_Beckmann_aniso(float NdotH, float TdotH, float BdotH, float alphaX, float alphaY) {
    vec2 a = clamp(vec2(alphaX, alphaY), LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    float c2 = clamp(NdotH * NdotH, 1e-14, 1.0);
    vec2 slope = clamp(vec2(TdotH, BdotH), -1.0, 1.0) / a;
    float k = exp(-0.5 * dot(slope, slope) / c2) / c2;
    return k * k * LOBE_INV_PI / (a.x * a.y);
}

// Smith masking of one direction over Beckmann facets, to the last digits of float32.
//   G1 = 2 / (1 + erf(v) + exp(-v^2) / (v sqrt(pi))),   v = c / (alpha sqrt(1 - c^2)), c = NdotX
// param  NdotX  cosine  1e-6..1  0.7  cosine of the direction
// param  alpha  float   0..4     0.25  microfacet width
// family  masking
// units   16, a rational fit stands for erf and exp
// source  Smith 1967; Walter et al. 2007, section 5.2
// Why this form: G1 / v is smooth, and 2.3e-8 off at most in a rational fit (lab/fits.py). From v = 3.4 on G1 is
// 1 - 3e-8, which is 1.
float lobe_G1_Beckmann(float NdotX, float alpha) {
    float c = clamp(NdotX, 0.0, 1.0);
    float a = clamp(alpha, 0.0, LOBE_ALPHA_MAX);
    float v = min(c / max(a * sqrt(1.0 - c * c), LOBE_SMALLEST_DIVISOR), 3.4);
    float p = 3.54490762 + v * (-0.35654137 + v * (1.0744804 + v * (0.01947172 + v * (0.09094339 + v * 0.02033916))));
    float q = 1.0 + v * (1.67187256 + v * (1.12488903 + v * (0.44176031 + v * (0.17321657 + v * (0.07081444
              + v * 0.02144715)))));
    return min(v * p / q, 1.0);
}

// Smith masking of one direction over Beckmann facets, by Walter's shorter fit.
//   G1 = (3.535 v + 2.181 v^2) / (1 + 2.276 v + 2.577 v^2), not above 1
//   v = min(NdotX / (alpha sqrt(1 - NdotX^2)), 1.6)
// param  NdotX  cosine  1e-6..1  0.7  cosine of the direction
// param  alpha  float   0..4     0.25  microfacet width
// approximates  lobe_G1_Beckmann  max error 0.0032 relative  everywhere
// family  masking
// units   8
// source  Walter et al. 2007, section 5.2
float lobe_G1_Beckmann_fast(float NdotX, float alpha) {
    float c = clamp(NdotX, 0.0, 1.0);
    float a = clamp(alpha, 0.0, LOBE_ALPHA_MAX);
    float v = min(c / max(a * sqrt(1.0 - c * c), LOBE_SMALLEST_DIVISOR), 1.6);
    return min((3.535 + 2.181 * v) * v / (1.0 + (2.276 + 2.577 * v) * v), 1.0);
}

// Smith masking and shadowing of Beckmann facets, correlated through their height.
//   G2 = 1 / (1 / G1(NdotV) + 1 / G1(NdotL) - 1)
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// param  alpha  float   0..4     0.25  microfacet width
// units   16, as lobe_G1_Beckmann
// source  Heitz 2014, eq. 99
float lobe_G2_Beckmann(float NdotV, float NdotL, float alpha) {
    float v = lobe_G1_Beckmann(NdotV, alpha), l = lobe_G1_Beckmann(NdotL, alpha);
    return v * l / max(v + l * (1.0 - v), LOBE_SMALLEST_DIVISOR);
}

// Visibility of Beckmann facets: height-correlated Smith masking over the foreshortening.
//   V = G2 / (4 NdotV NdotL)
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// param  alpha  float   0..4     0.25  microfacet width
// units   16, as lobe_G1_Beckmann
// source  Heitz 2014, eq. 99
// Why this form: a cosine of 0 is taken for 1e-10, where V has come to its limit.
float lobe_V_Beckmann(float NdotV, float NdotL, float alpha) {
    float v = max(NdotV, 1e-10), l = max(NdotL, 1e-10);
    return 0.25 * lobe_G2_Beckmann(v, l, alpha) / (min(v, 1.0) * min(l, 1.0));
}

// Beckmann microfacet reflection with height-correlated Smith masking and Schlick's Fresnel term.
//   f = D V F                                                                      [1/sr]
// param  f0     color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alpha  float  1e-4..4  0.25  microfacet width
// reciprocal  yes
// energy      <= 1
// family      specular
// units       16, exp, and the lengths of N, V and L as in lobe_GGX
// source      Walter et al. 2007, eq. 20, 25; Heitz 2014, eq. 99; Schlick 1994, eq. 15
vec3 lobe_Beckmann(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    vec3 H = lobe_H(V, L);
    vec2 c = lobe_cosines(N, V, L, H);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    float a = max(alpha, LOBE_ALPHA_MIN);
    float DV = lobe_D_Beckmann(N, H, a) * lobe_V_Beckmann(c.x, c.y, a);
    return DV * lobe_F_Schlick(0.5 * length(H), clamp(f0, 0.0, 1.0));
}

// Cook and Torrance's reflection: Beckmann facets, masked by V-grooves, with Schlick's Fresnel term.
//   f = D G F / (4 NdotV NdotL)                                                    [1/sr]
// param  f0     color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alpha  float  1e-4..4  0.25  microfacet width
// reciprocal  yes
// energy      <= 1
// family      specular
// units       16, exp, and the lengths of N, V and L as in lobe_GGX
// source      Cook, Torrance 1982, section 3; Walter et al. 2007, eq. 20; Schlick 1994, eq. 15
vec3 lobe_CookTorrance(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    vec3 H = lobe_H(V, L);
    vec2 c = lobe_cosines(N, V, L, H);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    float LdotH = 0.5 * length(H);
    float NdotH = 0.5 * (c.x + c.y) / max(LdotH, LOBE_SMALLEST_DIVISOR);
    float DV = lobe_D_Beckmann(N, H, alpha) * lobe_V_Vgroove(c.x, c.y, NdotH, LdotH);
    return DV * lobe_F_Schlick(LdotH, clamp(f0, 0.0, 1.0));
}

// Half vector of Beckmann facets at random: a unit H. The light comes from lobe_reflect(H, V).
//   H = normalize(alpha sqrt(-ln(1 - u.y)) (cos(phi) T + sin(phi) B) + N),   phi = 2 pi u.x
// param  alpha  float  1e-4..4  0.25  microfacet width
// param  u      vec2   0..0.9999999  0.5  uniform random numbers
// units   8
// source  Walter et al. 2007, eq. 28
vec3 lobe_sample_Beckmann(vec3 N, vec3 T, float alpha, vec2 u) {
    vec2 slope = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX) * sqrt(lobe_quantile_exponential(u.y)) * lobe_circle(u.x);
    vec3 H = slope.x * T + slope.y * cross(N, T) + N;
    return H / max(length(H), LOBE_SMALLEST_DIVISOR);
}

// Density of lobe_reflect(H, V) for H = lobe_sample_Beckmann(...), over the solid angle of L. For lobe_CookTorrance, too.
//   pdf = D N.H / (4 V.H),   H of unit length                                      [1/sr]
// param  alpha  float  1e-4..4  0.25  microfacet width
// units   16, exp, and the lengths of N, V and L as in lobe_GGX
// source  Walter et al. 2007, eq. 14, 24
// 0 where V or the half vector is below the horizon. L may be below it: such a sample is drawn and has f = 0.
float lobe_pdf_Beckmann(vec3 N, vec3 V, vec3 L, float alpha) {
    vec3 H = lobe_H(V, L);
    float NdotV = dot(N, V), NH = dot(N, H);
    if (min(NdotV, NH) <= 0.0) return 0.0;
    return 0.5 * lobe_D_Beckmann(N, H, alpha) * (NH / max(dot(H, H), 1e-26));
}

#endif
