// A Gaussian of the facet's angle: the lecture's, and Torrance and Sparrow's of 1967.
#pragma once

#include "fresnel.h"
#include "masking.h"
#include "quadrature.h"

namespace lobe {

// The angle between N and H in 0..pi/2, from the chords (Kahan); H has any length but 0.
inline double facet_angle(Vec3 N, Vec3 H) {
    const Vec3 n = N.normalized(), h = H.normalized();
    return std::min(2 * std::atan2((n - h).length(), (n + h).length()), std::numbers::pi / 2);
}
inline double facet_angle(double NdotH) { return std::acos(clamp_cosine(NdotH)); }

inline double gaussian(double angle, double alpha) {
    const double x = angle / std::max(alpha, SMALLEST_ALPHA);
    return std::exp(-x * x);
}

// The area that the facets of the bare Gaussian cover, by quadrature: pi times the integral of exp(-(d/alpha)^2)
// sin(2d) up to the horizon. Beyond 8 alpha there is 1e-28 of it.
inline double gaussian_area(double alpha) {
    return remembered(std::max(alpha, SMALLEST_ALPHA), [](double width) {
        return std::numbers::pi * integral<64>(std::min(std::numbers::pi / 2, 8 * width), [=](double d) {
            return gaussian(d, width) * std::sin(2 * d);
        });
    });
}

// The lecture's: cos(d) exp(-(d/alpha)^2), with nothing to normalise it.
inline double lobe_D_Gaussian(double NdotH, double alpha) {
    return clamp_cosine(NdotH) * gaussian(facet_angle(NdotH), alpha);
}
inline double lobe_D_Gaussian(Vec3 N, Vec3 H, double alpha) {
    const double c = N.normalized().dot(H.normalized());
    return c > 0 ? c * gaussian(facet_angle(N, H), alpha) : 0;
}

// Torrance, Sparrow 1967: exp(-(d/alpha)^2), times what makes the facets cover the surface once.
inline double lobe_D_Gaussian_normalized(double NdotH, double alpha) {
    return gaussian(facet_angle(NdotH), alpha) / gaussian_area(alpha);
}
inline double lobe_D_Gaussian_normalized(Vec3 N, Vec3 H, double alpha) {
    return H == Vec3(0) ? 0 : gaussian(facet_angle(N, H), alpha) / gaussian_area(alpha);
}

// The value of the normalised one at H = N. Widths above 1e3 are taken as 1e3; wider ones are less than 1e-6 lower.
inline double lobe_peak_Gaussian(double alpha) { return 1 / gaussian_area(std::min(alpha, 1e3)); }

// D and the grooves of 1967, over 4 in place of their constant.
inline Vec3 lobe_TorranceSparrow(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha) {
    const double NdotV = N.dot(V), NdotL = N.dot(L);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const Vec3 H = lobe_H(V, L).normalized();
    const double visible = lobe_V_Vgroove(NdotV, NdotL, N.dot(H), lobe_LdotH(V, L));
    return half_angle_F_Schlick(V, L, f0) * (lobe_D_Gaussian_normalized(N, H, alpha) * visible);
}

LOBE_MODEL(gaussian, LOBE_FUNCTION(double, lobe_D_Gaussian, (double NdotH, double alpha)),
           LOBE_FUNCTION(double, lobe_D_Gaussian, (Vec3 N, Vec3 H, double alpha)),
           LOBE_FUNCTION(double, lobe_D_Gaussian_normalized, (double NdotH, double alpha)),
           LOBE_FUNCTION(double, lobe_D_Gaussian_normalized, (Vec3 N, Vec3 H, double alpha)),
           LOBE_FUNCTION(double, lobe_peak_Gaussian, (double alpha)),
           LOBE_FUNCTION(Vec3, lobe_TorranceSparrow, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha)))

}  // namespace lobe
