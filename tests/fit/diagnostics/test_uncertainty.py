"""Intervals hold the truth as often as they say, and say nothing where the data say nothing."""

import numpy as np
import pytest
from scipy.linalg import matmul_toeplitz

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.uncertainty import analyse, condensed, differing, long_run_covariance, sensitivities
from tests.fit.toy import coloured

SAMPLES, CYCLES = 1500, 6
PERIOD = SAMPLES / CYCLES


def loop_design() -> Array:
    """Sensitivities as a hysteresis model has them: a line, a loop that saturates, and its knee."""
    phase = 2 * np.pi * np.arange(SAMPLES) / PERIOD
    late = 6 * np.sin(phase - 0.15)
    return np.column_stack([np.sin(phase), np.tanh(late), np.sin(phase - 0.15) / np.cosh(late) ** 2])


def coverage(noise: float, rho: float, step: float, runs: int) -> Array:
    """Share of runs in which each interval holds the truth; noise AR(1), converter steps, a new truth each time."""
    rng = np.random.default_rng(3)
    design = loop_design()
    hits = np.zeros(3)
    for _ in range(runs):
        truth = np.array([100.0, 20.0, 5.0]) * (1 + 0.01 * rng.standard_normal(3))
        measured = design @ truth + noise * coloured(rng, SAMPLES, rho) + 10 * rng.random() * (step > 0)
        measured = step * np.round(measured / step) if step else measured
        measured = measured - (measured - design @ truth).mean() * (step > 0)
        estimate = np.linalg.lstsq(design, measured, rcond=None)[0]
        found = analyse([design * 1e4], [measured - design @ estimate], [PERIOD])
        widths = 1e4 * np.array([found.half_width(axis) for axis in np.eye(3)])
        hits += np.abs(estimate - truth) <= widths
    return hits / runs


CASES = [(1.0, 0.0, 0.0), (1.0, 0.5, 0.0), (1.0, 0.8, 0.0)]


@pytest.mark.parametrize(("noise", "rho", "step"), CASES)
def test_intervals_cover_the_planted_parameters(noise: float, rho: float, step: float) -> None:
    share = coverage(noise, rho, step, 100)
    # 93 to 97 % and 2.5 standard errors of a share over 100 runs
    assert np.all(share > 0.88)


@pytest.mark.parametrize("rho", [0.0, 0.95])
@pytest.mark.parametrize("cycles", [3, 0])
def test_intervals_are_as_wide_as_the_noise_makes_them(rho: float, cycles: int) -> None:
    samples = 6000
    phase = 6 * np.pi * np.arange(samples) / samples
    late = 6 * np.sin(phase - 0.15)
    design = np.column_stack([np.sin(phase), np.tanh(late), np.sin(phase - 0.15) / np.cosh(late) ** 2])
    inverse = np.linalg.pinv(design)
    exact = 1.96 * np.sqrt(np.diag(inverse @ matmul_toeplitz(rho ** np.arange(samples), inverse.T)))
    widths = []
    for seed in range(20):
        noise = coloured(np.random.default_rng(seed), samples, rho)
        residual = noise - design @ (inverse @ noise)
        found = analyse([design * 1e4], [residual], [samples / cycles if cycles else 0.0])
        widths.append([1e4 * found.half_width(axis) for axis in np.eye(3)])
    # chance resemblance of cycles widens some of them
    assert np.mean(widths, axis=0) / exact == pytest.approx(1.04, abs=0.08)


def test_intervals_cover_under_converter_steps_that_repeat_in_every_cycle() -> None:
    # steps of ten times the noise: taken as independent between cycles they would be covered in 70 to 80 %
    assert np.all(coverage(0.2, 0.0, 2.0, 100) > 0.88)


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "rho", "step"), CASES)
def test_coverage_is_93_to_97_percent(noise: float, rho: float, step: float) -> None:
    share = coverage(noise, rho, step, 1000)
    # and two standard errors of a share over 1000 runs
    assert np.all(share > 0.93 - 0.014)
    assert np.all(share < 0.97 + 0.014)


def test_more_cycles_do_not_narrow_intervals_of_an_error_that_repeats() -> None:
    rng = np.random.default_rng(6)
    cycle = rng.standard_normal(250)
    widths = []
    for cycles in (4, 16):
        phase = 2 * np.pi * np.arange(250 * cycles) / 250
        design = np.column_stack([np.sin(phase), np.cos(phase)]) * 1e4
        series = np.tile(cycle, cycles) + 1e-3 * rng.standard_normal(250 * cycles)
        widths.append(analyse([design], [series], [250.0]).half_width(np.array([1.0, 0.0])))
    assert widths[1] == pytest.approx(widths[0], rel=0.1)


