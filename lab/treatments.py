"""What can be done to a shader's text before a driver compiles it: `precise` arithmetic, an optimiser's rewriting, and
arithmetic in half precision.

Two are edits over the syntax tree. Half precision is emulated: each operation is followed by a round trip through
packHalf2x16, so that it is that of IEEE 754 binary16 with every result rounded once, to nearest even. Literals are
rounded, too. Of the built-in functions, those that are sums of products round each of their steps; the others, such as
exp, are right to the last digit of a half, which is better than what GPUs promise. A GPU may keep more digits between
operations; none has fewer.
"""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

from .errors import InputError

TOOLS = {"glslangValidator": "glslang-tools", "spirv-opt": "spirv-tools", "spirv-cross": "spirv-cross"}
ARITHMETIC = "+-*/"
ROUNDED = ("sqrt", "inversesqrt", "exp", "exp2", "log", "log2", "pow", "sin", "cos", "tan", "asin", "acos", "atan")
STEPWISE = ("dot", "cross", "length", "normalize", "mix")
EXACT = ("abs", "sign", "min", "max", "clamp", "float", "vec2", "vec3", "vec4", "int", "ivec2", "floor")
SMALLEST_NORMAL_HALF, LARGEST_HALF = 2.0**-14, 65504.0


# --- precise ---------------------------------------------------------------------------------------------------------


@cache
def precise(source: str) -> str:
    """GLSL whose variables and results are all `precise`: no contraction, no reassociation."""
    def rewritten(node, text, inner):
        if node.type == "declaration" and _function(node) is not None:
            return "precise " + text
        if node.type == "return_statement" and node.named_children:
            kind = _text(_function(node).child_by_field_name("type"))
            return f"{{ precise {kind} lobe_returned = {inner(node.named_children[0])}; return lobe_returned; }}"
        return text

    return "#extension GL_ARB_gpu_shader5 : require\n" + _edited(source, rewritten)


# --- an optimiser ----------------------------------------------------------------------------------------------------


@lru_cache(4096)  # three columns ask for the same
def optimised(fragment: str) -> str:
    """A whole fragment shader of `gl.evaluate`, through SPIR-V and its optimiser, and back."""
    with tempfile.TemporaryDirectory() as folder:
        text, code, better = (str(Path(folder) / name) for name in ("shader.frag", "shader.spv", "better.spv"))
        Path(text).write_text(fragment)
        _tool("glslangValidator", "-G", "--auto-map-locations", "--auto-map-bindings", "-o", code, text)
        _tool("spirv-opt", "-O", code, "-o", better)
        return _tool("spirv-cross", "--version", "330", "--no-es", "--no-420pack-extension", better)


def require_tools() -> None:
    """InputError that names the package of a missing tool."""
    for program, package in TOOLS.items():
        if not shutil.which(program):
            raise InputError(f"no {program} here: install the package {package}")


def _tool(*command: str) -> str:
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(f"{command[0]} refuses a shader: {(run.stdout + run.stderr).strip()[:300]}")
    return run.stdout


# --- half precision --------------------------------------------------------------------------------------------------

_HALF = """
float lobe_half(float x) { float h = unpackHalf2x16(packHalf2x16(vec2(x, 0.0))).x; return KEPT(h); }
vec2 lobe_half(vec2 x) { return vec2(lobe_half(x.x), lobe_half(x.y)); }
vec3 lobe_half(vec3 x) { return vec3(lobe_half(x.xy), lobe_half(x.z)); }
float lobe_half_dot(float a, float b) { return lobe_half(a * b); }
float lobe_half_dot(vec2 a, vec2 b) { vec2 p = lobe_half(a * b); return lobe_half(p.x + p.y); }
float lobe_half_dot(vec3 a, vec3 b) { vec3 p = lobe_half(a * b); return lobe_half(lobe_half(p.x + p.y) + p.z); }
vec3 lobe_half_cross(vec3 a, vec3 b) { return lobe_half(lobe_half(a.yzx * b.zxy) - lobe_half(a.zxy * b.yzx)); }
float lobe_half_length(vec2 a) { return lobe_half(sqrt(lobe_half_dot(a, a))); }
float lobe_half_length(vec3 a) { return lobe_half(sqrt(lobe_half_dot(a, a))); }
vec2 lobe_half_normalize(vec2 a) { return lobe_half(a * lobe_half(inversesqrt(lobe_half_dot(a, a)))); }
vec3 lobe_half_normalize(vec3 a) { return lobe_half(a * lobe_half(inversesqrt(lobe_half_dot(a, a)))); }
float lobe_half_mix(float a, float b, float t) {
    return lobe_half(lobe_half(a * lobe_half(1.0 - t)) + lobe_half(b * t));
}
vec2 lobe_half_mix(vec2 a, vec2 b, vec2 t) { return lobe_half(lobe_half(a * lobe_half(1.0 - t)) + lobe_half(b * t)); }
vec2 lobe_half_mix(vec2 a, vec2 b, float t) { return lobe_half_mix(a, b, vec2(t)); }
vec3 lobe_half_mix(vec3 a, vec3 b, vec3 t) { return lobe_half(lobe_half(a * lobe_half(1.0 - t)) + lobe_half(b * t)); }
vec3 lobe_half_mix(vec3 a, vec3 b, float t) { return lobe_half_mix(a, b, vec3(t)); }
"""
_KEPT = {False: "#define KEPT(h) (h)\n", True: "#define KEPT(h) (abs(h) < 6.103515625e-5 ? 0.0 : (h))\n"}


