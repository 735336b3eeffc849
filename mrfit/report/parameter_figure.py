"""Parameters of fits over current, temperature, frequency or amplitude, with their 95 % intervals."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import Any

import numpy as np

from mrfit.core.grouping import grouped
from mrfit.core.recording import Segment
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.io.schemas.fit import Band, Fit, Quantity, Result
from mrfit.report.numbers import unit_html
from mrfit.report.paper import COLOURS, DASHES, panels
from mrfit.report.svg import Axes, Canvas
from mrfit.simulate.current_dependence import base_name, node_of

UNITS = {"current": "A", "temperature": "°C", "frequency": "Hz", "amplitude": "SI"}
PANELS_MAX = 12
FEW_DOTS = 40
"""Points of a panel that are marked one by one."""
SAME = 0.05
"""Share within which two tests have the same frequency, amplitude or current."""


@dataclass(frozen=True)
class _Line:
    """A parameter over a quantity, of conditions that differ in nothing else."""

    label: str
    places: list[float]
    quantities: list[Quantity]
    band: Band | None = None


def parameters(fits: Sequence[Fit], segments: Sequence[Segment], over: str, width: float) -> "Canvas":
    """Return every free parameter over a quantity, a panel each.

    Sets of parameters are joined where their conditions differ in the quantity alone; the band joins their 95 %
    intervals. Of a joint fit that depends on current the curve is the model's, with its pointwise and simultaneous 95 %
    bands, and the values at its nodes have bars.

    Parameters
    ----------
    fits
        The fits.
    segments
        Segments of the workspace, for the temperature of conditions.
    over
        ``current``, ``temperature``, ``frequency`` or ``amplitude``.
    width
        Inches.

    Raises
    ------
    DataError
        If no parameter has several values of the quantity.
    """
    found = _lines(fits, segments, over)
    if not found:
        names = ", ".join(f.name for f in fits)
        raise DataError(
            f"{names}: no parameter has several values over {over}; fit per condition, or draw over another"
        )
    chosen = list(found)[:PANELS_MAX]
    canvas, axes = panels(width, len(chosen), across=3)
    labels = list(dict.fromkeys(line.label for name in chosen for line in found[name]))
    for panel, name in zip(axes, chosen, strict=True):
        _panel(panel, found[name], name, labels)
    if 1 < len(labels) <= len(COLOURS):
        handles = {label: h for axis in axes for h, label in zip(*axis.get_legend_handles_labels(), strict=True)}
        canvas.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=1 if width < 5.0 else 3)
    unit = UNITS[over]
    canvas.supxlabel(f"{over.capitalize()} ({unit})" if unit != "SI" else "Amplitude (SI unit)", fontsize=7.5)
    return canvas


def _lines(fits: Sequence[Fit], segments: Sequence[Segment], over: str) -> dict[str, list[_Line]]:
    warmth = grouped((s.condition, s.temperature) for s in segments if np.isfinite(s.temperature))
    found: dict[str, list[_Line]] = {}
    for fit in fits:
        lines = _joint(fit) if len(fit.results) == 1 and over == "current" else _by_condition(fit, over, warmth)
        for name, own in lines.items():
            label = fit.name if len(fits) > 1 else ""
            found.setdefault(name, []).extend(
                _Line(", ".join(filter(None, (label, one.label))), one.places, one.quantities, one.band) for one in own
            )
    return found


def quantity_of(fit: Fit, segments: Sequence[Segment]) -> str:
    """Return over what the parameters of a fit can be drawn, current before others; empty where over nothing."""
    return next((over for over in UNITS if _lines([fit], segments, over)), "")


def _panel(axes: "Axes", lines: Sequence[_Line], name: str, labels: Sequence[str]) -> None:
    few = sum(len(line.places) for line in lines) <= FEW_DOTS
    for line in lines:
        number = labels.index(line.label)
        colour, dash = COLOURS[number % len(COLOURS)], DASHES[number % len(DASHES)]
        values = np.array([q.value for q in line.quantities])
        low, high = (_ends(column) for column in ([q.low for q in line.quantities], [q.high for q in line.quantities]))
        mark: dict[str, Any] = {"color": colour, "marker": "o" if few else "", "ms": 2.8, "label": line.label or None}
        if line.band is None:
            axes.fill_between(line.places, low, high, color=colour, alpha=0.18, lw=0)
            axes.plot(line.places, values, ls=dash, lw=0.9, **mark)
        else:
            _band(axes, line.band, colour, dash)
            bars = np.stack(
                [values - np.where(np.isnan(low), values, low), np.where(np.isnan(high), values, high) - values]
            )
            axes.errorbar(line.places, values, np.maximum(bars, 0.0), ls="none", capsize=2.0, elinewidth=0.8, **mark)
    first = lines[0].quantities[0]
    text = first.text.rpartition(" at ")[0] if node_of(first.name) else first.text
    words = fill(f"{text[:1].upper()}{text[1:]}, {name}" if text else name, 40)
    unit = unit_html(first.unit)
    axes.set_title(f"{words} ({unit})" if unit else words)
    axes.locator_params(axis="x", nbins=5)
    axes.locator_params(axis="y", nbins=5)


def _band(axes: "Axes", band: Band, colour: str, dash: Any) -> None:
    """Draw a curve with its bands, the simultaneous one lighter and its edges dotted; a jump parts it."""
    current = np.array(band.current)
    stretches = np.split(np.arange(len(current)), np.flatnonzero(np.diff(current) < 1e-9 * np.ptp(current)) + 1)
    ends = [_ends(column) for column in (band.low, band.high, band.low_everywhere, band.high_everywhere)]
    value = np.array(band.value)
    for at in stretches:
        low, high, least, most = (end[at] for end in ends)
        axes.fill_between(current[at], least, most, color=colour, alpha=0.13, lw=0)
        axes.fill_between(current[at], low, high, color=colour, alpha=0.28, lw=0)
        for edge in (least, most):
            axes.plot(current[at], edge, color=colour, lw=0.5, ls=(0, (1, 1.5)))
        axes.plot(current[at], value[at], ls=dash, lw=0.9, color=colour)


def _ends(column: Sequence[float | None]) -> Array:
    return np.array([np.nan if end is None else end for end in column])


def _by_condition(fit: Fit, over: str, warmth: Mapping[str, Sequence[float]]) -> dict[str, list[_Line]]:
    groups: dict[tuple[float | None, ...], list[tuple[float, Result]]] = {}
    others = [n for n in ("frequency", "amplitude", "current") if n != over]
    levels = {n: _levels(getattr(r.at, n) for r in fit.results) for n in others}
    for result in fit.results:
        place = _place(result, over, warmth)
        if place is not None:
            held = tuple(_nominal(getattr(result.at, n), levels[n]) for n in others)
            groups.setdefault(held, []).append((place, result))
    several = {rest: sorted(own, key=lambda p: p[0]) for rest, own in groups.items() if len({p for p, _ in own}) > 1}
    differing = [k for k in range(len(others)) if len({rest[k] for rest in several}) > 1]
    lines: dict[str, list[_Line]] = {}
    for rest, own in several.items():
        label = ", ".join(filter(None, (_said(others[k], rest[k]) for k in differing)))
        for k, q in enumerate(own[0][1].parameters):
            if not q.fixed:
                line = _Line(label, [p for p, _ in own], [r.parameters[k] for _, r in own])
                lines.setdefault(q.name, []).append(line)
    return lines


def _levels(values: Iterable[float | None]) -> list[float]:
    """Return the levels of a quantity, rising: what a rig holds differs a little from test to test."""
    found: list[list[float]] = []
    for value in sorted(v for v in values if v is not None):
        if found and abs(value - found[-1][0]) <= SAME * max(abs(value), abs(found[-1][0])):
            found[-1].append(value)
        else:
            found.append([value])
    return [float(np.mean(level)) for level in found]


def _nominal(value: float | None, levels: Sequence[float]) -> float | None:
    return None if value is None else min(levels, key=lambda level: abs(level - value))


def _said(name: str, value: float | None) -> str:
    unit = {"frequency": "Hz", "current": "A"}.get(name, "")
    return "" if value is None else f"{value:.3g} {unit}" if unit else f"amplitude {value:.3g}"


def _place(result: Result, over: str, warmth: Mapping[str, Sequence[float]]) -> float | None:
    if over == "temperature":
        found = warmth.get(result.condition)
        return float(np.mean(found)) if found else None
    value: float | None = getattr(result.at, over)
    return value


def _joint(fit: Fit) -> dict[str, list[_Line]]:
    """Return the parameters of a joint fit that depend on current, with the model's curve and its bands."""
    bands = {band.name: band for band in fit.results[0].bands}
    nodes = ((q, node) for q in fit.results[0].parameters if (node := node_of(q.name)) is not None)
    found = grouped((base_name(q.name), (node.current, q)) for q, node in nodes if base_name(q.name) in bands)
    return {n: [_Line("", [i for i, _ in own], [q for _, q in own], bands[n])] for n, own in found.items()}
