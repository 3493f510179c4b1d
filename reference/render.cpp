#include "render.h"

#include "fingerprint.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <set>
#include <stdexcept>
#include <tuple>

namespace lobe {
namespace {

// Numbers of the pairs that a path uses up: one for the pixel, and at each vertex these.
enum Pair : std::uint32_t { POSITION = 0, LIGHT = 1, DIRECTION = 2, CHANCE = 3, CHOICE = 4, PER_VERTEX = 4 };

// Directions to lights among which a vertex with a glossy lobe chooses. Per CPU time, gold in a probe does best with 8,
// by little before 4 and 6, but with 2 where an outlook tells of all light there is; where lobes see nearly all light
// alike, one is enough.
constexpr int CANDIDATES = 8, KNOWING_CANDIDATES = 2;

// Shadow rays to lamps from where the camera looks: no neighbour shares what they find, so that it is half of the variance in a
// diffuse box. Per CPU time that box gains 1.2 times with 2 or 3, and a scene in a probe nothing.
constexpr int FIRST_SHADOWS = 2;

// A path that has met nothing but glass and mirrors goes both ways at so many of its first interactions, reflected and
// refracted: what is seen in it is drawn sharply by the evenness of a pixel's samples, where chance would let go of that. With a guide to
// the caustic, a ball of glass in a probe gains 1.5 times with 1, 3 times with 2, no more with 3; without, little.
constexpr int SPLITS = 2;

double mean(const Vec3& v) { return (v.x + v.y + v.z) / 3; }

// Weight of a direction drawn with density p where q might have drawn it as well: Veach 1997, the power heuristic.
double weight(double p, double q) { return p == NO_EXTENT ? 1 : p * p / (p * p + q * q); }

// The point, turned around the square for the i-th time of some: each point is uniform, and together they are even.
Vec2 turned(Vec2 u, int i, int count) {
    const Vec2 at(u.x + double(i) / count, u.y + i * 0.6180339887498949);
    return at - Vec2(std::floor(at.x), std::floor(at.y));
}

// None where the environment is coarse or not drawn from.
const Outlook* outlook_of(const Lobe& lobe, const Outlooks& outlooks) {
    const auto found = outlooks.find(Outlook::breadth(lobe.proposal));
    return found == outlooks.end() ? nullptr : &found->second;
}

// Where the path has met a surface, as its material sees it.
struct Vertex {
    const Scene::Found& found;
    const Surface& surface = found.surface;
    Material& material;
    Vec3 V;
    Basis frame = surface.T == Vec3(0) ? Basis(surface.N) : Basis(surface.N, surface.T);
    Vec3 local_V = frame.to_local(V);
    double NdotV = local_V.z;
    Ideal ideal{};
    const Guide::Cell* cell = nullptr;
    double guided = 0;          // share of the guide among the directions of the lobes
    double lobes = 0, all = 0;  // shares of all lobes and of all together among the directions that are drawn
};

// The rest of a path, after so many interactions.
struct Branch {
    Ray ray;
    Vec3 throughput;
    double widening;
    int interactions;
};

// Radiance, and what each light has to do with it where layers are asked for.
struct Sum {
    void clear(std::size_t sources) { all = Vec3(0), by_source.assign(sources, Vec3(0)); }
    void scale(double factor) {
        all *= factor;
        for (Vec3& light : by_source) light *= factor;
    }
    void add(const Sum& other, const Vec3& factor) {
        all += other.all * factor;
        for (std::size_t i = 0; i < by_source.size(); ++i) by_source[i] += other.by_source[i] * factor;
    }

    Vec3 all;
    std::vector<Vec3> by_source;
};

// A path from a pixel on, split behind its second vertex, whose light may go to other pixels, too.
struct Path {
    Ray ray;
    Samples* points;
    Sum sum;  // what comes along it

    std::optional<Scene::Found> first, second;  // vertices, as far as its depth allows for light from them
    Vec3 throughput;  // up to the second one
    bool shared;      // from which light leaves to all sides alike, and where lobes have sent it
    Sum rest;         // that light
    double alone;     // mean of what comes along it without the light of others
};

// One thread's tracer: lobes keep their vectors among their arguments.
class Tracer {
public:
    Tracer(const Scene& scene, const RenderSettings& settings, const Guide& guide, const Outlooks& outlooks)
        : scene_(scene), settings_(settings), guide_(guide), sources_(scene.sources()), chances_(sources_.size(), 1.0) {
        for (const Scene::Object& o : scene.objects()) {
            materials_.push_back(o.material);
            auto& list = outlooks_.emplace_back();
            for (const Lobe& lobe : o.material.lobes) list.push_back(outlook_of(lobe, outlooks));
        }
        for (const Source& s : sources_) has_extent_ |= !std::holds_alternative<Light>(s);
        if (!sources_.empty()) environment_ = std::get_if<Environment>(&sources_.back());
    }

