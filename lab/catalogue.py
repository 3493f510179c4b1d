"""The catalogue: every function of glsl/, read from the comment above it.

The header is the only place where a parameter's range, a tolerance or a source is written; the tests, the command
line and the report take them from here. The grammar is strict, and CONTRIBUTING.md shows it.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path

import numpy as np

from . import geometry
from .errors import InputError
from .paths import GLSL

WIDTHS = {"float": 1, "vec2": 2, "vec3": 3}
PARAMETER_TYPES = {"float": "float", "cosine": "float", "color": "vec3", "vec3": "vec3", "vec2": "vec2"}  # as a header writes them
KEYWORDS = ("param", "reciprocal", "energy", "normalised", "units", "source", "approximates", "family")
FAMILIES = ("fresnel", "distribution", "gaussian", "masking", "diffuse", "power", "specular", "albedo")  # charted together
EXACT = "exact"  # what an approximation names when it stands for no other function
MAX_UNITS = 16  # more needs a derivation beside it, which a `units` line says after the number

_DEFINITION = re.compile(r"(float|vec[234]|mat[234]|bool|int|void) (\w+)\((.*)\) \{")
_CONSTANT = re.compile(r"const (?:float|vec[23]) (LOBE_\w+) = .*;(?: *//.*)?$")
_GUARD = re.compile(r"#(ifndef LOBE_\w+|define LOBE_\w+( .*)?|error \".*\"|endif)$")
_KEYWORD_LINE = re.compile(r"// (\w+) {2,}(\S.*)$")
_TERM = re.compile(r"lobe_([A-Z]{1,2}[0-9]?|DFG|Rd)_")


@dataclass(frozen=True)
class Parameter:
    """One parameter of a function. Ranges are inclusive; a colour's range holds for each channel."""

    name: str
    type: str  # float, vec2 or vec3
    kind: str  # float, cosine, color, vec3, direction (unit) or half (H = V + L, any length)
    low: float
    high: float
    default: tuple[float, ...]
    meaning: str = ""
    unit: str = ""

    @property
    def width(self) -> int:
        return WIDTHS[self.type]

    @property
    def is_geometry(self) -> bool:
        """Whether the bench forms it from a pixel's N, T, V, L."""
        return self.name in geometry.FORM

    def admits(self, value: tuple[float, ...]) -> bool:
        """Whether numbers lie in the stated range, as float32. Vectors have none."""
        low, high = np.float32(self.low), np.float32(self.high)
        return self.kind in ("direction", "half", "vec3") or all(low <= np.float32(x) <= high for x in value)


@dataclass(frozen=True)
class Approximation:
    """What an approximation stands for: another function's name, or EXACT where the function's own reference is the exact
    value; and the error it may make there, besides rounding."""

    name: str
    bound: float
    is_relative: bool
    where: str

    def error(self, value):
        """Allowed absolute error at exact values."""
        return self.bound * abs(value) if self.is_relative else self.bound + 0.0 * value


@dataclass(frozen=True)
class Function:
    """One GLSL function with what its header states."""

    name: str
    result: str
    parameters: tuple[Parameter, ...]
    stem: str
    path: Path
    line: int  # of the definition, from 1
    description: str
    formula: tuple[str, ...]
    notes: tuple[str, ...]
    units: int  # K of the tolerance
    units_why: str
    source: str
    reciprocal: str  # "yes", "no, ...", or "" where it does not apply
    energy: str  # "<= x", "no, ...", or ""
    normalised: str  # "yes", "no, ...", or ""
    approximation: Approximation | None
    family: str  # one of FAMILIES, or ""
    header: str  # the comment, verbatim
    definition: str  # the code, verbatim

    @property
    def key(self) -> str:
        """name(type,...): unique among overloads, and the reference's name for it."""
        return f"{self.name}({','.join(p.type for p in self.parameters)})"

    @property
    def kind(self) -> str:
        """lobe, term or helper, as name and parameters tell."""
        if _TERM.match(self.name):
            return "term"
        names = {p.name for p in self.parameters}
        sees_both_sides = {"N", "V", "L"} <= names or {"NdotV", "NdotL"} <= names
        return "lobe" if self.name[5].isupper() and sees_both_sides else "helper"

    @property
    def returns_directions(self) -> bool:
        """Whether its values are components of vectors, or cosines, of either sign: helpers that make a vector of
        directions, or of numbers alone. All others are never negative."""
        of_directions = any(p.kind == "direction" for p in self.parameters)
        of_numbers = all(p.type == "float" for p in self.parameters)
        return self.kind == "helper" and self.result != "float" and (of_directions or of_numbers)

    @property
    def is_shown(self) -> bool:
        """Whether the bench draws it on scenes; helpers are compared at points only."""
        return self.kind != "helper" and any(p.is_geometry for p in self.parameters)

    @property
    def takes_vectors(self) -> bool:
        """Whether a renderer, which knows N, T, V, L and not the cosines between them, can call it as a lobe."""
        geometric = {p.name for p in self.parameters if p.is_geometry}
        return self.kind == "lobe" and geometric <= set(geometry.DIRECTIONS)

    @property
    def signature(self) -> str:
        return f"{self.result} {self.name}({', '.join(f'{p.type} {p.name}' for p in self.parameters)})"

    @property
    def call(self) -> str:
        """A call whose arguments bear the parameters' names."""
        return f"{self.name}({', '.join(p.name for p in self.parameters)})"

    @property
    def energy_bound(self) -> float | None:
        return float(self.energy[2:].split(",")[0]) if self.energy.startswith("<=") else None

    def parameter(self, name: str) -> Parameter | None:
        return next((p for p in self.parameters if p.name == name), None)


