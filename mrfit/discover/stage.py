"""The discover stage: where simulation and measurement disagree, which effect is missing, and proof that it helps."""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from threading import Lock

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import OUTPUT_ON_MASS
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.discover.base_dependence import (
    Currents,
    bent_more,
    by_law_of_current,
    current_dependence,
    plain_laws,
    usual_dependence,
)
from mrfit.discover.evidence.bench import build_bench, effects_for, with_residual_floors
from mrfit.discover.evidence.gather import SimulatedEvidence, gather
from mrfit.discover.evidence.plain_fit import PLAIN_ERRORS, with_plain_errors
from mrfit.discover.evidence.refit import Fitter, Refit, RefitRequest, usual
from mrfit.discover.evidence.screen import is_law_of_current
from mrfit.discover.evidence.work import Effort, is_stepped
from mrfit.discover.hold_out import too_little, with_laws_trained
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.combine import DECIDED, Floors, may_err, worth_examining
from mrfit.discover.selection.exact_base import Selection, select
from mrfit.discover.selection.rules import follows_the_output, is_below_floors
from mrfit.discover.writing.beside_open_law import beside_open_law
from mrfit.discover.writing.contributions import contributions
from mrfit.discover.writing.driven_mass import of_driven, with_inertia
from mrfit.discover.writing.findings import findings, series_of
from mrfit.discover.writing.formula import PLUGIN_FILE, with_formula
from mrfit.discover.writing.law_repair import REPAIR_FILE, with_law_repair
from mrfit.discover.writing.open_law import with_another_base
from mrfit.discover.writing.regions import not_determined
from mrfit.discover.writing.result import DiscoveryRequest, account, insufficient, model_toml
from mrfit.errors import ConfigError
from mrfit.fit import stage as fit_stage
from mrfit.fit.driven import tests_of_law
from mrfit.fit.laws.choice import LawChoice
from mrfit.fit.select import doubtful_channels, load_recordings
from mrfit.io.dataset import Dataset
from mrfit.io.keys import code_version, digest_of, discovery_key, segments_digest
from mrfit.io.schemas.discovery import DiscoveryDependence, DiscoveryFile, PartialDiscovery
from mrfit.io.schemas.reading import reusable
from mrfit.io.tables import write_table
from mrfit.io.workspace import Workspace, plain, write_json, write_text
from mrfit.settings.discover import Settings as Settings
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence, base_name
from mrfit.simulate.current_levels import base_of


def check(settings: Settings) -> None:
    """Check settings before any data are touched.

    Raises
    ------
    ConfigError
        If the model, a parameter name or an order is wrong.
    """
    base = fit_stage.Settings(
        settings.model, per="all", start=settings.start, current_order=settings.current_order, seed=settings.seed
    )
    fit_stage.check(base)


