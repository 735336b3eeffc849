"""Pipeline files take what the command line takes, with the same limits and defaults."""

import inspect
from pathlib import Path
from typing import Any

import pytest

from mrfit.cli import main, pipeline
from mrfit.cli.config import made_of, read_pipeline, table_of
from mrfit.core.setting import defined, flag_of, key_of
from mrfit.errors import ConfigError
from mrfit.ingest.meaning.channel_map import load_map
from mrfit.settings import discover, fit, flux, ingest, segment

HEAD = '[ingest]\nlogs = ["*.csv"]\n'
# how a command is called, not what it makes of the logs; the resistance stands in [ingest] for every stage, and the
# plug-ins and the workspace beside the tables
ELSEWHERE = {
    *("quiet", "verbose", "suggest_map", "work", "jobs", "on", "shared", "as_json", "preview", "plot", "resistance"),
    "plugins",
    "logs",
}
STAGES = [
    (main.ingest, ingest.Settings),
    (main.flux, flux.Settings),
    (main.segment, segment.Settings),
    (main.fit, fit.Settings),
    (main.discover, discover.Settings),
]


@pytest.mark.parametrize(("command", "kind"), STAGES)
def test_every_option_of_a_stage_has_its_key_and_default(command: Any, kind: Any) -> None:
    keys = {flag_of(f): key_of(f) for f in defined(kind)}
    asked = {keys.get(n, n) for n in inspect.signature(command).parameters if n not in ELSEWHERE}
    table = table_of(kind)
    assert asked == set(table.model_fields) - ELSEWHERE
    model = {"model": "bingham"} if "model" in asked else {}
    assert made_of(kind, table(**model)) == kind(**model)


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [("[fit]", "seed", -1), ("[discover]", "seed", -1), ("[fit]", "stall", 0.0), ("[fit]", "stall", 1.5)],
)
def test_what_the_command_line_refuses_is_refused(table: str, key: str, value: float, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f"{HEAD}{table.replace('[fit]', '[[fit]]')}\nmodel = 'bingham'\n{key} = {value}\n")
    with pytest.raises(ConfigError, match=rf"p\.toml: .*{key} takes a number at (least|most) .*, not {value}$"):
        read_pipeline(path)


@pytest.mark.parametrize("word", ["fix", "fixed"])
def test_a_key_has_the_name_of_the_command_and_that_of_python(word: str, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f"{HEAD}[[fit]]\nmodel = 'bingham'\n{word} = {{f0 = 0.5}}\n")
    assert read_pipeline(path).fit[0].fixed == (("f0", 0.5),)


