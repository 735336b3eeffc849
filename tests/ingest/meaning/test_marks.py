"""Marks of missing values are found where they were laid, and nothing is taken for one in sound channels."""

import io
from pathlib import Path

import h5py
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


def test_overflows_side_by_side_beside_marks_are_passed_over_in_silence() -> None:
    assert _missing(_laid(_laid(MOTION, np.inf, [50, 51]), -9999.0, SEVERAL)) == SEVERAL


@pytest.mark.parametrize("mark", [-999.0, 999.0, 999.9])
def test_a_mark_within_the_range_is_seen_where_a_smooth_channel_jumps_to_it(mark: float) -> None:
    values = np.round(2000.0 * SINE, 1)
    rows = [100, 250, 703, 1405, 2907]  # in row 100 the channel is at 1175.6 by itself
    assert _missing(_laid(values, mark, rows)) == rows


@pytest.mark.parametrize("mark", [-1.0, -888.0, -99.99, 327.68, -3276.8])
def test_marks_of_two_and_three_digits_and_of_scaled_converters(mark: float) -> None:
    rows = [50, 51, 52, 703, 1405, 1406, 2907]
    values = np.round(900.0 * SINE, 2)
    assert _missing(_laid(values, mark, rows)) == rows


def test_a_mark_of_one_column_is_one_in_another() -> None:
    force, motion = _laid(90.0 * SINE, -99.99, [307, 308]), _laid(MOTION, -99.99, SEVERAL)
    for columns in ((force, motion), (motion, force)):
        found, _ = without_marks([Column(str(k), None, c, k) for k, c in enumerate(columns)])
        assert sorted(np.count_nonzero(np.isnan(c.values)) for c in found) == [2, len(SEVERAL)]


def test_zeros_in_a_crossing_are_drop_outs_where_others_are() -> None:
    crossing = int(np.argmax(np.diff(np.signbit(MOTION[:400]))))
    rows = sorted([80, 640, *range(crossing - 2, crossing + 2)])
    assert _missing(_laid(MOTION + 0.0003, 0.0, rows)) == rows
    assert _missing(_laid(MOTION + 0.0003, 0.0, rows[1:5])) == []


def test_single_precision_and_several_marks() -> None:
    laid = _laid(_laid(MOTION, -9999.9, SEVERAL), 1e20, [50, 51])
    assert _missing(np.float32(laid).astype(np.float64)) == sorted([*SEVERAL, 50, 51])


@pytest.mark.parametrize("length", [1, 3])
def test_zeros_of_a_sensor_that_drops_out(length: int) -> None:
    rows = [k + j for k in (80, 330, 640, 1850, 2300) for j in range(length)]
    values = MOTION + 0.0003
    assert _missing(_laid(values, 0.0, rows)) == rows
    assert _missing(_laid(WARM, 0.0, rows)) == rows


SHARP = np.round(600.0 * np.tanh(6.0 * np.cos(2 * np.pi * 2 * T)) + 300.0 * np.cos(2 * np.pi * 2 * T) + 5.0 * NOISE, 1)
SCATTERED = sorted(np.random.default_rng(3).choice(3000, 200, replace=False).tolist())
MOVING = {"steep": SHARP, "smooth": MOTION, "off zero": MOTION + 25.0}


@pytest.mark.parametrize("rows", [[100, 703, 1405], SCATTERED[::3], SCATTERED, [*range(80, 120)], [*range(800, 1100)]])
@pytest.mark.parametrize("name", MOVING)
def test_zeros_laid_into_a_moving_channel(name: str, rows: list[int]) -> None:
    values = MOVING[name]
    far = {k for k in rows if abs(values[k]) > 0.3 * np.max(np.abs(values))}
    found = set(_missing(_laid(values, 0.0, rows)))
    own = set(np.flatnonzero(values == 0.0).tolist())
    assert len(found & far) >= 0.95 * len(far) > 0
    assert found <= set(rows) | own


