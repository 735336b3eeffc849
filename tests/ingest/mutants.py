"""Sound logs, damaged; and an oracle that knows what each damaged log still says, without asking mrfit.

A mutant carries, for every sample number, the values that its bytes allow. ``judge`` compares what was read with them:
a value is one of those, or the row is counted as refused or missing and the value lies on the straight line between
its neighbours; anything else is a silent change.

``SUBJECTS`` maps a name to a function that makes a mutant from a random generator. Formats other than text register
theirs with ``register``.
"""

import random
import re
import resource
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from mrfit.core.recording import Recording
from mrfit.errors import DataError
from mrfit.ingest.reading import OWN_FAULT
from mrfit.ingest.stage import Settings
from tests.ingest.examining import examine
from tests.ingest.samples import DT, NO_LINES, ROWS, RS_SETTINGS, START, WRITERS, Sample, signals, table

HANG = 30
"""Seconds of computing that one mutant may take, and a tenth of those that it may take on a busy machine."""
GUESSED = "unit-assumed"
REBUILT = {"resampled", "rounded-time", "rate-differs"}
"""Findings that say that the time base is not the printed one."""


@dataclass(frozen=True)
class Mutant:
    """A damaged log and what it still says.

    Attributes
    ----------
    label
        Reader and mutations, for messages.
    file, data, beside
        Name and bytes of the log, and files that must lie beside it.
    allowed
        Sample number -> channel -> value in SI.
    printed
        Sample number -> numbers of the row as printed, for columns kept without a known unit.
    units
        Channel -> SI unit.
    rows
        Rows that must be counted as kept, refused or comments; None where that is not known.
    timed
        Whether samples are known by their printed times; else by their order.
    start, dt
        Time of sample 0, and the interval, in s.
    relative
        Whether the log counts its time from its first readable row.
    header_lines
        Lines of a second header, which are no rows: they may be refused as a repeated header is.
    notes
        Comments beside a header among the rows, counted in ``rows``: they may be taken as lines of it.
    """

    label: str
    file: str
    data: bytes
    allowed: dict[int, dict[str, float]]
    printed: dict[int, tuple[float, ...]]
    units: dict[str, str]
    rows: int | None = None
    timed: bool = True
    start: float = START
    dt: float = DT
    beside: dict[str, bytes] = field(default_factory=dict)
    relative: bool = False
    header_lines: int = 0
    notes: int = 0


SUBJECTS: dict[str, Callable[[random.Random], Mutant]] = {}


def register(name: str, make: Callable[[random.Random], Mutant]) -> None:
    """Add a function that makes mutants, under the name of a reader."""
    assert name not in SUBJECTS, name
    SUBJECTS[name] = make


# --- the oracle ---------------------------------------------------------------------------------------------------


