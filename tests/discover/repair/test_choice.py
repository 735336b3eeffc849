"""The choice of a term on conditions left out, against plain regression."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.policy import STANDARD
from mrfit.discover.repair.choice import Choice, ConditionGrams, TriedTerm, chosen, clear, jackknife

BASE, TERMS = 2, 4


def parts(conditions: int = 6, strength: float = 0.0, noise: float = 1.0, seed: int = 0) -> list[Array]:
    """Return [base | terms | target] of every condition, the target with so much of the second term."""
    rng, found = np.random.default_rng(seed), []
    for k in range(conditions):
        columns = rng.standard_normal((60 + 5 * k, BASE + TERMS))
        target = columns[:, 0] + strength * columns[:, BASE + 1] + noise * rng.standard_normal(len(columns))
        found.append(np.column_stack([columns, target]))
    return found


def grams(own: Sequence[Array], ridge: float = 1e-12) -> ConditionGrams:
    return ConditionGrams(np.array([w.T @ w for w in own]), BASE, ridge)


def fitted(own: Sequence[Array], places: Sequence[int]) -> Array:
    """Return the coefficients of a plain regression."""
    whole = np.vstack(list(own))
    columns = whole[:, [*range(BASE), *(BASE + p for p in places)]]
    return np.linalg.lstsq(columns, whole[:, -1], rcond=None)[0]


@pytest.mark.parametrize("places", [(), (1,), (3, 0)])
def test_a_condition_is_judged_by_base_and_terms_fitted_to_the_others(places: tuple[int, ...]) -> None:
    own = parts(strength=0.7)
    made = grams(own)
    np.testing.assert_allclose(made.fitted(places), fitted(own, places), rtol=1e-6, atol=1e-9)
    for k, whole in enumerate(own):
        others = fitted([w for at, w in enumerate(own) if at != k], places)
        columns = whole[:, made.columns(places)]
        left = float(np.sum((whole[:, -1] - columns @ others) ** 2))
        assert made.error(places, k) == pytest.approx(left, rel=1e-6)
        np.testing.assert_allclose(made.fitted(places, k), others, rtol=1e-6, atol=1e-9)
    assert made.errors(places).tolist() == [made.error(places, k) for k in range(len(own))]
    assert made.terms == TERMS


def test_errors_with_each_further_term_are_those_of_fits_with_it() -> None:
    made = grams(parts(strength=0.7))
    for places in ((), (1,)):
        found = made.errors_with_each(places)
        for p in set(range(TERMS)) - set(places):
            np.testing.assert_allclose(found[:, p], made.errors((*places, p)), rtol=1e-5)


def test_a_term_that_the_base_makes_takes_nothing() -> None:
    own = parts(strength=0.7)
    for w in own:
        w[:, BASE] = w[:, 0] - 2.0 * w[:, 1]
    made = grams(own, ridge=1e-9)
    np.testing.assert_allclose(made.errors_with_each(())[:, 0], made.errors(()), rtol=1e-6)


def test_without_a_condition_the_others_are_as_they_were() -> None:
    own = parts()
    np.testing.assert_allclose(grams(own).without(2).fitted((0,)), grams([*own[:2], *own[3:]]).fitted((0,)))


def test_strengths_and_their_errors_are_those_of_a_jackknife_over_conditions() -> None:
    own = parts(strength=0.7)
    theta, spread = jackknife(grams(own), (1,))
    left = np.array([fitted([w for at, w in enumerate(own) if at != k], (1,)) for k in range(len(own))])
    np.testing.assert_allclose(theta, fitted(own, (1,)), rtol=1e-3, atol=1e-3)
    count = len(own)
    expected = np.sqrt((count - 1) / count * np.sum((left - left.mean(axis=0)) ** 2, axis=0))
    np.testing.assert_allclose(spread, expected, rtol=1e-2)


def test_a_term_that_was_planted_is_taken_and_no_other() -> None:
    made = grams(parts(strength=1.5, noise=0.5))
    found = chosen(made, STANDARD)
    assert found.places == [1] and found.refused is not None and found.refused.takes < STANDARD.repair_takes
    assert found.first is found.steps[0]
    # of 1.5^2 + 0.5^2 parts the term takes 1.5^2
    assert found.first.takes == pytest.approx(0.9, abs=0.03)
    assert found.first.least <= found.first.takes
    np.testing.assert_allclose(found.base, made.errors(()))


def test_where_nothing_is_missing_the_best_is_refused() -> None:
    found = chosen(grams(parts()), STANDARD)
    assert found.steps == () and found.places == []
    assert found.refused is found.first and found.first.takes < STANDARD.repair_takes


def test_no_more_terms_are_taken_than_are_allowed() -> None:
    own = parts(strength=3.0, noise=0.3)
    for w in own:
        w[:, -1] += 2.0 * w[:, BASE + 3] + 2.0 * w[:, BASE]
    made = grams(own)
    assert len(chosen(made, STANDARD).places) == STANDARD.repair_most == 2
    assert len(chosen(made, STANDARD, most=1).places) == 1
    assert chosen(made, STANDARD).refused is None
    assert sorted(chosen(made, replace(STANDARD, repair_most=3)).places) == [0, 1, 3]


@pytest.mark.parametrize(("lacks", "taken"), [(0.08, 0), (0.12, 1)])
def test_of_terms_that_do_nearly_as_well_the_simpler_one_is_taken(lacks: float, taken: int) -> None:
    """The first term is the second but for a share of its square."""
    own = parts(conditions=8, strength=3.0, noise=0.05)
    for w in own:
        w[:, BASE] = w[:, BASE + 1] + np.sqrt(lacks / (1.0 - lacks)) * w[:, BASE]
    found = chosen(grams(own), STANDARD, most=1)
    assert found.places == [taken]
    assert (1 in found.first.alike) is (taken == 0)


def alone(falls: Sequence[float]) -> ConditionGrams:
    """Return conditions in which the only term takes these shares of a squared error of 1; the base has no column."""
    made = []
    for k, fall in enumerate(falls):
        rng = np.random.default_rng(k)
        term, rest = np.linalg.qr(rng.standard_normal((40, 2)))[0].T
        target = np.sqrt(fall) * term + np.sqrt(1.0 - fall) * rest
        made.append(np.column_stack([term, target]))
    return ConditionGrams(np.array([w.T @ w for w in made]), 0, 1e-12)


def test_one_condition_alone_does_not_decide() -> None:
    """All together take more than the quarter that is asked for, without the best of them they take less."""
    shown, one = chosen(alone([0.3] * 6), STANDARD), chosen(alone([0.9, *5 * [0.2]]), STANDARD)
    assert shown.places == [0] and shown.first.least == pytest.approx(0.3, abs=1e-6)
    assert one.places == [] and one.first.takes > STANDARD.repair_takes > one.first.least


def test_a_share_that_is_too_small_without_any_one_condition_is_refused() -> None:
    for share, taken in ((0.27, True), (0.23, False)):
        assert bool(chosen(alone([share] * 6), STANDARD).places) is taken


def test_a_fall_is_clear_by_its_standard_error_over_conditions() -> None:
    scatter = np.array([1.0, -1.0] * 4)
    error = float(scatter.std(ddof=1)) / np.sqrt(8)
    for factor, is_clear in ((1.01, True), (0.99, False)):
        assert clear(2.0 * factor * error + scatter, STANDARD) is is_clear


def test_the_first_of_a_choice_is_the_best_term_whether_it_was_taken_or_not() -> None:
    one, other = (TriedTerm(k, np.ones(3), (), 0.5, 0.4) for k in (2, 7))
    assert Choice(np.ones(3), (one,), other).first is one
    assert Choice(np.ones(3), (), other).first is other
    assert Choice(np.ones(3), (one, other), None).places == [2, 7]
