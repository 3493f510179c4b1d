// Ideal diffuse reflection.
// needs  core
#ifndef LOBE_CORE_GLSL
#error "lambert.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_LAMBERT_GLSL
#define LOBE_LAMBERT_GLSL

// Lambert's ideal diffuse reflection, equally bright from everywhere.
//   f = albedo / pi                                                                [1/sr]
// param  albedo  color  0..1  0.5  reflected fraction of the light, linear RGB
// reciprocal  yes
// energy      <= 1
// family      diffuse
// units       8
// source      Lambert 1760, Photometria
vec3 lobe_Lambert(vec3 N, vec3 V, vec3 L, vec3 albedo) {
    if (min(dot(N, V), dot(N, L)) <= 0.0) return vec3(0.0);
    return clamp(albedo, 0.0, 1.0) * LOBE_INV_PI;
}

// Light direction in proportion to its cosine, at random: a unit L.
//   L = sqrt(u.y) (cos(phi) T + sin(phi) B) + sqrt(1 - u.y) N,   phi = 2 pi u.x
// param  u  vec2  0..0.9999999  0.5  uniform random numbers
// units   8
// source  Lambert 1760, Photometria; Malley's method
vec3 lobe_sample_Lambert(vec3 N, vec3 T, vec2 u) {
    float r = clamp(u.y, 0.0, 1.0);
    vec2 l = sqrt(r) * lobe_circle(u.x);
    return l.x * T + l.y * cross(N, T) + sqrt(1.0 - r) * N;
}

// Density of lobe_sample_Lambert, over the solid angle of L. For Oren-Nayar and other diffuse lobes, too.
//   pdf = max(0, N.L) / pi                                                         [1/sr]
// units   8
// source  Lambert 1760, Photometria
float lobe_pdf_Lambert(vec3 N, vec3 L) {
    return max(dot(N, L), 0.0) * LOBE_INV_PI;
}

#endif
