"""A factor that a header states is said: nobody knows whether the numbers hold it. Settings of a scope are not."""

import pytest

from tests.ingest.conftest import ReadLog

ROWS = "".join(f"{k * 0.005:.3f},{k % 7 * 0.1:.1f},{k % 11}\n" for k in range(200))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("Force Scale Factor,10", True),
        ("Gain: 10", True),
        ("Force multiplier = 0.5", True),
        ("Scale: Force x10", True),
        ("Units: force in units of 10 N", True),
        ("Range: Force 10x", True),
        ("Kraft Faktor;2,5", True),
        ("Force: y = 10*x + 0", True),
        ("Load cell: 500 N/V", True),
        ("Resolution: 0.01 mm/count", True),
        ("Sensitivity: 2 mV/N", True),
        # nothing is multiplied
        ("Damping: 500 N/mm", False),
        ("CH2 500 mV/div", False),
        ("Gain: 1", False),
        ("Scale factor: 1.0", False),
        ("Scaling: none", False),
        # an instrument has applied them itself, or they are no factors
        ("Probe attenuation: 10", False),
        ("Vertical scale: 2.00E-01", False),
        ("Full scale: 5 kN", False),
        ("Calibration date: 2024-05-01", False),
        ("Specimen: damper 10x20", False),
        ("Controller gain 12", False),
        ("Calibration certificate 4711", False),
        ("Load cell calibration 12.05.2021", False),
        ("Cyclic 5x", False),
        ("CH1 Scale: 2.00E+00", False),
    ],
)
def test_a_factor_in_a_header_is_said(line: str, said: bool, read_log: ReadLog) -> None:
    (record,) = read_log(f"{line}\nTime (s),Displacement (mm),Force (N)\n{ROWS}")
    assert ("factor-stated" in {f.kind for f in record.findings}) == said
    assert record.channels["force"][3] == 3.0
