import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog

HEAD = "Header Size:  7\r\nVersion:  2\r\nSampling Interval:  0.01\r\nSampling Rate:  100\r\nSample Count:  {n}\r\n"
NAMES = "Sample Number, Date/Time, CHANNEL0, Events\r\n"


def _log(events: dict[int, str], stamps: list[str]) -> str:
    rows = [
        f"{k + 1:10d},   {stamp}, {0.5 * k:.4f}" + (f", {events[k]}" if k in events else "") + "\r\n"
        for k, stamp in enumerate(stamps)
    ]
    return HEAD.format(n=len(stamps)) + NAMES + "".join(rows)


def _stamps(second: int, count: int, form: str = "04/29/2022 12:11:{s:02d}.{m:03d} PM") -> list[str]:
    return [form.format(s=second + k // 100, m=10 * (k % 100)) for k in range(count)]


def test_pause_and_resume_split_the_log(read_log: ReadLog) -> None:
    events = {0: "DAQ Start", 119: "DAQ Pause", 120: "DAQ Resume", 199: "DAQ Pause"}
    first, second = read_log(_log(events, _stamps(10, 120) + _stamps(40, 80)))
    assert (first.rows_kept, second.rows_kept) == (120, 80)
    assert second.start == pytest.approx(30.0)
    assert second.channels["channel0"][0] == 60.0
    assert {f.kind for f in first.findings} >= {"new-run"}


def test_resume_without_a_pause_of_the_clock_still_splits(read_log: ReadLog) -> None:
    assert len(read_log(_log({50: "DAQ Resume"}, _stamps(10, 120)))) == 2


def test_gap_without_any_event_splits_too(read_log: ReadLog) -> None:
    assert len(read_log(_log({}, _stamps(10, 120) + _stamps(40, 80)))) == 2


@pytest.mark.parametrize("form", ["29/04/2022 11:11:{s:02d}.{m:03d} PM", "04/29/2022 23:11:{s:02d}.{m:03d}"])
def test_other_forms_of_stamps(form: str, read_log: ReadLog) -> None:
    (record,) = read_log(_log({}, _stamps(10, 50, form)))
    assert record.dt == 0.01


def test_unknown_form_of_stamp_is_shown(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="unknown form of time stamp '29. April'"):
        read_log(_log({}, ["29. April"] * 50))
