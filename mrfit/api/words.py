"""Results as text for a terminal and as HTML for a notebook; what comes from files is escaped."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mrfit.io.escapes import visible
from mrfit.io.schemas.fit import Fit, MetricRow, Result
from mrfit.report.determined import measured
from mrfit.report.numbers import percent
from mrfit.report.output_unit import output_unit

if TYPE_CHECKING:
    from pandas import DataFrame

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


def errors_of(fit: Fit, rows: Sequence[MetricRow]) -> "DataFrame":
    """Return errors as people read them: in the output's unit, and in percent of the measured range."""
    scale = output_unit(fit)
    table = [
        {
            "condition": m.condition,
            "role": m.role,
            "samples": m.samples,
            "error": scale.words(m.rmse),
            "of the range": percent(m.nrmse),
            "noise floor": scale.words(m.noise_floor),
            "fit": percent(None if m.fit_percent is None else m.fit_percent / 100.0),
        }
        for m in rows
    ]
    return frame_of(table, ("condition", "role", "samples", "error", "of the range", "noise floor", "fit"))


def parameters_of(result: Result) -> "DataFrame":
    """Return parameters and derived quantities with their 95 % intervals and how well they are determined."""
    called = f"parameter, {result.condition}"
    rows = [
        {called: q.name, "value": measured(q), "determined": str(q.determined)}
        for q in (*result.parameters, *result.derived)
    ]
    return frame_of(rows, (called, "value", "determined"))


def text_table(frame: "DataFrame") -> str:
    """Return a data frame as lines of text, numbers with four significant digits."""
    return _shown(frame, visible).to_string(float_format="{:.4g}".format, na_rep=NONE)


def html_table(frame: "DataFrame") -> str:
    """Return a data frame as an HTML table, escaped."""
    return _shown(frame, visible).to_html(float_format="{:.4g}".format, na_rep=NONE, border=0, escape=True)


def html_page(title: str, tables: Sequence[str], sentences: Sequence[object]) -> str:
    """Return the HTML of a notebook: a title, tables, and sentences, escaped but for the tables."""
    said = "".join(f"<li>{html.escape(visible(str(s)))}</li>" for s in sentences)
    return f"<p><b>{html.escape(visible(title))}</b></p>{''.join(tables)}" + (f"<ul>{said}</ul>" if said else "")


class PrintableResult:
    """Result that is text on a terminal and HTML in a notebook."""

    def _parts(self) -> "tuple[str, Sequence[DataFrame], Sequence[object]]":
        """Return its title, its tables, and sentences below these."""
        raise NotImplementedError

    def __repr__(self) -> str:
        title, tables, said = self._parts()
        return "\n".join([title, *map(text_table, tables), *map(str, said)])

    def _repr_html_(self) -> str:
        title, tables, said = self._parts()
        return html_page(title, [*map(html_table, tables)], said)


def _shown(frame: "DataFrame", clean: Any) -> "DataFrame":
    """Return a data frame without what would steer a terminal, its index as its first column where it has a name."""
    whole = frame.reset_index() if frame.index.name else frame
    made = whole.map(lambda v: clean(v) if isinstance(v, str) else v)
    made.columns = [clean(str(c)) for c in made.columns]
    made.index = [""] * len(made) if len(made) else made.index
    return made
