"""The page of a batch: distributions, outliers, drift, and the logs that failed.

Figures of a batch: how every parameter is distributed, and how it goes over the logs.
"""

from collections.abc import Sequence

import numpy as np

from mrfit.batch.fleet import FEWEST, FEWEST_FOR_DRIFT, RESIDUAL, Drift, Fleet, Group, Outlier, findings
from mrfit.core.counting import few, number_of
from mrfit.core.specs import Array
from mrfit.io.schemas.batch import LogRow
from mrfit.report.curves import limits
from mrfit.report.figures import FIGURE_WIDTH, MEASURED, PALETTE, QUIET, SIMULATED, canvas_of, panels_of
from mrfit.report.numbers import in_html, natural, significant, unit_html, with_interval
from mrfit.report.sections import Section, SectionFigure, Table, hover_script
from mrfit.report.sections import render as render_sections
from mrfit.report.svg import Axes, inline, style, to_svg

BINS = 40
# Places along the logs at which median and quantiles are drawn, however many logs there are
FIGURE_PLACES = 200
# Quantiles between which values are drawn; what lies beyond would leave no room for the rest
QUANTILES_SHOWN = (0.005, 0.995)
# Panels side by side
PANEL_COLUMNS = 3
# Outliers drawn of one parameter
FLEET_POINTS = 100


def overview(fleet: Fleet) -> str:
    """Return an SVG with a row for every parameter: a histogram, and median and 5-95 % band over the logs.

    Values are divided by the median of their condition where there are several.
    """
    names = list(dict.fromkeys(g.parameter for g in fleet.groups))
    with style():
        figure = canvas_of(FIGURE_WIDTH, 0.4 + 1.7 * len(names))
        panels = figure.subplots(len(names), 2, squeeze=False, width_ratios=(1, 2))
        order = {log: k for k, log in enumerate(dict.fromkeys(log for g in fleet.groups for log in g.logs))}
        for (left, right), name in zip(panels, names, strict=True):
            own = [g for g in fleet.groups if g.parameter == name]
            at, values, label = _values(own, order)
            low, high = np.quantile(values, QUANTILES_SHOWN)
            room = 0.1 * (high - low) or 1e-9 + abs(high) * 0.01
            left.hist(np.clip(values, low, high), bins=BINS, range=(low - room, high + room), color=MEASURED)
            left.set(title=label, ylabel="Logs")
            _over_logs(right, at, values)
            right.set_xlim(0, max(len(order) - 1, 1))
            _marked(right, fleet, own, order, (low - room, high + room))
        panels[-1][1].set_xlabel("Logs by date" if fleet.dated else "Logs by name")
        return to_svg(figure, "Parameters of all logs")


def over_current(fleet: Fleet) -> str:
    """Return an SVG with a panel for every parameter: its values over the current, or where none is held by log."""
    names = list(dict.fromkeys(g.parameter for g in fleet.groups))
    held = all(np.isfinite(g.current) for g in fleet.groups) and len({g.current for g in fleet.groups}) > 1
    with style():
        figure, panels = panels_of(len(names), min(PANEL_COLUMNS, len(names)), 2.3)
        for axes, name in zip(panels, names, strict=True):
            own = [g for g in fleet.groups if g.parameter == name]
            places = [g.current if held else k for k, g in enumerate(own)]
            factor, unit = (100.0, "%") if name == RESIDUAL else (1.0, unit_html(own[0].unit))
            values, widths = (factor * np.array([getattr(g, of)[0] for g in own]) for of in ("values", "widths"))
            bars = np.where(np.isfinite(widths), widths, 0.0)
            axes.errorbar(places, values, bars, fmt="o", markersize=3.5, color=PALETTE[0], ecolor=QUIET, capsize=2.0)
            # a value that the data leave open would hide all others
            if ends := limits(values, np.concatenate([values - bars, values + bars])):
                axes.set_ylim(*ends)
            axes.set(title=f"{name} ({unit})" if unit else name)
        figure.supxlabel("Current (A)" if held else "Logs by name", fontsize=9.0)
        return to_svg(figure, "Parameters of every log")


def _values(groups: Sequence[Group], order: dict[str, int]) -> tuple[Array, Array, str]:
    """Return places among the logs and values, and what these are."""
    first = groups[0]
    relative = len(groups) > 1 and all(g.median != 0.0 for g in groups)
    at = np.array([order[log] for g in groups for log in g.logs], dtype=np.float64)
    values = np.concatenate([g.values / g.median if relative else g.values for g in groups])
    unit = " over the median of its condition" if relative else f" ({first.unit})" if first.unit else ""
    sorting = np.argsort(at, kind="stable")
    return at[sorting], values[sorting], f"{first.parameter}{unit}"


def _over_logs(axes: "Axes", at: Array, values: Array) -> None:
    pieces = np.array_split(np.arange(len(values)), min(FIGURE_PLACES, len(values)))
    place = np.array([np.median(at[p]) for p in pieces])
    low, middle, high = np.array([np.quantile(values[p], (0.05, 0.5, 0.95)) for p in pieces]).T
    axes.fill_between(place, low, high, color=QUIET, alpha=0.35, linewidth=0.0)
    axes.plot(place, middle, color=PALETTE[0], linewidth=1.0)


