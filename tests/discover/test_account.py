"""Effects that together leave too much are not named, and all that had proof are said to take part."""

from mrfit.discover.account import drop_shadows
from mrfit.discover.decide import Verdict
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
