// Ashikhmin and Shirley's anisotropic Phong model, with a diffuse part that leaves to the highlight what is its own.
// needs  core, fresnel, blinn_phong
//
// To draw from the whole model, take its highlight with a probability P of your choice, by lobe_sample_AshikhminShirley, else
// lobe_sample_Lambert; the density is that of both:
//     mix(lobe_pdf_Lambert(N, L), lobe_pdf_AshikhminShirley(N, T, V, L, nu, nv), P)
#ifndef LOBE_CORE_GLSL
#error "ashikhmin_shirley.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_FRESNEL_GLSL
#error "ashikhmin_shirley.glsl needs fresnel.glsl: put fresnel.glsl before it"
#endif
#ifndef LOBE_BLINN_PHONG_GLSL
#error "ashikhmin_shirley.glsl needs blinn_phong.glsl: put blinn_phong.glsl before it"
#endif
#ifndef LOBE_ASHIKHMIN_SHIRLEY_GLSL
#define LOBE_ASHIKHMIN_SHIRLEY_GLSL

// Anisotropic cosine power as a distribution of facet normals. The three cosines may come from an H of any length.
//   D = sqrt((nu + 2)(nv + 2)) / (2 pi) c^e,   e = (nu TdotH^2 + nv BdotH^2) / (TdotH^2 + BdotH^2)
//   c = (1 + tan^2)^(-1/2),   tan^2 = (TdotH^2 + BdotH^2) / NdotH^2                          [1/sr]
// param  NdotH  cosine  1e-6..1  0.9    cosine between the normal and the half vector
// param  nu     float   0..1e5   100.0  exponent along T
// param  nv     float   0..1e5   1000.0  exponent along B
// normalised  yes
// units       16, exp and log
// source      Ashikhmin, Shirley 2000; Ashikhmin, Premoze, Shirley 2000 for the distribution
// Why this form: the tangent needs no 1 - NdotH^2, no unit H, and says c = 1 at the pole, where e has no value.
float lobe_D_AshikhminShirley(float NdotH, float TdotH, float BdotH, float nu, float nv) {
    vec2 n = clamp(vec2(nu, nv), 0.0, LOBE_EXPONENT_MAX);
    vec2 h = clamp(vec2(TdotH, BdotH), -1e15, 1e15);
    vec2 h2 = h * h;
    float sine2 = h2.x + h2.y, e = dot(n, h2) / max(sine2, LOBE_SMALLEST_DIVISOR);
    float factor = 0.5 * LOBE_INV_PI * sqrt((n.x + 2.0) * (n.y + 2.0));
    if (NdotH <= 0.0) return sine2 > 0.0 && e == 0.0 ? factor : 0.0;
    return factor * lobe_inv_pow1p(sine2 / max(NdotH * NdotH, LOBE_SMALLEST_DIVISOR), 0.5 * e);
}

// Ashikhmin and Shirley's highlight.
//   f = sqrt((nu + 1)(nv + 1)) / (8 pi) (N.H)^e F / (L.H max(NdotL, NdotV))                  [1/sr]
//   F = rs + (1 - rs)(1 - L.H)^5,   e as in lobe_D_AshikhminShirley
// param  rs  color  0.01..1  0.5  reflectance at normal incidence, linear RGB
// param  nu  float  0..1e5  100.0   exponent along T
// param  nv  float  0..1e5  1000.0  exponent along B = N x T
// reciprocal  yes
// energy      <= 1
// family      specular
// units       16, exp and log, and the lengths of N, V and L as in lobe_GGX
// source      Ashikhmin, Shirley 2000, eq. 4
// Why this form: half the exponent twice, since exp ends at -87 and f, divided by cosines, does not.
vec3 lobe_AshikhminShirley_specular(vec3 N, vec3 T, vec3 V, vec3 L, vec3 rs, float nu, float nv) {
    vec3 H = lobe_H(V, L);
    vec2 c = lobe_cosines(N, V, L, H);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    vec2 n = clamp(vec2(nu, nv), 0.0, LOBE_EXPONENT_MAX);
    vec3 X = cross(N, H);
    float LdotH = 0.5 * length(H);
    float k = lobe_D_AshikhminShirley(c.x + c.y, dot(cross(N, T), X), -dot(T, X), 0.5 * n.x, 0.5 * n.y);
    k /= sqrt((0.5 * n.x + 2.0) * (0.5 * n.y + 2.0));  // (N.H)^(e / 2) / (2 pi)
    float peak = 1.57079633 * sqrt((n.x + 1.0) * (n.y + 1.0)) / max(LdotH * max(c.x, c.y), 1e-28);
    return peak * k * k * lobe_F_Schlick(LdotH, clamp(rs, 0.0, 1.0));
}