def test_a_report_shows_the_fits_that_the_file_names(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    fits = "[[fit]]\nmodel = 'bingham'\nname = 'one'\n[[fit]]\nmodel = 'tanh'\n"
    path.write_text(f"{HEAD}{fits}")
    assert read_pipeline(path).report.fits == ()
    path.write_text(f"{HEAD}{fits}[report]\nfits = ['one']\n")
    assert read_pipeline(path).report.fits == ("one",)
    path.write_text(f"{HEAD}{fits}[report]\nfits = ['two']\n")
    with pytest.raises(ConfigError, match=r"fits: 'two' is no fit of this file; it makes one, tanh\.auto$"):
        read_pipeline(path)


def test_stall_reaches_the_fit(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f"{HEAD}[[fit]]\nmodel = 'bingham'\nstall = 0.2\n")
    assert read_pipeline(path).fit[0].stall == 0.2


@pytest.mark.parametrize("written", ["mwoa.b = 0.7", '"mwoa.b" = 0.7', "mwoa = {b = 0.7}"])
def test_options_of_optimizers_reach_the_fit(written: str, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f"{HEAD}[[fit]]\nmodel = 'bingham'\nopt = 'mwoa'\n[fit.opt_set]\npopulation = 12\n{written}\n")
    settings = read_pipeline(path).fit[0]
    assert settings.options == (("population", 12.0), ("mwoa.b", 0.7))


def test_logs_are_found_beside_the_file_whatever_its_folder_is_called(tmp_path: Path) -> None:
    folder = tmp_path / "pl [2023]"
    (folder / "sub").mkdir(parents=True)
    for name in ("a.csv", "sub/b.csv"):
        (folder / name).touch()
    assert pipeline._expand(["*.csv", "**/b.csv"], folder) == [folder / "a.csv", folder / "sub" / "b.csv"]
    assert pipeline._expand([str(tmp_path / "*" / "a.csv")], folder) == [folder / "a.csv"]
    with pytest.raises(ConfigError, match="matches nothing"):
        pipeline._expand(["*.txt"], folder)


WRONG = {
    "resistance = 'two'\n": "[ingest] resistance takes a number or 'auto', not 'two'",
    "logs = 'a.csv'\n": "[ingest] logs takes a list, not 'a.csv'",
    "logs = []\n": "[ingest] logs has too few values",
    "logs = ['a.csv', 3]\n": "[ingest] logs.1 takes text, not 3",
    "lots = 1\n": "[ingest] lots is no key mrfit knows; did you mean 'logs'?",
    "[flux]\ndrift = 'spline'\n": "[flux] drift takes 'cycle', 'linear' or 'none', not 'spline'",
    "[segment]\nmin_cycles = 2.5\n": "[segment] min_cycles takes a whole number, not 2.5",
    "[segment]\nmin_cycles = 0\n": "[segment] min_cycles takes a number at least 1, not 0",
    "[[fit]]\nmodel = 'bingham'\n[[fit]]\nopt = 'pso'\n": "[[fit]] 2: model is missing",
    "[[fit]]\nmodel = 'bingham'\nseconds = 0\n": "[[fit]] 1: seconds takes a number above 0, not 0",
    "[[fit]]\nmodel = 'bingham'\nstart = 3\n": "[[fit]] 1: start takes a table, not 3",
    "[[fit]]\nmodel = 'bingham'\nbounds = {c = [1.0]}\n": "[[fit]] 1: bounds.c has too few values",
    "[[fit]]\nmodel = 'bingham'\nbounds = {c = [1.0, 2.0, 3.0]}\n": "[[fit]] 1: bounds.c has too many values",
    "[[fit]]\nmodel = 'bingham'\nbounds = {c = [1.0, 'x']}\n": "[[fit]] 1: bounds.c.1 takes a number, not 'x'",
    "[discover]\nmodel = 'tanh'\ncurrent_order = []\n": "[discover] current_order takes text or a whole number, not []",
    "[[fit]]\nmodel = 'bingham'\nzzzz = 1\n": "[[fit]] 1: zzzz is no key mrfit knows; it may be one of model, opt",
    "[discover]\nmodel = 5\n": "[discover] model takes text, not 5",
    "[fit]\nmodel = 'bingham'\n": "fit is one table; write [[fit]] for each of several",
    "": "add a [[fit]], a [discover], a [compare] or a [sheet] table",
}


@pytest.mark.parametrize("text", WRONG)
def test_a_wrong_key_or_value_is_one_plain_line(text: str, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    opening = "[ingest]\n" if text.startswith("logs") else HEAD
    whole = not text or "fit]" in text or "[discover]" in text
    path.write_text(opening + text + ("" if whole else "[discover]\nmodel = 'tanh'\n"))
    with pytest.raises(ConfigError) as error:
        read_pipeline(path)
    said = str(error.value)
    assert said.startswith(f"{path}: {WRONG[text]}") and "\n" not in said
    assert not any(word in said.lower() for word in ("input", "valid", "instance", "pydantic", "extra", "literal"))


def test_values_arrive_as_the_stages_take_them(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    fitting = "[[fit]]\nmodel = 'tanh'\nopt = 'lsq'\nbounds = {c = [1, 2]}\nstart = {c = 1.5}\nfixed = {k = 0}\n"
    reading = "map = 'm.toml'\nresistance = 2\nmax_memory = '2GB'\n"
    path.write_text(
        f"work = 'w'\n{HEAD}{reading}[flux]\nrule = 'simpson'\n{fitting}[discover]\nmodel = 'tanh'\ncurrent_order = 1\n"
    )
    made = read_pipeline(path)
    assert made.ingest == ingest.Settings(map=Path("m.toml"), resistance=2.0, max_memory=2e9)
    assert made.flux == flux.Settings(resistance=2.0, rule="simpson") and made.segment == segment.Settings()
    wanted = fit.Settings("tanh", "lsq", bounds=(("c", 1.0, 2.0),), start=(("c", 1.5),), fixed=(("k", 0.0),))
    assert made.fit == (wanted,)
    assert made.discover == discover.Settings("tanh", current_order="1")
    assert (made.work, made.logs, made.plugins) == ("w", ("*.csv",), ())


@pytest.mark.parametrize(
    ("line", "key"),
    [
        ("fixed = {f0 = nan}", "fixed.f0"),
        ("bounds = {fy = [1, inf]}", "bounds.fy.1"),
        ("start = {fy = -inf}", "start.fy"),
        ("seconds = inf", "seconds"),
        ("opt_set = {F = inf}", "opt_set.F"),
    ],
)
def test_a_number_that_is_not_finite_is_refused_as_on_the_command_line(line: str, key: str, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f"{HEAD}[[fit]]\nmodel = 'bingham'\n{line}\n")
    with pytest.raises(ConfigError, match=rf"p\.toml: .*{key} takes a finite number"):
        read_pipeline(path)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("seed = true", "seed: true and false are no numbers"),
        ("seconds = false", "seconds: true and false are no numbers"),
        ("bounds = {fy = [true, 3.0]}", "bounds: true and false are no numbers"),
    ],
)
def test_true_is_no_number(line: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(f'[ingest]\nlogs = ["a.csv"]\n[[fit]]\nmodel = "tanh"\n{line}\n')
    with pytest.raises(ConfigError) as raised:
        read_pipeline(tmp_path / "p.toml")
    assert said in str(raised.value) and "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "line",
    [
        "dt = true",
        "[condition]\ncurrent = true",
        "[channels.force]\ncolumn = 1\nscale = true",
        "[channels.force]\ncolumn = 1\nsign = true",
    ],
)
def test_true_is_no_number_of_a_channel_map(line: str, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(line)
    with pytest.raises(ConfigError, match="true and false are no numbers"):
        load_map(tmp_path / "m.toml")
