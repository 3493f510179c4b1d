// Who gets the samples: pixels in proportion to their noise.
#pragma once

#include "film.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace lobe {

// The error of a picture, the root mean square over its pixels, is the least where samples go to pixels in proportion to
// the scatter of theirs (Neyman 1934). Whoever lets a pixel's own samples decide on their number is biased: it ends
// early where it happens to look even. Here a pixel is judged by its neighbours alone, and of these by the samples that
// every pixel gets in any case, so that nothing which decides on a pixel's samples depends on what they have brought, and
// their mean stays unbiased, exactly.
class Shares {
public:
    static constexpr int FIRST_LOOK = 16;  // samples that every pixel gets before any is preferred
    static constexpr int MOST = 64;        // samples a turn of the noisiest pixel: rounding included

    // Of a pixel's samples, sums of blocks that follow each other. Samples of a sequence that fills the square evenly are
    // together better than their scatter tells, so that blocks grow with the number of samples.
    static constexpr int BLOCKS = 8, SHORTEST = 2;
    using Blocks = std::array<float, BLOCKS>;

    Shares(int width, int height, bool with_companions)
        : width_(width), height_(height), with_companions_(with_companions), witnesses_(std::size_t(width) * height, Blocks{}),
          shares_(witnesses_.size(), 1.f) {}

    // The i-th sample of a pixel. Only those count that all pixels have by the next look, after so many turns.
    void witness(std::size_t pixel, int i, double value, int next_look) {
        if (i >= everyones(next_look)) return;
        Blocks& sums = witnesses_[pixel];
        const int length = block_length(i);
        if (length > SHORTEST && i == BLOCKS / 2 * length)  // the first one of longer blocks
            for (int k = 0; k < BLOCKS; ++k) sums[k] = k < BLOCKS / 2 ? sums[2 * k] + sums[2 * k + 1] : 0;
        sums[i / length] += static_cast<float>(value);
    }

    // Samples that a pixel gets in so many turns after a look.
    int samples(std::size_t pixel, int turns) const { return static_cast<int>(double(shares_[pixel]) * turns); }

    // Shares anew, until there are twice as many turns, which are a power of 2, for the pixels that take_part(x, y) and
    // have so many samples(pixel): of one each turn on an average.
    template <class TakePart, class Samples>
    void look(int turns, const TakePart& take_part, const Samples& samples) {
        const int evidence = everyones(turns), blocks = evidence / block_length(evidence - 1);
        std::vector<float> noise(shares_.size());
        double sum = 0;
        std::size_t count = 0;
        for_pixels([&](int x, int y, std::size_t pixel) {
            if (!take_part(x, y)) return;
            const auto [variance, neighbours] =
                around(x, y, [&](std::size_t p) { return variance_of(witnesses_[p], blocks); });
            noise[pixel] = neighbours > 0 ? static_cast<float>(std::sqrt(variance / neighbours)) : 1.f;
            sum += noise[pixel], ++count;
        });
        for_pixels([&](int x, int y, std::size_t pixel) {
            // The mean noise, but for those on which the pixel or one of its companions has had an influence. In their
            // place stand the companions, since what their neighbours tell of them is none of their own doing.
            const Companions companions = companions_of(x, y);
            const auto [near, area] = within(companions.around(), [&](std::size_t p) { return noise[p]; });
            double theirs = 0;
            for (int i = 0; i < companions.count; ++i)
                theirs += noise[std::size_t(companions.y[i]) * width_ + companions.x[i]] / companions.count;
            const double others = std::max(sum - near + theirs * area, 0.0) / double(count);
            const double relative = others > 0 ? std::min(noise[pixel] / others, double(MOST)) : 1;
            const int had = samples(pixel);
            shares_[pixel] = float(even(had + (LEAST + (1 - LEAST) * relative) * turns) - had) / float(turns);
        });
    }

    template <class Visit> void for_state(const Visit& visit) { each(*this, visit); }
    template <class Visit> void for_state(const Visit& visit) const { each(*this, visit); }

private:
    static constexpr double LEAST = 0.25;  // samples a turn, whatever the noise

    // Of the blocks of which one holds the i-th sample.
    static int block_length(int i) {
        int length = SHORTEST;
        while (i >= BLOCKS * length) length *= 2;
        return length;
    }
    // Of the first `count`, but for a factor.
    static double variance_of(const Blocks& sums, int count) {
        double sum = 0, squares = 0;
        for (int k = 0; k < count; ++k) sum += sums[k];
        for (int k = 0; k < count; ++k) squares += (sums[k] - sum / count) * (sums[k] - sum / count);
        return squares;
    }

    // Samples that the quietest pixel has got by a look.
    static int everyones(int turns) {
        int least = FIRST_LOOK;
        for (int look = FIRST_LOOK; look < turns; look *= 2) least = even(least + LEAST * look);
        return least;
    }
    // The number with three binary digits that is nearest: sequences that fill the square evenly do so best when stopped
    // at such ones.
    static int even(double samples) {
        const int n = static_cast<int>(samples), step = std::max(1, static_cast<int>(std::bit_floor(unsigned(n))) / 4);
        return (n + step / 2) / step * step;
    }

    template <class Visit> void for_pixels(const Visit& visit) const {
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) visit(x, y, std::size_t(y) * width_ + x);
    }
    // The sum of value(pixel) over a part of the picture, and how many pixels there are.
    template <class Value> std::pair<double, int> within(const Box& box, const Value& value) const {
        double sum = 0;
        int count = 0;
        for (int j = std::max(box.y0, 0); j <= std::min(box.y1, height_ - 1); ++j)
            for (int i = std::max(box.x0, 0); i <= std::min(box.x1, width_ - 1); ++i)
                sum += value(std::size_t(j) * width_ + i), ++count;
        return {sum, count};
    }
    // The same over the pixel's neighbours, without itself.
    template <class Value> std::pair<double, int> around(int x, int y, const Value& value) const {
        const std::size_t itself = std::size_t(y) * width_ + x;
        const auto [sum, count] = within({x - 1, y - 1, x + 1, y + 1},
                                         [&](std::size_t p) { return p == itself ? 0 : value(p); });
        return {sum, count - 1};
    }

    template <class Self, class Visit> static void each(Self& self, const Visit& visit) {
        visit(self.witnesses_.data(), self.witnesses_.size());
        visit(self.shares_.data(), self.shares_.size());
    }

    Companions companions_of(int x, int y) const {
        return with_companions_ ? Companions::of(x, y, width_, height_) : Companions::none(x, y);
    }

    int width_, height_;
    bool with_companions_;
    std::vector<Blocks> witnesses_;
    std::vector<float> shares_;
};

}  // namespace lobe
