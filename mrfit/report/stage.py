"""The report stage: finished fits in, tables, figures and one page out."""

import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from mrfit.core.progress import Progress, silent
from mrfit.errors import DataError
from mrfit.io.escapes import visible_in_page
from mrfit.io.keys import code_version
from mrfit.io.outdated import Inputs
from mrfit.io.schemas.reading import reusable
from mrfit.io.schemas.stages import ReportFile
from mrfit.io.workspace import TEMPORARY, Workspace, write_json, write_text
from mrfit.report import figures, page, short, tables
from mrfit.report.key import report_key
from mrfit.report.page_figures import brief_drawings, more_drawings
from mrfit.report.prediction import PredictionRow, prediction_rows
from mrfit.report.ranking import BEST, best, ranked
from mrfit.report.source import ReportSource, fit_names, read_fits, read_source
from mrfit.settings.report import Settings as Settings

EARLIER_TABLES = ("parameters.tex", "metrics.tex")
"""Files that reports had before each fit had a file of its own."""


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> ReportFile:
    """Write ``report/``: index.html, parameters, metrics and comparison as CSV, tables as LaTeX, figures as SVG.

    All is made before the first file is touched, then put in place file by file by renaming; ``report.json``, which
    holds the key of what the report was made of, is taken away first and comes back last. A kill in between leaves
    whole files and a report that the same command makes again.

    Parameters
    ----------
    workspace
        Holds the fits.
    settings
        Which to report.
    progress
        Reports every figure drawn.

    Returns
    -------
    ReportFile
        Content of report.json, the page's path, and whether nothing had changed since the last report.

    Raises
    ------
    DataError
        If there is no fit, one is damaged, or the folder cannot be written.
    """
    names = fit_names(workspace, settings.fits)
    if settings.short:
        return _run_short(workspace, names)
    outdated = Inputs(workspace).of_fits(read_fits(workspace, names))
    key = report_key(workspace, names, outdated)
    folder = workspace.report_folder
    index = str(folder / "index.html")
    existing = reusable(folder / "report.json", ReportFile)
    if existing and existing.key == key and all((folder / f).is_file() for f in existing.files):
        return replace(existing, index=index, skipped=True, reasons=outdated)
    source = read_source(workspace, tuple(names))
    source = replace(source, fits=[r.fit for r in ranked(source.fits)])
    in_full = names if len(names) <= BEST else best(source.fits, BEST)
    files = _render(source, in_full, settings.jobs, progress, prediction_rows(workspace, source.fits))
    summary = ReportFile(
        key=key,
        code=code_version(),
        fits=names,
        outdated=list(source.outdated),
        conditions=len({m.condition for f in source.fits for m in f.metrics if m.condition != "all"}),
        files=sorted(files),
        index=index,
        reasons=outdated,
    )
    publish(folder, files, summary)
    return summary


def _run_short(workspace: Workspace, names: Sequence[str]) -> ReportFile:
    """Write ``report/short.html`` and nothing else: the whole report stays as it is."""
    source = read_source(workspace, tuple(names))
    path = workspace.report_folder / "short.html"
    write_text(path, short.render(source))
    return ReportFile(
        key="",
        fits=list(names),
        outdated=list(source.outdated),
        conditions=0,
        files=[path.name],
        index=str(path),
        reasons=dict(source.outdated),
    )


def _render(
    source: ReportSource,
    in_full: Collection[str],
    jobs: int,
    progress: Progress,
    predictions: Sequence[PredictionRow] = (),
) -> dict[str, str]:
    """Return the text of every file by its path in the report's folder; fits that are ``in_full`` have all figures."""
    drawings = {
        fit.name: [
            *figures.drawings_of(fit, source.series[fit.name]),
            *more_drawings(fit, source.series[fit.name], source.segments),
        ]
        if fit.name in in_full
        else brief_drawings(fit, source.segments)
        for fit in source.fits
    }
    made = iter(figures.draw_all([d for group in drawings.values() for d in group], jobs, progress))
    drawn = {name: [next(made) for _ in group] for name, group in drawings.items()}
    files = {
        "parameters.csv": tables.parameters_csv(source.fits),
        "metrics.csv": tables.metrics_csv(source.fits),
        "comparison.csv": tables.comparison_csv(source.fits),
        "comparison.tex": tables.comparison_tex(source.fits),
        "index.html": page.render(source, drawn, predictions, in_full),
    }
    files |= {f"tables/{fit.name}.tex": tables.fit_tex(fit) for fit in source.fits}
    return files | {f"figures/{f.name}.svg": f.svg for group in drawn.values() for f in group}


def publish(folder: Path, files: Mapping[str, str], summary: ReportFile) -> None:
    """Put files in place together: all under temporary names, then renamed, then those of an older report removed.

    Parameters
    ----------
    folder
        The report's folder. ``figures/`` and ``tables/`` in it hold the report's and nothing else afterwards.
    files
        Text by path in the folder.
    summary
        Content of report.json.

    Raises
    ------
    DataError
        If the folder cannot be written; an older report is then as it was, or is made again by the next run.
    """
    pending: list[tuple[Path, Path]] = []
    try:
        for name, text in files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
            pending.append((temporary, path))
            temporary.unlink(missing_ok=True)  # a link of this name would be followed
            with temporary.open("xb") as handle:
                shown = visible_in_page(text) if path.suffix == ".html" else text
                handle.write(shown.encode(errors="backslashreplace"))
                handle.flush()
                os.fsync(handle.fileno())
        (folder / "report.json").unlink(missing_ok=True)
        for temporary, path in pending:
            temporary.replace(path)
        left = {p for p in folder.glob(".*.tmp") if TEMPORARY.fullmatch(p.name)}
        earlier = {folder / name for name in EARLIER_TABLES if (folder / name).is_file()}
        for path in {*folder.glob("figures/*"), *folder.glob("tables/*"), *earlier, *left} - {
            folder / name for name in files
        }:
            path.unlink()
    except OSError as error:
        raise DataError(f"{folder}: cannot write ({error.strerror or error}); choose another --work folder") from error
    finally:
        for temporary, _ in pending:
            temporary.unlink(missing_ok=True)
    write_json(folder / "report.json", summary)
