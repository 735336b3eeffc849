"""Segments in memory with the recordings they are views of: what fit, predict, discover and compare work on."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from mrfit.core.recording import Recording, Segment
from mrfit.io.keys import content_of
from mrfit.io.schemas.reading import plain


@dataclass(frozen=True)
class Dataset:
    """Segments and recordings.

    Attributes
    ----------
    segments
        The segments.
    recordings
        Recordings by id, those of all segments, with flux linkage where it was reconstructed.
    """

    segments: Sequence[Segment]
    recordings: Mapping[str, Recording]

    def made_from(self) -> tuple[dict[str, str], list[Segment]]:
        """Return the hashes that results depend on, as ``Workspace.made_from`` does of the same data on disk."""
        used = sorted({s.recording for s in self.segments})
        return {i: content(self.recordings[i]) for i in used}, [_plain(s) for s in self.segments]


def _plain(segment: Segment) -> Segment:
    """Return a segment without elements of arrays, which a hash would tell from plain numbers."""
    return replace(segment, **{k: v.item() for k, v in asdict(segment).items() if isinstance(v, np.generic)})


def content(recording: Recording) -> str:
    """Return the hash of a recording's content, computed of its samples (see ``content_of``)."""
    # as a workspace keeps it: a condition that is not finite is none
    condition = {name: value for name, value in plain(recording.condition).items() if value is not None}
    digests = {name: hashlib.sha256(_bytes(values)).hexdigest() for name, values in recording.channels.items()}
    return content_of(replace(recording, condition=condition), digests)


def _bytes(values: Any) -> memoryview:
    return np.ascontiguousarray(values, dtype=np.float64).data
