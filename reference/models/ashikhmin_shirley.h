// Ashikhmin, Shirley, An Anisotropic Phong BRDF Model, 2000: a highlight with an exponent along T and one along B, and
// a diffuse part that takes what the highlight leaves.
#pragma once

#include "fresnel.h"
#include "ward.h"

namespace lobe {

// cos^e(d) with e = nu cos^2(phi) + nv sin^2(phi), of a half vector of any length.
struct AnisotropicPower {
    AnisotropicPower(double nu, double nv) : u(std::max(nu, 0.0)), v(std::max(nv, 0.0)) {}
    double exponent(double phi) const { return u * std::pow(std::cos(phi), 2) + v * std::pow(std::sin(phi), 2); }
    double operator()(const HalfAngles& h) const {
        return std::exp(-exponent(h.phi) / 2 * std::log1p(h.tan * h.tan));
    }
    // Over the azimuths, the mean of 1/(e + k) is 1/sqrt((nu + k)(nv + k)): the factor that normalises cos^(e + k - 1).
    double norm(double k) const { return std::sqrt(u + k) * std::sqrt(v + k) / (2 * std::numbers::pi); }

    double u, v;
};

// As a distribution of facets, D cos(d) integrates to 1: one cosine more than the density that the paper draws from. At
// the horizon only an exponent of 0 leaves something.
inline double lobe_D_AshikhminShirley(double NdotH, double TdotH, double BdotH, double nu, double nv) {
    const AnisotropicPower power(nu, nv);
    if (NdotH > 0) return power.norm(2) * power(HalfAngles(std::min(NdotH, 1.0), TdotH, BdotH));
    const bool is_flat = power.exponent(std::atan2(BdotH, TdotH)) == 0;
    return is_flat && (TdotH != 0 || BdotH != 0) ? power.norm(2) : 0;
}

// The paper's eq. 4. Its F is Schlick's at the half vector.
inline Vec3 lobe_AshikhminShirley_specular(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 rs, double nu, double nv) {
    const double NdotV = N.dot(V), NdotL = N.dot(L);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const AnisotropicPower power(nu, nv);
    const double shape = power.norm(1) * power(HalfAngles(N, T, lobe_H(V, L)));
    return half_angle_F_Schlick(V, L, rs) * (shape / (4 * lobe_LdotH(V, L) * std::max(NdotV, NdotL)));
}

// The paper's eq. 5: the part of the light that enters and leaves, 1 - (1 - c/2)^5 for each cosine, here by the
// geometric series of 1 - c/2. Over the light's cosines it integrates to 23 pi/28: the albedo is rd (1 - rs) times V's
// part.
inline double entering(double c) {
    const double x = 1 - c / 2;
    return c / 2 * (1 + x * (1 + x * (1 + x * (1 + x))));
}
inline Vec3 lobe_AshikhminShirley_diffuse(Vec3 N, Vec3 V, Vec3 L, Vec3 rd, Vec3 rs) {
    const double NdotV = N.dot(V), NdotL = N.dot(L);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const double shape = 28 / (23 * std::numbers::pi) * entering(NdotV) * entering(NdotL);
    return per_channel([&](int i) { return rd[i] * std::max(0.0, 1 - rs[i]) * shape; });
}

inline Vec3 lobe_AshikhminShirley(Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 rd, Vec3 rs, double nu, double nv) {
    return lobe_AshikhminShirley_diffuse(N, V, L, rd, rs) + lobe_AshikhminShirley_specular(N, T, V, L, rs, nu, nv);
}

// The paper's eqs. 7 to 10. An azimuth has the density 1/(nu + 1) : 1/(nv + 1) of an ellipse, within it the power is
// drawn.
inline Vec3 lobe_sample_AshikhminShirley(Vec3 N, Vec3 T, double nu, double nv, Vec2 u) {
    const AnisotropicPower power(nu, nv);
    const double turn = drawn_azimuth(u.x);
    const double phi = std::atan2(std::sqrt(power.u + 1) * std::sin(turn), std::sqrt(power.v + 1) * std::cos(turn));
    return tilted(N, T, drawn_angle_of_power(u.y, power.exponent(phi)), phi);
}
inline double lobe_pdf_AshikhminShirley(Vec3 N, Vec3 T, Vec3 V, Vec3 L, double nu, double nv) {
    const AnisotropicPower power(nu, nv);
    return mirrored_density(N, V, L, [&](Vec3 H) { return power.norm(1) * power(HalfAngles(N, T, H)); });
}

LOBE_MODEL(ashikhmin_shirley,
           LOBE_FUNCTION(Vec3, lobe_AshikhminShirley,
                         (Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 rd, Vec3 rs, double nu, double nv)),
           LOBE_FUNCTION(Vec3, lobe_AshikhminShirley_specular,
                         (Vec3 N, Vec3 T, Vec3 V, Vec3 L, Vec3 rs, double nu, double nv)),
           LOBE_FUNCTION(Vec3, lobe_AshikhminShirley_diffuse, (Vec3 N, Vec3 V, Vec3 L, Vec3 rd, Vec3 rs)),
           LOBE_FUNCTION(double, lobe_D_AshikhminShirley,
                         (double NdotH, double TdotH, double BdotH, double nu, double nv)),
           LOBE_FUNCTION(Vec3, lobe_sample_AshikhminShirley, (Vec3 N, Vec3 T, double nu, double nv, Vec2 u)),
           LOBE_FUNCTION(double, lobe_pdf_AshikhminShirley,
                         (Vec3 N, Vec3 T, Vec3 V, Vec3 L, double nu, double nv)))

}  // namespace lobe
