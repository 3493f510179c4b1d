"""Numbers of the pixel under the mouse, and of the whole picture."""

from __future__ import annotations

from imgui_bundle import imgui

from .services import Services
from .state import State


def draw(state: State, services: Services) -> None:
    imgui.text(f"{services.frame_ms:.1f} ms a frame")
    if services.pixel:
        imgui.text(f"pixel {services.pixel.x}, {services.pixel.y}")
        imgui.text(f"error {services.pixel.units.max():.2f} units")
