// The reference models against what they must obey: normalisation, energy, symmetry and limits. No formula is repeated.
#include "hemisphere.h"

#include <set>

namespace lobe {
namespace {

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

TEST(Core, QuarterTurnsAreExact) {
    EXPECT_EQ(lobe_circle(0), Vec2(1, 0));
    EXPECT_EQ(lobe_circle(0.25), Vec2(0, 1));
    EXPECT_EQ(lobe_circle(0.5), Vec2(-1, 0));
    EXPECT_EQ(lobe_circle(0.75), Vec2(0, -1));
    EXPECT_EQ(lobe_circle(1), Vec2(1, 0));
}

TEST(Core, CircleKeepsTheDigitsOfSmallTurnsFromAQuarter) {
    for (double gap : {0x1p-30, 0x1p-40, 0x1p-50})  // so small that the sine is the arc
        for (double sign : {-1.0, 1.0}) {
            const double arc = sign * 2 * PI * gap, turn = sign * gap;
            EXPECT_NEAR(lobe_circle(0.25 + turn).x / -arc, 1, ROUNDING) << turn;
            EXPECT_NEAR(lobe_circle(0.5 + turn).y / -arc, 1, ROUNDING) << turn;
            EXPECT_NEAR(lobe_circle(0.75 + turn).x / arc, 1, ROUNDING) << turn;
            EXPECT_NEAR(lobe_circle(sign > 0 ? gap : 1 - gap).y / arc, 1, ROUNDING) << turn;
        }
}

// The corners of the regular pentagon, hexagon and octagon, by radicals.
TEST(Core, CirclePassesTheCornersOfPolygons) {
    const double golden = (1 + std::sqrt(5)) / 2;
    for (const auto& [u, cosine] : {std::pair(1 / 5.0, 1 / (2 * golden)), {2 / 5.0, -golden / 2}, {1 / 6.0, 0.5},
                                    {1 / 3.0, -0.5}, {1 / 8.0, std::sqrt(0.5)}, {3 / 8.0, -std::sqrt(0.5)}}) {
        const double sine = std::sqrt((1 - cosine) * (1 + cosine));
        for (double side : {1.0, -1.0}) {
            const Vec2 corner = lobe_circle(side > 0 ? u : 1 - u);
            EXPECT_NEAR(corner.x, cosine, ROUNDING) << u;
            EXPECT_NEAR(corner.y, side * sine, ROUNDING) << u;
        }
    }
}

TEST(Core, TurnsAddUpOnTheCircle) {
    for (int i = 0; i <= 1000; ++i) {
        const double u = i / 1000.0;
        const Vec2 p = lobe_circle(u), half = lobe_circle(u / 2);
        EXPECT_NEAR(p.length(), 1, ROUNDING) << u;
        EXPECT_NEAR(p.x, half.x * half.x - half.y * half.y, ROUNDING) << u;
        EXPECT_NEAR(p.y, 2 * half.x * half.y, ROUNDING) << u;
    }
}

TEST(Core, CircleEndsAtAFullTurn) {
    for (double u : {-0.0, -1e-300, -0.25, -1e300}) EXPECT_EQ(lobe_circle(u), lobe_circle(0)) << u;
    for (double u : {1 + 0x1p-52, 1.25, 1e300}) EXPECT_EQ(lobe_circle(u), lobe_circle(1)) << u;
}

// Half of what is left is passed every ln 2: 1 - 2^-k is a float up to k = 23, where u ends.
TEST(Core, ExponentialHalvesWhatIsLeftInEqualSteps) {
    for (int k = 0; k <= 23; ++k)
        EXPECT_NEAR(lobe_quantile_exponential(1 - std::exp2(-k)), k * std::numbers::ln2, ROUNDING * k) << k;
}

TEST(Core, ExponentialKeepsTheDigitsOfSmallShares) {
    for (double u : {1e-300, 1e-30, 1e-10, 1e-6, 1e-4})
        EXPECT_NEAR(lobe_quantile_exponential(u) / u, 1 + u * (1 / 2.0 + u * (1 / 3.0 + u / 4)), ROUNDING) << u;
}

// A wait that has lasted is as long from then on as a new one: of what u leaves, v more is passed at the sum of both.
TEST(Core, ExponentialHasNoMemory) {
    for (double u : {1e-9, 0.01, 0.3, 0.77, 0.999})
        for (double v : {1e-12, 0.05, 0.5, 0.98}) {
            const double both = lobe_quantile_exponential(u) + lobe_quantile_exponential(v), slope = 1 / ((1 - u) * (1 - v));
            EXPECT_NEAR(lobe_quantile_exponential(u + v - u * v), both, ROUNDING * both + 0x1p-52 * slope) << u << ' ' << v;
        }
}

TEST(Core, ExponentialEndsAtTheFloatBelowOne) {
    for (double u : {-0.0, -1e-300, -0.5, -1e300}) EXPECT_EQ(lobe_quantile_exponential(u), 0) << u;
    EXPECT_LT(lobe_quantile_exponential(1 - 0x1p-22), lobe_quantile_exponential(1 - 0x1p-23));
    for (double u : {0.9999999, 1.0, 1.5, 1e300}) EXPECT_EQ(lobe_quantile_exponential(u), lobe_quantile_exponential(1 - 0x1p-23)) << u;
}

// The tangents of halves of 2 pi / n are radicals.
TEST(Core, AngleOfKnownTangents) {
    EXPECT_EQ(lobe_angle_of_half(0), 0);
    EXPECT_NEAR(lobe_angle_of_half(1) / (PI / 2), 1, ROUNDING);
    EXPECT_NEAR(lobe_angle_of_half(std::sqrt(5 - 2 * std::sqrt(5))) / (2 * PI / 5), 1, ROUNDING);
    EXPECT_NEAR(lobe_angle_of_half(1 / std::sqrt(3)) / (PI / 3), 1, ROUNDING);
    EXPECT_NEAR(lobe_angle_of_half(std::sqrt(2) - 1) / (PI / 4), 1, ROUNDING);
    EXPECT_NEAR(lobe_angle_of_half(std::sqrt(1 - 2 / std::sqrt(5))) / (PI / 5), 1, ROUNDING);
    EXPECT_NEAR(lobe_angle_of_half(2 - std::sqrt(3)) / (PI / 6), 1, ROUNDING);
}

// Angles add up as complex numbers multiply: Machin 1706, Euler 1755.
TEST(Core, AnglesAddUpToTurns) {
    EXPECT_NEAR(2 * lobe_angle_of_half(1 / 5.0) - lobe_angle_of_half(1 / 239.0) / 2, PI / 4, ROUNDING);
    EXPECT_NEAR(5 * lobe_angle_of_half(1 / 7.0) + 2 * lobe_angle_of_half(3 / 79.0), PI / 2, ROUNDING);
}

TEST(Core, AngleIsThatOfTheRationalPointOfTheCircle) {
    for (int i = 0; i <= 1000; ++i) {
        const double t = i / 1000.0, angle = lobe_angle_of_half(t);
        EXPECT_NEAR(std::cos(angle), (1 - t) * (1 + t) / (1 + t * t), ROUNDING) << t;
        EXPECT_NEAR(std::sin(angle), 2 * t / (1 + t * t), ROUNDING) << t;
    }
    for (double t : {1e-300, 1e-30, 1e-8, 1e-4}) EXPECT_NEAR(lobe_angle_of_half(t) / (2 * t), 1 - t * t / 3, ROUNDING) << t;
}

TEST(Core, AngleEndsAtARightOne) {
    for (double t : {-0.0, -1e-300, -0.5, -1e300}) EXPECT_EQ(lobe_angle_of_half(t), 0) << t;
    for (double t : {1 + 0x1p-52, 1.5, 1e300}) EXPECT_EQ(lobe_angle_of_half(t), lobe_angle_of_half(1)) << t;
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
        for (const auto lobe : {&lobe_Beckmann, &lobe_CookTorrance, &lobe_Phong, &lobe_BlinnPhong, &lobe_OrenNayar,
                                &lobe_OrenNayar_EON, &lobe_OrenNayar_EON_fast})
            expect_same(lobe(NORMAL, V, L, colour, 0.3), lobe(NORMAL, L, V, colour, 0.3));
        expect_same(lobe_GGX_aniso(NORMAL, ALONG, V, L, colour, 0.1, 0.4),
                    lobe_GGX_aniso(NORMAL, ALONG, L, V, colour, 0.1, 0.4));
        expect_same(lobe_GGX_conductor(NORMAL, V, L, GOLD_ETA, GOLD_K, 0.3),
                    lobe_GGX_conductor(NORMAL, L, V, GOLD_ETA, GOLD_K, 0.3));
    });
}

