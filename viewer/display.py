"""Two linear pictures as the display shows them: one, the other, split, or their difference."""

from __future__ import annotations

import math

import numpy as np

from ..lab import pictures
from . import camera, objects
from .state import TONES, State
from .truth import Job

_VERTEX = """#version 330
out vec2 lobe_uv;
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
    lobe_uv = corner;
    gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
"""
_COMMON = """
uniform vec3 lobe_background;
in vec2 lobe_uv;
out vec4 lobe_out;

vec4 at(sampler2D picture, bool flipped) {  // row 0 on top
    return texture(picture, flipped ? vec2(lobe_uv.x, 1.0 - lobe_uv.y) : lobe_uv);
}

bool finite(vec3 x) { return !(any(isnan(x)) || any(isinf(x))); }
"""
_PICTURE = """
uniform sampler2D lobe_picture;
uniform bool lobe_flipped;
uniform float lobe_gain;
uniform int lobe_tone;
uniform sampler2D lobe_sky;
uniform mat3 lobe_towards;  // from the picture, -1 to 1, to the probe
uniform vec3 lobe_sky_scale;

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

void main() {
    vec4 c = at(lobe_picture, lobe_flipped);
    bool behind = c.a == 0.0 || c.a == 0.5;
#ifdef LOBE_SKY
    vec3 d = normalize(lobe_towards * vec3(2.0 * lobe_uv - 1.0, 1.0));  // as in lab/probes.py
    vec2 there = vec2(0.5 + 0.15915494 * atan(d.x, -d.z), 0.31830989 * acos(d.y));
    c.rgb = behind ? texture(lobe_sky, there).rgb * lobe_sky_scale : c.rgb;
    behind = false;
#endif
    vec3 color = finite(c.rgb) ? curve(c.rgb * lobe_gain) : vec3(1.0, 0.0, 1.0);
    lobe_out = vec4(behind ? lobe_background : color, 1.0);
}
"""
_DIFFERENCE = """
uniform sampler2D lobe_left;
uniform sampler2D lobe_right;
uniform bool lobe_right_flipped;
uniform float lobe_scale;
uniform vec3 lobe_negative;
uniform vec3 lobe_zero;
uniform vec3 lobe_positive;

vec3 difference(vec4 a, vec4 b) {
    if (a.a < 1.0 && b.a < 1.0 && b.a != 0.25) return lobe_background;
    if (a.a != b.a) return 0.6 * lobe_background;  // an edge, where they see two triangles; or not known yet
    if (!finite(a.rgb) || !finite(b.rgb)) return vec3(1.0, 0.0, 1.0);
    vec3 d = a.rgb - b.rgb;
    float x = abs(d.r) > abs(d.g) ? d.r : d.g;
    x = clamp((abs(x) > abs(d.b) ? x : d.b) / lobe_scale, -1.0, 1.0);
    return mix(lobe_zero, x < 0.0 ? lobe_negative : lobe_positive, abs(x));
}

void main() { lobe_out = vec4(difference(at(lobe_left, false), at(lobe_right, lobe_right_flipped)), 1.0); }
"""
_COPY = """
uniform sampler2D lobe_texture;
in vec2 lobe_uv;
out vec4 lobe_out;
void main() { lobe_out = texture(lobe_texture, lobe_uv); }
"""
BACKGROUND = (0.17, 0.18, 0.20)


