"""Generic tests: invariances that are broken by something which no known effect describes.

For each invariance a few flexible forces that break it, beside the best law with the effects that are named. They are
judged together by what they predict of conditions left out.
"""

from collections.abc import Callable, Sequence

import numpy as np

from mrfit.core.specs import Array, Invariance
from mrfit.discover.invariance.estimate import GramTable, force_of_law, squares, table
from mrfit.discover.invariance.setting import RegressionData, State
from mrfit.discover.policy import STANDARD, Policy
from mrfit.io.schemas.discovery import BrokenInvariance
from mrfit.kernels.filters import lag

TINY = 1e-300

Terms = Callable[[RegressionData, int, State, Array], list[Array]]
"""Forces (L + N,) of one record that break an invariance, beside the force of the law (L + N,)."""


def _position(setting: RegressionData, at: int, state: State, law: Array) -> list[Array]:
    record, scales = setting.records[at], setting.scales
    x, slow = (
        (record.place - setting.middle) / scales.travel,
        1.0
        / np.cosh(np.clip(record.speed / scales.speed, -STANDARD.largest_steepness, STANDARD.largest_steepness)) ** 2,
    )
    waves = [f(np.pi * k * x) for k in STANDARD.position_waves for f in (np.sin, np.cos)]
    gains = [f(np.pi * k * x) * law for k in STANDARD.gain_waves for f in (np.sin, np.cos)]
    return [x, x * slow, x**2, x**3, x * law, x**2 * law, *waves, *gains]


def _oddness(setting: RegressionData, at: int, state: State, law: Array) -> list[Array]:
    record, scales = setting.records[at], setting.scales
    v, i = record.speed / scales.speed, record.control / scales.control
    even = [np.abs(np.tanh(v / s)) for s in STANDARD.even_steepness]
    return [*even, np.abs(v), v**2, *(e * i for e in even), i, law**2]


def _time(setting: RegressionData, at: int, state: State, law: Array) -> list[Array]:
    t = setting.records[at].channels["time"] / max(float(r.channels["time"][-1]) for r in setting.records)
    return [t, t**2, t * law, t**2 * law, np.sqrt(np.maximum(t, 0.0)) * law]


def _warmth(setting: RegressionData, at: int, state: State, law: Array) -> list[Array]:
    warmth = setting.records[at].warmth
    if warmth is None:
        return []
    whole = np.concatenate([w for r in setting.records if (w := r.warmth) is not None])
    w = (warmth - whole.mean()) / max(float(np.ptp(whole)), TINY)
    v = setting.records[at].speed / setting.scales.speed
    return [w * law, w**2 * law, w * v] if np.ptp(whole) > STANDARD.least_warming else []


def _late(setting: RegressionData, at: int, state: State, law: Array) -> list[Array]:
    """Return the effect of late currents, by the law's slope to the current: of all, and on the way down."""
    record = setting.records[at]
    if not any(r.moves for r in setting.records):
        return []
    current = setting.control(at, state)
    found = []
    for tau in STANDARD.late_currents:
        behind = lag(np.ascontiguousarray(current[None]), np.array([tau / record.dt]))[0] - current
        found += [behind * law, np.maximum(behind, 0.0) * law]
        v = np.tanh(record.speed / (STANDARD.late_steepness * setting.scales.speed))
        found += [behind * v, np.maximum(behind, 0.0) * v]
    return found


GENERIC_TERMS: dict[Invariance, Terms] = {
    Invariance.POSITION: _position,
    Invariance.ODDNESS: _oddness,
    Invariance.TIME: _time,
    Invariance.TEMPERATURE: _warmth,
    Invariance.CURRENT: _late,
}


def columns_of(
    setting: RegressionData, state: State, invariance: Invariance, law: Sequence[Array]
) -> list[list[Array]]:
    """Return the rows (n,) of an invariance's flexible terms, per record; ``law`` is its force (L + N,) in each."""
    made = [GENERIC_TERMS[invariance](setting, at, state, force) for at, force in enumerate(law)]
    return [[setting.row_means(at, f) for f in own] for at, own in enumerate(made)]


def forces_of(setting: RegressionData, state: State, law: Array) -> list[Array]:
    """Return the force (L + N,) of a law with coefficients (p,) in each record."""
    return [force_of_law(setting, at, state, law) for at in range(len(setting.records))]


def broken(setting: RegressionData, weights: Sequence[Array], state: State, policy: Policy) -> list[BrokenInvariance]:
    """Return the invariances that are broken by something beside the effects of a state, the clearest first."""
    law = forces_of(setting, state, table(setting, weights, state).law)
    found = []
    for invariance in GENERIC_TERMS:
        extra = columns_of(setting, state, invariance, law)
        if not extra[0]:
            continue
        row = _judged(table(setting, weights, state, extra), extra, invariance)
        if row.kept >= policy.generic and row.size >= policy.size:
            found.append(row)
    return sorted(found, key=lambda b: -b.kept)


def _judged(made: GramTable, extra: Sequence[Sequence[Array]], invariance: Invariance) -> BrokenInvariance:
    """Return the shares that further columns take together, from all groups and from the others."""
    count, behind = len(extra[0]), made.size + len(made.free)
    weights = made.beside(behind + np.arange(count))
    grams = np.einsum("ia,gij,jb->gab", weights, made.grams, weights, optimize=True)
    total: Array = np.sum(grams, axis=0)
    ridge = np.diag(np.full(count, STANDARD.generic_penalty * made.rows))

    def fitted(gram: Array) -> Array:
        return np.asarray(np.linalg.solve(gram[:-1, :-1] + ridge, gram[:-1, -1]), dtype=np.float64)

    best = fitted(total)
    left = sum(squares(g, fitted(total - g)) for g in grams)
    before = max(float(total[-1, -1]), TINY)
    unit = best / made.scales[len(made.free) :]
    size = max(float(np.max(np.abs(np.column_stack(own) @ unit))) for own in extra)
    return BrokenInvariance(
        invariance=invariance, share=1.0 - squares(total, best) / before, kept=1.0 - left / before, size=size
    )
