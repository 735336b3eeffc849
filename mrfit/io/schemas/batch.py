"""Records that a batch keeps of every log, a line of its journal each, and the report of a command."""

from dataclasses import field

from mrfit.io.schemas.fit import Covariance
from mrfit.io.schemas.reading import Document, Entry, Number, told

BATCH = "mrfit/batch/1"


class Fitted(Entry):
    """A parameter of one set of them; ``low`` to ``high`` is its 95 % interval, None where the data leave it open."""

    parameter: str
    value: Number
    unit: str = ""
    low: Number | None = None
    high: Number | None = None


class OfCondition(Entry):
    """Result of the fit of one condition of a log.

    Attributes
    ----------
    condition
        Its name.
    current, frequency, amplitude
        Coil current in A that the test held, and its motion in Hz and SI; None where it held none.
    nrmse, nrmse_holdout
        RMS error over the measured range, in training and on held-out data; None where there is none.
    warnings
        Kinds of warnings.
    parameters
        With their intervals.
    covariance
        Of those that the data determine; None of a fit that determines none.
    """

    condition: str
    current: Number | None = None
    frequency: Number | None = None
    amplitude: Number | None = None
    nrmse: Number | None = None
    nrmse_holdout: Number | None = None
    warnings: list[str] = field(default_factory=list)
    parameters: list[Fitted] = field(default_factory=list)
    covariance: Covariance | None = None


class LogRow(Document):
    """Result of a log.

    Attributes
    ----------
    log
        Its path as the command found it.
    key
        Key of all that determines the result; empty where another try may give one: no reader knows it, or the
        machine lacked memory, room or a permission.
    made
        Hash of what its workspace holds of it; empty where it has none.
    tests
        Its conditions; empty where it failed.
    error
        The line with which it failed, or an empty one.
    """

    schema: str = BATCH
    log: str
    key: str = ""
    made: str = ""
    tests: list[OfCondition] = field(default_factory=list)
    error: str = ""


class BatchFile(Document):
    """Result of a batch, as batch.json holds it.

    Attributes
    ----------
    key
        Key of all that the table and the page were made of.
    logs
        How many there are.
    done, unchanged
        Fitted by this call, and before.
    failed
        Those that could not be fitted, with their line.
    table, page
        Where these lie.
    outliers, drifts
        How many values and trends the page lists.
    most
        Logs of the condition that most have: outliers are looked for among 8 or more, drifts among 20.
    """

    schema: str = BATCH
    key: str = ""
    logs: int
    done: int = told(0)
    unchanged: int = told(0)
    failed: list[LogRow] = field(default_factory=list)
    table: str = ""
    page: str = ""
    outliers: int = 0
    drifts: int = 0
    most: int = 0