TEST(Lobes, AreBlackBelowTheHorizon) {
    const Vec3 above = direction(0.5, 0), below = direction(2, 1), albedo(1);
    for (const auto& [V, L] : {std::pair(above, below), std::pair(below, above), std::pair(below, below)}) {
        EXPECT_EQ(lobe_Lambert(NORMAL, V, L, albedo), Vec3(0));
        EXPECT_EQ(lobe_OrenNayar_qualitative(NORMAL, V, L, albedo, 0.5), Vec3(0));
        EXPECT_EQ(lobe_GGX(NORMAL, V, L, albedo, 0.5), Vec3(0));
        EXPECT_EQ(lobe_GGX_Kelemen(NORMAL, V, L, albedo, 0.5), Vec3(0));
        EXPECT_EQ(lobe_GGX_aniso(NORMAL, ALONG, V, L, albedo, 0.5, 0.2), Vec3(0));
        EXPECT_EQ(lobe_GGX_conductor(NORMAL, V, L, GOLD_ETA, GOLD_K, 0.5), Vec3(0));
        for (const auto lobe : {&lobe_Beckmann, &lobe_CookTorrance, &lobe_Phong, &lobe_Phong_1975, &lobe_BlinnPhong,
                                &lobe_OrenNayar, &lobe_OrenNayar_EON, &lobe_OrenNayar_EON_fast, &lobe_GGX_multiple})
            EXPECT_EQ(lobe(NORMAL, V, L, albedo, 0.5), Vec3(0));
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

TEST(Fresnel, FastMetalIsThePublishedFraction) {
    for (double c : {0.0, 0.1, 0.7, 1.0})
        for (int i = 0; i < 3; ++i) {
            const double eta = GOLD_ETA[i], k = GOLD_K[i], w = std::pow(1 - c, 5);
            EXPECT_NEAR(lobe_F_conductor_fast(c, GOLD_ETA, GOLD_K)[i],
                        ((eta - 1) * (eta - 1) + 4 * eta * w + k * k) / ((eta + 1) * (eta + 1) + k * k), ROUNDING);
        }
}

// Lagarde's exponent is fitted to (1 - c)^5, which the weight leaves by 0.00377 at most, at c = 0.055.
TEST(Fresnel, FastSchlickFollowsSchlick) {
    for (double c = 0; c <= 1; c += 1.0 / 64)
        EXPECT_NEAR(lobe_F_Schlick_fast(c, Vec3(0)).x, lobe_F_Schlick(c, 0.0), 0.00377);
    EXPECT_EQ(lobe_F_Schlick_fast(0, Vec3(0.04)).x, 1);
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

// Seen or lit along the normal, nothing is hidden; edge-on, what is left does not depend on the smaller cosine.
TEST(Masking, NeumannHidesTheSmallerCosine) {
    EXPECT_EQ(lobe_V_Neumann(0.3, 1), 0.25);
    EXPECT_EQ(lobe_V_Neumann(0, 0.5), 0.5);
    EXPECT_TRUE(std::isfinite(lobe_V_Neumann(0, 0)));
    for_pairs([](const Vec3& V, const Vec3& L) {
        EXPECT_LE(4 * V.z * L.z * lobe_V_Neumann(V.z, L.z), 1);
        EXPECT_EQ(lobe_V_Neumann(V.z, L.z), lobe_V_Neumann(L.z, V.z));
    });
}

// ln s <= s - 1, and Bernoulli's inequality: neither stand-in is below the power, and both touch it at s = 1.
TEST(Powers, StandInsLieAboveThePower) {
    for (double h : {1.0, 10.0, 1000.0})
        for (double s = 0; s <= 1; s += 1.0 / 64) {
            EXPECT_GE(lobe_pow_Gaussian(s, h), std::pow(s, h));
            EXPECT_GE(lobe_pow_Schlick(s, h), std::pow(s, h) * (1 - ROUNDING));
        }
    for (const auto power : {&lobe_pow_Gaussian, &lobe_pow_Schlick}) {
        EXPECT_EQ(power(1, 50), 1);
        EXPECT_NEAR((1 - power(1 - 1e-9, 50)) / 50e-9, 1, 1e-6);  // the slope there is the power's own
    }
    EXPECT_NEAR(lobe_pow_Schlick(0.3, 1), 0.3, ROUNDING);
    EXPECT_EQ(lobe_pow_Schlick(0, 0), 0);
}

TEST(Fresnel, FluxOfEachPolarisationIsOne) {
    for (double eta : {0.4, 0.75, 1.0, 1.0003, 1.5, 4.0})
        for (double cosI : {0.0, 1e-6, 0.3, 0.9, 1.0}) {
            const Vec2 sum = lobe_F_dielectric_sp(cosI, eta) + lobe_T_dielectric_sp(cosI, eta);
            EXPECT_NEAR(sum.x, 1, ROUNDING);
            EXPECT_NEAR(sum.y, 1, ROUNDING);
        }
}

TEST(Fresnel, MetalWithoutAbsorptionIsADielectric) {
    for (double eta : {0.4, 1.0, 1.0003, 1.5, 4.0})
        for (double cosI : {0.0, 1e-6, 0.3, 0.9, 1.0})
            EXPECT_NEAR(lobe_F_conductor(cosI, eta, 0), lobe_F_dielectric(cosI, eta),
                        1e-11 * lobe_F_dielectric(cosI, eta));
}

// Abeles 1950: at 45 degrees R_p = R_s^2, whatever the index.
TEST(Fresnel, PolarisationsAt45Degrees) {
    for (double eta : {0.05, 0.5, 1.0, 3.0})
        for (double k : {0.01, 1.0, 8.0}) {
            const Vec2 sp = lobe_F_conductor_sp(std::sqrt(0.5), eta, k);
            EXPECT_NEAR(sp.y / (sp.x * sp.x), 1, ROUNDING);
        }
}

TEST(Fresnel, MetalAtNormalAndGrazingIncidence) {
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(lobe_F_conductor(1, GOLD_ETA, GOLD_K)[i], lobe_f0(GOLD_ETA, GOLD_K)[i], ROUNDING);
        EXPECT_NEAR(lobe_F_conductor(0, GOLD_ETA, GOLD_K)[i], 1, ROUNDING);
    }
    EXPECT_NEAR(lobe_f0(1.5, 0), lobe_f0(1.5), ROUNDING);
    EXPECT_NEAR(lobe_F_conductor(1, 1.0, 1e-4) / 2.5e-9, 1, 1e-8);  // k^2/4: an index match does not cancel
}

TEST(Fresnel, F82PassesThroughItsThreeColours) {
    const Vec3 f0(0.9, 0.04, 0), f82(0.5, 0.3, 0);
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(lobe_F_F82(1, f0, f82)[i], f0[i], ROUNDING);
        EXPECT_NEAR(lobe_F_F82(1.0 / 7, f0, f82)[i], f82[i], ROUNDING);
        EXPECT_NEAR(lobe_F_F82(0, f0, f82)[i], 1, ROUNDING);
        EXPECT_NEAR(lobe_F_F82_tint(0.2, f0, Vec3(1))[i], lobe_F_Schlick(0.2, f0)[i], ROUNDING);
        EXPECT_NEAR(lobe_F_F82_tint(1.0 / 7, f0, Vec3(0.5))[i], lobe_F_Schlick(1.0 / 7, f0)[i] / 2, ROUNDING);
    }
    EXPECT_EQ(lobe_F_F82(0.3, f0, f82).z, 0);  // the formula alone is negative
}

// With the colour of the dielectric itself, the shift of the colour is the Fresnel term.
TEST(Fresnel, HallIsFresnelForTheColourOfItsIndex) {
    for (double eta : {0.7, 1.0003, 1.5, 3.0})
        for (double cosI : {0.0, 1e-6, 0.3, 0.9, 1 - 1e-7, 1.0})
            EXPECT_NEAR(lobe_F_Hall(cosI, Vec3(lobe_f0(eta)), eta).x / lobe_F_dielectric(cosI, eta), 1, 1e-11);
    EXPECT_EQ(lobe_F_Hall(0.3, GOLD_ETA, 1), GOLD_ETA);
}

TEST(Fresnel, MirrorAndRefractionComeBack) {
    for_pairs([](const Vec3& N, const Vec3& V) {
        const Vec3 R = lobe_reflect(N, V);
        EXPECT_NEAR(N.dot(R), N.dot(V), ROUNDING);
        EXPECT_NEAR((lobe_reflect(N, R) - V).length(), 0, ROUNDING);
        if (N.dot(V) < 0.01) return;
        EXPECT_NEAR((lobe_refract(N, V, 1) + V).length(), 0, ROUNDING);
        const Vec3 L = lobe_refract(N, V, 1.5);
        EXPECT_NEAR(L.length(), 1, ROUNDING);
        EXPECT_NEAR(-N.dot(L), lobe_cosT(N.dot(V), 1.5), ROUNDING);
        EXPECT_NEAR((lobe_refract(-N, L, 1 / 1.5) - V).length(), 0, 1e-11);
    });
    EXPECT_EQ(lobe_refract(NORMAL, direction(1.2, 0), 1 / 1.5), Vec3(0));
}

TEST(Beckmann, ProjectedAreaOfFacetsIsOne) {
    for (double alpha : {1e-4, 0.01, 0.3, 1.0, 4.0}) {
        const auto from_cosine = [&](const Vec3& H) { return lobe_D_Beckmann(H.z, alpha) * H.z; };
        const auto from_vectors = [&](const Vec3& H) { return lobe_D_Beckmann(NORMAL, H * 3, alpha) * H.z; };
        EXPECT_NEAR(over_hemisphere(alpha, 1000, from_cosine), 1, QUADRATURE) << "alpha " << alpha;
        EXPECT_NEAR(over_hemisphere(alpha, 1000, from_vectors), 1, QUADRATURE) << "alpha " << alpha;
    }
}

TEST(Anisotropic, ProjectedAreaOfFacetsIsOne) {
    for (double alpha : {0.05, 0.5}) {
        const auto area = [&](auto D) {
            return over_hemisphere(alpha, 1000, [&](const Vec3& H) {
                return D(H.z, H.x, H.y, alpha, 2 * alpha) * H.z; });
        };
        EXPECT_NEAR(area(lobe_D_GGX_aniso), 1, QUADRATURE);
        EXPECT_NEAR(area(lobe_D_Beckmann_aniso), 1, QUADRATURE);
    }
}

TEST(Anisotropic, EqualWidthsAreIsotropic) {
    for_pairs([](const Vec3& V, const Vec3& L) {
        EXPECT_NEAR(lobe_D_GGX_aniso(V.z, V.x, V.y, 0.3, 0.3) / lobe_D_GGX(V.z, 0.3), 1, 1e-10);
        EXPECT_NEAR(lobe_D_Beckmann_aniso(V.z, V.x, V.y, 0.8, 0.8), lobe_D_Beckmann(V.z, 0.8), 1e-10);
        EXPECT_NEAR(lobe_V_GGX_aniso(V.z, L.z, V.x, V.y, L.x, L.y, 0.3, 0.3) / lobe_V_GGX(V.z, L.z, 0.3), 1, 1e-10);
        EXPECT_NEAR(lobe_GGX_aniso(NORMAL, ALONG, V, L, Vec3(0.5), 0.3, 0.3).x /
                        lobe_GGX(NORMAL, V, L, Vec3(0.5), 0.3).x,
                    1, 1e-10);
    });
}

// The wide axis is T's: in its plane the highlight of a narrow lobe reaches further.
TEST(Anisotropic, TIsTheAxisOfAlphaX) {
    const auto off = [](double phi) {
        return lobe_GGX_aniso(NORMAL, ALONG, direction(0.3, phi), direction(0.3, phi), Vec3(1), 0.4, 0.1).x;
    };
    EXPECT_GT(off(0), 10 * off(PI / 2));
}

TEST(Beckmann, WeakWhiteFurnace) {
    for (double alpha : {0.1, 0.5, 1.0, 2.0})
        for (double theta : {0.1, 0.8, 1.3, 1.5}) {
            const Vec3 V = direction(theta, 0);
            const double seen = over_hemisphere(alpha, 1000, [&](const Vec3& H) {
                return lobe_D_Beckmann(NORMAL, H, alpha) * std::max(0.0, V.dot(H));
            });
            EXPECT_NEAR(lobe_G1_Beckmann(V.z, alpha) * seen / V.z, 1, 10 * QUADRATURE) << alpha << " " << theta;
        }
}

TEST(Beckmann, MaskingHasItsLimits) {
    EXPECT_EQ(lobe_G1_Beckmann(0.5, 0), 1);
    EXPECT_EQ(lobe_G1_Beckmann(1, 0.5), 1);
    EXPECT_EQ(lobe_G1_Beckmann(0, 0), 0);
    EXPECT_NEAR(lobe_V_Beckmann(0, 0.5, 0.3) / lobe_V_Beckmann(1e-12, 0.5, 0.3), 1, 1e-10);
    EXPECT_TRUE(std::isfinite(lobe_V_Beckmann(0, 0, 0)));
    for (double alpha = 0.05; alpha <= 4; alpha *= 1.1)
        for (double c = 0; c <= 1; c += 1.0 / 64)  // stability.md's figure for the fit is 0.313 %
            EXPECT_NEAR(lobe_G1_Beckmann_fast(c, alpha), lobe_G1_Beckmann(c, alpha), 3.2e-3);
}

TEST(Masking, CorrelationLeavesMoreLightThanIndependence) {
    for_pairs([](const Vec3& V, const Vec3& L) {
        EXPECT_LE(lobe_G2_GGX_separable(V.z, L.z, 0.3), lobe_G2_GGX(V.z, L.z, 0.3) * (1 + ROUNDING));
        EXPECT_NEAR(4 * V.z * L.z * lobe_V_GGX_separable(V.z, L.z, 0.3) / lobe_G2_GGX_separable(V.z, L.z, 0.3), 1,
                    ROUNDING);
        for (double alpha : {0.0, 1.0})  // where Hammon's line begins and ends
            EXPECT_NEAR(lobe_V_GGX_fast(V.z, L.z, alpha) / lobe_V_GGX(V.z, L.z, alpha), 1, ROUNDING);
        EXPECT_LE(lobe_G2_Beckmann(V.z, L.z, 0.3), lobe_G1_Beckmann(V.z, 0.3));
    });
}

TEST(GGX, CutForHalfPrecisionIsTheLargestHalf) {
    EXPECT_EQ(lobe_D_GGX_half(NORMAL, NORMAL * 2, 1e-4), 65504);
    EXPECT_EQ(lobe_D_GGX_half(NORMAL, direction(0.1, 0), 0.1), lobe_D_GGX(NORMAL, direction(0.1, 0), 0.1));
}

// Where Hammon's line begins and ends it is Smith's own masking.
TEST(GGX, FastLobeIsTheLobeAtBothEndsOfAlpha) {
    for_pairs([](const Vec3& V, const Vec3& L) {
        const Vec3 fast = lobe_GGX_fast(NORMAL, V, L, Vec3(0.04), 1), exact = lobe_GGX(NORMAL, V, L, Vec3(0.04), 1);
        EXPECT_NEAR(fast.x / exact.x, 1, ROUNDING);
        EXPECT_EQ(lobe_GGX_fast(NORMAL, -V, L, Vec3(1), 0.3), Vec3(0));
    });
}

TEST(Lobes, WhiteMicrofacetsNeverGain) {
    for (double theta : {0.0, 0.8, 1.5}) {
        for (const auto lobe : {&lobe_Beckmann, &lobe_CookTorrance}) {
            const double white = albedo(theta, 400, [&](const Vec3& V, const Vec3& L) {
                return lobe(NORMAL, V, L, Vec3(1), 0.4);
            });
            EXPECT_LE(white, 1);
            EXPECT_GE(white, 0.5);
        }
        EXPECT_LE(albedo(theta, 400, [](const Vec3& V, const Vec3& L) {
            return lobe_GGX_aniso(NORMAL, ALONG, V, L, Vec3(1), 0.3, 0.6); }), 1);
    }
}

// A narrow lobe of a metal reflects what a mirror of it does.
TEST(GGX, ConductorReflectsItsFresnelTerm) {
    const Vec3 H = NORMAL;
    for (double theta : {0.2, 1.0}) {
        const Vec3 V = direction(theta, 0), L = direction(-theta, 0);
        const double shape = lobe_D_GGX(NORMAL, H, 0.3) * lobe_V_GGX(V.z, L.z, 0.3);
        EXPECT_NEAR(lobe_GGX_conductor(NORMAL, V, L, GOLD_ETA, GOLD_K, 0.3).y / shape,
                    lobe_F_conductor(V.z, GOLD_ETA.y, GOLD_K.y), ROUNDING);
    }
}

// Every facet that V sees sends V somewhere: the density over the whole sphere of L is 1.
TEST(GGXSampling, DensityIsOneOverTheSphere) {
    for (double alpha : {0.3, 1.0})
        for (double theta : {0.0, 0.8, 1.4}) {
            const Vec3 V = direction(theta, 0);
            const auto density = [&](const Vec3& L) {
                return lobe_pdf_GGX(NORMAL, V, L, alpha) + lobe_pdf_GGX(NORMAL, V, -L, alpha);
            };
            EXPECT_NEAR(over_hemisphere(1, 600, density), 1, 1e-3) << alpha << " " << theta;  // ends with a jump
        }
    EXPECT_EQ(lobe_pdf_GGX(NORMAL, -NORMAL, NORMAL, 0.3), 0);
}

// Means over the drawn directions L are means under the density; of L, that tells the lobe's place, and of its tensor.
TEST(GGXSampling, DrawsFollowTheDensity) {
    const double alpha = 0.5;
    const int steps = 200;
    for (double theta : {0.0, 0.8, 1.4}) {
        const Vec3 V = direction(theta, 2);
        for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0.6, 0, 0.8)})
            for (int power : {1, 2}) {
                double drawn = 0;
                for (int i = 0; i < steps; ++i)
                    for (int j = 0; j < steps; ++j) {
                        const Vec3 H = lobe_sample_GGX(NORMAL, ALONG, V, alpha,
                                                       {(i + 0.5) / steps, (j + 0.5) / steps});
                        drawn += std::pow(lobe_reflect(H, V).dot(axis), power) / (steps * steps);
                    }
                const double mean = over_hemisphere(1, 400, [&](const Vec3& L) {
                    const double moment = std::pow(L.dot(axis), power);
                    return lobe_pdf_GGX(NORMAL, V, L, alpha) * moment +
                           lobe_pdf_GGX(NORMAL, V, -L, alpha) * moment * (power == 1 ? -1 : 1);
                });
                EXPECT_NEAR(drawn, mean, 1e-3) << theta << " " << axis << " " << power;
            }
    }
}

