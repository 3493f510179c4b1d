// The reference models against what they must obey: normalisation, energy, symmetry and limits. No formula is repeated.
#include "models.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <random>
#include <set>

namespace lobe {
namespace {

constexpr double PI = std::numbers::pi;
constexpr double ROUNDING = 1e-13;   // some hundred operations in double
constexpr double QUADRATURE = 1e-5;  // midpoint sums across the kink at the facet's own horizon

Vec3 direction(double theta, double phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

const Vec3 NORMAL(0, 0, 1);

// Integral over the hemisphere by midpoints. theta is spaced for features of angular width `width` about the pole.
double over_hemisphere(double width, int steps, const std::function<double(const Vec3&)>& f) {
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
        const double u = (i + 0.5) / steps, slope = width * u / (1 - u), theta = std::atan(slope);
        const double d_theta = width / ((1 - u) * (1 - u)) / (1 + slope * slope) / steps;
        for (int j = 0; j < steps; ++j)
            sum += f(direction(theta, 2 * PI * (j + 0.5) / steps)) * std::sin(theta) * d_theta * 2 * PI / steps;
    }
    return sum;
}

// Pairs of directions above the surface, the same at every run.
void for_pairs(const std::function<void(const Vec3& V, const Vec3& L)>& check) {
    std::mt19937 random(2007);
    std::uniform_real_distribution<double> theta(0, PI / 2), phi(0, 2 * PI);
    for (int i = 0; i < 1000; ++i) check(direction(theta(random), phi(random)), direction(theta(random), phi(random)));
}

TEST(Registry, KeysAreUniqueAndFound) {
    std::set<std::string> keys;
    for (const Function& f : functions()) {
        EXPECT_TRUE(keys.insert(f.key()).second) << f.key();
        EXPECT_EQ(find_function(f.key()), &f);
    }
    EXPECT_TRUE(keys.count("lobe_D_GGX(vec3,vec3,float)"));
}

TEST(Core, HalfAngleCosineKeepsItsDigitsTowardsOppositeDirections) {
    for (double gap : {1e-3, 1e-6, 1e-9}) {
        const double half = lobe_LdotH(direction(PI / 2, 0), Vec3(-std::cos(gap), std::sin(gap), 0));
        EXPECT_NEAR(half / std::sin(gap / 2), 1, ROUNDING);
    }
    EXPECT_EQ(lobe_LdotH(NORMAL, -NORMAL), 0);
}

TEST(Core, SineOfHalfVectorDoesNotDependOnItsLength) {
    for (double length : {1e-20, 1.0, 1e20})
        EXPECT_NEAR(lobe_sin2_NH(NORMAL, direction(1e-5, 1) * length) / std::pow(std::sin(1e-5), 2), 1, ROUNDING);
    EXPECT_EQ(lobe_sin2_NH(NORMAL, Vec3(0)), 0);
}

TEST(GGX, ProjectedAreaOfFacetsIsOne) {
    for (double alpha : {1e-4, 0.01, 0.3, 1.0, 4.0}) {
        const auto from_cosine = [&](const Vec3& H) { return lobe_D_GGX(H.z, alpha) * H.z; };
        const auto from_vectors = [&](const Vec3& H) { return lobe_D_GGX(NORMAL, H, alpha) * H.z; };
        EXPECT_NEAR(over_hemisphere(alpha, 1000, from_cosine), 1, QUADRATURE) << "alpha " << alpha;
        EXPECT_NEAR(over_hemisphere(alpha, 1000, from_vectors), 1, QUADRATURE) << "alpha " << alpha;
    }
}

// Heitz 2014: what the facets show to V fills the projected area of the surface exactly, when G1 is right for D.
TEST(GGX, WeakWhiteFurnace) {
    for (double alpha : {0.1, 0.5, 1.0, 2.0})
        for (double theta : {0.1, 0.8, 1.3, 1.5}) {
            const Vec3 V = direction(theta, 0);
            const double seen = over_hemisphere(alpha, 1000, [&](const Vec3& H) {
                return lobe_D_GGX(NORMAL, H, alpha) * std::max(0.0, V.dot(H));
            });
            EXPECT_NEAR(lobe_G1_GGX(V.z, alpha) * seen / V.z, 1, 10 * QUADRATURE) << alpha << " " << theta;
        }
}

TEST(GGX, WhiteFurnaceLosesButNeverGains) {
    for (double alpha : {0.2, 0.5, 1.0})
        for (double theta : {0.0, 0.8, 1.5}) {
            const Vec3 V = direction(theta, 0);
            const double albedo = over_hemisphere(
                1, 400, [&](const Vec3& L) { return lobe_GGX(NORMAL, V, L, Vec3(1), alpha).x * L.z; });
            EXPECT_LE(albedo, 1);
            EXPECT_GE(albedo, 0.25);
        }
}

TEST(GGX, VisibilityIsMaskingOverCosines) {
    for_pairs([](const Vec3& V, const Vec3& L) {
        EXPECT_NEAR(4 * V.z * L.z * lobe_V_GGX(V.z, L.z, 0.3) / lobe_G2_GGX(V.z, L.z, 0.3), 1, ROUNDING);
        EXPECT_LE(lobe_G2_GGX(V.z, L.z, 0.3), std::min(lobe_G1_GGX(V.z, 0.3), lobe_G1_GGX(L.z, 0.3)));
    });
}

TEST(GGX, VisibilityHasALimitAtGrazing) {
    EXPECT_NEAR(lobe_V_GGX(0, 0.5, 0.3) / lobe_V_GGX(1e-12, 0.5, 0.3), 1, 1e-10);
    EXPECT_TRUE(std::isfinite(lobe_V_GGX(0, 0, 0)));
}

TEST(Lobes, AreReciprocal) {
    for_pairs([](const Vec3& V, const Vec3& L) {
        const Vec3 colour(0.2, 0.9, 1.02);
        const auto expect_same = [](const Vec3& a, const Vec3& b) {
            for (int k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], ROUNDING * a[k]);
        };
        expect_same(lobe_GGX(NORMAL, V, L, colour, 0.3), lobe_GGX(NORMAL, L, V, colour, 0.3));
        expect_same(lobe_GGX_Kelemen(NORMAL, V, L, colour, 0.3), lobe_GGX_Kelemen(NORMAL, L, V, colour, 0.3));
        expect_same(lobe_OrenNayar_qualitative(NORMAL, V, L, colour, 0.5),
                    lobe_OrenNayar_qualitative(NORMAL, L, V, colour, 0.5));
    });
}

TEST(Lobes, AreBlackBelowTheHorizon) {
    const Vec3 above = direction(0.5, 0), below = direction(2, 1), albedo(1);
    for (const auto& [V, L] : {std::pair(above, below), std::pair(below, above), std::pair(below, below)}) {
        EXPECT_EQ(lobe_Lambert(NORMAL, V, L, albedo), Vec3(0));
        EXPECT_EQ(lobe_OrenNayar_qualitative(NORMAL, V, L, albedo, 0.5), Vec3(0));
        EXPECT_EQ(lobe_GGX(NORMAL, V, L, albedo, 0.5), Vec3(0));
        EXPECT_EQ(lobe_GGX_Kelemen(NORMAL, V, L, albedo, 0.5), Vec3(0));
    }
}

TEST(OrenNayar, IsLambertWithoutRoughness) {
    for_pairs([](const Vec3& V, const Vec3& L) {
        const Vec3 rough = lobe_OrenNayar_qualitative(NORMAL, V, L, Vec3(0.7), 0);
        EXPECT_NEAR(rough.x / lobe_Lambert(NORMAL, V, L, Vec3(0.7)).x, 1, ROUNDING);
    });
}

TEST(OrenNayar, IsBrightestTowardsTheLight) {
    const Vec3 L = direction(1.2, 0);
    const auto f = [&](double phi) {
        return lobe_OrenNayar_qualitative(NORMAL, direction(1.2, phi), L, Vec3(1), 0.5).x;
    };
    EXPECT_GT(f(0), f(1));
    EXPECT_GT(f(1), f(2));
    EXPECT_EQ(f(2), f(3));  // a constant on the far side
}

TEST(Fresnel, ReflectedAndTransmittedFluxIsOne) {
    for (double eta : {0.4, 0.75, 0.999, 1.0, 1.0003, 1.5, 4.0})
        for (double cosI : {0.0, 1e-6, 0.1, 0.5, 0.9, 1.0})
            EXPECT_NEAR(lobe_F_dielectric(cosI, eta) + lobe_T_dielectric(cosI, eta), 1, ROUNDING) << cosI << " " << eta;
}

// Stokes: the interface reflects the same from both sides, at angles tied by Snell's law.
TEST(Fresnel, ReflectsTheSameFromBothSides) {
    for (double eta : {1.05, 1.5, 3.0})
        for (double cosI : {0.1, 0.5, 0.9}) {
            const double cosT = lobe_cosT(cosI, eta);
            EXPECT_NEAR(lobe_F_dielectric(cosT, 1 / eta) / lobe_F_dielectric(cosI, eta), 1, 100 * ROUNDING);
            EXPECT_NEAR(lobe_cosT(cosT, 1 / eta), cosI, ROUNDING);
        }
}

// Brewster 1815: at tan(theta) = eta only the s-polarised half is left, which is ((eta^2 - 1)/(eta^2 + 1))^2.
TEST(Fresnel, BrewsterAngle) {
    for (double eta : {1.33, 1.5, 2.4}) {
        const double s = (eta * eta - 1) / (eta * eta + 1);
        EXPECT_NEAR(lobe_F_dielectric(std::cos(std::atan(eta)), eta), s * s / 2, ROUNDING);
    }
}

TEST(Fresnel, TotalReflectionBeginsAtTheCriticalAngle) {
    const double critical = lobe_cos_critical(1 / 1.5);
    EXPECT_EQ(lobe_T_dielectric(critical - 1e-9, 1 / 1.5), 0);
    EXPECT_EQ(lobe_cosT(critical - 1e-9, 1 / 1.5), 0);
    EXPECT_GT(lobe_T_dielectric(critical + 1e-9, 1 / 1.5), 0);
    EXPECT_EQ(lobe_cos_critical(1.5), 0);
}

TEST(Fresnel, NormalIncidence) {
    for (double eta : {1.0, 1.0003, 1.5, 4.0}) {
        EXPECT_NEAR(lobe_f0(eta), lobe_F_dielectric(1, eta), ROUNDING);
        EXPECT_NEAR(lobe_eta(lobe_f0(eta)), eta, ROUNDING);
    }
    EXPECT_TRUE(std::isfinite(lobe_eta(1)) && lobe_eta(1.02) == lobe_eta(1));
}

TEST(Fresnel, SchlickRunsFromNormalToGrazingColour) {
    const Vec3 gold(1.022, 0.782, 0.344), rim(0.9, 1, 0.5);
    EXPECT_EQ(lobe_F_Schlick(1, gold, rim), gold);
    EXPECT_EQ(lobe_F_Schlick(1.0000001, gold, rim), gold);
    EXPECT_EQ(lobe_F_Schlick(0, gold, rim), rim);
    EXPECT_EQ(lobe_F_Schlick(0.3, gold).y, lobe_F_Schlick(0.3, gold.y, 1.0));
    for (double cosI = 0; cosI <= 1; cosI += 1.0 / 64)  // Schlick's own figure for glass, erratum 13 of the lecture
        EXPECT_NEAR(lobe_F_Schlick(cosI, lobe_f0(1.5)), lobe_F_dielectric(cosI, 1.5), 0.037);
}

TEST(Masking, GrooveShadesOnlyFarFromTheMirror) {
    EXPECT_EQ(lobe_G_Vgroove(0.9, 0.9, 1, 0.9), 1);
    EXPECT_NEAR(lobe_G_Vgroove(0.1, 0.8, 0.7, 0.5), 0.28, ROUNDING);
    EXPECT_EQ(lobe_G_Vgroove(0, 0.8, 0.7, 0.5), 0);
    EXPECT_NEAR(lobe_V_Vgroove(0, 0.8, 0.7, 0.5) / lobe_V_Vgroove(1e-9, 0.8, 0.7, 0.5), 1, ROUNDING);
    for_pairs([](const Vec3& V, const Vec3& L) {
        const Vec3 H = (V + L).normalized();
        const double VdotH = lobe_LdotH(V, L), G = lobe_G_Vgroove(V.z, L.z, H.z, VdotH);
        EXPECT_NEAR(4 * V.z * L.z * lobe_V_Vgroove(V.z, L.z, H.z, VdotH), G, ROUNDING);
        EXPECT_NEAR(lobe_V_Kelemen(V, L) * (V + L).length2(), 1, 1e-9);  // V + L itself cancels
    });
}

}  // namespace
}  // namespace lobe
