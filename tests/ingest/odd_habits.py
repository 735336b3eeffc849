"""Habits of instruments and of people that write logs, beside those of ``odd_logs``: the same truth, the same judge.

python -m tests.ingest.odd_habits [--first 0] [--each 1]

Of the reader only the rule on stuck channels had been seen when they were written.
"""

import io
import random
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta

import numpy as np

from mrfit.core.specs import Array
from tests.ingest import odd_logs
from tests.ingest.odd_logs import DT, PEAK, ROWS, Column, OddLog, Writer, lines, printed, times, truth

MM, N = 1e3, 1.0
HABITS: dict[str, Writer] = {}
Cells = Sequence[Sequence[str]]


def _habit(write: Writer) -> Writer:
    HABITS[write.__name__] = write
    return write


def _stroke(time: Array, factor: float = MM) -> list[str]:
    return printed(truth("displacement", time) * factor)


def _force(time: Array, factor: float = N, form: str = ".5f") -> list[str]:
    return printed(truth("force", time) * factor, form)


def _table(head: str, cells: Cells, between: str = ",") -> str:
    return head + "\n" + lines(cells, between)


def _plain(rng: random.Random, clock: list[str] | None = None, name: str = "Time (s)") -> str:
    """Log with a clock of any form."""
    cells = [clock or printed(times()), _stroke(times()), _force(times())]
    return _table(f"{name},Displacement (mm),Force (N)", cells)


# --- C5: a second header ------------------------------------------------------------------------------------------


def _two_blocks(rng: random.Random, between: Callable[[int], str], second: Callable[[Array], str]) -> OddLog:
    first = rng.randrange(150, 450)
    return OddLog(
        _table(
            "Time (s),Displacement (mm),Force (N)", [printed(times(first)), _stroke(times(first)), _force(times(first))]
        )
        + between(first)
        + second(times(ROWS - first, first))
    )


@_habit
def cycle_titles(rng: random.Random) -> OddLog:
    def second(time: Array) -> str:
        return _table(
            "Time (s),Displacement (in),Force (kN)",
            [printed(time), _stroke(time, 1 / 0.0254), _force(time, 1e-3, ".8f")],
        )

    return _two_blocks(rng, lambda k: f"\nCycle {rng.randint(2, 9)}\n\n", second)


@_habit
def sections_of_ini(rng: random.Random) -> OddLog:
    def second(time: Array) -> str:
        return "[Data 2]\n" + _table(
            "Force (N),Time (s),Displacement (mm)", [_force(time), printed(time), _stroke(time)]
        )

    log = _two_blocks(rng, lambda k: "[Info]\nOperator=xyz\n", second)
    return OddLog("[Info]\nOperator=abc\n[Data 1]\n" + str(log.text))


@_habit
def another_language(rng: random.Random) -> OddLog:
    def second(time: Array) -> str:
        return _table("Zeit (s),Kraft (N),Weg (mm)", [printed(time), _force(time), _stroke(time)])

    return _two_blocks(rng, lambda k: "", second)


@_habit
def another_time_unit(rng: random.Random) -> OddLog:
    def second(time: Array) -> str:
        return _table("Time (ms),Displacement (mm),Force (N)", [printed(time * 1e3), _stroke(time), _force(time)])

    return _two_blocks(rng, lambda k: rng.choice(["", "\n", "; resumed\n"]), second)


@_habit
def index_before_the_second_block(rng: random.Random) -> OddLog:
    def second(time: Array) -> str:
        cells = [[str(k) for k in range(len(time))], printed(time), _stroke(time), _force(time)]
        return _table("No.,Time (s),Displacement (mm),Force (N)", cells)

    return _two_blocks(rng, lambda k: "", second)


@_habit
def byte_order_mark_amid(rng: random.Random) -> OddLog:
    def second(time: Array) -> str:
        return _table(
            "\ufeffTime (s),Force (kN),Displacement (mm)", [printed(time), _force(time, 1e-3, ".8f"), _stroke(time)]
        )

    return _two_blocks(rng, lambda k: "", second)


