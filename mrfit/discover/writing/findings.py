"""Findings of a decision, measured before it is written: gaps, intervals, regions, alternatives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core import registry
from mrfit.core.specs import Array, EffectSpec
from mrfit.discover.evidence.bench import Bench, Stretch
from mrfit.discover.evidence.gather import SimulatedEvidence
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.policy import Policy
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.selection.questions import Fit, Join, refit
from mrfit.discover.writing.regions import Region, beyond_training, locate
from mrfit.discover.writing.residual_shape import residual_shapes
from mrfit.discover.writing.tests_already_made import still_to_do
from mrfit.errors import DataError
from mrfit.fit.result import parameter_rows
from mrfit.io.schemas.discovery import Drifting, EffectParameter, FoundEffect, Gap, Look, Suspect
from mrfit.signal.drift import steady_drift


@dataclass(frozen=True)
class Findings:
    """All that is written of a decision.

    Attributes
    ----------
    gap
        Without and with all accepted effects.
    named, suspects
        Effects that are accepted, and those that may take part.
    where, rest
        Regions of the error without any effect, and of what is left; the one with the largest excess first.
    looks
        How what is left looks over each channel; empty where too little is left to speak of.
    share_left
        Share of the gap without a name, None if the noise floor is not known.
    drifts
        Records that drift, and those with a drift that an effect only followed.
    beyond
        Inputs that held-out tests take further than the training tests did, in words.
    advice
        What to log next.
    stretches
        The segments, and the range of the output that errors are shares of.
    span
        That range.
    """

    gap: Gap
    named: tuple[FoundEffect, ...]
    suspects: tuple[Suspect, ...]
    where: tuple[Region, ...]
    rest: tuple[Region, ...]
    looks: tuple[Look, ...]
    share_left: float | None
    drifts: tuple[Drifting, ...]
    beyond: tuple[str, ...]
    advice: tuple[str, ...]
    stretches: tuple[Stretch, ...]
    span: float

    def tells_of_the_rest(self, policy: Policy) -> bool:
        """Return whether enough is left without a name to say where it lies and how it looks."""
        return self.share_left is None or self.share_left > policy.worth_telling


def findings(gathering: SimulatedEvidence, chosen: Selection, policy: Policy) -> Findings:
    """Return the findings of a decision; refits that only show alternatives are made here."""
    bench = gathering.fitter.bench
    before, after = gathering.refit_of(chosen.base), gathering.refit_of(chosen.final)
    gap = gap_of(bench, before, after)
    share = None if gap.noise_floor is None else 1.0 - (gap.closed or 0.0)
    taken_back = _taken_back(gathering, chosen)
    named = tuple(_named(gathering, chosen, name) for name in chosen.named)
    standing = {e: group[0] for group in chosen.ambiguous for e in group}
    undecided = [_swapped(gathering, chosen, chosen.final, (standing[e], e)) for e in sorted(standing)]
    specs = {e: registry.load("effect", e).SPEC for e in registry.names("effect")}
    return Findings(
        gap=gap,
        named=named,
        suspects=(*undecided, *taken_back),
        where=tuple(regions_of(bench, before)),
        rest=tuple(regions_of(bench, after)),
        looks=tuple(residual_shapes(bench, after)) if share is None or share > policy.worth_telling else (),
        share_left=share,
        drifts=(*drifts_of(bench, after), *_followed(bench, chosen)),
        beyond=tuple(beyond_training(bench, policy)),
        advice=(
            *(_test(specs[s.name], bench) for s in (undecided or taken_back)),
            *_unknown_noise(bench, chosen.verdict),
        ),
        stretches=bench.stretches,
        span=bench.span,
    )


TESTS_MADE = "the tests that would show it are in these data; another one depends on what the rig can do"
"""Advice on an effect whose tests have been made."""


def _test(effect: EffectSpec, bench: Bench) -> str:
    """Return the test that would tell an effect from others, of those that have not been made."""
    test = still_to_do(effect, [s.segment for s in bench.stretches])
    return f"{effect.name}: {test or TESTS_MADE}"


def gap_of(bench: Bench, before: Refit, after: Refit) -> Gap:
    """Return noise floor and errors as NRMSE on held-out conditions, and the share of the gap closed.

    Raises
    ------
    DataError
        If a simulation of held-out conditions diverged.
    """
    floors = [s.floor for s in bench.of_role("holdout")]
    counts = [s.segment.samples for s in bench.of_role("holdout")]
    floor = float(np.sqrt(np.average(np.square(floors), weights=counts)))
    errors = [_rms(fit.holdout, floors) for fit in (before, after)]
    if not np.all(np.isfinite(errors)):
        raise DataError("a simulation of held-out conditions diverged; choose another base model")
    span = bench.span
    above = errors[0] ** 2 - floor**2
    # an error below the floor by chance closes all of the gap, not more
    closed = min((errors[0] ** 2 - errors[1] ** 2) / above, 1.0) if above > 0 else None
    known = all(s.noise.known for s in bench.of_role("holdout"))
    return Gap(
        noise_floor=floor / span if known else None,
        before=errors[0] / span,
        after=errors[1] / span,
        closed=closed if known else None,
    )


def _rms(errors: Sequence[Array], floors: Sequence[float]) -> float:
    physical = np.concatenate([e * f for e, f in zip(errors, floors, strict=True)])
    return float(np.sqrt(np.mean(physical**2)))


def regions_of(bench: Bench, fit: Refit) -> list[Region]:
    """Return the regions in which a fit errs, over training and held-out segments together."""
    stretches = [*bench.of_role("train"), *bench.of_role("holdout")]
    errors = [e * s.floor for e, s in zip([*fit.train, *fit.holdout], stretches, strict=True)]
    return locate(bench, errors, stretches)


def drifts_of(bench: Bench, fit: Refit) -> list[Drifting]:
    """Return one row per record in which the output drifts steadily, where a fit does not explain it."""
    rows = []
    for role, errors in (("train", fit.train), ("holdout", fit.holdout)):
        for stretch, error in zip(bench.of_role(role), errors, strict=True):
            residual, segment = -error * stretch.floor, stretch.segment
            found = steady_drift(residual, stretch.measured + error * stretch.floor, stretch.block.dt, segment.cycles)
            level, gain = stretch.level_rate, 0.0
            if found is not None:
                level = level or (found.level_rate if np.any(found.level) else 0.0)
                gain = found.gain_rate if np.any(found.gain) else 0.0
            if level or gain:
                rows.append(Drifting(condition=segment.condition, segment=segment.id, level_rate=level, gain_rate=gain))
    return rows


def intervals_of(fit: Refit, effect: str) -> tuple[EffectParameter, ...]:
    """Return an effect's parameters with intervals; not those that this model holds."""
    return tuple(
        EffectParameter(name=row.name.partition(".")[2], unit=row.unit, value=row.value, low=row.low, high=row.high)
        for row in parameter_rows(fit.cube, fit.point, fit.uncertainty)
        if row.name.startswith(effect + ".") and not row.fixed
    )


