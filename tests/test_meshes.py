"""Meshes: what is read from real files and from files of every format, and what is refused."""

import json
import struct

import numpy as np
import pytest
import trimesh

from lobe.lab import meshes
from lobe.lab.errors import InputError
from lobe.lab.paths import DATA

FLOAT64_ROUNDOFF = 2.0**-52
FLOAT32_ROUNDOFF = 2.0**-24

QUAD = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"


def face_normals(mesh):
    a, b, c = (mesh.vertices[corner] for corner in mesh.faces.T)
    return np.cross(b - a, c - a)


def written(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def refusal(path):
    """The message of the error, which is one line and begins with the file."""
    with pytest.raises(InputError) as error:
        meshes.load(path)
    message = str(error.value)
    assert message.startswith(f"{path}: ") and "\n" not in message and ";" in message
    return message


def glb(document, binary=b""):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


# Real files


@pytest.mark.parametrize("name, vertices, faces, has_normals", [
    ("teapot", 529, 992, False),  # of the 792 in the file, 263 repeat a position where patches meet
    ("bunny", 1839, 3674, False),
    ("suzanne", 7503, 14842, True),
])
def test_real_mesh(name, vertices, faces, has_normals):
    mesh = meshes.load(DATA / "mesh" / f"{name}.obj")
    assert mesh.vertices.shape == (vertices, 3) and mesh.vertices.dtype == np.float64
    assert mesh.faces.shape == (faces, 3) and mesh.faces.dtype == np.uint32
    assert (mesh.normals is not None) == has_normals
    assert mesh.uv is None and mesh.skipped == 0


@pytest.mark.parametrize("name", ["teapot", "bunny", "suzanne"])
def test_smooth_normals_of_real_mesh_are_unit_and_point_outside(name):
    mesh = meshes.load(DATA / "mesh" / f"{name}.obj")
    normals = meshes.smooth_normals(mesh.vertices, mesh.faces)
    assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() <= 4 * FLOAT64_ROUNDOFF
    outside = np.einsum("fi,fi->f", normals[mesh.faces].sum(axis=1), face_normals(mesh)) > 0
    assert outside.mean() > 0.99  # sharp folds of the meshes turn a few
    if mesh.normals is not None:
        assert np.median((normals * mesh.normals).sum(axis=1)) > 0.99


def test_normalized_is_centred_and_stands_as_before():
    mesh = meshes.load(DATA / "mesh" / "teapot.obj")
    fitted = meshes.normalized(mesh, size=3.0)
    low, high = fitted.vertices.min(axis=0), fitted.vertices.max(axis=0)
    assert np.allclose(low, -high, rtol=0, atol=8 * FLOAT64_ROUNDOFF)
    assert (high - low).max() == pytest.approx(3.0, rel=4 * FLOAT64_ROUNDOFF)
    scale = 3.0 / np.ptp(mesh.vertices, axis=0).max()
    assert np.allclose(np.diff(fitted.vertices, axis=0), scale * np.diff(mesh.vertices, axis=0), atol=1e-14)


# Every format


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "glb", "gltf"])
def test_every_format_gives_the_same_triangles(suffix, tmp_path):
    box = trimesh.creation.box((1, 2, 3))
    path = tmp_path / f"box.{suffix}"
    if suffix == "gltf":
        for name, content in trimesh.Scene(box).export(file_type="gltf").items():
            written(tmp_path, "box.gltf" if name.endswith(".gltf") else name, content)
    else:
        box.export(path, file_type=suffix)
    mesh = meshes.load(path)
    assert len(mesh.vertices) == 8 and len(mesh.faces) == 12
    assert np.allclose(mesh.vertices[mesh.faces], box.vertices[box.faces], atol=4 * FLOAT32_ROUNDOFF)


def test_scene_transforms_apply_and_a_mirror_keeps_the_outside_outside(tmp_path):
    sphere = trimesh.creation.icosphere(1)
    sphere.vertex_normals = sphere.vertices
    scene = trimesh.Scene()
    scene.add_geometry(sphere, geom_name="ball", transform=trimesh.transformations.translation_matrix([5, 0, 0]))
    mirror = np.diag([-1.0, 2.0, 1.0, 1.0])
    scene.add_geometry(sphere, geom_name="mirrored", transform=mirror)
    path = written(tmp_path, "scene.glb", scene.export(file_type="glb"))

    mesh = meshes.load(path)
    assert len(mesh.faces) == 2 * len(sphere.faces)
    assert np.allclose(mesh.vertices.max(axis=0), [6, 2, 1], atol=0.2)
    moved = mesh.vertices[:, 0] > 3
    centres = np.where(moved[:, None], [5, 0, 0], [0, 0, 0])
    of_face = (mesh.vertices - centres)[mesh.faces].mean(axis=1)
    assert ((face_normals(mesh) * of_face).sum(axis=1) > 0).all()
    gradient = (mesh.vertices - centres) * np.where(moved[:, None], 1, [1, 1 / 4, 1])  # of x^2 + (y/2)^2 + z^2
    expected = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    assert np.abs(mesh.normals - expected).max() <= 16 * FLOAT32_ROUNDOFF


