"""Compare optimizers on one model: the same start points and budgets, several seeds, best, median and worst cost."""

import csv
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from mrfit.compare.page import optimizers_page
from mrfit.core.channels import unit_of
from mrfit.core.executors.order import spread
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.fit import stage as fit_stage
from mrfit.fit.identify import FitGroup, build_group, weights_of
from mrfit.fit.select import read_dataset
from mrfit.io.csv_table import csv_table
from mrfit.io.dataset import Dataset
from mrfit.io.keys import code_version, digest_of, fit_key, segments_digest
from mrfit.io.schemas.compare import Curve, OptimizerRow, OptimizersFile
from mrfit.io.schemas.reading import reusable
from mrfit.io.workspace import Workspace, checked, write_json, write_text
from mrfit.search import chain, strategies
from mrfit.search import run as search
from mrfit.search.cube import Cube
from mrfit.search.limits import Limits
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.starts import at_scales, characteristic_points, data_starts, to_points
from mrfit.settings.compare import OfOptimizers
from mrfit.simulate.current_levels import base_of

OPTIMIZER_COLUMNS = ("condition", "optimizer", "seeds", "best", "median", "worst", "evaluations", "seconds", "unit")
Settings = OfOptimizers
# Evaluations at which the curves of several seeds are compared
PROGRESS_POINTS = 200


def check(settings: Settings) -> None:
    """Check names and options before any data are touched.

    Raises
    ------
    ConfigError
        If a model or an optimizer is unknown, or there is no seed to run.
    """
    fit_stage.check(replace(settings.fit, options=()))
    parts = [part for name in settings.optimizers for part in chain.parts(name)]
    chain.check_options(list(dict.fromkeys(parts)), settings.fit.options)
    for name in settings.optimizers:
        if own := strategies.find(name).begins_with:
            raise ConfigError(f"'{name}' begins with {own}, not with a start: `mrfit compare --models … --opt {name}`")
    if settings.seeds < 1:
        raise ConfigError(f"--seeds {settings.seeds} runs nothing; give at least 1")


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> OptimizersFile:
    """Run every optimizer from every start and write ``compare/optimizers.{csv,json,html}``.

    Optimizers of an earlier comparison stay in the table where it was of the same data and settings.

    Parameters
    ----------
    workspace
        Holds segments and recordings.
    settings
        What to compare.
    progress
        Reports every run.

    Returns
    -------
    OptimizersFile
        ``rows``: for each condition and optimizer the best, median and worst cost over the seeds (RMS error in the
        output's unit, weighted as in the fit), median evaluations and median ``seconds``; ``curves``: median best
        cost against evaluations. Seconds are in the CSV file only.

    Raises
    ------
    DataError
        If the recordings lack what the model needs.
    """
    check(settings)
    folder = workspace.root / "compare"
    before = reusable(folder / "optimizers.json", OptimizersFile)
    summary = compared(read_dataset(workspace), settings, progress)
    if before and before.key == summary.key:
        summary = _with_earlier(summary, before, _earlier_seconds(folder / "optimizers.csv"))
    stable = replace(summary, rows=[replace(r, seconds=None) for r in summary.rows])
    _write(folder, summary, stable)
    return summary


Place = tuple[str, str]
"""A condition and an optimizer."""


def _with_earlier(summary: OptimizersFile, before: OptimizersFile, seconds: Mapping[Place, float]) -> OptimizersFile:
    """Return a comparison with the optimizers of an earlier one that it has not run, condition by condition."""
    ran = {row.optimizer for row in summary.rows}
    rows = [replace(r, seconds=seconds.get((r.condition, r.optimizer))) for r in before.rows if r.optimizer not in ran]
    curves = [c for c in before.curves if c.optimizer not in ran]
    order = list(dict.fromkeys(row.condition for row in summary.rows))
    return replace(
        summary,
        rows=sorted([*summary.rows, *rows], key=lambda r: (order.index(r.condition), r.optimizer)),
        curves=sorted([*summary.curves, *curves], key=lambda c: (order.index(c.condition), c.optimizer)),
        kept=sorted({row.optimizer for row in rows}),
    )


def _earlier_seconds(path: Path) -> dict[Place, float]:
    try:
        with path.open(encoding="utf-8", newline="") as handle:
            return {(r["condition"], r["optimizer"]): float(r["seconds"]) for r in csv.DictReader(handle)}
    except (OSError, ValueError, KeyError, TypeError, csv.Error):
        return {}  # edited by others: times are for information only


