"""Other libraries' functions: how their GLSL is found, what is taken of it, and what is said of them.

What needs their packages runs where they are in the cache, or with --full.
"""

import hashlib
import io
import json
import re
import tarfile
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from lobe.lab import catalogue, geometry, gl, packages, peers
from lobe.lab import peers_exact as exactly
from lobe.lab import peers_measured as measured
from lobe.lab import peers_page
from lobe.lab.errors import InputError
from lobe.lab.packages import Package

# Three small libraries, each in the form of one that we read.
GUARDED = {
    "light/pow5.glsl": "#ifndef FNC_POW5\n#define FNC_POW5\n"
                       "float pow5(float v) { float s = v * v; return s * s * v; }\n#endif",
    "light/common/edge.glsl": '#include "../pow5.glsl"\n#ifndef FNC_EDGE\n#define FNC_EDGE\n'
                              "vec3 edge(vec3 f0, float c) { return f0 + (1.0 - f0) * pow5(1.0 - c); }\n"
                              "float edge(float f0, float c) { return f0 + (1.0 - f0) * pow5(1.0 - c); }\n#endif",
    "light/all.glsl": '#include "pow5.glsl"\n#include "common/edge.glsl"\n#if defined(MOBILE)\n'
                      "#define most(V) min(V, 2.0)\n#else\n#define most(V) V\n#endif\n"
                      "float peak(float a) { return most(1.0 / a); }\n",
}
SCRIPTS = {
    "chunks/common.glsl.js": "export default /* glsl */`\n#define sq( x ) ( ( x ) * ( x ) )\n`;\n",
    "chunks/lobe.glsl.js": "export default /* glsl */`\n#include <common>\nstruct Matter { float width; };\n"
                           "uniform sampler2D table;\n"
                           "float looked( const in float x ) { return texture( table, vec2( x ) ).r; }\n"
                           "float D( const in Matter m, const in float c ) { return sq( m.width ) * c; }\n`;\n",
}
TOKENS = {
    "lib/maths.glsl": "float square(float x) { return x * x; }\n",
    "lib/terms.glsl": '#include "maths.glsl"\nfloat D(float c, float a) { return square(a) / square(c); }\n'
                      "float looked(float c) { return texture($table, vec2(c)).r; }\n",
    "node.glsl": '#include "lib/terms.glsl"\n#include "lib/maths.glsl"\n'
                 "float node(float c) { return D(c, 0.5) * square(c); }\n",
}


def refusal(call, *arguments):
    with pytest.raises(InputError) as error:
        call(*arguments)
    assert "\n" not in str(error.value)
    return str(error.value)


def names(glsl):
    return [name for name, _ in packages.declarations(glsl)]


def test_guarded_includes_settings_and_overloads():
    text = packages.included(GUARDED, "light/all.glsl")
    needed = packages.needed(packages.preprocessed(text), "edge(f0, c)")
    assert names(needed) == ["pow5", "edge", "edge"]
    assert "min(" not in packages.needed(packages.preprocessed(text), "peak(a)")
    assert "min(" in packages.needed(packages.preprocessed(text, ("MOBILE 1",)), "peak(a)")


def test_chunks_of_scripts():
    chunks = packages.chunks(SCRIPTS)
    needed = packages.needed(packages.preprocessed(packages.included(chunks, "lobe")), "D(m, c)")
    assert names(needed) == ["Matter", "D"], "neither the texture nor what looks it up"
    assert "sq" not in needed
    assert "computes its GLSL" in refusal(packages.chunks, {"x.glsl.js": "export default `float a = ${ 1 + 1 };`"})


def test_tokens_and_files_without_guards():
    text = packages.tokens_replaced(packages.joined(TOKENS, ["node.glsl", "lib/maths.glsl"]), {"table": "albedo"})
    assert "texture(albedo" in text
    needed = packages.needed(packages.preprocessed(text), "node(c)")
    assert names(needed) == ["square", "D", "node"], "each file once"


def test_missing_include_is_named():
    assert "includes gone.glsl" in refusal(packages.included, {"a/b.glsl": '#include "gone.glsl"\n'}, "a/b.glsl")
    assert "no such file" in refusal(packages.included, {}, "a/b.glsl")


def test_what_is_taken_compiles_and_is_right():
    """The chunk's struct, macro and function through the same door as a user's shader."""
    text = packages.preprocessed(packages.included(packages.chunks(SCRIPTS), "lobe"))
    source = packages.needed(text, "D(Matter(a), c)")
    context = gl.create_context("egl")
    inputs = {"a": np.full((1, 3, 1), 0.5, np.float32), "c": np.float32([[[0.0], [1.0], [2.0]]])}
    with context:
        assert gl.evaluate(context, source, "D(Matter(a), c)", "float", inputs)[:, 0].tolist() == [0.0, 0.25, 0.5]


def archive(texts):
    data = io.BytesIO()
    with tarfile.open(fileobj=data, mode="w:gz") as tar:
        for name, text in texts.items():
            member = tarfile.TarInfo(f"package/{name}")
            member.size = len(text.encode())
            tar.addfile(member, io.BytesIO(text.encode()))
    return data.getvalue()


