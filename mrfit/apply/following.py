"""Desired forces followed in compiled loops: by the inverse alone, and by schemes of control on a plant.

``mrfit.apply.series`` and ``mrfit.apply.tracking`` say what is followed.
"""

from typing import NamedTuple

import numpy as np

from mrfit.apply.solving import ABOVE, BELOW, Inverse, allowed, command, solve
from mrfit.core.specs import Array
from mrfit.kernels.jit import borrowing, kernel
from mrfit.simulate.chain import DamperChain, commit, step, trial_of


@kernel
def inverted(chain: DamperChain, inverse: Inverse, state: Array, given: Array, desired: Array, dt: float) -> Array:
    """Return command, current wanted and seen, force, its least and greatest, and flag (N, 7) for desired forces (N,).

    ``given`` are channels (N, C); the state goes along.
    """
    found, current = np.empty((len(given), 7)), chain.places.current
    trial, last = trial_of(chain, state, np.empty(given.shape[1])), state[current]
    for n in range(len(given)):
        # the first sample has had an interval to get there
        trial.given[:] = given[n]
        trial.given[current] = last
        field, _, low, high, flag = solve(chain, inverse, trial, dt, desired[n])
        trial.given[current] = last = command(chain, inverse, trial, dt, field)
        _, inner, seen = step(chain, trial, dt, np.nan)
        commit(chain, trial, dt)
        found[n] = last, field, seen, inner, low, high, flag
    return found


class Scheme(NamedTuple):
    """A scheme of control.

    Attributes
    ----------
    feedback, forward, uninverted, behind
        Whether it has feedback, the inverse, the inverse without the coil's, and one behind filters.
    proportional, integral
        The feedback's gains.
    ahead
        Samples that the model runs ahead.
    rest
        The command in A without an inverse.
    """

    feedback: bool
    forward: bool
    uninverted: bool
    behind: bool
    proportional: float
    integral: float
    ahead: int
    rest: float


class Lane(NamedTuple):
    """A control loop: model and its inverse, plant, and what is wanted.

    Attributes
    ----------
    model, inverse, plant
        Chains, and the model's inverse.
    given, answered
        Channels of model and plant, shapes (N, C).
    desired, asked
        Forces wanted, and those before what lies behind the force, (N,).
    scheme
        How commands are chosen.
    state, answer
        Of model and plant; they go along.
    """

    model: DamperChain
    inverse: Inverse
    plant: DamperChain
    given: Array
    answered: Array
    desired: Array
    asked: Array
    scheme: Scheme
    state: Array
    answer: Array


class Course(NamedTuple):
    """The samples of a lane, (N,) each; ``saturated`` is 1 where the current rests at an end."""

    feasible: Array
    force: Array
    wanted: Array
    command: Array
    field: Array
    saturated: Array


@kernel
def tracked(lane: Lane, dt: float, course: Course) -> None:
    """Choose the commands of all samples, and let model and plant answer."""
    model, plant, scheme, samples = lane.model, lane.plant, lane.scheme, len(lane.given)
    current = model.places.current
    trial = trial_of(model, lane.state, np.empty(lane.given.shape[1]))
    answer = trial_of(plant, lane.answer, np.empty(lane.answered.shape[1]))
    # the controller's integral, and the force last measured
    memory = np.zeros(2)
    for k in range(samples):
        # the model runs a dead time ahead of the plant, where the motion is known
        ahead, held = min(k + scheme.ahead, samples - 1), lane.state[current]
        trial.given[:] = lane.given[ahead]
        trial.given[current] = held
        field, force, _, _, flag = solve(model, lane.inverse, trial, dt, lane.desired[ahead])
        made = field
        if scheme.behind:
            made = solve(model, lane.inverse, trial, dt, lane.asked[ahead])[0]
        chosen = scheme.rest
        if scheme.forward:
            chosen = field if scheme.uninverted else command(model, lane.inverse, trial, dt, made)
        low, high = allowed(lane.inverse, held, dt)
        if scheme.feedback and k > 0:
            chosen += _correction(scheme, course.feasible[k - 1], low - chosen, high - chosen, dt, memory)
        chosen = min(max(chosen, low), high)
        trial.given[current] = chosen
        step(model, trial, dt, np.nan)
        commit(model, trial, dt)
        answer.given[:] = lane.answered[k]
        answer.given[plant.places.current] = chosen
        memory[1], _, course.field[k] = step(plant, answer, dt, np.nan)
        commit(plant, answer, dt)
        course.command[k], course.force[k] = chosen, memory[1]
        # of the time at which the plant will show it
        for n in range(0 if k == 0 else ahead, ahead + 1):
            course.wanted[n], course.feasible[n] = field, force
            course.saturated[n] = 1.0 if flag in (BELOW, ABOVE) else 0.0


@borrowing
def _correction(scheme: Scheme, wish: float, low: float, high: float, dt: float, memory: Array) -> float:
    """Return the PI controller's current, its integral held where the command is at a limit."""
    # more current is more force against the motion: the error is that of the force's size
    error = np.sign(wish) * (wish - memory[1])
    total = scheme.proportional * error + scheme.integral * (memory[0] + error * dt)
    if low < total < high:
        memory[0] += error * dt
    return float(scheme.proportional * error + scheme.integral * memory[0])
