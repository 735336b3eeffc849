"""Result of a fit, as in fit.json, and what is kept of an unfinished fit."""

import json
from collections.abc import Collection
from dataclasses import field
from typing import Any, Literal, Self

from pydantic import field_validator, model_validator

from mrfit.core.channels import unit_of
from mrfit.io.schemas.band import Refits, Remainder
from mrfit.io.schemas.determined import State, state_of
from mrfit.io.schemas.reading import Document, Entry, Number, of_json, sparse, told
from mrfit.io.schemas.stages import FluxSettings, SegmentSettings

PARAMETER_COLUMNS = ("condition", "parameter", "value", "unit", "low", "high", "at_bound", "identifiable", "determined")
"""Columns of the tables of parameters, of a fit's folder and of a report."""


class Quantity(Entry):
    """A parameter or derived quantity; ``low`` to ``high`` is its 95 % interval, None where the data leave it open.

    ``determined`` follows from the others, by one rule for files, commands, results in Python and reports; of an offset
    ``added_to`` is the range of the data that it adds to; ``logarithm`` says that it is one of a quantity.
    """

    name: str
    value: Number
    unit: str = ""
    text: str = ""
    low: Number | None = None
    high: Number | None = None
    bound_low: Number | None = None
    bound_high: Number | None = None
    at_bound: bool = False
    identifiable: bool = True
    fixed: bool = False
    added_to: Number | None = None
    logarithm: bool = False
    determined: State = field(init=False)

    @property
    def absent(self) -> Collection[str]:
        """Names of what is said of offsets and of logarithms alone."""
        said = {"added_to": self.added_to is not None, "logarithm": self.logarithm}
        return [name for name, is_said in said.items() if not is_said]

    def __post_init__(self) -> None:
        """Judge how well the data determine the value."""
        found = state_of(self.value, self.low, self.high, self.added_to, self.logarithm)
        free = found if self.identifiable else State.NOT
        object.__setattr__(self, "determined", State.HELD if self.fixed else free)

    @property
    def bound(self) -> float | None:
        """The bound the value ended at, None if it did not."""
        if not self.at_bound or self.bound_low is None or self.bound_high is None:
            return None
        nearer_low = abs(self.value - self.bound_low) <= abs(self.value - self.bound_high)
        return self.bound_low if nearer_low else self.bound_high


class Conditioning(Entry):
    """Number of directions of the parameter space that the data determine, and those they do not."""

    rank: int
    parameters: int
    singular_values: list[float | None] = field(default_factory=list)
    null_directions: list[dict[str, float]] = field(default_factory=list)


class Passivity(Entry):
    """Work per cycle taken in by the model on one periodic segment."""

    condition: str
    role: str = ""
    loop_area: float | None
    unit: str = "J"
    passive: bool


class Caution(Entry):
    """A reason to distrust a result."""

    kind: str
    text: str


class SegmentUse(Entry):
    """Use of a segment in a fit."""

    id: str
    condition: str
    role: str
    drive: str = ""
    offset: float | None = None
    noise_floor: float | None = None
    noise_floor_method: str = ""
    noise_floor_bounds: tuple[float | None, float | None] = (None, None)


class Level(Entry):
    """The test condition of a result, None where it is not known."""

    frequency: float | None = None
    amplitude: float | None = None
    current: float | None = None


class SearchStage(Entry):
    """A stage of a staged search: its name, and the kind of test in which its part of the model acts alone.

    ``segments`` are ids of the tests it was fitted to. Without tests of the kind there is neither cost nor evaluations,
    and ``parameters``, which it fits, are left to a later stage.
    """

    stage: str
    test: str = ""
    segments: list[str] = field(default_factory=list)
    parameters: list[str] = field(default_factory=list)
    cost: float | None = None
    evaluations: int | None = None

    @property
    def absent(self) -> Collection[str]:
        """Values that a stage without tests does not have."""
        return () if self.evaluations is not None else ("cost", "evaluations")


