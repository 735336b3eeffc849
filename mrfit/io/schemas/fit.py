"""What fit.json holds, and what is kept of an unfinished fit."""

import json
from typing import Any, Literal, Self

from pydantic import field_validator, model_validator

from mrfit.core.channels import unit_of
from mrfit.io.schemas.reading import Part, Stored
from mrfit.io.schemas.stages import FluxSettings, SegmentSettings


class Quantity(Part):
    """A parameter or derived quantity; ``low`` to ``high`` is its 95 % interval, None where the data leave it open."""

    name: str
    value: float
    unit: str = ""
    low: float | None = None
    high: float | None = None
    bound_low: float | None = None
    bound_high: float | None = None
    at_bound: bool = False
    identifiable: bool = True
    fixed: bool = False
    text: str = ""

    @property
    def bound(self) -> float | None:
        """The bound the value ended at, None if it did not."""
        if not self.at_bound or self.bound_low is None or self.bound_high is None:
            return None
        nearer_low = abs(self.value - self.bound_low) <= abs(self.value - self.bound_high)
        return self.bound_low if nearer_low else self.bound_high


class Conditioning(Part):
    """How many directions of the parameter space the data determine, and the ones they do not."""

    rank: int
    parameters: int
    null_directions: list[dict[str, float]] = []


class Passivity(Part):
    """Work per cycle taken in by the model on one periodic segment."""

    condition: str
    loop_area: float | None
    unit: str = "J"
    passive: bool


class Caution(Part):
    """A reason to distrust a result."""

    kind: str
    text: str


class SegmentUse(Part):
    """How a segment entered a fit."""

    id: str
    condition: str
    role: str
    drive: str = ""
    offset: float | None = None
    noise_floor: float | None = None
    noise_floor_method: str = ""
    noise_floor_bounds: tuple[float | None, float | None] = (None, None)


class Level(Part):
    """The test condition of a result, None where it is not known."""

    frequency: float | None = None
    amplitude: float | None = None
    current: float | None = None


class SearchStage(Part):
    """A stage of a staged search."""

    stage: str
    segments: list[str] = []
    cost: float = 0.0


class Result(Part):
    """One set of parameters and the search that found it."""

    condition: str
    conditions: list[str] = []
    at: Level = Level()
    cost: float | None = None
    evaluations: int
    budget: int | None = None
    stopped: str = ""
    nonfinite: int = 0
    history: list[tuple[float, float | None]] = []
    preliminary: int = 0
    starts: list[float | None] | None = None
    parameters: list[Quantity]
    derived: list[Quantity] = []
    conditioning: Conditioning | None = None
    identifiability: list[str] = []
    passivity: list[Passivity] = []
    warnings: list[Caution] = []
    segments: list[SegmentUse] = []
    stages: list[SearchStage] = []


class MetricRow(Part):
    """Errors of one condition and role, or of all conditions of a role; None where a measure is undefined."""

    condition: str
    role: Literal["train", "holdout"]
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


class Changes(Part):
    """The user's changes to a model's own bounds, start values and fixed parameters, in the settings of a fit."""

    bounds: list[tuple[str, float, float]] = []
    start: list[tuple[str, float]] = []
    fixed: list[tuple[str, float]] = []


class CurrentChoice(Part):
    """How parameters were made to depend on current, in words: how it was judged, then parameter by parameter."""

    text: list[str] = []


class FitDependence(Part):
    """How a fit's parameters depend on current: an order by parameter, between two currents in A."""

    orders: dict[str, int | str]
    low: float
    high: float


class Fit(Stored):
    """Content of fit.json."""

    known = ("mrfit/fit/1",)
    name: str
    model: str
    optimizer: str
    per: str = "condition"
    seed: int | None = None
    key: str = ""
    code: str = ""
    data_sha256: str = ""
    versions: dict[str, str] = {}
    settings: dict[str, Any] = {}
    current_dependence: FitDependence | None = None
    current_choice: CurrentChoice | None = None
    output: str
    inputs: list[str] = []
    equation: str = ""
    reference: str = ""
    results: list[Result]
    metrics: list[MetricRow]
    warnings: list[Caution] = []

    @field_validator("settings")
    @classmethod
    def _changes(cls, settings: dict[str, Any]) -> dict[str, Any]:
        # as JSON, whose lists may be tuples
        Changes.model_validate_json(json.dumps(settings))
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


class FoundPoint(Part):
    """What a search found, as it is kept until the whole fit is written."""

    point: list[float]
    cost: float
    evaluations: int
    budget: int | None
    budget_spent: bool
    out_of_time: bool
    stopped: str
    nonfinite: int
    history: list[tuple[float, float | None]]
    starts: list[float | None] | None
    agreeing: int
    first_nonfinite: dict[str, Any] | list[Any] | str | None
    per_current: list[Any] | dict[str, Any] | None
    stages: list[SearchStage]


class PartialFit(Stored):
    """A finished search of an unfinished fit."""

    key: str
    found: FoundPoint


class FitPreparation(Part):
    """How the recordings of a fit were prepared, and the coil resistance in Ω by which their flux was found."""

    flux: FluxSettings
    segment: SegmentSettings
    resistance: float | None = None


class SavedFit(Fit):
    """Content of a fit saved by itself: fit.json, and what other logs need that it is to predict."""

    preparation: FitPreparation | None = None
