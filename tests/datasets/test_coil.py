from dataclasses import replace
from math import inf

import numpy as np
import pytest

from datasets.rig.coil import Coil, default_hysteresis, solve, tune
from datasets.rig.stop import StopLaw


def driven(coil, frequency=5.0, amplitude=20.0, periods=4, per_period=2000):
    phase = 2 * np.pi * np.arange(periods * per_period + 1) / per_period
    step = 1 / (frequency * per_period)
    return step, solve(coil, amplitude * np.sin(phase)[None], np.array([step]), keep=1)


@pytest.mark.parametrize("eddy", [inf, 60.0])
def test_energy_into_the_coil_is_heat_plus_iron_plus_stored(eddy):
    coil = replace(Coil(), eddy=eddy)
    step, run = driven(coil)
    u, i, flux = run.voltage[0], run.current[0], run.flux[0]
    put_in = np.trapezoid(u * i, dx=step)
    heat = coil.resistance * np.trapezoid(i**2, dx=step)
    magnetic = np.trapezoid(i, flux)
    assert put_in == pytest.approx(heat + magnetic, rel=1e-5)
    assert np.abs(np.trapezoid(u - coil.resistance * i, dx=step) - (flux[-1] - flux[0])) < 1e-6


def test_a_linear_coil_follows_the_closed_form():
    # no stops, and a knee so far off that the iron is linear: L = b / a
    coil = Coil(resistance=2.0, knee_current=1e4, knee_flux=200.0, output_resistance=0.0)
    coil = replace(coil, hysteresis=StopLaw(np.array([1.0]), np.array([0.0])))
    step, run = driven(coil, frequency=10.0, periods=3)
    w, inductance, t = 2 * np.pi * 10, 0.02, step * np.arange(run.current.shape[1])
    z2 = 4.0 + (w * inductance) ** 2
    exact = 20.0 * (2.0 * np.sin(w * t) - w * inductance * (np.cos(w * t) - np.exp(-t * 2.0 / inductance))) / z2
    assert np.abs(run.current[0] - exact).max() < 1e-5 * np.abs(exact).max()


def test_static_loop_area_does_not_depend_on_frequency_and_eddy_currents_add_their_joule_heat():
    frequency, amplitude = np.array([1.0, 5.0, 10.0]), np.full(3, 3.0)
    areas, heat = {}, np.zeros(3)
    for eddy in (inf, 2000.0):
        coil = replace(Coil(), eddy=eddy)
        phase = 2 * np.pi * np.arange(6001) / 2000
        run = solve(coil, tune(coil, frequency, amplitude)[:, None] * np.sin(phase), 1 / (2000 * frequency), 1)
        current, flux = run.current[:, -2001:], run.flux[:, -2001:]
        areas[eddy] = np.trapezoid(current, flux, axis=1)
        heat = np.trapezoid(np.gradient(flux, axis=1) ** 2, axis=1) * 2000 * frequency / eddy
    assert areas[inf] == pytest.approx(areas[inf][0], rel=2e-3)
    assert areas[2000.0] - areas[inf] == pytest.approx(heat, rel=0.05)
    assert heat[2] > 8 * heat[0]


def test_steps_do_not_matter():
    last = [driven(Coil(), per_period=n)[1].current[0, -1] for n in (1000, 4000)]
    assert last[0] == pytest.approx(last[1], abs=2e-4)


def test_the_default_iron_needs_its_stated_current():
    law = default_hysteresis()
    assert law.thresholds @ law.weights == pytest.approx(0.18)
