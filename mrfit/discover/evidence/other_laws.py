"""The law as a finding: which other base takes how much of the gap, before and after the effects that were named.

Each is fitted once, from where its characteristic points in the data put it, and judged on held-out conditions.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core import registry
from mrfit.core.specs import ModelSpec
from mrfit.discover.evidence.fixed_effects import refitted, with_held
from mrfit.discover.evidence.refit import Fitter, Refit
from mrfit.discover.evidence.work import work_of
from mrfit.discover.policy import Policy
from mrfit.discover.writing.findings import gap_of
from mrfit.errors import MrfitError, Unreachable
from mrfit.io.schemas.discovery import DiscoveryFile, OtherLaw
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence

Dependence = Callable[[str], CurrentDependence | None]
"""How the parameters of a model depend on current, by its name."""


def slow_laws(fitter: Fitter, base: Refit, dependence: Dependence, policy: Policy) -> tuple[str, ...]:
    """Return the other bases that are too much work beside the base's own, or after all that was judged."""
    simulated = fitter.bench.simulated("train")
    own = work_of(base.assembly, simulated)
    names = tuple(candidates(fitter, base.assembly.spec.output, policy))
    late = fitter.effort.spent + fitter.bench.samples("train") * len(names) > policy.most_effort_told
    most = min(own, policy.most_work) if late else policy.most_work
    return tuple(n for n in names if own + work_of(assemble(n, dependence(n)), simulated) > most)


def other_laws(
    fitter: Fitter,
    base: Refit,
    held: Mapping[str, float],
    dependence: Dependence,
    policy: Policy,
    left_out: Collection[str] = (),
) -> tuple[OtherLaw, ...]:
    """Return the other bases with their shares of a base's gap.

    Parameters
    ----------
    fitter
        Fits the base.
    base
        The base's own fit.
    held
        Parameters of the effects that were named, by name, at the values that were found.
    dependence
        How parameters of other bases depend on current.
    policy
        How many are fitted and told of.
    left_out
        Bases that are not fitted.
    """
    laws = []
    for name in (n for n in candidates(fitter, base.assembly.spec.output, policy) if n not in left_out):
        try:
            laws.append(_law(_Question(fitter, base, held, policy), name, dependence(name)))
        except Unreachable:
            raise
        except MrfitError:
            continue  # a law that cannot be fitted to these data is no candidate
    return tuple(laws)


def worth_telling(laws: Sequence[OtherLaw], policy: Policy) -> tuple[OtherLaw, ...]:
    """Return the laws that take a visible share of the gap, effects held, the one that takes most first."""
    told = [law for law in laws if _taken(law) > policy.law_takes]
    return tuple(sorted(told, key=lambda law: -_taken(law))[: policy.most_laws])


def better_alone(found: DiscoveryFile, laws: Sequence[OtherLaw], policy: Policy) -> tuple[OtherLaw, ...]:
    """Return the laws that leave less without any effect than with those that are named, the best first.

    That is less than the base with these, and than they do themselves with these held. An effect that is there makes no
    law worse.
    """
    gap = found.gap
    before, noise = (gap.before or 0.0) ** 2, (gap.noise_floor or 0.0) ** 2

    def leaves(law: OtherLaw) -> float:
        beside = np.inf if law.takes_beside is None else before - law.takes_beside * (before - noise)
        return float(min((gap.after or 0.0) ** 2, beside))

    own = {law.model: law.holdout_nrmse for law in laws if law.holdout_nrmse is not None}
    better = [law for law in laws if law.model in own and own[law.model] ** 2 < leaves(law)]
    return tuple(sorted(better, key=lambda law: own[law.model])[: policy.most_laws])


def near_the_floor(floors: float, policy: Policy) -> bool:
    """Return whether a law errs so little that it may be taken as exact, by its error in multiples of the floor."""
    return floors <= policy.near_floor


def suits(spec: ModelSpec, output: str, channels: Collection[str], policy: Policy) -> bool:
    """Return whether a base is a law of few parameters with this output that the channels can drive."""
    able = spec.output == output and all(i in channels for i in spec.inputs)
    return able and len(spec.params) <= policy.most_law_parameters


def candidates(fitter: Fitter, output: str, policy: Policy) -> Iterator[str]:
    """Yield the bases that may be the law."""
    own = fitter.base.partition("+")[0]
    for name in registry.names("model"):
        if name != own and suits(registry.load("model", name).SPEC, output, fitter.bench.channels, policy):
            yield name


@dataclass(frozen=True)
class _Question:
    """A base with its fit, and what is held beside other laws."""

    fitter: Fitter
    base: Refit
    held: Mapping[str, float]
    policy: Policy


def _law(asked: _Question, name: str, dependence: CurrentDependence | None) -> OtherLaw:
    fitter, base, held = asked.fitter, asked.base, asked.held
    written = "+".join([name, *fitter.base.split("+")[1:]])
    other = replace(
        fitter, base=written, dependence=dependence, start={}, known={}, keep=lambda effects, point: None, judged={}
    )
    alone = other.rough(base.chi("train"))
    gap = gap_of(fitter.bench, base, alone)
    last = refitted(with_held(other, held), alone) if held else alone
    beside = gap_of(fitter.bench, base, last)
    known = all(s.noise.known for s in fitter.bench.of_role("holdout"))
    floors = last.chi("holdout")
    return OtherLaw(
        model=written,
        holdout_nrmse=gap.after,
        takes=_share(gap.before, gap.after, gap.noise_floor),
        takes_beside=_share(beside.before, beside.after, beside.noise_floor) if held else None,
        floors=floors if known else None,
        near_the_floor=known and near_the_floor(floors, asked.policy),
        command=f"mrfit discover --model {written}",
    )


def _share(before: float | None, after: float | None, floor: float | None) -> float:
    """Return the share of a gap that is taken; the noise counts for nothing where it is not known."""
    if before is None or after is None:
        return 0.0
    noise = (floor or 0.0) ** 2
    return min((before**2 - after**2) / max(before**2 - noise, 1e-300), 1.0)


def _taken(law: OtherLaw) -> float:
    return law.takes if law.takes_beside is None else law.takes_beside
