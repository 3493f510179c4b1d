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
// the scatter of theirs (Neyman 1934). Whoever lets samples decide on their own number is biased: a pixel ends early
// where it happens to look even. Here each half of the samples (film.h) is given its number by the other half, which knows
// nothing of it, and of that one by as many samples as it gets in any case. So nothing which decides on the number of a
// half's samples depends on what they bring, if samples are independent, and the mean of each half is unbiased, and so
// is that of both. Those of a sequence are not quite: at which place of it the other half was judged has to do with them.
// Where pixels share light, they witness what they have found alone: who else takes part is decided by the other half.
class Shares {
public:
    static constexpr int FIRST_LOOK = 16;  // samples that every pixel gets before any is preferred
    static constexpr int MOST = 64;        // samples a turn of the noisiest pixel: rounding included

    // Of a half's evidence, sums of blocks that follow each other. Samples of a sequence that fills the square evenly are
    // together better than their scatter tells, so that blocks grow with the number of samples.
    static constexpr int BLOCKS = 8;
    using Blocks = std::array<float, BLOCKS>;

    Shares(int width, int height)
        : width_(width), height_(height), witnesses_(std::size_t(width) * height * Film::HALVES, Blocks{}),
          shares_(witnesses_.size(), 1.f) {}

    // The i-th sample of a pixel's half since a look; 0: since the start. Evidence doubles from look to look: what there
    // has been becomes the first half of the blocks, to which come as many samples as all pixels get in any case.
    void witness(std::size_t pixel, int half, int i, double value, int look) {
        const int had = look == 0 ? 0 : evidence(look), has = evidence(look == 0 ? FIRST_LOOK : 2 * look);
        if (i >= has - had) return;
        Blocks& sums = witnesses_[Film::HALVES * pixel + half];
        if (i == 0 && had > 0)
            for (int k = 0; k < BLOCKS; ++k) sums[k] = k < BLOCKS / 2 ? sums[2 * k] + sums[2 * k + 1] : 0;
        sums[(had + i) / (has / BLOCKS)] += static_cast<float>(value);
    }

    // Samples that a half gets in so many turns after a look: its share is that of the pixel, if both had the same.
    int samples(std::size_t pixel, int half, int turns) const {
        return static_cast<int>((double(shares_[Film::HALVES * pixel + half]) * turns + 1 - half) / Film::HALVES);
    }

    // Shares anew, until there are twice as many turns, which are a power of 2, for the pixels that take_part(x, y) and
    // whose halves have so many samples(pixel, half): of a pixel one each turn on an average.
    template <class TakePart, class Samples>
    void look(int turns, const TakePart& take_part, const Samples& samples) {
        const int least = evidence(2 * turns) - evidence(turns);
        std::vector<float> noise(shares_.size() / Film::HALVES);
        for (int half = 0; half < Film::HALVES; ++half) {
            double sum = 0;
            std::size_t count = 0;
            for_pixels([&](int x, int y, std::size_t pixel) {
                if (!take_part(x, y)) return;
                noise[pixel] = static_cast<float>(around(x, y, take_part, [&](std::size_t p) {
                    return std::sqrt(variance_of(witnesses_[Film::HALVES * p + !half]));
                }));
                sum += noise[pixel], ++count;
            });
            for_pixels([&](int x, int y, std::size_t pixel) {
                if (!take_part(x, y)) return;
                const double relative = sum > 0 ? std::min(noise[pixel] / (sum / double(count)), double(MOST)) : 1;
                const int had = samples(pixel, half),
                          more = std::max(even(had + (LEAST + (1 - LEAST) * relative) * turns / Film::HALVES) - had, least);
                shares_[Film::HALVES * pixel + half] = float(more * Film::HALVES) / float(turns);
            });
        }
    }

    template <class Visit> void for_state(const Visit& visit) { each(*this, visit); }
    template <class Visit> void for_state(const Visit& visit) const { each(*this, visit); }

private:
    static constexpr double LEAST = 0.25;  // samples a turn, whatever the noise
    static constexpr double OWN = 2;  // weight of a pixel in a row against that of either neighbour

    // Samples of each half, at a look, by which the other one is judged.
    static int evidence(int turns) { return std::max(FIRST_LOOK, static_cast<int>(LEAST * turns)) / Film::HALVES; }
    // But for a factor.
    static double variance_of(const Blocks& sums) {
        double sum = 0, squares = 0;
        for (const float s : sums) sum += s / double(BLOCKS);
        for (const float s : sums) squares += (s - sum) * (s - sum);
        return squares;
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
    // The mean of value(pixel) over a pixel and its neighbours, who know of rare noise what it may have missed.
    template <class TakePart, class Value>
    double around(int x, int y, const TakePart& take_part, const Value& value) const {
        double sum = 0, weights = 0;
        for (int j = std::max(y - 1, 0); j <= std::min(y + 1, height_ - 1); ++j)
            for (int i = std::max(x - 1, 0); i <= std::min(x + 1, width_ - 1); ++i) {
                if (!take_part(i, j)) continue;  // nobody listens to those any more
                const double weight = (i == x ? OWN : 1) * (j == y ? OWN : 1);
                sum += weight * value(std::size_t(j) * width_ + i), weights += weight;
            }
        return sum / weights;
    }

    template <class Self, class Visit> static void each(Self& self, const Visit& visit) {
        visit(self.witnesses_.data(), self.witnesses_.size());
        visit(self.shares_.data(), self.shares_.size());
    }

    int width_, height_;
    std::vector<Blocks> witnesses_;  // of the halves of each pixel
    std::vector<float> shares_;
};

}  // namespace lobe
