"""Scenes from Python: what the arrays look like, and what is said of wrong ones. The tracer's own tests are C++."""
import numpy as np
import pytest
from lobe.reference import Camera, Scene

LAMBERT = "lobe_Lambert(vec3,vec3,vec3,vec3)"
TRIANGLE = [(-1, -1, 0), (1, -1, 0), (0, 1, 0)]
CAMERA = Camera((0, 0, 3), (0, 0, 0), (0, 1, 0), 60)


def lit_triangle():
    scene = Scene()
    scene.set_material(scene.add_mesh(TRIANGLE, [(0, 1, 2)]), [(LAMBERT, {"albedo": (1, 0.5, 0.25)})])
    scene.add_directional_light((0, 0, 2), (np.pi, np.pi, np.pi))
    return scene


def test_trace_gives_an_array_for_each_quantity():
    images = lit_triangle().trace(CAMERA, 20, 10)
    per_pixel = {"N": 3, "T": 3, "V": 3, "position": 3, "uv": 2}
    for name, width in per_pixel.items():
        assert images[name].shape == (10, 20, width) and images[name].dtype == np.float64
    assert images["depth"].shape == images["object"].shape == images["primitive"].shape == (10, 20)
    assert images["object"].dtype == images["primitive"].dtype == np.int32
    assert images["L"].shape == images["E"].shape == (1, 10, 20, 3)
    assert np.array_equal(images["object"] >= 0, np.isfinite(images["depth"]))
    assert set(np.unique(images["object"])) == {-1, 0}


def test_the_first_row_is_the_top_one():
    widths = (lit_triangle().trace(CAMERA, 64, 64)["object"] == 0).sum(axis=1)
    rows = np.flatnonzero(widths)
    assert widths[rows[0]] < widths[rows[-1]]  # the triangle stands on its edge


def test_beauty_is_albedo_times_irradiance_over_pi():
    image = lit_triangle().beauty(CAMERA, 64, 64)
    assert image[32, 32] == pytest.approx([1, 0.5, 0.25], rel=1e-14)
    assert np.all(image[0, 0] == 0)


def test_trace_of_some_rows_is_a_part_of_the_whole():
    scene, whole = lit_triangle(), lit_triangle().trace(CAMERA, 20, 10)
    for first, rows, taken in ((0, 3, slice(0, 3)), (3, 4, slice(3, 7)), (9, 1, slice(9, 10)), (2, 0, slice(2, 10))):
        part = scene.trace(CAMERA, 20, 10, first=first, rows=rows)
        for name, image in whole.items():
            np.testing.assert_array_equal(part[name], image[:, taken] if name in "LE" else image[taken], err_msg=name)


def test_vertex_frames_are_those_of_the_tracer():
    scene = lit_triangle()
    assert np.allclose(scene.normals(0), [(0, 0, 1)] * 3, atol=1e-15)
    assert np.allclose(scene.tangents(0), [(1, 0, 0)] * 3, atol=1e-15)
    turned = scene.add_mesh(TRIANGLE, [(0, 1, 2)], tangents=[(0, 3, 1)] * 3)
    assert np.allclose(scene.tangents(turned), [(0, 1, 0)] * 3, atol=1e-15)


NAN = float("nan")
WRONG = {
    "vertices: expected an array of shape [n, 3], got (2,)": lambda s: s.add_mesh([0, 1], [(0, 1, 2)]),
    "vertices: expected an array of shape [n, 3], got str": lambda s: s.add_mesh("teapot", [(0, 1, 2)]),
    "vertices: expected finite numbers": lambda s: s.add_mesh([(0, 0, NAN)] * 3, [(0, 1, 2)]),
    "faces: expected an array of shape [n, 3], got (1, 4)": lambda s: s.add_mesh(TRIANGLE, [(0, 1, 2, 2)]),
    "faces: row 1 names vertex 3": lambda s: s.add_mesh(TRIANGLE, [(0, 1, 2), (1, 2, 3)]),
    "expected at least one triangle": lambda s: s.add_mesh(TRIANGLE, np.empty((0, 3), np.uint32)),
    "normals: expected an array of shape [3, 3], got (1, 3)": lambda s: s.add_mesh(TRIANGLE, [(0, 1, 2)], [(0, 0, 1)]),
    "uv: expected an array of shape [3, 2]": lambda s: s.add_mesh(TRIANGLE, [(0, 1, 2)], uv=TRIANGLE),
    "radius: expected a number above 0": lambda s: s.add_sphere((0, 0, 0), 0),
    "normal: a null vector has no direction": lambda s: s.add_plane((0, 0, 0), (0, 0, 0), 1),
    "irradiance_rgb: expected no negative number": lambda s: s.add_directional_light((0, 1, 0), (1, -1, 1)),
    "known are": lambda s: s.set_material(0, [("lobe_Nobody()", {})]),
    "lobes: expected pairs": lambda s: s.set_material(0, [LAMBERT]),
    "parameter albedo is missing; its parameters are vec3 albedo": lambda s: s.set_material(0, [(LAMBERT, {})]),
    "no parameter gloss": lambda s: s.set_material(0, [(LAMBERT, {"albedo": (1, 1, 1), "gloss": 1})]),
    "albedo: expected finite numbers": lambda s: s.set_material(0, [(LAMBERT, {"albedo": (1, NAN, 1)})]),
    "no object 1; the scene has 1": lambda s: s.set_material(1, []),
    "width, height, samples: expected at least 1": lambda s: s.trace(CAMERA, 0, 4),
    "first, rows: expected rows of the picture": lambda s: s.trace(CAMERA, 4, 4, first=2, rows=3),
    "bare_loop: expected a directional light": lambda s: Scene().bare_loop(CAMERA, 4, 4),
}


@pytest.mark.parametrize("message", WRONG)
def test_wrong_input_is_told_in_one_line(message):
    with pytest.raises(ValueError) as error:
        WRONG[message](lit_triangle())
    assert message in str(error.value)
    assert "\n" not in str(error.value)
