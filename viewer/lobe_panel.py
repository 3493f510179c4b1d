"""The lobes of side A or B: which, with which parameters; values worth starting from; the GLSL to paste."""

from __future__ import annotations

import webbrowser
from collections.abc import Hashable
from weakref import WeakKeyDictionary

from imgui_bundle import imgui

from ..lab import gallery, papers
from ..lab.catalogue import Function, Parameter
from . import choices, presets, theme
from .services import Services
from .state import SIDES, Lobe, State

MOST_LOBES = 4  # of one material
CLOSING = 3  # frames, until ImGui has chosen what has the focus after a popup
LIST = imgui.Key.l  # opens the list of lobes
_SLIDER = (imgui.SliderFlags_.always_clamp | imgui.SliderFlags_.no_round_to_format).value
_COLOUR = (imgui.ColorEditFlags_.float | imgui.ColorEditFlags_.picker_hue_wheel).value
_searched: WeakKeyDictionary = WeakKeyDictionary()  # services -> the text in the search box
_closed: WeakKeyDictionary = WeakKeyDictionary()  # services -> (list that was closed, frames to keep)
_offered: WeakKeyDictionary = WeakKeyDictionary()  # services -> what was computed of the library, by what it is


def draw(state: State, services: Services) -> None:
    _sides(state)
    material = state.sides[state.side]
    removed = None
    for i, lobe in enumerate(material):
        imgui.push_id(f"{state.side}{i}")
        if i:
            imgui.separator_text("plus")
        if _lobe(material, i, services):
            removed = i
        imgui.pop_id()
    if removed is not None:
        del material[removed]
    if len(material) < MOST_LOBES:
        imgui.separator()
        if imgui.small_button("+ add a lobe"):
            material.append(_with_defaults(services.library.find("lobe_Lambert")[0]))
        imgui.set_item_tooltip("A material is the sum of its lobes, as most engines make it")


def _sides(state: State) -> None:
    for side in SIDES:
        names = " + ".join(choices.short(lobe.function) for lobe in state.sides[side])
        if imgui.radio_button(side, state.side == side):
            state.side = side
        imgui.set_item_tooltip(f"{side} is {names}. Edit it (key S); X swaps A and B")
        imgui.same_line()
    other = next(side for side in SIDES if side != state.side)
    if imgui.small_button(f"copy to {other}"):
        state.sides[other] = [Lobe(lobe.key, dict(lobe.values)) for lobe in state.sides[state.side]]


def _lobe(material: list[Lobe], i: int, services: Services) -> bool:
    """One lobe; whether it shall go."""
    lobe = material[i]
    removable = len(material) > 1
    imgui.set_next_item_width(-1.8 * imgui.get_font_size() if removable else -1)
    _chooser(lobe, services, asked=i == 0 and _pressed(LIST))
    removed = False
    if removable:
        imgui.same_line()
        removed = imgui.button("x")
        imgui.set_item_tooltip("Remove this lobe from the sum")
    function = lobe.function
    wrapped(function.description, disabled=True)
    if function.formula and imgui.begin_item_tooltip():
        imgui.text_unformatted("\n".join(function.formula))
        imgui.end_tooltip()
    width = max((imgui.calc_text_size(p.name).x for p in function.parameters if not p.is_geometry), default=0.0)
    imgui.push_item_width(-width - imgui.get_style().item_inner_spacing.x)
    for p in function.parameters:
        if not p.is_geometry:
            lobe.values[p.name] = slider(p, lobe.values.get(p.name, p.default), choices.about(function, p))
    imgui.pop_item_width()
    _starts(lobe, services)
    _takes(lobe, services)
    return removed


def _pressed(key: imgui.Key) -> bool:
    io = imgui.get_io()
    alone = not (io.want_text_input or io.key_ctrl or io.key_shift or io.key_alt)
    return alone and imgui.is_key_pressed(key, False)


