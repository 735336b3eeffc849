"""What the training tests do not determine of a base is no missing effect; what no fit to all tests makes stays one."""

from dataclasses import replace
from pathlib import Path

import numpy as np

import mrfit.segment.stage
from mrfit.discover.stage import Settings, run
from mrfit.io.schemas.discovery import DiscoveryFile
from tests.discover.studies import workspace

# where the speed is far below that of the yield, friction and viscous damping are one
SLOW = ((0.1, 0.003), (0.05, 0.004), (0.1, 0.005), (0.2, 0.002))
FAST = (1.0, 0.015)


def discovered(folder: Path, ripple: float = 0.0) -> DiscoveryFile:
    """Discover with the only fast test held out, which may have a ripple (N) beyond the stroke of the others."""
    study = workspace(folder, tests=(*SLOW, FAST))
    fast = study.read_recording("1Hz-15mm")
    x = fast.channels["displacement"]
    force = fast.channels["force"] + ripple * np.sin(2e3 * x) * (np.abs(x) > 6e-3)
    study.write_recording(replace(fast, channels={"displacement": x, "force": force}))
    mrfit.segment.stage.run(study, mrfit.segment.stage.Settings(holdout="sine-1Hz*"))
    steps = []
    found = run(study, Settings("tanh"), lambda label, *_: steps.append(label)).found
    assert "base fit to all tests" in steps
    return found


def test_a_base_that_suits_all_tests_is_not_determined_by_some(tmp_path: Path) -> None:
    found = discovered(tmp_path)
    assert found.verdict == "insufficient-data" and not found.effects and not found.suspects
    (advice,) = found.advice
    assert "sine-1Hz-15mm (up to 0.094 m/s)" in advice


def test_a_force_that_a_fit_to_all_tests_leaves_stays_unexplained(tmp_path: Path) -> None:
    assert discovered(tmp_path, ripple=20.0).verdict == "unexplained"
