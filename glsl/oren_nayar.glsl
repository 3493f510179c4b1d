// Diffuse reflection of rough surfaces: facets that are Lambertian themselves, after Oren and Nayar.
// needs  core
#ifndef LOBE_CORE_GLSL
#error "oren_nayar.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_OREN_NAYAR_GLSL
#define LOBE_OREN_NAYAR_GLSL

// Oren-Nayar's qualitative model: brighter towards the light than Lambert, and flatter to the rim.
//   f = albedo / pi (A + B max(0, cos dphi) sin a tan b),   a = max(theta_V, theta_L), b = min(theta_V, theta_L)
//   A = 1 - 0.5 sigma^2 / (sigma^2 + 0.33),   B = 0.45 sigma^2 / (sigma^2 + 0.09)    [1/sr]
// param  albedo  color  0..1  0.5  reflected fraction of the light on one facet, linear RGB
// param  sigma  float  0..1.5  0.3  standard deviation of the facets' tilt angle [rad]
// reciprocal  yes
// energy      no, 1.0152 at sigma = 0.2, at grazing
// units       8
// source      Oren, Nayar 1994, eq. 30
// Why this form: cos dphi sin a tan b = (LdotV - NdotL NdotV) / max(NdotL, NdotV) needs no angles and no projected
// directions, which vanish at V = N.
vec3 lobe_OrenNayar_qualitative(vec3 N, vec3 V, vec3 L, vec3 albedo, float sigma) {
    float NdotV = dot(N, V), NdotL = dot(N, L);
    if (min(NdotV, NdotL) <= 0.0) return vec3(0.0);
    float angle = clamp(sigma, 0.0, 10.0);
    float sigma2 = angle * angle;
    float A = 1.0 - 0.5 * sigma2 / (sigma2 + 0.33);
    float B = 0.45 * sigma2 / (sigma2 + 0.09);
    float s = clamp(dot(L, V) - NdotL * NdotV, 0.0, 1.0);
    float t = s / max(max(NdotL, NdotV), LOBE_SMALLEST_DIVISOR);
    return clamp(albedo, 0.0, 1.0) * (LOBE_INV_PI * (A + B * t));
}

#endif
