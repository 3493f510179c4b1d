// Oren, Nayar 1994: V-shaped grooves of Lambertian facets. sigma is the standard deviation of their tilt in radians.
#pragma once

#include "core.h"

#include <numbers>

namespace lobe {

// The paper's qualitative model, f = albedo/pi (A + B max(0, cos(phi_r - phi_i)) sin(alpha) tan(beta)) with the
// constant 0.33 in A, alpha the larger of theta_i and theta_r, beta the smaller. Sine and tangent grow with theta, so
// that the larger and the smaller are taken of them; phi_r - phi_i is the angle between the planes of N and V and of N
// and L, whose normals are N x V and N x L. It is undefined along N, where tan(beta) = 0.
inline Vec3 lobe_OrenNayar_qualitative(Vec3 N, Vec3 V, Vec3 L, Vec3 albedo, double sigma) {
    const double cos_r = N.dot(V), cos_i = N.dot(L);
    if (!(cos_r > 0 && cos_i > 0)) return Vec3(0);
    const Vec3 plane_r = N.cross(V), plane_i = N.cross(L);
    const double sin_r = plane_r.length(), sin_i = plane_i.length();
    const double cos_phi = sin_r > 0 && sin_i > 0 ? plane_r.dot(plane_i) / (sin_r * sin_i) : 0;
    const double sin_alpha = std::max(sin_i, sin_r), tan_beta = std::min(sin_i / cos_i, sin_r / cos_r);
    const double sigma2 = sigma * sigma;
    const double A = 1 - 0.5 * sigma2 / (sigma2 + 0.33), B = 0.45 * sigma2 / (sigma2 + 0.09);
    return albedo / std::numbers::pi * (A + B * std::max(0.0, cos_phi) * sin_alpha * tan_beta);
}

LOBE_MODEL(oren_nayar,
           LOBE_FUNCTION(Vec3, lobe_OrenNayar_qualitative, (Vec3 N, Vec3 V, Vec3 L, Vec3 albedo, double sigma)))

}  // namespace lobe
