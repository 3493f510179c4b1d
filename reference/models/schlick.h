// Schlick, An Inexpensive BRDF Model for Physically-based Rendering, 1994: rational functions in place of powers and
// exponentials. r in 0..1 is his roughness, p in 0..1 his isotropy.
#pragma once

#include "ggx.h"
#include "quadrature.h"

namespace lobe {

// Section 2: s / (h - h s + s) for the power s^h. With u = 1/s - 1, which is 0 at the peak, it is 1/(1 + h u) where the
// power is (1 + u)^-h: Bernoulli's inequality makes it the larger one. 0 at s = 0.
inline double lobe_pow_Schlick(double s, double h) {
    const double c = clamp_cosine(s);
    return c > 0 ? 1 / (1 + std::max(h, 0.0) * ((1 - c) / c)) : 0;
}

// What normalises it as a distribution: 2 pi times the integral of t^2/q over t, q = t + h (1 - t). With q = h^(1-s) it
// is that of t^2 over s, times ln(h)/(h - 1), and t = (h - q)/(h - 1).
inline double pow_schlick_area(double h) {
    return remembered(std::log(std::max(h, SMALLEST_COSINE)), [](double X) {
        const double scale = X == 0 ? 1 : X / std::expm1(X);
        return 2 * std::numbers::pi * scale * integral<64>(1, [=](double s) {
            const double t = X == 0 ? s : std::exp((1 - s) * X) * std::expm1(s * X) / std::expm1(X);
            return t * t;
        });
    });
}
inline double lobe_D_SchlickPower(double NdotH, double h) { return lobe_pow_Schlick(NdotH, h) / pow_schlick_area(h); }

// The ranges of the two parameters. The smallest r is that of the smallest microfacet width.
inline double schlick_r(double r) { return std::clamp(r, SMALLEST_ALPHA * SMALLEST_ALPHA, 1.0); }
inline double schlick_p(double p) { return std::clamp(p, 1e-4, 1.0); }

// Z(t) = r/(1 + r t^2 - t^2)^2 is the distribution of Trowbridge and Reitz with the width sqrt(r), without its 1/pi.
inline double lobe_Z_Schlick(double NdotH, double r) {
    return std::numbers::pi * lobe_D_GGX(NdotH, std::sqrt(schlick_r(r)));
}
inline double lobe_Z_Schlick(Vec3 N, Vec3 H, double r) {
    return std::numbers::pi * lobe_D_GGX(N, H, std::sqrt(schlick_r(r)));
}

// A(w) = sqrt(p/(p^2 - p^2 w^2 + w^2)), w = cos(phi) the cosine of H's azimuth from T. Undefined at the pole: 1.
inline double lobe_A_Schlick(double TdotH, double BdotH, double p) {
    if (TdotH == 0 && BdotH == 0) return 1;
    const double phi = std::atan2(BdotH, TdotH), isotropy = schlick_p(p);
    return std::sqrt(isotropy) / std::hypot(isotropy * std::sin(phi), std::cos(phi));
}

inline double schlick_A(Vec3 N, Vec3 T, Vec3 H, double p) {
    const Vec3 local = in_frame(N, T, H);
    return lobe_A_Schlick(local.x, local.y, p);
}

// G(v) = v/(r - r v + v), eqs. 19 and 31: the rational function of the first section with the exponent r.
inline double lobe_G1_Schlick(double NdotX, double r) { return lobe_pow_Schlick(NdotX, std::min(r, 1.0)); }

// Section 4, eq. 21, over pi: for Beckmann's distribution, m^3 x / (t (m x^2 - x^2 + m^2)^2) with x = t + m - 1. In
// d = (1 - t)/m, which runs from 0 at the peak to 1 where nothing is left, x = m (1 - d) and the bracket is
// m^2 (1 - (1 - m)(1 - d)^2): m drops out but there.
inline double lobe_D_Schlick(double NdotH, double alpha) {
    const double t = clamp_cosine(NdotH), m = std::clamp(alpha, SMALLEST_ALPHA, 1.0), d = (1 - t) / m;
    if (d >= 1) return 0;
    const double bracket = d * (2 - d) + m * (1 - d) * (1 - d);
    return (1 - d) / (std::numbers::pi * t * bracket * bracket);
}

// One layer of section 5: what it gives to diffuse, glossy and mirror light (a, b, c; their sum is 1), and its parts.
struct SchlickLayer {
    SchlickLayer(double r, double p) : r(std::clamp(r, 0.0, 1.0)), p(p) {
        const double rest = std::pow(1 - 2 * this->r, 2);
        a = this->r < 0.5 ? 0 : rest, c = this->r < 0.5 ? rest : 0;
        b = 1 - rest;
    }

    // G(v)/v; and 1 - G(v) over v, which grows without bound towards grazing.
    double seen(double v) const { return 1 / (r + (1 - r) * v); }
    double hidden(double v) const { return r * (1 - v) / v * seen(v); }

    // G G' Z A / (4 pi NL NV)
    double glossy(Vec3 N, Vec3 T, Vec3 V, Vec3 L) const {
        const Vec3 H = lobe_H(V, L);
        const double facets = lobe_Z_Schlick(N, H, r) * schlick_A(N, T, H, p);
        return facets * seen(N.dot(V)) * seen(N.dot(L)) / (4 * std::numbers::pi);
    }
    // (1 - G G') / (4 pi NL NV), eq. 30: what is shadowed or masked leaves in all directions. 1 - G G' = (1 - G) +
    // G (1 - G').
    double re_emitted(double NdotV, double NdotL) const {
        const double v = std::max(NdotV, SMALLEST_COSINE), l = std::max(NdotL, SMALLEST_COSINE);
        return (hidden(v) / l + seen(v) * hidden(l)) / (4 * std::numbers::pi);
    }
    double all(Vec3 N, Vec3 T, Vec3 V, Vec3 L) const {
        return a / std::numbers::pi + b * (glossy(N, T, V, L) + re_emitted(N.dot(V), N.dot(L)));
    }

