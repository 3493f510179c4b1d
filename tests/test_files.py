"""Files: what is written comes back, a failure changes nothing, and bad places are refused."""

import json
import os

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from lobe.lab import files
from lobe.lab.errors import InputError


def refusal(call, *arguments):
    with pytest.raises(InputError) as error:
        call(*arguments)
    assert "\n" not in str(error.value)
    return str(error.value)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def layers():
    rng = np.random.default_rng(1)
    return {
        "RGB": rng.normal(0, 1e4, (5, 7, 3)).astype(np.float32),
        "N": rng.normal(size=(5, 7, 3)),
        "depth": rng.normal(size=(5, 7)).astype(np.float32),
        "triangle": rng.integers(0, 2**32, (5, 7)),
        "hit": rng.random((5, 7)) < 0.5,
    }


def test_exr_comes_back_bit_for_bit(layers, tmp_path):
    layers["depth"][0, :3] = np.inf, -np.inf, np.nan
    path = tmp_path / "a.exr"
    files.write_exr(path, layers)
    read = files.read_exr(path)
    assert read.keys() == layers.keys()
    for name, pixels in layers.items():
        expected = pixels.astype(np.float32 if pixels.dtype.kind == "f" else np.uint32)
        assert read[name].dtype == expected.dtype
        assert read[name].tobytes() == expected.tobytes(), name


def test_exr_names_the_channels_of_a_vector(layers, tmp_path):
    files.write_exr(tmp_path / "a.exr", layers)
    channels = OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True).channels()
    assert sorted(channels) == ["B", "G", "N.B", "N.G", "N.R", "R", "depth", "hit", "triangle"]


@pytest.mark.parametrize("lost", [1, 100, 1000, 1200])
def test_truncated_exr_is_refused_in_silence(lost, layers, tmp_path, capfd):
    path = tmp_path / "a.exr"
    files.write_exr(path, layers)
    path.write_bytes(path.read_bytes()[:-lost])
    assert f"{path}: is a truncated or damaged OpenEXR file" in refusal(files.read_exr, path)
    assert capfd.readouterr() == ("", "")


def test_what_is_no_exr_is_refused(tmp_path):
    path = tmp_path / "a.exr"
    path.write_bytes(b"\x89PNG")
    assert f"{path}: is not an OpenEXR file" in refusal(files.read_exr, path)
    path.write_bytes(b"")
    assert f"{path}: is empty" in refusal(files.read_exr, path)
    assert "no such file" in refusal(files.read_exr, tmp_path / "none.exr")
    assert "is a folder" in refusal(files.read_exr, tmp_path)


def test_png_of_floats_and_of_bytes(tmp_path):
    rgb = np.array([[[0.0, 0.5, 1.0], [-1.0, 2.0, 0.1]]])
    files.write_png(tmp_path / "a.png", rgb)
    read = np.asarray(Image.open(tmp_path / "a.png"))
    assert read.tolist() == [[[0, 128, 255], [0, 255, 26]]]
    files.write_png(tmp_path / "b.png", read[:, ::-1])
    assert np.array_equal(np.asarray(Image.open(tmp_path / "b.png")), read[:, ::-1])


def test_json_of_numpy_values_and_without_nan(tmp_path, capsys):
    value = {"schema": 1, "results": [{"pass": np.bool_(True), "pixels": np.int64(9), "rgb": np.array([0.5, np.nan])}],
             "worst": float("inf"), "of": (1, None, "ü")}
    files.write_json(tmp_path / "a.json", value)
    expected = {"schema": 1, "results": [{"pass": True, "pixels": 9, "rgb": [0.5, None]}],
                "worst": None, "of": [1, None, "ü"]}
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8")) == expected
    files.write_json("-", value)
    assert json.loads(capsys.readouterr().out) == expected


def test_a_failure_leaves_the_old_file_and_no_other(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError):
        with files.written_beside(path) as temporary:
            temporary.write_text("half")
            1 / 0
    assert "cannot be written (No space left on device)" in refusal(_fill_disk, path)
    assert path.read_text() == "old" and names(tmp_path) == ["a.txt"]


def _fill_disk(path):
    with files.written_beside(path) as temporary:
        temporary.write_text("half")
        raise OSError(28, "No space left on device")


def test_writing_replaces_the_file_and_makes_the_folder(tmp_path):
    path = tmp_path / "new" / "deep" / "a.txt"
    files.write_text(path, "one\n")
    files.write_text(path, "two\n")
    assert path.read_text() == "two\n" and names(path.parent) == ["a.txt"]
    assert path.stat().st_mode & 0o777 == 0o666 & ~_umask()  # not the 600 of a temporary file


def _umask():
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_a_symbolic_link_keeps_pointing_at_what_is_written(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "target")
    files.write_text(tmp_path / "link", "x")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "target").read_text() == "x"


@pytest.mark.parametrize("write, arguments", [
    (files.write_text, ["x"]), (files.write_json, [{}]), (files.write_exr, [{"Y": np.zeros((2, 2))}]),
    (files.write_png, [np.zeros((2, 2, 3))]),
])
def test_a_place_that_cannot_be_written_is_refused(write, arguments, tmp_path):
    (tmp_path / "file").write_text("old")
    below_a_file = tmp_path / "file" / "a.out"
    assert str(below_a_file.parent) in refusal(write, below_a_file, *arguments)
    assert str(tmp_path) in refusal(write, tmp_path, *arguments)
    assert "/proc/lobe" in refusal(write, "/proc/lobe/a.out", *arguments)
    assert "not a regular file" in refusal(write, "/dev/null", *arguments)
    assert "name" in refusal(write, tmp_path / ("n" * 300), *arguments)
    assert names(tmp_path) == ["file"] and (tmp_path / "file").read_text() == "old"


def test_output_folder(tmp_path):
    assert files.output_folder(tmp_path / "a" / "b").is_dir()
    assert names(tmp_path / "a" / "b") == []
    (tmp_path / "file").write_text("old")
    assert f"{tmp_path / 'file'}: cannot write" in refusal(files.output_folder, tmp_path / "file")
    assert "/proc" in refusal(files.output_folder, "/proc/lobe")
