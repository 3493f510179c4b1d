#include "scene.h"

#include "fingerprint.h"
#include "pixels.h"

#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

namespace lobe {
namespace {

embree::Device new_device() {
    embree::Device device(rtcNewDevice(nullptr), &rtcReleaseDevice);
    if (!device)  // each takes a key of thread-specific data, of which glibc gives 1024 to a process
        throw std::runtime_error("Embree gives no device (error " + std::to_string(rtcGetDeviceError(nullptr)) +
                                 "): where there are about 1000 scenes, release some");
    return device;
}

embree::Scene new_scene(RTCDevice device) {
    embree::Scene scene(rtcNewScene(device), &rtcReleaseScene);
    if (!scene)
        throw std::runtime_error("Embree gives no scene (error " + std::to_string(rtcGetDeviceError(device)) + ")");
    return scene;
}

embree::Geometry new_geometry(RTCDevice device, RTCGeometryType type) {
    return {rtcNewGeometry(device, type), &rtcReleaseGeometry};
}

void write(const Vec3& v, float* p) {
    p[0] = static_cast<float>(v.x), p[1] = static_cast<float>(v.y), p[2] = static_cast<float>(v.z);
}

template <class Points> void set_vertices(RTCGeometry geometry, const Points& points) {
    auto* p = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                          3 * sizeof(float), points.size()));
    for (const Vec3& v : points) write(v, p), p += 3;
}

embree::Geometry geometry_of(RTCDevice device, const Mesh& mesh) {
    auto geometry = new_geometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    set_vertices(geometry.get(), mesh.vertices);
    auto* faces = static_cast<Mesh::Face*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Mesh::Face), mesh.faces.size()));
    std::copy(mesh.faces.begin(), mesh.faces.end(), faces);
    return geometry;
}

embree::Geometry geometry_of(RTCDevice device, const Sphere& sphere) {
    auto geometry = new_geometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    auto* p = static_cast<float*>(rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
                                                          4 * sizeof(float), 1));
    write(sphere.center, p);
    p[3] = static_cast<float>(sphere.radius);
    return geometry;
}

embree::Geometry geometry_of(RTCDevice device, const Plane& plane) {
    auto geometry = new_geometry(device, RTC_GEOMETRY_TYPE_QUAD);
    set_vertices(geometry.get(), plane.corners());
    auto* corners = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(std::uint32_t), 1));
    for (std::uint32_t i = 0; i < 4; ++i) corners[i] = i;
    return geometry;
}

RTCRay float_ray(const Vec3& origin, const Vec3& direction, double length) {
    RTCRay ray;
    ray.org_x = static_cast<float>(origin.x), ray.dir_x = static_cast<float>(direction.x);
    ray.org_y = static_cast<float>(origin.y), ray.dir_y = static_cast<float>(direction.y);
    ray.org_z = static_cast<float>(origin.z), ray.dir_z = static_cast<float>(direction.z);
    ray.tnear = 0, ray.tfar = static_cast<float>(length);
    ray.time = 0, ray.mask = ~0u, ray.id = 0, ray.flags = 0;
    return ray;
}

void set(RTCRay16& rays, int lane, const RTCRay& ray) {
    rays.org_x[lane] = ray.org_x, rays.org_y[lane] = ray.org_y, rays.org_z[lane] = ray.org_z;
    rays.dir_x[lane] = ray.dir_x, rays.dir_y[lane] = ray.dir_y, rays.dir_z[lane] = ray.dir_z;
    rays.tnear[lane] = ray.tnear, rays.tfar[lane] = ray.tfar, rays.time[lane] = ray.time;
    rays.mask[lane] = ray.mask, rays.id[lane] = ray.id, rays.flags[lane] = ray.flags;
}

RTCRayHit first_hit(RTCScene scene, const Ray& ray) {
    RTCRayHit found;
    found.ray = float_ray(ray.origin, ray.direction, std::numeric_limits<double>::infinity());
    found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    embree::intersect(scene, found);
    return found;
}

