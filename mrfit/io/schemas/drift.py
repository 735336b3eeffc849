"""Content of drift.json: changes over fits, differences between units, and units that stand out."""

from dataclasses import field

from mrfit.io.schemas.reading import Document, Entry, Number, told


class Slope(Entry):
    """Change of a parameter with a covariate.

    Attributes
    ----------
    covariate, per
        Name, and the step of it that the value is for, as ``1000 cycles``.
    value, low, high
        Change per step with its 95 % interval: a share of the parameter where its scale is logarithmic, else SI.
    probability
        Of a change so large without any, multiplied for all that were tested (Holm).
    drifts
        Whether the parameter follows the covariate.
    units_differ
        Standard deviation of the change between units; None where too few units have enough tests.
    """

    covariate: str
    per: str
    value: Number
    low: Number
    high: Number
    probability: Number
    drifts: bool = False
    units_differ: Number | None = None


class ChangePoint(Entry):
    """A step of a parameter at a value of a covariate, where it says more than a steady drift.

    ``change`` is a share of the parameter on a logarithmic scale, else SI.
    """

    covariate: str
    at: Number
    change: Number
    probability: Number


class UnitThatStandsOut(Entry):
    """A unit far from all others: studentised residual ``z`` against these, probability that allows for all tests."""

    specimen: str
    value: Number
    z: Number
    probability: Number


class ParameterOverUnits(Entry):
    """A parameter of one condition over all units and tests.

    Attributes
    ----------
    parameter, condition, unit, role
        What it is of.
    logarithmic
        Whether deviations and slopes are shares of the value.
    units, tests
        How many there are.
    mean, mean_low, mean_high
        Of the population, with its 95 % interval, SI; nan below three units.
    between, between_low, between_high
        Standard deviation between units with its 95 % interval: reproducibility without repeatability.
    repeatability, reproducibility
        Standard deviations of tests of one unit, and of tests of any unit; None where no unit was tested twice.
    tolerance_low, tolerance_high
        95 % of all units lie between, with 95 % confidence.
    least, greatest
        One-sided: 95 % of all units lie above the first, 95 % below the second, each with 95 % confidence.
    slopes, change
        Changes with covariates, and at a step.
    stands_out
        Units that do; they are left out of the population.
    """

    parameter: str
    condition: str
    unit: str
    role: str
    logarithmic: bool
    units: int
    tests: int
    mean: Number | None = None
    mean_low: Number | None = None
    mean_high: Number | None = None
    between: Number | None = None
    between_low: Number | None = None
    between_high: Number | None = None
    repeatability: Number | None = None
    reproducibility: Number | None = None
    tolerance_low: Number | None = None
    tolerance_high: Number | None = None
    least: Number | None = None
    greatest: Number | None = None
    slopes: list[Slope] = field(default_factory=list)
    change: ChangePoint | None = None
    stands_out: list[UnitThatStandsOut] = field(default_factory=list)


class DriftCause(Entry):
    """A candidate for the effect behind a drift, and the test that speaks for it, in words."""

    effect: str
    condition: str
    text: str


class DriftFile(Document):
    """Result of a comparison of fits, as drift.json holds it.

    Attributes
    ----------
    over, unit, at, draws, seed
        As they were asked for.
    units, tests
        How many there are.
    parameters
        Each of each condition.
    causes
        Candidates for the effects behind drifts.
    notes
        What could not be judged and why, and fits that are out of date.
    files
        What was written.
    """

    schema: str = "mrfit/drift/1"
    over: list[str]
    unit: str = ""
    at: str = ""
    draws: int = 0
    seed: int = 0
    units: int
    tests: int
    parameters: list[ParameterOverUnits]
    causes: list[DriftCause] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    files: list[str] = told(list)
