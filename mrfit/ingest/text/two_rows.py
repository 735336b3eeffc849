"""Names above units, over the first row of as many numbers, whatever their words are."""

from dataclasses import dataclass

from mrfit.ingest.text.body import NO_VALUE, split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import MARK, OVERLOAD, are_units, is_name_row, is_number, trimmed


@dataclass(frozen=True, slots=True)
class TwoRows:
    """A row of names above a row of units: their cells, and the lines (from 0) of the units and of the first row."""

    names: list[str]
    units: list[str]
    unit_row: int
    first: int


def two_rows(head: Head, delimiter: str = "\t") -> TwoRows | None:
    """Return names and units that stand, one above the other, over the first row of as many numbers.

    Blank lines may stand between. What the words are does not matter.
    """
    above: list[tuple[int, list[str]]] = []
    found: TwoRows | None = None
    for place, line in enumerate(head.lines):
        cells = trimmed(split(line, delimiter))
        if not cells:
            continue
        numbers = [is_number(c) for c in cells]
        marked = any(map(OVERLOAD.fullmatch, cells)) or all(map(MARK.fullmatch, cells))
        row = any(numbers) or marked
        if row and len(above) == 2 and all(len(c) == len(cells) > 1 and is_name_row(c) for _, c in above):
            (_, names), (unit_row, written) = above
            if found is None or not are_units(names):  # units that are given twice are no names
                found = TwoRows(names, written, unit_row, place)
        fits = found is not None and row and len(cells) == len(found.names)
        if fits and any(numbers) and all(n or c in NO_VALUE for n, c in zip(numbers, cells, strict=True)):
            return found
        above = [] if fits else [*above[-1:], (place, cells)]
    return None
