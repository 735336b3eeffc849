from pathlib import Path

import numpy as np
import pytest

from mrfit.ingest.containers.arrays import Arrays, tables_of
from mrfit.ingest.meaning.channel_map import Rules, TimeRule
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source
from mrfit.ingest.text.head import Head

TIME = np.arange(50) * 0.01


def _source(time: TimeRule | None = None) -> Source:
    return Source(Head(Path("run.mat"), 0, b"", "", ()), Rules(time=time))


def test_time_vector_by_name_and_matrices_by_column() -> None:
    arrays = Arrays()
    arrays.add("Tout", TIME[:, None])
    arrays.add("x", np.column_stack([TIME, 2 * TIME]))
    arrays.add("rows", np.vstack([TIME, 3 * TIME]))
    arrays.add("gain", 4.0)
    arrays.add("note", np.array(["a", "b"]))
    (table,) = tables_of(arrays, _source())
    assert table.time is not None and table.time.name == "Tout"
    assert [c.name for c in table.columns] == ["x[0]", "x[1]", "rows[0]", "rows[1]"]
    assert arrays.scalars == {"gain": 4.0}


def test_arrays_of_other_lengths_than_the_time_are_said() -> None:
    arrays = Arrays()
    arrays.add("time", TIME)
    arrays.add("force", TIME)
    arrays.add("window", np.arange(7))
    (table,) = tables_of(arrays, _source())
    assert [c.name for c in table.columns] == ["force"]
    assert "'window' (7)" in table.findings[0].text


def test_every_length_is_a_run_where_none_has_a_time() -> None:
    arrays = Arrays()
    for name, size in (("U", 2000), ("Y", 2000), ("U_val", 1499), ("Y_val", 1499)):
        arrays.add(name, np.zeros(size))
    arrays.add("Ts", 0.005)
    tables = tables_of(arrays, _source())
    assert [(t.rows, t.dt) for t in tables] == [(2000, 0.005), (1499, 0.005)]


def test_rate_scalar_and_time_from_the_map() -> None:
    arrays = Arrays()
    arrays.add("ticks", TIME)
    arrays.add("force", TIME)
    arrays.add("fs", 100.0)
    assert tables_of(arrays, _source())[0].dt == pytest.approx(0.01)
    (table,) = tables_of(arrays, _source(TimeRule(column="ticks")))
    assert table.time is not None and table.time.name == "ticks"


@pytest.mark.parametrize(
    ("scalars", "dt", "said"),
    [
        ({"dt": 5.0, "dt_unit": "ms"}, 0.005, ""),
        ({"fs": 0.2, "fs_units": "kHz"}, 0.005, ""),
        ({"fs": 0.2, "fs_units": "kS/s"}, 0.005, ""),
        ({"fs": 200.0, "fs_units": "samples/s"}, 0.005, ""),
        ({"Ts": 5e-3, "TsUnit": "s"}, 0.005, ""),
        ({"dt": 5.0, "dt.unit": "parsec"}, None, "dt = 5 parsec: not used"),
        # ms or kHz may be meant where the usual unit gives no rate of a log
        ({"Ts": 5.0}, None, "Ts = 5 without a unit: not used"),
        ({"fs": 0.2}, None, "fs = 0.2 without a unit: not used"),
        ({"Ts": 5.0, "Ts_unit": "s"}, 5.0, ""),
        ({"Ts": 1.0}, 1.0, ""),
    ],
)
def test_a_unit_beside_an_interval_is_its_own(scalars: dict[str, object], dt: float | None, said: str) -> None:
    arrays = Arrays()
    arrays.add("force", TIME)
    for name, value in scalars.items():
        arrays.add(name, value)
    (table,) = tables_of(arrays, _source())
    assert table.dt == (None if dt is None else pytest.approx(dt))
    assert said in " ".join(f.text for f in table.findings) and bool(said) <= bool(table.findings)


@pytest.mark.parametrize(
    ("name", "unit", "known"), [("force_kN", "N", False), ("force_N", "N", True), ("force", "kN", True)]
)
def test_units_that_contradict_are_both_said(name: str, unit: str, known: bool) -> None:
    arrays = Arrays()
    arrays.add("time", TIME)
    arrays.add(name, TIME, [unit])
    (column,) = tables_of(arrays, _source())[0].columns
    assert (column.unit == unit) == known and (known or column.unit == "kN or N")


@pytest.mark.parametrize("at", [20, 0])
def test_times_that_repeat_or_jump_are_still_times(at: int) -> None:
    """The time base knows what to do with them; a rate that the file states besides may be another one's."""
    arrays = Arrays()
    time = TIME.copy()
    time[25:] -= time[25] - time[at]
    time[24] = time[23]
    arrays.add("time", time)
    arrays.add("force", TIME)
    arrays.add("Ts", 0.1)
    (table,) = tables_of(arrays, _source())
    assert table.time is not None and table.dt is None
    assert [c.name for c in table.columns] == ["force"]


def test_a_name_alone_makes_no_time() -> None:
    arrays = Arrays()
    arrays.add("t", 20.0 + np.sin(np.arange(50)))  # a temperature
    arrays.add("dt", 0.1)
    (table,) = tables_of(arrays, _source())
    assert table.time is None and table.dt == 0.1


def test_no_vector_is_refused() -> None:
    arrays = Arrays()
    arrays.add("gain", 4.0)
    with pytest.raises(Refusal, match="no numeric array"):
        tables_of(arrays, _source())


@pytest.mark.parametrize(
    ("scalars", "dt"),
    [
        ({"fs": 500.0, "dt": 0.002}, 0.002),
        ({"fs": 3004.8, "dt": 0.0003328}, 1.0 / 3004.8),
        ({"fs": 500.0, "decimation": 1.0}, 0.002),
        ({"fs": 500.0, "dt": 0.01}, None),
        ({"sample_rate": 5000.0, "Decimation": 10.0}, None),
        ({"force.sample_rate": 500.0, "current.sample_rate": 1000.0}, None),
    ],
)
def test_a_rate_of_scalars_is_believed_where_nothing_speaks_against_it(
    scalars: dict[str, float], dt: float | None
) -> None:
    arrays = Arrays({"force": np.arange(9.0), "current": np.arange(9.0)}, scalars=scalars)
    (table,) = tables_of(arrays, _source())
    assert table.dt == (None if dt is None else pytest.approx(dt))
    assert [f.kind for f in table.findings] == ([] if dt else ["rate-unclear"])


def test_each_array_may_have_its_own_rate() -> None:
    arrays = Arrays({"force": np.arange(9.0), "current": np.arange(18.0)})
    arrays.scalars = {"force.fs": 500.0, "current.fs": 1000.0}
    assert [(t.rows, t.dt) for t in tables_of(arrays, _source())] == [(9, 2e-3), (18, 1e-3)]
