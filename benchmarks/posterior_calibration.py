"""Calibration of `--intervals posterior`: ranks of planted parameters among its draws, and coverage.

    python -m benchmarks.posterior_calibration [--fits 500] [--compared 20] > docs/benchmarks/posterior.md

Fits of one planted log each, its parameters drawn about the start values, by the colour of the noise. Where draws are
those of the posterior, the rank of the truth is uniform (Talts, Betancourt, Simpson, Vehtari and Gelman 2018).
"""

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit
from scipy.stats import kstest

from benchmarks.planted import planted_values, problem
from mrfit.core.specs import Array
from mrfit.fit.diagnostics.diagnose import diagnose
from mrfit.fit.identify import SearchSettings, search_optimum
from mrfit.fit.result import simulate_block
from mrfit.io.schemas.fit import Covariance
from mrfit.settings.fit import Settings

MODEL, SAMPLES = "tanh", 6000
COLOURS = (("white", 0.0), ("AR(1), 0.8", 0.8), ("AR(1), 0.95", 0.95))
COMPARED = ("tanh", "hysteretic-biviscous", "dahl", "guo", "boucwen", "boucwen-flux")
HEAD = """# Posterior of parameters

`python -m benchmarks.posterior_calibration --fits {fits} --compared {compared} --seed {seed} \
> docs/benchmarks/posterior.md`

`{model}`, one sine of three cycles each, noise of 1 %, {fits} fits of each colour with parameters of their own.
`uniform`: least probability over the parameters that ranks of the truth among the draws are uniform (Kolmogorov and
Smirnov, times the number of parameters). `held`: how often 95 % intervals hold the truth, over all parameters, of the
posterior and of the covariance beside it. `time`: median of the draws of one fit, on one processor.
"""
WHERE = """
## Where the cheap interval lies

{compared} fits of one sine each of some models, AR(1) noise of 0.8. `open`: how often the covariance gives no interval.
`covariance`, `profile`, `posterior`: how often the interval of each method holds the truth, where there is one.
`width`, `centre`: median of the posterior's width over the covariance's, and of the distance of its middle from theirs,
in shares of their width. A cheap interval is to be trusted where `width` is near 1 and `centre` near 0.
"""


@dataclass(frozen=True)
class CalibratedFit:
    """Free parameters of one fit: ranks (F,) of the truth, ends (M, F, 2) of intervals, nan where open, truth (F,).

    The methods are covariance, posterior, profile.
    """

    names: tuple[str, ...]
    ranks: Array
    ends: Array
    truth: Array
    seconds: float

    @property
    def held(self) -> Array:
        """Whether an interval holds the truth (M, F), nan where there is none."""
        inside = (self.ends[..., 0] <= self.truth) & (self.truth <= self.ends[..., 1])
        return np.where(np.isnan(self.ends).any(axis=-1), np.nan, inside)


def calibrated(seed: int, correlation: float, model: str = MODEL, methods: Sequence[str] = ()) -> CalibratedFit:
    """Fit a planted log and return its intervals beside the truth."""
    group, assembly, cube = problem(model, 1, SAMPLES, np.random.default_rng(seed), correlation=correlation)
    truth = planted_values(cube, np.random.default_rng(seed))[0, cube.free]
    settings = SearchSettings("auto", 0, None, None, "none")
    found = search_optimum(group, assembly, cube, cube.start[None, :], settings, lambda evaluations, cost: None)
    theta = cube.to_theta(found.point[None, :])[0]
    simulated = [simulate_block(b, assembly, theta)[0] for b in group.full]
    about = (group, assembly, cube, found.point, simulated)
    names = tuple(cube.params[k].name for k in cube.free)
    ends = []
    for intervals in ("posterior", *methods):
        spent = time.process_time()
        result = diagnose(*about, Settings(model, weight="none", intervals=intervals, seed=seed + 1))
        if result.draws is not None:
            seconds = time.process_time() - spent
            drawn = [names.index(n) for n in result.draws.names]
            ranks: Array = np.mean(np.array(result.draws.rows) < truth[drawn], axis=0)
            ends.append(of_covariance(names, theta[cube.free], result.covariance))
        ends.append(np.array([(p.low, p.high) for p in result.parameters], dtype=np.float64)[cube.free])
    return CalibratedFit(names, ranks, np.array(ends), truth, seconds)


def of_covariance(names: Sequence[str], values: Array, known: Covariance | None) -> Array:
    """Return the ends (F, 2) of the intervals of a covariance, nan where it states none."""
    ends = np.full((len(names), 2), np.nan)
    for k, name in enumerate(known.names if known else ()):
        assert known is not None
        if name in names:
            half = stdtrit(known.degrees, 0.975) * np.sqrt(known.rows[k][k]) * np.array([-1.0, 1.0])
            value = values[names.index(name)]
            ends[names.index(name)] = value * np.exp(half) if known.log[k] else value + half
    return ends


def by_model(fits: int, seed: int) -> Iterator[str]:
    """Yield the table of intervals by three methods, parameter by parameter."""
    yield "| model | parameter | open (%) | covariance (%) | profile (%) | posterior (%) | width | centre | time (s) |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for row, model in enumerate(COMPARED):
        rows = [calibrated(seed + 500000 + 10000 * row + k, 0.8, model, ["profile"]) for k in range(fits)]
        ends, seconds = np.array([r.ends for r in rows]), f"{np.median([r.seconds for r in rows]):.2f}"
        width, middle = np.ptp(ends, axis=-1), ends.mean(axis=-1)
        for k, name in enumerate(rows[0].names):
            held = [np.array([r.held[m, k] for r in rows]) for m in (0, 2, 1)]
            ratio = width[:, 1, k] / width[:, 0, k]
            centre = np.abs(middle[:, 1, k] - middle[:, 0, k]) / width[:, 0, k]
            shares = [shown(100.0 * np.mean(h[~np.isnan(h)]) if (~np.isnan(h)).any() else np.nan) for h in held]
            known = ~np.isnan(ratio)
            beside = [f"{np.median(x[known]):.2f}" if known.any() else "" for x in (ratio, centre)]
            cells = (model, name, shown(100.0 * np.mean(np.isnan(held[0]))), *shares, *beside, seconds)
            yield f"| {' | '.join(cells)} |"


def shown(share: float) -> str:
    """Return a share as the tables have it."""
    return "" if np.isnan(share) else f"{share:.1f}"


def main() -> None:
    parser = argparse.ArgumentParser()
    for name, value in (("fits", 500), ("compared", 20), ("seed", 6300000)):
        parser.add_argument(f"--{name}", type=int, default=value)
    given = parser.parse_args()
    print(HEAD.format(model=MODEL, **vars(given)))
    print("| noise | uniform (p) | held (%) | held, covariance (%) | time (s) |\n|---|---|---|---|---|")
    for row, (name, correlation) in enumerate(COLOURS):
        rows = [calibrated(given.seed + 10000 * row + k, correlation) for k in range(given.fits)]
        ranks = np.array([r.ranks for r in rows])
        least = min(kstest(own, "uniform").pvalue for own in ranks.T) * ranks.shape[1]
        shares = 100.0 * np.mean([r.held for r in rows], axis=(0, 2))
        cells = (f"{min(least, 1.0):.3f}", *map(shown, shares[::-1]), f"{np.median([r.seconds for r in rows]):.2f}")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    print(WHERE.format(compared=given.compared))
    for line in by_model(given.compared, given.seed):
        print(line, flush=True)


if __name__ == "__main__":
    main()
