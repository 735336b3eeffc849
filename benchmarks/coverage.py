"""How often 95 % intervals hold the truth: ``python -m benchmarks.coverage [SEEDS]``.

Whole fits of planted `boucwen-flux` logs with correlated noise or converter steps, one new noise for each seed; the
quantities are those the data determine. The aim is 93 to 97 %; a share over 200 seeds has a standard error of 1.5 %.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse  # noqa: E402
from dataclasses import replace  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402
from scipy.signal import lfilter  # noqa: E402

from benchmarks.command import deliver  # noqa: E402
from mrfit.core.recording import Recording, Segment  # noqa: E402
from mrfit.core.specs import Array  # noqa: E402
from mrfit.fit.diagnostics.uncertainty import analyse  # noqa: E402
from mrfit.fit.identify import SearchSettings, build_group, linearise, search_optimum  # noqa: E402
from mrfit.fit.result import derived_rows  # noqa: E402
from mrfit.models import boucwen_flux  # noqa: E402
from mrfit.search.cube import cube_of  # noqa: E402
from mrfit.signal.noise_floor import NoiseFloor  # noqa: E402
from mrfit.simulate.assembly import assemble  # noqa: E402

TRUTH = np.array([[1.2, 0.018, 1.4, 0.8, 1.2, 1.6, 0.3]])
PER_CYCLE, CYCLES, FREQUENCY = 500, 6, 5.0
NOISE = 3e-4
# Name, lag-one correlation of the noise, steps of the converter in multiples of the noise
CASES = (
    ("white", 0.0, 0.0),
    ("AR(1), 0.5", 0.5, 0.0),
    ("AR(1), 0.8", 0.8, 0.0),
    ("AR(1), 0.95", 0.95, 0.0),
    ("converter steps of 10 times the noise", 0.0, 10.0),
)


def logs(rho: float, step: float, rng: np.random.Generator) -> tuple[dict[str, Recording], list[Segment]]:
    """Return logs at 1, 3 and 5 A with AR(1) noise; with steps the noise is a tenth of them and the error as large."""
    dt, lead = 1.0 / (PER_CYCLE * FREQUENCY), 2 * PER_CYCLE
    samples = PER_CYCLE * CYCLES + lead
    recordings, segments = {}, []
    for amplitude in (1.0, 3.0, 5.0):
        current: Array = amplitude * np.sin(2 * np.pi * np.arange(samples) / PER_CYCLE)
        flux = boucwen_flux.response(current[None, :], TRUTH, dt)[0]
        noise = lfilter([np.sqrt(1 - rho**2)], [1, -rho], rng.standard_normal(samples + 200))[200:]
        measured = flux + NOISE * noise / (step or 1.0)
        if step:
            measured = NOISE * np.round(measured / NOISE + rng.random())
        name, nan = f"{amplitude:g}A", float("nan")
        channels = {"current": current, "flux": measured}
        recordings[name] = Recording(name, name, "0", "none", dt, 0.0, channels, {})
        segments.append(
            Segment(
                f"{name}#1", name, name, lead, samples, lead, "sine", "current", FREQUENCY, amplitude, 0.0,
                CYCLES, nan, nan, "train",
            )
        )  # fmt: skip
    return recordings, segments


def covered(rho: float, step: float, seeds: int) -> tuple[Array, Array]:
    """Return the share of seeds whose intervals hold the truth, and the median half-width over the truth, each (D,)."""
    assembly = assemble("boucwen-flux")
    start = dict(zip(assembly.spec.names, TRUTH[0].tolist(), strict=True))
    cube = cube_of(assembly.spec, {}, start, {})
    truth = boucwen_flux.derived(TRUTH)[0]
    settings = SearchSettings("lsq", 0, None, None, "none")
    hits, widths = [], []
    for seed in range(seeds):
        recordings, segments = logs(rho, step, np.random.default_rng(seed))
        group = build_group("all", segments, recordings, assembly, split=False)
        group = replace(group, floors=[NoiseFloor(NOISE, "cycles", NOISE, NOISE)] * 3)
        found = search_optimum(group, assembly, cube, cube.start[None, :], settings, lambda evaluations, cost: None)
        point = found.point
        about = linearise(group, assembly, cube, point, "none")
        rows = derived_rows(assembly, cube, point, analyse(about.jacobians, about.residuals, about.periods))
        # an end that is not to be had becomes NaN, which holds nothing
        ends = np.array([[r.low, r.high] for r in rows], dtype=np.float64)
        hits.append((ends[:, 0] <= truth) & (truth <= ends[:, 1]))
        widths.append((ends[:, 1] - ends[:, 0]) / 2 / np.abs(truth))
    return np.mean(hits, axis=0), np.median(widths, axis=0)


def main(seeds: int, out: Path | None = None) -> None:
    """Write the table."""
    names = [d.name for d in boucwen_flux.SPEC.derived]
    lines = [
        "# Coverage of 95 % intervals",
        "",
        "`python -m benchmarks.coverage [SEEDS] [--out FILE.md]`",
        "",
        f"Share of {seeds} seeds in which the interval of a quantity holds the planted value (aim 93 to 97 %), and the",
        "median of half its width over the value.",
        "",
        f"| noise | {' | '.join(names)} |",
        "|---" * (1 + len(names)) + "|",
    ]
    for name, rho, step in CASES:
        shares, widths = covered(rho, step, seeds)
        cells = [f"{100 * s:.1f} % (± {100 * w:.2g} %)" for s, w in zip(shares, widths, strict=True)]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    deliver("\n".join([*lines, ""]), out)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", nargs="?", type=int, default=200)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    main(asked.seeds, asked.out)
