"""Every threshold of the policy: evidence on which its rule fires, and evidence beside it on which it does not."""

import ast
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrfit.core.progress import silent
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Invariance
from mrfit.discover import hold_out, stage
from mrfit.discover.base_dependence import usual_dependence
from mrfit.discover.evidence import other_laws as laws
from mrfit.discover.evidence.bench import build_bench
from mrfit.discover.evidence.work import Effort, limits_of_base
from mrfit.discover.hold_out import too_little
from mrfit.discover.invariance.findings import LawErrors, LawFindings
from mrfit.discover.policy import STANDARD, Policy
from mrfit.discover.selection import rules
from mrfit.discover.selection.combine import Floors, combine, leaves_noise, worth_examining
from mrfit.discover.selection.exact_base import Selection, decide
from mrfit.discover.selection.questions import (
    Candidate,
    Contrast,
    EffectScreening,
    Growth,
    LibraryEffect,
    Repetition,
    Try,
)
from mrfit.discover.stage import Settings
from mrfit.discover.writing.regions import Region, beyond_training, in_words
from mrfit.discover.writing.residual_shape import shape_in_words
from mrfit.discover.writing.result import DiscoveryRequest
from mrfit.io.dataset import Dataset
from mrfit.io.schemas.discovery import BrokenInvariance, EffectSignificance, InvariantEffect, Look, OtherLaw
from mrfit.io.workspace import Workspace
from mrfit.simulate.assembly import assemble
from tests.discover.test_policy import ROOM, thresholds_read
from tests.discover.test_regions import bench as bench_of_currents
from tests.discover.world import World, fit

Rule = Callable[[Policy], bool]
"""Whether a rule fires on some evidence, under a policy."""


def segment(role: str, condition: str, samples: int = 100) -> Segment:
    return Segment(
        id=condition,
        condition=condition,
        recording="r",
        start=0,
        stop=samples,
        warm_up=0,
        waveform="sine",
        drive="displacement",
        frequency=5.0,
        amplitude=0.01,
        offset=0.0,
        cycles=5,
        current=float("nan"),
        temperature=float("nan"),
        role=role,
    )


def too_few(conditions: int) -> Rule:
    segments = [segment("train", str(k)) for k in range(conditions)]
    return lambda p: bool(too_little([*segments, segment("holdout", "h")], p))


def varies(high: float) -> Rule:
    channels = {"current": np.linspace(0.0, high, 50), "force": np.ones(50)}
    recordings = {"r": Recording("r", "r.csv", "r", "none", 1e-3, 0.0, channels, {})}
    held = replace(segment("train", "a"), current=0.1)
    return lambda p: usual_dependence(Settings("tanh"), Dataset([held], recordings), p) is not None


def floored(noise: float) -> Rule:
    def fires(policy: Policy) -> bool:
        rng, time = np.random.default_rng(1), np.arange(1000) * 1e-3
        x, v = 0.01 * np.sin(10 * np.pi * time), 0.1 * np.pi * np.cos(10 * np.pi * time)
        channels = {"displacement": x, "velocity": v, "force": v + noise * rng.standard_normal(1000)}
        recordings = {"r": Recording("r", "r.csv", "r", "none", 1e-3, 0.0, channels, {})}
        bench = build_bench([segment("train", "a", 1000)], recordings, assemble("tanh"), [], policy)
        return bool(bench.stretches[0].floor == policy.least_floor * bench.span)

    return fires


def worth(gain: float, count: int = 1) -> Rule:
    candidates = [Candidate(str(k), gain=gain) for k in range(count)]
    return lambda p: len(rules.worth_a_refit(candidates, p)) == count


