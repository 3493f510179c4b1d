// Lafortune's cosine lobes about any direction that a diagonal matrix makes of the view.
// needs  core, blinn_phong
//
// x is along T, y along B = N x T, z along N. A lobe is told by C = (Cx, Cy, Cz) and its exponent: C = (-1, -1, 1) is Phong's
// about the mirror direction, (1, 1, 1) shines back, (0, 0, 1) is diffuse; a Cz unlike -Cx moves the peak off the mirror.
//
// To draw from several lobes over a diffuse part, take one of them with a probability of your choice, by lobe_sample_Lafortune
// with one channel's C, or lobe_sample_Lambert; the density is the sum of all densities with the same probabilities.
#ifndef LOBE_CORE_GLSL
#error "lafortune.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_BLINN_PHONG_GLSL
#error "lafortune.glsl needs blinn_phong.glsl: put blinn_phong.glsl before it"
#endif
#ifndef LOBE_LAFORTUNE_GLSL
#define LOBE_LAFORTUNE_GLSL

// One lobe of Lafortune's, one channel, from directions in the frame of the surface. Knows no horizon; cut at 1e38.
//   max(0, C.x l.x v.x + C.y l.y v.y + C.z l.z v.z)^exponent,   l = lLocal, v = vLocal
// param  lLocal    vec3   -1..1     -0.48,0.64,0.6  light direction along T, B, N
// param  vLocal    vec3   -1..1     0.6,0.0,0.8     view direction along T, B, N
// param  C         vec3   -1.2..1.2  -0.9,-0.9,0.9  what each component is weighted with
// param  exponent  float  0.1..400  20.0  exponent of the lobe
// units   16, exp and log
// source  Lafortune, Foo, Torrance, Greenberg 1997, eq. 7
// Why this form: pow has an error of exponent roundings near 1, from both sides, and lobe_inv_pow1p has not.
float lobe_Lafortune_lobe(vec3 lLocal, vec3 vLocal, vec3 C, float exponent) {
    vec3 l = clamp(lLocal, -1e8, 1e8), v = clamp(vLocal, -1e8, 1e8);
    float b = dot(clamp(C, -1e8, 1e8) * l, v);
    if (b <= 0.0) return 0.0;
    if (b < 1.0) return lobe_inv_pow1p((1.0 - b) / max(b, LOBE_SMALLEST_DIVISOR), exponent);
    float root = 1.0 / max(lobe_inv_pow1p(b - 1.0, 0.5 * exponent), 1e-19);
    return root * root;
}

// Lafortune's model: a diffuse part and one lobe with its own shape in each channel.
//   f = diffuse / pi + the sum over lobes of max(0, Cx L.T V.T + Cy L.B V.B + Cz N.L N.V)^exponent   [1/sr]
// param  diffuse  color  0..1  0.2  albedo of the diffuse part, linear RGB
// param  Cx  vec3  -1.2..1.2  -0.9  weight of the components along T, for R, G, B
// param  Cy  vec3  -1.2..1.2  -0.9  weight of the components along B = N x T, for R, G, B
// param  Cz  vec3  -1.2..1.2  0.9  weight of the components along N, for R, G, B
// param  exponent  vec3  0.1..400  20.0  exponent of the lobe, for R, G, B
// reciprocal  yes
// energy      no, 2.992 over shapes with C in -1..1 and diffuse 0, unbounded beyond
// units       16, exp and log
// source      Lafortune, Foo, Torrance, Greenberg 1997, eq. 7
// Why this form: along the surface V is N x V turned by a quarter, 0 to the last digit at V = N, where T.V is a rounding.
vec3 lobe_Lafortune(vec3 N, vec3 T, vec3 V, vec3 L, vec3 diffuse, vec3 Cx, vec3 Cy, vec3 Cz, vec3 exponent) {
    float NdotV = dot(N, V), NdotL = dot(N, L);
    if (min(NdotV, NdotL) <= 0.0) return vec3(0.0);
    vec3 B = cross(N, T), XV = cross(N, V), XL = cross(N, L);
    vec3 v = vec3(dot(B, XV), -dot(T, XV), NdotV), l = vec3(dot(B, XL), -dot(T, XL), NdotL);
    return clamp(diffuse, 0.0, 1.0) * LOBE_INV_PI
           + vec3(lobe_Lafortune_lobe(l, v, vec3(Cx.x, Cy.x, Cz.x), exponent.x),
                  lobe_Lafortune_lobe(l, v, vec3(Cx.y, Cy.y, Cz.y), exponent.y),
                  lobe_Lafortune_lobe(l, v, vec3(Cx.z, Cy.z, Cz.z), exponent.z));
}

