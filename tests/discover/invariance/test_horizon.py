"""A name has to hold where a law may remember for longer; what has no name is told by the invariance it breaks."""

from collections.abc import Mapping
from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from scipy.stats import t as student

from mrfit.core.registry import load
from mrfit.core.specs import Array, Invariance
from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.estimate import refine, rows_of
from mrfit.discover.invariance.generic import broken
from mrfit.discover.invariance.regression import Regression, arrays
from mrfit.discover.invariance.sensitivity import examined
from mrfit.discover.invariance.setting import RegressionData, State, setting_of
from mrfit.discover.invariance.standing import described
from mrfit.discover.invariance.weights import weights_of
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.any_law import AnyLaw, LawSelection, choose
from mrfit.discover.selection.law_rules import LawSource
from mrfit.discover.selection.record import EvidenceReader, EvidenceRecorder
from tests.discover.invariance.specimens import HALF_STROKE, Force, records


def setting(effect: Force, horizon: float = 1.0) -> RegressionData:
    rows, own = records(effect), examined(load("effect", "gas-spring"))
    assert own is not None
    return setting_of(rows, none(rows).terms, [own], STANDARD, horizon)


def regression(effect: Force) -> Regression:
    return Regression(setting(effect), setting(effect, STANDARD.longer_memory), STANDARD)


def spring(channels: Mapping[str, Array], force: Array) -> Array:
    return force + 4e3 * channels["displacement"]


def test_a_name_that_holds_with_twice_the_memory_stays_and_another_goes() -> None:
    source = regression(spring)
    chosen = AnyLaw(source, STANDARD).selected()
    assert set(chosen.state) == {"gas-spring"}
    assert set(AnyLaw(source, STANDARD).beside_longer_memory(chosen).state) == {"gas-spring"}
    strict = replace(STANDARD, law_clear=1e9, clear_of_nearly_all=1e9, no_rival=np.inf)
    dropped = AnyLaw(source, strict).beside_longer_memory(chosen)
    assert dropped.state == {}
    assert dropped.found == ()
    assert "remembers for longer" in dropped.reasons["gas-spring"]


def test_the_decision_from_the_recorded_answers_is_that_of_the_regression() -> None:
    recorder = EvidenceRecorder(regression(spring))
    chosen = choose(cast(LawSource, recorder), STANDARD)
    assert set(chosen[0].state) == {"gas-spring"}
    evidence = recorder.evidence()
    assert choose(cast(LawSource, EvidenceReader(evidence)), STANDARD) == chosen
    with pytest.raises(LookupError, match="the evidence does not answer"):
        choose(cast(LawSource, EvidenceReader(evidence)), replace(STANDARD, worth_refining=20.0))


def left(of: RegressionData, state: State) -> float:
    """Return the mean squared error of the best law, by a plain least squares fit."""
    rows = rows_of(of, state)
    law, target = np.vstack(rows.law), np.concatenate(rows.target)
    found = np.linalg.solve(law.T @ law + STANDARD.law_ridge * len(law) * np.eye(law.shape[1]), law.T @ target)
    return float(np.mean((target - law @ found) ** 2))


@pytest.mark.parametrize(("factor", "stands"), [(0.99, True), (1.01, False)])
def test_a_longer_memory_that_leaves_more_than_the_effect_is_no_rival(factor: float, stands: bool) -> None:
    own, further, source = setting(spring), setting(spring, STANDARD.longer_memory), regression(spring)
    chosen = AnyLaw(source, STANDARD).selected()
    ratio = left(further, {}) / left(own, arrays(chosen.state))
    policy = replace(STANDARD, law_clear=1e9, clear_of_nearly_all=1e9, no_rival=ratio * factor)
    assert bool(AnyLaw(source, policy).beside_longer_memory(chosen).state) is stands


def test_intervals_know_how_much_a_longer_memory_moves_a_value() -> None:
    further, source = setting(spring, STANDARD.longer_memory), regression(spring)
    chosen = AnyLaw(source, STANDARD).selected()
    (before,), (after,) = chosen.found, AnyLaw(source, STANDARD).beside_longer_memory(chosen).found
    k, wider = before.parameters[0], after.parameters[0]
    assert None not in (k.low, k.high, wider.low, wider.high)
    assert wider.value == k.value
    weights = weights_of(further, arrays(chosen.state))
    again = refine(further, weights, arrays(chosen.state))
    moved = described(further, weights, again, "gas-spring").parameters[0].value - k.value
    quantile = student.ppf(0.975, further.count - 1)
    half = np.hypot(0.5 * (k.high - k.low), quantile * moved)
    assert 0.5 * (wider.high - wider.low) == pytest.approx(half, rel=1e-9)
    assert after.force.high - after.force.low >= before.force.high - before.force.low


def test_nothing_chosen_stays_nothing() -> None:
    assert AnyLaw(regression(spring), STANDARD).beside_longer_memory(LawSelection()).state == {}


@pytest.mark.parametrize(("factor", "told"), [(0.99, True), (1.01, False)])
def test_a_broken_invariance_is_told_from_the_share_that_it_takes_on(factor: float, told: bool) -> None:
    def rippling(channels: Mapping[str, Array], force: Array) -> Array:
        return force * (1.0 + 0.1 * np.sin(2.0 * np.pi * channels["displacement"] / (0.4 * HALF_STROKE)))

    own = setting(rippling)
    weights = weights_of(own, {})
    found = broken(own, weights, {}, STANDARD)
    assert found[0].invariance is Invariance.POSITION
    policy = replace(STANDARD, generic=found[0].kept * factor)
    assert (Invariance.POSITION in {b.invariance for b in broken(own, weights, {}, policy)}) is told
    small = replace(STANDARD, size=found[0].size / factor)
    assert (Invariance.POSITION in {b.invariance for b in broken(own, weights, {}, small)}) is (not told)
