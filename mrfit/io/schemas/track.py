"""Result of `mrfit track-parameters`: parameters of a fit along logs; their courses are in tables beside it."""

from dataclasses import field

from mrfit.io.schemas.reading import Document, Entry, Number, told


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
    factor
        Whether it multiplies the values of the parameter over the current.
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
    factor: bool = False


class TrackedLog(Entry):
    """A log: samples, interval in s, shares of the time moved and with moving parameters, rms of the innovations."""

    recording: str
    samples: int
    dt: float
    moved: float
    moving: float
    innovation: float
    parameters: list[TrackedValue] = field(default_factory=list)


class TracksFile(Document):
    """Parameters of a fit along logs, and the noise that its residual has."""

    schema: str = "mrfit/track-parameters/1"
    fit: str
    model: str
    output: str
    noise: float
    correlated: float
    logs: list[TrackedLog]
    page: str = told("")
