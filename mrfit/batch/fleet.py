"""Statistics of many logs: distribution of every parameter, outliers and drifts.

Logs are compared within one condition. All measures are robust: a few bad logs move none of them.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from mrfit.core.counting import number_of
from mrfit.core.specs import Array
from mrfit.io.schemas.batch import LogRow
from mrfit.report.numbers import natural

RESIDUAL = "NRMSE"
"""What an outlier by residual is an outlier of."""
# Logs of one condition from which a distribution is judged, and a drift
FEWEST, FEWEST_FOR_DRIFT = 8, 20
# Robust z-score of an outlier at least (Iglewicz and Hoaglin 1993); of many values it is more, see LISTED_SHARE
LEAST_Z = 3.5
# Values that would be listed in a batch of sound logs, on average: the level of all tests together
LISTED_SHARE = 0.05
# Standard deviations in a median absolute deviation, of a normal distribution
TO_SIGMA = 1.4826
# Share of the logs at either end whose medians tell how far a drift went
ENDS = 0.1
# The beginning of another date is no time of day
DATE = re.compile(
    r"(?<!\d)(20\d\d)[-_.]?(\d\d)[-_.]?(\d\d)"
    r"(?:[T_ -]?(?!20\d\d([-_.])(?:0[1-9]|1[0-2])\4(?:0[1-9]|[12]\d|3[01])(?!\d))"
    r"(\d\d)[-_:.h]?(\d\d)(?:[-_:.m]?(\d\d))?)?(?!\d)"
)


@dataclass(frozen=True)
class Group:
    """Values of one parameter, or the residual, of one condition over the logs in their order.

    Attributes
    ----------
    parameter, condition, unit
        What they are of.
    logs
        Their logs.
    values
        The values (N,).
    widths
        Half of their 95 % intervals (N,), nan where one is open.
    current
        Coil current of the condition in A, nan where none is held.
    """

    parameter: str
    condition: str
    unit: str
    logs: tuple[str, ...]
    values: Array
    widths: Array
    current: float = math.nan

    @property
    def median(self) -> float:
        """The middle value."""
        return float(np.median(self.values))

    @property
    def sigma(self) -> float:
        """Robust standard deviation."""
        return TO_SIGMA * float(np.median(np.abs(self.values - self.median)))


@dataclass(frozen=True)
class Outlier:
    """A value far from those of the other logs; ``z`` in robust standard deviations."""

    log: str
    condition: str
    parameter: str
    unit: str
    value: float
    median: float
    z: float


@dataclass(frozen=True)
class Drift:
    """A trend of a parameter over the logs; ``change`` between both ends in robust standard deviations."""

    parameter: str
    condition: str
    unit: str
    first: float
    last: float
    change: float
    correlation: float


@dataclass(frozen=True)
class Fleet:
    """All logs together.

    Attributes
    ----------
    groups
        Values by parameter and condition; the residual last.
    outliers, drifts
        The clearest first.
    dated
        Whether the names of all logs give their time, by which they are ordered; else the names order them.
    """

    groups: tuple[Group, ...]
    outliers: tuple[Outlier, ...]
    drifts: tuple[Drift, ...]
    dated: bool

    @property
    def most(self) -> int:
        """Number of logs of the condition that most have."""
        return max((len(g.values) for g in self.groups), default=0)

    @property
    def is_apart(self) -> bool:
        """Whether no two logs have a condition in common, so that none can be compared with another."""
        return self.most == 1


def findings(outliers: int, drifts: int, most: int) -> str:
    """Return the numbers of outliers and drifts in words, where so many logs of one condition allow to look for any."""
    if most < FEWEST:
        return f"outliers and drifts not looked for, no condition has {FEWEST} logs"
    if most < FEWEST_FOR_DRIFT:
        return f"{number_of('outlier', outliers)}, drifts not looked for, no condition has {FEWEST_FOR_DRIFT} logs"
    return f"{number_of('outlier', outliers)}, {number_of('drift', drifts)}"


def fleet_of(rows: Sequence[LogRow]) -> Fleet:
    """Return distributions, outliers and drifts of logs that were fitted."""
    dates = {row.log: date_of(row.log) for row in rows}
    dated = all(d is not None for d in dates.values())
    ordered = sorted(rows, key=lambda r: (dates[r.log] if dated else 0.0, natural(r.log)))
    groups = tuple(_groups(ordered))
    judged = [g for g in groups if len(g.values) >= FEWEST and g.sigma > 0.0]
    limit = z_limit(sum(len(g.values) for g in judged))
    found = [one for g in judged for one in _outliers(g, limit)]
    long = [g for g in judged if len(g.values) >= FEWEST_FOR_DRIFT]
    drifts = [d for g in long if (d := _drift(g, len(long)))]
    return Fleet(
        groups,
        tuple(sorted(found, key=lambda o: (-abs(o.z), o.log, o.parameter))),
        tuple(sorted(drifts, key=lambda d: (-abs(d.change), d.parameter, d.condition))),
        dated,
    )


def date_of(log: str) -> float | None:
    """Return the time that a log's name, else a folder's, gives, in s; None if none does."""
    for part in reversed(Path(log).parts):
        for found in DATE.finditer(part):
            numbers = [int(n) for n in found.groups() if n is not None]
            try:
                return datetime(*numbers, tzinfo=UTC).timestamp()  # type: ignore[arg-type,misc]
            except ValueError:
                continue
    return None


def z_limit(tests: int) -> float:
    """Return the z-score beyond which, of so many normal values, ``LISTED_SHARE`` lie on average."""
    from scipy.special import ndtri

    return max(LEAST_Z, -float(ndtri(LISTED_SHARE / (2 * max(tests, 1)))))


def _groups(rows: Sequence[LogRow]) -> Iterator[Group]:
    """Yield the values of parameters by condition, then residuals."""
    kinds: dict[tuple[str, str], list[tuple[str, float, float]]] = {}
    units: dict[str, str] = {RESIDUAL: ""}
    residuals: dict[tuple[str, str], list[tuple[str, float, float]]] = {}
    for row in rows:
        for test in row.tests:
            for p in test.parameters:
                units.setdefault(p.parameter, p.unit)
                width = math.nan if p.low is None or p.high is None else (p.high - p.low) / 2.0
                kinds.setdefault((p.parameter, test.condition), []).append((row.log, float(p.value), width))
            error = test.nrmse if test.nrmse_holdout is None else test.nrmse_holdout
            if error is not None:
                residuals.setdefault((RESIDUAL, test.condition), []).append((row.log, float(error), 0.0))
    currents = {t.condition: math.nan if t.current is None else t.current for row in rows for t in row.tests}
    everything: Mapping[tuple[str, str], list[tuple[str, float, float]]] = kinds | residuals
    for (parameter, condition), found in everything.items():
        logs, values, widths = zip(*found, strict=True)
        made = np.array(values), np.array(widths)
        yield Group(parameter, condition, units[parameter], logs, *made, currents[condition])


def _outliers(group: Group, limit: float) -> Iterator[Outlier]:
    """Yield values beyond the limit that their own intervals do not explain; of residuals, large ones."""
    away = group.values - group.median
    with np.errstate(invalid="ignore"):
        far = (np.abs(away) > limit * group.sigma) & (np.abs(away) > group.widths)
    if group.parameter == RESIDUAL:
        far &= away > 0.0
    for k in np.flatnonzero(far):
        value = float(group.values[k])
        z = float(away[k] / group.sigma)
        yield Outlier(group.logs[k], group.condition, group.parameter, group.unit, value, group.median, z)


def _drift(group: Group, tests: int) -> Drift | None:
    """Return the trend of a group by Spearman's rank correlation, None where chance gives it in one batch of twenty."""
    from scipy.stats import spearmanr

    found = spearmanr(np.arange(len(group.values)), group.values)
    if not found.pvalue < LISTED_SHARE / tests:
        return None
    count = max(1, round(ENDS * len(group.values)))
    first, last = float(np.median(group.values[:count])), float(np.median(group.values[-count:]))
    change = (last - first) / group.sigma
    return Drift(group.parameter, group.condition, group.unit, first, last, change, float(found.statistic))
