// Schlick, An Inexpensive BRDF Model for Physically-based Rendering, 1994: rational functions in place of powers and
// exponentials.
#pragma once

#include "core.h"

namespace lobe {

// Section 2: s / (h - h s + s) for the power s^h. With u = 1/s - 1, which is 0 at the peak, it is 1/(1 + h u) where the
// power is (1 + u)^-h: Bernoulli's inequality makes it the larger one. 0 at s = 0.
inline double lobe_pow_Schlick(double s, double h) {
    const double c = clamp_cosine(s);
    return c > 0 ? 1 / (1 + std::max(h, 0.0) * ((1 - c) / c)) : 0;
}

LOBE_MODEL(schlick, LOBE_FUNCTION(double, lobe_pow_Schlick, (double s, double h)))

}  // namespace lobe
