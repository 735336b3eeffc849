"""Units that stand out and values that have changed, and the tables that say so."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrfit.io.schemas.sheet import FAIL, PASS, UNDECIDED, AcrossRow, QuantityRow, SheetCondition, SheetFile, UnitRow
from mrfit.sheet.compute import FEWEST_UNITS, _changes, _stands_out
from mrfit.sheet.tables import (
    across_table,
    change_table,
    condition_table,
    judged_of,
    main_table,
    summary_of,
    unit_table,
    verdict_table,
)
from mrfit.sheet.words import unmatched_of
from tests.sheet.test_words import verdict

SOUND = [100.0, 101.0, 99.0, 100.5, 99.5, 100.2]


def quantity(name: str = "F0+", value: float | None = 100.0, half: float | None = 0.1, **given: Any) -> QuantityRow:
    ends = (None, None) if value is None or half is None else (value - half, value + half)
    return QuantityRow(name=name, unit="N", value=value, low=ends[0], high=ends[1], **given)


def condition(unit: str, *rows: QuantityRow, name: str = "sine") -> SheetCondition:
    numbers = {"frequency": 2.0, "stroke": 0.02, "peak_velocity": 0.1, "samples_per_cycle": 50.0, "noise": 1.0}
    about = {"unit": unit, "condition": name, "recording": unit, "source": f"{unit}.csv", "waveform": "sine"}
    return SheetCondition(**about, **numbers, cycles=3, current=None, temperature=None, quantities=[*rows], findings=[])


def unit(name: str, *conditions: SheetCondition, verdicts: tuple[str, ...] = ()) -> UnitRow:
    rows = [verdict(unit=name, verdict=v) for v in verdicts]
    return UnitRow(unit=name, about={}, conditions=[*conditions], across=[], verdicts=rows, verdict="", left_out=[])


def units(values: list[float], **given: Any) -> list[UnitRow]:
    return [unit(f"u{k}", condition(f"u{k}", quantity(value=v, **given))) for k, v in enumerate(values)]


def test_a_unit_far_from_the_others_stands_out_and_sound_ones_do_not() -> None:
    assert _stands_out(units(SOUND)) == []
    (one,) = _stands_out(units([*SOUND, 120.0]))
    assert (one.unit, one.quantity, one.value) == ("u6", "F0+", 120.0) and one.z > 10.0
    assert one.median == np.median([*SOUND, 120.0])


@pytest.mark.parametrize(
    "rows",
    [
        units([*SOUND[: FEWEST_UNITS - 2], 120.0]),
        units([*SOUND, 120.0], half=30.0),
        units([100.0] * 6 + [120.0]),
        units([*SOUND, 120.0], half=None),
        units([*SOUND, 120.0], name="closure"),
    ],
    ids=["few units", "wide intervals", "no scatter", "no interval", "closure"],
)
def test_what_cannot_tell_lists_nobody(rows: list[UnitRow]) -> None:
    assert _stands_out(rows) == []


def test_the_clearest_comes_first() -> None:
    found = _stands_out(units([*SOUND, 80.0, 150.0]))
    assert [one.value for one in found] == [150.0, 80.0]


def changed(value: float, before: float | None, **given: Any) -> list[Any]:
    rows, _ = _changes(
        [condition("u", quantity(value=value, **given))], [condition("a", quantity(value=before, **given))]
    )
    return rows


def test_a_change_beyond_both_intervals_is_one_and_less_is_none() -> None:
    (one,) = changed(110.0, 100.0)
    assert one.changed and one.change == pytest.approx(0.1)
    assert one.high - one.low == pytest.approx(2.0 * np.hypot(0.1, 0.1) / 100.0)
    (other,) = changed(100.1, 100.0)
    assert not other.changed


def test_a_change_is_no_share_of_what_is_zero_within_noise_and_no_size_is_shown_below_it() -> None:
    before, after = condition("a", quantity("ripple", 0.001, 0.004)), condition("a", quantity("ripple", -0.003, 0.004))
    ((change,), _) = _changes([after], [before])
    assert change.change is None and not change.changed
    rows = change_table(sheet(unit("a", after), changes=[change])).rows
    assert rows[0][2:5] == [0.0, 0.001, "–"]
    ((clear,), _) = _changes([before], [condition("a", quantity("ripple", 0.02, 0.004))])
    assert clear.change == pytest.approx(-0.95)


def test_what_has_no_interval_or_no_partner_cannot_change() -> None:
    (one,) = changed(110.0, 100.0, half=None)
    assert not one.changed and one.low is None and one.change == pytest.approx(0.1)
    (zero,) = changed(1.0, 0.0)
    assert zero.change is None and zero.changed
    assert changed(1.0, None) == []


def test_conditions_of_one_side_alone_are_named() -> None:
    rows = [condition("u", quantity(), name="a"), condition("u", quantity(), name="b")]
    others = [condition("x", quantity(), name="b"), condition("x", quantity(), name="c")]
    found, alone = _changes(rows, others)
    assert [c.condition for c in found] == ["b"] and alone == ["a", "c"]


def sheet(*rows: UnitRow, limits: str = "", changes: Any = ()) -> SheetFile:
    return SheetFile(
        convention="", settings={}, limits=limits, guard="", units=[*rows], batch=[], stands_out=[],
        changes=[*changes], unmatched=[], left_out=[],
    )  # fmt: skip


def test_the_summary_counts_units_or_gives_the_verdict_of_one() -> None:
    one, other = unit("a", condition("a")), unit("b", condition("b"), condition("b", name="c"))
    assert summary_of(sheet(one)) == "1 condition of 1 unit, without limits"
    judged = [UnitRow(**{**vars(u), "verdict": v}) for u, v in ((one, PASS), (other, FAIL))]
    assert summary_of(sheet(*judged, limits="EN")) == (
        "3 conditions of 2 units, limits 'EN': 0 verdicts on 0 of 3 conditions; units by their worst verdict: 1 pass, "
        "1 fail, 0 cannot be judged"
    )
    assert summary_of(sheet(judged[1], limits="EN")).endswith("limits 'EN': 0 verdicts on 0 of 2 conditions: fail")


def test_the_conditions_that_limits_touch_are_counted() -> None:
    own = [condition("a", name="b"), condition("a", name="c")]
    assert judged_of([unit("a", *own, verdicts=(PASS, PASS))]) == "2 verdicts on 1 of 2 conditions"
    # verdicts are on a condition that is none of a log
    assert judged_of([unit("a", own[0], verdicts=(PASS,))]) == "1 verdict on 0 of 1 condition and across them"


def test_conditions_without_a_partner_are_said_with_their_side() -> None:
    file = replace(sheet(unit("a", condition("a", name="b"))), unmatched=["b", "c"])
    assert unmatched_of(file) == ["b (only here)", "c (only in the logs compared with)"]
    assert "none of them in the logs compared with" in summary_of(file)
    rows, _ = _changes([condition("u", quantity())], [condition("a", quantity())])
    assert "none of them" not in summary_of(replace(file, changes=rows))
    assert "none of them" not in summary_of(replace(file, unmatched=[])) and unmatched_of(sheet()) == []


def test_units_are_listed_with_their_counts_of_verdicts() -> None:
    table = unit_table(sheet(unit("a", condition("a"), verdicts=(PASS, PASS, FAIL, UNDECIDED))))
    assert table.rows == [["a", 1, 2, 1, 1, ""]]


def test_changed_quantities_come_first_and_are_counted() -> None:
    rows, _ = _changes(
        [condition("u", quantity("F0+", 100.1), quantity("F0-", -120.0))],
        [condition("a", quantity("F0+", 100.0), quantity("F0-", -100.0))],
    )
    table = change_table(sheet(changes=rows))
    assert [row[1] for row in table.rows] == ["F0-", "F0+"] and table.caption.endswith("1 of 2 quantities")
    assert [row[-1] for row in table.rows] == ["changed", "within the intervals"]
    assert len(change_table(sheet(changes=rows), most=1).rows) == 1


def test_a_condition_shows_what_it_lacks_only_where_it_is_asked() -> None:
    one = condition("u", quantity(), quantity("E", None, reason="one cycle"))
    assert [row[0] for row in condition_table(one).rows] == ["F0+", "E"]
    assert [row[0] for row in condition_table(one, unknown=False).rows] == ["F0+"]
    assert condition_table(one).caption.startswith("sine: 3 cycles of 2 Hz, stroke 20 mm")


def test_main_quantities_are_those_that_some_condition_has() -> None:
    table = main_table([condition("u", quantity("F0+"), quantity("E", None)), condition("u", quantity("F0-", -1.0))])
    assert table.heads == ("condition", "cycles", "v (m/s)", "F0+ (N)", "F0- (N)")
    assert [row[3:] for row in table.rows] == [[100.0, None], [None, -1.0]]


def test_quantities_lacking_for_one_reason_share_a_row() -> None:
    missing = [AcrossRow(conditions="all", quantity=quantity(n, None, reason="one speed")) for n in ("C", "alpha")]
    there = AcrossRow(conditions="all", quantity=quantity("F0+"))
    assert [row[1] for row in across_table([*missing, there]).rows] == ["C, alpha", "F0+"]


def test_verdicts_of_several_units_begin_with_the_unit() -> None:
    rows = [verdict(), verdict(level="cycle", verdict=FAIL)]
    assert verdict_table(rows).heads[0] == "condition" and verdict_table(rows, several=True).heads[0] == "unit"
    assert [row[0] for row in verdict_table(rows, several=True).rows] == ["u", "u"]
    assert [row[1] for row in verdict_table(rows).rows] == ["all cycles", "each cycle"]
