"""A damper's test sheet of recordings in memory."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mrfit.api.options import check_names, settings_of, with_options
from mrfit.api.recordings import PathText, Recording, several
from mrfit.core.arguments import check_arguments
from mrfit.core.counting import number_of
from mrfit.io.bars import Heard, shown
from mrfit.io.schemas.sheet import SheetFile
from mrfit.settings.sheet import Settings
from mrfit.sheet.compute import SheetContent, sheet_of
from mrfit.sheet.write import SHEET_COLUMNS, table_rows, written

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


@dataclass(frozen=True, repr=False, eq=False)
class Sheet:
    """A test sheet.

    Attributes
    ----------
    content
        Content of sheet.json, all there is to say.
    computed
        The same with what its figures draw.
    """

    content: SheetFile
    computed: SheetContent

    @property
    def table(self) -> "DataFrame":
        """Every quantity of every condition, SI, with its 95 % interval, its verdict, or the reason why not."""
        from pandas import DataFrame

        return DataFrame(table_rows(self.content), columns=list(SHEET_COLUMNS))

    @property
    def verdicts(self) -> dict[str, str]:
        """Verdict of every unit: pass, fail or cannot be judged; empty without limits."""
        return {unit.unit: unit.verdict for unit in self.content.units}

    @check_arguments
    def plot(self, unit: str = "") -> "Figure":
        """Return the printed page of a unit, A4; default: the first.

        Raises
        ------
        DataError
            If there is no such unit.
        """
        from mrfit.errors import DataError, near
        from mrfit.report.svg import style
        from mrfit.sheet.print_page import draw

        units = {one.unit: one for one in self.content.units}
        wanted = unit or next(iter(units))
        if wanted not in units:
            raise DataError(f"there is no unit '{wanted}'{near(wanted, units)}; there are {', '.join(units)}")
        with style():
            return draw(self.computed, units[wanted])

    @check_arguments
    def save(self, folder: PathText, pdf: bool = False) -> SheetFile:
        """Write sheet.html, sheet.csv and sheet.json into a folder, and a PDF page of every unit where asked."""
        return written(self.computed, Path(folder), pdf)

    def __repr__(self) -> str:
        conditions = sum(len(unit.conditions) for unit in self.content.units)
        said = f"; {', '.join(f'{u} {v}' for u, v in self.verdicts.items() if v)}" if self.content.limits else ""
        return f"<Sheet: {number_of('unit', len(self.content.units))}, {number_of('condition', conditions)}{said}>"


@check_arguments
def sheet(
    recordings: Recording | Iterable[Recording],
    *,
    against: Recording | Iterable[Recording] = (),
    progress: Heard = True,
    **options: object,
) -> Sheet:
    """Compute a damper's test sheet, as ``mrfit measure sheet`` does, without a model.

    Parameters
    ----------
    recordings
        Logs of displacement and force; one, or several.
    against
        Logs to compare with, as of the same damper before a test.
    progress
        Whether to show a bar in a notebook and on a terminal, or a function called as ``progress(what, done, total)``.
    **options
        Those of ``mrfit measure sheet``, see below.

    Raises
    ------
    ConfigError
        If an option or a limit is wrong.
    DataError
        If no recording gives any quantity.

    Examples
    --------
    >>> import mrfit, numpy as np
    >>> time = np.arange(5000) / 500
    >>> log = mrfit.Recording.from_arrays(
    ...     dt=2e-3, displacement=0.01 * np.sin(6.2832 * time), force=314.16 * np.cos(6.2832 * time)
    ... )
    >>> found = mrfit.sheet(log).table.set_index("quantity")
    >>> round(float(found.loc["C_eq", "value"]))
    5000
    """
    check_names((Settings,), options)
    settings = settings_of(Settings, options)
    own = several(recordings)
    others = several(against) if isinstance(against, Recording) or list(against) else []
    with shown(progress) as told:
        computed = sheet_of(own, settings, others, told)
    return Sheet(computed.file, computed)


with_options(sheet, (Settings,), ())
