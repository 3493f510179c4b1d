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

// The mean over a texel of what is bilinear between centres, in one direction: 1/8, 6/8, 1/8.
double blurred(double before, double here, double after) { return (before + 6 * here + after) / 8; }

// Running sums of the weights, scaled to end in 1; the total.
template <class Weight> double accumulate(float* sums, int count, Weight weight) {
    double total = 0;
    for (int i = 0; i < count; ++i) total += weight(i);
    double sum = 0;
    for (int i = 0; i < count; ++i) sums[i] = static_cast<float>((sum += weight(i)) / (total > 0 ? total : 1));
    sums[count - 1] = 1;
    return total;
}

// The first of the running sums beyond u; u becomes the place between it and the one before, 0..1.
int find(const float* sums, int count, double& u) {
    const int i = static_cast<int>(std::min(std::upper_bound(sums, sums + count, static_cast<float>(u)) - sums,
                                            std::ptrdiff_t(count - 1)));
    const double before = i > 0 ? sums[i - 1] : 0, width = sums[i] - before;
    u = width > 0 ? std::clamp((u - before) / width, 0.0, 1.0) : 0.5;
    return i;
}

double share(const float* sums, int i) { return i > 0 ? double(sums[i]) - sums[i - 1] : sums[0]; }

}  // namespace

Environment::Environment(std::vector<float> pixels, int width, int height, double rotation_degrees)
    : pixels_(std::move(pixels)), width_(width), height_(height), cos_(std::cos(rotation_degrees * PI / 180)),
      sin_(std::sin(rotation_degrees * PI / 180)), rows_(height), columns_(pixels_.size() / 3) {
    check(pixels_, width_);
    for (int y = 0; y <= height_; ++y) height_of_.push_back(std::cos(PI * y / height_));
    std::vector<double> light(columns_.size()), of_row(height_);
    for (int y = 0; y < height_; ++y)
        for (int x = 0; x < width_; ++x) light[std::size_t(y) * width_ + x] = luminance(at(x, y));
    const auto of = [&](int x, int y) {
        return light[std::size_t(std::clamp(y, 0, height_ - 1)) * width_ + (x + width_) % width_];
    };
    const auto across = [&](int x, int y) { return blurred(of(x - 1, y), of(x, y), of(x + 1, y)); };
    for (int y = 0; y < height_; ++y)
        of_row[y] = (height_of_[y] - height_of_[y + 1]) *
                    accumulate(columns_.data() + std::size_t(y) * width_, width_, [&](int x) {
                        return blurred(across(x, y - 1), across(x, y), across(x, y + 1));
                    });
    mean_ = accumulate(rows_.data(), height_, [&](int y) { return of_row[y]; }) * PI / (2.0 * width_);
}

Vec3 Environment::at(int x, int y) const {
    const int row = std::clamp(y, 0, height_ - 1), column = x < 0 ? x + width_ : x >= width_ ? x - width_ : x;
    const float* p = pixels_.data() + 3 * (std::size_t(row) * width_ + column);
    return {p[0], p[1], p[2]};
}

Environment::Texel Environment::texel(const Vec3& L) const {
    const double x = cos_ * L.x - sin_ * L.z, z = sin_ * L.x + cos_ * L.z;
    const double u = (0.5 + std::atan2(x, -z) / (2 * PI)) * width_;
    const double v = std::acos(std::clamp(L.y, -1.0, 1.0)) / PI * height_;
    const int column = std::clamp(static_cast<int>(u), 0, width_ - 1);
    const int row = std::clamp(static_cast<int>(v), 0, height_ - 1);
    return {column, row, u - column, v - row};
}

Vec3 Environment::radiance(const Texel& t) const {
    const int x = t.u < 0.5 ? t.x - 1 : t.x, y = t.v < 0.5 ? t.y - 1 : t.y;  // the centres around it
    const double u = t.u < 0.5 ? t.u + 0.5 : t.u - 0.5, v = t.v < 0.5 ? t.v + 0.5 : t.v - 0.5;
    return (at(x, y) * (1 - u) + at(x + 1, y) * u) * (1 - v) + (at(x, y + 1) * (1 - u) + at(x + 1, y + 1) * u) * v;
}

Vec3 Environment::radiance(const Vec3& L) const { return radiance(texel(L)); }

double Environment::density(int x, int y) const {
    const double solid_angle = (height_of_[y] - height_of_[y + 1]) * 2 * PI / width_;
    return share(rows_.data(), y) * share(columns_.data() + std::size_t(y) * width_, x) / solid_angle;
}

double Environment::density(const Vec3&, const Vec3& L) const {
    const Texel t = texel(L);
    return density(t.x, t.y);
}

// A texel by its light, and within it a direction uniform over its solid angle.
LightSample Environment::sample(const Vec3&, Vec2 u) const {
    const int y = find(rows_.data(), height_, u.y), x = find(columns_.data() + std::size_t(y) * width_, width_, u.x);
    const double cos = std::lerp(height_of_[y], height_of_[y + 1], u.y), sin = std::sqrt(std::max(0.0, 1 - cos * cos));
    const double phi = ((x + u.x) / width_ - 0.5) * 2 * PI, px = sin * std::sin(phi), pz = -sin * std::cos(phi);
    const double v = std::clamp(std::acos(cos) / PI * height_ - y, 0.0, 1.0), p = density(x, y);
    if (!(p > 0)) return {Vec3(0), 0, Vec3(0), 0};
    const Vec3 L(cos_ * px + sin_ * pz, cos, -sin_ * px + cos_ * pz);
    return {L, std::numeric_limits<double>::infinity(), radiance(Texel{x, y, u.x, v}) / p, p};
}

std::uint64_t Environment::fingerprint() const {
    return Fingerprint().add(pixels_).add(width_).add(height_).add(cos_).add(sin_).value();
}

}  // namespace lobe
