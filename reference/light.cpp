#include "light.h"

namespace lobe {
namespace {

constexpr double PI = std::numbers::pi;
constexpr LightSample UNSEEN = {Vec3(0), 0, Vec3(0), 0};

double pow_3_2(double x) { return x * std::sqrt(x); }

// A rectangle as a point sees it, projected onto the unit sphere about the point. Urena, Fajardo, King, An
// area-preserving parametrization for spherical rectangles, EGSR 2013, with their letters. Sums of the inner angles g
// are kept as cosine and sine, so that one arc tangent does for four arc cosines. A rectangle that is SMALL in units of
// its distance squared is drawn from by area, which is cheaper and hardly worse.
class SphericalRectangle {
public:
    SphericalRectangle(const RectangleLight& light, const Vec3& point) {
        const Vec3 p = light.axes.to_local(light.center - point);
        height_ = -p.z;
        if (!(height_ > 0)) return;
        x0_ = p.x - light.half_x, x1_ = p.x + light.half_x, y0_ = p.y - light.half_y, y1_ = p.y + light.half_y;
        area_ = 4 * light.half_x * light.half_y;
        if (area_ < SMALL * p.length2()) return;

        const double edges[] = {x0_, x1_, y0_, y1_};
        double z[4], cos[4], sin[4];
        for (int i = 0; i < 4; ++i) z[i] = edges[i] / std::sqrt(edges[i] * edges[i] + height_ * height_);
        const double a0 = -z[0], a1 = z[1];
        b0_ = -z[2], b1_ = z[3];
        cos[0] = -b0_ * a1, cos[1] = -a1 * b1_, cos[2] = -b1_ * a0, cos[3] = -a0 * b0_;
        for (int i = 0; i < 4; ++i) sin[i] = std::sqrt(std::max(0.0, (1 - cos[i]) * (1 + cos[i])));
        const double cos01 = cos[0] * cos[1] - sin[0] * sin[1], sin01 = sin[0] * cos[1] + cos[0] * sin[1];
        // k = 2 pi - g2 - g3
        cos_k_ = cos[2] * cos[3] - sin[2] * sin[3], sin_k_ = -(sin[2] * cos[3] + cos[2] * sin[3]);
        const double S = std::atan2(sin01 * cos_k_ - cos01 * sin_k_, cos01 * cos_k_ + sin01 * sin_k_);
        solid_angle_ = S < 0 ? S + 2 * PI : S;
        curved_ = solid_angle_ > GRAZING;  // less is lost among the digits of 2 pi
    }

    double height() const { return height_; }

    // The point of the rectangle, from where it is seen.
    Vec3 local(Vec2 u) const {
        if (!curved_) return {x0_ + u.x * (x1_ - x0_), y0_ + u.y * (y1_ - y0_), -height_};
        const Vec2 a = on_circle(u.x * solid_angle_ / (2 * PI));
        const double f = ((cos_k_ * a.x - sin_k_ * a.y) * b0_ - b1_) / (sin_k_ * a.x + cos_k_ * a.y);
        const double tan2 = std::max(f * f + b0_ * b0_ - 1, 1e-300);
        const double x = std::clamp(std::copysign(height_, f) / std::sqrt(tan2), x0_, x1_);
        const double d2 = x * x + height_ * height_;
        const double h0 = y0_ / std::sqrt(d2 + y0_ * y0_), h1 = y1_ / std::sqrt(d2 + y1_ * y1_);
        const double h = std::lerp(h0, h1, u.y);
        const double y = h * std::sqrt(d2 / std::max((1 - h) * (1 + h), 1e-300));
        return {x, std::clamp(y, y0_, y1_), -height_};
    }

    // Per solid angle, of what `local` draws.
    double density(const Vec3& local) const {
        return curved_ ? 1 / solid_angle_ : pow_3_2(local.length2()) / (height_ * area_);
    }

private:
    static constexpr double SMALL = 0.3, GRAZING = 1e-4;
    double height_, area_, x0_, x1_, y0_, y1_, b0_, b1_, cos_k_, sin_k_, solid_angle_;
    bool curved_ = false;
};

}  // namespace

// About the solid angle, from the rectangle's point that is nearest.
double RectangleLight::importance(const Vec3& point, const Vec3&) const {
    const Vec3 p = axes.to_local(point - center);
    if (!(p.z > 0)) return 0;
    const double x = std::max(0.0, std::abs(p.x) - half_x), y = std::max(0.0, std::abs(p.y) - half_y);
    const double distance2 = x * x + y * y + p.z * p.z, area = 4 * half_x * half_y;
    return luminance(radiance) * area / (distance2 + area / (2 * PI)) * p.z / std::sqrt(distance2);
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
    const double edge = cap(to_center), below = u.x * edge;  // 1 - cos
    if (!(edge > 0)) return UNSEEN;
    const double sin = std::sqrt(below * (2 - below)), distance = to_center.length();
    const Vec2 c = on_circle(u.y) * sin;
    const Vec3 L = Basis(to_center / distance).to_world({c.x, c.y, 1 - below});
    const double larger = radius + offset + SHADOW_OFFSET * distance, beside = distance * sin;
    const double clear = distance * (1 - below) - std::sqrt(std::max(0.0, larger * larger - beside * beside));
    const double density = 1 / (2 * PI * edge);
    return {L, std::max(0.0, clear), radiance / density, density};
}

double SphereLight::density(const Vec3& point, const Vec3&) const {
    const double edge = cap(center - point);
    return edge > 0 ? 1 / (2 * PI * edge) : 0;
}

}  // namespace lobe