def read(mutant: Mutant) -> tuple[list[Recording], list[str]]:
    """Return the recordings of a mutant and its one-line refusals."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / mutant.file
        path.write_bytes(mutant.data)
        for name, data in mutant.beside.items():
            (Path(folder) / name).write_bytes(data)
        try:
            recordings, refusals = examine([path], Settings(jobs=1))
        except DataError as error:
            return [], [str(error)]
        return recordings, [str(r) for r in refusals]


def judge(mutant: Mutant, recordings: list[Recording], refusals: list[str]) -> list[str]:
    """Return what is wrong with what was read: silent changes, and rows that are not counted."""
    faults = [f"refusal of several lines: {r!r}" for r in refusals if "\n" in r]
    faults += [r for r in refusals if OWN_FAULT in r]
    if not recordings:
        return faults + ([] if refusals else ["neither read nor refused"])
    kinds = {f.kind for r in recordings for f in r.findings}
    faults += _uncounted(mutant, recordings)
    faults += [fault for record in recordings for fault in _unsaid(record)]
    if kinds & REBUILT:
        return faults  # said
    readings = [[f for r in recordings for f in _changed(mutant, r, *clock)] for clock in _clocks(mutant, recordings)]
    return faults + min(readings, key=len)


def _clocks(mutant: Mutant, recordings: list[Recording]) -> list[tuple[int, float]]:
    """Return the numbers of the sample at time 0, and the units of time in s, that are possible."""
    guessed = any(f.kind == GUESSED and not f.channel for r in recordings for f in r.findings)
    first = sorted(mutant.allowed) if mutant.relative else [0]
    return [(number, unit) for number in first for unit in ([1.0, 1e3] if guessed else [1.0])]


def _unsaid(record: Recording) -> list[str]:
    """Return the channels of which up to three samples are out of all proportion and no finding says so."""
    said = {f.channel for f in record.findings if f.kind == "outlier"}
    sizes = {name: np.abs(values[:]) for name, values in record.channels.items() if name not in said}
    odd = [n for n, size in sizes.items() if 0 < np.sum(size > HUGE) <= 3 and len(size) >= 16]
    return [f"{name} has a sample of {sizes[name].max():g} and no finding says so" for name in odd]


def _uncounted(mutant: Mutant, recordings: list[Recording]) -> list[str]:
    comments = [f.text for r in recordings for f in r.findings if f.kind == "comments"]
    # a header within a log is no row; from one that cannot be used on nothing is read, and its line is said
    headers = {f.text for r in recordings for f in r.findings if f.kind == "another-header"}
    counted = sum(r.rows_kept + r.rows_refused for r in recordings) + sum(int(c.split()[0]) for c in comments)
    counted += 0 if mutant.header_lines else len(headers)
    stopped = any("nothing is read from there on" in h for h in headers)
    if mutant.rows is None or stopped:
        return []
    if any(0 <= mutant.rows + lines - counted <= mutant.notes for lines in (0, mutant.header_lines)):
        return []
    return [f"{mutant.rows} rows in, {counted} counted"]


def _changed(mutant: Mutant, record: Recording, first: int, unit: float) -> list[str]:
    start, dt = record.start / unit, record.dt / unit
    numbers = np.round(first + (start - mutant.start + np.arange(record.samples) * dt) / mutant.dt, 6)
    if np.max(np.abs(numbers - np.round(numbers))) > 0.01:
        return [f"samples of {record.dt:g} s from {record.start:g} s stand between those printed"]
    filled = [int(f.text.split()[0]) for f in record.findings if f.kind == "dropped-samples"]
    faults = []
    for name, values in record.channels.items():
        kept = _best_match(mutant, name, record.units[name], np.round(numbers).astype(int), np.asarray(values))
        if kept is None:
            faults.append(f"channel '{name}' in '{record.units[name]}' is none that was printed")
            continue
        gone = np.flatnonzero(~kept)
        if len(gone) > sum(filled):
            faults.append(
                f"{name}: {len(gone)} values changed, first sample {numbers[gone[0]]:g} is {values[gone[0]]:g}"
            )
        elif not _on_lines(np.asarray(values), kept):
            faults.append(f"{name}: filled values are not between their neighbours")
    return faults


def _best_match(mutant: Mutant, name: str, unit: str, numbers: np.ndarray, values: np.ndarray) -> np.ndarray | None:
    """Return which samples have the value that was printed; None if the channel is unknown."""
    if name in mutant.units and unit == mutant.units[name]:
        truth = [np.array([mutant.allowed.get(k, {}).get(name, np.nan) for k in numbers])]
    elif unit in ("", "1"):
        width = max((len(p) for p in mutant.printed.values()), default=0)
        rows = [mutant.printed.get(k, ()) for k in numbers]
        truth = [np.array([r[c] if c < len(r) else np.nan for r in rows]) for c in range(width)]
    else:
        return None
    near = [np.abs(values - t) <= 1e-9 * (1e-12 + np.abs(t)) for t in truth]
    best = max(near, key=lambda n: int(n.sum()), default=None)
    return best if best is not None and best.any() else None


def _on_lines(values: np.ndarray, kept: np.ndarray) -> bool:
    """Whether every other value lies on the straight line between the kept ones around it."""
    place = np.flatnonzero(kept)
    gone = np.flatnonzero(~kept)
    if len(gone) and (gone[0] < place[0] or gone[-1] > place[-1]):
        return False
    line = np.interp(gone, place, values[place])
    return bool(np.all(np.abs(values[gone] - line) <= 1e-9 * (1e-12 + np.max(np.abs(values)))))


# --- text logs ----------------------------------------------------------------------------------------------------


@dataclass
class Row:
    """A line of a draft: its sample number, what it allows and prints, and what became of it.

    ``counts`` says that it is a row, ``sample`` that it stands for a sample, ``spoilt`` that a number is unreadable.
    ``larger`` is of a header: channel -> how much larger the unit of the rows below is than that of the sample.
    """

    text: str
    number: int | None = None
    allowed: dict[str, float] = field(default_factory=dict)
    printed: tuple[float, ...] = ()
    counts: bool = True
    sample: bool = True
    spoilt: bool = False
    larger: dict[str, float] | None = None


@dataclass
class Draft:
    """A text log as header and rows, to be damaged."""

    reader: str
    head: str
    rows: list[Row]
    end: str
    closed: bool = True
    swapped: bool = False


def _nanoseconds() -> Sample:
    """A fast scope's log: no time has a digit above 1e-6 s."""
    _, one, two = signals()
    rows = "".join(f"{k:d}.000E-09,{a:.4f},{b:.4f}\n" for k, (a, b) in enumerate(zip(one, two, strict=True)))
    text = "time [s],voltage [V],current [A]\n" + rows
    channels, units = {"voltage": one, "current": two}, {"voltage": "V", "current": "A"}
    return Sample("log.csv", text.encode(), channels, units, dt=1e-9, start=0.0)


