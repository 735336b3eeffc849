"""Memory and time that `mrfit ingest` takes for a scope CSV longer than a small machine's memory.

    python -m benchmarks.ingest_memory [--gigabytes 5] [--folder FOLDER]

Writes the log into a temporary folder (room for three times its size is needed), ingests it in a process of its own and
prints that process's peak resident memory, the time, and the rows against those written. One row in a million is cut
short, and the clock pauses once. Everything is deleted afterwards.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

BATCH = 1_000_000
BYTES_PER_ROW = 32
DT = 1e-6
PAUSE = 0.5


def write_log(path: Path, gigabytes: float) -> None:
    """Write time and three channels as a Tektronix MSO does, and the counts of rows beside it."""
    import pyarrow as pa
    from pyarrow import csv

    rng = np.random.default_rng(1)
    batches = max(2, round(gigabytes * 1e9 / (BYTES_PER_ROW * BATCH)))
    head = f"Model,MSO2014\nHorizontal Units,S,\nSample Interval,{DT:g},\nRecord Length,{batches * BATCH},\n"
    with path.open("wb") as handle:
        handle.write((head + "Vertical Units,V,V,V\nLabel,,,\nTIME,CH1,CH2,CH3\n").encode())
        for number in range(batches):
            row = number * BATCH + np.arange(BATCH)
            volts = np.round(np.sin(2 * np.pi * 50 * DT * row)[:, None] + 0.01 * rng.normal(size=(BATCH, 3)), 4)
            clock = np.round(row * DT + PAUSE * (number >= batches // 2), 6)
            sink = pa.BufferOutputStream()
            columns = [pa.array(v) for v in (clock, *volts.T)]
            options = csv.WriteOptions(include_header=False)
            csv.write_csv(pa.Table.from_arrays(columns, list("abcd")), sink, options)
            text = sink.getvalue().to_pybytes()
            middle = text.index(b"\n", int(rng.integers(len(text) - 1000))) + 1
            handle.write(text[: text.index(b",", middle)] + text[text.index(b"\n", middle) :])  # one row cut short
    counts = {"rows": batches * BATCH, "short": batches}
    path.with_suffix(".json").write_text(json.dumps(counts))


def ingest(path: Path, work: Path) -> tuple[float, float, str]:
    """Return seconds, peak resident memory in MB, and what `mrfit ingest` printed."""
    command = [sys.executable, "-c", "from mrfit.cli import main; main()", "ingest", str(path), "--work", str(work)]
    begin = time.perf_counter()
    with tempfile.TemporaryFile("w+") as out:
        process = subprocess.Popen(command, stdout=out)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        printed = out.read()
    if process.returncode:
        raise SystemExit(f"mrfit ingest ended with {process.returncode}: {printed}")
    return time.perf_counter() - begin, usage.ru_maxrss / 1024, printed


def main(gigabytes: float = 5.0, folder: Path | None = None) -> None:
    """Print one line of memory and time, and one of rows."""
    with tempfile.TemporaryDirectory(dir=folder) as place:
        path, work = Path(place) / "scope.csv", Path(place) / "work"
        # a process of its own: what the writer takes must not count for its sibling
        writer = [sys.executable, __file__, "--write", str(path), "--gigabytes", str(gigabytes)]
        subprocess.run(writer, check=True)
        size = path.stat().st_size
        seconds, peak, _ = ingest(path, work)
        counts = json.loads(path.with_suffix(".json").read_text())
        recordings = json.loads((work / "ingest.json").read_text())["recordings"]
        kept, refused = (sum(r[k] for r in recordings) for k in ("rows_kept", "rows_refused"))
        rate = size / 1e6 / seconds
        print(f"{size / 1e9:.2f} GB scope CSV: peak memory {peak:.0f} MB, {seconds:.0f} s, {rate:.0f} MB/s")
        print(f"rows written {counts['rows']} = kept {kept} + refused {refused}: {kept + refused == counts['rows']}")
        print(f"cut rows {counts['short']} = refused: {refused == counts['short']}; recordings: {len(recordings)}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--gigabytes", type=float, default=5.0)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--write", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.write:
        write_log(arguments.write, arguments.gigabytes)
    else:
        main(arguments.gigabytes, arguments.folder)
