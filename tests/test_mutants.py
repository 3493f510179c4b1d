"""The comparison must see an error: each mutant is a fault found in the wild, and parity fails on it.

A mutant puts a definition in the place of the library's one, so that a change of form in the library does not disarm it.
The lecture's errata are among them; tests/test_errata.py holds them against the papers, too.
"""

from dataclasses import dataclass

import pytest

from lobe.lab import catalogue, compare, gl, scenes

LIBRARY = catalogue.load()
POINTS = 1 << 12
SIZE = 64


@dataclass(frozen=True)
class Mutant:
    key: str  # the function replaced
    body: str  # what it becomes
    scene: str = "sphere-four"


LOBE = "if (min(dot(N, V), dot(N, L)) <= 0.0) return vec3(0.0); vec3 H = normalize(V + L); "
SIGMA = "float s2 = sigma * sigma; float A = 1.0 - 0.5 * s2 / (s2 + 0.33); float B = 0.45 * s2 / (s2 + 0.09); " \
        "float c = dot(N, V), d = dot(N, L), s = max(dot(L, V) - c * d, 0.0) / max(c, d); "
G = "float g = sqrt(alpha * alpha + (1.0 - alpha * alpha) * {0} * {0}); "
V_OF_GGX = "float gv = sqrt(alpha * alpha + (1.0 - alpha * alpha) * NdotV * NdotV), " \
           "gl = sqrt(alpha * alpha + (1.0 - alpha * alpha) * NdotL * NdotL); "
COSINES = "float NdotV = dot(N, V), NdotL = dot(N, L); "
DF_OF_GGX = "return lobe_F_Schlick(lobe_LdotH(V, L), f0) * lobe_D_GGX(N, V + L, alpha) "
GGX = "lobe_GGX(vec3,vec3,vec3,vec3,float)"
ON = "lobe_OrenNayar_qualitative(vec3,vec3,vec3,vec3,float)"

