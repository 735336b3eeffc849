"""A prediction kept in the workspace: every sample as Parquet or CSV, a figure, and what the page says of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.core.channels import symbol_of
from mrfit.errors import DataError
from mrfit.fit.extrapolation import Stretch
from mrfit.fit.files import residual_columns
from mrfit.fit.predict import Prediction, stretch_of
from mrfit.io.arrow import floats, numbers, repeated, table
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.prediction import PredictionFile
from mrfit.io.schemas.reading import load
from mrfit.io.workspace import Workspace, check_name, checked, write_atomic, write_json
from mrfit.report.curves import decimate, prefixed, sheets, shown_cycles
from mrfit.report.figures import WIDTH, axis_label
from mrfit.report.numbers import percent
from mrfit.report.output_unit import output_unit
from mrfit.report.paper import panels
from mrfit.report.source import Series, read_source, with_integrals
from mrfit.report.svg import inline, style, to_svg
from mrfit.simulate.assembly import Assembly

FORMATS = (".parquet", ".csv")
AGAIN = "delete it and run `mrfit predict` again"


def trained_on(workspace: Workspace, fit: Fit) -> list[Stretch]:
    """Return the training tests of a fit of a workspace, for the ranges of their channels.

    Raises
    ------
    DataError
        If a file is damaged.
    """
    source = read_source(workspace, (fit.name,))
    segments = {s.id: s for s in source.segments}
    return [
        stretch_of(
            segments[s.segment],
            float(s.time[1] - s.time[0]),
            {name: values for name, values in s.inputs.items() if name in fit.inputs},
        )
        for s in source.series[fit.name]
        if s.role == "train" and len(s.time) > 1 and s.segment in segments
    ]


def series_of(found: Prediction, assembly: Assembly) -> list[Series]:
    """Return every segment's output, measured and simulated; the measured one is nan where there was none."""
    parts: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    frequencies: dict[str, float] = {}
    for part, output in zip(found.blocks.parts, found.simulated, strict=True):
        key = part.segment.condition, part.segment.id, part.segment.role
        parts.setdefault(key, []).append(residual_columns(part, output, assembly))
        frequencies[part.segment.id] = part.segment.frequency
    made = []
    for key, pieces in parts.items():
        columns = {name: np.concatenate([p[name] for p in pieces]) for name in pieces[0]}
        time, measured, simulated = (columns.pop(name) for name in ("time", "measured", "simulated"))
        if key[1] in found.unmeasured:
            measured = np.full_like(measured, np.nan)
        frequency = frequencies[key[1]]
        made.append(Series(*key, time, measured, simulated, with_integrals(columns, time, frequency), frequency))
    return made


@dataclass(frozen=True)
class Kept:
    """What goes into a saved prediction beside its samples."""

    fit: Fit
    logs: Sequence[str]
    findings: Sequence[str]


def save(workspace: Workspace, name: str, kept: Kept, found: Prediction, assembly: Assembly) -> list[str]:
    """Write ``predict/NAME.parquet`` or ``.csv``, as the name ends, with a figure and a summary; return the files.

    Raises
    ------
    ConfigError
        If it is no name of a file.
    DataError
        If the folder cannot be written.
    """
    ending = next((e for e in FORMATS if name.endswith(e)), "")
    stem = name.removesuffix(ending)
    check_name(stem)
    folder, series = workspace.root / "predict", series_of(found, assembly)
    data = folder / f"{stem}{ending or '.parquet'}"
    write_atomic(data, lambda path: _write_series(path, data.suffix, series))
    with style():
        pages = sheets(sorted(series, key=lambda s: s.segment))
        errors = {m.condition: m.nrmse for m in found.metrics}
        figures = [_figure(kept.fit, page, errors) for page in pages]
    files = [data]
    for number, svg in enumerate(figures, start=1):
        path = folder / (f"{stem}.svg" if len(figures) == 1 else f"{stem}-{number}.svg")
        write_atomic(path, lambda p, text=svg: p.write_bytes(text.encode()))  # type: ignore[misc]
        files.append(path)
    about = PredictionFile(
        name=stem,
        fit=kept.fit.name,
        model=kept.fit.model,
        output=kept.fit.output,
        logs=list(kept.logs),
        series=data.name,
        frequencies={s.segment: s.frequency for s in series},
        simulated_only=sorted(found.unmeasured),
        metrics=found.metrics,
        warnings=found.warnings,
        findings=list(kept.findings),
    )
    write_json(folder / f"{stem}.json", checked(about))
    return [str(path) for path in files]


