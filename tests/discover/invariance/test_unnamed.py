"""A small effect has to stand beside a larger force without a name that breaks another invariance."""

from collections.abc import Mapping

import numpy as np
import pytest

from mrfit.core.registry import load
from mrfit.core.specs import Array, Invariance
from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.regression import Regression
from mrfit.discover.invariance.sensitivity import examined
from mrfit.discover.invariance.setting import setting_of
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.any_law import AnyLaw, LawSelection, overshadowed
from mrfit.discover.selection.law_rules import FULL
from tests.discover.invariance.specimens import Force, records

SPRING = "gas-spring"


def uneven(channels: Mapping[str, Array], force: Array) -> Array:
    """Return a force that is less in one direction: not odd, and no effect of the library."""
    return force + 80.0 * np.abs(np.tanh(channels["velocity"] / 0.02))


def uneven_with_spring(channels: Mapping[str, Array], force: Array) -> Array:
    return uneven(channels, force) + 2e3 * channels["displacement"]


def forced(force: Force) -> tuple[Regression, LawSelection]:
    """Return records and a spring that is taken to be there."""
    rows, own = records(force), examined(load("effect", SPRING))
    assert own is not None
    setting = setting_of(rows, none(rows).terms, [own], STANDARD)
    source = Regression(setting, setting, STANDARD)
    start = tuple(own.at(np.array(own.spec.neutral), 0, 2e3).tolist())
    fit = source.refit({SPRING: start}, {}, (SPRING,), FULL)
    return source, LawSelection(state=fit.state, found=fit.described)


@pytest.mark.parametrize(("force", "stands"), [(uneven, False), (uneven_with_spring, True)])
def test_a_spring_stands_beside_a_larger_force_that_is_not_odd_only_if_it_is_there(force: Force, stands: bool) -> None:
    source, chosen = forced(force)
    held, unnamed = AnyLaw(source, STANDARD).beside_unnamed(chosen)
    share = chosen.found[0].row.standing.share
    assert overshadowed(share, unnamed[0].share)
    assert [b.invariance for b in unnamed] == [Invariance.ODDNESS]
    assert (SPRING in held.state) == stands == bool(held.found)
    assert (SPRING in held.reasons) != stands


def test_what_takes_less_than_the_effect_does_not_speak_against_it() -> None:
    assert not overshadowed(0.9, 0.95)
    assert overshadowed(0.25, 0.8)
    assert not overshadowed(0.25, 0.3)
