"""Compare optimizers on one objective: pso-fmin and fmin (Tang et al., Table 2), five swarms (rotary-stiffness paper).

Run ``python -m benchmarks.optimizers [SEEDS]``: planted data of `boucwen-flux` and `rotational-erf` with 1 % noise,
costs as multiples of that noise. All optimizers of a table see the same data.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrfit import optimize
from mrfit.assembly import assemble
from mrfit.fit.cube import Cube
from mrfit.objective import Objective
from mrfit.specs import Array

TABLE_2 = ("fmin", "pso", "pso-fmin", "auto")
FIGURE_13 = ("mwoa", "woa", "ga", "pso", "monkey", "auto")
FIGURE_13_EVALUATIONS = 40 * 800
NOISE = 0.01


@dataclass(frozen=True)
class Row:
    """One optimizer over all seeds: final costs, evaluations and seconds (S,), best cost over evaluations (S, 50)."""

    name: str
    costs: Array
    evaluations: Array
    seconds: Array
    convergence: Array


def compare(
    factory: Callable[[int], Objective], names: tuple[str, ...], seeds: int, budget: int | None = None
) -> list[Row]:
    """Run every optimizer for every seed on ``factory(seed)``; ``budget`` is in evaluations, None for its own."""
    rows = []
    for name in names:
        outcomes, seconds = [], []
        for seed in range(seeds):
            objective = factory(seed)
            begin = time.perf_counter()
            outcomes.append(optimize.run(name, objective, np.random.default_rng(seed), budget))
            seconds.append(time.perf_counter() - begin)
        horizon = budget or max(o.evaluations for o in outcomes)
        rows.append(
            Row(
                name=name,
                costs=np.array([o.cost for o in outcomes]),
                evaluations=np.array([o.evaluations for o in outcomes]),
                seconds=np.array(seconds),
                convergence=np.stack([convergence(o, horizon) for o in outcomes]),
            )
        )
    return rows


def convergence(outcome: optimize.Outcome, horizon: int) -> Array:
    """Return the best cost after 1/50, 2/50 … of ``horizon`` evaluations, shape (50,)."""
    history = [entry for link in outcome.links for entry in link.history]
    evaluations, costs = (np.array(column) for column in zip(*history, strict=True))
    at = np.searchsorted(evaluations, np.linspace(horizon / 50, horizon, 50), side="right") - 1
    best: Array = np.where(at >= 0, costs[np.maximum(at, 0)], np.inf)
    return best


def table(rows: list[Row]) -> str:
    """Return a table: cost over the best of all rows and seeds (median, worst), seeds within 0.1 %, work."""
    best = min(float(row.costs.min()) for row in rows)
    lines = [
        f"{'optimizer':12s} {'median':>10s} {'worst':>10s} {'within 0.1 %':>13s} {'evaluations':>12s} {'seconds':>9s}"
    ]
    for row in sorted(rows, key=lambda r: float(np.median(r.costs))):
        ratios = row.costs / best
        lines.append(
            f"{row.name:12s} {np.median(ratios):10.5f} {ratios.max():10.5f} {np.mean(ratios < 1.001):13.0%} "
            f"{np.median(row.evaluations):12.0f} {np.median(row.seconds):9.3f}"
        )
    return "\n".join(lines)


def planted(model: str, drive: Array, dt: float, truth: dict[str, float]) -> Callable[[int], Objective]:
    """Return a factory of objectives for data of known parameters with 1 % noise; costs are multiples of the noise.

    The seed changes nothing about the data. The search starts at the model's own start values.
    """
    assembly = assemble(model)
    params = assembly.spec.params
    cube = Cube(params, np.arange(len(params)))
    theta = np.array([[truth.get(p.name, p.start) for p in params]])
    clean = assembly.simulate(drive, theta, dt)[0]
    level = NOISE * float(clean.std())
    measured = clean + level * np.random.default_rng(1).standard_normal(len(clean))

    def residuals(points: Array) -> Array:
        delta: Array = (assembly.simulate(drive, cube.to_theta(points), dt) - measured) / level
        return delta

    return lambda seed: Objective(residuals, cube.start, 0)


def coil(amplitude: float) -> Callable[[int], Objective]:
    """Return objectives of a coil at 1 Hz with a loop of visible width: the published values but for D = 1/20."""
    time_axis = np.arange(2000) / 1000.0
    drive = amplitude * np.sin(2.0 * np.pi * time_axis)[None, :]
    return planted("boucwen-flux", drive, 1e-3, {"A": 1.15, "Lc": 0.015, "n": 1.5, "D": 0.05, "kappa": 5.0})


def rotary() -> Callable[[int], Objective]:
    """Return objectives of a rotary damper at 3 Hz, as in rotary-stiffness paper Fig. 13."""
    assembly = assemble("rotational-erf")
    phase = 2.0 * np.pi * 3.0 * np.arange(2000) / 2000.0
    channels = {"angle": 0.3 * np.sin(phase), "angular_velocity": 0.3 * 6.0 * np.pi * np.cos(phase)}
    drive = np.stack([channels[name] for name in assembly.spec.inputs])
    moved = {p.name: p.start * 1.7 if p.start else p.low + 0.6 * (p.high - p.low) for p in assembly.spec.params}
    return planted("rotational-erf", drive, 5e-4, moved)


def main(seeds: int) -> None:
    """Print both comparisons."""
    for amplitude in (1.0, 3.0, 5.0):
        rows = compare(coil(amplitude), TABLE_2, seeds)
        print(f"\n000 Table 2: boucwen-flux, {amplitude:g} A, 1 Hz, {seeds} seeds, each optimizer's own budget")
        print(table(rows))
        fmin, hybrid = (next(r for r in rows if r.name == name) for name in ("fmin", "pso-fmin"))
        gain = 1.0 - float(np.median(hybrid.costs) / np.median(fmin.costs))
        print(f"pso-fmin lowers fmin's error by {gain:.2%} (paper: 0.11-0.69 %)")
    rows = compare(rotary(), FIGURE_13, seeds, FIGURE_13_EVALUATIONS)
    print(f"\n002 Fig. 13: rotational-erf, 3 Hz, {seeds} seeds, 40 x 800 evaluations")
    print(table(rows))
    ranking = sorted((r for r in rows if r.name != "auto"), key=lambda r: float(np.median(r.costs)))
    print("order by median:", " < ".join(r.name for r in ranking), "(paper: mwoa best, pso worst)")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
