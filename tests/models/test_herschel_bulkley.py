"""Herschel-Bulkley against Bingham, which it is for n = 1, and its own power."""

import numpy as np
import pytest
from scipy.special import gamma

from mrfit.models import bingham
from mrfit.models.herschel_bulkley import response, start_values

V = np.linspace(-0.3, 0.3, 301)[None]


def test_is_bingham_for_a_flow_index_of_1() -> None:
    expected = bingham.response(V, np.array([[800.0, 3000.0, 20.0]]), 1e-3)
    assert response(V, np.array([[800.0, 3000.0, 1.0, 20.0]]), 1e-3) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("n", [0.3, 0.7, 2.0])
def test_viscous_force_grows_as_the_nth_power(n: float) -> None:
    force = response(np.array([[0.05, 0.1, -0.1, 0.0]]), np.array([[100.0, 2000.0, n, 5.0]]), 1e-3)[0] - 5.0
    assert (force[1] - 100.0) / (force[0] - 100.0) == pytest.approx(2**n)
    assert force[2] == pytest.approx(-force[1])
    assert force[3] == 0.0


def test_loss_per_cycle_of_a_sine_is_the_coulomb_and_the_power_law_integral() -> None:
    fy, k, n, amplitude, omega = 300.0, 900.0, 0.6, 0.01, 8.0
    phase = 2 * np.pi * (np.arange(100_000) + 0.5) / 100_000
    velocity = amplitude * omega * np.cos(phase)
    loss = np.mean(response(velocity[None], np.array([[fy, k, n, 0.0]]), 1e-3)[0] * velocity) * 2 * np.pi / omega
    mean_power = gamma(n / 2 + 1) / gamma(n / 2 + 1.5) / np.sqrt(np.pi)  # of |cos|^(n+1)
    expected = 4 * fy * amplitude + 2 * np.pi / omega * k * (amplitude * omega) ** (n + 1) * mean_power
    assert loss == pytest.approx(expected, rel=1e-6)


def test_start_values_are_exact_for_a_bingham_force() -> None:
    force = bingham.response(V, np.array([[800.0, 3000.0, 20.0]]), 1e-3)[0]
    assert start_values(V, force, 1e-3) == pytest.approx({"fy": 800, "C_inf": 3000, "n": 1, "f0": 20}, rel=1e-6)
