"""Laws of current that are planted, and what an oracle that knows how they are drawn can tell from a few currents."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.simulate.current_dependence import FORMS, LOG, coordinate

# Of a share u of the range of current: low is the value at 0, rise about its gain, bend from 0 to 1
FAMILIES: dict[str, Callable[..., Array]] = {
    "line": lambda u, low, rise, _: low + rise * u,
    "parabola": lambda u, low, rise, bend: low + rise * (u + (0.25 + 0.25 * bend) * u * (1.0 - u)),
    "exponential": lambda u, low, _, bend: low * np.exp((1.2 + 1.2 * bend) * u),
    "saturation": lambda u, low, rise, bend: low + rise * (1.0 - np.exp(-u / (0.2 + 0.4 * bend))),
    "tanh": lambda u, low, rise, bend: low + rise * np.tanh((1.2 + 1.8 * bend) * u),
    "rational": lambda u, low, rise, bend: low + rise * u * (1.2 + 0.6 * bend) / (u + 0.2 + 0.6 * bend),
    "power": lambda u, low, rise, bend: low + rise * u ** (0.6 + bend),
}
LOW, RISE, BEND = (0.1, 0.4), (1.0, 2.2), (0.0, 1.0)
# Force from end to end as a multiple of the greatest strength; error that a fit at a single current leaves, as a share
# of it; error of a strength that such a fit gives, as a share of that
FORCE, LEFT, KNOWN = 2.6, (0.003, 0.05), 0.3
# Laws that the oracle knows, and the fewest that it weighs
LAWS, FEWEST = 50_000, 50


def law_of(rng: np.random.Generator) -> tuple[str, Callable[[float], float]]:
    """Return the law of a strength over a share of the range of current, with its name."""
    values = [rng.uniform(*ends) for ends in (LOW, RISE, BEND)]
    name = str(rng.choice(list(FAMILIES)))
    return name, lambda u: float(FAMILIES[name](u, *values))


def currents_of(levels: int, low: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return trained currents from ``low`` to 1 and those between them, as shares of the range."""
    trained = np.linspace(low, 1.0, levels)
    if rng.random() < 0.4:
        trained[1:-1] += rng.uniform(-0.25, 0.25, levels - 2) * (trained[1] - trained[0])
    between = (trained[1:] + trained[:-1]) / 2.0 + rng.uniform(-0.15, 0.15, levels - 1) * np.diff(trained)
    return trained, between


@dataclass(frozen=True)
class Population:
    """Laws by their family (N,) and values of low, rise and bend (3, N)."""

    families: Index
    values: Array

    @classmethod
    def drawn(cls, count: int, rng: np.random.Generator) -> "Population":
        """Return as many laws as asked for."""
        values = np.array([rng.uniform(*ends, count) for ends in (LOW, RISE, BEND)])
        return cls(rng.integers(0, len(FAMILIES), count), values)

    def part(self, members: Index) -> "Population":
        """Return some of the laws."""
        return Population(self.families[members], self.values[:, members])

    def at(self, currents: Array) -> Array:
        """Return the values (A, N) at currents (A,)."""
        found = np.empty((len(currents), len(self.families)))
        for k, law in enumerate(FAMILIES.values()):
            own = self.families == k
            found[:, own] = law(currents[:, None], *self.values[:, own])
        return found


def oracle(levels: int, count: int, seed: int) -> Array:
    """Return the error at currents between, over the best form's, of laws that an oracle takes (count,).

    A strength is known at some currents, to the error of a fit there. The oracle knows how laws are drawn. It takes
    the form and order of least expected logarithm of the error over the best one's.
    """
    rng = np.random.default_rng(seed)
    population, quotients = Population.drawn(LAWS, rng), np.empty(count)
    candidates = [(form, order) for form in FORMS for order in range(1, levels)]
    for row in range(count):
        trained, between = currents_of(levels, 0.0 if rng.random() < 0.8 else 0.2, rng)
        planted = Population.drawn(1, rng)
        seen, truth = planted.at(trained), planted.at(between)
        left = FORCE * float(seen.max()) * float(np.exp(rng.uniform(*np.log(LEFT))))
        chances = -0.5 * np.sum(((population.at(trained) - seen) / (KNOWN * left)) ** 2, axis=0)
        likely = np.argsort(chances)[-max(FEWEST, int(np.sum(chances > -5.0))) :]
        weights = np.exp(chances[likely] - chances[likely].max())
        errors, expected = [], []
        for form, order in candidates:
            found = _through(form, order, trained, seen, between)
            errors.append(float(np.sqrt(left**2 + np.mean((found - truth) ** 2))))
            others = (found - population.part(likely).at(between)) ** 2
            expected.append(0.5 * float(weights @ np.log(left**2 + np.mean(others, axis=0))))
        quotients[row] = errors[int(np.argmin(expected))] / min(errors)
    return quotients


def _through(form: str, order: int, currents: Array, values: Array, between: Array) -> Array:
    """Return the values (A, 1) between of the law of a form nearest to values (L, 1) at currents."""
    targets = np.log(values) if form == LOG else values
    basis, beyond = (np.vander(coordinate(i, (0.0, 1.0), form), order + 1) for i in (currents, between))
    found: Array = beyond @ np.linalg.lstsq(basis, targets, rcond=None)[0]
    return np.exp(found) if form == LOG else found
