"""Frames and arrays that are not as plain as they look: read as they mean, or one error that says what to give."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

import mrfit
from mrfit.errors import ConfigError, DataError

K = np.arange(400)
TIME = 2e-3 * K
FORCE = np.round(800.0 * np.cos(0.05 * K), 1)
LOST = [100, 101, 250]


def _frame(index: Any = None, **columns: Any) -> pd.DataFrame:
    return pd.DataFrame(columns or {"force": FORCE}, index=index)


@pytest.mark.parametrize(
    "force",
    [
        np.ma.masked_array(FORCE, mask=np.isin(K, LOST)),
        np.ma.masked_array(FORCE.astype(int), mask=np.isin(K, LOST), fill_value=-999),
        pd.Series(np.where(np.isin(K, LOST), np.nan, FORCE)).astype("Float64"),
        pd.Series(FORCE.astype(int)).astype("Int64").mask(np.isin(K, LOST)),
        [None if k in LOST else f for k, f in zip(K, FORCE, strict=True)],
    ],
)
def test_what_is_masked_or_missing_is_no_number(force: Any) -> None:
    log = mrfit.Recording.from_arrays(dt=2e-3, force=force)
    assert (log.rows_kept, log.rows_refused, log.samples) == (397, 3, 400)
    np.testing.assert_allclose(np.delete(log.channels["force"], LOST), np.delete(FORCE, LOST), atol=1.0)
    np.testing.assert_allclose(log.channels["force"], FORCE, atol=5.0)
    if isinstance(force, pd.Series):
        framed = mrfit.Recording.from_frame(_frame(force=force), dt=2e-3)
        np.testing.assert_array_equal(framed.channels["force"], log.channels["force"])


@pytest.mark.parametrize("force", [FORCE + 1j, (FORCE + 0j).astype(object), np.ma.masked_array(FORCE + 2j)])
def test_complex_numbers_are_refused(force: Any) -> None:
    with pytest.raises(DataError, match="'force' holds .*(complex|real)"):
        mrfit.Recording.from_arrays(dt=2e-3, force=force)


@pytest.mark.parametrize("value", ["2", "two amperes", np.nan, np.inf, None, [1.0, 2.0], 1j])
def test_a_condition_is_a_finite_number(value: Any) -> None:
    for make in (
        lambda: mrfit.Recording.from_arrays(dt=2e-3, force=FORCE, condition={"current": value}),
        lambda: mrfit.Recording.from_frame(_frame(), dt=2e-3, condition={"current": value}),
    ):
        with pytest.raises(ConfigError, match="give a number in SI units|condition takes Mapping"):
            make()
    log = mrfit.Recording.from_arrays(dt=2e-3, force=FORCE, condition={"current": np.float32(1.5)})
    assert log.condition["current"] == 1.5


@pytest.mark.parametrize("dt", ["0.002", np.nan, 0.0, -1.0, [0.002, 0.002]])
def test_an_interval_is_a_number_above_zero(dt: Any) -> None:
    said = "give seconds above 0|dt takes (float|a finite number)"
    with pytest.raises(ConfigError, match=said):
        mrfit.Recording.from_arrays(dt=dt, force=FORCE)
    with pytest.raises(ConfigError, match=said):
        mrfit.Recording.from_frame(_frame(), dt=dt)


@pytest.mark.parametrize(
    "index",
    [
        pd.RangeIndex(400),
        pd.RangeIndex(7, 407),
        pd.Index(TIME),
        pd.Index(TIME + 5.0, name="time"),
        pd.to_datetime("2024-03-05") + pd.to_timedelta(TIME, unit="s"),
        (pd.to_datetime("2024-03-05") + pd.to_timedelta(TIME, unit="s")).tz_localize("Europe/Berlin"),
        pd.to_timedelta(TIME, unit="s"),
        pd.Index([f"row {k}" for k in K]),
    ],
)
def test_an_index_that_agrees_or_says_nothing(index: Any) -> None:
    log = mrfit.Recording.from_frame(_frame(index), dt=2e-3)
    assert (log.dt, log.samples) == (pytest.approx(2e-3), 400)
    np.testing.assert_allclose(log.channels["force"], FORCE)


@pytest.mark.parametrize("index", [pd.RangeIndex(400), pd.Index(TIME), pd.to_timedelta(TIME, unit="s")])
def test_rows_that_an_index_leaves_out_are_missing(index: Any) -> None:
    log = mrfit.Recording.from_frame(_frame(index).drop(index[LOST]), dt=2e-3)
    assert log.samples == 400
    np.testing.assert_allclose(log.channels["force"], FORCE, atol=5.0)
    assert "dropped-samples" in {f.kind for f in log.findings}
    with pytest.raises(DataError, match="gaps"):
        mrfit.Recording.from_frame(_frame(index).drop(index[100:150]), dt=2e-3)


@pytest.mark.parametrize("index", [pd.RangeIndex(400), pd.Index(TIME), pd.to_timedelta(TIME, unit="s")])
def test_an_index_out_of_order_is_refused(index: Any) -> None:
    frame = _frame(index)
    for other in (frame.iloc[::-1], pd.concat([frame, frame]), frame.sample(frac=1.0, random_state=0)):
        with pytest.raises(DataError, match="index does not rise at row .*sort_index"):
            mrfit.Recording.from_frame(other, dt=2e-3)
    if not isinstance(index, pd.RangeIndex):
        with pytest.raises(DataError, match="index does not rise"):
            mrfit.Recording.from_frame(frame.rename_axis("time").iloc[::-1])


@pytest.mark.parametrize(
    "index",
    [
        pd.RangeIndex(0, 800, 2),
        pd.Index(5.0 * TIME),
        pd.Index(1e3 * TIME),
        pd.Index(5.0 * TIME, name="time"),
        pd.to_timedelta(5.0 * TIME, unit="s"),
    ],
)
def test_an_index_of_other_steps_asks(index: Any) -> None:
    with pytest.raises(ConfigError, match=r"its index steps by .* and dt is 0.002 s; give .*reset_index"):
        mrfit.Recording.from_frame(_frame(index), dt=2e-3)
    assert mrfit.Recording.from_frame(_frame(index).reset_index(drop=True), dt=2e-3).samples == 400


@pytest.mark.parametrize("frame", [pd.Series(FORCE), {"force": FORCE}, FORCE])
def test_what_is_no_frame_is_named(frame: Any) -> None:
    with pytest.raises(ConfigError, match=r"give a pandas\.DataFrame"):
        mrfit.Recording.from_frame(frame, dt=2e-3)


def test_a_unit_is_a_text() -> None:
    with pytest.raises(ConfigError, match="units takes Mapping.*'force': 5"):
        mrfit.Recording.from_arrays(dt=2e-3, force=FORCE, units={"force": 5})  # type: ignore[dict-item]
