"""The discover stage: where simulation and measurement disagree, which effect is missing, and proof that it helps."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from threading import Lock
from typing import Any

import numpy as np

from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.discover.account import account
from mrfit.discover.bench import build_bench, effects_for, with_residual_floors
from mrfit.discover.findings import findings, series_of
from mrfit.discover.gather import Gathering, gather
from mrfit.discover.policy import STANDARD, Policy
from mrfit.discover.refit import Fitter, Refit
from mrfit.discover.select import Selection, select
from mrfit.errors import ConfigError
from mrfit.fit import stage as fit_stage
from mrfit.fit.laws.choice import Choice
from mrfit.fit.laws.laws_of_current import dependence_of
from mrfit.fit.select import load_recordings, usable
from mrfit.io.keys import code_version, digest_of, discovery_key
from mrfit.io.schemas.discovery import DiscoveryFile, PartialDiscovery
from mrfit.io.schemas.reading import made
from mrfit.io.workspace import Workspace, plain, write_json, write_table, write_text
from mrfit.settings.discover import Settings as Settings
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence, base_name, orders_of
from mrfit.simulate.current_levels import (
    base_of,
    default_orders,
    dependence_on_current,
    recorded_range,
    takes_current,
    tested,
    to_choose,
)

SCHEMA = "mrfit/discovery/1"


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


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> dict[str, Any]:
    """Find what a base model lacks, and write ``discover/``.

    Parameters
    ----------
    workspace
        Holds recordings and segments.
    settings
        Base model and how to fit it.
    progress
        Told of every step.

    Returns
    -------
    dict
        Content of discovery.json, with ``skipped`` telling whether it was there already.

    Raises
    ------
    ConfigError
        If a name is wrong.
    DataError
        If the recordings lack what the base needs, or every simulation diverges.
    """
    names = assemble(settings.model).spec.names
    unknown = [n for n, _ in settings.start if n not in names]
    if unknown:
        raise ConfigError(f"model '{settings.model}' has no parameter '{unknown[0]}'; it has {', '.join(names)}")
    segments, _ = workspace.read_segments()
    data, rows = workspace.made_from(segments)
    key = discovery_key(asdict(settings), data, rows)
    folder = workspace.root / "discover"
    existing = made(folder / "discovery.json", DiscoveryFile)
    if existing and existing.get("key") == key:
        return {**existing, "skipped": True}
    lacking = too_little(segments, STANDARD)
    if lacking:
        summary = insufficient(settings, lacking, key, digest_of(data))
        series: Mapping[str, Array] = {}
    else:
        recordings = load_recordings(workspace, segments)
        summary, series = _discovered(workspace, settings, (segments, recordings), key, progress)
        summary["data_sha256"] = digest_of(data)
    summary["code"] = code_version("discover")
    summary["settings"] = {k: v for k, v in asdict(settings).items() if k != "jobs"}
    # a kill from here on must not leave the files of one discovery beside the key of another
    for name in ("discovery.json", "residuals.parquet"):
        (folder / name).unlink(missing_ok=True)
    if series:
        write_table(folder / "residuals.parquet", series)
    write_text(folder / "model.toml", f'[[fit]]\nmodel = "{summary["augmented_model"]}"\nper = "all"\n')
    write_json(folder / "discovery.json", summary)
    shutil.rmtree(folder / ".partial", ignore_errors=True)
    return {**plain(summary), "skipped": False}


def too_little(segments: Sequence[Segment], policy: Policy) -> str:
    """Return what the data lack for any verdict, or an empty string."""
    training = {s.condition for s in segments if s.role == "train"}
    if not any(s.role == "holdout" for s in segments):
        return (
            f"no held-out condition (conditions: {len(training)}): a verdict needs at least four, or "
            "`mrfit segment --holdout PATTERN`"
        )
    periodic = all(s.cycles for s in segments if s.role == "train")
    if periodic and len(training) < policy.fewest_training:
        return (
            "only one periodic training condition: a missing effect cannot be told from the base; log more conditions"
        )
    return ""


def insufficient(settings: Settings, lacking: str, key: str, data_key: str) -> dict[str, Any]:
    """Return the discovery of data that are too few."""
    return {
        "schema": SCHEMA,
        "base_model": settings.model,
        "verdict": "insufficient-data",
        "effects": [],
        "ambiguous_set": [],
        "advice": [lacking],
        "where": [],
        "gap": {"noise_floor": None, "before": None, "after": None, "closed": None},
        "candidates": [],
        "unexplained": {"share_of_gap": None, "where": []},
        "augmented_model": settings.model,
        "seed": settings.seed,
        "data_sha256": data_key,
        "key": key,
    }


def _discovered(
    workspace: Workspace,
    settings: Settings,
    data: tuple[Sequence[Segment], dict[str, Recording]],
    key: str,
    progress: Progress,
) -> tuple[dict[str, Any], Mapping[str, Array]]:
    """Gather evidence, select, and return discovery.json's content with the errors of every sample."""
    dependence, choice = current_dependence(settings, *data)
    found = _judged(workspace, _started(settings, dependence, choice), dependence, data, key, progress)
    if choice is not None and not choice.by_role and found.chosen.verdict == "unexplained":
        # laws of current chosen without an effect may have followed it: those of the parameters' roles have not
        usual = usual_dependence(settings, *data)
        other = _judged(workspace, settings, usual, data, f"{key} usual", progress)
        if other.chosen.verdict in ("none", "named", "ambiguous"):
            found, dependence, choice = other, usual, None
    gathering, chosen = found.gathering, found.chosen
    shown = findings(gathering, chosen, STANDARD)
    summary = {
        "schema": SCHEMA,
        "base_model": settings.model,
        **account(settings.model, chosen, shown, STANDARD),
        "seed": settings.seed,
        "data_sha256": "",
        "current_dependence": None if dependence is None else asdict(dependence),
        "current_choice": choice.about if choice else None,
        "key": key,
    }
    errors = (gathering.refit_of(fit) for fit in (chosen.base, chosen.final))
    return summary, series_of(gathering.fitter.bench, *errors)


