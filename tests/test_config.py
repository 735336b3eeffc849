"""Pipeline files take what the command line takes, with the same limits and defaults."""

import inspect
from pathlib import Path
from typing import Any

import pytest

from mrfit import cli, pipeline
from mrfit.config import DiscoverSection, FitSection, FluxSection, IngestSection, SegmentSection, read_pipeline
from mrfit.errors import ConfigError

HEAD = '[ingest]\nlogs = ["*.csv"]\n'
# how a command is called, not what it makes of the logs; the resistance stands in [ingest] for every stage
ELSEWHERE = {"work", "jobs", "as_json", "preview", "resistance"}
NAMES = {"map_file": "map", "fix": "fixed"}


def options(command: Any) -> dict[str, Any]:
    """Return the options of a command that a pipeline file should have, with their defaults."""
    parameters = inspect.signature(command).parameters.values()
    return {NAMES.get(p.name, p.name): p.default for p in parameters if p.name not in ELSEWHERE}


@pytest.mark.parametrize(
    ("command", "section"),
    [
        (cli.ingest, IngestSection),
        (cli.flux, FluxSection),
        (cli.segment, SegmentSection),
        (cli.fit, FitSection),
        (cli.discover, DiscoverSection),
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
    with pytest.raises(ConfigError, match=rf"p\.toml: .*{key}: .*\(got '{value}'\)"):
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
