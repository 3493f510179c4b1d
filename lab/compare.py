"""The comparison of GLSL functions with the reference, pixel by pixel and point by point.

One rule everywhere: |got - ref| <= K 2^-24 (1 + kappa) |ref|. An error in *units* is |got - ref| over what follows K,
so that K is the number of units allowed. The GLSL gets float32 inputs; the reference gets the same numbers as doubles.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lobe import reference

from . import domain, geometry, gl, raster, scenes
from .catalogue import EXACT, WIDTHS, Function
from .errors import InputError

FLOAT32_ROUNDOFF = 2.0**-24
SMALLEST_REFERENCE = 1e-30  # below it, 0 <= got <= 2e-30 is enough
JUMP_DISTANCE = 2.0**-22  # an input this near to a jump may fall to either side
MAX_UNDECIDED = 1e-4  # of the pixels
MOST_WEIGHED = 10  # failing pixels beyond that part, so that the row tells how many of a few too many are undecided
NEARBY = 1024  # arguments that are tried about one
HARDWARE_FACTOR = 4  # GPUs may round more coarsely
FRAME_UNITS = 2048  # interpolation included
MAX_EDGE = 3e-3  # of the object's pixels: coverage or triangle differs


@dataclass(frozen=True)
class Values:
    """The reference's answer for rows of inputs: value [n, k], unit [n, k] = 2^-24 (1 + kappa) |value|, and kappa;
    the two last summed, or for kappa the largest, over lights."""

    value: np.ndarray
    unit: np.ndarray
    kappa: np.ndarray


@dataclass(frozen=True)
class Case:
    """Inputs of one function, ready for both sides.

    inputs   name -> float32 [lights, n, width]
    weights  float32 [lights, n, 3], or None for 1
    """

    function: Function
    scene: str
    mode: str
    inputs: dict[str, np.ndarray]
    weights: np.ndarray | None
    reference: Values
    parameters: dict[str, tuple[float, ...]] = field(default_factory=dict)  # those that are equal everywhere
    picture: scenes.Pixels | None = None


@dataclass
class Result:
    """One line of the table, and what the report needs to show it."""

    row: dict  # as in the JSON
    case: Case
    got: np.ndarray | None  # [n, k] float32
    units: np.ndarray | None  # [n, k]; 0 where undecided, and at edge pixels
    image: np.ndarray | None = None  # [h, w, 3], the whole picture as OpenGL drew it; mode frame only
    edge: np.ndarray | None = None  # [h, w], whether coverage or triangle differs; mode frame only


def ratio(row: dict) -> float:
    """The worst error over the allowed one."""
    return row["max_units"] / row["units_allowed"]


@dataclass(frozen=True)
class Shader:
    """GLSL to be compared: its text, the call in terms of the function's parameter names, what to call it, and how many
    units it is allowed."""

    source: str
    call: str
    result: str
    model: str
    label: str
    units: int


_REFERENCE = {f.key: f for f in reference.functions()}


def is_quadrature(function: Function) -> bool:
    """Whether the reference integrates, which takes it milliseconds."""
    return _REFERENCE[function.key].is_quadrature


def require_reference(functions: tuple[Function, ...]) -> None:
    """InputError for a function that the reference does not have."""
    for function in functions:
        if function.key not in _REFERENCE:
            raise InputError(f"{function.path}:{function.line}: {function.key} has no reference, expected it in "
                             f"reference/models/{function.stem}.h, and '#include \"models/{function.stem}.h\"' in "
                             "reference/models.h; then ./lobe builds it")


def shading_case(function: Function, scene: scenes.Scene, size: int, settings: dict) -> Case:
    """Per-pixel inputs from the reference's hit points. Lobes are weighted with each light's irradiance, shadows
    included; terms with 1, and with 0 for a light for which an input is out of the header's range."""
    seen = scenes.pixels(scene, size)
    lights, count = seen.L.shape[:2]
    constants = parameter_values(function, scene, settings)
    vectors = (np.broadcast_to(v, seen.L.shape) for v in (seen.N, seen.T, seen.V))
    frame = (*vectors, seen.L)
    inputs = {}
    for p in function.parameters:
        values = geometry.FORM[p.name](*frame) if p.is_geometry else constants[p.name]
        inputs[p.name] = np.broadcast_to(np.asarray(values, np.float32), (lights, count, p.width))
    weights = seen.E.astype(np.float32) if function.kind == "lobe" else _in_domain(function, inputs)
    return Case(function, scene.name, "shading", inputs, weights, reference_values(function, inputs, weights),
                constants, seen)


