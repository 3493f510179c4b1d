// Lights: how much of them arrives at a point, and how directions towards them are drawn.
#pragma once

#include "sampling.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

namespace lobe {

constexpr double NO_EXTENT = std::numeric_limits<double>::infinity();  // density of the one direction to a point

// Rays start this far above a surface, in units of the shape's reach: Embree's triangles are rounded to 2^-24 of it, and
// its intersection adds a few roundings to that. Those to a light with an extent, or to another surface, end as far
// before it, and by so much of their length.
constexpr double SHADOW_OFFSET = 0x1p-20;

// What reaches a point, before shadows and before the cosine.
struct Incidence {
    Vec3 L;           // unit, towards the light
    Vec3 irradiance;  // on a surface that faces the light
    double distance;
};

// A direction towards a light, drawn at random.
struct LightSample {
    Vec3 L;           // unit
    double distance;  // up to which nothing else may stand in the way
    Vec3 estimate;    // radiance / density, of a light without extent its irradiance; null where the light is not seen
    double density;   // 1/sr
};

// Each light tells of a point
//   importance  a number near the irradiance that it gives a surface facing it, 0 only where it gives none
//   sample      a direction for a point u of the unit square
//   density     that `sample` draws L, which leads to the light, in 1/sr; of an environment, `seen` gives it

// Lights without extent: their irradiance is known in closed form.
struct Light {
    bool at_infinity;
    Vec3 place;  // unit direction towards a directional light, position of a point light
    Vec3 rgb;    // irradiance of a directional light, intensity of a point light

    Incidence at(const Vec3& point) const {
        if (at_infinity) return {place, rgb, std::numeric_limits<double>::infinity()};
        const Vec3 to_light = place - point;
        const double squared = to_light.length2(), distance = std::sqrt(squared);
        return {to_light / distance, rgb / squared, distance};
    }

    double importance(const Vec3& point, const Vec3& N) const {
        const Incidence i = at(point);
        return luminance(i.irradiance) * std::max(N.dot(i.L), 0.0);
    }
    LightSample sample(const Vec3& point, Vec2) const {
        const Incidence i = at(point);
        return {i.L, i.distance, i.irradiance, NO_EXTENT};
    }
    double density(const Vec3&, const Vec3&) const { return 0; }
};

// A rectangle that emits the same radiance to all directions on the side of its normal.
struct RectangleLight {
    Vec3 center;
    Basis axes;  // z is the normal
    double half_x, half_y;
    Vec3 radiance;
    double offset;  // from SHADOW_OFFSET

    double importance(const Vec3& point, const Vec3& N) const;
    LightSample sample(const Vec3& point, Vec2 u) const;
    double density(const Vec3& point, const Vec3& L) const;
};

// A sphere that emits the same radiance outwards to all directions.
struct SphereLight {
    Vec3 center;
    double radius;
    Vec3 radiance;
    double offset;

    double importance(const Vec3& point, const Vec3& N) const;
    LightSample sample(const Vec3& point, Vec2 u) const;
    double density(const Vec3& point, const Vec3& L) const;

private:
    double cap(const Vec3& to_center) const;  // 1 - cos of half the angle under which it is seen
};

// Radiance from infinitely far, a latitude-longitude picture: the first row is around +y, the middle column is -z, and
// columns go on towards +x. Bilinear between the texels' centres, as textures are read.
class Environment {
public:
    // pixels are [height, width, 3]. Throws std::invalid_argument where one is negative or not finite, or all are 0.
    Environment(std::vector<float> pixels, int width, int height, double rotation_degrees);

    double importance(const Vec3&, const Vec3&) const { return total_ / 4; }
    LightSample sample(const Vec3&, Vec2 u) const {
        const Cell c = cell(u, all_);
        return sample(c, preference(all_, c.tile));
    }

    // Tiles, by latitude and longitude. An aim says with what chance each of them is drawn from, as running sums of the
    // chances of rows, and of tiles in their row; within a tile light alone decides.
    static constexpr int ROWS = 16, COLUMNS = 32, TILES = ROWS * COLUMNS;
    struct Aim {
        std::array<float, ROWS> rows;
        std::array<std::array<float, COLUMNS>, ROWS> columns;
    };
    // By the light times weight(L), which is above 0.
    template <class Weight> Aim aim(const Weight& weight) const;
    const Aim& by_light() const { return all_; }
    // Whether its texels are small against tiles; else an aim by weights means little.
    bool fine() const { return width_ >= 4 * COLUMNS && height_ >= 4 * ROWS; }
    // The density of drawing from a tile with an aim, over that by light alone; even of by_light() it is only nearly 1.
    double preference(const Aim& aim, int tile) const;

