"""Figures for print of the fits of a workspace, written as PDF, SVG or PNG at a width."""

import fnmatch
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from mrfit.core.counting import few
from mrfit.core.recording import Segment
from mrfit.errors import ConfigError, DataError, near
from mrfit.io.atomic import write_atomic
from mrfit.io.workspace import Workspace
from mrfit.report import paper
from mrfit.report.curves import worst_of_each
from mrfit.report.loop_figure import loops, panels_of
from mrfit.report.paper import FitSeries
from mrfit.report.parameter_figure import parameters, quantity_of
from mrfit.report.profile_figure import profiles
from mrfit.report.source import OutputSeries, ReportSource, read_source
from mrfit.report.svg import Canvas, style, to_svg
from mrfit.settings.figure import FIGURE_KINDS, Settings

INCHES = {"mm": 1.0 / 25.4, "cm": 1.0 / 2.54, "in": 1.0, "pt": 1.0 / 72.0}
FIGURE_FORMATS = ("pdf", "svg", "png")
CORRELATED = 2
"""Conditions in a figure of the residual's correlation where none is named."""


def width_of(text: str) -> float:
    """Return a width such as ``84mm``, ``8.4cm``, ``3.3in`` or ``239pt`` in inches.

    Raises
    ------
    ConfigError
        If it is none, or not between 40 and 500 mm.
    """
    match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*(mm|cm|in|pt)\s*", text)
    width = float(match[1]) * INCHES[match[2]] if match else 0.0
    if not 40.0 <= width * 25.4 <= 500.0:
        raise ConfigError(f"--width takes 40mm to 500mm, as 84mm, 17.4cm, 3.3in or 239pt, not '{text}'")
    return width


@dataclass(frozen=True)
class WrittenFigure:
    """A figure: its files and fits, how many conditions, which of them it leaves out, why fits are out of date."""

    kind: str
    files: list[str]
    fits: list[str]
    conditions: int
    left_out: list[str] = field(default_factory=list)
    outdated: dict[str, str] = field(default_factory=dict)


def check(kind: str, settings: Settings) -> float:
    """Return the width of a figure in inches.

    Raises
    ------
    ConfigError
        If there is no such kind, width or format.
    """
    if kind not in FIGURE_KINDS:
        raise ConfigError(f"there is no figure '{kind}'; choose {', '.join(FIGURE_KINDS)}{near(kind, FIGURE_KINDS)}")
    wrong = [f for f in settings.formats if f not in FIGURE_FORMATS]
    if wrong or not settings.formats:
        raise ConfigError(f"--format takes {', '.join(FIGURE_FORMATS)}, not '{', '.join(wrong)}'")
    return width_of(settings.width)


def run(workspace: Workspace, kind: str, settings: Settings, out: Path | None = None) -> WrittenFigure:
    """Draw one figure of the fits of a workspace and write it in every format asked for.

    Parameters
    ----------
    workspace
        Holds the fits.
    kind
        One of ``FIGURE_KINDS``.
    settings
        Which fits and conditions, over what, how wide.
    out
        Folder; default: ``report/paper`` in the workspace.

    Raises
    ------
    ConfigError
        If there is no such kind, width or format.
    DataError
        If there is nothing to draw.
    """
    width = check(kind, settings)
    source = read_source(workspace, settings.fits)
    drawn = [FitSeries(f, _chosen(worst_of_each(source.series[f.name]), settings.conditions)) for f in source.fits]
    everything = list(dict.fromkeys(s.condition for d in drawn for s in d.series))
    if not settings.conditions:
        drawn = [FitSeries(d.fit, with_room(d, kind, settings.overlay, len(drawn))) for d in drawn]
    if kind in ("loops", "predicted", "correlation"):
        drawn = [d for d in drawn if d.series]
        _check_one_output(drawn, source, settings)
    with style():
        import matplotlib

        matplotlib.rcParams.update(cast(Any, paper.PRINT))
        canvas = _canvas(kind, drawn, settings, width, source.segments)
        names = "+".join(d.fit.name for d in drawn)
        stem = f"{names if len(names) <= 120 else f'{len(drawn)}-fits'}.{kind}"
        folder = out or workspace.report_folder / "paper"
        files = [_write(canvas, folder / f"{stem}.{form}", form) for form in settings.formats]
    shown = {s.condition for d in drawn for s in d.series}
    left_out = [c for c in everything if c not in shown] if kind in ("loops", "correlation") else []
    outdated = {d.fit.name: why for d in drawn if (why := source.outdated.get(d.fit.name))}
    fits = [d.fit.name for d in drawn]
    return WrittenFigure(kind, [str(f) for f in files], fits, len(shown), left_out, outdated)


