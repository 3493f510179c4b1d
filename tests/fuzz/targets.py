"""What reads files of users, with valid examples and edits of them, and what must be true of whatever comes out.

The one rule: a reader returns a valid result, or raises InputError whose message is a line. It raises and warns of
nothing else, prints nothing, and leaves the folder of its input as it was.
"""

import contextlib
import json
import math
import re
import struct
import warnings
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import mutations
import numpy as np

from lobe.lab import (bundle, catalogue, cli, commands, compare, exr, files, gl, gltf_materials, matrix, meshes,
                      rendering, scene_files, spectra)
from lobe.lab.errors import InputError
from lobe.lab.paths import DATA, GLSL, ROOT

LONGEST = cli.LONGEST_LINE + 10
LARGEST = 1 << 16  # bytes of an input: what is repeated in there shows in less
TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


class Finding(Exception):
    """A result, or a message, that breaks the rule."""


@dataclass(frozen=True)
class Target:
    """
    suffix    of the files
    read      reads the file, and raises Finding where the result is not valid
    edit      one of mutations
    examples  valid inputs
    beside    files in the same folder, by name
    """

    name: str
    suffix: str
    read: object
    edit: object
    examples: object
    beside: object = dict
    prepare: object = field(default=lambda: None)  # what need not be repeated for each input

    def edited(self, content, chance, donors):
        """The input with one to four edits."""
        for _ in range(chance.choice((1, 1, 2, 4))):
            content = self.edit(content, chance, donors)[:LARGEST]
        return content

    def furnish(self, folder):
        for name, content in self.beside().items():
            (folder / name).write_bytes(content)
        self.prepare()

    def check(self, content, folder):
        """Reads one input, and tells whether it was taken. Any exception is a fault."""
        path = folder / f"input{self.suffix}"
        path.write_bytes(content)
        before = sorted(folder.iterdir())
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # else it would stand on the screen beside the one line
            taken = True
            try:
                self.read(path)
            except InputError as error:
                taken = False
                _require_line(cli.line(str(error)))
        if sorted(folder.iterdir()) != before:
            raise Finding(f"leaves {sorted(set(folder.iterdir()) ^ set(before))}")
        return taken


def _require_line(text):
    if not text.isprintable() or not text.strip() or len(text) > LONGEST:
        raise Finding(f"a message that is no line: {text[:200]!r}, {len(text)} characters")


def require(truth, what):
    if not truth:
        raise Finding(f"a result that is not valid: {what}")


# Meshes.


def _read_mesh(path):
    _require_mesh(meshes.load(path))


def _read_gltf(path):
    for part, material in meshes.load_parts(path):
        _require_mesh(part)
        with contextlib.suppress(TypeError, ValueError, AttributeError, OverflowError):  # scene_files refuses it
            _require_material(gltf_materials.translated(material, str))
    _read_mesh(path)


def _require_material(material):
    """Whether the reference takes it."""
    from lobe import reference

    scene = reference.Scene()
    with contextlib.suppress(ValueError):  # told, with the object's place
        scene.set_material(scene.add_sphere((0, 0, 0), 1), material["lobes"],
                           **{name: material[name] for name in ("mirror", "glass") if material[name]})


def _require_mesh(mesh):
    require(mesh.faces.dtype == np.uint32 and mesh.faces.shape[1:] == (3,) and len(mesh.faces), "faces")
    require(mesh.faces.max() < len(mesh.vertices), "indices")
    require(np.isfinite(mesh.vertices.astype(np.float32)).all(), "vertices")
    if mesh.normals is not None:
        require(np.abs(np.linalg.norm(mesh.normals, axis=1) - 1).max() < 1e-6, "normals")
    require(mesh.uv is None or np.isfinite(mesh.uv).all(), "uv")


def _obj_examples():
    cube = [f"v {x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    quads = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    textured = [*cube, "vt 0 0", "vt 1 0", "vt 1 1", "vn 0 0 1", "vn 1 0 0", "o part", "usemtl gold", "s off"]
    return [TRIANGLE, "\n".join([*cube, *(f"f {q}" for q in quads)]).encode(),
            "\n".join([*textured, "f 1/1/1 2/2/1 4/3/2", "f -8//-1 -7//-2 -5//-1", "f 1/1 2/2 \\\n 4/3 3/1"]).encode()]


def _square_mesh():
    import trimesh

    return trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.5)], [(0, 1, 2), (0, 2, 3)], process=False)


