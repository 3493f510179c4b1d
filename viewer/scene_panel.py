"""Object, lights, environment and camera."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from imgui_bundle import imgui

from . import camera, theme
from . import state as states
from .lobe_panel import wrapped
from .services import Services
from .state import MOST_LIGHTS, REFERENCES, Light, State

_FAINT, _RIM = 0x40FFFFFF, 0xA0FFFFFF


def draw(state: State, services: Services) -> None:
    imgui.push_item_width(-0.38 * imgui.get_content_region_avail().x)
    _object(state)
    _lights(state)
    _environment(state)
    _camera(state, services)
    _reference(state)
    imgui.pop_item_width()


def _object(state: State) -> None:
    known = states.available()
    if imgui.begin_combo("object", state.object if state.object in known else Path(state.object).name):
        for name in known:
            if imgui.selectable(name, name == state.object)[0]:
                state.object, state.placement = name, {}
        imgui.end_combo()
    wrapped("or drop an OBJ, PLY, STL or glTF", disabled=True)


def _lights(state: State) -> None:
    imgui.separator_text("Lights")
    removed = None
    for i, light in enumerate(state.lights):
        imgui.push_id(i)
        if imgui.tree_node_ex(f"{light.kind} {i + 1}", imgui.TreeNodeFlags_.default_open if i < 1 else 0):
            _light(state, light)
            if imgui.small_button("remove"):
                removed = i
            imgui.tree_pop()
        imgui.pop_id()
    if removed is not None and (len(state.lights) > 1 or state.environment):
        del state.lights[removed]
    full = len(state.lights) >= MOST_LIGHTS
    imgui.begin_disabled(full)
    if imgui.small_button("+ directional"):
        state.lights.append(Light("directional", (-0.9, 0.5, 0.3), (1.0, 1.0, 1.0)))
    imgui.same_line()
    if imgui.small_button("+ point"):
        state.lights.append(Light("point", (2.5, 1.0, 1.5), (6.0, 6.0, 6.0)))
    imgui.end_disabled()


def _light(state: State, light: Light) -> None:
    light.vector = ball(state, light.vector)
    if light.kind == "point":
        changed, new = imgui.drag_float3("position", list(light.vector), 0.02, -1e3, 1e3, "%.3g")
        if changed and any(new):
            light.vector = tuple(new)
    strongest = max(light.color)
    shade = [c / strongest for c in light.color] if strongest > 0 else [1.0, 1.0, 1.0]
    changed, shade = imgui.color_edit3("colour", shade, imgui.ColorEditFlags_.float | imgui.ColorEditFlags_.no_inputs)
    word, unit = ("irradiance", "W/m²") if light.kind == "directional" else ("intensity", "W/sr")
    stronger, value = imgui.slider_float(word, strongest, 0.01, 1000.0, f"%.3g {unit}", imgui.SliderFlags_.logarithmic)
    if (changed or stronger) and max(shade[:3]) > 0:
        peak = max(shade[:3])
        light.color = tuple(value * c / peak for c in shade[:3])


def ball(state: State, vector) -> tuple[float, float, float]:
    """A ball on which a direction is dragged, as the camera sees it; Shift drags it on the far side. The vector keeps
    its length."""
    em = imgui.get_font_size()
    radius = 3.0 * em
    at = imgui.get_cursor_screen_pos()
    imgui.invisible_button("ball", (2 * radius, 2 * radius))
    center = at.x + radius, at.y + radius
    draw, basis, length = imgui.get_window_draw_list(), camera.basis(state), math.hypot(*vector)
    if imgui.is_item_active():
        mouse = imgui.get_io().mouse_pos
        x, y = (mouse.x - center[0]) / radius, (center[1] - mouse.y) / radius
        r = math.hypot(x, y)
        x, y = (x / r, y / r) if r > 1 else (x, y)
        z = math.sqrt(max(1 - x * x - y * y, 0.0)) * (-1 if imgui.get_io().key_shift else 1)
        vector = tuple(float(c) for c in length * (np.array((x, y, z)) @ basis))
    if imgui.is_item_focused():
        right = imgui.is_key_down(imgui.Key.right_arrow) - imgui.is_key_down(imgui.Key.left_arrow)
        up = imgui.is_key_down(imgui.Key.up_arrow) - imgui.is_key_down(imgui.Key.down_arrow)
        if imgui.get_io().key_alt is False and imgui.get_io().key_ctrl and (right or up):
            vector = camera.turned(vector, 0.02 * right, 0.02 * up)
    x, y, z = basis @ (np.array(vector) / length)
    draw.add_circle_filled(center, radius, theme.BALL)
    draw.add_circle(center, radius, _RIM)
    for share in (0.5, 0.87):
        draw.add_circle(center, radius * share, _FAINT)
    spot = center[0] + x * radius, center[1] - y * radius
    draw.add_line(center, spot, _FAINT)
    (draw.add_circle_filled if z >= 0 else draw.add_circle)(spot, 0.35 * em, theme.ACCENT)
    imgui.set_item_tooltip("Drag the light; Shift: on the far side. Focused, Ctrl+arrows move it")
    return vector


def _environment(state: State) -> None:
    imgui.separator_text("Environment")
    environment = state.environment
    if environment is None:
        wrapped("drop a latitude-longitude EXR", disabled=True)
        for name, file in states.probes().items():
            if imgui.small_button(name):
                state.environment = states.Environment(file)
            imgui.same_line()
        imgui.new_line()
        return
    imgui.text(environment.file.name)
    environment.rotation = imgui.slider_float("rotation", environment.rotation, 0.0, 360.0, "%.0f°")[1]
    strength = max(environment.scale)
    changed, value = imgui.slider_float("scale", strength, 0.01, 100.0, "%.3g", imgui.SliderFlags_.logarithmic)
    if changed:
        environment.scale = tuple(value * s / strength for s in environment.scale) if strength > 0 else (value,) * 3
    state.backdrop = imgui.checkbox("behind the object", state.backdrop)[1]
    imgui.set_item_tooltip("Draw it, too (key E). Neither the object's light nor any number depends on it")
    if imgui.small_button("remove##environment") and state.lights:
        state.environment = None


def _camera(state: State, services: Services) -> None:
    imgui.separator_text("Camera")
    changed, value = imgui.slider_float("angle", state.fov, 5.0, 90.0, "%.0f°")
    state.fov = min(max(value, 1.0), 150.0) if changed else state.fov
    if imgui.small_button("as at the start"):
        services.reframe = True


def _reference(state: State) -> None:
    imgui.separator_text("Reference")
    for name in REFERENCES:
        if imgui.radio_button(name, state.reference == name):
            state.reference = name
        imgui.same_line()
    imgui.new_line()
    if state.reference == "traced":
        state.depth = imgui.slider_int("depth", state.depth, 1, 16)[1]
        imgui.set_item_tooltip("Surfaces that a path may meet; 1 is direct light, with shadows")
