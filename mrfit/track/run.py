"""The tracker of a fit's parameters along a log: models that step side by side, and the estimator of the exported C."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mrfit.apply.damper import Damper
from mrfit.apply.stepper import Stepper
from mrfit.core.specs import Array, Index
from mrfit.errors import ConfigError
from mrfit.export.source import ExportSource
from mrfit.export.tracker import NEARLY, TrackerPlan
from mrfit.kernels.jit import kernel
from mrfit.kernels.tracking import Estimator, EstimatorPlan, begun_estimator, corrected
from mrfit.simulate.chain import DamperChain, Trial, commit, step, trial_of


class ParallelModels(NamedTuple):
    """States of models side by side, and how tracked parameters enter their common arrays.

    Attributes
    ----------
    states
        (T + 1, S): of the model that follows the estimate, and of one for each parameter that is a bit off it.
    rows, owners, factors, logs
        (E,): places in the arrays, the tracked parameter there, what it is multiplied by, whether its logarithm stands.
    mean, deviation, difference
        Of the prior, (T,), and by how many standard deviations the models are off.
    """

    states: Array
    rows: Index
    owners: Index
    factors: Array
    logs: Index
    mean: Array
    deviation: Array
    difference: Array


class TrackerLog(NamedTuple):
    """A log: channels (N, C), measured output (N,), steps in s (N,), and whether the damper moves (N,)."""

    given: Array
    measured: Array
    steps: Array
    moves: Index


@dataclass(frozen=True)
class ParameterTrack:
    """Parameters along a log.

    Attributes
    ----------
    plan
        Of the tracker.
    time
        In s, (N,).
    values, deviations
        Estimates and their standard deviations (N, T), SI.
    covariance
        Of the parameters at the end (T, T), SI.
    innovations
        Measured output less that of the model at the estimate before the sample, (N,).
    chosen
        The filter that gave the estimate, (N,): 0 for constant parameters.
    moves
        Whether the damper moved, (N,).
    """

    plan: TrackerPlan
    time: Array
    values: Array
    deviations: Array
    covariance: Array
    innovations: Array
    chosen: Array
    moves: Index


@dataclass(frozen=True)
class BlockRefits:
    """Refits of blocks of a log: times in s of their middles (B,), values and standard deviations (B, T), SI."""

    time: Array
    values: Array
    deviations: Array


@kernel
def _placed(chain: DamperChain, models: ParallelModels, about: Array, lane: int) -> None:
    """Write the parameters of one of the models side by side."""
    for e in range(len(models.rows)):
        k = models.owners[e]
        z = about[k] + (models.difference[k] if k == lane - 1 else 0.0)
        value = models.factors[e] * (models.mean[k] + models.deviation[k] * z)
        chain.params[models.rows[e]] = np.log(value) if models.logs[e] else value


@kernel
def _follow(
    chain: DamperChain, models: ParallelModels, log: TrackerLog, t: Estimator, plan: EstimatorPlan, found: Array
) -> None:
    """Write estimates, their variances, innovation and filter chosen, (N, 2T + 2), of every sample."""
    size = len(t.estimate)
    outputs, sensitivity = np.empty(size + 1), np.empty(size)
    room = trial_of(chain, models.states[0], log.given[0])
    for n in range(len(log.given)):
        for lane in range(size + 1):
            _placed(chain, models, t.about, lane)
            one = Trial(models.states[lane], log.given[n], room.after, room.work)
            outputs[lane] = step(chain, one, log.steps[n], np.nan)[0]
            commit(chain, one, log.steps[n])
        error = log.measured[n] - outputs[0]
        innovation = error
        if n > 0:
            for k in range(size):
                sensitivity[k] = (outputs[k + 1] - outputs[0]) / models.difference[k]
                innovation -= sensitivity[k] * (t.estimate[k] - t.about[k])
            moved = log.moves[n] if np.isfinite(error) else 0
            corrected(t, plan, sensitivity, error, log.steps[n], moved)
        chosen = int(t.chosen[0])
        for k in range(size):
            found[n, k] = models.mean[k] + models.deviation[k] * t.estimate[k]
            found[n, size + k] = models.deviation[k] ** 2 * (t.covariance[chosen, k, k] + t.doubt[k])
        found[n, 2 * size], found[n, 2 * size + 1] = innovation, chosen


def track_log(
    source: ExportSource, plan: TrackerPlan, channels: Mapping[str, Array], measured: Array, dt: float | Array
) -> ParameterTrack:
    """Return the parameters along a log.

    Parameters
    ----------
    source
        The fit.
    plan
        Of the tracker.
    channels
        Inputs (N,) by name.
    measured
        Output (N,); nan where it is not known.
    dt
        Step in s, or steps (N,).

    Raises
    ------
    ConfigError
        If a parameter cannot be tracked.
    """
    theta = source.theta.copy()
    theta[[k for p in plan.parameters for k in p.places]] += NEARLY
    stepper = _stepper(source, plan, theta, float(np.min(dt)))
    names = stepper.inputs
    given = stepper.complete({"current": np.zeros(len(measured)), **channels})
    start = {n: given[:1, k] for k, n in enumerate(names)}
    steps = np.array(np.broadcast_to(np.asarray(dt, dtype=np.float64), measured.shape))
    steps[0] = 0.0
    size = len(plan.parameters)
    models = _models(source, plan, stepper, theta, np.empty((size + 1, stepper.chain.places.whole)))
    # each at rest with its own parameters
    t, found = begun_estimator(plan.prior, plan.filters), np.empty((len(given), 2 * size + 2))
    for lane in range(size + 1):
        _placed(stepper.chain, models, t.about, lane)
        models.states[lane] = stepper.rest(start)[0]
    moves = plan.moves(names, given.T)
    _follow(stepper.chain, models, TrackerLog(given, measured, steps, moves), t, plan.constants, found)
    scale = models.deviation
    return ParameterTrack(
        plan,
        np.cumsum(steps),
        found[:, :size],
        np.sqrt(found[:, size : 2 * size] + np.diag(plan.held)),
        (t.covariance[int(t.chosen[0])] + np.diag(t.doubt)) * np.outer(scale, scale) + plan.held,
        found[:, 2 * size],
        found[:, -1],
        moves,
    )


def _stepper(source: ExportSource, plan: TrackerPlan, theta: Array, shortest: float) -> Stepper:
    """Return the model to be stepped; commands between samples are straight lines."""
    whole = source.dependence
    orders, low, high = (whole.orders, whole.low, whole.high) if whole else ((), 0.0, 1.0)
    parameters = tuple(zip(source.spec.names, theta.tolist(), strict=True))
    damper = Damper(source.name, source.assembly.name, parameters, orders, low, high)
    return Stepper(damper, False, shortest, plan.bases)


def _models(source: ExportSource, plan: TrackerPlan, stepper: Stepper, theta: Array, states: Array) -> ParallelModels:
    """Return the models side by side; the places of a parameter are those that differ where it does.

    Raises
    ------
    ConfigError
        If a parameter enters otherwise than by its value or its logarithm.
    """
    entries = list[tuple[int, int, float, int]]()
    for owner, p in enumerate(plan.parameters):
        for k in p.places:
            other = theta.copy()
            other[k] = 1.25 * theta[k] if abs(theta[k]) > NEARLY else 1e-3
            changed = _stepper(source, plan, other, stepper.shortest).chain.params
            if len(changed) != len(stepper.chain.params):
                raise ConfigError(f"{p.name} cannot be tracked: the memory of the model depends on it")
            for row in np.flatnonzero(changed != stepper.chain.params):
                plain, log = changed[row] == other[k], other[k] > 0.0 and np.isclose(changed[row], np.log(other[k]))
                if not (plain or log):
                    raise ConfigError(f"{p.name} cannot be tracked: the model takes another number made of it")
                entries.append((int(row), owner, float(theta[k]) if p.factor else 1.0, int(not plain)))
    rows, owners, factors, logs = (np.array(column) for column in zip(*entries, strict=True))
    own = map(plan.column, ("value", "deviation", "difference"))
    return ParallelModels(states, rows, owners, factors, logs, *own)