def proof(before: float, after: float, strength: float = 50.0, score: float = 50.0, **more: Any) -> Rule:
    """Whether an effect passes that brings the error from one value to another beside ``beside``, of a base's error."""
    beside: tuple[str, ...] = more.get("beside", ())
    base = fit(more.get("base", before), number=0)
    first = fit(before, *beside, number=1) if beside else base
    last = fit(after, *beside, "x", number=2)

    def fires(policy: Policy) -> bool:
        alike = dict.fromkeys(more.get("alike", ()), policy.least_gap_of_alike)
        claimed = rules.claim("x", first, last, base, policy, alike)
        return not rules.objection(replace(claimed, strength=strength, score=score), policy)

    return fires


def alike(cosine: float) -> Rule:
    screening = EffectScreening(fit(1.0), (Candidate("a"), Candidate("b")), ((1.0, cosine), (cosine, 1.0)))
    return lambda p: screening.alike("a", p.alike) == {"b"}


def ended(place: float, rival: str = "none") -> Rule:
    return lambda p: (
        rules.limits(fit(1.0, "a", a={"v": place}), "a", LibraryEffect("b", frozenset({"a"}), frozenset({rival})), p)
        > 0
    )


def drifts(change: float, distance: float, spread: float) -> Rule:
    return lambda p: rules.drift([Growth(change, distance, spread)], p) is not None


def too_much(before: float, after: float, noise: float = 1.0) -> Rule:
    return lambda p: rules.leaves_too_much(fit(before), fit(after), noise, p)


def follows(records: int, ratio: float, score: float) -> Rule:
    return lambda p: rules.goes_on(Repetition(1.0, (Contrast(np.log(ratio), score),) * records), p)


def left(error: float, structure: float, measured: bool = False) -> Rule:
    return lambda p: rules.clearly_left(error, structure, False, measured, p)


def asked_rivals(reach: float, count: int = 1) -> Rule:
    """Whether so many effects, that could take a share to first order, are all tried in the place of one that is in."""
    others = [f"r{k}" for k in range(count)]
    errors = {(): 20.0, ("a",): 8.0, ("b",): 19.0, ("a", "b"): 1.05}
    world = World(errors, reaches=dict.fromkeys(others, reach), unseen=())
    errors |= {(o,): 20.0 for o in others}

    def fires(policy: Policy) -> bool:
        world.asked.clear()
        decide(world, replace(policy, most_refits=2))
        tried = [q[1] for q in world.asked if isinstance(q[1], Try)]
        return {t.candidate.name for t in tried if t.present.effects == ("b",)} >= set(others)

    return fires


def shape(curve: float, loop: float, words: str) -> Rule:
    row = Look(over="velocity", curve=curve, loop=loop, since_it_turned=0.0)
    return lambda p: words in shape_in_words([row], p)


def region(excess: float, count: int = 1) -> Rule:
    return lambda p: len(in_words([Region(str(k), 0.5 + excess, 0.5) for k in range(count)], p)) == count


def law(takes: float, count: int = 1) -> Rule:
    rows = [OtherLaw(model="guo", holdout_nrmse=0.1, takes=takes, command="") for _ in range(count)]
    return lambda p: len(laws.worth_telling(rows, p)) == count


def of_parameters(count: int) -> Rule:
    spec = replace(assemble("tanh").spec, params=assemble("tanh").spec.params[:1] * count)
    return lambda p: laws.suits(spec, "force", {"displacement", "velocity"}, p)


def slow(base: str, samples: int) -> Rule:
    """Whether Spencer's law is too much work beside a base."""
    bench = SimpleNamespace(
        channels={"displacement", "velocity"}, samples=lambda role: 1, simulated=lambda role: samples
    )
    fitter = SimpleNamespace(base=base, bench=bench, effort=Effort())
    fit = SimpleNamespace(assembly=assemble(base))
    return lambda p: "spencer" in laws.slow_laws(fitter, fit, lambda name: None, p)


def many_starts(base: str, samples: int) -> Rule:
    """Whether the first fit of a base of 15 free parameters has a limit."""
    return lambda p: limits_of_base(assemble(base), samples, 15, p).budget is not None


