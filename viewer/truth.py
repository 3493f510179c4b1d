"""The reference's picture, made in the background by threads of low priority while the window stays quick."""

from __future__ import annotations

import copy
import math
import os
import threading
import time
from dataclasses import dataclass, field

import numpy as np

from . import objects
from .state import State, default_lobe

NICE = 19
AWAKE_SECONDS = 2.0  # to wait for the reference's threads
WAKING_ROWS = 1 << 16
PASS_SECONDS = 0.2  # of one call into the tracer, after which a change is noticed
STRIP_VALUES = 1 << 17  # pixels times lights that are computed at once
MOST_SAMPLES = 1 << 14
GOOD_ENOUGH = 1e-3  # standard error over the mean at which a traced picture is done
COARSE = 4  # pixels of the first look, along each side
UNKNOWN, LOOK, BACKGROUND, OBJECT = 0.0, 0.25, 0.5, 1.0  # what alpha says of a pixel; of the object, OBJECT + triangle


@dataclass
class Job:
    """A picture that was asked for. `image` [h, w, 4] has row 0 on top, and fills while the job runs; `dirty` are the
    rows that are new since the window last took them."""

    key: object
    state: State
    size: tuple[int, int]
    image: np.ndarray
    version: int = 0  # grows with every change of the image
    rows: int = 0  # that are done, direct
    samples: int = 0
    error: float = math.inf  # standard error over the mean; 0 where there is no noise
    done: bool = False
    failure: str = ""
    cancelled: bool = False
    seconds: float = 0.0
    dirty: list[tuple[int, int]] = field(default_factory=list)  # ranges of rows


class Truth:
    """
    Runs the newest job; an older one ends as soon as it notices, but not before its first look, so that something is
    seen while the camera moves.

    job     the newest that was asked for
    shown   the newest that has something to show
    """

    def __init__(self, changed=lambda: None):
        self._changed = changed
        self._condition = threading.Condition()
        self._asked: Job | None = None
        self._stop = False
        self._scenes: dict = {}
        self._scene_lock = threading.Lock()
        self.job: Job | None = None
        self.shown: Job | None = None
        self._thread = threading.Thread(target=self._run, daemon=True, name="lobe-truth")
        self._awake = threading.Event()
        self._thread.start()
        self._awake.wait(AWAKE_SECONDS)

    def ask(self, key, state: State, size: tuple[int, int]) -> Job:
        """The job with this key: the one that runs, or a new one."""
        if self.job is None or self.job.key != key:
            if self.job:
                self.job.cancelled = True
            self.job = Job(key, copy.deepcopy(state), size, np.zeros((size[1], size[0], 4), np.float32))
            with self._condition:
                self._asked = self.job
                self._condition.notify()
        return self.job

    def cancel(self) -> None:
        """Nobody looks at the reference any more."""
        if self.job:
            self.job.cancelled = True
            self.job = None

    def stop(self) -> None:
        self.cancel()
        with self._condition:
            self._stop = True
            self._condition.notify()
        self._thread.join(timeout=10)

    def _run(self) -> None:
        low_priority()
        wake_threads()
        self._awake.set()
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._asked or self._stop)
                if self._stop:
                    return
                job, self._asked = self._asked, None
            started = time.perf_counter()
            try:
                (_direct if job.state.reference == "direct" else _traced)(self, job)
            except Exception as error:  # whatever it is, this thread goes on
                job.failure = str(error) or type(error).__name__
            job.seconds = time.perf_counter() - started
            job.done = not job.cancelled
            self._changed()

    def scene(self, kind: str, state: State):
        """A scene of the reference, direct or traced, kept while object, lights and material stay. Of any thread."""
        key = (state.object, repr((state.placement, state.lights, state.environment)),
               repr(state.sides["A"]) if kind == "traced" else "")
        with self._scene_lock:
            if self._scenes.get(kind, (None,))[0] != key:
                made = (objects.traced_scene if kind == "traced" else objects.direct_scene)(state)
                self._scenes[kind] = key, made
            return self._scenes[kind][1]

    def publish(self, job: Job, first: int, rows: int) -> None:
        job.dirty.append((first, rows))
        self.shown = job
        job.version += 1
        self._changed()


def wake_threads() -> None:
    """Has the reference start its threads, which inherit the priority of the one that first needs them, and keep it."""
    from lobe import reference

    lobe = default_lobe("lobe_Lambert")
    up = np.tile((0.0, 0.0, 1.0), (WAKING_ROWS, 1))
    reference.evaluate(lobe.key, objects.lobe_rows(lobe, up, up, up, up))


