"""How fast a scope CSV is read, against pyarrow's own CSV reader in the same run.

Prints seconds and the ratio for reading alone (file to SI channels on a time base) and for the whole ingest stage
(hash, reading, sanity checks, Parquet).
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pyarrow import csv

from mrfit.core.registry import load
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.stage import Settings, run
from mrfit.ingest.table import Source
from mrfit.ingest.text.head import open_head
from mrfit.io.workspace import Workspace

ROWS, REPEATS = 1_000_000, 7


def write_scope_csv(path: Path, rows: int) -> None:
    """Time and three channels, as a Tektronix MSO writes them."""
    rng = np.random.default_rng(1)
    head = f"Model,MSO2014\nHorizontal Units,S,\nSample Interval,1e-06,\nRecord Length,{rows},\n"
    with path.open("w") as handle:
        handle.write(head + "Vertical Units,V,V,V\nLabel,,,\nTIME,CH1,CH2,CH3\n")
        for start in range(0, rows, 100_000):
            count = min(100_000, rows - start)
            volts = np.round(rng.normal(size=(count, 3)), 5)
            times = (start + np.arange(count)) * 1e-6
            handle.writelines(f"{t:.6e},{a:.5f},{b:.5f},{c:.5f}\n" for t, (a, b, c) in zip(times, volts, strict=True))


def best(repeats: int, *jobs: Callable[[], object]) -> list[float]:
    """Least time of each job, taken in turn so that all meet the same machine."""
    times = [[0.0] * repeats for _ in jobs]
    for k in range(repeats):
        for number, job in enumerate(jobs):
            begin = time.perf_counter()
            job()
            times[number][k] = time.perf_counter() - begin
    return [min(t) for t in times]


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scope.csv"
        write_scope_csv(path, ROWS)
        reader = load("reader", "tektronix-mso")
        count = iter(range(1_000_000))
        arrow, reading, stage = best(
            REPEATS,
            lambda: csv.read_csv(path, csv.ReadOptions(skip_rows=6)),
            lambda: reader.read(Source(open_head(path), Rules())),
            lambda: run([path], Settings(), Workspace(Path(folder) / f"work{next(count)}")),
        )
    print(f"\ningest of a scope's CSV file, {ROWS} rows x 4 columns, best of {REPEATS}")
    print(f"pyarrow.csv.read_csv           {arrow:7.3f} s")
    for name, seconds in (("reader", reading), ("whole stage", stage)):
        print(f"{name:30s} {seconds:7.3f} s   {arrow / seconds:5.2f} x pyarrow")
