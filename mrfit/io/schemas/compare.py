"""Results of comparisons: models in compare.json, optimizers in optimizers.json."""

from collections.abc import Collection
from dataclasses import field
from typing import Any

from mrfit.io.schemas.fit import Caution
from mrfit.io.schemas.reading import Document, Entry, Number, told


class ModelRow(Entry):
    """A model's fit: free parameters and evaluations of all its sets, kinds of warnings, errors over all conditions."""

    model: str
    fit: str
    output: str
    parameters: int
    evaluations: int
    current_orders: dict[str, int | str]
    warnings: list[str]
    holdout_nrmse: float | None = None
    holdout_fit_percent: float | None = None
    holdout_rmse: float | None = None
    train_nrmse: float | None = None
    train_fit_percent: float | None = None
    train_rmse: float | None = None


class ModelErrors(Entry):
    """Errors of a model's fit on one condition in one role, or over all of a role."""

    model: str
    fit: str = ""
    condition: str
    role: str
    samples: int
    rmse: float | None
    nrmse: float | None
    esr: float | None
    fit_percent: float | None
    noise_floor: float | None


class ModelCaution(Entry):
    """A reason to distrust a model's fit as a whole."""

    model: str
    fit: str = ""
    kind: str
    text: str


class LeftOut(Entry):
    """A model that cannot be fitted, and why."""

    model: str
    reason: str


class ModelsFile(Document):
    """Models on the same data, the best on held-out data first, output by output.

    Attributes
    ----------
    settings
        Of the last comparison; what earlier ones were told otherwise is in the names of their fits.
    seconds, kept, dropped
        Of the run: time of each fit by its name; names of fits of earlier comparisons that stay in the table, and those
        that leave it with the reason.
    """

    schema: str = "mrfit/compare/1"
    settings: dict[str, Any]
    models: list[ModelRow]
    metrics: list[ModelErrors]
    warnings: list[ModelCaution] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    seconds: dict[str, float | None] = told(dict)
    kept: list[str] = told(list)
    dropped: dict[str, str] = told(dict)


class OptimizerRow(Entry):
    """An optimizer on one condition: cost over the seeds (RMS error in ``unit``), median evaluations and seconds.

    Seconds differ from run to run and are in no file that has to be the same bytes every time.
    """

    condition: str
    optimizer: str
    seeds: int
    best: float | None
    median: float | None
    worst: float | None
    evaluations: int
    seconds: float | None = None
    unit: str

    @property
    def absent(self) -> Collection[str]:
        """``seconds`` where there are none."""
        return ("seconds",) if self.seconds is None else ()


class Curve(Entry):
    """Median over the seeds of the best cost so far, against evaluations."""

    condition: str
    optimizer: str
    evaluations: list[Number]
    cost: list[float]


class OptimizersFile(Document):
    """Optimizers on one model from the same starts; ``kept``: those of earlier comparisons, which this run left."""

    schema: str = "mrfit/compare-optimizers/1"
    settings: dict[str, Any]
    rows: list[OptimizerRow]
    curves: list[Curve]
    warnings: list[Caution] = field(default_factory=list)
    key: str = ""
    code: str = ""
    data_sha256: str = ""
    segments_sha256: str = ""
    kept: list[str] = told(list)
