"""Results of ingest, flux, segment and report, as ingest.json and others hold them, and what is said of a recording."""

from collections.abc import Collection
from dataclasses import field, fields
from typing import Annotated, ClassVar, Literal, Self

from pydantic import ConfigDict, Field, model_validator

import mrfit.settings.flux
import mrfit.settings.segment
from mrfit.core.recording import Recording
from mrfit.io.schemas.reading import Document, Entry, sparse, told

RECORDING = "mrfit/recording/1"
# Ids name files and are never paths
Identifier = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9._-]*$")]
# What the record of a recording says as the recording does
AS_RECORDED = ("id", "source", "sha256", "reader", "rows_kept", "rows_refused", "dt", "start")
FORBIDDING = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


class FoundOddity(Entry):
    """A finding of ingest."""

    kind: str
    channel: str
    at: float | None
    text: str


class StoredChannel(Entry):
    """A channel of a recording."""

    name: str
    unit: str
    column: int | None


class About(Document):
    """All that is kept of a recording beside its samples; its own file has the schema before it."""

    known: ClassVar = (RECORDING,)
    id: Identifier
    source: str
    sha256: str
    reader: str
    rows_kept: int
    rows_refused: int
    dt: Annotated[float, Field(gt=0.0)]
    start: float
    channels: list[StoredChannel]
    condition: dict[str, float | None]
    wording: dict[str, str] = field(default_factory=dict)
    findings: list[FoundOddity]
    history: list[str]

    @classmethod
    def of(cls, recording: Recording) -> Self:
        """Return the record that is kept of a recording."""
        r = recording
        return cls(
            **{name: getattr(r, name) for name in AS_RECORDED},
            channels=[StoredChannel(name=n, unit=r.units.get(n, ""), column=r.columns.get(n)) for n in r.channels],
            condition=dict(r.condition),
            wording=dict(r.wording),
            findings=[FoundOddity(kind=f.kind, channel=f.channel, at=f.at, text=f.text) for f in r.findings],
            history=list(r.history),
        )


class Refused(Entry):
    """A log that could not be read; ``kept`` says that the recordings read from it before are still there."""

    source: str
    reason: str
    remedy: str
    kept: bool = sparse(False)


class Copy(Entry):
    """A log that holds the same bytes as another one; ``read`` where its name or settings make another test of it."""

    source: str
    of: str
    read: bool


class IngestFile(Document):
    """Result of ingest, the content of ingest.json.

    Attributes
    ----------
    sources
        Source -> key of all that determined its recordings.
    files
        Id of a recording -> hash of its file; of what an older mrfit wrote there is none.
    base
        Folder in which relative sources are meant, as seen from the workspace; None where all are absolute.
    code
        Version of the code that read all there is; empty where several did.
    skipped, added, replaced, unchanged, reasons
        Of the run: whether it had nothing to do; sources; why each was replaced.
    """

    schema: str = "mrfit/ingest/1"
    recordings: list[About]
    refused: list[Refused]
    copies: list[Copy] = field(default_factory=list)
    sources: dict[str, str] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    key: str = ""
    code: str | None = None
    base: str | None = sparse(None)
    skipped: bool = told(False)
    added: list[str] = told(list)
    replaced: list[str] = told(list)
    unchanged: list[str] = told(list)
    reasons: dict[str, str] = told(dict)


class FluxSettings(mrfit.settings.flux.Settings, Entry):
    """Settings of the flux stage, as its file has them."""

    __pydantic_config__: ClassVar[ConfigDict] = FORBIDDING


class LoopRow(Entry):
    """A steady loop of current and flux: area in J with its standard error, ohmic loss per cycle in J."""

    frequency: float
    amplitude: float
    cycles: int
    loop_area: float | None
    loop_area_error: float | None
    ohmic: float | None


