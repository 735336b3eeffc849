"""When a stored fit's law is taken to be the one that is here, and what is said where it is not."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.fit import proof
from mrfit.fit.files import residual_columns
from mrfit.fit.proof import PROOF_SAMPLES, PROOF_TOLERANCE, _largest, _same_data, check_simulated, lawful
from mrfit.io.schemas.fit import Fit, Quantity, Result, SegmentUse
from mrfit.io.workspace import Workspace
from tests.fit.toy import DT, linear_model, part

FIT = Fit(name="f", model="tanh", optimizer="lsq", output="force", results=[], metrics=[], law={"tanh": "a"})
CHANGED = "tanh has changed since"


def judged(
    monkeypatch: pytest.MonkeyPatch,
    fit: Fit = FIT,
    changed: str = "",
    difference: float | None = 0.0,
    reason: str = "",
    compare: bool = False,
) -> tuple[list[str], dict[str, str], int]:
    """Return what is said of a fit that is taken, its law, and how often it was simulated."""
    simulated: list[str] = []

    class Inputs:
        """What is out of date, whatever the workspace."""

        def __init__(self, workspace: Workspace) -> None:
            pass

        def of_fits(self, fits: list[Fit]) -> dict[str, str]:
            return {f.name: reason for f in fits if reason}

    monkeypatch.setattr(proof, "law_reason", lambda one: changed)
    monkeypatch.setattr(proof, "law_code", lambda model: {"tanh": "now"})
    monkeypatch.setattr(proof, "_difference", lambda workspace, one: simulated.append(one.name) or difference)
    monkeypatch.setattr(proof, "Inputs", Inputs)
    found = lawful(Workspace(Path("nowhere")), fit, compare)
    return found.outdated, found.law, len(simulated)


def test_a_fit_whose_code_is_the_same_is_simulated_only_where_that_is_asked_for_or_a_plugin_may_call_other_code(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert judged(monkeypatch) == ([], {"tanh": "a"}, 0)
    assert judged(monkeypatch, compare=True) == ([], {"tanh": "a"}, 1)
    assert judged(monkeypatch, replace(FIT, law={**FIT.law, f"{proof.PLUGIN}own": "b"}))[2] == 1
    # nothing to compare with is no fault where the code is the same
    assert judged(monkeypatch, compare=True, difference=None) == ([], {"tanh": "a"}, 1)


@pytest.mark.parametrize(
    ("law", "changed", "said", "now"),
    [
        ({"tanh": "a"}, CHANGED, f"{CHANGED}; this code simulates the same as the fit did", {"tanh": "now"}),
        ({}, "", "an older mrfit made it; this code simulates the same as the fit did", {}),
    ],
)
def test_other_code_that_simulates_the_same_is_the_same_law(
    law: dict[str, str], changed: str, said: str, now: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    own = replace(FIT, law=law)
    assert judged(monkeypatch, own, changed, PROOF_TOLERANCE) == ([said], now, 1)
    for difference in (1.01 * PROOF_TOLERANCE, float("nan")):
        with pytest.raises(DataError, match="fit again: `mrfit fit --model tanh --opt lsq --per condition`") as error:
            judged(monkeypatch, own, changed, difference)
        assert (changed or "the code of its law has changed since") in str(error.value)


def test_what_cannot_be_compared_is_refused_where_the_code_has_changed_and_told_of_an_older_mrfits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(DataError, match=f"{CHANGED}, and the data that it simulated are not here to compare with"):
        judged(monkeypatch, changed=CHANGED, difference=None)
    said, _, _ = judged(monkeypatch, replace(FIT, law={}), difference=None)
    assert said == ["an older mrfit's, which does not state its code, and not compared with what it simulated"]


def test_other_reasons_are_told_beside_and_the_same_one_once(monkeypatch: pytest.MonkeyPatch) -> None:
    assert judged(monkeypatch, reason="the recordings have changed since")[0] == ["the recordings have changed since"]
    assert len(judged(monkeypatch, changed=CHANGED, reason=CHANGED)[0]) == 1
    assert len(judged(monkeypatch, changed=CHANGED, reason="segments cut otherwise")[0]) == 2


@pytest.mark.parametrize(
    ("now", "then", "difference"),
    [
        ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], 0.0),
        # over the range of what the fit simulated
        ([1.0, 2.0, 4.0], [1.0, 2.0, 3.0], 0.5),
        # where both diverge they are alike, and the rest is compared as ever
        ([np.nan, 2.0], [np.nan, 2.0], 0.0),
        ([np.inf, 2.0, 3.5], [np.inf, 2.0, 3.0], 0.5),
        ([np.nan], [np.nan], 0.0),
        ([np.nan, 2.0], [1.0, 2.0], np.nan),
        ([np.inf, 2.0], [1.0, 2.0], np.inf),
        # of an output that rests the difference itself counts
        ([2.0, 2.25], [2.0, 2.0], 0.25),
    ],
)
def test_two_simulations_differ_by_a_share_of_the_outputs_range(
    now: list[float], then: list[float], difference: float
) -> None:
    found = _largest([(np.array(now), np.array(then))])
    assert found == pytest.approx(difference, nan_ok=True)
    parts = [(np.array([x]), np.array([y])) for x, y in zip(now, then, strict=True)]
    assert _largest(parts) == pytest.approx(difference, nan_ok=True)


def fitted(count: int, samples: int = 4) -> tuple[Fit, list[Any], list[Array]]:
    """A fit of y = p·u with one set for all parts, the parts, and what it simulated."""
    parts = [part(np.full((1, samples), k + 1.0), np.zeros(samples), f"c{k}") for k in range(count)]
    uses = [SegmentUse(id=p.segment.id, condition=p.segment.condition, role="train") for p in parts]
    result = Result(condition="all", evaluations=1, parameters=[Quantity(name="p0", value=0.5)], segments=uses)
    return replace(FIT, results=[result]), parts, [0.5 * p.drive.values[0] for p in parts]


def test_a_fit_in_memory_is_refused_where_its_law_gives_other_outputs() -> None:
    fit, parts, simulated = fitted(3)
    assembly, _ = linear_model("")
    check_simulated(fit, assembly, parts, simulated)
    for place in range(3):
        wrong = [y + 1e-3 * (k == place) for k, y in enumerate(simulated)]
        with pytest.raises(DataError, match=r"by 0.1 % of the output's range"):
            check_simulated(fit, assembly, parts, wrong)


def test_of_very_many_samples_the_first_are_compared() -> None:
    fit, parts, simulated = fitted(3, PROOF_SAMPLES // 2 + 1)
    assembly, _ = linear_model("")
    check_simulated(fit, assembly, parts, [*simulated[:2], simulated[2] + 9.0])
    with pytest.raises(DataError):
        check_simulated(fit, assembly, parts, [simulated[0], simulated[1] + 9.0, simulated[2]])


@pytest.mark.parametrize(
    ("column", "change", "same"),
    [("measured", 1e-12, True), ("measured", 1e-6, False), ("u0", 1e-6, False), ("u1", None, False)],
)
def test_a_law_is_compared_on_the_data_that_the_fit_had_alone(column: str, change: float | None, same: bool) -> None:
    assembly, _ = linear_model("", "")
    one = part(np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), np.array([7.0, 8.0, 9.0]))
    columns = residual_columns(one, np.zeros(3), assembly)
    assert _same_data(one, columns, assembly)
    assert not _same_data(one, {n: v[:2] for n, v in columns.items()}, assembly)
    changed = {n: v * (1.0 + (change or 0.0) * (n == column)) for n, v in columns.items()}
    if change is None:
        del changed[column]
    assert _same_data(one, changed, assembly) is same


def test_samples_of_a_piece_are_at_their_time_in_the_segment() -> None:
    assembly, _ = linear_model("")
    one = replace(part(np.array([[1.0, 2.0, 3.0]]), np.array([7.0, 8.0, 9.0])), before=100)
    columns = residual_columns(one, np.ones(3), assembly)
    assert columns["time"] == pytest.approx(DT * np.array([100, 101, 102]))
    assert list(columns) == ["time", "measured", "simulated", "u0"] and columns["measured"].tolist() == [7.0, 8.0, 9.0]
