"""What is hidden is named, nothing is named where nothing is hidden, and too little data is said to be too little."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import mrfit.segment.stage
from mrfit.core.progress import silent
from mrfit.core.recording import Finding, Recording
from mrfit.discover import base_dependence, stage
from mrfit.discover.base_dependence import Currents
from mrfit.discover.evidence import plain_fit
from mrfit.discover.evidence.work import Effort, shape_of_loop
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.combine import Floors
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.stage import Settings, _fitter, run
from mrfit.discover.writing.result import DiscoveryRequest, insufficient
from mrfit.errors import ConfigError, DataError
from mrfit.fit import stage as fit_stage
from mrfit.fit.select import load_recordings
from mrfit.io.dataset import Dataset
from mrfit.io.schemas.stages import About
from mrfit.io.workspace import Workspace, plain, write_json
from mrfit.report.explain import sentences
from mrfit.simulate import current_levels
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence
from tests.discover.studies import GAS_COLUMN, TESTS, workspace
from tests.discover.world import fit


def test_a_complete_model_lacks_nothing(tmp_path: Path) -> None:
    found = run(workspace(tmp_path), Settings("tanh")).found
    assert found.verdict == "none"
    assert found.effects == () and found.augmented_model == "tanh"
    assert found.gap.before == pytest.approx(found.gap.noise_floor, rel=0.1)


def test_a_hidden_mass_is_named_measured_and_closes_the_gap(tmp_path: Path) -> None:
    found = run(workspace(tmp_path, mass=12.0), Settings("tanh")).found
    assert found.verdict == "named"
    (effect,) = found.effects
    assert effect.name == "inertia"
    (mass,) = effect.parameters
    assert mass.low <= 12.0 <= mass.high
    assert mass.high - mass.low < 1.0
    assert found.gap.closed > 0.9
    assert effect.holdout_nrmse_after < effect.holdout_nrmse_before


def test_plain_errors_are_those_that_fits_of_the_same_models_state(tmp_path: Path) -> None:
    study = workspace(tmp_path, mass=12.0)
    found = run(study, Settings("tanh")).found
    fitted = [fit_stage.run(study, fit_stage.Settings(m, per="all")) for m in ("tanh", found.augmented_model)]
    before, after = (fit_stage.over_held_out(own.metrics) for own in fitted)
    # the augmented model's fit begins where the discovery's ended, not from many starts
    assert found.gap.plain_before == before and found.gap.plain_after == pytest.approx(after, rel=1e-3)
    assert found.gap.plain_after < 0.5 * found.gap.plain_before
    assert "Plain errors" in " ".join(sentences(found))


def test_plain_errors_that_take_long_are_left_out_and_that_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = workspace(tmp_path)
    data = Dataset(study.read_segments(), load_recordings(study, study.read_segments()))
    monkeypatch.setattr(plain_fit, "STANDARD", replace(STANDARD, most_work=1))
    for model, said in (
        ("boucwen", ["Left out, as it takes long: plain errors, which `mrfit fit` states."]),
        ("tanh", []),
    ):
        asked = insufficient(DiscoveryRequest(model, 0, "", "k"), "too few")
        found = plain_fit.with_plain_errors(asked, {}, study, Settings(model), data)
        assert (found.gap.plain_before is None) == bool(said) and sentences(found)[1:] == said


@pytest.mark.parametrize(
    ("model", "spent", "stated"), [("boucwen", 100, True), ("boucwen", 101, False), ("tanh", 101, True)]
)
def test_plain_errors_of_a_law_that_is_stepped_are_left_out_after_much_work_and_that_is_said(
    model: str, spent: int, stated: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage, "STANDARD", replace(STANDARD, most_effort_told=100))
    monkeypatch.setattr(stage, "with_plain_errors", lambda found, *_: f"{found} with errors")
    job = replace(JOB, settings=Settings(model), effort=Effort(spent))
    told: Any = stage.DiscoveryOutput("a discovery")  # type: ignore[arg-type]
    assert stage._with_plain_errors(job, told, job.data).found == "a discovery" + " with errors" * stated
    assert job.effort.left_out == ([] if stated else ["plain errors, which `mrfit fit` states"])


@pytest.mark.parametrize(("channel", "told"), [("displacement", True), ("temperature", False)])
def test_what_ingest_found_wrong_of_a_channel_that_the_law_takes_is_among_the_advice(
    channel: str, told: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = workspace(tmp_path)
    log = made.read_recording(made.read_segments()[0].recording)
    made.write_recording(replace(log, findings=(Finding("away-from-zero", channel, None, "it never passes zero"),)))
    monkeypatch.setattr(stage, "_discovered", lambda job: stage.DiscoveryOutput(insufficient(job.asked, "too few")))
    monkeypatch.setattr(stage, "_with_plain_errors", lambda job, told, logged: told)
    assert any("it never passes zero" in text for text in run(made, Settings("tanh")).found.advice) == told


def test_two_hidden_effects_are_both_named_and_the_augmented_model_can_be_assembled(tmp_path: Path) -> None:
    found = run(workspace(tmp_path, mass=12.0, drag=2500.0), Settings("tanh")).found
    assert {e.name for e in found.effects} == {"inertia", "quadratic-drag"}
    assert set(assemble(found.augmented_model).spec.inputs) >= {"acceleration", "velocity"}


def test_a_gas_spring_is_seen_though_the_base_has_a_straight_spring_of_its_own(tmp_path: Path) -> None:
    found = run(workspace(tmp_path, gas=250.0), Settings("tanh")).found
    (effect,) = found.effects
    assert effect.name == "gas-spring"
    column = next(p for p in effect.parameters if p.name == "c")
    assert column.value == pytest.approx(1.0 / GAS_COLUMN, rel=0.1)


def test_at_one_frequency_a_mass_is_not_named_since_the_spring_of_the_base_is_its_twin(tmp_path: Path) -> None:
    tests = tuple((2.0, x) for x in (0.005, 0.008, 0.01, 0.012, 0.015))
    found = run(workspace(tmp_path, mass=12.0, tests=tests), Settings("tanh")).found
    assert found.verdict == "none"
    inertia = next(c for c in found.candidates if c.name == "inertia")
    assert not inertia.accepted and "absorbed" in inertia.reason


def test_too_few_conditions_are_said_and_not_guessed(tmp_path: Path) -> None:
    found = run(workspace(tmp_path, mass=12.0, tests=TESTS[:2]), Settings("tanh")).found
    assert found.verdict == "insufficient-data"
    assert "no held-out condition" in found.advice[0]


def test_an_effect_whose_channel_was_not_recorded_cannot_be_judged(tmp_path: Path) -> None:
    found = run(workspace(tmp_path), Settings("tanh")).found
    reasons = {c.name: c.reason for c in found.candidates}
    assert reasons["temperature"] == "cannot be judged: no temperature"
    assert reasons["current-lag"] == "cannot be judged: no current"


def test_the_same_bytes_come_twice_and_a_second_run_does_nothing(tmp_path: Path) -> None:
    written = []
    for name in ("a", "b"):
        study = workspace(tmp_path / name, mass=12.0)
        run(study, Settings("tanh"))
        written.append((study.root / "discover" / "discovery.json").read_bytes())
        assert run(study, Settings("tanh")).skipped
    assert written[0] == written[1]


def test_a_stopped_discovery_goes_on_from_its_finished_fits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spent: list[int] = []
    whole = workspace(tmp_path / "whole", mass=12.0)
    monkeypatch.setattr(stage, "_with_plain_errors", lambda job, told, _: spent.append(job.effort.spent) or told)
    run(whole, Settings("tanh"))
    study = workspace(tmp_path / "stopped", mass=12.0)
    seen: list[str] = []

    def stop(what: str, done: int, total: int) -> None:
        seen.append(what)
        if what.startswith("round 1") and done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(study, Settings("tanh"), stop)
    kept = json.loads((study.root / "discover" / ".partial" / "fits.json").read_text())
    assert [] in [f["effects"] for f in kept["fits"]]
    run(study, Settings("tanh"))
    # what is left out by the work so far does not depend on where a run began
    once = sum(s.samples for s in study.read_segments() if s.role == "train")
    assert len(spent) == 2 and spent[0] == spent[1] > 7 * once
    assert (study.root / "discover" / "discovery.json").read_bytes() == (
        whole.root / "discover" / "discovery.json"
    ).read_bytes()


def test_a_fit_that_was_improved_is_improved_again_by_a_resumed_run(tmp_path: Path) -> None:
    """What a run found after better starts must not stand where a resumed one fits from the first starts."""
    study = workspace(tmp_path, mass=12.0)
    segments = study.read_segments()
    data = Dataset(segments, load_recordings(study, segments))
    job = stage._Job(study, Settings("tanh"), data, DiscoveryRequest("tanh", 0, "", "key"), silent)
    fitter = _fitter(job, None)
    first, better = np.zeros(3), np.ones(3)
    fitter.keep(("inertia",), first)
    fitter.keep(("inertia",), better)
    resumed = _fitter(job, None)
    assert np.array_equal(resumed.known["inertia",], first)


def test_a_channel_that_a_written_effect_lacks_is_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="temperature"):
        run(workspace(tmp_path), Settings("tanh+temperature"))


def test_start_values_of_written_effects_are_taken(tmp_path: Path) -> None:
    found = run(workspace(tmp_path, mass=12.0), Settings("tanh+inertia", start=(("inertia.m", 5.0),))).found
    assert found.verdict == "none"


def test_a_dead_load_cell_is_no_case_for_discovery(tmp_path: Path) -> None:
    study = workspace(tmp_path)
    for segment in study.read_segments():
        recording = study.read_recording(segment.recording)
        force = np.full(recording.samples, 3.0)
        study.write_recording(replace(recording, channels={**recording.channels, "force": force}))
    with pytest.raises(DataError, match="same in every sample"):
        run(study, Settings("tanh"))


def test_a_start_value_of_no_parameter_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no parameter 'fz'"):
        run(workspace(tmp_path), Settings("tanh", start=(("fz", 1.0),)))


def at_five_currents(folder: Path, model: str, law: Callable[[float], dict[str, float]]) -> Workspace:
    """Sines at five currents on a damper that the model describes with parameters that follow a law of current."""
    base, rng, made, about = assemble(model), np.random.default_rng(11), Workspace(folder), []
    for current in (0.0, 0.5, 1.0, 1.5, 2.0):
        values = law(current)
        theta = np.array([[values.get(p.name, p.start) for p in base.spec.params]])
        for frequency, stroke in ((1.0, 0.005), (2.0, 0.01), (4.0, 0.008)):
            omega, count = 2 * np.pi * frequency, 6 * 250
            t = np.arange(-250, count) / (250 * frequency)
            drive = np.stack([stroke * np.sin(omega * t), stroke * omega * np.cos(omega * t)])
            force = base.simulate(drive, theta, t[1] - t[0])[0, 250:]
            name = f"{frequency:g}Hz-{1e3 * stroke:g}mm-{current:g}A"
            channels = {"displacement": drive[0, 250:], "force": force + 2.0 * rng.standard_normal(count)}
            channels |= {"velocity": drive[1, 250:], "current": np.full(count, current)}
            record = Recording(name, f"{name}.csv", name, "none", t[1] - t[0], 0.0, channels, {})
            made.write_recording(record)
            about.append(plain(About.of(record)))
    write_json(made.ingest_json, {"recordings": about, "refused": []})
    mrfit.segment.stage.run(made, mrfit.segment.stage.Settings())
    return made


@pytest.mark.slow
def test_a_yield_force_that_is_a_plain_parabola_of_current_is_no_missing_effect(tmp_path: Path) -> None:
    study = at_five_currents(
        tmp_path, "spencer", lambda i: {"alpha": 100.0 + 1500.0 * i - 330.0 * i**2, "C_inf": 2000.0 + 1000.0 * i}
    )
    found = run(study, Settings("spencer")).found
    assert dict(found.current_dependence.orders)["alpha"] == "plain2"
    assert found.verdict == "none" and found.effects == ()
    assert found.gap.before == pytest.approx(found.gap.noise_floor, rel=0.1)


@pytest.mark.slow
def test_a_field_that_saturates_is_named_and_not_bent_after_by_polynomials_of_higher_order(tmp_path: Path) -> None:
    def law(current: float) -> dict[str, float]:
        felt = current / (1.0 + (current / 1.2) ** 4) ** 0.25
        return {"fy": 100.0 + 900.0 * felt, "c": 800.0 + 600.0 * felt}

    found = run(at_five_currents(tmp_path, "tanh", law), Settings("tanh")).found
    (effect,) = found.effects
    assert effect.name == "current-saturation"
    assert effect.parameters[0].value == pytest.approx(1.2**-2, rel=0.02)


BENCH = SimpleNamespace(noise_is_measured=lambda role: True, most_noise=lambda role: 1.0)
CHOSEN, USUAL = (CurrentDependence((("fy", order),), 0.0, 1.0) for order in (1, 2))


@pytest.mark.parametrize(("model", "remembers"), [("boucwen", True), ("guo", False), ("dahl", True)])
def test_the_shape_of_a_loop_that_remembers_is_the_same_at_all_currents(model: str, remembers: bool) -> None:
    loops = {p.name for p in assemble(model).spec.params if p.role == "hysteresis"}
    assert loops and set(shape_of_loop(model)) == (loops if remembers else set())


@pytest.mark.parametrize(
    ("samples", "near", "taken"),
    [
        (90, "guo", "guo"),
        (110, "guo", ""),
        (90, "", ""),
        # the plainest of those near the floor, whichever leaves least
        (90, "spencer guo biviscous", "biviscous"),
        # spencer is slow to simulate
        (9, "spencer", "spencer"),
        (11, "spencer", ""),
        (11, "spencer guo", "guo"),
    ],
)
def test_the_plainest_law_is_taken_as_exact_only_near_the_floor_and_within_the_time(
    samples: int, near: str, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[str] = []
    monkeypatch.setattr(stage, "STANDARD", replace(STANDARD, most_samples_again=100, rough_weight=10.0))
    monkeypatch.setattr(stage, "_decided", lambda job: tried.append(job.settings.model))
    monkeypatch.setattr(stage, "_exact", lambda job, decided: job)
    monkeypatch.setattr(stage, "with_another_base", lambda told, again: again)
    models = ("tanh", "spencer", "guo", "biviscous")
    laws = [SimpleNamespace(model=m, near_the_floor=m in near.split()) for m in models]
    data = Dataset([SimpleNamespace(samples=samples)], {})  # type: ignore[list-item]
    job = stage._Job(Workspace(Path()), Settings("bingham", "1"), data, DiscoveryRequest("bingham", 0, "", "k"), silent)
    told: Any = SimpleNamespace(other_laws=laws)
    found: Any = stage._with_another_base(job, told)
    assert tried == [taken] * bool(taken) and (found is told) == (not taken)
    if taken:
        assert (found.settings.current_order, found.asked.model, found.asked.key) == ("auto", taken, f"k {taken}")


@dataclass(frozen=True)
class LawsByRole:
    """A fitter by which laws of current by role leave the noise beside any effects."""

    dependence: CurrentDependence | None = None
    start: Any = None
    known: Any = None
    judged: Any = None
    keep: Any = None
    bench: Any = field(default_factory=lambda: BENCH)

    def refits(self, wanted: Any) -> Any:
        """Return the one fit that is asked for."""
        assert self.dependence == USUAL and len(wanted) == 1
        return [SimpleNamespace(chi=lambda role: 1.0)]


@pytest.mark.parametrize(
    ("by_role", "words", "taken"),
    [
        # an effect that is a law of current has to survive laws by role, which here leave 1.0 beside the others
        (False, {CHOSEN: "named at 1.0 current-saturation inertia", USUAL: "named at 1.0 inertia"}, USUAL),
        (False, {CHOSEN: "named at 1.0 current-saturation inertia", USUAL: "named at 1.0 current-lag"}, CHOSEN),
        (False, {CHOSEN: "named at 1.0 current-saturation", USUAL: "none"}, USUAL),
        (False, {CHOSEN: "named at 0.9 current-saturation inertia"}, CHOSEN),
        (False, {CHOSEN: "named at 1.0 current-lag inertia"}, CHOSEN),
        (False, {CHOSEN: "unexplained", USUAL: "named"}, USUAL),
        (False, {CHOSEN: "unexplained", USUAL: "unexplained"}, CHOSEN),
        (False, {CHOSEN: "unexplained", USUAL: "insufficient-data"}, CHOSEN),
        (False, {CHOSEN: "named"}, CHOSEN),
        (False, {CHOSEN: "none"}, CHOSEN),
        (True, {CHOSEN: "unexplained"}, CHOSEN),
    ],
)
def test_laws_by_role_are_tried_only_where_chosen_ones_leave_a_gap_and_kept_only_where_they_close_it(
    by_role: bool, words: dict[CurrentDependence, str], taken: CurrentDependence, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = []

    def judged(job: Any, dependence: CurrentDependence) -> Any:
        tried.append(dependence)
        gathering = SimpleNamespace(fitter=LawsByRole(), refit_of=lambda fit: fit, noise=1.0, noise_is_told=True)
        verdict, *rest = words[dependence].split()
        _, error, *effects = rest or ("at", "2.0")
        final = fit(float(error), *effects)
        return SimpleNamespace(
            gathering=gathering, chosen=SimpleNamespace(base=fit(2.0), final=final, effects=effects, verdict=verdict)
        )

    choice = SimpleNamespace(by_role=by_role, errs=False, dependence=CHOSEN, about={"text": ["chosen"]})
    monkeypatch.setattr(stage, "_judged", judged)
    monkeypatch.setattr(stage, "current_dependence", lambda *_: Currents(CHOSEN, choice))
    monkeypatch.setattr(stage, "usual_dependence", lambda *_: USUAL)
    monkeypatch.setattr(stage, "_started", lambda settings, *_: settings)
    monkeypatch.setattr(stage, "findings", lambda *_: None)
    monkeypatch.setattr(
        stage, "account", lambda asked, chosen, *_: SimpleNamespace(asked=asked, verdict=chosen.verdict, suspects=())
    )
    monkeypatch.setattr(stage, "series_of", lambda *_: {})
    monkeypatch.setattr(stage, "worth_examining", lambda *_: False)
    monkeypatch.setattr(stage, "may_err", lambda *_: False)
    asked = DiscoveryRequest("tanh", 0, "", "k")
    job = stage._Job(Workspace(Path()), Settings("tanh"), Dataset([], {}), asked, silent)
    found: Any = stage._discovered(job).found
    assert tried == list(words) and found.verdict == words[taken].split()[0]
    assert found.asked.dependence.orders == taken.orders
    assert (found.asked.choice is None) == (taken == USUAL)


BESIDE = CurrentDependence((("fy", "sat2"),), 0.0, 2.0)
JOB = stage._Job(Workspace(Path()), Settings("tanh"), Dataset([], {}), DiscoveryRequest("tanh", 0, "", "k"), silent)


def decision(words: str, trials: Sequence[Any] = (), train: float | None = None, fitter: Any = None) -> Any:
    """Return a decision of words, ``VERDICT at ERROR EFFECT…``, with the trials of single effects."""
    verdict, _, error, *effects = words.split()
    final = fit(float(error), *effects, train=train)
    chosen = SimpleNamespace(base=fit(2.0), final=final, effects=tuple(effects), verdict=verdict, trials=tuple(trials))
    return SimpleNamespace(chosen=chosen, gathering=SimpleNamespace(fitter=fitter))


@pytest.mark.parametrize(
    ("base", "final", "times"),
    [
        # in training and on held-out tests, in multiples of the noise floors
        ((3.0, 2.0), (1.0, 0.8), 1),
        ((3.0, 2.0), (1.0, 0.7), 2),
        ((3.0, 2.0), (0.7, 1.0), 2),
        ((1.0, 0.7), (1.0, 0.7), 1),
    ],
)
def test_floors_above_what_a_fit_leaves_are_lowered_and_effects_selected_again(
    base: tuple[float, float], final: tuple[float, float], times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    lowered, selected = [], []

    def refit(errors: tuple[float, float], *effects: str) -> Any:
        return SimpleNamespace(effects=effects, chi=lambda role: errors[role == "holdout"])

    @dataclass(frozen=True)
    class KnownFloors:
        """Fits to tests of which every noise floor is known."""

        bench: Any = field(default_factory=lambda: SimpleNamespace(stretches=()))
        known: Any = None
        keep: Any = None

        def first(self, seed: int) -> Any:
            return refit(base)

    def lower(fitter: Any, fit: Any, recordings: Any) -> Any:
        lowered.append(fit.effects)
        return fitter

    def choose(job: Any, fitter: Any, first: Any) -> Any:
        selected.append(job.asked.key)
        ended = first if final == base else refit(final, "inertia")
        return SimpleNamespace(gathering=SimpleNamespace(refit_of=lambda fit: fit), chosen=SimpleNamespace(final=ended))

    monkeypatch.setattr(stage, "_fitter", lambda *_: KnownFloors())
    monkeypatch.setattr(stage, "_with_residual_floors", lower)
    monkeypatch.setattr(stage, "_selected", choose)
    stage._judged(JOB, None)
    assert selected == ["k", "k lower floors"][:times]
    assert lowered == ([("inertia",)] if times == 2 else [()] if final == base else [])


@pytest.mark.parametrize("spent", [100, 101])
def test_no_other_decision_is_made_after_much_work_and_that_is_said_once(
    spent: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage, "STANDARD", replace(STANDARD, most_effort=100))
    monkeypatch.setattr(stage, "_judged", lambda *_: decision("named at 0.9 inertia"))
    job = replace(JOB, effort=Effort(spent))
    decided = stage._DependenceChoice(decision("unexplained at 2.0"), Currents(CHOSEN))
    tried = (stage._better_decided(job, Currents(BESIDE), decided), stage._with_fewer_names(job, BESIDE, decided))
    made = spent <= 100
    assert [one is not decided for one in tried] == [made, made]
    assert job.effort.left_out == ([] if made else ["other dependences on current"])


@pytest.mark.parametrize(
    ("first", "examined", "trials", "beside", "other", "kept"),
    [
        # a gap that no effect explains, though one leaves noise where it was fitted
        ("unexplained at 2.0", True, {"inertia": 1.0, "delay": 1.6}, BESIDE, "named at 0.9 inertia", True),
        # more effects than the one that leaves noise
        ("named at 1.0 inertia delay", False, {"inertia": 1.0}, BESIDE, "named at 0.9 inertia", True),
        ("named at 1.0 inertia delay", False, {"inertia": 1.0}, BESIDE, "named at 1.1 inertia", False),
        # one effect that leaves too much on held-out tests
        ("named at 1.9 delay", True, {"inertia": 1.0, "delay": 1.6}, BESIDE, "named at 0.9 inertia", True),
        ("named at 1.0 inertia", False, {"inertia": 1.0}, None, "", False),
        ("none at 1.0", False, {"inertia": 1.0}, None, "", False),
        # one that came nearer in a search than any of the first trials
        ("named at 2.6 inertia", True, {"delay": 1.1, "inertia": 1.2}, BESIDE, "named at 0.9 inertia", True),
        ("named at 2.6 delay inertia", True, {"delay": 1.6, "inertia": 1.2}, BESIDE, "named at 0.9 inertia", True),
        # none leaves noise where it was fitted
        ("unexplained at 2.0", True, {"inertia": 1.6}, None, "", False),
        ("unexplained at 2.0", True, {"inertia": 1.4}, BESIDE, "named at 0.9 inertia", True),
        ("named at 1.0 inertia delay", False, {"inertia": 1.3}, None, "", False),
        ("unexplained at 2.0", True, {}, None, "", False),
        # the same laws, or none that explain the gap
        ("unexplained at 2.0", True, {"inertia": 1.0}, CHOSEN, "", False),
        ("unexplained at 2.0", True, {"inertia": 1.0}, BESIDE, "unexplained at 2.0", False),
    ],
)
def test_laws_are_chosen_again_beside_an_effect_that_leaves_noise_where_it_was_fitted(
    first: str,
    examined: bool,
    trials: dict[str, float],
    beside: CurrentDependence | None,
    other: str,
    kept: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own = [SimpleNamespace(fit=fit(2.0, e, train=train)) for e, train in trials.items()]
    asked: list[Any] = []

    def dependence(settings: Any, data: Any, effects: tuple[str, ...], held: dict[str, float]) -> Currents:
        asked.append((effects, held))
        return Currents(beside)

    monkeypatch.setattr(stage, "_judged", lambda job, _: decision(other, own, train=1.0))
    monkeypatch.setattr(stage, "_floors", lambda _: Floors(1.0, True))
    monkeypatch.setattr(stage, "worth_examining", lambda *_: examined)
    monkeypatch.setattr(stage, "current_dependence", dependence)
    decided = stage._DependenceChoice(decision(first, own, train=1.0), Currents(CHOSEN))
    found = stage._with_laws_beside_an_effect(JOB, decided)
    assert (found is not decided) == kept
    assert asked == [(("inertia",), {})] * (beside is not None)
    assert found.currents.dependence == (BESIDE if kept else CHOSEN)


@pytest.mark.parametrize(
    ("gains", "other", "kept"),
    [
        # a yield force that bends more leaves an effect alone, which laws of the roles hid
        (True, "named at 1.1 stribeck", True),
        (True, "none at 1.1", True),
        (True, "unexplained at 1.1", False),
        (True, "named at 4.1 stribeck", False),
        # it needs no effect that is a law of current, and errs hardly more where it was fitted
        (True, "named at 4.1 temperature", True),
        (True, "named at 4.3 temperature", False),
        # none of the effects leaves less beside it
        (False, "", False),
    ],
)
def test_forces_bend_more_and_shapes_stay_constant_where_these_tell_more(
    gains: bool, other: str, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []

    def judged(job: Any, dependence: CurrentDependence) -> Any:
        asked.append(dependence.orders)
        return decision(other)

    by_role = CurrentDependence((("fy", 2), ("a1", 2), ("c", 1)), 0.0, 1.0)
    monkeypatch.setattr(stage, "_judged", judged)
    monkeypatch.setattr(base_dependence, "usual_dependence", lambda *_: by_role)
    monkeypatch.setattr(stage, "_gains_by", lambda *_: gains)
    monkeypatch.setattr(stage, "_started", lambda job, _: job)
    monkeypatch.setattr(
        base_dependence, "tested_currents", lambda *_: current_levels.TestedCurrents([0.0, 0.3, 0.6, 1.0], [], 0.0, 1.0)
    )
    first = "named at 4.0 current-saturation temperature" if "temperature" in other else "unexplained at 4.0"
    decided = stage._DependenceChoice(decision(first), Currents(CHOSEN))
    found = stage._with_plain_laws(JOB, decided)
    assert asked == [(("fy", 3), ("c", 1))] * gains
    assert (found is not decided) == kept


@pytest.mark.parametrize(
    ("errors", "gains"),
    [
        # of fitted and of held-out tests, beside each set of effects; the first laws leave 2, and 1.5 beside an effect
        ({(): (2.0, 2.0)}, False),
        ({(): (1.85, 2.1)}, False),
        ({(): (1.75, 2.5)}, True),
        ({(): (2.1, 1.75)}, True),
        ({("stribeck",): (1.5, 1.2)}, True),
        ({("inertia",): (1.5, 1.2)}, True),
        # the fourth in the order of what they leave where they were fitted
        ({("asymmetry",): (0.9, 0.9)}, False),
    ],
)
def test_other_laws_of_current_are_decided_with_where_some_effects_leave_less_beside_them(
    errors: dict[tuple[str, ...], tuple[float, float]], gains: bool
) -> None:
    asked: list[Any] = []

    @dataclass(frozen=True)
    class OtherLaws(LawsByRole):
        """A fitter by which every set of effects leaves what it left before unless said otherwise."""

        def refits(self, wanted: Any) -> Any:
            """Return the fits that are asked for."""
            asked.extend(w.effects for w in wanted)
            left = [errors.get(w.effects, (1.5, 1.5) if w.effects else (2.0, 2.0)) for w in wanted]
            return [SimpleNamespace(chi=lambda role, e=e: e[role == "holdout"]) for e in left]

    names = {"stribeck": 1.5, "gas-spring": 1.4, "temperature": 1.3, "asymmetry": 1.6}
    trials = [SimpleNamespace(fit=fit(1.5, e, train=train)) for e, train in names.items()]
    found = decision("named at 1.5 inertia", trials, fitter=OtherLaws())
    assert stage._gains_by(JOB, found, CHOSEN) == gains
    assert asked == [(), ("inertia",), ("temperature",), ("gas-spring",), ("stribeck",)]


@pytest.mark.parametrize(
    ("first", "told", "errs", "order", "tried"),
    [
        # an examination believes nothing of what was named
        ("named at 1.0 relief-valve", "unexplained", False, "auto", True),
        ("none at 1.0", "none", False, "auto", False),
        ("named at 1.0 inertia", "named", False, "auto", False),
        ("named at 1.0 relief-valve", "insufficient-data", False, "auto", True),
        ("insufficient-data at 1.0", "insufficient-data", False, "auto", False),
        # a gap, with which plain laws were tried before
        ("named at 2.6 relief-valve", "unexplained", True, "auto", True),
        ("unexplained at 2.6", "unexplained", True, "auto", True),
        # the user's own
        ("named at 1.0 relief-valve", "unexplained", False, "fy=1", False),
    ],
)
@pytest.mark.parametrize("better", [True, False])
def test_plain_laws_are_tried_once_where_the_law_may_be_too_plain(
    first: str, told: str, errs: bool, order: str, tried: bool, better: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []
    words: Any = decision(first)
    chosen = Selection(words.chosen.base, words.chosen.final, words.chosen.final, Any, verdict=words.chosen.verdict)
    decided = stage._DependenceChoice(stage._JudgedDependence(words.gathering, chosen), Currents(CHOSEN))
    other = stage._DependenceChoice(decision("none at 0.9"), Currents(BESIDE))

    def with_plain_laws(job: Any, found: Any) -> Any:
        asked.append(found.judged.chosen.final.holdout)
        return other if better else found

    def examined(job: Any, found: Any) -> Any:
        return SimpleNamespace(found=SimpleNamespace(verdict=told if found.judged is decided.judged else "none"))

    monkeypatch.setattr(stage, "current_dependence", lambda *_: decided.currents)
    monkeypatch.setattr(stage, "_judged", lambda *_: decided.judged)
    monkeypatch.setattr(stage, "_with_bent_laws", lambda job, found: decided)
    monkeypatch.setattr(stage, "_may_err", lambda found: errs and found is decided.judged)
    monkeypatch.setattr(stage, "_with_plain_laws", with_plain_laws)
    monkeypatch.setattr(stage, "_examined", examined)
    found = stage._discovered(replace(JOB, settings=Settings("tanh", current_order=order)))
    # what is not believed takes nothing
    assert asked == [2.6 if errs else 2.0] * tried
    assert found.found.verdict == ("none" if tried and better else told)


@pytest.mark.parametrize(
    ("first", "other", "whole", "kept"),
    [
        # an effect of the current cannot be proved, but a law that stands for it leaves noise
        ("unexplained at 4.0", "none at 1.1", BESIDE, True),
        ("unexplained at 4.0", "named at 1.1 inertia", BESIDE, True),
        # it explains no more, or errs more on held-out tests
        ("unexplained at 4.0", "unexplained at 2.0", BESIDE, False),
        ("unexplained at 4.0", "named at 4.1 inertia", BESIDE, False),
        # what an effect or the base alone explains keeps its laws
        ("named at 1.1 current-saturation", "", BESIDE, False),
        ("none at 1.1", "", BESIDE, False),
        ("insufficient-data at 4.0", "", BESIDE, False),
        # there are no other laws
        ("unexplained at 4.0", "", CHOSEN, False),
    ],
)
def test_laws_that_may_stand_for_an_effect_are_taken_only_where_nothing_else_explains_the_gap(
    first: str, other: str, whole: CurrentDependence, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[CurrentDependence | None] = []

    def judged(job: Any, dependence: CurrentDependence | None) -> Any:
        asked.append(dependence)
        return decision(other)

    monkeypatch.setattr(stage, "_judged", judged)
    monkeypatch.setattr(stage, "_started", lambda job, _: job)
    decided = stage._DependenceChoice(decision(first), Currents(CHOSEN))
    choice: Any = SimpleNamespace(dependence=whole)
    found = stage._with_laws_as_chosen(JOB, decided, choice)
    assert asked == [BESIDE] * bool(other)
    assert found.currents.dependence == (BESIDE if kept else CHOSEN)
    assert (found is not decided) == kept


def test_an_order_that_was_asked_for_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    judged = decision("unexplained at 4.0")
    monkeypatch.setattr(stage, "_judged", lambda *_: judged)
    monkeypatch.setattr(stage, "current_dependence", lambda *_: Currents(CHOSEN))
    asked = replace(JOB, settings=Settings("tanh", current_order="fy=1"))
    assert stage._decided(asked) == stage._DependenceChoice(judged, Currents(CHOSEN))


@dataclass(frozen=True)
class BentLaws(LawsByRole):
    """A fitter by which the base with a law that bends more leaves an error."""

    error: float = 1.0

    def refits(self, wanted: Any) -> Any:
        """Return the one fit that is asked for."""
        assert self.dependence.orders == (("fy", 2), ("c", 1)) and [w.effects for w in wanted] == [()]
        return [SimpleNamespace(chi=lambda role: self.error)]


@pytest.mark.parametrize(
    ("first", "bent", "other", "kept"),
    [
        # the law of a moving current was too plain: no effect leaves less than one that bends more
        ("named at 1.15 current-saturation", 1.14, "none at 1.14", True),
        ("named at 1.15 current-saturation", 1.16, "", False),
        # at the noise it is no more
        ("named at 0.96 current-saturation", 0.97, "none at 0.97", True),
        # the decision with it is open, or has as many effects
        ("named at 1.15 current-saturation", 1.14, "unexplained at 1.14", False),
        ("named at 1.15 current-saturation", 1.14, "named at 1.14 inertia", False),
        # no effect was named that is such a law
        ("named at 1.15 inertia", 1.14, "", False),
        ("unexplained at 4.0", 1.04, "", False),
    ],
)
def test_a_law_of_a_moving_current_that_bends_more_takes_the_place_of_an_effect_that_leaves_no_less(
    first: str, bent: float, other: str, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []

    def judged(job: Any, dependence: Any) -> Any:
        asked.append(dependence.orders)
        return decision(other, fitter=BentLaws(error=bent))

    monkeypatch.setattr(stage, "_judged", judged)
    tested = current_levels.TestedCurrents([], [np.zeros(9)], 0.0, 1.0)
    monkeypatch.setattr(base_dependence, "tested_currents", lambda *_: tested)
    plain = CurrentDependence((("fy", 1), ("c", 1)), 0.0, 2.0)
    decided = stage._DependenceChoice(decision(first, fitter=BentLaws(error=bent)), Currents(plain))
    found = stage._with_bent_laws(JOB, decided)
    assert (found is not decided) == kept and asked == [(("fy", 2), ("c", 1))] * bool(other)
    constant = stage._DependenceChoice(decision(first, fitter=BentLaws(error=bent)), Currents(None))
    assert stage._with_bent_laws(JOB, constant) is constant


@pytest.mark.parametrize(
    ("levels", "moves", "order", "bent"),
    [(2, False, 1, 1), (3, False, 1, 2), (3, False, 2, 2), (4, False, 2, 3), (0, True, 2, 3), (2, True, 4, 4)],
)
def test_a_yield_force_bends_no_more_than_the_tests_determine(
    levels: int, moves: bool, order: int, bent: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    tested = current_levels.TestedCurrents([float(k) for k in range(levels)], [np.zeros(9)] * moves, 0.0, 1.0)
    monkeypatch.setattr(base_dependence, "tested_currents", lambda *_: tested)
    laws = CurrentDependence((("fy", order), ("c", 1), ("a1", "log1")), 0.0, 1.0)
    assert base_dependence.bent_more(laws, "tanh", JOB.data).orders == (("fy", bent), ("c", 1), ("a1", "log1"))
