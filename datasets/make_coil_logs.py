"""Make the coil logs this project ships: ``python -m datasets.make_coil_logs [--out DIR] [--seed N]``.

``coil``: a voltage-driven coil whose iron is a set of stop operators, 1, 5, 10 Hz by 1 to 5 A.
``coil-planted``: a current-driven coil that is the flux model of the literature itself, in both readings of its D.
The same seed gives the same bytes. README.md beside this file says what is known of the truth.
"""

import argparse
import json
from dataclasses import asdict, replace
from math import inf
from pathlib import Path

import numpy as np

from datasets.rig.boucwen import FluxBoucWen
from datasets.rig.coil import Coil, solve, tune
from datasets.rig.scope import LEVELS_PER_DIVISION, Probe, acquire, vertical_scale, write
from datasets.rig.stop import Array

SEED = 20240
CLAMP = 0.1
OVERSAMPLING = 8
# Rows of a planted log, eight periods
ROWS, PER_PERIOD = 4800, 600
FREQUENCIES = (1.0, 5.0, 10.0)
VOLTAGE_NOISE, CURRENT_NOISE = 4e-3, 4e-4
PUBLISHED = FluxBoucWen(A=1.1993, Lc=0.0178, kappa=3.4887, beta=30.0007, gamma=59.9993, n=1.2695, D=19.9999)
"""Tang et al. Table 3, 3 A, 1 Hz; SI."""

MAP = """\
resistance = {resistance:g}

[channels]
voltage = {{column = "CH1"}}
current = {{column = "CH2", scale = 10.0, unit = "A"}}
"""


def probes(rng: np.random.Generator) -> tuple[Probe, Probe]:
    """Return the voltage probe and the current clamp of one acquisition, each zeroed as well as a lab zeroes them."""
    return (
        Probe(1.0, float(rng.normal(8e-3, 3e-3))),
        Probe(CLAMP, float(rng.normal(-1.0e-3, 3e-4))),
    )


def converter_noise(signal: Array, probe: Probe, front_end: float) -> float:
    """Return the noise in V of a channel: its front end's, and one level of the converter on the range it is set to.

    A scope reaches 12 bits by averaging, so its noise is about its level; less would leave its steps in every
    cycle at the same place.
    """
    level = vertical_scale(float(np.abs(probe.gain * signal + probe.offset).max())) / LEVELS_PER_DIVISION
    return float(np.hypot(front_end, level))


def save(
    path: Path, frequency: float, per_period: int, signals: tuple[Array, Array], rng: np.random.Generator
) -> dict[str, object]:
    """Acquire coil voltage and current, one period before the trigger, and return what the probes did."""
    interval = 1.0 / frequency / per_period
    pair = probes(rng)
    noise = [converter_noise(s, p, n) for s, p, n in zip(signals, pair, (VOLTAGE_NOISE, CURRENT_NOISE), strict=True)]
    drawn = [rng.normal(0.0, level, len(signals[0])) for level in noise]
    (voltage, v_scale), (current, i_scale) = map(acquire, signals, pair, drawn)
    write(path, -1.0 / frequency, interval, {"CH1": voltage, "CH2": current}, v_scale)
    return {
        "voltage": {"offset": pair[0].offset, "noise": noise[0], "level": v_scale / 400, "unit": "V"},
        "current": {
            "offset": pair[1].offset / CLAMP,
            "noise": noise[1] / CLAMP,
            "level": i_scale / 400 / CLAMP,
            "unit": "A",
        },
    }


def folder(path: Path, resistance: float) -> Path:
    """Create a log folder with its channel map."""
    path.mkdir(parents=True, exist_ok=True)
    (path / "mrfit.toml").write_text(MAP.format(resistance=resistance), encoding="utf-8")
    return path


def name(frequency: float, amplitude: float) -> str:
    """Return a log's file name, as in coil_05Hz_3A.csv."""
    return f"coil_{frequency:02.0f}Hz_{amplitude:.0f}A.csv"


def sine_burst(samples: int, per_period: int) -> Array:
    """Return one quiet period, then a sine from phase zero."""
    phase = 2 * np.pi * (np.arange(samples) - per_period) / per_period
    return np.where(phase > 0, np.sin(phase), 0.0)


def make_bench(out: Path, seed: int, eddy: float) -> None:
    """Write ``coil``: 15 logs of 2500 rows, 250 a period; the current within about 1 % of nominal, tuned by hand."""
    rng = np.random.default_rng([seed, 1])
    coil = replace(Coil(), eddy=eddy)
    frequency, amplitude = (grid.ravel() for grid in np.meshgrid(FREQUENCIES, np.arange(1.0, 6.0), indexing="ij"))
    emf = tune(coil, frequency, amplitude) * (1.0 + rng.uniform(-0.012, 0.012, len(frequency)))
    steps = 2500 * OVERSAMPLING
    run = solve(coil, emf[:, None] * sine_burst(steps, steps // 10), 10.0 / frequency / steps, OVERSAMPLING)
    logs = folder(out, coil.resistance)
    for k, (hertz, ampere) in enumerate(zip(frequency, amplitude, strict=True)):
        save(logs / name(hertz, ampere), hertz, 250, (run.voltage[k], run.current[k]), rng)


def make_planted(out: Path, truth: FluxBoucWen, rng: np.random.Generator) -> dict[str, object]:
    """Write nine logs of 4800 rows with one parameter set, u = R i + d lambda/dt exact, and return their truth.

    600 rows a period: after a reversal z turns over within 22 mA, which at 5 A is a fiftieth of a period, and the
    integral of the voltage must resolve it.
    """
    resistance = 2.1
    logs = folder(out, resistance)
    files = {}
    for ampere in (1.0, 3.0, 5.0):
        current = ampere * sine_burst(ROWS, PER_PERIOD)
        z = truth.hysteretic(current)
        for hertz in FREQUENCIES:
            turns = np.arange(ROWS) / PER_PERIOD
            rate = ampere * 2 * np.pi * hertz * np.cos(2 * np.pi * turns) * (turns >= 1)
            voltage = resistance * current + truth.inductance(z, rate) * rate
            files[name(hertz, ampere)] = save(logs / name(hertz, ampere), hertz, PER_PERIOD, (voltage, current), rng)
    return {"parameters": asdict(truth), "resistance": resistance, "files": files}


def make(out: Path, seed: int = SEED, eddy: float = inf) -> None:
    """Write both data sets under ``out``."""
    make_bench(out / "coil", seed, eddy)
    make_both_planted(out / "coil-planted", seed)


def make_both_planted(planted: Path, seed: int) -> None:
    """Write ``coil-planted``: logs of the published parameters as printed, and by the standard equation."""
    rng = np.random.default_rng([seed, 2])
    standard = make_planted(planted / "standard", replace(PUBLISHED, D=1.0 / PUBLISHED.D), rng)
    printed = make_planted(planted / "printed", PUBLISHED, rng)
    truth = {"seed": seed, "variants": {"standard": standard, "printed": printed}}
    (planted / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


def main() -> None:
    """Parse the command line and write the logs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write under")
    parser.add_argument("--seed", type=int, default=SEED, help="any whole number; the committed logs have %(default)s")
    parser.add_argument("--eddy", type=float, default=inf, help="loss resistance parallel to the coil, ohm (none)")
    options = parser.parse_args()
    make(options.out, options.seed, options.eddy)


if __name__ == "__main__":
    main()
