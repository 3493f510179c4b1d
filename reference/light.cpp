#include "light.h"

#include <array>

namespace lobe {
namespace {

constexpr double PI = std::numbers::pi;
constexpr LightSample UNSEEN = {Vec3(0), 0, Vec3(0), 0};

// A rectangle as a point sees it, projected onto the unit sphere about the point. Urena, Fajardo, King, An area-preserving
// parametrization for spherical rectangles, EGSR 2013. The solid angle is a difference of numbers near 2 pi: below
// SMALL the rectangle is drawn from by area, which it may as well be, being far away.
class SphericalRectangle {
public:
    SphericalRectangle(const RectangleLight& light, const Vec3& point) : light_(light) {
        const Vec3 p = light.axes.to_local(light.center - point);
        height_ = -p.z;
        if (!(height_ > 0)) return;
        x0_ = p.x - light.half_x, x1_ = p.x + light.half_x, y0_ = p.y - light.half_y, y1_ = p.y + light.half_y;
        const double area = 4 * light.half_x * light.half_y;
        flat_ = area * height_ / std::pow(p.length2(), 1.5);
        if (flat_ < SMALL) return;
        // the inner angles of the spherical rectangle, from the normals of the planes through its edges
        const auto z = [&](double a) { return a / std::hypot(a, height_); };
        b0_ = -z(y0_), b1_ = z(y1_);
        const double a0 = -z(x0_), a1 = z(x1_);
        const double g0 = std::acos(-b0_ * a1), g1 = std::acos(-a1 * b1_), g2 = std::acos(-b1_ * a0);
        const double g3 = std::acos(-a0 * b0_);
        rest_ = 2 * PI - g2 - g3;
        solid_angle_ = g0 + g1 - rest_;
        curved_ = solid_angle_ > SMALL / 10;
    }

    double solid_angle() const { return !(height_ > 0) ? 0 : curved_ ? solid_angle_ : flat_; }
    bool curved() const { return curved_; }
    double height() const { return height_; }

    // The point of the rectangle, from where it is seen.
    Vec3 local(Vec2 u) const {
        if (!curved_) return {x0_ + u.x * (x1_ - x0_), y0_ + u.y * (y1_ - y0_), -height_};
        const double angle = u.x * solid_angle_ + rest_;
        const double f = (std::cos(angle) * b0_ - b1_) / std::sin(angle);
        const double cu = std::clamp(std::copysign(1.0, f) / std::hypot(f, b0_), -1.0, 1.0);
        const double x = std::clamp(cu * height_ / std::sqrt(std::max(1 - cu * cu, 1e-300)), x0_, x1_);
        const double d = std::hypot(x, height_), h0 = y0_ / std::hypot(d, y0_), h1 = y1_ / std::hypot(d, y1_);
        const double h = h0 + u.y * (h1 - h0), rest = 1 - h * h;
        return {x, rest > 1e-12 ? std::clamp(h * d / std::sqrt(rest), y0_, y1_) : h > 0 ? y1_ : y0_, -height_};
    }

    // Per solid angle, of what `local` draws.
    double density(const Vec3& local) const {
        if (curved_) return 1 / solid_angle_;
        return std::pow(local.length2(), 1.5) / (height_ * 4 * light_.half_x * light_.half_y);
    }

private:
    static constexpr double SMALL = 1e-3;
    const RectangleLight& light_;
    double height_, x0_, x1_, y0_, y1_, flat_ = 0, b0_, b1_, rest_, solid_angle_ = 0;
    bool curved_ = false;
};

}  // namespace

double RectangleLight::importance(const Vec3& point, const Vec3&) const {
    return luminance(radiance) * SphericalRectangle(*this, point).solid_angle();
}

LightSample RectangleLight::sample(const Vec3& point, Vec2 u) const {
    const SphericalRectangle seen(*this, point);
    if (!(seen.height() > 0)) return UNSEEN;
    const Vec3 local = seen.local(u);
    const double length = local.length(), density = seen.density(local);
    const double clear = length * std::max(0.0, 1 - (offset + SHADOW_OFFSET * length) / seen.height());
    return {axes.to_world(local) / length, clear, radiance / density, density};
}

double RectangleLight::density(const Vec3& point, const Vec3& L) const {
    const SphericalRectangle seen(*this, point);
    const Vec3 l = axes.to_local(L);
    if (!(seen.height() > 0 && l.z < 0)) return 0;
    return seen.density(l * (seen.height() / -l.z));
}

double SphereLight::cap(const Vec3& to_center) const {
    const double sin2 = radius * radius / to_center.length2();
    return sin2 < 1 ? sin2 / (1 + std::sqrt(1 - sin2)) : 0;  // 0: the point is within, where nothing shines
}

double SphereLight::importance(const Vec3& point, const Vec3&) const {
    return luminance(radiance) * 2 * PI * cap(center - point);
}

// Uniformly within the cone that the sphere fills. The distance is that to a sphere larger by the offset.
LightSample SphereLight::sample(const Vec3& point, Vec2 u) const {
    const Vec3 to_center = center - point;
    const double edge = cap(to_center), below = u.x * edge, phi = 2 * PI * u.y;  // below = 1 - cos
    if (!(edge > 0)) return UNSEEN;
    const double sin = std::sqrt(below * (2 - below)), distance = to_center.length();
    const Vec3 L = Basis(to_center / distance).to_world({sin * std::cos(phi), sin * std::sin(phi), 1 - below});
    const double larger = radius + offset + SHADOW_OFFSET * distance, half_chord2 = larger * larger - distance * sin * distance * sin;
    const double clear = distance * (1 - below) - std::sqrt(std::max(0.0, half_chord2));
    const double density = 1 / (2 * PI * edge);
    return {L, std::max(0.0, clear), radiance / density, density};
}

double SphereLight::density(const Vec3& point, const Vec3&) const {
    const double edge = cap(center - point);
    return edge > 0 ? 1 / (2 * PI * edge) : 0;
}

}  // namespace lobe
