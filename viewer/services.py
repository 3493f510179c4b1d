"""What panels may ask for. Nothing here makes a frame wait, but evaluate_glsl and evaluate_reference: for few rows."""

from __future__ import annotations

import copy
import os
import queue
import threading
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

import numpy as np

from ..lab import bundle, catalogue, compare, gl, scene_schema
from ..lab.catalogue import Catalogue, Function
from . import objects
from .state import Lobe, State
from .truth import Job

NICE = 10
NOTICE_SECONDS = 6.0


@dataclass
class Notice:
    text: str
    is_error: bool
    until: float
    about: object = None


@dataclass
class Slot:
    """A value that is computed when its key changes. `value` is the newest that is ready, `fresh` whether it is of the
    key that was asked for last; `failure` says why there is none."""

    value: object = None
    fresh: bool = False
    failure: str = ""
    ready_key: Hashable = None
    asked_key: Hashable = None


@dataclass(frozen=True)
class Keeping(gl.Context):
    """A context that keeps what it has compiled: the same function is asked for in every frame that a slider moves."""

    programs: dict[str, object] = field(default_factory=dict)

    def draw(self, fragment: str, packed: np.ndarray, rows: int) -> np.ndarray:
        if fragment not in self.programs:
            self.programs[fragment] = gl.program(self, gl.VERTEX, fragment)
        return self.drawn(self.programs[fragment], packed, rows)

    def forget(self) -> None:
        for program in self.programs.values():
            program.release()
        self.programs.clear()


@dataclass(frozen=True)
class Pixel:
    """The pixel under the mouse. L, E, f_glsl, f_reference, units: one row for each light, at most MOST of them,
    brightest first; f is the sum of the lobes of side A, units their errors as `lobe compare` counts them. f_B is the
    shader's sum of side B where A is held against it, else None."""

    x: int
    y: int
    N: np.ndarray
    T: np.ndarray
    V: np.ndarray
    L: np.ndarray
    E: np.ndarray
    f_glsl: np.ndarray
    f_reference: np.ndarray
    units: np.ndarray
    f_B: np.ndarray | None = None

    MOST = 4


