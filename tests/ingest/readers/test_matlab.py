import io
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from mrfit.ingest.readers.matlab import is_version_4
from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import DT, matlab, matlab_seven_three, seven_three, signals


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
    assert set(record.channels) == {"force", "current"}
    assert [f.kind for f in record.findings if f.kind.startswith("unit")] == ["unit-assumed"] * 2


@pytest.mark.parametrize("word", ["units", "unit"])
def test_units_in_a_struct_of_their_own(word: str, read_log: ReadLog) -> None:
    time, one, two = signals()
    texts = {"t": "ms", "Force": "kN", "Current": "mA"}
    data = _mat({"run": {"t": 1e3 * time, "Force": one, "Current": two, word: texts}})
    (record,) = read_log(data, "run.mat")
    assert record.dt == pytest.approx(DT) and record.units == {"force": "N", "current": "A"}
    np.testing.assert_allclose(record.channels["force"], 1e3 * one)
    np.testing.assert_allclose(record.channels["current"], 1e-3 * two)


def test_structures_with_time_one_for_each_signal(read_log: ReadLog) -> None:
    time, one, two = signals()
    kept = {
        name: {"time": time, "signals": {"values": values, "label": label}}
        for name, values, label in (("out1", one, "Stroke (mm)"), ("out2", two, "Force (kN)"))
    }
    (record,) = read_log(_mat(kept), "run.mat")
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * one)
    np.testing.assert_allclose(record.channels["force"], 1e3 * two)


def test_a_structure_with_time_of_simulink(read_log: ReadLog) -> None:
    time, one, two = signals()
    kept = {"time": time, "signals": _struct_array(label=["Force (kN)", "Current (A)"], values=[one, two])}
    (record,) = read_log(_mat({"ScopeData": kept}), "run.mat")
    np.testing.assert_allclose(record.channels["force"], 1e3 * one)


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


ROOT = '"Model Root"/"Rig"/'


def _struct_array(**fields: list[object]) -> np.ndarray[Any, Any]:
    made = np.empty(len(next(iter(fields.values()))), dtype=[(name, object) for name in fields])
    for name, values in fields.items():
        for k, value in enumerate(values):
            made[name][k] = value
    return made


def test_control_desk_capture_with_two_rasters(read_log: ReadLog) -> None:
    """As public scripts take ControlDesk files apart: row vectors, paths with ports or \\signal names, axes in X(k)."""
    time, one, two = signals()
    rows = {"Type": ["", ""], "Data": [time[None, :], time[None, ::4]], "Raster": ["HostService", "Slow"]}
    y = _struct_array(
        Name=[ROOT + '"force"/"Out1"', "Model Root/mr/IO1/scale\\current", ROOT + '"temperature"/"Out1"'],
        Unit=["N", "A", "°C"],
        Data=[one[None, :], two[None, :], 20.0 + two[None, ::4]],
        Raster=["HostService", "HostService", "Slow"],
    )
    capture = {"SamplingPeriod": DT, "Downsampling": 1.0}
    data = _mat({"exp1_028": {"X": _struct_array(**rows), "Y": y, "Capture": capture, "RTProgram": "rig.sdf"}})
    fast, slow = read_log(data, "exp1_028.mat")
    assert (fast.dt, slow.dt) == (pytest.approx(DT), pytest.approx(4 * DT))
    assert fast.units == {"force": "N", "current": "A"} and slow.units == {"temperature": "degC"}
    np.testing.assert_allclose(fast.channels["current"], two)


def test_control_desk_axis_by_index_where_lengths_are_equal(read_log: ReadLog) -> None:
    time, one, two = signals()
    x = _struct_array(Data=[time, 2.0 * time])
    y = _struct_array(Name=["force", "force"], Data=[one, two], XIndex=[1.0, 2.0], Unit=["N", "N"])
    first, second = read_log(_mat({"rec": {"X": x, "Y": y}}), "rec.mat")
    assert (first.dt, second.dt) == (pytest.approx(DT), pytest.approx(2 * DT))
    np.testing.assert_allclose(second.channels["force"], two)


