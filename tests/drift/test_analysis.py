"""What drifts is found and named alone, and nothing is where nothing does."""

from pathlib import Path

import numpy as np
import pytest

import mrfit
from mrfit.drift.page import BAND_POINTS, _mean_of, range_rows
from mrfit.io.schemas.drift import DriftFile
from tests.drift.fleets import MEANS, fleet

UNITS, TESTS = 10, 5
LIFE = np.tile(np.linspace(0.0, 20000.0, TESTS), UNITS)


def compared(
    changes: list[tuple[str, str, float]], over: str = "cycles", seed: int = 1, **columns: object
) -> DriftFile:
    rng = np.random.default_rng(seed)
    table = fleet(rng, UNITS, TESTS, changes=changes, columns={"cycles": LIFE, **columns})  # type: ignore[dict-item]
    return mrfit.drift(table, over=over.split(","), unit="{unit}_*").content


def drifting(found: DriftFile) -> set[tuple[str, str]]:
    return {(r.parameter, s.covariate) for r in found.parameters for s in r.slopes if s.drifts}


def test_a_drift_is_found_alone_with_its_size_and_its_cause() -> None:
    found = compared([("fy", "cycles", 0.03)])
    assert (found.units, found.tests) == (UNITS, UNITS * TESTS) and drifting(found) == {("fy", "cycles")}
    (slope,) = next(r for r in found.parameters if r.parameter == "fy").slopes
    assert slope.per == "1000 cycles" and slope.low <= np.expm1(0.03 / 20.0) <= slope.high
    assert [c.effect for c in found.causes] == ["seal friction"]
    assert [c.effect for c in compared([("f0", "cycles", -0.05)]).causes] == ["pressure loss"]


@pytest.mark.parametrize("covariate", ["current", "frequency", "amplitude", "voltage", "temperature"])
def test_what_follows_a_condition_of_the_test_is_no_ageing(covariate: str) -> None:
    for change in [("fy", covariate, 0.5), ("c", covariate, -0.5), ("f0", covariate, 0.5)]:
        found = compared([change], covariate, **{covariate: LIFE / 2e4})
        assert (change[0], covariate) in drifting(found)
        assert [c.effect for c in found.causes] == ["none named"]
    # the damper warms with the current: still no drift
    warm = 25.0 + LIFE / 1000.0 + np.random.default_rng(7).uniform(-6.0, 6.0, UNITS * TESTS)
    both = compared(
        [("fy", "temperature", -0.08), ("c", "temperature", -0.2)], "current", current=LIFE, temperature=warm
    )
    assert [c.effect for c in both.causes] == ["none named"]


def test_a_condition_that_differs_and_is_no_covariate_is_said() -> None:
    rng = np.random.default_rng(3)
    frequency, current = rng.permutation(LIFE / 2e4 + 0.5), rng.permutation(LIFE / 2e4)
    assert compared([], "frequency", frequency=frequency, current=current).notes == [
        "current differs between these tests, 0 to 1 A, and counts as scatter between units: "
        "add it by --over frequency,current",
        "all: means and tolerances are at the mean of the covariates, frequency 1 Hz",
    ]
    for over, more in (("frequency,current", current), ("frequency", 1.0 + 0.001 * current), ("cycles", current)):
        (where,) = compared([], over, frequency=frequency, current=more).notes
        assert "at the mean of the covariates" in where and ("current 0.5 A" in where) == ("current" in over)


def test_logs_that_count_as_units_are_said_where_a_covariate_is_followed() -> None:
    table = fleet(np.random.default_rng(3), UNITS, 1, columns={"cycles": np.arange(float(UNITS))})
    notes = [" ".join(mrfit.drift(table, over=over).content.notes) for over in (["cycles"], [])]
    said = ["every log counts as a unit" in text for text in notes]
    assert said == [True, False]


def test_variances_that_exceed_the_scatter_of_units_are_said() -> None:
    def found(known: float) -> DriftFile:
        table = fleet(np.random.default_rng(4), 6, between=0.001, known=known)
        # stated far larger than they are
        table["covariance"] = [100.0**2 * matrix for matrix in table["covariance"]]
        return mrfit.drift(table).content

    vague, sharp = found(0.01), found(1e-6)
    assert "sine, fy: the fits state larger variances than the units scatter" in " ".join(vague.notes)
    assert {cells[6] for cells in range_rows(vague.parameters)} == {"not told"}
    assert sharp.notes == []
    assert "not told" not in {cells[6] for cells in range_rows(sharp.parameters)}


def test_nothing_drifts_where_nothing_does() -> None:
    found = compared([])
    assert not drifting(found) and not found.causes and not any(r.change for r in found.parameters)


