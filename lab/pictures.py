"""Linear values made visible: pictures, signed differences, histograms."""

from __future__ import annotations

import base64
import io
import math
from dataclasses import dataclass

import numpy as np

# Blue and orange differ in every common form of colour blindness, and both darken away from 0, so that the map also
# survives a grey printer. Black is no colour of the map: it means out of tolerance.
NEGATIVE, ZERO, POSITIVE = (13, 71, 140), (250, 250, 248), (184, 80, 0)
BEYOND = (0, 0, 0)
BACKGROUND = (205, 205, 200)  # pixels that do not show the object
BINS = 48


def srgb(linear: np.ndarray) -> np.ndarray:
    """Linear to sRGB-encoded values in [0, 1], clipped."""
    x = np.clip(np.nan_to_num(linear), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def rgb(values: np.ndarray) -> np.ndarray:
    """Values [..., k] as colours [..., 3]: one number is grey, two are red and green."""
    if values.shape[-1] == 1:
        return np.repeat(values, 3, axis=-1)
    return np.concatenate([values, np.zeros_like(values[..., : 3 - values.shape[-1]])], axis=-1)


class Window:
    """The part of a picture that shows the object, reduced by a whole factor where it would exceed `longest` pixels."""

    def __init__(self, mask: np.ndarray, longest: int):
        rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
        self._rows = slice(max(rows[0] - 2, 0), rows[-1] + 3)
        self._columns = slice(max(columns[0] - 2, 0), columns[-1] + 3)
        self.factor = math.ceil(max(mask[self._rows, self._columns].shape) / longest)
        self._inside = self._blocks(mask)
        self.mask = self._inside.any(2)

    def mean(self, image: np.ndarray) -> np.ndarray:
        """An image [h, w, k] in the window, averaged over the object's pixels in a block."""
        weights = self._inside[..., None]
        return (self._blocks(image) * weights).sum(2) / np.maximum(weights.sum(2), 1)

    def extreme(self, image: np.ndarray) -> np.ndarray:
        """An image [h, w] in the window, the value farthest from 0 of each block, so that no outlier is lost."""
        blocks = self._blocks(image)
        return np.take_along_axis(blocks, np.abs(blocks).argmax(2)[..., None], 2)[..., 0]

    def place(self, row: int, column: int) -> tuple[float, float]:
        """x, y in the window of a pixel's centre."""
        return (column + 0.5 - self._columns.start) / self.factor, (row + 0.5 - self._rows.start) / self.factor

    def runs(self, marked: np.ndarray) -> list[tuple[float, float, float, float]]:
        """x, y, width, height in the window of each horizontal run of marked pixels of an image [h, w]."""
        change = np.diff(np.pad(marked.astype(np.int8), ((0, 0), (1, 1))), axis=1)
        rows, starts = np.nonzero(change == 1)
        ends = np.nonzero(change == -1)[1]
        x, width = (starts - self._columns.start) / self.factor, (ends - starts) / self.factor
        y = (rows - self._rows.start) / self.factor
        return [(*place, 1 / self.factor) for place in zip(x.tolist(), y.tolist(), width.tolist())]

    def _blocks(self, image: np.ndarray) -> np.ndarray:
        """[h, w, ...] to [rows, columns, factor * factor, ...], the last blocks filled up with 0."""
        part, f = image[self._rows, self._columns], self.factor
        height, width = (-(-n // f) for n in part.shape[:2])
        padding = [(0, height * f - part.shape[0]), (0, width * f - part.shape[1])] + [(0, 0)] * (part.ndim - 2)
        blocks = np.pad(part, padding).reshape(height, f, width, f, *part.shape[2:])
        return np.swapaxes(blocks, 1, 2).reshape(height, width, f * f, *part.shape[2:])


def shown(linear: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Colours [h, w, 3] uint8 of linear values [h, w, k]: clipped, sRGB-encoded."""
    return _on_background(np.rint(srgb(rgb(linear)) * 255).astype(np.uint8), mask)


def diverging(signed: np.ndarray, mask: np.ndarray, limit: float, allowed: float) -> np.ndarray:
    """Colours [h, w, 3] uint8 of errors [h, w]: NEGATIVE at -limit to POSITIVE at limit, BEYOND over `allowed`."""
    x = np.clip(signed / limit, -1.0, 1.0)[..., None]
    colors = np.array(ZERO) * (1 - np.abs(x)) + np.where(x < 0, NEGATIVE, POSITIVE) * np.abs(x)
    colors = np.where(np.abs(signed)[..., None] > allowed, BEYOND, np.rint(colors)).astype(np.uint8)
    return _on_background(colors, mask)


def difference_limit(units: np.ndarray, allowed: float) -> float:
    """A scale on which the errors of a picture are seen: `allowed` halved while 99.5 % of the errors still fit."""
    typical = np.quantile(units[np.isfinite(units)], 0.995) if np.isfinite(units).any() else allowed
    halvings = math.floor(math.log2(allowed / typical)) if typical > 0 else 0
    return allowed * 0.5 ** min(max(halvings, 0), 6)


def data_uri(colors: np.ndarray) -> str:
    """Colours [h, w, 3] uint8 as a lossless WebP for the src of an <img>."""
    from PIL import Image

    memory = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(colors)).save(memory, "WebP", lossless=True, quality=60, method=4)
    return "data:image/webp;base64," + base64.b64encode(memory.getvalue()).decode()


def _on_background(colors: np.ndarray, mask: np.ndarray) -> np.ndarray:
    return np.where(mask[..., None], colors, np.array(BACKGROUND, np.uint8))


@dataclass(frozen=True)
class Histogram:
    """Counts of errors, ready to be drawn: all positions are fractions of the axes.

    bars         (left, width, height)
    x_ticks      (position, units); y_ticks (position, count); y is logarithmic, x only where errors go far beyond
                 the allowed one
    unbounded    how many errors are infinite, which no bar shows
    """

    bars: list[tuple[float, float, float]]
    x_ticks: list[tuple[float, float]]
    y_ticks: list[tuple[float, int]]
    allowed: float
    logarithmic: bool
    unbounded: int


def histogram(units: np.ndarray, allowed: float) -> Histogram:
    """The histogram of errors in units, up to the allowed one and a little, or to the largest one."""
    finite = units[np.isfinite(units)]
    largest = float(finite.max(initial=0.0))
    logarithmic = largest > 2 * allowed
    low, high = (allowed / 1000, largest * 1.2) if logarithmic else (0.0, max(allowed, largest) * 1.06)

    def position(x):
        return np.log(np.maximum(x, low) / low) / math.log(high / low) if logarithmic else np.asarray(x) / high

    counts, edges = np.histogram(position(finite), BINS, (0.0, 1.0))
    top = math.log10(max(counts.max(), 1)) + 0.5  # half a decade below 1, so that a single pixel is seen
    bars = [(float(edges[i]), 1 / BINS, (math.log10(n) + 0.5) / (top * 1.04)) for i, n in enumerate(counts) if n]
    decades = range(0, math.floor(top - 0.5) + 1, 1 if top < 4 else 2)
    y_ticks = [((d + 0.5) / (top * 1.04), 10**d) for d in decades]
    x_ticks = [(float(position(x)), x) for x in _ticks(allowed, low, high, logarithmic)]
    return Histogram(bars, x_ticks, y_ticks, float(position(allowed)), logarithmic, len(units.ravel()) - len(finite))


def _ticks(allowed: float, low: float, high: float, logarithmic: bool) -> list[float]:
    if not logarithmic:
        return [allowed * i / 4 for i in range(4)]  # the allowed error itself has its own mark
    first, last = math.ceil(math.log10(low)), math.floor(math.log10(high))
    return [10.0**e for e in range(first, last + 1, max(1, (last - first) // 4))]
