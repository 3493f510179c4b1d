"""Triangle meshes from files, checked, and made for a float32 rasteriser and a ray tracer to share."""

import io
import json
import logging
import re
import urllib.parse
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .errors import InputError
from .files import read_bytes

SLIVER = 1e-12
"""A triangle is degenerate when twice its area is at most this part of its longest edge squared."""

_SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl")
_COMPRESSIONS = {"KHR_draco_mesh_compression": "Draco", "EXT_meshopt_compression": "meshopt"}


@dataclass(frozen=True)
class Mesh:
    """
    Triangles, counter-clockwise seen from outside.

    vertices  float64 [v,3]
    faces     uint32 [f,3], indices of vertices
    normals   float64 [v,3], unit length; or None: vertices are then shared by all triangles that meet in a position,
              so that smooth normals can be summed over them
    uv        float64 [v,2] or None; the origin is the lower left corner of the picture
    skipped   number of degenerate triangles that the file had and faces does not
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None = None
    uv: np.ndarray | None = None
    skipped: int = 0


def load(path):
    """
    Reads an OBJ, PLY, STL, glTF or GLB file as one mesh, a scene with the transforms of its nodes applied.

    Polygons become fans of triangles; materials are ignored. Normals of the file are scaled to unit length. Where one
    is zero or missing among others, or where a mesh without normals is textured, so that seams split its vertices,
    they are smooth_normals. InputError for whatever is no usable mesh.
    """
    path = Path(path)
    content = read_bytes(path)
    suffix = path.suffix.lower()
    if suffix not in _SUFFIXES:
        raise InputError(f"{path}: unknown mesh format {suffix!r}, expected one of {' '.join(_SUFFIXES)}; "
                         "export the mesh in one of them")
    parts = _read_obj(path, content) if suffix == ".obj" else [part for part, _ in _read_with_trimesh(path, content)]
    if sum(len(part.faces) for part in parts) == 0:
        raise InputError(f"{path}: has no triangles; export the mesh with its faces, not points or curves")
    return _checked(path, _joined(parts))


def normalized(mesh, size=2.0):
    """The mesh with the centre of its bounding box at the origin and the longest side of the box `size` long."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return replace(mesh, vertices=(mesh.vertices - (low + high) / 2) * (size / (high - low).max()))


def uv_sphere(rows, columns):
    """
    A unit sphere of `rows` bands (>= 2) and `columns` sectors (>= 3), without degenerate triangles. Its poles lie on
    the y axis; normals are exact; u runs once around from +x over -z, v from the lower pole to the upper.
    """
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    phi, theta = 2 * np.pi * u, np.pi * v
    points = np.stack([np.sin(theta) * np.cos(phi), -np.cos(theta), -np.sin(theta) * np.sin(phi)], axis=-1)
    points = points.reshape(-1, 3)

    corner = np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)
    right, above = corner + 1, corner + columns + 1
    lower = np.stack([corner, right, above + 1], axis=-1)[1:]  # the lowest band has a point in place of this edge
    upper = np.stack([corner, above + 1, above], axis=-1)[:-1]  # and so has the highest
    faces = np.concatenate([lower.reshape(-1, 3), upper.reshape(-1, 3)]).astype(np.uint32)
    return Mesh(points, faces, points.copy(), np.stack([u, v], axis=-1).reshape(-1, 2))


def smooth_normals(vertices, faces):
    """
    Unit normals float64 [v,3]: the sum over all triangles that meet in the vertex's position, weighted, as in the
    reference, by area and by the angle there. Where they cancel, as on a sheet with two sides, that of one triangle.
    """
    _, position = np.unique(vertices, axis=0, return_inverse=True)
    position = position.reshape(-1)
    crosses = _crosses(vertices, faces)
    sums, some = np.zeros((2, position.max() + 1, 3))
    lengths = np.zeros(len(sums))
    for i in range(3):
        here, after, before = (vertices[faces[:, (i + step) % 3]] for step in range(3))
        cosine = np.einsum("fi,fi->f", after - here, before - here)  # times the edges, and so is the sine:
        weighted = crosses * np.arctan2(np.linalg.norm(crosses, axis=1), cosine)[:, None]
        corner = position[faces[:, i]]
        np.add.at(sums, corner, weighted)
        np.add.at(lengths, corner, np.linalg.norm(weighted, axis=1))
        some[corner] = crosses
    cancelled = np.linalg.norm(sums, axis=1) <= SLIVER * lengths
    return _unit(np.where(cancelled[:, None], some, sums))[position]