def test_zeros_in_several_channels_at_once_in_hdf5(read_log: ReadLog) -> None:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["time"] = T
        file["force (N)"] = _laid(SHARP, 0.0, [*range(80, 120), 1400, 2201])
        file["displacement (mm)"] = _laid(MOTION + 0.0003, 0.0, [*range(80, 120), 1400, 2201])
    records = read_log(buffer.getvalue(), "run.h5")
    said = [f.text for f in records[0].findings if f.kind == "missing-values"]
    assert len(said) == 2 and all("0 in 42 rows" in text for text in said)
    assert sum(r.rows_refused for r in records) == 42
    for record in records:
        at = round((record.start - T[0]) / 2e-3) + np.arange(record.samples)
        np.testing.assert_allclose(record.channels["displacement"], 1e-3 * (MOTION[at] + 0.0003), atol=1e-5)


SOUND = {
    "a half wave": np.maximum(SHARP, 0.0),
    "a dead band": np.where(np.abs(MOTION) < 3.0, 0.0, MOTION),
    "a current that is switched off and rises again": np.where(
        K % 1500 < 900, 2.0 - 2.0 * np.exp(-(K % 1500) / 90.0), 0.0
    ),
    "levels with noise, off in between": np.where(K // 350 % 3 == 1, 0.0, 1.0 + K // 700 * 0.5 + 0.003 * NOISE),
    "a current chopped one time in ten": np.where(K % 10 == 0, 0.0, 1.5 + 0.2 * SINE),
    "whole numbers through zero": np.round(3.0 * SINE) * 10.0 + np.round(9.0 * SINE),
    "a test with rests": np.where(K // 500 % 2 == 1, 0.0, MOTION),
    "small steps": np.round(0.5 * np.cumsum(NOISE)),
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
    monkeypatch.setattr(series, "SERIES_CHUNK", 700)
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


def test_a_current_switched_to_zero_is_zero_by_itself() -> None:
    for log in sorted((Path(__file__).parents[3] / "datasets" / "damper").glob("*.csv")):
        current = np.loadtxt(log, delimiter=",", skiprows=2, usecols=3)
        assert np.count_nonzero(current == 0.0) > 20 and _missing(current) == []


FAST = np.round(660.0 * np.tanh(200.0 * np.cos(2 * np.pi * 2 * T)) + 2.0 * NOISE, 2)
"""A force that turns within a few samples, so that its ordinary steps are no measure."""


@pytest.mark.parametrize("rows", [[*range(900, 906)], [110, 400, 1300, 2600]])
@pytest.mark.parametrize("mark", [-999.0, 999.9])
def test_marks_near_a_channel_that_hops(mark: float, rows: list[int]) -> None:
    assert _missing(_laid(FAST, mark, rows)) == rows


def test_a_pulse_and_a_peak_that_is_cut_are_no_marks() -> None:
    cut = np.minimum(1100.0 * SINE + NOISE, 999.0)
    assert _missing(cut) == []
    assert _missing(_laid(0.01 * FAST, 9.99, [*range(900, 906)])) == []


@pytest.mark.parametrize(("rows", "found"), [([*range(900, 906)], True), ([700, 1900], True), ([700], False)])
def test_any_number_far_from_all_others_that_stands_again(rows: list[int], found: bool) -> None:
    for unit in ("N", "A"):  # a current may be a pulse
        (column,), _ = without_marks([Column("a", unit, _laid(FAST, -200321.5, rows), 0)])
        assert [*np.flatnonzero(np.isnan(column.values))] == (rows if found and unit == "N" else [])


def test_a_number_of_ten_ranges_is_kept() -> None:
    _, said = without_marks([Column("a", "mm", _laid(MOTION, 123.25, [*range(900, 906)]), 0)])
    assert said == []


def test_of_marks_that_are_nearly_one_the_nearest_is_said() -> None:
    _, (said,) = without_marks([Column("a", None, _laid(FAST, 1e6, SEVERAL), 0)])
    assert said.text.startswith("'a': 1000000 in 4 rows stands")