def frame_case(function: Function, scene: scenes.Scene, size: int, settings: dict) -> Case:
    """What the reference sees when OpenGL rasterises the mesh itself: pixel centres, in double, no shadows.

    OpenGL computes the cosine of the irradiance and the place on the triangle, too, so that their condition counts here.
    """
    seen = scenes.pixels(scene, size, shadows=False)
    constants = parameter_values(function, scene, settings)
    available = {"N": seen.N, "T": seen.T, "V": seen.V, "L": seen.L} | constants
    shape = seen.L.shape[:2]
    inputs = {p.name: np.broadcast_to(np.asarray(available[p.name]), (*shape, p.width)) for p in function.parameters}
    expected = reference_values(function, inputs, seen.E, _cosine_condition(seen.N, seen.L), _foreshortening(scene, seen))
    return Case(function, scene.name, "frame", inputs, seen.E, expected, constants, seen)


def _foreshortening(scene: scenes.Scene, seen: scenes.Pixels) -> np.ndarray:
    """How much farther a point on each pixel's triangle moves than its picture does, [n, 1]: 1 / |Ng.V|."""
    mesh = scenes.load_mesh(scene.mesh)
    a, b, c = (mesh.vertices[mesh.faces[seen.primitive, k]] for k in range(3))
    cosine = np.abs(geometry.dot(geometry.normalize(np.cross(b - a, c - a)), seen.V))
    return 1 / np.maximum(cosine, FLOAT32_ROUNDOFF)


def _cosine_condition(N: np.ndarray, L: np.ndarray) -> np.ndarray:
    """Condition number of N.L over the components of both unit vectors; 0 below the horizon, where the product is 0."""
    cosine = geometry.dot(N, L)
    change = np.abs(N * (L - cosine * N)).sum(-1, keepdims=True) + np.abs(L * (N - cosine * L)).sum(-1, keepdims=True)
    return np.divide(change, cosine, out=np.zeros_like(cosine), where=cosine > 0)


def points_case(function: Function, count: int, settings: dict, seed: int) -> Case:
    """Stratified inputs over the header's domain."""
    inputs = domain.sample(function, count, seed)
    for name, value in settings.items():
        if function.parameter(name):
            inputs[name] = np.broadcast_to(np.float32(value), inputs[name].shape)
    inputs = {name: x[None] for name, x in inputs.items()}
    return Case(function, "points", "points", inputs, None, reference_values(function, inputs, None), settings)


def parameter_values(function: Function, scene: scenes.Scene, settings: dict) -> dict[str, tuple[float, ...]]:
    """The values of the parameters that are no geometry, as float32 numbers: the user's, else the scene's."""
    return {p.name: tuple(float(np.float32(x)) for x in settings.get(p.name, scene.value(p)))
            for p in function.parameters if not p.is_geometry}


def _in_domain(function: Function, inputs: dict[str, np.ndarray]) -> np.ndarray:
    """Weights [lights, n, 3]: 0 for a light for which an input is out of the header's range, else 1.

    The shader evaluates such a light all the same, and 0 times infinity or NaN is NaN: so that the value stays finite
    beyond the range, too, is tested.
    """
    inside = np.ones((*next(iter(inputs.values())).shape[:2], 1), bool)
    for p in function.parameters:
        if p.kind in ("float", "cosine"):
            inside &= (inputs[p.name] >= np.float32(p.low)) & (inputs[p.name] <= np.float32(p.high))
        elif p.kind == "half" and "N" in inputs:
            inside &= geometry.dot(inputs["N"], inputs[p.name]) >= 0
    return np.broadcast_to(inside.astype(np.float32), (*inside.shape[:2], 3))


