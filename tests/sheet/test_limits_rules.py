"""Limits as they are written, magnitudes of negative forces, verdicts of cycles, of batches and across conditions."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from mrfit.errors import ConfigError
from mrfit.io.schemas.sheet import AcrossRow, QuantityRow, SheetCondition, VerdictRow
from mrfit.sheet.limits import Limit, LimitsFile, batch_verdicts, read_limits, verdict_of, verdicts
from tests.sheet.test_compute import condition, quantity
from tests.sheet.test_words import verdict


def judged(
    rows: list[QuantityRow], across: tuple[AcrossRow, ...] = (), guard: Any = "interval", **limit: Any
) -> list[VerdictRow]:
    file = LimitsFile(guard=guard, limit=[Limit(**limit)])
    return verdicts(file, "u", [condition("u", *rows)], across)


def value(name: str, middle: float, half: float | None = 1.0, **given: Any) -> QuantityRow:
    return quantity(name, middle, half, **given)


def ends(name: str, middle: float, **limit: Any) -> tuple[float | None, float | None]:
    [row] = judged([value(name, middle)], quantity=name, **limit)
    return row.least, row.most


@pytest.mark.parametrize(
    ("middle", "limit", "expected"),
    [
        (100.0, {"target": 100.0, "tolerance": "15 %"}, (85.0, 115.0)),
        (100.0, {"target": 100.0, "tolerance": 4.0}, (96.0, 104.0)),
        (-100.0, {"target": -100.0, "tolerance": "15 %"}, (-115.0, -85.0)),
        # the target written as a magnitude
        (-100.0, {"target": 100.0, "tolerance": "15 %"}, (-115.0, -85.0)),
        (-100.0, {"least": 80.0, "most": 120.0}, (-120.0, -80.0)),
        (-100.0, {"least": 80.0}, (None, -80.0)),
        (-100.0, {"most": 120.0}, (-120.0, None)),
        (-100.0, {"least": -120.0}, (-120.0, None)),
        (-100.0, {"least": -120.0, "most": 0.0}, (-120.0, 0.0)),
        (100.0, {"least": 80.0, "most": 120.0}, (80.0, 120.0)),
        # the narrower of both
        (100.0, {"target": 100.0, "tolerance": 15.0, "least": 90.0, "most": 130.0}, (90.0, 115.0)),
        (100.0, {"target": 100.0, "tolerance": 15.0, "least": 80.0, "most": 110.0}, (85.0, 110.0)),
    ],
)
@pytest.mark.parametrize("name", ["F0-", "Fd-", "Fmax-"])
def test_limits_of_a_force_of_negative_direction(
    name: str, middle: float, limit: dict[str, Any], expected: tuple[float | None, float | None]
) -> None:
    assert ends(name, middle, **limit) == expected


def test_other_quantities_below_zero_have_no_magnitude() -> None:
    assert ends("K_eff", -100.0, least=80.0, most=120.0) == (80.0, 120.0)
    assert ends("K_eff", -100.0, target=100.0, tolerance=10.0) == (90.0, 110.0)
    # nor has one that a tolerance alone puts beyond zero
    assert ends("Fmax-", -100.0, target=-10.0, tolerance=5.0) == (-15.0, -5.0)


def written(folder: Path, **limit: object) -> Limit:
    keys = "\n".join(f"{k} = {v!r}".replace("'", '"') for k, v in limit.items())
    (folder / "l.toml").write_text(f"[[limit]]\n{keys}\n")
    return read_limits(folder / "l.toml").limit[0]


@pytest.mark.parametrize(
    ("quantity", "unit", "scale"),
    [
        ("closure", "%", 0.01),
        ("ratio", "1", 1.0),
        ("d_y", "mm", 1e-3),
        ("K_eff", "kN/mm", 1e6),
        ("E", "kJ", 1e3),
        ("C+", "N*(s/m)^alpha", 1.0),
        ("t63 up", "ms", 1e-3),
    ],
)
def test_numbers_of_a_limit_are_taken_in_its_unit(quantity: str, unit: str, scale: float, tmp_path: Path) -> None:
    one = written(tmp_path, quantity=quantity, unit=unit, target=2.0, tolerance=1, least=0.5, most=3.0,
                  batch_tolerance=0.25, cycle_tolerance="5 %")  # fmt: skip
    found = (one.target, one.tolerance, one.least, one.most, one.batch_tolerance)
    assert found == pytest.approx(tuple(scale * v for v in (2.0, 1.0, 0.5, 3.0, 0.25)))
    # a share is one in every unit
    assert one.cycle_tolerance == "5 %"


@pytest.mark.parametrize(("quantity", "unit"), [("C+", "kN"), ("closure", "N"), ("alpha+", "m")])
def test_a_unit_of_another_kind_is_refused_with_what_is_taken(quantity: str, unit: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=rf"{unit}' is no unit of this quantity; give one of"):
        written(tmp_path, quantity=quantity, unit=unit, most=1.0)


@pytest.mark.parametrize(
    "limit",
    [
        {"cycle_tolerance": 1.0},
        {"target": 5.0, "batch_tolerance": "5 %"},
        {"least": 5.0, "most": 5.0},
        {"target": 5.0, "tolerance": 0.0},
    ],
)
def test_what_is_enough_for_a_limit(limit: dict[str, Any], tmp_path: Path) -> None:
    assert written(tmp_path, quantity="E", **limit).quantity == "E"


@pytest.mark.parametrize(
    ("limit", "said"),
    [
        ({"batch_tolerance": 1.0, "most": 2.0}, "batch_tolerance without a target"),
        ({"cycle_tolerance": "5"}, "cycle_tolerance takes a share"),
        ({"cycle_tolerance": "-5 %"}, "cycle_tolerance takes a share"),
        ({"target": 1.0, "tolerance": 1.0, "batch_tolerance": -1.0}, "batch_tolerance is negative, -1"),
    ],
)
def test_every_tolerance_is_looked_at(limit: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=said) as caught:
        written(tmp_path, quantity="e", **limit)
    assert "[[limit]] 1, E:" in str(caught.value)


@pytest.mark.parametrize(("guard", "said"), [("interval", "cannot be judged"), ("none", "pass")])
def test_without_a_guard_a_value_is_judged_alone(guard: str, said: str) -> None:
    [row] = judged([value("E", 100.0, 5.0)], guard=guard, quantity="E", least=98.0)
    assert row.verdict == said and (row.low, row.high) == (95.0, 105.0)
    assert row.reason == ("the interval straddles a limit" if guard == "interval" else "")


def test_at_a_limit_itself_a_value_passes() -> None:
    assert [judged([value("E", 100.0, 2.0)], quantity="E", **limit)[0].verdict for limit in (
        {"least": 98.0, "most": 102.0}, {"least": 102.0}, {"most": 98.0}, {"least": 102.1})
    ] == ["pass", "cannot be judged", "cannot be judged", "fail"]  # fmt: skip


def test_a_value_without_an_interval_or_without_a_value_says_why() -> None:
    for row, reason in ((value("E", 100.0, None), "its interval is not known"),
                        (replace(value("E", 1.0), value=None, reason="one cycle"), "one cycle")):  # fmt: skip
        [found] = judged([row], quantity="E", most=3.0)
        assert (found.verdict, found.reason, found.value, found.si_unit) == ("cannot be judged", reason, None, "J")


def cycles(*values: float, noise: float | None = 0.5) -> QuantityRow:
    mean = float(np.mean(values))
    worst = max(abs(v / mean - 1.0) for v in values)
    return value("E", mean, cycles=[*values], noise=noise, greatest_deviation=worst)


def test_the_greatest_of_several_deviations_has_the_noise_of_the_greatest_of_several() -> None:
    [row] = judged([cycles(95.0, 100.0, 100.0, 105.0)], quantity="E", cycle_tolerance="8 %")
    half = 0.5 * norm.ppf(1.0 - 0.025 / 4.0)
    assert (row.level, row.value, row.verdict) == ("cycle", pytest.approx(5.0), "pass")
    assert (row.low, row.high) == pytest.approx((5.0 - half, 5.0 + half))
    # of the mean of all cycles, whatever its sign
    assert (row.least, row.most) == (0.0, pytest.approx(8.0))
    [other] = judged([cycles(-95.0, -100.0, -105.0)], quantity="E", cycle_tolerance="8 %")
    assert (other.value, other.most) == pytest.approx((5.0, 8.0))
    [small] = judged([cycles(99.9, 100.1)], quantity="E", cycle_tolerance="8 %")
    assert small.low == 0.0 and small.verdict == "pass"


@pytest.mark.parametrize("row", [cycles(100.0), cycles(100.0, 101.0, noise=None)])
def test_cycles_that_tell_no_deviation_cannot_be_judged(row: QuantityRow) -> None:
    [found] = judged([row], quantity="E", cycle_tolerance="8 %")
    assert (found.verdict, found.level) == ("cannot be judged", "cycle")


def test_one_limit_may_judge_the_mean_and_each_cycle() -> None:
    rows = judged([cycles(99.0, 101.0)], quantity="E", most=200.0, cycle_tolerance=5.0)
    assert [r.level for r in rows] == ["unit", "cycle"]


def test_quantities_across_conditions_are_judged_by_the_pattern_of_their_name() -> None:
    across = tuple(
        AcrossRow(conditions=c, quantity=value("alpha+", v, 0.01))
        for c, v in (("all speeds, 0 A", 0.5), ("all speeds, 1 A", 0.4))
    )
    found = judged([], across, quantity="alpha+", condition="all speeds, 1*", most=0.45)
    assert [(r.condition, r.verdict) for r in found] == [("all speeds, 1 A", "pass")]
    [none] = judged([], across, quantity="alpha+", condition="sine*", most=0.45)
    assert none.reason == "no condition like 'sine*' has this quantity" and none.condition == "sine*"
    [nowhere] = judged([], (), quantity="alpha+", most=0.45)
    assert nowhere.reason == "no condition of this unit has this quantity"


def batch(values: list[QuantityRow], **limit: Any) -> list[VerdictRow]:
    units: dict[str, list[SheetCondition]] = {f"u{k}": [condition(f"u{k}", row)] for k, row in enumerate(values)}
    about = {"quantity": values[0].name, "batch_tolerance": "10 %", **limit}
    return batch_verdicts(LimitsFile(limit=[Limit(**about)]), units)


def test_the_mean_of_a_batch_is_of_the_units_that_have_a_value_with_an_interval() -> None:
    [row] = batch([value("E", 90.0, 3.0), value("E", 106.0, 4.0), value("E", 500.0, None), value("E", 0.0, None)],
                  target=100.0)  # fmt: skip
    assert (row.value, row.least, row.most) == pytest.approx((98.0, 90.0, 110.0))
    # halves of 3 and 4 N of two units
    assert (row.low, row.high) == pytest.approx((98.0 - 2.5, 98.0 + 2.5))
    assert (row.level, row.unit, row.condition, row.verdict) == ("batch", "all units", "sine", "pass")


def test_a_batch_of_negative_forces_may_have_its_target_as_a_magnitude() -> None:
    [row] = batch([value("Fmax-", -95.0), value("Fmax-", -99.0)], target=100.0)
    assert (row.least, row.most, row.verdict) == (-110.0, -90.0, "pass")


def test_a_batch_without_values_without_its_tolerance_or_of_other_conditions_has_no_mean() -> None:
    [row] = batch([value("E", 90.0, None)], target=100.0)
    assert (row.verdict, row.reason) == ("cannot be judged", "no unit has a value with an interval")
    assert batch([value("E", 90.0)], target=100.0, batch_tolerance=None, tolerance=5.0) == []
    [other] = batch([value("E", 90.0)], target=100.0, condition="tri*")
    assert (other.condition, other.verdict) == ("tri*", "cannot be judged")
    [lacking] = batch([value("E", 90.0)], target=100.0, quantity="alpha+")
    assert lacking.reason == "no unit has this quantity in such a condition"


def test_the_mean_of_a_batch_is_judged_across_conditions_too() -> None:
    across = {f"u{k}": [AcrossRow(conditions="all speeds", quantity=value("alpha+", v, 0.01))]
              for k, v in enumerate((0.38, 0.44))}  # fmt: skip
    units = {name: [condition(name, value("E", 100.0))] for name in across}
    limits = [Limit(quantity=n, target=t, batch_tolerance="5 %") for n, t in (("alpha+", 0.4), ("E", 100.0))]
    rows = batch_verdicts(LimitsFile(limit=limits), units, across)
    # a limit on one quantity says nothing of what lacks it
    assert [(r.condition, r.quantity, r.verdict) for r in rows] == [
        ("all speeds", "alpha+", "pass"),
        ("sine", "E", "pass"),
    ]
    assert rows[0].value == pytest.approx(0.41)


@pytest.mark.parametrize(
    ("rows", "worst"),
    [
        (["pass", "cannot be judged", "fail"], "fail"),
        (["pass", "cannot be judged"], "cannot be judged"),
        (["pass", "pass"], "pass"),
        ([], ""),
    ],
)
def test_the_verdict_of_several_is_the_worst(rows: list[str], worst: str) -> None:
    assert verdict_of([verdict(verdict=v) for v in rows]) == worst
