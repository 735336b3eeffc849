"""Every reason to distrust a result has a name, and conditions with the same reason share one wording."""

from typing import Any

import pytest

from mrfit.fit.bootstrap import Interval
from mrfit.fit.result import warnings_of, with_intervals

PARAMETER = {"name": "n", "at_bound": False, "identifiable": True, "fixed": False, "low": 1.0, "high": 2.0}
SOUND: dict[str, Any] = {
    "parameters": [PARAMETER],
    "derived": [],
    "nonfinite": 0,
    "budget_spent": False,
    "out_of_time": False,
    "evaluations": 500,
    "starts": [1.0, 1.0],
    "agreeing": 2,
    "passivity": [{"condition": "a", "loop_area": 0.1, "passive": True}],
    "residual_tests": [{"channel": "current", "correlation": 0.1, "lag": 0, "limit": 0.2, "independent": True}],
}
METRICS = [{"condition": "all", "role": "train", "nrmse": 0.01, "rmse": 3.0, "noise_floor": 1.0}]


def kinds(change: dict[str, Any], metrics: list[dict[str, Any]] = METRICS) -> list[str]:
    return [w["kind"] for w in warnings_of({**SOUND, **change}, metrics)]


def test_a_sound_result_has_no_warning() -> None:
    assert kinds({}) == []


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"parameters": [{**PARAMETER, "at_bound": True}]}, "at-bound"),
        ({"parameters": [{**PARAMETER, "identifiable": False}]}, "not-identifiable"),
        ({"nonfinite": 3}, "non-finite"),
        ({"budget_spent": True}, "budget-spent"),
        ({"agreeing": 1}, "starts-disagree"),
        ({"passivity": [{"condition": "a", "loop_area": -0.1, "passive": False}]}, "not-passive"),
        ({"residual_tests": [{**SOUND["residual_tests"][0], "independent": False}]}, "input-residual"),
    ],
)
def test_each_fault_has_its_warning(change: dict[str, Any], kind: str) -> None:
    assert kinds(change) == [kind]


def test_an_error_that_grows_on_held_out_data_is_a_warning() -> None:
    held = {"condition": "all", "role": "holdout", "nrmse": 0.02, "rmse": 6.0, "noise_floor": 1.0}
    assert kinds({}, [*METRICS, held]) == ["holdout-worse"]
    # a smaller range alone, or more noise alone, is none
    assert kinds({}, [*METRICS, {**held, "rmse": 3.0}]) == []
    assert kinds({}, [*METRICS, {**held, "noise_floor": 2.0}]) == []
    # without a floor the range has to do
    assert kinds({}, [*METRICS, {**held, "noise_floor": float("nan")}]) == ["holdout-worse"]


@pytest.mark.parametrize("change", [{"budget_spent": True}, {"nonfinite": 1}])
def test_wording_does_not_depend_on_counts(change: dict[str, Any]) -> None:
    texts = {
        w["text"]
        for n in (500, 900)
        for w in warnings_of(
            {**SOUND, **change, "evaluations": n, "nonfinite": change.get("nonfinite", 0) * n}, METRICS
        )
    }
    assert len(texts) == 1


@pytest.mark.parametrize(("out_of_time", "remedy"), [(False, "--budget"), (True, "--seconds")])
def test_what_ended_a_search_is_what_to_raise(out_of_time: bool, remedy: str) -> None:
    (warning,) = warnings_of({**SOUND, "budget_spent": True, "out_of_time": out_of_time}, METRICS)
    assert warning["text"].endswith(f"raise {remedy}")


def test_a_search_without_starts_cannot_disagree() -> None:
    assert kinds({"starts": None, "agreeing": 0}) == []


def test_other_intervals_replace_those_there_are_and_one_open_end_leaves_a_parameter_open() -> None:
    fixed = {**PARAMETER, "name": "A", "fixed": True}
    rows = with_intervals([PARAMETER, fixed], {"n": Interval(1.5, None), "A": Interval(0.0, 1.0)})
    assert (rows[0]["low"], rows[0]["high"], rows[0]["identifiable"]) == (1.5, None, False)
    assert rows[1] == fixed
