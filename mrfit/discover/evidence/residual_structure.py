"""Is there structure left? Noise neither repeats nor knows what the specimen does; missing physics does one of these.

Asked of the residual: what of it a flexible model, knowing no physics, predicts on held-out data; what of it repeats
from cycle to cycle; and whether what does not repeat is larger where the output is large.
"""

from collections.abc import Sequence

import numpy as np

from mrfit.core.channels import REMEMBERED, STATE_CHANNELS
from mrfit.core.specs import Array
from mrfit.discover.evidence.bench import Bench, Stretch
from mrfit.discover.evidence.refit import Refit, usual
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.questions import Contrast
from mrfit.fit.diagnostics.uncertainty import differing


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
    weights = rng.standard_normal((pooled.shape[1], STANDARD.structure_features))
    phases = rng.uniform(0, 2 * np.pi, STANDARD.structure_features)
    count = len(bench.of_role("train"))

    def design(parts: Sequence[Array]) -> Array:
        scaled = (np.vstack(parts) - centre) / scale
        return np.hstack([scaled, np.cos(scaled @ weights + phases)])

    target = np.concatenate(train)
    stride = max(1, len(target) // STANDARD.structure_rows)
    rows = design(inputs[:count])[::stride]
    penalty = STANDARD.structure_ridge * len(rows) * np.eye(rows.shape[1])
    coefficients = np.linalg.solve(rows.T @ rows + penalty, rows.T @ target[::stride])
    measured = np.concatenate(holdout)
    left = measured - design(inputs[count:]) @ coefficients
    return 1.0 - float(left @ left) / max(float(measured @ measured), 1e-300)


def _inputs(stretch: Stretch) -> Array:
    columns = []
    for name in STATE_CHANNELS:
        values = stretch.channel(name)
        if values is None:
            continue
        columns.append(values)
        if name in REMEMBERED:
            rate = np.gradient(values) / stretch.block.dt
            columns += [
                np.sign(rate),
                rate,
                *(_past(values, stretch.block.dt, past) for past in STANDARD.structure_pasts),
            ]
    return np.stack(columns, axis=1)


def _past(values: Array, dt: float, seconds: float) -> Array:
    """Return a channel as it was some time ago, its first value before the record began."""
    back = max(int(round(seconds / dt)), 1)
    return np.concatenate([np.full(min(back, len(values)), values[0]), values[:-back]])[: len(values)]


def repeated_error(bench: Bench, fit: Refit) -> float:
    """Return the RMS error in multiples of the noise floor where cycles tell the noise; 0 if nowhere.

    It is the larger one of fitted and held-out records: what repeats and cannot even be fitted is missing. Elsewhere
    the floor knows white noise only, or borrows the noise's colour, and an error above it may be noise.
    """
    errors = []
    for role, found in (("train", fit.train), ("holdout", fit.holdout)):
        known = [e for e, s in zip(found, bench.of_role(role), strict=True) if s.repeats]
        errors.append(usual(known) if known else 0.0)
    return max(errors)


def powers_by_output(bench: Bench, fit: Refit, fewest_cycles: int) -> tuple[Contrast, ...]:
    """Return contrasts of the error that does not repeat between large and small output, for long records."""
    contrasts = []
    stretches = [*bench.of_role("train"), *bench.of_role("holdout")]
    for error, stretch in zip([*fit.train, *fit.holdout], stretches, strict=True):
        cycles = int(len(error) / stretch.block.period) if stretch.repeats else 0
        if cycles >= fewest_cycles:
            contrasts.append(_halves(error, stretch, cycles))
    return tuple(contrasts)


def _halves(error: Array, stretch: Stretch, cycles: int) -> Contrast:
    """Return the logarithm of the ratio of powers where |output| is large and small, and its score over the cycles."""
    period = stretch.block.period
    power = differing(error, period) ** 2
    away = np.abs(stretch.measured - 0.5 * (stretch.measured.max() + stretch.measured.min()))
    upper = away > np.median(away)
    cycle = (np.arange(len(error)) / period).astype(np.int64)
    high, low = (np.bincount(cycle[half], power[half], cycles + 1)[:cycles] for half in (upper, ~upper))
    spread = float(np.std(high - low, ddof=1)) / np.sqrt(cycles)
    score = float(np.mean(high - low)) / spread if spread > 0.0 else 0.0
    return Contrast(float(np.log(max(float(high.sum()), 1e-300) / max(float(low.sum()), 1e-300))), score)