@_habit
def column_lost_in_the_second_block(rng: random.Random) -> OddLog:
    """The second block lacks the stroke: its force must not become one."""
    first = rng.randrange(200, 400)
    one, two = times(first), times(ROWS - first, first)
    text = _table("Time (s),Displacement (mm),Force (N)", [printed(one), _stroke(one), _force(one)])
    return OddLog(
        text + _table("Time (s),Force (N)", [printed(two), _force(two)]), unclear="nothing tells the stroke of it"
    )


# --- C6: indices, clocks, factors, rows that are no samples -------------------------------------------------------


@_habit
def counter_of_bits(rng: random.Random) -> OddLog:
    """A sample counter of 8 bits that wraps, with a rate."""
    cells = [[str(k % 256) for k in range(ROWS)], _stroke(times()), _force(times())]
    return OddLog("Sample rate: 500 Hz\n" + _table("Counter,Displacement (mm),Force (N)", cells))


@_habit
def counter_in_steps(rng: random.Random) -> OddLog:
    """Every second sample of a converter is kept: the number tells it, the rate is the converter's."""
    cells = [[str(2 * k) for k in range(ROWS)], _stroke(times()), _force(times())]
    log = "Sample rate: 1000 Hz\n" + _table("Sample,Displacement (mm),Force (N)", cells)
    return OddLog(log, unclear="the rate may be that of the rows")


@_habit
def pairs_of_time_and_value(rng: random.Random) -> OddLog:
    cells = [printed(times()), _stroke(times()), printed(times()), _force(times())]
    return OddLog(_table("Time (s),Displacement (mm),Time (s),Force (N)", cells))


@_habit
def pairs_of_other_rates(rng: random.Random) -> OddLog:
    """Each channel has its own clock; that of the force is half as fast and its column shorter."""
    own = times()[::2]
    rest = [""] * (ROWS - len(own))
    cells = [printed(times()), _stroke(times()), printed(own) + rest, _force(own) + rest]
    return OddLog(_table("t_disp (s),Displacement (mm),t_force (s),Force (N)", cells), near=0.05)


@_habit
def footer_of_words(rng: random.Random) -> OddLog:
    tail = rng.choice(["End of test\n", "Total samples: 600\n", "--- EOF ---\n", "RMS,3.1,512.2\nPeak,10.0,987.0\n"])
    return OddLog(_plain(rng) + tail)


@_habit
def statistics_above(rng: random.Random) -> OddLog:
    x, f = truth("displacement", times()) * MM, truth("force", times())
    head = f"Min,,{x.min():.4f},{f.min():.4f}\nMax,,{x.max():.4f},{f.max():.4f}\n"
    cells = [[""] * ROWS, printed(times()), _stroke(times()), _force(times())]
    return OddLog(_table("Mark,Time (s),Displacement (mm),Force (N)\n" + head.rstrip("\n"), cells))


@_habit
def power_in_the_unit(rng: random.Random) -> OddLog:
    unit = rng.choice(["x10^3 N", "10^3 N", "1e3 N", "×10³ N", "E3 N"])
    cells = [printed(times()), _stroke(times()), _force(times(), 1e-3, ".8f")]
    return OddLog(_table(f"Time (s),Displacement (mm),Force ({unit})", cells))


@_habit
def sensitivity_in_the_head(rng: random.Random) -> OddLog:
    """Volts of sensors, with their sensitivities said above: no quantity until somebody applies them."""
    head = "Ch1 sensitivity: 2 mm/V\nCh2 sensitivity: 100 N/V\n"
    cells = [printed(times()), _stroke(times(), MM / 2), _force(times(), 0.01, ".8f")]
    return OddLog(
        head + _table("Time (s),Ch1 (V),Ch2 (V)", cells),
        unclear="which channel is which",
        lacks=("force", "displacement"),
    )


@_habit
def long_format_by_number(rng: random.Random) -> OddLog:
    rows = [
        f"{t:.4f};{n};{x:.6f}"
        for k, t in enumerate(times())
        for n, x in (
            ("Displacement [mm]", truth("displacement", times())[k] * MM),
            ("Force [N]", truth("force", times())[k]),
        )
    ]
    return OddLog("Time [s];Tag;Value\n" + "\n".join(rows) + "\n")


