"""Whether a material is reciprocal and gives back no more than it gets, and what is lost when another takes its place.

Asked of the reference with the parameters of now, not of the headers.

A material is a list of (function, values), whose f is their sum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lab import quadrature
from ..lab.catalogue import Function
from . import curves
from .curves import Evaluate, Rule, Values

Material = list[tuple[Function, Values]]

PAIRS = 1 << 11
SEED = 11
RECIPROCAL = 1e-6  # relative; what differs by less is rounding of the narrowest lobes
VIEWS = np.radians([0.5, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0, 89.0])
AZIMUTHS = 10 * VIEWS  # so that none of an anisotropic lobe's symmetries is favoured
FINE, COARSE = 48, 42  # nodes of the quadrature, and of one that tells how far it can be trusted
SURE = 1e-3  # difference of the two at which no other rule is tried


@dataclass(frozen=True)
class Plausibility:
    """`asymmetry` is the largest relative difference of f(V, L) and f(L, V); `albedo` the largest of any channel, at a
    view `angle` (radians); `doubt` how much a coarser rule of integration differs from it."""

    asymmetry: float
    albedo: float
    angle: float
    doubt: float

    @property
    def is_reciprocal(self) -> bool:
        return self.asymmetry <= RECIPROCAL

    @property
    def keeps_energy(self) -> bool:
        return self.albedo <= 1.0 + max(self.doubt, 1e-4)

    @property
    def is_certain(self) -> bool:
        """Whether the quadrature resolves the lobe."""
        return self.doubt <= 0.01 * max(self.albedo, 1e-3)


@dataclass(frozen=True)
class Loss:
    """What changes when B takes the place of A.

    moved    the integral of |f_A - f_B| N.L over lights, as a share of what A sends back, in luminance: the mean over
             views; and `worst`, the largest, with its angle (radians)
    albedo   the largest difference of their albedos, with its angle
    """

    moved: float
    worst: float
    worst_angle: float
    albedo: float
    albedo_angle: float


def total(material: Material, frames, evaluate: Evaluate) -> np.ndarray:
    """f of the sum at frames, [n, 3]."""
    return sum(np.broadcast_to(np.asarray(evaluate(f, curves.columns(f, v, *frames)), float), (len(frames[0]), 3))
               for f, v in material)


def measure(material: Material, evaluate: Evaluate = curves.reference_values) -> Plausibility:
    _, albedo, doubt = integrated(material, evaluate)
    worst = np.unravel_index(np.argmax(albedo), albedo.shape)
    return Plausibility(asymmetry(material, evaluate), float(albedo[worst]), float(VIEWS[worst[0]]), doubt)


def integrated(material: Material, evaluate: Evaluate = curves.reference_values) -> tuple[Rule, np.ndarray, float]:
    """The rule that integrates a material best, its albedo [views, 3], and by how much fewer nodes would change it."""
    found = []
    for rule in (curves.lights,) if curves.is_slow([f for f, _ in material]) else (curves.lights, curves.halves):
        fine, coarse = (_albedos(material, rule, count, evaluate) for count in (FINE, COARSE))
        found.append((rule, fine, float(abs(fine - coarse).max())))
        if found[-1][2] <= SURE:
            break
    return min(found, key=lambda one: one[2])


def _albedos(material: Material, rule: Rule, count: int, evaluate: Evaluate) -> np.ndarray:
    frames, weights = curves.over_lights([f for f, _ in material], VIEWS, AZIMUTHS, rule, count)
    return np.einsum("vl,vlk->vk", weights, total(material, frames, evaluate).reshape(*weights.shape, 3))


def asymmetry(material: Material, evaluate: Evaluate = curves.reference_values) -> float:
    """The largest relative difference of f(V, L) and f(L, V), over random pairs, half of them about the highlight."""
    V, L = _pairs()
    there, back = (total(material, curves.framed(*pair), evaluate) for pair in ((V, L), (L, V)))
    larger = np.maximum(abs(there), abs(back))
    seen = larger > 1e-6 * larger.max(initial=1e-30)  # far down the flanks a difference is seen by nobody
    return float((abs(there - back)[seen] / larger[seen]).max(initial=0.0))


def loss(A: Material, B: Material, evaluate: Evaluate = curves.reference_values) -> Loss:
    """From A to B."""
    rule, _, _ = integrated(A + B, evaluate)
    frames, weights = curves.over_lights([f for f, _ in A + B], VIEWS, AZIMUTHS, rule)
    a, b = (total(m, frames, evaluate).reshape(*weights.shape, 3) for m in (A, B))
    sent = np.sum(weights * curves.luminance(a), 1)
    moved = np.sum(weights * abs(curves.luminance(a - b)), 1) / np.maximum(sent, 1e-30)
    apart = abs(np.einsum("vl,vlk->vk", weights, a - b)).max(1)
    worst, albedo = int(np.argmax(moved)), int(np.argmax(apart))
    return Loss(float(moved.mean()), float(moved[worst]), float(VIEWS[worst]), float(apart[albedo]),
                float(VIEWS[albedo]))


def _pairs() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(SEED)
    cosine, azimuth = rng.uniform(0.02, 1.0, (2, PAIRS)), rng.uniform(0, 2 * np.pi, (2, PAIRS))
    V, L = (quadrature.spherical(np.arccos(c), a) for c, a in zip(cosine, azimuth))
    near = V * [-1, -1, 1] + rng.normal(size=V.shape) * 10.0 ** rng.uniform(-4, -0.5, (PAIRS, 1))
    near[:, 2] = abs(near[:, 2]) + 0.01
    L[::2] = (near / np.linalg.norm(near, axis=-1, keepdims=True))[::2]
    return tuple(x.astype(np.float32).astype(float) for x in (V, L))
