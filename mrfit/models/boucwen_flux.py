"""Bouc-Wen flux linkage: the magnetic hysteresis of a damper's coil, driven by its current.

    flux = A*Lc*i + (1 - A)*Lc*D^-1*z
    dz/dt = kappa*di/dt - beta*di/dt*|z|^n - gamma*z*|di/dt|*|z|^(n-1)

i current (A), flux (Wb), A share of the linear part (1), Lc coil inductance (H), D divisor of the hysteretic part (1),
z its state (1) with z = 0 at sample 0, kappa, beta, gamma (1/A) and n (1) shape of its loop. The law has no time of its
own: it is simulated by the exact branch curve of ``kernels.branch``, at any sampling.

Source: Tang et al. eq. 5 (Bouc-Wen flux model of a dual-coil damper), n1 = n2 = n as in its Tables 3-5.

The print and its tables do not fit each other. With the printed D^-1 and the published D = 20 the hysteretic part is
0.014-0.036 % of the flux's range: no loop to be seen. The standard Bouc-Wen form multiplies by D instead; that is
5-15 % and looks like the paper's figures. Here D divides, as printed, and its bounds reach 1/20 as well as 20.

Data do not determine the single parameters but combinations of them: z -> s*z, kappa -> s*kappa, D -> s*D,
beta -> s^(1-n)*beta, gamma -> s^(1-n)*gamma leave the flux as it is, and A, Lc, D enter through A*Lc and (1 - A)*Lc/D
only. ``derived`` gives what remains. A coil with iron loses energy, so (1 - A)/D < 0: the amplitude is negative.
"""

from dataclasses import replace

import numpy as np

from mrfit.kernels.branch import bouc_wen, driven, driven_roughly, normal_form, printed_form
from mrfit.kernels.points import inside, largest
from mrfit.kernels.theta import plain
from mrfit.specs import Array, Derived, ModelSpec, Param, Reduced

SPEC = ModelSpec(
    name="boucwen-flux",
    title="Bouc-Wen flux linkage of a coil",
    equation="flux = A*Lc*i + (1-A)*Lc/D*z;  dz/dt = kappa*di/dt - beta*di/dt*|z|^n - gamma*z*|di/dt|*|z|^(n-1)",
    reference="Tang et al. eq. 5; start values of its Tables 3-5",
    inputs=("current",),
    output="flux",
    params=(
        Param("A", "1", 0.5, 1.5, 1.2, text="share of the linear part"),
        Param("Lc", "H", 1e-4, 10.0, 0.02, "log", "inductance", "coil inductance"),
        Param("kappa", "1/A", 0.035, 350.0, 3.5, "log", "hysteresis", "initial slope of z"),
        Param(
            "beta", "1/A", 0.3, 3000.0, 30.0, "log", "hysteresis", "shape of the loop, follows the current's direction"
        ),
        Param("gamma", "1/A", 0.6, 6000.0, 60.0, "log", "hysteresis", "shape of the loop, width"),
        Param("n", "1", 1.0, 10.0, 1.3, "log", "hysteresis", "sharpness of the knee"),
        Param("D", "1", 0.002, 500.0, 20.0, "log", "hysteresis", "divisor of the hysteretic part"),
    ),
    linear=("Lc",),
    rate_independent=True,
    derived=(
        Derived("slope", "H", "A*Lc: inductance where z is saturated"),
        Derived("amplitude", "Wb", "(1-A)*Lc*z_max/D: flux of the saturated z, negative where the coil loses energy"),
        Derived("turnover", "A", "z_max/kappa: current over which the loop turns from one branch to the other"),
        Derived("sharpness", "1", "n"),
        Derived("rho", "1", "(beta-gamma)/(beta+gamma): ratio that shapes the loop"),
    ),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the flux linkage in Wb, shape (P, N), of a current in A, shape (1, N); dt does not enter."""
    return driven(drive, _reduce(theta), dt)


def derived(theta: Array) -> Array:
    """Return slope (H), amplitude (Wb), turn-over current (A), n and rho, shape (P, 5), of theta (P, 7)."""
    share, inductance, kappa, beta, gamma, n, divisor = theta.T
    z_max, rate, rho = normal_form(kappa, beta, gamma, n)
    amplitude = (1.0 - share) * inductance * z_max / divisor
    return np.column_stack([share * inductance, amplitude, 1.0 / rate, n, rho])


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return values whose slope, amplitude and turn-over current fit best, those without data as published.

    Of fourteen turn-over currents, that one with the least residual of a linear fit of slope (> 0), amplitude and
    offset. n, beta/gamma and kappa are the published ones; A is 1.2, or 0.8 for a loop that gains energy.
    """
    n, rho = derived(SPEC.start[None, :])[0, 3:]
    best, found = np.inf, np.empty(0)
    for turnover in largest(drive[0]) * np.geomspace(0.003, 3.0, 14):
        if not turnover:
            break
        y = bouc_wen(plain(drive[0]), np.array([[0.0, 1.0, 1.0 / turnover, n, rho]]))[0]
        columns = np.column_stack([drive[0] / largest(drive[0]), y, np.ones_like(y)])
        weights = np.linalg.lstsq(columns, output, rcond=1e-9)[0]
        error = float(np.sum((output - columns @ weights) ** 2))
        if error < best and weights[0] > 0:
            best, found = error, np.array([weights[0] / largest(drive[0]), weights[1], 1.0 / turnover, n, rho])
    return inside(SPEC, dict(zip(SPEC.names, _restore(found[None, :])[0].tolist(), strict=True))) if len(found) else {}


def _reduce(theta: Array) -> Array:
    slope, amplitude, turnover, n, rho = derived(theta).T
    return np.column_stack([slope, amplitude, 1.0 / turnover, n, rho])


def _restore(reduced: Array) -> Array:
    """Return parameters with the published kappa, and A = 1.2, or 0.8 where the loop gains energy."""
    slope, amplitude, rate, n, rho = reduced.T
    share, z_max = np.where(amplitude < 0.0, 1.2, 0.8), SPEC.start[2] / rate
    kappa, beta, gamma = printed_form(rate, n, rho, z_max)
    with np.errstate(divide="ignore"):
        divisor = (1.0 - share) * (slope / share) * z_max / amplitude
    return np.column_stack([share, slope / share, kappa, beta, gamma, n, divisor])


REDUCED = Reduced(
    spec=replace(
        SPEC,
        params=(
            Param("slope", "H", 5e-5, 15.0, 0.024, "log", text="A*Lc"),
            Param("amplitude", "Wb", -10.0, 10.0, -1e-3, text="(1-A)*Lc*z_max/D"),
            Param("rate", "1/A", 0.03, 9000.0, 10.0, "log", text="kappa/z_max"),
            SPEC.params[5],
            Param("rho", "1", -0.99998, 0.99998, -1.0 / 3.0, text="(beta-gamma)/(beta+gamma)"),
        ),
        linear=("slope", "amplitude"),
        derived=(),
    ),
    response=driven,
    rough=driven_roughly,
    reduce=_reduce,
    restore=_restore,
)
