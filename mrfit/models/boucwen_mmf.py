"""Bouc-Wen magnetomotive force: the current that a coil's flux linkage takes, the dual of the flux model.

    i = flux/L + i_c*y
    dy/dt = (dflux/dt - beta*dflux/dt*|y|^n - gamma*|dflux/dt|*y*|y|^(n-1))/flux_y,    beta + gamma = 1

flux linkage (Wb), i current (A), L inductance once the hysteresis is saturated (H), i_c coercive current (A), y
hysteretic state between -1 and 1 with y = 0 at sample 0, flux_y flux over which the loop turns (Wb), n sharpness of the
knee (1), rho = beta - gamma (1). Flux is to current as displacement is to force: for rho <= 0 the law dissipates on any
path, whatever the other values, where ``boucwen-flux`` does for A > 1 only. No parameter is redundant.

Source: R. Bouc, Y.-K. Wen as in Tang et al. eqs. 4-5, with the roles of current and flux exchanged; passivity after
S. Erlicher, N. Point, Comptes Rendus Mecanique 332 (2004) 51.
"""

from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array, DerivedQuantity, Ends, ModelSpec, Param, ReducedModel, Values
from mrfit.kernels.branch import Branch, BranchCurve, branch_step, driven, driven_roughly
from mrfit.kernels.points import half_width, inside, largest

SPEC = ModelSpec(
    name="boucwen-mmf",
    title="Bouc-Wen magnetomotive force: current from flux linkage",
    equation="i = flux/L + i_c*y;  dy/dt = (dflux/dt - beta*dflux/dt*|y|^n - gamma*|dflux/dt|*y*|y|^(n-1))/flux_y",
    reference="dual of Tang et al. eq. 5",
    inputs=("flux",),
    output="current",
    params=(
        Param("L", "H", 1e-4, 100.0, 0.03, "log", "inductance", "inductance where the hysteresis is saturated"),
        Param("i_c", "A", 1e-4, 10.0, 0.1, "log", "hysteresis", "coercive current"),
        Param(
            "flux_y",
            "Wb",
            1e-6,
            10.0,
            0.003,
            "log",
            "hysteresis",
            "flux over which the loop turns",
            symbol=r"\lambda_y",
        ),
        Param("n", "1", 1.0, 10.0, 1.3, "log", "hysteresis", "sharpness of the knee"),
        Param(
            "rho", "1", -1.0, 0.0, -0.3, "linear", "hysteresis", "shape of the loop: -1 slim ends, 0 straight flanks"
        ),
    ),
    linear=("i_c",),
    rate_independent=True,
    derived=(DerivedQuantity("L_initial", "H", "1/(1/L + i_c/flux_y): inductance of a demagnetised coil"),),
)


# While these hold, the element is stepped along its curve
SHAPE = ("flux_y", "n", "rho")


def loop(theta: Values) -> tuple[float, float, float, float]:
    """Return greatest state, 1/flux_y, n and rho of the branch curve."""
    return 1.0, 1.0 / theta[2], theta[3], theta[4]


def step_on_curve(
    state: Branch, before: Values, now: Values, theta: Ends, dt: float, curve: BranchCurve
) -> tuple[float, Branch]:
    """Return the current in A at the end of a step, and where on its curve the element is."""
    inductance, coercive, _, _, _ = theta[1]
    after = branch_step(curve, state, before[0], now[0])
    return now[0] / inductance + coercive * after[0], after


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the current in A, shape (P, N), of a flux linkage in Wb, shape (1, N); dt does not enter."""
    return driven(drive, _inverted(theta), dt)


def derived(theta: Array) -> Array:
    """Return the inductance of the demagnetised coil in H, shape (P, 1)."""
    return 1.0 / (1.0 / theta[:, :1] + theta[:, 1:2] / theta[:, 2:3])


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the slope through the loop's tips, half its width at zero flux, and a tenth of the flux to turn over."""
    flux = drive[0]
    coercive = half_width(output, np.diff(flux, prepend=flux[:1]), flux - 0.5 * (np.max(flux) + np.min(flux)))
    top = largest(output) or 1.0
    return inside(SPEC, {"L": largest(flux) / top, "i_c": abs(coercive), "flux_y": 0.1 * largest(flux)})


def _inverted(theta: Array) -> Array:
    """Return L, i_c, flux_y, n, rho with 1/L for L and 1/flux_y for flux_y, or back."""
    return np.column_stack([1.0 / theta[:, 0], theta[:, 1], 1.0 / theta[:, 2], theta[:, 3:]])


REDUCED = ReducedModel(
    spec=replace(
        SPEC,
        params=(
            Param("slope", "1/H", 0.01, 1e4, 30.0, "log", text="1/L"),
            SPEC.params[1],
            Param("rate", "1/Wb", 0.1, 1e6, 300.0, "log", text="1/flux_y"),
            *SPEC.params[3:],
        ),
        linear=("slope", "i_c"),
        derived=(),
    ),
    response=driven,
    rough=driven_roughly,
    reduce=_inverted,
    restore=_inverted,
)
