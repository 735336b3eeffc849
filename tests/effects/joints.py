"""Strokes of a joint at constant speed, and a fit of a planted joint beside a loop."""

import numpy as np
import pandas as pd

import mrfit
from mrfit.simulate.assembly import assemble

DT, SPEED = 1e-3, 0.05


def triangle(amplitude: float = 0.01) -> dict[str, np.ndarray]:
    quarter = round(amplitude / SPEED / DT)
    side = np.where((np.arange(20 * quarter) + quarter) // (2 * quarter) % 2 == 0, 1.0, -1.0)
    return {"displacement": np.cumsum(side) * SPEED * DT, "velocity": side * SPEED}


def planted_fit(effect: str, values: tuple[float, ...]) -> pd.DataFrame:
    """The parameters of a fit to strokes of two amplitudes, with noise, under a joint of these values."""
    rng, whole = np.random.default_rng(5), assemble(f"dahl+{effect}")
    theta, logs = whole.spec.start[None].copy(), []
    theta[0, -len(values) :] = values
    for amplitude in (3e-3, 0.01):
        channels = triangle(amplitude)
        drive = np.stack([channels[n] for n in whole.spec.inputs])
        force = whole.simulate(drive, theta, DT)[0]
        force = force + rng.normal(0.0, 2e-3 * np.ptp(force), len(force))
        logs.append(mrfit.Recording.from_arrays(dt=DT, force=force, name=f"{amplitude:g} m", **channels))
    return mrfit.fit(logs, f"dahl+{effect}", per="all", holdout="none", progress=False).params
