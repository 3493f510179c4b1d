// Directions that photons suggest, against the density that they are said to be drawn with.
#include "guide.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lobe {
namespace {

constexpr double PI = 3.14159265358979323846;

Vec3 direction(double z, double turns) {
    const double r = std::sqrt(1 - z * z);
    return {r * std::cos(2 * PI * turns), r * std::sin(2 * PI * turns), z};
}

// So many photons around a direction, all over the sphere where width is 2.
Guide::Cell cell(int count, const Vec3& middle, double width, double others = 1) {
    std::vector<Guide::Photon> photons;
    for (int i = 0; i < count; ++i) {
        const Sample sample(5, i);
        const Vec2 u = sample.pair(0), v = sample.pair(1);
        photons.push_back({Vec3(v.x, v.y, 0), Basis(middle).to_world(direction(1 - width * u.x, u.y)), 0.1 + v.x});
    }
    return Guide::Cell(photons.data(), count, others);
}

// Chi-squared over a grid on the sphere of equal areas; what is drawn at the brink is null, and the density lacks it.
void expect_honest(const Guide::Cell& cell) {
    constexpr int ROWS = 16, COLUMNS = 32, WITHIN = 24, DRAWN = 1 << 16;
    std::vector<double> expected(ROWS * COLUMNS + 1), counts(expected.size());
    for (int y = 0; y < ROWS * WITHIN; ++y)
        for (int x = 0; x < COLUMNS * WITHIN; ++x) {
            const Vec3 L = direction(-1 + 2 * (y + 0.5) / (ROWS * WITHIN), (x + 0.5) / (COLUMNS * WITHIN));
            expected[y / WITHIN * COLUMNS + x / WITHIN] += cell.density(L) * 4 * PI * DRAWN / (expected.size() - 1) / (WITHIN * WITHIN);
        }
    double lacking = DRAWN, null = 0;
    for (double e : expected) lacking -= e;
    for (int i = 0; i < DRAWN; ++i) {
        const Vec2 u = {Sample::fraction(scrambled(2 * i)), Sample::fraction(scrambled(2 * i + 1))};
        const Vec3 L = cell.sample(u);
        if (L == Vec3(0)) {
            ++null;
            continue;
        }
        EXPECT_NEAR(L.length(), 1, 1e-12);
        EXPECT_GT(cell.density(L), 0);
        const int y = std::min(int((L.z + 1) / 2 * ROWS), ROWS - 1);
        const double turns = std::atan2(L.y, L.x) / (2 * PI);
        ++counts[y * COLUMNS + std::min(int((turns < 0 ? turns + 1 : turns) * COLUMNS), COLUMNS - 1)];
    }
    EXPECT_NEAR(null, lacking, 4 * std::sqrt(null) + 0.003 * DRAWN);
    double chi2 = 0;
    int freedom = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (expected[i] < 20) continue;
        const double sigma2 = expected[i] + 1e-4 * expected[i] * expected[i];  // the midpoints' error
        chi2 += (counts[i] - expected[i]) * (counts[i] - expected[i]) / sigma2, ++freedom;
    }
    ASSERT_GT(freedom, 1);
    EXPECT_LT(chi2, freedom + 5 * std::sqrt(2.0 * freedom));
}

TEST(Guide, DrawsWhatItsDensitySays) {
    for (double width : {0.2, 1.0, 2.0})
        for (const Vec3& middle : {Vec3(0, 0, 1), Vec3(0.6, -0.64, -0.48)}) expect_honest(cell(100, middle, width));
    expect_honest(cell(2, Vec3(0, 1, 0), 0.5));
}

TEST(Guide, KnowsNothingWherePhotonsAreFewOrFar) {
    EXPECT_EQ(cell(1, Vec3(0, 0, 1), 0.1).chance(), 0);
    const Guide::Cell many = cell(100, Vec3(0, 0, 1), 0.1);
    EXPECT_GT(many.chance(), 0.5);
    EXPECT_LT(many.chance(), 1);
    EXPECT_TRUE(many.holds({0.5, 0.5, 0}));
    EXPECT_FALSE(many.holds({3, 0.5, 0}));
}

TEST(Guide, LeavesToLobesWhatTheyFind) {
    const double others = 200;  // of an irradiance of 60
    EXPECT_EQ(cell(100, Vec3(0, 0, 1), 2.0, others).chance(), 0);
    EXPECT_GT(cell(100, Vec3(0, 0, 1), 0.05, others).chance(), 0.1);
}

