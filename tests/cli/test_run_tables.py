"""A pipeline file does with its fits what the commands do: compare, predict, draw and export."""

import json
from pathlib import Path
from typing import Any, cast

import pytest

from mrfit.cli import pipeline
from mrfit.cli.config import read_pipeline
from mrfit.core.progress import silent
from mrfit.errors import ConfigError, DataError
from mrfit.export import c, stage
from tests.conftest import Run
from tests.docs.labs import write_press_log

FILE = """
[ingest]
logs = ["logs/*.csv"]
[segment]
holdout = "none"
[[fit]]
model = "bingham"
opt = "lsq"
per = "all"
current_order = "fy=1"
[compare]
models = ["bingham"]
budget = 100
[[predict]]
fit = "bingham.lsq.all"
logs = ["logs/sine_1Hz_*.csv"]
save = "again"
[figure]
kind = "parameters"
format = ["png"]
[export]
fit = "bingham.lsq.all"
to = ["c", "json"]
prefix = "front"
"""


def logs(folder: Path) -> None:
    for current in range(3):
        write_press_log(folder / "logs", f"sine_1Hz_10mm_{current}A", (1.0, 0.010), current)


def test_every_table_is_done(tmp_path: Path, mrfit: Run) -> None:
    logs(tmp_path)
    (tmp_path / "p.toml").write_text(FILE)
    done = mrfit("run", "p.toml", "--json", fresh=True)
    assert done.returncode == 0, done.stderr
    told, work = json.loads(done.stdout), tmp_path / "mrfit-work"
    assert [row["model"] for row in told["compare"]["models"]] == ["bingham"]
    assert (work / "compare" / "compare.csv").is_file() and (work / "predict" / "again.parquet").is_file()
    assert told["predict"][0]["metrics"][-1]["nrmse"] < 0.1
    assert [Path(f).suffix for f in told["figure"][0]["files"]] == [".png"] and Path(work).is_dir()
    exported = work / "export" / "bingham.lsq.all"
    assert {p.name for p in exported.iterdir()} == {"front.c", "front.h", "front_selftest.c", "front.json"}
    assert "front_step(" in (exported / "front.h").read_text()
    shown = mrfit("run", "p.toml")
    assert shown.returncode == 0
    places = [shown.stdout.index(text) for text in ("Prediction by", "Report", "Figure of parameters", "front.json")]
    assert places == sorted(places)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ('[figure]\nkind = "loop"', "figure.* takes .*loops"),
        ('[export]\nfit = "x"', r"to is missing"),
        ('[predict]\nfit = "x"\nlogs = []', "logs has too few values"),
        ('[[predict]]\nfit = "x"\nlog = ["a"]', "log"),
        ("[compare]\nbudget = 3", "compare takes --models"),
    ],
)
def test_a_wrong_table_is_refused_before_anything_is_done(table: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(f'[ingest]\nlogs = ["*.csv"]\n[[fit]]\nmodel = "tanh"\n{table}\n')
    with pytest.raises(ConfigError, match=message):
        read_pipeline(tmp_path / "p.toml")


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ('[compare]\nmodels = ["tahn"]', "unknown model 'tahn'"),
        ('[compare]\nmodel = "tanh"\noptimizers = ["psso"]', "unknown optimizer 'psso'"),
        ('[figure]\nkind = "loops"\nwidth = "9m"', "--width takes"),
        ('[figure]\nkind = "loops"\nfits = ["x"]', "figure.* 'x' is no fit of this file; it makes tanh.auto"),
        ('[export]\nfit = "tanh.auto"\nto = ["cc"]', "--to cc: no such format"),
        ('[export]\nfit = "x"\nto = ["c"]', "export.* 'x' is no fit of this file"),
        (
            '[compare]\nmodels = ["bingham"]\n[export]\nfit = "bingham.auto"\nto = ["c"]',
            "'bingham.auto' is no fit of this file; it makes bingham.auto.all, tanh.auto",
        ),
        ('[predict]\nfit = "tanh.auto"\nlogs = ["none/*.csv"]', "predict.*matches nothing"),
    ],
)
def test_the_last_table_is_checked_before_the_first_stage(
    table: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "p.toml").write_text(f'[ingest]\nlogs = ["*.csv"]\n[[fit]]\nmodel = "tanh"\n{table}\n')
    (tmp_path / "a.csv").write_text("time (s),current (A)\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=message):
        pipeline.run(read_pipeline(tmp_path / "p.toml"), tmp_path, pipeline.Overrides(), silent)
    assert not (tmp_path / "mrfit-work").exists()


def test_fits_of_a_workspace_are_told_from_those_of_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    table = '[export]\nfit = "x"\nto = ["c"]'
    (tmp_path / "p.toml").write_text(f'[ingest]\nlogs = ["*.csv"]\n[[fit]]\nmodel = "tanh"\n{table}\n')
    (tmp_path / "a.csv").write_text("time (s),current (A)\n")
    ends = {"": "it makes tanh.auto$", "bingham.auto": "makes tanh.auto, and .*mrfit-work holds bingham.auto$"}
    for name, end in ends.items():
        if name:
            (tmp_path / "mrfit-work" / "fits" / name).mkdir(parents=True)
            (tmp_path / "mrfit-work" / "fits" / name / "fit.json").write_text("{}")
        with pytest.raises(ConfigError, match=end):
            pipeline.run(read_pipeline(tmp_path / "p.toml"), tmp_path, pipeline.Overrides(), silent)


def test_one_table_and_several_are_the_same(tmp_path: Path) -> None:
    for brackets in ("[figure]", "[[figure]]"):
        (tmp_path / "p.toml").write_text(
            f'[ingest]\nlogs = ["*.csv"]\n[[fit]]\nmodel = "tanh"\n{brackets}\nkind = "loops"\nwidth = "84mm"\n'
        )
        (figure,) = read_pipeline(tmp_path / "p.toml").figure
        assert figure.kind == "loops" and figure.settings.width == "84mm"


@pytest.mark.parametrize("prefix", ["9x", "a b", "int", "base", "x" * 30])
def test_a_prefix_that_c_does_not_take_is_refused(prefix: str) -> None:
    with pytest.raises(ConfigError, match="--prefix takes"):
        stage._prefixed(cast(Any, None), prefix)


def test_a_format_that_fails_does_not_take_the_others(
    tmp_path: Path, mrfit: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mrfit.cli import export
    from mrfit.settings.export import Settings

    logs(tmp_path)
    for words in (("ingest", "logs"), ("fit", "--model", "bingham", "--per", "all", "--budget", 100, "--name", "f")):
        assert mrfit(*words).returncode == 0

    def broken(*_: object) -> stage.Files:
        raise DataError("no compiler here")

    monkeypatch.setattr(c, "files", broken)
    place = export.Place(tmp_path / "out", "", ())
    made = export.exported(tmp_path / "mrfit-work", "f", ["c", "json"], place, Settings(), silent)
    assert [one.format for one in made.formats] == ["json"] and made.failed == {"c": "no compiler here"}
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["f.json"]
    with pytest.raises(DataError, match="the other formats are written, but not c: no compiler here"):
        export.check_all_made(made)
    with pytest.raises(DataError, match="^no compiler here$"):
        export.exported(tmp_path / "mrfit-work", "f", ["c"], place, Settings(), silent)
