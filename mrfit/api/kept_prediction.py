"""A prediction kept in the workspace: every sample as Parquet or CSV, a figure, and a summary for the page."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mrfit.api.drawing import predicted_series
from mrfit.errors import ConfigError
from mrfit.fit.extrapolation import together
from mrfit.fit.predict import SegmentPrediction, stretch_of
from mrfit.io.arrow import numbers, repeated, table
from mrfit.io.atomic import write_atomic
from mrfit.io.replaced import about_to_replace
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.prediction import PredictionFile
from mrfit.io.workspace import Workspace, check_name, checked, write_json
from mrfit.report.curves import sheets
from mrfit.report.key import TABLE_FORMATS
from mrfit.report.prediction import figure_of
from mrfit.report.source import OutputSeries, read_source
from mrfit.report.svg import style
from mrfit.simulate.assembly import Assembly

# Endings of files that a prediction is not written as
OTHER_FORMATS = {*TABLE_FORMATS, ".feather", ".h5", ".json", ".mat", ".png", ".svg", ".tsv", ".txt", ".xls", ".xlsx"}


def trained_on(workspace: Workspace, fit: Fit) -> dict[str, tuple[float, float]]:
    """Return least and greatest value of every channel in the training tests of a fit of a workspace.

    Raises
    ------
    DataError
        If a file is damaged.
    """
    source = read_source(workspace, (fit.name,))
    segments = {s.id: s for s in source.segments}
    return together(
        stretch_of(
            segments[s.segment],
            float(s.time[1] - s.time[0]),
            {name: values for name, values in s.inputs.items() if name in fit.inputs},
        ).extents()
        for s in source.series[fit.name]
        if s.role == "train" and len(s.time) > 1 and s.segment in segments
    )


@dataclass(frozen=True)
class PredictionRecord:
    """Content of a saved prediction beside its samples."""

    fit: Fit
    logs: Sequence[str]
    findings: Sequence[str]


def save(
    workspace: Workspace, name: str, kept: PredictionRecord, found: SegmentPrediction, assembly: Assembly
) -> list[str]:
    """Write ``predict/NAME.parquet`` or ``.csv``, as the name ends, with a figure and a summary; return the files.

    Raises
    ------
    ConfigError
        If it is no name of a file, or ends as a file of another format does.
    DataError
        If the folder cannot be written.
    """
    ending = next((e for e in TABLE_FORMATS if name.endswith(e)), "")
    stem = name.removesuffix(ending)
    check_name(stem, "--save")
    if Path(stem).suffix.lower() in OTHER_FORMATS:
        raise ConfigError(f"--save '{name}': a prediction is written as {' or '.join(TABLE_FORMATS)}; end its name so")
    folder, series = workspace.root / "predict", predicted_series(kept.fit, found, assembly)
    data = folder / f"{stem}{ending or '.parquet'}"
    write_atomic(data, lambda path: _write_series(path, data.suffix, series))
    with style():
        pages = sheets(sorted(series, key=lambda s: s.segment))
        errors = {m.condition: m.nrmse for m in found.metrics}
        figures = [figure_of(kept.fit, page, errors) for page in pages]
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
    # the summary tells of one table; the table of an earlier prediction of this name is removed
    for old in (folder / f"{stem}{e}" for e in TABLE_FORMATS if e != data.suffix):
        about_to_replace(old, data)
        old.unlink(missing_ok=True)
    return [str(path) for path in files]


def _write_series(path: Path, suffix: str, series: Sequence[OutputSeries]) -> None:
    import pyarrow as pa

    made = []
    for one in series:
        words = {"condition": one.condition, "segment": one.segment}
        columns = {"time": one.time, "measured": one.measured, "simulated": one.simulated, **one.inputs, **one.bands}
        same = {name: repeated(text, len(one.time)) for name, text in words.items()}
        scored = {"scored": pa.array(one.scored)}
        made.append(table(same | {name: numbers(values) for name, values in columns.items()} | scored))
    whole = pa.concat_tables(made, promote_options="default")
    if suffix == ".csv":
        import pyarrow.csv

        pyarrow.csv.write_csv(whole, path)
    else:
        import pyarrow.parquet

        pyarrow.parquet.write_table(whole, path, compression="zstd")
