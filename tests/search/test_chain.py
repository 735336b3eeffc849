import re

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.errors import ConfigError
from mrfit.optimizers.cost.objective import Objective
from mrfit.search import chain
from mrfit.search.limits import Limits


def valley(points):
    x = -2.0 + 4.0 * points
    return np.stack([10.0 * (x[:, 1] - x[:, 0] ** 2), 1.0 - x[:, 0]], axis=1)


def objective(residuals=valley, start=(0.2, 0.75)):
    return Objective(residuals, np.array(start), 0)


def run(name, residuals=valley, seed=0, **limits):
    return chain.run(name, objective(residuals), np.random.default_rng(seed), Limits(**limits))


def test_chain_hands_the_best_point_on():
    outcome = run("pso-lsq", budget=1000)
    swarm, finish = outcome.links
    assert (swarm.name, finish.name) == ("pso", "lsq")
    assert finish.cost < swarm.cost
    assert outcome.cost == finish.cost < 1e-8
    assert outcome.point == pytest.approx([0.75, 0.75], abs=1e-6)
    assert outcome.success


def test_links_take_what_their_specs_ask_for():
    outcome = run("pso-fmin")
    asked = [chain.OptimizerChain(name).budget(2) for name in ("pso", "fmin")]
    assert [link.allowed for link in outcome.links] == asked


def test_total_budget_is_shared_in_proportion_and_kept():
    outcome = run("pso-woa-fmin", budget=3000)
    pso, woa, fmin = outcome.links
    asked = {name: chain.OptimizerChain(name).budget(2) for name in ("pso", "woa", "fmin")}
    assert pso.allowed == round(3000 * asked["pso"] / sum(asked.values()))
    assert woa.allowed / pso.allowed == pytest.approx(asked["woa"] / asked["pso"], rel=0.02)
    assert fmin.allowed == 3000 - pso.evaluations - woa.evaluations
    assert outcome.nfev == sum(link.evaluations for link in outcome.links) <= 3000


def test_what_a_link_leaves_goes_to_the_next():
    outcome = run("lsq-pso", budget=4000)
    lsq, pso = outcome.links
    assert lsq.ending == "finished"
    assert lsq.evaluations < lsq.allowed
    assert pso.allowed == 4000 - lsq.evaluations


def test_budget_spent_in_one_link_does_not_end_the_chain():
    outcome = run("de-lsq", budget=500)
    assert outcome.links[0].ending == "budget"
    assert outcome.links[0].reason == f"budget of {outcome.links[0].allowed} evaluations spent"
    assert len(outcome.links) == 2


def test_histories_of_links_follow_each_other():
    outcome = run("pso-lsq", budget=1000)
    first, second = (link.history for link in outcome.links)
    assert first[-1][0] < second[0][0]
    assert second[-1] == (outcome.nfev, outcome.cost)


def test_time_limit_ends_the_whole_chain():
    outcome = run("pso-lsq", seconds=1e-9)
    assert [link.ending for link in outcome.links] == ["time"]
    assert outcome.nfev == 40
    assert np.isfinite(outcome.cost)
    assert not outcome.success


def test_stall_is_recorded():
    outcome = run("ga", residuals=lambda p: np.ones((len(p), 3)), budget=2000)
    assert outcome.links[0].ending == "stalled"
    assert outcome.links[0].reason == "no progress in 1000 evaluations"
    assert 1000 <= outcome.nfev <= 1080


def test_same_seed_same_outcome():
    first, second = run("mwoa-lsq", budget=2000, seed=3), run("mwoa-lsq", budget=2000, seed=3)
    assert first.point.tobytes() == second.point.tobytes()
    assert first.links == second.links


def test_start_that_diverges_ends_a_local_search_with_its_reason():
    outcome = run("lsq", residuals=lambda p: np.full((len(p), 3), np.nan), budget=100)
    assert outcome.links[0].reason == "the start cannot be simulated"
    assert outcome.cost == np.inf


@pytest.mark.parametrize("name", ["", "-", "pso-", "-pso", "pso--fmin"])
def test_empty_part_of_a_chain_is_refused(name):
    with pytest.raises(ConfigError, match="empty part"):
        chain.parts(name)


def test_unknown_optimizer_is_refused_with_near_matches():
    with pytest.raises(ConfigError, match=r"unknown optimizer 'psoo': did you mean pso"):
        run("psoo-fmin")


@pytest.mark.parametrize(("limits", "shown"), [({"budget": 0}, "0 evaluations"), ({"seconds": -2.0}, "-2 s")])
def test_limits_that_allow_nothing_are_refused(limits, shown):
    with pytest.raises(ConfigError, match=shown):
        run("pso", **limits)


