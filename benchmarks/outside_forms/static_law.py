"""The baseline: the same grammar, search and tests beside a law of the speed and the current alone."""

from __future__ import annotations

from collections.abc import Sequence
from unittest.mock import patch

import mrfit
from benchmarks.formula import searched
from mrfit.core.specs import Array
from mrfit.discover.formula.proposal import Proposal
from mrfit.discover.invariance import nuisance, setting


def _static(motion: nuisance.RecordMotion, control: Array, dt: float, scales: nuisance.Scales) -> nuisance.Columns:
    """Return the columns of a nuisance that know no travel and no memory."""
    whole = nuisance.columns(motion, control, dt, scales)
    last = whole.ends[1]
    return nuisance.Columns(whole.values[:, :last], tuple(min(end, last) for end in whole.ends))


def searched_beside_a_static_law(logs: Sequence[mrfit.Recording]) -> Proposal:
    """Return what the search ends with where a base without memory, fitted with it, takes the place of every law."""
    with patch.object(setting, "columns", _static):
        return searched(logs)
