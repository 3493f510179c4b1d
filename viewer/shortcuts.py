"""What keys do. One table: the help shows it, and handle() follows it."""

from __future__ import annotations

from imgui_bundle import imgui

from . import camera, choices, plots
from . import state as states
from .state import AGAINST, MODES, REFERENCES, TONES

TURN, STEP = 1.5, 0.5  # radians and parts of the picture a second, while a key is held

Key = imgui.Key
HELD = (Key.left_arrow, Key.right_arrow, Key.up_arrow, Key.down_arrow, Key.left_bracket, Key.right_bracket, Key.comma,
        Key.period, Key.minus, Key.equal, Key.keypad_add, Key.keypad_subtract)

HELP = (
    ("Picture", (
        ("1 2 3 4 5", "shader, reference, split, difference, flicker"),
        ("[  ]", "move the divider"),
        (",  .", "exposure; in mode difference, its scale"),
        ("A", "fit the scale of the difference"),
        ("B", "hold A against its reference, or against lobe B"),
        ("R", "reference: direct light at pixel centres, or traced paths"),
        ("T", "next tone curve"),
        ("E", "the environment behind the object, or none"),
    )),
    ("Camera and light", (
        ("drag, Shift+arrows", "turn the camera"),
        ("Shift+drag, Ctrl+Shift+arrows", "move it"),
        ("wheel, -  +", "zoom"),
        ("Alt+arrows", "turn the lights and the environment"),
        ("0", "camera as at the start"),
        ("O", "next object"),
    )),
    ("Lobes", (
        ("L", "list of lobes, with a search: type, Enter takes the marked one"),
        ("N  P", "next, previous lobe"),
        ("X", "swap A and B"),
        ("S", "edit A, or B"),
        ("K", "next plot"),
    )),
    ("Files and window", (
        ("Ctrl+O", "open a mesh, an environment or a session; dropping it does the same"),
        ("Ctrl+S", "save the session"),
        ("Ctrl+P, Ctrl+E", "save the picture as PNG, as EXR"),
        ("Tab, arrows, Enter", "move through the panels, and press"),
        ("Esc", "dismiss messages"),
        ("F1", "this help"),
        ("Ctrl+Q", "quit"),
    )),
)


def handle(app) -> None:
    """Does what the keys pressed in this frame ask for. Nothing while text is typed."""
    io = imgui.get_io()
    if imgui.is_key_pressed(Key.f1, False):
        app.help = not app.help
    if imgui.is_key_pressed(Key.escape, False):
        app.help = False
        app.services.notices = [n for n in app.services.notices if not n.is_error]
    if io.want_text_input or app.asking:
        return
    if io.key_ctrl and not io.key_shift:
        _files(app)
    elif io.key_ctrl or io.key_shift or io.key_alt:
        _arrows(app, io)
    else:
        _plain(app, io)


def _pressed(key) -> bool:
    return imgui.is_key_pressed(key, False)


def _files(app) -> None:
    for key, what in ((Key.o, "open"), (Key.s, "session"), (Key.p, "png"), (Key.e, "exr")):
        if _pressed(key):
            app.ask_path(what)
    if _pressed(Key.q):
        app.window.close()


def _arrows(app, io) -> None:
    step = TURN * min(io.delta_time, 0.1)
    right = imgui.is_key_down(Key.right_arrow) - imgui.is_key_down(Key.left_arrow)
    up = imgui.is_key_down(Key.up_arrow) - imgui.is_key_down(Key.down_arrow)
    if imgui.is_key_down(Key.equal) and io.key_shift:
        camera.zoom(app.state, 1 - step)
    if not right and not up:
        return
    if io.key_alt:
        turn_lights(app.state, right * step, up * step)
    elif io.key_ctrl and io.key_shift:
        camera.pan(app.state, right * step / 3, up * step / 3)
    elif io.key_shift:
        camera.orbit(app.state, right * step, up * step)


def _plain(app, io) -> None:
    state, step = app.state, STEP * min(io.delta_time, 0.1)
    for i, mode in enumerate(MODES):
        if _pressed(getattr(Key, f"_{i + 1}")):
            state.mode = mode
    move = imgui.is_key_down(Key.right_bracket) - imgui.is_key_down(Key.left_bracket)
    state.divider = min(max(state.divider + move * step, 0.0), 1.0)
    brighter = imgui.is_key_down(Key.period) - imgui.is_key_down(Key.comma)
    if state.mode == "difference":
        state.scale = min(max(state.scale * 10.0 ** (-4 * brighter * step), 1e-12), 1e6)
    else:
        state.exposure = min(max(state.exposure + 4 * brighter * step, -20.0), 20.0)
    closer = any(map(imgui.is_key_down, (Key.equal, Key.keypad_add))) - any(
        map(imgui.is_key_down, (Key.minus, Key.keypad_subtract)))
    if closer:
        camera.zoom(state, 1 - 2 * closer * step)
    for key, action in _ACTIONS.items():
        if _pressed(key):
            action(app)


def _next(values: tuple, value):
    return values[(values.index(value) + 1) % len(values)] if value in values else values[0]


def _cycle(name: str, values: tuple):
    return lambda app: setattr(app.state, name, _next(values, getattr(app.state, name)))


def _swap(app) -> None:
    sides = app.state.sides
    sides["A"], sides["B"] = sides["B"], sides["A"]


def choose(state, step: int) -> None:
    """The next lobe of the library, or the one before, on the side that is edited."""
    known = states.lobes()
    keys = list(known)
    at = keys.index(state.lobe.key) if state.lobe.key in known else 0
    choices.become(state.lobe, known[keys[(at + step) % len(keys)]])


def _next_object(app) -> None:
    app.state.object, app.state.placement = _next(states.available(), app.state.object), {}


def turn_lights(state, right: float, up: float) -> None:
    """Turns all lights around the origin, and the environment about +y."""
    import math

    for light in state.lights:
        light.vector = camera.turned(light.vector, right, up)
    if state.environment:
        state.environment.rotation = (state.environment.rotation + math.degrees(right)) % 360.0


_ACTIONS = {
    Key.a: lambda app: app.fit_scale(),
    Key.b: _cycle("against", AGAINST),
    Key.r: _cycle("reference", REFERENCES),
    Key.t: _cycle("tone", TONES),
    Key.s: _cycle("side", states.SIDES),
    Key.x: _swap,
    Key.n: lambda app: choose(app.state, 1),
    Key.p: lambda app: choose(app.state, -1),
    Key.o: _next_object,
    Key.e: _cycle("backdrop", (True, False)),
    Key.k: lambda app: setattr(app.state.plots, "kind", _next(tuple(plots.KINDS), app.state.plots.kind)),
    Key._0: lambda app: setattr(app.services, "reframe", True),
}
