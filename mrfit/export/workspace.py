"""A fit of a workspace with its logs, as they are exported."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.export.source import SOURCE_INPUTS, LogStretch, runs
from mrfit.fit.predict import read_fit
from mrfit.io.arrow import codes, floats
from mrfit.io.schemas.fit import Fit
from mrfit.io.unreadable import reading
from mrfit.io.workspace import Workspace
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.current_levels import assembly_of


@dataclass(frozen=True)
class FitAndLogs:
    """A fit's content, its model, its logs."""

    content: Fit
    assembly: Assembly
    stretches: tuple[LogStretch, ...]


def read_fit_and_logs(workspace: Workspace, name: str) -> FitAndLogs:
    """Return a named fit and the segments it was made from.

    Raises
    ------
    DataError
        If there is no such fit, or a file of it is damaged.
    """
    content = read_fit(workspace, name, compare=True)
    assembly = assembly_of(content)
    return FitAndLogs(content, assembly, _stretches(workspace, name, assembly))


def _stretches(workspace: Workspace, name: str, assembly: Assembly) -> tuple[LogStretch, ...]:
    import pyarrow.parquet as parquet

    path = workspace.fit_folder(name) / "residuals.parquet"
    if not path.is_file():
        return ()
    with reading(path, "delete the fit's folder and run `mrfit fit` again"):
        whole = parquet.read_table(path)
        names = ["time", "measured", "simulated", *assembly.spec.inputs]
        if missing := [n for n in names if n not in whole.column_names]:
            raise DataError(f"{path}: lacks the column {missing[0]}; run `mrfit fit` again")
        segments = {s.id: s for s in workspace.read_segments()} if workspace.segments_file.is_file() else {}
        found = list[LogStretch]()
        for rows in _blocks(whole):
            columns = {n: floats(rows[n]) for n in names}
            text = {n: str(rows[n][0].as_py()) for n in ("segment", "condition", "role")}
            found += _pieces(columns, text, segments.get(text["segment"]), workspace)
    return tuple(found)


def _blocks(whole: Any) -> list[Any]:
    """Return the rows of each segment and role, in the order in which they stand."""
    import pyarrow.compute as compute

    joined = compute.binary_join_element_wise(whole["segment"], whole["role"], "\n")
    places = codes(joined.combine_chunks().dictionary_encode())
    order = np.argsort(places, kind="stable")
    ends = np.flatnonzero(np.diff(places[order])) + 1
    return [whole.take(rows) for rows in np.split(order, ends) if len(rows)]


def _pieces(
    columns: dict[str, Array], text: dict[str, str], segment: Segment | None, workspace: Workspace
) -> list[LogStretch]:
    time = columns["time"]
    raw = _raw(segment, workspace) if segment else {}
    found = []
    for run, dt in runs(time):
        inputs = {n: v[run] for n, v in columns.items() if n not in ("time", "measured", "simulated", *SOURCE_INPUTS)}
        at = np.rint(time[run] / dt).astype(np.int64)
        own = {n: v[at] for n, v in raw.items() if at[-1] < len(v)}
        measured, simulated = columns["measured"][run], columns["simulated"][run]
        found.append(LogStretch(dt=dt, inputs=inputs, measured=measured, simulated=simulated, raw=own, **text))
    return found


def _raw(segment: Segment, workspace: Workspace) -> dict[str, Array]:
    """Return a segment's channels as recorded, empty where the recording is gone."""
    try:
        recording: Recording = workspace.read_recording(segment.recording)
    except DataError:
        return {}
    return {n: v[segment.start : segment.stop] for n, v in recording.channels.items()}
