"""Scene files: what is written comes into the scene, and each mistake is told in one line with file, line and key."""

import json
import os
import re

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from lobe.lab import files, meshes, scene_files, scene_page, scene_schema, spectra, toml_lines
from lobe.lab.errors import InputError
from lobe.lab.paths import DATA, ROOT

BASE = """\
[film]
width = 64
height = 36

[camera]
eye = [0.0, 0.0, 5.0]
target = [0.0, 0.0, 0.0]

[environment]
color = 1.0

[materials.clay]
lobes = [{ lobe = "lobe_Lambert", albedo = 0.5 }]

[materials.coated]
lobes = [
    { lobe = "lobe_Lambert", albedo = [0.5, 0.1, 0.1] },
    { lobe = "lobe_GGX", f0 = 0.04, alpha = 0.1 },
]

[[objects]]
shape = "sphere"
material = "coated"

[[objects]]
name = "floor"
shape = "plane"
material = "clay"
scale = 5.0
translate = [0.0, -1.0, 0.0]

[[lights]]
name = "key"
type = "rectangle"
center = [0.0, 4.0, 2.0]
target = [0.0, 0.0, 0.0]
size = [1.0, 1.0]
radiance = [10.0, 9.0, 8.0]
"""
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"


@pytest.fixture
def scene(tmp_path):
    """Writes a scene file, and loads it."""

    def load(text):
        (tmp_path / "s.toml").write_text(text, encoding="utf-8")
        return scene_files.load(tmp_path / "s.toml")

    return load


def refusal(call, *arguments):
    with pytest.raises(InputError) as error:
        call(*arguments)
    assert "\n" not in str(error.value)
    return str(error.value)


def line_of(text, part):
    return text[: text.index(part)].count("\n") + 1


# Lines.


TEXTS = ("'# [x] = {'", '"a\\"] # }"', '"""q""\\" \'"""', "''''x'''", '"""\na = 1\n[b]\n"""', "'''\n# '' ]\n'''", '"""x\\\n  y"""')


@st.composite
def documents(draw):
    """A TOML document in which every number is the line that it stands on."""
    text = ""

    def put(more):
        nonlocal text
        text += more

    def value(depth):
        kind = draw(st.sampled_from(["number", "text", "array", "table"] if depth < 3 else ["number"]))
        if kind == "number":
            put(str(text.count("\n") + 1))
        elif kind == "text":
            put(draw(st.sampled_from(TEXTS)))
        elif kind == "array":
            put("[")
            for _ in range(draw(st.integers(0, 3))):
                put(draw(st.sampled_from(["", " # ] comment\n", "\n\n  "])))
                value(depth + 1)
                put(draw(st.sampled_from([",", " , # [\n"])))
            put("]")
        else:
            put("{")
            for i, key in enumerate(draw(st.lists(st.sampled_from(["p", "q", '"r.s"', "t.u"]), unique=True, max_size=3))):
                put(f"{', ' * (i > 0)}{key} = ")
                value(depth + 1)
            put("}")

    def pairs():
        for key in draw(st.lists(st.sampled_from(["a", "b-c", '"d e"', "'f#'", "g.h", "i . j"]), unique=True, max_size=4)):
            put(f"{key} = ")
            value(0)
            put(draw(st.sampled_from(["\n", " # = [\n", "   \n\n", "\r\n"])))

    pairs()
    for name in draw(st.lists(st.sampled_from(["[k]", "[[l]]", "[l.m]", "[[l.n]]", "[o.p]", '["x y".z]', "[[ q ]]"]), max_size=8)):
        put(name + draw(st.sampled_from(["\n", "# ]\n"])))
        pairs()
    try:
        toml_lines.tomllib.loads(text)
    except toml_lines.tomllib.TOMLDecodeError:  # such as a table that comes twice
        reject()
    return text


def numbers(value, path=()):
    if isinstance(value, dict):
        return [n for k, v in value.items() for n in numbers(v, (*path, k))]
    if isinstance(value, list):
        return [n for i, v in enumerate(value) for n in numbers(v, (*path, i))]
    return [(path, value)] if isinstance(value, int) else []


@given(documents())
@settings(max_examples=150, deadline=None)
def test_every_value_is_found_on_its_line(tmp_path_factory, text):
    path = tmp_path_factory.getbasetemp() / "lines.toml"
    path.write_bytes(text.encode() or b"\n")
    tables, lines = toml_lines.load(path)
    for key, value in numbers(tables):
        assert lines[key] == value, (key, text)


def test_lines_of_tables(tmp_path):
    (tmp_path / "a.toml").write_text("[a]\n[a.b]\nc = 1\n[[d]]\n\n[[d]]\n[d.e]\n[[d.f]]\n\n[[d.f]]\ng = [\n 1,\n 2]\n")
    lines = toml_lines.load(tmp_path / "a.toml")[1]
    assert lines[("a", "b")] == 2 and lines[("d", 0)] == 4 and lines[("d", 1)] == 6 and lines[("d", 1, "e")] == 7
    assert lines[("d", 1, "f", 1)] == 10 and lines[("d", 1, "f", 1, "g", 1)] == 13


# Mistakes.

