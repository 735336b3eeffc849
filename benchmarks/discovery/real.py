"""Discovery on real records: what it says of them as they are, and whether it finds what is planted in their force.

python -m benchmarks.discovery.real [--set press] [--jobs 2] [--keep DIR] [--out FILE.md], with MRFIT_REAL_LOGS set.

Planted are a delay, a gain that drifts over the record, and a first-order lag of the force's sensor, which is a delay
of another form. A real record has faults of its own: what the base fitted together with the effect, in the shape in
which it was found, makes of the record as it is, is taken off. An effect counts as found if its value is then that
planted within a quarter, or half a millisecond (of a lag, within half: behind a lag of the record's own it is a filter
of second order, for which the effect has one lag only), and it is named, stands in a stated set, or is said to take
part of a gap that stays unexplained; the table says which.
"""

import argparse
import json
import os
import sys
import tomllib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from benchmarks.command import deliver
from benchmarks.discovery.runner import command
from mrfit.cli.catalog import read_catalog
from mrfit.core.registry import load
from mrfit.core.specs import Array
from mrfit.io.keys import code_version
from mrfit.io.workspace import Workspace, write_json

TOLERANCE, TOLERANCE_OF_LAG, LEAST_ERROR = 0.25, 0.5, 0.5e-3
UNITS = {"displacement": "m", "velocity": "m/s", "force": "N", "current": "A"}


@dataclass(frozen=True, slots=True)
class Records:
    """A set of real logs: their files, how to read them, into how many pieces to cut each, base model, hold-out."""

    files: str
    channel_map: str
    pieces: int
    model: str
    holdout: str = "auto"


@dataclass(frozen=True, slots=True)
class Plant:
    """What is hidden in the force: the effect that should be found, its parameter's true value, how it is made."""

    name: str
    effect: str
    value: float
    make: Callable[[Array, float], Array] | None = None
    tolerance: float = TOLERANCE


SETS = {
    "press": Records(
        "mr_damper_utfsm/preprocessed/*.txt",
        read_catalog()["mr_damper_utfsm"].map,
        1,
        # the travel over which the loop of boucwen turns imitates a delay: its strokes have one frequency each
        "tanh",
    ),
    "keio": Records(
        "mr_damper_sano_keio/Magneto.mat",
        'dt = 0.005\n[channels]\nvelocity = {column = ["U", "U_val"], unit = "cm/s"}\n'
        'force = {column = ["Y", "Y_val"], scale = -1.0, unit = "N"}\n',
        1,
        "lugre",
        "after=5",
    ),
    "dyke": Records(
        "mr_damper_nees_dyke/ranran_50_converted.csv",
        '[channels]\ndisplacement = {column = "D", unit = "cm"}\nvelocity = {column = "V", unit = "cm/s"}\n'
        'force = {column = "F", unit = "N"}\ncurrent = {column = "Y", unit = "A"}\n',
        # long enough for a drift to show; the last is held out
        4,
        "boucwen",
        "random-4.6mm",
    ),
}


def _delayed(force: Array, dt: float, seconds: float) -> Array:
    places = np.arange(len(force), dtype=np.float64)
    return np.interp(places - seconds / dt, places, force)


def _lagged(force: Array, dt: float, seconds: float) -> Array:
    keep = np.exp(-dt / seconds)
    lagged, _ = lfilter([1.0 - keep], [1.0, -keep], force, zi=[keep * force[0]])
    return np.asarray(lagged, dtype=np.float64)


def _drifting(force: Array, dt: float, rate: float) -> Array:
    drifted: Array = force * (1.0 + rate * dt * np.arange(len(force)))
    return drifted


PLANTS = (
    Plant("as it is", "", 0.0),
    *(Plant(f"delay {1e3 * s:g} ms", "delay", s, partial(_delayed, seconds=s)) for s in (-10e-3, 10e-3, 15e-3)),
    *(
        Plant(f"lag {1e3 * s:g} ms", "delay", s, partial(_lagged, seconds=s), TOLERANCE_OF_LAG)
        for s in (10e-3, 15e-3, 20e-3)
    ),
    *(Plant(f"gain drift {r:g} 1/s", "gain-drift", r, partial(_drifting, rate=r)) for r in (-0.05, 0.05, 0.1)),
)


def write_logs(records: Records, plant: Plant, folder: Path) -> None:
    """Write the records with the planted effect to ``folder`` as SI tables, cut into pieces."""
    source = Path(os.environ["MRFIT_REAL_LOGS"])
    channel_map = folder.parent / "real.toml"
    channel_map.write_text(records.channel_map, encoding="utf-8")
    work = folder.parent / "read"
    files = sorted(str(f) for f in source.glob(records.files))
    command("ingest", *files, "--work", str(work), "--map", str(channel_map))
    folder.mkdir()
    workspace = Workspace(work)
    for row in workspace.ingest_summary().recordings:
        recording = workspace.read_recording(row.id)
        length = recording.samples // records.pieces
        for k in range(records.pieces):
            piece = {n: v[k * length : (k + 1) * length] for n, v in recording.channels.items() if n in UNITS}
            if plant.make is not None:
                piece["force"] = plant.make(piece["force"], recording.dt)
            logged = pd.DataFrame({f"{n} ({UNITS[n]})": v for n, v in piece.items()})
            logged.insert(0, "time (s)", np.arange(length) * recording.dt)
            logged.to_csv(folder / f"{recording.id}-{k:02d}.csv", index=False)