def _semicolons() -> Sample:
    """A German logger's log: names above units, decimal commas."""
    _, one, two = signals()
    text = "Prüfer;N. N.;\n\nZeit;Kraft;Weg\ns;kN;mm\n\n" + table(";", ",", "\r\n")
    channels, units = {"force": one * 1e3, "displacement": two * 1e-3}, {"force": "N", "displacement": "m"}
    return Sample("log.csv", text.replace("\r\n", "\n").replace("\n", "\r\n").encode(), channels, units)


def _blanks() -> Sample:
    """Columns apart by blanks, the time last."""
    _, one, two = signals()
    rows = [f"{a:11.4f} {b:11.4f} {START + k * DT:11.6f}\n" for k, (a, b) in enumerate(zip(one, two, strict=True))]
    text = "# a rig\n    force_kN   position_mm   time_s\n" + "".join(rows)
    channels, units = {"force": one * 1e3, "displacement": two * 1e-3}, {"force": "N", "displacement": "m"}
    return Sample("log.txt", text.encode(), channels, units)


TEXT_WRITERS: dict[str, Callable[[], Sample]] = {
    **{name: write for name, write in WRITERS.items() if name not in NO_LINES},
    **{"delimited-ns": _nanoseconds, "delimited-semicolon": _semicolons, "delimited-blanks": _blanks},
}
NUMBERS = {mark: re.compile(rf"[+-]?\d+(?:\{mark}\d+)?(?:[eE][+-]?\d+)?") for mark in ".,"}
UNITS_IN_HEAD = {
    "delimited": r"\[(\w+)\]",
    "delimited-ns": r"\[(\w+)\]",
    "delimited-semicolon": r"\b(s|kN|mm)\b",
    "delimited-blanks": r"_(kN|mm)\b",
    "tektronix-mso": r"Vertical Units,(V)",
    "tektronix-tds": r"(?!)",
    "rigol": r"(Volt)",
    "keysight": r"(Volt)",
    "siglent": r"(Volt)",
    "picoscope": r"\((\w+)\)",
    "digilent": r"\((\w+)\)",
    "gwinstek": r"Vertical Units,(V)",
    "leybold-cassy": r"/ (\w+)",
    "mts-mpt": r"\b(mm|kN)\b",
    "mts-testsuite": r"\b(mm|N)\b",
    "labview-lvm": r"(Newtons|Amperes)",
}
UNTIMED = ("rohde-schwarz", "labview-lvm")
"""Here a row that vanished without a trace cannot be missed: samples are known by their order."""
COMMA_DECIMALS = ("labview-lvm", "leybold-cassy", "delimited-semicolon")
DELIMITERS = {
    "delimited-semicolon": ";",
    "delimited-blanks": " ",
    "leybold-cassy": "\t",
    "mts-mpt": "\t",
    "mts-testsuite": "\t",
    "labview-lvm": "\t",
}
VALUE_LAST = sorted(set(TEXT_WRITERS) - {"delimited-blanks", "mts-testsuite", "daq-text"})
"""Here the last number of a row is the value of the last channel."""
HUGE = 1e8
HEADERS_AMID_ROWS = ("labview-lvm", "mts-mpt")
UNKNOWN = ("qzx", "deg_Q", "kgq", "zoll", "%FS")


