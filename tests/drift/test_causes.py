"""Candidates behind drifts by the roles of what drifts, corrected probabilities, and what a trend takes part of."""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.drift.analysis import (
    FORESEEN_LEVEL,
    Trend,
    _causes,
    _fitted,
    _holm,
    _levels,
    _slope,
    _trends,
    compare,
)
from mrfit.drift.mixed import MixedFit
from mrfit.drift.source import FitValue
from mrfit.io.schemas.drift import ParameterOverUnits, Slope
from mrfit.settings.drift import Settings


def value(log: str = "u", y: float = 1.0, variance: float = 0.01, **covariates: float) -> FitValue:
    return FitValue(log, log.partition("_")[0], "sine", "fy", "N", "yield", y, variance, False, covariates)


def trend(*rows: FitValue) -> Trend:
    names = tuple(dict.fromkeys(r.specimen for r in rows))
    units = np.array([names.index(r.specimen) for r in rows])
    return Trend(rows, (), np.empty((len(rows), 0)), units, names)


def moved(role: str, change: float, covariate: str, probability: float, drifts: bool = True) -> ParameterOverUnits:
    """A parameter of a role that has changed."""
    slope = Slope(covariate=covariate, per="", value=change, low=0.0, high=0.0, probability=probability, drifts=drifts)
    about: dict[str, Any] = {"condition": "sine", "unit": "N", "logarithmic": False, "units": 3, "tests": 9}
    return ParameterOverUnits(parameter=f"a {role}", role=role, slopes=[slope], **about)


def causes(*rows: ParameterOverUnits) -> list[tuple[str, str]]:
    return [(c.effect, c.text) for c in _causes(rows, [trend(value())] * len(rows))]


@pytest.mark.parametrize(
    ("changes", "effect", "why"),
    [
        ({"yield": 0.1}, "seal friction", "friction rises alone"),
        ({"yield": -0.1}, "none named", "no rule knows"),
        ({"viscous": -0.1}, "thinner fluid", "the viscous part falls alone"),
        ({"viscous": 0.1}, "none named", "no rule knows"),
        ({"offset": 0.1}, "pressure loss", "the offset of the force moves alone"),
        ({"offset": -0.1}, "pressure loss", "the offset of the force moves alone"),
        ({"offset": -0.1, "yield": 0.1}, "none named", "no rule knows"),
        ({"viscous": -0.1, "yield": 0.1}, "none named", "no rule knows"),
        ({"viscous": -0.1, "yield": -0.1}, "none named", "no rule knows"),
        ({"shape": 0.1}, "none named", "no rule knows"),
    ],
)
@pytest.mark.parametrize("covariate", ["cycles", "energy", "date", "age", "hours", "distance"])
def test_ageing_is_named_by_what_moves_alone(changes: dict[str, float], effect: str, why: str, covariate: str) -> None:
    [(found, text)] = causes(*(moved(role, change, covariate, 1e-4) for role, change in changes.items()))
    assert found == effect and text.startswith(why) and f"of {len(changes)} quantities over {covariate}" in text
    assert all(f"a {r} ({'rises' if c > 0 else 'falls'}, p = 0.0001)" in text for r, c in changes.items())


@pytest.mark.parametrize(
    ("covariate", "why"),
    [
        ("current", "current is a condition of the test, which says nothing of ageing"),
        ("frequency", "frequency is a condition of the test"),
        ("voltage", "no rule knows this pattern"),
        ("temperature", "no rule knows this pattern"),
    ],
)
def test_over_what_counts_no_use_nothing_is_named(covariate: str, why: str) -> None:
    for row in (moved("yield", 0.1, covariate, 1e-4), moved("viscous", -0.1, covariate, 1e-4)):
        [(effect, text)] = causes(row)
        assert effect == "none named" and text.startswith(why)


@pytest.mark.parametrize(
    ("yielding", "viscous", "effect"),
    [(-0.1, -0.2, "temperature"), (0.1, 0.2, "temperature"), (0.1, -0.2, "none named")],
)
def test_yield_and_viscous_parts_that_move_together_with_the_temperature_are_its(
    yielding: float, viscous: float, effect: str
) -> None:
    [(found, _)] = causes(moved("yield", yielding, "temperature", 1e-4), moved("viscous", viscous, "temperature", 1e-4))
    assert found == effect