def test_every_registered_optimizer_makes_a_chain():
    # what takes a start as it is can only begin one
    starts = {n for n in registry.names("optimizer") if registry.load("optimizer", n).SPEC.kind == "start"}
    searches = sorted(set(registry.names("optimizer")) - starts)
    outcome = run("-".join(["points", *searches]), budget=20_000)
    assert len(outcome.links) == 1 + len(searches)
    assert outcome.nfev <= 20_000
    assert outcome.cost < 1e-3


@pytest.mark.parametrize(("stall", "ending", "evaluations"), [(0.25, "stalled", 240), (1.0, "budget", 800)])
def test_a_search_without_progress_ends_after_the_share_it_is_given(stall, ending, evaluations):
    objective = Objective(lambda points: np.ones((len(points), 3)), np.array([0.3, 0.4]), 0)
    outcome = chain.run("pso", objective, np.random.default_rng(0), Limits(800, stall=stall))
    assert (outcome.links[0].ending, outcome.nfev) == (ending, evaluations)


@pytest.mark.parametrize("stall", [0.0, -1.0, 1.5, float("nan")])
def test_a_share_that_is_none_is_refused(stall):
    objective = Objective(lambda points: points, np.array([0.3]), 0)
    with pytest.raises(ConfigError, match="--stall"):
        chain.run("pso", objective, np.random.default_rng(0), Limits(stall=stall))


def test_points_can_only_begin_a_chain():
    assert chain.parts("points-lsq") == ["points", "lsq"]
    with pytest.raises(ConfigError, match="points is a start, not a search: write it first"):
        chain.parts("lsq-points")


def test_options_go_to_every_optimizer_that_has_them_and_to_one_that_is_named():
    given = (("mwoa.b", 0.7), ("b", 2.0), ("population", 12.0))
    assert chain.options_of("woa", given) == {"b": 2.0, "population": 12.0, "iterations": 800}
    assert chain.options_of("mwoa", given)["b"] == 0.7
    assert chain.options_of("pso", given)["population"] == 12.0
    assert chain.options_of("lsq", given) == {}
    assert chain.OptimizerChain("woa-lsq", given).budget(3) == 12 * 800 + 200 * 4


@pytest.mark.parametrize(
    ("parts", "given", "message"),
    [
        (["woa"], ("c1_0", 1.0), "--opt-set c1_0: no option of woa; they are b, population, iterations"),
        (["lsq"], ("b", 1.0), "--opt-set b: no option of lsq; it has none"),
        (["woa", "lsq"], ("mwoa.b", 1.0), "'mwoa' does not take part; woa and lsq do"),
        (["mwoa"], ("population", 12.5), "population=12.5: takes whole numbers"),
        (["mwoa"], ("population", 0.0), "population=0: takes 1 to 10000"),
        (["pso"], ("v_max", 2.0), "v_max=2: takes 1e-06 to 1"),
    ],
)
def test_a_wrong_option_is_told_with_those_there_are(parts, given, message):
    with pytest.raises(ConfigError, match=re.escape(message)):
        chain.check_options(parts, [given])


def test_options_change_how_many_are_simulated_side_by_side():
    batches = []
    objective = Objective(lambda p: (batches.append(len(p)), p - 0.3)[1], np.array([0.5, 0.5]), 0)
    given = (("population", 7.0), ("iterations", 5.0))
    chain.run("mwoa", objective, np.random.default_rng(0), given=given)
    assert batches == [7] * 5


@pytest.mark.parametrize(
    ("name", "budget", "cut"),
    [("lsq", 5, True), ("multistart", 30, True), ("pso", 80, False), ("pso-lsq", 60, True), ("lsq", 2000, False)],
)
def test_a_search_that_should_have_ended_by_itself_is_cut_short_by_its_budget(name, budget, cut):
    # a population search ends with its budget by design
    assert run(name, budget=budget).cut_short is cut


def test_what_an_optimizer_found_before_it_was_stopped_is_told():
    def many_wells(points):
        return 2.0 + np.cos(40.0 * points)

    whole = run("multistart", residuals=many_wells, budget=20_000)
    short = run("multistart", residuals=many_wells, budget=whole.nfev // 2)
    assert short.links[0].ending == "budget" and 0 < len(short.descents) < len(whole.descents)
    assert list(short.starts) == sorted(short.starts) and short.starts[0] >= short.cost
    assert run("lsq-multistart-lsq", residuals=many_wells, budget=20_000).descents


def test_an_optimizer_that_says_nothing_of_its_end_used_what_it_had():
    class Silent:
        SPEC = registry.load("optimizer", "lsq").SPEC

        @staticmethod
        def minimise(objective, rng, options):
            objective.costs(rng.random((objective.remaining, objective.dimension)))

    step = chain.ChainStep("silent", Silent.SPEC, Silent.minimise, {})
    outcome = chain.run_steps([step], objective(), np.random.default_rng(0), Limits(17))
    assert (outcome.nfev, outcome.links[0].ending, outcome.message) == (
        17,
        "budget",
        "silent: its 17 evaluations are done",
    )
    assert not outcome.success and outcome.starts == ()