class DriftRow(Entry):
    """A steady drift of a record: range of level and gain over its duration, or what would follow an effect."""

    condition: str
    segment: str = ""
    level_rate: float = 0.0
    gain_rate: float = 0.0
    follows: str = ""
    rate: float = 0.0

    @property
    def absent(self) -> Collection[str]:
        """The effect that the drift would follow, and its rate, where there is none."""
        return () if self.follows else ("follows", "rate")


class Repeats(Entry):
    """Difference of the training segments of one condition.

    Attributes
    ----------
    condition, segments
        Its name, and how many there are.
    difference, noise_floor, moved
        The largest of two of them, its noise floor, and the output's standard deviation, in the output's unit.
    agree
        Whether one set of parameters can follow them all.
    """

    condition: str
    segments: int
    difference: float
    noise_floor: float
    moved: float
    agree: bool


class ResidualTest(Entry):
    """Correlation of the residual with one input, in the condition where it is largest.

    Attributes
    ----------
    channel, condition
        The input, and where its correlation is largest against its limit; ``all``: over all conditions together.
    correlation
        Of residual and lagged input there, the one that is largest against its limit.
    lag
        Samples by which the input is ahead of the residual there.
    limit
        What chance gives in any of the tests.
    dependent, conditions
        Conditions in which the residual depends on the input, and how many were tested.
    independent
        Whether nothing of the input is left in the residual, in any condition.
    """

    channel: str
    condition: str
    correlation: float
    lag: int
    limit: float
    dependent: int
    conditions: int
    independent: bool


class SearchEnd(Entry):
    """End of a search.

    Attributes
    ----------
    cost
        At its optimum.
    evaluations, budget, budget_spent, out_of_time, stopped
        Points simulated, and allowed; whether these or the time ended the search; why it ended, in words.
    nonfinite, first_nonfinite
        Points without a finite output, and the first of them by parameter.
    history, preliminary
        Best cost after so many evaluations, and how many of these steps are costs of another problem.
    starts, agreeing
        Costs at which several starts ended, and how many of them at the best.
    per_current
        What a first phase found at each current: ``current``, ``cost`` and the parameters.
    stages
        Of a staged search.
    """

    cost: float | None = None
    evaluations: int
    budget: int | None = None
    budget_spent: bool = False
    out_of_time: bool = False
    stopped: str = ""
    nonfinite: int = 0
    history: list[tuple[int, float | None]] = field(default_factory=list)
    preliminary: int = 0
    starts: list[float | None] | None = None
    agreeing: int = 0
    first_nonfinite: dict[str, float | None] | None = None
    per_current: list[dict[str, float | None]] | None = None
    stages: list[SearchStage] = field(default_factory=list)


class FoundPoint(SearchEnd):
    """Result of a search, as it is kept until the whole fit is written; ``point`` is its optimum in the unit cube."""

    point: list[float]
    cost: float


class Profile(Entry):
    """Profile likelihood of a parameter: how the cost rises as it is held and the others are refitted.

    Attributes
    ----------
    name
        The parameter.
    values
        Where it was held, rising, in its unit.
    rises
        Square root of the rise of the sum of squares over the variance of its residuals, widened for their correlation.
    quantile
        The rise at the ends of the 95 % interval.
    """

    name: str
    values: list[float]
    rises: list[float]
    quantile: float


class Band(Entry):
    """A parameter over current with its 95 % bands, None where the data leave them open.

    Attributes
    ----------
    name
        The parameter, without a current.
    current, value
        Currents in A, rising, twice where the parameter may jump; its value at each.
    low, high
        Pointwise: at any one current 95 of 100 hold the true value.
    low_everywhere, high_everywhere
        Simultaneous: 95 of 100 hold the whole true curve.
    """

    name: str
    current: list[float]
    value: list[float]
    low: list[float | None]
    high: list[float | None]
    low_everywhere: list[float | None]
    high_everywhere: list[float | None]


