// Masking that no distribution has a part in: V-grooves, and Kelemen's visibility.
// needs  core
#ifndef LOBE_CORE_GLSL
#error "masking.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_MASKING_GLSL
#define LOBE_MASKING_GLSL

// Masking and shadowing by long symmetric V-grooves.
//   G = min(1, 2 NdotH NdotV / VdotH, 2 NdotH NdotL / VdotH)
// param  VdotH  cosine  1e-6..1  0.7  cosine between the view direction and the half vector
// units   8
// source  Torrance, Sparrow 1967; Cook, Torrance 1982, section 3
float lobe_G_Vgroove(float NdotV, float NdotL, float NdotH, float VdotH) {
    vec4 c = clamp(vec4(NdotV, NdotL, NdotH, VdotH), 0.0, 1.0);
    return min(2.0 * c.z * min(c.x, c.y) / max(c.w, LOBE_SMALLEST_DIVISOR), 1.0);
}

// Visibility of V-grooves: their masking over the foreshortening.
//   V = G / (4 NdotV NdotL) = min(VdotH, 2 NdotH min(NdotV, NdotL)) / (4 NdotV NdotL VdotH)
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// param  VdotH  cosine  1e-6..1  0.7  cosine between the view direction and the half vector
// family  masking
// units   8
// source  Torrance, Sparrow 1967; Cook, Torrance 1982, section 3
float lobe_V_Vgroove(float NdotV, float NdotL, float NdotH, float VdotH) {
    vec4 c = clamp(vec4(NdotV, NdotL, NdotH, VdotH), 0.0, 1.0);
    return min(c.w, 2.0 * c.z * min(c.x, c.y)) / max(4.0 * c.x * c.y * c.w, LOBE_SMALLEST_DIVISOR);
}

// Neumann's visibility, which keeps a metal bright at grazing.
//   V = 1 / (4 max(NdotV, NdotL))
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// family  masking
// units   8
// source  Neumann, Neumann, Szirmay-Kalos 1999
float lobe_V_Neumann(float NdotV, float NdotL) {
    return 0.25 / clamp(max(NdotV, NdotL), LOBE_SMALLEST_DIVISOR, 1.0);
}

// Kelemen's visibility, from the cosine at the half vector.
//   V = 1 / (4 LdotH^2)
// param  LdotH  cosine  1e-6..1  0.7  cosine between the light direction and the half vector
// family  masking
// units   8
// source  Kelemen, Szirmay-Kalos 2001, eq. 6
float lobe_V_Kelemen(float LdotH) {
    float c = clamp(LdotH, LOBE_SMALLEST_COSINE, 1.0);
    return 0.25 / (c * c);
}

// Kelemen's visibility, from the two directions.
//   V = 1 / |V + L|^2
// family  masking
// units   8
// source  Kelemen, Szirmay-Kalos 2001, eq. 6
// Why this form: |V + L| keeps its digits as L nears -V, 2 / (1 + L.V) has none left at 1e-4 rad.
float lobe_V_Kelemen(vec3 V, vec3 L) {
    vec3 H = lobe_H(V, L);
    return 1.0 / max(dot(H, H), LOBE_SMALLEST_DIVISOR);
}

#endif
