"""Screening: what each effect could take to first order, beside all that the base could absorb."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.progress import silent
from mrfit.core.specs import EffectSpec
from mrfit.discover.evidence.bench import build_bench
from mrfit.discover.evidence.gather import SimulatedEvidence, gather, library_effect
from mrfit.discover.evidence.refit import Fitter
from mrfit.discover.evidence.screen import cosines, present_basis, screen, unjudgeable
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.exact_base import decide, select
from mrfit.discover.selection.questions import Join, Try, refit
from mrfit.fit.select import load_recordings
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence
from tests.discover.studies import workspace

NAMES = ("inertia", "quadratic-drag", "coulomb-friction", "temperature", "force-offset")
EFFECTS: list[EffectSpec] = [registry.load("effect", name).SPEC for name in NAMES]


@pytest.fixture(scope="module")
def fitter(tmp_path_factory: pytest.TempPathFactory) -> Fitter:
    """A damper with a moving mass of 12 kg, to which a base without one was fitted."""
    study = workspace(Path(tmp_path_factory.mktemp("study")), mass=12.0)
    segments = study.read_segments()
    bench = build_bench(segments, load_recordings(study, segments), assemble("tanh"), EFFECTS)
    found = Fitter(bench, "tanh", None, {}, {}, lambda effects, point: None)
    found.first(0)
    return found


def gathering(fitter: Fitter) -> SimulatedEvidence:
    return SimulatedEvidence(fitter, fitter.first(0), EFFECTS, STANDARD, 0, silent)


def test_the_hidden_effect_could_take_most_and_its_first_step_is_about_its_size(fitter: Fitter) -> None:
    first, *others = (s.candidate for s in screen(fitter, fitter.first(0), EFFECTS, STANDARD))
    assert first.name == "inertia" and first.gain > 0.9 and first.strength > 10.0
    assert first.start["inertia.m"] == pytest.approx(12.0, rel=0.2)
    assert all(o.gain < 0.5 for o in others)


def test_what_the_base_has_already_is_absorbed_and_what_was_not_recorded_cannot_be_judged(fitter: Fitter) -> None:
    found = {s.candidate.name: s.candidate for s in screen(fitter, fitter.first(0), EFFECTS, STANDARD)}
    assert found["force-offset"].reason == "absorbed by what the model has"
    assert found["temperature"].reason == "cannot be judged: no temperature"
    everything = screen(fitter, fitter.first(0), EFFECTS, replace(STANDARD, absorbed=1.01))
    assert {s.candidate.reason for s in everything} == {
        "absorbed by what the model has",
        "cannot be judged: no temperature",
    }


def test_an_input_that_must_move_and_does_not_shows_nothing(fitter: Fitter) -> None:
    drag = registry.load("effect", "quadratic-drag").SPEC
    top = float(np.ptp(np.concatenate([s.channel("velocity") for s in fitter.bench.stretches])))
    assert unjudgeable(fitter.bench, replace(drag, moves=(("velocity", 0.9 * top),))) == ""
    still = unjudgeable(fitter.bench, replace(drag, moves=(("velocity", 1.1 * top),)))
    assert still == "cannot be judged: the velocity does not move"


def test_directions_are_free_of_what_the_base_could_follow(fitter: Fitter) -> None:
    source = gathering(fitter)
    screening = source.screen(source.base)
    found = screen(fitter, fitter.first(0), EFFECTS, STANDARD)
    shown = [s for s in found if len(s.direction)]
    assert screening.shown == tuple(s.candidate.name for s in shown)
    assert np.diag(cosines(shown)) == pytest.approx(1.0)
    basis = present_basis(fitter, fitter.first(0))
    for s in shown:
        assert basis.T @ s.direction == pytest.approx(0.0, abs=1e-6)
        # an effect whose bounds forbid the step that would help has no direction
        assert float(np.linalg.norm(s.direction)) == pytest.approx(1.0 if s.candidate.gain else 0.0)


def test_together_two_could_take_no_less_than_either(fitter: Fitter) -> None:
    source = gathering(fitter)
    source.screen(source.base)
    one, other, both = (
        source.reach(source.base, names, source.base)
        for names in (("inertia",), ("quadratic-drag",), ("inertia", "quadratic-drag"))
    )
    assert both >= max(one, other) - 1e-12 and 0.0 <= one <= 1.0
    assert source.reach(source.base, ("temperature",), source.base) == 0.0


def test_the_same_optimum_is_one_row_and_the_decision_from_the_table_is_that_of_the_simulation(fitter: Fitter) -> None:
    source = gathering(fitter)
    (twice, again) = (refit(source, Join(("inertia",), (source.base.values,))) for _ in range(2))
    assert twice.number == again.number != source.base.number
    evidence = gather(source, STANDARD)
    chosen = select(evidence, STANDARD)
    assert (chosen.verdict, chosen.named) == ("named", ("inertia",))
    assert chosen == decide(source, STANDARD)
    assert chosen.final.holdout == source.refit_of(chosen.final).chi("holdout")


def test_aliases_that_change_one_input_are_told_from_others() -> None:
    entry = {name: library_effect(registry.load("effect", name).SPEC) for name in ("free-play", "backlash")}
    # a backlash changes the output, a loop of the biviscous law is a model
    assert {"slip-lock", "backlash", "hysteretic-biviscous"} <= entry["free-play"].aliases
    assert entry["free-play"].of_one_input == {"slip-lock"}
    assert entry["backlash"].aliases >= {"free-play"} and not entry["backlash"].of_one_input


def test_a_play_wider_than_the_ripple_of_a_current_is_seen(tmp_path: Path) -> None:
    """A narrower one only takes the ripple away, of which the force has little."""
    study = workspace(tmp_path, magnetism=0.15, tests=((1.0, 0.01), (3.0, 0.005)))
    effects = [registry.load("effect", name).SPEC for name in ("residual-magnetism", "inertia")]
    segments = study.read_segments()
    law = CurrentDependence(tuple((name, 1) for name in ("fy", "c", "k")), 0.0, 1.0)
    bench = build_bench(segments, load_recordings(study, segments), assemble("tanh", law), effects)
    found = Fitter(bench, "tanh", law, {}, {}, lambda effects, point: None)
    first, other = (s.candidate for s in screen(found, found.first(0), effects, STANDARD))
    assert first.name == "residual-magnetism" and first.gain > 0.5 > 0.05 > other.gain
    assert first.start["residual-magnetism.w"] == pytest.approx(0.15, rel=0.7)


@pytest.mark.parametrize("opening", [300.0, 480.0])
def test_a_force_at_which_a_valve_opens_is_looked_for_among_those_measured(opening: float, tmp_path: Path) -> None:
    study = workspace(tmp_path, relief=opening)
    effect = registry.load("effect", "relief-valve").SPEC
    segments = study.read_segments()
    bench = build_bench(segments, load_recordings(study, segments), assemble("tanh"), [effect])
    found = Fitter(bench, "tanh", None, {}, {}, lambda effects, point: None)
    (only,) = (s.candidate for s in screen(found, found.first(0), [effect], STANDARD))
    assert only.gain > 0.7
    assert only.start["relief-valve.F_o"] == pytest.approx(opening, rel=0.25)
    source = SimulatedEvidence(found, found.first(0), [effect], STANDARD, 0, silent)
    source.screen(source.base)
    largest = max(float(np.max(np.abs(s.measured))) for s in bench.stretches)
    assert refit(source, Try(source.base, only)).levels["relief-valve"] == pytest.approx(opening / largest, rel=0.05)


def test_an_effect_that_remembers_the_current_cannot_be_judged_where_every_test_holds_it(tmp_path: Path) -> None:
    """A play takes its width off a current that was raised once: a law of current, and no memory that a test shows."""
    study = workspace(tmp_path, magnetism=0.15, tests=((1.0, 0.01), (3.0, 0.005)))
    effect = registry.load("effect", "residual-magnetism").SPEC
    segments, recordings = study.read_segments(), {}
    for name, one in load_recordings(study, study.read_segments()).items():
        held_at = np.full(one.samples, 0.5 if name.startswith("1") else 1.0)
        recordings[name] = replace(one, channels={**one.channels, "current": held_at})
    law = CurrentDependence(tuple((name, 1) for name in ("fy", "c", "k")), 0.0, 1.0)
    bench = build_bench(segments, recordings, assemble("tanh", law), [effect])
    found = Fitter(bench, "tanh", law, {}, {}, lambda effects, point: None)
    (screened,) = screen(found, found.first(0), [effect], STANDARD)
    assert screened.candidate.reason == "cannot be judged: every test holds the current"
    assert not screened.candidate.shown
