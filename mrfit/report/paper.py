"""Figures for print at a stated width: loops, predicted against measured, correlation of the residual, costs of starts.

Text is 7 pt or more at that width. Curves differ in lightness and in their dashes, so that they are told apart in grey.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from mrfit.core.channels import symbol_of
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.io.schemas.fit import Fit
from mrfit.report.condition_names import differing_parts
from mrfit.report.curves import limits, shared_inputs
from mrfit.report.figures import HOLDOUT, SIMULATED, axis_label, canvas_of, first_panels, plain_log
from mrfit.report.output_unit import output_unit
from mrfit.report.source import OutputSeries
from mrfit.report.svg import Axes, Canvas

if TYPE_CHECKING:
    from matplotlib.lines import Line2D

PRINT: dict[str, Any] = {
    "font.size": 7.5,
    "axes.titlesize": 7.5,
    "axes.labelsize": 7.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "axes.linewidth": 0.6,
    "grid.linewidth": 0.4,
    "legend.handlelength": 2.2,
}
"""Sizes in pt for print; the least is 7."""
NARROW_WIDTH = 4.5
"""Inches below which panels stand one below the other."""
COLOURS = (SIMULATED, HOLDOUT, "#0f766e", "#7e22ce", "#a16207", "#475569")
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (8, 2)), (0, (3, 1.5)))
MOST_PANELS = 12
ENTRY, CHARACTER, LEGEND_ROW = 0.48, 0.058, 0.145
"""Inches of a legend's line and gaps, of a character at 7 pt, and of a row."""
SCATTERED = 1500
"""Points of a cloud."""
LAGS = 400


@dataclass(frozen=True)
class FitSeries:
    """A fit with the series that are drawn of it, one for each condition."""

    fit: Fit
    series: Sequence[OutputSeries]


