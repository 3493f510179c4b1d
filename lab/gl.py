"""Offscreen OpenGL: contexts, and GLSL functions evaluated over arrays of inputs."""

from __future__ import annotations

import ctypes.util
import re
from dataclasses import dataclass

import numpy as np

from .catalogue import WIDTHS
from .errors import InputError

CONTEXTS = ("egl", "osmesa")
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader")
ROW = 1024  # inputs a texture row
PART = 8  # lights that are summed apart, so that the sum over many rounds no more often than that over a few
MOST_ROWS = 4096  # of a texture: far below what drivers take, and a few of them fit in memory


@dataclass(frozen=True)
class Context:
    """A current OpenGL context. `renderer` is the driver's own name, printed with every figure."""

    name: str
    gl: object  # moderngl.Context
    renderer: str
    version: str

    @property
    def is_hardware(self) -> bool:
        return not any(word in self.renderer.lower() for word in SOFTWARE)

    def __enter__(self):
        self.gl.__enter__()
        return self

    def __exit__(self, *error):
        self.gl.__exit__(*error)

    def draw(self, fragment: str, packed: np.ndarray, rows: int) -> np.ndarray:
        """What a fragment shader of `evaluate` answers for packed inputs [lights, n, width]: float32 [n, 4]."""
        shader = program(self, VERTEX, fragment)
        values = self.drawn(shader, packed, rows)
        shader.release()
        return values

    def drawn(self, shader, packed: np.ndarray, rows: int) -> np.ndarray:
        """As `draw`, by a program that is compiled already."""
        return np.concatenate([_block(self.gl, shader, block, rows) for block in blocks(packed, rows)])


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
    if weights is not None:
        inputs = inputs | {"lobe_weight": weights}
    lights, count = next(iter(inputs.values())).shape[:2]
    rows = min(-(-count // ROW), max(MOST_ROWS // lights, 1))
    packed = np.concatenate(list(inputs.values()), axis=-1)
    values = context.draw(_fragment(source, call, result, inputs, lights, rows), packed, rows)
    return values[:, : WIDTHS[result]]


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


def _block(gl, shader, packed: np.ndarray, rows: int) -> np.ndarray:
    """[n, 4], of at most rows * ROW inputs."""
    lights, count = packed.shape[:2]
    textures = []
    for unit, values in enumerate(texels(packed, rows)):
        texture = gl.texture((ROW, rows * lights), 4, values.tobytes(), dtype="f4")
        texture.filter = (gl.NEAREST, gl.NEAREST)
        texture.use(unit)
        if f"lobe_t_{unit}" in shader:
            shader[f"lobe_t_{unit}"].value = unit
        textures.append(texture)
    target = gl.texture((ROW, rows), 4, dtype="f4")
    frame = gl.framebuffer([target])
    frame.use()
    gl.viewport = (0, 0, ROW, rows)
    array = gl.vertex_array(shader, [])
    array.render(mode=gl.TRIANGLES, vertices=3)
    values = np.frombuffer(target.read(), np.float32).reshape(-1, 4)[:count]
    for thing in (array, frame, target, *textures):
        thing.release()
    return values


def _fragment(source: str, call: str, result: str, inputs: dict[str, np.ndarray], lights: int, rows: int) -> str:
    types, fetches, component = {1: "float", 2: "vec2", 3: "vec3"}, [], 0
    textures = range(-(-sum(values.shape[2] for values in inputs.values()) // 4))  # four numbers each: OpenGL promises 16
    for i in textures:
        fetches.append(f"vec4 lobe_p_{i} = texelFetch(lobe_t_{i}, lobe_texel, 0);")
    for name, values in inputs.items():
        parts = (f"lobe_p_{i // 4}.{'xyzw'[i % 4]}" for i in range(component, component + values.shape[2]))
        fetches.append(f"{types[values.shape[2]]} {name} = {types[values.shape[2]]}({', '.join(parts)});")
        component += values.shape[2]
    fetches = "\n            ".join(fetches)
    weighted = "lobe_weight * " if "lobe_weight" in inputs else ""
    extensions = re.findall(r"^#extension.*\n", source, re.M)  # they come before all else
    return f"""#version 330
{"".join(extensions)}{"".join(f"uniform sampler2D lobe_t_{i};{chr(10)}" for i in textures)}out vec4 lobe_out;
{re.sub(r"^#extension.*$", "", source, flags=re.M)}
#line 1
void main() {{
    vec3 lobe_sum = vec3(0.0);
    for (int lobe_part = 0; lobe_part < {lights}; lobe_part += {PART}) {{
        vec3 lobe_subtotal = vec3(0.0);
        for (int lobe_light = lobe_part; lobe_light < min(lobe_part + {PART}, {lights}); ++lobe_light) {{
            ivec2 lobe_texel = ivec2(gl_FragCoord.x, int(gl_FragCoord.y) + lobe_light * {rows});
            {fetches}
            lobe_subtotal += {weighted}{widened(call, result)};
        }}
        lobe_sum += lobe_subtotal;
    }}
    lobe_out = vec4(lobe_sum, 1.0);
}}
"""
