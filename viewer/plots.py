"""Curves of the lobe: the shader's, thin, over the reference's, broad and pale. All are computed off the frame."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from imgui_bundle import imgui, implot, implot3d

from ..lab.catalogue import Function
from . import choices, curves, plausible, theme
from .curves import Curve
from .lobe_panel import wrapped
from .services import Services
from .state import CHANNELS, MOST_INCIDENCES, Lobe, Plots, State

KINDS = {"lobe": "Polar", "angle": "Over angle", "solid": "3D", "F": "F", "D": "D", "G": "G", "albedo": "Albedo"}
DECADES = 1.0, 4.0  # of a logarithmic radius below its largest value: least, most
FEWEST = 0.3  # decades of a logarithmic axis, if its curves have less
MARGIN = 0.05  # of what a plot's curves have, free above and below them
MOST_PINS = 4
ALBEDO_ANGLES = np.radians([0.1, 10, 20, 30, 40, 50, 55, 60, 65, 70, 74, 77, 80, 82, 84, 86, 87, 88, 89, 89.5])
REST_SECONDS = 0.2  # after the last change, before what takes long begins
ALBEDO_PART = 2  # angles whose shader values one frame computes
POLAR_BOTTOM, POLAR_TOP = -0.14, 1.14  # of the polar plot, whose largest value has radius 1
RINGS, SPOKES = 40, 72
DASHES, PIECES = 40, 5  # along a line of what the edited side is compared with; straight pieces of one dash
NARROW, WIDE = 11.5, 26.5  # em: the column of controls; a plot that is worth another one beside it
LEAST = 12.0  # em of a plot that is worth the controls beside it

# Distinct in every common form of colour blindness (after Okabe and Ito 2008), on dark ground.
PALETTE = ((0.34, 0.71, 0.91), (0.95, 0.62, 0.10), (0.25, 0.80, 0.60), (0.85, 0.55, 0.75), (0.94, 0.89, 0.35),
           (0.80, 0.36, 0.30))
GREY = (0.92, 0.92, 0.92)


@dataclass(frozen=True)
class Series:
    """One line: its angles x, radians, and values y; `line` is 0 for the edited side, 1 and more for what it is
    compared with."""

    label: str
    x: np.ndarray
    y: np.ndarray
    color: tuple[float, float, float]
    line: int
    is_reference: bool
    key: Hashable  # of what it was computed


class Shelf:
    """The newest values of each slot, with the key they are of: the last ones stay until new ones are ready."""

    _of: WeakKeyDictionary = WeakKeyDictionary()

    def __init__(self):
        self.values: dict[str, tuple] = {}
        self._changed: dict[str, tuple] = {}  # slot -> the key that was asked for last, and since when

    @classmethod
    def of(cls, services: Services) -> Shelf:
        return cls._of.setdefault(services, cls())

    def get(self, services: Services, slot: str, key, work: Callable[[], object], opengl: bool = False,
            patient: bool = False):
        """(key, value) of the newest that is ready, or None. What is `patient` begins when its key has been the same
        for a while: during a drag it would keep what is quick waiting."""
        if patient and not self._rests(slot, key):
            return self.values.get(slot)

        def kept():
            value = work()
            self.values[slot] = key, value  # even where a newer one was asked for: a drag would else show nothing
            return value

        services.later(slot, key, kept, opengl)
        return self.values.get(slot)

    def _rests(self, slot: str, key) -> bool:
        now = time.monotonic()
        if self._changed.get(slot, (None,))[0] != key:
            self._changed[slot] = key, now
        return now - self._changed[slot][1] >= REST_SECONDS


def draw(state: State, services: Services) -> None:
    plots = state.plots
    _kinds(plots)
    shown = kinds_shown(plots.kind, imgui.get_content_region_avail().x / imgui.get_font_size())
    spacing = imgui.get_style().item_spacing
    size = imgui.get_content_region_avail()
    controls = NARROW * imgui.get_font_size()
    if size.x < controls + LEAST * imgui.get_font_size():  # a small window shows the plot
        controls = 0.0
    width = (size.x - controls) / len(shown) - spacing.x
    clear = imgui.ImVec4(0.0, 0.0, 0.0, 0.0)
    implot.push_style_color(implot.Col_.frame_bg, clear)
    implot3d.push_style_color(implot3d.Col_.frame_bg, clear)
    drawn: list[Series] = []
    for kind in shown:
        drawn += _DRAWN[kind](state, services, imgui.ImVec2(width, size.y))
        imgui.same_line()
    implot3d.pop_style_color()
    implot.pop_style_color()
    if not controls:
        return imgui.new_line()
    if imgui.begin_child("controls", (0, size.y), imgui.ChildFlags_.nav_flattened):
        _controls(state, services, shown)
        if (error := apart(drawn)) is not None:
            imgui.text_disabled(f"apart by {error:.1g}")
            imgui.set_item_tooltip("The largest |shader - reference| of the curves, over the largest value of each")
    imgui.end_child()


def kinds_shown(kind: str, width: float) -> list[str]:
    """The plot that was chosen and, where a window of `width` em has room, those after it."""
    names = list(KINDS)
    first = names.index(kind) if kind in names else 0
    count = min(max(int((width - NARROW) / WIDE), 1), 4)
    return [names[(first + i) % len(names)] for i in range(count)]


def _kinds(plots: Plots) -> None:
    for name, label in KINDS.items():
        if theme.toggle(label, plots.kind == name):
            plots.kind = name
        imgui.same_line()
    imgui.new_line()


# --- controls ---------------------------------------------------------------------------------------------------------


def _controls(state: State, services: Services, shown: list[str]) -> None:
    plots, em = state.plots, imgui.get_font_size()
    if {"lobe", "angle", "solid", "D"} & set(shown):
        plots.logarithmic = imgui.checkbox("log", plots.logarithmic)[1]
        imgui.set_item_tooltip("Logarithmic, over the decades that the curves have, "
                               f"at most {DECADES[1]:.0f}")
        imgui.same_line()
    plots.reference = imgui.checkbox("reference", plots.reference)[1]
    imgui.set_item_tooltip("Reference of the edited side: broad, pale, under the shader's thin line")
    plots.both = imgui.checkbox(f"and {_other(state)}", plots.both)[1]
    imgui.set_item_tooltip("The lobe of the other side, dashed; a colour is then a lobe, and a shade of it an angle")
    imgui.same_line()
    imgui.begin_disabled(len(plots.pins) >= MOST_PINS)
    if imgui.small_button("pin"):
        plots.pins.append([Lobe(lobe.key, dict(lobe.values)) for lobe in state.sides[state.side]])
    imgui.end_disabled()
    imgui.set_item_tooltip("Keep these curves, dashed, beside those to come")
    if {"lobe", "angle", "solid", "G"} & set(shown):
        _incidences(state)
    if {"lobe", "angle", "albedo", "F"} & set(shown):
        imgui.set_next_item_width(-1)
        if imgui.begin_combo("##channel", plots.channel):
            for name in CHANNELS:
                if imgui.selectable(name, name == plots.channel)[0]:
                    plots.channel = name
            imgui.end_combo()
    if any(p.name == "T" for lobe in state.sides[state.side] for p in lobe.function.parameters):
        imgui.set_next_item_width(-1)
        plots.azimuth = imgui.slider_float("##azimuth", plots.azimuth, 0.0, 180.0, "%.0f° from T")[1]
        imgui.set_item_tooltip("The plane of incidence, from the tangent")
    removed = None
    for i, pin in enumerate(plots.pins):
        imgui.push_id(i)
        if imgui.small_button("x"):
            removed = i
        imgui.same_line(0, 0.4 * em)
        imgui.text_disabled(shortened(_name(pin), imgui.get_content_region_avail().x))
        imgui.set_item_tooltip("\n".join(choices.call(lobe.function, lobe.values) for lobe in pin))
        imgui.pop_id()
    if removed is not None:
        del plots.pins[removed]


def apart(series: list[Series]) -> float | None:
    """The largest difference of shader and reference, over the largest value of its curve; None where not both are
    there."""
    told = {(s.label, s.key): s.y for s in series if s.is_reference}
    pairs = [(s.y, told[s.label, s.key]) for s in series if not s.is_reference and (s.label, s.key) in told]
    return max((float(abs(y - exact).max() / max(abs(exact).max(), 1e-300)) for y, exact in pairs), default=None)


def several(state: State) -> bool:
    """Whether curves of more than one material are drawn: then these have the colours, and the angles have shades."""
    return state.plots.both or bool(state.plots.pins)


def tint(state: State, material: int, angle: int) -> tuple[float, float, float]:
    """The colour of a material's curve for the light at one of the angles."""
    return shaded(PALETTE[material], angle) if several(state) else PALETTE[angle]


