"""Rows and cells in wrappings of programs give what plain ones give."""

import gzip
import random
from pathlib import Path

import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from mrfit.ingest.text.head import open_head
from tests.ingest.conftest import ReadLog

K = np.arange(300)
TIME, STROKE, FORCE = 2e-3 * K, np.round(10.0 * np.sin(0.05 * K), 3), np.round(800.0 * np.cos(0.05 * K), 1)
NAMES = ["Time (s)", "Stroke (mm)", "Force (N)"]
ROWS = [[f"{t:.3f}", f"{x}", f"{f}"] for t, x, f in zip(TIME, STROKE, FORCE, strict=True)]
PLAIN = "\n".join(",".join(row) for row in [NAMES, *ROWS]) + "\n"


def _check(read_log: ReadLog, content: str | bytes, name: str = "log.csv") -> None:
    (record,) = read_log(content, name)
    assert (record.dt, record.rows_refused) == (pytest.approx(2e-3), 0)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * STROKE)
    np.testing.assert_allclose(record.channels["force"], FORCE)


WRAPPED = {
    "whole rows": "".join(f'"{",".join(row)}"\r\n' for row in [NAMES, *ROWS]),
    "formulas": ",".join(NAMES) + "\n" + "".join(",".join(f'="{c}"' for c in row) + "\n" for row in ROWS),
    "quoted formulas": ",".join(NAMES) + "\n" + "".join(",".join(f'"=""{c}"""' for c in row) + "\n" for row in ROWS),
    "numbers of lines": "  ".join(NAMES)
    + "\n"
    + "".join(f"{k:04d}: {'  '.join(row)}\n" for k, row in enumerate(ROWS, 1)),
    "names over two lines": '"Time\n(s)","Stroke\n(mm)","Force\n(N)"\n' + PLAIN.partition("\n")[2],
    "names over two lines, CR LF": '"Time\r\n(s)",Stroke (mm),"Force\r\n(N)"\r\n' + PLAIN.partition("\n")[2],
    "units in cells": "Time,Stroke,Force\n" + "".join(f"{t} s,{x} mm,{f} N\n" for t, x, f in ROWS),
    "labels and units": "".join(f"t={t} s, stroke={x} mm, force={f} N\n" for t, x, f in ROWS),
    "powers of ten": ",".join(NAMES) + "\n" + "".join(f"{t},{x},{float(f) / 1e3:.4f}×10^3\n" for t, x, f in ROWS),
    "full width": PLAIN.replace("(mm)", "（ｍｍ）"),
    "a page": "<html><head><style>td {width: 1mm}</style></head>\n<body><table>"
    + f"<tr>{''.join(f'<th>{n}</th>' for n in NAMES)}</tr>"
    + "".join(f"<tr>{''.join(f'<td>{c}</td>' for c in row)}</tr>\n" for row in ROWS)
    + "</table></body></html>",
    "a page without ends": f"<table><tr>{''.join(f'<th>{n}' for n in NAMES)}"
    + "".join(f"<tr>{''.join(f'<td>&nbsp;{c}' for c in row)}\n" for row in ROWS)
    + "</table>",
}


@pytest.mark.parametrize("form", WRAPPED)
def test_rows_and_cells_in_wrappings(form: str, read_log: ReadLog) -> None:
    _check(read_log, WRAPPED[form])


@pytest.mark.parametrize("labelled", [True, False])
def test_a_monitor_of_a_serial_port_sets_its_times_before_the_rows(labelled: bool, read_log: ReadLog) -> None:
    form = "stroke_mm:{x},force_N:{f}" if labelled else "{x},{f}"
    rows = [f"12:00:{t:06.3f} -> {form.format(x=x, f=f)}" for t, x, f in zip(TIME, STROKE, FORCE, strict=True)]
    names = [] if labelled else ["11:59:59.900 -> stroke_mm,force_N"]
    _check(read_log, "\n".join([*names, *rows, ""]))


