"""Figures of a batch: how every parameter is distributed, and how it goes over the logs."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mrfit.batch.fleet import RESIDUAL, Fleet, Group
from mrfit.core.specs import Array
from mrfit.report.curves import limits
from mrfit.report.figures import FIGURE_WIDTH, MEASURED, PALETTE, QUIET, SIMULATED
from mrfit.report.numbers import unit_html
from mrfit.report.svg import import_matplotlib, style, to_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    import_matplotlib()
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(g.parameter for g in fleet.groups))
    with style():
        figure = Figure(figsize=(FIGURE_WIDTH, 0.4 + 1.7 * len(names)), layout="constrained")
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
    import_matplotlib()
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(g.parameter for g in fleet.groups))
    held = all(np.isfinite(g.current) for g in fleet.groups) and len({g.current for g in fleet.groups}) > 1
    across = min(PANEL_COLUMNS, len(names))
    down = -(-len(names) // across)
    with style():
        figure = Figure(figsize=(FIGURE_WIDTH, 0.4 + 2.3 * down), layout="constrained")
        panels = figure.subplots(down, across, squeeze=False).ravel()
        for axes, name in zip(panels, names, strict=False):
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
        for axes in panels[len(names) :]:
            axes.set_visible(False)
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
