"""Pipeline files take what the command line takes, with the same limits and defaults."""

import inspect
from pathlib import Path
from typing import Any

import pytest

from mrfit.cli import main, pipeline
from mrfit.cli.config import DiscoverSection, FitSection, FluxSection, IngestSection, SegmentSection, read_pipeline
from mrfit.errors import ConfigError

HEAD = '[ingest]\nlogs = ["*.csv"]\n'
# how a command is called, not what it makes of the logs; the resistance stands in [ingest] for every stage,
# and plug-ins are named by the user alone: a pipeline file runs no code
ELSEWHERE = {"work", "jobs", "as_json", "preview", "resistance", "plugins"}
NAMES = {"map_file": "map", "fix": "fixed"}


def options(command: Any) -> dict[str, Any]:
    """Return the options of a command that a pipeline file should have, with their defaults."""
    parameters = inspect.signature(command).parameters.values()
    return {NAMES.get(p.name, p.name): p.default for p in parameters if p.name not in ELSEWHERE}


@pytest.mark.parametrize(
    ("command", "section"),
    [
        (main.ingest, IngestSection),
        (main.flux, FluxSection),
        (main.segment, SegmentSection),
        (main.fit, FitSection),
        (main.discover, DiscoverSection),
    ],
)
def test_every_option_of_a_stage_has_its_key_and_default(command: Any, section: Any) -> None:
    asked = options(command)
    assert set(asked) <= set(section.model_fields)
    for name, default in asked.items():
        if default is not inspect.Parameter.empty:
            assert section.model_fields[name].get_default() in (default, {} if default is None else default), name


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [("[fit]", "seed", -1), ("[discover]", "seed", -1), ("[fit]", "stall", 0.0), ("[fit]", "stall", 1.5)],
)
def test_what_the_command_line_refuses_is_refused(table: str, key: str, value: float, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f"{HEAD}{table.replace('[fit]', '[[fit]]')}\nmodel = 'bingham'\n{key} = {value}\n")
    with pytest.raises(ConfigError, match=rf"p\.toml: .*{key} takes a number at (least|most) .*, not {value}$"):
        read_pipeline(path)


def test_stall_reaches_the_fit(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f"{HEAD}[[fit]]\nmodel = 'bingham'\nstall = 0.2\n")
    assert pipeline._fit_settings(read_pipeline(path).fit[0], 1).stall == 0.2


@pytest.mark.parametrize("written", ["mwoa.b = 0.7", '"mwoa.b" = 0.7', "mwoa = {b = 0.7}"])
def test_options_of_optimizers_reach_the_fit(written: str, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f"{HEAD}[[fit]]\nmodel = 'bingham'\nopt = 'mwoa'\n[fit.opt_set]\npopulation = 12\n{written}\n")
    settings = pipeline._fit_settings(read_pipeline(path).fit[0], 1)
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
    "": "add a [[fit]] or a [discover] table",
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
