#include "registry.h"

#include "models.h"

namespace lobe {
namespace {

std::vector<Function>& registry() {
    static std::vector<Function> all;
    return all;
}

}  // namespace

std::string Function::key() const {
    std::string types;
    for (const Parameter& p : parameters) types += (types.empty() ? "" : ",") + p.type;
    return name + "(" + types + ")";
}

const Parameter* Function::find(std::string_view parameter) const {
    for (const Parameter& p : parameters)
        if (p.name == parameter) return &p;
    return nullptr;
}

const std::vector<Function>& functions() { return registry(); }

const Function* find_function(std::string_view key) {
    for (const Function& f : registry())
        if (f.key() == key) return &f;
    return nullptr;
}

namespace detail {

std::vector<std::string> parameter_names(std::string_view list) {
    std::vector<std::string> names;
    for (std::size_t begin = 1; begin < list.size();) {
        const std::size_t end = list.find_first_of(",)", begin);
        const std::string_view declaration = list.substr(begin, end - begin);
        names.emplace_back(declaration.substr(declaration.find_last_of(' ') + 1));
        begin = end + 1;
    }
    return names;
}

Model::Model(const char* stem, std::vector<Function> functions) {
    for (Function& f : functions) {
        f.model = stem;
        registry().push_back(std::move(f));
    }
}

}  // namespace detail
}  // namespace lobe
