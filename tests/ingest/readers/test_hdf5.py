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


@pytest.mark.parametrize(("name", "dt"), [("time_us", 5e-3), ("time_ms", 5.0), ("ts", 5e-3), ("t_s", 5e3)])
def test_the_unit_of_the_times_of_a_group(name: str, dt: float, read_log: ReadLog) -> None:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file[f"log/{name}"] = (1710412522.0 if name == "ts" else 0.0) + np.arange(300) * (5e-3 if name == "ts" else 5e3)
        file["log/force_N"] = file["log/disp_mm"] = np.sin(np.arange(300) / 9)
    if dt > 600.0:
        with pytest.raises(Refusal, match="its times in 's' make 5e"):
            read_log(buffer.getvalue(), "run.h5")
    else:
        (record,) = read_log(buffer.getvalue(), "run.h5")
        assert record.dt == pytest.approx(dt) and set(record.channels) == {"displacement", "force"}


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


def _file(datasets: dict[str, object], attributes: dict[str, object] | None = None) -> bytes:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        for name, values in datasets.items():
            file[name] = values
        file.attrs.update(attributes or {})
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("beside", "attributes"),
    [
        ({}, {"t_units": "s", "disp_units": "mm", "force_units": "kN"}),
        ({"units/t": "s", "units/disp": "mm", "units/force": "kN"}, {}),
        ({"disp_unit": np.bytes_("mm"), "force_unit": "kN", "t_unit": "s"}, {}),
    ],
)
def test_units_beside_the_datasets(beside: dict[str, object], attributes: dict[str, object], read_log: ReadLog) -> None:
    time, one, two = signals()
    (record,) = read_log(_file({"t": time, "disp": one, "force": two, **beside}, attributes), "run.h5")
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * one)
    np.testing.assert_allclose(record.channels["force"], 1e3 * two)
    assert not [f for f in record.findings if f.kind == "unit-assumed"]


def test_texts_of_other_names_are_no_units(read_log: ReadLog) -> None:
    time, one, _ = signals()
    (record,) = read_log(_file({"t": time, "force": one, "other/force": "kN"}, {"forces_units": "kN"}), "run.h5")
    np.testing.assert_allclose(record.channels["force"], one)


@pytest.mark.parametrize("more", [[], [b"Current"]])
def test_names_and_units_beside_a_matrix(more: list[bytes], read_log: ReadLog) -> None:
    _, one, two = signals()
    beside = {"names": np.array([b"Stroke", b"Load", *more]), "channel_units": np.array([b"mm", b"kN"]), "fs": 800.0}
    (record,) = read_log(_file({"data": np.array([one, two])[:, ::-1], **beside}), "run.h5")
    assert record.dt == pytest.approx(1.0 / 800.0) and set(record.channels) == {"displacement", "force"}
    named = _file({"data": np.array([one, two]), **beside, "channel_units": np.array([b"V", b"V"])})
    assert set(read_log(named, "run.h5")[0].channels) == ({"data_0", "data_1"} if more else {"stroke", "load"})


def test_groups_are_tests_in_the_order_of_their_numbers(read_log: ReadLog) -> None:
    _, one, _ = signals()
    sizes = {"run_10": 60, "run_9": 40, "run_1": 90}
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        for name, size in sizes.items():
            file[f"{name}/force (N)"] = one[:size]
            file[name].attrs.update({"dt_ms": 2.0, "current_A": float(size)})
        file["results/peak"] = np.arange(3.0)
    records = read_log(buffer.getvalue(), "run.h5")
    assert [r.samples for r in records] == [90, 40, 60] and {r.dt for r in records} == {0.002}
    assert [r.condition["current"] for r in records] == [90.0, 40.0, 60.0]
    assert [r.history[1] for r in records] == [f"test '{n}' of the file" for n in ("run_1", "run_9", "run_10")]
    assert any(f.kind == "not-read" and "'results.peak' (3)" in f.text for f in records[0].findings)
