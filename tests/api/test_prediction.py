"""Predictions of a small fit: their numbers from their own samples; series of a fit; sheets of a log."""

import numpy as np
import pytest

import mrfit
from mrfit.api.drawing import series_of
from mrfit.api.fitting import FitResult
from mrfit.api.recordings import Recording
from mrfit.errors import ConfigError, DataError

TIME = 0.01 * np.arange(800)


def log(name: str, size: float = 1.0, force: bool = True) -> Recording:
    x = 0.01 * size * np.sin(2 * np.pi * TIME)
    v = 0.02 * np.pi * size * np.cos(2 * np.pi * TIME)
    noise = np.random.default_rng(len(name)).normal(0.0, 2.0, len(TIME))
    measured = {"force": 300.0 * np.sign(v) + 900.0 * v + noise} if force else {}
    return Recording.from_arrays(dt=0.01, name=name, displacement=x, velocity=v, **measured)


@pytest.fixture(scope="module")
def fitted() -> FitResult:
    logs = [log("a"), log("wide", 1.5), log("held", 2.0)]
    return mrfit.fit(logs, "bingham", per="all", optimizer="lsq", budget=60, holdout="*20mm*", progress=False)


def test_extents_of_a_fit_are_those_of_its_training(fitted: FitResult) -> None:
    roles = {s.role for s in fitted.content.results[0].segments}
    low, high = fitted.extents["velocity"]
    trained = 1.5 if "holdout" in roles or "holdout" in set(fitted.metrics.role) else 2.0
    assert trained == 1.5 and high == pytest.approx(0.02 * np.pi * trained, rel=0.02) and low == pytest.approx(-high)


def test_series_have_the_numbers_of_the_fit_and_none_measured_where_nothing_was(fitted: FitResult) -> None:
    made = fitted.fitted
    assert made is not None
    series = series_of(made.blocks, made.simulated, made.assembly)
    assert sorted(s.role for s in series) == ["holdout", "train", "train"]
    for one in series:
        (row,) = [m for m in fitted.content.metrics if (m.condition, m.role) == (one.condition, one.role)]
        assert np.sqrt(np.mean((one.measured - one.simulated) ** 2)) == pytest.approx(row.rmse, rel=1e-9)
        np.testing.assert_allclose(np.diff(one.time), 0.01)
        assert one.frequency == pytest.approx(1.0, rel=1e-3)
    first = series[0].segment
    bare = series_of(made.blocks, made.simulated, made.assembly, {first})
    assert [bool(np.isnan(s.measured).all()) for s in bare] == [s.segment == first for s in bare]


def test_a_prediction_says_its_error_its_band_and_what_it_covers(fitted: FitResult) -> None:
    found = fitted.predict(log("other", 1.2), progress=False)
    samples = found.to_frame()
    scored = samples[samples["scored"]]
    off = scored["measured"] - scored["simulated"]
    assert found.metrics.iloc[-1].rmse == pytest.approx(np.sqrt(np.mean(off**2)), rel=1e-9)
    assert found.nrmse == pytest.approx(np.sqrt(np.mean(off**2)) / np.ptp(scored["measured"]), rel=1e-6)
    band = found.band
    assert list(band.columns[:3]) == ["segment", "time", "simulated"]
    inside = (scored["measured"] >= scored["low"]) & (scored["measured"] <= scored["high"])
    assert found.coverage == pytest.approx(inside.mean()) and found.coverage > 0.8
    assert ((band["low"] < band["simulated"]) & (band["simulated"] < band["high"])).all()
    assert set(found.used.values()) == {"all"}
    assert repr(found).startswith(f"Prediction of force by {fitted.name}\n") and "95 % band: " in repr(found)


def test_where_nothing_was_measured_there_is_no_error_and_nothing_is_covered(fitted: FitResult) -> None:
    found = fitted.predict(log("bare", 1.2, force=False), progress=False)
    assert np.isnan(found.nrmse) and np.isnan(found.coverage) and found.metrics.empty
    samples = found.to_frame()
    assert samples["measured"].isna().all() and samples["simulated"].notna().all()


def test_a_prediction_beyond_the_training_is_warned_of(fitted: FitResult) -> None:
    wide = fitted.predict(log("far", 3.0), progress=False).warnings
    assert any(w.kind == "extrapolation" and w.text.startswith("velocity reaches") for w in wide)
    near = fitted.predict(log("near", 1.2), progress=False).warnings
    assert not any(w.kind == "extrapolation" for w in near)


def test_a_figure_has_the_pages_that_its_conditions_fill(fitted: FitResult) -> None:
    with pytest.raises(ConfigError, match=r"there is no page 1 of 'residual'; there are 1, counted from 0"):
        fitted.plot("residual", page=1)
    with pytest.raises(ConfigError, match="there is no page -1"):
        fitted.plot(page=-1)


def test_a_sheet_has_a_unit_that_is_found_by_its_name_or_by_none() -> None:
    found = mrfit.sheet([log("a"), log("wide", 1.5)], progress=False)
    assert repr(found) == f"<Sheet: {len(found.content.units)} unit, 2 conditions>"
    assert set(found.verdicts.values()) == {""}
    (unit,) = found.verdicts
    with pytest.raises(DataError, match=rf"there is no unit 'nobody'.*; there are {unit}$"):
        found.plot("nobody")
    table = found.table.set_index("quantity")
    # some quantities are of all conditions together
    assert set(table["condition"]) == {"sine-1Hz-10mm", "sine-1Hz-15mm", "all speeds"}
    with pytest.raises(ConfigError, match="there is no option 'limit': did you mean limits"):
        mrfit.sheet(log("a"), limit="x.toml")
