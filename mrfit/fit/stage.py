"""The fit stage: segments and a model name in, identified parameters with errors and intervals out."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from importlib.metadata import version
from pathlib import Path

import numpy as np

from mrfit.core.executors.order import is_apart, spread
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.fit import forms
from mrfit.fit.bounds import bounds_of_size
from mrfit.fit.diagnostics.diagnose import diagnose, drift_warnings, law_warnings
from mrfit.fit.diagnostics.remainders import borrowed
from mrfit.fit.driven import OUTPUT_ERROR_DESCENT, inverse_dynamics, moving_starts, with_drive, within_noise
from mrfit.fit.files import PARTIAL, FitOutput, drop_partial, write_fit
from mrfit.fit.identify import FitGroup, SearchSettings, build_group, found_point, search_optimum, weights_of
from mrfit.fit.laws.choice import LawChoice, laws_of_roles
from mrfit.fit.laws.laws_of_current import base_cube, dependence_of
from mrfit.fit.refined import refined
from mrfit.fit.result import metric_rows, simulate_block, warnings_of
from mrfit.fit.select import doubtful_channels, left_out_warnings, named, read_dataset, select, usable
from mrfit.io.columns import LazyArrays, laid_beside
from mrfit.io.dataset import Dataset
from mrfit.io.keys import code_version, digest_of, fit_key, law_code, segments_digest
from mrfit.io.schemas.fit import (
    Caution,
    CurrentChoice,
    Fit,
    FoundPoint,
    Level,
    MetricRow,
    PartialFit,
    Result,
    SegmentUse,
)
from mrfit.io.schemas.reading import reusable
from mrfit.io.workspace import Workspace, check_name, checked, write_json
from mrfit.kernels.jit import is_cold
from mrfit.search import chain, staged, strategies
from mrfit.search.cube import Cube, cube_of
from mrfit.search.descent import Descent
from mrfit.search.limits import seconds_left
from mrfit.search.parts import Blocks, SegmentPart
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.starts import (
    at_scales,
    beside_effects,
    characteristic_points,
    condition_means,
    data_starts,
    level_fits,
    to_points,
    two_phase_start,
)
from mrfit.settings.fit import Settings as Settings
from mrfit.signal.noise_floor import NoiseFloor
from mrfit.simulate.assembly import Assembly, assemble
from mrfit.simulate.current_dependence import CurrentDependence, base_name
from mrfit.simulate.current_levels import (
    base_of,
    checked_order,
    kept,
    piece_warnings,
    sign_warnings,
    tested_currents,
)

# Search from near the optimum
NEAR_ITS_OPTIMUM = Descent(60, 1e-6, 0.0)


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> Fit:
    """Fit a model to the workspace's segments and write ``fits/NAME``.

    Parameters
    ----------
    workspace
        Holds segments and recordings.
    settings
        What to fit and how.
    progress
        Reports every condition's evaluations.

    Returns
    -------
    Fit
        Content of fit.json, and whether it was there already.

    Raises
    ------
    ConfigError
        If a model, optimizer or parameter name or a bound is wrong.
    DataError
        If the recordings lack what the model needs or every simulation diverges.
    """
    check(settings)
    contents, cut = workspace.made_from(workspace.read_segments())
    key = fit_key(asdict(settings), contents, cut)
    folder = workspace.fit_folder(settings.fit_name)
    existing = reusable(folder / "fit.json", Fit)
    if existing and existing.key == key:
        # a kill between the writing of fit.json and the end leaves them
        drop_partial(folder)
        return replace(existing, skipped=True)
    origin = FitOrigin(key, digest_of(contents), segments_digest(cut), folder)
    with workspace.scratching():
        # where other files are seen, recordings are sent whole
        fitted = identify(read_dataset(workspace, streamed=not is_apart()), settings, origin, progress)
        write_fit(folder, fitted)
    return fitted.content


@dataclass(frozen=True)
class FitOrigin:
    """What a fit is made from: its key, hashes of recordings and segments, where finished searches are kept meanwhile.

    A kill then loses little; in memory, without a folder, nothing is kept.
    """

    key: str
    data_sha256: str
    segments_sha256: str
    folder: Path | None = None


def origin_of(dataset: Dataset, settings: Settings) -> FitOrigin:
    """Return the origin of a fit in memory: the key and hash that the same data in a workspace have."""
    contents, cut = dataset.made_from()
    return FitOrigin(fit_key(asdict(settings), contents, cut), digest_of(contents), segments_digest(cut))


def identify(dataset: Dataset, settings: Settings, origin: FitOrigin, progress: Progress = silent) -> FitOutput:
    """Fit a model to segments in memory.

    Parameters
    ----------
    dataset
        Segments and recordings.
    settings
        What to fit and how, checked.
    origin
        Key and hash that the result bears.
    progress
        Reports every condition's evaluations.

    Raises
    ------
    ConfigError, DataError
        As ``run`` does.
    """
    if settings.forms == "evidence":
        return _in_the_form_called_for(dataset, settings, origin, progress)
    asked, settings = settings, with_drive(settings, dataset.recordings)
    prepared = prepare(dataset, settings)
    runner = _Runner(prepared, settings, origin, progress)
    pieces = _with_borrowed(runner.fit_groups(), prepared.assembly)
    blocks = Blocks(part for p in pieces for part in p.group.full.parts)
    simulated = LazyArrays([s for p in pieces for s in p.simulated.members])
    metrics = pieces[0].metrics
    if len(pieces) > 1:
        metrics = metric_rows(blocks, [f for p in pieces for f in p.group.floors], simulated, prepared.assembly)
    content = checked(_summary(runner, asked, pieces, metrics))
    return FitOutput(content, blocks, simulated, prepared.assembly)


def _in_the_form_called_for(dataset: Dataset, settings: Settings, origin: FitOrigin, progress: Progress) -> FitOutput:
    """Fit every form of an effect that has several, and return the fit of the one that the data call for."""

    def identified(own: Settings, form: str) -> FitOutput:
        return identify(dataset, own, replace(origin, key=f"{origin.key} {form}"), progress)

    fitted = forms.chosen(dataset, settings, identified)
    asked = {**fitted.content.settings, "forms": settings.forms}
    return replace(fitted, content=replace(fitted.content, key=origin.key, settings=asked))


@dataclass(frozen=True)
class FitPreparation:
    """What a fit needs before its first simulation.

    Attributes
    ----------
    assembly, cube
        The model and its free parameters.
    dependence
        How parameters depend on current, None if they do not.
    choice
        How that was chosen, None where it was given.
    groups
        Segments that share one set of parameters, by the name of their result.
    recordings
        Recordings by id.
    cautions
        Warnings on logs that were left out, and on levels of current that are too few.
    """

    assembly: Assembly
    cube: Cube
    dependence: CurrentDependence | None
    choice: LawChoice | None
    groups: dict[str, list[Segment]]
    recordings: dict[str, Recording]
    cautions: list[Caution]


def prepare(dataset: Dataset, settings: Settings) -> FitPreparation:
    """Return the model as the data call for it and the segments it is fitted to.

    Raises
    ------
    ConfigError
        If a parameter's name, a bound or the choice of segments is wrong.
    DataError
        If segments or recordings are missing, or the levels of current do not carry the order asked for.
    """
    segments, recordings = dataset.segments, dict(dataset.recordings)
    asked = [s for s in segments if named(s.condition, settings.only)]
    # a condition by itself holds a part of its own cycles out
    roles = ("train",) if settings.per == "all" else ("train", "holdout")
    if not any(s.role in roles for s in asked):
        asked = list(segments)  # of which ``select`` says what there is
    able, left_out = usable(asked, recordings, assemble(settings.model), roles)
    chosen = select(able, settings.only, recordings, roles)
    given = {base_name(name) for name, _, _ in settings.bounds}
    logs = [recordings[r] for r in dict.fromkeys(s.recording for s in chosen)]
    wider = bounds_of_size(assemble(settings.model).spec, logs)
    settings = replace(settings, bounds=(*settings.bounds, *(one for one in wider if one[0] not in given)))
    dependence, choice = dependence_of(settings, chosen, recordings)
    assembly = assemble(settings.model, dependence)
    # parameters that depend on current take it of every log
    chosen, more = usable(chosen, recordings, assembly, roles)
    cautions = left_out_warnings([*left_out, *more], len(asked))
    cautions += choice.warnings if choice else []
    if dependence and dependence.has_breaks:
        cautions += piece_warnings(dependence, tested_currents(chosen, recordings))
    used = [recordings[r] for r in dict.fromkeys(s.recording for s in chosen)]
    cautions += doubtful_channels(used, {assembly.spec.output, *assembly.spec.inputs})
    cautions += [Caution(kind="slow-model", text=assembly.spec.caution)] if assembly.spec.caution else []
    cautions += _held_outside_warnings(assembly, settings)
    cube, groups = _cube(assembly, settings), _groups(chosen, settings)
    return FitPreparation(assembly, cube, dependence, choice, groups, recordings, cautions)


def held_out_error(
    prepared: FitPreparation, settings: Settings, near: Mapping[str, float] | None = None
) -> float | None:
    """Return the NRMSE of a fit over all held-out conditions; None where nothing is held out.

    Parameters
    ----------
    prepared
        What ``prepare`` returns for the same settings.
    settings
        What to fit, all conditions together, and how.
    near
        Values by parameter name (SI) near its optimum, from which one descent is enough; None to search for it.

    Raises
    ------
    ConfigError, DataError
        As ``run`` does.
    """
    runner = _Runner(prepared, settings, FitOrigin("", "", ""), silent)
    ((name, segments),) = prepared.groups.items()
    group = runner.group(name, segments)
    cube = at_scales(prepared.cube, group.training, base_of(settings.model))
    search = runner.search if near is None else replace(runner.search, own=NEAR_ITS_OPTIMUM)
    found = runner._search(group, cube, search, [] if near is None else [dict(near)])
    theta = cube.to_theta(np.array([found.point]))[0]
    simulated = [simulate_block(part.block, prepared.assembly, theta)[0] for part in group.full.parts]
    return over_held_out(metric_rows(group.full, group.floors, simulated, prepared.assembly))


def over_held_out(metrics: Sequence[MetricRow]) -> float | None:
    """Return the NRMSE over all held-out conditions; None where nothing is held out."""
    return next((m.nrmse for m in metrics if (m.role, m.condition) == ("holdout", "all")), None)


def check(settings: Settings) -> None:
    """Check settings against the registry, before any data are touched.

    Raises
    ------
    ConfigError
        If a model, optimizer or parameter name, a bound, an order or the fit's name is wrong.
    """
    assembly = assemble(settings.model)
    chain.check_options(chain.parts(settings.optimizer), settings.options)
    strategies.find(settings.optimizer, settings.options).check(settings.model, settings.per)
    checked_order(settings.model, settings.current_order, settings.per)
    forms.check(settings)
    check_name(settings.fit_name, "--name" if settings.name else "")
    # which nodes of current there are is known with the data only
    plain_names = replace(
        settings,
        bounds=tuple((base_name(n), low, high) for n, low, high in settings.bounds),
        start=tuple((n, v) for n, v in settings.start if "@" not in n),
        fixed=tuple((n, v) for n, v in settings.fixed if "@" not in n),
    )
    _cube(assembly, plain_names)


def _cube(assembly: Assembly, settings: Settings) -> Cube:
    bounds = {n: (low, high) for n, low, high in settings.bounds}
    return cube_of(assembly.spec, bounds, dict(settings.start), dict(settings.fixed))


def _held_outside_warnings(assembly: Assembly, settings: Settings) -> list[Caution]:
    """Return a warning on every parameter that is held outside its usual bounds: another unit may be meant."""
    found, fixed = [], dict(settings.fixed)
    for param in (p for p in assembly.spec.params if p.name in fixed):
        value = fixed[param.name]
        if not param.low <= value <= param.high:
            bounds = f"{param.low:g} to {param.high:g} {param.unit}".rstrip()
            text = f"{param.name} is held at {value:g}, outside its bounds of {bounds}"
            # 0 is 0 in every unit
            text += "; check its unit" if value else ""
            found.append(Caution(kind="held-outside", text=text))
    return found


def _no_search_warnings(strategy: strategies.Strategy, name: str) -> list[Caution]:
    """Return the warning that a fit by a strategy, written so, did not search; none where it did."""
    read = "means over the conditions of each current" if strategy.from_means else "read off characteristic points"
    text = f"the parameters are {read}; intervals are those of a fit that ends here: {name}-lsq searches on from them"
    return [] if strategy.searches else [Caution(kind="no-search", text=text)]


def _groups(segments: Sequence[Segment], settings: Settings) -> dict[str, list[Segment]]:
    if settings.per == "all":
        return {"all": list(segments)}
    conditions = dict.fromkeys(s.condition for s in segments)
    return {c: [s for s in segments if s.condition == c] for c in conditions}


@dataclass(frozen=True)
class GroupFit:
    """Result of the fit of one group."""

    result: Result
    group: FitGroup
    simulated: LazyArrays
    metrics: list[MetricRow]
    found: FoundPoint


def _with_borrowed(pieces: list[GroupFit], assembly: Assembly) -> list[GroupFit]:
    """Return the fits of conditions by themselves, with what the nearest other's parameters leave of each."""
    if len(pieces) < 2:
        return pieces
    results, made = [p.result for p in pieces], []
    for piece in pieces:
        rows = borrowed(piece.group.judged.parts, assembly, results)
        made.append(replace(piece, result=replace(piece.result, remainders=[*piece.result.remainders, *rows])))
    return made


