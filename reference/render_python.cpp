// Renders of the module lobe.reference.
#include "python.h"

#include "render.h"

#include <nanobind/stl/string.h>

#include <cmath>
#include <stdexcept>

namespace {

using namespace lobe;
using namespace nb::literals;

Strategy strategy(const std::string& name) {
    if (name == "mis") return Strategy::mis;
    if (name == "lobe") return Strategy::lobe;
    if (name == "light") return Strategy::light;
    throw std::invalid_argument("strategy: expected mis, lobe or light, got " + name);
}

void require(bool holds, const std::string& name, const char* expected, double got) {
    if (!holds) throw std::invalid_argument(name + ": expected " + expected + ", got " + std::to_string(got));
}

void require_variance(const Render& render) {
    if (!render.settings().variance) throw std::invalid_argument("variance: the render was made without");
}

void make(Render* self, const Scene& scene, const Camera& camera, int width, int height, int depth, int roulette,
          std::uint64_t seed, const std::string& strategy_name, bool layers, bool variance, bool adaptive, bool guided,
          bool share) {
    require(width >= 1, "width", "at least 1", width);
    require(height >= 1, "height", "at least 1", height);
    require(depth >= 0, "depth", "at least 0", depth);
    require(roulette >= 0, "roulette", "at least 0", roulette);
    new (self) Render(scene, camera, width, height,
                      {depth, roulette, seed, strategy(strategy_name), layers, variance, adaptive, guided, share});
}

// An array [h, w, channels] from what value(pixel, out) writes for each pixel.
template <class T, class Value> nb::object picture(const Film& film, std::size_t channels, const Value& value) {
    std::vector<T> image(film.pixels() * channels);
    {
        nb::gil_scoped_release unlocked;  // so that a window goes on meanwhile
        for (std::size_t pixel = 0; pixel < film.pixels(); ++pixel) value(pixel, image.data() + channels * pixel);
    }
    const std::size_t h = film.height, w = film.width;
    return channels == 1 ? to_numpy(std::move(image), {h, w}) : to_numpy(std::move(image), {h, w, channels});
}

void write(const Vec3& v, double* p) { p[0] = v.x, p[1] = v.y, p[2] = v.z; }

nb::object layers(const Render& render) {
    const Film& film = render.film();
    const std::size_t pixels = film.pixels(), count = render.layers().size();
    if (count == 0) throw std::invalid_argument("layers: the render was made without, or there is no light");
    std::vector<double> images(3 * pixels * count);
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t p = 0; p < pixels; ++p)
            write(film.mean(render.layers()[i], p), images.data() + 3 * (pixels * i + p));
    return to_numpy(std::move(images), {count, std::size_t(film.height), std::size_t(film.width), 3});
}

}  // namespace