EXTREME = "9" * 400
MISTAKES = [  # (what is replaced, by what, the line's content that the message must name, its words)
    ("width = 64", "widht = 64", "widht", ["film.widht: unknown key, did you mean width?", "width, height"]),
    ("[film]", "[flim]", "[flim]", ["flim: unknown key, did you mean film?"]),
    ("radiance = [10.0, 9.0, 8.0]", "radience = 1.0", "radience", ["lights[1].radience", "did you mean radiance?"]),
    ("radiance = [10.0, 9.0, 8.0]", "", "[[lights]]", ["lights[1]: has no radiance", "a number or [3 numbers]"]),
    ("width = 64", 'width = "64"', "width", ['film.width: "64", expected a whole number in 1..65536']),
    ("width = 64", "width = 64.0", "width", ["film.width: 64.0, expected a whole number"]),
    ("width = 64", "width = true", "width", ["film.width: true, expected a whole number"]),
    ("width = 64", "width = 0", "width", ["film.width: 0 is out of range, expected a whole number in 1..65536"]),
    ("height = 36", "height = 1000000000", "height", ["film.height: 1000000000 is out of range"]),
    ("eye = [0.0, 0.0, 5.0]", "eye = [0.0, 5.0]", "eye", ["camera.eye: [0.0, 5.0], expected [3 numbers]"]),
    ("eye = [0.0, 0.0, 5.0]", 'eye = [0.0, "a", 5.0]', "eye", ["camera.eye", "expected [3 numbers]"]),
    ("eye = [0.0, 0.0, 5.0]", "eye = [0.0, nan, 5.0]", "eye", ["camera.eye", "out of range"]),
    ("eye = [0.0, 0.0, 5.0]", "eye = [0.0, inf, 5.0]", "eye", ["camera.eye", "out of range"]),
    ("eye = [0.0, 0.0, 5.0]", "eye = 5.0", "eye", ["camera.eye: 5.0, expected [3 numbers]"]),
    ("eye = [0.0, 0.0, 5.0]", f"eye = [0, {EXTREME}, 0]", "eye", ["camera.eye", "out of range"]),
    ("eye = [0.0, 0.0, 5.0]", f"eye = [0, {EXTREME * 20}, 0]", None, ["4300"]),
    ("eye = [0.0, 0.0, 5.0]", "eye = [0, 1979-05-27, 0]", "eye", ["camera.eye", "expected [3 numbers]"]),
    ("eye = [0.0, 0.0, 5.0]", "", "[camera]", ["camera: has no eye"]),
    ("eye = [0.0, 0.0, 5.0]", "eye = [0.0, 0.0, 0.5]", "eye", ["camera.eye: lies inside of sphere"]),
    ("eye = [0.0, 0.0, 5.0]", "eye = [0.0, 0.0, 0.0]", "eye", ["camera.eye: lies inside of sphere"]),
    ("eye = [0.0, 0.0, 5.0]", "eye = [0.0, 0.0, 1.0]", "eye", ["camera.eye: lies on the surface of sphere"]),
    ("eye = [0.0, 0.0, 5.0]", "eye = [2.0, -1.0, 5.0]", "eye", ["camera.eye: lies on the surface of floor"]),
    ("target = [0.0, 0.0, 0.0]\n\n", "target = [0.0, 0.0, 5.0]\n\n", "[camera]", ["camera: ", "eye and target must differ"]),
    ("target = [0.0, 0.0, 0.0]\n\n", "target = [0.0, 0.0, 0.0]\nup = [0, 0, 1]\n\n", "[camera]", ["camera: ", "up must not"]),
    ("target = [0.0, 0.0, 0.0]\n\n", "target = [0.0, 0.0, 0.0]\nfov = 180\n\n", "fov", ["camera.fov", "0.01..179"]),
    ('"lobe_Lambert", albedo = 0.5', '"lobe_Lambret", albedo = 0.5', "lobe_Lambret",
     ["materials.clay.lobes[1].lobe", "did you mean lobe_Lambert?", "./lobe list"]),
    ('"lobe_Lambert", albedo = 0.5', '"lobe_D_GGX"', "lobe_D_GGX", ["lobe_D_GGX", "expected a lobe of N, V, L"]),
    ("f0 = 0.04, alpha = 0.1", "f0 = 0.04, roughness = 0.1", "roughness", ["coated.lobes[2].roughness: unknown key", "alpha"]),
    ("f0 = 0.04, alpha = 0.1", "f0 = 0.04, alpha = 5", "alpha = 5", ["coated.lobes[2].alpha: 5 is out of range", "0.0001..4"]),
    ("f0 = 0.04, alpha = 0.1", "f0 = 1.2, alpha = 0.1", "f0 = 1.2", ["coated.lobes[2].f0: 1.2 is out of range", "in 0.01..1"]),
    ("f0 = 0.04, alpha = 0.1", 'metal = "golf", alpha = 0.1', "golf", ["lobes[2].metal", "did you mean gold?"]),
    ("f0 = 0.04, alpha = 0.1", 'metal = "none.csv", alpha = 0.1', "none.csv", ["lobes[2].metal", "no such file"]),
    ("f0 = 0.04, alpha = 0.1", 'metal = "bad.csv", alpha = 0.1', "bad.csv", ["lobes[2].metal", "bad.csv: line 2"]),
    ('lobes = [{ lobe = "lobe_Lambert", albedo = 0.5 }]', 'mirror = { metal = "bad.csv" }', "bad.csv", ["mirror.metal"]),
    ("f0 = 0.04, alpha = 0.1", 'metal = "gold", f0 = 0.5', "metal", ["lobes[2].f0: is also what metal says"]),
    ("albedo = 0.5 }", 'metal = "gold" }', "metal", ["clay.lobes[1].metal: lobe_Lambert has no f0"]),
    ('lobes = [{ lobe = "lobe_Lambert", albedo = 0.5 }]', "mirror = { f0 = 1.5 }", "mirror", ["mirror.f0", "0..1"]),
    ('lobes = [{ lobe = "lobe_Lambert", albedo = 0.5 }]', "mirror = { eta = 1.5 }", "mirror", ["mirror: expected one of metal"]),
    ('lobes = [{ lobe = "lobe_Lambert", albedo = 0.5 }]', "glass = { eta = 99 }", "glass", ["glass.eta: 99 is out of range"]),
    ('lobes = [{ lobe = "lobe_Lambert", albedo = 0.5 }]', "glass = 1.5", "glass", ["glass: 1.5, expected a table"]),
    ('lobes = [{ lobe = "lobe_Lambert", albedo = 0.5 }]', "lobes = 3", "lobes = 3", ["clay.lobes: 3, expected an array"]),
    ("[materials.clay]", '["materials"."a b"]', "a b", ["materials.a b", "expected a name"]),
    ('material = "coated"', 'material = "caoted"', "caoted", ['objects[1].material: "caoted" is no material, did you mean coated?']),
    ('material = "coated"', "", "[[objects]]", ["objects[1]: has no material, expected material = one of clay, coated"]),
    ('shape = "sphere"', 'shape = "cube"', "cube", ["objects[1].shape", '"mesh", "sphere", "plane", "disc"']),
    ('shape = "sphere"', "", "[[objects]]", ["objects[1]: has no shape"]),
    ('shape = "sphere"', 'shape = "sphere"\nfile = "a.obj"', "file", ["objects[1].file: unknown key"]),
    ('shape = "sphere"', 'shape = "mesh"\nfile = "none.obj"', "file", ["objects[1].file", "none.obj", "no such file"]),
    ('shape = "sphere"', 'shape = "mesh"\nfile = "s.toml"', "file", ["objects[1].file", "ends with '.toml'", ".obj"]),
    ('shape = "sphere"', 'shape = "mesh"\nfile = "bad.obj"', "file", ["objects[1].file", "bad.obj", "line 1"]),
    ('shape = "sphere"', 'shape = "mesh"\nfile = "square.obj"\nscale = 1e7', "scale", ["objects[1].scale", "1e-6..1e6"]),
    ('shape = "sphere"', 'shape = "mesh"\nfile = "huge.obj"', "[[objects]]", ["objects[1]: reaches to 1e+30", "fit"]),
    ('shape = "sphere"', 'shape = "mesh"\nfile = "far.obj"', "[[objects]]", ["objects[1]: is 1 large and 1e+06 away"]),
    *(('shape = "sphere"', f'shape = "{shape}"\nscale = 1e-3\ntranslate = [0, 1e3, 0]', "[[objects]]",
       ["objects[1]: is 0.002 large and 1e+03 away"]) for shape in ("sphere", "plane", "disc")),
    ('shape = "sphere"', 'shape = "sphere"\nscale = [1, 2, 1]', "scale", ["objects[1].scale: a sphere stays round"]),
    ('shape = "sphere"', 'shape = "sphere"\nrotate = [1, 2, 1]', "rotate", ["objects[1].rotate"]),
    ('shape = "sphere"', 'shape = "sphere"\nfit = 0', "fit", ["objects[1].fit: 0 is out of range, expected a number"]),
    ('shape = "sphere"', 'name = "floor"\nshape = "sphere"', 'name = "floor"\nshape = "plane"', ['objects[2].name: "floor" is taken']),
    ("[[objects]]\nshape", "[objects]\nshape", '[[objects]]\nname = "floor"', ["expected TOML"]),
    ('type = "rectangle"', 'type = "rect"', "rect", ["lights[1].type", '"rectangle", "sphere", "point", "directional"']),
    ("size = [1.0, 1.0]", "size = [1.0, 0.0]", "size", ["lights[1].size", "above 0"]),
    ("size = [1.0, 1.0]", "size = [1.0]", "size", ["lights[1].size", "[2 numbers]"]),
    ("radiance = [10.0, 9.0, 8.0]", "radiance = -1", "radiance", ["lights[1].radiance: -1 is out of range"]),
    ('type = "rectangle"\ncenter = [0.0, 4.0, 2.0]\ntarget = [0.0, 0.0, 0.0]\nsize = [1.0, 1.0]\nradiance = [10.0, 9.0, 8.0]',
     'type = "directional"\ndirection = [0, 0, 0]\nirradiance = 1', "[[lights]]", ["lights[1]: ", "null vector"]),
    ("radiance = [10.0, 9.0, 8.0]", "radiance = 0", "[[lights]]", ["lights[1]: shines not at all"]),
    ("target = [0.0, 0.0, 0.0]\nsize", "target = [0.0, 4.0, 2.0]\nsize", "target = [0.0, 4.0, 2.0]", ["lights[1].target"]),
    ("color = 1.0", "", "[environment]", ["environment: expected either file or color"]),
    ("color = 1.0", 'color = 1.0\nfile = "probe.exr"', "[environment]", ["environment: expected either file or color"]),
    ("color = 1.0", "color = 0.0", "[environment]", ["environment: has no energy"]),
    ("color = 1.0", 'file = "none.exr"', "file", ["environment.file", "no such file"]),
    ("color = 1.0", f'file = "{"x" * 5000}.exr"', "file", ["environment.file", "no such file"]),
    ("color = 1.0", 'file = "folder.exr"', "file", ["environment.file", "no such file"]),
    ("color = 1.0", 'file = "text.exr"', "file", ["environment.file", "is not an OpenEXR file"]),
    ("color = 1.0", 'file = "probe.png"', "file", ["environment.file", "ends with '.png'"]),
    ("color = 1.0", 'file = "nan.exr"', "file", ["environment.file", "row 1, column 2 is (nan,", "finite"]),
    ("color = 1.0", 'file = "negative.exr"', "file", ["environment.file", "row 0, column 3 is (1, -1, 1)", "below 0"]),
    ("color = 1.0", 'file = "square.exr"', "file", ["environment.file", "is 8 x 8", "twice as wide as high"]),
    ("color = 1.0", 'file = "grey.exr"', "file", ["environment.file", "channels Y", "expected R, G, B"]),
    ("color = 1.0", 'file = "dark.exr"', "[environment]", ["environment: has no energy"]),
    ("color = 1.0", 'file = "cut.exr"', "file", ["environment.file", "truncated or damaged"]),
    ("color = 1.0", 'file = "absurd.exr"', "file", ["environment.file", "absurd.exr"]),
    ("color = 1.0", 'file = "bright.exr"', "[environment]", ["environment.scale: makes radiance up to 1e+30, expected up to"]),
    ("color = 1.0", 'file = "whole.exr"', "file", ["environment.file", "whole numbers in R, G, B, expected radiance"]),
    ("color = 1.0", 'file = "probe.exr"\nscale = -1', "scale", ["environment.scale: -1 is out of range"]),
    ("color = 1.0", 'file = "bright.exr"\nscale = 1e9', "scale", ["environment.scale: makes radiance up to inf, expected up to 1e+09"]),
    ("[film]\n", "[film]\nlayers = 1\n", "layers", ["film.layers: 1, expected true or false"]),
    ("[film]\n", "[render]\nstrategy = 'both'\n[film]\n", "strategy", ["render.strategy", '"mis", "light", "lobe"']),
    ("[film]\n", "[render]\ndepth = -1\n[film]\n", "depth", ["render.depth: -1 is out of range"]),
    ("[film]\n", "[render]\nspp = 0\n[film]\n", "spp", ["render.spp: 0 is out of range"]),
    ("[film]\nwidth = 64\nheight = 36\n", "film = 3\n", "film", ["film: 3, expected a table"]),
    ("[film]\n", "objects = 3\n[film]\n", '[[objects]]\nshape', ["gives a key, or a table, that is given above"]),
    ("[film]\n", "objects = []\n[film]\n", '[[objects]]\nshape', ["gives a key, or a table, that is given above"]),
    ("[film]\n", "[film\n", "[film", ["expected TOML"]),
    ("width = 64", "width = 64\nwidth = 65", "width = 65", ["gives a key, or a table, that is given above"]),
    ("[film]\n", "x = " + "[" * 5000 + "]" * 5000 + "\n[film]\n", None, ["nests too deeply"]),
]


