// GGX (Walter et al. 2007), which is Trowbridge-Reitz 1975, derived from its slopes: P22 for the distribution, Smith's
// Lambda for masking and shadowing (Heitz 2014).
#pragma once

#include "fresnel.h"
#include "masking.h"

#include <numbers>

namespace lobe {

// The density of slopes, P22 = 1 / (pi alpha^2 (1 + slope^2/alpha^2)^2), carried to solid angle and divided by the
// facet's cosine: D = P22 / cos^4. This is Walter et al. 2007, eq. 33. cos may not be 0.
inline double ggx_of_slope(double slope2, double cos, double alpha) {
    const double alpha2 = alpha * alpha, stretch = (1 + slope2 / alpha2) * cos * cos;
    return 1 / (std::numbers::pi * alpha2 * stretch * stretch);
}

inline double lobe_D_GGX(double NdotH, double alpha) {
    const double c = std::max(clamp_cosine(NdotH), SMALLEST_COSINE);
    return ggx_of_slope(tan2(c), c, std::max(alpha, SMALLEST_ALPHA));
}

// The same from the vectors, H of any length: near the pole the sine is known far better than from the cosine. 0 for a
// null H.
inline double lobe_D_GGX(Vec3 N, Vec3 H, double alpha) {
    if (H == Vec3(0)) return 0;
    const double c = N.normalized().dot(H.normalized());
    if (c <= SMALLEST_COSINE) return lobe_D_GGX(0.0, alpha);
    return ggx_of_slope(lobe_sin2_NH(N, H) / (c * c), c, std::max(alpha, SMALLEST_ALPHA));
}

// The largest finite number of half precision, 65504, is where D is cut.
inline double lobe_D_GGX_half(Vec3 N, Vec3 H, double alpha) {
    constexpr double largest_half = (2 - 0x1p-10) * 0x1p15;
    return std::min(lobe_D_GGX(N, H, alpha), largest_half);
}

// Two widths along T and B, from the cosines of a unit H (Walter's eq. 33 with the slopes stretched one by one: Burley
// 2012, eq. 13). Of any other H, D |H|^4 comes; 0 of a null one.
inline double lobe_D_GGX_aniso(double NdotH, double TdotH, double BdotH, double alphaX, double alphaY) {
    const double ax = std::max(alphaX, SMALLEST_ALPHA), ay = std::max(alphaY, SMALLEST_ALPHA);
    const Vec3 stretched(TdotH / ax, BdotH / ay, clamp_cosine(NdotH));
    if (stretched == Vec3(0)) return 0;
    const double length2 = stretched.length2();
    return 1 / (std::numbers::pi * ax * ay * length2 * length2);
}

// 2 Lambda + 1 of Heitz 2014, eq. 72. cos may not be 0.
inline double ggx_twice_lambda_plus_1(double cos, double alpha) { return std::sqrt(1 + alpha * alpha * tan2(cos)); }

// G1 = 1 / (1 + Lambda), which is Walter et al. 2007, eq. 34. 0 at and below the horizon, also for alpha = 0.
inline double lobe_G1_GGX(double NdotX, double alpha) {
    const double c = clamp_cosine(NdotX);
    return c > 0 ? 2 / (1 + ggx_twice_lambda_plus_1(c, alpha)) : 0;
}

// Height-correlated: G2 = 1 / (1 + Lambda(V) + Lambda(L)), Heitz 2014, eq. 99.
inline double lobe_G2_GGX(double NdotV, double NdotL, double alpha) {
    const double v = clamp_cosine(NdotV), l = clamp_cosine(NdotL);
    return v > 0 && l > 0 ? 2 / (ggx_twice_lambda_plus_1(v, alpha) + ggx_twice_lambda_plus_1(l, alpha)) : 0;
}

// G2 / (4 NdotV NdotL). At grazing it tends to a limit, which the smallest cosine stands for.
inline double lobe_V_GGX(double NdotV, double NdotL, double alpha) {
    const double v = std::max(NdotV, SMALLEST_COSINE), l = std::max(NdotL, SMALLEST_COSINE);
    return lobe_G2_GGX(v, l, alpha) / (4 * clamp_cosine(v) * clamp_cosine(l));
}

// Masking and shadowing as if they were independent: G2 = G1(V) G1(L), Walter et al. 2007, eq. 23.
inline double lobe_G2_GGX_separable(double NdotV, double NdotL, double alpha) {
    return lobe_G1_GGX(NdotV, alpha) * lobe_G1_GGX(NdotL, alpha);
}
inline double lobe_V_GGX_separable(double NdotV, double NdotL, double alpha) {
    const double v = std::max(clamp_cosine(NdotV), SMALLEST_COSINE), l = std::max(clamp_cosine(NdotL), SMALLEST_COSINE);
    return lobe_G2_GGX_separable(v, l, alpha) / (4 * v * l);
}

// 2 Lambda + 1 with the width projected onto the plane of incidence, Heitz 2014, eqs. 80 and 86: alpha tan(theta) is
// the length of the stretched slope of the direction whose cosines with N, T and B are given.
inline double ggx_twice_lambda_plus_1(double cos, double TdotX, double BdotX, double alphaX, double alphaY) {
    return std::hypot(1.0, alphaX * TdotX / cos, alphaY * BdotX / cos);
}

// Height-correlated G2 / (4 NdotV NdotL) for two widths.
inline double lobe_V_GGX_aniso(double NdotV, double NdotL, double TdotV, double BdotV, double TdotL, double BdotL,
                               double alphaX, double alphaY) {
    const double v = std::max(clamp_cosine(NdotV), SMALLEST_COSINE), l = std::max(clamp_cosine(NdotL), SMALLEST_COSINE);
    const double twice = ggx_twice_lambda_plus_1(v, TdotV, BdotV, alphaX, alphaY) +
                         ggx_twice_lambda_plus_1(l, TdotL, BdotL, alphaX, alphaY);
    return 1 / (2 * twice * v * l);
}

// Hammon, PBR Diffuse Lighting for GGX+Smith Microsurfaces, GDC 2017: the roots of V go linearly from the cosine at
// alpha = 0 to 1 at alpha = 1.
inline double lobe_V_GGX_fast(double NdotV, double NdotL, double alpha) {
    const double v = std::max(clamp_cosine(NdotV), SMALLEST_COSINE), l = std::max(clamp_cosine(NdotL), SMALLEST_COSINE);
    return 0.5 / std::lerp(2 * v * l, v + l, std::max(alpha, 0.0));
}

// f = D G2 F / (4 NdotV NdotL), Walter et al. 2007, eq. 20, with F at L.H.
inline Vec3 lobe_GGX(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha) {
    const double NdotV = N.dot(V), NdotL = N.dot(L);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const double width = std::max(alpha, SMALLEST_ALPHA);
    const double D = lobe_D_GGX(N, lobe_H(V, L), width);
    return half_angle_F_Schlick(V, L, f0) * (D * lobe_V_GGX(NdotV, NdotL, width));
}

// The same with Hammon's masking.
inline Vec3 lobe_GGX_fast(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha) {
    const double NdotV = N.dot(V), NdotL = N.dot(L), width = std::max(alpha, SMALLEST_ALPHA);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const double D = lobe_D_GGX(N, lobe_H(V, L), width);
    return half_angle_F_Schlick(V, L, f0) * (D * lobe_V_GGX_fast(NdotV, NdotL, width));
}

// The same with Kelemen's masking, which does not know alpha.
inline Vec3 lobe_GGX_Kelemen(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha) {
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    const double D = lobe_D_GGX(N, lobe_H(V, L), alpha);
    return half_angle_F_Schlick(V, L, f0) * (D * lobe_V_Kelemen(V, L));
}

// alphaX is the width along T, alphaY along B = N x T.
inline Vec3 lobe_GGX_aniso(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 f0, double alphaX, double alphaY) {
    const double NdotV = N.dot(V), NdotL = N.dot(L);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const Vec3 B = N.cross(T), H = lobe_H(V, L).normalized();
    const double ax = std::max(alphaX, SMALLEST_ALPHA), ay = std::max(alphaY, SMALLEST_ALPHA);
    const double D = lobe_D_GGX_aniso(N.dot(H), T.dot(H), B.dot(H), ax, ay);
    const double visible = lobe_V_GGX_aniso(NdotV, NdotL, T.dot(V), B.dot(V), T.dot(L), B.dot(L), ax, ay);
    return half_angle_F_Schlick(V, L, f0) * (D * visible);
}

// With the exact F of a metal, whose index is eta + i k.
inline Vec3 lobe_GGX_conductor(Vec3 N, Vec3 V, Vec3 L, Vec3 eta, Vec3 k, double alpha) {
    const double NdotV = N.dot(V), NdotL = N.dot(L), width = std::max(alpha, SMALLEST_ALPHA);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const double D = lobe_D_GGX(N, lobe_H(V, L), width);
    return lobe_F_conductor(lobe_LdotH(V, L), eta, k) * (D * lobe_V_GGX(NdotV, NdotL, width));
}

// The density of L (1/sr) when a facet that V sees is drawn and mirrors V: the visible normals' D G1 (V.H) / NdotV,
// Heitz 2014, eq. 2, over the 4 V.H by which the mirror widens solid angles, Walter et al. 2007, eq. 14. L may lie
// below the surface, H may not.
inline double lobe_pdf_GGX(Vec3 N, Vec3 V, Vec3 L, double alpha) {
    const double NdotV = N.dot(V), width = std::max(alpha, SMALLEST_ALPHA);
    const Vec3 H = lobe_H(V, L);
    if (!(NdotV > 0 && N.dot(H) > 0)) return 0;
    return lobe_D_GGX(N, H, width) * lobe_G1_GGX(NdotV, width) / (4 * NdotV);
}

// The same for two widths: G1 = 1/(1 + Lambda) with the width projected onto the plane of incidence.
inline double lobe_pdf_GGX_aniso(Vec3 N, Vec3 T, Vec3 V, Vec3 L, double alphaX, double alphaY) {
    const double NdotV = N.dot(V), ax = std::max(alphaX, SMALLEST_ALPHA), ay = std::max(alphaY, SMALLEST_ALPHA);
    if (!(NdotV > 0 && N.dot(lobe_H(V, L)) > 0)) return 0;
    const Vec3 B = N.cross(T), H = lobe_H(V, L).normalized();
    const double G1 = 2 / (1 + ggx_twice_lambda_plus_1(NdotV, T.dot(V), B.dot(V), ax, ay));
    return lobe_D_GGX_aniso(N.dot(H), T.dot(H), B.dot(H), ax, ay) * G1 / (4 * NdotV);
}

// The facet's normal H that V sees, for a point u of the unit square. Dupuy, Benyoub 2023: stretched by alpha, GGX's
// facets are a hemisphere; light that mirrors at it towards V comes uniformly from the cap z > -V.z of directions, and
// the normal is halfway. V.z and the cap's z are kept as heights over the lowest ones, -1 and -V.z, for which no
// difference of near numbers is formed.
inline Vec3 lobe_sample_GGX_aniso(Vec3 N, Vec3 T, Vec3 V, double alphaX, double alphaY, Vec2 u) {
    const double ax = std::max(alphaX, SMALLEST_ALPHA), ay = std::max(alphaY, SMALLEST_ALPHA);
    const double phi = drawn_azimuth(u.x);
    const Vec3 B = N.cross(T), v = Vec3(ax * T.dot(V), ay * B.dot(V), N.dot(V)).normalized();
    const double below_top = u.y * (1 + v.z), above_bottom = (1 - u.y) * (1 + v.z);  // 1 - z, z + v.z
    const double sin = std::sqrt(std::max(0.0, below_top * (2 - below_top)));
    const Vec3 h(ax * (sin * std::cos(phi) + v.x), ay * (sin * std::sin(phi) + v.y), std::max(0.0, above_bottom));
    return h == Vec3(0) ? N : (T * h.x + B * h.y + N * h.z).normalized();
}
inline Vec3 lobe_sample_GGX(Vec3 N, Vec3 T, Vec3 V, double alpha, Vec2 u) {
    return lobe_sample_GGX_aniso(N, T, V, alpha, alpha, u);
}

LOBE_MODEL(ggx, LOBE_FUNCTION(double, lobe_D_GGX_aniso,
                         (double NdotH, double TdotH, double BdotH, double alphaX, double alphaY)),
           LOBE_FUNCTION(double, lobe_G2_GGX_separable, (double NdotV, double NdotL, double alpha)),
           LOBE_FUNCTION(double, lobe_V_GGX_separable, (double NdotV, double NdotL, double alpha)),
           LOBE_FUNCTION(double, lobe_V_GGX_aniso,
                         (double NdotV, double NdotL, double TdotV, double BdotV, double TdotL, double BdotL,
                          double alphaX, double alphaY)),
           LOBE_FUNCTION(double, lobe_V_GGX_fast, (double NdotV, double NdotL, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_GGX_aniso,
                         (Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 f0, double alphaX, double alphaY)),
           LOBE_FUNCTION(Vec3, lobe_GGX_conductor, (Vec3 N, Vec3 V, Vec3 L, Vec3 eta, Vec3 k, double alpha)),
           LOBE_FUNCTION(double, lobe_pdf_GGX_aniso, (Vec3 N, Vec3 T, Vec3 V, Vec3 L, double alphaX, double alphaY)),
           LOBE_FUNCTION(Vec3, lobe_sample_GGX_aniso, (Vec3 N, Vec3 T, Vec3 V, double alphaX, double alphaY, Vec2 u)),
           LOBE_FUNCTION(double, lobe_pdf_GGX, (Vec3 N, Vec3 V, Vec3 L, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_sample_GGX, (Vec3 N, Vec3 T, Vec3 V, double alpha, Vec2 u)),
           LOBE_FUNCTION(double, lobe_D_GGX, (double NdotH, double alpha)),
           LOBE_FUNCTION(double, lobe_D_GGX, (Vec3 N, Vec3 H, double alpha)),
           LOBE_FUNCTION(double, lobe_G1_GGX, (double NdotX, double alpha)),
           LOBE_FUNCTION(double, lobe_G2_GGX, (double NdotV, double NdotL, double alpha)),
           LOBE_FUNCTION(double, lobe_V_GGX, (double NdotV, double NdotL, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_GGX, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_GGX_Kelemen, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha)),
           LOBE_FUNCTION(double, lobe_D_GGX_half, (Vec3 N, Vec3 H, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_GGX_fast, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha)))

}  // namespace lobe
