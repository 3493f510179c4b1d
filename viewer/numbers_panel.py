"""Numbers of the pixel under the mouse and of the picture; plausibility and cost of the lobe; what B would lose."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from weakref import WeakKeyDictionary

import numpy as np
from imgui_bundle import imgui

from . import choices, plausible
from .lobe_panel import once, wrapped
from .plots import Shelf
from .services import Pixel, Services
from .state import Lobe, State
from .truth import low_priority

GOOD, BAD, UNKNOWN, DOUBTFUL = (0.25, 0.78, 0.45), (0.92, 0.33, 0.28), (0.45, 0.45, 0.45), (0.93, 0.72, 0.25)
_TABLE = imgui.TableFlags_.sizing_stretch_same | imgui.TableFlags_.pad_outer_x
_light_shown: WeakKeyDictionary = WeakKeyDictionary()  # services -> which light's numbers are told


def draw(state: State, services: Services) -> None:
    imgui.separator_text("Pixel under the mouse")
    _pixel(services)
    imgui.separator_text(f"Picture, A against {state.against}")
    _picture(state, services)
    imgui.separator_text(f"{state.side} is plausible")
    _plausible(state, services)
    imgui.separator_text("Cost")
    _cost(state, services)
    imgui.separator_text("If B took the place of A")
    _loss(state, services)


# --- pixel ------------------------------------------------------------------------------------------------------------


def _pixel(services: Services) -> None:
    pixel = services.pixel
    if pixel is None:
        return wrapped("Point at the object to see N, V, L and f.", disabled=True)
    shown = min(_light_shown.get(services, 0), len(pixel.L) - 1)
    imgui.text(f"pixel {pixel.x}, {pixel.y}")
    if len(pixel.L) > 1:
        imgui.same_line()
        imgui.set_next_item_width(-1)
        chosen = imgui.slider_int("##light", shown + 1, 1, len(pixel.L), "light %d, by brightness")[1]
        shown = _light_shown[services] = min(max(chosen, 1), len(pixel.L)) - 1
    _pixel_table(pixel, shown)


def _pixel_table(pixel: Pixel, light: int) -> None:
    f = pixel.f_glsl[light]
    rows = [("N", pixel.N, "%.4f"), ("V", pixel.V, "%.4f"), ("L", pixel.L[light], "%.4f")]
    if pixel.f_B is None:
        rows += [("f GLSL", f, "%.4g"), ("f ref.", pixel.f_reference[light], "%.4g"),
                 ("units", pixel.units[light], "%.2f")]
    else:
        rows += [("f A", f, "%.4g"), ("f B", pixel.f_B[light], "%.4g"), ("A - B", f - pixel.f_B[light], "%.2g")]
    if not imgui.begin_table("pixel", 4, _TABLE):
        return
    imgui.table_setup_column("", imgui.TableColumnFlags_.width_fixed)
    for name, values, form in rows:
        imgui.table_next_row()
        imgui.table_next_column()
        imgui.text_disabled(name)
        if name == "units":
            imgui.set_item_tooltip("Error in units of 2^-24 (1 + condition number) |f|, as lobe compare counts it")
        for value in np.broadcast_to(values, 3):
            imgui.table_next_column()
            imgui.text(form % value)
    imgui.end_table()


# --- whole picture ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Errors:
    """Of a picture, over the pixels in which both have the same of the object."""

    largest: float
    most: float  # what 99 % of the channels stay below
    rms: float
    relative: float  # rms over the mean of the reference
    nonfinite: int
    pixels: int


def errors(shader: np.ndarray, reference: np.ndarray) -> Errors:
    both = (shader[..., 3] >= 1) & (shader[..., 3] == reference[..., 3])
    a, b = shader[both][:, :3].astype(float), reference[both][:, :3].astype(float)
    finite = np.isfinite(a).all(1) & np.isfinite(b).all(1)
    difference = (a - b)[finite]
    rms = float(np.sqrt(np.mean(difference**2))) if len(difference) else 0.0
    mean = float(np.mean(b[finite])) if len(difference) else 0.0
    most = float(np.quantile(abs(difference), 0.99)) if len(difference) else 0.0
    return Errors(float(abs(difference).max(initial=0.0)), most, rms, rms / mean if mean > 0 else 0.0,
                  int((~np.isfinite(shader[..., :3])).any(-1).sum()), int(both.sum()))


class Flip:
    """Mean FLIP of the newest pictures. Its library holds Python's lock for seconds: another process has it do."""

    _of: WeakKeyDictionary = WeakKeyDictionary()

    def __init__(self):
        self.value: float | None = None
        self.key = None
        self._thread: threading.Thread | None = None
        self._earliest = 0.0  # when the next may begin, so that pictures that keep changing take a fifth of a processor

    @classmethod
    def of(cls, services: Services) -> Flip:
        return cls._of.setdefault(services, cls())

    def ask(self, key, shader: np.ndarray, reference: np.ndarray) -> float | None:
        """The value for these pictures, None until it is there. One process at a time."""
        if self.key == key:
            return self.value
        if time.monotonic() >= self._earliest and (self._thread is None or not self._thread.is_alive()):
            self._thread = threading.Thread(target=self._run, args=(key, shader, reference), daemon=True)
            self._thread.start()
        return None

    def _run(self, key, shader: np.ndarray, reference: np.ndarray) -> None:
        low_priority()
        began = time.monotonic()
        both = ((shader[..., 3] >= 1) & (reference[..., 3] >= 1))[..., None]
        packed = BytesIO()
        for picture in (reference, shader):
            np.save(packed, np.where(both, np.nan_to_num(picture[..., :3]), 0.0).astype(np.float32))
        done = subprocess.run([sys.executable, "-m", "lobe.viewer.flip"], input=packed.getvalue(), capture_output=True)
        try:
            self.value = float(done.stdout)
        except ValueError:
            self.value = float("nan")
        self._earliest = time.monotonic() + 4 * (time.monotonic() - began)
        self.key = key