// Lafortune's model with two lobes in each channel.
//   f = diffuse / pi + the sum over lobes of max(0, Cx L.T V.T + Cy L.B V.B + Cz N.L N.V)^exponent   [1/sr]
// param  diffuse  color  0..1  0.2  albedo of the diffuse part, linear RGB
// param  Cx1  vec3  -1.2..1.2  -0.9  weight of the components along T, for R, G, B
// param  Cy1  vec3  -1.2..1.2  -0.9  weight of the components along B = N x T, for R, G, B
// param  Cz1  vec3  -1.2..1.2  0.9  weight of the components along N, for R, G, B
// param  exponent1  vec3  0.1..400  20.0  exponent of the lobe, for R, G, B
// param  Cx2  vec3  -1.2..1.2  -0.9  weight of the components along T, for R, G, B
// param  Cy2  vec3  -1.2..1.2  -0.9  weight of the components along B = N x T, for R, G, B
// param  Cz2  vec3  -1.2..1.2  0.9  weight of the components along N, for R, G, B
// param  exponent2  vec3  0.1..400  20.0  exponent of the lobe, for R, G, B
// reciprocal  yes
// energy      no, 5.984 over shapes with C in -1..1 and diffuse 0, unbounded beyond
// units       16, exp and log
// source      Lafortune, Foo, Torrance, Greenberg 1997, eq. 7
vec3 lobe_Lafortune2(vec3 N, vec3 T, vec3 V, vec3 L, vec3 diffuse, vec3 Cx1, vec3 Cy1, vec3 Cz1, vec3 exponent1,
                     vec3 Cx2, vec3 Cy2, vec3 Cz2, vec3 exponent2) {
    return lobe_Lafortune(N, T, V, L, diffuse, Cx1, Cy1, Cz1, exponent1)
           + lobe_Lafortune(N, T, V, L, vec3(0.0), Cx2, Cy2, Cz2, exponent2);
}

// Lafortune's model with three lobes in each channel, as most published fits have.
//   f = diffuse / pi + the sum over lobes of max(0, Cx L.T V.T + Cy L.B V.B + Cz N.L N.V)^exponent   [1/sr]
// param  diffuse  color  0..1  0.2  albedo of the diffuse part, linear RGB
// param  Cx1  vec3  -1.2..1.2  -0.9  weight of the components along T, for R, G, B
// param  Cy1  vec3  -1.2..1.2  -0.9  weight of the components along B = N x T, for R, G, B
// param  Cz1  vec3  -1.2..1.2  0.9  weight of the components along N, for R, G, B
// param  exponent1  vec3  0.1..400  20.0  exponent of the lobe, for R, G, B
// param  Cx2  vec3  -1.2..1.2  -0.9  weight of the components along T, for R, G, B
// param  Cy2  vec3  -1.2..1.2  -0.9  weight of the components along B = N x T, for R, G, B
// param  Cz2  vec3  -1.2..1.2  0.9  weight of the components along N, for R, G, B
// param  exponent2  vec3  0.1..400  20.0  exponent of the lobe, for R, G, B
// param  Cx3  vec3  -1.2..1.2  -0.9  weight of the components along T, for R, G, B
// param  Cy3  vec3  -1.2..1.2  -0.9  weight of the components along B = N x T, for R, G, B
// param  Cz3  vec3  -1.2..1.2  0.9  weight of the components along N, for R, G, B
// param  exponent3  vec3  0.1..400  20.0  exponent of the lobe, for R, G, B
// reciprocal  yes
// energy      no, 8.976 over shapes with C in -1..1 and diffuse 0, unbounded beyond; 1.552 of the published brushed metal, seen at 80
// units       16, exp and log
// source      Lafortune, Foo, Torrance, Greenberg 1997, eq. 7
vec3 lobe_Lafortune3(vec3 N, vec3 T, vec3 V, vec3 L, vec3 diffuse, vec3 Cx1, vec3 Cy1, vec3 Cz1, vec3 exponent1,
                     vec3 Cx2, vec3 Cy2, vec3 Cz2, vec3 exponent2, vec3 Cx3, vec3 Cy3, vec3 Cz3, vec3 exponent3) {
    return lobe_Lafortune(N, T, V, L, diffuse, Cx1, Cy1, Cz1, exponent1)
           + lobe_Lafortune(N, T, V, L, vec3(0.0), Cx2, Cy2, Cz2, exponent2)
           + lobe_Lafortune(N, T, V, L, vec3(0.0), Cx3, Cy3, Cz3, exponent3);
}

