"""The pictures of docs/viewer.md and README, of the window itself: python -m lobe.viewer.figures [NAME...]."""

from __future__ import annotations

import io
import sys
import time
from dataclasses import replace

from imgui_bundle import imgui

from ..lab import files
from ..lab.paths import ROOT
from . import command, numbers_panel
from . import state as states
from .state import Environment, Light, Lobe, Plots

FIGURES = ROOT / "docs" / "figures"
SIZE, LATER, SECONDS = (1280, 720), 40, 120


def split():
    """Gold between shader and reference, a pixel pointed at."""
    lobby = Environment(states.probes()["lobby"], 150.0)
    return replace(states.initial(), object="suzanne", environment=lobby, exposure=-1.0), (0.32, 0.55)


def difference():
    """What rounding does to a full Oren-Nayar, and its lobe."""
    sides = {"A": [Lobe(states.default_lobe("lobe_OrenNayar").key, {"albedo": (0.6, 0.4, 0.3), "sigma": (0.5,)})],
             "B": [states.default_lobe("lobe_OrenNayar_EON")]}
    lights = [Light("directional", (-0.5, 0.5, 0.9), (3.0, 3.0, 3.0))]
    plots = Plots("solid", logarithmic=False)
    return replace(states.initial(), object="suzanne", sides=sides, lights=lights, mode="difference", scale=4e-7,
                   plots=plots), None


def lobes():
    """What a cheaper lobe loses: GGX against GGX_fast."""
    return replace(states.initial(), against="B", mode="difference", scale=0.05,
                   plots=Plots("angle", both=True)), None


def traced():
    """Paths with shadows and interreflection beside the shader."""
    sides = {s: [Lobe(states.default_lobe("lobe_Lambert").key, {"albedo": (0.75, 0.45, 0.35)})] for s in states.SIDES}
    return replace(states.initial(), object="bunny", reference="traced", sides=sides, exposure=1.0,
                   plots=Plots("albedo")), None


ALL = {f.__name__: f for f in (split, difference, lobes, traced)}


def draw(name: str) -> None:
    """Draws the window until everything in it is there."""
    state, pointed = ALL[name]()
    app = command.start(state, SIZE, offscreen=True)
    app.services.reframe = True
    app.greeted, app.services.times = True, False
    app.frame()
    if pointed:
        x, y, width, height = app.picture_rect
        imgui.get_io().add_mouse_pos_event(x + pointed[0] * width, y + pointed[1] * height)
    end, quiet = time.monotonic() + SECONDS, 0
    while time.monotonic() < end and quiet < LATER:  # what takes long begins a while after the last change
        app.frame()
        time.sleep(0.02)
        there = command.settled(app) and app.services.idle and numbers_panel.complete(app.services)
        quiet = quiet + 1 if there else 0
    write(f"viewer-{name}.png", app.screenshot())
    app.release()


def write(name: str, shown) -> None:
    """A PNG of all colours, since a palette puts steps into a smooth difference."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(shown).save(buffer, "PNG", optimize=True)
    files.write_bytes(FIGURES / name, buffer.getvalue())


if __name__ == "__main__":
    for chosen in sys.argv[1:] or ALL:
        draw(chosen)
