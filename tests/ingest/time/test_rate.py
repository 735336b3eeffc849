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
        ("Abtastintervall [ms];2,0", 2e-3),
        ("Fréquence d'échantillonnage;500 Hz", 2e-3),
        ("Frecuencia de muestreo: 500 Hz", 2e-3),
        ("采样频率:500Hz", 2e-3),
        ("Sampling: 500 Hz", 2e-3),
        ("Δt = 2 ms", 2e-3),
        ("dt,0.002", 2e-3),
        ("Interval (us),2000", 2e-3),
        ("Interval between tests: 5 min", None),
        ("Sampling: on", None),
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
        ("fs=500 Hz", 2e-3),
        ("FS = 10 kN", None),  # full scale
        ("FS: 10", None),
        ("Rate: 0.5 kSa/s", 2e-3),
        ("Rate: 2 Hz", None),  # of a test
        ("Sine test, rate: 500 Hz", None),
        ("Messrate: 500 Werte/s", 2e-3),
        ("Abtastrate 500 1/s", 2e-3),
        ("500 Hz sine", None),
        ("500 Hz sampling filter: 100 Hz", None),
        ("fs [Hz] = 500", 2e-3),
        ("f_s [Hz] = 500", 2e-3),
        ("fs;0,5;kHz", 2e-3),
        ("dt = 0.002 sec", 2e-3),
        ("dt\t0.002\tsec", 2e-3),
        ("dx = 0.002 s", 2e-3),
        ("dx = 0.002 mm", None),
        ("Sampling,2ms", 2e-3),
        ("Sampling: 500 points per revolution", None),
        ("2 ms/div", None),
        ("Frame rate of the camera: 240 Hz", None),
        ("Baud rate: 115200", None),
        ("Ramp rate: 500 mm/s", None),
        ("Strain rate: 0.1 1/s", None),
        ("Samples per second: 500", 2e-3),
        ("Abtastrate [kHz]: 0.5", 2e-3),
        ("dt = 2E-3 s", 2e-3),
        ("dt: 2", None),
        ("Abtastrate: 500/s", 2e-3),
        ("Sampling: 1 kS/s", 1e-3),
        ("Rate: 500 samples per second", 2e-3),
        ("Scan rate: 500 scans/sec", 2e-3),
        ("Sampled at 500 Hz", 2e-3),
        ("DAQ rate = 500Hz", 2e-3),
        ("SPS: 500", 2e-3),
        ("SPS unit 3", None),
        ("#fs:500", 2e-3),
        ("Frequenza di campionamento: 500 Hz", 2e-3),
        ("# dt=2e-3", 2e-3),
        ("# Ts = 0.002 s", 2e-3),
        ("Boots = 2 s", None),
        ("Abtastzeit: 2 ms", 2e-3),
        ("Intervall: 0,002 s", 2e-3),
        ("Time interval,1.0000ms", 1e-3),
        ("サンプリング周期：2 ms", 2e-3),
        ("Time per point = 2.0 ms", 2e-3),
        ("Storage cycle,500us", 5e-4),
        ("Logging every 2 ms", 2e-3),
        ("Sampled every 2nd cycle", None),
        ("Strain rate 0.1 /s", None),
        ("Strain rate: 2 points/s", None),
        ("dx = 0.5", None),
        ('"HResolution",0.002,0.002', 2e-3),
        ("dx:\t0,0025\t0,0025", 2.5e-3),
        ("#CLOCK=1.000mS", 1e-3),
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


