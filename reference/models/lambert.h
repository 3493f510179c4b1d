// Lambert 1760: the radiance of a perfectly diffuse surface does not depend on the direction.
#pragma once

#include "core.h"

namespace lobe {

// Of a constant f the hemispherical albedo is f * (integral of cos over the hemisphere) = f pi, hence f = albedo / pi.
inline Vec3 lobe_Lambert(Vec3 N, Vec3 V, Vec3 L, Vec3 albedo) {
    constexpr double projected_hemisphere = 3.14159265358979323846;
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    return albedo / projected_hemisphere;
}

// The direction of the light that Lambert's law sees: cos over pi, of which the share sin^2(theta) lies within theta.
inline double lobe_pdf_Lambert(Vec3 N, Vec3 L) { return std::max(0.0, N.dot(L)) / std::numbers::pi; }
inline Vec3 lobe_sample_Lambert(Vec3 N, Vec3 T, Vec2 u) {
    return tilted(N, T, drawn_angle_of_power(u.y, 1), drawn_azimuth(u.x));
}

LOBE_MODEL(lambert, LOBE_FUNCTION(Vec3, lobe_Lambert, (Vec3 N, Vec3 V, Vec3 L, Vec3 albedo)),
           LOBE_FUNCTION(double, lobe_pdf_Lambert, (Vec3 N, Vec3 L)),
           LOBE_FUNCTION(Vec3, lobe_sample_Lambert, (Vec3 N, Vec3 T, Vec2 u)))

}  // namespace lobe
