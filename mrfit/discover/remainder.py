"""Is there structure left? What a flexible model of the residual, knowing no physics, predicts on held-out data."""

from collections.abc import Sequence

import numpy as np

from mrfit.discover.bench import Bench, Stretch
from mrfit.specs import Array

FEATURES = 120
RIDGE = 1e-3
MOST_ROWS = 20_000


def explainable(bench: Bench, train: Sequence[Array], holdout: Sequence[Array], seed: int) -> float:
    """Return the share of the squared hold-out residual that a nonparametric model of the training residual predicts.

    Ridge regression on random Fourier features (Rahimi & Recht 2007) of the inputs, their rates and the past of the
    drive; negative where it predicts nothing.

    Parameters
    ----------
    bench
        The data.
    train, holdout
        Residuals in multiples of the noise floor, one (N_s,) for each segment of the role.
    seed
        Of the random features.
    """
    inputs = [_inputs(s) for s in (*bench.of_role("train"), *bench.of_role("holdout"))]
    pooled = np.vstack(inputs)
    centre, scale = pooled.mean(axis=0), np.maximum(pooled.std(axis=0), 1e-300)
    rng = np.random.default_rng(seed)
    weights = rng.standard_normal((pooled.shape[1], FEATURES))
    phases = rng.uniform(0, 2 * np.pi, FEATURES)
    count = len(bench.of_role("train"))

    def design(parts: Sequence[Array]) -> Array:
        scaled = (np.vstack(parts) - centre) / scale
        columns: Array = np.hstack([scaled, np.cos(scaled @ weights + phases)])
        return columns

    target = np.concatenate(train)
    stride = max(1, len(target) // MOST_ROWS)
    rows = design(inputs[:count])[::stride]
    penalty = RIDGE * len(rows) * np.eye(rows.shape[1])
    coefficients = np.linalg.solve(rows.T @ rows + penalty, rows.T @ target[::stride])
    measured = np.concatenate(holdout)
    left = measured - design(inputs[count:]) @ coefficients
    return 1.0 - float(left @ left) / max(float(measured @ measured), 1e-300)


def _inputs(stretch: Stretch) -> Array:
    columns = []
    for name in ("current", "displacement", "velocity", "acceleration", "temperature"):
        values = stretch.channel(name)
        if values is None:
            continue
        columns.append(values)
        if name in ("current", "velocity"):
            rate = np.gradient(values) / stretch.block.dt
            columns += [
                np.sign(rate),
                rate,
                _past(values, stretch.block.dt, 0.01),
                _past(values, stretch.block.dt, 0.05),
            ]
    return np.stack(columns, axis=1)


def _past(values: Array, dt: float, seconds: float) -> Array:
    """Return a channel as it was some time ago, its first value before the record began."""
    back = max(int(round(seconds / dt)), 1)
    past: Array = np.concatenate([np.full(min(back, len(values)), values[0]), values[:-back]])[: len(values)]
    return past
