"""Figures of the studies: many curves over each other, measured and simulated, as small SVG files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mrfit.report.svg import style, to_svg

FOLDER = Path(__file__).resolve().parent.parent.parent / "docs" / "studies"
PALETTE = ("#0f766e", "#c2410c", "#1d4ed8", "#a16207", "#7e22ce", "#475569")
MOST_POINTS = 160


@dataclass(frozen=True)
class Curve:
    """One curve: x, y (N,), its legend, a place in the palette, matplotlib's line style (empty: none) and mark."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    label: str = ""
    colour: int = 0
    line: str = "-"
    mark: str = ""


@dataclass(frozen=True)
class Panel:
    """Curves over each other."""

    title: str
    axes: tuple[str, str]
    curves: Sequence[Curve]
    log: bool = False


def draw(name: str, panels: Sequence[Panel]) -> None:
    """Write panels side by side as one file."""
    with style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(4.6 * len(panels), 3.4), layout="constrained")
        for axes, panel in zip(np.atleast_1d(figure.subplots(1, len(panels))), panels, strict=True):
            for c in panel.curves:
                step = max(1, len(c.x) // MOST_POINTS)
                colour = PALETTE[c.colour % len(PALETTE)]
                look = {"ls": c.line or "none", "marker": c.mark or "none", "ms": 4.0, "lw": 1.1}
                axes.plot(c.x[::step], c.y[::step], label=c.label, color=colour, **look)
            axes.set_title(panel.title)
            axes.set_xlabel(panel.axes[0])
            axes.set_ylabel(panel.axes[1])
            if panel.log:
                axes.set_yscale("log")
            if any(c.label for c in panel.curves):
                axes.legend(fontsize=7.0)
        FOLDER.mkdir(parents=True, exist_ok=True)
        (FOLDER / name).write_text(to_svg(figure, name), encoding="utf-8")
