"""Tables of a sheet, what its head says, and colours and curves of its figures."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from mrfit.core.specs import Array
from mrfit.io.schemas.sheet import AcrossRow, ChangeRow, SheetCondition, UnitRow
from mrfit.report.figures import PALETTE, QUIET
from mrfit.sheet.compute import SheetContent
from mrfit.sheet.figures import LIMIT_COLOUR, colours_of, draw_distribution, draw_history, draw_loops, draw_peaks
from mrfit.sheet.measured import CycleCourse, MeanLoop
from mrfit.sheet.page import UNITS_SHOWN, facts_of, render, title_of
from mrfit.sheet.print_page import _cut
from mrfit.sheet.tables import across_table, change_table, condition_table, lacks_main, main_table, verdict_table
from tests.sheet.test_compute import condition, quantity, sheet, unit
from tests.sheet.test_words import verdict


def axes() -> Any:
    return Figure().add_subplot()


def curves(drawn: Any) -> list[tuple[Array, Array]]:
    return [(np.asarray(line.get_xdata()), np.asarray(line.get_ydata())) for line in drawn.lines]


def loop(name: str = "a", current: float = np.nan, size: float = 1.0) -> MeanLoop:
    at = np.linspace(0.0, 2.0 * np.pi, 60)
    return MeanLoop("u", name, current, 0.01 * np.sin(at), 0.1 * np.cos(at), 2000.0 * size * np.cos(at))


@pytest.mark.parametrize("currents", [[], [np.nan, np.nan], [1.0, 1.001], [1.0, np.nan]])
def test_without_two_currents_there_is_one_colour(currents: list[float]) -> None:
    colour = colours_of(currents)
    assert {colour(c) for c in (0.0, 1.0, np.nan)} == {PALETTE[0]}


def test_each_current_has_a_colour_of_its_own_and_others_are_quiet() -> None:
    colour = colours_of([2.0, 0.0, 1.0, 1.004])
    assert len({colour(c) for c in (0.0, 1.0, 2.0)}) == 3 and colour(1.004) == colour(1.0)
    assert colour(5.0) == QUIET


@pytest.mark.parametrize(
    ("over", "label", "reach"), [("displacement", "Displacement (mm)", 10.0), ("velocity", "Velocity (m/s)", 0.1)]
)
def test_loops_are_drawn_in_units_with_prefixes_those_compared_with_dashed(over: str, label: str, reach: float) -> None:
    drawn = axes()
    draw_loops(drawn, [loop("a"), loop("b", size=0.5)], [loop("x", size=0.25)], over)
    assert drawn.get_xlabel() == label and drawn.get_ylabel() == "Force (kN)"
    assert [line.get_linestyle() for line in drawn.lines] == ["-", "-", "--"]
    found = [np.nanmax(np.abs(y)) for _, y in curves(drawn)]
    assert found == pytest.approx([2.0, 1.0, 0.5], rel=0.01) and np.nanmax(curves(drawn)[0][0]) == pytest.approx(
        reach, rel=0.01
    )
    # names beside the velocity alone
    legend = drawn.get_legend()
    assert (legend is not None) == (over == "velocity")
    assert legend is None or [t.get_text() for t in legend.get_texts()] == ["a", "b"]


def test_loops_of_several_currents_are_named_by_these_in_their_order() -> None:
    drawn = axes()
    draw_loops(drawn, [loop(f"c{i}", i) for i in (10.0, 2.0, 0.5)], [], "velocity")
    assert [t.get_text() for t in drawn.get_legend().get_texts()] == ["0.5 A", "2 A", "10 A"]
    many = axes()
    draw_loops(many, [loop(f"c{k}") for k in range(9)], [], "velocity")
    assert many.get_legend() is None


def of_speed(speed: float, force: float, current: float | None = None) -> SheetCondition:
    rows = (quantity("Fmax+", force, 10.0), quantity("Fmax-", -2.0 * force, 20.0))
    return replace(condition("u", *rows, name=f"{speed}"), peak_velocity=speed, current=current)


def test_peak_forces_are_magnitudes_over_speed_in_its_order_with_their_intervals() -> None:
    drawn = axes()
    draw_peaks(drawn, [of_speed(0.2, 300.0), of_speed(0.1, 100.0), condition("u", quantity("Fmax+", None))])
    (plus, minus) = [container.lines[0] for container in drawn.containers]
    assert list(plus.get_xdata()) == list(minus.get_xdata()) == pytest.approx([0.1, 0.2])
    assert list(plus.get_ydata()) == pytest.approx([100.0, 300.0])
    assert list(minus.get_ydata()) == pytest.approx([200.0, 600.0])
    bars = drawn.containers[1].lines[2][0].get_segments()
    assert np.array(bars)[:, :, 1] == pytest.approx(np.array([[180.0, 220.0], [580.0, 620.0]]))
    assert drawn.get_xlabel() == "Peak velocity (m/s)" and drawn.get_xlim()[0] == drawn.get_ylim()[0] == 0.0


def test_peak_forces_of_each_current_are_curves_of_their_own() -> None:
    drawn = axes()
    draw_peaks(drawn, [of_speed(v, f, i) for v, f, i in ((0.1, 100.0, 0.0), (0.2, 150.0, 0.0), (0.1, 500.0, 1.0))])
    assert [len(c.lines[0].get_xdata()) for c in drawn.containers] == [2, 2, 1, 1]
    labels = [t.get_text() for t in drawn.get_legend().get_texts()]
    assert labels == ["0 A, v > 0", "0 A, v < 0", "1 A, v > 0", "1 A, v < 0"]


def course(*temperature: float, name: str = "a") -> CycleCourse:
    return CycleCourse("u", name, np.array([90.0, 100.0, 110.0]), np.array(temperature or [np.nan] * 3))


def test_the_history_is_the_deviation_from_the_mean_over_the_number_of_the_cycle() -> None:
    drawn = axes()
    assert draw_history(drawn, [course(), course(20.0, 20.4, 20.9, name="b")]) == "Cycle"
    assert [list(x) for x, _ in curves(drawn)] == [[1.0, 2.0, 3.0]] * 2
    assert list(curves(drawn)[0][1]) == pytest.approx([-10.0, 0.0, 10.0])


def test_where_the_temperature_moves_by_a_kelvin_the_history_is_over_it() -> None:
    drawn = axes()
    assert draw_history(drawn, [course(20.0, 20.5, 21.5)]) == "Temperature (°C)"
    assert list(curves(drawn)[0][0]) == [20.0, 20.5, 21.5]


def test_the_units_of_a_judged_quantity_are_drawn_in_order_with_the_limits() -> None:
    rows = [verdict(unit=f"u{k}", value=v, low=v - 1.0, high=v + 1.0, verdict=said, least=90.0, most=None)
            for k, (v, said) in enumerate(((100.0, "pass"), (80.0, "fail"), (101.0, "pass")))]  # fmt: skip
    other = verdict(unit="u0", quantity="E", value=5.0)
    units = [UnitRow(**{**vars(unit(r.unit)), "verdicts": [other, r]}) for r in rows]
    drawn = axes()
    draw_distribution(drawn, units, rows[0])
    good, bad = (container.lines[0] for container in drawn.containers)
    assert (list(good.get_xdata()), list(good.get_ydata())) == ([1, 3], [100.0, 101.0])
    assert (list(bad.get_xdata()), list(bad.get_ydata()), bad.get_color()) == ([2], [80.0], LIMIT_COLOUR)
    assert [t.get_text() for t in drawn.get_legend().get_texts()] == ["pass: 2", "fail: 1"]
    # the one limit that there is
    ends = [line for line in drawn.lines if line.get_linestyle() == "--"]
    assert [set(line.get_ydata()) for line in ends] == [{90.0}]


def test_a_condition_without_main_quantities_has_a_table_of_those_it_has() -> None:
    step = condition("u", quantity("friction", 2.0), quantity("E", None))
    assert lacks_main(step) and not lacks_main(condition("u", quantity("E", 5.0)))
    assert [head.partition(" ")[0] for head in main_table([step]).heads[3:]] == ["friction"]


def test_the_main_table_has_the_columns_of_what_some_condition_has() -> None:
    first = condition("u", quantity("F0+", 1.0), quantity("E", None), name="a")
    second = condition("u", quantity("Fmax-", -3.0), quantity("friction", 2.0), name="b")
    table = main_table([first, second])
    assert list(table.heads) == ["condition", "cycles", "v (m/s)", "F0+ (N)", "Fmax- (N)"]
    assert table.rows == [["a", 3, 0.1, 1.0, None], ["b", 3, 0.1, None, -3.0]]


def test_the_table_of_a_condition_leaves_out_what_is_unknown_where_asked() -> None:
    one = condition("u", quantity("F0+", 100.0), replace(quantity("E", None), reason="one cycle"))
    whole, shown = condition_table(one), condition_table(one, unknown=False)
    assert [r[0] for r in whole.rows] == ["F0+", "E"] and whole.rows[1][-1] == "one cycle"
    assert [r[0] for r in shown.rows] == ["F0+"]
    assert "3 cycles of 2 Hz, stroke 20 mm, peak velocity 0.1 m/s; u.csv" in whole.caption


def test_quantities_without_a_value_for_one_reason_share_a_row() -> None:
    def row(name: str, value: float | None, reason: str = "", conditions: str = "all") -> AcrossRow:
        return AcrossRow(conditions=conditions, quantity=replace(quantity(name, value), reason=reason))

    rows = [row("C+", None, "1 speed"), row("alpha+", None, "1 speed"), row("C-", 5.0), row("alpha-", 0.5)]
    table = across_table([*rows, row("C+", None, "1 speed", "other")])
    assert [(r[0], r[1]) for r in table.rows] == [
        ("all", "C+, alpha+"), ("all", "C-"), ("all", "alpha-"), ("other", "C+")
    ]  # fmt: skip


def test_verdicts_of_several_units_begin_with_the_unit() -> None:
    rows = [verdict(unit="u7", level="cycle")]
    alone, several = verdict_table(rows), verdict_table(rows, several=True)
    assert alone.heads[0] == "condition" and alone.rows[0][:3] == ["c", "each cycle", "F0+"]
    assert several.heads[0] == "unit" and several.rows[0][0] == "u7"


def test_changes_beyond_the_intervals_come_first_and_are_counted() -> None:
    about = {"unit": "u", "condition": "c", "value": 1.1, "against": 1.0, "change": 0.1, "low": 0.0, "high": 0.2}
    rows = [ChangeRow(**about, quantity=n, changed=c) for n, c in (("E", False), ("F0+", True), ("F0-", False))]
    table = change_table(sheet(changes=rows), most=2)
    assert [r[1] for r in table.rows] == ["F0+", "E"] and table.caption == "Changed, SI: 1 of 3 quantities"
    assert [r[-1] for r in table.rows] == ["changed", "within the intervals"]


@pytest.mark.parametrize(
    ("about", "title"),
    [
        ((), "Test sheet of u7"),
        ((("serial", "3"),), "Test sheet of u7"),
        ((("Specimen", "MR 7"),), "Test sheet: MR 7"),
        ((("damper", "a"), ("title", "b")), "Test sheet: a"),
    ],
)
def test_a_sheet_is_called_after_what_was_tested(about: Any, title: str) -> None:
    file = replace(sheet(), settings={"about": about})
    assert title_of(file, "u7") == title
    assert title_of(sheet()) == "Test sheet of a damper"


def test_the_head_says_how_it_was_judged_and_corrected_where_it_was() -> None:
    plain = dict(facts_of(sheet()))
    assert "Judged" not in plain and "Skew" not in plain
    for guard, words in (("interval", "whole 95 % interval"), ("none", "by the value alone")):
        judged = replace(sheet(limits="EN"), guard=guard, settings={"skew": 0.002, "about": [("serial", 7)]})
        facts = dict(facts_of(judged))
        assert words in facts["Judged"] and "0.002 s earlier" in facts["Skew"] and facts["serial"] == "7"


def test_of_many_units_those_that_fail_have_a_section_first_and_those_shown_keep_their_order() -> None:
    count = UNITS_SHOWN + 3
    said = ["pass"] * (count - 2) + ["cannot be judged", "fail"]
    rows = [
        UnitRow(**{**vars(unit(f"u{k:02d}", condition(f"u{k:02d}", quantity()))), "verdict": v})
        for k, v in enumerate(said)
    ]
    page = render(SheetContent(replace(sheet(*rows, limits="EN"), guard="none"), [], [], []))
    shown = [f"Unit u{k:02d}: quantities" in page for k in range(count)]
    most = UNITS_SHOWN - 2
    assert shown == [True] * most + [False] * 3 + [True] * 2
    assert page.index("Unit u00: quantities") < page.index(f"Unit u{count - 1}: quantities")
    assert f"Of {count} units {UNITS_SHOWN} have a section" in page


@pytest.mark.parametrize(("text", "shown"), [("abcde", "abcde"), ("abcdef", "abcd…"), ("a\x07b", "a\\x07…")])
def test_words_of_the_printed_page_are_cut_to_their_room(text: str, shown: str) -> None:
    assert _cut(text, 5) == shown or len(_cut(text, 5)) == 5
