"""The stops of a core: closed minor loops, saturation, and walls that lag behind a corner of the flux."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.models.stop_mmf import SPEC, response, start_values

VALUES = {"L": 0.03, "flux_s": 0.1, "p": 4.0, "i_c": 0.2, "flux_y": 0.004, "q": 0.2, "g": 0.5, "m": 0.0, "T": 1e-3}


def current(flux: np.ndarray, dt: float = 1e-3, **changed: float) -> np.ndarray:
    return response(flux[None], SPEC.theta({**VALUES, **changed})[None], dt)[0]


@settings(max_examples=20, deadline=None)
@given(turns=st.lists(st.floats(-0.09, 0.09), min_size=2, max_size=6))
def test_a_closed_path_forgets_itself_and_dissipates(turns: list[float]) -> None:
    # whatever lies between, the same greatest swings lead back to the same current
    path = np.concatenate([[0.0, 0.09, -0.09], turns, [0.09, -0.09]])
    flux = np.interp(np.linspace(0, len(path) - 1, 60 * (len(path) - 1) + 1), np.arange(len(path)), path)
    found = current(flux, g=0.0)
    assert found[-1] == pytest.approx(found[120], rel=1e-9)
    closed = slice(120, None)
    assert np.trapezoid(found[closed], flux[closed]) > 0.0


def test_without_hysteresis_it_is_froehlichs_curve_with_a_tangent_beyond() -> None:
    flux = np.linspace(0.0, 0.15, 301)
    found, u = current(flux, i_c=0.0), (flux / 0.1) ** 4
    below = u < 0.97
    np.testing.assert_allclose(found[below], flux[below] / 0.03 / (1.0 - u[below]), rtol=1e-12)
    assert np.all(np.diff(found) > 0.0) and found[-1] < 1e6


def test_all_stops_at_their_thresholds_are_the_coercive_current() -> None:
    flux = np.concatenate([np.linspace(0, 0.2, 100), np.linspace(0.2, 0.0, 100)])
    found = current(flux, q=0.0, g=0.0, L=100.0, p=1.0) - current(flux, i_c=0.0, L=100.0, p=1.0)
    assert found[99] == pytest.approx(0.2) and found[-1] == pytest.approx(-0.2)


def test_walls_take_a_current_after_a_corner_that_relaxes() -> None:
    flux, dt, relaxing = 1e-3 * np.abs(np.arange(400) - 200.0), 1e-4, 1e-3
    walls = current(flux, dt, m=1e-5, T=relaxing) - current(flux, dt)
    assert np.max(np.abs(walls[:201])) < 1e-9, "the flux began at a steady rate"
    jump = 2.0 * 1e-3 / dt * 1e-5 / relaxing
    np.testing.assert_allclose(
        walls[201:], jump * np.exp(-dt / relaxing * np.arange(1, 200)), rtol=1e-7, atol=1e-9 * jump
    )


def test_a_search_can_begin_at_the_start_values() -> None:
    flux = 0.08 * np.sin(np.linspace(0, 6 * np.pi, 3000))
    found = start_values(flux[None], current(flux), 1e-3)
    assert 0.01 < found["L"] < 0.06 and 0.08 < found["flux_s"] < 0.2 and 0.05 < found["i_c"] < 1.0
