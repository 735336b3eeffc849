"""A name has to hold where a law may remember for longer; what has no name is told by the invariance it breaks."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from mrfit.core.registry import load
from mrfit.core.specs import Array, Invariance
from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.choice import Chosen, chosen_effects
from mrfit.discover.invariance.estimate import RIDGE, refine, rows_of
from mrfit.discover.invariance.generic import broken
from mrfit.discover.invariance.horizon import FURTHER, held_further
from mrfit.discover.invariance.policy import STANDARD
from mrfit.discover.invariance.sensitivity import examined
from mrfit.discover.invariance.setting import Setting, State, setting_of
from mrfit.discover.invariance.standing import described
from mrfit.discover.invariance.weights import weights_of
from tests.discover.invariance.specimens import HALF_STROKE, Force, records


def setting(effect: Force, horizon: float = 1.0) -> Setting:
    rows, own = records(effect), examined(load("effect", "gas-spring"))
    assert own is not None
    return setting_of(rows, none(rows).terms, [own], STANDARD, horizon)


def spring(channels: Mapping[str, Array], force: Array) -> Array:
    return force + 4e3 * channels["displacement"]


def test_a_name_that_holds_with_twice_the_memory_stays_and_another_goes() -> None:
    own, further = setting(spring), setting(spring, FURTHER)
    chosen = chosen_effects(own, STANDARD)
    assert set(chosen.state) == {"gas-spring"}
    assert set(held_further(own, further, chosen, STANDARD).state) == {"gas-spring"}
    strict = replace(STANDARD, clear=1e9, clear_of_most=1e9, no_rival=np.inf)
    dropped = held_further(own, further, chosen, strict)
    assert dropped.state == {}
    assert dropped.found == ()
    assert "remembers for longer" in dropped.reasons["gas-spring"]


def left(of: Setting, state: State) -> float:
    """Return the mean squared error of the best law, by a plain least squares fit."""
    rows = rows_of(of, state)
    law, target = np.vstack(rows.law), np.concatenate(rows.target)
    found = np.linalg.solve(law.T @ law + RIDGE * len(law) * np.eye(law.shape[1]), law.T @ target)
    return float(np.mean((target - law @ found) ** 2))


@pytest.mark.parametrize(("factor", "stands"), [(0.99, True), (1.01, False)])
def test_a_longer_memory_that_leaves_more_than_the_effect_is_no_rival(factor: float, stands: bool) -> None:
    own, further = setting(spring), setting(spring, FURTHER)
    chosen = chosen_effects(own, STANDARD)
    ratio = left(further, {}) / left(own, chosen.state)
    policy = replace(STANDARD, clear=1e9, clear_of_most=1e9, no_rival=ratio * factor)
    assert bool(held_further(own, further, chosen, policy).state) is stands


def test_intervals_know_how_much_a_longer_memory_moves_a_value() -> None:
    own, further = setting(spring), setting(spring, FURTHER)
    chosen = chosen_effects(own, STANDARD)
    (before,), (after,) = chosen.found, held_further(own, further, chosen, STANDARD).found
    k, wider = before.parameters[0], after.parameters[0]
    assert None not in (k.low, k.high, wider.low, wider.high)
    assert wider.value == k.value
    again = refine(further, weights_of(further, chosen.state), chosen.state)
    moved = described(further, weights_of(further, chosen.state), again, "gas-spring").parameters[0].value - k.value
    quantile = student.ppf(0.975, further.count - 1)
    half = np.hypot(0.5 * (k.high - k.low), quantile * moved)
    assert 0.5 * (wider.high - wider.low) == pytest.approx(half, rel=1e-9)
    assert after.force.high - after.force.low >= before.force.high - before.force.low


def test_nothing_chosen_stays_nothing() -> None:
    own, chosen = setting(spring), Chosen()
    assert held_further(own, setting(spring, FURTHER), chosen, STANDARD).state == {}


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
