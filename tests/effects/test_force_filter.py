"""The force filter against scipy's simulation of H(s), and its limits."""

import numpy as np
import pytest
from scipy.signal import lsim

from mrfit.discover.evidence.bench import effects_for
from mrfit.effects import force_filter

DT = 1e-3
FORCE = 800.0 * np.tanh(5 * np.sin(np.arange(1500) / 60)) + 50.0


def shaped(*rows: tuple[float, ...]) -> np.ndarray:
    return np.asarray(force_filter.shape(np.tile(FORCE, (len(rows), 1)), {}, np.array(rows), DT))


def test_it_is_the_transfer_function() -> None:
    T, ratios, turn, xi = 0.008, (0.5, 0.25, 0.125), 0.375, 0.6
    poles = np.array([1.0])
    for share in (1.0, *ratios):
        poles = np.polymul(poles, [share * T, 1.0])
    system = ([(turn * T) ** 2, 2 * xi * turn * T, 1.0], poles)
    expected = FORCE[0] + lsim(system, FORCE - FORCE[0], DT * np.arange(1500))[1]
    assert shaped((T, *ratios, turn, xi))[0] == pytest.approx(expected, abs=1e-4)


def test_rows_without_time_constants_are_left_beside_rows_that_have_them() -> None:
    still, moved = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5), (0.01, 0.1, 0.2, 0.3, 0.4, 0.5)
    rows = shaped(still, moved, still)
    assert np.array_equal(rows[0], FORCE) and np.array_equal(rows[2], FORCE)
    assert np.array_equal(rows[1], shaped(moved)[0])
    assert np.abs(rows[1] - FORCE).max() > 20.0


def test_a_vanishing_time_constant_leaves_the_force() -> None:
    assert shaped((1e-12, 0.5, 0.25, 0.125, 0.375, 0.7))[0] == pytest.approx(FORCE, abs=1e-3)


def test_discovery_proposes_neither_of_the_blocks() -> None:
    proposed = {s.name for s in effects_for("force")}
    assert "current-lag" in proposed and not proposed & {"force-filter", "current-filter"}
