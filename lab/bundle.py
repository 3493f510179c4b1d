"""Exactly the functions and constants asked for and what they use, as one text that compiles in any stage."""

from __future__ import annotations

import re

from .catalogue import WIDTHS, Catalogue, Function, like
from .errors import InputError

_FLOATS = "precision highp float;\n"
TARGETS = {
    "330": "#version 330 core\n",
    "410": "#version 410 core\n",
    "450": "#version 450 core\n",
    "460": "#version 460 core\n",
    "300es": "#version 300 es\n" + _FLOATS,
    "310es": "#version 310 es\n" + _FLOATS,
    "320es": "#version 320 es\n" + _FLOATS,
    "vulkan": "#version 450\n",
}


def bundle(catalogue: Catalogue, names: list[str], target: str | None = None) -> str:
    """GLSL text of the named functions (all overloads of a name, or one key) and constants, in the library's order.

    target   one of TARGETS: puts its #version and precision in front; None for neither
    """
    if target is not None and target not in TARGETS:
        raise InputError(f"--target {target}: expected one of {', '.join(TARGETS)}")
    for name in names:
        if name.startswith("LOBE_") and name not in catalogue.constants:
            raise InputError(f"unknown constant '{name}'{like(name, catalogue.constants)}")
    functions = closure(catalogue, [f for n in names if n not in catalogue.constants for f in catalogue.find(n)])
    constants = _constants(catalogue, "\n".join([*names, *(f.definition for f in functions)]))
    convention = " Each f is in 1/sr, without the cosine." if functions else ""
    title = f"// Lobe {version(catalogue)}: {', '.join(names)}. MIT-0.{convention}\n"
    code = "".join(f"\n{f.header}\n{f.definition}\n" for f in functions)
    return TARGETS.get(target, "") + title + "".join(f"{line}\n" for line in constants) + code


def closure(catalogue: Catalogue, wanted: list[Function]) -> list[Function]:
    """The functions and all that they call, each before its callers."""
    found = {}

    def add(function: Function) -> None:
        if function.key not in found:
            found[function.key] = function
            for callee in callees(catalogue, function):
                add(callee)

    for function in wanted:
        add(function)
    return [f for f in catalogue.functions if f.key in found]


def callees(catalogue: Catalogue, function: Function) -> list[Function]:
    """The overloads that a function's body calls."""
    body = re.sub(r"//.*", "", function.definition[function.definition.index("{") :])
    types = {p.name: p.type for p in function.parameters}
    types |= {name: kind for kind, name in re.findall(r"\b(float|vec2|vec3) (\w+)", body)}
    called = []
    for match in re.finditer(r"\b(lobe_\w+)\(", body):
        arguments = [_type(catalogue, a, types) for a in _arguments(body, match.end())]
        fitting = [f for f in catalogue.find(match[1]) if _may_take(f, arguments)]
        called += [f for f in fitting if f not in called]
    return called


def _arguments(text: str, start: int) -> list[str]:
    """The arguments of a call whose opening parenthesis ends at `start`."""
    depth, begin, arguments = 1, start, []
    for i in range(start, len(text)):
        depth += {"(": 1, ")": -1}.get(text[i], 0)
        if depth == 0 or (depth == 1 and text[i] == ","):
            arguments.append(text[begin:i].strip())
            begin = i + 1
        if depth == 0:
            return arguments
    return arguments


def _may_take(function: Function, arguments: list[str | None]) -> bool:
    """Whether a call with arguments of these types can mean this overload. None fits any type."""
    wanted = [p.type for p in function.parameters]
    return len(arguments) == len(wanted) and all(a in (None, w) for a, w in zip(arguments, wanted))


_CALL = re.compile(r"(\w*)\(([^()]*)\)")  # an innermost call or parenthesis
_SCALAR_BUILTINS = ("float", "dot", "length", "distance")


def _type(catalogue: Catalogue, expression: str, types: dict[str, str]) -> str | None:
    """The type of an expression, from the inside out; None where it has a name that we do not know."""
    types = dict(types)
    while match := _CALL.search(expression):
        name, arguments = match.groups()
        if name in ("vec2", "vec3"):
            kind = name
        elif name in _SCALAR_BUILTINS:
            kind = "float"
        elif name.startswith("lobe_"):
            results = {f.result for f in catalogue.find(name)}
            kind = results.pop() if len(results) == 1 else None
        else:  # a parenthesis, or a built-in such as max, whose result is as wide as its widest argument
            kind = _widest(arguments, types)
        stand_in = f"type_{len(types)}"
        types[stand_in] = kind
        expression = expression[: match.start()] + stand_in + expression[match.end() :]
    return _widest(expression, types)


def _widest(expression: str, types: dict[str, str]) -> str | None:
    """The type of operands joined by operators or commas."""
    words = re.findall(r"\b[A-Za-z_]\w*\b(?:\.\w+)?", re.sub(r"\b[\d.]+(e[+-]?\d+)?", "", expression))
    kinds = {"float"} | {("float" if len(w.split(".")[1]) == 1 else f"vec{len(w.split('.')[1])}") if "." in w
                         else "float" if w.startswith("LOBE_") else types.get(w) for w in words}
    return None if None in kinds else max(kinds, key=WIDTHS.get)


def _constants(catalogue: Catalogue, code: str) -> list[str]:
    """The lines of the constants that a code uses, and of those which these use."""
    used: set[str] = set()
    text = code
    while new := {name for name in catalogue.constants if re.search(rf"\b{name}\b", text)} - used:
        used |= new
        text = "\n".join(catalogue.constants[name] for name in new)
    return [line for name, line in catalogue.constants.items() if name in used]


def version(catalogue: Catalogue) -> str:
    number = re.search(r"#define LOBE_VERSION (\d+)", catalogue.file("core").text)
    return f"{int(number[1]) // 10000}.{int(number[1]) // 100 % 100}.{int(number[1]) % 100}" if number else ""
