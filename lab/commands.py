"""What the commands do, apart from how they are spelled."""

from __future__ import annotations

import re
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np

from . import bundle as bundles
from . import catalogue, files, geometry, gl, matrix, scenes
from . import compare as compare_
from .catalogue import Catalogue, Function, Parameter
from .errors import InputError

SCHEMA = 1
QUICK_SIZE, QUICK_POINTS = 128, 1 << 14


def selected(library: Catalogue, names: list[str]) -> tuple[Function, ...]:
    """Functions by name, key or file stem, none where a file holds only constants; all where no name is given."""
    stems = {f.stem: f.functions for f in library.files}
    chosen = tuple(f for n in map(stem, names) for f in (stems[n] if n in stems else library.find(n)))
    return chosen if names else library.functions


def stem(name: str) -> str:
    """A file's as `ggx`, however it was named: ggx, ggx.glsl, glsl/ggx.glsl."""
    return Path(name).stem if name.endswith(".glsl") else name


def measured(library: Catalogue, names: list[str]) -> tuple[Function, ...]:
    """Those selected, at least one, each with a reference."""
    functions = selected(library, names)
    if not functions:
        raise InputError(f"{', '.join(names)}: holds constants only, expected functions; lobe list shows them")
    compare_.require_reference(functions)
    return functions


def parse_settings(pairs: list[str], parameters: list[Parameter], beyond: bool = False) -> dict[str, tuple[float, ...]]:
    """NAME=VALUE pairs, checked against the parameters of that name. A number stands for each colour channel.

    beyond   whether values may lie outside of the ranges that the headers state
    """
    settings = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        takers = [p for p in parameters if p.name == name]
        if not equals or not takers:
            known = dict.fromkeys(p.name for p in parameters)
            raise InputError(f"'{pair}': unknown parameter, expected NAME=VALUE with one of {', '.join(known)}")
        if name in settings:
            raise InputError(f"'{pair}': {name} is given twice, expected one value")
        settings[name] = parse_value(takers[0], text)
        for p in takers:
            if not beyond:
                check_range(p, settings[name])
    return settings


def scene_settings(pairs: list[str], functions: tuple[Function, ...]) -> dict[str, tuple[float, ...]]:
    """parse_settings of what scenes leave open: they form the geometry."""
    for pair in pairs:
        if (name := pair.partition("=")[0]) in geometry.FORM:
            raise InputError(f"--set '{pair}': {name} is geometry, which the scene forms at each pixel, expected "
                             "another parameter; lobe eval takes it")
    return parse_settings(pairs, [p for f in functions for p in f.parameters if not p.is_geometry])


def parse_value(parameter: Parameter, text: str) -> tuple[float, ...]:
    try:
        with np.errstate(over="ignore"):  # what is too large is no finite number
            value = tuple(float(np.float32(x)) for x in text.split(","))
    except ValueError:
        value = ()
    value = value * parameter.width if len(value) == 1 else value
    if len(value) != parameter.width or not np.isfinite(value).all():
        raise InputError(f"'{parameter.name}={text}': expected {parameter.width} finite number(s), comma separated")
    return value


def check_range(parameter: Parameter, value: tuple[float, ...]) -> None:
    """InputError where a value is outside the range that the header states."""
    if not parameter.admits(value):
        raise InputError(f"'{parameter.name}={','.join(f'{x:g}' for x in value)}': out of range, "
                         f"expected {parameter.low:g}..{parameter.high:g}")


def unit(parameter: Parameter, value: tuple[float, ...]) -> tuple[float, ...]:
    """A direction at unit length, which lobes take for granted."""
    if not any(value):
        raise InputError(f"'{parameter.name}={','.join(f'{x:g}' for x in value)}': has no direction, expected a number "
                         "other than 0")
    return tuple(np.array(value) / np.linalg.norm(value))


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
    if mesh is not None and (skipped := scenes.load_mesh(mesh).skipped):
        print(f"lobe: {mesh}: {skipped} degenerate triangle{'s' * (skipped > 1)} skipped", file=sys.stderr)
    if metal is not None:
        scenes.metal_f0(metal)
    replaced = (scenes.Scene(mesh.stem if mesh else s.object, s.rig, mesh or s.mesh, metal or s.metal) for s in chosen)
    return tuple(dict.fromkeys(replaced))


