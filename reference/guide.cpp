#include "guide.h"

#include "parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace lobe {
namespace {

constexpr double PI = std::numbers::pi, INFINITE = std::numeric_limits<double>::infinity();

using Photon = Guide::Photon;

// A point of a shape: uniform, but each face of a mesh gets as many, since surfaces are curved where there are more.
struct Spot {
    Vec3 position, facing;
    double area;  // of which it stands for all others
};

Spot spot(const Sphere& s, Vec2 u) {
    const double z = 1 - 2 * u.x;
    const Vec2 c = on_circle(u.y) * std::sqrt(1 - z * z);
    const Vec3 N(c.x, c.y, z);
    return {s.center + N * s.radius, N, 4 * PI * s.radius * s.radius};
}

Spot spot(const Plane& p, Vec2 u) {
    const Vec3 x = p.T * (p.half_x * (2 * u.x - 1)), y = p.N.cross(p.T) * (p.half_y * (2 * u.y - 1));
    return {p.center + x + y, p.N, 4 * p.half_x * p.half_y};
}

Spot spot(const Mesh& m, Vec2 u) {
    const double count = static_cast<double>(m.faces.size()), x = u.x * count, r = std::sqrt(x - std::floor(x));
    const Mesh::Face& f = m.faces[static_cast<std::size_t>(x)];
    const Vec3 &a = m.vertices[f[0]], e1 = m.vertices[f[1]] - a, e2 = m.vertices[f[2]] - a, area = e1.cross(e2);
    return {a + (e1 * (1 - u.y) + e2 * u.y) * r, area.normalized(), area.length() / 2 * count};
}

// About the irradiance that lights with an extent give a surface which faces them; `each` gets that of every light.
double direct(const Scene& scene, const Vec3& point, std::vector<double>* each = nullptr) {
    double sum = 0;
    for (const Source& source : scene.sources()) {
        const auto importance = [&](const auto& light) { return light.importance(point, Vec3(0)); };
        const double E = std::holds_alternative<Light>(source) ? 0 : std::visit(importance, source);
        sum += E;
        if (each) each->push_back(E);
    }
    return sum;
}

// Shoots photons at mirrors and glass.
class Emitter {
public:
    Emitter(const Scene& scene, int depth) : scene_(scene), depth_(depth) {
        bool asks = false;  // whether there is a lobe that a guide is for
        for (std::size_t i = 0; i < scene.objects().size(); ++i) {
            const Scene::Object& o = scene.objects()[i];
            for (const Lobe& lobe : o.material.lobes) asks |= !lobe.proposal.glossy();
            const Mesh* mesh = std::get_if<Mesh>(&o.shape);
            if ((o.material.glass || o.material.mirror) && !(mesh && mesh->faces.empty()))
                targets_.push_back(static_cast<int>(i));
        }
        if (!asks) targets_.clear();
    }

    bool has_targets() const { return !targets_.empty(); }
    Photon photon(std::uint32_t i) const;

private:
    Photon arriving(Ray ray, double power, const Sample& sample) const;

