"""What is planted among many logs is found; sound logs list nothing, but for one in twenty batches."""

import numpy as np
import pytest

from mrfit.batch.fleet import LEAST_Z, RESIDUAL, date_of, fleet_of, z_limit
from mrfit.io.schemas.batch import Fitted, LogRow, OfCondition


def row(log: str, value: float, nrmse: float = 0.02, width: float | None = 0.1, condition: str = "sine-1Hz") -> LogRow:
    low, high = (None, None) if width is None else (value - width, value + width)
    parameter = Fitted(parameter="fy", value=value, unit="N", low=low, high=high)
    return LogRow(log=log, key="k", tests=[OfCondition(condition=condition, nrmse=nrmse, parameters=[parameter])])


def sound(seed: int, logs: int = 200) -> list[LogRow]:
    rng = np.random.default_rng(seed)
    return [
        row(f"run-{k}.csv", 500.0 + rng.standard_normal(), 0.02 + 1e-3 * rng.standard_normal()) for k in range(logs)
    ]


def test_a_value_and_a_residual_far_from_the_others_are_listed() -> None:
    rows = sound(1)
    rows[17] = row("run-17.csv", 520.0)
    rows[31] = row("run-31.csv", 500.0, nrmse=0.2)
    found = {(o.log, o.parameter): o.z for o in fleet_of(rows).outliers}
    assert set(found) == {("run-17.csv", "fy"), ("run-31.csv", RESIDUAL)}
    # robust: the sd of the others is 1 N
    assert found["run-17.csv", "fy"] == pytest.approx(20.0, rel=0.2)


def test_a_value_that_its_own_interval_explains_is_none() -> None:
    rows = sound(1)
    rows[17] = row("run-17.csv", 520.0, width=25.0)
    rows[18] = row("run-18.csv", 900.0, width=None)
    assert fleet_of(rows).outliers == ()


def test_a_small_residual_is_none() -> None:
    rows = sound(1)
    rows[31] = row("run-31.csv", 500.0, nrmse=0.001)
    assert fleet_of(rows).outliers == ()


def test_logs_are_compared_within_their_condition() -> None:
    """Twenty logs at another level are no outliers, and one of them may be."""
    other = [row(f"other-{k}.csv", 900.0 + 0.1 * (k % 5), condition="sine-5Hz") for k in range(20)]
    assert fleet_of([*sound(2), *other]).outliers == ()
    other[3] = row("other-3.csv", 500.0, condition="sine-5Hz")
    assert [o.log for o in fleet_of([*sound(2), *other]).outliers] == ["other-3.csv"]


def test_sound_batches_list_values_or_drifts_as_seldom_as_is_said() -> None:
    """Both tests have a level of 1 in 20; of 200 batches 10 each are due, and more than 22 have odds of 1 in 3000."""
    fleets = [fleet_of(sound(seed, 60)) for seed in range(200)]
    # 3.5 sd is beyond what 120 values call for; with a scatter estimated from 60 values it lists somewhat more
    assert sum(bool(f.outliers) for f in fleets) <= 22
    assert sum(bool(f.drifts) for f in fleets) <= 22


def test_a_drift_is_found_in_the_order_of_dates_whatever_the_files_are_called_before_them() -> None:
    rng = np.random.default_rng(4)
    days = rng.permutation(28)
    rows = [
        row(f"{letter}_2026-03-{day + 1:02d}.csv", 500.0 + 0.1 * day + rng.standard_normal() * 0.3)
        for letter, day in zip("abcdefghijklmnopqrstuvwxyz01", days, strict=True)
    ]
    fleet = fleet_of(rows)
    assert fleet.dated and [d.parameter for d in fleet.drifts] == ["fy"]
    drift = fleet.drifts[0]
    assert drift.last - drift.first == pytest.approx(2.5, abs=0.7)
    # by names the same values have no trend
    undated = [row(r.log.replace("2026-03-", "x"), float(r.tests[0].parameters[0].value)) for r in rows]
    assert not fleet_of(undated).dated and fleet_of(undated).drifts == ()


def test_runs_are_in_the_order_of_their_numbers() -> None:
    """run-9 comes before run-10."""
    rng = np.random.default_rng(5)
    rows = [row(f"run-{k}.csv", 0.05 * k + rng.standard_normal() * 0.1) for k in range(120)]
    drift = fleet_of(rows).drifts[0]
    assert drift.correlation > 0.98 and fleet_of(rows).groups[0].logs[9:11] == ("run-9.csv", "run-10.csv")


@pytest.mark.parametrize(
    ("name", "seconds"),
    [
        ("1970-01-02.csv", None),
        ("run_2026-03-01.csv", 1772323200.0),
        ("20260301_1200_a.csv", 1772366400.0),
        ("20260301T120030.csv", 1772366430.0),
        ("2026-03-01/run-7.csv", 1772323200.0),
        ("2026-13-41.csv", None),
        ("run-120260301.csv", None),
        ("run.csv", None),
    ],
)
def test_the_date_in_a_name(name: str, seconds: float | None) -> None:
    assert date_of(name) == seconds


def test_the_limit_grows_with_the_number_of_values() -> None:
    assert z_limit(1) == LEAST_Z
    # 0.05 of a million two-sided: 5.45 by tables of the normal distribution
    assert z_limit(1_000_000) == pytest.approx(5.45, abs=0.01)
