"""Offscreen OpenGL: contexts, and GLSL functions evaluated over arrays of inputs."""

from __future__ import annotations

import ctypes.util
import re
from collections import OrderedDict
from dataclasses import dataclass, field

import numpy as np

from .catalogue import WIDTHS
from .errors import InputError

CONTEXTS = ("egl", "osmesa")
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader")
ROW = 1024  # inputs a texture row
_TYPES = {width: name for name, width in WIDTHS.items()}
PART = 8  # lights that are summed apart, so that the sum over many rounds no more often than that over a few
MOST_ROWS = 4096  # of a texture: far below what drivers take, and a few of them fit in memory
MANY = 10  # expressions that one program draws, three numbers each, into 8 targets of four: OpenGL promises 8
KEPT = 8  # programs that a context keeps: who evaluates one call over several sets of inputs compiles it once


@dataclass(frozen=True)
class Context:
    """A current OpenGL context. `renderer` is the driver's own name, printed with every figure."""

    name: str
    gl: object  # moderngl.Context
    renderer: str
    version: str
    programs: OrderedDict = field(default_factory=OrderedDict, init=False, repr=False, compare=False)  # by fragment shader

    @property
    def is_hardware(self) -> bool:
        return not any(word in self.renderer.lower() for word in SOFTWARE)

    def __enter__(self):
        self.gl.__enter__()
        return self

    def __exit__(self, *error):
        self.gl.__exit__(*error)

    def evaluate(self, source: str, call: str, result: str, inputs: dict[str, np.ndarray]) -> np.ndarray:
        """What `evaluate` returns; weights are among the inputs."""
        lights, rows, packed = _packed(inputs)
        return self.draw(_fragment(source, call, result, inputs, lights, rows), packed, rows)[:, : WIDTHS[result]]

    def draw(self, fragment: str, packed: np.ndarray, rows: int, outputs: int = 1) -> np.ndarray:
        """What a fragment shader of `evaluate` answers for packed inputs [lights, n, width]: float32 [n, 4 outputs]."""
        return self.drawn(self._program(fragment), packed, rows, outputs)

    def _program(self, fragment: str):
        """The program of a fragment shader, compiled unless it is one of the last KEPT."""
        self.programs[fragment] = self.programs.pop(fragment, None) or program(self, VERTEX, fragment)
        if len(self.programs) > KEPT:
            self.programs.popitem(last=False)[1].release()
        return self.programs[fragment]

    def drawn(self, shader, packed: np.ndarray, rows: int, outputs: int = 1) -> np.ndarray:
        """As `draw`, by a program that is compiled already."""
        return np.concatenate([_block(self.gl, shader, block, rows, outputs) for block in blocks(packed, rows)])


def create_context(name: str) -> Context:
    """A new offscreen context. InputError names the package where a driver is missing."""
    import moderngl

    try:
        gl = {"egl": _egl, "osmesa": _osmesa}[name](moderngl)
    except KeyError:
        raise InputError(f"--context {name}: expected one of {', '.join((*CONTEXTS, 'all'))}") from None
    info = gl.info
    return Context(name, gl, info["GL_RENDERER"], info["GL_VERSION"])


def _egl(moderngl):
    try:
        return moderngl.create_context(standalone=True, backend="egl", require=330)
    except Exception as error:
        raise InputError(f"no EGL context ({error}): install the packages libegl1 and libgl1-mesa-dri") from None


def _osmesa(moderngl):
    if not ctypes.util.find_library("OSMesa"):
        raise InputError("no OSMesa library: install the package libosmesa6, or use --context egl "
                         "(Mesa dropped OSMesa in 25.1, so that newer systems have none)")
    import glfw

    glfw.init_hint(glfw.PLATFORM, glfw.PLATFORM_NULL)
    if not glfw.init():
        raise InputError("GLFW found no null platform: expected GLFW 3.4 or newer, repair with 'pip install -U glfw'")
    for hint, value in ((glfw.VISIBLE, glfw.FALSE), (glfw.CONTEXT_CREATION_API, glfw.OSMESA_CONTEXT_API),
                        (glfw.CONTEXT_VERSION_MAJOR, 3), (glfw.CONTEXT_VERSION_MINOR, 3),
                        (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)):
        glfw.window_hint(hint, value)
    window = glfw.create_window(16, 16, "lobe", None, None)
    if not window:
        raise InputError(f"no OSMesa context ({glfw.get_error()[1]}): install the package libosmesa6")
    glfw.make_context_current(window)
    return moderngl.create_context(context=_GlfwContext(window), require=330)


class _GlfwContext:
    """What moderngl needs of a context that glcontext has no backend for."""

    def __init__(self, window):
        self.window = window

    def load_opengl_function(self, name: str) -> int:
        import glfw

        return ctypes.cast(glfw.get_proc_address(name), ctypes.c_void_p).value or 0

    def __enter__(self):
        import glfw

        self.previous = glfw.get_current_context()
        glfw.make_context_current(self.window)
        return self

    def __exit__(self, *error):
        import glfw

        glfw.make_context_current(self.previous)

    def release(self):
        import glfw

        glfw.destroy_window(self.window)


