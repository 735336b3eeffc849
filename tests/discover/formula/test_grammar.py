"""Terms that a formula is looked for among."""

import numpy as np
import pytest

from mrfit.discover.formula.factors import FACTOR_KINDS, Term
from mrfit.discover.formula.grammar import from_an_origin, grammar, mirrored, over_grid, products
from tests.discover.formula.plain import term

V = np.linspace(-1.5, 1.5, 61)
ALL = grammar("xvaiTt")


def variables(made: Term) -> set[str]:
    return {f.variable for f in made.factors}


@pytest.mark.parametrize("absent", ["i", "t", "T"])
def test_what_does_not_move_is_in_no_term_and_what_moves_is_in_some(absent: str) -> None:
    moving = "xvaiTt".replace(absent, "")
    assert not any(absent in variables(t) for t in grammar(moving))
    assert any(absent in variables(t) for t in ALL)
    # all else is as it was
    assert set(grammar(moving)) == {t for t in ALL if absent not in variables(t)}


def test_no_term_stands_twice() -> None:
    assert len(set(ALL)) == len(ALL)
    readings = {tuple(sorted(t.factors, key=repr)) for t in ALL}
    assert len(readings) == len(ALL)


def test_a_term_is_tried_at_every_constant_of_its_grid() -> None:
    assert [f.constants for f in over_grid("x", "line", "bump")] == [(), *FACTOR_KINDS["bump"].grid]
    made = products(over_grid("x", "over"), over_grid("v", "side", "line"))
    assert len(made) == len(set(made)) == 6 * 3
    assert all(t.structure in {("v side", "x over"), ("v line", "x over")} for t in made)


def test_a_hinge_of_the_velocity_opens_with_the_motion() -> None:
    """One at rest is a side; one that opens before rest acts at rest, too, and is a side with a constant."""
    hinges = [f for t in ALL for f in t.factors if f.variable == "v" and f.kind in ("over", "under")]
    assert {f.kind for f in hinges} == {"over", "under"}
    for f in hinges:
        assert f.of(np.zeros(1))[0] == 0.0
        assert abs(f.constants[0]) > 0.0


@pytest.mark.parametrize(
    "made",
    [
        term(("v", "above", 2.0)),
        term(("v", "below", 0.7)),
        term(("v", "size-power", 1.5)),
        term(("v", "size")),
        term(("v", "square")),
        term(("v", "over", 0.3)),
        term(("v", "under", -0.3)),
        term(("x", "square"), ("v", "size")),
    ],
)
def test_a_mirror_image_differs_by_a_force_that_turns_with_the_velocity(made: Term) -> None:
    """Beside a law of open form they are one, whatever the factor between them."""
    others = mirrored(made)
    assert others and made not in others
    values = {"x": np.full(len(V), 0.8), "v": V}
    even = made.of(values) + made.of({**values, "v": -V})
    for other in others:
        own = other.of(values) + other.of({**values, "v": -V})
        ratio = float(even @ own / (own @ own))
        np.testing.assert_allclose(even, ratio * own, atol=1e-12)
        assert ratio > 0.0


def test_a_one_sided_term_has_its_other_side_and_its_even_part_as_mirror_images() -> None:
    def images(made: Term) -> set[tuple[str, tuple[float, ...]]]:
        return {(f.kind, f.constants) for t in mirrored(made) for f in t.factors if f.variable == "v"}

    assert images(term(("v", "above", 2.0))) == {("below", (2.0,)), ("square", ())}
    assert images(term(("v", "above", 1.0))) == {("below", (1.0,)), ("size", ())}
    assert images(term(("v", "below", 1.4))) == {("above", (1.4,)), ("size-power", (1.4,))}
    assert images(term(("v", "size"))) == {("above", (1.0,)), ("below", (1.0,))}
    assert images(term(("v", "over", 0.3))) == {("under", (-0.3,))}


@pytest.mark.parametrize(
    "made",
    [
        term(("v", "line")),
        term(("v", "side", 0.1)),
        term(("x", "above", 2.0)),
        # two factors of the velocity: the product is not one-sided by one of them
        term(("v", "size"), ("v", "line")),
    ],
)
def test_what_is_not_one_sided_in_the_velocity_has_no_mirror_image(made: Term) -> None:
    assert mirrored(made) == []


@pytest.mark.parametrize(
    ("made", "opened"),
    [
        (term(("x", "square")), term(("x", "square-from", 0.0))),
        (term(("x", "cube"), ("i", "line")), term(("x", "cube-from", 0.0), ("i", "line"))),
        (term(("x", "size"), ("v", "size")), term(("x", "size-from", 0.0), ("v", "size"))),
        (term(("x", "line")), None),
        (term(("v", "square")), None),
        (term(("x", "over", 0.5)), None),
    ],
)
def test_the_origin_of_a_power_of_the_place_is_left_open(made: Term, opened: Term | None) -> None:
    found = from_an_origin(made)
    assert found == opened
    if found:
        u = dict.fromkeys("xvi", np.linspace(-1.0, 1.0, 9))
        np.testing.assert_allclose(found.of(u), made.of(u), atol=1e-15)
