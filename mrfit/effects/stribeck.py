"""Stribeck friction: more force at crawling speed than just above it, as seals go from mixed to full lubrication.

    F = F_base + fs*exp(-(|v|/vs)^p)*s,    s = sum_k w_k*(x - play(x, r_k))/r_k*tanh(sqrt(v^2 + v_c^2)/v_r)

x displacement (m), v velocity (m/s), F force (N), fs force at standstill above that of motion (N), vs Stribeck velocity
(m/s), over which it dies away, p (1) how abruptly, r (m), b (1), v_r and v_c (m/s), r_k and w_k as in
``coulomb-friction``, whose side of sliding s is. All but fs do nothing while fs is 0. p is 2 for Armstrong-Helouvry, 1
for Tustin, 0.5 to 1 for Bo and Pavelescu.

Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083; L. C. Bo, D. Pavelescu, Wear 82
(1982) 277; W. D. Iwan, J. Appl. Mech. 33 (1966) 893.
"""

import math

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Ends, Param, Programme, State, Steps, Values
from mrfit.kernels.elements import response_of
from mrfit.kernels.sliding import slip_step, stuck

SPEC = EffectSpec(
    name="stribeck",
    title="Friction falling with speed",
    equation="F = F_base + fs*exp(-(|v|/vs)^p)*s,  s = sum_k w_k*(x - play(x, r_k))/r_k*tanh(sqrt(v^2 + v_c^2)/v_r)",
    reference="Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083",
    slot="add",
    outputs=("force",),
    inputs=("displacement", "velocity"),
    params=(
        Param("fs", "N", 0.0, 1e5, 0.0, text="force at standstill above that of motion"),
        Param("vs", "m/s", 2e-3, 0.5, 0.02, "log", "shape", "velocity over which it dies away"),
        Param("p", "1", 0.5, 4.0, 2.0, "log", "shape", "how abruptly it dies away"),
        Param("r", "m", 1e-7, 5e-3, 2e-5, "log", "shape", "travel over which the seal is bent before it slips"),
        Param("b", "1", 0.0, 1.0, 0.5, "linear", "shape", "breadth of the travel over which parts of the seal slip"),
        Param("v_r", "m/s", 1e-5, 0.01, 3e-4, "log", "shape", "velocity below which friction fades"),
    ),
    neutral=(0.0, 0.02, 2.0, 2e-5, 0.5, 3e-4),
    aliases=("coulomb-friction", "delay"),
    experiment="triangular strokes at five or more speeds from 1 to 50 mm/s: force against speed has a minimum",
    asks=(Programme(waveform="triangle", speeds=5),),
)


def rest(now: Values, theta: Values) -> State:
    """Return the state of a seal that has stood still."""
    return stuck(now[0], theta[3], theta[4])


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the friction in N at the end of a step, and the state of the seal."""
    fs, vs, power, reach, breadth, fade = theta[1]
    direction, following = slip_step(state, before, now, (reach, breadth, fade), dt)
    return fs * math.exp(-((abs(now[1]) / vs) ** power)) * direction, following


_stepped = response_of(SPEC, rest, step)


def term(channels: dict[str, Array], theta: Array, dt: Steps) -> Array:
    """Return the force in N, shape (P, N), of fs in N, vs and v_r in m/s, r in m, p and b, theta (P, 6)."""
    return _stepped(np.stack([channels["displacement"], channels["velocity"]]), theta, dt)
