"""Fit a model to recordings in memory; the result, saved and read again.

Export of a fit in memory, as ``mrfit export`` does.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mrfit.flux.stage
import mrfit.segment.stage
from mrfit.api import drawing
from mrfit.api.options import check_names, settings_of, with_options
from mrfit.api.prediction import Prediction, predicted
from mrfit.api.preparing import STAGE_SETTINGS, Preparation, as_asked, prepared
from mrfit.api.recordings import PathText, several
from mrfit.api.threads import one_blas_thread
from mrfit.api.words import Caution, PrintableResult, errors_of, frame_of, parameters_of
from mrfit.core.arguments import check_arguments
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.export.source import SOURCE_INPUTS, ExportSource, LogStretch, runs, source_of
from mrfit.fit import stage as fit_stage
from mrfit.fit.extrapolation import together
from mrfit.fit.files import FitOutput, read_fit_json
from mrfit.fit.predict import SegmentPrediction, stretch_of
from mrfit.fit.proof import check_simulated
from mrfit.io.bars import Heard, shown
from mrfit.io.outdated import law_reason, remedy
from mrfit.io.schemas.fit import Fit, FitPreparation, SavedFit
from mrfit.io.schemas.stages import FluxSettings, SegmentSettings
from mrfit.io.workspace import plain, write_json
from mrfit.report.source import OutputSeries
from mrfit.settings.export import Settings as ExportSettings
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.current_levels import assembly_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from mrfit.export.stage import ExportedFiles


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


FIT_COLUMNS = ("parameter", "condition", "value", "unit", "low", "high", "bound_low", "bound_high", "at_bound")
# Sets of parameters that are printed in full
FEW_SETS = 3


@dataclass(frozen=True, repr=False, eq=False)
class FitResult(PrintableResult):
    """Result of a fit.

    Attributes
    ----------
    content
        Content of fit.json, all there is to say.
    preparation
        How its recordings were prepared.
    fitted
        Simulated outputs, for figures; None where the fit was read from a file.
    """

    content: Fit
    preparation: Preparation = field(default_factory=Preparation)
    fitted: FitOutput | None = None

    @property
    def name(self) -> str:
        """Name of the fit."""
        return self.content.name

    @property
    def model(self) -> str:
        """Model as it was asked for."""
        return self.content.model

    @property
    def output(self) -> str:
        """Channel the model predicts."""
        return self.content.output

    @property
    def params(self) -> "DataFrame":
        """Parameters and derived quantities by name, SI, with 95 % intervals ``low`` to ``high``; nan where open.

        A fit of conditions has a row of each name for every condition.
        """
        rows = [
            {"parameter": p.name, "condition": result.condition, "derived": derived, **asdict(p)}
            for result in self.content.results
            for derived, some in ((False, result.parameters), (True, result.derived))
            for p in some
        ]
        return frame_of(rows, (*FIT_COLUMNS, "determined", "identifiable", "fixed", "derived", "text"), "parameter")

    @property
    def metrics(self) -> "DataFrame":
        """Errors of every condition and role, and of ``all`` conditions together, SI."""
        return frame_of([asdict(m) for m in self.content.metrics], self.content.metrics[0].written())

    @property
    def success(self) -> bool:
        """Whether every search ended before its evaluations or its time."""
        return not any(r.budget_spent for r in self.content.results)

    @property
    def message(self) -> str:
        """Reason why the searches ended."""
        told = {r.condition: r.stopped for r in self.content.results}
        return next(iter(told.values())) if len(told) == 1 else "; ".join(f"{c}: {text}" for c, text in told.items())

    @property
    def nfev(self) -> int:
        """Evaluations: parameter vectors that were simulated."""
        return sum(r.evaluations for r in self.content.results)

    @property
    def warnings(self) -> tuple[Caution, ...]:
        """Reasons to distrust the fit."""
        whole = [Caution(w.kind, w.text) for w in self.content.warnings]
        unstated = "" if self.content.law else "an older mrfit's, which does not state the code of its law"
        if why := law_reason(self.content) or unstated:
            whole.append(Caution("outdated", f"{why}: {remedy(why)}"))
        own = [Caution(w.kind, w.text, r.condition) for r in self.content.results for w in r.warnings]
        return (*whole, *own)

    @check_arguments
    def predict(
        self,
        recordings: Recording | Iterable[Recording],
        *,
        resistance: float | str | None = None,
        progress: Heard = True,
    ) -> Prediction:
        """Simulate the model on other recordings, as ``mrfit predict`` does; see ``mrfit.predict``."""
        how = self.preparation.to_predict(resistance)
        return predicted(self.content, self.assembly, recordings, how, progress, self.extents)

    @property
    def assembly(self) -> Assembly:
        """The model as it was fitted; a DataError where the code of its law has changed since."""
        model = assembly_of(self.content)
        if self.fitted:
            check_simulated(self.content, model, self.fitted.blocks.parts, self.fitted.simulated)
        return model

    @property
    def extents(self) -> dict[str, tuple[float, float]]:
        """Least and greatest value of every channel during the fit; empty for one that was read from a file."""
        made = self.fitted
        if made is None:
            return {}
        names = made.assembly.spec.inputs
        parts = [p for p in made.blocks.parts if p.segment.role == "train"]
        return together(
            stretch_of(p.segment, p.dt, {name: p.block.inputs(row) for row, name in enumerate(names)}).extents()
            for p in parts
        )

    @check_arguments
    def plot(self, kind: drawing.Kind = "loop", page: int = 0) -> "Figure":
        """Return a figure: ``loop``, ``time-history`` or ``residual``; ``page`` where there are over 12 conditions.

        Raises
        ------
        DataError
            If the fit was read from a file, which holds no data.
        """
        made = self.fitted
        series = drawing.series_of(made.blocks, made.simulated, made.assembly) if made else []
        return drawing.plot(self.content, series, kind, page)

    def to_json(self) -> dict[str, Any]:
        """Return the content of fit.json and the preparation of the recordings, as ``save`` writes them."""
        saved: dict[str, Any] = plain(self._saved)
        return saved

    @check_arguments
    def save(self, path: PathText) -> None:
        """Write the fit as a file that ``mrfit.load`` reads.

        Raises
        ------
        DataError
            If the file cannot be written.
        """
        write_json(Path(path), self._saved)

    @property
    def _saved(self) -> SavedFit:
        own = {f.name: getattr(self.content, f.name) for f in fields(Fit)}
        how = self.preparation
        flux, segment = FluxSettings(**asdict(how.flux)), SegmentSettings(**asdict(how.segment))
        return SavedFit(**own, preparation=FitPreparation(flux=flux, segment=segment, resistance=how.resistance))

    @check_arguments
    def export(
        self,
        folder: PathText,
        *,
        to: str | Sequence[str],
        recordings: Recording | Iterable[Recording] | None = None,
        condition: str = "",
        without: str | Sequence[str] = (),
        **options: object,
    ) -> "ExportedFiles":
        """Write the fitted model as C, FMU, JSON …, as ``mrfit export`` does, and return what was written.

        Parameters
        ----------
        folder
            Where to.
        to
            ``c``, ``fmu``, ``json``, ``lookup``, ``matlab``, ``modelica``, ``ssv``, or several of them.
        recordings
            Logs that say where the model holds, of a fit that was read from a file.
        condition
            Whose parameters, of a fit with several sets.
        without
            Effects to leave out.
        **options
            Those of ``mrfit export``, see below.

        Raises
        ------
        ConfigError
            If a format or an option is wrong, or a program is missing.
        DataError
            If the model has no form in a format.
        """
        from mrfit.export import stage

        check_names((ExportSettings,), options)
        settings = settings_of(ExportSettings, options)
        formats = [to] if isinstance(to, str) else list(to)
        stage.check(formats)
        left_out = [without] if isinstance(without, str) else list(without)
        return stage.run(self.source(recordings, condition, left_out), formats, Path(folder), settings)

    def source(
        self,
        recordings: Recording | Iterable[Recording] | None = None,
        condition: str = "",
        without: Sequence[str] = (),
    ) -> ExportSource:
        """Return the content of an export, with logs, or with those of the fit where they are at hand."""
        logs = [] if recordings is None else list(several(recordings))
        found = self.fitted if recordings is None else self.predict(logs).found
        return source_of_fit(self.content, self.assembly, found, logs, condition, without)

    def _parts(self) -> "tuple[str, list[DataFrame], list[object]]":
        title = f"{self.model} by {self.content.optimizer}, seed {self.content.seed}; errors of {self.output}"
        errors = errors_of(self.content, [m for m in self.content.metrics if m.condition == "all"])
        results, more = self.content.results, list[object]()
        if len(results) > FEW_SETS:
            more = [f"{len(results)} sets of parameters, of which the first is shown: params has all"]
            results = results[:1]
        return title, [errors, *map(parameters_of, results)], [*more, *self.warnings]


@check_arguments
def fit(
    recordings: Recording | Iterable[Recording], model: str, *, progress: Heard = True, **options: object
) -> FitResult:
    """Fit a model to recordings, as ``mrfit fit`` does, without a workspace.

    Parameters
    ----------
    recordings
        One or several, of ``mrfit.read``, ``Recording.from_frame`` or ``Recording.from_arrays``.
    model
        Name of a model, of ``mrfit.models()``, with effects as in ``boucwen-flux+eddy-current``.
    progress
        Whether to show a bar in a notebook and on a terminal, or a function called as ``progress(what, done, total)``.
    **options
        Those of ``mrfit fit``, ``mrfit flux`` and ``mrfit segment``, see below.

    Raises
    ------
    ConfigError
        If a name or an option is wrong.
    DataError
        If the recordings lack what the model needs, or no segment is found.

    Examples
    --------
    >>> import mrfit, numpy as np
    >>> phase = 2 * np.pi * 2 * np.arange(4000) / 1000
    >>> x, v = 0.01 * np.sin(phase), 0.04 * np.pi * np.cos(phase)
    >>> force = 300 * np.tanh(v / 0.02) + 900 * v
    >>> log = mrfit.Recording.from_arrays(dt=1e-3, displacement=x, velocity=v, force=force)
    >>> found = mrfit.fit(log, model="tanh")
    >>> found.params.loc[["fy", "a1", "c"], "value"].round(2).to_dict()
    {'fy': 300.0, 'a1': 50.0, 'c': 900.0}
    """
    check_names((fit_stage.Settings, *STAGE_SETTINGS), options)
    settings = settings_of(fit_stage.Settings, options, model=model)
    fit_stage.check(settings)
    with one_blas_thread(), shown(progress) as told:
        made = prepared(recordings, as_asked(options), told)
        fitted = fit_stage.identify(made.dataset, settings, fit_stage.origin_of(made.dataset, settings), told)
    return FitResult(fitted.content, made.preparation, fitted)


@check_arguments
def predict(
    fit: FitResult,
    recordings: Recording | Iterable[Recording],
    *,
    resistance: float | str | None = None,
    progress: Heard = True,
) -> Prediction:
    """Simulate a fitted model on other recordings, as ``mrfit predict`` does; the same as ``fit.predict(recordings)``.

    Parameters
    ----------
    fit
        The fit.
    recordings
        One or several.
    resistance
        Their coil resistance in Ω, ``auto`` to estimate it; default: their own, else that of the fit.
    progress
        Whether to show a bar in a notebook and on a terminal, or a function called as ``progress(what, done, total)``.

    Raises
    ------
    DataError
        If every recording lacks a channel that the model needs.
    """
    return fit.predict(recordings, resistance=resistance, progress=progress)


def load(path: PathText) -> FitResult:
    """Return a fit that ``FitResult.save`` or the command ``mrfit fit`` wrote (``fits/NAME/fit.json``).

    Of a file that the command wrote the coil resistance is not known: logs that state none have it estimated.

    Raises
    ------
    DataError
        If there is no such file, it is damaged, or of an unknown schema.
    """
    content = read_fit_json(Path(path), SavedFit)
    if content is None:
        raise DataError(f"{path}: no such file; write one by fit.save(path)")
    fit = Fit(**{f.name: getattr(content, f.name) for f in fields(Fit)})
    return FitResult(fit, _preparation(content.preparation) if content.preparation else Preparation())


def _preparation(how: FitPreparation) -> Preparation:
    flux = mrfit.flux.stage.Settings(**asdict(how.flux))
    return Preparation(flux, mrfit.segment.stage.Settings(**asdict(how.segment)), how.resistance)


with_options(fit, (fit_stage.Settings, *STAGE_SETTINGS), ("model",))
with_options(FitResult.export, (ExportSettings,), ())
