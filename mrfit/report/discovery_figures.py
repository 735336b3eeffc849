"""The figures of a discovery: where the error sits, the error map, errors per condition, residuals, loops."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from textwrap import fill

import numpy as np

from mrfit.core.channels import symbol_of
from mrfit.core.specs import Array
from mrfit.io.schemas.discovery import DiscoveryFile, Where
from mrfit.report import figures
from mrfit.report.curves import decimate, prefixed
from mrfit.report.discovery_source import Discovery, Part
from mrfit.report.numbers import in_html, percent, significant
from mrfit.report.svg import Axes, Canvas, style, to_svg

BEFORE, AFTER, BAND_COLOUR = figures.SIMULATED, figures.HOLDOUT, "#fde68a"
CELLS = 48
# The residual map's scale ends at this quantile of its cells: a few that hold one bad sample must not hide the rest
BRIGHTEST = 0.99
DISCOVERY_PANELS = 6
DISCOVERY_POINTS = 900
TITLE_WIDTH = 46
# What is drawn of a record without cycles
SHOWN_SECONDS = 3.0
CYCLES = 2.0


def figures_of(discovery: Discovery) -> list[figures.Figure]:
    """Return every figure of a discovery; none where the data were too few."""
    with style():
        return list(_figures(discovery))


def _figures(discovery: Discovery) -> Iterator[figures.Figure]:
    if discovery.found.where:
        yield region_figure(discovery.found.where, "where", "Where the base model errs")
    if not discovery.parts:
        return
    # under a verdict that it is not the cause, curves that agree would say the contrary
    possible = discovery.found.ambiguous_set
    for name in dict.fromkeys(s.name for s in discovery.found.suspects if s.name in possible):
        if all(name in part.contributions for part in discovery.parts):
            yield suspect_figure(discovery, name)
    for channel in discovery.loops[:1]:
        yield map_figure(discovery, channel)
    yield error_figure(discovery)
    shown = worst_parts(discovery)
    yield residual_figure(discovery, shown)
    for channel in discovery.loops:
        yield loop_figure(discovery, shown, channel)
    rest = discovery.found.unexplained.where
    if rest and discovery.found.effects:
        yield region_figure(rest, "rest", "Where the error that is left sits")


def suspect_figure(discovery: Discovery, name: str) -> figures.Figure:
    """Return the force of a suspect beside what the measurement leaves without it, over time, one panel a condition."""
    shown = worst_parts(discovery)
    windows = [_window(p) for p in shown]
    seconds, time_unit = prefixed(max(float(p.time[w][-1]) for p, w in zip(shown, windows, strict=True)), "s")
    factor, unit = figures.scale_of([p.contributions[name].remainder for p in shown], discovery.output)

    def draw(axes: "Axes", part: Part) -> None:
        window, own = _window(part), part.contributions[name]
        for values, colour, width, label in (
            (own.remainder, figures.MEASURED, 2.2, f"measured {discovery.output} left without it"),
            (own.force, BEFORE, 1.0, f"{name} as fitted"),
        ):
            at = decimate(values[window], DISCOVERY_POINTS)
            axes.plot(seconds * part.time[window][at], factor * values[window][at], color=colour, lw=width, label=label)

    symbol = symbol_of(discovery.output)
    labels = (
        figures.axis_label("t", time_unit, "Time"),
        figures.axis_label(f"Δ{symbol}", unit, f"Part of the {discovery.output}"),
    )
    takes = taken_by(discovery.found, name)
    number = f" It takes {percent(takes)} of the squared error on held-out conditions." if takes is not None else ""
    caption = (
        f"What {name} adds to the simulated {discovery.output}, and what is left of the measured one when it alone is "
        f"set to neutral, on {_whose(shown)}, {_CUT}. Where it is the cause, the curves agree.{number}"
    )
    about = _Panels(f"suspect-{name}", f"What {name} would do", caption, *labels, share=True)
    return _panels(shown, draw, about)


def taken_by(found: DiscoveryFile, name: str) -> float | None:
    """Return the share of the squared error on held-out conditions that an effect took away when it was last tried."""
    return next((c.holdout_gain for c in found.candidates if c.name == name), None)


def _changed(discovery: Discovery) -> bool:
    """Return whether an effect was added: without one, what is after equals what was before and is not drawn."""
    return any(part.changed for part in discovery.parts)


def worst_parts(discovery: Discovery) -> list[Part]:
    """Return of the held-out conditions (of all where none was) the part that was worst before, at most six."""
    grouped = discovery.conditions("holdout") or discovery.conditions("train")
    worst = [max(parts, key=lambda p: p.errors[0]) for parts in grouped]
    chosen = sorted(worst, key=lambda p: -p.errors[0])[:DISCOVERY_PANELS]
    return [p for p in worst if any(p is c for c in chosen)]


def region_figure(regions: Sequence[Where], name: str, title: str) -> figures.Figure:
    """Return bars of each region's share of the squared error beside its share of the samples."""
    canvas = figures.canvas_of(figures.FIGURE_WIDTH * 0.85, 1.1 + 0.42 * len(regions))
    axes = canvas.subplots()
    places = np.arange(len(regions), dtype=np.float64)
    for key, shift, colour, label in (
        ("share_of_error", -0.19, BEFORE, "share of the squared error"),
        ("share_of_samples", 0.19, figures.QUIET, "share of the samples"),
    ):
        values = [100.0 * getattr(r, key) for r in regions]
        bars = axes.barh(places + shift, values, 0.36, color=colour, label=label)
        axes.bar_label(bars, [f"{v:.0f} %" if v >= 1.0 else f"{v:.1f} %" for v in values], padding=3, fontsize=8)
    axes.set(yticks=places, yticklabels=[r.region for r in regions], xlabel="Share (%)")
    axes.set_xlim(0.0, 1.12 * max(100.0 * max(r.share_of_error, r.share_of_samples) for r in regions))
    axes.set_ylim(len(regions) - 0.5, -0.5)
    axes.grid(axis="y", visible=False)
    canvas.legend(loc="outside upper right", ncols=2)
    first = regions[0]
    caption = (
        "The model errs in a region that clearly holds more of the squared error than of the samples. Regions overlap."
    )
    alt = (
        f"Bars; first {first.region}: {percent(first.share_of_error)} of the error in "
        f"{percent(first.share_of_samples)} of the samples."
    )
    return figures.Figure(name, title, caption, alt, to_svg(canvas, title), narrow=True)