def rows(function: Function, inputs: dict[str, np.ndarray]) -> np.ndarray:
    """Inputs packed as the reference takes them: float64 [lights * n, width of all arguments]."""
    columns = [inputs[p.name].reshape(-1, p.width).astype(np.float64) for p in function.parameters]
    return np.ascontiguousarray(np.concatenate(columns, axis=1))


def reference_values(function: Function, inputs: dict[str, np.ndarray], weights: np.ndarray | None,
                     weight_condition: np.ndarray | None = None, magnification: np.ndarray | float = 1.0) -> Values:
    """The reference's answer for inputs, weighted and summed over lights as the shader does it.

    weight_condition   condition number of the weights, [lights, n, 1], where the shader computes them itself
    magnification      of what errors of the inputs cost, [n, 1], where the inputs are interpolated
    """
    value = unit = largest = 0.0
    for light in range(len(next(iter(inputs.values())))):  # one after the other: a probe has 64, each a picture large
        packed = rows(function, {name: x[light] for name, x in inputs.items()})
        f = reference.evaluate(function.key, packed)
        kappa = _condition(function, packed) + (0.0 if weight_condition is None else weight_condition[light])
        kappa = (1 + kappa) * magnification - 1
        weight = np.ones_like(f) if weights is None else weights[light, :, : f.shape[-1]]
        value, unit = value + f * weight, unit + _unit(function, f, kappa) * np.abs(weight)
        largest = np.maximum(largest, kappa)
    return Values(value, unit, largest)


def _condition(function: Function, packed: np.ndarray) -> np.ndarray:
    """Condition numbers; 0 where the reference is a quadrature: too slow to be stepped along each input, and what the
    fit to it states dwarfs rounding."""
    if is_quadrature(function):
        return np.zeros((len(packed), WIDTHS[function.result]))
    return reference.condition(function.key, packed)


def _unit(function: Function, f: np.ndarray, kappa: np.ndarray) -> np.ndarray:
    """What follows K in the tolerance of values f; of the error that an approximation states, a K-th is in it."""
    unit = FLOAT32_ROUNDOFF * (1 + kappa) * np.abs(f)
    if (stated := function.approximation) and stated.name == EXACT:
        unit = unit + stated.error(f) / function.units
    return unit


def units_of(got: np.ndarray, expected: Values) -> np.ndarray:
    """Error in units; infinite where got is not finite. Where the reference is below 1e-30, got must not be negative, and
    it is enough that it is not above 2e-30."""
    tiny = np.abs(expected.value) < SMALLEST_REFERENCE
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        units = np.abs(got - expected.value) / expected.unit
        units[tiny & (got <= 2 * SMALLEST_REFERENCE)] = 0.0
        units[tiny & (got < 0)] = np.inf
    return np.where(np.isfinite(got), units, np.inf)


def library_shader(function: Function, source: str, label: str) -> Shader:
    return Shader(source, function.call, function.result, function.stem, label, function.units)


def compare(case: Case, shader: Shader, context: gl.Context) -> Result:
    """Draws the case with the shader and measures it against the reference."""
    with context:
        got = gl.evaluate(context, shader.source, shader.call, shader.result, case.inputs, case.weights)
    return judged(case, shader, context, got)


def judged(case: Case, shader: Shader, context: gl.Context, got: np.ndarray) -> Result:
    """Measures values that a shader gave for the case against the reference."""
    units = units_of(got, case.reference)
    allowed = shader.units * (HARDWARE_FACTOR if context.is_hardware else 1)
    excused = undecided(case, got, units > allowed, allowed)
    units[excused] = 0.0
    row = _row(case, shader, context, got, units, allowed)
    row["undecided"] = int(excused.any(-1).sum())
    row["pass"] = row["nonfinite"] == 0 and row["max_units"] <= allowed and row["undecided"] <= MAX_UNDECIDED * len(got)
    return Result(row, case, got, units)


