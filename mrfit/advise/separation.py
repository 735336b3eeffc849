"""How far a test puts rivals apart: every pair, each as the true one, the other refitted to all data."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mrfit.advise.criterion import DifferenceInformation, added, without
from mrfit.advise.drives import Test
from mrfit.advise.specimen import Specimen, rows_of
from mrfit.advise.standing import FittedRival, stencil
from mrfit.core.specs import Array

# Samples of a test that are looked at; of a longer one every n-th, each standing for several
TEST_SAMPLES = 4000


@dataclass(frozen=True)
class PredictedOutput:
    """What a test would show of one rival.

    Attributes
    ----------
    centre
        Output at its optimum (N,), in standard errors of the noise.
    drawn
        Outputs at its draws (D, N).
    jacobian
        Sensitivities in the cube (N, F).
    """

    centre: Array
    drawn: Array
    jacobian: Array


@dataclass(frozen=True)
class TestOutcome:
    """What a test would show.

    Attributes
    ----------
    readings
        Of every rival.
    peak
        Largest output at any rival's optimum, in its unit.
    """

    readings: tuple[PredictedOutput, ...]
    peak: float

    @property
    def finite(self) -> bool:
        """Whether every rival can be simulated on it."""
        return all(np.isfinite(r.centre).all() and np.isfinite(r.jacobian).all() for r in self.readings)


@dataclass(frozen=True)
class RivalSet:
    """Rivals on the data there are.

    Attributes
    ----------
    standings, draws
        The rivals, and points (D, F) in the cube of each that may be the truth.
    known
        For the pair of a true rival and another one what the data say of their difference.
    noise
        Standard error of the output, in its unit.
    specimen
        The specimen.
    """

    standings: tuple[FittedRival, ...]
    draws: tuple[Array, ...]
    known: dict[tuple[int, int], DifferenceInformation]
    noise: float
    specimen: Specimen

    @classmethod
    def of(
        cls, standings: Sequence[FittedRival], draws: Sequence[Array], noise: float, specimen: Specimen
    ) -> "RivalSet":
        """Return the contest of fitted rivals."""
        excess = max(min(s.chi for s in standings), 1.0)
        known = {}
        for a, b in orders(standings):
            true, other = standings[a], standings[b]
            moved = true.jacobian @ (draws[a] - true.point).T
            apart = (true.errors - other.errors)[:, None] + moved
            size = len(other.point)
            known[a, b] = DifferenceInformation.of(
                np.vstack([other.jacobian / excess, np.diag(1.0 / other.prior)]),
                np.vstack([apart / excess, np.zeros((size, apart.shape[1]))]),
            )
        return cls(tuple(standings), tuple(draws), known, noise * excess, specimen)

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Every two rivals, by their places."""
        return list(combinations(range(len(self.standings)), 2))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the rivals."""
        return tuple(s.rival.name for s in self.standings)

    def apart(self, test: Test, most: float) -> Array | None:
        """Return the distances of a test; None where a rival cannot be simulated or takes more than a force in N."""
        shown = self.shown(test)
        return self.distances(shown) if shown.finite and shown.peak <= most else None

    def shown(self, test: Test) -> TestOutcome:
        """Return what a test would show of every rival."""
        channels = self.specimen.driven(test)
        first = self.standings[0]
        with np.errstate(all="ignore"):
            cold = first.assembly.simulate(
                rows_of(channels, first.assembly), first.cube.to_theta(first.point[None, :]), test.dt
            )[0]
            warm = self.specimen.heated(channels, cold, test.dt)
            readings, peak = [], 0.0
            for standing, drawn in zip(self.standings, self.draws, strict=True):
                reading, most = self._reading(standing, drawn, warm, test)
                readings.append(reading)
                peak = max(peak, most)
        return TestOutcome(tuple(readings), peak)

    def _reading(
        self, standing: FittedRival, drawn: Array, channels: dict[str, Array], test: Test
    ) -> tuple[PredictedOutput, float]:
        points, steps = stencil(standing.point)
        theta = standing.cube.to_theta(np.vstack([points, drawn]))
        rows = standing.assembly.simulate(rows_of(channels, standing.assembly), theta, test.dt)
        every = -(-rows.shape[1] // TEST_SAMPLES)
        rows, peak = rows[:, ::every] * (np.sqrt(every) / self.noise), float(np.abs(rows[0]).max())
        if standing.assembly.spec.free_offset:
            time = np.linspace(-1.0, 1.0, rows.shape[1])
            rows = without(rows.T, np.stack([np.ones_like(time), time], axis=1)).T
        count = len(points)
        jacobian = ((rows[1:count] - rows[0]) / steps[:, None]).T
        return PredictedOutput(rows[0], rows[count:], jacobian), peak

    def distances(self, shown: TestOutcome) -> Array:
        """Return by how many standard errors a test puts each pair apart, in the mean over draws, (pairs,)."""
        found = {}
        for a, b in self.known:
            true, other = shown.readings[a], shown.readings[b]
            gained = added(self.known[a, b], other.jacobian, (true.drawn - other.centre).T)
            found[a, b] = float(np.mean(gained))
        return np.array([min(found[o] for o in (pair, pair[::-1]) if o in found) for pair in self.pairs])

    def left(self) -> Array:
        """Return by how many standard errors the data there are put each pair apart (pairs,), no test added."""
        far = {order: float(np.mean(np.sqrt(one.left()))) for order, one in self.known.items()}
        return np.array([min(far[o] for o in (pair, pair[::-1]) if o in far) for pair in self.pairs])


def orders(standings: Sequence[FittedRival]) -> list[tuple[int, int]]:
    """Return the pairs of a true rival and another that may pass for it: it does not hold the true one."""
    count = range(len(standings))
    effects = [set(s.rival.effects) for s in standings]
    return [(a, b) for a in count for b in count if a != b and not effects[a] <= effects[b]]
