"""Recordings to the rows of a sheet: levels of currents and temperatures, whole records, what one sample changes."""

import fnmatch
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from datasets.rig.closed_forms import Rig
from mrfit.core.recording import Finding, Recording
from mrfit.io.schemas.sheet import QuantityRow, SheetCondition
from mrfit.measure.intervals import ConfidenceInterval, Estimate, known
from mrfit.measure.quantity import SHEET_QUANTITIES, Quantity
from mrfit.settings.sheet import Settings
from mrfit.sheet.limits import Limit, LimitsFile, verdicts
from mrfit.sheet.measured import Measurements, measured, quantity_row, unit_of
from tests.measure.rigs import of_rig, recording
from tests.measure.test_bilinear import growing

GAS = Rig("gas", 2.0, 200.0, noise=1e-4, cycles=6)


def of(*recordings: Recording, units: dict[str, str] | None = None, **given: Any) -> Measurements:
    return measured(recordings, units or {r.id: "unit" for r in recordings}, Settings(**given))


def row(*recordings: Recording, **given: Any) -> SheetCondition:
    [found] = of(*recordings, **given).rows
    return found


def quantities(one: SheetCondition) -> dict[str, QuantityRow]:
    return {q.name: q for q in one.quantities}


def beside(rig: Rig = GAS, name: str = "a", condition: dict[str, float] | None = None, **levels: Any) -> Recording:
    """A record of a rig with further channels, each a level or one value a sample."""
    displacement, force = rig.record()
    more = {n: np.broadcast_to(np.asarray(v, dtype=np.float64), force.shape).copy() for n, v in levels.items()}
    made = recording(name, 1.0 / rig.rate, displacement=displacement, force=force, **more)
    return replace(made, condition=condition or {})


@pytest.mark.parametrize(
    ("kind", "channel", "judged"),
    [
        ("clipped", "force", False),
        ("outlier", "force", False),
        ("clipped", "displacement", False),
        ("clipped", "temperature", True),
        ("offset", "force", True),
    ],
)
def test_a_force_that_is_cut_off_or_garbled_passes_no_limit(kind: str, channel: str, judged: bool) -> None:
    damaged = replace(beside(), findings=(Finding(kind, channel, None, "damaged"),))
    (whole, found) = (quantities(row(r))["Fmax+"] for r in (beside(), damaged))
    assert found.value == whole.value and whole.value is not None
    assert (found.low is not None, found.reason) == (judged, "" if judged else "damaged")
    limits = LimitsFile(limit=[Limit(quantity="Fmax+", least=0.0, most=2.0 * whole.value, cycle_tolerance="50 %")])
    said = [(v.verdict, v.reason) for v in verdicts(limits, "unit", [row(damaged)], [])]
    assert said == 2 * [("pass", "") if judged else ("cannot be judged", "damaged")]


@pytest.mark.parametrize(("level", "told"), [(0.015, 0.0), (0.025, 0.025), (-0.015, 0.0), (1.5, 1.5)])
def test_a_current_below_twenty_milliamperes_is_none(level: float, told: float) -> None:
    assert row(beside(current=level)).current == pytest.approx(told)


def test_a_current_that_is_not_logged_is_not_known() -> None:
    assert row(beside()).current is None


def test_the_temperature_is_the_mean_of_every_cycle_else_what_the_log_states() -> None:
    seconds = np.arange(len(GAS.record()[1])) / GAS.rate
    found = of(beside(temperature=20.0 + seconds))
    # it rises by a kelvin a second, half a kelvin a cycle
    assert np.diff(found.courses[0].temperature) == pytest.approx(np.full(found.rows[0].cycles - 1, 0.5), abs=0.01)
    assert found.rows[0].temperature == pytest.approx(float(np.mean(found.courses[0].temperature)))
    assert found.rows[0].temperature == pytest.approx(20.0 + seconds[-1] / 2.0, abs=0.3)
    stated = of(beside(condition={"temperature": 35.0}))
    assert stated.rows[0].temperature == 35.0 and list(stated.courses[0].temperature) == [35.0] * stated.rows[0].cycles
    assert row(beside()).temperature is None


