"""The geometric parameters of the library and how a pixel's N, T, V, L form each of them.

Their names are fixed across the library (a header needs no `param` line for them), which is what lets the bench draw
any term, not only whole lobes, on a scene.
"""

from __future__ import annotations

import numpy as np


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot product over the last axis, which is kept with length 1."""
    return np.sum(a * b, axis=-1, keepdims=True)


def normalize(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def bitangent(N: np.ndarray, T: np.ndarray) -> np.ndarray:
    return np.cross(N, T)


def halfway(V: np.ndarray, L: np.ndarray) -> np.ndarray:
    """V + L normalised; the null vector where L = -V."""
    H = V + L
    length = np.linalg.norm(H, axis=-1, keepdims=True)
    return np.divide(H, length, out=np.zeros_like(H), where=length > 0)


# Each from float64 N, T, V, L of shape [..., 3]. N, T, V, L are unit vectors; H has the length that V + L has.
FORM = {
    "N": lambda N, T, V, L: N,
    "T": lambda N, T, V, L: T,
    "V": lambda N, T, V, L: V,
    "L": lambda N, T, V, L: L,
    "H": lambda N, T, V, L: V + L,
    "NdotV": lambda N, T, V, L: dot(N, V),
    "NdotL": lambda N, T, V, L: dot(N, L),
    "NdotX": lambda N, T, V, L: dot(N, V),
    "NdotH": lambda N, T, V, L: dot(N, halfway(V, L)),
    "LdotH": lambda N, T, V, L: np.linalg.norm(V + L, axis=-1, keepdims=True) / 2,
    "VdotH": lambda N, T, V, L: np.linalg.norm(V + L, axis=-1, keepdims=True) / 2,
    "TdotH": lambda N, T, V, L: dot(T, halfway(V, L)),
    "BdotH": lambda N, T, V, L: dot(bitangent(N, T), halfway(V, L)),
    "TdotV": lambda N, T, V, L: dot(T, V),
    "BdotV": lambda N, T, V, L: dot(bitangent(N, T), V),
    "TdotL": lambda N, T, V, L: dot(T, L),
    "BdotL": lambda N, T, V, L: dot(bitangent(N, T), L),
    "cosI": lambda N, T, V, L: dot(N, V),
}

DIRECTIONS = ("N", "T", "V", "L")  # unit vectors; H is not one of them: it may have any length
SIGNED = ("TdotH", "BdotH", "TdotV", "BdotV", "TdotL", "BdotL")  # cosines in -1..1, the others in 0..1
DEFAULTS = {"N": (0.0, 0.0, 1.0), "T": (1.0, 0.0, 0.0), "V": (0.6, 0.0, 0.8), "L": (-0.48, 0.64, 0.6)}


def default(name: str) -> tuple[float, ...]:
    """A pleasant value of a geometric parameter: view 37 degrees and light 53 degrees off the normal."""
    N, T, V, L = (np.array(DEFAULTS[d]) for d in ("N", "T", "V", "L"))
    return tuple(float(x) for x in FORM[name](N, T, V, L))
