// The ray tracer against closed forms of geometry and light.
#include "evaluate.h"
#include "pixels.h"
#include "scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>

namespace lobe {
namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double GEOMETRY_ROUNDOFF = 1e-12;  // relative to coordinates of about 1
constexpr int SIZE = 64;
const char* const LAMBERT = "lobe_Lambert(vec3,vec3,vec3,vec3)";
const char* const GGX = "lobe_GGX(vec3,vec3,vec3,vec3,float)";

Vec3 at(const std::vector<double>& image, std::size_t pixel) {
    return {image[3 * pixel], image[3 * pixel + 1], image[3 * pixel + 2]};
}

double distance(const Vec3& a, const Vec3& b) { return (a - b).length(); }

Light directional(const Vec3& towards, const Vec3& irradiance) { return {true, towards.normalized(), irradiance}; }

Material lambert(const Vec3& albedo) { return {{Lobe(LAMBERT, {{"albedo", {albedo.x, albedo.y, albedo.z}}})}}; }

// Calls check(pixel, ray) for each pixel that shows the object, and expects that there are any.
void for_pixels_of(int object, const Trace& t, const Camera& camera, std::function<void(std::size_t, Ray)> check) {
    std::size_t seen = 0;
    for (int y = 0; y < SIZE; ++y)
        for (int x = 0; x < SIZE; ++x) {
            const std::size_t pixel = static_cast<std::size_t>(y) * SIZE + x;
            if (t.object[pixel] != object) continue;
            check(pixel, camera.view(SIZE, SIZE).ray(x + 0.5, y + 0.5));
            ++seen;
        }
    EXPECT_GT(seen, 100u);
}

// An octahedron, split `times` times and blown up to the unit sphere: convex, and as irregular as meshes are.
Mesh ball(int times, const Vec3& center = Vec3(0)) {
    std::vector<Vec3> p = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    std::vector<Mesh::Face> faces = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                     {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        p.push_back((p[a] + p[b]).normalized());
        return static_cast<std::uint32_t>(p.size() - 1);
    };
    for (; times > 0; --times) {
        std::vector<Mesh::Face> finer;
        for (const auto& [a, b, c] : faces) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        faces = finer;
    }
    std::vector<Vec3> normals = p;
    for (Vec3& v : p) v += center;
    return Mesh(p, faces, normals);
}

TEST(Camera, CentreCornersAndAngle) {
    const Camera camera({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 90);
    const View view = camera.view(200, 100);
    EXPECT_LT(distance(view.ray(100, 50).direction, {0, 0, -1}), GEOMETRY_ROUNDOFF);
    EXPECT_LT(distance(view.ray(0, 0).direction, Vec3(-2, 1, -1).normalized()), GEOMETRY_ROUNDOFF);
    EXPECT_LT(distance(view.ray(200, 100).direction, Vec3(2, -1, -1).normalized()), GEOMETRY_ROUNDOFF);
    EXPECT_THROW(Camera({0, 0, 5}, {0, 0, 5}, {0, 1, 0}, 90), std::invalid_argument);
    EXPECT_THROW(Camera({0, 0, 5}, {0, 0, 0}, {0, 0, 2}, 90), std::invalid_argument);
    EXPECT_THROW(Camera({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 180), std::invalid_argument);
}

TEST(Sphere, HitsTheNearRootOfTheQuadratic) {
    const Vec3 center(0.1, -0.2, 0.3);
    const double radius = 1.1;
    Scene scene;
    scene.add(Sphere{center, radius});
    const Camera camera({0.5, 1, 4}, center, {0, 1, 0}, 45);
    const Trace t = scene.trace(camera, SIZE, SIZE);
    for_pixels_of(0, t, camera, [&](std::size_t i, const Ray& ray) {
        const Vec3 o = ray.origin - center;
        const double b = o.dot(ray.direction), root = b * b - o.length2() + radius * radius;
        if (root < 1e-4) return;  // the rim, where the root is ill-conditioned
        const double depth = -b - std::sqrt(root);
        const Vec3 p = ray.origin + ray.direction * depth, N = (p - center) / radius;
        EXPECT_NEAR(t.depth[i], depth, GEOMETRY_ROUNDOFF);
        EXPECT_LT(distance(at(t.position, i), p), GEOMETRY_ROUNDOFF);
        EXPECT_LT(distance(at(t.N, i), N), GEOMETRY_ROUNDOFF);
        EXPECT_LT(distance(at(t.V, i), -ray.direction), GEOMETRY_ROUNDOFF);
        EXPECT_LT(distance(at(t.T, i), Vec3(0, 1, 0).cross(N).normalized()), GEOMETRY_ROUNDOFF);
        const double from_plus_z = t.uv[2 * i] - 0.75 - std::atan2(N.x, N.z) / (2 * PI);
        EXPECT_NEAR(std::remainder(from_plus_z, 1), 0, GEOMETRY_ROUNDOFF);
        EXPECT_NEAR(t.uv[2 * i + 1], 1 - std::acos(N.y) / PI, 1e-10);
    });
}

TEST(Sphere, IsSeenFromWithin) {
    Scene scene;
    scene.add(Sphere{Vec3(0), 2});
    const Camera camera({0.5, 0, 0}, {0, 0, -1}, {0, 1, 0}, 45);
    const Trace t = scene.trace(camera, SIZE, SIZE);
    for_pixels_of(0, t, camera, [&](std::size_t i, const Ray& ray) {
        EXPECT_NEAR(at(t.position, i).length(), 2, GEOMETRY_ROUNDOFF);
        EXPECT_LT((at(t.position, i) - ray.origin).cross(ray.direction).length(), GEOMETRY_ROUNDOFF);
        EXPECT_LT(at(t.N, i).dot(at(t.V, i)), 0);
    });
}

TEST(Plane, HitsLieOnRayAndPlane) {
    const Vec3 N = Vec3(0.2, 1, 0.3).normalized(), T = orthonormal_tangent(N, {1, 0, 0}), center(0.5, -0.3, 0.2);
    Scene scene;
    scene.add(Plane{center, N, T, 2});
    const Camera camera({1, 3, 4}, center, {0, 1, 0}, 50);
    const Trace t = scene.trace(camera, SIZE, SIZE);
    for_pixels_of(0, t, camera, [&](std::size_t i, const Ray& ray) {
        const Vec3 p = at(t.position, i);
        EXPECT_NEAR((p - center).dot(N), 0, GEOMETRY_ROUNDOFF);
        EXPECT_LT((p - ray.origin).cross(ray.direction).length(), 1e-6);  // the border is a float's
        EXPECT_LT(distance(at(t.N, i), N), GEOMETRY_ROUNDOFF);
        EXPECT_LT(distance(at(t.T, i), T), GEOMETRY_ROUNDOFF);
        EXPECT_NEAR(t.uv[2 * i], 0.5 + (p - center).dot(T) / 4, GEOMETRY_ROUNDOFF);
        EXPECT_NEAR(t.uv[2 * i + 1], 0.5 + (p - center).dot(N.cross(T)) / 4, GEOMETRY_ROUNDOFF);
    });
}

// Points of a plane that are spread over it, as rays from above find them.
void for_points_of(const Scene& scene, const Plane& p, const std::function<void(const Scene::Found&, Vec2)>& check) {
    const Vec3 B = p.N.cross(p.T);
    for (int i = 0; i < 64; ++i) {
        const Sample sample(7, i);
        const Vec2 u = sample.pair(0) * 2 - Vec2(1);
        const Vec3 at = p.center + p.T * (0.999 * u.x * p.half_x) + B * (0.999 * u.y * p.half_y);
        const auto found = scene.find({at + p.N * (0.1 * p.half_x), -p.N});
        ASSERT_TRUE(found);
        check(*found, sample.pair(1));
    }
}

TEST(Plane, IsNotInItsOwnWay) {
    for (int k = 0; k < 2000; ++k) {
        const Sample sample(3, k);
        const Vec2 tilt = sample.pair(0), size = sample.pair(1), turn = sample.pair(2), place = sample.pair(3);
        const Vec2 lean = on_circle(turn.x) * std::pow(10, 1 - 9 * tilt.x);  // from level to steep
        const Vec3 N = Vec3(lean.x, 1, lean.y).normalized();
        const Vec2 t = on_circle(turn.y);
        const double half = std::pow(10, 8 * size.x - 2), away = half * std::pow(10, 4 * size.y - 3);
        const Plane plane{Vec3(away * place.x, place.y < 0.5 ? 0 : away * (place.y - 0.5), -away), N,
                          orthonormal_tangent(N, {t.x, 0, t.y}), half};
        Scene scene;
        scene.add(plane);
        for_points_of(scene, plane, [&](const Scene::Found& found, Vec2 u) {
            const Vec2 c = on_circle(u.x);
            const double cos = std::pow(10, -4 * u.y), sin = std::sqrt(1 - cos * cos);
            const Vec3 L = Basis(plane.N, plane.T).to_world({c.x * sin, c.y * sin, cos});
            EXPECT_TRUE(scene.visible(found, L, std::numeric_limits<double>::infinity()))
                << "plane " << k << ", half " << half << ", N " << N << ", L " << L;
            EXPECT_TRUE(scene.visible(found, -L, std::numeric_limits<double>::infinity()));
        });
    }
}

TEST(Plane, GetsTheShadowOfWhatIsNearHoweverFarItReaches) {
    for (const double half : {1e1, 1e3, 1e6}) {
        const Plane ground{{0, -1, 0}, {0, 1, 0}, {1, 0, 0}, half};
        Scene scene;
        scene.add(ground);
        scene.add(Sphere{{0, -0.45, 0}, 0.5});
        const auto below = scene.find({{0.3, -0.94, 0}, {-0.3, -0.06, 0}});
        ASSERT_TRUE(below && below->object == 0);
        EXPECT_FALSE(scene.visible(*below, {0, 1, 0}, std::numeric_limits<double>::infinity())) << half;
    }
}

TEST(Scene, SurfacesSeeEachOtherFromAfar) {
    const Vec3 N = Vec3(0.3, -0.5, 0.7).normalized(), T = orthonormal_tangent(N, {1, 0, 0});
    for (const double away : {1e1, 1e2, 1e3, 1e4, 1e5}) {
        const Plane near{Vec3(0), N, T, 10}, far{N * away, -N, T, 10};
        Scene scene;
        scene.add(near), scene.add(far);
        for_points_of(scene, near, [&](const Scene::Found& a, Vec2) {
            for_points_of(scene, far, [&](const Scene::Found& b, Vec2) {
                const Scene::Pair pairs[] = {{&a, &b}, {&b, &a}};
                bool free[2];
                scene.visible(pairs, 2, free);
                EXPECT_TRUE(free[0] && free[1]) << away;
            });
        });
    }
}

// Whatever their number, answers are those of each pair: that of its distance from a sphere between.
TEST(Scene, TellsOfManyPairsWhichSeeEachOther) {
    constexpr double RADIUS = 0.7;
    constexpr int MOST = 50;
    Scene scene;
    scene.add(Plane{{0, -1, 0}, {0, 1, 0}, {1, 0, 0}, 2}), scene.add(Plane{{0, 1, 0}, {0, -1, 0}, {1, 0, 0}, 2});
    scene.add(Sphere{Vec3(0), RADIUS});
    Scene::Found ends[MOST][2];
    bool expected[MOST], answers[MOST + 1];
    Scene::Pair pairs[MOST];
    for (int i = 0, n = 0; n < MOST; ++i) {
        const Vec2 u = Sample(1, i).pair(0) * 4 - Vec2(2), v = Sample(1, i).pair(1) * 4 - Vec2(2);
        const Vec3 a(u.x, -1, u.y), b(v.x, 1, v.y), way = b - a;
        const double distance = a.cross(way).length() / way.length();
        if (std::abs(distance - RADIUS) < 1e-3) continue;
        ends[n][0] = {0, 0, {a, {0, 1, 0}, {0, 1, 0}}}, ends[n][1] = {1, 0, {b, {0, -1, 0}, {0, -1, 0}}};
        pairs[n] = {&ends[n][0], &ends[n][1]}, expected[n++] = distance > RADIUS;
    }
    ASSERT_NEAR(std::count(expected, expected + MOST, true), MOST / 2, MOST / 4);
    for (const int count : {0, 1, 15, 16, 17, MOST}) {
        answers[count] = true;
        scene.visible(pairs, count, answers);
        for (int i = 0; i < count; ++i) EXPECT_EQ(answers[i], expected[i]) << i << " of " << count;
        EXPECT_TRUE(answers[count]);  // not written
    }
}

TEST(Mesh, HitsLieInTheTriangleAndInterpolate) {
    const Vec3 a(-1, -1, 0.2), b(1.2, -0.9, -0.3), c(0.1, 1.1, 0.4);
    std::vector<Vec3> normals = {Vec3(-0.5, -0.5, 1), Vec3(0.6, -0.4, 1), Vec3(0, 0.7, 1)};
    for (Vec3& N : normals) N.normalize();
    const std::vector<Vec2> uv = {{0, 0}, {1, 0}, {0, 1}};
    Scene scene;
    scene.add(Mesh({a, b, c}, {{0, 1, 2}}, normals, uv));
    const Camera camera({0.3, 0.2, 3}, {0, 0, 0}, {0, 1, 0}, 50);
    const Trace t = scene.trace(camera, SIZE, SIZE);
    const Vec3 facing = (b - a).cross(c - a).normalized();
    for_pixels_of(0, t, camera, [&](std::size_t i, const Ray& ray) {
        const Vec3 p = at(t.position, i);
        const double u = t.uv[2 * i], v = t.uv[2 * i + 1];  // here the barycentrics themselves
        EXPECT_NEAR((p - a).dot(facing), 0, GEOMETRY_ROUNDOFF);
        EXPECT_LT((p - ray.origin).cross(ray.direction).length(), 1e-6);
        EXPECT_LT(distance(p, a * (1 - u - v) + b * u + c * v), GEOMETRY_ROUNDOFF);
        EXPECT_TRUE(u >= 0 && v >= 0 && u + v <= 1 + GEOMETRY_ROUNDOFF);
        const Vec3 N = normals[0] * (1 - u - v) + normals[1] * u + normals[2] * v;
        EXPECT_LT(distance(at(t.N, i), N.normalized()), GEOMETRY_ROUNDOFF);
        EXPECT_NEAR(at(t.T, i).dot(at(t.N, i)), 0, GEOMETRY_ROUNDOFF);
        EXPECT_NEAR(at(t.T, i).length(), 1, GEOMETRY_ROUNDOFF);
    });
}

// Its corners have from three to six triangles, so that only the weights make their normals alike.
TEST(Mesh, SmoothNormalsOfACubePointAlongItsDiagonals) {
    std::vector<Vec3> corners;
    for (int i = 0; i < 8; ++i) corners.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    const std::vector<Mesh::Face> faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                           {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    const Mesh cube(corners, faces);
    for (int i = 0; i < 8; ++i) EXPECT_LT(distance(cube.normals[i], corners[i].normalized()), GEOMETRY_ROUNDOFF);
}

TEST(Mesh, TangentsFollowUOrRunAroundTheYAxis) {
    const std::vector<Vec3> square = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
    const std::vector<Mesh::Face> faces = {{0, 1, 2}, {0, 2, 3}};
    const Mesh upright(square, faces), turned(square, faces, {}, {{0, 0}, {0, 1}, {1, 1}, {1, 0}});
    for (int i = 0; i < 4; ++i) {
        EXPECT_LT(distance(upright.tangents[i], {1, 0, 0}), GEOMETRY_ROUNDOFF);
        EXPECT_LT(distance(turned.tangents[i], {0, 1, 0}), GEOMETRY_ROUNDOFF);
    }
    const Mesh round = ball(3);
    for (std::size_t i = 0; i < round.vertices.size(); ++i) {
        EXPECT_NEAR(round.normals[i].dot(round.tangents[i]), 0, GEOMETRY_ROUNDOFF);
        EXPECT_NEAR(round.tangents[i].length(), 1, GEOMETRY_ROUNDOFF);
    }
}

TEST(Mesh, RefusesAFaceWithoutVertex) { EXPECT_THROW(Mesh({Vec3(0)}, {{0, 0, 1}}), std::invalid_argument); }

TEST(Light, PointLightFallsWithTheSquareOfTheDistance) {
    const Vec3 light(0.5, 2, -0.3), intensity(1, 2, 3);
    Scene scene;
    scene.add(Plane{Vec3(0), {0, 1, 0}, {1, 0, 0}, 3});
    scene.add(Light{false, light, intensity});
    const Camera camera({0, 4, 4}, Vec3(0), {0, 1, 0}, 50);
    const Trace t = scene.trace(camera, SIZE, SIZE);
    for_pixels_of(0, t, camera, [&](std::size_t i, const Ray&) {
        const double r = distance(light, at(t.position, i));
        EXPECT_LT(distance(at(t.E, i), intensity * (light.y / (r * r * r))), GEOMETRY_ROUNDOFF);
        EXPECT_LT(distance(at(t.L, i), (light - at(t.position, i)) / r), GEOMETRY_ROUNDOFF);
    });
}

// A sphere of radius 1 above the plane y = 0: in parallel light from above its shadow is the disc of radius 1.
TEST(Light, ShadowOfASphereIsADisc) {
    Scene scene;
    scene.add(Plane{Vec3(0), {0, 1, 0}, {1, 0, 0}, 3});
    scene.add(Sphere{{0, 1.5, 0}, 1});
    scene.add(directional({0, 1, 0}, Vec3(1)));
    scene.add(Light{false, {0, 0.4, 0}, Vec3(1)});  // under the sphere, which it does not let shade the plane
    const Camera camera({0, 0.8, 5}, {0, 0.3, 0}, {0, 1, 0}, 50);
    const Trace t = scene.trace(camera, SIZE, SIZE);
    const Trace unshaded = scene.trace(camera, SIZE, SIZE, false);
    const std::size_t second = static_cast<std::size_t>(SIZE) * SIZE;
    int shaded = 0;
    for_pixels_of(0, t, camera, [&](std::size_t i, const Ray&) {
        const Vec3 p = at(t.position, i);
        const double from_axis = std::hypot(p.x, p.z);
        EXPECT_EQ(at(unshaded.E, i), Vec3(1));
        EXPECT_GT(at(t.E, second + i).x, 0);
        if (std::abs(from_axis - 1) < 1e-4) return;
        EXPECT_EQ(at(t.E, i), Vec3(from_axis < 1 ? 0 : 1)) << "at " << p;
        shaded += from_axis < 1;
    });
    EXPECT_GT(shaded, 20);
}

// On a convex body nothing shades a triangle that faces the light, wherever it lies and however near grazing.
TEST(Light, ConvexMeshDoesNotShadeItself) {
    for (const Vec3& center : {Vec3(0), Vec3(100, -20, 50)}) {
        const Mesh mesh = ball(4, center);
        Scene scene;
        scene.add(mesh);
        scene.add(directional({1, 0.3, 0.2}, Vec3(1)));
        const Camera camera(center + Vec3(1, 1, 3), center, {0, 1, 0}, 45);
        const Trace t = scene.trace(camera, SIZE, SIZE);
        for_pixels_of(0, t, camera, [&](std::size_t i, const Ray&) {
            const auto& [a, b, c] = mesh.faces[t.primitive[i]];
            const Vec3 facing = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
            const double cosine = at(t.N, i).dot(at(t.L, i));
            if (facing.dot(at(t.L, i)) > 0 && cosine > 0) { EXPECT_DOUBLE_EQ(at(t.E, i).x, cosine); }
        });
    }
}

// The eye is near, the corners are far and rounded: a plane that is tilted anyhow is still lit everywhere.
TEST(Light, LargePlaneDoesNotShadeItself) {
    for (int i = 0; i < 50; ++i) {
        const Vec3 N = Vec3(std::sin(i), 1, std::cos(i * 1.7)).normalized(), T = tangent_around_y(N);
        Scene scene;
        scene.add(Plane{{0.3, -0.7, 0.1}, N, T, 200});
        scene.add(directional(N + T * 20, Vec3(1)));
        const Camera camera(N * 2 + T, Vec3(0), {0, 0.1, 1}, 45);
        const Trace t = scene.trace(camera, SIZE, SIZE);
        for_pixels_of(0, t, camera, [&](std::size_t pixel, const Ray&) { EXPECT_GT(at(t.E, pixel).x, 0); });
    }
}

TEST(Scene, LeavesMissedPixelsEmpty) {
    Scene scene;
    scene.add(Sphere{Vec3(0), 0.01});
    scene.add(directional({0, 1, 0}, Vec3(1)));
    const Trace t = scene.trace(Camera({0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 90), SIZE, SIZE);
    EXPECT_EQ(t.object[0], -1);
    EXPECT_EQ(t.primitive[0], -1);
    EXPECT_TRUE(std::isinf(t.depth[0]));
    for (const auto* image : {&t.N, &t.T, &t.V, &t.position, &t.L, &t.E}) EXPECT_EQ(at(*image, 0), Vec3(0));
}

TEST(Scene, RefusesObjectsThatAreNotThere) {
    Scene scene;
    const int sphere = scene.add(Sphere{Vec3(0), 1});
    EXPECT_THROW(scene.set_material(sphere + 1, {}), std::invalid_argument);
    EXPECT_THROW(scene.set_material(-1, {}), std::invalid_argument);
    EXPECT_THROW(scene.mesh(sphere), std::invalid_argument);
}

// How many there may be is Embree's affair.
TEST(Scene, SaysThatThereAreTooMany) {
    const Sphere sphere{Vec3(0), 1};
    std::vector<Scene> scenes;
    std::string message = "too many scenes";
    try {
        while (scenes.size() < 1500) scenes.emplace_back().add(sphere);
    } catch (const std::runtime_error& error) {
        message = error.what();
    }
    EXPECT_NE(message.find("scenes"), std::string::npos) << message;
    scenes.clear();
    EXPECT_EQ(Scene().add(sphere), 0);
}

TEST(Scene, LambertSphereLitFromTheCamera) {
    const Vec3 albedo(0.2, 0.5, 0.8);
    Scene scene;
    scene.set_material(scene.add(Sphere{Vec3(0), 1}), lambert(albedo));
    scene.add(directional({0, 0, 1}, Vec3(PI)));
    const Camera camera({0, 0, 5}, Vec3(0), {0, 1, 0}, 30);
    const auto image = scene.beauty(camera, SIZE, SIZE);
    for_pixels_of(0, scene.trace(camera, SIZE, SIZE), camera, [&](std::size_t i, const Ray& ray) {
        const Vec3 perpendicular = ray.origin - ray.direction * ray.origin.dot(ray.direction);
        const double half_chord = std::sqrt(1 - perpendicular.length2());
        const double cosine = (perpendicular - ray.direction * half_chord).z;
        EXPECT_LT(distance(at(image, i), albedo * std::max(cosine, 0.0)), 1e-11);
    });
}

// A scene with everything in it: two lobes, two lights, three shapes, shadows.
Scene still_life() {
    Scene scene;
    Material plastic = lambert({0.4, 0.3, 0.2});
    plastic.lobes.emplace_back(GGX, Lobe::Parameters{{"f0", {0.04, 0.05, 0.06}}, {"alpha", {0.2}}});
    scene.set_material(scene.add(ball(3)), plastic);
    scene.set_material(scene.add(Plane{{0, -1, 0}, {0, 1, 0}, {1, 0, 0}, 4}), lambert(Vec3(0.5)));
    scene.set_material(scene.add(Sphere{{1.2, -0.4, 0.8}, 0.6}), plastic);
    scene.add(directional({0.5, 1, 0.6}, {1, 0.9, 0.8}));
    scene.add(Light{false, {-2, 2, 2}, {3, 4, 5}});
    return scene;
}

const Camera ABOVE({1, 2, 5}, {0.2, -0.2, 0}, {0, 1, 0}, 45);

TEST(Scene, BeautyIsTheSumOverLobesAndLights) {
    const Scene scene = still_life();
    const Trace t = scene.trace(ABOVE, SIZE, SIZE);
    const auto image = scene.beauty(ABOVE, SIZE, SIZE);
    const auto value = [](const char* key, std::vector<double> arguments) {
        std::vector<double> f(3);
        evaluate(*find_function(key), arguments, f);
        return Vec3(f[0], f[1], f[2]);
    };
    for (std::size_t i = 0; i < SIZE * SIZE; ++i) {
        Vec3 sum(0);
        for (std::size_t light = 0; light < 2 && t.object[i] >= 0; ++light) {
            const std::size_t at_light = light * SIZE * SIZE + i;
            const Vec3 N = at(t.N, i), V = at(t.V, i), L = at(t.L, at_light), E = at(t.E, at_light);
            const bool grey = t.object[i] == 1;
            const Vec3 albedo = grey ? Vec3(0.5) : Vec3(0.4, 0.3, 0.2);
            sum += E * value(LAMBERT, {N.x, N.y, N.z, V.x, V.y, V.z, L.x, L.y, L.z, albedo.x, albedo.y, albedo.z});
            if (!grey) sum += E * value(GGX, {N.x, N.y, N.z, V.x, V.y, V.z, L.x, L.y, L.z, 0.04, 0.05, 0.06, 0.2});
        }
        EXPECT_LT(distance(at(image, i), sum), 1e-12 * (1 + sum.length()));
    }
}

TEST(Scene, ThreadsDoNotChangeABit) {
    const Scene scene = still_life();
    set_threads(1);
    const auto alone = scene.beauty(ABOVE, SIZE, SIZE, 4, 7);
    set_threads(2);
    const auto together = scene.beauty(ABOVE, SIZE, SIZE, 4, 7), rebuilt = still_life().beauty(ABOVE, SIZE, SIZE, 4, 7);
    set_threads(0);
    EXPECT_EQ(alone, together);
    EXPECT_EQ(alone, rebuilt);
    EXPECT_NE(alone, scene.beauty(ABOVE, SIZE, SIZE, 4, 8));
    EXPECT_THROW(set_threads(-1), std::invalid_argument);
}

// A square that covers a known part of the image: the sum of its antialiased pixels is that part.
TEST(Scene, SamplesCoverThePixelEvenly) {
    Scene scene;
    scene.set_material(scene.add(Plane{Vec3(0), {0, 0, 1}, {1, 0, 0}, 0.4321}), lambert(Vec3(PI)));
    scene.add(directional({0, 0, 1}, Vec3(1)));
    const Camera camera({0, 0, 1}, Vec3(0), {0, 1, 0}, 90);  // sees a square of edge 2
    const auto image = scene.beauty(camera, SIZE, SIZE, 256);
    double covered = 0;
    for (std::size_t i = 0; i < SIZE * SIZE; ++i) covered += at(image, i).x / (SIZE * SIZE);
    EXPECT_NEAR(covered, 0.4321 * 0.4321, 2e-5);
}

TEST(PixelSamples, AreTheCentreOrALowDiscrepancySet) {
    EXPECT_EQ(PixelSamples(5, 1, 9).next(), Vec2(0.5));
    PixelSamples positions(5, 64, 9);
    int per_cell[4][4] = {};
    for (int i = 0; i < 64; ++i) {
        const Vec2 p = positions.next();
        ASSERT_TRUE(p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1);
        ++per_cell[static_cast<int>(4 * p.x)][static_cast<int>(4 * p.y)];
    }
    for (const auto& row : per_cell)
        for (int count : row) EXPECT_NEAR(count, 4, 2);
}

TEST(Lobe, NamesWhatIsKnown) {
    const auto message = [](const char* key, const Lobe::Parameters& parameters) -> std::string {
        try {
            Lobe(key, parameters);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_NE(message("lobe_Nobody(vec3)", {}).find(LAMBERT), std::string::npos);
    EXPECT_NE(message(LAMBERT, {}).find("albedo is missing"), std::string::npos);
    EXPECT_NE(message(LAMBERT, {{"albedo", {1, 1, 1}}, {"alpha", {1}}}).find("no parameter alpha"), std::string::npos);
    EXPECT_NE(message(LAMBERT, {{"albedo", {1}}}).find("takes 3 numbers"), std::string::npos);
    EXPECT_EQ(message(LAMBERT, {{"albedo", {1, 1, 1}}}), "");
}

}  // namespace
}  // namespace lobe
