"""Does an effect stay the same over a record? What changes with time is a drift, which a steady effect only follows.

An effect that knows neither time nor temperature has one strength from a record's first sample to its last. It is made
to grow linearly with time; where the residual asks for a growth that is a visible share of the strength itself, it is
not this effect that was found but something that drifts.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mrfit.core import registry
from mrfit.core.specs import Array
from mrfit.discover.refit import Fitter, Refit
from mrfit.fit.diagnostics.uncertainty import long_run_covariance, sensitivities

# Effects that know these may change within a record
KNOWING = {"time", "temperature"}
# Change from the middle of a record to its end, as a share of the strength, and its standard errors
CHANGES, STANDARD_ERRORS = 0.2, 4.0


@dataclass(frozen=True)
class Change:
    """How an effect's strength changes within the records.

    Attributes
    ----------
    share
        Change from the middle of a record to its end, as a share of the strength.
    rows
        For each training record ``condition``, ``segment``, ``follows``, the effect, and ``rate``, the RMS change
        of the output in its unit per second.
    """

    share: float
    rows: list[dict[str, Any]]


def change_within_records(fitter: Fitter, fit: Refit, effect: str) -> Change | None:
    """Return how an effect's strength changes from the middle to the end of the records.

    None where the change is small or may be chance, and for effects that know time or temperature.

    Parameters
    ----------
    fitter
        Gives the sensitivities to the parameters.
    fit
        A fit with the effect.
    effect
        Its name.
    """
    spec = registry.load("effect", effect).SPEC
    if KNOWING & set(spec.inputs):
        return None
    jacobian = sensitivities(fitter.residuals(fit.assembly, fit.cube), fit.point)
    errors = np.concatenate(fit.train)
    ends = np.cumsum([len(e) for e in fit.train])[:-1]
    time = np.concatenate([np.linspace(-1.0, 1.0, len(e)) for e in fit.train])
    basis = np.linalg.qr(jacobian)[0]
    for place, distance in fit.distances(effect).items():
        grows = jacobian[:, place] * time
        free = grows - basis @ (basis.T @ grows)
        power = float(free @ free)
        if not power > 1e-12 * float(grows @ grows):
            continue
        change = -float(free @ errors) / power
        scores = np.split((free * errors)[:, None], ends)
        spread = float(np.sqrt(sum(long_run_covariance(s)[0, 0] for s in scores))) / power
        if abs(change) > max(CHANGES * abs(distance), STANDARD_ERRORS * spread):
            return Change(change / distance, _rows(fitter, effect, np.split(change * jacobian[:, place], ends)))
    return None


def _rows(fitter: Fitter, effect: str, moved: list[Array]) -> list[dict[str, Any]]:
    """Return the rows of a change that moves the output by so many noise floors (N_s,) at the end of each record."""
    rows: list[dict[str, Any]] = []
    for stretch, by in zip(fitter.bench.of_role("train"), moved, strict=True):
        half = 0.5 * stretch.segment.samples * stretch.block.dt
        rate = float(np.sqrt(np.mean(by**2))) * stretch.floor / half
        names = {"condition": stretch.segment.condition, "segment": stretch.segment.id, "follows": effect}
        rows.append({**names, "rate": rate})
    return rows
