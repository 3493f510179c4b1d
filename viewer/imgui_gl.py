"""Dear ImGui drawn by moderngl, in whatever context there is: a window's, or one without a display."""

from __future__ import annotations

import ctypes

import numpy as np
from imgui_bundle import imgui

_VERTEX = """#version 330
uniform vec2 lobe_size;
in vec2 lobe_position;
in vec2 lobe_uv;
in vec4 lobe_color;
out vec2 lobe_uv_f;
out vec4 lobe_color_f;
void main() {
    lobe_uv_f = lobe_uv;
    lobe_color_f = lobe_color;
    gl_Position = vec4((2.0 * lobe_position / lobe_size - 1.0) * vec2(1.0, -1.0), 0.0, 1.0);
}
"""
_FRAGMENT = """#version 330
uniform sampler2D lobe_texture;
in vec2 lobe_uv_f;
in vec4 lobe_color_f;
out vec4 lobe_out;
void main() { lobe_out = lobe_color_f * texture(lobe_texture, lobe_uv_f); }
"""
_LARGEST = 8192  # of ImGui's own textures


class Renderer:
    """Draws what ImGui has prepared, with ImGui's own textures alone."""

    def __init__(self, gl):
        self._gl = gl
        self._program = gl.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
        self._vertices, self._indices = (gl.buffer(reserve=size, dynamic=True) for size in (1 << 20, 1 << 18))
        self._bind()
        self._textures: dict[int, object] = {}
        io, platform = imgui.get_io(), imgui.get_platform_io()
        io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
        platform.renderer_texture_max_width = platform.renderer_texture_max_height = _LARGEST

    def _bind(self) -> None:
        self._array = self._gl.vertex_array(self._program, [
            (self._vertices, "2f 2f 4f1", "lobe_position", "lobe_uv", "lobe_color")], self._indices,
            index_element_size=imgui.INDEX_SIZE)

    def render(self, target) -> None:
        """Draws the frame that imgui.render() has prepared into a framebuffer."""
        self._update_textures()
        data, gl = imgui.get_draw_data(), self._gl
        width, height = target.size
        scale = data.framebuffer_scale
        target.use()
        gl.viewport = (0, 0, width, height)
        gl.enable_only(gl.BLEND)
        gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA
        self._program["lobe_size"].value = tuple(data.display_size)
        for commands in data.cmd_lists:
            self._upload(commands)
            for command in commands.cmd_buffer:
                x0, y0, x1, y1 = (round(v * s) for v, s in zip(command.clip_rect, (scale.x, scale.y) * 2))
                if x1 <= x0 or y1 <= y0 or command.elem_count == 0:
                    continue
                target.scissor = x0, height - y1, x1 - x0, y1 - y0
                self._textures[command.tex_ref.get_tex_id()].use(0)
                self._array.render(gl.TRIANGLES, vertices=command.elem_count, first=command.idx_offset)
        target.scissor = None
        gl.enable_only(gl.NOTHING)

    def _upload(self, commands) -> None:
        grown = False
        for name, source, size in (("_vertices", commands.vtx_buffer, imgui.VERTEX_SIZE),
                                   ("_indices", commands.idx_buffer, imgui.INDEX_SIZE)):
            content = (ctypes.c_char * (source.size() * size)).from_address(source.data_address())
            buffer = getattr(self, name)
            if buffer.size < len(content):
                buffer.release()
                setattr(self, name, self._gl.buffer(reserve=2 * len(content), dynamic=True))
                grown = True
            else:
                buffer.orphan()
            getattr(self, name).write(content)
        if grown:
            self._array.release()
            self._bind()

    def _update_textures(self) -> None:
        for texture in imgui.get_platform_io().textures:
            if texture.status == imgui.ImTextureStatus.want_create:
                made = self._gl.texture((texture.width, texture.height), 4, texture.get_pixels_array().tobytes())
                made.repeat_x = made.repeat_y = False
                self._textures[made.glo] = made
                texture.set_tex_id(made.glo)
                texture.status = imgui.ImTextureStatus.ok
            elif texture.status == imgui.ImTextureStatus.want_updates:
                pixels = np.asarray(texture.get_pixels_array()).reshape(texture.height, texture.width, 4)
                for r in texture.updates:
                    part = np.ascontiguousarray(pixels[r.y : r.y + r.h, r.x : r.x + r.w])
                    self._textures[texture.tex_id].write(part, viewport=(r.x, r.y, r.w, r.h))
                texture.status = imgui.ImTextureStatus.ok
            elif texture.status == imgui.ImTextureStatus.want_destroy and texture.unused_frames > 0:
                self._textures.pop(texture.tex_id).release()
                texture.set_tex_id(0)
                texture.status = imgui.ImTextureStatus.destroyed

    def release(self) -> None:
        """Gives back everything; ImGui's context must still exist."""
        for texture in imgui.get_platform_io().textures:
            if made := self._textures.pop(texture.tex_id, None):
                made.release()
            texture.set_tex_id(0)
            texture.status = imgui.ImTextureStatus.destroyed
        for thing in (self._array, self._vertices, self._indices, self._program):
            thing.release()
