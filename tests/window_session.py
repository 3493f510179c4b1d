"""A viewer in a process of its own, on an X server of its own, with a hand that moves a real mouse and presses keys."""

import ctypes
import ctypes.util
import multiprocessing
import os
import shutil
import subprocess
import time
import traceback

from imgui_bundle import imgui

ALT, CONTROL, SHIFT = "Alt_L", "Control_L", "Shift_L"
SECONDS = 300  # that a slow machine may take for what a test waits for
_KEYS = {ALT: "left_alt", CONTROL: "left_ctrl", SHIFT: "left_shift", "Left": "left_arrow"}  # others are named alike
_BUTTONS = {1: 0, 2: 2, 3: 1}  # of X, as ImGui counts them; 4 and 5 are the wheel


class Display:
    """Xvfb on the first free display."""

    def __init__(self, size="1300x800x24"):
        assert shutil.which("Xvfb"), "these tests need Xvfb; on Debian or Ubuntu: apt-get install xvfb libxtst6"
        read, write = os.pipe()
        self._process = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", size, "-nolisten", "tcp"],
                                         pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as pipe:
            self.name = f":{pipe.readline().strip()}"

    def close(self):
        self._process.terminate()
        self._process.wait()


class Session:
    """Runs functions f(app, hand, ...) in the viewer's process, one after the other."""

    def __init__(self, display, folder, size):
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, display.name, str(folder), size), daemon=True)
        self._process.start()

    def do(self, function, *arguments):
        self._pipe.send((function, arguments))
        assert self._pipe.poll(2 * SECONDS), "the viewer does not answer"
        is_value, answer = self._pipe.recv()
        assert is_value, answer
        return answer

    def close(self):
        self._pipe.send(None)
        self._process.join(SECONDS)
        return self._process.exitcode


def _serve(pipe, display, folder, size):
    os.environ["DISPLAY"] = display
    os.environ.pop("WAYLAND_DISPLAY", None)
    from lobe.lab import paths

    glsl = shutil.copytree(paths.GLSL, os.path.join(folder, "glsl"))  # which tests may break
    paths.GLSL = type(paths.GLSL)(glsl)
    from lobe.viewer import command, state

    app = command.start(state.initial(), size, offscreen=False)
    hand = Hand()
    while (message := pipe.recv()) is not None:
        function, arguments = message
        try:
            pipe.send((True, function(app, hand, *arguments)))
        except BaseException:
            pipe.send((False, traceback.format_exc()))
    app.release()


def frames(app, count=4):
    for _ in range(count):
        app.window.poll(0.02)
        app.frame()


def until(app, condition):
    """Frames until the condition holds, and two more."""
    end = time.monotonic() + SECONDS
    while not condition():
        assert time.monotonic() < end, "it never came to be"
        app.window.poll(0.01)
        app.frame()
    frames(app, 2)


def shaded(app, side="A"):
    """The shader's picture of the state as it is now, once it has all its pixels."""
    frames(app, 1)
    until(app, lambda: app.pictures[side].whole)
    return app.pictures[side].read().copy()


class Hand:
    """Mouse and keyboard of the X server, through its extension XTEST. What it does has come to the window when its
    methods return, however slow both are; but for the wheel, which leaves no trace there."""

    def __init__(self):
        self._x = ctypes.CDLL("libX11.so.6")
        name = ctypes.util.find_library("Xtst") or "libXtst.so.6"
        self._test = ctypes.CDLL(name)
        self._x.XOpenDisplay.restype = ctypes.c_void_p
        self._x.XStringToKeysym.restype = ctypes.c_ulong
        self._x.XKeysymToKeycode.argtypes = [ctypes.c_void_p, ctypes.c_ulong]
        self._display = ctypes.c_void_p(self._x.XOpenDisplay(None))

    def _send(self, name, *arguments):
        getattr(self._test, name)(self._display, *arguments, ctypes.c_ulong(0))
        self._x.XFlush(self._display)

    def key(self, app, key, *modifiers):
        """Presses a key, by its X name, and lets it go."""
        names = (*modifiers, key)
        for down, order in ((True, names), (False, names[::-1])):
            for name in order:
                symbol = self._x.XStringToKeysym(name.encode())
                self._send("XTestFakeKeyEvent", self._x.XKeysymToKeycode(self._display, symbol), int(down))
                known = getattr(imgui.Key, _KEYS.get(name, f"_{name}" if name.isdigit() else name.lower()))
                until(app, lambda: imgui.is_key_down(known) == down)

    def move(self, app, x, y):
        at = round(x), round(y)
        self._send("XTestFakeMotionEvent", -1, *at)
        until(app, lambda: tuple(imgui.get_io().mouse_pos) == at)

    def button(self, app, number, down):
        self._send("XTestFakeButtonEvent", number, int(down))
        if number in _BUTTONS:
            until(app, lambda: imgui.get_io().mouse_down[_BUTTONS[number]] == down)

    def drag(self, app, start, end, button=1):
        self.move(app, *start)
        self.button(app, button, True)
        for share in (0.5, 1.0):
            self.move(app, *(a + (b - a) * share for a, b in zip(start, end)))
        self.button(app, button, False)
