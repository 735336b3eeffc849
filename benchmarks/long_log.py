"""Memory and time that ingest, segment and fit take for one hour at 10 kHz: 36 million rows of two channels.

    python -m benchmarks.long_log [--minutes 60] [--folder FOLDER] [--out FILE.md]

A damper under a sine of 1 Hz, F = 800·tanh(80 v + 20 x) + 1500 v + 3000 x + 20 with white noise of 8 N, is written as
Parquet into a temporary folder. Each command runs in a process of its own, whose peak resident memory is measured. The
parameters found are held against the planted ones. Everything is deleted afterwards.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.ingest_memory import MEASURE

RATE, BATCH = 10_000, 1_000_000
PLANTED = {"fy": 800.0, "a1": 80.0, "a2": 20.0, "c": 1500.0, "k": 3000.0, "f0": 20.0}
COMMANDS = {"ingest": ["LOG"], "segment": [], "fit": ["--model", "tanh"]}
HEAD = ("# One hour at 10 kHz", "", "`python -m benchmarks.long_log --out FILE.md`", "")
COLUMNS = ("command", "rows", "peak memory", "time")


def write_log(path: Path, minutes: float) -> None:
    """Write the log, a row group at a time."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rng, p = np.random.default_rng(1), PLANTED
    fields = [("time (s)", pa.float64()), ("displacement (mm)", pa.float32()), ("force (N)", pa.float32())]
    with pq.ParquetWriter(path, pa.schema(fields)) as writer:
        samples = round(60 * minutes * RATE)
        for begin in range(0, samples, BATCH):
            t = np.arange(begin, min(begin + BATCH, samples)) / RATE
            x, v = 0.01 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
            force = p["fy"] * np.tanh(p["a1"] * v + p["a2"] * x) + p["c"] * v + p["k"] * x + p["f0"]
            rows = (t, 1e3 * x + rng.normal(0.0, 0.01, len(t)), force + rng.normal(0.0, 8.0, len(t)))
            kinds = zip(rows, writer.schema.types, strict=True)
            columns = [pa.array(values.astype(kind.to_pandas_dtype())) for values, kind in kinds]
            writer.write_table(pa.Table.from_arrays(columns, schema=writer.schema))


def measured(command: list[str]) -> tuple[float, float]:
    """Return seconds and peak resident memory in MB of one mrfit command."""
    begin = time.perf_counter()
    timed = [sys.executable, "-c", MEASURE, sys.executable, "-m", "mrfit.cli", *command]
    process = subprocess.run(timed, stdout=subprocess.PIPE, text=True, check=True)
    return time.perf_counter() - begin, float(process.stdout) / 1024


def held(fit: dict[str, Any]) -> str:
    """Return how many planted parameters lie in their intervals, and the error over the noise."""
    rows = {p["name"]: p for p in fit["results"][0]["parameters"]}
    inside = sum(rows[n]["low"] <= value <= rows[n]["high"] for n, value in PLANTED.items())
    error = next(m for m in fit["metrics"] if m["role"] == "train" and m["condition"] == "all")
    return (
        f"{inside} of {len(PLANTED)} planted parameters lie in their 95 % intervals; "
        f"the error in training is {error['rmse'] / 8.0:.4f} times the noise."
    )


def main(minutes: float = 60.0, folder: Path | None = None, out: Path | None = None) -> None:
    """Print one line for each command."""
    lines = [*HEAD, f"| {' | '.join(COLUMNS)} |", "|---" * len(COLUMNS) + "|"]
    with tempfile.TemporaryDirectory(dir=folder) as place:
        log, work = Path(place) / "hour.parquet", Path(place) / "work"
        # a process of its own: what the writer takes must not count
        writer = [sys.executable, "-m", "benchmarks.long_log", "--write", str(log), "--minutes", str(minutes)]
        subprocess.run(writer, check=True)
        for name, options in COMMANDS.items():
            given = [str(log) if o == "LOG" else o for o in options]
            seconds, peak = measured([name, *given, "--work", str(work)])
            rows = f"{minutes * 60 * RATE / 1e6:.0f} million"
            lines.append(f"| {name} | {rows} | {peak / 1e3:.2f} GB | {seconds:.0f} s |")
            print(lines[-1], flush=True)
        lines += ["", held(json.loads((work / "fits" / "tanh.auto" / "fit.json").read_text()))]
    print(lines[-1])
    if out:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--out", type=Path, help="write the table into a Markdown file as well")
    parser.add_argument("--write", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.write:
        write_log(arguments.write, arguments.minutes)
    else:
        main(arguments.minutes, arguments.folder, arguments.out)
