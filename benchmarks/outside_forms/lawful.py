"""What any law could make: columns odd in the motion that forget it and know neither place, time nor temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.signal import lfilter

from .laws import Array, Damper

KNEES = (0.02, 0.05, 0.12, 0.4)  # of the largest speed
STOPS = (0.02, 0.06, 0.15, 0.3)  # of the stroke
LAGS = (0.004, 0.012, 0.035)  # s


def stop(x: Array, width: float) -> Array:
    """Return the stop operator of a path, between -1 and 1: it follows the path until it yields at ``width``."""
    z, at = np.empty(x.size), 0.0
    for k, step in enumerate(np.diff(x, prepend=x[0]).tolist()):
        at = min(max(at + step / width, -1.0), 1.0)
        z[k] = at
    return z


def lagged(signal: Array, tau: float, dt: float) -> Array:
    """Return a signal behind a lag of first order (s), settled at its start."""
    keep = np.exp(-dt / tau)
    return lfilter([1 - keep], [1, -keep], signal, zi=[keep * signal[0]])[0]


def lawful_columns(runs: Sequence[Mapping[str, Array]], damper: Damper) -> Array:
    """Return an orthonormal basis (samples, columns) of what any law makes of these tests, of all runs in one.

    The columns are 1, powers and knees of the speed, stops of the path and lagged speeds, times powers of the current.
    A lag of the speed without current is left out: it is a negative mass.
    """
    parts = []
    for values in runs:
        w, dt = values["v"] / damper.speed, float(values["t"][1] - values["t"][0])
        columns = [w, w**3, np.sign(w) * np.sqrt(np.abs(w)), *(np.tanh(w / s) for s in KNEES)]
        columns += [stop(values["x"], s * damper.stroke) for s in STOPS]
        columns += [lagged(np.tanh(w / 0.1), tau, dt) for tau in LAGS]
        late = [lagged(w, tau, dt) for tau in LAGS]
        u = values["i"] / damper.greatest
        at_current = [c * u**k for k in range(3) for c in (*columns, *(late if k else ()))]
        parts.append(np.stack([np.ones_like(w), *at_current], axis=1))
    return basis(np.concatenate(parts))


def plain_columns(runs: Sequence[Mapping[str, Array]], damper: Damper) -> Array:
    """Return an orthonormal basis (samples, columns) of a plain base: offset, damping and a knee, over the current."""
    w = np.concatenate([values["v"] for values in runs]) / damper.speed
    u = np.concatenate([values["i"] for values in runs]) / damper.greatest
    columns = [c * u**k for k in range(3) for c in (w, np.tanh(w / 0.1))]
    return basis(np.stack([np.ones_like(w), *columns], axis=1))


def basis(whole: Array) -> Array:
    """Return an orthonormal basis of the span of columns."""
    u, s, _ = np.linalg.svd(whole / np.linalg.norm(whole, axis=0), full_matrices=False)
    return u[:, s > 1e-6 * s[0]]


def outside(columns: Array, force: Array) -> Array:
    """Return the part of a force, or of several beside each other, that no law makes."""
    return force - columns @ (columns.T @ force)
