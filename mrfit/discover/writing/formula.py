"""A formula on the data of a discovery that is unexplained: its entry, with its source as a plug-in."""

import numpy as np

from mrfit.core import registry
from mrfit.discover.evidence.bench import Bench, effects_for
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.formula.plugin import source
from mrfit.discover.formula.proposal import Proposal, propose
from mrfit.discover.formula.wording import proposed
from mrfit.discover.invariance.base import base_of
from mrfit.discover.invariance.examine import lawful_base
from mrfit.discover.invariance.records import from_block
from mrfit.discover.policy import Policy
from mrfit.discover.writing.beside_open_law import not_applicable
from mrfit.io.schemas.discovery import DiscoveryFile

PLUGIN_FILE = "found_force.py"
"""Name of the plug-in beside discovery.json."""


def with_formula(found: DiscoveryFile, bench: Bench, base: Refit, policy: Policy) -> DiscoveryFile:
    """Return a discovery with the formula that was looked for, or why there is none."""
    search = _searched(bench, base, found.base_model, policy)
    entry = proposed(search)
    if entry.text and search.rows and search.formula:
        entry = entry.model_copy(update={"file": PLUGIN_FILE, "source": source(search.rows, search.formula)})
    return found.model_copy(update={"proposed": entry})


def _searched(bench: Bench, base: Refit, model: str, policy: Policy) -> Proposal:
    output = base.assembly.spec.output
    if why := not_applicable(output, bench.channels):
        return Proposal(None, why)
    fitted, held = (
        [from_block(s.block, s.names, output) for s in bench.of_role(role)] for role in ("train", "holdout")
    )
    written = model.split("+")
    effects = [registry.load("effect", e.name) for e in effects_for(output) if e.name not in written]
    try:
        records = [*fitted, *held]
        own = lawful_base(records, base_of(base.assembly, base.theta, records), effects, policy)
        return propose(fitted, held, own, policy)
    except np.linalg.LinAlgError:
        return Proposal(None, "the equations of the best law have no solution on these data")