def test_a_drift_that_is_the_temperature_s_is_called_so() -> None:
    warm = 25.0 + LIFE / 1000.0 + np.random.default_rng(7).uniform(-6.0, 6.0, UNITS * TESTS)
    changes = [("fy", "temperature", -0.08), ("c", "temperature", -0.2)]
    both = compared(changes, "cycles,temperature", temperature=warm)
    assert drifting(both) == {("fy", "temperature"), ("c", "temperature")}
    assert [c.effect for c in both.causes] == ["temperature"]
    alone = compared(changes, temperature=warm)
    assert drifting(alone) == {("fy", "cycles"), ("c", "cycles")}
    assert [c.effect for c in alone.causes] == ["temperature"] and "nothing is left" in alone.causes[0].text
    worn = compared([("fy", "cycles", -0.08), ("c", "cycles", -0.2)], temperature=warm)
    assert [c.effect for c in worn.causes] == ["none named"]


def test_a_step_is_told_from_a_drift() -> None:
    stepped = compared([("c", "worn", 0.05)], worn=(LIFE > 12000.0).astype(float))
    (row,) = [r for r in stepped.parameters if r.change]
    assert row.parameter == "c" and row.change and 10000.0 < row.change.at < 15000.0
    assert row.change.change == pytest.approx(np.expm1(0.05), abs=0.01)
    assert not any(r.change for r in compared([("c", "cycles", 0.05)]).parameters)


def test_repeatability_is_told_from_reproducibility() -> None:
    rng = np.random.default_rng(9)
    table = fleet(rng, 40, 4, between=0.06, within=0.02, known=0.005)
    rows = mrfit.drift(table, unit="{unit}_*").content.parameters
    assert {r.parameter for r in rows} == set(MEANS)
    for r in rows:
        scale = 1.0 if r.logarithmic else MEANS[r.parameter]
        assert r.repeatability == pytest.approx(0.02 * scale, rel=0.25)
        assert r.reproducibility == pytest.approx(np.hypot(0.06, 0.02) * scale, rel=0.25)
        assert r.between_low is not None and r.between_high is not None
        assert r.between_low < 0.06 * scale < r.between_high


def test_what_cannot_be_judged_is_said() -> None:
    table = fleet(np.random.default_rng(1), 3, columns={"cycles": np.zeros(3)})
    found = mrfit.drift(table, over=["cycles"]).content
    assert found.notes[0] == "sine: cycles does not move by itself in 4 tests or more"
    with pytest.raises(mrfit.ConfigError, match="--over colour: no fit states it; there are cycles"):
        mrfit.drift(table, over=["colour"])
    with pytest.raises(mrfit.DataError, match="no column value"):
        mrfit.drift(table.drop(columns="value"))


def test_a_unit_that_stands_out_takes_no_part_in_the_others() -> None:
    table = fleet(np.random.default_rng(5), UNITS, TESTS, columns={"cycles": LIFE})
    sound = mrfit.drift(table, over="cycles", unit="{unit}_*").content
    own = (table["parameter"] == "c") & table["log"].str.startswith("u003")
    table.loc[own, "value"] *= 1.6
    found = mrfit.drift(table, over="cycles", unit="{unit}_*").content
    row, before = (next(r for r in f.parameters if r.parameter == "c") for f in (found, sound))
    assert [o.specimen for o in row.stands_out] == ["u003"] and not before.stands_out
    assert row.reproducibility is not None and before.reproducibility is not None
    assert row.reproducibility == pytest.approx(before.reproducibility, rel=0.4)
    assert row.mean == pytest.approx(before.mean, rel=0.02)


def test_bounds_hold_over_the_whole_life() -> None:
    (row,) = [r for r in compared([("f0", "cycles", 0.5)]).parameters if r.parameter == "f0"]
    still = next(r for r in compared([]).parameters if r.parameter == "f0")
    assert row.greatest and row.least and still.greatest and still.least
    # it rises by 10 N over the life, 5 N to either side of the middle, at which its tolerance interval is
    assert row.greatest - still.greatest == pytest.approx(10.0, abs=1.0)
    assert row.least == pytest.approx(still.least, abs=1.0)
    assert row.tolerance_high and row.greatest > row.tolerance_high


def test_the_axis_of_units_far_apart_is_logarithmic_with_plain_numbers(tmp_path: Path) -> None:
    mrfit.drift(fleet(np.random.default_rng(2), 6, between=1.5)).save(tmp_path)
    page = (tmp_path / "drift.html").read_text(encoding="utf-8")
    assert ">1000<" in page and "mathdefault" not in page


def test_bands_of_a_trend_are_those_of_its_row() -> None:
    table = fleet(np.random.default_rng(3), 8, columns={"cycles": np.linspace(0.0, 2e4, 8)})
    for trend in mrfit.drift(table, over=["cycles"]).trends:
        assert trend.population
        found, half = _mean_of(trend, np.full(BAND_POINTS, trend.values.mean()))  # type: ignore[misc]
        low, high = trend.population.mean_interval
        assert half == pytest.approx((high - low) / 2.0) and low < found[0] < high
        _, ends = _mean_of(trend, np.linspace(0.0, 2e4, BAND_POINTS))  # type: ignore[misc]
        assert ends[0] > 1.2 * half[0] and ends[-1] > 1.2 * half[0]
