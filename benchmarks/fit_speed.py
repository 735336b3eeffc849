"""How long whole fits take, as ratios in one run: ``python -m benchmarks.fit_speed``.

Seconds are those of the process (user + system) with one BLAS thread, the best of several repeats, since the machine
may be shared; two processes against one are measured by the clock on the wall.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import itertools  # noqa: E402
import json  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

from benchmarks.command import run_mrfit  # noqa: E402
from benchmarks.planted import problem, sine_log  # noqa: E402
from mrfit.core.executors.order import in_processes  # noqa: E402
from mrfit.core.progress import Progress, silent  # noqa: E402
from mrfit.core.specs import Array  # noqa: E402
from mrfit.fit.diagnostics.uncertainty import analyse  # noqa: E402
from mrfit.fit.identify import FitGroup, SearchSettings, linearise, search_optimum  # noqa: E402
from mrfit.search.cube import Cube  # noqa: E402
from mrfit.search.problem import LeastSquaresProblem  # noqa: E402
from mrfit.simulate.assembly import Assembly, assemble  # noqa: E402

Problem = tuple[FitGroup, Assembly, Cube]
RACED = (
    "boucwen-flux", "bingham", "herschel-bulkley", "hysteretic-biviscous", "guo", "tanh", "boucwen", "rotational-erf",
    "rotational-hybrid",
)  # fmt: skip
OTHERS = ("pso-fmin", "cma-lsq", "lsq")
PARTICLES, ITERATIONS = 40, 400
ODEINT_RUNS = 40


def fit(posed: Problem, optimizer: str = "auto") -> dict[str, float]:
    """Return cost and evaluations of one search, nothing but the search."""
    group, assembly, cube = posed
    settings = SearchSettings(optimizer, 0, None, None, "none")
    found = search_optimum(group, assembly, cube, cube.start[None, :], settings, lambda evaluations, cost: None)
    return {"cost": found.cost, "evaluations": found.nfev, "point": found.point}


def best_time(run: Callable[[], object], repeats: int = 5, clock: Callable[[], float] = time.process_time) -> float:
    """Return the least seconds of several runs."""
    seconds = []
    for _ in range(repeats):
        begin = clock()
        run()
        seconds.append(clock() - begin)
    return min(seconds)


def race() -> None:
    """Print auto against the other optimizers: error over the best of them, time over that of pso-fmin."""
    print("\nauto against pso-fmin, cma-lsq and lsq on planted data, 1 % noise, 20 000 samples per condition")
    print(f"{'model':32s} {'conditions':>10s} {'error/best - 1':>15s} {'ms':>8s} {'pso-fmin ms':>12s} {'ratio':>6s}")
    ratios, excesses = [], []
    for name in RACED:
        for conditions in (1, 3):
            posed = problem(name, conditions, 20_000, np.random.default_rng(1))
            own = fit(posed)
            seconds = best_time(lambda posed=posed: fit(posed))
            begin = time.process_time()
            costs = [fit(posed, OTHERS[0])["cost"]]
            swarm = time.process_time() - begin
            costs += [fit(posed, other)["cost"] for other in OTHERS[1:]]
            excesses.append(own["cost"] / min(costs) - 1.0)
            ratios.append(swarm / seconds)
            print(
                f"{name:32s} {conditions:10d} {excesses[-1]:15.2e} {1e3 * seconds:8.1f} {1e3 * swarm:12.1f} "
                f"{ratios[-1]:6.0f}",
                flush=True,
            )
    met = sum(r >= 50.0 for r in ratios)
    print(f"error within 0.1 % of the best: {sum(e < 1e-3 for e in excesses)} of {len(excesses)} (aim: all)")
    print(f"at least 50 times faster than pso-fmin: {met} of {len(ratios)} (aim: all); median {np.median(ratios):.0f}")


def user_fit(posed: Problem) -> tuple[float, float]:
    """Return seconds and cost of what a user writes: a swarm of 40 x 400 over odeint, polished by SLSQP.

    The swarm's path is run with the kernel, to the same end; its time is that of one odeint simulation, measured over
    40 points of the swarm, times the evaluations.
    """
    from scipy.integrate import odeint
    from scipy.optimize import minimize

    group, assembly, cube = posed
    block = group.full[0]
    current, times = block.drive[0], np.arange(block.drive.shape[1]) * block.dt
    rate = np.gradient(current, block.dt)

    def simulate(point: Array) -> Array:
        a, lc, kappa, beta, gamma, n, d = cube.to_theta(point[None, :])[0]

        def law(z: Array, t: float) -> float:
            di = np.interp(t, times, rate)
            size = abs(z[0])
            return float(kappa * di - beta * di * size**n - gamma * z[0] * abs(di) * size ** (n - 1.0))

        z = odeint(law, 0.0, times)[:, 0]
        return np.asarray(a * lc * current + (1.0 - a) * lc / d * z)

    rng = np.random.default_rng(0)
    points = np.clip(cube.start + 0.1 * rng.standard_normal((ODEINT_RUNS, len(cube.start))), 0.0, 1.0)
    begin = time.process_time()
    for point in points:
        simulate(point)
    each = (time.process_time() - begin) / ODEINT_RUNS
    residuals = LeastSquaresProblem([block], np.ones(1), assembly, cube).residuals

    def cost(point: Array) -> float:
        return float(np.mean(residuals(np.atleast_2d(point))[0] ** 2))

    best, evaluations = swarm(residuals, len(cube.start), rng)
    polished = minimize(cost, best, method="SLSQP", bounds=[(0.0, 1.0)] * len(best), options={"ftol": 1e-14})
    return each * (evaluations + polished.nfev), float(np.sqrt(polished.fun))


def swarm(residuals: Callable[[Array], Array], dimension: int, rng: np.random.Generator) -> tuple[Array, int]:
    """Return the best point of a plain particle swarm (inertia 0.7, pulls 1.5) and its evaluations."""
    places = rng.random((PARTICLES, dimension))
    speeds = np.zeros_like(places)
    own, own_costs = places.copy(), np.full(PARTICLES, np.inf)
    for _ in range(ITERATIONS):
        costs = np.mean(residuals(places) ** 2, axis=1)
        better = costs < own_costs
        own[better], own_costs[better] = places[better], costs[better]
        leader = own[int(np.argmin(own_costs))]
        pulls = 1.5 * rng.random((2, PARTICLES, dimension))
        speeds = 0.7 * speeds + pulls[0] * (own - places) + pulls[1] * (leader - places)
        places = np.clip(places + speeds, 0.0, 1.0)
    return own[int(np.argmin(own_costs))], PARTICLES * ITERATIONS


def scipy_fit(posed: Problem) -> tuple[float, float]:
    """Return seconds and cost of scipy's least_squares from four starts, one simulation per kernel call."""
    from scipy.optimize import least_squares

    group, assembly, cube = posed
    residuals = LeastSquaresProblem([group.full[0]], np.ones(1), assembly, cube).residuals

    def one(point: Array) -> Array:
        values: Array = residuals(point[None, :])[0]
        return values

    rng = np.random.default_rng(0)
    starts = [np.clip(cube.start, 0.01, 0.99), *rng.uniform(0.05, 0.95, (3, len(cube.start)))]
    begin = time.process_time()
    costs = [least_squares(one, start, bounds=(0.0, 1.0)).cost for start in starts]
    seconds = time.process_time() - begin
    return seconds, float(np.sqrt(2.0 * min(costs) / (group.full[0].samples + 1)))