def angle_tint(state: State, angle: int) -> tuple[float, float, float]:
    """The colour of what stands for an angle of all materials."""
    return shaded(GREY, angle) if several(state) else PALETTE[angle]


def shaded(color: tuple[float, float, float], step: int) -> tuple[float, float, float]:
    return tuple(c / (1 + 0.28 * step) for c in color)


def _incidences(state: State) -> None:
    """The angles of the light, each in the colour of its curve."""
    plots = state.plots
    changed = list(plots.incidences)
    width = 3.0 * imgui.get_font_size()
    for i, angle in enumerate(plots.incidences):
        if i % 3:
            imgui.same_line()
        imgui.push_id(f"incidence {i}")
        imgui.push_style_color(imgui.Col_.text, imgui.ImVec4(*angle_tint(state, i), 1.0))
        imgui.set_next_item_width(width)
        changed[i] = imgui.drag_float("##angle", angle, 0.5, 0.0, 89.9, "%.0f°", imgui.SliderFlags_.always_clamp)[1]
        imgui.pop_style_color()
        imgui.set_item_tooltip("Angle of the light from the normal: drag, or Enter to type. Right click removes it")
        if imgui.is_item_clicked(imgui.MouseButton_.right) and len(changed) > 1:
            changed[i] = None
        imgui.pop_id()
    plots.incidences = tuple(a for a in changed if a is not None)
    if len(plots.incidences) < MOST_INCIDENCES:
        if len(plots.incidences) % 3:
            imgui.same_line()
        if imgui.small_button("+"):
            plots.incidences += (20.0 + 10.0 * len(plots.incidences),)
        imgui.set_item_tooltip("Another angle of the light")


