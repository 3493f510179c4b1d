"""The lecture's errata: each wrong formula beside the right one, in numbers and figures, for docs/lecture-errata.md.

`python -m lobe.lab.errata` writes the page's tables and figures again. A formula as printed is a function
`printed_...`; the right one is the reference's, or the paper's where the library has no such function.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

import numpy as np

from . import files, metals, plots, spectra
from .paths import ROOT
from .plots import evaluated

PAGE, FIGURES = ROOT / "docs" / "lecture-errata.md", ROOT / "docs" / "figures"

D_GGX, D_BECKMANN = "lobe_D_GGX(float,float)", "lobe_D_Beckmann(float,float)"
D_BECKMANN_ANISO = "lobe_D_Beckmann_aniso(float,float,float,float,float)"
G1 = "lobe_G1_GGX(float,float)"
V_GGX, V_KELEMEN = "lobe_V_GGX(float,float,float)", "lobe_V_Kelemen(float)"
F_DIELECTRIC, F_CONDUCTOR = "lobe_F_dielectric(float,float)", "lobe_F_conductor(float,float,float)"
F_SCHLICK = "lobe_F_Schlick(float,float)"
GGX, GGX_KELEMEN = "lobe_GGX(vec3,vec3,vec3,vec3,float)", "lobe_GGX_Kelemen(vec3,vec3,vec3,vec3,float)"
OREN_NAYAR = "lobe_OrenNayar_qualitative(vec3,vec3,vec3,vec3,float)"

NORMAL, WHITE = np.array([0.0, 0.0, 1.0]), np.ones(3)


@dataclass(frozen=True)
class Table:
    """Rows of text and numbers under a head; `digits` says how a number is written."""

    head: tuple[str, ...]
    rows: list[tuple]
    digits: str = ".3f"

    def markdown(self) -> str:
        def cell(value):
            return value if isinstance(value, str) else f"{value:{self.digits}}"

        lines = [self.head, ["---"] * len(self.head), *([cell(v) for v in row] for row in self.rows)]
        return "".join(f"| {' | '.join(line)} |\n" for line in lines)


# Integrals over the hemisphere, by Gauss and Legendre

_legendre = cache(np.polynomial.legendre.leggauss)


def nodes(start, end, count):
    x, w = _legendre(count)
    return start + (end - start) * (x + 1) / 2, (end - start) * w / 2


def direction(theta, phi=0.0):
    """Unit vectors [..., 3] about NORMAL from angles in radians that broadcast."""
    theta, phi = np.broadcast_arrays(theta, phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def facet_integral(D, power=1) -> float:
    """Integral of D(H) (N.H)^power over the half vectors H [n, m, 3]; D is even in both tangential components of H."""
    theta, theta_weight = nodes(0, np.pi / 2, 400)
    phi, phi_weight = nodes(0, np.pi / 2, 64)
    weight = theta_weight * np.sin(theta) * np.cos(theta) ** power
    return float(4 * weight @ D(direction(theta[:, None], phi)) @ phi_weight)


def albedo(f, view) -> float:
    """Integral of f(V, L) (N.L) over L [n, m, 3] for V at `view` radians; f may have a kink where the angles agree."""
    phi, phi_weight = (np.concatenate(x) for x in zip(nodes(0, np.pi / 2, 100), nodes(np.pi / 2, np.pi, 100)))
    theta, theta_weight = (np.concatenate(x) for x in zip(nodes(0, view, 150), nodes(view, np.pi / 2, 150)))
    L = direction(theta[:, None], phi)
    return float(2 * (theta_weight * np.sin(theta) * np.cos(theta)) @ f(direction(view), L) @ phi_weight)


def lobe_albedo(key, view, *settings) -> float:
    """The same of a lobe of the reference, its first channel."""
    return albedo(lambda V, L: evaluated(key, NORMAL, V, L, *settings)[..., 0], view)


def cos(*degrees):
    return np.cos(np.radians(degrees))


# 1. Fresnel

def printed_fresnel(c, n):
    g = np.sqrt(n * n - 1 + c * c)
    return 0.5 * ((g - c) / (g + c)) ** 2 * (1 + ((c * (g + c) - 1) / (c * (g - c) - 1)) ** 2)


def fresnel() -> Table:
    cases = [(1.5, 0), (1.5, 45), (1.5, 60), (1.5, 80), (1.33, 0), (1.9, 0)]
    rows = [(f"n = {n}, {angle}°", float(printed_fresnel(np.cos(np.radians(angle)), n)),
             float(evaluated(F_DIELECTRIC, np.cos(np.radians(angle)), n))) for n, angle in cases]
    pole = 1 / np.sqrt(2.4**2 - 3)  # c (g - c) = 1 at c = 1 / sqrt(n^2 - 3)
    rows.append((f"n = 2.4 (diamond), {np.degrees(np.arccos(pole)):.1f}°", "infinite",
                 float(evaluated(F_DIELECTRIC, pole, 2.4))))
    return Table(("case", "F as printed", "F"), rows)


# 2, 3. Oren-Nayar

def oren_nayar_AB(sigma):
    """The two factors of the qualitative model."""
    return 1 - 0.5 * sigma**2 / (sigma**2 + 0.33), 0.45 * sigma**2 / (sigma**2 + 0.09)


def printed_oren_nayar(V, L, sigma):
    """White, for L and V above the horizon."""
    A, B = oren_nayar_AB(sigma)
    theta_v, theta_l = np.arccos(V[..., 2]), np.arccos(L[..., 2])
    cos_phi = np.cos(np.arctan2(L[..., 1], L[..., 0]) - np.arctan2(V[..., 1], V[..., 0]))
    large, small = np.maximum(theta_v, theta_l), np.minimum(theta_v, theta_l)
    return (A + B * np.maximum(cos_phi, 0)) * np.sin(large) * np.tan(small) / np.pi


def oren_nayar() -> Table:
    return Table(("case", "albedo as printed", "albedo"), [
        (f"σ = {sigma}, seen at {angle:.0f}°", albedo(lambda V, L: printed_oren_nayar(V, L, sigma), np.radians(angle)),
         lobe_albedo(OREN_NAYAR, np.radians(angle), WHITE, sigma)) for sigma in (0.0, 0.5) for angle in (0, 45, 80)])


def sigma() -> Table:
    """Facets whose tilt is normally distributed by 20°: the mean of |tilt| is sigma sqrt(2/pi)."""
    right = np.radians(20)
    cases = [("standard deviation, radians", right), ("mean tilt, radians", right * np.sqrt(2 / np.pi)),
             ("standard deviation, degrees", 20.0)]
    V = direction(np.radians(75))
    return Table(("σ taken as", "σ", "A", "B", "f / Lambert's, lit and seen at 75°"), [
        (name, value, *map(float, oren_nayar_AB(value)),
         float(evaluated(OREN_NAYAR, NORMAL, V, V, WHITE, value)[0] * np.pi)) for name, value in cases])


# 4. The one-sided G of GGX

def one_sided() -> Table:
    """f(V, L) / f(L, V) where G is G1(V), one direction along the normal."""
    def ratio(alpha, angle):
        return float(1 / evaluated(G1, np.cos(np.radians(angle)), alpha))

    return Table(("α", *(f"0° and {angle}°" for angle in (60, 80, 89, 89.9))), [
        (f"{alpha}", *(ratio(alpha, angle) for angle in (60, 80, 89, 89.9))) for alpha in (0.1, 0.5, 1.0)], ".2f")


# 5. Distributions that are none

def printed_gaussian(NdotH, m):
    delta = np.arccos(NdotH)
    return NdotH * np.exp(-((delta / m) ** 2))


def printed_ward(H, mx, my):
    return np.exp(-((H[..., 0] / mx) ** 2 + (H[..., 1] / my) ** 2) / H[..., 2] ** 2) / (np.pi * mx * my)


def gaussian_integral(m):
    """Of the lecture's Gaussian times N.H over all half vectors, in closed form."""
    from scipy.special import dawsn

    return float(np.pi / 2 * m * (dawsn(m / 2) + dawsn(3 * m / 2)))