@dataclass(frozen=True)
class File:
    """One file of glsl/."""

    stem: str
    path: Path
    description: str
    needs: tuple[str, ...]
    constants: dict[str, str]  # name -> its line
    functions: tuple[Function, ...]
    text: str


@dataclass(frozen=True)
class Catalogue:
    """All files, each after those it needs."""

    files: tuple[File, ...]
    _by_name: dict[str, tuple[Function, ...]] = field(init=False, repr=False, default_factory=dict)
    _by_key: dict[str, tuple[Function]] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self):
        for f in self.functions:
            self._by_name[f.name] = self._by_name.get(f.name, ()) + (f,)
            self._by_key[f.key] = (f,)

    @cached_property
    def functions(self) -> tuple[Function, ...]:
        return tuple(f for file in self.files for f in file.functions)

    @cached_property
    def constants(self) -> dict[str, str]:
        return {name: line for file in self.files for name, line in file.constants.items()}

    @property
    def text(self) -> str:
        """The whole library, in an order that compiles."""
        return "\n".join(file.text for file in self.files)

    def file(self, stem: str) -> File:
        return next(f for f in self.files if f.stem == stem)

    def label(self, function: Function) -> str:
        """The name, or the key where the name is overloaded."""
        return function.name if len(self._by_name[function.name]) == 1 else function.key

    def find(self, name: str) -> tuple[Function, ...]:
        """The overloads of a name, or the one function of a key. InputError where there is none."""
        found = self._by_name.get(name) or self._by_key.get(name.replace(" ", ""))
        if not found:
            raise InputError(f"unknown function '{name}'{like(name, self._by_name)}")
        return found


def like(name: str, known) -> str:
    """The few names that may have been meant, where the list of all would be long."""
    folded = {k.lower().removeprefix("lobe_"): k for k in known}
    near = difflib.get_close_matches(name.lower().removeprefix("lobe_"), folded, n=3, cutoff=0.4)
    meant = f", did you mean {' '.join(folded[k] + '?' for k in near)}" if near else ""
    return f"{meant}; ./lobe list shows all"


@cache
def load(folder: Path = GLSL) -> Catalogue:
    """Reads every .glsl file of a folder. A header that breaks the grammar is an InputError with file and line."""
    files = {path.stem: _parse_file(path) for path in sorted(folder.glob("*.glsl"))}
    ordered: dict[str, File] = {}

    def place(stem: str, user: File | None, above: tuple[str, ...]) -> None:
        if stem in ordered:
            return
        if stem not in files:
            raise InputError(f"{user.path}:2: needs '{stem}', and there is no {stem}.glsl beside it")
        if stem in above:
            raise InputError(f"{files[stem].path}:2: needs itself through {' -> '.join((*above, stem))}")
        for needed in files[stem].needs:
            place(needed, files[stem], (*above, stem))
        ordered[stem] = files[stem]

    for stem in files:
        place(stem, None, ())
    catalogue = Catalogue(tuple(ordered.values()))
    for function in catalogue.functions:
        _require_known_approximated(catalogue, function)
    return catalogue


def _require_known_approximated(catalogue: Catalogue, function: Function) -> None:
    stated = function.approximation
    if stated and stated.name != EXACT and stated.name not in {f.name for f in catalogue.functions}:
        header = function.header.splitlines()
        above = next(i for i, line in enumerate(reversed(header), 1) if line.startswith("// approximates "))
        raise InputError(f"{function.path}:{function.line - above}: approximates  {stated.name}: expected '{EXACT}' or "
                         "the name of a function of the library")


