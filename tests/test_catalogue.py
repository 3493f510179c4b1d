"""The header grammar: what it reads, and that whatever breaks it is named with file and line."""

import pytest

from lobe.lab import catalogue
from lobe.lab.errors import InputError

CORE = """// The ground.
// needs  nothing
#ifndef LOBE_CORE_GLSL
#define LOBE_CORE_GLSL
#define LOBE_VERSION 100

const float LOBE_HALF = 0.5;  // a half
#endif
"""
HEADER = """// A lobe for tests.
//   f = albedo / 2
// param  albedo  color  0..1      0.5,0.25,1  reflected part
// param  width   float  1e-4..4   0.25        how wide it is [rad]
// reciprocal  yes
// energy      <= 1.5, at grazing
// units       16, a series
// source      Nobody 2000, eq. 1
// Why this form: it is short.
"""
SIGNATURE = "vec3 lobe_Test(vec3 N, vec3 V, vec3 L, vec3 albedo, float width) {"
TEST = f"""// A file for tests.
// needs  core
#ifndef LOBE_CORE_GLSL
#error "test.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_TEST_GLSL
#define LOBE_TEST_GLSL

{HEADER}{SIGNATURE}
    return albedo * LOBE_HALF;
}}

#endif
"""


def read(folder, text, core=CORE):
    (folder / "core.glsl").write_text(core)
    (folder / "test.glsl").write_text(text)
    return catalogue.load.__wrapped__(folder)


def test_reads_every_fact(tmp_path):
    library = read(tmp_path, TEST)
    (f,) = library.functions
    assert [file.stem for file in library.files] == ["core", "test"]
    assert library.constants == {"LOBE_HALF": "const float LOBE_HALF = 0.5;  // a half"}
    assert f.key == "lobe_Test(vec3,vec3,vec3,vec3,float)" and f.kind == "lobe" and f.stem == "test"
    assert f.call == "lobe_Test(N, V, L, albedo, width)"
    assert f.description == "A lobe for tests." and f.formula == ("f = albedo / 2",)
    assert f.notes == ("Why this form: it is short.",)
    assert (f.units, f.units_why, f.energy_bound, f.reciprocal) == (16, "a series", 1.5, "yes")
    albedo, width = f.parameter("albedo"), f.parameter("width")
    assert (albedo.kind, albedo.width, albedo.default) == ("color", 3, (0.5, 0.25, 1.0))
    assert (width.low, width.high, width.default, width.meaning, width.unit) == (1e-4, 4.0, (0.25,), "how wide it is", "rad")
    assert f.parameter("N").kind == "direction" and f.definition.startswith(SIGNATURE)
    assert TEST.splitlines()[f.line - 1] == SIGNATURE


BROKEN = {
    "unknown keyword": ("// source      Nobody", "// sauce      Nobody", "unknown keyword 'sauce'"),
    "missing source": ("// source      Nobody 2000, eq. 1\n", "", "no line 'source"),
    "missing energy": ("// energy      <= 1.5, at grazing\n", "", "no line 'energy"),
    "missing parameter": ("// param  width   float  1e-4..4   0.25        how wide it is [rad]\n", "", "'width' has no line"),
    "unknown parameter": ("param  width ", "param  breadth ", "'width' has no line"),
    "stated twice": ("// reciprocal  yes", "// reciprocal  yes\n// reciprocal  yes", "stated twice"),
    "wrong type": ("albedo  color", "albedo  float", "'albedo' is a vec3"),
    "range upside down": ("1e-4..4 ", "4..1e-4 ", "low < high"),
    "default outside": ("  0.25        how", "  9        how", "a default"),
    "no number": ("1e-4..4 ", "small..4 ", "in numbers"),
    "columns": ("  0.25        how wide it is [rad]", "  0.25", "columns apart"),
    "units without why": ("// units       16, a series", "// units       16", "', why'"),
    "reciprocal": ("reciprocal  yes", "reciprocal  perhaps", "'yes' or 'no, <why>'"),
    "energy": ("<= 1.5, at grazing", "fine", "<= <bound>"),
    "approximates": ("// units       16", "// approximates  lobe_Test  max error small\n// units       16", "absolute|relative"),
    "approximates what is not there": ("// units       16", "// approximates  lobe_Tset  max error 1e-3 absolute\n// units       16",
                                       "test.glsl:15: approximates  lobe_Tset: expected 'exact' or"),
    "prefix": ("vec3 lobe_Test", "vec3 Test", "begins with lobe_"),
    "double underscore": ("vec3 lobe_Test", "vec3 lobe__Test", "double underscore"),
    "no header": (HEADER, "\n", "no header"),
    "blank line below the header": (SIGNATURE, "\n" + SIGNATURE, "no header"),
    "brace": ("\n}\n\n#endif", "\n  }\n\n#endif", "closing brace"),
    "stray code": ("#define LOBE_TEST_GLSL\n", "#define LOBE_TEST_GLSL\nuniform float x;\n", "expected a function"),
    "include": ("#define LOBE_TEST_GLSL\n", '#include "x"\n', "expected a function"),
    "needs": ("// needs  core", "// needs core", "expected '// needs"),
    "needs what is not there": ("// needs  core", "// needs  ore", "no ore.glsl"),
    "needs itself": ("// needs  core", "// needs  core, test", "needs itself"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_header_is_named_with_file_and_line(tmp_path, case):
    old, new, message = BROKEN[case]
    assert old in TEST
    with pytest.raises(InputError, match=r"test\.glsl:\d+: ") as raised:
        read(tmp_path, TEST.replace(old, new, 1))
    assert message in str(raised.value) and "\n" not in str(raised.value)


def test_library_obeys_the_grammar():
    library = catalogue.load()
    assert library.functions
    for f in library.functions:
        assert f.units <= catalogue.MAX_UNITS or len(f.units_why) > 20, f.key
        assert f.kind != "helper" or not f.energy, f.key


@pytest.mark.parametrize("name, meant", [("lobe_GXX", "lobe_GGX"), ("ggx", "lobe_GGX"), ("OrenNayer", "lobe_OrenNayar")])
def test_unknown_function_names_what_may_be_meant(name, meant):
    with pytest.raises(InputError, match=rf"unknown function '{name}', did you mean {meant}\?.*; ./lobe list shows all") as error:
        catalogue.load().find(name)
    assert len(str(error.value)) < 160
