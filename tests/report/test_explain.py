"""A discovery in sentences: what each verdict claims, what is left out, and the command that goes on."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.recording import Segment
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.report import discovery_figures
from mrfit.report.discovery_source import Discovery, Part
from mrfit.report.explain import (
    UNJUDGED,
    closed_share,
    effect_words,
    headline,
    left_out,
    next_step,
    sentences,
    takes_of,
    unjudged,
)
from mrfit.report.formula_words import formula_sentences
from mrfit.report.law_repair_words import law_repair_sentences
from mrfit.report.paper import MOST_PANELS, FitSeries
from mrfit.report.paper_stage import with_room
from mrfit.report.source import OutputSeries
from tests.report.test_discovery import AMBIGUOUS, EFFECT, FOUND, INSUFFICIENT, NONE, UNEXPLAINED, typed

EDDY = effect_words("eddy-current")
HELD = {"held": [["eddy-current.tau", 0.00123456789]]}
LAW_GAP = {"error": 0.02, "share": 0.95, "effects": 0.0, "rest": 0.05, "left": 0.005, "taken": 0.9}


def found(base: dict[str, Any], **changes: Any) -> DiscoveryFile:
    return typed(base | changes)


def test_an_effect_is_told_by_its_title_in_small_letters_and_its_name() -> None:
    title = registry.load("effect", "eddy-current").SPEC.title
    assert EDDY == f"{title[0].lower()}{title[1:]} (eddy-current)"


@pytest.mark.parametrize(
    ("one", "said"),
    [
        (found(FOUND), f"boucwen-flux lacks {EDDY}."),
        (found(FOUND, **HELD), f"boucwen-flux lacks {EDDY}, and its law itself is off."),
        (
            found(AMBIGUOUS),
            "Something is missing from boucwen-flux: these data cannot tell whether it is eddy-current or probe-skew.",
        ),
        (
            found(AMBIGUOUS, effects=[EFFECT], ambiguous_set=["saturation", "probe-skew"]),
            f"boucwen-flux lacks {EDDY}, and something else besides: "
            "these data cannot tell whether it is saturation or probe-skew.",
        ),
        (
            found(AMBIGUOUS, **HELD),
            "Something is missing from boucwen-flux: these data cannot tell whether it is eddy-current or probe-skew. "
            "The law of boucwen-flux itself is off.",
        ),
        (found(UNEXPLAINED), "Something is missing from boucwen-flux, and no effect of the library explains it."),
        (
            found(UNEXPLAINED, suspects=AMBIGUOUS["suspects"]),
            "Something is missing from boucwen-flux, and no effect of the library explains all of it.",
        ),
        (
            found(UNEXPLAINED, law_gap=LAW_GAP),
            "The law of boucwen-flux is off, and no effect has proof beside it.",
        ),
        (
            # of what is left no law makes far more than noise
            found(UNEXPLAINED, law_gap=LAW_GAP | {"left": 0.05}),
            "The law of boucwen-flux is off, and something else is missing besides.",
        ),
        (
            found(UNEXPLAINED, law_gap=LAW_GAP | {"share": 0.9}),
            "Something is missing from boucwen-flux, and no effect of the library explains it.",
        ),
        (found(NONE), "Nothing that rises above the noise of these data is missing from boucwen-flux."),
        (found(INSUFFICIENT), "These data are too few to say whether something is missing from boucwen-flux."),
    ],
)
def test_a_verdict_is_one_sentence(one: DiscoveryFile, said: str) -> None:
    assert headline(one) == said


def test_the_command_that_goes_on_holds_what_was_held_and_drives_what_was_driven() -> None:
    plain = "mrfit fit --model boucwen-flux+eddy-current --per all"
    assert next_step(found(FOUND)) == plain
    assert next_step(found(FOUND, **HELD)) == (
        "mrfit fit --model boucwen-flux+eddy-current --fix eddy-current.tau=0.00123457 --per all"
    )
    order = {"orders": [["fy", 2], ["c", "log1"]], "low": 0.0, "high": 2.0}
    assert " --current-order fy=2,c=log1 --per all" in next_step(found(FOUND, current_dependence=order))
    # nothing is certain, or nothing was added
    assert next_step(found(AMBIGUOUS)) == "" == next_step(found(UNEXPLAINED))


def test_a_share_that_is_almost_all_has_digits_that_say_so() -> None:
    assert [closed_share(s) for s in (0.5, 0.9949, 0.99512, 0.99996, 1.0, -0.2)] == [
        *("50.0", "99.5", "99.51", "100.0", "100", "−20.0"),
    ]


CANDIDATE = {"name": "delay", "screen": 0.25, "strength": 1.0, "holdout_gain": None, "accepted": False, "reason": "r"}
SUSPECT = {"name": "delay", "parameters": [], "holdout_nrmse_after": 0.02, "closed": 0.75}


@pytest.mark.parametrize(
    ("candidate", "suspects", "takes"),
    [
        ({}, [], (0.25, "25.0", "screened, training")),
        ({"holdout_gain": 0.5}, [], (0.5, "50.0", "refitted, held-out")),
        ({"reason": f"{UNJUDGED}: no current"}, [], (None, "–", "not judged")),
        # of the one effect that was taken back, that of its last refit
        ({"holdout_gain": 0.5}, [SUSPECT], (0.75, "75.0", "refitted, held-out")),
        ({"holdout_gain": 0.5}, [SUSPECT, SUSPECT | {"name": "inertia"}], (0.5, "50.0", "refitted, held-out")),
        (
            {"holdout_gain": 0.5},
            [SUSPECT, SUSPECT | {"name": "inertia", "instead_of": "delay"}],
            (0.75, "75.0", "refitted, held-out"),
        ),
        ({"holdout_gain": 0.5}, [SUSPECT | {"closed": None}], (0.5, "50.0", "refitted, held-out")),
    ],
)
def test_what_a_candidate_takes_is_the_last_that_was_measured_of_it(
    candidate: dict[str, Any], suspects: list[dict[str, Any]], takes: tuple[float | None, str, str]
) -> None:
    one = found(UNEXPLAINED, candidates=[CANDIDATE | candidate], suspects=suspects)
    assert takes_of(one, one.candidates[0]) == takes


def test_what_cannot_be_judged_is_told_once_for_each_reason_unless_all_is_explained() -> None:
    rows = [
        CANDIDATE | {"name": n, "reason": f"{UNJUDGED}: {why}"}
        for n, why in (("delay", "no current"), ("inertia", "too slow"), ("backlash", "no current"))
    ]
    one = {"candidates": [*rows, CANDIDATE]}
    assert unjudged(found(UNEXPLAINED, **one)) == [
        "Cannot be judged: delay and backlash (no current); inertia (too slow)."
    ]
    assert unjudged(found(FOUND, **one)) == []
    assert left_out(found(FOUND, left_out=["a", "b"])) == ["Left out, as it takes long: a; b."]
    assert left_out(found(FOUND)) == []


def said_of(base: dict[str, Any], gap: dict[str, Any], **changes: Any) -> str:
    return " ".join(sentences(found(base, gap=gap, **changes), law=False))


def test_the_gap_is_told_as_a_fall_or_in_multiples_of_the_noise_and_beside_a_law_that_is_off_without_a_share() -> None:
    fall = {"noise_floor": 0.01, "before": 0.03, "after": 0.011, "closed": 0.5}
    assert "falls from 3.00 % to 1.10 % of the range; the noise floor is 1.00 %: 50.0 % of the gap" in said_of(
        FOUND, fall
    )
    same = fall | {"after": 0.03, "closed": None}
    assert "the error is 3.00 % of the range, 3.00 times the noise floor." in said_of(UNEXPLAINED, same)
    assert "3.00 % of the range, the noise floor is not known." in said_of(UNEXPLAINED, same | {"noise_floor": None})
    held = said_of(FOUND, fall, **HELD)
    assert "With what was found held and the base fitted again, the error on held-out conditions is 1.10 %" in held
    assert "3.00 % without" in held and "gap is closed" not in held


def test_plain_errors_are_told_of_both_models_where_there_are_two() -> None:
    gap = {
        "noise_floor": 0.01,
        "before": 0.03,
        "after": 0.03,
        "closed": None,
        "plain_before": 0.02,
        "plain_after": 0.01,
    }
    alone = said_of(UNEXPLAINED, gap)
    assert "held out, boucwen-flux leaves 2.00 %." in alone
    both = said_of(FOUND, gap | {"after": 0.011})
    assert "held out, boucwen-flux leaves 2.00 %, boucwen-flux+eddy-current 1.00 %." in both
    assert "Plain errors" not in said_of(UNEXPLAINED, gap | {"plain_before": None})


TERM = {"name": "formula: v", "unit": "N*s/m", "value": 2.0, "low": 1.0, "high": 3.0}
FORMULA = {
    **{"text": "2·v·|v|", "file": "formula.py", "coefficients": [TERM], "alike": ["a", "b", "c", "d"]},
    **{"law": 0.02, "after": 0.01, "closed": 0.755, "left": 0.25},
    "box": [{"symbol": "v", "channel": "velocity", "unit": "m/s", "low": -0.1234, "high": 0.5}],
}


def test_a_formula_is_proposed_with_its_ranges_and_three_others_that_serve_alike() -> None:
    one = formula_sentences(found(UNEXPLAINED, proposed=FORMULA))
    assert one[0] == "A formula is proposed, which is no proof: F = F_base +2·v·|v|."
    assert one[1].startswith("Of it v has the coefficient 2.0")
    assert "takes 76 % of what no law makes there: from 2.00 % to 1.00 % of the range." in one[2]
    assert one[3] == "These data do not tell it from a; b; c."
    assert "25 % of its force, within v (velocity) from -0.123 to 0.5 m/s." in one[4]
    falling = formula_sentences(found(UNEXPLAINED, proposed=FORMULA | {"text": "-2·v", "closed": None, "alike": []}))
    assert falling[0].endswith("F = F_base -2·v.") and len(falling) == len(one) - 2
    nothing = formula_sentences(found(UNEXPLAINED, proposed={"reason": "it is noise"}))
    assert nothing == ["No formula is proposed: it is noise."]
    assert formula_sentences(found(UNEXPLAINED)) == []


def test_a_repair_of_the_law_is_told_with_what_chance_would_take() -> None:
    repair = {"titles": ["a", "b"], "coefficients": [TERM], "takes": 0.304, "chance": 0.05, "other_law": "guo"}
    errors = {"before": 0.03, "after": 0.02, "other_error": 0.025}
    one = law_repair_sentences(found(UNEXPLAINED, lacking=repair | errors))
    assert one[0].startswith(
        "The law of boucwen-flux lacks a and b: with it the plain error on held-out conditions falls"
    )
    assert "from 3.00 % to 2.00 %, the base fitted again in both." in one[0]
    assert one[2] == ("It takes 30 % of the squared error on conditions left out, terms shifted in time 5 % at most.")
    assert one[-1] == "Of other bases guo leaves least there: 2.50 %."
    assert law_repair_sentences(found(UNEXPLAINED, lacking=repair))[0] == "The law of boucwen-flux lacks a and b."
    none = law_repair_sentences(found(UNEXPLAINED, lacking={"reason": "too few"}))
    assert none == ["No term that the law of boucwen-flux may lack helps: too few."]


def part_of(condition: str, role: str, error: float, cycles: int = 4, samples: int = 1000, dt: float = 0.01) -> Part:
    nan = float("nan")
    frequency = cycles / (samples * dt)
    own = Segment("a", condition, "a", 0, samples, 0, "sine", "current", frequency, 1.0, 0.0, cycles, nan, nan, role)
    errors = np.full(samples, error)
    return Part(own, dt * np.arange(samples), np.linspace(-1.0, 3.0, samples), errors, 0.5 * errors, {}, 0.0)


def discovery(*parts: Part) -> Discovery:
    return Discovery(found(FOUND), list(parts), "flux")


def test_of_every_held_out_condition_the_worst_part_is_drawn_and_of_many_conditions_the_worst_six() -> None:
    train, mild, bad = part_of("t", "train", 9.0), part_of("a", "holdout", 0.1), part_of("a", "holdout", 0.2)
    assert discovery_figures.worst_parts(discovery(train, mild, bad)) == [bad]
    assert discovery_figures.worst_parts(discovery(train)) == [train]
    many = [part_of(f"c{k}", "holdout", float((5 * k) % 9)) for k in range(9)]
    shown = discovery_figures.worst_parts(discovery(*many))
    # in the order of the conditions
    assert [p.segment.condition for p in shown] == [f"c{k}" for k in range(9) if (5 * k) % 9 >= 3]


def test_two_cycles_are_drawn_or_the_three_seconds_with_the_largest_error() -> None:
    assert discovery_figures._window(part_of("a", "train", 1.0)) == slice(0, 501)
    motion = part_of("a", "train", 1.0, cycles=0)
    motion.before[600:700] = 5.0
    window = discovery_figures._window(motion)
    assert window.stop - window.start == 300 and window.start <= 600 and window.stop >= 700
    assert discovery_figures._window(part_of("a", "train", 1.0, cycles=0, samples=250)) == slice(None)


def test_parts_are_by_role_and_condition_over_the_range_of_all() -> None:
    parts = [part_of("a", "train", 1.0), part_of("b", "holdout", 2.0), part_of("a", "train", 3.0)]
    one = discovery(*parts)
    assert one.conditions("train") == [[parts[0], parts[2]]] and one.of_role("holdout") == [parts[1]]
    assert (one.span, one.unit) == (4.0, "Wb")
    assert parts[2].errors == (3.0, 1.5) and parts[0].changed
    parts[0].inputs["current"] = parts[0].time
    # of a loop every part needs the channel
    assert one.loops == []


def series(error: float) -> OutputSeries:
    return SimpleNamespace(error=error, condition=f"c{error:g}")  # type: ignore[return-value]


def test_where_there_is_no_room_some_of_every_error_are_drawn_in_their_order() -> None:
    errors = [5.0, 1.0, 4.0, 2.0, 3.0, *(10.0 + k for k in range(40))]
    drawn = FitSeries(SimpleNamespace(name="a"), [series(e) for e in errors])  # type: ignore[arg-type]
    kept = [s.error for s in with_room(drawn, "loops", "fits", 1)]
    assert len(kept) == MOST_PANELS and kept == [e for e in errors if e in kept]
    assert min(kept) == 1.0 and max(kept) == max(errors)
    # the least and the greatest, of the residual's correlation
    assert [s.error for s in with_room(drawn, "correlation", "none", 1)] == [1.0, max(errors)]
    assert with_room(drawn, "predicted", "none", 1) is drawn.series
    few = FitSeries(drawn.fit, drawn.series[:2])
    assert with_room(few, "loops", "none", 1) is few.series
    # several fits share the room, unless they share axes
    assert len(with_room(drawn, "loops", "none", 3)) == max(MOST_PANELS // 3, 1)
    assert len(with_room(drawn, "loops", "fits", 3)) == MOST_PANELS
    assert [s.error for s in with_room(drawn, "loops", "none", 100)] == [1.0]
