import io

import numpy as np
import pytest
from scipy.io import savemat

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import DT, matlab, signals


def _mat(variables: dict[str, object]) -> bytes:
    buffer = io.BytesIO()
    savemat(buffer, variables)
    return buffer.getvalue()


def test_matrix_columns_by_map(read_log: ReadLog) -> None:
    channel_map = (
        '[channels]\ndisplacement = {column = "x_F[0]", unit = "mm"}\nforce = {column = "x_F[1]", unit = "N"}\n'
    )
    (record,) = read_log(matlab().data, "run.mat", channel_map)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * signals()[1])
    assert record.units == {"displacement": "m", "force": "N"}


def test_structs_and_scalars(read_log: ReadLog) -> None:
    _, one, two = signals()
    data = _mat({"run": {"Force": one, "Current": two, "fs": 1 / DT, "note": "first"}})
    (record,) = read_log(data, "run.mat")
    assert record.dt == DT
    assert set(record.channels) == {"run.force", "run.current"}


def test_dspace_capture(read_log: ReadLog) -> None:
    time, one, two = signals()
    names = np.array(
        [("Load", "kN", one), ("Coil current", "A", two)], dtype=[("Name", object), ("Unit", object), ("Data", object)]
    )
    data = _mat({"capture": {"X": {"Name": "time", "Data": time}, "Y": names}})
    (record,) = read_log(data, "run.mat")
    np.testing.assert_allclose(record.channels["force"], 1e3 * one)
    assert record.units == {"force": "N", "current": "A"}
    assert record.dt == DT


def test_version_seven_three(read_log: ReadLog) -> None:
    import h5py

    time, one, _ = signals()
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=512) as file:
        for name, values in (("time", time), ("force", one)):
            made = file.create_dataset(name, data=values[None, :])
            made.attrs["MATLAB_class"] = np.bytes_("double")
        file.create_dataset("note", data=np.arange(5, dtype=np.uint16)).attrs["MATLAB_class"] = np.bytes_("char")
        file.create_dataset("#refs#/a", data=np.arange(9.0))
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512, b" ")
    (record,) = read_log(head + buffer.getvalue()[512:], "run.mat")
    assert list(record.channels) == ["force"]
    np.testing.assert_array_equal(record.channels["force"], one)


def test_no_rate_is_refused_and_the_map_mends_it(read_log: ReadLog) -> None:
    data = _mat({"U": signals()[1], "Y": signals()[2]})
    with pytest.raises(Refusal, match=r"no time column and no sample rate \(columns: 'U', 'Y'\)"):
        read_log(data, "run.mat")
    assert read_log(data, "run.mat", "rate = 200\n")[0].dt == 0.005


def test_damaged_file_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="damaged MAT-file"):
        read_log(matlab().data[:900], "run.mat")
