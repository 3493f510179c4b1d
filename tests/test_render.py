"""The path tracer: closed forms, and that its pictures depend on nothing that they must not depend on."""
import numpy as np
import pytest
from lobe import reference

LAMBERT, GGX = "lobe_Lambert(vec3,vec3,vec3,vec3)", "lobe_GGX(vec3,vec3,vec3,vec3,float)"
SPHERE_CAMERA = reference.Camera((0, 0, 4), (0, 0, 0), (0, 1, 0), 25)  # the unit sphere fills the picture


def lambert(albedo):
    return [(LAMBERT, {"albedo": (albedo,) * 3})]


def rendered(scene, camera, samples, size=16, **settings):
    render = reference.Render(scene, camera, size, size, **settings)
    render.advance(samples)
    return render


def furnace(lobes, **parts):
    scene = reference.Scene()
    scene.set_material(scene.add_sphere((0, 0, 0), 1), lobes, **parts)
    scene.set_environment(np.ones((8, 16, 3), np.float32))
    return scene


def mean_and_error(render):
    beauty = render.beauty()
    return beauty.mean(), np.sqrt(render.variance().mean(axis=2).sum()) / (beauty.size / 3)


@pytest.mark.parametrize("strategy", ("mis", "lobe", "light"))
def test_white_furnace_of_lambert(strategy):
    mean, error = mean_and_error(rendered(furnace(lambert(1)), SPHERE_CAMERA, 64, strategy=strategy))
    assert abs(mean - 1) <= 3 * error + 1e-12


@pytest.mark.parametrize("parts", ({"mirror": {"f0": (1, 1, 1)}}, {"glass": {"eta": 1.5}}, {"glass": {"eta": 0.7}}))
def test_mirror_and_glass_lose_no_light(parts):
    beauty = rendered(furnace([], **parts), SPHERE_CAMERA, 16, depth=200, roulette=200).beauty()
    assert np.abs(beauty - 1).max() < 1e-12


def still_life():
    scene = reference.Scene()
    plastic = [*lambert(0.4), (GGX, {"f0": (0.04, 0.05, 0.06), "alpha": 0.2})]
    scene.set_material(scene.add_sphere((0, 0, 0), 1), plastic)
    scene.set_material(scene.add_plane((0, -1, 0), (0, 1, 0), 4), lambert(0.5))
    scene.add_rectangle_light((1, 3, 0), (0.5, 0, 0), (0, 0, 0.7), (9, 8, 7))
    scene.add_directional_light((0.5, 1, 0.6), (1, 0.9, 0.8))
    scene.set_environment(np.linspace(0, 1, 8 * 16 * 3).reshape(8, 16, 3), 30)
    return scene


def test_neither_threads_nor_calls_nor_a_stop_change_a_bit():
    pictures = []
    for threads in (1, 2, 4):
        reference.set_threads(threads)
        pictures.append(rendered(still_life(), SPHERE_CAMERA, 32, size=40, layers=True))
    reference.set_threads(0)
    split = rendered(still_life(), SPHERE_CAMERA, 8, size=40, layers=True)
    for samples in (1, 11, 4):
        split.advance(samples)
    resumed = rendered(still_life(), SPHERE_CAMERA, 0, size=40, layers=True)
    resumed.restore(split.state())
    for render in (split, resumed):
        render.advance(8)
    for other in (*pictures[1:], split, resumed):
        assert np.array_equal(other.beauty(), pictures[0].beauty())
        assert np.array_equal(other.variance(), pictures[0].variance())
        assert np.array_equal(other.layers(), pictures[0].layers())


def test_layers_add_up_to_the_beauty():
    scene = still_life()
    render = rendered(scene, SPHERE_CAMERA, 8, layers=True)
    assert scene.light_names == ["rectangle0", "directional1", "environment"]
    assert np.allclose(render.layers().sum(axis=0), render.beauty(), rtol=1e-13, atol=0)


def test_direct_light_is_that_of_beauty():
    scene = reference.Scene()
    scene.set_material(scene.add_sphere((0, 0, 0), 1), [*lambert(0.4), (GGX, {"f0": (0.5,) * 3, "alpha": 0.5})])
    scene.add_directional_light((0.5, 1, 0.6), (1, 0.9, 0.8))
    other = scene.beauty(SPHERE_CAMERA, 16, 16, samples=4096)
    render = rendered(scene, SPHERE_CAMERA, 1024, depth=1)
    assert np.abs(render.beauty() - other).max() < 2e-3  # both have all pixels' edges well covered


WRONG = {
    "half_u, half_v: expected perpendicular": lambda s: s.add_rectangle_light((0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1)),
    "radiance: expected no negative": lambda s: s.add_sphere_light((0, 0, 0), 1, (1, -1, 1)),
    "environment: all of it is black": lambda s: s.set_environment(np.zeros((4, 8, 3))),
    "environment: expected finite numbers of at least 0, got -1": lambda s: s.set_environment(-np.ones((4, 8, 3))),
    "environment: expected an array of shape [n, n, 3]": lambda s: s.set_environment(np.ones((4, 8))),
    "mirror: expected {'f0': rgb}": lambda s: s.set_material(0, [], mirror={"f1": 1}),
    "glass: expected {'eta': number}": lambda s: s.set_material(0, [], glass=1.5),
    "strategy: expected mis, lobe or light": lambda s: reference.Render(s, SPHERE_CAMERA, 4, 4, strategy="both"),
    "depth: expected at least 0": lambda s: reference.Render(s, SPHERE_CAMERA, 4, 4, depth=-1),
    "width: expected at least 1": lambda s: reference.Render(s, SPHERE_CAMERA, 0, 4),
    "state: it belongs to another": lambda s: rendered(s, SPHERE_CAMERA, 1).restore(rendered(s, SPHERE_CAMERA, 1, seed=1).state()),
    "state: damaged": lambda s: rendered(s, SPHERE_CAMERA, 1).restore(rendered(s, SPHERE_CAMERA, 1).state()[:-1]),
}


@pytest.mark.parametrize("message", WRONG)
def test_wrong_input_is_told_in_one_line(message):
    with pytest.raises(ValueError) as error:
        WRONG[message](still_life())
    assert message in str(error.value) and "\n" not in str(error.value)


def test_a_scene_that_has_changed_is_refused():
    scene = still_life()
    render = rendered(scene, SPHERE_CAMERA, 1)
    scene.set_material(0, lambert(0.1))
    with pytest.raises(ValueError, match="scene has changed"):
        render.advance(1)


def test_lights_and_points_within_objects_are_found():
    scene = still_life()
    assert scene.enclosed_lights() == [] and scene.enclosing((0, 0, 0)) == 0 and scene.enclosing((0, 2, 0)) == -1
    scene.add_point_light((0, 0.5, 0), (1, 1, 1))
    scene.add_sphere_light((0, -0.5, 0), 0.1, (1, 1, 1))
    scene.add_rectangle_light((0, 0, 0.5), (0.1, 0, 0), (0, 0.1, 0), (1, 1, 1))
    assert scene.enclosed_lights() == [(2, 0), (3, 0), (4, 0)]
