#include "shape.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace lobe {
namespace {

constexpr double PI = 3.14159265358979323846;

double largest(const Vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

template <class V> V interpolate(const std::vector<V>& at, const Mesh::Face& f, double u, double v) {
    return at[f[0]] * (1 - u - v) + at[f[1]] * u + at[f[2]] * v;
}

// Calls add(vertex, weight) for the corners of a face, the weight being the angle there.
template <class Add> void for_corners(const std::vector<Vec3>& p, const Mesh::Face& f, Add add) {
    for (int i = 0; i < 3; ++i) {
        const Vec3 a = p[f[(i + 1) % 3]] - p[f[i]], b = p[f[(i + 2) % 3]] - p[f[i]];
        add(f[i], std::atan2(a.cross(b).length(), a.dot(b)));
    }
}

std::vector<Vec3> smooth_normals(const Mesh& m) {
    std::vector<Vec3> sums(m.vertices.size(), Vec3(0));
    for (const Mesh::Face& f : m.faces) {
        const Vec3& origin = m.vertices[f[0]];
        const Vec3 area = (m.vertices[f[1]] - origin).cross(m.vertices[f[2]] - origin);
        for_corners(m.vertices, f, [&](std::uint32_t vertex, double angle) { sums[vertex] += area * angle; });
    }
    return sums;
}

// dp/du of a triangle solves e_i = dp/du du_i + dp/dv dv_i; of the solution only the direction is needed here.
std::vector<Vec3> tangents_along_u(const Mesh& m) {
    std::vector<Vec3> sums(m.vertices.size(), Vec3(0));
    for (const Mesh::Face& f : m.faces) {
        const Vec3 e1 = m.vertices[f[1]] - m.vertices[f[0]], e2 = m.vertices[f[2]] - m.vertices[f[0]];
        const Vec2 d1 = m.uv[f[1]] - m.uv[f[0]], d2 = m.uv[f[2]] - m.uv[f[0]];
        const double determinant = d1.cross(d2);
        const Vec3 along_u = ((e1 * d2.y - e2 * d1.y) * std::copysign(1, determinant)).normalized();
        const double area = e1.cross(e2).length();
        for_corners(m.vertices, f, [&](std::uint32_t vertex, double angle) { sums[vertex] += along_u * area * angle; });
    }
    return sums;
}

}  // namespace

Vec3 tangent_around_y(const Vec3& N) {
    const Vec3 T = Vec3(N.z, 0, -N.x).normalized();  // y x N
    return T == Vec3(0) ? Vec3(1, 0, 0) : T;
}

Vec3 orthonormal_tangent(const Vec3& N, const Vec3& t) {
    constexpr double NEARLY_PARALLEL = 1e-6;  // sine of the angle below which rounding would turn the result
    const Vec3 rest = t - N * N.dot(t);
    if (rest.length2() <= NEARLY_PARALLEL * NEARLY_PARALLEL * t.length2()) return tangent_around_y(N);
    return rest.normalized();
}

Mesh::Mesh(std::vector<Vec3> vertices_, std::vector<Face> faces_, std::vector<Vec3> normals_, std::vector<Vec2> uv_,
           std::vector<Vec3> tangents_)
    : vertices(std::move(vertices_)), faces(std::move(faces_)), normals(std::move(normals_)),
      tangents(std::move(tangents_)), uv(std::move(uv_)) {
    for (std::size_t i = 0; i < faces.size(); ++i)
        for (std::uint32_t vertex : faces[i])
            if (vertex >= vertices.size())
                throw std::invalid_argument("faces: row " + std::to_string(i) + " names vertex " +
                                            std::to_string(vertex) + ", but there are only " +
                                            std::to_string(vertices.size()) + " (counted from 0)");
    if (normals.empty()) normals = smooth_normals(*this);
    for (Vec3& N : normals) N.normalize();
    if (tangents.empty()) tangents = uv.empty() ? std::vector<Vec3>(vertices.size(), Vec3(0)) : tangents_along_u(*this);
    for (std::size_t i = 0; i < tangents.size(); ++i) tangents[i] = orthonormal_tangent(normals[i], tangents[i]);
}

// The point where the ray's line meets the triangle's plane, by Cramer's rule, drawn back into the triangle where the
// float hit lay beside it. A ray within the plane has no such point; there the barycentrics of Embree stand.
Surface Mesh::surface(const Ray& ray, const Hit& hit, Detail detail) const {
    const Face& f = faces[hit.primitive];
    const Vec3& origin = vertices[f[0]];
    const Vec3 e1 = vertices[f[1]] - origin, e2 = vertices[f[2]] - origin, area = e1.cross(e2);
    const double determinant = ray.direction.dot(area);
    double u = hit.u, v = hit.v;
    if (determinant != 0) {
        const Vec3 q = (ray.origin - origin).cross(ray.direction);
        u = -q.dot(e2) / determinant;
        v = q.dot(e1) / determinant;
    }
    u = std::clamp(u, 0.0, 1.0);
    v = std::clamp(v, 0.0, 1 - u);
    const Vec3 N = interpolate(normals, f, u, v).normalized();
    Surface s{origin + e1 * u + e2 * v, N, area.normalized()};
    if (detail == Detail::normals) return s;
    s.T = orthonormal_tangent(N, interpolate(tangents, f, u, v));
    if (!uv.empty()) s.uv = interpolate(uv, f, u, v);
    return s;
}

double Mesh::reach() const {
    double all = 0;
    for (const Vec3& p : vertices) all = std::max(all, largest(p));
    return all;
}

// The chord's middle is the foot of the perpendicular from the centre; the ends lie half a chord before and after it.
Surface Sphere::surface(const Ray& ray, const Hit&, Detail detail) const {
    const Vec3 from_center = ray.origin - center;
    const Vec3 foot = from_center - ray.direction * ray.direction.dot(from_center);
    const double half_chord = std::sqrt(std::max(0.0, radius * radius - foot.length2()));
    const bool outside = from_center.length2() > radius * radius;
    const Vec3 N = (foot + ray.direction * (outside ? -half_chord : half_chord)).normalized();
    Surface s{center + N * radius, N, N};
    if (detail == Detail::normals) return s;
    const double turns = std::atan2(-N.z, N.x) / (2 * PI), latitude = std::atan2(N.y, std::hypot(N.x, N.z));
    s.T = tangent_around_y(N);
    s.uv = {turns < 0 ? turns + 1 : turns, latitude / PI + 0.5};
    return s;
}

double Sphere::reach() const { return largest(center) + radius; }

Surface Plane::surface(const Ray& ray, const Hit&, Detail) const {
    const Vec3 B = N.cross(T), to_center = center - ray.origin;
    const Vec3 in_plane = ray.direction * (to_center.dot(N) / ray.direction.dot(N)) - to_center;
    const double x = std::clamp(in_plane.dot(T), -half_x, half_x), y = std::clamp(in_plane.dot(B), -half_y, half_y);
    return {center + T * x + B * y, N, N, T, Vec2(x / half_x, y / half_y) / 2 + Vec2(0.5)};
}

// Ground that extends far is not lifted by that: along itself it may be rounded as it likes. A little is left for planes
// through the origin.
double Plane::reach() const {
    constexpr double LEAST = 0x1p-10;
    const Vec3 B = N.cross(T);
    double along = 0, all = 0;
    for (int a = 0; a < 3; ++a) {
        const double farthest = std::abs(center[a]) + std::abs(T[a]) * half_x + std::abs(B[a]) * half_y;
        along += std::abs(N[a]) * farthest, all = std::max(all, farthest);
    }
    return along + LEAST * all;
}

std::array<Vec3, 4> Plane::corners() const {
    const Vec3 x = T * half_x, y = N.cross(T) * half_y;
    return {center - x - y, center + x - y, center + x + y, center - x + y};
}

}  // namespace lobe
