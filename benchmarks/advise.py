"""Advised tests, closed loop: discover, let mrfit advise, make the advised tests on the rig, discover again.

python -m benchmarks.advise [--jobs 2] [--count N] [--first K] [--match TEXT] [--keep DIR] [--out FILE.md]

The cases are those of the discovery benchmark that cannot be told apart, and a damper without a spring at one
frequency. The rig makes exactly
the two drives that ``mrfit advise`` wrote, the test and its companion; nothing else is told to it. Then the logs are
read and discovered as before, with what is held out chosen by ``mrfit segment`` alone.
"""

import argparse
import json
import sys
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.command import deliver
from benchmarks.discovery.protocol import Case, case, untellable
from benchmarks.discovery.runner import command
from datasets.rig import coil_bench, damper_bench, flux_coil
from datasets.rig.case import Hidden, make
from datasets.rig.damper import Motion, base_damper, plain_damper, simulate
from datasets.rig.effects import size
from datasets.rig.flux_coil import base_coil
from datasets.rig.press import DRIVER_LAG, OVERSAMPLING
from datasets.rig.stop import Array
from mrfit.io.keys import code_version

# Oil on a bench that is not warmed, and the range of the climatic chamber, in degC
OIL = 25.0
CHAMBER = (18.0, 52.0)
RIGS = {
    "damper": "seconds = 10\nstroke = '50 mm'\nspeed = 0.2\nacceleration = 8\nfrequency = 7\nforce = 4000\n"
    f"current = 2.8\ntemperature = [{CHAMBER[0]:g}, {CHAMBER[1]:g}]\n",
    "coil": "seconds = 10\ncurrent = 5\nfrequency = [1, 40]\nsampling = 2500\n",
}
ADVISED = ("test-1.csv", "companion.csv")
# What a damper without a spring of its own does not show apart at one frequency, beside the discovery benchmark's cases
PLAIN = ("inertia", "gas-spring", "delay")


@dataclass(frozen=True)
class Outcome:
    """What came of a case: verdicts and names before and after the advised tests, the advice, seconds of each command.

    Attributes
    ----------
    rivals
        What was to be separated.
    least
        Standard errors that the advice promised between the two nearest.
    """

    name: str
    truth: str
    before: str
    after: str
    named_before: list[str] = field(default_factory=list)
    named_after: list[str] = field(default_factory=list)
    rivals: list[str] = field(default_factory=list)
    tests: list[str] = field(default_factory=list)
    least: float = 0.0
    driven: float = 0.0
    seconds: float = 0.0
    error: str = ""

    @property
    def told(self) -> bool:
        """Whether the truth, and nothing else, was named before the advised tests."""
        return self.named_before == [self.truth]

    @property
    def separated(self) -> bool:
        """Whether it is after them."""
        return self.named_after == [self.truth]

    @property
    def wrong(self) -> bool:
        """Whether something is named that is not there."""
        return bool(set(self.named_after) - {self.truth})


def read_drive(path: Path) -> dict[str, Array]:
    """Return the columns of a drive by the channel's name."""
    lines = path.read_text(encoding="utf-8").splitlines()
    names = [cell.partition(" [")[0] for cell in lines[0].split(",")]
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    return dict(zip(names, values.T, strict=True))


def run_damper(hidden: Hidden, drive: Mapping[str, Array], name: str, folder: Path, number: int) -> None:
    """Make a drive on the press of a case and write its log."""
    draw = base_damper if hidden.bench == "damper" else plain_damper
    damper = draw(np.random.default_rng([hidden.seed, 1]))
    interval = float(drive["time"][1])
    time = np.arange(len(drive["time"]) * OVERSAMPLING) * interval / OVERSAMPLING
    path = CubicSpline(drive["time"], drive["displacement"])
    wanted = np.interp(time, drive["time"], drive["current"])
    keep = float(np.exp(-interval / OVERSAMPLING / DRIVER_LAG))
    current = np.empty_like(wanted)
    current[0] = wanted[0]
    for n in range(1, len(wanted)):
        current[n] = wanted[n] + (current[n - 1] - wanted[n]) * keep
    # a specimen is brought to a temperature before it is driven: each level of the chamber is a run of its own
    levels = drive.get("temperature", np.full(len(drive["time"]), OIL))
    ends = [0, *(np.flatnonzero(np.diff(levels)) + 1), len(levels)]
    parts = []
    for first, last in zip(ends[:-1], ends[1:], strict=True):
        own = slice(first * OVERSAMPLING, last * OVERSAMPLING)
        x, v, a, i = (r[own][None] for r in (path(time), path(time, 1), path(time, 2), current))
        motion = Motion(interval / OVERSAMPLING, x, v, a, i, np.array([levels[first]]))
        true = simulate(damper, hidden.effects, motion)
        parts.append((motion, true))
    joined = [np.hstack([row(m, t)[:, ::OVERSAMPLING] for m, t in parts]) for row in _SEEN]
    record = damper_bench.DamperRecord([name], interval, *joined)
    damper_bench.save(record, folder, hidden.style, np.random.default_rng([hidden.seed, 10 + number]))


