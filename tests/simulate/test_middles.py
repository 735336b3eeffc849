"""What a model makes in the middle between samples."""

import numpy as np
import pytest

from mrfit.kernels.filters import times_of
from mrfit.simulate.assembly import assemble
from mrfit.simulate.middles import apart, between, halved, middles_of


def test_middles_lie_on_the_line_between_samples() -> None:
    assert np.array_equal(middles_of(np.array([[1.0, 3.0, 2.0]])), [[1.0, 2.0, 2.5]])
    assert np.array_equal(between(np.array([[1.0, 3.0, 2.0]]), np.array([[9.0, 2.0, 2.5]])), [[1, 2, 3, 2.5, 2]])
    assert (halved(0.4), apart(0.4)) == (0.2, 0.4)
    steps = np.array([9.0, 1.0, 3.0, 2.0])
    times = times_of(steps)
    assert np.array_equal(times_of(halved(steps))[1::2], middles_of(times[None])[0, 1:])
    assert np.array_equal(np.cumsum(apart(steps)[2:]), middles_of(times[None])[0, 2:] - 0.5)


@pytest.mark.parametrize("name", ["lugre+delay", "spencer+delay", "tanh+stribeck+delay"])
def test_samples_do_not_feel_them(name: str) -> None:
    """A share of lag that is all but none gives what none gives, for a model with memory too."""
    t = 1e-3 * np.arange(400.0)
    w = 2 * np.pi * 5
    drive = {"velocity": 0.1 * np.cos(w * t), "displacement": 0.1 / w * np.sin(w * t)}
    model = assemble(name)
    channels = np.stack([drive[n] for n in model.spec.inputs])
    start = {p.name: p.start for p in model.spec.params} | {"stribeck.fs": 40.0, "delay.tau": 3e-4}
    theta = np.array([[{**start, "delay.s": s}[n] for n in model.spec.names] for s in (0.0, 1e-9)])
    without, hardly = model.simulate(channels, theta, 1e-3)
    assert np.abs(hardly - without).max() < 1e-6 * np.ptp(without)
