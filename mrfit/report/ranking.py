"""Fits in the order of their merit: error on held-out data, information criteria, parameters determined."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from mrfit.io.schemas.fit import Fit
from mrfit.report.determined import Count, count_of


@dataclass(frozen=True)
class RankedFit:
    """A fit beside others.

    Attributes
    ----------
    fit
        The fit.
    place
        1 for the best of those that predict the same output.
    sets
        Sets of parameters.
    count
        How many parameters, of all sets together, the data determine.
    train, holdout
        RMS error over the range of the output in all conditions of the role; None if there is none.
    floor
        Noise floor on the same scale, of held-out data, else of training.
    aic, bic
        Criteria of Akaike and of Schwarz on the training data; None where the simulation diverged.
    samples
        Training samples; criteria of other numbers of samples cannot be compared.
    held_out, judged_samples
        The data it was judged on: kind, and number of samples.
    """

    fit: Fit
    place: int
    sets: int
    count: Count
    train: float | None
    holdout: float | None
    floor: float | None
    aic: float | None
    bic: float | None
    samples: int
    held_out: str
    judged_samples: int

    @property
    def judged(self) -> float | None:
        """The error by which it is ranked: on held-out data, in training where nothing was held out."""
        return self.train if self.held_out == HELD_OUT[3] else self.holdout

    @property
    def diverged(self) -> bool:
        """Whether its simulation has left the measured data."""
        return has_diverged(self.judged)


def ranked(fits: Sequence[Fit]) -> list[RankedFit]:
    """Return fits by output, then by error on held-out data; those without such data last, by their training error."""
    ordered = sorted(fits, key=merit)
    rows: list[RankedFit] = []
    for fit in ordered:
        place = 1 + sum(r.fit.output == fit.output for r in rows)
        rows.append(_row(fit, place))
    return [row for group in comparable(rows) for row in _with_floors(group)]


def _with_floors(rows: Sequence[RankedFit]) -> list[RankedFit]:
    """Return fits judged on the same data with the noise floor of these data, where any of the fits tells it."""
    known = [r.floor for r in rows if r.floor is not None]
    return [replace(r, floor=min(known)) if known and r.floor is None else r for r in rows]


HELD_OUT = ("conditions", "conditions and cycles", "other cycles", "nothing")
"""What a fit may be judged on, the hardest first."""
DIVERGED = 1.0
"""NRMSE above which a simulation has left the measured data: a constant inside their range does better."""


def has_diverged(nrmse: float | None) -> bool:
    """Return whether the error of a simulation is larger than the range of the measured output, or not a number."""
    return nrmse is None or not nrmse <= DIVERGED


BEST = 3
"""Fits of an output that a report shows in full, and draws before any is chosen."""


def merit(fit: Fit) -> tuple[str, int, int, float]:
    """Return the sorting key of a fit: output, kind of data it was judged on, samples of these, error.

    Fits that were judged on other cycles of conditions they had seen come after those judged on whole conditions; fits
    judged on fewer samples, where logs had to be left out, after those judged on more.
    """
    judged = fit.pooled("holdout") or fit.pooled("train")
    nrmse = judged.nrmse if judged else None
    samples = judged.samples if judged else 0
    return fit.output, HELD_OUT.index(held_out(fit)), -samples, math.inf if nrmse is None else nrmse


def comparable(rows: Sequence[RankedFit]) -> list[list[RankedFit]]:
    """Return ranked fits in groups that were judged on the same data: their errors alone can be compared."""
    alike = groupby(rows, key=lambda r: (r.fit.output, r.held_out, r.judged_samples))
    return [list(group) for _, group in alike]


def best(fits: Sequence[Fit], count: int) -> list[str]:
    """Return the names of the best fits of each output, those that diverged only where there is no other."""
    chosen: list[str] = []
    rows = ranked(fits)
    for output in dict.fromkeys(r.fit.output for r in rows):
        own = [r for r in rows if r.fit.output == output]
        chosen += [r.fit.name for r in [r for r in own if not r.diverged][:count] or own[:1]]
    return chosen


def _row(fit: Fit, place: int) -> RankedFit:
    train, holdout = fit.pooled("train"), fit.pooled("holdout")
    judged = holdout or train
    count = count_of(fit)
    aic, bic = criteria(train.mse, train.samples, count.free) if train else (None, None)
    return RankedFit(
        fit=fit,
        place=place,
        sets=len(fit.results),
        count=count,
        train=train.nrmse if train else None,
        holdout=holdout.nrmse if holdout else None,
        floor=judged.relative_floor if judged else None,
        aic=aic,
        bic=bic,
        samples=train.samples if train else 0,
        held_out=held_out(fit),
        judged_samples=judged.samples if judged else 0,
    )


def criteria(mse: float | None, samples: int, parameters: int) -> tuple[float | None, float | None]:
    """Return AIC and BIC of a fit with normal errors of one unknown variance.

    AIC = n·ln(mse) + 2·(k + 1), BIC = n·ln(mse) + (k + 1)·ln n, each up to the same constant of the data (Burnham and
    Anderson, Model Selection and Multimodel Inference, 2002, section 2.2).

    Parameters
    ----------
    mse
        Mean squared error over the training data, in the output's unit squared.
    samples
        Their number n.
    parameters
        Fitted parameters k.
    """
    if not mse or not math.isfinite(mse) or samples < 1:
        return None, None
    deviance, k = samples * math.log(mse), parameters + 1
    return deviance + 2.0 * k, deviance + k * math.log(samples)


def above_best(rows: Sequence[RankedFit], row: RankedFit, name: str) -> float | None:
    """Return by how much a criterion exceeds the least one of fits of the same output on as many training samples."""
    alike = [r for r in rows if r.fit.output == row.fit.output and r.samples == row.samples]
    values = [v for v in (getattr(r, name) for r in alike) if v is not None]
    own = getattr(row, name)
    return None if own is None or len(values) < 2 else own - min(values)


def held_out(fit: Fit) -> str:
    """Return the kind of hold-out data: whole conditions, or other cycles of fitted ones."""
    seen, judged = ({m.condition for m in fit.rows(role)} for role in ("train", "holdout"))
    if not judged:
        return HELD_OUT[3]
    if judged <= seen:
        return HELD_OUT[2]
    return HELD_OUT[1] if judged & seen else HELD_OUT[0]
