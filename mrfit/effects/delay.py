"""Delay: the record of the force is late or early against that of the motion.

    s*tau*dF_measured/dt + F_measured = F(t - (1 - s)*tau)

F force (N) or torque, tau time (s) by which its record is late; negative if it is early. Of the time by which it is
late the share s (1) is a first-order lag, as of a sensor's or an amplifier's filter, and the rest a dead time; slow
tests, which both delay alike, do not tell how much. A record that is early is so by dead time alone.

A force turns within a sample where the motion that makes it is smooth: between samples the motion is known, the force
is not. The dead time t_d moves the drive, F(t - t_d) being what the drive of then made. That time lies between samples
of which the later is not after t: motions go through a cubic of the last four samples (of two on either side where
these are known), currents and temperatures, which may be switched, along a line. With f = t_d/dt the error is of order
dt^4 for the former, f*(1 - f)*dt^2/2 times the second derivative for the latter. The lag asks for the force in the
middle between samples too, made by a drive that is straight there, and is exact for a force that is a parabola from one
of these to the next. Neither knows of samples to come, but for a record that is early.

Source: time lag of the test rig, inverse-tanh paper sec. 3.2; interpolation after Laakso et al., IEEE Signal Processing
Magazine 13 (1996) 30.
"""

from collections.abc import Mapping

import numpy as np

from mrfit.core.channels import CHANNELS, LEVEL_CHANNELS
from mrfit.core.specs import Array, EffectSpec, Ends, Param, Programme, State, Steps, Values
from mrfit.kernels.elements import rows_of
from mrfit.kernels.filters import (
    bend_step,
    held_back,
    lag_step,
    moved_unevenly,
    place,
    place_unevenly,
    shifted,
    smooth_lag,
    times_of,
)
from mrfit.kernels.theta import plain

SPEC = EffectSpec(
    name="delay",
    title="Force late or early against the motion",
    equation="s*tau*dF_measured/dt + F_measured = F(t - (1 - s)*tau)",
    reference="inverse-tanh paper sec. 3.2",
    slot="output",
    outputs=("force", "torque"),
    inputs=(),
    params=(
        Param("tau", "s", -0.1, 0.1, 0.0, text="time by which the force is late"),
        Param("s", "1", 0.0, 1.0, 0.0, "linear", "shape", "share of that which is a first-order lag"),
    ),
    neutral=(0.0, 0.0),
    aliases=("velocity-hysteresis", "gas-spring", "inertia", "current-lag", "coulomb-friction", "stribeck"),
    experiment="one amplitude at three or more frequencies over a decade: a delay turns the phase in proportion to "
    "f, a spring's part falls and an inertia's grows with f; edges of a triangular motion, which a dead time keeps "
    "sharp and a filter's lag rounds",
    asks=(Programme(frequencies=3, ratio=10.0), Programme(frequencies=1, waveform="triangle")),
)


def longest(theta: Values) -> float:
    """Return the greatest age in s of the motion that a step reads."""
    tau, share = theta
    return tau - max(share * tau, 0.0)


def rest(now: Values, theta: Values) -> State:
    """Return the lagged output, and that nothing has bent it."""
    return now[0], 0.0, 0.0, 0.0, 0.0


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the output behind the lag at the end of a step, and the state."""
    tau, share = theta[1]
    filtered = max(share * tau, 0.0)
    y = lag_step(state[0], before[0], now[0], filtered, dt)
    bend = state[1], state[2], state[3], state[4]
    guess, settled, curvature, slope, length = bend_step(bend, before[0], now[0], filtered, dt)
    return y - guess, (y, settled, curvature, slope, length)


_stepped = rows_of(SPEC, rest, step)


def moved(channels: Mapping[str, Array], theta: Array, dt: Steps) -> dict[str, Array]:
    """Return the channels (N,) of the dead time ago; theta is (tau, s) in s and 1."""
    dead = float(theta[0] - _filtered(theta)[0])
    if dead == 0.0:
        return {}
    known = [n for n in channels if n in CHANNELS]
    levels = [n for n in known if n in LEVEL_CHANNELS]
    found = {n: _cubic(plain(channels[n]), dead, dt) for n in known if n not in LEVEL_CHANNELS}
    if levels:
        before, share = (
            place_unevenly(dt, dead) if isinstance(dt, np.ndarray) else place(len(channels[levels[0]]), dead / dt)
        )
        for n in levels:
            x = channels[n]
            found[n] = x[before] + share * (x[before + 1] - x[before])
    return found


def needs_middles(theta: Array) -> bool:
    """Return whether a part of the delay is a lag."""
    return bool(_filtered(theta)[0] > 0.0)


def shape(output: Array, channels: Mapping[str, Array], theta: Array, dt: Steps) -> Array:
    """Return the output, shape (P, N), behind the share theta[:, 1] of tau in s, theta[:, 0], that is a lag."""
    if isinstance(dt, np.ndarray):
        return _stepped(output, theta, dt)
    return smooth_lag(plain(output), _filtered(theta) / dt)


def _filtered(theta: Array) -> Array:
    """Return the time constant of the lag (P,) in s."""
    tau, share = np.atleast_2d(theta).T
    filtered: Array = np.maximum(share * tau, 0.0)
    return filtered


def _cubic(x: Array, dead: float, dt: Steps) -> Array:
    """Return a smooth signal (N,) of a dead time in s ago, of a time to come where that is below 0."""
    if isinstance(dt, np.ndarray):
        return moved_unevenly(x, dead, times_of(dt), dead > 0.0)
    return np.asarray((held_back if dead > 0.0 else shifted)(x[None], np.array([dead / dt]))[0])
