"""Contribution of an effect that is not named, sample by sample, in the fit in which it had its proof.

Its force is what the output loses when it alone is set to neutral; the remainder is what is then left of the
measurement.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from mrfit.core.specs import Array
from mrfit.discover.evidence.gather import SimulatedEvidence
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.selection.questions import Fit, Join, refit
from mrfit.io.schemas.discovery import Suspect


def contributions(gathering: SimulatedEvidence, chosen: Selection, suspects: Sequence[Suspect]) -> Mapping[str, Array]:
    """Return columns ``with NAME`` and ``without NAME``: errors of every sample, in the order of ``series_of``."""
    columns: dict[str, Array] = {}
    for suspect in suspects:
        if f"with {suspect.name}" not in columns:
            found = gathering.refit_of(_fit_of(gathering, chosen, suspect))
            columns[f"with {suspect.name}"] = _errors(gathering, found, found.theta[None, :])
            columns[f"without {suspect.name}"] = _errors(gathering, found, found.neutral_theta(suspect.name))
    return columns


def _fit_of(gathering: SimulatedEvidence, chosen: Selection, suspect: Suspect) -> Fit:
    """Return the fit that a suspect's parameters were told of."""
    name, fit = suspect.name, chosen.proven if chosen.taken_back else chosen.final
    if name in fit.effects:
        return fit
    standing = {e: group[0] for group in (*chosen.ambiguous, *chosen.doubtful) for e in group}
    own = suspect.instead_of or standing[name]
    return refit(gathering, Join(tuple(name if e == own else e for e in fit.effects), (fit.values,)))


def _errors(gathering: SimulatedEvidence, refit: Refit, theta: Array) -> Array:
    bench, found = gathering.fitter.bench, list[Array]()
    for role in ("train", "holdout"):
        errors = bench.errors(refit.assembly, theta, role)
        found += [e[0] * s.floor for e, s in zip(errors, bench.of_role(role), strict=True)]
    return np.concatenate(found)
