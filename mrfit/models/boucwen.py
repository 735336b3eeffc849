"""Bouc-Wen damper: viscous damper and spring beside a rate-independent hysteretic element.

    F = c*v + k*(x - x0) + alpha*z
    dz/dt = kappa*v - beta*v*|z|^n - gamma*|v|*z*|z|^(n-1)

x displacement (m), v velocity (m/s), F force (N), c damping (N*s/m), k stiffness (N/m), x0 displacement at which the
spring is at rest (m), alpha force per z (N), z hysteretic state (1) with z = 0 at sample 0, kappa, beta, gamma (1/m),
n (1). z depends on the path of x alone and is simulated by the exact branch curve of ``kernels.branch``; where kappa,
beta, gamma or n vary along the samples, they are linear over a step, and z is stepped.

Source: Tang et al. eq. 4, written here for z without a unit, so that the unit of beta and gamma does not hang on n. The
offset of a gas accumulator is -k*x0, as printed; a separate f0 would be the same parameter twice.

z -> s*z, kappa -> s*kappa, alpha -> alpha/s, beta -> s^(1-n)*beta, gamma -> s^(1-n)*gamma leave F as it is: ``derived``
gives what data determine.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from mrfit.core.specs import Array, DerivedQuantity, Ends, ModelSpec, Param, ReducedModel, State, Values
from mrfit.kernels.branch import (
    ROUGH,
    Branch,
    BranchCurve,
    bouc_wen,
    branch_step,
    normal,
    normal_form,
    printed_form,
)
from mrfit.kernels.elements import response_of
from mrfit.kernels.friction import bouc_wen_step, combine, hysteresis
from mrfit.kernels.points import inside, post_yield_line
from mrfit.kernels.theta import along_samples, plain

SPEC = ModelSpec(
    name="boucwen",
    title="Bouc-Wen damper",
    equation="F = c*v + k*(x-x0) + alpha*z;  dz/dt = kappa*v - beta*v*|z|^n - gamma*|v|*z*|z|^(n-1)",
    reference="Tang et al. eq. 4",
    inputs=("displacement", "velocity"),
    output="force",
    params=(
        Param("c", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "damping"),
        Param("k", "N/m", 1.0, 1e7, 1000.0, "log", "stiffness", "stiffness"),
        Param("x0", "m", -1.0, 1.0, 0.0, "linear", "offset", "displacement at which the spring is at rest"),
        Param("alpha", "N", 1.0, 1e6, 500.0, "log", "yield", "force of the hysteretic element per z"),
        Param("kappa", "1/m", 10.0, 1e5, 1000.0, "log", "hysteresis", "initial slope of z"),
        Param("beta", "1/m", 1.0, 1e5, 500.0, "log", "hysteresis", "shape of the loop, follows the velocity's sign"),
        Param("gamma", "1/m", 1.0, 1e5, 500.0, "log", "hysteresis", "shape of the loop, width"),
        Param("n", "1", 1.0, 10.0, 2.0, "log", "hysteresis", "sharpness of the knee"),
    ),
    linear=("c", "k", "alpha"),
    derived=(
        DerivedQuantity("yield_force", "N", "alpha*z_max: force of the saturated hysteretic element"),
        DerivedQuantity("offset", "N", "-k*x0: force at rest in the middle", "offset"),
        DerivedQuantity("turnover", "m", "z_max/kappa: travel over which the loop turns from one branch to the other"),
        DerivedQuantity("sharpness", "1", "n"),
        DerivedQuantity("rho", "1", "(beta-gamma)/(beta+gamma): ratio that shapes the loop"),
    ),
)


# While these hold, the element is stepped along its curve
SHAPE = ("kappa", "beta", "gamma", "n")


def loop(theta: Values) -> tuple[float, float, float, float]:
    """Return the numbers of the branch curve, see ``kernels.branch.normal``."""
    return normal(theta[4], theta[5], theta[6], theta[7])


def step_on_curve(
    state: Branch, before: Values, now: Values, theta: Ends, dt: float, curve: BranchCurve
) -> tuple[float, Branch]:
    """Return the force in N at the end of a step, and where on its curve the element is."""
    c, k, x0, alpha, _, _, _, _ = theta[1]
    after = branch_step(curve, state, before[0], now[0])
    return c * now[1] + k * (now[0] - x0) + alpha * curve.z_max * after[0], after


def rest(now: Values, theta: Values) -> State:
    """Return z of an element that has stood still."""
    return (0.0,)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the force in N and z at the end of a step."""
    then, (c, k, x0, alpha, kappa, beta, gamma, n) = theta
    z = bouc_wen_step(state[0], now[0] - before[0], (then[4], then[5], then[6], then[7]), (kappa, beta, gamma, n))
    return c * now[1] + k * (now[0] - x0) + alpha * z, (z,)


