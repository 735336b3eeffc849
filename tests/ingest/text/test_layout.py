from pathlib import Path

import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from mrfit.ingest.text.head import Head, open_head
from mrfit.ingest.text.layout import aliases_of, find_grid, find_header, name_and_unit, name_and_units
from tests.ingest.conftest import ReadLog


def _head(tmp_path: Path, text: str) -> Head:
    path = tmp_path / "log.txt"
    path.write_text(text, encoding="utf-8")
    return open_head(path)


@pytest.mark.parametrize(
    ("cell", "name", "unit"),
    [
        ("Force [N]", "Force", "N"),
        ("Time (s)", "Time", "s"),
        ("force_N", "force", "N"),
        ("velocity_mm/s", "velocity", "mm/s"),
        ("i_A", "i", "A"),
        ("Zeit / ms", "Zeit", "ms"),
        ("C1 in V", "C1", "V"),
        ("in s", "time", "s"),
        ("u_coil", "u_coil", None),
        ("CH1", "CH1", None),
        ("Channel_1", "Channel_1", None),
        ("Temperatura (°C)", "Temperatura", "°C"),
        ('"Displacement"', "Displacement", None),
        ("Force [in kN]", "Force", "kN"),
        ("Force (unit: kN)", "Force", "kN"),
        ("Force (kN, tension positive)", "Force tension positive", "kN"),
        ("Weg (Einheit: mm)", "Weg", "mm"),
        ("Position (m) Run #1", "Position", "m"),
        ("Position (m) @500 Hz", "Position", "m"),
        ("('Force', 'kN')", "Force", "kN"),
        ("Force (mean, raw)", "Force", "mean, raw"),
        ("Force (kN, N)", "Force", "kN, N"),
        ("Время, с", "Время", "с"),
        ("millis", "millis", "ms"),
        ("micros()", "micros", "us"),
        ("", "", None),
    ],
)
def test_header_cells(cell: str, name: str, unit: str | None) -> None:
    assert name_and_unit(cell) == (name, unit)


def test_words_in_other_brackets_are_no_contradiction() -> None:
    assert name_and_units("Force (kN) [filtered]", None) == ("Force filtered", "kN")
    assert name_and_units("Force (kN) [N]", None)[1] == "kN or N"


ROWS = [(0.0, 1.5, -2.25), (0.1, 1.75, -2.5), (0.2, 2.0, -2.75), (0.3, 2.25, -3.0)]


def _rows(delimiter: str, decimal: str = ".") -> str:
    return "".join(delimiter.join(f"{v:.3f}".replace(".", decimal) for v in row) + "\n" for row in ROWS)


@pytest.mark.parametrize(
    ("delimiter", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", "."), ("|", ".")]
)
def test_delimiter_decimal_mark_names_and_units(delimiter: str, decimal: str, tmp_path: Path) -> None:
    head = _head(tmp_path, delimiter.join(["time", "force", "stroke"]) + "\n" + _rows(delimiter, decimal))
    grid = find_grid(head)
    assert (grid.delimiter or " ", grid.decimal, grid.width, grid.first) == (delimiter, decimal, 3, 1)
    assert find_header(head, grid).names == ("time", "force", "stroke")


@pytest.mark.parametrize(
    ("above", "names", "units"),
    [
        ("t,f,x\ns,kN,mm\n", ("t", "f", "x"), ("s", "kN", "mm")),
        ("t,f,x\n[s],[kN],[mm]\n", ("t", "f", "x"), ("s", "kN", "mm")),
        ("t,f,x\ns,kN,mm\n\n", ("t", "f", "x"), ("s", "kN", "mm")),
        ("# made by a rig\n# t (s), f (kN), x (mm)\n", ("t", "f", "x"), ("s", "kN", "mm")),
        ("Test 7, day 3\nname: x\nt [s],f [kN],x [mm]\n", ("t", "f", "x"), ("s", "kN", "mm")),
        ('"t (s)","f (kN)","x (mm)"\n', ("t", "f", "x"), ("s", "kN", "mm")),
        ("t,f,x,\n", ("t", "f", "x"), (None, None, None)),
    ],
)
def test_header_rows(above: str, names: tuple[str, ...], units: tuple[str, ...], tmp_path: Path) -> None:
    head = _head(tmp_path, above + _rows(","))
    grid = find_grid(head)
    header = find_header(head, grid)
    assert header.names == names
    assert header.units == units
    assert head.lines[grid.first].startswith("0.000")


def test_two_numbers_with_a_comma_between_are_two_columns(tmp_path: Path) -> None:
    grid = find_grid(_head(tmp_path, "1,5\n2,5\n3,5\n"))
    assert (grid.delimiter, grid.decimal, grid.width) == (",", ".", 2)


def test_prose_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Refusal, match="no row of numbers"):
        find_grid(_head(tmp_path, "Dear colleague,\nthe damper leaks.\nYours\n"))


