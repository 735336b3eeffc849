"""Results as text for a terminal and as HTML for a notebook; what comes from files is escaped."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mrfit.io.escapes import visible

if TYPE_CHECKING:
    from pandas import DataFrame

METRICS = ("condition", "role", "samples", "rmse", "nrmse", "noise_floor", "fit_percent")
NONE = "–"


@dataclass(frozen=True)
class Caution:
    """A reason to distrust a result.

    Attributes
    ----------
    kind
        Short machine-readable name, as in ``at-bound``.
    text
        One sentence.
    condition
        Condition whose parameters it is about; empty for the whole fit.
    """

    kind: str
    text: str
    condition: str = ""

    def __str__(self) -> str:
        place = f"{self.condition}: " if self.condition else ""
        return visible(f"warning {self.kind}: {place}{self.text}")


def frame_of(rows: Sequence[Mapping[str, Any]], columns: Sequence[str], index: str = "") -> "DataFrame":
    """Return rows as a data frame of these columns, nan for None in columns of numbers."""
    from pandas import DataFrame

    frame = DataFrame([{c: row.get(c) for c in columns} for row in rows], columns=list(columns))
    for name in columns:
        if frame[name].dtype == object and all(v is None or type(v) in (int, float) for v in frame[name]):
            frame[name] = frame[name].astype(float)
    return frame.set_index(index) if index else frame


def text_table(frame: "DataFrame") -> str:
    """Return a data frame as lines of text, numbers with four significant digits."""
    return _shown(frame, visible).to_string(float_format="{:.4g}".format, na_rep=NONE)


def html_table(frame: "DataFrame") -> str:
    """Return a data frame as an HTML table, escaped."""
    return _shown(frame, visible).to_html(float_format="{:.4g}".format, na_rep=NONE, border=0, escape=True)


def html_page(title: str, tables: Sequence[str], sentences: Sequence[object]) -> str:
    """Return what a notebook shows: a title, tables, and sentences, escaped but for the tables."""
    said = "".join(f"<li>{html.escape(visible(str(s)))}</li>" for s in sentences)
    return f"<p><b>{html.escape(visible(title))}</b></p>{''.join(tables)}" + (f"<ul>{said}</ul>" if said else "")


def _shown(frame: "DataFrame", clean: Any) -> "DataFrame":
    """Return a data frame without what would steer a terminal, its index as its first column where it has a name."""
    whole = frame.reset_index() if frame.index.name else frame
    made = whole.map(lambda v: clean(v) if isinstance(v, str) else v)
    made.columns = [clean(str(c)) for c in made.columns]
    made.index = [""] * len(made) if len(made) else made.index
    return made
