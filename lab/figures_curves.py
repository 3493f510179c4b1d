"""The plots of docs/pictures.md, of the reference's functions: python -m lobe.lab.figures_curves."""

from __future__ import annotations

import numpy as np

from . import plots, spectra
from .paths import DATA, ROOT
from .plots import evaluated

FIGURES = ROOT / "docs" / "figures"

ANGLES = np.degrees(np.pi / 2 * np.sin(np.linspace(0, np.pi / 2, 201)))  # dense where Fresnel's curves are steep
COSINES = np.cos(np.radians(ANGLES))


def draw_dielectric(figure):
    """Reflectance from the thin side, 1 to 2, and from the dense side, 2 to 1, by polarisation."""
    titles = "1 → 2, from air into glass, n = 1 : 1.5", "2 → 1, from glass into air, n = 1.5 : 1"
    for axes, eta, title in zip(figure.subplots(1, 2, sharey=True), (1.5, 1 / 1.5), titles):
        both = evaluated("lobe_F_dielectric_sp(float,float)", COSINES, eta)
        for name, values, colour, dashes in (("s", both[:, 0], plots.ORANGE, "--"),
                                             ("p", both[:, 1], plots.GREEN, "-."),
                                             ("unpolarised", both.mean(1), plots.BLUE, "-")):
            axes.plot(ANGLES, values, dashes, color=colour, label=name)
        plots.style(axes, title, ylim=(0, 1.02))
        plots.degrees(axes)
        marks = [("Brewster's angle", np.degrees(np.arctan(eta)))]
        marks += [("critical angle", np.degrees(np.arcsin(eta)))] if eta < 1 else []
        for (name, angle), (side, shift) in zip(marks, (("right", -3), ("left", 3))):
            axes.axvline(angle, color=plots.GREY, linewidth=1, linestyle=":")
            axes.annotate(f"{name} {angle:.1f}°", (angle, 0.5), (shift, 0), textcoords="offset points", rotation=90,
                          ha=side, va="center", fontsize=8, color=plots.BLACK)
    figure.axes[0].set_ylabel("reflectance F")
    figure.axes[0].legend(fontsize=8, frameon=False, loc="upper left")


def _metal(table: str, nm: int):
    n, k = spectra.sampled(DATA / "ior" / f"{table}.csv")
    return n[nm - 380], k[nm - 380]


def draw_schlick(figure):
    """Exact and by Schlick, dielectrics and metals, and the difference below."""
    dielectrics = {f"n = {n}": (n, 0.0) for n in (1.33, 1.5, 2.0, 4.0)}
    tables = {"silver": "Ag_Johnson", "gold": "Au_Johnson", "iron": "Fe_Johnson", "zinc": "Zn_Werner-DFT"}
    metals = {f"{name}, 550 nm": _metal(table, 550) for name, table in tables.items()}
    panels = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(2, 1.2))
    for (above, below), title, indices in zip(panels.T, ("dielectrics", "metals"), (dielectrics, metals)):
        for (name, (n, k)), colour in zip(indices.items(), plots.CYCLE):
            exact = evaluated("lobe_F_conductor(float,float,float)", COSINES, n, k)
            schlick = evaluated("lobe_F_Schlick(float,float)", COSINES, spectra.reflectance(n, k))
            above.plot(ANGLES, exact, color=colour, linewidth=1.6, label=name)
            above.plot(ANGLES, schlick, "--", color=colour, linewidth=1)
            below.plot(ANGLES, schlick - exact, color=colour, linewidth=1.2)
        above.plot([], [], "--", color=plots.GREY, linewidth=1, label="Schlick")
        plots.style(above, title, ylim=(0, 1.02))
        plots.style(below)
        plots.degrees(below)
        above.legend(fontsize=8, frameon=False, loc="upper left" if title == "dielectrics" else "lower left")
    panels[0, 0].set_ylabel("F")
    panels[1, 0].set_ylabel("Schlick − exact")