class Covariance(Entry):
    """Covariance of the parameters and derived quantities that the data determine, on the scale of the search.

    Attributes
    ----------
    names, roles
        In the order of the rows; a role is that of the model's SPEC.
    log
        Whether the scale is the natural logarithm of the value, else it is the value, SI.
    rows
        The covariance (Q, Q).
    degrees
        Degrees of freedom of Student's t.
    """

    names: list[str]
    roles: list[str]
    log: list[bool]
    rows: list[list[float]]
    degrees: float


class FitDiagnostics(Entry):
    """Everything of a result that says how far to trust it.

    Attributes
    ----------
    intervals
        Method of the intervals.
    parameters, derived
        With their intervals.
    conditioning, identifiability
        What the data determine, in numbers and in words.
    passivity, drift, repeats, residual_tests
        What the residual still holds.
    profiles
        Where intervals are those of the profile likelihood.
    bands
        Of the parameters that depend on current.
    covariance
        Of what the data determine, see ``Covariance``.
    draws
        Of the posterior, where intervals are its.
    refits, remainders
        Of which the band of a prediction is made.
    """

    intervals: str = "hac"
    parameters: list[Quantity]
    derived: list[Quantity] = field(default_factory=list)
    conditioning: Conditioning | None = None
    identifiability: list[str] = field(default_factory=list)
    passivity: list[Passivity] = field(default_factory=list)
    drift: list[DriftRow] = field(default_factory=list)
    repeats: list[Repeats] = field(default_factory=list)
    residual_tests: list[ResidualTest] = field(default_factory=list)
    profiles: list[Profile] = sparse(list)
    bands: list[Band] = sparse(list)
    covariance: Covariance | None = sparse(None)
    draws: Refits | None = sparse(None)
    refits: Refits | None = sparse(None)
    remainders: list[Remainder] = sparse(list)


class FittedConditions(Entry):
    """Test conditions that one set of parameters was fitted to: their common name, each of them, and their level."""

    condition: str
    conditions: list[str] = field(default_factory=list)
    at: Level = field(default_factory=Level)


class Result(FitDiagnostics, SearchEnd, FittedConditions):
    """One set of parameters, the search that found it, and how far to trust it."""

    segments: list[SegmentUse] = field(default_factory=list)
    warnings: list[Caution] = field(default_factory=list)


class MetricRow(Entry):
    """Errors of one condition and role, or of all conditions of a role; None or nan where a measure is undefined."""

    condition: str
    role: Literal["train", "holdout", "predict"]
    samples: int
    rmse: float | None = None
    mse: float | None = None
    nrmse: float | None = None
    esr: float | None = None
    relative_rmse: float | None = None
    err_peak: float | None = None
    err_energy: float | None = None
    fit_percent: float | None = None
    noise_floor: float | None = None

    @property
    def relative_floor(self) -> float | None:
        """Noise floor as a share of the measured range, the scale of NRMSE."""
        if self.noise_floor is None or not self.rmse or self.nrmse is None:
            return None
        return self.noise_floor * self.nrmse / self.rmse


class Changes(Entry):
    """The user's changes to a model's own bounds, start values and fixed parameters, in the settings of a fit."""

    bounds: list[tuple[str, float, float]] = field(default_factory=list)
    start: list[tuple[str, float]] = field(default_factory=list)
    fixed: list[tuple[str, float]] = field(default_factory=list)


class LevelError(Entry):
    """Error at a current, as a multiple of what a fit to it alone leaves."""

    current: float
    error: float | None


class LawTried(Entry):
    """A law of current and its mean error; ``form`` is ``constant``, or what stands before the order.

    ``why`` says why a law that looks nearer than the chosen one was not taken.
    """

    form: str
    order: int
    error: float | None
    why: str = ""


