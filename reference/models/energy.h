// How much light the height-correlated GGX lobe reflects, by quadrature, and what is done about the rest.
#pragma once

#include "ggx.h"
#include "quadrature.h"

namespace lobe {

// The widths for which the quadratures are laid out.
inline double energy_width(double alpha) { return std::clamp(alpha, SMALLEST_ALPHA, 4.0); }

// Smith's Lambda with no difference of near numbers: a narrow lobe loses little.
inline double ggx_lambda(double cos, double alpha) {
    return alpha * alpha * tan2(cos) / (2 * (1 + ggx_twice_lambda_plus_1(cos, alpha)));
}

// The area per azimuth that facets steeper than s show, as long as they face V: the integral of (1 - t s) s / (pi
// (1 + s^2)^2), with slopes in units of alpha, from s to 1/t, or for t <= 0, where all of them face V, to infinity.
inline double ggx_seen_beyond(double s, double t) {
    const double back = std::max(t, 0.0);
    return ((1 - t * s) / (1 + s * s) - t * std::atan2(1 - back * s, back + s)) / (2 * std::numbers::pi);
}

// What becomes of a beam from V that falls onto a white GGX surface.
struct GGXEnergy {
    double lost = 0;     // shadowed, or mirrored to below the surface: 1 - albedo
    double grazing = 0;  // of the albedo, the part of Schlick's (1 - V.H)^5
};

// A facet of slope r, in the azimuth phi from V, shows V the area P22 (1 - t r), t = tan(theta_V) cos(phi), in units of
// what the surface shows, and mirrors it to NdotL = NdotV (1 - 2 t r - r^2)/(1 + r^2): above the surface for r < R. Of
// that, G1 - G2 = G1 Lambda(L)/(1 + Lambda(V) + Lambda(L)) is shadowed; beyond R, G1 is lost.
//
// t = sinh(y) makes R = exp(-y), and dense in the azimuths at pi/2 where V, near grazing, sees facets turn away;
// y = asinh(tan(theta_V)) sin(x) removes the square roots at both ends, so that midpoints in x converge exponentially.
// r = alpha sinh(z) fits the width of the lobe, P22 r dr = tanh(z) / (pi cosh^2(z)) dz, and z = Z (1 - u^2) the steep
// end of the shadows at R; Gauss, Legendre over u.
template <int azimuths, int slopes> GGXEnergy ggx_energy(double NdotV, double alpha) {
    static const GaussLegendre<slopes> gauss;
    constexpr double pi = std::numbers::pi, smallest_tan = 1e-8, largest_slope = 1e5;  // beyond them nothing changes
    const double v = std::max(clamp_cosine(NdotV), SMALLEST_COSINE), width = energy_width(alpha);
    const double tan = std::max(std::sqrt(tan2(v)), smallest_tan), lambda_v = ggx_lambda(v, width);

    GGXEnergy sum;
    for (int i = 0; i < azimuths; ++i) {
        const double x = pi * ((i + 0.5) / azimuths - 0.5), y = std::asinh(tan) * std::sin(x);
        const double t = std::sinh(y), R = std::exp(-y);
        const double dy = std::asinh(tan) * std::cos(x) * pi / azimuths;
        const double seen = 2 / (1 + lambda_v) * std::cosh(y) / std::sqrt((tan - t) * (tan + t)) * dy;  // phi and -phi
        sum.lost += seen * ggx_seen_beyond(R / width, t * width);

        const double Z = std::asinh(std::min(R, largest_slope) / width);
        for (int j = 0; j < slopes; ++j) {
            const double u = gauss.node[j], ez = std::exp(Z * (1 - u * u)), dz = 2 * Z * u * gauss.weight[j];
            const double sinh = (ez - 1 / ez) / 2, cosh = (ez + 1 / ez) / 2, r = width * sinh, h2 = 1 + r * r;
            const double part = seen * (1 - t * r) * sinh / (pi * cosh * cosh * cosh) * dz;
            const double lambda_l = ggx_lambda(v * (R - r) * (r + 1 / R) / h2, width);
            const double shadowed = lambda_l / (1 + lambda_v + lambda_l);
            sum.lost += part * shadowed;
            sum.grazing += part * (1 - shadowed) * schlick_weights(v * (1 - t * r) / std::sqrt(h2)).grazing;
        }
    }
    return sum;
}

// To 1e-10 for alpha <= 1; and its mean over the directions, 2 times the integral of NdotV ggx_lost, to 1e-9. The loss
// varies with NdotV/alpha: NdotV = alpha sinh(z).
inline double ggx_lost(double NdotV, double alpha) { return ggx_energy<64, 48>(NdotV, alpha).lost; }

inline double ggx_lost_on_average(double alpha) {
    static const GaussLegendre<24> gauss;
    thread_local double before = 0, sum = 0;  // a picture asks for the same alpha again and again
    const double width = energy_width(alpha), Z = std::asinh(1 / width);
    if (std::exchange(before, width) == width) return sum;
    sum = 0;
    for (std::size_t i = 0; i < gauss.node.size(); ++i) {
        const double z = Z * gauss.node[i], v = width * std::sinh(z);
        sum += 2 * v * ggx_energy<32, 32>(v, width).lost * width * std::cosh(z) * Z * gauss.weight[i];
    }
    return sum;
}

// The directional albedo of lobe_GGX with F = 1, and its mean over the directions of a diffuse light.
inline double lobe_albedo_GGX(double NdotV, double alpha) { return 1 - ggx_lost(NdotV, alpha); }
inline double lobe_albedo_avg_GGX(double alpha) { return 1 - ggx_lost_on_average(alpha); }

// Karis, Real Shading in Unreal Engine 4, 2013: Schlick's F is linear in f0, and so is the albedo, f0 x + y.
inline Vec2 lobe_DFG_GGX(double NdotV, double alpha) {
    const GGXEnergy energy = ggx_energy<64, 64>(NdotV, alpha);
    return {1 - energy.lost - energy.grazing, energy.grazing};
}

// The shader's shorter fit is held to the same.
inline Vec2 lobe_DFG_GGX_fast(double NdotV, double alpha) { return lobe_DFG_GGX(NdotV, alpha); }

// f0 of a whole lobe, at most 1.
inline double reflected_at_normal(double f0) { return std::min(f0, 1.0); }

// Turquin, Practical multiple scattering compensation for microfacet models, 2019: the factor on lobe_GGX that brings
// back what is lost, coloured by one more reflection.
inline Vec3 lobe_energy_Turquin(double NdotV, Vec3 f0, double alpha) {
    const double lost = ggx_lost(NdotV, alpha);
    return per_channel([&](int i) { return 1 + reflected_at_normal(f0[i]) * lost / (1 - lost); });
}

// Kulla, Conty, Revisiting physically based shading at Imageworks, 2017: what V and L lose, spread like a diffuse lobe.
// Each bounce is dimmed by Schlick's mean, f0 + (1 - f0)/21, and of each 1 - E goes into the next: a geometric series.
inline Vec3 lobe_GGX_multiple(Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha) {
    const double NdotV = N.dot(V), NdotL = N.dot(L);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const double lost = ggx_lost_on_average(alpha);
    const double white = ggx_lost(NdotV, alpha) * ggx_lost(NdotL, alpha) / (std::numbers::pi * lost);
    return per_channel([&](int i) {
        const double f = reflected_at_normal(f0[i]), F = f + (1 - f) / 21;
        return white * F * F * (1 - lost) / (1 - F * lost);
    });
}

// Tokuyoshi, Kaplanyan, Improved geometric specular antialiasing, I3D 2019: the normals within a pixel vary
// by a kernel of sigma^2 = 1/(2 pi) times their derivatives, which widens alpha^2 by twice that, at most by 0.18.
inline double lobe_alpha_filtered(double alpha, Vec3 dNdx, Vec3 dNdy) {
    constexpr double sigma2 = 0.15915494, kappa = 0.18;
    const double kernel = std::min(2 * sigma2 * (dNdx.length2() + dNdy.length2()), kappa);
    return std::sqrt(std::min(alpha * alpha + kernel, 1.0));
}

LOBE_MODEL(energy, LOBE_QUADRATURE(double, lobe_albedo_GGX, (double NdotV, double alpha)),
           LOBE_QUADRATURE(double, lobe_albedo_avg_GGX, (double alpha)),
           LOBE_QUADRATURE(Vec2, lobe_DFG_GGX, (double NdotV, double alpha)),
           LOBE_QUADRATURE(Vec2, lobe_DFG_GGX_fast, (double NdotV, double alpha)),
           LOBE_QUADRATURE(Vec3, lobe_energy_Turquin, (double NdotV, Vec3 f0, double alpha)),
           LOBE_QUADRATURE(Vec3, lobe_GGX_multiple, (Vec3 N, Vec3 V, Vec3 L, Vec3 f0, double alpha)),
           LOBE_FUNCTION(double, lobe_alpha_filtered, (double alpha, Vec3 dNdx, Vec3 dNdy)))

}  // namespace lobe