@pytest.fixture
def inputs(tmp_path):
    """Files that scenes may name."""
    (tmp_path / "square.obj").write_text(SQUARE)
    (tmp_path / "bad.csv").write_text("wavelength_um,n,k\n0.4,a,b\n")
    (tmp_path / "bad.obj").write_text("v 0 0\n")
    (tmp_path / "huge.obj").write_text(SQUARE.replace("1", "1e30").replace("f 1e30", "f 1"))
    (tmp_path / "far.obj").write_text("v 999998 0 0\nv 999999 0 0\nv 999999 1 0\nf 1 2 3\n")
    pixels = np.ones((4, 8, 3), np.float32)

    def picture(name, image, at=None, value=None):
        image = image.copy()
        if at:
            image[at] = value
        files.write_exr(tmp_path / name, {"RGB" if image.ndim == 3 else "Y": image})

    picture("probe.exr", pixels)
    picture("nan.exr", pixels, (1, 2, 0), np.nan)
    picture("negative.exr", pixels, (0, 3, 1), -1)
    picture("square.exr", np.ones((8, 8, 3), np.float32))
    picture("grey.exr", pixels[..., 0])
    picture("dark.exr", 0 * pixels)
    picture("bright.exr", 1e30 * pixels)
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage},
                 {"RGB": pixels.astype(np.uint32)}).write(str(tmp_path / "whole.exr"))
    content = (tmp_path / "probe.exr").read_bytes()
    (tmp_path / "cut.exr").write_bytes(content[:-40])
    window = content.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    absurd = np.array([0, 0, 2**31 - 2, 2**30 - 2], "<i4").tobytes()
    (tmp_path / "absurd.exr").write_bytes(content[:window] + absurd + content[window + 16 :])
    (tmp_path / "folder.exr").mkdir()
    (tmp_path / "text.exr").write_text("no picture")
    (tmp_path / "probe.png").write_bytes(b"\x89PNG")
    return tmp_path


