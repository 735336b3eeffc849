"""A recursive estimator of drifting parameters: Kalman filters on one linearised output, and a choice between them.

The output is linear in the parameters about those of a model: error = measured − its output, sensitivities by forward
differences of models that step beside it. Parameters of which the models remember something follow the estimate slowly,
so that it is of those that they have. Parameters are in standard deviations of the prior from its mean.
One filter takes them as constant since it began, the others as random walks. Their evidence decides which one gives
the estimate: the cumulative sum of the logarithm of the ratio of their likelihoods (Page, Biometrika 41 (1954) 100).
While parameters move, a filter whose sum falls behind begins again at the one chosen: none holds what is past.
A last filter goes on as if the last change had not been: where its evidence since then is the better, there was none.
Odds that another filter is right (Shiryaev, Theory Probab. Appl. 8 (1963) 22) widen the variances.

Coloured noise of integrated correlation time τ is taken as white with the variance σ²·max(1, τ/dt).

Source: L. Ljung, T. Söderström, Theory and Practice of Recursive Identification (1983), section 3.4; M. Basseville,
I. Nikiforov, Detection of Abrupt Changes (1993), section 2.2.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.jit import kernel

# Evidence in nats at which constant parameters are taken to move
CHANGED = 10.0
# Evidence in nats at which moving parameters are taken to move otherwise, or to have come to rest
MOVED_OTHERWISE = 6.0
# Evidence in nats at which a filter begins again at the one chosen, while parameters move
BEHIND = -1.0
# The most nats that one sample adds to odds
MOST_NATS = 20.0
# Logarithm of the share of 5 % that lies outside of a band
OUTSIDE_BAND = -3.0
# Factor of the variance of a moving parameter with which it is taken to be constant from now on
WIDER = 9.0


class Estimator(NamedTuple):
    """State of the estimator.

    Attributes
    ----------
    mean, covariance
        Of the filters, (M, T) and (M, T, T); the first and the last have constant parameters, the others random walks.
    estimate, about, gain
        Mean of the filter that is chosen, parameters of the models, which follow it, and the covariance of parameters
        and output, (T,) each.
    evidence, likelihood
        Cumulative evidence in nats of each filter against the one chosen, (M,), and log-likelihoods of the last
        innovations, (M,).
    odds
        Odds of each filter against the one chosen, (M,).
    doubt
        What the variances of the filter chosen lack because another one may be right, (T,).
    before
        Mean and variances of the last filter at the last change, (2, T).
    chosen
        Which filter gives the estimate, (1,).
    """

    mean: Array
    covariance: Array
    estimate: Array
    about: Array
    gain: Array
    evidence: Array
    likelihood: Array
    odds: Array
    doubt: Array
    before: Array
    chosen: Array


class EstimatorPlan(NamedTuple):
    """Constants of the estimator.

    Attributes
    ----------
    noise
        Variance of the output's noise, and its integrated correlation time in s.
    walk
        Growth of the filters' variances per s, (M, T); 0 of the first and the last.
    changes
        Changes a second, to each of the filters, for which bands have room, (M,).
    widest
        Greatest variance, (T,).
    followed
        Seconds in which the models follow the estimate, (T,); 0 where they do at once.
    low, high
        Bounds, (T,).
    """

    noise: Array
    walk: Array
    changes: Array
    widest: Array
    followed: Array
    low: Array
    high: Array


@kernel
def _updated(t: Any, plan: Any, m: int, sensitivity: Any, error: float, white: float) -> float:
    """Update filter m; return the log-likelihood of its innovation, but for a constant."""
    innovation, variance = error, white
    for k in range(len(t.gain)):
        t.gain[k] = 0.0
        for j in range(len(t.gain)):
            t.gain[k] += t.covariance[m, k, j] * sensitivity[j]
        innovation -= sensitivity[k] * (t.mean[m, k] - t.about[k])
        variance += sensitivity[k] * t.gain[k]
    for k in range(len(t.gain)):
        share = t.gain[k] / variance
        t.mean[m, k] = min(max(t.mean[m, k] + share * innovation, plan.low[k]), plan.high[k])
        for j in range(len(t.gain)):
            t.covariance[m, k, j] -= share * t.gain[j]
    return -0.5 * (math.log(variance / white) + innovation * innovation / variance)


@kernel
def _restarted(t: Any, plan: Any, m: int, other: int) -> None:
    """Let filter m begin where another one is, which may still be on its way."""
    if m != other:
        for k in range(len(t.gain)):
            t.mean[m, k] = t.mean[other, k]
            for j in range(len(t.gain)):
                t.covariance[m, k, j] = t.covariance[other, k, j]
            if plan.walk[other, k] > 0.0:
                t.covariance[m, k, k] *= WIDER


@kernel
def _is_unchanged(t: Any, found: int, last: int) -> bool:
    """Return whether the last filter is right after all, and has gone no further than a constant's estimate does."""
    within: bool = t.evidence[last] > (MOVED_OTHERWISE if found > 0 else 0.0)
    for k in range(len(t.gain)):
        off = t.mean[last, k] - t.before[0, k]
        within = within and off * off <= WIDER * (t.before[1, k] - t.covariance[last, k, k])
    return within


