"""Backlash: the force comes back over a travel behind every turn, by degrees and to the share that was lost."""

import numpy as np
import pytest

from mrfit.effects import free_play
from mrfit.effects.backlash import shape
from tests.effects.joints import DT, SPEED, planted_fit, triangle

W = 1e-3


def force(theta: list[float], channels: dict[str, np.ndarray], size: float = 100.0) -> np.ndarray:
    coulomb = size * np.sign(channels["velocity"])[None]
    return shape(coulomb, channels, np.array([theta]), DT)[0]


@pytest.mark.parametrize("p", [1.0, 3.0])
def test_friction_comes_back_as_a_power_of_the_travel_behind_a_turn(p: float) -> None:
    channels = triangle()
    turn = int(np.flatnonzero(np.diff(channels["velocity"]))[-2]) + 1
    share = np.minimum((np.arange(1, 200)) * SPEED * DT / (2 * W), 1.0)
    found = np.abs(force([0.9, W, p], channels))[turn : turn + 199]
    np.testing.assert_allclose(found, 100.0 * (1.0 - 0.9 * (1.0 - share**p)), rtol=1e-9)


def test_the_share_that_is_lost_does_not_depend_on_the_force_and_a_clearance_leaves_none() -> None:
    channels = triangle()
    soft, hard = (force([0.6, W, 2.0], channels, size) / size for size in (1.0, 1e4))
    np.testing.assert_allclose(soft, hard, rtol=1e-12)
    turn = int(np.flatnonzero(np.diff(channels["velocity"]))[-2]) + 1
    behind = slice(turn + 1, turn + round(2 * W / SPEED / DT) - 1)
    rested = free_play.transform(channels, np.array([1.0, W]), DT)["velocity"]
    assert np.abs(soft[behind]).min() >= 0.4
    assert np.ptp(np.abs(soft[behind])) > 0.5
    assert not rested[behind].any()


def test_a_force_that_passes_zero_while_the_joint_turns_has_no_step() -> None:
    channels = triangle()
    smooth = 100.0 * np.sin(2 * np.pi * np.arange(len(channels["velocity"])) / 97)
    found = shape(smooth[None], channels, np.array([[1.0, W, 2.0]]), DT)[0]
    assert np.abs(np.diff(found)).max() < 1.5 * np.abs(np.diff(smooth)).max() + 100.0 * 2 * SPEED * DT / W


def test_a_fit_finds_the_joint_that_was_planted() -> None:
    found = planted_fit("backlash", (0.8, 1.2e-3, 3.0))
    assert found.loc["backlash.d", "value"] == pytest.approx(0.8, rel=0.05)
    assert found.loc["backlash.w", "value"] == pytest.approx(1.2e-3, rel=0.05)
