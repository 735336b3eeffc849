"""The short report: the best fit on two A4 pages, as an HTML file that prints so."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

from mrfit.core.counting import number_of
from mrfit.core.recording import Segment
from mrfit.io.outdated import remedy
from mrfit.io.schemas.determined import State
from mrfit.io.schemas.fit import Fit
from mrfit.report import paper
from mrfit.report.curves import worst_of_each
from mrfit.report.determined import sentences
from mrfit.report.figures import error_figure, has_errors
from mrfit.report.loop_figure import loops
from mrfit.report.page import QuantityRow, RankingPlace, quantity_row, rankings
from mrfit.report.paper import FitSeries
from mrfit.report.paper_stage import with_room
from mrfit.report.parameter_figure import parameters, quantity_of
from mrfit.report.ranking import best
from mrfit.report.sections import template_of
from mrfit.report.source import ReportSource
from mrfit.report.svg import Canvas, inline, style, to_svg
from mrfit.report.verdict import GroupedWarning, cautions, verdict
from mrfit.simulate.current_dependence import base_name

SHORT_TEMPLATE = Path(__file__).with_name("short.html.jinja")
SHORT_WIDTH = 186.0 / 25.4
"""Inches between the margins of a page."""
SHORT_PLACES, SHORT_ROWS, CURVES, CAUTIONS = 6, 20, 3, 3
"""Fits, parameters, panels of parameters and reasons for caution for which two pages have room."""
LONGEST_TEXT = 240
"""Characters of a reason for caution."""


@dataclass(frozen=True)
class _Drawing:
    """A figure, with its share of the height that text and tables leave."""

    svg: str
    caption: str
    weight: int


def render(source: ReportSource) -> str:
    """Return the page of the best of the fits; the others stand beside it in the ranking."""
    name = best(source.fits, 1)[0]
    fit = next(f for f in source.fits if f.name == name)
    rivals = [f for f in source.fits if f.output == fit.output]
    own = next(r for r in rankings(rivals, {}) if name in [p.ranked.fit.name for p in r.places])
    reasons = cautions(fit)
    rows = _rows(fit)
    places: Sequence[RankingPlace] = own.places if len(rivals) > 1 else ()
    with style():
        import matplotlib

        matplotlib.rcParams.update(cast(Any, paper.PRINT))
        first, second = _figures(fit, source)
    return template_of(SHORT_TEMPLATE).render(
        fit=fit,
        verdict=[*verdict(fit), *sentences(fit)],
        judged=own.words,
        places=places[:SHORT_PLACES],
        fits_left=len(rivals) - len(places[:SHORT_PLACES]),
        sets=len(fit.results),
        rows=rows[:SHORT_ROWS],
        rows_left=len(rows) - len(rows[:SHORT_ROWS]),
        cautions=[_shortened(c) for c in reasons[:CAUTIONS]],
        cautions_left=len(reasons) - len(reasons[:CAUTIONS]),
        first=first,
        second=second,
        recordings=len(source.ingest.recordings) if source.ingest else 0,
        conditions=len({m.condition for m in fit.metrics if m.condition != "all"}),
        outdated=remedy(source.outdated[name]) if name in source.outdated else "",
    )


def _rows(fit: Fit) -> list[tuple[str, QuantityRow]]:
    """Return the parameters of every set, then derived quantities that are well determined, each with its condition."""
    own = [(r.condition, q) for r in fit.results for q in r.parameters]
    own += [(r.condition, q) for r in fit.results for q in r.derived if q.determined is State.WELL]
    return [(condition, quantity_row(q)) for condition, q in own]


def _shortened(caution: GroupedWarning) -> GroupedWarning:
    text = caution.text
    return caution if len(text) <= LONGEST_TEXT else replace(caution, text=text[: LONGEST_TEXT - 1].rstrip() + "…")


def _figures(fit: Fit, source: ReportSource) -> tuple[list[_Drawing], list[_Drawing]]:
    """Return the figures of the first and of the second page."""
    first, second = list[_Drawing](), list[_Drawing]()
    series = worst_of_each(source.series[fit.name])
    if series:
        drawn = FitSeries(fit, with_room(FitSeries(fit, series), "loops", "conditions", 1))
        left = len(series) - len(drawn.series)
        caption = "Measured (dots) and simulated (lines)" + (
            f"; not drawn: {number_of('more condition', left)}." if left else "."
        )
        first.append(_drawing(loops([drawn], SHORT_WIDTH, "conditions"), caption, 1))
    if over := quantity_of(fit, source.segments):
        caption = f"Parameters over {over}, with their 95 % intervals."
        second.append(_drawing(_curves(fit, source.segments, over), caption, 2))
    if has_errors(fit):
        figure = error_figure(fit)
        second.append(_Drawing(inline(figure.svg, "e", figure.alt), figure.caption, 3))
    return first, second


def _curves(fit: Fit, segments: Sequence[Segment], over: str) -> "Canvas":
    """Return the first parameters over a quantity, as many as there is room for."""
    own = [s for s in segments if any(r.condition == s.condition for r in fit.results)]
    names = list(dict.fromkeys(base_name(p.name) for p in fit.results[0].parameters))
    several = [n for n in names if sum(base_name(p.name) == n for r in fit.results for p in r.parameters) > 1]
    kept = several[:CURVES]
    results = [replace(r, parameters=[p for p in r.parameters if base_name(p.name) in kept]) for r in fit.results]
    return parameters([replace(fit, results=results)], own, over, SHORT_WIDTH)


def _drawing(canvas: "Canvas", caption: str, weight: int) -> _Drawing:
    number = "p" if weight > 1 else "l"
    return _Drawing(inline(to_svg(canvas, caption), number, caption), caption, weight)
