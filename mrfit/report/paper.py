"""Figures for print at a stated width: loops, predicted against measured, correlation of the residual, costs of starts.

Text is 7 pt or more at that width. Curves differ in lightness and in their dashes, so that they are told apart in grey.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mrfit.core.channels import symbol_of
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.io.schemas.fit import Fit
from mrfit.report.curves import decimate, shown_cycles, simplified
from mrfit.report.figures import HOLDOUT, LOOPS, MEASURED, SIMULATED, axis_label, canvas_of, plain_log, scale_of
from mrfit.report.numbers import percent
from mrfit.report.output_unit import output_unit
from mrfit.report.source import Series

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

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
NARROW = 4.5
"""Inches below which panels stand one below the other."""
COLOURS = (SIMULATED, HOLDOUT, "#0f766e", "#7e22ce", "#a16207", "#475569")
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (8, 2)), (0, (3, 1.5)))
MOST_PANELS = 12
SCATTERED = 1500
"""Points of a cloud."""
LAGS = 400


@dataclass(frozen=True)
class Drawn:
    """A fit with the series that are drawn of it, one for each condition."""

    fit: Fit
    series: Sequence[Series]


def panels(
    width: float, count: int, across: int = 2, ratio: float = 0.72, narrow: int = 1
) -> tuple["Canvas", list["Axes"]]:
    """Return a figure of a width in inches with so many panels, ``across`` side by side or ``narrow`` in a column."""
    columns = min(count, narrow if width < NARROW else across)
    rows = -(-count // columns)
    # a figure is no taller than a page
    canvas = canvas_of(width, max(1.45 if rows > 2 else 1.9, (ratio if rows <= 2 else 0.5) * width / columns) * rows)
    axes = list(canvas.subplots(rows, columns, squeeze=False).ravel())
    for unused in axes[count:]:
        unused.remove()
    return canvas, axes[:count]


def loops(drawn: Sequence[Drawn], width: float, overlay: str, channel: str = "") -> "Canvas":
    """Return loops of the output over a channel: a panel a condition, or conditions or fits on shared axes.

    Parameters
    ----------
    drawn
        Fits of one output.
    width
        Inches.
    overlay
        ``conditions``: one panel a fit; ``fits``: one a condition; ``none``: one for each condition and fit.
    channel
        What they are drawn over; empty for the first that all series have, else time.
    """
    output, scale = drawn[0].fit.output, output_unit(drawn[0].fit)
    everything = [s for d in drawn for s in d.series]
    over = channel or next((c for c in LOOPS.get(output, ()) if all(c in s.inputs for s in everything)), "time")
    if over != "time" and any(over not in s.inputs for s in everything):
        raise DataError(f"there is no {over} in the residuals of all fits; choose another channel with --over")
    across = [_over(s, over) for s in everything]
    factor, unit = (1.0, "s") if over == "time" else scale_of(across, over)
    groups = _panels_of(drawn, overlay)
    if len(groups) > MOST_PANELS:
        raise DataError(f"{len(groups)} panels are too many for one figure; choose with --condition, or --overlay")
    canvas, axes = panels(width, len(groups), across=3 if len(groups) > 4 else 2)
    for one, (title, curves) in zip(axes, groups, strict=True):
        measured: set[str] = set()
        for number, curve in enumerate(curves):
            _loop(one, curve, number, _Plane(over, factor, scale.factor), measured)
        one.set_title(title)
        _few_ticks(one)
        if len(curves) > 1 or one is axes[0]:
            one.legend(loc="best", borderaxespad=0.2)
    symbol = "t" if over == "time" else symbol_of(over)
    _labels(canvas, axes, axis_label(symbol, unit, over), axis_label(symbol_of(output), scale.unit, output))
    return canvas


@dataclass(frozen=True)
class _Curve:
    """A series and what it is called in its panel."""

    series: Series
    label: str
    shared: bool


@dataclass(frozen=True)
class _Plane:
    """A channel, and the factors by which it and the output are drawn."""

    over: str
    across: float
    up: float


def _panels_of(drawn: Sequence[Drawn], overlay: str) -> list[tuple[str, list[_Curve]]]:
    errors: dict[tuple[str, str, str], float | None] = {
        (d.fit.name, m.condition, m.role): m.nrmse for d in drawn for m in d.fit.metrics
    }

    def said(d: Drawn, s: Series) -> str:
        held = ", held out" if s.role == "holdout" else ""
        return f"{percent(errors.get((d.fit.name, s.condition, s.role)))}{held}"

    several = len(drawn) > 1
    if overlay == "conditions":
        return [(d.fit.name, [_Curve(s, f"{s.condition}, {said(d, s)}", False) for s in d.series]) for d in drawn]
    if overlay == "fits":
        found: dict[str, list[_Curve]] = {}
        for d in drawn:
            for s in d.series:
                found.setdefault(s.condition, []).append(_Curve(s, f"{d.fit.name}, {said(d, s)}", True))
        return list(found.items())
    name = "{1}, {0}" if several else "{0}"
    return [
        (name.format(f"{s.condition}, {said(d, s)}", d.fit.name), [_Curve(s, "simulated", True)])
        for d in drawn
        for s in d.series
    ]


def _loop(axes: "Axes", curve: _Curve, number: int, plane: _Plane, measured: set[str]) -> None:
    one, window = curve.series, shown_cycles(curve.series)
    across = plane.across * _over(one, plane.over)[window]
    key = f"{one.segment}{one.role}{len(one.time)}"
    look: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "ls": DASHES[number % len(DASHES)]}
    for values, style in (
        (one.measured[window], {"color": MEASURED, "lw": 2.2, "label": "" if measured else "measured", "zorder": 1}),
        (one.simulated[window], {**look, "lw": 0.9, "label": curve.label, "zorder": 2}),
    ):
        if style["lw"] == 2.2 and key in measured:
            continue
        at = decimate(values, 1500) if plane.over == "time" else simplified(across, values)
        axes.plot(across[at], plane.up * values[at], **style)
    measured.add(key)


def _over(one: Series, channel: str) -> Array:
    return one.time if channel == "time" else one.inputs[channel]


def predicted(drawn: Sequence[Drawn], width: float, points: int = SCATTERED) -> "Canvas":
    """Return simulated over measured output at some samples, a panel a fit, with the line on which both are equal."""
    canvas, axes = panels(width, len(drawn), ratio=0.9)
    scale = output_unit(drawn[0].fit)
    for one, d in zip(axes, drawn, strict=True):
        ends: list[float] = []
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
        if ends:
            one.plot([min(ends), max(ends)], [min(ends), max(ends)], color="#334155", lw=0.7, label="equal")
        one.set_title(d.fit.name)
        one.legend(loc="upper left", borderaxespad=0.2)
        _few_ticks(one)
    symbol, unit = symbol_of(drawn[0].fit.output), scale.unit
    words = axis_label(symbol, unit, f"measured {drawn[0].fit.output}")
    _labels(canvas, axes, words, axis_label(f"{symbol}\u0302", unit, f"simulated {drawn[0].fit.output}"))
    return canvas


def correlation(drawn: Drawn, width: float) -> "Canvas":
    """Return auto-correlation of the residual and its cross-correlation with every input, of each series drawn.

    The band is what a white residual of as many samples has in 95 of 100 cases.
    """
    names = [c for c in drawn.series[0].inputs if all(c in s.inputs for s in drawn.series)]
    canvas, axes = panels(width, 1 + len(names), ratio=0.55)
    for number, one in enumerate(drawn.series):
        look: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "ls": DASHES[number % len(DASHES)], "lw": 0.9}
        residual = one.measured - one.simulated
        step = float(one.time[1] - one.time[0]) if len(one.time) > 1 else 1.0
        for panel, name in zip(axes, ["", *names], strict=True):
            lags, values = correlated(residual, one.inputs[name] if name else residual, LAGS)
            kept = lags >= 0 if not name else lags == lags
            panel.plot(step * lags[kept], values[kept], label=one.condition, **look)
    bound = 1.96 / np.sqrt(min(len(s.time) for s in drawn.series))
    for panel, name in zip(axes, ["", *names], strict=True):
        panel.axhspan(-bound, bound, color="#fde68a", lw=0, zorder=0)
        words = name.replace("_", " ")
        panel.set_title(f"Residual with {words}" if name else "Residual with itself")
        panel.set_ylim(-1.05, 1.05)
    axes[0].legend(loc="upper right", borderaxespad=0.2)
    _labels(canvas, axes, "Lag (s)", "Correlation (1)")
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
    for panel, fit in zip(axes, shown, strict=True):
        scale = output_unit(fit)
        results = [r for r in fit.results if len(_ends(r.starts)) > 1]
        for number, result in enumerate(results):
            look: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "ls": DASHES[number % len(DASHES)]}
            costs = np.sort(_ends(result.starts)) * scale.factor
            named = result.condition if len(results) <= len(COLOURS) else None
            panel.plot(np.arange(1, len(costs) + 1), costs, marker="o", ms=2.5, lw=0.8, label=named, **look)
        most = max(len(_ends(r.starts)) for r in results)
        panel.set_xticks(range(1, most + 1, -(-most // 8)))
        panel.set_yscale("log")
        plain_log(panel)
        panel.set_title(fit.name)
        if 1 < len(results) <= len(COLOURS):
            panel.legend(loc="best")
    unit = output_unit(shown[0]).unit
    _labels(canvas, axes, "Start, the best first", f"Cost at its end, RMS ({unit})" if unit else "Cost at its end, RMS")
    return canvas


def _ends(costs: Sequence[float | None] | None) -> Array:
    return np.array([c for c in costs or [] if c is not None and np.isfinite(c) and c > 0.0])


def _few_ticks(axes: "Axes") -> None:
    axes.locator_params(axis="x", nbins=5)
    axes.locator_params(axis="y", nbins=6)


def _labels(canvas: "Canvas", axes: Sequence["Axes"], across: str, up: str) -> None:
    """Write each unit once: below and beside a figure of several panels."""
    if len(axes) == 1:
        axes[0].set(xlabel=across, ylabel=up)
    else:
        canvas.supxlabel(across, fontsize=PRINT["axes.labelsize"])
        canvas.supylabel(up, fontsize=PRINT["axes.labelsize"])
