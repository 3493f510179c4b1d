"""Samples of a reflectance, to fit models to: read from a table, or taken of a lobe."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lobe import reference

from . import compare, files, quadrature
from .catalogue import Function
from .errors import InputError

ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
CHANNELS = {"value": ("value",), "value_r": ("value_r", "value_g", "value_b")}
HEADER = ",".join(ANGLES) + " in degrees, then value, or value_r,value_g,value_b, in 1/sr"
VIEWS, TILTS, TURNS = 10, 12, 8
LARGEST = 1e9  # of values and weights in a table: beyond is no reflectance


@dataclass(frozen=True)
class Samples:
    """Reflectances between pairs of directions.

    name    where they come from
    V, L    [n, 3] along T, B, N, above the horizon
    f       [n, 1] or [n, 3], in 1/sr
    weight  [n]: the solid angles that the sample stands for, that of V times that of L
    """

    name: str
    V: np.ndarray
    L: np.ndarray
    f: np.ndarray
    weight: np.ndarray

    @property
    def metric(self) -> np.ndarray:
        """[n]: errors of f times this, squared and summed, are what a fit minimises: the integral of
        (NdotV NdotL error)^2, which as f does not tell V from L, and is not ruled by grazing, where f grows like
        1 / (NdotV NdotL)."""
        return np.sqrt(self.weight) * self.V[:, 2] * self.L[:, 2]


def directions(anisotropic: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """V, L, weight that stand for all pairs of directions.

    Views are Gaussian nodes over projected solid angle, from 7 to 83 degrees; lights grow denser about the mirror
    direction. Without anisotropy all views have one azimuth, and one side of the plane of incidence stands for both;
    else they have four in a quarter of the circle.
    """
    x, w = np.polynomial.legendre.leggauss(VIEWS)  # of sin^2, for which the projected solid angle is even
    azimuths = (np.arange(4) + 0.5) * np.pi / 8 if anisotropic else np.zeros(1)
    parts = []
    for view, view_weight in zip(np.arcsin(np.sqrt((x + 1) / 2)), np.pi * w / 2):
        (_, _, V, L), weight = quadrature.lights(view, TILTS, TURNS)
        if not anisotropic:
            one = L[:, 1] > 0
            V, L, weight = V[one], L[one], 2 * weight[one]
        for a in azimuths:
            turn = np.array([[np.cos(a), np.sin(a), 0.0], [-np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
            parts.append((V @ turn, L @ turn, view_weight / len(azimuths) * weight / (V[:, 2] * L[:, 2])))
    return tuple(np.concatenate(arrays) for arrays in zip(*parts))


def of(name: str, evaluate: Callable[[np.ndarray, np.ndarray], np.ndarray], anisotropic: bool = False) -> Samples:
    """Samples of evaluate(V, L), which gives f [n, channels]."""
    V, L, weight = directions(anisotropic)
    return Samples(name, V, L, evaluate(V, L), weight)


def of_function(function: Function, settings: dict[str, tuple[float, ...]]) -> tuple[Samples, bool]:
    """Samples of a lobe of the library, by its reference, and whether it is anisotropic."""
    def evaluate(V, L, azimuth=0.0):
        N, T, _, _ = quadrature.framed(V, L, azimuth)
        known = {"N": N, "T": T, "V": V, "L": L} | {
            p.name: np.broadcast_to(settings.get(p.name, p.default), (len(V), p.width))
            for p in function.parameters if not p.is_geometry}
        return reference.evaluate(function.key, compare.rows(function, known))

    isotropic = of(function.name, evaluate)
    turned = evaluate(isotropic.V, isotropic.L, 1.0)
    if np.allclose(turned, isotropic.f, rtol=1e-6, atol=1e-9):
        return isotropic, False
    return of(function.name, evaluate, anisotropic=True), True


def spherical(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Unit vectors [n, 3] from degrees."""
    return quadrature.spherical(np.radians(theta), np.radians(phi))


def read(path: Path) -> Samples:
    """Samples of a CSV table with the columns of HEADER, in any order; theta_i and phi_i of the light, theta_o and
    phi_o of the view; theta from the normal, phi from T towards B. A column `weight` tells the solid angle that each
    row stands for, 1 where there is none; other columns are ignored. InputError names the line at fault."""
    text = files.read_bytes(path).decode("utf-8-sig", errors="replace")
    try:
        reader = csv.DictReader(text.splitlines(), skipinitialspace=True)
        reader.fieldnames = [name.strip() for name in reader.fieldnames or ()]
        columns = _columns(path, reader.fieldnames)
        rows = [_numbers(row, columns, f"{path}: line {reader.line_num}") for row in reader]
    except csv.Error as error:
        raise InputError(f"{path}: is not a CSV table ({error}); expected the columns {HEADER}") from None
    if len(rows) < 2:
        raise InputError(f"{path}: {len(rows)} row{'s' * (len(rows) != 1)} of samples, expected many; add measurements")
    table = np.array(rows)
    light, view = spherical(table[:, 0], table[:, 1]), spherical(table[:, 2], table[:, 3])
    return Samples(str(path), view, light, table[:, 4:-1], table[:, -1])


def looks_like_radians(given: Samples) -> bool:
    return bool(min(given.V[:, 2].min(), given.L[:, 2].min()) > np.cos(np.radians(2)))


def _columns(path: Path, names: list[str]) -> tuple[str, ...]:
    values = CHANNELS["value" if "value" in names else "value_r"]
    if missing := [name for name in (*ANGLES, *values) if name not in names]:
        raise InputError(f"{path}: line 1: no column {', '.join(missing)}; expected the columns {HEADER}")
    return (*ANGLES, *values)


def _numbers(row: dict, columns: tuple[str, ...], where: str) -> list[float]:
    """The numbers of a row, its weight last."""
    cells = [row[name] for name in columns] + [row.get("weight", "1")]
    try:
        numbers = [float(cell) for cell in cells]
    except (TypeError, ValueError):
        raise InputError(f"{where}: {','.join(cell or '' for cell in cells)[:80]!r}, expected numbers in the columns "
                         f"{', '.join(columns)}") from None
    if not np.isfinite(numbers).all():
        raise InputError(f"{where}: a number is not finite; remove the row or measure it again")
    for name, theta in zip(columns[::2], numbers[:4:2]):
        if not 0 <= theta < 90:
            raise InputError(f"{where}: {name} is {theta:g}: not above the horizon, expected 0 <= {name} < 90 degrees; "
                             "remove the row")
    if max(numbers[4:]) > LARGEST:
        raise InputError(f"{where}: {max(numbers[4:]):g}, expected values and weights up to {LARGEST:g}; check the "
                         "unit")
    if min(numbers[4:]) < 0:
        raise InputError(f"{where}: a value or weight is negative, expected 0 or more; remove the row, or subtract the "
                         "dark signal again")
    return numbers
