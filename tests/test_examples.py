"""The passes of examples/ compile as they stand, and draw what the reference says."""

import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from lobe import reference
from lobe.lab import catalogue, compare, examples, gl, meshes, raster, scenes

SIZE = 64
FILES = sorted(p.name for p in examples.FOLDER.iterdir() if p.suffix in (".vert", ".frag"))
SPHERE = meshes.uv_sphere(64, 128)
WHITE = {"baseColor": (1.0, 1.0, 1.0), "metallic": 1.0}


@pytest.fixture(scope="module")
def context():
    created = gl.create_context("egl")
    with created:
        yield created


@pytest.fixture(scope="module")
def lobby(context):
    return examples.prefiltered(context, examples.lobby())


def mesh(name):
    return scenes.load_mesh(scenes.SHAPES[name])


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("target", ["330", "410", "450", "460", "300es", "310es", "320es"])
def test_compiles_strictly(tmp_path, name, target):
    compiler = shutil.which("glslangValidator")
    assert compiler, "glslangValidator is missing: install the package glslang-tools"
    (tmp_path / name).write_text(examples.complete(name, target))
    run = subprocess.run([compiler, str(tmp_path / name)], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout


@pytest.mark.parametrize("name", FILES)
def test_first_line_names_what_the_file_uses(name):
    first, _, text = (examples.FOLDER / name).read_text().partition("\n")
    used = set(re.findall(r"\b(?:lobe|LOBE)_\w+", text))
    command = re.fullmatch(rf"// \./lobe bundle (.+) --target 330 \| cat - examples/{name}", first)
    assert used == (set(command[1].split()) if command else set())
    assert command or "#version alone" in first or "precision highp float" in first


def test_page_shows_every_file_and_picture():
    page = (examples.FOLDER / "README.md").read_text()
    assert set(FILES) == set(re.findall(r"\]\(([\w-]+\.(?:vert|frag))\)", page))
    for path in re.findall(r"!\[.+\]\((.+)\)", page):
        assert 1000 < (examples.FOLDER / path).stat().st_size <= 250_000


@pytest.mark.parametrize("roughness", [0.0, 0.3, 1.0])
def test_pictures_are_finite(context, lobby, roughness):
    surface = examples.SURFACE | {"roughness": roughness}
    strokes = {"roughnessAlong": roughness, "roughnessAcross": 1.0}
    for name in ("suzanne", "teapot"):
        for image in (examples.forward(context, mesh(name), SIZE, surface),
                      examples.deferred(context, mesh(name), SIZE, surface),
                      examples.probe_shading(context, mesh(name), SIZE, lobby, surface),
                      examples.brushed(context, mesh(name), SIZE, strokes)):
            assert np.isfinite(image).all() and (image >= 0).all()
            assert image[..., :3].any() and 0.05 < image[..., 3].mean() < 0.5


def same_triangle(context, scene, size):
    """What the reference sees of a scene, and in which of these pixels OpenGL draws the same triangle."""
    seen = scenes.pixels(scene, size, shadows=False)
    _, triangle = raster.draw(context, scene, size, "", "vec3(0.0)", "vec3", {})
    same = triangle[seen.mask] == seen.primitive
    assert (~same).sum() <= 0.01 * same.size  # at 64 x 64 every pixel of a contour counts
    return seen, same


def require_reference_picture(context, image, shape, lobes, monkeypatch):
    """Where both sides see the same triangle, the picture is the sum of these lobes within the tolerance of frames."""
    monkeypatch.setitem(scenes.RIGS, "example", scenes.Rig((examples.SUN, examples.LAMP)))
    scene, library = scenes.Scene(shape, "example", scenes.SHAPES[shape]), catalogue.load()
    cases = [compare.frame_case(library.find(name)[0], scene, len(image), settings) for name, settings in lobes.items()]
    seen, same = same_triangle(context, scene, len(image))
    value, unit = (sum(getattr(case.reference, part) for case in cases) for part in ("value", "unit"))
    units = compare.units_of(image[..., :3][seen.mask], compare.Values(value, unit, unit))[same]
    assert np.count_nonzero(value) > 500 and units.max() <= compare.FRAME_UNITS


@pytest.mark.parametrize("surface", [examples.SURFACE, examples.SURFACE | {"metallic": 1.0}])
def test_forward_is_the_reference(context, surface, monkeypatch):
    base, metallic = np.array(surface["baseColor"]), surface["metallic"]
    f0, albedo = tuple(0.04 + (base - 0.04) * metallic), tuple(base * (1 - metallic))
    lobes = {"lobe_Lambert": {"albedo": albedo}, "lobe_GGX": {"f0": f0, "alpha": (surface["roughness"] ** 2,)}}
    image = examples.forward(context, mesh("suzanne"), SIZE, surface)
    require_reference_picture(context, image, "suzanne", lobes, monkeypatch)


def test_brushed_metal_is_the_reference(context, monkeypatch):
    f0 = tuple(float(x) for x in re.findall(r"\d\.\d+", catalogue.load().constants["LOBE_F0_ALUMINIUM"]))
    along, across = examples.BRUSHED["roughnessAlong"], examples.BRUSHED["roughnessAcross"]
    alphas = {"alphaX": (along**2,), "alphaY": (across**2,)}
    image = examples.brushed(context, mesh("teapot"), SIZE)
    require_reference_picture(context, image, "teapot", {"lobe_GGX_aniso": {"f0": f0} | alphas}, monkeypatch)


def test_deferred_is_forward(context):
    forward = examples.forward(context, mesh("suzanne"), SIZE)
    deferred = examples.deferred(context, mesh("suzanne"), SIZE)
    np.testing.assert_array_equal(deferred[..., 3], forward[..., 3])
    # The depth of a float32 buffer from 0.1 to 100 leaves the place 1e-5 uncertain, and the lamp is 2 away.
    np.testing.assert_allclose(deferred, forward, rtol=3e-5, atol=1e-6)


@pytest.mark.parametrize("along, across", [(0.3, 0.6), (0.6, 0.3)])
def test_highlight_is_long_across_the_strokes(context, along, across):
    """On a sphere lit from the eye, whose strokes run around the vertical axis: sideways in the picture."""
    behind = replace(examples.SUN, vector=scenes.EYE)
    dark = replace(examples.LAMP, color=(0.0, 0.0, 0.0))
    image = examples.brushed(context, SPHERE, SIZE, {"roughnessAlong": along, "roughnessAcross": across}, behind, dark)
    row, column = np.nonzero(image[..., 1] > image[..., 1].max() / 2)
    ratio = np.std(row) / np.std(column)
    assert ratio > 2 if across > along else ratio < 0.5


@pytest.mark.parametrize("roughness", [0.1, 0.25, 0.5, 0.8, 1.0])
def test_white_furnace(context, roughness):
    """A white mirror in a white room shows the albedo of GGX: all that one bounce reflects, within the fit's error."""
    room = examples.prefiltered(context, np.ones((32, 64, 3)), samples=32)
    image = examples.probe_shading(context, mesh("suzanne"), SIZE, room, WHITE | {"roughness": roughness})
    seen, same = same_triangle(context, scenes.find("suzanne-directional"), SIZE)
    NdotV = np.sum(seen.N * seen.V, axis=-1)
    same &= NdotV > 0.01  # farther out an interpolated normal's rounding shows
    exact = reference.evaluate("lobe_albedo_GGX(float,float)",
                               np.stack([NdotV[same], np.full(same.sum(), roughness**2)], -1))
    stated = catalogue.load().find("lobe_albedo_GGX")[0].approximation.error(exact)
    got = image[..., :3][seen.mask][same]
    assert len(got) > 500 and (np.abs(got - exact) <= stated + 1e-5).all()


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_white_room_never_gets_back_more(context, metallic):
    room = examples.prefiltered(context, np.ones((32, 64, 3)), samples=32)
    for roughness in (0.0, 0.4, 1.0):
        image = examples.probe_shading(context, SPHERE, SIZE, room,
                                       WHITE | {"metallic": metallic, "roughness": roughness})
        assert image[..., :3].max() <= 1 + 1e-3
        if metallic == 0:
            assert image[..., :3][image[..., 3] > 0].min() > 1 - 1e-3


def directions(height, width):
    """The directions of a probe's texels, [h, w, 3], and the solid angle of each up to a factor, [h, w, 1]."""
    phi = (np.arange(width) + 0.5) / width * 2 * np.pi - np.pi
    theta = ((np.arange(height) + 0.5) / height * np.pi)[:, None]
    parts = np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi, -np.sin(theta) * np.cos(phi)
    return np.stack(parts, -1), np.broadcast_to(np.sin(theta), (height, width))[..., None]


def levels(probe):
    """Each mip level of the probe from the second on, then the irradiance: (alpha, [h, w, 3])."""
    texture, last = probe["probe"], int(probe["lastLevel"])
    for i in range(1, last + 1):
        width, height = texture.width >> i, texture.height >> i
        half = np.frombuffer(texture.read(level=i), np.float16).reshape(height, width, 4)
        yield (i / last) ** 2, half[..., :3].astype(float)
    diffuse = probe["irradiance"]
    half = np.frombuffer(diffuse.read(), np.float16).reshape(diffuse.height, diffuse.width, 4)
    yield None, half[..., :3].astype(float)


def test_prefiltered_probe_is_the_integral(lobby):
    """Each level against a sum over all texels of the probe: with N = V the density of L is proportional to D(H)."""
    radiance = examples.lobby().astype(float)
    L, solid = directions(*radiance.shape[:2])
    for alpha, got in levels(lobby):
        N_all, _ = directions(*got.shape[:2])
        for at in ((0.3, 0.1), (0.5, 0.6), (0.7, 0.85)):
            place = tuple(int(a * n) for a, n in zip(at, got.shape))
            N = N_all[place]
            NdotL = np.maximum(L @ N, 0)[..., None]
            weight = NdotL * solid
            if alpha is not None:
                NdotH = np.sqrt((1 + NdotL) / 2)
                rows = np.concatenate([NdotH, np.full_like(NdotH, alpha)], -1).reshape(-1, 2)
                weight = weight * reference.evaluate("lobe_D_GGX(float,float)", rows).reshape(NdotH.shape)
            expected = (radiance * weight).sum((0, 1)) / weight.sum()
            np.testing.assert_allclose(got[place], expected, rtol=0.1, err_msg=f"alpha {alpha} at {at}")
