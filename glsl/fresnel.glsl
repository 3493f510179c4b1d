// Reflectance and transmittance of a smooth interface, and the angles that go with it.
// needs  core
#ifndef LOBE_CORE_GLSL
#error "fresnel.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_FRESNEL_GLSL
#define LOBE_FRESNEL_GLSL

// Reflectance at normal incidence from the index of refraction.
//   f0 = ((eta - 1) / (eta + 1))^2
// param  eta  float  0.1..10  1.5  index of refraction beyond the surface over the one on this side
// units   8
// source  Fresnel 1823, at normal incidence
float lobe_f0(float eta) {
    float n = max(eta, 0.0);
    float r = (n - 1.0) / (n + 1.0);
    return r * r;
}

// Index of refraction from the reflectance at normal incidence. For dielectrics: a metal's f0 gives nonsense.
//   eta = (1 + sqrt(f0)) / (1 - sqrt(f0)) >= 1
// param  f0  float  0..1  0.04  reflectance at normal incidence; 1 is taken for 1 - 2^-24
// units   8
// source  Fresnel 1823, at normal incidence
// Why this form: of (1 + sqrt(f0))^2 / (1 - f0) the divisor is exact near 1, and 1 - sqrt(f0) is not.
float lobe_eta(float f0) {
    float r2 = clamp(f0, 0.0, 0.99999994);
    float s = 1.0 + sqrt(r2);
    return s * s / (1.0 - r2);
}

// Cosine of the critical angle: total internal reflection for a smaller cosI. 0 where there is none, eta >= 1.
//   cos_critical = sqrt(1 - eta^2)
// param  eta  float  0.1..10  0.6667  index of refraction beyond the surface over the one on this side
// units   8
// source  Snell's law
float lobe_cos_critical(float eta) {
    float n = clamp(eta, 0.0, 1.0);
    return sqrt((1.0 - n) * (1.0 + n));
}

// Cosine of the refracted angle; 0 under total internal reflection.
//   cosT = sqrt(eta^2 - 1 + cosI^2) / eta
// param  eta  float  0.1..10  1.5  index of refraction beyond the surface over the one on cosI's side
// units   8
// source  Snell's law
float lobe_cosT(float cosI, float eta) {
    float c = clamp(cosI, 0.0, 1.0);
    float n = clamp(eta, 1e-4, 1e4);
    return min(sqrt(max((n - 1.0) * (n + 1.0) + c * c, 0.0)) / n, 1.0);
}

// Exact Fresnel transmittance of a dielectric for unpolarised light, 1 - F, with all its digits at grazing too.
//   T = 2 cosI g (1 / (cosI + g)^2 + eta^2 / (eta^2 cosI + g)^2),   g = eta cosT = sqrt(eta^2 - 1 + cosI^2)
// param  eta  float  0.1..10  1.5  index of refraction beyond the surface over the one on cosI's side
// units   8
// source  Fresnel 1823
// Why this form: it is a product of what vanishes at grazing and at the critical angle, where 1 - F has no digits left.
float lobe_T_dielectric(float cosI, float eta) {
    float c = clamp(cosI, 0.0, 1.0);
    float n = clamp(eta, 1e-4, 1e4);
    if (n == 1.0) return 1.0;  // no interface, at no angle
    float g2 = (n - 1.0) * (n + 1.0) + c * c;
    if (g2 <= 0.0) return 0.0;  // total internal reflection
    float g = sqrt(g2);
    float s = c + g;
    float p = n * n * c + g;
    return min(2.0 * c * g * (1.0 / (s * s) + n * n / (p * p)), 1.0);
}