// C of Phong's lobe about the mirror direction, of albedo 1 at normal incidence.
//   C = n (-1, -1, 1),   n = ((exponent + 2) / (2 pi))^(1 / exponent)
// param  exponent  float  0.1..1e6  20.0  exponent of the lobe
// units   16, pow
// source  Lafortune, Foo, Torrance, Greenberg 1997, section 3.1
vec3 lobe_Lafortune_C_Phong(float exponent) {
    float e = clamp(exponent, 0.1, LOBE_EXPONENT_MAX);
    return pow((e + 2.0) * 0.159154943, 1.0 / e) * vec3(-1.0, -1.0, 1.0);
}

// C of a lobe that shines back to where the light comes from.
//   C = n (1, 1, 1),   n = ((exponent + 2) / (2 pi))^(1 / exponent)
// param  exponent  float  0.1..1e6  20.0  exponent of the lobe
// units   16, pow
// source  Lafortune, Foo, Torrance, Greenberg 1997, section 3.1
vec3 lobe_Lafortune_C_retro(float exponent) {
    return lobe_Lafortune_C_Phong(exponent) * vec3(-1.0, -1.0, 1.0);
}

// C of a diffuse part that falls off towards the rim.
//   C = n (0, 0, 1),   n = ((exponent + 2) / (2 pi))^(1 / exponent)
// param  exponent  float  0.1..1e6  20.0  exponent of the lobe
// units   16, pow
// source  Lafortune, Foo, Torrance, Greenberg 1997, section 3.1
vec3 lobe_Lafortune_C_diffuse(float exponent) {
    return lobe_Lafortune_C_Phong(exponent) * vec3(0.0, 0.0, 1.0);
}

// C of a lobe whose peak lies beyond the mirror direction, towards grazing. Its albedo at normal incidence is ratio^exponent.
//   C = n (-1, -1, ratio),   n = ((exponent + 2) / (2 pi))^(1 / exponent)
// param  ratio  float  0..1  0.8  tangent of the incident angle over that of the peak
// param  exponent  float  0.1..1e6  20.0  exponent of the lobe
// units   16, pow
// source  Lafortune, Foo, Torrance, Greenberg 1997, section 3.1
vec3 lobe_Lafortune_C_offspecular(float ratio, float exponent) {
    return lobe_Lafortune_C_Phong(exponent) * vec3(1.0, 1.0, clamp(ratio, 0.0, 1.0));
}

