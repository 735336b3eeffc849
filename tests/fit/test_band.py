"""Bands of predictions: planted dampers, a model of another law, and what a fit's document keeps."""

import json
import math
import re
import shlex
from typing import Any

import numpy as np
import pytest

import mrfit
from mrfit.core.recording import Segment
from mrfit.fit.band import own_width, unseen
from mrfit.fit.diagnostics.remainders import LEFT_OUT, LEVEL_LEFT_OUT
from mrfit.fit.diagnostics.uncertainty import quantile_95
from mrfit.fit.error_law import NORMAL
from mrfit.io.schemas.band import Remainder
from mrfit.io.schemas.fit import Fit, Result
from mrfit.io.schemas.reading import of_json
from tests.docs.test_pages import fault_of

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


def test_the_error_of_a_model_is_told_by_tests_that_it_has_not_seen() -> None:
    """A term that no model has: fits take some of it up, and leave less of their own tests than of others."""

    def with_spring(frequency: float, seed: int) -> mrfit.Recording:
        phase = 2.0 * np.pi * frequency * DT * np.arange(SAMPLES)
        x, v = 0.01 * np.sin(phase), 0.02 * np.pi * frequency * np.cos(phase)
        force = 300.0 * np.tanh(60.0 * v + 900.0 * x) + 900.0 * v + np.random.default_rng(seed).standard_normal(SAMPLES)
        return mrfit.Recording.from_arrays(dt=DT, displacement=x, velocity=v, force=force, name=f"log{seed}")

    logs = [with_spring(f, seed) for seed, f in enumerate((1.0, 2.0, 3.0, 4.0))]
    fit = mrfit.fit(logs, "bingham", per="all", holdout="none", optimizer="lsq", progress=False)
    found = fit.predict([with_spring(f, 10 + k) for k, f in enumerate((1.5, 2.5, 3.5))])
    assert found.nrmse > 0.03
    assert 0.9 <= found.coverage <= 1.0
    band = found.band
    assert float((band["high"] - band["low"]).mean()) / 2.0 < 4.0 * float(found.metrics["rmse"].iloc[-1])
    # what is left of a test that is left out is what a fit without it leaves
    (result,) = fit.content.results
    left = [r for r in result.remainders if r.role == LEFT_OUT]
    for k, one in enumerate(left):
        others = [a for j, a in enumerate(logs) if j != k]
        without = mrfit.fit(others, "bingham", per="all", holdout="none", optimizer="lsq", progress=False)
        frame = without.predict(logs[k]).to_frame()
        errors = (frame["measured"] - frame["simulated"])[frame["scored"]].abs()
        assert one.quantile == pytest.approx(float(errors.quantile(0.95)), rel=0.03)


@pytest.mark.parametrize(("tests", "cut"), [(2, 5), (3, 1)])
def test_random_motions_are_left_out_whole_from_three_on(tests: int, cut: int) -> None:
    def motion(seed: int) -> mrfit.Recording:
        rng = np.random.default_rng(seed)
        x = 0.004 * np.convolve(rng.standard_normal(SAMPLES + 199), np.hanning(200), "valid")
        force = 900.0 * np.gradient(x, DT) + rng.standard_normal(SAMPLES)
        return mrfit.Recording.from_arrays(dt=DT, displacement=x, force=force, name=f"log{seed}")

    fit = mrfit.fit([motion(k) for k in range(tests)], "bingham", per="all", holdout="none", progress=False)
    shares = [r.share for r in fit.content.results[0].remainders if r.role == LEFT_OUT]
    assert len(shares) == cut * tests and sum(shares) == pytest.approx(tests)


@pytest.mark.parametrize("per", ["all", "condition"])
def test_a_fit_keeps_what_its_bands_are_made_of(tmp_path: Any, per: str) -> None:
    fit = mrfit.fit([log(f, 5.0, k) for k, f in enumerate((1.0, 2.0, 3.0))], "tanh", per=per, progress=False)
    for result in fit.content.results:
        assert result.refits is not None
        names = [p.name for p in result.parameters if not p.fixed]
        assert result.refits.names == names and all(len(row) == len(names) for row in result.refits.rows)
        # every condition is judged by parameters that are not its own
        left = {r.condition for r in result.remainders if r.role == LEFT_OUT}
        assert left == set(result.conditions)
    fit.save(tmp_path / "fit.json")
    new = log(1.5, 5.0, 7)
    assert mrfit.load(tmp_path / "fit.json").predict(new).band.equals(fit.predict(new).band)  # type: ignore[union-attr]


def test_refits_about_the_optimum_have_the_covariance_where_there_is_one_test() -> None:
    (result,) = mrfit.fit(log(1.0, 5.0, 0), "tanh", holdout="none", progress=False).content.results
    refits = result.refits
    assert refits is not None and refits.factor == 1.0
    q = next(p for p in result.parameters if p.name == "c")
    values = np.array(refits.rows)[:, refits.names.index("c")]
    assert q.high is not None and q.low is not None
    assert (q.high - q.low) / 2.0 == pytest.approx(quantile_95(refits.degrees) * values.std(), rel=0.02)


def test_a_fit_of_earlier_days_has_no_band_and_says_which_command_makes_one() -> None:
    fit = fitted(5.0)
    plain = fit.to_json()
    for result in plain["results"]:
        del result["refits"], result["remainders"]
    plain.pop("preparation", None)
    old = mrfit.FitResult(of_json(Fit, json.dumps(plain)), fit.preparation)
    found = old.predict(log(1.5, 5.0, 7))
    assert list(found.band) == ["segment", "time", "simulated"] and math.isnan(found.coverage)
    assert found.promise.startswith("none")
    (command,) = re.findall("`mrfit (.*?)`", found.promise)
    assert fault_of(shlex.split(command)) == "" and command == "fit --model tanh --opt lsq --per all"
    assert f"95 % band: {found.promise}" in repr(found)


