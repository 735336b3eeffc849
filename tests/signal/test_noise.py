import numpy as np
import pytest
from scipy.signal import lfilter

from mrfit.signal.noise import noise_floor, noise_level, quantisation


def loop(n: np.ndarray, per_cycle: float) -> np.ndarray:
    turn = 2 * np.pi * n / per_cycle
    return np.tanh(4 * np.sin(turn)) + 0.2 * np.cos(2 * turn)


def coloured(rng: np.random.Generator, samples: int, pole: float) -> np.ndarray:
    return 0.01 * lfilter([np.sqrt(1 - pole**2)], [1, -pole], rng.standard_normal(samples + 2000))[2000:]


@pytest.mark.parametrize(("per_cycle", "cycles"), [(200.0, 10), (333.37, 20), (1999.6, 5)])
@pytest.mark.parametrize(("pole", "tolerance"), [(0.0, 0.03), (0.9, 0.08)])
def test_planted_noise_is_recovered(per_cycle: float, cycles: int, pole: float, tolerance: float) -> None:
    rng = np.random.default_rng(5)
    n = np.arange(round(per_cycle * cycles))
    noise = coloured(rng, len(n), pole)
    floor = noise_floor(loop(n, per_cycle) + noise, 0.001, 1000 / per_cycle, cycles)
    assert floor == pytest.approx(np.std(noise), rel=tolerance)


def test_two_cycles_are_enough_on_average() -> None:
    rng = np.random.default_rng(6)
    n = np.arange(667)
    floors = [noise_floor(loop(n, 333.37) + coloured(rng, 667, 0.5), 1.0, 1 / 333.37, 2) for _ in range(40)]
    assert np.mean(floors) == pytest.approx(0.01, rel=0.05)


def test_what_repeats_is_no_noise() -> None:
    n = np.arange(4000)
    assert noise_floor(loop(n, 400.0), 1.0, 1 / 400, 10) < 1e-6


def test_a_record_without_cycles_gives_its_white_noise() -> None:
    rng = np.random.default_rng(7)
    walk = np.convolve(rng.standard_normal(20_400), np.hanning(401), mode="valid")[:20_000]
    floor = noise_floor(walk + 0.3 * rng.standard_normal(20_000), 1e-3, 0.0, 0)
    assert floor == pytest.approx(0.3, rel=0.05)


def test_jumps_are_no_noise() -> None:
    rng = np.random.default_rng(8)
    bits = np.repeat(rng.integers(0, 2, 100) * 2.0 - 1.0, 100)
    assert noise_level(bits + 0.02 * rng.standard_normal(10_000)) == pytest.approx(0.02, rel=0.1)


def test_a_quantised_signal_has_the_noise_of_its_step() -> None:
    values = np.round(np.sin(np.arange(5000) / 100) / 0.02) * 0.02
    assert quantisation(values) == pytest.approx(0.02)
    # Steps of a slow signal look like more than uniform noise to differences, but not by much.
    assert 0.02 / np.sqrt(12) * 0.999 <= noise_level(values) < 2 * 0.02 / np.sqrt(12)


@pytest.mark.parametrize("levels", [(0.0, 1.0, 2.0), (0.0, 0.5, 1.0, 1.5, 2.0)])
def test_a_commanded_level_is_exact_and_a_measured_one_is_not(levels: tuple[float, ...]) -> None:
    rng = np.random.default_rng(2)
    commanded = np.repeat(rng.choice(levels, 100), 25)
    assert noise_level(commanded) == 0.0
    flickers = rng.random(len(commanded)) < 0.3
    step = levels[1] - levels[0]
    assert quantisation(commanded + step * flickers) == pytest.approx(step)


def test_a_fast_quantised_signal_has_white_noise() -> None:
    values = np.round(np.sin(np.arange(5000) / 10) / 0.002) * 0.002
    assert noise_level(values) == pytest.approx(0.002 / np.sqrt(12), rel=0.1)


def test_a_continuous_signal_has_no_step() -> None:
    assert quantisation(np.sin(np.arange(5000) / 100)) == 0.0
    assert quantisation(np.ones(100)) == 0.0
    assert quantisation(np.arange(100) / 7) == 0.0


@pytest.mark.parametrize("cycles", [6, 20])
def test_a_steady_drift_and_a_growing_cycle_are_no_noise_where_trends_are_taken_away(cycles: int) -> None:
    rng = np.random.default_rng(9)
    n = np.arange(round(333.3 * cycles))
    noise = 0.01 * rng.standard_normal(len(n))
    values = loop(n, 333.3) * (1.0 + 0.1 * n / len(n)) + 0.3 * n / len(n) + noise
    assert noise_floor(values, 1e-3, 1e3 / 333.3, cycles) > 0.05
    assert noise_floor(values, 1e-3, 1e3 / 333.3, cycles, trending=True) == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize("pole", [0.0, 0.8, 0.98])
@pytest.mark.parametrize("cycles", [4, 5, 8])
def test_taking_a_trend_away_takes_no_noise_with_it(pole: float, cycles: int) -> None:
    """Noise of any colour: what a trend's harmonics carry off by chance is put back."""
    rng = np.random.default_rng(12)
    floors = []
    for _ in range(20):
        n = np.arange(cycles * 600)
        values = loop(n, 600.0) + coloured(rng, len(n), pole)
        floors.append(noise_floor(values, 1e-3, 1e3 / 600.0, cycles, trending=True))
    assert np.sqrt(np.mean(np.square(floors))) == pytest.approx(0.01, rel=0.06)
