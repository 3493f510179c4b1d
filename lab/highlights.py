"""Where an anisotropic highlight points: its length along the tangent and across, measured, and said in words.

The light and the eye are one point above a plane, so that V = L = H, and f over the plane is the highlight itself. What
lies above half of its maximum has a long axis and a short one. Grooves scatter light across themselves: they run along
the short axis. Nobody has to believe that: `grooves` is a plane with grooves, cylinders of a narrow isotropic lobe.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import geometry
from .catalogue import Function

REACH, GRID = 1.2, 241  # the plane's half width over the height of the eye; points along its side
ROUND = 1.1  # a ratio of lengths below which a highlight has no direction
TILT, SMOOTH = 0.35, 0.12  # of the grooves: the rms slope of their sides, and the width of the lobe on them


@dataclass(frozen=True)
class Elongation:
    """A highlight: how many times as long as wide it is, and the angle between its long axis and T, in degrees 0..90."""

    ratio: float
    angle: float

    @property
    def axis(self) -> str:
        """The long axis: T, B, or nothing where there is none."""
        return "" if self.ratio < ROUND else "T" if self.angle < 45 else "B"

    @property
    def facts(self) -> dict:
        return {"ratio": float(f"{self.ratio:.3g}"), "axis": self.axis}

    @property
    def grooves(self) -> str:
        """What the tangent is to the grooves."""
        return {"T": "the tangent lies across the grooves", "B": "the tangent lies along the grooves",
                "": "it shows no grooves"}[self.axis]


def is_anisotropic(function: Function) -> bool:
    return function.kind == "lobe" and function.parameter("T") is not None


def plane(grid: int = GRID) -> np.ndarray:
    """Directions [grid, grid, 3] from the points of the plane to the eye, in T, B, N; rows run along -B, columns along T."""
    x = np.linspace(-REACH, REACH, grid)
    towards = np.stack(np.broadcast_arrays(-x[None, :], x[:, None], 1.0), -1)
    return geometry.normalize(towards)


def picture(function: Function, values: dict, shade) -> np.ndarray:
    """f over the plane, the mean of the channels, [GRID, GRID]."""
    V = plane().reshape(1, -1, 3)
    return shade(function, values, (0, 0, 1), (1, 0, 0), V, V).mean(-1).reshape(GRID, GRID)


def grooves(grid: int = 81) -> np.ndarray:
    """The same of grooves along B: a narrow isotropic lobe on normals that lean along T alone, by slopes of a Gaussian."""
    from . import plots

    slope = TILT * np.linspace(-4, 4, 129)
    area = np.exp(-(slope / TILT) ** 2 / 2)
    V = plane(grid)[:, :, None]
    N = geometry.normalize(np.stack([-slope, 0 * slope, 1 + 0 * slope], -1))
    f = plots.evaluated("lobe_GGX(vec3,vec3,vec3,vec3,float)", N, V, V, (1, 1, 1), SMOOTH)[..., 0]
    # A side's area is 1 / N.z of what it covers; it receives light and is seen by its own cosine, not by the plane's.
    cosines = np.maximum(geometry.dot(N, V)[..., 0], 0) / V[..., 2]
    return (f * cosines**2) @ (area / area.sum() / N[:, 2])


def elongation(image: np.ndarray) -> Elongation:
    """Of what lies above half of a picture's maximum."""
    row, column = np.nonzero(image >= image.max() / 2)
    spread = np.cov(np.stack([column, -row]))
    lengths, axes = np.linalg.eigh(spread)
    angle = np.degrees(np.arctan2(abs(axes[1, 1]), abs(axes[0, 1])))
    return Elongation(float(np.sqrt(lengths[1] / lengths[0])), float(angle))


def measured(function: Function, values: dict, shade) -> Elongation | None:
    """The elongation of an anisotropic lobe's highlight; None of another."""
    return elongation(picture(function, values, shade)) if is_anisotropic(function) else None


WIDTHS = ("alphaX", "alphaY", "nu", "nv", "p", "pb", "Cx", "Cy", "Cx1", "Cy1")  # which parameters make the direction


def sentence(function: Function, values: dict, found: Elongation) -> str:
    """The direction in words."""
    given = ", ".join(f"{n} = {values[n][0]:g}" for n in WIDTHS if n in values)
    along = {"T": "along T as across it", "B": "across T as along it", "": "in one direction as in the other"}[found.axis]
    return f"With {given} the highlight is {found.ratio:.2g} times as long {along}: {found.grooves}."