@dataclass(frozen=True)
class DiscoveryOutcome:
    """A discovery.

    Attributes
    ----------
    found
        Content of discovery.json.
    skipped
        Whether it was there already.
    """

    found: DiscoveryFile
    skipped: bool = False


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> DiscoveryOutcome:
    """Find the effects that a base model lacks, and write ``discover/``.

    Parameters
    ----------
    workspace
        Holds recordings and segments.
    settings
        Base model and how to fit it.
    progress
        Reports every step.

    Raises
    ------
    ConfigError
        If a name is wrong.
    DataError
        If the recordings lack what the base needs, or every simulation diverges.
    """
    given, settings = settings, with_inertia(settings)
    names = assemble(settings.model).spec.names
    unknown = [n for n, _ in settings.start if n not in names]
    if unknown:
        raise ConfigError(f"model '{settings.model}' has no parameter '{unknown[0]}'; it has {', '.join(names)}")
    segments = workspace.read_segments()
    data, rows = workspace.made_from(segments)
    key = discovery_key(asdict(given), data, rows)
    folder = workspace.root / "discover"
    existing = reusable(folder / "discovery.json", DiscoveryFile)
    if existing and existing.key == key:
        return DiscoveryOutcome(existing, skipped=True)
    asked = DiscoveryRequest(settings.model, settings.seed, digest_of(data), key)
    lacking = too_little(segments, STANDARD)
    if lacking:
        told = DiscoveryOutput(insufficient(asked, lacking))
    else:
        judged, moved = segments, ""
        if by_law_of_current(settings.model):
            judged, moved = with_laws_trained(segments)
        tests = Dataset(judged, load_recordings(workspace, judged))
        logged = replace(tests, segments=segments)
        if settings.driven_by != "none":
            tests = tests_of_law(tests, settings.driven_by, settings.mass)
        job = _Job(workspace, settings, tests, asked, progress)
        told = _discovered(job)
        told = replace(told, found=of_driven(told.found, settings))
        spec = assemble(settings.model).spec
        doubts = doubtful_channels(list(logged.recordings.values()), {spec.output, *spec.inputs})
        advice = (*told.found.advice, *([moved] if moved else []), *(d.text for d in doubts))
        told = replace(told, found=told.found.model_copy(update={"advice": advice}))
        told = _with_plain_errors(job, told, logged)
        left_out = (*told.found.left_out, *job.effort.left_out)
        told = replace(told, found=told.found.model_copy(update={"left_out": left_out}))
    own = {k: v for k, v in asdict(given).items() if k != "jobs"}
    made = {"code": code_version("discover"), "segments_sha256": segments_digest(rows), "settings": own}
    found = told.found.model_copy(update=made)
    # a kill from here on must not leave the files of one discovery beside the key of another
    for name in ("discovery.json", "residuals.parquet", PLUGIN_FILE, REPAIR_FILE):
        (folder / name).unlink(missing_ok=True)
    if told.series:
        write_table(folder / "residuals.parquet", told.series)
    write_text(folder / "model.toml", model_toml(found))
    for written in (found.proposed, found.lacking):
        if written and written.source:
            write_text(folder / written.file, written.source)
    write_json(folder / "discovery.json", found.to_json())
    shutil.rmtree(folder / ".partial", ignore_errors=True)
    return DiscoveryOutcome(found)


@dataclass(frozen=True)
class DiscoveryOutput:
    """Files of a discovery: discovery.json's content, and the errors of every sample, by column.

    ``near`` holds the parameters of the augmented model by name (SI), as they were fitted.
    """

    found: DiscoveryFile
    series: Mapping[str, Array] = field(default_factory=dict)
    near: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class _Job:
    """Discovery to make: its workspace, settings, data, request, progress, and its work so far."""

    workspace: Workspace
    settings: Settings
    data: Dataset
    asked: DiscoveryRequest
    progress: Progress
    effort: Effort = field(default_factory=Effort)

    def decides_again(self) -> bool:
        """Return whether another decision on the data may be made; otherwise it is told that it was not."""
        return self.effort.allows(STANDARD.most_effort, "other dependences on current")

    def again(self, purpose: str) -> "_Job":
        """Return the job of another decision on the data, whose refits are kept under a key of their own."""
        return replace(self, asked=replace(self.asked, key=f"{self.asked.key} {purpose}"))


@dataclass(frozen=True)
class _JudgedDependence:
    """Decision with one dependence of the base on current, and its evidence."""

    gathering: SimulatedEvidence
    chosen: Selection


@dataclass(frozen=True)
class _DependenceChoice:
    """Decision with the dependence on current that was taken."""

    judged: _JudgedDependence
    currents: Currents


def _discovered(job: _Job) -> DiscoveryOutput:
    """Return the files of a decision, of another one where an examination believes nothing of the first."""
    decided = _decided(job)
    found, told = decided.judged, _examined(job, decided)
    taken_back = found.chosen.verdict in DECIDED and told.found.verdict not in DECIDED
    # a law that is too plain leaves what an effect takes; with a gap it has been tried already
    if not taken_back or job.settings.current_order != "auto" or _may_err(found):
        return told
    alone = replace(decided, judged=replace(found, chosen=replace(found.chosen, final=found.chosen.base)))
    plain = _with_plain_laws(job, alone)
    return told if plain is alone else _examined(job, plain)


