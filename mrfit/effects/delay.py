"""Delay: the record of the force is late or early against that of the motion.

    s*tau*dF_measured/dt + F_measured = F(t - (1 - s)*tau)

F force (N) or torque, tau time (s) by which its record is late; negative if it is early. Of the time by which it is
late the share s (1) is a first-order lag, as of a sensor's or an amplifier's filter, and the rest a dead time; slow
tests, which both delay alike, do not tell how much. A record that is early is so by dead time alone. The dead time is
a cubic Lagrange interpolation, the ends held; the lag is exact for a force that is a parabola between samples. Neither
knows of samples to come, but for a record that is early.

Source: time lag of the test rig, inverse-tanh paper sec. 3.2; interpolation after Laakso et al., IEEE Signal Processing
Magazine 13 (1996) 30.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param, Programme, Steps
from mrfit.kernels import uneven
from mrfit.kernels.filters import held_back, shifted, smooth_lag
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


def shape(output: Array, channels: dict[str, Array], theta: Array, dt: Steps) -> Array:
    """Return the output, shape (P, N), late by tau in s, theta[:, 0], a share theta[:, 1] of it by a lag."""
    tau, share = theta.T
    filtered = np.maximum(share * tau, 0.0)
    if isinstance(dt, np.ndarray):
        return _unevenly(plain(output), tau - filtered, filtered, dt)
    shift, known = (tau - filtered) / dt, plain(output)
    moved = held_back(known, np.maximum(shift, 0.0))
    early = shift < 0.0
    if early.any():
        moved[early] = shifted(plain(known[early]), shift[early])
    return smooth_lag(moved, filtered / dt)


def _unevenly(output: Array, dead: Array, filtered: Array, steps: Array) -> Array:
    """Return the same at uneven steps (N,), dead times and lags (P,) in s."""
    moved = uneven.held_back(output, np.maximum(dead, 0.0), steps)
    early = dead < 0.0
    if early.any():
        moved[early] = uneven.shifted(plain(output[early]), dead[early], steps)
    return uneven.smooth_lag(moved, filtered, steps)
