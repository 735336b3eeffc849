"""Samples in the middle between others."""

import numpy as np

from mrfit.kernels.uneven import times_of
from mrfit.simulate.assembly import assemble
from mrfit.simulate.middles import halved, with_middles


def test_middles_lie_on_the_line_between_samples() -> None:
    assert np.array_equal(with_middles(np.array([[1.0, 3.0, 2.0]])), [[1.0, 2.0, 3.0, 2.5, 2.0]])
    assert halved(0.4) == 0.2
    steps = np.array([9.0, 1.0, 3.0])
    assert np.array_equal(times_of(halved(steps)), with_middles(times_of(steps)[None])[0])


def test_a_base_does_not_feel_them() -> None:
    """A share of lag that is all but none gives what none gives, for a base with memory too."""
    v = 0.1 * np.cumsum(np.random.default_rng(2).normal(size=300))
    model = assemble("lugre+delay")
    start = np.array([[*model.spec.start[:-2], 3e-4, 0.0], [*model.spec.start[:-2], 3e-4, 1e-9]])
    drive = np.stack([{"velocity": v, "displacement": 1e-3 * np.cumsum(v)}[n] for n in model.spec.inputs])
    without, with_middle = model.simulate(drive, start, 1e-3)
    assert np.abs(with_middle - without).max() < 1e-6 * np.ptp(without)
