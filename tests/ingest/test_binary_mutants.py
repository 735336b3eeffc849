"""Damaged binary logs end in a read or one line, within 30 s and 1 GB."""

import pytest

from mrfit.ingest.containers import subprocess_reader
from tests.ingest import binary_mutants
from tests.ingest.binary_mutants import SAMPLES, mutant, run
from tests.ingest.examining import examine


def test_every_undamaged_sample_is_read(tmp_path) -> None:  # type: ignore[no-untyped-def]
    from mrfit.ingest.stage import Settings

    for name, make in SAMPLES.items():
        made = make()
        recordings, refusals = examine([made.write(tmp_path / name)], Settings())
        assert recordings and not refusals, name


def test_the_same_number_damages_in_the_same_way() -> None:
    data = SAMPLES["hdf5"]().data
    assert mutant("hdf5", data, 3) == mutant("hdf5", data, 3) != mutant("hdf5", data, 4)


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_a_few_mutants(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # a library that goes round in circles is ended in time, here earlier; the long campaign waits as long as a user
    assert subprocess_reader.READING_SECONDS < binary_mutants.LONGEST
    monkeypatch.setattr(subprocess_reader, "READING_SECONDS", 3.0)
    monkeypatch.setattr(binary_mutants, "LONGEST", 8.0)
    campaign = run(name, 20)
    assert not campaign.broken
    assert campaign.count == 20 and campaign.refused > 0


def test_a_campaign_can_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(binary_mutants, "LARGEST", -1.0)
    assert len(run("parquet", 2).broken) == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_two_thousand_mutants(name: str) -> None:
    assert not run(name, 2000).broken
