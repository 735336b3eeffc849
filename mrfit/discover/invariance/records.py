"""Records as an examination takes them: smoothed inputs and the output, at no more samples than the motion needs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.channels import CONTROL, MOTION, WARMTH
from mrfit.core.specs import Array
from mrfit.discover.policy import STANDARD
from mrfit.search.problem import SegmentBlock
from mrfit.signal.noise import noise_level


@dataclass(frozen=True)
class Record:
    """One segment.

    Attributes
    ----------
    condition
        Name of its test condition.
    dt
        Sample interval in s.
    channels
        Smoothed inputs by name, ``time`` since the recording's start among them, each (L + N,).
    lead
        Samples L before the first that has an output, in which memories settle.
    output
        Measured output (N,), in SI.
    made
        Name of the output.
    fastest
        Frequency below which nearly all of the speed's power lies, in Hz.
    noise
        RMS of the output's white noise.
    compared
        Share of each sample's output that counts (N,): 0 where it was clipped; None for all.
    """

    condition: str
    dt: float
    channels: Mapping[str, Array]
    lead: int
    output: Array
    made: str
    fastest: float
    noise: float
    compared: Array | None = None

    @property
    def motion(self) -> tuple[str, str, str]:
        """Names of the channels of place, speed and acceleration."""
        return MOTION[self.made]

    @property
    def place(self) -> Array:
        """Place of the motion (L + N,)."""
        return self.channels[self.motion[0]]

    @property
    def speed(self) -> Array:
        """Its rate (L + N,)."""
        return self.channels[self.motion[1]]

    @property
    def control(self) -> Array:
        """Current (L + N,); 0 where none is known."""
        return self.channels.get(CONTROL, np.zeros(len(self.speed)))

    @property
    def moves(self) -> bool:
        """Whether the current moves during the record."""
        return inputs_move(self.control)

    @property
    def warmth(self) -> Array | None:
        """Temperature (L + N,), None where it is not known."""
        return self.channels.get(WARMTH)

    def measured(self, values: Array) -> Array:
        """Return values (…, L + N) without the lead-in, (…, N)."""
        return values[..., self.lead :]


def from_block(block: SegmentBlock, names: Sequence[str], output: str) -> Record:
    """Return the record of a segment's full block, whose drive has a row for each name, ``time`` among them.

    Raises
    ------
    KeyError
        If the motion that makes the output is not among the names.
    """
    lead = int(block.nodes[0, 0])
    drive = block.drive[:, : lead + len(block.target)]
    channels = dict(zip(names, drive, strict=True))
    record = thinned(block.segment.condition, block.dt, channels, block.target, output)
    if block.counts.all():
        return record
    every, count = int(round(record.dt / block.dt)), len(record.output)
    counts = (block.counts > 0.0).astype(np.float64)
    return replace(record, compared=_means(counts[: every * count], every))


def thinned(condition: str, dt: float, channels: Mapping[str, Array], output: Array, made: str) -> Record:
    """Return a record as means over as many samples as the motion allows; channels may begin before the output."""
    motion = MOTION[made]
    lead = len(next(iter(channels.values()))) - len(output)
    fastest = _fastest(channels[motion[1]][lead:], dt)
    every = max(int(round(1.0 / dt / max(STANDARD.rate_max, STANDARD.samples_of_fastest * fastest))), 1)
    skip, count = lead % every, len(output) // every
    stop = lead + count * every
    inputs = {n: _means(v[skip:stop], every) for n, v in channels.items()}
    if not inputs_move(inputs.get(CONTROL)):
        inputs[CONTROL] = np.full(len(inputs[motion[1]]), float(np.mean(inputs.get(CONTROL, np.zeros(1)))))
    noise = noise_level(output) / np.sqrt(every)
    return Record(
        condition, dt * every, inputs, lead // every, _means(output[: count * every], every), made, fastest, noise
    )


def with_steady_currents(records: Sequence[Record]) -> list[Record]:
    """Return records with a current at its mean where it moves by little of the largest of all.

    At zero current noise is all that moves, and by itself it is no small share of what is logged.
    """
    largest = max((float(np.max(np.abs(r.control))) for r in records), default=0.0)
    found = []
    for record in records:
        own = record.control
        steady = bool(np.std(own) <= STANDARD.moving_control * largest)
        channels = {**record.channels, CONTROL: np.full(len(own), float(np.mean(own)))}
        found.append(replace(record, channels=channels) if steady else record)
    return found


def inputs_move(values: Array | None) -> bool:
    """Return whether a current moves by more than its noise."""
    return values is not None and bool(
        np.std(values) > STANDARD.moving_control * max(float(np.max(np.abs(values))), 1e-9)
    )


def _means(values: Array, every: int) -> Array:
    return np.ascontiguousarray(values.reshape(-1, every).mean(axis=1))


def _fastest(speed: Array, dt: float) -> float:
    """Return the frequency in Hz below which nearly all of a speed's power lies."""
    power = np.abs(np.fft.rfft(speed)) ** 2
    place = int(np.searchsorted(np.cumsum(power), STANDARD.speed_power * power.sum()))
    return max(min(place, len(power) - 1), 1) / (len(speed) * dt)
