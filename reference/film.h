// Sums of samples, from which come the mean, the variance of that mean, and the decision where to stop.
#pragma once

#include "registry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace lobe {

// Pixels that share what their paths find: a few, and apart, so that noise does not look like large grains.
struct Companions {
    static constexpr int SIDE = 4, APART = 2, COUNT = SIDE * SIDE, BLOCK = SIDE * APART;

    static Companions of(int x, int y, int width, int height) {
        Companions all;
        const int x0 = x - x % BLOCK + x % APART, y0 = y - y % BLOCK + y % APART;
        for (int j = y0; j < std::min(y0 + BLOCK, height); j += APART)
            for (int i = x0; i < std::min(x0 + BLOCK, width); i += APART) all.x[all.count] = i, all.y[all.count++] = j;
        return all;
    }
    static Companions none(int x, int y) { return {1, {x}, {y}}; }

    bool begins(int i, int j) const { return x[0] == i && y[0] == j; }

    int count = 0, x[COUNT], y[COUNT];
};

// The samples of a pixel belong to two halves, each with a sequence of its own. Samples of one sequence depend on each
// other, which makes their mean better than their scatter tells; the halves are independent, and a quarter of the
// squared difference of their means is an unbiased estimate of the variance of the mean of both (Rousselle, Knaus,
// Zwicker, Adaptive rendering with non-local means filtering, 2012, section 4). With one degree of freedom: take means
// over pixels. Both count alike, however many samples each has: these numbers may have to do with what the other has
// found (shares.h), and a mean that is weighted by them would have a bias. Then the halves are not quite independent: where
// noise is rare and large, the variance is told a little too small, on one such scene by 1.3 %.
class Film {
public:
    static constexpr int TILE = 16, HALVES = 2;
    static_assert(TILE % Companions::BLOCK == 0);
    using Sums = std::vector<Vec3>;  // of the halves of each pixel

    Film(int width, int height)
        : width(width), height(height), tiles_x((width + TILE - 1) / TILE), tiles_y((height + TILE - 1) / TILE),
          sums_(std::size_t(width) * height * HALVES, Vec3(0)), counts_(sums_.size(), 0),
          finished_(std::size_t(tiles_x) * tiles_y, 0) {}

    void add(std::size_t pixel, int half, const Vec3& radiance) {
        sums_[HALVES * pixel + half] += radiance;
        ++counts_[HALVES * pixel + half];
    }

    void finish(std::size_t tile) { finished_[tile] = 1; }
    bool finished(std::size_t tile) const { return finished_[tile]; }
    int samples(std::size_t pixel, int half) const { return counts_[HALVES * pixel + half]; }
    int samples(std::size_t pixel) const { return samples(pixel, 0) + samples(pixel, 1); }
    std::size_t pixels() const { return counts_.size() / HALVES; }
    std::size_t tiles() const { return finished_.size(); }

    Vec3 mean(std::size_t pixel) const { return mean(sums_, pixel); }
    // Of what has been summed up beside.
    Vec3 mean(const Sums& sums, std::size_t pixel) const {
        const auto of_half = [&](int half) { return sums[HALVES * pixel + half] / std::max(samples(pixel, half), 1); };
        const Vec3 sum = of_half(0) + of_half(1);
        return samples(pixel, 0) > 0 && samples(pixel, 1) > 0 ? sum / 2 : sum;
    }
    // Half of the halves' difference: as large as the error of the mean, and as much alike that of other pixels, but of
    // any sign. 0 before there are two samples.
    Vec3 deviation(std::size_t pixel) const {
        const int n0 = samples(pixel, 0), n1 = samples(pixel, 1);
        if (n0 == 0 || n1 == 0) return Vec3(0);
        return (sums_[HALVES * pixel] / n0 - sums_[HALVES * pixel + 1] / n1) / 2;
    }
    Vec3 variance(std::size_t pixel) const {
        const Vec3 d = deviation(pixel);
        return d * d;
    }

    std::size_t tile(int x, int y) const { return std::size_t(y / TILE) * tiles_x + x / TILE; }
    std::size_t pixel(int x, int y) const { return std::size_t(y) * width + x; }

    // Calls visit(x, y) for the pixels of a tile.
    template <class Visit> void for_pixels(std::size_t tile, const Visit& visit) const {
        const int x0 = static_cast<int>(tile % tiles_x) * TILE, y0 = static_cast<int>(tile / tiles_x) * TILE;
        for (int y = y0; y < std::min(y0 + TILE, height); ++y)
            for (int x = x0; x < std::min(x0 + TILE, width); ++x) visit(x, y);
    }

    // Sums over the channels of a tile's pixels.
    struct Summary {
        double mean = 0, variance = 0;
        std::size_t values = 0;
    };
    Summary summary(std::size_t t) const {
        Summary s;
        for_pixels(t, [&](int x, int y) {
            s.mean += mean(pixel(x, y)).dot(Vec3(1));
            s.variance += variance(pixel(x, y)).dot(Vec3(1));
            s.values += 3;
        });
        return s;
    }
    Summary summary() const {
        Summary all;
        for (std::size_t t = 0; t < tiles(); ++t) {
            const Summary s = summary(t);
            all.mean += s.mean, all.variance += s.variance, all.values += s.values;
        }
        return all;
    }
    // Root mean square standard error over the mean; infinite before there are two samples everywhere.
    double error() const {
        const Summary s = summary();
        const bool known = *std::min_element(counts_.begin(), counts_.end()) > 0;
        if (!known) return std::numeric_limits<double>::infinity();
        return s.mean > 0 ? std::sqrt(s.variance / s.values) / (s.mean / s.values) : 0;
    }

    template <class Visit> void for_state(const Visit& visit) { each(*this, visit); }
    template <class Visit> void for_state(const Visit& visit) const { each(*this, visit); }

    const int width, height, tiles_x, tiles_y;

private:
    template <class Self, class Visit> static void each(Self& self, const Visit& visit) {
        visit(self.sums_.data(), self.sums_.size());
        visit(self.counts_.data(), self.counts_.size());
        visit(self.finished_.data(), self.finished_.size());
    }

    Sums sums_;
    std::vector<std::int32_t> counts_;    // of the halves of each pixel
    std::vector<std::uint8_t> finished_;  // of the tiles
};

}  // namespace lobe
