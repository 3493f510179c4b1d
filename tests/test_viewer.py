"""The real window on a display of its own: mouse, keys, dropped files, broken shaders; pictures against compare's."""

import dataclasses
import os
import subprocess
import sys
import time

import numpy as np
import pytest
from imgui_bundle import imgui
from window_session import ALT, SHIFT, Display, Session, frames, shaded, until

from lobe.lab import compare, files, gl, pictures, raster, scene_files, scenes
from lobe.lab.errors import InputError
from lobe.lab.paths import ROOT
from lobe.viewer import app as app_
from lobe.viewer import camera, chooser, command, numbers_panel, objects, picture, plots, scene_panel, truth, window
from lobe.viewer import state as states
from lobe.viewer.state import MODES

SIZE = (800, 560)


@pytest.fixture(scope="module")
def viewer(tmp_path_factory):
    display = Display()
    try:
        session = Session(display, tmp_path_factory.mktemp("viewer"), SIZE)
        yield session
        assert session.close() == 0
    finally:
        display.close()


def fresh(app):
    """The viewer as it starts, with small pictures to be quick."""
    app.state.__dict__.update(states.initial().__dict__)
    app._framed = app.state.object
    app.services.notices.clear()
    frames(app, 2)


def errors(app):
    return [n.text for n in app.services.notices if n.is_error]


# Start.


def started(app, hand):
    for notice in app.services.notices:
        notice.until = 0.0
    frames(app)
    words = [n.text for n in app.services.notices]
    hand.key(app, "d")
    until(app, lambda: app.greeted)
    for notice in app.services.notices:
        notice.until = 0.0
    frames(app)
    assert not app.services.notices, "said once"
    return words, app.window.size, shaded(app), app.services.renderer


def test_the_window_opens_on_a_picture_and_says_what_to_do(viewer):
    words, size, drawn, renderer = viewer.do(started)
    assert len(words) == 1 and "F1" in words[0]
    assert tuple(size) == SIZE and renderer
    assert (drawn[..., 3] > 0).mean() > 0.1 and drawn[..., :3].max() > 0.1


def every_lobe(app, hand):
    fresh(app)
    app.state.mode = "shader"
    drawn = {}
    for name in states.lobes():
        app.state.sides["A"] = [states.default_lobe(name)]
        image = shaded(app)
        drawn[name] = image[image[..., 3] > 0][:, :3].copy()
    return drawn, errors(app)


def test_every_lobe_is_drawn(viewer):
    drawn, wrong = viewer.do(every_lobe)
    assert not wrong and len(drawn) > 20
    for name, values in drawn.items():
        assert np.isfinite(values).all() and (values >= 0).all(), name
        assert values.max() > 1e-4, name


# The pictures are those of the comparison.


def drawn_like(app, hand, scene, key, values, size):
    fresh(app)
    state = app.state
    state.lights = [states.Light(light.kind, light.vector, light.color) for light in scene.lights]
    state.object, state.eye, state.target, state.fov = scene.object, scenes.EYE, scenes.TARGET, scenes.FOV_Y
    state.sides["A"] = [states.Lobe(key, values)]
    made = picture.Picture(app.context, app.programs, app._geometry)
    made.update(state, state.sides["A"], (size, size))
    while not made.whole:
        made.update(state, state.sides["A"], (size, size))
    image = made.read().copy()
    made.release()
    return image


@pytest.mark.parametrize("name, scene", [("lobe_GGX", "teapot-point"), ("lobe_OrenNayar", "suzanne-four"),
                                         ("lobe_GGX_aniso", "teapot-directional")])
def test_the_shader_draws_what_compare_draws(viewer, name, scene):
    place, lobe = scenes.find(scene), states.default_lobe(name)
    function, size = lobe.function, 256
    values = compare.parameter_values(function, place, {})
    case = compare.frame_case(function, place, size, {})
    drawn = viewer.do(drawn_like, place, lobe.key, values, size)
    context = gl.create_context("egl")
    shader = compare.library_shader(function, app_.catalogue.load().text, name)
    with context:
        theirs, primitive = raster.draw(context, place, size, shader.source, shader.call, shader.result, values)
    assert np.array_equal(drawn[..., 3], primitive + 1), "the same triangles"
    inside = case.picture.mask & (primitive >= 0)
    inside[case.picture.mask] &= primitive[case.picture.mask] == case.picture.primitive
    units = compare.units_of(drawn[case.picture.mask][:, :3], case.reference)[inside[case.picture.mask]]
    assert units.max() <= compare.FRAME_UNITS, f"{units.max():.0f} units"
    assert np.abs(drawn[inside][:, :3] - theirs[inside]).max() <= 1e-5 * theirs[inside].max()


