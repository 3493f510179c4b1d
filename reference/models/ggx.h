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

// f = D G2 F / (4 NdotV NdotL), Walter et al. 2007, eq. 20, with F at L.H.
inline Vec3 lobe_GGX(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha) {
    const double NdotV = N.dot(V), NdotL = N.dot(L);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const double width = std::max(alpha, SMALLEST_ALPHA);
    const double D = lobe_D_GGX(N, half_vector(V, L), width);
    return half_angle_F_Schlick(V, L, f0) * (D * lobe_V_GGX(NdotV, NdotL, width));
}

// The same with Kelemen's masking, which does not know alpha.
inline Vec3 lobe_GGX_Kelemen(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha) {
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    const double D = lobe_D_GGX(N, half_vector(V, L), alpha);
    return half_angle_F_Schlick(V, L, f0) * (D * lobe_V_Kelemen(V, L));
}

LOBE_MODEL(ggx, LOBE_FUNCTION(double, lobe_D_GGX, (double NdotH, double alpha)),
           LOBE_FUNCTION(double, lobe_D_GGX, (Vec3 N, Vec3 H, double alpha)),
           LOBE_FUNCTION(double, lobe_G1_GGX, (double NdotX, double alpha)),
           LOBE_FUNCTION(double, lobe_G2_GGX, (double NdotV, double NdotL, double alpha)),
           LOBE_FUNCTION(double, lobe_V_GGX, (double NdotV, double NdotL, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_GGX, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_GGX_Kelemen, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha)))

}  // namespace lobe
