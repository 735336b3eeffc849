"""Probe skew against a flux that was integrated from a voltage and a late current."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from mrfit.effects.probe_skew import error, transform
from mrfit.simulate.assembly import assemble

DT, W = 1e-4, 2 * np.pi * 10.0
T = np.arange(4000) * DT


@pytest.mark.parametrize("tau", [3.7e-4, -1.25e-3])
def test_late_record_is_brought_back(tau: float) -> None:
    found = transform({"current": np.sin(W * (T - tau))}, np.array([tau]), DT)["current"]
    assert np.abs(found - np.sin(W * T))[50:-50].max() <= 1e-9


@pytest.mark.parametrize("tau", [2e-4, -3e-4, 5e-3])
@pytest.mark.parametrize("middle", [0.0, 0.7])
def test_flux_reconstructed_from_a_late_current_is_that_of_the_effect(tau: float, middle: float) -> None:
    resistance, inductance = 6.0, 0.03
    late = middle + np.sin(W * (T - tau))
    voltage = resistance * (middle + np.sin(W * T)) + inductance * W * np.cos(W * T)
    flux = cumulative_trapezoid(voltage - resistance * late, dx=DT, initial=0)
    channels = {"current": late, "flux_resistance": np.full(len(T), resistance)}
    model = inductance * transform(channels, np.array([tau]), DT)["current"] + error(channels, np.array([[tau]]), DT)[0]
    inner = slice(100, -100)
    gap = (flux - flux[inner].mean()) - (model - model[inner].mean())
    assert np.abs(gap[inner]).max() <= 2e-7


def test_a_measured_flux_gains_nothing() -> None:
    channels = {"current": np.sin(W * T), "flux_resistance": np.zeros(len(T))}
    assert not error(channels, np.array([[1e-3]]), DT).any()


def test_the_whole_adds_what_the_reconstruction_gained() -> None:
    whole = assemble("boucwen-flux+probe-skew")
    current = np.sin(W * T)
    theta = np.append(whole.spec.start[:-1], 1e-3)[None]
    drives = [np.stack([current, np.full(len(T), r)]) for r in (0.0, 2.0)]
    gained = np.diff([whole.simulate(d, theta, DT)[0] for d in drives], axis=0)[0]
    # R*tau*i, half of tau before the current
    assert np.abs(gained - 2.0 * 1e-3 * np.sin(W * (T + 0.5e-3)))[50:-50].max() <= 1e-3 * 2e-3