@_habit
def wide_time_across(rng: random.Random) -> OddLog:
    """Samples run to the right: a row a channel."""
    cells = [["Time (s)", *printed(times())], ["Displacement (mm)", *_stroke(times())], ["Force (N)", *_force(times())]]
    return OddLog("\n".join(",".join(row) for row in cells) + "\n", unclear="no format has channels as rows")


@_habit
def units_two_rows_above(rng: random.Random) -> OddLog:
    cells = [printed(times()), _stroke(times()), _force(times())]
    return OddLog(
        "Units\n,s,mm,N\nNames\n" + _table("Run,Time,Displacement,Force", [["1"] * ROWS, *cells]),
        unclear="rows between",
    )


# --- C7: rates and clocks -----------------------------------------------------------------------------------------


def _untimed(rng: random.Random, head: str, unclear: str = "") -> OddLog:
    numbered = rng.random() < 0.5
    cells = [_stroke(times()), _force(times())]
    names = "Displacement (mm),Force (N)"
    if numbered:
        cells, names = [[str(k + 1) for k in range(ROWS)], *cells], f"No,{names}"
    return OddLog(head + _table(names, cells), unclear=unclear)


@_habit
def period_in_the_head(rng: random.Random) -> OddLog:
    return _untimed(
        rng,
        rng.choice(
            ["Sampling period: 2 ms\n", "Sample interval,0.002,s\n", "dt = 2E-3 s\n", "Sampling interval [ms]: 2\n"]
        ),
    )


@_habit
def rate_in_other_words(rng: random.Random) -> OddLog:
    said = [
        "Sampling frequency: 0.5 kHz\n",
        "Rate: 500 Sa/s\n",
        "Scan rate,500,Hz\n",
        "fs=500 Hz\n",
        "Samples per second: 500\n",
        "Abtastrate: 500 Hz\n",
    ]
    return _untimed(rng, rng.choice(said))


@_habit
def rate_nominal_and_actual(rng: random.Random) -> OddLog:
    other = rng.choice(["Nominal rate: 512 Hz", "Requested sample rate: 1000 Hz", "Sample rate (card): 100 kHz"])
    return _untimed(rng, f"{other}\nActual sample rate: 500 Hz\n", unclear="two rates")


@_habit
def rate_of_the_controller(rng: random.Random) -> OddLog:
    said = [
        "Max. sample rate: 2 GSa/s",
        "Control loop rate: 5000 Hz",
        "Filter cut-off: 200 Hz",
        "Test frequency: 2.03 Hz",
        "Display refresh rate: 60 Hz",
        "Update period: 0.1 s",
    ]
    return _untimed(rng, rng.choice(said) + "\n", unclear="no rate of samples is said")


@_habit
def epoch_fine(rng: random.Random) -> OddLog:
    unit, factor = rng.choice([("us", 1e6), ("µs", 1e6), ("ns", 1e9), ("ms", 1e3)])
    start = 1_714_550_000 * int(factor)
    clock = [str(start + round(t * factor)) for t in times()]
    return OddLog(_plain(rng, clock, f"Timestamp ({unit})"), clock=None)


@_habit
def labview_seconds(rng: random.Random) -> OddLog:
    clock = [f"{3_797_000_000 + t:.4f}" for t in times()]
    return OddLog(_plain(rng, clock, "Time (s)"), clock=None)


@_habit
def matlab_datenum(rng: random.Random) -> OddLog:
    clock = [f"{739_000.25 + t / 86400:.11f}" for t in times()]
    return OddLog(_plain(rng, clock, rng.choice(["datenum", "Time (days)", "Time (d)"])), clock=None, near=2e-2)


@_habit
def time_of_day_over_midnight(rng: random.Random) -> OddLog:
    base = datetime(2024, 5, 1, 23, 59, 59, 500_000)
    clock = [(base + timedelta(seconds=t)).strftime("%H:%M:%S.%f") for t in times()]
    return OddLog(_plain(rng, clock, "Time"), clock=None)


