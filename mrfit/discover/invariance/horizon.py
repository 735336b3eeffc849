"""What holds where a law may remember for longer than assumed: the horizon of memory is a guess, not an estimate."""

from dataclasses import replace

import numpy as np
from scipy.stats import t as student

from mrfit.discover.invariance.choice import Chosen
from mrfit.discover.invariance.estimate import plain_table, refine
from mrfit.discover.invariance.findings import Parameter
from mrfit.discover.invariance.policy import Policy
from mrfit.discover.invariance.selection import lost, stands_further
from mrfit.discover.invariance.setting import Setting, State
from mrfit.discover.invariance.standing import QUANTILE, Described, described
from mrfit.discover.invariance.weights import equal, residuals, rms, weights_of

# Factor on the horizon of memory under which a name has to hold as well
FURTHER = 2.0


def held_further(setting: Setting, further: Setting, chosen: Chosen, policy: Policy) -> Chosen:
    """Return what stands where a law may remember for longer as well.

    Parameters
    ----------
    setting
        The data with the horizon that the effects were chosen at.
    further
        The same with a horizon ``FURTHER`` times as long.
    chosen
        The effects.
    policy
        Thresholds.
    """
    state, reasons = dict(chosen.state), dict(chosen.reasons)
    sizes = {d.row.name: d.row.standing.size for d in chosen.found}
    again: dict[str, Described] = {}
    while state:
        weights = weights_of(further, state)
        fitted = refine(further, weights, state)
        again = {name: described(further, weights, fitted, name) for name in state}
        name, why = lost([d.row for d in again.values()], sizes, policy)
        if not name or _no_rival(setting, further, chosen, name, again[name], sizes[name], policy):
            break
        del state[name]
        reasons[name] = f"a law that remembers for longer may have it: {why}"
    kept = {n: chosen.state[n] for n in state}
    found = tuple(_widened(d, again[d.row.name], further.count) for d in chosen.found if d.row.name in state)
    return replace(chosen, state=kept, found=found, reasons=reasons)


def _no_rival(
    setting: Setting, further: Setting, chosen: Chosen, name: str, again: Described, size: float, policy: Policy
) -> bool:
    """Return whether a law of longer memory leaves more than the shorter with an effect, whose force it hardly bends.

    It has far more numbers than the effect: one that leaves more is not what makes the effect's force.
    """
    rest = {n: t for n, t in chosen.state.items() if n != name}
    longer, shorter = _left(further, rest), _left(setting, chosen.state)
    return longer > policy.no_rival * shorter and stands_further(again.row, size, policy)


def _left(setting: Setting, state: State) -> float:
    """Return the mean squared error that the best law leaves beside effects as they are."""
    return rms(residuals(setting, state, plain_table(setting, equal(setting), state))) ** 2


def _widened(found: Described, again: Described, groups: int) -> Described:
    """Return an effect with intervals that know how much its numbers differ beside a law of longer memory."""
    quantile = float(student.ppf(QUANTILE, groups - 1))

    def wider(own: Parameter, other: Parameter) -> Parameter:
        if own.low is None or own.high is None:
            return own
        half = float(np.hypot(0.5 * (own.high - own.low), quantile * (other.value - own.value)))
        return replace(own, low=own.value - half, high=own.value + half)

    parameters = tuple(wider(p, q) for p, q in zip(found.parameters, again.parameters, strict=True))
    return replace(found, parameters=parameters, force=wider(found.force, again.force))