def test_headerless_file_has_no_names(tmp_path: Path) -> None:
    head = _head(tmp_path, _rows(","))
    assert find_header(head, find_grid(head)).names == ()


def test_aliases() -> None:
    assert aliases_of("Coil Current") == ["current"]
    assert aliases_of("I") == ["current"]
    assert [aliases_of(w) for w in ("位移", "荷重", "Сила тока", "전압")] == [
        ["displacement"],
        ["force"],
        ["current"],
        ["voltage"],
    ]
    assert aliases_of("whatever") == []


@pytest.mark.parametrize(
    ("cell", "name", "unit"),
    [
        ("Force_kN_", "Force", "kN"),
        ("Force..kN.", "Force", "kN"),
        ("Coil.Current..A.", "Coil Current", "A"),
        ("CoilCurrent_A_", "CoilCurrent", "A"),
        ("Velocity_mm_s_", "Velocity", "mm/s"),
        ("Velocity..mm.s.", "Velocity", "mm/s"),
        ("Acc..m.s.2.", "Acc", "m/s^2"),
        ("Oil.temp...C.", "Oil temp", "C"),
        ("Time..s.", "Time", "s"),
        ("press.abs.", "press.abs.", None),
        ("No.", "No.", None),
        ("ch1_", "ch1_", None),
    ],
)
def test_headers_that_a_program_made_variables_of(cell: str, name: str, unit: str | None) -> None:
    assert name_and_unit(cell) == (name, unit)


SPELLINGS = ["{n}.{u}", "{n}_{u}", "{n}..{u}.", "{n}/{u}", "{n} [{u}]", "{n}({u})", "{n}, {u}", "{n} {u}", "{n} - {u}"]
SPELLINGS += [
    "{n}-{u}",
    "{n}{{{u}}}",
    "{n}:{u}",
    "{n} in {u}",
    "{n}<{u}>",
    "{n}|{u}",
    "[{u}] {n}",
    "{n}__{u}",
    "{n}_{u}_",
]


@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize(("name", "unit"), [("Force", "kN"), ("time", "ms"), ("coil current", "mA"), ("Weg", "mm")])
def test_a_unit_in_a_known_name_is_read_however_it_is_joined(spelling: str, name: str, unit: str) -> None:
    assert name_and_unit(spelling.format(n=name, u=unit)) == (name, unit)


@pytest.mark.parametrize(
    "name", ["x-axis", "Time-step", "u_coil", "phase A", "Force.1", "Channel:A", "force_raw", "i.e."]
)
def test_other_words_behind_a_name_are_no_units(name: str) -> None:
    assert name_and_unit(name) == (name, None)


@pytest.mark.parametrize("spelling", [*SPELLINGS, "{n} signal {u}", "{n} {u} filtered", "{n}({u}) x", "{n} since {u}"])
@pytest.mark.parametrize("names", [("Time", "Force"), ("Zeit", "Kraft"), ("time", "Bolt")])
def test_no_log_with_units_in_its_names_is_said_to_give_none(
    spelling: str, names: tuple[str, str], read_log: ReadLog
) -> None:
    header = ";".join(f'"{spelling.format(n=n, u=u)}"' for n, u in zip(names, ("s", "kN"), strict=True))
    (record,) = read_log(header + "\n" + "".join(f"{0.01 * k:.2f};{k % 9}.5\n" for k in range(40)))
    assert record.dt == pytest.approx(0.01)
    assert not [f.text for f in record.findings if "no unit" in f.text]
    if names[1] != "Bolt" and spelling in SPELLINGS:
        assert record.units == {"force": "N"} and record.channels["force"][0] == 500.0


K = np.arange(300)
STROKE, FORCE = np.round(10.0 * np.sin(0.05 * K), 3), np.round(800.0 * np.cos(0.05 * K), 1)


