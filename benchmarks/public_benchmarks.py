"""Public benchmarks with others' scores: each benchmark's result file, and the page of all.

    MRFIT_PUBLIC_BENCHMARKS=FOLDER python -m benchmarks.public_benchmarks [boucwen] [magnet] > docs/public_benchmarks.md

The folder has ``boucwen``, with the files of docs/driven.md and uval_sinesweep.mat, yval_sinesweep.mat, and ``magnet``,
with 3C90_true.h5, known_steps.csv and lstm_baseline_pred.csv. Named benchmarks are run again, all where none is named;
with ``page`` none is. Records of dampers are those that ``make studies`` and ``make studies-long`` have run.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import loadmat

from benchmarks import magnet
from benchmarks.studies import page as studies
from mrfit.core.specs import Array
from mrfit.simulate.assembly import assemble
from tests.conftest import ROOT
from tests.docs.pages import blocks

PERIOD, RATE = 8192, 750.0
FITS = (("boucwen-hardening", 5), ("boucwen-hardening", 1), ("linear-spring-dashpot", 5))
SWEEP = """
[[files]]
match = "?val_sinesweep.mat"
join = "sinesweep"

[files.channels]
excitation_force = {column = "uval_sinesweep", unit = "N"}
displacement = {column = "yval_sinesweep", unit = "m"}
"""
PLANTED = {"c": 10.0, "k": 5e4, "x0": 0.0, "alpha": 5e4, "b": -2.2, "g": 1.6, "n": 1.0, "z0": 2e-3, "mass": 2.0}
RESULTS = Path(__file__).parent / "public_results"
HEAD = """# Public benchmarks

Data that anyone can get, with scores that others published: the same error on the same records. No fit has seen them,
but where this is said. The page is made from result files by

    MRFIT_PUBLIC_BENCHMARKS=FOLDER make benchmarks-public

which runs the first two benchmarks, or those of `BENCHMARKS=NAME`. The records of dampers are run by
`MRFIT_REAL_LOGS=FOLDER make studies studies-long`.
"""
BOUC_WEN = """
## Bouc–Wen benchmark

