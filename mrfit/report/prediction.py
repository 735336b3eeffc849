"""Predictions kept in the workspace: their figure, and what the page says of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.core.channels import symbol_of
from mrfit.core.width import Width
from mrfit.errors import DataError
from mrfit.io.arrow import codes, floats
from mrfit.io.memory import check_room
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.prediction import PredictionFile
from mrfit.io.schemas.reading import load
from mrfit.io.workspace import Workspace
from mrfit.report.curves import decimate, prefixed, sheets, shown_cycles
from mrfit.report.figures import FIGURE_WIDTH, axis_label, draw_band
from mrfit.report.key import TABLE_FORMATS, prediction_files
from mrfit.report.numbers import percent
from mrfit.report.output_unit import output_unit
from mrfit.report.paper import panels
from mrfit.report.source import OutputSeries
from mrfit.report.svg import inline, style, to_svg

# Columns of its table: where a row belongs, and what is drawn
WORDS, PREDICTION_NUMBERS = ("segment", "condition"), ("time", "measured", "simulated")
BAND_ENDS = ("high_parameters", "high")
AGAIN = "delete it and run `mrfit predict` again"


def figure_of(fit: Fit, series: Sequence[OutputSeries], errors: Mapping[str, float | None]) -> str:
    """Return time histories of a prediction, a panel a segment; without a measured output the simulated one alone."""
    canvas, axes = panels(FIGURE_WIDTH, len(series), across=3 if len(series) > 4 else 2, ratio=0.6)
    scale = output_unit(fit)
    seconds, time_unit = prefixed(max(float(s.time[shown_cycles(s)][-1]) for s in series), "s")
    for panel, one in zip(axes, series, strict=True):
        window = shown_cycles(one)
        known = bool(np.isfinite(one.measured).any())
        looks = [(one.measured, "#8a99a8", 2.4, "measured")] if known else []
        if one.lead and window.start is None:
            panel.axvspan(*(seconds * one.time[[0, one.lead - 1]]), color="#e8edf2", lw=0, label="not scored")
        for values, colour, width, label in [*looks, (one.simulated, "#c2410c", 1.0, "simulated")]:
            at = decimate(values[window], 800)
            panel.plot(
                seconds * one.time[window][at], scale.factor * values[window][at], color=colour, lw=width, label=label
            )
        draw_band(panel, one, seconds, scale.factor)
        said = percent(errors.get(one.condition)) if known else "not measured"
        panel.set_title(f"{one.condition} · {said}")
        panel.locator_params(axis="x", nbins=5)
    canvas.supxlabel(axis_label("t", time_unit, "Time"))
    canvas.supylabel(axis_label(symbol_of(fit.output), scale.unit, fit.output))
    canvas.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=4)
    return to_svg(canvas, f"Prediction of {fit.output}")


@dataclass(frozen=True)
class PredictionRow:
    """A saved prediction on the page: its content, error in words, and its first figure."""

    about: PredictionFile
    nrmse: str
    samples: int
    svg: str


def prediction_rows(workspace: Workspace, fits: Sequence[Fit]) -> list[PredictionRow]:
    """Return the saved predictions by fits, in the order of their names, the figure drawn from the series.

    Raises
    ------
    DataError
        If a file is damaged.
    """
    known, rows = {fit.name: fit for fit in fits}, []
    for number, path in enumerate(p for p in prediction_files(workspace) if p.suffix == ".json"):
        about = load(path, PredictionFile, AGAIN)
        if about is None or about.fit not in known:
            continue
        page = sheets(_read_series(path.parent, about))[0]
        with style():
            drawn = figure_of(known[about.fit], page, {m.condition: m.nrmse for m in about.metrics})
        svg = inline(drawn, f"predict{number}", f"Prediction {about.name}: {about.output} over time.")
        whole = next((m for m in about.metrics if m.condition == "all"), None)
        error = percent(whole.nrmse) if whole else "not measured"
        rows.append(PredictionRow(about, error, whole.samples if whole else 0, svg))
    return rows


def _read_series(folder: Path, about: PredictionFile) -> list[OutputSeries]:
    path = folder / about.series
    if path.parent != folder or path.suffix not in TABLE_FORMATS:
        raise DataError(f"{folder / about.name}.json: '{about.series}' is no file of this folder; {AGAIN}")
    try:
        whole = _read_table(path)
        words = [whole.column(name).unify_dictionaries().combine_chunks() for name in WORDS]
        columns = {
            name: floats(whole.column(name)) for name in (*PREDICTION_NUMBERS, *BAND_ENDS) if name in whole.column_names
        }
    except (OSError, ValueError, KeyError) as error:
        raise DataError(f"{path}: cannot be read ({str(error).splitlines()[0]}); {AGAIN}") from error
    places = np.stack([codes(w) for w in words])
    found = []
    for code in dict.fromkeys(places[0].tolist()):
        at = np.flatnonzero(places[0] == code)
        segment, condition = (str(w.dictionary[int(c[at[0]])].as_py()) for w, c in zip(words, places, strict=True))
        time, measured, simulated = (columns[name][at] for name in PREDICTION_NUMBERS)
        frequency = about.frequencies.get(segment, 0.0)
        wide = [columns[name][at] - simulated for name in BAND_ENDS if name in columns]
        width = Width(*wide) if len(wide) == len(BAND_ENDS) else None
        found.append(OutputSeries(condition, segment, "predict", time, measured, simulated, {}, frequency, width=width))
    return found


def _read_table(path: Path) -> Any:
    """Return the columns that are drawn, words as numbers; what they take is said before they are read."""
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet

    if path.suffix == ".csv":
        check_room(f"{path}: its samples", float(path.stat().st_size))
        types = {name: pa.dictionary(pa.int32(), pa.string()) for name in WORDS}
        with path.open(encoding="utf-8") as lines:
            header = lines.readline()
        drawn = [*WORDS, *PREDICTION_NUMBERS, *(name for name in BAND_ENDS if f'"{name}"' in header)]
        options = pyarrow.csv.ConvertOptions(include_columns=drawn, column_types=types)
        return pyarrow.csv.read_csv(path, convert_options=options)
    with pyarrow.parquet.ParquetFile(path, read_dictionary=list(WORDS)) as file:
        rows = file.metadata.num_rows
        drawn = [*WORDS, *PREDICTION_NUMBERS, *(name for name in BAND_ENDS if name in file.schema_arrow.names)]
        check_room(f"{path}: its {rows} samples", 8.0 * rows * len(drawn))
        return file.read(drawn)
