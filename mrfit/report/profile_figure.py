"""Profile likelihoods: how the cost of a fit rises as one parameter is held and the others are refitted."""

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill

import numpy as np
from scipy.interpolate import PchipInterpolator

from mrfit.errors import DataError
from mrfit.io.schemas.fit import Fit, Profile, Quantity
from mrfit.report.numbers import unit_html
from mrfit.report.paper import COLOURS, DASHES, MOST_PANELS, NARROW_WIDTH, panels
from mrfit.report.svg import Axes, Canvas
from mrfit.simulate.current_dependence import base_name

PROFILE_POINTS = 120
TALLEST = 2.2
"""Multiples of the rise at the interval's ends up to which profiles are drawn."""
FEW_PROFILES = 6
"""Sets of parameters on shared axes."""


@dataclass(frozen=True)
class _NamedProfile:
    """A profile, its parameter, and what it is called beside others."""

    profile: Profile
    quantity: Quantity
    label: str


def has_profiles(fit: Fit) -> bool:
    """Return whether the intervals of a fit are those of profile likelihoods."""
    return any(result.profiles for result in fit.results)


def profiles(fits: Sequence[Fit], width: float) -> "Canvas":
    """Return the profile likelihood of every parameter, a panel each; the dashed line cuts it at its 95 % interval.

    Parameters
    ----------
    fits
        The fits; of many sets of parameters the first ``FEW_PROFILES`` are drawn.
    width
        Inches.

    Raises
    ------
    DataError
        If no profile was computed.
    """
    found: dict[str, list[_NamedProfile]] = {}
    for fit in fits:
        for result in [r for r in fit.results if r.profiles][:FEW_PROFILES]:
            label = ", ".join([fit.name] * (len(fits) > 1) + [result.condition] * (len(fit.results) > 1))
            rows = {q.name: q for q in result.parameters}
            for profile in result.profiles:
                found.setdefault(profile.name, []).append(_NamedProfile(profile, rows[profile.name], label))
    if not found:
        names = ", ".join(f.name for f in fits)
        raise DataError(f"{names}: no profile likelihood was computed; fit with --intervals profile")
    chosen = list(found)[:MOST_PANELS]
    narrow = 2 if len(chosen) > 3 else 1
    canvas, axes = panels(width, len(chosen), across=3, narrow=narrow)
    labels = list(dict.fromkeys(one.label for name in chosen for one in found[name]))
    for panel, name in zip(axes, chosen, strict=True):
        for one in found[name]:
            _profile(panel, one, labels.index(one.label))
        quantity = found[name][0].quantity
        words, unit = f"{quantity.text[:1].upper()}{quantity.text[1:]}, {base_name(name)}", unit_html(quantity.unit)
        panel.set_title(fill(f"{words} ({unit})" if unit else words, 24 if width < NARROW_WIDTH and narrow > 1 else 40))
        panel.locator_params(axis="x", nbins=3 if narrow > 1 else 4)
        panel.locator_params(axis="y", nbins=5)
    if 1 < len(labels) <= len(COLOURS):
        handles = {label: h for axis in axes for h, label in zip(*axis.get_legend_handles_labels(), strict=True)}
        canvas.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=1 if width < 5.0 else 3)
    canvas.supylabel("Rise of the cost, in variances of the residual", fontsize=7.5)
    return canvas


def _profile(axes: "Axes", one: _NamedProfile, number: int) -> None:
    """Draw the square of the signed root of the rise: that root is nearly a straight line, whatever the rise."""
    values, rises = np.array(one.profile.values), np.array(one.profile.rises)
    colour, dash = COLOURS[number % len(COLOURS)], DASHES[number % len(DASHES)]
    limit = one.profile.quantile**2
    values, places = np.unique(values, return_index=True)
    roots = np.where(values < one.quantity.value, -1.0, 1.0) * rises[places]
    axes.axhline(limit, color="#334155", lw=0.7, ls=(0, (4, 2)))
    if len(values) > 2:
        fine = np.linspace(values[0], values[-1], PROFILE_POINTS)
        axes.plot(fine, PchipInterpolator(values, roots)(fine) ** 2, ls=dash, lw=0.9, color=colour)
    axes.plot(values, roots**2, ls="none", marker="o", ms=2.2, color=colour, label=one.label or None)
    for end in (one.quantity.low, one.quantity.high):
        if end is not None:
            axes.axvline(end, 0.0, 1.0 / TALLEST, color=colour, lw=0.6)
    axes.set_ylim(0.0, TALLEST * limit)
