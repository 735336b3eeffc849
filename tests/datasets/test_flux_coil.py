from dataclasses import replace

import numpy as np
import pytest

from datasets.rig.boucwen import FluxBoucWen
from datasets.rig.flux_coil import Effects, FluxCoil, base_coil, solve

COIL = base_coil(np.random.default_rng(4))
PER_PERIOD = 800


def driven(coil=COIL, effects=None, frequency=5.0, amplitude=12.0, periods=3):
    steps = periods * PER_PERIOD
    step = 1 / (frequency * PER_PERIOD)
    emf = amplitude * np.sin(2 * np.pi * np.arange(2 * steps + 1) / (2 * PER_PERIOD))
    return step, solve(coil, effects or Effects(), emf[None], np.array([step]), keep=1)


def test_energy_into_the_coil_is_heat_plus_iron_plus_stored():
    step, run = driven()
    u, i, flux = run.voltage[0], run.current[0], run.flux[0]
    lap = slice(PER_PERIOD, None)
    put_in = np.trapezoid((u * i)[lap], dx=step)
    heat = COIL.resistance * np.trapezoid(i[lap] ** 2, dx=step)
    magnetic = np.trapezoid(i[lap], flux[lap])
    assert put_in == pytest.approx(heat + magnetic, rel=1e-4)
    assert magnetic > 0


def test_without_hysteresis_it_is_an_inductance():
    iron = FluxBoucWen(A=1.0, Lc=0.02, kappa=3.0, beta=1.0, gamma=2.0, n=1.3, D=1.0)
    step, run = driven(FluxCoil(iron, resistance=2.0, output_resistance=0.0), frequency=10.0)
    w, t = 2 * np.pi * 10, step * np.arange(run.current.shape[1])
    exact = 2.0 * np.sin(w * t) - w * 0.02 * (np.cos(w * t) - np.exp(-t * 2.0 / 0.02))
    exact = 12.0 * exact / (4.0 + (w * 0.02) ** 2)
    assert np.abs(run.current[0] - exact).max() < 1e-7


def test_the_state_follows_the_bouc_wen_law_solved_in_current():
    _, run = driven(periods=2)
    z = COIL.iron.hysteretic(run.current[0])
    assert np.abs(COIL.iron.flux(run.current[0], z) - run.flux[0]).max() < 2e-5 * np.ptp(run.flux)


def test_the_integral_of_the_voltage_is_the_flux_under_every_effect():
    effects = Effects(eddy=30.0, saturation=0.15, aftereffect=0.05, vibration=0.02)
    step, run = driven(effects=effects)
    rate = run.voltage[0] - COIL.resistance * run.current[0]
    flux = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2) * step])
    assert np.abs(flux - run.flux[0]).max() < 1e-4 * np.ptp(run.flux)


@pytest.mark.parametrize(
    "faint",
    [{"eddy": 1e12}, {"saturation": 1e6}, {"heating": 1e-12}, {"aftereffect": 1e-12}, {"vibration": 1e-12}],
    ids=lambda e: next(iter(e)),
)
def test_an_effect_vanishes_with_its_strength(faint):
    plain, run = (driven(effects=e, periods=1)[1] for e in (None, Effects(**faint)))
    assert np.abs(plain.current - run.current).max() < 1e-8


def test_copper_warms_by_its_joule_heat():
    # at a low frequency and no cooling to speak of, the rise is K/J times the heat
    step, run = driven(effects=Effects(heating=1e-4), periods=2)
    cold = driven(periods=2)[1]
    warm = run.voltage[0] - np.gradient(run.flux[0], step)
    quiet = np.abs(run.current[0]) > 2.0
    seen = np.median((warm[quiet] / run.current[0][quiet])[-200:]) / COIL.resistance - 1.0
    heat = COIL.resistance * np.trapezoid(cold.current[0] ** 2, dx=step)
    assert seen == pytest.approx(0.00393 * 1e-4 * heat, rel=0.1)


def test_the_drawn_coil_has_positive_inductance_and_dissipates():
    for seed in range(20):
        iron = base_coil(np.random.default_rng(seed)).iron
        z = np.linspace(-0.99, 0.99, 50)
        assert min(iron.inductance(z, np.ones(50)).min(), iron.inductance(z, -np.ones(50)).min()) > 0
        assert (1 - iron.A) / iron.D < 0


def test_runs_side_by_side_do_not_touch_each_other():
    emf = 12.0 * np.sin(2 * np.pi * np.arange(401) / 400)
    step = np.array([1e-3, 2e-3])
    both = solve(COIL, Effects(), np.vstack([emf, 0.5 * emf]), step, keep=1)
    alone = solve(replace(COIL), Effects(), 0.5 * emf[None], step[1:], keep=1)
    assert np.array_equal(both.current[1], alone.current[0])
