"""The path tracer: closed forms, and that its pictures depend on nothing that they must not depend on."""
import numpy as np
import pytest
from lobe import reference
from lobe.lab import rendering

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
    return beauty.mean(), rendering.error_of_mean(render.deviation().mean(axis=2, keepdims=True), render.groups())[0]


EON = "lobe_OrenNayar_EON(vec3,vec3,vec3,vec3,float)"
GGX_MULTIPLE = "lobe_GGX_multiple(vec3,vec3,vec3,vec3,float)"
WHITE = (1.0, 1.0, 1.0)
PRESERVING = {
    "lambert": lambert(1),
    **{f"EON {r}": [(EON, {"albedo": WHITE, "roughness": r})] for r in (0.0, 0.25, 0.5, 1.0)},
    **{f"GGX {a}": [(key, {"f0": WHITE, "alpha": a}) for key in (GGX, GGX_MULTIPLE)] for a in (0.01, 0.1, 0.3, 1.0)},
}


@pytest.mark.parametrize("lobes", PRESERVING)
def test_white_furnace(lobes):
    """What these lobes lose, nobody sees but the light that they do not give back."""
    slow = GGX_MULTIPLE in dict(PRESERVING[lobes])  # a quadrature for each direction
    render = rendered(furnace(PRESERVING[lobes]), SPHERE_CAMERA, *((32, 6) if slow else (256, 16)), depth=1)
    mean, error = mean_and_error(render)
    assert abs(mean - 1) <= 3 * error + 1e-9 and error < 0.02


@pytest.mark.full
@pytest.mark.parametrize("lobes", PRESERVING)
def test_white_furnace_closely(lobes):
    slow = GGX_MULTIPLE in dict(PRESERVING[lobes])
    render = rendered(furnace(PRESERVING[lobes]), SPHERE_CAMERA, *((512, 12) if slow else (4096, 32)), depth=1)
    mean, error = mean_and_error(render)
    assert abs(mean - 1) <= 3 * error + 1e-9 and error < 0.003


@pytest.mark.parametrize("strategy", ("lobe", "light"))
def test_white_furnace_by_either_strategy(strategy):
    mean, error = mean_and_error(rendered(furnace(lambert(1)), SPHERE_CAMERA, 64, strategy=strategy))
    assert abs(mean - 1) <= 3 * error + 1e-12


@pytest.mark.parametrize("parts", ({"mirror": {"f0": WHITE}}, {"glass": {"eta": 1.5}}, {"glass": {"eta": 0.7}}))
def test_mirror_and_glass_lose_no_light(parts):
    beauty = rendered(furnace([], **parts), SPHERE_CAMERA, 16, depth=200, roulette=200).beauty()
    assert np.abs(beauty - 1).max() < 1e-12


def test_a_mirror_reflects_as_much_as_fresnel_says():
    eta, k = (0.14, 0.37, 1.44), (4.5, 2.5, 1.9)
    scene = reference.Scene()
    scene.set_material(scene.add_plane((0, 0, 0), (0, 0, 1), 9), [], mirror={"eta": eta, "k": k})
    scene.set_environment(np.ones((4, 8, 3)))
    image = rendered(scene, reference.Camera((0, 0, 1), (0, 0, 0), (0, 1, 0), 0.01), 2, size=2).beauty()
    n = np.array(eta) + 1j * np.array(k)
    assert np.allclose(image, np.abs((n - 1) / (n + 1)) ** 2, rtol=1e-6)


def test_each_sample_sees_what_glass_reflects_and_what_it_refracts():
    above, below, eta, cos = 3.0, 7.0, 1.5, 0.8
    scene = reference.Scene()
    scene.set_material(scene.add_plane((0, 0, 0), (0, 1, 0), 9), [], glass={"eta": eta})
    scene.set_environment(np.repeat((above, below), 8)[:, None, None] * np.ones((16, 32, 3)))
    camera = reference.Camera((0, cos, (1 - cos**2) ** 0.5), (0, 0, 0), (0, 0, 1), 0.01)
    image = rendered(scene, camera, 1, size=2, variance=False).beauty()
    cos_inside = (1 - (1 - cos**2) / eta**2) ** 0.5
    parallel = (eta * cos - cos_inside) / (eta * cos + cos_inside)
    across = (cos - eta * cos_inside) / (cos + eta * cos_inside)
    F = (parallel**2 + across**2) / 2
    assert np.allclose(image, F * above + (1 - F) * below / eta**2, rtol=1e-4)


