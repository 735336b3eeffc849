"""The figures of one fit: time histories, loops, residuals, convergence, error per condition against the noise floor.

matplotlib is used through Figure objects only: no window system, no pyplot state left behind.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from mrfit.core.channels import symbol_of, unit_of
from mrfit.core.executors.order import in_processes
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array
from mrfit.io.schemas.fit import Fit, MetricRow, Result
from mrfit.report.curves import (
    decimate,
    family,
    limits,
    prefixed,
    shared_inputs,
    sheets,
    shown_cycles,
    simplified,
    worst_of_each,
)
from mrfit.report.numbers import SUPERSCRIPTS, in_html, percent, significant
from mrfit.report.output_unit import output_unit
from mrfit.report.source import OutputSeries
from mrfit.report.svg import Axes, Canvas, style, to_svg

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase
    from matplotlib.lines import Line2D

MEASURED, SIMULATED, QUIET = "#8a99a8", "#c2410c", "#94a3b8"
HOLDOUT = "#1d4ed8"
PALETTE = ("#0f766e", "#c2410c", "#1d4ed8", "#a16207", "#7e22ce", "#475569")
FIGURE_WIDTH = 10.0
CURVE_POINTS = 2000
# Conditions of which all are drawn, and how many are chosen of more
FIGURE_MAX = 24
CHOSEN = 12
# Conditions that are named one by one in the figure of their errors
NAMED_LENGTH = 40
# Characters of a panel's title that fit beside its neighbours', by columns of panels
TITLE_WIDTHS = {1: 120, 2: 58, 3: 36, 4: 26}
# The channels a loop is drawn against, by output
LOOPS = {
    "flux": ("current",),
    "current": ("flux",),
    "force": ("velocity", "displacement"),
    "torque": ("angular_velocity", "angle"),
}


@dataclass(frozen=True)
class Figure:
    """A finished figure.

    Attributes
    ----------
    name
        File name without ending.
    title, caption
        Heading and explanation on the page.
    alt
        What it shows, for those who do not see it.
    svg
        The file's text.
    narrow
        Whether it looks best below the full width of the page.
    """

    name: str
    title: str
    caption: str
    alt: str
    svg: str
    narrow: bool = False


Drawing = Callable[[], Figure]
"""What makes a figure, anywhere and at any time."""
Panel = Callable[["Axes", OutputSeries, int], None]
"""Draws one condition, in so many points a curve."""
About = tuple[str, str, str, tuple[str, str]]
"""Kind, title, caption and axis labels of figures."""


def draw_all(drawings: Sequence[Drawing], jobs: int = 1, progress: Progress = silent) -> list[Figure]:
    """Return the figures, drawn by processes side by side."""
    figures: list[Figure] = []
    progress("figures", 0, len(drawings))
    for figure in in_processes(_draw, drawings, jobs, silent):
        figures.append(figure)
        progress("figures", len(figures), len(drawings))
    return figures


def _draw(drawing: Drawing, progress: Progress) -> Figure:
    with style():
        return drawing()


def drawings_of(fit: Fit, series: Sequence[OutputSeries]) -> list[Drawing]:
    """Return the functions that draw every figure of a fit.

    Parameters
    ----------
    fit
        The fit.
    series
        Its measured and simulated outputs.
    """
    everything = worst_of_each(series)
    shown = worst_and_typical(fit, everything)
    note = ""
    if len(shown) < len(everything):
        note = f" Of {len(everything)} conditions the {CHOSEN // 2} worst and {CHOSEN // 2} about the median are drawn."
    return [partial(_drawn, fit, shown, note, number) for number in range(len(_drawings(fit, shown)))]


def worst_and_typical(fit: Fit, series: Sequence[OutputSeries]) -> list[OutputSeries]:
    """Return all series of a fit; of more than ``FIGURE_MAX`` the six of largest NRMSE and the six about the median."""
    if len(series) <= FIGURE_MAX:
        return list(series)
    errors: dict[tuple[str, str], float | None] = {(m.condition, m.role): m.nrmse for m in fit.metrics}
    found = [errors.get((s.condition, s.role)) for s in series]
    order = np.argsort([np.inf if e is None else e for e in found], kind="stable")
    middle, half = len(order) // 2, CHOSEN // 2
    kept = {*order[-half:].tolist(), *order[middle - half // 2 : middle - half // 2 + half].tolist()}
    return [s for k, s in enumerate(series) if k in kept]


def _drawn(fit: Fit, shown: Sequence[OutputSeries], note: str, number: int) -> Figure:
    """Return one of a fit's figures; what draws it is made again in the process that draws."""
    drawing = _drawings(fit, shown)[number]
    figure = drawing()
    return replace(figure, caption=figure.caption + note) if isinstance(drawing, Grid) else figure


