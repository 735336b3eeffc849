"""Public benchmarks with others' scores, by mrfit's commands.

    MRFIT_PUBLIC_BENCHMARKS=FOLDER python -m benchmarks.public_benchmarks > docs/public_benchmarks.md

The folder has ``boucwen`` with the files of docs/driven.md and uval_sinesweep.mat, yval_sinesweep.mat.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import loadmat

from mrfit.core.specs import Array
from mrfit.simulate.assembly import assemble
from tests.conftest import ROOT
from tests.docs.pages import blocks

PERIOD, RATE = 8192, 750.0
FITS = (("boucwen-hardening", 5), ("boucwen-hardening", 1), ("linear-spring-dashpot", 5), ("bingham", 5))
SWEEP = """
[[files]]
match = "?val_sinesweep.mat"
join = "sinesweep"

[files.channels]
excitation_force = {column = "uval_sinesweep", unit = "N"}
displacement = {column = "yval_sinesweep", unit = "m"}
"""
PLANTED = {"c": 10.0, "k": 5e4, "x0": 0.0, "alpha": 5e4, "b": -2.2, "g": 1.6, "n": 1.0, "z0": 2e-3, "mass": 2.0}
HEAD = """# Public benchmarks

`MRFIT_PUBLIC_BENCHMARKS=FOLDER make benchmarks-public`

## Bouc–Wen benchmark

J. P. Noël, M. Schoukens, *Hysteretic benchmark with a dynamic nonlinearity*, 4TU.ResearchData,
[doi:10.4121/12967592](https://doi.org/10.4121/12967592): force in, displacement of a mass out, 750 Hz. Fitted to a
training record of five periods of a multisine with the benchmark's noise, by the commands of [driven](driven.md) with
default settings. The tests are without noise and seen by no fit: 8 192 samples of a multisine in its steady state,
153 000 of a sine sweep from rest. Error: rms of the displacement, in m, as the benchmark asks. Results of others are
listed on the [benchmark's page](https://www.nonlinearbenchmark.org/benchmarks/bouc-wen).

| by | trained on | multisine (m) | sweep (m) | fit (s) |
|---|---|---|---|---|"""


def run(folder: Path, line: str) -> dict[str, Any]:
    """Run a command in a folder and return its summary."""
    done = subprocess.run(
        [sys.executable, "-m", "mrfit.cli", *line.split(), "--json"], cwd=folder, check=True, capture_output=True
    )
    summary: dict[str, Any] = json.loads(done.stdout)
    return summary


def errors(folder: Path, source: Path, fit: str) -> list[float]:
    """Return the rms errors of a fit on both tests."""
    found = []
    for test in ("multisine", "sinesweep"):
        files = " ".join(str(source / f"{part}val_{test}.mat") for part in "uy")
        made = run(folder, f"predict {files} --fit {fit} --map boucwen.toml")
        found.append(next(float(m["rmse"]) for m in made["metrics"] if m["condition"] == "all"))
    return found


def planted(source: Path) -> list[float]:
    """Return the errors of the true parameters: what the tests' own simulation leaves."""
    whole, found = assemble("boucwen-hardening@force"), []
    for test, lead in (("multisine", PERIOD), ("sinesweep", 0)):
        u, y = (np.ravel(loadmat(source / f"{part}val_{test}.mat")[f"{part}val_{test}"]) for part in "uy")
        drive: Array = np.concatenate([u[:lead], u])
        moved = whole.simulate(drive[None], whole.spec.theta(PLANTED)[None], 1.0 / RATE)[0, lead:]
        found.append(float(np.sqrt(np.mean((moved - y) ** 2))))
    return found


def fitted(source: Path, model: str, periods: int) -> tuple[list[float], float]:
    """Return the errors of a model after a fit to so many periods, and the seconds that the command took."""
    page = next(iter(blocks(ROOT / "docs/driven.md", "toml")))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with h5py.File(source / "training_dynonet.h5") as file, h5py.File(folder / "training_dynonet.h5", "w") as cut:
            for column in ("multisine/u", "multisine/y"):
                cut[column] = file[column][: periods * PERIOD]
        stated = f'match = "training_dynonet.h5"\ncondition = {{frequency = {RATE / PERIOD}}}'
        (folder / "boucwen.toml").write_text(page.replace('match = "training_dynonet.h5"', stated) + SWEEP)
        run(folder, "ingest training_dynonet.h5 --map boucwen.toml")
        begun = time.perf_counter()
        run(folder, f"fit --model {model} --driven-by force --mass free")
        seconds = time.perf_counter() - begun
        return errors(folder, source, f"{model}.auto"), seconds


def main() -> None:
    source = Path(os.environ["MRFIT_PUBLIC_BENCHMARKS"]).resolve() / "boucwen"
    print(HEAD)
    print("| true parameters, mrfit's simulation | – | {:.2e} | {:.2e} | – |".format(*planted(source)), flush=True)
    for model, periods in FITS:
        found, seconds = fitted(source, model, periods)
        print(f"| `{model}` | {periods} of 5 periods | {found[0]:.2e} | {found[1]:.2e} | {seconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
