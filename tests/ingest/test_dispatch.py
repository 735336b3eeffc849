from pathlib import Path

import pytest

from mrfit.ingest.dispatch import expand, look, part_of
from mrfit.ingest.refusal import Refusal
from tests.ingest.samples import sample


def test_folder_stands_for_the_logs_in_it(tmp_path: Path) -> None:
    for name in ("b.csv", "a.CSV", "sub/c.txt", "README.md", "mrfit.toml", ".hidden.csv", ".git/x.csv", "noending"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("x")
    found = [str(p.relative_to(tmp_path)) for p, _ in expand([tmp_path])]
    assert found == ["a.CSV", "b.csv", "noending", "sub/c.txt"]


def test_a_workspace_among_the_logs_is_not_read(tmp_path: Path) -> None:
    for name in ("a.csv", "mrfit-work/recordings/a.parquet", "mrfit-work/ingest.json", "mrfit-work/fits/x/metrics.csv"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("x")
    assert [p.name for p, _ in expand([tmp_path])] == ["a.csv"]


def test_a_file_named_twice_is_read_once(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x")
    assert len(expand([tmp_path, tmp_path / "a.csv"])) == 1


@pytest.mark.parametrize("make", [False, True])
def test_missing_path_and_empty_folder_are_named(make: bool, tmp_path: Path) -> None:
    path = tmp_path / "nothing"
    if make:
        path.mkdir()
    with pytest.raises(Refusal, match="nothing: no "):
        expand([path])


def test_unknown_binary_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "blob.dat"
    path.write_bytes(bytes(range(256)) * 9)
    with pytest.raises(Refusal, match="a binary file of no known format"):
        look(path)


def test_parts_of_a_record_share_a_name(tmp_path: Path) -> None:
    _, one = sample("tektronix-tds", tmp_path)
    _, two = sample("tektronix-tds", tmp_path, "f0004ch2.csv")
    _, other = sample("tektronix-tds", tmp_path, "F0005CH1.CSV")
    parts = [part_of(look(p)[0], "tektronix-tds") for p in (one, two, other)]
    assert parts[0] == parts[1] != parts[2]
    _, single = sample("rigol", tmp_path)
    assert part_of(look(single)[0], "rigol") is None