def wheel(texts):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as file:
        for name, text in texts.items():
            file.writestr(name, text)
    return data.getvalue()


@pytest.fixture
def cached(tmp_path, monkeypatch):
    """Puts a package into a fresh cache, behind a registry that does not answer."""
    monkeypatch.setenv("LOBE_CACHE", str(tmp_path))
    monkeypatch.setenv("npm_config_registry", "http://127.0.0.1:9")
    monkeypatch.setenv("PIP_INDEX_URL", "http://127.0.0.1:9/simple")
    monkeypatch.setenv("PIP_RETRIES", "0")
    monkeypatch.delenv("PIP_FIND_LINKS", raising=False)

    def put(data, wheel_tag=None, sha256=None):
        name = f"p{hashlib.sha256(data).hexdigest()[:8]}"
        found = hashlib.sha256(data).hexdigest()
        package = Package(name, "1.0", f"{name}-1.0.bin", sha256 or found, "MIT", "", wheel_tag)
        path = packages.path_of(package)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        return package

    return put


def test_cached_packages_need_no_network(cached):
    assert packages.texts(cached(archive(GUARDED)), ".glsl") == GUARDED
    assert packages.texts(cached(wheel(TOKENS), ("3.11", "any")), ".glsl") == TOKENS


def test_another_file_than_the_pinned_one_is_refused(cached):
    package = cached(archive(GUARDED), sha256="0" * 64)
    assert "expected 000000000000" in refusal(packages.content, package)


def test_damaged_archive(cached):
    assert "damaged archive" in refusal(packages.texts, cached(b"no archive"), ".glsl")


@pytest.mark.parametrize("wheel_tag", [None, ("3.11", "manylinux_2_28_x86_64")])
def test_no_network_is_one_line(cached, wheel_tag):
    package = cached(archive(TOKENS), wheel_tag)
    packages.path_of(package).unlink()
    message = refusal(packages.content, package)
    assert "cannot be fetched" in message and str(packages.path_of(package).parent) in message
    assert not any(packages.path_of(package).parent.iterdir()), "nothing half"


# The table of members.

ALL = peers.members()


@pytest.mark.parametrize("peer", ALL, ids=lambda p: p.label)
def test_members_name_functions_and_parameters_that_exist(peer):
    (function,) = catalogue.load().find(peer.like)
    inputs = measured.inputs_of(peer, 16)
    free = set(re.findall(r"\b[A-Za-z_]\w*\b(?!\s*\()", peer.call)) - inputs.keys() - {"x", "xy", "yx"}
    assert not free, "the call uses what is no input"
    assert bool(peer.factor) == (peer.units not in ("", "f"))
    assert {n for n, _, _ in peer.narrowed} <= {p.name for p in function.parameters}
    exact = measured.exact_values(peer, inputs)
    assert exact.shape == (16, catalogue.WIDTHS[function.result]) and np.isfinite(exact).all()


def test_labels_are_unique():
    assert len({p.label for p in ALL}) == len(ALL)


def test_exact_values_of_what_we_have_no_function_of():
    """At chosen angles, by hand."""
    N = np.array([[[0.0, 0.0, 1.0]]])
    tilted = np.array([[[0.6, 0.0, 0.8]]])
    x = {"N": N, "V": tilted, "L": tilted, "albedo": np.full((1, 1, 3), 0.5), "roughness": np.full((1, 1, 1), 0.75)}
    assert exactly.burley(x) == pytest.approx(0.5 / np.pi * (1 + 1.0 * 0.2**5) ** 2, rel=1e-12)
    x = {"NdotH": np.array([[[0.5]]]), "exponent": np.array([[[9.0]]])}
    assert exactly.gaussian(x) == pytest.approx(np.exp(-4.5 * (np.pi / 3) ** 2), rel=1e-12)
    assert exactly.power_schlick(x) == pytest.approx(0.5 / (9 - 8 * 0.5), rel=1e-12)
    x = {"N": N, "V": N, "L": N, "rs": np.full((1, 1, 3), 0.04), "exponent": np.full((1, 1, 1), 6.0)}
    assert exactly.implicit_blinn_phong(x) == pytest.approx(0.04 / np.pi, rel=1e-2)  # exp2 leaves 2^-12.5 of 0.96 at 0


def test_highlights_are_where_the_lobe_is():
    """Half vectors follow D: half of them within tan = alpha of the normal. 30 % of the views graze."""
    x = measured.highlights(20000, seed=5)
    H = geometry.normalize(x["V"].astype(float) + x["L"])
    cosine = geometry.dot(x["N"], H)
    narrow = x["alpha"] < 0.1  # wider ones lose half vectors whose light is below the horizon
    within = (np.sqrt(1 - np.minimum(cosine, 1) ** 2) / cosine < x["alpha"])[narrow]
    assert abs(within.mean() - 0.5) < 0.03
    assert 0.25 < (geometry.dot(x["N"], x["V"]) < 0.1).mean() < 0.4


