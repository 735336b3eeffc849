"""The test that is worth most per second: Sobol points of every kind of test, the best of them polished by CMA-ES."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.advise.drives import DIMENSIONS, RigBench, Test, lengthened, test_at
from mrfit.core.progress import Progress
from mrfit.core.specs import Array, Mask
from mrfit.core.workers import give_up
from mrfit.optimizers.cma import strategy_of

# Points of each kind that are looked at, by powers of two, and kinds that are polished
SOBOL, TESTS_POLISHED = 5, 3
# Evaluations of a polish, its population and first spread
TEST_EVALUATIONS, TEST_POPULATION, TEST_SPREAD = 40, 8, 0.15
# Standard errors apart from which on a test is long enough
SCORE_ENOUGH = 30.0

Judge = Callable[[Test], "ScoredTest | None"]


@dataclass(frozen=True)
class ScoredTest:
    """A test and what it is worth.

    Attributes
    ----------
    test
        The test.
    amounts
        What it gives of each thing wanted, in standard errors or in a unit of information, (M,).
    """

    test: Test
    amounts: Array

    def worth(self, wanted: Mask) -> float:
        """Return the least of what is wanted (M,), a mask, squared and per second: it grows in proportion to time."""
        return float(np.min(self.amounts[wanted]) ** 2) / self.test.cost if wanted.any() else 0.0


@dataclass(frozen=True)
class TestChoice:
    """Result of a search.

    Attributes
    ----------
    tests
        The best test of each kind, the best kind first.
    most
        The most that any test looked at gives of each thing wanted, (M,).
    looked_at, refused
        Tests simulated, and how many of these would break a limit of the rig or cannot be simulated.
    """

    tests: tuple[ScoredTest, ...]
    most: Array
    looked_at: int
    refused: int


@dataclass(frozen=True)
class Task:
    """What is looked for.

    Attributes
    ----------
    bench
        The rig.
    judge
        Simulates a test; None if it breaks a limit that only a simulation shows.
    wanted
        Maps the most that any test gives of each thing (M,) to which of them count.
    kinds
        Kinds of test to look at.
    enough
        A test that gives less of something wanted is made longer.
    """

    bench: RigBench
    judge: Judge
    wanted: Callable[[Array], Mask]
    kinds: Sequence[str]
    enough: float = SCORE_ENOUGH


@dataclass
class _TestSearch:
    """Tests judged so far."""

    task: Task
    looked_at: int = 0
    refused: int = 0

    def at(self, kind: str, point: Array) -> ScoredTest | None:
        give_up()
        found = self.task.judge(test_at(kind, np.clip(point, 0.0, 1.0), self.task.bench))
        self.looked_at += 1
        self.refused += found is None
        return found


@dataclass(frozen=True)
class _Place:
    kind: str
    point: Array
    judged: ScoredTest


def choose(task: Task, seed: int, progress: Progress) -> TestChoice:
    """Return the best test of each kind.

    Parameters
    ----------
    task
        What is looked for.
    seed
        Of the Sobol points and the polish.
    progress
        Reports every kind.
    """
    from scipy.stats import qmc

    search, kinds = _TestSearch(task), task.kinds
    places: list[_Place] = []
    for k, kind in enumerate(kinds):
        progress("tests", k, len(kinds) + 1)
        points = qmc.Sobol(DIMENSIONS, rng=np.random.default_rng([seed, k])).random_base2(SOBOL)
        places += [_Place(kind, p, found) for p in points if (found := search.at(kind, p)) is not None]
    if not places:
        return TestChoice((), np.zeros(0), search.looked_at, search.refused)
    mask = task.wanted(np.max([p.judged.amounts for p in places], axis=0))
    best = {kind: [p for p in places if p.kind == kind] for kind in kinds}
    ranked = [max(some, key=lambda p: p.judged.worth(mask)) for some in best.values() if some]
    ranked.sort(key=lambda p: -p.judged.worth(mask))
    rng = np.random.default_rng([seed, len(kinds)])
    progress("tests", len(kinds), len(kinds) + 1)
    ranked = [_polished(search, p, mask, rng) if k < TESTS_POLISHED else p for k, p in enumerate(ranked)]
    ranked.sort(key=lambda p: -p.judged.worth(mask))
    tests = tuple(_long_enough(task, p.judged, mask) for p in ranked)
    most = np.max([p.judged.amounts for p in (*places, *ranked)], axis=0)
    progress("tests", len(kinds) + 1, len(kinds) + 1)
    return TestChoice(tests, most, search.looked_at, search.refused)


def _polished(search: _TestSearch, place: _Place, mask: Mask, rng: np.random.Generator) -> _Place:
    """Return the best place that CMA-ES finds about one."""
    start = np.clip(place.point, 0.01, 0.99)
    strategy = strategy_of(start, TEST_SPREAD, TEST_POPULATION, rng, maxfevals=TEST_EVALUATIONS)
    best = place
    while not strategy.stop():
        points = strategy.ask()
        costs = []
        for point in points:
            found = search.at(place.kind, np.asarray(point))
            worth = found.worth(mask) if found is not None else 0.0
            costs.append(-np.log(max(worth, 1e-300)))
            if found is not None and worth > best.judged.worth(mask):
                best = _Place(place.kind, np.asarray(point), found)
        strategy.tell(points, costs)
    return best


def _long_enough(task: Task, judged: ScoredTest, mask: Mask) -> ScoredTest:
    """Return a test run as often as puts all that is wanted far enough apart, within the longest test."""
    least = float(np.min(judged.amounts[mask])) if mask.any() else 0.0
    if not 0.0 < least < task.enough:
        return judged
    longer = lengthened(judged.test, (task.enough / least) ** 2, task.bench)
    found = None if longer is judged.test else task.judge(longer)
    return found or judged
