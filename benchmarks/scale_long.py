"""One log of a coil, as long as it is asked for, through ingest, flux, segment and fit: peak memory and time of each.

    python -m benchmarks.scale_long --write FILE.csv --gigabytes 2

writes the log alone, a piece at a time: a sine of 5 Hz sampled 10 000 times a second, voltage and current with white
noise. ``benchmarks.scale --parts long`` runs the stages.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.long_log import measured
from benchmarks.scale_logs import AMPERE, MAP, OHM, PER_CYCLE, PLANTED, VOLT
from mrfit.models import boucwen_flux

FREQUENCY, AMPLITUDE = 5.0, 2.0
# Rows written together, whole cycles
ROWS = 250 * PER_CYCLE
STAGES = {"ingest": [], "flux": [], "segment": [], "fit": ["--model", "boucwen-flux", "--name", "a"]}


def cycle() -> tuple[np.ndarray, np.ndarray]:
    """Return voltage and current (N,) over one steady cycle without noise."""
    dt = 1.0 / (FREQUENCY * PER_CYCLE)
    current = AMPLITUDE * np.sin(2.0 * np.pi * np.arange(4 * PER_CYCLE) / PER_CYCLE)
    flux = boucwen_flux.response(current[None, :], np.array([[*PLANTED.values()]]), dt)[0]
    voltage = OHM * current + np.gradient(flux, dt)
    last = slice(2 * PER_CYCLE, 3 * PER_CYCLE)
    return voltage[last], current[last]


def write(path: Path, gigabytes: float) -> None:
    """Write a log of about this size and its channel map."""
    import pyarrow as pa
    import pyarrow.csv

    path.parent.mkdir(parents=True, exist_ok=True)
    (path.parent / "mrfit.toml").write_text(MAP)
    rng, (voltage, current) = np.random.default_rng(1), cycle()
    u, i = (np.tile(values, ROWS // PER_CYCLE) for values in (voltage, current))
    head, begin = True, 0
    with path.open("wb") as file:
        while file.tell() < 1e9 * gigabytes:
            moments = np.round(np.arange(begin, begin + ROWS) / (FREQUENCY * PER_CYCLE), 4)
            noise = rng.standard_normal((2, ROWS))
            columns = [moments, np.round(u + VOLT * noise[0], 5), np.round(i + AMPERE * noise[1], 6)]
            table = pa.Table.from_arrays([pa.array(c) for c in columns], names=["t (s)", "u (V)", "i (A)"])
            pyarrow.csv.write_csv(table, file, pyarrow.csv.WriteOptions(include_header=head))
            head, begin = False, begin + ROWS


def row_of(place: Path, gigabytes: float) -> Sequence[object]:
    """Return the row of a log of this size: peak memory and processor seconds of every stage."""
    log, work = place / "long.csv", place / "work"
    # a process of its own: what the writer takes must not count
    writer = [sys.executable, "-m", "benchmarks.scale_long", "--write", str(log), "--gigabytes", str(gigabytes)]
    subprocess.run(writer, check=True)
    size, cells, begin = log.stat().st_size / 1e9, [], time.perf_counter()
    for name, options in STAGES.items():
        given = [str(log)] if name == "ingest" else options
        before = _children()
        _, peak = measured([name, *given, "--work", str(work)])
        cells.append(f"{peak / 1e3:.2f} GB, {_children() - before:.0f} s")
        print(f"{size:.1f} GB", name, cells[-1], file=sys.stderr, flush=True)
        log.unlink(missing_ok=True)
    samples = json.loads((work / "ingest.json").read_text())["recordings"][0]["rows_kept"]
    clock = f"{(time.perf_counter() - begin) / 60:.1f} min"
    return f"{size:.1f} GB", f"{samples / 1e6:.0f} million", *cells, clock, f"{error(work):.1g}"


def _children() -> float:
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def error(work: Path) -> float:
    """Return the greatest relative error of the quantities that data of one amplitude determine."""
    fit = json.loads((work / "fits" / "a" / "fit.json").read_text())
    found = {p["name"]: p["value"] for p in fit["results"][0]["derived"]}
    planted = boucwen_flux.derived(np.array([[*PLANTED.values()]]))[0]
    names = [d.name for d in boucwen_flux.SPEC.derived]
    return max(abs(found[name] / value - 1.0) for name, value in zip(names, planted, strict=True))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, required=True)
    parser.add_argument("--gigabytes", type=float, required=True)
    given = parser.parse_args()
    write(given.write, given.gigabytes)
