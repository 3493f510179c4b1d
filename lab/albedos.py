"""Who gains energy, and who is not reciprocal, and by how much: the albedo of each lobe over the view and its shape.

    python -m lobe.lab.albedos

measures by quadrature of the reference, in double, and writes benchmarks/results/albedo.json and docs/energy.md.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lobe import reference

from . import catalogue, compare, files, geometry, physics, plots, quadrature
from .catalogue import Catalogue, Function
from .paths import ROOT

PAGE = ROOT / "docs" / "energy.md"
FIGURE = ROOT / "docs" / "figures" / "energy.svg"
RESULTS = ROOT / "benchmarks" / "results" / "albedo.json"
COMMAND = "python -m lobe.lab.albedos"
VIEWS = (0, 30, 60, 75, 80, 85, 89, 89.9)  # degrees
MAIN = (("alpha",), ("alphaX", "alphaY"), ("sigma",), ("roughness",), ("nu", "nv"), ("r", "rb"), ("exponent",),
        ("exponent1", "exponent2", "exponent3"), ("weight",), ("weights",))
"""The main shape parameters, the first that a lobe has; those of one group are equal."""
TRADED = {"rd": "rs", "f0b": "f0"}  # what is only seen where the other colour leaves light: there the other is also dark
DARK, STEPS = 0.04, 6
LEVEL = 80  # degrees from the normal, within which a gain or a lack of reciprocity is no matter of grazing alone
ERROR = physics.ALBEDO_ERROR
Settings = dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class Rated:
    """A lobe's albedo [settings, views], and the largest ratio of f(V, L) to f(L, V)."""

    function: Function
    settings: list[Settings]
    albedo: np.ndarray
    ratio: float

    def largest(self, within: float = 90.0) -> tuple[float, Settings, float]:
        """The largest albedo for views within degrees of the normal, with its settings and view."""
        part = self.albedo[:, np.array(VIEWS) <= within]
        i, j = np.unravel_index(int(part.argmax()), part.shape)
        return float(part[i, j]), self.settings[i], VIEWS[j]


# What is set

def main_shape(function: Function) -> tuple[str, ...]:
    """The parameters that the table varies together; none where a lobe has no shape."""
    return next((tuple(n for n in names if function.parameter(n)) for names in MAIN if function.parameter(names[0])), ())


def grid(function: Function) -> list[Settings]:
    """White, the main shape over its range in STEPS, all else at the header's default; the place that the header names;
    and where a colour takes light from another, both white and dark."""
    plain = {p.name: (1.0,) * p.width if p.name in physics.WHITE else p.default
             for p in function.parameters if not p.is_geometry}
    if function.stem == "lafortune":  # a user's sum of a diffuse part and lobes is his own: here are the lobes alone
        plain["diffuse"] = (0.0,) * 3
    shape = main_shape(function)
    rows = [plain | {n: spread(function, n, x) for n in shape} for x in _axis(function, shape)] if shape else [plain]
    if hints := re.findall(r"(\w+) = (\d+\.?\d*)", function.energy):
        rows.append(plain | {name: (float(value),) * function.parameter(name).width for name, value in hints})
    if dimmed := next((other for name, other in TRADED.items() if name in plain), None):
        rows += [row | {dimmed: (DARK,) * 3} for row in rows]
    return rows


def spread(function: Function, name: str, value: float) -> tuple[float, ...]:
    return (value, *(1.0 - value,) * 2)[:3] if name == "weights" else (value,) * function.parameter(name).width


def _axis(function: Function, shape: tuple[str, ...]) -> list[float]:
    stated = [function.parameter(n) for n in shape]
    low, high = max(p.low for p in stated), min(p.high for p in stated)
    low, high = np.clip((low, high), *physics.RESOLVED.get(shape[0], (-1e9, 1e9)))
    steps = np.geomspace if low > 0 and high / low > 5 else np.linspace
    return [float(f"{x:.2g}") for x in steps(low, high, STEPS)]


# What is measured

def albedo(function: Function, settings: Settings, view: float) -> float:
    """The share of light that comes back, the largest channel, by the double-precision reference."""
    frame, weights = quadrature.lights(np.radians(view))
    return float((weights @ values(function, settings, *frame)).max())


def values(function: Function, settings: Settings, N, T, V, L) -> np.ndarray:
    """The reference's f [n, 3] at frames of vectors [n, 3]."""
    columns = [geometry.FORM[p.name](N, T, V, L) if p.is_geometry else np.broadcast_to(settings[p.name], (len(L), p.width))
               for p in function.parameters]
    return reference.evaluate(function.key, np.concatenate(columns, axis=1, dtype=float))


def asymmetry(function: Function, settings: Settings, count: int = 1 << 12) -> float:
    """The largest ratio of f(V, L) to f(L, V), for directions within LEVEL of the normal; 1 where it is reciprocal."""
    rng = np.random.default_rng(physics.SEED)
    V, L = (quadrature.spherical(np.arccos(rng.uniform(np.cos(np.radians(LEVEL)), 1, count)),
                                 rng.uniform(0, 2 * np.pi, count)) for _ in range(2))
    N, T = (np.broadcast_to(x, V.shape) for x in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))
    both = np.sort([values(function, settings, N, T, *pair)[:, 0] for pair in ((V, L), (L, V))], axis=0)
    lit = both[0] > 1e-12 * both[1].max()
    return float((both[1, lit] / both[0, lit]).max(initial=1.0))


