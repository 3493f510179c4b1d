// Directions from which light comes through glass or off mirrors.
#pragma once

#include "scene.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace lobe {

// No light can be aimed at through glass: a path finds it by chance alone. So photons go the other way, from lights that
// have an extent by ideal mirrors and glass to where lobes are, and paths draw some of their directions from where the
// photons around them came from. Jensen, Importance driven path tracing using the photon map, EGWR 1995. The photons
// only say where to look: whatever they are, a picture is noisier or not, but the same.
class Guide {
public:
    struct Photon {
        Vec3 position, L;  // L is unit, towards where it came from
        double power;
    };

    // Photons that lie together. Their directions are counted in a grid of rectangles in a plane, onto which the sphere
    // is projected so that areas are kept: Lambert 1772.
    class Cell {
    public:
        // Lobes carry on about as much light as `others`, an irradiance, besides what the photons tell of.
        Cell(const Photon* photons, int count, double others);

        bool holds(const Vec3& position) const;
        // The share of directions that should be drawn here, below 1; 0 where that gains nothing.
        double chance() const { return chance_; }
        // Null at the brink of the sphere.
        Vec3 sample(Vec2 u) const;
        double density(const Vec3& L) const;

    private:
        static constexpr int SIDE = 16;

        double bound(const Photon* photons, int count);
        void weigh(double irradiance, double others);
        void turn(const Photon* photons, int count);
        void spread(const Photon* photons, const std::vector<Vec2>& places);
        Vec2 project(const Vec3& L) const;
        std::vector<Vec2> project(const Photon* photons, int count) const;

        Vec3 low_, high_;  // of the positions
        double chance_ = 0;
        Basis frame_{Vec3(0, 0, 1)};  // z is the middle of the plane, x where the photons reach far
        Vec2 corner_, step_;
        std::array<double, SIDE> rows_{};
        std::array<std::array<double, SIDE>, SIDE> bins_{};
    };

    Guide() = default;
    Guide(const Scene& scene, int depth, std::size_t photons);

    // Bytes that guides of so many photons, a power of 2, and of each fourth part as many take together, while the
    // largest is made.
    static constexpr std::size_t most_bytes(std::size_t photons) {
        const std::size_t cells = photons / CROWD;
        return photons * sizeof(Photon) + cells * (sizeof(Crowd) + 4 * (sizeof(std::optional<Cell>) + 2 * sizeof(Node)) / 3);
    }

    // Null where hardly any photon has come.
    const Cell* at(const Vec3& position) const;

private:
    static constexpr int LEAF = -1, NOTHING = -2, CROWD = 128;
    struct Node {
        int axis;  // along which photons are on either side, LEAF, or NOTHING below that a path should know
        double at;
        std::uint32_t children[2];  // of a leaf the cell
    };
    using Crowd = std::pair<Photon*, int>;

    std::uint32_t divide(Photon* begin, Photon* end, std::vector<Crowd>& crowds);
    void prune();

    std::vector<Node> nodes_;
    std::vector<std::optional<Cell>> cells_;  // all are there
};

}  // namespace lobe
