"""The fused comparison equals what numpy gives in several passes."""

import numpy as np

from mrfit.kernels.folding import compare


def test_weighted_differences_less_their_mean_are_scaled() -> None:
    rng = np.random.default_rng(1)
    simulated, target = rng.standard_normal((5, 40)), rng.standard_normal(12)
    nodes, weights = rng.integers(40, size=(12, 4)), rng.standard_normal((12, 4))
    shares, scale = rng.random(12), rng.random(12)
    shares /= shares.sum()
    out = np.empty((5, 12))
    compare(simulated, nodes, weights, (target, shares, scale), 1, out)
    delta = (simulated[:, nodes] * weights).sum(axis=2) - target
    assert np.allclose(out, scale * (delta - (delta @ shares)[:, None]))
    compare(simulated, nodes, weights, (target, np.empty(0), scale), 1, out)
    assert np.allclose(out, scale * delta)


def test_a_row_that_diverged_spoils_no_other() -> None:
    simulated = np.ones((3, 4))
    simulated[1, 2] = np.inf
    nodes, ones = np.arange(4)[:, None], np.ones(4)
    out = np.empty((3, 4))
    compare(simulated, nodes, ones[:, None], (np.zeros(4), ones / 4, ones), 1, out)
    assert np.isnan(out[1]).all()
    assert np.isfinite(out[[0, 2]]).all()


def test_derivatives_have_no_target() -> None:
    rng = np.random.default_rng(2)
    simulated, target, scale = rng.standard_normal((6, 9)), rng.standard_normal(9), rng.random(9)
    out = np.empty((6, 9))
    compare(simulated, np.arange(9)[:, None], np.ones((9, 1)), (target, np.empty(0), scale), 3, out)
    assert np.allclose(out[::3], scale * (simulated[::3] - target))
    assert np.allclose(out[1::3], scale * simulated[1::3]) and np.allclose(out[2::3], scale * simulated[2::3])
