"""Calibration of `--intervals posterior`: ranks of planted parameters among its draws, and coverage.

    python -m benchmarks.posterior_calibration [--fits 500] > docs/benchmarks/posterior.md

Fits of one planted log each, its parameters drawn about the start values, by the colour of the noise. Where draws are
those of the posterior, the rank of the truth is uniform (Talts, Betancourt, Simpson, Vehtari and Gelman 2018).
"""

import argparse
import time

import numpy as np
from scipy.stats import kstest

from benchmarks.planted import planted_values, problem
from mrfit.core.specs import Array
from mrfit.fit.diagnostics.trust import trust
from mrfit.fit.identify import SearchSettings, search_optimum
from mrfit.fit.result import simulate_block

MODEL, SAMPLES = "tanh", 6000
COLOURS = (("white", 0.0), ("AR(1), 0.8", 0.8), ("AR(1), 0.95", 0.95))
HEAD = """# Posterior of parameters

`python -m benchmarks.posterior_calibration --fits {fits} > docs/benchmarks/posterior.md`

`{model}`, one sine of three cycles each, noise of 1 %, {fits} fits of each colour with parameters of their own.
`uniform`: least probability over the parameters that ranks of the truth among the draws are uniform (Kolmogorov and
Smirnov, times the number of parameters). `held`: how often 95 % intervals hold the truth, over all parameters, of the
posterior and of the covariance beside it. `time`: median of the draws of one fit, on one processor.
"""


def calibrated(seed: int, correlation: float) -> tuple[Array, Array, float]:
    """Return ranks of the truth (F,), whether intervals of posterior and covariance hold it (2, F), and seconds."""
    group, assembly, cube = problem(MODEL, 1, SAMPLES, np.random.default_rng(seed), correlation=correlation)
    truth = planted_values(cube, np.random.default_rng(seed))[0]
    settings = SearchSettings("auto", 0, None, None, "none")
    found = search_optimum(group, assembly, cube, cube.start[None, :], settings, lambda evaluations, cost: None)
    theta = cube.to_theta(found.point[None, :])[0]
    simulated = [simulate_block(b, assembly, theta)[0] for b in group.full]
    about = (group, assembly, cube, found.point, simulated)
    held, spent = [], time.process_time()
    for intervals in ("posterior", "hac"):
        rng = np.random.default_rng(seed + 1)
        result = trust(*about, weight="none", intervals=intervals, rng=rng)  # type: ignore[arg-type]
        ends = np.array([(p.low, p.high) for p in result.parameters], dtype=np.float64)[cube.free]
        held.append((ends[:, 0] <= truth[cube.free]) & (truth[cube.free] <= ends[:, 1]))
        if result.draws is not None:
            spent = time.process_time() - spent
            ranks: Array = np.mean(np.array(result.draws.rows) < truth[cube.free], axis=0)
    return ranks, np.array(held), spent


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--fits", type=int, default=500)
    parser.add_argument("--seed", type=int, default=5200000)
    given = parser.parse_args()
    print(HEAD.format(fits=given.fits, model=MODEL))
    print("| noise | uniform (p) | held (%) | held, covariance (%) | time (s) |\n|---|---|---|---|---|")
    for row, (name, correlation) in enumerate(COLOURS):
        rows = [calibrated(given.seed + 10000 * row + k, correlation) for k in range(given.fits)]
        ranks, held, spent = (np.array(column) for column in zip(*rows, strict=True))
        least = min(kstest(own, "uniform").pvalue for own in ranks.T) * ranks.shape[1]
        shares = 100.0 * held.mean(axis=(0, 2))
        cells = (f"{min(least, 1.0):.3f}", *(f"{s:.1f}" for s in shares), f"{np.median(spent):.2f}")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
