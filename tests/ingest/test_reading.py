import hashlib
from pathlib import Path

import pytest

from mrfit.ingest.hashes import hash_of
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.reading import LogItem, read_item
from mrfit.ingest.refusal import Refusal
from tests.ingest.samples import sample


def test_hash_is_that_of_the_bytes(tmp_path: Path) -> None:
    truth, path = sample("rigol", tmp_path)
    assert hash_of(path) == hashlib.sha256(truth.data).hexdigest()
    with pytest.raises(Refusal, match="cannot be read"):
        hash_of(tmp_path / "none")


def test_damaged_part_is_refused_and_its_siblings_are_read(tmp_path: Path) -> None:
    truth, one = sample("tektronix-tds", tmp_path)
    two, three = tmp_path / "F0004CH2.CSV", tmp_path / "F0004CH3.CSV"
    two.write_bytes(truth.data.replace(b"CH1", b"CH2"))
    three.write_bytes(b"Record Length,1,,x,\n")
    item = LogItem(tuple((p, p.name) for p in (one, two, three)), "tektronix-tds", Rules())
    outcome = read_item(item)
    (record,) = outcome.recordings
    assert list(record.channels) == ["ch1", "ch2"]
    assert [r.path for r in outcome.refusals] == [str(three)]
    assert "joined F0004CH1.CSV, F0004CH2.CSV" in record.history
    assert record.source == str(one)
    assert record.sha256 == hashlib.sha256(b"F0004CH1.CSVF0004CH2.CSVF0004CH3.CSV").hexdigest()
