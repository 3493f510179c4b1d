"""The metals: glsl/metals.glsl, and the tables and figures of docs/metals.md, from the measured n and k of data/ior.

`python -m lobe.lab.metals` writes them all again.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from . import files, pictures, plots, spectra
from .paths import DATA, GLSL, ROOT

SHADER, PAGE, FIGURES = GLSL / "metals.glsl", ROOT / "docs" / "metals.md", ROOT / "docs" / "figures"

F0_LIMIT = 0.99
"""F(0) of the fitted n + ik where the colour has more. Silver, which reflects most, stays below it."""

_F0_DIGITS, _INDEX_DIGITS = ".4f", "#.5g"
"""As the shader writes them: the index with more, since 1 - F of silver is as sensitive to n as n is small."""

FIT_ANGLES = np.linspace(0, np.pi / 2, 181)
CHECK_ANGLES = np.linspace(0, np.pi / 2, 901)

_JOHNSON_1972, _JOHNSON_1974 = "measured by Johnson and Christy 1972", "measured by Johnson and Christy 1974"


@dataclass(frozen=True)
class Metal:
    """One metal. `lecture` is its F0 in the lecture's table, linear sRGB; `source` says where n and k come from."""

    name: str
    symbol: str
    file: str
    source: str
    lecture: tuple[float, float, float]

    @property
    def path(self) -> Path:
        return DATA / "ior" / self.file


METALS = (
    Metal("titanium", "Ti", "Ti_Johnson.csv", _JOHNSON_1974, (0.542, 0.497, 0.449)),
    Metal("chromium", "Cr", "Cr_Johnson.csv", _JOHNSON_1974, (0.549, 0.556, 0.554)),
    Metal("iron", "Fe", "Fe_Johnson.csv", _JOHNSON_1974, (0.562, 0.565, 0.578)),
    Metal("nickel", "Ni", "Ni_Johnson.csv", _JOHNSON_1974, (0.660, 0.609, 0.526)),
    Metal("platinum", "Pt", "Pt_Rakic-BB.csv", "modelled by Rakic et al. 1998", (0.673, 0.637, 0.585)),
    Metal("copper", "Cu", "Cu_Johnson.csv", _JOHNSON_1972, (0.955, 0.638, 0.538)),
    Metal("palladium", "Pd", "Pd_Johnson.csv", _JOHNSON_1974, (0.733, 0.697, 0.652)),
    Metal("zinc", "Zn", "Zn_Werner-DFT.csv", "computed (DFT) by Werner et al. 2009", (0.664, 0.824, 0.850)),
    Metal("gold", "Au", "Au_Johnson.csv", _JOHNSON_1972, (1.022, 0.782, 0.344)),
    Metal("aluminium", "Al", "Al_McPeak.csv", "measured by McPeak et al. 2015", (0.913, 0.922, 0.924)),
    Metal("silver", "Ag", "Ag_Johnson.csv", _JOHNSON_1972, (0.972, 0.960, 0.915)),
)


def fresnel(cosI, index):
    """Reflectance of a surface of complex index n + ik in vacuum, for unpolarised light; the arguments broadcast."""
    normal = np.sqrt(index**2 - (1 - cosI**2))  # of the wave vector inside, its component along the normal
    r_s = (cosI - normal) / (cosI + normal)
    r_p = (index**2 * cosI - normal) / (index**2 * cosI + normal)
    return (abs(r_s) ** 2 + abs(r_p) ** 2) / 2


def schlick(cosI, f0):
    """Schlick's approximation [3,n] from the reflectance at normal incidence [3] and cosines [n]."""
    return f0[:, None] + (1 - f0[:, None]) * (1 - cosI) ** 5


def spectral_colour(metal: Metal, angles):
    """Linear sRGB [3,n] of a metal at angles of incidence [n], in radians: the Fresnel reflectance of its spectrum."""
    n, k = spectra.sampled(metal.path)
    return spectra.linear_srgb(fresnel(np.cos(angles), (n + 1j * k)[:, None]))