def _chosen(series: Sequence[OutputSeries], patterns: Sequence[str]) -> list[OutputSeries]:
    return [s for s in series if not patterns or any(fnmatch.fnmatchcase(s.condition, p) for p in patterns)]


def with_room(drawn: FitSeries, kind: str, overlay: str, fits: int) -> Sequence[OutputSeries]:
    """Return the series drawn where no conditions were named: all that have room, else some of every error."""
    if kind not in ("loops", "correlation"):
        return drawn.series
    if kind == "loops" and overlay == "conditions" and len(panels_of([drawn], overlay)) * fits <= paper.MOST_PANELS:
        return drawn.series
    most = CORRELATED if kind == "correlation" else paper.MOST_PANELS // (1 if overlay == "fits" else fits) or 1
    if len(drawn.series) <= most:
        return drawn.series
    order = sorted(drawn.series, key=lambda s: s.error)
    kept = {id(order[round(k * (len(order) - 1) / max(most - 1, 1))]) for k in range(most)}
    return [s for s in drawn.series if id(s) in kept]


def _check_one_output(drawn: Sequence[FitSeries], source: ReportSource, settings: Settings) -> None:
    if not drawn:
        there = list(dict.fromkeys(s.condition for f in source.fits for s in source.series[f.name]))
        wanted = ", ".join(settings.conditions)
        raise DataError(f"no condition is like {wanted}; give --condition one of {few(there)}")
    outputs = sorted({d.fit.output for d in drawn})
    if len(outputs) > 1:
        raise ConfigError(f"a figure shows one output, these fits predict {' and '.join(outputs)}; choose with --fit")


def _canvas(
    kind: str, drawn: Sequence[FitSeries], settings: Settings, width: float, segments: Sequence[Segment]
) -> "Canvas":
    fits = [d.fit for d in drawn]
    if kind == "loops":
        return loops(drawn, width, settings.overlay, settings.over)
    if kind == "predicted":
        return paper.predicted(drawn, width)
    if kind == "starts":
        return paper.starts(fits, width)
    if kind == "profiles":
        return profiles(fits, width)
    if kind == "parameters":
        over = settings.over or next(filter(None, (quantity_of(f, segments) for f in fits)), "current")
        if over not in ("current", "temperature", "frequency", "amplitude"):
            raise ConfigError(f"--over takes current, temperature, frequency or amplitude for parameters, not '{over}'")
        return parameters(fits, segments, over, width)
    if len(drawn) > 1:
        raise ConfigError(f"a figure of {kind} shows one fit; choose with --fit")
    return paper.correlation(drawn[0], width)


def _write(canvas: "Canvas", path: Path, form: str) -> Path:
    if form == "svg":
        write_atomic(path, lambda p: p.write_bytes(to_svg(canvas, path.stem).encode()))
        return path
    content = io.BytesIO()
    about = {"Creator": "mrfit", "Producer": None, "CreationDate": None} if form == "pdf" else {"Software": "mrfit"}
    canvas.savefig(content, format=form, dpi=300, metadata=about)
    write_atomic(path, lambda p: p.write_bytes(content.getvalue()))
    return path
