"""Tests side by side in one table are recordings of their own, where each has its times and all have the same names."""

import numpy as np
import pytest

from tests.ingest.conftest import ReadLog

K = np.arange(300)
FORCE = np.round(800.0 * np.cos(0.05 * K), 1)


def _rows(second: int = 300, apart: str = ",") -> str:
    left = [f"{2e-3 * k:.3f},{0.1 * k:.1f},{f}" for k, f in zip(K, FORCE, strict=True)]
    right = [f"{4e-3 * k:.3f},{0.2 * k:.1f},{-f}" if k < second else ",," for k, f in zip(K, FORCE, strict=True)]
    return "".join(f"{a}{apart}{b}\n" for a, b in zip(left, right, strict=True))


@pytest.mark.parametrize(
    "header",
    [
        "Time,Stroke,Force,Time,Stroke,Force\ns,mm,N,s,mm,N\n",
        "Time,Stroke,Force,Time.1,Stroke.1,Force.1\ns,mm,N,s,mm,N\n",
        "Run 1: Time (s),Run 1: Stroke (mm),Run 1: Force (N),Run 2: Time (s),Run 2: Stroke (mm),Run 2: Force (N)\n",
        "I = 0 A,,,I = 1 A,,\nTime (s),Stroke (mm),Force (N),Time (s),Stroke (mm),Force (N)\n",
    ],
)
@pytest.mark.parametrize("second", [300, 200])
def test_tests_with_times_of_their_own(header: str, second: int, read_log: ReadLog) -> None:
    one, two = read_log(header + _rows(second))
    assert (one.dt, two.dt) == (pytest.approx(2e-3), pytest.approx(4e-3))
    np.testing.assert_allclose(one.channels["force"], FORCE)
    np.testing.assert_allclose(two.channels["force"], -FORCE[:second])
    assert "side-by-side" in {f.kind for f in one.findings}
    assert two.rows_refused == 0


SAME = "Time,Stroke,Force,Time,Stroke,Force\ns,mm,N,s,mm,N\n"
COPIES = "Time,Stroke,Force,Time.1,Stroke.1,Force.1\ns,mm,N,s,mm,N\n"
RUNS = "Run 1: Time (s),Run 1: Stroke (mm),Run 1: Force (N),Run 2: Time (s),Run 2: Stroke (mm),Run 2: Force (N)\n"


@pytest.mark.parametrize(
    ("header", "channel_map"),
    [
        (COPIES, "resistance = 2.0\n"),
        (SAME, 'time = "Time"\n'),
        (SAME, 'ignore = ["Stroke"]\n'),
        (SAME, '[channels]\nforce = {column = ["Kraft", "Force"]}\n'),
        (RUNS, 'time = "Time"\n'),
        (RUNS, 'ignore = ["Note"]\n'),
    ],
)
def test_a_map_that_means_every_test_leaves_them_apart(header: str, channel_map: str, read_log: ReadLog) -> None:
    one, two = read_log(header + _rows(), channel_map=channel_map)
    assert (one.dt, two.dt) == (pytest.approx(2e-3), pytest.approx(4e-3))
    np.testing.assert_allclose(two.channels["force"], -FORCE)


@pytest.mark.parametrize(
    ("header", "time", "force", "dt", "sign"),
    [
        (SAME, "3", "5", 4e-3, -1.0),
        (COPIES, '"Time.1"', '"Force.1"', 4e-3, -1.0),
        (COPIES, '"Time"', '"Force"', 2e-3, 1.0),
    ],
)
def test_a_map_that_names_the_columns_of_one_test_means_it(
    header: str, time: str, force: str, dt: float, sign: float, read_log: ReadLog
) -> None:
    text = f"time = {time}\n[channels]\nforce = {{column = {force}}}\n"
    (record,) = read_log(header + _rows(), channel_map=text)
    assert record.dt == pytest.approx(dt)
    np.testing.assert_allclose(record.channels["force"], sign * FORCE)


