"""Lobe's reference against Mitsuba 3 (LLVM): error over time, on three scenes that both express exactly, and whether
their pictures are the same. Needs the extra `peers` (pip install -e '.[peers]') and LLVM (Debian: libllvm19).

    .venv/bin/python benchmarks/mitsuba_race.py                    # all, about a quarter of an hour; writes results/
    .venv/bin/python benchmarks/mitsuba_race.py --agree            # only whether the pictures are the same; prints JSON
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

os.environ["HOME"] = tempfile.mkdtemp()  # Mitsuba keeps compiled kernels at home: here each run compiles its own

import mitsuba_scenes  # noqa: E402
from mitsuba_scenes import PAIRS, ROULETTE  # noqa: E402
from reference_rate import cpu_name  # noqa: E402

from lobe import reference  # noqa: E402
from lobe.lab import plots  # noqa: E402

RESULTS = Path(__file__).resolve().parent / "results"
SAMPLES = tuple(4**i for i in range(7))  # 1..4096 a pixel
TARGETS = (1e-2, 1e-3)  # RMS error over the picture's mean
BLOCK = 8  # pixels; the agreement is judged by the means of blocks
SAMPLER = "multijitter"  # Mitsuba's best on these scenes: at 1024 samples its error is 1/2 to 1/8 of `independent`


class Lobe:
    """The reference's renderer on a pair's scene."""

    def __init__(self, pair, size: int):
        self.size, self.depth = size, pair.depth
        self.scene, self.camera = pair.lobe()

    def start(self, seed: int):
        return reference.Render(self.scene, self.camera, self.size, self.size, depth=self.depth, roulette=ROULETTE,
                                seed=seed)

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


def timed(renderer, samples: int, seed: int) -> tuple[float, np.ndarray]:
    start = time.perf_counter()
    picture = renderer.picture(samples, seed)
    return time.perf_counter() - start, picture


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


def raced(lobe: Lobe, others: dict[str, Mitsuba], truth: Mean, most: int, rounds: int) -> dict[str, list[dict]]:
    """Curves of each renderer. Lobe goes on from where it was, Mitsuba begins each time anew, as each is used."""
    samples = [n for n in SAMPLES if n <= most]
    found = {name: {n: [] for n in samples} for name in ("lobe", *others)}
    for seed in range(rounds):
        render, spent = lobe.start(seed), 0.0
        for before, n in zip([0, *samples], samples):
            start = time.perf_counter()
            render.advance(n - before)
            picture = render.beauty()
            spent += time.perf_counter() - start
            found["lobe"][n].append((spent, rms(picture, truth)))
            for name, other in others.items():
                seconds, picture = timed(other, n, seed)
                found[name][n].append((seconds, rms(picture, truth)))
    return {name: [{"samples": n, "seconds": statistics.median(s for s, _ in values),
                    "error": float(np.sqrt(np.mean([e**2 for _, e in values])))} for n, values in curve.items()]
            for name, curve in found.items()}


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


def compile_seconds(renderer: Mitsuba, samples: int) -> float:
    """What the first picture takes longer than the second."""
    return max(timed(renderer, samples, 1)[0] - timed(renderer, samples, 2)[0], 0.0)


def measured(mi, pair, arguments) -> dict:
    lobe = Lobe(pair, arguments.size)
    others = {"mitsuba": Mitsuba(mi, pair.mitsuba(mi, arguments.size))}
    if pair.native:
        others["mitsuba, its own material"] = Mitsuba(mi, pair.native(mi, arguments.size))
    compiled = {name: compile_seconds(other, 16) for name, other in others.items()}
    for other in others.values():  # every number of samples has its own kernel
        for n in (n for n in SAMPLES if n <= min(arguments.most, 256)):
            other.picture(n, 3)
    ours, theirs = batches([lobe, others["mitsuba"]], min(arguments.most, 256), arguments.seconds)
    truth = max((ours, theirs), key=lambda m: -m.variance.mean())
    result = {"depth": pair.depth, "compile_seconds": compiled, "agreement": agreement(ours, theirs),
              "truth": {"by": "lobe" if truth is ours else "mitsuba",
                        "error": float(np.sqrt(truth.variance.mean()) / truth.value.mean())}}
    # Each renderer's own material has its own truth.
    race = {name: other for name, other in others.items() if name == "mitsuba"}
    result["curves"] = raced(lobe, race, truth, arguments.most, arguments.rounds)
    for name in others.keys() - race.keys():
        n = min(arguments.most, 256)
        pair_of_times = [(timed(others["mitsuba"], n, i)[0], timed(others[name], n, i)[0]) for i in range(5)]
        result["time_of_its_own_material"] = statistics.median(b / a for a, b in pair_of_times)
    result["time_to"] = {}
    for target in TARGETS:
        (ours_t, ours_beyond), (theirs_t, theirs_beyond) = (time_to(target, result["curves"][n]) for n in ("lobe", "mitsuba"))
        result["time_to"][f"{target:g}"] = {
            "lobe": ours_t, "mitsuba": theirs_t, "mitsuba_with_compilation": theirs_t + compiled["mitsuba"],
            "times_faster": theirs_t / ours_t, "extrapolated": [n for n, b in (("lobe", ours_beyond), ("mitsuba", theirs_beyond)) if b]}
    return result


# --- results ----------------------------------------------------------------------------------------------------------


def draw(result: dict):
    def on(figure):
        axes = figure.subplots(1, len(result["scenes"]), squeeze=False)[0]
        for axis, (name, scene) in zip(axes, result["scenes"].items()):
            for who, colour, label in (("lobe", plots.BLUE, "Lobe"), ("mitsuba", plots.ORANGE, "Mitsuba 3 LLVM")):
                curve = [p for p in scene["curves"][who] if p["error"] > 0]
                axis.loglog([p["seconds"] for p in curve], [p["error"] for p in curve], "o-", color=colour, markersize=4,
                            label=label)
            for target in TARGETS:
                axis.axhline(target, color=plots.GREY, linewidth=0.8, linestyle=":")
            plots.style(axis, name, xlabel="seconds", ylabel="RMS error over the mean" if axis is axes[0] else "")
        axes[0].legend(fontsize=8, frameon=False)

    return on


def table(result: dict) -> str:
    lines = []
    for name, scene in result["scenes"].items():
        found = scene["agreement"]
        lines.append(f"{name}: means differ by {found['relative_difference']:+.1e} ({found['z_of_mean']:+.1f} sigma), blocks "
                     f"{found['z_rms_of_blocks']:.2f} sigma: {'the same picture' if agrees(found) else 'DIFFERENT PICTURES'}")
        for target, t in scene.get("time_to", {}).items():
            beyond = f" (extrapolated: {', '.join(t['extrapolated'])})" if t["extrapolated"] else ""
            lines.append(f"  to {target}: Lobe {t['lobe']:.3g} s, Mitsuba {t['mitsuba']:.3g} s, with compilation "
                         f"{t['mitsuba_with_compilation']:.3g} s; Lobe is {t['times_faster']:.2g} times as fast{beyond}")
    return "\n".join(lines)


def machine(mi, threads: int) -> dict:
    return {"date": datetime.date.today().isoformat(), "cpu": cpu_name(), "threads": threads, "mitsuba": mi.__version__,
            "variant": mi.variant(), "sampler": SAMPLER, "embree": reference.embree_version}


def judged(mi, pairs, arguments) -> dict:
    """Only the agreement, with Mitsuba's own material, which is another, as what must be seen to differ."""
    scenes = {}
    for pair in pairs:
        lobe = Lobe(pair, arguments.size)
        for name, build in (("", pair.mitsuba), (", its own material", pair.native)):
            if build:
                means = batches([lobe, Mitsuba(mi, build(mi, arguments.size))], 64, arguments.seconds, least=24)
                scenes[pair.name + name] = {"agreement": agreement(*means)}
    return scenes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agree", action="store_true")
    parser.add_argument("--scene", action="append", choices=PAIRS)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--most", type=int, default=SAMPLES[-1], help="samples a pixel at the end of the race")
    parser.add_argument("--seconds", type=float, default=60, help="that each renderer works on the truth of a scene")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, default=RESULTS)
    arguments = parser.parse_args()
    mi = mitsuba_scenes.load_mitsuba(arguments.threads)
    reference.set_threads(arguments.threads)
    pairs = [PAIRS[name] for name in arguments.scene or PAIRS]
    result = {**machine(mi, arguments.threads), "size": arguments.size}
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
    plots.write_svg(arguments.out / "mitsuba.svg", draw(result), (3.6 * len(pairs), 3.2))


if __name__ == "__main__":
    main()
