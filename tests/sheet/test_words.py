"""Numbers of a sheet in words: units with prefixes, intervals, limits, changes, and notes told once."""

from typing import Any

import pytest

from mrfit.errors import ConfigError
from mrfit.io.schemas.sheet import ChangeRow, QuantityRow, SheetCondition, VerdictRow
from mrfit.sheet.measured import unit_of
from mrfit.sheet.words import change_text, limits_text, notes_of, number_text, numbers_of, over_cycles, scaled


def row(name: str = "F0+", unit: str = "N", **given: Any) -> QuantityRow:
    return QuantityRow(name=name, unit=unit, **{"value": 1234.0, "low": 1200.0, "high": 1268.0, **given})


def verdict(**given: Any) -> VerdictRow:
    about = {"level": "unit", "unit": "u", "condition": "c", "quantity": "F0+", "si_unit": "N", "verdict": "pass"}
    return VerdictRow(**{**about, "value": 1234.0, "low": 1200.0, "high": 1268.0, **given})


def condition(name: str, *findings: str) -> SheetCondition:
    numbers = dict.fromkeys(("frequency", "stroke", "peak_velocity", "samples_per_cycle", "noise"), 1.0)
    about = {"unit": "u", "condition": name, "recording": "r", "source": "s", "waveform": "sine", "cycles": 3}
    return SheetCondition(**about, **numbers, current=None, temperature=None, quantities=[], findings=[*findings])


def test_a_value_with_its_interval_in_a_unit_with_a_prefix() -> None:
    assert numbers_of(row()) == ("1.234", "1.200 to 1.268", "kN", "")
    assert numbers_of(row(value=0.5, low=0.4, high=0.6))[2] == "N"


def test_a_size_is_never_below_zero_and_a_force_may_be() -> None:
    below = {"value": -0.0046, "low": -0.0114, "high": 0.0023}
    assert numbers_of(row("ripple", "", **below))[:3] == ("0", "0 to 0.230", "%")
    assert numbers_of(row("ripple", "", value=0.02, low=0.019, high=0.021))[:2] == ("2.00", "1.90 to 2.10")
    assert numbers_of(row("F0-", "N", value=-100.0, low=-101.0, high=-99.0))[1] == "−101.0 to −99.0"
    assert number_text(verdict(quantity="ripple", si_unit="", **below)) == "0 % (0 to 0.230)"


def test_what_has_no_value_says_why() -> None:
    assert numbers_of(row(value=None, low=None, high=None, reason="one cycle")) == ("–", "–", "", "one cycle")


def test_an_open_interval_is_a_dash() -> None:
    assert numbers_of(row(low=None, high=None))[1] == "–"


@pytest.mark.parametrize(("name", "shown"), [("closure", "%"), ("ratio", ""), ("fade+", "%")])
def test_shares_are_in_percent_and_ratios_are_not(name: str, shown: str) -> None:
    assert scaled(name, "1", row(name, "1", value=0.5, low=0.4, high=0.6)) == (100.0 if shown else 1.0, shown)


def test_no_prefix_stands_before_a_compound_unit() -> None:
    assert scaled("C_eq", "N*s/m", row("C_eq", "N*s/m")) == (1.0, "N·s/m")
    assert scaled("K_eff", "N/m", row("K_eff", "N/m", value=2e6, low=1e6, high=3e6))[1] == "MN/m"


def test_the_course_over_the_cycles_is_told_where_it_is_more_than_the_interval() -> None:
    assert over_cycles(row(drift=12.34)) == "drifts by 1.00 %"
    assert over_cycles(row()) == ""
    assert over_cycles(row(greatest_deviation=0.05)) == "one cycle up to 5.0 % off"
    assert over_cycles(row(greatest_deviation=0.05, low=0.0, high=2000.0)) == ""
    assert over_cycles(row(drift=12.34, greatest_deviation=0.05)) == "drifts by 1.00 %, one cycle up to 5.0 % off"


def test_the_value_of_a_verdict() -> None:
    assert number_text(verdict()) == "1.234 kN (1.200 to 1.268)"
    assert number_text(verdict(level="cycle")).startswith("off by 1.234 kN")
    assert number_text(verdict(value=None)) == "–"


@pytest.mark.parametrize(
    ("least", "most", "said"),
    [
        (1000.0, 1500.0, "1.000 to 1.500 kN"),
        (1000.0, None, "at least 1.000 kN"),
        (None, 1500.0, "at most 1.500 kN"),
        (None, None, "–"),
    ],
)
def test_limits_in_the_unit_of_the_value(least: float | None, most: float | None, said: str) -> None:
    assert limits_text(verdict(least=least, most=most)) == said


def test_a_change_in_percent_with_its_interval() -> None:
    about = {"unit": "u", "condition": "c", "quantity": "F0+", "value": 1.1, "against": 1.0, "changed": True}
    assert change_text(ChangeRow(**about, change=0.1, low=0.08, high=0.12)) == "10.0 % (8.0 to 12.0)"
    assert change_text(ChangeRow(**about, change=None, low=None, high=None)) == "–"
    assert change_text(ChangeRow(**about, change=0.1, low=None, high=None)) == "10.00 % (–)"


def test_notes_that_differ_in_numbers_alone_are_told_once_and_others_each() -> None:
    rows = [condition("a", "the loop is open by 3 %"), condition("b", "the loop is open by 12.5 %", "stuck")]
    assert notes_of(rows) == ["b: the loop is open by 12.5 % (and 1 more condition alike)", "b: stuck"]
    assert notes_of([condition("a")]) == []


def test_what_a_skew_would_change_is_one_note_whatever_it_changes() -> None:
    text = "a force recorded one sample (1 ms) late or early would change {}"
    (said,) = notes_of([condition("a", text.format("F0+ by 2 %")), condition("b", text.format("F0- by 3 %, E"))])
    assert said.startswith("b: a force recorded") and said.endswith("(and 1 more condition alike)")


@pytest.mark.parametrize(
    ("source", "pattern", "unit"),
    [
        ("logs/a_1.csv", "", "unit"),
        ("logs/u7_5Hz.csv", "{unit}_*.csv", "u7"),
        ("logs/u7/5Hz.csv", "*/{unit}/*.csv", "u7"),
        ("logs/damper-u7_5Hz.csv", "damper-{unit}_*.csv", "u7"),
        ("logs/u7_x_y.csv", "{unit}_*.csv", "u7"),
    ],
)
def test_the_unit_in_the_path_of_a_log(source: str, pattern: str, unit: str) -> None:
    assert unit_of(source, pattern) == unit


@pytest.mark.parametrize("pattern", ["*.csv", "{unit}_{unit}.csv", "{unit}_*.txt", "x{unit}.csv"])
def test_a_pattern_that_names_no_unit_is_refused(pattern: str) -> None:
    with pytest.raises(ConfigError, match="--unit-from"):
        unit_of("logs/u7_5Hz.csv", pattern)
