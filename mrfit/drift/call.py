"""The comparison of fits from Python, and the files that the command writes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from mrfit.api.fitting import FitResult
from mrfit.api.options import check_names, settings_of, with_options
from mrfit.api.recordings import PathText
from mrfit.api.words import frame_of
from mrfit.core.arguments import check_arguments
from mrfit.core.counting import number_of
from mrfit.drift import page
from mrfit.drift.analysis import Trend, compare
from mrfit.drift.draws import sets_of_units
from mrfit.drift.source import completed, values_of_fit, values_of_table
from mrfit.io.atomic import write_atomic
from mrfit.io.csv_table import csv_table
from mrfit.io.schemas.drift import DriftFile
from mrfit.io.workspace import checked, write_json, write_text
from mrfit.settings.drift import Settings

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, repr=False, eq=False)
class UnitComparison:
    """Result of a comparison of fits: what drifts, who stands out, in which range units lie.

    Attributes
    ----------
    content
        Content of drift.json, all there is to say.
    trends
        What its figures draw.
    """

    content: DriftFile
    trends: Sequence[Trend]

    @property
    def table(self) -> "DataFrame":
        """A row for every parameter and covariate, SI."""
        return frame_of(page.table_cells(self.content), page.CSV_COLUMNS)

    @property
    def drifts(self) -> "DataFrame":
        """The rows of what drifts."""
        table = self.table
        return table[table["drifts"].eq(True)]

    @check_arguments
    def save(self, folder: PathText) -> DriftFile:
        """Write drift.html, drift.csv and drift.json into a folder, and drawn units into its folder ssv."""
        root = Path(folder)
        # nothing is written where no units can be drawn
        drawn = list(sets_of_units(self.trends, self.content.draws, self.content.seed))
        files = [root / name for name in ("drift.html", "drift.csv", "drift.json")]
        write_text(files[0], page.render(self.content, self.trends))
        write_text(files[1], csv_table(page.CSV_COLUMNS, page.table_cells(self.content)))
        write_json(files[2], self.content)
        for name, content in drawn:
            write_atomic(root / "ssv" / name, partial(Path.write_bytes, data=content))
        files += [root / "ssv"] * bool(self.content.draws)
        return replace(self.content, files=[str(p) for p in files])

    def __repr__(self) -> str:
        c = self.content
        found = [f"{r.parameter} over {s.covariate}" for r in c.parameters for s in r.slopes if s.drifts]
        of = f"{number_of('unit', c.units)}, {number_of('test', c.tests)}"
        return f"<UnitComparison: {of}; drifts: {', '.join(found) or 'none'}>"


@check_arguments
def drift(results: "Mapping[str, FitResult] | DataFrame", **options: object) -> UnitComparison:
    """Compare fits over units, cycles, temperature or time, as ``mrfit drift`` does.

    Parameters
    ----------
    results
        Fits by the names of their logs, or a table as ``mrfit batch --table`` writes it, with columns of covariates.
    **options
        Those of ``mrfit drift``, see below.

    Raises
    ------
    ConfigError
        If an option is wrong or no fit states a covariate.
    DataError
        If no fit states a covariance.

    Examples
    --------
    >>> import mrfit, numpy as np, pandas as pd
    >>> rng = np.random.default_rng(1)
    >>> values = 300 + 5 * rng.standard_normal(8)
    >>> table = pd.DataFrame({"log": list("abcdefgh"), "parameter": "fy", "value": values})
    >>> table["low"], table["high"] = table["value"] - 1, table["value"] + 1
    >>> found = mrfit.drift(table)
    >>> found.content.units, found.content.parameters[0].tolerance_low < values.min()
    (8, True)
    """
    check_names((Settings,), options)
    settings = settings_of(Settings, options)
    if isinstance(results, Mapping):
        values = [v for name, one in results.items() for v in values_of_fit(one.content, str(name), settings.at)]
    else:
        values = values_of_table(results)
    found, trends = compare(completed(values, settings), settings)
    return UnitComparison(checked(found), trends)


with_options(drift, (Settings,), ())
