"""Results of `mrfit apply`: invert.json, track.json, quarter-car.json, current.json and flux-command.json."""

from dataclasses import field

from mrfit.io.schemas.reading import Document, Entry, Number, told

INVERT = "mrfit/apply-invert/1"
TRACK = "mrfit/apply-track/1"
QUARTER_CAR = "mrfit/apply-quarter-car/1"
FLUX_CURRENT = "mrfit/apply-current/1"
FLUX_COMMAND = "mrfit/apply-flux-command/1"


class DamperEntry(Entry):
    """A damper: (name, value) of its parameters, (parameter, order) of those that depend on current, range in A.

    ``tested`` has (channel, least, greatest) of the tests of its fit, SI.
    """

    name: str
    model: str
    parameters: tuple[tuple[str, Number], ...]
    orders: tuple[tuple[str, int | str], ...]
    low: Number
    high: Number
    tested: tuple[tuple[str, Number, Number], ...] = ()


class AmplifierEntry(Entry):
    """Limits of coil and amplifier; a limit is null where there is none."""

    most: Number
    least: Number | None
    rate: Number | None
    voltage: Number | None
    resistance: Number
    inductance: Number


class InversionRow(Entry):
    """The currents of a motion in numbers, SI; shares of the samples, by whether the desired force can be reached.

    ``limited`` is the share at which coil or amplifier held back what could be reached. ``dead_time`` is that by which
    commands are sent early; ``behind`` names what lies behind the force and is inverted with the desired one known
    ahead. Errors are those of the whole model under the commands; where no sample was free of limits the greatest is
    none.
    """

    motion: str = ""
    damper: DamperEntry
    amplifier: AmplifierEntry
    samples: int
    dt: float
    explicit: bool
    shares: dict[str, float]
    limited: float
    greatest_error_where_reached: float | None
    rms_error: float | None
    rms_error_over_peak: float | None
    dead_time: Number
    behind: tuple[str, ...]


class InvertFile(Document):
    """The currents for desired forces, motion by motion; their courses are in tables beside it."""

    schema: str = INVERT
    fit: str
    motions: list[InversionRow]
    notes: list[str]
    page: str = told("")
    file: str = told("")


class GainsEntry(Entry):
    """Gains of the feedback on the force's error, in A/N and A/(N*s)."""

    proportional: Number
    integral: Number


class Region(Entry):
    """Errors in a region: relative rms error (over the rms force), and the region's share of the samples."""

    error: float | None
    share: float


class TrackingRow(Entry):
    """Errors of a law tracked by a scheme, with the current's lag or without; ``regions`` I, II and III."""

    motion: str
    law: str
    scheme: str
    lag: bool
    error: float | None
    error_to_desired: float | None
    err_rms_f: float | None
    err_energy: float | None
    regions: tuple[Region, Region, Region]
    greatest_command: float


class LagCost(Entry):
    """The error of a law tracked by a scheme, beside that of the same without lag."""

    motion: str
    law: str
    scheme: str
    error: float | None
    without_lag: float | None


class TrackFile(Document):
    """Every law by every scheme on every motion, and the settings; ``plant`` is the damper that answers."""

    schema: str = TRACK
    fit: str
    damper: DamperEntry
    plant: DamperEntry
    amplifier: AmplifierEntry
    gains: GainsEntry
    dead_time: Number
    cases: list[TrackingRow]
    lag_costs: list[LagCost]
    notes: list[str] = field(default_factory=list)
    page: str = told("")
    file: str = told("")


class CarEntry(Entry):
    """Masses in kg, stiffnesses in N/m, the tyre's damping in N*s/m; ``unsprung`` 0 for a rigid wheel."""

    sprung: Number
    unsprung: Number
    spring: Number
    tyre: Number
    tyre_damping: Number


class TimingEntry(Entry):
    """Sample time of the control in s, steps of the simulation in it; ``until`` is null where the road ends it."""

    sample: Number
    steps: int
    soft: Number
    until: Number | None


class ControlEntry(Entry):
    """A control, its desired damping in N*s/m, and the share of skyhook in the hybrid."""

    name: str
    damping: Number
    share: Number


