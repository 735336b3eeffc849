"""What is asked of an effect that takes much of what is left, fitted or held out."""

import pytest
from scipy.stats import norm
from scipy.stats import t as student

from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.rules import beyond_chance, claim, counted, leaves_too_much
from tests.discover.world import fit


@pytest.mark.parametrize(
    ("before", "after", "needed"),
    [
        # seven tenths of the gap, far above the noise and not
        (1.55, 1.20, STANDARD.clear_of_half),
        (1.45, 1.17, STANDARD.clear),
        # less than half
        (1.55, 1.34, STANDARD.clear),
    ],
)
def test_less_is_asked_of_a_first_effect_that_takes_half_of_a_gap_far_above_the_noise(
    before: float, after: float, needed: float
) -> None:
    base = fit(before, number=0)
    assert claim("a", base, fit(after, "a"), base, STANDARD).needed == needed
    # none of a later one
    later = fit(before, "b", number=1)
    assert claim("a", later, fit(after, "a", "b"), base, STANDARD).needed == STANDARD.clear


def test_what_overwhelms_on_held_out_conditions_alone_is_beyond_chance() -> None:
    base = fit(3.0, train=1.3)
    found = claim("a", base, fit(1.05, "a", train=1.0), base, STANDARD)
    assert (found.overwhelms, found.settles, found.score) == (True, False, 0.0)
    assert beyond_chance(found, STANDARD)


@pytest.mark.parametrize("degrees", [2.0, 5.0, 40.0])
def test_standard_errors_of_few_degrees_count_as_the_normal_score_of_their_tail(degrees: float) -> None:
    """By three quarters of it, and never for more than they are."""
    for errors in (1.0, 4.0, -6.0):
        score = -norm.ppf(student.sf(abs(errors), degrees)) / 0.75
        assert counted(errors, degrees, STANDARD) == pytest.approx(min(score, abs(errors)))
    assert counted(6.0, 0.1, STANDARD) == counted(6.0, 1.0, STANDARD)
    assert counted(1e3, 1e9, STANDARD) == 1e3


def test_a_base_within_what_the_noise_can_be_leaves_nothing_too_much() -> None:
    assert not leaves_too_much(fit(4.9), fit(4.8, "a"), 5.0, STANDARD)
    assert leaves_too_much(fit(15.0), fit(14.0, "a"), 5.0, STANDARD)
