"""LuGre damper: bristles that deflect, with damping of their own and Stribeck's curve for their strength.

    F = f0 + sigma0*z + sigma1*dz/dt + sigma2*v
    dz/dt = v - sigma0*|v|*z/g(v),    g(v) = Fc + dF*exp(-(v/vs)^2)

v velocity (m/s), F force (N), z deflection (m) with z = 0 at sample 0, sigma0 stiffness (N/m) and sigma1 damping
(N*s/m) of the bristles, sigma2 viscous damping (N*s/m), Fc friction force at speed (N), dF what it is more at rest (N),
vs Stribeck's velocity (m/s), f0 offset (N). v and the parameters are linear between samples; every step is an
exponential one, exact for dF = 0 and stable for any stiffness.

Source: R. Jimenez, L. Alvarez-Icaza, Structural Control and Health Monitoring 12 (2005) 91, for magnetorheological
dampers, there with g constant (dF = 0); named in the reviews of Savaia et al. and the preyield paper ("LuGre
hysteresis operator").
"""

from mrfit.core.specs import Array, Ends, ModelSpec, Param, State, Values
from mrfit.kernels.elements import response_of
from mrfit.kernels.friction import lugre_step, stribeck_curve
from mrfit.kernels.points import inside, largest, post_yield_line

# Travel in m over which the bristles are bent to the friction force, for start values
TURNOVER = 1e-3

SPEC = ModelSpec(
    name="lugre",
    title="LuGre friction",
    equation="F = f0 + sigma0*z + sigma1*dz/dt + sigma2*v;  dz/dt = v - sigma0*|v|*z/(Fc + dF*exp(-(v/vs)^2))",
    reference="Jimenez, Alvarez-Icaza 2005; reviewed in Savaia et al. and the preyield paper",
    inputs=("velocity",),
    output="force",
    params=(
        Param("sigma0", "N/m", 100.0, 1e9, 1e6, "log", "stiffness", "stiffness of the bristles"),
        Param("sigma1", "N*s/m", 0.01, 1e5, 100.0, "log", "viscous", "damping of the bristles"),
        Param("sigma2", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "viscous damping"),
        Param("Fc", "N", 1.0, 1e6, 500.0, "log", "yield", "friction force at speed"),
        Param(
            "dF", "N", 0.01, 1e6, 20.0, "log", "yield", "friction force at rest less that at speed", symbol=r"\Delta F"
        ),
        Param("vs", "m/s", 1e-4, 1.0, 0.01, "log", "knee", "Stribeck's velocity"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("sigma1", "sigma2", "f0"),
)


def rest(now: Values, theta: Values) -> State:
    """Return no deflection."""
    return (0.0,)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the force in N and the deflection in m at the end of a step."""
    then, (sigma0, sigma1, sigma2, fc, more, vs, f0) = theta
    (z,) = state
    v = now[0]
    if dt > 0.0:
        z = lugre_step(z, (before[0], v), dt, (then[0], then[3], then[4], then[5]), (sigma0, fc, more, vs))
    rate = v - sigma0 * abs(v) * z / stribeck_curve(v, fc, more, vs)
    return f0 + sigma0 * z + sigma1 * rate + sigma2 * v, (z,)


response = response_of(SPEC, rest, step)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the line through the faster half of the samples, its force shared between friction at speed and at rest.

    The search then begins where friction still falls at half the greatest velocity: from a narrow dip it does not find
    a wide one. The bristles yield within a millimetre.
    """
    line = post_yield_line(drive[0], output)
    half = line["fy"] / 2
    found = {"sigma0": line["fy"] / TURNOVER, "sigma2": line["C_inf"], "Fc": half, "dF": half, "f0": line["f0"]}
    return inside(SPEC, {**found, "vs": largest(drive[0]) / 2})
