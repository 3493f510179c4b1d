"""Runs one target of targets.py, in a process of its own, since whatever it meets may end it.

    harness.py replay TARGET [--edits N --seed S]     its examples, its corpus, and N edits of these; a line of JSON
    harness.py fuzz TARGET FINDINGS [libFuzzer's arguments: flags, folders]     needs Atheris
"""

import argparse
import hashlib
import json
import os
import random
import shutil
import sys
import sysconfig
import tempfile
import traceback
import types
from pathlib import Path

HERE = Path(__file__).parent
CORPUS = HERE / "corpus"
INSTRUMENTED = ["lobe", "trimesh", "tomllib", "tomli", "csv"]  # whose branches count as new


def signature(error):
    """What tells one fault from another: its type, and the innermost line of the code under test."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if "/tests/fuzz/" not in f.filename] or frames
    return f"{type(error).__name__} {Path(own[-1].filename).name}:{own[-1].name}:{own[-1].lineno}"


def inputs(target):
    """The examples, and the corpus."""
    return target.examples(), [path.read_bytes() for path in sorted((CORPUS / target.name).glob("*"))]


def megabytes():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def replay(target, edits, seed, folder):
    """How many were read, how many taken, the first input of each fault, and by how much memory grew."""
    examples, corpus = inputs(target)
    known, chance, findings = examples + corpus, random.Random(seed), {}

    def taken(content):
        try:
            return target.check(content, folder)
        except Exception as error:
            findings.setdefault(signature(error), (content, "".join(traceback.format_exception(error))))

    if refused := [i for i, content in enumerate(examples) if taken(content) is False]:
        findings[f"refuses its own examples {refused}"] = (b"", "")
    for content in corpus:
        taken(content)
    began = megabytes()
    good = sum(taken(target.edited(chance.choice(known), chance, known)) or 0 for _ in range(edits))
    return len(known) + edits, good, findings, megabytes() - began


def fuzz(target, found, arguments, folder):
    import atheris

    (examples, corpus), seen = inputs(target), {}
    donors = examples + corpus

    def one(content):
        try:
            target.check(content, folder)
        except Exception as error:
            name = signature(error)
            if name not in seen:
                seen[name] = keep(found, target, name, content, "".join(traceback.format_exception(error)))

    def edit(content, size, seed):
        chance = random.Random(seed)
        if chance.random() < 0.2:
            return atheris.Mutate(content, size)
        return target.edited(content, chance, donors)[:size]

    atheris.Setup([sys.argv[0], *arguments], one, custom_mutator=edit)
    atheris.Fuzz()


def keep(found, target, name, content, why):
    """Puts a fault's first input, and where it came from, among the findings."""
    found.mkdir(parents=True, exist_ok=True)
    stem = found / f"{target.name}-{hashlib.sha256(name.encode()).hexdigest()[:12]}"
    stem.with_suffix(target.suffix).write_bytes(content)
    stem.with_suffix(".why").write_text(f"{name}\n{why}", errors="backslashreplace")


def import_plainly():
    """Makes Python's own loader import lobe: Atheris does not see through that of an editable installation."""
    package = types.ModuleType("lobe")
    package.__path__ = [str(Path(sysconfig.get_path("purelib"), "lobe")), str(HERE.parents[1])]
    sys.modules["lobe"] = package
    sys.meta_path[:] = [finder for finder in sys.meta_path if "editable" not in type(finder).__module__]


def write_examples(target, folder):
    for content in sum(inputs(target), []):
        (folder / hashlib.sha256(content).hexdigest()[:16]).write_bytes(content)


def peak_kb() -> int:
    """Of this program alone; the peak that getrusage tells is also that of the process which it was forked from."""
    (line,) = [line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM:")]
    return int(line.split()[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mode", choices=("replay", "fuzz", "examples"))
    parser.add_argument("target")
    parser.add_argument("folder", nargs="?", type=Path, help="fuzz: of the findings; examples: where they go")
    parser.add_argument("--edits", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="replay: where to put the first input of each fault")
    known, rest = parser.parse_known_args()
    if known.mode == "fuzz":
        import atheris

        import_plainly()
        with atheris.instrument_imports(include=INSTRUMENTED):
            from targets import TARGETS
    else:
        from targets import TARGETS
    target = TARGETS[known.target]
    if known.mode == "examples":
        return write_examples(target, known.folder)
    folder = Path(tempfile.mkdtemp(prefix="lobe-fuzz-"))
    try:
        target.furnish(folder)
        if known.mode == "fuzz":
            return fuzz(target, known.folder, rest, folder)
        executions, taken, findings, growth = replay(target, known.edits, known.seed, folder)
        for name, (content, why) in findings.items() if known.keep else ():
            keep(known.keep, target, name, content, why)
        peak = peak_kb() / 1024
        print(json.dumps({"executions": executions, "taken": taken, "peak_mb": round(peak), "growth_mb": round(growth),
                          "findings": {name: [content.hex()[:400], why] for name, (content, why) in findings.items()}}))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