def _read_obj(path, content):
    """
    The OBJ file as one part. Read here and not through trimesh, which takes index 0 for 1, counts relative indices from
    the end of the file and drops normals and texture coordinates that it cannot match, all without a word.
    """
    tables = {"v": [], "vt": [], "vn": []}
    corners, triangles = {}, []  # (v, vt, vn) -> number of the corner, in the order of appearance
    if b"\0" in content:
        raise InputError(f"{path}: is binary, expected the text of an OBJ file; export it again")
    for number, line in enumerate(content.decode(errors="replace").replace("\\\n", " ").splitlines(), 1):
        keyword, *words = line.split("#")[0].split() or [""]
        try:
            if keyword in tables:
                width = 2 if keyword == "vt" else 3
                numbers = [float(words[i]) for i in range(width)]
                if not np.isfinite(numbers).all():
                    raise ValueError(f"{line.strip()!r} is not finite")
                tables[keyword].append(numbers)
            elif keyword == "f":
                polygon = [corners.setdefault(_obj_corner(word, tables), len(corners)) for word in words]
                if len(polygon) < 3:
                    raise ValueError(f"{len(polygon)} corners, expected at least 3")
                triangles += [(polygon[0], b, c) for b, c in zip(polygon[1:], polygon[2:])]
        except IndexError:
            raise InputError(f"{path}: line {number}: {len(words)} numbers after {keyword!r}, expected {width}; "
                             "export the mesh again") from None
        except ValueError as error:
            raise InputError(f"{path}: line {number}: {error}; export the mesh again") from None
    if not triangles:
        return []
    vertices, uv, normals = (
        _picked(np.array(table), indices) for table, indices in zip(tables.values(), np.array(list(corners)).T)
    )
    return [Mesh(vertices, np.array(triangles), normals, uv)]


def _picked(table, indices):
    """The rows of a table that the corners name, zeros where one names none, None where none does."""
    return np.where(indices[:, None] >= 0, table[indices], 0.0) if indices.max() >= 0 else None


def _obj_corner(word, tables):
    """The indices (v, vt, vn), from 0, of a corner such as 5, 5/1, 5//2, 5/1/2 or -1; -1 where there is none."""
    indices = [-1, -1, -1]
    for i, (text, table) in enumerate(zip(word.split("/"), tables.values())):
        if text:
            index = int(text)
            indices[i] = index - 1 if index > 0 else len(table) + index
            if index == 0 or not 0 <= indices[i] < len(table):
                raise ValueError(f"index {index} of {word!r} is out of range, expected 1 to {len(table)}")
    if indices[0] < 0:
        raise ValueError(f"corner {word!r} has no vertex")
    return tuple(indices)


def load_parts(path):
    """
    Reads a glTF or GLB file as its primitives, transforms applied: a list of (Mesh, material), the material as the
    file's JSON has it, or {} where a primitive names none. InputError for whatever is no usable mesh.
    """
    path = Path(path)
    content = read_bytes(path)
    parts = [(part, material) for part, material in _read_with_trimesh(path, content) if len(part.faces)]
    if not parts:
        raise InputError(f"{path}: has no triangles; export the mesh with its faces, not points or curves")
    return [(_checked(path, part), material) for part, material in parts]


def _read_with_trimesh(path, content):
    """The meshes of a PLY, STL, glTF or GLB file, each in the coordinates of the whole, and what the JSON says of its
    material."""
    import trimesh  # takes 0.5 s, so only who needs it waits

    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # what matters of it is in our own messages
    materials, resolver = [], None
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            if path.suffix.lower() in (".gltf", ".glb"):
                document, resolver = _gltf_document(content), _resolver(path)
                _refuse_compression(path, document)
                _refuse_cycles(path, document)
                materials, content = _materials(document), _with_bare_materials(content, document)
            if path.suffix.lower() == ".ply":
                _refuse_short_text(path, content)
            scene = trimesh.load_scene(io.BytesIO(content), file_type=path.suffix[1:].lower(), process=False,
                                       resolver=resolver)
            nodes = [scene.graph[node] for node in scene.graph.nodes_geometry]
            return [(_transformed(scene.geometry[name], matrix), _material_of(scene.geometry[name], materials))
                    for matrix, name in nodes if isinstance(scene.geometry[name], trimesh.Trimesh)]
    except InputError:
        raise
    except Exception as error:  # the parsers raise whatever the damage happens to cause
        reason = " ".join(str(error).split())[:120]
        if isinstance(error, ImportError):  # trimesh looks for a package that guesses the encoding
            reason = "neither binary of the right length nor text"
        raise InputError(f"{path}: is truncated or no {path.suffix[1:].upper()} file ({reason}); "
                         "export or download it again") from None