def map_figure(discovery: Discovery, channel: str) -> figures.Figure:
    """Return RMS residuals over the drive–output plane, before and after on one colour scale, all conditions.

    Without an effect there is one map, the base model's.
    """
    parts = discovery.parts
    drive, output = (np.concatenate(v) for v in ([p.inputs[channel] for p in parts], [p.measured for p in parts]))
    across, across_unit = figures.scale_of([drive], channel)
    up, up_unit = figures.scale_of([output], discovery.output)
    drawn = _WHICH if _changed(discovery) else _WHICH[:1]
    maps = [_rms_map(drive, output, np.concatenate([getattr(p, which) for p in parts])) for which in drawn]
    ceiling = float(np.nanquantile(np.stack(maps), BRIGHTEST)) or 1.0
    factor, unit = prefixed(ceiling, discovery.unit)
    canvas = figures.canvas_of(figures.FIGURE_WIDTH if len(maps) > 1 else 0.6 * figures.FIGURE_WIDTH, 4.0)
    extent = (across * drive.min(), across * drive.max(), up * output.min(), up * output.max())
    image = None
    panels = canvas.subplots(1, len(maps), sharey=True, squeeze=False).ravel()
    for axes, values, title in zip(panels, maps, _titles(discovery), strict=False):
        axes.grid(False)
        image = axes.imshow(
            factor * values.T, origin="lower", extent=extent, aspect="auto", cmap="YlOrRd", vmin=0.0,
            vmax=factor * ceiling, interpolation="nearest",
        )  # fmt: skip
        axes.set_title(title)
        axes.set_xlabel(figures.axis_label(symbol_of(channel), across_unit, channel))
        axes.label_outer()
    canvas.axes[0].set_ylabel(figures.axis_label(symbol_of(discovery.output), up_unit, discovery.output))
    if image is not None:
        label = f"RMS residual ({unit})" if unit else "RMS residual"
        canvas.colorbar(image, ax=canvas.axes, extend="max", label=label)
    plane = f"RMS residual in every cell of the {channel.replace('_', ' ')}–{discovery.output} plane"
    both = ", before and after on one scale; its end" if len(maps) > 1 else "; the end of its scale"
    caption = f"{plane}, training and held-out conditions together{both} is the 99th percentile of the cells."
    typical = [f"{in_html(significant(factor * float(np.nanmedian(m))))} {unit}" for m in maps]
    words = f"{typical[0]} before and {typical[1]} after" if len(maps) > 1 else typical[0]
    alt = f"Map of the residual; the median cell holds {words}."
    return figures.Figure("map", "Residual map", caption, alt, to_svg(canvas, "Residual map"), narrow=len(maps) == 1)


