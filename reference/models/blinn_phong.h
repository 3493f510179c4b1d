// Powers of a cosine: Phong 1975 around the mirror direction, Blinn 1977 around the normal. An exponent below 0, wider
// than diffuse, is taken as 0: the power is then 1 for every direction.
#pragma once

#include "fresnel.h"

#include <numbers>

namespace lobe {

// cos^exponent of the angle between two unit vectors, 0 beyond a right angle. The chord that joins them has the square
// 2 - 2 cos: from it the cosine's logarithm is known where the cosine itself has lost the angle.
inline double power_cosine(Vec3 a, Vec3 b, double exponent) {
    const double cos = a.dot(b);
    if (cos < 0.5) return std::pow(clamp_cosine(cos), exponent);
    return std::exp(exponent * std::log1p(-(a - b).length2() / 2));
}

// (e + 2)/(2 pi) normalises: the integral of cos^e cos over the hemisphere is 2 pi / (e + 2).
inline double lobe_D_BlinnPhong(double NdotH, double exponent) {
    const double e = std::max(exponent, 0.0);
    return (e + 2) / (2 * std::numbers::pi) * std::pow(clamp_cosine(NdotH), e);
}

// The same from the vectors, H of any length; 0 for a null H.
inline double lobe_D_BlinnPhong(Vec3 N, Vec3 H, double exponent) {
    if (H == Vec3(0)) return 0;
    const double e = std::max(exponent, 0.0);
    return (e + 2) / (2 * std::numbers::pi) * power_cosine(N.normalized(), H.normalized(), e);
}

// The modern Phong lobe (Lafortune, Willems 1994): normalised so that at normal incidence all of rs is reflected; less
// elsewhere, where part of the lobe lies below the surface.
inline Vec3 lobe_Phong(Vec3 N, Vec3 V, Vec3 L, Vec3 rs, double exponent) {
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    const double e = std::max(exponent, 0.0);
    return rs * ((e + 2) / (2 * std::numbers::pi) * power_cosine(lobe_reflect(N, L), V, e));
}

// As Phong published it, the intensity rs cos^e of a light is not multiplied by NdotL. Since callers of a lobe do that,
// it is divided out here.
inline Vec3 lobe_Phong_1975(Vec3 N, Vec3 V, Vec3 L, Vec3 rs, double exponent) {
    const double NdotL = N.dot(L);
    if (!(N.dot(V) > 0 && NdotL > 0)) return Vec3(0);
    return rs * (power_cosine(lobe_reflect(N, L), V, std::max(exponent, 0.0)) / std::max(NdotL, SMALLEST_COSINE));
}

// Blinn 1977 with the factor of which the albedo at normal incidence is exactly rs: with u = cos(theta/2) the integral
// of u^e cos(theta) over the hemisphere is 2 pi times that of 4 u^(e+1) (2 u^2 - 1) from sqrt(1/2) to 1.
inline Vec3 lobe_BlinnPhong(Vec3 N, Vec3 V, Vec3 L, Vec3 rs, double exponent) {
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    const double e = std::max(exponent, 0.0);
    const double full_albedo = (e + 2) * (e + 4) / (8 * std::numbers::pi * (std::exp2(-e / 2) + e));
    return rs * (full_albedo * power_cosine(N, lobe_H(V, L).normalized(), e));
}

// The exponent at which the Blinn-Phong distribution matches Beckmann's near the pole, where cos^e tends to
// exp(-e tan^2/2): Walter et al. 2007, sec. 5.2. It is 0 at alpha = 1, the widest that there is.
inline double lobe_exponent(double alpha) {
    const double width = std::clamp(alpha, SMALLEST_ALPHA, 1.0);
    return 2 * (1 - width) * (1 + width) / (width * width);
}
inline double lobe_alpha_Phong(double exponent) { return std::sqrt(2 / (std::max(exponent, 0.0) + 2)); }

// In the plane of incidence the angle of R against V is twice that of H against N, and cos(2 x)^e is about
// cos(x)^(4 e) for small x.
inline double lobe_exponent_Blinn(double exponent) { return 4 * std::max(exponent, 0.0); }

// c^exponent for c = 1/(1 + x), by way of the C library's log1p.
inline double lobe_inv_pow1p(double x, double exponent) { return std::exp(-exponent * std::log1p(std::max(x, 0.0))); }

// A power's stand-in: s^exponent = exp(exponent ln s), with ln s, which is never above s - 1, replaced by it.
inline double lobe_pow_Gaussian(double s, double exponent) {
    return std::exp(std::max(exponent, 0.0) * (clamp_cosine(s) - 1));
}

// What is drawn about N by the angles theta and phi, carried to the axis by the half turn about M = N + axis; about T,
// where the axis is -N. The turn takes N to the axis and t across N to M 2 (M.t)/|M|^2 - t. With c = N.axis, what M has
// along N is 1 + c = |N x axis|^2/(1 - c).
inline Vec3 carried(Vec3 N, Vec3 T, Vec3 axis, double theta, double phi) {
    const Vec3 across = N.cross(axis), t = turned(N, T, phi);
    const double c = N.dot(axis), along = c >= 0 ? 1 + c : across.length2() / (1 - c);
    const Vec3 sum = across.cross(N) + N * along, M = sum == Vec3(0) ? T : sum;
    return axis * std::cos(theta) + (M * (2 * M.dot(t) / M.length2()) - t) * std::sin(theta);
}

// The density of what drawn_angle_of_power draws: (e + 1)/(2 pi) cos^e up to a right angle, nothing beyond.
inline double drawn_power(Vec3 axis, Vec3 L, double exponent) {
    const double e = std::max(exponent, 0.0);
    return axis.dot(L) > 0 ? (e + 1) / (2 * std::numbers::pi) * power_cosine(axis, L, e) : 0;
}

// Draws about the mirror direction of V, cos^e about it; L may lie below the surface.
inline Vec3 lobe_sample_Phong(Vec3 N, Vec3 T, Vec3 V, double exponent, Vec2 u) {
    const double theta = drawn_angle_of_power(u.y, std::max(exponent, 0.0));
    return carried(N, T, lobe_reflect(N, V), theta, drawn_azimuth(u.x));
}
inline double lobe_pdf_Phong(Vec3 N, Vec3 V, Vec3 L, double exponent) {
    return N.dot(V) > 0 ? drawn_power(lobe_reflect(N, V), L, exponent) : 0;
}

// Draws the half vector from D cos, whose exponent is one larger than D's (Walter et al. 2007, eq. 31).
inline Vec3 lobe_sample_BlinnPhong(Vec3 N, Vec3 T, double exponent, Vec2 u) {
    return tilted(N, T, drawn_angle_of_power(u.y, std::max(exponent, 0.0) + 1), drawn_azimuth(u.x));
}
inline double lobe_pdf_BlinnPhong(Vec3 N, Vec3 V, Vec3 L, double exponent) {
    return mirrored_density(N, V, L, [&](Vec3 H) { return lobe_D_BlinnPhong(N, H, exponent) * N.dot(H); });
}

LOBE_MODEL(blinn_phong, LOBE_FUNCTION(double, lobe_inv_pow1p, (double x, double exponent)),
           LOBE_FUNCTION(double, lobe_D_BlinnPhong, (double NdotH, double exponent)),
           LOBE_FUNCTION(double, lobe_D_BlinnPhong, (Vec3 N, Vec3 H, double exponent)),
           LOBE_FUNCTION(Vec3, lobe_Phong, (Vec3 N, Vec3 V, Vec3 L, Vec3 rs, double exponent)),
           LOBE_FUNCTION(Vec3, lobe_Phong_1975, (Vec3 N, Vec3 V, Vec3 L, Vec3 rs, double exponent)),
           LOBE_FUNCTION(Vec3, lobe_BlinnPhong, (Vec3 N, Vec3 V, Vec3 L, Vec3 rs, double exponent)),
           LOBE_FUNCTION(double, lobe_exponent, (double alpha)),
           LOBE_FUNCTION(double, lobe_alpha_Phong, (double exponent)),
           LOBE_FUNCTION(double, lobe_exponent_Blinn, (double exponent)),
           LOBE_FUNCTION(double, lobe_pow_Gaussian, (double s, double exponent)),
           LOBE_FUNCTION(Vec3, lobe_sample_Phong, (Vec3 N, Vec3 T, Vec3 V, double exponent, Vec2 u)),
           LOBE_FUNCTION(double, lobe_pdf_Phong, (Vec3 N, Vec3 V, Vec3 L, double exponent)),
           LOBE_FUNCTION(Vec3, lobe_sample_BlinnPhong, (Vec3 N, Vec3 T, double exponent, Vec2 u)),
           LOBE_FUNCTION(double, lobe_pdf_BlinnPhong, (Vec3 N, Vec3 V, Vec3 L, double exponent)))

}  // namespace lobe
