import pytest

from benchmarks.discovery.protocol import full, smoke
from benchmarks.discovery.report import document
from benchmarks.discovery.runner import Result
from benchmarks.discovery.score import judge, judge_all
from datasets.rig.effects import EFFECTS

CASES = {c.name: c for c in full()}
TRUTH = {"visible": 0.02, "noise": 0.002, "share": 0.03}


def found(verdict, *names, **more):
    effects = [{"name": n, "parameters": []} for n in names]
    return {"verdict": verdict, "effects": effects, "gap": {"closed": 0.95}} | more


def outcome(name, discovery, **truth):
    return judge(CASES[name], Result(name, TRUTH | truth, discovery, 10.0))


def test_the_protocol_hides_every_effect_and_its_names_are_unique():
    hidden = {e for c in CASES.values() for e in c.hidden.effects}
    assert hidden == set(EFFECTS)
    assert len(CASES) == len(full())
    assert 1 <= len(smoke()) <= 6
    assert len({c.hidden.seed for c in CASES.values() if not c.twin}) == len([c for c in CASES.values() if not c.twin])


def test_scaling_keeps_the_cases_it_keeps():
    few = full(0.3)
    assert len(few) < len(CASES)
    assert all(CASES[c.name] == c for c in few)


@pytest.mark.parametrize(
    ("name", "discovery", "right", "wrong"),
    [
        ("null_damper-white_0", found("none"), True, 0),
        ("null_damper-white_0", found("named", "delay"), False, 1),
        ("single_delay_visible_0", found("named", "delay"), True, 0),
        ("single_delay_visible_0", found("named", "inertia"), False, 1),
        ("single_delay_visible_0", found("named", "delay", "inertia"), False, 1),
        ("single_delay_visible_0", found("ambiguous", ambiguous_set=["delay", "inertia"]), False, 0),
        ("pair_delay+inertia_strong_0", found("named", "delay"), False, 0),
        ("pair_delay+inertia_strong_0", found("named", "inertia", "delay"), True, 0),
        (
            "untellable_delay_strong_one-frequency_0",
            found("ambiguous", ambiguous_set=["delay", "velocity-hysteresis"]),
            True,
            0,
        ),
        ("untellable_delay_strong_one-frequency_0", found("ambiguous", ambiguous_set=["inertia"]), False, 0),
        ("untellable_delay_strong_one-frequency_0", found("named", "delay"), True, 0),
        ("untellable_delay_strong_one-frequency_0", found("none"), False, 0),
        ("outside_backlash_strong_0", found("unexplained", where=[{"region": "near reversal"}]), True, 0),
        ("outside_backlash_strong_0", found("unexplained", where=[{"region": "hot"}]), False, 0),
        ("outside_backlash_strong_0", found("named", "delay"), False, 1),
        ("little_delay_visible_one-log_0", found("insufficient-data"), True, 0),
        ("little_delay_visible_one-log_0", found("none"), False, 0),
        ("missing_temperature_strong_0", found("unexplained"), True, 0),
        ("absorbed_force-offset_strong_0", found("none"), True, 0),
        ("other-law_other-coil-white_0", found("named", "saturation"), True, 0),
        ("other-law_other-coil-white_0", found("named", "eddy-current"), False, 1),
    ],
)
def test_a_verdict_is_judged(name, discovery, right, wrong):
    judged = outcome(name, discovery)
    assert (judged.right, len(judged.wrong)) == (right, wrong), judged.why


def test_silence_is_right_where_the_base_law_hides_the_effect():
    assert outcome("untellable_delay_strong_one-frequency_0", found("none"), visible=0.0001).right


def test_an_error_is_not_right():
    case = CASES["null_damper-white_0"]
    judged = judge(case, Result(case.name, TRUTH, error="mrfit ended with 1"))
    assert not judged.right
    assert judged.verdict == "error"


@pytest.mark.parametrize(
    ("unit", "low", "high", "covered"),
    [("s", 0.0010, 0.0011, True), ("A", 0.0010, 0.0011, None), ("s", 0.0012, 0.0013, False)],
)
def test_an_interval_is_held_against_the_truth(unit, low, high, covered):
    parameter = {"name": "tau", "unit": unit, "value": (low + high) / 2, "low": low, "high": high}
    discovery = {"verdict": "named", "effects": [{"name": "delay", "parameters": [parameter]}]}
    assert outcome("single_delay_visible_0", discovery).covered == ({} if covered is None else {"delay": covered})


def test_a_rewritten_log_must_repeat_its_twin():
    names = ["metamorphic_current-lag_strong_0", "metamorphic_current-lag_strong_0_units"]
    results = [Result(n, TRUTH, found("named", "current-lag")) for n in names]
    assert [o.right for o in judge_all([CASES[n] for n in names], results)] == [True, True]
    results[1] = Result(names[1], TRUTH, found("unexplained"))
    assert [o.right for o in judge_all([CASES[n] for n in names], results)] == [True, False]


def test_the_report_counts_and_lists_failures():
    names = ["null_damper-white_0", "single_delay_visible_0", "single_inertia_visible_0"]
    results = [
        Result(names[0], TRUTH, found("none"), 20.0),
        Result(names[1], TRUTH, found("named", "delay"), 30.0),
        Result(names[2], TRUTH, found("named", "gas-spring"), 40.0),
    ]
    text = document(judge_all([CASES[n] for n in names], results), "three cases")
    assert "| null runs that name something | ≤ 1 % | 0.0 % (0/1) |" in text
    assert "| one effect, clearly visible: exact name | ≥ 95 % | 50.0 % (1/2) |" in text
    assert "| wrong name, any stratum | ≤ 2 % | 33.3 % (1/3) |" in text
    assert "`single_inertia_visible_0` (contrast 10.0): named gas-spring, which is not there" in text
    assert "30 s / 40 s" in text
