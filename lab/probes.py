"""Light from all around: latitude-longitude probes, and the few directions that stand for one.

One convention, that of examples/: row 0 is up, +y; the columns run from +z over -x, -z (the middle) and +x back to +z.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import files

LUMINANCE = (0.2126, 0.7152, 0.0722)  # of linear sRGB


def load(path: Path) -> np.ndarray:
    """The radiance of a probe, linear [h, w, 3]. Lossy compression leaves some values below 0; they become 0."""
    return np.maximum(files.read_exr(path)["RGB"], 0)


def direction(u, cosine) -> np.ndarray:
    """Unit directions [..., 3] of columns u in 0..1 and of cosines to +y."""
    phi, sine = (np.asarray(u) - 0.5) * 2 * np.pi, np.sqrt(1 - np.asarray(cosine) ** 2)
    return np.stack(np.broadcast_arrays(sine * np.sin(phi), cosine, -sine * np.cos(phi)), axis=-1)


def solid_angles(height: int, width: int) -> np.ndarray:
    """Of the texels of each row, [h, 1] steradians."""
    return -2 * np.pi / width * np.diff(np.cos(np.linspace(0, np.pi, height + 1)))[:, None]


def mean(radiance: np.ndarray) -> float:
    """The mean radiance of a probe over the sphere and the channels."""
    return float((radiance * solid_angles(*radiance.shape[:2])[..., None]).sum() / (12 * np.pi))


def lights(radiance: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions [count, 3] towards the light of a probe [h, w, 3], and the irradiance [count, 3] facing each.

    They are chosen in proportion to luminance, of which each holds the same share, and stratified (the golden ratio
    over the columns), the same ones at each call: a sum over them estimates an integral over the probe without bias.
    """
    height, width = radiance.shape[:2]
    luminance = radiance @ LUMINANCE
    power = luminance * solid_angles(height, width)
    across, down = ((np.arange(count) + 1) * 0.6180339887498949) % 1, (np.arange(count) + 0.5) / count
    row, v = _inverse(power.sum(1)[None], down)
    column, u = _inverse(power[row], across)
    cosines = np.cos(np.linspace(0, np.pi, height + 1))
    towards = direction((column + u) / width, cosines[row] + v * (cosines[row + 1] - cosines[row]))
    chosen = row, column
    return towards, radiance[chosen] / luminance[chosen][:, None] * (power.sum() / count)


def _inverse(weights: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each `at` in 0..1: which of its row of weights it falls into, and how far, 0..1."""
    cumulative = np.cumsum(weights, axis=1)
    cumulative = np.broadcast_to(cumulative / cumulative[:, -1:], (len(at), weights.shape[1]))
    index = (cumulative <= at[:, None]).sum(1)
    ends = np.take_along_axis(np.pad(cumulative, ((0, 0), (1, 0))), np.stack([index, index + 1], 1), 1)
    return index, (at - ends[:, 0]) / (ends[:, 1] - ends[:, 0])
