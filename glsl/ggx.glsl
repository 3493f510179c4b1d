// GGX microfacets, which Trowbridge and Reitz published first: distribution, Smith masking, and the lobes made of them.
// needs  core, fresnel, masking
#ifndef LOBE_CORE_GLSL
#error "ggx.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_FRESNEL_GLSL
#error "ggx.glsl needs fresnel.glsl: put fresnel.glsl before it"
#endif
#ifndef LOBE_MASKING_GLSL
#error "ggx.glsl needs masking.glsl: put masking.glsl before it"
#endif
#ifndef LOBE_GGX_GLSL
#define LOBE_GGX_GLSL

// GGX (Trowbridge-Reitz) distribution of facet normals from a cosine, for those who have no vectors.
//   D = alpha^2 / (pi (1 - NdotH^2 + alpha^2 NdotH^2)^2)                            [1/sr]
// param  alpha  float  1e-4..4  0.25  microfacet width
// normalised  yes
// family      distribution
// units       8
// source      Trowbridge, Reitz 1975; Walter et al. 2007, eq. 33
// Take the vector form where alpha is small: the rounding of NdotH alone costs 1e-5 at alpha = 0.1, 0.1 % at 0.01,
// 2.5 % at 0.002 and everything at 1e-4.
float lobe_D_GGX(float NdotH, float alpha) {
    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    float c = clamp(NdotH, -1.0, 1.0);
    float k = a / (1.0 - c * c + (a * c) * (a * c));
    return k * k * LOBE_INV_PI;
}

// GGX (Trowbridge-Reitz) distribution of facet normals; H may have any length.
//   D = alpha^2 |H|^4 / (pi (|N x H|^2 + alpha^2 (N.H)^2)^2)                        [1/sr]
// param  alpha  float  1e-4..4  0.25  microfacet width
// normalised  yes
// family      distribution
// units       8
// source      Trowbridge, Reitz 1975; Walter et al. 2007, eq. 33
// Why this form: |N x H| keeps its digits at the peak, where 1 - NdotH^2 has none, and no H is normalised: |H|^2 is
// |N x H|^2 + (N.H)^2. All sums are of positive terms, which no compiler can reorder into a cancellation.
float lobe_D_GGX(vec3 N, vec3 H, float alpha) {
    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    vec3 X = cross(N, H);
    float NH = dot(N, H), aNH = a * NH, XX = dot(X, X);
    float k = a * (XX + NH * NH) / max(XX + aNH * aNH, LOBE_SMALLEST_DIVISOR);
    return k * k * LOBE_INV_PI;
}

// GGX distribution of facet normals, cut where half precision ends: N and H still need highp. H may have any length.
//   D = min(alpha^2 |H|^4 / (pi (|N x H|^2 + alpha^2 (N.H)^2)^2), 65504)              [1/sr]
// param  alpha  float  1e-4..4  0.25  microfacet width
// normalised  yes
// family      distribution
// units       8
// source      Trowbridge, Reitz 1975; 65504 is the largest number of IEEE 754 binary16
// Below alpha = 0.0022 the peak is cut, and the sum of what is left is less than 1.
float lobe_D_GGX_half(vec3 N, vec3 H, float alpha) {
    return min(lobe_D_GGX(N, H, alpha), 65504.0);
}