def draft_of(reader: str) -> Draft:
    """Return the sample of a reader as a draft."""
    sample = TEXT_WRITERS[reader]()
    text = sample.data.decode("utf-8")
    end = next(e for e in ("\r\r\n", "\r\n", "\n") if e in text)
    lines = text.removesuffix(end).split(end)
    head = "".join(line + end for line in lines[:-ROWS])
    draft = Draft(reader, head, [], end)
    for k, line in enumerate(lines[-ROWS:]):
        allowed = {name: float(values[k]) for name, values in sample.channels.items()}
        printed = tuple(float(n.replace(",", ".")) for n in number_of(draft).findall(line))
        draft.rows.append(Row(line, k, allowed, printed))
    return draft


def mark_of(draft: Draft) -> str:
    return ",."[(draft.reader in COMMA_DECIMALS) == draft.swapped]


def sound_rows(draft: Draft) -> list[int]:
    return [k for k, row in enumerate(draft.rows) if row.number is not None]


def _spoil(row: Row, text: str) -> None:
    """Replace the text of a row in which a number is unreadable now."""
    row.text, row.counts, row.spoilt = text, bool(text.strip()), True


def number_of(draft: Draft) -> re.Pattern[str]:
    return NUMBERS[mark_of(draft)]


def numbers_in(draft: Draft, row: Row) -> list[re.Match[str]]:
    """Return the numbers of a row; settings that stand beside it are none."""
    begin = len(",".join(row.text.split(",")[:3])) if draft.reader == "tektronix-tds" else 0
    return [match for match in number_of(draft).finditer(row.text) if match.start() >= begin]


def _cell(draft: Draft, row: Row, rng: random.Random) -> re.Match[str] | None:
    found = numbers_in(draft, row)
    return rng.choice(found[-2:]) if found else None


def _pick(draft: Draft, rng: random.Random, most: int = 4) -> list[Row]:
    there = sound_rows(draft)
    early = there[:3]
    chosen = {rng.choice(early if rng.random() < 0.2 else there) for _ in range(rng.randint(1, most))}
    # damage upon damage may make a sound row with other numbers, which no reader can know
    return [row for row in (draft.rows[k] for k in sorted(chosen)) if not row.spoilt]


def drop_rows(draft: Draft, rng: random.Random) -> None:
    gone = {id(row) for row in _pick(draft, rng, 8)}
    draft.rows = [row for row in draft.rows if id(row) not in gone]


def drop_block(draft: Draft, rng: random.Random) -> None:
    first = rng.randrange(len(draft.rows))
    del draft.rows[first : first + rng.randint(2, 60)]


def drop_every(draft: Draft, rng: random.Random) -> None:
    del draft.rows[rng.randrange(20) :: rng.choice([10, 24, 60])]


def garble_cell(draft: Draft, rng: random.Random) -> None:
    for row in _pick(draft, rng):
        if match := _cell(draft, row, rng):
            place = rng.randrange(match.start(), match.end())
            _spoil(row, row.text[:place] + rng.choice("xOlZ?") + row.text[place + 1 :])


def replace_cell(draft: Draft, rng: random.Random) -> None:
    for row in _pick(draft, rng):
        if match := _cell(draft, row, rng):
            mark = rng.choice(["", "OL", "#REF!", "#DIV/0!", "NaN", "--", "inf", "overload", "1e400", "∞"])
            _spoil(row, row.text[: match.start()] + mark + row.text[match.end() :])


def first_field(draft: Draft, rng: random.Random) -> None:
    for row in _pick(draft, rng):
        if match := next(iter(numbers_in(draft, row)), None):
            _spoil(row, row.text[: match.start()] + rng.choice(["#REF!", "%", "! ", "#"]) + row.text[match.end() :])