def _ply_examples():
    mesh = _square_mesh()
    mesh.vertex_normals
    text, data = (mesh.export(file_type="ply", encoding=kind, vertex_normal=True) for kind in ("ascii", "binary"))
    big = (b"ply\nformat binary_big_endian 1.0\nelement vertex 3\n"
           b"property float x\nproperty float y\nproperty float z\nelement face 1\n"
           b"property list uchar int vertex_indices\nend_header\n"
           + struct.pack(">9fB3i", 0, 0, 0, 1, 0, 0, 0, 1, 0, 3, 0, 1, 2))
    mixed = (b"ply\nformat ascii 1.0\ncomment x\nelement vertex 4\nproperty float x\nproperty double y\n"
             b"property float z\nproperty uchar red\nproperty float s\nproperty float t\nelement face 1\n"
             b"property list uchar int vertex_indices\nend_header\n"
             b"0 0 0 9 0 0\n1 0 0 9 1 0\n1 1 0 9 1 1\n0 1 0 9 0 1\n4 0 1 2 3\n")
    return [text, data, big, mixed]


def _stl_examples():
    return [_square_mesh().export(file_type="stl"), _square_mesh().export(file_type="stl_ascii").encode()]


def _gltf_document():
    """Two primitives under two nodes, with materials of every kind that is read."""
    import base64

    positions = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0.5)], "<f4")
    normals, indices = np.tile(np.array((0, 0, 1), "<f4"), (4, 1)), np.array([0, 1, 2, 1, 3, 2], "<u2")
    data = positions.tobytes() + normals.tobytes() + indices.tobytes()
    views = [(0, 48, 34962), (48, 48, 34962), (96, 12, 34963)]
    material = {"name": "coat", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.2, 0.1, 1], "metallicFactor": 0.5,
                "roughnessFactor": 0.4, "baseColorTexture": {"index": 0}},
                "emissiveFactor": [0, 0, 1], "doubleSided": True, "alphaMode": "BLEND",
                "extensions": {"KHR_materials_ior": {"ior": 1.4},
                "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0.9, 0.8]}}}
    glass = {"pbrMetallicRoughness": {"roughnessFactor": 0, "metallicFactor": 0},
             "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "mode": 4}
    return {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"children": [1], "translation": [0, 1, 0], "rotation": [0, 0, 0, 1], "scale": [1, 2, 1],
                       "mesh": 0},
                      {"mesh": 0, "matrix": [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1]}],
            "meshes": [{"name": "m", "primitives": [primitive | {"material": 0}, primitive | {"material": 1}]}],
            "materials": [material, glass],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0],
                           "max": [1, 1, 0.5]},
                          {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
                          {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR", "byteOffset": 0}],
            "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": size, "target": kind}
                            for start, size, kind in views],
            "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," +
                         base64.b64encode(data).decode()}]}, data


def _gltf_examples():
    document, _ = _gltf_document()
    beside = json.loads(json.dumps(document))
    beside["buffers"][0]["uri"] = "data.bin"
    del beside["nodes"][0]["children"], beside["nodes"][1]
    return [json.dumps(document).encode(), json.dumps(beside).encode()]


def _glb_examples():
    document, data = _gltf_document()
    del document["buffers"][0]["uri"]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    whole = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return [struct.pack("<4sII", b"glTF", 2, 12 + len(whole)) + whole]


# Pictures.


def _read_environment(path):
    pixels = scene_files.read_environment(path)
    require(pixels.dtype == np.float32 and pixels.shape[1] == 2 * pixels.shape[0] and pixels.shape[2] == 3, "shape")
    require(np.isfinite(pixels).all() and pixels.min() >= 0, "radiance")
    files.read_exr(path)


@cache
def _probe():
    return _exr_of(16, 8, "ZIP_COMPRESSION", np.float16)


def _exr_of(width, height, compression, dtype, channels="RGB", kind="scanlineimage", **header):
    import tempfile

    import OpenEXR

    rng = np.random.default_rng(width)
    header |= {"compression": getattr(OpenEXR, compression), "type": getattr(OpenEXR, kind)}
    layers = {channels: rng.random((height, width, max(len(channels), 1))).astype(dtype)}
    if channels == "RGB":
        layers["depth"] = rng.random((height, width)).astype(np.float32)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "p.exr")
        OpenEXR.File(header, layers).write(str(path))
        return path.read_bytes()


@cache
def _exr_examples():
    import tempfile

    compressions = ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB")
    found = [_exr_of(16, 8, f"{c}_COMPRESSION", np.float16 if i % 2 else np.float32, "RGBA" if i % 3 else "RGB")
             for i, c in enumerate(compressions)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "p.exr")
        parts = [exr.Part("beauty", ("R", "G", "B")), exr.Part("samples", ("I",), "uint32")]
        with exr.Writer(path, 8, 4, parts, {"note": "x", "seed": 1}) as writer:
            writer.write(0, np.ones((4, 8, 3), np.float32)), writer.write(1, np.ones((4, 8, 1), np.uint32))
        return [*found, path.read_bytes()]


# Tables.


