"""How much of a hidden effect the base law cannot absorb: the bench refits its own base law to noise-free records.

The answer is an NRMSE (share of the pooled range). It says how visible an effect is, whatever program looks for it.
"""

import numpy as np
from scipy.optimize import least_squares

from datasets.rig.boucwen import FluxBoucWen
from datasets.rig.coil_bench import PER_PERIOD, CoilRecord
from datasets.rig.damper import Damper
from datasets.rig.damper_bench import DamperRecord
from datasets.rig.stop import Array

SETTLING, COMPARED = 2, 4
LIMIT = 2.0  # z settles at 1; trial points beyond are only kept from overflowing


def nrmse(difference: Array, reference: Array) -> float:
    """Return rms(difference) over the range of the reference."""
    return float(np.sqrt(np.mean(difference**2)) / np.ptp(reference))


def damper_gap(record: DamperRecord, truth: Damper, every: int = 7) -> tuple[float, float]:
    """Return the NRMSE of the true base law, and of the base law refitted, on what the sensors present."""
    x, v, i, force = (a[:, ::every] for a in (record.position, record.speed, record.current, record.force))

    def law(p: Array) -> Array:
        knee = float(np.exp(p[6]))
        base = Damper((p[0], p[1], p[2]), (p[3], p[4], p[5]), knee, p[7], p[8], p[9], truth.plain)
        damping, spring = base.force(x, v, i)
        total: Array = damping + spring
        return total

    start = np.array([*truth.yields, *truth.viscous, np.log(truth.knee), truth.turn, truth.stiffness, truth.offset])
    scale = np.array([20.0, 20.0, 10.0, 50.0, 50.0, 20.0, 0.1, 0.1, 300.0, 30.0])
    if truth.plain:
        scale[7:9] = 0.0
    best = least_squares(lambda q: (law(start + scale * q) - force).ravel(), np.zeros(10), max_nfev=40)
    return nrmse(law(start) - force, force), nrmse(best.fun, force)


def rebuilt_flux(voltage: Array, current: Array, interval: Array, resistance: float) -> Array:
    """Return the flux of the last four periods from u - R i, its mean and mean slope removed, (runs, samples)."""
    rate = voltage - resistance * current
    middle = 0.5 * (rate[:, 1:] + rate[:, :-1]) * interval[:, None]
    flux = np.cumsum(middle, axis=1)[:, -COMPARED * PER_PERIOD :]
    return _closed(flux)


def _closed(flux: Array) -> Array:
    slope = np.mean(flux[:, -PER_PERIOD:] - flux[:, :PER_PERIOD], axis=1) / (flux.shape[1] - PER_PERIOD)
    level = flux - slope[:, None] * np.arange(flux.shape[1])
    closed: Array = level - level.mean(axis=1, keepdims=True)
    return closed


def coil_gap(record: CoilRecord, iron: FluxBoucWen, resistance: float, integrator: bool) -> tuple[float, float]:
    """Return the NRMSE of a Bouc-Wen law, and of that law refitted, on what the instruments present."""
    if integrator:
        flux = record.integrated[:, -COMPARED * PER_PERIOD :]
        flux = flux - flux.mean(axis=1, keepdims=True)
    else:
        flux = rebuilt_flux(record.voltage, record.current, record.interval, resistance)
    current = record.current[:, -(SETTLING + COMPARED) * PER_PERIOD - 1 :]
    reduced = np.array(
        [
            iron.A * iron.Lc,
            (1 - iron.A) * iron.Lc / iron.D * iron.kappa,
            np.log(iron.kappa),
            iron.beta / iron.kappa,
            np.log(iron.n),
        ]
    )
    scale = np.array([0.1 * reduced[0], 0.1 * reduced[0], 0.2, 0.1, 0.1])

    def residual(q: Array) -> Array:
        return (reduced_law(current, (reduced + scale * q)[None])[0] - flux).ravel()

    def jacobian(q: Array) -> Array:
        points = reduced + scale * np.vstack([q, q + 1e-4 * np.eye(5)])
        paths = reduced_law(current, points)
        return np.array([(path - paths[0]).ravel() / 1e-4 for path in paths[1:]]).T

    best = least_squares(residual, np.zeros(5), jacobian, max_nfev=12)
    return nrmse(residual(np.zeros(5)), flux), nrmse(best.fun, flux)


def reduced_law(current: Array, points: Array) -> Array:
    """Return the centred flux (points, runs, samples) of the last four periods for reduced parameters (points, 5)."""
    slope, initial, log_rate, rho, log_n = (column[:, None] for column in points.T)
    rate, n = np.exp(log_rate), np.exp(log_n)
    z = np.zeros((len(points), len(current)))
    path = np.empty((COMPARED * PER_PERIOD, *z.shape))
    first = current.shape[1] - len(path)
    for k in range(1, current.shape[1]):
        move = current[:, k] - current[:, k - 1]
        z = _step(z, rate * move, (rho, (1 - rho) * np.sign(move), n))
        if k >= first:
            path[k - first] = slope * current[:, k] + initial / rate * z
    flux = np.moveaxis(path, 0, 2)
    centred: Array = flux - flux.mean(axis=2, keepdims=True)
    return centred


def _step(z: Array, travel: Array, shape: tuple[Array, Array, Array]) -> Array:
    rho, turn, n = shape

    def slope(at: Array) -> Array:
        value: Array = travel * (1.0 - np.minimum(np.abs(at), LIMIT) ** n * (rho + turn * np.sign(at)))
        return value

    one = slope(z)
    two = slope(z + 0.5 * one)
    three = slope(z + 0.5 * two)
    four = slope(z + three)
    stepped: Array = np.clip(z + (one + 2 * two + 2 * three + four) / 6, -LIMIT, LIMIT)
    return stepped