def compared(dataset: Dataset, settings: Settings, progress: Progress = silent) -> OptimizersFile:
    """Run every optimizer from every start on segments in memory, settings checked, and return what ``run`` does."""
    prepared = fit_stage.prepare(dataset, settings.fit)
    rows: list[OptimizerRow] = []
    curves: list[Curve] = []
    shares = [
        _Share(name, prepared, optimizer, settings) for name in prepared.groups for optimizer in settings.optimizers
    ]
    # one after the other on this machine: runs side by side would take longer, and their seconds are told
    for share, runs in zip(shares, spread(_runs, [s.alone() for s in shares], 1, silent), strict=True):
        rows.append(_row(share.name, share.optimizer, runs, prepared.assembly.spec.output))
        evaluations, cost = _median_curve(runs)
        curves.append(Curve(condition=share.name, optimizer=share.optimizer, evaluations=evaluations, cost=cost))
        progress("compare", len(rows), len(shares))
    fit = {k: v for k, v in asdict(settings.fit).items() if k not in ("jobs", "optimizer", "seed")}
    used = {"seeds": settings.seeds, **fit}
    contents, cut = dataset.made_from()
    summary = OptimizersFile(
        settings=used,
        rows=rows,
        curves=curves,
        warnings=prepared.cautions,
        key=fit_key(used, contents, cut),
        code=code_version("fit"),
        data_sha256=digest_of(contents),
        segments_sha256=segments_digest(cut),
    )
    return checked(summary)


@dataclass(frozen=True)
class _Share:
    """Work item of a comparison: the runs of one optimizer on one condition."""

    name: str
    prepared: fit_stage.FitPreparation
    optimizer: str
    settings: Settings

    def alone(self) -> "_Share":
        """Return the same with the condition's recordings only, as it is sent."""
        segments = self.prepared.groups[self.name]
        recordings = {s.recording: self.prepared.recordings[s.recording] for s in segments}
        return replace(self, prepared=replace(self.prepared, recordings=recordings, groups={self.name: segments}))


def _runs(share: _Share, progress: Progress) -> "list[_OptimizerRun]":
    """Return the runs of an optimizer from every start."""
    prepared, fit = share.prepared, share.settings.fit
    segments = prepared.groups[share.name]
    split = fit.per == "condition" and len({s.role for s in segments}) == 1
    group = build_group(share.name, segments, prepared.recordings, prepared.assembly, split)
    scaled = replace(prepared, cube=at_scales(prepared.cube, group.training, base_of(fit.model)))
    return [_one_run(group, scaled, share.optimizer, seed, fit) for seed in range(share.settings.seeds)]


@dataclass(frozen=True)
class _OptimizerRun:
    cost: float
    evaluations: int
    seconds: float
    history: list[tuple[int, float]]


def _one_run(
    group: FitGroup, prepared: fit_stage.FitPreparation, optimizer: str, seed: int, fit: fit_stage.Settings
) -> _OptimizerRun:
    weights = weights_of(group.search, group.training_floors, fit.weight)
    posed, starts = (
        LeastSquaresProblem(group.search, weights, prepared.assembly, prepared.cube),
        start_point(prepared.cube, seed)[None],
    )
    rng = np.random.default_rng([seed, *group.name.encode()])
    limits = Limits(fit.budget, fit.seconds, fit.stall)
    given = group.training, base_of(fit.model), prepared.dependence, dict(fit.start)
    begin, strategy = time.perf_counter(), strategies.find(optimizer, fit.options)
    if strategy.many_starts:
        starts = np.vstack([starts, *to_points(prepared.cube, data_starts(*given))])
    if strategy.from_points:
        starts = characteristic_points(prepared.cube, *given)
    found = search.run(posed, starts, limits, rng, strategy)
    # costs of another problem than that of all optimizers are not shown beside theirs
    history = list(found.history[found.preliminary :])
    return _OptimizerRun(found.cost, found.nfev, time.perf_counter() - begin, history)


def start_point(cube: Cube, seed: int) -> Array:
    """Return the start of a seed: the model's own for seed 0, else a random point of the cube, shape (F,)."""
    return cube.start if seed == 0 else np.random.default_rng(seed).random(len(cube.free))


def _row(condition: str, optimizer: str, runs: list[_OptimizerRun], output: str) -> OptimizerRow:
    costs = np.array([r.cost for r in runs])
    return OptimizerRow(
        condition=condition,
        optimizer=optimizer,
        seeds=len(runs),
        best=float(costs.min()),
        median=float(np.median(costs)),
        worst=float(costs.max()),
        evaluations=int(np.median([r.evaluations for r in runs])),
        seconds=float(np.median([r.seconds for r in runs])),
        unit=unit_of(output),
    )


def _median_curve(runs: list[_OptimizerRun]) -> tuple[list[float], list[float]]:
    """Return evaluations, spread evenly on a logarithmic scale, and the median over runs of the best cost by then."""
    last = max(r.evaluations for r in runs)
    at = np.unique(np.round(np.geomspace(1, max(last, 2), PROGRESS_POINTS)))
    costs = []
    for one in runs:
        steps = np.array(one.history)
        place = np.searchsorted(steps[:, 0], at, side="right") - 1
        costs.append(np.where(place >= 0, steps[np.maximum(place, 0), 1], np.inf))
    middle = np.median(np.array(costs), axis=0)
    finite = np.isfinite(middle)
    return at[finite].tolist(), middle[finite].tolist()


def _write(folder: Path, summary: OptimizersFile, stable: OptimizersFile) -> None:
    rows = ({**asdict(row), "seconds": None if row.seconds is None else round(row.seconds, 4)} for row in summary.rows)
    write_text(folder / "optimizers.csv", csv_table(OPTIMIZER_COLUMNS, rows))
    write_text(folder / "optimizers.html", optimizers_page(stable))
    write_json(folder / "optimizers.json", stable)
