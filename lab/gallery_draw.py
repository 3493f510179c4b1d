"""Pictures of the gallery: the teapot, polar plots, the history of models, highlights over grooves."""

from __future__ import annotations

import io
from functools import cache
from pathlib import Path

import numpy as np

from lobe import reference

from . import files, geometry, highlights, pictures, plots, probes, scenes
from .catalogue import Function
from .gallery import ANGLES, GROUPS, SWEEP, Exhibit, Shades, authors, group, look, models, peaks, year

SAMPLES = 2  # of a pixel, along each side
DIRECTIONS, FILL = 64, 0.5  # that stand for the probe, and the part of its light that falls beside the key light
KEY = ((-0.35, 0.75, 0.9), (2.2, 2.2, 2.2))
SHAPE = 0.72  # a picture's height over its width
FOV = 17.0  # degrees; what the teapot fills
PAPER, INK = (247, 247, 243), (28, 28, 26)
LEAST, MOST = 1e-4, 1e3  # f at the centre and the rim of a logarithmic plot, 1/sr
COLOURS = (plots.BLUE, plots.GREEN, plots.ORANGE, plots.PURPLE)


@cache
def pixels(width: int) -> scenes.Pixels:
    """The teapot in the light of a hall and of one lamp, SAMPLES rays along each side of a pixel."""
    built = scenes.bare(scenes.SHAPES["teapot"])
    towards, irradiance = probes.lights(probes.load(scenes.RIGS["lobby"].probe), DIRECTIONS)
    for d, e in zip(towards.tolist(), (FILL * irradiance).tolist()):
        built.add_directional_light(tuple(d), tuple(e))
    built.add_directional_light(*KEY)
    camera = reference.Camera(scenes.EYE, (0.07, -0.06, 0.0), scenes.UP, FOV)
    size = SAMPLES * width, SAMPLES * round(SHAPE * width)
    return scenes.seen(built.trace(camera, *size, shadows=True))