def test_each_has_its_own_value_of_a_condition(read_log: ReadLog) -> None:
    one, two = read_log(SAME + _rows(), channel_map="[condition]\ncurrent = [0.5, 1.0]\ngap = 2.0\n")
    assert (one.condition["current"], two.condition["current"]) == (0.5, 1.0)
    assert one.condition["gap"] == two.condition["gap"] == 2.0


@pytest.mark.parametrize(("before", "name"), [("Latest: ", "plunger"), ("Left: ", "left_plunger")])
def test_a_run_before_every_name_is_no_part_of_it(before: str, name: str, read_log: ReadLog) -> None:
    rows = "".join(f"{2e-3 * k:.3f},{f},{k}\n" for k, f in zip(K, FORCE, strict=True))
    (record,) = read_log(f"{before}Time (s),{before}Force (N),{before}Plunger\n{rows}")
    assert set(record.channels) == {"force", name}


def test_each_has_the_parts_of_its_own_clock(read_log: ReadLog) -> None:
    clock = [f"{1763028672 + 2 * k // 1000},{2 * k % 1000}" for k in K]
    rows = "".join(f"{c},{f},{c},{-f}\n" for c, f in zip(clock, FORCE, strict=True))
    one, two = read_log("Sec,Msec,Force (N),Sec,Msec,Force (N)\n" + rows)
    assert (one.dt, two.dt) == (pytest.approx(2e-3), pytest.approx(2e-3))
    np.testing.assert_allclose(two.channels["force"], -FORCE)


def test_a_blank_column_between_them(read_log: ReadLog) -> None:
    one, two = read_log("Time (s),Stroke (mm),Force (N),,Time (s),Stroke (mm),Force (N)\n" + _rows(apart=",,"))
    assert set(one.channels) == set(two.channels) == {"displacement", "force"}


def test_a_clock_for_each_channel_is_of_one_test(read_log: ReadLog) -> None:
    rows = "".join(f"{2e-3 * k:.3f},{f},{2e-3 * k:.3f},{0.1 * k:.1f}\n" for k, f in zip(K, FORCE, strict=True))
    (record,) = read_log("Time (s),Force (N),Time (s),Stroke (mm)\n" + rows)
    assert {"displacement", "force"} <= set(record.channels)


def test_a_channel_map_reads_the_table_as_one(read_log: ReadLog) -> None:
    header = "Time,Stroke,Force,Time.1,Stroke.1,Force.1\ns,mm,N,s,mm,N\n"
    (record,) = read_log(header + _rows(), channel_map='[channels]\nforce = {column = 5, unit = "N"}\n')
    np.testing.assert_allclose(record.channels["force"][::2], -FORCE[:150])


def test_a_spectrum_at_the_right_that_ends_early_costs_no_rows_and_is_said(read_log: ReadLog) -> None:
    rows = [f"{2e-3 * k:.3f},{k % 7},{k % 9}" + (f",{0.5 * k},{5 + k % 3}" if k < 150 else ",,") for k in range(300)]
    (record,) = read_log("Time (s),Force (N),Stroke (mm),Frequency (Hz),Force (N)\n" + "\n".join(rows) + "\n")
    assert (record.rows_kept, set(record.channels)) == (300, {"force", "displacement"})
    assert any("are another table: not read" in f.text for f in record.findings)


def test_a_channel_that_ends_early_behind_one_that_does_too_is_no_table_without_an_axis(read_log: ReadLog) -> None:
    rows = [f"{2e-3 * k:.3f},{k % 7},{k % 9}" + (f",{k % 4},{5 + k % 3}" if k < 290 else ",,") for k in range(300)]
    (record,) = read_log("Time (s),Force (N),Stroke (mm),Load A (N),Load B (N)\n" + "\n".join(rows) + "\n")
    assert (record.rows_kept, len(record.channels)) == (290, 4)
