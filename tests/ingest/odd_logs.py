"""Logs of a known sine that are written oddly: other headers, clocks, numbers, marks; and what was made of them.

python -m tests.ingest.odd_logs [--first 0] [--each 12]

``KINDS`` maps the name of an oddity to a function that writes a log of it from a random generator. Its truth is known:
displacement and force at every time. ``outcome`` compares what was read with the truth.
"""

import argparse
import io
import json
import random
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings
from tests.ingest.examining import examine

DT, ROWS = 2e-3, 600
STROKE, PEAK = 0.01, 987.0

RIGHT, LEFT, SAID, WRONG = "right", "refused or left raw", "wrong, said", "wrong, silent"


@dataclass(frozen=True)
class OddLog:
    """A log and its truth.

    Attributes
    ----------
    text
        Its content; ``file`` is its name.
    starts
        Time of the truth at which each recording begins, where the log's clock begins anew; else the clock tells.
    rows
        Rows that are samples.
    unclear
        Why the log alone cannot tell what is true; empty where it can.
    finding
        A finding that must be there, by its kind.
    lacks
        Channels that must not be taken from the log.
    untrue
        Channels whose numbers are not judged.
    clock
        First time of the log's clock in s; None where the first sample that is read is the truth's first.
    near
        Largest error of a number that is right, in its amplitude.
    """

    text: str | bytes
    file: str = "log.csv"
    starts: tuple[float, ...] = ()
    rows: int = ROWS
    unclear: str = ""
    finding: str = ""
    lacks: tuple[str, ...] = ()
    untrue: tuple[str, ...] = ()
    clock: float | None = 0.0
    near: float = 2e-3


def times(rows: int = ROWS, first: int = 0) -> Array:
    """Times of samples (N,) in s."""
    return (first + np.arange(rows)) * DT


def truth(name: str, time: Array) -> Array:
    """Displacement in m or force in N at times (N,) in s: no sine is a whole number of rows, so that a shift shows."""
    if name == "displacement":
        return STROKE * np.sin(2 * np.pi * 2.03 * time)
    slow = np.cos(2 * np.pi * 2.03 * time + 0.3)
    return PEAK * (0.8 * np.tanh(3.0 * slow) + 0.2 * np.sin(2 * np.pi * 0.71 * time + 0.5))


UNITS = {"displacement": {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}, "force": {"N": 1.0, "kN": 1e3, "daN": 10.0}}
NAMES = {"displacement": ("Disp", "Displacement", "Stroke", "Position"), "force": ("Force", "Load", "Axial Force")}


@dataclass(frozen=True)
class Column:
    """A column: its quantity, name and unit, and the numbers (N,) that are printed."""

    name: str
    unit: str
    numbers: Array

    def head(self, form: str = "{n} ({u})") -> str:
        """Cell of the header."""
        return form.format(n=self.name, u=self.unit)


def column(rng: random.Random, quantity: str, time: Array, unit: str = "", factor: float = 1.0) -> Column:
    """A column of a quantity in any unit."""
    unit = unit or rng.choice(sorted(UNITS[quantity]))
    return Column(rng.choice(NAMES[quantity]), unit, truth(quantity, time) / UNITS[quantity][unit] / factor)


def columns(rng: random.Random, time: Array) -> list[Column]:
    """Both quantities in any order."""
    made = [column(rng, "displacement", time), column(rng, "force", time)]
    rng.shuffle(made)
    return made


def lines(cells: Sequence[Sequence[str]], between: str = ",") -> str:
    """Rows of text of columns of cells."""
    return "".join(between.join(row) + "\n" for row in zip(*cells, strict=True))


def printed(numbers: Array, form: str = ".6f") -> list[str]:
    """Cells of numbers."""
    return [f"{x:{form}}" for x in numbers]


def block(
    rng: random.Random, time: Array, form: str = "{n} ({u})", between: str = ",", clock: Array | None = None
) -> str:
    """A header and rows."""
    made = [Column("Time", "s", time if clock is None else clock), *columns(rng, time)]
    return between.join(c.head(form) for c in made) + "\n" + lines([printed(c.numbers) for c in made], between)


# --- headers ------------------------------------------------------------------------------------------------------


