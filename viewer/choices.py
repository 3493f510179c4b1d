"""What the lobe panel offers: the lobes by group and year, where each comes from, its slider for a parameter, what it
costs, and the GLSL to paste. All of it grows from the headers; no lobe is named here."""

from __future__ import annotations

import json
import re
from functools import cache

import numpy as np

from ..lab import bundle, cost, domain, gallery
from ..lab.catalogue import Catalogue, Function, Parameter
from . import curves
from .state import Lobe

DECADES = 20.0  # a range that spans more than this factor gets a logarithmic slider
LOWEST = 1e-4  # where the logarithmic slider of a range that begins at 0 begins
GPU = "NAVI21"


def shown_lobes(library: Catalogue) -> list[Function]:
    """Those that a picture can be drawn with."""
    return [f for f in library.functions if f.takes_vectors]


def groups(library: Catalogue, search: str = "") -> dict[str, list[Function]]:
    """Group of the gallery -> its lobes, the oldest first, of those in whose name or header every word of the search is
    found."""
    words = search.lower().split()
    found: dict[str, list[Function]] = {}
    for f in gallery.lobes(library):
        text = f"{f.name}\n{f.header}\n{f.stem}".lower()
        if all(word in text for word in words):
            found.setdefault(gallery.group(f), []).append(f)
    return found


def best(library: Catalogue, search: str) -> Function | None:
    """What a search means: the lobe of that name, else one whose name begins with it, else one whose name has it, else
    the first in whose header it is; None where nothing was asked for or found."""
    found = [f for group in groups(library, search).values() for f in group]
    text = "".join(search.lower().split()).removeprefix("lobe_")

    def rank(f: Function) -> int:
        name = short(f).lower()
        return 0 if name == text else 1 if name.startswith(text) else 2 if text in name else 3

    return min(found, key=rank, default=None) if text else None


def short(function: Function) -> str:
    """The name without the library's prefix."""
    return function.name.removeprefix("lobe_")


def is_logarithmic(p: Parameter) -> bool:
    """Whether a range spans so much that an even slider would waste most of its way."""
    spans_decades = p.low > 0 and p.high / p.low > DECADES or p.low == 0 and p.high > DECADES
    return p.kind != "color" and spans_decades


def inside(p: Parameter, values: tuple[float, ...]) -> bool:
    """Whether numbers are as many as a parameter has, and in its range, as float32; that of a vector counts, too."""
    low, high = np.float32(p.low), np.float32(p.high)
    return len(values) == p.width and all(low <= np.float32(x) <= high for x in values)


def rounded_into(p: Parameter, values) -> tuple[float, ...]:
    """Numbers brought into the range of a parameter, as float32 has them, so that none is outside by a rounding."""
    return tuple(float(x) for x in domain.rounded(np.asarray(values, float), p))


def defaults(function: Function) -> dict[str, tuple[float, ...]]:
    return {p.name: p.default for p in function.parameters if not p.is_geometry}


def carried_over(values: dict[str, tuple[float, ...]], function: Function) -> dict[str, tuple[float, ...]]:
    """The defaults of a lobe, with what another lobe's values say of the parameters that both have."""
    def value(p: Parameter) -> tuple[float, ...]:
        known = values.get(p.name, ())
        return known if inside(p, known) else rounded_into(p, known) if len(known) == p.width else p.default

    return {p.name: value(p) for p in function.parameters if not p.is_geometry}


def become(lobe: Lobe, function: Function) -> None:
    """Another lobe, which keeps the values of the parameters that both have."""
    lobe.values = carried_over(lobe.values, function)
    lobe.key = function.key


def about(function: Function, p: Parameter) -> list[str]:
    """The sentences of a header that name a parameter, beside its own line."""
    sentences = re.split(r"(?<=[.;])\s+(?=[A-Z])", " ".join(function.notes))
    return [s for s in sentences if re.search(rf"\b{p.name}\b", s) and not s.startswith("Why this form")]