@_habit
def clock_with_a_comma(rng: random.Random) -> OddLog:
    base = datetime(2024, 5, 1, 12, 0, 0)
    clock = [(base + timedelta(seconds=t)).strftime("%H:%M:%S,%f")[:-3] for t in times()]
    cells = [clock, *([x.replace(".", ",") for x in c] for c in (_stroke(times()), _force(times())))]
    return OddLog(_table("Zeit;Weg [mm];Kraft [N]", cells, ";"), clock=None)


@_habit
def clock_with_a_colon(rng: random.Random) -> OddLog:
    base = datetime(2024, 5, 1, 12, 0, 0)
    clock = [(base + timedelta(seconds=t)).strftime("%H:%M:%S:%f")[:-3] for t in times()]
    return OddLog(_plain(rng, clock, "Time"), clock=None)


@_habit
def iso_with_a_zone(rng: random.Random) -> OddLog:
    base, zone = datetime(2024, 5, 1, 12, 0, 0), rng.choice(["+02:00", "+0200", "Z", "-05:00"])
    clock = [(base + timedelta(seconds=t)).strftime("%Y-%m-%dT%H:%M:%S.%f") + zone for t in times()]
    return OddLog(_plain(rng, clock, rng.choice(["Time", "timestamp"])), clock=None)


@_habit
def date_and_time_apart(rng: random.Random) -> OddLog:
    base = datetime(2024, 5, 1, 12, 0, 0)
    stamps = [base + timedelta(seconds=t) for t in times()]
    cells = [
        [s.strftime("%Y/%m/%d") for s in stamps],
        [s.strftime("%H:%M:%S.%f") for s in stamps],
        _stroke(times()),
        _force(times()),
    ]
    return OddLog(_table("Date,Time,Displacement (mm),Force (N)", cells), clock=None)


@_habit
def clock_of_whole_seconds(rng: random.Random) -> OddLog:
    base = datetime(2024, 5, 1, 12, 0, 0)
    clock = [(base + timedelta(seconds=int(t))).strftime("%H:%M:%S") for t in times()]
    return OddLog(_plain(rng, clock, "Time"), unclear="500 samples bear one time", clock=None)


@_habit
def minutes(rng: random.Random) -> OddLog:
    name, factor = rng.choice(
        [("Time (min)", 60.0), ("Elapsed time [minutes]", 60.0), ("Time (h)", 3600.0), ("Time (hours)", 3600.0)]
    )
    return OddLog(_plain(rng, printed(times() / factor, ".10f"), name))


@_habit
def thousands_of_other_countries(rng: random.Random) -> OddLog:
    mark, point, between = rng.choice(
        [("'", ".", ","), (" ", ",", ";"), ("\u202f", ",", ";"), (".", ",", ";"), ("\u00a0", ",", ";")]
    )

    def spelt(x: float) -> str:
        return f"{x:,.5f}".replace(",", "\0").replace(".", point).replace("\0", mark)

    made = (
        ("Time (ms)", times() * 1e3),
        ("Displacement (um)", truth("displacement", times()) * 1e6),
        ("Force (mN)", truth("force", times()) * 1e3),
    )
    return OddLog(
        _table(between.join(name for name, _ in made), [[spelt(x) for x in values] for _, values in made], between)
    )


@_habit
def samples_as_time(rng: random.Random) -> OddLog:
    clock = [str(k) for k in range(ROWS)]
    return OddLog("Sample rate,500 Hz\n" + _plain(rng, clock, "Time (samples)"))


@_habit
def time_that_begins_before_zero(rng: random.Random) -> OddLog:
    return OddLog(_plain(rng, printed(times() - 0.5)), clock=-0.5)


# --- C8: marks and faults -----------------------------------------------------------------------------------------


def _marked(rng: random.Random, mark: str, head: str = "Time (s),Displacement (mm),Force (N)") -> OddLog:
    cells = [printed(times()), _stroke(times()), _force(times())]
    for _ in range(rng.randint(3, 8)):
        first = rng.randrange(20, ROWS - 60)
        for k in range(first, first + rng.randint(1, 9)):
            cells[2][k] = mark
    return OddLog(_table(head, cells), near=0.04)


@_habit
def words_for_missing(rng: random.Random) -> OddLog:
    return _marked(
        rng,
        rng.choice(
            [
                "OVLD",
                "OL",
                "***",
                "----",
                "#N/A",
                "1.#INF",
                "-1.#IND",
                "1.#QNAN",
                "Over",
                "OVER RANGE",
                "?",
                "NULL",
                "n/a",
                "BAD",
                "-.-",
            ]
        ),
    )