@pytest.mark.parametrize("old, new, line, words", MISTAKES, ids=[f"{i}-{m[3][0][:40]}" for i, m in enumerate(MISTAKES)])
def test_mistake_is_told_with_file_line_and_key(scene, inputs, old, new, line, words):
    assert BASE.count(old) == 1, old
    text = BASE.replace(old, new)
    message = refusal(scene, text)
    place = re.match(r"(.*s\.toml)(?::(\d+))?: ", message)
    assert place and place[1] == str(inputs / "s.toml"), message
    assert line is None or int(place[2]) == line_of(text, line), message
    for word in words:
        assert word in message, message
    assert len(message) < 1200


def test_a_light_and_no_light(scene):
    dark = BASE[: BASE.index("[[lights]]")].replace("[environment]\ncolor = 1.0\n", "")
    assert "s.toml:1: has no light, expected [[lights]] or [environment]" in refusal(scene, dark)


@pytest.mark.parametrize("content, words", [
    (b"\xff\xfe", ["s.toml:1: is no UTF-8 text"]), (b"", ["s.toml: is empty"]), (b"a = 1\n\xff", ["s.toml:2: is no UTF-8"]),
])
def test_what_is_no_text(tmp_path, content, words):
    (tmp_path / "s.toml").write_bytes(content)
    message = refusal(scene_files.load, tmp_path / "s.toml")
    for word in words:
        assert word in message