def prepared(name: str, plant: Plant, folder: Path) -> str:
    """Return a workspace under ``folder`` with the segments of a set of records in which an effect is planted."""
    logs, work = folder / "logs", str(folder / "work")
    write_logs(SETS[name], plant, logs)
    pattern = tomllib.loads(SETS[name].channel_map).get("pattern")
    command("ingest", str(logs), "--work", work, *(["--pattern", pattern] if pattern else []))
    command("segment", "--work", work, "--holdout", SETS[name].holdout)
    return work


def discover(name: str, plant: Plant, keep: Path | None) -> dict[str, Any]:
    """Return the discovery.json of a set of records with an effect planted, or what the same code kept of it."""
    file = f"{name} {plant.name}.json".replace(" ", "_").replace("/", "_")
    kept = keep / code_version() / file if keep else None
    if kept and kept.exists():
        return dict(json.loads(kept.read_text(encoding="utf-8")))
    with TemporaryDirectory() as folder:
        work = prepared(name, plant, Path(folder))
        found: dict[str, Any] = json.loads(command("discover", "--work", work, "--model", SETS[name].model, "--json"))
    if kept:
        write_json(kept, found)
    return found


def parameters_of(found: dict[str, Any], effect: str) -> dict[str, float]:
    """Return the parameters a discovery gives for an effect that it names or suspects; none for any other."""
    rows = [e for e in (*found["effects"], *found.get("suspects", [])) if e["name"] == effect]
    return {str(p["name"]): float(p["value"]) for p in rows[0]["parameters"]} if rows else {}


def own_value(name: str, work: Path, effect: str, found: dict[str, float]) -> float:
    """Return what the base, fitted with an effect in the shape found, makes of the records as they are."""
    shapes = [p.name for p in load("effect", effect).SPEC.params if p.role == "shape"]
    fixed = [word for s in shapes for word in ("--fix", f"{effect}.{s}={found[s]!r}")]
    command("fit", "--work", str(work), "--model", f"{SETS[name].model}+{effect}", "--per", "all", *fixed)
    fitted = json.loads((work / "fits" / f"{SETS[name].model}+{effect}.auto.all" / "fit.json").read_text("utf-8"))
    (group,) = fitted["results"]
    return next(float(p["value"]) for p in group["parameters"] if p["name"].startswith(f"{effect}."))


def is_found(name: str, work: Path, plant: Plant, found: dict[str, Any]) -> bool:
    """Return whether a planted effect was found, beyond what the record as it is, in ``work``, has of its own."""
    values = parameters_of(found, plant.effect)
    if plant.make is None or not values:
        return False
    least = LEAST_ERROR if plant.effect == "delay" else 0.0
    error = abs(next(iter(values.values())) - own_value(name, work, plant.effect, values) - plant.value)
    return error <= max(plant.tolerance * abs(plant.value), least)


def rows(name: str, jobs: int, keep: Path | None) -> Iterator[tuple[Plant, dict[str, Any], bool]]:
    """Yield for every plant in a set of records what was discovered and whether it was found."""
    with ThreadPoolExecutor(jobs) as pool:
        results = list(pool.map(lambda p: discover(name, p, keep), PLANTS))
    with TemporaryDirectory() as folder:
        work = Path(prepared(name, PLANTS[0], Path(folder)))
        for plant, found in zip(PLANTS, results, strict=True):
            yield plant, found, is_found(name, work, plant, found)


def _values(effect: dict[str, Any]) -> str:
    return ", ".join(f"{p['name']} {p['value']:.4g} {p['unit']}" for p in effect["parameters"])


def table(name: str, outcomes: list[tuple[Plant, dict[str, Any], bool]]) -> str:
    """Return one set's results as a Markdown table."""
    lines = [
        f"## {name}: base {SETS[name].model}",
        "",
        "| planted | found | verdict | named, or suspected | held-out NRMSE before, after, floor |",
        "|---|---|---|---|---|",
    ]
    for plant, found, right in outcomes:
        named = [f"{e['name']} ({_values(e)})" for e in found["effects"]]
        part = [f"part: {e['name']} ({_values(e)})" for e in found.get("suspects", [])]
        gap = [found["gap"].get(k) for k in ("before", "after", "noise_floor")]
        shown = ", ".join("–" if g is None else f"{g:.4f}" for g in gap)
        said = "–" if plant.make is None else "yes" if right else "no"
        lines.append(f"| {plant.name} | {said} | {found['verdict']} | {'; '.join([*named, *part]) or '–'} | {shown} |")
    planted = [right for plant, _, right in outcomes if plant.make is not None]
    return "\n".join([*lines, "", f"{sum(planted)} of {len(planted)} planted effects found.", ""])


def main() -> int:
    """Run the chosen sets; print or write a Markdown document."""
    parser = argparse.ArgumentParser(prog="benchmarks.discovery.real", description="Discovery on real records.")
    parser.add_argument("--set", choices=sorted(SETS), action="append", help="only these records")
    parser.add_argument("--jobs", type=int, default=1, help="discoveries at a time")
    parser.add_argument("--keep", type=Path, help="folder of finished discoveries: a later run goes on from there")
    parser.add_argument("--out", type=Path, help="Markdown file to write; default: standard output")
    options = parser.parse_args()
    if "MRFIT_REAL_LOGS" not in os.environ:
        sys.stderr.write("MRFIT_REAL_LOGS does not name the folder of real logs: nothing to do\n")
        return 2
    parts = [table(n, list(rows(n, options.jobs, options.keep))) for n in options.set or sorted(SETS)]
    text = "# Discovery on real records\n\n" + "\n".join(parts)
    deliver(text, options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
