import numpy as np
import pytest

from mrfit.flux.plateau import resistance_of_plateaus, steady_blocks


def step(levels: list[float], offset: float = 0.0, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return voltage and current of a coil (R 2.1 ohm, L/R 20 ms) stepped through levels, 1 s each, at 1 kHz."""
    rng = np.random.default_rng(seed)
    volts = np.repeat([2.1 * level for level in levels], 1000)
    current = np.empty(len(volts))
    i = volts[0] / 2.1
    for k, u in enumerate(volts):
        i += (u / 2.1 - i) * 1e-3 / 0.02
        current[k] = i
    return volts + offset + 0.004 * rng.standard_normal(len(volts)), current + 0.002 * rng.standard_normal(len(volts))


def test_steps_give_the_resistance_free_of_offsets() -> None:
    voltage, current = step([0.0, 1.0, 3.0, 2.0], offset=0.05)
    found = resistance_of_plateaus([steady_blocks(voltage, current)], float(np.max(current)))
    assert found is not None
    assert found[0] == pytest.approx(2.1, abs=max(4 * found[1], 1e-3))
    assert "slope" in found[2]


def test_one_direct_current_gives_the_quotient() -> None:
    voltage, current = step([3.0, 3.0])
    found = resistance_of_plateaus([steady_blocks(voltage, current)], 3.0)
    assert found is not None
    assert found[0] == pytest.approx(2.1, rel=1e-3)
    assert "offset" in found[2]


def test_a_probe_at_rest_gives_none() -> None:
    voltage, current = step([0.01, 0.01])
    assert resistance_of_plateaus([steady_blocks(voltage, current)], 5.0) is None
    assert resistance_of_plateaus([], 0.0) is None


def test_moving_signals_have_no_steady_blocks() -> None:
    turn = np.arange(5000) / 50
    assert len(steady_blocks(np.cos(turn), np.sin(turn))) == 0