class Chatter(Entry):
    """Trembling found in a ride.

    Attributes
    ----------
    found
        Whether the force chatters.
    share
        Of the time, in bursts.
    rate
        Oscillations per s within bursts.
    turns
        Turning points within bursts.
    swing
        Median size of their swings in N.
    first
        Time in s of the first burst; null without one.
    switching
        Rate of the command's crossings of its middle in 1/s.
    jumps
        Rate of the force's jumps in 1/s while the command stayed.
    limit_cycle
        Frequency in Hz of an oscillation that goes on when the road has ended; 0 without one.
    cause
        ``lag``, ``sample time``, ``pre-yield slope``, several with ``or`` between them where each leaves as little, or
        that they were not told apart; empty without chatter.
    evidence
        Swings in N times their share of the time: as it is, and without each cause.
    """

    found: bool
    share: float
    rate: float
    turns: int
    swing: float
    first: float | None
    switching: float
    jumps: float
    limit_cycle: float
    cause: str = ""
    evidence: tuple[tuple[str, float], ...] = ()


class RideRow(Entry):
    """One ride in numbers, SI.

    Attributes
    ----------
    road, control, lag
        Which; whether the current lagged.
    acceleration
        Rms of the sprung mass's.
    tyre_load, least_load
        Rms of the dynamic tyre load over the static one, and the least load over it (below 0 the wheel has left the
        road); null with a rigid wheel.
    travel, greatest_travel
        Rms and greatest displacement of the damper.
    current
        Mean command.
    chatter
        What was found of trembling.
    """

    road: str
    control: str
    lag: bool
    acceleration: float
    tyre_load: float | None
    least_load: float | None
    travel: float
    greatest_travel: float
    current: float
    chatter: Chatter


class CheckRow(Entry):
    """The adaptive simulation of a control on the first road, as far as it came; its rms acceleration if to the end."""

    control: str
    acceleration: float | None
    evaluations: int
    ended: Number
    duration: Number


class QuarterCarFile(Document):
    """Every control on every road, and the settings; a road is its name and what it is made of, its seed included."""

    schema: str = QUARTER_CAR
    fit: str
    damper: DamperEntry
    car: CarEntry
    timing: TimingEntry
    amplifier: AmplifierEntry
    controls: list[ControlEntry]
    roads: list[dict[str, str | Number]]
    rows: list[RideRow]
    checks: list[CheckRow]
    findings: list[str]
    page: str = told("")
    file: str = told("")


class CoilEntry(Entry):
    """A coil: (name, value) of its parameters, SI, and the effects of instruments that were left out."""

    name: str
    model: str
    parameters: tuple[tuple[str, Number], ...]
    left_out: tuple[str, ...] = ()


class CurrentRow(Entry):
    """The current of a log's flux linkage in numbers, SI.

    Attributes
    ----------
    log, samples, dt
        Which log; its samples and their interval in s.
    known
        Samples of the beginning over which the current is known.
    offset
        Constant of the flux in Wb, from the beginning.
    history
        Currents in A before the first sample from which the state comes; empty for none.
    range
        Of the current found, in A.
    rms_error, error
        Rms error behind the beginning in A, and over the measured range; null where no current was logged.
    """

    log: str
    samples: int
    dt: float
    known: int
    offset: float
    history: tuple[float, ...]
    range: float
    rms_error: float | None
    error: float | None


class CurrentFile(Document):
    """The currents of flux linkages, log by log; their courses are in tables beside it."""

    schema: str = FLUX_CURRENT
    fit: str
    coil: CoilEntry
    logs: list[CurrentRow]
    notes: list[str]
    page: str = told("")
    file: str = told("")


class FluxCommandFile(Document):
    """A wanted flux linkage and the voltage for it, whose courses are in a table beside it.

    Attributes
    ----------
    fit, coil, plant
        Name of the fit, its coil, and the one that answers.
    resistance, voltage, current
        Of the coil in ohm; limits in V and A, null where there is none.
    wanted, samples, dt
        What was wanted, in words; samples and their interval in s.
    range
        Of the flux wanted, in Wb.
    error, rms_error
        Greatest and rms difference of flux wanted and flux got, over this range.
    limited
        Share of the samples at which voltage or current is at its limit.
    greatest_voltage, greatest_current
        In V and A.
    """

    schema: str = FLUX_COMMAND
    fit: str
    coil: CoilEntry
    plant: CoilEntry
    resistance: Number
    voltage: Number | None
    current: Number | None
    wanted: str
    samples: int
    dt: float
    range: float
    error: float
    rms_error: float
    limited: float
    greatest_voltage: float
    greatest_current: float
    notes: list[str]
    page: str = told("")
    file: str = told("")