def shortened(text: str, width: float) -> str:
    """As much of a text as there is room for."""
    if imgui.calc_text_size(text).x <= width:
        return text
    while text and imgui.calc_text_size(text + "…").x > width:
        text = text[:-1]
    return text + "…"


def _other(state: State) -> str:
    return "B" if state.side == "A" else "A"


def _name(material: list[Lobe]) -> str:
    return " + ".join(choices.short(lobe.function) for lobe in material)


# --- values -----------------------------------------------------------------------------------------------------------


def materials(state: State) -> list[tuple[str, list[Lobe]]]:
    """Whose curves are drawn: the edited side, the other one, the pins."""
    found = [(state.side, state.sides[state.side])]
    if state.plots.both:
        found.append((_other(state), state.sides[_other(state)]))
    return found + [(f"pin {i + 1}", pin) for i, pin in enumerate(state.plots.pins)]


def summed(curves_of: list[list[Curve]], evaluate) -> list[tuple[np.ndarray, np.ndarray]]:
    """(x, values [n, 3]) of each list of curves that share their x: those of the lobes of one material."""
    return [(parts[0].x, sum(np.broadcast_to(c.of(evaluate), (len(c.x), 3)) for c in parts)) for parts in curves_of]


def values(services: Services, slot: str, key, make: Callable[[], list[list[Curve]]], part: int = 1 << 10,
           patient: bool = False) -> list[tuple[bool, Hashable, list[tuple[np.ndarray, np.ndarray]]]]:
    """(whether it is the reference's, the key it is of, a list of (x, values)) of what is ready: the reference's by the
    worker, which also makes the points; the shader's `part` lists of curves a frame."""
    shelf = Shelf.of(services)

    def reference():
        made = make()
        return made, summed(made, services.evaluate_reference)

    known = shelf.get(services, f"{slot} reference", key, reference, patient=patient)
    if known is None:
        return []
    made_key, (made, told) = known
    found, keys = [], set()
    for i in range(0, len(made), part):
        some = made[i : i + part]
        got = shelf.get(services, f"{slot} shader {i}", made_key,
                        lambda some=some: summed(some, services.evaluate_glsl), opengl=True)
        found += got[1] if got else []
        keys |= {got[0]} if got else set()
    whole = len(found) == len(made) and len(keys) == 1
    return [(True, made_key, told)] + ([(False, keys.pop(), found)] if whole else [])


