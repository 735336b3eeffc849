"""Hysteretic biviscous: corners, symmetry, direction and area of the loop."""

import numpy as np
import pytest

from mrfit.models.hysteretic_biviscous import derived, response, start_values

# Paper preyield paper Table 2, 1 A, MH.
FY, C_INF, C0, VH = 1027.5, 2974.6, 40831.0, 0.0176
THETA = np.array([[FY, C_INF, C0, VH, 0.0]])
VYC, VYE = derived(THETA)[0]


def force_at(v: float, a: float) -> float:
    return float(response(np.array([[v], [a]]), THETA, 1e-3)[0, 0])


@pytest.mark.parametrize(("corner", "a"), [(-VYC, 1.0), (VYE, 1.0), (VYC, -1.0), (-VYE, -1.0)])
def test_branches_are_continuous_at_their_corners(corner: float, a: float) -> None:
    assert force_at(corner - 1e-10, a) == pytest.approx(force_at(corner + 1e-10, a), abs=1e-4)
    post_yield = C_INF * corner + np.copysign(FY, corner)
    assert force_at(corner, a) == pytest.approx(post_yield)


@pytest.mark.parametrize("v", [-0.3, -0.02, 0.0, 0.01, 0.25])
def test_falling_branch_mirrors_the_rising_one(v: float) -> None:
    assert force_at(-v, -1.0) == -force_at(v, 1.0)


def test_branches_are_the_printed_lines() -> None:
    assert force_at(-0.2, 1.0) == pytest.approx(C_INF * -0.2 - FY)
    assert force_at(0.01, 1.0) == pytest.approx(C0 * (0.01 - VH))
    assert force_at(VH, 1.0) == 0.0


def test_loop_runs_counter_clockwise_and_its_area_is_that_of_two_parallelograms() -> None:
    phase = 2 * np.pi * np.arange(400_000) / 400_000
    v, a = 0.3 * np.sin(phase), 0.3 * np.cos(phase)
    force = response(np.stack([v, a]), THETA, 1e-3)[0]
    area = -np.sum(force * np.gradient(v))  # positive: counter-clockwise in the plane of velocity and force
    # Between the branches lies a band as wide as 2*vh across the pre-yield lines, as high as the post-yield lines' gap.
    assert area == pytest.approx(4 * FY * VH * C0 / (C0 - C_INF), rel=1e-3)


def test_start_values_are_near_the_parameters_of_its_own_force() -> None:
    t = np.linspace(0, 2, 4000, endpoint=False)
    v, a = 0.3 * np.sin(2 * np.pi * t), 0.3 * 2 * np.pi * np.cos(2 * np.pi * t)
    found = start_values(np.stack([v, a]), response(np.stack([v, a]), THETA, 5e-4)[0], 5e-4)
    assert found["vh"] == pytest.approx(VH, rel=0.01)
    assert found["fy"] == pytest.approx(FY, rel=0.01)
    assert found["C_inf"] == pytest.approx(C_INF, rel=0.01)