class Display:
    """`texture` is what the window shows, 8 bits a channel."""

    def __init__(self, device):
        self._device, self._sky = device, Sky(device)
        # A program for each, since software computes all that a program might show.
        self._plain, self._before_sky, self._difference, self._copy = (
            device.vertex_array(device.program(vertex_shader=_VERTEX, fragment_shader=f"#version 330\n{text}"), [])
            for text in (_COMMON + _PICTURE, f"#define LOBE_SKY\n{_COMMON}{_PICTURE}", _COMMON + _DIFFERENCE, _COPY))
        for array in (self._plain, self._difference):
            array.program["lobe_background"].value = BACKGROUND
        for name, color in (("negative", pictures.NEGATIVE), ("zero", pictures.ZERO), ("positive", pictures.POSITIVE)):
            self._difference.program[f"lobe_{name}"].value = tuple(c / 255 for c in color)
        self._difference.program["lobe_right"].value = 1
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
        width, height = self.texture.size
        parted = {"shader": width, "reference": 0, "flicker": 0 if second else width}.get(
            state.mode, math.ceil(state.divider * width - 0.5))  # the first column of the right picture
        sky = state.environment if state.backdrop else None
        key = (state.mode, parted, state.exposure, state.tone, state.scale, left.glo, right.glo, flipped, versions,
               repr(sky), sky and (state.eye, state.target, state.fov))
        if key == self._key:
            return
        self._key = key
        self._frame.use()
        self._device.viewport = 0, 0, width, height
        self._device.enable_only(self._device.NOTHING)
        if state.mode == "difference":
            return self._draw_difference(state, left, right, flipped)
        array = self._before_sky if sky else self._plain
        if sky:
            self._sky.use(1, array.program, state, width / height)
        array.program["lobe_gain"].value = 2.0**state.exposure
        array.program["lobe_tone"].value = TONES.index(state.tone)
        for picture, is_flipped, first, last in ((left, False, 0, parted), (right, flipped, parted, width)):
            if first < last:
                picture.use(0)
                array.program["lobe_flipped"].value = is_flipped
                self._frame.scissor = first, 0, last - first, height
                array.render(self._device.TRIANGLES, vertices=3)
        self._frame.scissor = None

    def _draw_difference(self, state: State, left, right, flipped: bool) -> None:
        program = self._difference.program
        program["lobe_scale"].value = state.scale
        program["lobe_right_flipped"].value = flipped
        left.use(0)
        right.use(1)
        self._difference.render(self._device.TRIANGLES, vertices=3)

    def present(self) -> None:
        """Draws the texture into the viewport of the framebuffer that is in use."""
        self.texture.use(0)
        self._device.enable_only(self._device.NOTHING)
        self._copy.render(self._device.TRIANGLES, vertices=3)

    def read(self) -> np.ndarray:
        """Colours [h, w, 3] uint8, row 0 on top."""
        width, height = self.texture.size
        return np.frombuffer(self.texture.read(), np.uint8).reshape(height, width, 4)[::-1, :, :3].copy()


class Sky:
    """The environment as what is behind the object, in the halves of float32 that software samples fastest."""

    def __init__(self, device):
        self._device, self._texture, self._pixels = device, None, None

    def use(self, unit: int, program, state: State, aspect: float) -> None:
        pixels = objects.environment_pixels(state.environment.file)
        if pixels is not self._pixels:
            self._upload(pixels)
        self._texture.use(unit)
        program["lobe_sky"].value = unit
        program["lobe_sky_scale"].value = state.environment.scale
        tangent = np.tan(np.radians(state.fov) / 2)
        right, up, back = camera.basis(state)
        towards = np.stack([right * tangent * aspect, up * tangent, -back])  # columns, as OpenGL has them
        program["lobe_towards"].write((towards @ objects.turn(state.environment)).astype("f4").tobytes())

    def _upload(self, pixels: np.ndarray) -> None:
        step = -(-max(pixels.shape) // self._device.info["GL_MAX_TEXTURE_SIZE"])
        halves = np.minimum(pixels[::step, ::step], np.finfo(np.float16).max).astype(np.float16)
        if self._texture:
            self._texture.release()
        height, width, _ = halves.shape
        self._texture = self._device.texture((width, height), 3, halves.tobytes(), alignment=2, dtype="f2")
        self._texture.filter = self._device.LINEAR, self._device.LINEAR
        self._texture.repeat_y = False
        self._pixels = pixels


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
