"""Intervals hold the truth as often as they say, and say nothing where the data say nothing."""

import numpy as np
import pytest

from mrfit.fit.uncertainty import analyse, long_run_covariance
from mrfit.specs import Array

SAMPLES = 1500


def coloured(rng: np.random.Generator, samples: int, rho: float) -> Array:
    """AR(1) noise of unit variance."""
    noise = rng.standard_normal(samples) * np.sqrt(1 - rho**2)
    noise[0] = rng.standard_normal()
    for k in range(1, samples):
        noise[k] += rho * noise[k - 1]
    return noise


@pytest.mark.parametrize("rho", [0.0, 0.8])
def test_intervals_cover_a_planted_line_under_correlated_noise(rho: float) -> None:
    rng = np.random.default_rng(3)
    time = np.linspace(0, 40, SAMPLES)
    design = np.column_stack([np.sin(time), np.cos(2 * time), np.ones(SAMPLES)])
    hits, runs = np.zeros(3), 200
    for _ in range(runs):
        noise = 0.05 * coloured(rng, SAMPLES, rho)
        estimate = np.linalg.lstsq(design, noise, rcond=None)[0]
        found = analyse([design], [noise - design @ estimate])
        widths = np.array([found.half_width(axis) for axis in np.eye(3)])
        hits += np.abs(estimate) <= widths
    # 95 % ± 3 standard errors of a share over 200 runs, one point allowed to the finite-record bias of the kernel
    assert np.all(hits / runs > 0.89)
    assert np.all(hits / runs < 0.995)


def test_long_run_covariance_of_an_autoregression_is_its_spectrum_at_zero() -> None:
    rng = np.random.default_rng(5)
    series = coloured(rng, 200_000, 0.9)[:, None]
    truth = (1 + 0.9) / (1 - 0.9)
    assert long_run_covariance(series)[0, 0] / len(series) == pytest.approx(truth, rel=0.1)


def test_a_redundant_pair_is_unbounded_and_its_sum_is_not() -> None:
    rng = np.random.default_rng(7)
    column = np.sin(np.linspace(0, 20, SAMPLES))
    jacobian = np.column_stack([column, column, np.ones(SAMPLES)])
    found = analyse([jacobian], [0.01 * rng.standard_normal(SAMPLES)])
    first, second, third = np.eye(3)
    assert found.rank == 2
    assert np.isinf(found.half_width(first))
    assert np.isinf(found.half_width(second))
    assert np.isfinite(found.half_width(third))
    assert found.half_width(first + second) == pytest.approx(2 * 1.96 * 0.01 / 2 / np.sqrt(SAMPLES / 2), rel=0.15)


def test_a_parameter_drowned_in_noise_is_not_determined() -> None:
    rng = np.random.default_rng(9)
    jacobian = np.column_stack([np.ones(400), 1e-3 * np.sin(np.linspace(0, 60, 400))])
    found = analyse([jacobian], [rng.standard_normal(400)])
    assert np.isfinite(found.half_width(np.array([1.0, 0.0])))
    assert np.isinf(found.half_width(np.array([0.0, 1.0])))