def against_users() -> None:
    """Print the default fit and pso-fmin against what users write."""
    posed = problem("boucwen-flux", 1, 20_000, np.random.default_rng(1))
    own, seconds = fit(posed), best_time(lambda: fit(posed))
    begin = time.process_time()
    hybrid = fit(posed, "pso-fmin")
    hybrid_seconds = time.process_time() - begin
    user_seconds, user_cost = user_fit(posed)
    trf_seconds, trf_cost = scipy_fit(posed)
    print("\none condition of boucwen-flux, 20 000 samples")
    print(f"{'fit':52s} {'s':>9s} {'error/auto':>11s} {'auto is faster':>15s} {'pso-fmin is':>12s} {'aim':>14s}")
    rows = [
        ("auto", seconds, own["cost"], ""),
        ("pso-fmin, folded", hybrid_seconds, hybrid["cost"], ">= 50"),
        ("swarm 40 x 400 + odeint + SLSQP (from 40 odeint runs)", user_seconds, user_cost, ">= 10000, 20"),
        ("scipy least_squares, 4 starts, kernel, all samples", trf_seconds, trf_cost, ">= 100"),
    ]
    for name, taken, cost, aim in rows:
        print(
            f"{name:52s} {taken:9.4f} {cost / own['cost']:11.5f} {taken / seconds:15.0f} "
            f"{taken / hybrid_seconds:12.2g} {aim:>14s}"
        )