@pytest.mark.parametrize("depth", (0, 1, 2, 5, 60))
def test_a_closed_box_that_glows_is_a_geometric_series(depth):
    """Walls of albedo a that emit 1: the sum of a^k up to the depth, everywhere and in every direction."""
    albedo, scene = 0.6, reference.Scene()
    for axis in range(3):
        for side in (-1, 1):
            u, v = np.roll((0, side, 0), axis), np.roll((0, 0, 1), axis)
            wall = scene.add_rectangle_light(np.roll((-side, 0, 0), axis), u * 1.01, v * 1.01, (1, 1, 1))
            scene.set_material(wall, lambert(albedo))
    camera = reference.Camera((0.3, 0.2, 0.1), (0.9, -0.8, 0.4), (0, 1, 0), 90)
    render = rendered(scene, camera, 64, depth=depth, roulette=2)
    mean, error = mean_and_error(render)
    expected = (1 - albedo ** (depth + 1)) / (1 - albedo)
    assert abs(mean - expected) <= 3 * error + 1e-12 and error < 0.01


def seen_at(point, scene, samples, **settings):
    """A patch of the scene, so small that the light on it does not vary."""
    camera = reference.Camera(np.add(point, (0.001, 0.005, 0.006)), point, (0, 1, 0), 1e-3)
    return mean_and_error(rendered(scene, camera, samples, size=4, depth=1, **settings))


def lit_plane(albedo=1.0):
    scene = reference.Scene()
    scene.set_material(scene.add_plane((0, 0, 0), (0, 1, 0), 9), lambert(albedo))
    return scene


def polygon_form_factor(point, normal, corners):
    """Lambert 1760: half the sum of the edges' angles, each turned towards the normal, over pi."""
    to = [(c - point) / np.linalg.norm(c - point) for c in corners]
    edges = zip(to, to[1:] + to[:1])
    turned = ((np.arccos(a @ b), np.cross(a, b)) for a, b in edges)
    return abs(sum(angle * (n @ normal) / np.linalg.norm(n) for angle, n in turned)) / (2 * np.pi)


# near and far, under the light and beside it: drawn by solid angle and by area
@pytest.mark.parametrize("strategy", ("mis", "light"))
@pytest.mark.parametrize("point", ((0.3, 0, 0.2), (0, 0, 0), (-1.5, 0, 0.3), (0.3, 0, 6), (8, 0, 3)))
def test_light_of_a_rectangle_is_the_form_factor(point, strategy):
    center, u, v = np.array((0.3, 0.7, 0.2)), np.array((0.5, 0.1, 0)), np.array((0.0, 0, 0.7))
    scene = lit_plane(0.8)
    scene.add_rectangle_light(center, u, v, (3, 3, 3))
    mean, error = seen_at(point, scene, 1024, strategy=strategy)
    corners = [center - u - v, center + u - v, center + u + v, center - u + v]
    expected = 0.8 * 3 * polygon_form_factor(np.array(point), np.array((0, 1, 0)), corners)
    assert abs(mean - expected) <= 3 * error + 1e-6 * expected
    assert error < 2e-3 * expected


@pytest.mark.parametrize("radius", (0.01, 0.5, 0.99))
def test_light_of_a_sphere_is_its_closed_form(radius):
    center = np.array((0.0, 1, 0))
    scene = lit_plane()
    scene.add_sphere_light(center, radius, (3, 3, 3))
    for point in ((0, 0, 0), (1.2, 0, -0.5)):
        mean, error = seen_at(point, scene, 1024)
        distance = np.linalg.norm(center - point)
        expected = 3 * radius**2 / distance**2 / distance  # L pi (r/d)^2 cos, over pi
        assert abs(mean - expected) <= 3 * error + 1e-5 * expected and error < 0.01 * expected


def probe(seed=3, size=(6, 12)):
    return np.random.default_rng(seed).random((*size, 3)).astype(np.float32) ** 4 * 5


