"""Logs with several headers: each block of rows is read by the header above it, or not at all from its line on."""

import random
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.core.recording import Recording
from mrfit.ingest.hashes import hash_of
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.reading import BlockReading, LogItem, read_item
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings
from tests.ingest.conftest import ReadLog
from tests.ingest.examining import examine
from tests.ingest.samples import WRITERS, labview_lvm

DT = 0.002
K = np.arange(300)
DISP, FORCE = 10e-3 * np.sin(4 * np.pi * DT * K), 900.0 * np.cos(4 * np.pi * DT * K)
CURRENT = 1.0 + 0.2 * np.sin(2 * np.pi * DT * K)
TRUTH = {"time": DT * K, "displacement": DISP, "force": FORCE, "current": CURRENT}
NAMES = {"time": "Time", "displacement": "Disp", "force": "Load", "current": "Current"}
SCALES = {"s": 1.0, "ms": 1e-3, "m": 1.0, "mm": 1e-3, "in": 0.0254, "N": 1.0, "kN": 1e3, "A": 1.0, "mA": 1e-3}
UNITS = {"time": ["s", "ms"], "displacement": ["mm", "m", "in"], "force": ["N", "kN"], "current": ["A", "mA"]}


@dataclass(frozen=True)
class Form:
    """How a block is printed: its columns with their units, whether these stand in a row of their own, delimiter."""

    columns: tuple[tuple[str, str], ...]
    unit_row: bool = False
    delimiter: str = ","
    lead: str = ""

    def header(self) -> str:
        d = self.delimiter
        if self.unit_row:
            return d.join(NAMES[c] for c, _ in self.columns) + "\n" + d.join(u for _, u in self.columns) + "\n"
        return d.join(f"{NAMES[c]} ({u})" for c, u in self.columns) + "\n"

    def text(self, rows: slice) -> str:
        values = [TRUTH[c][rows] / SCALES[u] for c, u in self.columns]
        body = "".join(self.delimiter.join(f"{v:.9g}" for v in row) + "\n" for row in zip(*values, strict=True))
        return self.lead + self.header() + body


def columns(**units: str) -> tuple[tuple[str, str], ...]:
    return tuple(units.items())


FIRST = Form(columns(time="s", displacement="mm", force="N"))


def assert_true(recordings: list[Recording], cut: int) -> None:
    """All rows are there, once, with their values."""
    assert sum(r.samples for r in recordings) == len(K)
    for record, rows in zip(recordings, (slice(0, cut), slice(cut, None)), strict=True):
        assert record.dt == pytest.approx(DT)
        for name, values in record.channels.items():
            np.testing.assert_allclose(values, TRUTH[name][rows], atol=1e-7 * np.ptp(TRUTH[name]), rtol=1e-7)


@pytest.mark.parametrize(
    "second",
    [
        Form(columns(time="s", force="N", displacement="mm")),
        Form(columns(force="kN", time="ms", displacement="in")),
        Form(columns(time="s", displacement="mm", force="kN")),
        Form(columns(time="s", displacement="mm", force="kN"), unit_row=True),
        Form(columns(time="s", force="N", current="A", displacement="mm")),
        Form(columns(time="s", force="N")),
        Form(columns(time="s", displacement="mm", force="N"), delimiter=";"),
        Form(columns(time="s", force="N", displacement="mm"), lead="\nTest 2\nOperator: N. N.\n\n"),
        Form(columns(time="s", force="N", displacement="mm"), lead="# restarted\n# "),
    ],
)
def test_each_block_is_read_by_its_own_header(second: Form, read_log: ReadLog) -> None:
    recordings = read_log(FIRST.text(slice(0, 140)) + second.text(slice(140, None)))
    assert_true(recordings, 140)
    said = [f.text for r in recordings for f in r.findings if f.kind == "another-header"]
    begins = 142 + len(second.lead) - len(second.lead.lstrip("\n"))
    assert len(said) == 1 and said[0].startswith(f"line {begins} begins another header")


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32))
def test_any_two_blocks(seed: int) -> None:
    rng = random.Random(seed)

    def form() -> Form:
        names = ["displacement", "force", "current"]
        chosen = ["time", *rng.sample(names, rng.randint(1, 3))]
        rng.shuffle(chosen)
        cells = tuple((c, rng.choice(UNITS[c])) for c in chosen)
        return Form(cells, rng.random() < 0.4, rng.choice(",;\t"))

    cut = rng.randint(20, 280)
    one, two = form(), form()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_text(one.text(slice(0, cut)) + two.text(slice(cut, None)))
        recordings, refusals = examine([path], Settings())
    assert not refusals
    for record in recordings:
        rows = np.round(record.start / DT).astype(int) + np.arange(record.samples)
        for name, values in record.channels.items():
            np.testing.assert_allclose(values, TRUTH[name][rows], atol=1e-7 * np.ptp(TRUTH[name]), rtol=1e-7)
    assert sum(r.samples for r in recordings) == len(K)