def _resolver(path):
    """What reads the files that a glTF file names: those in its folder, and in folders there."""
    from trimesh.resolvers import FilePathResolver

    class Resolver(FilePathResolver):
        def get(self, name):
            folder = path.parent.resolve()
            file = (folder / urllib.parse.unquote(name)).resolve()
            if not file.is_relative_to(folder):
                raise InputError(f"{path}: names the file {name}, expected one in its own folder; put it there")
            return read_bytes(file)

    return Resolver(str(path))


def _gltf_document(content):
    """The JSON of a glTF or GLB file."""
    if content.startswith(b"glTF"):
        content = content[20 : 20 + int.from_bytes(content[12:16], "little")]  # the first chunk of a GLB is its JSON
    return json.loads(content)


def _materials(document):
    """What a glTF file's JSON says of its materials."""
    materials = document.get("materials", [])
    if not isinstance(materials, list):
        raise ValueError("its materials are no array")
    return materials


def _material_of(geometry, materials):
    """The material that a mesh of trimesh has from _with_bare_materials; {} where it has none."""
    material = getattr(geometry.visual, "material", None)
    return materials[int(material.name)] if materials and material and material.name else {}


def _with_bare_materials(content, document):
    """The file with nothing but their number left of its materials, by which they are found again: trimesh renames
    them, rounds their colours, reads their pictures, and drops them where vertices have colours."""
    bare = dict(document)
    if "materials" in bare:
        bare["materials"] = [{"name": str(i)} for i in range(len(_materials(document)))]
    bare["meshes"] = [mesh | {"primitives": [
        p | {"attributes": {k: v for k, v in p["attributes"].items() if not k.startswith("COLOR_")}}
        for p in mesh["primitives"]]} for mesh in bare.get("meshes", [])]
    text = json.dumps(bare).encode()
    if not content.startswith(b"glTF"):
        return text
    text += b" " * (-len(text) % 4)
    rest = content[20 + int.from_bytes(content[12:16], "little") :]
    sizes = ((20 + len(text) + len(rest)).to_bytes(4, "little"), len(text).to_bytes(4, "little"))
    return content[:8] + sizes[0] + sizes[1] + content[16:20] + text + rest


def _refuse_compression(path, document):
    """Without its decoder a compressed glTF reads as vertices that are all zero."""
    for extension in document.get("extensionsRequired", []):
        if extension in _COMPRESSIONS:
            raise InputError(f"{path}: needs {extension}, which Lobe does not read; "
                             f"export it again without {_COMPRESSIONS[extension]} compression")


def _refuse_cycles(path, document):
    """glTF's nodes are a forest, each below one other at most; trimesh takes what it meets first and is silent."""
    above = {}
    for i, node in enumerate(document.get("nodes", [])):
        for child in node.get("children", []):
            if child in above:
                raise InputError(f"{path}: node {child} hangs below two nodes, {above[child]} and {i}, expected one; "
                                 "export the file again")
            above[child] = i
    nodes = document.get("nodes", [])
    reached, waiting = set(), [i for i in range(len(nodes)) if i not in above]
    while waiting:
        reached.add(node := waiting.pop())
        waiting += nodes[node].get("children", [])
    if lost := set(above) - reached:
        raise InputError(f"{path}: node {min(lost)} hangs below itself, expected a tree; export the file again")


def _refuse_short_text(path, content):
    """Of a PLY file in text, whose elements are lines, trimesh takes what there is."""
    header, _, body = content.partition(b"end_header")
    if not re.search(rb"^format\s+ascii", header, re.M):
        return
    declared = sum(int(count) for count in re.findall(rb"^element\s+\w+\s+(\d+)", header, re.M))
    held = [line for line in body.splitlines() if line.strip()][:declared]
    ends_with_list = re.search(rb"^element\s+\w+\s+\d+\s+property\s+list\b[^\n]*\s*\Z", header, re.M)
    if held and ends_with_list and len(held[-1].split()) <= float(held[-1].split()[0]):
        held.pop()  # cut within its list
    if len(held) < declared:
        raise InputError(f"{path}: is truncated, {len(held)} of the {declared} elements that its header declares are "
                         "there; export or download it again")