def fit_index(curve, angles) -> complex:
    """
    n + ik of one channel: F at the first of the angles, 0, is the curve's there; over all angles, F is nearest to the
    curve in least squares weighted by projected solid angle.

    F(0) is |r|^2 of r = (m - 1) / (m + 1), m = n + ik. That leaves the phase of r, from 0 to pi, which alone is fitted.
    A curve that begins above F0_LIMIT, which no n + ik may follow, is first cut there.
    """
    from scipy.optimize import least_squares

    if curve[0] > F0_LIMIT:
        curve = np.minimum(curve, F0_LIMIT)
    cosI = np.cos(angles)
    weight = np.sqrt(cosI * np.sin(angles))

    def index(phase):
        r = np.sqrt(curve[0]) * np.exp(1j * phase)
        return (1 + r) / (1 - r)

    def residual(phase):
        return weight * (fresnel(cosI, index(phase)) - curve)

    start = min(np.linspace(0.05, 3.1, 62), key=lambda phase: np.sum(residual(phase) ** 2))
    best = least_squares(residual, start, jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return complex(index(best.x[0]))


@dataclass(frozen=True)
class Fit:
    """What the shader gets of a metal, rounded as it gets it, float64 [3] each."""

    f0: np.ndarray
    eta: np.ndarray
    k: np.ndarray

    def colour(self, angles):
        """Linear sRGB [3,n] by the fitted n + ik."""
        return fresnel(np.cos(angles), (self.eta + 1j * self.k)[:, None])


@cache
def fitted(metal: Metal) -> Fit:
    curves = spectral_colour(metal, FIT_ANGLES)
    index = np.array([fit_index(curve, FIT_ANGLES) for curve in curves])
    return Fit(*(np.array([float(text) for text in _numbers(values, digits)]) for values, digits in
                 ((curves[:, 0], _F0_DIGITS), (index.real, _INDEX_DIGITS), (index.imag, _INDEX_DIGITS))))


def errors(metal: Metal):
    """Largest |difference| [3] from the spectral colour at any angle: of the fitted n + ik, and of Schlick from F0."""
    exact, fit = spectral_colour(metal, CHECK_ANGLES), fitted(metal)
    return tuple(abs(colour - exact).max(axis=1)
                 for colour in (fit.colour(CHECK_ANGLES), schlick(np.cos(CHECK_ANGLES), fit.f0)))


def _numbers(values, digits) -> list[str]:
    return [f"{value:{digits}}" for value in values]


_SHADER_HEAD = f"""\
// Eleven metals: their colour at normal incidence, and an index of refraction for each channel of linear sRGB.
// needs  nothing
//
// generated by: python -m lobe.lab.metals. Change that, not this; docs/metals.md says how the numbers come about.
//
// LOBE_F0_X is for lobe_F_Schlick and the lobes that take f0: the measured reflectance at normal incidence as the CIE
// 1931 observer sees it under D65; a perfect mirror is (1, 1, 1). Gold's red lies outside sRGB, above 1: terms take it
// as it is, whole lobes cut it at 1.
//
// LOBE_ETA_X and LOBE_K_X are the n and k of lobe_F_conductor, fitted so that its colour is LOBE_F0_X at normal
// incidence and follows the metal's colour at all other angles. Gold's red, above 1, has {F0_LIMIT} there instead.
#ifndef LOBE_METALS_GLSL
#define LOBE_METALS_GLSL

"""


def shader() -> str:
    """The text of glsl/metals.glsl."""
    def constants(metal):
        fit, name = fitted(metal), metal.name.upper()
        lines = (("F0", fit.f0, _F0_DIGITS, "from"), ("ETA", fit.eta, _INDEX_DIGITS, "fitted to"),
                 ("K", fit.k, _INDEX_DIGITS, "fitted to"))
        return "".join(f"const vec3 LOBE_{kind}_{name} = vec3({', '.join(_numbers(values, digits))});"
                       f"  // {how} n, k {metal.source}\n" for kind, values, digits, how in lines)

    return _SHADER_HEAD + "\n".join(constants(metal) for metal in METALS) + "\n#endif\n"


def tables() -> dict[str, str]:
    """The tables of docs/metals.md by name, in Markdown."""
    def table(head, row):
        lines = [head, ["---"] * len(head), *(row(metal, fitted(metal)) for metal in METALS)]
        return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)

    def colours(metal, fit):
        apart = abs(fit.f0 - metal.lecture).max()
        return [f"{metal.name} {metal.symbol}", " ".join(_numbers(fit.f0, ".3f")),
                " ".join(_numbers(metal.lecture, ".3f")), f"{apart:.3f}", metal.source]

    def indices(metal, fit):
        return [metal.name, " ".join(_numbers(fit.eta, "#.4g")), " ".join(_numbers(fit.k, "#.4g")),
                *(" ".join(_numbers(error, ".4f")) for error in errors(metal))]

    return {
        "colours": table(["metal", "F0", "F0, lecture", "largest difference", "n and k"], colours),
        "indices": table(["metal", "n", "k", "largest error of n + ik", "largest error of Schlick"], indices),
    }


