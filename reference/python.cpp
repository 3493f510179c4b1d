// The Python module lobe.reference.
#include "python.h"

#include "evaluate.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>

namespace {

using namespace lobe;

const Function& require(const std::string& key) {
    if (const Function* f = find_function(key)) return *f;
    throw nb::key_error(("no function " + key + " in the reference").c_str());
}

using Sweep = void (*)(const Function&, std::span<const double>, std::span<double>);

nb::object sweep(Sweep run, const std::string& key, const Rows& rows) {
    const Function& f = require(key);
    if (rows.shape(1) != f.argument_width)
        throw std::invalid_argument(key + " takes rows of " + std::to_string(f.argument_width) + " numbers, got " +
                                    std::to_string(rows.shape(1)));
    std::vector<double> out(rows.shape(0) * f.result_width);
    {
        nb::gil_scoped_release unlocked;
        run(f, {rows.data(), rows.size()}, out);
    }
    return to_numpy(std::move(out), {rows.shape(0), f.result_width});
}

}  // namespace

NB_MODULE(reference, m) {
    m.doc() = "The double-precision reference: every function of the library, and a ray tracer on Embree.";

    nb::class_<Parameter>(m, "Parameter").def_ro("type", &Parameter::type).def_ro("name", &Parameter::name);
    nb::class_<Function>(m, "Function")
        .def_ro("model", &Function::model)
        .def_ro("name", &Function::name)
        .def_ro("result", &Function::result)
        .def_ro("parameters", &Function::parameters)
        .def_ro("is_quadrature", &Function::is_quadrature)
        .def_prop_ro("key", &Function::key);

    m.def("functions", &functions, "All functions, in the order of models.h.");
    m.def(
        "evaluate", [](const std::string& key, const Rows& rows) { return sweep(&evaluate, key, rows); },
        nb::arg("key"), nb::arg("arguments"),
        "Values of function `key`, name(type,...), for rows of packed arguments (float64, one row an input).");
    m.def(
        "condition", [](const std::string& key, const Rows& rows) { return sweep(&condition, key, rows); },
        nb::arg("key"), nb::arg("arguments"),
        "Condition number of function `key` for each row of arguments and each component of the result.");
    bind_scene(m);
    bind_render(m);
}
