"""Work of a discovery by its size."""

from types import SimpleNamespace
from typing import Any

import pytest

from mrfit.discover.evidence.other_laws import candidates, slow_laws
from mrfit.discover.evidence.work import Effort, limits_of_base, work_of
from mrfit.discover.policy import STANDARD
from mrfit.search.limits import Limits
from mrfit.settings.fit import PATIENCE
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


@pytest.mark.parametrize(
    ("model", "orders", "limited"),
    [
        ("tanh", (), False),
        ("boucwen", (("c", 1),), False),
        ("boucwen", (("kappa", 1),), True),
        ("dahl", (), True),
        ("spencer", (), True),
    ],
)
def test_the_first_fit_of_a_law_along_no_curve_has_a_limit_by_its_samples_and_the_same_patience(
    model: str, orders: tuple[tuple[str, int], ...], limited: bool
) -> None:
    assembly = assemble(model, CurrentDependence(orders, 0.0, 2.0) if orders else None)
    most = int(STANDARD.most_base_work / 50_000)
    limits = limits_of_base(assembly, 50_000, 9, STANDARD)
    assert limits == (Limits(most, stall=PATIENCE * 10_000 / most) if limited else Limits())
    assert limits_of_base(assembly, 1_000, 9, STANDARD) == Limits()


def test_laws_that_are_stepped_are_not_fitted_where_fits_of_all_would_be_too_much_work() -> None:
    bench = SimpleNamespace(channels={"displacement", "velocity"}, samples=lambda role: 100, simulated=lambda role: 100)
    fitter: Any = SimpleNamespace(base="tanh", bench=bench)
    base: Any = SimpleNamespace(assembly=assemble("tanh"))
    names = list(candidates(fitter, "force", STANDARD))
    last = int(STANDARD.most_effort_told) - 100 * len(names)
    stepped = tuple(n for n in names if work_of(assemble(n), 100) > 0)
    assert {"boucwen", "spencer"} <= set(stepped) and "bingham" not in stepped
    for spent, left_out in ((last, ()), (last + 1, stepped)):
        fitter.effort = Effort(spent)
        assert slow_laws(fitter, base, lambda name: None, STANDARD) == left_out
