"""Pictures of scene files: rendered within a budget, kept on disk from time to time, written as OpenEXR and PNG."""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import signal
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import exr, files, pictures, scene_schema
from .errors import InputError
from .scene_files import SceneFile

STRIP = 8 * exr.BLOCK_ROWS  # rows that are traced and written at once
PASS_SECONDS = 0.5  # how long one call into the tracer should take, so that budgets and interrupts are noticed
SAVE_SECONDS = 60.0  # between checkpoints; a slow disk gets more time
FIRST_SAVE_SECONDS = 5.0  # before the first of them
FILM_BYTES = 2 * (3 * 8 + 4)  # of a pixel: sums of two halves of its samples, their numbers
SHARE_BYTES = 2 * (8 * 4 + 4) + 4  # of a pixel, where samples go to the noise: its evidence, what follows from it
LAYER_BYTES = 2 * 3 * 8  # of a pixel, for each light
COPIES = 2  # of the film: itself, and what is written or read of it
MOST_SAMPLES = 1 << 24
MOST_SECONDS = 1e9
CGROUPS, OWN_CGROUPS = Path("/sys/fs/cgroup"), Path("/proc/self/cgroup")

AOVS = {"N": "XYZ", "T": "XYZ", "V": "XYZ", "position": "XYZ", "uv": "UV", "depth": "Z", "object": "I",
        "primitive": "I"}  # names of channels


@dataclass(frozen=True)
class Budget:
    """When to stop; the first that is reached counts. spp includes samples of earlier runs, seconds do not."""

    spp: int | None = None
    seconds: float | None = None
    error: float | None = None


@dataclass(frozen=True)
class Settings:
    """What decides each bit of a picture, beside the scene."""

    width: int
    height: int
    depth: int
    roulette: int
    seed: int
    strategy: str
    layers: bool
    adaptive: bool
    guided: bool
    share: bool


def settings(scene: SceneFile, width: int | None, seed: int | None, strategy: str | None) -> Settings:
    """What the file says, where the command line says nothing."""
    film, render = scene.film, scene.render
    known = scene_schema.STRATEGIES
    if strategy is not None and strategy not in known:
        raise InputError(f"--strategy {strategy}: expected one of {', '.join(known)}")
    height = film["height"]
    if width is not None:
        height = max(1, round(film["height"] * width / film["width"]))
    return Settings(width or film["width"], height, render["depth"], render["roulette"],
                    render["seed"] if seed is None else seed, strategy or render["strategy"],
                    film["layers"] and len(scene.lights) > 1, render["adaptive"], render["guided"], render["share"])


def budget(scene: SceneFile, spp: int | None, seconds: float | None, error: float | None) -> Budget:
    """The command line's, or the file's where the command line sets no limit at all."""
    if seconds is not None and not 0 <= seconds <= MOST_SECONDS:
        raise InputError(f"--seconds {seconds:g}: expected a number in 0..{MOST_SECONDS:g}")
    if error is not None and not 0 <= error <= 1:
        raise InputError(f"--error {error:g}: expected a number in 0..1, a part of the mean")
    if spp or seconds is not None or error:
        return Budget(spp, seconds, error)
    return Budget(scene.render["spp"], None, scene.render["error"] or None)