MUTANTS = {
    "lambert_drops_1_over_pi": Mutant("lobe_Lambert(vec3,vec3,vec3,vec3)", LOBE + "return albedo;"),
    "lambert_shines_below_the_horizon": Mutant("lobe_Lambert(vec3,vec3,vec3,vec3)", "return albedo * 0.318309886;"),
    "ggx_squares_alpha_twice": Mutant(
        GGX, LOBE + "float a = alpha * alpha; return lobe_F_Schlick(lobe_LdotH(V, L), f0) "
        "* (lobe_D_GGX(N, V + L, a) * lobe_V_GGX(dot(N, V), dot(N, L), a));"),
    "ggx_V_swaps_NdotL_and_NdotV": Mutant(
        "lobe_V_GGX(float,float,float)", V_OF_GGX + "return 0.5 / (NdotV * gv + NdotL * gl);"),
    "fresnel_has_the_lecture_s_sign": Mutant(
        "lobe_F_dielectric(float,float)",
        "float c = cosI, g2 = eta * eta - 1.0 + c * c; if (g2 <= 0.0) return 1.0; float g = sqrt(g2); "
        "float p = (g - c) / (g + c), q = (c * (g + c) - 1.0) / (c * (g - c) - 1.0); return 0.5 * p * p * (1.0 + q * q);"),
    "oren_nayar_has_the_lecture_s_bracket": Mutant(
        ON, LOBE + SIGMA + "return albedo * 0.318309886 * (A + B) * s;"),
    "oren_nayar_has_the_wrong_sign": Mutant(
        ON, LOBE + SIGMA + "return albedo * 0.318309886 * (A + B * max(c * d - dot(L, V), 0.0) / max(c, d));"),
    "oren_nayar_takes_sigma_for_a_mean": Mutant(
        ON, LOBE + SIGMA.replace("sigma * sigma", "sigma * sigma * 0.6366197724") + "return albedo * 0.318309886 * (A + B * s);"),
    "ggx_takes_G1_for_G2": Mutant(
        "lobe_G2_GGX(float,float,float)", G.format("NdotV") + "return 2.0 * NdotV / (NdotV + g);"),
    "ggx_V_takes_G1_for_G2": Mutant(
        GGX, LOBE + COSINES + G.format("NdotV") + DF_OF_GGX + "* 0.5 / ((NdotV + g) * NdotL);"),
    "ggx_V_is_clamped_to_1": Mutant(
        GGX, LOBE + COSINES + V_OF_GGX + DF_OF_GGX + "* min(0.5 / (NdotL * gv + NdotV * gl), 1.0);"),
    "ggx_takes_NdotH_for_LdotH": Mutant(
        GGX, LOBE + "return lobe_F_Schlick(dot(N, H), f0) "
        "* (lobe_D_GGX(N, V + L, alpha) * lobe_V_GGX(dot(N, V), dot(N, L), alpha));"),
    "ggx_D_cancels_near_the_highlight": Mutant(
        "lobe_D_GGX(vec3,vec3,float)", "float c = dot(N, normalize(H)), d = c * c * (alpha * alpha - 1.0) + 1.0; "
        "return alpha * alpha / (3.14159265 * d * d);"),
    "schlick_has_the_fourth_power": Mutant(
        "lobe_F_Schlick(float,vec3)", "float u = 1.0 - cosI; return f0 + (1.0 - f0) * u * u * u * u;"),
    "transmittance_is_one_minus_F": Mutant(
        "lobe_T_dielectric(float,float)",
        "float c = cosI, g2 = (eta - 1.0) * (eta + 1.0) + c * c; if (g2 <= 0.0) return 0.0; float g = sqrt(g2); "
        "float s = (g - c) / (g + c), p = (eta * eta * c - g) / (eta * eta * c + g); return 1.0 - 0.5 * (s * s + p * p);"),
    "gold_is_not_clamped_in_the_lobe": Mutant(
        GGX, LOBE + "return lobe_F_Schlick(lobe_LdotH(V, L), f0) "
        "* (lobe_D_GGX(N, V + L, alpha) * lobe_V_GGX(dot(N, V), dot(N, L), alpha));", scene="gold-teapot-four"),
    "kelemen_forgets_the_square": Mutant("lobe_V_Kelemen(float)", "return 0.25 / LdotH;"),
    "vgroove_takes_NdotV_for_VdotH": Mutant(
        "lobe_G_Vgroove(float,float,float,float)", "return min(1.0, 2.0 * NdotH * min(NdotV, NdotL) / NdotV);"),
    "beckmann_lacks_cos_to_the_fourth": Mutant(
        "lobe_D_Beckmann(float,float)", "float t2 = (1.0 - NdotH * NdotH) / (NdotH * NdotH * alpha * alpha); "
        "return exp(-t2) / (3.14159265 * alpha * alpha);"),
    "blinn_exponent_has_the_lecture_s_half": Mutant("lobe_exponent_Blinn(float)", "return 0.5 * exponent;"),
    "conductor_forgets_k": Mutant("lobe_F_conductor(float,float,float)", "return lobe_F_dielectric(cosI, eta);"),
    "conductor_takes_its_index_from_f0": Mutant(
        "lobe_F_conductor(float,float,float)", "return lobe_F_dielectric(cosI, lobe_eta(lobe_f0(eta, k)));"),
    "ggx_D_in_tangents_breaks_at_grazing": Mutant(
        "lobe_D_GGX(float,float)", "float t = tan(acos(NdotH)), c2 = NdotH * NdotH, q = alpha * alpha + t * t; "
        "return alpha * alpha / (3.14159265 * c2 * c2 * q * q);"),
    "schlick_takes_NdotL_for_LdotH": Mutant(
        GGX, LOBE + "return lobe_F_Schlick(dot(N, L), f0) "
        "* (lobe_D_GGX(N, V + L, alpha) * lobe_V_GGX(dot(N, V), dot(N, L), alpha));"),
    "ggx_takes_kelemen_for_smith": Mutant(
        GGX, LOBE + "return lobe_F_Schlick(lobe_LdotH(V, L), f0) * (lobe_D_GGX(N, V + L, alpha) * lobe_V_Kelemen(V, L));"),
    "full_oren_nayar_loses_its_interreflection": Mutant(
        "lobe_OrenNayar(vec3,vec3,vec3,vec3,float)", "return lobe_OrenNayar_qualitative(N, V, L, albedo, sigma);"),
    "EON_takes_roughness_for_sigma": Mutant(
        "lobe_OrenNayar_EON(vec3,vec3,vec3,vec3,float)", "return lobe_OrenNayar_qualitative(N, V, L, albedo, roughness);"),
    "gaussian_has_the_lecture_s_missing_factor": Mutant(
        "lobe_D_Gaussian_normalized(vec3,vec3,float)", "return lobe_D_Gaussian(N, H, alpha);"),
    "ashikhmin_shirley_lacks_2_pi": Mutant(
        "lobe_D_AshikhminShirley(float,float,float,float,float)", "float e = (nu * TdotH * TdotH + nv * BdotH * BdotH) "
        "/ (1.0 - NdotH * NdotH); return sqrt((nu + 1.0) * (nv + 1.0)) * pow(NdotH, e);"),
    "schlick_s_power_keeps_phong_s_factor": Mutant(
        "lobe_D_SchlickPower(float,float)", "return (h + 2.0) / 6.2831853 * lobe_pow_Schlick(NdotH, h);"),
    "lafortune_has_the_lecture_s_singular_values": Mutant(
        "lobe_Lafortune_C_Phong(float)", "return pow((exponent + 2.0) / 6.2831853, 1.0 / exponent) * vec3(1.0);"),
    "lafortune_has_the_lecture_s_root": Mutant(
        "lobe_Lafortune_C_Phong(float)", "return sqrt((exponent + 2.0) / 6.2831853) * vec3(-1.0, -1.0, 1.0);"),
    "lafortune_multiplies_by_its_exponent": Mutant(
        "lobe_Lafortune_lobe(vec3,vec3,vec3,float)", "return max(dot(C * lLocal, vLocal), 0.0) * exponent;"),
    "exponential_subtracts_from_one": Mutant("lobe_quantile_exponential(float)", "return -log(1.0 - clamp(u, 0.0, 0.9999999));"),
    "angle_is_not_doubled": Mutant("lobe_angle_of_half(float)", "return atan(clamp(tanHalf, 0.0, 1.0));"),
    "gaussian_s_peak_is_of_the_plane": Mutant("lobe_peak_Gaussian(float)", "return 0.318309886 / (alpha * alpha);"),
    "alpha_is_not_squared": Mutant("lobe_alpha(float)", "return roughness;"),
}


def find(key):
    (function,) = LIBRARY.find(key)
    return function


def passes(function, text, scene, context):
    """Whether the comparison of a function passes, in points and on a scene."""
    shader = compare.library_shader(function, text, function.name)
    cases = [compare.points_case(function, POINTS, {}, seed=3)]
    if function.kind != "helper":
        cases.append(compare.shading_case(function, scenes.find(scene), SIZE, {}))
    return all(compare.compare(case, shader, context).row["pass"] for case in cases)


@pytest.fixture(scope="module")
def context():
    return gl.create_context("egl")


@pytest.mark.parametrize("name", MUTANTS)
def test_parity_fails_on(name, context):
    mutant = MUTANTS[name]
    replaced = find(mutant.key)
    text = LIBRARY.text.replace(replaced.definition, f"{replaced.signature} {{ {mutant.body} }}")
    assert text != LIBRARY.text
    assert not passes(replaced, text, mutant.scene, context)


@pytest.mark.parametrize("key", sorted({m.key for m in MUTANTS.values()}))
def test_parity_passes_without_a_mutant(key, context):
    assert passes(find(key), LIBRARY.text, "sphere-four", context)