def _transformed(geometry, matrix):
    """A mesh of trimesh in the coordinates of the scene; a mirroring transform turns the triangles round."""
    linear, shift = matrix[:3, :3], matrix[:3, 3]
    volume = np.linalg.det(linear)
    given = volume != 0 and "vertex_normals" in geometry._cache  # otherwise trimesh would invent them
    uv = getattr(geometry.visual, "uv", None)
    return Mesh(
        geometry.vertices @ linear.T + shift,
        np.asarray(geometry.faces if volume >= 0 else geometry.faces[:, ::-1]),
        geometry.vertex_normals @ np.linalg.inv(linear) if given else None,
        np.array(uv, dtype=float) if uv is not None else None,
    )


def _joined(parts):
    """One mesh of several. Parts without normals get zeros among parts with them, and so do texture coordinates."""

    def stacked(name, width):
        arrays = [getattr(part, name) for part in parts]
        if all(array is None for array in arrays):
            return None
        return np.concatenate([np.zeros((len(p.vertices), width)) if a is None else a for p, a in zip(parts, arrays)])

    starts = np.cumsum([0] + [len(part.vertices) for part in parts])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts)])
    return Mesh(np.concatenate([part.vertices for part in parts]), faces, stacked("normals", 3), stacked("uv", 2))


def _checked(path, mesh):
    """The mesh without degenerate triangles and unused vertices, with the promises of Mesh; or an InputError."""
    vertices, faces, normals, uv = mesh.vertices, mesh.faces, mesh.normals, mesh.uv
    wrong = faces[(faces < 0) | (faces >= len(vertices))]
    if len(wrong):
        raise InputError(f"{path}: index {wrong[0]} of a triangle is out of range, expected 0 to {len(vertices) - 1}; "
                         "export the mesh again")
    for name, values in (("position", vertices), ("normal", normals), ("texture coordinate", uv)):
        _require_finite(path, name, values)

    used = vertices[np.unique(faces)]
    if np.ptp(used, axis=0).max() == 0:
        raise InputError(f"{path}: has zero extent, all {len(used)} vertices lie in one point; "
                         "export the mesh again, without compression")
    degenerate = _degenerate(vertices, faces)
    faces = faces[~degenerate]
    if len(faces) == 0:
        raise InputError(f"{path}: all {len(degenerate)} triangles have zero area, expected at least one that has not; "
                         "export the mesh again")

    if normals is None and uv is None:
        vertices, faces = _shared(vertices, faces)
    kept, faces = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[kept], faces.reshape(-1, 3).astype(np.uint32)
    normals, uv = (None if values is None else values[kept] for values in (normals, uv))
    if normals is not None or uv is not None:
        normals = _completed(normals, vertices, faces)
    return Mesh(vertices, faces, normals, uv, int(degenerate.sum()))


def _require_finite(path, name, values):
    if values is None:
        return
    with np.errstate(over="ignore"):
        bad = ~np.isfinite(values.astype(np.float32)).all(axis=1)
    if bad.any():
        row = bad.argmax()
        found = ", ".join(f"{x:g}" for x in values[row])
        raise InputError(f"{path}: {name} {row} is ({found}), expected finite float32 numbers; "
                         "repair the mesh and export it again")


def _degenerate(vertices, faces):
    """Which triangles [f] repeat a vertex or have no area."""
    edges = vertices[np.roll(faces, -1, axis=1)] - vertices[faces]
    longest = (edges**2).sum(axis=2).max(axis=1)
    return np.linalg.norm(_crosses(vertices, faces), axis=1) <= SLIVER * longest


def _crosses(vertices, faces):
    """Normals of the triangles [f,3], twice their area long."""
    a, b, c = (vertices[corner] for corner in faces.T)
    return np.cross(b - a, c - a)


def _shared(vertices, faces):
    """The same triangles with the first vertex of each position in place of the others."""
    _, first, position = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    return vertices, first[position.reshape(-1)][faces]


def _completed(normals, vertices, faces):
    """Unit normals: those given, and smooth ones where none is given or it is zero."""
    if normals is None:
        return smooth_normals(vertices, faces)
    zero = ~normals.any(axis=1)
    if zero.any():
        normals = np.where(zero[:, None], smooth_normals(vertices, faces), normals)
    return _unit(normals)


def _unit(vectors):
    vectors = vectors / np.abs(vectors).max(axis=1, keepdims=True)  # the square of a tiny component would be zero
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
