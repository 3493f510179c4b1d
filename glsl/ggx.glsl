// GGX microfacets, which Trowbridge and Reitz published first: distribution, Smith masking, and the lobes made of them.
// needs  core, fresnel, masking
#ifndef LOBE_CORE_GLSL
#error "ggx.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_FRESNEL_GLSL
#error "ggx.glsl needs fresnel.glsl: put fresnel.glsl before it"
#endif
#ifndef LOBE_MASKING_GLSL
#error "ggx.glsl needs masking.glsl: put masking.glsl before it"
#endif
#ifndef LOBE_GGX_GLSL
#define LOBE_GGX_GLSL

// GGX (Trowbridge-Reitz) distribution of facet normals from a cosine, for those who have no vectors.
//   D = alpha^2 / (pi (1 - NdotH^2 + alpha^2 NdotH^2)^2)                            [1/sr]
// param  alpha  float  1e-4..4  0.25  microfacet width
// normalised  yes
// units       8
// source      Trowbridge, Reitz 1975; Walter et al. 2007, eq. 33
// Take the vector form where alpha is small: the rounding of NdotH alone costs 1e-5 at alpha = 0.1, 0.1 % at 0.01,
// 2.5 % at 0.002 and everything at 1e-4.
float lobe_D_GGX(float NdotH, float alpha) {
    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    float c = clamp(NdotH, -1.0, 1.0);
    float s2 = max(1.0 - c * c, 0.0);
    float k = a / (s2 + (a * c) * (a * c));
    return k * k * LOBE_INV_PI;
}

// GGX (Trowbridge-Reitz) distribution of facet normals; H may have any length.
//   D = alpha^2 |H|^4 / (pi (|N x H|^2 + alpha^2 (N.H)^2)^2)                        [1/sr]
// param  alpha  float  1e-4..4  0.25  microfacet width
// normalised  yes
// units       8
// source      Trowbridge, Reitz 1975; Walter et al. 2007, eq. 33
// Why this form: |N x H| keeps its digits at the peak, where 1 - NdotH^2 has none, and no H is normalised. With
// |N x H|^2 + (N.H)^2 = |H|^2 the divisor is alpha^2 |H|^2 + (1 - alpha^2) |N x H|^2, or |H|^2 + (alpha^2 - 1) (N.H)^2
// for alpha > 1: sums of positive terms, which no compiler can reorder into a cancellation.
float lobe_D_GGX(vec3 N, vec3 H, float alpha) {
    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    float a2 = a * a;
    vec3 X = cross(N, H);
    float NH = dot(N, H), HH = dot(H, H);
    float rest = a < 1.0 ? dot(X, X) : NH * NH;
    float k = a * HH / max(min(a2, 1.0) * HH + abs(1.0 - a2) * rest, LOBE_SMALLEST_DIVISOR);
    k = min(k, 1.0 / LOBE_ALPHA_MIN);  // the narrowest lobe's peak: only vectors of absurd length would exceed it
    return k * k * LOBE_INV_PI;
}

// Smith masking of one direction over GGX facets.
//   G1 = 2 c / (c + sqrt(c^2 + alpha^2 (1 - c^2))),   c = NdotX
// param  NdotX  cosine  1e-6..1  0.7  cosine of the direction
// param  alpha  float   0..4     0.25  microfacet width
// units   8
// source  Smith 1967; Walter et al. 2007, eq. 34
float lobe_G1_GGX(float NdotX, float alpha) {
    float c = clamp(NdotX, 0.0, 1.0);
    float a = clamp(alpha, 0.0, LOBE_ALPHA_MAX);
    float g = sqrt(c * c + a * a * (1.0 - c * c));
    return 2.0 * c / max(c + g, LOBE_SMALLEST_DIVISOR);
}