_SEEN = (
    lambda m, t: m.position,
    lambda m, t: m.speed,
    lambda m, t: t.force,
    lambda m, t: m.current,
    lambda m, t: t.temperature,
)


def run_coil(hidden: Hidden, drive: Mapping[str, Array], name: str, folder: Path, number: int) -> None:
    """Make a drive on the coil of a case, by the voltage that a nominal coil would take, and write its log."""
    coil = base_coil(np.random.default_rng([hidden.seed, 1]))
    interval = float(drive["time"][1])
    steps = len(drive["time"]) * coil_bench.OVERSAMPLING
    half = np.arange(2 * steps + 1) * interval / (2 * coil_bench.OVERSAMPLING)
    current = CubicSpline(drive["time"], drive["current"])
    inside = np.minimum(half, drive["time"][-1])
    resistance = coil.resistance + coil.output_resistance
    emf = (resistance * current(inside) + coil_bench.NOMINAL_INDUCTANCE * current(inside, 1))[None]
    step = np.array([interval / coil_bench.OVERSAMPLING])
    true = flux_coil.solve(coil, flux_coil.Effects.of(hidden.effects), emf, step, keep=1)
    seen = coil_bench.clamped(true.current, hidden.effects, step)
    drift = hidden.effects.get("integrator-offset", 0.0) * step[:, None] * np.arange(true.flux.shape[1])
    kept = slice(0, steps, coil_bench.OVERSAMPLING)
    record = coil_bench.CoilRecord(
        [Named(name)],
        np.array([interval]),
        true.voltage[:, kept],
        seen[:, kept],
        (true.flux + drift)[:, kept],
    )
    coil_bench.save(record, folder, hidden.style, np.random.default_rng([hidden.seed, 10 + number]))


class Named(coil_bench.Drive):
    """A drive that is called as it is told."""

    def __init__(self, name: str) -> None:
        super().__init__(name, 0.0, 0.0)

    @property
    def name(self) -> str:
        """File name without its ending."""
        return self.shape


def closed_loop(one: Case, folder: Path) -> Outcome:
    """Discover, be advised, make the advised tests, discover again."""
    make(one.hidden, folder)
    logs, work, rig = folder / "logs", str(folder / "work"), folder / "rig.toml"
    bench = "coil" if one.hidden.bench.endswith("coil") else "damper"
    rig.write_text(f"[rig]\n{RIGS[bench]}", encoding="utf-8")
    (truth,) = one.inside
    began = time.perf_counter()
    command("ingest", str(logs), "--work", work)
    before = json.loads(command("discover", "--work", work, "--model", one.model, "--json"))
    known = {
        "name": one.name,
        "truth": truth,
        "before": before["verdict"],
        "named_before": [e["name"] for e in before["effects"]],
    }
    try:
        advice = json.loads(command("advise", "--work", work, "--rig", str(rig), "--json"))
    except RuntimeError as error:
        return Outcome(**known, after="", error=str(error), seconds=time.perf_counter() - began)
    run = run_coil if bench == "coil" else run_damper
    driven = [name for name in ADVISED if (folder / "work" / "advise" / name).is_file()]
    for number, name in enumerate(driven):
        run(one.hidden, read_drive(folder / "work" / "advise" / name), f"advised_{'ab'[number]}", logs, number)
    again = str(folder / "again")
    command("ingest", str(logs), "--work", again)
    after = json.loads(command("discover", "--work", again, "--model", one.model, "--json"))
    apart = [k for k, p in enumerate(advice["pairs"]) if p["separable"]]
    tests = [advice["tests"][0], *([advice["companion"]] if advice["companion"] else [])]
    return Outcome(
        **known,
        after=after["verdict"],
        named_after=[e["name"] for e in after["effects"]],
        rivals=advice["rivals"],
        tests=[t["text"] for t in tests],
        least=min((tests[0]["distances"][k] for k in apart), default=0.0),
        driven=sum(t["seconds"] + t["waiting"] for t in tests),
        seconds=time.perf_counter() - began,
    )


