#include "material.h"

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

}  // namespace

Lobe::Lobe(const std::string& key, const Parameters& parameters) {
    const Function& f = require(key);
    const auto fail = [&](const std::string& what) {
        throw std::invalid_argument(key + ": " + what + "; its parameters are " + known_parameters(f));
    };
    for (const auto& [name, value] : parameters)
        if (const Parameter* p = f.find(name); !p || is_vector(*p)) fail("no parameter " + name);

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
}

}  // namespace lobe