@_habit
def blank_cells(rng: random.Random) -> OddLog:
    return _marked(rng, rng.choice(["", " ", '""']))


@_habit
def numbers_of_instruments(rng: random.Random) -> OddLog:
    return _marked(
        rng,
        rng.choice(
            [
                "9.91E+37",
                "9.9E+37",
                "-9.9E37",
                "2147483647",
                "-2147483648",
                "1E+38",
                "3.402823E+38",
                "1.7E+308",
                "-1E30",
                "65535",
                "99999.9",
            ]
        ),
    )


@_habit
def zeros_in_bursts(rng: random.Random) -> OddLog:
    cells = [printed(times()), _stroke(times()), _force(times())]
    for first in sorted(rng.sample(range(30, ROWS - 30, 12), rng.randint(3, 6))):
        for k in range(first, first + rng.randint(2, 8)):
            cells[2][k] = "0.00000"
    return OddLog(_table("Time (s),Displacement (mm),Force (N)", cells), near=0.04, unclear="a zero may be measured")


@_habit
def overload_of_twelve_bits(rng: random.Random) -> OddLog:
    force = PEAK * np.sin(2 * np.pi * 2.03 * times() + 1.0) + 2.0 * np.random.default_rng(rng.randrange(99)).normal(
        size=ROWS
    )
    counts = (np.round(force / 0.6) + 1024) % 2048 - 1024
    cells = [printed(times()), _stroke(times()), printed(counts * 0.6, ".3f")]
    return OddLog(_table("Time (s),Displacement (mm),Force (N)", cells), finding="wrap-round", untrue=("force",))


@_habit
def stuck_stroke(rng: random.Random) -> OddLog:
    first, length = rng.randrange(100, 300), rng.randrange(120, 250)
    stroke = truth("displacement", times()) * MM + 1e-3 * np.random.default_rng(rng.randrange(99)).normal(size=ROWS)
    stroke[first : first + length] = stroke[first]
    cells = [printed(times()), printed(stroke), _force(times())]
    return OddLog(_table("Time (s),Displacement (mm),Force (N)", cells), finding="stuck", untrue=("displacement",))


@_habit
def rails_at_both_ends(rng: random.Random) -> OddLog:
    noise = np.random.default_rng(rng.randrange(99)).normal(size=ROWS)
    force = np.clip(PEAK * np.sin(2 * np.pi * 2.03 * times()), -700.0, 700.0) + noise
    cells = [printed(times()), _stroke(times()), printed(force, ".3f")]
    return OddLog(_table("Time (s),Displacement (mm),Force (N)", cells), finding="saturated", untrue=("force",))


def _hdf(fill: Callable[..., None]) -> bytes:
    import h5py

    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        fill(file)
    return buffer.getvalue()


@_habit
def hdf_marks_that_are_no_number(rng: random.Random) -> OddLog:
    mark = rng.choice([-999.0, 1e20, 9.96921e36])
    word = rng.choice(["_FillValue", "missing_value", "fill_value", "FillValue"])

    def fill(file) -> None:  # type: ignore[no-untyped-def]
        force = truth("force", times()).copy()
        force[100:115] = mark
        for name, values, unit in (
            ("time", times(), "s"),
            ("displacement", truth("displacement", times()) * MM, "mm"),
            ("force", force, "N"),
        ):
            file[name] = values
            file[name].attrs["units"] = unit
        file["force"].attrs[word] = np.array([mark])

    return OddLog(_hdf(fill), "log.h5", near=0.04)


@_habit
def hdf_clock_of_the_group(rng: random.Random) -> OddLog:
    name, value = rng.choice(
        [
            ("dt", DT),
            ("sample_rate", 500.0),
            ("fs", 500.0),
            ("sampling_rate", 500.0),
            ("sampling_frequency", 500.0),
            ("sample_interval", DT),
        ]
    )

    def fill(file) -> None:  # type: ignore[no-untyped-def]
        file.attrs[name] = value
        for channel, factor, unit in (("displacement", MM, "mm"), ("force", N, "N")):
            file[channel] = truth(channel, times()) * factor
            file[channel].attrs[rng.choice(["units", "Units", "UNIT"])] = unit

    return OddLog(_hdf(fill), "log.h5")