# --- which lobe -------------------------------------------------------------------------------------------------------


def _chooser(lobe: Lobe, services: Services, asked: bool) -> None:
    """A list of all lobes by group and year, with a search; Enter takes the one that is marked. `asked` opens it."""
    function, combo = lobe.function, imgui.get_id("##lobe")
    if asked:
        imgui.open_popup(imgui.internal.im_hash_str("##ComboPopup", 0, imgui.get_id("##lobe")))
    if not imgui.begin_combo("##lobe", f"{choices.short(function)}  {gallery.year(function)}",
                             imgui.ComboFlags_.height_largest):
        return _keep_focus(services, combo)
    if imgui.is_window_appearing():
        imgui.set_keyboard_focus_here()
        _searched[services] = ""
    imgui.set_next_item_width(-1)
    entered, text = imgui.input_text_with_hint("##search", "search: name, author, year, word",
                                               _searched.get(services, ""), imgui.InputTextFlags_.enter_returns_true)
    _searched[services] = text
    found = choices.groups(services.library, text)
    best = choices.best(services.library, text)
    chosen = best if entered else None
    marked = (best or function).key
    for group, functions in found.items():
        imgui.separator_text(group)
        for f in functions:
            cycles = once(services, ("cycles", f.key), lambda: choices.cycles(services.library, f))
            if imgui.selectable(f"{gallery.year(f)}  {choices.short(f)}##{f.key}", f.key == marked)[0]:
                chosen = f
            if f.key == function.key and imgui.is_window_appearing():
                imgui.set_item_default_focus()
            imgui.set_item_tooltip(f.description)
            if cycles is not None:
                told = f"{cycles}"
                imgui.same_line(imgui.get_content_region_avail().x + imgui.get_cursor_pos_x()
                                - imgui.calc_text_size(told).x)
                imgui.text_disabled(told)
    if not found:
        imgui.text_disabled("no lobe has all these words")
    else:
        imgui.text_disabled("on the right: cycles for 64 pixels (RDNA2)")
    if chosen:
        choices.become(lobe, chosen)
        imgui.close_current_popup()
        _closed[services] = combo, CLOSING
    imgui.end_combo()


def _keep_focus(services: Services, combo: int) -> None:
    """After a choice the keyboard stays with the list, quietly: ImGui would go to the window's first button, which the
    next Enter would press."""
    closed, frames = _closed.get(services, (0, 0))
    if closed == combo and frames:
        _closed[services] = combo, frames - 1
        imgui.internal.set_focus_id(combo, imgui.internal.get_current_window())
        imgui.set_nav_cursor_visible(False)


def _with_defaults(function: Function) -> Lobe:
    return Lobe(function.key, choices.defaults(function))


# --- its parameters ---------------------------------------------------------------------------------------------------


def slider(p: Parameter, value: tuple[float, ...], notes: list[str]) -> tuple[float, ...]:
    """What suits a parameter: a colour, or a slider for each component, logarithmic where its range asks it. The header
    may have notes on it."""
    if p.kind == "color":
        changed, new = imgui.color_edit3(p.name, list(value), _COLOUR)
    else:
        flags = _SLIDER | (imgui.SliderFlags_.logarithmic.value if choices.is_logarithmic(p) else 0)
        if p.width == 1:
            changed, new = imgui.slider_float(p.name, value[0], p.low, p.high, "%.4g", flags)
            new = [new]
        else:
            draw_all = {2: imgui.slider_float2, 3: imgui.slider_float3}[p.width]
            changed, new = draw_all(p.name, list(value), p.low, p.high, "%.3g", flags)
    if imgui.begin_item_tooltip():
        unit = f" [{p.unit}]" if p.unit else ""
        imgui.text_unformatted(f"{p.meaning}{unit}\n{p.low:g} to {p.high:g}; Ctrl+click or Enter to type a number")
        imgui.push_text_wrap_pos(30 * imgui.get_font_size())
        for note in notes:
            imgui.text_unformatted(note)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()
    return choices.rounded_into(p, new[: p.width]) if changed else value


