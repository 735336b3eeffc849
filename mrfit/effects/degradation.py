"""Degradation: strength and stiffness fall with the energy that was dissipated.

    F = G/(1 + delta*E),    dE = F*dx,    dG/ds = (F_base - G)/(r*E)

x displacement (m), s the travel (m), F force (N), E energy dissipated since the recording began (J), delta the loss of
strength (1/J), G (N) the force of the base, turning over a travel r*E that grows with the energy by r (m/J): the
compliance behind a turn, 1/k, grows by r/F for every joule. With W the work of G, 1 + delta*E is sqrt(1 + 2*delta*W).
Every recording begins with a device that has recovered: what was dissipated before it is not known, and delta takes
it up. Where E is below 0, as of a spring that is given back, it is 0.

Source: T. T. Baber, Y. K. Wen, J. Eng. Mech. Div. ASCE 107 (1981) 1069 (strength over 1 + delta_nu*E, compliance times
1 + delta_eta*E); G. C. Foliente, J. Struct. Eng. 121 (1995) 1013.
"""

import math

from mrfit.core.specs import Array, EffectSpec, Ends, Param, Programme, State, Steps, Values
from mrfit.kernels.elements import rows_of

SPEC = EffectSpec(
    name="degradation",
    title="Strength and stiffness falling with dissipated energy",
    equation="F = G/(1 + delta*E),  dE = F*dx,  dG/ds = (F_base - G)/(r*E)",
    reference="Baber and Wen, J. Eng. Mech. Div. ASCE 107 (1981) 1069",
    slot="output",
    outputs=("force",),
    # the time is not read: a device that degrades has no steady cycle that segments could be folded onto
    inputs=("displacement", "time"),
    params=(
        Param("delta", "1/J", 0.0, 0.02, 0.0, text="loss of strength for every joule"),
        Param("r", "m/J", 0.0, 1e-3, 0.0, text="travel over which the force turns, for every joule"),
    ),
    neutral=(0.0, 0.0),
    aliases=("gain-drift", "temperature"),
    experiment="one sine at two amplitudes of one speed and current for the same time, then again after a rest: a "
    "force that falls with dissipated energy, and not with time, falls alike for equal energy",
    asks=(Programme(amplitudes=2),),
    steady=False,
)


def rest(now: Values, theta: Values) -> State:
    """Return the work in J of the force before it has lost strength, none, and that force in N."""
    return 0.0, now[0]


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the force in N at the end of a step, and the work in J and the force in N before it has lost strength."""
    work, late = state
    delta, r = theta[1]
    travel = now[1] - before[1]
    length = r * 2.0 * work / (1.0 + math.sqrt(1.0 + 2.0 * delta * work))
    following = now[0]
    if length > 0.0:
        turned = -math.expm1(-abs(travel) / length)
        followed = turned * length / abs(travel) if travel != 0.0 else 1.0
        following += (1.0 - turned) * (late - before[0]) - followed * (now[0] - before[0])
    work = max(work + 0.5 * (late + following) * travel, 0.0)
    return following / math.sqrt(1.0 + 2.0 * delta * work), (work, following)


_stepped = rows_of(SPEC, rest, step)


def shape(output: Array, channels: dict[str, Array], theta: Array, dt: Steps) -> Array:
    """Return the force in N, shape (P, N), of a device that degrades; theta (P, 2) in 1/J and m/J."""
    return _stepped(output, theta, dt, channels["displacement"])
