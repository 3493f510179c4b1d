"""The arithmetic of the race against Mitsuba, and that its page shows what was measured. Needs no Mitsuba."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "benchmarks"))

import mitsuba_race as race  # noqa: E402

CURVE = [{"seconds": 0.1 * n, "error": n**-0.5} for n in (1, 4, 16, 64)]


@pytest.mark.parametrize("target, seconds, beyond", [(0.5, 0.4, False), (0.3, 0.1 / 0.09, False), (1e-3, 1e5, True),
                                                     (2.0, 0.025, True)])
def test_time_to_an_error(target, seconds, beyond):
    found, extrapolated = race.time_to(target, CURVE)
    assert found == pytest.approx(seconds, rel=1e-9) and extrapolated == beyond


def noisy(rng, count, sigma=0.1, brighter=1.0):
    truth = np.linspace(0.5, 1.5, 32 * 32 * 3).reshape(32, 32, 3)
    return race.Mean([brighter * truth + rng.normal(scale=sigma, size=truth.shape) for _ in range(count)])


def test_error_is_freed_of_the_noise_of_the_truth():
    rng = np.random.default_rng(3)
    truth = noisy(rng, 20)
    assert race.rms(noisy(rng, 2, 0.05).stack[0], truth) == pytest.approx(0.05, rel=0.1)  # not 0.055
    assert race.rms(noisy(rng, 2, 0.0).stack[0], truth) < 0.01


def test_agreement_is_seen_and_disagreement_too():
    rng = np.random.default_rng(5)
    a = noisy(rng, 24)
    assert race.agrees(race.agreement(a, noisy(rng, 24)))
    assert not race.agrees(race.agreement(a, noisy(rng, 24, brighter=1.005)))
    local = noisy(rng, 24)
    local.stack[:, :8, :8] *= 1.2
    local.stack[:, 8:16, :8] *= 2 - local.stack[:, :8, :8].mean() / local.stack[:, 8:16, :8].mean()
    assert not race.agrees(race.agreement(a, local))  # though hardly in the mean


def test_page_shows_what_was_measured():
    result = json.loads((race.RESULTS / "mitsuba.json").read_text())
    text = race.PAGE.read_text(encoding="utf-8")
    assert race.page(text, result) == text
    assert set(result["scenes"]) == set(race.PAIRS)
    assert all(race.agrees(scene["agreement"]) for scene in result["scenes"].values())
