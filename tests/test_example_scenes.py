"""The six scenes of examples/scenes, rendered small, against values that the path tracer has no part in: closed forms,
quadratures and ray optics written here from the textbooks."""

import re

import numpy as np
import OpenEXR
import pytest

from lobe.lab import files, quadrature, rendering, scene_files, spectra
from lobe.lab.paths import DATA, ROOT

EXAMPLES = ROOT / "examples" / "scenes"
EON_ROUNDING = 0.002  # by which EON's fitted albedo misses 1 at most, as its header says


class Seen:
    """A scene, some of its text replaced, rendered; and its pixels as arrays."""

    def __init__(self, folder, name, *edits, spp=64, width=64, seed=1):
        text = (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8").replace("../../data", str(DATA))
        for old, new in edits:
            assert re.search(old, text, re.S), old
            text = re.sub(old, new, text, flags=re.S)
        path = folder / f"{name}.toml"
        path.write_text(text, encoding="utf-8")
        self.scene = scene_files.load(path)
        settings = rendering.settings(self.scene, width, seed, None)
        job = rendering.Rendering(self.scene, settings, folder)
        job.advance(rendering.Budget(spp), lambda *_: None)
        job.write()
        self.parts = {}
        for part in OpenEXR.File(str(job.picture), separate_channels=True).parts:
            names = sorted(part.channels, key="RGBXYZUVI".index)
            self.parts[part.name()] = np.stack([part.channels[n].pixels for n in names], axis=-1).astype(float)

    def __getitem__(self, name):
        return self.parts[name]

    def mask(self, name):
        return self["object"][..., 0] == self.scene.objects.index(name)

    def without_edges(self, mask):
        """The pixels of a mask all of whose neighbours belong to it."""
        padded = np.pad(mask, 1)
        return np.all([np.roll(padded, (y, x), (0, 1))[1:-1, 1:-1] for y in (-1, 0, 1) for x in (-1, 0, 1)], axis=0)

    def means(self, mask, part="beauty"):
        return self[part][mask].mean(axis=0)

    def noise(self, mask):
        """Standard error of means()."""
        return rendering.error_of_mean(self["deviation"], self["group"][..., 0], mask)


def only(*names):
    """An edit that leaves the named objects alone."""
    keep = "|".join(names)
    return (rf'\[\[objects\]\]\n(?!name = "(?:{keep})")(?:[^\n]+\n)+', "")


def dot(a, b):
    return np.sum(a * b, axis=-1)


def ggx_albedo(cosine, alpha, fresnel):
    """Directional albedo of GGX, height-correlated, of an isotropic width (Walter 2007, eq. 33; Heitz 2014, eq. 99)."""
    (N, T, V, L), weight = quadrature.lights(np.arccos(cosine))
    H = (V + L) / np.linalg.norm(V + L, axis=-1, keepdims=True)
    nv, nl, nh = dot(N, V), np.maximum(dot(N, L), 1e-12), dot(N, H)
    D = alpha**2 / (np.pi * (nh**2 * (alpha**2 - 1) + 1) ** 2)
    root = [np.sqrt(alpha**2 + (1 - alpha**2) * c**2) for c in (nv, nl)]
    return np.sum(D * 0.5 / (nl * root[0] + nv * root[1]) * fresnel(dot(V, H)) * weight)


def conductor(cosine, eta, k):
    """Fresnel reflectance of n + ik, by complex amplitudes."""
    index = eta + 1j * k
    inside = np.sqrt(index**2 - (1 - cosine**2))
    s, p = (cosine - inside) / (cosine + inside), (index**2 * cosine - inside) / (index**2 * cosine + inside)
    return (abs(s) ** 2 + abs(p) ** 2) / 2


def interpolated(albedo, cosines):
    nodes = np.linspace(0.05, 1, 24)
    return np.interp(cosines, nodes, [albedo(c) for c in nodes])


# Furnace.


def test_furnace_shows_what_loses_light_and_nothing_else(tmp_path):
    seen = Seen(tmp_path, "furnace", spp=32, width=160)
    background = seen.without_edges(seen["object"][..., 0] > 1e9)
    assert (seen["beauty"][background] == 0.5).all()
    for i in range(1, 6):
        mask = seen.without_edges(seen.mask(f"ggx-{i}"))
        assert (seen.means(mask) < 0.5).all(), i


@pytest.mark.parametrize("i, alpha", [(1, 0.1), (3, 0.5), (5, 1.0)])
def test_furnace_ball_of_one_bounce(tmp_path, i, alpha):
    seen = Seen(tmp_path, "furnace", only(f"ggx-{i}"))
    mask = seen.without_edges(seen.mask(f"ggx-{i}"))
    expected = 0.5 * interpolated(lambda c: ggx_albedo(c, alpha, lambda x: 1), dot(seen["N"], seen["V"])[mask]).mean()
    assert expected < 0.4975
    np.testing.assert_allclose(seen.means(mask), expected, atol=4 * seen.noise(mask).max() + 1e-3)


@pytest.mark.parametrize("i", [1, 3, 5])
def test_furnace_ball_that_preserves_energy(tmp_path, i):
    seen = Seen(tmp_path, "furnace", only(f"eon-{i}"))
    mask = seen.mask(f"eon-{i}")
    np.testing.assert_allclose(seen.means(mask), 0.5, atol=4 * seen.noise(mask).max() + EON_ROUNDING / 2)


# Clay bunny.


def test_white_bunny_cannot_be_seen_in_white_light(tmp_path):
    seen = Seen(tmp_path, "clay-bunny", (r"albedo = \[[^]]*\]", "albedo = 1.0"), (r'file = "[^"]*lobby.exr"\n.*?\n', "color = 1.0\n"),
                (r"spp = \d+", "depth = 1000"), width=48)
    print(seen.means(seen.mask("bunny")), seen.means(seen.mask("table")), seen.noise(seen.mask("bunny")))
    for name in ("bunny", "table"):
        mask = seen.without_edges(seen.mask(name))
        np.testing.assert_allclose(seen.means(mask), 1, atol=4 * seen.noise(mask).max() + 4 * EON_ROUNDING)


# Plastic Suzanne: the floor in the light of each lamp.


def polygon_irradiance(points, normal, corners):
    """Lambert's formula: irradiance from a polygon of radiance 1 above the horizon."""
    towards = corners[None] - points[:, None]
    towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
    total = 0.0
    for i in range(len(corners)):
        a, b = towards[:, i], towards[:, (i + 1) % len(corners)]
        axis = np.cross(a, b)
        total = total + np.arccos(np.clip(dot(a, b), -1, 1)) * dot(axis / np.linalg.norm(axis, axis=-1, keepdims=True), normal)
    return np.abs(total) / 2


def test_floor_under_suzannes_lamps(tmp_path):
    seen = Seen(tmp_path, "plastic-suzanne", (r"spp = \d+", "depth = 1"), only("floor"), spp=16, width=96)
    floor = seen.without_edges(seen.mask("floor"))
    points, up = seen["position"][floor], np.array((0.0, 1.0, 0.0))
    albedo = 0.55
    for name, center, target, size, radiance in (
            ("key", (-2.6, 3.0, 2.6), (0, 0, 0), (2.0, 2.0), (11.0, 10.2, 9.0)),
            ("rim", (1.4, 2.6, -3.0), (0, 0.3, 0), (2.4, 0.5), (16.0, 16.0, 16.0))):
        facing = np.subtract(target, center) / np.linalg.norm(np.subtract(target, center))
        u = np.cross(up, facing) / np.linalg.norm(np.cross(up, facing))
        corners = np.array([center + u * (x * size[0] / 2) + np.cross(facing, u) * (y * size[1] / 2)
                            for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        faced = dot(points - center, facing) > 0
        E = polygon_irradiance(points, up, corners) * faced
        got, expected = seen[f"light.{name}"][floor], albedo / np.pi * E[:, None] * radiance
        np.testing.assert_allclose(got.mean(axis=0), expected.mean(axis=0), rtol=0.01, err_msg=name)
        assert (got[dot(points - center, facing) < -0.2] == 0).all()
    center, radius, radiance = np.array((4.2, 1.6, 2.4)), 0.5, np.array((5.0, 7.0, 11.0))
    towards = center - points
    distance = np.linalg.norm(towards, axis=-1, keepdims=True)
    E = np.pi * radiance * (radius / distance) ** 2 * (towards[:, 1:2] / distance)
    np.testing.assert_allclose(seen["light.fill"][floor].mean(axis=0), (albedo / np.pi * E).mean(axis=0), rtol=0.01)


# Gold teapot.


def probe_directions(height, width):
    """Unit vectors and solid angles of a latitude-longitude picture: +y up, -z in the middle, +x right of it."""
    theta = np.pi * (np.arange(height) + 0.5) / height
    phi = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    theta, phi = np.meshgrid(theta, phi, indexing="ij")
    L = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], axis=-1)
    return L, np.sin(theta) * (np.pi / height) * (2 * np.pi / width)


def turned(vectors, degrees):
    """About +y, from +z towards +x."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([c * x + s * z, y, -s * x + c * z], axis=-1)


def eon(N, V, L, albedo, r):
    """Portsmouth, Kutz and Hill 2024, eq. 22 and following, one channel."""
    nv, nl = dot(N, V), dot(N, L)
    A = 1 / (1 + (0.5 - 2 / (3 * np.pi)) * r)

    def E(c):
        theta = np.arccos(np.clip(c, 1e-9, 1))
        sin = np.sin(theta)
        G = sin * (theta - sin * c) + 2 / 3 * (sin / np.maximum(c, 1e-9) * (1 - sin**3) - sin)
        return A * (1 + r * G / np.pi)

    s = dot(V, L) - nv * nl
    single = albedo * A * (1 + r * np.where(s > 0, s / np.maximum(np.maximum(nv, nl), 1e-12), s))
    mean = A * (1 + (2 / 3 - 28 / (15 * np.pi)) * r)
    more = albedo**2 * mean / (1 - albedo * (1 - mean)) * (1 - E(nv)) * (1 - E(nl)) / (1 - mean)
    return (single + more) / np.pi


def test_floor_of_the_studio(tmp_path):
    """Alone under the probe, turned by 150 degrees: the sum over the probe's texels."""
    seen = Seen(tmp_path, "gold-teapot", only("floor"), spp=128, width=32)
    floor = seen.without_edges(seen.mask("floor"))
    probe = np.maximum(files.read_exr(DATA / "hdri" / "studio.exr")["RGB"].astype(float), 0)
    L, solid = probe_directions(*probe.shape[:2])
    L = turned(L, 150.0)
    N, cosine = np.array((0.0, 1.0, 0.0)), np.maximum(L[..., 1], 0)
    V = seen["V"][floor].mean(axis=0)
    f = np.where(cosine > 0, eon(N, V / np.linalg.norm(V), L, 0.16, 0.5), 0)
    expected = np.einsum("hwc,hw->c", probe, f * cosine * solid)
    got, noise = seen.means(floor), seen.noise(floor)
    assert (noise < 0.01 * expected).all()
    np.testing.assert_allclose(got, expected, rtol=0.03)
    mirrored = np.einsum("hwc,hw->c", probe[:, ::-1], f * cosine * solid)
    assert (np.abs(got / mirrored - 1) > 0.03).any()  # so that the test knows left from right


def test_gold_in_white_light(tmp_path):
    """A ball of the teapot's gold: the albedo, of the measured index, by quadrature."""
    seen = Seen(tmp_path, "gold-teapot", only("teapot"), (r'file = "[^"]*studio.exr"\n.*?\n', "color = 1.0\n"),
                (r'shape = "mesh"\nfile = "[^"]*"\n', 'shape = "sphere"\n'))
    mask = seen.without_edges(seen["object"][..., 0] == 0)
    cosines = dot(seen["N"], seen["V"])[mask]
    for channel, (eta, k) in enumerate(zip(*(scene_files.measured(DATA / "ior" / "Au_Johnson.csv")[n] for n in ("eta", "k")))):
        expected = interpolated(lambda c: ggx_albedo(c, 0.2, lambda x: conductor(x, eta, k)), cosines).mean()
        np.testing.assert_allclose(seen.means(mask)[channel], expected, atol=4 * seen.noise(mask)[channel] + 2e-3)


# Glass sphere.


def through_glass(rays, center, eta, bounces=6):
    """(direction, share of the light) of what leaves a ball that a ray hits, by Snell and Fresnel: reflected outside, then
    out after each passage within, the angle being the same at every turn."""
    origin, D = rays
    along = dot(center - origin, D)[:, None]
    nearest = origin + along * D - center
    point = nearest - D * np.sqrt(1 - dot(nearest, nearest))[:, None]
    cosI = -dot(point, D)
    sinT = np.sqrt(1 - cosI**2) / eta
    cosT = np.sqrt(1 - sinT**2)
    s, p = (cosI - eta * cosT) / (cosI + eta * cosT), (eta * cosI - cosT) / (eta * cosI + cosT)
    R = (s**2 + p**2) / 2
    yield D + 2 * cosI[:, None] * point, R
    inside = (D + (cosI - eta * cosT)[:, None] * point) / eta
    share = (1 - R) ** 2
    for _ in range(bounces):
        point = point + 2 * cosT[:, None] * inside
        yield eta * inside + (cosI - eta * cosT)[:, None] * point, share
        inside = inside - 2 * cosT[:, None] * point
        share = share * R


def probe_at(probe, D):
    height, width = probe.shape[:2]
    row = np.clip(np.arccos(np.clip(D[:, 1], -1, 1)) / np.pi * height, 0, height - 1).astype(int)
    column = ((0.5 + np.arctan2(D[:, 0], -D[:, 2]) / (2 * np.pi)) * width).astype(int) % width
    return probe[row, column]


def test_glass_ball_shows_the_probe_by_snells_law(tmp_path):
    seen = Seen(tmp_path, "glass-sphere", only("ball"), (r"color = \[[^]]*\]", f'file = "{DATA}/hdri/lobby.exr"\nrotation = 200.0'),
                (r"\[\[lights\]\].*", ""), spp=256, width=48)
    mask = seen.without_edges(seen.mask("ball"))
    rng = np.random.default_rng(5)
    camera, (height, width) = seen.scene.camera, mask.shape
    probe = np.maximum(files.read_exr(DATA / "hdri" / "lobby.exr")["RGB"].astype(float), 0)
    rows, columns = np.nonzero(mask)
    scale = 2 * np.tan(np.radians(camera.fov_y_degrees) / 2) / height
    expected, count = 0.0, 256
    for _ in range(count):
        x, y = (columns + rng.random(len(columns)) - width / 2) * scale, (height / 2 - rows - rng.random(len(rows))) * scale
        D = np.array(camera.forward) + x[:, None] * camera.right + y[:, None] * camera.up
        D /= np.linalg.norm(D, axis=-1, keepdims=True)
        for out, share in through_glass((np.array(camera.eye), D), np.zeros(3), 1.5):
            expected = expected + probe_at(probe, turned(out, -200.0)) * share[:, None] / count
    got = seen["beauty"][mask]
    np.testing.assert_allclose(got.mean(axis=0), expected.mean(axis=0), rtol=0.03)
    assert np.median(np.abs(got - expected) / expected) < 0.05


def test_glass_loses_no_light(tmp_path):
    seen = Seen(tmp_path, "glass-sphere", only("ball"), (r"color = \[[^]]*\]", "color = 1.0"), (r"\[\[lights\]\].*", ""),
                (r"depth = \d+", "depth = 1000"), spp=32)
    mask = seen.mask("ball")
    np.testing.assert_allclose(seen.means(mask), 1, atol=4 * seen.noise(mask).max() + 1e-9)


# Brushed disc.


def ggx_aniso(N, T, V, L, f0, along, across):
    """Heitz 2014, eq. 85 and 99, by slopes; Schlick's Fresnel term. One channel of f0 at a time."""
    B = np.cross(N, T)
    H = (V + L) / np.linalg.norm(V + L, axis=-1, keepdims=True)
    t, b, n = dot(T, H), dot(B, H), dot(N, H)
    D = np.exp(-2 * np.log((t / along) ** 2 + (b / across) ** 2 + n**2)) / (np.pi * along * across)

    def Lambda(w):
        return (np.sqrt(1 + ((along * dot(T, w)) ** 2 + (across * dot(B, w)) ** 2) / dot(N, w) ** 2) - 1) / 2

    F = f0 + (1 - f0) * (1 - np.clip(dot(V, H), 0, 1)) ** 5
    return D * F / (1 + Lambda(V) + Lambda(L)) / (4 * dot(N, V) * dot(N, L))


def test_brushed_disc_under_its_lamps(tmp_path):
    seen = Seen(tmp_path, "brushed-disc", (r"spp = \d+", "depth = 1"), spp=64, width=64)
    place = np.linalg.norm(seen["position"][..., [0, 2]], axis=-1)
    mask = seen.mask("disc") & (place > 0.3) & (place < 0.9)
    assert seen.scene.notes == []
    P, N, V = (seen[name][mask] for name in ("position", "N", "V"))
    T = np.cross(N, P / np.linalg.norm(P, axis=-1, keepdims=True))  # around the middle, exactly
    f0 = np.minimum(spectra.f0_linear_srgb(DATA / "ior" / "Al_McPeak.csv"), 1)
    x, w = np.polynomial.legendre.leggauss(12)
    phi = 2 * np.pi * (np.arange(24) + 0.5) / 24
    for name, center, radius, radiance in (("warm", (-2.5, 2.5, -2.0), 0.35, (60.0, 42.0, 24.0)),
                                           ("cold", (2.8, 2.2, -1.2), 0.35, (22.0, 34.0, 56.0))):
        towards = np.array(center) - P
        distance = np.linalg.norm(towards, axis=-1, keepdims=True)
        axis = towards / distance
        side = np.cross(axis, (0.0, 1.0, 0.0))
        side /= np.linalg.norm(side, axis=-1, keepdims=True)
        other = np.cross(axis, side)
        edge = np.sqrt(1 - (radius / distance) ** 2)
        expected = np.zeros((len(P), 3))
        for xi, wi in zip(x, w):
            cos = (1 + edge) / 2 + xi * (1 - edge) / 2
            sin = np.sqrt(1 - cos**2)
            for angle in phi:
                L = axis * cos + sin * (side * np.cos(angle) + other * np.sin(angle))
                weight = wi * (1 - edge[:, 0]) / 2 * (2 * np.pi / len(phi)) * dot(N, L)
                for c in range(3):
                    expected[:, c] += ggx_aniso(N, T, V, L, f0[c], 0.03, 0.35) * weight * radiance[c]
        np.testing.assert_allclose(seen[f"light.{name}"][mask].mean(axis=0), expected.mean(axis=0), rtol=0.02, err_msg=name)
