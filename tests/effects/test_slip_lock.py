"""Slip-lock: the pinching of Foliente, and what tells it from a clearance."""

import numpy as np
import pytest

from mrfit.effects import free_play
from mrfit.effects.slip_lock import transform
from tests.effects.joints import DT, SPEED, planted_fit, triangle

D = 2e-3
THETA = np.array([0.8, D, 0.1, 0.3])


def seen(theta: np.ndarray, channels: dict[str, np.ndarray]) -> np.ndarray:
    return transform(channels, theta, DT)["velocity"]


def test_the_share_that_is_lost_is_the_pinching_function_of_the_travel_behind_a_turn() -> None:
    channels = triangle()
    turn = int(np.flatnonzero(np.diff(channels["velocity"]))[-2]) + 1
    after = np.arange(1, 300)
    # z rises from -z_end to 1 as 1 - (1 + z_end) exp(-s/d); the turn's own step has no travel
    z = 1.0 - 2.0 * np.exp(-after * SPEED * DT / D)
    lost = 1.0 - np.abs(seen(THETA, channels)[turn + after]) / SPEED
    np.testing.assert_allclose(lost, 0.8 * np.exp(-(((z - 0.1) / 0.3) ** 2)), atol=2e-4)


def test_what_a_joint_loses_lies_behind_the_turn_and_not_at_it_as_with_a_clearance() -> None:
    channels = triangle()
    turn = int(np.flatnonzero(np.diff(channels["velocity"]))[-2]) + 1
    slipped = np.abs(seen(THETA, channels)) / SPEED
    rested = np.abs(free_play.transform(channels, np.array([1.0, D / 2]), DT)["velocity"]) / SPEED
    assert slipped[turn + 1] > 0.9
    assert rested[turn + 1] == 0.0
    middle = turn + round(D * np.log(2.0) / SPEED / DT)
    assert slipped[middle] < 0.35


def test_a_fit_finds_the_joint_that_was_planted_in_a_loop() -> None:
    found = planted_fit("slip-lock", (0.7, 1.5e-3, 0.1, 0.35))
    assert found.loc["slip-lock.zeta", "value"] == pytest.approx(0.7, rel=0.05)
    assert found.loc["slip-lock.d", "value"] == pytest.approx(1.5e-3, rel=0.1)