def overload_first(draft: Draft, rng: random.Random) -> None:
    whole = rng.random() < 0.5 and draft.reader != "tektronix-tds"  # its settings stand beside the first rows
    for row in draft.rows[: rng.randint(1, 30)]:
        numbers = numbers_in(draft, row) if row.larger is None else []
        for match in reversed(numbers if whole else numbers[-2:]):
            row.text = row.text[: match.start()] + "OL" + row.text[match.end() :]


def unknown_unit(draft: Draft, rng: random.Random) -> None:
    found = list(re.finditer(UNITS_IN_HEAD.get(draft.reader, "(?!)"), draft.head))
    if found:
        match = rng.choice(found)
        draft.head = draft.head[: match.start(1)] + rng.choice(UNKNOWN) + draft.head[match.end(1) :]


def blank_lines(draft: Draft, rng: random.Random) -> None:
    for _ in range(rng.randint(1, 4)):
        draft.rows.insert(rng.randrange(len(draft.rows) + 1), Row(rng.choice(["", "  "]), counts=False))


def nul_bytes(draft: Draft, rng: random.Random) -> None:
    for row in _pick(draft, rng):
        place = rng.randrange(len(row.text) + 1)
        _spoil(row, row.text[:place] + "\0" * rng.randint(1, 5) + row.text[place:])


def swap_marks(draft: Draft, rng: random.Random) -> None:
    old = mark_of(draft)
    new = "." if old == "," else ","
    for row in draft.rows:
        row.text = re.sub(rf"(?<=\d)\{old}(?=\d)", new, row.text)
    draft.swapped = not draft.swapped


def swap_one_mark(draft: Draft, rng: random.Random) -> None:
    old = mark_of(draft)
    for row in _pick(draft, rng):
        if (match := _cell(draft, row, rng)) and old in match[0]:
            _spoil(row, row.text[: match.start()] + match[0].replace(old, ",."[old == ","]) + row.text[match.end() :])


def cut_end(draft: Draft, rng: random.Random) -> None:
    row = draft.rows[-1]
    row.text = row.text[: rng.randint(1, max(len(row.text), 1))].rstrip()
    row.counts = row.counts and bool(row.text)
    draft.closed = False


def double_rows(draft: Draft, rng: random.Random) -> None:
    for row in _pick(draft, rng, 3):
        draft.rows.insert(draft.rows.index(row) + 1, replace(row))


def repeated_header(draft: Draft, rng: random.Random) -> None:
    lines = [line for line in draft.head.split(draft.end) if line.strip()]
    if draft.reader not in HEADERS_AMID_ROWS and lines:
        draft.rows.insert(rng.randrange(1, len(draft.rows) + 1), Row(lines[-1]))


def comment(draft: Draft, rng: random.Random) -> None:
    text = rng.choice(["# pump on", "the pump was switched on", "! note", "% 5", "#"])
    sample = not (draft.reader == "rohde-schwarz" and text.startswith("#"))
    draft.rows.insert(rng.randrange(1, len(draft.rows) + 1), Row(text, sample=sample))


def long_rows(draft: Draft, rng: random.Random) -> None:
    """Add fields to some rows, and take the last number from others."""
    delimiter = DELIMITERS.get(draft.reader, ",")
    for row in _pick(draft, rng):
        numbers = numbers_in(draft, row)
        if rng.random() < 0.5 or not numbers:
            _spoil(row, f"{row.text}{delimiter}7{delimiter}5")
        else:
            _spoil(row, row.text[: numbers[-1].start()].rstrip(f"{delimiter} "))


def swap_rows(draft: Draft, rng: random.Random) -> None:
    one, two = rng.choice(sound_rows(draft)), rng.choice(sound_rows(draft))
    draft.rows[one], draft.rows[two] = draft.rows[two], draft.rows[one]


def one_name_fewer(draft: Draft, rng: random.Random) -> None:
    """Lose the first name of the last line of the header, as R's write.table does."""
    lines = draft.head.split(draft.end)
    delimiter = DELIMITERS.get(draft.reader, ",")
    if draft.reader not in ("lecroy", "tektronix-tds", "gwinstek", "daq-text") and len(lines) > 1:
        lines[-2] = lines[-2].partition(delimiter)[2] or lines[-2]
        draft.head = draft.end.join(lines)


