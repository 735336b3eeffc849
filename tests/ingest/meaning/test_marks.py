"""Marks of missing values are found where they were laid, and nothing is taken for one in sound channels."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.meaning.marks import without_marks
from mrfit.ingest.table import Column
from tests.ingest.conftest import ReadLog

K = np.arange(3000)
T = 2e-3 * K
SINE = np.sin(2 * np.pi * 2 * T)
NOISE = np.random.default_rng(0).normal(0.0, 1.0, len(K))
FORCE = np.round(990.0 * np.tanh(20.0 * np.cos(2 * np.pi * 2 * T)) + 2.0 * NOISE, 2)
MOTION = np.round(10.0 * SINE, 4)
WARM = np.round(24.0 + 0.001 * K + 0.05 * NOISE, 2)


def _missing(values: Array) -> list[int]:
    (column,), _ = without_marks([Column("a", None, values, 0)])
    return [int(k) for k in np.flatnonzero(np.isnan(column.values[0 : len(values)]))]


def _laid(values: Array, mark: float, rows: list[int]) -> Array:
    laid = values.copy()
    laid[rows] = mark
    return laid


SINGLE, SEVERAL, RUN = [1500], [100, 703, 1405, 2907], [*range(1000, 1040), 2000]


@pytest.mark.parametrize("rows", [SEVERAL, RUN])
@pytest.mark.parametrize("mark", [-999.0, -9999.0, -99999.0, 999999.0, 1e10, -32768.0, 9999.99, 7999.0])
@pytest.mark.parametrize("values", [MOTION, WARM, 1e-3 * MOTION])
def test_marks_far_from_all_others(values: Array, mark: float, rows: list[int]) -> None:
    assert _missing(_laid(values, mark, rows)) == rows


@pytest.mark.parametrize("mark", [-9999.0, -99999.0, 999999.0, 1e10, -32768.0])
@pytest.mark.parametrize("rows", [SINGLE, SEVERAL, RUN])
def test_marks_of_a_force_in_newtons(mark: float, rows: list[int]) -> None:
    expected = [] if rows == SINGLE and mark in (-9999.0, 1e10) else rows  # it may be a knock, or garbled
    assert _missing(_laid(FORCE, mark, rows)) in (expected, rows)


@pytest.mark.parametrize("mark", [-999.0, 999.0, 999.9])
def test_a_mark_within_the_range_is_seen_where_a_smooth_channel_jumps_to_it(mark: float) -> None:
    values = np.round(2000.0 * SINE, 1)
    rows = [100, 250, 703, 1405, 2907]  # in row 100 the channel is at 1175.6 by itself
    assert _missing(_laid(values, mark, rows)) == rows


def test_single_precision_and_several_marks() -> None:
    laid = _laid(_laid(MOTION, -9999.9, SEVERAL), 1e20, [50, 51])
    assert _missing(np.float32(laid).astype(np.float64)) == sorted([*SEVERAL, 50, 51])


@pytest.mark.parametrize("length", [1, 3])
def test_zeros_of_a_sensor_that_drops_out(length: int) -> None:
    rows = [k + j for k in (80, 330, 640, 1850, 2300) for j in range(length)]
    values = MOTION + 0.0003
    assert _missing(_laid(values, 0.0, rows)) == rows
    assert _missing(_laid(WARM, 0.0, rows)) == rows


SOUND = {
    "a sine through zero": MOTION,
    "a force in whole newtons, which is -999 at times": np.round(FORCE),
    "a slow ramp through -999 and 999": np.round(np.linspace(-1500.0, 1500.0, 3000)),
    "a counter that begins again": (K * 37 % 10000).astype(np.float64),
    "a counter of a converter that begins again": (K * 700 % 65536).astype(np.float64),
    "a converter at its rail": np.clip(np.round(40000.0 * SINE), -32768, 32767),
    "an amplifier at its rail of 10 V": np.clip(12.0 * SINE, -10.0, 10.0),
    "a display that stops at 999": np.clip(np.round(1200.0 * SINE), -999, 999),
    "a coil switched on and off": np.where(SINE > 0, 1.5 + 0.01 * NOISE, 0.0),
    "a chopped current": np.where(K % 5 > 1, 1.5 + 0.2 * SINE, 0.0),
    "pulses of a trigger": np.where(K % 500 == 0, 9999.0, 0.0),
    "codes of a state": np.array([0.0, 1.0, 2.0, 999.0])[K // 200 % 4],
    "a limit": np.full(3000, 99999.0),
    "a velocity of counted steps": np.round(3.0 * np.gradient(np.round(300.0 * SINE))),
    "white noise in whole numbers": np.round(400.0 * NOISE),
    "knocks on an anvil": np.where(K % 700 == 3, 950.0 + NOISE, 0.5 * NOISE),
    "a force that hops over zero": np.where(np.abs(FORCE) < 900.0, 0.0, FORCE),
}


@pytest.mark.parametrize("name", SOUND)
def test_nothing_is_taken_out_of_sound_channels(name: str) -> None:
    assert _missing(SOUND[name]) == []


def test_a_long_log_loses_the_same_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    laid = _laid(MOTION + 0.0003, -9999.0, [699, 700, 701, 2100])
    laid[[80, 330, 1399, 1400]] = 0.0
    whole = _missing(laid)
    assert whole == [80, 330, 699, 700, 701, 1399, 1400, 2100]
    monkeypatch.setattr(series, "CHUNK", 700)
    on_disk = series.mapped(lambda v: v, series.Series(len(laid), lambda a, b: laid[a:b]))  # type: ignore[arg-type]
    assert _missing(on_disk) == whole


def test_a_column_of_which_most_is_missing_costs_itself() -> None:
    columns = [Column("a", None, np.where(K % 3 == 0, MOTION, -999.0), 0), Column("b", None, FORCE, 1)]
    kept, findings = without_marks(columns)
    assert [c.name for c in kept] == ["b"]
    assert [f.kind for f in findings] == ["not-read"]


def test_the_log_says_how_many(read_log: ReadLog) -> None:
    laid = _laid(FORCE, -99999.0, SEVERAL)
    rows = "".join(f"{t:.3f},{x:.4f},{f:.2f}\n" for t, x, f in zip(T, MOTION, laid, strict=True))
    (record,) = read_log(f"Time (s),Disp (mm),Load (kN)\n{rows}")
    (said,) = [f.text for f in record.findings if f.kind == "missing-values"]
    assert "'Load': -99999 in 4 rows" in said
    assert record.rows_refused == 4 and record.samples == 3000
    np.testing.assert_allclose(np.delete(record.channels["force"], SEVERAL), 1e3 * np.delete(FORCE, SEVERAL))
