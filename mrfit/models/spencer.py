"""Spencer's phenomenological damper (modified Bouc-Wen): a dashpot in series with a Bouc-Wen element.

    F = f0 + C0*dy/dt + K0*x
    dy/dt = (alpha*z + C_inf*v + K_inf*(x - y))/(C0 + C_inf)
    dz/dt = A*u - beta*u*|z|^n - gamma*|u|*z*|z|^(n-1),    u = v - dy/dt

x displacement (m), v velocity (m/s), F force (N), y inner displacement (m), z hysteretic state (1), C0 pre-yield
damping (the series dashpot) and C_inf post-yield damping (N*s/m), K0 stiffness of the accumulator and K_inf stiffness
at large velocity (N/m), alpha force per z (N), A, beta, gamma (1/m) and n (1) shape of the hysteretic element, f0
offset (N). From rest, y = x and z = 0 at sample 0; see ``kernels.spencer`` for the integration.

Source: preyield paper eq. 10 (Spencer et al. 1997), written here for z without a unit, so that the unit of beta and
gamma
does not hang on n. z -> s*z, A -> s*A, alpha -> alpha/s, beta -> s^(1-n)*beta, gamma -> s^(1-n)*gamma leave F as it is:
``derived`` gives what data determine.
"""

from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array, DerivedQuantity, Ends, ModelSpec, Param, ReducedModel, State, Steps, Values
from mrfit.kernels.branch import normal_form, printed_form
from mrfit.kernels.points import inside, post_yield_line, yield_velocity
from mrfit.kernels.spencer import TOLERANCE, spencer, spencer_step
from mrfit.kernels.theta import plain

# Tolerance of a rough simulation, in units of the usual one
_ROUGH = 100.0

