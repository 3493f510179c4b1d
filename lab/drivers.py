"""Other drivers than this process can have: each OpenGL of Mesa's in a process of its own, since it reads only once
from the environment what to be, and WebGL 2 in a browser without a window.

    python -m lobe.lab.drivers NAME

is the process that draws for a driver of Mesa's; it speaks pickle over its standard streams.
"""

from __future__ import annotations

import ctypes
import json
import os
import pickle
import queue
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np

from . import gl, radv
from .errors import InputError

TIMEOUT = 120  # seconds for a browser's answer


def _softpipe() -> dict[str, str]:
    return {"GALLIUM_DRIVER": "softpipe"}


def _lavapipe() -> dict[str, str]:
    manifests = [path for folder in radv.ICDS for path in sorted(Path(folder).glob("lvp_icd*.json"))]
    if not manifests:
        raise InputError("no lavapipe: install the package mesa-vulkan-drivers")
    found = ":".join(map(str, manifests))
    return {"GALLIUM_DRIVER": "zink", "MESA_LOADER_DRIVER_OVERRIDE": "zink", "VK_ICD_FILENAMES": found,
            "VK_DRIVER_FILES": found}


# The environment of each, and what it must call itself.
CHILDREN = {"softpipe": (_softpipe, "softpipe"), "lavapipe": (_lavapipe, "zink")}
NAMES = (*gl.CONTEXTS, *CHILDREN, "swiftshader")


def create(name: str) -> gl.Context:
    """A context of any driver of NAMES. InputError names the package that is missing."""
    if name in gl.CONTEXTS:
        return gl.create_context(name)
    if name in CHILDREN:
        return Child(name)
    if name == "swiftshader":
        return Browser()
    raise InputError(f"--context {name}: expected one of {', '.join((*NAMES, 'all'))}")


class Remote(gl.Context):
    """A context that another process has."""

    def __init__(self, name: str, renderer: str, version: str):
        super().__init__(name, None, renderer, version)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass


@dataclass(frozen=True)
class Treated(gl.Context):
    """A context whose shaders are treated as whole texts before it compiles them."""

    context: gl.Context = None
    treatment: Callable[[str], str] = None

    @staticmethod
    def of(context: gl.Context, treatment: Callable[[str], str]) -> Treated:
        return Treated(context.name, context.gl, context.renderer, context.version, context, treatment)

    def __enter__(self):
        self.context.__enter__()
        return self

    def __exit__(self, *error):
        self.context.__exit__(*error)

    def draw(self, fragment: str, packed: np.ndarray, rows: int) -> np.ndarray:
        return self.context.draw(self.treatment(fragment), packed, rows)


# --- Mesa's drivers --------------------------------------------------------------------------------------------------


class Child(Remote):
    """A driver of Mesa's, in a process that has its environment."""

    def __init__(self, name: str):
        settings, nature = CHILDREN[name]
        environment = os.environ | {"LIBGL_ALWAYS_SOFTWARE": "1"} | settings()
        process = subprocess.Popen([sys.executable, "-m", "lobe.lab.drivers", name], stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment)
        object.__setattr__(self, "_process", process)
        weakref.finalize(self, _end, process)
        renderer, version = self._answer()
        if nature not in renderer:
            raise InputError(f"no {name} here, OpenGL is {renderer}: install the package libgl1-mesa-dri")
        super().__init__(name, renderer, version)

    def draw(self, fragment: str, packed: np.ndarray, rows: int) -> np.ndarray:
        try:
            pickle.dump((fragment, packed, rows), self._process.stdin)
            self._process.stdin.flush()
        except OSError:
            raise InputError(f"{self.name}: the driver's process has ended") from None
        return self._answer()

    def _answer(self):
        try:
            answer = pickle.load(self._process.stdout)
        except (EOFError, pickle.UnpicklingError):
            raise InputError(f"{self._process.args[-1]}: the driver ended with status {self._process.wait()}") from None
        if isinstance(answer, Exception):
            raise answer
        return answer


def _end(process: subprocess.Popen) -> None:
    process.terminate()
    process.wait()


