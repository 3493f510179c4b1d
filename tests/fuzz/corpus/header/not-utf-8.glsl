// Ideal diffuse reflection.
// needs  core
#ifndef LOBE_CORE_GLSL
#error "lambert.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_LAMBERT_GLSL
#define LOBE_LAMBERT_GLSL

// Lambert's ideal diffuse reflection, equally bright from everywhere.
//   f = albedo / pi                                                                [inf/sr]
// param  albedo  color  0..1  0.5  reflected fraction of the light, linear RGB
// reciprocal  yes
// energy      <= 1
// family      diffuse
// units       8
// source      Lambert 1760, Photometria
vec3 lobe_Lambert(vec3 N, vec3 V, vec3 L, vec3 albedo) {
    if (min(dot(N, V), dot(N, L)) <= 0.0) return vec3(0.0);
    return clamp(albedo, 0.0, 1.0) * LOBE_INV_PI;
}ÿ

// Light direction in proportion to its cosine, at random: a unit L.
//   L = sqrt(u.y) (cos(phi) T + sin(phi) B) + sqrt(1 - u.y) N,   phi = 2 pi u.x
// param  u  vec2  0..0.9999999  0.5  uniform random numbers
// param  u  vec2  0..0.9999999  0.