def settled_pictures(app, hand, changes):
    fresh(app)
    for name, value in changes.items():
        setattr(app.state, name, value)
    frames(app, 1)
    until(app, lambda: app.services.job.done and app.pictures["A"].whole and app.reference.settled)
    job = app.services.job
    return app.pictures["A"].read().copy(), job.image.copy(), job.samples, job.error, app.display.read()


def test_the_direct_reference_is_the_shader_to_rounding(viewer):
    drawn, reference, samples, error, _ = viewer.do(settled_pictures, {})
    both = drawn[..., 3] == reference[..., 3]
    assert samples == 1 and error == 0
    assert ((drawn[..., 3] > 0) & ~both).sum() <= 2 * compare.MAX_EDGE * both.sum()
    relative = np.abs(drawn[both] - reference[both])[:, :3] / np.maximum(reference[both][:, :3], 1e-3)
    assert relative.max() < 1e-2 and np.quantile(relative, 0.99) < 1e-4 and np.median(relative) < 2e-6
    assert np.median(relative) > 0, "float32 and double are two computations"


def test_an_environment_is_the_same_on_both_sides(viewer):
    environment = states.Environment(states.probes()["lobby"], rotation=70.0)
    drawn, reference, *_ = viewer.do(settled_pictures, {"environment": environment, "lights": []})
    both = drawn[..., 3] == reference[..., 3]
    relative = np.abs(drawn[both] - reference[both])[:, :3] / np.maximum(reference[both][:, :3], 1e-3)
    assert np.quantile(relative, 0.99) < 1e-4
    assert reference[both][:, :3].mean() > 0.05


def test_the_environment_turns_as_the_traced_one_does(viewer, tmp_path):
    """A sphere in a sky that is bright on one side, by the 64 directions and by path tracing of the whole sky."""
    u, v = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(32) + 0.5) / 32)
    sky = 0.01 + np.maximum(np.sin(np.pi * v) * np.sin(2 * np.pi * u), 0) ** 4
    files.write_exr(tmp_path / "sky.exr", {"RGB": np.repeat(sky[..., None], 3, 2).astype(np.float32)})
    sides = {s: [states.default_lobe("lobe_Lambert")] for s in "AB"}
    changes = {"object": "sphere", "lights": [], "depth": 1, "sides": sides,
               "environment": states.Environment(tmp_path / "sky.exr", rotation=20.0)}
    drawn, *_ = viewer.do(settled_pictures, changes)
    traced = viewer.do(traced_picture, changes)
    both = (drawn[..., 3] > 0) & (traced[..., 3] >= truth.OBJECT)
    a, b = (x[both][:, :3].mean(-1) for x in (drawn, traced))
    assert abs(a.mean() / b.mean() - 1) < 0.05
    assert np.corrcoef(a, b)[0, 1] > 0.8, "but for the noise of some samples"


def traced_picture(app, hand, changes):
    """The traced reference of eight samples a pixel and more, its first look being over."""
    fresh(app)
    for name, value in changes.items():
        setattr(app.state, name, value)
    app.state.reference = "traced"
    frames(app, 1)
    job = app.services.job
    until(app, lambda: job.samples >= 8)
    return job.image.copy()


def behind(app, hand, sky, rotation):
    """A sphere before a sky in modes shader and reference, without the sky, and as the reference's paths see it."""
    from lobe import reference

    fresh(app)
    app.state.__dict__.update(object="sphere", lights=[], fov=70.0, exposure=-0.5, mode="shader", eye=(1.0, 2.5, 3.0),
                              environment=states.Environment(sky, rotation, (1.0, 0.5, 2.0)))
    app._framed = "sphere"
    alpha = shaded(app)[..., 3]
    until(app, lambda: app.services.job.done and app.reference.settled)
    shown = [app.display.read()]
    hand.key(app, "2")
    shown.append(app.display.read())
    hand.key(app, "e")
    shown.append(app.display.read())
    traced = reference.Render(objects.traced_scene(app.state), objects.camera(app.state), *app.size, depth=1)
    traced.advance(4)
    return alpha, shown, traced.beauty()


@pytest.mark.parametrize("rotation", [0.0, 72.0, 144.0, 216.0, 288.0])
def test_the_environment_is_seen_where_the_traced_one_is(viewer, tmp_path, rotation):
    """The pictures hold all of the horizon, and so where the file's edges meet."""
    u, v = np.meshgrid((np.arange(1024) + 0.5) / 1024, (np.arange(512) + 0.5) / 512)
    axes = np.sin(np.pi * v) * np.cos(2 * np.pi * u), np.cos(np.pi * v), np.sin(np.pi * v) * np.sin(2 * np.pi * u)
    files.write_exr(tmp_path / "sky.exr", {"RGB": (0.5 + 0.4 * np.stack(axes, -1)).astype(np.float32)})
    alpha, (shader, other, bare), traced = viewer.do(behind, tmp_path / "sky.exr", rotation)
    covered = np.pad(alpha > 0, 1)
    outside = ~(covered[:-2, 1:-1] | covered[2:, 1:-1] | covered[1:-1, :-2] | covered[1:-1, 2:] | covered[1:-1, 1:-1])
    assert 0.3 < outside.mean() < 0.95
    assert np.abs(shader[outside] - as_shown(traced, -0.5)[outside]).max() <= 2
    assert (shader[outside] == other[outside]).all(), "nothing differs there"
    assert len(np.unique(bare[outside], axis=0)) == 1


