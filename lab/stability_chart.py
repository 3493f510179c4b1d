"""The stability chart: textbook and engine forms of each family beside the library's, over the input that breaks them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lobe import reference

from . import compare, geometry, gl, plots
from .catalogue import Catalogue
from .report import number

NAIVE = Path(__file__).with_name("naive.glsl")
STEPS, SAMPLES = 49, 1 << 10
SEED = 3
SIZE = 12, 20  # of the figure, inches
BROKEN = 1e-2  # relative error at which a form counts as broken
TOP, BOTTOM = 10.0, 1e-8  # of the charts; what is beyond, NaN and Inf among it, is drawn at the top


@dataclass(frozen=True)
class Panel:
    """One family. `draw(rng, x)` gives the inputs at values x of the critical input, float64 [n, width] by name; the
    forms are GLSL in these names, ours the first. The reference is asked for `function` with the same inputs."""

    title: str
    function: str
    axis: str
    low: float
    high: float
    draw: Callable
    forms: dict[str, str]


@dataclass(frozen=True)
class Curves:
    """What a panel shows: x, and per form the largest relative error at each x; infinite for NaN and Inf."""

    panel: Panel
    x: np.ndarray
    errors: dict[str, np.ndarray]

    def breaks(self, form: str) -> float | None:
        """The largest x at which a form is off by more than BROKEN; None where it nowhere is."""
        broken = self.x[self.errors[form] > BROKEN]
        return float(broken.max()) if len(broken) else None

    def verdict(self, form: str) -> str:
        """Where a form breaks, in words."""
        x = self.breaks(form)
        infinite = ", NaN or Inf" if not np.isfinite(self.errors[form]).all() else ""
        return "holds" if x is None else f"1 % off below {number(x, 1)}{infinite}"


def _around(rng: np.random.Generator, axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Unit vectors at angles from unit axes, in any azimuth."""
    side = rng.normal(size=axis.shape)
    side = geometry.normalize(side - axis * geometry.dot(axis, side))
    return axis * np.cos(angle)[:, None] + side * np.sin(angle)[:, None]


def _highlight(rng, alpha):
    """N, V, L about a highlight of a width: H stands off N by a tenth to ten times the width."""
    N = geometry.normalize(rng.normal(size=(len(alpha), 3)))
    H = _around(rng, N, np.minimum(alpha * 10 ** rng.uniform(-1, 1, len(alpha)), 0.7))
    V = _around(rng, H, rng.uniform(0, 0.7, len(alpha)))
    return {"N": N, "V": V, "L": 2 * H * geometry.dot(H, V) - V}


def _opposite(rng, x):
    V = geometry.normalize(rng.normal(size=(len(x), 3)))
    return {"V": V, "L": _around(rng, -V, x)}


def _near_normal(rng, x):
    N = geometry.normalize(rng.normal(size=(len(x), 3)))
    return {"N": N, "V": _around(rng, N, x), "L": _around(rng, N, rng.uniform(0.3, 1.4, len(x))),
            "sigma": np.full((len(x), 1), 0.5)}


def _grazing(rng, x):
    """V at a cosine, L near to it on the other side, as where a low sun shines at the viewer."""
    N = np.broadcast_to([0.0, 0.0, 1.0], (len(x), 3))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    L = _at(x * 10 ** rng.uniform(-0.5, 0.5, len(x)), np.pi + x * rng.uniform(-1, 1, len(x)))
    return {"N": N @ turn, "V": _at(x, 0 * x) @ turn, "L": L @ turn, "f0": np.full((len(x), 3), 0.04),
            "alpha": 10 ** rng.uniform(-1, 0, (len(x), 1))}


def _at(cosine, azimuth):
    cosine = np.minimum(cosine, 1.0)
    sine = np.sqrt((1 - cosine) * (1 + cosine))
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], -1)


def _pole(rng, x):
    azimuth = rng.uniform(0, 2 * np.pi, len(x))
    cosines = dict(zip(("TdotH", "BdotH", "NdotH"), _at(np.sqrt((1 - x) * (1 + x)), azimuth).T[..., None]))
    return cosines | {"nu": np.full((len(x), 1), 100.0), "nv": np.full((len(x), 1), 1000.0)}


