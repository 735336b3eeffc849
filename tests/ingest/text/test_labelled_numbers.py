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


def test_times_of_day_are_no_labels(read_log: ReadLog) -> None:
    rows = "".join(f"10:00:{2e-3 * k:06.3f},{f}\n" for k, f in zip(K, FORCE, strict=True))
    (record,) = read_log("Time,Force (N)\n" + rows)
    assert record.dt == pytest.approx(2e-3)
