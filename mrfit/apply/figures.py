"""Figures of ``mrfit apply``, in the report's style."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.report.curves import decimate
from mrfit.report.figures import MEASURED, PALETTE, QUIET, SIMULATED, panels_of
from mrfit.report.svg import inline, style, to_svg

_POINTS = 1500


@dataclass(frozen=True)
class Curve:
    """A curve of a panel."""

    x: Array
    y: Array
    label: str = ""
    color: str = PALETTE[0]
    line: str = "-"
    width: float = 1.2


@dataclass(frozen=True)
class Panel:
    """A panel of a figure: curves, and bands between two of them."""

    title: str
    x: str
    y: str
    curves: Sequence[Curve]
    band: tuple[Array, Array, Array, str] | None = None
    marks: Sequence[tuple[float, float]] = ()
    log: bool = False


def figure(panels: Sequence[Panel], prefix: str, alt: str, across: int = 1, height: float = 2.4) -> str:
    """Return panels as an SVG element of a page.

    Parameters
    ----------
    panels
        What to draw.
    prefix
        Letters and digits, unique on the page.
    alt
        What it shows, for those who do not see it.
    across
        Panels side by side.
    height
        Of a row of panels in inches.
    """
    with style():
        canvas, grid = panels_of(len(panels), across, height)
        for axes, panel in zip(grid, panels, strict=True):
            if panel.band is not None:
                at, low, high, label = panel.band
                some = decimate(high, _POINTS)
                axes.fill_between(at[some], low[some], high[some], color="#e2e8f0", label=label, linewidth=0)
            for first, last in panel.marks:
                axes.axvspan(first, last, color="#fee2e2", linewidth=0, zorder=0)
            for curve in panel.curves:
                some = decimate(curve.y, _POINTS) if len(curve.y) > _POINTS else np.arange(len(curve.y))
                axes.plot(
                    curve.x[some], curve.y[some], color=curve.color, linestyle=curve.line, linewidth=curve.width,
                    label=curve.label or None,
                )  # fmt: skip
            axes.set(title=panel.title, xlabel=panel.x, ylabel=panel.y)
            if panel.log:
                axes.set(xscale="log", yscale="log")
            if any(c.label for c in panel.curves) or panel.band is not None:
                axes.legend(
                    labelcolor="#334155",
                    ncols=len(panel.curves) + 1,
                    fontsize=8,
                    # above the panel, beside its title, where no curve is
                    loc="lower right",
                    bbox_to_anchor=(1.0, 1.0),
                    borderaxespad=0.1,
                    columnspacing=1.2,
                )
        return inline(to_svg(canvas, alt), prefix, alt)


__all__ = ["MEASURED", "PALETTE", "QUIET", "SIMULATED", "Curve", "Panel", "figure"]
