"""Closed forms of the simulator of hidden forms, and what its scorer calls right."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.outside_forms.drives import WAVES, Drive, make_motion
from benchmarks.outside_forms.forms import KINDS, SINGLES, Factor, Scales, Term, draw_terms, name_of
from benchmarks.outside_forms.lawful import lawful_columns, outside, stop
from benchmarks.outside_forms.laws import LAWS, Damper, draw_damper
from benchmarks.outside_forms.page import figures
from benchmarks.outside_forms.reading import FormulaError, read_formula
from benchmarks.outside_forms.score import Proposal, read_proposed, score
from benchmarks.outside_forms.specimen import Specimen, make_specimen

SCALES = Scales(x=0.02, v=0.3, a=8.0, i=2.0, t=5.0)


def sine(amplitude: float, frequency: float, seconds: float = 2.0, current: float = 1.0) -> Drive:
    motion = make_motion("sine", np.random.default_rng(0), seconds, amplitude, 2 * np.pi * frequency * amplitude)
    return Drive(replace(motion, phases=np.zeros(1)), seconds, np.array([current]), np.zeros(0))


def damper(law: str, **numbers: float) -> Damper:
    base = draw_damper(np.random.default_rng(1), LAWS[law])
    own = {**base.numbers, **numbers}
    fixed = {"rest": 100.0, "gain": 900.0, "bend": 0.0, "damping": 0.0, "slope": 0.0, "speed": 0.2, "stroke": 0.02}
    return replace(base, numbers=own, greatest=1.0, **fixed)


@pytest.mark.parametrize("wave", WAVES)
def test_a_motion_has_exact_derivatives_and_keeps_its_limits(wave: str) -> None:
    motion = make_motion(wave, np.random.default_rng(3), 4.0, 0.01, 0.2)
    t = np.arange(0, 4.0, 1e-4)
    x, v, a = motion.at(t)
    np.testing.assert_allclose(np.gradient(x, 1e-4)[1:-1], v[1:-1], atol=1e-4 * np.max(np.abs(a)) + 1e-5)
    np.testing.assert_allclose(np.gradient(v, 1e-4)[1:-1], a[1:-1], atol=3e-3 * np.max(np.abs(a)))
    reached = max(np.max(np.abs(x)) / 0.01, np.max(np.abs(v)) / 0.2)
    assert reached == pytest.approx(1.0, abs=0.01)


def test_a_dahl_loop_of_small_travel_length_loses_the_energy_of_dry_friction() -> None:
    drive, t = sine(0.02, 1.0), np.arange(0, 2.0, 1e-4)
    force, v = damper("dahl", d=0.01).force(drive, t), drive.motion.at(t)[1]
    last = t >= 1.0
    work = float(np.sum((force * v)[last])) * 1e-4
    # after a reversal z = -1 + 2 exp(-s/d), so that each half of a cycle loses F (2 A - 2 d)
    assert work == pytest.approx(4 * 1000.0 * (0.02 - 2e-4), rel=2e-3)


def test_a_dahl_element_follows_its_exponential_from_rest() -> None:
    drive, t = sine(0.02, 1.0), np.arange(0, 0.25, 1e-3)
    force = damper("dahl", d=0.1).force(drive, t)
    np.testing.assert_allclose(force, 1000.0 * -np.expm1(-drive.motion.at(t)[0] / 0.002), atol=0.05)


def test_a_creeping_element_settles_where_its_flow_is_that_of_the_motion() -> None:
    drive, t = sine(10.0, 0.001), np.arange(0, 2.0, 1e-3)  # 0.063 m/s nearly constant
    force, w = damper("creep", d=0.02).force(drive, t), drive.motion.at(t)[1] / 0.2
    np.testing.assert_allclose(force[-1], 1000.0 * np.arcsinh(w[-1] / 0.03) / np.arcsinh(1 / 0.03), rtol=1e-3)


def test_a_relaxing_branch_has_the_gain_of_a_first_order_lag() -> None:
    tau, frequency = 0.008, 3.0
    device = replace(damper("relaxing", tau=tau), rest=0.0, gain=0.0, damping=100.0)
    drive, t = sine(0.01, frequency, 4.0), np.arange(0, 4.0, 1e-4)
    x, v, _ = drive.motion.at(t)
    late = t >= 3.0
    work = float(np.sum((device.force(drive, t) * v)[late])) * 1e-4
    lag = (2 * np.pi * frequency * 4 * tau) ** 2
    whole = 100.0 / 0.2 * 3 * np.pi * 0.01**2 * 2 * np.pi * frequency  # c pi A^2 w of each of three cycles
    assert work == pytest.approx(whole * (0.5 + 0.5 / (1 + lag)), rel=1e-3)


@pytest.mark.parametrize("law", LAWS)
def test_laws_are_odd_and_lose_energy(law: str) -> None:
    device = damper(law)
    drive, t = sine(0.015, 2.0), np.arange(0, 2.0, 5e-4)
    mirrored = replace(drive, motion=replace(drive.motion, amplitudes=-drive.motion.amplitudes))
    force = device.force(drive, t)
    np.testing.assert_allclose(device.force(mirrored, t), -force, atol=2e-3 * np.max(np.abs(force)))
    assert np.sum((force * drive.motion.at(t)[1])[t >= 1.0]) > 0


def test_a_stop_is_a_path_until_it_yields() -> None:
    x = np.concatenate([np.linspace(0, 3, 31), np.linspace(3, 0, 31)[1:]])
    np.testing.assert_allclose(stop(x, 1.0)[[5, 31 - 1, 40, 60]], [0.5, 1.0, 0.0, -1.0], atol=1e-12)


def test_the_current_waits_and_goes_along_a_ramp() -> None:
    drive = replace(sine(0.01, 1.0), levels=np.array([0.0, 2.0, 1.0]), switches=np.array([0.5, 1.0]))
    np.testing.assert_allclose(drive.current(np.array([0.4, 0.515, 0.8, 1.015, 1.5])), [0.0, 1.0, 2.0, 1.5, 1.0])


TEXTS = {
    "cubic": "(x - 0.001)^3",
    "x-v": "x*v",
    "rebound-square": "max(0, -v)^2",
    "rebound-orifice": "sqrt(max(0, -v))",
    "one-sided-mass": "(|a| + a)/2",
    "current-place": "i*(x + 0.0005)",
    "x2-v": "x²·v",
    "coil-pull": "i^2",
    "guide-friction": "|x|*L",
    "arrhenius": "v*exp(2800/(T + 273.15))",
    "friction-bump": "tanh(v/0.01)*exp(-((x - 0.003)/0.006)^2)",
    "fading-friction": "sgn(v)*exp(-t/2)",
    "settling-spring": "x*exp(-t/1.5)",
    "polytropic": "2*(1 - x/0.04)^-1.3 - 2",
    "cavitation": "max(0, -v - 0.1)",
}


@pytest.mark.parametrize("kind", TEXTS)
def test_the_shape_of_a_formula_is_read_from_its_numbers(kind: str) -> None:
    low = {"x": -0.02, "v": -0.3, "a": -8.0, "i": 0.0, "T": 15.0, "t": 0.0, "L": -1000.0}
    high = {"x": 0.02, "v": 0.3, "a": 8.0, "i": 2.0, "T": 70.0, "t": 5.0, "L": 1000.0}
    assert read_formula(TEXTS[kind])[0].name(low, high) == Term(SINGLES[kind](np.random.default_rng(0), SCALES)).name


@pytest.mark.parametrize("text", ["x*)", "q*x", "open(x)", "x.real"])
def test_a_formula_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(FormulaError):
        read_formula(text + "*v")[0].at({"x": np.ones(3), "v": np.ones(3), "t": np.ones(3)})


def test_factors_of_one_variable_are_joined() -> None:
    square = Term((Factor("v", "odd", {"n": 1.0}), Factor("v", "even", {"n": 1.0})))
    assert square.name == name_of([("v", "sign", 1.0, 1.0), ("v", "even", 2.0, 1.0)]) == {("v", "odd 2")}


@pytest.fixture(scope="module")
def specimen() -> Specimen:
    return make_specimen(4, "x2-v", 5, "bingham")


def test_what_a_law_makes_is_taken_and_what_knows_the_place_is_left(specimen: Specimen) -> None:
    values = specimen.held_out[0].values
    columns = lawful_columns([values], specimen.damper)
    assert np.max(np.abs(outside(columns, 3.0 * values["v"] * values["i"]))) < 1e-9
    assert np.std(outside(columns, values["x"] ** 2)) > 0.3 * np.std(values["x"] ** 2)


def said_of(specimen: Specimen, text: str, alike: tuple[str, ...] = (), value: float = 1.0) -> dict[str, object]:
    low, high = sorted([0.9 * value, 1.1 * value])
    coefficients = [{"name": "k1", "unit": "N", "value": value, "low": low, "high": high}]
    return score(specimen, *read_proposed(specimen, {"text": text, "alike": alike, "coefficients": coefficients}))


def test_a_true_formula_is_right_and_closes_all_but_the_origin(specimen: Specimen) -> None:
    true = specimen.terms[0].coefficient
    said = said_of(specimen, f"k1*(x - {specimen.sensors.stroke_offset})^2*v", value=true)
    assert said["outcome"] == "right"
    assert said["closed"] == pytest.approx(1.0, abs=1e-9)
    assert said["true_scales"] == pytest.approx([1.0], abs=1e-9)
    assert said["holds"] == [True]
    assert said_of(specimen, f"{1.2 * true}*x^2*v", value=1.2 * true)["holds"] == [False]


def test_half_a_force_closes_half(specimen: Specimen) -> None:
    said = said_of(specimen, f"k1*(x - {specimen.sensors.stroke_offset})^2*v", value=specimen.terms[0].coefficient / 2)
    assert (said["closed"], said["closed_square"]) == pytest.approx((0.5, 0.75), abs=1e-9)


@pytest.mark.parametrize(
    ("text", "alike", "outcome"),
    [
        ("3*|x|*v", (), "other-form"),
        ("3*|x|*v", ("2*x^2*v",), "in-set"),
        ("3*sgn(x)*max(0,|x|-0.0004)*v", ("2*x^2*v", "-1*max(0,x--0.01)*v"), "in-set"),
        ("-2*x^2*v", (), "right"),
        ("2*x^2*v - 0.1*x*v", (), "right"),
        ("2*x^2*v + 3*a", (), "other-form"),
        ("", ("2*x^2*v",), "none"),
    ],
)
def test_readings_make_a_set(specimen: Specimen, text: str, alike: tuple[str, ...], outcome: str) -> None:
    assert said_of(specimen, text, alike)["outcome"] == outcome


def test_a_null_is_called_by_any_proposal() -> None:
    null = make_specimen(3, "null-exact-law", 0)
    assert score(null, [])["outcome"] == "right"
    assert score(null, [Proposal(lambda values: values["x"], frozenset())])["outcome"] == "null-called"


def test_a_case_is_always_the_same() -> None:
    first, again = make_specimen(1, "null-wrong-law", 1), make_specimen(1, "null-wrong-law", 1)
    assert first.described() == again.described()
    assert all(a.equals(b) for a, b in zip(first.frames, again.frames, strict=True))


@pytest.mark.parametrize("kind", KINDS)
def test_each_term_of_a_kind_has_a_finite_force_and_a_right_name(kind: str) -> None:
    values = {"x": np.linspace(-0.02, 0.02, 50), "v": np.linspace(-0.3, 0.3, 50), "a": np.linspace(-8, 8, 50)}
    values |= {"i": np.full(50, 1.0), "T": np.linspace(20, 40, 50), "t": np.linspace(0, 5, 50), "L": 900 * np.ones(50)}
    for term, right in draw_terms(kind, np.random.default_rng(5), SCALES):
        assert np.all(np.isfinite(term.at(values)))
        assert term.name in right


def test_the_library_can_be_left_out() -> None:
    command = [sys.executable, "-m", "benchmarks.outside_forms.library_off", "list", "effects", "--json"]
    said = subprocess.run(command, check=True, capture_output=True, text=True)
    assert [effect["name"] for effect in json.loads(said.stdout)] == ["no-force"]


def test_the_figures_count_what_was_said() -> None:
    right = {"kind": "cubic", "proposed": "x^3", "outcome": "right", "closed": 0.9, "holds": [True, False]}
    none = {"kind": "cubic", "proposed": "", "outcome": "none"}
    null = {"kind": "null-wrong-law", "proposed": "x", "outcome": "null-called"}
    stopped, whole = ({"plugged": p} for p in ({"stopped": "export", "why": ""}, {"differs": 1e-12}))
    rows = [{**r, "processor_time": 1.0} for r in (right | stopped, none, null | whole)]
    shares = [line.split("|")[3].split(";")[0].strip() for line in figures(rows).splitlines()[2:12]]
    half = "50.0 % (1/2"
    assert shares == [half, half, half, half, "not run", "100.0 % (1/1", half, "not run", half, half]