def after_work(spent: int, done: Callable[[Any], bool]) -> Rule:
    """Whether the stage does something in a discovery after so much work."""
    asked = DiscoveryRequest("boucwen", 0, "", "k")
    job = stage._Job(Workspace(Path()), Settings("boucwen"), Dataset([], {}), asked, silent, Effort(spent))

    def fires(policy: Policy) -> bool:
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(stage, "STANDARD", policy)
            patched.setattr(stage, "with_plain_errors", lambda found, *_: f"{found} with errors")
            return done(job)

    return fires


def states_plain_errors(job: Any) -> bool:
    """Return whether the plain errors of a discovery are stated."""
    told: Any = stage.DiscoveryOutput("found")  # type: ignore[arg-type]
    return bool(stage._with_plain_errors(job, told, job.data) != told)


def beside_one_current(slower: float) -> Rule:
    """Whether of two held-out tests one is trained, where the trained one is slower and at one other current."""
    row = Segment("s", "c", "r", 0, 100, 0, "sine", "displacement", 6.0, 0.01, 0.0, 2, 0.0, float("nan"), "holdout")
    trained = replace(row, id="t", condition="t", current=1.0, frequency=row.frequency / slower, role="train")

    def fires(policy: Policy) -> bool:
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(hold_out, "STANDARD", policy)
            return bool(hold_out.with_their_speeds_trained([trained, row, replace(row, id="u", condition="u")])[1])

    return fires


def _selected(after: float, before: float) -> Selection:
    base, final = fit(before), fit(after, "a")
    return Selection(base, final, final, EffectScreening(base), verdict="named")


def left_open(after: float, before: float) -> Rule:
    return lambda p: not leaves_noise(_selected(after, before), Floors(1.0, False), p)


def above_the_floor(after: float, measured: bool = True) -> Rule:
    return lambda p: worth_examining(_selected(after, 10.0), Floors(1.0, measured), p)


def as_good_as_a_law(exact: float, before: float = 10.0) -> Rule:
    """Whether what is named beside an exact base is believed, though a law of open form was examined."""
    examined = LawFindings(errors=LawErrors(None, 0.02, 0.01, 0.001, exact=exact, open=0.01))
    chosen = _selected(1.1, before)
    return lambda p: combine(chosen, examined, p, noisy=True).named == ("a",)


def little_more(narrow: float) -> Rule:
    return lambda p: rules.takes_little_more(fit(10.0), fit(narrow, "a"), fit(1.0, "a", "b"), p)


def in_the_shadow(kept: float) -> Rule:
    rows = (BrokenInvariance(invariance=Invariance.POSITION, share=kept, kept=kept, size=0.1),)
    proof_of = EffectSignificance(share=0.9, kept=0.9, held=0.9, size=0.1, z=20.0, left=0.1, improved=1.0)
    effects = (InvariantEffect(name="a", breaks=Invariance.POSITION, standing=proof_of),)
    base = fit(10.0)
    chosen = Selection(base, base, base, EffectScreening(base), verdict="unexplained")
    return lambda p: bool(combine(chosen, LawFindings(named=effects, broken=rows), p).shadows)


