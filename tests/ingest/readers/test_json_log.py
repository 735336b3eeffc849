import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.errors import DataError
from mrfit.ingest.dispatch import expand
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings, read

TIME = np.arange(40) * 0.002
FORCE, TRAVEL = np.round(1e3 * np.sin(60.0 * TIME), 3), np.round(5.0 * np.cos(60.0 * TIME), 4)
RECORDS = [{"t": t, "force": f, "x": x} for t, f, x in zip(TIME, FORCE, TRAVEL, strict=True)]
SPLIT = [list(row) for row in zip(TIME, FORCE, TRAVEL, strict=True)]
NAMED = {"force": list(FORCE), "x": list(TRAVEL)}
UNITS = {"force": "N", "x": "mm"}

FORMS: dict[str, Callable[[], Any]] = {
    "arrays": lambda: {"dt": 0.002, "units": UNITS, **NAMED},
    "rate": lambda: {"fs": 500, "units": UNITS, **NAMED},
    "rate with unit": lambda: {"sample_rate": {"value": 0.5, "unit": "kHz"}, "units": UNITS, **NAMED},
    "interval as text": lambda: {"dt": "2 ms", "units": UNITS, **NAMED},
    "interval with unit": lambda: {"dt (ms)": 2, "units": UNITS, **NAMED},
    "unit beside": lambda: {"dt": 2, "dt_unit": "ms", "units": UNITS, **NAMED},
    "unit of a rate beside": lambda: {"rate": 0.5, "rate_units": "kHz", "units": UNITS, **NAMED},
    "unit among units": lambda: {"dt": 2, "units": {**UNITS, "dt": "ms"}, **NAMED},
    "time array": lambda: {"time": list(TIME), "units": UNITS, **NAMED},
    "inside": lambda: {"test": "7", "log": {"dt": 0.002, "units": UNITS, "channels": NAMED}},
    "channels with units": lambda: {
        "dt": 0.002,
        "channels": {n: {"unit": UNITS[n], "values": values} for n, values in NAMED.items()},
    },
    "list of channels": lambda: {
        "dt": 0.002,
        "channels": [{"name": n, "unit": UNITS[n], "data": values} for n, values in NAMED.items()],
    },
    "records": lambda: [{"t": r["t"], "force (N)": r["force"], "x (mm)": r["x"]} for r in RECORDS],
    "split": lambda: {"columns": ["t", "force", "x"], "data": SPLIT, "units": UNITS},
    "columns of pandas": lambda: {
        "t": {str(k): v for k, v in enumerate(TIME)},
        "force (N)": {str(k): v for k, v in enumerate(FORCE)},
        "x (mm)": {str(k): v for k, v in enumerate(TRAVEL)},
    },
}


@pytest.mark.parametrize("form", FORMS)
def test_every_way_to_write_a_log_gives_the_same(form: str, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text(json.dumps(FORMS[form]()))
    (recording,) = read([tmp_path / "run.json"], Settings()).recordings
    assert recording.reader == "json-log" and recording.dt == pytest.approx(0.002)
    np.testing.assert_allclose(recording.channels["force"], FORCE, atol=1e-9)
    np.testing.assert_allclose(recording.channels["displacement"], TRAVEL / 1e3, atol=1e-12)


@pytest.mark.parametrize("step", [5, 0])
def test_stamps_are_times_where_they_rise(step: int, tmp_path: Path) -> None:
    rows = [{"ts": 1710412522000 + step * k, "force_N": f} for k, f in enumerate(FORCE.tolist())]
    (tmp_path / "run.json").write_text("\n".join(map(json.dumps, rows)))
    if step:
        (recording,) = read([tmp_path / "run.json"], Settings()).recordings
        assert recording.dt == pytest.approx(5e-3)
    else:
        with pytest.raises(DataError, match="no time column"):
            read([tmp_path / "run.json"], Settings())


def test_a_record_on_each_line_and_null_are_read(tmp_path: Path) -> None:
    rows = [dict(r, force=None) if k == 7 else r for k, r in enumerate(RECORDS)]
    (tmp_path / "run.json").write_text("\n".join(json.dumps(r) for r in rows))
    (recording,) = read([tmp_path / "run.json"], Settings()).recordings
    assert recording.rows_refused == 1 or recording.rows_kept == len(rows)
    assert recording.channels["force"][3] == pytest.approx(FORCE[3])


def test_several_runs_and_their_conditions_are_read(tmp_path: Path) -> None:
    runs = [{"dt": 0.002, "condition": {"current": i}, "units": UNITS, **NAMED} for i in (0.5, 1.0)]
    (tmp_path / "run.json").write_text(json.dumps(runs))
    recordings = read([tmp_path / "run.json"], Settings()).recordings
    assert [r.condition["current"] for r in recordings] == [0.5, 1.0]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('{"name": "x", "list": ["a", "b"]}', "no array of numbers"),
        ('{"a": [1, 2, 3], "b": [1, 2]}', "several lengths (a 3, b 2)"),
        ('{"a": [1, 2, 3', "damaged JSON"),
        ('{"a": ' + "[" * 100_000, "too deep"),
        ('{"a": [1' + "0" * 400 + ", 2]}", "no array of numbers"),
        ('{"a": [1]}', "hold 1 value"),
    ],
)
def test_what_is_no_log_is_refused_with_the_reason(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "odd.json").write_text(text)
    with pytest.raises(Refusal, match=reason.replace("(", r"\(").replace(")", r"\)")):
        read([tmp_path / "odd.json"], Settings())


