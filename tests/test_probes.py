"""Light from a probe: where its texels lie, the few directions that stand for it, and the comparison by their light."""

from dataclasses import replace

import numpy as np
import pytest

from lobe.lab import catalogue, compare, gl, matrix, probes, scenes

LIBRARY = catalogue.load()
SIZE = 48
COUNT = 1 << 12


@pytest.fixture(scope="module")
def lobby():
    return probes.load(scenes.RIGS["lobby"].probe)


def centres(height, width):
    """Directions of the texels' centres, [h, w, 3], from angles."""
    rows, columns = (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width
    theta, phi = np.meshgrid(np.pi * rows, 2 * np.pi * columns - np.pi, indexing="ij")
    return np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], axis=-1)


def test_directions_are_those_of_the_examples():
    # u = 0.5 + atan(d.x, -d.z) / (2 pi), v = acos(d.y) / pi, as examples/probe-shading.frag reads a probe.
    u, v = np.random.default_rng(3).uniform(size=(2, 1000))
    d = probes.direction(u, np.cos(np.pi * v))
    assert np.allclose(0.5 + np.arctan2(d[:, 0], -d[:, 2]) / (2 * np.pi), u, atol=1e-12)
    assert np.allclose(np.arccos(d[:, 1]) / np.pi, v, atol=1e-7)
    assert np.allclose(np.linalg.norm(d, axis=1), 1, atol=1e-14)


def test_solid_angles_fill_the_sphere():
    angles = probes.solid_angles(7, 12)
    assert angles.sum() * 12 == pytest.approx(4 * np.pi, rel=1e-14)
    assert np.all(angles[:3, 0] < angles[1:4, 0])


def test_each_light_of_a_constant_probe_holds_its_share():
    towards, irradiance = probes.lights(np.full((16, 32, 3), (2.0, 1.0, 0.5)), COUNT)
    assert np.allclose(irradiance, 4 * np.pi / COUNT * np.array([2.0, 1.0, 0.5]), rtol=1e-12)
    assert np.abs(towards.mean(0)).max() < 1e-3  # as many from each side
    assert np.allclose((towards[:, :, None] * towards[:, None]).mean(0), np.eye(3) / 3, atol=1e-3)


def test_one_bright_texel_gets_all_lights_within_its_bounds():
    radiance = np.zeros((8, 16, 3))
    radiance[2, 5] = (1.0, 2.0, 3.0)
    towards, irradiance = probes.lights(radiance, 64)
    u, v = 0.5 + np.arctan2(towards[:, 0], -towards[:, 2]) / (2 * np.pi), np.arccos(towards[:, 1]) / np.pi
    assert np.all((5 / 16 <= u) & (u <= 6 / 16) & (2 / 8 <= v) & (v <= 3 / 8))
    area = 2 * np.pi / 16 * (np.cos(np.pi * 2 / 8) - np.cos(np.pi * 3 / 8))
    assert np.allclose(irradiance.sum(0), area * np.array([1.0, 2.0, 3.0]), rtol=1e-12)


@pytest.mark.parametrize("count, allowed", [(scenes.DIRECTIONS, 0.15), (COUNT, 0.01)])
def test_few_directions_estimate_the_irradiance(lobby, count, allowed):
    towards, irradiance = probes.lights(lobby, count)
    d = centres(*lobby.shape[:2])
    solid = np.sin(np.arccos(d[..., 1])) * (np.pi / lobby.shape[0]) * (2 * np.pi / lobby.shape[1])
    for N in np.concatenate([np.eye(3), -np.eye(3), np.full((1, 3), 3**-0.5)]):
        exact = (lobby * (solid * np.maximum(d @ N, 0))[..., None]).sum((0, 1))
        assert (irradiance * np.maximum(towards @ N, 0)[:, None]).sum(0) == pytest.approx(exact, rel=allowed)


