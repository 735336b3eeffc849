"""Bilinear stiffness and yield by the peaks of growing cycles from rest, against a planted law."""

import numpy as np
import pytest

from mrfit.measure.bilinear import by_peaks
from mrfit.signal.cycles import turning_points


def growing(amplitudes: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    corners = np.concatenate([[0.0], *[[a, -a] for a in amplitudes], [0.0]])
    moved = np.interp(np.arange(4001) / 4000.0 * (len(corners) - 1), np.arange(len(corners)), corners)
    slip, force = 0.0, np.empty_like(moved)
    for k, x in enumerate(moved):
        slip = min(max(slip, x - 0.002), x + 0.002)
        force[k] = 1e4 * x + 9e4 * (x - slip)
    return moved, force


def test_planted_law_is_found() -> None:
    moved, force = growing((0.01, 0.02, 0.03, 0.04))
    found = {q.name: q.estimate for q in by_peaks(moved, force, turning_points(moved, 1e-4)[1:-1].tolist())}
    for name, truth in (("K_0 initial", 1e5), ("K_p peaks", 1e4), ("F_y peaks", 200.0), ("d_y peaks", 0.002)):
        one = found[name]
        assert one is not None and one.value == pytest.approx(truth, rel=0.01)


def test_cycles_of_one_amplitude_are_refused() -> None:
    moved, force = growing((0.02, 0.02, 0.02))
    found = by_peaks(moved, force, turning_points(moved, 1e-4)[1:-1].tolist())
    assert {q.reason for q in found} == {"needs 3 reversals of growing amplitude from rest on"}
