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

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from mrfit.core.specs import Array, DerivedQuantity, Ends, ModelSpec, Param, PassiveRange, ReducedModel, Values
from mrfit.kernels.branch import (
    Branch,
    BranchCurve,
    bouc_wen,
    branch_step,
    driven,
    driven_roughly,
    normal,
    normal_form,
    printed_form,
)
from mrfit.kernels.points import inside, largest
from mrfit.kernels.theta import plain

SPEC = ModelSpec(
    name="boucwen-flux",
    title="Bouc-Wen flux linkage of a coil",
    equation="flux = A*Lc*i + (1-A)*Lc/D*z;  dz/dt = kappa*di/dt - beta*di/dt*|z|^n - gamma*z*|di/dt|*|z|^(n-1)",
    reference="Tang et al. eq. 5; start values of its Tables 3-5",
    inputs=("current",),
    output="flux",
    params=(
        Param("A", "1", 0.5, 1.5, 1.2, text="share of the linear part; 1 or more where the coil loses energy"),
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
    passive=PassiveRange("A", 1.0, 1.5),
    derived=(
        DerivedQuantity("slope", "H", "A*Lc: inductance where z is saturated"),
        DerivedQuantity(
            "amplitude", "Wb", "(1-A)*Lc*z_max/D: flux of the saturated z, negative where the coil loses energy"
        ),
        DerivedQuantity("turnover", "A", "z_max/kappa: current over which the loop turns from one branch to the other"),
        DerivedQuantity("sharpness", "1", "n"),
        DerivedQuantity("rho", "1", "(beta-gamma)/(beta+gamma): ratio that shapes the loop"),
    ),
    free_offset=True,
    co_energy=True,
)

# Least and greatest rho within the bounds of beta and gamma
_KAPPA, _BETA, _GAMMA = SPEC.params[2:5]
_LEAST = (_BETA.low - _GAMMA.high) / (_BETA.low + _GAMMA.high)
_GREATEST = (_BETA.high - _GAMMA.low) / (_BETA.high + _GAMMA.low)
# Bounds of those that z_max scales: kappa, beta, gamma and D, (2, 4, 1)
_SCALED = (_KAPPA, _BETA, _GAMMA, SPEC.params[6])
_LOG_BOUNDS = np.log([[p.low for p in _SCALED], [p.high for p in _SCALED]])[:, :, None]
# What start values are chosen from, as shares of the greatest current: turn-overs of loops as published, turn-overs and
# sharpness of knees; these where their error is at most so many times that of the best loop
_LOOPS = np.geomspace(0.003, 3.0, 14)
_KNEES = np.array([(turnover, n) for n in (2.5, 3.5, 5.0, 7.0) for turnover in np.geomspace(0.2, 0.8, 10)])
_WORSE = 1.3
# Samples they are simulated at: about as many, up to twice
_SCANNED = 1024


# While these hold, the element is stepped along its curve
SHAPE = ("kappa", "beta", "gamma", "n")


def loop(theta: Values) -> tuple[float, float, float, float]:
    """Return the numbers of the branch curve, see ``kernels.branch.normal``."""
    return normal(theta[2], theta[3], theta[4], theta[5])


def step_on_curve(
    state: Branch, before: Values, now: Values, theta: Ends, dt: float, curve: BranchCurve
) -> tuple[float, Branch]:
    """Return the flux linkage in Wb at the end of a step, and where on its curve the element is."""
    share, inductance, _, _, _, _, divisor = theta[1]
    after = branch_step(curve, state, before[0], now[0])
    flux = inductance * (share * now[0] + (1.0 - share) / divisor * curve.z_max * after[0])
    return flux, after


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the flux linkage in Wb, shape (P, N), of a current in A, shape (1, N); dt does not enter."""
    return driven(drive, _kept_forms(theta.tobytes(), theta.shape), dt)


@lru_cache(maxsize=4)
def _kept_forms(theta: bytes, shape: tuple[int, ...]) -> Array:
    """Return ``_reduce`` of parameters; an effect that closes a loop simulates the same many times."""
    return _reduce(np.frombuffer(theta).reshape(shape))


def derived(theta: Array) -> Array:
    """Return slope (H), amplitude (Wb), turn-over current (A), n and rho, shape (P, 5), of theta (P, 7)."""
    share, inductance, kappa, beta, gamma, n, divisor = theta.T
    z_max, rate, rho = normal_form(kappa, beta, gamma, n)
    amplitude = (1.0 - share) * inductance * z_max / divisor
    return np.column_stack([share * inductance, amplitude, 1.0 / rate, n, rho])


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return values whose slope (> 0), amplitude and turn-over current fit best, those without data as published.

    n, beta/gamma and kappa are the published ones, and A is 1.2, or 0.8 for a loop that gains energy.
    """
    return _best(drive[0], output, _loops)[1]


def far_starts(drive: Array, output: Array, dt: float) -> list[dict[str, float]]:
    """Return values of a knee, flux that saturates on one branch as on the other; none where a loop is much nearer.

    The best loop is found from almost anywhere, a knee from near it only, although it may be far the lower minimum.
    """
    error, found = _best(drive[0], output, _knees, rising=True)
    return [found] if error < _WORSE**2 * _best(drive[0], output, _loops)[0] else []


def _best(
    i: Array, flux: Array, tried: Callable[[float], Array], rising: bool = False
) -> tuple[float, dict[str, float]]:
    """Return squared error and values of the best of the forms tried with slope > 0, or amplitude > 0 as well."""
    step = max(1, len(flux) // _SCANNED)
    current = plain(i[::step])
    if not np.ptp(current):
        return np.inf, {}
    forms = tried(largest(current))
    slope, amplitude, error = _fitted_lines(current, bouc_wen(current, forms), flux[::step])
    error = np.where((slope > 0.0) & ((amplitude > 0.0) | (not rising)), error, np.inf)
    best = int(np.argmin(error))
    if not np.isfinite(error[best]):
        return np.inf, {}
    found = _restore(np.array([[slope[best], amplitude[best], *forms[best, 2:]]]))[0]
    return float(error[best]), inside(SPEC, dict(zip(SPEC.names, found.tolist(), strict=True)))


def _loops(scale: float) -> Array:
    """Return forms of ``bouc_wen`` (P, 5) with the published n and beta/gamma, for a greatest current in A."""
    shape = derived(SPEC.start[None, :])[0, 3:]
    return np.array([(0.0, 1.0, 1.0 / (scale * turnover), *shape) for turnover in _LOOPS])


def _knees(scale: float) -> Array:
    """Return forms of ``bouc_wen`` (P, 5) whose branches lie as near to each other as the bounds allow."""
    turnover, n = _KNEES.T
    rate = 1.0 / (scale * turnover)
    # beta + gamma at the least kappa: gamma at its least then is the greatest ratio within all bounds
    total = rate * (_KAPPA.low / rate) ** (1.0 - n)
    rho = np.minimum(1.0 - 2.0 * _GAMMA.low / total, _GREATEST)
    return np.column_stack([np.zeros_like(n), np.ones_like(n), rate, n, rho])


def _fitted_lines(i: Array, y: Array, flux: Array) -> tuple[Array, Array, Array]:
    """Return slope, amplitude and squared error, each (P,), of slope*i + amplitude*y + offset for each row of y (P, N).

    A row that is hardly anything but a line of its own gets no amplitude.
    """
    i, flux, y = i - i.mean(), flux - flux.mean(), y - y.mean(axis=1, keepdims=True)
    along, share = (y @ i) / (i @ i), (flux @ i) / (i @ i)
    bent, left = y - along[:, None] * i, flux - share * i
    power = np.sum(bent**2, axis=1)
    cross = bent @ left
    amplitude = np.divide(cross, power, out=np.zeros_like(power), where=power > 1e-9 * np.sum(y**2, axis=1))
    return share - amplitude * along, amplitude, left @ left - amplitude * cross


def _reduce(theta: Array) -> Array:
    forms = derived(theta)
    forms[:, 2] = 1.0 / forms[:, 2]
    return forms


def _restore(reduced: Array) -> Array:
    slope, amplitude, rate, n, rho = reduced.T
    return np.delete(restored(slope, amplitude, rate, (n, n), rho), 5, axis=1)


def restored(slope: Array, amplitude: Array, rate: Array, exponents: tuple[Array, Array], rho: Array) -> Array:
    """Return A, Lc, kappa, beta, gamma, the exponents of beta and gamma, and D, (P, 8), of what data determine, (P,).

    A = 1.2, or 0.8 where the loop gains energy, and kappa is as published or near it: z_max is the nearest with which
    kappa, beta, gamma and D lie within their bounds, where that can be.
    """
    n1, n2 = exponents
    one = np.ones_like(n1)
    share = np.where(amplitude < 0.0, 1.2, 0.8)
    with np.errstate(divide="ignore", invalid="ignore"):
        divisor = (1.0 - share) * (slope / share) / amplitude
        # kappa, beta, gamma and D at z_max = 1, and the power of z_max they go with
        values = np.log([rate, printed_form(rate, n1, rho, one)[1], printed_form(rate, n2, rho, one)[2], divisor])
        powers = np.array([one, 1.0 - n1, 1.0 - n2, one])
        ends = (_LOG_BOUNDS - values) / powers
    bounds = (powers != 0.0) & np.isfinite(values)
    least, most = np.where(bounds, ends.min(axis=0), -np.inf), np.where(bounds, ends.max(axis=0), np.inf)
    z_max = np.exp(np.clip(np.log(SPEC.start[2] / rate), least.max(axis=0), most.min(axis=0)))
    kappa, beta, _ = printed_form(rate, n1, rho, z_max)
    gamma = printed_form(rate, n2, rho, z_max)[2]
    return np.column_stack([share, slope / share, kappa, beta, gamma, n1, n2, divisor * z_max])


REDUCED = ReducedModel(
    spec=replace(
        SPEC,
        params=(
            Param("slope", "H", 5e-5, 15.0, 0.024, "log", text="A*Lc"),
            Param("amplitude", "Wb", -10.0, 10.0, -1e-3, text="(1-A)*Lc*z_max/D"),
            Param("rate", "1/A", 0.03, 9000.0, 10.0, "log", text="kappa/z_max"),
            SPEC.params[5],
            Param("rho", "1", _LEAST, _GREATEST, -1.0 / 3.0, text="(beta-gamma)/(beta+gamma)"),
        ),
        linear=("slope", "amplitude"),
        derived=(),
    ),
    response=driven,
    rough=driven_roughly,
    reduce=_reduce,
    restore=_restore,
)
