"""The papers' comparisons of optimizers again: ``python -m benchmarks.papers [--out FOLDER]``.

The rotary-stiffness paper, figure 13: MWOA against WOA, GA, PSO and MA, population 40, 800 iterations, on a log made
from its generalised model (eqs. 20-24) at 1 A, 3 Hz and 17.65 mm. The flux paper, table 2: PSO-fmincon against
fmincon, at 1 Hz and 1 to 5 A, on the logs in ``datasets/coil``. Both by ``mrfit compare --optimizers``, whose tables
are printed; its pages with the convergence curves stay in the folder.
"""

import argparse
import csv
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.command import COIL, run_mrfit
from mrfit.models.rotational_erf import response

# k, c, alpha, beta, gamma and offset at 1 A
PUBLISHED = (18.07, 2.2934, 5.7412, 18.51, 0.7216, 0.0)
# 17.65 mm at the lever are 5 degrees
FREQUENCY, AMPLITUDE, RATE, CYCLES, NOISE = 3.0, np.deg2rad(5.0), 1000.0, 12, 0.2
SEEDS = 30


def write_rotary_log(folder: Path) -> None:
    """Write a log of angle and torque, with white noise of 0.2 N*m, as CSV."""
    time = np.arange(int(CYCLES * RATE / FREQUENCY)) / RATE
    phase = 2.0 * np.pi * FREQUENCY * time
    drive = AMPLITUDE * np.stack([np.sin(phase), 2.0 * np.pi * FREQUENCY * np.cos(phase)])
    torque = response(drive, np.array([PUBLISHED]), 1.0 / RATE)[0]
    torque = torque + NOISE * np.random.default_rng(0).standard_normal(len(time))
    columns = np.stack([time, drive[0], torque], axis=1)
    path = folder / "rotary_3Hz_1A.csv"
    np.savetxt(path, columns, "%.9g", ",", header="time [s],angle [rad],torque [N*m]", comments="")


def compare(work: Path, logs: Path, *options: str) -> None:
    """Ingest logs, compare optimizers on them, and print the table."""
    run_mrfit(work, "ingest", str(logs))
    if logs == COIL:
        run_mrfit(work, "flux")
    run_mrfit(work, "segment", "--holdout", "none")
    run_mrfit(work, "compare", "--seeds", str(SEEDS), *options)
    print(f"\nmrfit compare --seeds {SEEDS} {' '.join(options)}\n{work / 'compare' / 'optimizers.html'}")
    with (work / "compare" / "optimizers.csv").open(encoding="utf-8") as handle:
        for row in csv.DictReader(handle):
            costs = "  ".join(f"{name} {float(row[name]):.4g}" for name in ("best", "median", "worst"))
            print(
                f"{row['condition']:22s} {row['optimizer']:10s} {costs} {row['unit']}  {row['evaluations']} evaluations"
            )


def main() -> None:
    """Make both comparisons."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for the workspaces; default: a temporary one")
    out = parser.parse_args().out or Path(tempfile.mkdtemp(prefix="mrfit-papers-"))
    logs = out / "rotary-logs"
    logs.mkdir(parents=True, exist_ok=True)
    write_rotary_log(logs)
    optimizers = ("--optimizers", "mwoa,woa,ga,pso,monkey,auto")
    rotary = ("--model", "rotational-erf", "--budget", "32000", "--stall", "1", *optimizers)
    narrow = ("k=-100:100", "alpha=0.01:100", "c=0.001:100", "beta=0.05:100", "gamma=-5:5", "T0=-10:10")
    compare(out / "rotary", logs, *rotary)
    compare(out / "rotary-narrow", logs, *rotary, *(word for b in narrow for word in ("--bounds", b)))
    flux = ("--model", "boucwen-flux", "--per", "condition", "--only", "*-1Hz-*")
    compare(out / "flux", COIL, *flux, "--optimizers", "fmin,pso-fmin,auto")


if __name__ == "__main__":
    main()
