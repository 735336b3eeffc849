"""Planted recordings and workspaces for the tests of the stages."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.flux.channel import InMemory
from mrfit.flux.integral import IntegralDrift, drift_removed
from mrfit.io.schemas.stages import About
from mrfit.io.workspace import Workspace, write_json
from mrfit.signal.cycles import SteadyCycles


def recording(
    identifier: str, dt: float, channels: dict[str, np.ndarray], condition: dict[str, float] | None = None
) -> Recording:
    units = {name: unit_of(name) for name in channels}
    condition = condition or {}
    return Recording(identifier, f"{identifier}.csv", identifier, "csv", dt, 0.0, channels, units, condition=condition)


def remove_drift(
    values: Array, current: Array, dt: float, stretches: Sequence[SteadyCycles], method: str
) -> tuple[Array, IntegralDrift]:
    """Return flux linkage (N,) in memory without drift, and what was taken away."""
    flux, drift = drift_removed(InMemory(values), InMemory(current), dt, stretches, method)
    assert isinstance(flux, InMemory)
    return flux.array, drift


def workspace(root: Path, recordings: Sequence[Recording]) -> Workspace:
    made = Workspace(root)
    for each in recordings:
        made.write_recording(each)
    write_json(made.ingest_json, {"recordings": [About.of(r) for r in recordings], "refused": []})
    return made


def coil(
    frequency: float,
    amplitude: float,
    resistance: float = 2.0,
    loss: float = 0.03,
    eddy: float = 0.0,
    per_cycle: int = 500,
    cycles: float = 8.0,
) -> dict[str, np.ndarray]:
    """A coil with an elliptic loop: λ = L·i − loss·amplitude·cos ωt − (eddy·f)·amplitude·cos ωt, i = amplitude·sin ωt.

    Area of the loop per cycle: π·amplitude²·(loss + eddy·f).
    """
    turn = 2 * np.pi * np.arange(int(per_cycle * cycles)) / per_cycle
    omega = 2 * np.pi * frequency
    current = amplitude * np.sin(turn)
    lag = amplitude * (loss + eddy * frequency)
    flux = 0.1 * current - lag * np.cos(turn)
    induced = omega * (0.1 * amplitude * np.cos(turn) + lag * np.sin(turn))
    return {"voltage": resistance * current + induced, "current": current, "truth": flux}


def files_under(root: Path) -> dict[str, bytes]:
    return {str(p.relative_to(root)): p.read_bytes() for p in sorted(root.rglob("*")) if p.is_file()}
