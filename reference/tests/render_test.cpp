// What path tracing draws at random: sequences, proposals and lights against their densities and areas.
#include "fingerprint.h"
#include "material.h"
#include "render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>

namespace lobe {
namespace {

constexpr double PI = 3.14159265358979323846;

// The mean of value(u) over a sequence of points.
template <class Value> double mean_over(std::uint64_t sequence, int count, Value value) {
    double sum = 0;
    for (int i = 0; i < count; ++i) sum += value(Sample(sequence, i).pair(0));
    return sum / count;
}

// The integral of value(L) over the sphere: midpoints.
template <class Value> double over_sphere(int n, Value value) {
    double sum = 0;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < 2 * n; ++j) {
            const double z = 2 * (i + 0.5) / n - 1, r = std::sqrt(1 - z * z), phi = PI * (j + 0.5) / n;
            sum += value(Vec3(r * std::cos(phi), r * std::sin(phi), z));
        }
    return sum * 4 * PI / (2 * n * n);
}

// Sobol 1967: each elementary interval of area 2^-n holds one of any 2^n points that follow each other from a multiple.
TEST(Sample, PairsAreZeroTwoSequences) {
    for (std::uint32_t pair : {0u, 1u, 17u})
        for (int start : {0, 3})
            for (int n : {1, 4, 8})
                for (int across = 0; across <= n; ++across) {
                    std::set<std::pair<int, int>> cells;
                    for (int i = start << n; i < (start + 1) << n; ++i) {
                        const Vec2 p = Sample(42, i).pair(pair);
                        cells.insert({int(p.x * (1 << across)), int(p.y * (1 << (n - across)))});
                    }
                    EXPECT_EQ(cells.size(), std::size_t(1) << n);
                }
}

// A picture whose right side is ten times as noisy, given as many samples as its shares ask for, up to so many turns.
struct Noisy {
    static constexpr int SIZE = 16;
    Noisy(int turns, const std::function<double(std::size_t, int, int)>& value) {
        for (int look = 0; look < turns; look = look == 0 ? Shares::FIRST_LOOK : 2 * look) {
            const int first = look == 0 ? Shares::FIRST_LOOK : look;
            for (std::size_t p = 0; p < film.pixels(); ++p)
                for (int half = 0; half < Film::HALVES; ++half)
                    for (int i = 0, end = shares.samples(p, half, first); i < end; ++i) {
                        shares.witness(p, half, i, value(p, half, 64 * look + i), look);
                        film.add(p, half, Vec3(0));
                    }
            shares.look(look + first, [](int, int) { return true; }, [&](std::size_t p, int half) { return film.samples(p, half); });
        }
    }
    static double noise(std::size_t pixel, int half, int i) {
        const double scatter = pixel % SIZE < SIZE / 2 ? 1 : 10;
        return scatter * (double(scrambled((pixel << 32) + 2 * i + half) >> 40) - 0x1p23) * 0x1p-23;
    }

