"""Stribeck friction: more force at crawling speed than just above it, as seals go from mixed to full lubrication.

    F = F_base + fs*exp(-(v/vs)^2)*s(x),    s(x) = (x - play(x, r))/r between -1 and 1

x displacement (m), v velocity (m/s), F force (N), fs force at standstill above that of motion (N), vs Stribeck velocity
(m/s), over which it dies away, r travel over which the seal is bent before it slips (m); vs and r do nothing while fs
is 0. s is the direction of sliding as in ``coulomb-friction``.

Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083; W. D. Iwan, J. Appl. Mech. 33
(1966) 893.
"""

import numpy as np

from mrfit.kernels.filters import slip
from mrfit.kernels.theta import plain
from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="stribeck",
    title="Friction falling with speed",
    equation="F = F_base + fs*exp(-(v/vs)^2)*s(x),  s(x) = (x - play(x, r))/r",
    reference="Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083",
    slot="add",
    outputs=("force",),
    inputs=("displacement", "velocity"),
    params=(
        Param("fs", "N", 0.0, 1e5, 0.0, text="force at standstill above that of motion"),
        Param("vs", "m/s", 2e-3, 1.0, 0.02, "log", "shape", "velocity over which it dies away"),
        Param("r", "m", 1e-6, 5e-3, 5e-5, "log", "shape", "travel over which the seal is bent before it slips"),
    ),
    neutral=(0.0, 0.02, 5e-5),
    aliases=("coulomb-friction", "delay"),
    experiment="triangular strokes at five or more speeds from 1 to 50 mm/s: force against speed has a minimum",
)


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of fs in N, vs in m/s and r in m, theta (P, 3)."""
    fs, vs = theta[:, :1], theta[:, 1:2]
    fading = np.exp(-((channels["velocity"] / vs) ** 2))
    force: Array = fs * fading * slip(plain(channels["displacement"]), theta[:, 2])
    return force