class Rendering:
    """A scene being rendered: its film in the reference, and its checkpoint beside the picture."""

    def __init__(self, scene: SceneFile, settings: Settings, out: Path):
        from lobe import reference

        self.scene, self.settings = scene, settings
        self.picture, self.preview = out / f"{scene.name}.exr", out / f"{scene.name}.png"
        self.checkpoint = out / f"{scene.name}.checkpoint"
        self.identity = f"{scene.identity}-{zlib.crc32(repr(settings).encode()):08x}"
        self.seconds = 0.0  # of rendering, all runs together
        self.done = 0  # samples of the pixels that have most; where they go to the noise, their mean
        self.target = 0.0  # the error at which tiles have been finished for good, 0 where none have
        require_memory(scene, settings)
        try:
            self.render = reference.Render(
                scene.scene, scene.camera, settings.width, settings.height, depth=settings.depth,
                roulette=settings.roulette, seed=settings.seed, strategy=settings.strategy, layers=settings.layers,
                adaptive=settings.adaptive, guided=settings.guided, share=settings.share)
        except (MemoryError, ValueError) as error:
            (scene.place / "film").fail(str(error) or "is too large for the memory")

    # Work.

    def advance(self, budget: Budget, step: Callable[[str, int, int], None]) -> None:
        """Adds samples until the budget is spent. Ctrl-C and SIGTERM end it between two passes, with a checkpoint
        written."""
        self.target = budget.error or 0.0
        self.render.set_target(self.target)
        started = saved = time.monotonic()
        spent, save_every, count = self.seconds, min(FIRST_SAVE_SECONDS, SAVE_SECONDS), 1
        step(*self._progress(budget, 0.0))  # so that samples of an earlier run do not count as fast ones
        try:
            with stops() as stopped:
                while not self._is_spent(budget, time.monotonic() - started):
                    count = min(count, (budget.spp or MOST_SAMPLES) - self.done)
                    before = time.monotonic()
                    self.render.advance(count)
                    now = time.monotonic()
                    self.done += count
                    self.seconds = spent + now - started
                    step(*self._progress(budget, now - started))
                    count = max(1, min(2 * count, int(count * PASS_SECONDS / max(now - before, 1e-6))))
                    if now - saved > save_every:
                        self.save()
                        saved = time.monotonic()
                        save_every = max(SAVE_SECONDS, 20 * (saved - now))
                    if stopped:
                        raise KeyboardInterrupt
        except KeyboardInterrupt:
            self.save()
            raise
        if self.render.finished:  # within a pass, so that no pixel has all samples that were asked for
            self.done = self._samples()
        self.save()

    def _samples(self) -> int:
        return self.render.turns if self.settings.adaptive else int(self.render.samples().max())

    def _is_spent(self, budget: Budget, elapsed: float) -> bool:
        return (self.render.finished or self.done >= (budget.spp or MOST_SAMPLES)
                or (budget.seconds is not None and elapsed >= budget.seconds and self.done > 0))

    def _progress(self, budget: Budget, elapsed: float) -> tuple[str, int, int]:
        """What the bar says, samples done, and an estimate of how many there will be."""
        ends = [budget.spp or MOST_SAMPLES]
        if budget.seconds:
            ends.append(round(self.done * budget.seconds / max(elapsed, 1e-6)))
        error = self.render.error() if budget.error else 0.0
        if 0 < error < math.inf:
            ratio = error / budget.error  # falls with the root of the samples
            ends.append(round(min(self.done * ratio * ratio, MOST_SAMPLES)))
        label = f"samples{f', error {error:.2g}' if error else ''}"
        return label, self.done, max(min(ends), self.done)

    # Checkpoints: a line of JSON, then the film as the reference gives it.

    def save(self) -> None:
        state = self.render.state()
        head = {"scene": self.identity, "seconds": self.seconds, "samples": self.done, "error": self.target}
        line = json.dumps(head).encode() + b"\n"
        with files.written_beside(self.checkpoint) as temporary, open(temporary, "wb") as file:
            file.write(line)
            file.write(state)
            file.write(zlib.crc32(state, zlib.crc32(line)).to_bytes(4, "little"))

    def resume(self, budget: Budget) -> bool:
        """Goes on from the checkpoint, if there is one."""
        if not self.checkpoint.exists():
            return False
        try:
            with open(self.checkpoint, "rb") as file:
                line = file.readline(4096)
                state = file.read(max(os.fstat(file.fileno()).st_size - len(line) - 4, 0))
                damaged = zlib.crc32(state, zlib.crc32(line)).to_bytes(4, "little") != file.read()
            head = json.loads(line)
            identity, self.seconds, self.done = head["scene"], float(head["seconds"]), int(head["samples"])
            reached = float(head["error"])
        except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError, MemoryError):
            damaged, identity, reached = True, self.identity, 0.0
        if identity != self.identity:
            raise InputError(f"{self.checkpoint}: belongs to another scene, size, seed or setting than "
                             f"{self.scene.path} has now; render without --resume to begin again")
        if (budget.error or 0.0) < reached:
            raise InputError(f"{self.checkpoint}: was rendered to an error of {reached:g}, where parts of it have "
                             f"stopped; expected --error {reached:g} or more, or no --resume")
        try:
            if damaged or not 0 <= self.seconds < math.inf:
                raise ValueError
            self.render.restore(state)
            if self.done != self._samples():
                raise ValueError
        except ValueError:
            raise InputError(f"{self.checkpoint}: is damaged or of another version; render without --resume to begin "
                             "again") from None
        return True

    # Pictures.

    def write(self) -> dict:
        """Writes the OpenEXR and the PNG; returns what is worth telling of them."""
        facts = {"lobeScene": self.scene.name, "sceneHash": self.identity, "seed": self.settings.seed,
                 "samplesPerPixel": self.done, "seconds": round(self.seconds, 3), "error": self.render.error(),
                 "strategy": self.settings.strategy, "depth": self.settings.depth}
        with files.written_beside(self.picture) as temporary:
            self._write_parts(temporary, facts)
        beauty = self.render.beauty()
        mean = beauty.mean(axis=(0, 1))
        self._write_preview(beauty)
        return facts | {"mean": mean}

    def _write_parts(self, path: Path, facts: dict) -> None:
        s = self.settings
        lights = self.scene.lights if s.layers else []
        colours = ["beauty", "variance", "deviation", *(f"light.{name}" for name in lights)]
        parts = [exr.Part(name, ("R", "G", "B")) for name in colours]
        parts += [exr.Part(name, ("I",), "uint32") for name in ("samples", "group")]
        aovs = len(parts)
        parts += [exr.Part(name, tuple(c), "uint32" if c == "I" else "float32") for name, c in AOVS.items()]
        with exr.Writer(path, s.width, s.height, parts, facts) as writer:
            def fill(part, image):
                for y in range(0, s.height, STRIP):
                    writer.write(part, image[y : y + STRIP].astype(parts[part].dtype))

            fill(0, self.render.beauty())  # one picture at a time: each is a copy of a part of the film
            fill(1, self.render.variance())
            fill(2, self.render.deviation())
            if lights:
                for i, image in enumerate(self.render.layers()):
                    fill(3 + i, image)
            fill(aovs - 2, self.render.samples())
            fill(aovs - 1, self.render.groups())
            for y in range(0, s.height, STRIP):
                rows = min(STRIP, s.height - y)
                strip = self.scene.scene.trace(self.scene.camera, s.width, s.height, shadows=False, first=y, rows=rows)
                for i, name in enumerate(AOVS):
                    writer.write(aovs + i, strip[name].astype(parts[aovs + i].dtype))

    def _write_preview(self, beauty: np.ndarray) -> None:
        shown = np.empty(beauty.shape, np.uint8)
        for y in range(0, len(beauty), STRIP):
            strip = beauty[y : y + STRIP] * 2.0 ** self.scene.film["exposure"]
            shown[y : y + STRIP] = np.rint(pictures.srgb(strip) * 255)
        files.write_png(self.preview, shown)


