"""Masses on planted laws, driven by force or base: how often intervals hold the truth, and the solver's error.

python -m benchmarks.driven [--records 6] [--seed 61139] > docs/benchmarks/driven.md
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np

from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.driven import motion
from mrfit.errors import MrfitError
from mrfit.fit.driven import within_noise
from mrfit.fit.identify import build_group
from mrfit.fit.stage import FitOrigin, Settings, identify
from mrfit.io.dataset import Dataset
from mrfit.io.schemas.fit import Result
from mrfit.search.cube import cube_of
from mrfit.search.problem import LeastSquaresProblem
from mrfit.segment.detect import detect
from mrfit.simulate.assembly import assemble

DT, SAMPLES, MASS = 2e-3, 800, 2.0
LAWS: dict[str, dict[str, float]] = {
    "linear-spring-dashpot": {"k": 8000.0, "c": 30.0, "f0": 2.0},
    "tanh": {"fy": 30.0, "a1": 80.0, "a2": 60.0, "c": 60.0, "k": 4000.0, "f0": 1.0},
    "boucwen": {"c": 20.0, "k": 5e3, "x0": 0.0, "alpha": 40.0, "kappa": 1e3, "beta": 600.0, "gamma": 400.0, "n": 2.0},
    "boucwen-hardening": {"c": 20.0, "k": 5e3, "x0": 0.0, "alpha": 8e3, "b": -0.7, "g": 0.5, "n": 1.5, "z0": 5e-3},
    "dahl": {"c": 40.0, "fy": 30.0, "rho": 1000.0, "f0": 1.0},
    "regularised-bingham": {"fy": 25.0, "C_inf": 60.0, "vy": 0.02, "f0": 1.0},
}
NOISES = (0.001, 0.003, 0.01)
DRIVES = {"force": "excitation_force", "base": "base_acceleration"}
HEAD = """# Masses driven by force or base

`python -m benchmarks.driven > docs/benchmarks/driven.md`

A mass of {mass:g} kg on a planted law, from rest: {samples} samples at {rate:g} Hz of a random force or base
acceleration between 0.5 and 60 Hz, white noise on the displacement of {noises} % of its rms. `fit --driven-by force
--mass free`, and `--driven-by base --mass {mass:g}`. `in intervals`: parameters that the data determine whose planted
value lies in their 95 % interval. `error/noise`: rms difference of the motion, simulated as closely as the fit does,
from one at a thousandth of the finest tolerance, over the noise, at worst. Seeds below 1 000, 3 900 and 3 917 were for
development. {records} records a row, seed {seed}.

| law | driven by | records | refused | intervals | in intervals (%) | rmse/noise | error/noise | median time (s) |
|---|---|---|---|---|---|---|---|---|"""


@dataclass(frozen=True)
class FittedRecord:
    """How many intervals there are, how many hold the truth, error over noise, that of the solver, and seconds."""

    intervals: int
    held: int
    left: float
    solver: float
    seconds: float


def excitation(rng: np.random.Generator, rms: float) -> Array:
    """Return a random drive (N,) between 0.5 and 60 Hz that begins and ends softly."""
    spectrum = np.fft.rfft(rng.standard_normal(SAMPLES))
    frequency = np.fft.rfftfreq(SAMPLES, DT)
    drive = np.fft.irfft(spectrum * ((frequency > 0.5) & (frequency < 60.0)), SAMPLES)
    drive *= np.clip(np.minimum(np.arange(SAMPLES), np.arange(SAMPLES)[::-1]) / 25.0, 0.0, 1.0)
    scaled: Array = rms * drive / np.std(drive)
    return scaled


def fitted(law: str, by: str, noise: float, rng: np.random.Generator) -> FittedRecord:
    """Plant a record and fit it."""
    drive = excitation(rng, 80.0 if by == "force" else 40.0)
    whole = assemble(f"{law}@{by}")
    truth = {**LAWS[law], "mass": MASS}
    theta = whole.spec.theta(truth)[None]
    usual = motion.STEP_TOLERANCE
    motion.STEP_TOLERANCE = 1e-3 * usual
    moved = whole.simulate(drive[None], theta, DT)[0]
    motion.STEP_TOLERANCE = usual
    level = noise * float(np.std(moved))
    channels = {DRIVES[by]: drive, "displacement": moved + level * rng.standard_normal(SAMPLES)}
    units = {DRIVES[by]: "N" if by == "force" else "m/s^2", "displacement": "m"}
    record = Recording("r", "r.csv", "", "", DT, 0.0, channels, units)
    (segment,) = detect(record, DRIVES[by], 3, 1, 0.1).segments
    fixed = (("z0", truth["z0"]),) if "z0" in truth else ()
    settings = Settings(law, driven_by=by, mass="free" if by == "force" else f"{MASS}", fixed=fixed)  # type: ignore[arg-type]
    begun = time.perf_counter()
    content = identify(Dataset([segment], {"r": record}), settings, FitOrigin("", "", "")).content
    seconds = time.perf_counter() - begun
    counted, held = held_intervals(content.results[0], truth)
    group = build_group("all", [segment], {"r": record}, whole, False)
    cube = cube_of(whole.spec, {}, {}, dict(fixed))
    close = within_noise(LeastSquaresProblem(group.search, np.ones(1), whole, cube), cube.to_points(theta))
    error = close.assembly.simulate(drive[None], theta, DT)[0] - moved
    left = content.pooled("train").rmse / level
    return FittedRecord(counted, held, left, float(np.sqrt(np.mean(error**2))) / level, seconds)


def held_intervals(result: Result, truth: dict[str, float]) -> tuple[int, int]:
    """Return how many parameters are determined, and how many of these have their planted value in their interval."""
    found = [p for p in result.parameters if p.determined in ("well", "poorly")]
    return len(found), sum(p.low <= truth[p.name] <= p.high for p in found)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--records", type=int, default=6)
    parser.add_argument("--seed", type=int, default=61139)
    given = parser.parse_args()
    noises = ", ".join(f"{100 * n:g}" for n in NOISES)
    about = {"mass": MASS, "samples": SAMPLES, "rate": 1 / DT, "noises": noises}
    print(HEAD.format(**about, records=given.records, seed=given.seed))
    every: list[FittedRecord] = []
    for row, (law, by) in enumerate((law, by) for law in LAWS for by in DRIVES):
        done, refused = list[FittedRecord](), 0
        for number in range(given.records):
            rng = np.random.default_rng([given.seed, row, number])
            try:
                done.append(fitted(law, by, NOISES[number % len(NOISES)], rng))
            except MrfitError:
                refused += 1
        print(f"| {law} | {by} | {given.records} | {refused} | {told(done)} |", flush=True)
        every += done
    print(f"| all | | {len(every)} | | {told(every)} |")


def told(done: list[FittedRecord]) -> str:
    """Return the columns of a row behind the count of refused records."""
    counted = sum(d.intervals for d in done)
    share = 100.0 * sum(d.held for d in done) / max(counted, 1)
    left, solver = float(np.median([d.left for d in done])), max(d.solver for d in done)
    return f"{counted} | {share:.1f} | {left:.3f} | {solver:.4f} | {np.median([d.seconds for d in done]):.1f}"


if __name__ == "__main__":
    main()
