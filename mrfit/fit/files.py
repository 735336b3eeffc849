"""What a fit leaves in its folder: tables for people, residuals for figures, fit.json for the stages that follow."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.core.specs import Array
from mrfit.io.arrow import numbers, repeated, table
from mrfit.io.csv_table import csv_table
from mrfit.io.workspace import ROW_GROUP, write_atomic, write_json, write_text
from mrfit.search.parts import Blocks, Part
from mrfit.simulate.assembly import Assembly

PARAMETER_COLUMNS = ("condition", "parameter", "value", "unit", "low", "high", "at_bound", "identifiable")


def write_fit(
    folder: Path, fit: dict[str, Any], blocks: Blocks, simulated: Sequence[Array], assembly: Assembly
) -> None:
    """Write a fit's folder; fit.json comes last, since its key says that the rest is there.

    Parameters
    ----------
    folder
        ``fits/NAME``.
    fit
        Content of fit.json.
    blocks, simulated
        Full blocks of all segments and the simulated output of each, (N,).
    assembly
        The model.
    """
    import shutil

    rows = [
        {"condition": r["condition"], "parameter": p["name"], **p}
        for r in fit["results"]
        for p in [*r["parameters"], *r["derived"]]
    ]
    # a kill from here on must not leave the tables of one fit beside the key of another
    (folder / "fit.json").unlink(missing_ok=True)
    write_text(folder / "parameters.csv", csv_table(PARAMETER_COLUMNS, rows))
    write_text(folder / "metrics.csv", csv_table(list(fit["metrics"][0]), fit["metrics"]))
    write_atomic(folder / "residuals.parquet", lambda p: _write_residuals(p, blocks, simulated, assembly))
    write_json(folder / "fit.json", fit)
    shutil.rmtree(folder / ".partial", ignore_errors=True)


def _write_residuals(path: Path, blocks: Blocks, simulated: Sequence[Array], assembly: Assembly) -> None:
    """Write the tables of all segments, a row group as soon as there are enough rows for it."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    tables = (residual_table(p, y, assembly) for p, y in zip(blocks.parts, simulated, strict=True))
    held = [next(tables)]
    with pq.ParquetWriter(path, held[0].schema, compression="zstd") as writer:
        for one in tables:
            if sum(map(len, held)) + len(one) > ROW_GROUP:
                writer.write_table(pa.concat_tables(held), ROW_GROUP)
                held = []
            held.append(one)
        writer.write_table(pa.concat_tables(held), ROW_GROUP)


def residual_table(part: Part, simulated: Array, assembly: Assembly) -> Any:
    """Return a part's measured and simulated output and the model's inputs over time, as a pyarrow table."""
    segment, block = part.segment, part.block
    names = {"condition": segment.condition, "segment": segment.id, "role": segment.role}
    time = (part.before + np.arange(block.samples)) * part.dt
    columns = {"time": time, "measured": part.output, "simulated": simulated}
    columns |= {n: block.inputs(row) for row, n in enumerate(assembly.spec.inputs)}
    same = {name: repeated(text, block.samples) for name, text in names.items()}
    return table(same | {name: numbers(values) for name, values in columns.items()})
