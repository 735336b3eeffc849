"""Intervals hold the truth although every condition has an error of form of its own."""

import numpy as np

from mrfit.discover.evidence.clusters import clustered
from mrfit.fit.diagnostics.uncertainty import analyse

CONDITIONS, SAMPLES = 9, 400


def slope_and_widths(rng: np.random.Generator, scatter: float) -> tuple[float, float, float]:
    """Fit y = 0.5*x over conditions whose own slopes scatter; return the slope and both half-widths."""
    x = [rng.standard_normal(SAMPLES) for _ in range(CONDITIONS)]
    y = [(0.5 + scatter * rng.standard_normal()) * c + 0.1 * rng.standard_normal(SAMPLES) for c in x]
    jacobians = [c[:, None] for c in x]
    slope = float(np.linalg.lstsq(np.vstack(jacobians), np.concatenate(y), rcond=None)[0][0])
    residuals = [slope * c - d for c, d in zip(x, y, strict=True)]
    within = analyse(jacobians, residuals)
    both = clustered(within, jacobians, residuals, [f"c{k}" for k in range(CONDITIONS)])
    one = np.ones(1)
    return slope, within.half_width(one), both.half_width(one)


def test_scatter_between_conditions_is_in_the_interval() -> None:
    rng = np.random.default_rng(3)
    held = np.array(
        [[abs(s - 0.5) < w for w in widths] for s, *widths in (slope_and_widths(rng, 0.2) for _ in range(200))]
    )
    assert held[:, 0].mean() < 0.6
    assert 0.91 < held[:, 1].mean() < 0.99


def test_intervals_are_not_narrower_than_the_noise_within_records_makes_them() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        _, within, both = slope_and_widths(rng, 0.0)
        assert both >= within * (1 - 1e-9)


def test_two_conditions_tell_no_scatter() -> None:
    rng = np.random.default_rng(5)
    jacobians, residuals = [rng.standard_normal((50, 1)) for _ in range(2)], [rng.standard_normal(50) for _ in range(2)]
    within = analyse(jacobians, residuals)
    assert clustered(within, jacobians, residuals, ["a", "b"]) is within