class Services:
    """
    library     lab.catalogue.Catalogue, the newest after a hot reload
    lobes       name -> overloads, those that the picture can show
    state       the state, as in draw(state, services)
    job         the reference's picture, truth.Job, or None where A is held against B
    pixel       Pixel under the mouse, or None; it comes a frame or two late
    showing     (state.against, key) of what is shown, the first two of the key of `images` once these are of it
    frame_ms, picture_ms   time of a frame and of drawing the shader's picture, medians of the last ones
    times                  whether these are shown: figures, drawn on any machine, leave them out
    renderer    the driver's name
    reframe     set it to have the camera look at the whole object again
    """

    def __init__(self, context: gl.Context, wake: Callable[[], None] = lambda: None):
        self.context = context
        self.renderer = context.renderer
        self.library: Catalogue = catalogue.load()
        self.job: Job | None = None
        self.pixel: Pixel | None = None
        self.showing: tuple = ("", None)
        self.frame_ms = self.picture_ms = 0.0
        self.times = True
        self.notices: list[Notice] = []
        self.reframe = False
        self._wake = wake
        self._slots: dict[str, Slot] = {}
        self._sources: dict[str, str] = {}  # of each function's bundle
        self._keeping = Keeping(context.name, context.gl, context.renderer, context.version)
        self._work: queue.Queue = queue.Queue()
        self._gl_work: list = []
        self._thread = threading.Thread(target=self._run, daemon=True, name="lobe-worker")
        self._thread.start()

    @property
    def lobes(self) -> dict[str, tuple[Function, ...]]:
        return scene_schema.lobes()

    # Values.

    def evaluate_glsl(self, function: Function, columns: dict[str, np.ndarray]) -> np.ndarray:
        """The GLSL function's values [n, width], float32, in the window's own context, for columns name -> [n, width]
        of all its parameters. Of the main thread alone: draw(), or work that `later` was told is for OpenGL."""
        inputs = {p.name: np.ascontiguousarray(columns[p.name], np.float32).reshape(1, -1, p.width)
                  for p in function.parameters}
        if function.key not in self._sources:
            self._sources[function.key] = bundle.bundle(self.library, [function.key])
        return gl.evaluate(self._keeping, self._sources[function.key], function.call, function.result, inputs)

    @staticmethod
    def evaluate_reference(function: Function, columns: dict[str, np.ndarray]) -> np.ndarray:
        """The reference's values [n, width], float64, of the same columns. Of any thread."""
        from lobe import reference

        packed = compare.rows(function, {p.name: np.asarray(columns[p.name]).reshape(-1, p.width)
                                         for p in function.parameters})
        return reference.evaluate(function.key, packed)

    def later(self, slot: str, key: Hashable, work: Callable[[], object], opengl: bool = False) -> Slot:
        """The value of `work` for this key, computed off the frame: ask in every frame with the same slot name. A new
        key begins new work and forgets what has not begun; until it is ready, the last value stays.

        opengl   the work calls evaluate_glsl: it runs on the main thread, between two frames, one piece a frame
        """
        known = self._slots.setdefault(slot, Slot())
        if known.asked_key != key or (known.asked_key is None and known.ready_key is None):
            known.asked_key, known.fresh, known.failure = key, known.ready_key == key, ""
            if not known.fresh:
                if opengl:
                    self._gl_work = [w for w in self._gl_work if w[0] is not known] + [(known, key, work)]
                else:
                    self._work.put((known, key, work))
        return known

    def slot(self, name: str) -> Slot:
        """The one that `later` fills under a name; an empty one where nothing was asked for."""
        return self._slots.get(name, Slot())

    def run_gl_work(self) -> bool:
        """Runs one piece of OpenGL's work; whether there is more."""
        if self._gl_work:
            self._finish(*self._gl_work.pop(0))
        return bool(self._gl_work)

    @property
    def idle(self) -> bool:
        """Whether nothing that was asked for is still being computed."""
        return not self._gl_work and all(slot.fresh or slot.asked_key is None for slot in self._slots.values())

    def images(self) -> tuple[Hashable, np.ndarray, np.ndarray] | None:
        """(key, A, other) of the newest pictures [h, w, 4] float32 that belong together and are complete, row 0 on top:
        of the shader, and of what it is held against, which key[0] names as state.against does; alpha is 1 where both
        see the same triangle of the object, else 0: at edges, they are of two places. None before there are any. Do not
        write into them."""
        return self.slot("images").value

    # Words.

    def notice(self, text: str, is_error: bool = False, about: object = None) -> None:
        """Shows a line in the window for a while; an error until it is dismissed. It takes the place of an older one
        about the same."""
        text = " ".join(str(text).split())
        self.notices = [n for n in self.notices if n.text != text and (about is None or n.about != about)][-5:]
        until = float("inf") if is_error else time.monotonic() + NOTICE_SECONDS
        self.notices.append(Notice(text, is_error, until, about))

    def copy(self, text: str, what: str) -> None:
        """Puts a text on the clipboard, and says so."""
        from imgui_bundle import imgui

        imgui.set_clipboard_text(text)
        self.notice(f"{what} is on the clipboard")

    # Of the window.

    def take_images(self, key: Hashable, shader: bytes, reference: np.ndarray) -> None:
        """Prepares `images` from the content of the shader's texture and the other picture."""
        def paired():
            ours = np.frombuffer(shader, np.float32).reshape(reference.shape)[::-1].copy()
            theirs = reference.copy()
            same = (ours[..., 3] == theirs[..., 3]) & (ours[..., 3] > 0)
            ours[..., 3] = theirs[..., 3] = same
            return key, ours, theirs

        self.later("images", key, paired)

    def reloaded(self, library: Catalogue) -> None:
        """Forgets what belongs to an older library."""
        self.library = library
        self._sources.clear()
        self._keeping.forget()
        for slot in self._slots.values():
            slot.asked_key = slot.ready_key = None

    def stop(self) -> None:
        """Ends the worker after what it is at."""
        for slot in self._slots.values():
            slot.asked_key = None
        self._work.put(None)
        self._thread.join(timeout=10)

    def look_at(self, state: State, scene: Callable, x: int, y: int, size: tuple[int, int]) -> None:
        """Prepares `pixel`; scene(state) is the reference's."""
        key = (x, y, size, state.object, repr((state.placement, state.eye, state.target, state.fov, state.lights,
                                               state.environment, state.sides, state.against)))
        still, camera = copy.deepcopy(state), objects.camera(state)
        lobes, others = still.sides["A"], still.sides["B"] if state.against == "B" else []
        seen = self.later("pixel geometry", key, lambda: _seen(scene(still), camera, x, y, size))
        if not seen.fresh or seen.value is None:
            self.pixel = None if seen.fresh else self.pixel
            return
        N, T, V, L, E = seen.value
        reference = self.later("pixel reference", key, lambda: _reference_values(lobes, N, T, V, L))
        glsl = self.later("pixel glsl", key, lambda: [self._glsl_values(side, N, T, V, L) for side in (lobes, others)],
                          opengl=True)
        if reference.fresh and glsl.fresh and reference.value and glsl.value is not None:
            value, unit = reference.value
            ours, theirs = glsl.value
            error = np.abs(ours - value)
            units = np.divide(error, unit, out=np.zeros_like(error), where=unit > 0)
            self.pixel = Pixel(x, y, N, T, V, L, E, ours, value, units, theirs if others else None)

    def _glsl_values(self, lobes: list[Lobe], *directions) -> np.ndarray:
        return sum(self.evaluate_glsl(lobe.function, _columns(lobe, *directions)).astype(float) for lobe in lobes)

    def _run(self) -> None:
        try:
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICE)
        except (AttributeError, OSError):
            pass
        while (item := self._work.get()) is not None:
            slot, key, work = item
            if slot.asked_key == key:
                self._finish(slot, key, work)
                self._wake()

    @staticmethod
    def _finish(slot: Slot, key: Hashable, work: Callable[[], object]) -> None:
        try:
            value, failure = work(), ""
        except Exception as error:  # the thread and the window go on
            value, failure = None, f"{type(error).__name__}: {error}"
        if slot.asked_key == key:
            slot.value, slot.failure, slot.ready_key, slot.fresh = value, failure, key, True


