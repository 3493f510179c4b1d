"""The fast part of the suite as one verdict on a function's text: points, singular sets, hostile inputs, the policy,
symmetries, limits and identities, exact cases, and whatever calls the function. The tests measure by the same functions
with the same inputs; here inputs and the reference's values are formed once, however many texts are judged.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from . import bundle, cases, compare, documented, gl, physics, policy, stability
from .catalogue import Catalogue, Function

PARITY_POINTS, PARITY_SEED = 1 << 14, 1  # of tests/test_parity.py
NEAR_POINTS, SLOW_NEAR_POINTS = 1 << 15, 1 << 8  # of tests/test_stability.py; the less where the reference integrates
RULE_POINTS = 1 << 8
WHOLE_POINTS, SLOW_WHOLE_POINTS = 1 << 20, 1 << 12  # of the comparison of a mutant with the function itself
WHOLE_SEED = 77
EQUAL = 1.0  # unit: texts that differ by no more anywhere are equivalent



class Judge:
    """The fast part of the suite, of one function of a library."""

    def __init__(self, library: Catalogue, function: Function):
        self.library, self.function = library, function

    def fault(self, context: gl.Context) -> str:
        """The first check that fails in a context; "" where all pass."""
        return next((name for name, passed in self.checks(context) if not passed), "")

    def checks(self, context: gl.Context) -> Iterator[tuple[str, bool]]:
        """(name, passed) of each check, those that see most first."""
        yield from self.points(context)
        yield "finite and not negative", not policy.unkept(self.function, context, self._shader.source).any()
        hostile = {name: x[None] for name, x in policy.hostile(self.function).items()}
        for inputs in (self._near.inputs, hostile):
            yield "no NaN on the way", not policy.repaired(self.function, context, self._shader.source, inputs).any()
        for rule in self._rules:
            yield rule.name, bool((policy.errors(rule, self._shader, context) <= 1).all())
        shade = physics.Shades(context, self.source)
        for demand in self._demands:
            yield demand.name, demand.measure(shade).passed
        if physics.is_cut_at_one(self.function):
            yield "1 at most", physics.excess(self.function, shade) == 0
        for family, known in self._families:
            with context:
                got = gl.evaluate(context, self.source, family.call, "float", known.inputs)[:, 0].astype(float)
            yield f"cases {family.name}", bool((known.errors(got) <= 1).all())

    def points(self, context: gl.Context) -> Iterator[tuple[str, bool]]:
        """Those checks that compare values with the reference's."""
        label = self.library.label(self.function)
        for name, case, stated in (("points", self._points, documented.at_points),
                                   ("near singular sets", self._near, documented.near_singular_sets)):
            row = compare.compare(case, self._shader, context).row
            yield name, row["nonfinite"] == 0 and compare.ratio(row) <= 1
            yield "documented error", compare.ratio(row) <= stated(label, context)

    @cached_property
    def _shader(self) -> compare.Shader:
        text = bundle.bundle(self.library, [self.function.key])
        return compare.library_shader(self.function, text, self.function.key)

    @cached_property
    def source(self) -> str:
        """The text of the function and of whatever the demands and the cases call."""
        calls = [d.name for d in self._demands] + [family.call for family, _ in self._families]
        names = {name for call in calls for name in re.findall(r"lobe_\w+", call)} | {self.function.name}
        return bundle.bundle(self.library, sorted(names))

    @cached_property
    def _points(self) -> compare.Case:
        return compare.points_case(self.function, PARITY_POINTS, {}, PARITY_SEED)

    @cached_property
    def _near(self) -> compare.Case:
        count = SLOW_NEAR_POINTS if compare.is_quadrature(self.function) else NEAR_POINTS
        return stability.random_case(self.function, count, stability.SEED)

    @cached_property
    def _rules(self) -> list[policy.Rule]:
        return list(policy.rules(self.function, RULE_POINTS))

    @cached_property
    def _demands(self) -> list[physics.Demand]:
        overloads = self.library.find(self.function.name)  # an identity names a function, not an overload
        return [d for d in physics.demands(self.library, overloads) if d.kind in ("symmetry", "limit")]

    @cached_property
    def _families(self) -> list[tuple[cases.Family, cases.Cases]]:
        loaded = ((family, cases.load(self.library, family)) for family in cases.answered(self.library))
        return [(family, known) for family, known in loaded if self.function in known.functions]


class Whole:
    """A function's own values over a million stratified inputs, and how far another text is from them."""

    def __init__(self, library: Catalogue, function: Function, context: gl.Context, points: int = WHOLE_POINTS):
        self.function, self.context = function, context
        self._shader = compare.library_shader(function, bundle.bundle(library, [function.key]), function.key)
        self.points = min(points, SLOW_WHOLE_POINTS) if compare.is_quadrature(function) else points

    @property
    def source(self) -> str:
        return self._shader.source

    @cached_property
    def _cases(self) -> list[compare.Case]:
        return [stability.random_case(self.function, min(stability.CHUNK, self.points - start), WHOLE_SEED + 2 * k)
                for k, start in enumerate(range(0, self.points, stability.CHUNK))]

    @cached_property
    def _values(self) -> list[np.ndarray]:
        return [self._drawn(case, self.context) for case in self._cases]

    def _drawn(self, case: compare.Case, context: gl.Context) -> np.ndarray:
        with context:
            return gl.evaluate(context, self.source, self.function.call, self.function.result, case.inputs)

    def difference(self, context: gl.Context) -> tuple[float, float]:
        """What another context's text changes: (largest difference from the function's own values, largest error against
        the reference), in units; infinite where a value is not finite, and 0 where it may fall to either side of a jump.
        The error counts where something changes."""
        largest = np.zeros(2)
        for case, own in zip(self._cases, self._values):
            got = self._drawn(case, context)
            if np.array_equal(got, own):
                continue
            changed = compare.units_of(got, replace(case.reference, value=own.astype(float)))
            changed[got == own] = 0.0
            if (changed > EQUAL).any():
                changed[compare.undecided(case, got, changed > EQUAL, self.function.units)] = 0.0
            error = compare.judged(case, self._shader, context, got).units
            largest = np.maximum(largest, (changed.max(), np.where(changed > EQUAL, error, 0.0).max()))
        return float(largest[0]), float(largest[1])
