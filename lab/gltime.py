"""How long a call takes on an OpenGL device: nanoseconds for one evaluation, from timer queries.

llvmpipe's timer queries see one tile of the picture (0.1 of 8 ms); of software drivers the wall clock is taken instead,
from an idle device to an idle device.

Every invocation evaluates a call many times, so that neither memory nor the raster dominates; all inputs change from
one evaluation to the next, so that nothing is hoisted out of the loop. What is timed is the shader with the call and
the same shader summing its inputs, in turn, each round anew; the time is the median of the rounds' differences.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from . import gl
from .families import Inputs
from .isa import Call

SIDE, EVALUATIONS, ROUNDS = 256, 64, 9
STEP = 1e-6  # by which an input changes from one evaluation to the next: added, whatever the input's size


@dataclass(frozen=True)
class Time:
    """Of one evaluation, ns: the median over rounds, and half of what lies between their quartiles."""

    ns: float
    spread: float


class Stopwatch:
    """Two programs, of the call and of its inputs' sum, ready to be timed."""

    def __init__(self, context: gl.Context, call: Call, inputs: Inputs):
        self.gl, self.is_hardware = context.gl, context.is_hardware
        names = [name for name, _ in call.inputs]
        value = gl.widened(call.call, call.result)
        nothing = " + ".join(gl.widened(name, kind) for name, kind in call.inputs) or "vec3(float(lobe_i))"
        self.programs = [gl.program(context, _VERTEX, _fragment(source, v, call.inputs))
                         for source, v in ((call.source, value), ("", nothing))]
        self.textures = [self._texture(inputs[name]) for name in names]
        for program in self.programs:
            program["lobe_count"].value = EVALUATIONS
            for unit, name in enumerate(names):
                if f"lobe_t_{name}" in program:
                    program[f"lobe_t_{name}"].value = unit
        self.arrays = [self.gl.vertex_array(program, []) for program in self.programs]

    def _texture(self, values: np.ndarray):
        texels = np.zeros((SIDE * SIDE, 4), np.float32)
        texels[:, : values.shape[1]] = np.resize(values, (SIDE * SIDE, values.shape[1]))
        texture = self.gl.texture((SIDE, SIDE), 4, texels.tobytes(), dtype="f4")
        texture.filter = (self.gl.NEAREST, self.gl.NEAREST)
        return texture

    def round(self) -> float:
        """Nanoseconds of one evaluation, in one round."""
        for unit, texture in enumerate(self.textures):
            texture.use(unit)
        took = [self._elapsed(array) for array in self.arrays]
        return (took[0] - took[1]) / (SIDE * SIDE * EVALUATIONS)

    def _elapsed(self, array) -> int:
        """Nanoseconds of one picture."""
        if self.is_hardware:
            with (query := self.gl.query(time=True)):
                array.render(mode=self.gl.TRIANGLES, vertices=3)
            return query.elapsed
        self.gl.finish()
        began = time.perf_counter_ns()
        array.render(mode=self.gl.TRIANGLES, vertices=3)
        self.gl.finish()
        return time.perf_counter_ns() - began

    def release(self) -> None:
        for thing in (*self.arrays, *self.programs, *self.textures):
            thing.release()


def times(context: gl.Context, calls: list[Call], inputs: list[Inputs], rounds: int = ROUNDS) -> list[Time]:
    """All calls, interleaved: a round times each of them once."""
    with context:
        target = context.gl.framebuffer([context.gl.texture((SIDE, SIDE), 4, dtype="f4")])
        target.use()
        context.gl.viewport = (0, 0, SIDE, SIDE)
        watches = [Stopwatch(context, call, x) for call, x in zip(calls, inputs)]
        for watch in watches:
            watch.round()  # the first one compiles
        found = np.array([[watch.round() for watch in watches] for _ in range(rounds)])
        for watch in watches:
            watch.release()
        target.release()
    low, middle, high = np.quantile(found, (0.25, 0.5, 0.75), axis=0)
    return [Time(float(m), float((h - l) / 2)) for l, m, h in zip(low, middle, high)]


_VERTEX = """#version 330
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
"""


def _fragment(source: str, value: str, inputs: tuple[tuple[str, str], ...]) -> str:
    swizzle = {"float": "x", "vec2": "xy", "vec3": "xyz"}
    samplers = "".join(f"uniform sampler2D lobe_t_{name};\n" for name, _ in inputs)
    fetched = "".join(f"    {kind} lobe_0{name} = texelFetch(lobe_t_{name}, lobe_here, 0).{swizzle[kind]};\n"
                      for name, kind in inputs)
    change = {"float": "1.0", "vec2": "vec2(1.0, -0.5)", "vec3": "vec3(1.0, -0.5, 0.7)"}
    varied = "".join(f"        {kind} {name} = lobe_0{name} + lobe_step * {change[kind]};\n" for name, kind in inputs)
    return f"""#version 330
{samplers}uniform int lobe_count;
out vec4 lobe_out;
{gl.version_stripped(source)}
void main() {{
    ivec2 lobe_here = ivec2(gl_FragCoord.xy);
{fetched}    vec3 lobe_sum = vec3(0.0);
    for (int lobe_i = 0; lobe_i < lobe_count; ++lobe_i) {{
        float lobe_step = float(lobe_i) * {STEP:.9f};
{varied}        lobe_sum += {value};
    }}
    lobe_out = vec4(lobe_sum, 1.0);
}}
"""
