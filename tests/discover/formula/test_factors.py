"""Factors and their products: how they scale with a unit, what they cost, and which means only a law knows."""

import numpy as np
import pytest

from mrfit.discover.formula.factors import FACTOR_KINDS, FUNCTIONS, ODD, Factor, Term
from tests.discover.formula.plain import term

U = np.linspace(-0.9, 0.9, 37)


@pytest.mark.parametrize("kind", FACTOR_KINDS)
def test_in_another_unit_a_factor_is_the_same_but_for_the_power_that_it_states(kind: str) -> None:
    """A coefficient in SI rests on this: f(s*u) at places s*c is s^power times f(u) at places c."""
    own = FACTOR_KINDS[kind]
    constants = own.grid[-1]
    power = constants[0] if own.power == "first" else own.power
    s = 1.7
    moved = tuple(s * c if k in own.places else c for k, c in enumerate(constants))
    divided = 1.0
    if own.inverse:
        # said as its inverse, the first constant has the unit of u, and the factor was divided by all of them
        moved, divided = (constants[0] / s, *constants[1:]), s
    scaled = FUNCTIONS[kind](s * U, *moved) / divided
    np.testing.assert_allclose(scaled, s**power * FUNCTIONS[kind](U, *constants), rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("kind", FACTOR_KINDS)
def test_factors_start_within_their_bounds_and_cost_no_less_than_a_line(kind: str) -> None:
    own = FACTOR_KINDS[kind]
    for constants in own.grid:
        assert all(low <= c <= high for c, (low, high) in zip(constants, own.bounds, strict=True))
    assert own.price > FACTOR_KINDS["line"].price or kind == "line"


@pytest.mark.parametrize("kind", ODD)
def test_factors_said_to_turn_with_their_variable_do(kind: str) -> None:
    constants = FACTOR_KINDS[kind].grid[0]
    np.testing.assert_allclose(FUNCTIONS[kind](-U, *constants), -FUNCTIONS[kind](U, *constants), atol=1e-15)


@pytest.mark.parametrize(
    ("made", "price"),
    [
        (term(("x", "line")), 1.0),
        (term(("x", "line"), ("v", "line")), 1.5),
        (term(("x", "square")), 1.0 + FACTOR_KINDS["square"].price),
        (term(("x", "bump", 0.0, 0.2), ("v", "side", 0.1)), 1.5 + 0.8 + 0.3),
    ],
)
def test_a_line_costs_one_and_every_further_factor_half_as_much(made: Term, price: float) -> None:
    assert made.price == pytest.approx(price)


def test_constants_of_all_factors_stand_one_after_the_other() -> None:
    made = term(("x", "bump", 0.1, 0.2), ("v", "line"), ("v", "side", 0.05))
    assert made.constants == (0.1, 0.2, 0.05)
    assert made.bounds == (*FACTOR_KINDS["bump"].bounds, *FACTOR_KINDS["side"].bounds)
    assert made.at((0.3, 0.4, 0.06)) == term(("x", "bump", 0.3, 0.4), ("v", "line"), ("v", "side", 0.06))
    assert made.at(made.constants) == made


def test_terms_of_the_same_factors_in_another_order_are_of_one_structure() -> None:
    one, other = term(("x", "bump", 0.1, 0.2), ("v", "line")), term(("v", "line"), ("x", "bump", 0.5, 0.3))
    assert one.structure == other.structure != term(("x", "line"), ("v", "line")).structure


@pytest.mark.parametrize(
    ("made", "has_gain"),
    [
        (term(("x", "square"), ("L", "line")), True),
        (term(("x", "square"), ("v", "side", 0.1)), True),
        (term(("x", "square"), ("i", "line"), ("v", "line")), True),
        (term(("x", "square")), False),
        # no law makes what stands beside the place: its mean is known
        (term(("x", "square"), ("i", "line")), False),
        (term(("x", "square"), ("a", "line")), False),
        (term(("x", "square"), ("v", "size")), False),
        (term(("x", "square"), ("v", "line"), ("T", "line")), False),
        # two factors of the place, or none
        (term(("x", "square"), ("x", "line"), ("v", "line")), False),
        (term(("v", "line"), ("T", "line")), False),
    ],
)
def test_the_mean_of_a_gain_of_the_place_on_a_force_of_a_law_is_the_law_s(made: Term, has_gain: bool) -> None:
    assert made.gain == (made.factors[0] if has_gain else None)


def test_a_mean_is_taken_off_the_gain_alone() -> None:
    x, v = np.array([0.5, -1.0]), np.array([2.0, 3.0])
    values = {"x": x, "v": v}
    np.testing.assert_allclose(term(("x", "square"), ("v", "line")).of(values, 0.25), (x**2 - 0.25) * v)
    np.testing.assert_allclose(term(("v", "line"), ("x", "square")).of(values, 0.25), (x**2 - 0.25) * v)
    np.testing.assert_allclose(term(("x", "square"), ("v", "size")).of(values, 0.25), x**2 * np.abs(v))


def test_a_factor_is_told_by_variable_and_kind() -> None:
    assert Factor("x", "bump", (0.1, 0.2)).key == Factor("x", "bump", (0.3, 0.2)).key != Factor("v", "bump").key
