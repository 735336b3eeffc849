import numpy as np
import pytest

from datasets.rig.damper import (
    Damper,
    Motion,
    lagged,
    play,
    resonated,
    shifted,
    simulate,
    slip_direction,
)
from datasets.rig.effects import EFFECTS

STEP = 5e-4
DAMPER = Damper()


def motion(frequency=2.0, amplitude=0.015, current=1.0, seconds=2.0, oil=25.0):
    time = STEP * np.arange(int(seconds / STEP))
    w = 2 * np.pi * frequency
    x = amplitude * np.sin(w * time)[None]
    v = amplitude * w * np.cos(w * time)[None]
    level = current(time)[None] if callable(current) else np.full_like(x, current)
    return Motion(STEP, x, v, -(w**2) * x, level, np.array([oil]))


def test_the_base_law_is_its_formula():
    force = simulate(DAMPER, {}, motion()).force[0]
    m = motion()
    x, v = m.position[0], m.speed[0]
    yields, viscous = 150.0 + 420.0 - 40.0, 750.0 + 250.0
    assert force == pytest.approx(yields * np.tanh((v + 0.35 * x) / 0.014) + viscous * v + 1200 * x + 60.0, rel=1e-12)


FAINT = {"current-saturation": 1e9, "load-cell-resonance": 5e4, "backlash": 1e-12}


@pytest.mark.parametrize("name", [n for n, e in EFFECTS.items() if e.bench.endswith("damper")])
def test_an_effect_vanishes_with_its_strength(name):
    drive = motion(current=lambda t: 1.0 + (t > 0.9))
    plain = simulate(DAMPER, {}, drive).force
    force = simulate(DAMPER, {name: FAINT.get(name, 1e-9)}, drive).force
    # a resonance beyond the solver's rate delays by a part of a step; backlash differentiates numerically
    assert np.abs(force - plain).max() < {"load-cell-resonance": 6.0, "backlash": 0.01}.get(name, 1e-3)


@pytest.mark.parametrize("name", [n for n, e in EFFECTS.items() if e.bench.endswith("damper")])
def test_an_effect_grows_with_its_strength(name):
    drive = motion(frequency=1.5, amplitude=0.02, current=lambda t: 1.0 + 1.5 * (t > 0.9), oil=40.0)
    plain = simulate(DAMPER, {}, drive).force
    moved = [np.sqrt(np.mean((simulate(DAMPER, {name: s}, drive).force - plain) ** 2)) for s in EFFECTS[name].sizes]
    assert 0 < moved[0] < moved[1] < moved[2]


def test_a_current_step_is_felt_exponentially():
    drive = motion(frequency=0.5, amplitude=0.05, current=lambda t: 1.0 + (t >= 0.1))
    felt = lagged(drive.current, 0.02, STEP)[0]
    later = STEP * np.arange(len(felt)) - 0.1
    risen = later >= 0
    # between two samples a step is a ramp, which is behind by the mean of an exponential over it
    ramp = 0.02 / STEP * (1.0 - np.exp(-STEP / 0.02))
    assert felt[risen] == pytest.approx(2.0 - ramp * np.exp(-later[risen] / 0.02), abs=1e-9)


def test_inertia_adds_mass_times_acceleration():
    drive = motion()
    added = simulate(DAMPER, {"inertia": 7.0}, drive).force - simulate(DAMPER, {}, drive).force
    assert added == pytest.approx(7.0 * drive.acceleration, abs=1e-9)


def test_delay_moves_the_force_either_way():
    time = STEP * np.arange(4000)
    signal = np.sin(2 * np.pi * time)[None]
    for delay in (0.0033, -0.0033):
        assert shifted(signal, delay, STEP)[0, 50:-50] == pytest.approx(
            np.sin(2 * np.pi * (time[50:-50] - delay)), abs=1e-5
        )


def test_play_follows_at_its_half_width_and_wipes_out():
    x = np.array([[0.0, 1.0, 0.5, 0.9, -1.0]])
    assert play(x, 0.2)[0] == pytest.approx([0.0, 0.8, 0.7, 0.7, -0.8])
    assert play(x + 1.0, 0.2, before=0.0)[0] == pytest.approx([0.8, 1.8, 1.7, 1.7, 0.2])


def test_slipping_friction_dissipates_its_force_times_the_way():
    drive = motion(frequency=1.0, amplitude=0.01)
    friction = 50.0 * slip_direction(drive.position)[0]
    lap = slice(2000, 4000)
    work = np.trapezoid(friction[lap], drive.position[0][lap])
    assert work == pytest.approx(50.0 * 4 * (0.01 - 30e-6), rel=2e-3)


def test_the_load_cell_shows_a_constant_force_unchanged_and_rings_at_its_own_frequency():
    step = np.concatenate([np.zeros(100), np.ones(3900)])[None]
    shown = resonated(step, 40.0, STEP)[0]
    assert shown[:100] == pytest.approx(0.0, abs=1e-12)
    spectrum = np.abs(np.fft.rfft(shown[100:] - 1.0))
    assert np.fft.rfftfreq(3900, STEP)[spectrum.argmax()] == pytest.approx(40.0, abs=0.6)
    assert shown[-1] == pytest.approx(1.0, abs=1e-4)


def test_the_oil_gains_the_work_done():
    drive = motion(oil=22.0, seconds=1.0)
    run = simulate(DAMPER, {}, drive)
    damping = run.force - DAMPER.stiffness * drive.position - DAMPER.offset
    work = np.trapezoid((damping * drive.speed)[0], dx=STEP)
    assert run.temperature[0, -1] - 22.0 == pytest.approx(work / 120.0, rel=0.02)