    // Finds what comes along the rays of some paths.
    void trace(Path* paths, int count);

    Path paths[Companions::COUNT];
    Samples points[Companions::COUNT][Film::HALVES];  // of the pixels

private:
    void add(int source, const Vec3& radiance) {
        sum_->all += radiance;
        if (settings_.layers) sum_->by_source[source] += radiance;
    }
    void begin(Path& path);
    void follow(Ray ray, Samples& points, int interactions);
    void follow_branches(std::size_t waiting, Samples& points);
    std::optional<Scene::Found> arrive(const Ray& ray);
    bool interact(const Scene::Found& found, Ray& ray, Samples& points, int interactions);
    void share(Path* paths, int count);
    struct Link {
        Vec3 throughput;
        double density;  // per area
        int first, second;  // whose vertices it joins
        bool free;          // of what would stand in its way
    };
    bool link(const Vertex& v, const Scene::Found& to, Link& link);
    void add_emission(const std::optional<Scene::Found>& found, const Vec3& direction);
    Vertex meet(const Scene::Found& found, const Vec3& V);
    void add_direct(const Vertex& v, Vec2 u, double choice);
    double draws(int source) const { return shadows_ * candidates_ * chances_[source]; }
    const Environment::Aim& aim(double& u) const;
    bool weigh_lights(const Vertex& v);
    bool splits(const Vertex& v, int interactions) const;
    bool scatter(const Vertex& v, Ray& ray, Vec2 u, double chance);
    Ray go(const Vertex& v, Way way);
    bool scatter_by_lobe(const Vertex& v, const Proposal& proposal, Ray& ray, Vec2 u);
    bool survives(double chance);

    Vec3 f(const Vertex& v, const Vec3& L) const {
        Vec3 sum(0);
        for (Lobe& lobe : v.material.lobes) sum += lobe(L);
        return sum;
    }
    // With which the lobes, guided or not, draw L, among all that is drawn.
    double density(const Vertex& v, const Vec3& local_L) const {
        const double unguided = lobe_density(v, local_L);
        if (!v.cell) return unguided;
        const double guide = v.cell->density(v.frame.to_world(local_L)) * v.lobes / v.all;
        return v.guided * guide + (1 - v.guided) * unguided;
    }
    // The density with which the last vertex draws from a tile of the environment, over that of the light alone.
    double preference(int tile) const {
        double sum = 0;
        for (std::size_t i = 0; i < aims_.size(); ++i) sum += shares_[i] * environment_->preference(*aims_[i], tile);
        return sum / lobes_;
    }
    double lobe_density(const Vertex& v, const Vec3& local_L) const {
        double sum = 0;
        for (std::size_t i = 0; i < v.material.lobes.size(); ++i)
            sum += shares_[i] * v.material.lobes[i].proposal.density(v.local_V, local_L);
        return sum / v.all;
    }

    const Scene& scene_;
    const RenderSettings& settings_;
    const Guide& guide_;
    const std::vector<Source>& sources_;
    const Environment* environment_ = nullptr;
    bool has_extent_ = false;
    std::vector<Material> materials_;
    std::vector<std::vector<const Outlook*>> outlooks_;  // of their lobes, where there are any