def _table(times: list[str], delimiter: str = ",", behind: str = "") -> str:
    rows = zip(times, STROKE, FORCE, strict=True)
    return "".join(delimiter.join(filter(None, map(str, row))) + behind + "\n" for row in rows)


SECONDS = [f"{2e-3 * k:.3f}" for k in K]
HEADERS = {
    "labels and equals signs": (
        "Interval=\t0.002 s\nChannelTitle=\tStroke\tForce\nRange=\t50 mm\t5.0 kN\nUnitName=\tmm\tN\nTopValue=\t50\t5\n",
        _table(SECONDS, "\t"),
    ),
    "labels, and rows without times": (
        '"TraceName","Stroke","Force"\n"BlockSize",300,300\n"VUnit","mm","N"\n"SampleRate",500,500\n"HUnit","s","s"\n',
        "".join(f",{line}\n" for line in _table([""] * 300).splitlines()),
    ),
    "labels, and a line that names the times": (
        "Name,Stroke,Force\nUnit,mm,N\nRange,50,5000\nTime [s],,\n",
        _table(SECONDS),
    ),
    "a label in every cell": ("time,Stroke,Force\n,Unit: mm,Unit: N\n,Interp: zoh,Interp: zoh\n", _table(SECONDS)),
    "words between names and units": (
        "Time\tStroke\tForce\nMX_0\tMX_0 CH=1\tMX_0 CH=2\ns\tmm\tN\nSensor: -\tSensor: WA\tSensor: U10\n",
        _table(SECONDS, "\t"),
    ),
    "a title above units and names": ("Rig\t7\tA\ns\tmm\tN\nTime\tStroke\tForce\n", _table(SECONDS, "\t")),
    "a label before the first row": (
        "name,Time,Stroke,Force\nunit,s,mm,N\ntrace_values",
        "".join(f",{line}\n" for line in _table(SECONDS).splitlines()),
    ),
    "the word for data before the first row": (
        "Signal:,Time,Stroke,Force\nUnit:,s,mm,N\nData:",
        "".join(f",{line}\n" for line in _table(SECONDS).splitlines()),
    ),
    "a label before numbers of another kind": (
        "name,Time,Stroke,Force\nunit,s,mm,N\nscale,1,1,1\n",
        "".join(f",{line}\n" for line in _table(SECONDS).splitlines()),
    ),
    "comments below the names": ('"Time","CH1[mm]","CH2[N]"\n"","Stroke","Load"\n', _table(SECONDS)),
    "a number and a clock above units": ("Time,CH1 Stroke,CH2 Force\nTime,mm,N\n", _table(SECONDS)),
    "units behind commas": ("Time, s,Stroke, mm,Force, N\n", _table(SECONDS)),
    "blanks between names and numbers": ("# time (s) stroke (mm) force (N)\n", _table(SECONDS, " ")),
    "quoted names between blanks": ('"Time (s)" "Stroke (mm)" "Force (N)"\n', _table(SECONDS, " ")),
    "full-width brackets": ("时间（秒）,位移（毫米）,载荷（牛）\n", _table(SECONDS)),
    "empty columns at the right": ("Time (s),Stroke (mm),Force (N),,,,,\n", _table(SECONDS, behind=",,,,,")),
    "empty columns of the rows alone": ("Time (s),Stroke (mm),Force (N)\n", _table(SECONDS, behind=",,,")),
}


@pytest.mark.parametrize("kind", HEADERS)
def test_headers_of_programs(kind: str, read_log: ReadLog) -> None:
    (record,) = read_log("".join(HEADERS[kind]))
    assert record.dt == pytest.approx(2e-3)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * STROKE)
    np.testing.assert_allclose(record.channels["force"], FORCE)


def test_a_note_with_units_in_brackets_is_no_row_of_units(read_log: ReadLog) -> None:
    (record,) = read_log("Units: metric (mm, N, s)\nTime,Stroke,Force\n" + _table(SECONDS))
    assert "unit-assumed" in {f.kind for f in record.findings}


def test_runs_named_in_every_cell_stay_names(read_log: ReadLog) -> None:
    (record,) = read_log("Run 1: Time (s),Run 1: Stroke (mm),Run 1: Force (N)\n" + _table(SECONDS))
    np.testing.assert_allclose(record.channels["force"], FORCE)
