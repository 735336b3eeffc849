"""Labels before the numbers of every row are the names of the columns."""

import numpy as np
import pytest

from tests.ingest.conftest import ReadLog

K = np.arange(300)
FORCE = np.round(800.0 * np.cos(0.05 * K), 1)


@pytest.mark.parametrize("form", ["t_ms:{t},pos_mm:{x},load_N:{f}", "t_ms={t} pos_mm={x} load_N={f}"])
@pytest.mark.parametrize("banner", ["", "Rig ready\n"])
def test_labels_of_a_serial_port(form: str, banner: str, read_log: ReadLog) -> None:
    rows = [form.format(t=2 * k, x=round(0.1 * k, 1), f=f) for k, f in zip(K, FORCE, strict=True)]
    (record,) = read_log(banner + "\n".join(rows) + "\n", "serial.log")
    assert record.dt == pytest.approx(2e-3)
    np.testing.assert_allclose(record.channels["force"], FORCE)


def test_rows_with_other_labels_are_left_out_and_counted(read_log: ReadLog) -> None:
    rows = [f"t_ms:{2 * k},pos_mm:{0.1 * k:.1f},load_N:{f}" for k, f in zip(K, FORCE, strict=True)]
    rows[7], rows[40] = "t_ms:14,load_N:5,pos_mm:0", "t_ms:80,pos_mm:,load_N:"
    (record,) = read_log("\n".join(rows) + "\n", "serial.log")
    assert record.rows_refused == 2 and record.rows_kept == len(K) - 2


def test_times_of_day_are_no_labels(read_log: ReadLog) -> None:
    rows = "".join(f"10:00:{2e-3 * k:06.3f},{f}\n" for k, f in zip(K, FORCE, strict=True))
    (record,) = read_log("Time,Force (N)\n" + rows)
    assert record.dt == pytest.approx(2e-3)
