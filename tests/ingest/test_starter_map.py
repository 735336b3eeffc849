"""A suggested channel map is a valid one, names what the header says, and leaves the rest to a person."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.errors import ConfigError
from mrfit.ingest.meaning.channel_map import FILE_NAME, load_map
from mrfit.ingest.stage import Settings, read
from mrfit.ingest.starter_map import starter_map, write_starter_map

TIME = np.arange(200) * 0.004
STROKE, FORCE = 12.5 * np.sin(6 * TIME), 340.0 * np.cos(6 * TIME)


def written(
    folder: Path, head: str = "", columns: tuple[np.ndarray, ...] = (TIME, STROKE, FORCE), sep: str = ";"
) -> Path:
    path = folder / "log.txt"
    rows = "".join(sep.join(f"{v:.5f}" for v in row) + "\n" for row in zip(*columns, strict=True))
    path.write_text(head + rows)
    return path


def test_a_log_without_a_header_is_read_once_its_columns_are_named(tmp_path: Path) -> None:
    log = written(tmp_path)
    place = write_starter_map([tmp_path])
    text = place.read_text()
    assert place == tmp_path / FILE_NAME
    assert 'time = {column = 0, unit = "s"}    # are these seconds?' in text
    assert "# column 1: 0, " in text and f"{STROKE.min():.6g} to {STROKE.max():.6g}" in text
    assert load_map(place).channels == {}
    first, second = '# force = {column = 1, unit = "N"}', '# force = {column = 2, unit = "N"}'
    assert first in text and second in text
    place.write_text(text.replace(first, 'displacement = {column = 1, unit = "mm"}').replace(second, second[2:]))
    (recording,) = read([log], Settings()).recordings
    assert recording.dt == pytest.approx(0.004)
    np.testing.assert_allclose(recording.channels["displacement"], STROKE / 1e3, atol=1e-8)
    np.testing.assert_allclose(recording.channels["force"], FORCE, atol=1e-5)


def test_what_the_header_says_is_filled_in(tmp_path: Path) -> None:
    written(tmp_path, "Time (ms);Load (kN);A17\n", (1e3 * TIME, FORCE, STROKE))
    text = starter_map(tmp_path / "log.txt")
    found = tomllib.loads(text)
    assert found["time"] == {"column": 0, "unit": "ms"}
    assert found["channels"] == {"force": {"column": 1, "unit": "kN"}}
    assert '"A17"' in text and "# force = {column = 2" in text


def test_a_quantity_is_named_once(tmp_path: Path) -> None:
    written(tmp_path, "Time (s);Force (N);Load (N)\n", (TIME, FORCE, FORCE))
    assert tomllib.loads(starter_map(tmp_path / "log.txt"))["channels"] == {"force": {"column": 1, "unit": "N"}}


def test_a_rate_is_asked_for_where_no_column_is_time(tmp_path: Path) -> None:
    written(tmp_path, columns=(STROKE, FORCE))
    found = tomllib.loads(starter_map(tmp_path / "log.txt"))
    assert found["rate"] == 1.0 and "time" not in found


@settings(max_examples=40)
@given(st.lists(st.text(st.characters(blacklist_characters=";\n\r"), max_size=12), min_size=3, max_size=3))
def test_whatever_the_header_the_map_is_valid(tmp_path_factory: pytest.TempPathFactory, names: list[str]) -> None:
    folder = tmp_path_factory.mktemp("log")
    log = folder / "log.txt"
    rows = "".join(f"{a:.3f};{b:.3f};{c:.3f}\n" for a, b, c in zip(TIME, STROKE, FORCE, strict=True))
    log.write_bytes((";".join(names) + "\n" + rows).encode("utf-8", "surrogatepass"))
    place = write_starter_map([log])
    load_map(place)


def test_a_map_that_is_there_is_kept(tmp_path: Path) -> None:
    written(tmp_path)
    (tmp_path / FILE_NAME).write_text("rate = 3.0\n")
    with pytest.raises(ConfigError, match="there is a channel map already"):
        write_starter_map([tmp_path])
    assert (tmp_path / FILE_NAME).read_text() == "rate = 3.0\n"


@pytest.mark.parametrize("content", [b"", b"\x89HDF\r\n\x1a\n" + bytes(200), b"no numbers\nat all\n"])
def test_a_file_without_rows_of_numbers_is_refused_in_one_line(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_bytes(content)
    with pytest.raises(ConfigError, match="no map can be suggested") as refused:
        write_starter_map([tmp_path / "log.txt"])
    assert "\n" not in str(refused.value) and not (tmp_path / FILE_NAME).exists()