@pytest.mark.parametrize(("per_cycle", "told"), [(100.0, True), (4000.0, False)])
def test_what_a_sample_of_skew_changes_is_told_as_a_share_of_the_peak(per_cycle: float, told: bool) -> None:
    said = " ".join(row(of_rig(Rig("viscous", 1.0, per_cycle, noise=1e-6, cycles=5))).findings)
    # at the ends of the stroke a viscous force changes by ω*dt of its peak
    assert ("one sample (10 ms) late or early would change" in said) == told
    assert (f"Fd+ by {200.0 * np.pi / per_cycle:.1f} %" in said) == told
    assert "closure" not in said and "Fmax" not in said


def test_a_change_by_a_skew_within_the_interval_is_not_told() -> None:
    said = row(of_rig(Rig("viscous", 1.0, 100.0, noise=0.2, cycles=5))).findings
    assert not any("one sample" in text for text in said)


def test_a_whole_record_of_growing_cycles_has_its_yield_and_its_own_numbers() -> None:
    moved, force = growing((0.01, 0.02, 0.03, 0.04))
    one = row(recording("g", 0.01, displacement=moved, force=force))
    assert (one.condition, one.waveform, one.frequency, one.cycles) == ("g (whole record)", "unsteady", 0.0, 4)
    assert one.stroke == pytest.approx(0.08, rel=1e-3)
    # nine ways in 40 s, the longest of 80 mm
    assert one.peak_velocity == pytest.approx(0.08 * 9.0 / 40.0, rel=0.01)
    assert quantities(one)["K_0 initial"].value == pytest.approx(1e5, rel=0.01)


def test_what_is_cut_off_in_a_whole_record_has_no_interval_either() -> None:
    moved, force = growing((0.01, 0.02, 0.03, 0.04))
    log = recording("g", 0.01, displacement=moved, force=force)
    whole, cut = (row(r) for r in (log, replace(log, findings=(Finding("clipped", "force", None, "damaged"),))))
    assert [q.value for q in cut.quantities] == [q.value for q in whole.quantities]
    assert all((q.low, q.high, q.reason) == (None, None, "damaged") for q in cut.quantities if q.value is not None)
    assert any(q.low is not None for q in whole.quantities)


def test_a_log_without_both_channels_says_what_there_is() -> None:
    moved, _ = GAS.record()
    found = of(recording("a", 0.005, displacement=moved), recording("b", 0.005, velocity=moved), of_rig(GAS, "c"))
    assert [text for _, text in found.left_out] == [
        "a.csv: no force; a sheet takes both, and there are displacement; a channel map names columns",
        "b.csv: no displacement and no force; a sheet takes both, and there are velocity; a channel map names columns",
    ]
    assert [one.recording for one in found.rows] == ["c"]


