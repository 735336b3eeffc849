"""Bands of predictions: planted dampers, the law of what is left, and the covariance of a fit's document."""

import json
import math
from typing import Any

import numpy as np
import pytest

import mrfit
from mrfit.core.specs import Param
from mrfit.fit.band import NORMAL, remainder_width, widened
from mrfit.fit.diagnostics.bootstrap import Interval
from mrfit.fit.diagnostics.uncertainty import quantile_95
from mrfit.io.schemas.fit import Fit, Remainder
from mrfit.io.schemas.reading import of_json
from mrfit.search.cube import Cube

DT, SAMPLES = 1e-3, 2000


def log(frequency: float, noise: float, seed: int, error: float = 0.0) -> mrfit.Recording:
    """A damper F = 300·tanh(60·v) + 900·v; ``error`` is of a harmonic that no model has."""
    phase = 2.0 * np.pi * frequency * DT * np.arange(SAMPLES)
    x, v = 0.01 * np.sin(phase), 0.02 * np.pi * frequency * np.cos(phase)
    force = 300.0 * np.tanh(60.0 * v) + 900.0 * v + error * np.sin(25.0 * phase)
    force = force + noise * np.random.default_rng(seed).standard_normal(SAMPLES)
    return mrfit.Recording.from_arrays(dt=DT, displacement=x, velocity=v, force=force, name=f"log{seed}")


def fitted(noise: float, error: float = 0.0) -> mrfit.FitResult:
    logs = [log(f, noise, seed, error) for seed, f in enumerate((1.0, 2.0, 3.0))]
    return mrfit.fit(logs, "tanh", per="all", holdout="none", optimizer="lsq", progress=False)


@pytest.mark.parametrize(("noise", "error"), [(1.0, 0.0), (15.0, 0.0), (1.0, 15.0)])
def test_the_band_holds_what_was_measured_on_new_data(noise: float, error: float) -> None:
    fit = fitted(noise, error)
    found = fit.predict([log(f, noise, 100 + k, error) for k, f in enumerate((1.5, 2.5))])
    assert 0.93 <= found.coverage <= 1.0
    band = found.band
    assert (band["low"] < band["low_parameters"]).all() and (band["high_parameters"] < band["high"]).all()
    half = float((band["high"] - band["low"]).mean()) / 2.0
    # no wider than what is left calls for
    assert half < 2.0 * NORMAL * math.hypot(noise, error / math.sqrt(2.0))
    again = fit.predict([log(f, noise, 100 + k, error) for k, f in enumerate((1.5, 2.5))])
    assert again.band.equals(band)


def test_a_fit_keeps_what_its_bands_are_made_of(tmp_path: Any) -> None:
    fit = fitted(5.0)
    (result,) = fit.content.results
    about = result.covariance
    assert about is not None and about.version == 1
    rows = np.array(about.rows)
    np.testing.assert_allclose(rows, rows.T, atol=1e-18)
    q = next(p for p in result.parameters if p.name == "c")
    at = about.names.index("c")
    scale = (
        (about.high[at] - about.low[at])
        if not about.logarithmic[at]
        else q.value * math.log(about.high[at] / about.low[at])
    )
    half = quantile_95(about.degrees) * math.sqrt(rows[at, at]) * scale
    assert q.high is not None and q.low is not None
    assert (q.high - q.low) / 2.0 == pytest.approx(half, rel=0.02)
    fit.save(tmp_path / "fit.json")
    new = log(1.5, 5.0, 7)
    assert mrfit.load(tmp_path / "fit.json").predict(new).band.equals(fit.predict(new).band)  # type: ignore[union-attr]


def test_a_fit_without_a_covariance_has_no_band() -> None:
    fit = fitted(5.0)
    plain = fit.to_json()
    for result in plain["results"]:
        del result["covariance"], result["remainders"]
    plain.pop("preparation", None)
    old = mrfit.FitResult(of_json(Fit, json.dumps(plain)), fit.preparation)
    found = old.predict(log(1.5, 5.0, 7))
    assert list(found.band) == ["segment", "time", "simulated"] and math.isnan(found.coverage)


def row(condition: str, quantile: float, reach: float, role: str = "train") -> Remainder:
    return Remainder(condition=condition, role=role, quantile=quantile, reach=reach, independent=1e6)


def test_what_is_left_of_a_condition_that_was_fitted_is_its_own() -> None:
    rows = [row("a", 2.0, 100.0), row("b", 5.0, 900.0)]
    assert remainder_width(rows, "a", 5000.0) == pytest.approx(2.0, rel=1e-3)


def test_noise_does_not_grow_with_the_output_and_the_error_of_a_model_does() -> None:
    noise = [row(c, 2.0, reach) for c, reach in (("a", 100.0), ("b", 400.0), ("c", 900.0))]
    assert remainder_width(noise, "new", 3000.0) == pytest.approx(2.0, rel=1e-3)
    law = [row(c, 0.05 * reach, reach) for c, reach in (("a", 100.0), ("b", 400.0), ("c", 900.0))]
    assert remainder_width(law, "new", 3000.0) == pytest.approx(150.0, rel=1e-3)
    # of one range nothing is known of a slope: more for a larger output, no less for a smaller one
    one = [row("a", 2.0, 100.0)]
    assert remainder_width(one, "new", 300.0) == pytest.approx(6.0, rel=1e-3)
    assert remainder_width(one, "new", 30.0) == pytest.approx(2.0, rel=1e-3)


def test_conditions_that_differ_and_held_out_ones_widen_the_band() -> None:
    alike = [row(c, 2.0, 100.0) for c in "abc"]
    apart = [row(c, q, 100.0) for c, q in zip("abc", (1.0, 2.0, 4.0), strict=True)]
    worse = [*alike[:2], row("c", 4.0, 100.0, "holdout")]
    base = remainder_width(alike, "new", 100.0)
    assert remainder_width(apart, "new", 100.0) > 1.5 * base
    assert remainder_width(worse, "new", 100.0) > 1.5 * base
    few = [Remainder(condition="a", role="train", quantile=2.0, reach=100.0, independent=5.0)]
    assert remainder_width(few, "a", 100.0) == pytest.approx(2.0 * quantile_95(5.0) / NORMAL)


def test_other_intervals_set_the_widths_of_a_covariance() -> None:
    params = tuple(Param(n, "N", 0.0, 10.0, 5.0, "") for n in ("a", "b"))
    covariance = np.array([[1e-4, 5e-5], [5e-5, 1e-4]])
    made = widened(covariance, Cube(params, np.arange(2)), 2.0, {"a": Interval(4.0, 6.0), "b": Interval(None, 6.0)})
    assert 2.0 * math.sqrt(made[0, 0]) == pytest.approx(0.1)
    assert made[1, 1] == covariance[1, 1]
    # the correlation stays
    assert made[0, 1] / math.sqrt(made[0, 0] * made[1, 1]) == pytest.approx(0.5)