def distributions() -> Table:
    def gaussian(m):
        whole = facet_integral(lambda H: printed_gaussian(H[..., 2], m))
        return f"Gaussian, m = {m}", whole, whole / gaussian_integral(m)

    def ward(mx, my):
        right = facet_integral(lambda H: evaluated(D_BECKMANN_ANISO, H[..., 2], H[..., 0], H[..., 1], mx, my))
        name = f"Ward, m = {mx}" if mx == my else f"Ward, {mx} by {my}"
        return name, facet_integral(lambda H: printed_ward(H, mx, my)), right

    return Table(("distribution", "integral as printed", "integral, right"),
                 [*map(gaussian, (0.05, 0.2, 0.5, 0.8)),
                  *(ward(*m) for m in ((0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (0.2, 0.8)))], ".4f")


def slopes() -> Table:
    """Standard deviation of a facet's slope, for Beckmann: of all of it, and along one axis."""
    def rms(m, of):
        return facet_integral(lambda H: of(H) / H[..., 2] ** 2 * evaluated(D_BECKMANN, H[..., 2], m)) ** 0.5

    return Table(("m", "rms slope", "rms slope along one axis", "m / √2"), [
        (f"{m}", rms(m, lambda H: 1 - H[..., 2] ** 2), rms(m, lambda H: H[..., 0] ** 2), m / 2**0.5)
        for m in (0.1, 0.3, 0.5)], ".4f")


# 6. Ashikhmin-Shirley

def ashikhmin_shirley_D(H, ex, ey, factor):
    tangential = ex * H[..., 0] ** 2 + ey * H[..., 1] ** 2
    return factor * H[..., 2] ** (tangential / (1 - H[..., 2] ** 2))


def ashikhmin_shirley() -> Table:
    def row(ex, ey):
        printed, facets = np.sqrt((ex + 1) * (ey + 1)), np.sqrt((ex + 2) * (ey + 2)) / (2 * np.pi)
        paper = printed / (2 * np.pi)
        cases = (printed, 0), (paper, 0), (printed, 1), (paper, 1), (facets, 1)  # factor, power of N.H
        return (f"{ex}, {ey}", *(facet_integral(lambda H: ashikhmin_shirley_D(H, ex, ey, factor), power)
                                 for factor, power in cases))

    return Table(("exponents", "∫D dω as printed", "∫D dω, paper", "∫D (N·H) dω as printed", "∫D (N·H) dω, paper",
                  "∫D (N·H) dω, as a distribution of facets"), [row(*e) for e in ((10, 10), (10, 100), (100, 1000))])


# 7. Blinn's angle

def blinn() -> Table:
    """beta between the mirror direction and V, delta between N and H; V is turned aside from the light's plane."""
    def row(light, view, aside):
        L, V = direction(np.radians(light), np.pi), direction(np.radians(view), np.radians(aside))
        R, H = 2 * L[2] * NORMAL - L, (L + V) / np.linalg.norm(L + V)
        return (f"{light}°", f"{view}°", f"{aside}°", float(np.degrees(np.arccos(R @ V))),
                float(2 * np.degrees(np.arccos(H[2]))))

    return Table(("light at", "V at", "aside", "β", "2δ"),
                 [row(*angles) for angles in ((60, 80, 0), (30, 30, 20), (60, 60, 20), (80, 80, 20))], ".1f")


def blinn_power() -> Table:
    """cos^h beta against the two readings of its counterpart."""
    def row(h, beta):
        c = np.cos(np.radians(beta))
        return f"{h}", f"{beta}°", c**h, np.cos(np.radians(beta) / 2) ** (4 * h), c ** (4 * h) / 2

    return Table(("h", "β", "cos^h β (Phong)", "cos^4h (β/2)", "(cos^4h β) / 2"),
                 [row(h, beta) for h, beta in ((10, 0), (10, 15), (50, 0), (50, 10))])


# 8. Schlick's power

def printed_power(s, h):
    return s / (h - h * s + s)


def power() -> Table:
    s = np.linspace(0, 1, 200001)
    x, w = nodes(0, 1, 400)

    def row(h):
        difference = printed_power(s, h) - s**h
        ratio = (w * x * printed_power(x, h)).sum() * (h + 2)  # of Phong's, the integral of s s^h is 1 / (h + 2)
        return f"{h}", float(difference.max()), float(np.degrees(np.arccos(s[difference.argmax()]))), float(ratio)

    return Table(("h", "largest difference", "at [degrees]", "integral of the lobe / that of cos^h"),
                 [row(h) for h in (10, 30, 100, 1000)], ".2f")


# 9. Lafortune

def lafortune() -> Table:
    mirror = 2 * np.outer(NORMAL, NORMAL) - np.eye(3)
    triples = [" ".join(f"{x:g}" for x in np.round(values, 12) + 0.0)
               for values in (np.linalg.svd(mirror)[1], np.linalg.eigvalsh(mirror))]
    h = 20
    scale = (h + 2) / (2 * np.pi)
    tilted = np.cos(np.radians(30))
    return Table(("case", "as printed", "right"), [
        ("M of the mirror lobe: singular values, eigenvalues", *triples),
        (f"Phong, h = {h}: peak of the lobe whose C_s is {scale:.3g}", float(np.sqrt(scale) ** h), float(scale)),
        (f"bracket of cos 30° with h = {h}: h times it, to the power of h", float(h * tilted), float(tilted**h)),
    ], ".4g")


# 10. An index for gold

def index_of_metal() -> Table:
    n, k = (values[650 - 380] for values in spectra.sampled(_metal("gold").path))
    f0 = float(spectra.reflectance(n, k))
    fake = (1 + np.sqrt(f0)) / (1 - np.sqrt(f0))
    return Table(("gold at 650 nm", "n + ik", *(f"F({a}°)" for a in (0, 60, 78, 85))), [
        (name, index, *map(float, evaluated(F_CONDUCTOR, cos(0, 60, 78, 85), *numbers)))
        for name, index, numbers in (("n from F0", f"{fake:.2f}", (fake, 0.0)),
                                     ("measured", f"{n:.3f} + {k:.3f}i", (n, k)))])


def _metal(name):
    return next(metal for metal in metals.METALS if metal.name == name)


# 11. The tan form of GGX

def printed_ggx(NdotH, alpha):
    """In the precision of its arguments."""
    with np.errstate(all="ignore"):
        tan2 = (1 - NdotH * NdotH) / (NdotH * NdotH)
        s = alpha * alpha + tan2
        return alpha * alpha / (np.asarray(np.pi, NdotH.dtype) * (NdotH * NdotH * NdotH * NdotH) * (s * s))


def tan_form() -> Table:
    cosines, alpha = np.array([0.5, 1e-3, 1e-9, 1e-11, 0], np.float32), np.float32(0.5)
    return Table(("N·H", "tan form, float32", "D"), [
        (f"{c:g}", got if np.isfinite(got := float(p)) else "NaN", float(right)) for c, p, right in
        zip(cosines, printed_ggx(cosines, alpha), evaluated(D_GGX, cosines, alpha))], ".6f")


# 12. Gold brighter than a mirror

def gold() -> Table:
    f0 = _metal("gold").lecture[0]
    return Table(("gold's red, F0 = 1.022", *(f"{a}°" for a in (0, 30, 60, 75, 90))), [
        (name, *map(float, evaluated(F_SCHLICK, cos(0, 30, 60, 75, 90), value)))
        for name, value in (("Schlick", f0), ("Schlick of min(F0, 1), as in whole lobes", min(f0, 1.0)))], ".4f")


# 13. Schlick's approximation

SCHLICK_ANGLES = np.radians(np.linspace(0, 90, 9001))


def schlick_error(eta, k=0.0, angles=SCHLICK_ANGLES):
    """Schlick minus exact, and exact, over the angles."""
    c = np.cos(angles)
    exact = evaluated(F_CONDUCTOR, c, eta, k)
    return evaluated(F_SCHLICK, c, spectra.reflectance(eta, k)) - exact, exact


def schlick_mean_error(eta, k=0.0):
    """Mean of the absolute error, weighted with the cosine."""
    c, weight = nodes(0, 1, 400)
    return float(2 * weight @ (c * abs(schlick_error(eta, k, np.arccos(c))[0])))


def schlick() -> Table:
    n_iron, k_iron = spectra.sampled(_metal("iron").path)

    def row(name, eta, k=0.0):
        error, exact = schlick_error(eta, k)
        relative = abs(error) / exact
        at, relative_at = (np.degrees(SCHLICK_ANGLES[x.argmax()]) for x in (abs(error), relative))
        return (name, float(abs(error).max()), f"{at:.0f}°", f"{100 * relative.max():.0f} %", f"{relative_at:.0f}°",
                f"{schlick_mean_error(eta, k):.4f}")

    iron = [row(f"iron at {nm} nm", n_iron[nm - 380], k_iron[nm - 380]) for nm in (450, 550, 650)]
    glasses = [row(f"n = {n}", n) for n in (1.1, 1.33, 1.5, 1.65, 2.0, 4.0)]
    return Table(("surface", "largest error", "at", "largest relative error", "at", "cosine-weighted mean"),
                 glasses + iron)


def schlick_cosine() -> Table:
    """F0 = 0.04, L and V in one plane on opposite sides."""
    def row(light, view):
        return (f"L at {light}°, V at {view}°",
                *map(float, evaluated(F_SCHLICK, cos(light, view, (light + view) / 2), 0.04)))

    return Table(("directions", "F of N·L", "F of N·L, L and V exchanged", "F of L·H"),
                 [row(45, 45), row(80, 10), row(85, 0)])


# 14. Kelemen's visibility

def kelemen() -> Table:
    def row(alpha, angle):
        values = [lobe_albedo(key, np.radians(angle), WHITE, alpha) for key in (GGX_KELEMEN, GGX)]
        return f"{alpha}", f"{angle}°", *values

    return Table(("α", "seen at", "albedo, Kelemen", "albedo, Smith"),
                 [row(alpha, angle) for angle in (17, 75) for alpha in (0.1, 0.2, 0.5, 1.0)])


def kelemen_pointwise() -> Table:
    """V of Kelemen over V of Smith for mirrored directions, both at one angle."""
    angles = (45, 80, 89, 89.9)
    c = cos(*angles)
    return Table(("α", *(f"{a}°" for a in angles)), [
        (f"{alpha}", *map(float, evaluated(V_KELEMEN, c) / evaluated(V_GGX, c, c, alpha)))
        for alpha in (0.2, 0.5, 1.0)], ".4g")


TABLES = {"fresnel": fresnel, "oren-nayar": oren_nayar, "sigma": sigma, "one-sided": one_sided,
          "distributions": distributions, "slopes": slopes, "ashikhmin-shirley": ashikhmin_shirley, "blinn": blinn,
          "blinn-power": blinn_power, "power": power, "lafortune": lafortune, "index-of-metal": index_of_metal,
          "tan-form": tan_form, "gold": gold, "schlick": schlick, "schlick-cosine": schlick_cosine,
          "kelemen": kelemen, "kelemen-pointwise": kelemen_pointwise}


def page(text: str) -> str:
    """The text of the page with its tables up to date, each between `<!-- NAME -->` and `<!-- /NAME -->`."""
    for name, table in TABLES.items():
        block = f"(<!-- {name} -->\n).*(<!-- /{name} -->)"
        text = re.sub(block, rf"\g<1>{table().markdown()}\g<2>", text, flags=re.DOTALL)
    return text


# Figures

def draw_fresnel(figure):
    angles = np.linspace(0, 90, 721)
    c = np.cos(np.radians(angles))
    for axes, n in zip(figure.subplots(1, 2), (1.5, 2.4)):
        printed = printed_fresnel(c, n)
        axes.plot(angles, printed, "--", color=plots.ORANGE, label="as printed, − 1")
        axes.plot(angles, evaluated(F_DIELECTRIC, c, n), color=plots.BLUE, label="right, + 1")
        plots.style(axes, f"n = {n}", ylabel="F")
        plots.degrees(axes)
    figure.axes[0].set(ylim=(0, 1.02))
    figure.axes[1].set(yscale="log", ylim=(0.1, 1000))
    figure.axes[0].legend(fontsize=8, frameon=False, loc="upper left")


def draw_oren_nayar(figure):
    """Over the angle of view in the plane of the light, at 60°, and over one angle for both."""
    sigma, view = 0.5, np.linspace(-89.9, 89.9, 720)
    across, back = figure.subplots(1, 2, sharey=True)
    for axes, L, angles, title in ((across, direction(np.radians(60)), view, "light at 60°"),
                                   (back, direction(np.radians(view[360:])), view[360:], "light and eye at one angle")):
        V = direction(np.radians(angles))
        axes.plot(angles, np.pi * printed_oren_nayar(V, L, sigma), "--", color=plots.ORANGE,
                  label=f"as printed, σ = {sigma}")
        axes.plot(angles, np.pi * evaluated(OREN_NAYAR, NORMAL, V, L, WHITE, sigma)[..., 0], color=plots.BLUE,
                  label=f"right, σ = {sigma}")
        axes.axhline(1, color=plots.GREY, linewidth=1, linestyle=":", label="Lambert, σ = 0")
        plots.style(axes, title, ylim=(0, 2.4))
    plots.degrees(back, "angle of light and eye [degrees]")
    across.set(xlim=(-90, 90), xticks=range(-90, 91, 30), xlabel="angle of view, > 0 on the light's side [degrees]",
               ylabel="π f")
    back.legend(fontsize=8, frameon=False, loc="upper left")


def draw_distributions(figure):
    axes, m = figure.subplots(), np.linspace(0.02, 1, 50)
    gaussian = [gaussian_integral(x) / (np.pi * x * x) for x in m]
    ward = [facet_integral(lambda H: printed_ward(H, x, x)) for x in m]
    axes.plot(m, gaussian, "--", color=plots.ORANGE, label="Gaussian as printed, over π m²")
    axes.plot(m, ward, color=plots.BLUE, label="Ward as printed")
    axes.axhline(1, color=plots.GREY, linewidth=1, linestyle=":", label="a distribution of facets")
    plots.style(axes, xlim=(0, 1), ylim=(0, 1.1), xlabel="m", ylabel="∫ D (N·H) dω")
    axes.legend(fontsize=8, frameon=False, loc="lower left")


def draw_power(figure):
    angles = np.linspace(0, 90, 721)
    s = np.cos(np.radians(angles))
    for axes, h, shown in zip(figure.subplots(1, 3), (10, 100, 1000), (90, 45, 15)):
        axes.plot(angles, s**h, color=plots.BLUE, label="$\\cos^h$ (Phong)")
        axes.plot(angles, printed_power(s, h), "--", color=plots.ORANGE, label="S / (h − hS + S)")
        plots.style(axes, f"h = {h}", xlim=(0, shown), ylim=(0, 1.02), xlabel="angle off the mirror [degrees]")
    axes.legend(fontsize=8, frameon=False)


def draw_schlick(figure):
    from matplotlib.ticker import FixedLocator, NullLocator

    n = np.geomspace(1.02, 5, 120)
    errors = [schlick_error(x, angles=SCHLICK_ANGLES[::10]) for x in n]
    axes = figure.subplots()
    axes.plot(n, [abs(error).max() for error, _ in errors], color=plots.BLUE, label="largest error")
    axes.plot(n, [(abs(error) / exact).max() for error, exact in errors], "--", color=plots.ORANGE,
              label="largest relative error")
    axes.plot(n, [schlick_mean_error(x) for x in n], "-.", color=plots.GREEN, label="cosine-weighted mean error")
    axes.axhline(0.01, color=plots.GREY, linewidth=1, linestyle=":", label="1 %")
    plots.style(axes, xscale="log", yscale="log", xlim=(1.02, 5), ylim=(4e-3, 10), xlabel="n",
                ylabel="error of Schlick's F")
    axes.xaxis.set_major_locator(FixedLocator([1.1, 1.33, 1.5, 2, 3, 4, 5]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter("{x:g}")
    axes.legend(fontsize=8, frameon=False, ncols=2, loc="upper right")


def draw_kelemen(figure):
    axes, alphas = figure.subplots(), np.linspace(0.08, 1, 24)
    for angle, colour in ((17, plots.BLUE), (75, plots.ORANGE)):
        for name, key, dashes in (("Smith", GGX, "-"), ("Kelemen", GGX_KELEMEN, "--")):
            axes.plot(alphas, [lobe_albedo(key, np.radians(angle), WHITE, alpha) for alpha in alphas], dashes,
                      color=colour, label=f"{name}, seen at {angle}°")
    plots.style(axes, xlim=(0, 1), ylim=(0, 1.02), xlabel="α", ylabel="white albedo")
    axes.legend(fontsize=8, frameon=False, loc="lower left")


DRAWINGS = {"errata-fresnel.svg": (draw_fresnel, (8.4, 3)), "errata-oren-nayar.svg": (draw_oren_nayar, (8.4, 3)),
            "errata-distributions.svg": (draw_distributions, (5, 3)), "errata-power.svg": (draw_power, (9.6, 2.8)),
            "errata-schlick.svg": (draw_schlick, (5.6, 3.4)), "errata-kelemen.svg": (draw_kelemen, (5, 3.2))}


def main() -> None:
    files.write_text(PAGE, page(PAGE.read_text(encoding="utf-8")))
    for name, (draw, size) in DRAWINGS.items():
        plots.write_svg(FIGURES / name, draw, size)


if __name__ == "__main__":
    main()