def _drawings(fit: Fit, shown: Sequence[OutputSeries]) -> list[Drawing]:
    """Return the functions that draw every figure of a fit from one part of each condition."""
    drawings: list[Drawing] = []
    if has_errors(fit):
        drawings.append(partial(error_figure, fit))
    shared = shared_inputs(shown)
    for channel in LOOPS.get(fit.output, ()):
        if channel in shared:
            drawings += loop_figures(fit, shown, channel)
    if shown:
        drawings += [*history_figures(fit, shown), *residual_figures(fit, shown)]
    if any(len(_descent(result)[1]) > 1 for result in fit.results):
        drawings.append(partial(convergence_figure, fit))
    return drawings


def history_figures(fit: Fit, series: Sequence[OutputSeries]) -> list["Grid"]:
    """Return drawings of measured and simulated output against time over two cycles of every condition."""
    cut = [s.time[shown_cycles(s)] for s in series]
    seconds, time_unit = prefixed(max(float(t[-1]) for t in cut), "s")
    factor, unit = output_unit(fit)

    def draw(axes: "Axes", one: OutputSeries, points: int) -> None:
        window = shown_cycles(one)
        for values, look in ((one.measured[window], _MEASURED), (one.simulated[window], _SIMULATED)):
            at = decimate(values, points)
            axes.plot(seconds * one.time[window][at], factor * values[at], **look)
        _show_measured(axes, one, factor)
        draw_band(axes, one, seconds, factor)

    labels = axis_label("t", time_unit, "Time"), axis_label(symbol_of(fit.output), unit, fit.output)
    caption = f"Measured and simulated {fit.output} over two cycles (the whole record where the test is not periodic)."
    return _grids(fit, series, draw, ("time-history", "Time history", caption + _WORST, labels))


def draw_band(axes: "Axes", one: OutputSeries, seconds: float, factor: float) -> None:
    """Shade the 95 % band of a predicted series, if it has one, and within it that of its parameters."""
    if one.width is None:
        return
    window, ends = shown_cycles(one), one.bands
    at = decimate(one.simulated[window], CURVE_POINTS)
    across = seconds * one.time[window][at]
    for name, shade, label in (("", 0.16, "95 % band"), ("_parameters", 0.4, "95 % band of the parameters")):
        low, high = (factor * ends[f"{side}{name}"][window][at] for side in ("low", "high"))
        axes.fill_between(across, low, high, color=SIMULATED, alpha=shade, lw=0, label=label, zorder=0.5)


def loop_figures(fit: Fit, series: Sequence[OutputSeries], channel: str) -> list["Grid"]:
    """Return drawings of output against one input channel over two cycles of every condition."""
    across, across_unit = scale_of([s.inputs[channel] for s in series], channel)
    factor, unit = output_unit(fit)

    def draw(axes: "Axes", one: OutputSeries, points: int) -> None:
        window = shown_cycles(one)
        drive = one.inputs[channel][window]
        for values, look in ((one.measured[window], _MEASURED), (one.simulated[window], _SIMULATED)):
            at = simplified(drive, values)[: 4 * points]
            axes.plot(across * drive[at], factor * values[at], **look)
        _show_measured(axes, one, factor)

    labels = axis_label(symbol_of(channel), across_unit, channel), axis_label(symbol_of(fit.output), unit, fit.output)
    what = f"{fit.output}–{channel} loop".replace("_", " ")
    caption = f"Measured and simulated over two cycles (the whole record where the test is not periodic).{_WORST}"
    about = (f"loop-{channel}".replace("_", "-"), what[0].upper() + what[1:], caption, labels)
    return _grids(fit, series, draw, about)