def compare_frame(case: Case, scene: scenes.Scene, shader: Shader, context: gl.Context) -> Result:
    """Lets OpenGL rasterise the mesh itself and measures its pixels against a frame_case."""
    seen = case.picture
    with context:
        image, primitive = raster.draw(context, scene, len(seen.mask), shader.source, shader.call, shader.result, case.parameters)
    got, drawn = image[seen.mask], primitive[seen.mask]
    units = units_of(got, case.reference)
    edge = (primitive >= 0) != seen.mask
    edge[seen.mask] = drawn != seen.primitive
    units[edge[seen.mask]] = 0.0
    row = _row(case, shader, context, got, units, FRAME_UNITS)
    row["edge_pixels"] = int(edge.sum())
    row["pass"] = (row["nonfinite"] == 0 and row["max_units"] <= FRAME_UNITS
                   and row["edge_pixels"] <= MAX_EDGE * row["pixels"])
    if scene.name == scenes.SHOWN:
        row["flip"] = flip(seen.picture(case.reference.value), image)
    return Result(row, case, got, units, image, edge)


def flip(expected: np.ndarray, got: np.ndarray) -> float:
    """Mean FLIP difference of two linear pictures, as a display shows them: clipped, sRGB-encoded."""
    import flip_evaluator

    from .pictures import srgb

    return float(flip_evaluator.evaluate(srgb(expected).astype(np.float32), srgb(got).astype(np.float32), "LDR",
                                         applyMagma=False, computeMeanError=True)[1])


def _row(case: Case, shader: Shader, context: gl.Context, got: np.ndarray, units: np.ndarray, allowed: int) -> dict:
    """The JSON row, but for what only the mode knows."""
    expected = case.reference.value
    with np.errstate(invalid="ignore", over="ignore"):
        absolute = np.abs(got - expected)
        counted = np.isfinite(got) & (np.abs(expected) >= SMALLEST_REFERENCE)
        relative = (absolute[counted] / np.abs(expected[counted])) if counted.any() else np.zeros(1)
    finite = absolute[np.isfinite(absolute)]
    return {
        "model": shader.model,
        "function": shader.label,
        "kind": case.function.kind,
        "scene": case.scene,
        "mode": case.mode,
        "context": context.name,
        "renderer": context.renderer,
        "pixels": len(got),
        "nonzero": int((np.abs(expected) >= SMALLEST_REFERENCE).any(-1).sum()),
        "max_abs": float(finite.max(initial=0.0)),
        "max_rel": float(relative.max()),
        "p99_rel": float(np.quantile(relative, 0.99)),
        "rms_rel": float(np.sqrt(np.mean(relative**2))),
        "max_units": float(units.max(initial=0.0)),
        "units_allowed": allowed,
        "flip": None,
        "nonfinite": int((~np.isfinite(got)).any(-1).sum()),
        "undecided": 0,
        "edge_pixels": 0,
    }


def undecided(case: Case, got: np.ndarray, failed: np.ndarray, allowed: int) -> np.ndarray:
    """Where failed values are undecided; nowhere if they are too many, whatever they are."""
    if failed.any(-1).sum() > MAX_UNDECIDED * len(got) + MOST_WEIGHED:
        return np.zeros_like(failed)
    return _undecided(case, got, failed, allowed)


def _undecided(case: Case, got: np.ndarray, failed: np.ndarray, allowed: int) -> np.ndarray:
    """Where a failed value is right for the other side of a jump of the function, nearer than 2^-22 to the input, or of
    the edge of the region where it is 0; or for another azimuth, where the input is that near to a pole."""
    undecided = np.zeros_like(failed)
    lights = next(iter(case.inputs.values())).shape[0]
    packed = rows(case.function, case.inputs).reshape(lights, len(got), -1)
    for n in np.flatnonzero(failed.any(-1)):
        for light in range(lights):
            here, here_unit = _valued(case.function, packed[light, n][None])
            weight = 1.0 if case.weights is None else case.weights[light, n, : got.shape[1]]
            behind = _behind_jumps(case.function.key, packed[light, n])
            if len(behind) == 0 and not here.any():
                edge = weight * _edge_unit(case.function, packed[light, n])
                undecided[n] |= failed[n] & (got[n] >= 0) & (np.abs(got[n] - case.reference.value[n]) <= allowed * edge)
            for there, unit in zip(*_valued(case.function, behind)):
                expected = case.reference.value[n] + weight * (there - here[0])
                close = np.abs(got[n] - expected) <= allowed * (case.reference.unit[n] + weight * (unit - here_unit[0]))
                close |= (np.abs(expected) < SMALLEST_REFERENCE) & (got[n] >= 0) & (got[n] <= 2 * SMALLEST_REFERENCE)
                undecided[n] |= failed[n] & close
            for channel in np.flatnonzero(failed[n] & ~undecided[n]):
                sought = got[n, channel] - case.reference.value[n, channel]
                factor = 1.0 if case.weights is None else float(weight[channel])
                undecided[n, channel] |= factor != 0 and _is_right_nearby(
                    case.function, packed[light, n], channel, here[0, channel] + sought / factor, allowed)
    return undecided


