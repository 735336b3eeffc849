"""Regions hold the samples their names say."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from mrfit.discover.evidence.bench import Bench
from mrfit.discover.policy import STANDARD
from mrfit.discover.writing.regions import _after_steps, _near_reversal, beyond_training


def bench(train: tuple[float, float], holdout: tuple[float, float]) -> Bench:
    """Return tests whose current spans these ranges and whose velocity is not to be had."""

    def stretch(ends: tuple[float, float]) -> SimpleNamespace:
        return SimpleNamespace(channel=lambda name: np.linspace(*ends, 50))

    roles = {"train": [stretch(train)], "holdout": [stretch(holdout)]}
    return cast(Bench, SimpleNamespace(of_role=roles.__getitem__, channels=("current",)))


def test_held_out_tests_beyond_the_trained_current_are_said() -> None:
    (said,) = beyond_training(bench((0.8, 1.2), (0.3, 2.0)), STANDARD)
    assert said.startswith("held-out tests span 0.3 to 2 A of current, training tests only 0.8 to 1.2 A")


def test_held_out_tests_within_the_training_range_are_not() -> None:
    assert beyond_training(bench((0.3, 2.0), (0.8, 1.2)), STANDARD) == []
    assert beyond_training(bench((0.3, 2.0), (0.25, 2.05)), STANDARD) == []


def test_forty_milliseconds_after_each_step_are_marked_by_its_direction() -> None:
    dt = 1e-3
    current = np.zeros(1000)
    current[200:600] = 2.0
    up, down = _after_steps(current, dt, 2.0)
    assert np.flatnonzero(up)[0] == 200 and np.flatnonzero(down)[0] == 600
    assert up.sum() * dt == pytest.approx(0.043, abs=0.002)
    assert not (up & down).any()


def test_reversals_are_marked_a_twentieth_of_a_cycle_to_either_side() -> None:
    dt, frequency = 1e-3, 2.0
    rate = np.cos(2 * np.pi * frequency * np.arange(2000) * dt)
    near = _near_reversal(rate, dt, frequency)
    assert near.mean() == pytest.approx(4 * 0.05, rel=0.05)
    assert np.abs(rate[near]).max() <= np.sin(2 * np.pi * 0.055)