    const Scene& scene_;
    int depth_;
    std::vector<int> targets_;
};

// The i-th of many, from a light that a point of the target sees. Of no power where it does not arrive.
Photon Emitter::photon(std::uint32_t i) const {
    constexpr std::uint64_t SEQUENCE = 0x9e3779b97f4a7c15u;  // any, but no pixel's
    // Light that is hardly brighter than what comes from everywhere else is found without a guide.
    constexpr double BRIGHT = 2;
    const Sample sample(SEQUENCE, i);
    const int target = targets_[i % targets_.size()];
    const Scene::Object& object = scene_.objects()[target];
    const Spot s = std::visit([&](const auto& shape) { return spot(shape, sample.pair(0)); }, object.shape);

    std::vector<double> chances;
    const double all = direct(scene_, s.position, &chances);
    Vec2 u = sample.pair(1);
    const int source = pick(chances.data(), static_cast<int>(chances.size()), u.x);
    if (source < 0) return {};
    const auto drawn = [&](const auto& light) { return light.sample(s.position, u); };
    const LightSample light = std::visit(drawn, scene_.sources()[source]);
    const double excess = luminance(light.estimate) - BRIGHT * all / (PI * light.density);
    if (!(excess > 0)) return {};
    const Scene::Found here{target, 0, Surface{s.position, s.facing, s.facing}};
    if (!scene_.visible(here, light.L, light.distance)) return {};

    const double area = s.area * std::abs(s.facing.dot(light.L)) * static_cast<double>(targets_.size());
    const Vec3 above = s.position + light.L * (8 * object.offset);  // from where the surface is met again, with its normal
    return arriving({above, -light.L}, excess * area * all / chances[source], sample);
}

Photon Emitter::arriving(Ray ray, double power, const Sample& sample) const {
    constexpr int LONGEST = 32;  // light by longer ways is left to chance: between mirrors they would not end
    for (int interactions = 0; interactions < std::min(depth_, LONGEST); ++interactions) {
        const auto found = scene_.find(ray, Detail::normals);
        if (!found) break;
        const Material& m = scene_.objects()[found->object].material;
        const Vec3 V = -ray.direction, N = found->surface.N;
        const double NdotV = N.dot(V);
        if (interactions > 0 && !m.lobes.empty() && NdotV > 0) return {found->surface.position, V, power};

        const Ideal ideal(m, NdotV);
        const double shares[] = {luminance(ideal.mirror), ideal.reflected, ideal.refracted};
        double u = sample.pair(2 + interactions).x;
        const int way = pick(shares, 3, u);
        if (way < 0) break;
        power *= shares[0] + shares[1] + shares[2];
        ray = scene_.leaving(*found, ideal.L(Way(way), N, V));
    }
    return {};
}

// The corners of the box around the photons.
std::pair<Vec3, Vec3> box(const Photon* begin, const Photon* end) {
    Vec3 low(INFINITE), high(-INFINITE);
    for (const Photon* p = begin; p != end; ++p)
        for (int a = 0; a < 3; ++a)
            low[a] = std::min(low[a], p->position[a]), high[a] = std::max(high[a], p->position[a]);
    return {low, high};
}

}  // namespace

Guide::Guide(const Scene& scene, int depth, std::size_t count) {
    constexpr double INDIRECT = 0.05;  // of the direct light, where photons arrive
    const Emitter emitter(scene, depth);
    if (!emitter.has_targets()) return;
    std::vector<Photon> photons(count);
    parallel_for(count, [&](std::size_t i) { photons[i] = emitter.photon(static_cast<std::uint32_t>(i)); });
    std::erase_if(photons, [](const Photon& p) { return !(p.power > 0); });
    if (photons.empty()) return;

    double others = 0;
    for (Photon& p : photons) {
        p.power /= static_cast<double>(count);
        others += INDIRECT * direct(scene, p.position) / static_cast<double>(photons.size());
    }
    std::vector<Crowd> crowds;
    divide(photons.data(), photons.data() + photons.size(), crowds);
    cells_.resize(crowds.size());
    parallel_for(crowds.size(), [&](std::size_t i) { cells_[i].emplace(crowds[i].first, crowds[i].second, others); });
    prune();
}

std::shared_ptr<const Guide> Scene::guide(int depth, std::size_t photons) const {
    const std::scoped_lock locked(guides_->lock);
    if (guides_->version != version_ || guides_->depth != depth) guides_->made.clear();
    guides_->version = version_, guides_->depth = depth;
    auto& guide = guides_->made[photons];
    if (!guide) guide = std::make_shared<const Guide>(*this, depth, photons);
    return guide;
}

