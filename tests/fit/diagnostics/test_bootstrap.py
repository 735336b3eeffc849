"""Bootstrap intervals agree with what is known of linear models, and redrawn residuals keep their correlation."""

import numpy as np
import pytest

from mrfit.fit.diagnostics.bootstrap import block_length, bootstrap_intervals, replicated, resampled
from mrfit.fit.diagnostics.uncertainty import analyse
from mrfit.search.problem import LeastSquaresProblem
from tests.fit.toy import block, coloured, linear_model

SAMPLES, CYCLES = 3000, 6
PHASE = 2 * np.pi * CYCLES * np.arange(SAMPLES) / SAMPLES


@pytest.mark.parametrize("rho", [0.0, 0.8])
def test_the_mean_of_redrawn_residuals_scatters_as_that_of_the_noise(rho: float) -> None:
    rng = np.random.default_rng(1)
    series = coloured(rng, 20_000, rho)
    means = [resampled(series, 0.0, rng).mean() for _ in range(400)]
    assert np.var(means) * 20_000 == pytest.approx((1 + rho) / (1 - rho), rel=0.3)


def test_what_repeats_is_redrawn_once_for_all_cycles() -> None:
    rng = np.random.default_rng(2)
    repeated = np.tile(rng.standard_normal(500), CYCLES)
    drawn = resampled(repeated + 0.01 * rng.standard_normal(SAMPLES), 500.0, rng).reshape(CYCLES, 500)
    assert np.std(drawn - drawn.mean(axis=0)) < 0.02
    assert np.std(drawn.mean(axis=0)) == pytest.approx(1.0, rel=0.2)


def test_white_noise_gets_short_blocks_and_correlated_noise_long_ones() -> None:
    rng = np.random.default_rng(3)
    assert block_length(coloured(rng, 10_000, 0.95)) > 20 * block_length(rng.standard_normal(10_000))


@pytest.mark.parametrize("rho", [0.0, 0.7])
def test_intervals_of_a_linear_model_have_the_width_of_generalised_least_squares_theory(rho: float) -> None:
    rng = np.random.default_rng(4)
    drive = np.vstack([np.sin(PHASE), np.cos(PHASE)])
    assembly, cube = linear_model("", "")
    measured = np.array([0.3, -0.2]) @ drive + 0.1 * coloured(rng, SAMPLES, rho)
    estimate = np.linalg.lstsq(drive.T, measured, rcond=None)[0]
    point = cube.to_points(estimate[None, :])[0]
    errors = measured - estimate @ drive
    uncertainty = analyse([2 * drive.T], [errors], [SAMPLES / CYCLES])
    posed = LeastSquaresProblem([block(drive, measured, CYCLES)], np.ones(1), assembly, cube)
    points = replicated(posed, point, uncertainty.directions[:, ~uncertainty.open], [errors], rng)
    found = bootstrap_intervals(posed, points)
    # slow sensitivities see the noise's spectrum at zero
    width = 1.96 * 0.1 * np.sqrt((1 + rho) / (1 - rho) / (SAMPLES / 2))
    for name, value in zip(("p0", "p1"), estimate, strict=True):
        low, high = found[name]
        assert low < value < high
        assert (high - low) / 2 == pytest.approx(width, rel=0.3)


def test_an_end_beyond_a_bound_is_open() -> None:
    rng = np.random.default_rng(5)
    drive = np.vstack([np.sin(PHASE), np.cos(PHASE)])
    assembly, cube = linear_model("", "")
    top = cube.params[0].high
    measured = np.array([top, -0.2]) @ drive + 0.1 * rng.standard_normal(SAMPLES)
    estimate = np.minimum(np.linalg.lstsq(drive.T, measured, rcond=None)[0], top)
    point, errors = cube.to_points(estimate[None, :])[0], measured - estimate @ drive
    uncertainty = analyse([2 * drive.T], [errors], [SAMPLES / CYCLES])
    posed = LeastSquaresProblem([block(drive, measured, CYCLES)], np.ones(1), assembly, cube)
    points = replicated(posed, point, uncertainty.directions[:, ~uncertainty.open], [errors], rng)
    found = bootstrap_intervals(posed, points)
    assert found["p0"].high is None and found["p0"].low < top
    assert None not in found["p1"]
