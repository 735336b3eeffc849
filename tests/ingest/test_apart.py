"""What a library does to its own process must not reach ours."""

import os
import sys
import time
from pathlib import Path

import pytest

from mrfit.ingest import apart
from mrfit.ingest.channel_map import Rules
from mrfit.ingest.head import open_head
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source
from tests.ingest.samples import sample


def crash(*_: object) -> None:
    os.abort()


def hang(*_: object) -> None:
    time.sleep(600)


@pytest.fixture
def source(tmp_path: Path) -> Source:
    _, path = sample("matlab", tmp_path)
    return Source(open_head(path), Rules())


def test_tables_come_back_whole(source: Source) -> None:
    (table,) = apart.read_apart("matlab", source)
    assert [c.name for c in table.columns] == ["x_F[0]", "x_F[1]"]
    assert table.rows == 240


def test_a_crash_is_one_refusal_and_the_next_file_is_read(source: Source, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(apart, "read_tables", crash)
        with pytest.raises(Refusal, match="the matlab library crashes on it"):
            apart.read_apart("matlab", source)
    assert len(apart.read_apart("matlab", source)) == 1


def test_a_hang_ends(source: Source, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(apart, "read_tables", hang)
        with pytest.raises(Refusal, match="takes more than 3 s"):
            apart.read_apart("matlab", source, seconds=3.0)
    assert len(apart.read_apart("matlab", source)) == 1


@pytest.mark.parametrize(("reader", "library"), [("hdf5", "h5py"), ("tdms", "nptdms"), ("mdf", "asammdf")])
def test_a_missing_extra_is_named_with_its_command(
    reader: str, library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mrfit import registry

    _, path = sample(reader, tmp_path)
    monkeypatch.setitem(sys.modules, library, None)  # type: ignore[arg-type]
    with pytest.raises(Refusal) as error:
        registry.load("reader", reader).read(Source(open_head(path), Rules()))
    assert error.value.remedy == f"install it: pip install 'mrfit[{reader}]'"
