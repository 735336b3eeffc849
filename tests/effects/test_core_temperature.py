"""Temperature of a core: its three rates act on inductance, saturation and coercive current."""

import numpy as np
import pytest

from mrfit.simulate.assembly import assemble

BASE = {"L": 0.03, "flux_s": 0.1, "p": 4.0, "i_c": 0.2, "flux_y": 0.004, "q": 0.2, "g": 0.5, "m": 0.0, "T": 1e-3}
RATES = {"core-temperature.b_L": 0.006, "core-temperature.b_s": 0.002, "core-temperature.b_c": 0.02}
FLUX = 0.09 * np.sin(np.linspace(0, 12, 800))


def simulated(temperature: np.ndarray, **rates: float) -> np.ndarray:
    whole = assemble("stop-mmf+core-temperature")
    return whole.simulate(np.stack([FLUX, temperature]), whole.spec.theta({**BASE, **rates})[None], 1e-3)[0]


@pytest.mark.parametrize("temperature", [25.0, 70.0])
def test_at_a_temperature_it_is_the_base_with_other_parameters(temperature: float) -> None:
    warm = temperature - 25.0
    moved = BASE | {
        "L": 0.03 * np.exp(0.006 * warm),
        "flux_s": 0.1 * np.exp(-0.002 * warm),
        "i_c": 0.2 * np.exp(-0.02 * warm),
    }
    base = assemble("stop-mmf")
    alone = base.simulate(FLUX[None], base.spec.theta(moved)[None], 1e-3)[0]
    np.testing.assert_allclose(simulated(np.full(800, temperature), **RATES), alone, rtol=1e-12)


def test_a_temperature_that_moves_goes_from_the_one_to_the_other() -> None:
    ramp = np.interp(np.arange(800), [0, 300, 500, 800], [25.0, 25.0, 70.0, 70.0])
    found, cold = simulated(ramp, **RATES), simulated(np.full(800, 25.0), **RATES)
    np.testing.assert_allclose(found[:300], cold[:300], rtol=1e-12)
    assert np.max(np.abs(found[500:] - cold[500:])) > 0.1