def teapot(exhibit: Exhibit, shade: Shades, width: int) -> np.ndarray:
    """sRGB-encoded [h, w, 3] uint8, the tangents of an anisotropic lobe drawn on it."""
    seen = pixels(width)
    f = shade(exhibit.function, look(exhibit.function), seen.N, seen.T, seen.V, seen.L, seen.E)
    colours = np.where(seen.mask[..., None], pictures.srgb(seen.picture(f)), np.array(PAPER) / 255)
    h, w = (n // SAMPLES for n in seen.mask.shape)
    image = np.rint(255 * colours.reshape(h, SAMPLES, w, SAMPLES, 3).mean((1, 3))).astype(np.uint8)
    return tangents(image, seen) if exhibit.elongation else image


def tangents(image: np.ndarray, seen: scenes.Pixels, apart: int = 17, length: float = 0.7) -> np.ndarray:
    """The picture with a stroke along T every `apart` pixels."""
    from PIL import Image, ImageDraw

    forward = geometry.normalize(np.array(scenes.TARGET) - scenes.EYE)
    right = geometry.normalize(np.cross(forward, scenes.UP))
    across = np.stack([seen.T @ right, -(seen.T @ np.cross(right, forward))], -1)  # the picture's rows run down
    field = seen.picture(across)
    drawn = Image.fromarray(image)
    pen = ImageDraw.Draw(drawn, "RGBA")
    for y in range(apart // 2, image.shape[0], apart):
        for x in range(apart // 2, image.shape[1], apart):
            row, column = SAMPLES * y, SAMPLES * x
            around = seen.mask[max(row - 6, 0):row + 7, max(column - 6, 0):column + 7]
            if around.all():
                dx, dy = field[row, column] * length * apart / 2
                pen.line((x - dx, y - dy, x + dx, y + dy), fill=(20, 20, 20, 190), width=1)
    return np.asarray(drawn)


# Polar plots

def draw_polar(axes, radii: np.ndarray, rings: dict[float, str], title: str) -> None:
    """Curves over the direction of L, as radii 0..1; what is more is not drawn. V comes from the left."""
    for angle in range(-90, 91, 30):
        s, c = np.sin(np.radians(angle)), np.cos(np.radians(angle))
        axes.plot((0, s), (0, c), color="#dddddd", linewidth=0.6, zorder=0)
        if abs(angle) < 90:
            axes.text(1.08 * s, 1.07 * c, f"{abs(angle)}°", ha="center", va="center", fontsize=6, color=plots.GREY)
    arc = np.radians(np.linspace(-90, 90, 91))
    for r, text in rings.items():
        axes.plot(r * np.sin(arc), r * np.cos(arc), color="#dddddd" if r < 1 else "#aaaaaa", linewidth=0.6, zorder=0)
        axes.text(r, -0.03, text, ha="center", va="top", fontsize=6, color=plots.GREY)
    theta = np.radians(SWEEP)
    for angle, r, colour in zip(ANGLES, np.where(radii > 1.0001, np.nan, radii), COLOURS):
        axes.plot(r * np.sin(theta), r * np.cos(theta), color=colour, linewidth=1.1)
        s, c = np.sin(np.radians(angle)), np.cos(np.radians(angle))
        axes.annotate("", (-0.93 * s, 0.93 * c), (-s, c), zorder=3,
                      arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 0.8, "mutation_scale": 7})
    axes.set(xlim=(-1.12, 1.12), ylim=(-0.14, 1.12), aspect="equal")
    axes.text(0, -0.22, title, fontsize=7, ha="center", va="top", transform=axes.transData)
    axes.axis("off")


def polar_figure(figure, curves: np.ndarray) -> None:
    """On the left each curve over its own peak, on the right all by one logarithmic scale."""
    figure.set_facecolor(np.array(PAPER) / 255)
    linear, logarithmic = figure.subplots(1, 2)
    top = peaks(curves)
    draw_polar(linear, curves / np.where(top > 0, top, 1)[:, None], {0.5: "½", 1.0: "peak"}, "")
    linear.text(-1.1, -0.2, "f / peak", fontsize=6.5, va="top")
    for i, (angle, value, colour) in enumerate(zip(ANGLES, top, COLOURS)):
        linear.text(-0.66 + 0.47 * i, -0.2, f"{angle}°: {value:.{3 if value >= 1 else 2}g}", fontsize=6.5, va="top", color=colour)
    span = np.log(MOST / LEAST)
    rings = {np.log(10.0**e / LEAST) / span: f"$10^{{{e}}}$" if e % 2 else "" for e in range(-3, 4)}
    draw_polar(logarithmic, np.log(np.clip(curves, LEAST, None) / LEAST) / span, rings, "f [1/sr], logarithmic")


POLAR_SIZE = (5.4, 1.75)  # inches


def write_polar(path: Path, curves: np.ndarray) -> None:
    plots.write_svg(path, lambda figure: polar_figure(figure, curves), POLAR_SIZE)


def bitmap(draw, size, dpi: int = 100) -> np.ndarray:
    """What `draw` draws, [h, w, 3] uint8 on PAPER."""
    from PIL import Image

    memory = io.BytesIO()
    plots.drawn(draw, size).savefig(memory, format="png", dpi=dpi)
    return np.asarray(Image.open(memory).convert("RGB"))


def card(exhibit: Exhibit, picture: np.ndarray) -> np.ndarray:
    """Teapot and polar plots side by side."""
    plot = bitmap(lambda figure: polar_figure(figure, exhibit.curves), POLAR_SIZE)
    height = max(len(plot), len(picture))
    return np.concatenate([_centred(picture, height), _centred(plot, height)], axis=1)


def _centred(image: np.ndarray, height: int) -> np.ndarray:
    above = (height - len(image)) // 2
    canvas = np.full((height, *image.shape[1:]), PAPER, np.uint8)
    canvas[above:above + len(image)] = image
    return canvas


def write_small_png(path: Path, image: np.ndarray, colours: int = 160) -> None:
    """A PNG of few colours: a third of the size."""
    from PIL import Image

    small = Image.fromarray(np.ascontiguousarray(image)).quantize(colours, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    with files.written_beside(path) as temporary:
        small.save(temporary, "PNG", optimize=True)


# The history

FIRST, LAST = 1965, 2027
THUMB, LINE = 84, 12  # pixels: a teapot's width, a line of text


def history(exhibits: list[Exhibit], teapots: dict[str, np.ndarray], width: int = 1200) -> np.ndarray:
    """Every model at the year of its publication, in the lane of its group, shown by the plainest of its lobes."""
    from PIL import Image, ImageDraw

    lanes: dict[str, list] = {}
    for variants in sorted(models(tuple(e.function for e in exhibits)), key=lambda v: year(v[0])):
        lanes.setdefault(group(variants[0]), []).append(variants)
    step = round(SHAPE * THUMB) + 2 * LINE + 8
    placed = {title: _packed([_caption(v) for v in lanes[title]], [year(v[0]) for v in lanes[title]], width)
              for title in sorted(lanes, key=lambda g: [*GROUPS, g].index(g))}
    heights = {title: 24 + step * (1 + max(row for _, row in spots)) for title, spots in placed.items()}
    image = Image.new("RGB", (width, 24 + sum(heights.values())), PAPER)
    pen, top = ImageDraw.Draw(image), 24
    for tick in (1760, *range(1970, LAST, 5)):
        pen.line((position(tick, width), 18, position(tick, width), image.height), fill=(225, 225, 220))
        pen.text((position(tick, width), 4), str(tick), font=_font(10), fill=INK, anchor="ma")
    for title, spots in placed.items():
        pen.line((0, top, width, top), fill=(170, 170, 165))
        pen.text((6, top + 4), title, font=_font(12, "bold"), fill=INK)
        for variants, (centre, row) in zip(lanes[title], spots):
            y = top + 22 + row * step
            small = Image.fromarray(teapots[variants[0].name]).resize((THUMB, round(SHAPE * THUMB)), Image.Resampling.LANCZOS)
            image.paste(small, (round(centre - THUMB / 2), y))
            for i, (text, colour) in enumerate(zip(_caption(variants), (INK, (110, 110, 105)))):
                pen.text((centre, y + small.height + i * LINE), text, font=_font(10), fill=colour, anchor="ma")
        top += heights[title]
    return np.asarray(image)


def _caption(variants: list[Function]) -> tuple[str, str]:
    more = f" and {len(variants) - 1} more" if len(variants) > 1 else ""
    return variants[0].name.removeprefix("lobe_") + more, f"{year(variants[0])}, {authors(variants[0])}"


def _packed(captions: list[tuple[str, str]], years: list[int], width: int) -> list[tuple[float, int]]:
    """(centre, row) of each, in the first row where it meets no other."""
    spots, ends = [], {}
    for caption, when in zip(captions, years):
        half = max(THUMB, *(_font(10).getlength(text) for text in caption)) / 2 + 5
        centre = min(max(position(when, width), half), width - half)
        row = next(r for r in range(len(captions) + 1) if ends.get(r, 0) <= centre - half)
        ends[row] = centre + half
        spots.append((centre, row))
    return spots


@cache
def _font(size: int, weight: str = "regular"):
    from matplotlib.font_manager import findfont
    from PIL import ImageFont

    return ImageFont.truetype(findfont(f"DejaVu Sans:{weight}"), size)


def position(when: int, width: int) -> float:
    """Where a year lies; those before FIRST at the left edge."""
    return 45.0 if when < FIRST else 100 + (when - FIRST) / (LAST - FIRST) * (width - 150)


# Highlights

def highlights_figure(figure, exhibits: list[Exhibit], shade: Shades) -> None:
    """The highlight of each anisotropic lobe on a plane, the grooves that it stands for, and a plane that has them."""
    figure.set_facecolor(np.array(PAPER) / 255)
    shown = [e for e in exhibits if e.elongation]
    panels = figure.subplots(-(-(len(shown) + 1) // 5), 5, squeeze=False).flat
    grooved = highlights.grooves()
    _highlight(next(panels), grooved, highlights.elongation(grooved), "a plane with grooves along B")
    for e in shown:
        image = highlights.picture(e.function, look(e.function), shade)
        _highlight(next(panels), image, e.elongation, e.function.name.removeprefix("lobe_"))
    for axes in panels:
        axes.axis("off")


def _highlight(axes, image: np.ndarray, found: highlights.Elongation, title: str) -> None:
    reach = highlights.REACH
    axes.imshow(pictures.srgb(image / image.max()), cmap="gray", vmin=0, vmax=1, extent=(-reach, reach, -reach, reach))
    axes.contour(np.flipud(image), levels=[image.max() / 2], colors=plots.ORANGE, linewidths=1,
                 extent=(-reach, reach, -reach, reach))
    for x in np.linspace(-reach, reach, 13) if found.axis else ():  # the grooves run along the short axis
        line = {"color": "#4f90c8", "linewidth": 0.5, "alpha": 0.7}
        axes.axvline(x, **line) if found.axis == "T" else axes.axhline(x, **line)
    for name, end in (("T", (0.5, 0)), ("B", (0, 0.5))):
        corner = np.array((-1.05, -1.05))
        axes.annotate("", corner + end, corner, arrowprops={"arrowstyle": "-|>", "color": "white", "linewidth": 1.2})
        axes.text(*(corner + np.array(end) * 1.25), name, color="white", fontsize=8, ha="center", va="center")
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), xticks=(), yticks=())
    long = f"{found.ratio:.2g} : 1 along {found.axis}" if found.axis else "round"
    axes.set_title(f"{title}\n{long}", fontsize=7)


def highlights_size(exhibits: list[Exhibit]) -> tuple[float, float]:
    return 9.0, 2.1 * -(-(sum(bool(e.elongation) for e in exhibits) + 1) // 5)
