// How a lobe's directions are drawn: densities that are near to f cos for the families of lobes that there are.
#pragma once

#include "sampling.h"

namespace lobe {

// Directions over the hemisphere about z; V is unit, its z above 0.
class Proposal {
public:
    static Proposal cosine() { return {Kind::cosine, 0, 0}; }
    // Facets of GGX that V sees, of two widths along x and y, mirror V.
    static Proposal ggx(double alpha_x, double alpha_y) { return {Kind::ggx, alpha_x, alpha_y}; }
    // A power of the cosine with the mirror direction of V.
    static Proposal power(double exponent) { return {Kind::power, exponent, 0}; }

    bool glossy() const { return kind_ != Kind::cosine; }
    // The direction about which they lie, and of glossy ones the width: of GGX's facets, or of those that are as broad.
    Vec3 axis(const Vec3& V) const { return glossy() ? Vec3(-V.x, -V.y, V.z) : Vec3(0, 0, 1); }
    double width() const { return kind_ == Kind::ggx ? std::max(a_, b_) : std::sqrt(0.5 / (a_ + 1)); }

    // May lie below the horizon.
    Vec3 sample(const Vec3& V, Vec2 u) const;
    double density(const Vec3& V, const Vec3& L) const;

private:
    enum class Kind { cosine, ggx, power };
    Proposal(Kind kind, double a, double b) : kind_(kind), a_(a), b_(b) {}

    Kind kind_;
    double a_, b_;
};

}  // namespace lobe
