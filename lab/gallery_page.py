"""What the gallery writes: a page that needs no other file, and docs/gallery.md.

    python -m lobe.lab.gallery_page

writes docs/gallery.md, its pictures and benchmarks/results/gallery.json again.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

from markupsafe import Markup

from . import catalogue, files, gallery, gallery_draw, gl, highlights, papers, pictures, plots
from .gallery import Exhibit, Shades
from .paths import ROOT
from .report import environment

PAGE = ROOT / "docs" / "gallery.md"
FIGURES = ROOT / "docs" / "figures" / "gallery"
RESULTS = ROOT / "benchmarks" / "results" / "gallery.json"
WIDTH, CARD = 240, 200  # pixels, of a teapot on the page, and of one in the document
COMMAND = "python -m lobe.lab.gallery_page"


def write(shown: list[Exhibit], shade: Shades, out: Path, size: int = WIDTH,
          on_step: Callable[[str, int, int], None] = lambda name, done, of: None) -> Path:
    """Writes index.html, and beside it each teapot as PNG and each polar plot as SVG."""
    cards, teapots = [], {}
    for done, e in enumerate(shown):
        name = e.function.name
        on_step(f"{name} on the teapot", done, len(shown))
        teapots[name] = gallery_draw.teapot(e, shade, size)
        files.write_png(out / f"{name}.png", teapots[name] / 255)
        gallery_draw.write_polar(out / f"{name}.svg", e.curves)
        cards.append((e, pictures.data_uri(teapots[name]), inline(out / f"{name}.svg", name)))
    history = gallery_draw.history(shown, teapots)
    files.write_png(out / "history.png", history / 255)
    direction = ""
    if any(e.elongation for e in shown):
        plots.write_svg(out / "highlights.svg", lambda f: gallery_draw.highlights_figure(f, shown, shade),
                        gallery_draw.highlights_size(shown))
        direction = inline(out / "highlights.svg", "highlights")
    page = out / "index.html"
    files.write_text(page, environment().get_template("gallery.html.j2").render(
        groups=grouped(cards), history=pictures.data_uri(history), highlights=direction, gallery=gallery,
        sentence=sentence, draw=gallery_draw, renderer=shade.context.renderer, own=own_grooves()))
    return page


def inline(path: Path, name: str) -> Markup:
    """An SVG file as an element of a page; its ids, which Matplotlib repeats from file to file, are made its own."""
    text = path.read_text(encoding="utf-8")
    text = text[text.index("<svg"):]
    text = re.sub(r'\bid="([^"]+)"', rf'id="{name}-\1"', text)
    return Markup(re.sub(r'(url\(#|href="#)', rf"\1{name}-", text))


def grouped(cards: list[tuple]) -> dict[str, list[tuple]]:
    groups: dict[str, list[tuple]] = {}
    for card in cards:
        groups.setdefault(gallery.group(card[0].function), []).append(card)
    return groups


def sentence(e: Exhibit) -> str:
    return highlights.sentence(e.function, gallery.look(e.function), e.elongation) if e.elongation else ""


def own_grooves() -> str:
    """What the plane that has grooves shows."""
    found = highlights.elongation(highlights.grooves())
    return (f"A plane with grooves along B, whose sides shine narrowly, has a highlight {found.ratio:.2g} times as long "
            f"along {found.axis}: across the grooves.")


def markdown(results: dict) -> str:
    """docs/gallery.md, from the headers and benchmarks/results/gallery.json."""
    library = catalogue.load()
    shown = [library.find(name)[0] for name in results["lobes"]]
    groups: dict[str, list] = {}
    for f in shown:
        groups.setdefault(gallery.group(f), []).append((f, results["lobes"][f.name]))
    return environment().overlay(autoescape=False).get_template("gallery.md.j2").render(
        groups=groups, results=results, gallery=gallery, command=COMMAND, draw=gallery_draw, linked=papers.linked,
        directed={f: r["direction"] for f in shown if "direction" in (r := results["lobes"][f.name])})


def measured(shown: list[Exhibit], shade: Shades) -> dict:
    """What benchmarks/results/gallery.json holds."""
    lobes = {e.function.name: e.facts | ({"direction": sentence(e)} if e.elongation else {}) for e in shown}
    return {"renderer": shade.context.renderer, "grooves": own_grooves(), "lobes": lobes}


def write_document(shown: list[Exhibit], shade: Shades) -> None:
    teapots = {e.function.name: gallery_draw.teapot(e, shade, CARD) for e in shown}
    for e in shown:
        gallery_draw.write_small_png(figure(e.function), gallery_draw.card(e, teapots[e.function.name]))
    for left in FIGURES.glob("*.png"):
        if left.stem not in (*(figure(e.function).stem for e in shown), "history", "highlights"):
            left.unlink()
    gallery_draw.write_small_png(FIGURES / "history.png", gallery_draw.history(shown, teapots))
    highlit = gallery_draw.bitmap(lambda f: gallery_draw.highlights_figure(f, shown, shade),
                                  gallery_draw.highlights_size(shown))
    gallery_draw.write_small_png(FIGURES / "highlights.png", highlit, 200)
    files.write_json(RESULTS, measured(shown, shade))
    files.write_text(PAGE, markdown(json.loads(RESULTS.read_text())))


def figure(function: catalogue.Function) -> Path:
    return FIGURES / f"{function.name.removeprefix('lobe_')}.png"


def main() -> None:
    from .progress import progress

    library = catalogue.load()
    shade = Shades(library, gl.create_context("egl"))
    with progress() as step:
        shown = gallery.exhibits(library, gallery.lobes(library), shade, step)
        write_document(shown, shade)


if __name__ == "__main__":
    main()
