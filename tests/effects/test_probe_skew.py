"""Probe skew against a flux that was integrated from a voltage and a late current."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from mrfit.effects.probe_skew import transform

DT, W = 1e-4, 2 * np.pi * 10.0
T = np.arange(4000) * DT


@pytest.mark.parametrize("tau", [3.7e-4, -1.25e-3])
def test_late_record_is_brought_back(tau: float) -> None:
    found = transform({"current": np.sin(W * (T - tau))}, np.array([tau]), DT)["current"]
    assert np.abs(found - np.sin(W * T))[50:-50].max() <= 1e-9


@pytest.mark.parametrize("tau", [2e-4, -3e-4])
def test_flux_reconstructed_from_a_late_current_is_that_of_the_effect_with_more_inductance(tau: float) -> None:
    resistance, inductance = 6.0, 0.03
    late = np.sin(W * (T - tau))
    voltage = resistance * np.sin(W * T) + inductance * W * np.cos(W * T)
    flux = cumulative_trapezoid(voltage - resistance * late, dx=DT, initial=0)
    model = (inductance + resistance * tau) * transform({"current": late}, np.array([tau]), DT)["current"]
    inner = slice(100, -100)
    gap = (flux - flux[inner].mean()) - (model - model[inner].mean())
    # beyond first order in tau stays R*tau^2/2*di/dt
    assert np.abs(gap[inner]).max() <= 1.2 * resistance * tau**2 / 2 * W + 1e-5