TEST(GGXSampling, HalfVectorsAreUnitAndAboveTheSurface) {
    for_pairs([](const Vec3& V, const Vec3& u) {
        for (double alpha : {0.0, 0.01, 1.0})
            for (const Vec3& view : {V, Vec3(-V), -NORMAL}) {
                const Vec3 H = lobe_sample_GGX(NORMAL, ALONG, view, alpha, {std::abs(u.x), std::abs(u.y)});
                EXPECT_NEAR(H.length(), 1, ROUNDING);
                EXPECT_GE(H.z, 0);
            }
    });
}

TEST(OrenNayar, FullModelIsLambertWithoutRoughnessAndNeverNegative) {
    for_pairs([](const Vec3& V, const Vec3& L) {
        const double lambert = lobe_Lambert(NORMAL, V, L, Vec3(0.7)).x;
        EXPECT_NEAR(lobe_OrenNayar(NORMAL, V, L, Vec3(0.7), 0).x / lambert, 1, ROUNDING);
        EXPECT_NEAR(lobe_OrenNayar_EON(NORMAL, V, L, Vec3(0.7), 0).x / lambert, 1, ROUNDING);
        EXPECT_GE(lobe_OrenNayar(NORMAL, V, L, Vec3(0.01), 1.5).x, 0);
    });
}

