"""The table of all logs of a batch: a row for every parameter of every condition of every log."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrfit.core.recording import NAMING
from mrfit.io.arrow import numbers, texts
from mrfit.io.atomic import write_atomic
from mrfit.io.schemas.batch import LogRow
from mrfit.io.tables import ROW_GROUP


def write(path: Path, rows: Sequence[LogRow]) -> None:
    """Write the table as Parquet; a log that failed has one row, without condition, whose ``warnings`` are its line.

    Columns: ``log``, ``condition``, ``parameter``, ``unit``, ``value``, ``low``, ``high`` (95 % interval, nan where it
    is open), ``nrmse`` and ``nrmse_holdout`` of the condition, ``warnings`` by commas, ``role`` in the model, ``scale``
    (``log`` or ``linear``) and ``degrees`` of the covariance, ``frequency``, ``amplitude`` and ``current`` of the test,
    and ``covariance``: with all rows of this log and condition in their order, on their scales; null where the data do
    not determine the parameter, nan where they do not determine the other one.

    Raises
    ------
    DataError
        If it cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    lines: list[tuple[str, ...]] = []
    matrices: list[list[float] | None] = []
    values: list[tuple[float, ...]] = []
    for row in rows:
        for test in row.tests:
            found = test.covariance
            place = {name: k for k, name in enumerate(found.names)} if found else {}
            for p in test.parameters:
                k = place.get(p.parameter)
                role, scale = (
                    (found.roles[k], "log" if found.log[k] else "linear") if found and k is not None else ("", "")
                )
                lines.append((row.log, test.condition, p.parameter, p.unit, ", ".join(test.warnings), role, scale))
                known = (found.degrees if found else None, *(getattr(test, name) for name in NAMING))
                values.append(tuple(map(_number, (p.value, p.low, p.high, test.nrmse, test.nrmse_holdout, *known))))
                own = None if found is None or k is None else found.rows[k]
                others = [place.get(q.parameter) for q in test.parameters]
                matrices.append(own and [np.nan if j is None else own[j] for j in others])
        if row.error:
            lines.append((row.log, "", "", "", row.error, "", ""))
            values.append((np.nan,) * (6 + len(NAMING)))
            matrices.append(None)
    words = ("log", "condition", "parameter", "unit", "warnings", "role", "scale")
    written = dict(zip(words, zip(*lines, strict=True), strict=True))
    columns = {name: texts(column) for name, column in written.items()}
    measured = np.array(values, dtype=np.float64).T
    figures = ("value", "low", "high", "nrmse", "nrmse_holdout", "degrees", *NAMING)
    columns |= {name: numbers(column) for name, column in zip(figures, measured, strict=True)}
    columns["covariance"] = pa.array(matrices, pa.list_(pa.float64()))
    order = (*words[:4], *figures[:5], *words[4:], *figures[5:], "covariance")
    made = pa.Table.from_arrays([columns[n] for n in order], names=list(order))
    write_atomic(path, lambda p: pq.write_table(made, p, row_group_size=ROW_GROUP, compression="zstd"))


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)