def second_header(rng: random.Random) -> OddLog:
    first, between = rng.randrange(150, 450), rng.choice([",", ";", "\t"])
    anew = rng.random() < 0.5
    form = rng.choice(["{n} ({u})", "{n} [{u}]", "{n}_{u}", "{n}/{u}"])
    gap = rng.choice(["", "\n", "\n\nTest continued\n", "# second part\n"])
    later = times(ROWS - first, first)
    text = block(rng, times(first), form, between) + gap
    text += block(rng, later, form, between, clock=later - later[0] if anew else None)
    return OddLog(text, starts=(0.0, later[0]) if anew else ())


def second_unit_row(rng: random.Random) -> OddLog:
    first = rng.randrange(150, 450)
    text, between = "", rng.choice([",", ";", "\t"])
    for time in (times(first), times(ROWS - first, first)):
        made = [Column("Time", "s", time), *columns(rng, time)]
        text += between.join(c.name for c in made) + "\n" + between.join(c.unit for c in made) + "\n"
        text += lines([printed(c.numbers) for c in made], between)
    return OddLog(text)


def unit_row_between(rng: random.Random) -> OddLog:
    """A new row of units alone: from there the numbers are in these."""
    first = rng.randrange(150, 450)
    one, two = times(first), times(ROWS - first, first)
    text = "Time,Disp,Force\ns,mm,N\n"
    text += lines([printed(one), printed(truth("displacement", one) * 1e3), printed(truth("force", one))])
    text += "s,mm,kN\n"
    text += lines([printed(two), printed(truth("displacement", two) * 1e3), printed(truth("force", two) / 1e3)])
    return OddLog(text)


def wider_block(rng: random.Random) -> OddLog:
    first = rng.randrange(150, 450)
    later = times(ROWS - first, first)
    made = [Column("Time", "s", later), Column("Temperature", "degC", 24 + 0.1 * later), *columns(rng, later)]
    return OddLog(
        block(rng, times(first)) + ",".join(c.head() for c in made) + "\n" + lines([printed(c.numbers) for c in made])
    )


def units_above(rng: random.Random) -> OddLog:
    made = [Column("Time", "s", times()), *columns(rng, times())]
    wrap = rng.choice(["{}", "[{}]", "({})"])
    text = ",".join(wrap.format(c.unit) for c in made) + "\n" + ",".join(c.name for c in made) + "\n"
    return OddLog(text + lines([printed(c.numbers) for c in made]))


def lvm_segments(rng: random.Random) -> OddLog:
    first = rng.randrange(150, 450)
    text = "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
    text += "Multi_Headings\tYes\nX_Columns\tOne\nTime_Pref\tRelative\n***End_of_Header***\t\n\t\n"
    for time in (times(first), times(ROWS - first, first)):
        made = columns(rng, time)
        text += f"Channels\t2\t\nSamples\t{len(time)}\t{len(time)}\nY_Unit_Label\t{made[0].unit}\t{made[1].unit}\n"
        text += f"X_Dimension\tTime\tTime\nX0\t{time[0]:.6E}\t{time[0]:.6E}\nDelta_X\t{DT:.6E}\t{DT:.6E}\n"
        text += f"***End_of_Header***\t\t\nX_Value\t{made[0].name}\t{made[1].name}\tComment\n"
        text += lines([printed(time), *(printed(c.numbers) for c in made)], "\t")
    return OddLog(text, "log.lvm")


# --- factors and rows that are no samples -------------------------------------------------------------------------


def factor_in_name(rng: random.Random) -> OddLog:
    factor, form = rng.choice(
        [(10.0, "{n} x10 ({u})"), (1e3, "{n} x1000 ({u})"), (100.0, "{n} *100 [{u}]"), (1e-3, "{n} ×0.001 ({u})")]
    )
    made = [column(rng, "displacement", times()), column(rng, "force", times(), "N", factor)]
    text = f"Time (s),{made[0].head()},{made[1].head(form)}\n"
    return OddLog(text + lines([printed(times()), *(printed(c.numbers, ".9g") for c in made)]))


def divisor_in_name(rng: random.Random) -> OddLog:
    made = [column(rng, "displacement", times()), column(rng, "force", times(), "N", 100.0)]
    form = rng.choice(["{n} /100 ({u})", "{n} ({u}/100)", "{n} /1000 [{u}]"])
    text = f"Time (s),{made[0].head()},{made[1].head(form)}\n"
    log = text + lines([printed(times()), *(printed(c.numbers, ".9g") for c in made)])
    return OddLog(log, unclear="'/100' may say that the numbers were divided or are to be", lacks=("force",))


