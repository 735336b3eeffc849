"""Figures of fits and predictions: the report's, as matplotlib has them."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.fit.band import widths
from mrfit.fit.files import residual_columns
from mrfit.fit.predict import SegmentPrediction
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.io.schemas.fit import Fit
from mrfit.report.curves import worst_of_each
from mrfit.report.discovery_figures import gap_canvas
from mrfit.report.figures import LOOPS, Grid, history_figures, loop_figures, residual_figures
from mrfit.report.source import OutputSeries, in_order
from mrfit.report.svg import style
from mrfit.search.parts import Blocks
from mrfit.simulate.assembly import Assembly

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Kind = Literal["loop", "time-history", "residual"]


def series_of(
    blocks: Blocks, simulated: Sequence[Array], assembly: Assembly, unmeasured: Collection[str] = ()
) -> list[OutputSeries]:
    """Return measured and simulated output of every segment; a long one, fitted in pieces, is put together again.

    The measured output of segments that have none is nan.
    """
    parts: dict[tuple[str, str, str], list[dict[str, Array]]] = {}
    frequencies = {}
    for part, output in zip(blocks.parts, simulated, strict=True):
        key = part.segment.condition, part.segment.id, part.segment.role
        parts.setdefault(key, []).append(residual_columns(part, output, assembly))
        frequencies[key] = part.segment.frequency
    found = []
    for key, pieces in parts.items():
        columns = {name: np.concatenate([p[name] for p in pieces]) for name in pieces[0]}
        time, measured, output = (columns.pop(name) for name in ("time", "measured", "simulated"))
        if key[1] in unmeasured:
            measured = np.full_like(measured, np.nan)
        found.append(OutputSeries(*key, time, measured, output, columns, frequencies[key]))
    return found


def predicted_series(fit: Fit, found: SegmentPrediction, assembly: Assembly) -> list[OutputSeries]:
    """Return the series of a prediction with their bands, as the logs' clocks have them, from the start of a record."""
    bands = widths(fit, found, assembly)
    return [replace(one, width=bands.get(one.segment)) for one in _on_the_clock(found, assembly)]


def _on_the_clock(found: SegmentPrediction, assembly: Assembly) -> list[OutputSeries]:
    """Return the series of a prediction on the clocks of the logs, from the start of a record that has no cycles."""
    steps = {part.segment.id: part.dt for part in found.blocks.parts}
    whole = []
    for one in series_of(found.blocks, found.simulated, assembly, found.unmeasured):
        lead = dict(found.leads.get(one.segment, {}))
        samples = len(lead.get("simulated", ()))
        at = found.clock[one.segment] + np.arange(-samples, 0) * steps[one.segment]
        time = np.concatenate([at, found.clock[one.segment] + one.time])
        if not samples:
            whole.append(replace(one, time=time))
            continue
        measured, simulated = lead.pop("measured"), lead.pop("simulated")
        if one.segment in found.unmeasured:
            measured = np.full_like(measured, np.nan)
        measured, simulated = np.concatenate([measured, one.measured]), np.concatenate([simulated, one.simulated])
        inputs = {name: np.concatenate([lead[name], values]) for name, values in one.inputs.items()}
        whole.append(replace(one, time=time, measured=measured, simulated=simulated, inputs=inputs, lead=samples))
    return whole


def plot(fit: Fit, series: list[OutputSeries], kind: str, page: int = 0) -> "Figure":
    """Return a figure of a fit, one panel a condition.

    Parameters
    ----------
    fit
        The fit.
    series
        What it measured and simulated.
    kind
        ``loop``: output against an input, or over time where the output has no loop; ``time-history``; ``residual``.
    page
        Which figure, counted from 0, where there are more than 12 conditions.

    Raises
    ------
    ConfigError
        If there is no such kind or page.
    DataError
        If there is nothing to draw.
    """
    if not series:
        raise DataError(
            f"{fit.name}: read from a file, without data: draw a prediction, fit.predict(recordings).plot()"
        )
    ordered, shown = in_order(fit), worst_of_each(series)
    grids = _grids(ordered, shown, kind)
    if not 0 <= page < len(grids):
        raise ConfigError(f"there is no page {page} of '{kind}'; there are {len(grids)}, counted from 0")
    with style():
        return grids[page].canvas()


def gap_plot(found: DiscoveryFile) -> "Figure":
    """Return the error on held-out conditions without and with each effect of a discovery.

    Raises
    ------
    DataError
        If the data were too few to tell an error.
    """
    if found.gap.before is None:
        raise DataError(f"the discovery on {found.base_model} has no errors to draw: {found.advice[0]}")
    with style():
        return gap_canvas(found)


def _grids(fit: Fit, shown: list[OutputSeries], kind: str) -> list[Grid]:
    if kind == "loop":
        channel = next((c for c in LOOPS.get(fit.output, ()) if all(c in s.inputs for s in shown)), None)
        return loop_figures(fit, shown, channel) if channel else history_figures(fit, shown)
    if kind == "time-history":
        return history_figures(fit, shown)
    if kind == "residual":
        return residual_figures(fit, shown)
    raise ConfigError(f"there is no figure '{kind}'; choose loop, time-history or residual")
