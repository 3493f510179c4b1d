"""What half precision costs each function: the result alone in half, the inputs in half, and all arithmetic in half.

Held to the same shader in float32, over what a renderer asks for: directions above the horizon, half of them about the
highlight, and every width of it. Errors are relative, of at least a thousandth of the brightest value at that width.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import bundle, geometry, gl, plots, treatments
from .catalogue import Catalogue, Function

WIDTHS = 10.0 ** np.linspace(-4, 0, 25)  # of the highlight, as GGX's alpha
POINTS = 1 << 10  # at each width
SEED = 17
USABLE = 0.05  # what 99 % of the values must stay below for a function to be of use
UNSEEN = 0.01  # the same for an input to be left in half
DIM = 1e-3  # of the brightest value
NEVER = float("inf")
BROAD = WIDTHS > 0.099


@dataclass(frozen=True)
class Cost:
    """What one treatment costs.

    p99      relative error that 99 % of the values stay below, at each width; infinite where more are NaN or infinite
    finite   whether all values are finite, at each width
    """

    p99: np.ndarray
    finite: np.ndarray

    @property
    def error(self) -> float:
        """The error where highlights are broad, alpha from 0.1."""
        return float(self.p99[BROAD].max())


def least(good: np.ndarray) -> float:
    """The least width from which on all is good; NEVER where it is not even for the broadest highlight."""
    lasting = np.logical_and.accumulate(good[::-1])[::-1]
    return float(WIDTHS[lasting.argmax()]) if lasting.any() else NEVER


LABELS = {"stored": "result in half", "inputs": "inputs in half", "arithmetic": "all in half",
          "flushed": "all in half, flushed"}
TREATMENTS = tuple(LABELS)
DRAWN = {"lobe_D_GGX(float,float)": "GGX: D of a cosine", "lobe_D_GGX(vec3,vec3,float)": "GGX: D of vectors",
         "lobe_V_GGX": "GGX: V of cosines", "lobe_GGX": "whole GGX lobe"}
SHOWN, SIZE = (1e-4, 2.0), (12.6, 3.2)


def is_width(name: str) -> bool:
    return name.startswith(("alpha", "exponent")) or name in ("r", "rb", "nu", "nv")


def _width(name: str, a: np.ndarray) -> np.ndarray:
    """A parameter's value for a highlight as wide as GGX's of alpha = a."""
    return a if name.startswith("alpha") else a * a if name in ("r", "rb") else 2 / (a * a) - 2


def usual(function: Function, points: int = POINTS, seed: int = SEED) -> dict[str, np.ndarray]:
    """Inputs [widths * points, k], in float32 and in the function's domain; a width's follow each other."""
    rng = np.random.default_rng(seed)
    a = np.repeat(WIDTHS, points)
    frame = _frames(rng, a)
    inputs = {}
    for p in function.parameters:
        if p.is_geometry:
            x = geometry.FORM[p.name](*frame)
            x = x if p.kind in ("direction", "half") else np.clip(x, p.low, p.high)
        elif is_width(p.name):
            x = np.clip(_width(p.name, a)[:, None] * np.ones(p.width), p.low, p.high)
        elif p.low > 0 and p.high / p.low > 20:
            x = np.exp(rng.uniform(np.log(p.low), np.log(p.high), (len(a), p.width)))
        else:
            x = rng.uniform(p.low, p.high, (len(a), p.width))
        inputs[p.name] = x.astype(np.float32)
    return inputs


def _frames(rng: np.random.Generator, a: np.ndarray) -> tuple[np.ndarray, ...]:
    """N, T, V, L. Every other L mirrors V at a facet drawn from GGX, where that is above the horizon."""
    N, T = (geometry.normalize(rng.normal(size=(len(a), 3))) for _ in range(2))
    T = geometry.normalize(np.cross(N, T))
    B = geometry.bitangent(N, T)

    def around(sine_over_cosine):
        phi = rng.uniform(0, 2 * np.pi, (len(a), 1))
        return geometry.normalize(N + sine_over_cosine[:, None] * (T * np.cos(phi) + B * np.sin(phi)))

    def hemisphere():
        c = rng.uniform(1e-3, 1, len(a))
        return around(np.sqrt((1 - c) * (1 + c)) / c)

    V, L = hemisphere(), hemisphere()
    u = rng.random(len(a))
    H = around(a * np.sqrt(u / (1 - u)))
    mirrored = 2 * geometry.dot(V, H) * H - V
    use = (np.arange(len(a)) % 2 == 0)[:, None] & (geometry.dot(N, mirrored) > 1e-3)
    return N, T, V, np.where(use, mirrored, L)


def costs(library: Catalogue, function: Function, context: gl.Context) -> dict[str, Cost]:
    """By treatment: `stored`, the result alone in half; `inputs`, all of them in half and arithmetic in float32; an
    input's name, that one alone; `arithmetic`, all in half; `flushed`, that with numbers below 2^-14 flushed to 0."""
    inputs, text = usual(function), bundle.bundle(library, [function.key])

    def shaded(source: str, values: dict) -> np.ndarray:
        with context:
            return gl.evaluate(context, source, function.call, function.result, {n: x[None] for n, x in values.items()})

    exact = shaded(text, inputs)
    halves = {name: treatments.halved(x) for name, x in inputs.items()}
    values = {"stored": treatments.halved(exact), "inputs": shaded(text, halves),
              "arithmetic": shaded(treatments.half(text), halves),
              "flushed": treatments.halved(shaded(treatments.half(text, True),
                                                  {n: treatments.halved(x, True) for n, x in inputs.items()}), True)}
    values |= {name: shaded(text, inputs | {name: halves[name]}) for name in inputs}
    return {name: _cost(function, got.astype(float), exact.astype(float)) for name, got in values.items()}


