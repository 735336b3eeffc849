"""Coulomb friction: dry friction of seals and guides, whatever the current.

    F = F_base + fc*s,    s = sum_k w_k*(x - play(x, r_k))/r_k*tanh(sqrt(v^2 + v_c^2)/v_r) between -1 and 1,
    r_k = r*(1 + b*(h_k - 1)),    h_k = 0.3, 0.9, 2.02,    w_k = 0.3, 0.45, 0.25,    v_c = 0.1 mm/s

x displacement (m), v velocity (m/s), F force (N), fc friction force (N), r travel over which the seal is bent before it
slips (m), b (1) how broad the travels are at which its parts slip, v_r velocity below which a lubricated seal rubs less
(m/s), v_c a creep below which it fades no further (a turning point that falls on a sample is no gap in the force); r, b
and v_r do nothing while fc is 0. Sliding friction is fc*sign(v) but near a reversal. A seal that sticks turns from one
side to the other along a straight line over 2r if b is 0 (one stop), as -1 + 2*(1 - exp(-travel/r)) within 4 % if b is
1 (Dahl's turn); one that floats turns over 2v_r of velocity. A dry or a floating seal is the limit of small v_r or r.
The side is that of the travel, so that the velocity's noise does not make the force chatter.

Source: W. D. Iwan, J. Appl. Mech. 33 (1966) 893 (stops in parallel); P. R. Dahl, AIAA J. 14 (1976) 1675 (the turn);
B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Ends, Param, Programme, State, Steps, Values
from mrfit.kernels.elements import response_of
from mrfit.kernels.sliding import slip_step, stuck

SPEC = EffectSpec(
    name="coulomb-friction",
    title="Dry friction of seals and guides",
    equation="F = F_base + fc*s,  s = sum_k w_k*(x - play(x, r_k))/r_k*tanh(sqrt(v^2 + v_c^2)/v_r)",
    reference="Iwan, J. Appl. Mech. 33 (1966) 893; Dahl, AIAA J. 14 (1976) 1675; Armstrong-Helouvry et al. (1994)",
    slot="add",
    outputs=("force",),
    inputs=("displacement", "velocity"),
    params=(
        Param("fc", "N", 0.0, 1e5, 0.0, text="friction force"),
        Param("r", "m", 1e-7, 5e-3, 2e-5, "log", "shape", "travel over which the seal is bent before it slips"),
        Param("b", "1", 0.0, 1.0, 0.5, "linear", "shape", "breadth of the travel over which parts of the seal slip"),
        Param("v_r", "m/s", 1e-5, 0.01, 3e-4, "log", "shape", "velocity below which friction fades"),
    ),
    neutral=(0.0, 2e-5, 0.5, 3e-4),
    aliases=("delay", "stribeck"),
    experiment="slow triangular strokes without current and with a current: friction is there without one; at "
    "several speeds below 20 mm/s: a Stribeck force falls as the speed grows, friction stays; at several frequencies: "
    "a delay's loop grows with them",
    asks=(Programme(waveform="triangle", currents=2), None, Programme(frequencies=3)),
)


def rest(now: Values, theta: Values) -> State:
    """Return the state of a seal that has stood still."""
    return stuck(now[0], theta[1], theta[2])


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the friction in N at the end of a step, and the state of the seal."""
    fc, reach, breadth, fade = theta[1]
    direction, following = slip_step(state, before, now, (reach, breadth, fade), dt)
    return fc * direction, following


_stepped = response_of(SPEC, rest, step)


def term(channels: dict[str, Array], theta: Array, dt: Steps) -> Array:
    """Return the friction in N, shape (P, N), of fc in N, r in m, b and v_r in m/s, theta (P, 4)."""
    return _stepped(np.stack([channels["displacement"], channels["velocity"]]), theta, dt)
