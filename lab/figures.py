"""The pictures of README and docs, drawn by the library itself: python -m lobe.lab.figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lobe import reference

from . import catalogue, compare, files, gl, pictures, scenes
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


def main() -> None:
    import matplotlib

    matplotlib.use("Agg")
    reference.set_threads(0)
    files.write_png(FIGURES / "materials.png", materials())
    proof(FIGURES / "proof.png")


if __name__ == "__main__":
    main()
