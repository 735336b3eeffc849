"""Rows that a late buffer repeats, told from coarse channels, from a machine that stands, and from chance."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mrfit.ingest import series
from mrfit.ingest.time.late_rows import late_rows
from tests.ingest.conftest import ReadLog

ROWS = 4000
Channels = list[np.ndarray]


def moving(seed: int, fine: float = 1e-3, coarse: float = 1e-3) -> Channels:
    """A stroke and a force with noise, each in steps of its converter, and a current that is held."""
    rng = np.random.default_rng(seed)
    stroke = np.sin(2 * np.pi * np.arange(ROWS) / 500) + rng.normal(0.0, 0.002, ROWS)
    force = 3.0 * np.tanh(5 * stroke) + rng.normal(0.0, 0.05, ROWS)
    return [np.round(stroke / coarse) * coarse, np.round(force / fine) * fine, np.full(ROWS, 0.5)]


def repeated(channels: Channels, rows: np.ndarray) -> Channels:
    """The same channels where some rows, which ascend, hold what the row before holds."""
    made = [c.copy() for c in channels]
    for row in rows:
        for channel in made:
            channel[row] = channel[row - 1]
    return made


# of 100 000 rows noise hides one, beside another late row: the same examples in every run
@settings(max_examples=30, deadline=None, derandomize=True)
@example(seed=734, number=30)
@given(seed=st.integers(0, 10**6), number=st.integers(8, 40))
def test_repeated_rows_are_found_and_hardly_another(seed: int, number: int) -> None:
    going_on = np.arange(10, ROWS - 10)
    going_on = going_on[np.abs(np.cos(2 * np.pi * going_on / 500)) > 0.3]
    rows = np.sort(np.random.default_rng(seed).choice(going_on, number, replace=False))
    channels = moving(seed)
    found = late_rows(repeated(channels, rows))
    by_chance = set(late_rows(channels).tolist()) | set(found.tolist()) - set(rows.tolist())
    assert set(rows.tolist()) <= set(found.tolist()) and len(by_chance) <= 5


def test_what_agrees_by_chance_or_because_all_stand_still_is_no_late_row() -> None:
    rows = np.arange(100, ROWS, 300)
    assert late_rows(repeated(moving(1), rows)).tolist() == rows.tolist()
    # coarse channels agree again and again
    assert not len(late_rows(repeated(moving(1, fine=0.5, coarse=0.5), rows)))
    # a few rows that agree are what chance makes of a coarse channel beside a fine one
    assert not len(late_rows(repeated(moving(1, coarse=0.1), rows[:4])))
    # one channel alone, and one beside another that never moves, agree by chance
    force = repeated(moving(1), rows)[1]
    assert not len(late_rows([force])) and not len(late_rows([force, np.zeros(ROWS)]))
    # a logger that hangs is no late row: what would stand there is not known
    assert late_rows(repeated(moving(1), np.r_[rows, 3905:3920])).tolist() == rows.tolist()
    # a machine at rest: only the force moves, by its noise, in two columns
    stroke, resting, _ = moving(1, fine=0.02)
    stroke[:400] = 0.0
    assert not len(late_rows([stroke, resting, resting]))
    # a voltage and a current that turn together are alike on both sides of their peaks
    turn = np.cos(2 * np.pi * (np.arange(ROWS) - 0.5) / 250)
    assert not len(late_rows([np.round(turn, 4), np.round(0.3 * turn, 5)]))
    # before a test all may stand: it has late rows all the same
    still = np.r_[np.zeros(2000), 1.0 + np.arange(ROWS)]
    before = [np.r_[np.zeros(2000), channel] for channel in repeated(moving(1), rows)]
    assert late_rows(before).tolist() == [*(2000 + rows)] and not len(late_rows([np.zeros(ROWS + 2000), still]))
    assert not len(late_rows(moving(1)[:2])) and not len(late_rows([np.zeros(3), np.zeros(3)]))
    # of a short log it cannot be told
    few = np.array([0.0, 1.0, -1.0, -1.0, 0.0, -2.0])
    assert not len(late_rows([few, 1e-3 * few]))


def test_a_long_log_is_gone_through_in_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = np.array([7, 64, 65, 192, 193, 500, ROWS - 9])
    channels = repeated(moving(2), rows)
    monkeypatch.setattr(series, "SERIES_CHUNK", 64)
    assert late_rows(channels).tolist() == rows.tolist()


def test_a_late_row_is_refused_counted_and_bridged(read_log: ReadLog) -> None:
    rows, channels = np.array([50, 1000, 1001, 3990]), moving(3, 1e-4, 1e-4)
    late = repeated(channels, rows)
    lines = [f"{0.002 * k:.3f},{x:.6f},{f:.6f},{i:.3f}" for k, (x, f, i) in enumerate(zip(*late, strict=True))]
    (record,) = read_log("\n".join(["time (s),displacement (mm),force (N),current (A)", *lines]))
    said = {f.kind: f.text for f in record.findings}
    assert "4 × repeated row (first in line 52)" in said["refused-rows"]
    assert said["dropped-samples"].startswith("4 samples are missing")
    assert (record.rows_kept, record.rows_refused, record.samples) == (ROWS - 4, 4, ROWS)
    between = record.channels["displacement"][1000] * 1e3
    assert between == pytest.approx(channels[0][999] * 2 / 3 + channels[0][1002] / 3, abs=1e-9)
