"""Curves of the lobe."""

from __future__ import annotations

from imgui_bundle import imgui

from .services import Services
from .state import State


def draw(state: State, services: Services) -> None:
    imgui.text_disabled(state.lobe.function.description)
