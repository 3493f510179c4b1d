// Every function of the reference, by name and type, callable on plain arrays of doubles.
//
// A model file ends with LOBE_MODEL(stem, LOBE_FUNCTION(...), ...), which enters its functions here. The parameter
// names are kept: they tell which arguments are directions, and a test holds them equal to the GLSL's.
#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace lobe {

using Vec2 = Imath::V2d;
using Vec3 = Imath::V3d;

struct Parameter {
    std::string type;  // float, vec2 or vec3, as GLSL spells it
    std::string name;
    std::size_t width;   // doubles that it takes
    std::size_t offset;  // of its first double among the packed arguments
};

struct Function {
    std::string model;  // file stem
    std::string name;
    std::string result;  // float, vec2 or vec3
    std::vector<Parameter> parameters;
    std::size_t result_width;
    std::size_t argument_width;
    void (*call)(const double* arguments, double* result);
    bool is_quadrature = false;  // takes long: a fit's exact value, whose condition number nobody needs

    // name(type,type,...): unique, since GLSL overloads on parameter types alone
    std::string key() const;
    const Parameter* find(std::string_view parameter) const;
};

// All functions, in the order of models.h.
const std::vector<Function>& functions();
// nullptr where there is none of that key.
const Function* find_function(std::string_view key);

namespace detail {

template <class T> struct Packed;  // how a type lies among packed doubles
template <> struct Packed<double> {
    static constexpr std::size_t width = 1;
    static constexpr const char* type = "float";
    static double read(const double* p) { return *p; }
    static void write(double v, double* p) { *p = v; }
};
template <> struct Packed<Vec2> {
    static constexpr std::size_t width = 2;
    static constexpr const char* type = "vec2";
    static Vec2 read(const double* p) { return {p[0], p[1]}; }
    static void write(const Vec2& v, double* p) { p[0] = v.x, p[1] = v.y; }
};
template <> struct Packed<Vec3> {
    static constexpr std::size_t width = 3;
    static constexpr const char* type = "vec3";
    static Vec3 read(const double* p) { return {p[0], p[1], p[2]}; }
    static void write(const Vec3& v, double* p) { p[0] = v.x, p[1] = v.y, p[2] = v.z; }
};

template <auto F> struct Caller;
template <class R, class... A, R (*F)(A...)> struct Caller<F> {
    static constexpr std::size_t argument_width = (Packed<A>::width + ... + 0);

    template <std::size_t... I> static R apply(const double* p, std::index_sequence<I...>) {
        constexpr std::size_t widths[] = {Packed<A>::width...};
        constexpr auto offset = [](std::size_t i) {
            std::size_t sum = 0;
            for (std::size_t k = 0; k < i; ++k) sum += widths[k];
            return sum;
        };
        return F(Packed<A>::read(p + offset(I))...);
    }
    static void call(const double* arguments, double* result) {
        Packed<R>::write(apply(arguments, std::index_sequence_for<A...>{}), result);
    }
    static Function describe(const char* name, const char* parameter_list);
};

// "(double NdotH, double alpha)" -> {NdotH, alpha}
std::vector<std::string> parameter_names(std::string_view list);

template <class R, class... A, R (*F)(A...)>
Function Caller<F>::describe(const char* name, const char* parameter_list) {
    Function f{"", name, Packed<R>::type, {}, Packed<R>::width, argument_width, &call, false};
    const auto names = parameter_names(parameter_list);
    std::size_t i = 0, offset = 0;
    ((f.parameters.push_back({Packed<A>::type, names.at(i++), Packed<A>::width, offset}), offset += Packed<A>::width),
     ...);
    return f;
}

inline Function quadrature(Function f) {
    f.is_quadrature = true;
    return f;
}

struct Model {
    Model(const char* stem, std::vector<Function> functions);
};

}  // namespace detail
}  // namespace lobe

// LOBE_FUNCTION(double, lobe_D_GGX, (double NdotH, double alpha)): one overload, parameter names included.
#define LOBE_FUNCTION(result, name, parameters) \
    ::lobe::detail::Caller<static_cast<result(*) parameters>(name)>::describe(#name, #parameters)
// The same for a function that integrates numerically.
#define LOBE_QUADRATURE(result, name, parameters) \
    ::lobe::detail::quadrature(LOBE_FUNCTION(result, name, parameters))
// Enters the functions of one file; stem is the file's name without its ending.
#define LOBE_MODEL(stem, ...) inline const ::lobe::detail::Model model_##stem(#stem, {__VA_ARGS__});