// The published model gains: 4.7 % at 89.5 degrees for sigma = 0.3.
TEST(OrenNayar, FullModelGainsUpTo4point7Percent) {
    for (const auto& [sigma, published] :
         {std::pair(0.1, 1.014), {0.2, 1.038}, {0.3, 1.047}, {0.5, 1.021}, {1.0, 0.930}})
        EXPECT_NEAR(albedo(89.5 * PI / 180, 400, [&](const Vec3& V, const Vec3& L) {
            return lobe_OrenNayar(NORMAL, V, L, Vec3(1), sigma); }), published, 1e-3);
}

TEST(OrenNayar, EONKeepsAllOfTheLight) {
    for (double roughness : {0.1, 1.0})
        for (double theta : {0.0, 0.8, 1.55}) {
            const auto measured = [&](double white) {
                return albedo(theta, 600, [&](const Vec3& V, const Vec3& L) {
                    return lobe_OrenNayar_EON(NORMAL, V, L, Vec3(white), roughness); });
            };
            EXPECT_NEAR(measured(1), 1, QUADRATURE);
            EXPECT_NEAR(measured(0.5), lobe_albedo_EON(std::cos(theta), Vec3(0.5), roughness).x, QUADRATURE);
        }
    for (double NdotV = 0; NdotV <= 1; NdotV += 1.0 / 64) {
        EXPECT_NEAR(lobe_albedo_EON(NdotV, Vec3(1), 0.7).x, 1, ROUNDING);
    }
}

