"""The pictures of README and docs/pictures.md, drawn by the library itself: python -m lobe.lab.figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lobe import reference

from . import catalogue, compare, figures_curves, files, gl, pictures, plots, scenes
from .paths import ROOT

FIGURES = ROOT / "docs" / "figures"

# What each stands for: the scene, and its material as lobes with the parameters that differ from the scene's.
MATERIALS = {
    "gold": ("gold-teapot-four", {"lobe_GGX": {"alpha": (0.18,)}}),
    "clay": ("bunny-four", {"lobe_OrenNayar_qualitative": {"albedo": (0.62, 0.36, 0.26), "sigma": (0.5,)}}),
    "plastic": ("suzanne-four", {"lobe_Lambert": {"albedo": (0.03, 0.16, 0.42)},
                                 "lobe_GGX": {"f0": (0.04, 0.04, 0.04), "alpha": (0.06,)}}),
}


def lobes(material: str):
    """(scene, [(function, parameter values)]) of a material."""
    scene_name, named = MATERIALS[material]
    scene, library = scenes.find(scene_name), catalogue.load()
    functions = [(library.find(name)[0], settings) for name, settings in named.items()]
    return scene, [(f, compare.parameter_values(f, scene, settings)) for f, settings in functions]


def rendered(material: str, size: int, samples: int = 64) -> np.ndarray:
    """The reference's picture of a material on a grey ground, with shadows, linear [size, size, 3]."""
    scene, parts = lobes(material)
    built, camera = scenes.build(scene, ground=True)
    built.set_material(0, [(f.key, values) for f, values in parts])
    built.set_material(1, scenes.GROUND_MATERIAL)
    return built.beauty(camera, size, size, samples=samples)