// Halves the photons across the side on which they are longest, until a few lie together. Returns the node.
std::uint32_t Guide::divide(Photon* begin, Photon* end, std::vector<Crowd>& crowds) {
    const auto id = static_cast<std::uint32_t>(nodes_.size());
    if (end - begin <= CROWD) {
        nodes_.push_back({LEAF, 0, {static_cast<std::uint32_t>(crowds.size()), 0}});
        crowds.emplace_back(begin, static_cast<int>(end - begin));
        return id;
    }
    const auto [low, high] = box(begin, end);
    const Vec3 size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto before = [axis](const Photon& a, const Photon& b) { return a.position[axis] < b.position[axis]; };
    Photon* const middle = begin + (end - begin) / 2;
    std::nth_element(begin, middle, end, before);
    nodes_.push_back({axis, middle->position[axis], {0, 0}});
    const std::uint32_t below = divide(begin, middle, crowds), above = divide(middle, end, crowds);
    nodes_[id].children[0] = below, nodes_[id].children[1] = above;
    return id;
}

// So that no time is lost where there is nothing to tell. Children come behind their parents.
void Guide::prune() {
    for (std::size_t i = nodes_.size(); i-- > 0;) {
        Node& node = nodes_[i];
        const auto& [a, b] = node.children;
        const bool none = node.axis == LEAF ? !(cells_[a]->chance() > 0)
                                            : nodes_[a].axis == NOTHING && nodes_[b].axis == NOTHING;
        if (none) node.axis = NOTHING;
    }
}

const Guide::Cell* Guide::at(const Vec3& position) const {
    if (nodes_.empty()) return nullptr;
    const Node* node = nodes_.data();
    while (node->axis >= 0) node = &nodes_[node->children[position[node->axis] >= node->at]];
    if (node->axis == NOTHING) return nullptr;
    const Cell& cell = *cells_[node->children[0]];
    return cell.holds(position) ? &cell : nullptr;
}

Guide::Cell::Cell(const Photon* photons, int count, double others) {
    const double irradiance = bound(photons, count);
    turn(photons, count);
    spread(photons, project(photons, count));
    weigh(irradiance, others);
}

// Returns the irradiance.
double Guide::Cell::bound(const Photon* photons, int count) {
    constexpr double MARGIN = 0.2;
    std::tie(low_, high_) = box(photons, photons + count);
    double power = 0;
    for (int i = 0; i < count; ++i) power += photons[i].power;
    const Vec3 size = high_ - low_;
    const double area = std::max({size.x * size.y, size.y * size.z, size.z * size.x});
    low_ -= Vec3(MARGIN * size.length()), high_ += Vec3(MARGIN * size.length());
    return area > 0 ? power / area : 0;
}

// Light that is faint, or that comes from so wide an angle that the lobes' own draws find it, is not worth the time that
// its density takes at each vertex: lamps that are wide give a box such light by way of a ball.
void Guide::Cell::weigh(double irradiance, double others) {
    constexpr double MOST = 0.75, WORTH = 0.2;
    double squared = 0;  // the integral of the density's square
    for (const auto& row : bins_)
        for (double bin : row) squared += bin * bin / (step_.x * step_.y);
    const double noise = irradiance * std::sqrt(PI * squared);  // of one draw with a density of 1 / pi
    chance_ = noise > WORTH * others ? MOST * irradiance / (irradiance + others) : 0;
}

// Into the photons' mean direction, and about it to their main axis.
void Guide::Cell::turn(const Photon* photons, int count) {
    Vec3 sum(0);
    for (int i = 0; i < count; ++i) sum += photons[i].L * photons[i].power;
    if (sum != Vec3(0)) frame_ = Basis(sum.normalized());
    const std::vector<Vec2> places = project(photons, count);
    Vec2 center(0);
    double power = 0, xx = 0, xy = 0, yy = 0;
    for (int i = 0; i < count; ++i) center += places[i] * photons[i].power, power += photons[i].power;
    for (int i = 0; i < count; ++i) {
        const Vec2 d = places[i] - center / power;
        xx += photons[i].power * d.x * d.x, xy += photons[i].power * d.x * d.y, yy += photons[i].power * d.y * d.y;
    }
    const double angle = std::atan2(2 * xy, xx - yy) / 2;
    frame_ = Basis(frame_.z, frame_.x * std::cos(angle) + frame_.y * std::sin(angle));
}

