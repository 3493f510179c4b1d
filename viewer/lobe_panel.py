"""The lobes: which one, and its parameters."""

from __future__ import annotations

from imgui_bundle import imgui

from .services import Services
from .state import SIDES, State, default_lobe


def draw(state: State, services: Services) -> None:
    for side in SIDES:
        if imgui.radio_button(side, state.side == side):
            state.side = side
        imgui.same_line()
    imgui.new_line()
    lobe = state.lobe
    imgui.set_next_item_width(-1)
    if imgui.begin_combo("##lobe", lobe.function.name):
        for name, (function, *_) in services.lobes.items():
            if imgui.selectable(name, function.key == lobe.key)[0]:
                state.sides[state.side][0] = lobe = default_lobe(function.key)
        imgui.end_combo()
    for p in lobe.function.parameters:
        if p.is_geometry:
            continue
        value = lobe.values[p.name]
        if p.kind == "color":
            changed, new = imgui.color_edit3(p.name, list(value))
        elif p.width == 1:
            changed, new = imgui.slider_float(p.name, value[0], p.low, p.high)
            new = [new]
        else:
            changed, new = (imgui.input_float2 if p.width == 2 else imgui.input_float3)(p.name, list(value))
        if changed:
            lobe.values[p.name] = tuple(new[: p.width])
