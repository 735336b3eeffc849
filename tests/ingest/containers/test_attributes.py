"""Packed numbers, marks of missing ones and units as HDF5 and NetCDF files state them, against what was stored."""

import io
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from mrfit.core.recording import Recording
from mrfit.ingest.containers.arrays import Arrays, FileArray
from mrfit.ingest.containers.attributes import ScaledDataset, packing_of, unit_beside, units_in
from mrfit.ingest.containers.shelf import Shelf
from tests.ingest.conftest import ReadLog

K = np.arange(400)
TIME = 2e-3 * K
FORCE = np.round(800.0 * np.cos(0.05 * K))


def _read(read_log: ReadLog, stored: Any, time: Any = TIME, time_unit: str = "s", **attributes: Any) -> list[Recording]:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["time"], file["force"] = time, stored
        file["time"].attrs["units"] = time_unit
        file["force"].attrs["units"] = "N"
        file["force"].attrs.update(attributes)
    return read_log(buffer.getvalue(), "run.h5")


@pytest.mark.parametrize(
    ("stored", "attributes"),
    [
        (FORCE.astype(np.int16), {"scale_factor": 0.5, "add_offset": -3.0}),
        (FORCE.astype(np.int32), {"gain": 2.5}),
        (FORCE.astype(np.float32), {"Gain": np.array([0.25]), "Offset": 10.0}),
        (FORCE.astype(np.int16), {"scale": "0.5", "offset": b"4"}),
        (FORCE.astype(np.int16), {"add_offset": np.float32(7.0)}),
    ],
)
def test_numbers_are_unpacked_and_it_is_said(stored: Any, attributes: dict[str, Any], read_log: ReadLog) -> None:
    factors = {"scale_factor", "gain", "Gain", "scale"} & attributes.keys()
    shifts = {"add_offset", "Offset", "offset"} & attributes.keys()
    scale = float(np.asarray(attributes[factors.pop()]).item()) if factors else 1.0
    shift = float(np.asarray(attributes[shifts.pop()]).item()) if shifts else 0.0
    (record,) = _read(read_log, stored, **attributes)
    np.testing.assert_allclose(record.channels["force"], scale * FORCE + shift)
    assert "unpacked" in {f.kind for f in record.findings}


@pytest.mark.parametrize("attributes", [{"offset": 5.0}, {"scale": 2.0}, {"gain_setting": 4}, {"scale_factor": 1.0}])
def test_words_that_mean_no_packing_change_nothing(attributes: dict[str, Any], read_log: ReadLog) -> None:
    (record,) = _read(read_log, FORCE, **attributes)
    np.testing.assert_allclose(record.channels["force"], FORCE)
    assert "unpacked" not in {f.kind for f in record.findings}


@pytest.mark.parametrize(
    ("mark", "attributes"),
    [
        (-9999, {"_FillValue": np.int16(-9999), "scale_factor": 0.1, "add_offset": 100.0}),
        (-9999, {"missing_value": -9999.0}),
        (-9999, {"missing_value": np.array([-9999, 32767])}),
        (7, {"_FillValue": 7}),
        (3000, {"missing_value": 400.0, "scale_factor": 0.1, "add_offset": 100.0, "valid_max": np.int16(2000)}),
        (-9999, {"valid_range": np.array([-1000, 1000])}),
        (4000, {"missing_value": 400.5, "scale_factor": 0.1, "add_offset": 0.5}),
    ],
)
def test_marks_are_compared_before_scaling(mark: int, attributes: dict[str, Any], read_log: ReadLog) -> None:
    stored = np.where(FORCE == 7, 8, FORCE).astype(np.int16)
    rows = [50, 51, 52, 200]
    whole = stored * attributes.get("scale_factor", 1.0) + attributes.get("add_offset", 0.0)
    spoilt = stored.copy()
    spoilt[rows] = mark
    (record,) = _read(read_log, spoilt, **attributes)
    assert (record.rows_kept, record.rows_refused) == (396, 4)
    sound = np.delete(K, rows)
    np.testing.assert_allclose(record.channels["force"][sound], whole[sound])
    np.testing.assert_allclose(record.channels["force"][rows], whole[rows], atol=4.0)


def test_what_the_file_holds_where_nothing_was_written_is_missing(read_log: ReadLog) -> None:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["time"] = TIME
        file.create_dataset("force", (400,), "f4", fillvalue=-5.0, chunks=(100,))[:360] = FORCE[:360]
    (record,) = read_log(buffer.getvalue(), "run.h5")
    assert record.samples == 360
    np.testing.assert_allclose(record.channels["force"], FORCE[:360])