def test_suffix_in_capitals(tmp_path):
    assert len(meshes.load(written(tmp_path, "A.OBJ", QUAD + "f 1 2 3 4\n")).faces) == 2


def test_polygons_relative_indices_and_vertex_colours_of_obj(tmp_path):
    path = written(tmp_path, "a.obj", "v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 1 1 0\nv 0 1 0\nf -4 -3 -2 -1 # quad\n"
                   "v 0 0 1\nv 1 0 1\nv 0 1 1\nf -3 \\\n -2 -1\n")
    mesh = meshes.load(path)
    assert len(mesh.vertices) == 7
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6]]


def test_texture_seams_do_not_show_in_smooth_normals(tmp_path):
    roof = "v 0 0 0\nv 0 1 0\nv 1 0 1\nv -1 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.5\n"
    mesh = meshes.load(written(tmp_path, "roof.obj", roof + "f 1/1 2/2 4/3\nf 1/4 3/2 2/1\n"))
    assert len(mesh.vertices) == 6 and mesh.uv.shape == (6, 2)
    ridge = mesh.normals[mesh.vertices[:, 2] == 0]
    assert np.allclose(ridge, ridge[0], atol=FLOAT64_ROUNDOFF) and len(ridge) == 4


def test_given_normals_become_unit_and_zero_or_missing_ones_smooth(tmp_path):
    path = written(tmp_path, "a.obj", QUAD + "vn 0 0 5\nvn 0 0 0\nf 1//1 2//2 3//1\nf 1//1 3//1 4\n")
    mesh = meshes.load(path)
    assert np.allclose(mesh.normals, [0, 0, 1], atol=FLOAT64_ROUNDOFF)


def test_smooth_normals_weigh_area_and_angle():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2], [2, 0, 2]], dtype=float)
    normals = meshes.smooth_normals(vertices, np.array([[0, 1, 2], [0, 3, 4]]))
    # At the origin: area 1/2 and 90 degrees along z, area 2 and 45 degrees along y.
    assert np.allclose(normals[0], np.array([0, 2, 1]) / np.sqrt(5), rtol=0, atol=4 * FLOAT64_ROUNDOFF)
    assert np.allclose(normals[1:3], [0, 0, 1]) and np.allclose(normals[3:], [0, 1, 0])


def test_normals_of_a_sheet_with_two_sides_are_finite(tmp_path):
    mesh = meshes.load(written(tmp_path, "a.obj", QUAD + "f 1 2 3\nf 3 2 1\n"))
    normals = meshes.smooth_normals(mesh.vertices, mesh.faces)
    assert np.allclose(np.abs(normals), [0, 0, 1])


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
def test_degenerate_triangles_are_skipped_and_counted(scale, tmp_path):
    lines = [f"v {scale * x} {scale * y} 0\n" for x, y in [(0, 0), (0.1, 0.3), (0.2, 0.6), (1, 0), (0, 0), (9, 9)]]
    faces = "f 1 4 2\nf 1 2 3\nf 1 1 4\nf 1 4 5\n"  # good, collinear, repeated index, repeated position
    mesh = meshes.load(written(tmp_path, "a.obj", "".join(lines) + faces))
    assert mesh.skipped == 3 and len(mesh.faces) == 1
    assert len(mesh.vertices) == 3  # the others are no longer used


@pytest.mark.parametrize("rows, columns", [(2, 3), (16, 32)])
def test_uv_sphere(rows, columns):
    sphere = meshes.uv_sphere(rows, columns)
    assert len(sphere.faces) == 2 * columns * (rows - 1)
    assert np.abs(np.linalg.norm(sphere.vertices, axis=1) - 1).max() <= 2 * FLOAT64_ROUNDOFF
    assert (sphere.normals == sphere.vertices).all()
    crosses = face_normals(sphere)
    assert np.linalg.norm(crosses, axis=1).min() > 1e-3
    assert ((crosses * sphere.vertices[sphere.faces].mean(axis=1)).sum(axis=1) > 0).all()
    assert sphere.uv.min() == 0 and sphere.uv.max() == 1


def test_uv_sphere_is_closed_and_its_area_tends_to_4_pi():
    sphere = meshes.uv_sphere(64, 128)
    area = np.linalg.norm(face_normals(sphere), axis=1).sum() / 2
    assert 4 * np.pi * 0.998 < area < 4 * np.pi
    assert np.abs(face_normals(sphere).sum(axis=0)).max() < 1e-12  # as over every closed surface


# Refused