_H = "lobe_H(V, L)"
PANELS = (
    Panel("GGX: D", "lobe_D_GGX(vec3,vec3,float)", "alpha", 1e-4, 1.0,
          lambda rng, x: _highlight(rng, x) | {"alpha": x[:, None]},
          {"Lobe": f"lobe_D_GGX(N, {_H}, alpha)", "c² (α² − 1) + 1": "ggx_lecture(N, V, L, alpha)",
           "(c α² − c) c + 1": "ggx_nested(N, V, L, alpha)", "(1 − c²) + α² c²": "ggx_sine_first(N, V, L, alpha)",
           "tan²": "ggx_tangent(N, V, L, alpha)", "|n × h|², capped": "ggx_cross_capped(N, V, L, alpha)"}),
    Panel("Beckmann: D", "lobe_D_Beckmann(vec3,vec3,float)", "alpha", 1e-4, 1.0,
          lambda rng, x: _highlight(rng, x / 3) | {"alpha": x[:, None]},
          {"Lobe": f"lobe_D_Beckmann(N, {_H}, alpha)", "(1 − c²) / c²": "beckmann_tangent(N, V, L, alpha)",
           "tan(acos c)": "beckmann_angle(N, V, L, alpha)"}),
    Panel("Blinn-Phong: D", "lobe_D_BlinnPhong(vec3,vec3,float)", "alpha", 2e-3, 1.0,
          lambda rng, x: _highlight(rng, x / 3) | {"exponent": np.maximum(2 / x**2 - 2, 1)[:, None]},
          {"Lobe": f"lobe_D_BlinnPhong(N, {_H}, exponent)", "pow(c, e)": "blinn_phong_pow(N, V, L, exponent)"}),
    Panel("whole GGX lobe", "lobe_GGX(vec3,vec3,vec3,vec3,float)", "alpha", 1e-4, 1.0,
          lambda rng, x: _highlight(rng, x) | {"alpha": x[:, None], "f0": np.full((len(x), 3), 0.04)},
          {"Lobe": "lobe_GGX(N, V, L, f0, alpha).x", "F D G / (4 n·v n·l)": "ggx_textbook(N, V, L, f0.x, alpha)"}),
    Panel("Cook-Torrance, against the light", "lobe_CookTorrance(vec3,vec3,vec3,vec3,float)", "cosine of v", 1e-4, 0.3,
          _grazing, {"Lobe": "lobe_CookTorrance(N, V, L, f0, alpha).x",
                     "F D G / (4 n·v n·l)": "cook_torrance_textbook(N, V, L, f0.x, alpha)"}),
    Panel("dielectric: F near a matched index", "lobe_F_dielectric(float,float)", "|η − 1|", 1e-6, 1.0,
          lambda rng, x: {"cosI": 0.1 + 0.9 * rng.random((len(x), 1)), "eta": 1 + x[:, None]},
          {"Lobe": "lobe_F_dielectric(cosI, eta)", "Cook-Torrance's g": "fresnel_cook_torrance(cosI, eta)",
           "amplitudes": "fresnel_amplitudes(cosI, eta)", "sines and tangents": "fresnel_sines(cosI, eta)"}),
    Panel("dielectric: transmitted, near grazing", "lobe_T_dielectric(float,float)", "cosine", 1e-6, 1.0,
          lambda rng, x: {"cosI": x[:, None], "eta": rng.uniform(1.1, 3, (len(x), 1))},
          {"Lobe": "lobe_T_dielectric(cosI, eta)", "1 − F, Cook-Torrance's g": "1.0 - fresnel_cook_torrance(cosI, eta)",
           "1 − F, Lobe's F": "1.0 - lobe_F_dielectric(cosI, eta)"}),
    Panel("dielectric: refracted cosine, near grazing", "lobe_cosT(float,float)", "η − 1", 1e-6, 1.0,
          lambda rng, x: {"cosI": 10 ** rng.uniform(-4, -2, (len(x), 1)), "eta": 1 + x[:, None]},
          {"Lobe": "lobe_cosT(cosI, eta)", "√(1 − (1 − c²) / η²)": "refracted_root(cosI, eta)",
           "cos(asin(sin(acos c) / η))": "refracted_angle(cosI, eta)"}),
    Panel("conductor: F at a matched index", "lobe_F_conductor(float,float,float)", "k", 1e-5, 1.0,
          lambda rng, x: {"cosI": 0.1 + 0.9 * rng.random((len(x), 1)), "eta": np.ones((len(x), 1)), "k": x[:, None]},
          {"Lobe": "lobe_F_conductor(cosI, eta, k)", "squares": "conductor_squares(cosI, eta, k)"}),
    Panel("l·h, light behind", "lobe_LdotH(vec3,vec3)", "angle of l from −v [rad]", 1e-5, 1.0, _opposite,
          {"Lobe": "lobe_LdotH(V, L)", "dot(l, normalize(l + v))": "half_dot(V, L)",
           "√(½ + ½ l·v)": "half_root(V, L)"}),
    Panel("Kelemen's V, light behind", "lobe_V_Kelemen(vec3,vec3)", "angle of l from −v [rad]", 1e-5, 1.0, _opposite,
          {"Lobe": "lobe_V_Kelemen(V, L)", "1 / (4 (l·h)²)": "kelemen_dot(V, L)", "½ / (1 + l·v)": "kelemen_sum(V, L)"}),
    Panel("Smith-GGX: G1, grazing", "lobe_G1_GGX(float,float)", "cosine", 1e-6, 1.0,
          lambda rng, x: {"NdotX": x[:, None], "alpha": 10 ** rng.uniform(-3, 0, (len(x), 1))},
          {"Lobe": "lobe_G1_GGX(NdotX, alpha)", "(1 − c²) / c²": "g1_tangent(NdotX, alpha)",
           "tan(acos c)": "g1_angle(NdotX, alpha)"}),
    Panel("Oren-Nayar, seen from above", "lobe_OrenNayar_qualitative(vec3,vec3,vec3,vec3,float)",
          "angle of v from n [rad]", 1e-6, 1.0, lambda rng, x: _near_normal(rng, x) | {"albedo": np.ones((len(x), 3))},
          {"Lobe": "lobe_OrenNayar_qualitative(N, V, L, albedo, sigma).x",
           "project, normalize, acos": "oren_nayar_angles(N, V, L, sigma)"}),
    Panel("EON: 1 − E, grazing", "lobe_loss_EON(float)", "cosine", 1e-6, 1.0, lambda rng, x: {"NdotX": x[:, None]},
          {"Lobe": "lobe_loss_EON(NdotX)", "as published": "eon_loss_listing(NdotX)"}),
    Panel("Ashikhmin-Shirley: D, at the pole", "lobe_D_AshikhminShirley(float,float,float,float,float)", "sine of h from n",
          1e-6, 0.3, _pole, {"Lobe": "lobe_D_AshikhminShirley(NdotH, TdotH, BdotH, nu, nv)",
                             "… / (1 − c²)": "ashikhmin_shirley_listing(NdotH, TdotH, BdotH, nu, nv)"}),
)


