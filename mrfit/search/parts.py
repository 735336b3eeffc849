"""Segments in parts: what is fitted and what is held out of one, and pieces of a long one, each handled by itself."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar, overload

import numpy as np

from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array, Mask
from mrfit.io.columns import is_on_disk, laid_beside, part_of
from mrfit.search.problem import SegmentBlock, beside_jumps, entering_at_mean, folded_block, full_block, period_of
from mrfit.signal.clipping import clipped
from mrfit.signal.long_segments import pieces
from mrfit.signal.smoothing import Drive, from_the_beginning, smooth
from mrfit.simulate.assembly import Assembly

# One in so many cycles, or samples where there are none, is held out of a condition by itself
ONE_HELD_OUT_IN = 3

T = TypeVar("T")


def split_cycles(segment: Segment, dt: float) -> list[Segment]:
    """Return a segment as its training part and its held-out last third, by whole cycles where it is periodic.

    A segment with fewer than three cycles is training altogether.
    """
    if segment.cycles:
        held = segment.cycles // ONE_HELD_OUT_IN
        cut = segment.stop - int(round(held / (segment.frequency * dt)))
    else:
        held = segment.samples // ONE_HELD_OUT_IN
        cut = segment.stop - held
    if held < 1:
        return [replace(segment, role="train")]
    before = replace(segment, role="train", stop=cut, cycles=max(segment.cycles - held, 0))
    lead = cut - segment.start + segment.warm_up
    after = replace(segment, role="holdout", start=cut, warm_up=lead, cycles=held if segment.cycles else 0)
    return [before, after]


@dataclass(frozen=True)
class SegmentPart:
    """A part of a segment: what a full block is made of.

    Attributes
    ----------
    segment
        The part.
    drive
        Its smoothed inputs.
    output
        Measured output over it, (N,); it may stay on disk.
    before
        Samples of the segment that are in other parts before this one.
    kept
        Whether its block is kept once it is made: those of a long segment would not all fit into memory.
    values
        The inputs one by one, where they stay on disk and the drive is without values.
    lost
        Samples at which the output was clipped, which are not compared (N,); None for none.
    jumps
        Inputs at whose change of sign the model jumps, by their rows.
    """

    segment: Segment
    drive: Drive
    output: Array
    before: int = 0
    kept: bool = True
    values: tuple[Array, ...] = ()
    lost: Mask | None = None
    jumps: tuple[int, ...] = ()

    @property
    def dt(self) -> float:
        """Sample interval in s."""
        return self.drive.dt

    @property
    def folds(self) -> bool:
        """Whether its cycles can be folded."""
        return self.drive.fits is not None and self.lost is None

    @property
    def period(self) -> float:
        """Samples per cycle, 0 where the drive is not periodic."""
        return period_of(self.segment, self.dt)

    @property
    def block(self) -> SegmentBlock:
        """The full block."""
        return self._block if self.kept else self._made()

    @property
    def compared(self) -> SegmentBlock:
        """The full block, but for samples beside jumps of the model."""
        return beside_jumps(self.block, self.jumps)

    def folded(self, ahead: int) -> SegmentBlock:
        """Return the block that is searched, see ``folded_block``; the full one where samples are lost."""
        if self.lost is not None:
            return self.compared
        return folded_block(self.segment, self._driven(), np.asarray(self.output), ahead, self.jumps)

    def inputs(self, row: int) -> Array:
        """Return one input over the part, (N,)."""
        if self.kept or self.drive.fits is None:
            return self.block.inputs(row)
        return self.drive.fits[row].sampled(self.drive.warm_up * self.dt, self.dt, len(self.output))

    @cached_property
    def _block(self) -> SegmentBlock:
        return self._made()

    def _made(self) -> SegmentBlock:
        block = full_block(self.segment, self._driven(), np.asarray(self.output))
        return block if self.lost is None else replace(block, counts=np.where(self.lost, 0.0, block.counts))

    def _driven(self) -> Drive:
        """Return the drive with its values, which are read where they stay on disk."""
        return replace(self.drive, values=np.stack([np.asarray(v) for v in self.values])) if self.values else self.drive


class LazySequence(Sequence[T]):
    """A sequence whose members are made whenever they are looked at, as all of them would take too much memory."""

    def __init__(self, count: int, make: Callable[[int], T]) -> None:
        self._places, self._make = range(count), make

    def __len__(self) -> int:
        return len(self._places)

    @overload
    def __getitem__(self, place: int) -> T: ...

    @overload
    def __getitem__(self, place: slice) -> list[T]: ...

    def __getitem__(self, place: int | slice) -> T | list[T]:
        if isinstance(place, slice):
            return [self._make(k) for k in self._places[place]]
        return self._make(self._places[place])


class Blocks(Sequence[SegmentBlock]):
    """Full blocks of parts, made when they are looked at."""

    def __init__(self, parts: Iterable[SegmentPart]) -> None:
        self.parts = list(parts)

    @property
    def segments(self) -> list[Segment]:
        """The parts, without making their blocks."""
        return [p.segment for p in self.parts]

    def of_role(self, role: str) -> "Blocks":
        """Return the blocks of one role."""
        return Blocks(p for p in self.parts if p.segment.role == role)

    def __len__(self) -> int:
        return len(self.parts)

    @overload
    def __getitem__(self, place: int) -> SegmentBlock: ...

    @overload
    def __getitem__(self, place: slice) -> "Blocks": ...

    def __getitem__(self, place: int | slice) -> "SegmentBlock | Blocks":
        return Blocks(self.parts[place]) if isinstance(place, slice) else self.parts[place].block


def parts_of(segment: Segment, recording: Recording, assembly: Assembly, output: Array) -> list[SegmentPart]:
    """Return a segment as parts, one but for long segments.

    Parameters
    ----------
    segment
        The segment.
    recording
        Its recording.
    assembly
        The model that they drive.
    output
        Measured output over the recording.
    """
    found = pieces(segment, recording.dt)
    parts = [_part(s, recording, assembly, output, (s.start - segment.start, len(found) == 1)) for s in found]
    lost = clipped(recording, segment, assembly.spec.output)
    own = [lost[p.before : p.before + p.segment.samples] for p in parts]
    return [replace(p, lost=m) if m.any() and not m.all() else p for p, m in zip(parts, own, strict=True)]


def _part(
    segment: Segment, recording: Recording, assembly: Assembly, output: Array, place: tuple[int, bool]
) -> SegmentPart:
    """Return one part, the samples before it and whether it is the only one given."""
    before, alone = place
    names = assembly.spec.inputs
    drive = smooth(recording, segment, names)
    if assembly.counts:
        drive = from_the_beginning(drive, recording, segment, names)
    if assembly.spec.rests_at in names:
        drive = entering_at_mean(drive, names.index(assembly.spec.rests_at))
    part = SegmentPart(
        segment,
        drive,
        part_of(output, segment.start, segment.stop),
        before,
        alone,
        jumps=tuple(names.index(name) for name in assembly.spec.jumps if name in names),
    )
    if alone:
        return part
    if part.drive.fits is None:
        if not is_on_disk(output):
            return part
        part = replace(part, values=tuple(laid_beside(output, row) for row in part.drive.values))
    # the series alone tells what a full block is driven with
    return replace(part, drive=part.drive.without_values())
