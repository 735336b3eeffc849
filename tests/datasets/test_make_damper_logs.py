"""The three logs of the first pages: the same bytes again, five currents, and the law of README.md in the force."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from datasets import make_damper_logs
from datasets.make_discovery_logs import LAG, LEVELS
from datasets.rig.damper import Damper

SHIPPED = Path(make_damper_logs.__file__).parent / "damper"
LOGS = sorted(SHIPPED.glob("*.csv"))


def test_regeneration_gives_the_committed_bytes(tmp_path: Path) -> None:
    make_damper_logs.make(tmp_path)
    made = {p.name: p.read_bytes() for p in (tmp_path / "damper").iterdir()}
    assert made == {p.name: p.read_bytes() for p in LOGS}
    assert len(made) == 3 and sum(map(len, made.values())) < 300_000


@pytest.mark.parametrize("path", LOGS, ids=lambda p: p.stem)
def test_the_force_is_the_law_of_a_late_current(path: Path) -> None:
    log = pd.read_csv(path, skiprows=[1])
    dt = 0.004
    assert np.allclose(np.diff(log["Time"]), dt)
    levels = log["Current"].to_numpy()
    assert all(np.mean(np.abs(levels - level) < 0.02) > 0.05 for level in LEVELS)
    x, force = log["Displacement"].to_numpy() / 1e3, 1e3 * log["Load"].to_numpy()
    v = np.convolve(x, [1.0, 0.0, -1.0], mode="same") / (2.0 * dt)
    share = 1.0 - np.exp(-dt / LAG)
    late = lfilter([share], [1.0, share - 1.0], levels - levels[0]) + levels[0]

    def error(current: np.ndarray) -> float:
        damping, spring = Damper().force(x, v, current)
        return float(np.std((force - damping - spring)[50:-50]))

    assert error(late) < 0.6 * error(levels) and error(late) < 25.0
