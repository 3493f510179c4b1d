"""`lobe view`: the window, or a picture of it."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from ..lab import files
from ..lab.errors import InputError
from . import state as states

SWITCH_SECONDS = 5e-4  # of Python's threads: a frame should not wait for those in the background
MOST_FRAMES = 2000  # of a screenshot that waits for the reference


def view(scene: Path | None, mode: str | None, lobe: str | None, size: tuple[int, int], screenshot: Path | None,
         frames: int | None, density: float) -> None:
    if mode is not None and mode not in states.MODES:
        raise InputError(f"--mode {mode}: expected one of {', '.join(states.MODES)}")
    if screenshot is not None and screenshot.suffix.lower() != ".png":
        raise InputError(f"--screenshot {screenshot}: expected a file .png")
    if screenshot is not None:
        files.output_file(screenshot)
    state, notes = states.load(scene) if scene else (states.initial(), [])
    if mode is not None:
        state.mode = mode
    if lobe is not None:
        state.sides["A"] = [states.default_lobe(lobe)]
        require_shown(state.sides["A"][0])
    app = start(state, size, screenshot is not None, density)
    app.services.reframe = scene is None
    for note in notes:
        app.services.notice(note)
    try:
        if screenshot is None:
            app.run(frames)
        else:
            draw(app, frames)
            files.write_png(screenshot, app.screenshot())
    finally:
        app.release()


def require_shown(lobe: states.Lobe) -> None:
    if not lobe.function.takes_vectors:
        raise InputError(f"--lobe {lobe.function.name}: is no lobe of N, V, L, expected one of "
                         f"{', '.join(f.name for f in states.lobes().values())}")


def start(state, size: tuple[int, int], offscreen: bool, density: float = 1.0):
    """The viewer in a window, or in none."""
    from . import app, window

    sys.setswitchinterval(SWITCH_SECONDS)
    if offscreen:
        return app.App(window.Offscreen(*size, density=density), state)
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError(window.NO_DISPLAY.format("neither DISPLAY nor WAYLAND_DISPLAY is set"))
    return app.App(window.Glfw(*size), state)


def draw(app, frames: int | None) -> None:
    """So many frames; or, where no number is given, until the picture and the reference are complete."""
    import time

    for i in range(frames or MOST_FRAMES):
        app.frame()
        if frames is None:
            if settled(app) and i > 3:
                return
            time.sleep(0.005)  # the reference needs the processor


def settled(app) -> bool:
    job = app.services.job
    pictures = all(app.pictures[side].whole for side in ("A", "B") if side == "A" or app.state.against == "B")
    return pictures and (job is None or job.done and not job.dirty and app.reference.settled)
