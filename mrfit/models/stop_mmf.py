"""Magnetomotive force of a core by stops: the current that a flux linkage takes, in saturation and in transients.

    i = flux/(L*(1 - u^p)) + i_c*(1 + g*u^2)*sum_k (r_k/flux_y)^q*s_k/(6*r_k) + i_w,    u = |flux|/flux_s
    ds_k/dt = dflux/dt while |s_k| < r_k,    r_k = flux_y*(flux_s/flux_y)^(k/5), k = 0 ... 5
    T*di_w/dt + i_w = m*d2flux/dt2

flux linkage (Wb), i current (A), L inductance without hysteresis (H), flux_s flux of saturation (Wb), p sharpness of
the knee (1), s_k stop operators with thresholds r_k (Wb), the least of them flux_y, i_c coercive current (A), q growth
of the stops' shares with their thresholds (1), g widening of the loop towards saturation (1), i_w the part that moves
the domain walls' mass m (A*s^2/Wb), which relaxes with T (s). Beyond u^p = 0.97 the first term goes on along its
tangent in u^p. With flux density for flux, i is the field in A/m.

Stops begin demagnetised at sample 0, and the flux at a steady rate.

Source: L. Prandtl, Z. angew. Math. Mech. 8 (1928) 85, and A. Yu. Ishlinskii for the stops; Froehlich's curve with the
exponent p; W. Doering, Z. Naturforschung 3a (1948) 373 (mass of domain walls).
"""

import math

import numpy as np

from mrfit.core.specs import Array, Ends, ModelSpec, Param, State, Values
from mrfit.kernels.elements import response_of
from mrfit.kernels.jit import kernel
from mrfit.kernels.points import inside, largest

# u^p from which on the curve goes along its tangent
_TANGENT = 0.97

SPEC = ModelSpec(
    name="stop-mmf",
    title="Magnetomotive force of a core by stops: current from flux linkage",
    equation=(
        "i = flux/(L*(1-u^p)) + i_c*(1+g*u^2)*sum_k (r_k/flux_y)^q*s_k/(6*r_k) + i_w, u = |flux|/flux_s;  "
        "s_k: stop of flux at r_k = flux_y*(flux_s/flux_y)^(k/5), k = 0..5;  T*di_w/dt + i_w = m*d2flux/dt2"
    ),
    reference="Prandtl-Ishlinskii stops, Froehlich's curve, Doering's mass of domain walls",
    inputs=("flux",),
    output="current",
    params=(
        Param("L", "H", 1e-6, 100.0, 0.03, "log", "inductance", "inductance without hysteresis and saturation"),
        Param("flux_s", "Wb", 1e-5, 100.0, 0.1, "log", "saturation", "flux of saturation", symbol=r"\lambda_s"),
        Param("p", "1", 1.0, 30.0, 4.0, "log", text="sharpness of the knee"),
        Param("i_c", "A", 1e-5, 1e3, 0.1, "log", "coercive", "coercive current"),
        Param("flux_y", "Wb", 1e-7, 10.0, 0.005, "log", "hysteresis", "least threshold", symbol=r"\lambda_y"),
        Param("q", "1", -1.5, 1.5, 0.0, role="hysteresis", text="growth of the stops' shares with their thresholds"),
        Param("g", "1", 0.0, 50.0, 1.0, role="hysteresis", text="widening of the loop towards saturation"),
        Param("m", "A*s^2/Wb", 0.0, 1e-3, 0.0, text="mass of the domain walls"),
        Param("T", "s", 1e-9, 1.0, 1e-3, "log", text="time in which their motion relaxes"),
    ),
    linear=("i_c", "m"),
)


@kernel
def stop(s: float, rise: float, reach: float) -> float:
    """Return a stop operator behind a rise of its input."""
    return min(max(s + rise, -reach), reach)


@kernel
def anhysteretic(flux: float, inductance: float, saturated: float, p: float) -> float:
    """Return the current in A of the core without hysteresis."""
    bent = float((abs(flux) / saturated) ** p)
    if bent < _TANGENT:
        return flux / (inductance * (1.0 - bent))
    return flux / inductance * (1.0 + (bent - _TANGENT) / (1.0 - _TANGENT)) / (1.0 - _TANGENT)


def rest(now: Values, theta: Values) -> State:
    """Return stops at 0, a lagged rate of the flux in Wb/s, and that it is not known yet."""
    return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the current in A at the end of a step, and the state."""
    s0, s1, s2, s3, s4, s5, lagged, moved = state
    inductance, saturated, p, coercive, least, q, g, mass, relaxing = theta[1]
    flux, rise = now[0], now[0] - before[0]
    ratio = (saturated / least) ** 0.2
    r1, r2, r3, r4 = least * ratio, least * ratio**2, least * ratio**3, least * ratio**4
    s0, s1, s2 = stop(s0, rise, least), stop(s1, rise, r1), stop(s2, rise, r2)
    s3, s4, s5 = stop(s3, rise, r3), stop(s4, rise, r4), stop(s5, rise, saturated)
    grown = ratio**q
    sum_of = s0 / least + grown * (s1 / r1 + grown * (s2 / r2 + grown * (s3 / r3 + grown * s4 / r4)))
    sum_of = sum_of + grown**5 * s5 / saturated
    held = coercive / 6.0 * (1.0 + g * (flux / saturated) ** 2) * sum_of
    walls = 0.0
    if dt > 0.0:
        rate = rise / dt
        # before the first step the flux has gone on at its rate
        off = (rate - lagged) * math.exp(-dt / relaxing) if moved > 0.0 else 0.0
        lagged, moved, walls = rate - off, 1.0, mass / relaxing * off
    return anhysteretic(flux, inductance, saturated, p) + held + walls, (s0, s1, s2, s3, s4, s5, lagged, moved)


response = response_of(SPEC, rest, step)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the slope of the whole, saturation a tenth beyond the greatest flux, and a loop of a tenth of the current.

    The least threshold is a tenth of the flux's range.
    """
    flux, top = drive[0], largest(drive[0])
    centred = flux - np.mean(flux)
    power = float(np.dot(centred, centred))
    slope = float(np.dot(centred, output - np.mean(output))) / power if power > 0.0 else 0.0
    found = {"flux_s": 1.1 * top, "i_c": 0.1 * largest(output), "flux_y": 0.1 * float(np.ptp(flux))}
    return inside(SPEC, {**found, **({"L": 1.0 / slope} if slope > 0.0 else {})})
