"""The page of a batch: distributions, outliers, drift, and the logs that failed."""

from collections.abc import Sequence

import numpy as np

from mrfit.batch.figures import over_current, overview
from mrfit.batch.fleet import FEWEST, FEWEST_FOR_DRIFT, RESIDUAL, Drift, Fleet, Group, Outlier
from mrfit.compare.page import Drawn, Table, whole_page
from mrfit.io.schemas.batch import LogRow
from mrfit.report.numbers import in_html, natural, significant, unit_html
from mrfit.report.svg import inline

# Rows of a table of the page; the rest is in the table of all logs
ROWS = 200
# Rows of it that are shown before it is unfolded
FIRST = 20
QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)


def render(rows: Sequence[LogRow], fleet: Fleet) -> str:
    """Return the page."""
    failed = [row for row in rows if row.error]
    by_value = [_outlier(o) for o in fleet.outliers if o.parameter != RESIDUAL]
    by_residual = [_outlier(o) for o in fleet.outliers if o.parameter == RESIDUAL]
    tables = [
        _shortened(
            "Logs that failed",
            ("Log", "Reason"),
            [(r.log, r.error.removeprefix(f"{r.log}: ")) for r in failed],
            words=True,
        ),
        _shortened("Outliers by parameter", _OUTLIERS, by_value),
        _shortened("Outliers by residual", _OUTLIERS, by_residual),
        _shortened("Drift over the logs", _DRIFTS, [_drift(d) for d in fleet.drifts]),
        _shortened("Warnings", ("Warning", "Logs"), _warnings(rows)),
    ]
    figures = []
    if fleet.is_apart:
        svg = inline(over_current(fleet), "b", "Every parameter of every log over the current of its test")
        figures.append(
            Drawn(
                svg,
                "Every log is a condition of its own, so none can be compared with another: values over the current "
                "of the test, or by log where none is held; bars are 95 % intervals.",
                wide=True,
            )
        )
    elif fleet.groups:
        svg = inline(overview(fleet), "b", "Histogram and course of every parameter over all logs")
        order = "the date in their names" if fleet.dated else "their names, in which no date was found"
        figures.append(
            Drawn(
                svg,
                "Left: all values, those beyond the outer 0.5 % at the edges. Right: median (line) and 5 to 95 % "
                f"(band) over the logs in the order of {order}; dots: outliers, those far off at the edge.",
                wide=True,
            )
        )
    words = (
        f"{len(rows)} logs, {len(rows) - len(failed)} fitted, {len(failed)} failed; {len(fleet.outliers)} outliers, "
        f"{len(fleet.drifts)} drifts. Logs are compared within one condition: outliers where at least {FEWEST} logs "
        f"have it, drift where at least {FEWEST_FOR_DRIFT}. Deviations are in robust standard deviations (1.4826 times "
        "the median absolute deviation). A batch of sound logs whose values scatter normally lists a value, or a "
        "drift, once in twenty times. A value that its own interval explains is no outlier. "
        "`mrfit drift` compares the fits of this table over units, cycles, temperature or time."
    )
    spread = [_distribution(g) for g in _shown_groups(fleet)]
    every = _shortened("Distribution of every parameter", _DISTRIBUTION, spread, len(fleet.groups))
    return whole_page("Batch", words, [t for t in tables if t.rows], figures, [every] if spread else [])


_DISTRIBUTION = ("Parameter", "Condition", "Unit", "Logs", "Least", "5 %", "Median", "95 %", "Most", "Robust sd")
_OUTLIERS = ("Log", "Condition", "Parameter", "Unit", "Value", "Median", "Deviation (sd)")
_DRIFTS = ("Parameter", "Condition", "Unit", "First tenth", "Last tenth", "Change (sd)", "Rank correlation")


def _shortened(
    caption: str, heads: Sequence[str], rows: Sequence[Sequence[object]], total: int = 0, words: bool = False
) -> Table:
    """Return a table of as many rows as a page takes, of so many that there are."""
    total = total or len(rows)
    more = f" ({ROWS} of {total})" if total > ROWS else ""
    return Table(caption + more, heads, rows[:ROWS], words, FIRST)


def _shown_groups(fleet: Fleet) -> list[Group]:
    """Return the groups by parameter and condition; where there are too many, those of most logs."""
    names = list(dict.fromkeys(g.parameter for g in fleet.groups))
    most = sorted(fleet.groups, key=lambda g: -len(g.values))[:ROWS]
    return sorted(most, key=lambda g: (names.index(g.parameter), natural(g.condition)))


def _distribution(group: Group) -> tuple[object, ...]:
    shown = [_shown(q) for q in np.quantile(group.values, QUANTILES)]
    return (group.parameter, group.condition, unit_html(group.unit), len(group.values), *shown, _shown(group.sigma))


def _outlier(o: Outlier) -> tuple[object, ...]:
    return o.log, o.condition, o.parameter, unit_html(o.unit), _shown(o.value), _shown(o.median), _shown(o.z)


def _drift(d: Drift) -> tuple[object, ...]:
    shown = map(_shown, (d.first, d.last, d.change, d.correlation))
    return d.parameter, d.condition, unit_html(d.unit), *shown


def _warnings(rows: Sequence[LogRow]) -> list[tuple[str, int]]:
    kinds = [kind for row in rows for kind in {w for test in row.tests for w in test.warnings}]
    return sorted(((k, kinds.count(k)) for k in set(kinds)), key=lambda one: (-one[1], one[0]))


def _shown(value: float) -> str:
    return in_html(significant(float(value), 4))