def case(name="lobe_GGX", scene="teapot-lobby"):
    (function,) = LIBRARY.find(name)
    return compare.shading_case(function, scenes.find(scene), SIZE, {})


def test_both_sides_see_the_same_lights():
    drawn = case()
    assert drawn.weights.shape[0] == scenes.DIRECTIONS == drawn.inputs["L"].shape[0]
    assert (drawn.weights.max(-1) == 0).any(0).all()  # each pixel misses lights behind its horizon, or shadowed
    assert (drawn.weights.max(-1) > 0).sum(0).min() < (drawn.weights.max(-1) > 0).sum(0).max()


FAULTS = {
    "alpha by a thousandth": "lobe_GGX(N, V, L, f0, 1.001 * alpha)",
    "V for L in the Fresnel term": "lobe_GGX(N, V, L, f0, alpha) / lobe_F_Schlick(lobe_LdotH(V, L), f0) "
                                   "* lobe_F_Schlick(dot(N, V), f0)",
    "separable masking": "lobe_GGX(N, V, L, f0, alpha) / max(lobe_V_GGX(dot(N, V), max(dot(N, L), 1e-6), alpha), 1e-9) "
                         "* lobe_V_GGX_separable(dot(N, V), max(dot(N, L), 1e-6), alpha)",
}


@pytest.mark.parametrize("context", gl.CONTEXTS)
def test_the_comparison_under_a_probe_fails_on_faults_alone(context):
    drawn, function = case(), LIBRARY.find("lobe_GGX")[0]
    current = gl.create_context(context)
    sound = compare.library_shader(function, LIBRARY.text, function.name)
    assert compare.compare(drawn, sound, current).row["pass"]
    for fault, call in FAULTS.items():
        row = compare.compare(drawn, replace(sound, call=call), current).row
        assert not row["pass"] and row["max_units"] > 10 * row["units_allowed"], fault


LOBES = [f for f in LIBRARY.functions if f.kind == "lobe" and not compare.is_quadrature(f)]


@pytest.mark.parametrize("function", LOBES, ids=lambda f: f.key)
def test_lobes_agree_under_a_probe(function):
    row = compare.compare(case(function.name), compare.library_shader(function, LIBRARY.text, function.name),
                          gl.create_context("egl")).row
    assert row["pass"], row


def test_a_probe_shines_on_lobes_alone_and_in_no_frame():
    plan = matrix.library_plan(LIBRARY, LIBRARY.functions, scenes=(scenes.find("teapot-lobby"),))
    drawn = [(f, mode) for f, mode, scene in plan.cells() if scene]
    assert {f.kind for f, _ in drawn} == {"lobe"} and {mode for _, mode in drawn} == {"shading"}
    assert not any(compare.is_quadrature(f) for f, _ in drawn)  # milliseconds a value, times 64


def test_more_inputs_than_a_texture_takes_are_drawn_in_blocks(monkeypatch):
    inputs = {"x": np.random.default_rng(5).normal(size=(5, 5000, 1)).astype(np.float32)}
    with gl.create_context("egl") as context:
        whole = gl.evaluate(context, "", "x * x", "float", inputs)
        monkeypatch.setattr(gl, "MOST_ROWS", 7)
        parts = gl.evaluate(context, "", "x * x", "float", inputs)
    assert np.array_equal(whole, parts)
    assert np.allclose(whole[:, 0], (inputs["x"].astype(float) ** 2).sum(0)[:, 0], rtol=1e-5)


def test_a_sum_over_many_lights_rounds_little():
    inputs = {"x": np.random.default_rng(7).uniform(0, 1, size=(64, 4096, 1)).astype(np.float32)}
    with gl.create_context("egl") as context:
        got = gl.evaluate(context, "", "x", "float", inputs)[:, 0]
    exact = inputs["x"].astype(float).sum(0)[:, 0]
    assert np.abs(got / exact - 1).max() < 4 * compare.FLOAT32_ROUNDOFF