def panels(
    width: float, count: int, across: int = 2, ratio: float = 0.72, narrow: int = 1
) -> tuple["Canvas", list["Axes"]]:
    """Return a figure of a width in inches with so many panels, ``across`` side by side or ``narrow`` in a column."""
    columns = min(count, narrow if width < NARROW_WIDTH else across)
    rows = -(-count // columns)
    # a figure is no taller than a page
    canvas = canvas_of(width, max(1.45 if rows > 2 else 1.9, (ratio if rows <= 2 else 0.5) * width / columns) * rows)
    return canvas, first_panels(canvas, count, columns, away=True)


def predicted(drawn: Sequence[FitSeries], width: float, points: int = SCATTERED) -> "Canvas":
    """Return simulated over measured output at some samples, a panel a fit, with the line on which both are equal."""
    canvas, axes = panels(width, len(drawn), ratio=0.9)
    names = differing_parts([d.fit.name for d in drawn], ".")
    scale = output_unit(drawn[0].fit)
    for one, d in zip(axes, drawn, strict=True):
        ends: list[float] = []
        heights: list[Array] = []
        for role, label, colour, marker in (
            ("train", "training", SIMULATED, "."),
            ("holdout", "held out", HOLDOUT, "x"),
            ("predict", "predicted", HOLDOUT, "x"),
        ):
            chosen = [s for s in d.series if s.role == role]
            if not chosen:
                continue
            each = max(points // len(chosen), 4)
            at = [np.unique(np.linspace(0, len(s.time) - 1, each).round().astype(np.int64)) for s in chosen]
            measured = scale.factor * np.concatenate([s.measured[k] for s, k in zip(chosen, at, strict=True)])
            simulated = scale.factor * np.concatenate([s.simulated[k] for s, k in zip(chosen, at, strict=True)])
            look: dict[str, Any] = {"color": colour, "marker": marker, "label": label}
            one.plot(measured, simulated, ls="none", ms=2.5, mew=0.5, alpha=0.6, **look)
            ends += [float(measured.min()), float(measured.max())]
            heights.append(simulated)
        if ends:
            if window := limits(np.array(ends), np.concatenate(heights)):
                one.set_ylim(*window)
            one.plot([min(ends), max(ends)], [min(ends), max(ends)], color="#334155", lw=0.7, label="equal")
        one.set_title(names[d.fit.name])
        few_ticks(one)
    legend_above(canvas, labelled(axes), width)
    symbol, unit = symbol_of(drawn[0].fit.output), scale.unit
    words = axis_label(symbol, unit, f"measured {drawn[0].fit.output}")
    label_axes(canvas, axes, words, axis_label(f"{symbol}\u0302", unit, f"simulated {drawn[0].fit.output}"))
    return canvas


def correlation(drawn: FitSeries, width: float) -> "Canvas":
    """Return auto-correlation of the residual and its cross-correlation with every input, of each series drawn.

    The band is what a white residual of as many samples has in 95 of 100 cases.
    """
    # an input that stands still in every series is correlated with nothing
    names = [c for c in shared_inputs(drawn.series) if any(np.ptp(s.inputs[c]) > 0.0 for s in drawn.series)]
    conditions = differing_parts([s.condition for s in drawn.series], "-")
    canvas, axes = panels(width, 1 + len(names), ratio=0.55)
    for number, one in enumerate(drawn.series):
        look: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "ls": DASHES[number % len(DASHES)], "lw": 0.9}
        residual = one.measured - one.simulated
        step = float(one.time[1] - one.time[0]) if len(one.time) > 1 else 1.0
        for panel, name in zip(axes, ["", *names], strict=True):
            lags, values = correlated(residual, one.inputs[name] if name else residual, LAGS)
            kept = lags >= 0 if not name else lags == lags
            panel.plot(step * lags[kept], values[kept], label=conditions[one.condition] or one.condition, **look)
    bound = 1.96 / np.sqrt(min(len(s.time) for s in drawn.series))
    for panel, name in zip(axes, ["", *names], strict=True):
        panel.axhspan(-bound, bound, color="#fde68a", lw=0, zorder=0)
        words = name.replace("_", " ")
        panel.set_title(f"Residual with {words}" if name else "Residual with itself")
        panel.set_ylim(-1.05, 1.05)
    legend_above(canvas, labelled(axes[:1]), width)
    label_axes(canvas, axes, "Lag (s)", "Correlation (1)")
    return canvas


def correlated(first: Array, second: Array, most: int) -> tuple[Array, Array]:
    """Return lags in samples and the correlation of first(t + lag) with second(t), up to a lag, shape (2·M + 1,).

    Parameters
    ----------
    first, second
        Signals, shape (N,) each; their means are taken away.
    most
        Greatest lag; a quarter of the samples if that is less.
    """
    count = len(first)
    most = min(most, max(count // 4, 1))
    a, b = first - np.mean(first), second - np.mean(second)
    size = 1 << (2 * count - 1).bit_length()
    product = np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)
    lags = np.arange(-most, most + 1)
    power = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    values: Array = product[lags] / power if power > 0.0 else np.zeros(len(lags))
    return lags.astype(np.float64), values


def starts(fits: Sequence[Fit], width: float) -> "Canvas":
    """Return the costs at which the starts of every search ended, from the least to the greatest, a panel a fit.

    Raises
    ------
    DataError
        If no search had several starts.
    """
    shown = [f for f in fits if any(len(_ends(r.starts)) > 1 for r in f.results)]
    if not shown:
        raise DataError(f"{', '.join(f.name for f in fits)}: no search had several starts; fit with --opt auto")
    canvas, axes = panels(width, len(shown))
    names = differing_parts([f.name for f in shown], ".")
    for panel, fit in zip(axes, shown, strict=True):
        scale = output_unit(fit)
        results = [r for r in fit.results if len(_ends(r.starts)) > 1]
        conditions = differing_parts([r.condition for r in results], "-")
        for number, result in enumerate(results):
            look: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "ls": DASHES[number % len(DASHES)]}
            costs = np.sort(_ends(result.starts)) * scale.factor
            named = conditions[result.condition] if len(results) <= len(COLOURS) else None
            panel.plot(np.arange(1, len(costs) + 1), costs, marker="o", ms=2.5, lw=0.8, label=named, **look)
        most = max(len(_ends(r.starts)) for r in results)
        panel.set_xticks(range(1, most + 1, -(-most // 8)))
        panel.set_yscale("log")
        plain_log(panel)
        panel.set_title(names[fit.name])
    legend_above(canvas, labelled(axes), width)
    unit = output_unit(shown[0]).unit
    label_axes(
        canvas, axes, "Start, the best first", f"Cost at its end, RMS ({unit})" if unit else "Cost at its end, RMS"
    )
    return canvas


def _ends(costs: Sequence[float | None] | None) -> Array:
    return np.array([c for c in costs or [] if c is not None and np.isfinite(c) and c > 0.0])


def few_ticks(axes: "Axes", across: int = 5) -> None:
    """Keep the numbers of an axis, and those of neighbouring panels, apart."""
    axes.locator_params(axis="x", nbins=across)
    axes.locator_params(axis="y", nbins=6)


def labelled(axes: Sequence["Axes"]) -> list["Line2D"]:
    """Return the lines with a label, each label once."""
    lines = {str(one.get_label()): one for panel in axes for one in panel.lines}
    return [one for label, one in lines.items() if not label.startswith("_")]


def legend_above(canvas: "Canvas", handles: Sequence["Line2D"], width: float) -> None:
    """Write a legend above all panels, where it covers no curve; one entry needs none.

    Parameters
    ----------
    canvas
        Figure with a constrained layout; it grows by the height of the legend.
    handles
        Lines with their labels.
    width
        Inches, which say how many entries stand side by side.
    """
    if len(handles) < 2:
        return
    for one in handles:
        one.set_label(fill(str(one.get_label()), max(int((width - ENTRY) / CHARACTER), 1)))
    longest = max(len(line) for one in handles for line in str(one.get_label()).splitlines())
    lines = max(str(one.get_label()).count("\n") + 1 for one in handles)
    columns = min(max(int(width / (ENTRY + CHARACTER * longest)), 1), len(handles))
    canvas.set_figheight(canvas.get_figheight() + LEGEND_ROW * lines * -(-len(handles) // columns))
    canvas.legend(handles=handles, loc="outside upper center", ncols=columns, columnspacing=1.2, borderpad=0.1)


def label_axes(canvas: "Canvas", axes: Sequence["Axes"], across: str, up: str) -> None:
    """Write each unit once: below and beside a figure of several panels."""
    if len(axes) == 1:
        axes[0].set(xlabel=across, ylabel=up)
    else:
        canvas.supxlabel(across, fontsize=PRINT["axes.labelsize"])
        canvas.supylabel(up, fontsize=PRINT["axes.labelsize"])