def test_a_row_of_units_alone_changes_the_units(read_log: ReadLog) -> None:
    first = Form(columns(time="s", displacement="mm", force="N"), unit_row=True)
    second = Form(columns(time="s", displacement="mm", force="kN"), unit_row=True)
    later = second.text(slice(140, None)).partition("\n")[2]
    assert_true(read_log(first.text(slice(0, 140)) + later), 140)


def test_bracketed_units_alone_keep_the_names_above(read_log: ReadLog) -> None:
    rows = FIRST.text(slice(0, None)).splitlines(keepends=True)[1:]
    first, second = "Time,Disp,Load\n(s),(mm),(deg_Q)\n", "(s),(mm),(N)\n"
    one, two = read_log(first + "".join(rows[:140]) + second + "".join(rows[140:]))
    assert list(one.channels) == ["displacement", "load"] and list(two.channels) == ["displacement", "force"]
    np.testing.assert_allclose(two.channels["force"], FORCE[140:], atol=1e-4)


@pytest.mark.parametrize("row", [0, 1, 2])
def test_a_header_of_other_units_after_few_rows_is_not_passed_over(row: int, read_log: ReadLog) -> None:
    sample = WRITERS["siglent"]()
    lines = sample.data.decode().splitlines(keepends=True)
    lines.insert(5 + row, "Second,mV,Volt\n")
    if row < 2:
        with pytest.raises(Refusal, match=rf"line {6 + row} (is|begins) another header"):
            read_log("".join(lines), sample.name)
    else:
        assert read_log("".join(lines), sample.name)[-1].channels["ch1"][5] == sample.channels["ch1"][row + 5] / 1e3


def test_a_damaged_row_below_the_header_is_no_header(read_log: ReadLog) -> None:
    lines = FIRST.text(slice(0, None)).splitlines(keepends=True)
    lines[1:3] = ["OL,OL,OL\n", "? ,0.1,900\n"]
    (record,) = read_log("".join(lines))
    assert (record.rows_kept, record.rows_refused) == (len(K) - 2, 2)


def test_rows_above_the_header_that_holds_are_counted(read_log: ReadLog) -> None:
    lines = Form(FIRST.columns, unit_row=True).text(slice(0, None)).splitlines(keepends=True)
    lines[2:3] = ["OL,OL,OL\n", lines[1]]
    (record,) = read_log("".join(lines))
    assert (record.rows_kept, record.rows_refused) == (len(K) - 1, 1)
    assert "row above the header" in next(f.text for f in record.findings if f.kind == "refused-rows")


def test_names_in_another_order_keep_their_units(read_log: ReadLog) -> None:
    first = Form(columns(time="s", displacement="mm", force="kN"), unit_row=True)
    second = Form(columns(time="s", force="kN", displacement="mm"), unit_row=True)
    names, _, rest = second.text(slice(140, None)).split("\n", 2)
    assert_true(read_log(f"{first.text(slice(0, 140))}{names}\n{rest}"), 140)


