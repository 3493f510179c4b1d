// Schlick's rational functions, and the model of 1994 that he made of them.
// needs  core, fresnel
//
// r is Schlick's roughness factor, 0 a mirror, 1 diffuse: alpha^2 of GGX. p is his isotropy factor: 1 isotropic, towards 0
// grooves along T, whose highlight lies across them.
//
// To draw from lobe_Schlick, whose light between the facets is diffuse, take lobe_sample_Schlick with a probability P of your
// choice, else lobe_sample_Lambert; the density is that of both, and of a double layer that of three:
//     mix(lobe_pdf_Lambert(N, L), lobe_pdf_Schlick(N, T, V, L, r, p), P)
#ifndef LOBE_CORE_GLSL
#error "schlick.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_FRESNEL_GLSL
#error "schlick.glsl needs fresnel.glsl: put fresnel.glsl before it"
#endif
#ifndef LOBE_SCHLICK_GLSL
#define LOBE_SCHLICK_GLSL

// Power of a cosine, replaced by a quotient: s^h where s is near 1, far more than it in the tail.
//   s / (h - h s + s)
// param  s  float  0..1    0.9   cosine
// param  h  float  0..1e6  50.0  exponent of the cosine
// family  power
// units   8
// source  Schlick 1994, eq. 4
// Why this form: h (1 - s) is exact where s is near 1, h - h s is not.
float lobe_pow_Schlick(float s, float h) {
    float x = clamp(s, 0.0, 1.0);
    return x / max(clamp(h, 0.0, 1e9) * (1.0 - x) + x, LOBE_SMALLEST_DIVISOR);
}

// Schlick's quotient in the place of a cosine power, as a distribution of facet normals with its own normalisation.
//   D = s / (h - h s + s) / n,   s = NdotH
//   n = 2 pi times the integral of t^2 / (h + (1 - h) t) over t in 0..1                      [1/sr]
// param  h  float  1..1e6  50.0  exponent of the cosine that it stands for
// normalised  yes
// units       16, log
// source      Schlick 1994, eq. 4
// Why this form: with z = (h - 1) / (h + 1) it is n = pi (1 - z) (1 + (1 + z)^2 S) / 2, S = (artanh(z) - z) / z^3, sums of
// positive terms, where the closed form in ln(h) is 0 / 0 at h = 1. S is a fit below z = 1/2 (lab/fits.py).
float lobe_D_SchlickPower(float NdotH, float h) {
    float x = clamp(h, 1.0, 1e9);
    float z = (x - 1.0) / (x + 1.0), z2 = z * z;
    float S = 0.333333334 + z2 * (0.199999579 + z2 * (0.142883535 + z2 * (0.110496638 + z2 * (0.097610325
              + z2 * (0.040590301 + z2 * 0.156729179)))));
    if (z > 0.5) S = (0.5 * log(x) - z) / (z2 * z);
    float n = (1.0 + (1.0 + z) * (1.0 + z) * S) / (x + 1.0);  // over pi
    return lobe_pow_Schlick(NdotH, x) * LOBE_INV_PI / n;
}

// Schlick's zenith dependence of the facets' normals, pi times GGX of alpha^2 = r, from a cosine.
//   Z = r / (1 + r t^2 - t^2)^2,   t = NdotH
// param  r  float  1e-8..1  0.1  roughness factor, alpha^2
// units   8
// source  Schlick 1994, eq. 28
// Small r: take the vector form. Why this form: a compiler may make a lerp of (1 - c)(1 + c) + r c^2, which is 0 at c = 1.
float lobe_Z_Schlick(float NdotH, float r) {
    float c = clamp(NdotH, 0.0, 1.0), x = clamp(r, 1e-8, 1.0);
    float k = 1.0 / (x + (1.0 - x) * (1.0 - c) * (1.0 + c));
    return x * k * k;
}

// Schlick's zenith dependence of the facets' normals, pi times GGX of alpha^2 = r; H may have any length.
//   Z = r |H|^4 / (|N x H|^2 + r (N.H)^2)^2
// param  r  float  1e-8..1  0.1  roughness factor, alpha^2
// units   8
// source  Schlick 1994, eq. 28
// Why this form: as in lobe_D_GGX.
float lobe_Z_Schlick(vec3 N, vec3 H, float r) {
    vec3 X = cross(N, H);
    float x = clamp(r, 1e-8, 1.0), HH = dot(H, H);
    float k = min(HH / max(x * HH + (1.0 - x) * dot(X, X), LOBE_SMALLEST_DIVISOR), 1e8);
    return x * k * k;
}

