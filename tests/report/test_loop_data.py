import base64
import json
from dataclasses import replace

import numpy as np
import pytest

from mrfit.report.curves import simplified
from mrfit.report.loop_data import STEPS, loop_json
from mrfit.report.source import read_source


def decoded(data, place):
    low, step, text = data["pool"][place]
    codes = np.frombuffer(base64.urlsafe_b64decode(text), "<i2").astype(float)
    return np.where(codes == -32768, np.nan, low + step * (codes + STEPS // 2))


def test_curves_of_every_condition_are_in_the_page_to_sixteen_bits(coil):
    source = read_source(coil[0], ())
    (output,) = (data := json.loads(loop_json(source)))["outputs"]
    assert output["up"] == "Flux λ (mWb)" and output["axes"] == ["Current i (A)", "Time t (s)"]
    assert [r["condition"] for r in output["rows"]] == [f"sine-{f}Hz-{a}A" for f in (1, 5, 10) for a in range(1, 6)]
    row = output["rows"][4]
    current, flux = decoded(data, row["across"][0]), decoded(data, row["simulated"])
    # the study's closed form, at 5 A and 1 Hz
    cosine = np.cos(2.0 * np.pi * decoded(data, row["across"][1]))
    assert flux == pytest.approx(1e3 * (0.06 * np.tanh(current / 3.0) - 6e-4 * 5 * cosine), abs=0.01)
    assert row["role"] in ("training", "hold-out") and row["words"].endswith(" %")


def test_what_fits_share_is_stored_once(coil):
    source = read_source(coil[0], ())
    fit = source.fits[0]
    second = replace(fit, name="second")
    both = replace(
        source, fits=[fit, second], series={fit.name: source.series[fit.name], "second": source.series[fit.name]}
    )
    one, two = (json.loads(loop_json(s)) for s in (source, both))
    assert len(two["pool"]) == len(one["pool"]) and len(two["outputs"][0]["rows"]) == 30


def test_the_best_three_are_drawn_at_first_and_one_that_diverged_is_marked(coil):
    source = read_source(coil[0], ())
    fit = source.fits[0]
    factors = {"wild": 1e4, "d": 4.0, "a": 1.0, "c": 3.0, "b": 2.0}
    fits = [
        replace(fit, name=n, metrics=[replace(m, nrmse=f * (m.nrmse or 0.0)) for m in fit.metrics])
        for n, f in factors.items()
    ]
    several = replace(source, fits=fits, series=dict.fromkeys(factors, source.series[fit.name][:1]))
    (output,) = json.loads(loop_json(several))["outputs"]
    assert [output["fits"][k] for k in output["shown"]] == ["a", "c", "b"]
    assert [output["fits"][k] for k in output["diverged"]] == ["wild"]


def test_a_name_cannot_end_the_element(coil):
    source = read_source(coil[0], ())
    fit, hostile = source.fits[0], "</script><script>alert(1)</script><!--"
    series = [replace(s, condition=hostile) for s in source.series[fit.name][:2]]
    text = loop_json(replace(source, series={fit.name: series}))
    assert "<" not in text and ">" not in text
    assert json.loads(text)["outputs"][0]["rows"][0]["condition"] == hostile


def test_a_diverged_simulation_has_gaps_not_numbers(coil):
    source = read_source(coil[0], ())
    fit = source.fits[0]
    lost = [replace(s, simulated=np.full_like(s.simulated, np.nan)) for s in source.series[fit.name][:1]]
    data = json.loads(loop_json(replace(source, series={fit.name: lost})))
    assert np.isnan(decoded(data, data["outputs"][0]["rows"][0]["simulated"])).all()


def test_without_series_there_is_nothing(coil):
    assert loop_json(replace(read_source(coil[0], ()), series={})) == ""


def test_a_simplified_curve_stays_within_its_tolerance_and_loses_no_corner():
    t = np.linspace(0.0, 6.0 * np.pi, 5001)
    x, y = np.sin(t) * t, np.sign(np.cos(t)) * (1.0 + 0.1 * np.sin(5.0 * t))
    kept = simplified(x, y, 0.01)
    assert kept[0] == 0 and kept[-1] == 5000 and len(kept) < 500
    a, b = (v / np.ptp(v) for v in (x, y))
    between = np.interp(np.arange(5001), kept, np.arange(len(kept)))
    first = np.minimum(between.astype(int), len(kept) - 2)
    p, q = kept[first], kept[first + 1]
    along = np.clip(
        ((a - a[p]) * (a[q] - a[p]) + (b - b[p]) * (b[q] - b[p])) / ((a[q] - a[p]) ** 2 + (b[q] - b[p]) ** 2), 0, 1
    )
    off = np.hypot(a - a[p] - along * (a[q] - a[p]), b - b[p] - along * (b[q] - b[p]))
    assert off.max() <= 0.01


def test_a_straight_line_needs_its_ends_only():
    t = np.linspace(0.0, 1.0, 1000)
    assert simplified(t, 3.0 * t).tolist() == [0, 999]