def _cost(function: Function, got: np.ndarray, exact: np.ndarray) -> Cost:
    got, exact = (x.reshape(len(WIDTHS), -1, x.shape[-1]) for x in (got, exact))
    with np.errstate(invalid="ignore"):
        error = np.abs(got - exact)
    if function.returns_directions:
        error, size = (np.linalg.norm(x, axis=-1, keepdims=True) for x in (error, exact))
        size = np.maximum(size, DIM)
    else:
        size = np.maximum(np.abs(exact), DIM * np.abs(exact).max((1, 2), keepdims=True))
    relative = np.divide(error, size, out=np.zeros_like(error), where=size > 0).max(-1)
    worst = np.sort(np.where(np.isnan(relative), np.inf, relative), axis=1)[:, int(0.99 * relative.shape[1])]
    return Cost(worst, np.isfinite(got).all((1, 2)))


def row(library: Catalogue, function: Function, context: gl.Context) -> dict:
    """What precision.json holds of a function: errors of each treatment; the least alpha for which it is of use, and
    from which all values are finite; and the inputs that must be highp, with the alpha from which on half does. A
    function without a width has no least alpha: all is said of broad highlights."""
    found = costs(library, function, context)
    wide = any(is_width(p.name) for p in function.parameters)

    def limit(good: np.ndarray) -> float:
        return least(good) if wide else WIDTHS[0] if good[BROAD].all() else NEVER

    needs = {p.name: limit(found[p.name].p99 <= UNSEEN) for p in function.parameters}
    return {"width": wide, "inputs": [p.name for p in function.parameters],
            "error": {name: found[name].error for name in TREATMENTS},
            "least": {name: limit(found[name].p99 <= USABLE) for name in TREATMENTS},
            "finite": {name: limit(found[name].finite) for name in TREATMENTS},
            "highp": {name: width for name, width in needs.items() if width > WIDTHS[0]}
            } | ({"curves": {name: found[name].p99 for name in TREATMENTS}} if library.label(function) in DRAWN else {})


def draw(figure, rows: dict[str, dict]) -> None:
    """The error over alpha of the functions in DRAWN; crosses at the top where more than 1 % is NaN or infinite."""
    names = [name for name in DRAWN if name in rows]
    panels = figure.subplots(1, len(names), sharex=True, sharey=True, squeeze=False)[0]
    for axes, name in zip(panels, names):
        for treatment, colour in zip(TREATMENTS, (plots.GREEN, plots.BLUE, plots.ORANGE, plots.PURPLE)):
            error = np.array([np.inf if x is None else x for x in rows[name]["curves"][treatment]], float)
            lost = ~np.isfinite(error)
            axes.plot(WIDTHS, np.where(lost, np.nan, np.clip(error, *SHOWN)), color=colour, label=LABELS[treatment])
            axes.plot(WIDTHS[lost], np.full(lost.sum(), 0.8 * SHOWN[1]), "x", color=colour)
        axes.axhline(USABLE, color=plots.GREY, linewidth=1, linestyle=":")
        plots.style(axes, DRAWN[name], xscale="log", yscale="log", ylim=SHOWN, xlabel="alpha")
    panels[0].set_ylabel("relative error, 99th percentile")
    panels[0].legend(fontsize=7, frameon=False, loc="lower left")