    double r, p, a, b, c;
};

inline Vec3 lobe_Schlick_directional(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 f0, double r, double p) {
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    return half_angle_F_Schlick(V, L, f0) * SchlickLayer(r, p).glossy(N, T, V, L);
}
inline Vec3 lobe_Schlick(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 f0, double r, double p) {
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    return half_angle_F_Schlick(V, L, f0) * SchlickLayer(r, p).all(N, T, V, L);
}

// Two layers: the lower one gets what the upper one lets through, 1 - S = (1 - f0)(1 - (1 - u)^5), at the same u = L.H.
inline Vec3 lobe_Schlick_double(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 f0, double r, double p, Vec3 f0b, double rb,
                                double pb) {
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    const double upper = SchlickLayer(r, p).all(N, T, V, L), lower = SchlickLayer(rb, pb).all(N, T, V, L);
    const Vec3 S = half_angle_F_Schlick(V, L, f0), Sb = half_angle_F_Schlick(V, L, f0b);
    const double entering = schlick_weights(V, L).normal;
    return per_channel([&](int i) {
        return S[i] * upper + std::max(0.0, 1 - f0[i]) * entering * Sb[i] * lower;
    });
}

// The mirror's weights: S c at the angle of incidence, dimensionless.
inline Vec3 lobe_Schlick_double_mirror(double cosI, Vec3 f0, double r, Vec3 f0b, double rb) {
    const SchlickWeights weights = schlick_weights(cosI);
    const double c = SchlickLayer(r, 1).c, cb = SchlickLayer(rb, 1).c;
    return per_channel([&](int i) {
        const double f = std::min(f0[i], 1.0), fb = std::min(f0b[i], 1.0);
        return weights.mix(f, 1.0) * c + (1 - f) * weights.normal * weights.mix(fb, 1.0) * cb;
    });
}
inline Vec3 lobe_Schlick_mirror(double cosI, Vec3 f0, double r) {
    return per_channel([&](int i) {
        return schlick_weights(cosI).mix(std::min(f0[i], 1.0), 1.0) * SchlickLayer(r, 1).c;
    });
}

// Half vectors are drawn with the density Z A^2 cos / pi. Of Z, the share sin^2/(sin^2 + r cos^2) lies within theta;
// and A^2 = p/(p^2 sin^2(phi) + cos^2(phi)) is what an ellipse with the axes p and 1 gives to azimuths.
inline Vec3 lobe_sample_Schlick(Vec3 N, Vec3 T, double r, double p, Vec2 u) {
    const double turn = drawn_azimuth(u.x), phi = std::atan2(std::sin(turn), schlick_p(p) * std::cos(turn));
    return tilted(N, T, std::atan(std::sqrt(schlick_r(r) * (u.y / (1 - u.y)))), phi);
}
inline double lobe_pdf_Schlick(Vec3 N, Vec3 T, Vec3 V, Vec3 L, double r, double p) {
    const double A = schlick_A(N, T, lobe_H(V, L), p);  // of a normalised H it would be that of a rounding at the pole
    return mirrored_density(N, V, L, [&](Vec3 H) {
        return lobe_Z_Schlick(N, H, r) * A * A * N.dot(H) / std::numbers::pi;
    });
}

LOBE_MODEL(schlick, LOBE_FUNCTION(double, lobe_pow_Schlick, (double s, double h)),
           LOBE_FUNCTION(double, lobe_D_SchlickPower, (double NdotH, double h)),
           LOBE_FUNCTION(double, lobe_Z_Schlick, (double NdotH, double r)),
           LOBE_FUNCTION(double, lobe_Z_Schlick, (Vec3 N, Vec3 H, double r)),
           LOBE_FUNCTION(double, lobe_A_Schlick, (double TdotH, double BdotH, double p)),
           LOBE_FUNCTION(double, lobe_G1_Schlick, (double NdotX, double r)),
           LOBE_FUNCTION(double, lobe_D_Schlick, (double NdotH, double alpha)),
           LOBE_FUNCTION(Vec3, lobe_Schlick_directional,
                         (Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 f0, double r, double p)),
           LOBE_FUNCTION(Vec3, lobe_Schlick, (Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 f0, double r, double p)),
           LOBE_FUNCTION(Vec3, lobe_Schlick_double,
                         (Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 f0, double r, double p, Vec3 f0b, double rb, double pb)),
           LOBE_FUNCTION(Vec3, lobe_Schlick_mirror, (double cosI, Vec3 f0, double r)),
           LOBE_FUNCTION(Vec3, lobe_Schlick_double_mirror, (double cosI, Vec3 f0, double r, Vec3 f0b, double rb)),
           LOBE_FUNCTION(Vec3, lobe_sample_Schlick, (Vec3 N, Vec3 T, double r, double p, Vec2 u)),
           LOBE_FUNCTION(double, lobe_pdf_Schlick, (Vec3 N, Vec3 T, Vec3 V, Vec3 L, double r, double p)))

}  // namespace lobe
