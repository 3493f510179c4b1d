"""What a GLSL call costs in compiled AMD machine code, without a GPU: python -m lobe.lab.isa lobe_GGX lobe_V_GGX.

The cost is that of a shader with the call minus that of the same shader returning the sum of its inputs. Inputs differ
from pixel to pixel, all three channels are stored, early returns are compiled as selects and loops are unrolled: what
the compiler's statistics say of branches and loops is a guess. Where a branch is left the cost says so.

Two shaders ask: `fragment`, whose inputs are interpolated (nothing waits, so that the figures count work), and
`compute`, whose inputs come from a buffer. There the driver's model hides up to some 40 cycles behind the memory, so
that a term of five instructions seems to cost one cycle; it serves to compare with figures that others took that way.

Inverse throughput is the largest of what the GPU's units are busy for, not their sum: a few transcendental operations
hide behind the unit that interpolates the inputs, and cost next to nothing alone. Beside many others they cost all that
they take: a pow alone 4 cycles, beside a chain of square roots 16. Instructions and latency do not hide so.
"""

from __future__ import annotations

import concurrent.futures
import functools
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from . import catalogue, files, gl, paths, radv, spirv
from .bundle import bundle
from .errors import InputError

GPUS = {"NAVI21": "RDNA2", "GFX1100": "RDNA3", "VEGA10": "GCN"}
STAGES = ("fragment", "compute")
COMPONENTS = {"float": 1, "vec2": 2, "vec3": 3, "vec4": 4}

# What `spirv` needs: all functions inlined, one return each, loops unrolled, no local variables.
_TO_SSA = ("--convert-local-access-chains", "--eliminate-local-single-block", "--eliminate-local-single-store",
           "--ssa-rewrite", "--eliminate-dead-code-aggressive")
PASSES = ("--merge-return", "--inline-entry-points-exhaustive", "--eliminate-dead-functions",
          "--scalar-replacement=100", *_TO_SSA, "--loop-unroll", "--eliminate-dead-branches", *_TO_SSA)
UNROLLED = "#extension GL_EXT_control_flow_attributes : enable\n"


@dataclass(frozen=True)
class Call:
    """A GLSL expression to be weighed.

    source   GLSL text that `call` needs, without #version
    call     an expression of type `result`, in which the names of `inputs` are variables
    inputs   name -> type
    """

    source: str
    call: str
    result: str
    inputs: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Cost:
    """Differences between the shader with the call and the one without, but for what is said to be a whole."""

    instructions: int
    code_size: int  # bytes
    inverse_throughput: int  # cycles for which 64 invocations keep one SIMD unit busy
    latency: int  # cycles from start to end
    vgprs: int  # of the whole shader with the call
    branches: int  # of the whole shader with the call; where it is not 0 the other figures are a guess


_NAMES = {"instructions": "Instructions", "code_size": "Code size", "inverse_throughput": "Inverse Throughput",
          "latency": "Latency", "vgprs": "VGPRs", "branches": "Branches"}
_WHOLE = ("vgprs", "branches")


def cost(source: str, call: str, result: str, inputs: dict[str, str], gpu: str = "NAVI21",
         stage: str = "fragment") -> Cost:
    """The cost of one call; see `Call`."""
    return costs([Call(source, call, result, tuple(inputs.items()))], gpu, stage)[0]


def costs(calls: list[Call], gpu: str = "NAVI21", stage: str = "fragment") -> list[Cost]:
    """The costs of many calls, compiled together. A CompileError names the line of `source` that is at fault."""
    if gpu not in GPUS or stage not in STAGES:
        raise InputError(f"{gpu} {stage}: expected a GPU of {', '.join(GPUS)} and a stage of {', '.join(STAGES)}")
    texts = [text for c in calls for text in (shader(c, stage), baseline(c, stage))]
    found = iter(statistics(texts, gpu, stage))
    return [_difference(whole, base) for whole, base in zip(found, found)]


def _difference(whole: dict, base: dict) -> Cost:
    return Cost(**{field: whole[name] - (0 if field in _WHOLE else base[name]) for field, name in _NAMES.items()})