_stepped = response_of(SPEC, rest, step)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of displacement (m) and velocity (m/s), shape (2, N); dt does not enter."""
    if theta.ndim == 3 and np.any(theta[:, 4:] != theta[:, 4:, :1]):
        return _stepped(drive, theta, dt)
    x, v = plain(drive)
    values = along_samples(theta)
    c, k, x0, alpha = values[:4]
    kappa, beta, gamma, n = values[4:, :, :1]
    z_max, rate, rho = normal_form(kappa, beta, gamma, n)
    force = hysteresis(x, rate, n, rho)
    combine(force, alpha * z_max, np.stack([c, k, -k * x0]), np.stack([v, x, np.ones_like(v)]))
    return force


def derived(theta: Array) -> Array:
    """Return yield force (N), offset (N), turn-over travel (m), n and rho, shape (P, 5), of theta (P, 8)."""
    _, k, x0, alpha, kappa, beta, gamma, n = theta.T
    z_max, rate, rho = normal_form(kappa, beta, gamma, n)
    return np.column_stack([alpha * z_max, -k * x0, 1.0 / rate, n, rho])


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the post-yield line's force, damping and offset, and a loop that turns over a tenth of the amplitude."""
    line = post_yield_line(drive[1], output)
    stiffness, rate = SPEC.start[1], 20.0 / max(float(np.ptp(drive[0])), 1e-6)
    loop = {"alpha": line["fy"], "kappa": rate, "beta": rate / 2, "gamma": rate / 2}
    return inside(SPEC, {**loop, "c": line["C_inf"], "k": stiffness, "x0": -line["f0"] / stiffness})


def _reduced_response(drive: Array, theta: Array, dt: float, coarseness: float = 1.0) -> Array:
    """Return the force of c, offset, k, yield force, rate, n and rho, see ``REDUCED``."""
    x, v = plain(drive)
    force = bouc_wen(x, np.ascontiguousarray(theta[:, 2:]), coarseness)
    force += theta[:, :1] * v + theta[:, 1:2]
    return force


def _reduce(theta: Array) -> Array:
    c, k, *_ = theta.T
    yield_force, offset, turnover, n, rho = derived(theta).T
    return np.column_stack([c, offset, k, yield_force, 1.0 / turnover, n, rho])


def _restore(reduced: Array) -> Array:
    """Return parameters with z_max = 1."""
    c, offset, k, yield_force, rate, n, rho = reduced.T
    kappa, beta, gamma = printed_form(rate, n, rho, np.ones_like(rate))
    return np.column_stack([c, k, -offset / k, yield_force, kappa, beta, gamma, n])


REDUCED = ReducedModel(
    spec=replace(
        SPEC,
        params=(
            SPEC.params[0],
            Param("offset", "N", -1e7, 1e7, 0.0, text="-k*x0: force at rest in the middle"),
            SPEC.params[1],
            Param("yield_force", "N", 1.0, 1e6, 500.0, "log", text="force of the saturated hysteretic element"),
            Param("rate", "1/m", 10.0, 1e5, 1000.0, "log", text="kappa/z_max"),
            SPEC.params[7],
            Param("rho", "1", -0.99998, 0.99998, 0.0, text="(beta-gamma)/(beta+gamma)"),
        ),
        linear=("c", "offset", "k", "yield_force"),
        derived=(),
    ),
    response=_reduced_response,
    rough=partial(_reduced_response, coarseness=ROUGH),
    reduce=_reduce,
    restore=_restore,
)
