from dataclasses import replace

import pytest

from mrfit.io.schemas.fit import Fit, MetricRow, SegmentUse
from mrfit.report.source import read_source
from mrfit.report.verdict import cautions, open_directions, verdict


@pytest.fixture(scope="module")
def fits(coil, damper) -> list[Fit]:
    return [read_source(workspace, ()).fits[0] for workspace, _ in (coil, damper)]


def metric(condition: str, role: str, rmse: float | None, floor: float | None = None) -> MetricRow:
    nrmse = None if rmse is None else rmse / 10.0
    return MetricRow(condition=condition, role=role, samples=10, rmse=rmse, nrmse=nrmse, noise_floor=floor)


def with_metrics(fit: Fit, *rows: MetricRow) -> Fit:
    return replace(fit, metrics=list(rows))


def test_best_and_worst_condition_are_named_from_held_out_data(fits):
    assert "Best held-out condition: sine-1Hz-5A (0.192 %); worst: sine-10Hz-1A (1.86 %)." in verdict(fits[0])


def test_error_at_the_noise_floor_is_called_noise(fits):
    said = verdict(with_metrics(fits[1], metric("all", "train", 2.0, 1.95), metric("a", "train", 2.0, 1.95)))
    assert said[0] == (
        "On training data (1 condition) the error is 2.00 N RMS, 20.0 % of the range, "
        "1.03 times the noise floor: what is left is noise."
    )


def test_error_above_the_noise_floor_is_not_excused(fits):
    said = verdict(with_metrics(fits[1], metric("all", "train", 2.0, 0.5), metric("a", "train", 2.0, 0.5)))
    assert said[0].endswith("4.00 times the noise floor.")


def test_missing_hold_out_and_noise_floor_are_said(fits):
    said = verdict(with_metrics(fits[1], metric("all", "train", 2.0), metric("a", "train", 2.0)))
    assert said == [
        "On training data (1 condition) the error is 2.00 N RMS, 20.0 % of the range; the noise floor is not known.",
        "Nothing was held out: how the model does on data it has not seen is not known.",
    ]


@pytest.mark.parametrize(("rmse", "below"), [(1.2, True), (1.7, False)])
def test_a_model_that_leaves_less_than_the_bounds_lowers_the_noise_floor(fits, rmse, below):
    found = {"noise_floor_method": "regression", "noise_floor_bounds": (1.5, 2.5)}
    use = SegmentUse(id="a#0", condition="a", role="train", **found)
    fit = with_metrics(fits[1], metric("all", "train", rmse, 2.0), metric("a", "train", rmse, 2.0))
    said = verdict(replace(fit, results=[replace(fit.results[0], segments=[use])]))
    ending = "it lies between about 1.50 and 2.50 N" + ", and lower where the model leaves less" * below + "."
    assert any(sentence.endswith(ending) for sentence in said), said


def test_divergence_is_said(fits):
    said = verdict(with_metrics(fits[1], metric("all", "train", None), metric("a", "train", None)))
    assert said[0] == "On training data the simulation diverged: no error can be given."


def test_equal_warnings_are_said_once(fits):
    found = cautions(fits[0])
    assert [(c.kind, c.where, list(c.others)) for c in found] == [
        ("not-identifiable", "all 15 conditions", []),
        ("at-bound", "all 15 conditions", []),
    ]


def test_rarer_wordings_of_a_warning_follow_the_commonest(fits):
    results = []
    for k, result in enumerate(fits[0].results):
        told = result.warnings[1]
        kept = [replace(told, text="rho") if k < 2 else told] if k < 7 else []
        results.append(replace(result, warnings=kept))
    fit = replace(fits[0], results=results)
    (found,) = cautions(fit)
    assert found.where == "7 of 15 conditions" and found.text.startswith("n ended at a bound")
    assert found.others == [("rho", "sine-1Hz-1A, sine-1Hz-2A")]


def test_joint_fit_needs_no_condition_beside_its_warning(fits):
    only = replace(fits[1].results[0], warnings=fits[0].results[0].warnings)
    fit = replace(fits[1], results=[only])
    assert [c.where for c in cautions(fit)] == ["", ""]


def test_open_directions_are_spelled_out_largest_weight_first(fits):
    assert open_directions(fits[0])[0] == (
        "sine-1Hz-1A",
        "the data determine 3 of 4 directions; free to move along −0.8·kappa +0.6·A",
    )
    assert open_directions(fits[1]) == []


def test_how_the_noise_floor_was_found_is_said(fits):
    rows = [
        {"id": "a#1", "condition": "a", "role": "train", "noise_floor": 2.0, "noise_floor_method": "regression"},
        {"id": "b#1", "condition": "b", "role": "train", "noise_floor_method": "not known"},
    ]
    rows[0]["noise_floor_bounds"], rows[1]["noise_floor_bounds"] = (1.5, 3.0), (1.0, None)
    only = replace(fits[1].results[0], segments=[SegmentUse(**row) for row in rows])
    fit = replace(fits[1], results=[only])
    said = [text for text in verdict(fit) if text.startswith("The noise floor")]
    assert said == [
        "The noise floor is by regression on the inputs in 1 segment, not known in 1 segment; it lies between about "
        "1.00 and 3.00 N."
    ]
    only = replace(only, segments=[replace(s, noise_floor_method="cycles") for s in only.segments])
    fit = replace(fit, results=[only])
    assert not [text for text in verdict(fit) if text.startswith("The noise floor")]
