// Beckmann's distribution: normally distributed slopes. With Smith's masking, and with V-grooves (Cook, Torrance 1982).
#pragma once

#include "fresnel.h"
#include "masking.h"

#include <numbers>

namespace lobe {

// The density of slopes, P22 = exp(-(x^2/alphaX^2 + y^2/alphaY^2)) / (pi alphaX alphaY), carried to solid angle and
// divided by the facet's cosine: D = P22 / cos^4, Walter et al. 2007, eq. 25. stretched2 is the bracket. cos may not be
// 0.
inline double beckmann_of_slope(double stretched2, double cos, double alphaX, double alphaY) {
    return std::exp(-stretched2) / (std::numbers::pi * alphaX * alphaY * cos * cos * cos * cos);
}

inline double lobe_D_Beckmann(double NdotH, double alpha) {
    const double c = std::max(clamp_cosine(NdotH), SMALLEST_COSINE), width = std::max(alpha, SMALLEST_ALPHA);
    return beckmann_of_slope(tan2(c) / (width * width), c, width, width);
}

// The same from the vectors, H of any length; 0 for a null H and for one that is not above the surface.
inline double lobe_D_Beckmann(Vec3 N, Vec3 H, double alpha) {
    const double c = N.normalized().dot(H.normalized()), width = std::max(alpha, SMALLEST_ALPHA);
    return c > SMALLEST_COSINE ? beckmann_of_slope(lobe_sin2_NH(N, H) / (c * c * width * width), c, width, width) : 0;
}

// Two widths along T and B, from the cosines of a unit H: its slopes are TdotH / NdotH and BdotH / NdotH.
inline double lobe_D_Beckmann_aniso(double NdotH, double TdotH, double BdotH, double alphaX, double alphaY) {
    const double c = std::max(clamp_cosine(NdotH), SMALLEST_COSINE);
    const double ax = std::max(alphaX, SMALLEST_ALPHA), ay = std::max(alphaY, SMALLEST_ALPHA);
    const double x = TdotH / (c * ax), y = BdotH / (c * ay);
    return beckmann_of_slope(x * x + y * y, c, ax, ay);
}

// Walter et al. 2007: a = 1 / (alpha tan(theta)), infinite along N and without roughness. cos may not be 0.
inline double beckmann_a(double cos, double alpha) {
    return cos / (std::abs(alpha) * std::sqrt((1 - cos) * (1 + cos)));
}

// Lambda + 1/2 = (erf(a) + exp(-a^2)/(a sqrt(pi)))/2, Heitz 2014, eq. 65 and appendix A: no difference is left that
// could cancel. cos may not be 0.
inline double beckmann_lambda_plus_half(double cos, double alpha) {
    const double a = beckmann_a(cos, alpha);
    return (std::erf(a) + std::exp(-a * a) / a * std::numbers::inv_sqrtpi) / 2;
}

// G1 = 1 / (1 + Lambda). 0 at and below the horizon, also for alpha = 0.
inline double lobe_G1_Beckmann(double NdotX, double alpha) {
    const double c = clamp_cosine(NdotX);
    return c > 0 ? 1 / (0.5 + beckmann_lambda_plus_half(c, alpha)) : 0;
}

// Walter et al. 2007, eq. 27, the rational fit; at its end, a = 1.6, the published numbers pass 1 by 6e-5.
inline double lobe_G1_Beckmann_fast(double NdotX, double alpha) {
    const double c = clamp_cosine(NdotX);
    if (c == 0) return 0;
    const double a = beckmann_a(c, alpha);
    return a < 1.6 ? std::min(1.0, a * (3.535 + 2.181 * a) / (1 + a * (2.276 + 2.577 * a))) : 1;
}

// Height-correlated: G2 = 1 / (1 + Lambda(V) + Lambda(L)), Heitz 2014, eq. 99.
inline double lobe_G2_Beckmann(double NdotV, double NdotL, double alpha) {
    const double v = clamp_cosine(NdotV), l = clamp_cosine(NdotL);
    return v > 0 && l > 0 ? 1 / (beckmann_lambda_plus_half(v, alpha) + beckmann_lambda_plus_half(l, alpha)) : 0;
}

// G2 / (4 NdotV NdotL). At grazing it tends to a limit, which the smallest cosine stands for.
inline double lobe_V_Beckmann(double NdotV, double NdotL, double alpha) {
    const double v = std::max(clamp_cosine(NdotV), SMALLEST_COSINE), l = std::max(clamp_cosine(NdotL), SMALLEST_COSINE);
    return lobe_G2_Beckmann(v, l, alpha) / (4 * v * l);
}

// f = D G2 F / (4 NdotV NdotL), Walter et al. 2007, eq. 20, with F at L.H.
inline Vec3 lobe_Beckmann(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha) {
    const double NdotV = N.dot(V), NdotL = N.dot(L), width = std::max(alpha, SMALLEST_ALPHA);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const double D = lobe_D_Beckmann(N, lobe_H(V, L), width);
    return half_angle_F_Schlick(V, L, f0) * (D * lobe_V_Beckmann(NdotV, NdotL, width));
}

// The same with the grooves of Cook, Torrance 1982, and with 4 in place of their pi: their D is normalised otherwise.
inline Vec3 lobe_CookTorrance(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha) {
    const double NdotV = N.dot(V), NdotL = N.dot(L);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const Vec3 H = lobe_H(V, L).normalized();
    const double visible = lobe_V_Vgroove(NdotV, NdotL, N.dot(H), lobe_LdotH(V, L));
    return half_angle_F_Schlick(V, L, f0) * (lobe_D_Beckmann(N, H, alpha) * visible);
}

// Draws facets by the area that they cover, D cos: of it, 1 - exp(-tan^2/alpha^2) lies within theta (Walter et al.
// 2007, eq. 28).
inline Vec3 lobe_sample_Beckmann(Vec3 N, Vec3 T, double alpha, Vec2 u) {
    const double tan = std::max(alpha, SMALLEST_ALPHA) * std::sqrt(-std::log1p(-u.y));
    return tilted(N, T, std::atan(tan), drawn_azimuth(u.x));
}
inline double lobe_pdf_Beckmann(Vec3 N, Vec3 V, Vec3 L, double alpha) {
    return mirrored_density(N, V, L, [&](Vec3 H) { return lobe_D_Beckmann(N, H, alpha) * N.dot(H); });
}

LOBE_MODEL(beckmann, LOBE_FUNCTION(double, lobe_D_Beckmann, (double NdotH, double alpha)),
           LOBE_FUNCTION(double, lobe_D_Beckmann, (Vec3 N, Vec3 H, double alpha)),
           LOBE_FUNCTION(double, lobe_D_Beckmann_aniso,
                         (double NdotH, double TdotH, double BdotH, double alphaX, double alphaY)),
           LOBE_FUNCTION(double, lobe_G1_Beckmann, (double NdotX, double alpha)),
           LOBE_FUNCTION(double, lobe_G1_Beckmann_fast, (double NdotX, double alpha)),
           LOBE_FUNCTION(double, lobe_G2_Beckmann, (double NdotV, double NdotL, double alpha)),
           LOBE_FUNCTION(double, lobe_V_Beckmann, (double NdotV, double NdotL, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_Beckmann, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_CookTorrance, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_sample_Beckmann, (Vec3 N, Vec3 T, double alpha, Vec2 u)),
           LOBE_FUNCTION(double, lobe_pdf_Beckmann, (Vec3 N, Vec3 V, Vec3 L, double alpha)))

}  // namespace lobe
