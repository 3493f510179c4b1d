// What a scene is made of. Embree finds the primitive in float; surface() says in double where the ray meets it.
#pragma once

#include "camera.h"

#include <array>
#include <cstdint>
#include <vector>

namespace lobe {

struct Surface {
    Vec3 position;
    Vec3 N;       // unit shading normal, not flipped towards the ray
    Vec3 facing;  // unit normal of the flat primitive
    Vec3 T{0};    // unit, orthogonal to N
    Vec2 uv{0};
};

enum class Detail { normals, all };  // whether T and uv are wanted, too; else they are null

// Each shape tells its reach: the largest of its coordinates whose rounding moves it along its normal.

// What Embree reports of a hit: the primitive and, on a triangle, the barycentrics of its second and third vertex.
struct Hit {
    std::uint32_t primitive;
    double u, v;
};

// Unit tangent that runs around the y axis, eastwards; x where N is along y. Brushed metal is turned that way.
Vec3 tangent_around_y(const Vec3& N);
// The part of t that is orthogonal to the unit vector N, as a unit vector; where t is along N or null, a tangent that
// runs around the y axis.
Vec3 orthonormal_tangent(const Vec3& N, const Vec3& t);

struct Mesh {
    using Face = std::array<std::uint32_t, 3>;

    std::vector<Vec3> vertices;
    std::vector<Face> faces;
    std::vector<Vec3> normals;   // one a vertex, unit
    std::vector<Vec3> tangents;  // one a vertex, unit, orthogonal to the normal
    std::vector<Vec2> uv;        // one a vertex, or empty

    // Empty arrays are missing ones. Missing normals are the faces' normals, weighted with area and with the angle at
    // the vertex; missing tangents follow u where there is uv (same weights), else they run around the y axis.
    // Throws std::invalid_argument where a face names a vertex that is not there.
    Mesh(std::vector<Vec3> vertices, std::vector<Face> faces, std::vector<Vec3> normals = {}, std::vector<Vec2> uv = {},
         std::vector<Vec3> tangents = {});

    Surface surface(const Ray& ray, const Hit& hit, Detail detail) const;
    double reach() const;
};

// uv: u runs once around from +x over -z, v from the lower pole (-y) to the upper, both 0..1. T points along u.
struct Sphere {
    Vec3 center;
    double radius;

    Surface surface(const Ray& ray, const Hit&, Detail detail) const;
    double reach() const;
};

// A rectangle. uv is (0, 0) at center - half_x T - half_y B and (1, 1) at the opposite corner, B = N x T.
struct Plane {
    Vec3 center;
    Vec3 N, T;  // orthonormal
    double half_x, half_y = half_x;

    Surface surface(const Ray& ray, const Hit&, Detail detail) const;
    double reach() const;
    std::array<Vec3, 4> corners() const;
};

}  // namespace lobe