void bind_render(nb::module_& m) {
    m.def("guide_bytes", &Render::guide_bytes, "scene"_a,
          "Bytes that photons of a guided render may take; 0 where the scene has neither mirror nor glass.");
    m.def("outlook_bytes", [](const Scene& scene, const std::string& name) {
        return Render::outlook_bytes(scene, strategy(name));
    }, "scene"_a, "strategy"_a = "mis",
       "Bytes that a render takes to tell lobes where an environment of many texels has its light.");
    nb::class_<Render>(m, "Render",
                       "A path-traced picture that gets better as long as one likes. ValueError on bad input, and where\n"
                       "the scene has been changed since.")
        .def("__init__", &make, "scene"_a, "camera"_a, "width"_a, "height"_a, "depth"_a = 8, "roulette"_a = 4,
             "seed"_a = 0, "strategy"_a = "mis", "layers"_a = false, "variance"_a = true, "adaptive"_a = false,
             "guided"_a = true, "share"_a = true, nb::keep_alive<1, 2>(),
             "depth: interactions with surfaces on the longest path; 0 shows the lights alone, 1 has direct light.\n"
             "roulette: interactions before paths may end by chance. strategy: how directions to lights with an extent\n"
             "are drawn, 'mis' (both ways, weighted), 'lobe' or 'light'. layers: a film for each light, too.\n"
             "variance: draw two independent halves, which tell it; without, there is a little less noise, but\n"
             "variance, error and target are refused. adaptive: noisier pixels get more samples, and no bias.\n"
             "guided: photons tell from where light comes through glass or off mirrors: less noise, and no bias.\n"
             "share: pixels that are near share light that their paths have found on Lambertian surfaces.")
        .def("advance", [](Render& r, int samples) {
            require(samples >= 0, "samples", "at least 0", samples);
            nb::gil_scoped_release unlocked;
            r.advance(samples);
        }, "samples"_a, "Adds so many samples to each pixel that is not finished, on an average where the render is\n"
                        "adaptive: to the last bit the same for any number of threads, and however they are split into\n"
                        "calls.")
        .def("set_target", [](Render& r, double error) {
            require(error >= 0, "error", "at least 0", error);
            require_variance(r);
            r.set_target(error);
        }, "error"_a, "Tiles of 16 x 16 pixels are finished as soon as their root mean square standard error over the\n"
                      "mean of the picture is below, and all of them as soon as the picture's own is; 0: never.\n"
                      "Looked at after 16, 32, 64 .. samples.")
        .def_prop_ro("finished", &Render::finished)
        .def_prop_ro("turns", &Render::turns, "Samples of the pixels that are not finished, on an average.")
        .def("samples", [](const Render& r) {
            return picture<std::int32_t>(r.film(), 1, [&](std::size_t p, std::int32_t* out) { *out = r.film().samples(p); });
        }, "Samples of each pixel, [h,w] int32.")
        .def("beauty", [](const Render& r) {
            return picture<double>(r.film(), 3, [&](std::size_t p, double* out) { write(r.film().mean(p), out); });
        }, "Mean radiance, [h,w,3], linear RGB.")
        .def("variance", [](const Render& r) {
            require_variance(r);
            return picture<double>(r.film(), 3, [&](std::size_t p, double* out) { write(r.film().variance(p), out); });
        }, "Variance of that mean, [h,w,3]: unbiased, from two independent halves of the samples, and so with one\n"
           "degree of freedom a pixel; of an adaptive render, where noise is rare and large, about 1 % too small.\n"
           "Take means over some pixels; for the error of a region's mean see deviation().\n"
           "0 before there are two samples.")
        .def("deviation", [](const Render& r) {
            require_variance(r);
            return picture<double>(r.film(), 3, [&](std::size_t p, double* out) { write(r.film().deviation(p), out); });
        }, "Half the difference of the two halves of the samples, [h,w,3]; its square is the variance. Pixels of one\n"
           "group share light and are noisy together, so that the mean of a region is more uncertain than the variances\n"
           "of its pixels tell: for each group sum its deviations within the region; the root of the sum of these\n"
           "squared, over the number of pixels, is the standard error (lobe.lab.rendering.error_of_mean).")
        .def("groups", [](const Render& r) {
            const int width = r.film().width;
            return picture<std::int32_t>(r.film(), 1, [&](std::size_t p, std::int32_t* out) {
                const Companions group = r.companions(int(p % width), int(p / width));
                *out = std::int32_t(r.film().pixel(group.x[0], group.y[0]));
            });
        }, "Which pixels share light, [h,w] int32: those of one number.")
        .def("layers", &layers, "What each light has to do with it, [lights,h,w,3], in the order of light_names.")
        .def("error", [](const Render& r) {
            require_variance(r);
            return r.film().error();
        },
             "Root mean square standard error of the pixels over the mean of the picture; infinite before there are\n"
             "two samples everywhere.")
        .def("state", [](const Render& r) {
            PyObject* bytes = PyBytes_FromStringAndSize(nullptr, static_cast<Py_ssize_t>(r.state_size()));
            if (!bytes) throw nb::python_error();
            r.state(PyBytes_AsString(bytes));
            return nb::steal<nb::bytes>(bytes);
        }, "All that an equal render needs to go on to the same bits.")
        .def("restore", [](Render& r, nb::bytes s) { r.restore({s.c_str(), s.size()}); }, "state"_a,
             "Takes over a state. ValueError where it belongs to another scene, camera, size, setting or version,\n"
             "or is damaged; then nothing has changed.");
}