@pytest.mark.parametrize(
    ("header", "rate"),
    [
        ("Display update sample rate,10,Hz\nAcquisition sample rate,500,Hz", 500.0),
        ("Sample rate: 500 Hz\nMax sample rate: 100000 Hz", 500.0),
        ("Sampling rate (maximum): 1000\nSampling rate: 500", 500.0),
        ("Sample rate,500\nSampling interval,0.002", 500.0),
        ("Sample rate: 30 Hz\nSample interval: 0.0333 s", 30.0),
        ("Sample rate: 500 Hz\nLogging interval: 2 ms", 500.0),
        ("Total samples: 1500, sample rate: 500 Hz", 500.0),
        ("Sample rate: 500 Hz\nDecimation: 1", 500.0),
        ("Sample rate: 500 Hz\nDecimation factor,none", 500.0),
        ("Sample rate: 500 Hz\nTest frequency: 2 Hz\nFilter frequency: 100 Hz", 500.0),
        ("Sample rate: 1000 Hz\nSample rate: 500 Hz", None),
        ("Sample rate: 500 Hz\nSampling interval: 0.01 s", None),
        ("Acquisition rate: 1000 Hz\nStorage rate: 500 Hz", None),
        ("Scan rate,5000\nLogged interval,2,ms", None),
        ("Max sample rate: 500 Hz", None),
        ("Sample rate: 500 Hz (max)", None),
        ("max_sample_rate = 500", None),
        ("Display sample rate: 10", None),
        ("Sample rate of the display: 25 Hz", None),
        ("Aggregate sample rate: 4000 Hz", None),
        ("Sampling period of the record: 3 s", None),
        ("Acquisition time: 3 s", None),
        ("Sampling time (record length): 0.4", None),
        ("Sample rate: 5000 Hz\nDecimation: 10", None),
        ("Sample rate: 5000 Hz, decimated by 10", None),
        ("Sample rate: 5000 Hz\nAveraging: 5 samples", None),
        ("Sample rate: 5000 Hz\nAverages: 5", None),
        ("Sample rate: 5000 Hz\nAverages: 1", 5000.0),
        ("Sample rate: 5000 Hz\nOversampling: 4", None),
        ("Sample rate: 5000 Hz\nNth sample: 5", None),
        ("Sample rate: 5000 Hz\nMoving average, then decimated", None),
        ("Sample rate: 5000 Hz\nnot decimated", 5000.0),
        # ms or kHz may be meant
        ("Sample interval: 5", None),
        ("Sample rate: 0.2", None),
        ("Sample interval: 5 s", 0.2),
        ("Sample rate,5000\nDown-sampling factor,10", None),
        ("Sampling rate: 5000\nStored every 10th sample", None),
        ("Sampling rate: 5000\nAveraging over 10 samples", None),
        ("Logging rate: 500 Hz", None),
        ("sample_rate_hz: 500", 500.0),
        ("Sample rate: 1000 Hz\nSave every nth sample,2", None),
        ("Sample rate: 1000 Hz\nStored every,2", None),
        ("Sample rate: 1000 Hz\nLogged one of 2 samples", None),
        ("Sample rate: 1000 Hz\nRate divisor: 2", None),
        ("Sample rate: 1000 Hz\nReduction: 2", None),
        ("Sample rate: 1000 Hz\nResampled to 500 Hz", None),
        ("Sample rate: 1000 Hz\nOutput rate: 500 Hz", None),
        ("Sample rate: 5000 Hz, averaged 10x", None),
        ("Sampling rate (all channels): 1000 Hz", None),
        ("Sample rate: 1000 Hz multiplexed over 2 channels", None),
        ("Sample rate: 500 Hz\nResampling: none", 500.0),
        ("Tastkopf: 10 kHz Bandbreite\nAbtastrate: 1000 Hz", 1000.0),
        ("Filtro de muestreo 300 Hz", None),
        ("Temperature: 10 readings per minute\nSample rate: 1000 Hz", 1000.0),
        ("Laser scan rate 500 Hz", 500.0),
        ("Previous file used a 1000 Hz sampling rate; this one differs", None),
    ],
)
def test_a_rate_is_believed_where_nothing_speaks_against_it(header: str, rate: float | None) -> None:
    found, findings = stated_interval(header.split("\n"))
    assert found == (None if rate is None else pytest.approx(1.0 / rate))
    assert [f.kind for f in findings] == ([] if rate else ["rate-unclear"])


@pytest.mark.parametrize(
    "header",
    [
        "Display update sample rate,10,Hz",
        "Sample rate,1000,Hz\nSample rate,250,Hz",
        "Sample rate,5000,Hz\nDecimation,10",
    ],
)
def test_the_times_decide_over_a_doubtful_rate_and_without_them_it_is_asked_for(header: str, read_log: ReadLog) -> None:
    rows = [(0.002 * k, k % 7) for k in range(100)]
    (record,) = read_log(f"{header}\nTime (s),Force (N)\n" + "".join(f"{t:.3f},{v}\n" for t, v in rows))
    assert record.dt == pytest.approx(2e-3)
    with pytest.raises(Refusal, match=r"no sample rate .*not used.*rate = HZ"):
        read_log(f"{header}\nForce (N),Disp (mm)\n" + "".join(f"{v},{v / 9:.4f}\n" for _, v in rows))
    (record,) = read_log(f"{header}\nForce (N)\n" + "".join(f"{v}\n" for _, v in rows), channel_map="rate = 500\n")
    assert record.dt == pytest.approx(2e-3)


def test_only_the_beginning_of_a_long_line_states_a_rate() -> None:
    assert stated_interval(["Sampling rate: 500 Hz" + ", 0" * 5000]) == (pytest.approx(2e-3), ())
    assert stated_interval(["0, " * 5000 + "Sampling rate: 500 Hz"]) == (None, ())