def shader(call: Call, stage: str) -> str:
    """The shader that stores the call's value."""
    source = re.sub(r"\b(for|while)\s*\(", r"[[unroll]] \1 (", gl.version_stripped(call.source))
    return _shader(call.inputs, source, gl.widened(call.call, call.result), stage)


def baseline(call: Call, stage: str) -> str:
    """The same shader without the call: it stores the sum of the inputs."""
    total = " + ".join(gl.widened(name, kind) for name, kind in call.inputs)
    return _shader(call.inputs, "", total or "vec3(0.0)", stage)


def _shader(inputs: tuple[tuple[str, str], ...], source: str, value: str, stage: str) -> str:
    declare, loads, store = {"fragment": _fragment, "compute": _compute}[stage](inputs)
    return (f"#version 450\n{UNROLLED}{declare}#line 1\n{source}\nvoid main() {{\n{loads}"
            f"    vec3 lobe_value = {value};\n    {store}\n}}\n")


def _fragment(inputs):
    declare = "".join(f"layout(location = {i}) in {kind} lobe_in_{name};\n" for i, (name, kind) in enumerate(inputs))
    loads = "".join(f"    {kind} {name} = lobe_in_{name};\n" for name, kind in inputs)
    return declare + "layout(location = 0) out vec4 lobe_out;\n", loads, "lobe_out = vec4(lobe_value, 1.0);"


def _compute(inputs):
    stride = sum(COMPONENTS[kind] for _, kind in inputs)
    loads, first = "", 0
    for name, kind in inputs:
        parts = (f"lobe_in[lobe_i * {stride}u + {first + k}u]" for k in range(COMPONENTS[kind]))
        loads += f"    {kind} {name} = {kind}({', '.join(parts)});\n"
        first += COMPONENTS[kind]
    declare = ("layout(local_size_x = 64) in;\n"
               "layout(std430, binding = 0) readonly buffer lobe_from { float lobe_in[]; };\n"
               "layout(std430, binding = 1) writeonly buffer lobe_to { float lobe_out[]; };\n")
    store = " ".join(f"lobe_out[lobe_i * 3u + {k}u] = lobe_value.{'xyz'[k]};" for k in range(3))
    return declare, "    uint lobe_i = gl_GlobalInvocationID.x;\n" + loads, store


_VERTEX = "#version 450\n" + "".join(
    f"layout(location = {i}) in vec4 a{i};\nlayout(location = {i}) out vec4 v{i};\n" for i in range(radv.MOST_INPUTS)
) + "void main() {\n    gl_Position = a0;\n" + "".join(f"    v{i} = a{i};\n" for i in range(radv.MOST_INPUTS)) + "}\n"


def statistics(texts: list[str], gpu: str, stage: str) -> list[dict[str, int]]:
    """The driver's figures of whole shaders, by the driver's names. Those seen before come from the user's cache."""
    store = paths.cache() / "isa" / f"{gpu}-{hashlib.sha256(toolchain().encode()).hexdigest()[:16]}.json"
    known = json.loads(store.read_text()) if store.is_file() else {}
    keys = [hashlib.sha256(" ".join((stage, *PASSES, text)).encode()).hexdigest() for text in texts]
    new = {key: text for key, text in zip(keys, texts) if key not in known}
    if new:
        known |= dict(zip(new, _compiled(list(new.values()), gpu, stage)))
        files.write_json(store, known)
    return [known[key] for key in keys]


def _compiled(texts: list[str], gpu: str, stage: str) -> list[dict[str, int]]:
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(2) as pool:
        vertex = _spirv(_VERTEX, Path(folder) / "vertex.vert")
        suffix = {"fragment": "frag", "compute": "comp"}[stage]
        shaders = pool.map(_spirv, texts, (Path(folder) / f"{i}.{suffix}" for i in range(len(texts))))
        return _radv(gpu, vertex, list(shaders))[1]


