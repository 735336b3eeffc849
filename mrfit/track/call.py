"""Parameters of a fit that follow logs, from Python: estimates, block-wise refits, files."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mrfit.api.fitting import FitResult
from mrfit.api.recordings import PathText, several
from mrfit.apply.motion import moving_stretch
from mrfit.core.arguments import check_arguments
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.export.source import ExportSource
from mrfit.export.tracker import TrackerPlan, plan_of
from mrfit.io.schemas.track import TrackedLog, TrackedValue, TracksFile
from mrfit.io.tables import write_table
from mrfit.io.workspace import checked, write_json, write_text
from mrfit.segment.stuck import stuck_stretches
from mrfit.signal.clipping import clipped
from mrfit.signal.smoothing import TIME_CHANNEL, smooth
from mrfit.track.page import page_of
from mrfit.track.run import BlockRefits, ParameterTrack, track_log

if TYPE_CHECKING:
    from pandas import DataFrame

# Blocks of a log that are refitted, each by itself
_BLOCKS = 24


@dataclass(frozen=True, repr=False, eq=False)
class ParameterTracks:
    """Parameters along logs.

    Attributes
    ----------
    content
        Content of the JSON file, all there is to say in numbers.
    tracks
        Log -> parameters at every sample.
    blocks
        Log -> refits of its blocks.
    """

    content: TracksFile
    tracks: dict[str, ParameterTrack]
    blocks: dict[str, BlockRefits]

    @check_arguments
    def frame(self, log: str) -> "DataFrame":
        """Return time, estimates and standard deviations (``NAME_sd``) of a log, innovation, and whether it moved."""
        from pandas import DataFrame

        return DataFrame(columns_of(self.tracks[log]))

    @check_arguments
    def save(self, folder: PathText, name: str = "track-parameters") -> TracksFile:
        """Write page, JSON file, and a table for every log, ``NAME-LOG.parquet``."""
        root, page = Path(folder), f"{name}.html"
        root.mkdir(parents=True, exist_ok=True)
        for log, track in self.tracks.items():
            write_table(root / table_name(name, log), columns_of(track))
        write_text(root / page, page_of(self.content, self.tracks, self.blocks, f"{name}.json"))
        write_json(root / f"{name}.json", self.content)
        return replace(self.content, page=str(root / page))

    def __repr__(self) -> str:
        return f"<ParameterTracks of {self.content.fit}: {', '.join(self.tracks)}>"


@check_arguments
def track(fit: FitResult, recordings: Recording | Iterable[Recording], parameters: Sequence[str]) -> ParameterTracks:
    """Track parameters of a fit along logs, as ``mrfit track-parameters`` does.

    Parameters
    ----------
    fit
        With one set of parameters.
    recordings
        Logs with the inputs and the output of the model.
    parameters
        Names, as ``["fy", "c"]``.

    Raises
    ------
    ConfigError
        If a parameter is not there or cannot be tracked, or the fit has several sets of parameters.
    DataError
        If a log lacks a channel.

    Examples
    --------
    >>> import mrfit, numpy as np
    >>> t = np.arange(6000) / 1000
    >>> x, v = 0.01 * np.sin(12 * t), 0.12 * np.cos(12 * t)
    >>> def log(fy):
    ...     force = fy * np.tanh(v / 0.02) + 900 * v + 5 * np.random.default_rng(1).standard_normal(6000)
    ...     return mrfit.Recording.from_arrays(dt=1e-3, displacement=x, velocity=v, force=force)
    >>> found = mrfit.track(mrfit.fit(log(300), model="tanh"), log(300 + 60 * (t > 3)), ["fy"])
    >>> bool(abs(found.content.logs[0].parameters[0].end - 360) < 3)
    True
    """
    return tracked(fit.source(), several(recordings), parameters)


def tracked(source: ExportSource, recordings: Iterable[Recording], parameters: Sequence[str]) -> ParameterTracks:
    """Track parameters of the source of a fit along logs; see ``track``."""
    plan = plan_of(source, parameters)
    tracks, blocks, logs = dict[str, ParameterTrack](), dict[str, BlockRefits](), list[TrackedLog]()
    for recording in recordings:
        drive, measured = _signals(source, recording)
        channels = dict(zip(source.spec.inputs, drive, strict=True))
        found = track_log(source, plan, channels, measured, recording.dt)
        own = _refits(source, plan, drive, measured, recording.dt)
        # on the log's own clock, so that parts of one follow each other
        tracks[recording.id] = replace(found, time=found.time + recording.start)
        blocks[recording.id] = replace(own, time=own.time + recording.start)
        logs.append(_in_numbers(recording, found, own))
    content = TracksFile(
        fit=source.name,
        model=source.assembly.name,
        output=source.spec.output,
        noise=plan.deviation,
        correlated=plan.correlated,
        logs=logs,
    )
    return ParameterTracks(checked(content), tracks, blocks)


def table_name(name: str, log: str) -> str:
    """Return the file name of the table of a log, beside the page of this name."""
    return f"{name}-{log}.parquet"


def columns_of(track: ParameterTrack) -> dict[str, Array]:
    """Return a track as columns."""
    names = [p.name for p in track.plan.parameters]
    columns = {"time": track.time, **dict(zip(names, track.values.T, strict=True))}
    columns |= {f"{n}_sd": d for n, d in zip(names, track.deviations.T, strict=True)}
    return columns | {"innovation": track.innovations, "moves": track.moves.astype(np.float64), "filter": track.chosen}


def _signals(source: ExportSource, recording: Recording) -> tuple[Array, Array]:
    """Return inputs (C, N) of a whole log, smoothed as before a fit, and the measured output (N,).

    The output is nan where it was clipped or a channel was stuck: there the parameters are held.

    Raises
    ------
    DataError
        If the output was not measured, or there is no motion.
    """
    if source.spec.output not in recording.channels:
        name = recording.source or recording.id
        raise DataError(f"{name}: no channel '{source.spec.output}' to track parameters by")
    whole = replace(moving_stretch(recording), start=0, stop=recording.samples, warm_up=0, frequency=0.0, cycles=0)
    names = [n for n in source.spec.inputs if n != TIME_CHANNEL]
    drive = dict(zip(names, smooth(recording, whole, names).values, strict=True))
    time = np.arange(recording.samples) * recording.dt
    rows = np.stack([np.asarray(drive.get(n, time)) for n in source.spec.inputs])
    measured = np.array(recording.channels[source.spec.output], dtype=np.float64)
    measured[clipped(recording, whole, source.spec.output)] = np.nan
    for fault in stuck_stretches(recording):
        measured[fault.rows] = np.nan
    return rows, measured


def _refits(source: ExportSource, plan: TrackerPlan, drive: Array, measured: Array, dt: float) -> BlockRefits:
    """Return refits of blocks by least squares of the linearised output, exact where it is linear in the parameters."""
    changed = [source.theta]
    for p in plan.parameters:
        theta, places = source.theta.copy(), list(p.places)
        step = p.difference * p.deviation
        theta[places] = theta[places] * (1.0 + step) if p.factor else theta[places] + step
        changed.append(theta)
    outputs = source.assembly.simulate(np.ascontiguousarray(drive), np.array(changed), dt)
    steps = plan.column("difference") * plan.column("deviation")
    rows, error = (outputs[1:] - outputs[0]).T / steps, measured - outputs[0]
    good = np.isfinite(error) & (plan.moves(source.spec.inputs, drive) > 0)
    start, spans = plan.column("value"), plan.column("span")
    white = plan.deviation**2 * max(1.0, plan.correlated / dt)
    times, values, deviations = list[float](), list[Array](), list[Array]()
    for part in np.array_split(np.arange(len(error)), _BLOCKS):
        own = part[good[part]]
        scaled = rows[own] * spans
        information = scaled.T @ scaled
        times.append(float(part.mean()) * dt)
        if len(own) > len(spans) and np.linalg.cond(information) < 1e10:
            values.append(start + spans * np.linalg.solve(information, scaled.T @ error[own]))
            deviations.append(spans * np.sqrt(white * np.diag(np.linalg.inv(information))))
        else:
            values.append(np.full(len(spans), np.nan))
            deviations.append(np.full(len(spans), np.nan))
    return BlockRefits(np.array(times), np.array(values), np.array(deviations))


def _in_numbers(recording: Recording, found: ParameterTrack, blocks: BlockRefits) -> TrackedLog:
    moved = found.moves > 0
    rows = [
        TrackedValue(
            name=p.name,
            unit=p.unit,
            factor=p.factor,
            fit=p.value,
            fit_deviation=float(np.hypot(p.deviation, np.sqrt(found.plan.held[k, k]))),
            least=float(found.values[:, k].min()),
            greatest=float(found.values[:, k].max()),
            end=float(found.values[-1, k]),
            end_deviation=float(found.deviations[-1, k]),
            block=_known(blocks.values[-1, k]),
            block_deviation=_known(blocks.deviations[-1, k]),
        )
        for k, p in enumerate(found.plan.parameters)
    ]
    own = found.innovations[moved & np.isfinite(found.innovations)]
    return TrackedLog(
        recording=recording.id,
        samples=len(found.time),
        dt=recording.dt,
        moved=float(np.mean(moved)),
        moving=float(np.mean(found.chosen > 0)),
        innovation=float(np.sqrt(np.mean(own**2))) if len(own) else 0.0,
        parameters=rows,
    )


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
