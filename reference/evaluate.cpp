#include "evaluate.h"

#include "parallel.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lobe {
namespace {

constexpr double FLOAT32_ROUNDOFF = 0x1p-24;
constexpr std::size_t GRAIN = 1024;

Vec3 read(const Parameter& p, std::span<const double> a) { return {a[p.offset], a[p.offset + 1], a[p.offset + 2]}; }

void write(const Parameter& p, const Vec3& v, std::span<double> a) {
    a[p.offset] = v.x, a[p.offset + 1] = v.y, a[p.offset + 2] = v.z;
}

bool is_direction(const Parameter& p) { return p.type == "vec3" && (p.name == "N" || p.name == "V" || p.name == "L"); }

template <class Row> void for_rows(std::size_t rows, Row row) {
    parallel_for((rows + GRAIN - 1) / GRAIN, [&](std::size_t part) {
        for (std::size_t i = part * GRAIN; i < std::min(rows, (part + 1) * GRAIN); ++i) row(i);
    });
}

std::vector<double> prepared(const Function& f, std::span<const double> arguments) {
    std::vector<double> x(arguments.begin(), arguments.end());
    normalize_directions(f, x);
    return x;
}

std::array<double, 3> call(const Function& f, std::span<double> x) {
    std::array<double, 3> y{};
    normalize_directions(f, x);
    f.call(x.data(), y.data());
    return y;
}

void condition_row(const Function& f, std::span<const double> arguments, double* kappa) {
    const std::vector<double> x = prepared(f, arguments);
    std::vector<double> moved = x;
    const auto centre = call(f, moved);
    for (std::size_t k = 0; k < f.result_width; ++k) kappa[k] = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double step = FLOAT32_ROUNDOFF * std::abs(x[i]);
        if (step == 0) continue;
        std::array<double, 3> change{};
        for (double sign : {-1.0, 1.0}) {
            moved = x;
            moved[i] += sign * step;
            const auto y = call(f, moved);
            for (std::size_t k = 0; k < f.result_width; ++k) change[k] = std::fmax(change[k], std::abs(y[k] - centre[k]));
        }
        for (std::size_t k = 0; k < f.result_width; ++k)
            if (centre[k] != 0) kappa[k] += change[k] / FLOAT32_ROUNDOFF / std::abs(centre[k]);
    }
}

}  // namespace

void normalize_directions(const Function& f, std::span<double> arguments) {
    for (const Parameter& p : f.parameters)
        if (is_direction(p)) write(p, read(p, arguments).normalized(), arguments);
    const Parameter *N = f.find("N"), *T = f.find("T");
    if (!N || !T) return;
    const Vec3 n = read(*N, arguments), t = read(*T, arguments);
    write(*T, (t - n * n.dot(t)).normalized(), arguments);
}

void evaluate(const Function& f, std::span<const double> arguments, std::span<double> results) {
    const std::size_t w = f.argument_width;
    for_rows(arguments.size() / w, [&](std::size_t i) {
        const auto x = prepared(f, arguments.subspan(i * w, w));
        f.call(x.data(), results.data() + i * f.result_width);
    });
}

void condition(const Function& f, std::span<const double> arguments, std::span<double> kappa) {
    const std::size_t w = f.argument_width;
    for_rows(arguments.size() / w, [&](std::size_t i) {
        condition_row(f, arguments.subspan(i * w, w), kappa.data() + i * f.result_width);
    });
}

}  // namespace lobe
