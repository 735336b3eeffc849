"""The unit of times is the map's, the file's, or what the numbers show; each guess is said."""

from typing import Any

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.ingest.meaning.channel_map import Rules, TimeRule
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column
from mrfit.ingest.time.epoch import counted_since, in_seconds

NEW_YEAR = 1735689600.0


def read(
    values: Any, unit: str | None = None, name: str = "time", rule: TimeRule | None = None
) -> tuple[Array, float, str]:
    column = Column(name, unit, np.asarray(values, dtype=np.float64), 0)
    seconds, scale, said = in_seconds(column, Rules(time=rule), "log.csv")
    return np.asarray(seconds[:]), scale, " ".join(f.text for f in said)


@pytest.mark.parametrize(
    ("stated", "step", "expected"), [(2e-3, 2.0, 2e-3), (2e-3, 2000.0, 2e-3), (2e-3, 3.0, 3.0), (None, 2.0, 2.0)]
)
def test_a_unit_that_is_not_written_is_told_by_the_interval_of_the_header(
    stated: float | None, step: float, expected: float
) -> None:
    seconds, _, (said,) = in_seconds(Column("time", None, step * np.arange(4.0), 0), Rules(), "log.csv", stated)
    assert seconds[1] == pytest.approx(expected)
    assert ("interval that the header states" in said.text) == (expected != step)


@pytest.mark.parametrize(("unit", "scale"), [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("min", 60.0), ("h", 3600.0)])
def test_a_unit_of_the_file_is_taken_at_its_word(unit: str, scale: float) -> None:
    seconds, found, said = read([0.0, 1.0, 2.0], unit)
    assert seconds == pytest.approx(scale * np.arange(3.0)) and found == pytest.approx(scale) and not said


def test_the_map_comes_before_the_file_where_it_names_the_column() -> None:
    for named in ("Time", 0, "0"):
        seconds, scale, said = read([0.0, 1.0], "s", rule=TimeRule(column=named, unit="ms"))
        assert seconds.tolist() == [0.0, 1e-3] and scale == 1e-3 and not said
    assert read([0.0, 1.0], "s", rule=TimeRule(column="other", unit="ms"))[1] == 1.0


@pytest.mark.parametrize("unit", ["N", "furlong"])
def test_a_map_with_another_unit_is_refused(unit: str) -> None:
    with pytest.raises(Refusal, match=f"time column 'time' is in '{unit}'"):
        read([0.0, 1.0], rule=TimeRule(column="time", unit=unit))
    with pytest.raises(Refusal, match="time column 'time' is in 'N'"):
        read([0.0, 1.0], "N")


def test_what_has_no_unit_is_taken_as_seconds_and_this_is_said_unless_its_name_says_so() -> None:
    assert "the file gives 'time' no unit: taken as s" in read([0.0, 0.1])[2]
    assert "the unit of 'time_ms_or' cannot be told: taken as s" in read([0.0, 0.1], name="time_ms_or")[2]
    assert "in the unknown unit 'tick': taken as s" in read([0.0, 0.1], "tick")[2]
    assert read([0.0, 0.1], name="Seconds")[2] == ""
    assert read([0.0, 0.1], rule=TimeRule(column="time"))[2] == ""


@pytest.mark.parametrize(("per_second", "unit"), [(1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_counts_since_1970_are_told_by_their_size(per_second: float, unit: str) -> None:
    seconds, scale, said = read(per_second * (NEW_YEAR + np.arange(3.0)))
    assert seconds == pytest.approx(np.arange(3.0), abs=1e-3) and scale == pytest.approx(1.0 / per_second)
    assert f"taken as {unit} since 1970, and given from its first value" in said
    assert counted_since(per_second * NEW_YEAR)[0] == (unit or "")


@pytest.mark.parametrize("first", [0.0, 1.0, NEW_YEAR, 4.2e9 * 1e9])
def test_other_numbers_are_no_counts_since_1970(first: float) -> None:
    assert counted_since(first) == ("", "")


def test_seconds_since_1970_keep_their_last_digits() -> None:
    seconds, _, _ = read(NEW_YEAR + 1e-4 * np.arange(5.0), "s")
    assert seconds[0] == NEW_YEAR
    since, _, _ = read(1e3 * NEW_YEAR + np.arange(5.0), "ms")
    assert since.tolist() == pytest.approx((1e-3 * np.arange(5.0)).tolist(), abs=1e-12)


@pytest.mark.parametrize(("first", "program"), [(45000.0, "spreadsheets"), (738000.0, "MATLAB")])
def test_days_are_told_by_their_size_and_their_odd_steps(first: float, program: str) -> None:
    step = 0.001 / 86400.0 * (1.0 + 1e-3)
    seconds, scale, said = read(first + step * np.arange(200.0))
    assert scale == 86400.0 and f"taken as d (as {program} count" in said and seconds[0] == 0.0
    assert np.diff(seconds) == pytest.approx(86400.0 * step, rel=1e-2)


@pytest.mark.parametrize("step", [1e-5, 0.1])
def test_seconds_that_happen_to_be_of_that_size_stay_seconds(step: float) -> None:
    _, scale, said = read(45000.0 + step * np.arange(200.0))
    assert scale == 1.0 and "taken as s" in said


def test_times_thousands_of_years_away_are_refused() -> None:
    with pytest.raises(Refusal, match="its times in 's' begin .* years from 1970"):
        read(1e12 + np.arange(3.0), "s")
    with pytest.raises(Refusal, match="years from 1970"):
        read(-1e12 + np.arange(3.0), "s")


def test_a_column_without_any_number_is_in_seconds() -> None:
    assert read([np.nan, np.nan])[1] == 1.0