TEST(BlinnPhong, ProjectedAreaOfFacetsIsOne) {
    for (double exponent : {0.0, 1.0, 30.0, 2e8}) {
        const double width = lobe_alpha_Phong(exponent);
        const auto from_cosine = [&](const Vec3& H) { return lobe_D_BlinnPhong(H.z, exponent) * H.z; };
        const auto from_vectors = [&](const Vec3& H) { return lobe_D_BlinnPhong(NORMAL, H * 3, exponent) * H.z; };
        if (exponent < 1e6) EXPECT_NEAR(over_hemisphere(width, 1000, from_cosine), 1, QUADRATURE) << exponent;
        EXPECT_NEAR(over_hemisphere(width, 1000, from_vectors), 1, QUADRATURE) << exponent;
    }
}

TEST(BlinnPhong, AllIsReflectedAtNormalIncidenceAndNoMoreElsewhere) {
    for (double exponent : {0.0, 0.5, 10.0, 100.0})
        for (const auto lobe : {&lobe_Phong, &lobe_BlinnPhong})
            for (double theta : {0.0, 0.4, 0.8, 1.2, 1.5}) {
                const auto f = [&](const Vec3& V, const Vec3& L) { return lobe(NORMAL, V, L, Vec3(1), exponent); };
                if (theta == 0)
                    EXPECT_NEAR(albedo(theta, 1000, f), 1, QUADRATURE) << exponent;
                else
                    EXPECT_LE(albedo(theta, 300, f), 1.01) << exponent << " " << theta;
            }
}

