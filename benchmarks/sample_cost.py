"""What a sample of the reference's renderer costs and what it is worth, on the scenes of the race against Mitsuba, who
is not needed here. CPU time, so that others may use the machine, too.

    .venv/bin/python benchmarks/sample_cost.py                 # a few minutes
    .venv/bin/python benchmarks/sample_cost.py --scene gold --samples 64 --pictures 4
"""

import argparse
import time

import numpy as np

from mitsuba_race import Lobe
from mitsuba_scenes import PAIRS

from lobe import reference

TARGET = 1e-2  # RMS error over the mean


def measured(pair, arguments, adaptive: bool) -> str:
    lobe = Lobe(pair, arguments.size, adaptive)
    seconds, pictures = [], []
    for seed in range(arguments.pictures):
        start = time.process_time()
        pictures.append(lobe.picture(arguments.samples, seed))
        seconds.append(time.process_time() - start)
    mean, variance = np.mean(pictures), np.var(pictures, axis=0, ddof=1).mean()
    error, fastest = np.sqrt(variance) / mean, min(seconds)
    nanoseconds = 1e9 * fastest / (arguments.samples * arguments.size**2)
    return (f"{pair.name:6} {'adaptive' if adaptive else 'even':9} {nanoseconds:6.0f} ns a sample, RMS error "
            f"{error:.4f} after {arguments.samples}, {fastest * (error / TARGET) ** 2:.3g} s to {TARGET:g}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", action="append", choices=PAIRS)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--pictures", type=int, default=8, help="whose scatter tells the error")
    arguments = parser.parse_args()
    reference.set_threads(1)
    for name in arguments.scene or PAIRS:
        for adaptive in (False, True):
            print(measured(PAIRS[name], arguments, adaptive), flush=True)


if __name__ == "__main__":
    main()
