"""What a preview tells a newcomer."""

import sys
from pathlib import Path

import pytest

from mrfit.cli import output
from mrfit.cli.console import print_table
from mrfit.core import registry
from mrfit.errors import ConfigError
from mrfit.ingest.stage import Settings, preview
from mrfit.io.schemas.fit import Quantity
from mrfit.report.tables import _meaning
from mrfit.simulate.current_dependence import CurrentDependence, Order, expanded
from tests.ingest.samples import WRITERS


def test_preview_names_what_is_missing_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one.txt", "two.txt"):
        (tmp_path / name).write_text("".join(f"{k * 0.01:.2f} {k % 7} {k % 5}\n" for k in range(50)))
    WRITERS["rigol"]().write(tmp_path)
    WRITERS["delimited"]().write(tmp_path)
    output.preview(preview([tmp_path], Settings()))
    printed = capsys.readouterr().out
    assert printed.count("refused ") == 3  # two files, and the column of that name
    assert printed.count("to read these 2: `mrfit ingest LOGS --suggest-map` writes a channel map") == 1
    assert "NewFile1.csv: no channel a model takes" in printed
    assert "log.csv: no channel" not in printed


def test_a_number_stays_whole_in_a_narrow_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "50")
    row = ["a condition with a long name", *(0.00012345 * k for k in range(1, 9))]
    print_table("Errors", ["condition", *map(str, range(8))], [row])
    printed = capsys.readouterr().out
    assert all(f"{v:.4g}" in printed for v in row[1:] if isinstance(v, float))


def test_preview_of_refused_files_alone_prints_no_empty_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty.csv").write_text("")
    output.preview(preview([tmp_path], Settings()))
    assert "What would be read" not in (printed := capsys.readouterr().out)
    assert "to read it: " in printed


def test_every_stage_without_a_test_is_told_and_conditions_are_counted_once(
    capsys: pytest.CaptureFixture[str],
) -> None:
    skipped = [{"kind": "stage-skipped", "text": f"no stage of the {name}"} for name in ("map", "filter")]
    output.warnings({"warnings": [], "results": [{"condition": "all", "warnings": skipped}]})
    assert capsys.readouterr().out.splitlines() == [
        "  warning stage-skipped: all: no stage of the map",
        "  warning stage-skipped: all: no stage of the filter",
    ]
    bound = [{"kind": "at-bound", "text": "n ended at a bound"}]
    results = [{"condition": name, "warnings": bound} for name in ("a", "b")]
    output.warnings({"warnings": [], "results": results})
    assert capsys.readouterr().out == "  warning at-bound: a (and 1 more condition): n ended at a bound\n"


