"""Lafortune's lobes fitted to samples, each channel by itself: `./lobe fit`.

Minimised is the sum of weight (NdotV NdotL (fit - f))^2. It has many local minima. Begun is at the best of many random
directions and exponents, each with its heights by linear least squares; from there a trust region descends with exact
derivatives, within the ranges that the shader's header states, and the best of what it finds descends to the end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, nnls

from . import catalogue, quadrature
from .errors import InputError
from .samples import Samples

DRAWS, STARTS, FINALISTS, SEED = 200, 10, 2, 1
ALBEDO_VIEWS = (0, 30, 60, 75, 80, 85)  # degrees
CHANNELS = ("red", "green", "blue")
NAMES = {1: "lobe_Lafortune", 2: "lobe_Lafortune2", 3: "lobe_Lafortune3"}
DIGITS = 6
BLACK = 1e-30  # less is nothing
DOUBTFUL = 0.5  # residual above which lobes do not follow the samples at all
Step = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Lobes:
    """A diffuse albedo and lobes, for one channel: C [lobes, 3], exponent [lobes]."""

    diffuse: float
    C: np.ndarray
    exponent: np.ndarray

    def __call__(self, V: np.ndarray, L: np.ndarray) -> np.ndarray:
        """f [n]."""
        b = np.maximum((V * L) @ self.C.T, 0.0)
        return self.diffuse / np.pi + (b**self.exponent).sum(1)


@dataclass(frozen=True)
class Fit:
    """What was found, a Lobes for each of one or three channels.

    residual  of each channel: the root of the weighted squared error over that of the samples
    """

    samples: Samples
    channels: tuple[Lobes, ...]
    residual: tuple[float, ...]

    def __call__(self, V: np.ndarray, L: np.ndarray) -> np.ndarray:
        """f [n, channels]."""
        return np.stack([lobes(V, L) for lobes in self.channels], axis=1)

    @property
    def names(self) -> tuple[str, ...]:
        return CHANNELS if len(self.channels) == 3 else ("value",)

    @property
    def parameters(self) -> dict[str, tuple[float, float, float]]:
        """By the names of the shader's parameters."""
        rgb = self.channels * (3 // len(self.channels))
        found = {"diffuse": tuple(c.diffuse for c in rgb)}
        count = len(rgb[0].exponent)
        for j in range(count):
            number = str(j + 1) if count > 1 else ""
            found |= {f"C{axis}{number}": tuple(float(c.C[j, k]) for c in rgb) for k, axis in enumerate("xyz")}
            found[f"exponent{number}"] = tuple(float(c.exponent[j]) for c in rgb)
        return found

    @property
    def function(self) -> catalogue.Function:
        """The shader's function that takes the parameters."""
        return catalogue.load().find(NAMES[len(self.channels[0].exponent)])[0]

    @property
    def glsl(self) -> str:
        values = (f"vec3({', '.join(map(literal, v))})" for v in self.parameters.values())
        return f"{self.function.name}(N, T, V, L, {', '.join(values)})"

    def albedo(self, degrees: float) -> np.ndarray:
        """What comes back of light from a direction, [channels]."""
        return albedo(self, np.radians(degrees))


def literal(x: float) -> str:
    """A number as GLSL reads it."""
    text = f"{x:.{DIGITS}g}"
    return text if set(text) & set(".e") else f"{text}.0"


def albedo(f: Callable[[np.ndarray, np.ndarray], np.ndarray], view: float) -> np.ndarray:
    """The integral of f NdotL over lights, for a view at an angle along T. Gaussian nodes over the angle, even ones
    over the azimuth: for lobes of any direction, which no mirror direction tells."""
    x, w = np.polynomial.legendre.leggauss(160)
    theta, phi = (x + 1) * np.pi / 4, np.arange(320) * np.pi / 160
    L = quadrature.spherical(theta[:, None], phi)
    weight = np.repeat(w * np.pi / 4 * np.sin(theta) * np.cos(theta) * np.pi / 160, 320)
    return weight @ f(np.broadcast_to(quadrature.spherical(view, 0.0), L.shape), L)


def fit(samples: Samples, count: int, anisotropic: bool = False, seed: int = SEED,
        step: Step = lambda name, done, of: None) -> Fit:
    """`count` lobes a channel. InputError where the samples cannot tell so many."""
    require(samples, count, anisotropic)
    problems = [Problem(samples, f, count, anisotropic) for f in samples.f.T]
    rng = np.random.default_rng(seed)
    draws = [problems[0].draw(rng) for _ in range(DRAWS)]
    best: list[np.ndarray] = []
    for channel, problem in enumerate(problems):
        if channel and (samples.f[:, channel] == samples.f[:, channel - 1]).all():
            best.append(best[-1])
            continue
        if problem.size < BLACK:
            best.append(problem.black)
            continue
        starts = sorted((problem.start(*draw) for draw in draws), key=problem.error)[:STARTS]
        starts += [x for x in best if x.any()]  # what the other channels found keeps lobes of one kind together
        found = []
        for i, x in enumerate(starts):
            step(f"{samples.name}: {CHANNELS[channel]}", channel * STARTS + i, STARTS * len(problems))
            found.append(problem.descended(x, 40, 1e-5))
        best.append(min((problem.descended(x, 400, 1e-10) for x in sorted(found, key=problem.error)[:FINALISTS]),
                        key=problem.error))
    channels = tuple(rounded(problem.lobes(x)) for problem, x in zip(problems, best))
    return Fit(samples, channels, tuple(problem.residual(lobes) for problem, lobes in zip(problems, channels)))


def require(samples: Samples, count: int, anisotropic: bool) -> None:
    unknowns = 1 + (4 if anisotropic else 3) * count
    distinct = len(np.unique(np.round(np.hstack([samples.V, samples.L])[samples.metric > 0], 9), axis=0))
    if distinct < unknowns:
        raise InputError(f"{samples.name}: {distinct} different sample{'s' * (distinct != 1)}, expected at least "
                         f"{unknowns}, the unknowns of {count} lobe{'s' * (count > 1)}; take fewer lobes or add "
                         "samples")
    if np.max(samples.f * samples.metric[:, None]) < BLACK:
        raise InputError(f"{samples.name}: all values are 0, expected a reflectance; check its columns")


def rounded(lobes: Lobes) -> Lobes:
    """To the digits that are printed, so that what is reported is what is pasted."""
    def few(x):
        return np.array([float(f"{v:.{DIGITS}g}") for v in np.ravel(x)]).reshape(np.shape(x))

    diffuse = float(few(lobes.diffuse))
    return Lobes(diffuse if diffuse > 1e-6 else 0.0, few(lobes.C), few(lobes.exponent))  # bounds are never met exactly


def facts(found: Fit, seed: int) -> dict:
    """What fit.json holds."""
    return {"samples": found.samples.name, "count": len(found.samples.f), "seed": seed, "function": found.function.key,
            "parameters": found.parameters, "glsl": found.glsl, "residual": dict(zip(found.names, found.residual)),
            "energy": [{"theta": t, **dict(zip(found.names, found.albedo(t)))} for t in ALBEDO_VIEWS]}


def summary(found: Fit) -> str:
    """For the terminal."""
    count, lobes = len(found.samples.f), len(found.channels[0].exponent)
    albedos = np.array([found.albedo(t) for t in ALBEDO_VIEWS])
    lines = [f"{found.samples.name}: {count} samples, diffuse and {lobes} lobe{'s' * (lobes > 1)}",
             "residual, of the weighted root mean square: "
             + ", ".join(f"{name} {100 * r:.2g} %" for name, r in zip(found.names, found.residual)),
             f"albedo at {', '.join(map(str, ALBEDO_VIEWS))} degrees:"]
    lines += [f"  {name:6s}{'  '.join(f'{a:.3f}' for a in column)}" for name, column in zip(found.names, albedos.T)]
    if max(found.residual) > DOUBTFUL:
        lines.append("the lobes do not follow these samples: values are 1/sr without the cosine, angles degrees")
    if albedos.max() > 1:
        lines.append("more than 1: where it is, the fit gives back more light than it gets")
    return "\n".join([*lines, "", found.glsl])


class Problem:
    """One channel. Unknowns x: diffuse, then for each lobe C (one number for Cx = Cy, and Cz; or three) and the
    exponent's logarithm."""

    def __init__(self, samples: Samples, f: np.ndarray, count: int, anisotropic: bool):
        products = samples.V * samples.L
        self.products = products if anisotropic else np.stack([products[:, 0] + products[:, 1], products[:, 2]], axis=1)
        self.size = np.sqrt(np.sum((samples.metric * f) ** 2))
        self.metric, self.f, self.count = samples.metric / max(self.size, BLACK), f, count
        self.anisotropic = anisotropic
        shader = catalogue.load().find(NAMES[1])[0]
        C, exponent = shader.parameter("Cx"), shader.parameter("exponent")
        width = self.products.shape[1]
        self.low = np.array([0.0] + ([C.low] * width + [np.log(exponent.low)]) * count)
        self.high = np.array([1.0] + ([C.high] * width + [np.log(exponent.high)]) * count)

    @property
    def black(self) -> np.ndarray:
        """The unknowns of no light at all."""
        return np.zeros(len(self.low))

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Unit C and exponents: anywhere, or near the mirror direction, where most surfaces have their highlight."""
        C = rng.normal(size=(self.count, self.products.shape[1]))
        mirror = np.append(-np.ones(C.shape[1] - 1), 1.0)
        near = rng.random(self.count) < 0.6
        C[near] = mirror + 0.3 * C[near]
        return C / np.linalg.norm(C, axis=1, keepdims=True), np.exp(rng.uniform(0, np.log(300), self.count))

    def start(self, C: np.ndarray, exponent: np.ndarray) -> np.ndarray:
        """The unknowns whose lobes have these directions and exponents, and the best heights, none of them 0."""
        b = np.maximum(self.products @ C.T, 0.0)
        basis = np.hstack([np.full((len(b), 1), 1 / np.pi), b**exponent]) * self.metric[:, None]
        heights = nnls(basis.T @ basis + 1e-12 * np.eye(self.count + 1), basis.T @ (self.metric * self.f))[0]
        C = C * np.maximum(heights[1:], 1e-4)[:, None] ** (1 / exponent[:, None])
        x = np.concatenate([heights[:1], np.hstack([C, np.log(exponent)[:, None]]).ravel()])
        return np.clip(x, self.low + 1e-6, self.high - 1e-6)

    def _parts(self, x: np.ndarray):
        shape = x[1:].reshape(self.count, -1)
        exponent = np.exp(shape[:, -1])
        b = np.maximum(self.products @ shape[:, :-1].T, 1e-30)
        return exponent, b, np.where(b > 1e-30, b**exponent, 0.0)

    def errors(self, x: np.ndarray) -> np.ndarray:
        _, _, lobes = self._parts(x)
        return self.metric * (x[0] / np.pi + lobes.sum(1) - self.f)

    def error(self, x: np.ndarray) -> float:
        return float(np.sum(self.errors(x) ** 2))

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """Of `errors` over x."""
        exponent, b, lobes = self._parts(x)
        over_C = (exponent * lobes / b)[:, :, None] * self.products[:, None, :]
        over_log = (lobes * exponent * np.log(b))[:, :, None]
        own = np.concatenate([over_C, over_log], axis=2).reshape(len(b), -1)
        return self.metric[:, None] * np.hstack([np.full((len(b), 1), 1 / np.pi), own])

    def descended(self, x: np.ndarray, most: int, exact: float) -> np.ndarray:
        """The unknowns at the bottom below x, after `most` steps at most."""
        return least_squares(self.errors, x, self.slopes, bounds=(self.low, self.high), x_scale="jac", max_nfev=most,
                             ftol=exact, xtol=exact, gtol=1e-12).x

    def lobes(self, x: np.ndarray) -> Lobes:
        """The lobes, the broadest first."""
        shape = x[1:].reshape(self.count, -1)
        C = shape[:, :-1] if self.anisotropic else shape[:, [0, 0, 1]]
        order = np.argsort(shape[:, -1])
        return Lobes(float(x[0]), C[order], np.exp(shape[order, -1]))

    def residual(self, lobes: Lobes) -> float:
        """Of the channel, as in Fit."""
        C = lobes.C if self.anisotropic else lobes.C[:, 1:]
        x = np.concatenate([[lobes.diffuse], np.hstack([C, np.log(lobes.exponent)[:, None]]).ravel()])
        return float(np.sqrt(self.error(x)))