def _read_table(path):
    table = spectra.read_nk(path)
    require(all(np.isfinite(column).all() and (column >= 0).all() for column in table), "numbers")
    f0 = spectra.f0_linear_srgb(table)
    require(f0.shape == (3,) and np.isfinite(f0).all(), f"f0 {f0}")
    scene_files.scene_schema.measured.__wrapped__(path)


def _csv_examples():
    gold = (DATA / "ior" / "Au_Johnson.csv").read_bytes()
    return [gold, b"wavelength_um,n,k\n0.3,1,0\n0.9,2,1\n",
            b'\xef\xbb\xbf"k", "n", "wavelength_um", note\n3,0.1,0.3,x\n3,0.2,0.9,\n']


# Shaders.


def _read_header(path):
    library = catalogue.load.__wrapped__(path.parent)
    for function in library.functions:
        text = bundle.bundle(library, [function.key], "300es")
        require(text.endswith("\n") and function.definition in text, function.key)
        commands._facts(function)
        commands.overload(library, function.key, function.call)


def _header_beside():
    return {name: (GLSL / name).read_bytes() for name in ("core.glsl", "fresnel.glsl", "masking.glsl")}


def _header_examples():
    return [(GLSL / name).read_bytes() for name in ("lambert.glsl", "beckmann.glsl", "metals.glsl")]


def _read_names(path):
    """The words of `./lobe bundle NAME... --target T`, one a line, the target first."""
    target, *names = path.read_text(errors="surrogateescape").split("\n")
    library = catalogue.load()
    text = bundle.bundle(library, names, target or None)
    require(all(name.partition("(")[0] in text for name in names), "a name that is missing")
    for name in names:
        for function in library.find(name) if name not in library.constants else ():
            require(text.count(function.definition) == 1, f"{function.key}: not there, or not once")


def _names_examples():
    library = catalogue.load()
    names = [f.key if i % 2 else f.name for i, f in enumerate(library.functions)]
    return [f"{target}\n{name}".encode() for target, name in zip(bundle.TARGETS, names)] + [
        "\n".join(["", *names[:20], "LOBE_F0_GOLD"]).encode(), "\n".join(["vulkan", *names[20:]]).encode()]


@cache
def _context():
    return gl.create_context("egl")


def _read_foreign(path):
    """`./lobe compare --glsl FILE --call CALL --against NAME`: the first two lines are CALL and NAME."""
    call, _, rest = path.read_bytes().decode("latin-1").partition("\n")
    against, _, source = rest.partition("\n")
    shader = path.parent / "foreign.glsl"
    shader.write_bytes(source.encode("latin-1"))
    library = catalogue.load()
    function = commands.overload(library, against, call)
    plan = commands.foreign_plan(function, [shader], call, None, {"scenes": ()})
    try:
        result = compare.compare(_case(function), plan.shader_of(function), _context())
    except gl.CompileError as error:
        raise InputError(commands.compile_message(error, [shader], function)) from None
    require(result.row["pixels"] > 0, "pixels")
    files.plain(result.row)


@cache
def _case(function):
    return compare.points_case(function, 16, {}, matrix.SEED)


def _foreign_examples():
    library = catalogue.load()
    own = ("#version 330\n// mine\nvec3 mine(vec3 N, vec3 V, vec3 L, vec3 albedo) {\n"
           "    float c = max(dot(N, L), 0.0);\n    for (int i = 0; i < 4; ++i) c += 0.0 * float(i);\n"
           "    return c > 0.0 && dot(N, V) > 0.0 ? albedo / 3.14159265 : vec3(0.0);\n}\n")
    found = [f"mine(N, V, L, albedo)\nlobe_Lambert\n{own}".encode()]
    for name in ("lobe_D_GGX(vec3,vec3,float)", "lobe_F_Schlick(float,vec3)", "lobe_cosT"):
        (function,) = library.find(name)
        text = bundle.bundle(library, [function.key]).replace("lobe_", "my_").replace("LOBE_", "MY_")
        found.append(f"{function.call.replace('lobe_', 'my_')}\n{function.key}\n{text}".encode())
    return found


# Scenes and their checkpoints.

