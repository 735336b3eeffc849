"""Which form of an effect the data call for: the one that predicts best what was left out.

Every form is fitted to all training data. Then the range of the channel that moves the effect is cut into bands; each
band is left out in turn, the form's own parameters are fitted to the others, the base held, and the error in the band
left out is counted in units of the least error that any form, fitted to all, leaves there. The form with the least
mean error is kept, or one of fewer parameters that is not worse by more than a standard error over the bands.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import symbol_of, unit_of
from mrfit.core.specs import Array, EffectSpec, Form
from mrfit.errors import ConfigError
from mrfit.fit.files import FitOutput
from mrfit.fit.identify import build_group, weights_of
from mrfit.io.dataset import Dataset
from mrfit.io.schemas.fit import Caution, FormChoice, FormTried
from mrfit.search.chain import OptimizerChain
from mrfit.search.cube import Cube
from mrfit.search.limits import Limits, SearchContext, no_progress, own_generator
from mrfit.search.problem import LeastSquaresProblem, SegmentBlock, differences
from mrfit.settings.fit import Settings
from mrfit.simulate.assembly import Assembly

BANDS = 6
# Fewer bands with data tell no curve from a line
FORM_BANDS_MIN = 3
# Evaluations for each parameter and one more, where a form is fitted to some bands
FORM_EVALUATIONS = 150


@dataclass(frozen=True)
class FormCandidate:
    """A form, the settings of the fit with it, that fit, and the model with the current's laws that it chose."""

    form: Form
    settings: Settings
    fitted: FitOutput


@dataclass(frozen=True)
class _Band:
    """A part of a channel's range, from ``low`` up to but without ``high``."""

    channel: str
    low: float
    high: float


Identified = Callable[[Settings, str], FitOutput]
"""Fits by given settings; the word tells its unfinished searches from those of other forms."""


def with_forms(model: str) -> EffectSpec | None:
    """Return the first effect of a written model that has several forms, None if none has."""
    specs: list[EffectSpec] = [registry.load("effect", name).SPEC for name in registry.elements(model)[1]]
    return next((s for s in specs if s.forms), None)


def check(settings: Settings) -> None:
    """Refuse to choose where there is no choice.

    Raises
    ------
    ConfigError
        If no effect of the model has several forms, or conditions are fitted one by one.
    """
    if settings.forms != "evidence":
        return
    if with_forms(settings.model) is None:
        known = ", ".join(n for n in registry.names("effect") if registry.load("effect", n).SPEC.forms)
        raise ConfigError(f"--forms evidence: no effect of '{settings.model}' has several forms; {known} has")
    if settings.per != "all":
        raise ConfigError("--forms evidence compares forms over all tests together: add --per all")


def chosen(dataset: Dataset, settings: Settings, identified: Identified) -> FitOutput:
    """Return the fit with the form that the data call for.

    Parameters
    ----------
    dataset
        Segments and recordings.
    settings
        With forms by evidence, checked.
    identified
        Makes a fit.
    """
    spec = with_forms(settings.model)
    assert spec is not None
    channel, least = spec.moves[0]
    candidates = []
    for form in spec.forms:
        own = _settings(settings, spec, form)
        candidates.append(FormCandidate(form, own, identified(own, form.name)))
    blocks, weights = _training(candidates[0], dataset)
    bands = _bands(blocks, candidates[0].fitted.assembly, channel, least)
    if len(bands) < FORM_BANDS_MIN:
        return _unchosen(candidates[0], channel)
    able = [c for c in candidates if _acting(c, blocks) <= len(bands) - 2]
    errors = np.array([_left_out(c, blocks, weights, bands, settings.seed) for c in able])
    return _told(able, blocks, bands, errors)


def _settings(settings: Settings, spec: EffectSpec, form: Form) -> Settings:
    """Return the settings of a fit with a form: what is said of the effect's parameters is for its own form alone."""
    if form.effect == spec.name and not form.held:
        return replace(settings, forms="named", name=settings.fit_name)
    law, mass, driven = settings.model.partition("@")
    words = [form.effect if w == spec.name else w for w in law.split("+")]
    other = registry.load("effect", form.effect).SPEC
    neutral = dict(zip((p.name for p in other.params), other.neutral, strict=True))
    held = tuple((f"{other.name}.{n}", neutral[n]) for n in form.held)

    def kept(name: str) -> bool:
        return not name.startswith(f"{spec.name}.")

    return replace(
        settings,
        model=f"{'+'.join(words)}{mass}{driven}",
        name=settings.fit_name,
        forms="named",
        bounds=tuple(b for b in settings.bounds if kept(b[0])),
        start=tuple(s for s in settings.start if kept(s[0])),
        fixed=(*(f for f in settings.fixed if kept(f[0])), *held),
    )


