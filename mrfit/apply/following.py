"""Desired forces followed in compiled loops: by the inverse alone, and by schemes of control on a plant.

``mrfit.apply.series`` and ``mrfit.apply.tracking`` say what is followed.
"""

from typing import NamedTuple

import numpy as np

from mrfit.apply.chain import CURRENT, SMALL, WORK, Chain, commit, step
from mrfit.apply.solving import ABOVE, BELOW, Inverse, Site, allowed, command, solve
from mrfit.core.specs import Array
from mrfit.kernels.jit import kernel

# Columns of what ``inverted`` and ``tracked`` keep of every sample
COMMAND, WANTED, FIELD, INNER, LEAST, GREATEST, FLAG, INVERTED = range(8)
TRACKED = ("feasible", "force", "wanted", "command", "field", "saturated")
FEASIBLE, FORCE, WISH, COMMANDED, SEEN, SATURATED = range(6)
# Entries of ``Lane.scheme``: whether it has feedback, the inverse, the inverse without the coil's, and one behind
# filters; the feedback's gains; samples that the model runs ahead; the command without an inverse
FEEDBACK, FORWARD, PLAIN, BEHIND, PROPORTIONAL, INTEGRAL, AHEAD, REST = range(8)


@kernel
def inverted(chain: Chain, inverse: Inverse, state: Array, given: Array, desired: Array, dt: float) -> Array:
    """Return currents and forces (N, 7) for desired forces (N,) of channels (N, C); the state goes along."""
    found, current = np.empty((len(given), INVERTED)), chain.sizes[CURRENT]
    site = Site(state, np.empty(given.shape[1]), np.empty(chain.sizes[SMALL]), np.empty(chain.sizes[WORK]))
    last = state[current]
    for n in range(len(given)):
        # the first sample has had an interval to get there
        site.given[:] = given[n]
        site.given[current] = last
        field, _, low, high, flag = solve(chain, inverse, site, dt, desired[n])
        last = command(chain, inverse, site, dt, field)
        site.given[current] = last
        _, inner, seen = step(chain, state, site.given, dt, np.nan, site.after, site.work)
        commit(chain, state, site.after, dt)
        found[n, COMMAND], found[n, WANTED], found[n, FIELD], found[n, INNER] = last, field, seen, inner
        found[n, LEAST], found[n, GREATEST], found[n, FLAG] = low, high, flag
    return found


class Lane(NamedTuple):
    """A control loop: model and its inverse, plant, and what is wanted.

    Attributes
    ----------
    model, inverse, plant
        Chains, and the model's inverse.
    given, answered
        Channels of model and plant, shapes (N, C).
    desired, asked
        Forces wanted, and what they are before what lies behind the force, (N,).
    scheme
        Numbers, as named above.
    states, answers
        Of model and plant; they go along.
    """

    model: Chain
    inverse: Inverse
    plant: Chain
    given: Array
    answered: Array
    desired: Array
    asked: Array
    scheme: Array
    state: Array
    answer: Array


@kernel
def tracked(lane: Lane, dt: float, first: int, last: int, kept: Array, memory: Array) -> None:
    """Choose commands of samples ``first`` to ``last``, and let model and plant answer; rows of ``kept`` are (6, N).

    ``memory`` holds the controller's integral and the force last measured.
    """
    model, plant, scheme, samples = lane.model, lane.plant, lane.scheme, len(lane.given)
    current = model.sizes[CURRENT]
    site = Site(lane.state, np.empty(lane.given.shape[1]), np.empty(model.sizes[SMALL]), np.empty(model.sizes[WORK]))
    now, after, work = np.empty(lane.answered.shape[1]), np.empty(plant.sizes[SMALL]), np.empty(plant.sizes[WORK])
    for k in range(first, last):
        # the model runs a dead time ahead of the plant, where the motion is known
        ahead, held = min(k + int(scheme[AHEAD]), samples - 1), lane.state[current]
        site.given[:] = lane.given[ahead]
        site.given[current] = held
        field, force, _, _, flag = solve(model, lane.inverse, site, dt, lane.desired[ahead])
        made = field
        if scheme[BEHIND] > 0.0:
            made = solve(model, lane.inverse, site, dt, lane.asked[ahead])[0]
        chosen = scheme[REST]
        if scheme[FORWARD] > 0.0:
            chosen = field if scheme[PLAIN] > 0.0 else command(model, lane.inverse, site, dt, made)
        low, high = allowed(lane.inverse, held, dt)
        if scheme[FEEDBACK] > 0.0 and k > 0:
            chosen += _correction(scheme, kept[FEASIBLE, k - 1], low - chosen, high - chosen, dt, memory)
        chosen = min(max(chosen, low), high)
        site.given[current] = chosen
        step(model, lane.state, site.given, dt, np.nan, site.after, site.work)
        commit(model, lane.state, site.after, dt)
        now[:] = lane.answered[k]
        now[plant.sizes[CURRENT]] = chosen
        memory[1], _, kept[SEEN, k] = step(plant, lane.answer, now, dt, np.nan, after, work)
        commit(plant, lane.answer, after, dt)
        kept[COMMANDED, k], kept[FORCE, k] = chosen, memory[1]
        # of the time at which the plant will show it
        for n in range(0 if k == 0 else ahead, ahead + 1):
            kept[WISH, n], kept[FEASIBLE, n] = field, force
            kept[SATURATED, n] = 1.0 if flag in (BELOW, ABOVE) else 0.0


@kernel
def _correction(scheme: Array, wish: float, low: float, high: float, dt: float, memory: Array) -> float:
    """Return the PI controller's current, its integral held where the command is at a limit."""
    # more current is more force against the motion: the error is that of the force's size
    error = np.sign(wish) * (wish - memory[1])
    proportional, integral = scheme[PROPORTIONAL], scheme[INTEGRAL]
    total = proportional * error + integral * (memory[0] + error * dt)
    if low < total < high:
        memory[0] += error * dt
    return float(proportional * error + integral * memory[0])
