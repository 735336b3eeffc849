"""Fits and discovery where the drive's amplitude differs from cycle to cycle.

python -m benchmarks.cycle_repeat [--source NAME=FOLDER …] [--seeds 2] [--discover] [--out FILE.md]

Nothing is hidden in the logs: a voltage-driven coil (boucwen-flux, eleven tests) and a damper at 1.4 A (tanh, four
sines), with white noise, their drive's amplitude modulated by a slow beat, by one random factor a cycle or by a ramp.
A source is a checkout whose mrfit is run on the same logs, so that two versions stand side by side; default: this one.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from datasets.rig import coil_bench, damper_bench, press
from datasets.rig.damper import base_damper
from datasets.rig.envelope import KINDS, envelope
from datasets.rig.flux_coil import base_coil
from datasets.rig.refit import rebuilt_flux
from datasets.rig.style import Style
from mrfit.simulate.assembly import assemble

DEPTHS = (0.001, 0.003, 0.01, 0.03)
DISCOVERED = 0.01
# Seeds that no threshold was set on
FIRST_SEED = 501
CURRENT = 1.4
SINES = ((1.0, 0.020), (2.0, 0.010), (4.0, 0.006), (6.0, 0.004))
MODEL = {"coil": "boucwen-flux", "damper": "tanh"}
QUANTITIES = {"coil": "derived", "damper": "parameters"}


@dataclass(frozen=True, slots=True)
class Test:
    """What is run: the rig, the kind of modulation, its depth, a seed."""

    rig: str
    kind: str
    depth: float
    seed: int


@dataclass(frozen=True, slots=True)
class Truth:
    """Rms of the noise in the output, in its unit, and the true value of each quantity."""

    noise: float
    values: Mapping[str, float]


def tests(seeds: int) -> list[Test]:
    """Return all tests; without any modulation there is one for each rig and seed."""
    kinds = [("none", 0.0), *((k, d) for k in KINDS for d in DEPTHS)]
    return [Test(rig, k, d, FIRST_SEED + s) for rig in MODEL for k, d in kinds for s in range(seeds)]


def make(test: Test, folder: Path) -> Truth:
    """Write the logs of a test and return what is true of them."""
    folder.mkdir(parents=True)
    return _coil(test, folder) if test.rig == "coil" else _damper(test, folder)


def _coil(test: Test, folder: Path) -> Truth:
    coil, rng = base_coil(np.random.default_rng([test.seed, 1])), np.random.default_rng([test.seed, 3])
    drives = coil_bench.PROGRAMMES["rich"]()
    if test.depth:
        drives = [replace(d, envelope=envelope(test.kind, test.depth, coil_bench.PERIODS, rng)) for d in drives]
    record = coil_bench.run(coil, {}, drives)
    voltage, current = coil_bench.save(record, folder, Style(), np.random.default_rng([test.seed, 2]))
    (folder / "mrfit.toml").write_text(coil_bench.channel_map(coil.resistance, Style()), encoding="utf-8")
    clean = rebuilt_flux(record.voltage, record.current, record.interval, coil.resistance)
    noisy = rebuilt_flux(record.voltage + voltage, record.current + current, record.interval, coil.resistance)
    iron, assembly = coil.iron, assemble(MODEL["coil"])
    theta = np.array([[getattr(iron, n) for n in assembly.spec.names]])
    values = dict(zip((d.name for d in assembly.spec.derived), assembly.derived(theta)[0].tolist(), strict=True))
    return Truth(float(np.sqrt(np.mean((noisy - clean) ** 2))), values)


def _damper(test: Test, folder: Path) -> Truth:
    damper, rng = base_damper(np.random.default_rng([test.seed, 1])), np.random.default_rng([test.seed, 3])
    programmes = [
        press.Programme(f"sine_{f:g}Hz_{1e3 * x:g}mm", press.sine(f, x), press.held(CURRENT), press.WARM_OIL)
        for f, x in SINES
    ]
    if test.depth:
        programmes = [
            replace(p, envelope=envelope(test.kind, test.depth, p.motion[1][0] * press.SECONDS, rng))
            for p in programmes
        ]
    record = damper_bench.run(damper, {}, programmes)
    noise = damper_bench.save(record, folder, Style(), np.random.default_rng([test.seed, 2]))
    powers = CURRENT ** np.arange(3)
    values = {
        "fy": float(powers @ damper.yields),
        "a1": 1.0 / damper.knee,
        "a2": damper.turn / damper.knee,
        "c": float(powers @ damper.viscous),
        "k": damper.stiffness,
        "f0": damper.offset,
    }
    return Truth(float(np.sqrt(np.mean(noise**2))), values)


def run(source: Path, work: Path, *words: str) -> str:
    """Run a checkout's mrfit in a workspace, on one thread a library, and return what it prints."""
    environment = os.environ | {"PYTHONPATH": str(source), "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "mrfit.cli", *words, "--work", str(work)]
    return subprocess.run(command, check=True, capture_output=True, text=True, cwd=source, env=environment).stdout


def fitted(source: Path, test: Test, logs: Path, work: Path, truth: Truth) -> dict[str, float]:
    """Return how a fit of one set of parameters to all logs compares with the truth."""
    run(source, work, "ingest", *(str(p) for p in sorted(logs.glob("*.csv"))))
    run(source, work, "segment", "--holdout", "none")
    began = time.perf_counter()
    fit = json.loads(run(source, work, "fit", "--model", MODEL[test.rig], "--per", "all", "--json"))
    seconds = time.perf_counter() - began
    (total,) = [m for m in fit["metrics"] if m["condition"] == "all"]
    rows = [r for r in fit["results"][0][QUANTITIES[test.rig]] if r["name"] in truth.values and r["identifiable"]]
    known = [r for r in rows if r["low"] is not None and r["high"] is not None and r["high"] > r["low"]]
    off = [abs(truth.values[r["name"]] - r["value"]) / (0.5 * (r["high"] - r["low"])) for r in known]
    held = [r["low"] <= truth.values[r["name"]] <= r["high"] for r in known]
    return {
        "error": total["rmse"] / truth.noise,
        "floor": float("nan") if total["noise_floor"] is None else total["noise_floor"] / truth.noise,
        "worst": max(off, default=float("nan")),
        "held": float(sum(held)),
        "known": float(len(held)),
        "seconds": seconds,
    }


def discovered(source: Path, test: Test, logs: Path, work: Path) -> str:
    """Return a discovery's verdict, with the effects it names."""
    run(source, work, "ingest", *(str(p) for p in sorted(logs.glob("*.csv"))))
    found = json.loads(run(source, work, "discover", "--model", MODEL[test.rig], "--json"))
    return " ".join([found["verdict"], *(e["name"] for e in found["effects"])])


def measured(
    chosen: Sequence[Test], sources: Mapping[str, Path], discover: bool
) -> Iterator[tuple[Test, str, dict[str, Any]]]:
    """Yield test, source and what came of it."""
    for test in chosen:
        with TemporaryDirectory() as place:
            truth = make(test, Path(place) / "logs")
            for name, source in sources.items():
                work = Path(place) / name
                found: dict[str, Any] = dict(fitted(source, test, Path(place) / "logs", work, truth))
                if discover and test.seed == FIRST_SEED and test.depth in (0.0, DISCOVERED):
                    found["verdict"] = discovered(source, test, Path(place) / "logs", Path(place) / f"{name}-discover")
                sys.stderr.write(f"{test} {name}: {found}\n")
                yield test, name, found


def table(rows: Sequence[tuple[Test, str, dict[str, Any]]], sources: Sequence[str]) -> str:
    """Return the Markdown table, medians over the seeds."""
    heads = ["rig", "modulation", "depth, %"]
    for name in sources:
        heads += [f"{name}: {what}" for what in ("error", "own floor", "worst parameter", "held", "time, s", "verdict")]
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
    for rig, kind, depth in dict.fromkeys((t.rig, t.kind, t.depth) for t, _, _ in rows):
        cells = [rig, kind, f"{100 * depth:g}"]
        for source in sources:
            found = [f for t, name, f in rows if (t.rig, t.kind, t.depth, name) == (rig, kind, depth, source)]
            middle = {k: median(f[k] for f in found) for k in ("error", "floor", "worst", "seconds")}
            held, known = (int(sum(f[k] for f in found)) for k in ("held", "known"))
            own = f"{middle['floor']:.2f}" if np.isfinite(middle["floor"]) else "not known"
            cells += [f"{middle['error']:.2f}", own, f"{middle['worst']:.2f}", f"{held}/{known}"]
            cells += [f"{middle['seconds']:.1f}", next((f["verdict"] for f in found if "verdict" in f), "")]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


ABOUT = """\
# Cycles whose amplitude differs

`python -m benchmarks.cycle_repeat`: nothing is hidden in these logs. *error*: RMS error of one joint fit over the RMS
of the noise that was added to the output. *own floor*: the noise floor that mrfit reports over the same. *worst
parameter*: largest error of a determined quantity over half its 95 % interval. *held*: true values within their
intervals. *time*: the whole `fit` command. *verdict*: of `discover` on one seed. Medians over {seeds} seeds that no
threshold was set on.

"""


def main() -> None:
    """Run all tests and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--source", action="append", default=[], help="NAME=FOLDER of a checkout; default: this one")
    parser.add_argument("--seeds", type=int, default=2, help="seeds of each test (%(default)s)")
    parser.add_argument("--discover", action="store_true", help="also discover, without modulation and at 1 %%")
    parser.add_argument("--match", default="", help="only tests of this rig")
    parser.add_argument("--out", type=Path, help="Markdown file to write; default: standard output")
    options = parser.parse_args()
    named = [text.partition("=") for text in options.source] or [("mrfit", "=", str(Path(__file__).parent.parent))]
    sources = {name: Path(folder).resolve() for name, _, folder in named}
    chosen = [t for t in tests(options.seeds) if options.match in t.rig]
    rows = list(measured(chosen, sources, options.discover))
    text = ABOUT.format(seeds=options.seeds) + table(rows, list(sources))
    if options.out:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)


if __name__ == "__main__":
    main()