@pytest.mark.parametrize("end", ["Z", "z"])
def test_a_pattern_names_its_unit_whichever_way_python_writes_its_end(
    end: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = fnmatch.translate
    monkeypatch.setattr(fnmatch, "translate", lambda part: whole(part)[:-1] + end)
    assert unit_of("logs/u7_5Hz.csv", "{unit}_*.csv") == "u7" and unit_of("logs/u7/a.csv", "*/{unit}/*.csv") == "u7"


def test_rows_are_in_the_order_of_their_logs_and_stay_with_their_units() -> None:
    logs = [beside(replace(GAS, frequency=f), name, current=1.0) for name, f in (("b", 4.0), ("a", 2.0))]
    found = of(*logs, units={"a": "one", "b": "other"})
    assert [(r.recording, r.unit, r.condition) for r in found.rows] == [
        ("a", "one", "sine-2Hz-10mm-1A"),
        ("b", "other", "sine-4Hz-10mm-1A"),
    ]
    part = found.of_units(lambda unit: unit == "other")
    assert [r.unit for r in part.rows] == [c.unit for c in part.courses] == [*part.across] == ["other"]
    assert [one.condition for one in part.loops] == ["sine-4Hz-10mm-1A"] and part.left_out == []


def test_what_was_odd_about_a_log_stands_in_its_row() -> None:
    odd = replace(of_rig(GAS), findings=(Finding("clipped", "force", 1.0, "the force is clipped"),))
    assert "the force is clipped" in row(odd).findings


def test_quantities_are_in_the_order_of_the_sheet_with_a_value_or_a_reason() -> None:
    one = row(of_rig(GAS))
    names = [q.name for q in one.quantities]
    assert names == sorted(names, key=[*SHEET_QUANTITIES].index) and len(set(names)) == len(names)
    assert all((q.value is None) == bool(q.reason) and q.unit == SHEET_QUANTITIES[q.name][0] for q in one.quantities)


def test_rebound_is_the_direction_that_is_stated() -> None:
    truth = GAS.truth()["ratio"]
    for rebound, ratio in (("positive", truth), ("negative", 1.0 / truth)):
        assert quantities(row(of_rig(GAS), rebound=rebound))["ratio"].value == pytest.approx(ratio, rel=2e-3)


def test_a_skew_that_is_stated_is_corrected() -> None:
    late = of_rig(replace(GAS, skew=2.0))
    right, wrong = (quantities(row(late, skew=s))["Fd+"].value for s in (2.0 / GAS.rate, 0.0))
    assert right == pytest.approx(GAS.truth()["Fd+"], abs=2e-3 * GAS.truth()["Fmax+"])
    assert wrong is not None and abs(wrong - GAS.truth()["Fd+"]) > 0.05 * GAS.truth()["Fmax+"]


def test_the_mean_loop_is_closed_and_follows_the_law_of_the_damper() -> None:
    [loop] = of(of_rig(GAS)).loops
    assert [one[0] for one in (loop.displacement, loop.velocity, loop.force)] == [
        one[-1] for one in (loop.displacement, loop.velocity, loop.force)
    ]
    assert np.ptp(loop.displacement) == pytest.approx(0.02, rel=2e-3)
    moving = np.abs(loop.velocity) > 0.3 * GAS.speed
    law = GAS.force(loop.displacement, loop.velocity)
    assert loop.force[moving] == pytest.approx(law[moving], abs=0.01 * GAS.truth()["Fmax+"])


def across(found: Measurements) -> dict[str, list[str]]:
    rows: dict[str, list[str]] = {}
    for one in found.across["unit"]:
        rows.setdefault(one.conditions, []).append(one.quantity.name)
    return rows


def test_conditions_of_one_current_have_a_law_over_speed_and_those_of_one_speed_a_range() -> None:
    logs = [beside(GAS, f"a{k}", current=i, condition={"temperature": t}) for k, (i, t) in enumerate(
        ((0.0, 20.0), (1.0, 20.0), (1.0, 60.0)))]  # fmt: skip
    rows = across(of(*logs))
    law = ["C+", "alpha+", "C-", "alpha-"]
    assert rows["all speeds, 0 A"] == law and rows["all speeds, 1 A"] == law
    [ranged] = [name for name, names in rows.items() if names == ["dynamic range"]]
    assert ranged.startswith("sine-2Hz-10mm-1A")
    [faded] = [name for name, names in rows.items() if names == ["fade+", "fade-"]]
    assert "60degC" in faded and faded.endswith(", by temperature")
    assert across(of(beside(GAS)))["all speeds"] == law


@pytest.mark.parametrize("slope", [None, ConfidenceInterval(0.5, 0.0, 1.0)])
def test_an_end_of_an_interval_that_is_open_is_not_written(slope: ConfidenceInterval | None) -> None:
    one = quantity_row(Quantity("E", replace(known(3.0, -np.inf, 4.0), slope=slope)))
    assert (one.value, one.low, one.high, one.noise, one.unit) == (3.0, None, 4.0, None, "J")
    assert one.slope == (0.5 if slope else None)
    assert quantity_row(Quantity("E", None, "one cycle")) == QuantityRow(name="E", unit="J", reason="one cycle")


def test_the_course_over_the_cycles_is_that_of_the_estimate() -> None:
    slope = ConfidenceInterval(-2.0, -3.0, -1.0)
    one = quantity_row(Quantity("E", Estimate(8.0, 7.0, 9.0, 2.0, np.array([10.0, 8.0, 6.0]), 0.5, slope, -4.0)))
    assert (one.cycles, one.noise, one.drift) == ([10.0, 8.0, 6.0], 0.5, -4.0)
    assert (one.slope, one.slope_low, one.slope_high) == (-2.0, -3.0, -1.0)
    assert (one.greatest_deviation, one.first_to_third) == (0.25, pytest.approx(0.4))
