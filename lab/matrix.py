"""The matrix of a comparison: which functions, in which scenes, modes and contexts; and what of it is kept to be shown."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from . import compare, gl, scenes
from .catalogue import Catalogue, Function
from .compare import Case, Result, Shader
from .errors import InputError

MODES = ("points", "shading", "frame")
SMALLEST_FRAME = 256  # below it too many triangles slip between a rasteriser's 1/256 of a pixel
SEED = 20260


@dataclass(frozen=True)
class Plan:
    """What to compare. `shader_of` gives the GLSL of a function; `settings` are parameters that the user fixed."""

    functions: tuple[Function, ...]
    shader_of: Callable[[Function], Shader]
    scenes: tuple[scenes.Scene, ...]
    modes: tuple[str, ...] = MODES
    contexts: tuple[str, ...] = ("egl",)
    size: int = 256
    points: int = 1 << 16
    settings: dict[str, tuple[float, ...]] = field(default_factory=dict)

    def cells(self) -> Iterator[tuple[Function, str, scenes.Scene | None]]:
        """(function, mode, scene) of each comparison, for one context."""
        for function in self.functions:
            if "points" in self.modes:
                yield function, "points", None
            for scene in self.scenes:
                if not scene.suits(function):
                    continue
                if "shading" in self.modes and not (scene.probe and compare.is_quadrature(function)):
                    yield function, "shading", scene
                if "frame" in self.modes and scene.mesh and not scene.probe and function.takes_vectors:
                    yield function, "frame", scene

    def shading_size(self, scene: scenes.Scene) -> int:
        """Width and height of the pictures of mode shading, pixels: half where a probe's many lights shine."""
        return -(-self.size // 2) if scene.probe else self.size

    @property
    def frame_size(self) -> int:
        """Width and height of the pictures of mode frame, pixels."""
        return max(self.size, SMALLEST_FRAME)


@dataclass
class Outcome:
    """All rows, and the results worth showing: per function and context its picture, its worst scene, its worst point
    and its frame; and the worst failure of a function in a mode, for the functions and modes that fail worst."""

    rows: list[dict] = field(default_factory=list)
    renderers: dict[str, str] = field(default_factory=dict)
    shown: dict[tuple[str, str], Result] = field(default_factory=dict)
    worst: dict[tuple[str, str], Result] = field(default_factory=dict)
    worst_point: dict[tuple[str, str], Result] = field(default_factory=dict)
    frame: dict[tuple[str, str], Result] = field(default_factory=dict)
    failures: dict[tuple[str, str], Result] = field(default_factory=dict)  # by function and mode
    seconds: float = 0.0

    MOST_FAILURES = 12

    @property
    def passed(self) -> bool:
        return all(row["pass"] for row in self.rows)

    def add(self, result: Result) -> None:
        row = result.row
        self.rows.append(row)
        key = (row["function"], row["context"])
        if not row["pass"]:
            self._add_failure(result)
        if row["mode"] == "points":
            self.worst_point[key] = result
        if row["mode"] == "frame" and (row["scene"] == scenes.SHOWN or key not in self.frame):
            self.frame[key] = result
        if row["mode"] == "shading":
            if row["scene"] == scenes.SHOWN or key not in self.shown:
                self.shown[key] = result
            if key not in self.worst or row["max_units"] > self.worst[key].row["max_units"]:
                self.worst[key] = result

    def _add_failure(self, result: Result) -> None:
        def severity(key):
            return compare.ratio(self.failures[key].row)

        key = (result.row["function"], result.row["mode"])
        if key not in self.failures or compare.ratio(result.row) > severity(key):
            self.failures[key] = result
        if len(self.failures) > self.MOST_FAILURES:
            del self.failures[min(self.failures, key=severity)]


def library_plan(catalogue: Catalogue, functions: tuple[Function, ...], **options) -> Plan:
    """A plan for the library's own functions."""
    text = catalogue.text
    return Plan(functions, lambda f: compare.library_shader(f, text, catalogue.label(f)), **options)


def run(plan: Plan, on_result: Callable[[Result], None] = lambda result: None,
        on_step: Callable[[str, int, int], None] = lambda name, done, of: None) -> Outcome:
    """Compares every cell in every context. The reference's values of a cell are computed once for all contexts."""
    started = time.perf_counter()
    outcome = Outcome()
    contexts = [gl.create_context(name) for name in plan.contexts]
    outcome.renderers = {c.name: f"{c.renderer}, OpenGL {c.version}" for c in contexts}
    cells = list(plan.cells())
    if not cells:
        raise InputError("nothing to compare: expected a function, a scene and a mode that suit each other "
                         "(helpers have only --mode points; frames need a mesh and a lobe of N, V, L; f0 scenes need a "
                         "parameter f0)")
    for done, (function, mode, scene) in enumerate(cells):
        shader = plan.shader_of(function)
        on_step(f"{shader.label} {mode} {scene.name if scene else ''}", done, len(cells))
        case = _case(plan, function, mode, scene)
        for context in contexts:
            result = _compare(case, shader, context, scene)
            outcome.add(result)
            on_result(result)
    outcome.seconds = time.perf_counter() - started
    return outcome


def _case(plan: Plan, function: Function, mode: str, scene: scenes.Scene | None) -> Case:
    if mode == "points":
        return compare.points_case(function, plan.points, plan.settings, SEED)
    if mode == "shading":
        return compare.shading_case(function, scene, plan.shading_size(scene), plan.settings)
    return compare.frame_case(function, scene, plan.frame_size, plan.settings)


def _compare(case: Case, shader: Shader, context: gl.Context, scene: scenes.Scene | None) -> Result:
    if case.mode == "frame":
        return compare.compare_frame(case, scene, shader, context)
    return compare.compare(case, shader, context)
