"""Values are read of tables and workspaces alike, and the force over units is that of their models."""

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from pandas import DataFrame

import mrfit
from mrfit.drift import source
from mrfit.drift.analysis import compare
from mrfit.drift.source import completed, read_table, read_values, values_of_table
from mrfit.errors import ConfigError, DataError
from mrfit.export.ssv import NAMESPACE
from mrfit.settings.drift import Settings
from tests import commands
from tests.batch.logs import AMPLITUDE, FREQUENCY, write_log

FORCES = (480.0, 520.0, 500.0, 510.0)


@pytest.fixture(scope="module")
def batch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fit logs of four units, into workspaces."""
    folder = tmp_path_factory.mktemp("fleet")
    for k, fy in enumerate(FORCES):
        write_log(folder / "logs" / f"unit{k}_2026-01-0{k + 1}.csv", k, fy=fy)
    done = commands.text(folder, "batch", "logs", "--model", "bingham", "--opt", "lsq", "--work", "fleet")
    assert done.returncode == 0, done.stderr
    return folder


def test_a_table_and_its_workspaces_give_the_same(batch: Path) -> None:
    of_table = read_values([batch / "fleet/batch.parquet"], Settings())
    of_folders = read_values([batch / "fleet"], Settings())
    assert len(of_table) == len(of_folders) > 0
    for one, other in zip(of_table, of_folders, strict=True):
        assert (one.parameter, one.role, one.log_scale) == (other.parameter, other.role, other.log_scale)
        assert one.value == pytest.approx(other.value) and one.variance == pytest.approx(other.variance)
        for name in ("date", "frequency", "amplitude"):
            assert one.covariates[name] == pytest.approx(other.covariates[name])


def test_the_same_table_as_csv_gives_the_same(batch: Path) -> None:
    read_table(batch / "fleet/batch.parquet").to_csv(batch / "written.csv", index=False)
    of_csv, of_table = (read_values([batch / name], Settings()) for name in ("written.csv", "fleet/batch.parquet"))
    listed = read_table(batch / "fleet/batch.parquet")
    listed["covariance"] = [list(c) for c in listed["covariance"]]
    assert [v.variance for v in values_of_table(listed)] == [v.variance for v in of_table]
    assert [v.parameter for v in of_csv] == [v.parameter for v in of_table]
    np.testing.assert_allclose([v.variance for v in of_csv], [v.variance for v in of_table], rtol=1e-6)


def test_a_list_of_numpy_s_numbers_is_read_as_csv_writes_it_and_other_texts_are_one_line(tmp_path: Path) -> None:
    rows = ["log,parameter,unit,condition,value,covariance"]
    written = ("[np.float64(0.04), nan]", "array([0.04, 1.0])", "[0.04, None]", "[4e-2]")
    rows += [f'u{k},fy,,,{300 + k},"{text}"' for k, text in enumerate(written)]
    (tmp_path / "a.csv").write_text("\n".join(rows))
    found = read_values([tmp_path / "a.csv"], Settings())
    assert [v.variance for v in found] == [0.04] * 4
    assert {(v.condition, v.unit, v.role) for v in found} == {("", "", "")}
    (tmp_path / "b.csv").write_text("\n".join([*rows[:2], 'u9,fy,,,300,"[0.1 ... 0.2]"']))
    with pytest.raises(DataError, match="u9: its covariance is no list of numbers"):
        read_values([tmp_path / "b.csv"], Settings())


def test_tests_of_which_each_tells_another_parameter_are_all_counted(batch: Path) -> None:
    values = read_values([batch / "fleet"], Settings())
    one, other = (v for v in {v.parameter: v for v in values}.values() if v.parameter in ("fy", "c", "C_inf"))
    logs = sorted({v.log for v in values})
    left = [v for v in values if v.parameter == (one.parameter if v.log in logs[:2] else other.parameter)]
    assert compare(left, Settings())[0].tests == len(logs)


def test_a_test_whose_force_is_simulated_is_one_test(batch: Path) -> None:
    for at in ("", "2:0.01:0"):
        settings = Settings(unit="{unit}_2026*", at=at)
        assert compare(read_values([batch / "fleet"], settings), settings)[0].tests == len(FORCES)


def test_the_ends_of_the_force_are_those_of_the_units(batch: Path) -> None:
    values = read_values([batch / "fleet"], Settings(unit="{unit}_2026*", at="2:0.01:0"))
    greatest = [v for v in values if v.parameter == "lambda_max"]
    speed = 2.0 * np.pi * FREQUENCY * AMPLITUDE
    assert [v.specimen for v in greatest] == ["unit0", "unit1", "unit2", "unit3"]
    for one, fy in zip(greatest, FORCES, strict=True):
        assert abs(one.value - (fy + 1200.0 * speed)) < 4.0 * np.sqrt(one.variance) + 1e-3 * fy
    assert {v.condition for v in greatest} == {"2 Hz, 0.01 m, 0 A"}


@pytest.mark.parametrize(
    ("where", "at", "said"),
    [
        ("fleet", "2:0.01", "as 1:0.01:0.5"),
        ("fleet", "nan:0.01:0", "as 1:0.01:0.5"),
        ("fleet", "2:inf:0", "as 1:0.01:0.5"),
        ("fleet/batch.parquet", "2:0.01", "as 1:0.01:0.5"),
        ("fleet/batch.parquet", "2:0.01:0", "give their workspaces"),
    ],
)
def test_a_motion_that_is_wrong_or_of_a_table_is_one_line(batch: Path, where: str, at: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        read_values([batch / where], Settings(at=at))


def test_a_current_at_which_no_fit_is_made_is_one_line(batch: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "force_ends", lambda fit, result, at: ())
    with pytest.raises(ConfigError, match="no fit is of tests at 7 A"):
        read_values([batch / "fleet"], Settings(at="2:0.01:7"))


def test_the_command_writes_its_files_and_prints_what_they_say(batch: Path) -> None:
    (batch / "life.csv").write_text("log,cycles\n" + "".join(f"unit{k}_2026-01-0{k + 1},{k}000\n" for k in range(4)))
    words = ("drift", "fleet/batch.parquet", "--over", "cycles", "--covariates", "life.csv", "--out", "out")
    done = commands.text(batch, *words, "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["units"] == 4 and {s["covariate"] for p in told["parameters"] for s in p["slopes"]} == {"cycles"}
    assert {p.name for p in (batch / "out").iterdir()} == {"drift.html", "drift.csv", "drift.json"}
    shown = commands.text(batch, *words)
    assert "Drift: 4 units, 4 tests; 0 drifts, 0 units that stand out" in shown.stdout


def test_units_are_drawn_as_they_scatter(batch: Path) -> None:
    words = ("drift", "fleet", "--unit", "{unit}_2026*", "--draws", "30", "--out", "drawn")
    done = commands.text(batch, *words)
    assert done.returncode == 0, done.stderr
    files = sorted((batch / "drawn" / "ssv").iterdir())
    assert len(files) == 30
    before = files[7].read_bytes()
    commands.text(batch, *words)
    assert files[7].read_bytes() == before
    drawn = []
    for one in files:
        rows = ElementTree.parse(one).getroot().iter(f"{{{NAMESPACE}}}Parameter")
        drawn.append({r.attrib["name"]: float(r[0].attrib["value"]) for r in rows})
    forces = np.log([d["fy"] for d in drawn])
    fitted = [v for v in read_values([batch / "fleet"], Settings()) if v.parameter == "fy"]
    # four units that differ by far more than their fits leave open
    values = [v.value for v in fitted]
    assert np.std(values) > 10.0 * np.sqrt(np.mean([v.variance for v in fitted]))
    assert np.median(forces) == pytest.approx(np.mean(values), abs=np.std(values))
    assert 0.5 * np.std(values) < np.subtract(*np.percentile(forces, [75, 25])) / 1.35 < 2.0 * np.std(values)
    refused = commands.text(batch, "drift", "fleet/batch.parquet", "--draws", "3", "--out", "none")
    assert refused.returncode == 2 and "it takes fits (no tables)" in refused.stderr
    assert not (batch / "none").exists()


def test_what_cannot_be_compared_is_one_line(batch: Path, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="one fit of every condition: there is nothing to compare it with"):
        read_values([next((batch / "fleet").rglob("fits")).parent], Settings())
    with pytest.raises(ConfigError, match="--over pressure: no fit states it; there are"):
        read_values([batch / "fleet"], Settings(over=("pressure",)))
    table = read_table(batch / "fleet/batch.parquet")
    table["log"] = [f"unit{k}" for k in table.groupby("log").ngroup()]
    with pytest.raises(ConfigError, match="no log has one in its name"):
        completed(values_of_table(table), Settings(over=("date",)))
    with pytest.raises(DataError, match="no column covariance, nor low and high"):
        values_of_table(table.drop(columns=["covariance", "low"]))
    other = [replace(v, model=m) for v, m in zip(values_of_table(table), ("tanh", "bingham"), strict=False)]
    with pytest.raises(DataError, match="fits of several models, bingham, tanh"):
        completed(other, Settings())


def test_what_holds_no_fit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no fit in this folder"):
        read_values([tmp_path], Settings())
    (tmp_path / "a.txt").write_text("")
    with pytest.raises(DataError, match="no workspace, and no table"):
        read_values([tmp_path / "a.txt"], Settings())
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(mrfit.DataError, match="cannot be read as a table"):
        read_values([tmp_path / "empty.csv"], Settings())


@pytest.mark.parametrize("name", ["none.csv", "none.parquet", "none"])
def test_a_file_that_is_not_there_is_called_so(name: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no such file; check the path and its spelling"):
        read_values([tmp_path / name], Settings())
    one = values_of_table(DataFrame([{"log": "a", "parameter": "fy", "value": 2.0, "low": 1.0, "high": 3.0}]))
    with pytest.raises(DataError, match="no such file; check"):
        completed([*one, *one], Settings(covariates=tmp_path / f"{name}.csv"))