# --- GLSL to paste ----------------------------------------------------------------------------------------------------


def number(x: float) -> str:
    """The shortest literal that float32 reads back as it was."""
    text = np.format_float_positional(np.float32(x), unique=True, trim="0") if 1e-4 <= abs(x) < 1e7 or x == 0 else (
        np.format_float_scientific(np.float32(x), unique=True, trim="0"))
    return text


def literal(values: tuple[float, ...]) -> str:
    if len(values) == 1:
        return number(values[0])
    inside = number(values[0]) if len(set(values)) == 1 else ", ".join(number(x) for x in values)
    return f"vec{len(values)}({inside})"


def call(function: Function, values: dict[str, tuple[float, ...]]) -> str:
    """The call with its parameters as literals, ready to paste: lobe_GGX(N, V, L, vec3(0.04), 0.25)."""
    arguments = (p.name if p.is_geometry else literal(values.get(p.name, p.default)) for p in function.parameters)
    return f"{function.name}({', '.join(arguments)})"


def bundle_text(library: Catalogue, function: Function) -> str:
    """The functions that the call needs, and nothing else."""
    return bundle.bundle(library, [function.key])


# --- where it comes from, what it costs -------------------------------------------------------------------------------


def place(function: Function) -> str:
    return f"{function.path.name}:{function.line}"


@cache
def _measured() -> dict:
    return json.loads(cost.RESULTS.read_text())["functions"] if cost.RESULTS.exists() else {}


def cycles(library: Catalogue, function: Function) -> int | None:
    """Cycles of one SIMD unit for 64 calls on RDNA2, as measured; None where this code was not measured yet."""
    found = _measured().get(function.key)
    if not found or found["stamp"] != cost.stamp(library, function):
        return None
    return found[GPU]["inverse_throughput"]


# --- terms ------------------------------------------------------------------------------------------------------------


def terms(library: Catalogue, letter: str) -> list[Function]:
    """The terms that a plot of F, D or G can show: those that return a number or a colour."""
    return [f for f in library.functions if f.kind == "term" and curves.letter(f) == letter and f.result != "vec2"]


def own_term(library: Catalogue, lobe: Function, letter: str) -> Function | None:
    """The F, D or G of a lobe, of those that its parameters tell all about: what it calls, else, where its formula has
    the letter, the one whose name is most like its own. None where it has none."""
    called = bundle.closure(library, [lobe])
    known = {name for p in lobe.parameters for name in (p.name, *_MEANS.get(p.name, ()))}
    candidates = [f for f in terms(library, letter) if {p.name for p in f.parameters if not p.is_geometry} <= known]
    own = [f for f in called if f in candidates]
    formula = " ".join(line for f in called if f.kind == "lobe" for line in f.formula)
    if own or not re.search(rf"\b[{'GV' if letter == 'G' else letter}]\b", formula):
        return own[-1] if own else None
    if letter == "F":
        return next((f for f in candidates if f.result == "vec3"), None)
    alike = [f for f in candidates if _words(f) <= _words(lobe)]
    return max(alike, key=lambda f: (len(_words(f)), not f.name.startswith("lobe_G1_")), default=None)


def term_values(term: Function, values: dict[str, tuple[float, ...]]) -> dict[str, tuple[float, ...]]:
    """A term's parameters, as a lobe's values tell them; the defaults of what they do not."""
    told = {other: value for name, value in values.items() for other in _MEANS.get(name, ())} | values
    return carried_over(told, term)


_MEANS = {"rs": ("f0",)}  # parameters that terms know by another name


def _words(function: Function) -> set[str]:
    """Of a lobe's name, or of a term's behind its letter: GGX and fast of lobe_GGX_fast and of lobe_V_GGX_fast."""
    return set(function.name.split("_")[2 if function.kind == "term" else 1 :])