// C of a lobe about the mirror direction with its own width along each tangent.
//   C = n (-x, -y, 1),   n = ((exponent + 2) / (2 pi))^(1 / exponent)
// param  x  float  0..1  0.9  weight along T: less is wider
// param  y  float  0..1  0.9  weight along B: less is wider
// param  exponent  float  0.1..1e6  20.0  exponent of the lobe
// units   16, pow
// source  Lafortune, Foo, Torrance, Greenberg 1997, section 3.1
vec3 lobe_Lafortune_C_aniso(float x, float y, float exponent) {
    return lobe_Lafortune_C_Phong(exponent) * vec3(clamp(x, 0.0, 1.0), clamp(y, 0.0, 1.0), 1.0);
}

// Light direction of one of Lafortune's lobes, one channel, at random: a unit L.
//   L = l turned so that N comes to a, by half a turn about N + a;   a = normalize(C.x V.T T + C.y V.B B + C.z V.N N)
//   l = sin(t) (cos(phi) T + sin(phi) B) + cos(t) N,   cos(t) = (1 - u.y)^(1 / (exponent + 1)), phi = 2 pi u.x
// param  C         vec3   -1.2..1.2  -0.9,-0.9,0.9  weights of the components along T, B, N
// param  exponent  float  0.1..400  20.0  exponent of the lobe
// param  u         vec2   0..0.9999999  0.5  uniform random numbers
// units   80, B = N x T beside a component that is small
// source  Lafortune, Foo, Torrance, Greenberg 1997, section 3.2
// Why this form: as in lobe_sample_Phong, which makes l when it looks along the normal. A null a is taken for N.
vec3 lobe_sample_Lafortune(vec3 N, vec3 T, vec3 V, vec3 C, float exponent, vec2 u) {
    vec3 B = cross(N, T), X = cross(N, V);
    vec3 a = clamp(C, -1e4, 1e4) * vec3(dot(B, X), -dot(T, X), dot(N, V));
    float size = length(a);
    a = size > 1e-15 ? a / size : vec3(0.0, 0.0, 1.0);
    vec3 l = lobe_sample_Phong(vec3(0.0, 0.0, 1.0), vec3(-1.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0), exponent, u);
    float aa = dot(a.xy, a.xy), side = dot(a.xy, l.xy);
    if (aa < 1e-30 && a.z < 0.0) return l.x * T - l.y * B - l.z * N;
    float k = l.z + side / max(a.z > 0.0 ? 1.0 + a.z : aa / (1.0 - a.z), LOBE_SMALLEST_DIVISOR);
    return (k * a.x - l.x) * T + (k * a.y - l.y) * B + (a.z * l.z + side) * N;
}

// Density of lobe_sample_Lafortune, over the solid angle of L, which may be anywhere on the sphere.
//   pdf = (exponent + 1) / (2 pi) max(0, a.L)^exponent,   a as in lobe_sample_Lafortune      [1/sr]
// param  C         vec3   -1.2..1.2  -0.9,-0.9,0.9  weights of the components along T, B, N
// param  exponent  float  0.1..400  20.0  exponent of the lobe
// units   16, exp and log
// source  Lafortune, Foo, Torrance, Greenberg 1997, section 3.2
// 0 where V is below the horizon.
// Why this form: the tangent between a and L has digits in the lobe and knows no lengths.
float lobe_pdf_Lafortune(vec3 N, vec3 T, vec3 V, vec3 L, vec3 C, float exponent) {
    if (dot(N, V) <= 0.0) return 0.0;
    vec3 B = cross(N, T), XV = cross(N, V), c = clamp(C, -1e4, 1e4);
    vec3 a = c.x * dot(B, XV) * T - c.y * dot(T, XV) * B + c.z * dot(N, V) * N;
    float size = length(a);
    a = size > 1e-15 ? a / size : N;
    float aL = dot(a, L);
    if (aL <= 0.0) return 0.0;
    vec3 X = cross(a, L);
    float e = clamp(exponent, 0.0, LOBE_EXPONENT_MAX), tan2 = dot(X, X) / max(aL * aL, LOBE_SMALLEST_DIVISOR);
    return 0.5 * LOBE_INV_PI * (e + 1.0) * lobe_inv_pow1p(tan2, 0.5 * e);
}

#endif