    // What is seen towards L, the density of drawing L by light alone, and the tile.
    struct Seen {
        Vec3 radiance;
        double density;
        int tile;
    };
    Seen seen(const Vec3& L) const;

    // A sample in two steps: memory answers the first ones of several samples at a time. Its tile has been preferred.
    struct Cell {
        int x, y;
        Vec2 u;  // within
        int tile;
    };
    Cell cell(Vec2 u, const Aim& aim) const;
    LightSample sample(const Cell& cell, double preference) const;

    std::uint64_t fingerprint() const;

private:
    // Where a direction is among the centres of the texels: x and y are the one before it, or -1, and u and v, 0..1, how
    // far it is on the way to the next one.
    struct Place {
        int x, y;
        double u, v, sin;  // of its angle with +y
    };
    // Draws one of many by their weights, u in [0, 1), by the inverse of their running sum: what is near in u is near
    // among them. A table says between which to look for every few of them.
    class Choice {
    public:
        // Of rows of so many weights, each drawn from by itself; what a row sums up to comes into `sums`.
        Choice(std::vector<double> weights, int count, std::vector<double>& sums);
        // One from `first` on before `end`. u becomes the place within what was drawn.
        int draw(int row, int first, int end, double& u) const;
        // The share of the row that lies before the i-th.
        double before(int row, int i) const { return i > 0 ? up_to_[std::size_t(row) * count_ + i - 1] : 0; }

    private:
        static constexpr int STRIDE = 4;
        static constexpr std::uint32_t FEW = 8;
        int count_, steps_;
        std::vector<double> up_to_;         // the share of the row that lies up to here
        std::vector<std::uint32_t> guide_;  // the first that reaches beyond 0, 1 / steps, ...
    };

    Place place(const Vec3& L) const;
    const float* pixel(int x, int y) const { return pixels_.data() + 3 * (std::size_t(y) * width_ + x); }
    Vec3 at(int x, int y) const;
    Vec3 turned(const Vec3& v) const;  // from the picture's axes to the world's
    double density(const Place& p, const Vec3& radiance) const;
    double angle(int y) const;     // with +y at which the places of that y begin
    int tile(int x, int y) const;  // of a place
    int first_x(int column) const { return column * width_ / COLUMNS; }  // of the tiles, counted from 0
    int first_y(int row) const { return row * (height_ + 1) / ROWS; }
    void cut_into_tiles(const std::vector<double>& light);

    std::vector<float> pixels_;
    int width_, height_;
    double cos_, sin_;           // of the rotation about +y
    std::vector<double> mean_sin_;  // of the angles from each centre to the one below, from the pole on
    std::optional<Choice> columns_, rows_;  // by the light between four centres; of rows, for each column of tiles
    double total_;

    // The shares of the tiles in all light; and light in parts, two across a tile, in which weights hardly change.
    static constexpr int ACROSS = 2, PER_TILE = ACROSS * ACROSS, PARTS = TILES * PER_TILE;
    std::array<double, TILES> tiles_{};
    std::vector<Vec3> directions_;  // of the parts, tile by tile
    std::vector<double> parts_;
    Aim all_;  // by light alone
};

template <class Weight> Environment::Aim Environment::aim(const Weight& weight) const {
    constexpr double LEAST = 0x1p-18;  // of a tile that has light: sums of floats tell it from none
    std::array<double, TILES> weights{};
    for (int part = 0; part < PARTS; ++part)
        if (parts_[part] > 0) weights[part / PER_TILE] += parts_[part] * weight(directions_[part]);
    const double least = LEAST * std::accumulate(weights.begin(), weights.end(), 0.0);
    for (int tile = 0; tile < TILES; ++tile)
        if (tiles_[tile] > 0) weights[tile] += least;

    Aim aim;
    std::array<double, ROWS> rows;
    double* w = weights.data();
    for (int row = 0; row < ROWS; ++row, w += COLUMNS) {
        std::partial_sum(w, w + COLUMNS, w);
        const double sum = rows[row] = w[COLUMNS - 1];
        for (int column = 0; column < COLUMNS; ++column)
            aim.columns[row][column] = static_cast<float>(sum > 0 ? w[column] / sum : 0);
    }
    std::partial_sum(rows.begin(), rows.end(), rows.begin());
    for (int row = 0; row < ROWS; ++row) aim.rows[row] = static_cast<float>(rows[row] / rows.back());
    return aim;
}

}  // namespace lobe