def test_long_run_covariance_of_an_autoregression_is_its_spectrum_at_zero() -> None:
    rng = np.random.default_rng(5)
    series = coloured(rng, 200_000, 0.9)[:, None]
    truth = (1 + 0.9) / (1 - 0.9)
    assert long_run_covariance(series)[0, 0] / len(series) == pytest.approx(truth, rel=0.15)


def test_what_differs_between_cycles_is_the_series_less_what_repeats() -> None:
    rng = np.random.default_rng(8)
    noise = rng.standard_normal(4000)
    repeated = np.tile(rng.standard_normal(400), 10)
    assert np.std(differing(noise + repeated, 400.0)) == pytest.approx(np.std(noise), rel=0.03)
    assert np.array_equal(differing(noise, 0.0), noise)


def test_condensed_rows_keep_the_variance_of_noise_and_the_products_of_slow_rows() -> None:
    rng = np.random.default_rng(2)
    slow = np.sin(np.linspace(0, 6, 12_000))
    rows = np.vstack([slow, rng.standard_normal(12_000)])
    short = condensed(rows, 4)
    assert short.shape == (2, 3000)
    assert short[0] @ short[0] == pytest.approx(slow @ slow, rel=1e-5)
    assert np.var(short[1]) == pytest.approx(1.0, rel=0.1)


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
    assert found.half_width(first + second) == pytest.approx(2 * 1.96 * 0.01 / 2 / np.sqrt(SAMPLES / 2), rel=0.2)


def test_a_redundant_pair_is_unbounded_without_any_noise() -> None:
    column = np.sin(np.linspace(0, 20, SAMPLES))
    found = analyse([np.column_stack([column, column * (1 + 1e-9)])], [np.zeros(SAMPLES)])
    assert found.rank == 1
    assert np.isinf(found.half_width(np.array([1.0, 0.0])))


def test_parameters_beyond_the_number_of_samples_are_unbounded() -> None:
    rng = np.random.default_rng(4)
    found = analyse([rng.standard_normal((5, 8))], [0.01 * rng.standard_normal(5)])
    assert found.open.sum() >= 3
    assert np.isinf(found.spreads).sum() == 3
    assert found.covariance.shape == (8, 8)


def test_a_parameter_drowned_in_noise_is_not_determined() -> None:
    rng = np.random.default_rng(9)
    jacobian = np.column_stack([np.ones(400), 1e-3 * np.sin(np.linspace(0, 60, 400))])
    found = analyse([jacobian], [rng.standard_normal(400)])
    assert np.isfinite(found.half_width(np.array([1.0, 0.0])))
    assert np.isinf(found.half_width(np.array([0.0, 1.0])))
    assert not found.redundant.any()


def test_a_few_periodic_cycles_do_not_widen_what_a_long_aperiodic_record_says() -> None:
    long, cycles, period, columns = 5000, 3, 10, 6
    phase = 2 * np.pi * np.arange(cycles * period) / period
    waves = np.stack([np.cos((k + 1) * phase + k) for k in range(columns)], axis=1)
    ratios = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        design = np.vstack([rng.standard_normal((long, columns)), waves])
        residual = rng.standard_normal(len(design))
        residual -= design @ np.linalg.lstsq(design, residual, rcond=None)[0]
        parts = [slice(0, long), slice(long, None)]
        found = analyse([10 * design[p] for p in parts], [residual[p] for p in parts], [0.0, float(period)])
        exact = 1.96 * np.sqrt(np.diag(np.linalg.inv(design.T @ design))) / 10
        ratios.append([found.half_width(axis) for axis in np.eye(columns)] / exact)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)


def test_nothing_is_known_along_a_parameter_whose_neighbours_diverge() -> None:
    def simulate(points: Array) -> Array:
        rows = points @ np.vstack([np.arange(1.0, 6.0), np.ones(5)])
        rows[points[:, 1] > 0.5] = np.nan
        return rows

    jacobian = sensitivities(simulate, np.array([0.5, 0.5]))
    assert jacobian[:, 0] == pytest.approx(np.arange(1.0, 6.0))
    assert np.all(jacobian[:, 1] == 0.0)
    assert analyse([jacobian], [np.full(5, 0.1)]).half_width(np.array([0.0, 1.0])) == np.inf
