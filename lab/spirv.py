"""SPIR-V without branches: every path is computed, and what was decided by a branch becomes a select.

SPIR-V 1.4 or later, whose OpSelect takes one condition for a vector. Works on the text that spirv-dis prints of one
function without loops and local variables, as `isa` makes it by the optimiser's passes. Of such a function every block
comes after those that lead to it.
"""

from __future__ import annotations

import re

_LABEL = re.compile(r"\s*(%\w+) = OpLabel")
_PHI = re.compile(r"\s*(%\w+) = OpPhi (%\w+) (.*)")


class NotFlat(Exception):
    """The function has a loop or another branch that no select replaces."""


def flattened(text: str) -> str:
    """The module's text with all of its function in one block. NotFlat where that cannot be."""
    head, body, tail = _split(text)
    flow = _Flow()
    for block in body:
        flow.add(block)
    return "\n".join([*head, *flow.code, *tail]) + "\n"


def _split(text: str) -> tuple[list[str], list[list[str]], list[str]]:
    """The lines before the first block, those of each block, and those after the last."""
    lines = text.splitlines()
    starts = [i for i, line in enumerate(lines) if _LABEL.match(line)]
    end = next(i for i, line in enumerate(lines) if line.strip() == "OpFunctionEnd")
    if sum("OpFunctionEnd" in line for line in lines) != 1 or not starts:
        raise NotFlat("more than one function")
    blocks = [lines[a:b] for a, b in zip(starts, [*starts[1:], end])]
    return lines[: starts[0]], blocks, lines[end:]


class _Flow:
    """The blocks, laid one after the other.

    A path is a tuple of literals (condition, truth) that lead to a place. Where ways meet, what they share is kept.
    """

    def __init__(self):
        self.code: list[str] = []
        self.paths: dict[str, tuple] = {}  # of each block reached so far
        self.ways: dict[str, dict[str, tuple]] = {}  # block -> block that leads to it -> path of that way
        self.made = 0

    def add(self, block: list[str]) -> None:
        label = _LABEL.match(block[0])[1]
        ways = self.ways.get(label, {})
        if self.paths and not ways:
            return  # no way leads here
        if not self.paths:
            self.code.append(block[0])
        self.paths[label] = path = _shared(list(ways.values()))
        for line in block[1:-1]:
            if phi := _PHI.match(line):
                operands = phi[3].split()
                self._select(phi[1], phi[2], list(zip(operands[::2], operands[1::2])), ways, len(path))
            elif not re.match(r"\s*OpSelectionMerge", line):
                if re.match(r"\s*(OpLoopMerge|OpKill|%\w+ = (OpFunctionCall|OpVariable))\b", line):
                    raise NotFlat(line.strip())
                self.code.append(line)
        self._leave(label, path, block[-1].split())

    def _leave(self, label: str, path: tuple, last: list[str]) -> None:
        if last[0] == "OpBranch":
            self._lead(label, last[1], path)
        elif last[0] == "OpBranchConditional":
            self._lead(label, last[2], (*path, (last[1], True)))
            self._lead(label, last[3], (*path, (last[1], False)))
        elif last[0] == "OpSwitch" and len(last) == 3:  # how the optimiser leaves a function early
            self._lead(label, last[2], path)
        elif last[0] == "OpReturn":
            self.code.append("OpReturn")
        elif last[0] != "OpUnreachable":
            raise NotFlat(" ".join(last))

    def _lead(self, source: str, target: str, path: tuple) -> None:
        if target in self.paths:
            raise NotFlat("a loop")
        self.ways.setdefault(target, {})[source] = path

    def _select(self, name: str, kind: str, operands: list, ways: dict, known: int) -> None:
        """name = the operand of the way taken. All ways share their first `known` literals."""
        values = {source: value for value, source in operands}
        cases = [(values[source], way[known:]) for source, way in ways.items()]
        self.code.append(f"{name} = OpCopyObject {kind} {self._decided(kind, cases)}")

    def _decided(self, kind: str, cases: list) -> str:
        """The value among cases (value, literals), in the order of their blocks, as a tree of selects. Where several
        are left it is the first: what left early did not come to the others."""
        condition = next((literals[0][0] for _, literals in cases if literals), None)
        if condition is None or len({value for value, _ in cases}) == 1:
            return cases[0][0]
        yes, no = (self._decided(kind, [(value, tuple(l for l in literals if l[0] != condition))
                                        for value, literals in cases if (condition, not truth) not in literals])
                   for truth in (True, False))
        if yes == no:
            return yes
        self.made += 1
        self.code.append(f"%lobe_{self.made} = OpSelect {kind} {condition} {yes} {no}")
        return f"%lobe_{self.made}"


def _shared(paths: list[tuple]) -> tuple:
    """The literals with which all paths begin."""
    shared = []
    for literals in zip(*paths):
        if len(set(literals)) > 1:
            break
        shared.append(literals[0])
    return tuple(shared)