// GGX distribution of facet normals with a width along each tangent.
//   D = 1 / (pi alphaX alphaY (TdotH^2 / alphaX^2 + BdotH^2 / alphaY^2 + NdotH^2)^2)  [1/sr]
// param  NdotH   cosine  1e-6..1  0.9   cosine between the normal and the half vector
// param  alphaX  float   1e-4..4  0.25  microfacet width along T
// param  alphaY  float   1e-4..4  0.25  microfacet width along B
// normalised  yes
// units       8
// source      Burley 2012, section B.2; Heitz 2014, eq. 85
// Why this form: with the slopes times alphaX alphaY one division does. k w <= 1e14, k <= 1e22: nothing overflows.
float lobe_D_GGX_aniso(float NdotH, float TdotH, float BdotH, float alphaX, float alphaY) {
    vec2 a = clamp(vec2(alphaX, alphaY), LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    float w = a.x * a.y;
    vec3 h = clamp(vec3(TdotH, BdotH, NdotH), vec3(-1.0, -1.0, 1e-7), vec3(1.0)) * vec3(a.y, a.x, w);
    float k = w / dot(h, h);
    return k * w * k * LOBE_INV_PI;
}

// Smith masking of one direction over GGX facets.
//   G1 = 2 c / (c + sqrt(c^2 + alpha^2 (1 - c^2))),   c = NdotX
// param  NdotX  cosine  1e-6..1  0.7  cosine of the direction
// param  alpha  float   0..4     0.25  microfacet width
// units   8
// source  Smith 1967; Walter et al. 2007, eq. 34
float lobe_G1_GGX(float NdotX, float alpha) {
    float c = clamp(NdotX, 0.0, 1.0);
    float a = clamp(alpha, 0.0, LOBE_ALPHA_MAX), a2 = a * a;
    float g = sqrt((c - a2 * c) * c + a2);
    return 2.0 * c / max(c + g, LOBE_SMALLEST_DIVISOR);
}

// Smith masking and shadowing of GGX facets, correlated through their height.
//   G2 = 2 NdotV NdotL / (NdotL g(NdotV) + NdotV g(NdotL)),   g(c) = sqrt(c^2 + alpha^2 (1 - c^2))
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// param  alpha  float   0..4     0.25  microfacet width
// units   8
// source  Heitz 2014, eq. 99
float lobe_G2_GGX(float NdotV, float NdotL, float alpha) {
    vec2 c = clamp(vec2(NdotV, NdotL), 0.0, 1.0);
    float a = clamp(alpha, 0.0, LOBE_ALPHA_MAX), a2 = a * a;
    vec2 g = sqrt((c - a2 * c) * c + a2);
    return 2.0 * c.x * c.y / max(dot(c, g.yx), LOBE_SMALLEST_DIVISOR);
}

// Smith masking and shadowing of GGX facets, taken for independent. Darker than the correlated form.
//   G2 = G1(NdotV) G1(NdotL)
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// param  alpha  float   0..4     0.25  microfacet width
// units   8
// source  Walter et al. 2007, eq. 23
float lobe_G2_GGX_separable(float NdotV, float NdotL, float alpha) {
    return lobe_G1_GGX(NdotV, alpha) * lobe_G1_GGX(NdotL, alpha);
}

// Visibility of GGX facets: height-correlated Smith masking over the foreshortening.
//   V = G2 / (4 NdotV NdotL) = 1 / (2 (NdotL g(NdotV) + NdotV g(NdotL))),   g(c) = sqrt(c^2 + alpha^2 (1 - c^2))
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// param  alpha  float   0..4     0.25  microfacet width
// family  masking
// units   8
// source  Heitz 2014, eq. 99
// Why this form: the cosines of G2 and of the foreshortening cancel out, and with them 0 / 0 at grazing.
// g^2 = (c - alpha^2 c) c + alpha^2 takes two multiply-adds.
float lobe_V_GGX(float NdotV, float NdotL, float alpha) {
    vec2 c = clamp(vec2(NdotV, NdotL), LOBE_SMALLEST_COSINE, 1.0);
    float a = clamp(alpha, 0.0, LOBE_ALPHA_MAX), a2 = a * a;
    vec2 g = sqrt((c - a2 * c) * c + a2);
    return 0.5 / dot(c, g.yx);
}

// Visibility of GGX facets: separable Smith masking over the foreshortening.
//   V = 1 / ((NdotV + g(NdotV)) (NdotL + g(NdotL))),   g(c) = sqrt(c^2 + alpha^2 (1 - c^2))
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// param  alpha  float   0..4     0.25  microfacet width
// family  masking
// units   8
// source  Walter et al. 2007, eq. 23, 34
float lobe_V_GGX_separable(float NdotV, float NdotL, float alpha) {
    vec2 c = clamp(vec2(NdotV, NdotL), LOBE_SMALLEST_COSINE, 1.0);
    float a = clamp(alpha, 0.0, LOBE_ALPHA_MAX), a2 = a * a;
    vec2 g = c + sqrt((c - a2 * c) * c + a2);
    return 1.0 / (g.x * g.y);
}

// Visibility of GGX facets with a width along each tangent: height-correlated Smith masking over the foreshortening.
//   V = 1 / (2 (NdotL g(V) + NdotV g(L))),   g(X) = sqrt(NdotX^2 + (alphaX TdotX)^2 + (alphaY BdotX)^2)
// param  NdotV   cosine  1e-6..1  0.7   cosine of the view direction
// param  NdotL   cosine  1e-6..1  0.7   cosine of the light direction
// param  alphaX  float   0..4     0.25  microfacet width along T
// param  alphaY  float   0..4     0.25  microfacet width along B
// units   8
// source  Heitz 2014, eq. 86, 99
float lobe_V_GGX_aniso(float NdotV, float NdotL, float TdotV, float BdotV, float TdotL, float BdotL, float alphaX,
                       float alphaY) {
    vec2 c = clamp(vec2(NdotV, NdotL), 0.0, 1.0);
    vec2 a = clamp(vec2(alphaX, alphaY), 0.0, LOBE_ALPHA_MAX);
    vec2 v = a * clamp(vec2(TdotV, BdotV), -1.0, 1.0), l = a * clamp(vec2(TdotL, BdotL), -1.0, 1.0);
    vec2 g = sqrt(c * c + vec2(dot(v, v), dot(l, l)));
    return 0.5 / max(dot(c, g.yx), LOBE_SMALLEST_DIVISOR);
}

// Visibility of GGX facets without a square root, between the limits alpha = 0 and 1, where it is exact.
//   V = 0.5 / mix(2 NdotV NdotL, NdotV + NdotL, alpha)
// param  NdotV  cosine  1e-6..1  0.7  cosine of the view direction
// param  NdotL  cosine  1e-6..1  0.7  cosine of the light direction
// param  alpha  float   0..1     0.25  microfacet width
// approximates  lobe_V_GGX  max error 0.293 relative  everywhere, largest where a cosine is about alpha
// family  masking
// units   8
// source  Hammon 2017
float lobe_V_GGX_fast(float NdotV, float NdotL, float alpha) {
    vec2 c = clamp(vec2(NdotV, NdotL), LOBE_SMALLEST_COSINE, 1.0);
    return 0.5 / mix(2.0 * c.x * c.y, c.x + c.y, clamp(alpha, 0.0, 1.0));
}

// GGX (Trowbridge-Reitz) microfacet reflection with height-correlated Smith masking and Schlick's Fresnel term.
//   f = D V F                                                                      [1/sr]
// param  f0     color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alpha  float  1e-4..4  0.25  microfacet width
// reciprocal  yes
// energy      <= 1
// family      specular
// units       16, up to 8 of them are the lengths of N, V and L: float32 holds them within 2^-24, D V feels N six times
// source      Walter et al. 2007, eq. 20, 33; Heitz 2014, eq. 99; Schlick 1994, eq. 15
// Why this form: no H is normalised. T = H - (N.H) N is as long as N x H, and |H|^2 = T.T + (N.H)^2.
// float32 directions are up to 1e-7 too long or too short. Near grazing, where V + L is short, that turns H by more
// than a narrow lobe is wide. Of unit directions V.T is (T.T + (N.H) (N.L - N.V)) / 2, and T.T gets its square in the place
// of what T has along V. N.V and N.L are rounding noise beside N.H there: the larger is what the smaller leaves of it.
vec3 lobe_GGX(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    vec3 H = V + L;
    float NV = dot(N, V), NL = dot(N, L), NH = dot(N, H);
    vec3 T = H - NH * N;
    float VT = dot(V, T), TT = dot(T, T), unit = 0.5 * (TT + NH * (NL - NV));
    TT = clamp(TT - VT * VT + unit * unit, LOBE_SMALLEST_DIVISOR, 1e30);
    float HH = TT + NH * NH;

    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX), a2 = a * a, aNH = a * NH;
    float k = a * HH / (TT + aNH * aNH);  // D = k^2 / pi
    float v = clamp(min(NV, NL), 0.0, 1.0), l = clamp(NH - v, 0.0, 1.0);
    float w = l * sqrt((v - a2 * v) * v + a2) + v * sqrt((l - a2 * l) * l + a2);  // V = 1 / (2 w)
    float DV = v > LOBE_SMALLEST_COSINE ? 0.5 * LOBE_INV_PI * k * k / w : 0.0;

    float u = clamp(1.0 - 0.5 * sqrt(HH), 0.0, 1.0);
    float x = DV * (u * u * (u * u) * u);
    return clamp(f0, 0.0, 1.0) * (DV - x) + x;
}