J. P. Noël, M. Schoukens, *Hysteretic benchmark with a dynamic nonlinearity*, 4TU.ResearchData,
[doi:10.4121/12967592](https://doi.org/10.4121/12967592): force in, displacement of a mass out, 750 Hz. Fitted to a
training record of five periods of a multisine with the benchmark's noise, by the commands of [driven](driven.md) with
default settings. The tests are without noise and seen by no fit: 8 192 samples of a multisine in its steady state,
153 000 of a sine sweep from rest. Error: rms of the displacement, in m, as the benchmark asks. Results of others are
listed on the [benchmark's page](https://www.nonlinearbenchmark.org/benchmarks/bouc-wen); the two rows here are the best
linear model and the best that could be confirmed.

| by | trained on | multisine (m) | sweep (m) | fit (s) |
|---|---|---|---|---|
| best linear model published | their own record | 1.6e-04 | – | – |
| best published | their own record | 7.5e-06 | – | – |"""
MAGNET = """
## MagNet Challenge 2: H from B

[MagNetX](https://github.com/PaulShuk/MagNetX), Tutorial 3: 105 measured transients of ferrite 3C90 at 25, 50 and 70 °C,
1 000 steps of 62.5 ns. B is given; of H the first 100 to 900 steps are. Error of a sequence: RMS(ΔH)/RMS(H) over the
unknown part. Others: the organisers' network (LSTM), its predictions as published there, scored here by the same error.

mrfit: `{model}` with B for flux and H for current, {parameters} parameters, by
`python -m benchmarks.public_benchmarks magnet`. The 105 are all there is. They make five groups (every fifth sequence):
each is predicted by a model fitted to the four other groups. The state comes from the known part of H, by
`mrfit.apply.current_of_flux`. B is late against H by {skews} samples, chosen by each fit on its own sequences. This
counts as a parameter.

| | {heads} |
|---|{rule}|"""
FORM = """
The model's form was chosen during development by the mean error over the same groups, which has seen all sequences.
The parameters of a fit have not. Forms compared, by a prototype of the fit with a state of its own for each stop:

| form | parameters | mean (%) | 95th percentile (%) |
|---|---|---|---|
{forms}

Chosen for each group by the errors on the four others, of 24 forms tried, the prototype leaves {nested} on all
groups: the choice itself costs little. The first score of the model as it stands here, without the lateness of B,
was {first}.
"""
# Table of the studies -> record and split, error, who published, command
RECORDS_TOLD = {
    "Press (UTFSM): errors on tests held out": (
        "UTFSM press, 5 mm 3 Hz at 0 and 0.5 A",
        "NRMSE (%)",
        "the authors' parameters, fitted to all tests, simulated here",
        "mrfit run pipelines/study-press.toml --log …",
    ),
    "Prototype damper (NEES-2012-1158)": (
        "NEES-2012-1158, after 18 s",
        "NRMSE (%)",
        "none found",
        "mrfit run pipelines/study-prototype.toml --log …",
    ),
    "Keio: fit on the record held out": (
        "Keio, second record, free run",
        "fit (%, more is better)",
        "a simple Bouc-Wen model, as cited in the studies; its source was not seen again",
        "mrfit run pipelines/study-keio.toml --log …",
    ),
    "Shaking table (labcontrol)": (
        "labcontrol shaking table, least and greatest condition; fitted to it, not held out",
        "rms error over rms force (%)",
        "the authors' sheet of four Dahl models, which does not define its error",
        "mrfit run pipelines/study-table.toml --log …",
    ),
}
RECORDS = """
## Records of dampers

From the result files of [the studies](studies.md), which name the split. Errors are on records held out, but for
the shaking table: its authors' models and mrfit's were fitted to each condition.

| record | error | published | source | mrfit | model | command |
|---|---|---|---|---|---|---|"""


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


def boucwen(source: Path) -> dict[str, Any]:
    """Return the errors of the true parameters and of every fit."""
    rows: list[dict[str, Any]] = []
    for model, periods in FITS:
        found, seconds = fitted(source, model, periods)
        rows.append({"model": model, "periods": periods, "errors": found, "seconds": seconds})
        print(rows[-1], file=sys.stderr, flush=True)
    return {"planted": planted(source), "fits": rows}


def boucwen_part(result: dict[str, Any]) -> list[str]:
    """Return the part of the page on the Bouc-Wen benchmark."""
    lines = [BOUC_WEN, "| true parameters, mrfit's simulation | – | {:.2e} | {:.2e} | – |".format(*result["planted"])]
    for row in result["fits"]:
        errors = "{:.2e} | {:.2e}".format(*row["errors"])
        lines.append(f"| `{row['model']}` | {row['periods']} of 5 periods | {errors} | {row['seconds']:.0f} |")
    return lines


def magnet_part(result: dict[str, Any]) -> list[str]:
    """Return the part of the page on MagNet."""
    warm, known = (np.array(result[n]) for n in ("temperature", "known"))
    groups = {"all: mean": np.ones(len(warm), dtype=bool)}
    groups |= {f"{t:g} °C": warm == t for t in np.unique(warm)}
    groups |= {f"{k / 10:g} % known": known == k for k in np.unique(known)}
    skews = ", ".join(str(n) for n in sorted({fit["skew"] for fit in result["fits"]}))
    heads = ["parameters", *groups, "95th percentile", "median"]
    about = {"model": result["model"], "parameters": result["parameters"], "skews": skews}
    lines = [MAGNET.format(**about, heads=" | ".join(heads), rule="---|" * (len(heads) - 1) + "---")]
    rows = (("organisers' LSTM", 2399, result["lstm"]), ("mrfit", result["parameters"], result["errors"]))
    for name, count, errors in rows:
        shares = 100.0 * np.array(errors)
        cells = [*(np.mean(shares[some]) for some in groups.values()), np.percentile(shares, 95), np.median(shares)]
        lines.append(f"| {name} | {count} | " + " | ".join(f"{c:.1f} %" for c in cells) + " |")
    forms = "\n".join(f"| {name} | {n} | {mean:.1f} | {high:.1f} |" for name, n, mean, high in magnet.FORMS)
    return [*lines, FORM.format(forms=forms, first=magnet.FIRST, nested=magnet.NESTED)]


def records_part() -> list[str]:
    """Return the part of the page on records of dampers, from the files of the studies."""
    tables = {}
    for name in ("real", "real-long"):
        content = json.loads((studies.RESULTS / f"{name}.json").read_text(encoding="utf-8"))
        tables |= {t["title"]: t for t in content["tables"]}
    lines = [RECORDS]
    for title, (record, error, source, command) in RECORDS_TOLD.items():
        for row in tables[title]["rows"]:
            cells = (record, error, _range(row["published"]), source, _range(row["reproduced"]))
            lines.append("| " + " | ".join(cells) + f" | `{row['of']}` | `{command}` |")
    return lines


def _range(values: list[float | None]) -> str:
    """Return one number, or from the least to the greatest; none is a dash."""
    known = [f"{v:.3g}" for v in values if v is not None]
    return " to ".join(known) or "–"


RUNS: dict[str, Callable[[Path], dict[str, Any]]] = {"boucwen": boucwen, "magnet": magnet.run}


def page() -> str:
    """Return the page of the result files that there are."""
    parts = {"boucwen": boucwen_part, "magnet": magnet_part}
    lines = [HEAD]
    for name, part in parts.items():
        if (kept := RESULTS / f"{name}.json").is_file():
            lines += part(json.loads(kept.read_text(encoding="utf-8")))
    return "\n".join([*lines, *records_part()])


def main(names: list[str]) -> None:
    if unknown := set(names) - {*RUNS, "page"}:
        sys.exit(f"no benchmark '{min(unknown)}'; there are {', '.join(RUNS)} and page")
    for name, measured in RUNS.items():
        if name in names or not names:
            found = measured(Path(os.environ["MRFIT_PUBLIC_BENCHMARKS"]).resolve() / name)
            (RESULTS / f"{name}.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(page())


if __name__ == "__main__":
    main(sys.argv[1:])
