"""Logs that are written oddly are read right or refused; what cannot be known of a log is never believed in silence."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.ingest import odd_logs
from tests.ingest.odd_habits import HABITS
from tests.ingest.odd_logs import KINDS, LEFT, RIGHT, SAID, WRONG, OddLog, outcome, read

EACH = 12


def _judge(log: OddLog, folder: Path) -> tuple[str, str]:
    return outcome(log, *read(log, folder))


@pytest.mark.parametrize("kind", KINDS)
def test_an_odd_log_is_right_or_left(kind: str, tmp_path: Path) -> None:
    log = odd_logs.made(kind, 1)
    found, why = _judge(log, tmp_path)
    assert found in ((RIGHT, LEFT, SAID) if log.unclear else (RIGHT,)), why


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_many_odd_logs_are_right_or_left(kind: str, tmp_path: Path) -> None:
    for number in range(100, 100 + EACH):
        log = odd_logs.made(kind, number)
        found, why = _judge(log, tmp_path)
        assert found in ((RIGHT, LEFT, SAID) if log.unclear else (RIGHT,)), f"{number}: {why}"


LEFT_HABITS = ("units_behind_numbers", "numbers_of_instruments")
"""Habits that can be known and may be refused: a unit in each cell, and a mark that no instrument is known by."""


def _right_or_left(kind: str, number: int, folder: Path) -> None:
    log = odd_logs.made(kind, number, HABITS)
    found, why = _judge(log, folder)
    allowed = (RIGHT, LEFT, SAID) if log.unclear else (RIGHT, LEFT) if kind in LEFT_HABITS else (RIGHT,)
    assert found in allowed, f"{number}: {why}"


@pytest.mark.parametrize("kind", HABITS)
def test_a_habit_of_an_instrument_is_right_or_left(kind: str, tmp_path: Path) -> None:
    _right_or_left(kind, 1, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", HABITS)
def test_many_habits_of_instruments_are_right_or_left(kind: str, tmp_path: Path) -> None:
    for number in range(100, 100 + EACH):
        _right_or_left(kind, number, tmp_path)


def test_the_judge_sees_what_is_wrong(tmp_path: Path) -> None:
    log = odd_logs.made("spelt_numbers", 1)
    (record,), _ = read(log, tmp_path)
    assert outcome(log, [record], []) == (RIGHT, "")
    force = record.channels["force"]
    for wrong in (
        replace(record, channels={**record.channels, "force": 1.01 * force}),
        replace(record, channels={**record.channels, "force": np.roll(force, 1)}),
        replace(record, dt=1.01 * record.dt),
        replace(record, rows_kept=record.rows_kept - 1),
    ):
        assert outcome(log, [replace(wrong, findings=())], [])[0] == WRONG
    assert outcome(log, [], [])[0] == LEFT
    assert outcome(replace(log, lacks=("force",)), [record], [])[0] in (WRONG, SAID)