def _rms_map(drive: Array, output: Array, residual: Array) -> Array:
    """Return RMS residuals (cells, cells) over drive and output, nan in cells without samples."""
    bounds = [(float(v.min()), float(v.max())) for v in (drive, output)]
    counts, *_ = np.histogram2d(drive, output, CELLS, bounds)
    power, *_ = np.histogram2d(drive, output, CELLS, bounds, weights=residual**2)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt(power / counts)


def _titles(discovery: Discovery) -> tuple[str, str]:
    found = discovery.found
    if not _changed(discovery):
        return found.base_model, ""
    return f"before: {found.base_model}", f"after: {found.augmented_model}"


def error_figure(discovery: Discovery) -> figures.Figure:
    """Return NRMSE of every condition before and after as dots, held-out ones first, with the noise floor as a tick."""
    rows = [("hold-out", parts) for parts in discovery.conditions("holdout")]
    rows += [("training", parts) for parts in discovery.conditions("train")]
    span = discovery.span
    canvas = figures.canvas_of(figures.FIGURE_WIDTH * 0.85, 1.3 + 0.27 * len(rows))
    axes = canvas.subplots()
    places = list(range(len(rows)))
    before, after = ([100.0 * _rms([getattr(p, w) for p in parts]) / span for _, parts in rows] for w in _WHICH)
    floors = [100.0 * float(np.sqrt(np.mean([p.floor**2 for p in parts]))) / span for _, parts in rows]
    changed = _changed(discovery)
    name = "before" if changed else discovery.found.base_model
    axes.hlines(places, after, before, color="#cbd5e1", lw=1.4, zorder=1)
    axes.plot(before, places, "o", ms=6.5, color=BEFORE, ls="none", label=name, zorder=3)
    if changed:
        axes.plot(after, places, "o", ms=6.5, mfc="white", mec=AFTER, mew=1.6, ls="none", label="after", zorder=3)
    seen = [(floor, place) for floor, place in zip(floors, places, strict=True) if floor > 0.0]
    if seen:
        axes.plot(
            *zip(*seen, strict=True), "|", ms=13, mew=2.0, color="#475569", ls="none", label="noise floor", zorder=2
        )
    names = [f"{parts[0].segment.condition} ({role})" for role, parts in rows]
    axes.set(xlabel="NRMSE (% of the range over all conditions)", yticks=places, yticklabels=names)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    if max(before) > 10.0 * min([*after, *(floor for floor, _ in seen)]) > 0.0:
        axes.set_xscale("log")
        figures.plain_log(axes)
    else:
        axes.set_xlim(left=0.0)
    canvas.legend(loc="outside upper right", ncols=3)
    gap = discovery.found.gap
    both = _after(discovery)
    caption = (
        f"Error of every condition{both}, as a share of the output's range over all conditions; the bar is "
        "the noise floor. Held-out conditions took no part in any fit."
    )
    later = f" before and {percent(gap.after)} after" if both else ""
    alt = f"Dots; on held-out conditions {percent(gap.before)}{later}."
    return figures.Figure(
        "error", f"Error per condition{',' if both else ''}{both}", caption, alt, to_svg(canvas, "NRMSE"), narrow=True
    )


