"""The phase of a smoothed motion is known by all its samples, and every quantity that depends on it says so."""

import numpy as np
import pytest

from datasets.rig.closed_forms import Rig
from mrfit.measure.intervals import student_quantile
from tests.measure.rigs import cycles, known, quantities, recording


def _record(seed: int, noise: float) -> tuple[Rig, float, np.ndarray, np.ndarray]:
    rig = Rig("bilinear", 1.0, 210.0, noise=0.0, seed=seed, cycles=10)
    displacement, force = rig.record()
    rng = np.random.default_rng(seed)
    displacement = displacement + noise * rig.amplitude * rng.standard_normal(len(displacement))
    return rig, rig.truth()["E"], displacement, force + 1e-3 * rig.truth()["Fmax+"] * rng.standard_normal(len(force))


def test_the_energy_of_a_noisy_stroke_is_held_as_often_as_is_said() -> None:
    held = 0
    for seed in range(9100, 9120):
        _, truth, displacement, force = _record(seed, 0.005)
        found = known(quantities(cycles(recording("a", 1.0 / 210.0, displacement=displacement, force=force))))["E"]
        held += found.low <= truth <= found.high
    # 17 of 20 without the phase
    assert held >= 19


def test_an_interval_grows_by_the_change_that_a_standard_deviation_of_the_phase_makes() -> None:
    rig, _, displacement, force = _record(9100, 0.005)
    whole = cycles(recording("a", 1.0 / 210.0, displacement=displacement, force=force))
    found = known(quantities(whole))["E"]
    deviation = 0.005 * rig.amplitude / (rig.speed * np.sqrt(whole.count * whole.per_cycle / 2.0))
    late = whole.late_by(deviation).work.values.mean() - whole.work.values.mean()
    alone = whole.estimate(lambda w, g: w * g, whole.work, whole.gains)
    added = student_quantile(found.freedom) * abs(late)
    assert found.error == pytest.approx(np.hypot(alone.error, added), rel=0.1)
    assert added > 0.5 * alone.error
