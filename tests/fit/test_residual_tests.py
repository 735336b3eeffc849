"""Residuals that still hold something of an input are told from correlated noise."""

import numpy as np
import pytest

from mrfit.fit.residual_tests import input_dependence
from tests.fit.toy import coloured

SAMPLES, CYCLES = 4000, 8
PERIOD = SAMPLES / CYCLES
DRIVE = np.sin(2 * np.pi * np.arange(SAMPLES) / PERIOD)


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_correlated_noise_passes_in_nearly_all_runs(rho: float) -> None:
    rng = np.random.default_rng(1)
    rows = [input_dependence("u", [DRIVE], [coloured(rng, SAMPLES, rho)], [PERIOD]) for _ in range(40)]
    assert sum(not r.independent for r in rows if r is not None) <= 2


def test_what_a_model_leaves_out_of_its_input_is_found() -> None:
    rng = np.random.default_rng(2)
    velocity = np.cos(2 * np.pi * np.arange(SAMPLES) / PERIOD)
    found = input_dependence("u", [DRIVE], [0.5 * velocity + coloured(rng, SAMPLES, 0.5)], [PERIOD])
    assert found is not None
    assert not found.independent
    # a quarter of a cycle
    assert found.lag == -125
    assert found.correlation == pytest.approx(np.sqrt(0.125 / 1.125), abs=0.05)


def test_the_lag_of_a_delayed_random_input_is_found_with_its_sign() -> None:
    rng = np.random.default_rng(3)
    drive = rng.standard_normal(SAMPLES)
    residual = 0.5 * np.roll(drive, 7) + rng.standard_normal(SAMPLES)
    found = input_dependence("u", [drive], [residual], [0.0])
    assert found is not None
    assert (found.lag, found.independent) == (7, False)
    assert found.correlation == pytest.approx(0.5 / np.sqrt(1.25), abs=0.05)


def test_a_constant_input_has_no_verdict() -> None:
    assert input_dependence("u", [np.ones(SAMPLES)], [DRIVE], [0.0]) is None


def test_no_correlation_exceeds_one_where_the_input_grows() -> None:
    grows = np.linspace(0.0, 1.0, 300) ** 3 * np.sin(np.arange(300.0))
    found = input_dependence("u", [grows], [-np.roll(grows, 20)], [0.0])
    assert found is not None
    assert -1.0 - 1e-9 <= found.correlation < -0.95
