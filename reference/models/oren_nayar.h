// Oren, Nayar 1994: V-shaped grooves of Lambertian facets, sigma the standard deviation of their tilt in radians; and
// its descendant EON, whose roughness in 0..1 is neither that angle nor a microfacet width.
#pragma once

#include "core.h"

#include <numbers>

namespace lobe {

// The paper's qualitative model, f = albedo/pi (A + B max(0, cos(phi_r - phi_i)) sin(alpha) tan(beta)) with the
// constant 0.33 in A, alpha the larger of theta_i and theta_r, beta the smaller. Sine and tangent grow with theta, so
// that the larger and the smaller are taken of them; phi_r - phi_i is the angle between the planes of N and V and of N
// and L, whose normals are N x V and N x L. It is undefined along N, where tan(beta) = 0.
inline Vec3 lobe_OrenNayar_qualitative(Vec3 N, Vec3 V, Vec3 L, Vec3 albedo, double sigma) {
    const double cos_r = N.dot(V), cos_i = N.dot(L);
    if (!(cos_r > 0 && cos_i > 0)) return Vec3(0);
    const Vec3 plane_r = N.cross(V), plane_i = N.cross(L);
    const double sin_r = plane_r.length(), sin_i = plane_i.length();
    const double cos_phi = sin_r > 0 && sin_i > 0 ? plane_r.dot(plane_i) / (sin_r * sin_i) : 0;
    const double sin_alpha = std::max(sin_i, sin_r), tan_beta = std::min(sin_i / cos_i, sin_r / cos_r);
    const double sigma2 = sigma * sigma;
    const double A = 1 - 0.5 * sigma2 / (sigma2 + 0.33), B = 0.45 * sigma2 / (sigma2 + 0.09);
    return albedo / std::numbers::pi * (A + B * std::max(0.0, cos_phi) * sin_alpha * tan_beta);
}

// How the planes of N and V and of N and L, with the normals N x V and N x L, stand to each other: the cosine of
// phi_r - phi_i and its distance from -1 or 1, which is half the square of a chord. Undefined along N: cosine 0.
struct Azimuth {
    Azimuth(Vec3 N, Vec3 V, Vec3 L) {
        const Vec3 r = N.cross(V).normalized(), i = N.cross(L).normalized();
        cos = r.dot(i);
        off_plane = std::min((r - i).length2(), (r + i).length2()) / 2;
    }
    double cos, off_plane;  // off_plane = 1 - |cos|
};

// The full model, eqs. 25 to 27: direct light by C1, C2, C3, and the light from facet to facet. The paper's angles
// alpha (the larger) and beta are written as elevations a, b over the surface, 2 alpha / pi = 1 - 2 a / pi, which keep
// their digits at grazing. There the model is unbounded; and with sigma beyond 0.66 it is negative for dark surfaces,
// lit and seen at grazing from opposite sides: 0.
inline Vec3 lobe_OrenNayar(Vec3 N, Vec3 V, Vec3 L, Vec3 albedo, double sigma) {
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return Vec3(0);
    const auto elevation = [&](Vec3 X) { return std::atan2(std::max(N.dot(X), SMALLEST_COSINE), N.cross(X).length()); };
    const auto [a, b] = std::minmax({elevation(V), elevation(L)});
    const Azimuth azimuth(N, V, L);
    const double x = 2 * a / std::numbers::pi, y = 2 * b / std::numbers::pi, sigma2 = sigma * sigma;

    // sin(alpha) - (2 beta/pi)^3 = (1 - (1 - y)^3) - (1 - cos a): both tend to 1 at grazing.
    const double far_side = y * (3 - y * (3 - y)) - 2 * std::pow(std::sin(a / 2), 2);
    const double C1 = 1 - 0.5 * sigma2 / (sigma2 + 0.33), rough = sigma2 / (sigma2 + 0.09);
    const double C2 = 0.45 * rough * (azimuth.cos >= 0 ? std::cos(a) : far_side);
    const double C3 = 0.125 * rough * std::pow((1 - x) * (1 - y), 2);
    const double direct = C1 + azimuth.cos * C2 / std::tan(b) + azimuth.off_plane * C3 / std::tan((a + b) / 2);
    const double mutual = 0.17 * sigma2 / (sigma2 + 0.13) * (1 - azimuth.cos * (1 - y) * (1 - y));
    return per_channel([&](int i) {
        return std::max(0.0, albedo[i] / std::numbers::pi * (direct + albedo[i] * mutual));
    });
}

// EON: Portsmouth, Kutz, Hill, EON: A practical energy-preserving rough diffuse BRDF, JCGT 2025. Fujii's form of
// Oren-Nayar, f = A (1 + r s / t) / pi, with a lobe for the light that is reflected more than once.
struct EON {
    explicit EON(double roughness) : r(std::clamp(roughness, 0.0, 1.0)), A(1 / (1 + c1 * r)) {}

