"""A name has to hold where a law may remember for longer; what has no name is told by the invariance it breaks."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.registry import load
from mrfit.core.specs import Array, Invariance
from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.choice import Chosen, chosen_effects
from mrfit.discover.invariance.generic import broken
from mrfit.discover.invariance.horizon import FURTHER, held_further
from mrfit.discover.invariance.policy import STANDARD
from mrfit.discover.invariance.sensitivity import examined
from mrfit.discover.invariance.setting import Setting, setting_of
from mrfit.discover.invariance.weights import weights_of
from tests.discover.invariance.specimens import HALF_STROKE, Force, records


def setting(effect: Force, horizon: float = 1.0) -> Setting:
    rows, own = records(effect), examined(load("effect", "gas-spring"))
    assert own is not None
    return setting_of(rows, none(rows).terms, [own], STANDARD, horizon)


def spring(channels: Mapping[str, Array], force: Array) -> Array:
    return force + 4e3 * channels["displacement"]


def test_a_name_that_holds_with_twice_the_memory_stays_and_another_goes() -> None:
    chosen = chosen_effects(setting(spring), STANDARD)
    assert set(chosen.state) == {"gas-spring"}
    further = setting(spring, FURTHER)
    assert held_further(further, chosen, STANDARD) is chosen
    dropped = held_further(further, chosen, replace(STANDARD, clear=1e9, clear_of_most=1e9))
    assert dropped.state == {}
    assert dropped.found == ()
    assert "remembers for longer" in dropped.reasons["gas-spring"]


def test_nothing_chosen_stays_nothing() -> None:
    chosen = Chosen()
    assert held_further(setting(spring, FURTHER), chosen, STANDARD) is chosen


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