def _with_units(unit: str = "N") -> list[dict[str, Any]]:
    units_of = {"t": "s", "force": "N", "x": "mm"}
    rows = [{n: {"value": v, "unit": units_of[n]} for n, v in record.items()} for record in RECORDS]
    rows[3]["force"]["unit"] = unit
    return rows


SAMPLES = [{"type": "sample", "n": k, "force": r["force"], "x": r["x"]} for k, r in enumerate(RECORDS)]
HEADER = {"type": "header", "rate": 500, "units": UNITS}
LONG = [{"t": r["t"], "ch": n, "v": r[n], "unit": UNITS[n]} for r in RECORDS for n in ("force", "x")]
NESTED = [{"t": r["t"], "rig": {"force_N": r["force"], "x_mm": r["x"]}} for r in RECORDS]
MORE_FORMS: dict[str, tuple[Any, ...]] = {
    "records with units": (_with_units(),),
    "a header record": (HEADER, *SAMPLES),
    "two header records": ({"version": 3}, HEADER, *SAMPLES),
    "a row for each channel and time": (LONG,),
    "objects in records": (NESTED,),
    "metadata beside the data": (
        {"metadata": {"sampling_frequency": {"value": 500, "unit": "Hz"}, "units": UNITS}, "data": NAMED},
    ),
    "units beside the arrays": ({"dt_ms": 2, "force_unit": "N", "x_units": "mm", **NAMED},),
    "header and rows": ({"header": ["t", "force (N)", "x (mm)"], "rows": SPLIT},),
}