    // 1 - E of a direction, and of their mean: E = A (1 + r G/pi) with the same A that makes E(grazing) = 1, hence
    // 1 - E = A r (c1 - G/pi).
    double lost(double c1_minus_G) const { return A * r * c1_minus_G; }
    double lost_on_average() const { return lost(c1 - c2); }

    // The colour of the light reflected more than once, from the series of the bounces: each is dimmed by the albedo.
    double multiple(double albedo) const {
        return albedo * albedo * (1 - lost_on_average()) / (1 - albedo * lost_on_average());
    }

    static constexpr double pi = std::numbers::pi, c1 = 0.5 - 2 / (3 * pi), c2 = 2.0 / 3 - 28 / (15 * pi);
    double r, A;
};

// c1 - G/pi for the exact albedo, in the elevation e of the direction, G = sin(theta) (theta - sin(theta) cos(theta)) +
// 2/3 tan(theta) (1 - sin^3(theta)) - 2/3 sin(theta) and c1 = G(pi/2)/pi. Collected so that every term but the last
// vanishes by itself at grazing and nothing cancels: 1 - sin(theta) = c^2 / (1 + sin(theta)).
inline double lobe_loss_EON(double NdotX) {
    const double c = clamp_cosine(NdotX), e = std::asin(c), s = std::cos(e), complement = c * c / (1 + s);
    return ((EON::pi / 2 - 2.0 / 3) * complement + s * (e + s * c - 2.0 / 3 * c * (1 + s * s / (1 + s)))) / EON::pi;
}

// 1 + r s / t with s = V.L - NdotV NdotL = (N x V).(N x L), and t the larger cosine in front of the plane across, 1
// behind it. There s may be -1: as N.V, N.L and the part of H = V + L along the surface make up |H|^2 = 2 + 2 V.L,
// 1 + s = (NdotV^2 + NdotL^2 + |N x H|^2)/2.
inline double fujii(Vec3 N, Vec3 V, Vec3 L, double r) {
    const double v = std::max(N.dot(V), SMALLEST_COSINE), l = std::max(N.dot(L), SMALLEST_COSINE);
    const double s = N.cross(V).dot(N.cross(L));
    if (s > 0) return 1 + r * s / std::max(v, l);
    return 1 - r + r * (v * v + l * l + N.cross(lobe_H(V, L)).length2()) / 2;
}

inline Vec3 lobe_OrenNayar_EON(Vec3 N, Vec3 V, Vec3 L, Vec3 albedo, double roughness) {
    const double NdotV = N.dot(V), NdotL = N.dot(L);
    if (!(NdotV > 0 && NdotL > 0)) return Vec3(0);
    const EON model(roughness);
    const double single = model.A * fujii(N, V, L, model.r);
    // (1 - E(V)) (1 - E(L)) / (1 - mean E), with A r divided out: without roughness nothing is left of it.
    const double multiple = model.lost(lobe_loss_EON(NdotV)) * lobe_loss_EON(NdotL) / (EON::c1 - EON::c2);
    return per_channel([&](int i) { return (albedo[i] * single + model.multiple(albedo[i]) * multiple) / EON::pi; });
}

// albedo E(V) of the first bounce, and of what it lost, 1 - E(V), the part that the others bring back.
inline Vec3 lobe_albedo_EON(double NdotV, Vec3 albedo, double roughness) {
    const EON model(roughness);
    const double lost = model.lost(lobe_loss_EON(NdotV));
    return per_channel([&](int i) { return albedo[i] * (1 - lost) + model.multiple(albedo[i]) * lost; });
}

// The shader's shorter fits are held to what they stand for.
inline double lobe_loss_EON_fast(double NdotX) { return lobe_loss_EON(NdotX); }
inline Vec3 lobe_OrenNayar_EON_fast(Vec3 N, Vec3 V, Vec3 L, Vec3 albedo, double roughness) {
    return lobe_OrenNayar_EON(N, V, L, albedo, roughness);
}
inline Vec3 lobe_albedo_EON_fast(double NdotV, Vec3 albedo, double roughness) {
    return lobe_albedo_EON(NdotV, albedo, roughness);
}

// How EON is drawn (the paper's listings 2 and 3): of a linearly transformed cosine, cut at the horizon of L before it
// is transformed, and of the uniform hemisphere. The frame has V over its X axis.
struct ClippedCosine {
    ClippedCosine(Vec3 N, Vec3 T, Vec3 V, double roughness) : z(N) {
        const Vec3 along = N.cross(V).cross(N);
        x = along == Vec3(0) ? T : along.normalized();
        y = z.cross(x);
        const double r = std::clamp(roughness, 0.0, 1.0), mu = clamp_cosine(N.dot(V)), mu2 = mu * mu;
        a = 1 + 0.303392 * r - 0.518982 * r * mu + 0.111709 * r * mu2 - 0.276266 * r * r + 0.335918 * r * r * mu;
        b = (1.16407 - 1.15859 * mu - 0.150815 * r + 0.150105 * r * mu) * r / (1.43545 - mu2 * mu);
        c = 1 + 0.20013 * r - 0.506373 * r * mu + 0.261777 * r * mu2;
        d = (1.01625 * mu - 0.475392 * mu2 - 0.540852) * r / (1.0743 - 0.0725628 * mu - mu2);
        uniform = std::pow(r, 0.1) * (0.162925 - 0.372058 * mu + 0.538233 * mu2 - 0.290822 * mu2 * mu);
        // L is above the surface where w.z > -d w.x. Seen from above, that is half a disc and half an ellipse, as which
        // the cut's circle, tilted by 90 degrees less atan(d), appears.
        kept = (1 + std::cos(std::atan(d))) / 2;
    }

