"""Stribeck friction: more force at crawling speed than just above it, as seals go from mixed to full lubrication.

    F = F_base + fs*exp(-(v/vs)^2)*tanh(v/v0),    v0 = 0.001 m/s

v velocity (m/s), F force (N), fs force at standstill above that of motion (N), vs Stribeck velocity (m/s), over which
it dies away; vs does nothing while fs is 0. tanh(v/v0) is the sign of the velocity, linear below v0, where a sign
would chatter with the velocity's noise.

Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083.
"""

import numpy as np

from mrfit.kernels.filters import soft_sign
from mrfit.specs import Array, EffectSpec, Param

WIDTH = 1e-3

SPEC = EffectSpec(
    name="stribeck",
    title="Friction falling with speed",
    equation="F = F_base + fs*exp(-(v/vs)^2)*tanh(v/v0),  v0 = 0.001 m/s",
    reference="Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083",
    slot="add",
    outputs=("force",),
    inputs=("velocity",),
    params=(
        Param("fs", "N", 0.0, 1e5, 0.0, text="force at standstill above that of motion"),
        Param("vs", "m/s", 2e-3, 1.0, 0.02, "log", "shape", "velocity over which it dies away"),
    ),
    neutral=(0.0, 0.02),
    aliases=("coulomb-friction",),
    experiment="triangular strokes at five or more speeds from 1 to 50 mm/s: force against speed has a minimum",
)


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of fs in N and vs in m/s, theta (P, 2)."""
    v = channels["velocity"]
    fs, vs = theta[:, :1], theta[:, 1:]
    force: Array = fs * np.exp(-((v / vs) ** 2)) * soft_sign(v, WIDTH)
    return force
