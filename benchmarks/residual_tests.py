"""How often the test of residual against input is wrong: ``python -m benchmarks.residual_tests [--out FILE.md]``.

False alarms: AR(1) noise alone, two inputs (a drive and its rate), one record in each condition; the whole family may
be wrong in 5 % of the runs. Power: five conditions whose residuals go with the drive by −0.9, −0.6, 0.1, 0.5, 0.9 of
the size of the noise, which nearly cancel in their sum; and one condition in five alone, by 0.6.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np
from scipy.signal import lfilter

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.residual_tests import input_dependence
from mrfit.io.schemas.fit import ResidualTest

CONDITIONS = (1, 5, 30)
RUNS = {1: 400, 5: 200, 30: 100}
POWER_RUNS = 100
CORRELATIONS = (0.0, 0.9, 0.98)
SIGNS = (-0.9, -0.6, 0.1, 0.5, 0.9)
ONE = (0.0, 0.0, 0.6, 0.0, 0.0)
# No limit was set on runs of this seed
SEED = 9001


@dataclass(frozen=True, slots=True)
class Record:
    """A kind of record: its drive, ``sine`` or ``road`` (AR(1), 0.98), samples, and cycles of a sine."""

    drive: str
    samples: int
    cycles: int = 0

    @property
    def name(self) -> str:
        """The kind in words."""
        return f"{self.drive}, {self.samples} samples" + (f", {self.cycles} cycles" if self.cycles else "")


RECORDS = (
    Record("sine", 4000, 8),
    Record("sine", 2000, 3),
    Record("sine", 600, 20),
    Record("road", 2000),
    Record("road", 400),
)


def noise(rng: np.random.Generator, samples: int, rho: float) -> Array:
    """Return AR(1) noise (N,) of unit variance."""
    drawn = rng.standard_normal(samples + 500)
    return np.asarray(lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], drawn))[500:]


def tested(
    record: Record, rho: float, shares: Sequence[float], rng: np.random.Generator, pooled: bool = False
) -> list[ResidualTest]:
    """Return the tests of drive and rate, of a residual that goes with the drive by a share in each condition."""
    turns = np.arange(record.samples) * record.cycles / record.samples
    drives, residuals = [], []
    for share in shares:
        sine = np.sqrt(2.0) * np.sin(2 * np.pi * (turns + rng.random()))
        drive = sine if record.cycles else noise(rng, record.samples, 0.98)
        drives.append(drive)
        residuals.append(share * drive + noise(rng, record.samples, rho))
    periods = [record.samples / record.cycles if record.cycles else 0.0] * len(shares)
    names = ["one" if pooled else str(k) for k in range(len(shares))]
    inputs = (("drive", drives), ("rate", [np.gradient(d) for d in drives]))
    found = [input_dependence(name, values, residuals, periods, names, len(inputs)) for name, values in inputs]
    return [f for f in found if f is not None]


def false_alarms(record: Record, rho: float, conditions: int) -> tuple[float, float]:
    """Return how often noise alone is beyond its limit, and how often it is said to depend on an input."""
    beyond, said = 0, 0
    for run in range(RUNS[conditions]):
        found = tested(record, rho, [0.0] * conditions, np.random.default_rng([SEED, run]))
        said += any(not f.independent for f in found)
        # the limit alone decides
        with patch("mrfit.fit.diagnostics.residual_tests.SMALLEST", 0.0):
            found = tested(record, rho, [0.0] * conditions, np.random.default_rng([SEED, run]))
            beyond += any(not f.independent for f in found)
    return beyond / RUNS[conditions], said / RUNS[conditions]


def power(record: Record, rho: float, shares: Sequence[float], pooled: bool) -> float:
    """Return how often what is planted is found."""
    rngs = (np.random.default_rng([SEED + 1, run]) for run in range(POWER_RUNS))
    return sum(any(not f.independent for f in tested(record, rho, shares, rng, pooled)) for rng in rngs) / POWER_RUNS


def tables() -> str:
    """Return both tables as Markdown."""
    lines = ["| record | noise | " + " | ".join(f"{c} condition{'s' * (c > 1)}" for c in CONDITIONS) + " |"]
    lines.append("|---|---|" + "---|" * len(CONDITIONS))
    kinds = [(r, rho) for r in RECORDS for rho in CORRELATIONS]
    for record, rho in kinds:
        rates = [false_alarms(record, rho, c) for c in CONDITIONS]
        cells = [f"{100 * beyond:.1f} % ({100 * said:.1f} %)" for beyond, said in rates]
        lines.append(f"| {record.name} | AR(1), {rho:g} | {' | '.join(cells)} |")
        sys.stderr.write(lines[-1] + "\n")
    more = ["| record | noise | signs that cancel: pooled | by condition | one of five: pooled | by condition |"]
    more.append("|---|---|---|---|---|---|")
    for record, rho in kinds:
        found = [power(record, rho, shares, pooled) for shares in (SIGNS, ONE) for pooled in (True, False)]
        more.append(f"| {record.name} | AR(1), {rho:g} | {' | '.join(f'{100 * f:.0f} %' for f in found)} |")
    return "\n".join(lines) + "\n\n" + "\n".join(more) + "\n"


ABOUT = """\
# The residual test, condition by condition

`python -m benchmarks.residual_tests`. First table: runs of noise alone in which either of two inputs is beyond its
limit in any condition, over {runs} runs; in brackets: and by a correlation of 0.2 or more, so that the fit has a
warning. The level set is 5 %. Second table: runs in which what is planted in five conditions is found, over {power}
runs, with all records pooled as one condition, and tested by condition.

"""


def main() -> None:
    """Print or write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="Markdown file to write; default: standard output")
    options = parser.parse_args()
    text = ABOUT.format(runs=", ".join(map(str, RUNS.values())), power=POWER_RUNS) + tables()
    if options.out:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)


if __name__ == "__main__":
    main()