    // of the path
    Sum* sum_;
    std::vector<Branch> branches_;  // that wait
    // of the branch
    Vec3 throughput_;
    double widening_;  // of solid angles by refraction, and of few directions by the guide: it thins radiance out but
                       // takes no light
    // of the last vertex
    Vec3 origin_;
    int shadows_, candidates_;     // shadow rays to its light, and among how many directions each was chosen
    double density_;               // with which its lobes have drawn the direction of the path
    std::vector<double> shares_;   // of its lobes among the directions, and of mirror, glass' reflection and refraction
    std::vector<double> chances_;  // of the lights to be drawn from
    double lobes_;                 // the shares of all of its lobes
    std::vector<const Environment::Aim*> aims_;  // of its lobes at the environment
};

void Tracer::trace(Path* paths, int count) {
    bool shared = false;
    for (Path* p = paths; p != paths + count; ++p) {
        begin(*p);
        p->shared &= count > 1;
        shared |= p->shared;
        p->alone = mean(p->sum.all);
        if (p->second) p->alone += mean(p->throughput * p->rest.all);
        if (p->second && !p->shared) p->sum.add(p->rest, p->throughput);
    }
    if (shared) share(paths, count);
}

// Follows the path, and leaves what comes from behind its second vertex in its rest.
void Tracer::begin(Path& path) {
    const std::size_t sources = settings_.layers ? sources_.size() : 0;
    Samples& points = *path.points;
    Ray ray = path.ray;
    path.sum.clear(sources), path.second.reset(), path.shared = false;
    sum_ = &path.sum, throughput_ = Vec3(1), widening_ = 1, density_ = NO_EXTENT;
    path.first = arrive(ray);
    if (!path.first || settings_.depth == 0) return path.first.reset();
    if (interact(*path.first, ray, points, 0)) {
        path.throughput = throughput_;
        path.second = arrive(ray);
        if (settings_.depth == 1) path.second.reset();
    }
    if (path.second) {
        path.shared = density_ != NO_EXTENT && scene_.objects()[path.second->object].material.uniform() &&
                      path.second->surface.N.dot(ray.direction) < 0;
        const double brightest = std::max({throughput_.x, throughput_.y, throughput_.z});
        const std::size_t waiting = branches_.size();
        path.rest.clear(sources);
        sum_ = &path.rest, throughput_ = Vec3(brightest);  // as roulette wants it; taken out again below
        if (interact(*path.second, ray, points, 1)) follow(ray, points, 2);
        follow_branches(waiting, points);
        path.rest.scale(1 / brightest);
    }
    sum_ = &path.sum;
    follow_branches(0, points);
}

void Tracer::follow(Ray ray, Samples& points, int interactions) {
    for (;; ++interactions) {
        const auto found = arrive(ray);
        if (!found || interactions == settings_.depth || !interact(*found, ray, points, interactions)) return;
    }
}

// All but those that had been waiting before.
void Tracer::follow_branches(std::size_t waiting, Samples& points) {
    while (branches_.size() > waiting) {
        const Branch branch = branches_.back();
        branches_.pop_back();
        throughput_ = branch.throughput, widening_ = branch.widening, density_ = NO_EXTENT;
        follow(branch.ray, points, branch.interactions);
    }
}

// Where the ray meets a surface, whose light it adds.
std::optional<Scene::Found> Tracer::arrive(const Ray& ray) {
    auto found = scene_.find(ray, Detail::normals);
    add_emission(found, ray.direction);
    return found;
}

// Adds the direct light there, and sends the path on. False where it ends.
bool Tracer::interact(const Scene::Found& found, Ray& ray, Samples& points, int interactions) {
    const std::uint32_t first = interactions * PER_VERTEX;
    const Vertex v = meet(found, -ray.direction);
    const bool lit = v.lobes > 0 && !sources_.empty() && weigh_lights(v);
    if (interactions == 0 && candidates_ == 1 && has_extent_ && !environment_) shadows_ = FIRST_SHADOWS;
    for (int i = 0; i < shadows_ && lit; ++i)
        add_direct(v, turned(points.pair(first + LIGHT), i, shadows_), candidates_ > 1 ? points.pair(first + CHOICE).x : 0);
    if (splits(v, interactions)) {
        const Vec3 throughput = throughput_;
        branches_.push_back({go(v, REFLECTION), throughput_, widening_, interactions + 1});
        throughput_ = throughput;
        ray = go(v, REFRACTION);
        return true;
    }
    const bool may_end = interactions + 1 >= settings_.roulette, chosen = v.all > v.lobes;
    const Vec2 chance = may_end || chosen ? points.pair(first + CHANCE) : Vec2(0);
    return scatter(v, ray, points.pair(first + DIRECTION), chance.x) && (!may_end || survives(chance.y));
}

// Gives the light of all second vertices to all first ones that see them: Bekaert, Sbert, Halton, Accelerating path
// tracing by re-using paths, EGRW 2002. A vertex might have been drawn from any of the first ones; what it brings is
// weighted by the sum of their densities, so that nothing is counted twice.
void Tracer::share(Path* paths, int count) {
    constexpr int MOST = Companions::COUNT * Companions::COUNT;
    Link links[MOST], *end = links;
    for (int i = 0; i < count; ++i) {
        if (!paths[i].first) continue;
        const Vertex v = meet(*paths[i].first, -paths[i].ray.direction);
        for (int k = 0; k < count; ++k)
            if (paths[k].shared && link(v, *paths[k].second, *end)) end->first = i, end++->second = k;
    }
    Scene::Pair pairs[MOST];
    bool answers[MOST];
    int asked = 0, answered = 0;
    for (const Link* l = links; l != end; ++l)
        if (l->first != l->second) pairs[asked++] = {&*paths[l->first].first, &*paths[l->second].second};
    scene_.visible(pairs, asked, answers);
    double densities[Companions::COUNT] = {};  // of the second vertices
    for (Link* l = links; l != end; ++l) {
        l->free = l->first == l->second || answers[answered++];  // it has come this way itself
        if (l->free) densities[l->second] += l->density;
    }
    for (const Link* l = links; l != end; ++l)
        if (l->free) paths[l->first].sum.add(paths[l->second].rest, l->throughput / densities[l->second]);
}

// From a vertex to the second one of a path, if nothing stands in the way. False where no path would have gone on there.
bool Tracer::link(const Vertex& v, const Scene::Found& to, Link& link) {
    const Vec3 way = to.surface.position - v.surface.position, L = way.normalized();
    const double cos = v.surface.N.dot(L);
    if (!(cos > 0 && to.surface.N.dot(L) < 0)) return false;
    const double lobes = density(v, v.frame.to_local(L)), per_area = std::abs(to.surface.facing.dot(L)) / way.length2();
    if (!(lobes > 0)) return false;
    link.throughput = f(v, L) * (cos * per_area), link.density = lobes * per_area;
    return link.density > 0 && link.throughput != Vec3(0);
}

// Light that the path has run into. What the lobes have drawn might have been drawn from the lights as well.
void Tracer::add_emission(const std::optional<Scene::Found>& found, const Vec3& direction) {
    const int source = found ? scene_.objects()[found->object].source : static_cast<int>(sources_.size()) - 1;
    if (source == Scene::NONE || (!found && !environment_)) return;
    if (found && found->surface.facing.dot(direction) >= 0) return;  // lights are black behind
    const bool by_lobes = density_ != NO_EXTENT;
    if (by_lobes && settings_.strategy == Strategy::light) return;
    std::visit([&](const auto& light) {
        using Kind = std::decay_t<decltype(light)>;
        if constexpr (!std::is_same_v<Kind, Light>) {
            const bool has_rival = by_lobes && settings_.strategy == Strategy::mis;
            Vec3 radiance;
            double rival = 0;
            if constexpr (std::is_same_v<Kind, Environment>) {
                const Environment::Seen seen = light.seen(direction);
                radiance = seen.radiance;
                if (has_rival) rival = seen.density * preference(seen.tile);
            } else {
                radiance = light.radiance;
                if (has_rival) rival = light.density(origin_, direction);
            }
            add(source, throughput_ * radiance * weight(density_, has_rival ? draws(source) * rival : 0));
        }
    }, sources_[source]);
}

Vertex Tracer::meet(const Scene::Found& found, const Vec3& V) {
    Vertex v{.found = found, .material = materials_[found.object], .V = V};
    const Material& m = v.material;
    const bool knowing = sources_.size() == 1 && environment_ && environment_->fine();  // where light comes from
    const bool front = v.NdotV > 0, alone = m.lobes.size() == 1 && !m.mirror && !m.glass;
    origin_ = v.surface.position;
    shares_.clear();
    shadows_ = candidates_ = 1;
    aims_.clear();
    double broad = 0;
    for (std::size_t i = 0; i < m.lobes.size(); ++i) {
        Lobe& lobe = v.material.lobes[i];
        const Outlook* const outlook = outlooks_[found.object][i];
        if (outlook && front)
            aims_.push_back(&outlook->about(v.frame.to_world(lobe.proposal.axis(v.local_V))));
        else if (environment_)
            aims_.push_back(&environment_->by_light());
        if (lobe.proposal.glossy()) candidates_ = knowing ? KNOWING_CANDIDATES : CANDIDATES;
        lobe.turn(v.surface.N, v.surface.T, V);
        shares_.push_back(!front ? 0 : alone ? 1 : lobe.albedo(v.NdotV));
        v.lobes += shares_.back();
        if (!lobe.proposal.glossy()) broad += shares_.back();
    }
    lobes_ = v.lobes;
    if (broad > 0) v.cell = guide_.at(origin_);
    if (v.cell) v.guided = v.cell->chance() * broad / v.lobes;
    v.all = v.lobes;
    if (m.mirror || m.glass) {
        v.ideal = Ideal(m, v.NdotV);
        for (double share : {mean(v.ideal.mirror), v.ideal.reflected, v.ideal.refracted}) {
            shares_.push_back(share);
            v.all += share;
        }
    }
    return v;
}

// Where one of the lobes looks.
const Environment::Aim& Tracer::aim(double& u) const {
    const int lobes = static_cast<int>(aims_.size());
    return *aims_[lobes == 1 ? 0 : pick(shares_.data(), lobes, u)];
}

// Chances of the lights, by what they would give if nothing stood in their way. False where none gives any.
bool Tracer::weigh_lights(const Vertex& v) {
    if (sources_.size() == 1) return settings_.strategy != Strategy::lobe || !has_extent_;
    double all = 0;
    for (std::size_t i = 0; i < sources_.size(); ++i) {
        const bool skipped = settings_.strategy == Strategy::lobe && !std::holds_alternative<Light>(sources_[i]);
        const auto importance = [&](const auto& light) { return light.importance(origin_, v.surface.N); };
        all += chances_[i] = skipped ? 0 : std::visit(importance, sources_[i]);
    }
    for (double& chance : chances_) chance /= all > 0 ? all : 1;
    return all > 0;
}

// Light of one direction to one of the lights, chosen among some candidates in proportion to what it would bring if
// nothing stood in its way (Talbot, Cline, Egbert, Importance resampling for global illumination, EGSR 2005): the
// density of the lobes' own draws, which is near to them and cheaper, tells what no light knows of. The lobes are
// evaluated and a ray is traced for the chosen one alone.
void Tracer::add_direct(const Vertex& v, Vec2 u, double choice) {
    constexpr double FLOOR = 1e-2;  // so that none is missed where the lobes draw nothing
    const int count = static_cast<int>(sources_.size());
    struct {
        int source;
        LightSample light;
        double weight, brightness;
    } chosen{};
    struct {
        int source;
        Vec2 u;
        Environment::Cell cell;
    } candidates[CANDIDATES];
    for (int i = 0; i < candidates_; ++i) {
        auto& [source, at, cell] = candidates[i];
        at = turned(u, i, candidates_);
        source = count == 1 ? 0 : pick(chances_.data(), count, at.x);
        if (!environment_ || source != count - 1) continue;
        const Environment::Aim& aim = this->aim(at.x);  // before the rest of the place is copied
        cell = environment_->cell(at, aim);
    }
    double sum = 0;
    for (int i = 0; i < candidates_; ++i) {
        const auto& [source, at, cell] = candidates[i];
        const LightSample light = environment_ && source == count - 1 ? environment_->sample(cell, preference(cell.tile))
            : std::visit([&, &at = at](const auto& l) { return l.sample(origin_, at); }, sources_[source]);
        const double cos = v.surface.N.dot(light.L), chance = draws(source);
        if (!(cos > 0) || light.estimate == Vec3(0)) continue;
        const bool has_rival = settings_.strategy == Strategy::mis && light.density != NO_EXTENT;
        const double lobes = has_rival || candidates_ > 1 ? density(v, v.frame.to_local(light.L)) : 0;
        const double w = weight(chance * light.density, has_rival ? lobes : 0) / chance;
        const double brightness = mean(throughput_ * light.estimate) * w * (lobes + FLOOR * cos);
        if (!(brightness > 0)) continue;
        sum += brightness;
        const double share = brightness / sum;
        const bool takes = choice < share;
        choice = takes ? choice / share : (choice - share) / (1 - share);
        if (takes) chosen = {source, light, cos * w, brightness};
    }
    if (!(sum > 0)) return;
    const Vec3 arriving = f(v, chosen.light.L) * chosen.light.estimate * (chosen.weight * sum / chosen.brightness);
    if (arriving != Vec3(0) && scene_.visible(v.found, chosen.light.L, chosen.light.distance))
        add(chosen.source, throughput_ * arriving);
}

bool Tracer::splits(const Vertex& v, int interactions) const {
    const Material& m = v.material;
    return interactions < SPLITS && density_ == NO_EXTENT && m.lobes.empty() && !m.mirror && v.ideal.reflected > 0 &&
           v.ideal.refracted > 0;
}

// Draws the direction in which the path goes on.
bool Tracer::scatter(const Vertex& v, Ray& ray, Vec2 u, double chance) {
    if (!(v.all > 0)) return false;
    double& draw = v.all > v.lobes ? chance : u.x;  // lobes alone share the first number of the pair
    const int i = pick(shares_.data(), static_cast<int>(shares_.size()), draw);
    const int lobes = static_cast<int>(v.material.lobes.size());
    if (i < lobes) return scatter_by_lobe(v, v.material.lobes[i].proposal, ray, u);
    throughput_ *= v.all / shares_[i];
    ray = go(v, Way(i - lobes));
    return true;
}

// What goes on that way, and as much of it as does.
Ray Tracer::go(const Vertex& v, Way way) {
    const Ideal& ideal = v.ideal;
    density_ = NO_EXTENT;
    if (way == MIRROR) throughput_ *= ideal.mirror;
    if (way == REFLECTION) throughput_ *= ideal.reflected;
    if (way == REFRACTION) {
        throughput_ *= ideal.refracted / (ideal.eta * ideal.eta);
        widening_ *= ideal.eta * ideal.eta;
    }
    return scene_.leaving(v.found, ideal.L(way, v.surface.N, v.V));
}

bool Tracer::scatter_by_lobe(const Vertex& v, const Proposal& proposal, Ray& ray, Vec2 u) {
    const bool guided = u.x < v.guided;
    u.x = guided ? u.x / v.guided : (u.x - v.guided) / (1 - v.guided);
    const Vec3 local_L = guided ? v.frame.to_local(v.cell->sample(u)) : proposal.sample(v.local_V, u);
    if (!(local_L.z > 0)) return false;
    const Vec3 L = v.frame.to_world(local_L);
    density_ = density(v, local_L);
    if (!(density_ > 0)) return false;
    if (v.cell) widening_ *= density_ / lobe_density(v, local_L);
    throughput_ *= f(v, L) * (local_L.z / density_);
    ray = scene_.leaving(v.found, L);
    return throughput_ != Vec3(0);
}

// Russian roulette (Arvo, Kirk 1990): the likelier the end, the less light is left.
bool Tracer::survives(double chance) {
    const double survival = std::max({throughput_.x, throughput_.y, throughput_.z}) * widening_;
    if (survival >= 1) return true;
    if (chance >= survival) return false;
    throughput_ /= survival;
    return true;
}

// The next number of samples at which tiles may be finished and shares are given.
int next_look(int samples) {
    int look = Shares::FIRST_LOOK;
    while (look <= samples) look *= 2;
    return look;
}

// The one at which they were given the last time, 0 before the first.
int last_look(int samples) { return samples < Shares::FIRST_LOOK ? 0 : next_look(samples) / 2; }

// Of lobes that look out for the light of an environment.
std::set<int> outlook_breadths(const Scene& scene, Strategy strategy) {
    std::set<int> breadths;
    const auto& sources = scene.sources();
    const auto* environment = sources.empty() ? nullptr : std::get_if<Environment>(&sources.back());
    if (!environment || !environment->fine() || strategy == Strategy::lobe) return breadths;
    for (const Scene::Object& o : scene.objects())
        for (const Lobe& lobe : o.material.lobes) breadths.insert(Outlook::breadth(lobe.proposal));
    return breadths;
}

}  // namespace

Render::Render(const Scene& scene, const Camera& camera, int width, int height, const RenderSettings& settings)
    : scene_(scene), view_(camera.view(width, height)), settings_(settings), version_(scene.version()),
      film_(width, height) {
    const auto& objects = scene.objects();
    // Before the second vertex nothing may end by chance: densities know nothing of that.
    shares_light_ = settings.share && settings.depth > 1 && settings.roulette > 1 &&
                    std::any_of(objects.begin(), objects.end(), [](auto& o) { return o.material.uniform(); });
    for (const int breadth : outlook_breadths(scene, settings.strategy))
        outlooks_.try_emplace(breadth, std::get<Environment>(scene.sources().back()), breadth);
    if (settings.layers)
        layers_.assign(scene.sources().size(), Film::Sums(Film::HALVES * film_.pixels(), Vec3(0)));
    if (settings.adaptive) shares_.emplace(width, height);
    const Vec3 places[] = {view_.eye, view_.corner, view_.per_x, view_.per_y};
    Fingerprint print;
    for (const Vec3& v : places) print.add(v);
    fingerprint_ = print.add(scene.fingerprint()).add(width).add(height).add(settings.depth).add(settings.roulette)
                       .add(settings.seed).add(settings.strategy).add(settings.layers).add(settings.variance)
                       .add(settings.adaptive).add(settings.guided).add(settings.share).value();
}

void Render::advance(int samples) {
    if (scene_.version() != version_)
        throw std::invalid_argument("the scene has changed since the render was made; make a new one");
    while (samples > 0 && !finished()) {
        aim();
        const int step = std::min(samples, next_look(samples_) - samples_);
        add_samples(step);
        samples -= step;
        samples_ += step;
        if (samples_ != next_look(samples_ - 1)) continue;
        finish_tiles();
        if (shares_)
            shares_->look(samples_, [&](int x, int y) { return !film_.finished(film_.tile(x, y)); },
                          [&](std::size_t pixel, int half) { return film_.samples(pixel, half); });
    }
}

std::size_t Render::guide_bytes(const Scene& scene) {
    const auto& objects = scene.objects();
    const bool asks = std::any_of(objects.begin(), objects.end(),
                                  [](const Scene::Object& o) { return o.material.mirror || o.material.glass; });
    return asks ? Guide::most_bytes(MOST_PHOTONS) : 0;
}

std::size_t Render::outlook_bytes(const Scene& scene, Strategy strategy) {
    return outlook_breadths(scene, strategy).size() * Outlook::BYTES;
}

// A photon for each sample up to the last look, so that they cost about a third of its time: a function of the turns,
// however these are split into calls. Fourfold steps, so that all guides together take a third more than the last one.
void Render::aim() {
    if (!settings_.guided) return;
    const std::size_t samples = film_.pixels() * std::max(last_look(samples_), Shares::FIRST_LOOK);
    std::size_t photons = FEWEST_PHOTONS;
    while (photons < MOST_PHOTONS && 4 * photons <= samples) photons *= 4;
    guide_ = scene_.guide(settings_.depth, photons);
}

// Samples that a pixel's half gets in so many turns after a look.
int Render::due(std::size_t pixel, int half, int turns) const {
    return shares_ ? shares_->samples(pixel, half, turns) : (turns + halves() - 1 - half) / halves();
}

void Render::add_samples(int count) {
    oneapi::tbb::enumerable_thread_specific<Tracer> tracers(
        [&] { return Tracer(scene_, settings_, *guide_, outlooks_); });
    const std::uint64_t sequence = scrambled(settings_.seed + 1);
    const int look = last_look(samples_), begun = samples_ - look, halves = this->halves();

    struct Half {
        std::size_t pixel;
        int had, end;  // samples at the look, and those that it shall have
    };
    const auto keep = [&](const Half& h, int half, const Path& path) {
        const Sum& sum = path.sum;
        if (shares_) shares_->witness(h.pixel, half, film_.samples(h.pixel, half) - h.had, path.alone, look);
        film_.add(h.pixel, half, sum.all);
        for (std::size_t k = 0; k < layers_.size(); ++k) layers_[k][Film::HALVES * h.pixel + half] += sum.by_source[k];
    };
    // One sample of each pixel that shall have more. They share, but not with the other half, which is independent.
    const auto sample = [&](Tracer& tracer, const Companions& pixels, int half, const Half* them) {
        const Half* whose[Companions::COUNT];
        int paths = 0;
        for (int m = 0; m < pixels.count; ++m) {
            const int i = film_.samples(them[m].pixel, half);
            if (i >= them[m].end) continue;
            Samples& points = tracer.points[m][half];
            points.take(i);
            const Vec2 p = points.pair(POSITION);
            tracer.paths[paths].ray = view_.ray(pixels.x[m] + p.x, pixels.y[m] + p.y), tracer.paths[paths].points = &points;
            whose[paths++] = &them[m];
        }
        tracer.trace(tracer.paths, paths);
        for (int j = 0; j < paths; ++j) keep(*whose[j], half, tracer.paths[j]);
        return paths > 0;
    };
    const auto render = [&](Tracer& tracer, const Companions& pixels) {
        Half all[Film::HALVES][Companions::COUNT];
        for (int half = 0; half < halves; ++half)
            for (int m = 0; m < pixels.count; ++m) {
                const std::size_t pixel = film_.pixel(pixels.x[m], pixels.y[m]);
                tracer.points[m][half].begin(sequence + Film::HALVES * pixel + half);
                all[half][m] = {pixel, film_.samples(pixel, half) - due(pixel, half, begun), 0};
            }
        for (int turns = begun + 1; turns <= begun + count; ++turns)
            for (int half = 0; half < halves; ++half) {
                for (int m = 0; m < pixels.count; ++m)
                    all[half][m].end = all[half][m].had + due(all[half][m].pixel, half, turns);
                while (sample(tracer, pixels, half, all[half])) {}
            }
    };
    parallel_for(film_.tiles(), [&](std::size_t t) {
        if (film_.finished(t)) return;
        Tracer& tracer = tracers.local();
        film_.for_pixels(t, [&](int x, int y) {
            const Companions pixels = companions(x, y);
            if (pixels.begins(x, y)) render(tracer, pixels);
        });
    });
}

void Render::finish_tiles() {
    if (!(target_ > 0)) return;
    const Film::Summary all = film_.summary();
    const double allowed = target_ * all.mean / all.values;
    const auto good = [&](const Film::Summary& s) { return s.variance <= allowed * allowed * s.values; };
    const bool all_good = good(all);
    for (std::size_t t = 0; t < film_.tiles(); ++t)
        if (all_good || good(film_.summary(t))) film_.finish(t);
}

bool Render::finished() const {
    for (std::size_t t = 0; t < film_.tiles(); ++t)
        if (!film_.finished(t)) return false;
    return true;
}

std::size_t Render::state_size() const {
    std::size_t size = sizeof STATE_VERSION + sizeof fingerprint_ + sizeof samples_ + sizeof(std::uint64_t);
    for_state(*this, [&](const auto* data, std::size_t count) { size += count * sizeof *data; });
    return size;
}

void Render::state(char* bytes) const {
    char* p = bytes;
    const auto write = [&](const auto* data, std::size_t count) {
        std::memcpy(p, data, count * sizeof *data);
        p += count * sizeof *data;
    };
    write(&STATE_VERSION, 1);
    write(&fingerprint_, 1);
    write(&samples_, 1);
    for_state(*this, write);
    const std::uint64_t sum = Fingerprint().bytes(bytes, p - bytes).value();
    write(&sum, 1);
}

static constexpr int TOO_MANY = 1 << 30;  // samples of a pixel: next_look() must still fit into 32 bits

// Of samples of a pixel, and of whether a tile is finished: a count below 0 would write outside of the film.
static bool could_be(const Vec3& v, int) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
static bool could_be(std::int32_t count, int samples) { return 0 <= count && count <= samples; }
static bool could_be(std::uint8_t finished, int) { return finished <= 1; }
static bool could_be(float share, int) { return 0 <= share && share <= Shares::MOST; }
static bool could_be(const Shares::Blocks& sums, int) {
    return std::all_of(sums.begin(), sums.end(), [](float s) { return std::isfinite(s); });
}

void Render::restore(std::string_view state) {
    const std::size_t size = state_size();
    std::uint64_t head[2] = {0, 0}, sum = 0;  // version and fingerprint
    std::memcpy(head, state.data(), std::min(state.size(), sizeof head));
    if (head[0] != STATE_VERSION)
        throw std::invalid_argument("state: of version " + std::to_string(head[0]) + ", expected " +
                                    std::to_string(STATE_VERSION) + ", whose samples are others");
    if (head[1] != fingerprint_)
        throw std::invalid_argument("state: it belongs to another scene, camera, size or setting");
    if (state.size() == size) std::memcpy(&sum, state.data() + size - sizeof sum, sizeof sum);
    if (state.size() != size || sum != Fingerprint().bytes(state.data(), size - sizeof sum).value())
        throw std::invalid_argument("state: damaged, " + std::to_string(state.size()) + " bytes of " +
                                    std::to_string(size));
    std::int32_t samples;
    const char* const films = state.data() + sizeof head + sizeof samples;
    std::memcpy(&samples, films - sizeof samples, sizeof samples);
    const char* p = films;
    const int times = shares_ ? Shares::MOST : 1;  // as many as the mean a pixel may have
    bool plausible = 0 <= samples && samples < TOO_MANY && samples <= TOO_MANY / times;
    for_state(*this, [&]<class T>(const T*, std::size_t count) {
        for (T value; count > 0; --count, p += sizeof value) {
            std::memcpy(static_cast<void*>(&value), p, sizeof value);
            plausible = plausible && could_be(value, times * samples);
        }
    });
    if (!plausible) throw std::invalid_argument("state: damaged, it holds what no render leaves");
    p = films;
    samples_ = samples;
    for_state(*this, [&](auto* data, std::size_t count) {
        std::memcpy(static_cast<void*>(data), p, count * sizeof *data);
        p += count * sizeof *data;
    });
}

}  // namespace lobe