@cache
def half(source: str, flush: bool = False) -> str:
    """GLSL that computes in half precision.

    flush   whether numbers below 2^-14 become 0, as on GPUs without denormal halves
    """
    def rewritten(node, text, inner):
        if node.type == "number_literal" and re.search(r"[.e]", text):
            return _literal(float(text), flush)
        if _function(node) is None:
            return text
        if node.type == "binary_expression" and _text(node.child_by_field_name("operator")) in ARITHMETIC:
            return f"lobe_half({text})"
        if node.type == "assignment_expression" and (operator := _text(node.child_by_field_name("operator"))) != "=":
            left, right = (inner(node.child_by_field_name(side)) for side in ("left", "right"))
            return f"{left} = lobe_half({left} {operator[0]} ({right}))"
        if node.type == "call_expression":
            name = _text(node.child_by_field_name("function"))
            if name in ROUNDED:
                return f"lobe_half({text})"
            if name in STEPWISE:
                return "lobe_half_" + text
            if name not in EXACT and not name.startswith("lobe_"):
                raise NotImplementedError(f"{name} in half precision")
        return text

    packing = "#extension GL_ARB_shading_language_packing : require\n"
    return packing + _KEPT[flush] + _HALF + _edited(source, rewritten)


def halved(x: np.ndarray, flush: bool = False) -> np.ndarray:
    """Numbers rounded to half precision."""
    with np.errstate(over="ignore"):
        h = np.asarray(x).astype(np.float16).astype(np.float32)
    return np.where(np.abs(h) < SMALLEST_NORMAL_HALF, np.float32(0), h) if flush else h


def _literal(x: float, flush: bool) -> str:
    h = float(halved(np.float32(x), flush))
    return "uintBitsToFloat(0x7f800000u)" if np.isinf(h) else repr(h)


# --- syntax trees ----------------------------------------------------------------------------------------------------


@cache
def _parser():
    import tree_sitter
    import tree_sitter_glsl

    language = tree_sitter_glsl.language()
    if isinstance(language, int):  # as grammars gave it before capsules
        capsule = ctypes.pythonapi.PyCapsule_New
        capsule.restype, capsule.argtypes = ctypes.py_object, (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)
        language = capsule(language, b"tree_sitter.Language", None)
    return tree_sitter.Parser(tree_sitter.Language(language))


def _edited(source: str, rewritten: Callable) -> str:
    """The source with each node replaced by `rewritten(node, its text with all in it replaced, inner)`; `inner` gives
    that text of a node in it."""
    code = source.encode()
    tree = _parser().parse(code)
    if tree.root_node.has_error:
        raise InputError("a shader cannot be parsed as GLSL: expected one that compiles")

    def inner(node) -> str:
        parts, end = [], node.start_byte
        for child in node.children:
            parts += [code[end : child.start_byte].decode(), inner(child)]
            end = child.end_byte
        return rewritten(node, "".join(parts) + code[end : node.end_byte].decode(), inner)

    root = tree.root_node
    return code[: root.start_byte].decode() + inner(root) + code[root.end_byte :].decode()


def _text(node) -> str:
    return node.text.decode()


def _function(node):
    """The function in whose body a node stands; None outside of all."""
    while node is not None and node.type != "function_definition":
        node = node.parent
    return node
