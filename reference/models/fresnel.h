// Reflection and transmission at a smooth interface: Fresnel 1823 by complex amplitudes, and Schlick 1994.
#pragma once

#include "core.h"

#include <complex>

namespace lobe {

// eta cos(theta_t) by Snell's law, eta = n on the far side over n on the side of cosI. Beyond the critical angle it is
// imaginary: the wave behind the interface decays.
inline std::complex<double> eta_cosT(double cosI, double eta) {
    return std::sqrt(std::complex<double>((eta - 1) * (eta + 1) + cosI * cosI));
}

// Mean of |r_s|^2 and |r_p|^2, amplitudes of Born & Wolf, Principles of Optics, sec. 1.5.2, eq. 21. Under total
// internal reflection numerator and denominator are conjugate: F = 1. Without an interface, eta = 1, F = 0 at every
// angle.
inline double lobe_F_dielectric(double cosI, double eta) {
    if (eta == 1) return 0;
    const double c = clamp_cosine(cosI);
    const std::complex<double> g = eta_cosT(c, eta);
    const double eta2 = eta * eta;
    return std::min(1.0, (std::norm((c - g) / (c + g)) + std::norm((eta2 * c - g) / (eta2 * c + g))) / 2);
}

// The flux behind the interface, from the transmitted amplitudes t_s, t_p of Born & Wolf, sec. 1.5.2, eq. 20:
// T = eta cos(theta_t) / cosI |t|^2 with t_s = 2 cosI / (cosI + g), t_p = 2 eta cosI / (eta^2 cosI + g). Never 1 - F,
// which cancels at grazing.
inline double lobe_T_dielectric(double cosI, double eta) {
    if (eta == 1) return 1;
    const double c = clamp_cosine(cosI);
    const std::complex<double> g = eta_cosT(c, eta);
    const std::complex<double> s = 2.0 / (c + g), p = 2 * eta / (eta * eta * c + g);  // t_s / cosI, t_p / cosI
    return g.real() * c * (std::norm(s) + std::norm(p)) / 2;
}

// Schlick's weight w = (1 - cosI)^5 of the grazing colour and its complement, each to full relative accuracy, from the
// cosine and its own complement x = 1 - cosI: 1 - x^5 = (1 - x)(1 + x + x^2 + x^3 + x^4).
struct SchlickWeights {
    SchlickWeights(double cosI, double x)
        : grazing(x * x * x * x * x), normal(cosI * (1 + x * (1 + x * (1 + x * (1 + x))))) {}
    template <class T> T mix(const T& f0, const T& f90) const { return f0 * normal + f90 * grazing; }

    double grazing, normal;
};

inline SchlickWeights schlick_weights(double cosI) {
    const double c = clamp_cosine(cosI);
    return {c, 1 - c};
}

// At the half angle between V and L, where 1 - cos(theta/2) = sin^2(theta/2) / (1 + cos(theta/2)) does not cancel.
inline SchlickWeights schlick_weights(Vec3 V, Vec3 L) {
    const double c = lobe_LdotH(V, L);
    return {c, (V - L).length2() / (4 * (1 + c))};
}

// Schlick 1994, eq. 15, with the colour at grazing incidence, f90, as a parameter. f0 is not clamped.
inline Vec3 lobe_F_Schlick(double cosI, Vec3 f0, Vec3 f90) { return schlick_weights(cosI).mix(f0, f90); }
inline double lobe_F_Schlick(double cosI, double f0, double f90) { return schlick_weights(cosI).mix(f0, f90); }
inline Vec3 lobe_F_Schlick(double cosI, Vec3 f0) { return lobe_F_Schlick(cosI, f0, Vec3(1)); }
inline double lobe_F_Schlick(double cosI, double f0) { return lobe_F_Schlick(cosI, f0, 1.0); }

// F of a whole lobe: at L.H, and with f0 at most 1, since a surface reflects no more than arrives.
inline Vec3 half_angle_F_Schlick(Vec3 V, Vec3 L, Vec3 f0) {
    const Vec3 reflected(std::min(f0.x, 1.0), std::min(f0.y, 1.0), std::min(f0.z, 1.0));
    return schlick_weights(V, L).mix(reflected, Vec3(1));
}

// r = (eta - 1)/(eta + 1) = tanh(ln(eta)/2) at normal incidence.
inline double lobe_f0(double eta) {
    const double r = std::tanh(std::log(eta) / 2);
    return r * r;
}

// The inverse, for eta >= 1. f0 >= 1 has no dielectric: it is taken as the largest float below 1.
inline double lobe_eta(double f0) { return std::exp(2 * std::atanh(std::sqrt(std::clamp(f0, 0.0, 1 - 0x1p-24)))); }

// Snell's law; 0 under total internal reflection, where the cosine is imaginary.
inline double lobe_cosT(double cosI, double eta) {
    return std::min(1.0, eta_cosT(clamp_cosine(cosI), eta).real() / eta);
}

// sin(theta_c) = eta: smaller cosines are totally reflected. 0 where no angle is.
inline double lobe_cos_critical(double eta) { return eta < 1 ? std::cos(std::asin(eta)) : 0; }

LOBE_MODEL(fresnel, LOBE_FUNCTION(double, lobe_F_dielectric, (double cosI, double eta)),
           LOBE_FUNCTION(double, lobe_T_dielectric, (double cosI, double eta)),
           LOBE_FUNCTION(Vec3, lobe_F_Schlick, (double cosI, Vec3 f0)),
           LOBE_FUNCTION(Vec3, lobe_F_Schlick, (double cosI, Vec3 f0, Vec3 f90)),
           LOBE_FUNCTION(double, lobe_F_Schlick, (double cosI, double f0)),
           LOBE_FUNCTION(double, lobe_F_Schlick, (double cosI, double f0, double f90)),
           LOBE_FUNCTION(double, lobe_f0, (double eta)), LOBE_FUNCTION(double, lobe_eta, (double f0)),
           LOBE_FUNCTION(double, lobe_cosT, (double cosI, double eta)),
           LOBE_FUNCTION(double, lobe_cos_critical, (double eta)))

}  // namespace lobe