def _is_right_nearby(function: Function, x: np.ndarray, channel: int, sought: float, allowed: int) -> bool:
    """Whether a value is right but for rounding, for directions within 2^-22 of those in x, over which the function more
    than doubles. So it may be at the pole of an azimuth, around which a function takes all values between two bounds:
    no condition number tells of these. Lost digits of a function that is smooth there are no such case."""
    def value(at):
        return reference.evaluate(function.key, at)[:, channel]

    reach = JUMP_DISTANCE * np.concatenate([np.full(p.width, p.kind in ("direction", "half")) for p in function.parameters])
    tried = x + reach * np.random.default_rng(0).uniform(-1, 1, (NEARBY, len(x)))
    f = value(tried)
    above = f >= sought
    if above.all() or not above.any() or not 0 <= 2 * f.min() < f.max():
        return False
    low, high = tried[~above][np.argmax(f[~above])], tried[above][np.argmin(f[above])]
    for _ in range(60):  # towards a place where the function has the value, or jumps past it
        middle = (low + high) / 2
        low, high = (low, middle) if value(middle[None])[0] >= sought else (middle, high)
    return bool((np.abs(value(np.stack([low, high])) - sought) <= allowed * FLOAT32_ROUNDOFF * np.abs(sought)).any())


def _edge_unit(function: Function, x: np.ndarray) -> np.ndarray:
    """What follows K within 2^-22 of arguments at which a function is 0, [k]: past the edge of where it is 0 (beyond the
    critical angle, say) it may rise at once, and there alone the condition number tells of it."""
    beside = x + _steps(x)
    return _unit(function, reference.evaluate(function.key, beside), _condition(function, beside)).max(0)


def _steps(x: np.ndarray) -> np.ndarray:
    """2^-22 along each component of arguments, to both sides."""
    return np.concatenate([np.eye(len(x)), -np.eye(len(x))]) * JUMP_DISTANCE * np.maximum(1.0, np.abs(x))


def _valued(function: Function, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The reference's values and their units at packed arguments, with the least of their condition numbers."""
    f = reference.evaluate(function.key, x)
    return f, _unit(function, f, _condition(function, x).min(0, initial=np.inf))


def _behind_jumps(key: str, x: np.ndarray) -> np.ndarray:
    """Arguments 2^-22 behind each jump within 2^-22 of an input, along each of its components: there the condition
    number, which looks to both sides, is that of the far side alone.

    Bisection keeps the half in which the value changes more. A smooth change shrinks with the interval; a jump stays.
    """
    steps = _steps(x)
    near, far = np.repeat(x[None], len(steps), 0), x + steps
    f_near, f_far = reference.evaluate(key, near), reference.evaluate(key, far)
    whole = np.abs(f_far - f_near).max(-1)
    for _ in range(40):
        middle = (near + far) / 2
        f_middle = reference.evaluate(key, middle)
        first = np.abs(f_middle - f_near).max(-1) > np.abs(f_far - f_middle).max(-1)
        near, far = np.where(first[:, None], near, middle), np.where(first[:, None], middle, far)
        f_near, f_far = np.where(first[:, None], f_near, f_middle), np.where(first[:, None], f_middle, f_far)
    left = np.abs(f_far - f_near).max(-1)
    return (far + steps)[(left > 0.5 * whole) & (left > 0)]