@dataclass(frozen=True)
class _Runner:
    """Fits groups, keeping every finished search in the origin's folder until the whole fit is written."""

    prepared: FitPreparation
    settings: Settings
    origin: FitOrigin
    progress: Progress

    @property
    def assembly(self) -> Assembly:
        return self.prepared.assembly

    @property
    def key(self) -> str:
        return self.origin.key

    @property
    def search(self) -> SearchSettings:
        """Strategy and limits of the search."""
        settings = self.settings
        limits = (settings.budget, settings.seconds, settings.weight, settings.stall, settings.options)
        own = OUTPUT_ERROR_DESCENT if "@" in settings.model and settings.optimizer == Settings.optimizer else None
        return SearchSettings(settings.optimizer, settings.seed, *limits, own=own)

    def group(self, name: str, segments: list[Segment]) -> FitGroup:
        """Return the blocks of some segments."""
        # where a part of each test is held out already, no third of its cycles is
        split = self.settings.per == "condition" and len({s.role for s in segments}) == 1
        return build_group(name, segments, self.prepared.recordings, self.assembly, split)

    def fit_groups(self) -> list[GroupFit]:
        groups, jobs, pieces = list(self.prepared.groups.items()), self.settings.jobs, []
        if is_cold():
            # processes side by side would each compile what the first fit compiles for all
            pieces.append(self._fit(*groups.pop(0)))
        apart = is_apart()
        shares = [self._share(name, segments, apart) for name, segments in groups]
        for share, piece in zip(shares, spread(_fit_share, shares, jobs, self.progress), strict=True):
            pieces.append(piece)
            if apart:
                self._keep(share.name, piece.found)
        return pieces

    def _share(self, name: str, segments: list[Segment], apart: bool) -> "WorkItem":
        """Return the part of one group; done where other files are seen, it has no folder to keep searches in."""
        runner = self.of(segments)
        if not apart:
            return WorkItem(runner, name, segments)
        return WorkItem(replace(runner, origin=replace(self.origin, folder=None)), name, segments, self._stored(name))

    def of(self, segments: Sequence[Segment]) -> "_Runner":
        """Return the same with the recordings of some segments only, as it is sent to a process."""
        recordings = {s.recording: self.prepared.recordings[s.recording] for s in segments}
        return replace(self, prepared=replace(self.prepared, recordings=recordings, groups={}), progress=silent)

    def _fit(self, name: str, segments: list[Segment], kept: FoundPoint | None = None) -> GroupFit:
        settings = self.settings
        group, search = self.group(name, segments), self.search
        driven, cube, begun = "@" in settings.model, self.prepared.cube, list[dict[str, float]]()
        if driven:
            cube, begun = inverse_dynamics(group.training.parts, self.prepared.recordings, settings, cube)
        else:
            cube = at_scales(cube, group.training, base_of(settings.model))
        kept = kept or self._stored(name)
        found = kept if kept and len(kept.point) == len(cube.free) else self._search(group, cube, search, begun)
        point = np.array(found.point)
        theta = cube.to_theta(point[None, :])[0]
        outputs, offsets = [], []
        for place, part in enumerate(group.full.parts):
            output, offset = simulate_block(part.block, self.assembly, theta)
            outputs.append(laid_beside(part.output, output))
            offsets.append(offset)
            if not part.kept:
                self.progress(f"{name}  simulating", place, len(group.full))
        simulated = LazyArrays(outputs)
        group = group.with_residual_floors(self.prepared.recordings, simulated, self.assembly.spec.output)
        metrics = metric_rows(group.full, group.floors, simulated, self.assembly)
        judged = self.assembly
        if driven:
            weights = weights_of(group.search, group.training_floors, settings.weight)
            judged = within_noise(LeastSquaresProblem(group.search, weights, judged, cube), point[None]).assembly
        diagnostics = diagnose(group, judged, cube, point, simulated, settings)
        parts = zip(group.full.parts, offsets, group.floors, strict=True)
        first = group.full.segments[0]
        result = Result(
            condition=name,
            conditions=list(dict.fromkeys(s.condition for s in group.full.segments)),
            at=Level(frequency=first.frequency, amplitude=first.amplitude, current=first.current),
            **{f.name: getattr(found, f.name) for f in fields(found) if f.name != "point"},
            **{f.name: getattr(diagnostics, f.name) for f in fields(diagnostics)},
            segments=[segment_use(part, offset, floor) for part, offset, floor in parts],
        )
        reasons = warnings_of(result, metrics, self.assembly.spec.passive)
        signs = sign_warnings(settings.model, self.prepared.dependence, theta)
        signs += law_warnings(group.training.parts, self.assembly, theta)
        signs += moving_starts(group.training.parts, self.prepared.recordings)
        said = [*signs, *drift_warnings(result.drift), *staged.warnings(found.stages)]
        warnings = [*reasons, *said, *_no_search_warnings(search.strategy, settings.optimizer)]
        return GroupFit(replace(result, warnings=warnings), group, simulated, metrics, found)

    def _search(self, group: FitGroup, cube: Cube, search: SearchSettings, begun: list[dict[str, float]]) -> FoundPoint:
        name = group.name
        total = search.budget or search.strategy.budget(len(cube.free))

        def told(evaluations: int, cost: float) -> None:
            unit = self.assembly.spec.output
            self.progress(f"{name}  best {cost:.3g} {unit}", min(evaluations, total - 1), total)

        # the searches that give starts count too
        deadline = None if search.seconds is None else time.monotonic() + search.seconds
        starts, levels = to_points(cube, [*begun, {}]), None
        if not begun:
            starts, levels = self._starts(group, cube, search, deadline)
        search = replace(search, seconds=seconds_left(deadline))
        ended = search_optimum(group, self.assembly, cube, starts, search, told)
        if group.share < 1.0:
            ended = refined(group, self.assembly, cube, ended, search.weight)
        found = found_point(ended, cube, levels)
        self.progress(f"{name}  best {found.cost:.3g} {self.assembly.spec.output}", total, total)
        self._keep(name, found)
        return found

    def _starts(
        self, group: FitGroup, cube: Cube, search: SearchSettings, deadline: float | None
    ) -> tuple[Array, list[dict[str, float | None]] | None]:
        """Return start points, the user's first, and what a first phase found at each current."""
        settings, dependence = self.settings, self.prepared.dependence
        base, given = base_of(settings.model), dict(settings.start)
        if search.strategy.from_points:
            return characteristic_points(cube, group.training, base, dependence, given), None
        starts, by_itself = list[dict[str, float]](), search.strategy.from_means
        if not by_itself:
            starts = [{}, *data_starts(group.training, base, dependence, given)]
        said = [*given, *(n for n, _ in settings.fixed)]

        def points() -> Array:
            others = beside_effects(starts, settings.model, said) if search.strategy.many_starts else []
            return to_points(cube, [*starts, *others])

        if dependence is None:
            if by_itself:
                what = f"--opt {settings.optimizer}: no parameter depends on current"
                raise ConfigError(f"{what}; --current-order says which do, as k=1")
            return points(), None
        choice = self.prepared.choice
        if choice and not by_itself:
            levels = choice.fits
            starts += [] if choice.by_role else [choice.start(base, dependence)]
        else:
            weights = weights_of(group.search, group.training_floors, settings.weight)
            single = at_scales(base_cube(settings), group.training, base)
            first_phase = condition_means if by_itself else level_fits
            levels = first_phase(group.search, base, single, weights, search.rng(f"{group.name} by current"), deadline)
        starts.append(two_phase_start(levels, base, dependence))
        rows: list[dict[str, float | None]] = [
            {"current": i.current, "cost": i.cost, **dict(zip(base.spec.names, i.theta.tolist(), strict=True))}
            for i in levels
        ]
        return points(), rows

    def _keep(self, name: str, found: FoundPoint) -> None:
        if path := self._partial(name):
            write_json(path, PartialFit(key=self.key, condition=name, found=found))

    def _partial(self, name: str) -> Path | None:
        folder = self.origin.folder
        return folder / PARTIAL / f"{digest_of(name)[:24]}.json" if folder else None

    def _stored(self, name: str) -> FoundPoint | None:
        """Return what an earlier run found for a group before it was ended."""
        path = self._partial(name)
        stored = reusable(path, PartialFit) if path else None
        return stored.found if stored and stored.key == self.key else None


