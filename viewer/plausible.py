"""Whether a lobe, with the parameters that it has now, is plausible: reciprocal, and giving back no more than it gets.

Asked of the reference, not of the header.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lab import quadrature
from ..lab.catalogue import Function

from . import curves
from .curves import Evaluate, Values

PAIRS = 1 << 11
SEED = 11
RECIPROCAL = 1e-6  # relative; what differs by less is rounding of the narrowest lobes
VIEWS = np.radians([0.5, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0, 89.0])


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


def measure(function: Function, values: Values, evaluate: Evaluate = curves.reference_values) -> Plausibility:
    fine, coarse = (curves.albedo(function, values, VIEWS, count).of(evaluate) for count in (48, 42))
    worst = np.unravel_index(np.argmax(fine), fine.shape)
    return Plausibility(asymmetry(function, values, evaluate), float(fine[worst]), float(VIEWS[worst[0]]),
                        float(abs(fine - coarse).max()))


def asymmetry(function: Function, values: Values, evaluate: Evaluate = curves.reference_values) -> float:
    """The largest relative difference of f(V, L) and f(L, V), over random pairs, half of them about the highlight."""
    V, L = _pairs()
    there, back = (evaluate(function, curves.columns(function, values, *curves.framed(*pair)))
                   for pair in ((V, L), (L, V)))
    larger = np.maximum(abs(there), abs(back))
    seen = larger > 1e-6 * larger.max(initial=1e-30)  # far down the flanks a difference is seen by nobody
    return float((abs(there - back)[seen] / larger[seen]).max(initial=0.0))


def _pairs() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(SEED)
    cosine, azimuth = rng.uniform(0.02, 1.0, (2, PAIRS)), rng.uniform(0, 2 * np.pi, (2, PAIRS))
    V, L = (quadrature.spherical(np.arccos(c), a) for c, a in zip(cosine, azimuth))
    near = V * [-1, -1, 1] + rng.normal(size=V.shape) * 10.0 ** rng.uniform(-4, -0.5, (PAIRS, 1))
    near[:, 2] = abs(near[:, 2]) + 0.01
    L[::2] = (near / np.linalg.norm(near, axis=-1, keepdims=True))[::2]
    return tuple(x.astype(np.float32).astype(float) for x in (V, L))
