"""Steps of a command that rest before and after, and the time of an answer to 95 % as it is recorded."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.measure.command_lag import COMMAND_STEP, LAG_SAMPLES, _steps, _to_95, command_lag

DT, TAU = 1e-3, 0.02


def first_order(samples: int, tau: float = TAU, start: float = 0.0, end: float = 1.0) -> Array:
    return start + (end - start) * -np.expm1(-np.arange(samples) * DT / tau)


@pytest.mark.parametrize(("start", "end"), [(0.0, 1.0), (1.0, 0.0), (-3.0, 5.0)])
def test_a_first_order_answer_takes_three_time_constants_to_95_percent(start: float, end: float) -> None:
    time = _to_95(first_order(400, start=start, end=end), start, DT)
    assert time == pytest.approx(TAU * np.log(20.0), abs=0.02 * DT)


def test_the_last_time_below_95_percent_counts() -> None:
    share = np.concatenate([np.linspace(0.0, 1.0, 11), np.full(20, 0.9), np.ones(200)])
    # from 0.9 at the thirtieth sample to 1 at the next one
    assert _to_95(share, 0.0, DT) == pytest.approx(30.5 * DT)


@pytest.mark.parametrize(
    "actual",
    [
        np.zeros(100),
        # still on its way at the end, and at its end from the beginning
        np.linspace(0.0, 1.0, 100),
        np.full(100, 0.5),
    ],
    ids=["no way", "not at rest", "there already"],
)
def test_what_makes_no_way_or_does_not_come_to_rest_has_no_time(actual: Array) -> None:
    start = 0.0 if actual[0] == 0.0 else 0.51
    assert _to_95(actual if actual[0] == 0.0 else np.where(np.arange(100) > 0, 0.5, 0.5), start, DT) is None


def commanded(*levels: float, samples: int = 400) -> tuple[Array, Array]:
    command = np.repeat(levels, samples)
    actual, state = np.empty(len(command)), levels[0]
    for k, wanted in enumerate(command):
        actual[k] = state
        state += (wanted - state) * -np.expm1(-DT / TAU)
    return command, actual


def test_every_step_between_rests_is_timed() -> None:
    found = _steps(*commanded(0.0, 1.0, 0.2, 0.7), DT)
    # the command is held until the next sample
    assert found == pytest.approx([TAU * np.log(20.0) + DT] * 3, abs=0.2 * DT)


@pytest.mark.parametrize(("share", "steps"), [(0.8 * COMMAND_STEP, 1), (1.5 * COMMAND_STEP, 2)])
def test_a_change_of_a_fiftieth_of_the_range_is_a_step(share: float, steps: int) -> None:
    assert len(_steps(*commanded(0.0, 1.0, 1.0 - share), DT)) == steps


@pytest.mark.parametrize(("held", "rest", "steps"), [(4, 400, 1), (3, 400, 0), (400, 7, 0)])
def test_a_step_takes_a_rest_before_and_a_longer_one_after_it(held: int, rest: int, steps: int) -> None:
    command, actual = np.repeat([0.0, 1.0], [held, rest]), np.repeat([0.0, 0.6, 1.0], [held, 2, rest - 2])
    assert len(_steps(command, actual, DT)) == steps


def test_a_command_that_moves_on_after_its_step_does_not_rest() -> None:
    command, actual = commanded(0.0, 1.0)
    moving = command + np.where(command > 0.5, 1e-3 * np.arange(len(command)), 0.0)
    assert _steps(moving, actual, DT) == []


def test_of_a_long_record_the_beginning_is_looked_at() -> None:
    rng = np.random.default_rng(1)
    command = np.repeat(rng.uniform(0.0, 1.0, 300), 200)
    spoilt = command.copy()
    spoilt[LAG_SAMPLES:] = rng.standard_normal(len(command) - LAG_SAMPLES)
    assert len(command) > LAG_SAMPLES
    found = command_lag("a", command, np.roll(spoilt, 10), DT)
    assert found.lag == pytest.approx(0.010, abs=2e-4) and found.error < 0.05
