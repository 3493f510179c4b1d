"""Edits of valid inputs that keep most of their structure: noise alone ends at the first line of a parser.

Each takes bytes, a random.Random and other inputs of the same kind, and returns bytes with one edit."""

import copy
import json
import re
import struct
import zlib

NUMBERS = ("0", "-0.0", "-1", "1", "2", "3", "0.5", "1e-300", "1e-45", "1e39", "-1e39", "1e308", "nan", "inf", "-inf",
           "65536", "2147483648", "-2147483649", "4294967295", "18446744073709551616", "1_000", "0x10", "1e6", "1e-6",
           "9" * 5000)
STRANGE = ("\0", "\r", "\n", "\t", "\x1b[31m", "\xff", "\xe2\x80\xa8", "\xc2\xb2", "\\", '"', "'",
           "'''", '"""', "[", "]", "[[", "{", "}", "(", ")", "#", "//",
           "/*", "*/", ",", ";", "=", ".", "..", "-", "%s", "\xef\xbb\xbf", " " * 3000, "[" * 3000)
WORDS = (0, 1, 2, 7, 0x7F, 0x80, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF,
         0x7F800000, 0xFF800000, 0x7FC00000, 0x7F7FFFFF, 0x00000001)
VALUES = (None, True, False, 0, -1, 1, 2, 5121, 5126, 2**31, 2**63, -(2**63), 10**400, 0.5, -0.0, 1e-300, 1e39, 1e308,
          float("nan"), float("inf"), "", "x", "0", "\0", "\x1b[31m", "VEC3", "SCALAR", "MAT4", ".", "/", "..",
          "/dev/zero", "input.gltf", "none.bin", "data:,",
          "data:application/octet-stream;base64,AAAA", "http://127.0.0.1:9/x", [], {}, [0], [[]],
          {"": {}}, [1e308] * 3, [0] * 16)
_TOKEN = re.compile(r"[A-Za-z_]\w*|[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|\s+|.", re.S)
_IS_NUMBER, _IS_WORD = re.compile(r"[-+.]*\d"), re.compile(r"[A-Za-z_]")


def text(content, chance, donors):
    """One edit of tokens or lines."""
    edit = chance.choice((_number, _number, _number, _word, _word, _insert, _remove, _line, _line, _splice, _cut))
    return edit(content.decode("latin-1"), chance, donors).encode("latin-1")


def _replaced(source, chance, pattern, new):
    tokens = _TOKEN.findall(source)
    fitting = [i for i, token in enumerate(tokens) if pattern.match(token)]
    if fitting:
        tokens[chance.choice(fitting)] = new
    return "".join(tokens)


def _number(source, chance, donors):
    return _replaced(source, chance, _IS_NUMBER, chance.choice(NUMBERS))


def _word(source, chance, donors):
    known = _IS_WORD_OF.findall(chance.choice(donors).decode("latin-1")) or ["x"]
    return _replaced(source, chance, _IS_WORD, chance.choice(known))


_IS_WORD_OF = re.compile(r"[A-Za-z_][\w.]*")


def _insert(source, chance, donors):
    at = chance.randint(0, len(source))
    return source[:at] + chance.choice(STRANGE + NUMBERS) + source[at:]


def _remove(source, chance, donors):
    tokens = _TOKEN.findall(source)
    if tokens:
        del tokens[chance.randrange(len(tokens))]
    return "".join(tokens)


def _line(source, chance, donors):
    """A line taken out, doubled, moved, brought from another input, or repeated often."""
    lines = source.splitlines(keepends=True) or [""]
    i, j = chance.randrange(len(lines)), chance.randrange(len(lines))
    foreign = chance.choice(donors).decode("latin-1").splitlines(keepends=True) or [""]
    new = chance.choice(([], [lines[i]] * 2, [lines[j]], [chance.choice(foreign), lines[i]], [lines[i]] * 300))
    return "".join(lines[:i] + new + lines[i + 1 :])


def _splice(source, chance, donors):
    other = chance.choice(donors).decode("latin-1")
    return source[: chance.randint(0, len(source))] + other[chance.randint(0, len(other)) :]


def _cut(source, chance, donors):
    return source[: chance.randint(0, len(source))]


def binary(content, chance, donors):
    """One edit of bytes or of little-endian words."""
    data = bytearray(content or b"\0")
    at = chance.randrange(len(data))
    kind = chance.randrange(6)
    if kind == 0:
        data[at] ^= 1 << chance.randrange(8)
    elif kind == 1:
        data[at : at + 4] = struct.pack("<I", chance.choice(WORDS))
    elif kind == 2:
        del data[at:]
    elif kind == 3:
        del data[at : at + chance.choice((1, 4, 16))]
    elif kind == 4:
        data[at:at] = data[at : at + chance.choice((1, 4, 16, 64))]
    else:
        other = chance.choice(donors)
        data[at:] = other[chance.randint(0, len(other)) :]
    return bytes(data)


def tree(value, chance):
    """A JSON value with one of its parts changed, taken out, doubled, or another of its parts."""
    value = copy.deepcopy(value)
    places = list(_places(value))
    if not places:
        return chance.choice(VALUES)
    container, key = chance.choice(places)
    kind = chance.randrange(6)
    if kind == 0:
        del container[key]
    elif kind == 1 and isinstance(container, list):
        container.insert(chance.randint(0, len(container)), copy.deepcopy(container[key]))
    elif kind == 2:
        other, its = chance.choice(places)
        container[key] = copy.deepcopy(other[its])
    elif kind == 3 and isinstance(container, dict):
        container[chance.choice(("", "x", "name", "extensions", "extras"))] = container.pop(key)
    else:
        container[key] = chance.choice(VALUES)
    return value


