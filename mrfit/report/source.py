"""What the earlier stages left in the workspace, checked as it is read: fits, series, logs, flux, segments."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ValidationError

from mrfit.channels import unit_of
from mrfit.errors import DataError
from mrfit.report.numbers import natural
from mrfit.specs import Array
from mrfit.store import Workspace, read_json


class Quantity(BaseModel):
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


class Conditioning(BaseModel):
    """How many directions of the parameter space the data determine, and the ones they do not."""

    rank: int
    parameters: int
    null_directions: list[dict[str, float]] = []


class Passivity(BaseModel):
    """Work per cycle taken in by the model on one periodic segment."""

    condition: str
    loop_area: float | None
    unit: str = "J"
    passive: bool


class Caution(BaseModel):
    """A reason to distrust a result."""

    kind: str
    text: str


class SegmentUse(BaseModel):
    """How a segment entered a fit."""

    id: str
    condition: str
    role: str
    drive: str = ""
    offset: float | None = None
    noise_floor: float | None = None
    noise_floor_method: str = ""
    noise_floor_bounds: tuple[float | None, float | None] = (None, None)


class Result(BaseModel):
    """One set of parameters and the search that found it."""

    condition: str
    conditions: list[str] = []
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


class CurrentChoice(BaseModel):
    """How parameters were made to depend on current, in words: how it was judged, then parameter by parameter."""

    text: list[str] = []


class MetricRow(BaseModel):
    """Errors of one condition and role, or of all conditions of a role; None where a measure is undefined."""

    condition: str
    role: str
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


class Fit(BaseModel):
    """Content of fit.json, conditions in natural order."""

    name: str
    model: str
    optimizer: str
    per: str = "condition"
    seed: int | None = None
    key: str = ""
    data_sha256: str = ""
    versions: dict[str, str] = {}
    settings: dict[str, Any] = {}
    output: str
    inputs: list[str] = []
    equation: str = ""
    reference: str = ""
    current_choice: CurrentChoice | None = None
    results: list[Result]
    metrics: list[MetricRow]
    warnings: list[Caution] = []

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

    def model_post_init(self, context: Any) -> None:
        """Put conditions in natural order, pooled rows last in their role."""
        order = {"train": 0, "holdout": 1}
        self.results.sort(key=lambda r: natural(r.condition))
        self.metrics.sort(key=lambda m: (order.get(m.role, 2), m.condition == "all", natural(m.condition)))


@dataclass(frozen=True)
class Series:
    """Measured and simulated output of one segment part.

    Attributes
    ----------
    condition, segment, role
        Where it belongs.
    time
        Seconds from the part's first sample, shape (N,).
    measured, simulated
        Output, SI, shape (N,).
    inputs
        The model's input channels by name, SI, shape (N,).
    frequency
        Fundamental frequency in Hz, 0 where there is none.
    """

    condition: str
    segment: str
    role: str
    time: Array
    measured: Array
    simulated: Array
    inputs: dict[str, Array]
    frequency: float = 0.0

    @cached_property
    def error(self) -> float:
        """RMS residual."""
        return float(np.sqrt(np.mean((self.measured - self.simulated) ** 2)))


@dataclass(frozen=True)
class Source:
    """All that a report is made of; ``outdated`` names the fits that were made from other data than are here now."""

    fits: list[Fit]
    series: dict[str, list[Series]]
    ingest: dict[str, Any]
    flux: dict[str, Any]
    segments: list[dict[str, Any]]
    outdated: list[str] = field(default_factory=list)


def read_source(workspace: Workspace, names: tuple[str, ...]) -> Source:
    """Return the named fits (all finished ones if none is named) and what they were made of.

    Raises
    ------
    DataError
        If there is no fit, none of that name, or a file is damaged.
    """
    fits = [_read_fit(workspace, n) for n in fit_names(workspace, names)]
    segments = _segments(workspace)
    frequencies = {s["id"]: float(s["frequency"] or 0.0) for s in segments}
    series = {f.name: _read_series(workspace.fit_folder(f.name) / "residuals.parquet", frequencies) for f in fits}
    ingest, flux = read_json(workspace.ingest_json) or {}, read_json(workspace.flux_json) or {}
    # a fit.json without a key does not say what it was made from
    outdated = workspace.outdated([f.model_dump(include={"name", "key", "settings"}) for f in fits if f.key])
    return Source(fits, series, ingest, flux, segments, outdated)


def fit_names(workspace: Workspace, names: tuple[str, ...]) -> list[str]:
    """Return the fits to report, each once, in the order named.

    Raises
    ------
    DataError
        If there is no finished fit, or none of a name given; the message lists those there are.
    """
    there = workspace.fit_names()
    if not there:
        raise DataError(
            f"{workspace.root}: no fit to report; run `mrfit fit --model NAME --work {workspace.root}` first"
        )
    for name in names:
        if name not in there:
            raise DataError(f"{workspace.root}: no fit named '{name}'; choose from {', '.join(there)}")
    return list(dict.fromkeys(names)) or there


def input_files(workspace: Workspace, names: list[str]) -> list[Path]:
    """Return every file the report of these fits depends on, those that exist."""
    folders = [workspace.fit_folder(n) for n in names]
    files = [f / name for f in folders for name in ("fit.json", "residuals.parquet")]
    return [p for p in [*files, workspace.ingest_json, workspace.flux_json, workspace.segments_file] if p.is_file()]


def _read_fit(workspace: Workspace, name: str) -> Fit:
    path = workspace.fit_folder(name) / "fit.json"
    content = read_json(path)
    if not isinstance(content, dict):
        raise DataError(f"{path}: damaged, no JSON that can be read; delete it and run `mrfit fit` again")
    try:
        fit = Fit.model_validate({**content, "name": name})
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(p) for p in first["loc"])
        raise DataError(f"{path}: {place}: {first['msg'].lower()}; delete it and run `mrfit fit` again") from error
    if not fit.results or not fit.metrics:
        raise DataError(f"{path}: holds no result; delete it and run `mrfit fit` again")
    return fit


def _read_series(path: Path, frequencies: dict[str, float]) -> list[Series]:
    import pandas as pd

    try:
        frame = pd.read_parquet(path)
        parts = frame.groupby(["condition", "segment", "role"], sort=False)
        return [_one_series(str(c), str(s), str(r), part, frequencies) for (c, s, r), part in parts]
    except (OSError, ValueError, KeyError) as error:
        reason = str(error).splitlines()[0]
        raise DataError(f"{path}: cannot be read ({reason}); delete its folder and run `mrfit fit` again") from error


def _one_series(condition: str, segment: str, role: str, part: Any, frequencies: dict[str, float]) -> Series:
    columns = {str(c): part[c].to_numpy(np.float64) for c in part.columns[3:]}
    time, measured, simulated = (columns.pop(c) for c in ("time", "measured", "simulated"))
    return Series(condition, segment, role, time, measured, simulated, columns, frequencies.get(segment, 0.0))


def _segments(workspace: Workspace) -> list[dict[str, Any]]:
    from dataclasses import asdict

    if not workspace.segments_file.is_file():
        return []
    return [asdict(s) for s in workspace.read_segments()[0]]