@kernel
def _weighed(t: Any, plan: Any) -> None:
    """Add up the evidence against the filter chosen, and choose another one where it suffices."""
    chosen, last = int(t.chosen[0]), len(t.evidence) - 1
    found = chosen
    for m in range(last):
        t.evidence[m] += t.likelihood[m] - t.likelihood[chosen]
        if t.evidence[m] > max(t.evidence[found], CHANGED if chosen == 0 else MOVED_OTHERWISE):
            found = m
    t.evidence[last] += t.likelihood[last] - t.likelihood[chosen]
    unchanged = _is_unchanged(t, found, last)
    if unchanged:
        found = 0
        _restarted(t, plan, 0, last)
    if unchanged or found != chosen:
        t.chosen[0] = found
        if unchanged or chosen == 0:
            t.evidence[last] = 0.0
            _restarted(t, plan, last, 0)
            for k in range(len(t.gain)):
                t.before[0, k], t.before[1, k] = t.mean[0, k], t.covariance[0, k, k]
        t.odds[chosen], most = 1.0, max(t.odds[found], 1.0)
        for m in range(last):
            t.evidence[m] = 0.0
            t.odds[m] = 0.0 if unchanged else t.odds[m] / most
    for m in range(last):
        if found == 0:
            t.evidence[m] = max(t.evidence[m], 0.0)
        elif t.evidence[m] < BEHIND:
            t.evidence[m] = 0.0
            _restarted(t, plan, m, found)


@kernel
def _doubted(t: Any, plan: Any, dt: float) -> None:
    """Widen the variances so that 95 % bands hold where another filter is right."""
    chosen, last, total = int(t.chosen[0]), len(t.evidence) - 1, 1.0
    for m in range(last):
        if m != chosen:
            ratio = math.exp(min(t.likelihood[m] - t.likelihood[chosen], MOST_NATS))
            t.odds[m] = (t.odds[m] + plan.changes[m] * dt) * ratio
            total += t.odds[m]
    for k in range(len(t.gain)):
        weight, spread = 0.0, 0.0
        for m in range(1, last):
            if m != chosen:
                off = t.mean[m, k] - t.mean[chosen, k]
                weight += t.odds[m]
                spread += t.odds[m] * (t.covariance[m, k, k] + off * off)
        t.doubt[k] = 0.0
        if weight > 0.0:
            reach = 1.0 - math.log(weight / total) / OUTSIDE_BAND
            t.doubt[k] = max(0.0, reach * spread / weight - t.covariance[chosen, k, k])


@kernel
def corrected(t: Any, plan: Any, sensitivity: Any, error: float, dt: float, excited: int) -> None:
    """Correct the estimate by the output's error at the end of a step of dt s; it stays where nothing is excited."""
    white = plan.noise[0] * max(1.0, plan.noise[1] / dt)
    for m in range(len(t.evidence)):
        for k in range(len(t.gain)):
            t.covariance[m, k, k] = min(t.covariance[m, k, k] + plan.walk[m, k] * dt, plan.widest[k])
        if excited != 0:
            own = _updated(t, plan, m, sensitivity, error, white)
            t.likelihood[m] = own
    if excited != 0:
        _weighed(t, plan)
        _doubted(t, plan, dt)
        for k in range(len(t.gain)):
            t.estimate[k] = t.mean[int(t.chosen[0]), k]
            t.about[k] += (t.estimate[k] - t.about[k]) * dt / max(plan.followed[k], dt)


def begun_estimator(prior: Array, filters: int) -> Estimator:
    """Return the estimator before the first sample, of the prior's correlations (T, T)."""
    size = len(prior)
    mean, covariance = np.zeros((filters, size)), np.repeat(prior[None], filters, axis=0)
    (estimate, about, gain, doubt), (evidence, likelihood, odds) = np.zeros((4, size)), np.zeros((3, filters))
    before, chosen = np.zeros((2, size)), np.zeros(1)
    return Estimator(mean, covariance, estimate, about, gain, evidence, likelihood, odds, doubt, before, chosen)
