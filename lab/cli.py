"""The command line: `lobe`, or `./lobe` in a checkout. stdout carries only the result, stderr set-up and progress."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import traceback
from pathlib import Path
from typing import Annotated, Optional

import typer

from .errors import InputError

LONGEST_WORD, LONGEST_LINE = 400, 6000  # of a message, in characters: the names of all functions fit

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False,
                  help="Reflectance lobes for GLSL, and the bench that proves them.")

Out = Annotated[Path, typer.Option("--out", help="Folder for what is drawn.")]
Json = Annotated[Optional[str], typer.Option("--json", metavar="FILE", help="Write the results as JSON; - is stdout.")]
Size = Annotated[int, typer.Option("--size", min=8, max=4096, help="Width and height of the pictures, pixels.")]
Settings = Annotated[list[str], typer.Option("--set", metavar="NAME=VALUE", help="Fix a parameter, e.g. alpha=0.05.")]
Mesh = Annotated[Optional[Path], typer.Option("--mesh", help="Your own mesh (OBJ, PLY, STL, glTF) as the object.")]
Metal = Annotated[Optional[Path], typer.Option("--metal", metavar="CSV",
                                               help="Take f0 from measured n,k: wavelength_um,n,k.")]


def show_version(wanted: bool) -> None:
    if wanted:
        from . import bundle, catalogue

        print(f"lobe {bundle.version(catalogue.load())}")
        raise typer.Exit()


@app.callback()
def options(version: Annotated[bool, typer.Option("--version", is_eager=True, callback=show_version,
                                                  help="Show the version and exit.")] = False):
    pass


@app.command()
def compare(
    functions: Annotated[list[str], typer.Argument(help="Functions or files; all where none is named.")] = None,
    scene: Annotated[list[str], typer.Option("--scene", help="Only this scene (repeatable).")] = None,
    mode: Annotated[list[str], typer.Option("--mode", help="points, shading or frame (repeatable).")] = None,
    context: Annotated[str, typer.Option("--context", help="egl, osmesa or all.")] = "egl",
    size: Size = 256,
    points: Annotated[int, typer.Option("--points", min=16, max=1 << 22, help="Inputs a function in mode points.")] = 1 << 16,
    settings: Settings = None,
    mesh: Mesh = None,
    metal: Metal = None,
    quick: Annotated[bool, typer.Option("--quick", help="Sphere and teapot under two lights, small.")] = False,
    glsl: Annotated[list[Path], typer.Option("--glsl", help="Your shader's file(s), to compare `--call` in it.")] = None,
    call: Annotated[Optional[str], typer.Option("--call", help="Call of your function in our parameter names, "
                                                "e.g. 'myGGX(N, V, L, f0, alpha)'.")] = None,
    against: Annotated[Optional[str], typer.Option("--against", help="Our function that yours should equal.")] = None,
    units: Annotated[Optional[int], typer.Option("--units", min=1, help="Units of error that your function is allowed; "
                                                 "as many as ours where not given.")] = None,
    keep: Annotated[bool, typer.Option("--keep", help="Write shader, reference and difference of every picture as "
                                       "OpenEXR, not only of failures.")] = False,
    out: Out = Path("out"),
    json: Json = None,
):
    """Compare shaders with the reference, pixel by pixel. Writes a report."""
    from . import commands

    commands.compare(functions or [], scene or [], mode or [], context, size, points, settings or [], mesh, metal, quick,
                     glsl or [], call, against, units, keep, out, json)


@app.command()
def stability(
    function: Annotated[list[str], typer.Option("--function", help="Only this function or file (repeatable).")] = None,
    context: Annotated[str, typer.Option("--context", help="egl, osmesa, softpipe, lavapipe, swiftshader; or all: the precision matrix.")] = "egl",
    points: Annotated[int, typer.Option("--points", min=64, max=1 << 24, help="Random inputs a function; 2^20, or 2^14 with all.")] = None,
    only: Annotated[list[str], typer.Option("--only", help="cases, random, policy, symmetry, limit, integral, 'off unit' "
                                            "or chart (repeatable).")] = None,
    out: Out = Path("out"),
    json: Json = None,
):
    """Test every function where formulas fail. Singular sets, exact cases, degenerate inputs, symmetries, integrals."""
    from . import commands

    commands.stability(function or [], context, points, only or [], out, json)


@app.command()
def mutate(
    function: Annotated[list[str], typer.Option("--function", help="Only this function or file (repeatable).")] = None,
    jobs: Annotated[int, typer.Option("--jobs", min=1, max=256, help="Processes.")] = 1,
    points: Annotated[int, typer.Option("--points", min=64, max=1 << 24, help="Inputs at which a mutant that the suite lets "
                                        "live is held against the function.")] = 1 << 20,
    out: Out = Path("out"),
    json: Json = None,
):
    """Count the small edits of functions that the tests would miss. Goes on where an interrupted run in the same --out
    was."""
    from . import commands

    commands.mutate(function or [], jobs, points, out, json)


@app.command(name="list")
def list_(names: Annotated[list[str], typer.Argument(help="Functions or files; all where none is named.")] = None,
          json: Json = None):
    """List functions: file, kind, parameters, ranges, units, source."""
    from . import commands

    commands.list_functions(names or [], json)


@app.command()
def bundle(
    names: Annotated[list[str], typer.Argument(help="Functions and constants, e.g. lobe_GGX LOBE_F0_GOLD.")],
    target: Annotated[Optional[str], typer.Option("--target", help="Put this target's #version in front: 330, 410, "
                                                  "450, 460, 300es, 310es, 320es, vulkan.")] = None,
    output: Annotated[Optional[Path], typer.Option("-o", "--output", help="Write here, not to stdout.")] = None,
):
    """Print the named functions and constants, and what they use. One text for one shader: name all that it calls."""
    from . import commands

    commands.bundle(names, target, output)


@app.command(name="eval")
def evaluate(
    function: Annotated[str, typer.Argument(help="A function, e.g. lobe_D_GGX.")],
    values: Annotated[list[str], typer.Argument(metavar="key=value...", help="Arguments; vectors as 0,0,1; directions "
                                       "are brought to unit length.")] = None,
    beyond: Annotated[bool, typer.Option("--any", help="Accept finite values beyond the range that the header "
                                         "states, and directions of any length.")] = False,
    context: Annotated[str, typer.Option("--context", help="egl, osmesa or all.")] = "egl",
    json: Json = None,
):
    """Show GLSL and reference value of one input side by side."""
    from . import commands

    commands.evaluate(function, values or [], beyond, context, json)


@app.command()
def reference(
    what: Annotated[list[str], typer.Argument(metavar="SCENE.toml | LOBE...", help="A scene file (docs/scenes.md), or "
                                              "the lobes that a material sums, e.g. lobe_Lambert lobe_GGX.")] = None,
    scene: Annotated[Optional[str], typer.Option("--scene", help="The scene that shows the lobes, teapot-four where "
                                                 "not given.")] = None,
    size: Annotated[Optional[int], typer.Option("--size", min=1, max=1 << 16, help="Width of the picture, pixels; a "
                                                "scene file keeps its shape.")] = None,
    spp: Annotated[Optional[int], typer.Option("--spp", "--samples", min=1, max=1 << 24,
                                               help="Samples a pixel.")] = None,
    seconds: Annotated[Optional[float], typer.Option("--seconds", min=0.0, help="Stop after this time.")] = None,
    error: Annotated[Optional[float], typer.Option("--error", min=0.0, max=1.0, help="Stop when the standard error is "
                                                   "less than this part of the mean.")] = None,
    threads: Annotated[int, typer.Option("--threads", min=0, max=1024, help="0: one for each core. The picture is the "
                                         "same for any number.")] = 0,
    seed: Annotated[Optional[int], typer.Option("--seed", min=0, max=(1 << 53) - 1,
                                                help="Of the random numbers.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint in --out, if there is "
                                         "one.")] = False,
    strategy: Annotated[Optional[str], typer.Option("--strategy", help="mis, light or lobe: how light is "
                                                    "found.")] = None,
    settings: Settings = None,
    mesh: Mesh = None,
    metal: Metal = None,
    ground: Annotated[bool, typer.Option("--ground", help="Put a white plane under the object.")] = False,
    out: Out = Path("out"),
    json: Json = None,
):
    """Render with the reference: a scene file, or lobes. A scene by path tracing, lobes in direct light; OpenEXR with
    all that is known of each pixel, and a PNG. A scene file's own budget is replaced by --spp, --seconds, --error."""
    from . import commands

    built_in = {"--scene": scene, "--set": settings, "--mesh": mesh, "--metal": metal, "--ground": ground}
    traced = {"--seconds": seconds, "--error": error, "--resume": resume, "--strategy": strategy}
    files = [name for name in what or [] if name.endswith(".toml")]
    if files:
        if len(what) > 1:
            raise InputError(f"reference {' '.join(what)}: expected one scene file, or lobes; a file has its own "
                             "materials")
        commands.refuse(built_in, f"{files[0]} says this itself")
        commands.render(Path(files[0]), size, spp, seconds, error, threads, seed, resume, strategy, out, json)
    else:
        commands.refuse(traced, "expected a scene file, SCENE.toml, with this option")
        commands.reference(what or ["lobe_Lambert"], scene or "teapot-four", size or 512, spp or 16, seed or 0, threads,
                           settings or [], mesh, metal, ground, out, json)


