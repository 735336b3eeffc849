"""Result of `mrfit track-parameters`: parameters of a fit along logs; their courses are in tables beside it."""

from dataclasses import dataclass, field
from typing import ClassVar

from mrfit.io.schemas.reading import Document, Entry, Number, told

PARAMETER_TRACKS = "mrfit/track-parameters/1"


@dataclass(frozen=True, kw_only=True)
class TrackedValue(Entry):
    """A parameter along a log, SI.

    Attributes
    ----------
    name, unit
        Which.
    fit, fit_deviation
        Its value by the fit, and the standard deviation of that.
    least, greatest
        Of the estimates.
    end, end_deviation
        The estimate at the end of the log, and its standard deviation.
    block, block_deviation
        The refit of the last block alone; null where it does not tell.
    """

    name: str
    unit: str
    fit: Number
    fit_deviation: Number
    least: Number
    greatest: Number
    end: Number
    end_deviation: Number
    block: Number | None
    block_deviation: Number | None


@dataclass(frozen=True, kw_only=True)
class TrackedLog(Entry):
    """A log: samples, interval in s, shares of the time moved and with moving parameters, rms of the innovations."""

    recording: str
    samples: int
    dt: float
    moved: float
    moving: float
    innovation: float
    parameters: list[TrackedValue] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class TracksFile(Document):
    """Parameters of a fit along logs, and the noise that its residual has."""

    known: ClassVar = (PARAMETER_TRACKS,)
    schema: str = PARAMETER_TRACKS
    fit: str
    model: str
    output: str
    noise: float
    correlated: float
    logs: list[TrackedLog]
    page: str = told("")
