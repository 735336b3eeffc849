"""Which column is the time: one that is called so, unless its unit is of another quantity, in every container."""

import io
import json
from collections.abc import Callable, Mapping

import h5py
import numpy as np
import pandas as pd
import pytest
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

from mrfit.api.recordings import Recording
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.text.layout import is_called_time
from tests.ingest.conftest import ReadLog

Columns = Mapping[tuple[str, str], np.ndarray]
TIME = np.arange(800) / 400.0
WARMING = 25.0 + 0.5 * TIME
FORCE = 300.0 * np.sin(9.0 * TIME) + 5.0 * np.cos(2.0 * TIME)


def frame(columns: Columns) -> pd.DataFrame:
    return pd.DataFrame({f"{name} ({unit})" if unit else name: v for (name, unit), v in columns.items()})


def csv(columns: Columns) -> bytes:
    return frame(columns).to_csv(index=False).encode()


def parquet(columns: Columns) -> bytes:
    return frame(columns).to_parquet()


def json_log(columns: Columns) -> bytes:
    return json.dumps({name: v.tolist() for name, v in frame(columns).items()}).encode()


def hdf(columns: Columns) -> bytes:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        for (name, unit), values in columns.items():
            file.create_dataset(name, data=values)
            if unit:
                file[name].attrs["unit"] = unit
    return buffer.getvalue()


def matlab(columns: Columns) -> bytes:
    buffer = io.BytesIO()
    units = {f"{name}_unit": unit for (name, unit) in columns if unit}
    savemat(buffer, {**{name: v for (name, _), v in columns.items()}, **units})
    return buffer.getvalue()


def tdms(columns: Columns) -> bytes:
    buffer = io.BytesIO()
    with TdmsWriter(buffer) as writer:
        writer.write_segment(
            [
                ChannelObject("rig", name, values, properties={"unit_string": unit} if unit else {})
                for (name, unit), values in columns.items()
            ]
        )
    return buffer.getvalue()


CONTAINERS: list[tuple[str, Callable[[Columns], bytes]]] = [
    ("run.csv", csv),
    ("run.parquet", parquet),
    ("run.json", json_log),
    ("run.h5", hdf),
    ("run.mat", matlab),
    ("run.tdms", tdms),
]


@pytest.mark.parametrize(("name", "write"), CONTAINERS)
@pytest.mark.parametrize("time", ["time", "t"])
def test_a_temperature_that_rises_is_no_clock(
    name: str, write: Callable[[Columns], bytes], time: str, read_log: ReadLog
) -> None:
    (record,) = read_log(write({("T", "degC"): WARMING, (time, "s"): TIME, ("force", "N"): FORCE}), name)
    assert (record.dt, record.units) == (1.0 / 400.0, {"temperature": "degC", "force": "N"})
    np.testing.assert_allclose(record.channels["temperature"], WARMING, rtol=1e-6)
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-3)


@pytest.mark.parametrize(("name", "write"), CONTAINERS)
@pytest.mark.parametrize("written", ["t", "T"])
def test_a_map_means_the_column_that_is_written_as_it_says(
    name: str, write: Callable[[Columns], bytes], written: str, read_log: ReadLog
) -> None:
    columns = {("T", ""): 2.0 * TIME, ("t", ""): TIME, ("force", "N"): FORCE}
    (record,) = read_log(write(columns), name, f'time = "{written}"')
    assert record.dt == pytest.approx(1.0 / 400.0 if written == "t" else 2.0 / 400.0)


@pytest.mark.parametrize(("name", "write"), CONTAINERS)
def test_a_map_means_a_column_of_another_case_where_none_is_written_so(
    name: str, write: Callable[[Columns], bytes], read_log: ReadLog
) -> None:
    columns = {("Clock", "s"): TIME, ("force", "N"): FORCE, ("extra", "V"): FORCE + 1.0}
    (record,) = read_log(
        write(columns), name, 'time = "CLOCK"\nignore = ["EXTRA"]\nchannels.force = {column = "Force"}'
    )
    assert record.dt == pytest.approx(1.0 / 400.0) and set(record.channels) == {"force"}


@pytest.mark.parametrize(("name", "write"), CONTAINERS)
def test_letters_that_differ_in_case_alone_are_columns_of_their_own(
    name: str, write: Callable[[Columns], bytes], read_log: ReadLog
) -> None:
    columns = {("t", "s"): TIME, ("V", "V"): FORCE, ("v", "m/s"): WARMING, ("U", "V"): FORCE + 1.0}
    (record,) = read_log(write(columns), name, 'channels.voltage = {column = "V"}\nignore = ["U"]')
    np.testing.assert_allclose(record.channels["voltage"], FORCE, atol=1e-3)
    (record,) = read_log(write(columns), name, 'channels.velocity = {column = "v"}\nignore = ["V"]')
    assert "velocity" in record.channels and "v" not in record.channels
    np.testing.assert_allclose(record.channels["velocity"], WARMING, atol=1e-3)


@pytest.mark.parametrize(("name", "write"), CONTAINERS)
@pytest.mark.parametrize(("left_out", "dt"), [("T", 1.0 / 400.0), ("t", 2.0 / 400.0)])
def test_a_column_that_is_left_out_is_no_clock(
    name: str, write: Callable[[Columns], bytes], left_out: str, dt: float, read_log: ReadLog
) -> None:
    columns = {("T", ""): 2.0 * TIME, ("t", ""): TIME, ("force", "N"): FORCE}
    (record,) = read_log(write(columns), name, f'ignore = ["{left_out}"]')
    assert record.dt == pytest.approx(dt) and set(record.channels) == {"force"}


