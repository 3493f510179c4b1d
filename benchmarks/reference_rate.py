"""How much of Embree's bare speed the reference keeps: beauty() and a loop of the same Embree calls, interleaved."""

import argparse
import datetime
import json
import os
import platform
import statistics
import time
from pathlib import Path

from lobe import reference
from lobe.lab import meshes

REPOSITORY = Path(__file__).resolve().parent.parent
RESULT = REPOSITORY / "benchmarks" / "results" / "reference_rate.json"
LOBE = ("lobe_GGX(vec3,vec3,vec3,vec3,float)", {"f0": (0.04, 0.04, 0.04), "alpha": 0.25})


def bunny():
    """The bunny filling the frame, lit by one directional light from above the camera."""
    mesh = meshes.normalized(meshes.load(REPOSITORY / "data" / "mesh" / "bunny.obj"))
    scene = reference.Scene()
    scene.set_material(scene.add_mesh(mesh.vertices, mesh.faces), [LOBE])
    scene.add_directional_light((0.4, 1.0, 0.7), (1.0, 1.0, 1.0))
    return scene, reference.Camera((0.4, 0.7, 3.1), (0, 0, 0), (0, 1, 0), 34)


def seconds(function, *arguments):
    start = time.perf_counter()
    function(*arguments)
    return time.perf_counter() - start


def measure(size, samples, rounds):
    """Medians over the rounds, in samples per second, and what else is needed to judge them.

    The ratio is the median of the rounds' own ratios, since other work on the machine slows both halves of a round.
    """
    scene, camera = bunny()
    image = (camera, size, size, samples)
    primary, shadow = scene.bare_loop(*image)
    times = [(seconds(scene.bare_loop, *image), seconds(scene.beauty, *image)) for _ in range(rounds)]
    bare, beauty = (primary / statistics.median(column) for column in zip(*times, strict=True))
    return {
        "date": datetime.date.today().isoformat(),
        "cpu": cpu_name(),
        "cores": os.cpu_count(),
        "embree": reference.embree_version,
        "lobe": LOBE[0],
        "size": size,
        "samples": samples,
        "rounds": rounds,
        "shadow_rays_per_sample": shadow / primary,
        "bare_samples_per_second": bare,
        "beauty_samples_per_second": beauty,
        "ratio": statistics.median(a / b for a, b in times),
    }


def cpu_name():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--rounds", type=int, default=7)
    arguments = parser.parse_args()
    result = measure(arguments.size, arguments.samples, arguments.rounds)
    RESULT.write_text(json.dumps(result, indent=1) + "\n")
    print(f"bare loop {result['bare_samples_per_second'] / 1e6:6.2f} M samples/s")
    print(f"beauty    {result['beauty_samples_per_second'] / 1e6:6.2f} M samples/s")
    print(f"ratio     {result['ratio']:6.2f}")


if __name__ == "__main__":
    main()
