"""The magnetomotive dual: dissipation on any path, its limits, and its starts."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mrfit.models.boucwen_mmf import derived, response, start_values

THETA = np.array([[0.03, 0.12, 0.004, 1.3, -0.3]])


@settings(max_examples=15, deadline=None)
@example(corners=[0.1875, 0.25], n=3.0, rho=0.0, turn=1.0)
@given(
    corners=st.lists(st.floats(-1, 1), min_size=2, max_size=10),
    n=st.floats(1, 10),
    rho=st.floats(-1, 0),
    turn=st.floats(0.01, 1),
)
def test_closed_paths_dissipate_for_every_parameter_within_the_bounds(
    corners: list[float], n: float, rho: float, turn: float
) -> None:
    # Work per cycle must not be negative. After repetitions the state closes too, but for what a small loop drifts,
    # which gives back no more than the elastic energy between the two states, turn*|z*dz|.
    path = np.concatenate([[0.0], np.tile(corners, 30), [corners[0]]])
    flux = np.interp(np.linspace(0, len(path) - 1, 40 * len(path)), np.arange(len(path)), path)
    last = slice(-40 * len(corners) - 1, None)
    current = response(flux[None], np.array([[1e9, 1.0, turn, n, rho]]), 1e-3)[0]
    drifted = abs(current[-1] - current[last][0])
    way = np.abs(np.diff(flux[last])).sum()
    assert np.trapezoid(current[last], flux[last]) >= -2e-3 * way - turn * drifted


def test_current_of_saturated_branches_is_that_of_the_inductance_and_the_coercive_current() -> None:
    flux = np.concatenate([np.linspace(0, 0.1, 500), np.linspace(0.1, -0.1, 1000)])
    current = response(flux[None], THETA, 1e-3)[0]
    assert current[499] == pytest.approx(0.1 / 0.03 + 0.12)
    assert current[-1] == pytest.approx(-0.1 / 0.03 - 0.12)
    assert current[999] == pytest.approx(flux[999] / 0.03 - 0.12, rel=1e-6)


def test_demagnetised_coil_starts_at_the_derived_inductance() -> None:
    flux = np.array([[0.0, 1e-7]])
    assert 1e-7 / response(flux, THETA, 1e-3)[0, 1] == pytest.approx(derived(THETA)[0, 0], rel=1e-4)


def test_start_values_are_near_the_loop_they_came_from() -> None:
    flux = 0.05 * np.sin(np.linspace(0, 6 * np.pi, 3000))
    found = start_values(flux[None], response(flux[None], THETA, 1e-3)[0], 1e-3)
    assert found["L"] == pytest.approx(0.03, rel=0.1)
    assert found["i_c"] == pytest.approx(0.12, rel=0.05)