def _named(gathering: SimulatedEvidence, chosen: Selection, name: str) -> FoundEffect:
    final, rest = chosen.final, tuple(e for e in chosen.final.effects if e != name)
    without = refit(gathering, Join(rest, (final.values,))) if rest else chosen.base
    after = gathering.refit_of(final)
    gap = gap_of(gathering.fitter.bench, gathering.refit_of(without), after)
    return FoundEffect(
        name=name,
        parameters=intervals_of(after, name),
        holdout_nrmse_before=gap.before,
        holdout_nrmse_after=gap.after,
    )


def _taken_back(gathering: SimulatedEvidence, chosen: Selection) -> list[Suspect]:
    """Return the effects that were taken back, and then those that could stand instead of one of them."""
    if not chosen.taken_back:
        return []
    fit = chosen.proven
    others = [
        _swapped(gathering, chosen, fit, (own, other), own)
        for own, *rivals in chosen.doubtful
        for other in rivals
        if other not in fit.effects
    ]
    return [*(_suspect(gathering, chosen, fit, e) for e in fit.effects), *others]


def _swapped(
    gathering: SimulatedEvidence, chosen: Selection, fit: Fit, swap: tuple[str, str], instead_of: str = ""
) -> Suspect:
    """Return the second of two effects in a fit in place of the first, from which it cannot be told."""
    own, other = swap
    effects = tuple(other if e == own else e for e in fit.effects)
    return _suspect(gathering, chosen, refit(gathering, Join(effects, (fit.values,))), other, instead_of)


def _suspect(gathering: SimulatedEvidence, chosen: Selection, fit: Fit, name: str, instead_of: str = "") -> Suspect:
    fitted = gathering.refit_of(fit)
    gap = gap_of(gathering.fitter.bench, gathering.refit_of(chosen.base), fitted)
    found = Suspect(name=name, parameters=intervals_of(fitted, name), holdout_nrmse_after=gap.after, closed=gap.closed)
    return found.model_copy(update={"instead_of": instead_of}) if instead_of else found


def _followed(bench: Bench, chosen: Selection) -> list[Drifting]:
    return [
        Drifting(condition=stretch.segment.condition, segment=stretch.segment.id, follows=one.effect, rate=rate)
        for one in chosen.drifting
        for stretch, rate in zip(bench.of_role("train"), one.growth.rates, strict=True)
    ]


def _unknown_noise(bench: Bench, verdict: str) -> list[str]:
    if verdict != "insufficient-data":
        return []
    conditions = sorted({s.segment.condition for s in bench.of_role("holdout") if not s.noise.known})
    return [
        f"the noise floor of {', '.join(conditions)} is not known, and the error is within its bounds: log each "
        "of these tests twice with the same drive, or some tests of ten steady cycles, to tell noise from the rest"
    ]


def series_of(bench: Bench, before: Refit, after: Refit) -> Mapping[str, Array]:
    """Return measured output and errors before and after for every sample, with segment numbers, for the page."""
    names = ("segment", "holdout", "time", "measured", "before", "after")
    columns: dict[str, list[Array]] = {name: [] for name in names}
    for role, first, last in (("train", before.train, after.train), ("holdout", before.holdout, after.holdout)):
        for stretch, b, a in zip(bench.of_role(role), first, last, strict=True):
            count = len(b)
            columns["segment"].append(np.full(count, float(bench.stretches.index(stretch))))
            columns["holdout"].append(np.full(count, float(role == "holdout")))
            columns["time"].append(stretch.recorded + np.arange(count, dtype=np.float64) * stretch.block.dt)
            columns["measured"].append(stretch.measured)
            columns["before"].append(b * stretch.floor)
            columns["after"].append(a * stretch.floor)
    return {name: np.concatenate(parts) for name, parts in columns.items()}
