"""The window's frames: layout, keys, files, and the picture in the middle."""

from __future__ import annotations

import copy
import statistics
import time
import traceback
from collections import deque
from pathlib import Path

import numpy as np
from imgui_bundle import imgui, implot, implot3d

from ..lab import catalogue, files, gl, scene_schema
from ..lab.errors import InputError
from ..lab.paths import GLSL
from . import camera, chooser, keys, lobe_panel, numbers_panel, objects, plots, scene_panel, shortcuts, theme
from . import state as states
from .display import Display, JobTexture
from .imgui_gl import Renderer
from .picture import Geometry, Picture, Programs
from .services import Services
from .state import AGAINST, MODES, TONES, State
from .truth import Truth

WELCOME = "Drag turns the camera, the bar compares shader and reference, F1 shows all keys."
FRAME_SECONDS = 1 / 60
IDLE_SECONDS = 0.25  # how long a frame may wait when nothing happens
FLICKER_SECONDS = 0.5
WATCH_SECONDS = 0.5
NUMBERS_SECONDS = 0.4  # between two readings of the whole picture
GRAB = 0.35  # em, half the width of what drags the divider


class App:
    """The viewer in a window of any kind. `frame` does one frame; the caller decides how often."""

    def __init__(self, window, state: State | None = None):
        self.window, self.state = window, state or states.initial()
        self._framed = state.object if state else None  # the object that the camera has been made to look at
        self.gl = window.gl
        info = self.gl.info
        self.context = gl.Context("window", self.gl, info["GL_RENDERER"], info["GL_VERSION"])
        require_float_targets(self.gl)
        imgui.set_current_context(imgui.create_context())
        implot.create_context()
        implot3d.create_context()
        io = imgui.get_io()
        io.set_ini_filename("")
        io.config_flags |= imgui.ConfigFlags_.nav_enable_keyboard
        io.config_error_recovery_enable_assert = io.config_error_recovery_enable_tooltip = False
        imgui.get_current_context().debug_log_flags = imgui.internal.DebugLogFlags_.none  # _guarded tells what was wrong
        theme.apply(window.density)
        window.listen()
        self.renderer = Renderer(self.gl)
        self.programs, geometry = Programs(self.context), Geometry(self.gl)
        self._geometry = geometry
        self.pictures = {side: Picture(self.context, self.programs, geometry) for side in states.SIDES}
        self.display, self.reference = Display(self.gl), JobTexture(self.gl)
        self._nothing = self.gl.texture((1, 1), 4, b"\0" * 4)  # of which the difference is not known
        self.services = Services(self.context, window.wake)
        self.truth = Truth(window.wake)
        self.layout = theme.Layout()
        self.help, self.asking, self.chooser = False, None, chooser.Chooser()
        self._asked_path, self._focus_path = "", False
        self._paths: dict[str, str] = {}  # last ones, by what was asked for
        self._last_good = copy.deepcopy(self.state)
        self._failed = ""
        self._frames: deque = deque(maxlen=60)
        self._draws: deque = deque(maxlen=30)
        self._began = self._watched = self._read = time.perf_counter()
        self._stamps = stamps()
        self._read_key = None
        self.size = (0, 0)  # of the picture, pixels
        self.picture_rect = (0.0, 0.0, 1.0, 1.0)  # x, y, width, height in ImGui's coordinates
        self._hold = None  # what the mouse drags in the picture
        self._more = False  # work for OpenGL that waits
        self.greeted = False

    # One frame.

    def frame(self) -> None:
        if 0 in (*self.window.size, *self.window.pixels):  # minimised
            return time.sleep(FRAME_SECONDS)
        now = time.perf_counter()
        io = imgui.get_io()
        size, pixels = self.window.size, self.window.pixels
        io.display_size = imgui.ImVec2(*size)
        io.display_framebuffer_scale = imgui.ImVec2(*(p / s for p, s in zip(pixels, size)))
        io.delta_time = max(now - self._began, 1e-4)
        self._began = now
        self._watch(now)
        self._take_dropped()
        self._take_chosen()
        imgui.new_frame()
        self._greet()
        self._guarded(lambda: shortcuts.handle(self))
        self._draw_layout()
        self._draw_picture(now)
        imgui.render()
        target = self.window.target
        target.use()
        self.gl.clear(*display_background(), 1.0)
        self._show_picture(target)
        self.renderer.render(target)
        self.window.present()
        self._more = self.services.run_gl_work()
        self._frames.append(time.perf_counter() - now)
        self.services.frame_ms = 1e3 * statistics.median(self._frames)

    def _greet(self) -> None:
        """Says what to do, until a key or a button is pressed, and for a while after."""
        if not self.greeted:
            self.services.notice(WELCOME)
            self.greeted = any(imgui.get_io().mouse_down) or any(map(imgui.is_key_down, keys.ALL))

    def run(self, frames: int | None = None) -> None:
        """Frames until the window closes."""
        while not self.window.closing and frames != 0:
            self.step()
            frames = None if frames is None else frames - 1

    def step(self) -> None:
        """One frame, not before it is due: what is not seen would only take the processor from the reference."""
        if self.busy:
            time.sleep(max(self._began + FRAME_SECONDS - time.perf_counter(), 0.0))
        self.window.poll(0.0 if self.busy else IDLE_SECONDS)
        self.frame()

    @property
    def busy(self) -> bool:
        """Whether the next frame would differ from this one without anything happening."""
        io = imgui.get_io()
        moved = any(io.mouse_down) or io.mouse_wheel or any(map(imgui.is_key_down, shortcuts.HELD))
        drawing = self._more or not all(self.pictures[side].whole for side in self._sides())
        arriving = not self.reference.settled or (self.reference.job and self.reference.job.dirty)
        return bool(moved or drawing or arriving or self.state.mode == "flicker")

    def release(self) -> None:
        self.chooser.close()
        self.truth.stop()
        self.services.stop()
        for thing in (*self.pictures.values(), self._geometry, self.renderer):
            thing.release()
        implot3d.destroy_context()
        implot.destroy_context()
        imgui.destroy_context()
        self.window.release()

    # Layout.

    def _draw_layout(self) -> None:
        size, layout = imgui.get_io().display_size, self.layout
        flags = (imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings
                 | imgui.WindowFlags_.no_bring_to_front_on_focus | imgui.WindowFlags_.no_scroll_with_mouse
                 | imgui.WindowFlags_.no_background)
        imgui.set_next_window_pos((0, 0))
        imgui.set_next_window_size(size)
        imgui.begin("viewer", None, flags)
        em = imgui.get_font_size()
        gap = 0.4 * em
        self._guarded(self._toolbar)
        inner = imgui.get_content_region_avail()
        left, right, bottom = layout.fitted(inner.x, inner.y, em)
        middle = inner.x - left - right - 2 * gap
        self._panel("lobes", left, inner.y)(lambda: lobe_panel.draw(self.state, self.services))
        imgui.same_line(0, 0)
        if moved := layout.splitter("left", gap, inner.y, 0):
            layout.left = (left + moved) / em
        imgui.same_line(0, 0)
        imgui.begin_group()
        above = inner.y - bottom - gap
        self._panel("picture", middle, above, padded=False)(lambda: self._picture_area(middle, above))
        if moved := layout.splitter("bottom", middle, gap, 1):
            layout.bottom = (bottom - moved) / em
        self._panel("plots", middle, bottom)(lambda: plots.draw(self.state, self.services))
        imgui.end_group()
        imgui.same_line(0, 0)
        if moved := layout.splitter("right", gap, inner.y, 0):
            layout.right = (right - moved) / em
        imgui.same_line(0, 0)
        self._panel("right", right, inner.y)(self._right)
        imgui.end()
        if self.help:
            help_overlay(size.x, size.y)
        self._guarded(self._path_dialog)

    def _panel(self, name: str, width: float, height: float, padded: bool = True):
        def draw(content) -> None:
            flags = imgui.ChildFlags_.nav_flattened | (imgui.ChildFlags_.borders if padded else imgui.ChildFlags_.none)
            spacing = imgui.get_style().item_spacing
            imgui.push_style_var(imgui.StyleVar_.item_spacing, imgui.ImVec2(spacing.x, 0.0))
            imgui.begin_child(name, (width, height), flags)
            imgui.pop_style_var()
            self._guarded(content)
            imgui.push_style_var(imgui.StyleVar_.item_spacing, imgui.ImVec2(spacing.x, 0.0))
            imgui.end_child()
            imgui.pop_style_var()
        return draw

    def _guarded(self, content) -> None:
        """Draws a part of the window. What goes wrong in it is told there, and the rest is drawn all the same."""
        before = imgui.internal.ErrorRecoveryState()
        imgui.internal.error_recovery_store_state(before)
        try:
            content()
        except Exception as error:
            imgui.internal.error_recovery_try_to_recover_state(before)
            for plotting in (implot, implot3d):  # which may be in the middle of a plot
                plotting.destroy_context()
                plotting.create_context()
            self.services.notice(unexpected(error), is_error=True)

    def _right(self) -> None:
        if imgui.begin_tab_bar("right"):
            for name, content in (("Numbers", numbers_panel), ("Scene", scene_panel)):
                flags = imgui.TabItemFlags_.set_selected if self.layout.tab == name else 0
                if imgui.begin_tab_item(name, None, flags)[0]:
                    if imgui.begin_child(f"{name} content", child_flags=imgui.ChildFlags_.nav_flattened):
                        self._guarded(lambda: content.draw(self.state, self.services))
                    imgui.end_child()
                    imgui.end_tab_item()
            self.layout.tab = ""
            imgui.end_tab_bar()

    def _toolbar(self) -> None:
        state = self.state
        for i, mode in enumerate(MODES):
            if theme.toggle(f"{i + 1} {mode.capitalize()}", state.mode == mode):
                state.mode = mode
            imgui.same_line()
        em = imgui.get_font_size()
        imgui.same_line(0, em)
        imgui.set_next_item_width(6.5 * em)
        if imgui.begin_combo("##against", f"A : {state.against}"):
            for name in AGAINST:
                if imgui.selectable(f"A : {name}", state.against == name)[0]:
                    state.against = name
            imgui.end_combo()
        imgui.set_item_tooltip("What A is held against: its reference, or lobe B (key B)")
        imgui.same_line()
        imgui.set_next_item_width(6.5 * em)
        if state.mode == "difference":
            changed, value = imgui.slider_float("##scale", state.scale, 1e-9, 10.0, "%.1e",
                                                imgui.SliderFlags_.logarithmic)
            state.scale = min(max(value, 1e-12), 1e6) if changed else state.scale
            imgui.set_item_tooltip("The difference that has full colour (keys , and .); key A fits it")
        else:
            state.exposure = imgui.slider_float("##exposure", state.exposure, -8.0, 8.0, "%+.1f stops")[1]
            imgui.set_item_tooltip("Exposure (keys , and .)")
        imgui.same_line()
        imgui.set_next_item_width(5.5 * em)
        if imgui.begin_combo("##tone", state.tone):
            for name in TONES:
                if imgui.selectable(name, state.tone == name)[0]:
                    state.tone = name
            imgui.end_combo()
        imgui.set_item_tooltip("Tone curve of the display alone (key T)")
        imgui.same_line()
        if imgui.button("Files"):
            imgui.open_popup("files")
        imgui.same_line()
        if imgui.button("?"):
            self.help = not self.help
        imgui.set_item_tooltip("All keys (F1)")
        if imgui.begin_popup("files"):
            for name, (label, key, _) in FILES.items():
                if imgui.menu_item(label, key, False)[0]:
                    self.choose_path(name)
            imgui.end_popup()

    # The picture.

    def _picture_area(self, width: float, height: float) -> None:
        scale = imgui.get_io().display_framebuffer_scale
        self.size = max(int(width * scale.x), 16), max(int(height * scale.y), 16)
        at = imgui.get_cursor_screen_pos()
        self.picture_rect = at.x, at.y, width, height
        self.display.resize(self.size)
        imgui.invisible_button("the picture", (width, height), imgui.ButtonFlags_.mouse_button_left
                               | imgui.ButtonFlags_.mouse_button_right | imgui.ButtonFlags_.mouse_button_middle)
        self._mouse(imgui.is_item_hovered(), imgui.is_item_active())
        self._overlay(at.x, at.y, width, height)

    def _mouse(self, hovered: bool, active: bool) -> None:
        io, state = imgui.get_io(), self.state
        x, y, width, height = self.picture_rect
        u, v = (io.mouse_pos.x - x) / width, (io.mouse_pos.y - y) / height
        near = state.mode == "split" and abs(u - state.divider) * width < GRAB * imgui.get_font_size()
        if hovered and (near or self._hold == "divider"):
            imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
        if imgui.is_item_activated():
            panning = io.key_shift or any(imgui.is_mouse_down(b) for b in (1, 2))
            self._hold = "divider" if near and not panning else "pan" if panning else "orbit"
        if active and self._hold == "divider":
            state.divider = min(max(u, 0.0), 1.0)
        elif active and self._hold == "orbit":
            camera.orbit(state, -3.5 * io.mouse_delta.x / height, 3.5 * io.mouse_delta.y / height)
        elif active and self._hold == "pan":
            camera.pan(state, -io.mouse_delta.x / height, io.mouse_delta.y / height)
        elif not active:
            self._hold = None
        if hovered and io.mouse_wheel:
            camera.zoom(state, 0.9**io.mouse_wheel)
        inside = hovered and 0 <= u < 1 and 0 <= v < 1
        if inside and self._hold != "orbit":
            self.services.look_at(state, lambda s: self.truth.scene("direct", s), int(u * self.size[0]),
                                  int(v * self.size[1]), self.size)
        elif not inside:
            self.services.pixel = None

    def _overlay(self, x: float, y: float, width: float, height: float) -> None:
        state, em = self.state, imgui.get_font_size()
        draw = imgui.get_window_draw_list()
        second = self._second_name()
        if state.mode == "split":
            at = x + state.divider * width
            draw.add_line((at, y), (at, y + height), theme.ACCENT, 0.12 * em)
            theme.label(draw, at - 0.5 * em, y + 0.4 * em, "A shader", right=True)
            theme.label(draw, at + 0.5 * em, y + 0.4 * em, second)
        else:
            name = {"shader": "A shader", "reference": second, "difference": f"A shader - {second}",
                    "flicker": second if self._second() else "A shader"}[state.mode]
            theme.label(draw, x + 0.5 * em, y + 0.4 * em, name)
        if state.mode == "difference":
            theme.scale(draw, x + 0.5 * em, y + 2.2 * em, state.scale)
        if status := self._status():
            theme.label(draw, x + width - 0.5 * em, y + height - 1.8 * em, status, right=True)
        self._notices(draw, x, y + height, width)

    def _show_picture(self, target) -> None:
        """Below ImGui, since blending so many pixels would cost a third of a frame in software."""
        scale = imgui.get_io().display_framebuffer_scale
        x, y = round(self.picture_rect[0] * scale.x), round(self.picture_rect[1] * scale.y)
        self.gl.viewport = x, target.size[1] - y - self.size[1], *self.size
        self.display.present()

    def _second_name(self) -> str:
        return "B shader" if self.state.against == "B" else f"{self.state.reference} reference"

    def _status(self) -> str:
        if self.state.against == "B":
            return ""
        job = self.services.job
        if job is None:
            return ""
        if job.failure:
            return "no reference"
        if job.state.reference == "direct":
            return "reference: complete" if job.done else f"reference: {100 * job.rows // job.size[1]} % of the rows"
        error = f", error {100 * job.error:.2g} % of the mean" if np.isfinite(job.error) else ""
        return f"reference: {job.samples} samples{error}"

    def _notices(self, draw, x: float, bottom: float, width: float) -> None:
        em, now = imgui.get_font_size(), time.monotonic()
        self.services.notices = [n for n in self.services.notices if n.until > now]
        y = bottom - 2.2 * em
        for notice in reversed(self.services.notices):
            y -= theme.notice(draw, x + 0.5 * em, y, width - 1.0 * em, notice.text, notice.is_error)

    def _second(self) -> bool:
        """Whether mode flicker shows the second picture now."""
        return int(time.perf_counter() / FLICKER_SECONDS) % 2 == 1

    def _sides(self) -> tuple[str, ...]:
        return ("A", "B") if self.state.against == "B" else ("A",)

    def _draw_picture(self, now: float) -> None:
        state = self.state
        try:
            self._reframe()
            objects.camera(state)  # refuses what cannot look
            before = sum(self.pictures[s].version for s in self._sides())
            for side in self._sides():
                self.pictures[side].update(state, state.sides[side], self.size)
            if sum(self.pictures[s].version for s in self._sides()) != before and self.pictures["A"].whole:
                self._draws.append(self.pictures["A"].seconds)
                self.services.picture_ms = 1e3 * statistics.median(self._draws)
            self._last_good = copy.deepcopy(state)
            self._failed = ""
        except Exception as error:  # whatever it is, the window stays
            self._undo(error)
            return
        left = self.pictures["A"]
        if state.against == "B":
            self.services.job = None
            self.truth.cancel()
            right, flipped, version = self.pictures["B"].texture, False, self.pictures["B"].version
            key = self.size, repr((state.object, state.placement, state.eye, state.target, state.fov, state.lights,
                                   state.environment, state.sides))
        else:
            self._ask_truth()
            stale = state.mode == "difference" and self.reference.job is not self.services.job
            right, flipped, version = self._nothing if stale else self.reference.texture, True, self.reference.version
            key = self.services.job.key
        self.services.showing = state.against, (self.programs.generation, key)
        self.display.draw(state, left.texture, right, flipped, (left.version, version), self._second())
        self._take_images(now)

    def _reframe(self) -> None:
        """Looks at another object, or at all of this one again where that was asked for."""
        if self._framed != self.state.object or self.services.reframe:
            camera.reset(self.state, objects.thing(self.state).vertices, self.size[0] / self.size[1])
            self._framed, self.services.reframe = self.state.object, False

    def _ask_truth(self) -> None:
        state = self.state
        key = (self.size, state.reference, state.object, repr((state.placement, state.eye, state.target, state.fov,
               state.lights, state.environment, state.sides["A"], state.depth if state.reference == "traced" else 0)))
        job = self.services.job = self.truth.ask(key, state, self.size)
        self.reference.update(self.truth.shown or job)
        if job.failure and job.failure != self._failed:
            self._failed = job.failure
            self.services.notice(f"no reference: {job.failure}", is_error=True)

    def _undo(self, error: Exception) -> None:
        """Goes back to the last state that could be drawn."""
        self.services.notice(self._told(error), is_error=True)
        kept = copy.deepcopy(self._last_good)
        self.state.__dict__.update(kept.__dict__)
        self._framed = self.state.object

    def _told(self, error: Exception) -> str:
        if isinstance(error, gl.CompileError):
            return f"the shader does not compile: {error}"
        return str(error) if isinstance(error, InputError) else unexpected(error)

    def _take_images(self, now: float) -> None:
        """Reads both pictures back for whoever counts their errors, now and then."""
        job, left, B = self.services.job, self.pictures["A"], self.pictures["B"]
        if not left.whole or now - self._read < NUMBERS_SECONDS:
            return
        if job is None:
            whole, versions, other = B.whole, (B.version, left.version), B.read
        else:
            whole = job.version > 0 and (job.done or job.state.reference != "direct")
            versions, other = (job.version, left.version), lambda: job.image
        key = (*self.services.showing, *versions)
        if whole and key != self._read_key:
            self._read, self._read_key = now, key
            self.services.take_images(key, left.full.texture.read(), other())

    # Files.

    def _take_dropped(self) -> None:
        while self.window.dropped:
            self.open(self.window.dropped.pop(0))

    def open(self, path: Path) -> None:
        """Takes a mesh, an environment or a session. What is none is told, and all stays as it is."""
        try:
            self._open(Path(path))
        except MemoryError:
            self.services.notice(f"{path}: does not fit into memory", is_error=True)
        except Exception as error:
            told = str(error) if isinstance(error, (InputError, OSError)) else unexpected(error)
            self.services.notice(told, is_error=True)

    def _open(self, path: Path) -> None:
        state, notes = objects.opened(self.state, path)
        self.state.__dict__.update(state.__dict__)
        for note in notes:
            self.services.notice(note)
        if path.suffix.lower() in objects.SESSIONS:
            self._framed = state.object  # a session has its own camera
            self.window.title(f"{path.name} - Lobe")

    def choose_path(self, what: str) -> None:
        """Opens the desktop's dialog for a file; where there is none, the own one."""
        if not chooser.available():
            return self.ask_path(what)
        label, _, name = FILES[what]
        suffixes = (Path(name).suffix,) if name else objects.SUFFIXES
        begin = Path(self._paths.get(what, name)).expanduser().absolute()
        self.chooser.ask(what, label, f"{begin}/" if begin.is_dir() else str(begin), suffixes, saves=bool(name))

    def _take_chosen(self) -> None:
        if (answer := self.chooser.take()) is None:
            return
        what, path, seen = answer
        if path is not None:
            self.finish_path(what, path)
        elif not seen:
            self.ask_path(what)

    def ask_path(self, what: str) -> None:
        """Opens the dialog that asks for a file's name."""
        self.asking, self._asked_path, self._focus_path = what, self._paths.get(what, FILES[what][2]), True

    def _path_dialog(self) -> None:
        if not self.asking:
            return
        label = FILES[self.asking][0]
        imgui.open_popup(label)
        em = imgui.get_font_size()
        center = imgui.get_main_viewport().get_center()
        imgui.set_next_window_pos(center, imgui.Cond_.always, (0.5, 0.5))
        imgui.set_next_window_size((32 * em, 0))
        if imgui.begin_popup_modal(label, None, imgui.WindowFlags_.always_auto_resize)[0]:
            if self._focus_path:
                imgui.set_keyboard_focus_here()
                self._focus_path = False
            imgui.set_next_item_width(-1)
            entered, self._asked_path = imgui.input_text("##path", self._asked_path,
                                                         imgui.InputTextFlags_.enter_returns_true)
            exists = self.asking != "open" and Path(self._asked_path).expanduser().is_file()
            imgui.text_disabled(f"{'exists, OK replaces it' if exists else ''} in {Path.cwd()}".strip())
            if imgui.button("OK") or entered:
                self.finish_path(self.asking, Path(self._asked_path).expanduser())
            imgui.same_line()
            if chooser.available():
                if imgui.button("Browse"):
                    self.choose_path(self.asking)
                    self.asking = None
                imgui.same_line()
            if imgui.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape):
                self.asking = None
            if not self.asking:
                imgui.close_current_popup()
            imgui.end_popup()

    def finish_path(self, what: str, path: Path) -> None:
        self.asking, self._paths[what] = None, str(path)
        if what == "open":
            return self.open(path)
        try:
            require_suffix(path, what)
            {"session": self.save_session, "png": self.save_png, "exr": self.save_exr}[what](path)
            self.services.notice(f"{path}: written")
        except (InputError, OSError) as error:
            self.services.notice(str(error), is_error=True)

    def save_session(self, path: Path) -> None:
        states.save(self.state, path, self.size)

    def save_png(self, path: Path) -> None:
        """The picture as it is shown."""
        files.write_png(path, self.display.read())

    def save_exr(self, path: Path) -> None:
        """Linear, the layers shader, and reference or B and the difference where these are complete."""
        left = self._whole("A")
        layers = {"RGB": left[..., :3], "shader": left[..., :3], "coverage": (left[..., 3] > 0).astype(np.float32)}
        if self.state.against == "B":
            layers["B"] = self._whole("B")[..., :3]
            layers["difference"] = left[..., :3] - layers["B"]
        elif self.services.job and self.services.job.version:
            layers["reference"] = self.services.job.image[..., :3].copy()
            layers["difference"] = left[..., :3] - layers["reference"]
        files.write_exr(path, layers)

    def _whole(self, side: str) -> np.ndarray:
        """The shader's picture, however long it takes."""
        while not self.pictures[side].whole:
            self.pictures[side].update(self.state, self.state.sides[side], self.size)
        return self.pictures[side].read()

    def screenshot(self) -> np.ndarray:
        """The window's colours [h, w, 3] uint8, row 0 on top."""
        target = self.window.target
        width, height = target.size
        content = target.read(viewport=(0, 0, width, height), components=3, alignment=1)
        return np.frombuffer(content, np.uint8).reshape(height, width, 3)[::-1].copy()

    # Hot reload.

    def _watch(self, now: float) -> None:
        if now - self._watched < WATCH_SECONDS:
            return
        self._watched = now
        if (seen := stamps()) != self._stamps:
            self._stamps = seen
            self.reload()

    def reload(self) -> None:
        """Takes the shaders of glsl/ as they are now; where they do not compile, the last good ones stay."""
        try:
            library = catalogue.load.__wrapped__(GLSL)
            require_compiles(self.context, library)
            known = {f.key: f for f in library.functions}
            lists = [[lobe for lobe in self.state.sides[side] if lobe.key in known] for side in states.SIDES]
            self.programs.replace(library, [lobes for lobes in lists if lobes])
        except (InputError, gl.CompileError) as error:
            self.services.notice(str(error), is_error=True, about=GLSL)
            return
        catalogue.load.cache_clear()
        scene_schema.lobes.cache_clear()
        self._geometry.forget_arrays()
        for side in states.SIDES:
            self.state.sides[side] = [states.matched(lobe, known) for lobe in self.state.sides[side]]
        self.services.reloaded(library)
        self.services.notices = [n for n in self.services.notices if not n.is_error]
        self.services.notice("glsl/ was read again; the reference is as it was built", about=GLSL)

    def fit_scale(self) -> None:
        """Chooses the scale of mode difference from the picture, as the reports do."""
        left = self.pictures["A"].read()
        right = self.pictures["B"].read() if self.state.against == "B" else self.services.job.image
        both = (left[..., 3] == right[..., 3]) & (left[..., 3] > 0)
        errors = np.abs(left[both][:, :3].astype(float) - right[both][:, :3])
        errors = errors[np.isfinite(errors)]
        if len(errors) and (typical := np.quantile(errors, 0.995)) > 0:
            self.state.scale = float(typical)