@pytest.mark.parametrize(
    "content", [gzip.compress(PLAIN.encode()), gzip.compress(PLAIN.encode("utf-16")), PLAIN.encode("utf-32")]
)
def test_archives_and_letters_of_four_bytes(content: bytes, read_log: ReadLog) -> None:
    _check(read_log, content, "log.csv.gz")


@pytest.mark.parametrize("content", [b"\x89PNG rest", b"\x00\x01\x02\x03" * 400, b"PK\x03\x04rest"])
def test_an_archive_of_no_text_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "log.gz"
    path.write_bytes(gzip.compress(content))
    with pytest.raises(Refusal, match="a gzip archive, which holds no text"):
        open_head(path)


def test_an_archive_that_is_cut_or_too_long_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log.gz"
    noise = "".join(random.Random(1).choices("0123456789,\n", k=5000))
    path.write_bytes(gzip.compress(noise.encode())[:900])
    with pytest.raises(Refusal, match="damaged"):
        open_head(path)
    path.write_bytes(gzip.compress(PLAIN.encode()))
    monkeypatch.setattr("mrfit.ingest.text.head.MOST_UNPACKED", 1000)
    with pytest.raises(Refusal, match="more than"):
        open_head(path)


def test_a_text_beside_numbers_with_an_odd_mark_opens_no_cell(read_log: ReadLog) -> None:
    notes = {3: ',"start', 5: ',"go'}
    rows = "".join(f"{','.join(row)}{notes.get(k, ',')}\n" for k, row in enumerate(ROWS))
    _check(read_log, f"{','.join(NAMES)},Note\n{rows}")


def test_times_before_a_colon_are_no_numbers_of_lines(read_log: ReadLog) -> None:
    rows = "".join(f"{5 * k}: {x} {f}\n" for k, (_, x, f) in enumerate(ROWS))
    with pytest.raises(Refusal):
        read_log(f"Sample rate: 1000 Hz\nStroke (mm) Force (N)\n{rows}")


def test_one_text_in_all_rows_is_no_number_with_a_unit(read_log: ReadLog) -> None:
    rows = "".join(f"{','.join(row)},1A\n" for row in ROWS)
    (record,) = read_log(f"{','.join(NAMES)},Mode\n{rows}")
    assert set(record.channels) == {"displacement", "force"}


def test_a_mark_of_inches_and_quoted_names_open_no_cell(read_log: ReadLog) -> None:
    rows = "".join(f"{t},{float(x) / 25.4:.6f},{f}\n" for t, x, f in ROWS)
    (record,) = read_log(f'Time (s),Stroke ("),"Force (N)"\n{rows}')
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * STROKE, atol=1e-7)


def test_a_unit_in_cells_that_the_header_contradicts_is_asked_for(read_log: ReadLog) -> None:
    rows = "".join(f"{t},{x},{f} N\n" for t, x, f in ROWS)
    (record,) = read_log(f"Time (s),Stroke (mm),Force (kN)\n{rows}")
    assert "force" not in record.channels and "unknown-unit" in {f.kind for f in record.findings}
    (record,) = read_log("Time (s),Stroke (mm),Force (N)\n" + rows.replace(" N\n", "k\n"))
    assert "force" not in record.channels


def test_units_in_some_cells_stay(read_log: ReadLog) -> None:
    rows = [f"{t},{x},{f}" for t, x, f in ROWS]
    rows[40] += " kN"
    (record,) = read_log("\n".join([",".join(NAMES), *rows, ""]))
    assert record.rows_refused == 1


def test_a_page_with_long_blanks_and_open_marks_takes_no_time(tmp_path: Path) -> None:
    path = tmp_path / "log.xls"
    path.write_text("<table><td>" + " " * 400_000 + "<style" * 50_000 + "x")
    assert open_head(path).unpacked is not None
