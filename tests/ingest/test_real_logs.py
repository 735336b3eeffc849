"""Real instrument files: channels, units, rows, rate, first and last values, or the refusal and its remedy."""

from pathlib import Path

import numpy as np
import pytest

from mrfit.core.recording import Recording
from mrfit.ingest.dispatch import FALLBACK, claims
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings
from mrfit.ingest.text.head import open_head
from tests.ingest.examining import examine
from tests.ingest.real_truths import PRESS, RAW_PRESS, REFUSED, TABLE, TRUTHS, Truth, mm


def _read(real_logs: Path, tmp_path: Path, file: str, channel_map: str) -> tuple[list[Recording], list[Refusal]]:
    path = None
    if channel_map:
        path = tmp_path / "map.toml"
        path.write_text(channel_map)
    return examine([real_logs / file], Settings(map=path))


@pytest.mark.parametrize("truth", TRUTHS, ids=lambda t: f"{t.file}#{t.piece}")
def test_log_is_read_as_it_is(truth: Truth, real_logs: Path, tmp_path: Path) -> None:
    recordings, _ = _read(real_logs, tmp_path, truth.file, truth.map)
    assert len(recordings) == truth.pieces
    record = recordings[truth.piece]
    assert record.reader == truth.reader
    assert (record.rows_kept, record.rows_refused) == (truth.rows, truth.refused)
    assert record.samples == (truth.samples or truth.rows)
    assert record.start == pytest.approx(truth.start, abs=1e-12 + 1e-9 * abs(truth.start))
    if truth.rate:
        assert 1.0 / record.dt == pytest.approx(truth.rate, rel=5e-6)
    assert set(truth.channels) <= set(record.channels)
    if not truth.file.endswith(".mat"):  # those hold the whole workspace of their authors
        assert set(record.channels) == set(truth.channels)
    for name, (unit, first, last) in truth.channels.items():
        assert record.units[name] == unit
        assert record.channels[name][0] == pytest.approx(first, rel=1e-9, abs=1e-15)
        if not np.isnan(last):
            assert record.channels[name][-1] == pytest.approx(last, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(("file", "reason", "remedy"), REFUSED, ids=[r[0] for r in REFUSED])
def test_log_is_refused_with_its_remedy(file: str, reason: str, remedy: str, real_logs: Path, tmp_path: Path) -> None:
    recordings, refusals = _read(real_logs, tmp_path, file, "")
    assert not recordings
    assert len(refusals) == 1
    assert reason in refusals[0].reason
    assert remedy in refusals[0].remedy


def test_preprocessed_press_logs(real_logs: Path, tmp_path: Path) -> None:
    """Every file against numpy.loadtxt, with its conditions in SI and the untrue amplitude said."""
    recordings, refusals = _read(real_logs, tmp_path, "mr_damper_utfsm/preprocessed", PRESS)
    assert not refusals and len(recordings) == 10
    for record in recordings:
        table = np.loadtxt(record.source)
        assert record.rows_kept == len(table)
        assert record.dt == pytest.approx(table[1, 0] - table[0, 0], rel=1e-9)
        np.testing.assert_allclose(record.channels["displacement"], table[:, 1] * mm, rtol=1e-12)
        np.testing.assert_allclose(record.channels["velocity"], table[:, 2] * mm, rtol=1e-12)
        np.testing.assert_allclose(record.channels["force"], table[:, 3], rtol=1e-12)
        stem = Path(record.source).stem.replace("x", ".").removesuffix("A")
        stroke, rest = stem.split("mm")
        frequency, current = rest.split("Hz")
        assert record.condition["amplitude"] == pytest.approx(float(stroke) * mm)
        assert record.condition["frequency"] == float(frequency)
        assert record.condition["current"] == float(current)
        said = [f.kind for f in record.findings]
        assert ("condition-differs" in said) == (stroke == "2")  # 1.62 mm where the name says 2 mm


def test_rig_logs_in_mat_files(real_logs: Path, tmp_path: Path) -> None:
    from scipy.io import loadmat

    recordings, _ = _read(real_logs, tmp_path, "mr_damper_labcontrol", TABLE)
    read = {Path(r.source).name: r for r in recordings}
    files = sorted((real_logs / "mr_damper_labcontrol").glob("*.mat"))
    assert sorted(read) == [f.name for f in files]
    for file in files:
        whole = loadmat(file)
        record = read[file.name]
        assert record.dt == pytest.approx(float(whole["Ts"].item()), rel=1e-6)
        np.testing.assert_allclose(record.channels["displacement"], whole["x_F"][:, 0] * mm, atol=1e-15)
        np.testing.assert_allclose(record.channels["velocity"], whole["x_F"][:, 1] * mm, atol=1e-15)
        np.testing.assert_allclose(record.channels["force"], whole["x_F"][:, 2], atol=1e-12)
        assert record.rows_refused == 0


def test_conditions_of_runs_come_from_the_map(real_logs: Path, tmp_path: Path) -> None:
    recordings, _ = _read(real_logs, tmp_path, "mr_damper_utfsm/raw/ME2mm5Hz.txt", RAW_PRESS)
    assert [r.condition["current"] for r in recordings] == [0.0, 0.25, 0.5, 0.75, 1.0]
    peaks = [float(np.ptp(r.channels["force"])) for r in recordings]
    assert peaks == sorted(peaks)  # a magnetorheological damper is stiffer at more current


def test_exchanged_force_and_displacement_are_noticed(real_logs: Path, tmp_path: Path) -> None:
    exchanged = RAW_PRESS.split("[[files]]")[0]  # the map of the other series
    recordings, _ = _read(real_logs, tmp_path, "mr_damper_utfsm/raw/ME5mm4Hz.txt", exchanged)
    assert all(any(f.kind == "sign" and f.channel == "force" for f in r.findings) for r in recordings)


def test_every_file_is_read_or_refused_and_claimed_once(real_logs: Path) -> None:
    recordings, refusals = examine([real_logs], Settings())
    files = {str(p) for p in real_logs.rglob("*") if p.is_file() and p.suffix not in (".md", ".toml")}
    joined = {str(p) for p in files if "F0004CH" in p or "I8-3-1-dc" in p}
    assert files - {r.source for r in recordings} - {r.path for r in refusals} <= joined


def test_every_file_stands_in_the_tables(real_logs: Path) -> None:
    """Each file is in TRUTHS or REFUSED by its own name, or in a folder that is one record."""
    named = {t.file for t in TRUTHS} | {r[0] for r in REFUSED}
    files = {str(p.relative_to(real_logs)) for p in real_logs.rglob("*") if p.is_file() and p.suffix != ".md"}
    assert {f for f in files if f not in named and str(Path(f).parent) not in named} == set()


def test_every_sniffer_over_every_file(real_logs: Path) -> None:
    """A file's own reader claims it and no other does; none claims what no instrument's reader reads."""
    owner = {t.file: t.reader for t in TRUTHS}
    for path in sorted(p for p in real_logs.rglob("*") if p.is_file() and p.suffix != ".md"):
        try:
            head = open_head(path)
        except Refusal:
            continue  # nothing in it, or an archive: refused before any sniffer is asked
        name = str(path.relative_to(real_logs))
        part = owner.get(str(Path(name).parent), FALLBACK) if name not in {r[0] for r in REFUSED} else FALLBACK
        reader = "matlab" if name.endswith(".mat") else owner.get(name, part)
        assert claims(head) == ([] if reader == FALLBACK else [reader]), name


@pytest.mark.parametrize("name", ["renamed.dat", "extensionless", "UPPER.CSV"])
def test_real_files_under_other_names(name: str, real_logs: Path, tmp_path: Path) -> None:
    first = {t.file: t for t in reversed(TRUTHS) if (real_logs / t.file).is_file() and "ME5mm" not in t.file}
    chosen = list(first.values())
    for truth in chosen[:: 1 if name == "UPPER.CSV" else 4]:  # the map of ME5mm4Hz.txt goes by its name
        other = tmp_path / name
        other.write_bytes((real_logs / truth.file).read_bytes())
        recordings, _ = _read(tmp_path, tmp_path, name, truth.map)
        assert len(recordings) == truth.pieces
        assert recordings[0].reader == truth.reader
        assert recordings[0].rows_kept == truth.rows