def _write_series(path: Path, suffix: str, series: Sequence[Series]) -> None:
    import pyarrow as pa

    made = []
    for one in series:
        words = {"condition": one.condition, "segment": one.segment}
        columns = {"time": one.time, "measured": one.measured, "simulated": one.simulated, **one.inputs}
        same = {name: repeated(text, len(one.time)) for name, text in words.items()}
        made.append(table(same | {name: numbers(values) for name, values in columns.items()}))
    whole = pa.concat_tables(made, promote_options="default")
    if suffix == ".csv":
        import pyarrow.csv

        pyarrow.csv.write_csv(whole, path)
    else:
        import pyarrow.parquet

        pyarrow.parquet.write_table(whole, path, compression="zstd")


def _figure(fit: Fit, series: Sequence[Series], errors: Mapping[str, float | None]) -> str:
    """Return time histories of a prediction, a panel a segment; without a measured output the simulated one alone."""
    canvas, axes = panels(WIDTH, len(series), across=3 if len(series) > 4 else 2, ratio=0.6)
    scale = output_unit(fit)
    seconds, time_unit = prefixed(max(float(s.time[shown_cycles(s)][-1]) for s in series), "s")
    for panel, one in zip(axes, series, strict=True):
        window = shown_cycles(one)
        known = bool(np.isfinite(one.measured).any())
        looks = [(one.measured, "#8a99a8", 2.4, "measured")] if known else []
        for values, colour, width, label in [*looks, (one.simulated, "#c2410c", 1.0, "simulated")]:
            at = decimate(values[window], 800)
            panel.plot(
                seconds * one.time[window][at], scale.factor * values[window][at], color=colour, lw=width, label=label
            )
        said = percent(errors.get(one.condition)) if known else "not measured"
        panel.set_title(f"{one.condition} · {said}")
        panel.locator_params(axis="x", nbins=5)
    canvas.supxlabel(axis_label("t", time_unit, "Time"))
    canvas.supylabel(axis_label(symbol_of(fit.output), scale.unit, fit.output))
    canvas.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return to_svg(canvas, f"Prediction of {fit.output}")


@dataclass(frozen=True)
class PredictionRow:
    """A saved prediction on the page: its content, error in words, and its first figure."""

    about: PredictionFile
    nrmse: str
    samples: int
    svg: str


def files_of(workspace: Workspace) -> list[Path]:
    """Return the summaries and series of saved predictions."""
    folder = workspace.root / "predict"
    return [p for p in sorted(folder.glob("*")) if p.suffix in (".json", *FORMATS) and not p.name.startswith(".")]


def prediction_rows(workspace: Workspace, fits: Sequence[Fit]) -> list[PredictionRow]:
    """Return the saved predictions by fits, in the order of their names, the figure drawn from the series.

    Raises
    ------
    DataError
        If a file is damaged.
    """
    known, rows = {fit.name: fit for fit in fits}, []
    for number, path in enumerate(p for p in files_of(workspace) if p.suffix == ".json"):
        about = load(path, PredictionFile, AGAIN)
        if about is None or about.fit not in known:
            continue
        page = sheets(_read_series(path.parent, about))[0]
        with style():
            drawn = _figure(known[about.fit], page, {m.condition: m.nrmse for m in about.metrics})
        svg = inline(drawn, f"predict{number}", f"Prediction {about.name}: {about.output} over time.")
        whole = next((m for m in about.metrics if m.condition == "all"), None)
        error = percent(whole.nrmse) if whole else "not measured"
        rows.append(PredictionRow(about, error, whole.samples if whole else 0, svg))
    return rows


def _read_series(folder: Path, about: PredictionFile) -> list[Series]:
    import pyarrow.csv
    import pyarrow.parquet

    path = folder / about.series
    if path.parent != folder or path.suffix not in FORMATS:
        raise DataError(f"{folder / about.name}.json: '{about.series}' is no file of this folder; {AGAIN}")
    try:
        whole = pyarrow.csv.read_csv(path) if path.suffix == ".csv" else pyarrow.parquet.read_table(path)
        segments = np.array(whole.column("segment").to_pylist())
        conditions = whole.column("condition").to_pylist()
        columns = {name: floats(whole.column(name)) for name in ("time", "measured", "simulated")}
    except (OSError, ValueError, KeyError) as error:
        raise DataError(f"{path}: cannot be read ({str(error).splitlines()[0]}); {AGAIN}") from error
    found = []
    for segment in dict.fromkeys(segments.tolist()):
        at = np.flatnonzero(segments == segment)
        own = {name: values[at] for name, values in columns.items()}
        frequency = about.frequencies.get(segment, 0.0)
        time, measured, simulated = (own[name] for name in ("time", "measured", "simulated"))
        found.append(Series(str(conditions[at[0]]), segment, "predict", time, measured, simulated, {}, frequency))
    return found