def _places(value):
    """(container, key) of every part of a JSON value."""
    keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        yield value, key
        yield from _places(value[key])


def gltf(content, chance, donors):
    """One edit of the JSON's tree; or of its text."""
    try:
        document = json.loads(content)
    except (ValueError, RecursionError):
        return text(content, chance, donors)
    return json.dumps(tree(document, chance)).encode() if chance.random() < 0.9 else text(content, chance, donors)


def glb(content, chance, donors):
    """One edit of the JSON chunk, its length kept right; or of any bytes."""
    size = int.from_bytes(content[12:16], "little")
    if chance.random() < 0.3 or len(content) < 20 + size:
        return binary(content, chance, donors)
    edited = gltf(content[20 : 20 + size], chance, [b"{}"])
    edited += b" " * (-len(edited) % 4)
    rest = content[20 + size :]
    return struct.pack("<4sIII", b"glTF", 2, 20 + len(edited) + len(rest), len(edited)) + content[16:20] + edited + rest


def ply(content, chance, donors):
    """One edit of the header; or of the body, as text or bytes."""
    end = content.find(b"end_header\n") + len(b"end_header\n")
    if chance.random() < 0.6:
        return text(content[:end], chance, donors) + content[end:]
    return content[:end] + (text if b"ascii" in content[:end] else binary)(content[end:], chance, donors)


def stl(content, chance, donors):
    return (text if content.startswith(b"solid") else binary)(content, chance, donors)


def exr(content, chance, donors):
    """One edit of the header's attributes; or of any bytes."""
    attributes = _exr_attributes(content)
    if not attributes or chance.random() < 0.2:
        return binary(content, chance, donors)
    start, name, kind, value, end = chance.choice(attributes)
    edit = chance.randrange(6)
    if edit == 0:
        return content[:start] + content[end:]
    if edit == 1:
        return content[:end] + content[start:end] + content[end:]
    if edit == 2:
        name = chance.choice(attributes)[1]
    elif edit == 3 and name in (b"dataWindow", b"displayWindow"):
        return _resized(content, attributes, chance)
    elif len(value) >= 4:
        at = 4 * chance.randrange(len(value) // 4)
        value = value[:at] + struct.pack("<I", chance.choice(WORDS)) + value[at + 4 :]
    else:
        value = bytes(chance.randrange(256) for _ in value)
    size = len(value) if chance.random() < 0.9 else chance.choice(WORDS)
    return content[:start] + name + b"\0" + kind + b"\0" + struct.pack("<I", size) + value + content[end:]


def _exr_attributes(content):
    """(start, name, type, value, end) of the attributes of the first header."""
    found, at = [], 8
    while 0 < (name_end := content.find(b"\0", at)) and name_end > at:
        kind_end = content.find(b"\0", name_end + 1)
        size = int.from_bytes(content[kind_end + 1 : kind_end + 5], "little")
        end = kind_end + 5 + size
        if kind_end < 0 or end > len(content):
            break
        found.append((at, content[at:name_end], content[name_end + 1 : kind_end], content[kind_end + 5 : end], end))
        at = end
    return found


def _resized(content, attributes, chance):
    """Both windows of another size, mostly twice as wide as high."""
    height = chance.choice((0, 1, 2, 3, 4, 9, 255, 4096, 8192, 20000, 1 << 29))
    width = 2 * height if chance.random() < 0.8 else chance.choice((0, 1, height, 1 << 30))
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    for start, name, kind, value, end in reversed(attributes):
        if name in (b"dataWindow", b"displayWindow") and len(value) == 16:
            content = content[: end - 16] + window + content[end:]
    return content


def checkpoint(content, chance, donors):
    """One edit of the JSON in the first line; or of the film, its checksums mostly made right again."""
    head, newline, rest = content.partition(b"\n")
    state = rest[:-4]
    try:
        facts = json.loads(head)
    except ValueError:
        facts = None
    if not isinstance(facts, dict) or chance.random() < 0.1:
        return binary(content, chance, donors)
    if chance.random() < 0.5:
        head = json.dumps(tree(facts, chance)).encode()
    else:
        at = chance.randrange(len(state) + 1) // 4 * 4
        state = chance.choice((
            lambda: binary(state, chance, donors),
            lambda: state[:at] + struct.pack("<I", chance.choice(WORDS)) + state[at + 4 :],
            lambda: state[:at] + struct.pack("<d", float(chance.choice(NUMBERS[:17]))) + state[at + 8 :],
        ))()
        if chance.random() < 0.8:
            state = state[:-8] + struct.pack("<Q", fingerprint(state[:-8]))
    sum = zlib.crc32(head + newline + state) if chance.random() < 0.9 else chance.choice(WORDS)
    return head + newline + state + struct.pack("<I", sum)


def fingerprint(data):
    """That of reference/fingerprint.h, so that a damaged film passes for a whole one."""
    value, mask = 0xCBF29CE484222325, (1 << 64) - 1
    words = [int.from_bytes(data[i : i + 8], "little") for i in range(0, len(data), 8)]
    for word in (*words, len(data)):
        value = ((value ^ word) * 0x100000001B3) & mask
        value ^= value >> 32
    return value
