"""Records of one condition with the same drive: what differs between their outputs is noise."""

from collections.abc import Mapping, Sequence

import numpy as np

from mrfit.core.channels import FAST_INPUTS
from mrfit.core.grouping import grouped
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.signal.noise import noise_level
from mrfit.signal.noise_floor import NoiseFloor, measured_samples

# Inputs are the same where they differ by no more than so many times their noise, or this share of their range
RECORD_AGREEMENT, RECORD_RESOLUTION = 1.5, 1e-5
# Least share of the shorter record that two have in common
OVERLAP = 0.5
# Most repeats that one is compared with: of a thousand, every pair would take longer than all else of a fit
COMPARED_RECORDS = 16


def repeats_floor(
    segments: Sequence[Segment], recordings: Mapping[str, Recording], outputs: Sequence[Array]
) -> list[NoiseFloor | None]:
    """Return the noise floor of each segment whose condition was recorded again with the same drive, else None.

    Two records are aligned on the drive. Only where all recorded inputs then agree within their noise is the RMS
    difference of the outputs, its mean and its trend taken away, √2 times the noise.

    Parameters
    ----------
    segments
        Segments.
    recordings
        Recordings by id.
    outputs
        Output over each segment, (N,).
    """
    found: list[NoiseFloor | None] = []
    members = grouped((segment.condition, k) for k, segment in enumerate(segments))
    for k, segment in enumerate(segments):
        others = _spread([j for j in members[segment.condition] if j != k], k)
        powers = [_difference(segment, segments[j], recordings, (outputs[k], outputs[j])) for j in others]
        known = [p for p in powers if p is not None]
        found.append(_floor(np.array(known)) if known else None)
    return found


def _spread(others: list[int], k: int) -> list[int]:
    """Return the repeats that one is compared with: all of few, of many as many before and after it, in a ring."""
    if len(others) <= COMPARED_RECORDS:
        return others
    first = sum(j < k for j in others)
    ring = others[first:] + others[:first]
    return sorted(ring[: COMPARED_RECORDS // 2] + ring[-COMPARED_RECORDS // 2 :])


def _floor(powers: Array) -> NoiseFloor:
    value = float(np.sqrt(np.mean(powers[:, 0])))
    width = value * float(np.sqrt(0.5 / np.sum(powers[:, 1])))
    return NoiseFloor(value, "repeats", max(value - 2.0 * width, 0.0), value + 2.0 * width)


def _difference(
    one: Segment, other: Segment, recordings: Mapping[str, Recording], outputs: tuple[Array, Array]
) -> tuple[float, float] | None:
    """Return half the power of the outputs' difference and the samples it rests on, None without the same drive."""
    first, second = recordings[one.recording], recordings[other.recording]
    names = [n for n in FAST_INPUTS if n in first.channels and n in second.channels]
    if one.drive not in names or abs(first.dt / second.dt - 1.0) > RECORD_RESOLUTION:
        return None
    a, b = (r.channels[one.drive][s.start : s.stop] for r, s in ((first, one), (second, other)))
    shift = _shift(a, b)
    begin, end = max(0, shift), min(len(a), len(b) + shift)
    if end - begin < OVERLAP * min(len(a), len(b)):
        return None
    here, there = slice(begin, end), slice(begin - shift, end - shift)
    for name in names:
        pair = [r.channels[name][s.start : s.stop] for r, s in ((first, one), (second, other))]
        if not _same(pair[0][here], pair[1][there]):
            return None
    measured = measured_samples(outputs[0])[here] & measured_samples(outputs[1])[there]
    difference = (outputs[0][here] - outputs[1][there])[measured]
    if len(difference) < 3 or not np.any(difference):
        return None
    time = np.linspace(-1.0, 1.0, end - begin)[measured]
    left = difference - np.polyval(np.polyfit(time, difference, 1), time)
    return 0.5 * float(np.mean(left**2)), float(len(left))


def _shift(a: Array, b: Array) -> int:
    """Return by how many samples b has to be moved to lie on a."""
    from scipy.signal import correlate

    product = correlate(a - a.mean(), b - b.mean(), method="fft")
    return int(np.argmax(product)) - (len(b) - 1)


def _same(a: Array, b: Array) -> bool:
    noise = float(np.hypot(noise_level(a), noise_level(b)))
    return float(np.sqrt(np.mean((a - b) ** 2))) <= max(RECORD_AGREEMENT * noise, RECORD_RESOLUTION * float(np.ptp(a)))
