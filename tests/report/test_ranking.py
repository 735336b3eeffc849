import math
from dataclasses import replace

import pytest

from mrfit.io.schemas.fit import Fit, MetricRow
from mrfit.report.ranking import above_best, best, comparable, criteria, held_out, ranked
from mrfit.report.source import read_source


@pytest.fixture(scope="module")
def fit(damper) -> Fit:
    return read_source(damper[0], ()).fits[0]


def judged(fit: Fit, name: str, train: float | None, holdout: float | None, samples: int = 100, seen: str = "a") -> Fit:
    rows = []
    for role, condition, rmse in (("train", "a", train), ("holdout", seen, holdout)):
        if rmse is not None:
            error = {"samples": samples, "rmse": rmse, "mse": rmse**2, "nrmse": rmse / 10.0, "noise_floor": 0.5}
            rows += [MetricRow(condition=c, role=role, **error) for c in (condition, "all")]
    return replace(fit, name=name, metrics=rows)


def test_the_least_error_on_held_out_data_comes_first_whatever_the_training_error(fit):
    order = ranked([judged(fit, "a", 1.0, 3.0), judged(fit, "b", 2.0, 2.5), judged(fit, "c", 0.1, None)])
    assert [(r.fit.name, r.place) for r in order] == [("b", 1), ("a", 2), ("c", 3)]
    assert (order[0].holdout, order[0].train, order[0].floor) == (0.25, 0.2, pytest.approx(0.05))
    assert order[2].holdout is None


@pytest.mark.parametrize(("samples", "known"), [(100, True), (50, False)])
def test_the_noise_floor_is_that_of_the_data_whichever_fit_tells_it(fit, samples, known):
    told, other = judged(fit, "a", 1.0, 3.0), judged(fit, "b", 1.0, 4.0, samples=samples)
    other = replace(other, metrics=[replace(m, noise_floor=None) for m in other.metrics])
    rows = {r.fit.name: r.floor for r in ranked([told, other])}
    assert rows["a"] == pytest.approx(0.05) and rows["b"] == (rows["a"] if known else None)


def test_errors_on_fewer_samples_come_later(fit):
    order = ranked([judged(fit, "few", 1.0, 1.0, samples=50), judged(fit, "all", 1.0, 2.0)])
    assert [r.fit.name for r in order] == ["all", "few"]


def test_a_fit_judged_on_cycles_of_what_it_saw_comes_after_those_judged_on_whole_conditions(fit):
    order = ranked([judged(fit, "cycles", 1.0, 0.1, samples=900), judged(fit, "conditions", 1.0, 2.0, seen="b")])
    assert [(r.fit.name, held_out(r.fit)) for r in order] == [("conditions", "conditions"), ("cycles", "other cycles")]


def test_fits_of_another_output_are_ranked_for_themselves(fit):
    order = ranked([judged(fit, "a", 1.0, 3.0), replace(judged(fit, "b", 1.0, 9.0), output="flux")])
    assert [(r.fit.output, r.place) for r in order] == [("flux", 1), ("force", 1)]


def test_criteria_are_those_of_a_normal_likelihood():
    # −2·ln L of n normal errors whose variance is estimated as mse, without n·(1 + ln 2π)
    n, mse, k = 400, 2.5, 3
    likelihood = -0.5 * n * (math.log(2.0 * math.pi * mse) + 1.0)
    aic, bic = criteria(mse, n, k)
    constant = n * (1.0 + math.log(2.0 * math.pi))
    assert aic == pytest.approx(2.0 * (k + 1) - 2.0 * likelihood - constant)
    assert bic == pytest.approx((k + 1) * math.log(n) - 2.0 * likelihood - constant)


@pytest.mark.parametrize("mse", [None, 0.0, math.nan])
def test_there_are_no_criteria_without_an_error(mse):
    assert criteria(mse, 10, 1) == (None, None)


def test_criteria_are_compared_on_equal_data_only(fit):
    order = ranked([judged(fit, "a", 1.0, 1.0), judged(fit, "b", 2.0, 2.0), judged(fit, "c", 1.0, 3.0, samples=50)])
    shown = {r.fit.name: above_best(order, r, "aic") for r in order}
    assert shown == {"a": 0.0, "b": pytest.approx(100 * math.log(4.0)), "c": None}


def test_it_is_said_whether_cycles_or_conditions_were_held_out(fit):
    assert held_out(judged(fit, "a", 1.0, 1.0, seen="a")) == "other cycles"
    assert held_out(judged(fit, "a", 1.0, 1.0, seen="b")) == "conditions"
    assert held_out(judged(fit, "a", 1.0, None)) == "nothing"


@pytest.mark.parametrize(("rmse", "diverged"), [(0.5, False), (10.0, False), (10.1, True), (math.nan, True)])
def test_a_fit_whose_error_exceeds_the_measured_range_has_diverged(fit, rmse, diverged):
    (row,) = ranked([judged(fit, "a", 0.1, rmse)])
    assert row.diverged is diverged


def test_the_best_are_chosen_for_each_output_and_a_diverged_one_only_where_there_is_no_other(fit):
    fits = [judged(fit, name, 1.0, rmse) for name, rmse in (("c", 3.0), ("a", 1.0), ("b", 2.0), ("wild", 50.0))]
    lost = replace(judged(fit, "lost", 1.0, 99.0), output="flux")
    assert best([*fits, lost], 2) == ["lost", "a", "b"]
    assert best([*fits[:1], *fits[3:]], 3) == ["c"]


def test_fits_judged_on_the_same_data_stand_together(fit):
    fits = [
        judged(fit, "cycles", 1.0, 0.1),
        judged(fit, "worse", 1.0, 2.0, seen="b"),
        judged(fit, "better", 1.0, 1.0, seen="b"),
        judged(fit, "few", 1.0, 0.5, samples=50, seen="b"),
    ]
    groups = [[r.fit.name for r in group] for group in comparable(ranked(fits))]
    assert groups == [["better", "worse"], ["few"], ["cycles"]]