SPEC = ModelSpec(
    name="spencer",
    title="Spencer's phenomenological damper (modified Bouc-Wen)",
    equation=(
        "F = f0 + C0*dy/dt + K0*x;  dy/dt = (alpha*z + C_inf*v + K_inf*(x-y))/(C0+C_inf);  "
        "dz/dt = A*u - beta*u*|z|^n - gamma*|u|*z*|z|^(n-1), u = v - dy/dt"
    ),
    reference="preyield paper eq. 10",
    inputs=("displacement", "velocity"),
    output="force",
    params=(
        Param("C0", "N*s/m", 10.0, 1e7, 3e4, "log", "viscous", "pre-yield damping, in series"),
        Param("C_inf", "N*s/m", 1.0, 1e6, 2000.0, "log", "viscous", "post-yield damping"),
        Param("K0", "N/m", -1e6, 1e6, 500.0, "linear", "stiffness", "stiffness of the accumulator"),
        Param("K_inf", "N/m", 1.0, 1e6, 500.0, "log", "stiffness", "stiffness at large velocity"),
        Param("alpha", "N", 1.0, 1e6, 500.0, "log", "yield", "force of the hysteretic element per z"),
        Param("A", "1/m", 10.0, 1e6, 5000.0, "log", "hysteresis", "initial slope of z"),
        Param("beta", "1/m", 1.0, 1e6, 2500.0, "log", "hysteresis", "shape of the loop, follows the velocity's sign"),
        Param("gamma", "1/m", 1.0, 1e6, 2500.0, "log", "hysteresis", "shape of the loop, width"),
        Param("n", "1", 1.0, 10.0, 2.0, "log", "hysteresis", "sharpness of the knee"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("K0", "f0"),
    # the inner displacement follows its mean with (C0 + C_inf)/K_inf, seconds to a minute
    rests_at="displacement",
    derived=(
        DerivedQuantity("yield_force", "N", "alpha*z_max: force of the saturated hysteretic element"),
        DerivedQuantity("turnover", "m", "z_max/A: travel over which the loop turns from one branch to the other"),
        DerivedQuantity("sharpness", "1", "n"),
        DerivedQuantity("rho", "1", "(beta-gamma)/(beta+gamma): ratio that shapes the loop"),
    ),
)


def rest(now: Values, theta: Values) -> State:
    """Return xi = x - y and z of a damper that has stood still, and no length of a sub-step to begin with."""
    return 0.0, 0.0, 0.0


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the force in N, and xi in m, z and the sub-step's length in s at the end of a step."""
    then, (c0, c_inf, k0, k_inf, alpha, growth, beta, gamma, n, f0) = theta
    x, v = now
    xi, z, wish = state
    if dt > 0.0:
        start = then[0], then[1], then[3], then[4], then[5], then[6], then[7], then[8]
        end = c0, c_inf, k_inf, alpha, growth, beta, gamma, n
        xi, z, wish = spencer_step((xi, z, wish), (before[1], v), dt, start, end)
    w = (c0 * v - alpha * z - k_inf * xi) / (c0 + c_inf)
    return c0 * (v - w) + k0 * x + f0, (xi, z, wish)


def response(drive: Array, theta: Array, dt: Steps) -> Array:
    """Return the force in N, shape (P, N), of displacement (m) and velocity (m/s), shape (2, N), sampled every dt s."""
    return _simulated(drive, theta, dt, TOLERANCE)


def rough_response(drive: Array, theta: Array, dt: Steps) -> Array:
    """Return the same to some 1e-5 of the force's range: three times as fast, for searching far from the optimum."""
    return _simulated(drive, theta, dt, _ROUGH * TOLERANCE)


def _simulated(drive: Array, theta: Array, dt: Steps, tolerance: float) -> Array:
    x, v = plain(drive)
    values = theta if theta.ndim == 3 else theta[:, :, None]
    along = np.ascontiguousarray(np.swapaxes(values, 0, 1))
    return spencer(x, v, along, np.atleast_1d(np.float64(dt)), tolerance)


def derived(theta: Array) -> Array:
    """Return yield force (N), turn-over travel (m), n and rho, shape (P, 4), of theta (P, 10)."""
    alpha, growth, beta, gamma, n = theta.T[4:9]
    z_max, rate, rho = normal_form(growth, beta, gamma, n)
    return np.column_stack([alpha * z_max, 1.0 / rate, n, rho])


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the force and damping of the post-yield line as alpha and C_inf, twice the pre-yield slope as C0."""
    line = post_yield_line(drive[1], output)
    slope = line["fy"] / max(yield_velocity(drive[1], output), 1e-6)
    return inside(SPEC, {"alpha": line["fy"], "C_inf": line["C_inf"], "C0": 2 * slope, "f0": line["f0"]})


def _reduce(theta: Array) -> Array:
    c0, c_inf, k0, k_inf = theta.T[:4]
    yield_force, turnover, n, rho = derived(theta).T
    ratios = c0 / yield_force, c_inf / yield_force, k_inf / yield_force
    return np.column_stack([*ratios, yield_force, k0, theta[:, 9], 1.0 / turnover, n, rho])


def _restore(reduced: Array) -> Array:
    """Return parameters with z_max = 1."""
    c0, c_inf, k_inf, yield_force, k0, f0, rate, n, rho = reduced.T
    growth, beta, gamma = printed_form(rate, n, rho, np.ones_like(rate))
    inner = c0 * yield_force, c_inf * yield_force, k0, k_inf * yield_force, yield_force
    return np.column_stack([*inner, growth, beta, gamma, n, f0])


# All forces of the element in series scale with its yield force, in which the response then is linear
REDUCED = ReducedModel(
    spec=replace(
        SPEC,
        params=(
            Param("C0/fy", "s/m", 1e-2, 1e4, 60.0, "log", text="C0 per yield force"),
            Param("C_inf/fy", "s/m", 1e-3, 1e3, 4.0, "log", text="C_inf per yield force"),
            Param("K_inf/fy", "1/m", 1e-3, 1e4, 1.0, "log", text="K_inf per yield force"),
            Param("fy", "N", 1.0, 1e6, 500.0, "log", text="force of the saturated hysteretic element"),
            SPEC.params[2],
            SPEC.params[9],
            Param("rate", "1/m", 10.0, 1e6, 5000.0, "log", text="A/z_max"),
            SPEC.params[8],
            Param("rho", "1", -0.99998, 0.99998, 0.0, text="(beta-gamma)/(beta+gamma)"),
        ),
        linear=("fy", "K0", "f0"),
        derived=(),
    ),
    response=lambda drive, theta, dt: response(drive, _restore(theta), dt),
    rough=lambda drive, theta, dt: rough_response(drive, _restore(theta), dt),
    reduce=_reduce,
    restore=_restore,
)
