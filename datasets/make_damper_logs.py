"""Make the logs of a damper that the first pages show: ``python -m datasets.make_damper_logs [--out DIR]``.

``damper``: sines of 1 and 2 Hz and a random motion, each under steps between five currents that the fluid feels late.
``damper-sines``: sines of 0.5, 1 and 2 Hz at currents that are held, 0 and 1 A, as a test sheet takes them.
The same seed gives the same bytes. README.md beside this file says what is hidden.
"""

import argparse
from pathlib import Path

import numpy as np

from datasets.make_discovery_logs import DWELL, LAG, LEVELS
from datasets.rig import damper_bench, press
from datasets.rig.damper import Damper
from datasets.rig.style import Style

SEED = 20251


def make(out: Path, seed: int = SEED, lag: float = LAG) -> None:
    """Write ``damper`` and ``damper-sines`` under a folder: logs of 10 s at 250 Hz."""
    rng = np.random.default_rng([seed, 0])
    motions = {
        "sine_1Hz_12mm": press.sine(1.0, 0.012),
        "sine_2Hz_8mm": press.sine(2.0, 0.008),
        "random_4mm": press.random(0.4, 5.0, 4e-3, rng),
    }
    tests = [
        press.Programme(name, motion, press.steps(LEVELS, DWELL, rng), press.WARM_OIL)
        for name, motion in motions.items()
    ]
    steady = [
        press.Programme(f"sine_{f:g}Hz_10mm_{i:g}A", press.sine(f, 0.010), press.held(i), press.WARM_OIL)
        for f in (0.5, 1.0, 2.0)
        for i in (0.0, 1.0)
    ]
    style = Style(columns=("Displacement", "Load", "Current"), stride=2)
    for number, (name, logs) in enumerate((("damper", tests), ("damper-sines", steady)), start=1):
        (out / name).mkdir(parents=True, exist_ok=True)
        record = damper_bench.run(Damper(), {"current-lag": lag}, logs)
        damper_bench.save(record, out / name, style, np.random.default_rng([seed, number]))


def main() -> None:
    """Parse the command line and write the logs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write under")
    parser.add_argument("--seed", type=int, default=SEED, help="any whole number; the committed logs have %(default)s")
    parser.add_argument("--lag", type=float, default=LAG, help="time constant of the field, s (0: none)")
    options = parser.parse_args()
    make(options.out, options.seed, options.lag)


if __name__ == "__main__":
    main()
