"""Two linear pictures as the display shows them: one, the other, split, or their difference."""

from __future__ import annotations

import numpy as np

from ..lab import pictures
from .state import MODES, TONES, State
from .truth import Job

_VERTEX = """#version 330
out vec2 lobe_uv;
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
    lobe_uv = corner;
    gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
"""
_FRAGMENT = """#version 330
uniform sampler2D lobe_left;
uniform sampler2D lobe_right;
uniform bool lobe_right_flipped;  // row 0 on top
uniform int lobe_mode;
uniform float lobe_divider;
uniform float lobe_gain;
uniform int lobe_tone;
uniform float lobe_scale;
uniform vec3 lobe_background;
uniform vec3 lobe_negative;
uniform vec3 lobe_zero;
uniform vec3 lobe_positive;
in vec2 lobe_uv;
out vec4 lobe_out;

vec3 curve(vec3 x) {
    x = max(x, vec3(0.0));
    if (lobe_tone == 1) {  // Hable's filmic curve, white at 11.2
        vec3 y = 2.0 * x;
        y = (y * (0.15 * y + 0.05) + 0.004) / (y * (0.15 * y + 0.5) + 0.06) - 0.0667;
        x = y / 0.7255;
    } else if (lobe_tone == 2) {
        x = x / (1.0 + x);
    }
    x = min(x, vec3(1.0));
    return mix(12.92 * x, 1.055 * pow(max(x, vec3(0.0031308)), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, x));
}

bool finite(vec3 x) { return !(any(isnan(x)) || any(isinf(x))); }

vec3 shown(vec4 c) {
    if (c.a == 0.0 || c.a == 0.5) return lobe_background;
    return finite(c.rgb) ? curve(c.rgb * lobe_gain) : vec3(1.0, 0.0, 1.0);
}

vec3 difference(vec4 a, vec4 b) {
    if (a.a < 1.0 && b.a < 1.0 && b.a != 0.25) return lobe_background;
    if (a.a != b.a) return 0.6 * lobe_background;  // an edge, where they see two triangles; or not known yet
    if (!finite(a.rgb) || !finite(b.rgb)) return vec3(1.0, 0.0, 1.0);
    vec3 d = a.rgb - b.rgb;
    float x = abs(d.r) > abs(d.g) ? d.r : d.g;
    x = clamp((abs(x) > abs(d.b) ? x : d.b) / lobe_scale, -1.0, 1.0);
    return mix(lobe_zero, x < 0.0 ? lobe_negative : lobe_positive, abs(x));
}

void main() {
    vec4 a = texture(lobe_left, lobe_uv);
    vec4 b = texture(lobe_right, lobe_right_flipped ? vec2(lobe_uv.x, 1.0 - lobe_uv.y) : lobe_uv);
    vec3 color = lobe_mode == 0 ? shown(a) : lobe_mode == 1 ? shown(b)
               : lobe_mode == 2 ? shown(lobe_uv.x < lobe_divider ? a : b) : difference(a, b);
    lobe_out = vec4(color, 1.0);
}
"""
_COPY = """#version 330
uniform sampler2D lobe_texture;
in vec2 lobe_uv;
out vec4 lobe_out;
void main() { lobe_out = texture(lobe_texture, lobe_uv); }
"""
BACKGROUND = (0.17, 0.18, 0.20)


class Display:
    """`texture` is what the window shows, 8 bits a channel."""

    def __init__(self, device):
        self._device = device
        self._program = device.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
        self._array = device.vertex_array(self._program, [])
        self._copy = device.vertex_array(device.program(vertex_shader=_VERTEX, fragment_shader=_COPY), [])
        for name, color in (("negative", pictures.NEGATIVE), ("zero", pictures.ZERO), ("positive", pictures.POSITIVE)):
            self._program[f"lobe_{name}"].value = tuple(c / 255 for c in color)
        self._program["lobe_background"].value = BACKGROUND
        self._program["lobe_right"].value = 1
        self.texture = self._frame = None
        self._key = None

    def resize(self, size: tuple[int, int]) -> bool:
        """Whether `texture` is another one now."""
        if self.texture and self.texture.size == size:
            return False
        for thing in (self._frame, self.texture):
            if thing:
                thing.release()
        self.texture = self._device.texture(size, 4)
        self.texture.filter = self._device.NEAREST, self._device.NEAREST
        self.texture.repeat_x = self.texture.repeat_y = False
        self._frame = self._device.framebuffer([self.texture])
        self._key = None
        return True

    def draw(self, state: State, left, right, flipped: bool, versions, second: bool) -> None:
        """Draws once for each change. `versions` tells the pictures' contents apart; `second` is what mode flicker
        shows now."""
        mode = MODES.index(state.mode)
        if state.mode == "flicker":
            mode = int(second)
        key = (mode, state.divider, state.exposure, state.tone, state.scale, left.glo, right.glo, flipped, versions)
        if key == self._key:
            return
        self._key = key
        program = self._program
        program["lobe_mode"].value = mode
        program["lobe_divider"].value = state.divider
        program["lobe_gain"].value = 2.0**state.exposure
        program["lobe_tone"].value = TONES.index(state.tone)
        program["lobe_scale"].value = state.scale
        program["lobe_right_flipped"].value = flipped
        left.use(0)
        right.use(1)
        self._frame.use()
        self._device.viewport = (0, 0, *self.texture.size)
        self._device.enable_only(self._device.NOTHING)
        self._array.render(self._device.TRIANGLES, vertices=3)

    def present(self) -> None:
        """Draws the texture into the viewport of the framebuffer that is in use."""
        self.texture.use(0)
        self._device.enable_only(self._device.NOTHING)
        self._copy.render(self._device.TRIANGLES, vertices=3)

    def read(self) -> np.ndarray:
        """Colours [h, w, 3] uint8, row 0 on top."""
        width, height = self.texture.size
        return np.frombuffer(self.texture.read(), np.uint8).reshape(height, width, 4)[::-1, :, :3].copy()


class JobTexture:
    """The reference's picture on the GPU; of what is new, each frame takes some rows."""

    ROWS = 270

    def __init__(self, device):
        self._device = device
        self.texture, self.job, self._waiting = None, None, []
        self.version = 0

    def update(self, job: Job) -> None:
        if self.texture is None or self.texture.size != job.size:
            if self.texture:
                self.texture.release()
            self.texture = self._device.texture(job.size, 4, dtype="f4")
            self.texture.filter = self._device.NEAREST, self._device.NEAREST
            self.texture.repeat_x = self.texture.repeat_y = False
            self._write(job, 0, job.size[1])
        if job is not self.job:
            self.job, self._waiting = job, []
        while job.dirty:
            self._waiting.append(job.dirty.pop(0))
        left = self.ROWS
        while self._waiting and left > 0:
            first, rows = self._waiting.pop(0)
            taken = min(rows, left)
            self._write(job, first, taken)
            left -= taken
            if taken < rows:
                self._waiting.insert(0, (first + taken, rows - taken))

    @property
    def settled(self) -> bool:
        return not self._waiting

    def _write(self, job: Job, first: int, rows: int) -> None:
        part = np.ascontiguousarray(job.image[first : first + rows])
        self.texture.write(part, viewport=(0, first, job.size[0], rows))
        self.version += 1
