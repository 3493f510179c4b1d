#include "fingerprint.h"
#include "light.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace lobe {
namespace {

constexpr double PI = std::numbers::pi;

void check(const std::vector<float>& pixels, int width) {
    double sum = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (!(pixels[i] >= 0 && std::isfinite(pixels[i])))
            throw std::invalid_argument("environment: expected finite numbers of at least 0, got " +
                                        std::to_string(pixels[i]) + " at row " + std::to_string(i / 3 / width) +
                                        ", column " + std::to_string(i / 3 % width));
        sum += pixels[i];
    }
    if (sum == 0) throw std::invalid_argument("environment: all of it is black, so that it gives no light");
}

// The place of u under a density that goes linearly from one value to another.
double between(double from, double to, double u) {
    return u * (from + to) / (from + std::sqrt(from * from * (1 - u) + to * to * u));
}

}  // namespace

Environment::Environment(std::vector<float> pixels, int width, int height, double rotation_degrees)
    : pixels_(std::move(pixels)), width_(width), height_(height), cos_(std::cos(rotation_degrees * PI / 180)),
      sin_(std::sin(rotation_degrees * PI / 180)) {
    check(pixels_, width_);
    std::vector<double> light, above(width_ + 1), below(width_ + 1), sums;
    const auto read = [&](int y, std::vector<double>& row) {
        for (int x = 0; x <= width_; ++x) row[x] = luminance(at(x - 1, y));
    };
    read(-1, below);
    for (int y = -1; y < height_; ++y) {
        std::swap(above, below);
        read(y + 1, below);
        const double begin = angle(y), end = angle(y + 1);
        mean_sin_.push_back((std::cos(begin) - std::cos(end)) / (end - begin));
        const double solid_angle = (end - begin) * mean_sin_.back() * 2 * PI / width_;
        for (int x = 0; x < width_; ++x)
            light.push_back((above[x] + above[x + 1] + below[x] + below[x + 1]) / 4 * solid_angle);
    }
    cut_into_tiles(light);
    columns_.emplace(std::move(light), width_, sums);
    total_ = std::accumulate(sums.begin(), sums.end(), 0.0);
}

// Each cell between four centres is of the tile, and of the part of it, in which it begins.
void Environment::cut_into_tiles(const std::vector<double>& light) {
    std::vector<double> rows(std::size_t(COLUMNS) * (height_ + 1)), sums;
    parts_.assign(PARTS, 0), directions_.assign(PARTS, Vec3(0));
    const auto half = [](int i, int first, int end) { return i * 2 >= first + end; };
    for (int y = 0; y <= height_; ++y)
        for (int x = 0; x < width_; ++x) {
            const double l = light[std::size_t(y) * width_ + x];
            const int at = tile(x - 1, y - 1), row = at / COLUMNS, column = at % COLUMNS;
            const bool lower = half(y, first_y(row), first_y(row + 1));
            const bool right = half(x, first_x(column), first_x(column + 1));
            const int part = at * PER_TILE + ACROSS * lower + right;
            const Vec2 polar = on_circle((angle(y - 1) + angle(y)) / (4 * PI));
            const Vec2 around = on_circle(double(x) / width_ + 1);
            directions_[part] += turned({-polar.y * around.y, polar.x, polar.y * around.x}) * l;
            parts_[part] += l, tiles_[at] += l;
            rows[std::size_t(column) * (height_ + 1) + y] += l;
        }
    for (Vec3& d : directions_) d.normalize();
    const double all = std::accumulate(tiles_.begin(), tiles_.end(), 0.0);
    for (double& t : tiles_) t /= all;
    rows_.emplace(std::move(rows), height_ + 1, sums);
    all_ = aim([](const Vec3&) { return 1.0; });
}

int Environment::tile(int x, int y) const {
    if (x == width_ - 1) x = -1;  // around
    const int column = (COLUMNS * (x + 2) - 1) / width_, row = (ROWS * (y + 2) - 1) / (height_ + 1);
    return row * COLUMNS + column;
}

double Environment::preference(const Aim& aim, int tile) const {
    const int row = tile / COLUMNS, column = tile % COLUMNS;
    const auto step = [](const auto& up_to, int i) { return double(up_to[i]) - (i > 0 ? double(up_to[i - 1]) : 0); };
    return tiles_[tile] > 0 ? step(aim.rows, row) * step(aim.columns[row], column) / tiles_[tile] : 0;
}

Environment::Choice::Choice(std::vector<double> weights, int count, std::vector<double>& sums)
    : count_(count), steps_((count + STRIDE - 1) / STRIDE), up_to_(std::move(weights)) {
    const std::size_t rows = up_to_.size() / count;
    sums.assign(rows, 0);
    guide_.reserve(rows * (steps_ + 1));
    for (std::size_t row = 0; row < rows; ++row) {
        double *const begin = up_to_.data() + row * count, *const end = begin + count;
        for (double* p = begin; p != end; ++p) *p = sums[row] += *p;
        if (sums[row] > 0)
            for (double* p = begin; p != end; ++p) *p /= sums[row];
        const double* p = begin;
        for (int step = 0; step <= steps_; ++step) {
            while (p != end - 1 && *p <= double(step) / steps_) ++p;
            guide_.push_back(static_cast<std::uint32_t>(p - begin));
        }
    }
    up_to_.resize(up_to_.size() + FEW);  // read beyond the last row, and ignored
}

