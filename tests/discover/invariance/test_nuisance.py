"""The nuisance keeps the invariances of every law: it is odd, blind to place and time, and forgets."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.core.specs import Array
from mrfit.discover.invariance.nuisance import NUISANCE_LEVELS, columns, motion_of, scales_of
from mrfit.discover.invariance.records import Record
from mrfit.discover.selection.law_rules import FULL
from tests.discover.invariance.specimens import records


def nuisance(record: Record, horizon: float = 1.0) -> Array:
    scales = scales_of(records(), horizon)
    base = np.empty((len(record.speed), 0))
    return columns(motion_of(record, base, scales), record.control, record.dt, scales).values


def moved(record: Record, **channels: Array) -> Record:
    return replace(record, channels={**record.channels, **channels})


@pytest.mark.parametrize("at", [0, 2, 7])
def test_every_column_but_the_constant_reverses_with_the_motion(at: int) -> None:
    record = records()[at]
    backwards = moved(record, **{n: -record.channels[n] for n in record.motion})
    here, there = nuisance(record), nuisance(backwards)
    np.testing.assert_allclose(there[:, 1:], -here[:, 1:], atol=1e-12)
    np.testing.assert_array_equal(there[:, 0], 1.0)


@settings(max_examples=10, deadline=None)
@given(st.floats(-0.5, 0.5), st.floats(-100.0, 100.0), st.floats(-50.0, 50.0))
def test_no_column_knows_where_when_and_how_warm_it_is(place: float, time: float, warmth: float) -> None:
    record = records()[2]
    elsewhere = moved(
        record,
        displacement=record.place + place,
        time=record.channels["time"] + time,
        temperature=record.channels["temperature"] + warmth,
    )
    np.testing.assert_allclose(nuisance(elsewhere), nuisance(record), atol=1e-9)


def test_what_was_long_ago_is_forgotten() -> None:
    record = records()[0]
    first = np.arange(len(record.speed)) < 200
    other = moved(record, velocity=np.where(first, 3.0 * record.speed, record.speed))
    # the place follows the last turn, so it is left as it is
    np.testing.assert_allclose(nuisance(other)[-200:], nuisance(record)[-200:], atol=1e-6)


def test_a_unit_of_length_changes_nothing() -> None:
    here = records()
    there = [moved(r, **{n: 1e3 * r.channels[n] for n in r.motion}) for r in here]
    found = []
    for rows in (here, there):
        scales, base = scales_of(rows), np.empty((len(rows[0].speed), 0))
        found.append(columns(motion_of(rows[2], base, scales), rows[2].control, rows[2].dt, scales).values)
    np.testing.assert_allclose(found[1], found[0], atol=1e-9)


def test_the_ends_of_the_levels_grow_and_a_further_horizon_adds_columns() -> None:
    record, scales = records()[0], scales_of(records())
    made = columns(motion_of(record, np.empty((len(record.speed), 0)), scales), record.control, record.dt, scales)
    assert len(made.ends) == len(NUISANCE_LEVELS)
    assert list(made.ends) == sorted(set(made.ends))
    assert made.ends[FULL] == made.values.shape[1]
    assert nuisance(record, 2.0).shape[1] > made.values.shape[1]


@pytest.mark.parametrize(("levels", "order"), [((0.0,), 0), ((0.0, 1.0), 1), ((0.0, 0.4, 1.0), 2)])
def test_powers_of_the_current_are_no_more_than_its_levels_tell(levels: tuple[float, ...], order: int) -> None:
    rows = [moved(records()[0], current=np.full(len(records()[0].speed), i)) for i in levels]
    assert scales_of(rows).order == order
