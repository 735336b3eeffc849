"""Heads of real instrument files, in every clone: channels, units, rows, interval and first values."""

import re
from pathlib import Path

import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.real_truths import TRUTHS, Truth

HEADS = Path(__file__).parents[1] / "data" / "real_heads"
LOGS = sorted({p.name for p in HEADS.iterdir()} - {"README.md", "LICENSES.txt"})
# of the first run
ROWS = {
    "ME2mm5Hz.txt": 200,
    "5mm3Hz1A.txt": 200,
    "elcentro.dat": 200,
    "sampledatafiletype1.dat": 51,
    "multi_time_column.lvm": 3,
    "with_comments.lvm": 9,
    "long_single_header_multi_ch.lvm": 208,
    "DS1054Z-A.csv": 200,
    "DS1074Z-A.csv": 200,
    "DS2072A-6.csv": 200,
    "DS4024-A.csv": 200,
    "DS1102E-D.csv": 200,
    "DS1204B-F.csv": 200,
    "DS1052E.csv": 204,
    "rs_rtp_02.Wfm.csv": 200,
    "rs_rtp_04.Wfm.csv": 200,
}
RUNS = {"sampledatafiletype1.dat": 3}
BARE = ("5mm3Hz1A.txt", "elcentro.dat", "rs_rtp_02.Wfm.csv", "rs_rtp_04.Wfm.csv")


def truth_of(name: str) -> Truth:
    """What the whole file holds, of which the head has the first rows."""
    return next(t for t in TRUTHS if Path(t.file).name == name and t.piece == 0)


@pytest.mark.parametrize("name", LOGS)
def test_head_of_a_real_log(name: str, read_log: ReadLog) -> None:
    truth = truth_of(name)
    channel_map = re.sub(r"(?m)^\[condition\]\n.*\n", "", truth.map)  # it lists one for each run of the whole file
    recordings = read_log((HEADS / name).read_bytes(), name, channel_map)
    assert len(recordings) == RUNS.get(name, 1)
    record = recordings[0]
    assert record.reader == truth.reader
    assert (record.rows_kept, record.rows_refused) == (ROWS[name], 0)
    assert {c: record.units[c] for c in record.channels} == {c: unit for c, (unit, _, _) in truth.channels.items()}
    for channel, (_, first, _) in truth.channels.items():
        assert record.channels[channel][0] == pytest.approx(first, rel=1e-9, abs=1e-15)
    assert record.start == pytest.approx(truth.start, abs=1e-12 + 1e-9 * abs(truth.start))
    if truth.rate:
        assert 1.0 / record.dt == pytest.approx(truth.rate, rel=5e-5)


@pytest.mark.parametrize("name", BARE)
def test_a_head_without_names_asks_for_a_map(name: str, read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="no header says what its .* columns are.*channel map"):
        read_log((HEADS / name).read_bytes(), name)


def test_every_head_stands_in_the_readme_and_has_a_licence() -> None:
    about = (HEADS / "README.md").read_text()
    assert set(LOGS) == set(ROWS)
    assert all(f"`{name}`" in about for name in LOGS)
