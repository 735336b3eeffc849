"""Prediction of other logs by a fitted model."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from mrfit.api import drawing
from mrfit.api.preparing import Preparation, prepared
from mrfit.api.threads import one_blas_thread
from mrfit.api.words import Caution, PrintableResult, errors_of, frame_of
from mrfit.core.arguments import check_arguments
from mrfit.core.recording import Recording
from mrfit.fit import predict as fit_predict
from mrfit.fit.band import promise
from mrfit.io.bars import Heard, shown
from mrfit.io.schemas.fit import Fit, MetricRow
from mrfit.report.source import OutputSeries
from mrfit.simulate.assembly import Assembly

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


@dataclass(frozen=True, repr=False, eq=False)
class Prediction(PrintableResult):
    """Errors of a fitted model on other logs, in free run.

    Attributes
    ----------
    fit
        The fit, as its file has it.
    assembly
        Its model.
    found
        What the model makes of the logs.
    findings
        What was odd about these.
    """

    fit: Fit
    assembly: Assembly
    found: fit_predict.SegmentPrediction
    findings: tuple[str, ...]

    @property
    def metrics(self) -> "DataFrame":
        """Errors of every condition, and of ``all`` together, SI."""
        names = list(MetricRow(condition="", role="predict", samples=0).written())
        return frame_of([asdict(m) for m in self.found.metrics], names)

    @property
    def nrmse(self) -> float:
        """RMS error over all logs as a share of the measured range, nan where the output was not measured."""
        nrmse = self.found.metrics[-1].nrmse if self.found.metrics else None
        return float("nan") if nrmse is None else float(nrmse)

    @property
    def used(self) -> dict[str, str]:
        """For each segment the condition whose parameters were used."""
        return dict(self.found.used)

    @property
    def warnings(self) -> tuple[Caution, ...]:
        """On logs that were left out, and on conditions whose parameters are another's."""
        return tuple(Caution(w.kind, w.text) for w in self.found.warnings)

    def to_frame(self) -> "DataFrame":
        """Return time, measured and simulated output and the model's inputs of every sample, SI.

        Times are those of the logs. A test without cycles is there from its first sample; ``scored`` is False where
        the model settles and errors are not counted. Of logs without the output the measured one is nan.
        """
        from pandas import DataFrame, concat

        frames = [
            DataFrame(
                {"segment": s.segment, "time": s.time, "measured": s.measured, "simulated": s.simulated, **s.inputs}
                | s.bands
                | {"scored": s.scored}
            )
            for s in self._series
        ]
        return concat(frames, ignore_index=True)

    @property
    def band(self) -> "DataFrame":
        """Ends of the 95 % bands of every sample, SI: ``low`` and ``high`` of a measured output.

        ``low_parameters`` and ``high_parameters`` hold the model's own output, for what the parameters leave open.
        """
        names = ("segment", "time", "simulated", "low", "high", "low_parameters", "high_parameters")
        whole = self.to_frame()
        return whole[[n for n in names if n in whole]]

    @property
    def promise(self) -> str:
        """Coverage that the bands promise, with its exceptions, or the reason why there are none."""
        return promise(self.fit, self.found, self.assembly)

    @property
    def coverage(self) -> float:
        """Share of the measured samples that lie within the band, nan where nothing was measured."""
        whole = self.to_frame()
        known = whole[whole["scored"] & whole["measured"].notna()]
        return float(known["measured"].between(known["low"], known["high"]).mean()) if "low" in known else float("nan")

    @cached_property
    def _series(self) -> list[OutputSeries]:
        return drawing.predicted_series(self.fit, self.found, self.assembly)

    @check_arguments
    def plot(self, kind: drawing.Kind = "loop", page: int = 0) -> "Figure":
        """Return a figure: ``loop``, ``time-history`` with its band, or ``residual``; ``page`` where it has several."""
        return drawing.plot(replace(self.fit, metrics=self.found.metrics), self._series, kind, page)

    def _parts(self) -> "tuple[str, list[DataFrame], list[object]]":
        errors = errors_of(replace(self.fit, metrics=self.found.metrics), self.found.metrics)
        said: list[object] = [f"95 % band: {self.promise}", *self.findings, *self.warnings]
        return f"Prediction of {self.fit.output} by {self.fit.name}", [errors], said


def predicted(
    fit: Fit,
    assembly: Assembly,
    recordings: Recording | Iterable[Recording],
    how: Preparation,
    progress: Heard = True,
    trained: Mapping[str, tuple[float, float]] | None = None,
) -> Prediction:
    """Return the prediction of recordings by a fit and its model, made where its channels were within ``trained``."""
    with one_blas_thread(), shown(progress) as told:
        made = prepared(recordings, how, told)
        found = fit_predict.predict(fit, made.dataset, trained)
    return Prediction(fit, assembly, found, made.findings)
