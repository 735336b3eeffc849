import numpy as np
import pytest

from mrfit.ingest.containers.rates import StatedNumber, kind_of, stated_rate, texts_in, told_in


@pytest.mark.parametrize(
    ("about", "dt"),
    [
        ({"sample_rate_hz": 500}, 0.002),
        ({"Sample Rate": 2000.0}, 0.0005),
        ({"SamplingRate": np.float32(1000.0)}, 0.001),
        ({"SampleFrequency": "1200"}, 1.0 / 1200.0),
        ({"sample_rate_kHz": 2}, 0.0005),
        ({"Sample Rate (Hz)": b"500"}, 0.002),
        ({"dt_ms": 2.0}, 0.002),
        ({"DeltaT_us": 500}, 0.0005),
        ({"dt_s": 0.002}, 0.002),
        ({"sample_rate": "500 Hz"}, 0.002),
        ({"SampleRate": "2 kS/s"}, 0.0005),
        ({"Sampling interval": "500 us"}, 0.0005),
        ({"daq sample rate": 500}, 0.002),
        ({"dt": 2, "dt_unit": "ms"}, 0.002),
        ({"metadata": {"sampling_frequency": {"value": 500, "unit": "Hz"}}}, 0.002),
        ({"fs": 500.0, "dt_ms": 2.0}, 0.002),
        ({"fs": 500.0, "camera_sample_rate_hz": 30}, 0.002),
        ({"fs": 500.0, "camera": {"fs": 30}}, 0.002),
        ({"fs": 500.0, "decimation": 1}, 0.002),
        ({"fs": 500.0, "logging_rate_hz": 500}, 0.002),
        ({"sampling": "2 ms"}, 0.002),
        ({"sampling_hz": 500}, 0.002),
        ({"fs": 500.0, "sampling": 5}, 0.002),
    ],
)
def test_attributes_state_the_rate(about: dict[str, object], dt: float) -> None:
    found, said = stated_rate(told_in(about))
    assert found == pytest.approx(dt) and said == ()


@pytest.mark.parametrize(
    ("about", "said"),
    [
        ({"camera_sample_rate_hz": 30}, "camera_sample_rate_hz = 30 Hz"),
        ({"filter": {"fs": 100}}, "filter.fs = 100"),
        ({"lowpass_fs_hz": 100}, "lowpass_fs_hz = 100 Hz"),
        ({"data_rate": 100}, "data_rate = 100"),
        ({"fs": 500, "rotor_sampling_rate_hz": 10000}, "fs = 500 and rotor_sampling_rate_hz = 10000 Hz"),
        ({"fs": 500, "sample_rate": "1 kHz"}, "fs = 500 and sample_rate = 1 kHz"),
        ({"fs": 500, "decimation_factor": 10}, "fs = 500 and decimation_factor = 10"),
        ({"sample_rate": "1,000 Hz"}, "sample_rate = 1,000 Hz"),
        ({"Ts": 5.0}, "Ts = 5 without a unit"),
        ({"dt": 5, "dt_unit": "parsec"}, "dt = 5 parsec"),
        ({"ramp": {"rate": 2, "unit": "mm/s"}}, "ramp.rate = 2 mm/s"),
        ({"loading": {"rate": 5.0}}, "loading.rate = 5"),
        ({"rate": 100, "unit": "kN/s"}, "rate = 100 kN/s"),
        ({"sampling": 5}, "sampling = 5"),
        ({"data_sampling_1": 5}, "data_sampling_1 = 5"),
        ({"sample_time": "10 s"}, "sample_time = 10 s"),
    ],
)
def test_a_rate_in_doubt_is_said_and_not_used(about: dict[str, object], said: str) -> None:
    found, (finding,) = stated_rate(told_in(about))
    assert found is None and finding.kind == "rate-unclear"
    assert finding.text == f"the file states {said}: not used"


@pytest.mark.parametrize(
    "about",
    [
        {"rates": 5},
        {"frame_rate": 30},
        {"cutoff_frequency": 100},
        {"fs": True},
        {"dt": "2024-05-01"},
        {"fs": -1.0},
        {"fs": np.nan},
        {"sample_rate": 10**400},
        {"note": "sample rate 500 Hz"},
        {"sample_rate": "x" * 10_000},
        {"sample rate " * 1000: 500},
    ],
)
def test_other_attributes_state_none(about: dict[str, object]) -> None:
    assert stated_rate(told_in(about)) == (None, ())


def test_many_that_state_the_same_are_said_once() -> None:
    told = [StatedNumber("fs", value, within="") for value in [500.0] * 40 + [100.0]]
    _, (finding,) = stated_rate(told)
    assert finding.text == "the file states fs = 500 and fs = 100: not used"


def test_texts_of_objects_stand_behind_the_innermost_name() -> None:
    assert texts_in({"a": "b", "metadata": {"units": {"force": "N"}}}) == {"a": "b", "units.force": "N"}


@pytest.mark.parametrize(("name", "kind"), [("SampleRate", "Hz"), ("dt_ms", "s"), ("force", ""), ("dt_kg", "")])
def test_names_of_rates_are_known_with_and_without_a_unit(name: str, kind: str) -> None:
    assert kind_of(name) == kind