def test_a_pipe_is_no_scene(tmp_path):
    os.mkfifo(tmp_path / "s.toml")
    assert "is a pipe or a device, expected a file" in refusal(scene_files.load, tmp_path / "s.toml")


def test_given_names_come_before_generated_ones(scene):
    ball = '[[objects]]\nshape = "sphere"\nmaterial = "coated"\ntranslate = [9, 0, 0]\n'
    text = BASE.replace("[[lights]]", ball + ball.replace("shape", 'name = "sphere-3"\nshape') + ball + "[[lights]]")
    assert scene(text).objects == ["sphere", "floor", "sphere-4", "sphere-3", "sphere-5"]


def test_camera_on_a_triangle_is_told(scene, tmp_path):
    (tmp_path / "m.obj").write_text("v 1 0 4\nv 0 1 5\nv -1 0 6\nv -5 -5 5\nf 1 2 3\nf 1 3 4\n")
    text = object_text('shape = "mesh"\nfile = "m.obj"')
    for eye, touches in (([0, 0.5, 5], True), ([0, 0, 5], True), ([0.5, 0.5, 4.5], True), ([0, 0.5, 5.1], False),
                         ([0, 1.1, 5], False), ([0.6, 0.6, 4.4], False)):
        moved = text.replace("eye = [0.0, 0.0, 5.0]", f"eye = {eye}")
        if touches:
            assert "camera.eye: lies on the surface of m" in refusal(scene, moved)
        else:
            scene(moved)


def test_a_byte_order_mark_is_no_mistake(scene):
    assert scene("\ufeff" + BASE).identity == scene(BASE).identity


def test_missing_scene(tmp_path):
    assert "no such file" in refusal(scene_files.load, tmp_path / "none.toml")


@pytest.mark.parametrize("light, inside", [
    ('type = "point"\nposition = [0, 0, 0]\nintensity = 1', True),
    ('type = "point"\nposition = [0, 0, 1.5]\nintensity = 1', False),
    ('type = "sphere"\ncenter = [0.2, 0, 0]\nradius = 0.1\nradiance = 1', True),
    ('type = "rectangle"\ncenter = [0, 0.3, 0]\ntarget = [0, 0, 0]\nsize = [0.1, 0.1]\nradiance = 1', True),
    ('type = "directional"\ndirection = [0, 1, 0]\nirradiance = 1', False),
])
@pytest.mark.parametrize("object_", ['shape = "sphere"', 'shape = "mesh"\nfile = "box.obj"'])
def test_light_inside_of_a_closed_object_is_noted(scene, tmp_path, light, inside, object_):
    import trimesh

    trimesh.creation.box((1.6, 1.6, 1.6)).export(tmp_path / "box.obj")
    text = BASE[: BASE.index("[[lights]]")].replace('shape = "sphere"', object_) + "[[lights]]\n" + light
    notes = scene(text).notes
    assert len(notes) == inside, notes
    if inside:
        assert f"s.toml:{line_of(text, '[[lights]]')}: lights[1]: lies inside of the closed object" in notes[0]


@pytest.mark.parametrize("light", [
    'type = "sphere"\ncenter = [0, -1, 0]\nradius = 0.5\nradiance = 1',  # half outside, its top within
    'type = "sphere"\ncenter = [0.7, 0.1, 0.3]\nradius = 0.5\nradiance = 1',
    'type = "sphere"\ncenter = [0, 0, 0]\nradius = 2\nradiance = 1',  # around the object
    'type = "rectangle"\ncenter = [0, 0.3, 0]\ntarget = [0, 0, 0]\nsize = [1e6, 1e6]\nradiance = 1',
    'type = "rectangle"\ncenter = [0, 0.3, 0]\ntarget = [0, 0, 0]\nsize = [0.1, 3]\nradiance = 1',
])
def test_light_that_gets_out_is_not_noted(scene, light):
    assert scene(BASE[: BASE.index("[[lights]]")] + "[[lights]]\n" + light).notes == []


def test_light_within_glass_is_not_noted(scene):
    text = BASE[: BASE.index("[[lights]]")] + '[[lights]]\ntype = "point"\nposition = [0, 0, 0]\nintensity = 1\n'
    assert len(scene(text).notes) == 1
    coated = text[text.index("[materials.coated]") : text.index("[[objects]]")]
    assert scene(text.replace(coated, "[materials.coated]\nglass = {}\n")).notes == []


@pytest.mark.parametrize("shape", ["plane", "disc"])
@pytest.mark.parametrize("y, flush", [(-1, True), (-0.999, False), (-1.5, False)])
def test_light_in_the_surface_of_an_object_is_noted(scene, shape, y, flush):
    """A ceiling in the plane of its lamp: rays met either, and a box was 13 % too dark with strategy = "lobe"."""
    lamp = f'[[lights]]\ntype = "rectangle"\ncenter = [0.2, {y}, 0.1]\ntarget = [0.2, 2, 0.1]\nsize = [1, 0.5]\nradiance = 1\n'
    notes = scene(BASE[: BASE.index("[[lights]]")].replace('shape = "plane"', f'shape = "{shape}"') + lamp).notes
    assert [("lights[1]: lies in the surface of floor" in note) for note in notes] == [True] * flush


