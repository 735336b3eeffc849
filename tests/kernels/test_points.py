"""Characteristic points of loops made with known parameters."""

import numpy as np
import pytest

from mrfit.kernels.points import half_width, inside, loop_height, post_yield_line, tanh_points, yield_velocity
from mrfit.models.bingham import SPEC

T = np.linspace(0, 2, 4000, endpoint=False)
V, A = 0.3 * np.sin(2 * np.pi * T), 0.6 * np.pi * np.cos(2 * np.pi * T)


def test_post_yield_line_of_a_bingham_force_is_exact_and_ignores_what_happens_before_yield() -> None:
    force = 500 * np.sign(V) + 2000 * V - 30
    force[np.abs(V) < 0.1] = 0.0
    assert post_yield_line(V, force) == pytest.approx({"fy": 500, "C_inf": 2000, "f0": -30})


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (lambda u: np.sign(u) * (1 - np.exp(-np.abs(u) / 0.01)), 0.01),
        (lambda u: np.tanh(u / 0.01), 0.01 * np.log(2)),
        (lambda u: np.clip(u / 0.01, -1, 1), 0.005),
    ],
)
def test_yield_velocity_is_the_area_short_of_the_post_yield_line(shape, expected: float) -> None:
    force = 500 * shape(V) + 2000 * V
    assert yield_velocity(V, force) == pytest.approx(expected, rel=0.02)


def test_width_and_height_of_a_shifted_tanh_loop() -> None:
    force = 500 * np.tanh((V - 0.02 * np.sign(A)) / 0.05)
    assert half_width(V, A, force) == pytest.approx(0.02, rel=1e-3)
    assert loop_height(V, A, force) == pytest.approx(500 * np.tanh(0.4), rel=1e-3)


def test_a_curve_without_hysteresis_has_no_width() -> None:
    assert half_width(V, A, np.tanh(V / 0.05)) == pytest.approx(0.0, abs=1e-6)
    assert half_width(V, A, np.ones_like(V)) == 0.0


def test_values_outside_the_bounds_move_to_them_and_non_finite_ones_vanish() -> None:
    assert inside(SPEC, {"fy": -5.0, "C_inf": np.nan, "f0": 1e9, "other": 1.0}) == {"fy": 1.0, "f0": 1e5}


def test_points_of_a_constant_drive_say_nothing() -> None:
    assert tanh_points(np.zeros(10), np.zeros(10), np.ones(10)) == {}
