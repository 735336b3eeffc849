"""Fleets of units whose population is known, as rows of a table."""

from collections.abc import Sequence

import numpy as np
from pandas import DataFrame

from mrfit.core.specs import Array

MEANS = {"fy": 300.0, "c": 900.0, "f0": 20.0}
ROLES = {"fy": "yield", "c": "viscous", "f0": "offset"}
LOGARITHMIC = {"fy", "c"}


def fleet(
    rng: np.random.Generator,
    units: int,
    tests: int = 1,
    *,
    between: float = 0.05,
    within: float = 0.01,
    known: float = 0.01,
    changes: Sequence[tuple[str, str, float]] = (),
    columns: dict[str, Array] | None = None,
) -> DataFrame:
    """Return a table of parameters; deviations are shares of the means.

    Parameters
    ----------
    rng
        What draws.
    units, tests
        Units, and tests of each.
    between, within, known
        Standard deviations between units, between tests of one, and of each fit.
    changes
        Parameter, covariate, and its share of change over the covariate's range.
    columns
        Covariates by test, of units one after the other (units·tests,).
    """
    columns = columns or {}
    rows = []
    for name, mean in MEANS.items():
        share = between * np.repeat(rng.standard_normal(units), tests)
        share += np.hypot(within if tests > 1 else 0.0, known) * rng.standard_normal(units * tests)
        for parameter, covariate, change in changes:
            if parameter == name:
                share += change * (columns[covariate] - columns[covariate].min()) / np.ptp(columns[covariate])
        for k, one in enumerate(share):
            log = name in LOGARITHMIC
            rows.append(
                {
                    **{"log": f"u{k // tests:03d}_t{k % tests}", "condition": "sine", "parameter": name, "unit": "N"},
                    **{"role": ROLES[name], "scale": "log" if log else "linear", "place": k},
                    "value": mean * (np.exp(one) if log else 1.0 + one),
                    "sd": known * (1.0 if log else mean),
                    **{n: float(v[k]) for n, v in columns.items()},
                }
            )
    rows.sort(key=lambda row: row["place"])
    names = list(MEANS)
    for row in rows:
        matrix = np.zeros(len(names))
        matrix[names.index(row["parameter"])] = row.pop("sd") ** 2
        row["covariance"] = matrix
    return DataFrame(rows).drop(columns="place")