@pytest.mark.parametrize("name, content, parts", [
    ("empty.obj", "", ["is empty"]),
    ("a.fbx", "x", ["'.fbx'", ".glb .gltf .obj .ply .stl"]),
    ("points.obj", QUAD, ["no triangles"]),
    ("junk.obj", bytes(range(256)) * 8, ["binary"]),
    ("prose.obj", "It was a dark\nand stormy night", ["no triangles"]),
    ("half.obj", QUAD + "v 1 2\nf 1 2 3\n", ["line 5", "expected 3"]),
    ("word.obj", "v 1 2 x\n", ["line 1", "'x'"]),
    ("nan.obj", QUAD + "v 1 nan 0\nf 1 2 3\n", ["line 5", "not finite"]),
    ("zero.obj", QUAD + "f 0 1 2\n", ["line 5", "index 0", "1 to 4"]),
    ("big.obj", QUAD + "f 1 2 5\n", ["line 5", "index 5", "1 to 4"]),
    ("relative.obj", QUAD + "f 1 2 -5\n", ["line 5", "index -5"]),
    ("normal.obj", QUAD + "vn 0 0 1\nf 1//1 2//1 3//2\n", ["line 6", "index 2", "1 to 1"]),
    ("edge.obj", QUAD + "f 1 2\n", ["line 5", "2 corners"]),
    ("corner.obj", QUAD + "f 1 2 /1\n", ["line 5", "'/1'"]),
    ("one_point.obj", "v 3 3 3\n" * 3 + "f 1 2 3\n", ["zero extent"]),
    ("line.obj", "v 0 0 0\nv 1 1 1\nv 3 3 3\nf 1 2 3\n", ["all 1 triangles have zero area"]),
    ("huge.obj", "v 1e300 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n", ["position 0", "float32"]),
    ("short.stl", b"solid nothing", ["no triangles"]),
    ("junk.stl", bytes(range(256)) * 8, ["no STL file"]),
    ("junk.ply", bytes(range(256)) * 8, ["no PLY file"]),
    ("junk.glb", bytes(range(256)) * 8, ["no GLB file"]),
    ("junk.gltf", "{", ["no GLTF file"]),
    ("list.gltf", "[]", ["no GLTF file"]),
    ("no_mesh.glb", glb({"asset": {"version": "2.0"}, "scenes": [{"nodes": []}], "scene": 0}), ["no triangles"]),
    ("draco.glb", glb({"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"]}),
     ["KHR_draco_mesh_compression", "without Draco compression"]),
    ("meshopt.gltf", json.dumps({"extensionsRequired": ["EXT_meshopt_compression"]}), ["without meshopt compression"]),
])
def test_bad_file_is_refused_in_one_line(name, content, parts, tmp_path, capfd):
    message = refusal(written(tmp_path, name, content))
    assert all(part in message for part in parts), message
    assert capfd.readouterr() == ("", "")


def test_missing_file_and_folder_are_refused(tmp_path):
    assert "no such file" in refusal(tmp_path / "none.obj")
    assert "is a folder" in refusal(tmp_path)


@pytest.mark.parametrize("suffix", ["ply", "stl", "glb"])
@pytest.mark.parametrize("kept", [0.1, 0.5, 0.99])
def test_truncated_file_is_refused(suffix, kept, tmp_path, capfd):
    content = trimesh.creation.icosphere(1).export(file_type=suffix)
    refusal(written(tmp_path, f"cut.{suffix}", content[: int(kept * len(content))]))
    assert capfd.readouterr() == ("", "")


PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
0 0 1
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""


@pytest.mark.parametrize("lines", [1, 2, 4, 5, 7])
def test_text_with_fewer_elements_than_declared_is_refused(lines, tmp_path):
    assert len(meshes.load(written(tmp_path, "whole.ply", PLY)).faces) == 4
    message = refusal(written(tmp_path, "cut.ply", "".join(PLY.splitlines(keepends=True)[:-lines])))
    assert f"{8 - lines} of the 8 elements" in message
    assert "7 of the 8 elements" in refusal(written(tmp_path, "within_a_line.ply", PLY[:-3]))


@pytest.mark.parametrize("suffix", ["ply", "glb"])
def test_index_out_of_range_is_refused(suffix, tmp_path):
    faces = [[0, 1, 2], [0, 2, 77]]
    broken = trimesh.Trimesh(np.eye(4)[:, :3], faces, process=False)
    path = written(tmp_path, f"a.{suffix}", broken.export(file_type=suffix))
    assert "index 77" in refusal(path) and "0 to 3" in refusal(path)


def test_negative_index_of_ply_is_refused(tmp_path):
    header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    assert "index -1" in refusal(written(tmp_path, "a.ply", header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_position_that_is_not_finite_is_refused(value, tmp_path):
    vertices = np.eye(3)
    vertices[1, 2] = value
    broken = trimesh.Trimesh(vertices, [[0, 1, 2]], process=False)
    path = written(tmp_path, "a.ply", broken.export(file_type="ply", vertex_normal=False))
    assert "position 1" in refusal(path) and f"{value:g}" in refusal(path)


def test_normal_that_is_not_finite_is_refused(tmp_path):
    header = "ply\nformat ascii 1.0\nelement vertex 3\n"
    header += "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    rows = "0 0 0 0 0 1\n1 0 0 0 nan 1\n0 1 0 0 0 1\n3 0 1 2\n"
    assert "normal 1" in refusal(written(tmp_path, "a.ply", header + rows))
