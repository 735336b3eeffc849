"""The raw signals of logs before any fit: series with zoom, loops, where a log is cut, warnings at their time."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from html import escape
from pathlib import Path

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.core.counting import number_of
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Finding, Recording, Segment
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.io.atomic import write_atomic
from mrfit.io.escapes import visible_in_page
from mrfit.io.workspace import write_text
from mrfit.report.curves import decimate, prefixed, simplified
from mrfit.report.figures import LOOPS, PALETTE, QUIET, axis_label, first_panels
from mrfit.report.key import REPORT_TEMPLATE
from mrfit.report.picture import Picture
from mrfit.report.sections import Section, SectionFigure, Table
from mrfit.report.sections import render as render_sections
from mrfit.report.svg import Axes, style
from mrfit.segment import stage as segment_stage
from mrfit.settings.segment import Settings as SegmentSettings
from mrfit.sheet.page import drawn
from mrfit.signal.savitzky_golay import WINDOW_MIN, Smoother

SERIES_POINTS, FEWEST_POINTS, ALL_POINTS = 4000, 400, 200_000
"""Points of a series on the page, of a series of many logs at least, and of all series about."""
ACROSS, UP = 20_000, 1000
"""Whole numbers in which a series is drawn, along and up."""
LOGS_DRAWN = 40
"""Logs that have a section on one page."""
ROWS_DRAWN, CUTS_NAMED, LOOP_CYCLES = 60, 6, 2.0
"""Rows of a table, cuts that a legend of loops names, and cycles of each that are drawn."""


@dataclass(frozen=True)
class Signals:
    """A log with the segments into which it is cut, and what is said of them."""

    recording: Recording
    segments: Sequence[Segment]
    said: Sequence[str]

    @property
    def seconds(self) -> float:
        """Time of the last sample since the first in s."""
        return max(self.recording.samples - 1, 1) * self.recording.dt

    @property
    def timed(self) -> list[Finding]:
        """Findings that have a place in time, in its order."""
        return sorted((f for f in self.recording.findings if f.at is not None), key=lambda f: f.at or 0.0)

    def span(self, segment: Segment) -> tuple[float, float]:
        """Return begin and end of a segment in s since the first sample, its lead-in included."""
        return (segment.start - segment.warm_up) * self.recording.dt, (segment.stop - 1) * self.recording.dt

    def scaled(self, name: str) -> tuple[float, str]:
        """Return the factor and unit in which a channel is drawn."""
        values = self.recording.channels[name]
        largest = max(abs(float(np.nanmin(values))), abs(float(np.nanmax(values))))
        return prefixed(largest, self.recording.units.get(name, ""))


def signals_of(recording: Recording) -> Signals:
    """Return a log with its segments; where it has none, the reason is said."""
    try:
        segments, [detection] = segment_stage.cut([recording], 1, SegmentSettings(holdout="none"))
    except DataError as error:
        return Signals(recording, [], [str(error).removeprefix(f"{recording.source}: ")])
    return Signals(recording, segments, [text.partition(": ")[2] for text in detection.findings])


def write(
    recordings: Iterable[Recording], number: int, folder: Path, png: bool, progress: Progress = silent
) -> tuple[list[Path], list[Signals]]:
    """Write signals.html, and a PNG of every log where asked, into a folder; return the files and what they show.

    Parameters
    ----------
    recordings
        Logs, looked at one after the other.
    number
        How many they are; those beyond ``LOGS_DRAWN`` have no section on the page.
    folder
        Where to.
    png
        Whether to write a PNG of every log.
    progress
        Reports every log.
    """
    page, pictures, sections, shown = folder / "signals.html", list[Path](), list[Section](), list[Signals]()
    for place, recording in enumerate(recordings, 1):
        one = signals_of(recording)
        if place <= LOGS_DRAWN:
            sections += _sections(one, f"g{place}", min(number, LOGS_DRAWN))
        if png:
            pictures.append(folder / f"{recording.id}.png")
            write_atomic(pictures[-1], lambda path, one=one: path.write_bytes(draw(one)._repr_png_()))  # type: ignore[misc]
        shown.append(Signals(replace(recording, channels={}), one.segments, one.said))
        progress("logs", place, number)
    lead = f"{number_of('log', number)}, before any fit."
    if number > LOGS_DRAWN:
        lead += f" The first {LOGS_DRAWN} are shown; give fewer logs to see others."
    script = REPORT_TEMPLATE.with_name("signals.js").read_text(encoding="utf-8")
    write_text(page, render_sections("Signals as recorded", lead, (), sections, "the logs themselves", script))
    return [page, *pictures], shown


def draw(one: Signals) -> Picture:
    """Return a figure of a log: its channels over time with cuts and warnings, and its loops."""
    names, panels = list(one.recording.channels), _loops(one)
    rows = -(-len(panels) // 2)
    with style():
        heights = (0.7 + 1.25 * len(names), 3.4 * rows)
        canvas = Picture(figsize=(10.0, sum(heights)), layout="constrained")
        above, *below = canvas.subfigures(1 + (rows > 0), 1, squeeze=False, height_ratios=heights[: 1 + (rows > 0)])[
            :, 0
        ]
        series = above.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
        for axes, name in zip(series, names, strict=True):
            factor, unit = one.scaled(name)
            values = one.recording.channels[name]
            at = decimate(values, SERIES_POINTS)
            for number, segment in enumerate(one.segments):
                axes.axvspan(*one.span(segment), color=QUIET, alpha=(0.14, 0.34)[number % 2], lw=0)
            for finding in one.timed:
                if finding.channel in ("", name):
                    axes.axvline(finding.at, color=PALETTE[1], lw=0.9)
            axes.plot(at * one.recording.dt, factor * values[at], lw=0.7, color=PALETTE[2])
            axes.set_ylabel(f"{name.replace('_', ' ')}\n({unit})" if unit else name.replace("_", " "), fontsize=8)
        series[-1].set_xlabel("Time (s)")
        series[0].set_title(f"{one.recording.id}: shaded the cuts, vertical lines the warnings")
        for part in below:
            for axes, panel in zip(first_panels(part, len(panels), 2), panels, strict=True):
                _draw_loop(axes, one, *panel)
    return canvas


def _sections(one: Signals, prefix: str, logs: int) -> Iterator[Section]:
    """Yield the sections of a log: its series and loops; its cuts, warnings and channels as tables."""
    recording = one.recording
    points = int(np.clip(ALL_POINTS / logs / max(len(recording.channels), 1), FEWEST_POINTS, SERIES_POINTS))
    facts = f"{recording.source}: {recording.samples} samples of {recording.dt:.6g} s, {one.seconds:.6g} s"
    words = (
        "Shaded: steady cycles, or all that is used where there are none. Lines: warnings. Drag, or click a row below, "
        "to zoom; double click for all."
    )
    thin = f" Of every stretch its least and greatest sample, {points} in all." if points < recording.samples else ""
    figures = [SectionFigure("Series.", words + thin, _series(one, points))]
    panels = _loops(one)
    if panels:
        draws = [partial(_draw_loop, one=one, up=up, over=over) for up, over in panels]
        figures.append(
            drawn(
                prefix,
                "Loops.",
                f"The first {LOOP_CYCLES:g} cycles of every shaded stretch, all of one without cycles.",
                draws,
            )
        )
    yield Section(recording.id, [facts, *one.said], (), figures)
    cuts = [
        [
            s.condition,
            *one.span(s),
            s.cycles or None,
            s.frequency or None,
            s.waveform,
            None if s.current != s.current else s.current,
        ]
        for s in one.segments
    ]
    heads = ("condition", "from (s)", "to (s)", "cycles", "frequency (Hz)", "waveform", "current (A)")
    warnings = [[f.channel or "all", f.at, f.text] for f in one.timed]
    warnings += [[f.channel or "all", None, f.text] for f in recording.findings if f.at is None]
    tables = [
        *([Table(_capped("Cuts", cuts), heads, cuts[:ROWS_DRAWN], digits=5)] if cuts else []),
        *(
            [Table(_capped("Warnings", warnings), ("channel", "at (s)", "what"), warnings[:ROWS_DRAWN], 6)]
            if warnings
            else []
        ),
        Table("Channels, SI", ("channel", "unit", "least", "mean", "greatest"), _ranges(recording), digits=5),
    ]
    yield Section(f"{recording.id}: cuts, warnings, channels", (), tables)


def _capped(words: str, rows: Sequence[object]) -> str:
    return words if len(rows) <= ROWS_DRAWN else f"{words}, the first {ROWS_DRAWN} of {len(rows)}"


def _ranges(recording: Recording) -> list[list[object]]:
    return [
        [name, recording.units.get(name, ""), *(float(f(values)) for f in (np.nanmin, np.nanmean, np.nanmax))]
        for name, values in recording.channels.items()
    ]


def _series(one: Signals, points: int) -> str:
    """Return the channels over time as an element of a page: a stretched picture each, whose window a script moves."""
    seconds = one.seconds
    cuts = "".join(
        f'<rect x="{a / seconds * ACROSS:.0f}" width="{max((b - a) / seconds * ACROSS, 1.0):.0f}" y="0" height="{UP}">'
        f"<title>{_text(s.condition)}</title></rect>"
        for s in one.segments
        for a, b in [one.span(s)]
    )
    rows = []
    for name, values in one.recording.channels.items():
        factor, unit = one.scaled(name)
        low, high = factor * float(np.nanmin(values)), factor * float(np.nanmax(values))
        lines = "".join(
            f'<path class="warned" d="M{(f.at or 0.0) / seconds * ACROSS:.0f} 0v{UP}">'
            f"<title>{_text(f.text)}</title></path>"
            for f in one.timed
            if f.channel in ("", name)
        )
        label = f"{name.replace('_', ' ')} ({unit})" if unit else name.replace("_", " ")
        rows.append(
            f'<div class="trace"><span>{_text(label)}</span><small>{high:.4g}</small><small>{low:.4g}</small>'
            f'<svg viewBox="0 0 {ACROSS} {UP}" preserveAspectRatio="none" role="img" '
            f'aria-label="{_text(label)} over time">'
            f'<g class="cuts">{cuts}</g>{lines}<path class="line" d="{_path(values, points)}"/></svg></div>'
        )
    return (
        f'<div class="series" data-seconds="{seconds:.9g}" data-across="{ACROSS}">{"".join(rows)}'
        '<div class="axis"></div><p class="buttons"></p></div>'
    )


def _path(values: Array, points: int) -> str:
    """Return a series as a path of relative lines in whole numbers; missing samples are left out."""
    at = decimate(values, points)
    at = at[np.isfinite(values[at])]
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    x = np.round(at / max(len(values) - 1, 1) * ACROSS).astype(np.int64)
    y = np.round((high - values[at]) / ((high - low) or 1.0) * UP).astype(np.int64)
    steps = zip(np.diff(x), np.diff(y), strict=True)
    return f"M{x[0]} {y[0]}l" + " ".join(f"{a} {b}" for a, b in steps) if len(x) else ""


def _text(text: str) -> str:
    return visible_in_page(escape(text))


def _loops(one: Signals) -> list[tuple[str, str]]:
    """Return the pairs of channels, up and across, whose loops are drawn; a velocity may be that of the motion."""
    there = one.recording.channels
    motions = {"velocity": "displacement", "angular_velocity": "angle"}
    found = []
    for up, over in LOOPS.items():
        if up in there and not (up == "current" and "flux" in there):
            names = [*over, "voltage"] if up == "current" else over
            found += [(up, name) for name in names if name in there or motions.get(name) in there]
    return found


def _draw_loop(axes: "Axes", one: Signals, up: str, over: str) -> None:
    """Draw a loop of every cut, or of the whole log where it has none."""
    recording = one.recording
    dt, values = recording.dt, recording.channels[up]
    ranges = [(slice(0, recording.samples), "")] if not one.segments else []
    for segment in one.segments:
        cycles = (
            int(LOOP_CYCLES / segment.frequency / dt) if segment.cycles and segment.frequency > 0.0 else segment.samples
        )
        ranges.append((slice(segment.start, min(segment.start + cycles + 1, segment.stop)), segment.condition))
    across = [_across(recording, over, part) for part, _ in ranges]
    factor, unit = prefixed(max(float(np.nanmax(np.abs(x), initial=0.0)) for x in across), _unit(recording, over))
    scale, text = one.scaled(up)
    for number, ((part, name), x) in enumerate(zip(ranges, across, strict=True)):
        kept = simplified(x, values[part])
        colour = PALETTE[number % len(PALETTE)]
        label = name if name and len(ranges) <= CUTS_NAMED else None
        axes.plot(factor * x[kept], scale * values[part][kept], lw=0.8, color=colour, label=label)
    axes.set(xlabel=axis_label(over, unit, over), ylabel=axis_label(up, text, up))
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=7, loc="best", handlelength=1.2, labelspacing=0.25)


def _unit(recording: Recording, name: str) -> str:
    return recording.units.get(name, "") or unit_of(name)


def _across(recording: Recording, name: str, part: slice) -> Array:
    """Return a channel over a range, or the velocity of the motion that was recorded."""
    if name in recording.channels:
        return np.asarray(recording.channels[name][part], dtype=np.float64)
    motion = np.asarray(recording.channels["displacement" if name == "velocity" else "angle"][part], dtype=np.float64)
    rate = Smoother(motion, moves=True).smoothed(1).values if len(motion) >= WINDOW_MIN else np.gradient(motion)
    return np.asarray(rate) / recording.dt
