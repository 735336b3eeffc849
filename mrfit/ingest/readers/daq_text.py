"""DAQami and TracerDAQ text logs: ``Header Size:`` lines, time stamps, pauses told in an Events field."""

import re
from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array, ReaderSpec
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.table import Column, RejectedRow, Source, Table
from mrfit.ingest.text.body import Body, Layout, number_pattern, split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.textlog import Field, body_of, found_line, positive, table_of, text_of
from mrfit.ingest.time.rate import with_rate

SPEC = ReaderSpec("daq-text", "DAQami/TracerDAQ text log", blocks=True)
STAMP_FORMS = ("%m/%d/%Y %I:%M:%S.%f %p", "%d/%m/%Y %I:%M:%S.%f %p", "%m/%d/%Y %H:%M:%S.%f", "%d/%m/%Y %H:%M:%S.%f")
COMMA_AND_BLANK = re.compile(rb",[ \t]+")
COMMA_SAMPLE = 400
# Least share of stamps of one form, and the rows from which it has to be met further down in a log
READABLE, MANY_STAMPS = 0.9, 100


def sniff(head: Head) -> bool:
    """Whether the first line is ``Header Size:`` and a row of column names follows."""
    return head.starts("Header Size:") and _name_line(head) is not None


def _name_line(head: Head) -> int | None:
    return next((k for k, line in enumerate(head.lines[:40]) if line.lower().startswith("sample number,")), None)


def read(source: Source) -> list[Table]:
    """Return the table; a new run begins wherever the log was resumed.

    Raises
    ------
    Refusal
        If the header names no channel or states no rate, or the time stamps cannot be read.
    """
    head = source.head
    row = found_line(head, _name_line(head), "'Sample Number, …' row")
    names = [n.lower() for n in split(head.lines[row], ",")]
    if "date/time" not in names:
        raise Refusal(head.path, "its name row has no Date/Time", "export the log again")
    stamp, event = names.index("date/time"), names.index("events") if "events" in names else None
    channels = [k for k in range(1, len(names)) if k not in (stamp, event) and names[k]]
    texts = (stamp,) if event is None else (stamp, event)
    optional = () if event is None else (event,)
    header = frozenset(line.strip() for line in head.lines[: row + 1])
    comma = _has_decimal_commas(head, row, (stamp, event), channels)
    marks = (";", ",") if comma else (",", ".")
    layout = Layout(row + 1, *marks, len(names), tuple(channels), texts, optional, header=header)
    data = COMMA_AND_BLANK.sub(b";", text_of(source)[:]) if comma else None
    body = body_of(source, layout, data)
    if event is not None:
        _refuse_numbers(body, event)
    original = split(head.lines[row], ",")
    table = table_of(body, [Field(original[k], None, k) for k in channels])
    time = Column("Date/Time", "s", _seconds(source, body.texts[stamp]), stamp)
    events = zip(body.lines, body.texts[event], strict=True) if event is not None else ()
    breaks = tuple(int(line) for line, text in events if _begins(text))
    table = with_rate(replace(table, time=time, breaks=breaks), head.lines[:row])
    count = [line.partition(":")[2].strip() for line in head.lines[:row] if line.lower().startswith("sample count")]
    return [replace(table, stated_rows=positive(count))]


def _has_decimal_commas(head: Head, row: int, others: tuple[int, int | None], channels: list[int]) -> bool:
    """Whether numbers have decimal commas: fields are then told by the blank behind the comma that parts them.

    Raises
    ------
    Refusal
        If they have, and no such blank tells where a number ends.
    """
    stamp, event = others
    lines = [line for line in head.lines[row + 1 :] if line.strip()][:COMMA_SAMPLE]
    apart = [[f.strip() for f in re.split(r",[ \t]+", line.strip())] for line in lines]
    number = number_pattern(",")
    paired = [r for r in apart if len(r) > max(channels, default=0) and all(number.fullmatch(r[c]) for c in channels)]
    if 2 * sum(any("," in r[c] for c in channels) for r in paired) > len(lines):
        return True
    fields = [split(line, ",") for line in lines]
    behind = [f[stamp + 1 :] for f in fields]
    twice = [
        b
        for b in behind
        if len(b) >= 2 * len(channels) and all(re.fullmatch(r"[+-]?\d+", x) for x in b[: 2 * len(channels)])
    ]
    if event is not None and 2 * len(twice) > len(lines):
        what = f"decimal commas, or twice as many columns as it names (line {row + 2}: '{excerpt(lines[0])}')"
        raise Refusal(head.path, what, "set the logger to decimal points, or to another delimiter, and export it again")
    return False


def _refuse_numbers(body: Body, event: int) -> None:
    """Refuse rows with a number for an event: a decimal comma has made one field into two."""
    number = number_pattern(".")
    odd = [k for k, text in enumerate(body.texts[event]) if number.fullmatch(text)]
    if not odd:
        return
    body.refused = sorted(
        [*body.refused, *(RejectedRow("number for an event", int(body.lines[k])) for k in odd)], key=lambda r: r.line
    )
    body.lines = np.delete(body.lines, odd)
    body.numbers = {c: np.delete(v, odd) for c, v in body.numbers.items()}
    gone = set(odd)
    body.texts = {c: [t for k, t in enumerate(texts) if k not in gone] for c, texts in body.texts.items()}


def _begins(event: str | None) -> bool:
    return bool(event) and any(word in str(event).lower() for word in ("resume", "start"))


def _seconds(source: Source, texts: list[str]) -> Array:
    """Return seconds from the first stamp; nan where a stamp cannot be read."""
    import pandas as pd

    if not texts:
        return np.empty(0)
    stamps, known = pd.Series(texts), source.carry.get("stamps")
    forms = (known[0],) if known else STAMP_FORMS
    read = [pd.to_datetime(stamps, format=form, errors="coerce") for form in forms]
    shares = [float(parsed.notna().mean()) for parsed in read]
    best = int(np.argmax(shares))
    # a few rows at a log's end may all be damaged: their times are nan
    if shares[best] <= READABLE and (not known or len(texts) >= MANY_STAMPS):
        what = f"unknown form of time stamp '{texts[0]}'" + (" further down" if known else "")
        raise Refusal(source.head.path, what, "set the logger to MM/DD/YYYY hh:mm:ss.fff")
    if not known:
        source.carry["stamps"] = known = forms[best], read[best].dropna().iloc[0]
    return np.asarray((read[best] - known[1]).dt.total_seconds(), dtype=np.float64)
