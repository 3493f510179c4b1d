"""Singular sets: where formulas lose digits or divide by 0. Each belongs to kinds and names of parameters, not to a model,
so that a new function is tested there by being there.

A set tells how to move inputs to a distance from it, and how far given inputs are. Inputs are drawn at logarithmically
stratified distances from two or three sets at once: where one formula's weakness meets another's, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from . import domain, geometry
from .catalogue import Function, Parameter

Inputs = dict[str, np.ndarray]  # parameter name -> float64 [n, width]

NEAREST, NEAREST_HORIZON = domain.NEAREST, domain.NEAREST_HORIZON
SHARES = 0.25, 0.45, 0.3  # of the inputs that lie anywhere in the domain, near two sets at once, near three


@dataclass(frozen=True)
class Set:
    """One singular set of one function.

    name      such as 'NdotV -> 0'
    axis      the distance's name
    moves     the input that `move` changes: two sets at once must move two inputs
    order     sets are moved to in this order: shapes, then V, then what depends on these
    nearest, farthest   range of the distance
    move      changes inputs in place to distances [n]; takes a random generator
    distance  of inputs, [n]; NaN where it has no meaning
    """

    name: str
    axis: str
    moves: str
    order: int
    nearest: float
    farthest: float
    move: Callable[[np.random.Generator, Inputs, np.ndarray], None]
    distance: Callable[[Inputs], np.ndarray]

    def drawn(self, t: np.ndarray) -> np.ndarray:
        """Distances from the nearest, t = 0, to the farthest, t = 1, in equal ratios."""
        return self.nearest * (self.farthest / self.nearest) ** t


def sets(function: Function) -> list[Set]:
    """All singular sets of a function's parameters."""
    found = []
    for p in function.parameters:
        if p.kind not in ("direction", "half"):
            found += _of_scalar(p)
    return found + _of_components(function) + _of_interface(function) + _of_directions(function)


def sample(function: Function, count: int, seed: int) -> domain.Inputs:
    """`count` inputs, exact in float32 and inside of the domain: some anywhere, the rest near two or three sets at once."""
    inputs = {name: x.astype(float) for name, x in domain.sample(function, count, seed).items()}
    rng = np.random.default_rng(seed + 1)
    for group, (begin, end) in _shared(groups(function), count).items():
        part = {name: x[begin:end] for name, x in inputs.items()}
        for s in sorted(group, key=lambda s: s.order):
            s.move(rng, part, s.drawn((rng.permutation(end - begin) + rng.random(end - begin)) / (end - begin)))
        if {"V", "L", "H"} <= set(part):
            part["H"] = part["V"] + part["L"]
        for name, x in part.items():
            inputs[name][begin:end] = x
    return {name: domain.rounded(x, function.parameter(name)) for name, x in inputs.items()}


def groups(function: Function) -> tuple[list[tuple[Set, ...]], list[tuple[Set, ...]]]:
    """The pairs of sets, or the single ones where there are none, and the triples, that move as many inputs."""
    known = sets(function)
    pairs, triples = ([group for group in combinations(known, size) if len({s.moves for s in group}) == size]
                      for size in (2, 3))
    return pairs or [(s,) for s in known], triples


def _shared(found: tuple[list, list], count: int) -> dict[tuple[Set, ...], tuple[int, int]]:
    """The rows that each group gets, [begin, end), where it gets any."""
    rows, begin = {}, int(SHARES[0] * count)
    for members, share in zip(found, (SHARES[1] + (0 if found[1] else SHARES[2]), SHARES[2])):
        end = min(begin + int(share * count), count)
        bounds = np.linspace(begin, end, len(members) + 1).astype(int)
        rows |= {group: (a, b) for group, a, b in zip(members, bounds, bounds[1:]) if a < b}
        begin = end
    return rows


# --- numbers and colours ---------------------------------------------------------------------------------------------


def _of_scalar(p: Parameter) -> list[Set]:
    """The ends of a range, 0 and 1 within it, where factors such as eta - 1 change sign; of a scalar u, the
    quarters of a turn, or 1 where the range ends short of it."""
    found = []
    if p.low > 0 and p.high / p.low > 20:
        found.append(_end(p, f"{p.name} -> {p.low:g}", p.low, p.high, lambda d: d))
    elif p.low > 0:
        span = p.high - p.low
        found.append(_end(p, f"{p.name} -> {p.low:g}", NEAREST * span, span, lambda d: p.low + d))
    elif p.low == 0:
        least = _least(p)
        found.append(_end(p, f"{p.name} -> 0", least, p.high, lambda d: d))
    else:
        found.append(_end(p, f"{p.name} -> 0", NEAREST, p.high, lambda d: d, signed=True))
    if p.low < 1 < p.high:
        found.append(_end(p, f"{p.name} -> 1", NEAREST, min(1 - p.low, p.high - 1), lambda d: 1 + d, signed=True))
    elif p.high == 1 and p.low >= 0:
        found.append(_end(p, f"{p.name} -> 1", NEAREST, 1.0, lambda d: 1 - d))
    if p.name == "u" and p.width == 1:
        if p.high == 1:
            found += [_of_quarter(p, quarter) for quarter in (0.25, 0.5, 0.75)]
        else:
            found.append(_end(p, "u -> 1", 1 - p.high, 1.0, lambda d: 1 - d))
    return found