def scale_row(rng: random.Random) -> OddLog:
    word = rng.choice(["Scale", "Scale factor", "Gain", "Multiplier", "Factor"])
    scale = rng.choice([0.5, 0.01, 12.5, 100.0])
    made = [column(rng, "displacement", times(), "mm"), column(rng, "force", times(), "N", scale)]
    text = f"Channel,Time,{made[0].name},{made[1].name}\nUnit,s,mm,N\n{word},1,1,{scale:g}\n"
    cells = [[str(k) for k in range(ROWS)], printed(times()), *(printed(c.numbers, ".9g") for c in made)]
    return OddLog(text + lines(cells), unclear="the factors may be in the numbers already")


def rows_of_statistics(rng: random.Random) -> OddLog:
    labelled, rate = rng.random() < 0.5, rng.random() < 0.6
    made = columns(rng, times())
    clock = [] if rate else [Column("Time", "s", times())]
    head = "Sample rate: 500 Hz\n" if rate else ""
    names = [c.head() for c in (*clock, *made)]
    cells = [printed(c.numbers) for c in (*clock, *made)]
    few = rng.choice([("Max", "Min"), ("Minimum", "Maximum", "Mean"), ("Total",), ("Average", "Std"), ("Sum",)])
    value = {"M": np.max, "T": np.sum, "S": np.sum, "A": np.mean}
    tail = ""
    for word in few:
        numbers = [f"{value[word[0]](c.numbers) if word[:3] != 'Min' else c.numbers.min():.6f}" for c in made]
        tail += ",".join([word, *([""] * (len(clock) - (not labelled))), *numbers]) + "\n"
    if not labelled and rate:
        names, cells = ["No", *names], [[str(k) for k in range(1, ROWS + 1)], *cells]
    elif labelled:
        names, cells = ["Mark", *names], [[""] * ROWS, *cells]
    return OddLog(head + ",".join(names) + "\n" + lines(cells) + tail)


def long_format(rng: random.Random) -> OddLog:
    made, between = columns(rng, times()), rng.choice([",", ";", "\t"])
    entries = [
        between.join([f"{t:.4f}", c.name, c.unit, f"{x:.7g}"])
        for k, t in enumerate(times())
        for c in made
        for x in [c.numbers[k]]
    ]
    if rng.random() < 0.5:
        entries = entries[::2] + entries[1::2]
    head = between.join(["Time (s)", *rng.choice([("Channel", "Unit", "Value"), ("Signal", "Units", "Reading")])])
    return OddLog(head + "\n" + "\n".join(entries) + "\n")


# --- clocks -------------------------------------------------------------------------------------------------------


def _counted(rng: random.Random) -> tuple[str, str]:
    """A line that states 500 Hz, and the name of a column of counts."""
    line = rng.choice(
        ["Sample rate: 500 Hz", "Sampling interval: 2 ms", "Sampling frequency (Hz),500", "# scan rate = 0.5 kHz"]
    )
    return line, rng.choice(["Sample", "Index", "Sample No.", "Scan", "No.", "#"])


def skipping_index(rng: random.Random) -> OddLog:
    line, name = _counted(rng)
    kept = np.ones(ROWS, bool)
    for _ in range(rng.randint(1, 3)):
        first = rng.randrange(50, ROWS - 100)
        kept[first : first + rng.randrange(15, 60)] = False
    index = np.flatnonzero(kept)
    base, made = rng.choice([0, 1, 1000]), columns(rng, times())
    text = f"{line}\n{name},{made[0].head()},{made[1].head()}\n"
    cells = [[str(k + base) for k in index], *(printed(c.numbers[kept]) for c in made)]
    return OddLog(text + lines(cells), rows=len(index), clock=None)