@pytest.mark.parametrize("form", MORE_FORMS)
def test_objects_tell_of_the_numbers_beside_them(form: str, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text("\n".join(json.dumps(one) for one in MORE_FORMS[form]))
    (recording,) = read([tmp_path / "run.json"], Settings()).recordings
    assert recording.dt == pytest.approx(0.002)
    np.testing.assert_allclose(recording.channels["force"], FORCE, atol=1e-9)
    np.testing.assert_allclose(recording.channels["displacement"], TRAVEL / 1e3, atol=1e-12)


def test_units_that_change_from_record_to_record_are_no_unit(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text(json.dumps(_with_units("kN")))
    (recording,) = read([tmp_path / "run.json"], Settings()).recordings
    assert "unknown-unit" in {f.kind for f in recording.findings} and "force" not in recording.channels


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"fs": 500, "dt_ms": 5, **NAMED}, "fs = 500 and dt_ms = 5 ms: not used"),
        ({"camera": {"fs": 30}, **NAMED}, "camera.fs = 30: not used"),
        ([HEADER | {"force": 1.0}, *SAMPLES], "no sample rate"),
    ],
)
def test_a_rate_in_doubt_is_not_used(content: Any, said: str, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text(json.dumps(content))
    with pytest.raises(Refusal, match=f"{said}|no array of numbers"):
        read([tmp_path / "run.json"], Settings())


def test_runs_say_where_in_the_file_they_are(tmp_path: Path) -> None:
    runs = {name: {"dt": 0.002, "units": UNITS, **NAMED} for name in ("b", "a")} | {"peaks": {"force": [1.0, 2.0]}}
    (tmp_path / "run.json").write_text(json.dumps({"log": runs}))
    recordings = read([tmp_path / "run.json"], Settings()).recordings
    assert [r.history[1] for r in recordings] == ["run 'log.b' of the file", "run 'log.a' of the file"]
    assert any(f.kind == "not-read" for f in recordings[0].findings)


@pytest.mark.parametrize("form", FORMS)
def test_a_folders_logs_are_read_and_its_settings_are_not(form: str, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text(json.dumps(FORMS[form]()))
    (tmp_path / "settings.json").write_text('{"rate": 500, "limits": [0, 10], "operator": "x"}')
    assert [file.name for file, _ in expand([tmp_path])] == ["run.json"]


@pytest.mark.parametrize("stamp", ["2026-11-28T10:00:{:06.3f}Z", "10:00:{:06.3f}"])
def test_records_with_dates_or_times_of_day(stamp: str, tmp_path: Path) -> None:
    one = [{"ts": stamp.format(3 + 2e-3 * k), "load": {"v": 0.1 * k, "u": "kN"}} for k in range(400)]
    (tmp_path / "run.json").write_text(json.dumps(one))
    (record,) = read([tmp_path / "run.json"], Settings()).recordings
    assert record.dt == pytest.approx(2e-3)
    assert record.channels["force"][-1] == pytest.approx(100.0 * 399)
    (tmp_path / "run.json").write_text(json.dumps([{**r, "ts": "start"} for r in one]))
    with pytest.raises(DataError, match="no time column"):
        read([tmp_path / "run.json"], Settings())


def test_records_by_their_number(tmp_path: Path) -> None:
    one = {str(k): {"time_s": 2e-3 * k, "force_N": float(k % 7)} for k in range(400)}
    (tmp_path / "run.json").write_text(json.dumps(one))
    (record,) = read([tmp_path / "run.json"], Settings()).recordings
    assert record.dt == pytest.approx(2e-3) and list(record.channels) == ["force"]


def test_channels_by_number_are_no_records(tmp_path: Path) -> None:
    numbered = {"1": NAMED["x"], "2": NAMED["force"]}
    channels = {n: {"name": "a", "data": data} for n, data in numbered.items()}
    for key, inside in {"data": numbered, "channels": channels}.items():
        (tmp_path / "run.json").write_text(json.dumps({"dt": 0.002, key: inside}))
        (recording,) = read([tmp_path / "run.json"], Settings()).recordings
        assert list(recording.channels) == ["1", "2"]
        np.testing.assert_allclose(recording.channels["2"], FORCE, atol=1e-9)


def test_runs_by_number_keep_it(tmp_path: Path) -> None:
    runs = {str(k): {"dt": 0.002, "units": UNITS, **NAMED} for k in (1, 2)}
    (tmp_path / "run.json").write_text(json.dumps({"tests": runs}))
    recordings = read([tmp_path / "run.json"], Settings()).recordings
    assert [r.history[1] for r in recordings] == ["run 'tests.1' of the file", "run 'tests.2' of the file"]


def _as_texts_are_sorted(values: list[Any], step: int = 1, first: int = 0) -> dict[str, Any]:
    return dict(sorted((str(first + step * k), value) for k, value in enumerate(values)))


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("by_column", [True, False])
def test_rows_by_number_are_read_in_its_order(by_column: bool, first: int, tmp_path: Path) -> None:
    columns = {n: _as_texts_are_sorted(values, first=first) for n, values in NAMED.items()}
    inside = columns if by_column else {"log": _as_texts_are_sorted(RECORDS, first=first)}
    (tmp_path / "run.json").write_text(json.dumps({"dt": 0.002, "units": UNITS, **inside}))
    (recording,) = read([tmp_path / "run.json"], Settings()).recordings
    np.testing.assert_allclose(recording.channels["force"], FORCE, atol=1e-9)


def test_numbers_that_do_not_count_the_rows_take_no_rate(tmp_path: Path) -> None:
    columns = {n: _as_texts_are_sorted(values, 10) for n, values in NAMED.items()}
    records = [{n: r[n] for n in NAMED} for r in RECORDS]
    for inside, said in ((columns, "do not count the rows"), ({"log": _as_texts_are_sorted(records, 10)}, "no array")):
        (tmp_path / "run.json").write_text(json.dumps({"dt": 0.002, **inside}))
        with pytest.raises(Refusal, match=said):
            read([tmp_path / "run.json"], Settings())
    columns["t"] = _as_texts_are_sorted(list(TIME), 10)
    (tmp_path / "run.json").write_text(json.dumps({"dt": 5.0, **columns, "stages": {"10": "a", "20": "b"}}))
    (recording,) = read([tmp_path / "run.json"], Settings()).recordings
    assert recording.dt == pytest.approx(0.002)
    np.testing.assert_allclose(recording.channels["force"], FORCE, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "form", "is_time"),
    [
        ("mix", "1:2:{}", False),
        ("mix", "01:02:01", False),
        ("made", "2026-11-28T10:00:01Z", False),
        ("made", "2026-13-28T10:00:{:02d}Z", False),
        ("time", "1:02:{:02d}", True),
        ("rig.clock", "9:02:{:02d}", True),
        ("seen", "09:02:{:02d}", True),
        ("seen", "9:02:{:02d} AM", True),
    ],
)
def test_texts_are_times_where_their_name_or_form_says_so(name: str, form: str, is_time: bool, tmp_path: Path) -> None:
    records = [{name: form.format(k), "force": r["force"]} for k, r in enumerate(RECORDS)]
    (tmp_path / "run.json").write_text(json.dumps({"dt": 0.002, "units": UNITS, "rows": records}))
    (recording,) = read([tmp_path / "run.json"], Settings()).recordings
    assert recording.dt == pytest.approx(1.0 if is_time else 0.002)


values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4),
    max_leaves=30,
)


@settings(max_examples=40, deadline=None)
@given(st.dictionaries(st.sampled_from(["a", "dt", "units", "data", "columns", "condition", "t"]), values, min_size=1))
def test_whatever_stands_in_it_is_a_log_or_a_refusal(tmp_path_factory: pytest.TempPathFactory, content: Any) -> None:
    path = tmp_path_factory.mktemp("odd") / "odd.json"
    path.write_text(json.dumps(content))
    try:
        recordings = read([path], Settings()).recordings
    except DataError as error:
        assert "a fault of" not in str(error)
    else:
        assert recordings