def rated(function: Function) -> Rated:
    settings = grid(function)
    table = [[albedo(function, s, view) for view in VIEWS] for s in settings]
    return Rated(function, settings, np.array(table), asymmetry(function, settings[0]))


def lobes(library: Catalogue) -> list[Function]:
    """All but lobe_GGX_multiple, whose reference is a quadrature of albedos: what it adds up to is tested as an identity."""
    return [f for f in library.functions if f.takes_vectors and not compare.is_quadrature(f)]


def fits() -> dict[str, list[float]]:
    """Albedo over VIEWS of the published fits of measured materials, the largest channel."""
    from . import fit_page, lafortune

    return {name: [digits(lafortune.albedo(fit_page.colour(fit), np.radians(view)).max()) for view in VIEWS]
            for name, fit in fit_page.published().items()}


def areas(library: Catalogue) -> dict[str, dict]:
    """The projected area of the distributions that their headers do not call normalised, over their width."""
    found = {}
    for f in (f for f in library.functions if f.normalised.startswith("no") and f.parameter("N")):
        frame, weights = quadrature.facets(256)
        widths = [0.1, 0.2, 0.5, 1.0]
        found[f.key] = {f"{a:g}": digits(weights @ values(f, {"alpha": (a,)}, *frame)[:, 0]) for a in widths}
    return found


def measured(library: Catalogue, step: Callable[[str, int, int], None] = lambda name, done, of: None) -> dict:
    """What benchmarks/results/albedo.json holds."""
    found, functions = {}, lobes(library)
    for done, f in enumerate(functions):
        step(f.name, done, len(functions))
        r = rated(f)
        within, anywhere = r.largest(LEVEL), r.largest()
        found[f.name] = {
            "shape": main_shape(f), "ratio": digits(r.ratio),
            "rows": [{"settings": told(f, s), "albedo": [digits(x) for x in row]} for s, row in zip(r.settings, r.albedo)],
            **{name: {"albedo": digits(value), "settings": told(f, s), "view": view}
               for name, (value, s, view) in (("within", within), ("largest", anywhere))}}
    return {"views": VIEWS, "level": LEVEL, "lobes": found, "areas": areas(library), "fits": fits()}


# What is said

def gains(row: dict) -> bool:
    return row["largest"]["albedo"] > 1 + ERROR


def markdown(found: dict) -> str:
    """docs/energy.md, from benchmarks/results/albedo.json and the headers."""
    from .report import environment

    library = catalogue.load()
    stated = {name: library.find(name)[0] for name in found["lobes"]}
    gaining = sorted((n for n, row in found["lobes"].items() if gains(row)),
                     key=lambda n: -found["lobes"][n]["within"]["albedo"])
    return environment().overlay(autoescape=False).get_template("energy.md.j2").render(
        found=found, lobes=found["lobes"], stated=stated, gaining=gaining, command=COMMAND, dark=DARK,
        lopsided=[n for n in stated if found["lobes"][n]["ratio"] > 1 + 1e-9])


def draw(figure, found: dict) -> None:
    """Albedo over the view of every lobe, one curve for each value of its main shape."""
    from matplotlib import colormaps

    panels = list(figure.subplots(-(-len(found["lobes"]) // 6), 6, squeeze=False, sharex=True, sharey=True).flat)
    for axes in panels[len(found["lobes"]):]:
        axes.axis("off")
    for axes, (name, row) in zip(panels, found["lobes"].items()):
        shown = row["rows"][:STEPS] if row["shape"] else row["rows"]
        for i, entry in enumerate(shown):
            axes.plot(found["views"], entry["albedo"], color=colormaps["viridis"](i / STEPS), linewidth=1.1, clip_on=True)
        axes.axhline(1, color=plots.ORANGE, linewidth=0.8)
        plots.style(axes, ylim=(0, 1.6), xlim=(0, 90), xticks=(0, 30, 60, 90))
        axes.set_title(name.removeprefix("lobe_"), fontsize=7, loc="left")
        axes.tick_params(labelsize=6)
    figure.supxlabel("angle of the view [degrees]", fontsize=8)
    figure.supylabel("albedo", fontsize=8)


SIZE = (11, 9)  # inches, of the figure


def main() -> None:
    from .progress import progress

    with progress() as step:
        files.write_json(RESULTS, measured(catalogue.load(), step))
    found = json.loads(RESULTS.read_text())
    plots.write_svg(FIGURE, lambda figure: draw(figure, found), SIZE)
    files.write_text(PAGE, markdown(found))


def digits(x: float) -> float:
    return float(f"{x:.4g}")


def told(function: Function, settings: Settings) -> str:
    """The settings that tell the rows apart, in words."""
    names = [n for n in settings if n in main_shape(function) or n in TRADED.values() or f"{n} =" in function.energy]
    shown = {n: f"{settings[n][0]:g}" for n in names if n not in physics.WHITE or settings[n][0] != 1.0}
    alike = dict.fromkeys(shown.values())
    groups = [" = ".join(n for n in shown if shown[n] == value) + f" = {value}" for value in alike]
    return ", ".join(groups)


if __name__ == "__main__":
    main()