// Embree marks an occluded ray by a tfar of minus infinity.
bool reaches(RTCScene scene, RTCRay ray) {
    embree::occluded(scene, ray);
    return ray.tfar >= 0;
}

// The i-th of directions that are spread over the sphere.
Vec3 evenly(int i) {
    const Vec2 u = Sample(0, i).pair(0);
    const double z = 1 - 2 * u.x, r = std::sqrt(1 - z * z), phi = 2 * std::numbers::pi * u.y;
    return {r * std::cos(phi), r * std::sin(phi), z};
}

void store(const Vec3& v, std::vector<double>& image, std::size_t pixel) {
    double* p = image.data() + 3 * pixel;
    p[0] = v.x, p[1] = v.y, p[2] = v.z;
}

// Points all over a light, just above its surface where it has one; none where it is infinitely far away.
std::vector<Vec3> shining_points(const Source& source) {
    constexpr int POINTS = 64;
    std::vector<Vec3> points;
    if (const auto* l = std::get_if<Light>(&source); l && !l->at_infinity) points.push_back(l->place);
    if (const auto* l = std::get_if<RectangleLight>(&source)) {
        const Vec3 above = l->center + l->axes.z * (2 * l->offset);
        const auto add = [&](double x, double y) {
            points.push_back(above + l->axes.x * (x * l->half_x) + l->axes.y * (y * l->half_y));
        };
        for (const double x : {-1, 1})
            for (const double y : {-1, 1}) add(x, y);
        for (int i = 0; i < POINTS; ++i) {
            const Vec2 u = Sample(0, i).pair(0);
            add(2 * u.x - 1, 2 * u.y - 1);
        }
    }
    if (const auto* l = std::get_if<SphereLight>(&source))
        for (int i = 0; i < POINTS; ++i) points.push_back(l->center + evenly(i) * (l->radius + 2 * l->offset));
    return points;
}

}  // namespace

void set_threads(int count) {
    using Limit = oneapi::tbb::global_control;
    static std::unique_ptr<Limit> limit;
    if (count < 0) throw std::invalid_argument("threads: expected a count of at least 0, got " + std::to_string(count));
    limit.reset();
    if (count > 0) limit = std::make_unique<Limit>(Limit::max_allowed_parallelism, count);
}

Scene::Scene() : device_(new_device()), scene_(new_scene(device_.get())) {
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);  // no ray slips between two triangles
}

template <class Shape> int Scene::add_shape(Shape shape, embree::Geometry geometry) {
    const auto id = static_cast<unsigned>(objects_.size());
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene_.get(), geometry.get(), id);
    rtcCommitScene(scene_.get());
    if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE)
        throw std::runtime_error("Embree could not build the scene");
    const double offset = SHADOW_OFFSET * shape.reach();
    objects_.push_back({std::move(shape), offset, {}});
    ++version_;
    return static_cast<int>(id);
}

// The environment stays the last one.
int Scene::add_source(Source source) {
    const bool has_environment = !sources_.empty() && std::holds_alternative<Environment>(sources_.back());
    ++version_;
    const auto at = sources_.insert(sources_.end() - has_environment, std::move(source));
    return static_cast<int>(at - sources_.begin());
}

int Scene::add(Mesh mesh) {
    auto geometry = geometry_of(device_.get(), mesh);
    return add_shape(std::move(mesh), std::move(geometry));
}
int Scene::add(Sphere sphere) { return add_shape(sphere, geometry_of(device_.get(), sphere)); }
int Scene::add(Plane plane) { return add_shape(plane, geometry_of(device_.get(), plane)); }

int Scene::add_rectangle_light(const Plane& place, const Vec3& radiance) {
    const int id = add(place);
    objects_[id].source = add_source(RectangleLight{place.center, Basis(place.N, place.T), place.half_x, place.half_y,
                                                    radiance, objects_[id].offset});
    return id;
}

int Scene::add_sphere_light(const Sphere& place, const Vec3& radiance) {
    const int id = add(place);
    objects_[id].source = add_source(SphereLight{place.center, place.radius, radiance, objects_[id].offset});
    return id;
}

