"""Units drawn from a population as SSP parameter sets (.ssv).

A drawn unit has mean and standard deviation from the draws of these, and a normal deviation. Deviations of parameters
are correlated as those of the units, whose correlation R is drawn towards none: (n·R + K·I)/(n + K) of n units and K
parameters.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from mrfit.core.specs import Array
from mrfit.drift.analysis import Trend
from mrfit.errors import ConfigError
from mrfit.export.c_parts import prefix_of
from mrfit.export.ssv import parameter_set


def sets_of_units(trends: Sequence[Trend], draws: int, seed: int) -> Iterator[tuple[str, bytes]]:
    """Yield file names and contents of drawn units, condition by condition.

    Raises
    ------
    ConfigError
        If no parameter of a model has a population.
    """
    own = [t for t in trends if t.population and t.rows[0].settable]
    if draws and not own:
        raise ConfigError(
            "--draws: no parameter here has a population; it takes fits (no tables) of three units or more"
        )
    for condition in dict.fromkeys(t.rows[0].condition for t in own):
        chosen = [t for t in own if t.rows[0].condition == condition]
        prefix = prefix_of(condition)
        for k, values in enumerate(drawn_units(chosen, draws, seed), 1):
            cells = [(t.rows[0].parameter, t.rows[0].unit, float(v)) for t, v in zip(chosen, values, strict=True)]
            name = f"{prefix}_{k:0{max(3, len(str(draws)))}d}"
            head = [
                f"Draw {k} of {draws}, seed {seed}, from the population of {len(chosen[0].names)} units of "
                f"{chosen[0].rows[0].model}, {condition}.",
                "A parameter that is missing here is not determined in the fits: it keeps the value that it has.",
            ]
            yield f"{name}.ssv", parameter_set(name, f"a unit like those compared, {condition}", cells, head)


def drawn_units(trends: Sequence[Trend], draws: int, seed: int) -> Array:
    """Return parameters (draws, K) of units from populations of one condition, SI."""
    scores = [dict(zip(t.names, t.population.scores, strict=True)) for t in trends if t.population]
    odd = {t.names[k] for t in trends for k, _, _ in t.odd}
    common = [n for n in scores[0] if n not in odd and all(n in s for s in scores)]
    correlation = np.eye(len(trends))
    if len(common) > 2:
        # a parameter that is the same in all units is correlated with no other
        with np.errstate(invalid="ignore"):
            seen = np.nan_to_num(np.atleast_2d(np.corrcoef([[s[n] for n in common] for s in scores])))
        np.fill_diagonal(seen, 1.0)
        correlation = (len(common) * seen + len(trends) * correlation) / (len(common) + len(trends))
    rng = np.random.default_rng(seed)
    normal = rng.standard_normal((draws, len(trends))) @ np.linalg.cholesky(correlation).T
    columns = []
    for trend, column in zip(trends, normal.T, strict=True):
        found = trend.population
        assert found is not None
        place = rng.integers(len(found.means), size=draws)
        values = found.means[place] + found.sigmas[place] * column
        columns.append(np.exp(values) if trend.rows[0].log_scale else values)
    return np.array(columns).T
