"""Work of a discovery by its size."""

import pytest

from mrfit.discover.evidence.work import Effort, work_of
from mrfit.discover.policy import STANDARD
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence


def test_what_is_left_out_is_said_once() -> None:
    effort = Effort(spent=7)
    assert [effort.allows(most, what) for most, what in ((7, "a"), (6, "b"), (6, "b"), (5, "c"))] == [
        True,
        *3 * [False],
    ]
    assert effort.left_out == ["b", "c"]


@pytest.mark.parametrize(
    ("model", "orders", "numbers"),
    [
        ("tanh", (), 0),
        # x0, kappa, beta, gamma and n; the others are linear
        ("boucwen", (), 5),
        ("boucwen", (("c", 1), ("alpha", 2)), 5),
        # a shape that depends on current has no curve
        ("boucwen", (("c", 1), ("kappa", 1)), 6 * STANDARD.rough_weight),
        # dahl has no curve: it is stepped in any case
        ("dahl", (), 1),
        ("dahl", (("rho", 1),), 2),
    ],
)
def test_the_work_of_a_fit_is_that_of_laws_that_are_stepped(
    model: str, orders: tuple[tuple[str, int], ...], numbers: float
) -> None:
    assert work_of(assemble(model, CurrentDependence(orders, 0.0, 2.0) if orders else None), 100) == 100 * numbers
