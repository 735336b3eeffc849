"""What holds where a law may remember for longer than assumed: the horizon of memory is a guess, not an estimate."""

from dataclasses import replace

from mrfit.discover.invariance.choice import Chosen
from mrfit.discover.invariance.estimate import refine
from mrfit.discover.invariance.policy import Policy
from mrfit.discover.invariance.selection import lost
from mrfit.discover.invariance.setting import Setting
from mrfit.discover.invariance.standing import described
from mrfit.discover.invariance.weights import weights_of

# Factor on the horizon of memory under which a name has to hold as well
FURTHER = 2.0


def held_further(setting: Setting, chosen: Chosen, policy: Policy) -> Chosen:
    """Return what stands where a law may remember for longer as well."""
    state, reasons = dict(chosen.state), dict(chosen.reasons)
    sizes = {d.row.name: d.row.standing.size for d in chosen.found}
    while state:
        weights = weights_of(setting, state)
        fitted = refine(setting, weights, state)
        rows = [described(setting, weights, fitted, name).row for name in state]
        name, why = lost(rows, sizes, policy)
        if not name:
            break
        del state[name]
        reasons[name] = f"a law that remembers for longer may have it: {why}"
    if len(state) == len(chosen.state):
        return chosen
    kept = {n: chosen.state[n] for n in state}
    found = tuple(d for d in chosen.found if d.row.name in state)
    return replace(chosen, state=kept, found=found, reasons=reasons)
