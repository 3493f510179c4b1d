"""Small edits of the library's functions, one at a time, each of which the suite should notice.

A mutant is a function's definition with one edit: an operator, a constant, swapped arguments or components, a dropped
guard, factor or call, a flipped sign, another comparison. The edits follow from the syntax tree; no function is named
here. lab/judge.py is the suite that judges them.
"""

from __future__ import annotations

import json
import os
import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from . import bundle, cases, catalogue, files, gl
from .catalogue import Catalogue, Function
from .errors import InputError
from .judge import EQUAL, WHOLE_POINTS, Judge, Whole
from .paths import ROOT
from .together import Together

ARGUMENTS = Path(__file__).parent / "survivors.txt"
REQUIRED = 0.98  # of the mutants that are not equivalent, the suite kills
INPUTS = ("compare", "domain", "geometry", "judge", "singular", "stability")  # the modules that decide what a mutant changes
SUITE = (*INPUTS, "cases", "documented", "identities", "mutation", "physics", "policy", "together")  # and those that decide a verdict

TYPO = 1.001  # a constant's fourth digit
SWAPPED_OPERATOR = {"+": "-", "-": "+", "*": "/", "/": "*", "+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "&&": "||", "||": "&&"}
COMPARISONS = {"<": ("<=", ">"), "<=": ("<", ">"), ">": (">=", "<"), ">=": (">", "<"), "==": ("!=",), "!=": ("==",)}
SWAPPED_CALL = {"max": "min", "min": "max"}
SWAPPED_COMPONENT = {"x": "y", "y": "x", "z": "x", "xy": "yx", "yx": "xy"}
ORDERED = ("pow", "mix", "cross", "step", "vec2", "vec3")  # built-ins whose arguments may not change places
UNARY = ("abs", "sqrt", "exp", "exp2", "log", "log2", "normalize", "sign")  # of one argument, of its type


@dataclass(frozen=True)
class Mutant:
    """One edit of one function.

    kind        operator, constant, arguments, component, guard, factor, call, sign, comparison or statement
    name        what was edited, before -> after; unique within the function
    definition  the function's text with the edit
    """

    function: Function
    kind: str
    name: str
    definition: str

    def applied(self, source: str) -> str:
        """A text of the library with the edit."""
        return source.replace(self.function.definition, self.definition)


def mutants(library: Catalogue, function: Function) -> list[Mutant]:
    """All mutants of a function, each text once, in the order of the text."""
    text = function.definition
    root = _parser().parse(text.encode()).root_node
    found, names = {}, {}
    for kind, node, start, end, new in _edits(library, root):
        definition = text[:start] + new + text[end:]
        if definition == text or definition in found:
            continue
        shown = _shown(node)
        before, after = shown.text.decode(), text[shown.start_byte:start] + new + text[end:shown.end_byte]
        name = f"{_line(before)} -> {_line(after) or 'nothing'}"
        names[name] = names.get(name, 0) + 1
        name += f" #{names[name]}" if names[name] > 1 else ""
        found[definition] = Mutant(function, kind, name, definition)
    return list(found.values())


@cache
def _parser():
    try:
        import tree_sitter
        import tree_sitter_glsl
    except ImportError:
        raise InputError("mutate: the GLSL parser is missing; install it with pip install tree-sitter tree-sitter-glsl") from None
    with warnings.catch_warnings():  # tree-sitter-glsl 0.2 still hands over a number
        warnings.simplefilter("ignore", DeprecationWarning)
        return tree_sitter.Parser(tree_sitter.Language(tree_sitter_glsl.language()))


def _line(text: str) -> str:
    """On one line, without comments."""
    return " ".join(re.sub(r"//.*", "", text).split())


def _shown(node):
    """The node, or the expression around it where the node alone, such as 1.0, would say nothing."""
    while node.parent is not None and node.type in ("number_literal", "identifier", "field_expression", "argument_list"):
        node = node.parent
    return node


# --- edits -----------------------------------------------------------------------------------------------------------


def _edits(library: Catalogue, node) -> Iterator[tuple]:
    """(kind, node, start, end, new text) of each edit in a tree; the text is ASCII, so that bytes are characters."""
    if of_type := _OF_TYPE.get(node.type):
        for kind, edited, new in of_type(library, node):
            yield kind, node, edited.start_byte, edited.end_byte, new
    for child in node.children:
        yield from _edits(library, child)


def _of_binary(library, node):
    left, right = (node.child_by_field_name(side) for side in ("left", "right"))
    operator = node.child_by_field_name("operator")
    sign, a, b = operator.type, left.text.decode(), right.text.decode()
    if sign in SWAPPED_OPERATOR:
        yield "operator", operator, SWAPPED_OPERATOR[sign]
    if sign in ("*", "+", "&&", "||"):
        yield "factor", node, a
        yield "factor", node, b
    elif sign in ("/", "-"):
        yield "factor", node, a
    if sign == "-":
        yield "sign", node, f"({b} - ({a}))"
    for other in COMPARISONS.get(sign, ()):
        yield "comparison", operator, other


def _of_unary(library, node):
    if node.child_by_field_name("operator").type == "-":
        yield "sign", node, node.child_by_field_name("argument").text.decode()


def _of_number(library, node):
    text = node.text.decode()
    if re.fullmatch(r"\d+", text):
        return
    value = float(text)
    yield "constant", node, _number(value * TYPO if value else TYPO - 1)
    yield "constant", node, _number(2 * value if value else 1.0)


def _number(value: float) -> str:
    text = f"{value:.9g}"
    return text if re.search(r"[.e]", text) else text + ".0"


def _of_identifier(library, node):
    if node.text.decode() in library.constants:
        for factor in (_number(TYPO), "2.0"):
            yield "constant", node, f"({node.text.decode()} * {factor})"


def _of_call(library, node):
    name = node.child_by_field_name("function").text.decode()
    listed = node.child_by_field_name("arguments")
    arguments = [a.text.decode() for a in listed.named_children if a.type != "comment"]
    if name in ("max", "min"):
        for argument in arguments:
            yield "guard", node, f"({argument})"
    if name == "clamp":
        x, low, high = arguments
        for new in (f"({x})", f"max({x}, {low})", f"min({x}, {high})"):
            yield "guard", node, new
    if name in UNARY:
        yield "call", node, f"({arguments[0]})"
    if name in SWAPPED_CALL:
        yield "call", node.child_by_field_name("function"), SWAPPED_CALL[name]
    for i in range(len(arguments) - 1):
        if name in ORDERED or _same_type(library, name, len(arguments), i):
            swapped = arguments[:i] + [arguments[i + 1], arguments[i]] + arguments[i + 2:]
            yield "arguments", listed, f"({', '.join(swapped)})"


def _same_type(library: Catalogue, name: str, count: int, i: int) -> bool:
    """Whether the parameters i and i + 1 of a function of the library are of one type, in one of its overloads."""
    if not name.startswith("lobe_"):
        return False
    return any(len(f.parameters) == count and f.parameters[i].type == f.parameters[i + 1].type for f in library.find(name))


def _of_conditional(library, node):
    for branch in ("consequence", "alternative"):
        yield "guard", node, f"({node.child_by_field_name(branch).text.decode()})"


def _of_if(library, node):
    yield "guard", node, ""


def _of_field(library, node):
    field = node.child_by_field_name("field")
    if other := SWAPPED_COMPONENT.get(field.text.decode()):
        yield "component", field, other


def _of_statement(library, node):
    yield "statement", node, ""


def _of_parameters(library, node):
    """The names of neighbouring parameters of one type change places."""
    stated = [p.text.decode().split() for p in node.named_children]
    for i, (first, second) in enumerate(zip(stated, stated[1:])):
        if first[0] == second[0]:
            swapped = stated[:i] + [second, first] + stated[i + 2:]
            yield "arguments", node, f"({', '.join(' '.join(p) for p in swapped)})"


def _of_assignment(library, node):
    operator = node.child_by_field_name("operator")
    if operator.type in SWAPPED_OPERATOR:
        yield "operator", operator, SWAPPED_OPERATOR[operator.type]


_OF_TYPE = {
    "binary_expression": _of_binary,
    "unary_expression": _of_unary,
    "number_literal": _of_number,
    "identifier": _of_identifier,
    "call_expression": _of_call,
    "conditional_expression": _of_conditional,
    "if_statement": _of_if,
    "field_expression": _of_field,
    "expression_statement": _of_statement,
    "parameter_list": _of_parameters,
    "assignment_expression": _of_assignment,
}


# --- the verdict of one function -----------------------------------------------------------------------------------------------------


def measure(library: Catalogue, function: Function, context: gl.Context, points: int = WHOLE_POINTS,
            before: dict | None = None) -> dict:
    """What becomes of a function's mutants: how many there are, are stillborn (refused by the compiler), and are killed, by
    which check; the equivalent ones; and the survivors, each with what it changes and its error, both in units. `before`:
    the same of another suite, whose changes are taken."""
    judge, whole, together = Judge(library, function), Whole(library, function, context, points), Together(library, function, context)
    every = mutants(library, function)
    born = [m for m in every if together.compiles(whole.source, m.definition)]

    def judged(some: list[Mutant], work: Callable[[gl.Context], object]) -> list:
        return together.run([m.definition for m in some], work)

    own, *found = together.run([function.definition, *(m.definition for m in born)], judge.fault)
    if own:
        raise InputError(f"mutate: {function.key} fails before any edit ({own}); expected a library that passes ./lobe test")
    faults = dict(zip(born, found))
    alive = [m for m in born if not faults[m]]
    known = _changes(before) if before else {}
    changes = {m: known[m.name] for m in alive if m.name in known}
    new = [m for m in alive if m not in changes]
    changes |= zip(new, judged(new, whole.difference))
    changed = [m for m in alive if changes[m][0] > EQUAL]
    for caller in callers(library, function) if changed else []:
        alone = Judge(library, caller)
        left = [m for m in changed if not faults[m]]
        found = judged(left, lambda seat: next((name for name, passed in alone.points(seat) if not passed), ""))
        faults |= {m: name and f"{name} of {library.label(caller)}" for m, name in zip(left, found)}
    return {"function": function.key, "units": function.units, "inputs": whole.points, "mutants": len(every),
            "stillborn": len(every) - len(born), "killed": dict(Counter(filter(None, faults.values())).most_common()),
            "equivalent": [m.name for m in alive if changes[m][0] <= EQUAL],
            "survivors": [{"mutant": m.name, "change": changes[m][0], "error": changes[m][1]} for m in changed if not faults[m]]}


def _changes(result: dict) -> dict[str, tuple[float, float]]:
    """What those mutants change that were not killed, by name; of equivalent ones 0 stands for whatever is not seen."""
    def number(x):
        return np.inf if x is None else x  # JSON has no infinity

    return dict.fromkeys(result["equivalent"], (0.0, 0.0)) | {
        s["mutant"]: (number(s["change"]), number(s["error"])) for s in result["survivors"]}


def callers(library: Catalogue, function: Function) -> list[Function]:
    """Whatever calls a function, directly or not."""
    return [f for f in library.functions if f is not function and function in bundle.closure(library, [f])]


# --- many functions --------------------------------------------------------------------------------------------------


def run(library: Catalogue, functions: tuple[Function, ...], folder: Path, points: int = WHOLE_POINTS, jobs: int = 1,
        on_step: Callable[[str, int, int], None] = lambda name, done, of: None) -> list[dict]:
    """What becomes of some functions' mutants. Each function's result is kept in the folder as soon as it is there, so that
    an interrupted run goes on where it was; of another suite only what mutants change is taken, of another text nothing."""
    for function in functions:
        if not mutants(library, function):
            raise InputError(f"mutate: {function.key} has no mutants; expected a function that computes something")
    digests = _digests(library, functions, points)
    places = {f: files.output_folder(folder) / f"{re.sub(r'[^a-z0-9]+', '-', f.key, flags=re.I).strip('-')}.json" for f in functions}
    kept = {f: known for f in functions if (known := _kept(places[f])) and known["text"] == digests[f]["text"]}
    found = {f: known["result"] for f, known in kept.items() if known["suite"] == digests[f]["suite"]}
    left = sorted((f for f in functions if f not in found), key=lambda f: -len(f.definition))  # long ones first
    with ProcessPoolExecutor(jobs, get_context("spawn"), _begin) as pool:
        asked = {pool.submit(_measured, f.key, points, kept.get(f, {}).get("result")): f for f in left}
        for done, future in enumerate(as_completed(asked), len(found)):
            function = asked[future]
            on_step(library.label(function), done, len(functions))
            found[function] = future.result()
            files.write_json(places[function], digests[function] | {"result": found[function]})
    return [found[f] for f in functions]


def _kept(place: Path) -> dict | None:
    try:
        known = json.loads(place.read_text())
        return known if known.keys() >= {"text", "suite", "result"} else None
    except (OSError, ValueError):
        return None


def _digests(library: Catalogue, functions: tuple[Function, ...], points: int) -> dict[Function, dict[str, str]]:
    """Of whatever decides a function's result, apart: its text, of what calls it, and the models; and the suite."""
    here = Path(__file__).parent
    models = sorted((ROOT / "reference" / "models").glob("*.h"))
    suite = _digest(p.read_text() for p in (*(here / f"{name}.py" for name in SUITE), cases.FILE))
    inputs = _digest((str(points), *(p.read_text() for p in (*(here / f"{name}.py" for name in INPUTS), *models))))
    text = cache(lambda f: Judge(library, f).source)
    return {f: {"text": _digest((inputs, *map(text, (f, *callers(library, f))))), "suite": suite} for f in functions}


def _digest(texts: Iterable[str]) -> str:
    return sha256("\0".join(texts).encode()).hexdigest()


_worker: dict = {}  # of a process: its library and context


def _begin() -> None:
    os.environ.setdefault("MESA_SHADER_CACHE_DISABLE", "true")  # of programs that nobody asks for again
    _worker.update(library=catalogue.load(), context=gl.create_context("egl"))


def _measured(key: str, points: int, before: dict | None) -> dict:
    (function,) = _worker["library"].find(key)
    return measure(_worker["library"], function, _worker["context"], points, before)


# --- arguments -------------------------------------------------------------------------------------------------------


def arguments(library: Catalogue, path: Path = ARGUMENTS) -> dict[tuple[str, str], str]:
    """Why survivors are let live, by function's key and mutant's name; lines 'key: mutant | argument', # begins a comment.
    InputError where a line is no such, or its mutant does not exist."""
    found, names = {}, {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        stated = re.fullmatch(r"(lobe_\w+\([\w,]*\)): (.*\S) +\| (\S.*)", line)
        if not stated:
            raise InputError(f"{path}:{number}: expected 'lobe_name(type,...): mutant | argument', got '{line}'")
        key, name, argument = stated.groups()
        if key not in names:
            names[key] = {m.name for f in library.functions if f.key == key for m in mutants(library, f)}
        if name not in names[key]:
            raise InputError(f"{path}:{number}: {key} has no mutant '{name}'; remove the line, or write the mutant as "
                             "./lobe mutate prints it")
        found[key, name] = argument
    return found


def argued(results: list[dict], reasons: dict[tuple[str, str], str]) -> list[dict]:
    """The results, each survivor with its argument, "" where it has none."""
    return [r | {"survivors": [s | {"argument": reasons.get((r["function"], s["mutant"]), "")} for s in r["survivors"]]}
            for r in results]


def totals(results: list[dict]) -> dict:
    """Counts over all functions; the score is the part of the mutants, neither stillborn nor equivalent, that was killed."""
    killed = sum(sum(r["killed"].values()) for r in results)
    survivors = [s for r in results for s in r["survivors"]]
    return {"functions": len(results), "mutants": sum(r["mutants"] for r in results),
            "stillborn": sum(r["stillborn"] for r in results), "equivalent": sum(len(r["equivalent"]) for r in results),
            "killed": killed, "survivors": len(survivors), "argued": sum(bool(s.get("argument")) for s in survivors),
            "score": killed / max(killed + len(survivors), 1)}


def passed(results: list[dict], whole: bool) -> bool:
    """Whether every survivor is argued; and, of the whole library, enough are killed."""
    total = totals(results)
    return total["survivors"] == total["argued"] and (not whole or total["score"] >= REQUIRED)
