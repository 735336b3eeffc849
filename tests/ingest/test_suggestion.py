"""A suggested channel map is a channel map, says what the logs say, and holds nothing that a name could slip in."""

import json
import re
import tomllib
from pathlib import Path
from shutil import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.core.channels import CHANNELS
from mrfit.errors import ConfigError, DataError
from mrfit.ingest.meaning.channel_map import load_map
from mrfit.ingest.stage import Settings, read
from mrfit.ingest.suggestion import suggest, write
from mrfit.io.workspace import Workspace
from tests.conftest import ROOT, Run

COIL = ROOT / "datasets/coil"


def test_what_logs_say_is_written_out_and_read_back_alike(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(
        "Zeit (ms);Kraft (kN);Weg (mm)\n" + "".join(f"{k};{k % 7};{k % 5}\n" for k in range(50))
    )
    (plain,) = read([tmp_path], Settings()).recordings
    assert write([tmp_path], Settings()) == tmp_path / "mrfit.toml"
    assert tomllib.loads((tmp_path / "mrfit.toml").read_text())["channels"]["force"] == {
        "column": "Kraft",
        "unit": "kN",
    }
    (mapped,) = read([tmp_path], Settings()).recordings
    assert mapped.dt == plain.dt
    assert {n: list(v) for n, v in mapped.channels.items()} == {n: list(v) for n, v in plain.channels.items()}


def test_what_logs_leave_open_is_a_comment_with_the_values(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("AI0,AI1 [V]\n" + "".join(f"{k * k},{k / 8 * k}\n" for k in range(30)))
    text = suggest([tmp_path], Settings())
    assert tomllib.loads(text) == {"channels": {}}
    assert "# rate = 1000" in text
    assert '# NAME = {column = "AI0", unit = "…"}   # column 0: 0 to 841, begins 0, 1, 4' in text
    assert (
        '# NAME = {column = "AI1", unit = "V"}   # may be voltage; column 1: 0 to 105.12, begins 0, 0.125, 0.5' in text
    )


@pytest.mark.parametrize(("rows", "time"), [((0.0, 0.5, 1.0, 1.5), True), ((0.0, 0.5, 1.5, 1.6), False)])
def test_a_column_that_rises_evenly_may_be_the_time(tmp_path: Path, rows: tuple[float, ...], time: bool) -> None:
    (tmp_path / "run.csv").write_text("AI0,AI1\n" + "".join(f"{r},{r * (2 - r)}\n" for r in rows))
    assert tomllib.loads(suggest([tmp_path], Settings())).get("time") == (
        {"column": "AI0", "unit": "s"} if time else None
    )


def test_the_commonest_layout_is_described_and_others_are_named(tmp_path: Path) -> None:
    for number in range(3):
        (tmp_path / f"run{number}.csv").write_text("force (N),displacement (mm)\n" + "1,2\n" * 9)
    (tmp_path / "odd.csv").write_text("force (N),current (A)\n" + "1,2\n" * 9)
    text = suggest([tmp_path], Settings())
    assert set(tomllib.loads(text)["channels"]) == {"force", "displacement"}
    assert "# Other columns than these have odd.csv: give" in text


@settings(max_examples=60, deadline=None)
@given(st.lists(st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12), min_size=2, max_size=4))
def test_no_header_breaks_out_of_its_place(tmp_path_factory: pytest.TempPathFactory, names: list[str]) -> None:
    path = tmp_path_factory.mktemp("odd") / "run.csv"
    cells = ['"' + n.replace('"', '""').replace("\n", " ").replace("\r", " ") + '"' for n in names]
    path.write_text(
        ",".join(cells) + "\n" + "".join(",".join(str(k + j) for j in range(len(names))) + "\n" for k in range(20))
    )
    try:
        text = suggest([path], Settings())
    except DataError:
        return  # a header that no reader makes a table of
    assert set(tomllib.loads(text)) <= {"time", "channels"}
    assert set(tomllib.loads(text).get("channels", {})) <= set(CHANNELS)
    assert all(c.isprintable() or c == "\n" for c in text)


def test_the_command_writes_a_map_that_is_read_where_there_is_none(tmp_path: Path, mrfit: Run) -> None:
    copy(COIL / "coil_01Hz_1A.csv", tmp_path)
    ask = ("ingest", tmp_path / "coil_01Hz_1A.csv")
    # what the shell makes of `> mrfit.toml` before the command begins
    (tmp_path / "mrfit.toml").write_text("\n")
    told = mrfit(*ask, "--suggest-map", "--json")
    assert told.returncode == 0 and json.loads(told.stdout)["map"].endswith("mrfit.toml")
    assert load_map(tmp_path / "mrfit.toml").time is not None
    before = (tmp_path / "mrfit.toml").read_text()
    again = mrfit(*ask, "--suggest-map", "--json")
    assert again.returncode == 2 and "there is a channel map already" in again.stderr
    assert (tmp_path / "mrfit.toml").read_text() == before
    assert mrfit(*ask).returncode == 0


def press_log(path: Path, rows: int = 400) -> None:
    """Write a log without a header: time, displacement in mm, velocity in mm/s, force in N."""
    time = np.arange(rows) * 0.005
    x, v = 2.0 * np.sin(31.4 * time), 62.8 * np.cos(31.4 * time)
    np.savetxt(path, np.column_stack([time, x, v, 150.0 * np.tanh(v)]), fmt="%.7e", delimiter="  ")


def test_logs_without_a_header_get_a_map_through_a_pipe(tmp_path: Path, mrfit: Run) -> None:
    for name in ("2mm5Hz0A", "2mm5Hz0x25A"):
        press_log(tmp_path / f"{name}.txt")
    ask = ("ingest", *sorted(tmp_path.glob("*.txt")))
    refused = mrfit(*ask)
    assert refused.returncode == 1 and "`mrfit ingest LOGS --suggest-map` writes a channel map" in refused.stderr
    told = mrfit(*ask, "--suggest-map")
    assert told.returncode == 0 and not (tmp_path / "mrfit.toml").exists()
    found = tomllib.loads(told.stdout)
    assert found["time"] == {"column": 0, "unit": "s"} and found["channels"] == {}
    assert found["pattern"] == "{amplitude:mm}mm{frequency:Hz}Hz{current:A}A"
    (tmp_path / "mrfit.toml").write_text(told.stdout)
    unnamed = mrfit(*ask)
    assert unnamed.returncode == 1 and f"name them under [channels] in {tmp_path / 'mrfit.toml'}" in unnamed.stderr
    # the user agrees to every guess
    (tmp_path / "mrfit.toml").write_text(re.sub(r"^# (\w+ = \{)", r"\1", told.stdout, flags=re.MULTILINE))
    assert mrfit(*ask, "--work", tmp_path / "w").returncode == 0
    recording = Workspace(tmp_path / "w").read_recording("2mm5Hz0x25A")
    assert {n: recording.units[n] for n in recording.channels} == {"displacement": "m", "velocity": "m/s", "force": "N"}
    assert recording.condition["current"] == 0.25 and recording.channels["displacement"].max() < 2.1e-3


def test_no_log_is_one_line(tmp_path: Path) -> None:
    with pytest.raises((DataError, ConfigError), match="no log|no such|nothing"):
        suggest([tmp_path / "none.csv"], Settings())