// GGX microfacet reflection with masking that has no square root.
//   f = D V F,   V = 0.5 / mix(2 NdotV NdotL, NdotV + NdotL, alpha)                [1/sr]
// param  f0     color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alpha  float  1e-4..1  0.25  microfacet width
// reciprocal  yes
// energy      <= 1
// approximates  lobe_GGX  max error 0.293 relative  everywhere, largest where a cosine is about alpha
// family      specular
// units       16, the lengths of N, V and L as in lobe_GGX
// source      Walter et al. 2007, eq. 20, 33; Hammon 2017; Schlick 1994, eq. 15
// Why this form: as lobe_GGX.
vec3 lobe_GGX_fast(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    vec3 H = V + L;
    float NV = dot(N, V), NL = dot(N, L), NH = dot(N, H);
    vec3 T = H - NH * N;
    float VT = dot(V, T), TT = dot(T, T), unit = 0.5 * (TT + NH * (NL - NV));
    TT = clamp(TT - VT * VT + unit * unit, LOBE_SMALLEST_DIVISOR, 1e30);
    float HH = TT + NH * NH;

    float a = clamp(alpha, LOBE_ALPHA_MIN, 1.0), aNH = a * NH;
    float k = a * HH / (TT + aNH * aNH);  // D = k^2 / pi
    float v = clamp(min(NV, NL), 0.0, 1.0);
    float w = mix(2.0 * v * (NH - v), NH, a);  // V = 1 / (2 w)
    float DV = v > LOBE_SMALLEST_COSINE ? 0.5 * LOBE_INV_PI * k * k / w : 0.0;

    float u = clamp(1.0 - 0.5 * sqrt(HH), 0.0, 1.0);
    float x = DV * (u * u * (u * u) * u);
    return clamp(f0, 0.0, 1.0) * (DV - x) + x;
}

