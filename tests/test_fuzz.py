"""Files of users, damaged in every way that has ever mattered: a reader takes them or refuses them in one line."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).parent / "fuzz"
TARGETS = sorted(path.name for path in (FUZZ / "corpus").iterdir())
EDITS, SEED, SECONDS = 150, 6, 120
MOST_MB = 900  # of a process, the modules that it imports included


def replay(target, *arguments):
    """What harness.py tells of one target."""
    done = subprocess.run([sys.executable, str(FUZZ / "harness.py"), "replay", target, *map(str, arguments)],
                          capture_output=True, text=True, timeout=SECONDS)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("target", TARGETS)
def test_what_once_was_found_stays_repaired(target):
    """Examples, corpus, and edits of these, the same ones at each run; benchmarks/fuzz.py tries others."""
    told = replay(target, "--edits", EDITS, "--seed", SEED)
    assert not told["findings"], "\n".join(f"{name}\n{why}\n{content}" for name, (content, why) in
                                            told["findings"].items())
    assert told["executions"] > EDITS + 1 and 0 < told["taken"] < EDITS, "edits are noise, or change nothing"
    assert told["peak_mb"] < MOST_MB


def test_every_target_has_a_corpus():
    sys.path.insert(0, str(FUZZ))
    from targets import TARGETS as known

    assert TARGETS == sorted(known)


BREAKS = {
    "an exception": ("raise KeyError('x')", "KeyError"),
    "a warning": ("np.float32(1e38) * np.float32(1e38)", "RuntimeWarning"),
    "a result that is not valid": ("targets.require(False, 'radiance')", "Finding"),
    "a half-written file": ("(path.parent / 'half').touch()", "Finding"),
}


@pytest.mark.parametrize("code, name", BREAKS.values(), ids=BREAKS)
def test_the_oracle_sees(code, name, tmp_path):
    sys.path.insert(0, str(FUZZ))
    import harness
    import numpy as np
    import targets

    def read(path):
        exec(code, {"path": path, "np": np, "targets": targets})

    broken = targets.Target("broken", ".x", read, lambda content, *_: content, lambda: [b"x"])
    _, _, findings, _ = harness.replay(broken, 1, 0, tmp_path)
    assert len(findings) == 1 and next(iter(findings)).startswith(name)