// Ashikhmin and Shirley's diffuse part: less of it towards grazing, where the highlight has more.
//   f = 28 rd (1 - rs) / (23 pi) (1 - (1 - NdotL / 2)^5) (1 - (1 - NdotV / 2)^5)             [1/sr]
// param  rd  color  0..1  0.5   diffuse albedo at most, linear RGB
// param  rs  color  0..1  0.04  reflectance at normal incidence of the highlight, linear RGB
// reciprocal  yes
// energy      <= 1
// units       8
// source      Ashikhmin, Shirley 2000, eq. 5
// Why this form: 1 - u^5 = (1 - u)(1 + u + u^2 + u^3 + u^4) keeps its digits at grazing.
vec3 lobe_AshikhminShirley_diffuse(vec3 N, vec3 V, vec3 L, vec3 rd, vec3 rs) {
    vec2 x = 0.5 * min(vec2(dot(N, V), dot(N, L)), 1.0);
    if (min(x.x, x.y) <= 0.0) return vec3(0.0);
    vec2 u = 1.0 - x, u2 = u * u;
    vec2 k = x * ((1.0 + u) * (1.0 + u2) + u2 * u2);
    return clamp(rd, 0.0, 1.0) * (1.0 - clamp(rs, 0.0, 1.0)) * (1.21739130 * LOBE_INV_PI * k.x * k.y);
}

// Ashikhmin and Shirley's model: the highlight on its diffuse ground.
//   f = lobe_AshikhminShirley_specular + lobe_AshikhminShirley_diffuse             [1/sr]
// param  rd  color  0..1    0.5     diffuse albedo at most, linear RGB
// param  rs  color  0.01..1  0.04  reflectance at normal incidence of the highlight, linear RGB
// param  nu  float  0..1e5  100.0   exponent along T
// param  nv  float  0..1e5  1000.0  exponent along B = N x T
// reciprocal  yes
// energy      <= 1
// units       16, exp and log, and the lengths of N, V and L as in lobe_GGX
// source      Ashikhmin, Shirley 2000, eq. 4, 5
vec3 lobe_AshikhminShirley(vec3 N, vec3 T, vec3 V, vec3 L, vec3 rd, vec3 rs, float nu, float nv) {
    return lobe_AshikhminShirley_specular(N, T, V, L, rs, nu, nv) + lobe_AshikhminShirley_diffuse(N, V, L, rd, rs);
}

// Half vector of Ashikhmin and Shirley's highlight at random: a unit H. The light comes from lobe_reflect(H, V).
//   H = sin(theta) (cos(phi) T + sin(phi) B) + cos(theta) N,   cos(theta) = (1 - u.y)^(1 / (e + 1))
//   (cos(phi), sin(phi)) = normalize(sqrt(nv + 1) cos(psi), sqrt(nu + 1) sin(psi)),   psi = 2 pi u.x
// param  nu  float  0..1e5  100.0   exponent along T
// param  nv  float  0..1e5  1000.0  exponent along B = N x T
// param  u   vec2   0..0.9999999  0.5  uniform random numbers
// units   16, exp and log
// source  Ashikhmin, Shirley 2000, eq. 9, 10, in all four quadrants at once
// Why this form: cos(theta) alone knows nothing of a narrow highlight; lobe_sample_Phong has its sine. Seen along N, its
// azimuth 0 lies at -T.
vec3 lobe_sample_AshikhminShirley(vec3 N, vec3 T, float nu, float nv, vec2 u) {
    vec2 n = clamp(vec2(nu, nv), 0.0, LOBE_EXPONENT_MAX);
    vec2 a = sqrt(n.yx + 1.0) * lobe_circle(u.x);
    a /= max(length(a), LOBE_SMALLEST_DIVISOR);
    return lobe_sample_Phong(N, -a.x * T - a.y * cross(N, T), N, dot(n, a * a), vec2(0.0, u.y));
}

// Density of lobe_reflect(H, V) for H = lobe_sample_AshikhminShirley(...), over the solid angle of L.
//   pdf = sqrt((nu + 1)(nv + 1)) / (2 pi) (N.H)^e / (4 V.H),   e as in lobe_D_AshikhminShirley  [1/sr]
// param  nu  float  0..1e5  100.0   exponent along T
// param  nv  float  0..1e5  1000.0  exponent along B = N x T
// units   16, exp and log, and the lengths of N, V and L as in lobe_GGX
// source  Ashikhmin, Shirley 2000, eq. 7, 8
// 0 where V or the half vector is below the horizon. L may be below it: such a sample is drawn and has f = 0.
// Why this form: where V and L are nearly opposite and H is nearly at right angles to N, a second step of lobe_H gives
// N.H the digits that the first has not; of vectors that are no units it stays finite by its bound.
float lobe_pdf_AshikhminShirley(vec3 N, vec3 T, vec3 V, vec3 L, float nu, float nv) {
    vec3 H = lobe_H(V, L), across = V - L;
    H -= clamp(0.25 * dot(H, across), -1.0, 1.0) * across;
    float NdotV = dot(N, V), NH = dot(N, H);
    if (min(NdotV, NH) <= 0.0) return 0.0;
    vec2 n = clamp(vec2(nu, nv), 0.0, LOBE_EXPONENT_MAX);
    vec3 X = cross(N, H);
    float D = lobe_D_AshikhminShirley(NH, dot(cross(N, T), X), -dot(T, X), n.x, n.y);
    D *= 0.5 * sqrt((n.x + 1.0) * (n.y + 1.0)) / sqrt((n.x + 2.0) * (n.y + 2.0));
    return D / max(length(H), 1e-28);
}

#endif
