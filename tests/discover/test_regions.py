"""Regions hold the samples their names say."""

import numpy as np
import pytest

from mrfit.discover.regions import _after_steps, _near_reversal


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
