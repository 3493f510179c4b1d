"""Stratified inputs over a function's stated domain, denser towards both ends of each range, where formulas fail."""

from __future__ import annotations

import numpy as np

from . import geometry
from .catalogue import Function, Parameter

Inputs = dict[str, np.ndarray]  # parameter name -> float32 [n, width]

# How near to a singular set the logarithmic strata reach, relative to the range. Cosines of directions keep farther
# away: a horizon nearer than float32 resolves only makes undecided points.
NEAREST, NEAREST_HORIZON = 1e-7, 1e-6


def sample(function: Function, count: int, seed: int) -> Inputs:
    """`count` inputs of a function, exact in float32, every one inside the domain that its header states."""
    rng = np.random.default_rng(seed)
    names = {p.name for p in function.parameters}
    N, T, V, L = _frames(rng, count, below=0.03 if function.kind == "lobe" else 0.0)
    inputs = {}
    for p in function.parameters:
        if p.kind == "direction":
            inputs[p.name] = {"N": N, "T": T, "V": V, "L": L}[p.name]
        elif p.kind == "half":
            inputs[p.name] = V + L if {"V", "L"} <= names else _halves(rng, N)
        else:
            inputs[p.name] = np.stack([_scalar(rng, count, p) for _ in range(p.width)], axis=-1)
    return {name: rounded(x, function.parameter(name)) for name, x in inputs.items()}


def rounded(x: np.ndarray, parameter: Parameter) -> np.ndarray:
    """To float32 without leaving the range."""
    x = x.astype(np.float32)
    if parameter.kind in ("direction", "half"):
        return x
    low, high = np.float32(parameter.low), np.float32(parameter.high)
    low = np.nextafter(low, high) if low < parameter.low else low
    high = np.nextafter(high, low) if high > parameter.high else high
    return np.clip(x, low, high)


def _strata(rng: np.random.Generator, count: int) -> np.ndarray:
    """One number in each of `count` equal parts of [0, 1), in random order."""
    return (rng.permutation(count) + rng.random(count)) / count


def _unit(rng: np.random.Generator, count: int, nearest: float = NEAREST) -> np.ndarray:
    """Numbers in [0, 1]: half uniform, a quarter logarithmically near 0, a quarter near 1, the ends themselves."""
    u = _strata(rng, count)
    near = nearest ** ((4 * u) % 1)  # 1 .. nearest
    x = np.where(u < 0.5, 2 * u, np.where(u < 0.75, near, 1 - near))
    ends = rng.random(count)
    return np.where(ends < 0.002, 0.0, np.where(ends > 0.998, 1.0, x))


def _scalar(rng: np.random.Generator, count: int, p: Parameter) -> np.ndarray:
    u = _unit(rng, count)
    if p.low > 0 and p.high / p.low > 20:
        return np.exp(np.log(p.low) + u * np.log(p.high / p.low))
    x = p.low + u * (p.high - p.low)
    for critical in (0.0, 1.0):  # where a factor such as eta - 1 changes its sign
        if p.low < critical < p.high:
            near = critical + rng.choice([-1.0, 1.0], count) * NEAREST ** rng.random(count)
            x = np.where(rng.random(count) < 0.2, np.clip(near, p.low, p.high), x)
    return x


def _orthonormal(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    N = geometry.normalize(rng.normal(size=(count, 3)))
    aligned = rng.random(count) < 0.05
    N[aligned] = np.sign(N[aligned, :1]) * np.eye(3)[rng.integers(0, 3, aligned.sum())]
    t = rng.normal(size=(count, 3))
    return N, geometry.normalize(t - N * geometry.dot(N, t))


def _tilted(N: np.ndarray, T: np.ndarray, cosine: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    sine = np.sqrt((1 - cosine) * (1 + cosine))
    B = geometry.bitangent(N, T)
    return N * cosine[:, None] + (T * np.cos(azimuth)[:, None] + B * np.sin(azimuth)[:, None]) * sine[:, None]


def _anywhere(rng: np.random.Generator, N: np.ndarray, T: np.ndarray, below: float) -> np.ndarray:
    """Directions at stratified cosines from N, a part `below` of them below the horizon."""
    cosine = np.clip(_unit(rng, len(N), NEAREST_HORIZON), NEAREST_HORIZON, 1.0)
    side = np.where(rng.random(len(N)) < below, -1.0, 1.0)
    return _tilted(N, T, cosine * side, rng.uniform(0, 2 * np.pi, len(N)))


def _nearby(rng: np.random.Generator, v: np.ndarray) -> np.ndarray:
    """Directions at logarithmically distributed angles from v."""
    offset = rng.normal(size=v.shape)
    return geometry.normalize(v + offset * (NEAREST ** rng.random(len(v)))[:, None])


def _frames(rng: np.random.Generator, count: int, below: float) -> tuple[np.ndarray, ...]:
    """Unit N, T, V, L: light anywhere, near the mirror direction, near the view, or almost opposite. V is above the
    horizon but for a part `below`: only lobes say what happens there."""
    N, T = _orthonormal(rng, count)
    V, anywhere = _anywhere(rng, N, T, below), _anywhere(rng, N, T, 0.03)
    mirror = 2 * N * geometry.dot(N, V) - V
    which = rng.random(count)[:, None]
    L = np.where(which < 0.5, anywhere, np.where(which < 0.8, _nearby(rng, mirror),
                 np.where(which < 0.9, _nearby(rng, V), _nearby(rng, -V))))
    return N, T, V, geometry.normalize(L)


def _halves(rng: np.random.Generator, N: np.ndarray) -> np.ndarray:
    """H for functions that take no V and L: near N or anywhere above the horizon, of any length."""
    anywhere = geometry.normalize(rng.normal(size=N.shape))
    H = np.where(rng.random((len(N), 1)) < 0.7, _nearby(rng, N), anywhere)
    above = np.where(geometry.dot(N, H) < 0, -1.0, 1.0)
    return H * above * rng.uniform(0.01, 2.0, (len(N), 1))
