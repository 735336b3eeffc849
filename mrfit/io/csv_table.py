"""Tables as text with commas, the same bytes for the same numbers."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from mrfit.io.escapes import visible

# What begins a formula in a spreadsheet, also in the wide signs of Asian scripts
FORMULA = ("=", "+", "-", "@", "\n", "＝", "＋", "－", "＠")


def csv_table(columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    r"""Return rows under a line of column names; numbers with every digit, nothing for None and nan.

    What rows hold beside the columns is left out. Text that a spreadsheet would take for a formula has an apostrophe
    before it, and control characters but line feeds are shown, as in ``\r``.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, extrasaction="ignore", lineterminator="\n")
    writer.writerow({c: _inert(c) for c in columns})
    # nan alone is not equal to itself
    writer.writerows({c: _inert(v) for c, v in row.items() if v == v} for row in rows)
    return text.getvalue()


def _inert(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    text = "\n".join(visible(line) for line in value.split("\n"))
    return f"'{text}" if text.startswith(FORMULA) else text