def traced_progress(app, hand):
    fresh(app)
    app.state.reference = "traced"
    frames(app, 1)
    job = app.services.job
    seen = []
    until(app, lambda: seen.append((job.samples, job.error)) or seen[-1][0] >= 4 and np.isfinite(seen[-1][1]))
    image = job.image.copy()
    app.state.exposure += 1
    frames(app)
    same = app.services.job is job
    camera.orbit(app.state, 0.1, 0.0)
    frames(app)
    status = app._status()
    return seen, image, same, app.services.job is not job and job.cancelled, status


def test_the_traced_reference_gets_better_and_starts_again(viewer):
    seen, image, kept, again, status = viewer.do(traced_progress)
    samples = [n for n, _ in seen]
    assert samples == sorted(samples) and 0 < seen[-1][1] < np.inf
    assert np.isfinite(image).all() and image[image[..., 3] >= truth.OBJECT][:, :3].max() > 0.1
    assert kept, "exposure is the display's alone"
    assert again and status.startswith("reference: ")


def priorities(app, hand):
    """The nice values of the threads that have taken the processor while the reference traced, by what they are."""
    def used():
        found = {}
        for task in os.listdir("/proc/self/task"):
            with open(f"/proc/self/task/{task}/stat") as file:
                name, rest = file.read().rsplit(")", 1)
            numbers = rest.split()
            found[task] = name.split("(")[1], int(numbers[16]), int(numbers[11]) + int(numbers[12])
        return found

    fresh(app)
    app.state.reference, app.state.depth = "traced", 16
    frames(app, 2)
    before, busy = used(), []

    def found():
        new = {task: (name, nice, ticks - before.get(task, (0, 0, 0))[2])
               for task, (name, nice, ticks) in used().items()}
        busy[:] = [seen for task, seen in new.items() if seen[2] > 1 and int(task) != os.getpid()
                   and "llvmpipe" not in seen[0]]
        return busy and app.services.job.samples >= 4

    until(app, found)
    return busy


def test_the_reference_gives_way_to_the_window(viewer):
    busy = viewer.do(priorities)
    assert all(nice >= 10 for _, nice, _ in busy), busy


def slow_picture(app, hand):
    """Pictures of the environment, as if a frame had a thousandth of its time."""
    fresh(app)
    app.state.lights, app.state.environment = [], states.Environment(states.probes()["lobby"])
    app.state.against, app.state.mode = "B", "shader"
    budget, seen = picture.BUDGET, []
    try:
        for picture.BUDGET in (budget, 1e-3 * budget, 1e9):
            camera.orbit(app.state, 0.1, 0.0)
            frames(app, 1)
            moving = app.pictures["A"].texture.size, app.pictures["A"].whole
            image = shaded(app)
            seen.append((moving, app.pictures["A"].texture.size, image))
            camera.orbit(app.state, -0.1, 0.0)
    finally:
        picture.BUDGET = budget
    return seen, app.size


def test_a_slow_picture_is_small_while_it_moves_and_whole_soon_after(viewer):
    (_, slow, fast), size = viewer.do(slow_picture)
    (small, complete), after, image = slow
    assert not complete and small[0] < size[0] / 2 and small[1] < size[1] / 2
    assert after == size
    (_, complete), _, at_once = fast
    assert complete and np.array_equal(image, at_once), "the same picture in strips"


def saved_at_once(app, hand, path):
    """An OpenEXR that is saved while the picture has only its first rows, and the whole picture."""
    fresh(app)
    budget = picture.BUDGET
    try:
        picture.BUDGET = 1e-6
        camera.orbit(app.state, 0.1, 0.0)
        frames(app, 1)
        begun = not app.pictures["A"].whole
        app.save_exr(path)
    finally:
        picture.BUDGET = budget
    return begun, shaded(app)


def test_a_file_has_all_of_the_picture(viewer, tmp_path):
    begun, image = viewer.do(saved_at_once, tmp_path / "p.exr")
    assert begun and np.array_equal(files.read_exr(tmp_path / "p.exr")["shader"], image[..., :3])


# Modes, keys, mouse.