// A ball of glass in a white box: under a small lamp its caustic is hard to find, under a ceiling that glows it is not.
TEST(Guide, IsForLightThatIsHardToFind) {
    const auto cells = [](double lamp) {
        Scene scene;
        const Lobe white("lobe_Lambert(vec3,vec3,vec3,vec3)", {{"albedo", {0.7, 0.7, 0.7}}});
        for (const Vec3& N : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(0, 0, 1)})
            scene.set_material(scene.add(Plane{-N, N, Vec3(N.y, N.z, N.x), 1, 1}), {{white}, {}, {}});
        scene.set_material(scene.add(Sphere{{0.3, -0.55, 0.2}, 0.45}), {{}, {}, Glass{1.5}});
        scene.add_rectangle_light({{0, 0.98, 0}, {0, -1, 0}, {1, 0, 0}, lamp, lamp}, Vec3(1 / (lamp * lamp)));
        const Guide guide(scene, 6, 1 << 16);
        int count = 0;
        for (int i = 0; i < 32; ++i)
            for (int k = 0; k < 32; ++k) {
                const double a = (i + 0.5) / 16 - 1, b = (k + 0.5) / 16 - 1;
                for (const Vec3& p : {Vec3(a, -1, b), Vec3(-1, a, b), Vec3(1, a, b), Vec3(a, b, -1)})
                    count += guide.at(p) != nullptr;
            }
        return count;
    };
    EXPECT_GT(cells(0.15), 2000);  // of 4096
    EXPECT_LT(cells(0.9), 40);
}

// The sun behind a lens: where its light arrives, photons know the way, and nowhere else.
TEST(Guide, TellsWhereLightComesThroughGlass) {
    Scene scene;
    scene.set_material(scene.add(Sphere{Vec3(0), 1}), {{}, {}, Glass{1.5}});
    const Lobe lambert("lobe_Lambert(vec3,vec3,vec3,vec3)", {{"albedo", {0.5, 0.5, 0.5}}});
    scene.set_material(scene.add(Plane{{0, -4, 0}, {0, 1, 0}, {1, 0, 0}, 9}), {{lambert}, {}, {}});
    EXPECT_EQ(Guide(scene, 8, 1000).at({0, -4, 0}), nullptr);
    scene.add_sphere_light({{0, 20, 0}, 0.5}, Vec3(100));
    const Guide guide(scene, 8, 1 << 15);
    const Guide::Cell* below = guide.at({0, -4, 0});
    ASSERT_NE(below, nullptr);
    EXPECT_GT(below->density({0, 1, 0}), 10 / PI);
    EXPECT_EQ(guide.at({0, 5, 0}), nullptr);
    EXPECT_EQ(Guide(scene, 1, 1 << 12).at({0, -4, 0}), nullptr);  // one is that with the lobe
}

// Renders of one scene, such as a window's whenever its camera moves, ask for the same photons again.
TEST(Guide, IsMadeOnceForASceneAsItIs) {
    Scene scene;
    const int ball = scene.add(Sphere{Vec3(0), 1});
    scene.set_material(ball, {{}, {}, Glass{1.5}});
    const Lobe lambert("lobe_Lambert(vec3,vec3,vec3,vec3)", {{"albedo", {0.5, 0.5, 0.5}}});
    scene.set_material(scene.add(Plane{{0, -4, 0}, {0, 1, 0}, {1, 0, 0}, 9}), {{lambert}, {}, {}});
    scene.add_sphere_light({{0, 20, 0}, 0.5}, Vec3(100));
    const auto first = scene.guide(8, 1 << 12), more = scene.guide(8, 1 << 14);
    EXPECT_NE(first, more);
    EXPECT_EQ(scene.guide(8, 1 << 12), first);
    EXPECT_EQ(scene.guide(8, 1 << 14), more);
    ASSERT_NE(first->at({0, -4, 0}), nullptr);
    EXPECT_EQ(scene.guide(1, 1 << 12)->at({0, -4, 0}), nullptr);  // one is that with the lobe
    scene.set_material(ball, {{lambert}, {}, {}});
    EXPECT_EQ(scene.guide(8, 1 << 12)->at({0, -4, 0}), nullptr);
    ASSERT_NE(first->at({0, -4, 0}), nullptr);  // whoever uses it still may
}

}  // namespace
}  // namespace lobe