@dataclass(frozen=True)
class _Judged:
    """What was decided with one dependence of the base on current, and what it was decided from."""

    gathering: Gathering
    chosen: Selection


def _judged(
    workspace: Workspace,
    settings: Settings,
    dependence: CurrentDependence | None,
    data: tuple[Sequence[Segment], dict[str, Recording]],
    key: str,
    progress: Progress,
) -> _Judged:
    """Gather evidence with a dependence of the base on current, and select; refits are kept under the given key."""
    fitter = _fitter(workspace, settings, dependence, data, key)
    progress("base fit", 0, 1)
    base = fitter.first(settings.seed)
    if any(not s.noise.known for s in fitter.bench.stretches):
        fitter = _with_residual_floors(fitter, base, data[1])
        base = fitter.first(settings.seed)
    progress("base fit", 1, 1)
    effects = [e for e in effects_for(base.assembly.spec.output) if e.name not in settings.model.split("+")]
    gathering = Gathering(fitter, base, effects, STANDARD, settings.seed, progress)
    return _Judged(gathering, select(gather(gathering, STANDARD), STANDARD))


def _with_residual_floors(fitter: Fitter, base: Refit, recordings: dict[str, Recording]) -> Fitter:
    """Return the fitter with the noise floors that the base's residual tells; its own fit has to be made again."""
    errors = {role: iter(found) for role, found in (("train", base.train), ("holdout", base.holdout))}
    bench = with_residual_floors(
        fitter.bench, [next(errors[s.segment.role]) for s in fitter.bench.stretches], recordings
    )
    known = {effects: point for effects, point in fitter.known.items() if effects}
    return replace(fitter, bench=bench, known=known, judged={})


def current_dependence(
    settings: Settings, segments: Sequence[Segment], recordings: dict[str, Recording]
) -> tuple[CurrentDependence | None, Choice | None]:
    """Return how the base's parameters depend on current, and how it was chosen, None where no levels were held.

    It is the choice that a joint fit makes, but see ``Choice.as_base``. A current that changes during tests counts as
    two levels. The shape of a loop, as kappa, beta, gamma and n of Bouc-Wen, then does not depend on it unless the user
    says so: it doubles the search, and Spencer and others (1997) keep it too.
    """
    name = settings.model.partition("+")[0]
    spec = base_of(name).spec
    if to_choose(name, settings.current_order, tested(segments, recordings)):
        start = tuple((n, v) for n, v in settings.start if base_name(n) in spec.names)
        alike = fit_stage.Settings(name, per="all", start=start, seed=settings.seed)
        found, choice = dependence_of(alike, usable(segments, recordings, base_of(name))[0], recordings)
        return choice.as_base() if choice else found, choice
    return usual_dependence(settings, segments, recordings), None


def usual_dependence(
    settings: Settings, segments: Sequence[Segment], recordings: dict[str, Recording], policy: Policy = STANDARD
) -> CurrentDependence | None:
    """Return how the base's parameters depend on current as asked for, or by their roles; None if they do not."""
    name = settings.model.partition("+")[0]
    spec = base_of(name).spec
    shape = [p.name for p in spec.params if p.role == "hysteresis"]
    found = dependence_on_current(name, settings.current_order, segments, recordings, shape)
    if found or settings.current_order != "auto" or takes_current(spec):
        return found
    low, high = recorded_range(recordings)
    if not high - low >= policy.least_current_range:
        return None
    orders = default_orders(spec, 3, shape) or orders_of(spec, "2")
    return CurrentDependence(orders, low, high)


def _started(settings: Settings, dependence: CurrentDependence | None, choice: Choice | None) -> Settings:
    """Return settings with the laws of current that were chosen as start values, where the user gave none."""
    if choice is None or dependence is None or choice.by_role:
        return settings
    given = {n for n, _ in settings.start}
    found = choice.start(base_of(settings.model), dependence).items()
    return replace(settings, start=(*((n, v) for n, v in found if base_name(n) not in given), *settings.start))


def _fitter(
    workspace: Workspace,
    settings: Settings,
    dependence: CurrentDependence | None,
    data: tuple[Sequence[Segment], dict[str, Recording]],
    key: str,
) -> Fitter:
    segments, recordings = data
    base = assemble(settings.model, dependence)
    bench = build_bench(segments, recordings, base, effects_for(base.spec.output), STANDARD)
    path = workspace.root / "discover" / ".partial" / "fits.json"
    stored = made(path, PartialDiscovery) or {}
    known = {}
    if stored.get("key") == key:
        known = {tuple(f["effects"]): np.array(f["point"]) for f in stored["fits"]}

    kept, writing = dict(known), Lock()

    def keep(effects: tuple[str, ...], point: Array) -> None:
        # a later run improves a fit again where this one did: it has to start where this one started
        with writing:
            kept.setdefault(effects, point)
            write_json(path, {"key": key, "fits": [{"effects": list(e), "point": p} for e, p in kept.items()]})

    return Fitter(bench, settings.model, dependence, dict(settings.start), known, keep, settings.jobs)
