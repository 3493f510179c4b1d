"""Lobe's reference against Mitsuba 3 (LLVM): error over time, on three scenes that both express exactly, and whether
their pictures are the same. Needs the extra `peers` (pip install -e '.[peers]') and LLVM (Debian: libllvm19).

    .venv/bin/python benchmarks/mitsuba_race.py                    # all, a quarter of an hour; writes docs/mitsuba.md
    .venv/bin/python benchmarks/mitsuba_race.py --agree            # only whether the pictures are the same; prints JSON
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import re
import statistics
import sys
import time
from pathlib import Path

import numpy as np

import mitsuba_scenes
from mitsuba_scenes import PAIRS, ROUGH, ROULETTE
from reference_rate import cpu_name

from lobe import reference
from lobe.lab import plots

RESULTS = Path(__file__).resolve().parent / "results"
PAGE = Path(__file__).resolve().parent.parent / "docs" / "mitsuba.md"
SAMPLES = tuple(4**i for i in range(7))  # 1..4096 a pixel
TARGETS = (1e-2, 1e-3)  # RMS error over the picture's mean
BLOCK = 8  # pixels; the agreement is judged by the means of blocks
SAMPLER = "multijitter"  # Mitsuba's best on these scenes: at 1024 samples its error is 1/2 to 1/8 of `independent`


class Lobe:
    """The reference's renderer on a pair's scene."""

    def __init__(self, pair, size: int, adaptive: bool = True):
        self.size, self.depth, self.adaptive = size, pair.depth, adaptive
        self.scene, self.camera = pair.lobe()

    def start(self, seed: int):
        return reference.Render(self.scene, self.camera, self.size, self.size, depth=self.depth, roulette=ROULETTE,
                                seed=seed, variance=False,  # neither estimates its error on the way
                                adaptive=self.adaptive)

    def picture(self, samples: int, seed: int) -> np.ndarray:
        render = self.start(seed)
        render.advance(samples)
        return render.beauty()


class Mitsuba:
    """Mitsuba's path tracer on a dictionary of its own."""

    def __init__(self, mi, dictionary: dict, sampler: str = SAMPLER):
        dictionary["sensor"]["sampler"] = {"type": sampler}
        self.mi, self.scene = mi, mi.load_dict(dictionary)

    def picture(self, samples: int, seed: int) -> np.ndarray:
        return np.array(self.mi.render(self.scene, spp=samples, seed=seed), dtype=float)


CLOCKS = {"wall": time.perf_counter, "cpu": time.process_time}  # cpu: all threads; for a machine that others use, too
clock = CLOCKS["wall"]


def timed(renderer, samples: int, seed: int) -> tuple[float, np.ndarray]:
    start = clock()
    picture = renderer.picture(samples, seed)
    return clock() - start, picture


# --- the truth, and whether it is one ---------------------------------------------------------------------------------


class Mean:
    """The mean of independent pictures, and the variance of it."""

    def __init__(self, pictures):
        stack = np.array(pictures)
        self.count, self.value, self.variance = len(stack), stack.mean(0), stack.var(0, ddof=1) / len(stack)
        self.stack = stack


def batches(renderers, samples: int, seconds: float, least: int = 16):
    """Means of independent pictures of each renderer: at least so many, and for at least so many seconds each."""
    done = [[] for _ in renderers]
    spent = [0.0] * len(renderers)
    while any(s < seconds or len(d) < least for s, d in zip(spent, done)):
        for i, renderer in enumerate(renderers):
            if spent[i] < seconds or len(done[i]) < least:
                taken, picture = timed(renderer, samples, 1000 + len(done[i]))
                spent[i] += taken
                done[i].append(picture)
    return [Mean(pictures) for pictures in done]