def test_the_same_header_again_is_no_other_header(read_log: ReadLog) -> None:
    block = Form(FIRST.columns, unit_row=True)
    again = block.text(slice(140, None))
    for text in (again, again.replace("s,mm,N\n", "")):
        (record,) = read_log(block.text(slice(0, 140)) + text)
        assert not [f for f in record.findings if f.kind == "another-header"]
        np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize(
    "line",
    ["valve opened, coil off, see note", "# Force in N, 2, 3", "pause", "---,---,---", "Err,Err,Err", "a b c"],
)
def test_a_word_among_the_rows_is_no_header(line: str, read_log: ReadLog) -> None:
    lines = FIRST.text(slice(None)).split("\n")
    (record,) = read_log("\n".join([*lines[:100], line, *lines[100:]]))
    assert record.samples == 300
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-4)


def test_rows_below_a_header_that_cannot_be_used_are_not_read(read_log: ReadLog) -> None:
    values = "".join(f"{t:.3f},{a:.5f},{b:.5f}\n" for t, a, b in zip(TRUTH["time"], FORCE, DISP, strict=True))
    (record,) = read_log(FIRST.text(slice(0, 140)) + "Time,Kraftsensor,Load\n" + values)
    assert record.samples == 140
    np.testing.assert_allclose(record.channels["force"], FORCE[:140], atol=1e-4)
    said = next(f.text for f in record.findings if f.kind == "another-header")
    assert said.startswith("line 142 begins another header ('Time,Kraftsensor,Load'): nothing is read from there on")


def test_a_map_by_place_holds_for_the_first_header_only(read_log: ReadLog) -> None:
    second = Form(columns(time="s", force="N", displacement="mm"))
    channel_map = 'time = 0\n[channels]\nforce = {column = 2, unit = "N"}\n'
    (record,) = read_log(FIRST.text(slice(0, 140)) + second.text(slice(140, None)), channel_map=channel_map)
    assert record.samples == 140
    assert any("names columns by place" in f.text for f in record.findings)


def test_stated_rates_that_change(read_log: ReadLog) -> None:
    rows = [f"{a:.5f},{b:.5f}\n" for a, b in zip(DISP * 1e3, FORCE, strict=True)]
    blocks = [f"Sample rate: {rate} Hz\nDisp (mm),Load (N)\n" + "".join(rows) for rate in (500, 250)]
    first, second = read_log("".join(blocks))
    assert (first.dt, second.dt, first.samples, second.samples) == (0.002, 0.004, 300, 300)


def lvm(*segments: tuple[str, str, float]) -> str:
    """Segments of an LVM file: names with tabs, unit labels with tabs, interval."""
    top = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tYes\n***End_of_Header***\t\n\n"
    text = top
    for names, labels, step in segments:
        rows = "".join(
            f"{k * step:.6f}\t{a:.6f}\t{b:.6f}\t\n" for k, (a, b) in enumerate(zip(DISP, FORCE, strict=True))
        )
        text += f"Channels\t2\nSamples\t300\t300\nY_Unit_Label\t{labels}\nX_Dimension\tTime\tTime\nX0\t0\t0\n"
        text += f"Delta_X\t{step}\t{step}\n***End_of_Header***\t\t\nX_Value\t{names}\tComment\n{rows}\n"
    return text


@pytest.mark.parametrize(
    ("second", "scales"),
    [
        (("Disp\tForce", "in\tlbf", 0.002), (0.0254, 4.4482216152605)),
        (("Disp\tForce", "mm\tkN", 0.002), (1e-3, 1e3)),
        (("Disp\tForce", "mm\tN", 0.004), (1e-3, 1.0)),
    ],
)
def test_segments_of_lvm(second: tuple[str, str, float], scales: tuple[float, float], read_log: ReadLog) -> None:
    one, two = read_log(lvm(("Disp\tForce", "mm\tN", 0.002), second), "log.lvm")
    assert (one.dt, two.dt) == (0.002, second[2])
    for record, (mm, newton) in ((one, (1e-3, 1.0)), (two, scales)):
        np.testing.assert_allclose(record.channels["displacement"], mm * DISP, atol=1e-6 * mm)
        np.testing.assert_allclose(record.channels["force"], newton * FORCE, atol=1e-5 * newton)