def names(found: mrfit.Prediction) -> set[str]:
    return {s.condition for s in found.found.blocks.segments}


def test_the_promise_counts_the_tests_and_names_those_beyond() -> None:
    joint = fitted(5.0)
    near, far = log(2.5, 5.0, 7), log(6.0, 5.0, 8)
    assert joint.predict(near).promise == (
        "low to high holds 95 of 100 samples on average over tests like the 3 that were judged by parameters fitted "
        "without them; fewer than 39: their errors are taken as log-normal"
    )
    # twice the speed of the fastest test; the other one is not named
    (beyond,) = names(joint.predict(far))
    wider = f"; wider beyond what was fitted: {beyond}"
    assert joint.predict([near, far]).promise == joint.predict(near).promise + wider
    alone = mrfit.fit(log(1.0, 5.0, 0), "tanh", per="all", holdout="none", progress=False)
    (own,) = alone.content.results[0].conditions
    assert f"over tests like {own}, if the model errs on others as it does there" in alone.predict(near).promise


def test_a_condition_that_was_not_fitted_by_itself_has_a_band_that_falls_short() -> None:
    each = mrfit.fit([log(f, 5.0, k) for k, f in enumerate((1.0, 2.0, 3.0))], "tanh", per="condition", progress=False)
    known, both = each.predict(log(2.0, 5.0, 7)), each.predict([log(2.0, 5.0, 7), log(2.5, 5.0, 8)])
    assert "falls short" not in known.promise and "--per all" in known.promise
    (own,) = names(known)
    (other,) = names(both) - {own}
    assert both.promise.startswith(f"falls short for {other}, of which no") and own not in both.promise


def row(condition: str, role: str, independent: float = 1e6, quantile: float = 2.0) -> Remainder:
    return Remainder(condition=condition, role=role, quantile=quantile, reach=100.0, independent=independent)


def test_tests_that_had_no_part_tell_what_is_left_of_others() -> None:
    fitted, left, held = row("a", "train"), row("a", LEFT_OUT), row("b", "holdout")
    # a third of the cycles of a condition that was fitted is no other test
    own = row("a", "holdout")
    assert unseen([result_of([fitted, left, held, own])]) == [left, held]
    assert unseen([result_of([fitted])]) == [fitted]


def test_what_is_left_of_a_condition_that_was_fitted_is_its_own() -> None:
    rows = [row("sine", "train"), row("sine", LEFT_OUT, quantile=50.0), row("other", "train", quantile=9.0)]
    assert own_width(rows, segment("sine", 5)) == pytest.approx(2.0, rel=1e-3)
    # few independent samples tell it less well; random motions of one name are not the same test
    assert own_width([row("sine", "train", 5.0)], segment("sine", 5)) == pytest.approx(2.0 * quantile_95(5.0) / NORMAL)
    assert own_width(rows, segment("sine", 0)) is None
    assert own_width(rows, segment("new", 5)) is None


def result_of(rows: list[Remainder]) -> Result:
    return Result(condition="all", evaluations=1, parameters=[], remainders=rows)


def segment(condition: str, cycles: int) -> Segment:
    nan = math.nan
    return Segment(
        "x#1", condition, "x", 0, 100, 0, "sine", "displacement", 1.0, 0.01, 0.0, cycles, nan, nan, "predict"
    )


def at_current(current: float, frequency: float, seed: int) -> mrfit.Recording:
    """A damper whose friction saturates over the current, as no polynomial of it does."""
    phase = 2.0 * np.pi * frequency * DT * np.arange(SAMPLES)
    x, v = 0.01 * np.sin(phase), 0.02 * np.pi * frequency * np.cos(phase)
    force = (50.0 + 500.0 * np.tanh(current)) * np.tanh(60.0 * v) + 900.0 * v
    force = force + np.random.default_rng(seed).standard_normal(SAMPLES)
    condition = {"current": np.full(SAMPLES, current)}
    return mrfit.Recording.from_arrays(dt=DT, displacement=x, velocity=v, force=force, name=f"log{seed}", **condition)


def test_at_a_current_that_no_test_had_the_band_is_told_by_currents_left_out() -> None:
    """As many currents as the law has coefficients: the law passes through them all, and is wrong between."""
    logs = [at_current(i, f, 10 * k + f) for k, i in enumerate((0.0, 2.0, 4.0)) for f in (1, 2)]
    given = {"per": "all", "holdout": "none", "optimizer": "lsq", "progress": False}
    fit = mrfit.fit(logs, "tanh", current_order={"fy": 2}, **given)
    (result,) = fit.content.results
    alone, levels = ([r for r in result.remainders if r.role == role] for role in (LEFT_OUT, LEVEL_LEFT_OUT))
    assert len(alone) == 6 and len(levels) == 3
    # what leaves a test out alone says of the law of current nothing at all
    assert max(r.quantile for r in alone) < 5.0 < 50.0 < min(r.quantile for r in levels)
    found = fit.predict([at_current(1.0, 1, 90), at_current(0.0, 3, 91)])
    frame = found.to_frame().groupby("segment")[["measured", "low", "high"]]
    between, known = (one["measured"].between(one["low"], one["high"]).mean() for _, one in frame)
    widths = [float((one["high"] - one["low"]).mean()) for _, one in frame]
    assert between == 1.0 and known > 0.9 and widths[0] > 10.0 * widths[1]
    assert "at currents that no test had by 3 that were left out in turn: sine-1Hz-10mm-1A;" in found.promise