// Each photon counts in the disc that reaches the n-th photon next to it, and a little in a wider one: what lies between
// photons should not be rare.
void Guide::Cell::spread(const Photon* photons, const std::vector<Vec2>& places) {
    constexpr std::size_t NEXT = 4;
    constexpr double SMALLEST = 1e-3, LARGEST = 1, WIDER = 3, OF_WIDER = 0.2, BRINK = 2;
    std::vector<double> reach, squares(places.size());
    Vec2 low(INFINITE), high(-INFINITE);
    for (const Vec2& place : places) {
        for (std::size_t k = 0; k < places.size(); ++k) squares[k] = (places[k] - place).length2();
        const auto next = squares.begin() + static_cast<std::ptrdiff_t>(std::min(NEXT, places.size() - 1));
        std::nth_element(squares.begin(), next, squares.end());
        reach.push_back(std::clamp(std::sqrt(*next), SMALLEST, LARGEST));
        for (int a = 0; a < 2; ++a)
            low[a] = std::min(low[a], place[a] - BRINK * reach.back()),
            high[a] = std::max(high[a], place[a] + BRINK * reach.back());
    }
    corner_ = low, step_ = (high - low) / SIDE;

    double sum = 0;
    const auto add = [&](const Vec2& place, double radius, double power) {
        const double r = std::max(radius, step_.length() / 2 * 1.0001);  // some bin's centre is within
        const auto index = [&](double x, int a) {
            return std::clamp(static_cast<int>((x - corner_[a]) / step_[a]), 0, SIDE - 1);
        };
        for (int y = index(place.y - r, 1); y <= index(place.y + r, 1); ++y)
            for (int x = index(place.x - r, 0); x <= index(place.x + r, 0); ++x) {
                const Vec2 center = corner_ + Vec2((x + 0.5) * step_.x, (y + 0.5) * step_.y);
                if ((center - place).length2() > r * r) continue;
                bins_[y][x] += power / (r * r), sum += power / (r * r);
            }
    };
    for (std::size_t i = 0; i < places.size(); ++i) {
        add(places[i], reach[i], (1 - OF_WIDER) * photons[i].power);
        add(places[i], WIDER * reach[i], OF_WIDER * photons[i].power);
    }
    for (int y = 0; y < SIDE; ++y)
        for (double& bin : bins_[y]) rows_[y] += bin /= sum;
}

bool Guide::Cell::holds(const Vec3& p) const {
    return p.x >= low_.x && p.y >= low_.y && p.z >= low_.z && p.x <= high_.x && p.y <= high_.y && p.z <= high_.z;
}

Vec2 Guide::Cell::project(const Vec3& L) const {
    const Vec3 l = frame_.to_local(L);
    const double scale = std::sqrt(2 / std::max(1 + l.z, 1e-12));
    return {l.x * scale, l.y * scale};
}

std::vector<Vec2> Guide::Cell::project(const Photon* photons, int count) const {
    std::vector<Vec2> places;
    for (int i = 0; i < count; ++i) places.push_back(project(photons[i].L));
    return places;
}

Vec3 Guide::Cell::sample(Vec2 u) const {
    const int y = pick(rows_.data(), SIDE, u.y), x = pick(bins_[y].data(), SIDE, u.x);
    const Vec2 place = corner_ + Vec2((x + u.x) * step_.x, (y + u.y) * step_.y);
    const double r2 = place.length2();
    if (!(r2 < 4)) return Vec3(0);
    const double scale = std::sqrt(1 - r2 / 4);
    return frame_.to_world({place.x * scale, place.y * scale, 1 - r2 / 2});
}

double Guide::Cell::density(const Vec3& L) const {
    const Vec2 place = project(L) - corner_;
    const double x = place.x / step_.x, y = place.y / step_.y;
    if (!(x >= 0 && y >= 0 && x < SIDE && y < SIDE)) return 0;
    return bins_[static_cast<int>(y)][static_cast<int>(x)] / (step_.x * step_.y);
}

}  // namespace lobe
