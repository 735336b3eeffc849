"""Figures of a test sheet, the same on the page and on the printed sheet: loops, peak forces, history over cycles."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mrfit.core.specs import Array
from mrfit.io.schemas.sheet import SheetCondition, UnitRow, VerdictRow
from mrfit.report.curves import prefixed, simplified
from mrfit.report.figures import PALETTE, QUIET, shades
from mrfit.report.numbers import natural
from mrfit.report.svg import Axes
from mrfit.sheet.measured import CycleCourse, MeanLoop

LEGEND_MAX = 8
"""Curves of a figure that a legend names one by one."""
LIMIT_COLOUR = "#c2410c"


def colours_of(currents: Sequence[float]) -> Callable[[float], str]:
    """Return the colour of a current among several, dark to light; one colour where there are not two."""
    known = sorted({round(c, 2) for c in currents if np.isfinite(c)})
    if len(known) < 2:
        return lambda current: PALETTE[0]
    table = dict(zip(known, shades(len(known)), strict=True))
    return lambda current: table.get(round(current, 2), QUIET)


def scale_of(values: Sequence[Array], unit: str) -> tuple[float, str]:
    """Return factor and unit in which several curves are drawn."""
    return prefixed(max((float(np.max(np.abs(v), initial=0.0)) for v in values), default=0.0), unit)


class _Lines:
    """Curves of a figure; those of one style are drawn as one with gaps, since hundreds of artists take seconds."""

    def __init__(self) -> None:
        self._curves: dict[tuple[tuple[str, Any], ...], list[tuple[Array, Array]]] = {}

    def add(self, x: Array, y: Array, **style: Any) -> None:
        """Add a curve, x and y (N,), with the style and the label of a line of matplotlib."""
        self._curves.setdefault(tuple(style.items()), []).append((x, y))

    def draw(self, axes: "Axes") -> None:
        """Draw the curves."""
        for style, curves in self._curves.items():
            x, y = (
                np.concatenate([np.append(one, np.nan) for one in column])[:-1] for column in zip(*curves, strict=True)
            )
            axes.plot(x, y, **dict(style))


def draw_loops(axes: "Axes", loops: Sequence[MeanLoop], against: Sequence[MeanLoop], over: str) -> None:
    """Draw force over ``displacement`` or ``velocity`` of all conditions, those compared with as dashed lines."""
    everything = [*loops, *against]
    across, unit = scale_of([getattr(one, over) for one in everything], "m" if over == "displacement" else "m/s")
    up, force = scale_of([one.force for one in everything], "N")
    colour = colours_of([one.current for one in everything])
    by_current = len({round(one.current, 2) for one in loops if np.isfinite(one.current)}) > 1
    one_by_one = not by_current and len(loops) <= LEGEND_MAX
    lines = _Lines()
    for number, one in enumerate(everything):
        x, y = across * getattr(one, over), up * one.force
        kept = simplified(x, y)
        own = number < len(loops)
        lines.add(
            x[kept],
            y[kept],
            color=PALETTE[number % len(loops) % len(PALETTE)] if one_by_one else colour(one.current),
            lw=0.9 if own else 0.7,
            ls="-" if own else (0, (4, 2)),
            label=(f"{one.current:.3g} A" if by_current else one.condition)
            if own and (by_current or one_by_one)
            else None,
        )
    lines.draw(axes)
    axes.set(xlabel=f"{over.capitalize()} ({unit})", ylabel=f"Force ({force})")
    axes.locator_params(nbins=6)
    if over == "velocity" and axes.get_legend_handles_labels()[0]:
        # where no curve is: a damper's force has the sign of the velocity
        handles, words = axes.get_legend_handles_labels()
        # two currents may be one in three digits
        named = dict(zip(words, handles, strict=True))
        ordered = sorted(named, key=natural)
        axes.legend(
            [named[text] for text in ordered], ordered,
            fontsize=7, loc="upper left", handlelength=1.2, labelspacing=0.25,
        )  # fmt: skip


def draw_peaks(axes: "Axes", conditions: Sequence[SheetCondition]) -> None:
    """Draw the peak forces of both directions over the peak velocity, by current, with their intervals."""
    rows = [(c, {q.name: q for q in c.quantities}) for c in conditions]
    rows = [(c, q) for c, q in rows if "Fmax+" in q and q["Fmax+"].value is not None]
    speeds = np.array([c.peak_velocity for c, _ in rows])
    across, unit = scale_of([speeds], "m/s")
    forces = [abs(q[n].value or 0.0) for _, q in rows for n in ("Fmax+", "Fmax-")]
    up, force = scale_of([np.array(forces)], "N")
    currents = [float("nan") if c.current is None else c.current for c, _ in rows]
    colour = colours_of(currents)
    levels = [round(c, 2) if np.isfinite(c) else None for c in currents]
    for level in dict.fromkeys(levels):
        own = [(c.peak_velocity, q) for (c, q), lv in zip(rows, levels, strict=True) if lv == level]
        own.sort(key=lambda one: one[0])
        x = across * np.array([v for v, _ in own])
        for name, mark in (("Fmax+", "o"), ("Fmax-", "v")):
            y = np.array([abs(q[name].value or 0.0) for _, q in own])
            half = np.array([((q[name].high or 0.0) - (q[name].low or 0.0)) / 2.0 for _, q in own])
            words = "v > 0" if name == "Fmax+" else "v < 0"
            label = words if level is None else f"{level:g} A, {words}"
            axes.errorbar(
                x, up * y, up * half, marker=mark, ms=3.2, lw=0.8, capsize=1.5,
                color=PALETTE[0] if level is None else colour(level),
                ls="-" if name == "Fmax+" else (0, (3, 2)),
                label=label if len(set(levels)) <= LEGEND_MAX // 2 else None,
            )  # fmt: skip
    axes.set(xlabel=f"Peak velocity ({unit})", ylabel=f"Peak force ({force})")
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=7, loc="best", handlelength=1.8, labelspacing=0.25)


def draw_history(axes: "Axes", courses: Sequence[CycleCourse]) -> str:
    """Draw the peak force of every cycle over that of the first, over the temperature where it moves, else the number.

    Return the words of the horizontal axis.
    """
    warm = any(np.ptp(one.temperature) > 1.0 for one in courses if np.isfinite(one.temperature).all())
    lines = _Lines()
    for number, one in enumerate(courses):
        x = one.temperature if warm else np.arange(1.0, len(one.force) + 1.0)
        mean = float(np.mean(one.force)) or 1.0
        lines.add(
            x, 100.0 * (one.force / mean - 1.0), marker=".", ms=2.5, lw=0.6, color=PALETTE[number % len(PALETTE)],
            label=one.condition if len(courses) <= LEGEND_MAX else None,
        )  # fmt: skip
    lines.draw(axes)
    if 1 < len(courses) <= LEGEND_MAX:
        axes.legend(fontsize=6, loc="best", handlelength=1.0, labelspacing=0.2)
    words = "Temperature (°C)" if warm else "Cycle"
    axes.set(xlabel=words, ylabel="Peak force off the mean (%)")
    if not warm:
        from matplotlib.ticker import MaxNLocator

        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    return words


def draw_distribution(axes: "Axes", units: Sequence[UnitRow], wanted: VerdictRow) -> None:
    """Draw a judged quantity of all units in their order, with intervals and limits; those that fail stand out."""
    place = "unit", wanted.condition, wanted.quantity
    judged = [v for unit in units for v in unit.verdicts if (v.level, v.condition, v.quantity) == place]
    rows = [v for v in judged if v.value is not None and v.low is not None and v.high is not None]
    values = np.array([[v.value, v.low, v.high] for v in rows], dtype=np.float64)
    up, text = scale_of([values], wanted.si_unit)
    at = np.arange(1, len(rows) + 1)
    for said, colour in (("pass", PALETTE[0]), ("cannot be judged", QUIET), ("fail", LIMIT_COLOUR)):
        own = np.array([v.verdict == said for v in rows], dtype=bool)
        if own.any():
            y = up * values[own]
            axes.errorbar(
                at[own], y[:, 0], [y[:, 0] - y[:, 1], y[:, 2] - y[:, 0]], ls="none", marker=".", ms=3, lw=0.5,
                color=colour, label=f"{said}: {int(own.sum())}",
            )  # fmt: skip
    for end in (wanted.least, wanted.most):
        if end is not None:
            axes.axhline(up * end, color=LIMIT_COLOUR, lw=0.8, ls=(0, (4, 2)))
    axes.set(xlabel="Unit", ylabel=f"{wanted.quantity} ({text})" if text else wanted.quantity)
    axes.set_title(f"{wanted.quantity}, {wanted.condition}")
    axes.legend(fontsize=7, loc="best")
