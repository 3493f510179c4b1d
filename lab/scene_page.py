"""The generated parts of docs/scenes.md: python -m lobe.lab.scene_page writes its tables of keys from the schema, and
with --pictures renders the scenes that it shows, which takes long."""

from __future__ import annotations

import io
import re
import sys

import numpy as np

from . import files, scene_schema
from .paths import ROOT
from .scene_schema import REQUIRED, Key, List, Named, Table, Unread

PAGE, SCENES, FIGURES = ROOT / "docs" / "scenes.md", ROOT / "examples" / "scenes", ROOT / "docs" / "figures"
OUT = ROOT / "out" / "scenes"
ORDER = ("gold-teapot", "clay-bunny", "plastic-suzanne", "glass-sphere", "brushed-disc", "furnace")
THUMBNAIL = (320, 180)
LARGE = 1 << 20  # bytes that a figure may have; noise fills a PNG: beyond, a picture keeps 256 colours
_BLOCK = re.compile(r"(<!-- keys -->\n).*(<!-- /keys -->)", re.S)


def generated(text: str) -> str:
    """The page's text with its tables up to date."""
    return _BLOCK.sub(lambda m: m[1] + tables() + m[2], text)


def tables() -> str:
    return "\n".join(section for key in scene_schema.schema().values()
                     if not isinstance(key.kind, Unread) for section in _sections(key))


def _sections(key: Key) -> list[str]:
    """The tables of one key at the top of a file."""
    kind, title = key.kind, f"[{key.name}]"
    if isinstance(kind, List):
        kind, title = kind.kind, f"[[{key.name}]]"
    elif isinstance(kind, Named):
        kind, title = kind.kind, f"[{key.name}.NAME]"
    text = f"### `{title}`: {key.meaning}\n\n"
    if kind.forms:
        text += _table([Key(kind.selector, scene_schema.Choice(tuple(kind.forms)), "which of these it is"), *kind.keys])
        text += "".join(f"\nWith `{kind.selector} = \"{form}\"`" + (" also:\n\n" + _table(keys) if keys else
                        " nothing else.\n") for form, keys in kind.forms.items())
        return [text]
    text += _table(kind.keys)
    text += "".join(f"\n`{inner.name}` is a table:\n\n" + _table(inner.kind.keys)
                    for inner in kind.keys if isinstance(inner.kind, Table))
    return [text]


def _table(keys) -> str:
    lines = ["| key | value | default | meaning |", "|---|---|---|---|"]
    lines += [f"| `{k.name}` | {_expected(k)} | {_default(k)} | {k.meaning} |" for k in keys]
    return "\n".join(lines) + "\n"


def _expected(key: Key) -> str:
    if isinstance(key.kind, Table):
        return "a table, below"
    text = key.kind.expected
    text = re.sub(r'a table such as (.*)', r"tables such as `\1`", text) if isinstance(key.kind, List) else text
    return text.replace("an array, each ", "an array of ").replace("|", "\\|") + (f" [{key.unit}]" if key.unit else "")


def _default(key: Key) -> str:
    if key.default is REQUIRED:
        return "**required**"
    if key.default is None or key.default in ("", (), {}):
        return "none"
    if isinstance(key.default, bool):
        return str(key.default).lower()
    if isinstance(key.default, tuple):
        same = len(set(key.default)) == 1 and getattr(key.kind, "spread", False)
        return f"{key.default[0]:g}" if same else f"[{', '.join(f'{x:g}' for x in key.default)}]"
    return f"{key.default:g}" if isinstance(key.default, float) else str(key.default)


def main(arguments: list[str]) -> None:
    files.write_text(PAGE, generated(PAGE.read_text(encoding="utf-8")))
    if "--pictures" in arguments:
        for name in [a for a in arguments if a in ORDER] or ORDER:
            draw(name)
        draw_thumbnails()


def draw(name: str) -> None:
    """The picture of a scene, by the samples that its file asks for. Goes on where it was stopped."""
    from PIL import Image

    from . import commands

    commands.render(SCENES / f"{name}.toml", None, None, None, None, 0, None, True, None, OUT, None)
    picture, buffer = Image.open(OUT / f"{name}.png").convert("RGB"), io.BytesIO()
    picture.save(buffer, "PNG", optimize=True)
    if buffer.tell() > LARGE:
        buffer = io.BytesIO()
        picture.quantize(256, dither=Image.FLOYDSTEINBERG).save(buffer, "PNG")
    files.write_bytes(FIGURES / f"scene-{name}.png", buffer.getvalue())


def draw_thumbnails() -> None:
    """All six in one small picture."""
    from PIL import Image

    small = [np.asarray(Image.open(FIGURES / f"scene-{name}.png").convert("RGB").resize(THUMBNAIL, Image.LANCZOS)) for name in ORDER]
    files.write_png(FIGURES / "scenes.png", np.concatenate([np.concatenate(small[i : i + 3], 1) for i in (0, 3)]))


if __name__ == "__main__":
    main(sys.argv[1:])