def _key(material: list[Lobe], *more):
    return repr(material), *more


def channel(plots: Plots, rows: np.ndarray) -> np.ndarray:
    """[n, 3] -> [n]"""
    return rows @ np.asarray(CHANNELS[plots.channel])


def _plane_series(state: State, services: Services) -> list[Series]:
    plots, found = state.plots, []
    angles, azimuth = np.radians(plots.incidences), np.radians(plots.azimuth)
    shown = materials(state)
    for m, (name, material) in enumerate(shown):
        full = f"{name} {_name(material)}" if len(shown) < 4 else name

        def make(material=material):
            return [[curves.in_incidence_plane(lobe.function, lobe.values, a, azimuth) for lobe in material]
                    for a in angles]

        for is_reference, key, lists in values(services, f"plane {m}", _key(material, plots.incidences, azimuth), make):
            for i, (angle, (x, rows)) in enumerate(zip(plots.incidences, lists)):
                # One entry of the legend for all angles of a material, or one for each angle of the only one.
                label = f"{angle:.0f}°##{i}" if len(shown) == 1 else f"##{full} {i}" if i else full
                found.append(Series(label, x, channel(plots, rows), tint(state, m, i), m, is_reference, key))
    return [s for s in found if plots.reference or not s.is_reference]


def _albedo_series(state: State, services: Services) -> list[Series]:
    plots, found, azimuth = state.plots, [], np.radians(state.plots.azimuth)
    for m, (name, material) in enumerate(materials(state)):
        def make(material=material):
            rules = [plausible.integrated([(lobe.function, lobe.values)])[0] for lobe in material]
            return [[curves.albedo(lobe.function, lobe.values, np.array([a]), azimuth, rule)
                     for lobe, rule in zip(material, rules)] for a in ALBEDO_ANGLES]

        label = f"{name} {_name(material)}{', dashed' if m else ''}"
        for is_reference, key, lists in values(services, f"albedo {m}", _key(material, azimuth), make, ALBEDO_PART,
                                               patient=True):
            y = channel(plots, np.concatenate([rows for _, rows in lists]))
            found.append(Series(label, ALBEDO_ANGLES, y, PALETTE[m], m, is_reference, key))
    return [s for s in found if plots.reference or not s.is_reference]


def _term_series(state: State, services: Services, letter: str) -> list[Series]:
    plots, found = state.plots, []
    angles = plots.incidences if letter == "G" else (0.0,)
    azimuth = np.radians(plots.azimuth)
    for m, (name, material) in enumerate(materials(state)):
        for lobe in material:
            term = own_term(services, lobe.function, letter)
            if term is None:
                continue
            given = choices.term_values(term, lobe.values)
            single = len(angles) == 1 or curves.one_angle(term) or letter == "D"

            def make(term=term, given=given, single=single):
                return [[curves.term(term, given, np.radians(a), azimuth)] for a in (angles[:1] if single else angles)]

            label = f"{name} {choices.short(term)}{', dashed' if m else ''}"
            asked = term.key, repr(given), angles, azimuth
            for is_reference, key, lists in values(services, f"{letter} {m} {lobe.key}", asked, make):
                for i, (x, rows) in enumerate(lists):
                    shown = f"##{label} {i}" if i else label  # one entry of the legend for all angles
                    color = PALETTE[m] if single else tint(state, m, i)
                    found.append(Series(shown, x, channel(plots, rows), color, m, is_reference, key))
    return [s for s in found if plots.reference or not s.is_reference]