int Environment::Choice::draw(int row, int first_one, int end, double& u) const {
    const double from = before(row, first_one), to = before(row, end);
    u = std::min(from + u * (to - from), 1 - 0x1p-53);
    const double* const up_to = up_to_.data() + std::size_t(row) * count_;
    const std::uint32_t* const guide = guide_.data() + std::size_t(row) * (steps_ + 1) + static_cast<int>(u * steps_);
    const double* const first = up_to + guide[0];
    const std::uint32_t reach = guide[1] - guide[0];
    int chosen = static_cast<int>(guide[0]);
    if (reach <= FEW)  // without a branch, so that the processor goes on to the next draw while memory answers
        for (std::uint32_t k = 0; k < FEW; ++k) chosen += (k < reach) & (first[k] <= u);
    else
        chosen = static_cast<int>(std::upper_bound(first, first + reach, u) - up_to);
    chosen = std::clamp(chosen, first_one, end - 1);
    u = std::clamp((u - before(row, chosen)) / (up_to[chosen] - before(row, chosen)), 0.0, 1 - 0x1p-53);
    return chosen;
}

double Environment::angle(int y) const { return std::clamp(y + 0.5, 0.0, double(height_)) * PI / height_; }

Vec3 Environment::turned(const Vec3& v) const { return {cos_ * v.x + sin_ * v.z, v.y, -sin_ * v.x + cos_ * v.z}; }

Vec3 Environment::at(int x, int y) const {
    const int row = std::clamp(y, 0, height_ - 1), column = x < 0 ? x + width_ : x >= width_ ? x - width_ : x;
    const float* p = pixel(column, row);
    return {p[0], p[1], p[2]};
}

Environment::Place Environment::place(const Vec3& L) const {
    const double x = cos_ * L.x - sin_ * L.z, z = sin_ * L.x + cos_ * L.z;
    const double u = (0.5 + std::atan2(x, -z) / (2 * PI)) * width_ - 0.5;
    const double v = std::acos(std::clamp(L.y, -1.0, 1.0)) / PI * height_ - 0.5;
    const int column = std::clamp(static_cast<int>(std::floor(u)), -1, width_ - 1);
    const int row = std::clamp(static_cast<int>(std::floor(v)), -1, height_ - 1);
    return {column, row, u - column, v - row, std::sqrt(x * x + z * z)};
}

// Proportional to the luminance, but that `sample` takes the sine for constant between two rows.
double Environment::density(const Place& p, const Vec3& radiance) const {
    return luminance(radiance) * mean_sin_[p.y + 1] / (std::max(p.sin, 1e-12) * total_);
}

Environment::Seen Environment::seen(const Vec3& L) const {
    const Place p = place(L);
    const Vec3 above = at(p.x, p.y) * (1 - p.u) + at(p.x + 1, p.y) * p.u;
    const Vec3 below = at(p.x, p.y + 1) * (1 - p.u) + at(p.x + 1, p.y + 1) * p.u;
    const Vec3 radiance = above * (1 - p.v) + below * p.v;
    return {radiance, density(p, radiance), tile(p.x, p.y)};
}

// Of running sums, the first beyond u, which becomes the place within.
template <std::size_t N> int first_beyond(const std::array<float, N>& up_to, double& u) {
    int i = 0;
    for (std::size_t k = 0; k + 1 < N; ++k) i += up_to[k] <= u;
    const double before = i > 0 ? up_to[i - 1] : 0;
    u = std::clamp((u - before) / (up_to[i] - before), 0.0, 1 - 0x1p-53);
    return i;
}

// Four centres by the light between them.
Environment::Cell Environment::cell(Vec2 u, const Aim& aim) const {
    const int row = first_beyond(aim.rows, u.y), column = first_beyond(aim.columns[row], u.x);
    const int line = rows_->draw(column, first_y(row), first_y(row + 1), u.y);
    const int x = columns_->draw(line, first_x(column), first_x(column + 1), u.x) - 1, y = line - 1;
    for (const int l : {y, y + 1}) __builtin_prefetch(pixel(std::max(x, 0), std::clamp(l, 0, height_ - 1)));
    return {x, y, u, row * COLUMNS + column};
}

// There a place by its luminance, which is bilinear.
LightSample Environment::sample(const Cell& cell, double preference) const {
    const int x = cell.x, y = cell.y;
    const Vec3 a = at(x, y), b = at(x + 1, y), c = at(x, y + 1), d = at(x + 1, y + 1);
    const double v = between(luminance(a + b), luminance(c + d), cell.u.y);
    const Vec3 left = a * (1 - v) + c * v, right = b * (1 - v) + d * v;
    const double t = between(luminance(left), luminance(right), cell.u.x);
    const Vec3 radiance = left * (1 - t) + right * t;
    const double theta = angle(y) * (1 - v) + angle(y + 1) * v;
    const Vec2 polar = on_circle(theta / (2 * PI)), around = on_circle((x + 0.5 + t) / width_ + 1);  // from +z on
    const double sin = polar.y, px = -sin * around.y, pz = sin * around.x;
    const double p = density(Place{x, y, t, v, sin}, radiance) * preference;
    if (!(p > 0)) return {Vec3(0), 0, Vec3(0), 0};
    return {turned({px, polar.x, pz}), std::numeric_limits<double>::infinity(), radiance / p, p};
}

std::uint64_t Environment::fingerprint() const {
    return Fingerprint().add(pixels_).add(width_).add(height_).add(cos_).add(sin_).value();
}

}  // namespace lobe
