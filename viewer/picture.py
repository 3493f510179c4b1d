"""The shader's picture of the object: linear float32, drawn again only when something changed, and never in more time
at once than a frame has."""

from __future__ import annotations

import math
import time

import numpy as np

from ..lab import bundle, catalogue, gl, raster, scenes
from . import objects
from .state import MOST_LIGHTS, Lobe, State

MOST_RAYS = scenes.DIRECTIONS + MOST_LIGHTS
BUDGET = 0.018  # seconds of one frame for drawing
NEAR, FAR = (x / np.linalg.norm(scenes.EYE) for x in (0.1, 100.0))  # in distances of eye and target: as raster has them


def projection(state: State, aspect: float) -> np.ndarray:
    """World to clip space."""
    distance = math.dist(state.eye, state.target)
    return raster.projection(state.eye, state.target, state.fov, aspect, NEAR * distance, FAR * distance)


def uniform(i: int, name: str) -> str:
    return f"lobe_p{i}_{name}"


def call(i: int, lobe: Lobe) -> str:
    """The i-th lobe's call in the shader, whose parameters are uniforms."""
    function = lobe.function
    arguments = (p.name if p.is_geometry else uniform(i, p.name) for p in function.parameters)
    return gl.widened(f"{function.name}({', '.join(arguments)})", function.result)


def fragment(lobes: list[Lobe], library: catalogue.Catalogue) -> str:
    """The picture's shader: the bundle of the lobes, under the lights of objects.rays."""
    source = bundle.bundle(library, [lobe.key for lobe in lobes])
    declared = "".join(f"uniform {p.type} {uniform(i, p.name)};\n" for i, lobe in enumerate(lobes)
                       for p in lobe.function.parameters if not p.is_geometry)
    total = " + ".join(call(i, lobe) for i, lobe in enumerate(lobes))
    return f"""#version 330
uniform vec3 lobe_eye;
uniform int lobe_count;
uniform vec4 lobe_light[{MOST_RAYS}];
uniform vec3 lobe_color[{MOST_RAYS}];
{declared}in vec3 lobe_P;
in vec3 lobe_N;
in vec3 lobe_T;
out vec4 lobe_out;
{source}
#line 1
void main() {{
    vec3 N = normalize(lobe_N);
    vec3 T = normalize(lobe_T - N * dot(N, lobe_T));
    vec3 V = normalize(lobe_eye - lobe_P);
    vec3 lobe_sum = vec3(0.0);
    for (int i = 0; i < lobe_count; ++i) {{
        vec3 L = lobe_light[i].xyz - lobe_light[i].w * lobe_P;
        float lobe_r2 = dot(L, L);
        L /= sqrt(lobe_r2);
        vec3 lobe_E = lobe_color[i] / (lobe_light[i].w > 0.0 ? lobe_r2 : 1.0);
        lobe_sum += ({total}) * lobe_E * max(dot(N, L), 0.0);
    }}
    lobe_out = vec4(lobe_sum, float(gl_PrimitiveID + 1));  // so that edges are told from the rest
}}
"""


class Programs:
    """Compiled shaders by the keys of their lobes; the last good one stays where a new one does not compile."""

    def __init__(self, context: gl.Context):
        self._context = context
        self._compiled: dict[tuple[str, ...], object] = {}
        self.library = catalogue.load()
        self.generation = 0  # grows when the library has been read again

    def __getitem__(self, lobes: list[Lobe]):
        """CompileError where the driver refuses it."""
        key = tuple(lobe.key for lobe in lobes)
        if key not in self._compiled:
            self._compiled[key] = gl.program(self._context, raster.VERTEX, fragment(lobes, self.library))
        return self._compiled[key]

    def replace(self, library: catalogue.Catalogue, lists: list[list[Lobe]]) -> None:
        """Takes another library, whose shaders of the given lobes must compile: else CompileError, and all stays."""
        made = {}
        for lobes in lists:
            key = tuple(lobe.key for lobe in lobes)
            made[key] = made.get(key) or gl.program(self._context, raster.VERTEX, fragment(lobes, library))
        for old in self._compiled.values():
            old.release()
        self._compiled, self.library = made, library
        self.generation += 1


class Geometry:
    """The object's buffers, and vertex arrays of them for each program."""

    def __init__(self, device):
        self._device = device
        self._thing = None
        self._buffers: dict = {}
        self._arrays: dict = {}

    def array(self, thing: objects.Thing, program):
        if thing is not self._thing:
            self.release()
            self._thing = thing
            values = {"lobe_position": thing.vertices, "lobe_normal": thing.normals, "lobe_tangent": thing.tangents}
            self._buffers = {name: self._device.buffer(v.astype("f4").tobytes()) for name, v in values.items()}
            self._buffers["indices"] = self._device.buffer(thing.faces.astype("u4").tobytes())
        if program.glo not in self._arrays:
            used = [(b, "3f", name) for name, b in self._buffers.items() if name in program]
            self._arrays[program.glo] = program, self._device.vertex_array(program, used, self._buffers["indices"])
        return self._arrays[program.glo][1]

    def forget_arrays(self) -> None:
        """Of programs that are no more."""
        for _, array in self._arrays.values():
            array.release()
        self._arrays = {}

    def release(self) -> None:
        self.forget_arrays()
        for buffer in self._buffers.values():
            buffer.release()
        self._buffers = {}


