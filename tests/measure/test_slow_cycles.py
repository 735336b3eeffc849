"""Friction and gas spring of a slow test, and the reason where the test is not slow."""

import numpy as np
import pytest

from mrfit.measure.slow_cycles import quantities
from tests.measure.rigs import cycles, recording


def test_planted_friction_and_gas_spring_are_found() -> None:
    time = np.arange(60_000) / 100.0
    moved = 0.02 * np.sin(2 * np.pi * 0.01 * time)
    velocity = 0.02 * 2 * np.pi * 0.01 * np.cos(2 * np.pi * 0.01 * time)
    force = 40.0 * np.sign(velocity) + 900.0 * moved + 150.0 + 0.5 * np.random.default_rng(1).standard_normal(len(time))
    whole = cycles(recording("s", 0.01, displacement=moved, force=force))
    found = {q.name: q.estimate for q in quantities(whole, 0.005)}
    for name, truth in (("friction", 40.0), ("gas force", 150.0), ("gas rate", 900.0)):
        one = found[name]
        assert one is not None and one.value == pytest.approx(truth, rel=2e-3)
    assert all("no slow test" in q.reason for q in quantities(whole, 0.001))
