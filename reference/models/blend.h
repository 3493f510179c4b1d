// Several widths in one surface: Cook, Torrance 1982, section 3, D = sum of w_j D(m_j) with the w_j adding up to 1.
#pragma once

#include "beckmann.h"
#include "ggx.h"

namespace lobe {

// The weighted mean of f over three widths; without any weight, nothing.
template <class F> auto blended(Vec3 alphas, Vec3 weights, F f) {
    const Vec3 w = per_channel([&](int i) { return std::max(weights[i], 0.0); });
    const double sum = w.x + w.y + w.z;
    const auto total = f(alphas.x) * w.x + f(alphas.y) * w.y + f(alphas.z) * w.z;
    return sum > 0 ? total / sum : total;
}
// Over two, of which the second has the weight.
template <class F> auto blended(Vec2 alphas, double weight, F f) {
    const double second = clamp_cosine(weight);
    return blended(Vec3(alphas.x, alphas.y, alphas.y), Vec3(1 - second, second, 0), f);
}

inline double lobe_D_GGX_blend(Vec3 N, Vec3 H, Vec2 alphas, double weight) {
    return blended(alphas, weight, [&](double alpha) { return lobe_D_GGX(N, H, alpha); });
}
inline double lobe_D_GGX_blend3(Vec3 N, Vec3 H, Vec3 alphas, Vec3 weights) {
    return blended(alphas, weights, [&](double alpha) { return lobe_D_GGX(N, H, alpha); });
}
inline double lobe_D_Beckmann_blend(Vec3 N, Vec3 H, Vec2 alphas, double weight) {
    return blended(alphas, weight, [&](double alpha) { return lobe_D_Beckmann(N, H, alpha); });
}
inline double lobe_D_Beckmann_blend3(Vec3 N, Vec3 H, Vec3 alphas, Vec3 weights) {
    return blended(alphas, weights, [&](double alpha) { return lobe_D_Beckmann(N, H, alpha); });
}

// Patches of several widths side by side: each has its own masking.
inline Vec3 lobe_GGX_blend(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, Vec2 alphas, double weight) {
    return blended(alphas, weight, [&](double alpha) { return lobe_GGX(N, V, L, f0, alpha); });
}
inline Vec3 lobe_GGX_blend3(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, Vec3 alphas, Vec3 weights) {
    return blended(alphas, weights, [&](double alpha) { return lobe_GGX(N, V, L, f0, alpha); });
}

// One surface with facets of both: masked as if all were of the mean width.
inline Vec3 lobe_GGX_blend_D(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, Vec2 alphas, double weight) {
    const double NdotV = N.dot(V), NdotL = N.dot(L);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const double mean = blended(alphas, weight, [](double alpha) { return std::max(alpha, SMALLEST_ALPHA); });
    const double D = lobe_D_GGX_blend(N, lobe_H(V, L), alphas, weight);
    return half_angle_F_Schlick(V, L, f0) * (D * lobe_V_GGX(NdotV, NdotL, mean));
}

// The paper's own: grooves know no width.
inline Vec3 lobe_CookTorrance_blend(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, Vec2 alphas, double weight) {
    return blended(alphas, weight, [&](double alpha) { return lobe_CookTorrance(N, V, L, f0, alpha); });
}
inline Vec3 lobe_CookTorrance_blend3(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, Vec3 alphas, Vec3 weights) {
    return blended(alphas, weights, [&](double alpha) { return lobe_CookTorrance(N, V, L, f0, alpha); });
}

LOBE_MODEL(blend, LOBE_FUNCTION(double, lobe_D_GGX_blend, (Vec3 N, Vec3 H, Vec2 alphas, double weight)),
           LOBE_FUNCTION(double, lobe_D_GGX_blend3, (Vec3 N, Vec3 H, Vec3 alphas, Vec3 weights)),
           LOBE_FUNCTION(double, lobe_D_Beckmann_blend, (Vec3 N, Vec3 H, Vec2 alphas, double weight)),
           LOBE_FUNCTION(double, lobe_D_Beckmann_blend3, (Vec3 N, Vec3 H, Vec3 alphas, Vec3 weights)),
           LOBE_FUNCTION(Vec3, lobe_GGX_blend, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, Vec2 alphas, double weight)),
           LOBE_FUNCTION(Vec3, lobe_GGX_blend3, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, Vec3 alphas, Vec3 weights)),
           LOBE_FUNCTION(Vec3, lobe_GGX_blend_D, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, Vec2 alphas, double weight)),
           LOBE_FUNCTION(Vec3, lobe_CookTorrance_blend, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, Vec2 alphas, double weight)),
           LOBE_FUNCTION(Vec3, lobe_CookTorrance_blend3, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, Vec3 alphas, Vec3 weights)))

}  // namespace lobe