def _picture(state: State, services: Services) -> None:
    found = services.images()
    if found is None or found[0][0] != state.against:
        return wrapped("comes when both pictures are complete", disabled=True)
    key, shader, reference = found
    slot = services.later("picture errors", (key, id(shader)), lambda: errors(shader, reference))
    if slot.value is None:
        return wrapped("being counted", disabled=True)
    told: Errors = slot.value
    flip = _flip_text(Flip.of(services), (key, id(shader)), shader, reference, services.showing)
    rows = [("largest", f"{told.largest:.3g}  (99 % below {told.most:.2g})",
             f"|A - {state.against}| of any channel"),
            ("rms", f"{told.rms:.3g}  ({told.relative:.2g} of the mean)", "Root of the mean square of the difference"),
            ("FLIP", flip, "Mean FLIP of the pictures as a display shows them"),
            ("not finite", f"{told.nonfinite} of {told.pixels}", "Pixels of the shader that are NaN or infinite")]
    with _grey(slot.ready_key is None or slot.ready_key[0][:2] != services.showing):
        _rows(rows)


@contextmanager
def _grey(is_stale: bool):
    """Numbers of what is no longer shown, until those of what is shown are there."""
    imgui.begin_disabled(is_stale)
    yield
    imgui.end_disabled()


def complete(services: Services) -> bool:
    """Whether the numbers of the picture are those of what is shown."""
    found, slot, flip = services.images(), services.slot("picture errors"), Flip.of(services)
    return (found is not None and found[0][:2] == services.showing and services.slot("images").fresh
            and slot.fresh and slot.ready_key == flip.key == (found[0], id(found[1])))


def _flip_text(flip: Flip, key, shader: np.ndarray, reference: np.ndarray, showing: tuple) -> str:
    """The value; followed by dots while that of newer pictures of the same is computed, as when light is traced."""
    value = flip.ask(key, shader, reference)
    if flip.key is None or flip.key[0][:2] != showing:
        return "..."
    return f"{flip.value:.2g}" if value is not None else f"{flip.value:.2g} ..."


def _rows(rows: list[tuple[str, str, str]]) -> None:
    width = max(imgui.calc_text_size(name).x for name, _, _ in rows) + imgui.get_font_size()
    for name, text, tip in rows:
        imgui.text_disabled(name)
        if tip:
            imgui.set_item_tooltip(tip)
        imgui.same_line(width)
        wrapped(text)


# --- plausibility -----------------------------------------------------------------------------------------------------


def _parts(material: list[Lobe]) -> plausible.Material:
    return [(lobe.function, dict(lobe.values)) for lobe in material]


def _plausible(state: State, services: Services) -> None:
    parts = _parts(state.sides[state.side])
    known = Shelf.of(services).get(services, "plausible", repr(state.sides[state.side]),
                                   lambda: plausible.measure(parts), patient=True)
    if known is None:
        _lamp(UNKNOWN, "reciprocal", "being measured")
        return _lamp(UNKNOWN, "energy", "being measured")
    stale = known[0] != repr(state.sides[state.side])
    with _grey(stale):
        _lamps(known[1], stale)