def _of_quarter(p: Parameter, quarter: float) -> Set:
    """A quarter of a turn, at which a sine or a cosine changes its sign."""
    return _end(p, f"{p.name} -> {quarter:g}", NEAREST, 0.25, lambda d: quarter + d, signed=True)


def _least(p: Parameter) -> float:
    return NEAREST_HORIZON if p.kind == "cosine" else NEAREST


def _end(p: Parameter, name: str, nearest: float, farthest: float, at: Callable, signed: bool = False) -> Set:
    """A set from `at`, the value at a distance."""
    origin = float(at(np.zeros(1))[0])

    def move(rng, x, d):
        side = rng.choice([-1.0, 1.0], len(d)) if signed else 1.0
        x[p.name] = np.repeat(at(side * d)[:, None], p.width, 1)

    def distance(x):
        return np.abs(x[p.name] - origin).max(1)

    axis = p.name if origin == 0 else f"|{p.name} - {origin:g}|" if signed or origin < 1 else f"{origin:g} - {p.name}"
    return Set(name, axis, p.name, 0, nearest, farthest, move, distance)


def _of_components(function: Function) -> list[Set]:
    """A direction told by its cosines with N, T and B, at the pole."""
    return [_pole(X) for X in "HVL" if {f"{axis}dot{X}" for axis in "NTB"} <= {p.name for p in function.parameters}]


def _pole(X: str) -> Set:
    def move(rng, x, d):
        phi = rng.uniform(0, 2 * np.pi, len(d))
        values = zip("NTB", (np.sqrt((1 - d) * (1 + d)), d * np.cos(phi), d * np.sin(phi)))
        x.update({f"{axis}dot{X}": value[:, None] for axis, value in values})

    def distance(x):
        return np.hypot(x[f"Tdot{X}"], x[f"Bdot{X}"])[:, 0]

    return Set(f"{X} -> N", f"sine between {X} and N", f"components of {X}", 1, NEAREST, 1.0, move, distance)


# --- interfaces ------------------------------------------------------------------------------------------------------


def _of_interface(function: Function) -> list[Set]:
    """Total internal reflection and Brewster's angle, where an index meets an angle of incidence; and where cosI^2 is as
    small as eta^2 - 1, which the critical angle is the other half of."""
    names = {p.name for p in function.parameters}
    eta = function.parameter("eta")
    if eta is None or not ({"cosI"} <= names or {"N", "V"} == names & {"N", "V", "L"}):
        return []
    found = [_at_angle("Brewster", lambda n: 1 / np.hypot(1, n), names)]
    if eta.low < 1:
        found.append(_at_angle("critical", lambda n: np.sqrt(np.maximum((1 - n) * (1 + n), 0)), names))
        found.append(_at_angle("matched", lambda n: np.sqrt(np.maximum((n - 1) * (n + 1), 0)), names))
    return found


def _at_angle(name: str, cosine_of: Callable, names: set[str]) -> Set:
    def move(rng, x, d):
        if name == "critical":
            x["eta"] = np.where(x["eta"] > 1, np.maximum(1 / x["eta"], 0.4), x["eta"])
        elif name == "matched":
            x["eta"] = np.clip(np.maximum(x["eta"], 1 / x["eta"]), 1 + 1e-6, 1.4)  # nearer to 1, all are undecided
        there = cosine_of(x["eta"][:, 0])
        side = np.where(there * (1 + d) > 1, -1.0, rng.choice([-1.0, 1.0], len(d)))
        cosine = np.clip(there * (1 + side * d), 0, 1)
        if "cosI" in names:
            x["cosI"] = cosine[:, None]
        else:
            x["V"] = _at_cosine(rng, x["N"], x["V"], cosine)

    def distance(x):
        cosine = x["cosI"] if "cosI" in names else geometry.dot(x["N"], x["V"])
        there = cosine_of(x["eta"][:, 0])
        return np.abs(np.divide(cosine[:, 0], there, out=np.full_like(there, np.nan), where=there > 0) - 1)

    return Set(f"{name} angle", f"|cosine / {name} cosine - 1|", "cosI" if "cosI" in names else "V", 2, NEAREST, 1.0,
               move, distance)


# --- directions ------------------------------------------------------------------------------------------------------


