// Highlights of two or three widths at once: a sharp core in a wide haze.
// needs  core, fresnel, masking, ggx, beckmann
//
// To draw from a blend, choose one width with its weight for the probability, and draw with lobe_sample_GGX or
// lobe_sample_Beckmann of that width; the density is the densities' sum with the same weights, as in
//     mix(lobe_pdf_GGX(N, V, L, alphas.x), lobe_pdf_GGX(N, V, L, alphas.y), weight)
#ifndef LOBE_CORE_GLSL
#error "blend.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_FRESNEL_GLSL
#error "blend.glsl needs fresnel.glsl: put fresnel.glsl before it"
#endif
#ifndef LOBE_MASKING_GLSL
#error "blend.glsl needs masking.glsl: put masking.glsl before it"
#endif
#ifndef LOBE_GGX_GLSL
#error "blend.glsl needs ggx.glsl: put ggx.glsl before it"
#endif
#ifndef LOBE_BECKMANN_GLSL
#error "blend.glsl needs beckmann.glsl: put beckmann.glsl before it"
#endif
#ifndef LOBE_BLEND_GLSL
#define LOBE_BLEND_GLSL

// GGX distribution of facet normals of two widths; H may have any length.
//   D = (1 - weight) D(alphas.x) + weight D(alphas.y)                              [1/sr]
// param  alphas  vec2   1e-4..4  0.1,0.5  microfacet widths
// param  weight  float  0..1     0.3  share of the second width
// normalised  yes
// units       12, the 8 of D, and the roundings of shares, products and sum where D is flat
// source      Trowbridge, Reitz 1975; Walter et al. 2007, eq. 33
float lobe_D_GGX_blend(vec3 N, vec3 H, vec2 alphas, float weight) {
    float w = clamp(weight, 0.0, 1.0);
    return (1.0 - w) * lobe_D_GGX(N, H, alphas.x) + w * lobe_D_GGX(N, H, alphas.y);
}

// GGX distribution of facet normals of three widths; H may have any length.
//   D = w.x D(alphas.x) + w.y D(alphas.y) + w.z D(alphas.z),   w = weights over their sum  [1/sr]
// param  alphas   vec3  1e-4..4  0.05,0.2,0.6  microfacet widths
// param  weights  vec3  0..1     0.5,0.3,0.2  shares, which are divided by their sum
// normalised  yes
// units       12, the 8 of D, and the roundings of shares, products and sum where D is flat
// source      Trowbridge, Reitz 1975; Walter et al. 2007, eq. 33
float lobe_D_GGX_blend3(vec3 N, vec3 H, vec3 alphas, vec3 weights) {
    vec3 w = clamp(weights, 0.0, 1e9);
    w /= max(w.x + w.y + w.z, LOBE_SMALLEST_DIVISOR);
    return dot(w, vec3(lobe_D_GGX(N, H, alphas.x), lobe_D_GGX(N, H, alphas.y), lobe_D_GGX(N, H, alphas.z)));
}

// Beckmann distribution of facet normals of two widths; H may have any length.
//   D = (1 - weight) D(alphas.x) + weight D(alphas.y)                              [1/sr]
// param  alphas  vec2   1e-4..4  0.1,0.5  microfacet widths
// param  weight  float  0..1     0.3  share of the second width
// normalised  yes
// units       16, exp
// source      Cook, Torrance 1982, eq. 3 to 5
float lobe_D_Beckmann_blend(vec3 N, vec3 H, vec2 alphas, float weight) {
    float w = clamp(weight, 0.0, 1.0);
    return (1.0 - w) * lobe_D_Beckmann(N, H, alphas.x) + w * lobe_D_Beckmann(N, H, alphas.y);
}

// Beckmann distribution of facet normals of three widths; H may have any length.
//   D = w.x D(alphas.x) + w.y D(alphas.y) + w.z D(alphas.z),   w = weights over their sum  [1/sr]
// param  alphas   vec3  1e-4..4  0.05,0.2,0.6  microfacet widths
// param  weights  vec3  0..1     0.5,0.3,0.2  shares, which are divided by their sum
// normalised  yes
// units       16, exp
// source      Cook, Torrance 1982, eq. 3 to 5
float lobe_D_Beckmann_blend3(vec3 N, vec3 H, vec3 alphas, vec3 weights) {
    vec3 w = clamp(weights, 0.0, 1e9);
    w /= max(w.x + w.y + w.z, LOBE_SMALLEST_DIVISOR);
    return dot(w, vec3(lobe_D_Beckmann(N, H, alphas.x), lobe_D_Beckmann(N, H, alphas.y), lobe_D_Beckmann(N, H, alphas.z)));
}

// GGX microfacet reflection of two widths, each with its own masking. Draw a width by its weight, then from it.
//   f = (1 - weight) lobe_GGX(alphas.x) + weight lobe_GGX(alphas.y)                [1/sr]
// param  f0  color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alphas  vec2   1e-4..4  0.1,0.5  microfacet widths
// param  weight  float  0..1     0.3  share of the second width
// reciprocal  yes
// energy      <= 1
// units       16, the lengths of N, V and L as in lobe_GGX
// source      Walter et al. 2007, eq. 20, 33; Heitz 2014, eq. 99; Schlick 1994, eq. 15
vec3 lobe_GGX_blend(vec3 N, vec3 V, vec3 L, vec3 f0, vec2 alphas, float weight) {
    float w = clamp(weight, 0.0, 1.0);
    return (1.0 - w) * lobe_GGX(N, V, L, f0, alphas.x) + w * lobe_GGX(N, V, L, f0, alphas.y);
}

