"""Draws of the posterior of a fit: every parameter, and every two of them over each other."""

from typing import TYPE_CHECKING

import numpy as np

from mrfit.io.schemas.fit import Fit
from mrfit.report.numbers import unit_html

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

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
    from matplotlib.figure import Figure

    from mrfit.report.figures import PALETTE, QUIET

    result = next(r for r in fit.results if r.draws)
    draws = result.draws
    assert draws is not None
    rows, names = np.array(draws.rows), draws.names[:MOST_OF_CORNER]
    units = {p.name: unit_html(p.unit) for p in result.parameters}
    canvas = Figure(figsize=(width, width), layout="constrained")
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
