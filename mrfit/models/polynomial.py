"""Polynomial in velocity, one for falling and one for rising velocity.

    F = sum_i a_i*P_i(v/v_max) for a < 0,    F = sum_i b_i*P_i(v/v_max) for a >= 0,    i = 0 ... 12

v velocity (m/s), a acceleration (m/s^2), F force (N), P_i Legendre polynomials, a_i and b_i coefficients (N), v_max the
velocity mapped to 1 (m/s). The offset of the gas accumulator is part of a_0 and b_0. The Legendre basis spans the same
functions as the powers of v in the source, but powers up to 12 leave least squares without a digit. v_max chooses the
basis only: no data determine it, so it is held at the greatest velocity of the training logs unless --bounds or --start
frees it. Beyond it the polynomials are worthless, as the source warns.

Source: preyield paper eq. 9, order 12 as recommended there.
"""

from collections.abc import Iterator

import numpy as np

from mrfit.core.specs import Array, Mask, ModelSpec, Param
from mrfit.kernels.jit import where
from mrfit.kernels.points import inside, largest
from mrfit.kernels.theta import evaluate

ORDER = 12
_CHUNK = 4096  # samples whose basis stays in cache

SPEC = ModelSpec(
    name="polynomial",
    title="Polynomials of order 12 in velocity, by sign of acceleration",
    equation="F = sum_i a_i*P_i(v/v_max) for a < 0, sum_i b_i*P_i(v/v_max) for a >= 0;  P_i Legendre, i = 0 ... 12",
    reference="preyield paper eq. 9",
    inputs=("velocity", "acceleration"),
    output="force",
    params=(
        *(Param(f"a{i}", "N", -1e5, 1e5, 0.0, text=f"order {i}, velocity falling") for i in range(ORDER + 1)),
        *(Param(f"b{i}", "N", -1e5, 1e5, 0.0, text=f"order {i}, velocity rising") for i in range(ORDER + 1)),
        Param("v_max", "m/s", 1e-3, 10.0, 0.5, "log", text="velocity mapped to 1, a choice of basis", fixed=True),
    ),
    linear=(*(f"a{i}" for i in range(ORDER + 1)), *(f"b{i}" for i in range(ORDER + 1))),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of velocity (m/s) and acceleration (m/s^2), shape (2, N)."""
    if theta.ndim == 3:
        return evaluate(law, drive, theta)
    out = np.empty((len(theta), drive.shape[1]))
    for v_max in np.unique(theta[:, -1]):
        rows = theta[:, -1] == v_max
        for first in range(0, drive.shape[1], _CHUNK):
            chunk = slice(first, first + _CHUNK)
            out[rows, chunk] = theta[rows, :-1] @ _basis(drive[0, chunk] / v_max, drive[1, chunk] >= 0)
    return out


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the greatest velocity as v_max and the coefficients that fit best by linear least squares."""
    v, a = drive
    v_max = inside(SPEC, {"v_max": largest(v)}).get("v_max", SPEC.start[-1])
    basis = np.polynomial.legendre.legvander(np.clip(v / v_max, -1, 1), ORDER)
    found = {"v_max": v_max}
    for letter, rows in (("a", a < 0), ("b", a >= 0)):
        if rows.any():
            weights = np.linalg.lstsq(basis[rows], output[rows], rcond=1e-9)[0]
            found |= {f"{letter}{i}": float(weight) for i, weight in enumerate(weights)}
    return inside(SPEC, found)


def law(v: Array, a: Array, *parameters: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    u = v / parameters[2 * ORDER + 2]
    before, now, force = 0.0 * u, 0.0 * u + 1.0, 0.0 * u
    for i in range(ORDER + 1):
        force = force + where(a >= 0.0, parameters[ORDER + 1 + i], parameters[i]) * now
        before, now = now, ((2 * i + 1) * u * now - i * before) / (i + 1)
    return force


def _legendre(u: Array) -> Iterator[Array]:
    """Yield the Legendre polynomials of order 0 to ORDER at u."""
    before, now = np.zeros_like(u), np.ones_like(u)
    for i in range(ORDER + 1):
        yield now
        before, now = now, ((2 * i + 1) * u * now - i * before) / (i + 1)


def _basis(u: Array, rising: Mask) -> Array:
    """Return the functions whose weights are a0 ... b12, shape (26, N)."""
    values = np.stack(list(_legendre(u)))
    return np.vstack([values * ~rising, values * rising])
