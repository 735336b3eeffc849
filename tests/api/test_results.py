"""Results of a call by what their files say: fits, discoveries, comparisons and advice made by hand."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrfit
from mrfit.advise.stage import AdviceFiles
from mrfit.api.advice import Advice
from mrfit.api.comparison import Comparison, OptimizerComparison
from mrfit.api.discovery import Discovery
from mrfit.api.drawing import plot
from mrfit.api.fitting import FitResult
from mrfit.api.saved import load
from mrfit.core import registry
from mrfit.errors import ConfigError, DataError
from mrfit.io.schemas.advice import AdviceFile, AdvisedTest, Pair, Width
from mrfit.io.schemas.compare import LeftOut, ModelErrors, ModelRow, ModelsFile, OptimizersFile
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.io.schemas.fit import Caution, Fit, MetricRow, Quantity, Result

ERRORS = MetricRow(condition="all", role="train", samples=9, rmse=20.0, nrmse=0.01)


def result(condition: str = "sine", **more: Any) -> Result:
    parameters = [Quantity(name="fy", value=500.0, unit="N", low=490.0, high=None)]
    given = {"evaluations": 30, "parameters": parameters, "stopped": "converged", **more}
    return Result(condition=condition, **given)


def fit(*results: Result, **more: Any) -> Fit:
    given = {"name": "f", "model": "bingham", "optimizer": "lsq", "output": "force", "metrics": [ERRORS], **more}
    return Fit(results=list(results), **given)


def test_a_fit_succeeded_where_no_search_was_ended_by_its_budget() -> None:
    assert FitResult(fit(result(), result("other"))).success
    assert not FitResult(fit(result(), result("other", budget_spent=True))).success
    assert FitResult(fit(result(), result("other"))).nfev == 60


def test_the_message_of_several_searches_names_their_conditions() -> None:
    assert FitResult(fit(result())).message == "converged"
    assert FitResult(fit(result(), result("other", stopped="stalled"))).message == "sine: converged; other: stalled"


def test_warnings_are_of_the_whole_fit_of_its_law_and_of_its_conditions() -> None:
    own = result(warnings=[Caution(kind="at-bound", text="fy is")])
    found = FitResult(fit(own, warnings=[Caution(kind="few", text="few tests")])).warnings
    assert [(w.kind, w.condition) for w in found] == [("few", ""), ("outdated", ""), ("at-bound", "sine")]
    assert "an older mrfit's, which does not state the code of its law" in found[1].text
    # an interval that is open is nan in the table, and quantities that follow are marked
    derived = [Quantity(name="peak", value=1.0, unit="N")]
    table = FitResult(fit(result(derived=derived))).params
    assert np.isnan(table.loc["fy", "high"]) and table["derived"].tolist() == [False, True]
    assert list(table.index) == ["fy", "peak"] and table["condition"].tolist() == ["sine", "sine"]


@pytest.mark.parametrize(("sets", "shown"), [(3, 3), (4, 1)])
def test_more_than_three_sets_of_parameters_are_counted(sets: int, shown: int) -> None:
    text = repr(FitResult(fit(*(result(f"test-{k}") for k in range(sets)))))
    assert text.count("parameter, test-") == shown
    assert ("4 sets of parameters, of which the first is shown: params has all" in text) == (sets == 4)


def test_a_fit_without_its_data_has_no_extents_and_no_figure() -> None:
    found = FitResult(fit(result()))
    assert found.extents == {} and (found.name, found.model, found.output) == ("f", "bingham", "force")
    with pytest.raises(DataError, match=r"^f: read from a file, without data: draw a prediction, fit.predict"):
        found.plot()
    with pytest.raises(DataError, match="without data"):
        plot(fit(result()), [], "loop")


EFFECT = {
    "name": "inertia",
    "parameters": [{"name": "m", "unit": "kg", "value": 40.0, "low": 39.0, "high": 41.0}],
    "aliases": [],
    "holdout_nrmse_before": 0.1,
    "holdout_nrmse_after": 0.01,
}


def discovery(verdict: str = "named", **more: Any) -> DiscoveryFile:
    whole = {
        "schema": "mrfit/discovery/1",
        "base_model": "tanh",
        "verdict": verdict,
        "effects": [EFFECT],
        "ambiguous_set": [],
        "advice": ["log another stroke"],
        "where": [],
        "gap": {"noise_floor": 0.01, "before": 0.1, "after": 0.01, "closed": 1.0},
        "candidates": [{"name": "delay", "screen": 0.0, "holdout_gain": None, "accepted": False, "reason": "no"}],
        "unexplained": {"share_of_gap": 0.0},
        "augmented_model": "tanh+inertia",
        "seed": 0,
        "data_sha256": "0",
        "key": "0",
    }
    return DiscoveryFile.of(whole | more)


def test_a_discovery_shows_its_effects_and_how_to_go_on() -> None:
    found = Discovery(discovery())
    assert (found.verdict, found.augmented_model, found.advice) == ("named", "tanh+inertia", ("log another stroke",))
    assert [e.name for e in found.effects] == ["inertia"] and found.gap.before == 0.1 and found.law_gap is None
    assert "go on with the model tanh+inertia" in repr(found) and "log another stroke" not in repr(found)
    assert found.candidates.loc["delay", "reason"] == "no" and np.isnan(found.candidates.loc["delay", "holdout_gain"])
    title, (table,), _ = found._parts()
    assert table.to_dict("records") == [
        {"effect": "inertia", "parameter": "m", "value": 40.0, "unit": "kg", "low": 39.0, "high": 41.0}
    ]
    assert found.other_laws.empty and found.confounded.empty and title
    none = Discovery(discovery("none", effects=[], augmented_model="tanh"))
    assert none._parts()[1] == [] and "go on with" not in repr(none)


def test_of_effects_that_cannot_be_told_apart_the_advice_is_shown() -> None:
    open_one = discovery("ambiguous", effects=[], ambiguous_set=["inertia", "delay"], augmented_model="tanh")
    assert "to tell inertia, delay apart: log another stroke" in repr(Discovery(open_one))


def test_a_discovery_and_a_fit_are_loaded_by_their_schema(tmp_path: Path) -> None:
    Discovery(discovery()).save(tmp_path / "d.json")
    whole = [Quantity(name=n, value=1.0) for n in ("fy", "C_inf", "f0")]
    FitResult(fit(result(parameters=whole))).save(tmp_path / "f.json")
    one, other = load(tmp_path / "d.json"), load(tmp_path / "f.json")
    assert isinstance(one, Discovery) and one.to_json() == discovery().to_json()
    assert isinstance(other, FitResult) and other.name == "f"
    (tmp_path / "table.json").write_text("time,force\n0,1\n")
    for name, said in (("table.json", "neither a fit nor a discovery"), ("none.json", "no such file")):
        with pytest.raises(DataError, match=said):
            load(tmp_path / name)
    # a file that begins as one is a damaged one, whatever stands before it
    (tmp_path / "cut.json").write_text('\n  {"schema": ')
    with pytest.raises(DataError, match="damaged"):
        load(tmp_path / "cut.json")
    content = json.loads((tmp_path / "d.json").read_text())
    (tmp_path / "later.json").write_text(json.dumps({**content, "schema": "mrfit/discovery/99"}))
    with pytest.raises(DataError, match="does not know"):
        load(tmp_path / "later.json")


def compared() -> Comparison:
    rows = [
        ModelRow(
            model=name, fit=f"{name}.auto", output="force", parameters=k, evaluations=9, current_orders={}, warnings=[],
            holdout_nrmse=0.1 * k,
        )
        for name, k in (("tanh", 1), ("bingham", 2))
    ]  # fmt: skip
    errors = [
        ModelErrors(
            model="tanh", condition="all", role="holdout", samples=9, rmse=1.0, nrmse=0.1, esr=None, fit_percent=None,
            noise_floor=None,
        )
    ]  # fmt: skip
    left_out = [LeftOut(model="boucwen-flux", reason="no flux")]
    content = ModelsFile(settings={}, models=rows, metrics=errors, left_out=left_out)
    fits = {name: FitResult(fit(result(), model=name)) for name in ("bingham", "tanh")}
    return Comparison(content, fits, {"tanh": 1.5, "bingham": 0.5})


def test_a_comparison_has_its_models_in_their_order_with_the_time_of_each() -> None:
    found = compared()
    assert list(found.table.index) == ["tanh", "bingham"] and found.table["seconds"].tolist() == [1.5, 0.5]
    assert found.table.loc["bingham", "holdout_nrmse"] == 0.2 and np.isnan(found.table.loc["tanh", "train_nrmse"])
    assert found.best.model == "tanh" and found.left_out == {"boucwen-flux": "no flux"}
    assert repr(found).startswith("Models, the best on held-out data first\n")
    assert repr(found).endswith("left out boucwen-flux: no flux")
    assert found.metrics["model"].tolist() == ["tanh"] and found.to_json()["models"][1]["model"] == "bingham"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"optimizers": "lsq", "models": ["tanh"]}, "give it as model='…', not as models"),
        ({"optimizers": "lsq"}, "optimizers are compared on one model: give model='…'"),
        ({"optimizers": ["lsq"], "model": "tanh", "sed": 1}, "there is no option 'sed'"),
        ({"models": "tanh,nosuch"}, "nosuch"),
        ({"models": "tanh", "nosuch": 1}, "there is no option 'nosuch'"),
    ],
)
def test_a_comparison_of_what_is_not_there_is_refused_before_any_work(options: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        mrfit.compare([], **options)


def test_optimizers_are_told_with_the_number_of_their_runs() -> None:
    found = OptimizerComparison(OptimizersFile(settings={"model": "tanh", "seeds": 3}, rows=[], curves=[]))
    assert found._parts()[0] == "Optimizers on tanh, 3 seeds: RMS error" and found.table.empty


def advised(*distances: tuple[float, ...], companion: bool = False) -> Advice:
    tests = [
        AdvisedTest(
            kind="sine", text=f"test {k}", numbers={}, seconds=5.0, waiting=1.0, distances=d, worth=1.0,
            drive=f"test-{k}.csv",
        )
        for k, d in enumerate(distances, start=1)
    ]  # fmt: skip
    pairs = (
        Pair(names=("a", "b"), before=1.0, separable=True),
        Pair(names=("a", "c"), before=1.0, separable=False),
        Pair(names=("b", "c"), before=1.0, separable=True),
    )
    width = Width(name="fy", unit="N", value=500.0, before=9.0, after=None)
    content = AdviceFile(
        goal="rivals", model="tanh", pairs=pairs, text=("Do this.",), tests=tuple(tests), widths=(width,), looked_at=9,
        refused=1, noise=1.0, seed=0, companion=replace(tests[0], text="beside") if companion else None,
    )  # fmt: skip
    drives = {"test-1.csv": "time,displacement\n0,0.001\n0.1,0.002\n"}
    return Advice(content, AdviceFiles(content, drives))


def test_a_test_is_as_good_as_for_the_two_rivals_that_it_separates_least() -> None:
    found = advised((5.0, 0.1, 3.0), (2.0, 0.2, 4.0), companion=True)
    # the second pair cannot be separated by this rig, whatever the test
    assert found.tests["least"].tolist() == [3.0, 2.0, 3.0]
    assert found.tests["test"].tolist() == ["test 1", "test 2", "beside"]
    assert found.widths.loc["fy", "before"] == 9.0 and np.isnan(found.widths.loc["fy", "after"])
    assert repr(found).startswith("Do this.\n") and found.to_json()["goal"] == "rivals"


def test_a_drive_is_a_table_and_another_name_is_refused_with_those_there_are() -> None:
    found = advised((1.0, 1.0, 1.0))
    assert found.drive()["displacement"].tolist() == [0.001, 0.002]
    with pytest.raises(DataError, match="no drive 'test-9.csv'; there are test-1.csv"):
        found.drive("test-9.csv")


def test_models_are_listed_with_what_their_spec_says() -> None:
    table, spec = mrfit.models(), registry.load("model", "boucwen-flux").SPEC
    row = table.loc["boucwen-flux"]
    assert (row["title"], row["output"], row["inputs"]) == (spec.title, "flux", "current")
    assert row["parameters"].split(", ") == [p.name for p in spec.params]