_WHICH = ("before", "after")


@dataclass(frozen=True)
class _Step:
    """An error on held-out conditions (NRMSE) before and after something was added."""

    name: str
    before: float | None
    after: float | None


def gap_canvas(found: DiscoveryFile) -> "Canvas":
    """Return the error on held-out conditions without and with each effect that was named, and with all of them.

    Of effects of which the data cannot tell which one it is, the error with each is drawn.
    """
    gap = found.gap
    steps = [_Step(f"{found.base_model}: all", gap.before, gap.after)]
    steps += [_Step(e.name, e.holdout_nrmse_before, e.holdout_nrmse_after) for e in found.effects]
    steps += [_Step(f"perhaps {s.name}", gap.before, s.holdout_nrmse_after) for s in found.suspects]
    canvas = figures.canvas_of(figures.FIGURE_WIDTH * 0.85, 1.3 + 0.4 * len(steps))
    axes = canvas.subplots()
    places = np.arange(len(steps), dtype=np.float64)
    for shift, colour, label, values in (
        (-0.19, BEFORE, "without", [s.before for s in steps]),
        (0.19, AFTER, "with", [s.after for s in steps]),
    ):
        known = [0.0 if v is None else 100.0 * v for v in values]
        bars = axes.barh(places + shift, known, 0.36, color=colour, label=label)
        axes.bar_label(bars, [percent(v) for v in values], padding=3, fontsize=8)
    if gap.noise_floor:
        axes.axvline(100.0 * gap.noise_floor, color="#475569", lw=1.2, ls="--", label="noise floor")
    most = max(v for s in steps for v in (s.before, s.after) if v is not None)
    axes.set(yticks=places, yticklabels=[s.name for s in steps], xlabel="NRMSE on held-out conditions (%)")
    axes.set_xlim(0.0, 115.0 * most)
    axes.set_ylim(len(steps) - 0.5, -0.5)
    axes.grid(axis="y", visible=False)
    canvas.legend(loc="outside upper right", ncols=3)
    return canvas


