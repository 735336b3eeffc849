"""Results of earlier stages in the workspace, checked as they are read: fits, series, logs, flux, segments."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from mrfit.core.channels import INTEGRALS
from mrfit.core.counting import number_of
from mrfit.core.recording import Segment
from mrfit.core.specs import Array, Mask
from mrfit.core.width import Width
from mrfit.errors import DataError
from mrfit.io.memory import check_room
from mrfit.io.outdated import Inputs
from mrfit.io.residuals import RESIDUAL_KEYS, Key, read_residuals, unreadable
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.stages import FluxFile, IngestFile
from mrfit.io.workspace import Workspace
from mrfit.report.numbers import natural


@dataclass(frozen=True)
class OutputSeries:
    """Measured and simulated output of one segment part.

    Attributes
    ----------
    condition, segment, role
        Where it belongs.
    time
        Seconds, shape (N,): from the part's first sample, or of a prediction as the log has them.
    measured, simulated
        Output, SI, shape (N,).
    inputs
        The model's input channels by name, SI, shape (N,).
    frequency
        Fundamental frequency in Hz, 0 where there is none.
    lead
        Samples at its start that are simulated and not judged, while the model settles.
    width
        Half-widths of the bands of a prediction.
    """

    condition: str
    segment: str
    role: str
    time: Array
    measured: Array
    simulated: Array
    inputs: dict[str, Array]
    frequency: float = 0.0
    lead: int = 0
    width: Width | None = None

    @cached_property
    def error(self) -> float:
        """RMS residual of what is judged."""
        return float(np.sqrt(np.mean((self.measured[self.lead :] - self.simulated[self.lead :]) ** 2)))

    @property
    def bands(self) -> dict[str, Array]:
        """Ends of the 95 % bands, of a measured output and for what the parameters leave open; none without."""
        if self.width is None:
            return {}
        ends = {"": self.width.whole, "_parameters": self.width.parameters}
        return {
            f"{side}{name}": self.simulated + sign * half
            for name, half in ends.items()
            for side, sign in (("low", -1.0), ("high", 1.0))
        }

    @property
    def scored(self) -> Mask:
        """Whether each sample is judged, (N,)."""
        return np.arange(len(self.time)) >= self.lead


@dataclass(frozen=True)
class ReportSource:
    """All that a report is made of; ``outdated`` says why fits are out of date, by the names of those that are."""

    fits: list[Fit]
    series: dict[str, list[OutputSeries]]
    ingest: IngestFile | None
    flux: FluxFile | None
    segments: list[Segment]
    outdated: Mapping[str, str] = field(default_factory=dict)


def read_source(workspace: Workspace, names: tuple[str, ...]) -> ReportSource:
    """Return the named fits (all finished ones if none is named) and what they were made of.

    Raises
    ------
    DataError
        If there is no fit, none of that name, or a file is damaged.
    """
    fits = read_fits(workspace, fit_names(workspace, names))
    segments = _segments(workspace)
    frequencies = {s.id: s.frequency for s in segments}
    _check_room(workspace, fits)
    series = {f.name: _read_series(workspace.fit_folder(f.name) / "residuals.parquet", frequencies) for f in fits}
    outdated = Inputs(workspace).of_fits(fits)
    return ReportSource(fits, series, workspace.ingest_file(), workspace.flux_file(), segments, outdated)


def _check_room(workspace: Workspace, fits: list[Fit]) -> None:
    """Check the memory for the samples of all fits; a damaged table is passed over, since reading it says more."""
    import pyarrow.parquet as pq

    size = 0.0
    for fit in fits:
        path = workspace.fit_folder(fit.name) / "residuals.parquet"
        with suppress(OSError, ValueError), pq.ParquetFile(path) as file:
            size += 8.0 * file.metadata.num_rows * (file.metadata.num_columns - len(RESIDUAL_KEYS))
    check_room(f"{workspace.root}: all samples of {number_of('fit', len(fits))}", size)


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


def read_fits(workspace: Workspace, names: Iterable[str]) -> list[Fit]:
    """Return named fits, whether their law and data are those that are here.

    Raises
    ------
    DataError
        If one is damaged, or holds no result.
    """
    return [_read_fit(workspace, name) for name in names]


def _read_fit(workspace: Workspace, name: str) -> Fit:
    fit = workspace.stored_fit(name)
    if fit is None or not fit.results or not fit.metrics:
        path = workspace.fit_folder(name) / "fit.json"
        raise DataError(f"{path}: holds no result; delete it and run `mrfit fit` again")
    return in_order(replace(fit, name=name))


def in_order(fit: Fit) -> Fit:
    """Return a fit, conditions in natural order, pooled rows last in their role."""
    order = {"train": 0, "holdout": 1}
    results = sorted(fit.results, key=lambda r: natural(r.condition))
    metrics = sorted(fit.metrics, key=lambda m: (order.get(m.role, 2), m.condition == "all", natural(m.condition)))
    return replace(fit, results=results, metrics=metrics)


def _read_series(path: Path, frequencies: dict[str, float]) -> list[OutputSeries]:
    parts: dict[Key, dict[str, list[Array]]] = {}
    for key, columns in read_residuals(path):
        own = parts.setdefault(key, {n: [] for n in columns})
        for name, values in columns.items():
            own[name].append(values)
    try:
        return [_one_series(key, found, frequencies) for key, found in parts.items()]
    except (ValueError, KeyError) as error:
        raise unreadable(path, error) from error


def _one_series(key: Key, parts: dict[str, list[Array]], frequencies: dict[str, float]) -> OutputSeries:
    columns = {name: np.concatenate(found) for name, found in parts.items()}
    parts.clear()
    time, measured, simulated = (columns.pop(c) for c in ("time", "measured", "simulated"))
    frequency = frequencies.get(key[1], 0.0)
    return OutputSeries(*key, time, measured, simulated, with_integrals(columns, time, frequency), frequency)


def with_integrals(inputs: dict[str, Array], time: Array, frequency: float) -> dict[str, Array]:
    """Return a model's inputs with the integrals of those that are rates, about their middle, in a periodic test.

    A model of velocity alone is then drawn over displacement too. The mean rate over whole cycles is taken away.
    """
    found = dict(inputs)
    if frequency <= 0.0 or len(time) < 3:
        return found
    step = float(time[1] - time[0])
    cycles = int((time[-1] - time[0] + step) * frequency + 1e-6)
    whole = round(cycles / (frequency * step))
    for name, rate in INTEGRALS.items():
        if name not in found and rate in found and 2 < whole <= len(time):
            speed = found[rate] - np.mean(found[rate][:whole])
            steps = 0.5 * step * (speed[1:] + speed[:-1])
            course = np.concatenate([[0.0], np.cumsum(steps)])
            found[name] = course - 0.5 * (course[:whole].max() + course[:whole].min())
    return found


def _segments(workspace: Workspace) -> list[Segment]:
    return workspace.read_segments() if workspace.segments_file.is_file() else []
