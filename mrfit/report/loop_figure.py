"""Loops of the output over a channel, for print: measured samples are dots, the simulation is a line."""

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from mrfit.core.channels import symbol_of
from mrfit.core.specs import Array, Index
from mrfit.errors import DataError
from mrfit.report import paper
from mrfit.report.condition_names import differing_parts
from mrfit.report.curves import decimate, limits, shared_inputs, shown_cycles, simplified, unit_extent
from mrfit.report.figures import LOOPS, SIMULATED, axis_label, scale_of, shades
from mrfit.report.numbers import natural, percent
from mrfit.report.output_unit import output_unit
from mrfit.report.source import OutputSeries
from mrfit.report.svg import Axes, Canvas

if TYPE_CHECKING:
    from matplotlib.lines import Line2D

LOOP_DOTS = 96
"""Measured samples of a loop that are drawn: fewer hide a corner, more become a line."""
HISTORY_POINTS = 1500
AXIS_LETTERS, SHORT = 8, 28
"""Characters of a panel's width that its numbers take, and fewer than which it has fewer of them."""
HELD_OUT_SIGN = {"all": " (held out)", "condition": " (held-out part)"}
"""Said beside the error of what a fit did not see: whole tests, or a part of each."""
MEASURED_ALONE = "#334155"
"""Colour of measured samples that several simulations share."""


@dataclass(frozen=True)
class _Curve:
    """A series, the label that gives its colour, and its error in words."""

    series: OutputSeries
    label: str
    error: str


@dataclass(frozen=True)
class _Look:
    """The colours of a curve and of its measured samples (empty where another curve shows them), and its dashes."""

    colour: str
    dots: str
    dashes: Any


@dataclass(frozen=True)
class _Plane:
    """The channel drawn across, and the factors of both axes."""

    over: str
    across: float
    up: float


def loops(drawn: Sequence[paper.FitSeries], width: float, overlay: str, channel: str = "") -> "Canvas":
    """Draw loops of the output over a channel.

    Parameters
    ----------
    drawn
        Fits of one output.
    width
        Inches.
    overlay
        ``conditions``: conditions that differ in the last part of their name alone share axes; ``fits``: the fits of
        a condition do; ``none``: every condition of every fit has a panel.
    channel
        Channel drawn across; empty for the first that all series have, else time.

    Raises
    ------
    DataError
        If a series lacks the channel, or more than ``MOST_PANELS`` panels would be drawn.
    """
    output, scale = drawn[0].fit.output, output_unit(drawn[0].fit)
    everything = [s for d in drawn for s in d.series]
    shared = shared_inputs(everything)
    over = channel or next((c for c in LOOPS.get(output, ()) if c in shared), "time")
    if over not in ("time", *shared):
        there = ", ".join((*shared, "time"))
        raise DataError(f"there is no {over} in the residuals of all fits; give --over one of {there}")
    factor, unit = (1.0, "s") if over == "time" else scale_of([_across(s, over) for s in everything], over)
    groups = panels_of(drawn, overlay)
    if len(groups) > paper.MOST_PANELS:
        raise DataError(f"{len(groups)} panels are too many for one figure; choose with --condition, or --overlay")
    looks = _looks({c.label for _, curves in groups for c in curves}, overlay)
    narrow = 2 if len(groups) > 3 else 1
    canvas, axes = paper.panels(width, len(groups), across=3 if len(groups) > 4 else 2, narrow=narrow)
    letters = int(width / len({round(a.get_position().x0, 6) for a in axes}) / paper.CHARACTER) - AXIS_LETTERS
    plane = _Plane(over, factor, scale.factor)
    for panel, (title, curves) in zip(axes, groups, strict=True):
        for number, curve in enumerate(curves):
            _draw_curve(panel, curve.series, looks[curve.label], plane, dots=overlay != "fits" or number == 0)
        ends = limits(*(np.concatenate([getattr(c.series, n) for c in curves]) for n in ("measured", "simulated")))
        if ends:
            panel.set_ylim(*(scale.factor * end for end in ends))
        panel.set_title(fill(title.replace(" %", "\u00a0%"), letters))
        paper.few_ticks(panel, 4 if letters < SHORT else 5)
    paper.legend_above(canvas, _legend(groups, looks, overlay), width)
    symbol = "t" if over == "time" else symbol_of(over)
    paper.label_axes(canvas, axes, axis_label(symbol, unit, over), axis_label(symbol_of(output), scale.unit, output))
    return canvas