def test_ours_are_right_by_the_same_measure():
    context = gl.create_context("egl")
    for key, family, most in (("lobe_F_Schlick(float,vec3)", "fresnel", 1e-6), ("lobe_V_GGX", "masking", 1e-6),
                              ("lobe_DFG_GGX", "albedo", 1.5e-3)):
        ours = peers.ours(key, family)
        found = measured.error(ours, context, measured.inputs_of(ours, 2048))
        assert found["nonfinite"] == 0 and found["rms"] < most
    wrong = replace(peers.ours("lobe_V_GGX"), call="2.0 * lobe_V_GGX(NdotV, NdotL, alpha)")
    assert measured.error(wrong, context)["off"] == 1.0


@pytest.mark.parametrize("name, most", [("lobe_Lambert", 1.0), ("lobe_OrenNayar_qualitative", 1.0152),
                                        ("lobe_OrenNayar_EON", 1.0)])
def test_white_albedo_of_ours(name, most):
    """What the headers state; 64 x 64 directions see it within 1 %."""
    assert measured.white(peers.ours(name, "diffuse"), gl.create_context("egl")) == pytest.approx(most, abs=0.01)


def test_divisor_guards_are_taken_out():
    source = "float f(float a) { return 1.0 / max(a * max(a, LOBE_SMALLEST_DIVISOR), LOBE_SMALLEST_DIVISOR); }"
    assert measured.without_divisor_guards(source) == "float f(float a) { return 1.0 / (a * (a)); }"
    freed = measured.weighed_alike(peers.ours("lobe_V_GGX_aniso")).source
    assert "max(" not in freed and "0.5 / (dot(c, g.yx))" in freed


def test_clamps_are_taken_out():
    source = "float f = clamp(min(a, b), 0.0, max(x, 1.0)) + clamp(clamp(y, 0.0, 1.0), g(0.0, 1.0), 1.0);"
    assert measured.without_clamps(source) == "float f = (min(a, b)) + ((y));"


@pytest.mark.parametrize("key", [f.key for f in catalogue.load().functions if f.name in ("lobe_GGX", "lobe_GGX_fast")])
def test_grey_lobes_have_no_horizon_rule(key):
    """The one place where this knows how a file of glsl/ is written."""
    ours = peers.ours(key, "specular")
    source = measured.weighed_grey(ours).source
    lobe = source[source.index(f"vec3 {ours.function.name}(") :]
    assert source != ours.source and "return vec3(0.0)" not in lobe and ": 0.0;" not in lobe


REPAIR = "repair: .venv/bin/python benchmarks/peers.py"


def test_what_was_measured_is_what_stands_here():
    """Our code, and what we put around a peer's; the packages by their versions."""
    stored = json.loads(peers_page.RESULTS.read_text(encoding="utf-8"))
    known = {(row["origin"], row["function"]): row.get("stamp") for row in stored["results"]}
    ours = {o.function.key: o for p in ALL for o in peers.rivals(p)}.values()
    now = {(p.origin, p.name): measured.stamp(p) for p in (*ours, *ALL)}
    assert not {key for key in now.keys() | known.keys() if now.get(key) != known.get(key)}, REPAIR
    assert {name: p["version"] for name, p in stored["packages"].items()} == {
        name: p.version for name, p in peers.PACKAGES.items()}, REPAIR


def test_stamp_sees_a_peers_setting_and_call():
    peer = ALL[0]
    assert measured.stamp(peer) != measured.stamp(replace(peer, call=peer.call + " * 2.0"))
    assert measured.stamp(peer) != measured.stamp(replace(peer, setting=("X 1",)))
    assert measured.stamp(peers.ours("lobe_V_GGX")) != measured.stamp(peers.ours("lobe_V_GGX_fast"))


def test_page_is_up_to_date():
    text = peers_page.PAGE.read_text(encoding="utf-8")
    assert peers_page.generated(text) == text, "repair: .venv/bin/python -m lobe.lab.peers_page"


# With the real packages.

def real(test):
    filled = all(packages.is_cached(p) for p in peers.PACKAGES.values())
    return test if filled else pytest.mark.full(test)


@real
def test_every_member_compiles_and_is_judged():
    context = gl.create_context("egl")
    wrong = set()
    for peer in ALL:
        shader = peer.shader()
        assert "#include" not in shader.source and "$" not in shader.source
        found = measured.error(peer, context, measured.inputs_of(peer, 2048))
        if found["off"] > measured.MOST_OFF:
            wrong.add(peer.label)
        guarded = measured.guarded(peer)
        assert np.isfinite(measured.error(guarded, context, measured.inputs_of(guarded, 256))["rms"]), peer.label
    assert {"LYGIA diffuseOrenNayar", "LYGIA schlick(vec3,float,float), any f90", "LYGIA envBRDFApprox"} <= wrong
    assert measured.white(next(p for p in ALL if p.name == "diffuseOrenNayar"), context) > 2.2
    assert not wrong & {"LYGIA kelemen", "three.js D_GGX", "MaterialX mx_fresnel_dielectric", "MaterialX mx_ggx_NDF"}