def _training(candidate: FormCandidate, dataset: Dataset) -> tuple[list[SegmentBlock], Array]:
    """Return the search blocks of the training segments that the fit used, and the factor on the error of each."""
    fitted = candidate.fitted
    used = {s.id for r in fitted.content.results for s in r.segments if s.role == "train"}
    own = [s for s in dataset.segments if s.id in used or any(i.startswith(f"{s.id} ") for i in used)]
    group = build_group("all", own, dict(dataset.recordings), fitted.assembly, split=False)
    return group.search, weights_of(group.search, group.training_floors, candidate.settings.weight)


def _levels(block: SegmentBlock, assembly: Assembly, channel: str) -> Array:
    """Return a channel at the targets of a block, (B,)."""
    row = assembly.spec.inputs.index(channel)
    values: Array = block.drive[row, block.nodes[:, min(1, block.nodes.shape[1] - 1)]]
    return values


def _bands(blocks: Sequence[SegmentBlock], assembly: Assembly, channel: str, least: float) -> list[_Band]:
    """Return the bands of a channel's range that hold samples; none where it moves by less than the least."""
    levels = np.concatenate([_levels(b, assembly, channel) for b in blocks])
    low, high = float(levels.min()), float(levels.max())
    if high - low < least:
        return []
    edges = np.linspace(low, high, BANDS + 1)
    edges[-1] = np.nextafter(high, np.inf)
    pairs = zip(edges[:-1], edges[1:], strict=True)
    return [_Band(channel, float(a), float(b)) for a, b in pairs if np.any((levels >= a) & (levels < b))]


def _theta(candidate: FormCandidate) -> Array:
    return np.array([[q.value for q in candidate.fitted.content.results[0].parameters]])


def _cube(candidate: FormCandidate) -> Cube:
    """Return the cube of the form's own free parameters, all others held where the fit ended."""
    names, held = candidate.fitted.assembly.spec.names, dict(candidate.settings.fixed)
    own = [k for k, n in enumerate(names) if n.startswith(f"{candidate.form.effect}.") and n not in held]
    params = tuple(
        replace(p, start=v, low=min(p.low, v), high=max(p.high, v), fixed=False)
        for p, v in zip(candidate.fitted.assembly.spec.params, _theta(candidate)[0].tolist(), strict=True)
    )
    return Cube(params, np.array(own, dtype=np.int64))


def _acting(candidate: FormCandidate, blocks: Sequence[SegmentBlock]) -> int:
    """Return how many of the form's free parameters make a difference to the model."""
    cube, assembly = _cube(candidate), candidate.fitted.assembly
    theta = _theta(candidate)
    moved = np.repeat(theta, len(cube.free), axis=0)
    for row, k in enumerate(cube.free):
        p = cube.params[k]
        moved[row, k] += 0.1 * (p.high - p.low) * (1.0 if theta[0, k] < 0.5 * (p.low + p.high) else -1.0)
    acts = np.zeros(len(moved), dtype=bool)
    for block in blocks:
        rows = assembly.simulate(block.drive, np.vstack([theta, moved]), block.dt)
        acts |= np.any(rows[1:] != rows[0], axis=1)
    return int(acts.sum())


def _masked(block: SegmentBlock, inside: Array) -> SegmentBlock | None:
    """Return a block in which only some targets count, None where none does."""
    counts = np.where(inside, block.counts, 0.0)
    return replace(block, counts=counts, scatter=0.0) if counts.any() else None


def _squares(candidate: FormCandidate, theta: Array, blocks: Sequence[SegmentBlock], weights: Array) -> float:
    """Return the weighted mean square of the error over the samples that blocks count."""
    total = count = 0.0
    for block, weight in zip(blocks, weights, strict=True):
        delta = differences(block, candidate.fitted.assembly, theta)[0]
        total += float(weight) ** 2 * float(np.sum(block.counts * delta**2))
        count += float(block.counts.sum())
    return total / count


def _parts(
    candidate: FormCandidate, blocks: Sequence[SegmentBlock], weights: Array, band: _Band, inside: bool
) -> tuple[list[SegmentBlock], Array]:
    """Return the blocks with the samples inside a band of a channel, or outside of it, and their weights."""
    found, kept = [], []
    for block, weight in zip(blocks, weights, strict=True):
        levels = _levels(block, candidate.fitted.assembly, band.channel)
        own = _masked(block, ((levels >= band.low) & (levels < band.high)) == inside)
        if own is not None:
            found.append(own)
            kept.append(weight)
    return found, np.array(kept)


