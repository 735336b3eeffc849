"""Whatever is wrong with the input ends in one line with a remedy, the right exit code, and the workspace as it was."""

import hashlib
import subprocess
from pathlib import Path

import pytest

from tests.conftest import Run

GOOD = "time,voltage,current\ns,V,A\n" + "".join(f"{k * 1e-3:.3f},{k % 7},{k % 5}\n" for k in range(500))
MAP = '[channels]\nvoltage = {column = "CH1"}\ncurrent = {column = "CH9"}\n'


def snapshot(folder: Path) -> dict[str, str]:
    files = [p for p in sorted(folder.rglob("*")) if p.is_file() and p.name != ".lock"]
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def assert_one_line(result: "subprocess.CompletedProcess[str]", code: int, *words: str) -> None:
    assert result.returncode == code, result.stderr
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1, result.stderr
    assert "Traceback" not in result.stderr
    for word in words:
        assert word in result.stderr, result.stderr


BAD_LOGS = {
    "empty": ("", ["empty"]),
    "no numeric rows": ("time,voltage,current\ns,V,A\na,b,c\nd,e,f\n", ["no row of numbers"]),
    "all current missing": (
        GOOD.replace(",0\n", ",NaN\n")
        .replace(",1\n", ",NaN\n")
        .replace(",2\n", ",NaN\n")
        .replace(",3\n", ",NaN\n")
        .replace(",4\n", ",NaN\n"),
        ["current"],
    ),
    "unit of another kind": (GOOD.replace("s,V,A", "s,V,mm"), ["current", "mm"]),
}


@pytest.mark.parametrize("kind", BAD_LOGS)
def test_a_bad_log_is_refused_with_its_remedy(kind: str, mrfit: Run, tmp_path: Path) -> None:
    text, words = BAD_LOGS[kind]
    (tmp_path / "log.csv").write_text(text)
    assert_one_line(mrfit("ingest", "log.csv"), 1, "log.csv", *words)
    assert not (tmp_path / "mrfit-work").exists()


def test_an_unknown_unit_costs_its_column_only(mrfit: Run, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(GOOD.replace("s,V,A", "s,V,furlongs2"))
    result = mrfit("ingest", "log.csv")
    assert result.returncode == 0
    assert "'current' in 'furlongs2': kept as printed" in result.stdout


def test_a_missing_log_is_named(mrfit: Run, tmp_path: Path) -> None:
    assert_one_line(mrfit("ingest", "nowhere.csv"), 1, "nowhere.csv", "no such file")
    assert not (tmp_path / "mrfit-work").exists()


def test_a_map_that_names_an_unknown_column_lists_those_there_are(mrfit: Run, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(GOOD)
    (tmp_path / "mrfit.toml").write_text(MAP)
    assert_one_line(mrfit("ingest", "log.csv"), 1, "CH1", "'voltage'", "'current'")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["flux", "--resistance", "-2"], ["--resistance", "positive", "-2"]),
        (["flux", "--resistance", "two"], ["--resistance", "two"]),
        (["fit", "--model", "bouc-wen-flux"], ["unknown model 'bouc-wen-flux'", "boucwen-flux"]),
        (["fit", "--model", "boucwen-flux", "--opt", "psoo-fmin"], ["unknown optimizer 'psoo'", "pso"]),
        (["fit", "--model", "boucwen-flux", "--fix", "q=1"], ["no parameter 'q'"]),
        (["fit", "--model", "boucwen-flux", "--per", "file"], ["--per", "condition or all"]),
        (["fit"], ["--model"]),
        (["fitt"], ["fitt"]),
        (["run", "nowhere.toml"], ["nowhere.toml"]),
        (["list", "tables"], ["tables", "models"]),
        (["show", "bingam"], ["bingham"]),
    ],
)
def test_a_wrong_command_line_exits_with_2(arguments: list[str], words: list[str], mrfit: Run, tmp_path: Path) -> None:
    assert_one_line(mrfit(*arguments), 2, *words)
    assert not (tmp_path / "mrfit-work").exists()


def test_a_stage_without_its_input_names_the_command_to_run(mrfit: Run, tmp_path: Path) -> None:
    assert_one_line(mrfit("fit", "--model", "boucwen-flux"), 1, "mrfit ingest")
    assert_one_line(mrfit("report"), 1, "mrfit fit")
    assert not (tmp_path / "mrfit-work").exists()


def test_an_unwritable_workspace_is_named(mrfit: Run, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(GOOD)
    (tmp_path / "blocked").write_text("a file, not a folder")
    assert_one_line(mrfit("ingest", "log.csv", "--work", "blocked/work"), 1, "blocked", "--work")


def test_a_log_without_steady_cycles_gives_no_segment_and_changes_nothing(mrfit: Run, tmp_path: Path) -> None:
    flat = "time,voltage,current\ns,V,A\n" + "".join(f"{k * 1e-3:.3f},1.0,0.5\n" for k in range(400))
    (tmp_path / "flat.csv").write_text(flat)
    assert mrfit("ingest", "flat.csv", "--resistance", 2).returncode == 0
    before = snapshot(tmp_path / "mrfit-work")
    assert_one_line(mrfit("fit", "--model", "boucwen-flux"), 1, "flat")
    after = snapshot(tmp_path / "mrfit-work")
    assert {k: v for k, v in after.items() if not k.startswith("flux")} == before


def test_a_pipeline_file_with_an_unknown_key_names_it(mrfit: Run, tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text('[ingest]\nlogs = ["*.csv"]\n[[fit]]\nmodel = "bingham"\noptt = "pso"\n')
    assert_one_line(mrfit("run", "p.toml"), 2, "p.toml", "optt")


def test_debug_shows_where(mrfit: Run) -> None:
    result = mrfit("--debug", "fit", "--model", "nonsense")
    assert "Traceback" in result.stderr