def two_times(rng: random.Random) -> OddLog:
    shift, slow = rng.choice([0.0, 0.4e-3, -0.7e-3]), rng.choice([1, 1, 2])
    other = times(ROWS // slow) * slow + shift
    if slow == 1 and shift == 0.0:
        other = other * 1.25
    first, second = column(rng, "displacement", times()), column(rng, "force", other)
    word = rng.choice(["Time (s)", "X_Value (s)", "t [s]"])
    pad = ["" for _ in range(ROWS - len(other))]
    cells = [printed(times()), printed(first.numbers), [*printed(other), *pad], [*printed(second.numbers), *pad]]
    text = f"{word},{first.head()},{word},{second.head()}\n" + lines(cells)
    return OddLog(text, rows=len(other) * 4 // 5, near=1e-2)


def _without_times(rng: random.Random, head: Sequence[str], unclear: str = "") -> OddLog:
    made = columns(rng, times())
    text = "\n".join([*head, ",".join(c.head() for c in made)]) + "\n"
    return OddLog(text + lines([printed(c.numbers) for c in made]), unclear=unclear)


def rates_that_disagree(rng: random.Random) -> OddLog:
    head = rng.sample(
        ["Sample rate: 500 Hz", "Sampling rate,1000 Hz", "Sample interval,5 ms", "Scan rate = 250 Hz"], k=2
    )
    return _without_times(rng, head, "two rates are stated, and they disagree")


def rates_of_other_things(rng: random.Random) -> OddLog:
    other = ["Max sample rate,10000 Hz", "Display update rate,10 Hz", "Record length,1.2 s", "Maximum rate: 2 MHz"]
    other += [
        "Period of the record (s),1.2",
        "Screen sampling rate,25 Hz",
        "Recording duration,1.2 s",
        "Filter rate,50 Hz",
    ]
    head = rng.sample(other, k=rng.randint(1, 2))
    if rng.random() < 0.5:
        head.insert(rng.randint(0, len(head)), rng.choice(["Sample rate,500 Hz", "Acquisition sample rate: 500 Hz"]))
        return _without_times(rng, head)
    return _without_times(rng, head, "no rate of samples is stated")


def decimated_rate(rng: random.Random) -> OddLog:
    by = rng.choice([2, 5, 10])
    word = rng.choice(
        ["Decimation", "Decimation factor", "Downsampling", "Save every nth sample", "Stored every", "Sample divider"]
        + ["Keep every n-th point", "Logged one of", "Rate divisor", "Points skipped", "Save every"]
        + ["Reduction", "Resampled by", "Averaged samples"]
    )
    head = [f"Sample rate,{500 * by} Hz", f"{word},{by}"]
    return _without_times(rng, head, "rate before or after decimation")


def thousands_in_times(rng: random.Random) -> OddLog:
    made = [column(rng, "displacement", times(), "mm"), column(rng, "force", times(), "N")]
    german = rng.random() < 0.5
    time = [f"{1e3 * t + 100:,.1f}" for t in times()]
    cells = [time, *(printed(c.numbers, ",.4f") for c in made)]
    if german:
        cells = [[c.replace(",", "_").replace(".", ",").replace("_", ".") for c in column_] for column_ in cells]
    else:
        cells = [[f'"{c}"' for c in column_] for column_ in cells]
    head = [f"{rng.choice(['Time', 'Zeit'])} (ms)", *(c.head() for c in made)]
    between = ";" if german else ","
    return OddLog(between.join(head) + "\n" + lines(cells, between), clock=0.1)


def epochs(rng: random.Random) -> OddLog:
    name, scale, form = rng.choice(
        [("Time", 1e3, ".0f"), ("Timestamp", 1e6, ".0f"), ("Timestamp (ms)", 1e3, ".0f"), ("Epoch (us)", 1e6, ".0f")]
        + [("Unix time", 1.0, ".3f"), ("Timestamp (s)", 1.0, ".3f"), ("Time", 1e9, "d")]
    )
    base, made = 1_700_000_000 + rng.randrange(10**7), columns(rng, times())
    clock = [f"{round((base + t) * scale) if form == 'd' else (base + t) * scale:{form}}" for t in times()]
    if form == "d":
        clock = [f"{base * 10**9 + round(t * 1e9)}" for t in times()]
    text = f"{name},{made[0].head()},{made[1].head()}\n"
    return OddLog(text + lines([clock, *(printed(c.numbers) for c in made)]), clock=None)


def days(rng: random.Random) -> OddLog:
    name, base = rng.choice([("Date", 45_000.5), ("Time", 45_321.25), ("Date/Time", 44_987.0), ("Time (d)", 0.0)])
    made = columns(rng, times())
    clock = [f"{base + t / 86400:.12f}" for t in times()]
    text = f"{name},{made[0].head()},{made[1].head()}\n"
    return OddLog(text + lines([clock, *(printed(c.numbers) for c in made)]), clock=None)


def dates(rng: random.Random) -> OddLog:
    made, base = columns(rng, times()), datetime(2024, 3, rng.randint(13, 28), 11, 59, 59, 400_000)
    form = rng.choice(
        [
            "%d.%m.%Y %H:%M:%S.%f",
            "%m/%d/%Y %I:%M:%S.%f %p",
            "%Y-%m-%dT%H:%M:%S.%fZ",
            "%d/%m/%Y %H:%M:%S.%f",
            "%I:%M:%S.%f %p",
        ]
    )
    clock = [(base + timedelta(seconds=t)).strftime(form) for t in times()]
    text = f"{rng.choice(['Time', 'Date time', 'Timestamp'])},{made[0].head()},{made[1].head()}\n"
    return OddLog(text + lines([clock, *(printed(c.numbers) for c in made)]), clock=None)


# --- marks, faults, sizes -----------------------------------------------------------------------------------------


def marks(rng: random.Random) -> OddLog:
    made = [Column("Time", "s", times()), *columns(rng, times())]
    mark = rng.choice(
        ["-999", "-9999", "-99999", "999999", "1e10", "-32768", "-9999.0", "9.9E37"]
        + ["0", "-1", "-888", "-3276.8", "-99.99"]
    )
    cells = [printed(c.numbers) for c in made]
    for _ in range(rng.randint(2, 6)):
        first = rng.randrange(20, ROWS - 60)
        for k in range(first, first + rng.randint(1, 12)):
            cells[rng.choice([1, 2]) if rng.random() < 0.1 else 2][k] = mark
    peak = max(abs(c.numbers).max() for c in made[1:])
    log = ",".join(c.head() for c in made) + "\n" + lines(cells)
    unclear = "the channel may have the number itself" if abs(float(mark)) < 2.0 * peak else ""
    return OddLog(log, unclear=unclear, near=0.04)  # through a corner of the force


def faults(rng: random.Random) -> OddLog:
    noise = np.random.default_rng(rng.randrange(10**9)).normal(0.0, 1.0, ROWS)
    force = PEAK * np.sin(2 * np.pi * 2.03 * times() + 1.0) + 3.0 * noise  # a tanh is flat by itself
    kind = rng.choice(["saturated", "stuck", "wrap-round"])
    if kind == "saturated":
        force = np.minimum(force - 3.0 * noise, rng.uniform(400.0, 800.0)) + 1.5 * noise
    elif kind == "stuck":
        first = rng.randrange(100, 300)
        force[first : first + rng.randrange(120, 250)] = force[first]
    else:
        count = np.round(force * 50.0)
        force = ((count + 32768) % 65536 - 32768) / 50.0
    cells = [printed(times()), printed(1e3 * truth("displacement", times()), ".5f"), printed(force, ".3f")]
    return OddLog("Time (s),Displacement (mm),Force (N)\n" + lines(cells), finding=kind, untrue=("force",))


def sizes(rng: random.Random) -> OddLog:
    quantity, unit = rng.choice([("displacement", "Mm"), ("displacement", "km"), ("force", "GN"), ("current", "MA")])
    made = [Column("Time", "s", times()), *columns(rng, times())]
    if quantity == "current":
        made.append(Column("Coil current", "MA", 1.5 + 0.0 * times()))
    else:
        number = [truth(quantity, times()) / (1e-3 if quantity == "displacement" else 1.0)]
        keep = [c for c in made[1:] if (c.name in NAMES["force"]) == (quantity == "displacement")]
        made = [made[0], Column(NAMES[quantity][1], unit, number[0]), *keep]
    text = ",".join(c.head() for c in made) + "\n" + lines([printed(c.numbers) for c in made])
    return OddLog(text, unclear="a size that nothing has", lacks=(quantity,))


def other_quantities(rng: random.Random) -> OddLog:
    quantity, name, unit = rng.choice(
        [
            ("displacement", "Position Error", "mm"),
            ("displacement", "Demand Position", "mm"),
            ("displacement", "Displacement Setpoint", "mm"),
            ("displacement", "Position Command", "mm"),
            ("force", "Force Limit", "N"),
            ("force", "Load Error", "kN"),
            ("force", "Target Force", "N"),
            ("current", "Load cell", "mA"),
            ("current", "LVDT output", "mA"),
        ]
    )
    made = [Column("Time", "s", times()), *columns(rng, times())]
    if quantity != "current":
        made = [made[0], *(c for c in made[1:] if (c.name in NAMES["force"]) == (quantity == "displacement"))]
    made.insert(rng.randint(1, len(made)), Column(name, unit, 4.0 + 0.3 * np.sin(9.0 * times())))
    text = ",".join(c.head() for c in made) + "\n" + lines([printed(c.numbers) for c in made])
    return OddLog(text, lacks=(quantity,))


def pounds(rng: random.Random) -> OddLog:
    made = [
        column(rng, "displacement", times()),
        Column("Force", rng.choice(["lb", "lbs"]), truth("force", times()) / 4.4482216),
    ]
    rng.shuffle(made)
    text = f"Time (s),{made[0].head()},{made[1].head()}\n"
    return OddLog(text + lines([printed(times()), *(printed(c.numbers) for c in made)]))


# --- spelling -----------------------------------------------------------------------------------------------------


def spelt_numbers(rng: random.Random) -> OddLog:
    made = [Column("Time", "s", times()), *columns(rng, times())]
    form = rng.choice(["minus", "fortran", "fortran-d", "plus", "space"])
    cells = []
    for c in made:
        if form == "minus":
            cells.append([x.replace("-", "−") for x in printed(c.numbers)])
        elif form.startswith("fortran"):
            cells.append([x.replace("E", "D" if form == "fortran" else "d") for x in printed(c.numbers, ".6E")])
        else:
            cells.append(printed(c.numbers, "+.6f" if form == "plus" else " .6f"))
    return OddLog(",".join(c.head() for c in made) + "\n" + lines(cells))


def spelt_names(rng: random.Random) -> OddLog:
    made = [Column("Time", "s", times()), *columns(rng, times())]
    form = rng.choice(
        ["{n}_{u}_", "{n}..{u}.", "{n}.{u}", "{n} - {u}", "{u} {n}", "{n}({u})", "{n} in {u}", "[{u}] {n}"]
    )
    text = ",".join(c.head(form) for c in made) + "\n" + lines([printed(c.numbers) for c in made])
    return OddLog(text, unclear="a unit before a name may be a word of it" if form == "{u} {n}" else "")


def campbell(rng: random.Random) -> OddLog:
    made = columns(rng, times())
    base = datetime(2024, 5, 7, 23, 59, 59, 600_000)
    head = '"TOA5","rig","CR1000","1","CR1000.Std.32","CPU:rig.CR1","9","Fast"\n'
    head += f'"TIMESTAMP","RECORD","{made[0].name}","{made[1].name}"\n"TS","RN","{made[0].unit}","{made[1].unit}"\n'
    head += rng.choice(['"","","Smp","Smp"\n', '"","","Avg","Smp"\n'])
    stamps = [(base + timedelta(seconds=t)).strftime('"%Y-%m-%d %H:%M:%S.%f')[:-3] + '"' for t in times()]
    return OddLog(
        head + lines([stamps, [str(k) for k in range(ROWS)], *(printed(c.numbers) for c in made)]),
        "log.dat",
        clock=None,
    )


# --- attributes of HDF5 -------------------------------------------------------------------------------------------


def packed_hdf(rng: random.Random) -> OddLog:
    """Whole numbers with scale, offset, gain, fill; times of CF; units as bytes or arrays."""
    import h5py

    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        unit, scale = rng.choice(
            [("seconds", 1.0), ("milliseconds since 2024-05-01", 1e3), ("days since 2024-05-01", 1 / 86400)]
            + [("seconds since 2024-05-01 10:00", 1.0), ("hours since 1990-01-01", 1 / 3600), ("ms", 1e3)]
        )
        file["time"] = times() * scale
        file["time"].attrs["units"] = unit
        for name, own, factor, size in (("displacement", "mm", 1e3, 0.001), ("force", "N", 1.0, 0.05)):
            add = rng.choice([0.0, 5.0]) if name == "displacement" else rng.choice([0.0, 100.0])
            stored = np.round((truth(name, times()) * factor - add) / size).astype(np.int32)
            if filled := rng.random() < 0.5:
                first = rng.randrange(100, 400)
                stored[first : first + 20] = -2147483648
            file[name] = stored
            about = file[name].attrs
            about[rng.choice(["scale_factor", "scale_factor", "gain"])] = size
            if add:
                about["add_offset"] = add
            if filled:
                about[rng.choice(["_FillValue", "missing_value"])] = np.int32(-2147483648)
            about[rng.choice(["units", "unit", "Unit"])] = rng.choice([own, np.bytes_(own), np.array([own.encode()])])
    return OddLog(buffer.getvalue(), "log.h5", clock=None, near=1e-2)


def json_records(rng: random.Random) -> OddLog:
    made = [Column("Time", "s", times()), *columns(rng, times())]
    if rng.random() < 0.5:
        content: object = [{c.head(): float(c.numbers[k]) for c in made} for k in range(ROWS)]
    else:
        content = {c.head(): c.numbers.tolist() for c in made}
    return OddLog(json.dumps(content), "log.json")


Writer = Callable[[random.Random], OddLog]
KINDS: dict[str, Writer] = {
    made.__name__: made
    for made in (
        *(second_header, second_unit_row, unit_row_between, wider_block, units_above, lvm_segments),
        *(factor_in_name, divisor_in_name, scale_row, rows_of_statistics, long_format),
        *(skipping_index, two_times, rates_that_disagree, rates_of_other_things, decimated_rate),
        *(thousands_in_times, epochs, days, dates, marks, faults, sizes, other_quantities, pounds),
        *(spelt_numbers, spelt_names, campbell, packed_hdf, json_records),
    )
}
"""Oddity -> what writes a log of it."""


def _errors(log: OddLog, records: Sequence[Recording]) -> Iterator[str]:
    """Say what is not true in the recordings of a log."""
    base = log.clock if log.clock is not None else records[0].start if records else 0.0
    for k, record in enumerate(records):
        start = log.starts[k] if log.starts and len(records) == len(log.starts) else record.start - base
        time = start + np.arange(record.samples) * record.dt
        for name in ("displacement", "force"):
            if name in record.channels and name not in log.untrue:
                size = STROKE if name == "displacement" else PEAK
                error = np.max(np.abs(record.channels[name] - truth(name, time))) / size
                if not error < log.near:
                    yield f"{record.id}: {name} is wrong by {error:.3g} of its amplitude"
        for name in log.lacks:
            if name in record.channels:
                yield f"{record.id}: {name} is taken from what is none"
    if records and sum(r.rows_kept + r.rows_refused for r in records) < log.rows:
        yield f"{sum(r.rows_kept + r.rows_refused for r in records)} of {log.rows} rows are counted"
    kinds = {f.kind for r in records for f in r.findings}
    if records and log.finding and log.finding not in kinds:
        yield f"no finding says {log.finding}"


def outcome(log: OddLog, records: Sequence[Recording], refusals: Sequence[Refusal]) -> tuple[str, str]:
    """Return what became of a log, and a line on what is wrong or why it was refused."""
    if errors := list(_errors(log, records)):
        said = any(f.kind not in ("gap", "resampled") for r in records for f in r.findings)
        return (SAID if said else WRONG), "; ".join(errors)
    wanted = {"displacement", "force"} - set(log.lacks)
    if not records or any(not wanted <= set(r.channels) for r in records):
        told = [str(r) for r in refusals] or [f.text for r in records for f in r.findings]
        return LEFT, "; ".join(told)[:300]
    return RIGHT, ""


def made(kind: str, number: int, kinds: Mapping[str, Writer] = KINDS) -> OddLog:
    """Make log ``number`` of a kind; the same number gives the same bytes."""
    return kinds[kind](random.Random(f"{kind} {number}"))


def read(log: OddLog, folder: Path) -> tuple[list[Recording], list[Refusal]]:
    """Write a log into a folder and read it."""
    path = folder / log.file
    path.write_bytes(log.text if isinstance(log.text, bytes) else log.text.encode())
    return examine([path], Settings(jobs=1))


def main(kinds: Mapping[str, Writer] = KINDS) -> None:
    """Print what became of so many logs of every kind."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--each", type=int, default=12)
    asked = parser.parse_args()
    whole: dict[bool, Counter[str]] = {True: Counter(), False: Counter()}
    for kind in kinds:
        tally: Counter[str] = Counter()
        for number in range(asked.first, asked.first + asked.each):
            log = made(kind, number, kinds)
            with tempfile.TemporaryDirectory() as folder:
                found, why = outcome(log, *read(log, Path(folder)))
            tally[found] += 1
            whole[not log.unclear][found] += 1
            if why and not (log.unclear and found == LEFT):
                print(f"  {kind} {number}: {found}: {why}")
        print(f"{kind}: " + ", ".join(f"{count} {name}" for name, count in tally.items()))
    for knowable, tally in whole.items():
        print("can be known:" if knowable else "cannot be known:", dict(tally))


if __name__ == "__main__":
    main()