def low_priority() -> None:
    """Gives way to the window."""
    try:
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICE)
    except (AttributeError, OSError):
        pass  # no such thing on this system; the picture is only less smooth


def _direct(truth: Truth, job: Job) -> None:
    """Pixel centres, strip by strip, after a first look of fewer pixels."""
    scene, camera = truth.scene("direct", job.state), objects.camera(job.state)
    width, height = job.size
    small = max(width // COARSE, 1), max(height // COARSE, 1)
    look = np.zeros((small[1], small[0], 4), np.float32)
    _fill(job, scene, camera, look, lambda first, rows: None, lambda: False)
    look[..., 3][look[..., 3] >= OBJECT] = LOOK
    job.image[:] = look[np.arange(height) * small[1] // height][:, np.arange(width) * small[0] // width]
    truth.publish(job, 0, height)

    def publish(first, rows):
        job.rows = first + rows
        truth.publish(job, first, rows)

    if _fill(job, scene, camera, job.image, publish, lambda: job.cancelled):
        job.samples, job.error = 1, 0.0


def _fill(job: Job, scene, camera, image: np.ndarray, publish, cancelled) -> bool:
    """Fills an image; False where that was cancelled."""
    height, width = image.shape[:2]
    lights = max(len(objects.rays(job.state).colors), 1)
    step = max(1, min(height, STRIP_VALUES // (width * lights)))
    for first in range(0, height, step):
        rows = min(step, height - first)
        traced = scene.trace(camera, width, height, shadows=False, first=first, rows=rows)
        if cancelled():
            return False
        mask = traced["object"] >= 0
        N, T, V = (traced[name][mask] for name in "NTV")
        total = np.zeros((len(N), 3))
        if len(N):
            L, E = (traced[name][:, mask] for name in "LE")
            frame = (np.tile(x, (len(L), 1)) for x in (N, T, V))
            f = objects.reference_value(job.state.sides["A"], *frame, L.reshape(-1, 3))
            total = np.einsum("lni,lni->ni", f.reshape(E.shape), E)
        strip = np.zeros((rows, width, 4), np.float32)
        strip[..., 3] = coverage(traced)
        strip[mask, :3] = total
        image[first : first + rows] = strip
        publish(first, rows)
    return True


def coverage(traced: dict) -> np.ndarray:
    """Alpha of complete pixels, from what Scene.trace returns."""
    return np.where(traced["object"] >= 0, OBJECT + traced["primitive"], BACKGROUND)


def _traced(truth: Truth, job: Job) -> None:
    """Paths, sample after sample, after a first look of fewer pixels."""
    from lobe import reference

    scene, camera = truth.scene("traced", job.state), objects.camera(job.state)
    width, height = job.size
    small = max(width // COARSE, 1), max(height // COARSE, 1)
    look = reference.Render(scene, camera, *small, depth=job.state.depth)
    look.advance(4)
    seen = scene.trace(camera, *small, shadows=False)["object"] >= 0
    rows, columns = np.arange(height) * small[1] // height, np.arange(width) * small[0] // width
    _take(truth, job, look.beauty()[rows][:, columns], np.where(seen, LOOK, BACKGROUND)[rows][:, columns])
    if job.cancelled:
        return
    alpha = coverage(scene.trace(camera, width, height, shadows=False))
    render, count = reference.Render(scene, camera, width, height, depth=job.state.depth), 1
    render.set_target(GOOD_ENOUGH)
    while not job.cancelled and not render.finished and job.samples < MOST_SAMPLES:
        before = time.perf_counter()
        render.advance(count)
        if job.cancelled:
            return
        job.samples += count
        seconds = time.perf_counter() - before
        count = max(1, min(2 * count, int(count * PASS_SECONDS / max(seconds, 1e-6))))
        if job.samples > 1:
            job.error = render.error()
        _take(truth, job, render.beauty(), alpha)


def _take(truth: Truth, job: Job, beauty: np.ndarray, alpha: np.ndarray) -> None:
    for first in range(0, len(beauty), 64):  # in parts, so that none holds up the window
        part = slice(first, first + 64)
        job.image[part, :, :3] = np.where(alpha[part, :, None] == BACKGROUND, 0.0, beauty[part])
        job.image[part, :, 3] = alpha[part]
    truth.publish(job, 0, len(beauty))
