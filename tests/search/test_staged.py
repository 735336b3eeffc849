"""Staged identification of Hammerstein-Wiener from its four kinds of tests, and the ablation that its chain gives."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mrfit.compare.stage
import mrfit.fit.stage
from mrfit.errors import ConfigError
from mrfit.fit.identify import build_group
from mrfit.fit.select import read_dataset
from mrfit.fit.stage import Settings, check, prepare
from mrfit.io.schemas.fit import Fit
from mrfit.io.workspace import Workspace, plain
from mrfit.search.staged import kind_of, settled, stages_of, warnings
from mrfit.simulate.assembly import assemble
from tests.fit.hw_bench import KINDS, TRUTH, programme, write_tests

WHOLE = "hammerstein-wiener+temperature"
CHAIN = ("hw-static", "hw-static+current-filter", "hw-static+force-filter", "hw-static+current-filter+force-filter")
TEST_NAMES = {"speed": "constant-speed", "sine": "sine", "step": "current-step", "heating": "heating"}
# A model of two stages, and what it is made with: all but the last four numbers, which sines hardly tell apart
PART = "hw-static+force-filter"
PART_TRUTH = TRUTH | {"force-filter.T": 0.008, "force-filter.r_2": 0.5, "force-filter.r_3": 0.25}
PART_TRUTH |= {"force-filter.r_4": 0.125, "force-filter.r_w": 0.375, "force-filter.xi": 0.7}
# alpha(T) scales both slopes; what would scale yield forces has nothing to act on here
SETTINGS = Settings(model=WHOLE, per="all", seed=1, fixed=(("temperature.b_yield", 0.0),))


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """All kinds of tests, made by the complete model."""
    return write_tests(tmp_path_factory.mktemp("whole"), programme(), WHOLE)


@pytest.fixture(scope="module")
def staged(workspace: Workspace) -> Fit:
    return mrfit.fit.stage.run(workspace, replace(SETTINGS, optimizer="staged"))


def test_the_segments_of_every_log_are_the_kind_of_test_it_was_made_as(workspace: Workspace) -> None:
    prepared = prepare(read_dataset(workspace), Settings(model=WHOLE, per="all"))
    group = build_group("all", prepared.groups["all"], prepared.recordings, prepared.assembly, split=False)
    found = {b.segment.recording: kind_of(b, prepared.assembly.spec.inputs) for b in group.search}
    assert len(found) == len(programme(KINDS[:4]))
    assert all(test == TEST_NAMES[name.partition("-")[0]] for name, test in found.items())


def test_samples_near_reversals_of_a_constant_speed_count_nothing(workspace: Workspace) -> None:
    prepared = prepare(read_dataset(workspace), Settings(model=WHOLE, per="all"))
    group = build_group("all", prepared.groups["all"], prepared.recordings, prepared.assembly, split=False)
    block = next(b for b in group.search if b.segment.recording == "speed-0.25-1.6")
    kept = settled(block, prepared.assembly.spec.inputs)
    reversals = np.flatnonzero(np.diff(np.sign(block.drive[0])) != 0) + 1
    since = [int(n - reversals[reversals <= n].max(initial=0)) for n in block.nodes[:, 0]]
    late = np.array(since) >= 100  # of the 200 samples of a stroke
    assert 0.4 < late.mean() < 0.6
    assert np.mean((kept.counts > 0) == late) > 0.98
    sine = next(b for b in group.search if b.segment.recording.startswith("sine"))
    assert settled(sine, ("displacement",)) is sine


def test_two_stages_and_joint_refinement_recover_what_was_planted(tmp_path: Path) -> None:
    made = write_tests(tmp_path, programme(("speed", "sine")), PART, PART_TRUTH)
    fit = mrfit.fit.stage.run(made, Settings(model=PART, per="all", optimizer="staged"))
    stages, whole = fit.results[0].stages, next(m for m in fit.metrics if m.condition == "all")
    assert [(s.test, len(s.segments)) for s in stages] == [("constant-speed", 9), ("sine", 6)]
    assert all(s.cost <= 1.05 * 8.0 and s.evaluations > 0 for s in stages)
    assert not [w for w in fit.results[0].warnings if w.kind == "stage-skipped"]
    found = {p.name: p for p in fit.results[0].parameters}
    static = stages[0].parameters
    assert static == ["c_pre", "c_post", "a", "b", "f0"] and all(found[n].identifiable for n in static)
    missed = [n for n in static if not found[n].low <= PART_TRUTH[n] <= found[n].high]
    assert len(missed) <= 1, missed
    assert whole.rmse <= 1.01 * whole.noise_floor


@pytest.mark.slow
def test_stages_and_joint_refinement_recover_what_was_planted(staged: Fit) -> None:
    result = staged.results[0]
    found = {p.name: p for p in result.parameters}
    del found["temperature.b_yield"]
    assert all(p.identifiable for p in found.values())
    # poles of one filter have no order of their own
    for names in (("p1", "p2", "p3", "p4"), ("q1", "q2")):
        poles = sorted((found[n] for n in names), key=lambda p: float(p.value))
        found |= dict(zip(names, poles, strict=True))
    missed = [n for n, p in found.items() if not p.low <= TRUTH[n] <= p.high]
    assert len(missed) <= 1, missed
    whole = {m.role: m for m in staged.metrics if m.condition == "all"}
    assert whole["train"].rmse <= 1.01 * whole["train"].noise_floor
    assert whole["holdout"].rmse <= 1.02 * whole["holdout"].noise_floor


@pytest.mark.slow
def test_every_stage_says_which_segments_it_used_and_ends_near_the_noise(staged: Fit) -> None:
    stages = staged.results[0].stages
    assert [s.test for s in stages] == list(TEST_NAMES.values())
    assert [len(s.segments) for s in stages] == [9, 6, 2, 1]
    assert stages[0].parameters == ["c_pre", "c_post", "a", "b", "f0"]
    assert all(s.cost <= 1.05 * 8.0 and s.evaluations > 0 for s in stages)
    assert not [w for w in staged.results[0].warnings if w.kind == "stage-skipped"]


def test_a_stage_without_its_tests_is_skipped_in_one_line_and_its_parameters_wait(tmp_path: Path) -> None:
    made = write_tests(tmp_path, programme(("sine", "step")), "hammerstein-wiener")
    fit = mrfit.fit.stage.run(made, Settings(model="hw-static+current-lag", optimizer="staged", per="all"))
    result = fit.results[0]
    first, second = result.stages
    assert first.segments == [] and "cost" not in plain(first)
    assert second.parameters == ["c_pre", "c_post", "a", "b", "f0", "current-lag.tau", "current-lag.t_d"]
    said = [w.text for w in result.warnings if w.kind == "stage-skipped"]
    assert len(said) == 1 and "\n" not in said[0]
    assert "static map C" in said[0] and "constant speed" in said[0]
    assert warnings(result.stages[1:]) == []
    assert f"fitted with those of the {second.stage}" in said[0]
    alone = warnings([second, replace(first, stage="last")])
    assert len(alone) == 1 and alone[0].text.endswith("were fitted only in the joint refinement")


def test_models_without_stages_or_fits_per_condition_are_refused() -> None:
    assert not stages_of("bingham") and stages_of("hw-static+current-filter")
    with pytest.raises(ConfigError, match="'bingham' has no stages of identification; hammerstein-wiener, hw-static"):
        check(Settings(model="bingham", optimizer="staged", per="all"))
    with pytest.raises(ConfigError, match="add --per all"):
        check(Settings(model="hammerstein-wiener", optimizer="staged"))


@pytest.mark.slow
def test_ablation_falls_out_of_the_chain(tmp_path: Path) -> None:
    made = write_tests(tmp_path, programme(("speed", "sine", "step", "road")), "hammerstein-wiener")
    settings = mrfit.compare.stage.Settings(models=CHAIN, optimizer="staged", per="all")
    table = {m.model: m for m in mrfit.compare.stage.run(made, settings).models}
    static, magnetisation, hysteresis, complete = (table[name] for name in CHAIN)
    for role in ("train_rmse", "holdout_rmse"):
        assert complete[role] < hysteresis[role] < static[role]
        assert complete[role] < magnetisation[role] < static[role]
        assert complete[role] == pytest.approx(8.0, rel=0.05)
    assert hysteresis.holdout_rmse > 5 * complete.holdout_rmse


@pytest.mark.slow
def test_stages_end_no_worse_than_a_direct_search(workspace: Workspace, staged: Fit) -> None:
    direct = mrfit.fit.stage.run(workspace, SETTINGS)
    assert staged.results[0].cost <= 1.0005 * direct.results[0].cost
    evaluations = sum(s.evaluations for s in staged.results[0].stages)
    assert evaluations + staged.results[0].evaluations < direct.results[0].evaluations


def test_parameters_of_stages_are_those_of_the_models() -> None:
    for model in ("hammerstein-wiener", "hw-static"):
        patterns = {p for s in stages_of(model) for p in s.parameters}
        names = {*assemble("hammerstein-wiener").spec.names, "force-filter.*", "current-filter.*", "current-lag.*"}
        assert patterns == names | {"temperature.b_viscous", "temperature-polynomial.*"}