def test_a_factor_that_does_not_fit_costs_its_array(read_log: ReadLog) -> None:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["time"], file["force"], file["current"] = TIME, FORCE, FORCE
        file["force"].attrs["scale_factor"] = np.array([1.0, 2.0, 3.0])
        file["current"].attrs["gain"] = "see manual"
        file["displacement"] = FORCE
    (record,) = read_log(buffer.getvalue(), "run.h5")
    assert list(record.channels) == ["displacement"]
    assert sum(f.kind == "not-read" for f in record.findings) == 2


def test_a_factor_for_each_column(read_log: ReadLog) -> None:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["time"], file["log"] = TIME, np.column_stack([K, K]).astype(np.int16)
        file["log"].attrs.update({"scale_factor": np.array([0.5, 2.0]), "units": np.array([b"mm", b"kN"])})
    (record,) = read_log(buffer.getvalue(), "run.h5")
    np.testing.assert_allclose(record.channels["displacement"], 0.5e-3 * K)
    np.testing.assert_allclose(record.channels["force"], 2e3 * K)


@pytest.mark.parametrize(
    ("unit", "seconds"),
    [
        ("days since 2024-01-01 00:00:00", 86400.0),
        ("hours since 2024-03-05T10:00:00Z", 3600.0),
        ("milliseconds since 1970-01-01", 1e-3),
        ("Minutes since the start", 60.0),
        ("microseconds since 2000-01-01 12:00", 1e-6),
    ],
)
def test_times_since_a_date(unit: str, seconds: float, read_log: ReadLog) -> None:
    (record,) = _read(read_log, FORCE, TIME / seconds, unit)
    assert record.dt == pytest.approx(2e-3, rel=1e-9)
    np.testing.assert_allclose(record.channels["force"], FORCE)
    assert "unit-assumed" not in {f.kind for f in record.findings}


@pytest.mark.parametrize(
    "unit",
    [
        np.array([b"kN"]),
        np.array([b"k", b"N"]),
        np.frombuffer(b"kN", np.uint8),
        np.bytes_(b"kN\0\0"),
        np.array(["kN"], dtype=object),
    ],
)
@pytest.mark.parametrize("key", ["Unit", "units", "UNITS"])
def test_a_unit_as_bytes_in_any_shape(unit: Any, key: str, read_log: ReadLog) -> None:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["time"], file["Load"] = TIME, FORCE
        text = unit if unit.dtype != object else np.array(["kN"], dtype=h5py.string_dtype())
        file["Load"].attrs[key] = text
    (record,) = read_log(buffer.getvalue(), "run.h5")
    np.testing.assert_allclose(record.channels["force"], 1e3 * FORCE)


def test_texts_of_units() -> None:
    assert units_in({b"Unit": b"\xb0C"}) == ["°C"]  # Latin-1, as LabVIEW writes it
    assert units_in({"units": 5.0}) == units_in({"unit": ""}) == units_in({"scale": "m"}) == []
    assert units_in({"unit": np.array([b"mm", b""])}) == ["mm", ""]


def test_long_arrays_are_unpacked_slice_by_slice(tmp_path: Path) -> None:
    """Beyond the size at which arrays are put on the disk, a file gives the numbers that it gives in memory."""
    packing = packing_of({"scale_factor": 0.5, "_FillValue": np.int16(-1)}, (400,), np.dtype(np.int16))
    assert packing is not None
    arrays = Arrays(shelf=Shelf(tmp_path / "numbers", 100))
    stored = np.where(K == 7, -1, K).astype(np.int16)
    arrays.add("force", FileArray(ScaledDataset(stored, packing), stored.shape))
    np.testing.assert_allclose(arrays.signals["force"][0:400], np.where(K == 7, np.nan, 0.5 * K))


def test_marks_of_no_number_are_no_packing() -> None:
    assert packing_of({"_FillValue": np.array([np.nan])}, (6,), np.dtype(np.float32)) is not None
    assert packing_of({}, (6,), np.dtype(np.float32)) is None


@pytest.mark.parametrize(
    ("texts", "unit"),
    [
        ({"t_unit": "ms"}, "ms"),
        ({"t_Unit": "ms", "T_Unit": "degC"}, "ms"),
        ({"T_UNIT": "degC", "t_UNIT": "ms"}, "ms"),
        ({"units.T": "degC", "units.t": "ms"}, "ms"),
        ({".T_unit": "degC", ".t_unit": "ms"}, "ms"),
        # that of the other column is none of this one
        ({"T_unit": "degC"}, ""),
        ({"T.unit": "degC"}, ""),
    ],
)
def test_the_text_of_one_letter_is_none_of_the_other(texts: dict[str, str], unit: str) -> None:
    assert unit_beside("t", texts, ("_", "."), ("T", "t", "force")) == unit


def test_a_text_of_any_case_is_taken_where_no_other_column_has_it() -> None:
    assert unit_beside("run.Force", {"run.FORCE_UNIT": "kN"}, ("_",), ("run.Force", "run.x")) == "kN"
    assert unit_beside("run.Force", {"force_unit": "kN"}, ("_",)) == "kN"
