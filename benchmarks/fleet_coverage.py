"""Simulated fleets: how often intervals over units hold the truth, what stands out, which drifts are found.

    python -m benchmarks.fleet_coverage [--fleets 200] [--nulls 300] > docs/benchmarks/fleet.md

Fleets of 5, 10, 30 and 50 units: normal, Student's t of 4 degrees, one faulty unit 6 standard deviations off; variances
of the fits a hundredth of that between units, or 0.1 to 1 of it, tenfold apart. Docs: docs/benchmarks/fleet.md.
"""

import argparse
import time
from collections.abc import Iterator

import numpy as np
from scipy import stats

import mrfit
from mrfit.core.specs import Array
from mrfit.drift.population import TAIL_DEGREES, TAIL_PRIOR, odd_units, population
from tests.drift.fleets import MEANS, fleet

MEAN, SIGMA, FAULT, BETWEEN = 2.0, 0.1, 6.0, 0.05
UNITS = (5, 10, 30, 50)
LAWS = ("normal", "t, 4 degrees", "one faulty", "laws of the prior")
SPREADS = ((0.01, 0.01), (0.1, 1.0))
DRIFTS = ((0.0, 10), (0.005, 10), (0.01, 10), (0.015, 10), (0.02, 10), (0.025, 10), (0.03, 10), (0.02, 20), (0.02, 40))
TESTS, SHARE_BELOW = 5, 0.95
HEAD = """# Fleets of units

`python -m benchmarks.fleet_coverage --fleets {fleets} --nulls {nulls} --seed {seed} > docs/benchmarks/fleet.md`

Fleets of one parameter, {fleets} of each row. Known variances of the fits are shares of that between units; 0.1 to 1
are tenfold apart within a fleet. `mean` and `sigma`: how often the 95 % intervals hold the truth. `95/95`: fleets whose
tolerance interval holds at least 95 % of sound units. It allows for tails heavier than normal, which few units do not
show, so that it holds normal units more often. `variance`: median of the estimate over the truth; `sample`: the same
of the sound units' own sample variance, without errors of fits, which has no bias but under heavy tails a low median.
Units that stand out take no part in mean, sigma and variance: the estimate is that of the others. `first`: the faulty
unit, 6 standard deviations off, has the greatest studentised residual; `named`: it is said to stand out.
`false`: sound units that are said to stand out. Levels and numbers of candidates were chosen on other seeds.
`laws of the prior`: half of the fleets are normal, the others Student's t of 3, 4, 6 or 10 degrees, as the tolerance
interval takes it before it sees any unit. `first three laws`: every fleet of the three laws above it.
"""


def degrees_of(law: str, rng: np.random.Generator) -> float:
    """Return the degrees of freedom of Student's t that a fleet's units follow; the greatest is as good as normal."""
    if law == "laws of the prior":
        return float(rng.choice(TAIL_DEGREES, p=TAIL_PRIOR))
    return 4.0 if law.startswith("t,") else float(TAIL_DEGREES[-1])


def drawn(rng: np.random.Generator, degrees: float, units: int, spread: tuple[float, float]) -> tuple[Array, ...]:
    """Return units off their mean in standard deviations of their law, and known variances and errors of their fits."""
    own = rng.standard_t(degrees, units) * np.sqrt(1.0 - 2.0 / degrees)
    low, high = np.log10(spread).tolist()
    variances = SIGMA**2 * 10.0 ** rng.uniform(low, high, units)
    return own, variances, np.sqrt(variances) * rng.standard_normal(units)


def content(degrees: float, low: float, high: float) -> float:
    """Return the share of sound units in an interval."""
    ends = (np.array([low, high]) - MEAN) / SIGMA
    return float(np.diff(stats.t.cdf(ends / np.sqrt(1.0 - 2.0 / degrees), degrees))[0])


def farthest(values: Array, variances: Array) -> int:
    """Return the unit of the greatest residual against all others, in standard deviations."""
    found = {}
    for k in np.argsort(-np.abs(population(values, variances).scores))[:3]:
        rest = population(np.delete(values, k), np.delete(variances, k))
        found[int(k)] = abs(values[k] - rest.mean) / np.sqrt(rest.variance + variances[k] + np.var(rest.means))
    return max(found, key=lambda k: found[k])


def coverage(fleets: int, seed: int) -> Iterator[str]:
    shown = ("mean (%)", "sigma (%)", "95/95 (%)", "variance", "sample", "first (%)", "named (%)", "false (%)")
    yield f"| law | c/ω² | units | {' | '.join(shown)} |"
    yield "|---|---|---|---|---|---|---|---|---|---|---|"
    found: dict[tuple[str, tuple[float, float], int], Array] = {}
    for law in LAWS:
        for spread in SPREADS:
            for units in UNITS:
                first = seed + 1000 * len(found)
                found[law, spread, units] = np.array([judged(law, spread, units, first + k) for k in range(fleets)])
                yield shares_of(law, spread, units, found[law, spread, units])
            yield shares_of(law, spread, "all", np.vstack([found[law, spread, units] for units in UNITS]))
    for number in (*UNITS, "all"):
        some = [rows for (law, _, units), rows in found.items() if law != LAWS[-1] and number in (units, "all")]
        yield shares_of("first three laws", (SPREADS[0][0], SPREADS[1][1]), number, np.vstack(some))