def require_suited(places: tuple[scenes.Scene, ...], functions: tuple[Function, ...], asked: str) -> None:
    """InputError where the option `asked` named scenes, and no function is drawn on one of these."""
    for place in places:
        if any(place.suits(f) for f in functions):
            continue
        names = ", ".join(f.name for f in functions)
        if not any(f.is_shown for f in functions):
            raise InputError(f"{asked}: {names} is drawn on no scene, expected a lobe or a term; helpers are "
                             "compared at points only")
        missing = ", ".join(f"a parameter {name} of {len(value)} numbers" for name, value in place.overrides.items())
        raise InputError(f"{asked}: the scene {place.name} needs {missing}, which {names} has not; choose another "
                         "scene or another function")


def compare(functions, scene, mode, context, size, points, settings, mesh, metal, quick, glsl, call, against, units, keep,
            out, json) -> None:
    from . import report
    from .progress import progress

    library = catalogue.load()
    asked = f"--scene {' '.join(scene)}" if scene else f"--metal {metal}" if metal else ""
    if quick:
        size, points, scene = min(size, QUICK_SIZE), min(points, QUICK_POINTS), scene or list(scenes.QUICK)
    for m in mode:
        if m not in matrix.MODES:
            raise InputError(f"--mode {m}: expected one of {', '.join(matrix.MODES)}")
    foreign = bool(glsl or call or against or units)
    if foreign and (functions or not (glsl and call and against)):
        raise InputError("your own shader needs --glsl FILE, --call 'f(N, V, L, ...)' and --against FUNCTION (--units K if "
                         "you like), and no other function beside them")
    chosen = measured(library, [overload(library, against, call).key] if foreign else functions)
    places = own_scenes(scene, mesh, metal)
    if asked:
        require_suited(places, chosen, asked)
    if foreign and not asked:  # A user's function is judged where ours makes a promise.
        places = tuple(p for p in places if p.is_in_domain(chosen[0]))
    options = dict(scenes=places, modes=tuple(mode) or matrix.MODES, contexts=contexts(context),
                   size=size, points=points, settings=scene_settings(settings, chosen))
    if foreign:
        plan = foreign_plan(chosen[0], glsl, call, units, options)
    else:
        plan = matrix.library_plan(library, chosen, **options)
    output_places(out, json)
    images = report.Images(out / "exr", every=keep)
    with progress() as step:
        try:
            outcome = matrix.run(plan, on_result=images.add, on_step=step)
        except gl.CompileError as error:
            raise InputError(compile_message(error, glsl, chosen[0])) from None
    page = report.write(outcome, plan, out)
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": outcome.rows})
    if json != "-":
        print(report.summary(outcome))
        print(f"report: {page}")
    sys.exit(0 if outcome.passed else 1)


def output_places(out: Path, json: str | None) -> None:
    """InputError where the results could not be written in the end."""
    files.output_folder(out)
    if json and json != "-":
        files.output_file(json)


def foreign_plan(function: Function, glsl: list[Path], call: str, units: int | None, options: dict) -> matrix.Plan:
    """A user's function in place of ours, held to the same reference; to our header's units where none are given."""
    source = "".join(gl.numbered(foreign_text(path), i) for i, path in enumerate(glsl, 1))
    shader = compare_.Shader(source, call, function.result, "foreign", call.partition("(")[0].strip(),
                             units or function.units)
    return matrix.Plan((function,), lambda f: shader, **options)


def foreign_text(path: Path) -> str:
    """The text of a user's file. InputError where it is more than functions: the driver would blame that on the call."""
    content = files.read_bytes(path)
    if b"\0" in content:
        raise InputError(f"{path}: is no text, expected GLSL functions")
    text = content.decode(errors="replace")
    code = re.sub(r"//[^\n]*|/\*.*?\*/", lambda comment: "\n" * comment[0].count("\n"), text, flags=re.S)
    if found := re.search(r"\bvoid\s+main\s*\(|^[ \t]*#[ \t]*include\b", code, flags=re.M):
        what = "#include" if "include" in found[0] else "main()"
        raise InputError(f"{path}:{code.count(chr(10), 0, found.start()) + 1}: {what}, expected only functions; move "
                         "it into another file, and name each file with --glsl")
    return text


def overload(library: Catalogue, name: str, call: str) -> Function:
    """The overload of a name whose parameters a call's variables are: all of them, or else some."""
    overloads = library.find(name)
    known = {p.name for f in overloads for p in f.parameters}
    used = set(re.findall(r"\b[A-Za-z_]\w*\b(?!\s*\()", call)) & known
    fitting = [f for f in overloads if used <= {p.name for p in f.parameters}]
    whole = [f for f in fitting if used == {p.name for p in f.parameters}]
    if not fitting:
        raise InputError(f"--call: uses {', '.join(sorted(used))} at once, expected the parameters of one of "
                         + "; ".join(f.signature for f in overloads))
    if len(whole or fitting) > 1:
        raise InputError(f"--against {name}: --call fits several functions of this name, expected one of "
                         + ", ".join(f'--against "{f.key}"' for f in whole or fitting))
    return (whole or fitting)[0]