def unexpected(error: Exception) -> str:
    """One line on what no message was written for."""
    at = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(at.filename).name}:{at.lineno}); the window goes on"


def help_overlay(width: float, height: float) -> None:
    """All keys, in the middle of the window, which they may be taller than."""
    imgui.set_next_window_size_constraints((0, 0), (width, height))
    imgui.set_next_window_pos((width / 2, height / 2), imgui.Cond_.always, (0.5, 0.5))
    imgui.begin("All keys (F1)", None, imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_move
                | imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_collapse)
    for title, rows in shortcuts.HELP:
        imgui.separator_text(title)
        if imgui.begin_table(title, 2, imgui.TableFlags_.sizing_fixed_fit):
            imgui.table_setup_column("key", 0, 14 * imgui.get_font_size())
            for key, meaning in rows:
                imgui.table_next_row()
                imgui.table_next_column()
                imgui.text(key)
                imgui.table_next_column()
                imgui.text_disabled(meaning)
            imgui.end_table()
    imgui.end()


def require_suffix(path: Path, what: str) -> None:
    expected = Path(FILES[what][2]).suffix
    if path.suffix.lower() != expected:
        raise InputError(f"{path}: expected a file {expected}")


FILES = {"open": ("Open mesh, environment or session", "Ctrl+O", ""),
         "session": ("Save session", "Ctrl+S", "session.toml"),
         "png": ("Save PNG", "Ctrl+P", "lobe.png"), "exr": ("Save EXR", "Ctrl+E", "lobe.exr")}


