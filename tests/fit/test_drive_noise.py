"""Noise in the measured current does not bend the fitted hysteresis: the drive is smoothed before it drives the model.

Fed with raw samples, a rate-independent model takes every wiggle for a reversal; n and the hysteretic share then come
out wrong at a perfect-looking error.
"""

from pathlib import Path

import numpy as np
import pytest

import mrfit.fit.stage
import mrfit.segment.stage
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.io.schemas.stages import About
from mrfit.io.workspace import Workspace, write_json
from mrfit.models import boucwen_flux

# n = 1.6, hysteretic part about 9 % of the range at 5 A, turning over within 0.7 A
TRUTH = np.array([[1.2, 0.018, 1.4, 0.8, 1.2, 1.6, 0.3]])
PER_CYCLE, CYCLES, FREQUENCY = 2000, 6, 5.0


def logged(amplitude: float, noise: float, seed: int) -> Recording:
    """A log of exact flux and noisy current, the model's own warm-up at its start."""
    rng = np.random.default_rng(seed)
    time = np.arange(PER_CYCLE * CYCLES) / (PER_CYCLE * FREQUENCY)
    current: Array = amplitude * np.sin(2 * np.pi * FREQUENCY * time)
    flux = boucwen_flux.response(current[None, :], TRUTH, 1.0)[0]
    return Recording(
        id=f"log-{amplitude:g}",
        source=f"log-{amplitude:g}.csv",
        sha256=f"{seed:064d}",
        reader="none",
        dt=1 / (PER_CYCLE * FREQUENCY),
        start=0.0,
        channels={
            "current": current + noise * amplitude * rng.standard_normal(len(time)),
            "flux": flux + 1e-5 * rng.standard_normal(len(time)),
        },
        units={"current": "A", "flux": "Wb"},
    )


@pytest.mark.parametrize(("noise", "tolerance"), [(1e-4, 0.10), (1e-3, 0.10), (1e-2, 0.15)])
def test_current_noise_leaves_exponent_and_hysteretic_share_in_place(
    noise: float, tolerance: float, tmp_path: Path
) -> None:
    workspace = Workspace(tmp_path)
    records = [logged(amplitude, noise, seed) for seed, amplitude in enumerate((1.0, 3.0, 5.0))]
    for record in records:
        workspace.write_recording(record)
    write_json(workspace.ingest_json, {"recordings": [About.of(r) for r in records], "refused": []})
    mrfit.segment.stage.run(workspace, mrfit.segment.stage.Settings(holdout="none"))
    settings = mrfit.fit.stage.Settings(model="boucwen-flux", optimizer="auto", per="all")
    found = {d.name: d.value for d in mrfit.fit.stage.run(workspace, settings).results[0].derived}
    slope, amplitude, _, n, _ = boucwen_flux.derived(TRUTH)[0]
    assert found["sharpness"] == pytest.approx(n, rel=tolerance)
    assert found["amplitude"] / found["slope"] == pytest.approx(amplitude / slope, rel=tolerance)