class LawChosen(Entry):
    """The law of current of parameters that vary alike, with what was rejected, the nearest first."""

    names: list[str]
    form: str
    order: int
    error: float | None
    rejected: list[LawTried]


class CurrentChoice(Entry):
    """Choice of the dependence on current: its judgement, then parameter by parameter, and in words."""

    judged_by: str = ""
    currents: list[float] = field(default_factory=list)
    errors: list[LevelError] = field(default_factory=list)
    parameters: list[LawChosen] = field(default_factory=list)
    text: list[str] = field(default_factory=list)


class FormTried(Entry):
    """A form of an effect that was fitted.

    Attributes
    ----------
    form, model
        What it is, and the whole model with it.
    parameters
        How many parameters of it act on this model.
    error
        Where bands are left out in turn, in units of the least error of any form fitted there.
    cost
        RMS error over all training data, in the output's unit.
    """

    form: str
    model: str
    parameters: int
    error: float | None
    cost: float | None


class FormChoice(Entry):
    """Choice of the form of an effect: the bands of a channel left out, the forms tried, and in words."""

    channel: str
    bands: list[tuple[float, float]] = field(default_factory=list)
    chosen: str
    tried: list[FormTried] = field(default_factory=list)
    text: list[str] = field(default_factory=list)


class FitDependence(Entry):
    """Dependence of a fit's parameters on current: an order by parameter, between two currents in A."""

    orders: dict[str, int | str]
    low: float
    high: float


class Fit(Document):
    """Result of a fit, the content of fit.json.

    Attributes
    ----------
    law
        Hash of every file, and of every plug-in, by which the parameters are a law; a fit of an older mrfit has none.
    skipped, outdated
        Of the run: whether it was there already; what is no longer as it was fitted.
    """

    schema: str = "mrfit/fit/1"
    name: str
    model: str
    optimizer: str
    per: str = "condition"
    seed: int | None = None
    key: str = ""
    code: str = ""
    data_sha256: str = ""
    segments_sha256: str = sparse("")
    law: dict[str, str] = sparse(dict)
    versions: dict[str, str] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)
    current_dependence: FitDependence | None = None
    current_choice: CurrentChoice | None = None
    form_choice: FormChoice | None = None
    output: str
    inputs: list[str] = field(default_factory=list)
    equation: str = ""
    reference: str = ""
    results: list[Result]
    metrics: list[MetricRow]
    warnings: list[Caution] = field(default_factory=list)
    skipped: bool = told(False)
    outdated: list[str] = told(list)

    @field_validator("settings")
    @classmethod
    def _changes(cls, settings: object) -> object:
        # as JSON, whose lists may be tuples
        of_json(Changes, json.dumps(settings))
        return settings

    @model_validator(mode="after")
    def _judged(self) -> Self:
        if self.metrics and not any(m.condition == "all" for m in self.metrics):
            raise ValueError("metrics: there is no row over all conditions")
        return self

    @property
    def unit(self) -> str:
        """SI unit of the output."""
        return unit_of(self.output)

    def rows(self, role: str) -> list[MetricRow]:
        """Return a role's rows, one per condition, without the pooled one."""
        return [m for m in self.metrics if m.role == role and m.condition != "all"]

    def pooled(self, role: str) -> MetricRow | None:
        """Return the row over all conditions of a role, None if the role has no data."""
        return next((m for m in self.metrics if m.role == role and m.condition == "all"), None)


class PartialFit(Document):
    """A finished search of an unfinished fit."""

    key: str
    condition: str = ""
    found: FoundPoint


class FitPreparation(Entry):
    """Preparation of the recordings of a fit, and the coil resistance in Ω by which their flux was found."""

    flux: FluxSettings
    segment: SegmentSettings
    resistance: float | None = None


class SavedFit(Fit):
    """Content of a fit saved by itself: fit.json, and what other logs need that it is to predict."""

    preparation: FitPreparation | None = None
