"""Plots of the reference's functions: their values over arrays, one style, and SVG files that tell what they show."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from lobe import reference

from . import files
from .catalogue import WIDTHS

# Distinct in every common form of colour blindness, and on a grey printer (after Okabe and Ito 2008).
BLUE, ORANGE, GREEN, PURPLE, BLACK, GREY = "#0072b2", "#d55e00", "#009e73", "#a0528a", "#222222", "#777777"
CYCLE = (BLUE, ORANGE, GREEN, PURPLE, BLACK)


def evaluated(key: str, *arguments) -> np.ndarray:
    """
    The reference's values of a function, name(type,...), over arrays that broadcast: a float is [...], a vec3 [..., 3].

    A float result is [...], a vector [..., width].
    """
    widths = [WIDTHS[kind] for kind in key[key.index("(") + 1:-1].split(",")]
    arrays = [np.asarray(a, float)[..., None] if w == 1 else np.asarray(a, float) for a, w in zip(arguments, widths)]
    shape = np.broadcast_shapes(*(a.shape[:-1] for a in arrays))
    rows = np.concatenate([np.broadcast_to(a, (*shape, w)) for a, w in zip(arrays, widths)], axis=-1)
    values = reference.evaluate(key, rows.reshape(-1, sum(widths)))
    return values.reshape(shape if values.size == rows[..., 0].size else (*shape, -1))


def style(axes, title: str = "", **settings) -> None:
    """Gives axes their title, labels, limits, and the look of all plots."""
    axes.set(**settings)
    axes.set_title(title, fontsize=10, loc="left")
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)


def degrees(axes, label: str = "angle of incidence [degrees]") -> None:
    """Makes x an angle from 0 to 90 degrees."""
    axes.set(xlim=(0, 90), xticks=range(0, 91, 15), xlabel=label)


def drawn(draw, size):
    """A figure of `size` inches as `draw` draws it."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    draw(figure)
    return figure


def stamp(figure) -> str:
    """What a figure shows, as a short hash of its curves to 5 digits: its file differs between Matplotlibs."""
    digest = hashlib.sha256()
    for line in (line for axes in figure.axes for line in axes.get_lines()):
        for values in (np.asarray(v, float) for v in line.get_data(orig=False)):
            # The offset keeps round numbers, which curves are full of, off the steps.
            largest = np.max(np.abs(values), where=np.isfinite(values), initial=1e-300)
            steps = np.floor(values / largest * 1e5 + 0.382)
            digest.update(np.nan_to_num(steps).astype("<i4").tobytes())
    return "curves " + digest.hexdigest()[:16]


def write_svg(path: Path, draw, size, shown: str | None = None) -> None:
    """Draws as SVG; the same curves give the same file. It says `shown` of itself, or the stamp of its curves."""
    import matplotlib

    figure = drawn(draw, size)
    rc = {"svg.hashsalt": path.stem, "svg.fonttype": "none"}
    with matplotlib.rc_context(rc), files.written_beside(path) as temporary:
        figure.savefig(temporary, format="svg",
                       metadata={"Date": None, "Creator": None, "Description": shown or stamp(figure)})