@pytest.mark.parametrize(("name", "write"), [one for one in CONTAINERS if one[0] in ("run.h5", "run.mat")])
def test_a_name_of_a_map_is_looked_up_in_the_whole_file(
    name: str, write: Callable[[Columns], bytes], read_log: ReadLog
) -> None:
    slow = {("T", ""): WARMING[::8], ("pressure", "Pa"): WARMING[::8]}
    records = read_log(write({("t", ""): TIME, ("force", "N"): FORCE, **slow}), name, 'time = "t"')
    assert [(r.dt, set(r.channels)) for r in records] == [(1.0 / 400.0, {"force"})]
    assert any("'T' (100), 'pressure' (100)" in f.text for f in records[0].findings)


def test_a_temperature_in_another_group_is_no_clock(read_log: ReadLog) -> None:
    buffer = io.BytesIO()
    warm = ChannelObject("slow", "T", WARMING[::8], properties={"unit_string": "degC", "wf_increment": 0.02})
    with TdmsWriter(buffer) as writer:
        writer.write_segment([ChannelObject("rig", "t", TIME), ChannelObject("rig", "force", FORCE), warm])
    fast, slow = read_log(buffer.getvalue(), "run.tdms", 'time = "t"')
    assert (fast.dt, set(fast.channels)) == (1.0 / 400.0, {"force"})
    assert (slow.dt, set(slow.channels)) == (0.02, {"temperature"})


@pytest.mark.parametrize(("name", "write"), CONTAINERS)
@pytest.mark.parametrize("column", ["clock", " CLOCK "])
def test_the_unit_of_a_map_holds_however_the_name_is_written(
    name: str, write: Callable[[Columns], bytes], column: str, read_log: ReadLog
) -> None:
    columns = {("clock", ""): 1e3 * TIME, ("force", "N"): FORCE}
    (record,) = read_log(write(columns), name, f'time = {{column = "{column}", unit = "ms"}}')
    assert record.dt == pytest.approx(1.0 / 400.0)


@pytest.mark.parametrize(("name", "write"), [one for one in CONTAINERS if one[0] not in ("run.h5", "run.mat")])
def test_a_header_cell_means_its_column_with_the_unit_of_the_map(
    name: str, write: Callable[[Columns], bytes], read_log: ReadLog
) -> None:
    log = write({("clock (s)", ""): 1e3 * TIME, ("force", "N"): FORCE})
    (record,) = read_log(log, name, 'time = {column = "clock (s)", unit = "ms"}')
    assert record.dt == pytest.approx(1.0 / 400.0)


def test_a_map_of_any_case_settles_a_unit_of_another_quantity(read_log: ReadLog) -> None:
    log = csv({("time", "s"): TIME, ("Force", "mm"): FORCE, ("x", "mm"): WARMING})
    with pytest.raises(Refusal, match="'Force' is in 'mm'"):
        read_log(log)
    for column in ('"FORCE"', '["load", "force"]'):
        (record,) = read_log(log, "run.csv", f'[channels.force]\ncolumn = {column}\nunit = "N"')
        np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-3)


def test_a_map_of_one_letter_leaves_the_factor_of_the_other(read_log: ReadLog) -> None:
    log = csv({("time", "s"): TIME, ("V", "V"): FORCE, ("v", "x0.01 m/s"): WARMING})
    (record,) = read_log(log, "run.csv", '[channels.voltage]\ncolumn = "V"\nunit = "mV"')
    np.testing.assert_allclose(record.channels["voltage"], 1e-3 * FORCE, atol=1e-6)
    assert record.units["v"] == "m/s"
    np.testing.assert_allclose(record.channels["v"], 0.01 * WARMING, atol=1e-6)


@pytest.mark.parametrize(("name", "write"), CONTAINERS)
def test_a_unit_of_one_letter_is_none_of_the_other(
    name: str, write: Callable[[Columns], bytes], read_log: ReadLog
) -> None:
    (record,) = read_log(write({("T", "degC"): WARMING, ("t", ""): TIME, ("force", "N"): FORCE}), name)
    assert record.dt == pytest.approx(1.0 / 400.0) and set(record.channels) == {"temperature", "force"}


@pytest.mark.parametrize("left_out", ["T (degC)", " T ", "t"])
def test_a_column_is_left_out_by_its_cell_too(left_out: str, read_log: ReadLog) -> None:
    log = csv({("time", "s"): TIME, ("T", "degC"): WARMING, ("force", "N"): FORCE})
    (record,) = read_log(log, "run.csv", f'ignore = ["{left_out}"]')
    assert set(record.channels) == {"force"}


def test_a_frame_with_a_temperature_has_one_clock() -> None:
    record = Recording.from_frame(frame({("T", "degC"): WARMING, ("time", "s"): TIME, ("force", "N"): FORCE}))
    assert (record.dt, set(record.channels)) == (1.0 / 400.0, {"temperature", "force"})


@pytest.mark.parametrize(
    ("name", "unit", "is_time"),
    [
        ("T", "degC", False),
        ("T", "s", True),
        ("t", "ms", True),
        ("Time", None, True),
        ("time", "ticks", True),
        ("t", "mm", False),
        # a word of time is one whatever its unit, which is then asked for
        ("time", "Min", True),
        ("temperature", "s", False),
    ],
)
def test_a_name_counts_unless_its_unit_is_of_another_quantity(name: str, unit: str | None, is_time: bool) -> None:
    assert is_called_time(name, unit) is is_time
