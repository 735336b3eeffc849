"""Steady drift against planted drifts, and noise that is none."""

import numpy as np
import pytest
from scipy.signal import lfilter

from mrfit.core.specs import Array
from mrfit.signal.drift import drift_row, drift_words, steady_drift
from mrfit.signal.noise import noise_floor

SAMPLES, CYCLES, DT = 5000, 20, 1e-3
TIME = np.arange(SAMPLES) * DT
OUTPUT = np.tanh(4.0 * np.sin(2 * np.pi * CYCLES * TIME / TIME[-1]))


def noise(kind: str, seed: int) -> Array:
    drawn = np.random.default_rng(seed).standard_normal(SAMPLES)
    if kind == "walk":
        walk = np.cumsum(drawn)
        walk = walk - np.polyval(np.polyfit(TIME, walk, 1), TIME)
        return np.asarray(walk / walk.std())
    return np.asarray(lfilter([np.sqrt(1 - 0.9**2)], [1.0, -0.9], drawn)) if kind == "coloured" else drawn


@pytest.mark.parametrize("kind", ["white", "coloured"])
def test_a_drift_of_the_level_is_found_with_its_rate(kind: str) -> None:
    rate = 2.0
    found = steady_drift(noise(kind, 1) + rate * TIME, OUTPUT, DT, CYCLES)
    assert found is not None
    assert found.level_rate == pytest.approx(rate, rel=0.15)
    assert not np.any(found.gain)


def test_a_drift_of_the_gain_is_found_with_its_rate() -> None:
    found = steady_drift(noise("white", 2) - 1.5 * (TIME - TIME.mean()) * OUTPUT, OUTPUT, DT, CYCLES)
    assert found is not None
    assert found.gain_rate == pytest.approx(-1.5, rel=0.15)
    assert not np.any(found.level)


@pytest.mark.parametrize(("kind", "most"), [("white", 0), ("coloured", 0), ("walk", 2)])
def test_noise_is_no_drift(kind: str, most: int) -> None:
    found = [steady_drift(noise(kind, seed), OUTPUT, DT, CYCLES) for seed in range(60)]
    assert sum(f is not None for f in found) <= most


def test_too_few_cycles_say_nothing() -> None:
    assert steady_drift(noise("white", 3) + 5.0 * TIME, OUTPUT, DT, 4) is None


def test_a_bent_drift_is_not_counted_as_noise() -> None:
    bent = 3.0 * (TIME - TIME.mean()) ** 2
    values, frequency = 10.0 * OUTPUT + noise("white", 4), CYCLES / (SAMPLES * DT)
    found = steady_drift(values + bent - 10.0 * OUTPUT, OUTPUT, DT, CYCLES)
    assert found is not None
    counted = noise_floor(values + bent, DT, frequency, CYCLES, trending=True)
    left = noise_floor(values + bent - found.total, DT, frequency, CYCLES, trending=True)
    assert counted > 3.0
    assert left == pytest.approx(1.0, rel=0.15)


def test_words_name_the_records_and_the_rates() -> None:
    found = steady_drift(noise("white", 1) + 2.0 * TIME, OUTPUT, DT, CYCLES)
    assert found is not None
    text = drift_words([drift_row("sine-1Hz", "a#1", found)])
    assert "level drifts in sine-1Hz" in text and "per second" in text and "gain" not in text
