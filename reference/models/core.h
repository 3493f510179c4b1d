// What several models share: the roughness scale, cosines of any float, and half-vector angles that do not cancel.
#pragma once

#include "../registry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lobe {

// The smallest cosine that terms divide by: 1 / (4 SMALLEST_COSINE^2) is still a float.
constexpr double SMALLEST_COSINE = 0x1p-64;
// Smaller microfacet widths are taken as this one, in D and in whole lobes. It is the float that a shader's 1e-4 is.
constexpr double SMALLEST_ALPHA = 1e-4f;

// A colour from the function of its channel, 0 to 2.
template <class F> Vec3 per_channel(F f) { return {f(0), f(1), f(2)}; }

// Rounding puts a cosine beyond 1, a normal map below 0.
inline double clamp_cosine(double c) { return std::clamp(c, 0.0, 1.0); }

// tan^2 of the angle with this cosine, which may not be 0; factored, since 1 - c^2 cancels near c = 1.
inline double tan2(double c) { return (1 - c) * (1 + c) / (c * c); }

// Burley 2012, section 5.4: the width that makes an artist's roughness look uniform.
inline double lobe_alpha(double roughness) { return roughness * roughness; }

// With theta the angle between V and L, L.H = cos(theta/2). By the half-angle identities that is
// sqrt((1 + cos theta)/2), and sin theta / (2 sin(theta/2)) = |V x L| / |V - L|, which does not cancel towards L = -V.
inline double lobe_LdotH(Vec3 V, Vec3 L) {
    const double cos_theta = V.dot(L);
    if (cos_theta >= 0) return std::sqrt((1 + std::min(cos_theta, 1.0)) / 2);
    return V.cross(L).length() / (V - L).length();
}

// V + L, whose length is 2 L.H. Where V and L nearly cancel, the sum would be the rounding of their lengths; there the
// triple product (V x L) x (V - L) = (1 - V.L) (V + L) of unit vectors has what lies across both and nothing else.
inline Vec3 lobe_H(Vec3 V, Vec3 L) {
    const double cosine = V.dot(L);
    if (cosine >= 0) return V + L;
    return V.cross(L).cross(V - L) / (1 - cosine);
}

// The sines of the elevations above the surface: distances from the plane across N.
inline Vec2 lobe_cosines(Vec3 N, Vec3 V, Vec3 L, Vec3) { return {N.dot(V), N.dot(L)}; }

// With delta the angle between N and H, the chords of the unit circle give |n - h| = 2 sin(delta/2) and
// |n + h| = 2 cos(delta/2), hence sin^2 delta = |n - h|^2 |n + h|^2 / 4. H has any length; 0 for a null H.
inline double lobe_sin2_NH(Vec3 N, Vec3 H) {
    const Vec3 n = N.normalized(), h = H.normalized();
    if (h == Vec3(0)) return 0;
    return (n - h).length2() * (n + h).length2() / 4;
}

// The components of X along T, B = N x T and N. What lies along the surface comes from N x X, which is null for an X
// along N, where T.X would be the rounding of T: the azimuth of such a rounding means nothing.
inline Vec3 in_frame(Vec3 N, Vec3 T, Vec3 X) {
    const Vec3 across = N.cross(X);
    return {N.cross(T).dot(across), -T.dot(across), N.dot(X)};
}

inline Vec3 from_frame(Vec3 N, Vec3 T, Vec3 local) { return T * local.x + N.cross(T) * local.y + N * local.z; }

// T turned by phi towards B = N x T; and the unit vector at the angle theta from N in that azimuth.
inline Vec3 turned(Vec3 N, Vec3 T, double phi) { return T * std::cos(phi) + N.cross(T) * std::sin(phi); }
inline Vec3 tilted(Vec3 N, Vec3 T, double theta, double phi) {
    return N * std::cos(theta) + turned(N, T, phi) * std::sin(theta);
}

// The point of the unit circle at the share u of a full turn. The remainder to the nearest quarter is that of the turn,
// which is exact, and not of the angle, whose pi is rounded: quarters are exact, a small coordinate keeps its digits.
inline Vec2 lobe_circle(double u) {
    constexpr double COSINES[] = {1, 0, -1, 0}, SINES[] = {0, 1, 0, -1};  // of the quarters
    int quarters = 0;
    const double rest = 2 * std::numbers::pi * std::remquo(std::clamp(u, 0.0, 1.0), 0.25, &quarters);
    const Vec2 nearest(COSINES[quarters & 3], SINES[quarters & 3]), across(-nearest.y, nearest.x);
    return nearest * std::cos(rest) + across * std::sin(rest);
}

// Where the share u of an exponential distribution of mean 1 is passed: the cdf is 1 - exp(-x). u ends at the float
// that a shader's 0.9999999 is, 1 - 2^-23.
inline double lobe_quantile_exponential(double u) { return -std::log1p(-std::clamp<double>(u, 0, 0.9999999f)); }

// The angle, up to a right one, of which the tangent of the half is given.
inline double lobe_angle_of_half(double tanHalf) { return 2 * std::atan(std::clamp(tanHalf, 0.0, 1.0)); }

// Where the first number of a sampler turns its draw to.
inline double drawn_azimuth(double u) { return 2 * std::numbers::pi * u; }

// The angle t at which the share u of a density proportional to cos^exponent(t), about its axis, is passed: the cdf is
// 1 - cos^(exponent + 1)(t), and tan^2 = 1/cos^2 - 1.
inline double drawn_angle_of_power(double u, double exponent) {
    return std::atan(std::sqrt(std::expm1(-2 * std::log1p(-u) / (exponent + 1))));
}

// The density (1/sr) of L, mirrored from V at a facet that is drawn with the density p(H): a mirror that turns by an
// angle turns the light by twice that, which widens solid angles 4 V.H times (Walter et al. 2007, eq. 14). 0 for a V,
// and for a half vector, that is not above the surface.
template <class P> double mirrored_density(Vec3 N, Vec3 V, Vec3 L, P p) {
    const Vec3 H = lobe_H(V, L);
    if (!(N.dot(V) > 0 && N.dot(H) > 0)) return 0;
    return p(H.normalized()) / (4 * std::max(lobe_LdotH(V, L), SMALLEST_COSINE));
}

LOBE_MODEL(core, LOBE_FUNCTION(double, lobe_alpha, (double roughness)),
           LOBE_FUNCTION(Vec2, lobe_circle, (double u)), LOBE_FUNCTION(double, lobe_quantile_exponential, (double u)),
           LOBE_FUNCTION(double, lobe_angle_of_half, (double tanHalf)),
           LOBE_FUNCTION(Vec3, lobe_H, (Vec3 V, Vec3 L)),
           LOBE_FUNCTION(Vec2, lobe_cosines, (Vec3 N, Vec3 V, Vec3 L, Vec3 H)),
           LOBE_FUNCTION(double, lobe_LdotH, (Vec3 V, Vec3 L)), LOBE_FUNCTION(double, lobe_sin2_NH, (Vec3 N, Vec3 H)))

}  // namespace lobe