CASES: dict[str, tuple[Rule, Rule]] = {
    "left_open": (left_open(2.4, 4.6), left_open(2.4, 5.8)),
    "left_open_in_sight": (left_open(2.7, 20.0), left_open(2.7, 30.0)),
    "examined_above_floor": (above_the_floor(1.25), above_the_floor(1.15)),
    "as_good": (as_good_as_a_law(0.0149), as_good_as_a_law(0.0151)),
    "least_gap_of_wider": (little_more(2.3), little_more(2.5)),
    "left_by_guess": (as_good_as_a_law(0.01, before=1.6), as_good_as_a_law(0.01, before=1.5)),
    "broken_beside": (in_the_shadow(0.8), in_the_shadow(0.6)),
    "law_takes": (law(0.25), law(0.15)),
    "most_laws": (law(0.5, 3), law(0.5, 4)),
    "most_law_parameters": (of_parameters(10), of_parameters(11)),
    "near_floor": (lambda p: laws.near_the_floor(1.9, p), lambda p: laws.near_the_floor(2.1, p)),
    "fewest_training": (too_few(1), too_few(2)),
    "least_current_range": (varies(0.2), varies(0.05)),
    "least_floor": (floored(1e-6), floored(1e-2)),
    "absorbed": (lambda p: rules.absorbed(0.01, p), lambda p: rules.absorbed(0.03, p)),
    "worth_a_refit": (worth(2e-3), worth(5e-4)),
    "most_refits": (worth(0.1, 7), worth(0.1, 8)),
    "clear": (proof(3.0, 2.7, 4.1), proof(3.0, 2.7, 3.9)),
    "holdout_clear": (proof(3.0, 2.7, score=2.1), proof(3.0, 2.7, score=1.9)),
    "overwhelming": (proof(10.0, 4.4, 1.1), proof(10.0, 4.7, 1.1)),
    "above_noise": (proof(1.55, 1.05, 1.1), proof(1.45, 1.05, 1.1)),
    "not_neutral": (proof(10.0, 1.5, 1.1), proof(10.0, 1.5, 0.9)),
    "half": (proof(10.0, 7.0, 3.5), proof(10.0, 7.2, 3.5)),
    "clear_of_half": (proof(10.0, 6.0, 3.1), proof(10.0, 6.0, 2.9)),
    "least_gain": (proof(1.1, 1.09), proof(1.1, 1.096)),
    "least_gap": (
        proof(6.0, 5.8, base=10.0, beside=("a",)),
        proof(6.0, 5.85, base=10.0, beside=("a",)),
    ),
    "least_gap_of_alike": (
        proof(6.0, 5.0, base=10.0, beside=("a",), alike=("a",)),
        proof(6.0, 5.3, base=10.0, beside=("a",), alike=("a",)),
    ),
    "most_of_the_rest": (
        proof(1.5, 1.26, base=10.0, beside=("a",)),
        proof(1.5, 1.3, base=10.0, beside=("a",)),
    ),
    "least_gap_of_the_rest": (
        proof(1.4, 1.05, base=10.0, beside=("a",)),
        proof(1.2, 1.0, base=10.0, beside=("a",)),
    ),
    "alike": (alike(-0.85), alike(0.75)),
    "rival_min_gain": (
        lambda p: rules.comparable(fit(10.0), fit(2.0), fit(8.0), p),
        lambda p: rules.comparable(fit(10.0), fit(2.0), fit(8.3), p),
    ),
    "far_behind": (
        lambda p: rules.leaves_far_more(fit(2.0), fit(2.7), p),
        lambda p: rules.leaves_far_more(fit(2.0), fit(2.6), p),
    ),
    "end_of_range": (ended(0.96), ended(0.94)),
    "most_rivals": (asked_rivals(0.5, 4), asked_rivals(0.5, 5)),
    "worth_a_duel": (asked_rivals(0.06), asked_rivals(0.04)),
    "left_for_two": (
        lambda p: rules.asks_for_pairs(fit(2.5), fit(10.0), 1.0, p),
        lambda p: rules.asks_for_pairs(fit(2.3), fit(10.0), 1.0, p),
    ),
    "little_left": (
        lambda p: rules.leaves_little(fit(1.35), fit(10.0), p),
        lambda p: rules.leaves_little(fit(1.45), fit(10.0), p),
    ),
    "above_the_rest": (
        lambda p: rules.below_the_rest(fit(3.0), fit(3.6), p),
        lambda p: rules.below_the_rest(fit(3.0), fit(3.7), p),
    ),
    "left_by_shadows": (too_much(3.0, 1.7), too_much(3.0, 1.5)),
    "visible_residual": (too_much(10.0, 2.6), too_much(12.5, 2.6)),
    "in_sight": (too_much(10.0, 2.55), too_much(10.0, 2.45)),
    "drifts": (drifts(0.21, 1.0, 1e-3), drifts(0.19, 1.0, 1e-3)),
    "drift_clear": (drifts(0.5, 1.0, 0.12), drifts(0.5, 1.0, 0.13)),
    "far_above": (
        lambda p: rules.goes_on(Repetition(2.1), p),
        lambda p: rules.goes_on(Repetition(1.9), p),
    ),
    "clearly_above": (left(1.3, 0.5), left(1.2, 0.5)),
    "structure": (left(3.0, 0.16), left(3.0, 0.14)),
    "beyond_any_colour": (left(3.1, 0.0), left(2.9, 0.0)),
    "fewest_records": (follows(5, 2.0, 4.0), follows(4, 2.0, 4.0)),
    "power_ratio": (follows(6, 1.4, 4.0), follows(6, 1.3, 4.0)),
    "power_clear": (follows(6, 2.0, 2.1), follows(6, 2.0, 1.9)),
    "shape_told": (shape(0.12, 0.12, "static law"), shape(0.08, 0.08, "static law")),
    "memory_told": (shape(0.2, 0.31, "memory"), shape(0.2, 0.29, "memory")),
    "no_curve": (shape(0.004, 0.5, "a curve over it nothing"), shape(0.006, 0.5, "a curve over it nothing")),
    "region_told": (region(0.03), region(0.01)),
    "most_said": (region(0.1, 3), region(0.1, 4)),
    "as_fast": (beside_one_current(1.4), beside_one_current(1.6)),
    # a law that is not stepped is no work
    "most_work": (slow("boucwen", 20_000), slow("tanh", 20_000)),
    "most_base_work": (many_starts("spencer", 20_000), many_starts("spencer", 18_000)),
    "most_effort": (
        after_work(2_000_000, lambda job: job.decides_again()),
        after_work(2_000_001, lambda job: job.decides_again()),
    ),
    "most_effort_told": (after_work(300_000, states_plain_errors), after_work(300_001, states_plain_errors)),
    "extrapolates": (
        lambda p: bool(beyond_training(bench_of_currents((0.3, 1.0), (0.3, 1.2)), p)),
        lambda p: bool(beyond_training(bench_of_currents((0.3, 1.0), (0.3, 1.05)), p)),
    ),
}
# Thresholds whose rules are tested where evidence takes more than a row to invent
ELSEWHERE = {
    "most_rounds": "test_select.py",
    "most_samples_again": "test_stage.py",
    "rough_weight": "test_stage.py",
    "most_pairs": "test_pairs.py",
    "fewest_cycles": "test_residual_structure.py",
    "worth_telling": "test_result.py",
    "most_regions": "test_result.py",
}