def looked_up(pixels, direction, rotation=0.0):
    """The convention, written anew: +y on top, -z in the middle, +x right of it, bilinear between centres."""
    height, width = pixels.shape[:2]
    azimuth = np.degrees(np.arctan2(direction[..., 0], -direction[..., 2])) + rotation
    x = (azimuth / 360 + 0.5) * width - 0.5
    y = np.degrees(np.arccos(direction[..., 1])) / 180 * height - 0.5
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - x0)[..., None], (y - y0)[..., None]
    at = lambda i, j: pixels[np.clip(j, 0, height - 1), i % width]
    upper = at(x0, y0) * (1 - fx) + at(x0 + 1, y0) * fx
    lower = at(x0, y0 + 1) * (1 - fx) + at(x0 + 1, y0 + 1) * fx
    return upper * (1 - fy) + lower * fy


@pytest.mark.parametrize("rotation", (0.0, 37.0))
@pytest.mark.parametrize("target", ((0, 0, -1), (1, 0.2, 0), (-0.5, -0.9, 0.3), (0.4, 0.99, 0.1)))
def test_an_environment_is_seen_where_it_belongs(target, rotation):
    scene = reference.Scene()
    scene.set_environment(probe(), rotation)
    image = rendered(scene, reference.Camera((0, 0, 0), target, (0, 1, 0), 1e-4), 2, size=2).beauty()
    assert np.allclose(image, looked_up(probe(), np.array(target) / np.linalg.norm(target), rotation), rtol=1e-3)


@pytest.mark.parametrize("size", ((6, 12), (70, 150)))
@pytest.mark.parametrize("strategy", ("mis", "light"))
def test_light_of_an_environment_is_its_quadrature(strategy, size):
    pixels, scene = probe(size=size), lit_plane()
    scene.set_environment(pixels, 37)
    camera = reference.Camera((0.1, 0.5, 0.6), (0, 0, 0), (0, 1, 0), 1e-3)
    render = rendered(scene, camera, 4096, size=4, depth=1, strategy=strategy)
    n = 600
    cos, phi = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n * 2 * np.pi)
    sin = np.sqrt(1 - cos**2)
    light = looked_up(pixels, np.stack((sin * np.cos(phi), cos, sin * np.sin(phi)), -1), 37)
    expected = (light * cos[..., None]).mean((0, 1)) * 2  # over pi, of a half sphere of 2 pi
    mean, error = render.beauty().mean((0, 1)), rendering.error_of_mean(render.deviation(), render.groups())
    assert np.all(np.abs(mean - expected) <= 4 * error + 1e-4 * expected) and np.all(error < 5e-3 * expected)


def still_life():
    scene = reference.Scene()
    plastic = [*lambert(0.4), (GGX, {"f0": (0.04, 0.05, 0.06), "alpha": 0.2})]
    scene.set_material(scene.add_sphere((0, 0, 0), 1), plastic)
    scene.set_material(scene.add_plane((0, -1, 0), (0, 1, 0), 4), lambert(0.5))
    scene.add_rectangle_light((1, 3, 0), (0.5, 0, 0), (0, 0, 0.7), (9, 8, 7))
    scene.add_directional_light((0.5, 1, 0.6), (1, 0.9, 0.8))
    scene.set_environment(np.linspace(0, 1, 8 * 16 * 3).reshape(8, 16, 3), 30)
    return scene


@pytest.mark.parametrize("adaptive", [False, True])
def test_neither_threads_nor_calls_nor_a_stop_change_a_bit(adaptive):
    settings = {"size": 24, "layers": True, "adaptive": adaptive}
    pictures = []
    for threads in (1, 2, 4):
        reference.set_threads(threads)
        pictures.append(rendered(still_life(), SPHERE_CAMERA, 136, **settings))  # beyond where evidence is merged
    reference.set_threads(0)
    split = rendered(still_life(), SPHERE_CAMERA, 8, **settings)
    for samples in (1, 31, 88):
        split.advance(samples)
    resumed = rendered(still_life(), SPHERE_CAMERA, 0, **settings)
    resumed.restore(split.state())
    for render in (split, resumed):
        render.advance(8)
    for other in (*pictures[1:], split, resumed):
        assert np.array_equal(other.beauty(), pictures[0].beauty())
        assert np.array_equal(other.variance(), pictures[0].variance())
        assert np.array_equal(other.layers(), pictures[0].layers())