LINES_A_FILE = 100_000  # a user's file i begins at line i * LINES_A_FILE + 1: source numbers of #line get lost in drivers


class CompileError(Exception):
    """A shader did not compile: the first error's file (0 = ours, from 1 the user's), line in it and message."""

    def __init__(self, log: str):
        found = re.search(r"\d+:(\d+)\(\d+\): error: (.*)", log) or re.search(r"\d+\((\d+)\) : error (.*)", log)
        line, self.message = (int(found[1]), found[2].strip()) if found else (0, " ".join(log.split())[:300])
        self.file, self.line = divmod(line, LINES_A_FILE)
        super().__init__(f"{self.file}:{self.line}: {self.message}")


def numbered(text: str, file: int) -> str:
    """The text of a user's file, without #version, so that a CompileError tells its number and line."""
    return f"#line {file * LINES_A_FILE + 1}\n{version_stripped(text)}\n"


VERTEX = """#version 330
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
    gl_Position = vec4(corner, 0.0, 1.0);
}
"""


def program(context: Context, vertex: str, fragment: str):
    """A linked program. CompileError where the driver refuses it."""
    try:
        return context.gl.program(vertex_shader=vertex, fragment_shader=fragment)
    except Exception as error:  # moderngl raises its own Error type, with the driver's log as text
        raise CompileError(str(error)) from None


def require_compiles(context: Context, source: str) -> None:
    """CompileError where a text of functions does not compile."""
    with context:
        program(context, VERTEX, f"#version 330\nout vec4 lobe_out;\n{source}\nvoid main() {{ lobe_out = vec4(0.0); }}\n").release()


def version_stripped(source: str) -> str:
    """A shader's text without its #version line; line numbers stay."""
    return re.sub(r"^[ \t]*#version.*$", "", source, count=1, flags=re.M)


def widened(expression: str, result: str) -> str:
    """A float, vec2 or vec3 expression as a vec3."""
    return {"float": f"vec3({expression})", "vec2": f"vec3({expression}, 0.0)", "vec3": expression}[result]


def evaluate(context: Context, source: str, call: str, result: str, inputs: dict[str, np.ndarray],
             weights: np.ndarray | None = None) -> np.ndarray:
    """Values of a GLSL expression over rows of inputs, computed by a fragment shader.

    source    GLSL text that `call` needs, without #version
    call      an expression in which the names of `inputs` are variables, of type `result` (float, vec2, vec3)
    inputs    name -> float32 [lights, n, width]; a row is summed over its lights
    weights   float32 [lights, n, 3] by which each light's value is multiplied; None for 1
    returns   float32 [n, width of result]
    """
    return context.evaluate(source, call, result, inputs if weights is None else inputs | {"lobe_weight": weights})


