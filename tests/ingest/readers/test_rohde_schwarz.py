from pathlib import Path

import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings
from tests.ingest.conftest import ReadLog
from tests.ingest.examining import examine
from tests.ingest.samples import RS_SETTINGS, rohde_schwarz, signals, table

XML = '<Prop Name="XStart" Value="-0.05"/><Prop Name="Resolution" Value="0.001" UserValue="1ms"/>'


def test_rows_alone_need_a_map(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="no header says what its 2 columns are"):
        read_log(rohde_schwarz().data, "RefCurve.Wfm.csv")


@pytest.mark.parametrize(("name", "settings"), [("RefCurve.csv", RS_SETTINGS), ("RefCurve.bin", XML)])
def test_settings_beside_the_rows(name: str, settings: str, read_log: ReadLog, tmp_path: Path) -> None:
    (tmp_path / name).write_text(settings)
    (record,) = read_log(rohde_schwarz().data, "RefCurve.Wfm.csv")
    assert record.reader == "rohde-schwarz"
    assert (record.dt, record.start) == (1e-3, -0.05)


def test_rows_with_times(read_log: ReadLog, tmp_path: Path) -> None:
    (tmp_path / "RefCurve.csv").write_text(RS_SETTINGS)
    (record,) = read_log(table(), "RefCurve.Wfm.csv")
    assert len(record.channels) == 2
    np.testing.assert_array_equal(record.channels["c1w1"], signals()[1])


def test_settings_file_alone_is_refused(tmp_path: Path) -> None:
    (tmp_path / "RefCurve.csv").write_text(RS_SETTINGS)
    recordings, refusals = examine([tmp_path], Settings())
    assert not recordings and len(refusals) == 1
