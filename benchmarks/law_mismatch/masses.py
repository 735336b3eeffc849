"""How much of a planted mass real records can show: what no law takes of an acceleration, and how well it is known.

    python -m benchmarks.law_mismatch.masses [--out FILE.md]

The acceleration of a log is the slope of its velocity, which can be taken in several ways. Each is planted as a mass of
12 % of the range and compared with the acceleration that mrfit derives, in what the nuisance of the examination leaves.
"""

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

from benchmarks.command import deliver
from benchmarks.discovery.report import table
from benchmarks.law_mismatch.methods import Asked, recordings_of
from benchmarks.law_mismatch.motions import Array
from benchmarks.law_mismatch.realsets import SETS, load, motion_of
from mrfit.api.preparing import as_asked, prepared
from mrfit.core.progress import silent
from mrfit.discover.evidence.bench import build_bench, effects_for
from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.records import Record, from_block, with_steady_currents
from mrfit.discover.invariance.setting import setting_of
from mrfit.discover.invariance.weights import weights_of
from mrfit.discover.policy import STANDARD
from mrfit.simulate.assembly import assemble

SIZE = 0.12


def of_displacement(channels: dict[str, Array], dt: float) -> Array:
    """Return the acceleration that the evaluation plants."""
    return motion_of(channels, dt)[2]


def of_velocity(channels: dict[str, Array], dt: float, samples: int) -> Array:
    """Return the slope of the velocity: of its differences, or of parabolas through so many samples."""
    if samples == 1:
        return np.gradient(channels["velocity"], dt)
    return np.asarray(savgol_filter(channels["velocity"], samples, 2, deriv=1, delta=dt))


WAYS = {
    "as in the evaluation": of_displacement,
    "differences of the velocity": partial(of_velocity, samples=1),
    "parabolas, 5 samples": partial(of_velocity, samples=5),
    "parabolas, 9 samples": partial(of_velocity, samples=9),
}


def records_of(asked: Asked) -> list[Record]:
    """Return the records as the examination takes them."""
    data = prepared(recordings_of(asked), as_asked({}), silent).dataset
    bench = build_bench(data.segments, data.recordings, assemble(asked.base), effects_for("force"))
    return with_steady_currents([from_block(s.block, s.names, "force") for s in bench.stretches])


def rows_of(name: str) -> list[tuple[object, ...]]:
    """Return the rows of a set of records, one for every way."""
    channels, dts, conditions = load(name)
    asked = Asked(channels, dts, "bingham", conditions)
    records = records_of(asked)
    setting = setting_of(records, none(records).terms, (), STANDARD)
    weights = weights_of(setting, {})

    def weighted(of: list[Array]) -> Array:
        """Return the rows of a value of each record, weighted as in the examination."""
        return np.concatenate(
            [setting.row_means(k, values) * w for k, (values, w) in enumerate(zip(of, weights, strict=True))]
        )

    def force(these: list[Record]) -> Array:
        return weighted([np.concatenate([np.zeros(r.lead), r.output]) for r in these])

    law = np.concatenate([setting.row_means(k, setting.law(k, {}).values) * w[:, None] for k, w in enumerate(weights)])
    span, singular, _ = np.linalg.svd(law / np.linalg.norm(law, axis=0), full_matrices=False)
    span = span[:, singular > 1e-8 * singular[0]]

    def beside(values: Array) -> Array:
        """Return what no law takes."""
        return values - span @ (span.T @ values)

    derived = weighted([r.channels["acceleration"] for r in records])
    own, error = beside(derived), beside(force(records))
    left = f"{own @ own / (derived @ derived):.1%}"
    forces = [c["force"] for c in channels]
    size = SIZE * (max(map(np.max, forces)) - min(map(np.min, forces)))
    rows = []
    for way, slope in WAYS.items():
        taken = [slope(c, dt) for c, dt in zip(channels, dts, strict=True)]
        mass = size / max(np.abs(a).max() for a in taken)
        planted = [{**c, "force": c["force"] + mass * a} for c, a in zip(channels, taken, strict=True)]
        added = beside(force(records_of(replace(asked, channels=planted))) - force(records))
        alike = own @ added / np.sqrt((own @ own) * (added @ added))
        total = error + added
        share = (own @ added) ** 2 / (own @ own) / (total @ total)
        rows.append(
            (
                name,
                left,
                way,
                f"{mass:.3g} kg",
                f"{alike:.2f}",
                f"{own @ added / (own @ own) / mass:.2f}",
                f"{share:.1%}",
            )
        )
    return rows


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="Markdown file to write; default: standard output")
    heads = (
        "records",
        "left of the acceleration",
        "planted acceleration",
        "mass",
        "correlation",
        "value found",
        "share",
    )
    rows = [row for name in SETS for row in rows_of(name)]
    text = f"""# Masses planted in real records

Made by `python -m benchmarks.law_mismatch.masses --out FILE.md`. Every mass makes {SIZE:.0%} of the range of the force
at its peak. "Left" is the share of the square of the acceleration that no law takes. "Correlation" is that of the
planted acceleration with the one that mrfit derives, in what no law takes. "Value found" is the estimate over the
truth. "Share" is what the mass takes of the squared error that no law makes, beside no other effect: a name needs
{STANDARD.share:.0%}, or {STANDARD.share_if_plain:.0%} at {STANDARD.plain:g} standard errors.

{table(heads, rows)}
"""
    deliver(text, parser.parse_args().out)


if __name__ == "__main__":
    main()