TEST(BlinnPhong, PhongOf1975HasNoCosine) {
    const Vec3 L = direction(1.2, 0);
    EXPECT_NEAR(lobe_Phong_1975(NORMAL, lobe_reflect(NORMAL, L), L, Vec3(0.3), 20).x * L.z, 0.3, ROUNDING);
}

TEST(BlinnPhong, ExponentsAreConvertedBack) {
    for (double alpha : {1e-3, 0.1, 0.5, 1.0}) {
        EXPECT_NEAR(lobe_alpha_Phong(lobe_exponent(alpha)) / alpha, 1, ROUNDING);
        const double H = 1e-3 * alpha;  // a tilt; near the pole the two distributions have the same shape
        EXPECT_NEAR(lobe_D_BlinnPhong(NORMAL, direction(H, 0), lobe_exponent(alpha)),
                    lobe_D_Beckmann(NORMAL, direction(H, 0), alpha), 1e-5 * lobe_D_Beckmann(1, alpha));
    }
    EXPECT_EQ(lobe_exponent(4), 0);
    EXPECT_TRUE(std::isfinite(lobe_exponent(0)));
    // Blinn's highlight with four times the exponent is Phong's, near the mirror direction.
    const Vec3 V = direction(0.7, 0), L = direction(-0.72, 0);
    const double exponent = lobe_exponent_Blinn(50);
    EXPECT_NEAR(lobe_Phong_1975(NORMAL, V, L, Vec3(1), 50).x * L.z,
                lobe_D_BlinnPhong(NORMAL, V + L, exponent) / lobe_D_BlinnPhong(1, exponent), 1e-4);
}