def error_of_mean(deviation: np.ndarray, group: np.ndarray, region: np.ndarray | None = None) -> np.ndarray:
    """Standard error of the mean over a region, a mask of the picture, for each channel. Errors of pixels of one group
    add up as they are, since these share light; those of different groups do in their squares."""
    region = np.ones(group.shape, bool) if region is None else region
    group, of_pixel = np.unique(group[region], return_inverse=True)
    sums = np.zeros((len(group), deviation.shape[2]))
    np.add.at(sums, of_pixel.ravel(), deviation[region])
    return np.sqrt((sums**2).sum(axis=0)) / region.sum()


@contextlib.contextmanager
def stops() -> Iterator[list[int]]:
    """A list that gets the first Ctrl-C or SIGTERM: raised at once, it could part the film from the count of its
    samples. The second one acts as ever."""
    got: list[int] = []
    before = {}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def take(number, frame) -> None:
        got.append(number)
        restore()

    if threading.current_thread() is threading.main_thread():  # no other may ask for signals
        before = {number: signal.signal(number, take) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield got
    finally:
        restore()


def require_memory(scene: SceneFile, settings: Settings) -> None:
    """InputError where film, checkpoint, photons and outlooks would not fit into what memory is free."""
    from lobe import reference

    each = FILM_BYTES + settings.adaptive * SHARE_BYTES + settings.layers * LAYER_BYTES * len(scene.lights)
    photons = reference.guide_bytes(scene.scene) if settings.guided else 0
    beside = photons + reference.outlook_bytes(scene.scene, settings.strategy)
    needed, free = COPIES * each * settings.width * settings.height + beside, free_memory()
    if needed > free:
        (scene.place / "film" / "width").fail(
            f"{settings.width} x {settings.height} pixels need {needed / 1e9:.1f} GB, and {free / 1e9:.1f} GB are "
            "free; choose a smaller picture" + (", or layers = false" if settings.layers else "")
            + (", or guided = false" if photons else ""))


def free_memory() -> int:
    """Bytes that this process may still take, limits of control groups, and such as ulimit -v, included."""
    import resource

    available = re.search(r"MemAvailable: +(\d+) kB", Path("/proc/meminfo").read_text())
    free = int(available[1]) * 1024 if available else os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    free = min([free, *cgroups_memory()])
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit == resource.RLIM_INFINITY:
        return free
    used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    return min(free, limit - used)


def cgroups_memory() -> list[int]:
    """Bytes that each control group of this process still grants, where it has a limit. Files that it has read count
    as granted: the kernel drops them first."""
    left = []
    for line in OWN_CGROUPS.read_text().splitlines() if OWN_CGROUPS.exists() else ():
        _, controllers, own = line.split(":", 2)
        if "memory" in controllers.split(","):
            root, limit, used = CGROUPS / "memory", "memory.limit_in_bytes", "memory.usage_in_bytes"
        elif not controllers:
            root, limit, used = CGROUPS, "memory.max", "memory.current"
        else:
            continue
        group = Path(own.lstrip("/"))
        for folder in (root / group, *(root / parent for parent in group.parents)):
            with contextlib.suppress(OSError, ValueError):  # none here, or "max"
                cached = re.findall(r"^(?:total_)?inactive_file (\d+)$", (folder / "memory.stat").read_text(), re.M)
                granted = int((folder / limit).read_text()) - int((folder / used).read_text())
                left.append(max(granted + max(map(int, cached), default=0), 0))
    return left
