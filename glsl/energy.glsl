// Energy of GGX: albedo fits, what one bounce loses and how to give it back, a wider lobe against specular aliasing.
// needs  core
#ifndef LOBE_CORE_GLSL
#error "energy.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_ENERGY_GLSL
#define LOBE_ENERGY_GLSL

// Directional albedo of GGX with height-correlated Smith masking and F = 1: what one bounce reflects of white light.
//   albedo = integral of D V NdotL over the directions L;  1 at NdotV = 0
// param  alpha  float  0.01..1  0.25  microfacet width
// approximates  exact  max error 1e-3 absolute  alpha 0.01..1
// units   8
// source  lab/fits.py
// Why this form: near grazing the loss depends on NdotV / alpha, which NdotV / g with Smith's g stands for; its square
// root follows the steep start. Narrower lobes than 0.01 have the albedo of 0.01, wider ones than 1 that of 1.
float lobe_albedo_GGX(float NdotV, float alpha) {
    float c = clamp(NdotV, 0.0, 1.0), a = clamp(alpha, 0.01, 1.0);
    float t = c / sqrt(c * c + a * a * (1.0 - c * c));
    float x = sqrt(t);
    float p = -0.4059 + a * (-1.0749 + a * (42.8407 + a * (7.70418 + a * 2.62812)))
            + x * (9.67428 + a * (17.6036 + a * (-63.8176 + a * -5.1676))
            + x * (-20.6329 + a * (-27.3811 + a * 23.5485)
            + x * (19.9262 + a * 10.8471
            + x * -8.56348)));
    float q = 1.0 + a * (17.5083 + a * (-19.4875 + a * 8.01655))
            + x * (18.3109 + a * (-1.97574 + a * 19.525)
            + x * (-13.8726 + a * -14.524
            + x * -3.36292));
    return clamp(1.0 - t * p / q, 0.0, 1.0);
}

// Mean albedo of GGX with height-correlated Smith masking and F = 1, over directions with a cosine.
//   mean = 2 integral of lobe_albedo_GGX(c, alpha) c over c
// param  alpha  float  0.01..1  0.25  microfacet width
// approximates  exact  max error 1e-3 absolute  alpha 0.01..1
// units   8
// source  lab/fits.py
float lobe_albedo_avg_GGX(float alpha) {
    float a = clamp(alpha, 0.0, 1.0);
    return clamp(1.0 - a * a * (5.7815 + a * (81.0101 + a * -20.471))
                 / (1.0 + a * (33.1513 + a * (56.0839 + a * 22.0779))), 0.0, 1.0);
}

// Scale and bias of f0 in the albedo of GGX with Schlick's Fresnel term, for light from an environment (split sum).
//   albedo = f0 x + y,   y = integral of D V (1 - LdotH)^5 NdotL over the directions L
// param  alpha  float  0.01..1  0.25  microfacet width
// approximates  exact  max error 1.5e-3 absolute  alpha 0.01..1
// family  albedo
// units   8
// source  Karis 2013 for the split; lab/fits.py for the fit
// Why this form: y is the albedo times (1 - w)^5 with a mean cosine w, and w is nearly g, Smith's own.
vec2 lobe_DFG_GGX(float NdotV, float alpha) {
    float c = clamp(NdotV, 0.0, 1.0), a = clamp(alpha, 0.01, 1.0), r = sqrt(a);
    float g = sqrt(c * c + a * a * (1.0 - c * c));
    float t = c / g;
    float p = 7.0241 + r * (0.907141 + r * (-13.2006 + r * (17.0188 + r * -6.07518)))
            + t * (19.019 + r * (-3.83731 + r * (-24.6346 + r * 18.1716))
            + t * (-12.9362 + r * (22.4007 + r * -17.6457)
            + t * (-11.1199 + r * 6.98527
            + t * 1.75648)));
    float q = 1.0 + r * (11.3592 + r * (-11.2543 + r * 11.3089))
            + t * (3.44069 + r * (26.1094 + r * -23.1975)
            + t * (1.30451 + r * -14.6526
            + t * -1.80953));
    float u = clamp(1.0 - g * p / q, 0.0, 1.0);
    float E = lobe_albedo_GGX(c, a);
    float bias = E * u * u * (u * u) * u;
    return vec2(E - bias, bias);
}

