"""Evidence by simulation: the questions of a decision answered from the recordings.

The table fills while a decision is taken, since that says which refit is worth its time; ``select`` then takes the same
decision from the finished table alone.
"""

from collections.abc import Generator, Mapping, Sequence
from typing import cast

from mrfit.core import registry
from mrfit.core.progress import Progress
from mrfit.core.specs import EffectSpec
from mrfit.discover.evidence.refit import Fitter, Refit, RefitRequest, paired_z
from mrfit.discover.evidence.residual_structure import explainable, powers_by_output, repeated_error
from mrfit.discover.evidence.screen import ScreenedEffect, cosines, is_level, reach, screen
from mrfit.discover.evidence.steadiness import growths
from mrfit.discover.policy import STANDARD, Policy
from mrfit.discover.selection.exact_base import decide
from mrfit.discover.selection.questions import (
    Candidate,
    EffectScreening,
    EvidenceSource,
    Fit,
    Growth,
    Join,
    LibraryEffect,
    Repetition,
    Try,
)
from mrfit.discover.selection.record import Evidence, EvidenceRecorder


class SimulatedEvidence:
    """Answers questions by simulation; it is a ``EvidenceSource``.

    Parameters
    ----------
    fitter
        Fits assemblies to the training segments.
    base
        The fitted base.
    effects
        The library for this output.
    policy
        The thresholds that screening and the questions of the unknown noise need.
    seed
        Of the random features of the model that knows no physics.
    progress
        Reports every refit.
    """

    def __init__(
        self,
        fitter: Fitter,
        base: Refit,
        effects: Sequence[EffectSpec],
        policy: Policy,
        seed: int,
        progress: Progress,
    ) -> None:
        self.fitter = fitter
        self.library = {e.name: library_effect(e) for e in effects}
        self.noise = fitter.bench.most_noise("holdout")
        self.noise_is_told = fitter.bench.noise_is_told("holdout")
        self.progress = progress
        self._effects, self._policy, self._seed = effects, policy, seed
        self._refits: list[Refit] = []
        self._numbers: dict[int, int] = {}
        self._screened: dict[int, list[ScreenedEffect]] = {}
        self.base = self._row(base)

    def refits(self, wanted: Sequence[Try | Join], labels: Sequence[str] = ()) -> Generator[Fit, None, None]:
        """Yield refits one after the other, while processes make the descents of those to come."""
        for done, fit in enumerate(self.fitter.refits([self._wanted(one) for one in wanted]), 1):
            found = self._row(fit)
            if labels:
                self.progress(labels[done - 1], done, len(wanted))
            yield found

    def refit_of(self, fit: Fit) -> Refit:
        """Return the refit that a row stands for."""
        return self._refits[fit.number]

    def screen(self, present: Fit) -> EffectScreening:
        """Return the screening of every effect beside a fit."""
        found = screen(self.fitter, self.refit_of(present), self._effects, self._policy)
        self._screened[present.number] = found
        matrix = cosines([s for s in found if s.candidate.shown])
        return EffectScreening(present, tuple(s.candidate for s in found), tuple(tuple(row) for row in matrix.tolist()))

    def search(self, fit: Fit) -> Fit:
        """Return a fit that is searched for again from many starts."""
        return self._row(self.fitter.thorough(self.refit_of(fit)))

    def fall(self, before: Fit, after: Fit) -> float:
        """Return by how many standard errors the squared hold-out error falls."""
        return paired_z(self.refit_of(before).holdout, self.refit_of(after).holdout)

    def strength(self, fit: Fit, effect: str) -> float:
        """Return the distance of an effect of a fit from neutral, in standard errors."""
        return self.refit_of(fit).strength(effect)

    def reach(self, screened: Fit, effects: tuple[str, ...], fit: Fit) -> float:
        """Return the share of a fit's squared training error that effects could take."""
        found = [s for name in effects for s in self._screened[screened.number] if s.candidate.name == name]
        return reach(found, self.refit_of(fit), self.fitter.stride)

    def growths(self, fit: Fit, effect: str) -> tuple[Growth, ...]:
        """Return the growth of an effect's strengths over the records."""
        return growths(self.fitter, self.refit_of(fit), effect)

    def structure(self, fit: Fit) -> float:
        """Return the share of the squared hold-out error that a model predicts which knows no physics."""
        refit = self.refit_of(fit)
        return explainable(self.fitter.bench, refit.train, refit.holdout, self._seed)

    def repetition(self, fit: Fit) -> Repetition:
        """Return the part of the error that repeats from cycle to cycle."""
        bench, refit = self.fitter.bench, self.refit_of(fit)
        return Repetition(repeated_error(bench, refit), powers_by_output(bench, refit, self._policy.fewest_cycles))

    def _wanted(self, wanted: Try | Join) -> RefitRequest:
        """Return the effects of a refit and where it starts from."""
        if isinstance(wanted, Join):
            return RefitRequest(wanted.effects, wanted.starts)
        present, candidate = wanted.present, wanted.candidate
        starts = [{**present.values, **_scaled(self.fitter, candidate, factor)} for factor in STANDARD.start_distances]
        return RefitRequest((*present.effects, candidate.name), (*starts, present.values))

    def _row(self, refit: Refit) -> Fit:
        """Return the row of a refit; the same optimum has the same number."""
        number = self._numbers.setdefault(id(refit), len(self._refits))
        if number == len(self._refits):
            self._refits.append(refit)
        shapes = {e: refit.shapes(e) for e in refit.effects}
        levels = {
            e: refit.values[f"{e}.{p.name}"] / self.fitter.bench.largest
            for e in refit.effects
            for p in registry.load("effect", e).SPEC.params
            if is_level(p, refit.assembly.spec.output)
        }
        return Fit(number, refit.effects, refit.chi("train"), refit.chi("holdout"), refit.values, shapes, levels)


def gather(source: EvidenceSource, policy: Policy) -> Evidence:
    """Return all that a decision under this policy asks for, with the answers of a source."""
    recorder = EvidenceRecorder(source)
    decide(cast(EvidenceSource, recorder), policy)
    return recorder.evidence()


def library_effect(spec: EffectSpec) -> LibraryEffect:
    """Return the entry of an effect in the library, with those that are mistaken for it."""
    others: list[EffectSpec] = [registry.load("effect", n).SPEC for n in registry.names("effect")]
    mistaken = [o for o in others if spec.name in o.aliases or o.name in spec.aliases]
    same = {o.name for o in mistaken if o.slot == spec.slot == "input" and set(o.inputs) & set(spec.inputs)}
    # an alias may be a model
    aliases = {*spec.aliases, *(o.name for o in mistaken)}
    return LibraryEffect(spec.name, frozenset(aliases), frozenset(p.name for p in spec.params), frozenset(same))


def _scaled(fitter: Fitter, candidate: Candidate, factor: float) -> Mapping[str, float]:
    """Return a candidate's parameters, by name, at so many times the distance from neutral that screening found."""
    params = {p.name: p for p in fitter.assembly([candidate.name]).spec.params}
    values = {}
    for name, value in candidate.start.items():
        p = params[name]
        wanted = value if p.role == "shape" else p.start + factor * (value - p.start)
        values[name] = min(max(wanted, p.low), p.high)
    return values
