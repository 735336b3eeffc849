"""Whether repeats of one condition agree: what one set of parameters cannot follow, whatever the model.

Each repeat's measured output y is laid on the simulated one, y ≈ g·ŷ + o by least squares. The model is driven by each
repeat's own input, so that neither phase nor small differences of the drive count, and what it gets wrong it gets wrong
alike in all of them. Two repeats differ by the RMS of (g₁ − g₂)·ŷ + (o₁ − o₂).
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from mrfit.core.specs import Array
from mrfit.io.schemas.fit import Repeats
from mrfit.search.parts import SegmentPart

# Repeats disagree where they differ by more than so many times what differs from cycle to cycle within them, and by
# more than this share of the output's standard deviation, as by a tenth of its gain
REPEAT_NOISES, REPEAT_SHARE = 5.0, 0.1


def repeat_rows(parts: Sequence[SegmentPart], floors: Sequence[float], simulated: Sequence[Array]) -> list[Repeats]:
    """Return one row per periodic condition with several training segments: how much these differ, and if they agree.

    Parameters
    ----------
    parts
        Parts of segments.
    floors
        Noise floor of each, in the output's unit.
    simulated
        Simulated output of each, (N,).
    """
    chosen = [k for k, p in enumerate(parts) if p.segment.role == "train" and p.segment.cycles]
    rows = []
    for condition in dict.fromkeys(parts[k].segment.condition for k in chosen):
        members = [k for k in chosen if parts[k].segment.condition == condition]
        if len(members) < 2:
            continue
        lines = [_line(np.asarray(parts[k].output), simulated[k]) for k in members]
        samples = sum(len(simulated[k]) for k in members)
        mean = sum(float(np.sum(simulated[k])) for k in members) / samples
        power = sum(float(np.sum((simulated[k] - mean) ** 2)) for k in members) / samples
        # the mean square of (g₁ − g₂)·ŷ + (o₁ − o₂)
        difference = max(
            float(np.hypot((a[0] - b[0]) * np.sqrt(power), (a[0] - b[0]) * mean + a[1] - b[1]))
            for a, b in combinations(lines, 2)
        )
        moved = max(float(np.std(parts[k].output)) for k in members)
        floor = max(floors[k] for k in members)
        agree = not (difference > REPEAT_NOISES * floor and difference > REPEAT_SHARE * moved)
        row = Repeats(
            condition=condition,
            segments=len(members),
            difference=difference,
            noise_floor=floor,
            moved=moved,
            agree=agree,
        )
        rows.append(row)
    return rows


def _line(measured: Array, simulated: Array) -> tuple[float, float]:
    """Return the gain and the offset that take the simulated output nearest the measured one."""
    moved = simulated - simulated.mean()
    power = float(moved @ moved)
    gain = float(moved @ measured) / power if power > 0.0 else 0.0
    return gain, float(measured.mean() - gain * simulated.mean())
