"""A suggested channel map is a channel map, says what the logs say, and holds nothing that a name could slip in."""

import tomllib
from pathlib import Path
from shutil import copy

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.core.channels import CHANNELS
from mrfit.errors import ConfigError, DataError
from mrfit.ingest.meaning.channel_map import load_map
from mrfit.ingest.stage import Settings, read
from mrfit.ingest.suggestion import suggest, write
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
    told = mrfit(*ask, "--suggest-map")
    assert told.returncode == 0 and "check every line" in told.stdout
    assert load_map(tmp_path / "mrfit.toml").time is not None
    before = (tmp_path / "mrfit.toml").read_text()
    again = mrfit(*ask, "--suggest-map")
    assert again.returncode == 2 and "there is a channel map already" in again.stderr
    assert (tmp_path / "mrfit.toml").read_text() == before
    assert mrfit(*ask).returncode == 0


def test_no_log_is_one_line(tmp_path: Path) -> None:
    with pytest.raises((DataError, ConfigError), match="no log|no such|nothing"):
        suggest([tmp_path / "none.csv"], Settings())
