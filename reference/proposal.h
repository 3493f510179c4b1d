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
