"""What the gallery shows: every lobe, its place in the history of models, and how it is set and plotted.

Everything is drawn by the shaders themselves; gallery_draw.py makes the pictures, gallery_page.py the pages.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from . import bundle, geometry, gl, highlights, metals
from .catalogue import Catalogue, Function

ANGLES = (0, 30, 60, 80)  # of incidence, degrees
SWEEP = (np.arange(1440) + 0.5) / 8 - 90  # directions of L in the plane of incidence, degrees; V is on the negative side
STEEP = 85  # degrees of L, beyond which some lobes grow without bound, and no peak is looked for
CHANNEL = 1  # of a colour, which the polar plots show

GROUPS = {"Diffuse": ("lambert", "oren_nayar"),
          "Powers of a cosine": ("blinn_phong", "lafortune", "ashikhmin_shirley"),
          "Gaussian and rational highlights": ("ward", "schlick"),
          "Microfacets": ("gaussian", "beckmann", "ggx"),
          "Sums and corrections": ("blend", "energy")}
"""Files of glsl/ that the history draws in one lane. A file that is not named makes a lane of its own."""

GOLD, CLAY, BLUE, BLACK, COPPER = (1.0, 0.78, 0.34), (0.62, 0.36, 0.26), (0.03, 0.16, 0.42), (0.04,) * 3, (0.95, 0.64, 0.54)
LOOK = {"f0": GOLD, "rs": GOLD, "f0b": COPPER, "albedo": CLAY, "rd": BLUE, "diffuse": BLUE, "alphaX": (0.4,),
        "alphaY": (0.1,), "nu": (12.0,), "nv": (200.0,), "p": (0.25,), "pb": (0.25,)}
"""What a parameter is in the pictures, where the header's default shows too little; eta and k are gold's."""
_GLOSS = {f"C{axis}1": (c,) * 3 for axis, c in zip("xyz", (-0.1, -0.95, 0.97))} | {"exponent1": (30.0,) * 3}
_RETRO = {f"C{axis}2": (c,) * 3 for axis, c in zip("xyz", (0.7, 0.7, 0.7))} | {"exponent2": (6.0,) * 3}
_RIM = {f"C{axis}3": (c,) * 3 for axis, c in zip("xyz", (-1.05, -1.05, 0.2))} | {"exponent3": (8.0,) * 3}
OWN = {"lobe_AshikhminShirley": {"rs": BLACK}, "lobe_AshikhminShirley_diffuse": {"rs": BLACK},
       "lobe_Schlick_double": {"f0": BLACK, "rb": (0.1,)}, "lobe_Lafortune": {k.removesuffix("1"): v for k, v in _GLOSS.items()},
       "lobe_GGX_blend3": {"alphas": (0.12, 0.3, 0.7)}, "lobe_CookTorrance_blend3": {"alphas": (0.12, 0.3, 0.7)},
       "lobe_Lafortune2": _GLOSS | _RETRO, "lobe_Lafortune3": _GLOSS | _RETRO | _RIM}
"""The same for single lobes: a dark coat over a colour; a gloss, a glow towards the light, a shine at grazing."""


def lobes(library: Catalogue, names: list[str] = ()) -> tuple[Function, ...]:
    """The lobes among some functions or files, all where none is named, in the order of the history."""
    from .commands import selected

    found = [f for f in selected(library, list(names)) if f.takes_vectors]
    lanes = list(GROUPS)
    return tuple(sorted(found, key=lambda f: (lanes.index(g) if (g := group(f)) in lanes else len(lanes), g, year(f),
                                              f.stem, f.line)))


def group(function: Function) -> str:
    """The lane of the history."""
    return next((title for title, stems in GROUPS.items() if function.stem in stems), function.stem)


def year(function: Function) -> int:
    """Of the first publication that the header's `source` names."""
    found = re.search(r"\b(1[789]\d\d|20\d\d)\b", function.source)
    return int(found[1]) if found else 0


