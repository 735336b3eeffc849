"""The search for the best test, with judges whose best is known: no model is simulated."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mrfit.advise.choose import (
    SCORE_ENOUGH,
    SOBOL,
    TEST_EVALUATIONS,
    TEST_POPULATION,
    TESTS_POLISHED,
    ScoredTest,
    Task,
    TestChoice,
    choose,
)
from mrfit.advise.drives import RigBench, Test
from mrfit.core.progress import silent
from mrfit.core.specs import Array, Mask
from tests.advise.test_drives import press

TestChoice.__test__ = False
BENCH = replace(press(frequency=6.0), dt=0.02)
TWO_HERTZ = replace(press(frequency=[2.0, 2.02], seconds=30.0), dt=0.02)
POINTS = 2**SOBOL


def everything(most: Array) -> Mask:
    return np.ones(len(most), dtype=np.bool_)


def search(
    amounts: Callable[[Test], list[float] | None],
    kinds: tuple[str, ...] = ("sine",),
    wanted: Callable[[Array], Mask] = everything,
    seed: int = 0,
    enough: float = 0.0,
    bench: RigBench = BENCH,
) -> TestChoice:
    def judge(test: Test) -> ScoredTest | None:
        found = amounts(test)
        return None if found is None else ScoredTest(test, np.array(found))

    return choose(Task(bench, judge, wanted, kinds, enough), seed, silent)


def near(frequency: float) -> Callable[[Test], list[float]]:
    """A judge to whom tests are worth most at a frequency, whatever their length."""
    return lambda test: [np.sqrt(test.cost) * np.exp(-(np.log(test.numbers["frequency"] / frequency) ** 2))]


def scored(*amounts: float, waiting: float = 0.0) -> ScoredTest:
    test = Test("sine", 0.5, np.zeros((3, 16)), np.empty(0), np.empty(0), waiting)
    return ScoredTest(test, np.array(amounts))


def test_a_test_is_worth_its_least_wanted_amount_squared_per_second_with_its_waiting() -> None:
    both, second = np.array([True, True]), np.array([False, True])
    assert scored(2.0, 4.0).worth(both) == pytest.approx(4.0 / 8.0)
    assert scored(2.0, 4.0).worth(second) == pytest.approx(16.0 / 8.0)
    assert scored(2.0, 4.0, waiting=24.0).worth(both) == pytest.approx(4.0 / 32.0)
    assert scored(2.0, 4.0).worth(np.array([False, False])) == 0.0


@pytest.mark.parametrize("frequency", [1.3, 3.0])
def test_the_best_place_is_found_between_the_points_that_are_looked_at(frequency: float) -> None:
    found = search(near(frequency)).tests[0]
    assert found.test.numbers["frequency"] == pytest.approx(frequency, rel=0.03)
    assert found.worth(np.array([True])) > 0.998


def test_kinds_are_in_the_order_of_their_worth_and_each_has_its_best() -> None:
    size = {"sine": 1.0, "triangle": 3.0, "repeat": 2.0}
    found = search(lambda test: [size[test.kind] * near(2.0)(test)[0]], ("sine", "triangle", "repeat"))
    assert [one.test.kind for one in found.tests] == ["triangle", "repeat", "sine"]


def test_the_best_three_kinds_alone_are_polished() -> None:
    kinds = ("sine", "triangle", "repeat", "sweep")
    looked: dict[str, int] = dict.fromkeys(kinds, 0)

    def judge(test: Test) -> list[float]:
        looked[test.kind] += 1
        return [(1.0 + kinds.index(test.kind)) * near(2.0)(test)[0]]

    found = search(judge, kinds)
    assert len(kinds) == TESTS_POLISHED + 1 and looked["sine"] == POINTS
    assert all(looked[k] >= POINTS + TEST_EVALUATIONS - TEST_POPULATION for k in kinds[1:])
    assert found.looked_at == sum(looked.values()) and found.refused == 0


def test_what_cannot_be_simulated_is_counted_and_never_chosen() -> None:
    def judge(test: Test) -> list[float] | None:
        return None if test.numbers["frequency"] > 2.0 else [test.numbers["frequency"]]

    found = search(judge)
    assert found.tests[0].test.numbers["frequency"] <= 2.0
    assert 0 < found.refused < found.looked_at
    none = search(lambda _: None, ("sine", "triangle"))
    assert none.tests == () and none.refused == none.looked_at == 2 * POINTS and none.most.size == 0
    # a kind that is refused as a whole has no test
    kinds = ("sine", "triangle")
    assert [one.test.kind for one in search(lambda t: [1.0] if t.kind == "triangle" else None, kinds).tests] == [
        kinds[1]
    ]


def test_what_is_wanted_follows_from_the_most_that_any_test_gives() -> None:
    asked: list[Array] = []

    def amounts(test: Test) -> list[float]:
        # of the second thing the slowest tests give most, of the third none gives any
        return [near(5.0)(test)[0], 50.0 * near(0.5)(test)[0], 0.0]

    def wanted(most: Array) -> Mask:
        asked.append(most)
        return most > 20.0

    found = search(amounts, wanted=wanted)
    [most] = asked
    assert most[1] > 20.0 > most[0] > most[2] == 0.0
    assert found.tests[0].test.numbers["frequency"] == pytest.approx(max(0.5, BENCH.reach.low), rel=0.35)
    # the most of all tests, those of the polish among them, one thing after the other
    assert np.all(found.most >= most) and found.most[1] == found.tests[0].amounts[1]


def test_the_same_seed_finds_the_same_and_another_looks_elsewhere() -> None:
    one, same, other = (search(near(2.0), seed=s).tests[0].test.point for s in (0, 0, 1))
    assert np.array_equal(one, same) and not np.array_equal(one, other)


@pytest.mark.parametrize("amount", [SCORE_ENOUGH / 1.44, SCORE_ENOUGH / 1.1])
def test_a_test_is_made_longer_until_it_gives_enough(amount: float) -> None:
    # of eight cycles at 2 Hz this amount, which grows with the root of the time
    [found] = search(lambda t: [amount * np.sqrt(t.seconds / 4.0)], enough=SCORE_ENOUGH, bench=TWO_HERTZ).tests
    assert found.test.seconds > 4.5 and SCORE_ENOUGH <= found.amounts[0] < 1.2 * SCORE_ENOUGH


@pytest.mark.parametrize(
    ("amount", "seconds"), [(1.02 * SCORE_ENOUGH, 4.0), (9.0 * SCORE_ENOUGH, 4.0), (0.0, 4.0), (1e-3, 30.0)]
)
def test_a_test_that_gives_enough_or_nothing_stays_and_none_is_longer_than_the_longest(
    amount: float, seconds: float
) -> None:
    [found] = search(lambda t: [amount * np.sqrt(t.seconds / 4.0)], enough=SCORE_ENOUGH, bench=TWO_HERTZ).tests
    assert found.test.seconds == pytest.approx(seconds, abs=0.6)


def test_a_longer_test_that_breaks_a_limit_is_not_taken() -> None:
    [found] = search(lambda t: [1.0] if t.seconds < 5.0 else None, enough=SCORE_ENOUGH, bench=TWO_HERTZ).tests
    assert found.test.seconds == pytest.approx(4.0, abs=0.1)
