"""A channel map to start from: every column of a text log with its first values, for a person to name.

What the header or the values tell is filled in; the rest stands in comments. The map is valid as it is.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrfit.core.channels import CHANNELS
from mrfit.errors import ConfigError
from mrfit.ingest.dispatch import expand
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import FILE_NAME
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.text.body import number_pattern, split
from mrfit.ingest.text.head import Head, open_head
from mrfit.ingest.text.layout import TIME_NAMES, Grid, Header, aliases_of, find_grid, find_header
from mrfit.io.escapes import visible

# Values shown of each column, and rows of the beginning of the log from which its range is told
SHOWN = 3
ROWS = 500
# A column rises evenly if its steps differ by less than this share of their mean
EVENLY = 0.1
CLOSING = """
# resistance = 2.1        # of the coil, in ohm; leave it out to have it estimated
# pattern = "{amplitude:mm}mm{frequency:Hz}Hz{current:A}A"    # conditions in file names
"""


def write_starter_map(logs: Sequence[Path]) -> Path:
    """Write a map for the first of some logs beside it and return its path; a map that is there is kept.

    Raises
    ------
    ConfigError
        If there is a map already, the log has no columns of numbers as text, or the map cannot be written.
    """
    log = expand(list(logs))[0][0]
    place = log.parent / FILE_NAME
    try:
        text = starter_map(log)
        with place.open("x", encoding="utf-8") as handle:
            handle.write(text)
    except FileExistsError:
        raise ConfigError(f"{place}: there is a channel map already; move it to have another one suggested") from None
    except OSError as error:
        raise ConfigError(f"{place}: cannot be written ({error.strerror or error}); copy the log elsewhere") from None
    except Refusal as refusal:
        raise ConfigError(f"{log}: no map can be suggested: {refusal.reason}; {refusal.remedy}") from None
    return place


def starter_map(log: Path) -> str:
    """Return a channel map in TOML with comments.

    Raises
    ------
    Refusal
        If the file is not there, or is no text with rows of numbers.
    """
    head = open_head(log)
    grid = find_grid(head)
    header = find_header(head, grid)
    columns = _columns(head, grid)
    names = [*header.names, *[""] * grid.width][: grid.width]
    described = [_described(k, names[k], _unit(header, k), columns[k]) for k in range(grid.width)]
    time = next((k for k in range(grid.width) if _is_time(names[k], _unit(header, k))), None)
    if time is None:
        time = next((k for k in range(grid.width) if _rises_evenly(columns[k])), None)
    parts = [
        f"# Channel map of {visible(log.name)}: which column is which quantity. Correct it, then run `mrfit ingest`."
    ]
    if time is None:
        parts.append("\n# No column looks like time; say how far apart the rows are.\nrate = 1.0    # Hz: correct this")
    else:
        unit = _unit(header, time)
        asked = "" if unit else "    # are these seconds?"
        said = f", unit = {json.dumps(unit)}" if unit and units.compatible(unit, "s") else ', unit = "s"'
        parts.append(f"\n{described[time]}\ntime = {{column = {time}{said}}}{asked}")
    parts.append(f"\n[channels]\n# quantities: {', '.join(CHANNELS)}")
    taken: set[str] = set()
    for k in range(grid.width):
        if k != time and columns[k].size:
            line = _channel(k, names[k], _unit(header, k), taken)
            parts.append(f"\n{described[k]}\n{line}")
    before, channels = parts[:2], parts[2:]
    return "\n".join([*before, CLOSING.rstrip(), *channels]) + "\n"


def _columns(head: Head, grid: Grid) -> list[np.ndarray]:
    """Return the numbers of the first rows, column by column; none where half of the fields are no numbers."""
    number = number_pattern(grid.decimal)
    lines = [line for line in head.lines[grid.first :] if line.strip()][:ROWS]
    rows = [fields for line in lines if len(fields := split(line, grid.delimiter)) == grid.width]
    found = []
    for k in range(grid.width):
        texts = [r[k].replace(grid.decimal, ".") for r in rows if number.fullmatch(r[k]) and "∞" not in r[k]]
        found.append(np.array([float(t) for t in texts] if 2 * len(texts) > len(rows) else [], dtype=np.float64))
    return found


def _unit(header: Header, column: int) -> str:
    unit = header.units[column] if column < len(header.units) else None
    return unit if unit and units.known(unit) else ""


def _is_time(name: str, unit: str) -> bool:
    return name.strip().lower() in TIME_NAMES and (not unit or units.compatible(unit, "s"))


def _rises_evenly(values: np.ndarray) -> bool:
    steps = np.diff(values)
    return len(steps) > 2 and bool(np.all(steps > 0.0)) and float(np.ptp(steps)) < EVENLY * float(np.mean(steps))


def _described(column: int, name: str, unit: str, values: np.ndarray) -> str:
    """Return a comment with what a column is called and holds."""
    called = f" {json.dumps(visible(name), ensure_ascii=False)}" * bool(name) + f" in {unit}" * bool(unit)
    if not values.size:
        return f"# column {column}{called}: no numbers"
    shown = ", ".join(f"{v:.6g}" for v in values[:SHOWN])
    span = f"{values.min():.6g} to {values.max():.6g}"
    return f"# column {column}{called}: {shown}, … (of the first {len(values)} rows {span})"


def _channel(column: int, name: str, unit: str, taken: set[str]) -> str:
    """Return the line of a channel, in a comment where the header does not say which it is."""
    fitting = [n for n in aliases_of(name) if not unit or units.compatible(unit, CHANNELS[n].unit)]
    if len(fitting) == 1 and fitting[0] not in taken:
        taken.add(fitting[0])
        return f"{fitting[0]} = {{column = {column}, unit = {json.dumps(unit or CHANNELS[fitting[0]].unit)}}}"
    alike = [n for n, c in CHANNELS.items() if unit and units.compatible(unit, c.unit)]
    guess = alike[0] if alike else "force"
    rule = f"{guess} = {{column = {column}, unit = {json.dumps(unit or CHANNELS[guess].unit)}}}"
    return f"# {rule}    # which quantity, and its unit?"