def blocks(stack: np.ndarray) -> np.ndarray:
    """Means over blocks of pixels and over the channels of pictures [n, h, w, 3]: [n, blocks]."""
    n, h, w, _ = stack.shape
    return stack.reshape(n, h // BLOCK, BLOCK, w // BLOCK, BLOCK, 3).mean((2, 4, 5)).reshape(n, -1)


def agreement(a: Mean, b: Mean) -> dict:
    """z of the difference of two independent means: of the whole picture, and over its blocks, where it is N(0, 1) to
    within Student's tails if the pictures are the same."""

    def z(x, y):
        sigma = np.sqrt(x.var(0, ddof=1) / len(x) + y.var(0, ddof=1) / len(y))
        return (x.mean(0) - y.mean(0)) / np.maximum(sigma, 1e-6 * y.mean()), sigma

    whole, sigma = z(a.stack.mean((1, 2, 3)), b.stack.mean((1, 2, 3)))
    local, _ = z(blocks(a.stack), blocks(b.stack))
    return {
        "mean_lobe": a.value.mean(), "mean_mitsuba": b.value.mean(),
        "relative_difference": a.value.mean() / b.value.mean() - 1, "relative_sigma": float(sigma / b.value.mean()),
        "z_of_mean": float(whole), "z_rms_of_blocks": float(np.sqrt(np.mean(local**2))),
        "z_max_of_blocks": float(np.abs(local).max()), "blocks": local.size, "pictures": [a.count, b.count],
    }


def agrees(found: dict) -> bool:
    """Whether two renderers drew the same picture, at odds of about 1 in 10,000 against a false alarm."""
    return abs(found["z_of_mean"]) < 4 and found["z_rms_of_blocks"] < 1.3


# --- the race ---------------------------------------------------------------------------------------------------------


def rms(picture: np.ndarray, truth: Mean) -> float:
    """RMS error over the mean, freed of the noise of the truth itself. 0 where nothing is left."""
    squared = np.mean((picture - truth.value) ** 2 - truth.variance)
    return float(np.sqrt(max(squared, 0.0)) / truth.value.mean())


def raced(lobe: Lobe, mitsuba: Mitsuba, truth: Mean, cold: dict[int, float], rounds: int) -> dict[str, list[dict]]:
    """Curves of both, round by round in turn. Lobe goes on from where it was, Mitsuba begins each time anew, as each is
    used; Mitsuba has compiled its kernel for each number of samples before, and `cold` tells what that took with it."""
    samples = list(cold)
    found = {name: {n: [] for n in samples} for name in ("lobe", "mitsuba")}
    for seed in range(rounds):
        render, spent = lobe.start(seed), 0.0
        for before, n in zip([0, *samples], samples):
            start = clock()
            render.advance(n - before)
            picture = render.beauty()
            spent += clock() - start
            found["lobe"][n].append((spent, rms(picture, truth)))
            seconds, picture = timed(mitsuba, n, seed)
            found["mitsuba"][n].append((seconds, rms(picture, truth)))
    curves = {name: [{"samples": n, "seconds": statistics.median(s for s, _ in values),
                      "error": float(np.sqrt(np.mean([e**2 for _, e in values])))} for n, values in curve.items()]
              for name, curve in found.items()}
    curves["mitsuba_compiling"] = [point | {"seconds": max(cold[point["samples"]], point["seconds"])}
                                   for point in curves["mitsuba"]]
    return curves


def time_to(target: float, curve: list[dict]) -> tuple[float, bool]:
    """Seconds to an error, and whether they lie beyond the curve: there the error is taken to fall with the root of
    time. Between its points a curve is straight on logarithmic axes."""
    points = [(p["seconds"], p["error"]) for p in curve if p["error"] > 0]
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if e0 >= target >= e1:
            x = np.log(e0 / target) / np.log(e0 / e1) if e0 > e1 else 0.0
            return float(t0 * (t1 / t0) ** x), False
    t, e = points[0] if points[0][1] < target else points[-1]
    return float(t * (e / target) ** 2), True


def cost_of(native: Mitsuba, put: Mitsuba, samples: int) -> float:
    """Time of Mitsuba's own material over that of the one with the correlation put in, interleaved."""
    native.picture(samples, 9), put.picture(samples, 9)
    return statistics.median(timed(native, samples, i)[0] / timed(put, samples, i)[0] for i in range(5))


def measured(mi, pair, arguments) -> dict:
    lobe, mitsuba = Lobe(pair, arguments.size), Mitsuba(mi, pair.mitsuba(mi, arguments.size))
    cold = {n: timed(mitsuba, n, 999)[0] for n in SAMPLES if n <= arguments.most}
    batch = min(arguments.most, 256)
    ours, theirs = batches([lobe, mitsuba], batch, arguments.seconds)
    truth = min((ours, theirs), key=lambda m: m.variance.mean())
    curves = raced(lobe, mitsuba, truth, cold, arguments.rounds)
    result = {
        "depth": pair.depth, "agreement": agreement(ours, theirs),
        "truth": {"by": "lobe" if truth is ours else "mitsuba", "samples": batch * truth.count,
                  "error": float(np.sqrt(truth.variance.mean()) / truth.value.mean())},
        "curves": curves, "time_to": {f"{target:g}": compared(target, curves) for target in TARGETS},
    }
    if pair.native:
        native = Mitsuba(mi, pair.native(mi, arguments.size))
        result["time_of_its_own_material"] = cost_of(native, mitsuba, batch)
    return result


def compared(target: float, curves: dict) -> dict:
    times = {name: time_to(target, curve) for name, curve in curves.items()}
    return {name: seconds for name, (seconds, _) in times.items()} | {
        "times_faster": times["mitsuba"][0] / times["lobe"][0],
        "times_faster_than_compiling": times["mitsuba_compiling"][0] / times["lobe"][0],
        "extrapolated": [name for name in ("lobe", "mitsuba") if times[name][1]]}


# --- results ----------------------------------------------------------------------------------------------------------


DRAWN = {"lobe": (plots.BLUE, "o-", "Lobe"), "mitsuba": (plots.ORANGE, "s-", "Mitsuba 3 LLVM"),
         "mitsuba_compiling": (plots.ORANGE, "s:", "with its compilation")}


def draw(result: dict):
    seconds = "seconds" if result["clock"] == "wall" else "seconds of all cores"

    def on(figure):
        axes = figure.subplots(1, len(result["scenes"]), squeeze=False)[0]
        for axis, (name, scene) in zip(axes, result["scenes"].items()):
            for who, (colour, line, label) in DRAWN.items():
                curve = [p for p in scene["curves"][who] if p["error"] > 0]
                axis.loglog([p["seconds"] for p in curve], [p["error"] for p in curve], line, color=colour,
                            markersize=3.5, linewidth=1.2, label=label)
            for target in TARGETS:
                axis.axhline(target, color=plots.GREY, linewidth=0.8, linestyle=":")
            plots.style(axis, name, xlabel=seconds)
        axes[0].set_ylabel("RMS error over the mean")
        axes[0].legend(fontsize=8, frameon=False)

    return on


def table(result: dict) -> str:
    lines = []
    for name, scene in result["scenes"].items():
        found = scene["agreement"]
        verdict = "the same picture" if agrees(found) else "DIFFERENT PICTURES"
        lines.append(f"{name}: means differ by {found['relative_difference']:+.1e} ({found['z_of_mean']:+.1f} sigma), "
                     f"blocks by {found['z_rms_of_blocks']:.2f} sigma: {verdict}")
        for target, t in scene.get("time_to", {}).items():
            beyond = f" (extrapolated: {', '.join(t['extrapolated'])})" if t["extrapolated"] else ""
            lines.append(f"  to {target}: Lobe {t['lobe']:.3g} s, Mitsuba {t['mitsuba']:.3g} s, with its compilation "
                         f"{t['mitsuba_compiling']:.3g} s: Lobe is {t['times_faster']:.2g} and "
                         f"{t['times_faster_than_compiling']:.2g} times as fast{beyond}")
    return "\n".join(lines)


def page(text: str, result: dict) -> str:
    """The text of docs/mitsuba.md with its tables up to date."""
    same = ["| scene | means, Lobe over Mitsuba | sigma of it | z of the mean | z of blocks, RMS (1 is right) |",
            "|---|---|---|---|---|"]
    fast = ["| scene | to an RMS error of | Lobe | Mitsuba | with its compilation | Lobe is times as fast | error of the "
            "picture that is held for true |", "|---|---|---|---|---|---|---|"]
    for name, scene in result["scenes"].items():
        found = scene["agreement"]
        same.append(f"| {name} | {1 + found['relative_difference']:.5f} | {found['relative_sigma']:.5f} | "
                    f"{found['z_of_mean']:+.2f} | {found['z_rms_of_blocks']:.2f} |")
        for target, t in scene["time_to"].items():
            seconds = [f"{t[who]:.3g} s{' *' if who.partition('_')[0] in t['extrapolated'] else ''}" for who in DRAWN]
            fast.append(f"| {name} | {target} | {' | '.join(seconds)} | {t['times_faster']:.2g} | "
                        f"{scene['truth']['error']:.2g} |")
    clock_name = "seconds of all cores together" if result["clock"] == "cpu" else "seconds"
    measured_on = (f"{result['size']} × {result['size']} pixels, {clock_name}, {result['threads']} threads of "
                   f"{result['cpu']}; Mitsuba {result['mitsuba']}, {result['variant']}, sampler `{result['sampler']}`; "
                   f"{result['date']}.")
    for block, lines in (("agreement", same), ("race", [*fast, "", measured_on])):
        content = "\n".join(lines)
        text = re.sub(rf"(<!-- {block} -->\n).*(<!-- /{block} -->)", lambda m: f"{m[1]}{content}\n{m[2]}", text,
                      flags=re.S)
    return text


def machine(mi, threads: int) -> dict:
    return {"date": datetime.date.today().isoformat(), "cpu": cpu_name(), "threads": threads, "mitsuba": mi.__version__,
            "variant": mi.variant(), "sampler": SAMPLER, "embree": reference.embree_version}


def judged(mi, pairs, arguments) -> dict:
    """Only the agreement; and Mitsuba's own rough metal, which is another, as what must be seen to differ."""
    cases = {pair.name: (pair, pair.mitsuba) for pair in (*pairs, ROUGH)}
    cases |= {f"{ROUGH.name}, its own material": (ROUGH, ROUGH.native)}
    scenes = {}
    for name, (pair, build) in cases.items():
        renderers = [Lobe(pair, arguments.size), Mitsuba(mi, build(mi, arguments.size))]
        scenes[name] = {"agreement": agreement(*batches(renderers, 64, arguments.seconds, least=24))}
    return scenes


def publish(result: dict) -> None:
    plots.write_svg(PAGE.parent / "figures" / "mitsuba.svg", draw(result), (3.6 * len(result["scenes"]), 3.2))
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8"), result), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agree", action="store_true")
    parser.add_argument("--scene", action="append", choices=PAIRS)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--most", type=int, default=SAMPLES[-1], help="samples a pixel at the end of the race")
    parser.add_argument("--seconds", type=float, default=60, help="that each renderer works on the truth of a scene")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--clock", choices=CLOCKS, default="wall")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, default=RESULTS)
    arguments = parser.parse_args()
    global clock
    clock = CLOCKS[arguments.clock]
    mi = mitsuba_scenes.load_mitsuba(arguments.threads)
    reference.set_threads(arguments.threads)
    pairs = [PAIRS[name] for name in arguments.scene or PAIRS]
    result = {**machine(mi, arguments.threads), "clock": arguments.clock, "size": arguments.size}
    if arguments.agree:
        result["scenes"] = judged(mi, pairs, arguments)
        print(table(result), file=sys.stderr)
        json.dump(result, sys.stdout, indent=1)
        return
    result |= {"rounds": arguments.rounds, "scenes": {}}
    for pair in pairs:
        result["scenes"][pair.name] = measured(mi, pair, arguments)
        print(table(result | {"scenes": {pair.name: result["scenes"][pair.name]}}), flush=True)
    (arguments.out / "mitsuba.json").write_text(json.dumps(result, indent=1) + "\n")
    if arguments.out == RESULTS:
        publish(result)


if __name__ == "__main__":
    main()