def compile_message(error: gl.CompileError, glsl: list[Path], function: Function) -> str:
    """One line for a user's shader that does not compile, naming the file where the driver tells it."""
    if 1 <= error.file <= len(glsl):
        return f"{glsl[error.file - 1]}:{error.line}: {error.message}"
    if glsl:
        known = ", ".join(p.name for p in function.parameters)
        return f"--call: {error.message}; expected a call of your functions with some of {known}"
    return f"the shader does not compile: {error.message}"


def stability(names: list[str], context: str, points: int | None, only: list[str], out: Path, json: str | None) -> None:
    from . import drivers, precision, stability_chart, stability_report
    from . import stability as suite
    from .progress import progress

    library = catalogue.load()
    functions = measured(library, names)
    for name in only:
        if name not in (*suite.SUITES, "chart"):
            raise InputError(f"--only {name}: expected one of {', '.join((*suite.SUITES, 'chart'))}")
    output_places(out, json)
    suites = tuple(only) or suite.SUITES
    matrix, points = None, points or (precision.POINTS if context == "all" else suite.POINTS)
    with progress() as step:
        if context == "all":
            outcome, matrix = precision.measured(library, functions, points, suites, step)
        else:
            outcome = suite.run(library, functions, (suite.Driver(context, drivers.create(context)),), points, suites, step)
        drawn = not only and not names or "chart" in only
        if not outcome.rows and not drawn:
            raise InputError(f"--only {', '.join(only)}: nothing to check in {', '.join(names) or 'the library'}, expected a "
                             "suite that has something; without --only all run")
        curves = stability_chart.measured(library, gl.create_context("egl")) if drawn else []
    page = stability_report.write(outcome, curves, out, points, matrix)
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": outcome.rows} | ({"precision": matrix} if matrix else {}))
    if json != "-":
        if matrix or outcome.rows:
            print(precision.report(matrix) if matrix else stability_report.summary(outcome))
        print(f"page: {page}")
    failing = precision.unexplained(matrix) if matrix else not outcome.passed
    sys.exit(1 if failing else 0)


def mutate(names: list[str], jobs: int, points: int, out: Path, json: str | None) -> None:
    from . import mutation, mutation_report
    from .progress import progress

    library = catalogue.load()
    functions = measured(library, names)
    reasons = mutation.arguments(library)
    output_places(out, json)
    renderer = gl.create_context("egl").renderer
    with progress() as step:
        results = mutation.argued(mutation.run(library, functions, out / "mutation", points, jobs, step), reasons)
    if json:
        files.write_json(json, mutation_report.measured(results, renderer, points))
    if json != "-":
        print(mutation_report.summary(results))
    sys.exit(0 if mutation.passed(results, whole=not names) else 1)


def list_functions(names: list[str], json: str | None) -> None:
    from rich.console import Console
    from rich.table import Table

    library = catalogue.load()
    chosen = selected(library, names)
    constants = [_constant(line, f.stem) for f in library.files if not names or f.stem in map(stem, names)
                 for line in f.constants.values()]
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": [_facts(f) for f in chosen], "constants": constants})
    if json == "-":
        return
    console, shown = Console(width=None if sys.stdout.isatty() else 160, soft_wrap=False), []
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("function", "kind", "parameters", "source"):
        table.add_column(column, overflow="fold")
    for f in chosen:
        parameters = ", ".join(f"{p.name} {p.low:g}..{p.high:g}{f' {p.unit}' if p.unit else ''}" if not p.is_geometry
                               or p.kind == "cosine" else p.name for p in f.parameters)
        table.add_row(f"{f.name}\n  {f.stem}.glsl:{f.line}", f.kind, parameters, f.source)
    if chosen:
        shown.append(table)
    if constants:
        table = Table(box=None, pad_edge=False, header_style="bold")
        for column in ("constant", "value", "file"):
            table.add_column(column, overflow="fold")
        for c in constants:
            table.add_row(c["constant"], c["value"], c["file"])
        shown += [*[""] * bool(chosen), table]
    with console.capture() as text:  # its own print would end with status 1 where the reader has gone
        console.print(*shown, sep="\n")
    sys.stdout.write(text.get())


def _constant(line: str, stem: str) -> dict:
    name, value = re.match(r"const \w+ (\w+) = (.*?);", line).groups()
    return {"constant": name, "value": value, "file": f"{stem}.glsl"}


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


