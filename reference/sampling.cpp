#include "sampling.h"

namespace lobe {
namespace {

// Whole numbers have the same bits on every processor. The sanitizers cannot start with functions that are chosen when
// the program is loaded.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
#define LOBE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define LOBE_WIDE
#endif

// Sample::pair, lane by lane.
LOBE_WIDE void draw_lanes(std::uint32_t index, const Samples::Lanes& seeds, Samples::Points& points) {
    for (std::uint32_t i = 0; i < Samples::LANES; ++i) {
        const std::uint32_t x = reversed_bits(scrambled_upwards(index, seeds.order[i]));
        points.x[i] = reversed_bits(scrambled_upwards(x, seeds.x[i]));
        points.y[i] = reversed_bits(scrambled_upwards(times_pascal(x), seeds.y[i]));
    }
}

}  // namespace

void Samples::draw() {
    if (drawn_ == seeded_.size()) {
        Lanes& lanes = seeded_.emplace_back();
        for (std::uint32_t i = 0; i < LANES; ++i) {
            const Sample::Seeds seeds(sequence_, drawn_ * LANES + i);
            lanes.order[i] = seeds.order, lanes.x[i] = seeds.x, lanes.y[i] = seeds.y;
        }
        points_.resize(std::max(points_.size(), seeded_.size()));
    }
    draw_lanes(index_, seeded_[drawn_], points_[drawn_]);
    ++drawn_;
}

}  // namespace lobe
