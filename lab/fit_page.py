"""docs/fits.md: Lafortune's lobes fitted to a roughened metal, and six published fits: python -m lobe.lab.fit_page.

Figures go to benchmarks/results/fits.json; `python -m lobe.lab.fit_page page` writes the page from these alone.
"""

from __future__ import annotations

import datetime
import json
import sys
from functools import cache

import numpy as np

from lobe import reference

from . import figures, files, lafortune, pictures, plots, quadrature, samples
from .lafortune import Lobes
from .paths import DATA, ROOT
from .simulated import ALUMINIUM, aluminium

PAGE, FIGURES = ROOT / "docs" / "fits.md", ROOT / "docs" / "figures"
RESULTS = ROOT / "benchmarks" / "results" / "fits.json"
MATERIALS = DATA / "lafortune_fits.json"
SHOWN, BEYOND = (0, 30, 60), 75  # degrees: what Lafortune's figure shows, and what it does not
TOLD = (0, 15, 30, 45, 60, 70, 75, 80)
VIEWS = (0, 30, 60, 75, 80, 85)
LABELS = {"all": "three lobes, fitted to all directions",
          "three": f"fitted to {', '.join(f'{v}°' for v in SHOWN)} only"}
LAFORTUNE3 = f"lobe_Lafortune3({','.join(['vec3'] * 17)})"


@cache
def fitted(name: str) -> lafortune.Fit:
    """Three lobes, from samples of all directions of view (`all`) or of the three that are shown (`three`)."""
    if name == "all":
        return lafortune.fit(samples.of(name, aluminium), 3)
    rules = [quadrature.lights(np.radians(view), 24, 16) for view in SHOWN]
    V, L = (np.concatenate([frame[i] for frame, _ in rules]) for i in (2, 3))
    weight = np.concatenate([weight / frame[3][:, 2] for frame, weight in rules])
    return lafortune.fit(samples.Samples(name, V, L, aluminium(V, L), weight), 3)


def at(view: float, *models) -> list[dict]:
    """Of each model at an angle of view: albedo, the error against the first model, relative and weighted with NdotL,
    and where in the plane of incidence the peak is, and how high."""
    (_, _, V, L), weight = quadrature.lights(np.radians(view))
    values = [f(V, L)[:, 0] for f in models]
    norm = np.sqrt(weight @ (values[0] ** 2 * L[:, 2]))
    out = np.linspace(-89.9, 89.9, 1799)
    slices = [plane(f, view, np.radians(out)) for f in models]
    return [{"albedo": weight @ f, "error": np.sqrt(weight @ ((f - values[0]) ** 2 * L[:, 2])) / norm,
             "peak": out[slice_.argmax()], "height": slice_.max()} for f, slice_ in zip(values, slices)]


def plane(f, view: float, out: np.ndarray) -> np.ndarray:
    """f [n] in the plane of incidence, from `view` degrees to the angles `out`."""
    L = quadrature.spherical(out, 0.0)
    return f(np.broadcast_to(quadrature.spherical(np.radians(-view), 0.0), L.shape), L)[:, 0]


@cache
def published() -> dict[str, tuple[Lobes, Lobes, Lobes]]:
    """The six materials by name, a Lobes for each channel."""
    return {name: tuple(
        Lobes(m["diffuse_reflectance"][k], np.array([[lobe[f"C{axis}"][k] for axis in "xyz"] for lobe in m["lobes"]]),
              np.array([lobe["exponent"][k] for lobe in m["lobes"]])) for k in range(3))
        for name, m in json.loads(MATERIALS.read_text())["materials"].items()}


def colour(lobes: tuple[Lobes, ...]):
    """f [n, 3] of three channels."""
    return lambda V, L: np.stack([one(V, L) for one in lobes], axis=1)


def shader_parameters(lobes: tuple[Lobes, Lobes, Lobes]) -> dict[str, tuple[float, ...]]:
    """Of lobe_Lafortune3."""
    return lafortune.Fit(None, lobes, ()).parameters


def measure() -> dict:
    """What fits.json holds."""
    models = aluminium, fitted("all"), fitted("three")
    angles = [dict(zip(("simulated", "all", "three"), at(view, *models))) | {"view": view} for view in TOLD]
    materials = {}
    for name, lobes in published().items():
        again = lafortune.fit(samples.of(name, colour(lobes)), 3)
        materials[name] = {"albedo": [lafortune.albedo(colour(lobes), np.radians(v)) for v in VIEWS],
                           "again": again.residual}
    return files.plain({
        "schema": 1, "date": datetime.date.today().isoformat(), "aluminium": {
            "angles": angles, **{name: {"residual": fitted(name).residual[0], "parameters": fitted(name).parameters,
                                        "glsl": fitted(name).glsl} for name in ("all", "three")}},
        "materials": materials})