def _examined(job: _Job, decided: _DependenceChoice) -> DiscoveryOutput:
    """Return the files of a decision, with an examination by invariances where the law may be off."""
    gathering, chosen = decided.judged.gathering, decided.judged.chosen
    told = _exact(job, decided)
    if lacking := _not_determined(job, decided):
        chosen = replace(chosen, verdict="insufficient-data")
        told = told.model_copy(update={"verdict": chosen.verdict, "advice": (lacking,), "suspects": ()})
    before, after = (gathering.refit_of(fit) for fit in (chosen.base, chosen.final))
    bench, floors = gathering.fitter.bench, _floors(gathering)
    if worth_examining(chosen, floors, STANDARD):
        job.progress("law and invariances", 0, 1)
        own = replace(job.settings, current_order="auto", start=())
        beside = beside_open_law(
            gathering, chosen, told, lambda law: usual_dependence(replace(own, model=law), job.data), floors, STANDARD
        )
        job.progress("law and invariances", 1, 1)
        told, after = _with_another_base(job, beside.found), beside.after
    if job.settings.formulas and told.verdict == "unexplained":
        job.progress("formula", 0, 1)
        told = with_law_repair(with_formula(told, bench, before, STANDARD), bench, before, STANDARD)
        job.progress("formula", 1, 1)
    series = {**series_of(bench, before, after), **contributions(gathering, chosen, told.suspects)}
    return DiscoveryOutput(told, series, {**before.values, **after.values})


def _with_plain_errors(job: _Job, told: DiscoveryOutput, logged: Dataset) -> DiscoveryOutput:
    """Return the files with the errors of plain fits to tests with the roles that a fit gives them."""
    settings = job.settings
    # the law's error is another than that of a driven motion; fits of a coil take ten times as long as a discovery
    if settings.driven_by != "none" or base_of(settings.model.partition("+")[0]).spec.output != OUTPUT_ON_MASS:
        return told
    # fits of other laws end in a second or two
    if is_stepped(settings.model) and not job.effort.allows(STANDARD.most_effort_told, PLAIN_ERRORS):
        return told
    job.progress("errors of plain fits", 0, 1)
    found = with_plain_errors(told.found, told.near, job.workspace, settings, logged)
    job.progress("errors of plain fits", 1, 1)
    return replace(told, found=found)


def _floors(gathering: SimulatedEvidence) -> Floors:
    bench = gathering.fitter.bench
    return Floors(
        noise=gathering.noise,
        measured=bench.noise_is_measured("holdout"),
        told=gathering.noise_is_told,
        fitted=bench.most_noise("train"),
    )


def _with_another_base(job: _Job, told: DiscoveryFile) -> DiscoveryFile:
    """Return a discovery with what the plainest law near the floor lacks: effects that any law could make."""
    samples = sum(s.samples for s in job.data.segments)
    near = [assemble(law.model) for law in told.other_laws if law.near_the_floor]
    # a law with a rough response of its own is slow to simulate
    quick = [a for a in near if samples * (STANDARD.rough_weight if a.rough else 1) <= STANDARD.most_samples_again]
    if not quick:
        return told
    if not job.effort.allows(STANDARD.most_effort_told, "what another base lacks"):
        return told
    law = min(quick, key=lambda assembly: len(assembly.spec.params)).spec.name
    settings = replace(job.settings, model=law, current_order="auto", start=())
    again = job.again(law)
    again = replace(again, settings=settings, asked=replace(again.asked, model=law))
    return with_another_base(told, _exact(again, _decided(again)))


def _exact(job: _Job, decided: _DependenceChoice) -> DiscoveryFile:
    """Return the discovery of a base taken as exact."""
    dependence, choice = decided.currents.dependence, decided.currents.choice
    asked = replace(
        job.asked,
        dependence=DiscoveryDependence(**asdict(dependence)) if dependence else None,
        choice=plain(choice.about) if choice else None,
    )
    gathering, chosen = decided.judged.gathering, decided.judged.chosen
    return account(asked, chosen, findings(gathering, chosen, STANDARD), STANDARD)


def _decided(job: _Job) -> _DependenceChoice:
    """Gather evidence and select."""
    currents = current_dependence(job.settings, job.data)
    choice = currents.choice
    decided = _DependenceChoice(_judged(_started(job, currents), currents.dependence), currents)
    if job.settings.current_order != "auto":
        return decided
    if choice is None:
        decided = _with_bent_laws(job, decided)
    if _may_err(decided.judged):
        decided = _with_plain_laws(job, decided)
    if choice is None:
        return decided
    if not choice.by_role:
        decided = _with_laws_by_role(job, decided)
    if choice.errs:
        decided = _with_laws_beside_an_effect(job, decided)
    return _with_laws_as_chosen(job, decided, choice)