def huge_number(draft: Draft, rng: random.Random) -> None:
    """Let the last value of a row be 1e12 as printed: it is a number, and must be said."""
    row = draft.rows[rng.choice(sound_rows(draft))]
    numbers = numbers_in(draft, row)
    if draft.reader not in VALUE_LAST or not numbers or row.spoilt or not row.printed:
        return
    if sum(other.number == row.number for other in draft.rows) > 1:
        return
    name, value = list(row.allowed.items())[-1]
    printed = row.printed[-1]
    if printed and value:
        row.text = row.text[: numbers[-1].start()] + "1000000000000" + row.text[numbers[-1].end() :]
        row.allowed = {**row.allowed, name: value / printed * 1e12}
        row.printed = (*row.printed[:-1], 1e12)


OTHER_UNITS = {"V": ("mV", 1e-3), "mV": ("V", 1e3), "A": ("mA", 1e-3), "mWb": ("Wb", 1e3), "kN": ("N", 1e-3)}
OTHER_UNITS |= {"N": ("kN", 1e3), "mm": ("cm", 10.0), "m": ("mm", 1e-3), "Volt": ("mV", 1e-3)}
"""Unit -> another one for the same channel, and how much larger it is."""


def second_header(draft: Draft, rng: random.Random) -> None:
    """Let the whole header, or what of it names the columns, stand among the rows once more, maybe with other units."""
    lines = [line for line in draft.head.removeprefix("\ufeff").split(draft.end) if line.strip()]
    if draft.reader in HEADERS_AMID_ROWS or not lines:
        return
    named = list(re.finditer(UNITS_IN_HEAD.get(draft.reader, "(?!)"), lines[-1]))
    named = [match for match in named if match[1] in OTHER_UNITS]
    larger = {}
    names = list(draft.rows[0].allowed)
    if named and len(named) == len(names) and rng.random() < 0.7:
        place = rng.randrange(len(named))
        match = named[place]
        unit, larger[names[place]] = OTHER_UNITS[match[1]]
        lines[-1] = lines[-1][: match.start(1)] + unit + lines[-1][match.end(1) :]
    at = rng.choice([rng.randrange(4), rng.randrange(len(draft.rows) + 1), len(draft.rows) - rng.randrange(3)])
    text = draft.end.join(lines[-rng.choice([1, 1, 2, len(lines)]) :])
    draft.rows.insert(max(0, min(at, len(draft.rows))), Row(text, counts=False, sample=False, larger=larger))


MUTATIONS: list[Callable[[Draft, random.Random], None]] = [
    *(drop_rows, drop_block, drop_every, garble_cell, replace_cell, first_field, overload_first, unknown_unit),
    *(blank_lines, nul_bytes, swap_marks, swap_one_mark, cut_end, double_rows, repeated_header, comment, long_rows),
    *(swap_rows, one_name_fewer, huge_number),
]


def text_mutant(reader: str, rng: random.Random, mutations: list[Callable[[Draft, random.Random], None]]) -> Mutant:
    """Return the sample of a reader after some mutations."""
    draft = draft_of(reader)
    for mutation in sorted(mutations, key=lambda m: m is cut_end):  # what follows on a cut makes it a whole line
        if len(sound_rows(draft)) > 1:
            mutation(draft, rng)
    untimed = reader in UNTIMED
    allowed: dict[int, dict[str, float]] = {}
    printed: dict[int, tuple[float, ...]] = {}
    counted = [row for row in draft.rows if row.counts]
    larger: dict[str, float] = {}
    for place, row in enumerate([row for row in counted if row.sample] if untimed else draft.rows):
        number = place if untimed else row.number
        larger = larger if row.larger is None else row.larger
        if number is None or row.number is None:
            continue
        allowed[number] = {name: value * larger.get(name, 1.0) for name, value in row.allowed.items()}
        printed[number] = row.printed
    body = draft.end.join(row.text for row in draft.rows) + (draft.end if draft.closed else "")
    sample = TEXT_WRITERS[reader]()
    head = [line for line in draft.head.split(draft.end) if line.strip()]
    return Mutant(
        label=f"{reader} {' '.join(m.__name__ for m in mutations)}",
        file=sample.name,
        data=(draft.head + body).encode(),
        allowed=allowed,
        printed=printed,
        units=sample.units,
        rows=len(counted),
        timed=not untimed,
        start=sample.start,
        dt=sample.dt,
        beside={"RefCurve.csv": RS_SETTINGS.encode()} if reader == "rohde-schwarz" else {},
        relative=reader == "daq-text",
        header_lines=sum(len(row.text.split(draft.end)) for row in draft.rows if row.larger is not None),
        notes=sum(
            _notes_beside_header(list(rows), head) for numbers, rows in groupby(draft.rows, _begins) if not numbers
        ),
    )


