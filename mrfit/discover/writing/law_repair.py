"""The terms that a base's law lacks, on the data of a discovery that is unexplained: their entry, with a plug-in."""

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.discover.evidence.bench import Bench
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.invariance.records import from_block
from mrfit.discover.policy import STANDARD, Policy
from mrfit.discover.repair.plugin import source
from mrfit.discover.repair.proposal import Repair, repaired
from mrfit.discover.repair.rows import FittedBase, fitted_base
from mrfit.discover.writing.beside_open_law import left_by, not_applicable
from mrfit.io.schemas.discovery import DiscoveryFile, EffectParameter, LawRepair

REPAIR_FILE = "lacking_force.py"
"""Name of the plug-in beside discovery.json."""


def with_law_repair(found: DiscoveryFile, bench: Bench, base: Refit, policy: Policy) -> DiscoveryFile:
    """Return a discovery with the terms that the law lacks, or why none is known."""
    output = base.assembly.spec.output
    if why := not_applicable(output, bench.channels):
        return found.model_copy(update={"lacking": LawRepair(reason=why)})
    try:
        repair = repaired(*base_on(bench, base), policy)
    except np.linalg.LinAlgError:
        repair = Repair((), "the equations of the base and a term have no solution on these data")
    laws = [o for o in found.other_laws if o.holdout_nrmse is not None]
    best = min(laws, key=lambda o: o.holdout_nrmse or 0.0, default=None)
    entry = entry_of(repair, output)
    if best and not entry.reason:
        entry = entry.model_copy(update={"other_law": best.model, "other_error": best.holdout_nrmse})
    return found.model_copy(update={"lacking": entry})


def base_on(bench: Bench, base: Refit) -> tuple[FittedBase, FittedBase]:
    """Return a fitted base on the training records, and on those that are held out."""
    records = [from_block(s.block, s.names, base.assembly.spec.output) for s in bench.stretches]
    left = left_by(bench, records, base)
    roles = [s.segment.role for s in bench.stretches]

    def of(role: str) -> FittedBase:
        own = [k for k, r in enumerate(roles) if r == role]
        return fitted_base(base, [records[k] for k in own], [left[k] for k in own])

    return of("train"), of("holdout")


def entry_of(repair: Repair, output: str) -> LawRepair:
    """Return the entry of a search on records of an output."""
    rows, choice, theta, spread = repair.rows, repair.choice, repair.theta, repair.spread
    if repair.why or rows is None or choice is None or theta is None or spread is None:
        return LawRepair(reason=repair.why, chance=repair.chance)
    span, unit, terms = rows.scales.span, unit_of(output), []
    for k, (term, value, error) in enumerate(zip(repair.terms, theta * span, spread * span, strict=True)):
        half = float(np.hypot(STANDARD.formula_interval * error, STANDARD.accuracy * value))
        name = f"f{k + 1}: {term.text(rows.scales)}"
        terms.append(EffectParameter(name=name, unit=unit, value=value, low=value - half, high=value + half))
    own = repair.terms[0].operator.title
    alike = dict.fromkeys(rows.terms[p].operator.title for p in choice.steps[0].alike)
    before, after = repair.errors or (None, None)
    return LawRepair(
        titles=tuple(t.operator.title for t in repair.terms),
        coefficients=tuple(terms),
        alike=tuple(a for a in alike if a != own),
        file=REPAIR_FILE,
        source=source(repair.terms, theta, rows.scales, output),
        takes=choice.first.takes,
        chance=repair.chance,
        before=before,
        after=after,
    )