# The page

def page(found: dict) -> str:
    metal, angles = found["aluminium"], {row["view"]: row for row in found["aluminium"]["angles"]}
    steep, beyond, widest = angles[SHOWN[-1]], angles[BEYOND], max(_largest(found))
    return f"""# Lafortune's lobes, fitted

Generated from [fits.json](../benchmarks/results/fits.json) by `python -m lobe.lab.fit_page`. `./lobe fit` finds the
lobes: it minimises the sum over all samples of weight · (N·V N·L (fit − f))², each channel by itself. That error does
not tell the light from the view, as f does not, and grazing pairs, where f grows like 1 / (N·V N·L), do not rule it. It
has many local minima: of {lafortune.DRAWS} random starts the best {lafortune.STARTS} descend, and the best
{lafortune.FINALISTS} of these go to the end. C and the exponent keep to the ranges that the header of
[lafortune.glsl](../glsl/lafortune.glsl) states.

## The table

```csv
theta_i,phi_i,theta_o,phi_o,value_r,value_g,value_b,weight
30,0,30,180,0.42,0.40,0.39,0.25
```

Degrees: of the light (i) and of the view (o), theta from the normal, below 90, phi from T towards B. Values are f in
1/sr, without the cosine; a column `value` alone is grey. `weight` is the solid angle that the row stands for, light's times
view's. Without it all rows count alike, which suits random directions; on a grid of even angles the pole is then
counted far too often: give sin(theta_i) sin(theta_o). `fit.json` has the parameters by the shader's names, the GLSL
call, the residual and the albedos.

## A roughened metal

Lafortune et al. 1997 show (figure 11) that three lobes follow a roughened aluminium at 0°, 30° and 60° of incidence.
The measurement here is simulated, too: He, Torrance, Sillion, Greenberg 1991 at {ALUMINIUM['nm']} nm with the
measured n and k of aluminium, σ₀ = {ALUMINIUM['sigma0']} µm, τ = {ALUMINIUM['tau']} µm (values often quoted for
their sample; [he_torrance.py](../lab/he_torrance.py)).

![Simulated aluminium and two fits, polar](figures/fit-aluminium.svg)

f in the plane of incidence, light from the left. Above, three lobes fitted to all pairs of directions: residual
{_percent(metal['all']['residual'])}. Up to 30° they follow within {_percent(angles[30]['all']['error'])}. At
{SHOWN[-1]}° the metal's peak lies at {steep['simulated']['peak']:.0f}°, far off the mirror direction, and reaches
{steep['simulated']['height']:.2g}; the fit's lies at {steep['all']['peak']:.0f}° and reaches
{steep['all']['height']:.2g}. A highlight by facets also grows narrow across the plane of incidence towards grazing,
where one of Lafortune's stays round about its own axis.

Below, fitted to the three incidences alone, as one would from three slices of a gonioreflectometer: residual
{_percent(metal['three']['residual'])}, and at {SHOWN[-1]}° the peak comes where it should, at
{steep['three']['peak']:.0f}° with {steep['three']['height']:.2g}: the paper's figure. But at {BEYOND}°, which nobody
measured, f reaches {_large(beyond['three']['height'])} and the albedo {beyond['three']['albedo']:.3g}, where
{beyond['simulated']['albedo']:.2f} is right. **Three slices that match prove nothing about the fourth**: look at the
albedo that `./lobe fit` prints at 75° to 85° before you use a fit.

{_table("view | albedo, simulated | fitted to all | error | fitted to three | error",
        ([f"{v}°", f"{r['simulated']['albedo']:.3f}", _albedo(r['all']['albedo']), _percent(r['all']['error']),
          _albedo(r['three']['albedo']), _percent(r['three']['error'])] for v, r in angles.items()))}
*Error*: root mean square over the lights, weighted with N·L, over that of the simulation. Albedos above 1 are bold.

```glsl
{metal['all']['glsl']}
```

## Six measured materials

S. Westin (Cornell) fitted three lobes a channel to measurements of six materials ([coefficients and
credit](../data/README.md)). The measurements themselves are not here: what follows is about the fits.

![Six teapots](figures/lafortune-materials.png)

From the left, brushed metal, blue paint, felt; clay, primer, skin; `lobe_Lafortune3` in the reference renderer, in
direct light.

{_table("material | " + " | ".join(f"{v}°" for v in VIEWS) + " | fitted again",
        ([name.replace("_", " "), *(_albedo(max(a)) for a in m["albedo"]), _percent(max(m["again"]))]
         for name, m in found["materials"].items()))}
Albedo by angle of view, the largest of the three channels, by quadrature. The fit of {widest[1].replace("_", " ")}
gives back {widest[0]:.2f} times what it gets at {widest[2]}°: in direct light it passes, bounced between two walls it
shines. It is isotropic, Cx = Cy, so that the brush's direction, if it had one, is lost, too. *Fitted again* is the
residual of our fit to samples of theirs, the worst channel: clay's and skin's have a Cz beyond the range of the header
(to {_least_Cz():.1f}: a lobe cut off, not a bright one).
"""