void Scene::set_environment(Environment environment) {
    if (!sources_.empty() && std::holds_alternative<Environment>(sources_.back())) sources_.pop_back();
    add_source(std::move(environment));
}

std::vector<std::string> Scene::light_names() const {
    std::vector<std::string> names;
    for (const Source& source : sources_) {
        const Light* light = std::get_if<Light>(&source);
        const std::string kind = light ? light->at_infinity ? "directional" : "point"
                                 : std::holds_alternative<RectangleLight>(source) ? "rectangle"
                                 : std::holds_alternative<SphereLight>(source)    ? "sphere"
                                                                                  : "environment";
        names.push_back(kind == "environment" ? kind : kind + std::to_string(names.size()));
    }
    return names;
}

std::vector<Light> Scene::lights() const {
    std::vector<Light> list;
    for (const Source& source : sources_)
        if (const Light* light = std::get_if<Light>(&source)) list.push_back(*light);
    return list;
}

std::uint64_t Scene::fingerprint() const {
    Fingerprint print;
    const auto add_shape = [&](const auto& shape) {
        using Shape = std::decay_t<decltype(shape)>;
        if constexpr (std::is_same_v<Shape, Mesh>) {
            for (const auto* list : {&shape.vertices, &shape.normals, &shape.tangents})
                print.bytes(list->data(), list->size() * sizeof(Vec3));
            print.bytes(shape.faces.data(), shape.faces.size() * sizeof(Mesh::Face));
        } else if constexpr (std::is_same_v<Shape, Sphere>) {
            print.add(shape.center).add(shape.radius);
        } else {
            print.add(shape.center).add(shape.N).add(shape.T).add(shape.half_x).add(shape.half_y);
        }
    };
    const auto add_source = [&](const auto& light) {
        using Kind = std::decay_t<decltype(light)>;
        if constexpr (std::is_same_v<Kind, Light>) print.add(light.at_infinity).add(light.place).add(light.rgb);
        else if constexpr (std::is_same_v<Kind, Environment>) print.add(light.fingerprint());
        else print.add(light.radiance);
    };
    for (const Object& o : objects_) {
        std::visit(add_shape, o.shape);
        print.add(o.shape.index()).add(o.source).add(o.material.lobes.size());
        for (const Lobe& lobe : o.material.lobes) print.add(lobe.fingerprint());
        if (const auto& m = o.material.mirror) print.add(m->f0.value_or(Vec3(-1))).add(m->eta).add(m->k);
        if (const auto& g = o.material.glass) print.add(g->eta);
    }
    for (const Source& source : sources_) {
        std::visit(add_source, source);
        print.add(source.index());
    }
    return print.value();
}

int Scene::enclosing(const Vec3& point) const {
    constexpr int RAYS = 32;
    int object = NONE;
    for (int i = 0; i < RAYS; ++i) {
        const Ray ray{point, evenly(i)};
        const auto found = find(ray);
        if (found && objects_[found->object].source != NONE) continue;
        if (!found || found->surface.facing.dot(ray.direction) <= 0) return NONE;
        if (object != NONE && object != found->object) return NONE;
        object = found->object;
    }
    return object;
}

std::vector<std::pair<int, int>> Scene::enclosed_lights() const {
    std::vector<std::pair<int, int>> list;
    for (std::size_t i = 0; i < sources_.size(); ++i) {
        const std::vector<Vec3> points = shining_points(sources_[i]);
        const int object = points.empty() ? NONE : enclosing(points.front());
        if (object == NONE || objects_[object].material.glass) continue;
        const auto within = [&](const Vec3& point) { return enclosing(point) == object; };
        if (std::all_of(points.begin(), points.end(), within)) list.emplace_back(static_cast<int>(i), object);
    }
    return list;
}

void Scene::require(int id) const {
    if (id < 0 || static_cast<std::size_t>(id) >= objects_.size())
        throw std::invalid_argument("no object " + std::to_string(id) + "; the scene has " +
                                    std::to_string(objects_.size()) + " (counted from 0)");
}

