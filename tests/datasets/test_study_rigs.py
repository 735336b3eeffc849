"""The rigs of the studies keep the laws they are said to have."""

from pathlib import Path

import numpy as np
import pytest

from datasets.rig.plug import Plug
from datasets.studies import force_tracking, hammerstein_wiener, preyield

PLUG = Plug(lambda i: 100.0 + 700.0 * i, lambda i: 900.0 + 0.0 * i, lambda i: 5.0e4 + 0.0 * i)


def test_a_plug_at_constant_speed_gives_yield_force_and_thinned_viscosity() -> None:
    step, speed = 1e-4, 0.05
    position = speed * step * np.arange(800)[None, :]
    force = PLUG.force(position, np.full((1, 1), 0.5), np.array([step]))[0]
    # past the chains, which yield within 0.3 mm, what the leak lets through does not move the plug
    slip = speed - force[-1] / 5.0e4
    assert force[-1] == pytest.approx(450.0 + 900.0 * slip / np.sqrt(1.0 + slip / PLUG.shear_speed), rel=1e-6)
    assert force[1] < 0.2 * force[-1]


def test_a_piston_that_creeps_pushes_the_leak_alone_and_a_quick_one_the_chains() -> None:
    position = 1e-7 * np.arange(200)[None, :]
    slow, quick = (PLUG.force(position, np.zeros((1, 1)), np.array([step]))[0] for step in (1e-2, 1e-7))
    assert slow[-1] == pytest.approx(5.0e4 * 1e-5, rel=1e-3)
    # below the first threshold of 20 um the chains are a spring, here beside a viscosity that is as small
    still = Plug(PLUG.yield_force, lambda i: 0.0 * i, PLUG.pre_yield)
    force = still.force(position, np.zeros((1, 1)), np.array([1e-7]))[0]
    assert force[-1] == pytest.approx(100.0 * PLUG.law.weights.sum() * position[0, -1], rel=0.01)
    assert quick[-1] > force[-1]


@pytest.mark.parametrize("current", [0.0, 1.0])
def test_a_cycle_of_a_plug_loses_energy(current: float) -> None:
    phase = np.linspace(0.0, 4.0 * np.pi, 2001)
    position = 0.004 * np.sin(phase)[None, :]
    rig = preyield.Rig()
    force = rig.plug(current).force(position, np.zeros((1, 1)), np.array([1e-3]))[0]
    work = np.trapezoid(force[1000:], position[0, 1000:])
    # no less than the yield force over the stroke, less what the chains keep
    assert work > 4.0 * 0.002 * rig.yield_force[round(current)]


def test_the_yield_force_of_the_tracking_rig_meets_at_its_corner() -> None:
    below, above = force_tracking.yield_force(np.array([0.2 - 1e-9, 0.2 + 1e-9]))
    assert below == pytest.approx(above, rel=1e-3)


def test_the_field_of_the_tracking_rig_lags_a_step_by_its_time_constant() -> None:
    step = 5e-4
    time = step * np.arange(2000)
    position = (0.02 * time)[None, :]
    command = np.where(time >= 0.5, 1.0, 0.0)[None, :]
    rig = force_tracking.Rig(coercive=0.0)
    force = force_tracking.plant(position, command, step, rig)[0] - rig.stiffness * position[0]
    field = -np.expm1(-1.0)
    rise = force_tracking.yield_force(np.array(field)) - force_tracking.yield_force(np.array(0.0))
    risen = force[round((0.5 + rig.lag) / step)] - force[round(0.49 / step)]
    assert risen == pytest.approx(float(rise), rel=0.15)


def test_the_field_of_the_tracking_rig_remembers_the_current_by_its_play() -> None:
    rig = force_tracking.Rig(lag=0.0)
    command = np.array([[0.0, 0.5, 1.0, 0.6, 0.0, 0.4]])
    # it is the current while that rises for the first time, and twice the half-width above it on the way down
    assert rig.field(command, 1e-3)[0] == pytest.approx([0.0, 0.5, 1.0, 0.66, 0.06, 0.4])


def test_the_oil_of_the_heated_rig_thins_most_in_the_cold() -> None:
    factor = hammerstein_wiener.alpha(np.array([-5.0, 25.0, 75.0]))
    assert factor[1] == 1.0
    assert 1.0 - factor[2] / factor[0] > 0.57
    assert factor[0] - factor[1] > factor[1] - factor[2]


def test_a_force_behind_the_oil_column_keeps_its_level() -> None:
    held = np.full(4000, 700.0)
    assert hammerstein_wiener.column(held) == pytest.approx(held, rel=1e-9)
    stepped = np.where(np.arange(8000) < 100, 0.0, 700.0)
    assert hammerstein_wiener.column(stepped)[-1] == pytest.approx(700.0, rel=1e-3)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    logs = []
    for name in ("a", "b"):
        folder = tmp_path / name
        folder.mkdir()
        hammerstein_wiener.make(folder, 7)
        logs.append({p.name: p.read_bytes() for p in sorted(folder.iterdir())})
    assert logs[0] == logs[1]
    assert len(logs[0]) == 20