    Film film{SIZE, SIZE};
    Shares shares{SIZE, SIZE};
};

TEST(Shares, AreInProportionToTheNoiseHoweverLongItIsListenedTo) {
    for (const int turns : {256, 1024}) {
        const Noisy picture(turns, Noisy::noise);
        double quiet = 0, noisy = 0, all = 0;
        for (int y = 0; y < Noisy::SIZE; ++y)
            for (int x = 0; x < Noisy::SIZE; ++x) {
                const int samples = picture.film.samples(picture.film.pixel(x, y));
                all += samples;
                if (x < 6) quiet += samples;
                if (x >= 10) noisy += samples;
            }
        const double wanted = (0.25 + 0.75 * 10 / 5.5) / (0.25 + 0.75 / 5.5);  // a quarter is given to all alike
        EXPECT_NEAR(noisy / quiet, wanted, 0.25 * wanted) << turns;
        EXPECT_NEAR(all, turns * picture.film.pixels(), 0.1 * all) << turns;
    }
}

TEST(Shares, OfAHalfDoNotDependOnWhatItFinds) {
    const Noisy before(512, Noisy::noise);
    const Noisy after(512, [](std::size_t pixel, int half, int i) { return (half == 0 ? 3 * i % 5 : 1) * Noisy::noise(pixel, half, i); });
    int others = 0;
    for (std::size_t p = 0; p < before.film.pixels(); ++p) {
        EXPECT_EQ(before.film.samples(p, 0), after.film.samples(p, 0)) << p;
        others += before.film.samples(p, 1) != after.film.samples(p, 1);
    }
    EXPECT_GT(others, 50);
}

// Over the sequences, each point is uniform, and knows nothing of the other pairs of the same sample.
// Checkpoints of older samples must not go on with new ones. Where this fails, raise STATE_VERSION and note the new sum.
TEST(Sample, OfThisVersionIsAsItWas) {
    Fingerprint print;
    for (int i = 0; i < 1024; ++i)
        for (std::uint32_t k = 0; k < 8; ++k) {
            const Vec2 u = Sample(scrambled(k), i).pair(k);
            print.add(u.x).add(u.y);
        }
    EXPECT_EQ(STATE_VERSION, 12u);
    EXPECT_EQ(print.value(), 7658316976743077338u);
}

TEST(Sample, SeveralPairsAtOnceAreTheSame) {
    Samples samples;
    for (std::uint64_t sequence : {7u, 8u}) {
        samples.begin(sequence);
        for (std::uint32_t index : {0u, 1u, 1000000u}) {
            samples.take(index);
            for (std::uint32_t k : {0u, 20u, 3u, 7u, 8u, 40u}) EXPECT_EQ(samples.pair(k), Sample(sequence, index).pair(k));
        }
    }
}

TEST(Sample, CirclesAreRound) {
    for (int i = 0; i <= 3000; ++i) {
        const double turns = i / 1000.0, angle = 2 * PI * std::fmod(turns, 1.0);
        const Vec2 c = on_circle(turns);
        EXPECT_NEAR(c.x, std::cos(angle), 2e-15) << turns;
        EXPECT_NEAR(c.y, std::sin(angle), 2e-15) << turns;
        EXPECT_NEAR(c.length2(), 1, 1e-15) << turns;
    }
}

TEST(Sample, IsUniformAndPairsAreIndependent) {
    constexpr int SEQUENCES = 20000, BINS = 4;
    for (int index : {0, 1, 7}) {
        double counts[BINS][BINS][BINS] = {};
        for (int s = 0; s < SEQUENCES; ++s) {
            const Sample sample(s, index);
            const Vec2 a = sample.pair(0), b = sample.pair(1);
            ++counts[int(a.x * BINS)][int(a.y * BINS)][int(b.x * BINS)];
        }
        double chi2 = 0;
        const double expected = double(SEQUENCES) / (BINS * BINS * BINS);
        for (const auto& plane : counts)
            for (const auto& row : plane)
                for (double n : row) chi2 += (n - expected) * (n - expected) / expected;
        EXPECT_LT(chi2, 63 + 4 * std::sqrt(2 * 63.0));
    }
}

TEST(Sample, PicksInProportionAndHandsTheRestOn) {
    const double weights[] = {0, 1, 0, 3, 0};
    int counts[5] = {};
    for (int i = 0; i < 1000; ++i) {
        double u = (i + 0.5) / 1000;
        const int chosen = pick(weights, 5, u);
        ++counts[chosen];
        EXPECT_NEAR(u, chosen == 1 ? (i + 0.5) / 250 : (i - 249.5) / 750, 1e-9);
    }
    EXPECT_EQ(counts[1], 250);
    EXPECT_EQ(counts[3], 750);
    double u = 0.5;
    EXPECT_EQ(pick(weights, 1, u), -1);
}

// The density integrates to 1, and a smooth function has the same mean by drawing as by the density.
TEST(Proposal, DrawsWhatItsDensitySays) {
    const auto smooth = [](const Vec3& L) { return 1 + 0.5 * L.x + 0.3 * L.y * L.z + 0.2 * L.z; };
    for (const Proposal& p : {Proposal::cosine(), Proposal::ggx(0.3, 0.3), Proposal::ggx(0.2, 0.7), Proposal::ggx(2, 2),
                              Proposal::power(0), Proposal::power(20)})
        for (const Vec3& V : {Vec3(0, 0, 1), Vec3(0.6, 0, 0.8), Vec3(-0.5, 0.8, 0.2).normalized()}) {
            const double all = over_sphere(500, [&](const Vec3& L) { return p.density(V, L); });
            const double by_density = over_sphere(500, [&](const Vec3& L) { return p.density(V, L) * smooth(L); });
            EXPECT_NEAR(all, 1, 2e-3);
            EXPECT_NEAR(mean_over(1, 1 << 14, [&](Vec2 u) { return smooth(p.sample(V, u)); }), by_density, 3e-3);
        }
}

TEST(Lobe, ProposalKeepsTheWeightsSmall) {
    const Lobe::Parameters wide{{"f0", {1, 1, 1}}, {"alpha", {0.05}}}, blinn{{"rs", {1, 1, 1}}, {"exponent", {200}}};
    std::vector<Lobe> lobes = {{"lobe_Lambert(vec3,vec3,vec3,vec3)", {{"albedo", {1, 1, 1}}}},
                               {"lobe_GGX(vec3,vec3,vec3,vec3,float)", wide},
                               {"lobe_Beckmann(vec3,vec3,vec3,vec3,float)", wide},
                               {"lobe_Phong(vec3,vec3,vec3,vec3,float)", blinn},
                               {"lobe_BlinnPhong(vec3,vec3,vec3,vec3,float)", blinn}};
    for (Lobe& lobe : lobes)
        for (const Vec3& V : {Vec3(0.3, 0, 0.95).normalized(), Vec3(0.8, 0, 0.6)}) {
            lobe.turn({0, 0, 1}, {1, 0, 0}, V);
            double second = 0;
            const double albedo = mean_over(2, 4096, [&](Vec2 u) {
                const Vec3 L = lobe.proposal.sample(V, u);
                const double weight = L.z > 0 ? lobe(L).x * L.z / lobe.proposal.density(V, L) : 0;
                second += weight * weight / 4096;
                return weight;
            });
            EXPECT_NEAR(lobe.albedo(V.z), albedo, 0.15 * albedo);
            EXPECT_LT(second, 3 * albedo * albedo);
        }
}

// Drawn directions lead to the light, with the density that it tells of them; the mean of 1 / density is its solid angle.
template <class LightKind> void expect_honest(const LightKind& light, const Vec3& point, double solid_angle) {
    const double measured = mean_over(3, 1 << 12, [&](Vec2 u) {
        const LightSample s = light.sample(point, u);
        EXPECT_NEAR(light.density(point, s.L), s.density, 1e-6 * s.density);
        EXPECT_NEAR((s.estimate * s.density - Vec3(2)).length(), 0, 1e-9);
        return 1 / s.density;
    });
    EXPECT_NEAR(measured, solid_angle, 2e-3 * solid_angle);
}

TEST(Light, DrawsARectangleBySolidAngle) {
    const RectangleLight light{{0, 0, 2}, Basis(Vec3(0, 0, -1), Vec3(1, 0, 0)), 0.8, 0.5, Vec3(2), 0};
    for (const Vec3& point : {Vec3(0), Vec3(0.8, 0.5, 1.5), Vec3(3, -1, 1.9), Vec3(0, 0, -20), Vec3(0.1, 0.2, 1.99)}) {
        // Van Oosterom, Strackee 1983, of its two triangles
        Vec3 c[4] = {{-.8, -.5, 2}, {.8, -.5, 2}, {.8, .5, 2}, {-.8, .5, 2}};
        for (Vec3& v : c) v = (v - point).normalized();
        double solid_angle = 0;
        for (int i : {1, 2}) {
            const double above = std::abs(c[0].dot(c[i].cross(c[i + 1])));
            const double below = 1 + c[0].dot(c[i]) + c[i].dot(c[i + 1]) + c[i + 1].dot(c[0]);
            solid_angle += 2 * std::atan2(above, below);
        }
        expect_honest(light, point, solid_angle);
    }
    EXPECT_EQ(light.sample({0, 0, 3}, {0.5, 0.5}).estimate, Vec3(0));  // behind
    EXPECT_EQ(light.importance({0, 0, 3}, {0, 0, 1}), 0);
}

TEST(Light, DrawsASphereBySolidAngle) {
    const SphereLight light{{1, 2, 3}, 0.5, Vec3(2), 0};
    for (double distance : {0.51, 1.0, 30.0}) {
        const double cap = 1 - std::sqrt(1 - 0.25 / (distance * distance));
        expect_honest(light, Vec3(1, 2, 3) - Vec3(0.6, 0, 0.8) * distance, 2 * PI * cap);
    }
    EXPECT_EQ(light.sample({1, 2, 3.2}, {0.5, 0.5}).estimate, Vec3(0));  // from within
}

TEST(Environment, DrawsByItsLight) {
    std::vector<float> pixels(3 * 16 * 8);
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = scrambled(i) % 100 < 80 ? 0 : scrambled(i) % 7;
    const Environment light(pixels, 16, 8, 25);
    EXPECT_NEAR(over_sphere(800, [&](const Vec3& L) { return light.seen(L).density; }), 1, 2e-3);
    const auto above = [](const Vec3& v) { return std::max(v.y, 0.0) + 0.3 * v.z * v.z; };
    const double exact = over_sphere(800, [&](const Vec3& L) { return luminance(light.seen(L).radiance) * above(L); });
    const double drawn = mean_over(4, 1 << 14, [&](Vec2 u) {
        const LightSample s = light.sample(Vec3(0), u);
        EXPECT_NEAR((s.estimate * s.density - light.seen(s.L).radiance).length(), 0, 1e-6);
        const Environment::Seen seen = light.seen(s.L);
        EXPECT_NEAR(seen.density * light.preference(light.by_light(), seen.tile), s.density, 1e-6 * s.density);
        return luminance(s.estimate) * above(s.L);
    });
    EXPECT_NEAR(drawn, exact, 5e-3 * exact);
}

// By whatever weights, as far as its density says: on a grid that tiles do not divide.
TEST(Environment, DrawsFromTilesByWeights) {
    std::vector<float> pixels(3 * 150 * 70);
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = scrambled(i / 3) % 100 < 95 ? 0.01 : scrambled(i) % 70;
    const Environment light(pixels, 150, 70, 25);
    const Vec3 axis = Vec3(1, 2, -2) / 3;
    const auto weight = [&](const Vec3& L) { return std::pow(0.55 + 0.45 * axis.dot(L), 8); };
    const Environment::Aim aim = light.aim(weight);
    const auto density = [&](const Environment::Seen& s) { return s.density * light.preference(aim, s.tile); };
    EXPECT_NEAR(over_sphere(800, [&](const Vec3& L) { return density(light.seen(L)); }), 1, 5e-3);
    const double exact = over_sphere(800, [&](const Vec3& L) { return luminance(light.seen(L).radiance) * weight(L); });
    double squares = 0;
    const double drawn = mean_over(4, 1 << 14, [&](Vec2 u) {
        const Environment::Cell cell = light.cell(u, aim);
        const LightSample s = light.sample(cell, light.preference(aim, cell.tile));
        const Environment::Seen seen = light.seen(s.L);
        EXPECT_EQ(seen.tile, cell.tile);
        EXPECT_NEAR(density(seen), s.density, 1e-6 * s.density);
        const double value = luminance(s.estimate) * weight(s.L);
        squares += (value - exact) * (value - exact);
        return value;
    });
    EXPECT_NEAR(drawn, exact, 5e-3 * exact);
    EXPECT_LT(std::sqrt(squares / (1 << 14)), 0.2 * exact);  // 1.8 by light alone
}

// What is nearly nothing beside all light is drawn a little more often than that, and weighed by as much: in a picture too
// coarse for outlooks, too, and by sums of floats.
TEST(Environment, WeighsFaintTilesByTheChanceThatTheyHave) {
    constexpr int WIDTH = 127, HEIGHT = 63;
    std::vector<float> pixels(3 * WIDTH * HEIGHT, 1.f);
    for (int x = 60; x < 64; ++x)
        for (int c = 0; c < 3; ++c) pixels[3 * (50 * WIDTH + x) + c] = 4e6f;
    const Environment light(pixels, WIDTH, HEIGHT, 0);
    const auto above = [](const Vec3& v) { return v.y > 0 ? 1 / (2 * PI) : 0; };
    std::size_t drawn = 0;
    const double mean = mean_over(4, 1 << 18, [&](Vec2 u) {
        const LightSample s = light.sample(Vec3(0), u);
        drawn += s.L.y > 0;
        return s.estimate.x * above(s.L);
    });
    EXPECT_GT(drawn, 100u);
    EXPECT_NEAR(mean, 1, 4 / std::sqrt(double(drawn)));
}

TEST(Outlook, LooksWhereTheLobeReflects) {
    std::vector<float> pixels(3 * 128 * 64, 1.f);
    const Environment light(pixels, 128, 64, 0);
    const Outlook broad(light, Outlook::breadth(Proposal::cosine()));
    const Outlook narrow(light, Outlook::breadth(Proposal::ggx(0.1, 0.1)));
    for (int i = 0; i < 200; ++i) {
        const Vec2 u = Sample(1, i).pair(0);
        const Vec2 around = on_circle(u.x);
        const double z = 2 * u.y - 1, sin = std::sqrt(1 - z * z);
        const Vec3 axis(sin * around.x, z, sin * around.y);
        const auto mean_cosine = [&](const Outlook& outlook) {
            const Environment::Aim& aim = outlook.about(axis);
            return mean_over(1, 256, [&](Vec2 v) { return axis.dot(light.sample(light.cell(v, aim), 1).L); });
        };
        EXPECT_NEAR(mean_cosine(broad), 2 / 3., 0.06);
        EXPECT_GT(mean_cosine(narrow), 0.8);
    }
}

// All kinds of lights and materials at once.
Scene lit_by_everything() {
    Scene scene;
    const Lobe lambert("lobe_Lambert(vec3,vec3,vec3,vec3)", {{"albedo", {0.5, 0.6, 0.7}}});
    const Lobe ggx("lobe_GGX(vec3,vec3,vec3,vec3,float)", {{"f0", {0.04, 0.04, 0.04}}, {"alpha", {0.2}}});
    scene.set_material(scene.add(Plane{{0, -1, 0}, {0, 1, 0}, {1, 0, 0}, 5}), {{lambert}, {}, {}});
    scene.set_material(scene.add(Sphere{Vec3(0), 1}), {{lambert, ggx}, Mirror{Vec3(0.1)}, {}});
    scene.set_material(scene.add(Sphere{{2, 0, 0}, 0.8}), {{}, {}, Glass{1.5}});
    scene.add(Light{true, {0, 1, 0}, Vec3(0.5)});
    scene.add(Light{false, {3, 3, 3}, Vec3(5)});
    scene.add_rectangle_light({{0, 3, 0}, {0, -1, 0}, {1, 0, 0}, 0.5}, Vec3(4));
    scene.add_sphere_light({{-2, 2, 1}, 0.3}, Vec3(9));
    scene.set_environment(Environment(std::vector<float>(3 * 8 * 4, 0.3f), 8, 4, 0));
    return scene;
}

TEST(Render, ThreadsAndStopsDoNotChangeABit) {
    const Scene scene = lit_by_everything();
    const Camera camera({1, 2, 6}, Vec3(0), {0, 1, 0}, 40);
    const auto rendered = [&](int threads, int calls, bool adaptive) {
        set_threads(threads);
        Render render(scene, camera, 50, 40, {.layers = true, .adaptive = adaptive});
        render.set_target(0.05);
        for (int i = 0; i < calls; ++i) render.advance(48 / calls);
        set_threads(0);
        std::vector<char> state(render.state_size());
        render.state(state.data());
        return std::string(state.begin(), state.end());
    };
    for (bool adaptive : {false, true}) {
        const std::string alone = rendered(1, 1, adaptive);
        EXPECT_EQ(alone, rendered(2, 1, adaptive));
        EXPECT_EQ(alone, rendered(4, 6, adaptive));
    }
}

TEST(Render, RefusesWhatIsNotItsState) {
    const Scene scene = lit_by_everything();
    const Camera camera({1, 2, 6}, Vec3(0), {0, 1, 0}, 40);
    Render render(scene, camera, 8, 8, {}), other(scene, camera, 8, 8, {.seed = 1});
    std::string state(render.state_size(), '\0');
    render.state(state.data());
    EXPECT_NO_THROW(render.restore(state));
    EXPECT_THROW(other.restore(state), std::invalid_argument);
    EXPECT_THROW(render.restore(state.substr(1)), std::invalid_argument);
    EXPECT_THROW(render.restore(""), std::invalid_argument);
    state.back() ^= 1;
    EXPECT_THROW(render.restore(state), std::invalid_argument);
}

// With a right checksum, as a program may write it that means harm: samples of a pixel below 0 would be written outside
// of the film.
TEST(Render, RefusesAStateThatNoRenderLeaves) {
    const Scene scene = lit_by_everything();
    const Camera camera({1, 2, 6}, Vec3(0), {0, 1, 0}, 40);
    Render render(scene, camera, 8, 8, {});
    render.advance(2);
    std::string good(render.state_size(), '\0');
    render.state(good.data());
    const std::size_t samples = 16, sums = samples + 4, pixel = sums + 8 * 8 * 2 * sizeof(Vec3);
    const std::size_t finished = pixel + 8 * 8 * Film::HALVES * sizeof(std::int32_t);
    const auto with = [&](std::size_t at, auto value) {
        std::string state = good;
        std::memcpy(state.data() + at, &value, sizeof value);
        const std::uint64_t sum = Fingerprint().bytes(state.data(), state.size() - sizeof sum).value();
        std::memcpy(state.data() + state.size() - sizeof sum, &sum, sizeof sum);
        return state;
    };
    EXPECT_NO_THROW(render.restore(with(pixel, std::int32_t(1))));
    for (const std::int32_t count : {-1, 3, INT32_MIN, INT32_MAX})
        EXPECT_THROW(render.restore(with(pixel, count)), std::invalid_argument) << count;
    for (const std::int32_t count : {-1, 1 << 30, INT32_MAX})
        EXPECT_THROW(render.restore(with(samples, count)), std::invalid_argument) << count;
    EXPECT_THROW(render.restore(with(finished, std::uint8_t(2))), std::invalid_argument);
    for (const double sum : {NAN, INFINITY})
        EXPECT_THROW(render.restore(with(sums, sum)), std::invalid_argument) << sum;
    std::string now(render.state_size(), '\0');
    render.state(now.data());
    EXPECT_EQ(now.compare(with(pixel, std::int32_t(1))), 0) << "a state that is refused changes nothing";
}

}  // namespace
}  // namespace lobe