def display_background() -> tuple[float, float, float]:
    return tuple(imgui.get_style_color_vec4(imgui.Col_.window_bg))[:3]


def stamps() -> dict[Path, int]:
    """When each file of the library was written."""
    found = {}
    for path in GLSL.glob("*.glsl"):
        try:
            found[path] = path.stat().st_mtime_ns
        except OSError:
            pass  # an editor is replacing it
    return found


def require_compiles(context: gl.Context, library: catalogue.Catalogue) -> None:
    """InputError with file and line where the whole library does not compile."""
    texts = "".join(gl.numbered(file.text, i + 1) for i, file in enumerate(library.files))
    source = f"#version 330\n{texts}\nout vec4 lobe_out;\nvoid main() {{ lobe_out = vec4(1.0); }}\n"
    try:
        gl.program(context, "#version 330\nvoid main() { gl_Position = vec4(0.0); }\n", source).release()
    except gl.CompileError as error:
        place = f"{library.files[error.file - 1].path}:{error.line}" if error.file else "glsl"
        raise InputError(f"{place}: {error.message}; the last good shader stays") from None


def require_float_targets(device) -> None:
    """InputError where pictures cannot be drawn in float32."""
    try:
        texture = device.texture((4, 4), 4, dtype="f4")
        device.framebuffer([texture]).release()
        texture.release()
    except Exception as error:  # moderngl's own
        raise InputError(f"view: {device.info['GL_RENDERER']} cannot draw into float32 textures ({error}), expected "
                         "OpenGL 3.3 with EXT_color_buffer_float; LIBGL_ALWAYS_SOFTWARE=1 takes Mesa's own") from None