@app.command()
def chart(
    family: Annotated[list[str], typer.Option("--family", help="Only this family or chart (repeatable): fresnel, distribution, "
                                              "gaussian, masking, diffuse, power, specular, albedo.")] = None,
    device: Annotated[str, typer.Option("--device", help="isa (AMD's compiled code, no GPU needed), gl (time on this "
                                        "machine's OpenGL) or all.")] = "isa",
    peers: Annotated[bool, typer.Option("--peers", help="Also LYGIA, three.js and MaterialX, fetched into the cache.")] = False,
    out: Out = Path("out/chart"),
    json: Json = None,
):
    """Chart speed against accuracy: SVG files and a page."""
    from . import commands

    commands.chart(family or [], device, peers, out, json)


@app.command()
def view(
    scene: Annotated[Optional[Path], typer.Argument(metavar="[FILE]", help="A scene file .toml (docs/scenes.md), or a "
                                                    "session that the viewer saved; a mesh .obj .ply .stl .gltf .glb; "
                                                    "an environment .exr.")] = None,
    mode: Annotated[Optional[str], typer.Option("--mode", help="shader, reference, split, difference or "
                                                "flicker.")] = None,
    lobe: Annotated[Optional[str], typer.Option("--lobe", help="The lobe that is shown, e.g. lobe_GGX.")] = None,
    size: Annotated[tuple[int, int], typer.Option("--size", min=320, max=8192, metavar="WIDTH HEIGHT",
                                                  help="Of the window, pixels.")] = (1280, 720),
    screenshot: Annotated[Optional[Path], typer.Option("--screenshot", metavar="FILE.png", help="Draw the window into a "
                                                       "picture; needs no display.")] = None,
    frames: Annotated[Optional[int], typer.Option("--frames", min=1, max=1 << 20, help="End after so many; a screenshot "
                                                  "else waits for the reference.")] = None,
    scale: Annotated[float, typer.Option("--scale", min=0.5, max=4.0, help="Of text and controls in a "
                                         "screenshot.")] = 1.0,
):
    """Open the viewer: a lobe, its reference and their difference."""
    from ..viewer import command

    command.view(scene, mode, lobe, size, screenshot, frames, scale)