@pytest.mark.parametrize(
    ("header", "rate"),
    [
        ("500 SPS", 500.0),
        ("500 S/s per channel", 500.0),
        ("Acquired at 500 samples/s", 500.0),
        ("30000 samples/min", 500.0),
        ("500 Hz sampling rate", 500.0),
        ("acquisition at 500 Hz", 500.0),
        ("500 S/s near the mains", 500.0),
        ("500 Sa/s, 50 Hz hum removed", 500.0),
        ("recorded at 60 Hz excitation", None),
        ("recorded with 4800 Hz carrier frequency amplifier", None),
        ("4 ms sampling aperture", None),
        ("Recorded with 0.5 kHz", 500.0),
        ("2 ms sampling", 500.0),
        ("Recorded at 21.5 degC, 2 Hz sine", None),
        ("Earthquake record of El Centro, acquisition at 50 m", None),
        ("logged with 10 Hz", None),
        ("Mains hum recorded at 50 Hz", None),
        ("Thermocouples recorded at 100 Hz", None),
        ("2 ms sampling delay", None),
        ("Passo di campionamento;0,002;s", 500.0),
        ("Tastperiode: 2 ms", 500.0),
        ("2 msec/sample", 500.0),
        ("Samples,Sample rate,Mode\n800,500,Finite", 500.0),
        # what is clear is taken, and what says another rate is told
        ("Sample rate: 500 Hz\nRate: 100 Hz", 500.0),
        ("500 samples/s\nSample rate: 1 kHz", 1000.0),
        ("DAQ: NI 6009, 5 kHz DAQ module\nSample rate: 1000 Hz", 1000.0),
        ("Max,Sample rate\n9,5000\nSample rate,1000", 1000.0),
        ("one sample every 2 ms", 500.0),
        ("Bridge voltage readings every 10 ms\nSample rate: 1000 Hz", 1000.0),
        ("NI USB-6211 250 kS/s\nSample rate: 1000 Hz", 1000.0),
        ("Encoder 4096 samples/s", None),
        ("Sine 2 Hz Sample A", None),
        ("200 Hz scan of the bench", None),
        ("Test (sine) @ 100 Hz", None),
        ("Damper A (front) @ 100 Hz", None),
        ("Tastatur 50 Hz", None),
        ("Rate: 500 Hz", 500.0),
        ("Force (N) @500Hz,Stroke (mm) @500Hz", 500.0),
        ("Samples,Rate,Mode\n800,500 Hz,Finite", 500.0),
        ("Force (N) @500Hz,Stroke (mm) @250Hz", None),
        ("Sine (mm) @ 2 Hz", None),
        ("12 mm @ 100 Hz", None),
    ],
)
def test_a_rate_that_may_be_that_of_a_test_is_taken_where_it_is_high_and_said(header: str, rate: float | None) -> None:
    found, findings = stated_interval(header.split("\n"))
    assert found == (rate and pytest.approx(1.0 / rate))
    assert [f.kind for f in findings] == ["rate-assumed"] * bool(rate)


def test_a_rate_below_the_rows_of_another_test_is_not_read(read_log: ReadLog) -> None:
    other = "Time (ms)\tForce (N)\tLoad (N)\n" + "".join(f"{4 * k}\t{k % 5}\t{k % 3}\n" for k in range(50))
    with pytest.raises(Refusal, match="no sample rate"):
        read_log(f"Stroke (mm)\tForce (N)\n{ROWS}\n{other}\nSample rate: 250 Hz\n")


def test_a_rate_below_the_rows_is_read_and_one_that_is_assumed_only_where_no_times_are(read_log: ReadLog) -> None:
    (record,) = read_log(f"Stroke (mm)\tForce (N)\n{ROWS}\nSample rate: 500 Hz\nOperator: KL\n")
    assert record.dt == pytest.approx(2e-3)
    (record,) = read_log(f"Sample rate: 500 Hz\nStroke (mm)\tForce (N)\n{ROWS}\nThermocouple sampling 10 Hz\n")
    assert record.dt == pytest.approx(2e-3)
    (record,) = read_log(f"Rate: 500 Hz\nTime (ms)\tForce (N)\n{ROWS}")
    assert record.dt == pytest.approx(1e-3) and "rate-assumed" not in {f.kind for f in record.findings}


@pytest.mark.parametrize(
    "line",
    ["sampling" + "," * 990, "1sps " * 200, "1'0'0 samples/s", "Sample interval: 1e400 s", "Sample rate 6211 250 Hz"],
)
def test_hostile_headers_take_no_time_and_state_nothing(line: str) -> None:
    assert stated_interval([line])[0] is None
