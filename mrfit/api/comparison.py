"""Compare models, or optimizers, on recordings in memory."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, overload

from mrfit.api.fitting import FitResult
from mrfit.api.options import Options, check_names, settings_of, with_options
from mrfit.api.preparing import STAGE_SETTINGS, PreparedSegments, as_asked, prepared
from mrfit.api.threads import one_blas_thread
from mrfit.api.words import PrintableResult, frame_of
from mrfit.compare import optimizers as compare_optimizers
from mrfit.compare import stage as compare_stage
from mrfit.core.arguments import check_arguments
from mrfit.core.progress import Progress
from mrfit.core.recording import Recording
from mrfit.errors import ConfigError
from mrfit.fit import stage as fit_stage
from mrfit.fit.files import FitOutput
from mrfit.io.bars import Heard, shown
from mrfit.io.schemas.compare import ModelsFile, OptimizersFile
from mrfit.io.schemas.fit import Fit
from mrfit.io.workspace import plain

if TYPE_CHECKING:
    from pandas import DataFrame

TABLE = ("model", "output", "parameters", "evaluations", "holdout_nrmse", "holdout_fit_percent")
TRAINING = ("train_nrmse", "train_fit_percent", "seconds")


@dataclass(frozen=True, repr=False, eq=False)
class Comparison(PrintableResult):
    """Models ranked by their error on held-out data, output by output.

    Attributes
    ----------
    content
        Content of compare.json, all there is to say.
    fits
        The fits by model, the best first.
    seconds
        Time that each fit took, by model.
    """

    content: ModelsFile
    fits: Mapping[str, FitResult]
    seconds: Mapping[str, float]

    @property
    def table(self) -> "DataFrame":
        """One row a model, the best first: parameters, errors over all conditions, time of its fit."""
        rows = [{**asdict(row), "seconds": self.seconds[row.model]} for row in self.content.models]
        return frame_of(rows, (*TABLE, *TRAINING), "model")

    @property
    def metrics(self) -> "DataFrame":
        """Errors of every model on every condition, SI."""
        return frame_of([asdict(m) for m in self.content.metrics], self.content.metrics[0].written())

    @property
    def best(self) -> FitResult:
        """The fit of the best model."""
        return self.fits[self.content.models[0].model]

    @property
    def left_out(self) -> dict[str, str]:
        """Reason for each model that could not be fitted, by model."""
        return {row.model: row.reason for row in self.content.left_out}

    def to_json(self) -> dict[str, Any]:
        """Return the content of compare.json."""
        content: dict[str, Any] = plain(self.content)
        return content

    def _parts(self) -> "tuple[str, list[DataFrame], list[str]]":
        said = [f"left out {model}: {reason}" for model, reason in self.left_out.items()]
        return "Models, the best on held-out data first", [self.table], said


@dataclass(frozen=True, repr=False, eq=False)
class OptimizerComparison(PrintableResult):
    """Optimizers on one model.

    Attributes
    ----------
    content
        Rows and convergence curves, as optimizers.json has them.
    """

    content: OptimizersFile

    @property
    def table(self) -> "DataFrame":
        """For each condition and optimizer the best, median and worst cost over the seeds, evaluations, seconds."""
        return frame_of([asdict(r) for r in self.content.rows], compare_optimizers.OPTIMIZER_COLUMNS, "optimizer")

    def to_json(self) -> dict[str, Any]:
        """Return rows and curves."""
        content: dict[str, Any] = plain(self.content)
        return content

    def _parts(self) -> "tuple[str, list[DataFrame], list[str]]":
        settings = self.content.settings
        return f"Optimizers on {settings['model']}, {settings['seeds']} seeds: RMS error", [self.table], []


@overload
def compare(
    recordings: Recording | Iterable[Recording],
    models: str | Sequence[str] = "all",
    *,
    optimizers: None = None,
    progress: Heard = True,
    **options: object,
) -> Comparison: ...
@overload
def compare(
    recordings: Recording | Iterable[Recording],
    models: str | Sequence[str] = "all",
    *,
    optimizers: str | Sequence[str],
    progress: Heard = True,
    **options: object,
) -> OptimizerComparison: ...
@check_arguments
def compare(
    recordings: Recording | Iterable[Recording],
    models: str | Sequence[str] = "all",
    *,
    optimizers: str | Sequence[str] | None = None,
    progress: Heard = True,
    **options: object,
) -> Comparison | OptimizerComparison:
    """Fit several models and rank them by their error on held-out data, or compare optimizers on one model.

    It does what ``mrfit compare`` does, without a workspace.

    Parameters
    ----------
    recordings
        One or several, of ``mrfit.read``, ``Recording.from_frame`` or ``Recording.from_arrays``.
    models
        Names, or ``all``.
    optimizers
        Instead: names of optimizers or chains, on one model, given as ``model``; ``seeds`` is the number of runs.
    progress
        Whether to show a bar in a notebook and on a terminal, or a function called as ``progress(what, done, total)``.
    **options
        Those of ``mrfit compare``, ``mrfit flux`` and ``mrfit segment``, see below.

    Raises
    ------
    ConfigError
        If a name or an option is wrong.
    DataError
        If no model can be fitted, or no segment is found.
    """
    if optimizers is not None:
        if not isinstance(models, str) or models != "all":
            raise ConfigError("optimizers are compared on one model: give it as model='…', not as models")
        with one_blas_thread(), shown(progress) as told:
            return _optimizers(recordings, _names(optimizers), options, told)
    kind = compare_stage.Settings
    check_names((kind, *STAGE_SETTINGS), options)
    settings = settings_of(kind, options, models=_names(models))
    compare_stage.check(settings)
    with one_blas_thread(), shown(progress) as told:
        return _models(prepared(recordings, as_asked(options), told), settings, told)


def _models(made: PreparedSegments, settings: compare_stage.Settings, progress: Progress) -> Comparison:
    """Compare models."""
    fitted: dict[str, FitOutput] = {}

    def one(of_fit: fit_stage.Settings) -> Fit:
        origin = fit_stage.origin_of(made.dataset, of_fit)
        fitted[of_fit.model] = fit_stage.identify(made.dataset, of_fit, origin, progress)
        return fitted[of_fit.model].content

    tried = compare_stage.fit_all(settings, one, progress)
    content = compare_stage.summary_of(settings, tried)
    results = {f.model: FitResult(f, made.preparation, fitted[f.model]) for f in tried.fits}
    return Comparison(content, {row.model: results[row.model] for row in content.models}, tried.seconds)


def _names(names: str | Sequence[str]) -> tuple[str, ...]:
    return tuple(n.strip() for n in (names.split(",") if isinstance(names, str) else names))


def _optimizers(
    recordings: Recording | Iterable[Recording], names: tuple[str, ...], options: Options, progress: Progress
) -> OptimizerComparison:
    """Compare optimizers on one model."""
    kinds = (fit_stage.Settings, compare_optimizers.Settings, *STAGE_SETTINGS)
    check_names(kinds, options, ("optimizers", "fit", "optimizer", "seed"))
    if "model" not in options:
        raise ConfigError("optimizers are compared on one model: give model='…'")
    # a comparison is of joint fits where nothing else is said, as on the command line
    fit = settings_of(fit_stage.Settings, {"per": "all", **options})
    settings = settings_of(compare_optimizers.Settings, options, optimizers=names, fit=fit)
    compare_optimizers.check(settings)
    made = prepared(recordings, as_asked(options), progress)
    return OptimizerComparison(compare_optimizers.compared(made.dataset, settings, progress))


with_options(compare, (compare_stage.Settings, *STAGE_SETTINGS), ("models",))