@_habit
def hdf_slope(rng: random.Random) -> OddLog:
    slope, offset = rng.choice(
        [("slope", "intercept"), ("scale", "offset"), ("gain", "offset"), ("scale_factor", "add_offset")]
    )

    def fill(file) -> None:  # type: ignore[no-untyped-def]
        file["time"] = times()
        file["time"].attrs["units"] = "s"
        file["displacement"] = truth("displacement", times())
        file["displacement"].attrs["units"] = "m"
        file["force"] = np.round((truth("force", times()) - 100.0) / 0.05).astype(np.int32)
        file["force"].attrs.update({slope: 0.05, offset: 100.0, "units": "N"})

    said = "" if slope in ("scale_factor", "gain") else "no convention says how these attributes are meant"
    return OddLog(_hdf(fill), "log.h5", unclear=said, near=1e-2)


# --- C9: sizes and names ------------------------------------------------------------------------------------------


@_habit
def units_of_others(rng: random.Random) -> OddLog:
    unit, factor = rng.choice(
        [
            ("kp", 1 / 9.80665),
            ("kgf", 1 / 9.80665),
            ("lbf", 1 / 4.4482216),
            ("Newton", 1.0),
            ("newtons", 1.0),
            ("kips", 1 / 4448.2216),
            ("KN", 1e-3),
            ("dyn", 1e5),
            ("tf", 1 / 9806.65),
        ]
    )
    cells = [printed(times()), _stroke(times()), _force(times(), factor, ".9g")]
    return OddLog(_table(f"Time (s),Displacement (mm),Force ({unit})", cells))


@_habit
def lengths_of_others(rng: random.Random) -> OddLog:
    unit, factor = rng.choice(
        [
            ("MM", 1e3),
            ("millimeter", 1e3),
            ("millimetres", 1e3),
            ("µm", 1e6),
            ("μm", 1e6),
            ("um", 1e6),
            ("inch", 1 / 0.0254),
            ("mil", 1 / 2.54e-5),
            ("cm", 1e2),
            ("ft", 1 / 0.3048),
        ]
    )
    cells = [printed(times()), printed(truth("displacement", times()) * factor, ".8f"), _force(times())]
    return OddLog(_table(f"Time (s),Stroke ({unit}),Force (N)", cells))


@_habit
def columns_beside_the_quantity(rng: random.Random) -> OddLog:
    """A column that is of a sensor or a command, beside the quantity itself."""
    name, unit = rng.choice(
        [
            ("Force Setpoint", "N"),
            ("Load Cell Excitation", "V"),
            ("Position Max", "mm"),
            ("Disp Cmd", "mm"),
            ("Force Peak", "N"),
            ("Target Stroke", "mm"),
            ("Force Ref", "N"),
            ("Displacement Reference", "mm"),
            ("Force Tare", "N"),
            ("Position Limit High", "mm"),
        ]
    )
    made = [
        Column("Time", "s", times()),
        Column("Displacement", "mm", truth("displacement", times()) * MM),
        Column("Force", "N", truth("force", times())),
    ]
    made.insert(rng.randint(1, 3), Column(name, unit, 2.5 + 0.2 * np.cos(11.0 * times())))
    return OddLog(_table(",".join(c.head() for c in made), [printed(c.numbers) for c in made]))


@_habit
def only_a_command(rng: random.Random) -> OddLog:
    name, unit, lacks = rng.choice(
        [
            ("Disp Cmd", "mm", "displacement"),
            ("Stroke Reference", "mm", "displacement"),
            ("Force Ref", "N", "force"),
            ("Force SP", "N", "force"),
            ("Axial Displacement Command", "mm", "displacement"),
            ("Load Target", "kN", "force"),
            ("Force Tracking Error", "N", "force"),
        ]
    )
    other = (
        Column("Displacement", "mm", truth("displacement", times()) * MM)
        if lacks == "force"
        else Column("Force", "N", truth("force", times()))
    )
    made = [Column("Time", "s", times()), Column(name, unit, 2.5 + 0.2 * np.cos(11.0 * times())), other]
    return OddLog(_table(",".join(c.head() for c in made), [printed(c.numbers) for c in made]), lacks=(lacks,))