def measured(library: Catalogue, context: gl.Context) -> list[Curves]:
    """Each panel whose function the library has, as a context computes its forms."""
    source = library.text + NAIVE.read_text(encoding="utf-8")
    known = {f.key for f in library.functions}
    return [_curves(library, panel, source, context) for panel in PANELS if panel.function in known]


def _curves(library: Catalogue, panel: Panel, source: str, context: gl.Context) -> Curves:
    x = np.geomspace(panel.low, panel.high, STEPS)
    inputs = {name: np.asarray(value, np.float32) for name, value in
              panel.draw(np.random.default_rng(SEED), np.repeat(x, SAMPLES)).items()}
    expected = _exact(library, panel, inputs)
    errors = {}
    for label, call in panel.forms.items():
        with context:
            got = gl.evaluate(context, source, call, "float", {name: v[None] for name, v in inputs.items()})[:, 0]
        with np.errstate(invalid="ignore"):
            relative = np.abs(got.astype(float) - expected) / np.maximum(expected, compare.SMALLEST_REFERENCE)
        relative = np.where(np.isfinite(got), relative, np.inf)
        errors[label] = np.where(expected > 0, relative, 0.0).reshape(STEPS, SAMPLES).max(1)
    return Curves(panel, x, errors)


def _exact(library: Catalogue, panel: Panel, inputs: dict[str, np.ndarray]) -> np.ndarray:
    """The reference at the float32 inputs; H from V and L of unit length."""
    (function,) = library.find(panel.function)
    exact = {name: v.astype(float) for name, v in inputs.items()}
    if function.parameter("H"):
        exact["H"] = geometry.normalize(exact["V"]) + geometry.normalize(exact["L"])
    packed = np.hstack([exact[p.name] for p in function.parameters])
    return reference.evaluate(function.key, np.ascontiguousarray(packed))[:, 0]


def draw(figure, curves: list[Curves]) -> None:
    """All panels, log-log."""
    from matplotlib.ticker import LogLocator

    panels = figure.subplots(-(-len(curves) // 3), 3, squeeze=False)
    for axes in panels.flat[len(curves):]:
        axes.axis("off")
    colours = (plots.BLUE, plots.ORANGE, plots.GREEN, plots.PURPLE, plots.BLACK, plots.GREY)
    for axes, curve in zip(panels.flat, curves):
        for (label, error), colour in reversed(list(zip(curve.errors.items(), colours))):
            ours = label == "Lobe"
            shown = np.clip(error, 2 * BOTTOM, TOP / 2)
            axes.plot(curve.x, shown, color=colour, linewidth=2.4 if ours else 1.2, linestyle="-" if ours else "--",
                      label=f"{label}: {curve.verdict(label)}")
            beyond = ~np.isfinite(error)
            axes.plot(curve.x[beyond], np.full(beyond.sum(), TOP / 2), "x", color=colour, markersize=4)
        axes.axhline(BROKEN, color=plots.GREY, linewidth=0.8, linestyle=":")
        plots.style(axes, curve.panel.title, xscale="log", yscale="log", ylim=(BOTTOM, TOP), xlabel=curve.panel.axis,
                    xlim=(curve.panel.low, curve.panel.high))
        axes.yaxis.set_major_locator(LogLocator(numticks=6))
        handles, labels = axes.get_legend_handles_labels()
        axes.legend(handles[::-1], labels[::-1], fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(-0.02, -0.16))
    for axes in panels[:, 0]:
        axes.set_ylabel("largest relative error")

