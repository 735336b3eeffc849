import pytest

from mrfit.ingest.refusal import Refusal
from mrfit.ingest.time.rate import stated_interval
from tests.ingest.conftest import ReadLog


@pytest.mark.parametrize(
    ("line", "interval"),
    [
        ("#Sample rate: 160000Hz", 6.25e-6),
        ("Sampling Rate:  200", 5e-3),
        ("Sample Interval,1.6e-06,", 1.6e-6),
        ("Sampling Interval:  0.005", 5e-3),
        ("Sample rate = 2 kHz", 5e-4),
        ("Scan rate 100 Sa/s", 1e-2),
        ("Sample rate: 10 kS/s", 1e-4),
        ("sample period: 4 ms", 4e-3),
        ("Sample Count: 7420", None),
        ("Sampling Rate:  0", None),
        ("Sampling time: 12:30:05", None),
        ("Trigger: Source: Channel 1", None),
        ("Sampling interval (ms): 1", 1e-3),
        ("Sampling interval in ms: 1", 1e-3),
        ("Sample rate (kHz),1", 1e-3),
        ('"Sample rate [kHz]","1"', 1e-3),
        ("Sample interval,1,ms", 1e-3),
        ("Sample interval,0.001,Channel 1", 1e-3),
        ("Sampling rate: 1,000 Hz", 1e-3),
        ("Sampling rate: 1 000 Hz", 1e-3),
        ("Sampling rate: 12,800 Hz", 1.0 / 12800.0),
        ("Sampling rate: 1,000,000", 1e-6),
        ("Sampling rate: 1,000.5 Hz", 1.0 / 1000.5),
        ("Sample rate: 1,5 kHz", 1.0 / 1500.0),
        ("Sample interval: 0,001 s", 1e-3),
    ],
)
def test_rates_and_intervals_in_headers(line: str, interval: float | None) -> None:
    found, findings = stated_interval([line])
    assert found == (None if interval is None else pytest.approx(interval))
    assert findings == ()


@pytest.mark.parametrize(
    ("delimiter", "decimal", "text", "rate"),
    [
        ("\t", ".", "1,000", 1000.0),
        ("\t", ",", "1,000", 1.0),
        ("\t", "", "1,000", None),  # whole numbers in all rows: the mark may mean either
        (";", ".", "1.000", 1.0),
        (";", ",", "1.000", None),
        (";", ",", "10.000,5", 10000.5),
        (",", ".", "100,200", None),  # a rate for each of two channels, or one
        (",", ".", "1.2.3", None),
    ],
)
def test_what_a_mark_means_is_seen_in_the_rows_or_said(
    delimiter: str, decimal: str, text: str, rate: float | None
) -> None:
    found, findings = stated_interval([f"Sampling rate: {text}"], delimiter, decimal)
    assert found == (None if rate is None else pytest.approx(1.0 / rate))
    assert [f.kind for f in findings] == ([] if rate is not None else ["rate-unclear"])


ROWS = "".join(f"{k}\t{k % 7}\n" for k in range(50))


def test_an_unclear_rate_is_told_where_it_is_needed(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="no sample rate .*'Sampling rate: 1,000 Hz' can be read in more than one way"):
        read_log(f"Sampling rate: 1,000 Hz\nVelocity (mm/s)\tForce (N)\n{ROWS}")
    (record,) = read_log(f"Sampling rate: 1,000 Hz\nTime (ms)\tForce (N)\n{ROWS}")
    assert record.dt == pytest.approx(1e-3)
    assert "rate-unclear" in {f.kind for f in record.findings}


def test_a_column_that_holds_the_rate_may_have_a_unit(read_log: ReadLog) -> None:
    rows = "".join(f"{k / 7:.3f},{k % 7},{2 if k == 0 else ''}\n" for k in range(100))
    (record,) = read_log(f"Displacement (mm),Force (N),Sample rate (kHz)\n{rows}")
    assert record.dt == pytest.approx(5e-4)