def _with_laws_by_role(job: _Job, decided: _DependenceChoice) -> _DependenceChoice:
    """Return the decision with the laws of current of the parameters' roles, where they tell more than others.

    Laws chosen without an effect may have followed it: those of the roles have not.
    """
    found, by_role = decided.judged, usual_dependence(job.settings, job.data)
    unexplained = found.chosen.verdict == "unexplained"
    if not unexplained and not _is_plainer(job, found, by_role, STANDARD.simpler_error):
        return decided
    return _with_fewer_names(job.again("usual"), by_role, decided)


def _may_err(found: _JudgedDependence) -> bool:
    return may_err(found.chosen, _floors(found.gathering), STANDARD)


def _with_plain_laws(job: _Job, decided: _DependenceChoice) -> _DependenceChoice:
    """Return the decision with bent forces and constant shapes, where these tell more.

    Laws that are chosen follow what is missing, or keep to those of their roles, which bend too little. A cubic passes
    through the yield forces of the usual four currents, whatever its law. Shapes of the curve are hardly determined.
    """
    laws = plain_laws(job.settings, job.data)
    if laws is None or not _gains_by(job, decided.judged, laws):
        return decided
    return _better_decided(job.again("plain"), Currents(laws, decided.currents.choice), decided)


def _gains_by(job: _Job, found: _JudgedDependence, laws: CurrentDependence) -> bool:
    """Return whether laws of current leave visibly less beside effects of a decision, fitted or held out.

    Tried are no effects, the chosen ones, and the likeliest three alone: another decision takes as long as the first.
    """
    chosen = found.chosen
    likely = sorted((t.fit for t in chosen.trials), key=lambda fit: fit.train)[: STANDARD.most_tried_by_laws]
    fits = {fit.effects: fit for fit in (chosen.base, chosen.final, *likely)}
    again = _refits_by(job, found, laws, [RefitRequest(e, (fit.values,)) for e, fit in fits.items()])
    least = STANDARD.gain_by_laws
    return any(
        new.chi("train") ** 2 < least * old.train**2 or new.chi("holdout") ** 2 < least * old.holdout**2
        for old, new in zip(fits.values(), again, strict=True)
    )


def _with_bent_laws(job: _Job, decided: _DependenceChoice) -> _DependenceChoice:
    """Return the decision with a yield force that bends more with a current, where an effect leaves no less.

    Where tests hold too few levels, no law of current is chosen, and an effect that is such a law may stand for it.
    """
    laws = decided.currents.dependence
    if laws is None:
        return decided
    bent = bent_more(laws, job.settings.model, job.data)
    plainer = _is_plainer(job, decided.judged, bent, 1.0)
    return _with_fewer_names(job.again("bent"), bent, decided) if plainer else decided


def _with_fewer_names(job: _Job, laws: CurrentDependence | None, decided: _DependenceChoice) -> _DependenceChoice:
    """Return the decision with other laws of current if it explains the base by fewer effects, or where nothing did."""
    if not job.decides_again():
        return decided
    chosen, other = decided.judged.chosen, _judged(job, laws)
    fewer = chosen.verdict == "unexplained" or set(other.chosen.effects) < set(chosen.effects)
    return _DependenceChoice(other, Currents(laws)) if other.chosen.verdict in DECIDED and fewer else decided


def _with_laws_beside_an_effect(job: _Job, decided: _DependenceChoice) -> _DependenceChoice:
    """Return the decision with laws of current chosen beside the likeliest effect, where they tell more than others.

    Laws that are chosen for the base alone bend after what an effect does. One that leaves noise where it was fitted
    may be all that is missing, though held-out tests err and others are named beside it. Where the decision is open, it
    may leave a little more: the bent law has its part in that.
    """
    found = decided.judged
    chosen, floors = found.chosen, _floors(found.gathering)
    single = [t.fit for t in chosen.trials] + [chosen.final] * (len(chosen.effects) == 1)
    likely = min(single, key=lambda fit: fit.train, default=chosen.base)
    opened = worth_examining(chosen, floors, STANDARD)
    most = STANDARD.above_noise if opened else STANDARD.examined_above_floor
    clear = len(chosen.effects) <= 1 and not opened
    if clear or not likely.effects or likely.train > most * floors.fitted or not job.decides_again():
        return decided
    held = {n: v for n, v in likely.values.items() if n.partition(".")[0] in likely.effects}
    currents = current_dependence(job.settings, job.data, likely.effects, held)
    if currents.dependence == decided.currents.dependence:
        return decided
    return _better_decided(job.again(f"beside {likely.effects[0]}"), currents, decided)


