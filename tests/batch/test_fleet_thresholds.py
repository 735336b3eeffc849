"""From how many logs on outliers and drifts are looked for, in which order they are told, and of what."""

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from mrfit.batch.fleet import FEWEST, FEWEST_FOR_DRIFT, LEAST_Z, RESIDUAL, date_of, fleet_of, z_limit
from mrfit.io.schemas.batch import Fitted, LogRow, OfCondition
from tests.batch.test_fleet import row, sound

SPREAD = [99.0] * 20 + [100.0] + [101.0] * 20
"""Values whose median is 100 and whose robust standard deviation is 1.4826, also with as many more at either side."""


@pytest.mark.parametrize(("logs", "listed"), [(FEWEST - 1, 0), (FEWEST, 1)])
def test_outliers_are_looked_for_from_eight_logs_of_a_condition_on(logs: int, listed: int) -> None:
    values = [100.0 + 0.1 * k for k in range(logs - 1)] + [900.0]
    rows = [row(f"{k}.csv", v) for k, v in enumerate(values)]
    assert len(fleet_of(rows).outliers) == listed


@pytest.mark.parametrize(("logs", "listed"), [(FEWEST_FOR_DRIFT - 1, 0), (FEWEST_FOR_DRIFT, 1)])
def test_drifts_are_looked_for_from_twenty_logs_on(logs: int, listed: int) -> None:
    assert len(fleet_of([row(f"{k}.csv", float(k)) for k in range(logs)]).drifts) == listed


@pytest.mark.parametrize(("off", "listed"), [(3.4, False), (3.7, True), (-3.7, True)])
def test_an_outlier_is_beyond_three_and_a_half_robust_standard_deviations(off: float, listed: bool) -> None:
    values = [*SPREAD, 100.0 + 1.4826 * off, 100.0 - np.sign(off)]
    outliers = fleet_of([row(f"{k}.csv", v) for k, v in enumerate(values)]).outliers
    assert [o.log for o in outliers] == ["41.csv"] * listed
    assert not listed or outliers[0].z == pytest.approx(off, rel=1e-9) and outliers[0].median == 100.0


@pytest.mark.parametrize("tests", [200, 5000])
def test_of_many_values_the_limit_is_that_which_one_batch_in_twenty_exceeds(tests: int) -> None:
    assert z_limit(tests) == pytest.approx(stats.norm.isf(0.05 / tests / 2.0)) and z_limit(tests) > LEAST_Z
    assert z_limit(0) == LEAST_Z


def test_values_of_no_scatter_have_no_outlier_and_no_drift() -> None:
    values = [100.0] * 30 + [101.0]
    found = fleet_of([row(f"{k}.csv", v) for k, v in enumerate(values)])
    assert (found.outliers, found.drifts) == ((), ())


def test_the_clearest_outlier_comes_first_and_those_alike_by_their_logs() -> None:
    rows = [row(f"{k}.csv", v) for k, v in enumerate(SPREAD)]
    far = {"c.csv": 130.0, "b.csv": 70.0, "a.csv": 60.0, "d.csv": 150.0}
    found = fleet_of([*rows, *(row(name, v) for name, v in far.items())]).outliers
    assert [o.log for o in found] == ["d.csv", "a.csv", "b.csv", "c.csv"]
    assert [o.z for o in found] == pytest.approx(np.array([50.0, -40.0, -30.0, 30.0]) / 1.4826)


def test_a_drift_is_between_the_medians_of_both_ends_over_the_robust_deviation() -> None:
    values = np.arange(40.0)
    values[1], values[38] = 500.0, -500.0
    [drift] = fleet_of([row(f"{k:02d}.csv", v) for k, v in enumerate(values)]).drifts
    # tenths of four logs, of which one wild value moves the median to the middle of two
    assert (drift.first, drift.last) == (2.5, 36.5)
    deviation = 1.4826 * stats.median_abs_deviation(values)
    assert drift.change == pytest.approx(34.0 / deviation)
    assert drift.correlation == pytest.approx(stats.spearmanr(np.arange(40), values).statistic)


def of_two(log: str, fy: float, c: float) -> LogRow:
    known = [Fitted(parameter=n, value=v, unit=u, low=v - 1.0, high=v + 1.0)
             for n, v, u in (("fy", fy, "N"), ("c", c, "N*s/m"))]  # fmt: skip
    return LogRow(log=log, key="k", tests=[OfCondition(condition="sine", nrmse=0.02, parameters=known)])


