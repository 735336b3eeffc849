"""What discovery.json and the words say of effects and the law apart; and a damper with a law that no base has."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from mrfit.core.specs import Invariance
from mrfit.discover.evidence.other_laws import better_alone, near_the_floor, worth_telling
from mrfit.discover.invariance.findings import LawErrors, LawFindings, LawGap, closed, finite
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.combine import combine
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.selection.questions import EffectScreening
from mrfit.discover.stage import Settings, run
from mrfit.discover.writing.open_law import with_another_base, with_examination, with_gap, with_laws
from mrfit.discover.writing.result import model_toml
from mrfit.errors import DataError
from mrfit.io.schemas.discovery import (
    BrokenInvariance,
    Confounded,
    DiscoveryFile,
    EffectParameter,
    EffectSignificance,
    Gap,
    InvariantEffect,
    LawPlace,
    OtherLaw,
)
from mrfit.io.schemas.reading import parsed
from mrfit.report.explain import headline, next_step, sentences
from mrfit.report.law_words import law_sentences, other_law_sentences
from tests.discover.mismatch import workspace
from tests.discover.world import fit


def number(name: str, unit: str, value: float, low: float | None = None, high: float | None = None) -> EffectParameter:
    return EffectParameter(name=name, unit=unit, value=value, low=low, high=high)


FORCE = number("largest force", "N", 135.0, 130.0, 140.0)
SPRING = InvariantEffect(
    name="gas-spring", breaks=Invariance.POSITION, tier="short-memory",
    parameters=(number("k_g", "N/m", 9030.0, 8940.0, 9120.0), number("c", "1/m", 0.0)),
    force=FORCE,
    standing=EffectSignificance(share=0.99, kept=0.98, held=0.97, size=0.05, z=50.0, left=0.2, improved=1.0),
)  # fmt: skip
LAG = InvariantEffect(
    name="current-lag", breaks=Invariance.CURRENT, tier="current-at-once", one_of=("delay",), force=FORCE,
    standing=SPRING.standing, parameters=(number("tau", "s", 0.02, 0.018, 0.022),),
)  # fmt: skip
PLACES = (
    LawPlace(over="travel", low=0.0, high=0.0016, unit="m", share_of_error=0.75, share_of_samples=0.2),
    LawPlace(over="travel", low=0.0016, high=0.02, unit="m", share_of_error=0.25, share_of_samples=0.8),
    LawPlace(over="speed", low=0.0, high=0.1, unit="m/s", share_of_error=0.5, share_of_samples=0.5),
)
BROKEN = BrokenInvariance(invariance=Invariance.POSITION, share=0.6, kept=0.5, size=0.02)
# errors 5 4 3 of noise 0: of 25 parts the law has 9, effects 7 and neither 9
FOUND = LawFindings(
    named=(SPRING,),
    turned_down=(
        InvariantEffect(
            name="inertia",
            breaks=Invariance.MEMORY,
            reason="takes only 1%",
            parameters=(number("m", "kg", 0.4),),
        ),
    ),
    confounded=(
        Confounded(name="stribeck", reason="it breaks no invariance: any law may have it", test="slow strokes"),
    ),
    errors=LawErrors(0.05, 0.04, 0.03, 0.0),
    law_gap=LawGap(0.03, 0.36, PLACES),
    travel=0.003,
    time=0.01,
)
EXACT = DiscoveryFile.of(
    {
        "base_model": "bingham", "verdict": "unexplained", "effects": [], "ambiguous_set": [], "advice": ["old"],
        "where": [], "gap": {"noise_floor": 0.001, "before": 0.05, "after": 0.05, "closed": 0.0},
        "candidates": [
            {"name": n, "screen": 0.5, "holdout_gain": 0.1, "accepted": False, "reason": "no proof"}
            for n in ("delay", "gas-spring", "current-lag")
        ],
        "unexplained": {"share_of_gap": 1.0}, "augmented_model": "bingham", "seed": 0, "data_sha256": "", "key": "k",
    }
)  # fmt: skip
BASE = fit(20.0)
CHOSEN = Selection(BASE, BASE, BASE, EffectScreening(BASE), verdict="unexplained")


def told(examined: LawFindings, chosen: Selection = CHOSEN) -> DiscoveryFile:
    return with_examination(EXACT, combine(chosen, examined, STANDARD), examined, "force", STANDARD)


def test_shares_of_law_effects_and_rest_make_the_whole_gap() -> None:
    gap = told(FOUND).law_gap
    assert gap is not None
    assert (gap.share, gap.effects, gap.rest) == pytest.approx((9 / 25, 7 / 25, 9 / 25))
    assert gap.taken == pytest.approx(7 / 16) and (gap.error, gap.left) == (0.03, 0.04)
    assert gap.text == ("within 1.6 mm of a reversal (75 % of it in 20 % of the samples)",)


def test_an_effect_beside_an_open_law_is_named_with_its_value_held_and_the_law_is_told_apart() -> None:
    found = told(FOUND)
    assert found.verdict == "named" and [e.name for e in found.effects] == ["gas-spring"]
    assert found.effects[0].parameters[0].value == 9030.0 and not found.advice
    assert found.augmented_model == "bingham+gas-spring" and found.held == (
        ("gas-spring.k_g", 9030.0),
        ("gas-spring.c", 0.0),
    )
    assert [(c.name, c.accepted) for c in found.candidates][0] == ("gas-spring", True)
    assert "99% of what no law makes" in found.candidates[0].reason
    assert found.confounded[0].test == "slow strokes"
    assert headline(found) == "bingham lacks stiffness of the gas accumulator (gas-spring), and its law itself is off."
    said = law_sentences(found)
    assert said[0].endswith(
        "k_g = 9.030 ± 0.090 kN/m, at most 135.0 ± 5.0 N: whatever the law is, as long as it forgets within 3 mm of "
        "travel."
    )
    assert said[1].startswith("bingham itself errs by 3.00 % of the range, 36 % of its gap, most of all within")
    assert said[2] == "No law of this kind makes the rest (4.00 % of the range), of which gas-spring takes 44 %."
    assert said[3] == "Stribeck cannot be told from the law here."


def test_the_augmented_model_is_a_pipeline_file_and_a_command_with_the_values_held() -> None:
    found = told(FOUND)
    (section,) = tomllib.loads(model_toml(found))["fit"]
    assert section == {
        "model": "bingham+gas-spring", "per": "all", "fixed": {"gas-spring.k_g": 9030.0, "gas-spring.c": 0.0}
    }  # fmt: skip
    assert "--model bingham+gas-spring --fix gas-spring.k_g=9030 --fix gas-spring.c=0 --per all" in next_step(found)
    (plain,) = tomllib.loads(model_toml(EXACT))["fit"]
    assert plain == {"model": "bingham", "per": "all"}


def test_a_partner_makes_a_set_that_stands_for_itself_in_the_words() -> None:
    found = told(
        replace(
            FOUND,
            named=(LAG,),
            confounded=(Confounded(name="delay", reason="any law may have it", test="two frequencies"),),
        )
    )
    assert (found.verdict, found.ambiguous_set, found.effects) == ("ambiguous", ("current-lag", "delay"), ())
    assert found.advice == ("delay: two frequencies",) and found.augmented_model == "bingham+current-lag"
    assert next_step(found) == ""
    assert (
        "(current-lag), or delay, which these data cannot tell from it without a law, tau = 20.0 ± 2.0 ms"
        in law_sentences(found)[0]
    )
    assert headline(found).endswith(
        "these data cannot tell whether it is current-lag or delay. The law of bingham itself is off."
    )


def test_an_effect_without_scatter_has_a_score_that_json_can_hold() -> None:
    assert SPRING.standing is not None
    endless = replace(SPRING.standing, z=float("inf"), held=float("-inf"))
    row, force = finite(endless), closed(replace(FORCE, low=float("-inf"), high=float("inf")))
    assert (row.z, row.held, row.share) == (1e9, -1e9, SPRING.standing.share) and force.low is None
    assert finite(replace(endless, z=float("nan"))).z == 0.0 and closed(SPRING.parameters[0]) == SPRING.parameters[0]
    named = SPRING.model_copy(update={"standing": row, "force": force})
    json.dumps(told(replace(FOUND, named=(named,))).to_json(), allow_nan=False)


def test_without_a_name_the_verdict_stays_and_what_is_broken_is_said() -> None:
    found = told(replace(FOUND, named=(), broken=(BROKEN,)))
    assert found.verdict == "unexplained" and not found.held and found.augmented_model == "bingham"
    assert headline(found).endswith("that no effect of the library is: it depends on the place in the stroke.")
    assert any(s.startswith("Something depends on the place in the stroke") for s in law_sentences(found))
    alone = told(replace(FOUND, named=(), law_gap=LawGap(0.05, 0.95, PLACES)))
    assert headline(alone) == "The law of bingham is off, and something else is missing besides."
    assert any(s.endswith("4.00 % of the range: something else is missing, too.") for s in sentences(alone))
    noise = alone.model_copy(update={"gap": alone.gap.model_copy(update={"noise_floor": 0.03})})
    assert headline(noise) == "The law of bingham is off, and no effect has proof beside it."
    little = told(replace(FOUND, named=(), law_gap=LawGap(0.05, 0.1, PLACES)))
    assert not any("itself errs" in s for s in sentences(little))


def test_an_effect_that_is_not_believed_is_turned_down_with_its_reason() -> None:
    assert SPRING.standing is not None
    part = SPRING.model_copy(update={"standing": replace(SPRING.standing, share=0.7)})
    found = told(
        replace(
            FOUND,
            named=(part,),
            broken=(BROKEN,),
        )
    )
    assert found.verdict == "unexplained" and found.invariance is not None
    assert [e.name for e in found.invariance.turned_down] == ["gas-spring", "inertia"]
    assert [(p.name, p.value, p.low) for p in found.invariance.turned_down[1].parameters] == [("m", 0.4, None)]
    assert "something else breaks the same invariance" in found.invariance.turned_down[0].reason


def test_what_is_taken_back_stands_as_a_suspect_and_the_model_is_the_base_again() -> None:
    effects = [{"name": "stribeck", "parameters": [], "holdout_nrmse_before": 0.05, "holdout_nrmse_after": 0.011}]
    named = DiscoveryFile.of(
        {
            **EXACT.to_json(), "verdict": "named", "effects": effects, "augmented_model": "bingham+stribeck",
            "gap": {"noise_floor": 0.001, "before": 0.05, "after": 0.011, "closed": 0.95},
            "candidates": [
                {"name": "stribeck", "screen": 0.5, "holdout_gain": 0.9, "accepted": True, "reason": "clear"}
            ],
        }
    )  # fmt: skip
    final = fit(6.0, "stribeck")
    chosen = Selection(BASE, final, final, EffectScreening(BASE), verdict="named")
    nothing = replace(FOUND, named=())
    found = with_examination(named, combine(chosen, nothing, STANDARD), nothing, "force", STANDARD)
    assert (found.verdict, found.effects, found.augmented_model) == ("unexplained", (), "bingham")
    assert [(s.name, s.closed) for s in found.suspects] == [("stribeck", 0.95)]
    assert (found.gap.before, found.gap.after, found.gap.closed) == (0.05, 0.05, 0.0)
    assert not found.candidates[0].accepted and found.ways is not None and not found.ways.agree
    assert any("only if the law of bingham were exact" in s for s in sentences(found))


def test_another_law_that_leaves_less_alone_is_told_unless_the_effects_make_it_better() -> None:
    gap = Gap(noise_floor=0.001, before=0.05, after=0.0105, closed=0.95)
    named = told(FOUND).model_copy(update={"gap": gap})
    less, more = other("tanh", 0.96), other("guo", 0.9).model_copy(update={"holdout_nrmse": 0.02})
    assert better_alone(named, (more, less), STANDARD) == (less,)
    # an effect that makes the other law better, too, is there
    assert not better_alone(named, (other("tanh", 0.96, 0.98),), STANDARD)


def test_what_cannot_be_examined_changes_nothing_but_says_so() -> None:
    found = told(LawFindings(not_applicable="no displacement"))
    assert (found.verdict, found.law_gap) == ("unexplained", None)
    assert found.invariance is not None and found.invariance.not_applicable == "no displacement"
    assert found.ways is not None and found.ways.agree and found.ways.invariances.verdict == "insufficient-data"


def test_the_error_after_is_that_of_the_base_fitted_again_with_what_was_found_held() -> None:
    gap = Gap(noise_floor=0.001, before=0.05, after=0.051, closed=-0.04)
    found = with_gap(told(FOUND), gap, {"gas-spring": 0.05})
    assert (found.effects[0].holdout_nrmse_before, found.effects[0].holdout_nrmse_after) == (0.05, 0.051)
    assert found.unexplained.share_of_gap == pytest.approx(9 / 25)
    assert any("5.10 % of the range, 5.00 % without" in s for s in sentences(found))


def other(model: str, takes: float, beside: float | None = None, floors: float | None = None) -> OtherLaw:
    near = floors is not None and near_the_floor(floors, STANDARD)
    return OtherLaw(
        model=model, holdout_nrmse=0.01, takes=takes, takes_beside=beside, floors=floors, near_the_floor=near,
        command=f"mrfit discover --model {model}",
    )  # fmt: skip


def test_other_laws_are_told_by_what_they_take_beside_the_effects() -> None:
    laws = worth_telling([other("guo", 0.9, 0.3), other("tanh", 0.4, 0.95, 1.4), other("dahl", 0.5, 0.1)], STANDARD)
    assert [law.model for law in laws] == ["tanh", "guo"]
    first, second = other_law_sentences(with_laws(told(FOUND), laws))
    assert first == (
        "tanh takes 40 % of the gap on held-out conditions, 95 % with the effects held at their values and leaves 1.4 "
        "times the noise: mrfit discover --model tanh"
    )
    assert "times the noise" not in second


def test_another_base_that_was_taken_as_exact_says_what_any_law_could_make() -> None:
    again = EXACT.model_copy(
        update={"base_model": "guo", "verdict": "named", "effects": told(FOUND).effects, "ambiguous_set": ("a", "b")}
    )
    found = with_another_base(told(FOUND), again)
    assert found.base_model == "bingham" and found.other_base is not None
    assert other_law_sentences(found) == [
        "With guo taken as exact, gas-spring and a or b is missing, and the error on held-out conditions is 5.00 % of "
        "the range with it"
    ]
    (said,) = other_law_sentences(with_another_base(told(FOUND), EXACT.model_copy(update={"verdict": "none"})))
    assert "bingham taken as exact, nothing is missing" in said


def test_what_was_written_is_read_again_and_a_later_schema_is_refused_in_one_line(tmp_path: Path) -> None:
    found = with_laws(told(FOUND), (other("guo", 0.9),))
    text = json.dumps(found.to_json())
    assert json.loads(text)["schema"] == "mrfit/discovery/2"
    assert parsed(tmp_path / "d.json", text, DiscoveryFile, "again").to_json() == found.to_json()
    for schema, known in (("mrfit/discovery/1", True), ("mrfit/discovery/3", False)):
        other_text = json.dumps({**EXACT.to_json(), "schema": schema})
        if known:
            assert parsed(tmp_path / "d.json", other_text, DiscoveryFile, "again").law_gap is None
        else:
            with pytest.raises(DataError, match="of the schema 'mrfit/discovery/3', which this mrfit does not know"):
                parsed(tmp_path / "d.json", other_text, DiscoveryFile, "again")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, 12])
def test_a_spring_is_named_beside_a_law_that_no_base_has_and_nothing_where_nothing_is_hidden(
    seed: int, tmp_path: Path
) -> None:
    found = run(workspace(tmp_path / "spring", spring=9000.0, seed=seed), Settings("bingham")).found
    assert found.verdict == "named" and [e.name for e in found.effects] == ["gas-spring"]
    stiffness = found.effects[0].parameters[0]
    assert stiffness.low is not None and stiffness.high is not None
    assert stiffness.low < 9000.0 < stiffness.high and stiffness.value == pytest.approx(9000.0, rel=0.05)
    assert found.law_gap is not None and found.law_gap.share > 0.9
    assert found.other_laws and found.other_laws[0].takes > 0.9
    null = run(workspace(tmp_path / "null", seed=seed), Settings("bingham")).found
    assert null.verdict == "unexplained" and not null.effects
    assert null.law_gap is not None and null.law_gap.share > 0.9