void Scene::set_material(int id, Material material) {
    require(id);
    objects_[id].turned = std::any_of(material.lobes.begin(), material.lobes.end(), [](auto& l) { return l.turned(); });
    objects_[id].material = std::move(material);
    ++version_;
}

const Mesh& Scene::mesh(int id) const {
    require(id);
    if (const Mesh* mesh = std::get_if<Mesh>(&objects_[id].shape)) return *mesh;
    throw std::invalid_argument("object " + std::to_string(id) + " is not a mesh");
}

std::optional<Scene::Found> Scene::find(const Ray& ray, Detail detail) const {
    const RTCHit hit = first_hit(scene_.get(), ray).hit;
    if (hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    const Hit where{hit.primID, hit.u, hit.v};
    const Object& object = objects_[hit.geomID];
    if (object.turned) detail = Detail::all;
    const auto surface = [&](const auto& shape) { return shape.surface(ray, where, detail); };
    return Found{static_cast<int>(hit.geomID), hit.primID, std::visit(surface, object.shape)};
}

Ray Scene::leaving(const Found& found, const Vec3& L) const {
    const Surface& s = found.surface;
    return {s.position + s.facing * std::copysign(objects_[found.object].offset, s.facing.dot(L)), L};
}

bool Scene::visible(const Found& found, const Vec3& L, double distance) const {
    const Vec3 origin = leaving(found, L).origin;
    const bool endless = distance == std::numeric_limits<double>::infinity();
    const Vec3 way = endless ? L : found.surface.position + L * distance - origin;
    return reaches(scene_.get(), float_ray(origin, way, endless ? distance : 1));
}

void Scene::visible(const Pair* pairs, int count, bool* answers) const {
    constexpr int LANES = 16;
    for (int first = 0; first < count; first += LANES) {
        const int lanes = std::min(LANES, count - first);
        alignas(64) int valid[LANES] = {};
        RTCRay16 rays{};
        for (int i = 0; i < lanes; ++i) {
            valid[i] = -1;
            const auto& [from, to] = pairs[first + i];
            const Vec3 way = to->surface.position - from->surface.position, origin = leaving(*from, way).origin;
            set(rays, i, float_ray(origin, leaving(*to, -way).origin - origin, 1 - SHADOW_OFFSET));
        }
        embree::occluded(scene_.get(), valid, rays);
        for (int i = 0; i < lanes; ++i) answers[first + i] = rays.tfar[i] >= 0;
    }
}

Vec3 Scene::irradiance(const Found& found, const Incidence& light, bool shadows) const {
    const double cosine = found.surface.N.dot(light.L);
    if (!(cosine > 0) || (shadows && !visible(found, light.L, light.distance))) return Vec3(0);
    return light.irradiance * cosine;
}

Vec3 Scene::radiance(const Ray& ray, bool shadows, const std::vector<Light>& lights,
                     std::vector<Material>& materials) const {
    Vec3 sum(0);
    const auto found = find(ray);
    if (!found) return sum;
    const Surface& s = found->surface;
    std::vector<Lobe>& lobes = materials[found->object].lobes;
    for (Lobe& lobe : lobes) lobe.turn(s.N, s.T, -ray.direction);
    for (const Light& light : lights) {
        const Incidence incidence = light.at(s.position);
        const Vec3 E = irradiance(*found, incidence, shadows);
        if (E == Vec3(0)) continue;
        for (Lobe& lobe : lobes) sum += lobe(incidence.L) * E;
    }
    return sum;
}

Trace Scene::trace(const Camera& camera, int width, int height, bool shadows, int first, int rows) const {
    if (rows == 0) rows = height - first;
    const std::size_t pixels = static_cast<std::size_t>(width) * rows;
    const std::vector<Light> lights = this->lights();
    Trace t;
    for (auto* image : {&t.N, &t.T, &t.V, &t.position}) image->resize(3 * pixels);
    for (auto* image : {&t.L, &t.E}) image->resize(lights.size() * 3 * pixels);
    t.uv.resize(2 * pixels);
    t.depth.assign(pixels, std::numeric_limits<double>::infinity());
    t.object.assign(pixels, -1);
    t.primitive.assign(pixels, -1);

    const View view = camera.view(width, height);
    const auto trace_pixel = [&](int x, int y) {
        const Ray ray = view.ray(x + 0.5, first + y + 0.5);
        const auto found = find(ray);
        if (!found) return;
        const Surface& s = found->surface;
        const std::size_t pixel = static_cast<std::size_t>(y) * width + x;
        store(s.N, t.N, pixel);
        store(s.T, t.T, pixel);
        store(-ray.direction, t.V, pixel);
        store(s.position, t.position, pixel);
        t.uv[2 * pixel] = s.uv.x, t.uv[2 * pixel + 1] = s.uv.y;
        t.depth[pixel] = (s.position - ray.origin).dot(ray.direction);
        t.object[pixel] = found->object;
        t.primitive[pixel] = static_cast<std::int32_t>(found->primitive);
        for (std::size_t i = 0; i < lights.size(); ++i) {
            const Incidence light = lights[i].at(s.position);
            store(light.L, t.L, i * pixels + pixel);
            store(irradiance(*found, light, shadows), t.E, i * pixels + pixel);
        }
    };
    for_tiles(width, rows, [&](const Tile& tile) {
        tile.for_pixels(trace_pixel);
    });
    return t;
}

std::vector<double> Scene::beauty(const Camera& camera, int width, int height, int samples, std::uint64_t seed,
                                  bool shadows) const {
    std::vector<double> image(static_cast<std::size_t>(width) * height * 3);
    const View view = camera.view(width, height);
    const std::vector<Light> lights = this->lights();
    const auto render_pixel = [&](int x, int y, std::vector<Material>& materials) {
        const std::size_t pixel = static_cast<std::size_t>(y) * width + x;
        PixelSamples positions(pixel, samples, seed);
        Vec3 sum(0);
        for (int i = 0; i < samples; ++i) {
            const Vec2 p = positions.next();
            sum += radiance(view.ray(x + p.x, y + p.y), shadows, lights, materials);
        }
        store(sum / samples, image, pixel);
    };
    for_tiles(width, height, [&](const Tile& tile) {
        std::vector<Material> materials;  // of this tile alone, since lobes keep their vectors among their arguments
        for (const Object& o : objects_) materials.push_back(o.material);
        tile.for_pixels([&](int x, int y) { render_pixel(x, y, materials); });
    });
    return image;
}

RayCount Scene::bare_loop(const Camera& camera, int width, int height, int samples) const {
    const std::vector<Light> lights = this->lights();
    if (lights.empty() || !lights.front().at_infinity)
        throw std::invalid_argument("bare_loop: expected a directional light as the first one");
    std::atomic<std::size_t> shadow_rays = 0;
    const View view = camera.view(width, height);
    for_tiles(width, height, [&](const Tile& tile) {
        std::size_t hits = 0;
        tile.for_pixels([&](int x, int y) {
            PixelSamples positions(static_cast<std::size_t>(y) * width + x, samples, 0);
            for (int i = 0; i < samples; ++i) {
                const Vec2 p = positions.next();
                const Ray ray = view.ray(x + p.x, y + p.y);
                const RTCRayHit found = first_hit(scene_.get(), ray);
                if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
                if (Vec3(found.hit.Ng_x, found.hit.Ng_y, found.hit.Ng_z).dot(lights.front().place) <= 0) continue;
                const double distance = found.ray.tfar * (1 - SHADOW_OFFSET);
                reaches(scene_.get(), float_ray(ray.origin + ray.direction * distance, lights.front().place,
                                                std::numeric_limits<double>::infinity()));
                ++hits;
            }
        });
        shadow_rays += hits;
    });
    return {static_cast<std::size_t>(width) * height * samples, shadow_rays};
}

}  // namespace lobe