// Schlick's azimuth dependence of the facets' normals, from the half vector's components along the surface. 1 at the pole.
//   A = sqrt(p h^2 / (p^2 BdotH^2 + TdotH^2)),   h^2 = TdotH^2 + BdotH^2
// param  p  float  0.01..1  0.5  isotropy factor: 1 isotropic, towards 0 grooves along T
// units   8
// source  Schlick 1994, eq. 28
// Within a rounding of the pole, 1e-7, the azimuth is noise, and A with it: anything in sqrt(p)..1 / sqrt(p).
// Its mean over the azimuth is 2 sqrt(p) K(1 - p^2) / pi, K the complete elliptic integral: 0.97 at p = 0.5, 0.38 at 0.01.
float lobe_A_Schlick(float TdotH, float BdotH, float p) {
    float x = clamp(p, 1e-4, 1.0);
    vec2 h = clamp(vec2(TdotH, BdotH), -1e15, 1e15);
    float larger = max(abs(h.x), abs(h.y));
    if (larger < LOBE_SMALLEST_DIVISOR) return 1.0;
    h /= larger;
    return sqrt(x * dot(h, h) / (x * x * h.y * h.y + h.x * h.x));
}

// Schlick's masking, a rational function. With sqrt(2 / pi) alpha for r it stands for Smith's of Beckmann facets.
//   G1 = v / (r - r v + v),   v = NdotX
// param  r  float  0..1  0.1  roughness factor; in his own model the one of Z
// family  masking
// units   8
// source  Schlick 1994, eq. 19
float lobe_G1_Schlick(float NdotX, float r) {
    float v = clamp(NdotX, 0.0, 1.0);
    return v / max(clamp(r, 0.0, 1.0) * (1.0 - v) + v, LOBE_SMALLEST_DIVISOR);
}

// Schlick's rational stand-in for the Beckmann distribution. 0 from NdotH = 1 - alpha down.
//   D = m^3 x / (pi t (m x^2 - x^2 + m^2)^2),   x = t + m - 1, t = NdotH, m = alpha          [1/sr]
// param  alpha  float  1e-4..1  0.25  microfacet width
// normalised  yes
// family      gaussian
// units       8
// source      Schlick 1994, eq. 21, over pi
// Why this form: with d = (1 - t) / m it is D = (1 - d) / (pi t (d (2 - d) + m (1 - d)^2)^2), whose sums are of positive
// terms. Of 1 - t and 1 - m the one that float32 has exactly makes 1 - d.
float lobe_D_Schlick(float NdotH, float alpha) {
    float t = clamp(NdotH, 0.0, 1.0), m = clamp(alpha, LOBE_ALPHA_MIN, 1.0);
    float x = m < 0.5 ? m - (1.0 - t) : t - (1.0 - m);
    if (x <= 0.0) return 0.0;
    float y = x / m, d = (1.0 - t) / m;
    float k = d * (1.0 + y) + m * y * y;
    return LOBE_INV_PI * y / (t * k * k);
}

// Schlick's directional reflection: what his facets reflect once, shadowed and masked.
//   f = S G(NdotL) G(NdotV) Z A / (4 pi NdotL NdotV),   S = f0 + (1 - f0)(1 - L.H)^5         [1/sr]
// param  f0  color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  r   float  1e-8..1  0.1   roughness factor, alpha^2
// param  p   float  0.01..1  0.5   isotropy factor: 1 isotropic, towards 0 grooves along T
// reciprocal  yes
// energy      no, 4.16 at r = 0.01, p = 1.0, at 89.9 degrees; 1.042 there at 85
// family      specular
// units       16, the lengths of N, V and L as in lobe_GGX
// source      Schlick 1994, eq. 29
// Why this form: the cosines of G and of the foreshortening cancel out. T.H and B.H as in lobe_GGX_aniso.
vec3 lobe_Schlick_directional(vec3 N, vec3 T, vec3 V, vec3 L, vec3 f0, float r, float p) {
    vec3 H = lobe_H(V, L);
    vec2 c = lobe_cosines(N, V, L, H);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    c = min(c, 1.0);
    vec2 g = clamp(r, 0.0, 1.0) * (1.0 - c) + c;
    vec3 X = cross(N, H);
    float ZA = lobe_Z_Schlick(N, H, r) * lobe_A_Schlick(dot(cross(N, T), X), -dot(T, X), p);
    return 0.25 * LOBE_INV_PI * ZA / max(g.x * g.y, 1e-28) * lobe_F_Schlick(0.5 * length(H), clamp(f0, 0.0, 1.0));
}