def residual_figures(fit: Fit, series: Sequence[OutputSeries]) -> list["Grid"]:
    """Return drawings of measured minus simulated output over all of every condition; a band is the noise floor."""
    seconds, time_unit = prefixed(max(float(s.time[-1]) for s in series), "s")
    factor, unit = output_unit(fit)
    floors: dict[tuple[str, str], float] = {(m.condition, m.role): m.noise_floor or 0.0 for m in fit.metrics}

    def draw(axes: "Axes", one: OutputSeries, points: int) -> None:
        floor = factor * floors.get((one.condition, one.role), 0.0)
        axes.axhspan(-floor, floor, color="#fde68a", lw=0, label="± noise floor")
        residual = one.measured - one.simulated
        at = decimate(residual, points)
        axes.plot(seconds * one.time[at], factor * residual[at], color="#334155", lw=0.6, label="measured − simulated")

    symbol = symbol_of(fit.output)
    labels = axis_label("t", time_unit, "Time"), axis_label(f"{symbol} − {symbol}\u0302", unit, "Residual")
    caption = "What the model leaves of the measured output; the band is ± the noise floor (RMS)."
    return _grids(fit, series, draw, ("residual", "Residual", caption + _WORST, labels))


def _show_measured(axes: "Axes", one: OutputSeries, factor: float) -> None:
    """Scale an axis by the measured values where the simulation has left them."""
    window = shown_cycles(one)
    ends = limits(factor * one.measured[window], factor * one.simulated[window])
    if ends:
        axes.set_ylim(*ends)


_MEASURED: dict[str, Any] = {"color": MEASURED, "lw": 2.4, "label": "measured", "solid_capstyle": "round"}
_SIMULATED: dict[str, Any] = {"color": SIMULATED, "lw": 1.0, "label": "simulated"}
_WORST = " Percentages are NRMSE. Of repeated segments the one with the largest error is drawn."


