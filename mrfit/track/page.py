"""Page of parameters that follow logs: estimates with bands beside block-wise refits, and innovations."""

from collections.abc import Mapping

import numpy as np

from mrfit.apply.figures import MEASURED, PALETTE, Curve, Panel, figure
from mrfit.core.channels import unit_of
from mrfit.io.schemas.track import TracksFile
from mrfit.report.numbers import unit_html
from mrfit.report.sections import Section, SectionFigure, Table, render
from mrfit.signal.runs import runs
from mrfit.track.run import BlockRefits, ParameterTrack

_BAND = 1.96
HEADS = (
    *("parameter", "unit", "fit", "± 1 sd", "least", "greatest", "at the end", "± 1 sd of it"),
    *("last block alone", "± 1 sd of the block"),
)


def rows_of(content: TracksFile) -> list[list[object]]:
    """Return the rows of the table of all logs: the log, then ``HEADS``."""
    return [
        [
            *(log.recording, p.name, "factor" if p.factor else unit_html(p.unit)),
            *(p.fit, p.fit_deviation, p.least, p.greatest),
            *(p.end, p.end_deviation, p.block, p.block_deviation),
        ]
        for log in content.logs
        for p in log.parameters
    ]


def page_of(
    content: TracksFile, tracks: Mapping[str, ParameterTrack], blocks: Mapping[str, BlockRefits], file: str
) -> str:
    """Return the page; ``file`` is the name of the JSON file."""
    unit = unit_of(content.output)
    residual = f"{content.noise:.3g} {unit} over all its tests, correlated over {content.correlated:.3g} s"
    facts = [("Fit", f"{content.fit}: {content.model}"), ("Residual of the fit", residual)]
    table = Table("Parameters along the logs", ("log", *HEADS), rows_of(content), digits=4)
    factors = any(p.factor for log in content.logs for p in log.parameters)
    words = [
        "Bands are 95 %, pointwise. Blocks are refitted each by itself, linear in the parameters about the fit.",
        "Estimates stay where the damper stands.",
        *(["A factor multiplies the values of the parameter over the current."] if factors else []),
    ]
    sections = [Section("Parameters", words, [table])]
    for k, (log, track) in enumerate(tracks.items()):
        about = content.logs[k]
        told = (
            f"The damper moves in {100 * about.moved:.3g} % of the time; the parameters are taken to move in "
            f"{100 * about.moving:.3g} %. Innovations: {about.innovation:.3g} {unit} rms."
        )
        drawn = SectionFigure(
            "Parameters over time.",
            "Dotted: refits of blocks, which may tell little: the table has the standard deviation of the last."
            + (" Red: the parameters are taken to move." if (track.chosen > 0).any() else ""),
            _figure(track, blocks[log], f"p{k}", unit, log),
        )
        sections.append(Section(log, (told,), (), [drawn]))
    lead = "Parameters of a fit as they follow the measured output, by the estimator of the exported C."
    return render(f"Parameters tracked with {content.fit}", lead, facts, sections, file)


def _figure(track: ParameterTrack, blocks: BlockRefits, prefix: str, unit_of_output: str, log: str) -> str:
    moving = runs(track.chosen > 0)
    marks = [(float(track.time[a]), float(track.time[min(b, len(track.time) - 1)])) for a, b in moving]
    panels = list[Panel]()
    for k, p in enumerate(track.plan.parameters):
        value, half = track.values[:, k], _BAND * track.deviations[:, k]
        known = np.isfinite(blocks.values[:, k])
        curves = [
            Curve(track.time, value, "tracked", PALETTE[0]),
            Curve(blocks.time[known], blocks.values[known, k], "blocks", MEASURED, ":"),
        ]
        unit = "factor" if p.factor else p.unit
        band = (track.time, value - half, value + half, "95 % band")
        panels.append(Panel(p.name, "t (s)", f"{p.name} ({unit})", curves, band, marks))
    innovations = [Curve(track.time, track.innovations, "", MEASURED)]
    panels.append(Panel("Innovation", "t (s)", f"measured − model ({unit_of_output})", innovations))
    return figure(panels, prefix, f"Tracked parameters along {log}")