@pytest.mark.parametrize(
    ("probability", "change", "together"),
    [
        (0.8 * FORESEEN_LEVEL, -0.1, True),
        # its own test is one, not of many; beyond it or against the other it is chance
        (1.2 * FORESEEN_LEVEL, -0.1, False),
        (0.8 * FORESEEN_LEVEL, 0.1, False),
    ],
)
def test_a_part_that_is_foreseen_to_follow_the_temperature_takes_less_proof(
    probability: float, change: float, together: bool
) -> None:
    named, other = (
        moved("viscous", -0.2, "temperature", 1e-4),
        moved("yield", change, "temperature", probability, False),
    )
    [(effect, text)] = causes(named, other)
    assert (effect == "temperature") == together == ("a yield" in text)
    # over cycles nothing is foreseen, and a part that only is foreseen names nothing
    [(_, alone)] = causes(moved("viscous", -0.2, "cycles", 1e-4), moved("yield", change, "cycles", probability, False))
    assert "a yield" not in alone and causes(other) == []


def test_conditions_and_covariates_have_causes_of_their_own() -> None:
    rows = [moved("yield", 0.1, "cycles", 1e-4), moved("offset", 0.1, "date", 1e-4)]
    rows.append(replace(moved("viscous", -0.1, "cycles", 1e-4), condition="other"))
    found = [*_causes(rows, [trend(value())] * 3)]
    assert [(c.condition, c.effect) for c in found] == [
        ("sine", "seal friction"),
        ("sine", "pressure loss"),
        ("other", "thinner fluid"),
    ]
    assert "of 2 quantities over cycles" in found[0].text and "of 1 quantities" in found[2].text


@pytest.mark.parametrize(
    ("given", "adjusted"),
    [
        ([0.01, 0.04, 0.03], [0.03, 0.06, 0.06]),
        # never less than one that is clearer, never above 1
        ([0.02, 0.021], [0.04, 0.04]),
        ([0.6, 0.7, 0.9], [1.0, 1.0, 1.0]),
        ([0.2], [0.2]),
        ([], []),
    ],
)
def test_probabilities_are_those_of_holm(given: list[float], adjusted: list[float]) -> None:
    assert _holm(np.array(given)) == pytest.approx(adjusted)


def numbered(columns: dict[str, Array], over: tuple[str, ...]) -> Trend:
    count = len(next(iter(columns.values())))
    rows = [value(f"u{k}", float(k), **{n: float(c[k]) for n, c in columns.items()}) for k in range(count)]
    [found] = _trends(rows, over)
    return found


@pytest.mark.parametrize(
    ("tests", "used", "wanted"), [(3, (), ["a 4", "b 4"]), (4, ("a",), ["b 5"]), (5, ("a", "b"), [])]
)
def test_each_covariate_takes_a_test_more_than_those_used(tests: int, used: tuple[str, ...], wanted: list[str]) -> None:
    rng = np.random.default_rng(1)
    found = numbered({"a": rng.standard_normal(tests), "b": rng.standard_normal(tests)}, ("a", "b"))
    assert found.covariates == used and found.values.shape == (tests, len(used))
    said = [re.search(r": (.) does not move by itself in (\d) tests or more", note) for note in found.notes]
    assert [f"{one[1]} {one[2]}" for one in said if one] == wanted


def test_a_covariate_that_stays_takes_no_test_from_the_next() -> None:
    found = numbered({"a": np.ones(4), "b": np.array([1.0, 3.0, 2.0, 7.0])}, ("a", "b"))
    assert found.covariates == ("b",)


def test_a_covariate_that_follows_another_or_stays_is_left_out() -> None:
    a = np.array([1.0, 2.0, 4.0, 8.0, 9.0, 11.0, 12.0])
    found = numbered({"a": a, "b": 3e5 * a + 7e6, "c": np.ones(7), "d": a**2}, ("a", "b", "c", "d"))
    assert found.covariates == ("a", "d")
    assert [n.split()[1] for n in found.notes] == ["b", "c"]


def test_a_test_without_its_covariate_takes_no_part() -> None:
    rows = [value(f"u{k}", a=float(k)) for k in range(4)] + [value("x")]
    [found] = _trends(rows, ("a",))
    assert [r.log for r in found.rows] == ["u0", "u1", "u2", "u3"] and found.names == ("u0", "u1", "u2", "u3")
    assert found.notes == ("sine, fy: 1 test without covariates",)
    # logarithms and plain values of one name are not of one scale
    assert len([*_trends([*rows, replace(rows[0], log_scale=True)], ())]) == 2


