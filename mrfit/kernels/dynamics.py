"""The linear dynamics of the Hammerstein-Wiener damper: from coil current to field, and behind the static force."""

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.lti import delayed, unit_gain_filter


def magnetisation_filter(current: Array, poles: Array, lead: Array, tau: Array, dt: float) -> Array:
    """Return the magnetising current M(s)*i, (P, N), of a coil current (N,), in its unit.

    M(s) = (1 + lead*s)/((1 + s/q1)*(1 + s/q2))*exp(-tau*s); poles q1, q2 in 1/s, (P, 2); lead, the inverse of the zero,
    and delay tau in s, (P,).

    Source: Savaia et al. eq. 7.
    """
    zeros = np.column_stack([lead, np.zeros(len(lead))])
    return unit_gain_filter(delayed(current, tau / dt), poles, zeros, dt)


def hysteresis_filter(force: Array, poles: Array, turn: Array, xi: Array, dt: float) -> Array:
    """Return H(s)*F, (P, N), of forces (P, N), in their unit.

    H(s) = (1 + 2*xi*turn*s + turn^2*s^2)/prod_k(1 + s/p_k); poles p1 ... p4 in 1/s, (P, 4); turn, the inverse of the
    zeros' angular frequency, in s, and their damping ratio xi, (P,).

    Source: Savaia et al. eq. 5.
    """
    zeros = np.column_stack([2.0 * xi * turn, turn**2])
    return unit_gain_filter(force, poles, zeros, dt)
