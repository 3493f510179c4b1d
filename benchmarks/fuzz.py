"""Feeds damaged files to every reader for a while: benchmarks/fuzz.py --minutes 60, in the night. Needs Atheris.

Each target of tests/fuzz runs under Atheris (libFuzzer), guided by the branches of our own and the parsers' Python
code. What reaches new ones is kept in build/fuzz, from which a later run goes on; the first input of each fault, and
where it came from, lie in out/fuzz. A repaired one moves to tests/fuzz/corpus, which the tests replay.
"""

import argparse
import datetime
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from lobe.lab import files

ROOT = Path(__file__).resolve().parents[1]
HARNESS = ROOT / "tests" / "fuzz" / "harness.py"
RESULT = ROOT / "benchmarks" / "results" / "fuzz.json"
FOUND, KEPT = ROOT / "out" / "fuzz", ROOT / "build" / "fuzz"
TIMEOUT, MEMORY_MB = 25, 2500  # of one input: beyond them it counts as a fault
GROWTH_EDITS = 300
TARGETS = sorted(path.name for path in (ROOT / "tests" / "fuzz" / "corpus").iterdir())


def fuzz(target, seconds):
    """What libFuzzer counted; it begins again after whatever ended its process."""
    corpus, found = KEPT / target, FOUND / target
    corpus.mkdir(parents=True, exist_ok=True), found.mkdir(parents=True, exist_ok=True)
    before = {path.name for path in found.iterdir()}
    total = {"target": target, "seconds": 0.0, "executions": 0, "new_inputs": 0, "peak_mb": 0, "restarts": -1}
    began = time.monotonic()
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as folder:
        call("examples", target, corpus, folder=folder)
        while (left := round(seconds - (time.monotonic() - began))) > 0:
            log = call("fuzz", target, found, corpus, f"-max_total_time={left}", f"-timeout={TIMEOUT}",
                       "-max_len=16384", f"-rss_limit_mb={MEMORY_MB}", "-print_final_stats=1",
                       f"-artifact_prefix={found}/", folder=folder)
            if not (executions := counted("number_of_executed_units", log)):
                sys.exit(f"fuzz: {target} does not begin:\n{log[-2000:]}")
            total["executions"] += executions
            total["new_inputs"] += counted("new_units_added", log)
            total["peak_mb"] = max(total["peak_mb"], counted("peak_rss_mb", log))
            total["restarts"] += 1
    total["seconds"] = round(time.monotonic() - began, 1)
    total["faults"] = sorted(p.name for p in found.iterdir() if p.name not in before and not
                             p.name.startswith("slow") and p.suffix != ".why")
    told = json.loads(call("replay", target, "--edits", str(GROWTH_EDITS), "--seed", str(os.getpid())))
    total["kept_inputs"] = sum(1 for _ in corpus.iterdir())
    return total | {"growth_mb": told["growth_mb"], "growth_edits": GROWTH_EDITS}


def call(*arguments, folder=None):
    environment = os.environ | ({"TMPDIR": folder} if folder else {})
    done = subprocess.run([sys.executable, str(HARNESS), *map(str, arguments)], env=environment, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT if folder else None, errors="replace")
    if folder and "atheris" in done.stdout and "ModuleNotFoundError" in done.stdout:
        sys.exit("fuzz: needs Atheris; run: .venv/bin/python -m pip install -e .[fuzz]")
    return done.stdout


def counted(what, log):
    """A final count of libFuzzer's, or the last number of executions before it was killed."""
    found = re.findall(rf"stat::{what}: +(\d+)", log)
    if not found and what == "number_of_executed_units":
        found = re.findall(r"^#(\d+)\t", log, re.M)
    return int(found[-1]) if found else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--target", action="append", choices=TARGETS, help="only this one (repeatable)")
    known = parser.parse_args()
    targets = known.target or TARGETS
    rows = []
    for target in targets:
        rows.append(fuzz(target, known.minutes * 60 / len(targets)))
        print(json.dumps(rows[-1]), flush=True)
        if not known.target:
            files.write_json(RESULT, summary(rows))
    sys.exit(any(row["faults"] for row in rows))


def summary(rows):
    return {"date": datetime.date.today().isoformat(), "cores": os.cpu_count(),
            "targets_left": len(TARGETS) - len(rows),
            **{key: round(sum(row[key] for row in rows), 1) for key in ("seconds", "executions", "new_inputs")},
            "faults": sum(len(row["faults"]) for row in rows), "peak_mb": max(row["peak_mb"] for row in rows),
            "targets": rows}


if __name__ == "__main__":
    main()
