"""Every reason to distrust a result has a name, and conditions with the same reason share one wording."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrfit.core.specs import DerivedQuantity, ModelSpec, Param, PassiveRange
from mrfit.fit.diagnostics.bootstrap import BootstrapInterval
from mrfit.fit.diagnostics.uncertainty import Uncertainty
from mrfit.fit.result import NO_LIMITS, derived_rows, warnings_of, with_intervals
from mrfit.io.schemas.determined import State
from mrfit.io.schemas.fit import MetricRow, Passivity, Quantity, Repeats, ResidualTest, Result
from mrfit.search.cube import Cube
from mrfit.simulate.assembly import Assembly

PARAMETER = Quantity(name="n", value=1.5, low=1.0, high=2.0)
TESTED = ResidualTest(
    channel="current",
    condition="a",
    correlation=0.1,
    lag=3,
    limit=0.2,
    dependent=0,
    conditions=1,
    independent=True,
)
SOUND = Result(
    condition="a",
    parameters=[PARAMETER],
    evaluations=500,
    starts=[1.0, 1.0],
    agreeing=2,
    passivity=[Passivity(condition="a", loop_area=0.1, passive=True)],
    residual_tests=[TESTED],
)
TRAINING = MetricRow(condition="all", role="train", samples=9, nrmse=0.01, rmse=3.0, noise_floor=1.0, fit_percent=96.0)
METRICS = [TRAINING]
APART = Repeats(condition="a", segments=2, difference=9.0, noise_floor=1.0, moved=5.0, agree=False)


def kinds(change: dict[str, Any], metrics: list[MetricRow] = METRICS) -> list[str]:
    return [w.kind for w in warnings_of(replace(SOUND, **change), metrics)]


def test_a_sound_result_has_no_warning() -> None:
    assert kinds({}) == []


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"parameters": [replace(PARAMETER, at_bound=True)]}, "at-bound"),
        ({"parameters": [replace(PARAMETER, identifiable=False)]}, "not-identifiable"),
        ({"nonfinite": 3}, "non-finite"),
        ({"budget_spent": True}, "budget-spent"),
        ({"agreeing": 1}, "starts-disagree"),
        ({"passivity": [Passivity(condition="a", loop_area=-0.1, passive=False)]}, "not-passive"),
        ({"repeats": [APART]}, "repeats-disagree"),
        ({"residual_tests": [replace(TESTED, independent=False)]}, "input-residual"),
    ],
)
def test_each_fault_has_its_warning(change: dict[str, Any], kind: str) -> None:
    assert kinds(change) == [kind]


def test_what_is_read_instead_tells_of_what_is_not_determined() -> None:
    names = ("c.i0", "c(0..1A).i1", "alpha.i1", "yield_force")
    derived = [replace(PARAMETER, name=name, low=1.49, high=1.51) for name in names]
    unknown = replace(PARAMETER, name="alpha@0A", identifiable=False)
    parameters = [unknown, replace(PARAMETER, name="c@0A")]
    (warning,) = warnings_of(replace(SOUND, parameters=parameters, derived=derived), METRICS)
    assert warning.text == "the data do not determine alpha@0A one by one; read alpha.i1, yield_force instead"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"dependent": 1}, "correlated with current (correlation 0.90 at 3 samples, by chance 0.20): the model"),
        (
            {"dependent": 2, "conditions": 5},
            "correlated with current in 2 of 5 conditions, most on a (correlation 0.90",
        ),
        (
            {"conditions": 5, "condition": "all"},
            "correlated with current, over all 5 conditions together (correlation 0.90",
        ),
    ],
)
def test_the_condition_in_which_the_residual_goes_most_with_an_input_is_said(
    change: dict[str, Any], words: str
) -> None:
    row = replace(TESTED, correlation=0.9, independent=False, **change)
    (warning,) = warnings_of(replace(SOUND, residual_tests=[row]), METRICS)
    assert words in warning.text


def test_an_error_that_grows_on_held_out_data_is_a_warning() -> None:
    held = replace(TRAINING, role="holdout", nrmse=0.02, rmse=6.0)
    assert kinds({}, [*METRICS, held]) == ["holdout-worse"]
    # a smaller range alone, or more noise alone, is none
    assert kinds({}, [*METRICS, replace(held, rmse=3.0)]) == []
    assert kinds({}, [*METRICS, replace(held, noise_floor=2.0)]) == []
    # without a floor the range has to do
    assert kinds({}, [*METRICS, replace(held, noise_floor=float("nan"))]) == ["holdout-worse"]


def test_an_error_no_less_than_a_constants_is_a_warning() -> None:
    assert kinds({}, [replace(TRAINING, fit_percent=4.0)]) == ["explains-nothing"]
    assert kinds({}, [replace(TRAINING, fit_percent=-20.0)]) == ["explains-nothing"]
    assert kinds({}, [replace(TRAINING, fit_percent=6.0)]) == []
    # of a constant output, or a simulation that diverged, there is none
    assert kinds({}, [replace(TRAINING, fit_percent=float("nan"))]) == []


def derived_row(value: float, width: float, role: str = "", ranges: Mapping[str, float] = NO_LIMITS) -> Quantity:
    """The row of a quantity 3·a of a parameter a between -10 and 10, whose interval in the cube is so wide."""
    place = (value / 3.0 + 10.0) / 20.0
    params = (Param("a", "N", -10.0, 10.0, 0.0),)
    spec = ModelSpec(
        "m", "m", "", "", ("velocity",), "force", params, derived=(DerivedQuantity("three", "N", role=role),)
    )
    assembly = Assembly("m", spec, lambda *_: np.empty(0), lambda theta: 3.0 * theta, lambda *_: {})
    spread = width / 60.0 / 2.0 / 1.96
    found = Uncertainty(np.array([[spread**2]]), np.eye(1), np.array([False]), np.array([spread]), np.ones(1), 1e9)
    (row,) = derived_rows(assembly, Cube(spec.params, np.array([0])), np.array([place]), found, ranges)
    return row


@pytest.mark.parametrize(("role", "state"), [("offset", State.WELL), ("", State.POORLY)])
def test_a_derived_offset_near_zero_is_judged_by_the_range_that_it_adds_to(role: str, state: State) -> None:
    assert derived_row(1.0, 9.0, role, {"N": 500.0}).determined is state
    assert derived_row(1.0, 11.0, role, {"N": 500.0}).determined is State.POORLY


@pytest.mark.parametrize(
    ("value", "width", "determined"),
    [(28.0, 55.0, True), (29.0, 61.0, False), (1.0, 14.0, True), (1.0, 16.0, False), (-2.0, 55.0, False)],
)
def test_a_derived_quantity_is_determined_by_the_rule_of_parameters(
    value: float, width: float, determined: bool
) -> None:
    row = derived_row(value, width)
    assert row.identifiable == determined
    assert (row.low is not None) == determined == (row.high is not None)
    if determined:
        assert row.high - row.low == pytest.approx(width, rel=1e-3)


@pytest.mark.parametrize("change", [{"budget_spent": True}, {"nonfinite": 1}])
def test_wording_does_not_depend_on_counts(change: dict[str, Any]) -> None:
    texts = {
        w.text
        for n in (500, 900)
        for w in warnings_of(
            replace(SOUND, **{**change, "evaluations": n, "nonfinite": change.get("nonfinite", 0) * n}), METRICS
        )
    }
    assert len(texts) == 1


@pytest.mark.parametrize(("out_of_time", "remedy"), [(False, "--budget"), (True, "--seconds")])
def test_what_ended_a_search_is_what_to_raise(out_of_time: bool, remedy: str) -> None:
    (warning,) = warnings_of(replace(SOUND, budget_spent=True, out_of_time=out_of_time), METRICS)
    assert warning.text.endswith(f"raise {remedy}")


def test_what_would_keep_a_model_passive_is_said_where_it_is_known() -> None:
    active = replace(SOUND, passivity=[Passivity(condition="a", loop_area=-0.1, passive=False)])
    texts = [warnings_of(active, METRICS, passive)[0].text for passive in (PassiveRange("A", 1.0, 1.5), None)]
    assert texts[0] == f"{texts[1]}; it cannot with --bounds A=1:1.5"


@pytest.mark.parametrize(("spent", "remedy"), [(False, "--seed"), (True, "raise --budget")])
def test_starts_that_disagree_ask_for_more_of_what_ran_out(spent: bool, remedy: str) -> None:
    said = warnings_of(replace(SOUND, agreeing=1, budget_spent=spent, out_of_time=False), METRICS)
    assert remedy in next(w.text for w in said if w.kind == "starts-disagree")


def test_a_search_without_starts_cannot_disagree() -> None:
    assert kinds({"starts": None, "agreeing": 0}) == []


@pytest.mark.parametrize(("low", "high", "known"), [(1.5, 2.5, True), (1.5, None, True), (None, None, False)])
def test_other_intervals_replace_those_there_are_and_one_end_is_something(
    low: float | None, high: float | None, known: bool
) -> None:
    fixed = replace(PARAMETER, name="A", fixed=True)
    rows = with_intervals([PARAMETER, fixed], {"n": BootstrapInterval(low, high), "A": BootstrapInterval(0.0, 1.0)})
    assert (rows[0].low, rows[0].high, rows[0].identifiable) == (low, high, known)
    assert rows[1] == fixed
