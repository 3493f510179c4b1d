"""How wrong image-based light in real time is: the pass of examples/ (prefiltered probe and DFG) against the converged
picture of the same surface in the same probe. python -m lobe.lab.ibl [SAMPLES] measures, with so many samples a pixel
at most, and draws docs/figures/ibl-*.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from lobe import reference

from . import examples, files, gl, meshes, pictures, plots, probes, scenes
from .paths import ROOT

RESULTS = ROOT / "benchmarks" / "results" / "ibl.json"
FIGURES = ROOT / "docs" / "figures"
ALPHAS = (0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0)
OBJECTS = ("sphere", "teapot")
MATERIALS = {
    "gold": {"baseColor": examples.GOLD["baseColor"], "metallic": 1.0},
    "plastic": {"baseColor": examples.SURFACE["baseColor"], "metallic": 0.0},
}
PROBES = {"lobby": examples.lobby, "white": lambda: np.ones((32, 64, 3))}
SIZE, FINE = 128, 4  # pixels of a side; positions of a pixel's side, of which a real-time picture is the mean
ENOUGH = 5e-3  # standard error of a converged picture over the object, of the mean radiance of the probe
MOST = 4096  # samples a pixel, if that is not reached before
LIMIT = 0.5  # relative difference at the ends of the pictures' scale
RIM, HIDDEN = 0.3, 0.9  # N.V below, and share of the unshadowed diffuse light below, where errors are counted apart
GGX, LAMBERT = "lobe_GGX(vec3,vec3,vec3,vec3,float)", "lobe_Lambert(vec3,vec3,vec3,vec3)"
WHITE = (("albedo", (1.0, 1.0, 1.0)),)


@dataclass(frozen=True)
class Shown:
    """An object as the camera sees it: pixels wholly covered [h, w], and N.V at FINE x FINE places in each."""

    inside: np.ndarray
    NdotV: np.ndarray


@cache
def shown(thing: str) -> Shown:
    traced = scenes.bare(scenes.SHAPES[thing]).trace(scenes.camera(), SIZE * FINE, SIZE * FINE)
    places = _blocks((traced["object"] >= 0)[..., None])[..., 0]
    return Shown(places.all(-1), _blocks(np.sum(traced["N"] * traced["V"], axis=-1, keepdims=True))[..., 0])


def _blocks(fine: np.ndarray) -> np.ndarray:
    """[h FINE, w FINE, k] to [h, w, FINE FINE, k]."""
    h, w, k = fine.shape
    places = fine.reshape(h // FINE, FINE, w // FINE, FINE, k).swapaxes(1, 2)
    return places.reshape(h // FINE, w // FINE, FINE * FINE, k)


def realtime(context: gl.Context, probe: dict, thing: str, material: str, alpha: float) -> np.ndarray:
    """[h, w, 3], as the examples draw it, each pixel a mean over its area."""
    mesh = scenes.load_mesh(scenes.SHAPES[thing]) if scenes.SHAPES[thing] else meshes.uv_sphere(256, 512)
    surface = MATERIALS[material] | {"roughness": alpha**0.5}
    return _blocks(examples.probe_shading(context, mesh, SIZE * FINE, probe, surface)[..., :3].astype(float)).mean(2)


def converged(thing: str, material: str, alpha: float, room: str = "lobby") -> tuple[np.ndarray, np.ndarray]:
    """[h, w, 3] and its variance: the integral over the probe, the object's own shadow in it. As in the examples, what
    is reflected at the surface does not reach the diffuse part."""
    surface = MATERIALS[material]
    metallic, colour = surface["metallic"], np.array(surface["baseColor"])
    f0 = metallic * colour + (1 - metallic) * 0.04
    gloss, variance = _direct(room, thing, GGX, (("f0", tuple(f0)), ("alpha", alpha)))
    if metallic == 1:
        return gloss, variance
    diffuse, noise = _direct(room, thing, LAMBERT, WHITE)
    reaching = colour * (1 - _reflected(thing, 0.04, alpha)[..., None])
    return gloss + reaching * diffuse, variance + reaching**2 * noise


def _reflected(thing: str, f0: float, alpha: float) -> np.ndarray:
    """The exact albedo of lobe_GGX at each pixel, [h, w], from a table over N.V."""
    nodes = np.linspace(0.0, 1.0, 257)
    rows = np.stack([np.maximum(nodes, 1e-3), np.full_like(nodes, alpha)], axis=-1)
    scale, bias = reference.evaluate("lobe_DFG_GGX(float,float)", rows).T
    return np.interp(shown(thing).NdotV, nodes, f0 * scale + bias).mean(-1)


@cache
def _direct(room: str, thing: str, key: str, parameters: tuple) -> tuple[np.ndarray, np.ndarray]:
    built = scenes.bare(scenes.SHAPES[thing])
    built.set_material(0, [(key, dict(parameters))])
    built.set_environment(np.float32(PROBES[room]()))
    render = reference.Render(built, scenes.camera(), SIZE, SIZE, depth=1)
    inside, done, error = shown(thing).inside, 0, np.inf
    enough = ENOUGH * probes.mean(PROBES[room]())
    while error > enough and done < MOST:
        render.advance(64)
        done += 64
        error = np.sqrt(render.variance()[inside].mean())
    return render.beauty(), render.variance()


def measured(got: np.ndarray, expected: np.ndarray, variance: np.ndarray, thing: str) -> dict:
    """Errors over the object's pixels, relative to the mean of what is right; and where they lie. The squared error is
    freed of what the noise of a converged picture adds to it."""
    inside, NdotV = shown(thing).inside, shown(thing).NdotV.mean(-1)
    mean, error = expected[inside].mean(), (got - expected)[inside]
    squared, noise = (error**2 - variance[inside]).mean(-1), np.sqrt(variance[inside].mean()) / mean
    rim = NdotV[inside] < RIM
    hidden = (openness(thing)[inside] < HIDDEN) & ~rim
    return {
        "rms": float(np.sqrt(max(squared.mean(), 0)) / mean), "noise": float(noise), "bias": float(error.mean() / mean),
        "flip": float(flip_map(expected, got)[inside].mean()),
        "p99": float(np.quantile(np.abs(error), 0.99) / mean),
        "share_of_rim": float(squared[rim].sum() / squared.sum()),
        "share_of_shadow": float(squared[hidden].sum() / squared.sum()),
    }


@cache
def openness(thing: str) -> np.ndarray:
    """How much of the diffuse light arrives that would arrive without the object's own shadow, [h, w]."""
    N = scenes.bare(scenes.SHAPES[thing]).trace(scenes.camera(), SIZE, SIZE)["N"]
    towards, irradiance = probes.lights(examples.lobby(), 4096)
    free = np.maximum(N @ towards.T, 0) @ irradiance / np.pi
    lit, _ = _direct("lobby", thing, LAMBERT, WHITE)
    return np.where(shown(thing).inside, lit.mean(-1) / np.maximum(free.mean(-1), 1e-9), 1.0)