def press_modes(app, hand):
    fresh(app)
    shown = {}
    until(app, lambda: app.services.job.done and app.reference.settled and app.pictures["A"].whole)
    for i, mode in enumerate(MODES):
        hand.key(app, str(i + 1))
        assert app.state.mode == mode, mode
        if mode != "flicker":
            shown[mode] = app.display.read()
    return shown, app.pictures["A"].read().copy(), app.services.job.image.copy(), app.state


def as_shown(image, exposure):
    return np.rint(255 * pictures.srgb(np.maximum(image[..., :3], 0) * 2.0**exposure))


def test_keys_choose_modes_which_show_what_they_say(viewer):
    shown, drawn, reference, state = viewer.do(press_modes)
    inside = drawn[..., 3] == reference[..., 3]
    a, b = as_shown(drawn, state.exposure), as_shown(reference, state.exposure)
    for mode, expected in (("shader", a), ("reference", b)):
        assert np.abs(shown[mode][inside] - expected[inside]).max() <= 1, mode
    columns = np.arange(drawn.shape[1]) < state.divider * drawn.shape[1] - 1
    assert (shown["split"][:, columns] == shown["shader"][:, columns]).all()
    right = np.arange(drawn.shape[1]) > state.divider * drawn.shape[1] + 1
    assert (shown["split"][:, right] == shown["reference"][:, right]).all()


def flickering(app, hand):
    fresh(app)
    app.state.against, app.state.sides["B"] = "B", [states.default_lobe("lobe_Lambert")]
    shown = []
    for app.state.mode in ("shader", "reference"):
        shaded(app, "A"), shaded(app, "B")
        shown.append(app.display.read())
    app.state.mode = "flicker"
    seen = {}
    until(app, lambda: seen.update({app.display.read().tobytes(): None}) or len(seen) >= 2)
    return [x.tobytes() for x in shown], list(seen)


def test_flicker_shows_one_and_the_other(viewer):
    shown, seen = viewer.do(flickering)
    assert shown[0] != shown[1] and set(seen) == set(shown)


def test_the_difference_is_signed(viewer):
    changes = {"against": "B", "mode": "difference", "scale": 1.0}
    shown, drawn, other = viewer.do(difference_picture, changes)
    d = np.take_along_axis(drawn - other, np.abs(drawn - other).argmax(-1)[..., None], -1)[..., 0]
    zero, more, less = (np.array(c) for c in (pictures.ZERO, pictures.POSITIVE, pictures.NEGATIVE))
    x = np.clip(d, -1, 1)[..., None]
    expected = zero * (1 - np.abs(x)) + np.where(x < 0, less, more) * np.abs(x)
    assert np.abs(shown - expected).max() <= 1.01
    assert (d > 0.1).any() and (d < -0.1).any()


def difference_picture(app, hand, changes):
    fresh(app)
    for name, value in changes.items():
        setattr(app.state, name, value)
    app.state.sides = {"A": [states.default_lobe("lobe_Lambert")], "B": app.state.sides["A"]}
    drawn, other = (shaded(app, side) for side in "AB")
    inside = (drawn[..., 3] > 0) & (drawn[..., 3] == other[..., 3])
    return tuple(x[inside][:, :3].astype(float) for x in (app.display.read(), drawn, other))


def drag_divider(app, hand, to):
    fresh(app)
    x, y, width, height = app.picture_rect
    hand.drag(app, (x + app.state.divider * width, y + height / 2), (x + to * width, y + height / 2))
    return app.state.divider, width, app.state.eye


def test_the_divider_is_dragged(viewer):
    divider, width, eye = viewer.do(drag_divider, 0.25)
    assert abs(divider - 0.25) <= 1 / width
    assert eye == scenes.EYE, "the camera stays"


def move_camera(app, hand):
    fresh(app)
    app.state.mode = "shader"
    x, y, width, height = app.picture_rect
    middle = x + width / 2, y + height / 2
    steps = []

    def note():
        steps.append((app.state.eye, app.state.target))

    note()
    hand.drag(app, middle, (middle[0] + 60, middle[1]))
    note()
    hand.drag(app, middle, (middle[0] + 60, middle[1]), button=3)
    note()
    hand.move(app, *middle)
    hand.button(app, 4, True)
    hand.button(app, 4, False)
    until(app, lambda: app.state.eye != steps[-1][0])
    note()
    hand.key(app, "Left", SHIFT)
    note()
    hand.key(app, "0")
    note()
    return steps


def test_mouse_and_keys_move_the_camera(viewer):
    start, orbited, panned, zoomed, turned, reset = viewer.do(move_camera)

    def distance(step):
        return np.linalg.norm(np.subtract(*step))

    assert orbited[1] == start[1] and orbited[0] != start[0] and distance(orbited) == pytest.approx(distance(start))
    assert panned[1] != orbited[1] and distance(panned) == pytest.approx(distance(orbited))
    assert np.subtract(*panned) == pytest.approx(np.subtract(*orbited), abs=1e-9)
    assert distance(zoomed) == pytest.approx(0.9 * distance(panned))
    assert turned[0] != zoomed[0] and turned[1] == zoomed[1]
    assert reset == start