// Smith masking and shadowing of GGX facets, correlated through their height.
//   G2 = 2 NdotV NdotL / (NdotL g(NdotV) + NdotV g(NdotL)),   g(c) = sqrt(c^2 + alpha^2 (1 - c^2))
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// param  alpha  float   0..4     0.25  microfacet width
// units   8
// source  Heitz 2014, eq. 99
float lobe_G2_GGX(float NdotV, float NdotL, float alpha) {
    vec2 c = clamp(vec2(NdotV, NdotL), 0.0, 1.0);
    float a = clamp(alpha, 0.0, LOBE_ALPHA_MAX);
    vec2 g = sqrt(c * c + a * a * (1.0 - c * c));
    return 2.0 * c.x * c.y / max(dot(c, g.yx), LOBE_SMALLEST_DIVISOR);
}

// Visibility of GGX facets: height-correlated Smith masking over the foreshortening.
//   V = G2 / (4 NdotV NdotL) = 1 / (2 (NdotL g(NdotV) + NdotV g(NdotL))),   g(c) = sqrt(c^2 + alpha^2 (1 - c^2))
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// param  alpha  float   0..4     0.25  microfacet width
// units   8
// source  Heitz 2014, eq. 99
// Why this form: the cosines of G2 and of the foreshortening cancel out, and with them 0 / 0 at grazing.
float lobe_V_GGX(float NdotV, float NdotL, float alpha) {
    vec2 c = clamp(vec2(NdotV, NdotL), 0.0, 1.0);
    float a = clamp(alpha, 0.0, LOBE_ALPHA_MAX);
    vec2 g = sqrt(c * c + a * a * (1.0 - c * c));
    return 0.5 / max(dot(c, g.yx), LOBE_SMALLEST_DIVISOR);
}

// GGX (Trowbridge-Reitz) microfacet reflection with height-correlated Smith masking and Schlick's Fresnel term.
//   f = D V F                                                                      [1/sr]
// param  f0     color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alpha  float  1e-4..4  0.25  microfacet width
// reciprocal  yes
// energy      <= 1
// units       16, up to 8 of them are the lengths of N, V and L: float32 holds them within 2^-24, D V feels N six times
// source      Walter et al. 2007, eq. 20, 33; Heitz 2014, eq. 99; Schlick 1994, eq. 15
// Why this form: float32 directions are up to 1e-7 too long or too short. Near grazing, where V + L is short, that
// turns the half vector by more than a narrow lobe is wide. Unit V and L have (V + L).(V - L) = 0; what the sum has
// along V - L comes from unequal lengths and is taken out.
vec3 lobe_GGX(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    float NdotV = dot(N, V), NdotL = dot(N, L);
    if (min(NdotV, NdotL) <= 0.0) return vec3(0.0);
    vec3 H = V + L, across = V - L;
    H -= 0.25 * dot(H, across) * across;
    float a = max(alpha, LOBE_ALPHA_MIN);
    float DV = lobe_D_GGX(N, H, a) * lobe_V_GGX(NdotV, NdotL, a);
    return DV * lobe_F_Schlick(0.5 * length(H), clamp(f0, 0.0, 1.0));
}

// GGX (Trowbridge-Reitz) microfacet reflection with Kelemen's visibility, which knows no alpha.
//   f = D F / (4 LdotH^2)                                                          [1/sr]
// param  f0     color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alpha  float  1e-4..4  0.25  microfacet width
// reciprocal  yes
// energy      <= 1
// units       8
// source      Walter et al. 2007, eq. 33; Kelemen, Szirmay-Kalos 2001, eq. 6; Schlick 1994, eq. 15
// Why this form: the same half vector as in lobe_GGX.
vec3 lobe_GGX_Kelemen(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    if (min(dot(N, V), dot(N, L)) <= 0.0) return vec3(0.0);
    vec3 H = V + L, across = V - L;
    H -= 0.25 * dot(H, across) * across;
    float LdotH = 0.5 * length(H);
    float DV = lobe_D_GGX(N, H, alpha) * lobe_V_Kelemen(LdotH);
    return DV * lobe_F_Schlick(LdotH, clamp(f0, 0.0, 1.0));
}

#endif
