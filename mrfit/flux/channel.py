"""One channel and its running sum, asked at few places: in memory, or read piece by piece where it stays on disk."""

from collections.abc import Callable, Iterator
from typing import Protocol, cast

import numpy as np

from mrfit.core.specs import Array
from mrfit.io.columns import COLUMN_CHUNK, is_on_disk

Read = Callable[[int, int], Array]
Taken = Callable[[Array], Array | float]


class SampleSource(Protocol):
    """Operations that the removal of drift needs of an integral and of a current."""

    samples: int

    def pieces(self, start: int, stop: int) -> Iterator[tuple[int, Array]]:
        """Yield pieces of samples [start, stop), each after its first place."""

    def between(self, positions: Array) -> Array:
        """Return values at rising fractional positions, linearly; the last may lie a sample past the end."""

    def means(self, boundaries: Array) -> Array:
        """Return means between rising fractional positions, by the trapezoid rule."""

    def mean(self) -> float:
        """Return the mean over all samples."""

    def less(self, taken: Taken) -> "SampleSource":
        """Return the channel less what a function gives at sample places."""

    @property
    def array(self) -> Array:
        """The samples, in memory or as an array that is asked for slices only."""


def channel_of(values: Array) -> SampleSource:
    """Return a channel (N,), wherever its samples are."""
    if is_on_disk(values):
        return OnDisk(len(values), lambda begin, end: values[begin:end])
    return InMemory(values)


def swing(channel: SampleSource, start: int, stop: int, slope: float = 0.0) -> float:
    """Return the peak-to-peak value of samples [start, stop) beside a line with a slope in units per sample."""
    lows, highs = [], []
    for place, values in channel.pieces(start, stop):
        left = values - slope * np.arange(place, place + len(values)) if slope else values
        lows.append(float(np.min(left)))
        highs.append(float(np.max(left)))
    return max(highs) - min(lows)


class InMemory:
    """A channel (N,) in memory."""

    def __init__(self, values: Array) -> None:
        self.values, self.samples = values, len(values)

    def pieces(self, start: int, stop: int) -> Iterator[tuple[int, Array]]:
        """See ``SampleSource``."""
        yield start, self.values[start:stop]

    def between(self, positions: Array) -> Array:
        """See ``SampleSource``."""
        values = self.values
        whole = np.minimum(positions.astype(np.int64), len(values) - 2)
        at: Array = values[whole] + (positions - whole) * (values[whole + 1] - values[whole])
        return at

    def means(self, boundaries: Array) -> Array:
        """See ``SampleSource``."""
        values = self.values
        running = np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2)])
        whole = np.minimum(boundaries.astype(np.int64), len(values) - 2)
        share = boundaries - whole
        at = running[whole] + share * values[whole] + share**2 / 2 * (values[whole + 1] - values[whole])
        means: Array = np.diff(at) / np.diff(boundaries)
        return means

    def mean(self) -> float:
        """See ``SampleSource``."""
        return float(np.mean(self.values))

    def less(self, taken: Taken) -> "InMemory":
        """See ``SampleSource``."""
        return InMemory(self.values - taken(np.arange(self.samples, dtype=np.float64)))

    @property
    def array(self) -> Array:
        """See ``SampleSource``."""
        return self.values


class OnDisk:
    """A channel of so many samples that a function reads, or computes, from one place to another."""

    def __init__(self, samples: int, read: Read) -> None:
        self.samples, self.read = samples, read

    def __len__(self) -> int:
        return self.samples

    def __getitem__(self, rows: slice) -> Array:
        begin, end, _ = rows.indices(self.samples)
        return self.read(begin, end)

    @property
    def array(self) -> Array:
        """See ``SampleSource``."""
        return cast(Array, self)

    def mean(self) -> float:
        """See ``SampleSource``."""
        return sum(float(np.sum(values)) for _, values in self.pieces(0, self.samples)) / self.samples

    def less(self, taken: Taken) -> "OnDisk":
        """See ``SampleSource``."""
        return OnDisk(
            self.samples, lambda begin, end: self.read(begin, end) - taken(np.arange(begin, end, dtype=np.float64))
        )

    def pieces(self, start: int, stop: int) -> Iterator[tuple[int, Array]]:
        """See ``SampleSource``; pieces end where chunks of the file do."""
        begin = start
        while begin < stop:
            end = min((begin // COLUMN_CHUNK + 1) * COLUMN_CHUNK, stop)
            yield begin, self.read(begin, end)
            begin = end

    def between(self, positions: Array) -> Array:
        """See ``SampleSource``."""
        found = [one[0] for one in self._about(positions)]
        return np.concatenate(found) if found else np.empty(0)

    def means(self, boundaries: Array) -> Array:
        """See ``SampleSource``."""
        at = np.concatenate([one[1] for one in self._about(boundaries)])
        return np.diff(at) / np.diff(boundaries)

    def _about(self, positions: Array) -> Iterator[tuple[Array, Array]]:
        """Yield, chunk by chunk, values at positions and integrals from the first one's sample to them."""
        if not len(positions):
            return
        places = np.minimum(positions.astype(np.int64), self.samples - 2)
        total = 0.0
        for begin, values in self.pieces(int(places[0]), int(places[-1]) + 1):
            # one sample more, to which the last trapezoid of a piece leads
            values = np.append(values, self.read(begin + len(values), begin + len(values) + 1))
            running = np.cumsum(np.concatenate([[total], (values[1:] + values[:-1]) / 2]))
            here = slice(*np.searchsorted(places, (begin, begin + len(values) - 1)))
            share, at = positions[here] - places[here], places[here] - begin
            steps = values[at + 1] - values[at]
            yield values[at] + share * steps, running[at] + share * values[at] + share**2 / 2 * steps
            total = float(running[-1])
