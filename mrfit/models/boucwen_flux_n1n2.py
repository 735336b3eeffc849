"""Bouc-Wen flux linkage with two exponents: that of a coil, n1 in the one term of its loop and n2 in the other.

    flux = A*Lc*i + (1 - A)*Lc*D^-1*z
    dz/dt = kappa*di/dt - beta*di/dt*|z|^n1 - gamma*z*|di/dt|*|z|^(n2-1)

i current (A), flux (Wb), A share of the linear part (1), Lc coil inductance (H), D divisor of the hysteretic part (1),
z its state (1) with z = 0 at sample 0, kappa, beta, gamma (1/A), n1 and n2 (1) shape of its loop. beta's term bends
the branches that go away from zero and those that come back alike, gamma's makes them differ: n1 is how sharp the
saturation is, n2 how the width of the loop lies over its height.

Source: Tang et al. eq. 5 (Bouc-Wen flux model of a dual-coil damper), as printed; its Tables 3-5 have n1 = n2, which is
``boucwen-flux``. Of this law too data determine combinations only: z -> s*z, kappa -> s*kappa, D -> s*D,
beta -> s^(1-n1)*beta, gamma -> s^(1-n2)*gamma leave the flux as it is. ``derived`` gives what remains.
"""

import math
from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array, DerivedQuantity, Ends, Param, ReducedModel, State, Values
from mrfit.kernels.two_exponents import driven_by_two, normal_form_of_two, saturation, two_exponents_step
from mrfit.models import boucwen_flux
from mrfit.models.boucwen_flux import restored

_ONE = boucwen_flux.SPEC
_N = _ONE.params[5]
_EXPONENTS = (
    replace(_N, name="n1", text="exponent of the term of beta: sharpness of the saturation", symbol="n_1"),
    replace(_N, name="n2", text="exponent of the term of gamma: where in its height the loop is wide", symbol="n_2"),
)

SPEC = replace(
    _ONE,
    name="boucwen-flux-n1n2",
    title="Bouc-Wen flux linkage of a coil, two exponents",
    equation="flux = A*Lc*i + (1-A)*Lc/D*z;  dz/dt = kappa*di/dt - beta*di/dt*|z|^n1 - gamma*z*|di/dt|*|z|^(n2-1)",
    reference="Tang et al. eq. 5, as printed",
    params=(*_ONE.params[:5], *_EXPONENTS, _ONE.params[6]),
    derived=(
        *_ONE.derived[:2],
        DerivedQuantity("turnover", "A", "z_max/kappa: current over which the loop turns from one branch to the other"),
        DerivedQuantity("sharpness1", "1", "n1"),
        DerivedQuantity("sharpness2", "1", "n2"),
        DerivedQuantity("rho", "1", "(beta*z_max^n1-gamma*z_max^n2)/kappa: ratio that shapes the loop"),
    ),
)


def rest(now: Values, theta: Values) -> State:
    """Return the state of a coil that has known no current, over its greatest."""
    return (0.0,)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the flux in Wb at the end of a step, and the state over its greatest value."""
    (y,) = state
    share, inductance, kappa, beta, gamma, n1, n2, divisor = theta[1]
    z_max = math.exp(saturation(kappa, beta, gamma, n1, n2))
    rho = (beta * z_max**n1 - gamma * z_max**n2) / kappa
    y = two_exponents_step(y, now[0] - before[0], kappa / z_max, n1, n2, min(max(rho, -1.0), 1.0))
    return share * inductance * now[0] + (1.0 - share) * inductance * z_max / divisor * y, (y,)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the flux linkage in Wb, shape (P, N), of a current in A, shape (1, N); dt does not enter."""
    return driven_by_two(drive, _reduce(theta), dt)


def derived(theta: Array) -> Array:
    """Return slope (H), amplitude (Wb), turn-over current (A), n1, n2 and rho, shape (P, 6), of theta (P, 8)."""
    share, inductance, kappa, beta, gamma, n1, n2, divisor = theta.T
    z_max, rate, rho = normal_form_of_two(kappa, beta, gamma, n1, n2)
    amplitude = (1.0 - share) * inductance * z_max / divisor
    return np.column_stack([share * inductance, amplitude, 1.0 / rate, n1, n2, rho])


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the start values of ``boucwen-flux``, its exponent as both."""
    return _both(boucwen_flux.start_values(drive, output, dt))


def far_starts(drive: Array, output: Array, dt: float) -> list[dict[str, float]]:
    """Return the far start values of ``boucwen-flux``, a knee, its exponent as both."""
    return [_both(found) for found in boucwen_flux.far_starts(drive, output, dt)]


def _both(found: dict[str, float]) -> dict[str, float]:
    exponents = {"n1": found["n"], "n2": found["n"]} if "n" in found else {}
    return {name: v for name, v in found.items() if name != "n"} | exponents


def _reduce(theta: Array) -> Array:
    slope, amplitude, turnover, n1, n2, rho = derived(theta).T
    return np.column_stack([slope, amplitude, 1.0 / turnover, n1, n2, rho])


def _restore(reduced: Array) -> Array:
    slope, amplitude, rate, n1, n2, rho = reduced.T
    return restored(slope, amplitude, rate, (n1, n2), rho)


_REDUCED = boucwen_flux.REDUCED.spec
REDUCED = ReducedModel(
    spec=replace(
        SPEC,
        params=(
            *_REDUCED.params[:3],
            *_EXPONENTS,
            Param("rho", "1", -0.9999, 0.9999, -1.0 / 3.0, text="(beta*z_max^n1-gamma*z_max^n2)/kappa"),
        ),
        linear=_REDUCED.linear,
        derived=(),
    ),
    response=driven_by_two,
    reduce=_reduce,
    restore=_restore,
)