// Exact Fresnel reflectance of a dielectric for unpolarised light; 1 under total internal reflection.
//   F = (r_s^2 + r_p^2) / 2
//   m = (eta - 1)(eta + 1), g = eta cosT = sqrt(m + cosI^2)
//   r_s = m / (cosI + g)^2, r_p = m (eta^2 cosI^2 - sinI^2) / (eta^2 cosI + g)^2
// param  eta  float  0.4..10  1.5  index of refraction beyond the surface over the one on cosI's side
// units   8
// source  Fresnel 1823; Walter et al. 2007, eq. 22
// Why this form: g - cosI cancels as eta nears 1, and (g - cosI)(g + cosI) = m replaces it. Where much is reflected,
// 1 - T has fewer roundings.
float lobe_F_dielectric(float cosI, float eta) {
    float T = lobe_T_dielectric(cosI, eta);
    if (T < 0.6) return 1.0 - T;
    float c = clamp(cosI, 0.0, 1.0);
    float n = clamp(eta, 1e-4, 1e4);
    float m = (n - 1.0) * (n + 1.0);
    float g = sqrt(max(m + c * c, 0.0));
    float s = c + g;
    float p = n * n * c + g;
    float rs = m / max(s * s, LOBE_SMALLEST_DIVISOR);
    float rp = m * (n * n * c * c - (1.0 - c) * (1.0 + c)) / max(p * p, LOBE_SMALLEST_DIVISOR);
    return 0.5 * (rs * rs + rp * rp);
}

// Schlick's approximation of the Fresnel reflectance, with 1 at grazing.
//   F = f0 + (1 - f0) (1 - cosI)^5
// param  f0  color  0..1  0.04  reflectance at normal incidence, linear RGB
// units   8
// source  Schlick 1994, eq. 15
// Why this form: f0 (1 - x) + x takes one multiply-add per channel.
vec3 lobe_F_Schlick(float cosI, vec3 f0) {
    float u = clamp(1.0 - cosI, 0.0, 1.0);
    float x = u * u * (u * u) * u;
    return max(f0, 0.0) * (1.0 - x) + x;
}

// Schlick's approximation of the Fresnel reflectance, one channel, with 1 at grazing.
//   F = f0 + (1 - f0) (1 - cosI)^5
// param  f0  float  0..1  0.04  reflectance at normal incidence
// units   8
// source  Schlick 1994, eq. 15
float lobe_F_Schlick(float cosI, float f0) {
    float u = clamp(1.0 - cosI, 0.0, 1.0);
    float x = u * u * (u * u) * u;
    return max(f0, 0.0) * (1.0 - x) + x;
}

// Schlick's approximation of the Fresnel reflectance, with a free value at grazing.
//   F = f0 + (f90 - f0) (1 - cosI)^5
// param  f0   color  0..1  0.04  reflectance at normal incidence, linear RGB
// param  f90  color  0..1  1.0  reflectance at grazing incidence, linear RGB
// units   8
// source  Schlick 1994, eq. 15
// Why this form: 1 - u^5 = c (1 + u + u^2 + u^3 + u^4), with u = 1 - c, keeps its digits at grazing, where an f90 of 0
// leaves nothing else.
vec3 lobe_F_Schlick(float cosI, vec3 f0, vec3 f90) {
    float c = clamp(cosI, 0.0, 1.0);
    float u = 1.0 - c;
    float u2 = u * u;
    float u4 = u2 * u2;
    return clamp(f0, 0.0, 1e30) * (c * ((1.0 + u) * (1.0 + u2) + u4)) + clamp(f90, 0.0, 1e30) * (u4 * u);
}

// Schlick's approximation of the Fresnel reflectance, one channel, with a free value at grazing.
//   F = f0 + (f90 - f0) (1 - cosI)^5
// param  f0   float  0..1  0.04  reflectance at normal incidence
// param  f90  float  0..1  1.0  reflectance at grazing incidence
// units   8
// source  Schlick 1994, eq. 15
float lobe_F_Schlick(float cosI, float f0, float f90) {
    float c = clamp(cosI, 0.0, 1.0);
    float u = 1.0 - c;
    float u2 = u * u;
    float u4 = u2 * u2;
    return clamp(f0, 0.0, 1e30) * (c * ((1.0 + u) * (1.0 + u2) + u4)) + clamp(f90, 0.0, 1e30) * (u4 * u);
}

#endif