def serve() -> None:
    """Draws what comes by standard input until it ends."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # a driver that prints must not be taken for an answer

    def answer(value) -> None:
        pickle.dump(value, answers)
        answers.flush()

    try:
        context = gl.create_context("egl")
    except InputError as error:
        return answer(error)
    answer((context.renderer, context.version))
    while True:
        try:
            fragment, packed, rows = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            with context:
                answer(context.draw(fragment, packed, rows))
        except gl.CompileError as error:
            answer(RuntimeError(str(error)))


# --- a browser -------------------------------------------------------------------------------------------------------

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SWITCHES = ("--headless", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking",
            "--disable-component-update", "--no-first-run", "--disable-extensions", "--disable-sync")
PAGE = """<!doctype html><title>lobe</title><script>
const gl = document.createElement("canvas").getContext("webgl2");
const post = (kind, body) => fetch(kind, {method: "POST", body});
function shader(program, kind, text) {
    const s = gl.createShader(kind);
    gl.shaderSource(s, text);
    gl.compileShader(s);
    gl.attachShader(program, s);
    return gl.getShaderInfoLog(s) || "";
}
function texture(width, height, texels) {
    const t = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, t);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, texels);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
        gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    return t;
}
let known = null, program = null;
function draw(job, data) {
    const text = job.vertex + job.fragment;
    if (text !== known) {
        if (program) gl.deleteProgram(program);
        program = gl.createProgram();
        const log = shader(program, gl.VERTEX_SHADER, job.vertex) + shader(program, gl.FRAGMENT_SHADER, job.fragment);
        gl.linkProgram(program);
        known = null;
        if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw log + gl.getProgramInfoLog(program);
        known = text;
    }
    gl.useProgram(program);
    const size = job.width * job.rows * job.lights * 4, textures = [];
    for (let unit = 0; unit < job.units; ++unit) {
        gl.activeTexture(gl.TEXTURE0 + unit);
        textures.push(texture(job.width, job.rows * job.lights, data.subarray(unit * size, (unit + 1) * size)));
        gl.uniform1i(gl.getUniformLocation(program, "lobe_t_" + unit), unit);
    }
    gl.activeTexture(gl.TEXTURE0 + job.units);
    const target = texture(job.width, job.rows, null), frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
    gl.viewport(0, 0, job.width, job.rows);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const pixels = new Float32Array(job.width * job.rows * 4);
    gl.readPixels(0, 0, job.width, job.rows, gl.RGBA, gl.FLOAT, pixels);
    gl.deleteFramebuffer(frame);
    for (const t of [target, ...textures]) gl.deleteTexture(t);
    const error = gl.getError();
    if (error) throw "WebGL error " + error;
    return pixels;
}
(async () => {
    if (!gl || !gl.getExtension("EXT_color_buffer_float")) return post("fault", "no WebGL 2 with float targets");
    const info = gl.getExtension("WEBGL_debug_renderer_info");
    await post("values", JSON.stringify([gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER),
                                         gl.getParameter(gl.VERSION)]));
    for (;;) {
        const bytes = await (await fetch("job")).arrayBuffer(), head = new Uint32Array(bytes, 0, 1)[0];
        const job = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, head)));
        try { await post("values", draw(job, new Float32Array(bytes, 4 + head))); }
        catch (error) { await post("fault", String(error)); }
    }
})();
</script>"""


class Browser(Remote):
    """WebGL 2 over SwiftShader, in headless Chromium. A page of ours fetches the jobs and posts the answers."""

    def __init__(self):
        program = next(filter(None, map(shutil.which, BROWSERS)), None)
        if program is None:
            raise InputError("no browser for SwiftShader: install the package chromium")
        jobs, answers = queue.Queue(), queue.Queue()
        server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(jobs, answers))
        threading.Thread(target=server.serve_forever, daemon=True).start()
        profile = tempfile.TemporaryDirectory(prefix="lobe-browser-", ignore_cleanup_errors=True)
        sandbox = ("--no-sandbox",) if os.geteuid() == 0 else ()
        process = subprocess.Popen([program, *SWITCHES, *sandbox, f"--user-data-dir={profile.name}",
                                    f"http://127.0.0.1:{server.server_port}/"],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=_end_with_parent)
        weakref.finalize(self, _close, process, server, profile)
        for name, value in (("_jobs", jobs), ("_answers", answers), ("_process", process)):
            object.__setattr__(self, name, value)
        renderer, version = json.loads(self._answer())
        super().__init__("swiftshader", renderer, version)

    def draw(self, fragment: str, packed: np.ndarray, rows: int) -> np.ndarray:
        parts = []
        for block in gl.blocks(packed, rows):
            data = gl.texels(block, rows)
            head = json.dumps({"vertex": essl(gl.VERTEX), "fragment": essl(fragment), "width": gl.ROW, "rows": rows,
                               "lights": len(block), "units": len(data)}).encode()
            head += b" " * (-len(head) % 4)
            self._jobs.put(np.uint32(len(head)).tobytes() + head + b"".join(x.tobytes() for x in data))
            parts.append(np.frombuffer(self._answer(), np.float32).reshape(-1, 4)[: block.shape[1]])
        return np.concatenate(parts)

    def _answer(self) -> bytes:
        try:
            kind, body = self._answers.get(timeout=TIMEOUT)
        except queue.Empty:
            raise InputError(f"{self._process.args[0]}: no answer within {TIMEOUT} seconds; try it by hand with "
                             + " ".join(SWITCHES)) from None
        if kind == "fault":
            raise RuntimeError(f"swiftshader: {body.decode()[:500]}")
        return body


def _end_with_parent() -> None:
    """A browser outlives whoever is killed, unless Linux is asked to end it."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG


def essl(text: str) -> str:
    """A shader of `gl.evaluate` in GLSL ES 3.00."""
    text = re.sub(r"^#extension.*\n", "", text, flags=re.M)
    return re.sub(r"^#version .*\n", "#version 300 es\nprecision highp float;\nprecision highp int;\n"
                  "precision highp sampler2D;\n", text)


def _handler(jobs: queue.Queue, answers: queue.Queue) -> type:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self):
            if self.path not in ("/", "/job"):
                return self.send_error(404)
            body = PAGE.encode() if self.path == "/" else jobs.get()
            self._send(body, "text/html" if self.path == "/" else "application/octet-stream")

        def do_POST(self):
            body = self.rfile.read(int(self.headers["Content-Length"]))
            self._send(b"", "text/plain")
            answers.put((self.path[1:], body))

        def _send(self, body: bytes, kind: str):
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *arguments):
            pass

    return Handler


def _close(process: subprocess.Popen, server: ThreadingHTTPServer, profile: tempfile.TemporaryDirectory) -> None:
    _end(process)
    server.shutdown()
    profile.cleanup()


if __name__ == "__main__":
    serve()
