"""Eddy currents against a coil with a parallel loss resistance, solved on paper."""

import numpy as np
import pytest

from mrfit.effects.eddy_current import shape

INDUCTANCE, CURRENT = 0.03, 2.0


def flux_of(frequency: float, tau: float) -> tuple[np.ndarray, np.ndarray]:
    """Return current and flux over the last of six cycles of a linear coil."""
    per_cycle = 4000
    t = np.arange(6 * per_cycle + 1) / (per_cycle * frequency)
    current = CURRENT * np.sin(2 * np.pi * frequency * t)
    flux = shape(INDUCTANCE * current[None], {}, np.array([[tau]]), t[1])[0]
    return current[-per_cycle - 1 :], flux[-per_cycle - 1 :]


def test_flux_is_that_of_the_inductance_beside_the_loss_resistance() -> None:
    loss_resistance, frequency = 20.0, 10.0
    current, flux = flux_of(frequency, INDUCTANCE / loss_resistance)
    w = 2 * np.pi * frequency
    # current divider: i_m = i*R_e/(R_e + j*w*L)
    phasor = INDUCTANCE * CURRENT * loss_resistance / (loss_resistance + 1j * w * INDUCTANCE)
    angle = 2 * np.pi * np.arange(len(flux)) / 4000
    assert np.abs(flux - np.imag(phasor * np.exp(1j * angle))).max() <= 1e-5 * np.ptp(flux)


def test_loop_area_grows_with_frequency_and_is_the_energy_lost() -> None:
    tau, areas = 2e-4, []
    for frequency in (1.0, 5.0, 10.0):
        current, flux = flux_of(frequency, tau)
        areas.append(np.trapezoid(current, flux))
        turn = 2 * np.pi * frequency * tau
        assert areas[-1] == pytest.approx(np.pi * INDUCTANCE * CURRENT**2 * turn / (1 + turn**2), rel=1e-4)
    assert areas[1] / areas[0] == pytest.approx(5, rel=1e-3)
    assert areas[2] / areas[0] == pytest.approx(10, rel=1e-3)


def test_a_constant_flux_is_not_lagged() -> None:
    assert np.array_equal(shape(np.full((1, 9), 0.3), {}, np.array([[0.01]]), 1e-3), np.full((1, 9), 0.3))