def _with_laws_as_chosen(job: _Job, decided: _DependenceChoice, choice: LawChoice) -> _DependenceChoice:
    """Return the decision with laws of current that may stand for an effect, where nothing else explains the gap.

    They are those of ``LawChoice.dependence``. ``LawChoice.as_base`` lacks what an effect may explain, so that the
    effect can be found. Where none is, the base may have that law.
    """
    as_chosen = Currents(choice.dependence, choice)
    if decided.judged.chosen.verdict != "unexplained" or as_chosen.dependence == decided.currents.dependence:
        return decided
    return _better_decided(job.again("as chosen"), as_chosen, decided)


def _better_decided(job: _Job, currents: Currents, decided: _DependenceChoice) -> _DependenceChoice:
    """Return the decision with other laws of current if it explains the base and errs less on held-out conditions.

    So it is taken where it needs no effects that are such laws, and errs hardly more where it was fitted.
    """
    if not job.decides_again():
        return decided
    other = _judged(_started(job, currents), currents.dependence)
    new, old = other.chosen.final, decided.judged.chosen.final
    rest = _without_laws_of_current(old.effects)
    plainer = rest != old.effects and set(new.effects) == set(rest)
    better = new.holdout < old.holdout or plainer and new.train**2 <= STANDARD.simpler_error * old.train**2
    return _DependenceChoice(other, currents) if other.chosen.verdict in DECIDED and better else decided


def _not_determined(job: _Job, decided: _DependenceChoice) -> str:
    """Return advice on tests at which the others do not determine an unexplained base that suits all; else nothing."""
    gathering, chosen = decided.judged.gathering, decided.judged.chosen
    apart = chosen.base.train <= STANDARD.clearly_above < chosen.base.holdout
    if chosen.verdict != "unexplained" or not apart or follows_the_output(gathering.repetition(chosen.base), STANDARD):
        return ""
    job.progress("base fit to all tests", 0, 1)
    tests = replace(job.data, segments=[replace(s, role="train") for s in job.data.segments])
    currents = current_dependence(job.settings, tests)
    fitter = _fitter(_started(replace(job.again("all"), data=tests), currents), currents.dependence)
    errors = dict(
        zip((s.segment.id for s in fitter.bench.stretches), fitter.first(job.settings.seed).train, strict=True)
    )
    job.progress("base fit to all tests", 1, 1)
    bench, base = gathering.fitter.bench, gathering.refit_of(chosen.base)
    left = usual([errors[s.segment.id] for s in bench.of_role("holdout")])
    return not_determined(bench, base, left, STANDARD) if left <= STANDARD.clearly_above else ""


def _is_plainer(job: _Job, found: _JudgedDependence, laws: CurrentDependence | None, most: float) -> bool:
    """Return whether laws of current leave no more than effects that are such laws, but for a factor on its square.

    Where only noise is left it may be a little more.
    """
    final = found.chosen.final
    rest = _without_laws_of_current(final.effects)
    if rest == final.effects:
        return False
    (plain,) = _refits_by(job, found, laws, [RefitRequest(rest, (final.values,))])
    if max(plain.chi("train"), plain.chi("holdout")) <= STANDARD.at_the_floor:
        most = max(most, STANDARD.simpler_error)
    return plain.chi("holdout") ** 2 <= most * final.holdout**2


def _without_laws_of_current(effects: tuple[str, ...]) -> tuple[str, ...]:
    """Return the effects that a law of current cannot stand for."""
    return tuple(e for e in effects if not is_law_of_current(registry.load("effect", e).SPEC))


def _refits_by(
    job: _Job, found: _JudgedDependence, laws: CurrentDependence | None, wanted: Sequence[RefitRequest]
) -> Iterator[Refit]:
    """Yield refits with other laws of current than those of a decision."""
    fitter, start = found.gathering.fitter, dict(job.settings.start)
    return replace(fitter, dependence=laws, start=start, known={}, judged={}, keep=lambda *_: None).refits(wanted)