def evaluate(name: str, pairs: list[str], beyond: bool, context: str, json: str | None) -> None:
    library = catalogue.load()
    given = {pair.partition("=")[0] for pair in pairs}
    overloads = library.find(name)
    function = next((f for f in overloads if given <= {p.name for p in f.parameters}), overloads[0])
    compare_.require_reference((function,))
    settings = parse_settings(pairs, list(function.parameters), beyond)
    if not beyond:
        settings |= {p.name: unit(p, settings[p.name]) for p in function.parameters
                     if p.kind == "direction" and p.name in settings}
    outside = [p for p in function.parameters if not p.admits(settings.get(p.name, p.default))]
    inputs = {p.name: np.array(settings.get(p.name, p.default), np.float32)[None, None] for p in function.parameters}
    case = compare_.Case(function, "given", "points", inputs, None, compare_.reference_values(function, inputs, None))
    results = []
    for kind in contexts(context):
        shader = compare_.library_shader(function, library.text, library.label(function))
        result = compare_.compare(case, shader, gl.create_context(kind))
        results.append(result.row | {"glsl": result.got[0], "reference": case.reference.value[0],
                                     "units": result.units[0], "kappa": case.reference.kappa[0],
                                     "in_range": not outside})
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": results})
    if json != "-":
        print("\n".join((function.signature, *(f"  {n} = {_numbers(x[0, 0], '.9g')}" for n, x in inputs.items()))))
        for row in results:
            print(f"GLSL       {_numbers(row['glsl'], '.9g')}   ({row['context']}: {row['renderer']})")
            print(f"reference  {_numbers(row['reference'], '.17g')}")
            print(f"units      {_numbers(row['units'], '.3g')} of {row['units_allowed']} allowed, "
                  f"kappa {_numbers(row['kappa'], '.3g')}")
        if outside:
            print("outside of the stated range, where no tolerance is promised: "
                  + ", ".join(f"{p.name} ({p.low:g}..{p.high:g})" for p in outside))
    sys.exit(0 if all(row["pass"] for row in results) else 1)


def _numbers(values: np.ndarray, form: str) -> str:
    return ", ".join(format(float(x), form) for x in np.atleast_1d(values))


def refuse(options: dict, why: str, command: str = "reference") -> None:
    """InputError where one of the options is given."""
    if given := [name for name, value in options.items() if value]:
        raise InputError(f"{command} {given[0]}: {why}")


def set_threads(count: int) -> None:
    from lobe import reference

    reference.set_threads(count)


def reference(lobes, scene, size, samples, seed, threads, settings, mesh, metal, ground, out, json) -> None:
    """Renders a scene and writes <scene>.exr and <scene>.png."""
    from . import pictures

    library = catalogue.load()
    functions = measured(library, lobes)
    if wrong := [f.name for f in functions if not f.takes_vectors]:
        raise InputError(f"reference: {wrong[0]} is no lobe of N, V, L, expected some of "
                         + ", ".join(f.name for f in library.functions if f.takes_vectors))
    (place,) = own_scenes([scene], mesh, metal)
    require_suited((place,), functions, f"--metal {metal}" if metal else f"--scene {scene}")
    chosen = scene_settings(settings, functions)
    output_places(out, json)
    set_threads(threads)
    built, camera = scenes.build(place, ground=ground)
    material = [(f.key, compare_.parameter_values(f, place, chosen)) for f in functions]
    for thing in range(2 if ground else 1):
        built.set_material(thing, material if thing == 0 else scenes.GROUND_MATERIAL)
    layers = built.trace(camera, size, size)
    beauty = built.beauty(camera, size, size, samples=samples, seed=seed)
    lights = {f"{name}{i}": image for name in ("L", "E") for i, image in enumerate(layers.pop(name))}
    files.write_exr(out / f"{place.name}.exr", {"RGB": beauty.astype(np.float32)} | layers | lights)
    files.write_png(out / f"{place.name}.png", pictures.srgb(beauty))
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": [
            {"scene": place.name, "lobes": lobes, "size": size, "samples": samples, "mean": beauty.mean(axis=(0, 1)),
             "exr": str(out / f"{place.name}.exr"), "png": str(out / f"{place.name}.png")}]})
    if json != "-":
        print(f"{out / place.name}.exr\n{out / place.name}.png")


