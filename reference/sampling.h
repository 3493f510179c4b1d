// Points that fill the unit square more evenly than chance, and what carries them to directions.
#pragma once

#include "pixels.h"
#include "registry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace lobe {

// Of a render's state. Raise it with every change, here or where points become directions, that gives a path other
// samples: a film that mixes both is no longer what its seed says.
inline constexpr std::uint64_t STATE_VERSION = 1;

// Owen's nested uniform scrambling of the binary digits, from the lowest to the highest: each digit is flipped by a
// hash of those below it. Laine, Karras 2011, with the constants of Vegdahl, Building a better LK hash, 2021.
inline std::uint32_t scrambled_upwards(std::uint32_t x, std::uint32_t seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

inline std::uint32_t reversed_bits(std::uint32_t x) {
    x = __builtin_bswap32(x);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
}

// The digits times Pascal's triangle modulo 2, upper triangular: reversed, the second coordinate of Sobol 1967. The
// matrix is the fifth Kronecker power of ((1, 1), (0, 1)), hence five steps.
inline std::uint32_t times_pascal(std::uint32_t x) {
    x ^= (x & 0xaaaaaaaau) >> 1;
    x ^= (x & 0xccccccccu) >> 2;
    x ^= (x & 0xf0f0f0f0u) >> 4;
    x ^= (x & 0xff00ff00u) >> 8;
    return x ^ (x >> 16);
}

// The points of one sample of a pixel: any number of pairs, the k-th of which is, over the samples, a (0, 2)-sequence
// of its own. Burley, Practical hash-based Owen scrambling, JCGT 2020: the sequence is Sobol's, its order is shuffled
// and its digits are scrambled from pair to pair, both after Owen, so that all lengths 2^n keep their evenness, every
// point is uniform by itself, and no pair knows of another.
class Sample {
public:
    Sample(std::uint64_t sequence, std::uint32_t index) : sequence_(sequence), index_(reversed_bits(index)) {}

    Vec2 pair(std::uint32_t k) const {
        const std::uint64_t a = scrambled(sequence_ + (2 * k + 1) * GOLDEN);
        const std::uint64_t b = scrambled(sequence_ + (2 * k + 2) * GOLDEN);
        // scrambled from the lowest digit of the reversed index, and so from the highest of the index: blocks stay
        // whole
        const std::uint32_t reversed = scrambled_upwards(index_, static_cast<std::uint32_t>(a));
        const std::uint32_t x = reversed_bits(reversed), y = times_pascal(x);
        return {fraction(scrambled_upwards(x, static_cast<std::uint32_t>(a >> 32))),
                fraction(scrambled_upwards(y, static_cast<std::uint32_t>(b)))};
    }

private:
    // The centre of the point's cell of 2^-32.
    static double fraction(std::uint32_t x) { return (reversed_bits(x) + 0.5) * 0x1p-32; }

    static constexpr std::uint64_t GOLDEN = 0x9e3779b97f4a7c15u;
    std::uint64_t sequence_;
    std::uint32_t index_;
};

// Picks one of several weights, u in [0, 1), and gives back in u what chance is left. The last positive one catches
// what rounding leaves over. -1 where all weights are 0.
inline int pick(const double* weights, int count, double& u) {
    double sum = 0;
    for (int i = 0; i < count; ++i) sum += weights[i];
    int chosen = -1;
    double left = u * sum;
    for (int i = 0; i < count; ++i) {
        if (!(weights[i] > 0)) continue;
        if (chosen >= 0) left -= weights[chosen];
        chosen = i;
        if (left < weights[i]) break;
    }
    if (chosen >= 0) u = std::clamp(left / weights[chosen], 0.0, 1 - 0x1p-32);
    return chosen;
}

// The square onto the unit disc, keeping areas, and neighbours together. Shirley, Chiu 1997.
inline Vec2 on_disc(Vec2 u) {
    const double x = 2 * u.x - 1, y = 2 * u.y - 1;
    if (x == 0 && y == 0) return Vec2(0);
    const bool wide = std::abs(x) > std::abs(y);
    const double r = wide ? x : y;
    const double phi = wide ? std::numbers::pi / 4 * (y / x) : std::numbers::pi / 2 - std::numbers::pi / 4 * (x / y);
    return Vec2(std::cos(phi), std::sin(phi)) * r;
}

// Of directions about z with the density cos / pi: the disc lifted to the sphere (Malley 1988).
inline Vec3 with_cosine(Vec2 u) {
    const Vec2 d = on_disc(u);
    return {d.x, d.y, std::sqrt(std::max(0.0, 1 - d.length2()))};
}

// Unit vectors x and y across a unit vector z. Duff et al., Building an orthonormal basis, revisited, JCGT 2017.
struct Basis {
    explicit Basis(const Vec3& z) : z(z) {
        const double sign = std::copysign(1.0, z.z), a = -1 / (sign + z.z), b = z.x * z.y * a;
        x = Vec3(1 + sign * z.x * z.x * a, sign * b, -sign * z.x);
        y = Vec3(b, sign + z.y * z.y * a, -z.y);
    }
    Basis(const Vec3& z, const Vec3& x) : x(x), y(z.cross(x)), z(z) {}

    Vec3 to_world(const Vec3& v) const { return x * v.x + y * v.y + z * v.z; }
    Vec3 to_local(const Vec3& v) const { return {x.dot(v), y.dot(v), z.dot(v)}; }

    Vec3 x, y, z;
};

inline double luminance(const Vec3& rgb) { return 0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z; }  // Rec. 709

}  // namespace lobe