def _columns(lobe: Lobe, N, T, V, L) -> dict[str, np.ndarray]:
    given = {"N": N, "T": T, "V": V}
    return {p.name: L if p.name == "L" else np.tile(given[p.name] if p.is_geometry else np.float32(lobe.values[p.name]),
                                                    (len(L), 1)).astype(np.float32)
            for p in lobe.function.parameters}


def _seen(scene, camera, x: int, y: int, size: tuple[int, int]):
    """N, T, V [3] and L, E [lights, 3] of a pixel, as float32 like a shader's inputs; None where the object is not."""
    traced = scene.trace(camera, *size, shadows=False, first=y, rows=1)
    if traced["object"][0, x] < 0:
        return None
    L, E = traced["L"][:, 0, x], traced["E"][:, 0, x]
    order = np.argsort(-E.sum(1), kind="stable")[: Pixel.MOST]
    return *(traced[name][0, x].astype(np.float32) for name in "NTV"), L[order].astype(np.float32), E[order]


def _reference_values(lobes: list[Lobe], N, T, V, L) -> tuple[np.ndarray, np.ndarray]:
    """f [lights, 3] in double, and what one unit of error is there."""
    value = unit = 0.0
    for lobe in lobes:
        inputs = {name: x[None] for name, x in _columns(lobe, N, T, V, L).items()}
        got = compare.reference_values(lobe.function, inputs, None)
        value, unit = value + got.value, unit + got.unit
    return value, unit
