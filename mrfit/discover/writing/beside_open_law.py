"""An examination by invariances on the data of a discovery, and what is told of it beside a base taken as exact."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import MOTION
from mrfit.core.specs import Array
from mrfit.discover.evidence.bench import Bench, effects_for
from mrfit.discover.evidence.fixed_effects import refitted, with_held
from mrfit.discover.evidence.gather import SimulatedEvidence
from mrfit.discover.evidence.other_laws import Dependence, better_alone, other_laws, slow_laws, worth_telling
from mrfit.discover.evidence.refit import Fitter, Refit
from mrfit.discover.invariance.base import base_of
from mrfit.discover.invariance.examine import examine
from mrfit.discover.invariance.findings import LawFindings
from mrfit.discover.invariance.records import Record, from_block
from mrfit.discover.policy import Policy
from mrfit.discover.selection.combine import (
    CombinedResult,
    Floors,
    combine,
    leaves_noise,
    of_no_use,
    turned_down,
)
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.writing.findings import gap_of
from mrfit.discover.writing.open_law import with_examination, with_gap, with_laws
from mrfit.io.schemas.discovery import DiscoveryFile, Gap, InvariantEffect


@dataclass(frozen=True)
class OpenLawResult:
    """A discovery beside a law that may be off, and the fit of the model with what was found."""

    found: DiscoveryFile
    after: Refit


def beside_open_law(
    gathering: SimulatedEvidence,
    chosen: Selection,
    exact: DiscoveryFile,
    dependence: Dependence,
    floors: Floors,
    policy: Policy,
) -> OpenLawResult:
    """Return a discovery with what was found whatever the law is, and with other laws that take part of the gap.

    Parameters
    ----------
    gathering
        Data and fits.
    chosen
        What was decided with the base taken as exact.
    exact
        The same as discovery.json has it.
    dependence
        How parameters of other bases depend on current.
    floors
        What is known of the noise.
    policy
        The thresholds.
    """
    fitter, base = gathering.fitter, gathering.refit_of(chosen.base)
    examined = examination(fitter.bench, base, exact.base_model, gathering.refit_of(chosen.final))
    examined = with_unexamined(examined, chosen.effects)
    combined = combine(chosen, examined, policy, leaves_noise(chosen, floors, policy), floors.told, floors.noise)
    fits = _HeldFits.of(fitter, base, combined)
    while shadow := of_no_use(combined.standing, fits.without, fits.gap.after, policy):
        combined = turned_down(chosen, combined, shadow, policy, floors.noise)
        fits = _HeldFits.of(fitter, base, combined)
    found = with_examination(exact, combined, examined, base.assembly.spec.output, policy)
    held = held_at(combined.standing)
    open_law = combined.law_is_open or combined.taken_back
    after = fits.after if open_law else gathering.refit_of(chosen.final)
    if combined.law_is_open:
        found = with_gap(found, fits.gap, fits.without)
    compared = not examined.not_applicable and (combined.law_may_be_off or bool(chosen.final.effects))
    if compared and (
        combined.law_may_be_off
        or fitter.effort.allows(policy.most_effort_told, "fits of other laws, and what these lack")
    ):
        slow = slow_laws(fitter, base, dependence, policy)
        laws = other_laws(fitter, base, held, dependence, policy, slow)
        told = worth_telling(laws, policy) if combined.law_may_be_off else better_alone(found, laws, policy)
        found = with_laws(found, told, slow)
    return OpenLawResult(found, after)


@dataclass(frozen=True)
class _HeldFits:
    """Fits of a base beside effects that stand whatever its law is, held at what was found.

    Attributes
    ----------
    after
        The fit with all of them, the base where there are none.
    gap
        What it takes of the base's error on held-out conditions.
    without
        Error on held-out conditions (NRMSE) without each of them, the others held.
    """

    after: Refit
    gap: Gap
    without: Mapping[str, float | None]

    @classmethod
    def of(cls, fitter: Fitter, base: Refit, combined: CombinedResult) -> "_HeldFits":
        """Return the fits for the effects that stand."""

        def fitted(effects: Iterable[InvariantEffect]) -> Refit:
            held = held_at(effects)
            return refitted(with_held(fitter, held), base) if held else base

        standing = combined.standing
        after = fitted(standing)
        without = {
            own.name: gap_of(fitter.bench, base, fitted(n for n in standing if n is not own)).after for own in standing
        }
        return cls(after, gap_of(fitter.bench, base, after), without)


def with_unexamined(examined: LawFindings, effects: Collection[str]) -> LawFindings:
    """Return findings in which effects are sets with those of a base taken as exact that break the same, unexamined."""

    def one_of(found: InvariantEffect) -> tuple[str, ...]:
        breaks = registry.load("effect", found.name).SPEC.breaks
        others = breaks.unexamined if breaks else ()
        return (*found.one_of, *(e for e in others if e in effects and e not in found.one_of))

    return replace(examined, named=tuple(n.model_copy(update={"one_of": one_of(n)}) for n in examined.named))


def examination(bench: Bench, base: Refit, model: str, exact: Refit | None = None) -> LawFindings:
    """Return the effects that are there whatever the law is, on fitted and held-out conditions together.

    Parameters
    ----------
    bench
        The data.
    base
        The fitted base alone.
    model
        Its written name; effects written with it are part of it.
    exact
        A model taken as exact, to compare with the best law; None for none.
    """
    output = base.assembly.spec.output
    if why := not_applicable(output, bench.channels):
        return LawFindings(not_applicable=why)
    records = [from_block(s.block, s.names, output) for s in bench.stretches]
    written = model.split("+")
    effects = [registry.load("effect", e.name) for e in effects_for(output) if e.name not in written]
    try:
        left = left_by(bench, records, exact) if exact else ()
        return examine(records, base_of(base.assembly, base.theta, records), effects, exact=left)
    except np.linalg.LinAlgError:
        return LawFindings(not_applicable="the equations of the best law have no solution on these data")


def not_applicable(output: str, channels: Collection[str]) -> str:
    """Return the reason for which records of an output cannot be examined, empty if they can.

    The invariances are those of forces and torques that a motion makes. A flux follows a current: its law is odd and
    forgets as well, but the current is its motion and its control at once, and its integrated record knows the time.
    """
    if output not in MOTION:
        return f"no law of {output} is known to keep invariances"
    lacking = [name for name in MOTION[output] if name not in channels]
    return f"no {lacking[0]}" if lacking else ""


def left_by(bench: Bench, records: Sequence[Record], fit: Refit) -> list[Array]:
    """Return the residual of a model for every record, as means over as many samples as the record has them."""
    errors, found = {"train": iter(fit.train), "holdout": iter(fit.holdout)}, []
    for stretch, record in zip(bench.stretches, records, strict=True):
        own, every = next(errors[stretch.segment.role]) * stretch.floor, int(round(record.dt / stretch.block.dt))
        found.append(own[: every * len(record.output)].reshape(-1, every).mean(axis=1))
    return found


def held_at(effects: Iterable[InvariantEffect]) -> dict[str, float]:
    """Return the parameters of effects by their name in a model, at the values that were found."""
    return {f"{e.name}.{p.name}": p.value for e in effects for p in e.parameters}