SCENE = """\
[film]
width = 4
height = 3

[camera]
eye = [0.0, 1.0, 5.0]
target = [0.0, 0.0, 0.0]

[environment]
color = [0.2, 0.3, 0.4]

[materials.coated]
lobes = [{ lobe = "lobe_Lambert", albedo = [0.5, 0.1, 0.1] }, { lobe = "lobe_GGX", f0 = 0.04, alpha = 0.1 }]

[[objects]]
shape = "sphere"
material = "coated"

[[objects]]
name = "floor"
shape = "plane"
material = "coated"
scale = 5.0
rest_on = -1.0

[[lights]]
name = "key"
type = "rectangle"
center = [1.0, 4.0, 2.0]
target = [0.0, 0.0, 0.0]
size = [1.0, 1.0]
radiance = [10.0, 9.0, 8.0]

[[lights]]
type = "sphere"
center = [-3.0, 2.0, 2.0]
radius = 0.5
radiance = 8.0
"""
MORE = """\
[[lights]]
type = "directional"
direction = [0.0, 1.0, 0.0]
irradiance = 1.0

[[lights]]
type = "point"
position = [-3.0, 2.0, 2.0]
intensity = 8.0

[[objects]]
shape = "mesh"
file = "mesh.gltf"
fit = 1.0
rotate = [10.0, 20.0, 30.0]
translate = [0.5, 0.0, 2.0]
flat = true

[[objects]]
shape = "disc"
material = "mirror"
scale = [1.0, 1.0, 2.0]

[materials.mirror]
mirror = { eta = [0.2, 0.9, 1.5], k = [3.0, 2.0, 1.9] }

[materials."unused"]
glass = { eta = 1.5 }
lobes = [{ lobe = "lobe_GGX_conductor", metal = "metal.csv", alpha = 0.2 }]
"""


def _scene_beside():
    return {"probe.exr": _probe(), "mesh.obj": _obj_examples()[1], "mesh.gltf": _gltf_examples()[0],
            "metal.csv": _csv_examples()[1]}


def _scene_examples():
    found = [SCENE, SCENE + MORE]
    for path in sorted((ROOT / "examples" / "scenes").glob("*.toml")):
        text = re.sub(r"\.\./\.\./data/hdri/\w+", "probe", path.read_text())
        text = re.sub(r"\.\./\.\./data/mesh/\w+", "mesh", text)
        found.append(text)
    return [text.encode() for text in found]


def _read_scene(path):
    """Also draws it, 3 x 2 pixels of one path each: whatever a scene file may say can be drawn."""
    scene = scene_files.load(path)
    settings = rendering.settings(scene, None, None, None)
    rendering.require_memory(scene, settings)
    require(rendering.budget(scene, None, None, None), "budget")
    from lobe import reference

    strategy, depth = settings.strategy, min(settings.depth, 16)
    render = reference.Render(scene.scene, scene.camera, 3, 2, depth=depth, roulette=settings.roulette,
                              seed=settings.seed, strategy=strategy, layers=settings.layers,
                              guided=settings.guided, share=settings.share)
    render.advance(1)
    beauty = render.beauty()
    require(np.isfinite(beauty).all() and beauty.min() >= 0, f"beauty {beauty.min()} to {beauty.max()}")
    json.dumps(files.plain(scene.notes))


@cache
def _rendered():
    """A scene, and checkpoints of it by sample count."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "s.toml")
        path.write_text(SCENE)
        scene = scene_files.load(path)
        job = rendering.Rendering(scene, rendering.settings(scene, None, None, None), Path(folder))
        found = []
        for error in (0.0, 0.5):
            job.advance(rendering.Budget(spp=4, error=error), lambda *_: None)
            found.append(job.checkpoint.read_bytes())
        return scene, found


def _read_checkpoint(path):
    scene, _ = _rendered()
    job = rendering.Rendering(scene, rendering.settings(scene, None, None, None), path.parent)
    job.checkpoint = path
    job.resume(rendering.Budget(spp=6, error=1.0))
    require(0 <= job.done <= rendering.MOST_SAMPLES and 0 <= job.seconds < math.inf, f"{job.done} in {job.seconds} s")
    require(job.done == job.render.samples().max(), "samples that the film has not")
    job.render.advance(1)
    require(np.isfinite(job.render.beauty()).all(), "beauty")


TARGETS = {target.name: target for target in (
    Target("scene", ".toml", _read_scene, mutations.text, _scene_examples, _scene_beside),
    Target("obj", ".obj", _read_mesh, mutations.text, _obj_examples),
    Target("ply", ".ply", _read_mesh, mutations.ply, _ply_examples),
    Target("stl", ".stl", _read_mesh, mutations.stl, _stl_examples),
    Target("gltf", ".gltf", _read_gltf, mutations.gltf, _gltf_examples, lambda: {"data.bin": _gltf_document()[1]}),
    Target("glb", ".glb", _read_gltf, mutations.glb, _glb_examples),
    Target("exr", ".exr", _read_environment, mutations.exr, _exr_examples),
    Target("csv", ".csv", _read_table, mutations.text, _csv_examples),
    Target("header", ".glsl", _read_header, mutations.text, _header_examples, _header_beside),
    Target("bundle", ".txt", _read_names, mutations.text, _names_examples),
    Target("foreign", ".txt", _read_foreign, mutations.text, _foreign_examples, lambda: {"foreign.glsl": b""},
           _context),
    Target("checkpoint", ".checkpoint", _read_checkpoint, mutations.checkpoint, lambda: _rendered()[1]),
)}