def _left_out(
    candidate: FormCandidate,
    blocks: Sequence[SegmentBlock],
    weights: Array,
    bands: Sequence[_Band],
    seed: int,
) -> Array:
    """Return rows (2, bands): mean square in each band, fitted to the others, and fitted to all."""
    cube, rows = _cube(candidate), np.empty((2, len(bands)))
    rng = np.random.default_rng([seed, *b"forms"])
    for j, band in enumerate(bands):
        others, factors = _parts(candidate, blocks, weights, band, inside=False)
        posed = LeastSquaresProblem(others, factors, candidate.fitted.assembly, cube)
        how = SearchContext(
            own_generator(rng, str(j)), Limits(FORM_EVALUATIONS * (len(cube.free) + 1)), time.monotonic(), no_progress
        )
        # from where all bands together ended: one band less moves a minimum, and makes none
        ended = OptimizerChain("lsq").search(posed, cube.start[None, :], how)
        inside, own = _parts(candidate, blocks, weights, band, inside=True)
        rows[0, j] = _squares(candidate, cube.to_theta(ended.point[None, :]), inside, own)
        rows[1, j] = _squares(candidate, _theta(candidate), inside, own)
    return rows


def _told(
    able: Sequence[FormCandidate],
    blocks: Sequence[SegmentBlock],
    bands: Sequence[_Band],
    errors: Array,
) -> FitOutput:
    """Return the fit of the form chosen by errors (forms, 2, bands), with what is to be said of the choice."""
    # data without noise leave no error to count in
    least = np.finfo(np.float64).tiny
    logs = 0.5 * np.log(np.maximum(errors[:, 0], least) / np.maximum(errors[:, 1].min(axis=0), least))
    mean, size = logs.mean(axis=1), [_acting(c, blocks) for c in able]
    best = int(np.argmin(mean))
    apart = logs - logs[best]
    spread = apart.std(axis=1, ddof=1) / np.sqrt(len(bands))
    as_good = [k for k in range(len(able)) if mean[k] - mean[best] <= spread[k]]
    taken = min(as_good, key=lambda k: (size[k], mean[k]))
    tried = [
        FormTried(form=c.form.name, model=c.settings.model, parameters=n, error=float(np.exp(m)), cost=_cost(c))
        for c, n, m in zip(able, size, mean, strict=True)
    ]
    order = sorted((k for k in range(len(able)) if k != taken), key=lambda k: mean[k])
    rejected = ", ".join(f"{tried[k].form} {tried[k].error:.3g}" for k in order)
    channel = bands[0].channel
    unit = unit_of(channel)
    text = (
        f"{able[0].form.effect}: {tried[taken].form}, by the error in {len(bands)} bands of {symbol_of(channel)} from "
        f"{bands[0].low:.3g} to {bands[-1].high:.3g} {unit} left out in turn, {tried[taken].error:.3g} times the least "
        f"of all forms fitted there; rejected: {rejected}"
    )
    if taken != best:
        text += f"; {tried[best].form} is better by less than a standard error and has more parameters"
    choice = FormChoice(
        channel=channel, bands=[(b.low, b.high) for b in bands], chosen=tried[taken].form, tried=tried, text=[text]
    )
    return _with(able[taken], choice)


def _cost(candidate: FormCandidate) -> float | None:
    pooled = candidate.fitted.content.pooled("train")
    return pooled.rmse if pooled else None


def _with(candidate: FormCandidate, choice: FormChoice) -> FitOutput:
    return replace(candidate.fitted, content=replace(candidate.fitted.content, form_choice=choice))


def _unchosen(candidate: FormCandidate, channel: str) -> FitOutput:
    """Return the fit of the form that is named, with a warning that the tests leave no choice."""
    text = (
        f"{candidate.form.effect}: the {candidate.form.name} was kept; the {channel} of the tests lies in fewer than "
        f"{FORM_BANDS_MIN} of {BANDS} bands of its range and cannot tell one form from another"
    )
    choice = FormChoice(channel=channel, chosen=candidate.form.name, text=[text])
    made = _with(candidate, choice)
    warnings = [*made.content.warnings, Caution(kind="forms-untested", text=text)]
    return replace(made, content=replace(made.content, warnings=warnings))
