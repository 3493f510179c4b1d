// Lambert 1760: the radiance of a perfectly diffuse surface does not depend on the direction.
#pragma once

#include "../registry.h"

namespace lobe {

// Of a constant f the hemispherical albedo is f * (integral of cos over the hemisphere) = f pi, hence f = albedo / pi.
inline Vec3 lobe_Lambert(Vec3 N, Vec3 V, Vec3 L, Vec3 albedo) {
    constexpr double projected_hemisphere = 3.14159265358979323846;
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    return albedo / projected_hemisphere;
}

LOBE_MODEL(lambert, LOBE_FUNCTION(Vec3, lobe_Lambert, (Vec3 N, Vec3 V, Vec3 L, Vec3 albedo)))

}  // namespace lobe