TEST(Energy, AlbedoIsTheIntegralOfTheLobe) {
    EXPECT_NEAR(lobe_albedo_GGX(1, 1), 1 - std::numbers::ln2, 1e-10);  // the integral in closed form
    for (double alpha : {0.3, 1.0})
        for (double theta : {0.0, 0.8, 1.4}) {
            const auto measured = [&](double f0) {
                return albedo(theta, 1000, [&](const Vec3& V, const Vec3& L) {
                    return lobe_GGX(NORMAL, V, L, Vec3(f0), alpha); });
            };
            const double v = std::cos(theta);
            const Vec2 scale_bias = lobe_DFG_GGX(v, alpha);
            EXPECT_NEAR(lobe_albedo_GGX(v, alpha), measured(1), QUADRATURE);
            EXPECT_NEAR(0.3 * scale_bias.x + scale_bias.y, measured(0.3), QUADRATURE);
        }
}

TEST(Energy, MeanAlbedoIsTheMeanOfTheAlbedo) {
    for (double alpha : {0.0, 0.01, 0.3, 1.0}) {
        double mean = 0;
        for (int i = 0; i < 400; ++i) {
            const double s = (i + 0.5) / 400, v = s * s;
            mean += 2 * v * (1 - lobe_albedo_GGX(v, alpha)) * 2 * s / 400;
        }
        EXPECT_NEAR((1 - lobe_albedo_avg_GGX(alpha)), mean, QUADRATURE);
    }
}