def _starts(lobe: Lobe, services: Services) -> None:
    """Presets and reset, in one row."""
    function = lobe.function
    offered = once(services, ("presets", function.key), lambda: presets.of(services.library, function))
    reset = 3.6 * imgui.get_font_size()
    if offered:
        imgui.set_next_item_width(-reset - imgui.get_style().item_spacing.x)
        if imgui.begin_combo("##presets", "presets", imgui.ComboFlags_.height_large):
            for i, preset in enumerate(offered):
                if i == 0 or offered[i - 1].group != preset.group:
                    imgui.separator_text(preset.group)
                if imgui.selectable(f"{preset.name}##{preset.group}", False)[0]:
                    for name, value in preset.values.items():
                        lobe.values[name] = choices.rounded_into(function.parameter(name), value)
                imgui.set_item_tooltip(preset.remark)
            if left_out := once(services, ("beyond", function.key), lambda: presets.beyond(services.library, function)):
                imgui.separator()
                wrapped(f"beyond the header's ranges: {', '.join(p.name for p in left_out)}", disabled=True)
            imgui.end_combo()
        imgui.same_line()
    if imgui.button("reset", (reset if offered else 0, 0)):
        lobe.values = choices.defaults(function)
    imgui.set_item_tooltip("The values that the header suggests")


# --- what to take away ------------------------------------------------------------------------------------------------


def _takes(lobe: Lobe, services: Services) -> None:
    function = lobe.function
    call = choices.call(function, lobe.values)
    half = (imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2
    if imgui.button("copy call", (half, 0)):
        services.copy(call, "The call")
    imgui.set_item_tooltip(call)
    imgui.same_line()
    if imgui.button("copy GLSL", (half, 0)):
        services.copy(choices.bundle_text(services.library, function), f"{function.name} with all that it needs")
    imgui.set_item_tooltip(f"The bundle: {function.name} and what it calls, nothing else")
    if imgui.text_link(choices.place(function)):
        imgui.open_popup("source")
    imgui.set_item_tooltip("Header and code")
    imgui.same_line()
    if imgui.text_link("paper"):
        webbrowser.open(papers.address(function.source))
    imgui.set_item_tooltip(f"{function.source}\n{papers.address(function.source)}")
    _source(function, services)


def _source(function: Function, services: Services) -> None:
    """Header and code in a popup, to read and to copy from."""
    em, screen = imgui.get_font_size(), imgui.get_main_viewport().size
    imgui.set_next_window_size((min(66 * em, 0.95 * screen.x), min(34 * em, 0.85 * screen.y)))
    if not imgui.begin_popup("source"):
        return
    path = str(function.path)
    imgui.text_unformatted(f"{path}:{function.line}")
    imgui.same_line()
    if imgui.small_button("copy path"):
        services.copy(f"{path}:{function.line}", "The place")
    theme.push_mono()
    imgui.input_text_multiline("##code", f"{function.header}\n{function.definition}\n", (-1, -1),
                               imgui.InputTextFlags_.read_only)
    imgui.pop_font()
    imgui.end_popup()


def wrapped(text: str, disabled: bool = False) -> None:
    """Text in as many lines as the panel is wide for; a percent sign is itself."""
    colour = imgui.get_style_color_vec4(imgui.Col_.text_disabled if disabled else imgui.Col_.text)
    imgui.push_style_color(imgui.Col_.text, colour)
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
    imgui.pop_style_color()


def once(services: Services, key: Hashable, compute):
    """What does not change as long as the library is the same."""
    library, known = _offered.get(services, (None, None))
    if library is not services.library:
        library, known = _offered[services] = services.library, {}
    if key not in known:
        known[key] = compute()
    return known[key]
