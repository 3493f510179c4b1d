"""A third voice: Mitsuba 3 has some of these models, by other hands. Formula by formula, then whole pictures.

Where it differs by intention it is said so: its masking and shadowing are independent of each other (separable).
"""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lobe import reference
from lobe.lab import plots

ROOT = Path(__file__).resolve().parent.parent
COUNT = 20_000
GOLD = {"eta": (0.027145, 0.49583, 1.4770), "k": (3.1310, 2.2504, 1.7784)}
ALPHA, GLASS, CLAY = 0.2, 1.5, (0.6, 0.45, 0.35)

pytestmark = [pytest.mark.full, pytest.mark.skipif(
    importlib.util.find_spec("mitsuba") is None, reason="no Mitsuba: pip install mitsuba, apt-get install libllvm19")]


def hemisphere(rng):
    """Directions about +z, to within 3 degrees of the horizon."""
    z, phi = rng.uniform(0.05, 1, COUNT), rng.uniform(0, 2 * np.pi, COUNT)
    return np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=1).astype(np.float32)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Inputs, and Mitsuba's values for them."""
    rng, folder = np.random.default_rng(11), tmp_path_factory.mktemp("mitsuba")
    inputs = {"V": hemisphere(rng), "L": hemisphere(rng), "H": hemisphere(rng),
              "cosine": rng.uniform(0.01, 1, COUNT), "eta": rng.uniform(0.2, 4, COUNT), "k": rng.uniform(0.1, 6, COUNT),
              "alphaX": rng.uniform(0.05, 1, COUNT), "alphaY": rng.uniform(0.05, 1, COUNT)}
    inputs = {name: values.astype(np.float32) for name, values in inputs.items()}
    np.savez(folder / "inputs.npz", **inputs)
    program = ROOT / "tests" / "mitsuba_values.py"
    subprocess.run([sys.executable, program, folder / "inputs.npz", folder / "outputs.npz"], check=True)
    return ({name: values.astype(float) for name, values in inputs.items()}, dict(np.load(folder / "outputs.npz")))


def check(got, expected, rel):
    """Mitsuba computes in float32, and not always carefully: a few places may be off by more."""
    error = np.abs(got - expected) / np.maximum(np.abs(expected), 1e-6)
    assert np.quantile(error, 0.99) < rel and error.max() < 30 * rel, (np.quantile(error, 0.99), error.max())


def test_fresnel_terms(drawn):
    x, theirs = drawn
    check(theirs["F_dielectric"], plots.evaluated("lobe_F_dielectric(float,float)", x["cosine"], x["eta"]), 1e-4)
    metal = plots.evaluated("lobe_F_conductor(float,float,float)", x["cosine"], x["eta"], x["k"])
    check(theirs["F_conductor"], metal, 1e-4)


def test_distributions(drawn):
    x, theirs = drawn
    NdotH, TdotH, BdotH = x["H"][:, 2], x["H"][:, 0], x["H"][:, 1]
    for name in ("GGX", "Beckmann"):
        ours = plots.evaluated(f"lobe_D_{name}_aniso(float,float,float,float,float)", NdotH, TdotH, BdotH, x["alphaX"],
                               x["alphaY"])
        seen = ours > 1e-6  # below it Mitsuba says 0
        check(theirs[f"D_{name}_aniso"][seen], ours[seen], 1e-4)


def test_masking(drawn):
    x, theirs = drawn
    check(theirs["G1_GGX"], plots.evaluated("lobe_G1_GGX(float,float)", x["V"][:, 2], x["alphaX"]), 1e-5)
    check(theirs["G1_Beckmann"], plots.evaluated("lobe_G1_Beckmann_fast(float,float)", x["V"][:, 2], x["alphaX"]), 1e-4)


def facets(x, fresnel, masking):
    """D G F / (4 NdotV), the cosine of the light in, of gold's width; [n, channels]."""
    V, L = x["V"], x["L"]
    H = (V + L) / np.linalg.norm(V + L, axis=1, keepdims=True)
    D = plots.evaluated("lobe_D_GGX(float,float)", H[:, 2], ALPHA)
    return (D * masking(V[:, 2], L[:, 2]) / (4 * V[:, 2]))[:, None] * fresnel(np.sum(V * H, axis=1)[:, None])


def separable(NdotV, NdotL):
    return plots.evaluated("lobe_G2_GGX_separable(float,float,float)", NdotV, NdotL, ALPHA)


def gold(cosine):
    return plots.evaluated("lobe_F_conductor(float,float,float)", cosine, GOLD["eta"], GOLD["k"])


def test_rough_metal_is_ours_with_separable_masking(drawn):
    x, theirs = drawn
    check(theirs["GGX_conductor"], facets(x, gold, separable), 1e-4)
    pdf = plots.evaluated("lobe_pdf_GGX(vec3,vec3,vec3,float)", np.array([0, 0, 1.0]), x["V"], x["L"], ALPHA)
    check(theirs["pdf_GGX"], pdf, 1e-4)


def test_rough_metal_with_the_correlation_put_in_is_lobe_GGX_conductor(drawn):
    x, theirs = drawn
    ours = plots.evaluated("lobe_GGX_conductor(vec3,vec3,vec3,vec3,vec3,float)", np.array([0, 0, 1.0]), x["V"], x["L"],
                           np.array(GOLD["eta"]), np.array(GOLD["k"]), ALPHA) * x["L"][:, 2:]
    check(theirs["GGX_correlated"], ours, 1e-4)
    with pytest.raises(AssertionError):  # the difference that this test must see
        check(theirs["GGX_conductor"], ours, 1e-4)


def test_rough_glass_reflects_as_D_V_F(drawn):
    x, theirs = drawn
    ours = facets(x, lambda cosine: plots.evaluated("lobe_F_dielectric(float,float)", cosine, GLASS), separable)
    check(theirs["GGX_dielectric"], np.repeat(ours, 3, axis=1), 1e-4)


def test_lambert(drawn):
    x, theirs = drawn
    ours = plots.evaluated("lobe_Lambert(vec3,vec3,vec3,vec3)", np.array([0, 0, 1.0]), x["V"], x["L"], np.array(CLAY))
    check(theirs["Lambert"], ours * x["L"][:, 2:], 1e-5)


@pytest.mark.skipif(not hasattr(reference, "Render"), reason="this reference renders no paths")
def test_pictures_agree_within_noise():
    program = [sys.executable, ROOT / "benchmarks" / "mitsuba_race.py", "--agree", "--size", "64", "--seconds", "4"]
    scenes = json.loads(subprocess.run(program, check=True, stdout=subprocess.PIPE).stdout)["scenes"]
    found = {name: (abs(s["agreement"]["z_of_mean"]) < 4 and s["agreement"]["z_rms_of_blocks"] < 1.3)
             for name, s in scenes.items()}
    assert found == {"box": True, "gold": True, "glass": True, "rough gold": True,
                     "rough gold, its own material": False}, scenes