def own_term(services: Services, lobe: Function, letter: str) -> Function | None:
    shelf = Shelf.of(services)
    slot = f"term {letter} {lobe.key}"
    if shelf.values.get(slot, (None,))[0] is not services.library:
        shelf.values[slot] = services.library, choices.own_term(services.library, lobe, letter)
    return shelf.values[slot][1]


# --- drawing ----------------------------------------------------------------------------------------------------------


def dashes(x: np.ndarray, y: np.ndarray, scale: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Dashes along a line and as far apart as they are long, for a line of segments, [start, end, start, end...]: y
    counts `scale` times."""
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    if len(x) < 2:
        return x, y
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), scale * np.diff(y)))])
    pieces = np.linspace(0.0, along[-1], (2 * count - 1) * PIECES + 1)
    drawn = np.arange(len(pieces) - 1) // PIECES % 2 == 0
    even = np.stack([pieces[:-1][drawn], pieces[1:][drawn]], axis=1).ravel()
    return np.interp(even, along, x), np.interp(even, along, y)


def line(series: Series, x: np.ndarray, y: np.ndarray, scale: float, logarithmic: bool = False) -> None:
    """Broad and pale for the reference, thin for the shader; dashed, and the shader's alone, for what is beside the
    edited side."""
    if series.line and series.is_reference:
        return
    weight = (2.0 if series.line else 1.4) * imgui.get_style().font_scale_dpi
    color = imgui.ImVec4(*series.color, 0.35 if series.is_reference else 1.0)
    spec = implot.Spec(line_color=color, line_weight=4 * weight if series.is_reference else weight)
    if series.line:
        x, y = dashes(x, np.log10(y) if logarithmic else y, scale, DASHES)
        y = 10.0**y if logarithmic else y
        spec.flags = implot.LineFlags_.segments
    # The legend shows the shader's line alone.
    label = f"##{series.label} broad" if series.is_reference else series.label
    implot.plot_line(label, np.ascontiguousarray(x, float), np.ascontiguousarray(y, float), spec)


def legend(series: list[Series], width: float) -> float:
    """One row over a plot that curves fill; returns its height."""
    draw, em, begin = imgui.get_window_draw_list(), imgui.get_font_size(), imgui.get_cursor_screen_pos()
    right = begin.x + width
    x, y = begin.x + 0.3 * em, begin.y
    entries = {s.label.split("##")[0]: s for s in series if not s.label.startswith("##")}
    for label, s in entries.items():
        color = imgui.color_convert_float4_to_u32((*s.color, 1.0))
        for from_, to in ((0.0, 0.5), (0.8, 1.3)) if s.line else ((0.0, 1.3),):
            draw.add_line((x + from_ * em, y + 0.55 * em), (x + to * em, y + 0.55 * em), color, 0.14 * em)
        text = shortened(label, right - x - 1.6 * em)
        draw.add_text((x + 1.6 * em, y), imgui.get_color_u32(imgui.Col_.text), text)
        x += 2.6 * em + imgui.calc_text_size(text).x
    imgui.dummy((1.0, em))
    return imgui.get_cursor_screen_pos().y - y


def _empty(text: str, size: imgui.ImVec2) -> None:
    if imgui.begin_child("empty", size):
        wrapped(text, disabled=True)
    imgui.end_child()


_LOCKED = implot.AxisFlags_.lock | implot.AxisFlags_.no_menus
_PLOT = implot.Flags_.no_menus | implot.Flags_.no_box_select | implot.Flags_.no_title


def decades_of(curves_shown: list[np.ndarray]) -> float:
    """How far below the largest value a logarithmic plot goes: as far as the curves do, within DECADES."""
    y = np.concatenate([*curves_shown, np.empty(0)])
    y = y[np.isfinite(y) & (y > 0)]
    return float(np.clip(np.log10(y.max() / y.min()), *DECADES)) if len(y) else DECADES[0]


def logarithmic_limits(curves_shown: list[np.ndarray]) -> tuple[float, float]:
    """Of an axis that curves fill from bottom to top, DECADES[1] below the largest value at most."""
    y = np.concatenate([*curves_shown, np.empty(0)])
    y = y[np.isfinite(y) & (y > 0)]
    high = np.log10(y.max()) if len(y) else 0.0
    low = max(np.log10(y.min()), high - DECADES[1]) if len(y) else 0.0
    middle, half = (high + low) / 2, max((0.5 + MARGIN) * (high - low), FEWEST / 2)
    return float(10 ** (middle - half)), float(10 ** (middle + half))


def logarithmic_ticks(low: float, high: float) -> list[float]:
    """The powers of ten of a range and, where these are few, multiples between them."""
    steps = (1, 1.5, 2, 3, 4, 5, 7) if high / low < 5 else (1, 2, 5) if high / low < 200 else (1,)
    powers = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    return [float(p * s) for p in powers for s in steps if low <= p * s <= high]


def radius(f: np.ndarray, largest: float, decades: float | None) -> np.ndarray:
    """Of a polar plot in which the largest value has radius 1, and, where logarithmic, so many decades below it 0."""
    share = np.maximum(f, 0.0) / max(largest, 1e-300)
    return np.maximum(1.0 + np.log10(np.maximum(share, 1e-300)) / decades, 0.0) if decades else share


def _polar(state: State, services: Services, size: imgui.ImVec2) -> list[Series]:
    plots, series = state.plots, _plane_series(state, services)
    largest = max((float(s.y.max(initial=0.0)) for s in series), default=0.0)
    decades = decades_of([s.y for s in series]) if plots.logarithmic else None
    imgui.begin_group()
    size = imgui.ImVec2(size.x, size.y - legend(series, size.x))
    pad = 0.2 * imgui.get_font_size()
    implot.push_style_var(implot.StyleVar_.plot_padding, imgui.ImVec2(pad, pad))
    bare = implot.AxisFlags_.no_decorations | _LOCKED
    if implot.begin_plot("##polar", size, _PLOT | implot.Flags_.no_legend | implot.Flags_.no_mouse_text):
        implot.setup_axes("", "", bare, bare)
        aspect = (size.x - 2 * pad) / max(size.y - 2 * pad, 1.0)
        half = 0.5 * (POLAR_TOP - POLAR_BOTTOM) * aspect  # a unit is as long both ways
        widened = max(POLAR_TOP / half, 1.0)
        implot.setup_axes_limits(-half * widened, half * widened, POLAR_BOTTOM * widened, POLAR_TOP * widened,
                                 implot.Cond_.always)
        _polar_grid(decades, largest)
        for s in series:
            r = radius(s.y, largest, decades)
            line(s, r * np.sin(s.x), r * np.cos(s.x), 1.0)
        for i, angle in enumerate(np.radians(plots.incidences)):
            spec = implot.Spec(line_color=imgui.ImVec4(*angle_tint(state, i), 0.9), line_weight=2.0)
            ends = np.array([1.0, 1.05])
            implot.plot_line(f"##light {i}", -np.sin(angle) * ends, np.cos(angle) * ends, spec)
        implot.end_plot()
    implot.pop_style_var()
    imgui.end_group()
    return series


def _polar_grid(decades: float | None, largest: float) -> None:
    faint = implot.Spec(line_color=imgui.ImVec4(1.0, 1.0, 1.0, 0.14), line_weight=1.0)
    turn = np.linspace(-np.pi / 2, np.pi / 2, 91)
    for share in (0.25, 0.5, 0.75, 1.0):
        implot.plot_line("##ring", share * np.sin(turn), share * np.cos(turn), faint)
    for angle in np.radians(np.arange(-90, 91, 30)):
        implot.plot_line("##ray", np.array([0.0, np.sin(angle)]), np.array([0.0, np.cos(angle)]), faint)
    for angle in (-60, -30, 30, 60):
        implot.plot_text(f"{abs(angle)}°", 1.1 * np.sin(np.radians(angle)), 1.07 * np.cos(np.radians(angle)))
    if largest > 0:
        value = largest * 10.0 ** (-decades / 2) if decades else largest / 2
        implot.plot_text(f"{value:.2g}", 0.5, 0.5 * POLAR_BOTTOM)
        inwards = imgui.ImVec2(-0.8 * imgui.get_font_size(), 0.0)  # whole in a narrow plot, too
        implot.plot_text(f"{largest:.2g} /sr", 1.0, 0.5 * POLAR_BOTTOM, inwards)
    implot.plot_text("light", -0.75, 0.5 * POLAR_BOTTOM)


def _over_angle(state: State, services: Services, size: imgui.ImVec2) -> list[Series]:
    series = _plane_series(state, services)
    imgui.begin_group()
    size = imgui.ImVec2(size.x, size.y - legend(series, size.x))
    _angles("##angle", series, size, "angle of the view", "f [1/sr]", state.plots.logarithmic, (-90.0, 90.0),
            corner=None)
    imgui.end_group()
    return series


def _albedo(state: State, services: Services, size: imgui.ImVec2) -> list[Series]:
    series = _albedo_series(state, services)
    top = max((float(s.y.max(initial=0.0)) for s in series), default=0.0)
    _angles("##albedo", series, size, "angle of the view", "albedo", False, (0.0, 90.0), (0.0, 1.05 * max(top, 1.0)),
            mark=1.0, corner=_free(series, max(top, 1.0)))
    return series


_LEGEND = {"D": implot.Location_.north_east, "G": implot.Location_.south}  # where their curves are not


def _free(series: list[Series], high: float) -> implot.Location_:
    """The corner on the left that curves, which begin there, leave free."""
    begins = max((float(s.y[0]) for s in series), default=0.0)
    return implot.Location_.south_west if begins > 0.55 * high else implot.Location_.north_west


def _term(letter: str):
    def draw_term(state: State, services: Services, size: imgui.ImVec2) -> list[Series]:
        series = _term_series(state, services, letter)
        if not series:
            named = ", ".join(choices.short(lobe.function) for lobe in state.sides[state.side])
            what = {"F": "no Fresnel term F", "D": "no distribution D", "G": "no masking G"}[letter]
            _empty(f"{named} has {what} of its own in the library.", size)
            return []
        left = -90.0 if any(s.x[0] < 0 for s in series) else 0.0
        top = max(float(s.y.max(initial=0.0)) for s in series)
        limits = None if letter == "D" else (0.0, max(1.05, 1.05 * top))
        about = {"F": "angle of incidence", "D": "tilt of the facet", "G": "angle of the view"}[letter]
        _angles(f"##{letter}", series, size, about, "D [1/sr]" if letter == "D" else letter,
                letter == "D" and state.plots.logarithmic, (left, 90.0), limits,
                corner=_LEGEND[letter] if letter in _LEGEND else _free(series, top))
        return series
    return draw_term


def _angles(title: str, series: list[Series], size: imgui.ImVec2, x_label: str, y_label: str, logarithmic: bool,
            x_limits: tuple[float, float], y_limits: tuple[float, float] | None = None, mark: float | None = None,
            corner: implot.Location_ | None = implot.Location_.north_west) -> None:
    """Values over an angle in degrees; a legend in the corner that is given."""
    largest = max((float(s.y.max(initial=0.0)) for s in series), default=0.0) or 1.0
    low, high = y_limits or (logarithmic_limits([s.y for s in series]) if logarithmic
                             else (0.0, (1 + MARGIN) * largest))
    if not implot.begin_plot(title, size, _PLOT | (0 if corner is not None else implot.Flags_.no_legend)):
        return
    implot.setup_axes(x_label, y_label, _LOCKED, _LOCKED)
    implot.setup_axis_limits(implot.ImAxis_.x1, *x_limits, implot.Cond_.always)
    implot.setup_axis_limits(implot.ImAxis_.y1, low, high, implot.Cond_.always)
    if logarithmic:
        implot.setup_axis_scale(implot.ImAxis_.y1, implot.Scale_.log10)
        marks = logarithmic_ticks(low, high)
        implot.setup_axis_ticks(implot.ImAxis_.y1, marks, [f"{t:.3g}" for t in marks])
    ticks = list(np.arange(x_limits[0], x_limits[1] + 1, 30.0))
    implot.setup_axis_ticks(implot.ImAxis_.x1, ticks, [f"{t:.0f}°" for t in ticks])
    if corner is not None:
        implot.setup_legend(corner, implot.LegendFlags_.no_buttons)
    if mark is not None:
        spec = implot.Spec(line_color=imgui.ImVec4(1.0, 1.0, 1.0, 0.3), line_weight=1.0)
        implot.plot_line("##mark", np.array(x_limits), np.array([mark, mark]), spec)
    for s in series:
        y = np.maximum(s.y, 0.1 * low) if logarithmic else s.y
        height = np.log10(high / low) if logarithmic else high - low
        line(s, np.degrees(s.x), y, (x_limits[1] - x_limits[0]) / (2.0 * height), logarithmic)
    implot.end_plot()


def _solid(state: State, services: Services, size: imgui.ImVec2) -> list[Series]:
    """The lobe over the hemisphere, for a light at the last of the angles."""
    plots, material = state.plots, state.sides[state.side]
    angle, azimuth = np.radians(plots.incidences[-1]), np.radians(plots.azimuth)

    def make():
        return [[curves.over_hemisphere(lobe.function, lobe.values, angle, azimuth, RINGS, SPOKES)
                 for lobe in material]]

    ready = values(services, "solid", _key(material, angle, azimuth), make)
    flags = implot3d.Flags_.no_legend | implot3d.Flags_.no_title | implot3d.Flags_.no_menus
    if not implot3d.begin_plot("##solid", size, flags):
        return []
    bare = implot3d.AxisFlags_.no_tick_labels | implot3d.AxisFlags_.no_tick_marks
    f = channel(plots, ready[-1][2][0][1]) if ready else np.ones(1)
    largest, decades = float(f.max()), decades_of([f]) if plots.logarithmic else None
    kind = "log" if decades else "linear"
    implot3d.setup_axes("T", "B", f"f, 1/sr, {kind}", bare, bare, implot3d.AxisFlags_.none)
    ticks = np.array([0.0, 0.5, 1.0])
    told = largest * 10.0 ** ((ticks - 1) * decades) if decades else largest * ticks
    implot3d.setup_axis_ticks(implot3d.ImAxis3D_.z, ticks, [f"{x:.2g}" for x in told])
    implot3d.setup_axes_limits(-1.0, 1.0, -1.0, 1.0, 0.0, 1.0, implot3d.Cond_.always)
    scale = min(1.75, 0.85 * size.x / max(size.y, 1.0))  # whole, in narrow plots too
    implot3d.setup_box_scale(scale, scale, scale / 2)
    if ready:
        r = radius(f, largest, decades)
        directions = curves.grid(angle, azimuth, RINGS, SPOKES).reshape(-1, 3)
        surface = np.ascontiguousarray((r[:, None] * directions).T.astype(np.float32))
        implot3d.push_colormap("Viridis")
        smooth = implot3d.Spec(flags=implot3d.SurfaceFlags_.no_lines)
        implot3d.plot_surface("lobe", *surface, SPOKES, RINGS, spec=smooth)
        implot3d.pop_colormap()
    towards = curves.in_plane(-angle, azimuth)[0].astype(np.float32)
    color = imgui.ImVec4(*angle_tint(state, len(plots.incidences) - 1), 1.0)
    ray = np.outer(towards, np.float32([0.0, 0.9]))
    implot3d.plot_line("light", *ray, implot3d.Spec(line_color=color, line_weight=2.0))
    at = implot3d.plot_to_pixels(*map(float, 1.1 * towards))
    implot3d.end_plot()
    theme.label(imgui.get_window_draw_list(), at.x, at.y, f"light {plots.incidences[-1]:.0f}°")  # over the lobe
    return []


_DRAWN = {"lobe": _polar, "angle": _over_angle, "solid": _solid, "albedo": _albedo} | {x: _term(x) for x in "FDG"}