// Schlick's model of one layer without its mirror part: diffuse and glossy, by how rough it is, with shadowed light sent on.
//   f = S (a / pi + b (G G' Z A + 1 - G G') / (4 pi NdotL NdotV)),   b = 4 r (1 - r)         [1/sr]
//   a = 0 where r < 1/2, 1 - b elsewhere;   G = G1(NdotL), G' = G1(NdotV), S = f0 + (1 - f0)(1 - L.H)^5
// param  f0  color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  r   float  1e-8..1  0.1   roughness factor, alpha^2
// param  p   float  0.01..1  0.5   isotropy factor: 1 isotropic, towards 0 grooves along T
// reciprocal  yes
// energy      no, 286.3 at r = 0.5, p = 1.0, at 89.9 degrees, unbounded beyond
// family      specular
// units       16, the lengths of N, V and L as in lobe_GGX
// source      Schlick 1994, eq. 30
// The mirror part is lobe_Schlick_mirror.
// Why this form: (1 - G G') / (NdotL NdotV) as a sum of positive terms, over the divisors of G and G'.
vec3 lobe_Schlick(vec3 N, vec3 T, vec3 V, vec3 L, vec3 f0, float r, float p) {
    vec3 H = lobe_H(V, L);
    vec2 c = lobe_cosines(N, V, L, H);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    c = min(c, 1.0);
    float x = clamp(r, 0.0, 1.0), mirror = 1.0 - 2.0 * x;
    float a = x < 0.5 ? 0.0 : mirror * mirror, b = 4.0 * x * (1.0 - x);
    vec2 s = 1.0 - c, g = x * s + c;
    vec3 X = cross(N, H);
    float ZA = lobe_Z_Schlick(N, H, x) * lobe_A_Schlick(dot(cross(N, T), X), -dot(T, X), p);
    float sent = x * (x * s.x * s.y + s.x * c.y + s.y * c.x) / max(c.x * c.y, 1e-28);
    float f = LOBE_INV_PI * (a + 0.25 * b * (ZA + sent) / max(g.x * g.y, 1e-28));
    return f * lobe_F_Schlick(0.5 * length(H), clamp(f0, 0.0, 1.0));
}

// Mirror part of Schlick's model of one layer: what its mirror image is weighted with.
//   S c,   c = (1 - 2 r)^2 where r < 1/2, 0 elsewhere;   S = f0 + (1 - f0)(1 - cosI)^5
// param  f0  color  0..1  0.04  reflectance at normal incidence, linear RGB
// param  r   float  0..1  0.1   roughness factor, alpha^2
// units   8
// source  Schlick 1994, eq. 30
vec3 lobe_Schlick_mirror(float cosI, vec3 f0, float r) {
    float c = max(1.0 - 2.0 * clamp(r, 0.0, 1.0), 0.0);
    return c * c * lobe_F_Schlick(cosI, clamp(f0, 0.0, 1.0));
}

// Schlick's model of two layers without its mirror part: what the outer one lets through, the inner one reflects.
//   f = S D(r, p) + (1 - S) S' D(rb, pb),   D = lobe_Schlick / S, the same L.H in S and S'   [1/sr]
// param  f0   color  0.01..1  0.04  reflectance of the outer layer at normal incidence, linear RGB
// param  r    float  1e-8..1  0.01  roughness factor of the outer layer
// param  p    float  0.01..1  1.0   isotropy factor of the outer layer
// param  f0b  color  0.01..1  0.5   reflectance of the inner layer at normal incidence, linear RGB
// param  rb   float  1e-8..1  0.6   roughness factor of the inner layer
// param  pb   float  0.01..1  0.5   isotropy factor of the inner layer
// reciprocal  yes
// energy      no, 286.3 at r = 0.5, p = 1.0, at 89.9 degrees, unbounded beyond
// units       16, the lengths of N, V and L as in lobe_GGX
// source      Schlick 1994, eq. 24
// Why this form: 1 - S = (1 - f0)(1 - (1 - L.H)^5) is Schlick's term of 1 - f0 with 0 at grazing, and keeps its digits.
vec3 lobe_Schlick_double(vec3 N, vec3 T, vec3 V, vec3 L, vec3 f0, float r, float p, vec3 f0b, float rb, float pb) {
    float LdotH = lobe_LdotH(V, L);
    vec3 outer = clamp(f0, 0.0, 1.0);
    vec3 inner = clamp(f0b, 0.0, 1.0);
    vec3 through = lobe_F_Schlick(LdotH, 1.0 - outer, vec3(0.0)) * lobe_F_Schlick(LdotH, inner);
    return lobe_F_Schlick(LdotH, outer) * lobe_Schlick(N, T, V, L, vec3(1.0), r, p)
           + through * lobe_Schlick(N, T, V, L, vec3(1.0), rb, pb);
}

