// Reflection and transmission at a smooth interface: Fresnel 1823 by complex amplitudes; the approximations of Schlick
// 1994 and of those who mended it; the directions.
#pragma once

#include "core.h"

#include <complex>

namespace lobe {

// eta cos(theta_t) by Snell's law, eta = n on the far side over n on the side of cosI. Beyond the critical angle it is
// imaginary: the wave behind the interface decays.
inline std::complex<double> eta_cosT(double cosI, double eta) {
    return std::sqrt(std::complex<double>((eta - 1) * (eta + 1) + cosI * cosI));
}

// Both polarisations' mean: light that is not polarised.
inline double unpolarised(Vec2 sp) { return (sp.x + sp.y) / 2; }

// |r_s|^2 and |r_p|^2, amplitudes of Born & Wolf, Principles of Optics, sec. 1.5.2, eq. 21. Under total internal
// reflection numerator and denominator are conjugate: F = 1. Without an interface, eta = 1, F = 0 at every angle.
inline Vec2 lobe_F_dielectric_sp(double cosI, double eta) {
    if (eta == 1) return Vec2(0);
    const double c = clamp_cosine(cosI), eta2 = eta * eta;
    const std::complex<double> g = eta_cosT(c, eta);
    return {std::min(1.0, std::norm((c - g) / (c + g))), std::min(1.0, std::norm((eta2 * c - g) / (eta2 * c + g)))};
}
inline double lobe_F_dielectric(double cosI, double eta) { return unpolarised(lobe_F_dielectric_sp(cosI, eta)); }

// The flux behind the interface, from the transmitted amplitudes t_s, t_p of Born & Wolf, sec. 1.5.2, eq. 20:
// T = eta cos(theta_t) / cosI |t|^2 with t_s = 2 cosI / (cosI + g), t_p = 2 eta cosI / (eta^2 cosI + g). Never 1 - F,
// which cancels at grazing.
inline Vec2 lobe_T_dielectric_sp(double cosI, double eta) {
    if (eta == 1) return Vec2(1);
    const double c = clamp_cosine(cosI);
    const std::complex<double> g = eta_cosT(c, eta);
    const std::complex<double> s = 2.0 / (c + g), p = 2 * eta / (eta * eta * c + g);  // t_s / cosI, t_p / cosI
    return Vec2(std::norm(s), std::norm(p)) * (g.real() * c);
}
inline double lobe_T_dielectric(double cosI, double eta) { return unpolarised(lobe_T_dielectric_sp(cosI, eta)); }

// The same amplitudes with the complex index eta + i k, Born & Wolf, sec. 14.2: Snell's law holds as it stands. Near an
// index match c - g cancels; the digits of long double pay for it. g, the root of z = n^2 - sin^2, is written out with
// its real part a and imaginary part b: 2 a^2 = |z| + Re z, 2 a b = Im z. Without an interface, eta = 1 and k = 0, F = 0.
inline Vec2 lobe_F_conductor_sp(double cosI, double eta, double k) {
    if (eta == 1 && k == 0) return Vec2(0);
    using Real = long double;
    const Real c = clamp_cosine(cosI), n = eta, re = (n - 1) * (n + 1) - Real(k) * k + c * c, im = 2 * n * k;
    const Real size = std::sqrt(re * re + im * im);
    // of the two roots that size +- re allow, the one without a difference of near numbers
    const Real larger = std::sqrt((size + std::abs(re)) / 2), smaller = larger > 0 ? im / (2 * larger) : 0;
    const Real a = re > 0 ? larger : smaller, b = re > 0 ? smaller : larger;
    const auto reflectance = [&](Real x, Real y) {  // |(x + iy - g) / (x + iy + g)|^2
        const Real below = (x + a) * (x + a) + (y + b) * (y + b);
        return std::min(1.0, double(((x - a) * (x - a) + (y - b) * (y - b)) / below));
    };
    return {reflectance(c, 0), reflectance((n * n - Real(k) * k) * c, im * c)};
}
inline double lobe_F_conductor(double cosI, double eta, double k) {
    return unpolarised(lobe_F_conductor_sp(cosI, eta, k));
}
inline Vec3 lobe_F_conductor(double cosI, Vec3 eta, Vec3 k) {
    return per_channel([&](int i) { return lobe_F_conductor(cosI, eta[i], k[i]); });
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

// Lagarde 2012: the weight of the grazing colour as a Gaussian of the cosine, 2^(-5.55473 c^2 - 6.98316 c).
inline Vec3 lobe_F_Schlick_fast(double cosI, Vec3 f0) {
    const double c = clamp_cosine(cosI), grazing = std::exp2(-5.55473 * c * c) * std::exp2(-6.98316 * c);
    return f0 * (1 - grazing) + Vec3(grazing);
}

// F of a whole lobe: at L.H, and with f0 at most 1, since a surface reflects no more than arrives.
inline Vec3 half_angle_F_Schlick(Vec3 V, Vec3 L, Vec3 f0) {
    const Vec3 reflected(std::min(f0.x, 1.0), std::min(f0.y, 1.0), std::min(f0.z, 1.0));
    return schlick_weights(V, L).mix(reflected, Vec3(1));
}

// Schlick's curve with a dip: minus b c (1 - c)^6, which is steepest at c = 1/7, 82 degrees, where it takes `drop` away
// (Lazanyi, Szirmay-Kalos 2005; Hoffman 2019). Where the difference is negative it is no reflectance: 0.
inline double schlick_with_dip(double cosI, double f0, double drop) {
    const double c = clamp_cosine(cosI), x = 1 - c;
    const double dip = 7 * c * std::pow(7 * x / 6, 6);  // 1 at c = 1/7
    return std::max(0.0, lobe_F_Schlick(c, f0, 1.0) - drop * dip);
}

// Hoffman 2019: the reflectance at 82 degrees is given.
inline Vec3 lobe_F_F82(double cosI, Vec3 f0, Vec3 f82) {
    return per_channel([&](int i) { return schlick_with_dip(cosI, f0[i], lobe_F_Schlick(1.0 / 7, f0[i]) - f82[i]); });
}
// Kutz, Hasan, Edmondson 2021: it is given as a part of Schlick's.
inline Vec3 lobe_F_F82_tint(double cosI, Vec3 f0, Vec3 tint) {
    return per_channel([&](int i) {
        return schlick_with_dip(cosI, f0[i], lobe_F_Schlick(1.0 / 7, f0[i]) * (1 - tint[i]));
    });
}

// F(c)/F(1) - 1 of a dielectric short of total reflection. The amplitudes are r_s = (eta^2 - 1)/(c + g)^2 and
// r_p = r_s cos(i + t)/cos(i - t), so that the ratio is (1 + a)^4 (1 + (1 - d)^2)/2 with 1 + a = (1 + eta)/(c + g) and
// d = 1 - cos(i + t)/cos(i - t). Both vanish like s = sin^2(theta_i); only their leading terms cancel in the rise.
inline double dielectric_rise(double c, double eta) {
    const double g = eta_cosT(c, eta).real(), s = (1 - c) * (1 + c);
    const double a = s * (1 / (1 + c) + 1 / (eta + g)) / (c + g), d = 2 * s / (c * g + s);
    const double rise_s = a * (2 + a) * (1 + (1 + a) * (1 + a)), fall_p = d * (1 - d / 2);
    return rise_s - fall_p - rise_s * fall_p;
}

// R. Hall, Illumination and Color in Computer Generated Imagery, 1989 (Cook, Torrance 1982 interpolate likewise): the
// colour goes to white as F of a dielectric goes to 1, by (F - F(1))/(1 - F(1)), F(1) = ((eta0 - 1)/(eta0 + 1))^2.
inline Vec3 lobe_F_Hall(double cosI, Vec3 f0, double eta0) {
    const double c = clamp_cosine(cosI);
    const bool total = eta0 != 1 && eta_cosT(c, eta0).real() == 0;
    const double match = (eta0 - 1) * (eta0 - 1) / (4 * eta0);  // F(1)/(1 - F(1))
    const double white = total ? 1 : eta0 == 1 ? 0 : match * std::max(0.0, dielectric_rise(c, eta0));
    return f0 * (1 - white) + Vec3(white);
}

// r = (eta - 1)/(eta + 1) = tanh(ln(eta)/2) at normal incidence.
inline double lobe_f0(double eta) {
    const double r = std::tanh(std::log(eta) / 2);
    return r * r;
}

// |r|^2 of the complex index.
inline double lobe_f0(double eta, double k) {
    const std::complex<double> n(eta, k);
    return std::norm((n - 1.0) / (n + 1.0));
}
inline Vec3 lobe_f0(Vec3 eta, Vec3 k) {
    return per_channel([&](int i) { return lobe_f0(eta[i], k[i]); });
}

// Lazanyi, Szirmay-Kalos 2005: ((eta - 1)^2 + 4 eta (1 - c)^5 + k^2) / ((eta + 1)^2 + k^2). The part 4 eta of the
// divisor is what the metal absorbs at normal incidence: this is Schlick's curve from the metal's own F(1).
inline Vec3 lobe_F_conductor_fast(double cosI, Vec3 eta, Vec3 k) {
    return lobe_F_Schlick(cosI, lobe_f0(eta, k));
}

// The inverse of the first, for eta >= 1. f0 >= 1 has no dielectric: it is taken as the largest float below 1.
inline double lobe_eta(double f0) { return std::exp(2 * std::atanh(std::sqrt(std::clamp(f0, 0.0, 1 - 0x1p-24)))); }

// Snell's law; 0 under total internal reflection, where the cosine is imaginary.
inline double lobe_cosT(double cosI, double eta) {
    return std::min(1.0, eta_cosT(clamp_cosine(cosI), eta).real() / eta);
}

// sin(theta_c) = eta: smaller cosines are totally reflected. 0 where no angle is.
inline double lobe_cos_critical(double eta) { return eta < 1 ? std::cos(std::asin(eta)) : 0; }

// The part of a direction along the surface. N is a unit vector.
inline Vec3 tangential(Vec3 N, Vec3 V) { return N.cross(V.cross(N)); }

// The mirror keeps what V has along N and turns the rest around.
inline Vec3 lobe_reflect(Vec3 N, Vec3 V) { return N * N.dot(V) - tangential(N, V); }

// Snell's law: the part along the surface shrinks by eta, sin(theta_t) = sin(theta_i)/eta, and the light goes on behind
// the surface, against N. 0 under total internal reflection.
inline Vec3 lobe_refract(Vec3 N, Vec3 V, double eta) {
    const std::complex<double> g = eta_cosT(N.dot(V), eta);
    return g.imag() > 0 ? Vec3(0) : (tangential(N, V) + N * g.real()) / -eta;
}

LOBE_MODEL(fresnel, LOBE_FUNCTION(Vec2, lobe_F_dielectric_sp, (double cosI, double eta)),
           LOBE_FUNCTION(Vec2, lobe_T_dielectric_sp, (double cosI, double eta)),
           LOBE_FUNCTION(Vec2, lobe_F_conductor_sp, (double cosI, double eta, double k)),
           LOBE_FUNCTION(double, lobe_F_conductor, (double cosI, double eta, double k)),
           LOBE_FUNCTION(Vec3, lobe_F_conductor, (double cosI, Vec3 eta, Vec3 k)),
           LOBE_FUNCTION(Vec3, lobe_F_F82, (double cosI, Vec3 f0, Vec3 f82)),
           LOBE_FUNCTION(Vec3, lobe_F_F82_tint, (double cosI, Vec3 f0, Vec3 tint)),
           LOBE_FUNCTION(Vec3, lobe_F_Hall, (double cosI, Vec3 f0, double eta0)),
           LOBE_FUNCTION(double, lobe_f0, (double eta, double k)), LOBE_FUNCTION(Vec3, lobe_f0, (Vec3 eta, Vec3 k)),
           LOBE_FUNCTION(Vec3, lobe_reflect, (Vec3 N, Vec3 V)),
           LOBE_FUNCTION(Vec3, lobe_refract, (Vec3 N, Vec3 V, double eta)),
           LOBE_FUNCTION(double, lobe_F_dielectric, (double cosI, double eta)),
           LOBE_FUNCTION(double, lobe_T_dielectric, (double cosI, double eta)),
           LOBE_FUNCTION(Vec3, lobe_F_Schlick, (double cosI, Vec3 f0)),
           LOBE_FUNCTION(Vec3, lobe_F_Schlick, (double cosI, Vec3 f0, Vec3 f90)),
           LOBE_FUNCTION(Vec3, lobe_F_Schlick_fast, (double cosI, Vec3 f0)),
           LOBE_FUNCTION(Vec3, lobe_F_conductor_fast, (double cosI, Vec3 eta, Vec3 k)),
           LOBE_FUNCTION(double, lobe_F_Schlick, (double cosI, double f0)),
           LOBE_FUNCTION(double, lobe_F_Schlick, (double cosI, double f0, double f90)),
           LOBE_FUNCTION(double, lobe_f0, (double eta)), LOBE_FUNCTION(double, lobe_eta, (double f0)),
           LOBE_FUNCTION(double, lobe_cosT, (double cosI, double eta)),
           LOBE_FUNCTION(double, lobe_cos_critical, (double eta)))

}  // namespace lobe