def judged(law: str, spread: tuple[float, float], units: int, seed: int) -> tuple[float, ...]:
    """Return of one fleet what its intervals hold, the ratio of variances, and what is said of units."""
    rng = np.random.default_rng(seed)
    degrees = degrees_of(law, rng)
    own, variances, errors = drawn(rng, degrees, units, spread)
    sample = float(np.var(own, ddof=1))
    own[0] += FAULT * (law == "one faulty")
    values = MEAN + SIGMA * own + errors
    odd = [place for place, _, _ in odd_units(values, variances, units)]
    found = population(values, variances, odd)
    low, high = found.mean_interval
    least, most = found.sigma_interval
    faulty = law == "one faulty"
    held = (low <= MEAN <= high, least <= SIGMA <= most, content(degrees, *found.tolerance) >= 0.95)
    named = (faulty and farthest(values, variances) == 0, 0 in odd, len(set(odd) - ({0} if faulty else set())) / units)
    return (*held, found.variance / SIGMA**2, sample, *named)


def shares_of(law: str, spread: tuple[float, float], units: int | str, rows: Array) -> str:
    """Return a row of the table of what was judged, fleet by fleet (N, 8)."""
    mean, sigma, both, _, _, first, named, false = 100.0 * rows.mean(axis=0)
    told = (f"{first:.1f}", f"{named:.1f}") if law == "one faulty" else ("", "")
    share = "–".join(f"{s:g}" for s in dict.fromkeys(spread))
    medians = (f"{x:.2f}" for x in np.median(rows[:, 3:5], axis=0))
    cells = (law, share, units, *(f"{x:.1f}" for x in (mean, sigma, both)), *medians, *told)
    return f"| {' | '.join(map(str, cells))} | {false:.2f} |"


def power(nulls: int, seed: int) -> Iterator[str]:
    yield "| change over life (%) | units | fleets | named (%) | alone (%) | change / standard error | bound (%) |"
    yield "|---|---|---|---|---|---|---|"
    for row, (change, units) in enumerate(DRIFTS):
        count = nulls if change == 0.0 else max(nulls // 6, 1)
        life = np.tile(np.linspace(0.0, 20000.0, TESTS), units)
        # 95 % of units are below it at the end of their life
        worst = MEANS["fy"] * np.exp(change + BETWEEN * stats.norm.ppf(SHARE_BELOW))
        alone, named, held, errors = 0, 0, 0, []
        for k in range(count):
            rng = np.random.default_rng(seed + 500000 + 1000 * row + k)
            changes = [("fy", "cycles", change)]
            table = fleet(rng, units, TESTS, between=BETWEEN, changes=changes, columns={"cycles": life})
            found = mrfit.drift(table, over="cycles", unit="{unit}_*").content
            drifts = {r.parameter for r in found.parameters for s in r.slopes if s.drifts}
            steps = any(r.change for r in found.parameters)
            named += "fy" in drifts if change else bool(drifts or steps)
            alone += drifts == {"fy"} and not steps
            fy = next(r for r in found.parameters if r.parameter == "fy")
            held += fy.greatest is not None and fy.greatest >= worst
            errors.append(20.0 * (fy.slopes[0].high - fy.slopes[0].low) / 4.0)
        told = (f"{100 * alone / count:.1f}", f"{change / np.median(errors):.1f}") if change else ("", "")
        cells = (f"{100 * change:g}", units, count, f"{100 * named / count:.1f}", *told, f"{100 * held / count:.1f}")
        yield f"| {' | '.join(map(str, cells))} |"


def warming(fleets: int, seed: int) -> str:
    """Return how often a drift by temperature is called one, beside a cycle count that rises with it."""
    named = {over: 0 for over in ("cycles", "cycles,temperature")}
    for k in range(fleets):
        rng = np.random.default_rng(seed + 900000 + k)
        warm = np.tile(np.linspace(20.0, 60.0, TESTS), 10) + 5.0 * rng.standard_normal(10 * TESTS)
        columns = {"cycles": np.tile(np.linspace(0.0, 20000.0, TESTS), 10), "temperature": warm}
        changes = [(name, "temperature", -0.15) for name in ("fy", "c")]
        table = fleet(rng, 10, TESTS, changes=changes, columns=columns)
        for over in named:
            causes = mrfit.drift(table, over=over, unit="{unit}_*").content.causes
            named[over] += {c.effect for c in causes} == {"temperature"}
    shares = " and ".join(f"{100.0 * n / fleets:.1f} % with `--over {over}`" for over, n in named.items())
    return (
        f"Yield and viscous parts that fall by 15 % over 40 K, {fleets} fleets: `temperature` alone named in {shares}."
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    for name, value in (("fleets", 200), ("nulls", 300), ("seed", 6100000)):
        parser.add_argument(f"--{name}", type=int, default=value)
    given = parser.parse_args()
    print(HEAD.format(**vars(given)))
    for line in coverage(given.fleets, given.seed):
        print(line, flush=True)
    if given.nulls:
        print(
            f"\nDrift of one parameter of three over 20 000 cycles, units tested {TESTS} times. Units differ by 5 %,\n"
            "tests of one by 1 %, fits by 1 %. `named`: the drift is; at no change, any drift or step. `alone`: and\n"
            "no other drift or step. `bound`: the one-sided bound holds 95 % of units at the end of their life.\n"
        )
        for line in power(given.nulls, given.seed):
            print(line, flush=True)
        print(f"\n{warming(given.fleets // 4, given.seed)}", flush=True)
    start = time.process_time()
    found = mrfit.drift(fleet(np.random.default_rng(given.seed), 2000)).content
    spent = time.process_time() - start
    print(f"\n2 000 units of {len(found.parameters)} parameters took {spent:.1f} s of one processor.")


if __name__ == "__main__":
    main()