def compared(material: str, size: int, context: gl.Context) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The shader's picture, the reference's, and their signed difference in units; linear [size, size, 3]."""
    scene, parts = lobes(material)
    text = catalogue.load().text
    got = expected = unit = 0.0
    for function, values in parts:
        case = compare.shading_case(function, scene, size, values)
        got = got + compare.compare(case, compare.library_shader(function, text, function.name), context).got
        expected, unit = expected + case.reference.value, unit + case.reference.unit
    difference = np.divide(got - expected, unit, out=np.zeros_like(unit), where=unit > 0)
    return tuple(case.picture.picture(x) for x in (got, expected, difference))


def materials(size: int = 400) -> np.ndarray:
    """Gold, clay and plastic side by side."""
    return np.concatenate([pictures.srgb(rendered(m, size)) for m in MATERIALS], axis=1)


def proof(path: Path, size: int = 256) -> None:
    """Shader, reference and difference of each material, one row each."""
    import matplotlib.pyplot as plt

    context = gl.create_context("egl")
    figure, axes = plt.subplots(len(MATERIALS), 3, figsize=(8.4, 8.2), layout="constrained", facecolor="white")
    for row, material in zip(axes, MATERIALS):
        shader, expected, units = compared(material, size, context)
        row[0].imshow(pictures.srgb(shader))
        row[1].imshow(pictures.srgb(expected))
        worst = np.take_along_axis(units, np.abs(units).argmax(-1)[..., None], -1)[..., 0]
        shown = row[2].imshow(worst, cmap="PuOr", vmin=-2, vmax=2)
        row[0].set_ylabel(material, fontsize=13)
        figure.colorbar(shown, ax=row[2], shrink=0.85, label="units of $2^{-24}(1+\\kappa)$")
    for axis, title in zip(axes[0], ("GLSL, float32", "reference, double", "difference")):
        axis.set_title(title, fontsize=13)
    for axis in axes.flat:
        axis.set_xticks([]), axis.set_yticks([])
    with files.written_beside(path) as temporary:
        figure.savefig(temporary, dpi=100)
    plt.close(figure)


# The widths of the strips of teapots; of a brushed metal, along the tangent and across.
ALPHAS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
ALPHAS_XY = ((0.05, 0.5), (0.1, 0.35), (0.2, 0.2), (0.35, 0.1), (0.5, 0.05))


def teapots(lobe_lists, width: int = 220, height: int = 160, samples: int = 64) -> np.ndarray:
    """A teapot on a grey ground for each list of lobes, side by side, linear [height, n width, 3]."""
    built, _ = scenes.build(scenes.find("teapot-four"), ground=True)
    camera = reference.Camera(scenes.EYE, (0.0, -0.05, 0.0), scenes.UP, 18.5)
    built.set_material(1, scenes.GROUND_MATERIAL)

    def one(lobe_list):
        built.set_material(0, lobe_list)
        return built.beauty(camera, width, height, samples=samples)

    return np.concatenate([one(lobe_list) for lobe_list in lobe_lists], axis=1)


def roughness() -> np.ndarray:
    """A blue plastic whose coat grows rougher."""
    body = ("lobe_Lambert(vec3,vec3,vec3,vec3)", {"albedo": (0.03, 0.16, 0.42)})
    return teapots([[body, ("lobe_GGX(vec3,vec3,vec3,vec3,float)", {"f0": (0.04,) * 3, "alpha": alpha})]
                    for alpha in ALPHAS])


def anisotropy() -> np.ndarray:
    """Aluminium brushed along one direction, then not at all, then along the other."""
    f0 = scenes.metal_f0(scenes.METALS / "Al_McPeak.csv")
    key = "lobe_GGX_aniso(vec3,vec3,vec3,vec3,vec3,float,float)"
    return teapots([[(key, {"f0": f0, "alphaX": x, "alphaY": y})] for x, y in ALPHAS_XY])


OREN_NAYAR = "lobe_OrenNayar(vec3,vec3,vec3,vec3,float)"
MOONS = {"Lambert": 0.0, "Oren-Nayar, σ = 0.5": 0.5, "Oren-Nayar, σ = 1": 1.0}


def disc(sigma: float, size: int) -> np.ndarray:
    """A sphere seen and lit from one far place, its centre 1 bright; [size, size, 3]."""
    built = reference.Scene()
    built.add_sphere((0.0, 0.0, 0.0), 1.0)
    built.add_directional_light((0.0, 0.0, 1.0), (1.0, 1.0, 1.0))
    built.set_material(0, [(OREN_NAYAR, {"albedo": (1.0, 1.0, 1.0), "sigma": sigma})])
    camera = reference.Camera((0.0, 0.0, 100.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.25)
    image = built.beauty(camera, size, size, samples=16)
    return image / image[size // 2, size // 2]


def moon(path: Path, size: int = 240) -> None:
    """The full moon's disc by Lambert and Oren-Nayar, and its brightness from limb to limb."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 4, figsize=(11, 3), layout="constrained", width_ratios=(1, 1, 1, 1.4))
    across = np.linspace(-0.9999, 0.9999, 801)
    V = np.stack([-across, 0 * across, np.sqrt(1 - across**2)], -1)  # about a normal along z
    for panel, (name, sigma), colour, dashes in zip(axes, MOONS.items(), plots.CYCLE, ("-", "--", "-.")):
        panel.imshow(pictures.srgb(0.9 * disc(sigma, size)))
        panel.set_title(name, fontsize=10)
        panel.axis("off")
        radiance = plots.evaluated(OREN_NAYAR, (0, 0, 1), V, V, (1, 1, 1), sigma)[:, 0] * V[:, 2]
        axes[3].plot(across, radiance / radiance[400], dashes, color=colour, label=name)
    plots.style(axes[3], xlim=(-1, 1), xticks=(-1, -0.5, 0, 0.5, 1), ylim=(0, 1.05),
                xlabel="place on the disc [radii]", ylabel="brightness / centre's")
    axes[3].legend(fontsize=8, frameon=False, loc="lower center")
    with files.written_beside(path) as temporary:
        figure.savefig(temporary, dpi=100)
    plt.close(figure)


def labelled(strip: np.ndarray, labels) -> np.ndarray:
    """The strip, sRGB-encoded, with a label in the upper left corner of each of its tiles."""
    from matplotlib.font_manager import findfont
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(np.rint(pictures.srgb(strip) * 255).astype(np.uint8))
    font, draw = ImageFont.truetype(findfont("DejaVu Sans"), 14), ImageDraw.Draw(image)
    for i, label in enumerate(labels):
        draw.text((8 + i * image.width // len(labels), 6), label, font=font, fill="black")
    return np.asarray(image)


RENDERS = {"materials.png": materials, "roughness.png": lambda: labelled(roughness(), [f"α = {a:g}" for a in ALPHAS]),
           "anisotropy.png": lambda: labelled(anisotropy(), [f"{x:g} × {y:g}" for x, y in ALPHAS_XY])}


def main() -> None:
    import matplotlib

    matplotlib.use("Agg")
    reference.set_threads(0)
    for name, render in RENDERS.items():
        files.write_png(FIGURES / name, render())
    moon(FIGURES / "moon.png")
    proof(FIGURES / "proof.png")
    figures_curves.main()


if __name__ == "__main__":
    main()