def _lamps(found: plausible.Plausibility, stale: bool) -> None:
    asymmetry = "f(V, L) = f(L, V)" if found.is_reciprocal else f"no: up to {100 * found.asymmetry:.2g} % apart"
    _lamp(UNKNOWN if stale else GOOD if found.is_reciprocal else BAD, "reciprocal", asymmetry)
    sure = found.is_certain
    about = "" if sure else "about "
    _lamp(UNKNOWN if stale else DOUBTFUL if not sure else GOOD if found.keeps_energy else BAD, "energy",
          f"albedo {about}{found.albedo:.4g} at {np.degrees(found.angle):.0f}°")
    imgui.set_item_tooltip("The largest albedo of any channel, integrated with the reference"
                           + ("" if sure else f"; too narrow for the integral, which is off by {found.doubt:.2g}"))


def _lamp(color: tuple[float, float, float], name: str, text: str) -> None:
    em = imgui.get_font_size()
    at = imgui.get_cursor_screen_pos()
    draw = imgui.get_window_draw_list()
    packed = imgui.color_convert_float4_to_u32((*color, 1.0))
    draw.add_circle_filled((at.x + 0.5 * em, at.y + 0.5 * em), 0.32 * em, packed)
    imgui.dummy((em, em))
    imgui.same_line()
    imgui.text_disabled(name)
    imgui.same_line(6.2 * em)
    wrapped(text)


# --- cost -------------------------------------------------------------------------------------------------------------


def cycles(material: list[Lobe], services: Services) -> int | None:
    """Of the sum; None where one of them is not measured."""
    each = [once(services, ("cycles", lobe.key), lambda lobe=lobe: choices.cycles(services.library, lobe.function))
            for lobe in material]
    return None if None in each else sum(each)


def _cost(state: State, services: Services) -> None:
    count = cycles(state.sides[state.side], services)
    rows = [("cycles", "not measured: ./lobe chart" if count is None else f"{count} for 64 pixels (RDNA2)",
             "How long 64 calls keep one SIMD unit busy, from benchmarks/results/chart.json")]
    if services.times:
        rows += [
            ("picture", f"{services.picture_ms:.1f} ms", f"To draw the shader's picture here, on {services.renderer}"),
            ("frame", f"{services.frame_ms:.1f} ms", "Of this window, all in all; the median of the last ones")]
    _rows(rows)


def _loss(state: State, services: Services) -> None:
    """What do I lose with the cheaper one?"""
    A, B = state.sides["A"], state.sides["B"]
    for side in "AB":
        names = " + ".join(choices.short(lobe.function) for lobe in state.sides[side])
        count = cycles(state.sides[side], services)
        wrapped(f"{side}  {names}" + ("" if count is None else f", {count} cycles"))
    if repr(A) == repr(B):
        return wrapped("A and B are the same.", disabled=True)
    if (alike := [_like(a, b) for a, b in zip(A, B)]) != B[: len(A)] and imgui.small_button("give B the values of A"):
        B[: len(alike)] = alike
    spent = cycles(A, services), cycles(B, services)
    if None not in spent and spent[0] > 0:
        share = 100 * (spent[1] / spent[0] - 1)
        much = f"{abs(share):.0f} % {'less' if share < 0 else 'more'}" if spent[0] != spent[1] else "as much"
        wrapped(f"B costs {much}.")
    parts = _parts(A), _parts(B)
    known = Shelf.of(services).get(services, "loss", (repr(A), repr(B)), lambda: plausible.loss(*parts),
                                   patient=True)
    if known is None:
        return
    with _grey(known[0] != (repr(A), repr(B))):
        _lost(known[1])


def _lost(found: plausible.Loss) -> None:
    wrapped(f"The difference is {share_text(found.moved)} of the light that A sends back, "
            f"{share_text(found.worst)} for a view at {np.degrees(found.worst_angle):.0f}°; albedos are up to "
            f"{found.albedo:.2g} apart, at {np.degrees(found.albedo_angle):.0f}°.")
    imgui.set_item_tooltip("The integral of |f_A - f_B| N.L over lights, over that of f_A: the mean over views, and "
                           "the largest; by the reference")


def _like(a: Lobe, b: Lobe) -> Lobe:
    """The lobe b with what a says of the parameters that both have."""
    told = {name: value for name, value in a.values.items() if b.function.parameter(name)}
    return Lobe(b.key, choices.carried_over(b.values | told, b.function))


def share_text(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"