def _least_Cz() -> float:
    return min(lobes.C[:, 2].min() for channels in published().values() for lobes in channels)


def _largest(found: dict):
    return [(max(a), name, view) for name, m in found["materials"].items() for view, a in zip(VIEWS, m["albedo"])]


def _percent(x: float) -> str:
    return "< 0.001 %" if x < 1e-5 else f"{100 * x:.2g} %" if x < 10 else f"{x:.0f} times"


def _large(x: float) -> str:
    """To three digits, as far as the nodes of a peak agree."""
    return f"{float(f'{x:.3g}'):,.0f}"


def _albedo(x: float) -> str:
    return f"**{x:.3g}**" if x > 1.0005 else f"{x:.3f}"


def _table(header: str, rows) -> str:
    rule = "|---" * (header.count("|") + 1) + "|"
    return "\n".join((f"| {header} |", rule, *(f"| {' | '.join(row)} |" for row in rows))) + "\n"


# Figures

def draw_aluminium(figure):
    """Polar, in the plane of incidence; a row for each fit."""
    out = np.radians(np.linspace(-89.9, 89.9, 361))
    rows = figure.subplots(2, 4, subplot_kw={"projection": "polar"})
    for row, name, colour in zip(rows, ("all", "three"), (plots.ORANGE, plots.GREEN)):
        for axes, view in zip(row, (*SHOWN, BEYOND)):
            exact, fit = plane(aluminium, view, out), plane(fitted(name), view, out)
            axes.plot(out, exact, color=plots.BLACK, linewidth=1.4, label="He-Torrance, simulated")
            axes.plot(out, np.minimum(fit, 2.5 * exact.max()), "--", color=colour, linewidth=1.4, label=LABELS[name])
            axes.set(theta_zero_location="N", theta_direction=-1, thetamin=-90, thetamax=90,
                     rlim=(0, 1.25 * exact.max()), xticks=np.radians((-60, -30, 0, 30, 60)))
            most = fit.max() / exact.max()
            beyond = f"\nfit reaches {_large(fit.max())}" if most > 1.25 else ""
            axes.set_title(f"{view}°, f up to {exact.max():.2g}{beyond}", fontsize=9)
            axes.tick_params(labelsize=7, pad=-1)
            axes.set_yticks([exact.max() / 2, exact.max()], ["", ""])
            axes.grid(color="#dddddd", linewidth=0.6)
    both = [row[0].get_legend_handles_labels() for row in rows]
    figure.legend(both[0][0] + both[1][0][1:], both[0][1] + both[1][1][1:], fontsize=8, frameon=False, ncols=3,
                  loc="outside lower center")


DRAWINGS = {"fit-aluminium.svg": (draw_aluminium, (10.5, 4.4))}


def teapots(width: int = 300, height: int = 220, tall: int = 2) -> np.ndarray:
    """The six materials on a teapot each, in rows."""
    strip = figures.teapots([[(LAFORTUNE3, shader_parameters(lobes))] for lobes in published().values()], width, height)
    return np.concatenate(np.split(strip, tall, axis=1))


def main() -> None:
    if sys.argv[1:] != ["page"]:
        reference.set_threads(0)
        files.write_json(RESULTS, measure())
        for name, (draw, size) in DRAWINGS.items():
            plots.write_svg(FIGURES / name, draw, size)
        files.write_png(FIGURES / "lafortune-materials.png", pictures.srgb(teapots()))
    files.write_text(PAGE, page(json.loads(RESULTS.read_text())))


if __name__ == "__main__":
    main()
