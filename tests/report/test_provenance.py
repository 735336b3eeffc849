import math

from mrfit.report.provenance import flux_section, recording_row, segment_rows


def test_recording_gives_rate_and_channels_with_units():
    channels = [{"name": "force", "unit": "N", "column": 1}, {"name": "ch2", "unit": "", "column": 2}]
    row = recording_row({"id": "a", "dt": 2e-5, "channels": channels, "findings": [{"kind": "gap"}]})
    assert (row["rate"], row["channels"]) == ("50000 Hz", "force (N), ch2 (1)")
    assert row["findings"] == [{"kind": "gap"}] and row["history"] == []


def test_flux_tells_resistance_with_error_and_source():
    given = {"id": "a", "resistance": 2.5, "resistance_error": 0.0, "resistance_source": "given", "lambda0": -2e-3}
    estimated = {"id": "b", "resistance": 2.5123, "resistance_error": 0.0123, "resistance_source": "estimated"}
    kept = {"id": "c", "action": "measured flux kept"}
    section = flux_section({"settings": {"rule": "simpson", "drift": "cycle"}, "recordings": [given, estimated, kept]})
    assert [r["resistance"] for r in section["rows"]] == ["2.5000", "2.5123 ± 0.012"]
    assert section["rows"][0]["lambda0"] == "−0.00200" and section["rows"][0]["closure_rms"] == "–"
    assert section["others"] == ["c: measured flux kept"]
    assert "simpson" in section["how"]


def test_no_flux_stage_no_section():
    assert flux_section({}) == {"how": "", "rows": [], "others": [], "findings": [], "separation": []}


def test_segments_are_sorted_and_unknown_levels_left_open():
    common = {
        "drive": "displacement",
        "amplitude": 0.01,
        "current": math.nan,
        "temperature": 24.5,
        "start": 5,
        "stop": 25,
    }
    segments = [{"id": f"log{k}#0", "role": "holdout", "frequency": f, **common} for k, f in ((10, 0.0), (2, 1.25))]
    rows = segment_rows(segments)
    assert [r["id"] for r in rows] == ["log2#0", "log10#0"]
    assert [r["frequency"] for r in rows] == ["1.25 Hz", "–"]
    assert (rows[0]["amplitude"], rows[0]["current"], rows[0]["temperature"]) == ("0.0100 m", "–", "24.5 °C")
    assert (rows[0]["role"], rows[0]["samples"]) == ("hold-out", 20)