// GGX microfacet reflection of a metal: height-correlated Smith masking and the exact Fresnel term of a conductor.
//   f = D V F                                                                      [1/sr]
// param  eta    vec3   0.1..10   1.5   index of refraction beyond the surface over the one on this side, for R, G, B
// param  k      vec3   0.1..10   2.5   extinction coefficient beyond the surface, for R, G, B
// param  alpha  float  1e-4..4  0.25  microfacet width
// reciprocal  yes
// energy      <= 1
// units       16, the lengths of N, V and L as in lobe_GGX
// source      Walter et al. 2007, eq. 20, 33; Heitz 2014, eq. 99; Born, Wolf 1999, section 14.2
// Why this form: lobe_GGX of f0 = 1 is D V.
vec3 lobe_GGX_conductor(vec3 N, vec3 V, vec3 L, vec3 eta, vec3 k, float alpha) {
    return lobe_GGX(N, V, L, vec3(1.0), alpha).x * lobe_F_conductor(0.5 * length(V + L), eta, k);
}

// GGX microfacet reflection with a width along each tangent: brushed metal, hair-line scratches.
//   f = D V F                                                                      [1/sr]
// param  f0      color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alphaX  float  1e-4..4  0.25  microfacet width along T
// param  alphaY  float  1e-4..4  0.25  microfacet width along B = N x T
// reciprocal  yes
// energy      <= 1
// units       16, the lengths of N, V and L as in lobe_GGX
// source      Burley 2012, section B.2; Heitz 2014, eq. 85, 86, 99; Schlick 1994, eq. 15
// Why this form: with X = N x H it is T.H = B.X and B.H = -T.X. X is small near the peak, so that a T not quite
// orthogonal to N does no harm, where T.H itself would bring N.H in.
vec3 lobe_GGX_aniso(vec3 N, vec3 T, vec3 V, vec3 L, vec3 f0, float alphaX, float alphaY) {
    vec3 H = lobe_H(V, L);
    vec2 c = lobe_cosines(N, V, L, H);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    vec2 a = clamp(vec2(alphaX, alphaY), LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    vec3 B = cross(N, T), X = cross(N, H);
    vec3 slope = vec3(vec2(dot(B, X), dot(T, X)) / a, dot(N, H));
    float k = min(dot(H, H) / max(dot(slope, slope), 1e-20), LOBE_ALPHA_MAX * LOBE_ALPHA_MAX);
    float D = min(k * k / (a.x * a.y), 1e8) * LOBE_INV_PI;  // 1 / LOBE_ALPHA_MIN^2 is the narrowest lobe's peak
    float DV = D * lobe_V_GGX_aniso(c.x, c.y, dot(T, V), dot(B, V), dot(T, L), dot(B, L), a.x, a.y);
    return DV * lobe_F_Schlick(0.5 * length(H), clamp(f0, 0.0, 1.0));
}

// GGX (Trowbridge-Reitz) microfacet reflection with Kelemen's visibility, which knows no alpha.
//   f = D F / (4 LdotH^2)                                                          [1/sr]
// param  f0     color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alpha  float  1e-4..4  0.25  microfacet width
// reciprocal  yes
// energy      <= 1
// family      specular
// units       8
// source      Walter et al. 2007, eq. 33; Kelemen, Szirmay-Kalos 2001, eq. 6; Schlick 1994, eq. 15
vec3 lobe_GGX_Kelemen(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    vec3 H = lobe_H(V, L), X = cross(N, H);
    float NH = dot(N, H), XX = dot(X, X), HH = XX + NH * NH;
    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX), aNH = a * NH;
    float r = a / max(XX + aNH * aNH, LOBE_SMALLEST_DIVISOR);
    float DV = min(dot(N, V), dot(N, L)) > 0.0 ? HH * r * r * LOBE_INV_PI : 0.0;
    return DV * lobe_F_Schlick(0.5 * sqrt(HH), clamp(f0, 0.0, 1.0));
}

