"""Rendering scene files: budgets, checkpoints, kills, the parts of the OpenEXR, memory; and what the six scenes must show."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import OpenEXR
import pytest

from lobe import reference
from lobe.lab import cli, exr, files, rendering, scene_files
from lobe.lab.errors import InputError
from lobe.lab.paths import ROOT

EXAMPLES = ROOT / "examples" / "scenes"
SCENE = """\
[film]
width = 48
height = 32

[camera]
eye = [0.0, 1.0, 5.0]
target = [0.0, 0.0, 0.0]

[render]
spp = 16

[environment]
color = [0.2, 0.3, 0.4]

[materials.coated]
lobes = [
    { lobe = "lobe_Lambert", albedo = [0.5, 0.1, 0.1] },
    { lobe = "lobe_GGX", f0 = 0.04, alpha = 0.1 },
]

[[objects]]
shape = "sphere"
material = "coated"

[[objects]]
name = "floor"
shape = "plane"
material = "coated"
scale = 5.0
rest_on = -1.0

[[lights]]
name = "key"
type = "rectangle"
center = [1.0, 4.0, 2.0]
target = [0.0, 0.0, 0.0]
size = [1.0, 1.0]
radiance = [10.0, 9.0, 8.0]

[[lights]]
type = "point"
position = [-3.0, 2.0, 2.0]
intensity = 8.0
"""
LIGHTS = ("key", "point", "environment")


@pytest.fixture
def lobe(monkeypatch, capsys, tmp_path):
    """Runs the command line in this process: (exit status, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(SCENE)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["lobe", "reference", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capsys.readouterr()
        return ended.value.code or 0, out, err

    return run


def parts(path):
    """name -> array of each part, as OpenEXR itself reads it."""
    found = {}
    for part in OpenEXR.File(str(path), separate_channels=True).parts:
        names = sorted(part.channels, key="RGBXYZUVI".index)
        found[part.name()] = np.stack([part.channels[name].pixels for name in names], axis=-1)
    return found


def same_picture(a, b):
    a, b = parts(a), parts(b)
    assert a.keys() == b.keys()
    return all(a[name].tobytes() == b[name].tobytes() for name in a)


# The file.


@pytest.mark.parametrize("width, height", [(1, 1), (7, 5), (33, 16), (21, 17), (64, 300)])
def test_exr_parts_come_back_through_openexr(tmp_path, width, height):
    rng = np.random.default_rng(width)
    written = [exr.Part("beauty", ("R", "G", "B")), exr.Part("a", ("Z", "X")), exr.Part("n", ("I",), "uint32")]
    images = [rng.normal(size=(height, width, 3)).astype("f4"), np.zeros((height, width, 2), "f4"),
              rng.integers(0, 2**32, (height, width)).astype("u4")]
    images[0][0, 0] = np.nan, np.inf, -0.0
    facts = {"text": "Ω", "whole": -5, "large": 2**40, "real": 0.1}
    with exr.Writer(tmp_path / "p.exr", width, height, written, facts) as file:
        for y in range(0, height, 32):
            for i, image in enumerate(images):
                file.write(i, image[y : y + 32])
    read = OpenEXR.File(str(tmp_path / "p.exr"), separate_channels=True)
    assert [p.name() for p in read.parts] == ["beauty", "a", "n"]
    for part, described, image in zip(read.parts, written, images):
        got = np.stack([part.channels[c].pixels for c in described.channels], -1)
        assert got.tobytes() == image.tobytes() and got.dtype == image.dtype
        assert (part.header["text"], part.header["whole"]) == ("Ω", -5)
        assert (part.header["large"], part.header["real"]) == ([2.0**40], [0.1])


def test_picture_has_all_its_parts(lobe, tmp_path):
    status, out, err = lobe("s.toml", "--json", "r.json")
    assert (status, err) == (0, "")
    read = parts(tmp_path / "out" / "s.exr")
    assert set(read) == {"beauty", "variance", "deviation", "samples", "group", *(f"light.{n}" for n in LIGHTS), *rendering.AOVS}
    assert all(image.shape[:2] == (32, 48) for image in read.values())
    np.testing.assert_allclose(sum(read[f"light.{n}"] for n in LIGHTS), read["beauty"], rtol=1e-5, atol=1e-7)
    assert (read["samples"] == 16).all() and (read["variance"] >= 0).all() and read["variance"].any()
    np.testing.assert_allclose(read["deviation"] ** 2, read["variance"], rtol=1e-6, atol=1e-30)

    scene = scene_files.load(tmp_path / "s.toml")
    traced = scene.scene.trace(scene.camera, 48, 32)
    for name in rendering.AOVS:
        expected = np.atleast_3d(traced[name]).astype(read[name].dtype)
        assert read[name].tobytes() == expected.tobytes(), name

    header = OpenEXR.File(str(tmp_path / "out" / "s.exr")).parts[0].header
    (result,) = json.loads((tmp_path / "r.json").read_text())["results"]
    assert header["seed"] == 0 and header["samplesPerPixel"] == 16 == result["samples"]
    assert header["sceneHash"] == result["hash"] and header["seconds"][0] == result["seconds"] > 0
    np.testing.assert_allclose(result["mean"], read["beauty"].mean(axis=(0, 1), dtype=float), rtol=1e-6)
    assert out.startswith("out/s.exr\nout/s.png\n16 samples a pixel")


def test_preview_is_the_beauty_as_displays_show_it(lobe, tmp_path):
    from PIL import Image

    (tmp_path / "s.toml").write_text(SCENE.replace("[film]", "[film]\nexposure = -1"))
    lobe("s.toml", "--spp", 2)
    linear = np.clip(parts(tmp_path / "out" / "s.exr")["beauty"].astype(float) / 2, 0, 1)
    shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055) * 255
    assert np.abs(np.asarray(Image.open(tmp_path / "out" / "s.png")) - shown).max() < 0.51


def test_size_keeps_the_shape_and_layers_can_be_left_out(lobe, tmp_path):
    (tmp_path / "s.toml").write_text(SCENE.replace("[film]", "[film]\nlayers = false"))
    lobe("s.toml", "--size", 24, "--spp", 1)
    read = parts(tmp_path / "out" / "s.exr")
    assert read["beauty"].shape == (16, 24, 3) and not any(name.startswith("light.") for name in read)


# Budgets.


def test_error_stops_where_it_is_reached(lobe, tmp_path):
    (tmp_path / "s.toml").write_text(SCENE.replace("spp = 16", "spp = 4096\nerror = 0.05"))
    assert lobe("s.toml", "--json", "r.json")[0] == 0
    (result,) = json.loads((tmp_path / "r.json").read_text())["results"]
    samples = parts(tmp_path / "out" / "s.exr")["samples"]
    assert result["error"] <= 0.05 and samples.max() == result["samples"] < 4096 and samples.min() < samples.max()


@pytest.mark.parametrize("budget", [("--seconds", "inf"), ("--seconds", "nan"), ("--seconds", "1e308"), ("--error", "nan")])
def test_budgets_without_end_are_refused(lobe, tmp_path, budget):
    status, out, err = lobe("s.toml", *budget)
    assert status == 2 and err.count("\n") == 1 and budget[0] in err and "internal" not in err


def test_budgets_beyond_reach_are_no_fault(lobe):
    for budget in (("--error", 1e-200), ("--error", 5e-324), ("--seconds", 1e9)):
        assert lobe("s.toml", "--spp", 4, *budget)[0] == 0


def test_seconds_stop_and_may_be_resumed(lobe, tmp_path):
    assert lobe("s.toml", "--seconds", 0.2)[0] == 0
    first = parts(tmp_path / "out" / "s.exr")["samples"].max()
    assert lobe("s.toml", "--seconds", 0.2, "--resume")[0] == 0
    assert parts(tmp_path / "out" / "s.exr")["samples"].max() > first > 0


def test_threads_and_pauses_change_no_bit(lobe, tmp_path):
    lobe("s.toml", "--spp", 24, "--threads", 1, "--out", "a")
    for spp in (1, 8, 9, 24):
        status, _, err = lobe("s.toml", "--spp", spp, "--threads", 3, "--out", "b", "--resume")
        assert status == 0 and ("no checkpoint yet" in err) == (spp == 1)
    assert same_picture(tmp_path / "a" / "s.exr", tmp_path / "b" / "s.exr")
    assert (tmp_path / "a" / "s.png").read_bytes() == (tmp_path / "b" / "s.png").read_bytes()
    lobe("s.toml", "--spp", 24, "--seed", 1, "--out", "c")
    assert not same_picture(tmp_path / "a" / "s.exr", tmp_path / "c" / "s.exr")


def test_adaptive_pictures_resume_to_the_same_bits(lobe, tmp_path):
    (tmp_path / "s.toml").write_text(SCENE.replace("[render]", "[render]\nadaptive = true"))
    lobe("s.toml", "--spp", 40, "--threads", 1, "--out", "a")
    for spp in (1, 17, 40):
        lobe("s.toml", "--spp", spp, "--threads", 3, "--out", "b", "--resume")
    assert same_picture(tmp_path / "a" / "s.exr", tmp_path / "b" / "s.exr")
    samples = parts(tmp_path / "a" / "s.exr")["samples"]
    assert 32 < samples.mean() < 48 and samples.min() < 32 and samples.max() > 1.5 * samples.mean()


def test_passes_of_any_length_change_no_bit(lobe, tmp_path, monkeypatch):
    lobe("s.toml", "--spp", 30, "--error", 0.1, "--out", "a")
    monkeypatch.setattr(rendering, "PASS_SECONDS", 0.0)
    lobe("s.toml", "--spp", 30, "--error", 0.1, "--out", "b")
    assert same_picture(tmp_path / "a" / "s.exr", tmp_path / "b" / "s.exr")


@pytest.mark.parametrize("strategy", ["light", "lobe"])
def test_strategies_agree(lobe, tmp_path, strategy):
    lobe("s.toml", "--spp", 64, "--out", "a")
    lobe("s.toml", "--spp", 64, "--out", "b", "--strategy", strategy)
    a, b = (parts(tmp_path / x / "s.exr") for x in "ab")
    assert not (a["beauty"] == b["beauty"]).all()
    errors = [rendering.error_of_mean(x["deviation"].astype(float), x["group"][..., 0]) for x in (a, b)]
    assert (np.abs((a["beauty"] - b["beauty"]).mean(axis=(0, 1), dtype=float)) < 4 * np.hypot(*errors)).all()


def test_folders_in_the_places_of_files_are_told_before_the_work(lobe, tmp_path):
    for name in ("s.exr", "s.png", "s.checkpoint"):
        (tmp_path / "out" / name).mkdir(parents=True)
        status, out, err = lobe("s.toml", "--spp", 1)
        assert (status, out) == (2, "") and err.count("\n") == 1 and f"out/{name}: exists and is not a regular file" in err
        assert [path.name for path in (tmp_path / "out").iterdir()] == [name]
        (tmp_path / "out" / name).rmdir()


def test_names_that_are_no_utf8(tmp_path):
    """As the file system has them, they come back; in the picture's own facts, where they cannot be, they are escaped."""
    name = os.fsdecode(b"\xff.toml")
    (tmp_path / name).write_text(SCENE)
    done = subprocess.run([sys.executable, "-m", "lobe.lab", "reference", name, "--spp", "1"], cwd=tmp_path,
                          capture_output=True)
    assert done.returncode == 0 and done.stderr == b"" and done.stdout.startswith(b"out/\xff.exr\n")
    (tmp_path / "out" / os.fsdecode(b"\xff.exr")).rename(tmp_path / "x.exr")
    assert OpenEXR.File(str(tmp_path / "x.exr")).parts[0].header["lobeScene"] == "\\udcff"


# Stops and kills.


def test_interrupt_saves_and_resumes_to_the_same_bits(lobe, tmp_path, monkeypatch):
    lobe("s.toml", "--spp", 40, "--out", "a")
    real, calls = rendering.Rendering._progress, []

    def interrupted(self, *arguments):
        calls.append(self.done)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return real(self, *arguments)

    monkeypatch.setattr(rendering.Rendering, "_progress", interrupted)
    status, out, err = lobe("s.toml", "--spp", 40, "--out", "b")
    assert status == 130 and out == "" and f"stopped after {calls[-1]} samples" in err and "--resume" in err
    assert 0 < calls[-1] < 40 and not (tmp_path / "b" / "s.exr").exists()
    assert lobe("s.toml", "--spp", 40, "--out", "b", "--resume")[0] == 0
    assert same_picture(tmp_path / "a" / "s.exr", tmp_path / "b" / "s.exr")


@pytest.mark.parametrize("number", (signal.SIGINT, signal.SIGTERM))
def test_a_signal_saves_and_resumes_to_the_same_bits(lobe, tmp_path, monkeypatch, number):
    """While the tracer works: what it has just done must be counted."""
    from lobe import reference

    lobe("s.toml", "--spp", 40, "--out", "a")
    real = reference.Render

    class Signalled:
        def __init__(self, *arguments, **settings):
            self.render, self.calls = real(*arguments, **settings), 0

        def __getattr__(self, name):
            return getattr(self.render, name)

        def advance(self, samples):
            self.render.advance(samples)
            self.calls += 1
            if self.calls == 3:
                signal.raise_signal(number)

    monkeypatch.setattr(reference, "Render", Signalled)
    handlers = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
    status, out, err = lobe("s.toml", "--spp", 40, "--out", "b")
    assert status == 130 and out == "" and "stopped after" in err and (tmp_path / "b" / "s.checkpoint").exists()
    assert handlers == [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
    monkeypatch.setattr(reference, "Render", real)
    assert lobe("s.toml", "--spp", 40, "--out", "b", "--resume")[0] == 0
    assert same_picture(tmp_path / "a" / "s.exr", tmp_path / "b" / "s.exr")


def test_first_checkpoint_comes_early(lobe, monkeypatch):
    saves = []
    monkeypatch.setattr(rendering, "PASS_SECONDS", 0.0)
    monkeypatch.setattr(rendering, "FIRST_SAVE_SECONDS", 0.0)
    monkeypatch.setattr(rendering.Rendering, "save", lambda self: saves.append(self.done))
    assert lobe("s.toml", "--spp", 8)[0] == 0
    assert saves == [1, 8]


KILLED = """
import sys
from lobe.lab import cli, rendering
rendering.SAVE_SECONDS, rendering.PASS_SECONDS = 0.0, 0.005
sys.argv = ["lobe", "reference", *sys.argv[1:]]
print("ready", flush=True)
cli.main()
"""


def run_killed(folder, arguments, delay):
    """Whether it ended by itself within `delay` seconds after its start; killed where not."""
    process = subprocess.Popen([sys.executable, "-c", KILLED, *arguments], cwd=folder, stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL)
    process.stdout.readline()
    try:
        process.wait(delay)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
    process.stdout.close()
    return process.wait() == 0


def kills(tmp_path, count, spp):
    """Kills a rendering again and again at random moments of the time that it takes here, and looks at what it leaves."""
    seed = random.randrange(2**32)
    print("seed", seed)
    chance = random.Random(seed)
    (tmp_path / "s.toml").write_text(SCENE)
    began = time.monotonic()
    assert run_killed(tmp_path, ["s.toml", "--spp", str(spp), "--out", "whole"], 300)
    took = time.monotonic() - began
    (tmp_path / "b").mkdir()
    shutil.copy(tmp_path / "whole" / "s.exr", tmp_path / "b" / "s.exr")
    shutil.copy(tmp_path / "whole" / "s.png", tmp_path / "b" / "s.png")
    command = ["s.toml", "--spp", str(spp), "--out", "b", "--resume"]
    killed = progressed = 0
    for turn in range(4 * count):  # where nothing has been saved yet, it is tried on
        if turn >= count and killed and progressed:
            break
        before = (tmp_path / "b" / "s.checkpoint").exists()
        killed += not run_killed(tmp_path, command, chance.uniform(0.1, 0.9) * took)
        progressed += before != (tmp_path / "b" / "s.checkpoint").exists()
        assert same_picture(tmp_path / "whole" / "s.exr", tmp_path / "b" / "s.exr")
    assert killed and progressed
    assert run_killed(tmp_path, command, 300)
    assert same_picture(tmp_path / "whole" / "s.exr", tmp_path / "b" / "s.exr")
    left = {path.name for path in (tmp_path / "b").iterdir()}
    assert left == {"s.exr", "s.png", "s.checkpoint"}


def test_kill_leaves_whole_files_and_resumes_to_the_same_bits(tmp_path):
    kills(tmp_path, 5, spp=1500)


@pytest.mark.full
def test_many_kills(tmp_path):
    kills(tmp_path, 60, spp=12000)


def test_leftovers_of_the_dead_are_removed_and_of_the_living_not(tmp_path):
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    names = {f".s.exr.{gone.pid}.01234567.exr": False, f".s.exr.{os.getpid()}.01234567.exr": True,
             f".t.exr.{gone.pid}.01234567.exr": True, ".s.exr.mine.exr": True}
    for name in names:
        (tmp_path / name).write_text("x")
    files.remove_leftovers(tmp_path / "s.exr")
    assert {name: (tmp_path / name).exists() for name in names} == names


@pytest.mark.parametrize("change", [
    lambda path: path.write_text(SCENE.replace("alpha = 0.1", "alpha = 0.2")), "--seed=3", "--size=24", "--strategy=light"])
def test_checkpoint_of_something_else_is_refused(lobe, tmp_path, change):
    lobe("s.toml", "--spp", 2)
    before = {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()}
    options = [change] if isinstance(change, str) else change(tmp_path / "s.toml") and []
    status, out, err = lobe("s.toml", "--spp", 4, "--resume", *options)
    assert status == 2 and err.count("\n") == 1 and "out/s.checkpoint: belongs to another scene" in err
    assert before == {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()}


@pytest.mark.parametrize("error, allowed", [(None, False), (0.05, False), (0.1, True), (0.2, True)])
def test_what_has_stopped_at_an_error_goes_on_to_no_smaller_one(lobe, tmp_path, error, allowed):
    lobe("s.toml", "--error", 0.1, "--spp", 16)
    status, out, err = lobe("s.toml", "--spp", 32, "--resume", *(["--error", error] if error else []))
    assert status == (0 if allowed else 2)
    assert allowed or ("rendered to an error of 0.1" in err and err.count("\n") == 1)


@pytest.mark.parametrize("damage", [
    lambda b: b[:-1], lambda b: b"", lambda b: b"\n", lambda b: b[:-9] + bytes([b[-9] ^ 1]) + b[-8:],
    lambda b: b"{}" + b[b.index(b"\n"):], lambda b: b"\x80" * 100])
def test_damaged_checkpoint_is_refused(lobe, tmp_path, damage):
    lobe("s.toml", "--spp", 2)
    path = tmp_path / "out" / "s.checkpoint"
    path.write_bytes(damage(path.read_bytes()))
    status, out, err = lobe("s.toml", "--spp", 4, "--resume")
    assert status == 2 and err.count("\n") == 1 and "out/s.checkpoint: is damaged" in err and "without --resume" in err


# Bad usage.


@pytest.mark.parametrize("arguments, words", [
    (["s.toml", "lobe_GGX"], ["one scene file, or lobes"]),
    (["s.toml", "s.toml"], ["one scene file"]),
    (["s.toml", "--scene", "teapot-four"], ["--scene", "s.toml says this itself"]),
    (["s.toml", "--ground"], ["--ground"]),
    (["s.toml", "--set", "alpha=1"], ["--set"]),
    (["lobe_GGX", "--seconds", 1], ["--seconds", "expected a scene file"]),
    (["lobe_GGX", "--resume"], ["--resume", "expected a scene file"]),
    (["s.toml", "--strategy", "both"], ["--strategy both", "mis, light, lobe"]),
    (["s.toml", "--spp", 0], ["--spp"]),
    (["s.toml", "--size", 0], ["--size"]),
    (["s.toml", "--seconds", -1], ["--seconds"]),
    (["s.toml", "--seconds", "nan"], ["--seconds"]),
    (["s.toml", "--error", 2], ["--error"]),
    (["s.toml", "--seed", -1], ["--seed"]),
    (["s.toml", "--seed", 2**53], ["--seed"]),
    (["none.toml"], ["none.toml: no such file"]),
    (["s.toml", "--out", "s.toml"], ["s.toml", "cannot write"]),
    (["s.toml", "--size", 65536], ["s.toml:2: film.width", "65536 x 43691 pixels need", "GB are free"]),
])
def test_bad_usage_is_one_line_and_changes_nothing(lobe, tmp_path, arguments, words):
    lobe("s.toml", "--spp", 1)
    before = {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()}
    status, out, err = lobe(*arguments)
    assert status == 2 and out == "" and err.count("\n") == 1 and err.startswith("lobe: ")
    for word in words:
        assert word in err, err
    assert before == {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()}


def test_mistake_in_the_scene_leaves_the_old_picture(lobe, tmp_path):
    lobe("s.toml", "--spp", 1)
    before = (tmp_path / "out" / "s.exr").read_bytes()
    (tmp_path / "s.toml").write_text(SCENE.replace("alpha = 0.1", "alpha = -1"))
    status, out, err = lobe("s.toml")
    assert status == 2 and err.count("\n") == 1 and "s.toml:18: materials.coated.lobes[2].alpha: -1 is out of range" in err
    assert (tmp_path / "out" / "s.exr").read_bytes() == before


def test_notes_go_to_stderr(lobe, tmp_path):
    (tmp_path / "s.toml").write_text(SCENE.replace("position = [-3.0, 2.0, 2.0]", "position = [0, 0, 0]"))
    status, out, err = lobe("s.toml", "--spp", 1)
    assert status == 0 and err.count("\n") == 1 and "lobe: warning: s.toml:" in err and "closed object sphere" in err


def test_lobes_are_still_drawn_on_built_in_scenes(lobe, tmp_path):
    status, out, err = lobe("lobe_GGX", "--scene", "sphere-point", "--size", 16, "--samples", 1)
    assert (status, err) == (0, "") and (tmp_path / "out" / "sphere-point.exr").exists()


# Memory.


def peak(folder, *arguments):
    """Peak resident memory, bytes, of the command line in a process of its own."""
    measured = subprocess.run(["/usr/bin/env", "python3", "-c", PEAK, sys.executable, "-m", "lobe.lab", "reference", *map(str, arguments)],
                              cwd=folder, capture_output=True, text=True)
    assert measured.returncode == 0, measured.stderr
    return int(measured.stdout.split()[-1]) * 1024


@pytest.mark.parametrize("line, limit, used", [("0::/a/b", "memory.max", "memory.current"),
                                               ("4:memory:/a/b", "memory.limit_in_bytes", "memory.usage_in_bytes")])
def test_limits_of_control_groups_count(lobe, tmp_path, monkeypatch, line, limit, used):
    root = tmp_path / "cgroup" / ("memory" if "memory" in line else "")
    (root / "a" / "b").mkdir(parents=True)
    (tmp_path / "own").write_text(f"9:pids:/x\n{line}\n")
    monkeypatch.setattr(rendering, "CGROUPS", tmp_path / "cgroup")
    monkeypatch.setattr(rendering, "OWN_CGROUPS", tmp_path / "own")
    assert rendering.cgroups_memory() == []
    for folder, most in ((root / "a", "9000000"), (root / "a" / "b", "max")):
        (folder / limit).write_text(f"{most}\n")
        (folder / used).write_text("8000000\n")
        (folder / "memory.stat").write_text("anon 7\ninactive_file 500000\nactive_file 3\n")
    assert rendering.cgroups_memory() == [1500000] and rendering.free_memory() == 1500000
    assert lobe("s.toml", "--size", 48, "--spp", 1)[0] == 0
    status, _, err = lobe("s.toml", "--size", 480, "--spp", 1)
    assert status == 2 and "film.width" in err and "choose a smaller picture" in err


PEAK = ("import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True);"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)")


def test_memory_stays_below_three_films(tmp_path):
    (tmp_path / "s.toml").write_text(SCENE)
    small, large = (peak(tmp_path, "s.toml", "--size", size, "--spp", 1) for size in (96, 1056))
    pixels = 1056 * 704 - 96 * 64
    film = (rendering.FILM_BYTES + 3 * rendering.LAYER_BYTES) * pixels
    print(f"{(large - small) / pixels:.0f} bytes a pixel, {(large - small) / film:.2f} films")
    assert large - small < 3 * film


GLASS = SCENE.replace('shape = "sphere"\nmaterial = "coated"', 'shape = "sphere"\nmaterial = "clear"').replace(
    "[[objects]]", "[materials.clear]\nglass = { eta = 1.5 }\n\n[materials.chalk]\n"
    'lobes = [{ lobe = "lobe_Lambert", albedo = 0.5 }]\n\n[[objects]]', 1).replace(
    'shape = "plane"\nmaterial = "coated"', 'shape = "plane"\nmaterial = "chalk"')


GROWTH = """if True:
    import re, sys
    from lobe import reference
    from lobe.lab import scene_files
    def kilobytes(key):  # not getrusage's peak, which a process inherits from who started it
        return int(re.search(key + r":\\s+(\\d+)", open("/proc/self/status").read())[1])
    scene = scene_files.load(sys.argv[1])
    render = reference.Render(scene.scene, scene.camera, 256, 256)
    before = kilobytes("VmRSS")
    render.advance(16)
    print((kilobytes("VmHWM") - before) * 1024)
"""


def test_photons_take_no_more_memory_than_is_asked_for(tmp_path):
    """As many of them as there may be, since there are 2^20 samples."""
    (tmp_path / "s.toml").write_text(GLASS)
    grown = subprocess.run([sys.executable, "-c", GROWTH, tmp_path / "s.toml"], capture_output=True, text=True, check=True)
    asked = reference.guide_bytes(scene_files.load(tmp_path / "s.toml").scene)
    print(f"{int(grown.stdout) / 2**20:.1f} MB, {asked / 2**20:.1f} asked for")
    assert 2**25 < int(grown.stdout) < asked + 2**23 < 2**27  # threads take some, too


def test_photons_must_fit_into_the_memory(tmp_path, monkeypatch):
    for name, text in (("glass", GLASS), ("alone", GLASS.replace("spp = 16", "guided = false")), ("plain", SCENE)):
        (tmp_path / f"{name}.toml").write_text(text)
    monkeypatch.setattr(rendering, "free_memory", lambda: 2**25)
    glass, alone, plain = (scene_files.load(tmp_path / f"{name}.toml") for name in ("glass", "alone", "plain"))
    for scene in (alone, plain):
        rendering.require_memory(scene, rendering.settings(scene, None, None, None))
    with pytest.raises(InputError, match="or guided = false"):
        rendering.require_memory(glass, rendering.settings(glass, None, None, None))


OUTLOOK = 6 * 16**2 * (16 + 16 * 32) * 4  # bytes: axes of a cube's faces, and sums over rows and tiles, floats


def with_probe(tmp_path, name, height):
    image = np.random.default_rng(height).random((height, 2 * height, 3)).astype(np.float32)
    files.write_exr(tmp_path / f"{name}.exr", {"RGB": image})
    path = tmp_path / f"{name}.toml"
    path.write_text(SCENE.replace("color = [0.2, 0.3, 0.4]", f'file = "{name}.exr"'))
    return path


def test_outlooks_must_fit_into_the_memory(tmp_path, monkeypatch):
    """One for each breadth of lobe, here two, where the environment has details and is drawn from."""
    fine, coarse = (scene_files.load(with_probe(tmp_path, f"probe{height}", height)) for height in (64, 32))
    film = 2 * 48 * 32 * (rendering.FILM_BYTES + rendering.LAYER_BYTES * len(fine.lights))

    def takes(scene, strategy, free):
        monkeypatch.setattr(rendering, "free_memory", lambda: free)
        rendering.require_memory(scene, rendering.settings(scene, None, None, strategy))

    for scene, strategy in ((coarse, "mis"), (fine, "lobe")):
        takes(scene, strategy, film)
    for strategy in ("mis", "light"):
        takes(fine, strategy, film + 2 * OUTLOOK)
        with pytest.raises(InputError, match="choose a smaller picture, or layers = false$"):
            takes(fine, strategy, film + 2 * OUTLOOK - 1)


RENDERS = """if True:
    import re, sys
    from lobe import reference
    from lobe.lab import scene_files
    def resident():
        return int(re.search(r"VmRSS:\\s+(\\d+)", open("/proc/self/status").read())[1]) * 1024
    scene = scene_files.load(sys.argv[1])
    renders, sizes = [], [resident()]
    for strategy in ("lobe", "mis"):
        renders.append(reference.Render(scene.scene, scene.camera, 16, 16, strategy=strategy))
        sizes.append(resident())
    print(sizes[1] - sizes[0], sizes[2] - sizes[1])
"""


def test_outlooks_take_as_much_memory_as_is_asked_for(tmp_path):
    path = with_probe(tmp_path, "probe", 64)
    ran = subprocess.run([sys.executable, "-c", RENDERS, path], capture_output=True, text=True, check=True)
    lobe, mis = map(int, ran.stdout.split())
    print(f"{lobe / 1e6:.2f} MB with lobe, {mis / 1e6:.2f} with mis, {2 * OUTLOOK / 1e6:.2f} asked for")
    assert lobe < OUTLOOK / 2 and 1.9 * OUTLOOK < mis < 2.5 * OUTLOOK  # threads take some, too


def test_guided_and_share_reach_the_render(tmp_path):
    def drawn(edit):
        path = tmp_path / "s.toml"
        path.write_text(GLASS.replace("spp = 16", f"spp = 16\n{edit}"))
        scene = scene_files.load(path)
        job = rendering.Rendering(scene, rendering.settings(scene, None, None, None), tmp_path)
        job.render.advance(16)
        return job

    jobs = {edit: drawn(edit) for edit in ("", "guided = false", "share = false")}
    assert len({job.identity for job in jobs.values()}) == 3
    for edit, settings in (("", {}), ("guided = false", {"guided": False}), ("share = false", {"share": False})):
        scene = jobs[edit].scene
        render = reference.Render(scene.scene, scene.camera, 48, 32, layers=jobs[edit].settings.layers, **settings)
        render.advance(16)
        assert np.array_equal(jobs[edit].render.beauty(), render.beauty())
    assert not np.array_equal(jobs[""].render.beauty(), jobs["guided = false"].render.beauty())
    assert not np.array_equal(jobs[""].render.groups(), jobs["share = false"].render.groups())


# The six scenes.


def rendered(lobe, tmp_path, name, spp, size=160, seed=1):
    path = EXAMPLES / f"{name}.toml"
    status, _, err = lobe(path, "--size", size, "--spp", spp, "--seed", seed)
    assert (status, err) == (0, "")
    return parts(tmp_path / "out" / f"{name}.exr")
