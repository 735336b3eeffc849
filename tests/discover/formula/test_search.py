"""The choice of a formula's terms: what a further one has to earn, which are as good, and constants found again."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from mrfit.discover.formula import search
from mrfit.discover.formula.factors import Term
from mrfit.discover.formula.rows import FormulaRows
from mrfit.discover.formula.search import _Grid, again, as_good, chosen, refined
from mrfit.discover.formula.standing import Certainty, Formula, measured
from mrfit.discover.policy import STANDARD
from tests.discover.formula.plain import formula, rows_of, term

LINE, SQUARE, CUBE, SIDE = term(("x", "line")), term(("x", "square")), term(("x", "cube")), term(("v", "side", 0.1))
U = np.linspace(-1.0, 1.0, 60)
ROWS = rows_of([{"x": U, "v": U[::-1]}])
GROUPS = 8
SCATTER = np.array([1.0, -1.0] * (GROUPS // 2))


def of(terms: Sequence[Term], error: float, kept: float = 0.9, scatter: float = 0.0) -> Formula:
    """Return a formula that leaves so much of each group, more of one and less of the next by ``scatter``."""
    return formula(terms, [1.0] * len(terms), error + scatter * SCATTER, kept=kept)


def best(*found: Formula) -> tuple[Term, ...]:
    return chosen(ROWS, found, STANDARD)[0].terms


def test_of_formulas_of_as_many_terms_the_one_that_leaves_least_is_chosen() -> None:
    # so far apart that none is as good
    assert best(of([LINE], 2.0), of([SQUARE], 1.0), of([CUBE], 3.0)) == (SQUARE,)


@pytest.mark.parametrize(("takes", "earns"), [(0.31, True), (0.29, False)])
def test_a_further_term_has_to_take_much_of_what_is_left(takes: float, earns: bool) -> None:
    assert best(of([LINE], 1.0), of([LINE, SIDE], 1.0 - takes)) == ((LINE, SIDE) if earns else (LINE,))


def test_a_further_term_has_to_take_it_clearly_over_conditions() -> None:
    """A fall of 0.5 in the mean with a scatter s is clear where it is more than 2 s / sqrt(G)."""
    least = 0.5 * np.sqrt(GROUPS - 1) / 2.0
    for scatter, earns in ((0.98 * least, True), (1.02 * least, False)):
        assert (best(of([LINE], 1.0), of([LINE, SIDE], 0.5, scatter=scatter)) == (LINE, SIDE)) is earns


def test_no_third_term_is_looked_at_where_the_second_earned_nothing() -> None:
    third = of([LINE, SIDE, CUBE], 0.2)
    assert best(of([LINE], 1.0), of([LINE, SIDE], 0.9), third) == (LINE,)
    assert best(of([LINE], 1.0), of([LINE, SIDE], 0.5), third) == (LINE, SIDE, CUBE)
    # of two and three terms only
    assert best(of([LINE, SIDE], 0.9), third) == (LINE, SIDE, CUBE)


@pytest.mark.parametrize(
    ("clear", "gained", "left", "earns"),
    [(8.1, 0.04, 0.9, True), (7.9, 0.04, 0.9, False), (8.1, 0.02, 0.9, False), (8.1, 0.04, 0.93, False)],
)
def test_of_what_is_plain_less_is_asked(
    monkeypatch: pytest.MonkeyPatch, clear: float, gained: float, left: float, earns: bool
) -> None:
    monkeypatch.setattr(search, "certainty", lambda rows, f: Certainty(np.full(len(f.theta), 1.0 / clear), 0.9))
    found = best(of([LINE], 1.0, kept=0.8), of([LINE, SIDE], left, kept=0.8 + gained))
    assert (found == (LINE, SIDE)) is earns


def test_of_formulas_as_good_the_cheapest_is_chosen_and_the_others_are_told() -> None:
    dear, cheap, far = of([CUBE], 1.0), of([LINE], 1.01), of([SQUARE], 1.2)
    now, alike = chosen(ROWS, [dear, cheap, far], STANDARD)
    assert now is cheap and alike == [dear]
    # a difference of prices that is none
    sign, same = of([term(("x", "square"))], 1.0), of([term(("x", "size"))], 1.01)
    assert chosen(ROWS, [sign, same], STANDARD)[0] is sign


@pytest.mark.parametrize(
    ("other", "good"),
    [
        (of([SQUARE], 1.01), True),
        # more, but not clearly so over conditions
        (of([SQUARE], 1.09, scatter=0.3), True),
        (of([SQUARE], 1.09), False),
        (of([SQUARE], 1.11, scatter=0.3), False),
        (of([SQUARE], 1.01, kept=0.93 * 0.9), True),
        (of([SQUARE], 1.01, kept=0.91 * 0.9), False),
        (of([LINE, SQUARE], 1.0), False),
    ],
)
def test_a_formula_of_no_more_terms_is_as_good_if_conditions_do_not_tell_it_apart(other: Formula, good: bool) -> None:
    now = of([LINE], 1.0)
    assert as_good([now, other], now, STANDARD) == ([other] if good else [])


def test_formulas_far_from_the_best_are_not_looked_at_again_and_near_ones_are_refined(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[tuple[Term, ...], int]] = []

    def noted(rows: FormulaRows, terms: tuple[Term, ...], steps: int) -> tuple[Term, ...]:
        asked.append((terms, steps))
        return terms

    monkeypatch.setattr(search, "measured", lambda rows, terms: of(terms, 1.0))
    monkeypatch.setattr(search, "refined", noted)
    found = [of([LINE], 1.0), of([SQUARE], 1.59), of([CUBE], 1.61), of([SIDE], 3.9), of([LINE, SIDE], 4.1)]
    assert [f.terms for f in again(ROWS, found, STANDARD)] == [(LINE,), (SQUARE,), (CUBE,), (SIDE,)]
    assert asked == [((LINE,), STANDARD.formula_steps_again), ((SQUARE,), STANDARD.formula_steps_again)]


def grid_of(columns: np.ndarray, target: np.ndarray) -> _Grid:
    terms = tuple(term(("x", "over", 0.1 * k)) if k < 2 else term((n, "line")) for k, n in enumerate("xxvait"))
    return _Grid(terms[: columns.shape[1]], columns / np.linalg.norm(columns, axis=0), target)


def test_a_further_term_takes_what_a_regression_beside_the_others_takes() -> None:
    rng = np.random.default_rng(2)
    columns, target, own = rng.standard_normal((50, 5)), rng.standard_normal(50), rng.standard_normal((50, 2))
    target += columns[:, 3] + own[:, 0]
    drafts = grid_of(columns, target).extended((LINE, SQUARE), own, 9)
    for draft in drafts:
        (at,) = (k for k, t in enumerate(grid_of(columns, target).terms) if t == draft.terms[-1])
        whole = np.column_stack([own, columns[:, at]])
        left = target - whole @ np.linalg.lstsq(whole, target, rcond=None)[0]
        assert draft.share == pytest.approx(1.0 - float(left @ left) / float(target @ target))
    assert drafts[0].terms == (LINE, SQUARE, term(("a", "line")))
    assert [d.share for d in drafts] == sorted((d.share for d in drafts), reverse=True)
    # of one structure at two constants only the better one
    assert len(drafts) == 4 and len(grid_of(columns, target).extended((LINE, SQUARE), own, 2)) == 2


def test_a_term_that_the_others_make_is_no_further_one_nor_is_one_of_their_structure() -> None:
    rng = np.random.default_rng(3)
    own, other = rng.standard_normal((80, 1)), rng.standard_normal(80)
    target = own[:, 0] + 0.1 * rng.standard_normal(80)
    # 0.5 % of its square are its own, then 2 %
    for share, there in ((0.005, False), (0.02, True)):
        free = other - own[:, 0] * (own[:, 0] @ other) / (own[:, 0] @ own[:, 0])
        size = np.linalg.norm(own) / np.linalg.norm(free) * np.sqrt(share / (1.0 - share))
        near = own[:, 0] + size * free
        assert bool(grid_of(near[:, None], target).extended((LINE,), own, 3)) is there
        assert not grid_of(near[:, None], target).extended((term(("x", "over", 0.7)),), own, 3)


def planted(place: float) -> tuple[np.ndarray, np.ndarray]:
    x = np.concatenate([U, 0.7 * U])
    return x, 0.4 * np.maximum(x - place, 0.0)


def test_constants_that_leave_least_are_found_and_stay_in_their_bounds() -> None:
    x, force = planted(0.33)
    rows = rows_of([{"x": x, "v": x}], [force])
    (found,) = refined(rows, (term(("x", "over", 0.25)),), 20)
    assert found.constants[0] == pytest.approx(0.33, abs=1e-3)
    assert measured(rows, (found,)).theta[0] == pytest.approx(0.4, rel=1e-2)
    x, force = planted(0.96)
    (at_bound,) = refined(rows_of([{"x": 1.2 * x, "v": x}], [force]), (term(("x", "over", 0.7)),), 20)
    assert at_bound.constants[0] <= 0.9


def test_terms_without_constants_are_as_they_were() -> None:
    assert refined(ROWS, (LINE, SQUARE), 5) == (LINE, SQUARE)


def test_a_search_is_one_of_single_terms_pairs_and_triples_and_finds_two_that_were_planted() -> None:
    x, v = np.random.default_rng(1).uniform(-1.0, 1.0, (2, 240))
    samples = [{"x": x[k : k + 40], "v": v[k : k + 40]} for k in range(0, 240, 40)]
    terms = [LINE, SQUARE, CUBE, term(("v", "size")), term(("v", "square"))]
    noise = 0.01 * np.random.default_rng(5).standard_normal(240)
    force = 0.5 * x**3 - 0.3 * np.abs(v) + noise
    rows = rows_of(samples, np.split(force, 6))
    found = search.candidates(rows, terms, replace(STANDARD, formula_singles=5))
    assert {len(f.terms) for f in found} == {1, 2, 3}
    now, _ = chosen(rows, found, STANDARD)
    assert set(now.terms) == {CUBE, term(("v", "size"))}
    values = dict(zip(now.terms, now.theta, strict=True))
    assert (values[CUBE], values[term(("v", "size"))]) == (pytest.approx(0.5, rel=0.05), pytest.approx(-0.3, rel=0.05))
    # the origins of powers of the place are open among what is returned
    assert any(t.structure == ("x cube-from",) for f in found for t in f.terms)