// Visible GGX facet normal for V, at random: a unit half vector H. The light comes from lobe_reflect(H, V).
//   H = normalize(alpha h.x, alpha h.y, h.z), h = c + v, in the frame T, N x T, N
//   v = normalize(alpha V.x, alpha V.y, V.z), c uniform on the cap c.z > -v.z of the unit sphere
// param  alpha  float  1e-4..1  0.25  microfacet width
// param  u      vec2   0..0.9999999  0.5  uniform random numbers
// units   16, what rounding leaves of c and v is magnified where c + v is short
// source  Dupuy, Benyoub 2023
// Why this form: h.z = (1 - u.y)(1 + v.z), 1 - c.z = u.y (1 + v.z) and 1 + c.z = h.z + 1 - v.z are free of cancellation
// once the smaller of 1 + v.z and 1 - v.z is formed from the sine of v. Tangents stay in the world: one width needs no
// frame but for the azimuth. What unequal lengths of c and v put into h is taken out, as in lobe_H.
vec3 lobe_sample_GGX(vec3 N, vec3 T, vec3 V, float alpha, vec2 u) {
    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    vec3 B = cross(N, T);
    vec3 tangent = a * cross(cross(N, V), N);  // of V, stretched
    float NdotV = dot(N, V);
    float scale = 1.0 / max(length(vec2(length(tangent), NdotV)), LOBE_SMALLEST_DIVISOR);
    float vz = scale * NdotV;
    tangent *= scale;
    float larger = 1.0 + abs(vz), smaller = dot(tangent, tangent) / larger;
    float plus = vz > 0.0 ? larger : smaller, minus = vz > 0.0 ? smaller : larger;  // 1 + v.z and 1 - v.z
    vec2 r = clamp(u, 0.0, 1.0);
    float hz = (1.0 - r.y) * plus;
    vec2 c = sqrt(r.y * plus * (hz + minus)) * lobe_circle(r.x);
    vec3 around = c.x * cross(B, N) + c.y * B;
    vec3 h = around + tangent, across = around - tangent;
    h -= 0.25 * clamp(dot(h, across) + hz * (hz - 2.0 * vz), -1.0, 1.0) * across;
    vec3 H = a * h + max(hz, 1e-15) * N;
    return H / max(length(H), LOBE_SMALLEST_DIVISOR);
}

// Density of lobe_reflect(H, V) for H = lobe_sample_GGX(...), over the solid angle of L.
//   pdf = D G1(NdotV) / (4 NdotV)                                                  [1/sr]
// param  alpha  float  1e-4..4  0.25  microfacet width
// units   16, the lengths of N, V and L as in lobe_GGX
// source  Heitz 2018, eq. 17
// 0 where V or the half vector is below the horizon. L may be below it: such a sample is drawn and has f = 0.
float lobe_pdf_GGX(vec3 N, vec3 V, vec3 L, float alpha) {
    float NdotV = dot(N, V);
    vec3 H = lobe_H(V, L);
    if (min(NdotV, dot(N, H)) <= 0.0) return 0.0;
    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX), c = min(NdotV, 1.0);
    float g = sqrt(c * c + a * a * (1.0 - c * c));
    return 0.5 * lobe_D_GGX(N, H, a) / max(c + g, LOBE_SMALLEST_DIVISOR);
}

