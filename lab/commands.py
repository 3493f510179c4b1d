"""What the commands do, apart from how they are spelled."""

from __future__ import annotations

import re
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np

from . import bundle as bundles
from . import catalogue, files, gl, matrix, scenes
from . import compare as compare_
from .catalogue import Catalogue, Function, Parameter
from .errors import InputError

SCHEMA = 1
QUICK_SIZE, QUICK_POINTS = 128, 1 << 14


def selected(library: Catalogue, names: list[str]) -> tuple[Function, ...]:
    """Functions by name, key or file stem; all of them where no name is given."""
    stems = {f.stem: f.functions for f in library.files}
    return tuple(f for name in names for f in stems.get(name) or library.find(name)) if names else library.functions


def parse_settings(pairs: list[str], functions: tuple[Function, ...]) -> dict[str, tuple[float, ...]]:
    """NAME=VALUE pairs, checked against the parameters of the functions. A number stands for each colour channel."""
    settings = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        takers = [p for f in functions if (p := f.parameter(name))]
        if not equals or not takers:
            known = dict.fromkeys(p.name for f in functions for p in f.parameters)
            raise InputError(f"'{pair}': unknown parameter, expected NAME=VALUE with one of {', '.join(known)}")
        settings[name] = parse_value(takers[0], text)
        for p in takers:
            check_range(p, settings[name])
    return settings


def parse_value(parameter: Parameter, text: str) -> tuple[float, ...]:
    try:
        value = tuple(float(np.float32(x)) for x in text.split(","))
    except ValueError:
        value = ()
    value = value * parameter.width if len(value) == 1 else value
    if len(value) != parameter.width or not np.isfinite(value).all():
        raise InputError(f"'{parameter.name}={text}': expected {parameter.width} finite number(s), comma separated")
    return value


def check_range(parameter: Parameter, value: tuple[float, ...]) -> None:
    """InputError where a value is outside the range that the header states."""
    inside = all(np.float32(parameter.low) <= np.float32(x) <= np.float32(parameter.high) for x in value)
    if parameter.kind not in ("direction", "half", "vec3") and not inside:
        raise InputError(f"'{parameter.name}={','.join(f'{x:g}' for x in value)}': out of range, "
                         f"expected {parameter.low:g}..{parameter.high:g}")


def contexts(name: str) -> tuple[str, ...]:
    if name == "all":
        return gl.CONTEXTS
    if name not in gl.CONTEXTS:
        raise InputError(f"--context {name}: expected one of {', '.join((*gl.CONTEXTS, 'all'))}")
    return (name,)


def own_scenes(names: list[str], mesh: Path | None, metal: Path | None) -> tuple[scenes.Scene, ...]:
    """The named scenes (all where none is named), with the user's mesh and metal in place of theirs."""
    chosen = tuple(scenes.find(n) for n in names) or tuple(scenes.SCENES.values())
    if mesh is None and metal is None:
        return chosen
    if mesh is not None:
        scenes.load_mesh(mesh)
    if metal is not None:
        scenes.metal_f0(metal)
    replaced = (scenes.Scene(mesh.stem if mesh else s.object, s.rig, mesh or s.mesh, metal or s.metal) for s in chosen)
    return tuple(dict.fromkeys(replaced))


def compare(functions, scene, mode, context, size, points, settings, mesh, metal, quick, glsl, call, against, units, keep,
            out, json) -> None:
    from . import report
    from .progress import progress

    library = catalogue.load()
    if quick:
        size, points, scene = min(size, QUICK_SIZE), min(points, QUICK_POINTS), scene or list(scenes.QUICK)
    for m in mode:
        if m not in matrix.MODES:
            raise InputError(f"--mode {m}: expected one of {', '.join(matrix.MODES)}")
    foreign = bool(glsl or call or against or units)
    if foreign and (functions or not (glsl and call and against)):
        raise InputError("your own shader needs --glsl FILE, --call 'f(N, V, L, ...)' and --against FUNCTION (--units K if "
                         "you like), and no other function beside them")
    chosen = selected(library, [against] if foreign else functions)
    options = dict(scenes=own_scenes(scene, mesh, metal), modes=tuple(mode) or matrix.MODES, contexts=contexts(context),
                   size=size, points=points, settings=parse_settings(settings, chosen))
    files.output_folder(out)
    if foreign:
        plan = foreign_plan(library, against, glsl, call, units, options)
    else:
        plan = matrix.library_plan(library, chosen, **options)
    images = report.Images(out / "exr", every=keep)
    with progress() as step:
        try:
            outcome = matrix.run(plan, on_result=images.add, on_step=step)
        except gl.CompileError as error:
            raise InputError(compile_message(error, glsl)) from None
    page = report.write(outcome, plan, out)
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": outcome.rows})
    if json != "-":
        print(report.summary(outcome))
        print(f"report: {page}")
    sys.exit(0 if outcome.passed else 1)


def foreign_plan(library: Catalogue, name: str, glsl: list[Path], call: str, units: int | None, options: dict) -> matrix.Plan:
    """A user's function in place of ours, held to the same reference; to our header's units where none are given."""
    function = _overload(library, name, set(re.findall(r"\b[A-Za-z_]\w*\b(?!\s*\()", call)))
    texts = (files.read_bytes(path).decode(errors="replace") for path in glsl)
    source = "".join(gl.numbered(text, i) for i, text in enumerate(texts, 1))
    shader = compare_.Shader(source, call, function.result, "foreign", call.partition("(")[0].strip(),
                             units or function.units)
    return matrix.Plan((function,), lambda f: shader, **options)