@app.command()
def fit(
    data: Annotated[str, typer.Argument(metavar="DATA", help="A CSV table with the columns theta_i, phi_i, theta_o, "
                                        "phi_o (degrees: light and view, theta from the normal, phi from T towards B) "
                                        "and value, or value_r, value_g, value_b (1/sr, without the cosine); optional "
                                        "weight, the solid angle of the row. Or a lobe, e.g. lobe_GGX.")],
    lobes: Annotated[int, typer.Option("--lobes", min=1, max=3, help="Lobes beside the diffuse part.")] = 3,
    settings: Settings = None,
    anisotropic: Annotated[bool, typer.Option("--anisotropic", help="Let Cx and Cy of a table's fit differ; whether a "
                                              "lobe needs it is found out.")] = False,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the random starts.")] = 1,
    output: Annotated[Optional[str], typer.Option("-o", "--output", metavar="FILE",
                                                  help="Write the fit as JSON; - is stdout.")] = None,
):
    """Fit Lafortune's lobes to measurements, or to a lobe. Prints the call of lobe_Lafortune that has them."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # for small matrices threads only wait for each other
    from . import commands

    commands.fit(data, lobes, settings or [], anisotropic, seed, output)


@app.command()
def gallery(
    names: Annotated[list[str], typer.Argument(help="Lobes or files; all where none is named.")] = None,
    context: Annotated[str, typer.Option("--context", help="egl or osmesa.")] = "egl",
    size: Size = 240,
    out: Out = Path("out/gallery"),
    json: Json = None,
):
    """Show every lobe: on the teapot, as polar plots, in history. And where its highlights point."""
    from . import commands

    commands.gallery(names or [], context, size, out, json)


@app.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def test(ctx: typer.Context,
         full: Annotated[bool, typer.Option("--full", help="Also the long tests.")] = False):
    """Run the tests; other arguments go to pytest."""
    from .paths import ROOT

    if not (ROOT / "tests").is_dir():
        raise InputError("test: the installed package has no tests; clone the repository and run ./lobe test there")
    arguments = [sys.executable, "-m", "pytest", *(["--full"] if full else []), *ctx.args]
    raise typer.Exit(subprocess.call(arguments, cwd=ROOT))


def main() -> None:
    """Runs the command line. Exit status 0, 1 (out of tolerance), 2 (bad usage or input), 3 (a fault of Lobe itself), 130
    (Ctrl-C) or 141 (who reads stdout has gone); of 2 and 3 one line on stderr says why."""
    take_streams()
    status = outcome()
    try:
        sys.stdout.flush()
    except OSError as error:
        status = undelivered(error)
    sys.exit(status)


def outcome() -> int | None:
    """The exit status of the command."""
    try:
        return app(sys.argv[1:] or ["--help"], standalone_mode=False)
    except SystemExit as ended:  # Click ends with 1 where a pipe is broken, as if something were out of tolerance
        return undelivered(ended.__context__) if isinstance(ended.__context__, BrokenPipeError) else ended.code
    except InputError as error:
        return fail(str(error))
    except (typer.Abort, KeyboardInterrupt):
        return 130
    except MemoryError:
        return fail("the memory is too small for this; choose a smaller picture, mesh or number of points")
    except OSError as error:
        return undelivered(error) if error.filename is None else internal_error(error)
    except Exception as error:  # Typer's own errors of usage; their class moved between its versions
        if hasattr(error, "format_message"):
            path = error.ctx.command_path if getattr(error, "ctx", None) else "lobe"
            return fail(f"{error.format_message()} (see {path} --help)")
        return internal_error(error)


def take_streams() -> None:
    """Holds the places of closed standard streams, which else the next file to be opened would take; and lets names that
    are no UTF-8 pass through stdout as they came."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    sys.stderr = sys.stderr or open(os.devnull, "w")
    if sys.stdout is None:
        sys.exit(fail("stdout is closed, expected a place for the result; for none, redirect it to /dev/null"))
    sys.stdout.reconfigure(errors="surrogateescape" if sys.stdout.encoding == "utf-8" else "backslashreplace")


def undelivered(error: OSError) -> int:
    """Exit status where stdout did not take the result."""
    sys.stdout = open(os.devnull, "w")  # else Python tries again, and complains
    if isinstance(error, BrokenPipeError):
        return 141
    return fail(f"stdout: cannot be written ({error.strerror}); redirect it to another place")


def fail(message: str, status: int = 2) -> int:
    with contextlib.suppress(OSError):  # who closed stderr wants no words, but the status
        print(f"lobe: {line(message)}", file=sys.stderr)
    return status


def line(message: str) -> str:
    """A message as one line that any terminal shows as it is, whatever bytes of a user's file it quotes."""
    text = " ".join(shortened(word, LONGEST_WORD) for word in message.split())
    return shortened("".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text), LONGEST_LINE)


def shortened(text: str, length: int) -> str:
    return text if len(text) <= length else f"{text[: length // 4]}...{text[3 - length * 3 // 4 :]}"


def internal_error(error: Exception) -> int:
    """One line, as of every error; where it comes from only on request."""
    if os.environ.get("LOBE_TRACEBACK") == "1":
        traceback.print_exception(error)
    return fail(f"internal error: {type(error).__name__}: {error} (LOBE_TRACEBACK=1 shows where)", status=3)