@pytest.mark.parametrize("name", CASES)
def test_a_rule_fires_on_one_side_of_its_threshold_only(name: str) -> None:
    fires, not_here = CASES[name]
    assert fires(STANDARD)
    assert not not_here(STANDARD)


@pytest.mark.parametrize("name", CASES)
def test_it_is_this_threshold_that_decides(name: str) -> None:
    """Moved past the evidence on one side, then on the other, it turns both."""
    fires, not_here = CASES[name]
    value = getattr(STANDARD, name)
    moved = [
        replace(STANDARD, **{name: type(value)(new)})
        for new in (0.001 * value, 0.5 * value, 0.8 * value, 1.25 * value, 2.0 * value, 1000.0 * value)
    ]
    assert any(not fires(policy) for policy in moved)
    assert any(not_here(policy) for policy in moved)


def test_no_threshold_of_the_policy_is_without_a_test() -> None:
    read = {name for path in ROOM.glob("*.py") for name in thresholds_read(ast.parse(path.read_text()), ("policy",))}
    assert read <= set(CASES) | set(ELSEWHERE)


def test_a_guessed_floor_cannot_say_that_nothing_is_missing() -> None:
    assert above_the_floor(1.0, measured=False)(STANDARD)
    assert not above_the_floor(1.0)(STANDARD)


