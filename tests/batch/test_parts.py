"""Plan, journal, parcel and table of a batch, each by itself."""

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from mrfit.batch.journal import Journal, read_journal, write_journal
from mrfit.batch.log import StageSettings, failed
from mrfit.batch.parcel import packed, put, returned, unpacked
from mrfit.batch.plan import inside, plan
from mrfit.batch.table import write
from mrfit.core.progress import silent
from mrfit.errors import DataError
from mrfit.fit.stage import Settings as FitSettings
from mrfit.flux.stage import Settings as FluxSettings
from mrfit.ingest.stage import Settings as IngestSettings
from mrfit.io.schemas.batch import Fitted, LogRow, OfCondition
from mrfit.io.schemas.fit import Covariance
from tests.batch.logs import write_log

ASKED = StageSettings(IngestSettings(), FluxSettings(), FitSettings("bingham"), report=False, sheet=False)


@pytest.fixture
def logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("b.csv", "a.csv", "inner/c.csv"):
        write_log(Path("logs") / name, 1)
    return Path("logs")


def test_logs_are_planned_in_the_order_of_their_names(logs: Path) -> None:
    found = plan(logs, "*", Path("w"), ASKED, False, silent)
    assert [j.name for j in found.jobs] == ["logs/a.csv", "logs/b.csv", "logs/inner/c.csv"]
    assert not found.refused and all(j.workspace is None for j in found.jobs)


def test_each_log_may_have_a_workspace_below_the_batch_s(logs: Path) -> None:
    found = plan(logs, "*", Path("w"), ASKED, True, silent)
    assert [str(j.workspace) for j in found.jobs] == ["w/logs/a.csv", "w/logs/b.csv", "w/logs/inner/c.csv"]


@pytest.mark.parametrize(
    ("like", "names"),
    [("A*", ["a.csv"]), ("a.csv, c.*", ["a.csv", "c.csv"]), ("*.csv", ["a.csv", "b.csv", "c.csv"])],
)
def test_patterns_choose_by_name_whatever_the_case(like: str, names: list[str], logs: Path) -> None:
    assert [Path(j.name).name for j in plan(logs, like, Path("w"), ASKED, False, silent).jobs] == names


def test_where_no_log_is_like_that_the_folder_and_the_pattern_are_named(logs: Path) -> None:
    with pytest.raises(DataError, match=r"logs: no log like \*\.txt in this folder; .* as \*\.csv"):
        plan(logs, "*.txt", Path("w"), ASKED, False, silent)


def test_what_lies_in_the_batch_s_own_folder_is_no_log(logs: Path) -> None:
    write_log(Path("logs/w/d.csv"), 1)
    assert len(plan(logs, "*", Path("other"), ASKED, False, silent).jobs) == 4
    assert len(plan(logs, "*", Path("logs/w"), ASKED, False, silent).jobs) == 3


def test_a_file_that_no_reader_takes_is_a_row_that_another_try_may_mend(logs: Path) -> None:
    (logs / "d.bin").write_bytes(bytes(range(256)) * 20)
    (row,) = plan(logs, "*", Path("w"), ASKED, False, silent).refused
    assert row.log == "logs/d.bin" and row.error and row.key == ""


def test_the_key_follows_content_and_settings_and_nothing_else(logs: Path) -> None:
    def keys(asked: StageSettings = ASKED, work: str = "w") -> list[str]:
        return [j.key for j in plan(logs, "*", Path(work), asked, False, silent).jobs]

    first = keys()
    assert keys(work="other") == first and len(set(first)) == 1
    other = StageSettings(IngestSettings(), FluxSettings(), FitSettings("bingham", seed=1), report=False, sheet=False)
    assert not set(keys(other)) & set(first)
    write_log(logs / "a.csv", 2)
    changed = keys()
    assert changed[0] != first[0] and changed[1:] == first[1:]


@pytest.mark.parametrize(
    ("name", "folder"),
    [
        ("logs/a.csv", "logs/a.csv"),
        ("./a.csv", "a.csv"),
        ("../other/a.csv", "__/other/a.csv"),
        ("/abs/a.csv", "abs/a.csv"),
    ],
)
def test_a_workspace_lies_below_the_batch_s_wherever_the_log_is(name: str, folder: str) -> None:
    assert inside(name) == Path(folder)


def row(name: str, **given: Any) -> LogRow:
    return LogRow(log=name, key="k", **given)


