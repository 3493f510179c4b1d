"""Values worth starting from: metals and dielectrics from measured indices of refraction, Lafortune's fits of measured
materials, and layers. A preset sets only what it knows, and every value lies in the range that the header states."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass

import numpy as np

from ..lab.catalogue import Catalogue, Function
from ..lab.paths import DATA
from . import choices

FITS = DATA / "lafortune_fits.json"
DIELECTRICS = {"water": 1.333, "glass": 1.5, "sapphire": 1.77, "diamond": 2.417}  # n at 589 nm


@dataclass(frozen=True)
class Preset:
    """`remark` says where the numbers come from, and what of them did not fit the ranges."""

    group: str
    name: str
    values: dict[str, tuple[float, ...]]
    remark: str


def of(library: Catalogue, function: Function) -> list[Preset]:
    """All that suit a function."""
    return [p for p in _all(library, function) if admits(function, p.values)]


def beyond(library: Catalogue, function: Function) -> list[Preset]:
    """Those that would suit it, but leave the ranges of its header."""
    return [p for p in _all(library, function) if not admits(function, p.values)]


def _all(library: Catalogue, function: Function) -> list[Preset]:
    return [*_metals(library, function), *_dielectrics(function), *_measured(function), *_layers(function)]


def admits(function: Function, values: dict[str, tuple[float, ...]]) -> bool:
    return all((p := function.parameter(name)) and choices.inside(p, value) for name, value in values.items())


# --- indices of refraction --------------------------------------------------------------------------------------------


def _metal_constants(library: Catalogue) -> dict[str, dict[str, tuple]]:
    """Metal -> F0, ETA, K and where they come from, as glsl/metals.glsl has them."""
    metals: dict[str, dict] = {}
    for name, line in library.constants.items():
        found = re.fullmatch(r"const vec3 LOBE_(F0|ETA|K)_(\w+) = vec3\((.*)\);\s*// \w+ (?:to )?(.*)", line)
        if found:
            metal = metals.setdefault(found[2].lower(), {})
            metal[found[1]] = tuple(float(x) for x in found[3].split(","))
            metal["source"] = found[4]
    return metals


def _metals(library: Catalogue, function: Function) -> list[Preset]:
    presets = []
    for name, metal in _metal_constants(library).items():
        if f0 := function.parameter("f0"):
            values = {"f0": tuple(min(x, f0.high) for x in metal["F0"])}
            cut = "; red, outside sRGB, cut at 1 as whole lobes cut it" if max(metal["F0"]) > f0.high else ""
        elif function.parameter("eta") and function.parameter("k"):
            values, cut = _index(function, metal["ETA"], metal["K"])
        else:
            continue
        presets.append(Preset("metals", name, values, metal["source"] + cut))
    return presets


def _index(function: Function, eta, k) -> tuple[dict, str]:
    """n and k; where n lies below the range, its lowest value, with the k that keeps the colour along the normal."""
    low = function.parameter("eta").low
    raised = [(max(n, low), k if n >= low else _k_of(_normal(n, k), low)) for n, k in zip(eta, k)]
    changed = any(n < low for n in eta)
    values = {"eta": tuple(n for n, _ in raised), "k": tuple(k for _, k in raised)}
    return values, f"; n below {low:g} raised to it, k so that the colour along the normal stays" if changed else ""


def _normal(n: float, k: float) -> float:
    return ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)


def _k_of(reflectance: float, n: float) -> float:
    """The k with which an index n has a reflectance along the normal."""
    return float(np.sqrt((reflectance * (n + 1) ** 2 - (n - 1) ** 2) / (1 - reflectance)))


def _dielectrics(function: Function) -> list[Preset]:
    name = next((n for n in ("f0", "rs") if function.parameter(n) and function.parameter(n).kind == "color"), None)
    if name is None:
        return []
    return [Preset("dielectrics", material, {name: (_normal(n, 0.0),) * 3}, f"n = {n:g}")
            for material, n in DIELECTRICS.items()]


# --- fits -------------------------------------------------------------------------------------------------------------


def _measured(function: Function) -> list[Preset]:
    """Lafortune's: the model has as many lobes as the function has exponents."""
    count = sum(bool(re.fullmatch(r"exponent\d", p.name)) for p in function.parameters)
    if count == 0 or not FITS.exists():
        return []
    presets = []
    for material, fit in json.loads(FITS.read_text())["materials"].items():
        if len(fit["lobes"]) != count:
            continue
        values = {"diffuse": tuple(map(float, fit["diffuse_reflectance"]))}
        for i, lobe in enumerate(fit["lobes"], 1):
            values |= {f"{name}{i}": tuple(map(float, lobe[name])) for name in ("Cx", "Cy", "Cz", "exponent")}
        presets.append(Preset("measured", material.replace("_", " "), values, "fitted by S. Westin, Cornell"))
    return presets


# --- layers -----------------------------------------------------------------------------------------------------------

# By the names of the parameters that a layered model has. Each is an example, not a measurement.
_LAYERED = (
    ("gloss on a rough red ground", {"f0": (0.04,) * 3, "r": (0.002,), "f0b": (0.6, 0.08, 0.05), "rb": (0.7,)}),
    ("lacquered copper", {"f0": (0.04,) * 3, "r": (0.001,), "f0b": (0.93, 0.62, 0.52), "rb": (0.2,)}),
    ("blue plastic", {"rd": (0.05, 0.12, 0.5), "rs": (0.04,) * 3, "nu": (400.0,), "nv": (400.0,)}),
    ("brushed and varnished", {"rd": (0.3, 0.2, 0.1), "rs": (0.04,) * 3, "nu": (20.0,), "nv": (2000.0,)}),
)


def _layers(function: Function) -> list[Preset]:
    names = {p.name for p in function.parameters}
    return [Preset("layers", name, values, "an example, not measured")
            for name, values in _LAYERED if set(values) <= names]