def drag_light(app, hand):
    fresh(app)
    app.layout.tab = "Scene"
    places, ball = [], scene_panel.ball

    def watched(state, vector):
        at, em = imgui.get_cursor_screen_pos(), imgui.get_font_size()
        places.append((at.x + 3 * em, at.y + 3 * em, 3 * em))
        return ball(state, vector)

    scene_panel.ball = watched
    try:
        frames(app)
        x, y, radius = places[0]
        hand.drag(app, (x, y), (x + 0.6 * radius, y - 0.5 * radius))
    finally:
        scene_panel.ball = ball
        app.layout.tab = "Numbers"
        frames(app)
    return app.state.lights[0].vector, camera.basis(app.state)


def test_a_light_is_dragged_on_its_ball(viewer):
    vector, basis = viewer.do(drag_light)
    length = np.linalg.norm(states.initial().lights[0].vector)
    assert np.linalg.norm(vector) == pytest.approx(length)
    assert basis @ vector / length == pytest.approx((0.6, 0.5, np.sqrt(1 - 0.6**2 - 0.5**2)), abs=0.05)


def other_keys(app, hand):
    fresh(app)
    app.state.mode = "shader"
    seen = {}
    for key, modifiers, what in (("x", (), lambda: app.state.sides["B"][0].key),
                                 ("n", (), lambda: app.state.sides["A"][0].key),
                                 ("b", (), lambda: app.state.against), ("r", (), lambda: app.state.reference),
                                 ("t", (), lambda: app.state.tone), ("o", (), lambda: app.state.object),
                                 ("F1", (), lambda: app.help), ("Escape", (), lambda: app.help),
                                 ("Left", (ALT,), lambda: app.state.lights[0].vector)):
        before = what()
        hand.key(app, key, *modifiers)
        seen[key] = before, what()
    return seen, errors(app)


def test_other_keys_do_what_the_help_says(viewer):
    seen, wrong = viewer.do(other_keys)
    assert not wrong
    for key, (before, after) in seen.items():
        assert before != after, key
    known, (before, after) = list(states.lobes()), seen["n"]
    assert known.index(after) == (known.index(before) + 1) % len(known)
    assert seen["b"] == ("reference", "B") and seen["F1"] == (False, True)


def hover(app, hand):
    fresh(app)
    until(app, lambda: app.services.job.done)
    p = pointed_at(app, hand)
    return p, shaded(app)[p.y, p.x], app.services.job.image[p.y, p.x]


def pointed_at(app, hand):
    """What is told of a pixel of the object in the state as it is now."""
    x, y, width, height = app.picture_rect
    hand.move(app, x + 0.4 * width, y + 0.6 * height)
    app.services.pixel = None  # of an older state
    until(app, lambda: app.services.pixel is not None)
    return app.services.pixel


def hover_against(app, hand):
    fresh(app)
    app.state.against = "B"
    app.state.sides["B"] = [states.default_lobe("lobe_Lambert")]
    p = pointed_at(app, hand)
    return p, *(shaded(app, side)[p.y, p.x] for side in "AB")


def test_the_pixel_of_two_lobes_is_told_of_both(viewer):
    p, A, B = viewer.do(hover_against)
    assert (p.f_glsl * p.E).sum(0) == pytest.approx(A[:3], rel=1e-4)
    assert (p.f_B * p.E).sum(0) == pytest.approx(B[:3], rel=1e-4)


def test_the_pixel_under_the_mouse_is_told(viewer):
    p, shader, reference = viewer.do(hover)
    for v in (p.N, p.T, p.V, *p.L):
        assert np.linalg.norm(v) == pytest.approx(1, abs=1e-6)
    assert abs(float(p.N @ p.T)) < 1e-6
    assert (p.f_reference * p.E).sum(0) == pytest.approx(reference[:3], rel=1e-5)
    assert (p.f_glsl * p.E).sum(0) == pytest.approx(shader[:3], rel=1e-4)
    assert 0 <= p.units.max() <= 8


# Files.


def drop(app, hand, path):
    app.services.notices.clear()
    before = dataclasses.asdict(app.state)
    app.window.dropped.append(path)
    frames(app, 3)
    return errors(app), before, dataclasses.asdict(app.state)


