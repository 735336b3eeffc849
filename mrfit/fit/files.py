"""What a fit leaves in its folder: tables for people, residuals for figures, fit.json for the stages that follow."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.io.arrow import numbers, repeated, table
from mrfit.io.atomic import write_atomic
from mrfit.io.csv_table import csv_table
from mrfit.io.outdated import check_law
from mrfit.io.schemas.fit import PARAMETER_COLUMNS, Fit
from mrfit.io.schemas.reading import load
from mrfit.io.tables import ROW_GROUP
from mrfit.io.workspace import write_json, write_text
from mrfit.search.parts import Blocks, SegmentPart
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.current_levels import as_written, exact_parameters

# Folder of finished searches, in that of their fit
PARTIAL = ".partial"


# What a reader of a damaged fit.json is to do
FIT_AGAIN = "delete it and run `mrfit fit` again"
AnyFit = TypeVar("AnyFit", bound=Fit)


@dataclass(frozen=True)
class FitOutput:
    """Result of a fit.

    Attributes
    ----------
    content
        Content of fit.json.
    blocks, simulated
        Full blocks of all segments and the simulated output of each, (N,).
    assembly
        The model.
    """

    content: Fit
    blocks: Blocks
    simulated: Sequence[Array]
    assembly: Assembly


def read_fit_json(path: Path, kind: type[AnyFit]) -> AnyFit | None:
    """Return the content of a fit.json of a kind with the defaults of missing keys, None if it is not there.

    Raises
    ------
    DataError
        If it is damaged, of an unknown schema, or lacks a parameter of its model.
    """
    fit = load(path, kind, FIT_AGAIN)
    if fit is not None:
        names = set(as_written(fit).spec.names)
        if not fit.results or any(names - {p.name for p in r.parameters} for r in fit.results):
            check_law(fit)
            raise DataError(f"{path}: damaged, or another mrfit's: not all parameters are in it; {FIT_AGAIN}")
    return fit


def write_fit(folder: Path, fitted: FitOutput) -> None:
    """Write a fit's folder, ``fits/NAME``; fit.json comes last, since its key says that the rest is there."""
    fit = fitted.content
    # a kill from here on must not leave the tables of one fit beside the key of another
    (folder / "fit.json").unlink(missing_ok=True)
    rows = ({"condition": condition, "parameter": p.name, **vars(p)} for condition, p in exact_parameters(fit))
    write_text(folder / "parameters.csv", csv_table(PARAMETER_COLUMNS, rows))
    write_text(folder / "metrics.csv", csv_table(fit.metrics[0].written(), map(asdict, fit.metrics)))
    write_atomic(folder / "residuals.parquet", lambda p: _write_residuals(p, fitted))
    write_json(folder / "fit.json", fit)
    drop_partial(folder)


def drop_partial(folder: Path) -> None:
    """Remove the finished searches that a fit kept in case it was killed."""
    import shutil

    shutil.rmtree(folder / PARTIAL, ignore_errors=True)


def _write_residuals(path: Path, fitted: FitOutput) -> None:
    """Write the tables of all segments, a row group as soon as there are enough rows for it."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    pairs = zip(fitted.blocks.parts, fitted.simulated, strict=True)
    tables = (residual_table(p, y, fitted.assembly) for p, y in pairs)
    held = [next(tables)]
    with pq.ParquetWriter(path, held[0].schema, compression="zstd") as writer:
        for one in tables:
            if sum(map(len, held)) + len(one) > ROW_GROUP:
                writer.write_table(pa.concat_tables(held), ROW_GROUP)
                held = []
            held.append(one)
        writer.write_table(pa.concat_tables(held), ROW_GROUP)


def residual_table(part: SegmentPart, simulated: Array, assembly: Assembly) -> Any:
    """Return a part's measured and simulated output and the model's inputs over time, as a pyarrow table."""
    segment = part.segment
    names = {"condition": segment.condition, "segment": segment.id, "role": segment.role}
    same = {name: repeated(text, segment.samples) for name, text in names.items()}
    columns = residual_columns(part, simulated, assembly)
    return table(same | {name: numbers(values) for name, values in columns.items()})


def residual_columns(part: SegmentPart, simulated: Array, assembly: Assembly) -> dict[str, Array]:
    """Return time, measured and simulated output and the model's inputs of a part, each (N,)."""
    block = part.block
    time = (part.before + np.arange(len(block.target), dtype=np.float64)) * part.dt
    columns = {"time": time, "measured": part.output, "simulated": simulated}
    return columns | {n: block.inputs(row) for row, n in enumerate(assembly.spec.inputs)}