def with_intervals(posed: Problem) -> None:
    """Search, and compute intervals."""
    group, assembly, cube = posed
    point = np.array(fit(posed)["point"])
    found = linearise(group, assembly, cube, point, "none")
    analyse(found.jacobians, found.residuals, found.periods)


def growth() -> None:
    """Print how time grows with samples and conditions, and what a second process brings."""
    rng = np.random.default_rng(1)
    print("\ngrowth of auto on boucwen-flux")
    few, many = (problem("boucwen-flux", 1, n, rng) for n in (10_000, 200_000))
    short, long = best_time(lambda: fit(few)), best_time(lambda: fit(many))
    print(f"{'200 000 samples over 10 000, same cycle':46s} {long / short:7.2f} (aim: <= 2)")
    joint = problem("boucwen-flux", 15, 20_000, rng)
    seconds = best_time(lambda: with_intervals(joint), 3)
    print(f"{'15 conditions x 20 000 jointly, with intervals':46s} {seconds:7.2f} s (aim: <= 1 s)")
    singles = [problem("boucwen-flux", 1, 20_000, np.random.default_rng(k)) for k in range(30)]
    one = best_time(lambda: fit(singles[0]))
    ten = best_time(lambda: [fit(p) for p in singles], 2)
    print(f"{'30 conditions one by one over one':46s} {ten / one:7.1f} (aim: <= 24)")
    walls = [best_time(lambda n=n: _side_by_side(singles, n), 3, time.perf_counter) for n in (1, 2)]
    print(f"{'2 processes, 30 conditions':46s} {walls[0] / walls[1]:7.2f} times faster (aim: >= 1.7)")
    spencer = problem("spencer", 1, 50_000, rng)
    print(f"{'spencer, 50 000 samples, 14 parameters':46s} {best_time(lambda: fit(spencer), 1):7.2f} s (aim: <= 5 s)")


def _side_by_side(problems: list[Problem], jobs: int) -> None:
    list(in_processes(_fit_one, problems, jobs, silent))


def _fit_one(posed: Problem, told: Progress) -> None:
    fit(posed)


def commands() -> None:
    """Print what the whole command takes by the clock on the wall, from the start of Python to the last table."""
    print("\n`mrfit fit --model tanh --per condition`, 20 000 samples each")
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder) / "work"
        run_mrfit(work, "ingest", *(_written(Path(folder), number) for number in range(30)))
        first = json.loads(run_mrfit(work, "segment", "--json"))["conditions"][0]["condition"]
        runs = {"one": ("1", first), "thirty": ("1", ""), "two jobs": ("2", "")}
        seconds = {name: _command_time(work, name, *choice) for name, choice in runs.items()}
    print(f"{'one condition':46s} {seconds['one']:7.2f} s")
    print(f"{'30 conditions over one':46s} {seconds['thirty'] / seconds['one']:7.1f} (aim: <= 24)")
    print(f"{'30 conditions, --jobs 2':46s} {seconds['thirty'] / seconds['two jobs']:7.2f} times faster")


def _written(folder: Path, number: int) -> str:
    """Write a planted log of a condition of its own as CSV, and return its path."""
    assembly = assemble("tanh")
    recording, _ = sine_log(assembly, assembly.spec.start[None, :], number, 20_000)
    stroke, force = (recording.channels[name] for name in ("displacement", "force"))
    force = force + 0.01 * np.std(force) * np.random.default_rng(number).standard_normal(len(force))
    path = folder / f"log-{number}-{1 + number // 15}A.csv"
    columns = np.stack([np.arange(len(force)) * recording.dt, stroke, force], axis=1)
    np.savetxt(path, columns, "%.9g", ",", header="time [s],displacement [m],force [N]", comments="")
    return str(path)


def _command_time(work: Path, name: str, jobs: str, only: str) -> float:
    names = (f"{name}-{number}".replace(" ", "-") for number in itertools.count())
    return best_time(
        lambda: run_mrfit(work, "fit", "--model", "tanh", "--jobs", jobs, "--only", only, "--name", next(names)),
        3,
        time.perf_counter,
    )


def main() -> None:
    """Print all tables."""
    against_users()
    growth()
    commands()
    race()


if __name__ == "__main__":
    main()