@dataclass(frozen=True)
class WorkItem:
    """The part of a fit that one worker does, and what an earlier run found for it."""

    runner: _Runner
    name: str
    segments: list[Segment]
    kept: FoundPoint | None = None


def _fit_share(share: WorkItem, progress: Progress) -> GroupFit:
    return replace(share.runner, progress=progress)._fit(share.name, share.segments, share.kept)


def segment_use(part: SegmentPart, offset: float, floor: NoiseFloor) -> SegmentUse:
    """Return how a part of a segment entered a fit, with its record's unknown constant and its noise floor."""
    return SegmentUse(
        id=part.segment.id,
        condition=part.segment.condition,
        role=part.segment.role,
        drive=part.drive.method,
        offset=offset,
        noise_floor=floor.value,
        noise_floor_method=floor.method,
        noise_floor_bounds=(floor.low, floor.high),
    )


def _laws_chosen(settings: Settings, prepared: FitPreparation) -> CurrentChoice | None:
    """Return the choice of the laws of current; None where the user made it, and where no parameter varies."""
    if prepared.choice:
        return prepared.choice.about
    dependence = prepared.dependence if settings.current_order == "auto" else None
    return laws_of_roles(dependence) if dependence and dependence.varies else None


def _summary(runner: _Runner, asked: Settings, pieces: Sequence[GroupFit], metrics: list[MetricRow]) -> Fit:
    settings, spec = runner.settings, runner.assembly.spec
    return Fit(
        name=settings.fit_name,
        model=settings.model,
        optimizer=settings.optimizer,
        per=settings.per,
        seed=settings.seed,
        key=runner.key,
        code=code_version("fit"),
        data_sha256=runner.origin.data_sha256,
        segments_sha256=runner.origin.segments_sha256,
        law=law_code(settings.model),
        versions={p: version(p) for p in ("mrfit", "numpy", "scipy", "numba")},
        settings={k: v for k, v in asdict(asked).items() if k != "jobs"},
        current_dependence=kept(runner.prepared.dependence),
        current_choice=_laws_chosen(settings, runner.prepared),
        output=spec.output,
        inputs=list(spec.inputs),
        equation=spec.equation,
        reference=spec.reference,
        results=[p.result for p in pieces],
        metrics=metrics,
        warnings=runner.prepared.cautions,
    )
