"""Files that the bench reads and writes. A file is written beside its place and renamed, so that none is ever half."""

import contextlib
import glob
import json
import math
import os
import re
import secrets
import sys
import tempfile
from pathlib import Path

import numpy as np

from .errors import InputError


def read_bytes(path):
    """The content of a file that the user named. InputError where there is none, or nothing in it; and where it is a
    pipe or a device, which may have no end."""
    path = Path(path)
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise InputError(f"{path}: is a pipe or a device, expected a file; write what it holds into one")
        content = path.read_bytes()
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder, expected a file; name a file in it") from None
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    except ValueError:  # a null character
        raise InputError(f"{str(path)!r}: is no file name; check the path") from None
    except MemoryError:
        raise InputError(f"{path}: {path.stat().st_size / 2**30:.1f} GB, more than the memory; choose a smaller "
                         "file") from None
    if not content:
        raise InputError(f"{path}: is empty; export or download it again")
    return content


def output_folder(path):
    """Makes the folder, with its parents, and returns its Path. InputError where nothing can be written into it."""
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=path).close()
    except OSError as error:
        raise InputError(
            f"{path}: cannot write into this folder ({error.strerror}); choose another, or change its permissions"
        ) from None
    return path


def output_file(path):
    """Makes the folder of a file to be written, and returns where it will lie, symbolic links followed. InputError
    where it cannot be written. Who works long before he writes asks this first."""
    try:
        if Path(path).exists() and not Path(path).is_file():
            raise InputError(f"{path}: exists and is not a regular file; choose another name for the output")
        target = Path(path).resolve()  # a symbolic link keeps pointing at what is written
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from None
    output_folder(target.parent)
    return target


@contextlib.contextmanager
def written_beside(path):
    """
    Yields the path of a new file in the folder of `path`, which takes the place of `path` if the block succeeds.
    Otherwise it is removed, and `path` is as it was. An OSError in the block becomes an InputError.
    """
    target = output_file(path)
    with contextlib.ExitStack() as cleanup:
        try:
            temporary = target.with_name(f".{target.name}.{os.getpid()}.{secrets.token_hex(4)}{target.suffix}")
            cleanup.callback(temporary.unlink, missing_ok=True)
            yield temporary
            os.replace(temporary, target)
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from None


def remove_leftovers(path):
    """Removes what written_beside could not, when a process that wrote `path` was killed."""
    target = Path(path).resolve()
    for left in target.parent.glob(f".{glob.escape(target.name)}.*.*{glob.escape(target.suffix)}"):
        middle = left.name[len(target.name) + 2 : len(left.name) - len(target.suffix)]
        process = re.fullmatch(r"(\d+)\.[0-9a-f]{8}", middle)
        if process and not Path(f"/proc/{process[1]}").exists():
            left.unlink(missing_ok=True)


def write_text(path, text):
    """Writes the text in UTF-8."""
    write_bytes(path, text.encode())


def write_bytes(path, content):
    with written_beside(path) as temporary:
        temporary.write_bytes(content)


def write_json(path, value):
    """
    Writes dicts, lists, strings, numbers and NumPy values as JSON; the path `-` is stdout.
    JSON has no NaN and no infinity: they become null.
    """
    text = json.dumps(plain(value), indent=1, allow_nan=False) + "\n"
    if str(path) == "-":
        sys.stdout.write(text)
    else:
        write_text(path, text)


def plain(value):
    """A value as JSON knows it; what is not finite becomes null."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write_exr(path, channels):
    """
    Writes named images of one size as the layers of an OpenEXR file, losslessly compressed.

    channels  name -> array [h,w], [h,w,3] or [h,w,4]; floats are stored as float32, integers and truth values as
              uint32. The name "RGB" is the picture that viewers show; a vector N becomes the channels N.R, N.G, N.B.
    """
    import OpenEXR

    layers = {
        name: np.ascontiguousarray(pixels, np.float32 if np.asarray(pixels).dtype.kind == "f" else np.uint32)
        for name, pixels in channels.items()
    }
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with written_beside(path) as temporary:
        OpenEXR.File(header, layers).write(str(temporary))


def read_exr(path):
    """
    The layers of the first part of an OpenEXR file, as write_exr names them: name -> array [h,w], [h,w,3] or [h,w,4].
    InputError where the file is none, truncated or damaged.
    """
    return _from_exr(path, _pixels)


def read_exr_channels(path):
    """The same, each channel alone: name -> array [h,w]; of a channel that is stored more coarsely, less of either."""
    return _from_exr(path, _pixels, separate_channels=True)


def _pixels(file):
    return {name: channel.pixels for name, channel in file.channels().items()}


def exr_header(path):
    """What an OpenEXR file says of its first part, without reading pixels, so that an absurd size does no harm: width,
    height, compression (such as "DWAB") and channels, their names. InputError as of read_exr."""
    return _from_exr(path, _header, header_only=True)


def _header(file):
    header = file.header()
    low, high = header["dataWindow"]
    return {"width": int(high[0]) - int(low[0]) + 1, "height": int(high[1]) - int(low[1]) + 1,
            "compression": header["compression"].name.removesuffix("_COMPRESSION"),
            "channels": [channel.name for channel in header["channels"]]}


def _from_exr(path, take, **options):
    import OpenEXR

    if not read_bytes(path).startswith(b"\x76\x2f\x31\x01"):
        raise InputError(f"{path}: is not an OpenEXR file; expected an .exr image")
    try:
        with _silenced():
            return take(OpenEXR.File(str(path), **options))
    except (RuntimeError, ValueError, MemoryError, KeyError):
        raise InputError(f"{path}: is a truncated or damaged OpenEXR file; export or download it again") from None


@contextlib.contextmanager
def _silenced():
    """Keeps the warnings of OpenEXR off the screen: those that it prints through Python, and those of its C library."""
    sys.stderr.flush()
    stderr = os.dup(2)
    with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
        os.dup2(nowhere.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)


def read_png(path):
    """The colours [h,w,3], uint8, of a picture of ours."""
    from PIL import Image

    return np.array(Image.open(path).convert("RGB"))


def write_png(path, rgb):
    """Writes display-encoded colours [h,w,3]: uint8, or floats, of which 0..1 is shown."""
    from PIL import Image

    rgb = np.asarray(rgb)
    if rgb.dtype != np.uint8:
        rgb = np.rint(np.clip(rgb, 0, 1) * 255).astype(np.uint8)
    with written_beside(path) as temporary:
        Image.fromarray(np.ascontiguousarray(rgb)).save(temporary, format="PNG")