def _overload(library: Catalogue, name: str, variables: set[str]) -> Function:
    """The overload of a name whose parameters a call's variables are."""
    overloads = library.find(name)
    known = {p.name for f in overloads for p in f.parameters}
    for function in overloads:
        if variables & known <= {p.name for p in function.parameters}:
            return function
    raise InputError(f"--call: uses {', '.join(sorted(variables & known))} at once, expected the parameters of one of "
                     + "; ".join(f.signature for f in overloads))


def compile_message(error: gl.CompileError, glsl: list[Path]) -> str:
    """One line for a user's shader that does not compile, naming the file where the driver tells it."""
    if 1 <= error.file <= len(glsl):
        return f"{glsl[error.file - 1]}:{error.line}: {error.message}"
    return f"--call: {error.message}" if glsl else f"the shader does not compile: {error.message}"


def list_functions(names: list[str], json: str | None) -> None:
    from rich.console import Console
    from rich.table import Table

    library = catalogue.load()
    chosen = selected(library, names)
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": [_facts(f) for f in chosen]})
    if json == "-":
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("function", "kind", "parameters", "source"):
        table.add_column(column, overflow="fold")
    for f in chosen:
        parameters = ", ".join(f"{p.name} {p.low:g}..{p.high:g}{f' {p.unit}' if p.unit else ''}" if not p.is_geometry
                               or p.kind == "cosine" else p.name for p in f.parameters)
        table.add_row(f"{f.name}\n  {f.stem}.glsl:{f.line}", f.kind, parameters, f.source)
    Console(width=None if sys.stdout.isatty() else 160, soft_wrap=False).print(table)


def _facts(f: Function) -> dict:
    return {"function": f.name, "key": f.key, "signature": f.signature, "file": f"{f.stem}.glsl", "line": f.line,
            "kind": f.kind, "description": f.description, "formula": list(f.formula), "source": f.source,
            "reciprocal": f.reciprocal, "energy": f.energy, "normalised": f.normalised, "units": f.units,
            "approximates": asdict(f.approximation) if f.approximation else None,
            "parameters": [asdict(p) for p in f.parameters]}


def bundle(names: list[str], target: str | None, output: Path | None) -> None:
    text = bundles.bundle(catalogue.load(), names, target)
    if output:
        files.write_text(output, text)
    else:
        sys.stdout.write(text)


def evaluate(name: str, pairs: list[str], context: str, json: str | None) -> None:
    library = catalogue.load()
    given = {pair.partition("=")[0] for pair in pairs}
    overloads = library.find(name)
    function = next((f for f in overloads if given <= {p.name for p in f.parameters}), overloads[0])
    settings = parse_settings(pairs, (function,))
    inputs = {p.name: np.array(settings.get(p.name, p.default), np.float32)[None, None] for p in function.parameters}
    case = compare_.Case(function, "given", "points", inputs, None, compare_.reference_values(function, inputs, None))
    results = []
    for kind in contexts(context):
        shader = compare_.library_shader(function, library.text, library.label(function))
        result = compare_.compare(case, shader, gl.create_context(kind))
        results.append(result.row | {"glsl": result.got[0], "reference": case.reference.value[0],
                                     "units": result.units[0], "kappa": case.reference.kappa[0]})
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": results})
    if json != "-":
        print("\n".join((function.signature, *(f"  {n} = {_numbers(x[0, 0], '.9g')}" for n, x in inputs.items()))))
        for row in results:
            print(f"GLSL       {_numbers(row['glsl'], '.9g')}   ({row['context']}: {row['renderer']})")
            print(f"reference  {_numbers(row['reference'], '.17g')}")
            print(f"units      {_numbers(row['units'], '.3g')} of {row['units_allowed']} allowed, "
                  f"kappa {_numbers(row['kappa'], '.3g')}")
    sys.exit(0 if all(row["pass"] for row in results) else 1)


def _numbers(values: np.ndarray, form: str) -> str:
    return ", ".join(format(float(x), form) for x in np.atleast_1d(values))


def reference(lobes, scene, size, samples, settings, mesh, metal, ground, out, json) -> None:
    """Renders a scene and writes <scene>.exr and <scene>.png."""
    from . import pictures

    library = catalogue.load()
    functions = selected(library, lobes)
    if wrong := [f.name for f in functions if f.kind != "lobe"]:
        raise InputError(f"reference: {wrong[0]} is no lobe, expected some of "
                         + ", ".join(f.name for f in library.functions if f.kind == "lobe"))
    (place,) = own_scenes([scene], mesh, metal)
    chosen = parse_settings(settings, functions)
    built, camera = scenes.build(place, ground=ground)
    material = [(f.key, compare_.parameter_values(f, place, chosen)) for f in functions]
    for thing in range(2 if ground else 1):
        built.set_material(thing, material if thing == 0 else scenes.GROUND_MATERIAL)
    folder = files.output_folder(out)
    layers = built.trace(camera, size, size)
    beauty = built.beauty(camera, size, size, samples=samples)
    lights = {f"{name}{i}": image for name in ("L", "E") for i, image in enumerate(layers.pop(name))}
    files.write_exr(folder / f"{place.name}.exr", {"RGB": beauty.astype(np.float32)} | layers | lights)
    files.write_png(folder / f"{place.name}.png", pictures.srgb(beauty))
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": [
            {"scene": place.name, "lobes": lobes, "size": size, "samples": samples, "mean": beauty.mean(axis=(0, 1)),
             "exr": str(folder / f"{place.name}.exr"), "png": str(folder / f"{place.name}.png")}]})
    if json != "-":
        print(f"{folder / place.name}.exr\n{folder / place.name}.png")
