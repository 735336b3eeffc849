"""A channel that was sampled in every n-th row costs no rows of the others."""

import json

import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog

K = np.arange(2000)
TIME, FORCE, WARM = 0.005 * K, 800.0 * np.sin(0.05 * K), 25.0 + 3.0 * np.sin(0.002 * K)


def text(other: str, values: np.ndarray, there: np.ndarray) -> str:
    rows = (
        f"{t:.3f},{f:.3f},{f'{v:.4f}' if own else ''}" for t, f, v, own in zip(TIME, FORCE, values, there, strict=True)
    )
    return "\n".join([f"Time (s),Force (N),{other}", *rows, ""])


@pytest.mark.parametrize("every", [2, 7, 20])
@pytest.mark.parametrize("first", [0, 1])
def test_a_slow_channel_is_interpolated(every: int, first: int, read_log: ReadLog) -> None:
    (record,) = read_log(text("Oil temperature (degC)", WARM, K % every == first))
    assert record.rows_kept == 2000 and record.rows_refused == 0
    whole = slice(first, -every)
    np.testing.assert_allclose(record.channels["temperature"][whole], WARM[whole], atol=1e-3)
    assert [f.channel for f in record.findings if f.kind == "slow-channel"] == ["temperature"]


def test_a_switched_current_is_on_straight_lines(read_log: ReadLog) -> None:
    current = np.repeat(np.tile([0.2, 1.8], 10), 100)
    (record,) = read_log(text("Current (A)", current, K % 10 == 0))
    found = record.channels["current"]
    assert 0.2 <= found.min() and found.max() <= 1.8
    assert np.mean(np.abs(found - current) < 1e-9) > 0.9


def test_before_its_first_number_a_slow_channel_is_held(read_log: ReadLog) -> None:
    (record,) = read_log(text("Oil temperature (degC)", WARM, K % 10 == 9))
    np.testing.assert_array_equal(record.channels["temperature"][:9], np.full(9, record.channels["temperature"][9]))


@pytest.mark.parametrize("every", [2, 10])
def test_a_motion_between_whose_numbers_much_may_happen_is_no_slow_channel(every: int, read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="empty value"):
        read_log(text("Stroke (mm)", np.sin(0.5 * K), K % (2 * every) == 0))


def test_a_channel_that_is_mostly_missing_is_left_out_and_said(read_log: ReadLog) -> None:
    there = np.random.default_rng(2).random(2000) < 0.3
    (record,) = read_log(text("Oil temperature (degC)", WARM, there))
    assert list(record.channels) == ["force"] and record.rows_kept == 2000
    assert "rows only: left out" in " ".join(f.text for f in record.findings)


def test_rows_of_a_channel_that_is_mostly_there_are_refused_as_before(read_log: ReadLog) -> None:
    there = K % 100 != 50
    (record, *_) = read_log(text("Oil temperature (degC)", WARM, there))
    assert "slow-channel" not in {f.kind for f in record.findings} and "temperature" in record.channels


def test_nulls_between_the_numbers_of_json_are_a_slow_channel(read_log: ReadLog) -> None:
    warm = [float(w) if k % 20 == 0 else None for k, w in zip(K, WARM, strict=True)]
    content = {
        "dt": 0.005,
        "units": {"force": "N", "temperature": "degC"},
        "force": FORCE.tolist(),
        "temperature": warm,
    }
    (record,) = read_log(json.dumps(content), "run.json")
    np.testing.assert_allclose(record.channels["temperature"][:-20], WARM[:-20], atol=1e-3)