def draw_distributions(figure):
    """Three distributions of one width, by the tilt of the facet."""
    tilt = np.linspace(0, 90, 361)
    NdotH = np.cos(np.radians(tilt))
    for axes, alpha in zip(figure.subplots(1, 3, sharey=True), (0.1, 0.3, 0.6)):
        exponent = evaluated("lobe_exponent(float)", alpha)
        for name, key, shape, colour, dashes in (
                ("GGX", "lobe_D_GGX(float,float)", alpha, plots.BLUE, "-"),
                ("Beckmann", "lobe_D_Beckmann(float,float)", alpha, plots.ORANGE, "--"),
                ("Blinn-Phong", "lobe_D_BlinnPhong(float,float)", exponent, plots.GREEN, "-.")):
            D = evaluated(key, NdotH, shape)
            axes.plot(tilt, np.where(D > 1e-7, D, np.nan), dashes, color=colour, label=name)
        plots.style(axes, f"α = {alpha}, exponent {float(exponent):.3g}", yscale="log", ylim=(1e-5, 100))
        plots.degrees(axes, "tilt of the facet [degrees]")
    figure.axes[0].set_ylabel("D [1/sr]")
    figure.axes[0].legend(fontsize=8, frameon=False)


def draw_masking(figure):
    """G1 of Smith for two distributions, and G of four models for a fixed light."""
    one, *two = figure.subplots(1, 3, sharey=True)
    for alpha, colour in ((0.2, plots.BLUE), (0.5, plots.GREEN), (1.0, plots.ORANGE)):
        for name, dashes in (("GGX", "-"), ("Beckmann", "--")):
            one.plot(ANGLES, evaluated(f"lobe_G1_{name}(float,float)", COSINES, alpha), dashes, color=colour,
                     label=f"{name}, α = {alpha}")
    plots.style(one, "G1 of Smith", ylabel="G", ylim=(0, 1.02))
    plots.degrees(one, "angle of view [degrees]")
    one.legend(fontsize=8, frameon=False, loc="lower left")

    view = np.linspace(-90, 90, 721)
    for axes, light in zip(two, (30, 75)):
        NdotV, NdotL = np.cos(np.radians(view)), np.cos(np.radians(light))
        half = np.radians(view - light) / 2  # the light is on the side of the negative angles
        NdotH, VdotH = np.cos(half), np.cos(np.radians(view + light) / 2)
        ggx, beckmann = (evaluated(f"lobe_G2_{name}(float,float,float)", NdotV, NdotL, 0.5)
                         for name in ("GGX", "Beckmann"))
        grooves = evaluated("lobe_G_Vgroove(float,float,float,float)", NdotV, NdotL, NdotH, VdotH)
        kelemen = 4 * NdotV * NdotL * evaluated("lobe_V_Kelemen(float)", VdotH)
        for name, G, colour, dashes in (("GGX, α = 0.5", ggx, plots.BLUE, "-"),
                                        ("Beckmann, α = 0.5", beckmann, plots.ORANGE, "--"),
                                        ("V-grooves", grooves, plots.GREEN, "-."),
                                        ("Kelemen", kelemen, plots.PURPLE, ":")):
            axes.plot(view, G, dashes, color=colour, label=name, linewidth=1.8 if dashes == ":" else 1.5)
        plots.style(axes, f"G, light at −{light}°", xlim=(-90, 90), xticks=range(-90, 91, 30),
                    xlabel="angle of view [degrees]")
    two[0].legend(fontsize=8, frameon=False, loc="lower center")


DRAWINGS = {"fresnel-dielectric.svg": (draw_dielectric, (9, 3.6)), "fresnel-schlick.svg": (draw_schlick, (9, 5)),
            "distributions.svg": (draw_distributions, (10, 3.2)), "masking.svg": (draw_masking, (10.4, 3.4))}


def main() -> None:
    for name, (draw, size) in DRAWINGS.items():
        plots.write_svg(FIGURES / name, draw, size)


if __name__ == "__main__":
    main()
