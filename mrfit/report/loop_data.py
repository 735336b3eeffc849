"""The curves that a reader of the page draws on demand: every condition, in 16 bits a number and few points a cycle."""

import base64
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field

import numpy as np

from mrfit.core.channels import symbol_of
from mrfit.core.specs import Array, Index
from mrfit.io.schemas.fit import Fit
from mrfit.report.curves import BEYOND, decimate, prefixed, shared_inputs, shown_cycles, simplified, worst_of_each
from mrfit.report.figures import LOOPS, axis_label, scale_of
from mrfit.report.numbers import percent
from mrfit.report.output_unit import output_unit
from mrfit.report.ranking import BEST, best, ranked
from mrfit.report.source import OutputSeries, ReportSource
from mrfit.report.tables import ROLE_WORDS

PERIODIC_POINTS = 161
TRANSIENT_POINTS = 321
LOOP_TOLERANCE = 0.01
"""Share of its extent by which a loop that is not periodic may be off."""
STEPS = 65534
"""Levels of a number: a coordinate is right to a part in 65534 of its curve's range."""


@dataclass
class _Pool:
    """Arrays as text, each once."""

    texts: list[tuple[float, float, str]] = field(default_factory=list)
    places: dict[tuple[float, float, str], int] = field(default_factory=dict)

    def place(self, values: Array) -> int:
        """Return the place of an array in the pool."""
        finite = np.where(np.isfinite(values), values, np.nan)
        known = finite[np.isfinite(finite)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
        step = (high - low) / STEPS or 1.0
        codes = np.where(np.isfinite(finite), np.round((finite - low) / step) - STEPS // 2, -32768)
        # as written: six digits place a curve better than its sixteen bits do
        text = base64.urlsafe_b64encode(codes.astype("<i2").tobytes()).decode()
        key = float(f"{low:.7g}"), float(f"{step:.7g}"), text
        if key not in self.places:
            self.places[key] = len(self.texts)
            self.texts.append(key)
        return self.places[key]


@dataclass(frozen=True)
class Row:
    """The curves of one condition and fit.

    Attributes
    ----------
    fit
        Number of the fit.
    condition, role, error, words
        Whose curves they are, NRMSE, and this as text.
    across
        Places in the pool of the channels they are drawn over, time last.
    measured, simulated
        Places of the output.
    transient
        Whether the test is not periodic, so that time suits it better than a loop.
    """

    fit: int
    condition: str
    role: str
    error: float | None
    words: str
    across: list[int]
    measured: int
    simulated: int
    transient: bool


@dataclass(frozen=True)
class Output:
    """The curves of the fits that predict one output.

    Attributes
    ----------
    up, axes
        Words of the axes.
    fits
        Names.
    shown, diverged
        Numbers of the fits that are drawn before any is chosen, and of those that have left the measured data.
    rows
        Curves.
    """

    up: str
    axes: list[str]
    fits: list[str]
    shown: list[int]
    diverged: list[int]
    rows: list[Row]


def loop_json(source: ReportSource) -> str:
    """Return the curves of all fits as JSON that may stand in a ``script`` element; empty where there is nothing.

    One object for each output: its axes and fits, and for each condition and fit the curves of its worst part over
    two cycles (the whole record where the test is not periodic) as places in a pool of arrays.
    """
    pool, outputs = _Pool(), list[dict[str, object]]()
    for output in dict.fromkeys(fit.output for fit in source.fits):
        fits = [fit for fit in source.fits if fit.output == output and source.series.get(fit.name)]
        if fits:
            outputs.append(asdict(_of_output(fits, source, pool)))
    if not outputs:
        return ""
    text = json.dumps(
        {"pool": pool.texts, "beyond": BEYOND, "outputs": outputs}, ensure_ascii=True, separators=(",", ":")
    )
    # no text of a file ends the element or begins a comment in it
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _of_output(fits: Sequence[Fit], source: ReportSource, pool: _Pool) -> Output:
    shown = {fit.name: worst_of_each(source.series[fit.name]) for fit in fits}
    everything = [one for series in shown.values() for one in series]
    output, scale = fits[0].output, output_unit(fits[0])
    shared = shared_inputs(everything)
    channels = [c for c in LOOPS.get(output, ()) if c in shared]
    scales = {c: scale_of([s.inputs[c] for s in everything], c) for c in channels}
    seconds, time_unit = prefixed(max(float(s.time[shown_cycles(s)][-1]) for s in everything), "s")
    labels = [axis_label(symbol_of(c), scales[c][1], c) for c in channels]
    rows = []
    for number, fit in enumerate(fits):
        errors: dict[tuple[str, str], float | None] = {(m.condition, m.role): m.nrmse for m in fit.metrics}
        for one in shown[fit.name]:
            at, nrmse = _points(one, channels), errors.get((one.condition, one.role))
            across = [pool.place(scales[c][0] * one.inputs[c][at]) for c in channels]
            row = Row(
                fit=number,
                condition=one.condition,
                role=ROLE_WORDS.get(one.role, one.role),
                error=round(nrmse, 6) if nrmse is not None and math.isfinite(nrmse) else None,
                words=percent(nrmse),
                across=[*across, pool.place(seconds * one.time[at])],
                measured=pool.place(scale.factor * one.measured[at]),
                simulated=pool.place(scale.factor * one.simulated[at]),
                transient=one.frequency <= 0.0,
            )
            rows.append(row)
    return Output(
        up=axis_label(symbol_of(output), scale.unit, output),
        axes=[*labels, axis_label("t", time_unit, "Time")],
        fits=[fit.name for fit in fits],
        shown=[k for k, fit in enumerate(fits) if fit.name in best(fits, BEST)],
        diverged=[k for k, fit in enumerate(fits) if any(r.diverged for r in ranked([fit]))],
        rows=rows,
    )


def _points(one: OutputSeries, channels: Sequence[str]) -> Index:
    """Return the samples to draw: evenly over two cycles, else those that keep the loops and every peak."""
    window = shown_cycles(one)
    count = len(one.time[window])
    if one.frequency > 0.0:
        return np.unique(np.linspace(0, count - 1, min(PERIODIC_POINTS, count)).round().astype(np.int64))
    curves = (one.measured, one.simulated)
    kept = [decimate(curve, TRANSIENT_POINTS // 2) for curve in curves]
    kept += [simplified(one.inputs[c], curve, LOOP_TOLERANCE) for c in channels[:1] for curve in curves]
    return np.unique(np.concatenate(kept))