def panels_of(drawn: Sequence[paper.FitSeries], overlay: str) -> list[tuple[str, list[_Curve]]]:
    """Return the title and the curves of every panel; names are reduced to the parts in which they differ."""
    fits = differing_parts([d.fit.name for d in drawn], ".")
    errors: dict[tuple[str, str, str], float | None] = {
        (d.fit.name, m.condition, m.role): m.nrmse for d in drawn for m in d.fit.metrics
    }
    conditions = list(dict.fromkeys(s.condition for d in drawn for s in d.series))
    own = differing_parts(conditions, "-")
    families, lasts = _families(conditions) if overlay == "conditions" else ({}, {})
    found: dict[str, list[_Curve]] = {}
    for d in drawn:
        for s in d.series:
            held = HELD_OUT_SIGN[d.fit.per] if s.role == "holdout" else ""
            error = f"{percent(errors.get((d.fit.name, s.condition, s.role)))}{held}"
            if overlay == "conditions":
                title = ", ".join(filter(None, (fits[d.fit.name], families[s.condition])))
                found.setdefault(title, []).append(_Curve(s, lasts[s.condition], error))
            elif overlay == "fits":
                found.setdefault(own[s.condition], []).append(_Curve(s, fits[d.fit.name] or "simulated", error))
            else:
                title = ", ".join(filter(None, (fits[d.fit.name], own[s.condition], error)))
                found.setdefault(title, []).append(_Curve(s, "simulated", error))
    if overlay == "fits" and len(found) > 1:
        return [(f"{title}: {_joined([c.error for c in curves])}", curves) for title, curves in found.items()]
    return [(title, sorted(curves, key=lambda c: natural(c.label))) for title, curves in found.items()]


def _joined(errors: Sequence[str]) -> str:
    """Return errors that are all those of held-out data with these words once."""
    for per, sign in HELD_OUT_SIGN.items():
        if len(errors) > 1 and all(e.endswith(sign) for e in errors):
            every = "both " if len(errors) == 2 else "all "
            words = f"{every}held out" if per == "all" else "held-out parts"
            return f"{'; '.join(e.removesuffix(sign) for e in errors)} ({words})"
    return "; ".join(errors)


def _families(conditions: Sequence[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the panel and the label of every condition: all but the last part of its name, and that part."""
    heads = {c: c.rpartition("-")[0] for c in conditions}
    alone = len(set(heads.values())) == len(conditions)
    if alone:
        return dict.fromkeys(conditions, ""), {c: name or c for c, name in differing_parts(conditions, "-").items()}
    titles = differing_parts(list(dict.fromkeys(heads.values())), "-")
    lasts = differing_parts(list(dict.fromkeys(c.rpartition("-")[2] for c in conditions)), "-")
    return (
        {c: titles[head] for c, head in heads.items()},
        {c: lasts[c.rpartition("-")[2]] or c.rpartition("-")[2] for c in conditions},
    )


def _looks(labels: set[str], overlay: str) -> dict[str, _Look]:
    ordered = sorted(labels, key=natural)
    if len(ordered) == 1:
        return {ordered[0]: _Look(SIMULATED, SIMULATED if overlay != "fits" else MEASURED_ALONE, "-")}
    dashes = [paper.DASHES[k % len(paper.DASHES)] for k in range(len(ordered))]
    if overlay == "fits":
        named = zip(ordered, dashes, strict=True)
        return {n: _Look(paper.COLOURS[k % len(paper.COLOURS)], MEASURED_ALONE, d) for k, (n, d) in enumerate(named)}
    return {n: _Look(s, s, d) for n, s, d in zip(ordered, shades(len(ordered)), dashes, strict=True)}


def _draw_curve(axes: "Axes", one: OutputSeries, look: _Look, plane: _Plane, dots: bool) -> None:
    loop = plane.over != "time"
    window = shown_cycles(one, 1.0) if loop else shown_cycles(one)
    across, measured, simulated = _across(one, plane.over)[window], one.measured[window], one.simulated[window]
    if dots:
        at = evenly_along(across, measured, LOOP_DOTS)
        mark: dict[str, Any] = {"ls": "none", "marker": ".", "ms": 3.2, "mew": 0, "color": look.dots}
        axes.plot(plane.across * across[at], plane.up * measured[at], **mark)
    at = simplified(across, simulated) if loop else decimate(simulated, HISTORY_POINTS)
    axes.plot(plane.across * across[at], plane.up * simulated[at], lw=0.9, color=look.colour, ls=look.dashes)


def evenly_along(across: Array, up: Array, count: int) -> Index:
    """Return indices of samples at about equal distances along a curve, each axis scaled to its extent.

    Parameters
    ----------
    across, up
        Curve, shape (N,) each.
    count
        Samples at most.
    """
    moves = np.hypot(*(np.diff(unit_extent(values), prepend=values[:1] * 0.0) for values in (across, up)))
    moves[:1] = 0.0
    path = np.cumsum(np.nan_to_num(moves))
    if not len(path) or path[-1] <= 0.0:
        return np.arange(min(len(path), 1), dtype=np.int64)
    return np.unique(np.searchsorted(path, np.linspace(0.0, path[-1], count)).clip(0, len(path) - 1))


def _legend(groups: Sequence[tuple[str, list[_Curve]]], looks: dict[str, _Look], overlay: str) -> list["Line2D"]:
    """Return a line for the measured samples and one for each label, with its error where it has one alone."""
    from matplotlib.lines import Line2D

    errors = {c.label: c.error for c in groups[0][1]} if len(groups) == 1 else {}
    one = next(iter(looks.values()))
    dots = one.dots if overlay == "fits" or len(looks) == 1 else MEASURED_ALONE
    handles = [Line2D([], [], ls="none", marker=".", color=dots, label="measured")]
    for label, look in looks.items():
        words = ", ".join(filter(None, (label, errors.get(label))))
        handles.append(Line2D([], [], ls=look.dashes, color=look.colour, lw=0.9, label=words))
    return handles


def _across(one: OutputSeries, channel: str) -> Array:
    return one.time if channel == "time" else one.inputs[channel]
