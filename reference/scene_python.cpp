// Scenes of the module lobe.reference: arrays are checked here, everything else is scene.h's.
#include "python.h"

#include "scene.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

namespace {

using namespace lobe;
using namespace nb::literals;

template <class T> using Array = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;

// Shape as in the error messages: a row count of ANY stands for all.
constexpr std::size_t ANY = static_cast<std::size_t>(-1);

std::string shape_name(std::initializer_list<std::size_t> shape) {
    std::string s;
    for (std::size_t n : shape) s += (s.empty() ? "" : ", ") + (n == ANY ? std::string("n") : std::to_string(n));
    return "[" + s + "]";
}

// Anything that NumPy takes for an array of T, as one, of the given shape.
template <class T> Array<T> array(nb::handle given, const std::string& name, std::initializer_list<std::size_t> shape) {
    const auto fail = [&](const std::string& got) {
        throw std::invalid_argument(name + ": expected an array of shape " + shape_name(shape) + ", got " + got);
    };
    nb::object converted;
    try {
        const char* type = std::is_same_v<T, double> ? "f8" : std::is_same_v<T, float> ? "f4" : "u4";
        converted = nb::module_::import_("numpy").attr("ascontiguousarray")(given, type);
    } catch (const nb::python_error&) {
        fail(nb::str(nb::type_name(given.type())).c_str());
    }
    const auto a = nb::cast<Array<T>>(converted);
    bool fits = a.ndim() == shape.size();
    for (std::size_t i = 0; fits && i < shape.size(); ++i)
        fits = shape.begin()[i] == ANY || shape.begin()[i] == a.shape(i);
    if (!fits) fail(nb::str(nb::object(converted.attr("shape"))).c_str());
    return a;
}

constexpr double LARGEST = 1e18;  // Embree takes no coordinates beyond 1.8e18

void check(const double* p, std::size_t count, const std::string& name) {
    for (std::size_t i = 0; i < count; ++i)
        if (!(std::abs(p[i]) <= LARGEST))
            throw std::invalid_argument(name + ": expected finite numbers, at most 1e18, got " + std::to_string(p[i]));
}

Vec3 vector(nb::handle given, const std::string& name) {
    const auto a = array<double>(given, name, {3});
    check(a.data(), 3, name);
    return {a.data()[0], a.data()[1], a.data()[2]};
}

Vec3 direction(nb::handle given, const std::string& name) {
    const Vec3 v = vector(given, name).normalized();
    if (v == Vec3(0)) throw std::invalid_argument(name + ": a null vector has no direction");
    return v;
}

Vec3 colour(nb::handle given, const std::string& name) {
    const Vec3 c = vector(given, name);
    if (c.x < 0 || c.y < 0 || c.z < 0) throw std::invalid_argument(name + ": expected no negative number");
    return c;
}

double length(double given, const std::string& name) {
    if (!(given > 0 && given <= LARGEST))
        throw std::invalid_argument(name + ": expected a number above 0, at most 1e18, got " + std::to_string(given));
    return given;
}

// Rows of n numbers, one for each of `count` vertices; none where None is given.
template <class V> std::vector<V> rows(nb::handle given, const std::string& name, std::size_t count = ANY) {
    if (given.is_none()) return {};
    const auto a = array<double>(given, name, {count, V::dimensions()});
    check(a.data(), a.size(), name);
    std::vector<V> list(a.shape(0));
    std::memcpy(static_cast<void*>(list.data()), a.data(), a.nbytes());
    return list;
}

int add_mesh(Scene& scene, nb::handle vertices, nb::handle faces, nb::handle normals, nb::handle uv,
             nb::handle tangents) {
    auto points = rows<Vec3>(vertices, "vertices");
    const auto indices = array<std::uint32_t>(faces, "faces", {ANY, 3});
    if (points.empty() || indices.shape(0) == 0)
        throw std::invalid_argument("vertices, faces: expected at least one triangle, got none");
    std::vector<Mesh::Face> triangles(indices.shape(0));
    std::memcpy(triangles.data(), indices.data(), indices.nbytes());
    const std::size_t count = points.size();
    return scene.add(Mesh(std::move(points), std::move(triangles), rows<Vec3>(normals, "normals", count),
                          rows<Vec2>(uv, "uv", count), rows<Vec3>(tangents, "tangents", count)));
}

int add_sphere(Scene& scene, nb::handle center, double radius) {
    return scene.add(Sphere{vector(center, "center"), length(radius, "radius")});
}

int add_plane(Scene& scene, nb::handle center, nb::handle normal, double half_size, nb::handle tangent) {
    const Vec3 N = direction(normal, "normal");
    const Vec3 T = tangent.is_none() ? tangent_around_y(N) : orthonormal_tangent(N, direction(tangent, "tangent"));
    return scene.add(Plane{vector(center, "center"), N, T, length(half_size, "half_size")});
}

int add_rectangle_light(Scene& scene, nb::handle center, nb::handle half_u, nb::handle half_v, nb::handle radiance) {
    const Vec3 u = vector(half_u, "half_u"), v = vector(half_v, "half_v");
    const Vec3 x = direction(half_u, "half_u"), y = direction(half_v, "half_v");
    if (std::abs(x.dot(y)) > 1e-6)
        throw std::invalid_argument("half_u, half_v: expected perpendicular vectors, the cosine between them is " +
                                    std::to_string(x.dot(y)));
    const Vec3 N = x.cross(y).normalized();
    return scene.add_rectangle_light(Plane{vector(center, "center"), N, x, u.length(), v.length()},
                                     colour(radiance, "radiance"));
}

int add_sphere_light(Scene& scene, nb::handle center, double radius, nb::handle radiance) {
    return scene.add_sphere_light(Sphere{vector(center, "center"), length(radius, "radius")},
                                  colour(radiance, "radiance"));
}

void set_environment(Scene& scene, nb::handle given, double rotation_degrees) {
    check(&rotation_degrees, 1, "rotation_degrees");
    const auto a = array<float>(given, "environment", {ANY, ANY, 3});
    if (a.size() == 0) throw std::invalid_argument("environment: expected at least one pixel, got none");
    scene.set_environment(Environment({a.data(), a.data() + a.size()}, static_cast<int>(a.shape(1)),
                                      static_cast<int>(a.shape(0)), rotation_degrees));
}

std::vector<double> numbers(nb::handle given, const std::string& name) {
    const auto a = array<double>(nb::module_::import_("numpy").attr("atleast_1d")(given), name, {ANY});
    check(a.data(), a.size(), name);
    return {a.data(), a.data() + a.size()};
}

Vec3 entry(nb::dict given, const char* owner, const char* key) {
    return colour(given[key], std::string(owner) + ": " + key);
}

std::optional<Mirror> mirror(nb::object given) {
    if (given.is_none()) return std::nullopt;
    nb::dict d;
    if (nb::try_cast(given, d)) {
        if (d.size() == 1 && d.contains("f0")) return Mirror{.f0 = entry(d, "mirror", "f0")};
        if (d.size() == 2 && d.contains("eta") && d.contains("k"))
            return Mirror{.f0 = {}, .eta = entry(d, "mirror", "eta"), .k = entry(d, "mirror", "k")};
    }
    throw std::invalid_argument("mirror: expected {'f0': rgb} or {'eta': rgb, 'k': rgb}");
}

std::optional<Glass> glass(nb::object given) {
    if (given.is_none()) return std::nullopt;
    nb::dict d;
    if (!nb::try_cast(given, d) || d.size() != 1 || !d.contains("eta"))
        throw std::invalid_argument("glass: expected {'eta': number}");
    return Glass{length(numbers(d["eta"], "glass: eta").at(0), "glass: eta")};
}

void set_material(Scene& scene, int id, nb::list lobes, nb::object mirror_given, nb::object glass_given) {
    Material material{{}, mirror(mirror_given), glass(glass_given)};
    for (nb::handle entry : lobes) {
        std::pair<std::string, nb::dict> lobe;
        if (!nb::try_cast(entry, lobe)) throw std::invalid_argument("lobes: expected pairs (key, {parameter: value})");
        Lobe::Parameters parameters;
        for (auto [key, value] : lobe.second) {
            const std::string name = nb::str(key).c_str();
            parameters[name] = numbers(value, lobe.first + ": " + name);
        }
        material.lobes.emplace_back(lobe.first, parameters);
    }
    scene.set_material(id, std::move(material));
}

void check_image(int width, int height, int samples) {
    if (width < 1 || height < 1 || samples < 1)
        throw std::invalid_argument("width, height, samples: expected at least 1, got " + std::to_string(width) + ", " +
                                    std::to_string(height) + ", " + std::to_string(samples));
}

nb::dict trace(const Scene& scene, const Camera& camera, int width, int height, bool shadows, int first, int rows) {
    check_image(width, height, 1);
    if (first < 0 || first >= height || rows < 0 || rows > height - first)
        throw std::invalid_argument("first, rows: expected rows of the picture, got " + std::to_string(first) + ", " +
                                    std::to_string(rows) + " of " + std::to_string(height));
    Trace t;
    {
        nb::gil_scoped_release unlocked;
        t = scene.trace(camera, width, height, shadows, first, rows);
    }
    const std::size_t h = rows ? rows : height - first, w = width, lights = scene.lights().size();
    nb::dict arrays;
    arrays["N"] = to_numpy(std::move(t.N), {h, w, 3});
    arrays["T"] = to_numpy(std::move(t.T), {h, w, 3});
    arrays["V"] = to_numpy(std::move(t.V), {h, w, 3});
    arrays["position"] = to_numpy(std::move(t.position), {h, w, 3});
    arrays["uv"] = to_numpy(std::move(t.uv), {h, w, 2});
    arrays["depth"] = to_numpy(std::move(t.depth), {h, w});
    arrays["object"] = to_numpy(std::move(t.object), {h, w});
    arrays["primitive"] = to_numpy(std::move(t.primitive), {h, w});
    arrays["L"] = to_numpy(std::move(t.L), {lights, h, w, 3});
    arrays["E"] = to_numpy(std::move(t.E), {lights, h, w, 3});
    return arrays;
}

nb::object beauty(const Scene& scene, const Camera& camera, int width, int height, int samples, std::uint64_t seed,
                  bool shadows) {
    check_image(width, height, samples);
    std::vector<double> image;
    {
        nb::gil_scoped_release unlocked;
        image = scene.beauty(camera, width, height, samples, seed, shadows);
    }
    return to_numpy(std::move(image), {static_cast<std::size_t>(height), static_cast<std::size_t>(width), 3});
}

nb::tuple bare_loop(const Scene& scene, const Camera& camera, int width, int height, int samples) {
    check_image(width, height, samples);
    nb::gil_scoped_release unlocked;
    const RayCount rays = scene.bare_loop(camera, width, height, samples);
    nb::gil_scoped_acquire locked;
    return nb::make_tuple(rays.primary, rays.shadow);
}

nb::object vectors_of(const std::vector<Vec3>& list) {
    std::vector<double> flat(3 * list.size());
    std::memcpy(flat.data(), list.data(), flat.size() * sizeof(double));
    return to_numpy(std::move(flat), {list.size(), 3});
}

nb::tuple tuple(const Vec3& v) { return nb::make_tuple(v.x, v.y, v.z); }

}  // namespace