// Mirror part of Schlick's model of two layers: what its mirror image is weighted with.
//   S c + (1 - S) S' c',   c, c' and S, S' as in lobe_Schlick_mirror
// param  f0   color  0..1  0.04  reflectance of the outer layer at normal incidence, linear RGB
// param  r    float  0..1  0.01  roughness factor of the outer layer
// param  f0b  color  0..1  0.5   reflectance of the inner layer at normal incidence, linear RGB
// param  rb   float  0..1  0.6   roughness factor of the inner layer
// units   8
// source  Schlick 1994, eq. 24, 30
vec3 lobe_Schlick_double_mirror(float cosI, vec3 f0, float r, vec3 f0b, float rb) {
    return lobe_Schlick_mirror(cosI, f0, r)
           + lobe_F_Schlick(cosI, 1.0 - clamp(f0, 0.0, 1.0), vec3(0.0)) * lobe_Schlick_mirror(cosI, f0b, rb);
}

// Half vector of Schlick's facets at random: a unit H. The light comes from lobe_reflect(H, V).
//   H = normalize(tan(theta) (cos(phi) T + sin(phi) B) + N),   tan(theta) = sqrt(r u.y / (1 - u.y))
//   (cos(phi), sin(phi)) = normalize(p cos(psi), sin(psi)),   psi = 2 pi u.x
// param  r  float  1e-8..1  0.1  roughness factor, alpha^2
// param  p  float  0.01..1  0.5  isotropy factor: 1 isotropic, towards 0 grooves along T
// param  u  vec2   0..0.9999999  0.5  uniform random numbers
// units   8
// source  Schlick 1994, section 5, for the zenith; density A^2 / (2 pi) of the azimuth, which inverts in closed form
// The paper's own azimuth does not have the density A. With this one the weight is 1 / A, in sqrt(p)..1 / sqrt(p).
vec3 lobe_sample_Schlick(vec3 N, vec3 T, float r, float p, vec2 u) {
    vec2 x = clamp(u, 0.0, 0.9999999);
    vec2 a = vec2(clamp(p, 1e-4, 1.0), 1.0) * lobe_circle(x.x);
    a *= sqrt(clamp(r, 1e-8, 1.0) * x.y / (1.0 - x.y)) / max(length(a), LOBE_SMALLEST_DIVISOR);
    vec3 H = a.x * T + a.y * cross(N, T) + N;
    return H / max(length(H), LOBE_SMALLEST_DIVISOR);
}

// Density of lobe_reflect(H, V) for H = lobe_sample_Schlick(...), over the solid angle of L.
//   pdf = Z A^2 N.H / (4 pi V.H),   H of unit length                                         [1/sr]
// param  r  float  1e-8..1  0.1  roughness factor, alpha^2
// param  p  float  0.01..1  0.5  isotropy factor: 1 isotropic, towards 0 grooves along T
// units   16, the lengths of N, V and L as in lobe_GGX
// source  as lobe_sample_Schlick
// Within a rounding of the pole, 1e-7, the azimuth is noise, and A^2 with it: anything in p..1 / p.
// 0 where V or the half vector is below the horizon. L may be below it: such a sample is drawn and has f = 0.
// Why this form: where V and L are nearly opposite and H is nearly at right angles to N, a second step of lobe_H gives
// N.H the digits that the first has not; of vectors that are no units it stays finite by its bound.
float lobe_pdf_Schlick(vec3 N, vec3 T, vec3 V, vec3 L, float r, float p) {
    vec3 H = lobe_H(V, L), across = V - L;
    H -= clamp(0.25 * dot(H, across), -1.0, 1.0) * across;
    float NdotV = dot(N, V), NH = dot(N, H);
    if (min(NdotV, NH) <= 0.0) return 0.0;
    vec3 X = cross(N, H);
    float A = lobe_A_Schlick(dot(cross(N, T), X), -dot(T, X), p);
    return 0.5 * LOBE_INV_PI * lobe_Z_Schlick(N, H, r) * A * A * (NH / max(dot(H, H), 1e-26));
}

#endif