    Vec3 transformed(Vec3 w) const { return x * (a * w.x + b * w.z) + y * (c * w.y) + z * (d * w.x + w.z); }

    // The solution of transformed(w) = L, by Cramer's rule.
    Vec3 restored(Vec3 L) const {
        const double lx = L.dot(x), lz = L.dot(z), det = a - b * d;
        return {(lx - b * lz) / det, L.dot(y) / c, (a * lz - d * lx) / det};
    }

    // cos/pi over the kept part, and the solid angle that a linear map gives: det / |w|^3 of the inverse.
    double density(Vec3 L) const {
        const Vec3 w = restored(L);
        const double length = w.length();
        return std::max(0.0, w.z / length) / (std::numbers::pi * kept) / (c * (a - b * d) * length * length * length);
    }

    Vec3 x, y, z;
    double a, b, c, d, uniform, kept;
};

inline double lobe_pdf_EON(Vec3 N, Vec3 T, Vec3 V, Vec3 L, double roughness) {
    if (!(N.dot(V) > 0 && N.dot(L) > 0)) return 0;
    const ClippedCosine lobe(N, T, V, roughness);
    return lobe.uniform / (2 * std::numbers::pi) + (1 - lobe.uniform) * lobe.density(L);
}

// The first number chooses, and what is left of it is the radius in the disc of cosines; a point of the disc moves
// along its chord y = const into the kept part.
inline Vec3 lobe_sample_EON(Vec3 N, Vec3 T, Vec3 V, double roughness, Vec2 u) {
    const ClippedCosine lobe(N, T, V, roughness);
    const double phi = drawn_azimuth(u.y);
    if (u.x < lobe.uniform) {
        const double cos = u.x / lobe.uniform, sin = std::sqrt((1 - cos) * (1 + cos));
        return N * cos + turned(N, lobe.x, phi) * sin;
    }
    const double radius = std::sqrt((u.x - lobe.uniform) / (1 - lobe.uniform));
    const double px = radius * std::cos(phi), py = radius * std::sin(phi), chord = std::sqrt((1 - py) * (1 + py));
    const double moved = -std::lerp(chord, px, lobe.kept);  // from -chord to chord (2 kept - 1)
    const double height = std::sqrt(std::max(0.0, (chord - moved) * (chord + moved)));
    return lobe.transformed({moved, py, height}).normalized();
}

LOBE_MODEL(oren_nayar,
           LOBE_FUNCTION(Vec3, lobe_OrenNayar_qualitative, (Vec3 N, Vec3 V, Vec3 L, Vec3 albedo, double sigma)),
           LOBE_FUNCTION(Vec3, lobe_OrenNayar, (Vec3 N, Vec3 V, Vec3 L, Vec3 albedo, double sigma)),
           LOBE_FUNCTION(double, lobe_loss_EON, (double NdotX)), LOBE_FUNCTION(double, lobe_loss_EON_fast, (double NdotX)),
           LOBE_FUNCTION(Vec3, lobe_OrenNayar_EON, (Vec3 N, Vec3 V, Vec3 L, Vec3 albedo, double roughness)),
           LOBE_FUNCTION(Vec3, lobe_OrenNayar_EON_fast, (Vec3 N, Vec3 V, Vec3 L, Vec3 albedo, double roughness)),
           LOBE_FUNCTION(Vec3, lobe_albedo_EON, (double NdotV, Vec3 albedo, double roughness)),
           LOBE_FUNCTION(Vec3, lobe_albedo_EON_fast, (double NdotV, Vec3 albedo, double roughness)),
           LOBE_FUNCTION(double, lobe_pdf_EON, (Vec3 N, Vec3 T, Vec3 V, Vec3 L, double roughness)),
           LOBE_FUNCTION(Vec3, lobe_sample_EON, (Vec3 N, Vec3 T, Vec3 V, double roughness, Vec2 u)))

}  // namespace lobe
