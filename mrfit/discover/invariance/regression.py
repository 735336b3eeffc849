"""Answers to the questions of a decision that takes no law as given, by regression beside the best law."""

from collections.abc import Mapping, Sequence

import numpy as np

from mrfit.core.specs import Array, Invariance
from mrfit.discover.invariance.estimate import plain_table, refine, table
from mrfit.discover.invariance.generic import broken, columns_of, forces_of
from mrfit.discover.invariance.screening import contribution, level_of, screened
from mrfit.discover.invariance.setting import RegressionData
from mrfit.discover.invariance.standing import described, scatter
from mrfit.discover.invariance.weights import equal, residuals, rms, weights_of
from mrfit.discover.policy import Policy
from mrfit.discover.selection.law_rules import LawFit, LawScreening, State, TestedEffect
from mrfit.io.schemas.discovery import BrokenInvariance

TINY = 1e-300


class Regression:
    """Answers by regression; it is a ``LawSource``.

    Parameters
    ----------
    setting, further
        The data, with the horizon that effects are chosen at, and with one ``longer_memory`` times as long.
    policy
        The thresholds of an invariance that is broken.
    """

    def __init__(self, setting: RegressionData, further: RegressionData, policy: Policy) -> None:
        self._settings, self._policy = (setting, further), policy
        self.library = {n: TestedEffect(e.breaks.invariance, level_of(e), e.constant) for n, e in setting.known.items()}
        self.groups = further.count
        self._weights: dict[tuple[object, ...], list[Array]] = {}

    def screen(self, state: State, weighed: State) -> LawScreening:
        """Return the screening of every effect, and of every two, beside a state."""
        return screened(self._settings[0], self._weighed(weighed, False), arrays(state))

    def refit(self, start: State, weighed: State, names: Sequence[str], level: int, longer: bool = False) -> LawFit:
        """Return effects at their best numbers, with the standing of some."""
        setting, weights = self._settings[longer], self._weighed(weighed, longer)
        fitted = refine(setting, weights, arrays(start), level)
        state = {n: tuple(theta.tolist()) for n, theta in fitted.state.items()}
        return LawFit(state, tuple(described(setting, weights, fitted, name) for name in names))

    def left(self, state: State, longer: bool = False) -> float:
        """Return the mean squared error that the best law leaves beside effects as they are."""
        setting, own = self._settings[longer], arrays(state)
        return rms(residuals(setting, own, plain_table(setting, equal(setting), own))) ** 2

    def broken(self, state: State, longer: bool = False) -> tuple[BrokenInvariance, ...]:
        """Return the invariances that something without a name breaks, the clearest first."""
        return tuple(broken(self._settings[longer], self._weighed(state, longer), arrays(state), self._policy))

    def beside(self, state: State, name: str, invariance: Invariance) -> tuple[float, float]:
        """Return share and standard errors of an effect beside the flexible terms of an invariance."""
        return beside(self._settings[0], self._weighed(state, False), arrays(state), name, invariance)

    def _weighed(self, state: State, longer: bool) -> list[Array]:
        key = (longer, *state.items())
        if key not in self._weights:
            self._weights[key] = weights_of(self._settings[longer], arrays(state))
        return self._weights[key]


def arrays(state: State) -> Mapping[str, Array]:
    """Return a state with parameters (Q,)."""
    return {name: np.array(theta) for name, theta in state.items()}


def beside(
    setting: RegressionData, weights: Sequence[Array], state: Mapping[str, Array], name: str, invariance: Invariance
) -> tuple[float, float]:
    """Return the share of an effect beside the flexible terms of an invariance, and its standard errors."""
    effect = setting.known[name]
    rest = {n: t for n, t in state.items() if n != name}
    law = table(setting, weights, state).law
    terms = columns_of(setting, state, invariance, forces_of(setting, state, law))
    own = contribution(setting, state, name, law)
    made = table(setting, weights, rest, [[*t, c] for t, c in zip(terms, own, strict=True)])
    level, offset = level_of(effect), False if effect.constant else None
    count = len(made.free) + len(terms[0]) + 1
    at = made.size + count - 1
    left = made.beside(np.array([at]), level, offset, effects=count - 1)
    gram = left.T @ made.total @ left
    share = float(gram[0, 1] ** 2 / max(gram[0, 0] * gram[1, 1], TINY))
    without = np.array([[made.solve(made.total - g, level, count, offset)[at]] for g in made.grams])
    best = made.solve(made.total, level, count, offset)[at]
    return share, float(abs(best) / max(scatter(without)[0], TINY))
