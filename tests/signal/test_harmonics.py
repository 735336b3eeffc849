import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.signal.harmonics import harmonic_fit, synthesis, transform


def series(t: np.ndarray, frequency: float) -> np.ndarray:
    turn = 2 * np.pi * frequency * t
    return 0.7 + 5 * np.sin(turn + 0.3) + 0.5 * np.cos(3 * turn) - 0.1 * np.sin(6 * turn)


@settings(max_examples=40, deadline=None)
@given(
    cycles=st.floats(2.0, 60.0),
    per_cycle=st.floats(17.0, 700.0),
    guess=st.floats(0.97, 1.03),
)
def test_a_noise_free_series_is_found_exactly(cycles: float, per_cycle: float, guess: float) -> None:
    frequency, dt = 5.0, 1 / (5.0 * per_cycle)
    t = np.arange(int(cycles * per_cycle)) * dt
    fit = harmonic_fit(series(t, frequency), dt, guess * frequency)
    assert fit.harmonics == 6
    assert fit.frequency == pytest.approx(frequency, rel=1e-9)
    assert fit.evaluate(t) == pytest.approx(series(t, frequency), abs=1e-7)


def test_noise_is_not_fitted_and_averages_out() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(20_000) / 2000
    clean = series(t, 1.003)
    fit = harmonic_fit(clean + 0.05 * rng.standard_normal(len(t)), 1 / 2000, 1.01)
    assert 3 <= fit.harmonics <= 7
    assert fit.residual == pytest.approx(0.05, rel=0.03)
    # 2K + 2 parameters take 2K + 2 parts in N of the noise power.
    assert np.std(fit.evaluate(t) - clean) < 0.05 * np.sqrt(40 / len(t))


def test_noise_alone_gives_a_constant() -> None:
    values = 2.0 + np.random.default_rng(2).standard_normal(5000)
    assert harmonic_fit(values, 1e-3, 5.0, refine=False).harmonics == 0


def test_derivatives_are_those_of_the_closed_form() -> None:
    frequency, dt = 2.0, 1e-3
    t = np.arange(3000) * dt
    turn = 2 * np.pi * frequency
    fit = harmonic_fit(np.sin(turn * t), dt, 2.02)
    assert fit.evaluate(t, 1) == pytest.approx(turn * np.cos(turn * t), abs=1e-8)
    assert fit.evaluate(t, 2) == pytest.approx(-(turn**2) * np.sin(turn * t), abs=1e-6)


def test_shifting_moves_the_origin_of_time() -> None:
    t = np.arange(2000) / 1000
    fit = harmonic_fit(series(t, 3.0), 1e-3, 3.0)
    assert fit.shifted(0.123).evaluate(t) == pytest.approx(fit.evaluate(t + 0.123), abs=1e-9)


def test_transform_and_synthesis_equal_the_plain_sums() -> None:
    rng = np.random.default_rng(3)
    values, omegas = rng.standard_normal(1013), np.array([0.0, 0.013, 0.7, 2.9])
    n = np.arange(1013)
    plain = np.array([np.sum(values * np.exp(-1j * w * n)) for w in omegas])
    assert transform(values, omegas) == pytest.approx(plain, abs=1e-9)
    coefficients = rng.standard_normal(4) + 1j * rng.standard_normal(4)
    sums = sum((c * np.exp(1j * k * 0.031 * n)).real for k, c in enumerate(coefficients))
    assert synthesis(coefficients, 0.031, 1013) == pytest.approx(sums, abs=1e-10)


def test_a_long_record_keeps_memory_linear() -> None:
    import tracemalloc

    t = np.arange(200_000) / 4000
    values = series(t, 1.0)
    tracemalloc.start()
    harmonic_fit(values, 1 / 4000, 1.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # A basis of 40 harmonics alone would be 81 times the signal.
    assert peak < 20 * values.nbytes