@cache
def look(function: Function) -> dict[str, tuple[float, ...]]:
    """The values of the parameters that are no geometry."""
    gold = metals.fitted(next(m for m in metals.METALS if m.name == "gold"))
    values = LOOK | {"eta": tuple(gold.eta), "k": tuple(gold.k)} | OWN.get(function.name, {})
    return {p.name: tuple(float(np.float32(x)) for x in values.get(p.name, p.default))
            for p in function.parameters if not p.is_geometry}


def models(functions: tuple[Function, ...]) -> list[list[Function]]:
    """Lobes of one group, year and first name: the variants of one model, the plainest first."""
    alike: dict[tuple, list[Function]] = {}
    for f in functions:
        alike.setdefault((group(f), year(f), re.sub(r"(_.*|\d+)$", "", f.name.removeprefix("lobe_"))), []).append(f)
    return [sorted(variants, key=lambda f: len(f.name)) for variants in alike.values()]


def authors(function: Function) -> str:
    """Of the first publication that the header's `source` names."""
    names = function.source.partition(str(year(function)))[0].strip(" ,").split(", ")
    return names[0] if len(names) == 1 else " and ".join(names) if len(names) == 2 else f"{names[0]} et al."


class Shades:
    """Lobes, as the shaders compute them on an OpenGL context."""

    def __init__(self, library: Catalogue, context: gl.Context):
        self.library, self.context = library, context

    def __call__(self, function: Function, values: dict, N, T, V, L, weights=None) -> np.ndarray:
        """f in double, [n, 3], for vectors that broadcast to [lights, n, 3], weighted and summed over the lights."""
        frame = np.broadcast_arrays(*(np.asarray(v, float) for v in (N, T, V, L)))
        inputs = {p.name: np.broadcast_to(np.asarray(geometry.FORM[p.name](*frame) if p.is_geometry else values[p.name],
                                                     np.float32), (*frame[0].shape[:2], p.width))
                  for p in function.parameters}
        weights = None if weights is None else weights.astype(np.float32)
        with self.context:
            return gl.evaluate(self.context, bundle.bundle(self.library, [function.key]), function.call,
                               function.result, inputs, weights).astype(float)


def curves(function: Function, shade: Shades) -> np.ndarray:
    """One channel of f over SWEEP for each of ANGLES, [angles, directions]. T lies in the plane of incidence."""
    V, L = (np.stack([np.sin(a), 0 * a, np.cos(a)], -1) for a in (-np.radians(ANGLES), np.radians(SWEEP)))
    V, L = np.broadcast_arrays(V[:, None], L[None])
    f = shade(function, look(function), (0, 0, 1), (1, 0, 0), V.reshape(1, -1, 3), L.reshape(1, -1, 3))
    return f[:, CHANNEL].reshape(len(ANGLES), len(SWEEP))


def peaks(curves: np.ndarray) -> np.ndarray:
    """The largest f of each curve that is not at grazing."""
    return curves[:, np.abs(SWEEP) <= STEEP].max(1)


@dataclass(frozen=True)
class Exhibit:
    """A lobe, with all that the gallery shows and says of it."""

    function: Function
    curves: np.ndarray
    elongation: highlights.Elongation | None  # of an anisotropic lobe

    @property
    def facts(self) -> dict:
        """What benchmarks/results/gallery.json holds."""
        found = {f"{angle}": float(f"{peak:.4g}") for angle, peak in zip(ANGLES, peaks(self.curves))}
        return {"year": year(self.function), "settings": self.settings, "peaks": found} | (
            {"elongation": self.elongation.facts} if self.elongation else {})

    @property
    def settings(self) -> str:
        """The parameters in words."""
        def number(v):
            return f"{v[0]:g}" if len(set(v)) == 1 else f"({', '.join(f'{x:.3g}' for x in v)})"
        return ", ".join(f"{name} = {number(v)}" for name, v in look(self.function).items())


def exhibits(library: Catalogue, functions: tuple[Function, ...], shade: Shades,
             on_step: Callable[[str, int, int], None] = lambda name, done, of: None) -> list[Exhibit]:
    shown = []
    for done, f in enumerate(functions):
        on_step(f.name, done, len(functions))
        shown.append(Exhibit(f, curves(f, shade), highlights.measured(f, look(f), shade)))
    return shown
