// Reflectance and transmittance of a smooth interface, and the directions that go with it.
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

// Reflectance at normal incidence of a conductor.
//   f0 = ((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2)
// param  eta  float  0.1..10  1.5  index of refraction beyond the surface over the one on this side
// param  k    float  0..10    2.5  extinction coefficient beyond the surface over the index on this side
// units   8
// source  Born, Wolf 1999, section 14.2
float lobe_f0(float eta, float k) {
    float n = clamp(eta, 0.0, 1e9), kappa = clamp(k, 0.0, 1e9), k2 = kappa * kappa;
    return ((n - 1.0) * (n - 1.0) + k2) / ((n + 1.0) * (n + 1.0) + k2);
}

// Reflectance at normal incidence of a conductor, with an index for each channel.
//   f0 = ((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2)
// param  eta  vec3  0.1..10  1.5  index of refraction beyond the surface over the one on this side, for R, G, B
// param  k    vec3  0..10    2.5  extinction coefficient beyond the surface over the index on this side, for R, G, B
// units   8
// source  Born, Wolf 1999, section 14.2
vec3 lobe_f0(vec3 eta, vec3 k) {
    vec3 n = clamp(eta, 0.0, 1e9), kappa = clamp(k, 0.0, 1e9), k2 = kappa * kappa;
    return ((n - 1.0) * (n - 1.0) + k2) / ((n + 1.0) * (n + 1.0) + k2);
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

// Mirror direction of V; points away from the surface.
//   R = 2 (N.V) N - V
// units   8
// source  law of reflection
vec3 lobe_reflect(vec3 N, vec3 V) {
    return 2.0 * dot(N, V) * N - V;
}

// Refracted direction of V, away from the surface, to the far side of N; null under total internal reflection.
//   R = -(V - (N.V) N + g N) / eta,   g = eta cosT = sqrt(eta^2 - 1 + (N.V)^2)
// param  eta  float  0.1..10  1.5  index of refraction beyond the surface over the one on V's side
// units   8
// source  Snell's law
// Why this form: V - (N.V) N = (N x V) x N is right to its last digits where V nears N, and so is eta^2 - |N x V|^2.
vec3 lobe_refract(vec3 N, vec3 V, float eta) {
    float c = dot(N, V), n = clamp(eta, 1e-4, 1e4);
    vec3 X = cross(N, V);
    float g2 = c * c < 0.5 ? (n - 1.0) * (n + 1.0) + c * c : n * n - dot(X, X);
    if (g2 < 0.0) return vec3(0.0);
    return -(cross(X, N) + sqrt(g2) * N) / n;
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

// Exact Fresnel transmittance of a dielectric, polarised, 1 - (R_s, R_p), with all its digits at grazing too.
//   T_s = 4 cosI g / (cosI + g)^2,   T_p = 4 eta^2 cosI g / (eta^2 cosI + g)^2,   g = sqrt(eta^2 - 1 + cosI^2)
// param  eta  float  0.1..10  1.5  index of refraction beyond the surface over the one on cosI's side
// units   8
// source  Fresnel 1823
vec2 lobe_T_dielectric_sp(float cosI, float eta) {
    float c = clamp(cosI, 0.0, 1.0);
    float n = clamp(eta, 1e-4, 1e4);
    if (n == 1.0) return vec2(1.0);  // no interface, at no angle
    float g2 = (n - 1.0) * (n + 1.0) + c * c;
    if (g2 <= 0.0) return vec2(0.0);  // total internal reflection
    float g = sqrt(g2);
    float s = c + g;
    float p = n * n * c + g;
    return min(4.0 * c * g * vec2(1.0 / (s * s), n * n / (p * p)), 1.0);
}

// Exact Fresnel reflectance of a dielectric for unpolarised light; 1 under total internal reflection.
//   F = (r_s^2 + r_p^2) / 2
//   m = (eta - 1)(eta + 1), g = eta cosT = sqrt(m + cosI^2)
//   r_s = (g - cosI) / (g + cosI), r_p = (eta^2 cosI - g) / (eta^2 cosI + g)
// param  eta  float  0.4..10  1.5  index of refraction beyond the surface over the one on cosI's side
// family  fresnel
// units   8
// source  Fresnel 1823; Walter et al. 2007, eq. 22
// Why this form: g - cosI alone saves 6 cycles of 42 (NAVI21), but F is 1 % off within 7.5e-6 of eta = 1, and not 0
// there where sqrt is inexact. m / (g + cosI) replaces it; elsewhere it has fewer roundings. r_p is r_s times
// (cosI g - sinI^2) / (cosI g + sinI^2). g = 0 gives total internal reflection without a branch.
float lobe_F_dielectric(float cosI, float eta) {
    float c = clamp(cosI, LOBE_SMALLEST_COSINE, 1.0), s2 = 1.0 - c * c;
    float n = clamp(eta, 1e-3, 1e4), n1 = n - 1.0, m = n * n1 + n1;
    float g = sqrt(max(m + c * c, 0.0)), d = g - c, s = g + c;
    float rs = (abs(d) >= c ? d : m / s) / s;
    float rp = rs * ((c * g - s2) / (c * g + s2));
    return min(0.5 * (rs * rs + rp * rp), 1.0);
}

// Exact Fresnel reflectance of a dielectric, polarised: x = s, perpendicular to the plane of incidence, y = p, in it.
//   R_s = r_s^2,   R_p = r_p^2
//   m = (eta - 1)(eta + 1), g = eta cosT = sqrt(m + cosI^2)
//   r_s = (g - cosI) / (g + cosI), r_p = (eta^2 cosI - g) / (eta^2 cosI + g)
// param  eta  float  0.4..10  1.5  index of refraction beyond the surface over the one on cosI's side
// units   8
// source  Fresnel 1823
// Why this form: as in lobe_F_dielectric.
vec2 lobe_F_dielectric_sp(float cosI, float eta) {
    float c = clamp(cosI, LOBE_SMALLEST_COSINE, 1.0), s2 = 1.0 - c * c;
    float n = clamp(eta, 1e-3, 1e4), n1 = n - 1.0, m = n * n1 + n1;
    float g = sqrt(max(m + c * c, 0.0)), d = g - c, s = g + c;
    float rs = (abs(d) >= c ? d : m / s) / s;
    float rp = rs * ((c * g - s2) / (c * g + s2));
    return min(vec2(rs * rs, rp * rp), 1.0);
}

// Exact Fresnel reflectance of a conductor, polarised: x = s, perpendicular to the plane of incidence, y = p, in it.
//   (a + i b)^2 = (eta + i k)^2 - sinI^2
//   R_s = |(eta + i k)^2 - 1|^2 / S^2,   S = (cosI + a)^2 + b^2
//   R_p = R_s ((a cosI - sinI^2)^2 + (b cosI)^2) / P,   P = (a cosI + sinI^2)^2 + (b cosI)^2
// param  eta  float  0.1..10  1.5  index of refraction beyond the surface over the one on cosI's side
// param  k    float  0..10    2.5  extinction coefficient beyond the surface over the index on cosI's side
// units   8
// source  Born, Wolf 1999, section 14.2
// Why this form: |cosI - a - i b| cancels where the indices match, and |(eta + i k)^2 - 1| / |cosI + a + i b| replaces
// it. Of the complex root, the larger part comes from a sum, the smaller from a b = eta k. Where much is reflected,
// 1 - T has fewer roundings, with T_s = 4 a cosI / S and T_p = T_s (a^2 + b^2 + sinI^2) / P.
vec2 lobe_F_conductor_sp(float cosI, float eta, float k) {
    float c = clamp(cosI, 0.0, 1.0), s2 = (1.0 - c) * (1.0 + c);
    float n = clamp(eta, 1e-4, 1e4), kappa = clamp(k, 0.0, 1e4), k2 = kappa * kappa;
    float re = (c < 0.7 ? (n - 1.0) * (n + 1.0) + c * c : n * n - s2) - k2;  // whichever subtracts the smaller
    float larger = sqrt(0.5 * (length(vec2(re, 2.0 * n * kappa)) + abs(re)));
    float smaller = n * kappa / max(larger, LOBE_SMALLEST_DIVISOR);
    float a = re > 0.0 ? larger : smaller;
    float b = re > 0.0 ? smaller : larger;
    float S = max((c + a) * (c + a) + b * b, 1e-15);
    vec2 d = vec2(a * c - s2, a * c + s2);
    vec2 P = max(d * d + b * b * (c * c), vec2(0.0, LOBE_SMALLEST_DIVISOR));
    vec2 T = 4.0 * a * c / S * vec2(1.0, (a * a + b * b + s2) / P.y);
    float m2 = ((n - 1.0) * (n - 1.0) + k2) * ((n + 1.0) * (n + 1.0) + k2);
    vec2 R = m2 / (S * S) * vec2(1.0, P.x / P.y);
    return m2 == 0.0 ? vec2(0.0) : vec2(T.x < 0.6 ? 1.0 - T.x : R.x, T.y < 0.6 ? 1.0 - T.y : R.y);
}

// Exact Fresnel reflectance of a conductor for unpolarised light; without absorption, k = 0, that of a dielectric.
//   F = (R_s + R_p) / 2
// param  eta  float  0.1..10  1.5  index of refraction beyond the surface over the one on cosI's side
// param  k    float  0..10    2.5  extinction coefficient beyond the surface over the index on cosI's side
// family  fresnel
// units   8
// source  Born, Wolf 1999, section 14.2
// Why this form: with a^2 + b^2 = M, R_s is X / S and R_p is R_s (U - W) / (U + W), so that one division does for F.
// X = M + cosI^2 - 2 a cosI with a^2 = (M + re) / 2 costs 62 cycles in place of 88 (NAVI21), and is 9e3 units off.
float lobe_F_conductor(float cosI, float eta, float k) {
    float c = clamp(cosI, 0.0, 1.0), c2 = c * c, s2 = (1.0 - c) * (1.0 + c);
    float n = clamp(eta, 1e-4, 1e4), n1 = n - 1.0;
    float kappa = clamp(k, 0.0, 1e4), nk = 2.0 * n * kappa;
    float re = (c < 0.7 ? n * n1 + n1 + c2 : n * n - s2) - kappa * kappa;  // whichever subtracts the smaller
    float M = sqrt(re * re + nk * nk);
    float larger = M + abs(re), smaller = nk * nk / max(larger, LOBE_SMALLEST_DIVISOR);
    float a = sqrt(0.5 * (re > 0.0 ? larger : smaller)), b2 = 0.5 * (re > 0.0 ? smaller : larger);
    float X = (a - c) * (a - c) + b2, S = (M + c2) + 2.0 * c * a;
    float U = c2 * M + s2 * s2, W = 2.0 * c * s2 * a;
    float F = min(X * U / max(S * (U + W), LOBE_SMALLEST_DIVISOR), 1.0);
    return max(abs(n1), kappa) > 0.0 ? F : 0.0;  // no interface, at no angle
}

// Exact Fresnel reflectance of a conductor for unpolarised light, with an index for each channel.
//   F = (R_s + R_p) / 2
// param  eta  vec3  0.1..10  1.5  index of refraction beyond the surface over the one on cosI's side, for R, G, B
// param  k    vec3  0..10    2.5  extinction coefficient beyond the surface over the index on cosI's side, for R, G, B
// family  fresnel
// units   8
// source  Born, Wolf 1999, section 14.2
vec3 lobe_F_conductor(float cosI, vec3 eta, vec3 k) {
    return vec3(lobe_F_conductor(cosI, eta.x, k.x), lobe_F_conductor(cosI, eta.y, k.y),
                lobe_F_conductor(cosI, eta.z, k.z));
}

// Fresnel reflectance of a conductor, Schlick's curve between its exact ends. It misses the dip before grazing.
//   F = ((eta - 1)^2 + 4 eta (1 - cosI)^5 + k^2) / ((eta + 1)^2 + k^2)
// param  eta  vec3  0.1..4  1.5  index of refraction beyond the surface over the one on cosI's side, for R, G, B
// param  k    vec3  1..10   2.5  extinction coefficient beyond the surface, for R, G, B
// approximates  lobe_F_conductor  max error 0.256 absolute  everywhere, largest at eta = 4, k = 6, 84 degrees
// family  fresnel
// units   8
// source  Lazanyi, Szirmay-Kalos 2005
vec3 lobe_F_conductor_fast(float cosI, vec3 eta, vec3 k) {
    float u = clamp(1.0 - cosI, 0.0, 1.0);
    float x = u * u * (u * u) * u;
    vec3 n = clamp(eta, 0.0, 1e9), kappa = clamp(k, 0.0, 1e9), k2 = kappa * kappa;
    return min(((n - 1.0) * (n - 1.0) + 4.0 * x * n + k2) / ((n + 1.0) * (n + 1.0) + k2), 1.0);
}

// Schlick's approximation of the Fresnel reflectance, with 1 at grazing.
//   F = f0 + (1 - f0) (1 - cosI)^5
// param  f0  color  0..1  0.04  reflectance at normal incidence, linear RGB
// family  fresnel
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
// family  fresnel
// units   8
// source  Schlick 1994, eq. 15
float lobe_F_Schlick(float cosI, float f0) {
    float u = clamp(1.0 - cosI, 0.0, 1.0);
    float x = u * u * (u * u) * u;
    return max(f0, 0.0) * (1.0 - x) + x;
}

// Schlick's approximation of the Fresnel reflectance with an exponential in the place of the power.
//   F = f0 + (1 - f0) 2^((-5.55473 cosI - 6.98316) cosI)
// param  f0  color  0..1  0.04  reflectance at normal incidence, linear RGB
// approximates  lobe_F_Schlick  max error 0.0038 absolute  everywhere, largest at cosI = 0.055
// family  fresnel
// units   16, exp2
// source  Lagarde 2012, spherical Gaussian approximation
vec3 lobe_F_Schlick_fast(float cosI, vec3 f0) {
    float c = clamp(cosI, 0.0, 1.0);
    float x = exp2((-5.55473 * c - 6.98316) * c);
    return max(f0, 0.0) * (1.0 - x) + x;
}

// Schlick's approximation of the Fresnel reflectance, with a free value at grazing.
//   F = f0 + (f90 - f0) (1 - cosI)^5
// param  f0   color  0..1  0.04  reflectance at normal incidence, linear RGB
// param  f90  color  0..1  1.0  reflectance at grazing incidence, linear RGB
// units   8
// source  Schlick 1994, eq. 15
// Why this form: 1 - u^5 = c (1 + u + u^2 + u^3 + u^4), with u = 1 - c, keeps its digits at grazing, where an f90 of 0
// leaves nothing else. f0 (1 - u^5) + f90 u^5 costs 20 cycles in place of 30 (NAVI21), 1e6 units off.
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

// Schlick's approximation bent to a given reflectance at 82 degrees, where metals dip.
//   F = S(c) - (S(1/7) - f82) g(c), not below 0,   c = cosI
//   S(c) = f0 + (1 - f0) (1 - c)^5,   g(c) = c (1 - c)^6 7^7 / 6^6
// param  f0   color  0..1  0.9  reflectance at normal incidence, linear RGB
// param  f82  color  0..1  0.8  reflectance at 82 degrees, where cosI = 1/7, linear RGB
// family  fresnel
// units   8
// source  Hoffman 2019; Lazanyi, Szirmay-Kalos 2005
// Why this form: F = f0 (1 - g) + (1 - f0) (S0 - S0(1/7) g) + f82 g, S0 for f0 = 0, has two brackets that vanish at
// c = 1/7. With (7 c - 1) taken out of both, nothing cancels there, where a dark f82 is all that is left. F as
// published costs 48 cycles in place of 70 (NAVI21), and is 4e4 units and more off there.
vec3 lobe_F_F82(float cosI, vec3 f0, vec3 f82) {
    float c = clamp(cosI, 0.0, 1.0);
    float u = 1.0 - c, d = 7.0 * c - 1.0;
    float u5 = u * u * (u * u) * u;
    float g = 17.6513846 * c * u * u5;  // 7^7 / 6^6
    float rest = d * d * (0.0277777778 + u * (0.0648148148 + u * (0.113425926 + u * (0.17644033 + u * (0.257308813
                 + u * 0.360232339)))));  // 1 - g
    float dark = u5 * d * (c - 0.857142857) * 1.16666667;  // (1 - c)^5 (7 c - 1)(7 c - 6) / 6
    vec3 f = clamp(f0, 0.0, 1e30);
    return max(f * rest + (1.0 - f) * dark + clamp(f82, 0.0, 1e30) * g, 0.0);
}

// Schlick's approximation with a tint at 82 degrees: 1 leaves it alone, less darkens a metal's rim.
//   F = lobe_F_F82(cosI, f0, tint S(1/7)),   S(1/7) = f0 + (1 - f0) (6/7)^5
// param  f0    color  0..1  0.9  reflectance at normal incidence, linear RGB
// param  tint  color  0..1  0.9  factor on Schlick's reflectance at 82 degrees, where cosI = 1/7, linear RGB
// family  fresnel
// units   8
// source  Kutz, Hasan, Edmondson 2021
vec3 lobe_F_F82_tint(float cosI, vec3 f0, vec3 tint) {
    vec3 f = clamp(f0, 0.0, 1e30);
    return lobe_F_F82(cosI, f, clamp(tint, 0.0, 1e6) * (f * 0.537335634 + 0.462664366));  // (6/7)^5 = 0.46266
}

// Hall's colour shift: f0 at normal incidence goes to white at grazing as fast as the reflectance of one eta does.
//   F = f0 + (1 - f0) w,   w = (Fd(cosI) - Fd(1)) / (1 - Fd(1)), not below 0, with Fd of a dielectric of index eta0
// param  f0    color  0.01..1  0.9  reflectance at normal incidence, linear RGB
// param  eta0  float  1..10  1.5  index whose curve is followed
// family  fresnel
// units   16, w is a quotient of two reflectances of 8 each
// source  Cook, Torrance 1982, section 3; Hall 1989
// Why this form: Fd(cosI) - Fd(1) goes as sin^4, and loses all digits near the normal. As in lobe_F_dielectric, with
// AB = 1 / ((cosI + g)(eta0^2 cosI + g)), it is w = (m sin^2 / (g + eta0 cosI))^2 AB (1 - m^2 cosI g AB / (2 eta0)).
vec3 lobe_F_Hall(float cosI, vec3 f0, float eta0) {
    float c = clamp(cosI, 0.0, 1.0), n = clamp(eta0, 1e-2, 1e2);
    float m = (n - 1.0) * (n + 1.0);
    float g = sqrt(max(m + c * c, 0.0));
    float AB = 1.0 / max((c + g) * (n * n * c + g), 1e-15);
    float x = m * (1.0 - c) * (1.0 + c) / max(g + n * c, 1e-7);
    float w = clamp(x * x * AB * (1.0 - 0.5 * m * m * c * g * AB / n), 0.0, 1.0);
    return max(f0, 0.0) * (1.0 - w) + w;
}

#endif
