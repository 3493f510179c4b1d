"""`lobe view`: the window, or a picture of it."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from ..lab import catalogue, files, scene_schema
from ..lab.errors import InputError
from . import choices, objects
from . import state as states

FIRST_FRAMES = 5  # until what a frame has asked for is what the next one waits for
SWITCH_SECONDS = 5e-4  # of Python's threads: a frame should not wait for those in the background
MOST_SECONDS = {"direct": 600.0, "traced": 30.0}  # of a screenshot that waits: paths only get better and better


def view(scene: Path | None, mode: str | None, lobe: str | None, size: tuple[int, int], screenshot: Path | None,
         frames: int | None, density: float) -> None:
    if mode is not None and mode not in states.MODES:
        raise InputError(f"--mode {mode}: expected one of {', '.join(states.MODES)}")
    if screenshot is not None and screenshot.suffix.lower() != ".png":
        raise InputError(f"--screenshot {screenshot}: expected a file .png")
    if screenshot is not None:
        files.output_file(screenshot)
    state, notes = objects.opened(states.initial(), scene) if scene else (states.initial(), [])
    if mode is not None:
        state.mode = mode
    if lobe is not None:
        del state.sides["A"][1:]
        choices.become(state.sides["A"][0], states.lobes()[key_of(lobe)])
    app = start(state, size, screenshot is not None, density)
    app.services.reframe = scene is None or scene.suffix.lower() not in objects.SESSIONS
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


def key_of(lobe: str) -> str:
    """Of a lobe that --lobe names."""
    named, key = scene_schema.lobes(), lobe.replace(" ", "")
    if lobe not in named and key not in states.lobes():
        raise InputError(f"--lobe {lobe}: is no lobe of N, V, L{catalogue.like(lobe, named)}")
    return named[lobe][0].key if lobe in named else key


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
    """So many frames; or, where no number is given, until picture, reference and their numbers are complete."""
    from . import numbers_panel

    for _ in range(frames or FIRST_FRAMES):
        app.frame()
    end = time.monotonic() + MOST_SECONDS[app.state.reference]
    while frames is None and time.monotonic() < end and not (
            settled(app) and numbers_panel.complete(app.services) and app.services.idle):
        time.sleep(0.005)  # the reference needs the processor
        app.frame()
    if frames is None:
        app.frame()  # which shows what was completed during the last one


def settled(app) -> bool:
    job = app.services.job
    pictures = all(app.pictures[side].whole for side in ("A", "B") if side == "A" or app.state.against == "B")
    return pictures and (job is None or job.done and not job.dirty and app.reference.settled)
