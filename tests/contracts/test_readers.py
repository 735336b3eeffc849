"""What every reader in the registry must keep, whatever its format."""

from pathlib import Path

import numpy as np
import pytest

from mrfit.contracts.check import Check
from mrfit.contracts.readers import READER_CHECKS, Case
from mrfit.core import registry
from mrfit.core.built_in import own_names
from mrfit.core.recording import Recording
from mrfit.errors import DataError
from mrfit.ingest.dispatch import FALLBACK, claims, reader_of
from mrfit.ingest.stage import Settings
from mrfit.ingest.text.head import open_head
from tests.ingest.examining import examine
from tests.ingest.samples import WRITERS, sample

NAMES = list(own_names("reader"))
WHOLE_ONLY = {"hdf5", "json-log", "matlab", "mdf", "parquet"}  # compressed, or with their directory at the end
OWN_NAME = {"rohde-schwarz"}  # known by its file's name, since its rows are bare


def _one(path: Path) -> Recording:
    recordings, refusals = examine([path], Settings())
    assert not refusals
    assert len(recordings) == 1
    return recordings[0]


def test_every_reader_has_a_sample() -> None:
    assert sorted(WRITERS) == NAMES, "add a sample to WRITERS in tests/ingest/samples.py"


def _case(name: str, folder: Path) -> Case:
    truth = WRITERS[name]()
    return Case(registry.load("reader", name), folder, truth.name, truth.data, name in OWN_NAME, name in WHOLE_ONLY)


CASES = [
    (name, check) for name in NAMES if name in WRITERS for check in READER_CHECKS if check.applies(_case(name, Path()))
]


@pytest.mark.parametrize(("name", "check"), CASES, ids=[f"{name} {check.name}" for name, check in CASES])
def test_reader_keeps(name: str, check: Check, tmp_path: Path) -> None:
    sample(name, tmp_path)  # with what the instrument writes beside it
    check.run(_case(name, tmp_path))


@pytest.mark.parametrize("name", NAMES)
def test_spec_names_the_reader(name: str) -> None:
    assert registry.load("reader", name).SPEC.name == name


@pytest.mark.parametrize("name", NAMES)
def test_reads_channels_units_rate_and_values(name: str, tmp_path: Path) -> None:
    truth, path = sample(name, tmp_path)
    record = _one(path)
    assert record.reader == name
    assert record.dt == pytest.approx(truth.dt, rel=1e-9)
    assert record.start == pytest.approx(truth.start, abs=1e-12)
    assert set(record.channels) == set(truth.channels)
    for channel, values in truth.channels.items():
        assert record.units[channel] == truth.units[channel]
        np.testing.assert_allclose(record.channels[channel], values, rtol=1e-12, atol=1e-15)
    assert record.rows_kept == len(values)
    assert record.rows_refused == 0


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("other", sorted({*WRITERS} - {FALLBACK}))
def test_each_reader_sees_its_own_marks_only(name: str, other: str, tmp_path: Path) -> None:
    """All readers by all samples, also under the name that the instrument of another sample gives."""
    _, path = sample(name, tmp_path / "own")
    assert registry.load("reader", other).sniff(open_head(path)) is (name == other)
    if not OWN_NAME & {name, other}:
        truth, _ = sample(name, tmp_path)
        renamed = truth.write(tmp_path, WRITERS[other]().name)
        assert claims(open_head(renamed)) == ([] if name == FALLBACK else [name])


BOTH = {
    ("siglent", "gwinstek"): "Memory Length,3,\nSource,CH1\nSecond,Volt\n0,1\n1,2\nWaveform Data,\n",
    ("picoscope", "digilent"): "#Digilent WaveForms\n(s),(V)\n\n0,1\n1,2\n2,3\n",
}


@pytest.mark.parametrize("names", BOTH)
def test_a_file_with_the_marks_of_two_formats_is_refused_with_both_names(
    names: tuple[str, str], tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    path.write_text(BOTH[names])
    assert claims(open_head(path)) == sorted(names)
    with pytest.raises(DataError, match=f"marks of more than one format .{' and '.join(sorted(names))}."):
        reader_of(open_head(path))


@pytest.mark.parametrize("name", sorted(set(NAMES) - OWN_NAME - {FALLBACK}))
def test_a_header_counts_for_more_than_a_file_name(name: str, tmp_path: Path) -> None:
    """A name as Rohde & Schwarz gives it, with its settings beside, is no evidence against another's header."""
    truth, _ = sample("rohde-schwarz", tmp_path)
    path = tmp_path / truth.name
    path.write_bytes(WRITERS[name]().data)
    assert claims(open_head(path)) == [name]


@pytest.mark.parametrize("other", ["renamed.bin", "extensionless", "UPPER.TXT"])
@pytest.mark.parametrize("name", sorted(set(NAMES) - OWN_NAME))
def test_file_name_does_not_matter(name: str, other: str, tmp_path: Path) -> None:
    truth, path = sample(name, tmp_path, other)
    record = _one(path)
    assert record.reader == name
    values = sorted(float(v[0]) for v in record.channels.values())
    assert values == pytest.approx(sorted(float(v[0]) for v in truth.channels.values()))


@pytest.mark.parametrize("name", sorted(set(NAMES) - WHOLE_ONLY))
def test_half_a_file_is_read_as_far_as_it_goes(name: str, tmp_path: Path) -> None:
    truth, path = sample(name, tmp_path)
    path.write_bytes(truth.data[: len(truth.data) // 2])
    record = _one(path)
    cut = record.rows_kept - 1  # the last row may be cut inside a number
    assert cut > 100
    for channel, values in record.channels.items():
        np.testing.assert_allclose(values[:cut], truth.channels[channel][:cut], rtol=1e-12)