def convergence_figure(fit: Fit) -> Figure:
    """Return the best cost found against the evaluations spent, one line per set of parameters, both logarithmic.

    Costs of a search on thinned data, which are another problem's, are dashed.
    """
    canvas = canvas_of(FIGURE_WIDTH * 0.75, 3.8)
    axes = canvas.subplots()
    curves = {r.condition: _descent(r)[1] for r in fit.results if len(_descent(r)[1])}
    shown = _some_of(curves)
    before = {r.condition: _descent(r)[0] for r in fit.results if len(_descent(r)[1]) and len(_descent(r)[0])}
    factor, unit = output_unit(fit)
    few = len(shown) <= len(PALETTE)
    points = CURVE_POINTS if few else max(CURVE_POINTS // len(shown), 20)
    lines = []
    for k, (condition, curve) in enumerate(shown.items()):
        colour = PALETTE[k] if few else QUIET
        end: dict[str, Any] = {"lw": 1.3, "marker": "o", "ms": 3.5, "markevery": [-1], "label": condition}
        lines.append(_steps(axes, curve, factor, {"color": colour, **end}, points))
        if condition in before:
            _steps(axes, before[condition], factor, {"color": colour, "lw": 0.9, "ls": (0, (3, 2))}, points)
    named = lines if few else _extremes(lines, [float(c[-1, 1]) for c in shown.values()])
    axes.set(xscale="log", yscale="log", xlabel="Evaluations (simulated parameter vectors)")
    axes.set_ylabel(f"Best cost, RMS ({unit})" if unit else "Best cost, RMS")
    plain_log(axes)
    if len(curves) > 1:
        canvas.legend(handles=named, loc="outside right upper", title="Condition")
    ends = ", ".join(
        f"{c} {in_html(significant(factor * float(v[-1, 1])))} {unit}" for c, v in list(curves.items())[:12]
    )
    caption = f"Best cost against evaluations of {fit.optimizer}; the cost is the RMS residual over the training data."
    if before:
        caption += " Dashed: the search before on thinned data, whose cost is another."
    if len(shown) < len(curves):
        caption += f" Of {len(curves)} conditions {len(shown)} are drawn, those that ended best and worst among them."
    alt = f"Convergence of {fit.optimizer}; costs reached: {ends}{' …' if len(curves) > 12 else ''}."
    svg = to_svg(canvas, f"{fit.name}: convergence")
    return Figure(f"{fit.name}.convergence", "Convergence", caption, alt, svg, narrow=True)


def _some_of(curves: dict[str, Array]) -> dict[str, Array]:
    """Return all curves, of very many some of every cost at their end, the least and the greatest included."""
    if len(curves) <= NAMED_LENGTH:
        return curves
    order = sorted(curves, key=lambda name: float(curves[name][-1, 1]))
    kept = {order[round(k * (len(order) - 1) / (NAMED_LENGTH - 1))] for k in range(NAMED_LENGTH)}
    return {name: curve for name, curve in curves.items() if name in kept}


def _steps(axes: "Axes", curve: Array, factor: float, look: dict[str, Any], points: int) -> "Line2D":
    at = decimate(np.log(curve[:, 1]), points)
    return axes.step(curve[at, 0], factor * curve[at, 1], where="post", **look)[0]


def _descent(result: Result) -> tuple[Array, Array]:
    """Return (evaluations, best cost), (N, 2), of the search on thinned data and of that on all, finite costs only."""
    first, last = result.history[: result.preliminary], result.history[result.preliminary :]
    curves = [np.array([(n, c) for n, c in part if c and n], dtype=float).reshape(-1, 2) for part in (first, last)]
    for curve in curves:
        curve[:, 1] = np.minimum.accumulate(curve[:, 1])
    return curves[0], curves[1]


def _extremes(lines: Sequence["Line2D"], ends: Sequence[float]) -> list["Line2D"]:
    """Colour the lines that end highest and lowest and return them with one that stands for the quiet others."""
    extremes = {int(np.argmax(ends)): SIMULATED, int(np.argmin(ends)): HOLDOUT}
    for k, colour in extremes.items():
        lines[k].set(color=colour, lw=1.8, zorder=3)
    other = next(line for k, line in enumerate(lines) if k not in extremes)
    other.set_label("all others")
    return [*(lines[k] for k in extremes), other]


def has_errors(fit: Fit) -> bool:
    """Return whether a condition of a fit has an error that can be drawn."""
    return any(m.nrmse is not None for m in fit.metrics)


def error_figure(fit: Fit) -> Figure:
    """Return NRMSE of every condition and role as dots, with the noise floor as a tick on the same scale.

    Of more than ``NAMED_LENGTH`` conditions the names are left out, and the order is that of their errors.
    """
    rows = [m for m in fit.metrics if m.condition != "all" and m.nrmse is not None]
    names = list(dict.fromkeys(m.condition for m in rows))
    many = len(names) > NAMED_LENGTH
    if many:
        largest: dict[str, float] = {}
        for m in rows:
            largest[m.condition] = max(m.nrmse or 0.0, largest.get(m.condition, 0.0))
        names = sorted(names, key=lambda name: -largest[name])
    canvas = canvas_of(FIGURE_WIDTH * 0.75, 6.0 if many else 1.3 + 0.27 * len(names))
    axes = canvas.subplots()
    size = 3.0 if many else 6.5
    for role, marker in (("train", {"color": SIMULATED}), ("holdout", {"mfc": "white", "mec": HOLDOUT, "mew": 1.6})):
        chosen = [m for m in rows if m.role == role]
        if chosen:
            places = [names.index(m.condition) for m in chosen]
            values = [100.0 * (m.nrmse or 0.0) for m in chosen]
            label = {"train": "training", "holdout": "hold-out"}[role]
            axes.plot(values, places, "o", ms=size, label=label, ls="none", zorder=3, **marker)
    _noise_ticks(axes, rows, names)
    values = [m.nrmse or 0.0 for m in rows]
    axes.set(xlabel="NRMSE (% of the measured range of the condition)")
    if many:
        axes.set_ylabel("Conditions, the worst on top")
    else:
        axes.set(yticks=range(len(names)), yticklabels=names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    if max(values) > 20.0 * min(values) > 0.0:
        axes.set_xscale("log")
        plain_log(axes)
    else:
        # the dot of the greatest error is drawn whole
        axes.set_xlim(0.0, 1.02 * axes.get_xlim()[1])
    axes.grid(axis="y", color="#e2e8f0", lw=0.8)
    canvas.legend(loc="outside upper right", ncols=3)
    worst = max(rows, key=lambda m: m.nrmse or 0.0)
    alt = f"NRMSE of {len(names)} conditions; largest {percent(worst.nrmse)} at {worst.condition}."
    caption = "Error of every condition as a share of its measured range; the bar is the noise floor on the same scale."
    if many:
        caption += f" The worst are {', '.join(names[:3])}."
    svg = to_svg(canvas, f"{fit.name}: NRMSE")
    return Figure(f"{fit.name}.nrmse", "Error per condition", caption, alt, svg, narrow=True)


def _noise_ticks(axes: "Axes", rows: Sequence[MetricRow], names: Sequence[str]) -> None:
    floors = [(names.index(m.condition), 100.0 * m.relative_floor) for m in rows if m.relative_floor]
    if floors:
        places, values = zip(*floors, strict=True)
        size: dict[str, Any] = {"ms": 4.0, "mew": 1.0} if len(names) > NAMED_LENGTH else {"ms": 13.0, "mew": 2.0}
        axes.plot(values, places, "|", **size, color="#475569", ls="none", label="noise floor", zorder=2)


@dataclass(frozen=True)
class Grid:
    """Small multiples of a fit, one panel a condition, at most 12 of them.

    Attributes
    ----------
    fit
        The fit.
    page
        What the panels show.
    panel
        Draws one of them.
    about
        Kind, title, caption and axis labels.
    number, pages
        Which of how many figures of its kind it is.
    """

    fit: Fit
    page: Sequence[OutputSeries]
    panel: Panel
    about: About
    number: int
    pages: int

    def canvas(self) -> "Canvas":
        """Return the figure as matplotlib has it."""
        across, up = self.about[3]
        page = self.page
        errors: dict[tuple[str, str], float | None] = {(m.condition, m.role): m.nrmse for m in self.fit.metrics}
        columns = columns_of(len(page))
        height = 3.6 if columns == 1 else 2.9 if columns == 2 else 2.15
        canvas = canvas_of(FIGURE_WIDTH, 0.75 + height * -(-len(page) // columns))
        panels = first_panels(canvas, len(page), columns, away=True)
        for axes, one in zip(panels, page, strict=True):
            self.panel(axes, one, CURVE_POINTS // (1 if len(page) <= 2 else 2 if len(page) <= 6 else 4))
            axes.locator_params(axis="x", nbins=5)
            nrmse = errors.get((one.condition, one.role))
            axes.set_title(_heading(one, self.fit.per, nrmse, TITLE_WIDTHS[columns]))
        canvas.supxlabel(across)
        canvas.supylabel(up)
        canvas.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
        return canvas

    def __call__(self) -> Figure:
        """Return the finished figure."""
        kind, title, caption, _ = self.about
        page, name = self.page, f"{self.fit.name}.{kind}" + (f"-{self.number}" if self.pages > 1 else "")
        last = _part(page, self.number, self.pages)
        alt = f"{title} of {page[0].condition}" + (f" to {page[-1].condition}" if len(page) > 1 else "")
        svg = to_svg(self.canvas(), f"{self.fit.name}: {title}{last}")
        return Figure(name, title + last, caption, f"{alt}.", svg)


def _grids(fit: Fit, series: Sequence[OutputSeries], draw: Panel, about: About) -> list[Grid]:
    """Return drawings of small multiples."""
    pages = sheets(series)
    return [Grid(fit, page, draw, about, number, len(pages)) for number, page in enumerate(pages, start=1)]


def _heading(one: OutputSeries, per: str, nrmse: float | None, width: int) -> str:
    """Return condition, role and NRMSE, on several lines where one is too narrow."""
    held = "hold-out · " if per == "all" else "held-out part · "
    rest = held * (one.role == "holdout") + percent(nrmse)
    line = f"{one.condition} · {rest}"
    return line if len(line) <= width else f"{fill(one.condition, width)}\n{rest}"


def _part(page: Sequence[OutputSeries], number: int, total: int) -> str:
    """Return the subtitle of one of several figures: the family of conditions it shows, or its number."""
    if total == 1:
        return ""
    families = {family(one) for one in page}
    return f", {families.pop()}" if len(families) == 1 else f", {number} of {total}"


def columns_of(panels: int) -> int:
    """Return the number of columns of a figure of so many panels."""
    if panels <= 2:
        return panels
    return 2 if panels == 4 else 3 if panels <= 9 else 4


def canvas_of(width: float, height: float) -> "Canvas":
    """Return an empty figure, size in inches, that no window system knows of."""
    from mrfit.report.picture import Picture

    return Picture(figsize=(width, height), layout="constrained")


def shades(count: int) -> list[str]:
    """Return sequential colours, dark to light, whose lightness tells them apart in grey as far as paper shows it."""
    import matplotlib
    from matplotlib.colors import to_hex

    return [to_hex(s) for s in matplotlib.colormaps["viridis"](np.linspace(0.0, 0.82, count))]


def panels_of(count: int, across: int, height: float, more: float = 0.4) -> tuple["Canvas", list["Axes"]]:
    """Return a figure with so many panels, ``across`` side by side; inches of a row of them, and of what is around."""
    canvas = canvas_of(FIGURE_WIDTH, more + height * -(-count // across))
    return canvas, first_panels(canvas, count, across)


def first_panels(
    canvas: "FigureBase", count: int, across: int, away: bool = False, sharey: bool = False
) -> list["Axes"]:
    """Return the first panels of a grid in a figure; those beyond are hidden, or taken away with their margins."""
    axes = list(canvas.subplots(-(-count // across), across, squeeze=False, sharey=sharey).ravel())
    for unused in axes[count:]:
        if away:
            unused.remove()
        else:
            unused.set_visible(False)
    return axes[:count]


def scale_of(curves: Sequence[Array], channel: str) -> tuple[float, str]:
    """Return the factor and unit in which curves of a channel are drawn."""
    finite = [float(np.max(np.abs(c[np.isfinite(c)]), initial=0.0)) for c in curves]
    return prefixed(max(finite), unit_of(channel))


def axis_label(symbol: str, unit: str, name: str) -> str:
    """Return an axis's words: quantity, symbol, unit."""
    words = name.replace("_", " ")
    quantity = words[:1].upper() + words[1:] + (f" {symbol}" if symbol != name else "")
    return f"{quantity} ({unit})" if unit else quantity


def plain_log(axes: "Axes") -> None:
    """Write the numbers of logarithmic axes as 0.1, 1, 10 … and as 10⁵ where they are long, without math fonts."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "log":
            axes.autoscale_view()
            low, high = sorted(axis.get_view_interval())
            decades = np.log10(high / low) if low > 0.0 else 9.0
            axis.set_major_locator(LogLocator(subs=(1.0,) if decades > 1.5 else (1.0, 2.0, 5.0)))
            axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}" if 1e-3 <= v < 1e5 else _power(v)))
            axis.set_minor_formatter(NullFormatter())


def _power(value: float) -> str:
    mantissa, exponent = f"{value:.0e}".split("e")
    return ("" if mantissa == "1" else f"{mantissa}×") + f"10{str(int(exponent)).translate(SUPERSCRIPTS)}"
