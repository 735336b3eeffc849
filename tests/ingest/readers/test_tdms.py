import io

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import signals, tdms


def _file(*channels: ChannelObject) -> bytes:
    buffer = io.BytesIO()
    with TdmsWriter(buffer) as writer:
        writer.write_segment(list(channels))
    return buffer.getvalue()


def test_groups_and_rates_are_records_of_their_own(read_log: ReadLog) -> None:
    _, one, two = signals()
    data = _file(
        ChannelObject("fast", "Load", one, properties={"wf_increment": 1e-3, "NI_UnitDescription": "N"}),
        ChannelObject("slow", "Oil", two[::2], properties={"wf_increment": 2e-3, "unit_string": "degC"}),
    )
    fast, slow = read_log(data, "run.tdms")
    assert (fast.dt, slow.dt) == (1e-3, 2e-3)
    assert (fast.units, slow.units) == ({"force": "N"}, {"temperature": "degC"})


def test_time_channel_where_no_waveform_is_stated(read_log: ReadLog) -> None:
    time, one, _ = signals()
    data = _file(ChannelObject("rig", "Time (s)", time), ChannelObject("rig", "Load (kN)", one))
    (record,) = read_log(data, "run.tdms")
    assert record.dt == 1e-3
    np.testing.assert_allclose(record.channels["force"], 1e3 * one)


def test_damaged_file_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal):
        read_log(tdms().data[:60], "run.tdms")