def test_the_last_row_of_a_log_holds_and_torn_lines_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "new" / "batch.jsonl"
    with Journal(path) as journal:
        journal.add(row("a", error="first"))
        journal.add(row("b"))
        journal.add(row("a"))
    path.write_bytes(path.read_bytes() + b'{"log": "c", "ke')
    assert {n: r.error for n, r in read_journal(path).items()} == {"a": "", "b": ""}
    with Journal(path) as journal:
        journal.add(row("d"))
    assert sorted(read_journal(path)) == ["a", "b", "d"]


def test_a_journal_is_written_anew_in_the_order_of_names(tmp_path: Path) -> None:
    path = tmp_path / "batch.jsonl"
    write_journal(path, {"b": row("b"), "a": row("a")})
    assert [json.loads(line)["log"] for line in path.read_text().splitlines()] == ["a", "b"]
    assert read_journal(tmp_path / "missing") == {}


def test_a_journal_that_cannot_be_opened_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot write"), Journal(tmp_path / "file" / "batch.jsonl"):
        pass


def test_a_row_of_a_failed_log_is_one_line() -> None:
    assert failed("a", "k", ValueError("one\n  two")).error == "one two"
    assert failed("a", "k", ValueError()).error == "ValueError"


def test_files_lie_at_a_worker_where_they_lie_here(logs: Path) -> None:
    parcel, here = packed([logs, Path("logs/a.csv")]), os.getcwd()
    assert len(parcel.files) == 4
    with unpacked(parcel):
        assert os.getcwd() != here and os.getcwd().endswith(here)
        found = {str(p): p.read_bytes() for p in sorted(Path("logs").rglob("*.csv"))}
        elsewhere = os.getcwd()
    assert os.getcwd() == here and not Path(elsewhere).exists()
    assert found == {str(p): p.read_bytes() for p in sorted(logs.rglob("*.csv"))}


def test_a_workspace_comes_back_whole_and_what_was_removed_there_is_gone(tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    for folder, files in (
        (here, ("ingest.json", "flux.json", ".lock")),
        (there, ("ingest.json", "fits/f/fit.json", ".lock")),
    ):
        for name in files:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(f"{folder.name} {name}")
    put(here, returned(there))
    left = {p.relative_to(here).as_posix(): p.read_text() for p in here.rglob("*") if p.is_file()}
    assert left == {
        ".lock": "here .lock",
        "ingest.json": "there ingest.json",
        "fits/f/fit.json": "there fits/f/fit.json",
    }


def table(path: Path, *rows: LogRow) -> dict[str, list[Any]]:
    write(path / "t.parquet", rows)
    found: dict[str, list[Any]] = pq.read_table(path / "t.parquet").to_pydict()
    return found


def test_a_row_for_every_parameter_with_its_variances_in_the_order_of_the_log(tmp_path: Path) -> None:
    known = Covariance(
        names=["c", "fy"], log=[True, False], rows=[[4.0, 1.0], [1.0, 9.0]], degrees=12.0, roles=["viscous", "yield"]
    )
    fitted = [
        Fitted(parameter=n, value=v, unit=u) for n, v, u in (("fy", 500.0, "N"), ("c", 2.0, "N*s/m"), ("k", 1.0, "N/m"))
    ]
    test = OfCondition(condition="sine", nrmse=0.01, warnings=["drift", "sign"], parameters=fitted, covariance=known)
    found = table(tmp_path, row("a", tests=[test]))
    assert found["parameter"] == ["fy", "c", "k"] and found["warnings"] == ["drift, sign"] * 3
    assert found["role"] == ["yield", "viscous", ""] and found["scale"] == ["linear", "log", ""]
    assert found["covariance"][0][:2] == [9.0, 1.0] and found["covariance"][1][:2] == [1.0, 4.0]
    assert math.isnan(found["covariance"][0][2]) and found["covariance"][2] is None
    assert found["degrees"] == [12.0] * 3 and found["nrmse"] == [0.01] * 3
    assert np.isnan(found["nrmse_holdout"]).all() and np.isnan(found["low"]).all()


def test_a_fit_without_variances_and_a_log_that_failed_have_rows_all_the_same(tmp_path: Path) -> None:
    test = OfCondition(condition="sine", parameters=[Fitted(parameter="fy", value=1.0, unit="N", low=0.5, high=1.5)])
    found = table(tmp_path, row("a", tests=[test]), row("b", error="no steady cycles"))
    assert found["log"] == ["a", "b"] and found["warnings"] == ["", "no steady cycles"]
    assert found["covariance"] == [None, None] and found["low"][0] == 0.5 and math.isnan(found["value"][1])
