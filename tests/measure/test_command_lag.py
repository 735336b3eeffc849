"""Lag behind a command and response time against systems whose answer is known in closed form."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete, lfilter

from mrfit.errors import DataError
from mrfit.measure.command_lag import command_lag
from tests.conftest import Run

DT = 1e-3


def answer(time: np.ndarray, command: np.ndarray, dead: float, tau: float) -> np.ndarray:
    """The command behind dead time and lag, by SciPy on a grid ten times as fine, held between samples."""
    fine = np.arange(10 * (len(time) - 1) + 1) * DT / 10
    moved = np.interp(fine - dead, time, command)
    if tau == 0.0:
        return moved[::10]
    above, below, _ = cont2discrete(([1.0], [tau, 1.0]), DT / 10, "foh")
    return lfilter(above[0], below, moved - moved[0])[::10] + moved[0]


def switched(seed: int, samples: int = 6000) -> np.ndarray:
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.uniform(0.0, 1.0, 60), rng.integers(200, 700, 60))
    return levels[:samples]


@settings(deadline=None, max_examples=3)
@given(st.floats(0.0, 0.03), st.floats(0.008, 0.06), st.integers(0, 99))
def test_dead_time_and_lag_of_a_switched_command_are_found(dead: float, tau: float, seed: int) -> None:
    time, command = np.arange(6000) * DT, switched(seed)
    actual = 1.7 * answer(time, command, dead, tau) + 0.3 + 0.005 * np.random.default_rng(seed).standard_normal(6000)
    found = command_lag("a", command, actual, DT)
    assert found.dead_time is not None and found.time_constant is not None and found.response_time is not None
    assert found.dead_time == pytest.approx(dead, abs=1e-3)
    assert found.time_constant == pytest.approx(tau, rel=0.05)
    assert found.response_time == pytest.approx(dead + 3.0 * tau, rel=0.05, abs=1e-3)
    assert found.gain == pytest.approx(1.7, rel=0.01)


def test_the_response_time_of_steps_is_read_off_the_record() -> None:
    time, command = np.arange(6000) * DT, switched(3)
    actual = answer(time, command, 0.010, 0.020)
    found = command_lag("a", command, actual, DT)
    assert found.steps > 5
    assert found.measured_response == pytest.approx(0.010 + 0.020 * np.log(20.0), abs=2e-3)


@pytest.mark.parametrize("dead_and_tau", [(0.010, 0.0), (0.0, 0.010), (0.004, 0.006)])
def test_a_sine_tells_the_lag_and_not_what_makes_it(dead_and_tau: tuple[float, float]) -> None:
    time = np.arange(4000) * DT
    command = 0.01 * np.sin(2.0 * np.pi * time)
    settled = answer(time, command, *dead_and_tau)[1000:]
    found = command_lag("a", command[1000:], settled, DT)
    assert found.lag == pytest.approx(0.010, abs=2e-4)
    assert (found.dead_time, found.time_constant, found.response_time, found.steps) == (None, None, None, 0)


def test_what_is_not_late_is_told_so() -> None:
    command = switched(5)
    found = command_lag("a", command, 2.0 * command, DT)
    assert found.lag == pytest.approx(0.0, abs=1e-6) and found.error < 1e-6


@pytest.mark.parametrize("still", ["command", "actual quantity"])
def test_a_channel_at_rest_is_refused(still: str) -> None:
    pair = (np.ones(6000), switched(1)) if still == "command" else (switched(1), np.ones(6000))
    with pytest.raises(DataError, match=f"the {still} does not move"):
        command_lag("a", *pair, DT)


def test_a_channel_that_does_not_follow_is_refused() -> None:
    noise = np.random.default_rng(0).standard_normal(6000)
    with pytest.raises(DataError, match="does not follow"):
        command_lag("a", switched(2), noise, DT)


def test_the_command_line_prints_it(tmp_path: object, mrfit: Run) -> None:
    time, command = np.arange(3000) * DT, switched(4, 3000)
    table = np.stack([time, answer(time, command, 0.0, 0.02), command], axis=1)
    log = f"{tmp_path}/steps.csv"
    np.savetxt(log, table, "%.8g", ",", header="time (s),current (A),wanted (A)", comments="")
    with open(f"{tmp_path}/mrfit.toml", "w") as file:
        file.write('[channels]\ncurrent_command = {column = "wanted", unit = "A"}\n')
    run = mrfit("measure", "lag", log, "--command", "current_command", "--actual", "current", "--json")
    [row] = json.loads(run.stdout)
    assert row["time_constant"] == pytest.approx(0.02, rel=0.02) and row["lag"] == pytest.approx(0.02, rel=0.03)
