// Lights without extent: their irradiance is known in closed form.
#pragma once

#include "registry.h"

#include <cmath>
#include <limits>

namespace lobe {

// What reaches a point, before shadows and before the cosine.
struct Incidence {
    Vec3 L;           // unit, towards the light
    Vec3 irradiance;  // on a surface that faces the light
    double distance;
};

struct Light {
    bool at_infinity;
    Vec3 place;  // unit direction towards a directional light, position of a point light
    Vec3 rgb;    // irradiance of a directional light, intensity of a point light

    Incidence at(const Vec3& point) const {
        if (at_infinity) return {place, rgb, std::numeric_limits<double>::infinity()};
        const Vec3 to_light = place - point;
        const double squared = to_light.length2(), distance = std::sqrt(squared);
        return {to_light / distance, rgb / squared, distance};
    }
};

}  // namespace lobe
