#include "material.h"

#include "fingerprint.h"
#include "models.h"  // all of them, since whoever includes first decides on the order of the registry

#include <algorithm>
#include <stdexcept>

namespace lobe {
namespace {

bool is_vector(const Parameter& p) {
    return p.type == "vec3" && (p.name == "N" || p.name == "T" || p.name == "V" || p.name == "L");
}

// What a renderer can call: it knows the vectors, not the cosines between them.
bool is_lobe(const Function& f) {
    const Parameter *V = f.find("V"), *L = f.find("L");
    return f.result_width != 2 && V && L && is_vector(*V) && is_vector(*L);
}

std::string known_lobes() {
    std::string list;
    for (const Function& f : functions())
        if (is_lobe(f)) list += (list.empty() ? "" : ", ") + f.key();
    return list;
}

std::string known_parameters(const Function& f) {
    std::string list;
    for (const Parameter& p : f.parameters)
        if (!is_vector(p)) list += (list.empty() ? "" : ", ") + p.type + " " + p.name;
    return list.empty() ? "none" : list;
}

const Function& require(const std::string& key) {
    const Function* f = find_function(key);
    if (!f || !is_lobe(*f)) throw std::invalid_argument("no lobe " + key + "; known are " + known_lobes());
    return *f;
}

// What the parameters tell of a lobe's shape.
std::vector<Proposal> candidates(const Lobe::Parameters& given) {
    const auto width = [&](const char* name) { return std::clamp(given.at(name).front(), SMALLEST_ALPHA, 1e3); };
    std::vector<Proposal> list = {Proposal::cosine()};
    if (given.count("alpha")) list.push_back(Proposal::ggx(width("alpha"), width("alpha")));
    if (given.count("alphaX") && given.count("alphaY"))
        list.push_back(Proposal::ggx(width("alphaX"), width("alphaY")));
    if (given.count("exponent")) {
        const double exponent = std::max(given.at("exponent").front(), 0.0), alpha = std::sqrt(2 / (exponent + 2));
        list.push_back(Proposal::power(exponent));
        list.push_back(Proposal::ggx(alpha, alpha));  // Blinn's is about the half vector
    }
    return list;
}

}  // namespace

Lobe::Lobe(const std::string& key, const Parameters& parameters) {
    const Function& f = require(key);
    const auto fail = [&](const std::string& what) {
        throw std::invalid_argument(key + ": " + what + "; its parameters are " + known_parameters(f));
    };
    for (const auto& [name, value] : parameters)
        if (const Parameter* p = f.find(name); !p || is_vector(*p)) fail("no parameter " + name);

    key_ = key;
    call_ = f.call;
    grey_ = f.result_width == 1;
    arguments_.assign(f.argument_width + 3, 0.0);
    for (const Parameter& p : f.parameters) {
        if (is_vector(p)) continue;
        const auto given = parameters.find(p.name);
        if (given == parameters.end()) fail("parameter " + p.name + " is missing");
        if (given->second.size() != p.width) fail(p.name + " takes " + std::to_string(p.width) + " numbers");
        std::copy(given->second.begin(), given->second.end(), arguments_.begin() + p.offset);
    }
    const auto offset = [&](const char* name) {
        const Parameter* p = f.find(name);
        return p ? p->offset : f.argument_width;
    };
    N_ = offset("N"), T_ = offset("T"), V_ = offset("V"), L_ = offset("L");
    turned_ = f.find("T");
    uniform_ = f.name == "lobe_Lambert";
    choose(candidates(parameters));
}

// By trial: points are drawn from the mean of all candidates, so that no peak is missed, and tell the second moment of
// f cos / density under each.
void Lobe::choose(const std::vector<Proposal>& candidates) {
    constexpr int POINTS = 64;
    std::vector<double> moments(candidates.size());
    for (int i = 0; i < ANGLES; ++i) {
        const double cos = (i + 0.5) / ANGLES, sin = std::sqrt(1 - cos * cos);
        for (const Vec3& V : {Vec3(sin, 0, cos), Vec3(0, sin, cos)}) {
            if (V.y != 0 && !turned_) continue;
            turn({0, 0, 1}, {1, 0, 0}, V);
            const int per_candidate = POINTS / static_cast<int>(candidates.size());
            for (std::size_t c = 0; c < candidates.size(); ++c)
                for (int n = 0; n < per_candidate; ++n) {
                    const Vec3 L = candidates[c].sample(V, Sample(c, n).pair(0));
                    if (!(L.z > 0)) continue;
                    const double value = (*this)(L).dot(Vec3(1.0 / 3)) * L.z;
                    double sum = 0;
                    for (const Proposal& p : candidates) sum += p.density(V, L);
                    if (!(value > 0 && sum > 0)) continue;
                    const double weight = 1 / (sum * per_candidate);
                    albedo_[i] += value * weight / (turned_ ? 2 : 1);
                    for (std::size_t k = 0; k < candidates.size(); ++k)
                        moments[k] += value * value * weight / std::max(candidates[k].density(V, L), 1e-300);
                }
        }
    }
    proposal = candidates[std::min_element(moments.begin(), moments.end()) - moments.begin()];
}

double Lobe::albedo(double NdotV) const {
    constexpr double FLOOR = 1e-3;
    const double x = std::clamp(NdotV * ANGLES - 0.5, 0.0, ANGLES - 1.0);
    const int i = std::min(static_cast<int>(x), ANGLES - 2);
    return std::lerp(albedo_[i], albedo_[i + 1], x - i) + FLOOR;
}

std::uint64_t Lobe::fingerprint() const {
    std::vector<double> parameters = arguments_;
    for (std::size_t at : {N_, T_, V_, L_}) std::fill_n(parameters.begin() + at, 3, 0.0);
    return Fingerprint().add(key_).add(parameters).value();
}

Vec3 Mirror::reflectance(double cosI) const {
    if (f0) return lobe_F_Schlick(cosI, *f0);
    return lobe_F_conductor(cosI, eta, k);
}

Ideal::Ideal(const Material& m, double NdotV) : NdotV(NdotV) {
    if (m.mirror && NdotV > 0) mirror = m.mirror->reflectance(NdotV);
    if (!m.glass) return;
    eta = NdotV > 0 ? m.glass->eta : 1 / m.glass->eta;
    reflected = lobe_F_dielectric(std::abs(NdotV), eta), refracted = 1 - reflected;
}

Vec3 Ideal::L(Way way, const Vec3& N, const Vec3& V) const {
    if (way != REFRACTION) return N * (2 * NdotV) - V;
    return lobe_refract(NdotV > 0 ? N : -N, V, eta).normalized();
}

}  // namespace lobe