def test_room_around_the_camera_is_no_mistake(scene, tmp_path):
    import trimesh

    room = trimesh.creation.box((20, 20, 20))
    room.invert()
    room.export(tmp_path / "room.obj")
    text = BASE.replace('shape = "sphere"', 'shape = "mesh"\nfile = "room.obj"\nflat = true')
    assert not scene(text).notes
    room.invert()
    room.export(tmp_path / "room.obj")
    assert "camera.eye: lies inside of room" in refusal(scene, text)


def test_unused_material_is_noted(scene):
    text = BASE.replace('material = "coated"', 'material = "clay"')
    assert scene(text).notes == [f"{scene(text).path}:{line_of(text, '[materials.coated]')}: materials.coated: is used by no object"]
    assert not scene(text + "\n[view]\nmode = 'split'\n").notes, "a session's other lobes are its own"


# What comes into the scene.


def seen(scene_file, width=40, height=30):
    return scene_file.scene.trace(scene_file.camera, width, height, shadows=False)


def object_text(body):
    start, end = BASE.index("[[objects]]"), BASE.index("[[lights]]")
    return BASE[:start] + f'[[objects]]\nmaterial = "coated"\n{body}\n' + BASE[end:]


def test_sphere_is_where_it_is_put(scene):
    built = scene(object_text('shape = "sphere"\nscale = 0.5\ntranslate = [0.3, 9, -0.2]\nrest_on = -0.1'))
    images = seen(built)
    hit = images["object"] == 0
    assert hit.any()
    distance = np.linalg.norm(images["position"][hit] - (0.3, 0.4, -0.2), axis=-1)
    np.testing.assert_allclose(distance, 0.5, rtol=1e-12)


@pytest.mark.parametrize("scale, rotate", [("2.0", "[90, 0, 0]"), ("[2.0, 1.0, 0.5]", "[90, 0, 0]"), ("1.0", "[60, 20, 10]")])
@pytest.mark.parametrize("shape", ["plane", "disc"])
def test_flat_shapes_are_turned_and_moved(scene, shape, scale, rotate):
    built = scene(object_text(f'shape = "{shape}"\nscale = {scale}\nrotate = {rotate}\ntranslate = [0.1, 0.2, 0.3]'))
    images = seen(built)
    hit = images["object"] == 0
    assert 20 < hit.sum()
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_euler("xyz", json.loads(rotate), degrees=True).as_matrix()
    local = (images["position"][hit] - (0.1, 0.2, 0.3)) @ turn / np.broadcast_to(json.loads(scale), 3)
    assert np.abs(local[:, 1]).max() < 1e-9
    reach = np.linalg.norm(local, axis=1) if shape == "disc" else np.abs(local).max(axis=1)
    assert reach.max() <= 1 + 1e-9
    np.testing.assert_allclose(images["N"][hit], np.tile(turn[:, 1], (hit.sum(), 1)), atol=1e-9)
    assert np.abs(np.einsum("ij,ij->i", images["N"][hit], images["T"][hit])).max() < 1e-9


def test_grooves_of_a_disc_run_around_its_middle(scene):
    images = seen(scene(object_text('shape = "disc"\nrotate = [90, 0, 0]')))
    hit = (images["object"] == 0) & (np.linalg.norm(images["position"], axis=-1) > 0.1)
    radial = images["position"][hit] / np.linalg.norm(images["position"][hit], axis=-1, keepdims=True)
    assert np.abs(np.einsum("ij,ij->i", radial, images["T"][hit])).max() < 0.01


def test_mesh_is_fitted_scaled_turned_moved_and_put_down(scene, tmp_path):
    (tmp_path / "m.obj").write_text("v 10 0 0\nv 14 0 0\nv 14 2 0\nv 10 2 0\nf 1 2 3 4\n")
    built = scene(object_text('shape = "mesh"\nfile = "m.obj"\nfit = 2.0\nscale = [1, 2, 1]\nrotate = [0, 0, 90]\n'
                              "translate = [0.2, 7, 0]\nrest_on = -1.0"))
    position = seen(built, 200, 200)["position"][seen(built, 200, 200)["object"] == 0]
    low, high = position.min(axis=0), position.max(axis=0)  # 4 x 2 becomes 2 x 1, then 2 x 2, about (0.2, 0, 0)
    np.testing.assert_allclose(low, (-0.8, -1, 0), atol=0.05)
    np.testing.assert_allclose(high, (1.2, 1, 0), atol=0.05)


def test_normals_of_the_file_follow_a_stretched_mesh(scene, tmp_path):
    from scipy.spatial.transform import Rotation

    ball = meshes.uv_sphere(64, 128)
    lines = [f"v {x} {y} {z}\nvn {x} {y} {z}\n" for x, y, z in ball.vertices]
    lines += [f"f {a}//{a} {b}//{b} {c}//{c}\n" for a, b, c in ball.faces + 1]
    (tmp_path / "ball.obj").write_text("".join(lines))
    images = seen(scene(object_text('shape = "mesh"\nfile = "ball.obj"\nscale = [1, 1.3, 0.4]\nrotate = [30, 40, 50]')))
    hit = images["object"] == 0
    turn = Rotation.from_euler("xyz", (30, 40, 50), degrees=True).as_matrix()
    gradient = images["position"][hit] @ turn / np.square((1, 1.3, 0.4)) @ turn.T  # of the ellipsoid
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    assert np.linalg.norm(images["N"][hit] - gradient, axis=1).max() < 0.03


