"""The containers that cross stage boundaries: Recording (one log) and Segment (a view of it under one condition)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mrfit.core.specs import Array

# In a recording's condition: resistance in ohm by which its flux was reconstructed; absent where the flux was measured
FLUX_RESISTANCE = "flux_resistance"
# Integral of i^2 dt in A^2*s from a recording's first sample to where a drive begins, beyond what the drive's own mean
# of i^2 would have made in that time
HEAT_BEFORE = "heat_before"
# Inputs of models that are constants of a record, which nobody sets
RECORD_CONSTANTS = (FLUX_RESISTANCE, HEAT_BEFORE)
# What every test condition is named by
NAMING = ("frequency", "amplitude", "current")
# Share of a stretch without cycles by which a model only settles
LEAD_IN = 0.1


@dataclass(frozen=True, slots=True)
class Finding:
    """Something odd about a recording, worth a reader's eye.

    Attributes
    ----------
    kind
        Short machine-readable name, as in ``clipped`` or ``offset``.
    channel
        Channel concerned, empty if it is the whole recording.
    at
        Time concerned in s from the first sample, or None.
    text
        One sentence for a person.
    """

    kind: str
    channel: str
    at: float | None
    text: str


WRONG = ("velocity-differs", "sign", "outlier", "away-from-zero")
"""Kinds of findings that change what is fitted: a channel in a wrong unit, turned round, garbled or far from zero."""


@dataclass(frozen=True, slots=True)
class Recording:
    """One log on a uniform time base, in SI units.

    Attributes
    ----------
    id
        Unique within a workspace; made from the file's name.
    source, sha256, reader
        Path as the user gave it, hash of the file's bytes, registry name of the reader.
    dt, start
        Sample interval in s; first time the file gives, in s.
    channels
        Channel name -> float64 values, all of one length N.
    units
        Channel name -> unit.
    columns
        Channel name -> column of the file, counted from 0.
    condition
        What the file's name or header says of the test: ``frequency`` Hz, ``amplitude`` in the drive's SI unit,
        ``current`` A, ``temperature`` degC, ``resistance`` ohm … (SI).
    wording
        Quantity -> how the name of a test condition says it, ``5bar`` for ``pressure``, where a name gives its unit.
    rows_kept, rows_refused
        Data rows of the file; their sum is all there were.
    findings
        Oddities.
    history
        One line for every step that changed the data.
    """

    id: str
    source: str
    sha256: str
    reader: str
    dt: float
    start: float
    channels: Mapping[str, Array]
    units: Mapping[str, str]
    columns: Mapping[str, int] = field(default_factory=dict)
    condition: Mapping[str, float] = field(default_factory=dict)
    wording: Mapping[str, str] = field(default_factory=dict)
    rows_kept: int = 0
    rows_refused: int = 0
    findings: tuple[Finding, ...] = ()
    history: tuple[str, ...] = ()

    @property
    def samples(self) -> int:
        """Number of samples N."""
        return len(next(iter(self.channels.values()), ()))


@dataclass(frozen=True, slots=True)
class Segment:
    """Whole steady cycles (or one stretch) of a recording under one test condition.

    Attributes
    ----------
    id
        Unique within a workspace: ``RECORDING#K``.
    condition
        Name of the test condition, shared by repeats: ``sine-5Hz-3A``.
    recording
        Id of the recording.
    start, stop
        Sample range [start, stop) of the recording that is compared with the model.
    warm_up
        Samples before ``start`` that the model is driven with, and not compared, so that its state settles.
    waveform
        ``sine``, ``triangle``, ``step``, ``transient``, ``random``, ``quasi-static`` or ``periodic`` (any other
        repeated shape).
    drive
        Channel that defines the condition: ``current``, ``displacement``, ``velocity`` or ``angle``.
    frequency
        Fundamental frequency in Hz; 0 where there is none.
    amplitude, offset
        Half the peak-to-peak value and the mean of the drive, in its SI unit.
    cycles
        Number of whole cycles in [start, stop); 0 where the drive is not periodic.
    current, temperature
        Level in A and in degC where the test holds them (nan where unknown).
    role
        ``train`` or ``holdout``.
    """

    id: str
    condition: str
    recording: str
    start: int
    stop: int
    warm_up: int
    waveform: str
    drive: str
    frequency: float
    amplitude: float
    offset: float
    cycles: int
    current: float
    temperature: float
    role: str

    @property
    def samples(self) -> int:
        """Number of samples compared with the model."""
        return self.stop - self.start