def test_segments_of_lvm_in_another_order(read_log: ReadLog) -> None:
    one, two = read_log(lvm(("Disp\tForce", "mm\tN", 0.002), ("Force\tDisp", "N\tmm", 0.002)), "log.lvm")
    np.testing.assert_allclose(two.channels["force"], DISP, atol=1e-6)
    np.testing.assert_allclose(two.channels["displacement"], 1e-3 * FORCE, atol=1e-8)
    assert len(read_log(labview_lvm().data, "sound.lvm")) == 1


@pytest.mark.parametrize(
    ("names", "labels", "scale"),
    [
        ("Time\tAxial Force", "s\tN", 1.0),
        ("Time\tAxial Force", "s\tkN", 1e3),
        ("Axial Force\tTime", "lbf\ts", 4.4482216),
    ],
)
def test_blocks_of_a_press(names: str, labels: str, scale: float, read_log: ReadLog) -> None:
    top = "MTS793|MPT|ENU|1|2|.|/|:|51|1|1|A\r\n"

    def block(names: str, labels: str) -> str:
        force_first = names.startswith("Axial")
        pairs = [(f, t) if force_first else (t, f) for t, f in zip(TRUTH["time"], FORCE, strict=True)]
        rows = "".join(f"{a:.6f}\t{b:.6f}\r\n" for a, b in pairs)
        return f"\r\nData Acquisition\t\tTime:\t5.0\ts\r\n{names}\r\n{labels}\r\n{rows}"

    one, two = read_log(top + block("Time\tAxial Force", "s\tN") + block(names, labels), "specimen.dat")
    np.testing.assert_allclose(one.channels["force"], FORCE, atol=1e-5)
    np.testing.assert_allclose(two.channels["force"], scale * FORCE, rtol=1e-6, atol=1e-5 * scale)


@pytest.mark.parametrize(
    ("name", "volts", "millivolts"),
    [
        ("tektronix-mso", b"Vertical Units,V,", b"Vertical Units,mV,"),
        ("keysight", b"second,Volt,Volt", b"second,mV,mV"),
        ("gwinstek", b"Vertical Units,V,", b"Vertical Units,mV,"),
        ("leybold-cassy", b"U_B1 / V", b"U_B1 / mV"),
    ],
)
def test_exports_of_an_instrument_one_below_the_other(
    name: str, volts: bytes, millivolts: bytes, read_log: ReadLog
) -> None:
    export = WRITERS[name]()
    one, two = read_log(export.data + export.data.replace(volts, millivolts).removeprefix(b"\xef\xbb\xbf"), export.name)
    channel, unit = next((n, u) for n, u in export.units.items() if u == "V")
    np.testing.assert_allclose(one.channels[channel], export.channels[channel], atol=1e-4)
    np.testing.assert_allclose(two.channels[channel], 1e-3 * export.channels[channel], atol=1e-7)
    assert two.units[channel] == unit


def test_a_log_read_block_by_block_is_refused_at_another_header(tmp_path: Path) -> None:
    second = Form(columns(time="s", force="N", displacement="mm"))
    path = tmp_path / "log.csv"
    for later, refused in ((second, True), (FIRST, False)):
        path.write_text(FIRST.text(slice(0, 140)) + later.text(slice(140, None)))
        item = LogItem(((path, hash_of(path)),), "delimited", Rules())
        outcome = read_item(item, BlockReading(tmp_path / "numbers", 400))
        said = [str(r) for r in outcome.refusals]
        assert (len(said) == 1 and "line 142 begins another header" in said[0]) == refused
        assert bool(outcome.recordings) != refused