def test_flat_meshes_show_their_facets(scene, tmp_path):
    import trimesh

    trimesh.creation.icosphere(subdivisions=1).export(tmp_path / "ball.ply")
    body = 'shape = "mesh"\nfile = "ball.ply"\nrotate = [10, 20, 30]'
    smooth, flat = seen(scene(object_text(body))), seen(scene(object_text(body + "\nflat = true")))
    facets = {tuple(n) for n in flat["N"][flat["object"] == 0].round(9)}
    assert len(facets) <= 42 < len({tuple(n) for n in smooth["N"][smooth["object"] == 0].round(9)})
    points, normals = flat["position"][flat["object"] == 0], flat["N"][flat["object"] == 0]
    assert (np.einsum("ij,ij->i", points, normals) > 0).all()


def test_metal_fills_what_measured_tables_say(scene, monkeypatch):
    given = []
    real = scene_files._Builder._apply
    monkeypatch.setattr(scene_files._Builder, "_apply", lambda self, m, *a: (given.append(m), real(self, m, *a)))
    copper = DATA / "ior" / "Cu_Johnson.csv"
    for metal in ("copper", str(copper)):
        scene(BASE.replace("f0 = 0.04, alpha = 0.1", f'metal = "{metal}", alpha = 0.1'))
        f0 = given[-2]["lobes"][1][1]["f0"]
        np.testing.assert_allclose(f0, spectra.f0_linear_srgb(copper), atol=1e-4)
    scene(BASE.replace('"lobe_GGX", f0 = 0.04', '"lobe_GGX_conductor", metal = "copper"'))
    eta, k = (np.array(given[-2]["lobes"][1][1][name]) for name in ("eta", "k"))
    np.testing.assert_allclose(((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2), f0, atol=1e-3)


def test_lossy_undershoot_becomes_zero_and_nothing_else_does(tmp_path):
    pixels = np.ones((16, 32, 3), np.float32)
    pixels[3, 4] = 40
    pixels[3, 5] = -0.5
    for compression, refused in ((OpenEXR.B44_COMPRESSION, False), (OpenEXR.ZIP_COMPRESSION, True)):
        path = tmp_path / "p.exr"
        OpenEXR.File({"compression": compression, "type": OpenEXR.scanlineimage}, {"RGB": pixels.astype(np.float16)}).write(str(path))
        if refused:
            assert "no number below 0" in refusal(scene_files.read_environment, path)
        else:
            read = scene_files.read_environment(path)
            assert read.min() == 0 and read.max() > 35
    for name in ("lobby", "studio"):
        assert scene_files.read_environment(DATA / "hdri" / f"{name}.exr").min() == 0


def test_hash_knows_what_a_pixel_depends_on(scene, tmp_path):
    (tmp_path / "m.obj").write_text(SQUARE)
    text = object_text('shape = "mesh"\nfile = "m.obj"')
    first = scene(text).identity
    assert scene("# a comment\n" + text.replace("width = 64", "width = 128")).identity == first
    for old, new in (("alpha = 0.1", "alpha = 0.11"), ("color = 1.0", "color = 1.5"), ("8.0]", "7.0]"),
                     ("eye = [0.0, 0.0, 5.0]", "eye = [0.0, 0.0, 5.5]"), ('"m.obj"', '"m.obj"\nfit = 2')):
        assert scene(text.replace(old, new)).identity != first, new
    (tmp_path / "m.obj").write_text(SQUARE.replace("v 1 1 0", "v 1 1 1"))
    assert scene(text).identity != first


# glTF.


def gltf(tmp_path, materials, /, name="m.glb", **changes):
    """Two triangles, each of a primitive with its own material."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], "<f4").tobytes()
    index = np.array([0, 1, 2, 2, 1, 3], "<u2").tobytes()
    primitives = [{"attributes": {"POSITION": 0, "COLOR_0": 0}, "indices": 1 + i} | ({"material": i} if i < len(materials) else {})
                  for i in range(2)]
    document = {"asset": {"version": "2.0"}, "buffers": [{"byteLength": len(points + index)}],
                "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                              {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
                              {"bufferView": 1, "byteOffset": 6, "componentType": 5123, "count": 3, "type": "SCALAR"}],
                "meshes": [{"primitives": primitives}], "materials": materials,
                "nodes": [{"mesh": 0, "translation": [0, 0, -0.5]}], "scenes": [{"nodes": [0]}], "scene": 0} | changes
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = points + index
    chunks = len(text).to_bytes(4, "little") + b"JSON" + text + len(body).to_bytes(4, "little") + b"BIN\0" + body
    (tmp_path / name).write_bytes(b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks)
    return BASE[: BASE.index("[[objects]]")] + f'[[objects]]\nshape = "mesh"\nfile = "{name}"\n' + BASE[BASE.index("[[lights]]"):]


@pytest.fixture
def applied(monkeypatch):
    """The materials that a scene gives its objects."""
    given = []
    real = scene_files._Builder._apply
    monkeypatch.setattr(scene_files._Builder, "_apply", lambda self, m, *a: (given.append(m), real(self, m, *a)))
    return given


def test_gltf_materials_become_lobes(scene, tmp_path, applied):
    plastic = {"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.2, 0.1, 1], "metallicFactor": 0,
                                                       "roughnessFactor": 0.5}}
    gold = {"name": "gold", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.7, 0.3, 1], "roughnessFactor": 0.3}}
    built = scene(gltf(tmp_path, [plastic, gold]))
    assert built.objects == ["m.1", "m.2"]
    (_, diffuse), (_, coat) = applied[0]["lobes"]
    np.testing.assert_allclose(diffuse["albedo"], np.array([0.8, 0.2, 0.1]) * (1 - (0.04 + 0.96 / 21)))
    np.testing.assert_allclose(coat["f0"], 0.04)
    np.testing.assert_allclose(coat["alpha"], 0.25)
    ((key, metal),) = applied[1]["lobes"]
    assert key.startswith("lobe_GGX(")
    np.testing.assert_allclose(metal["f0"], (1, 0.7, 0.3))
    np.testing.assert_allclose(metal["alpha"], 0.09)
    assert seen(built)["object"].max() == 1


def test_gltf_without_material_is_rough_white_metal(scene, tmp_path, applied):
    scene(gltf(tmp_path, []))
    ((_, metal),) = applied[0]["lobes"]
    assert metal == {"f0": (1, 1, 1), "alpha": (1,)}


def test_gltf_factors_above_one_are_one(scene, tmp_path, applied):
    """A roughness of 5 had become an alpha of 25, where lobe_GGX ends at 4."""
    bright = {"pbrMetallicRoughness": {"baseColorFactor": [2, 0.5, 1, 1], "roughnessFactor": 5, "metallicFactor": 3}}
    notes = scene(gltf(tmp_path, [bright])).notes
    ((_, metal),) = applied[0]["lobes"]
    assert metal == {"f0": (1, 0.5, 1), "alpha": (1,)} and any("above 1" in note for note in notes)


def test_gltf_glass_and_mirror(scene, tmp_path, applied):
    glass = {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.4}},
             "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0}}
    chrome = {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.6, 0.7, 1], "roughnessFactor": 0}}
    assert not [note for note in scene(gltf(tmp_path, [glass, chrome])).notes if "objects" in note]
    assert applied[0]["glass"] == {"eta": 1.4} and not applied[0]["lobes"]
    np.testing.assert_allclose(applied[1]["mirror"]["f0"], (0.5, 0.6, 0.7))


def test_what_gltf_has_and_the_reference_has_not_is_noted_once(scene, tmp_path):
    odd = {"name": "odd", "emissiveFactor": [1, 0, 0], "alphaMode": "BLEND", "doubleSided": True, "normalTexture": {"index": 0},
           "extensions": {"KHR_materials_clearcoat": {}}}
    notes = scene(gltf(tmp_path, [odd, odd])).notes
    for words in ("does not shine", "doubleSided", "opaque", "textures are left out", "KHR_materials_clearcoat is left out"):
        assert sum(words in note for note in notes) == 1, notes
    assert all('objects[1].file: material "odd"' in note for note in notes if "odd" in note)


def test_own_material_replaces_those_of_a_gltf_file(scene, tmp_path, applied):
    text = gltf(tmp_path, [{}]).replace("[[objects]]\n", '[[objects]]\nmaterial = "clay"\n')
    assert scene(text).objects == ["m"] and len(applied) == 1


@pytest.mark.parametrize("changes, words", [
    ({"nodes": [{"mesh": 0, "children": [0]}]}, ["node 0 hangs below itself"]),
    ({"nodes": [{"mesh": 0, "children": [1]}, {"children": [2]}, {"children": [1]}], "scenes": [{"nodes": [0]}]}, ["node 1 hangs below two"]),
    ({"nodes": [{"mesh": 0}, {"children": [2]}, {"children": [1]}]}, ["node 1 hangs below itself"]),
    ({"nodes": [{"mesh": 0, "children": [7]}]}, ["m.glb"]),
    ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": 10**12, "type": "VEC3"}]}, ["m.glb"]),
    ({"materials": [{"pbrMetallicRoughness": {"baseColorFactor": "red"}}, {}]}, ["is no glTF 2 material"]),
    ({"materials": [3, {}]}, ['material "3": is no glTF 2 material']),
    ({"nodes": [{"mesh": 0, "scale": [1e30, 1e30, 1e30]}]}, ["reaches to 1e+30"]),
])
def test_broken_gltf_is_told(scene, tmp_path, changes, words):
    message = refusal(scene, gltf(tmp_path, [{}, {}], **changes))
    assert re.match(r".*s\.toml:\d+: objects\[1\]", message), message
    for word in words:
        assert word in message


# The page.


def test_page_is_up_to_date():
    page = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8")
    assert scene_page.generated(page) == page, "run python -m lobe.lab.scene_page"


def test_every_key_says_what_it_is():
    def keys(kind):
        if isinstance(kind, (scene_schema.List, scene_schema.Named)):
            yield from keys(kind.kind)
        elif isinstance(kind, scene_schema.Table):
            for key in (*kind.keys, *(k for form in kind.forms.values() for k in form)):
                yield key
                yield from keys(key.kind)

    found = [*scene_schema.schema().values(), *(k for key in scene_schema.schema().values() for k in keys(key.kind))]
    assert len(found) > 40
    for key in found:
        assert key.kind.expected and (key.meaning or key.name in ("width", "height", "radius")), key.name


EXAMPLES = sorted((ROOT / "examples" / "scenes").glob("*.toml"))


def test_there_are_six_examples():
    assert len(EXAMPLES) == 6


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_examples_load_without_a_note(path):
    built = scene_files.load(path)
    assert built.notes == [] and (built.film["width"], built.film["height"]) == (1280, 720)
