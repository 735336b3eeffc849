"""A starter channel map for logs that do not say what is in them: every column with what it may be and its values.

The pattern that the names of logs follow, proposed from numbers with units in them: ``2mm5Hz0x25A``.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from textwrap import wrap

import numpy as np

from mrfit.core import temporary
from mrfit.core.channels import CHANNELS, unit_of
from mrfit.core.counting import few
from mrfit.errors import ConfigError, DataError
from mrfit.ingest import series
from mrfit.ingest.dispatch import expand
from mrfit.ingest.guesses import Guess, guesses, size_unit
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import FILE_NAME, ChannelRule, Rules
from mrfit.ingest.meaning.conditions import NAMED_NUMBER, from_name
from mrfit.ingest.meaning.naming import Signal, name_signals
from mrfit.ingest.reading import BlockReading, LogItem, first_tables
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.stage import plan_items
from mrfit.ingest.table import Column, Table
from mrfit.io.workspace import write_text
from mrfit.settings.ingest import Settings

CONDITION_OF_UNIT = {
    **{"mm": "amplitude", "cm": "amplitude", "deg": "amplitude", "Hz": "frequency", "A": "current", "mA": "current"},
    **{"degC": "temperature", "bar": "pressure", "V": "voltage", "mm/s": "velocity", "m/s": "velocity"},
}
"""Units in names of logs, and what they are units of."""
SPELLED = {unit.lower(): unit for unit in CONDITION_OF_UNIT} | {
    "c": "degC",
    "mms": "mm/s",
    "mmps": "mm/s",
    "mps": "m/s",
}
STATED_IN_NAME = re.compile(
    rf"({NAMED_NUMBER})([ _-]?(?:{'|'.join(sorted(map(re.escape, SPELLED), key=len, reverse=True))}))(?![a-z])",
    re.IGNORECASE,
)
"""A number with its unit."""


def pattern_of(stems: Sequence[str]) -> str:
    """Return the pattern that all names follow, as for ``--pattern``; empty where they state nothing alike."""
    read = [_stated(stem) for stem in stems]
    if not read or not read[0] or any([one[:2] for one in r] != [one[:2] for one in read[0]] for r in read):
        return ""
    pattern = ""
    for place, (key, written, _) in enumerate(read[0]):
        between = {r[place][2] for r in read}
        (text,) = between if len(between) == 1 else ("*",)
        last = place == len(read[0]) - 1
        unit = SPELLED[written.strip(" _-").lower()]
        pattern += f"{{{key}:{unit}}}{written}{'' if last else re.sub('[{}*]+', '*', text)}"
    return pattern if all(from_name(stem, pattern) for stem in stems) else ""


def _stated(stem: str) -> list[tuple[str, str, str]]:
    """Return quantity, unit as written, and the text up to the next of every quantity that a name states."""
    first: dict[str, re.Match[str]] = {}
    for match in STATED_IN_NAME.finditer(stem):
        first.setdefault(CONDITION_OF_UNIT[SPELLED[match[2].strip(" _-").lower()]], match)
    starts = [m.start() for m in first.values()]
    ends = [*starts[1:], len(stem)]
    return [(key, m[2], stem[m.end() : end]) for (key, m), end in zip(first.items(), ends, strict=False)]


MAP_WIDTH = 118
# Rows from which a column without a name is taken for the time, and how much its steps may differ
SUGGESTION_ROWS, EVENLY = 500, 0.1
BY_PLACE = Rules(channels={"any": ChannelRule(column=0)})
"""Rules of columns by place: with them a reader needs no header."""
LISTED_COLUMNS = 5
"""Logs that are named where several have other columns."""


def write(paths: Sequence[Path], settings: Settings) -> Path:
    """Write a starter channel map beside the first of some logs, where there is none or an empty one; return its path.

    Raises
    ------
    ConfigError
        If there is a channel map, or the map cannot be written.
    DataError
        If no log can be read.
    """
    file = expand([Path(p) for p in paths])[0][0].parent / FILE_NAME
    if file.exists() and file.read_bytes().strip():
        raise ConfigError(f"{file}: there is a channel map already; move it to have another one suggested")
    text = suggest(paths, settings)
    try:
        write_text(file, text)
    except OSError as error:
        raise ConfigError(f"{file}: cannot be written ({error.strerror or error}); copy the logs elsewhere") from None
    return file


def suggest(paths: Sequence[Path], settings: Settings) -> str:
    """Return a starter channel map (TOML) for the commonest layout among logs.

    What the logs themselves say is written out; what they leave open stands as a comment with the choices there are.

    Raises
    ------
    ConfigError
        If the settings or a channel map are wrong.
    DataError
        If no log can be read.
    """
    items, refusals = plan_items(paths, settings, lambda _: "")
    layouts: dict[tuple[tuple[str, str | None], ...], list[tuple[LogItem, Table]]] = {}
    with temporary.folder("ingest") as place:
        for item, _ in items:
            bare = replace(item, rules=replace(BY_PLACE, pattern=item.rules.pattern))
            try:
                table = first_tables(bare, BlockReading(place, settings.block))[0]
            except Refusal as refusal:
                refusals.append(refusal)
                continue
            layouts.setdefault(tuple((c.name, c.unit) for c in table.columns), []).append((item, table))
        if not layouts:
            raise DataError(
                f"no log could be read: {refusals[0]}" if refusals else "no log given; name a file or folder"
            )
        commonest = max(layouts.values(), key=len)
        others = [Path(i.source).name for found in layouts.values() if found is not commonest for i, _ in found]
        return "\n".join([*_map_of(commonest), *_told_of(others), ""])


def _map_of(logs: Sequence[tuple[LogItem, Table]]) -> Iterator[str]:
    """Yield the lines of the map for logs of one layout, of which the first is shown."""
    item, table = logs[0]
    name = excerpt(Path(item.source).name)
    yield f"# Channel map for logs as {name} (reader {item.reader}), suggested by `mrfit ingest --suggest-map`."
    yield "# Check every line, and complete those that begin with #."
    yield f"# It is used as {FILE_NAME} beside the logs, or by --map FILE."
    yield ""
    even = _even_column(table)
    yield from _time_lines(table, even)
    yield "# resistance = 2.1   # ohm, of the coil; without it, it is estimated from voltage and current"
    yield _pattern_line([i for i, _ in logs])
    yield ""
    signals = {s.index: s for s in name_signals(table.columns, Rules(), item.source)[0]}
    if not {s.name for s in signals.values()} & {"current", "voltage", "flux"}:
        yield "# [condition]   # what no column holds, in SI; a list has one value for each run of a log"
        yield "# current = 0.5"
        yield ""
    yield "[channels]"
    columns = [c for c in table.columns if c is not even]
    found = guesses([c for c in columns if signals[c.index].name not in CHANNELS and c.unit is None], _interval(table))
    for column in columns:
        yield from _channel_lines(column, signals[column.index], table.columns, found.get(column.index))
    yield ""
    listed = f"NAME is one of {', '.join(f'{c.name} ({c.unit})' for c in CHANNELS.values())}, or a name of your own."
    yield from wrap(listed, MAP_WIDTH, initial_indent="# ", subsequent_indent="# ")
    yield "# A transducer's signal needs scale = …, the unit for each number of the file; offset, sign = -1 where due."
    if found:
        yield "# A name or unit with a question mark is guessed from the numbers."


def _pattern_line(items: Sequence[LogItem]) -> str:
    """Return the line of conditions in file names: as they were given, as the names state them, or an example."""
    given = items[0].rules.pattern
    pattern = given or pattern_of([Path(i.source).stem for i in items])
    if not pattern:
        return '# pattern = "{frequency:Hz}Hz-{current:A}A"   # conditions in the names of the files'
    several = given or pattern.count("{") > 1
    said = "conditions in the names of the files" + ("" if given else "; check them")
    return f"{'' if several else '# '}pattern = {_quoted(pattern)}   # {said}"


def _interval(table: Table) -> float | None:
    """Return about how many seconds lie between rows."""
    if table.dt is not None:
        return table.dt
    time = table.time or _even_column(table)
    if time is None:
        return None
    unit = time.unit if time.unit and units.known(time.unit) and units.compatible(time.unit, "s") else "s"
    step = float(np.median(np.diff(np.asarray(time.values[:SUGGESTION_ROWS], dtype=float))))
    return step * units.to_unit(unit, "s").scale if step > 0.0 else None


def _even_column(table: Table) -> Column | None:
    """Return the first column that may be the time of a log that states none."""
    if table.time is not None or table.dt is not None:
        return None
    return next((c for c in table.columns if _rises_evenly(c)), None)


def _time_lines(table: Table, even: Column | None) -> Iterator[str]:
    if table.time is not None:
        unit = table.time.unit if table.time.unit and units.known(table.time.unit) else "s"
        said = "" if table.time.unit else " the file states no unit;"
        yield f"time = {{{_place(table.time, ())}, unit = {_quoted(unit)}}}   #{said} {_values(table.time)}"
    elif table.dt is not None:
        yield f"# the file states {1.0 / table.dt:.6g} samples a second"
    elif even is not None:
        yield f'time = {{{_place(even, table.columns)}, unit = "s"}}   # it rises evenly: {_values(even)}'
    else:
        yield "# The log states neither times nor a rate: write one of these."
        yield "# rate = 1000   # samples a second"
        yield '# time = {column = 0, unit = "s"}'


def _rises_evenly(column: Column) -> bool:
    """Return whether a column may be the time: its steps differ by little."""
    steps = np.diff(np.asarray(column.values[:SUGGESTION_ROWS], dtype=float))
    return len(steps) > 2 and bool(np.all(steps > 0.0)) and float(np.ptp(steps)) < EVENLY * float(np.mean(steps))


def _channel_lines(column: Column, signal: Signal, columns: tuple[Column, ...], guess: Guess | None) -> Iterator[str]:
    place, known = _place(column, columns), column.unit is not None and units.known(column.unit)
    if signal.name in CHANNELS:
        unit = column.unit if known and column.unit else unit_of(signal.name)
        said = "" if known else " the file states no unit;"
        if not known and (sized := size_unit(signal.name, np.asarray(column.values[:SUGGESTION_ROWS], dtype=float))):
            unit, said = sized, f" the file states no unit, {sized}? by its size;"
        yield f"{signal.name} = {{{place}, unit = {_quoted(unit)}}}   #{said} {_values(column)}"
        return
    possible = units.channels_of(column.unit) if known and column.unit else []
    may_be = f"may be {' or '.join(possible)}; " if possible else ""
    if guess:
        may_be = f"{guess.channel}? since {guess.why}; {guess.unit}? by its size; "
    name = guess.channel if guess else "NAME"
    unit = column.unit if known and column.unit else guess.unit if guess else "…"
    yield f"# {name} = {{{place}, unit = {_quoted(unit)}}}   # {may_be}{_values(column)}"


def _place(column: Column, columns: tuple[Column, ...]) -> str:
    """Return the name of a column in a map: its header, or by its number where that is empty or stands twice."""
    alike = [c for c in columns if c.name.strip().lower() == column.name.strip().lower()]
    return f"column = {_quoted(column.name) if column.name.strip() and len(alike) < 2 else column.index}"


def _quoted(text: str) -> str:
    """Return a TOML string in which nothing stands that a terminal would obey."""
    escaped = (c if c.isprintable() else f"\\U{ord(c):08x}" for c in text.replace("\\", r"\\").replace('"', r"\""))
    return f'"{"".join(escaped)}"'


def _values(column: Column) -> str:
    """Return a preview of a column's numbers for a comment."""
    first = ", ".join(f"{v:.5g}" for v in np.asarray(column.values[:3], dtype=float))
    sound = [v[np.isfinite(v)] for (v,) in series.chunks(column.values)]
    if not any(len(v) for v in sound):
        return f"column {column.index}: no number in what was looked at"
    low, high = min(v.min() for v in sound if len(v)), max(v.max() for v in sound if len(v))
    return f"column {column.index}: {low:.5g} to {high:.5g}, begins {first}"


def _told_of(others: list[str]) -> Iterator[str]:
    if others:
        shown = few([excerpt(name) for name in others], LISTED_COLUMNS)
        yield ""
        yield f"# Other columns than these have {shown}: give them a part of their own,"
        yield '# [[files]] with match = "NAME*" and the keys above below it.'