def _judged(job: _Job, dependence: CurrentDependence | None) -> _JudgedDependence:
    """Gather evidence with a dependence of the base on current, and select; refits are kept under the job's key.

    A fit that leaves less than the noise floors shows that these are too high. With lower ones it is selected again.
    """
    fitter = _fitter(job, dependence)
    base = _based(job, fitter)
    if any(not s.noise.known for s in fitter.bench.stretches) or _is_below_floors(base):
        fitter = _with_residual_floors(fitter, base, job.data.recordings)
        base = _based(job, fitter)
    found = _selected(job, fitter, base)
    final = found.gathering.refit_of(found.chosen.final)
    if not final.effects or not _is_below_floors(final) or not job.decides_again():
        return found
    job = job.again("lower floors")
    fitter = _kept(job, _with_residual_floors(fitter, final, job.data.recordings))
    return _selected(job, fitter, _based(job, fitter))


def _based(job: _Job, fitter: Fitter) -> Refit:
    job.progress("base fit", 0, 1)
    base = fitter.first(job.settings.seed)
    job.progress("base fit", 1, 1)
    return base


def _selected(job: _Job, fitter: Fitter, base: Refit) -> _JudgedDependence:
    effects = [e for e in effects_for(base.assembly.spec.output) if e.name not in job.settings.model.split("+")]
    gathering = SimulatedEvidence(fitter, base, effects, STANDARD, job.settings.seed, job.progress)
    return _JudgedDependence(gathering, select(gather(gathering, STANDARD), STANDARD))


def _is_below_floors(fit: Refit) -> bool:
    """Return whether a fit leaves less than the noise floors of a role."""
    return is_below_floors(fit.chi("train"), fit.chi("holdout"))


def _with_residual_floors(fitter: Fitter, fit: Refit, recordings: Mapping[str, Recording]) -> Fitter:
    """Return the fitter with the noise floors that a fit's residual tells; the base has to be fitted again."""
    errors = {role: iter(found) for role, found in (("train", fit.train), ("holdout", fit.holdout))}
    residuals = [next(errors[s.segment.role]) for s in fitter.bench.stretches]
    bench = with_residual_floors(fitter.bench, residuals, recordings, fitter.assembly(()).spec.output)
    known = {effects: point for effects, point in fitter.known.items() if effects}
    return replace(fitter, bench=bench, known=known, judged={})


def _started(job: _Job, currents: Currents) -> _Job:
    """Return a discovery that starts at the laws of current that were chosen, where the user gave no start values."""
    choice, dependence, settings = currents.choice, currents.dependence, job.settings
    if choice is None or dependence is None or choice.by_role:
        return job
    given = {n for n, _ in settings.start}
    found = choice.start(base_of(settings.model), dependence).items()
    start = (*((n, v) for n, v in found if base_name(n) not in given), *settings.start)
    return replace(job, settings=replace(settings, start=start))


def _fitter(job: _Job, dependence: CurrentDependence | None) -> Fitter:
    settings, data = job.settings, job.data
    base = assemble(settings.model, dependence)
    bench = build_bench(data.segments, data.recordings, base, effects_for(base.spec.output), STANDARD)
    fitter = Fitter(
        bench, settings.model, dependence, dict(settings.start), {}, lambda *_: None, settings.jobs, effort=job.effort
    )
    return _kept(job, fitter)


def _kept(job: _Job, fitter: Fitter) -> Fitter:
    """Return a fitter that keeps its fits under the job's key, and knows those that a stopped run kept under it."""
    key = job.asked.key
    path = job.workspace.root / "discover" / ".partial" / "fits.json"
    stored = reusable(path, PartialDiscovery)
    known = {}
    if stored and stored.key == key:
        known = {tuple(f.effects): np.array(f.point) for f in stored.fits}

    kept, writing = dict(known), Lock()

    def keep(effects: tuple[str, ...], point: Array) -> None:
        # a later run improves a fit again where this one did: it has to start where this one started
        with writing:
            kept.setdefault(effects, point)
            write_json(path, {"key": key, "fits": [{"effects": list(e), "point": p} for e, p in kept.items()]})

    return replace(fitter, known=known, keep=keep)
