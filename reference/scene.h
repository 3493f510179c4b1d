// Ray tracer of the reference: shapes, lights and materials in, per-pixel geometry or radiance out.
#pragma once

#include "embree.h"
#include "light.h"
#include "material.h"
#include "shape.h"

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace lobe {

// Threads that everything in the reference uses from now on; 0 is as many as there are cores. Throws
// std::invalid_argument where count is negative.
void set_threads(int count);

// What the camera sees through the pixel centres. Images are row by row from the top, all 0 where nothing is hit,
// except that depth is infinite and object and primitive are -1 there.
struct Trace {
    std::vector<double> N, T, V, position;        // [h, w, 3]; unit vectors, V towards the eye, N not flipped to it
    std::vector<double> uv;                       // [h, w, 2]
    std::vector<double> depth;                    // [h, w], distance along the ray
    std::vector<std::int32_t> object, primitive;  // [h, w]
    // of each light without extent, in the order of adding
    std::vector<double> L;  // [lights, h, w, 3], unit, towards the light
    std::vector<double> E;  // [lights, h, w, 3], irradiance x visibility x max(N.L, 0)
};

struct RayCount {
    std::size_t primary, shadow;
};

class Guide;

using Source = std::variant<Light, RectangleLight, SphereLight, Environment>;

class Scene {
public:
    static constexpr int NONE = -1;

    struct Object {
        std::variant<Mesh, Sphere, Plane> shape;
        double offset;  // by which rays start above the surface
        Material material;
        int source = NONE;     // the light that it is
        bool turned = false;  // a lobe of its material takes a tangent
    };
    struct Found {
        int object;
        std::uint32_t primitive;
        Surface surface;
    };

    Scene();

    // Each returns the id of the object, counted from 0. A new object is black until set_material.
    int add(Mesh mesh);
    int add(Sphere sphere);
    int add(Plane plane);
    // The lights that have an extent are objects, too, black ones; their ids are returned.
    int add_rectangle_light(const Plane& place, const Vec3& radiance);
    int add_sphere_light(const Sphere& place, const Vec3& radiance);
    void add(const Light& light) { add_source(light); }
    void set_environment(Environment environment);  // in place of the one before, if any
    // The functions that take an id throw std::invalid_argument where no object (or no mesh) has it.
    void set_material(int id, Material material);
    const Mesh& mesh(int id) const;
    // Lights of all kinds in the order of adding, but the environment last. Their names are kind and number.
    const std::vector<Source>& sources() const { return sources_; }
    std::vector<std::string> light_names() const;
    std::vector<Light> lights() const;  // those without extent
    const std::vector<Object>& objects() const { return objects_; }
    // Changes with everything that is added or set.
    int version() const { return version_; }
    std::uint64_t fingerprint() const;

    // The object that the point lies within: from there, all of many rays first meet its surface from behind, but for
    // those that meet a light. NONE where there is no such object.
    int enclosing(const Vec3& point) const;
    // Point and area lights that an object which is no glass encloses as a whole, so that their light does not get
    // out: (light, object).
    std::vector<std::pair<int, int>> enclosed_lights() const;

    // Photons of the scene as it is, for paths of a depth (guide.h): made once, however many renders ask. Waits where
    // another thread makes it.
    std::shared_ptr<const Guide> guide(int depth, std::size_t photons) const;

    // The first surface that a ray meets. Detail::normals leaves out the tangent where the material takes none.
    std::optional<Found> find(const Ray& ray, Detail detail = Detail::all) const;
    // The ray that leaves a surface towards L.
    Ray leaving(const Found& found, const Vec3& L) const;
    // Whether nothing stands on the way from a surface towards L, up to the distance.
    bool visible(const Found& found, const Vec3& L, double distance) const;
    // Whether nothing stands between two surfaces, pair by pair: 16 at once cost a fifth less than by themselves.
    struct Pair {
        const Found *from, *to;
    };
    void visible(const Pair* pairs, int count, bool* answers) const;

    // Images of width x height pixels, both at least 1; of a trace only some rows, so that a large picture needs no
    // more memory than its widest strip: those from `first` on, as many as `rows`, or all that follow where that is 0.
    Trace trace(const Camera& camera, int width, int height, bool shadows = true, int first = 0, int rows = 0) const;
    // Sum over lobes and lights without extent of f E, [h, w, 3], linear RGB, background 0: the mean over `samples`
    // positions of each
    // pixel; the pixel centre where there is one sample, else an R2 sequence that is shifted from pixel to pixel.
    // The number of threads does not change a bit of it.
    std::vector<double> beauty(const Camera& camera, int width, int height, int samples = 1, std::uint64_t seed = 0,
                               bool shadows = true) const;
    // The yardstick of benchmarks: nothing but the Embree calls of beauty() with one directional light, so that the
    // difference in time is what the double precision and the lobes cost. Returns the rays traced; throws
    // std::invalid_argument where the first light is not directional.
    RayCount bare_loop(const Camera& camera, int width, int height, int samples) const;

private:
    template <class Shape> int add_shape(Shape shape, embree::Geometry geometry);
    int add_source(Source source);
    void require(int id) const;
    Vec3 irradiance(const Found& found, const Incidence& light, bool shadows) const;
    Vec3 radiance(const Ray& ray, bool shadows, const std::vector<Light>& lights,
                  std::vector<Material>& materials) const;

    embree::Device device_;
    embree::Scene scene_;
    std::vector<Object> objects_;
    std::vector<Source> sources_;
    int version_ = 0;

    struct Guides {
        std::mutex lock;
        int version = 0, depth = 0;                               // for which they are
        std::map<std::size_t, std::shared_ptr<const Guide>> made;  // by number of photons
    };
    std::unique_ptr<Guides> guides_ = std::make_unique<Guides>();  // so that a scene can be moved
};

}  // namespace lobe
