"""Logs that a rule on rarer ones must not touch."""

import numpy as np
import pytest

from tests.ingest.conftest import ReadLog

K = np.arange(120)
STROKE, FORCE = np.round(5.0 * np.sin(0.1 * K), 3), np.round(300.0 * np.cos(0.1 * K), 1)
RATE = "Sample rate: 1000 Hz\n"


def rows(*columns: object) -> str:
    """Return rows of numbers or texts."""
    return "".join(",".join(map(str, row)) + "\n" for row in zip(*columns, strict=True))


LOGS = {
    "a counter as long as a date": RATE
    + "Encoder,Displacement (mm),Force (N)\n"
    + rows(1000000000000 + 4096 * K, STROKE, FORCE),
    "a temperature called T": "Displacement (mm),Force (N),Temp. T,Time (s)\n" + rows(STROKE, FORCE, 20 + K, K / 1e3),
    "a temperature of the oil": "Time,Displacement (mm),Force (N),Oil.T\n" + rows(K / 1e3, STROKE, FORCE, 20 + K),
    "a note in inches": RATE
    + 'Note, "5 in\nDisplacement (mm),Force (N),Note\n'
    + rows(STROKE, FORCE, ['"' if k == 3 else "" for k in K]),
    "a ratio": RATE + "Mix,Displacement (mm),Force (N)\n" + rows(["1:2:1"] * 120, STROKE, FORCE),
    "notes with units above": "Time,Displacement (mm),Force (N)\n".join(
        ["note of the operator\n" * 20, rows([f"{k / 1e3:.3f} s" for k in K], STROKE, FORCE)]
    ),
    "tags of a head": "<head>\n" + RATE + "</head>\nDisplacement (mm),Force (N)\n" + rows(STROKE, FORCE),
    "settings before rows that begin at one interval": "ChannelTitle=\tTime\tStroke\tForce\nUnitName=\ts\tmm\tN\n"
    "Zero\t0\t0\t0\n" + rows(K[1:] / 1e3, STROKE[1:], FORCE[1:]).replace(",", "\t"),
    "a channel that ends early": "Time (s),Force (N),Displacement (mm),Velocity (mm/s)\n"
    + rows(K / 1e3, FORCE, [*K[:-1], ""], [*STROKE[:-1], ""]),
}


@pytest.mark.parametrize("log", LOGS)
def test_rows_and_channels_stay(log: str, read_log: ReadLog) -> None:
    (record,) = read_log(LOGS[log])
    assert record.dt == pytest.approx(1e-3) and record.rows_kept >= 119
    assert {"displacement", "force"} <= set(record.channels)
    assert len(record.channels["force"]) >= 119


def test_set_points_in_a_third_row_of_the_header_are_not_measured(read_log: ReadLog) -> None:
    head = "Time;Force;Displacement\ns;kN;mm\nZeit;Kraft Soll;Weg Soll\n"
    (record,) = read_log(head + rows(K / 1e3, FORCE, STROKE).replace(",", ";"))
    assert not {"force", "displacement"} & set(record.channels)


def test_a_column_that_rises_is_no_minute_of_a_clock(read_log: ReadLog) -> None:
    (record,) = read_log("Time (s),m,Force (N)\n" + rows(K // 2 / 10, K // 4, FORCE))
    assert record.dt == pytest.approx(0.05, rel=0.02)


def test_columns_called_s_and_min_are_no_clock_beside_a_greatest_value(read_log: ReadLog) -> None:
    text = "s (mm);F (N);min;max\n" + rows(STROKE, FORCE, FORCE - 1, FORCE + 1).replace(",", ";")
    (record,) = read_log("Abtastrate: 1000 Hz\n" + text)
    assert record.dt == pytest.approx(1e-3)


def test_a_duration_goes_on_beyond_a_minute(read_log: ReadLog) -> None:
    times = [f"PT{t // 60:.0f}M{t % 60:.1f}S" if t >= 60 else f"PT{t:.1f}S" for t in K * 0.8]
    (record,) = read_log("Time,Displacement (mm),Force (N)\n" + rows(times, STROKE, FORCE))
    assert record.dt == pytest.approx(0.8) and record.rows_kept == 120
