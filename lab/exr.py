"""
OpenEXR files of several parts, written block by block. OpenEXR's own Python module wants every part of a file in
memory at once, with copies: for a picture of 8k more than the renderer itself needs. The layout is that of "OpenEXR File
Layout" (openexr.com), with ZIP compression; the tests read it with OpenEXR.
"""

from __future__ import annotations

import os
import struct
import zlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

BLOCK_ROWS = 16  # of ZIP compression
_MAGIC, _VERSION, _LONG_NAMES, _MULTI_PART = 20000630, 2, 0x400, 0x1000
_PIXEL_TYPES = {"uint32": 0, "float32": 2}
_ZIP, _INCREASING_Y, _ZIP_LEVEL = 3, 0, 4


@dataclass(frozen=True)
class Part:
    """A part of the file: its name, its channels in the order of the arrays that fill it, float32 or uint32."""

    name: str
    channels: tuple[str, ...]
    dtype: str = "float32"


class Writer:
    """
    Writes parts of one size into a file that nobody else sees yet. Every part must be given all its rows, from the top;
    parts may take turns.

    metadata   name -> str, int or float, into the header of every part
    """

    def __init__(self, path, width: int, height: int, parts: list[Part], metadata: dict):
        self._file = open(path, "wb")
        self._width, self._height, self._parts = width, height, parts
        self._blocks = -(-height // BLOCK_ROWS)
        self._rows = [0] * len(parts)  # given so far
        self._offsets = np.zeros((len(parts), self._blocks), "<u8")
        headers = [self._header(part, metadata) for part in parts]
        self._file.write(struct.pack("<iI", _MAGIC, _VERSION | _MULTI_PART | _LONG_NAMES) + b"".join(headers) + b"\0")
        self._table = self._file.tell()
        self._file.write(self._offsets.tobytes())
        self._pool = ThreadPoolExecutor(os.cpu_count() or 1)

    def __enter__(self) -> Writer:
        return self

    def __exit__(self, kind, *_):
        self._pool.shutdown()
        if kind is None:
            assert self._rows == [self._height] * len(self._parts), "a part has not all its rows"
            self._file.seek(self._table)
            self._file.write(self._offsets.tobytes())
        self._file.close()

    def write(self, part: int, rows: np.ndarray) -> None:
        """The next rows [n, w] or [n, w, channels] of a part; n is a multiple of BLOCK_ROWS until the last ones."""
        first, described = self._rows[part], self._parts[part]
        rows = rows.reshape(len(rows), self._width, len(described.channels))
        assert first % BLOCK_ROWS == 0 and first + len(rows) <= self._height
        blocks = range(0, len(rows), BLOCK_ROWS)
        compressed = self._pool.map(lambda y: _block(rows[y : y + BLOCK_ROWS], described), blocks)
        for y, data in zip(blocks, compressed):
            self._offsets[part, (first + y) // BLOCK_ROWS] = self._file.tell()
            self._file.write(struct.pack("<iii", part, first + y, len(data)) + data)
        self._rows[part] = first + len(rows)

    def _header(self, part: Part, metadata: dict) -> bytes:
        window = struct.pack("<4i", 0, 0, self._width - 1, self._height - 1)
        channel = struct.pack("<iB3xii", _PIXEL_TYPES[part.dtype], 0, 1, 1)
        channels = b"".join(name.encode() + b"\0" + channel for name in sorted(part.channels)) + b"\0"
        return b"".join((
            _attribute("channels", "chlist", channels),
            _attribute("compression", "compression", bytes([_ZIP])),
            _attribute("dataWindow", "box2i", window),
            _attribute("displayWindow", "box2i", window),
            _attribute("lineOrder", "lineOrder", bytes([_INCREASING_Y])),
            _attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
            _attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0)),
            _attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
            _attribute("name", "string", part.name.encode()),
            _attribute("type", "string", b"scanlineimage"),
            _attribute("chunkCount", "int", struct.pack("<i", self._blocks)),
            *(_attribute(name, *_typed(value)) for name, value in metadata.items()),
            b"\0"))


def _attribute(name: str, kind: str, value: bytes) -> bytes:
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def _typed(value) -> tuple[str, bytes]:
    if isinstance(value, str):
        return "string", value.encode(errors="backslashreplace")  # of names that are no UTF-8
    if isinstance(value, int) and -(2**31) <= value < 2**31:
        return "int", struct.pack("<i", value)
    return "double", struct.pack("<d", value)


def _block(rows: np.ndarray, part: Part) -> bytes:
    """Rows [n, w, channels], compressed: row by row and channel by channel in the order of names, bytes split into even
    and odd ones, each told by its difference from the one before."""
    order = np.argsort(part.channels)
    raw = np.ascontiguousarray(rows[:, :, order].transpose(0, 2, 1), f"<{np.dtype(part.dtype).str[1:]}")
    flat = raw.reshape(-1).view(np.uint8)
    split = np.concatenate([flat[0::2], flat[1::2]])
    split[1:] = split[1:] - split[:-1] + np.uint8(128)
    compressed = zlib.compress(split.tobytes(), _ZIP_LEVEL)
    return compressed if len(compressed) < flat.nbytes else flat.tobytes()