def _of_directions(function: Function) -> list[Set]:
    names = {p.name for p in function.parameters}
    found = []
    for X, order in (("V", 1), ("L", 3)):
        if {"N", X} <= names:
            found.append(_horizon(X, order))
            found.append(_towards(f"{X} -> N", f"sine between {X} and N", X, order, "N", 1.0))
    if {"V", "L"} <= names:
        found.append(_towards("L -> V", "sine between L and V", "L", 3, "V", 1.0))
        found.append(Set("L -> -V", "|V + L|", "L", 3, NEAREST, 1.0, _opposite,
                         lambda x: np.linalg.norm(x["V"] + x["L"], axis=1)))
    if {"N", "V", "L"} <= names:
        found.append(Set("H -> N", "sine between H and N", "L", 3, NEAREST, 1.0, _mirrored,
                         lambda x: _sine(x["N"], x["V"] + x["L"])))
        found.append(Set("azimuths at right angles", "|cosine of the azimuth between V and L|", "azimuth of L", 4, NEAREST, 1.0,
                         _at_right_angles, lambda x: np.abs(_cosine_of_azimuths(x))))
    elif {"N", "H"} <= names:
        found.append(_towards("H -> N", "sine between H and N", "H", 4, "N", 1.0))
        found.append(_horizon("H", 4))
    return found


def _side(rng: np.random.Generator, axis: np.ndarray, v: np.ndarray) -> np.ndarray:
    """The unit vector at right angles to a unit axis, towards v; a random one where v lies along the axis."""
    def across(towards):
        side = towards - axis * geometry.dot(axis, towards)
        return side, np.linalg.norm(side, axis=1, keepdims=True)

    (side, length), (other, other_length) = across(v), across(rng.normal(size=v.shape))
    return geometry.normalize(np.where(length < 1e-3, other / other_length, side / np.maximum(length, 1e-300)))


def _at_cosine(rng, N: np.ndarray, v: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    N = geometry.normalize(N)
    c = cosine[:, None]
    return N * c + _side(rng, N, v) * np.sqrt(np.maximum((1 - c) * (1 + c), 0))


def _horizon(X: str, order: int) -> Set:
    def move(rng, x, d):
        length = np.linalg.norm(x[X], axis=1, keepdims=True)
        x[X] = length * _at_cosine(rng, x["N"], x[X], d)

    def distance(x):
        return (np.abs(geometry.dot(x["N"], x[X])) / np.maximum(np.linalg.norm(x[X], axis=1, keepdims=True), 1e-30))[:, 0]

    return Set(f"Ndot{X} -> 0", f"Ndot{X}", X, order, NEAREST_HORIZON, 1.0, move, distance)


def _towards(name: str, axis: str, X: str, order: int, goal: str, farthest: float) -> Set:
    def move(rng, x, d):
        length = np.linalg.norm(x[X], axis=1, keepdims=True)
        x[X] = length * _at_cosine(rng, x[goal], x[X], np.sqrt((1 - d) * (1 + d)))

    return Set(name, axis, X, order, NEAREST, farthest, move, lambda x: _sine(x[goal], x[X]))


def _sine(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    product = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    sine = np.linalg.norm(np.cross(a, b), axis=1)
    return np.divide(sine, product, out=np.full_like(sine, np.nan), where=product > 0)


def _opposite(rng, x, d):
    """L such that |V + L| is d, in any azimuth."""
    V, angle = geometry.normalize(x["V"]), 2 * np.arcsin(d / 2)[:, None]
    x["L"] = _side(rng, V, rng.normal(size=V.shape)) * np.sin(angle) - V * np.cos(angle)


def _mirrored(rng, x, d):
    """L such that the half vector stands off N by a sine d, in any azimuth."""
    H = _at_cosine(rng, x["N"], rng.normal(size=x["N"].shape), np.sqrt((1 - d) * (1 + d)))
    x["V"] = geometry.normalize(x["V"])  # in double: near grazing, unequal lengths would turn V + L
    x["L"] = 2 * H * geometry.dot(H, x["V"]) - x["V"]


def _along(N: np.ndarray, v: np.ndarray) -> np.ndarray:
    """The part of v along the surface."""
    return v - N * geometry.dot(N, v)


def _cosine_of_azimuths(x: Inputs) -> np.ndarray:
    v, l = (_along(x["N"], x[X]) for X in "VL")
    product = np.linalg.norm(v, axis=1) * np.linalg.norm(l, axis=1)
    return np.divide(np.sum(v * l, 1), product, out=np.full_like(product, np.nan), where=product > 0)


def _at_right_angles(rng, x, d):
    """L turned about N until the cosine of the azimuth between V and L is d, of either sign."""
    N = geometry.normalize(x["N"])
    length = np.linalg.norm(_along(N, x["L"]), axis=1, keepdims=True)
    side = _side(rng, N, x["V"])
    c = (d * rng.choice([-1.0, 1.0], len(d)))[:, None]
    turned = side * c + np.cross(N, side) * np.sqrt((1 - c) * (1 + c))
    x["L"] = geometry.normalize(N * geometry.dot(N, x["L"]) + turned * length)
