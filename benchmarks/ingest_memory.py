"""Memory and time that `mrfit ingest` takes for logs longer than a small machine's memory.

    python -m benchmarks.ingest_memory [--gigabytes 5] [--folder FOLDER] [--out FILE.md]

First a scope CSV of so many gigabytes: one row in a million is cut short, and the clock pauses once. Then one hour at
10 kHz (36 million rows of time and two channels) in every format that may be long. Each log is written into a temporary
folder (room for three times the scope CSV is needed) and ingested in a process of its own, of which the peak resident
memory is measured, with that of the process that reads fragile formats; rows read are held against those written.
Everything is deleted afterwards.
"""

import argparse
import json
import shutil
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
HOUR = 36_000_000
"""Rows of one hour at 10 kHz."""


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


def write_hour(path: Path) -> None:
    """Write one hour at 10 kHz in the format that the file's ending names."""
    row = np.arange(HOUR)
    rng = np.random.default_rng(2)
    time_, drive = np.round(row * 1e-4, 4), np.round(10.0 * np.sin(2 * np.pi * 5e-4 * row), 3)
    force = np.round(1e3 * np.cos(2 * np.pi * 5e-4 * row) + rng.normal(size=HOUR), 1)
    columns = {"time (s)": time_, "displacement (mm)": drive, "force (N)": force}
    HOURS[path.suffix](path, columns)
    path.with_suffix(".json").write_text(json.dumps({"rows": HOUR, "short": 0}))


def _csv(path: Path, columns: dict[str, np.ndarray]) -> None:
    import pyarrow as pa
    from pyarrow import csv

    csv.write_csv(pa.table(columns), path)


def _parquet(path: Path, columns: dict[str, np.ndarray]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table(columns), path, row_group_size=HOUR if "one" in path.stem else BATCH)


def _hdf5(path: Path, columns: dict[str, np.ndarray]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file.create_dataset(name.split(" ")[0], data=values, chunks=(BATCH,), compression="lzf")


def _matlab(path: Path, columns: dict[str, np.ndarray]) -> None:
    from scipy.io import savemat

    savemat(path, {name.split(" ")[0]: values for name, values in columns.items()}, do_compression=True)


def _tdms(path: Path, columns: dict[str, np.ndarray]) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(str(path)) as writer:
        for begin in range(0, HOUR, BATCH):
            parts = {name: values[begin : begin + BATCH] for name, values in columns.items()}
            writer.write_segment([ChannelObject("rig", name, values) for name, values in parts.items()])


def _mdf(path: Path, columns: dict[str, np.ndarray]) -> None:
    import asammdf

    (_, time_), *others = columns.items()
    with asammdf.MDF(version="4.10") as made:
        made.append([asammdf.Signal(v, time_, name=n.split(" ")[0], unit=n[-3:].strip("( )")) for n, v in others])
        made.save(path, compression=1)


HOURS = {".csv": _csv, ".parquet": _parquet, ".h5": _hdf5, ".mat": _matlab, ".tdms": _tdms, ".mf4": _mdf}
HOUR_FILES = ("hour.csv", "hour.parquet", "one-row-group.parquet", "hour.h5", "hour.mat", "hour.tdms", "hour.mf4")


def ingest(path: Path, work: Path) -> tuple[float, float]:
    """Return seconds, and the peak resident memory in MB of `mrfit ingest` or of the process that reads for it."""
    command = [sys.executable, "-m", "mrfit.cli", "ingest", str(path), "--work", str(work)]
    begin = time.perf_counter()
    with tempfile.TemporaryFile("w+") as out:
        # of a process and those it waited for, the largest; a fork of this one would count with this one's memory
        timed = [sys.executable, "-c", MEASURE, *command]
        process = subprocess.run(timed, stdout=subprocess.PIPE, stderr=out, text=True)
        out.seek(0)
        printed = out.read()
    if process.returncode:
        raise SystemExit(f"mrfit ingest ended with {process.returncode}: {printed}")
    return time.perf_counter() - begin, float(process.stdout) / 1024


MEASURE = """
import resource, subprocess, sys
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(code)
"""
HEAD = ("# Memory and time of ingest", "", "`python -m benchmarks.ingest_memory --out FILE.md`", "")
COLUMNS = ("log", "size", "rows", "peak memory", "time", "rows written = kept + refused", "cut rows = refused")


def measured(place: Path, name: str, options: list[str]) -> str:
    """Write a log, ingest it, and return its line of the table."""
    path, work = place / name, place / "work"
    # a process of its own: what the writer takes must not count for its sibling
    subprocess.run([sys.executable, "-m", "benchmarks.ingest_memory", "--write", str(path), *options], check=True)
    size = path.stat().st_size
    seconds, peak = ingest(path, work)
    counts = json.loads(path.with_suffix(".json").read_text())
    recordings = json.loads((work / "ingest.json").read_text())["recordings"]
    kept, refused = (sum(r[k] for r in recordings) for k in ("rows_kept", "rows_refused"))
    shutil.rmtree(work)
    path.unlink()
    whole, cut = kept + refused == counts["rows"], refused == counts["short"]
    rows = f"{counts['rows'] / 1e6:.0f} million"
    cells = (name, f"{size / 1e9:.2f} GB", rows, f"{peak:.0f} MB", f"{seconds:.0f} s", said(whole), said(cut))
    return f"| {' | '.join(cells)} |"


def said(value: bool) -> str:
    return "yes" if value else "no"


def main(gigabytes: float = 5.0, folder: Path | None = None, out: Path | None = None) -> None:
    """Print one line for each log."""
    lines = [*HEAD, f"| {' | '.join(COLUMNS)} |", "|---" * len(COLUMNS) + "|"]
    print(*lines, sep="\n")
    with tempfile.TemporaryDirectory(dir=folder) as place:
        for name in ("scope.csv", *HOUR_FILES):
            lines.append(measured(Path(place), name, ["--gigabytes", str(gigabytes)]))
            print(lines[-1], flush=True)
    if out:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--gigabytes", type=float, default=5.0)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--out", type=Path, help="write the table into a Markdown file as well")
    parser.add_argument("--write", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.write and arguments.write.name == "scope.csv":
        write_log(arguments.write, arguments.gigabytes)
    elif arguments.write:
        write_hour(arguments.write)
    else:
        main(arguments.gigabytes, arguments.folder, arguments.out)
