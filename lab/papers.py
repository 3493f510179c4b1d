"""Where the papers are that the headers cite."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from urllib.parse import quote_plus

from . import toml_lines

FILE = Path(__file__).with_name("papers.toml")


@cache
def known() -> dict[str, str]:
    """"authors year" -> DOI or address."""
    return toml_lines.load(FILE)[0]


def cited(source: str) -> str:
    """Authors and year of what a header's `source` cites first, as it writes them; "" where it has no year."""
    found = re.match(r"[^;]*?\b(?:1[789]|20)\d\d\b", source)
    return found[0] if found else ""


def address(source: str) -> str:
    """Of the paper that a header's `source` cites first; a search for it where its place is not known."""
    place = known().get(cited(source), "")
    if not place:
        return f"https://scholar.google.com/scholar?q={quote_plus(source.split(';')[0])}"
    return place if place.startswith("https:") else f"https://doi.org/{place}"


def linked(source: str) -> str:
    """A header's `source` in Markdown, with a link where a paper's place is known."""
    return "; ".join(_linked(part) for part in source.split("; "))


def _linked(part: str) -> str:
    name = cited(part)
    return f"[{name}]({address(part)}){part[len(name):]}" if name in known() else part
