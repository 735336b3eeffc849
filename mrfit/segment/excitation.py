"""Segments of a record in which a force or a base acceleration drives a mass: the whole of it, in whole cycles or not.

Where the excitation repeats sample by sample and the motion does from the first cycle on, or where the channel map
states a frequency of which the record holds whole cycles, the mass is in its periodic steady state. Any other record
begins at rest.
"""

import numpy as np

from mrfit.core.channels import EXCITATIONS
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.signal.noise import noise_level

# Share of its own rms by which an excitation that repeats may differ from cycle to cycle
REPEATS_WITHIN = 1e-3
# Difference of the first two cycles of a steady motion, over that of the last two
STEADY_WITHIN = 1.2


def cycles_of(recording: Recording, drive: str) -> int:
    """Return the whole cycles of a record in its periodic steady state, 0 of one that begins at rest."""
    values = np.asarray(recording.channels[drive])
    stated = recording.condition.get("frequency", 0.0) * recording.dt * len(values)
    if stated > 0.5 and abs(stated - round(stated)) < 1e-3:
        return round(stated)
    cycles = _repetitions(values)
    motions = [np.asarray(v) for n, v in recording.channels.items() if n not in EXCITATIONS.values()]
    return cycles if cycles and all(_is_steady(v, cycles) for v in motions) else 0


def waveform_of(values: Array) -> str:
    """Return ``transient`` for an excitation that ends, ``random`` for any other."""
    tail = values[-max(len(values) // 10, 1) :]
    return "transient" if np.std(tail) < 0.05 * np.std(values) else "random"


def _repetitions(values: Array) -> int:
    """Return the greatest number of equal parts that are the same within noise, 0 where there are fewer than two."""
    samples, limit = len(values), max(REPEATS_WITHIN * float(np.std(values)), 2.0 * noise_level(values))
    if not limit > 0.0:
        return 0
    parts = [n for n in range(samples // 8, 1, -1) if samples % n == 0]
    return next((n for n in parts if _difference(values, samples // n) <= limit), 0)


def _difference(values: Array, period: int) -> float:
    return float(np.sqrt(np.mean((values[period:] - values[:-period]) ** 2)))


def _is_steady(values: Array, cycles: int) -> bool:
    """Return whether the first cycle of a motion differs from the next by no more than the last from that before."""
    rows = values.reshape(cycles, -1)
    first, last = (float(np.std(rows[k] - rows[k + 1])) for k in (0, cycles - 2))
    # of two cycles nothing but the noise says by how much steady ones may differ
    usual = STEADY_WITHIN * last if cycles > 2 else 2.0 * noise_level(values)
    return first <= max(usual, REPEATS_WITHIN * float(np.std(values)))
