"""Fig. 12 of the rotary-stiffness paper at all its points: population and iterations of MWOA with b held."""

from pathlib import Path

import numpy as np

from benchmarks.studies.figures import Curve, Panel, draw
from benchmarks.studies.page import Row, Study, Table, claim
from benchmarks.studies.rotary_vsd import mse_of_whales
from benchmarks.studies.runs import Place

B = 1.2
POPULATIONS = (10, 20, 30, 40, 50)
ITERATIONS = (300, 400, 500, 600, 700, 800, 900, 1000)


def run(logs: Path, work: Path) -> Study:
    """Run the study."""
    place = Place(logs, work)
    mse = np.array([[mse_of_whales(place, B, p, n) for n in ITERATIONS] for p in POPULATIONS])
    rows = [Row(f"{p} whales", [], list(map(float, mse[k]))) for k, p in enumerate(POPULATIONS)]
    columns = [f"{n} iterations" for n in ITERATIONS]
    note = (
        "Means over the starts of `--opt mwoa --opt-set b=1.2,population=…,iterations=…`, of the torque at 3 Hz, 1 A."
    )
    least = np.unravel_index(int(np.argmin(mse)), mse.shape)
    steps = int(np.sum(np.diff(mse, axis=0) < 0)), int(np.sum(np.diff(mse, axis=1) < 0))
    best = f"{POPULATIONS[least[0]]} and {ITERATIONS[least[1]]}"
    words = [
        claim(
            "population, iterations",
            "more of either lowers the error; 40 and 800 are enough",
            f"more whales do in {steps[0]} of {mse[1:].size} steps, more iterations in {steps[1]} of "
            f"{mse[:, 1:].size}; "
            f"at 40 and 800 {mse[3, 5] / mse.min():.3g} times the least, which is at {best}",
            bool(mse[3, 5] < 1.05 * mse.min() and mse[-1, -1] < mse[0, 0]),
            rule="within 5 % of the least",
        )
    ]
    curves = [Curve(np.array(ITERATIONS, dtype=float), mse[k], f"{p} whales", k) for k, p in enumerate(POPULATIONS)]
    draw("rotary-vsd-long.svg", [Panel(f"b = {B:g}", ("iterations", "MSE, (N·m)²"), curves)])
    return Study(
        "rotary-vsd-long",
        "Population and iterations of MWOA at all points of Fig. 12",
        "Characterizing nonlinear oscillation behavior of an MRF variable rotational stiffness device",
        "Logs of the study rotary-vsd; by `make studies-long`.",
        ["mrfit fit --model rotational-erf --opt mwoa --opt-set b=1.2,population=…,iterations=…"],
        [
            Table("MSE of MWOA, (N·m)²", "Fig. 12", "population", columns, rows, note),
            Table("What section 5.1 says of them", "section 5.1, Fig. 12", "of", [], words),
        ],
        figures=[("rotary-vsd-long.svg", "MSE over iterations, by population (Fig. 12)")],
    )
