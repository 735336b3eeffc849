"""What ingest.json, flux.json, segments.parquet, report.json and the metadata of recordings hold."""

from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from mrfit.io.schemas.reading import Part, Stored

INGEST = "mrfit/ingest/1"
FLUX = "mrfit/flux/1"
SEGMENTS = "mrfit/segments/1"
RECORDING = "mrfit/recording/1"
# Ids name files and are never paths
Identifier = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9._-]*$")]


class FoundOddity(Part):
    """A finding of ingest."""

    kind: str
    channel: str
    at: float | None
    text: str


class StoredChannel(Part):
    """A channel of a recording."""

    name: str
    unit: str
    column: int | None


class About(Stored):
    """All that is kept of a recording beside its samples."""

    known = (RECORDING,)
    id: Identifier
    source: str
    sha256: str
    reader: str
    rows_kept: int
    rows_refused: int
    dt: float = Field(gt=0.0)
    start: float
    channels: list[StoredChannel]
    condition: dict[str, float | None]
    wording: dict[str, str] = {}
    findings: list[FoundOddity]
    history: list[str]


class Refused(Part):
    """A log that could not be read."""

    source: str
    reason: str
    remedy: str
    kept: bool = False


class Copy(Part):
    """A log that holds the same bytes as another one."""

    source: str
    of: str
    read: bool


class IngestFile(Stored):
    """Content of ingest.json."""

    known = (INGEST,)
    recordings: list[About]
    refused: list[Refused]
    copies: list[Copy] = []
    sources: dict[str, str] = {}
    base: str = "."
    code: str | None = None


class FluxSettings(Part):
    """Settings of the flux stage."""

    model_config = ConfigDict(extra="forbid")
    resistance: float | Literal["auto"] | None = None
    drift: str = "cycle"
    rule: str = "trapezoid"
    fallback: float | None = None


class FluxRow(Part):
    """What the flux stage did with a recording."""

    id: str
    action: str = ""
    resistance: float | None = None
    resistance_error: float | None = None
    resistance_source: str = ""
    lambda0: float | None = None
    offset_volt: float | None = None
    closure_rms: float | None = None
    loop_area: float | None = None


class FluxFile(Stored):
    """Content of flux.json."""

    known = (FLUX,)
    settings: FluxSettings
    key: str | None = None
    code: str = ""
    resistance: float | None = None
    recordings: list[FluxRow]
    findings: list[str] = []
    separation_text: list[str] = []


class SegmentSettings(Part):
    """Settings of the segment stage."""

    model_config = ConfigDict(extra="forbid")
    drive: str | None = None
    min_cycles: int = 2
    holdout: str = "auto"
    settle: int = 1
    tolerance: float = 0.02


class SegmentsFile(Stored):
    """What the segment stage writes with its table."""

    known = (SEGMENTS,)
    settings: SegmentSettings
    key: str
    code: str = ""
    segments: list[dict[str, Any]]
    findings: list[str] = []


class SegmentRow(Part):
    """A row of segments.parquet; a level may be nan."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=True)
    id: str
    condition: str
    recording: Identifier
    start: int = Field(ge=0)
    stop: int
    warm_up: int = Field(ge=0)
    waveform: str
    drive: str
    frequency: float = Field(ge=0.0, allow_inf_nan=False)
    amplitude: float = Field(ge=0.0, allow_inf_nan=False)
    offset: float = Field(allow_inf_nan=False)
    cycles: int = Field(ge=0)
    current: float
    temperature: float
    role: Literal["train", "holdout"]

    @model_validator(mode="after")
    def _holds_samples(self) -> Self:
        if not self.warm_up <= self.start < self.stop:
            raise ValueError(f"segment {self.id} from sample {self.start} to {self.stop} holds none")
        return self


class ReportFile(Stored):
    """Content of report.json."""

    known = ("mrfit/report/1",)
    key: str
    code: str = ""
    fits: list[str]
    outdated: list[str]
    conditions: int
    files: list[str]
