// Lafortune, Foo, Torrance, Greenberg, Non-Linear Approximation of Reflectance Functions, 1997: cosine lobes about axes
// that V is scaled to.
#pragma once

#include "blinn_phong.h"

namespace lobe {

// Eq. 7: the cosine between l and the scaled v, times the length of that, to a power; 0 where it is not positive. What
// a float could not hold is cut.
inline double lobe_Lafortune_lobe(Vec3 lLocal, Vec3 vLocal, Vec3 C, double exponent) {
    constexpr double largest = 1e38;
    const double bracket = (C * vLocal).dot(lLocal);
    return bracket > 0 ? std::min(largest, std::pow(bracket, std::max(exponent, 0.0))) : 0;
}

// The lobes of the three channels.
struct LafortuneLobes {
    Vec3 Cx, Cy, Cz, exponent;
    Vec3 operator()(Vec3 l, Vec3 v) const {
        return per_channel([&](int i) { return lobe_Lafortune_lobe(l, v, {Cx[i], Cy[i], Cz[i]}, exponent[i]); });
    }
};

template <class... Lobes> Vec3 lafortune(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 diffuse, const Lobes&... lobes) {
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    const Vec3 v = in_frame(N, T, V), l = in_frame(N, T, L);
    return (diffuse / std::numbers::pi + ... + lobes(l, v));
}
inline Vec3 lobe_Lafortune(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 diffuse, Vec3 Cx, Vec3 Cy, Vec3 Cz, Vec3 exponent) {
    return lafortune(N, T, V, L, diffuse, LafortuneLobes{Cx, Cy, Cz, exponent});
}
inline Vec3 lobe_Lafortune2(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 diffuse, Vec3 Cx1, Vec3 Cy1, Vec3 Cz1, Vec3 exponent1,
                            Vec3 Cx2, Vec3 Cy2, Vec3 Cz2, Vec3 exponent2) {
    return lafortune(N, T, V, L, diffuse, LafortuneLobes{Cx1, Cy1, Cz1, exponent1},
                     LafortuneLobes{Cx2, Cy2, Cz2, exponent2});
}
inline Vec3 lobe_Lafortune3(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 diffuse, Vec3 Cx1, Vec3 Cy1, Vec3 Cz1, Vec3 exponent1,
                            Vec3 Cx2, Vec3 Cy2, Vec3 Cz2, Vec3 exponent2, Vec3 Cx3, Vec3 Cy3, Vec3 Cz3,
                            Vec3 exponent3) {
    return lafortune(N, T, V, L, diffuse, LafortuneLobes{Cx1, Cy1, Cz1, exponent1},
                     LafortuneLobes{Cx2, Cy2, Cz2, exponent2}, LafortuneLobes{Cx3, Cy3, Cz3, exponent3});
}

// The special cases of section 3. The axis n has the length of which light along N is reflected fully: n^e times the
// integral of cos^e cos, 2 pi/(e + 2), is 1.
inline Vec3 full_lafortune(double exponent, Vec3 C) {
    const double e = std::max(exponent, 0.1);
    return C * std::exp(std::log((e + 2) / (2 * std::numbers::pi)) / e);
}
inline Vec3 lobe_Lafortune_C_Phong(double exponent) { return full_lafortune(exponent, {-1, -1, 1}); }
inline Vec3 lobe_Lafortune_C_retro(double exponent) { return full_lafortune(exponent, {1, 1, 1}); }
inline Vec3 lobe_Lafortune_C_diffuse(double exponent) { return full_lafortune(exponent, {0, 0, 1}); }
inline Vec3 lobe_Lafortune_C_offspecular(double ratio, double exponent) {
    return full_lafortune(exponent, {-1, -1, clamp_cosine(ratio)});
}
inline Vec3 lobe_Lafortune_C_aniso(double x, double y, double exponent) {
    return full_lafortune(exponent, {-clamp_cosine(x), -clamp_cosine(y), 1});
}

// The unit axis of one channel's lobe for this V, in the frame; N where V is scaled to nothing.
inline Vec3 lafortune_axis(Vec3 N, Vec3 T, Vec3 V, Vec3 C) {
    const Vec3 a = C * in_frame(N, T, V);
    return a == Vec3(0) ? Vec3(0, 0, 1) : a.normalized();
}

// Draws about it; L may lie below the surface.
inline Vec3 lobe_sample_Lafortune(Vec3 N, Vec3 T, Vec3 V, Vec3 C, double exponent, Vec2 u) {
    const Vec3 n(0, 0, 1), t(1, 0, 0);
    const double theta = drawn_angle_of_power(u.y, std::max(exponent, 0.0));
    return from_frame(N, T, carried(n, t, lafortune_axis(N, T, V, C), theta, drawn_azimuth(u.x)));
}
inline double lobe_pdf_Lafortune(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 C, double exponent) {
    return N.dot(V) > 0 ? drawn_power(lafortune_axis(N, T, V, C), in_frame(N, T, L), exponent) : 0;
}

LOBE_MODEL(lafortune, LOBE_FUNCTION(double, lobe_Lafortune_lobe, (Vec3 lLocal, Vec3 vLocal, Vec3 C, double exponent)),
           LOBE_FUNCTION(Vec3, lobe_Lafortune,
                         (Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 diffuse, Vec3 Cx, Vec3 Cy, Vec3 Cz, Vec3 exponent)),
           LOBE_FUNCTION(Vec3, lobe_Lafortune2,
                         (Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 diffuse, Vec3 Cx1, Vec3 Cy1, Vec3 Cz1, Vec3 exponent1,
                          Vec3 Cx2, Vec3 Cy2, Vec3 Cz2, Vec3 exponent2)),
           LOBE_FUNCTION(Vec3, lobe_Lafortune3,
                         (Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 diffuse, Vec3 Cx1, Vec3 Cy1, Vec3 Cz1, Vec3 exponent1,
                          Vec3 Cx2, Vec3 Cy2, Vec3 Cz2, Vec3 exponent2, Vec3 Cx3, Vec3 Cy3, Vec3 Cz3, Vec3 exponent3)),
           LOBE_FUNCTION(Vec3, lobe_Lafortune_C_Phong, (double exponent)),
           LOBE_FUNCTION(Vec3, lobe_Lafortune_C_retro, (double exponent)),
           LOBE_FUNCTION(Vec3, lobe_Lafortune_C_diffuse, (double exponent)),
           LOBE_FUNCTION(Vec3, lobe_Lafortune_C_offspecular, (double ratio, double exponent)),
           LOBE_FUNCTION(Vec3, lobe_Lafortune_C_aniso, (double x, double y, double exponent)),
           LOBE_FUNCTION(Vec3, lobe_sample_Lafortune, (Vec3 N, Vec3 T, Vec3 V, Vec3 C, double exponent, Vec2 u)),
           LOBE_FUNCTION(double, lobe_pdf_Lafortune, (Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 C, double exponent)))

}  // namespace lobe
