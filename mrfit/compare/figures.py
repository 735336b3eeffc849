"""Figures of comparisons: each model's error on every condition, and how optimizers converge."""

from collections.abc import Mapping, Sequence

import numpy as np

from mrfit.io.schemas.compare import Curve, ModelErrors
from mrfit.report.figures import FIGURE_WIDTH, PALETTE, QUIET, canvas_of, panels_of, plain_log
from mrfit.report.svg import style, to_svg

LINES = ("-", "--", "-.", ":")
PANELS_ACROSS = 2


def error_map(fits: Sequence[str], metrics: Sequence[ModelErrors], called: Mapping[str, str]) -> str:
    """Return an SVG of NRMSE in percent, one row per fit and one column per condition, held-out columns first."""
    columns = list(dict.fromkeys((m.role, m.condition) for m in metrics))
    values = np.full((len(fits), len(columns)), np.nan)
    for m in metrics:
        if m.nrmse is not None:
            values[fits.index(m.fit), columns.index((m.role, m.condition))] = 100 * m.nrmse
    with style():
        figure = canvas_of(FIGURE_WIDTH, 1.6 + 0.3 * len(fits))
        axes = figure.add_subplot()
        axes.grid(False)
        ceiling = float(np.nanquantile(values, 0.9)) if np.isfinite(values).any() else 1.0
        axes.imshow(values, cmap="YlOrBr", vmin=0.0, vmax=max(ceiling, 1e-9), aspect="auto")
        axes.set_xticks(range(len(columns)), [f"{c} ({r})" for r, c in columns], rotation=40, ha="right")
        axes.set_yticks(range(len(fits)), [called[f] for f in fits])
        for row, column in np.argwhere(np.isfinite(values)):
            dark = values[row, column] > 0.6 * ceiling
            shown = f"{values[row, column]:.3g}"
            axes.text(column, row, shown, ha="center", va="center", fontsize=7, color="#fffffe" if dark else "#111111")
        return to_svg(figure, "NRMSE in percent, models by conditions")


def convergence(curves: Sequence[Curve], unit: str) -> str:
    """Return an SVG of the median best cost against evaluations, one panel per condition, one line per optimizer."""
    conditions = list(dict.fromkeys(c.condition for c in curves))
    with style():
        figure, panels = panels_of(len(conditions), min(PANELS_ACROSS, len(conditions)), 3.0, 0.6)
        for axes, condition in zip(panels, conditions, strict=True):
            own = [c for c in curves if c.condition == condition and c.cost]
            for k, curve in enumerate(own):
                colour, dash = PALETTE[k % len(PALETTE)], LINES[k // len(PALETTE) % len(LINES)]
                axes.plot(curve.evaluations, curve.cost, label=curve.optimizer, color=colour, linestyle=dash)
            axes.set(title=condition, xscale="log", yscale="log", xlabel="Evaluations", ylabel=f"RMS error ({unit})")
            plain_log(axes)
            if own:
                axes.legend(labelcolor="#334155", facecolor="#ffffff", edgecolor=QUIET)
        return to_svg(figure, "Convergence of optimizers")