def test_control_desk_interval_from_the_capture(read_log: ReadLog) -> None:
    _, one, two = signals()
    y = _struct_array(Name=[ROOT + '"measDsp"', ROOT + '"measFrc"'], Data=[one, two])
    capture = {"SamplingPeriod": 1e-4, "Downsampling": 5.0}
    data = _mat({"test": {"X": {"Name": "", "Data": np.empty(0)}, "Y": y, "Capture": capture}})
    (record,) = read_log(data, "test.mat")
    assert record.dt == pytest.approx(5e-4) and list(record.channels) == ["measdsp", "measfrc"]


def test_two_signals_of_one_name_are_both_kept(read_log: ReadLog) -> None:
    time, one, two = signals()
    y = _struct_array(Name=["Root/left/m", "Root/right/m"], Data=[one, two])
    (record,) = read_log(_mat({"rec": {"X": {"Data": time}, "Y": y}, "gains": np.arange(4.0)}), "rec.mat")
    assert list(record.channels) == ["m", "right.m"]
    assert any(f.kind == "not-read" and "'gains'" in f.text for f in record.findings)


def test_simulink_structure_with_time(read_log: ReadLog) -> None:
    """time, and signals(k) with values and label, as To Workspace and Scope blocks save."""
    time, one, two = signals()
    both = _struct_array(values=[one[:, None], np.column_stack([two, one])], dimensions=[1.0, 2.0], label=["Load", ""])
    (record,) = read_log(_mat({"ScopeData": {"time": time, "signals": both, "blockName": "rig/Scope"}}), "run.mat")
    assert record.dt == pytest.approx(DT)
    assert len(record.channels) == 3
    np.testing.assert_allclose(record.channels["force"], one)


def test_version_seven_three_capture_with_references(read_log: ReadLog) -> None:
    """A struct array in version 7.3: fields of references into #refs#, without a MATLAB_class of their own."""
    _, one, _ = signals()
    made = matlab_seven_three()
    (record,) = read_log(made.data, made.name)
    assert record.units == {"force": "N", "current": "A"} and record.dt == pytest.approx(DT)
    np.testing.assert_allclose(record.channels["force"], 1e3 * one)


def test_version_seven_three(read_log: ReadLog) -> None:
    time, one, _ = signals()

    def fill(file: Any) -> None:
        for name, values in (("time", time), ("force", one)):
            file.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        file.create_dataset("note", data=np.arange(5, dtype=np.uint16)).attrs["MATLAB_class"] = np.bytes_("char")
        file.create_dataset("#refs#/a", data=np.arange(9.0))

    (record,) = read_log(seven_three(fill), "run.mat")
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


@pytest.mark.parametrize("rate", ["500 Hz", "2 ms", "fast"])
def test_a_rate_as_a_text(rate: str, read_log: ReadLog) -> None:
    name = "dt" if "ms" in rate else "SampleRate"
    data = _mat({"force": signals()[1], name: rate})
    if rate == "fast":
        with pytest.raises(Refusal, match="no sample rate"):
            read_log(data, "run.mat")
        return
    assert read_log(data, "run.mat")[0].dt == pytest.approx(0.002)


def _cell(*texts: str) -> np.ndarray[Any, Any]:
    return np.array(texts, dtype=object)


@pytest.mark.parametrize("within", [False, True])
def test_column_headers_beside_a_matrix(within: bool, read_log: ReadLog) -> None:
    """As importdata returns them, or saved beside the matrix."""
    time, one, two = signals()
    heads = _cell("Time (s)", "Displacement (mm)", "Force (kN)")[None, :]
    variables = {"data": np.column_stack([time, one, two]), "colheaders": heads, "textdata": heads}
    (record,) = read_log(_mat({"importdata": variables} if within else variables), "run.mat")
    assert record.dt == pytest.approx(DT)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * one)
    np.testing.assert_allclose(record.channels["force"], 1e3 * two)


