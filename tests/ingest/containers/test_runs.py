from pathlib import Path

import numpy as np
import pytest

from mrfit.ingest.containers.arrays import Arrays, tables_of
from mrfit.ingest.containers.runs import conditions_in, in_order, is_of_results, only_logs, split_in_tests
from mrfit.ingest.meaning.channel_map import ChannelRule, Rules, TimeRule
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.head import Head


def _source(rules: Rules | None = None) -> Source:
    return Source(Head(Path("run.h5"), 0, b"", "", ()), rules or Rules())


def _arrays(lengths: dict[str, int], leaves: tuple[str, ...] = ("disp", "force")) -> Arrays:
    names = {f"{group}.{leaf}": size for group, size in lengths.items() for leaf in leaves}
    return Arrays({name: np.arange(float(size)) for name, size in names.items()})


@pytest.mark.parametrize(
    ("groups", "leaves", "tests"),
    [
        ({"run_01": 70, "run_02": 90}, ("disp", "force"), ["run_01", "run_02"]),
        ({"test_0A": 70, "test_1A": 70}, ("t_s", "x_mm", "F_N"), ["test_0A", "test_1A"]),
        ({"tests[0]": 70, "tests[1]": 70}, ("time_s", "disp_mm"), ["tests[0]", "tests[1]"]),
        ({"low": 70, "high": 90}, ("force",), ["low", "high"]),
        ({"run_10": 70, "run_2": 70}, ("ai0", "ai1"), ["run_2", "run_10"]),
        # of one length, and not called tests: sensors, or raw and filtered
        ({"raw": 70, "filtered": 70}, ("disp", "force"), []),
        # a signal with its time each, as Simulink keeps them
        ({"displacement": 70, "force": 90}, ("Time", "Data"), []),
        ({"meas_disp": 70, "meas_force": 70}, ("time", "value", "quality"), []),
    ],
)
def test_groups_with_arrays_of_the_same_names_are_tests(
    groups: dict[str, int], leaves: tuple[str, ...], tests: list[str]
) -> None:
    arrays = _arrays(groups, leaves)
    assert list(split_in_tests(list(arrays.signals), {n: len(v) for n, v in arrays.signals.items()})) == tests


def test_tests_come_in_the_order_of_the_file_each_with_its_name_and_condition() -> None:
    arrays = _arrays({"run_01": 70, "run_02": 90})
    arrays.scalars = {"run_01.current_A": 0.5, "run_02.current_A": 1.0, "run_01.dt": 0.1, "run_02.dt": 0.2}
    first, second = tables_of(arrays, _source())
    assert [(t.rows, t.dt, dict(t.condition)) for t in (first, second)] == [
        (70, 0.1, {"current": 0.5}),
        (90, 0.2, {"current": 1.0}),
    ]
    assert (first.history, second.history) == (("test 'run_01' of the file",), ("test 'run_02' of the file",))
    assert [c.name for c in second.columns] == ["disp", "force"]
    assert [f.text for f in first.findings] == [
        "the file holds, in the order of the recordings: test 'run_01', test 'run_02'"
    ]


def test_a_rate_of_the_file_holds_for_each_test_and_one_that_differs_is_said() -> None:
    arrays = _arrays({"run_01": 70, "run_02": 90})
    arrays.scalars = {".fs": 10.0, "run_02.fs": 20.0}
    first, second = tables_of(arrays, _source())
    assert first.dt == pytest.approx(0.1) and second.dt is None
    assert [f.text for f in second.findings] == ["the file states fs = 10 and fs = 20: not used"]


def test_times_beside_the_tests_are_their_clock() -> None:
    arrays = _arrays({"test_1": 70, "test_2": 70})
    arrays.signals["time"] = 0.1 * np.arange(70.0)
    tables = tables_of(arrays, _source())
    assert [t.time is not None and t.time.name for t in tables] == ["time", "time"]


@pytest.mark.parametrize("rules", [Rules(time=TimeRule(column="test_1.t")), Rules(channels={"force": None})])
def test_arrays_that_a_map_calls_by_their_paths_keep_them(rules: Rules) -> None:
    if rules.channels:
        rules = Rules(channels={"force": ChannelRule(column="test_1.force")})
    arrays = _arrays({"test_1": 70, "test_2": 70}, ("t", "force"))
    (table,) = tables_of(arrays, _source(rules))
    assert {c.name for c in table.columns} >= {"test_1.force", "test_2.force"}


@pytest.mark.parametrize(
    ("told", "found"),
    [
        ({"current_A": 0.5}, {"current": 0.5}),
        (
            {"current_mA": 500.0, "frequency_Hz": 2.0, "amplitude_mm": 5.0},
            {"current": 0.5, "frequency": 2, "amplitude": 0.005},
        ),
        ({"Temperature (°C)": 40.0}, {"temperature": 40.0}),
        ({"current": 0.5, "force_N": 3.0, "number": 2.0, "current_N": 1.0, "current_mA": np.nan}, {}),
    ],
)
def test_numbers_of_a_test_with_a_unit_are_conditions(told: dict[str, float], found: dict[str, float]) -> None:
    assert conditions_in(told, {}) == pytest.approx(found)


def test_a_condition_that_is_stated_twice_is_none() -> None:
    assert conditions_in({"current_A": 2.0, "current_mA": 500.0}, {}) == {}
    assert conditions_in({"current_A": 2.0, "current_mA": 2000.0}, {}) == {"current": 2.0}


def test_names_that_differ_in_a_number_come_by_it() -> None:
    assert in_order(["run10", "run9", "run1"]) == ["run1", "run9", "run10"]
    assert in_order(["b10", "a9"]) == ["b10", "a9"]


def _table(rows: int, dt: float | None = None, timed: bool = False) -> Table:
    column = Column("peak", "N", np.zeros(rows), 0)
    clock = Column("time", "s", np.arange(float(rows)), 1) if timed else None
    return Table((column,), np.arange(1, rows + 1), time=clock, dt=dt)


@pytest.mark.parametrize(
    ("tables", "rows"),
    [
        ([_table(3), _table(900, timed=True)], [900]),
        ([_table(900, timed=True), _table(900)], [900]),
        ([_table(3, dt=0.1), _table(900, dt=0.1)], [900]),
        # a slow channel states its own rate, and times of its own are a clock
        ([_table(20, dt=1.0), _table(900, dt=0.1)], [20, 900]),
        ([_table(3, timed=True), _table(900, timed=True)], [3, 900]),
        ([_table(100, dt=0.1), _table(900, dt=0.1)], [100, 900]),
        ([_table(3), _table(900)], [3, 900]),
    ],
)
def test_tables_that_cannot_be_logs_are_left_out_beside_those_that_can(tables: list[Table], rows: list[int]) -> None:
    logs = only_logs(tables, _source())
    assert [t.rows for t in logs] == rows
    assert ("not-read" in {f.kind for f in logs[0].findings}) == (len(rows) < len(tables))


@pytest.mark.parametrize(
    ("rows", "dt", "of_log", "results"),
    [
        (15, 0.1, 0.002, False),  # a slow channel, with a rate of its own
        (15, 0.002, 0.002, True),
        (15, 0.002, None, True),  # the log has times
        (60, 0.002, 0.002, False),
        (60, None, 0.002, True),
        (201, None, 0.002, False),
    ],
)
def test_a_small_table_beside_a_log(rows: int, dt: float | None, of_log: float | None, results: bool) -> None:
    table, log = (Table((), np.arange(1, n + 1), dt=interval) for n, interval in ((rows, dt), (3000, of_log)))
    assert is_of_results(table, log) is results
    assert not is_of_results(log, log)