def block_means(image, size=8):
    """Means over blocks of pixels, since a pixel's own variance has but one degree of freedom."""
    blocks = image[..., 1].reshape(image.shape[0] // size, size, image.shape[1] // size, size)
    return blocks.mean((1, 3))


def block_errors(render, size):
    """Standard errors of block_means of the beauty."""
    deviation, group, blocks = render.deviation()[..., 1:2], render.groups(), np.indices(render.groups().shape) // size
    count = np.array(group.shape) // size
    return np.array([[rendering.error_of_mean(deviation, group, (blocks[0] == j) & (blocks[1] == i))[0]
                      for i in range(count[1])] for j in range(count[0])])


def z_scores(a, b, size=16):
    """Differences of two independent renders over what each says of its error, by blocks of many groups: few tell
    little."""
    error = np.hypot(block_errors(a, size), block_errors(b, size))
    return ((block_means(a.beauty(), size) - block_means(b.beauty(), size)) / error).ravel()


@pytest.mark.parametrize("strategy", ("lobe", "light"))
def test_both_strategies_together_show_what_either_shows_alone(strategy):
    scene = still_life()
    z = np.concatenate([z_scores(rendered(scene, SPHERE_CAMERA, 32, size=64, depth=3, seed=2 * i),
                                 rendered(scene, SPHERE_CAMERA, 64, size=64, depth=3, strategy=strategy, seed=2 * i + 1))
                        for i in range(4)])
    assert abs(z.mean()) < 4 / np.sqrt(z.size) and z.std() < 1.3


@pytest.mark.parametrize("strategy", ("lobe", "light"))
def test_both_strategies_agree_where_lobes_look_at_tiles_of_the_environment(strategy):
    """Lobes of all shapes, alone and together, under more detail than still_life's."""
    lobes = [[(GGX, {"f0": (0.9, 0.6, 0.3), "alpha": 0.2})], [*lambert(0.4), (GGX, {"f0": (0.04,) * 3, "alpha": 0.1})],
             [("lobe_GGX_aniso(vec3,vec3,vec3,vec3,vec3,float,float)",
               {"f0": (0.9,) * 3, "alphaX": 0.5, "alphaY": 0.1})],
             [("lobe_Phong(vec3,vec3,vec3,vec3,float)", {"rs": (0.5,) * 3, "exponent": 40})]]
    scene = reference.Scene()
    for i, material in enumerate(lobes):
        scene.set_material(scene.add_sphere((i % 2 * 2.1 - 1.05, 0, i // 2 * 2.1 - 1.05), 1), material)
    scene.set_material(scene.add_plane((0, -1, 0), (0, 1, 0), 4), lambert(0.5))
    scene.set_environment(probe(size=(70, 150)), 37)
    camera = reference.Camera((0, 5, 5), (0, 0, 0), (0, 1, 0), 40)
    z = np.concatenate([z_scores(rendered(scene, camera, 32, size=64, depth=2, seed=2 * i),
                                 rendered(scene, camera, 64, size=64, depth=2, strategy=strategy, seed=2 * i + 1))
                        for i in range(4)])
    assert abs(z.mean()) < 4 / np.sqrt(z.size) and z.std() < 1.3


@pytest.mark.parametrize("strategy", ["mis", "light", "lobe"])
def test_a_sky_is_as_bright_above_whatever_shines_below(strategy):
    """In a picture that is too coarse for lobes to look at its tiles: each still gets a little more than its share."""
    sky = np.ones((63, 127, 3), np.float32)
    sky[50, 60:64] = 4e6  # a thousand times all of the rest
    scene = reference.Scene()
    scene.set_material(scene.add_plane((0, 0, 0), (0, 1, 0), 4), lambert(0.5))
    scene.set_environment(sky)
    camera = reference.Camera((0, 3, 0.1), (0, 0, 0), (0, 1, 0), 40)
    means = [rendered(scene, camera, 256, size=16, depth=1, strategy=strategy, seed=seed).beauty().mean() for seed in range(8)]
    error = np.std(means, ddof=1) / np.sqrt(len(means))
    print(f"{np.mean(means):.4f} +- {error:.4f}")
    assert abs(np.mean(means) - 0.5) < 4 * error + 1e-4 and error < 0.05


def cabinet():
    """What still_life has not: lights of a sphere and of a point, a mirror, glass, and a narrow lobe."""
    scene = reference.Scene()
    scene.set_material(scene.add_sphere((-0.6, -0.2, 0), 0.5), [], glass={"eta": 1.5})
    scene.set_material(scene.add_sphere((0.6, -0.2, 0), 0.5), lambert(0.2), mirror={"f0": (0.3, 0.4, 0.5)})
    scene.set_material(scene.add_plane((0, -1, 0), (0, 1, 0), 4), [*lambert(0.4), (GGX, {"f0": (0.2,) * 3, "alpha": 0.05})])
    scene.add_sphere_light((0.3, 2, 1), 0.4, (9, 8, 7))
    scene.add_point_light((-2, 3, 2), (5, 6, 7))
    scene.set_environment(np.linspace(0.2, 1, 8 * 16 * 3).reshape(8, 16, 3), 30)
    return scene


@pytest.mark.parametrize("strategy", ("lobe", "light"))
def test_both_strategies_agree_on_mirror_glass_and_narrow_lobes(strategy):
    """By the scatter over seeds: either alone has rare bright samples here, of which a pixel's variance knows little."""
    scene, camera = cabinet(), reference.Camera((0, 1, 5), (0, -0.3, 0), (0, 1, 0), 30)

    def means(strategy, first):
        return np.array([rendered(scene, camera, 128, size=32, depth=4, strategy=strategy, seed=first + i).beauty().mean()
                         for i in range(8)])

    a, b = means("mis", 0), means(strategy, 100)
    assert a.std() < 0.01 * a.mean() and b.std() < 0.03 * b.mean()
    assert abs(a.mean() - b.mean()) < 4 * np.sqrt((a.var(ddof=1) + b.var(ddof=1)) / 8)


def room(bare=False):
    """Walls of a box, which scatter light evenly, and what does not: gloss, a mirror, glass, a wall seen from behind."""
    scene = reference.Scene()
    for axis in range(3):
        for sign in (-1, 1) if axis < 2 else (-1,):
            center = sign * np.eye(3)[axis]
            scene.set_material(scene.add_plane(center, -center, 1), [(LAMBERT, {"albedo": 0.7 - 0.3 * np.abs(center)})])
    scene.add_rectangle_light((0, 0.98, 0), (0.4, 0, 0), (0, 0, 0.4), (9, 8, 7))
    if not bare:
        gloss = [*lambert(0.3), (GGX, {"f0": WHITE, "alpha": 0.3})]
        scene.set_material(scene.add_sphere((0.4, -0.6, 0.1), 0.4), gloss)
        scene.set_material(scene.add_sphere((-0.5, -0.7, 0.3), 0.3), [], glass={"eta": 1.5})
        scene.set_material(scene.add_sphere((-0.4, 0.2, -0.5), 0.3), lambert(0.4), mirror={"f0": (0.5, 0.4, 0.3)})
        scene.set_material(scene.add_plane((0, -0.2, -0.3), (0, 0.6, -0.8), 0.3), lambert(0.6))
        scene.set_material(scene.add_sphere((0.5, 0.4, -0.6), 0.3), lambert(0.0))  # where a path ends without a draw
        scene.add_point_light((0.5, 0.5, 0.8), (0.5, 0.6, 0.7))
    return scene, reference.Camera((0, 0, 4), (0, 0, 0), (0, 1, 0), 32)


@pytest.mark.parametrize("adaptive", [False, True])
def test_shared_light_has_no_bias(adaptive):
    """By the scatter over seeds, since pixels that share are noisy together; 36 pixels a side, so that some have few
    companions."""
    scene, camera = room()

    def pictures(share, first):
        return np.array([rendered(scene, camera, 48, size=36, depth=4, share=share, seed=first + i, adaptive=adaptive,
                                  variance=adaptive).beauty() for i in range(20)])

    shared, alone = pictures(True, 0), pictures(False, 100)
    a, b = (np.array([block_means(picture, 4) for picture in stack]) for stack in (shared, alone))
    z = (a.mean(0) - b.mean(0)) / np.sqrt((a.var(0, ddof=1) + b.var(0, ddof=1)) / 20)
    assert np.sqrt(np.mean(z**2)) < 1.3 and np.abs(z).max() < 5
    a, b = (stack.mean((1, 2, 3)) for stack in (shared, alone))
    assert abs(a.mean() - b.mean()) < 4 * np.sqrt((a.var(ddof=1) + b.var(ddof=1)) / 20) < 0.004 * b.mean()


def test_shared_light_has_less_noise():
    """What is left is mostly direct light, which is not shared."""
    scene, camera = room(bare=True)

    def variance(share):
        pictures = [rendered(scene, camera, 16, size=64, depth=4, share=share, seed=seed).beauty() for seed in range(6)]
        return np.median(np.var(pictures, axis=0))

    assert variance(True) < 0.5 * variance(False)


def test_layers_of_shared_light_add_up_to_it():
    scene, camera = room()
    render = rendered(scene, camera, 8, size=20, depth=4, layers=True)
    assert np.allclose(render.layers().sum(0), render.beauty(), rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("make", (lambda: (still_life(), SPHERE_CAMERA), lambda: room(bare=True)), 
                         ids=("still life", "room"))
def test_the_error_of_a_region_is_honest(make):
    """Where pixels share light, too, as they do in the room: by the variances of its pixels alone, z would be 2.5."""
    scene, camera = make()
    renders = [rendered(scene, camera, 16, size=64, depth=3, seed=seed) for seed in range(16)]
    z = np.concatenate([z_scores(a, b) for a, b in zip(renders[::2], renders[1::2])])  # 128 of them
    assert 0.85 < z.std() < 1.25 and abs(z.mean()) < 4 / np.sqrt(z.size)


def test_pixels_of_a_group_are_those_that_share():
    """Every other one of 8 x 8: none shares with its neighbours. The picture's rim cuts groups short."""
    def groups(**settings):
        return reference.Render(room(bare=True)[0], SPHERE_CAMERA, 20, 12, **settings).groups()

    y, x = np.indices((12, 20))
    assert np.array_equal(groups(), 20 * (y - y % 8 + y % 2) + x - x % 8 + x % 2)
    assert np.array_equal(groups(share=False), 20 * y + x)


def spotted(size=24, samples=64, seed=0, **settings):
    """A plane under a sky with one bright spot, which few directions find: each pixel should be as bright as its
    neighbours, and most look too dark."""
    sky = np.full((8, 16, 3), 0.01, np.float32)
    sky[1, 5] = 100
    scene = reference.Scene()
    scene.set_material(scene.add_plane((0, 0, 0), (0, 1, 0), 1e3), lambert(0.5))
    scene.set_environment(sky)
    camera = reference.Camera((0, 9, 0.1), (0, 0, 0), (0, 1, 0), 35)
    return rendered(scene, camera, samples, size=size, seed=seed, depth=1, **settings)


def test_adaptive_samples_have_no_bias():
    """Where a pixel's own samples decided on their number, those that had found the spot early would go on until the
    rest had outweighed it, and those that had not would stay dark."""
    truth = spotted(strategy="light", samples=256).beauty().mean()
    means = [spotted(strategy="lobe", adaptive=True, samples=48, seed=seed).beauty().mean() for seed in range(64)]
    sigma = np.std(means, ddof=1) / np.sqrt(len(means))
    assert sigma < 0.01 * truth
    assert abs(np.mean(means) - truth) < 4 * sigma


def test_adaptive_samples_go_where_the_noise_is():
    """A ball takes up little of a dark picture."""
    scene = reference.Scene()
    scene.set_material(scene.add_sphere((0, 0, 0), 1), lambert(0.5))
    scene.add_rectangle_light((0, 3, 0), (1, 0, 0), (0, 0, 1), (9, 9, 9))
    camera = reference.Camera((0, 1, 12), (0, 0, 0), (0, 1, 0), 35)

    def picture(samples, adaptive, seed):
        return rendered(scene, camera, samples, size=48, depth=1, seed=seed, adaptive=adaptive)

    truth = np.mean([picture(1024, False, seed).beauty() for seed in range(90, 94)], axis=0)
    errors = {adaptive: np.sqrt(np.mean([(picture(128, adaptive, seed).beauty() - truth) ** 2 for seed in range(4)]))
              for adaptive in (False, True)}
    assert errors[True] < 0.7 * errors[False]
    samples = picture(128, True, 0).samples()
    assert 112 < samples.mean() < 144 and samples.min() >= 32 and samples.max() > 512


def test_without_variance_nothing_is_said_of_it():
    render = rendered(still_life(), SPHERE_CAMERA, 4, variance=False)
    assert np.all(np.isfinite(render.beauty()))
    for ask in (render.variance, render.error, lambda: render.set_target(0.1)):
        with pytest.raises(ValueError, match="the render was made without"):
            ask()


def test_tiles_finish_when_they_are_good_enough():
    def adaptive(steps):
        render = reference.Render(still_life(), reference.Camera((1, 2, 6), (0, 0, 0), (0, 1, 0), 35), 48, 48)
        render.set_target(0.015)
        for step in steps:
            render.advance(step)
        return render

    render = adaptive((512,))
    samples = render.samples()
    assert set(np.unique(samples)) <= {16, 32, 64, 128, 256, 512} and samples.min() < samples.max()
    assert np.array_equal(render.beauty(), adaptive((100, 29, 383)).beauty())
    early = samples < samples.max()
    error = np.sqrt(render.variance()[early].mean())
    assert error <= 0.015 * render.beauty().mean() * 1.05  # the mean has moved since


def test_all_tiles_finish_when_the_picture_is_good_enough():
    """Light falls into one corner alone, whose own error is far above that of the picture."""
    scene = reference.Scene()
    scene.set_material(scene.add_plane((0, 0, 0), (0, 1, 0), 99), lambert(0.5))
    scene.add_rectangle_light((-1, 0.3, -1), (0.05, 0, 0), (0, 0, 0.05), (900, 900, 900))
    scene.add_directional_light((0, 1, 0), (1, 1, 1))
    render = reference.Render(scene, reference.Camera((0, 9, 0.1), (0, 0, 0), (0, 1, 0), 35), 64, 64, depth=1)
    while render.error() > 0.02:
        render.advance(1 if render.samples().max() < 16 else int(render.samples().max()))
    reached = render.samples().max()
    tiles = render.variance().mean(axis=2).reshape(4, 16, 4, 16).mean(axis=(1, 3))
    assert np.sqrt(tiles.max()) > 2 * 0.02 * render.beauty().mean()  # so that tile by tile there would be more to do

    adaptive = reference.Render(scene, reference.Camera((0, 9, 0.1), (0, 0, 0), (0, 1, 0), 35), 64, 64, depth=1)
    adaptive.set_target(0.02)
    adaptive.advance(1 << 14)
    assert adaptive.finished and adaptive.error() <= 0.02 and adaptive.samples().max() <= max(16, 2 * reached)


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
    "half_u, half_v: expected perpendicular":
        lambda s: s.add_rectangle_light((0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1)),
    "radiance: expected no negative": lambda s: s.add_sphere_light((0, 0, 0), 1, (1, -1, 1)),
    "environment: all of it is black": lambda s: s.set_environment(np.zeros((4, 8, 3))),
    "environment: expected finite numbers of at least 0, got -1": lambda s: s.set_environment(-np.ones((4, 8, 3))),
    "environment: expected an array of shape [n, n, 3]": lambda s: s.set_environment(np.ones((4, 8))),
    "mirror: expected {'f0': rgb}": lambda s: s.set_material(0, [], mirror={"f1": 1}),
    "glass: expected {'eta': number}": lambda s: s.set_material(0, [], glass=1.5),
    "strategy: expected mis, lobe or light": lambda s: reference.Render(s, SPHERE_CAMERA, 4, 4, strategy="both"),
    "depth: expected at least 0": lambda s: reference.Render(s, SPHERE_CAMERA, 4, 4, depth=-1),
    "width: expected at least 1": lambda s: reference.Render(s, SPHERE_CAMERA, 0, 4),
    "state: it belongs to another":
        lambda s: rendered(s, SPHERE_CAMERA, 1).restore(rendered(s, SPHERE_CAMERA, 1, seed=1).state()),
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


def test_a_state_of_another_version_is_refused():
    render = rendered(still_life(), SPHERE_CAMERA, 1)
    state = bytearray(render.state())
    state[0] ^= 1
    with pytest.raises(ValueError, match="state: of version"):
        render.restore(bytes(state))