def test_a_fit_tells_what_was_chosen_and_rejected_of_laws_of_current(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = {
        "name": "f",
        "per": "all",
        "model": "tanh",
        "optimizer": "auto",
        "seed": 0,
        "skipped": False,
        "output": "force",
    }
    told |= {"metrics": [], "results": [], "warnings": [], "current_choice": {"text": ["fy: order 2; rejected log2"]}}
    output.fit(told, tmp_path)
    assert "  fy: order 2; rejected log2\n" in capsys.readouterr().out


def test_errors_carry_their_units(capsys: pytest.CaptureFixture[str]) -> None:
    row = {
        "condition": "a",
        "role": "predict",
        "samples": 9,
        "rmse": 3.0,
        "nrmse": 0.0213,
        "noise_floor": 1.0,
        "esr": 2.0,
    }
    told = {
        "fit": "f",
        "output": "force",
        "metrics": [row],
        "used": {"a#0": "sine-1A"},
        "outdated": False,
        "reasons": [],
        "refused": [],
    }
    told |= {"conditions": {"a#0": "sine-2A"}, "findings": ["a: 3 gaps"]}
    output.predict({**told, "warnings": [], "band": "low to high holds 95 of 100"})
    printed = capsys.readouterr().out
    assert all(head in printed for head in ("rmse (N)", "nrmse (%)", "noise_floor (N)", "esr (%)", "fit (%)"))
    assert "2.13" in printed and "0.0213" not in printed
    told_band = "95 % band: low to high holds 95 of 100"
    nearest = "a#0: parameters of sine-1A, the nearest to sine-2A that was fitted"
    assert f"{nearest}\n{told_band}\n  a: 3 gaps" in printed


def test_many_conditions_are_compared_in_tables_that_cut_no_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    conditions = [f"sine-{k}Hz-0.0125m-1.5A" for k in range(1, 13)]
    metrics = [
        {"fit": "bingham.lsq", "model": "bingham", "role": "train", "condition": c, "nrmse": 0.1} for c in conditions
    ]
    model = {"fit": "bingham.lsq", "model": "bingham", "output": "force", "parameters": 3, "evaluations": 9}
    model |= {"current_orders": {}, "warnings": []}
    told = {
        "settings": {"per": "all"},
        "models": [model],
        "metrics": metrics,
        "seconds": {},
        "warnings": [],
        "left_out": [],
        "kept": [],
        "dropped": {},
    }
    output.compare_models(told, tmp_path)
    printed = capsys.readouterr().out
    assert all(c in printed for c in conditions)
    assert printed.count("bingham") == 2 + printed.count("NRMSE of force in percent")


@pytest.mark.parametrize(("name", "told"), [("mwoa", ("--opt-set", "N_d", "1.2", "antibodies")), ("lsq", ())])
def test_options_of_an_optimizer_are_shown(
    name: str, told: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    output.show(output.item(name))
    printed = capsys.readouterr().out
    assert all(word in printed for word in told)
    assert ("--opt-set" in printed) == bool(told)


def test_a_fault_of_many_logs_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    output._say_once(
        ["a: off by 0.5 mm", "b: off by 0.7 mm", "c: clipped", "b: off by 0.9 mm", "d: clipped", "whole remark", "x"]
    )
    told = [line.strip() for line in capsys.readouterr().out.split("\n")]
    like = "a: off by 0.5 mm (and the like, with other numbers, in 1 more)"
    assert told[:4] == [like, "c and 1 more: clipped", "whole remark", "x"]


def test_a_list_of_models_says_what_they_predict_and_one_of_effects_does_not() -> None:
    predicted = {r["name"]: r["predicts"] for r in output.registry_rows("models")}
    assert (predicted["boucwen-flux"], predicted["spencer"]) == ("flux", "force")
    assert all(set(r) == {"name", "title"} for r in output.registry_rows("effects"))


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("fits", "mrfit status"),
        ("models", "mrfit list models"),
        ("bingham.auto.all", "mrfit show bingham"),
        ("tanh+current-lag.auto", "mrfit show tanh"),
        ("binghm", "did you mean bingham"),
    ],
)
def test_what_is_no_item_leads_to_the_command_that_shows_it(name: str, told: str) -> None:
    with pytest.raises(ConfigError, match=told.replace("+", r"\+")):
        output.item(name)


@pytest.mark.parametrize(
    ("order", "told"), [(2, 0), ("plain2", 0), ("sat2", 3), ("log1", 2), ("1:0.5:1", 4), ("1/0.5/1", 4)]
)
def test_coefficients_are_explained_unless_they_are_of_plain_powers_of_the_current(order: Order, told: int) -> None:
    spec = expanded(registry.load("model", "tanh").SPEC, CurrentDependence((("fy", order),), 0.0, 2.0))
    assert sum(bool(output.OTHER_COEFFICIENT.match(q.text)) for q in spec.derived) == told


def test_a_law_of_a_current_that_saturates_is_a_formula_in_latex() -> None:
    spec = expanded(registry.load("model", "tanh").SPEC, CurrentDependence((("fy", "sat2"),), 0.0, 2.0))
    one = spec.derived[2]
    meaning = _meaning(Quantity(name=one.name, value=1.0, unit=one.unit, text=one.text))
    assert meaning.latex == r"coefficient of $(1\,\mathrm{A}\tanh(i/1\,\mathrm{A}))^2$"
