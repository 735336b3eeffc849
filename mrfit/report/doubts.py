"""Findings of ingest that change the physics of a fit, shown beside the verdict."""

from collections.abc import Sequence
from dataclasses import dataclass

from mrfit.core.grouping import grouped
from mrfit.core.recording import WRONG
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.stages import About
from mrfit.report.source import ReportSource

PHYSICAL = (
    *WRONG,
    "condition-differs",
    "unit-assumed",
    "ambiguous-channel",
    "skew",
    "rate-differs",
    "rate-unclear",
    "rate-assumed",
    "units-contradict",
    "dropped-samples",
    "clipped",
    "dead",
)
"""Kinds of findings that scale, turn, shift or cut what a model is fitted to, in the order in which they are told."""


@dataclass(frozen=True)
class Doubt:
    """A kind of finding in recordings that a fit was made from.

    Attributes
    ----------
    kind, text
        Its name, and its wording in the first recording.
    recording
        That recording.
    count, total
        How many of the fit's recordings it was found in, of how many.
    """

    kind: str
    text: str
    recording: str
    count: int
    total: int


def doubts(fit: Fit, source: ReportSource) -> list[Doubt]:
    """Return the findings on channels that a fit used, one row for each kind and channel."""
    used = _recordings(fit, source)
    channels = {"", fit.output, *fit.inputs}
    some = [(a, f) for a in used for f in a.findings if f.kind in PHYSICAL and f.channel in channels]
    found = grouped(((f.kind, f.channel), (a.id, f.text)) for a, f in some)
    rows = []
    for (kind, _), where in sorted(found.items(), key=lambda item: PHYSICAL.index(item[0][0])):
        count = len({name for name, _ in where})
        rows.append(Doubt(kind, where[0][1], where[0][0], count, len(used)))
    return rows


def _recordings(fit: Fit, source: ReportSource) -> Sequence[About]:
    """Return the recordings that a fit used; all there are where it does not say so."""
    everything = source.ingest.recordings if source.ingest else []
    ids = {use.id for result in fit.results for use in result.segments}
    names = {s.recording for s in source.segments if s.id in ids}
    return [about for about in everything if about.id in names] if names else everything
