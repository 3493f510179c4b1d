#include "fingerprint.h"
#include "light.h"

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

// Halves the stretch [0, 1) of u at the first one's share of both weights, and says whether u is in the second half; u
// becomes the place within its half.
bool in_second(double first, double second, double& u) {
    const double share = first / (first + second);
    const bool beyond = u >= share;
    u = std::min(beyond ? (u - share) / (1 - share) : u / share, 1 - 0x1p-53);
    return beyond;
}

// The place of u under a density that goes linearly from one value to another.
double between(double from, double to, double u) {
    return u * (from + to) / (from + std::sqrt(std::lerp(from * from, to * to, u)));
}

double sum(const std::array<float, 4>& block) { return double(block[0]) + block[1] + block[2] + block[3]; }

}  // namespace

Environment::Environment(std::vector<float> pixels, int width, int height, double rotation_degrees)
    : pixels_(std::move(pixels)), width_(width), height_(height), cos_(std::cos(rotation_degrees * PI / 180)),
      sin_(std::sin(rotation_degrees * PI / 180)) {
    check(pixels_, width_);
    std::vector<double> above(width_ + 1), below(width_ + 1);
    const auto read = [&](int y, std::vector<double>& row) {
        for (int x = 0; x <= width_; ++x) row[x] = luminance(at(x - 1, y));
    };
    read(-1, below);
    levels_.emplace_back(width_, height_ + 1);
    for (int y = -1; y < height_; ++y) {
        std::swap(above, below);
        read(y + 1, below);
        const double solid_angle = (angle(y + 1) - angle(y)) * mean_sin(y) * 2 * PI / width_;
        for (int x = 0; x < width_; ++x)
            levels_[0].at(x, y + 1) =
                static_cast<float>((above[x] + above[x + 1] + below[x] + below[x + 1]) / 4 * solid_angle);
    }
    while (levels_.back().light.size() > 1) {
        const Level& fine = levels_.back();
        Level coarse(fine.width, fine.height);
        for (int y = 0; y < fine.height; ++y)
            for (int x = 0; x < fine.width; ++x) coarse.at(x, y) = static_cast<float>(sum(fine.block(x, y)));
        levels_.push_back(std::move(coarse));
    }
    total_ = sum(levels_.back().light[0]);
}

double Environment::angle(int y) const { return std::clamp(y + 0.5, 0.0, double(height_)) * PI / height_; }

double Environment::mean_sin(int y) const {
    const double begin = angle(y), end = angle(y + 1);
    return (std::cos(begin) - std::cos(end)) / (end - begin);
}

Vec3 Environment::at(int x, int y) const {
    const int row = std::clamp(y, 0, height_ - 1), column = x < 0 ? x + width_ : x >= width_ ? x - width_ : x;
    const float* p = pixels_.data() + 3 * (std::size_t(row) * width_ + column);
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
    return luminance(radiance) * mean_sin(p.y) / (std::max(p.sin, 1e-12) * total_);
}

std::pair<Vec3, double> Environment::seen(const Vec3& L) const {
    const Place p = place(L);
    const Vec3 above = at(p.x, p.y) * (1 - p.u) + at(p.x + 1, p.y) * p.u;
    const Vec3 below = at(p.x, p.y + 1) * (1 - p.u) + at(p.x + 1, p.y + 1) * p.u;
    const Vec3 radiance = above * (1 - p.v) + below * p.v;
    return {radiance, density(p, radiance)};
}

// Four centres by the light between them, and there a place by its luminance, which is bilinear. Blocks are halved again
// and again, so that what is near in the unit square is near on the sphere: Clarberg et al., Wavelet importance
// sampling, 2005, sec. 4.
LightSample Environment::sample(const Vec3&, Vec2 u) const {
    int x = 0, y = 0;
    for (std::size_t i = levels_.size(); i-- > 0;) {
        const std::array<float, 4>& light = levels_[i].block(x, y);
        const bool below = in_second(double(light[0]) + light[1], double(light[2]) + light[3], u.y);
        const bool beside = in_second(light[2 * below], light[2 * below + 1], u.x);
        x = 2 * x + beside, y = 2 * y + below;
    }
    --x, --y;
    const Vec3 a = at(x, y), b = at(x + 1, y), c = at(x, y + 1), d = at(x + 1, y + 1);
    const double v = between(luminance(a + b), luminance(c + d), u.y);
    const Vec3 left = a * (1 - v) + c * v, right = b * (1 - v) + d * v;
    const double t = between(luminance(left), luminance(right), u.x);
    const Vec3 radiance = left * (1 - t) + right * t;
    const double theta = std::lerp(angle(y), angle(y + 1), v), phi = ((x + 0.5 + t) / width_ - 0.5) * 2 * PI;
    const double sin = std::sin(theta), px = sin * std::sin(phi), pz = -sin * std::cos(phi);
    const double p = density(Place{x, y, t, v, sin}, radiance);
    if (!(p > 0)) return {Vec3(0), 0, Vec3(0), 0};
    const Vec3 L(cos_ * px + sin_ * pz, std::cos(theta), -sin_ * px + cos_ * pz);
    return {L, std::numeric_limits<double>::infinity(), radiance / p, p};
}

std::uint64_t Environment::fingerprint() const {
    return Fingerprint().add(pixels_).add(width_).add(height_).add(cos_).add(sin_).value();
}

}  // namespace lobe