def page(text: str) -> str:
    """The text of docs/metals.md with its tables up to date, each between `<!-- NAME -->` and `<!-- /NAME -->`."""
    for name, table in tables().items():
        text = re.sub(f"(<!-- {name} -->\n).*(<!-- /{name} -->)", rf"\g<1>{table}\g<2>", text, flags=re.DOTALL)
    return text


# Figures

CHANNELS = {"red": "#c8102e", "green": "#1a7f37", "blue": "#1f5fd0"}


def draw_swatches(figure):
    """A row of colours by F0 from n and k, and one by the lecture's F0; what exceeds the gamut is cut."""
    axes = figure.subplots()
    for column, metal in enumerate(METALS):
        for row, f0 in enumerate((fitted(metal).f0, metal.lecture)):
            axes.add_patch(_rectangle(column, row, pictures.srgb(np.array(f0))))
    axes.set(xlim=(0, len(METALS)), ylim=(2, 0), xticks=np.arange(len(METALS)) + 0.5, yticks=(0.5, 1.5))
    axes.set_xticklabels([metal.symbol for metal in METALS])
    axes.set_yticklabels(["from n and k", "lecture"])
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)


def _rectangle(x, y, colour):
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), 1, 1, facecolor=colour, edgecolor="#999999", linewidth=0.8)


def _panels(figure, draw, xlabel):
    """A panel per metal; the last place holds the legend."""
    axes = figure.subplots(3, 4, sharex=True, squeeze=False).flat
    for panel, metal in zip(axes, METALS):
        draw(panel, metal)
        panel.set_title(f"{metal.name} {metal.symbol}", fontsize=10, loc="left")
        panel.grid(color="#dddddd", linewidth=0.6)
        panel.tick_params(labelsize=8, labelbottom=True)
        panel.spines[["top", "right"]].set_visible(False)
    axes[-1].axis("off")
    axes[-1].legend(*axes[0].get_legend_handles_labels(), loc="center", fontsize=9, frameon=False)
    figure.supxlabel(xlabel, fontsize=10)


def draw_indices(figure):
    """n and k over the visible wavelengths, with the points of the tables."""
    first, last = spectra.WAVELENGTHS_NM[[0, -1]]

    def draw(panel, metal):
        wavelength, *given = spectra.read_nk(metal.path)
        seen = (wavelength * 1000 >= first) & (wavelength * 1000 <= last)
        for label, colour, points, curve in zip("nk", ("#1b6ca8", "#c2571a"), given, spectra.sampled(metal.path)):
            panel.plot(spectra.WAVELENGTHS_NM[::10], curve[::10], linewidth=1.2, color=colour, label=label)
            panel.plot(wavelength[seen] * 1000, points[seen], "o", markersize=2.5, color=colour)
        panel.set(xlim=(first, last), ylim=(0, None))

    _panels(figure, draw, "wavelength [nm]")


def draw_angles(figure):
    """Each channel over the angle: spectral, by the fitted n + ik, and by Schlick."""
    angles = np.pi / 2 * np.sin(np.linspace(0, np.pi / 2, 36))  # dense where the curves are steep

    def draw(panel, metal):
        fit = fitted(metal)
        exact, by_index = spectral_colour(metal, angles), fit.colour(angles)
        by_schlick = schlick(np.cos(angles), fit.f0)
        for channel, (name, colour) in enumerate(CHANNELS.items()):
            panel.plot(np.degrees(angles), exact[channel], color=colour, linewidth=3, alpha=0.35,
                       label=f"{name}, spectral")
            panel.plot(np.degrees(angles), by_index[channel], color=colour, linewidth=1,
                       label=f"{name}, fitted n + ik")
            panel.plot(np.degrees(angles), by_schlick[channel], ":", color=colour, linewidth=1.2,
                       label=f"{name}, Schlick from F0")
        panel.set(xlim=(0, 90), xticks=(0, 30, 60, 90))
        panel.margins(y=0.06)

    _panels(figure, draw, "angle of incidence [degrees]")


DRAWINGS = {"metals-swatches.svg": (draw_swatches, (9, 1.9)), "metals-nk.svg": (draw_indices, (10, 6.4)),
            "metals-angle.svg": (draw_angles, (10, 6.4))}


def stamp() -> str:
    """What a figure says of the numbers that it was drawn from: the drawing itself differs between Matplotlibs."""
    return "glsl/metals.glsl " + hashlib.sha256(shader().encode()).hexdigest()[:16]


def main() -> None:
    files.write_text(SHADER, shader())
    files.write_text(PAGE, page(PAGE.read_text(encoding="utf-8")))
    for name, (draw, size) in DRAWINGS.items():
        plots.write_svg(FIGURES / name, draw, size, stamp())


if __name__ == "__main__":
    main()