def test_a_shape_that_the_rival_has_too_says_nothing() -> None:
    assert ended(0.99)(STANDARD) and not ended(0.99, rival="v")(STANDARD)


@pytest.mark.parametrize(
    ("level", "stands"), [({"a": 0.06}, True), ({"a": 0.04}, False), ({}, True), ({"b": 0.0}, True)]
)
def test_an_effect_that_sets_in_below_all_that_was_measured_is_none(level: dict[str, float], stands: bool) -> None:
    after = replace(fit(1.0, "a"), levels=level)
    trial = replace(rules.claim("a", fit(10.0), after, fit(10.0), STANDARD), score=9.0, strength=9.0)
    assert (not rules.objection(trial, STANDARD)) is stands


def test_what_may_be_noise_is_not_held_against_effects() -> None:
    assert too_much(10.0, 4.8)(STANDARD)
    assert not too_much(10.0, 4.8, noise=5.0)(STANDARD)
    assert too_much(10.0, 9.0, noise=5.0)(STANDARD)


def test_an_error_far_above_a_floor_that_was_measured_is_no_noise_of_another_colour() -> None:
    assert left(2.6, 0.0, measured=True)(STANDARD)
    assert not left(2.4, 0.0, measured=True)(STANDARD)
    assert not left(2.9, 0.0)(STANDARD)


@pytest.mark.parametrize(("told", "verdict"), [(True, "unexplained"), (False, "none")])
def test_nothing_is_missing_is_not_said_of_an_error_far_above_a_measured_floor(told: bool, verdict: str) -> None:
    world = World({(): 3.0, ("a",): 2.9}, falls={("a",): 0.5}, noise_is_told=told)
    assert decide(world, STANDARD).verdict == verdict


def test_what_was_taken_back_is_told_of_the_error_left() -> None:
    assert rules.clearly_left(3.0, 0.0, True, False, STANDARD)
    assert not rules.clearly_left(1.2, 0.0, True, False, STANDARD)


def test_an_effect_that_takes_the_error_to_the_noise_where_it_was_fitted_is_beyond_chance() -> None:
    def taken(before: float, after: float) -> bool:
        base = fit(1.08, train=before)
        return rules.beyond_chance(rules.claim("a", base, fit(0.97, "a", train=after), base, STANDARD), STANDARD)

    assert taken(2.4, 0.84)
    assert not taken(1.4, 0.84)
    assert not taken(2.4, 1.6)


def test_a_rival_that_errs_where_it_was_fitted_is_no_equal_of_one_that_does_not() -> None:
    def worse(winner: float, rival: float) -> bool:
        return rules.fits_worse(fit(1.0, train=winner), fit(1.1, train=rival), STANDARD)

    assert worse(0.99, 1.25)
    assert not worse(0.99, 1.15)
    assert not worse(1.19, 1.22)
    assert not worse(1.25, 2.0)


@pytest.mark.parametrize(
    ("narrow", "wide", "little"), [(4.1, 1.4, False), (4.1, 2.2, True), (2.4, 1.0, True), (12.0, 9.0, False)]
)
def test_of_a_large_gap_nearly_all_that_a_narrow_form_leaves_in_sight_is_no_little(
    narrow: float, wide: float, little: bool
) -> None:
    assert rules.takes_little_more(fit(25.0), fit(narrow, "a"), fit(wide, "a", "b"), STANDARD) == little


@pytest.mark.parametrize(("train", "overwhelms"), [(0.95, False), (1.2, False), (1.3, True), (2.0, True)])
def test_nothing_overwhelms_where_fitted_conditions_leave_noise_without_it(train: float, overwhelms: bool) -> None:
    before, after = fit(1.9, "a", train=train), fit(1.05, "a", "b", train=0.9)
    trial = rules.claim("b", before, after, fit(5.5), STANDARD)
    assert trial.overwhelms is overwhelms
    assert trial.needed == (STANDARD.not_neutral if overwhelms else STANDARD.clear)