// Scale and bias of f0 in the albedo of GGX, as lobe_DFG_GGX, at 40 % of its cost.
//   albedo = f0 x + y,   y = integral of D V (1 - LdotH)^5 NdotL over the directions L
// param  alpha  float  0.01..1  0.25  microfacet width
// approximates  exact  max error 0.03 absolute  alpha 0.01..1
// family  albedo
// units   8
// source  Karis 2013 for the split; lab/fits.py for the fit
// Why this form: near grazing all depends on NdotV / alpha, which t stands for without a root; w is the mean cosine at
// the half vector, as there.
vec2 lobe_DFG_GGX_fast(float NdotV, float alpha) {
    float c = clamp(NdotV, 0.0, 1.0), a = clamp(alpha, 0.01, 1.0), r = sqrt(a);
    float t = c / (c + 0.6 * a), s = sqrt(t);
    float w = c * (0.9651705 - 0.5089077 * r) + r * (0.6660892 - 0.08956151 * a - 0.3204283 * t) - 0.0302887;
    float lost = s * (a * a * (0.4895174 - 0.3214532 * a * s) + t * (1.007683 + 0.8851291 * a * a - 1.023683 * s));
    float E = clamp(1.0 - lost, 0.0, 1.0);
    float u = clamp(1.0 - w, 0.0, 1.0);
    float bias = E * (u * u * (u * u) * u);
    return vec2(E - bias, bias);
}

// Factor on a GGX lobe that gives back what further bounces between the facets would reflect. Not reciprocal.
//   factor = 1 + f0 (1 - E) / E,   E = lobe_albedo_GGX(NdotV, alpha)
// param  f0     color  0..1     0.04  reflectance at normal incidence, linear RGB
// param  alpha  float  0.01..1  0.25  microfacet width
// approximates  exact  max error 1e-2 absolute  alpha 0.01..1
// units   8
// source  Turquin 2019
vec3 lobe_energy_Turquin(float NdotV, vec3 f0, float alpha) {
    float E = max(lobe_albedo_GGX(NdotV, alpha), 0.1);
    return 1.0 + clamp(f0, 0.0, 1.0) * ((1.0 - E) / E);
}

// What further bounces between GGX facets reflect, to be added to lobe_GGX: white light comes back within 0.2 %.
//   f = (1 - E(NdotV)) (1 - E(NdotL)) / (pi (1 - Em)) Fm^2 Em / (1 - Fm (1 - Em))              [1/sr]
//   E = lobe_albedo_GGX, Em = lobe_albedo_avg_GGX, Fm = f0 + (1 - f0) / 21
// param  f0     color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alpha  float  0.05..1  0.25  microfacet width
// reciprocal  yes
// energy      <= 1
// approximates  exact  max error 1e-2 absolute  alpha 0.05..1
// units       8
// source      Kulla, Conty 2017, with one more Fm, since each bounce has one
vec3 lobe_GGX_multiple(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    float NdotV = dot(N, V), NdotL = dot(N, L);
    if (min(NdotV, NdotL) <= 0.0) return vec3(0.0);
    float a = clamp(alpha, 0.01, 1.0);
    float Em = lobe_albedo_avg_GGX(a);
    float lost = (1.0 - lobe_albedo_GGX(NdotV, a)) * (1.0 - lobe_albedo_GGX(NdotL, a)) / (1.0 - Em);
    vec3 Fm = 0.952380952 * clamp(f0, 0.0, 1.0) + 0.0476190476;
    return LOBE_INV_PI * lost * (Fm * Fm * Em / (1.0 - Fm * (1.0 - Em)));
}

// Microfacet width against specular aliasing: the normals' spread over a pixel is added to that of the facets.
//   alpha' = sqrt(alpha^2 + min(2 s (|dNdx|^2 + |dNdy|^2), 0.18)), not above 1,   s = 1 / (2 pi)
// param  alpha  float  1e-4..1  0.25  microfacet width
// param  dNdx   vec3   -1..1    0.1   dFdx of the unit normal
// param  dNdy   vec3   -1..1    0.1   dFdy of the unit normal
// units   8
// source  Tokuyoshi, Kaplanyan 2019 and 2021
float lobe_alpha_filtered(float alpha, vec3 dNdx, vec3 dNdy) {
    float a = clamp(alpha, 0.0, 1.0);
    vec3 x = clamp(dNdx, -2.0, 2.0), y = clamp(dNdy, -2.0, 2.0);
    return sqrt(min(a * a + min(LOBE_INV_PI * (dot(x, x) + dot(y, y)), 0.18), 1.0));
}

#endif
