"""What the benchmark makes of what is said: names, values, intervals, planted records, kept results."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.law_mismatch import methods, realsets, runner
from benchmarks.law_mismatch.head import explanation
from benchmarks.law_mismatch.laws import FAMILIES
from benchmarks.law_mismatch.methods import Asked
from benchmarks.law_mismatch.motions import DRIVES
from benchmarks.law_mismatch.protocol import COUNTS, OWN_SPRING, Case, generated
from benchmarks.law_mismatch.report import document, wilson
from benchmarks.law_mismatch.runner import Chosen, Result, run
from benchmarks.law_mismatch.said import Name, Number, Said
from benchmarks.law_mismatch.score import judge, judge_all

BASES = ("bingham", "tanh")
SPRING = Case("x", "development", "single", "bingham", ("gas-spring",), "iwan")
TRUTH = {"gas-spring": {"values": {"k_g": 1000.0}, "size": 0.05, "contrast": 3.0}}


def _result(case: Case, *names: Name, verdict: str = "named", truth: dict | None = None) -> Result:
    return Result(case.name, TRUTH if truth is None else truth, {"kind": "sines"}, Said(verdict, names))


def _spring(value: float = 1010.0, low: float = 950.0, high: float = 1070.0) -> Name:
    return Name("gas-spring", {"k_g": Number(value, low, high)})


def test_right_is_the_hidden_effect_alone() -> None:
    assert judge(SPRING, _result(SPRING, _spring())).right
    mass = Name("inertia", {"m": Number(1.0, 0.5, 1.5)})
    both = judge(SPRING, _result(SPRING, _spring(), mass))
    assert not both.right and both.wrong == {"inertia"}
    missed = judge(SPRING, _result(SPRING, verdict="unexplained"))
    assert not missed.right and not missed.wrong
    stated = replace(_result(SPRING), said=Said("ambiguous", stated=("gas-spring", "end-stop")))
    assert judge(SPRING, stated).stated and not judge(SPRING, stated).right


def test_values_and_intervals_are_held_against_the_truth() -> None:
    inside, off = judge(SPRING, _result(SPRING, _spring())), judge(SPRING, _result(SPRING, _spring(1300, 1200, 1400)))
    assert inside.close and inside.found[0].holds and inside.found[0].error == pytest.approx(0.01)
    assert not off.close and not off.found[0].holds and off.right
    open_end = Name("gas-spring", {"k_g": Number(1000.0, None, 1e9)})
    assert judge(SPRING, _result(SPRING, open_end)).found[0].holds is False


def test_a_lag_with_a_dead_time_is_judged_by_both() -> None:
    case = replace(SPRING, hidden=("current-lag",))
    lag = Name("current-lag", {"tau": Number(0.015, 0.013, 0.017), "t_d": Number(0.005, 0.004, 0.006)})
    truth = {"current-lag": {"values": {"tau": 0.02}, "size": 0.1}}
    assert judge(case, _result(case, lag, truth=truth)).found[0].error == pytest.approx(0)
    dead = judge(case, _result(case, lag, truth={"current-lag": {"values": {"t_d": 0.005}, "size": 0.1}}))
    assert dead.found[0].error == pytest.approx(0) and dead.found[0].holds


def test_nulls_and_outside_cases_are_to_name_nothing() -> None:
    for group in ("null", "long-memory"):
        case = replace(SPRING, group=group, hidden=())
        assert not judge(case, _result(case, _spring(), truth={})).right
        assert judge(case, _result(case, verdict="unexplained", truth={})).right
        assert not judge(case, _result(case, verdict="error", truth={})).right
    case = replace(SPRING, group="outside", hidden=("backlash",))
    assert judge(case, _result(case, verdict="unexplained", truth={})).right
    assert not judge(case, _result(case, verdict="none", truth={})).right


def test_planted_records_are_compared_with_what_they_have_of_their_own() -> None:
    real = Case("r", "development", "real", "bingham", records="press")
    planted = replace(SPRING, name="p", group="planted", records="press", family="", share=0.06)
    mass = Name("inertia", {"m": Number(1.0, 0.5, 1.5)})
    own = _result(real, _spring(200.0, 150.0, 250.0), mass, truth={})
    total = _result(planted, _spring(1210.0, 1150.0, 1270.0), mass)
    alone, _ = judge_all([planted, real], [total, own])
    assert alone.right and not alone.wrong and alone.close
    assert judge(planted, total).wrong == {"inertia"}
    weak = replace(own, said=Said("unexplained", weak={"gas-spring": {"k_g": 200.0}}))
    unnamed, _ = judge_all([planted, real], [total, weak])
    assert unnamed.close and unnamed.wrong == {"inertia"}


def test_wilson_intervals() -> None:
    assert wilson(0, 120) == pytest.approx((0.0, 3.8416 / 123.8416), rel=1e-4)
    low, high = wilson(90, 100)
    assert (low, high) == pytest.approx((0.8256, 0.9448), abs=2e-4)


def test_splits_share_no_seed_no_law_and_no_motion() -> None:
    made = {s: [c for g in COUNTS for c in generated(s, g, 72, BASES, 1)] for s in DRIVES}
    for what in ("seed", "family", "name"):
        assert not {getattr(c, what) for c in made["development"]} & {getattr(c, what) for c in made["evaluation"]}
    assert not set(DRIVES["development"]) & set(DRIVES["evaluation"])
    assert {c.family for s in made.values() for c in s} == set(FAMILIES)


def test_cases_are_the_same_whatever_else_is_asked_for() -> None:
    few, many = generated("evaluation", "single", 9, BASES, 2), generated("evaluation", "single", 40, BASES, 2)
    assert many[: len(few)] == few
    assert all(c.base not in OWN_SPRING for c in many if "gas-spring" in c.hidden)


def test_no_specimen_has_the_form_of_its_base() -> None:
    cases = generated("development", "null", 40, ("tanh", "guo", "spencer"), 3)
    assert {c.base for c in cases if c.family == "tanh"} == {"spencer"}
    assert {c.base for c in cases if c.family == "lugre"} == {"tanh", "guo", "spencer"}


def test_finished_cases_are_read_and_failures_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def method(asked: Asked, prototype: Path | None) -> Said:
        calls.append(sum(len(c["force"]) for c in asked.channels))
        if len(calls) == 1:
            raise ValueError("too warm")
        return Said("named", (_spring(),))

    monkeypatch.setitem(methods.METHODS, "discover", method)
    case = generated("development", "null", 1, ("bingham",), 1)[0]
    chosen = Chosen("discover", keep=tmp_path)
    runner.version.cache_clear()
    failed, made, kept = run(case, chosen), run(case, chosen), run(case, chosen)
    assert failed.said.verdict == "error" and "too warm" in failed.said.why["error"]
    assert len(calls) == 2 and calls[0] == calls[1]
    assert kept == made and kept.said.names == (_spring(),)
    (file,) = tmp_path.rglob("*.json")
    assert json.loads(file.read_text())["case"] == case.name
    text = document(judge_all([case], [kept]), "test", explanation("development"))
    assert "100.0 % (1/1" in text and case.name in text


def _asked() -> Asked:
    t = np.arange(4000) * 1e-3
    channels = []
    for f in (1.0, 2.0):
        x = 0.01 * np.sin(2 * np.pi * f * t)
        v = np.gradient(x, t)
        current = np.where(np.sin(2 * np.pi * 0.7 * t) > 0, 1.0, 0.0)
        channels.append({"displacement": x, "force": 300 * np.tanh(v / 0.01) + 50.0, "current": current})
    return Asked(channels, [1e-3, 1e-3], "bingham")


@pytest.mark.parametrize("name", [n for n in realsets.PLANTS if n not in ("current-lag", "temperature")])
def test_planted_force_has_its_share_of_the_range(name: str) -> None:
    asked = _asked()
    planted, truth = realsets._planted(asked, name, 0.06, np.random.default_rng(0))
    extra = [p["force"] - c["force"] for p, c in zip(planted.channels, asked.channels, strict=True)]
    assert max(np.abs(e).max() for e in extra) == pytest.approx(0.06 * 600, rel=1e-3)
    x, a = asked.channels[1]["displacement"], -((4 * np.pi) ** 2) * asked.channels[1]["displacement"]
    if name == "gas-spring":
        np.testing.assert_allclose(extra[1], truth[name]["values"]["k_g"] * x, atol=1e-3)
    if name == "inertia":
        middle = slice(200, -200)
        np.testing.assert_allclose(extra[1][middle], (truth[name]["values"]["m"] * a)[middle], atol=0.5)
    if name == "asymmetry":
        made = planted.channels[0]["force"] - 50
        assert made.max() / -made.min() - 1 == pytest.approx(truth[name]["values"]["g_yield"], rel=0.01)


def test_planted_temperature_is_a_factor_of_the_force() -> None:
    planted, truth = realsets._planted(_asked(), "temperature", 0.06, np.random.default_rng(0))
    b = truth["temperature"]["values"]["b_yield"]
    for made, was in zip(planted.channels, _asked().channels, strict=True):
        np.testing.assert_allclose(made["force"], was["force"] * np.exp(-b * (made["temperature"] - 35)), rtol=1e-9)


def test_a_current_that_is_logged_earlier_leaves_the_rest_in_place() -> None:
    planted, truth = realsets._planted(_asked(), "current-lag", 0.06, np.random.default_rng(0))
    was, made = _asked().channels[0], planted.channels[0]
    assert truth["current-lag"]["values"]["t_d"] == 0.008
    np.testing.assert_array_equal(made["current"], was["current"][8:])
    np.testing.assert_array_equal(made["force"], was["force"][:-8])