def _begins(row: Row) -> bool:
    """Whether a row begins with a number."""
    return row.number is not None and bool(re.match(r"\s*[+-]?\d", row.text))


def _notes_beside_header(rows: list[Row], head: list[str]) -> int:
    """Return the number of comments among lines, if a second header, or a line of the first, is among them."""
    headed = any(r.larger is not None or r.text in head for r in rows if r.number is None)
    return sum(r.counts and r.number is None and r.text not in head for r in rows) if headed else 0


def _random_text_mutant(reader: str) -> Callable[[random.Random], Mutant]:
    def make(rng: random.Random) -> Mutant:
        return text_mutant(reader, rng, [rng.choice(MUTATIONS) for _ in range(rng.randint(1, 3))])

    return make


def _mutant_of_two_headers(reader: str) -> Callable[[random.Random], Mutant]:
    others = [m for m in MUTATIONS if m not in (repeated_header, double_rows)]  # a sample is of one block

    def make(rng: random.Random) -> Mutant:
        mutations = [second_header, *(rng.choice(others) for _ in range(rng.randint(0, 2)))]
        return text_mutant(reader, rng, rng.sample(mutations, len(mutations)))

    return make


for _reader in TEXT_WRITERS:
    register(_reader, _random_text_mutant(_reader))
    if _reader not in HEADERS_AMID_ROWS:
        register(f"{_reader}-two-headers", _mutant_of_two_headers(_reader))


# --- the campaign -------------------------------------------------------------------------------------------------


class Hang(Exception):
    """A mutant took longer than it may."""


@dataclass
class Tally:
    """What became of a campaign's mutants."""

    number: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    slowest: float = 0.0

    @property
    def peak(self) -> float:
        """Largest resident memory of this process so far, in MB."""
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

    def line(self, name: str) -> str:
        """Return one line of a summary."""
        told = ", ".join(f"{count} {what}" for what, count in sorted(self.outcomes.items()))
        return f"{name:16s} {self.number:6d} mutants: {told}; slowest {self.slowest:.2f} s, peak {self.peak:.0f} MB"


def _alarm(*_: object) -> None:
    raise Hang


def campaign(name: str, first: int, count: int) -> Tally:
    """Make, read and judge mutants ``first`` … of a subject; the same number gives the same mutant, always."""
    tally = Tally()
    before = {number: signal.signal(number, _alarm) for number in (signal.SIGALRM, signal.SIGPROF)}
    try:
        for number in range(first, first + count):
            mutant = SUBJECTS[name](random.Random(f"{name} {number}"))
            began = time.perf_counter()
            signal.setitimer(signal.ITIMER_PROF, HANG)
            signal.setitimer(signal.ITIMER_REAL, 10 * HANG)
            try:
                recordings, refusals = read(mutant)
                faults = judge(mutant, recordings, refusals)
                outcome = "changed" if faults else "read" if recordings else "refused"
            except Hang:
                outcome, faults = "hang", [f"longer than {HANG} s"]
            except Exception as error:
                outcome, faults = "traceback", [f"{type(error).__name__}: {error}"]
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
                signal.setitimer(signal.ITIMER_REAL, 0)
            tally.number += 1
            tally.outcomes[outcome] += 1
            tally.faults += [f"{number} ({mutant.label}): {fault}" for fault in faults]
            tally.slowest = max(tally.slowest, time.perf_counter() - began)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return tally