def kept_loop(one: Case, keep: Path | None) -> Outcome:
    """Return the outcome of a case, or what an earlier run of the same code left in ``keep``."""
    path = keep and keep / code_version() / f"{one.name}.json"
    if path and path.exists():
        return Outcome(**json.loads(path.read_text(encoding="utf-8")))
    with TemporaryDirectory() as folder:
        found = closed_loop(one, Path(folder) / one.name)
    if path and not found.error:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(found), indent=1), encoding="utf-8")
    return found


def document(outcomes: list[Outcome]) -> str:
    """Return the table and the figures."""
    open_before = [o for o in outcomes if not o.told]
    stated = [o for o in outcomes if o.before == "ambiguous"]
    separated = sum(o.separated for o in open_before)
    right = sum(o.separated for o in outcomes)
    wrong = sum(o.wrong for o in outcomes)
    lines = [
        "# Advised tests, closed loop",
        "",
        "Cases that the tests made so far cannot tell apart or cannot show: discovered, advised, the two advised",
        "drives made on the rig, discovered again. `python -m benchmarks.advise`.",
        "",
        "| figure | of | |",
        "|---|---|---|",
        f"| not told by the data there were, named rightly after the advised tests | {len(open_before)} | "
        f"{separated} |",
        f"| of these stated as a set (`ambiguous`) | {len(stated)} | {sum(o.separated for o in stated)} |",
        f"| all cases: named rightly after the advised tests | {len(outcomes)} | {right} |",
        f"| a wrong name after the advised tests | {len(outcomes)} | {wrong} |",
        "",
        "| case | before | rivals | advised tests | least distance | seconds driven | after | wall s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for o in outcomes:
        before = f"{o.before} {', '.join(o.named_before)}".strip()
        after = o.error or f"{o.after} {', '.join(o.named_after)}".strip()
        lines.append(
            f"| {o.name} | {before} | {', '.join(o.rivals)} | {'; '.join(o.tests)} | {o.least:.3g} | {o.driven:.3g} | "
            f"{after} | {o.seconds:.0f} |"
        )
    return "\n".join(lines) + "\n"


def plain(repeats: int) -> list[Case]:
    """Return effects of a damper without a spring, at one frequency: these a discovery states as a set."""
    return [
        case("plain", "strong", Hidden("plain-damper", "one-frequency", {name: size(name, "strong")}), k)
        for name in PLAIN
        for k in range(repeats)
    ]


def cases_of(count: int, first: int, match: str) -> list[Case]:
    """Return so many repeats of every kind of case from one on, those whose names hold a text."""
    whole = [*untellable(first + count), *plain(first + count)]
    found = [c for c in whole if int(c.name.rpartition("_")[2]) >= first]
    return [c for c in found if match in c.name]


def main() -> int:
    """Run the cases and write the table."""
    parser = argparse.ArgumentParser(prog="benchmarks.advise", description="Advised tests, closed loop.")
    parser.add_argument("--jobs", type=int, default=1, help="cases at a time")
    parser.add_argument("--count", type=int, default=3, help="repeats of each kind of case")
    parser.add_argument("--first", type=int, default=0, help="the first repeat; every repeat has seeds of its own")
    parser.add_argument("--match", default="", help="only cases whose name holds this text")
    parser.add_argument("--keep", type=Path, help="folder of finished cases: a later run goes on from there")
    parser.add_argument("--out", type=Path, help="Markdown file to write; default: standard output")
    chosen = parser.parse_args()
    cases = cases_of(chosen.count, chosen.first, chosen.match)
    outcomes = []
    with ThreadPoolExecutor(chosen.jobs) as pool:
        for found in pool.map(lambda c: kept_loop(c, chosen.keep), cases):
            outcomes.append(found)
            sys.stderr.write(
                f"{found.name}: {found.before} {found.named_before} -> {found.after} {found.named_after} {found.error}"
                f" {found.tests} ({found.seconds:.0f} s)\n"
            )
    text = document(outcomes)
    deliver(text, chosen.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
