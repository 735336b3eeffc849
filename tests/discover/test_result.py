"""What discovery.json says of a decision: alike effects, candidates in order, no more of the rest than is worth it."""

from dataclasses import replace

import pytest

from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.selection.questions import Candidate, EffectScreening
from mrfit.discover.writing.findings import Findings
from mrfit.discover.writing.regions import Region
from mrfit.discover.writing.result import DiscoveryRequest, account, candidates, confusable, cosine_table
from mrfit.io.schemas.discovery import Drifting, EffectParameter, FoundEffect, Gap, Suspect
from tests.discover.world import fit

BASE, FINAL = fit(10.0), fit(1.1, "delay")
MASS = EffectParameter(name="m", unit="kg", value=12.0, low=11.0, high=13.0)
ASKED = DiscoveryRequest("tanh", 0, "", "k")


def screening(cosine: float) -> EffectScreening:
    shown = (Candidate("inertia", gain=0.9), Candidate("delay", gain=0.5))
    return EffectScreening(BASE, shown, ((1.0, cosine), (cosine, 1.0)))


def selection(cosine: float = 0.0) -> Selection:
    reasons = {"inertia": "no", "delay": "yes", "gas-spring": "no"}
    return Selection(BASE, FINAL, FINAL, screening(cosine), reasons=reasons, gains={"delay": 0.9}, verdict="named")


def found(closed: float, regions: int = 2) -> Findings:
    gap = Gap(noise_floor=0.01, before=0.1, after=0.02, closed=closed)
    where = tuple(Region(f"region {k}", 0.9, 0.1) for k in range(regions))
    return Findings(
        gap=gap,
        named=(FoundEffect(name="delay", parameters=(MASS,), holdout_nrmse_before=0.1, holdout_nrmse_after=0.02),),
        suspects=(
            Suspect(name="inertia", parameters=(MASS,), holdout_nrmse_after=0.02, closed=closed, instead_of="stribeck"),
            Suspect(name="stribeck", parameters=(), holdout_nrmse_after=0.02, closed=closed),
        ),
        where=where,
        rest=where,
        looks=(),
        share_left=1.0 - closed,
        drifts=(Drifting(condition="c", segment="s", follows="delay", rate=0.5),),
        beyond=(),
        advice=("log more",),
        stretches=(),
        span=1.0,
    )


@pytest.mark.parametrize(("cosine", "alike"), [(0.75, False), (0.85, True), (-0.85, True), (0.95, True)])
def test_what_the_decision_takes_for_alike_is_told_as_confusable_and_marked_in_the_table(
    cosine: float, alike: bool
) -> None:
    table = cosine_table(screening(cosine), STANDARD)
    assert table.names == ("delay", "inertia")
    assert (screening(cosine).alike("delay", STANDARD.alike) == {"inertia"}) == alike
    assert bool(confusable(screening(cosine), STANDARD)) == alike
    assert (abs(table.matrix[0][1]) > table.alike) == alike
    told = account(ASKED, selection(cosine), found(0.99), STANDARD)
    assert told.effects[0].aliases == (("inertia",) if alike else ())


def test_accepted_candidates_stand_first_and_then_those_that_could_take_most() -> None:
    rows = candidates(selection())
    assert [r.name for r in rows] == ["delay", "inertia", "gas-spring"]
    assert [r.accepted for r in rows] == [True, False, False]
    assert [r.holdout_gain for r in rows] == [0.9, None, None] and rows[2].screen == 0.0


def test_of_the_rest_is_told_only_where_more_than_a_tenth_of_the_gap_is_left() -> None:
    little, much = (account(ASKED, selection(), found(c), STANDARD).unexplained for c in (0.95, 0.85))
    assert little.where == () and little.text == ()
    assert len(much.where) == 2 and "region 0: 90 % of the squared error in 10 % of the samples" in much.text
    unknown = replace(found(0.95), share_left=None)
    assert account(ASKED, selection(), unknown, STANDARD).unexplained.where


def test_no_more_regions_are_listed_than_a_page_holds() -> None:
    for count, listed in ((7, 7), (8, 8), (9, 8)):
        assert len(account(ASKED, selection(), found(0.5, count), STANDARD).where) == listed


def test_effects_suspects_and_drifts_are_written_with_their_parameters() -> None:
    told = account(ASKED, selection(), found(0.99), STANDARD).to_json()
    (effect,) = told["effects"]
    assert effect["parameters"] == [{"name": "m", "unit": "kg", "value": 12.0, "low": 11.0, "high": 13.0}]
    assert (effect["holdout_nrmse_before"], effect["holdout_nrmse_after"]) == (0.1, 0.02)
    assert [s.get("instead_of") for s in told["suspects"]] == ["stribeck", None]
    assert told["drift"] == [{"condition": "c", "segment": "s", "follows": "delay", "rate": 0.5}]
    assert told["augmented_model"] == "tanh+delay"
