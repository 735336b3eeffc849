import io

import h5py
import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import hdf5, signals


def test_time_dataset_and_units(read_log: ReadLog) -> None:
    time, one, two = signals()
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["time"] = time
        file["Force (kN)"] = one
        file["drive"] = two
        file["drive"].attrs["units"] = "mm"
    (record,) = read_log(buffer.getvalue(), "run.h5")
    assert record.start == -0.05
    np.testing.assert_allclose(record.channels["force"], 1e3 * one)
    assert record.units["displacement"] == "m"


def test_a_table_of_named_columns(read_log: ReadLog) -> None:
    """One dataset with a compound type, as PyTables and numpy write a table."""
    time, one, two = signals()
    table = np.zeros(len(time), dtype=[("time", "f8"), ("force", "f4"), ("current", "f8"), ("note", "S4")])
    table["time"], table["force"], table["current"] = time, one, two
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["rig/log"] = table
    (record,) = read_log(buffer.getvalue(), "run.h5")
    assert record.dt == pytest.approx(1e-3)
    assert list(record.channels) == ["force", "current"]
    np.testing.assert_allclose(record.channels["current"], two)


@pytest.mark.parametrize("data", [hdf5().data[:1500], hdf5().data[:8] + b"\0" * 2000])
def test_damaged_file_is_refused(data: bytes, read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="damaged HDF5"):
        read_log(data, "run.h5")


@pytest.mark.parametrize("kind", [np.int16, np.float64])
@pytest.mark.parametrize(
    ("about", "said"),
    [
        ({"scale_factor": 2.0, "add_offset": 5.0}, ""),
        ({"gain": 2.0, "offset": 0.0}, ""),
        ({"Gain": 2.0, "Offset": 5.0}, "taken as stored × gain + offset"),
        ({"scale_factor": 2.0, "offset": 5.0}, "taken as stored × scale_factor + offset"),
        ({"scale": 2.0, "offset": 5.0}, "scale"),
        ({"slope": 2.0, "offset": 5.0}, "slope"),
        ({"multiplier": 2.0}, "not applied"),
        ({"multiplier": 1.0, "zero": 0.0}, ""),
    ],
)
def test_pairs_whose_order_is_not_stated_are_said(
    about: dict[str, float], said: str, kind: type, read_log: ReadLog
) -> None:
    stored = np.round(400.0 * np.sin(np.arange(300) / 20.0)).astype(kind)
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file.attrs["sample_rate"] = 500.0
        file.create_dataset("force (N)", data=stored).attrs.update(about)
    (record,) = read_log(buffer.getvalue(), "run.h5")
    found = [f.text for f in record.findings if f.kind == "packing-unclear"]
    assert len(found) == bool(said) and all(said in text for text in found)
    applied = "multiplier" not in about and not (kind is np.float64 and {"scale", "slope"} & about.keys())
    low, high = (float(v) for v in list(about.values())[:2]) if applied else (1.0, 0.0)
    np.testing.assert_allclose(record.channels["force"], low * stored + high)
