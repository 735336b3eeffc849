"""The table of all logs of a batch: a row for every parameter of every condition of every log."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrfit.io.arrow import numbers, texts
from mrfit.io.atomic import write_atomic
from mrfit.io.schemas.batch import LogRow
from mrfit.io.tables import ROW_GROUP


def write(path: Path, rows: Sequence[LogRow]) -> None:
    """Write the table as Parquet; a log that failed has one row, without condition, whose ``warnings`` are its line.

    Columns: ``log``, ``condition``, ``parameter``, ``unit``, ``value``, ``low``, ``high`` (95 % interval, nan where it
    is open), ``nrmse`` and ``nrmse_holdout`` of the condition, ``warnings`` by commas.

    Raises
    ------
    DataError
        If it cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    lines: list[tuple[str, str, str, str, str]] = []
    values: list[tuple[float, ...]] = []
    for row in rows:
        for test in row.tests:
            for p in test.parameters:
                lines.append((row.log, test.condition, p.parameter, p.unit, ", ".join(test.warnings)))
                values.append(tuple(map(_number, (p.value, p.low, p.high, test.nrmse, test.nrmse_holdout))))
        if row.error:
            lines.append((row.log, "", "", "", row.error))
            values.append((np.nan,) * 5)
    written = dict(zip(("log", "condition", "parameter", "unit", "warnings"), zip(*lines, strict=True), strict=True))
    columns = {name: texts(column) for name, column in written.items()}
    measured = np.array(values, dtype=np.float64).T
    for name, column in zip(("value", "low", "high", "nrmse", "nrmse_holdout"), measured, strict=True):
        columns[name] = numbers(column)
    order = ("log", "condition", "parameter", "unit", "value", "low", "high", "nrmse", "nrmse_holdout", "warnings")
    made = pa.Table.from_arrays([columns[n] for n in order], names=list(order))
    write_atomic(path, lambda p: pq.write_table(made, p, row_group_size=ROW_GROUP, compression="zstd"))


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)
