import io

import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import signals, tdms


def _file(*channels: ChannelObject | GroupObject | RootObject) -> bytes:
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


@pytest.mark.parametrize(("increment", "said"), [(1.0, ["rate-doubtful"]), (0.5, [])])
def test_an_increment_that_may_not_have_been_set_is_said(increment: float, said: list[str], read_log: ReadLog) -> None:
    data = _file(ChannelObject("rig", "Load (kN)", signals()[1], properties={"wf_increment": increment}))
    (record,) = read_log(data, "run.tdms")
    assert record.dt == increment and [f.kind for f in record.findings if f.kind == "rate-doubtful"] == said


@pytest.mark.parametrize("increment", [None, 1.0, 1e-2])
@pytest.mark.parametrize("stamped", [False, True])
@pytest.mark.parametrize("apart", [False, True])
def test_times_of_a_file_are_its_clock_whatever_increment_programs_write(
    increment: float | None, stamped: bool, apart: bool, read_log: ReadLog
) -> None:
    """Programs write an increment of 1 to channels without a waveform; the times may have none, or their own group."""
    time, one, _ = signals()
    times = np.datetime64("2024-05-01T12:00:00") + np.round((time - time[0]) * 1e6).astype("timedelta64[us]")
    about = {} if increment is None else {"wf_increment": increment}
    clock = ChannelObject("clock" if apart and increment is None else "rig", "Time", times if stamped else time)
    (record,) = read_log(_file(clock, ChannelObject("rig", "Load (kN)", one, properties=about)), "run.tdms")
    assert record.dt == pytest.approx(1e-3) and list(record.channels) == ["force"]
    assert ("rate-differs" in {f.kind for f in record.findings}) == (increment is not None)


def test_the_increment_has_the_unit_of_its_axis_and_the_map_chooses_the_times(read_log: ReadLog) -> None:
    time, one, _ = signals()
    about = {"wf_increment": 5.0, "wf_xunit_string": "ms", "wf_start_offset": 200.0}
    (record,) = read_log(_file(ChannelObject("rig", "Load (kN)", one, properties=about)), "run.tdms")
    assert (record.dt, record.start) == (pytest.approx(0.005), pytest.approx(0.2))
    chosen = _file(ChannelObject("rig", "Ticks", time), ChannelObject("rig", "Load (kN)", one, properties=about))
    (record,) = read_log(chosen, "run.tdms", 'time = {column = "Ticks", unit = "s"}')
    assert record.dt == pytest.approx(1e-3)


def test_different_start_times_keep_channels_apart(read_log: ReadLog) -> None:
    """Equal wf_start_offset but wf_start_time 3 s apart, as LabVIEW writes them (reported to npTDMS, 41)."""
    _, one, two = signals()
    begin = np.datetime64("2015-11-20T20:13:43.596313")
    clock = {"wf_increment": 1e-3, "wf_start_offset": 0.0, "wf_samples": len(one), "unit_string": "N"}
    data = _file(
        ChannelObject("Test Group", "Channel A", one, properties={**clock, "wf_start_time": begin}),
        ChannelObject("Test Group", "Channel B", two, properties={**clock, "wf_start_time": begin + 3_000_301}),
    )
    first, second = read_log(data, "run.tdms")
    assert (first.start, second.start) == (0.0, pytest.approx(3.000301))


def test_daqmx_names_and_units(read_log: ReadLog) -> None:
    """Properties as NI-DAQmx logs them (reported to npTDMS, 125)."""
    _, one, _ = signals()
    about = {"NI_ChannelName": "TC1", "unit_string": "Deg C", "NI_UnitDescription": "Deg C", "wf_increment": 1.0}
    begin = np.datetime64("2019-04-25T22:45:37.953401")
    more = {"wf_start_offset": 0.0, "wf_samples": 1, "wf_start_time": begin}
    (record,) = read_log(_file(ChannelObject("log", "TC1", 20.0 + one, properties={**about, **more})), "run.tdms")
    assert (record.dt, record.start, record.units) == (1.0, 0.0, {"temperature": "degC"})


def test_time_stamps_as_a_channel(read_log: ReadLog) -> None:
    time, one, _ = signals()
    stamps = np.datetime64("2024-05-01T12:00:00") + np.round((time - time[0]) * 1e6).astype("timedelta64[us]")
    data = _file(ChannelObject("rig", "Stamp", stamps), ChannelObject("rig", "Load (kN)", one))
    (record,) = read_log(data, "run.tdms")
    assert record.dt == pytest.approx(1e-3) and list(record.channels) == ["force"]


def test_a_spectrum_has_no_sample_rate(read_log: ReadLog) -> None:
    _, one, _ = signals()
    about = {"wf_increment": 0.5, "wf_xname": "Frequency", "wf_xunit_string": "Hz", "unit_string": "N"}
    with pytest.raises(Refusal, match="no time column and no sample rate"):
        read_log(_file(ChannelObject("fft", "Load", one, properties=about)), "run.tdms")


def test_damaged_file_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal):
        read_log(tdms().data[:60], "run.tdms")


@pytest.mark.parametrize(
    ("root", "group", "channel", "dt"),
    [
        ({"Sample Rate": 2000.0}, {}, {}, 0.0005),
        ({}, {"SamplingRate": "2 kHz"}, {}, 0.0005),
        ({}, {}, {"dt_ms": 0.5}, 0.0005),
        ({"Sample Rate": 2000.0}, {"SamplingRate": 500.0}, {}, None),
        ({"camera_sample_rate_hz": 30.0}, {}, {}, None),
        ({"Operator": "2000"}, {}, {}, None),
        ({"Sample Rate": 2000.0}, {}, {"wf_increment": 1.0}, 0.0005),
        ({"Sample Rate": 2000.0}, {}, {"wf_increment": 0.01}, 0.01),
    ],
)
def test_rates_among_properties(
    root: dict[str, object], group: dict[str, object], channel: dict[str, object], dt: float | None, read_log: ReadLog
) -> None:
    load = ChannelObject("rig", "Load (N)", signals()[1], properties=channel)
    data = _file(RootObject(root), GroupObject("rig", group), load)
    if dt is None:
        with pytest.raises(Refusal, match=r"not used|no sample rate \(columns: 'Load'\)"):
            read_log(data, "run.tdms")
        return
    (record,) = read_log(data, "run.tdms")
    assert record.dt == pytest.approx(dt)
    assert ("rate-doubtful" in {f.kind for f in record.findings}) == ("wf_increment" in channel)


@pytest.mark.parametrize("timed", [False, True])
def test_a_group_of_results_is_left_out(timed: bool, read_log: ReadLog) -> None:
    time, one, _ = signals()
    clock = [ChannelObject("Stats", "Time", np.arange(3.0))] if timed else []
    data = _file(
        ChannelObject("Test 1", "Time (s)", time),
        ChannelObject("Test 1", "Load (N)", one),
        *clock,
        ChannelObject("Stats", "Peak (N)", np.arange(3.0)),
    )
    records = read_log(data, "run.tdms")
    assert [r.history[1] for r in records] == ["group 'Stats' of the file"] * timed + ["group 'Test 1' of the file"]
    assert any(f.kind == "not-read" for f in records[0].findings) != timed