class FluxRow(Entry):
    """Treatment of a recording by the flux stage; of one that it did not integrate only id and action are written."""

    id: str
    action: str = ""
    resistance: float | None = None
    resistance_error: float | None = None
    resistance_source: str = ""
    lambda0: float | None = None
    offset_volt: float | None = None
    drift: str = ""
    finding: str = ""
    closure_rms: float | None = None
    closure_max: float | None = None
    loop_area: float | None = None
    amplitude: float | None = None
    frequency: float | None = None
    loops: list[LoopRow] = field(default_factory=list)

    @property
    def absent(self) -> Collection[str]:
        """All but id and action where nothing was integrated."""
        return () if self.resistance is not None else [f.name for f in fields(self)[2:]]


class SeparationRow(Entry):
    """Loop area of one amplitude, separated: area(f) = static + eddy·f − resistance_error·∮ i² dt (∝ 1/f).

    Attributes
    ----------
    amplitude, frequencies
        Mean amplitude in A, and the frequencies in Hz it rests on.
    static, static_error
        Static hysteresis loss per cycle in J, and its standard error.
    eddy, eddy_error
        Eddy-current loss per cycle and frequency in J/Hz, and its standard error.
    resistance_error, resistance_error_error
        Resistance used minus true resistance in Ω, and its standard error.
    """

    amplitude: float
    frequencies: list[float]
    static: float | None
    static_error: float | None
    eddy: float | None
    eddy_error: float | None
    resistance_error: float | None
    resistance_error_error: float | None


class FluxFile(Document):
    """Result of the flux stage, the content of flux.json.

    ``files`` has the hash of the file of every recording that it changed, by id; ``skipped``: whether it was there
    already.
    """

    schema: str = "mrfit/flux/1"
    key: str | None = None
    code: str = ""
    settings: FluxSettings
    resistance: float | None = None
    recordings: list[FluxRow]
    findings: list[str] = field(default_factory=list)
    separation: list[SeparationRow] = field(default_factory=list)
    separation_text: list[str] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)
    skipped: bool = told(False)


class SegmentSettings(mrfit.settings.segment.Settings, Entry):
    """Settings of the segment stage, as its file has them."""

    __pydantic_config__: ClassVar[ConfigDict] = FORBIDDING


class SegmentRow(Entry):
    """A segment; a level that no test holds is nan, which JSON has as null."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(strict=True, extra="forbid", allow_inf_nan=True)
    id: str
    condition: str
    recording: Identifier
    start: Annotated[int, Field(ge=0)]
    stop: int
    warm_up: Annotated[int, Field(ge=0)]
    waveform: str
    drive: str
    frequency: Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
    amplitude: Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
    offset: Annotated[float, Field(allow_inf_nan=False)]
    cycles: Annotated[int, Field(ge=0)]
    current: float | None
    temperature: float | None
    role: Literal["train", "holdout"]

    @model_validator(mode="after")
    def _holds_samples(self) -> Self:
        if not self.warm_up <= self.start < self.stop:
            raise ValueError(f"segment {self.id} from sample {self.start} to {self.stop} holds none")
        return self


class ConditionRow(Entry):
    """A test condition in one role."""

    condition: str
    role: str
    waveform: str
    segments: int
    samples: int


class CutRow(Entry):
    """Samples of a recording that are in its segments, and those that are not."""

    id: str
    kept: int
    cut: int
    segments: int


class SegmentsFile(Document):
    """Result of the segment stage, written with its table; ``skipped``: whether it was there already."""

    schema: str = "mrfit/segments/1"
    key: str
    code: str = ""
    settings: SegmentSettings
    segments: list[SegmentRow]
    conditions: list[ConditionRow] = field(default_factory=list)
    recordings: list[CutRow] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)
    skipped: bool = told(False)


class ReportFile(Document):
    """Result of the report stage, the content of report.json.

    Attributes
    ----------
    fits, outdated
        Names of the fits, and of those that other data than are here now made.
    conditions
        How many conditions they have.
    files
        What the report consists of.
    index, skipped, reasons
        Of the run: path of the page; whether nothing had changed since the last; why fits are out of date, by name.
    """

    schema: str = "mrfit/report/1"
    key: str
    code: str = ""
    fits: list[str]
    outdated: list[str]
    conditions: int
    files: list[str]
    index: str = told("")
    skipped: bool = told(False)
    reasons: dict[str, str] = told(dict)
