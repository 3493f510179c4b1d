// Points that fill the unit square more evenly than chance, and what carries them to directions.
#pragma once

#include "pixels.h"
#include "registry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace lobe {

// Of a render's state. Raise it with every change, here or where points become directions, that gives a path other
// samples: a film that mixes both is no longer what its seed says.
inline constexpr std::uint64_t STATE_VERSION = 12;

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
        const Seeds seeds(sequence_, k);
        const std::uint32_t reversed = scrambled_upwards(index_, seeds.order);
        // scrambled from the lowest digit of the reversed index, and so from the highest of the index: blocks stay
        // whole
        const std::uint32_t x = reversed_bits(reversed), y = times_pascal(x);
        return {fraction(reversed_bits(scrambled_upwards(x, seeds.x))),
                fraction(reversed_bits(scrambled_upwards(y, seeds.y)))};
    }

    // Of a pair's shuffle, and of the scrambling of its coordinates.
    struct Seeds {
        Seeds(std::uint64_t sequence, std::uint32_t k) {
            const std::uint64_t a = scrambled(sequence + (2 * k + 1) * GOLDEN);
            order = static_cast<std::uint32_t>(a), x = static_cast<std::uint32_t>(a >> 32);
            y = static_cast<std::uint32_t>(scrambled(sequence + (2 * k + 2) * GOLDEN));
        }
        std::uint32_t order, x, y;
    };

    // The centre of the point's cell of 2^-32.
    static double fraction(std::uint32_t x) { return (x + 0.5) * 0x1p-32; }

private:
    static constexpr std::uint64_t GOLDEN = 0x9e3779b97f4a7c15u;
    std::uint64_t sequence_;
    std::uint32_t index_;
};

// The same pairs for one sample of a sequence after another, several at once in a vector register. Seeds are kept.
class Samples {
public:
    // From now on, the samples of this sequence.
    void begin(std::uint64_t sequence) { sequence_ = sequence, seeded_.clear(); }
    // From now on, the pairs of this sample.
    void take(std::uint32_t index) { index_ = reversed_bits(index), drawn_ = 0; }
    Vec2 pair(std::uint32_t k) {
        while (drawn_ <= k / LANES) draw();
        const Points& p = points_[k / LANES];
        return {Sample::fraction(p.x[k % LANES]), Sample::fraction(p.y[k % LANES])};
    }

    static constexpr std::uint32_t LANES = 8;
    struct Lanes {
        std::uint32_t order[LANES], x[LANES], y[LANES];
    };
    struct Points {
        std::uint32_t x[LANES], y[LANES];
    };

private:
    void draw();

    std::uint64_t sequence_ = 0;
    std::uint32_t index_ = 0, drawn_ = 0;
    std::vector<Lanes> seeded_;
    std::vector<Points> points_;
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

// a[0] + a[1] x + ... + a[7] x^7, by halves, which wait for each other less than Horner's steps do.
inline double series(const double (&a)[8], double x) {
    const double x2 = x * x;
    const auto half = [&](int i) { return (a[i] + a[i + 1] * x) + (a[i + 2] + a[i + 3] * x) * x2; };
    return half(0) + half(4) * (x2 * x2);
}

// Cosine and sine of a quarter turn times r in [-1/2, 1/2]: Taylor's series, exact there to the last digits.
inline Vec2 within_eighths(double r) {
    // 1 / 2!, -1 / 4!, ... and 1 / 3!, -1 / 5!, ...
    static constexpr double COS[] = {1 / 2., -1 / 24., 1 / 720., -1 / 40320., 1 / 3628800., -1 / 479001600.,
                                     1 / 87178291200., -1 / 20922789888000.};
    static constexpr double SIN[] = {1 / 6., -1 / 120., 1 / 5040., -1 / 362880., 1 / 39916800., -1 / 6227020800.,
                                     1 / 1307674368000., -1 / 355687428096000.};
    const double x = r * (std::numbers::pi / 2), x2 = x * x;
    return {1 - x2 * series(COS, x2), x - x * x2 * series(SIN, x2)};
}

// Cosine and sine of so many turns, at least 0.
inline Vec2 on_circle(double turns) {
    const int quarters = static_cast<int>(4 * turns + 0.5);
    const Vec2 c = within_eighths(4 * turns - quarters);
    const bool crossed = quarters & 1;
    const double x = crossed ? c.y : c.x, y = crossed ? c.x : c.y;
    return {(quarters + 1) & 2 ? -x : x, quarters & 2 ? -y : y};
}

// The square onto the unit disc, keeping areas, and neighbours together. Shirley, Chiu 1997.
inline Vec2 on_disc(Vec2 u) {
    const double x = 2 * u.x - 1, y = 2 * u.y - 1;
    const bool wide = std::abs(x) > std::abs(y);
    const double r = wide ? x : y, across = wide ? y : x;
    if (r == 0) return Vec2(0);
    const Vec2 c = within_eighths(across / r / 2) * r;
    return wide ? c : Vec2(c.y, c.x);
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