def render(path, size, spp, seconds, error, threads, seed, resume, strategy, out, json) -> None:
    """Renders a scene file, and writes <scene>.exr, <scene>.png and <scene>.checkpoint."""
    from . import rendering, scene_files
    from .progress import progress

    set_threads(threads)
    scene = scene_files.load(path)
    for note in scene.notes:
        print(f"lobe: warning: {note}", file=sys.stderr)
    settings = rendering.settings(scene, size, seed, strategy)
    budget = rendering.budget(scene, spp, seconds, error)
    output_places(out, json)
    job = rendering.Rendering(scene, settings, out)
    for place in (job.picture, job.preview, job.checkpoint):
        files.output_file(place)
        files.remove_leftovers(place)
    if resume and not job.resume(budget):
        print(f"lobe: {job.checkpoint}: no checkpoint yet, begins a new one", file=sys.stderr)
    try:
        with progress() as step:
            job.advance(budget, step)
    except KeyboardInterrupt:
        print(f"lobe: stopped after {job.done} samples; the same command with --resume goes on", file=sys.stderr)
        sys.exit(130)
    facts = job.write()
    result = {"scene": scene.name, "file": str(path), "width": settings.width, "height": settings.height,
              "samples": facts["samplesPerPixel"], "seconds": facts["seconds"], "error": facts["error"],
              "seed": settings.seed, "mean": facts["mean"], "hash": facts["sceneHash"], "notes": scene.notes,
              "exr": str(job.picture), "png": str(job.preview)}
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": [result]})
    if json != "-":
        error = f", standard error {facts['error']:.2g} of the mean" if np.isfinite(facts["error"]) else ""
        print(f"{job.picture}\n{job.preview}\n{job.done} samples a pixel in {job.seconds:.1f} s{error}")


def chart(family, device, peers, out, json) -> None:
    from . import chart as charts
    from . import cost, families, isa
    from .progress import progress

    if device not in (*cost.DEVICES, "all"):
        raise InputError(f"--device {device}: expected one of {', '.join((*cost.DEVICES, 'all'))}")
    devices = cost.DEVICES if device == "all" else (device,)
    chosen = families.chosen(family)
    if "isa" in devices:
        isa.require_tools()
    output_places(out, json)
    with progress() as step:
        found = cost.measure(chosen, devices, peers, step)
    written = charts.write(found, out)
    if json:
        files.write_json(json, found)
    if json != "-":
        print(charts.summary(found))
        print(f"page: {written[-1]}")


def fit(data: str, count: int, settings: list[str], anisotropic: bool, seed: int, output: str | None) -> None:
    from . import lafortune, samples
    from .progress import progress

    if data.startswith("lobe_"):
        refuse({"--anisotropic": anisotropic}, "whether a lobe needs it is found out; leave it out", "fit")
        function = drawable_lobe(data)
        given, anisotropic = samples.of_function(function, scene_settings(settings, (function,)))
    else:
        refuse({"--set": settings}, "expected a lobe, such as lobe_GGX, with this option", "fit")
        given = samples.read(Path(data))
        if samples.looks_like_radians(given):
            print(f"lobe: warning: {data}: all theta are below 2 degrees; are they radians?", file=sys.stderr)
    if output and output != "-":
        files.output_file(output)
    with progress() as step:
        found = lafortune.fit(given, count, anisotropic, seed, step)
    if output:
        files.write_json(output, {"schema": SCHEMA, **lafortune.facts(found, seed)})
    if output != "-":
        print(lafortune.summary(found))


def drawable_lobe(name: str) -> Function:
    """The lobe of a name that takes N, V, L as vectors. InputError where there is none."""
    found = [f for f in catalogue.load().find(name) if f.takes_vectors]
    if not found:
        raise InputError(f"{name}: is no lobe of N, V and L, expected one such as lobe_GGX; lobe list shows them")
    compare_.require_reference(tuple(found[:1]))
    return found[0]


def gallery(names: list[str], context: str, size: int, out: Path, json: str | None) -> None:
    from . import gallery as shown
    from . import gallery_page
    from .progress import progress

    library = catalogue.load()
    functions = shown.lobes(library, names)
    if not functions:
        raise InputError(f"gallery {' '.join(names)}: no lobe of N, V, L among these, expected some of "
                         + ", ".join(f.name for f in library.functions if f.takes_vectors))
    if context not in gl.CONTEXTS:
        raise InputError(f"--context {context}: expected one of {', '.join(gl.CONTEXTS)}")
    output_places(out, json)
    shade = shown.Shades(library, gl.create_context(context))
    with progress() as step:
        exhibits = shown.exhibits(library, functions, shade, step)
        page = gallery_page.write(exhibits, shade, out, size, step)
    if json:
        files.write_json(json, {"schema": SCHEMA, "results": gallery_page.measured(exhibits, shade)})
    if json != "-":
        print(f"{len(exhibits)} lobes\npage: {page}")