class _Reader:
    """The lines of one file, and errors that name the place."""

    def __init__(self, path: Path):
        self.path = path
        content = path.read_bytes()
        try:
            self.lines = content.decode().splitlines()
        except UnicodeDecodeError as error:
            self.fail(content.count(b"\n", 0, error.start), "is no UTF-8 text; save the file as UTF-8")

    def fail(self, index: int, message: str):
        raise InputError(f"{self.path}:{index + 1}: {message}")

    def line(self, index: int) -> str:
        return self.lines[index] if index < len(self.lines) else ""


def _parse_file(path: Path) -> File:
    reader = _Reader(path)
    if not re.match(r"// \S", reader.line(0)):
        reader.fail(0, "expected '// <what this file is>'")
    needs_line = _KEYWORD_LINE.match(reader.line(1))
    if not needs_line or needs_line[1] != "needs":
        reader.fail(1, "expected '// needs  <stems, comma separated, or nothing>'")
    needs = () if needs_line[2] == "nothing" else tuple(re.split(r", *", needs_line[2].strip()))

    constants: dict[str, str] = {}
    functions: list[Function] = []
    comment_start = None
    index = 2
    while index < len(reader.lines):
        line = reader.lines[index]
        if line.startswith("//"):
            comment_start = index if comment_start is None else comment_start
        elif constant := _CONSTANT.match(line):
            constants[constant[1]] = line
            comment_start = None
        elif re.match(r"\w+ \w+\(", line):
            index, function = _parse_function(reader, comment_start, index)
            functions.append(function)
            comment_start = None
        elif line and not _GUARD.match(line):
            reader.fail(index, f"expected a function, a constant LOBE_..., a guard or a comment, got '{line.strip()}'")
        else:
            comment_start = None
        index += 1
    return File(path.stem, path, reader.lines[0][3:], needs, constants, tuple(functions), "\n".join(reader.lines) + "\n")


def _parse_function(reader: _Reader, comment_start: int | None, start: int) -> tuple[int, Function]:
    """The function whose definition begins at line `start`; returns the index of its last line too."""
    brace = start
    while "{" not in reader.line(brace):
        brace += 1
        if brace >= len(reader.lines):
            reader.fail(start, "expected '<type> lobe_name(<type> name, ...) {'")
    declaration = " ".join(s.strip() for s in reader.lines[start : brace + 1])
    match = _DEFINITION.match(declaration)
    if not match:
        reader.fail(start, "expected '<type> lobe_name(<type> name, ...) {'")
    result, name, parameter_list = match.groups()
    if not name.startswith("lobe_") or "__" in name:
        reader.fail(start, f"'{name}': a function's name begins with lobe_ and has no double underscore")
    if result not in WIDTHS:
        reader.fail(start, f"'{name}' returns {result}: expected one of {', '.join(WIDTHS)}")
    end = brace
    if not reader.line(brace).rstrip().endswith("}"):
        while reader.line(end) != "}":
            end += 1
            if end >= len(reader.lines):
                reader.fail(start, f"'{name}' has no closing brace in column 1")
    if comment_start is None:
        reader.fail(start, f"'{name}' has no header: expected a comment directly above it")

    header = _parse_header(reader, comment_start, start)
    parameters = _parameters(reader, start, parameter_list, header.pop("param"), comment_start)
    function = Function(
        name=name,
        result=result,
        parameters=parameters,
        stem=reader.path.stem,
        path=reader.path,
        line=start + 1,
        header="\n".join(reader.lines[comment_start:start]),
        definition="\n".join(reader.lines[start : end + 1]),
        **header,
    )
    _require(reader, start, function)
    return end, function


