"""Tables as text with commas, the same bytes for the same numbers."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any


def csv_table(columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    """Return rows under a line of column names; numbers with every digit, nothing for None and nan.

    What rows hold beside the columns is left out.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    # nan alone is not equal to itself
    writer.writerows({c: v for c, v in row.items() if v == v} for row in rows)
    return text.getvalue()
