"""Runs one measurement on many mutants of a function in step, so that one program draws for many: a shader compiles for
longer than it runs, and most of its text is the same for all.

The measurement is ordinary code that asks a context to evaluate expressions. Each mutant gets a context of its own, in
whose name nothing is drawn until the others have asked for the same.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable

import numpy as np

from . import bundle, gl
from .catalogue import Catalogue, Function

PROGRAMS = gl.KEPT // 2  # that one expression takes at most, so that the next inputs find them compiled


class Together:
    """Mutants of one function, and whatever of the library they change."""

    def __init__(self, library: Catalogue, function: Function, context: gl.Context):
        self.function, self.context = function, context
        changed = {f.name for f in library.functions if function in bundle.closure(library, [f])}
        self._changed = [f for f in library.functions if f.name in changed]
        self._word = re.compile(rf"\b({'|'.join(changed)})(?=\()")

    def text(self, source: str, definitions: list[str]) -> str:
        """The source, and after it what changes of it with each of some definitions of the function, under other names."""
        concerned = [f.definition for f in self._changed if f.definition in source]
        copies = (self._renamed(d if d != self.function.definition else definition, i)
                  for i, definition in enumerate(definitions) for d in concerned)
        return "\n".join((source, *copies))

    def _renamed(self, text: str, i: int) -> str:
        return self._word.sub(lambda m: f"{m[1]}_m{i}", text)

    def compiles(self, source: str, definition: str) -> bool:
        try:
            gl.require_compiles(self.context, self.text(source, [definition]))
        except gl.CompileError:
            return False
        return True

    def run(self, definitions: list[str], work: Callable[[gl.Context], object]) -> list:
        """What `work` returns with each definition in the function's place. It must ask for the same values in the same
        order for each, until it returns."""
        outcomes = []
        most = PROGRAMS * gl.MANY
        for start in range(0, len(definitions), most):
            outcomes += self._run(definitions[start : start + most], work)
        return outcomes

    def _run(self, definitions: list[str], work: Callable[[gl.Context], object]) -> list:
        seats = [_Seat(self.context, work) for _ in definitions]
        waiting = [i for i, seat in enumerate(seats) if seat.advance(None)]
        group, known = [], None
        while waiting:
            source, call, result, inputs = seats[waiting[0]].request
            assert all(seats[i].request[:3] == (source, call, result) for i in waiting), "out of step"
            if known != (source, call, result):  # else those who have left stay in it: their programs are compiled
                group, known = waiting, (source, call, result)
                text = self.text(source, [definitions[i] for i in group])
            with self.context:
                values = gl.evaluate_many(self.context, text, [self._renamed(call, k) for k in range(len(group))], result, inputs)
            answers = dict(zip(group, values))
            waiting = [i for i in waiting if seats[i].advance(answers[i])]
        return [seat.outcome() for seat in seats]


class _Seat:
    """A context for one mutant's measurement, which runs in a thread of its own, never at the same time as another's."""

    def __init__(self, context: gl.Context, work: Callable[[gl.Context], object]):
        self.name, self.renderer, self.version, self.is_hardware = (
            context.name, context.renderer, context.version, context.is_hardware)
        self.request: tuple | None = None
        self._answer = self._returned = self._error = None
        self._turn, self._done = threading.Semaphore(0), threading.Semaphore(0)
        self._thread = threading.Thread(target=self._work, args=(work,), daemon=True)
        self._thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def evaluate(self, source: str, call: str, result: str, inputs: dict[str, np.ndarray]) -> np.ndarray:
        """Asks, and waits for the answer."""
        self.request = source, call, result, inputs
        self._done.release()
        self._turn.acquire()
        return self._answer

    def advance(self, answer: np.ndarray | None) -> bool:
        """Goes on with an answer until the next request; False where there is none any more."""
        self.request, self._answer = None, answer
        self._turn.release()
        self._done.acquire()
        return self.request is not None

    def outcome(self):
        if self._error is not None:
            raise self._error
        return self._returned

    def _work(self, work: Callable[[gl.Context], object]) -> None:
        self._turn.acquire()
        try:
            self._returned = work(self)
        except Exception as error:
            self._error = error
        self._done.release()
