"""Keys of GLFW as ImGui calls them."""

from __future__ import annotations

from imgui_bundle import imgui

_SAME = ("tab backspace enter escape insert delete space left_bracket right_bracket backslash comma minus period slash "
         "semicolon equal apostrophe grave_accent page_up page_down home end caps_lock menu").split()
_ARROWS = {f"{way}": f"{way}_arrow" for way in ("left", "right", "up", "down")}
_LETTERS = "abcdefghijklmnopqrstuvwxyz"
_MODIFIERS = {"control": "ctrl", "shift": "shift", "alt": "alt", "super": "super"}
ALL = [getattr(imgui.Key, name) for name in (*_SAME, *_ARROWS.values(), *_LETTERS, *(f"_{i}" for i in range(10)),
                                            *(f"f{i}" for i in range(1, 13)))]  # but for those that change others


def from_glfw(glfw) -> dict[int, tuple[imgui.Key, ...]]:
    """What ImGui is told of each key of GLFW: the key itself and, of modifiers, which one it is."""
    names = {name: name for name in _SAME} | _ARROWS
    names |= {f"f{i}": f"f{i}" for i in range(1, 13)} | {letter: letter for letter in _LETTERS}
    names |= {str(i): f"_{i}" for i in range(10)} | {f"kp_{i}": f"keypad{i}" for i in range(10)}
    names |= {f"kp_{name}": f"keypad_{name}" for name in ("decimal", "divide", "multiply", "subtract", "add", "enter")}
    known = {getattr(glfw, f"KEY_{name.upper()}"): (getattr(imgui.Key, key),) for name, key in names.items()}
    for ours, theirs in _MODIFIERS.items():
        for side in ("left", "right"):
            known[getattr(glfw, f"KEY_{side.upper()}_{ours.upper()}")] = (
                getattr(imgui.Key, f"{side}_{theirs}"), getattr(imgui.Key, f"mod_{theirs}"))
    return known
