import math

import numpy as np

from mrfit.core.recording import Finding, Recording, Segment
from mrfit.io.schemas.stages import About, FluxFile, FluxRow, FluxSettings
from mrfit.report.provenance import flux_section, recording_row, segment_rows


def test_recording_gives_rate_and_channels_with_units():
    gap = Finding("gap", "", None, "a gap")
    channels = {"force": np.zeros(3), "ch2": np.zeros(3)}
    about = About.of(Recording("a", "a.csv", "", "csv", 2e-5, 0.0, channels, {"force": "N"}, findings=(gap,)))
    row = recording_row(about)
    assert (row.rate, row.channels) == ("50000 Hz", "force (N), ch2 (1)")
    assert [f.kind for f in row.about.findings] == ["gap"] and row.about.history == []


def test_flux_tells_resistance_with_error_and_source():
    given = {"id": "a", "resistance": 2.5, "resistance_error": 0.0, "resistance_source": "given", "lambda0": -2e-3}
    estimated = {"id": "b", "resistance": 2.5123, "resistance_error": 0.0123, "resistance_source": "estimated"}
    kept = {"id": "c", "action": "measured flux kept"}
    rows = [FluxRow(**row) for row in (given, estimated, kept)]
    section = flux_section(FluxFile(settings=FluxSettings(rule="simpson"), recordings=rows))
    assert [r.resistance for r in section.rows] == ["2.5000", "2.5123 ± 0.012"]
    assert section.rows[0].lambda0 == "−0.00200" and section.rows[0].closure_rms == "–"
    assert section.others == ["c: measured flux kept"]
    assert "simpson" in section.how


def test_no_flux_stage_no_section():
    section = flux_section(None)
    assert not any((section.how, section.rows, section.others, section.findings, section.separation))


def test_segments_are_sorted_and_unknown_levels_left_open():
    common = {
        "drive": "displacement",
        "amplitude": 0.01,
        "current": math.nan,
        "temperature": 24.5,
        "start": 5,
        "stop": 25,
    }
    common |= {"condition": "c", "recording": "log", "warm_up": 0, "waveform": "sine", "offset": 0.0, "cycles": 2}
    segments = [Segment(id=f"log{k}#0", role="holdout", frequency=f, **common) for k, f in ((10, 0.0), (2, 1.25))]
    rows = segment_rows(segments)
    assert [r.segment.id for r in rows] == ["log2#0", "log10#0"]
    assert [r.frequency for r in rows] == ["1.25 Hz", "–"]
    assert (rows[0].amplitude, rows[0].current, rows[0].temperature) == ("0.0100 m", "–", "24.5 °C")
    assert (rows[0].role, rows[0].segment.samples) == ("hold-out", 20)