def _spirv(text: str, path: Path) -> Path:
    """The compiled text, without branches where that can be."""
    path.write_text(text)
    raw, flat = path.with_suffix(path.suffix + ".raw"), path.with_suffix(path.suffix + ".spv")
    run = subprocess.run(["glslangValidator", "-V", "--target-env", "spirv1.4", "-o", raw, path], capture_output=True,
                         text=True)
    if run.returncode:
        found = re.search(r"ERROR: .*?:(\d+): (.*)", run.stdout)
        raise InputError(f"a shader does not compile for Vulkan: line {found[1]}: {found[2]}" if found else run.stdout)
    _tool("spirv-opt", *PASSES, raw, "-o", flat)
    try:
        straight = spirv.flattened(_tool("spirv-dis", "--raw-id", flat))
    except spirv.NotFlat:
        return flat
    path.write_text(straight)
    _tool("spirv-as", "--target-env", "spv1.4", path, "-o", flat)
    _tool("spirv-val", flat)
    return flat


def _tool(*command) -> str:
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(f"{command[0]} refuses a shader: {run.stderr.strip()}")
    return run.stdout


def _radv(gpu: str, vertex: Path, shaders: list[Path]) -> tuple[dict[str, str], list[dict[str, int]]]:
    """The driver's name and version, and its figures of each shader."""
    run = subprocess.run([sys.executable, "-m", "lobe.lab.radv", gpu, vertex], input="".join(f"{s}\n" for s in shaders),
                         capture_output=True, text=True)
    if run.returncode:
        raise InputError(f"RADV cannot compile for {gpu} (exit status {run.returncode}): "
                         f"{(run.stderr.strip().splitlines() or ['no message'])[-1]}")
    driver, *found = map(json.loads, run.stdout.splitlines())
    return driver, found


def require_tools() -> None:
    """InputError that names the packages of what is missing."""
    missing = [package for program, package in (("glslangValidator", "glslang-tools"), ("spirv-opt", "spirv-tools"))
               if not shutil.which(program)]
    missing += [] if radv.manifests() else ["mesa-vulkan-drivers"]
    if missing:
        raise InputError("--device isa: the AMD compiler's parts are missing: install "
                         + " ".join((*missing, "libvulkan1")))
    try:
        import vulkan  # noqa: F401
    except (ImportError, OSError):
        raise InputError("--device isa: no Vulkan for Python: install the package libvulkan1, and run "
                         "'pip install vulkan'") from None


@functools.cache
def driver() -> str:
    """Mesa's version, to which stored figures are bound."""
    require_tools()
    with tempfile.TemporaryDirectory() as folder:
        vertex = _spirv(_VERTEX, Path(folder) / "vertex.vert")
        return _radv("NAVI21", vertex, [])[0]["mesa"]


@functools.cache
def toolchain() -> str:
    """All that turns GLSL into figures, with versions."""
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    glslang, tools = (subprocess.run([program, "--version"], **both).stdout.splitlines()[0]
                      for program in ("glslangValidator", "spirv-opt"))
    return f"Mesa {driver()}, glslang {glslang.rpartition(':')[2].strip()}, {' '.join(tools.split()[:2])}"


def main() -> None:
    """Prints a table of the named functions of the library, all overloads, on each GPU."""
    library = catalogue.load()
    functions = [f for name in sys.argv[1:] for f in library.find(name)] or library.functions
    calls = [of(library, f) for f in functions]
    print(toolchain())
    print(f"{'':52s} gpu      cycles  instructions  latency  VGPRs  branches")
    for gpu in GPUS:
        for f, c in zip(functions, costs(calls, gpu)):
            print(f"{f.key:52s} {gpu:8s} {c.inverse_throughput:6d} {c.instructions:13d} {c.latency:8d} {c.vgprs:6d} "
                  f"{c.branches:9d}")


def of(library: catalogue.Catalogue, function: catalogue.Function) -> Call:
    """A function of the library, called with each of its parameters."""
    return Call(bundle(library, [function.key]), function.call, function.result,
                tuple((p.name, p.type) for p in function.parameters))


if __name__ == "__main__":
    main()