void bind_scene(nb::module_& m) {
    m.def("set_threads", &set_threads, "count"_a, "Threads that the reference uses from now on; 0: one for each core.");
    m.attr("embree_version") = RTC_VERSION_STRING;

    nb::class_<Camera>(m, "Camera", "Pinhole camera; fov_y_degrees is the full vertical angle of view.")
        .def("__init__", [](Camera* self, nb::handle eye, nb::handle target, nb::handle up, double fov_y_degrees) {
            new (self) Camera(vector(eye, "eye"), vector(target, "target"), vector(up, "up"), fov_y_degrees);
        }, "eye"_a, "target"_a, "up"_a, "fov_y_degrees"_a)
        .def_prop_ro("eye", [](const Camera& c) { return tuple(c.eye); })
        .def_prop_ro("right", [](const Camera& c) { return tuple(c.right); })
        .def_prop_ro("up", [](const Camera& c) { return tuple(c.up); }, "Orthogonal to right and forward.")
        .def_prop_ro("forward", [](const Camera& c) { return tuple(c.forward); })
        .def_ro("fov_y_degrees", &Camera::fov_y_degrees);

    nb::class_<Scene>(m, "Scene", "Shapes with lobes on them, and lights. ValueError on bad input.")
        .def(nb::init<>())
        .def("add_mesh", &add_mesh, "vertices"_a, "faces"_a, "normals"_a = nb::none(), "uv"_a = nb::none(),
             "tangents"_a = nb::none(),
             "Triangles: vertices [v,3], faces [f,3], and for each vertex normals [v,3], uv [v,2], tangents [v,3].\n"
             "Missing normals are smooth (face normals weighted with area and angle); missing tangents follow u, or\n"
             "run around the y axis where there is no uv. Returns the object's id.")
        .def("add_sphere", &add_sphere, "center"_a, "radius"_a,
             "Exact sphere; T runs around the y axis, uv are longitude and latitude in 0..1. Returns the object's id.")
        .def("add_plane", &add_plane, "center"_a, "normal"_a, "half_size"_a, "tangent"_a = nb::none(),
             "Exact square of edge 2 half_size. T is the tangent made orthogonal to the normal; where there is none\n"
             "it runs around the y axis. uv in 0..1 along T and N x T. Returns the object's id.")
        .def("set_material", &set_material, "id"_a, "lobes"_a, "mirror"_a = nb::none(), "glass"_a = nb::none(),
             "Sum of lobes: a list of (key, parameters), such as ('lobe_Lambert(vec3,vec3,vec3,vec3)',\n"
             "{'albedo': (0.5, 0.5, 0.5)}). An object without material is black. For Render, too: mirror, an ideal\n"
             "one, {'f0': rgb} with Schlick's reflectance or {'eta': rgb, 'k': rgb} with the exact one; and glass,\n"
             "{'eta': n}, an ideal boundary, n being the index on the side from which the normal points away, over that\n"
             "of the other.")
        .def("add_directional_light", [](Scene& scene, nb::handle towards, nb::handle rgb) {
            scene.add(Light{true, direction(towards, "direction_towards_light"), colour(rgb, "irradiance_rgb")});
        }, "direction_towards_light"_a, "irradiance_rgb"_a, "irradiance_rgb: on a surface that faces the light.")
        .def("add_point_light", [](Scene& scene, nb::handle position, nb::handle rgb) {
            scene.add(Light{false, vector(position, "position"), colour(rgb, "intensity_rgb")});
        }, "position"_a, "intensity_rgb"_a, "intensity_rgb: irradiance at distance 1, facing the light.")
        .def("add_rectangle_light", &add_rectangle_light, "center"_a, "half_u"_a, "half_v"_a, "radiance"_a,
             "A rectangle, center +- half_u +- half_v, that emits rgb radiance on the side of half_u x half_v. Like\n"
             "the next one it is an object, seen and in the way of light, and its id is returned. For Render alone.")
        .def("add_sphere_light", &add_sphere_light, "center"_a, "radius"_a, "radiance"_a,
             "A sphere that emits rgb radiance outwards.")
        .def("set_environment", &set_environment, "pixels"_a, "rotation_degrees"_a = 0.0,
             "Radiance from far away, [h,w,3] latitude-longitude: +y on top, in the first row, -z in the middle, +x\n"
             "right of it. rotation_degrees turns it about +y, from +z towards +x. For Render alone.")
        .def_prop_ro("light_names", &Scene::light_names, "In the order of adding, but the environment last.")
        .def("enclosed_lights", &Scene::enclosed_lights,
             "Pairs (light, object): lights that lie within an object which is no glass, so that none of it gets out.")
        .def("enclosing", [](const Scene& s, nb::handle point) { return s.enclosing(vector(point, "point")); },
             "point"_a, "The object that the point lies within: from there, all rays first meet it from behind. -1: none.")
        .def("normals", [](const Scene& s, int id) { return vectors_of(s.mesh(id).normals); }, "id"_a,
             "Unit normals of a mesh as the tracer uses them, [v,3].")
        .def("tangents", [](const Scene& s, int id) { return vectors_of(s.mesh(id).tangents); }, "id"_a,
             "Unit tangents of a mesh as the tracer uses them, orthogonal to the normals, [v,3].")
        .def("trace", &trace, "camera"_a, "width"_a, "height"_a, "shadows"_a = true, "first"_a = 0, "rows"_a = 0,
             "What is seen through the pixel centres, row 0 on top, as a dict of arrays: N, T, V, position [h,w,3]\n"
             "(unit vectors, N not flipped, V towards the eye), uv [h,w,2], depth [h,w] (along the ray), object and\n"
             "primitive [h,w] (int32), and L and E [lights,h,w,3]: E = irradiance times visibility times max(N.L, 0).\n"
             "Where nothing is hit: 0, but depth inf, object and primitive -1. Of h rows only `rows` from `first` on, or\n"
             "all that follow where that is 0.")
        .def("beauty", &beauty, "camera"_a, "width"_a, "height"_a, "samples"_a = 1, "seed"_a = 0, "shadows"_a = true,
             "Sum of f E over lobes and lights, [h,w,3], linear RGB, background 0: at the pixel centre, or the mean\n"
             "over `samples` positions in the pixel. The same to the last bit for every number of threads.")
        .def("bare_loop", &bare_loop, "camera"_a, "width"_a, "height"_a, "samples"_a = 1,
             "For benchmarks: only the Embree calls of beauty() with the first light, which must be directional.\n"
             "Returns the numbers of primary and shadow rays.");
}
