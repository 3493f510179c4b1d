"""How smoothly the viewer runs, by software OpenGL: python benchmarks/viewer.py writes benchmarks/results/viewer.json.

It opens the real window, on DISPLAY or on an Xvfb of its own, and turns the camera around the teapot, GGX under a point
light, while the reference traces; then it changes lobes for 10 000 frames and looks at the memory. On two quiet cores:
five minutes.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

PICTURE, SMALL = (960, 540), (480, 270)  # timed; where only the memory counts
SETTLED = 0.4  # of the frames: by then each lobe has been shown twice


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=600, help="timed")
    parser.add_argument("--seconds", type=float, default=15.0, help="of frames in which nothing moves")
    parser.add_argument("--memory-frames", type=int, default=10_000)
    parser.add_argument("--changes", type=int, default=200, help="of the lobe, in these")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "results" / "viewer.json")
    options = parser.parse_args()
    server = None if os.environ.get("DISPLAY") else xvfb()
    try:
        results = {"schema": 1, "machine": {"processor": processor(), "cores": os.cpu_count(),
                                            "load": os.getloadavg()[0]}, "start": start()}
        results |= measured(options)
    finally:
        if server:
            server.terminate()
    from lobe.lab import files

    files.write_json(options.out, results)


def xvfb() -> subprocess.Popen:
    if not shutil.which("Xvfb"):
        sys.exit("no DISPLAY and no Xvfb: apt-get install xvfb")
    read, write = os.pipe()
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1920x1080x24", "-nolisten", "tcp"],
                              pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as pipe:
        os.environ["DISPLAY"] = f":{pipe.readline().strip()}"
    return server


def start() -> dict:
    """Seconds from the command to the end of its first frame, of several starts."""
    taken = []
    for _ in range(5):
        began = time.perf_counter()
        subprocess.run([sys.executable, "-m", "lobe.lab", "view", "--frames", "1"], check=True)
        taken.append(time.perf_counter() - began)
    what = "lobe view --frames 1, from the start of the process to its end"
    return {"seconds_median": float(np.median(taken)), "seconds": taken, "what": what}


def measured(options) -> dict:
    from lobe.viewer import app as app_, state as states, window

    state = states.initial()
    state.lights, state.mode = state.lights[:1], "split"  # the point light
    app = app_.App(window.Glfw(1400, 900, vsync=False), state)
    try:
        resize(app)
        results = {"renderer": app.services.renderer, "picture": list(app.size),
                   "what": "lobe_GGX on the teapot, one point light, the camera turns in every frame, mode split"}
        for reference in ("traced", "direct"):
            state.reference = reference
            results[f"orbit_{reference}"] = orbit(app, options.frames)
        results["still_traced"] = still(app, options.seconds)
        state.environment, state.lights = states.Environment(states.probes()["lobby"]), []
        results["orbit_environment"] = orbit(app, options.frames // 2)
        state.environment, state.lights = None, states.initial().lights
        resize(app, SMALL)
        results["memory"] = memory(app, options.memory_frames, options.changes)
    finally:
        app.release()
    return results


def resize(app, picture: tuple[int, int] = PICTURE) -> None:
    """Makes the window such that its picture has this size."""
    import glfw

    for _ in range(20):
        app.window.poll(0.05)
        app.frame()
        if app.size == picture:
            return
        size = (s + wanted - got for s, wanted, got in zip(app.window.size, picture, app.size))
        glfw.set_window_size(app.window._window, *size)
    raise RuntimeError(f"the picture has {app.size} pixels")


def orbit(app, count: int) -> dict:
    """Frame times while the camera turns, and in which share of the frames the picture had all its pixels."""
    from lobe.viewer import camera

    whole = []

    def turn():
        whole.append(app.pictures["A"].whole)  # of the frame before
        camera.orbit(app.state, 0.01, 0.0)

    for _ in range(30):
        turn()
        app.frame()
    return times(app, lambda i: i < count, turn) | {"picture_ms": 1e3 * app.pictures["A"].seconds,
                                                         "full_size": float(np.mean(whole[-count:]))}


def still(app, seconds: float) -> dict:
    """Frame times while nothing moves and the reference gets better."""
    app.state.reference = "traced"
    end = time.perf_counter() + seconds
    measured = times(app, lambda i: time.perf_counter() < end, lambda: None)
    return measured | {"samples": app.services.job.samples, "error": app.services.job.error}


def times(app, more, step) -> dict:
    taken, worked, began = [], [], time.perf_counter()
    while more(len(taken)):
        busy = processor_ms()
        step()
        time.sleep(max(began + 1 / 60 - time.perf_counter(), 0.0))  # as a display would have it
        app.window.poll(0.0)
        app.frame()
        now = time.perf_counter()
        taken.append(now - began)
        worked.append(processor_ms() - busy)
        began = now
    taken = np.array(taken)
    median, late = float(np.median(taken)), float(np.quantile(taken, 0.99))
    return {"frames": len(taken), "fps_median": 1 / median, "ms_median": 1e3 * median, "ms_p99": 1e3 * late,
            "p99_over_median": late / median, "ms_max": 1e3 * float(taken.max()),
            "processor_ms_median": float(np.median(worked)), "processor_ms_p99": float(np.quantile(worked, 0.99))}


def processor_ms() -> float:
    """Of this thread, and llvmpipe's divided by the cores: what a frame takes where nobody else wants the processor."""
    drivers = 0.0
    for task in Path("/proc/self/task").iterdir():
        if (task / "comm").read_text().startswith("llvmpipe"):
            drivers += int((task / "schedstat").read_text().split()[0]) / 1e6
    return 1e3 * time.thread_time() + drivers / (os.cpu_count() or 1)


def memory(app, count: int, changes: int) -> dict:
    """Resident memory while lobes change and the camera turns."""
    from lobe.viewer import camera, state as states

    known, every = list(states.lobes()), count // changes
    app.state.reference = "direct"
    resident = []
    for i in range(count):
        if i % every == 0:
            app.state.sides["A"] = [states.default_lobe(known[i // every % len(known)])]
        camera.orbit(app.state, 0.003, 0.0)
        app.window.poll(0.0)
        app.frame()
        if i % max(count // 50, 1) == 0:
            resident.append(rss())
    first = resident[int(SETTLED * len(resident))]
    return {"frames": count, "changes": changes, "MB": [round(x, 1) for x in resident], "MB_settled": first,
            "MB_end": resident[-1], "growth_MB": resident[-1] - first}


def rss() -> float:
    """Resident megabytes of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def processor() -> str:
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())


if __name__ == "__main__":
    main()