class Target:
    """A float texture to draw into, with a depth buffer."""

    def __init__(self, device, size: tuple[int, int]):
        self.size = size
        self.texture = device.texture(size, 4, dtype="f4")
        self.texture.filter = device.NEAREST, device.NEAREST
        self.texture.repeat_x = self.texture.repeat_y = False
        self._depth = device.depth_renderbuffer(size)
        self.frame = device.framebuffer([self.texture], self._depth)

    def release(self) -> None:
        for thing in (self.frame, self.texture, self._depth):
            thing.release()


class Picture:
    """The picture of one list of lobes. `texture` is what is shown; `whole` says whether it has all pixels of the
    size that was asked for."""

    def __init__(self, context: gl.Context, programs: Programs, geometry: Geometry):
        self._device, self._programs, self._geometry = context.gl, programs, geometry
        self._full: Target | None = None
        self._low: Target | None = None
        self._key, self._asked, self._done_rows = None, None, 0
        self._rates: dict = {}  # seconds a pixel and light, by program
        self.seconds = 0.0  # that the last whole picture took
        self.version = 0  # grows with every change of the texture

    @property
    def whole(self) -> bool:
        return self._full is not None and self._done_rows == self._full.size[1]

    @property
    def texture(self):
        return (self._full if self.whole or not self._low else self._low).texture

    @property
    def full(self) -> Target:
        return self._full

    def update(self, state: State, lobes: list[Lobe], size: tuple[int, int]) -> None:
        """Draws what fits into a frame: all of the picture; or, where that takes longer, fewer pixels at once after a
        change, and then rows of the full picture in each frame. CompileError leaves the last picture."""
        program = self._programs[lobes]
        rays = objects.rays(state)
        key = (program, size, state.eye, state.target, state.fov, repr(lobes), rays.vectors.tobytes(),
               rays.colors.tobytes(), state.object, repr(state.placement))
        if self._full is None or self._full.size != size:
            self._resize(size)
        fresh = key != self._key
        if not fresh and self.whole:
            return
        thing = objects.thing(state)
        rate = self._rates.get(program, 0.0)
        work = size[0] * size[1] * max(len(rays.colors), 1)
        if fresh:
            self._key, self._done_rows, self.seconds = key, 0, 0.0
            if rate * work > BUDGET or len(rays.colors) > 8 and not rate:
                self._draw_low(state, lobes, program, rays, thing, size, rate * work)
                return
        rows = size[1] if not rate else int(size[1] * BUDGET / (rate * work)) + 1
        rows = min(max(rows, 8), size[1] - self._done_rows)
        self._draw(self._full, state, lobes, program, rays, thing, (self._done_rows, rows))
        self._done_rows += rows
        self.version += 1

    def _draw_low(self, state, lobes, program, rays, thing, size, expected: float) -> None:
        factor = min(max(math.ceil(math.sqrt(expected / BUDGET)), 2), 8) if expected else 4
        small = max(size[0] // factor, 1), max(size[1] // factor, 1)
        if self._low is None or self._low.size != small:
            if self._low:
                self._low.release()
            self._low = Target(self._device, small)
        self._draw(self._low, state, lobes, program, rays, thing, (0, small[1]))
        self.version += 1

    def _draw(self, target: Target, state, lobes, program, rays, thing, rows: tuple[int, int]) -> None:
        device, (width, height) = self._device, target.size
        started = time.perf_counter()
        program["lobe_projection"].write(projection(state, width / height).T.astype("f4").tobytes())
        self._set(program, "lobe_eye", state.eye)
        for i, lobe in enumerate(lobes):
            for name, value in lobe.values.items():
                self._set(program, uniform(i, name), value if len(value) > 1 else value[0])
        self._set(program, "lobe_count", len(rays.colors))
        self._set_array(program, "lobe_light", rays.vectors, 4)
        self._set_array(program, "lobe_color", rays.colors, 3)
        target.frame.use()
        device.viewport = (0, 0, width, height)
        target.frame.scissor = (0, rows[0], width, rows[1])
        target.frame.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        device.enable_only(device.DEPTH_TEST)
        self._geometry.array(thing, program).render()
        device.enable_only(device.NOTHING)
        target.frame.scissor = None
        device.finish()
        seconds = time.perf_counter() - started
        self.seconds += seconds
        rate = seconds / (width * rows[1] * max(len(rays.colors), 1))
        known = self._rates.get(program)  # the first drawing compiles, too, and says little
        self._rates[program] = rate if known is None else 0.7 * known + 0.3 * min(rate, 4 * known)

    @staticmethod
    def _set(program, name: str, value) -> None:
        if name in program:  # drivers drop what the shader does not use
            program[name].value = value

    @staticmethod
    def _set_array(program, name: str, values: np.ndarray, width: int) -> None:
        if name in program:
            padded = np.zeros((MOST_RAYS, width), "f4")
            padded[: len(values)] = values
            padded[len(values) :, 0] = 1.0
            program[name].write(padded.tobytes())

    def _resize(self, size: tuple[int, int]) -> None:
        self.release()
        self._full, self._low, self._done_rows = Target(self._device, size), None, 0

    def read(self) -> np.ndarray:
        """The whole picture [h, w, 4], row 0 on top."""
        width, height = self._full.size
        return np.frombuffer(self._full.texture.read(), np.float32).reshape(height, width, 4)[::-1]

    def release(self) -> None:
        for target in (self._full, self._low):
            if target:
                target.release()
        self._full = self._low = None