def test_the_more_parameters_are_looked_at_the_clearer_a_drift_has_to_be() -> None:
    rng, count = np.random.default_rng(11), 40
    while True:
        # chance that lies between a twentieth and half of it: a drift of one parameter, none of two
        values = 0.2 * np.arange(count) / count + rng.standard_normal(count)
        if 0.026 < stats.spearmanr(np.arange(count), values).pvalue < 0.049:
            break
    other = rng.permutation(values)
    assert stats.spearmanr(np.arange(count), other).pvalue > 0.05
    alone = fleet_of([row(f"{k:02d}.csv", v) for k, v in enumerate(values)])
    both = fleet_of([of_two(f"{k:02d}.csv", v, o) for k, (v, o) in enumerate(zip(values, other, strict=True))])
    assert [d.parameter for d in alone.drifts] == ["fy"] and both.drifts == ()


def test_the_larger_drift_comes_first() -> None:
    faint = np.arange(40.0) - 19.5
    # the same at most logs, and far off at both ends
    clear = faint**3
    for fy, c, order in ((faint, -clear, ["c", "fy"]), (clear, -faint, ["fy", "c"])):
        rows = [of_two(f"{k:02d}.csv", a, b) for k, (a, b) in enumerate(zip(fy, c, strict=True))]
        assert [d.parameter for d in fleet_of(rows).drifts] == order


def test_the_residual_is_that_of_held_out_cycles_where_there_is_one() -> None:
    def of(**errors: Any) -> LogRow:
        return LogRow(log=f"{errors}", key="k", tests=[OfCondition(condition="sine", parameters=[], **errors)])

    [group] = fleet_of([of(nrmse=0.1), of(nrmse=0.1, nrmse_holdout=0.3), of(nrmse_holdout=0.2), of()]).groups
    assert group.parameter == RESIDUAL and group.unit == "" and sorted(group.values) == [0.1, 0.2, 0.3]
    assert list(group.widths) == [0.0] * 3


def test_a_group_knows_its_unit_its_current_and_half_of_its_intervals() -> None:
    def of(log: str, low: float | None, current: float | None, high: float | None = 8.0) -> LogRow:
        own = [Fitted(parameter="fy", value=5.0, unit="N", low=low, high=high)]
        return LogRow(log=log, key="k", tests=[OfCondition(condition=f"at {current}", current=current, parameters=own)])

    known, unknown, half = fleet_of([of("a", 4.0, 1.5), of("b", None, None), of("c", 4.0, 2.0, None)]).groups
    assert (known.unit, known.current, known.widths[0]) == ("N", 1.5, 2.0)
    assert math.isnan(unknown.current) and math.isnan(unknown.widths[0]) and math.isnan(half.widths[0])


def test_residuals_come_after_parameters_and_logs_that_share_a_condition_are_not_apart() -> None:
    together, alone = fleet_of(sound(1, 3)), fleet_of([row("a", 1.0), row("b", 1.0, condition="other")])
    assert [g.parameter for g in together.groups] == ["fy", RESIDUAL] and (together.most, alone.most) == (3, 1)
    # the number of logs is that of the condition which most have
    assert fleet_of([row("a", 1.0), row("b", 1.0), row("c", 1.0, condition="other")]).most == 2
    assert not together.is_apart and alone.is_apart and not fleet_of([]).is_apart and fleet_of([]).most == 0


@pytest.mark.parametrize(
    ("name", "same"),
    [
        # the name of the file comes before that of its folder, and the nearest folder before the others
        ("2026-01-01/2026-02-02/run_2026-03-01.csv", "2026-03-01"),
        ("2026-01-01/2026-03-01/run.csv", "2026-03-01"),
        # what is no day of the calendar is passed over
        ("run_2026-02-30_2026-03-01.csv", "2026-03-01"),
        ("2026.03.01.csv", "2026_03_01"),
        # the year of a second date is no time of day, and a time of day is no year
        ("2026-03-01_2026-03-05.csv", "2026-03-01"),
        ("2026.03.01 2026.03.05.csv", "2026-03-01"),
        ("20240305_2015_30_01.csv", "20240305_20:15:30"),
        ("20260301_202603_15.csv", "2026-03-01 20:26:03"),
        ("2026-03-01 00h00.csv", "2026-03-01"),
        ("2026-03-01T12-30-15.csv", "20260301_12:30:15"),
    ],
)
def test_of_several_dates_one_is_taken(name: str, same: str) -> None:
    assert date_of(name) is not None and date_of(name) == date_of(same)


def test_one_log_without_a_date_puts_all_in_the_order_of_their_names() -> None:
    rows = [row("b_2026-01-01.csv", 1.0), row("a_2026-01-02.csv", 2.0)]
    dated, undated = fleet_of(rows), fleet_of([*rows, row("c.csv", 3.0)])
    assert dated.dated and dated.groups[0].logs == ("b_2026-01-01.csv", "a_2026-01-02.csv")
    assert not undated.dated and undated.groups[0].logs == ("a_2026-01-02.csv", "b_2026-01-01.csv", "c.csv")
