"""Rows of the page of a comparison, and of its table: shares in percent, other changes in their unit."""

from typing import Any

import pytest

from mrfit.drift.analysis import probability_text
from mrfit.drift.page import odd_rows, range_rows, shown, slope_rows, spread_rows, step_rows, table_cells
from mrfit.io.schemas.drift import ChangePoint, DriftFile, ParameterOverUnits, Slope, UnitThatStandsOut

SLOPE = Slope(covariate="cycles", per="1000 cycles", value=-0.05, low=-0.06, high=-0.04, probability=0.001, drifts=True)


def parameter(name: str = "fy", **given: Any) -> ParameterOverUnits:
    about = {"parameter": name, "condition": "sine", "unit": "N", "role": "yield", "logarithmic": True}
    return ParameterOverUnits(**{**about, "units": 5, "tests": 10, **given})


POPULATION = {
    "mean": 500.0, "mean_low": 480.0, "mean_high": 520.0, "between": 0.05, "between_low": 0.03, "between_high": 0.1,
    "tolerance_low": 400.0, "tolerance_high": 620.0, "least": 410.0, "greatest": 600.0,
}  # fmt: skip


def test_a_change_is_a_share_where_the_scale_is_logarithmic_and_in_its_unit_elsewhere() -> None:
    (share,) = slope_rows([parameter(slopes=[SLOPE])])
    assert share[4:] == ("−5.00 %", "−6.00 % to −4.00 %", "0.001000", "yes")
    (plain,) = slope_rows([parameter(slopes=[SLOPE], logarithmic=False)])
    assert plain[4:6] == ("−0.0500 N", "−0.0600 N to −0.0400 N")


def test_parameters_that_drift_come_first_then_the_likeliest() -> None:
    def slope(probability: float, drifts: bool) -> list[Slope]:
        return [Slope(**{**vars(SLOPE), "probability": probability, "drifts": drifts})]

    rows = [parameter(n, slopes=slope(p, d)) for n, p, d in (("a", 0.5, False), ("b", 0.2, False), ("c", 0.04, True))]
    assert [row[0] for row in slope_rows(rows)] == ["c", "b", "a"]
    assert [row[-1] for row in slope_rows(rows)] == ["yes", "no", "no"]


def test_no_probability_is_nought() -> None:
    rows = [parameter(slopes=[Slope(**{**vars(SLOPE), "probability": p})]) for p in (0.0, 2e-6)]
    assert [row[-2] for row in slope_rows(rows)] == ["< 10⁻⁶", "2.000×10⁻⁶"]
    assert [probability_text(p) for p in (0.0, 0.0067)] == ["< 1e-6", "= 0.0067"]


def test_a_step_is_said_where_there_is_one() -> None:
    step = ChangePoint(covariate="cycles", at=5000.0, change=0.1, probability=0.002)
    assert step_rows([parameter(), parameter(change=step)]) == [("fy", "sine", "cycles 5000", "10.0 %", "0.002000")]


def test_units_that_stand_out_are_in_the_order_of_their_distance() -> None:
    def odd(name: str, z: float) -> UnitThatStandsOut:
        return UnitThatStandsOut(specimen=name, value=600.0, z=z, probability=0.001)

    rows = odd_rows([parameter(stands_out=[odd("u1", 4.0)]), parameter("c", stands_out=[odd("u2", -9.0)])])
    assert [row[0] for row in rows] == ["u2", "u1"] and rows[0][3:5] == ("600.0 N", "−9.000")


def test_ranges_need_a_population_and_spreads_tests_of_one_unit() -> None:
    alone, repeated = parameter(), parameter(repeatability=0.01, reproducibility=0.05)
    assert range_rows([alone, repeated]) == [] and spread_rows([alone]) == []
    (row,) = range_rows([parameter(**POPULATION)])
    assert row[4:] == ("500.0 N", "480.0 to 520.0", "5.00 % (3.00 % to 10.0 %)", "400.0 to 620.0")
    (few,) = spread_rows([repeated])
    assert few[2:] == ("1.00 %", "5.00 %", "– N", "– N")
    assert spread_rows([parameter(**POPULATION)])[0][2:] == ("–", "–", "410.0 N", "600.0 N")


@pytest.mark.parametrize(
    ("value", "text"), [(None, "–"), (float("nan"), "–"), (0.0, "0"), (1234.5, "1234"), (-1e-9, "−1.000×10⁻⁹")]
)
def test_numbers_as_the_page_has_them(value: Any, text: str) -> None:
    assert shown(value) == text


def test_the_table_has_a_row_for_every_covariate_and_one_for_none() -> None:
    odd = UnitThatStandsOut(specimen="u2", value=600.0, z=9.0, probability=0.001)
    rows = [parameter(slopes=[SLOPE, SLOPE], stands_out=[odd, odd]), parameter("c", **POPULATION)]
    whole = DriftFile(
        over=["cycles"], unit="", at="", draws=0, seed=0, units=5, tests=10, parameters=rows, causes=[], notes=[]
    )
    first, second, third = table_cells(whole)
    assert first == second and first["covariate"] == "cycles" and first["change_low"] == -0.06 and first["drifts"]
    assert first["units_that_stand_out"] == "u2; u2" and "covariate" not in third
    assert third["parameter"] == "c" and third["mean"] == 500.0 and third["units_that_stand_out"] == ""
