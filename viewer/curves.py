"""Curves of a function for the plots: which points of its domain, and what to make of its values there.

A curve is asked of the reference and of the shader alike: both get the same float32 numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from lobe import reference
from ..lab import compare, geometry, quadrature
from ..lab.catalogue import Function

Values = dict[str, tuple[float, ...]]  # of the parameters that are no geometry
Columns = dict[str, np.ndarray]  # parameter -> float32 [n, width]
Rule = Callable[..., tuple]  # frames and weights of an integral over lights: `lights` or `halves`
Evaluate = Callable[[Function, Columns], np.ndarray]  # values [n, k]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB
NARROWEST = 1e-6  # radians: the finest step of curves and integrals, below the width of any lobe in range
HORIZON = np.pi / 2 - 1e-5  # nearer, float32 may take a direction for one below it
UP, ALONG = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])  # N and T


@dataclass(frozen=True)
class Curve:
    """One curve: `reduce` makes of the function's values, [m, k], the curve's [n, k] at x [n]."""

    function: Function
    x: np.ndarray
    columns: Columns
    reduce: Callable[[np.ndarray], np.ndarray] = field(default=lambda values: values, repr=False)

    def of(self, evaluate: Evaluate) -> np.ndarray:
        return self.reduce(np.asarray(evaluate(self.function, self.columns), float))


def reference_values(function: Function, columns: Columns) -> np.ndarray:
    """The reference's values [n, k]."""
    return reference.evaluate(function.key, compare.rows(function, columns))


def columns(function: Function, values: Values, N, T, V, L) -> Columns:
    """A function's inputs at frames [n, 3] each, with equal parameters everywhere."""
    filled = {p.name: geometry.FORM[p.name](N, T, V, L) if p.is_geometry else values.get(p.name, p.default)
              for p in function.parameters}
    return {p.name: np.ascontiguousarray(np.broadcast_to(np.asarray(filled[p.name], np.float32), (len(L), p.width)))
            for p in function.parameters}


def luminance(values: np.ndarray) -> np.ndarray:
    """[..., 3] or [..., 1] -> [...]"""
    return values @ LUMINANCE if values.shape[-1] == 3 else values[..., 0]