def evaluate_many(context: Context, source: str, calls: list[str], result: str, inputs: dict[str, np.ndarray]) -> np.ndarray:
    """Values of several expressions over the same rows of inputs, of one light, drawn by as few programs as there is room
    for: float32 [calls, n, width of result]."""
    _, rows, packed = _packed(inputs)
    values = []
    for i in range(0, len(calls), MANY):
        part = calls[i : i + MANY]
        drawn = context.draw(_fragment_of_many(source, part, result, inputs), packed, rows, -(-3 * len(part) // 4))
        values += np.split(drawn[:, : 3 * len(part)], len(part), axis=1)
    return np.array(values)[..., : WIDTHS[result]]


def _packed(inputs: dict[str, np.ndarray]) -> tuple[int, int, np.ndarray]:
    """Lights, rows of the textures, and all inputs side by side."""
    lights, count = next(iter(inputs.values())).shape[:2]
    return lights, min(-(-count // ROW), max(MOST_ROWS // lights, 1)), np.concatenate(list(inputs.values()), axis=-1)


def blocks(packed: np.ndarray, rows: int) -> list[np.ndarray]:
    """Inputs [lights, n, width] in parts that one drawing takes."""
    return [packed[:, start : start + rows * ROW] for start in range(0, packed.shape[1], rows * ROW)]


def texels(packed: np.ndarray, rows: int) -> list[np.ndarray]:
    """What the textures hold of one part, four numbers of each input in each: float32 [lights, rows * ROW, 4]."""
    lights, count, width = packed.shape
    filled = np.zeros((-(-width // 4), lights, rows * ROW, 4), np.float32)
    for unit, texture in enumerate(filled):
        part = packed[..., 4 * unit : 4 * unit + 4]
        texture[:, :count, : part.shape[-1]] = part
    return list(filled)


def _block(gl, shader, packed: np.ndarray, rows: int, outputs: int) -> np.ndarray:
    """[n, 4 outputs], of at most rows * ROW inputs."""
    lights, count = packed.shape[:2]
    textures = []
    for unit, values in enumerate(texels(packed, rows)):
        texture = gl.texture((ROW, rows * lights), 4, values.tobytes(), dtype="f4")
        texture.filter = (gl.NEAREST, gl.NEAREST)
        texture.use(unit)
        if f"lobe_t_{unit}" in shader:
            shader[f"lobe_t_{unit}"].value = unit
        textures.append(texture)
    targets = [gl.texture((ROW, rows), 4, dtype="f4") for _ in range(outputs)]
    frame = gl.framebuffer(targets)
    frame.use()
    gl.viewport = (0, 0, ROW, rows)
    array = gl.vertex_array(shader, [])
    array.render(mode=gl.TRIANGLES, vertices=3)
    values = [np.frombuffer(target.read(), np.float32).reshape(-1, 4)[:count] for target in targets]
    for thing in (array, frame, *targets, *textures):
        thing.release()
    return values[0] if outputs == 1 else np.concatenate(values, axis=1)


def _fetches(inputs: dict[str, np.ndarray]) -> tuple[str, str]:
    """GLSL that declares the textures of inputs, and that reads the inputs at lobe_texel."""
    fetches, component = [], 0
    textures = range(-(-sum(values.shape[2] for values in inputs.values()) // 4))  # four numbers each: OpenGL promises 16
    for i in textures:
        fetches.append(f"vec4 lobe_p_{i} = texelFetch(lobe_t_{i}, lobe_texel, 0);")
    for name, values in inputs.items():
        parts = (f"lobe_p_{i // 4}.{'xyzw'[i % 4]}" for i in range(component, component + values.shape[2]))
        fetches.append(f"{_TYPES[values.shape[2]]} {name} = {_TYPES[values.shape[2]]}({', '.join(parts)});")
        component += values.shape[2]
    return "".join(f"uniform sampler2D lobe_t_{i};\n" for i in textures), "\n            ".join(fetches)


def _fragment(source: str, call: str, result: str, inputs: dict[str, np.ndarray], lights: int, rows: int) -> str:
    textures, fetches = _fetches(inputs)
    weighted = "lobe_weight * " if "lobe_weight" in inputs else ""
    extensions = re.findall(r"^#extension.*\n", source, re.M)  # they come before all else
    row = f" + lobe_light * {rows}" if lights > 1 else ""
    return f"""#version 330
{"".join(extensions)}{textures}out vec4 lobe_out;
{re.sub(r"^#extension.*$", "", source, flags=re.M)}
#line 1
void main() {{
    vec3 lobe_sum = vec3(0.0);
    for (int lobe_part = 0; lobe_part < {lights}; lobe_part += {PART}) {{
        vec3 lobe_subtotal = vec3(0.0);
        for (int lobe_light = lobe_part; lobe_light < min(lobe_part + {PART}, {lights}); ++lobe_light) {{
            ivec2 lobe_texel = ivec2(gl_FragCoord.x, int(gl_FragCoord.y){row});
            {fetches}
            lobe_subtotal += {weighted}{widened(call, result)};
        }}
        lobe_sum += lobe_subtotal;
    }}
    lobe_out = vec4(lobe_sum, 1.0);
}}
"""


def _fragment_of_many(source: str, calls: list[str], result: str, inputs: dict[str, np.ndarray]) -> str:
    """Writes the values of the calls one after the other into the channels of the outputs. Each call has its own copy of the
    inputs, of which the compiler cannot know that it is one, and is as wide as where it is drawn alone: else Mesa's compiler
    multiplies in another order, and rounds otherwise."""
    textures, fetches = _fetches({f"lobe_i_{name}": values for name, values in inputs.items()})
    parts = [f"lobe_v_{i}.{c}" for i in range(len(calls)) for c in "xyz"]
    parts += ["0.0"] * (-len(parts) % 4)
    outputs = range(len(parts) // 4)
    declared = "\n".join(f"layout(location = {i}) out vec4 lobe_out_{i};" for i in outputs)
    values = "\n    ".join(f"vec3 lobe_v_{i}; {{ {_copies(inputs, i)} lobe_v_{i} = {widened(call, result)}; }}"
                           for i, call in enumerate(calls))
    written = "\n    ".join(f"lobe_out_{i} = vec4({', '.join(parts[4 * i : 4 * i + 4])});" for i in outputs)
    return f"""#version 330
{textures}uniform int lobe_zero[{len(calls)}];
{declared}
{source}
#line 1
void main() {{
    ivec2 lobe_texel = ivec2(gl_FragCoord.xy);
    {fetches}
    {values}
    {written}
}}
"""


def _copies(inputs: dict[str, np.ndarray], i: int) -> str:
    return " ".join(f"{_TYPES[x.shape[2]]} {name} = intBitsToFloat(floatBitsToInt(lobe_i_{name}) ^ lobe_zero[{i}]);"
                    for name, x in inputs.items())
