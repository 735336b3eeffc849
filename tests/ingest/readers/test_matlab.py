import io
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

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