@pytest.mark.parametrize("labels", [_cell("Displacement", "Force"), np.array(["Displacement", "Force       "])])
def test_labels_and_units_beside_a_matrix(labels: np.ndarray[Any, Any], read_log: ReadLog) -> None:
    _, one, two = signals()
    variables = {"data": np.column_stack([one, two]), "labels": labels, "units": _cell("mm", "kN"), "Fs": 2048.0}
    (record,) = read_log(_mat(variables), "run.mat")
    np.testing.assert_allclose(record.channels["force"], 1e3 * two)
    assert record.dt == 1.0 / 2048.0
    chosen = '[channels]\nforce = {column = "data[0]", unit = "N"}\n'
    np.testing.assert_allclose(read_log(_mat(variables), "run.mat", chosen)[0].channels["force"], one)


@pytest.mark.parametrize("timed", [False, True])
def test_an_export_of_catman(timed: bool, read_log: ReadLog) -> None:
    time, one, two = signals()
    channels = [("Weg", "mm", one), ("Kraft", "kN", two), *([("Zeit 1", "s", time)] if timed else [])]
    variables: dict[str, object] = {"File_Header": {"NumberOfChannels": "2", "SampleFrequency": "1200"}}
    for k, (name, unit, values) in enumerate(channels):
        variables[f"Channel_{k}_Data"] = values[:, None]
        variables[f"Channel_{k}_Header"] = {
            "SampleFrequency": "1200",
            "Unit": unit,
            "SignalName": name,
            "NoValues": 9.0,
        }
    (record,) = read_log(_mat(variables), "run.mat")
    assert set(record.channels) == {"displacement", "force"}
    assert record.dt == pytest.approx(DT if timed else 1.0 / 1200.0)
    np.testing.assert_allclose(record.channels["force"], 1e3 * two)


def test_elements_of_a_struct_array_are_tests(read_log: ReadLog) -> None:
    time, one, _ = signals()
    times = [time[:60], time[:90]]
    tests = _struct_array(time_s=times, force_N=[one[:60], one[:90]], current_A=[0.5, 1.0], note=["", ""])
    first, second = read_log(_mat({"tests": tests}), "run.mat")
    assert (first.samples, second.samples) == (60, 90)
    assert (first.condition, second.condition) == ({"current": 0.5}, {"current": 1.0})
    assert (first.history[1], second.history[1]) == ("test 'tests[0]' of the file", "test 'tests[1]' of the file")


def test_structs_of_one_length_are_tests_where_they_are_called_so(read_log: ReadLog) -> None:
    time, one, two = signals()
    pair = {f"{{}}_{k}": {"t_s": time, "x_mm": one, "F_N": (k + 1.0) * two} for k in (0, 1)}
    records = read_log(_mat({name.format("test"): fields for name, fields in pair.items()}), "run.mat")
    assert [set(r.channels) for r in records] == [{"displacement", "force"}] * 2
    np.testing.assert_allclose(records[1].channels["force"], 2.0 * two)
    assert len(read_log(_mat({name.format("side"): fields for name, fields in pair.items()}), "run.mat")) == 1


def test_version_four(read_log: ReadLog) -> None:
    buffer = io.BytesIO()
    _, one, two = signals()
    savemat(buffer, {"disp_mm": one, "force_N": two, "fs": 500.0}, format="4")
    (record,) = read_log(buffer.getvalue(), "run.mat")
    assert record.dt == 0.002 and set(record.channels) == {"displacement", "force"}
    with pytest.raises(Refusal):
        read_log(buffer.getvalue()[:200], "run.mat")


@pytest.mark.parametrize("place", [0, 6, 12, 16, 21])
def test_other_bytes_are_no_version_four(place: int) -> None:
    header = np.array([0, 50, 1, 0, 3], dtype="<i4").tobytes() + b"fs\0" + bytes(400)
    big = np.array([1000, 50, 1, 0, 3], dtype=">i4").tobytes() + b"fs\0"
    assert is_version_4(header) and is_version_4(big) and not is_version_4(header[:10])
    assert not is_version_4(header[:place] + b"\xff\xff" + header[place + 2 :])
