"""What holds beside something without a name: an effect may take a part of a force that breaks another invariance.

Where cavitation bends one direction of motion, an end stop far from the middle takes a quarter of what no law makes,
though forces that are not odd take nearly all of it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array, Invariance
from mrfit.discover.invariance.choice import Chosen
from mrfit.discover.invariance.estimate import table
from mrfit.discover.invariance.findings import BrokenInvariance
from mrfit.discover.invariance.generic import broken, columns_of, forces_of
from mrfit.discover.invariance.policy import Policy
from mrfit.discover.invariance.screening import contribution, level_of
from mrfit.discover.invariance.setting import Setting, State
from mrfit.discover.invariance.standing import scatter
from mrfit.discover.invariance.weights import weights_of

TINY = 1e-300


def held_beside_unnamed(setting: Setting, chosen: Chosen, policy: Policy) -> tuple[Chosen, list[BrokenInvariance]]:
    """Return the effects that stand beside flexible terms of the other invariances that are broken, and these.

    Parameters
    ----------
    setting
        The data.
    chosen
        The effects.
    policy
        Thresholds.
    """
    while True:
        weights = weights_of(setting, chosen.state)
        found = broken(setting, weights, chosen.state, policy)
        lost = _first_lost(setting, weights, chosen, found, policy)
        if not lost:
            return chosen, found
        name, why = lost
        chosen = replace(
            chosen,
            state={n: t for n, t in chosen.state.items() if n != name},
            found=tuple(d for d in chosen.found if d.row.name != name),
            reasons={**chosen.reasons, name: why},
        )


def _first_lost(
    setting: Setting, weights: Sequence[Array], chosen: Chosen, found: Sequence[BrokenInvariance], policy: Policy
) -> tuple[str, str] | None:
    """Return the first effect that something without a name may have instead, and why."""
    for row in found:
        for effect in chosen.found:
            name, share = effect.row.name, effect.row.standing.share
            own = setting.known[name].breaks.invariance is row.invariance
            if own or not overshadowed(share, row.share):
                continue
            left, errors = beside(setting, weights, chosen.state, name, row.invariance)
            if left < policy.share or errors < policy.clear:
                return name, f"something without a name that breaks the {row.invariance.value} may have it"
    return None


def overshadowed(share: float, unnamed: float) -> bool:
    """Return whether something without a name takes more than an effect that takes a share of what no law makes.

    ``unnamed`` is the share that it takes of what is left beside the effect. Terms that are more flexible than any law
    may imitate a true effect as well: they speak against one only where they take more than it.
    """
    return unnamed * (1.0 - share) > share


def beside(
    setting: Setting, weights: Sequence[Array], state: State, name: str, invariance: Invariance
) -> tuple[float, float]:
    """Return what an effect takes beside the flexible terms of an invariance: a share, and its standard errors."""
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
