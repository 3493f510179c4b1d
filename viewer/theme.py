"""How the window looks: font, colours, proportions, and small things that are drawn over the picture."""

from __future__ import annotations

from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui

from ..lab import pictures

FONT = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
MONO = FONT.parents[1] / "Inconsolata-Medium.ttf"  # for code
FONT_SIZE = 16.0  # pixels on a screen of usual density
ACCENT, BALL = 0xFF3CAAFF, 0xFF3A3734  # as ImGui packs them: alpha, blue, green, red
_TEXT, _ERROR_TEXT, _SHADE, _ERROR_SHADE = 0xFFF0F0F0, 0xFFC8D8FF, 0xC0181614, 0xE0202070


def apply(density: float) -> None:
    """Font and style for a screen on which text should be `density` times as large as usual."""
    io, style = imgui.get_io(), imgui.get_style()
    if FONT.exists():
        io.fonts.add_font_from_file_ttf(str(FONT), FONT_SIZE)
    if MONO.exists():
        io.fonts.add_font_from_file_ttf(str(MONO), FONT_SIZE)
    imgui.style_colors_dark()
    style.font_scale_dpi = density
    style.scale_all_sizes(density)
    style.window_rounding = style.child_rounding = 0.0
    style.frame_rounding = style.grab_rounding = style.popup_rounding = 3.0 * density
    style.window_padding = imgui.ImVec2(6 * density, 6 * density)
    style.item_spacing = imgui.ImVec2(6 * density, 5 * density)
    style.window_border_size = 0.0
    set_color = style.set_color_
    set_color(imgui.Col_.window_bg, imgui.ImVec4(0.11, 0.115, 0.125, 1.0))
    set_color(imgui.Col_.slider_grab, imgui.ImVec4(0.26, 0.59, 0.98, 0.45))  # a value must be legible through it
    set_color(imgui.Col_.slider_grab_active, imgui.ImVec4(0.26, 0.59, 0.98, 0.75))
    set_color(imgui.Col_.child_bg, imgui.ImVec4(0.0, 0.0, 0.0, 0.0))  # filling so much costs in software
    set_color(imgui.Col_.modal_window_dim_bg, imgui.ImVec4(0.0, 0.0, 0.0, 0.45))
    set_color(imgui.Col_.frame_bg, imgui.ImVec4(0.19, 0.2, 0.22, 1.0))
    set_color(imgui.Col_.nav_cursor, imgui.color_convert_u32_to_float4(ACCENT))  # no blue: that means pressed
    set_color(imgui.Col_.button_hovered, imgui.ImVec4(0.22, 0.38, 0.56, 1.0))
    style.hover_delay_normal = 1e9  # of tooltips of what the keyboard has reached: they would cover what is below
    set_color(imgui.Col_.popup_bg, imgui.ImVec4(0.15, 0.155, 0.165, 0.98))


def push_mono() -> None:
    """The font of code, until imgui.pop_font()."""
    fonts = imgui.get_io().fonts.fonts
    imgui.push_font(fonts[len(fonts) - 1], 0.0)


class Layout:
    """Widths and heights of the panels, in em, as the user has dragged them."""

    LEAST, MIDDLE, PICTURE = 12.0, 30.0, 12.0
    CRAMPED = 0.3  # of a small window's width, for each side

    def __init__(self):
        self.left, self.right, self.bottom = 19.0, 18.0, 0.0
        self.tab = ""  # that should be opened

    def fitted(self, width: float, height: float, em: float) -> tuple[float, float, float]:
        """Left, right and bottom in ImGui's coordinates, such that the picture keeps its place. What was dragged is
        kept: a window that shrinks and grows again looks as before."""
        left = min(max(self.left, self.LEAST), max(width / em - self.MIDDLE - self.LEAST, self.LEAST))
        right = min(max(self.right, self.LEAST), max(width / em - self.MIDDLE - left, self.LEAST))
        bottom = self.bottom or min(max(0.26 * height / em, 15.0), 24.0)  # more plots where there is more room
        bottom = min(max(bottom, 6.0), max(height / em - self.PICTURE, 6.0))
        side = max(self.CRAMPED * width, width - (self.MIDDLE + self.LEAST) * em)
        return min(left * em, side), min(right * em, side), min(bottom * em, height / 2)

    @staticmethod
    def splitter(name: str, width: float, height: float, axis: int) -> float:
        """A bar that is dragged; returns by how much, along its axis."""
        imgui.push_style_var(imgui.StyleVar_.item_spacing, imgui.ImVec2(0, 0))
        imgui.invisible_button(f"##{name} splitter", (max(width, 1.0), max(height, 1.0)))
        imgui.pop_style_var()
        if imgui.is_item_hovered() or imgui.is_item_active():
            imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ns if axis else imgui.MouseCursor_.resize_ew)
        if not imgui.is_item_active():
            return 0.0
        delta = imgui.get_io().mouse_delta
        return delta.y if axis else delta.x


def toggle(label: str, is_on: bool) -> bool:
    """A button that looks pressed where it is on; whether it was pressed."""
    if is_on:
        imgui.push_style_color(imgui.Col_.button, imgui.get_style_color_vec4(imgui.Col_.button_active))
    pressed = imgui.button(label)
    if is_on:
        imgui.pop_style_color()
    return pressed


def label(draw, x: float, y: float, text: str, right: bool = False) -> None:
    """Text on a shade, over a picture; from x to the left where `right`."""
    size, em = imgui.calc_text_size(text), imgui.get_font_size()
    x = x - size.x if right else x
    draw.add_rect_filled((x - 0.3 * em, y - 0.1 * em), (x + size.x + 0.3 * em, y + size.y + 0.1 * em), _SHADE, 0.2 * em)
    draw.add_text((x, y), _TEXT, text)


def scale(draw, x: float, y: float, limit: float) -> None:
    """The colours of the difference, with their ends."""
    em = imgui.get_font_size()
    ends = [imgui.color_convert_float4_to_u32((*(c / 255 for c in color), 1.0))
            for color in (pictures.NEGATIVE, pictures.ZERO, pictures.POSITIVE)]
    for i in (0, 1):
        draw.add_rect_filled_multi_color((x + 4 * i * em, y), (x + 4 * (i + 1) * em, y + 0.6 * em),
                                         ends[i], ends[i + 1], ends[i + 1], ends[i])
    label(draw, x + 0.3 * em, y + 0.8 * em, f"-{limit:.1e}")
    label(draw, x + 8 * em, y + 0.8 * em, f"+{limit:.1e}", right=True)


def notice(draw, x: float, bottom: float, width: float, text: str, is_error: bool) -> float:
    """A line of text, wrapped, that ends at `bottom`; returns its height."""
    em = imgui.get_font_size()
    text = text + ("   [Esc]" if is_error else "")
    size = imgui.calc_text_size(text, wrap_width=width - em)
    height = size.y + 0.5 * em
    shade, color = (_ERROR_SHADE, _ERROR_TEXT) if is_error else (_SHADE, _TEXT)
    draw.add_rect_filled((x, bottom - height), (x + size.x + em, bottom), shade, 0.2 * em)
    at = x + 0.5 * em, bottom - height + 0.25 * em
    draw.add_text(imgui.get_font(), em, at, color, text, wrap_width=width - em)
    return height + 0.3 * em