def _marked(
    axes: "Axes", fleet: Fleet, groups: Sequence[Group], order: dict[str, int], limits: tuple[float, float]
) -> None:
    """Mark outliers; one that lies beyond what is drawn stands at its edge."""
    own = [o for o in fleet.outliers if o.parameter == groups[0].parameter][:FLEET_POINTS]
    relative = len(groups) > 1 and all(g.median != 0.0 for g in groups)
    shown = [np.clip(o.value / o.median if relative else o.value, *limits) for o in own]
    axes.set_ylim(limits)
    (dots,) = axes.plot([order[o.log] for o in own], shown, "o", markersize=3.0, color=SIMULATED, clip_on=False)
    dots.set_in_layout(False)


# Rows of a table of the page; the rest is in the table of all logs
PAGE_ROWS = 200
# Rows of it that are shown before it is unfolded
FIRST = 20
QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)


def render(rows: Sequence[LogRow], fleet: Fleet, facts: Sequence[tuple[str, str]] = ()) -> str:
    """Return the page, headed by facts as labels and words."""
    failed = [row for row in rows if row.error]
    by_value = [_outlier(o) for o in fleet.outliers if o.parameter != RESIDUAL]
    by_residual = [_outlier(o) for o in fleet.outliers if o.parameter == RESIDUAL]
    found = [
        _section("Logs that failed", ("Log", "Reason"), [(r.log, r.error.removeprefix(f"{r.log}: ")) for r in failed]),
        _section("Logs of the same content, each counted", ("Logs",), _copies(rows)),
        _section("Outliers by parameter", _OUTLIERS, by_value),
        _section("Outliers by residual", _OUTLIERS, by_residual),
        _section("Drift over the logs", _DRIFTS, [_drift(d) for d in fleet.drifts]),
        _section("Warnings", ("Warning", "Logs"), _warnings(rows)),
    ]
    if fleet.is_apart:
        svg = inline(over_current(fleet), "b", "Every parameter of every log over the current of its test")
        caption = (
            "Every log is a condition of its own, so none can be compared with another: values over the current "
            "of the test, or by log where none is held; bars are 95 % intervals, cut where they would hide the values."
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
        f"{findings(len(fleet.outliers), len(fleet.drifts), fleet.most)}. Logs are compared within one "
        f"condition: outliers where at least {FEWEST} logs "
        f"have it, drift where at least {FEWEST_FOR_DRIFT}. Deviations are in robust standard deviations (1.4826 times "
        "the median absolute deviation). A batch of sound logs whose values scatter normally lists a value, or a "
        "drift, once in twenty times. A value that its own interval explains is no outlier. "
        "mrfit drift compares the fits of this table over units, cycles, temperature or time."
    )
    shown = _shown_groups(fleet)
    if fleet.is_apart:
        values = [(g.logs[0], *_named(g), *_with_interval(g)) for g in shown]
        heads = ("Log", *_GROUP, "Value", "95 % interval")
        found.append(_section("Values of every parameter", heads, values, len(fleet.groups)))
    else:
        spread = [(*_named(g), *_spread(g)) for g in shown]
        found.append(_section("Distribution of every parameter", _DISTRIBUTION, spread, len(fleet.groups)))
    sections = [s for s in found if s.figures or s.tables[0].rows]
    return render_sections("Batch", words, facts, sections, "batch.json", script=hover_script())


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


def _with_interval(group: Group) -> tuple[str, str]:
    """Return the value of a group's first log, and its interval."""
    value, half = float(group.values[0]), float(group.widths[0])
    shown, low, high = map(in_html, with_interval(value, value - half, value + half))
    return (shown, f"{low} to {high}") if half > 0.0 else (_shown(value), "–")


def _spread(group: Group) -> tuple[object, ...]:
    logs = len(group.values)
    # one value has no spread
    return logs, *(_shown(q) for q in np.quantile(group.values, QUANTILES)), _shown(group.sigma) if logs > 1 else "–"


def _outlier(o: Outlier) -> tuple[object, ...]:
    return o.log, o.condition, o.parameter, unit_html(o.unit), _shown(o.value), _shown(o.median), _shown(o.z)


def _drift(d: Drift) -> tuple[object, ...]:
    shown = map(_shown, (d.first, d.last, d.change, d.correlation))
    return d.parameter, d.condition, unit_html(d.unit), *shown


def _copies(rows: Sequence[LogRow]) -> list[tuple[str]]:
    """Return the names of logs that hold the same bytes, read and fitted alike."""
    by_key: dict[str, list[str]] = {}
    for row in rows:
        if not row.error:
            by_key.setdefault(row.key, []).append(row.log)
    return [(few(logs),) for key, logs in by_key.items() if key and len(logs) > 1]


def _warnings(rows: Sequence[LogRow]) -> list[tuple[str, int]]:
    kinds = [kind for row in rows for kind in {w for test in row.tests for w in test.warnings}]
    return sorted(((k, kinds.count(k)) for k in set(kinds)), key=lambda one: (-one[1], one[0]))


def _shown(value: float) -> str:
    return in_html(significant(float(value), 4))
