// What the tests of the reference share: directions, and integrals over them.
#pragma once

#include "models.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <random>

namespace lobe {

constexpr double PI = std::numbers::pi;
constexpr double ROUNDING = 1e-13;   // some hundred operations in double
constexpr double QUADRATURE = 1e-5;  // midpoint sums across the kink at the facet's own horizon

inline Vec3 direction(double theta, double phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

inline const Vec3 NORMAL(0, 0, 1), ALONG(1, 0, 0);
inline const Vec3 GOLD_ETA(0.16, 0.35, 1.3), GOLD_K(3.6, 2.7, 1.9);  // roughly, at 650, 550 and 450 nm

// Integral over the hemisphere by midpoints. theta is spaced for features of angular width `width` about the pole.
inline double over_hemisphere(double width, int steps, const std::function<double(const Vec3&)>& f) {
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
        const double u = (i + 0.5) / steps, slope = width * u / (1 - u), theta = std::atan(slope);
        const double d_theta = width / ((1 - u) * (1 - u)) / (1 + slope * slope) / steps;
        for (int j = 0; j < steps; ++j)
            sum += f(direction(theta, 2 * PI * (j + 0.5) / steps)) * std::sin(theta) * d_theta * 2 * PI / steps;
    }
    return sum;
}

// Directional albedo of a lobe's first channel. The density of the nodes in L is uniform: for wide lobes only.
inline double albedo(double theta, int steps, const std::function<Vec3(const Vec3& V, const Vec3& L)>& lobe) {
    const Vec3 V = direction(theta, 0);
    return over_hemisphere(1, steps, [&](const Vec3& L) { return lobe(V, L).x * L.z; });
}

// Pairs of directions above the surface, the same at every run.
inline void for_pairs(const std::function<void(const Vec3& V, const Vec3& L)>& check) {
    std::mt19937 random(2007);
    std::uniform_real_distribution<double> theta(0, PI / 2), phi(0, 2 * PI);
    for (int i = 0; i < 1000; ++i) check(direction(theta(random), phi(random)), direction(theta(random), phi(random)));
}

}  // namespace lobe