// Visible GGX facet normal for V with a width along each tangent, at random: a unit H. The light comes from lobe_reflect(H, V).
//   H = normalize(alphaX h.x, alphaY h.y, h.z), h = c + v, in the frame T, N x T, N
//   v = normalize(alphaX V.x, alphaY V.y, V.z), c uniform on the cap c.z > -v.z of the unit sphere
// param  alphaX  float  1e-4..1  0.25  microfacet width along T
// param  alphaY  float  1e-4..1  0.25  microfacet width along B = N x T
// param  u       vec2   0..0.9999999  0.5  uniform random numbers
// units   16, what rounding leaves is magnified as in lobe_sample_GGX
// source  Dupuy, Benyoub 2023
// Why this form: as in lobe_sample_GGX; V.x and V.y as T.H and B.H in lobe_GGX_aniso.
vec3 lobe_sample_GGX_aniso(vec3 N, vec3 T, vec3 V, float alphaX, float alphaY, vec2 u) {
    vec2 a = clamp(vec2(alphaX, alphaY), LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    vec3 B = cross(N, T), X = cross(N, V);
    vec2 tangent = a * vec2(dot(B, X), -dot(T, X));  // of V, stretched
    float NdotV = dot(N, V);
    float scale = 1.0 / max(length(vec3(tangent, NdotV)), 1e-15);
    float vz = scale * NdotV;
    tangent *= scale;
    float larger = 1.0 + abs(vz), smaller = dot(tangent, tangent) / larger;
    float plus = vz > 0.0 ? larger : smaller, minus = vz > 0.0 ? smaller : larger;  // 1 + v.z and 1 - v.z
    vec2 r = clamp(u, 0.0, 1.0);
    float hz = (1.0 - r.y) * plus;
    vec2 around = sqrt(r.y * plus * (hz + minus)) * lobe_circle(r.x);
    vec2 h = around + tangent, across = around - tangent;
    float lengths = clamp(dot(h, across) + hz * (hz - 2.0 * vz), -1.0, 1.0);  // what unequal ones put into h
    h -= lengths / max(max(dot(across, across), dot(h, h)), max(hz, 1e-15)) * across;
    h *= a;
    vec3 H = h.x * cross(B, N) + h.y * B + max(hz, 1e-15) * N;
    return H / max(length(H), LOBE_SMALLEST_DIVISOR);
}

// Density of lobe_reflect(H, V) for H = lobe_sample_GGX_aniso(...), over the solid angle of L.
//   pdf = D / (2 (NdotV + g)),   g = sqrt(NdotV^2 + (alphaX T.V)^2 + (alphaY B.V)^2)         [1/sr]
// param  alphaX  float  1e-4..4  0.25  microfacet width along T
// param  alphaY  float  1e-4..4  0.25  microfacet width along B = N x T
// units   16, the lengths of N, V and L as in lobe_GGX
// source  Heitz 2018, eq. 17
// 0 where V or the half vector is below the horizon. L may be below it: such a sample is drawn and has f = 0.
float lobe_pdf_GGX_aniso(vec3 N, vec3 T, vec3 V, vec3 L, float alphaX, float alphaY) {
    vec3 H = lobe_H(V, L);
    float NdotV = dot(N, V), NH = dot(N, H);
    if (min(NdotV, NH) <= 0.0) return 0.0;
    vec2 a = clamp(vec2(alphaX, alphaY), LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    vec3 B = cross(N, T), X = cross(N, H);
    vec3 slope = vec3(vec2(dot(B, X), dot(T, X)) / a, NH);
    float k = min(dot(H, H) / max(dot(slope, slope), 1e-20), LOBE_ALPHA_MAX * LOBE_ALPHA_MAX);
    float D = min(k * k / (a.x * a.y), 1e8) * LOBE_INV_PI;
    vec3 v = vec3(a * clamp(vec2(dot(T, V), dot(B, V)), -1.0, 1.0), min(NdotV, 1.0));
    return 0.5 * D / max(v.z + length(v), LOBE_SMALLEST_DIVISOR);
}

#endif
