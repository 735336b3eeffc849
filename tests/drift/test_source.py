"""Values are read of tables and workspaces alike, and the force over units is that of their models."""

import json
from pathlib import Path

import numpy as np
import pytest

import mrfit
from mrfit.drift.source import read_values
from mrfit.errors import ConfigError, DataError
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
        assert one.covariates["date"] == other.covariates["date"]


def test_the_ends_of_the_force_are_those_of_the_units(batch: Path) -> None:
    values = read_values([batch / "fleet"], Settings(unit="{unit}_2026*", at="2:0.01:0"))
    greatest = [v for v in values if v.parameter == "lambda_max"]
    speed = 2.0 * np.pi * FREQUENCY * AMPLITUDE
    assert [v.specimen for v in greatest] == ["unit0", "unit1", "unit2", "unit3"]
    for one, fy in zip(greatest, FORCES, strict=True):
        assert abs(one.value - (fy + 1200.0 * speed)) < 4.0 * np.sqrt(one.variance) + 1e-3 * fy
    with pytest.raises(ConfigError, match="as 1:0.01:0.5"):
        read_values([batch / "fleet"], Settings(at="2:0.01"))


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


def test_what_holds_no_fit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no fit in this folder"):
        read_values([tmp_path], Settings())
    (tmp_path / "a.txt").write_text("")
    with pytest.raises(DataError, match="no workspace, and no table"):
        read_values([tmp_path / "a.txt"], Settings())
    with pytest.raises(mrfit.DataError, match="cannot be read as a table"):
        read_values([tmp_path / "none.csv"], Settings())
