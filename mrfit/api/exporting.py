"""Export of a fit in memory, as ``mrfit export`` does."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from mrfit.api import drawing
from mrfit.api.recordings import several
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.export.source import SOURCE_INPUTS, ExportSource, LogStretch, runs, source_of
from mrfit.report.source import OutputSeries

if TYPE_CHECKING:
    from mrfit.api.fitting import FitResult


def source_of_result(
    result: "FitResult",
    recordings: Recording | Iterable[Recording] | None = None,
    condition: str = "",
    without: Sequence[str] = (),
) -> ExportSource:
    """Return the source of a fit in memory, with logs, or with those of the fit where they are at hand."""
    assembly = result.assembly
    if recordings is not None:
        logs = list(several(recordings))
        found = result.predict(logs).found
        series = drawing.series_of(found.blocks, found.simulated, assembly)
        places = {s.id: s for s in found.blocks.segments}
        by_id = {r.id: r for r in logs}
        raw = {
            i: {n: v[s.start : s.stop] for n, v in by_id[s.recording].channels.items()}
            for i, s in places.items()
            if s.recording in by_id
        }
    elif result.fitted is not None:
        fitted = result.fitted
        series, raw = drawing.series_of(fitted.blocks, fitted.simulated, fitted.assembly), {}
    else:
        series, raw = [], {}
    stretches = [t for s in series for t in _stretches(s, raw.get(s.segment, {}))]
    return source_of(result.content, assembly, stretches, condition, without)


def _stretches(series: OutputSeries, raw: Mapping[str, Array]) -> list[LogStretch]:
    whole = {n: v for n, v in raw.items() if len(v) == len(series.time)}
    found = []
    for run, dt in runs(series.time):
        inputs = {n: v[run] for n, v in series.inputs.items() if n not in SOURCE_INPUTS}
        own = {n: v[run] for n, v in whole.items()}
        measured, simulated = series.measured[run], series.simulated[run]
        found.append(LogStretch(series.segment, series.condition, series.role, dt, inputs, measured, simulated, own))
    return found