@_habit
def sizes_that_nothing_has(rng: random.Random) -> OddLog:
    name, unit, lacks = rng.choice(
        [
            ("Displacement", "km", "displacement"),
            ("Stroke", "Mm", "displacement"),
            ("Force", "GN", "force"),
            ("Force", "TN", "force"),
            ("Displacement", "mile", "displacement"),
        ]
    )
    made = [
        Column("Time", "s", times()),
        Column("Displacement", "mm", truth("displacement", times()) * MM),
        Column("Force", "N", truth("force", times())),
    ]
    made = [
        Column(name, unit, c.numbers) if c.name == ("Force" if lacks == "force" else "Displacement") else c
        for c in made
    ]
    return OddLog(
        _table(",".join(c.head() for c in made), [printed(c.numbers) for c in made]),
        lacks=(lacks,),
        unclear="a size that nothing has",
    )


# --- E: spelling --------------------------------------------------------------------------------------------------


@_habit
def sixteen_bits_a_letter(rng: random.Random) -> OddLog:
    return OddLog(_plain(rng).encode(rng.choice(["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig"])), "log.txt")


@_habit
def fixed_widths(rng: random.Random) -> OddLog:
    rows = [
        f"{t:12.4f}{x:14.6f}{f:14.4f}"
        for t, x, f in zip(times(), truth("displacement", times()) * MM, truth("force", times()), strict=True)
    ]
    head = f"{'Time':>12}{'Displacement':>14}{'Force':>14}\n{'(s)':>12}{'(mm)':>14}{'(N)':>14}\n"
    return OddLog(head + "\n".join(rows) + "\n", "log.txt")


@_habit
def everything_in_quotes(rng: random.Random) -> OddLog:
    cells = [[f'"{x}"' for x in c] for c in (printed(times()), _stroke(times()), _force(times()))]
    return OddLog(_table('"Time, elapsed (s)","Displacement, ""LVDT"" (mm)","Force (N)"', cells))


@_habit
def trailing_separators(rng: random.Random) -> OddLog:
    between = rng.choice([",", ";", "\t"])
    cells = [printed(times()), _stroke(times()), _force(times()), [""] * ROWS]
    return OddLog(_table(between.join(["Time (s)", "Displacement (mm)", "Force (N)", ""]), cells, between))


@_habit
def units_behind_numbers(rng: random.Random) -> OddLog:
    cells = [
        [f"{x} s" for x in printed(times())],
        [f"{x} mm" for x in _stroke(times())],
        [f"{x} N" for x in _force(times())],
    ]
    return OddLog(_table("Time,Displacement,Force", cells))


@_habit
def decimal_commas_and_points(rng: random.Random) -> OddLog:
    cells = [
        [f"{x:,.4f}".translate(str.maketrans(",.", ".,")) for x in c]
        for c in (times() * 1e3, truth("displacement", times()) * 1e6, truth("force", times()) * 10)
    ]
    return OddLog(_table("Zeit [ms];Weg [µm];Kraft [dN]", cells, ";"))


@_habit
def signs_of_other_kinds(rng: random.Random) -> OddLog:
    minus = rng.choice(["\u2212", "\u2013", "\ufe63", "\uff0d"])
    cells = [[x.replace("-", minus) for x in c] for c in (printed(times()), _stroke(times()), _force(times()))]
    log = _table("Time (s),Displacement (mm),Force (N)", cells)
    return OddLog(log)


@_habit
def exponents_of_fortran(rng: random.Random) -> OddLog:
    def spelt(x: float) -> str:
        return f"{x:.7E}".replace("E", rng.choice(["D", "d"]))

    cells = [[spelt(x) for x in c] for c in (times(), truth("displacement", times()) * MM, truth("force", times()))]
    return OddLog(_table(" Time(s)  Displacement(mm)  Force(N)", cells, "  "), "log.txt")


if __name__ == "__main__":
    odd_logs.main(HABITS)
