"""Directions from photons: less noise where light comes through glass or off mirrors, and the same picture."""
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from lobe import reference

LAMBERT, GGX = "lobe_Lambert(vec3,vec3,vec3,vec3)", "lobe_GGX(vec3,vec3,vec3,vec3,float)"
GREY = [(LAMBERT, {"albedo": (0.5, 0.5, 0.5)})]
PLASTIC = GREY + [(GGX, {"f0": (0.04, 0.04, 0.04), "alpha": 0.3})]
GLASS, MIRROR = {"glass": {"eta": 1.5}}, {"mirror": {"f0": (0.9, 0.9, 0.9)}}
CAMERA = reference.Camera((0.0, 2.2, 4.5), (0.2, -0.7, 0.0), (0, 1, 0), 40)


def sky():
    """Dim, with a bright spot that no texel's neighbour shares."""
    pixels = np.full((32, 64, 3), 0.3, np.float32)
    pixels[8, 20] = 900.0
    return pixels


def ball(light, width=0.15, ground=GREY, **parts):
    scene = reference.Scene()
    scene.set_material(scene.add_sphere((0, 0, 0), 0.8), [], **parts)
    scene.set_material(scene.add_plane((0, -1, 0), (0, 1, 0), 4), ground)
    if light == "sky":
        scene.set_environment(sky())
    elif light == "square":
        scene.add_rectangle_light((1.5, 4, -1), (width, 0, 0), (0, 0, width), (60, 50, 40))
    else:
        scene.add_sphere_light((-2, 3, -1), width, (80, 80, 80))
    return scene


def rendered(scene, samples, size=24, seed=0, **settings):
    render = reference.Render(scene, CAMERA, size, size, **{"depth": 6, "seed": seed} | settings)
    render.advance(samples)
    return render.beauty()


def pictures(scene, count, samples, **settings):
    return np.array([rendered(scene, samples, seed=seed, variance=False, **settings) for seed in range(count)])


@pytest.mark.parametrize("light, ground, parts", [
    ("square", GREY, GLASS), ("sphere", GREY, GLASS), ("sphere", PLASTIC, GLASS), ("sphere", GREY, MIRROR),
    ("square", PLASTIC, MIRROR)])
def test_the_picture_is_the_same(light, ground, parts):
    """Means of blocks differ by their noise, which pictures of other seeds tell: the light is wide, since of one that is
    seldom found without the guide a few pictures tell too little noise."""
    scene, count = ball(light, 0.7, ground, **parts), 12
    a, b = (pictures(scene, count, 64, guided=guided).reshape(count, 4, 6, 4, 6, 3).mean((2, 4, 5))
            for guided in (True, False))
    z = (a.mean(0) - b.mean(0)) / np.sqrt(a.var(0, ddof=1) / count + b.var(0, ddof=1) / count + 1e-20)
    whole = np.sqrt((a.mean((1, 2)).var(ddof=1) + b.mean((1, 2)).var(ddof=1)) / count)
    assert abs(a.mean() - b.mean()) < 4 * whole
    assert np.sqrt(np.mean(z**2)) < 1.6 and np.abs(z).max() < 5.5  # Student's of 22 degrees, over 16 blocks


@pytest.mark.parametrize("light, parts, gain", [("sky", GLASS, 3), ("sky", MIRROR, 3), ("sphere", GLASS, 3)])
def test_there_is_less_noise(light, parts, gain):
    """At equal numbers of samples, on the ground, where the bright light is small."""
    scene = ball(light, **parts)
    noise = [np.mean(pictures(scene, 6, 64, guided=guided)[:, 14:].var(0, ddof=1)) for guided in (False, True)]
    assert noise[0] > gain * noise[1], noise


@pytest.mark.parametrize("strategy", ("mis", "light", "lobe"))
def test_a_furnace_stays_white(strategy):
    """Ground of albedo 1 and a glass ball under an even sky, and a lamp as bright: all that is seen is 1."""
    scene = reference.Scene()
    scene.set_material(scene.add_sphere((0, 0, 0), 0.8), [], **GLASS)
    scene.set_material(scene.add_sphere((0, -21, 0), 20), [(LAMBERT, {"albedo": (1, 1, 1)})])
    scene.set_environment(np.ones((4, 8, 3), np.float32))
    scene.add_sphere_light((3, 3, 0), 0.5, (1, 1, 1))
    stack = np.array([rendered(scene, 32, size=12, seed=s, depth=200, roulette=200, strategy=strategy)
                      for s in range(6)])
    mean, error = stack.mean(), stack.mean((1, 2, 3)).std(ddof=1) / 6**0.5
    assert abs(mean - 1) <= 4 * error + 1e-9 and error < 0.01


def test_without_mirror_and_glass_not_a_bit_changes():
    scene = reference.Scene()
    scene.set_material(scene.add_sphere((0, 0, 0), 0.8), PLASTIC)
    scene.set_material(scene.add_plane((0, -1, 0), (0, 1, 0), 4), GREY)
    scene.set_environment(sky())
    assert np.array_equal(rendered(scene, 20, guided=True), rendered(scene, 20, guided=False))


def test_neither_threads_nor_a_stop_change_a_bit():
    """Not even a stop between two numbers of photons."""
    scene, size = ball("sky", **GLASS), 160

    def render():
        return reference.Render(scene, CAMERA, size, size, depth=4)

    whole, begun, resumed = render(), render(), render()
    whole.advance(34)
    try:
        reference.set_threads(1)
        begun.advance(20)
        reference.set_threads(2)
        resumed.restore(begun.state())
        resumed.advance(14)
    finally:
        reference.set_threads(0)
    assert np.array_equal(whole.beauty(), resumed.beauty())


def test_renders_of_one_scene_at_the_same_time():
    """They ask for the same photons at once, and get the picture that one alone gets."""
    shared = ball("sky", **GLASS)
    with ThreadPoolExecutor(4) as pool:
        pictures = list(pool.map(lambda seed: rendered(shared, 4, seed=seed), range(4)))
    for seed, picture in enumerate(pictures):
        assert np.array_equal(picture, rendered(ball("sky", **GLASS), 4, seed=seed))


def test_a_state_of_a_render_without_it_is_refused():
    scene = ball("sky", **GLASS)
    render, other = (reference.Render(scene, CAMERA, 4, 4, guided=guided) for guided in (True, False))
    with pytest.raises(ValueError):
        other.restore(render.state())
