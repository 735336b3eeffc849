"""Logs with one row for each channel and time."""

import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog

K = np.arange(300)
DISP, FORCE = 10.0 * np.sin(K / 30.0), 900.0 * np.cos(K / 30.0)


def rows(form: str, one: str = "disp", two: str = "force") -> list[str]:
    """The row of each channel and time; ``form`` names time t, channel c, unit u, value v."""
    made = []
    for k, a, b in zip(K, DISP, FORCE, strict=True):
        for name, unit, value in ((one, "mm", a), (two, "kN", b / 1e3)):
            made.append(form.format(t=f"{k * 0.002:.3f}", c=name, u=unit, v=f"{value:.6f}"))
    return made


@pytest.mark.parametrize(
    ("names", "form"),
    [
        ("Time (s),Channel,Unit,Value", "{t},{c},{u},{v}"),
        ("Time (s);Signal;Value;Unit", "{t};{c};{v};{u}"),
        ("Time,Sensor name,Value,Units", "{t},{c},{v},{u}"),
        ("Zeit (s);Kanal;Einheit;Wert", "{t};{c};{u};{v}"),
    ],
)
@pytest.mark.parametrize("order", ["mixed", "one by one"])
def test_every_channel_gets_a_column(names: str, form: str, order: str, read_log: ReadLog) -> None:
    lines = rows(form)
    lines = lines if order == "mixed" else lines[::2] + lines[1::2]
    (record,) = read_log("\n".join([names, *lines]) + "\n")
    assert (record.dt, record.samples) == (0.002, 300)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * DISP, atol=1e-9)
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-3)
    assert any(f.kind == "long-format" for f in record.findings)


def test_numbers_of_channels_need_units(read_log: ReadLog) -> None:
    text = "\n".join(["Time (s),Channel ID,Value", *rows("{t},{c},{v}", "1", "2")])
    (record,) = read_log(text + "\n")
    assert set(record.channels) == {"channel_1", "channel_2"}
    np.testing.assert_allclose(record.channels["channel_1"], DISP, atol=1e-6)
    channel_map = '[channels]\nforce = {column = "channel 2", unit = "kN"}\n'
    (record,) = read_log(text + "\n", channel_map=channel_map)
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-3)


def test_channels_with_times_of_their_own(read_log: ReadLog) -> None:
    """The force has every fifth row only."""
    lines = rows("{t},{c},{u},{v}")
    kept = [line for k, line in enumerate(lines) if k % 2 == 0 or k % 10 == 1]
    (record,) = read_log("\n".join(["Time (s),Channel,Unit,Value", *kept]) + "\n")
    assert record.dt == 0.002 and record.samples == 296
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * DISP[:296], atol=1e-9)
    np.testing.assert_allclose(record.channels["force"], FORCE[:296], atol=5.0)


def test_a_lost_row_is_interpolated(read_log: ReadLog) -> None:
    lines = rows("{t},{c},{u},{v}")
    del lines[101]
    (record,) = read_log("\n".join(["Time (s),Channel,Unit,Value", *lines]) + "\n")
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=1.0)


def test_long_formats_that_are_not_read(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="no header says"):
        read_log("\n".join(["Channel,Value", *rows("{c},{v}")]) + "\n")
    lines = rows("{t},{c},{u},{v}")
    lines[100] = lines[100].replace("mm", "in")
    with pytest.raises(Refusal, match="channel 'disp' has the units 'in' and 'mm'"):
        read_log("\n".join(["Time (s),Channel,Unit,Value", *lines]) + "\n")


def test_a_column_of_words_beside_channels_is_no_long_format(read_log: ReadLog) -> None:
    lines = [f"{k * 0.002:.3f},run,{a:.5f},{b:.5f}" for k, a, b in zip(K, DISP, FORCE, strict=True)]
    (record,) = read_log("\n".join(["Time (s),Name,disp (mm),force (N)", *lines]) + "\n")
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-4)
