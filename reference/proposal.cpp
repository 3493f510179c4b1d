#include "proposal.h"

namespace lobe {
namespace {

constexpr double PI = std::numbers::pi;

// Dupuy, Benyoub, Sampling visible GGX normals with spherical caps, HPG 2023: V, stretched, sees the cap z > -V.z of
// mirror directions uniformly; the facet's normal is halfway.
Vec3 visible_facet(const Vec3& V, double ax, double ay, Vec2 u) {
    const Vec3 v = Vec3(ax * V.x, ay * V.y, V.z).normalized();
    const double z = (1 - u.y) * (1 + v.z) - v.z, sin = std::sqrt(std::clamp(1 - z * z, 0.0, 1.0));
    const Vec2 c = on_circle(u.x) * sin;
    const Vec3 h = Vec3(c.x, c.y, z) + v;
    return Vec3(ax * h.x, ay * h.y, std::max(h.z, 0.0)).normalized();
}

// D G1 / (4 V.z): Heitz 2014, eq. 2, with D of eq. 85 and G1 of eqs. 80, 72, over the 4 V.H of Walter et al. 2007, eq.
// 14. H = V + L in place of a unit vector puts its length^4 into D.
double facet_density(const Vec3& V, const Vec3& L, double ax, double ay) {
    const Vec3 H = V + L;
    const double length2 = H.length2(), hx = H.x / ax, hy = H.y / ay, stretched2 = hx * hx + hy * hy + H.z * H.z;
    if (!(H.z > 0)) return 0;
    const double ratio = length2 / stretched2, vx = ax * V.x, vy = ay * V.y;
    return ratio * ratio / (PI * ax * ay) / (2 * (V.z + std::sqrt(vx * vx + vy * vy + V.z * V.z)));
}

}  // namespace

Vec3 Proposal::sample(const Vec3& V, Vec2 u) const {
    if (kind_ == Kind::cosine) return with_cosine(u);
    if (kind_ == Kind::ggx) {
        const Vec3 H = visible_facet(V, a_, b_, u);
        return H * (2 * V.dot(H)) - V;
    }
    const double cos = std::pow(1 - u.y, 1 / (a_ + 1)), sin = std::sqrt(std::max(0.0, 1 - cos * cos));
    const Vec2 c = on_circle(u.x) * sin;
    return Basis(Vec3(-V.x, -V.y, V.z)).to_world({c.x, c.y, cos});
}

double Proposal::density(const Vec3& V, const Vec3& L) const {
    if (kind_ == Kind::cosine) return std::max(L.z, 0.0) / PI;
    if (kind_ == Kind::ggx) return facet_density(V, L, a_, b_);
    const double cos = V.z * L.z - V.x * L.x - V.y * L.y;
    return cos > 0 ? (a_ + 1) / (2 * PI) * std::pow(cos, a_) : 0;
}

}  // namespace lobe