def _parse_header(reader: _Reader, start: int, stop: int) -> dict:
    """The header's facts, by the names of Function's fields; 'param' holds (line index, columns) by name."""
    facts = {"param": {}, "formula": [], "notes": [], "units_why": ""}
    facts |= {k: "" for k in ("reciprocal", "energy", "normalised", "source", "family")} | {"units": 0, "approximation": None}
    if _KEYWORD_LINE.match(reader.lines[start]) or not re.match(r"// \S", reader.lines[start]):
        reader.fail(start, "a header begins with a sentence that says what the function is")
    facts["description"] = reader.lines[start][3:].strip()
    seen = set()
    for index in range(start + 1, stop):
        line = reader.lines[index].rstrip()
        keyword = _KEYWORD_LINE.match(line)
        if not keyword:
            body = line[2:]
            facts["formula" if body.startswith("   ") else "notes"].append(body.strip())
            continue
        word, value = keyword.groups()
        if word not in KEYWORDS:
            reader.fail(index, f"unknown keyword '{word}': expected one of {', '.join(KEYWORDS)}")
        if word == "param":
            columns = re.split(r" {2,}", value)
            if columns[0] in facts["param"]:
                reader.fail(index, f"parameter '{columns[0]}' is stated twice")
            facts["param"][columns[0]] = (index, columns)
            continue
        if word in seen:
            reader.fail(index, f"'{word}' is stated twice")
        seen.add(word)
        if word == "units":
            number = re.match(r"(\d{1,9})(?:, (.+))?$", value)
            if not number or (int(number[1]) > 8 and not number[2]):
                reader.fail(index, f"units  {value}: expected a whole number, and ', why' where it is more than 8")
            facts["units"], facts["units_why"] = int(number[1]), number[2] or ""
        elif word in ("reciprocal", "normalised") and not re.match(r"yes$|no, \S", value):
            reader.fail(index, f"{word}  {value}: expected 'yes' or 'no, <why>'")
        elif word == "energy" and not re.match(r"<= \d+(\.\d+)?(, .+)?$|no, \S", value):
            reader.fail(index, f"energy  {value}: expected '<= <bound>' or 'no, <figure>'")
        elif word == "family" and value not in FAMILIES:
            reader.fail(index, f"family  {value}: expected one of {', '.join(FAMILIES)}")
        elif word == "approximates":
            stated = re.match(r"(\w+) {2,}max error (\d[\d.e-]*) (absolute|relative)(?:  (.+))?$", value)
            if not stated:
                reader.fail(index, f"approximates  {value}: expected '<function or exact>  max error <x> "
                            "absolute|relative  <where>'")
            facts["approximation"] = Approximation(stated[1], float(stated[2]), stated[3] == "relative", stated[4] or "")
        else:
            facts[word] = value
    return {k: tuple(v) if isinstance(v, list) else v for k, v in facts.items()}


def _parameters(reader: _Reader, line: int, declared: str, stated: dict, header: int) -> tuple[Parameter, ...]:
    parameters = []
    for declaration in filter(None, declared.split(", ")):
        words = declaration.split(" ")
        if len(words) != 2 or words[0] not in WIDTHS:
            reader.fail(line, f"parameter '{declaration}': expected '<{'|'.join(WIDTHS)}> name'")
        glsl_type, name = words
        if name in stated:
            parameters.append(_stated_parameter(reader, glsl_type, *stated.pop(name)))
        elif name in geometry.FORM:
            parameters.append(_geometric_parameter(name, glsl_type))
        else:
            reader.fail(header, f"parameter '{name}' has no line 'param  {name}  <type>  <range>  <default>  <meaning>'")
    for name, (index, _) in stated.items():
        reader.fail(index, f"parameter '{name}' is not in the signature")
    return tuple(parameters)


def _geometric_parameter(name: str, glsl_type: str) -> Parameter:
    kind = "direction" if name in geometry.DIRECTIONS else "half" if name == "H" else "cosine"
    low = -1.0 if glsl_type == "vec3" or name in geometry.SIGNED else 0.0
    return Parameter(name, glsl_type, kind, low, 1.0, geometry.default(name))


def _stated_parameter(reader: _Reader, glsl_type: str, index: int, columns: list[str]) -> Parameter:
    if len(columns) != 5:
        reader.fail(index, "expected 'param  name  type  low..high  default  meaning', columns apart by two spaces")
    name, kind, range_text, default_text, meaning = columns
    if PARAMETER_TYPES.get(kind) != glsl_type:
        reader.fail(index, f"'{name}' is a {glsl_type}: type '{kind}' does not fit, expected one of "
                    + ", ".join(k for k, t in PARAMETER_TYPES.items() if t == glsl_type))
    try:
        low, high = (float(x) for x in range_text.split(".."))
        default = tuple(float(x) for x in default_text.split(","))
    except ValueError:
        reader.fail(index, f"'{range_text}  {default_text}': expected 'low..high  default' in numbers")
    default = default * WIDTHS[glsl_type] if len(default) == 1 else default
    if not low < high or len(default) != WIDTHS[glsl_type] or not all(low <= x <= high for x in default):
        reader.fail(index, f"'{name}': expected low < high and a default of {WIDTHS[glsl_type]} number(s) between them")
    unit = re.search(r" \[(.+)\]$", meaning)
    return Parameter(name, glsl_type, kind, low, high, default, meaning[: unit.start()] if unit else meaning,
                     unit[1] if unit else "")


def _require(reader: _Reader, line: int, function: Function) -> None:
    required = ["units", "source"]
    required += ["reciprocal", "energy"] if function.kind == "lobe" else []
    required += ["normalised"] if function.name.startswith("lobe_D_") else []
    for keyword in required:
        if not getattr(function, keyword):
            reader.fail(line, f"the header of '{function.name}' has no line '{keyword}  ...'")
