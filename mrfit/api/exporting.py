"""Export of a fit in memory, as ``mrfit export`` does."""

from collections.abc import Mapping, Sequence

from mrfit.api import drawing
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.export.source import SOURCE_INPUTS, ExportSource, LogStretch, runs, source_of
from mrfit.fit.files import FitOutput
from mrfit.fit.predict import SegmentPrediction
from mrfit.io.schemas.fit import Fit
from mrfit.report.source import OutputSeries
from mrfit.simulate.assembly import Assembly


def source_of_fit(
    fit: Fit,
    assembly: Assembly,
    found: SegmentPrediction | FitOutput | None,
    logs: Sequence[Recording] = (),
    condition: str = "",
    without: Sequence[str] = (),
) -> ExportSource:
    """Return the source of a fit in memory, with what it makes of logs where that is at hand.

    Parameters
    ----------
    fit, assembly
        The fit and its model.
    found
        Simulated outputs of logs, or of those that were fitted.
    logs
        Recordings whose other channels are written too.
    condition, without
        The condition whose parameters are exported, and effects that are left out.
    """
    if found is None:
        return source_of(fit, assembly, [], condition, without)
    by_id = {r.id: r for r in logs}
    raw = {
        s.id: {n: v[s.start : s.stop] for n, v in by_id[s.recording].channels.items()}
        for s in found.blocks.segments
        if s.recording in by_id
    }
    series = drawing.series_of(found.blocks, found.simulated, assembly)
    stretches = [t for s in series for t in _stretches(s, raw.get(s.segment, {}))]
    return source_of(fit, assembly, stretches, condition, without)


def _stretches(series: OutputSeries, raw: Mapping[str, Array]) -> list[LogStretch]:
    whole = {n: v for n, v in raw.items() if len(v) == len(series.time)}
    found = []
    for run, dt in runs(series.time):
        inputs = {n: v[run] for n, v in series.inputs.items() if n not in SOURCE_INPUTS}
        own = {n: v[run] for n, v in whole.items()}
        measured, simulated = series.measured[run], series.simulated[run]
        found.append(LogStretch(series.segment, series.condition, series.role, dt, inputs, measured, simulated, own))
    return found