// GGX microfacet reflection of three widths, each with its own masking.
//   f = the sum of w_i lobe_GGX(alphas_i),   w = weights over their sum            [1/sr]
// param  f0  color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alphas   vec3  1e-4..4  0.05,0.2,0.6  microfacet widths
// param  weights  vec3  0..1     0.5,0.3,0.2  shares, which are divided by their sum
// reciprocal  yes
// energy      <= 1
// units       16, the lengths of N, V and L as in lobe_GGX
// source      Walter et al. 2007, eq. 20, 33; Heitz 2014, eq. 99; Schlick 1994, eq. 15
vec3 lobe_GGX_blend3(vec3 N, vec3 V, vec3 L, vec3 f0, vec3 alphas, vec3 weights) {
    vec3 w = clamp(weights, 0.0, 1e9);
    w /= max(w.x + w.y + w.z, LOBE_SMALLEST_DIVISOR);
    return w.x * lobe_GGX(N, V, L, f0, alphas.x) + w.y * lobe_GGX(N, V, L, f0, alphas.y)
           + w.z * lobe_GGX(N, V, L, f0, alphas.z);
}

// GGX microfacet reflection of two widths with one masking, of their mean. No cheaper than lobe_GGX_blend.
//   f = D V F,   D = lobe_D_GGX_blend, V = lobe_V_GGX of (1 - weight) alphas.x + weight alphas.y  [1/sr]
// param  f0  color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alphas  vec2   1e-4..4  0.1,0.5  microfacet widths
// param  weight  float  0..1     0.3  share of the second width
// reciprocal  yes
// energy      <= 1
// units       16, the lengths of N, V and L as in lobe_GGX
// source      Walter et al. 2007, eq. 20, 33; Heitz 2014, eq. 99; Schlick 1994, eq. 15
vec3 lobe_GGX_blend_D(vec3 N, vec3 V, vec3 L, vec3 f0, vec2 alphas, float weight) {
    vec3 H = lobe_H(V, L);
    vec2 c = lobe_cosines(N, V, L, H), a = clamp(alphas, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    float w = clamp(weight, 0.0, 1.0);
    float DV = lobe_D_GGX_blend(N, H, a, w) * lobe_V_GGX(c.x, c.y, (1.0 - w) * a.x + w * a.y);
    return DV * lobe_F_Schlick(0.5 * length(H), clamp(f0, 0.0, 1.0));
}

// Cook and Torrance's reflection of two widths, as their paper has it: masking by V-grooves knows no width.
//   f = D G F / (4 NdotV NdotL),   D = lobe_D_Beckmann_blend                      [1/sr]
// param  f0  color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alphas  vec2   1e-4..4  0.1,0.5  microfacet widths
// param  weight  float  0..1     0.3  share of the second width
// reciprocal  yes
// energy      <= 1
// units       16, exp, and the lengths of N, V and L as in lobe_GGX
// source      Cook, Torrance 1982, eq. 3 to 5; Schlick 1994, eq. 15
vec3 lobe_CookTorrance_blend(vec3 N, vec3 V, vec3 L, vec3 f0, vec2 alphas, float weight) {
    vec3 H = lobe_H(V, L);
    vec2 c = lobe_cosines(N, V, L, H);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    float LdotH = 0.5 * length(H);
    float NdotH = 0.5 * (c.x + c.y) / max(LdotH, LOBE_SMALLEST_DIVISOR);
    float DV = lobe_D_Beckmann_blend(N, H, alphas, weight) * lobe_V_Vgroove(c.x, c.y, NdotH, LdotH);
    return DV * lobe_F_Schlick(LdotH, clamp(f0, 0.0, 1.0));
}

// Cook and Torrance's reflection of three widths, as their paper has it: masking by V-grooves knows no width.
//   f = D G F / (4 NdotV NdotL),   D = lobe_D_Beckmann_blend3                      [1/sr]
// param  f0  color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alphas   vec3  1e-4..4  0.05,0.2,0.6  microfacet widths
// param  weights  vec3  0..1     0.5,0.3,0.2  shares, which are divided by their sum
// reciprocal  yes
// energy      <= 1
// units       16, exp, and the lengths of N, V and L as in lobe_GGX
// source      Cook, Torrance 1982, eq. 3 to 5; Schlick 1994, eq. 15
vec3 lobe_CookTorrance_blend3(vec3 N, vec3 V, vec3 L, vec3 f0, vec3 alphas, vec3 weights) {
    vec3 H = lobe_H(V, L);
    vec2 c = lobe_cosines(N, V, L, H);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    float LdotH = 0.5 * length(H);
    float NdotH = 0.5 * (c.x + c.y) / max(LdotH, LOBE_SMALLEST_DIVISOR);
    float DV = lobe_D_Beckmann_blend3(N, H, alphas, weights) * lobe_V_Vgroove(c.x, c.y, NdotH, LdotH);
    return DV * lobe_F_Schlick(LdotH, clamp(f0, 0.0, 1.0));
}

#endif
