#include "outlook.h"

#include "parallel.h"

namespace lobe {
namespace {

// Half the angles between neighbouring axes or parts of tiles: a narrower lobe looks as broad as that.
constexpr double NARROWEST = 0.05;
constexpr double FLOOR = 1e-3;  // of the largest weight

double width(int breadth) { return NARROWEST * std::exp2((breadth - 1) / 2.0); }

}  // namespace

int Outlook::breadth(const Proposal& proposal) {
    if (!proposal.glossy()) return 0;
    return 1 + static_cast<int>(std::lround(2 * std::log2(std::hypot(proposal.width() / NARROWEST, 1.0))));
}

Outlook::Outlook(const Environment& environment, int breadth) : aims_(AXES) {
    parallel_for(aims_.size(), [&](std::size_t i) {
        const Vec3 a = axis(i);
        if (breadth == 0) {
            aims_[i] = environment.aim([&](const Vec3& L) { return std::max(a.dot(L) + NARROWEST, FLOOR); });
            return;
        }
        // GGX's facets that mirror the view to L are turned by half the angle between L and the axis
        const double alpha2 = width(breadth) * width(breadth);
        aims_[i] = environment.aim([&](const Vec3& L) {
            const double stretched = alpha2 / (1 - (1 - alpha2) * (1 + a.dot(L)) / 2);
            return stretched * stretched + FLOOR;
        });
    });
}

std::size_t Outlook::place(const Vec3& axis) {
    int face = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(axis[i]) > std::abs(axis[face])) face = i;
    const double half = 0.5 * ACROSS, scale = half / std::abs(axis[face]);
    const auto along = [&](double v) { return std::clamp(static_cast<int>(v * scale + half), 0, ACROSS - 1); };
    const int side = 2 * face + (axis[face] < 0);
    return (side * ACROSS + along(axis[(face + 1) % 3])) * ACROSS + along(axis[(face + 2) % 3]);
}

Vec3 Outlook::axis(std::size_t place) {
    const auto along = [](std::size_t i) { return (i % ACROSS + 0.5) * 2 / ACROSS - 1; };
    const int side = static_cast<int>(place / (ACROSS * ACROSS)), face = side / 2;
    Vec3 v;
    v[face] = side % 2 ? -1 : 1;
    v[(face + 1) % 3] = along(place / ACROSS);
    v[(face + 2) % 3] = along(place);
    return v.normalized();
}

}  // namespace lobe