def _rms(errors: Sequence[Array]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def residual_figure(discovery: Discovery, shown: Sequence[Part]) -> figures.Figure:
    """Return residuals over time before and after, one panel a condition, one scale, with the noise floor as a band."""
    windows = [_window(p) for p in shown]
    seconds, time_unit = prefixed(max(float(p.time[w][-1]) for p, w in zip(shown, windows, strict=True)), "s")
    factor, unit = figures.scale_of([p.before for p in shown], discovery.output)

    def draw(axes: "Axes", part: Part) -> None:
        window = _window(part)
        if part.floor > 0.0:
            axes.axhspan(-factor * part.floor, factor * part.floor, color=BAND_COLOUR, lw=0, label="± noise floor")
        for values, colour, label in _errors_of(part, discovery):
            at = decimate(values[window], DISCOVERY_POINTS)
            # as everywhere on pages: measured minus simulated
            axes.plot(seconds * part.time[window][at], -factor * values[window][at], color=colour, lw=0.9, label=label)

    symbol = symbol_of(discovery.output)
    labels = (
        figures.axis_label("t", time_unit, "Time"),
        figures.axis_label(f"{symbol} − {symbol}\u0302", unit, "Residual"),
    )
    caption = f"Measured minus simulated {discovery.output} on {_whose(shown)}, all panels on one scale, {_CUT}."
    about = _Panels("residual", f"Residual{_after(discovery)}", caption, *labels, share=True)
    return _panels(shown, draw, about)


def loop_figure(discovery: Discovery, shown: Sequence[Part], channel: str) -> figures.Figure:
    """Return output against one input, measured and simulated before and after, one panel a condition."""
    across, across_unit = figures.scale_of([p.inputs[channel] for p in shown], channel)
    factor, unit = figures.scale_of([p.measured for p in shown], discovery.output)

    def draw(axes: "Axes", part: Part) -> None:
        window = _window(part)
        drive = across * part.inputs[channel][window]
        curves = [(part.measured, figures.MEASURED, "measured")]
        curves += [(part.measured + errors, colour, label) for errors, colour, label in _errors_of(part, discovery)]
        for values, colour, label in curves:
            at = decimate(values[window], DISCOVERY_POINTS)
            width = 2.6 if colour == figures.MEASURED else 0.9
            axes.plot(drive[at], factor * values[window][at], color=colour, lw=width, label=label)

    labels = (
        figures.axis_label(symbol_of(channel), across_unit, channel),
        figures.axis_label(symbol_of(discovery.output), unit, discovery.output),
    )
    what = f"{discovery.output}–{channel} loop".replace("_", " ")
    title = f"{what[0].upper()}{what[1:]}{_after(discovery)}"
    caption = f"Measured and simulated on {_whose(shown)}, {_CUT}."
    return _panels(shown, draw, _Panels(f"loop-{channel}".replace("_", "-"), title, caption, *labels))


_CUT = f"two cycles, or {SHOWN_SECONDS:g} s where the test is not periodic"


def _after(discovery: Discovery) -> str:
    return " before and after" if _changed(discovery) else ""


def _errors_of(part: Part, discovery: Discovery) -> list[tuple[Array, str, str]]:
    """Return the errors that are drawn of a part, with colour and label: before and after, or the base model's."""
    if _changed(discovery):
        return [(part.before, BEFORE, "before"), (part.after, AFTER, "after")]
    return [(part.before, BEFORE, discovery.found.base_model)]


def _whose(shown: Sequence[Part]) -> str:
    return "held-out conditions" if shown[0].segment.role == "holdout" else "training conditions"


def _window(part: Part) -> slice:
    """Return two cycles, or the three seconds with the largest error where there are none."""
    dt = float(part.time[1] - part.time[0])
    if part.segment.cycles and part.segment.frequency > 0.0:
        return slice(0, int(CYCLES / part.segment.frequency / dt) + 1)
    width = int(SHOWN_SECONDS / dt)
    if width >= len(part.time):
        return slice(None)
    running = np.concatenate([[0.0], np.cumsum(part.before**2)])
    first = int(np.argmax(running[width:] - running[:-width]))
    return slice(first, first + width)


@dataclass(frozen=True)
class _Panels:
    """Names and axes of a figure of panels, and whether the axes are shared."""

    name: str
    title: str
    caption: str
    across: str
    up: str
    share: bool = False


def _panels(shown: Sequence[Part], draw: Callable[["Axes", Part], None], about: _Panels) -> figures.Figure:
    columns = figures.columns_of(len(shown))
    canvas = figures.canvas_of(figures.FIGURE_WIDTH, 0.75 + (3.6 if columns == 1 else 2.7) * -(-len(shown) // columns))
    panels = figures.first_panels(canvas, len(shown), columns, away=True, sharey=about.share)
    for axes, part in zip(panels, shown, strict=True):
        draw(axes, part)
        axes.set_title(fill(part.segment.condition, TITLE_WIDTH))
    canvas.supxlabel(about.across)
    canvas.supylabel(about.up)
    canvas.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
    alt = f"{about.title}: {', '.join(p.segment.condition for p in shown)}."
    return figures.Figure(about.name, about.title, about.caption, alt, to_svg(canvas, about.title))
