"""Make the logs with a hidden effect that this project ships: ``python -m datasets.make_discovery_logs [--out DIR]``.

``coil-eddy``: a voltage-driven Bouc-Wen coil with eddy currents, sines at 1, 5, 10 Hz and squares at 5 and 10 Hz.
``damper-lag``: a damper in random motion under random steps of a current that the fluid feels late.
The same seed gives the same bytes. README.md beside this file says what is hidden.
"""

import argparse
from pathlib import Path

import numpy as np

from datasets.make_coil_logs import folder, save
from datasets.rig import damper_bench, press
from datasets.rig.boucwen import FluxBoucWen
from datasets.rig.coil_bench import Drive
from datasets.rig.damper import Damper
from datasets.rig.flux_coil import Effects, FluxCoil, solve
from datasets.rig.press import Programme
from datasets.rig.stop import Array
from datasets.rig.style import Style

SEED = 20250
EDDY = 5.0
LAG = 0.02
PERIODS, PER_PERIOD, OVERSAMPLING = 10, 250, 4
# The slope of the iron's law falls from 20.8 to 20 mH within about 0.8 A of a reversal: a coil that hardly remembers
IRON = FluxBoucWen(A=1.2, Lc=1 / 60, kappa=1.25, beta=1.25 / 3, gamma=2.5 / 3, n=1.4, D=0.2 / 1.2 * 1.25 / 0.04)
COIL = FluxCoil(IRON, resistance=2.1)
DRIVES = [
    *(Drive("sine", f, a) for f in (1.0, 5.0, 10.0) for a in (1.0, 3.0, 5.0)),
    Drive("square", 5.0, 4.0),
    Drive("square", 10.0, 2.0),
    Drive("square", 10.0, 4.0),
]
LEVELS = (0.0, 0.5, 1.0, 1.5, 2.0)
DWELL = (0.25, 0.9)
# Strokes (rms, m) and bands (Hz) of the random motions
MOTIONS = ((3e-3, 8.0), (3.5e-3, 7.0), (4e-3, 5.0), (5e-3, 4.0), (6e-3, 3.0), (7e-3, 2.5))


def burst(shape: str) -> Array:
    """Return a quiet period, then a sine or a rounded square, at every half step of the solver."""
    half = 2 * OVERSAMPLING * PER_PERIOD
    phase = 2 * np.pi * (np.arange(PERIODS * half + 1) - half) / half
    sine = np.where(phase > 0, np.sin(phase), 0.0)
    return sine if shape == "sine" else np.tanh(sine / 0.3)


def make_coil(out: Path, seed: int, eddy: float) -> None:
    """Write ``coil-eddy``: 12 logs of 2500 rows; the amplifier is tuned until the current's peak is nominal."""
    frequency, amplitude = (np.array([getattr(d, k) for d in DRIVES]) for k in ("frequency", "amplitude"))
    shapes = np.array([burst(d.shape) for d in DRIVES])
    step = 1.0 / (frequency * PER_PERIOD * OVERSAMPLING)
    peak = amplitude * np.hypot(2.2, 2 * np.pi * frequency * 0.02)
    for _ in range(3):
        run = solve(COIL, Effects.of({"eddy-current": eddy}), peak[:, None] * shapes, step, keep=OVERSAMPLING)
        peak = peak * amplitude / (np.ptp(run.current[:, -2 * PER_PERIOD :], axis=1) / 2)
    logs, rng = folder(out, COIL.resistance), np.random.default_rng([seed, 1])
    for k, drive in enumerate(DRIVES):
        name = f"{drive.shape}_{drive.frequency:02.0f}Hz_{drive.amplitude:.0f}A.csv"
        save(logs / name, drive.frequency, PER_PERIOD, (run.voltage[k, :-1], run.current[k, :-1]), rng)


def make_damper(out: Path, seed: int, lag: float) -> None:
    """Write ``damper-lag``: six logs of 10 s at 500 Hz, random motion, random steps of the current."""
    rng = np.random.default_rng([seed, 2])
    tests = [
        Programme(f"random_{k}", press.random(0.4, top, rms, rng), press.steps(LEVELS, DWELL, rng), press.WARM_OIL)
        for k, (rms, top) in enumerate(MOTIONS, start=1)
    ]
    out.mkdir(parents=True, exist_ok=True)
    record = damper_bench.run(Damper(), {"current-lag": lag}, tests)
    style = Style(columns=("Displacement", "Load", "Current"))
    damper_bench.save(record, out, style, np.random.default_rng([seed, 3]))


def make(out: Path, seed: int = SEED, eddy: float = EDDY, lag: float = LAG) -> None:
    """Write both data sets under ``out``."""
    make_coil(out / "coil-eddy", seed, eddy)
    make_damper(out / "damper-lag", seed, lag)


def main() -> None:
    """Parse the command line and write the logs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write under")
    parser.add_argument("--seed", type=int, default=SEED, help="any whole number; the committed logs have %(default)s")
    parser.add_argument("--eddy", type=float, default=EDDY, help="loss resistance parallel to the coil, ohm")
    parser.add_argument("--lag", type=float, default=LAG, help="time constant of the field, s (0: none)")
    options = parser.parse_args()
    make(options.out, options.seed, options.eddy, options.lag)


if __name__ == "__main__":
    main()
