"""Logs for the benchmark of scale: a coil of known parameters under a sine of current, each with noise of its own."""

from pathlib import Path

import numpy as np

from mrfit.models import boucwen_flux

# A, Lc, kappa, beta, gamma, n, D of the flux model
PLANTED = {"A": 1.2, "Lc": 0.018, "kappa": 1.4, "beta": 0.8, "gamma": 1.2, "n": 1.6, "D": 0.3}
OHM = 2.0
FREQUENCIES, AMPLITUDES = (1.0, 2.0, 5.0), (1.0, 2.0, 3.0, 4.0)
PER_CYCLE = 2000
VOLT, AMPERE = 2e-3, 2e-4
MAP = f'resistance = {OHM}\n\n[channels]\nvoltage = {{column = "u"}}\ncurrent = {{column = "i"}}\n'


def coil(samples: int, frequency: float, amplitude: float, seed: int) -> np.ndarray:
    """Return time, voltage and current as columns (N, 3): u = R·i + dλ/dt with white noise in both."""
    rng = np.random.default_rng(seed)
    theta = np.array([[*PLANTED.values()]])
    theta[0, 1] *= 1.0 + 0.01 * rng.standard_normal()
    dt = 1.0 / (frequency * PER_CYCLE)
    time = np.arange(samples) * dt
    current = amplitude * np.sin(2.0 * np.pi * frequency * time)
    flux = boucwen_flux.response(current[None, :], theta, dt)[0]
    voltage = OHM * current + np.gradient(flux, dt)
    noise = rng.standard_normal((2, samples))
    return np.column_stack([time, voltage + VOLT * noise[0], current + AMPERE * noise[1]])


def write_logs(folder: Path, count: int, samples: int) -> None:
    """Write so many logs of so many samples as CSV, conditions by turns, and their channel map."""
    import pyarrow as pa
    import pyarrow.csv

    folder.mkdir(parents=True)
    (folder / "mrfit.toml").write_text(MAP)
    for number in range(count):
        frequency = FREQUENCIES[number % len(FREQUENCIES)]
        amplitude = AMPLITUDES[number // len(FREQUENCIES) % len(AMPLITUDES)]
        columns = np.round(coil(samples, frequency, amplitude, number), 7).T
        table = pa.Table.from_arrays([pa.array(c) for c in columns], names=["t (s)", "u (V)", "i (A)"])
        pyarrow.csv.write_csv(table, folder / f"coil_{number:05d}.csv")
