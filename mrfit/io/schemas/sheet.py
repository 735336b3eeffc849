"""A damper's test sheet: quantities of every condition with intervals, verdicts, comparison; sheet.json."""

from dataclasses import field

from mrfit.io.schemas.reading import Document, Entry, told

PASS, FAIL, UNDECIDED = "pass", "fail", "cannot be judged"


class QuantityRow(Entry):
    """A quantity of a condition, SI, or the reason why there is none.

    Attributes
    ----------
    name, unit
        What it is.
    value, low, high
        With its 95 % interval; null where it is not known.
    reason
        Why there is no value, or no interval of one.
    cycles
        The quantity of every cycle.
    noise
        Standard deviation that the channels' noise gives the value of one cycle.
    slope, slope_low, slope_high
        Change per cycle with its 95 % interval.
    greatest_deviation, first_to_third
        Greatest deviation of one cycle from the value, and loss from the first to the third cycle, as shares.
    drift
        Change from the first to the last cycle where it is more than chance, else 0.
    """

    name: str
    unit: str
    value: float | None = None
    low: float | None = None
    high: float | None = None
    reason: str = ""
    cycles: list[float] = field(default_factory=list)
    noise: float | None = None
    slope: float | None = None
    slope_low: float | None = None
    slope_high: float | None = None
    greatest_deviation: float | None = None
    first_to_third: float | None = None
    drift: float = 0.0


class SheetCondition(Entry):
    """The whole cycles of a unit under one condition, SI; ``noise`` is that of the force in N."""

    unit: str
    condition: str
    recording: str
    source: str
    waveform: str
    frequency: float
    stroke: float
    peak_velocity: float
    current: float | None
    temperature: float | None
    cycles: int
    samples_per_cycle: float
    noise: float
    quantities: list[QuantityRow]
    findings: list[str]


class AcrossRow(Entry):
    """A quantity of several conditions; ``conditions`` says of which."""

    conditions: str
    quantity: QuantityRow


class VerdictRow(Entry):
    """A limit and what it says of a value: ``pass``, ``fail`` or ``cannot be judged``, with its interval.

    ``level`` is ``unit``, ``cycle`` (greatest deviation of one cycle) or ``batch`` (mean of all units).
    """

    level: str
    unit: str
    condition: str
    quantity: str
    si_unit: str
    value: float | None = None
    low: float | None = None
    high: float | None = None
    least: float | None = None
    most: float | None = None
    verdict: str
    reason: str = ""


class UnitRow(Entry):
    """A unit: its conditions, quantities across them, verdicts, and the verdict of all of these."""

    unit: str
    about: dict[str, str]
    conditions: list[SheetCondition]
    across: list[AcrossRow]
    verdicts: list[VerdictRow]
    verdict: str
    left_out: list[str]


class StandsOut(Entry):
    """A unit far from the others; ``z`` in robust standard deviations."""

    unit: str
    condition: str
    quantity: str
    value: float
    median: float
    z: float


class ChangeRow(Entry):
    """A quantity beside that of the logs it is compared with; ``change`` is a share of the latter."""

    unit: str
    condition: str
    quantity: str
    value: float
    against: float
    change: float | None
    low: float | None
    high: float | None
    changed: bool


class SheetFile(Document):
    """The sheet of one or several units, and how it was computed."""

    schema: str = "mrfit/sheet/1"
    convention: str
    settings: dict[str, object]
    limits: str
    guard: str
    units: list[UnitRow]
    batch: list[VerdictRow]
    stands_out: list[StandsOut]
    changes: list[ChangeRow]
    unmatched: list[str]
    left_out: list[str]
    files: list[str] = told(list)
