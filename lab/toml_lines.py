"""TOML with the line of every key: tomllib tells values without their places."""

from __future__ import annotations

import re
from bisect import bisect
from pathlib import Path

from . import files
from .errors import InputError

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10
    import tomli as tomllib

KeyPath = tuple  # of keys and, within arrays, indices: ("lights", 0, "radiance")

_BLANK = re.compile(r"(?:[\s]|#[^\n]*)*")
_STRING = re.compile(r'"""(?:\\.|[^\\])*?"""(?!")|\'\'\'.*?\'\'\'(?!\')|"(?:\\.|[^"\\])*"|\'[^\']*\'', re.S)
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_SCALAR = re.compile(r"[^,\]}\n#]+")


def load(path: Path) -> tuple[dict, dict[KeyPath, int]]:
    """The tables of a file, and the line, from 1, on which each key, table or element of an array begins. InputError
    with file and line where it is no TOML."""
    content = files.read_bytes(path)
    try:
        text = content.decode("utf-8-sig").replace("\r\n", "\n")  # some editors write a mark
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path}:{line}: is no UTF-8 text, expected TOML; save the file as UTF-8") from None
    try:
        return tomllib.loads(text), _Lines(text).found
    except tomllib.TOMLDecodeError as error:
        message, line = _placed(str(error), text)
        raise InputError(f"{path}:{line}: {message}; expected TOML, see toml.io") from None
    except ValueError as error:  # Python reads no integers of more than 4300 digits
        raise InputError(f"{path}: {error}; expected the tables of a scene") from None
    except RecursionError:
        raise InputError(f"{path}: nests too deeply, expected the tables of a scene") from None


def _placed(message: str, text: str) -> tuple[str, int]:
    """A message of tomllib without the place that it ends with, and the line of that."""
    place = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)$", message)
    line = int(place[1]) if place and place[1] else text.rstrip("\n").count("\n") + 1
    message = message[: place.start()] if place else message
    if message.startswith(("Cannot overwrite", "Cannot mutate", "Cannot declare")):
        message = "gives a key, or a table, that is given above, too; keep one of them"
    return message, line


class _Lines:
    """The places of all keys of a text that tomllib has accepted, so that nothing needs checking here."""

    def __init__(self, text: str):
        self.found: dict[KeyPath, int] = {}
        self._text, self._at = text, 0
        self._newlines = [i for i, c in enumerate(text) if c == "\n"]
        self._length: dict[KeyPath, int] = {}  # of each array of tables so far
        table: KeyPath = ()
        while self._skip(_BLANK) is not None and self._at < len(text):
            if text.startswith("[[", self._at):
                table = self._header(2, is_array=True)
            elif text[self._at] == "[":
                table = self._header(1, is_array=False)
            else:
                self._pair(table)

    def _skip(self, pattern: re.Pattern) -> str:
        match = pattern.match(self._text, self._at)
        self._at = match.end()
        return match[0]

    def _mark(self, path: KeyPath, at: int) -> None:
        line = bisect(self._newlines, at - 1) + 1
        for end in range(1, len(path) + 1):
            self.found.setdefault(path[:end], line)

    def _keys(self) -> KeyPath:
        """a.b."c" as a tuple."""
        keys = []
        while True:
            self._skip(_BLANK)
            quoted = self._text[self._at] in "\"'"
            word = self._skip(_STRING if quoted else _BARE_KEY)
            keys.append(next(iter(tomllib.loads(f"{word} = 0"))))
            self._skip(_BLANK)
            if self._text[self._at] != ".":
                return tuple(keys)
            self._at += 1

    def _header(self, brackets: int, is_array: bool) -> KeyPath:
        start = self._at
        self._at += brackets
        keys = self._keys()
        self._at += brackets
        path: KeyPath = ()
        for i, key in enumerate(keys):
            path += (key,)
            if is_array and i == len(keys) - 1:
                self._length[path] = self._length.get(path, 0) + 1
            if path in self._length:
                path += (self._length[path] - 1,)
        self._mark(path, start)
        return path

    def _pair(self, table: KeyPath) -> None:
        start = self._at
        path = table + self._keys()
        self._mark(path, start)
        self._at += 1  # the equals sign
        self._skip(_BLANK)
        self._value(path)

    def _value(self, path: KeyPath) -> None:
        first = self._text[self._at]
        if first in "\"'":
            self._skip(_STRING)
        elif first in "[{":
            self._at += 1
            self._items(path, "]" if first == "[" else "}")
        else:
            self._skip(_SCALAR)

    def _items(self, path: KeyPath, end: str) -> None:
        """What an array or an inline table holds, its closing bracket included."""
        index = 0
        while self._skip(_BLANK) is not None and self._text[self._at] != end:
            if self._text[self._at] == ",":
                self._at += 1
            elif end == "]":
                self._mark((*path, index), self._at)
                self._value((*path, index))
                index += 1
            else:
                self._pair(path)
        self._at += 1
