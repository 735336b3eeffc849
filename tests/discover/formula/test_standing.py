"""Standing of a formula against plain regression, and the objections to it on both sides of every threshold."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.formula.rows import FormulaRows
from mrfit.discover.formula.standing import Certainty, certainty, measured, objection
from mrfit.discover.policy import STANDARD
from tests.discover.formula.plain import formula, rows_of, term

SQUARE, LINE = term(("x", "square")), term(("x", "line"))


def noisy(groups: int = 6, noise: float = 0.05) -> FormulaRows:
    """Rows of y = 0.8 v + 0.5 x^2 + noise beside a law of a constant and v."""
    rng, samples, targets, laws, weights = np.random.default_rng(4), [], [], [], []
    for k in range(groups):
        x, v = rng.uniform(-1.0, 1.0, (2, 40 + k))
        samples.append({"x": x, "v": v})
        laws.append(np.column_stack([np.ones(len(v)), v]))
        targets.append(0.8 * v + 0.5 * x**2 + noise * rng.standard_normal(len(v)))
        weights.append(np.full(len(v), 0.5 + 0.2 * k))
    return rows_of(samples, targets, laws, weights)


ROWS = noisy()
WEIGHT, X = ROWS.weights, np.concatenate([s["x"] for s in ROWS.samples])


def regressed(columns: Array, target: Array) -> Array:
    """Return the coefficients of a plain weighted regression."""
    return np.linalg.lstsq(columns * WEIGHT[:, None], target * WEIGHT, rcond=None)[0]


def test_coefficients_are_those_of_a_regression_on_the_law_and_the_terms() -> None:
    found = measured(ROWS, (SQUARE, LINE))
    whole = np.column_stack([ROWS.law, X**2, X])
    np.testing.assert_allclose(found.theta, regressed(whole, ROWS.target)[2:], rtol=1e-4)
    assert found.theta[0] == pytest.approx(0.5, abs=0.05)


def test_a_group_left_out_is_judged_by_coefficients_of_the_others_beside_the_law_of_all() -> None:
    found = measured(ROWS, (SQUARE,))
    free, target = ROWS.project(X**2), ROWS.projected_target
    errors = []
    for own in ROWS.groups:
        others = np.setdiff1d(np.arange(len(X)), own)
        theta = float(free[others] @ target[others] / (free[others] @ free[others]))
        errors.append(float(np.sum((target[own] - theta * free[own]) ** 2)))
    np.testing.assert_allclose(found.errors, errors, rtol=1e-8)
    assert found.error == pytest.approx(sum(errors))
    assert found.kept == pytest.approx(1.0 - sum(errors) / float(target @ target))


def test_size_and_what_is_left_by_the_law_are_told() -> None:
    found = measured(ROWS, (SQUARE, LINE))
    columns = np.column_stack([X**2, X])
    assert found.size == pytest.approx(float(np.max(np.abs(columns @ found.theta))))
    centred = (columns - columns.mean(axis=0)) * WEIGHT[:, None]
    free = ROWS.project(columns)
    lefts = np.sum(free**2, axis=0) / np.sum(centred**2, axis=0)
    assert found.left == pytest.approx(float(lefts.min()))
    sizes = [float(np.linalg.norm(c @ found.theta)) for c in (centred, free)]
    assert found.cancelled == pytest.approx(sizes[0] / sizes[1])


def test_what_a_law_makes_leaves_nothing_and_cancels() -> None:
    speed = measured(ROWS, (term(("v", "line")),))
    assert speed.left < 1e-4 < measured(ROWS, (SQUARE,)).left
    beside = rows_of(
        ROWS.samples, ROWS.setting.targets, [np.column_stack([s["x"] ** 2 + 0.05 * s["v"]]) for s in ROWS.samples]
    )
    assert measured(beside, (SQUARE,)).cancelled > 3.0


def test_certainty_is_a_jackknife_over_groups_in_which_the_law_is_refitted() -> None:
    own = measured(ROWS, (SQUARE,))
    sure = certainty(ROWS, own)
    whole, target = np.column_stack([ROWS.law, X**2]) * WEIGHT[:, None], ROWS.target * WEIGHT
    left, ratios = [], []
    for group in ROWS.groups:
        others = np.setdiff1d(np.arange(len(X)), group)
        both = np.linalg.lstsq(whole[others], target[others], rcond=None)[0]
        law = np.linalg.lstsq(whole[others, :-1], target[others], rcond=None)[0]
        left.append(both[-1])
        with_it, without = (
            np.sum((target[group] - c @ b) ** 2)
            for c, b in ((whole[group], both), (whole[group, :-1], law))
        )  # fmt: skip
        ratios.append(with_it / without)
    count = len(left)
    error = np.sqrt((count - 1) / count * np.sum((np.array(left) - np.mean(left)) ** 2))
    np.testing.assert_allclose(sure.errors, [error], rtol=1e-3)
    clipped = np.clip(ratios, 1.0 / STANDARD.group_ratio, STANDARD.group_ratio)
    assert sure.held == pytest.approx(1.0 - np.exp(np.mean(np.log(clipped))), rel=1e-3)
    assert sure.clear(own.theta) == pytest.approx(abs(own.theta[0]) / error, rel=1e-3)


def test_a_formula_is_as_clear_as_its_least_clear_coefficient() -> None:
    assert Certainty(np.array([0.1, 0.2]), 0.9).clear(np.array([-0.9, 1.0])) == pytest.approx(5.0)


def test_what_cancels_against_the_law_has_a_price_for_every_doubling() -> None:
    """0.3 for each doubling beyond four, and none below."""
    for cancelled, more in ((1.0, 0.0), (4.0, 0.0), (8.0, 0.3), (32.0, 0.9)):
        own = formula([LINE, SQUARE], [1.0, 1.0], cancelled=cancelled)
        assert own.price == pytest.approx(LINE.price + SQUARE.price + more)


def said(clear: float = 20.0, held: float = 0.5, **standing: float) -> str:
    """Return the objection to a formula of one term, so many standard errors from zero."""
    return objection(formula([LINE], [1.0], **standing), Certainty(np.array([1.0 / clear]), held), STANDARD)


@pytest.mark.parametrize(
    ("at", "beyond", "words"),
    [
        ({"left": 1.01 * STANDARD.formula_left}, {"left": 0.99 * STANDARD.formula_left}, "the law may have it"),
        ({"cancelled": 59.0}, {"cancelled": 61.0}, "cancels against the law"),
        ({"size": 0.0061}, {"size": 0.0059}, "of the range"),
        ({"clear": 7.9, "kept": 0.26}, {"clear": 7.9, "kept": 0.24}, "24% on conditions left out"),
        # of one that is plain less is asked
        ({"clear": 8.1, "kept": 0.09}, {"clear": 8.1, "kept": 0.07}, "7% on conditions left out"),
        ({"clear": 7.9, "held": 0.051}, {"clear": 7.9, "held": 0.049}, "5%, the law from the others too"),
        ({"clear": 8.1, "kept": 0.51, "held": -0.5}, {"clear": 8.1, "kept": 0.49, "held": -0.5}, "only 0%, the law"),
        ({"clear": 8.1, "kept": 0.51, "held": 0.0}, {"clear": 7.9, "kept": 0.51, "held": 0.0}, "the law from"),
        ({"clear": 4.1}, {"clear": 3.9}, "only 3.9 standard errors from zero"),
    ],
)
def test_an_objection_is_made_on_one_side_of_its_threshold(
    at: dict[str, float], beyond: dict[str, float], words: str
) -> None:
    assert said(**at) == ""
    assert words in said(**beyond)


def test_a_share_below_nothing_is_said_as_none() -> None:
    assert "only 0% on conditions left out" in said(kept=-0.5)
