"""Does an effect stay the same over a record? What changes with time is a drift, which a steady effect only follows.

An effect that knows neither time nor temperature has one strength from a record's first sample to its last. It is made
to grow linearly with time; where the residual asks for a growth that is a visible share of the strength itself, it is
not this effect that was found but something that drifts.
"""

import numpy as np

from mrfit.core import registry
from mrfit.core.specs import Array
from mrfit.discover.evidence.bench import Stretch
from mrfit.discover.evidence.refit import Fitter, Refit
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.questions import Growth
from mrfit.fit.diagnostics.uncertainty import long_run_covariance, sensitivities


def growths(fitter: Fitter, fit: Refit, effect: str) -> tuple[Growth, ...]:
    """Return the growth of each strength of an effect from the middle to the end of the records.

    Nothing for effects that may change within a record, as those that know time or temperature.

    Parameters
    ----------
    fitter
        Gives the sensitivities to the parameters.
    fit
        A fit with the effect.
    effect
        Its name.
    """
    if not registry.load("effect", effect).SPEC.steady:
        return ()
    jacobian = sensitivities(fitter.residuals(fit.assembly, fit.cube), fit.point)
    errors = np.concatenate(fit.train)
    ends = np.cumsum([len(e) for e in fit.train])[:-1]
    time = np.concatenate([np.linspace(-1.0, 1.0, len(e)) for e in fit.train])
    basis = np.linalg.qr(jacobian)[0]
    found = []
    for place, distance in fit.distances(effect).items():
        grows = jacobian[:, place] * time
        free = grows - basis @ (basis.T @ grows)
        power = float(free @ free)
        if not power > STANDARD.growth_alone * float(grows @ grows):
            continue
        change = -float(free @ errors) / power
        scores = np.split((free * errors)[:, None], ends)
        spread = float(np.sqrt(sum(long_run_covariance(s)[0, 0] for s in scores))) / power
        moved = np.split(change * jacobian[:, place], ends)
        rates = tuple(_rate(stretch, by) for stretch, by in zip(fitter.bench.of_role("train"), moved, strict=True))
        found.append(Growth(change, distance, spread, rates))
    return tuple(found)


def _rate(stretch: Stretch, moved: Array) -> float:
    """Return the RMS rate of a change that moves the output by so many noise floors (N,) at the end of a record."""
    half = 0.5 * stretch.segment.samples * stretch.block.dt
    return float(np.sqrt(np.mean(moved**2))) * stretch.floor / half