def dense(centre: float, low: float, high: float, count: int, width: float = NARROWEST) -> np.ndarray:
    """Some 2 count rising numbers from low to high, half of them even, half crowding about the centre."""
    def side(end):
        span = np.arcsinh(abs(end - centre) / width)
        return centre + np.sign(end - centre) * width * np.sinh(np.linspace(0, span, max(count // 2, 2)))
    x = np.concatenate([np.linspace(low, high, count), side(low), side(high)])
    return np.unique(np.clip(x, low, high))


def in_plane(angle, azimuth: float = 0.0) -> np.ndarray:
    """Directions [n, 3] at signed angles from the normal, in the plane at an azimuth from T; radians."""
    angle = np.atleast_1d(np.asarray(angle, float))
    return np.stack([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)], -1)


def framed(V: np.ndarray, L: np.ndarray) -> tuple[np.ndarray, ...]:
    """N, T, V, L as arrays of one shape."""
    shape = np.broadcast_shapes(V.shape, L.shape)
    return tuple(np.broadcast_to(x, shape) for x in (UP, ALONG, V, L))


# --- whole lobes ------------------------------------------------------------------------------------------------------


def in_incidence_plane(function: Function, values: Values, incidence: float, azimuth: float = 0.0,
                       count: int = 240) -> Curve:
    """f over the signed angle of the view, for a light at `incidence` on the side of the negative angles; radians."""
    x = dense(incidence, -HORIZON, HORIZON, count)
    frames = framed(in_plane(x, azimuth), in_plane(-incidence, azimuth))
    return Curve(function, x, columns(function, values, *frames))


def over_hemisphere(function: Function, values: Values, incidence: float, azimuth: float = 0.0, rings: int = 48,
                    spokes: int = 96) -> Curve:
    """f at the directions of `grid`, row by row, for a light at `incidence` as in in_incidence_plane."""
    V = grid(incidence, azimuth, rings, spokes).reshape(-1, 3)
    inputs = columns(function, values, *framed(V, in_plane(-incidence, azimuth)))
    return Curve(function, np.arange(float(len(V))), inputs)


def grid(incidence: float, azimuth: float, rings: int, spokes: int) -> np.ndarray:
    """Directions [rings, spokes, 3] over the hemisphere, denser about the mirror of a light at `incidence`."""
    theta = _pieces(incidence, 0.0, HORIZON, rings, 0.02)
    phi = azimuth + _pieces(0.0, -np.pi, np.pi, spokes, 0.05)
    return quadrature.spherical(theta[:, None], phi[None, :]).reshape(rings, spokes, 3)


def _pieces(centre: float, low: float, high: float, count: int, width: float) -> np.ndarray:
    """Exactly `count` rising numbers from low to high, denser about the centre; a side that has no length has none."""
    share, least = round(count * (centre - low) / (high - low)), count // 4
    below = 0 if centre <= low else count - 1 if centre >= high else min(max(share, least), count - least)

    def side(end, n):
        span = np.arcsinh(abs(end - centre) / width)
        return centre + np.sign(end - centre) * width * np.sinh(np.linspace(0, span, n))
    upper = side(high, count - below)
    return np.concatenate([side(low, below + 1)[:0:-1], upper]) if below else upper


def albedo(function: Function, values: Values, angles: np.ndarray, azimuth: float = 0.0,
           rule: Rule | None = None) -> Curve:
    """Directional albedo over the angle of the view, radians: f times N.L, integrated over lights."""
    frames, weights = over_lights([function], angles, np.full(len(angles), azimuth), rule or lights)

    def integrate(f):
        return np.einsum("vl,vlk->vk", weights, f.reshape(*weights.shape, -1))
    return Curve(function, np.asarray(angles), columns(function, values, *frames), integrate)


def is_slow(functions: list[Function]) -> bool:
    """Whether the reference of one of them integrates, which takes a fraction of a millisecond a point."""
    return any(compare.is_quadrature(f) for f in functions)


def over_lights(functions: list[Function], angles: np.ndarray, azimuths: np.ndarray, rule: Rule, count: int = 48):
    """Frames [views * lights, 3] and weights [views, lights], with N.L, to integrate functions over lights by a rule.

    The views are at angles from N and azimuths from T. What slow functions integrate is smooth: they get fewer nodes.
    """
    sizes = {"count": count // 6, "width": 0.3} if is_slow(functions) else {"count": count}
    rules = [rule(min(max(view, 1e-4), HORIZON), azimuth, **sizes) for view, azimuth in zip(angles, azimuths)]
    return [np.concatenate(vectors) for vectors in zip(*(frame for frame, _ in rules))], np.stack([w for _, w in rules])


def lights(view: float, azimuth: float = 0.0, count: int = 48, width: float = 1e-4):
    """Frames and weights, with N.L, over the lights for one view: as quadrature.lights, for lobes as narrow as 1e-3."""
    from_mirror = [quadrature.graded(view, end, width, count) for end in (0, np.pi / 2)]
    theta, theta_weight = quadrature.joined(*from_mirror)
    pieces = [quadrature.graded(a, a + b, (width if a else 0.02) * np.cos(view), count if a else count // 2)
              for a in (np.pi, 0) for b in (-np.pi / 2, np.pi / 2)]
    phi, phi_weight = quadrature.joined(*pieces)
    weight = np.outer(theta_weight * np.sin(theta) * np.cos(theta), phi_weight).ravel()
    L = quadrature.spherical(theta[:, None], phi)
    return quadrature.framed(quadrature.spherical(view, 0.0), L, -azimuth), weight


def halves(view: float, azimuth: float = 0.0, count: int = 48, width: float = 1e-4):
    """As `lights`, with half vectors for nodes, which crowd about N and about the planes of T and B.

    For highlights that are many times wider along T than along B: no rule about the mirror direction follows their ridges.
    """
    theta, theta_weight = quadrature.graded(0.0, np.pi / 2, width, count)
    phi, phi_weight = quadrature.joined(*(quadrature.graded(a, a + b, 10 * width, count // 2)
                                          for a in np.arange(4) * np.pi / 2 for b in (-np.pi / 4, np.pi / 4)))
    V, H = quadrature.spherical(view, 0.0), quadrature.spherical(theta[:, None], phi - azimuth)
    VdotH = geometry.dot(V, H)
    L = 2 * VdotH * H - V
    weight = 4 * VdotH[:, 0] * L[:, 2] * np.outer(theta_weight * np.sin(theta), phi_weight).ravel()  # dL = 4 V.H dH
    seen = (VdotH[:, 0] > 0) & (L[:, 2] > np.pi / 2 - HORIZON)
    return quadrature.framed(V, np.where(seen[:, None], L, UP), -azimuth), np.where(seen, weight, 0.0)


# --- terms ------------------------------------------------------------------------------------------------------------


def term(function: Function, values: Values, incidence: float = 0.5, azimuth: float = 0.0, count: int = 181) -> Curve:
    """A term over its own angle, radians: of the facet from the normal for D, of the view for all others.

    Masking of two directions has its light at `incidence`, on the other side; a visibility V is multiplied by
    4 NdotV NdotL, so that it is a masking, too.
    """
    x = np.linspace(0.0, np.pi / 2, count)
    if letter(function) == "D":
        x = dense(0.0, 0.0, np.pi / 2, count)
        H = in_plane(x, azimuth)
        return Curve(function, x, columns(function, values, *framed(H, H)))
    if one_angle(function):
        V = in_plane(x, azimuth)
        return Curve(function, x, columns(function, values, *framed(V, V)))
    x = np.linspace(-HORIZON, HORIZON, 2 * count - 1)
    frames = framed(in_plane(x, azimuth), in_plane(-incidence, azimuth))
    inputs = columns(function, values, *frames)
    if not function.name.startswith("lobe_V_"):
        return Curve(function, x, inputs)
    shortening = 4 * geometry.dot(frames[0], frames[2]) * geometry.dot(frames[0], frames[3])
    return Curve(function, x, inputs, lambda v: v * shortening)


def one_angle(function: Function) -> bool:
    """Whether a term sees one direction alone."""
    return {p.name for p in function.parameters if p.is_geometry} <= {"cosI", "NdotX"}


def letter(function: Function) -> str:
    """F, D or G of a term, as the plots group them; "" for others."""
    part = function.name.split("_")[1]
    return {"F": "F", "T": "F", "D": "D", "Z": "D", "G": "G", "G1": "G", "G2": "G", "V": "G"}.get(part, "")