TEST(Energy, LobeAndItsMultipleScatteringKeepAllOfTheLight) {
    for (double theta : {0.0, 0.8, 1.4}) {
        const double multiple = albedo(theta, 30, [](const Vec3& V, const Vec3& L) {
            return lobe_GGX_multiple(NORMAL, V, L, Vec3(1), 0.7); });
        EXPECT_NEAR(multiple + lobe_albedo_GGX(std::cos(theta), 0.7), 1, 1e-3);
    }
    for (double NdotV : {0.0, 0.1, 1.0}) {
        EXPECT_NEAR(lobe_energy_Turquin(NdotV, Vec3(1.022), 0.7).x * lobe_albedo_GGX(NdotV, 0.7), 1, ROUNDING);
        EXPECT_EQ(lobe_energy_Turquin(NdotV, Vec3(0), 0.7).x, 1);
    }
    EXPECT_LT(lobe_GGX_multiple(NORMAL, NORMAL, NORMAL, Vec3(1), 0).x, 1e-8);
}

TEST(Energy, FilteredWidthOnlyGrows) {
    EXPECT_EQ(lobe_alpha_filtered(0.3, Vec3(0), Vec3(0)), 0.3);
    EXPECT_GT(lobe_alpha_filtered(0.3, Vec3(0.1, 0, 0), Vec3(0)), 0.3);
    EXPECT_NEAR(std::pow(lobe_alpha_filtered(0.3, Vec3(100, 0, 0), Vec3(0)), 2), 0.09 + 0.18, ROUNDING);
    EXPECT_EQ(lobe_alpha_filtered(4, Vec3(0), Vec3(1)), 1);
}

}  // namespace
}  // namespace lobe