def flip_map(expected: np.ndarray, got: np.ndarray) -> np.ndarray:
    """FLIP of two linear pictures as the examples expose them, [h, w]."""
    import flip_evaluator

    encoded = (pictures.srgb(examples.EXPOSURE * x).astype(np.float32) for x in (expected, got))
    return flip_evaluator.evaluate(*encoded, "LDR", applyMagma=False, computeMeanError=False)[0][..., 0]


def strip(columns: list[tuple[np.ndarray, ...]], thing: str) -> np.ndarray:
    """Colours: real time, converged, relative difference, one column a width."""
    inside = shown(thing).inside
    window = pictures.Window(inside, SIZE)
    rows = []
    for got, expected, _ in columns:
        error = (got - expected).mean(-1) / np.maximum(expected.mean(-1), 1e-9)
        pair = [pictures.shown(window.mean(examples.EXPOSURE * x), window.mask) for x in (got, expected)]
        difference = pictures.diverging(window.extreme(error * inside), window.mask, LIMIT, np.inf)
        rows.append(np.concatenate([*pair, difference]))
    return np.concatenate(rows, axis=1)


def draw(result: dict):
    def on(figure):
        shown = {"rms": "RMS error over the mean", "flip": "mean FLIP"}
        for axis, (key, label) in zip(figure.subplots(1, 2), shown.items()):
            for (name, rows), colour, mark in zip(result["errors"].items(), plots.CYCLE, "os^d"):
                axis.semilogx([r["alpha"] for r in rows], [r[key] for r in rows], mark + "-", color=colour,
                              markersize=4, label=name)
            plots.style(axis, label, xlabel="alpha", ylim=(0, None))
        figure.axes[0].legend(fontsize=8, frameon=False)

    return on


def main(most: str = str(MOST)) -> None:
    global MOST
    MOST = int(most)
    context = gl.create_context("egl")
    with context:
        probe = examples.prefiltered(context, examples.lobby())
    result = {"size": SIZE, "probe": "lobby", "limit": LIMIT, "rim": RIM, "hidden": HIDDEN,
              "errors": {}}
    for thing in OBJECTS:
        for material in MATERIALS:
            columns = []
            for alpha in ALPHAS:
                with context:
                    got = realtime(context, probe, thing, material, alpha)
                columns.append((got, *converged(thing, material, alpha)))
            rows = [{"alpha": a} | measured(*c, thing) for a, c in zip(ALPHAS, columns)]
            result["errors"][f"{material} {thing}"] = rows
            files.write_png(figure(f"{material} {thing}"), strip(columns, thing))
            for row in rows:
                numbers = "  ".join(f"{k} {v:.3f}" for k, v in row.items())
                print(f"{material} {thing}  {numbers}", file=sys.stderr, flush=True)
    files.write_json(RESULTS, result)
    plots.write_svg(FIGURES / "ibl.svg", draw(result), (8.4, 3.4))


def figure(name: str) -> Path:
    """Where the picture of a material on an object lies."""
    return FIGURES / f"ibl-{name.replace(' ', '-')}.png"


def load() -> dict | None:
    """What was measured last; None in an installed package, which holds no measurements."""
    return json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else None


if __name__ == "__main__":
    main(*sys.argv[1:])
