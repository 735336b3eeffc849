"""The page of a batch: distributions, outliers, drift, and the logs that failed."""

from collections.abc import Sequence

import numpy as np

from mrfit.batch.figures import over_current, overview
from mrfit.batch.fleet import FEWEST, FEWEST_FOR_DRIFT, RESIDUAL, Drift, Fleet, Group, Outlier
from mrfit.core.counting import number_of
from mrfit.io.schemas.batch import LogRow
from mrfit.report.numbers import in_html, natural, significant, unit_html
from mrfit.report.sections import Section, SectionFigure, Table, hover_script
from mrfit.report.sections import render as render_sections
from mrfit.report.svg import inline

# Rows of a table of the page; the rest is in the table of all logs
PAGE_ROWS = 200
# Rows of it that are shown before it is unfolded
FIRST = 20
QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)


def render(rows: Sequence[LogRow], fleet: Fleet) -> str:
    """Return the page."""
    failed = [row for row in rows if row.error]
    by_value = [_outlier(o) for o in fleet.outliers if o.parameter != RESIDUAL]
    by_residual = [_outlier(o) for o in fleet.outliers if o.parameter == RESIDUAL]
    found = [
        _section("Logs that failed", ("Log", "Reason"), [(r.log, r.error.removeprefix(f"{r.log}: ")) for r in failed]),
        _section("Outliers by parameter", _OUTLIERS, by_value),
        _section("Outliers by residual", _OUTLIERS, by_residual),
        _section("Drift over the logs", _DRIFTS, [_drift(d) for d in fleet.drifts]),
        _section("Warnings", ("Warning", "Logs"), _warnings(rows)),
    ]
    if fleet.is_apart:
        svg = inline(over_current(fleet), "b", "Every parameter of every log over the current of its test")
        caption = (
            "Every log is a condition of its own, so none can be compared with another: values over the current "
            "of the test, or by log where none is held; bars are 95 % intervals."
        )
        found.append(Section("Parameters", figures=[SectionFigure("", caption, svg)]))
    elif fleet.groups:
        svg = inline(overview(fleet), "b", "Histogram and course of every parameter over all logs")
        order = "the date in their names" if fleet.dated else "their names, in which no date was found"
        caption = (
            "Left: all values, those beyond the outer 0.5 % at the edges. Right: median (line) and 5 to 95 % "
            f"(band) over the logs in the order of {order}; dots: outliers, those far off at the edge."
        )
        found.append(Section("Parameters", figures=[SectionFigure("", caption, svg)]))
    words = (
        f"{number_of('log', len(rows))}, {len(rows) - len(failed)} fitted, {len(failed)} failed; "
        f"{number_of('outlier', len(fleet.outliers))}, "
        f"{number_of('drift', len(fleet.drifts))}. Logs are compared within one "
        f"condition: outliers where at least {FEWEST} logs "
        f"have it, drift where at least {FEWEST_FOR_DRIFT}. Deviations are in robust standard deviations (1.4826 times "
        "the median absolute deviation). A batch of sound logs whose values scatter normally lists a value, or a "
        "drift, once in twenty times. A value that its own interval explains is no outlier. "
        "`mrfit drift` compares the fits of this table over units, cycles, temperature or time."
    )
    shown = _shown_groups(fleet)
    if fleet.is_apart:
        values = [(*_named(g), _shown(g.median)) for g in shown]
        found.append(_section("Values of every parameter", (*_GROUP, "Value"), values, len(fleet.groups)))
    else:
        spread = [(*_named(g), *_spread(g)) for g in shown]
        found.append(_section("Distribution of every parameter", _DISTRIBUTION, spread, len(fleet.groups)))
    sections = [s for s in found if s.figures or s.tables[0].rows]
    return render_sections("Batch", words, (), sections, "batch.json", script=hover_script())


_GROUP = ("Parameter", "Condition", "Unit")
_DISTRIBUTION = (*_GROUP, "Logs", "Least", "5 %", "Median", "95 %", "Most", "Robust sd")
_OUTLIERS = ("Log", "Condition", "Parameter", "Unit", "Value", "Median", "Deviation (sd)")
_DRIFTS = ("Parameter", "Condition", "Unit", "First tenth", "Last tenth", "Change (sd)", "Rank correlation")


def _section(caption: str, heads: Sequence[str], rows: Sequence[Sequence[object]], total: int = 0) -> Section:
    """Return a section with a table of as many rows as a page takes, of so many that there are."""
    total = total or len(rows)
    more = f" ({PAGE_ROWS} of {total})" if total > PAGE_ROWS else ""
    return Section(caption + more, tables=[Table("", heads, rows[:PAGE_ROWS], first=FIRST)])


def _shown_groups(fleet: Fleet) -> list[Group]:
    """Return the groups by parameter and condition; where there are too many, those of most logs."""
    names = list(dict.fromkeys(g.parameter for g in fleet.groups))
    most = sorted(fleet.groups, key=lambda g: -len(g.values))[:PAGE_ROWS]
    return sorted(most, key=lambda g: (names.index(g.parameter), natural(g.condition)))


def _named(group: Group) -> tuple[str, str, str]:
    return group.parameter, group.condition, unit_html(group.unit)


def _spread(group: Group) -> tuple[object, ...]:
    return len(group.values), *(_shown(q) for q in np.quantile(group.values, QUANTILES)), _shown(group.sigma)


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