@pytest.fixture
def triangle(tmp_path):
    path = tmp_path / "three.obj"
    path.write_text("v -1 -1 0\nv 1 -1 0\nv 0 1 0\nv 0 0 -1\nf 1 2 3\nf 2 1 4\n")
    return path


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_a_mesh_is_dropped(viewer, tmp_path, suffix):
    import trimesh

    path = tmp_path / f"box{suffix}"
    trimesh.creation.box().export(path)
    viewer.do(start_again)
    wrong, _, after = viewer.do(drop, path)
    assert not wrong and after["object"] == str(path)


def start_again(app, hand):
    fresh(app)


def test_an_environment_is_dropped(viewer, tmp_path):
    path = tmp_path / "sky.exr"
    files.write_exr(path, {"RGB": np.ones((8, 16, 3), np.float32)})
    viewer.do(start_again)
    wrong, _, after = viewer.do(drop, path)
    assert not wrong and after["environment"]["file"] == path


BROKEN = {
    "note.txt": (b"hello", "unknown kind"),
    "noext": (b"hello", "unknown kind"),
    "gone.obj": (None, "no such file"),
    "cut.ply": (b"ply\nformat ascii 1.0\nelement vertex 3\n", "cut.ply"),
    "points.obj": (b"v 0 0 0\n", "points.obj"),
    "nan.obj": (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1"),
    "cut.exr": (b"\x76\x2f\x31\x01garbage", "damaged"),
    "same.toml": (b'[camera]\neye=[0,0,5]\ntarget=[0,0,5]\n[materials.a]\nlobes=[{lobe="lobe_GGX"}]\n'
                  b'[[objects]]\nshape="sphere"\nmaterial="a"\n[environment]\ncolor=1\n', "same.toml:1: camera: eye"),
    "no.exr": (b"GIF89a", "not an OpenEXR"),
    "lobe.toml": (b'[camera]\neye=[0,0,5]\ntarget=[0,0,0]\n[materials.a]\nlobes=[{lobe="lobe_Gone"}]\n'
                  b'[[objects]]\nshape="sphere"\nmaterial="a"\n[environment]\ncolor=1\n',
                  "lobe_Gone"),
    "syntax.toml": (b"[camera\n", "syntax.toml:1"),
    "mode.toml": (b'[camera]\neye=[0,0,5]\ntarget=[0,0,0]\n[view]\nmode="sideways"\n', "mode.toml:5"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_no_file_of_ours_is_told_and_changes_nothing(viewer, tmp_path, name):
    content, expected = BROKEN[name]
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    viewer.do(start_again)
    wrong, before, after = viewer.do(drop, path)
    assert len(wrong) == 1 and expected in wrong[0] and "\n" not in wrong[0]
    assert before == after


def test_a_black_environment_is_refused(viewer, tmp_path):
    files.write_exr(tmp_path / "night.exr", {"RGB": np.zeros((8, 16, 3), np.float32)})
    viewer.do(start_again)
    wrong, before, after = viewer.do(drop, tmp_path / "night.exr")
    assert len(wrong) == 1 and "has no light" in wrong[0] and before == after


def save_all(app, hand, folder, against):
    fresh(app)
    app.state.against = against
    app.state.sides["A"] = [states.default_lobe("lobe_Lambert"), states.default_lobe("lobe_GGX")]
    app.state.environment = states.Environment(states.probes()["studio"], 30.0)
    camera.orbit(app.state, 0.3, 0.1)
    app.state.backdrop = False
    app.state.mode, app.state.divider = "difference", 0.25
    pins = [[states.default_lobe("lobe_Phong")]]
    app.state.plots = states.Plots("angle", False, False, (10.0, 45.0), 90.0, "red", True, pins)
    for side in app._sides():
        shaded(app, side)
    until(app, lambda: against == "B" or app.services.job.done)
    for what, name in (("session", "s.toml"), ("png", "p.png"), ("exr", "e.exr")):
        app.finish_path(what, folder / name)
    kept = dataclasses.asdict(app.state)
    fresh(app)
    app.window.dropped.append(folder / "s.toml")
    frames(app)
    return kept, dataclasses.asdict(app.state), app.size, errors(app)


@pytest.mark.parametrize("against", states.AGAINST)
def test_sessions_and_pictures_are_saved(viewer, tmp_path, against):
    kept, opened, size, wrong = viewer.do(save_all, tmp_path, against)
    assert not wrong and opened == kept
    assert files.read_png(tmp_path / "p.png").shape == (size[1], size[0], 3)
    layers = files.read_exr(tmp_path / "e.exr")
    other = "B" if against == "B" else "reference"
    assert np.array_equal(layers["difference"], layers["shader"] - layers[other])
    scene = scene_files.load(tmp_path / "s.toml")
    assert scene.lights == ["point", "directional", "environment"], "the reference renders it, too"
    assert scene.film["width"] == size[0]


FAKE_ZENITY = """#!/bin/sh
printf '%s\\n' "$@" > "$0.arguments"
[ -e "$0.fails" ] && exit 1
echo $$ > "$0.open"
while [ ! -e "$0.answer" ]; do sleep 0.02; done
cat "$0.answer"
rm "$0.answer" "$0.open"
"""


def chosen(app, hand, tool, mesh, picture_file):
    """What the desktop's dialog does with the window: opening, saving, cancelling, failing, and being left open."""
    fresh(app)
    app._paths.clear()
    before, os.environ["PATH"] = os.environ["PATH"], f"{tool.parent}:{os.environ['PATH']}"
    open_, answer, fails = (tool.with_name(f"zenity.{name}") for name in ("open", "answer", "fails"))
    seen = {}

    def is_open():
        return open_.exists() and open_.read_text().endswith("\n")

    def dialog(what, answered):
        app.choose_path(what)
        until(app, is_open)
        drawn = app._began
        frames(app, 3)
        seen[what] = app._began > drawn and app.asking is None, tool.with_name("zenity.arguments").read_text()
        answer.with_suffix(".part").write_text(answered)
        answer.with_suffix(".part").rename(answer)
        until(app, lambda: app.chooser.asked is None)

    try:
        chooser.QUICK_SECONDS, quick = 0.0, chooser.QUICK_SECONDS
        dialog("png", "")
        cancelled = app.asking is None and not errors(app)
        dialog("png", f"{picture_file}\n")
        dialog("open", f"{mesh}\n")
        chooser.QUICK_SECONDS = float("inf")
        fails.touch()
        app.choose_path("exr")
        until(app, lambda: app.chooser.asked is None)
        own, app.asking = app.asking, None
        fails.unlink()
        app.choose_path("session")
        until(app, is_open)
        app.chooser.close()
        left = [path for path in (f"/proc/{open_.read_text().strip()}",) if os.path.exists(path)]
    finally:
        os.environ["PATH"], chooser.QUICK_SECONDS = before, quick
    return seen, cancelled, app.state.object, own, left, errors(app)


def test_the_desktop_chooses_files_where_it_can(viewer, tmp_path, triangle):
    tool = tmp_path / "bin" / "zenity"
    tool.parent.mkdir()
    tool.write_text(FAKE_ZENITY)
    tool.chmod(0o755)
    seen, cancelled, opened, own, left, wrong = viewer.do(chosen, tool, triangle, tmp_path / "p.png")
    assert all(goes_on for goes_on, _ in seen.values()) and cancelled and not wrong
    assert opened == str(triangle) and files.read_png(tmp_path / "p.png").any()
    assert "*.obj" in seen["open"][1] and "*.exr" in seen["open"][1] and "--save" not in seen["open"][1]
    assert "--save" in seen["png"][1] and "lobe.png" in seen["png"][1]
    assert own == "exr", "the window asks itself where the dialog did not open"
    assert not left, "a dialog that is left open ends with the window"


def without_dialogs(app, hand):
    fresh(app)
    before = os.environ["PATH"]
    try:
        os.environ["PATH"] = ""
        app.choose_path("png")
        frames(app)
        return app.asking, errors(app)
    finally:
        app.asking, os.environ["PATH"] = None, before


def test_the_window_asks_for_files_where_the_desktop_cannot(viewer):
    assert viewer.do(without_dialogs) == ("png", [])


def test_sessions_know_every_plot():
    assert tuple(plots.KINDS) == states.PLOTS


EXAMPLES = {"brushed-disc": "plane", "clay-bunny": "bunny", "furnace": "sphere", "gold-teapot": "teapot",
            "plastic-suzanne": "suzanne"}


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_scenes_open(viewer, name):
    viewer.do(start_again)
    wrong, _, after = viewer.do(drop, ROOT / "examples" / "scenes" / f"{name}.toml")
    assert not wrong and after["object"] == EXAMPLES[name]
    assert after["lights"] or after["environment"]


# Shaders that break.


def break_and_repair(app, hand):
    fresh(app)
    from lobe.lab import paths

    path = paths.GLSL / "ggx.glsl"
    good, drawn = path.read_text(), shaded(app)

    def write(text):
        path.write_text(text)
        os.utime(path, ns=(time.time_ns(), time.time_ns()))
        app._watched = 0.0
        frames(app, 4)

    marker = "vec3 lobe_GGX(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {\n"
    assert marker in good
    line = good[: good.index(marker)].count("\n") + 2
    write(good.replace(marker, marker + "    flaot y = 1.0;\n"))
    write(good.replace(marker, marker + "    flaot x = 1.0;\n"))
    broken, still = errors(app), shaded(app)
    app.state.sides["A"][0].values["alpha"] = (0.5,)
    alive = shaded(app)
    app.state.sides["A"][0].values["alpha"] = (0.3,)
    write(good.replace(marker, marker + "    f0 *= 0.5;\n"))
    changed, wrong = shaded(app), errors(app)
    write(good)
    return broken, f"{path}:{line}", drawn, still, alive, changed, wrong, shaded(app)


def test_a_broken_shader_is_told_by_line_and_the_last_good_one_stays(viewer):
    broken, place, drawn, still, alive, changed, wrong, repaired = viewer.do(break_and_repair)
    assert len(broken) == 1 and place in broken[0]
    assert np.array_equal(still, drawn)
    assert not np.array_equal(alive, drawn), "parameters still act"
    assert not wrong and changed[..., :3].sum() < 0.7 * drawn[..., :3].sum()
    assert np.array_equal(repaired, drawn)


def test_parameters_survive_a_change_of_the_header_where_they_can():
    lobe = states.default_lobe("lobe_GGX")
    lobe.values["alpha"] = (0.7,)
    f0, alpha = lobe.function.parameter("f0"), lobe.function.parameter("alpha")
    other = dataclasses.replace(alpha, name="beta", default=(0.1,))
    changed = dataclasses.replace(lobe.function, parameters=(f0, alpha, other))
    kept = states.matched(lobe, {lobe.key: changed})
    assert kept.values == {"f0": lobe.values["f0"], "alpha": (0.7,), "beta": (0.1,)}
    assert states.matched(lobe, {}).key == states.default_lobe(states.START[0]).key


# Windows of any size.


def resized(app, hand, size):
    import glfw

    fresh(app)
    glfw.set_window_size(app.window._window, *size)
    until(app, lambda: tuple(app.window.size) == size)
    shaded(app)
    return app.picture_rect, app.pictures["A"].full.size


@pytest.mark.parametrize("size", [window.SMALLEST, (1280, 720), SIZE])
def test_the_picture_stays_inside_of_a_window_of_any_size(viewer, size):
    (x, y, width, height), pixels = viewer.do(resized, size)
    assert x > 0 and y > 0 and x + width < size[0] and y + height < size[1]
    assert pixels == (int(width), int(height)) and min(pixels) >= 100


# Without a display.


def lobe(*arguments, **environment):
    inherited = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-m", "lobe.lab", "view", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=inherited | environment)


@pytest.mark.parametrize("name", ["scene.toml", "box.obj"])
def test_a_screenshot_needs_no_display(tmp_path, name):
    import trimesh

    states.save(states.initial(), tmp_path / "scene.toml")
    trimesh.creation.box().export(tmp_path / "box.obj")
    done = lobe(tmp_path / name, "--mode", "split", "--screenshot", tmp_path / "out.png", "--frames", 3,
                "--size", 640, 480)
    assert done.returncode == 0 and not done.stderr
    assert files.read_png(tmp_path / "out.png").shape == (480, 640, 3)


def test_a_screenshot_waits_for_the_numbers():
    app = command.start(dataclasses.replace(states.initial(), object="sphere"), (640, 480), offscreen=True)
    frame, began_complete = app.frame, []

    def watched():
        began_complete.append(numbers_panel.complete(app.services))
        frame()

    app.frame = watched
    command.draw(app, None)
    assert command.settled(app) and numbers_panel.complete(app.services)
    assert began_complete[-1], "what was completed during the last frame is not in the picture"
    app.release()


def test_the_lobe_of_the_command_line_keeps_what_both_have(monkeypatch):
    started = []

    class Started(Exception):
        pass

    def start(state, *others):
        started.append(state)
        raise Started

    monkeypatch.setattr(command, "start", start)
    with pytest.raises(Started):
        command.view(None, None, "lobe_GGX_aniso", (640, 480), None, None, 1.0)
    assert started[0].lobe.key.startswith("lobe_GGX_aniso(") and started[0].lobe.values["f0"] == states.GOLD


@pytest.mark.parametrize("arguments, expected", [
    ((), "--screenshot"), (("thing.fbx",), "unknown kind"),
    (("--mode", "sideways"), "expected one of shader"), (("--lobe", "lobe_GXX"), "did you mean lobe_GGX?"),
    (("--lobe", "lobe_D_GGX(vec3,vec3,float)"), "is no lobe"), (("gone.toml",), "no such file"),
    (("--screenshot", "out.bmp"), "expected a file .png")])
def test_bad_usage_is_one_line(arguments, expected):
    done = lobe(*arguments)
    assert done.returncode == 2 and expected in done.stderr and done.stderr.count("\n") == 1
    assert len(done.stderr) < 300


def test_a_driver_without_float_targets_is_refused():
    class Device:
        info = {"GL_RENDERER": "Old"}

        def texture(self, *arguments, **options):
            raise RuntimeError("GL_INVALID_ENUM")

    with pytest.raises(InputError, match="Old cannot draw into float32"):
        app_.require_float_targets(Device())
