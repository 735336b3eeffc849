"""What share of new measurements the 95 % band of a prediction holds: ``python -m benchmarks.band_coverage``.

Every test of a set of records is held out once, a third of them at a time, and predicted by a fit to the others. The
sets are real records (with MRFIT_REAL_LOGS) and fresh planted dampers whose law is none of the models fitted. With
``--keep FOLDER`` finished sets are kept there; ``--beside FOLDER`` shows those of another version beside them.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse  # noqa: E402
import json  # noqa: E402
import sys  # noqa: E402
from collections.abc import Iterator, Sequence  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402

import mrfit  # noqa: E402
from benchmarks.command import deliver  # noqa: E402
from benchmarks.law_mismatch import realsets  # noqa: E402
from benchmarks.law_mismatch.methods import Asked, recordings_of  # noqa: E402
from benchmarks.law_mismatch.protocol import generated  # noqa: E402
from benchmarks.law_mismatch.specimen import logs, specimen  # noqa: E402
from mrfit.errors import MrfitError  # noqa: E402

BASES = ("tanh", "bingham", "boucwen", "hysteretic-biviscous")
REAL = {"press": "press (UTFSM)", "table": "shaking table", "keio": "Keio", "nees": "NEES (seen in development)"}
FOLDS, SEED = 3, 1
RIGS = range(12, 24)
"""Numbers of the planted dampers: those before served to find out why bands fell short."""
Row = dict[str, Any]


def rigs() -> Iterator[tuple[str, list[mrfit.Recording]]]:
    """Yield the base to fit and the records of each planted damper, whose law and drives no development has seen."""
    for number in RIGS:
        (case,) = generated("evaluation", "null", 1, ("bingham",), 1, number)
        made, _ = specimen(case.split, case.family, (), case.seed, case.memory)
        records = [
            mrfit.Recording.from_arrays(
                dt=log.dt, name=f"test{k:02d}", displacement=log.displacement, force=log.force, current=log.current
            )
            for k, log in enumerate(logs(made))
        ]
        yield BASES[number % len(BASES)], records


def judged(records: Sequence[mrfit.Recording], base: str, per: str = "all") -> list[Row]:
    """Return a row for every held-out test: coverage, half-width and error as shares of its measured range."""
    order, rows = np.random.default_rng(SEED).permutation(len(records)), []
    for fold in range(FOLDS):
        held = set(order[fold::FOLDS].tolist())
        train, test = ([r for k, r in enumerate(records) if (k in held) is out] for out in (False, True))
        fit = mrfit.fit(train, base, per=per, holdout="none", optimizer="lsq", progress=False)
        frame = fit.predict(test, progress=False).to_frame()
        for name, one in frame[frame["scored"]].groupby("segment", sort=False):
            span = float(np.ptp(one["measured"]))
            rows.append(
                {
                    "segment": str(name),
                    "samples": len(one),
                    "trained": len(train),
                    "coverage": float(one["measured"].between(one["low"], one["high"]).mean()),
                    "half": float((one["high"] - one["low"]).mean()) / 2.0 / span,
                    "parameters": float((one["high_parameters"] - one["low_parameters"]).mean()) / 2.0 / span,
                    "nrmse": float(np.sqrt(np.mean((one["measured"] - one["simulated"]) ** 2))) / span,
                }
            )
    return rows


def run(name: str) -> dict[str, list[Row]]:
    """Return the rows of a set by base; a base that cannot be fitted to it has none."""
    found: dict[str, list[Row]] = {}
    if name == "planted":
        for base, records in rigs():
            found.setdefault(base, []).extend(judged(records, base))
            sys.stderr.write(f"{base}: {len(found[base])} tests\n")
        return found
    channels, dts, conditions = realsets.load(name)
    records = recordings_of(Asked(channels, dts, "", conditions))
    for base in BASES:
        try:
            found[base] = judged(records, base)
            if name == "press":
                found[f"{base}, each condition by itself"] = judged(records, base, "condition")
        except MrfitError as error:
            sys.stderr.write(f"{name}, {base}: {error}\n")
    return found


def cells(rows: Sequence[Row]) -> list[str]:
    """Return coverage by test and by sample, share of tests ≥ 90 %, median half-width, and that over the error."""
    values = {key: np.array([row[key] for row in rows]) for key in ("coverage", "half", "nrmse")}
    return [
        f"{100.0 * np.mean(values['coverage']):.1f} %",
        f"{100.0 * np.average(values['coverage'], weights=[row['samples'] for row in rows]):.1f} %",
        f"{np.mean(values['coverage'] >= 0.9):.2f}",
        f"{100.0 * np.median(values['half']):.1f} %",
        f"{np.mean(values['half']) / np.mean(values['nrmse']):.1f}",
    ]


def page(found: dict[str, dict[str, list[Row]]], before: dict[str, dict[str, list[Row]]]) -> str:
    """Return the page of all sets."""
    head = ("coverage", "of samples", "tests ≥ 90 %", "half-width", "over error")
    columns = ["set", "base", "tests", "NRMSE", *head, *(f"{h}, before" for h in head if before)]
    lines = ["| " + " | ".join(columns) + " |", "|---" * len(columns) + "|"]
    for name, bases in found.items():
        for base, rows in bases.items():
            error = 100.0 * float(np.median([row["nrmse"] for row in rows]))
            old = before.get(name, {}).get(base, [])
            other = (cells(old) if old else ["–"] * len(head)) if before else []
            about = [REAL.get(name, name), base, str(len(rows)), f"{error:.1f} %"]
            lines.append("| " + " | ".join([*about, *cells(rows), *other]) + " |")
    return "\n".join(lines)


def kept(folder: Path, name: str) -> dict[str, list[Row]]:
    """Return the rows of a set that a folder holds, none where it does not."""
    file = folder / f"{name}.json"
    return dict(json.loads(file.read_text(encoding="utf-8"))) if file.is_file() else {}


def main() -> None:
    """Run what is asked for and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--set", action="append", choices=["planted", *REAL], dest="sets")
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--beside", type=Path)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    found, before = {}, {}
    for name in asked.sets or ["planted", *(REAL if realsets.available() else ())]:
        found[name] = (kept(asked.keep, name) if asked.keep else {}) or run(name)
        if asked.keep:
            asked.keep.mkdir(parents=True, exist_ok=True)
            (asked.keep / f"{name}.json").write_text(json.dumps(found[name]), encoding="utf-8")
        before[name] = kept(asked.beside, name) if asked.beside else {}
    deliver(page(found, before if asked.beside else {}) + "\n", asked.out)


if __name__ == "__main__":
    main()
