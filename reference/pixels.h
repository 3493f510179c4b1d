// How images are cut into tasks and pixels into samples.
#pragma once

#include "parallel.h"
#include "registry.h"

#include <algorithm>
#include <cstdint>

namespace lobe {

struct Tile {
    int x0, x1, y0, y1;

    // Calls visit(x, y) for its pixels, row by row.
    template <class Visit> void for_pixels(const Visit& visit) const {
        for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x) visit(x, y);
    }
};

template <class Body> void for_tiles(int width, int height, const Body& body) {
    constexpr int TILE = 16;
    const int across = (width + TILE - 1) / TILE, down = (height + TILE - 1) / TILE;
    parallel_for(std::size_t(across) * down, [&](std::size_t i) {
        const int x = static_cast<int>(i % across) * TILE, y = static_cast<int>(i / across) * TILE;
        body(Tile{x, std::min(x + TILE, width), y, std::min(y + TILE, height)});
    });
}

// Steele, Lea and Flood 2014, the finaliser of SplitMix64.
inline std::uint64_t scrambled(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

// Positions within one pixel, in [0, 1)^2: Roberts' R2 sequence with a random shift, or the centre if it is to be one.
// The arithmetic is that of 64-bit fixed point, which wraps around by itself.
class PixelSamples {
public:
    PixelSamples(std::uint64_t pixel, int count, std::uint64_t seed) : x_(HALF), y_(HALF) {
        if (count == 1) return;
        const std::uint64_t state = scrambled(seed + GOLDEN) + pixel * 2 * GOLDEN;
        x_ = scrambled(state), y_ = scrambled(state + GOLDEN);
    }
    Vec2 next() {
        const Vec2 here(fraction(x_), fraction(y_));
        x_ += STEP_X, y_ += STEP_Y;
        return here;
    }

private:
    static double fraction(std::uint64_t x) { return static_cast<double>(x >> 11) * 0x1p-53; }

    static constexpr std::uint64_t HALF = std::uint64_t(1) << 63;
    static constexpr std::uint64_t GOLDEN = 0x9e3779b97f4a7c15u;
    // 2^64 / g and 2^64 / g^2, g^3 = g + 1
    static constexpr std::uint64_t STEP_X = 0xc13fa9a902a6328fu, STEP_Y = 0x91e10da5c79e7b1cu;

    std::uint64_t x_, y_;
};

}  // namespace lobe
