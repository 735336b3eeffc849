"""Effects that together leave too much are not named, and all that had proof are said to take part."""

import numpy as np
import pytest

from mrfit.discover.account import confusable, cosine_table, drop_shadows
from mrfit.discover.decide import Verdict
from mrfit.discover.screen import Screened
from tests.discover.test_trials import fitted


def test_all_effects_with_proof_are_taken_back_where_they_leave_too_much() -> None:
    base, one, both = fitted((), 10.0), fitted(("delay",), 7.0), fitted(("delay", "inertia"), 6.0)
    verdict = Verdict(base, one, both)
    drop_shadows(verdict)
    assert verdict.taken_back
    assert verdict.final is base
    assert verdict.proven is both
    assert set(verdict.reasons) == {"delay", "inertia"}
    assert verdict.reasons["inertia"].startswith("delay and inertia would take 6")


def test_effects_that_leave_little_stay() -> None:
    base, both = fitted((), 10.0), fitted(("delay", "inertia"), 1.1)
    verdict = Verdict(base, both, both)
    drop_shadows(verdict)
    assert not verdict.taken_back
    assert verdict.final is both


@pytest.mark.parametrize(("cosine", "alike"), [(0.75, False), (0.85, True), (-0.85, True), (0.95, True)])
def test_what_the_decision_takes_for_alike_is_told_as_confusable_and_marked_in_the_table(
    cosine: float, alike: bool
) -> None:
    directions = np.array([[1.0, 0.0], [cosine, np.sqrt(1.0 - cosine**2)]])
    screened = [Screened(n, direction=d) for n, d in zip(("delay", "inertia"), directions, strict=True)]
    verdict = Verdict(fitted((), 10.0), fitted((), 10.0), fitted((), 10.0), screened=screened)
    table = cosine_table(verdict)
    assert (verdict.alike("delay") == {"inertia"}) == alike
    assert bool(confusable(verdict)) == alike
    assert (abs(table["matrix"][0][1]) > table["alike"]) == alike
