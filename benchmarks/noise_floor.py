"""Estimated over true noise floor: ``python -m benchmarks.noise_floor [--seeds 2] [--out FILE.md]`` (half an hour).

Drives that a test bench runs, three generating laws of which two are not in the library, noise of four colours,
quantised outputs and dropouts that were filled in. ``before`` is the estimate from high frequencies and, for what the
library takes for cycles, from the cycles. Seeds below 200 were used in
development.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse  # noqa: E402
from collections import defaultdict  # noqa: E402
from collections.abc import Sequence  # noqa: E402
from dataclasses import dataclass  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

from benchmarks.noise_floor_cases import DRIVES, LAWS, LEVELS, NOISES, Case  # noqa: E402
from mrfit.core.recording import Recording, Segment  # noqa: E402
from mrfit.core.specs import Array  # noqa: E402
from mrfit.segment.detect import detect  # noqa: E402
from mrfit.signal.noise import noise_floor  # noqa: E402
from mrfit.signal.output_floor import output_floors  # noqa: E402
from mrfit.signal.smoothing import smooth  # noqa: E402

FIRST_SEED = 200
# Estimates within this factor of the truth are right, below this share of it they do harm
FACTOR, HARMFUL = 1.3, 0.7


@dataclass(frozen=True)
class Outcome:
    """Estimated over true floor of one record, before and now; nan where it is said not to be known, and how."""

    case: Case
    before: float
    now: float
    bounds: tuple[float, float]
    method: str


def judge(case: Case) -> Outcome | None:
    """Return how one case is estimated, None where no segment is found."""
    record, noise, kept = case.made()
    segments = detect(record, "displacement", 2, 1, 0.02).segments
    segments = tuple(s for s in segments if np.any(kept[s.start : s.stop]))
    if not segments:
        return None
    outputs = [record.channels["force"][s.start : s.stop] for s in segments]
    floors = output_floors(segments, {record.id: record}, outputs)
    true = [_rms(noise[s.start : s.stop][kept[s.start : s.stop]]) for s in segments]
    before = [former(record, s, y) for s, y in zip(segments, outputs, strict=True)]
    counts = np.array([s.samples for s in segments], dtype=np.float64)
    known = np.array([f.known for f in floors])
    now = np.nan
    if counts[known].sum() > 0.5 * counts.sum():
        now = _pooled([f.value for f in floors], counts * known) / _pooled(true, counts * known)
    ends = [_pooled([getattr(f, end) for f in floors], counts) / _pooled(true, counts) for end in ("low", "high")]
    methods = "+".join(sorted({f.method for f in floors}))
    return Outcome(case, _pooled(before, counts) / _pooled(true, counts), now, (ends[0], ends[1]), methods)


def former(record: Recording, segment: Segment, output: Array) -> float:
    """Return the floor by cycles where the Fourier series of the drive leaves noise, and from high frequencies else."""
    periodic = smooth(record, segment, ("displacement",)).fits is not None
    frequency = segment.frequency if periodic else 0.0
    return noise_floor(output, record.dt, frequency, segment.cycles, trending=True)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _pooled(values: Sequence[float], counts: Array) -> float:
    used = counts > 0.0
    return float(np.sqrt(np.average(np.square(values)[used], weights=counts[used])))


def table(outcomes: Sequence[Outcome], group: str) -> list[str]:
    """Return the rows of a Markdown table, one for every value of a case's attribute."""
    groups: dict[str, list[Outcome]] = defaultdict(list)
    for one in outcomes:
        groups[str(getattr(one.case, group))].append(one)
    head = f"| {group} | records | before: median (range) | within {FACTOR} | not known | now: median (range) | within"
    rows = [f"{head} {FACTOR} | below {HARMFUL} |", "|---|---|---|---|---|---|---|---|"]
    for name, members in [*groups.items(), ("all", list(outcomes))]:
        before, now = np.array([o.before for o in members]), np.array([o.now for o in members])
        known = now[np.isfinite(now)]
        rows.append(
            f"| {name} | {len(members)} | {_spread(before)} | {_share(before)} | {np.mean(~np.isfinite(now)):.0%} | "
            f"{_spread(known)} | {_share(known)} | {np.sum(known < HARMFUL)} |"
        )
    return rows


def _spread(ratios: Array) -> str:
    if not len(ratios):
        return "–"
    return f"{np.median(ratios):.2f} ({ratios.min():.2f} to {ratios.max():.3g})"


def _share(ratios: Array) -> str:
    if not len(ratios):
        return "–"
    return f"{np.mean((ratios < FACTOR) & (ratios > 1.0 / FACTOR)):.0%}"


def main() -> None:
    """Judge all cases and print or write the tables."""
    parser = argparse.ArgumentParser(prog="benchmarks.noise_floor")
    parser.add_argument("--seeds", type=int, default=2, help="records of each kind")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed; below 200 are development's")
    parser.add_argument("--drives", default=",".join(DRIVES))
    parser.add_argument("--noises", default=",".join(NOISES))
    parser.add_argument("--every", action="store_true", help="print every record")
    parser.add_argument("--out", type=Path, help="Markdown file to write")
    options = parser.parse_args()
    outcomes = []
    for drive in options.drives.split(","):
        for noise in options.noises.split(","):
            for law in LAWS:
                for level in LEVELS:
                    for seed in range(options.first, options.first + options.seeds):
                        found = judge(Case(drive, law, noise, level, seed))
                        outcomes += [found] if found else []
                        if options.every and found:
                            said = f"{found.before:.2f} {found.now:.2f} [{found.bounds[0]:.2f} {found.bounds[1]:.2f}]"
                            print(f"{found.case} {said} {found.method}", flush=True)
    text = "\n\n".join("\n".join(table(outcomes, group)) for group in ("drive", "noise", "law", "level"))
    document = f"# Estimated over true noise floor\n\n{(__doc__ or '').strip()}\n\n{text}\n"
    if options.out:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(document, encoding="utf-8")
    else:
        print(document)


if __name__ == "__main__":
    main()
