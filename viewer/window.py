"""Where the frames go: a window of GLFW, or a framebuffer without any display. The rest of the viewer sees one of both.

gl        moderngl.Context, current
size      of the content, in ImGui's coordinates
pixels    of the content, as the framebuffer has them
target    the framebuffer that is shown
dropped   files that were dropped since they were last taken
"""

from __future__ import annotations

from pathlib import Path

from imgui_bundle import imgui

from ..lab.errors import InputError
from . import keys

TITLE = "Lobe"
SMALLEST = 960, 600  # on a screen of usual density: below it panels are too narrow for what they say
NO_DISPLAY = ("view: no display ({}): expected a desktop, X11 or Wayland; without one, --screenshot FILE.png draws the "
              "window into a picture")


class Glfw:
    """A window on the desktop."""

    def __init__(self, width: int, height: int, visible: bool = True, vsync: bool = True):
        import glfw
        import moderngl

        self._glfw = glfw
        glfw.ERROR_REPORTING = "ignore"
        if not glfw.init():
            reason = (glfw.get_error()[1] or b"GLFW does not start").decode(errors="replace")
            raise InputError(NO_DISPLAY.format(reason))
        glfw.default_window_hints()
        for hint, value in ((glfw.CONTEXT_VERSION_MAJOR, 3), (glfw.CONTEXT_VERSION_MINOR, 3),
                            (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE), (glfw.OPENGL_FORWARD_COMPAT, True),
                            (glfw.VISIBLE, visible), (glfw.SCALE_TO_MONITOR, True), (glfw.SAMPLES, 0),
                            (glfw.DEPTH_BITS, 0), (glfw.STENCIL_BITS, 0)):
            glfw.window_hint(hint, value)
        self._window = glfw.create_window(width, height, TITLE, None, None)
        if not self._window:
            reason = (glfw.get_error()[1] or b"").decode(errors="replace")
            raise InputError(f"view: no OpenGL 3.3 here ({reason}); install a driver, such as libgl1-mesa-dri, or use "
                             "--screenshot FILE.png")
        least = (round(edge * self.density) for edge in SMALLEST)
        glfw.set_window_size_limits(self._window, *least, glfw.DONT_CARE, glfw.DONT_CARE)
        glfw.make_context_current(self._window)
        glfw.swap_interval(int(vsync))
        self.gl = moderngl.create_context(require=330)
        self.dropped: list[Path] = []

    def listen(self) -> None:
        """Begins to hand events to ImGui, whose context must exist."""
        glfw, window, io = self._glfw, self._window, imgui.get_io()
        known = keys.from_glfw(glfw)

        def key(_, code, scancode, action, mods):
            if code in known and action != glfw.REPEAT:
                for name in known[code]:
                    io.add_key_event(name, action == glfw.PRESS)

        glfw.set_key_callback(window, key)
        glfw.set_char_callback(window, lambda _, c: io.add_input_character(c))
        glfw.set_cursor_pos_callback(window, lambda _, x, y: io.add_mouse_pos_event(x, y))
        glfw.set_cursor_enter_callback(window, lambda _, inside: inside or io.add_mouse_pos_event(-1e9, -1e9))
        glfw.set_mouse_button_callback(window, lambda _, b, action, mods: b < 5 and io.add_mouse_button_event(
            b, action == glfw.PRESS))
        glfw.set_scroll_callback(window, lambda _, x, y: io.add_mouse_wheel_event(x, y))
        glfw.set_window_focus_callback(window, lambda _, focused: io.add_focus_event(bool(focused)))
        glfw.set_drop_callback(window, lambda _, paths: self.dropped.extend(map(Path, paths)))
        platform = imgui.get_platform_io()
        platform.platform_set_clipboard_text_fn = lambda _, text: glfw.set_clipboard_string(window, text)
        platform.platform_get_clipboard_text_fn = lambda _: (glfw.get_clipboard_string(window) or b"").decode()

    @property
    def size(self) -> tuple[int, int]:
        return self._glfw.get_window_size(self._window)

    @property
    def pixels(self) -> tuple[int, int]:
        return self._glfw.get_framebuffer_size(self._window)

    @property
    def density(self) -> float:
        """How much larger than usual text should be, in ImGui's coordinates."""
        return self._glfw.get_window_content_scale(self._window)[0] * self.size[0] / max(self.pixels[0], 1)

    @property
    def target(self):
        return _Screen(self.gl.screen, self.pixels)

    @property
    def closing(self) -> bool:
        return bool(self._glfw.window_should_close(self._window))

    def poll(self, wait: float) -> None:
        """Takes events, waiting for one at most so many seconds."""
        if wait > 0:
            self._glfw.wait_events_timeout(wait)
        else:
            self._glfw.poll_events()

    def wake(self) -> None:
        """Ends a waiting poll, from any thread."""
        self._glfw.post_empty_event()

    def close(self) -> None:
        self._glfw.set_window_should_close(self._window, True)

    def title(self, text: str) -> None:
        self._glfw.set_window_title(self._window, text)

    def present(self) -> None:
        self._glfw.swap_buffers(self._window)

    def release(self) -> None:
        self._glfw.destroy_window(self._window)


class _Screen:
    """The window's own framebuffer, whose size moderngl learns only once."""

    def __init__(self, framebuffer, size: tuple[int, int]):
        self._framebuffer, self.size = framebuffer, size

    def __getattr__(self, name):
        return getattr(self._framebuffer, name)

    def __setattr__(self, name, value):
        if name == "scissor":
            self._framebuffer.scissor = value
        else:
            object.__setattr__(self, name, value)


class Offscreen:
    """A window without a display: EGL, or what the caller made current."""

    def __init__(self, width: int, height: int, density: float = 1.0):
        from ..lab import gl

        self.gl = gl.create_context("egl").gl
        self.size = self.pixels = (width, height)
        self.density = density
        self.target = self.gl.framebuffer([self.gl.texture((width, height), 4)])
        self.dropped: list[Path] = []
        self.closing = False
        self.clipboard = ""

    def listen(self) -> None:
        platform = imgui.get_platform_io()
        platform.platform_set_clipboard_text_fn = lambda _, text: setattr(self, "clipboard", text)
        platform.platform_get_clipboard_text_fn = lambda _: self.clipboard

    def poll(self, wait: float) -> None:
        pass

    def wake(self) -> None:
        pass

    def close(self) -> None:
        self.closing = True

    def title(self, text: str) -> None:
        pass

    def present(self) -> None:
        self.gl.finish()

    def release(self) -> None:
        self.gl.release()