@pytest.mark.parametrize(
    ("units", "places", "own"),
    [
        ("aaabbbccc", [0, 1, 2] * 3, True),
        ("aaabbbcc", [0, 1, 2, 0, 1, 2, 0, 1], False),
        # three tests of which two are at one place
        ("aaabbbccc", [0, 1, 2, 0, 1, 2, 0, 1, 1], False),
        ("abcdefghi", [0, 1, 2] * 3, False),
        ("aaaaaaaaa", [0, 1, 2] * 3, False),
    ],
)
def test_units_have_a_drift_of_their_own_where_three_have_three_places_each(
    units: str, places: list[int], own: bool
) -> None:
    rows = [value(f"{u}_{k}", a=float(p)) for k, (u, p) in enumerate(zip(units, places, strict=True))]
    [found] = _trends(rows, ("a",))
    assert found.random_slope is own and found.repeated is (1 < len({*units}) < len(units))


@pytest.mark.parametrize(("tests", "fitted"), [(2, False), (3, True)])
def test_a_mixed_model_takes_three_tests(tests: int, fitted: bool) -> None:
    assert (_fitted(trend(*(value(f"u{k}", float(k)) for k in range(tests)))).fitted is not None) == fitted


def test_the_level_of_a_unit_is_at_the_mean_of_the_covariates_and_weighs_its_tests() -> None:
    spec = (("a_0", 1.0, 0.01, 0.0), ("a_1", 2.0, 0.09, 2.0), ("b_0", 5.0, 0.04, 1.0), ("c_0", 6.0, 0.04, 1.0))
    rows = [value(log, y, c, x=place) for log, y, c, place in spec]
    [own] = _trends(rows, ("x",))
    fit = MixedFit(np.array([0.0, 0.5]), np.ones(2), np.ones(2), np.array([0.01, 1.0]), np.ones(2), np.eye(2))
    levels, variances = _levels(replace(own, fitted=fit))
    weights = np.array([1.0 / 0.02, 1.0 / 0.10])
    # the covariate is 1 in the mean: 0.5 more and 0.5 less
    assert levels == pytest.approx([np.average([1.5, 1.5], weights=weights), 5.0, 6.0])
    assert variances == pytest.approx([1.0 / weights.sum(), 0.05, 0.05])


def slope_of(covariate: str, log: bool, differ: float | None = None) -> Slope:
    rows = tuple(replace(value(f"u{k}"), log_scale=log) for k in range(3))
    components = np.array([0.1, 0.1] if differ is None else [0.1, 0.1, differ**2])
    fit = MixedFit(np.array([0.0, 2e-4]), np.array([1.0, 1e-5]), np.array([2.0, 4.0]), components,
                   np.ones(len(components)), np.eye(2))  # fmt: skip
    own = replace(trend(*rows), covariates=(covariate,), values=np.arange(3.0)[:, None], fitted=fit)
    return _slope(own, 0, 0.004)


def test_a_change_is_told_per_step_of_its_covariate_with_student_s_interval() -> None:
    # 0.975 quantile of Student's t of four degrees of freedom: 2.776
    one = slope_of("cycles", log=False)
    assert (one.per, one.value) == ("1000 cycles", pytest.approx(0.2))
    assert (one.low, one.high) == pytest.approx((0.2 - 2.776 * 0.01, 0.2 + 2.776 * 0.01), rel=1e-3)
    assert one.drifts and one.units_differ is None
    share = slope_of("cycles", log=True)
    assert share.value == pytest.approx(math.exp(0.2) - 1.0) and share.high == pytest.approx(
        math.expm1(0.22776), rel=1e-3
    )
    assert (slope_of("voltage", log=False).per, slope_of("voltage", log=False).value) == ("unit of voltage", 2e-4)
    assert slope_of("cycles", log=False, differ=3e-5).units_differ == pytest.approx(0.03)


def test_doubts_of_fits_and_units_without_a_pattern_are_noted_once() -> None:
    rows = [replace(value(f"u{k}", 300.0 + k, cycles=float(k * k)), doubts=("a is outdated",)) for k in range(5)]
    plain, named = (compare(rows, Settings(over=("cycles",), unit=unit))[0] for unit in ("", "{unit}"))
    assert plain.notes.count("a is outdated") == 1 and plain.units == plain.tests == 5
    assert "every log counts as a unit; --unit says which logs are of one" in plain.notes
    assert not any("counts as a unit" in note for note in named.notes)
    assert "sine: means and tolerances are at the mean of the covariates, cycles 6" in plain.notes
