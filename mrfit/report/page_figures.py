"""Figures of the page that print has as well: parameters over a quantity, predicted, correlation, starts, profiles.

Draws of the posterior of a fit: every parameter, and every two of them over each other.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from mrfit.core.recording import Segment
from mrfit.io.schemas.fit import Fit
from mrfit.report import paper
from mrfit.report.curves import worst_of_each
from mrfit.report.figures import FIGURE_WIDTH, Drawing, Figure, error_figure, has_errors
from mrfit.report.numbers import unit_html
from mrfit.report.paper import FitSeries
from mrfit.report.paper_stage import with_room
from mrfit.report.parameter_figure import parameters, quantity_of
from mrfit.report.profile_figure import has_profiles, profiles
from mrfit.report.source import OutputSeries
from mrfit.report.svg import Canvas, to_svg

MOST_OF_CORNER = 8
"""Parameters that are drawn."""
CORNER_BINS = 24


def has_draws(fit: Fit) -> bool:
    """Return whether the intervals of a fit are those of its posterior."""
    return any(result.draws for result in fit.results)


def corner(fit: Fit, width: float) -> "Canvas":
    """Return the draws of the first set of parameters that has any: histograms, and draws over each other.

    Parameters
    ----------
    fit
        The fit.
    width
        Inches.
    """
    from mrfit.report.figures import PALETTE, QUIET, canvas_of

    result = next(r for r in fit.results if r.draws)
    draws = result.draws
    assert draws is not None
    rows, names = np.array(draws.rows), draws.names[:MOST_OF_CORNER]
    units = {p.name: unit_html(p.unit) for p in result.parameters}
    canvas = canvas_of(width, width)
    panels = canvas.subplots(len(names), len(names), squeeze=False)
    for i, row in enumerate(panels):
        for j, axes in enumerate(row):
            if j > i:
                axes.set_visible(False)
            elif i == j:
                axes.hist(rows[:, i], bins=CORNER_BINS, color=PALETTE[0])
                axes.set_yticks([])
            else:
                axes.plot(rows[:, j], rows[:, i], ".", markersize=1.5, color=QUIET)
            axes.tick_params(labelsize=6.0, labelbottom=i == len(names) - 1, labelleft=0 == j < i)
            axes.locator_params(nbins=3)
        row[0].set_ylabel(f"{names[i]} ({units[names[i]]})" if units[names[i]] else names[i], fontsize=7.0)
        panels[-1][i].set_xlabel(names[i], fontsize=7.0)
    return canvas


PAGE_POINTS = 400


def brief_drawings(fit: Fit, segments: Sequence[Segment]) -> list[Drawing]:
    """Return the functions that draw a fit behind better ones: errors, parameters over a quantity."""
    return [*([partial(error_figure, fit)] if has_errors(fit) else []), *_over_quantity(fit, segments)]


def _over_quantity(fit: Fit, segments: Sequence[Segment]) -> list[Drawing]:
    over = quantity_of(fit, segments)
    if not over:
        return []
    few = [s for s in segments if any(r.condition == s.condition for r in fit.results)]
    return [partial(_parameters, fit, few, over)]


def more_drawings(fit: Fit, series: Sequence[OutputSeries], segments: Sequence[Segment]) -> list[Drawing]:
    """Return the functions that draw the figures after a fit's loops, those for which there are data."""
    made = _over_quantity(fit, segments)
    finite = [s for s in worst_of_each(series) if s.error < float("inf") and s.error > 0.0]
    if finite:
        made.append(partial(_predicted, FitSeries(fit, finite)))
        made.append(partial(_correlation, FitSeries(fit, with_room(FitSeries(fit, finite), "correlation", "none", 1))))
    if any(len([c for c in r.starts or [] if c]) > 1 for r in fit.results):
        made.append(partial(_starts, fit))
    if has_profiles(fit):
        made.append(partial(_profiles, fit))
    if has_draws(fit):
        made.append(partial(_corner, fit))
    return made


def _figure(fit: Fit, canvas: "Canvas", about: tuple[str, str, str], narrow: bool = False) -> Figure:
    kind, title, caption = about
    svg = to_svg(canvas, f"{fit.name}: {title}")
    return Figure(f"{fit.name}.{kind}", title, caption, f"{title} of {fit.name}.", svg, narrow)


def _parameters(fit: Fit, segments: Sequence[Segment], over: str) -> Figure:
    caption = (
        "Every fitted parameter with its 95 % interval; sets are joined where conditions differ in nothing else."
        if len(fit.results) > 1
        else "Parameters that depend on current, with their values at the nodes and 95 % intervals. The inner band "
        "holds the true value at any one current in 95 of 100 cases, the outer one the whole true curve."
    )
    canvas = parameters([fit], segments, over, FIGURE_WIDTH)
    return _figure(fit, canvas, ("parameters", f"Parameters over {over}", caption))


def _predicted(drawn: FitSeries) -> Figure:
    caption = "Simulated over measured output at samples of every condition; on the line both are equal."
    canvas = paper.predicted([drawn], FIGURE_WIDTH * 0.6, PAGE_POINTS)
    return _figure(drawn.fit, canvas, ("predicted", "Simulated over measured", caption), narrow=True)


def _correlation(drawn: FitSeries) -> Figure:
    caption = (
        "Correlation of the residual, measured minus simulated, with itself and with each input, the residual later by "
        "the lag, in the conditions of the least and of the largest error. The band holds 95 % of what chance makes of "
        "independent samples."
    )
    canvas = paper.correlation(drawn, FIGURE_WIDTH)
    return _figure(drawn.fit, canvas, ("correlation", "Correlation of the residual", caption))


def _starts(fit: Fit) -> Figure:
    caption = "Cost at which each start of a search ended, the best first: a flat beginning says that starts agree."
    return _figure(fit, paper.starts([fit], FIGURE_WIDTH * 0.6), ("starts", "Costs of starts", caption), narrow=True)


def _profiles(fit: Fit) -> Figure:
    caption = (
        "Rise of the sum of squares, over the variance of the residual widened for its correlation, as one parameter "
        "is held and the others are refitted. Dots were computed; the dashed line cuts a profile at its 95 % interval."
    )
    return _figure(fit, profiles([fit], FIGURE_WIDTH), ("profiles", "Profile likelihood of the parameters", caption))


def _corner(fit: Fit) -> Figure:
    first = next(r for r in fit.results if r.draws)
    caption = f"Draws of the posterior of {first.condition}, flat within the bounds: each, and two over each other."
    canvas = corner(fit, FIGURE_WIDTH * 0.8)
    return _figure(fit, canvas, ("corner", "Posterior of the parameters", caption), narrow=True)
